//! A scripted peer against a chip: what QEMU does, and what a broken peer does.

use fx2::host::{Bench, Link};
use fx2::image::Image;
use fx2::pins::Unconnected;
use fx2::{Config, Fx2};
use sim::{MS, Ps};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use usbredir::protocol::OURS;
use usbredir::{Event, Notice, Options, Session, serve};

const DEVICE_CONNECT: u32 = 1;
const DEVICE_DISCONNECT: u32 = 2;
const RESET: u32 = 3;
const EP_INFO: u32 = 5;
const SET_CONFIGURATION: u32 = 6;
const CONFIGURATION_STATUS: u32 = 8;
const SET_ALT_SETTING: u32 = 9;
const ALT_SETTING_STATUS: u32 = 11;
const START_ISO_STREAM: u32 = 12;
const STOP_ISO_STREAM: u32 = 13;
const ISO_STREAM_STATUS: u32 = 14;
const START_INTERRUPT: u32 = 15;
const STOP_INTERRUPT: u32 = 16;
const CANCEL: u32 = 21;
const DISCONNECT_ACK: u32 = 24;
const CONTROL: u32 = 100;
const BULK: u32 = 101;
const ISO: u32 = 102;

/// A packet: type, id, body.
type Packet = (u32, u64, Vec<u8>);

fn packet(kind: u32, id: u64, body: &[u8]) -> Vec<u8> {
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend_from_slice(&(body.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&id.to_le_bytes());
    bytes.extend_from_slice(body);
    bytes
}

fn hello() -> Vec<u8> {
    let mut body = vec![0; 64];
    body.extend_from_slice(&OURS.to_le_bytes());
    let mut bytes = vec![0; 4];
    bytes.extend_from_slice(&(body.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&[0; 4]);
    bytes.extend_from_slice(&body);
    bytes
}

/// Splits what the session sends; hello has a short id.
fn split(bytes: &[u8]) -> Vec<Packet> {
    let mut packets = Vec::new();
    let mut rest = bytes;
    while !rest.is_empty() {
        let word = |at: usize| u32::from_le_bytes(rest[at..at + 4].try_into().unwrap());
        let header = if word(0) == 0 { 12 } else { 16 };
        let end = header + word(4) as usize;
        packets.push((word(0), u64::from(word(8)), rest[header..end].to_vec()));
        rest = &rest[end..];
    }
    packets
}

struct Rig {
    fx2: Fx2,
    session: Session,
}

impl Rig {
    fn new(program: Option<&[u8]>) -> Self {
        let mut fx2 = Fx2::new(Config::default());
        if let Some(bytes) = program {
            fx2.load(&Image::raw(bytes).unwrap()).unwrap();
        }
        let mut rig = Self { fx2, session: Session::new(true) };
        rig.session.receive(&hello());
        rig
    }

    /// Lets `time` pass; returns what the session sent.
    fn pass(&mut self, time: Ps) -> Vec<Packet> {
        let mut bench = Bench { fx2: &mut self.fx2, board: &mut Unconnected };
        let end = bench.fx2.now() + time;
        while bench.fx2.now() < end {
            let until = (bench.fx2.now() + MS).min(end);
            self.session.run_until(&mut bench, until).unwrap();
        }
        split(&std::mem::take(self.session.outgoing()))
    }

    fn ask(&mut self, kind: u32, id: u64, body: &[u8]) -> Vec<Packet> {
        self.session.receive(&packet(kind, id, body));
        self.pass(5 * MS)
    }

    /// A control transfer; status and data.
    fn control(&mut self, setup: [u8; 8], data: &[u8]) -> (u8, Vec<u8>) {
        let endpoint = setup[0] & 0x80;
        let mut body = vec![endpoint, setup[1], setup[0], 0];
        body.extend_from_slice(&setup[2..]);
        body.extend_from_slice(data);
        let answers = self.ask(CONTROL, 77, &body);
        assert_eq!((answers.len(), answers[0].0, answers[0].1), (1, CONTROL, 77), "{answers:?}");
        (answers[0].2[3], answers[0].2[10..].to_vec())
    }
}

fn kinds(packets: &[Packet]) -> Vec<u32> {
    packets.iter().map(|packet| packet.0).collect()
}

/// A bulk packet as the peer writes it.
fn bulk(endpoint: u8, length: u16, data: &[u8]) -> Vec<u8> {
    let [low, high] = length.to_le_bytes();
    let mut body = vec![endpoint, 0, low, high, 0, 0, 0, 0, 0, 0];
    body.extend_from_slice(data);
    body
}

/// MOV DPTR,#address; MOV A,#value; MOVX @DPTR,A and 3 NOPs.
fn xdata(address: u16, value: u8) -> [u8; 9] {
    let [high, low] = address.to_be_bytes();
    [0x90, high, low, 0x74, value, 0xF0, 0, 0, 0]
}

#[test]
fn the_blank_chip_is_told_of_after_its_debounce() {
    let mut rig = Rig::new(None);
    assert_eq!(kinds(&rig.pass(50 * MS)), [0], "hello only");
    let told = rig.pass(300 * MS);
    assert_eq!(kinds(&told), [4, EP_INFO, DEVICE_CONNECT]);
    assert_eq!(told[2].2, [2, 0xFF, 0xFF, 0xFF, 0xB4, 0x04, 0x13, 0x86, 0x04, 0x00]);
    assert_eq!(told[0].2[..4], [1, 0, 0, 0], "one interface");
    let (status, device) = rig.control([0x80, 6, 0, 1, 0, 0, 18, 0], &[]);
    assert_eq!((status, device.len(), device[1]), (0, 18, 1));
}

#[test]
fn settings_change_the_endpoints_that_exist() {
    let mut rig = Rig::new(None);
    rig.pass(400 * MS);
    let told = rig.ask(SET_CONFIGURATION, 3, &[1]);
    assert_eq!(kinds(&told), [4, EP_INFO, CONFIGURATION_STATUS]);
    assert_eq!(told[2].2, [0, 1]);
    let told = rig.ask(SET_ALT_SETTING, 4, &[0, 1]);
    assert_eq!(kinds(&told), [4, EP_INFO, ALT_SETTING_STATUS]);
    let ep_info = &told[1].2;
    assert_eq!([ep_info[2], ep_info[16 + 6], ep_info[16 + 8], ep_info[3]], [2, 2, 2, 0xFF]);
    assert_eq!(ep_info[96 + 2 * 2..96 + 2 * 2 + 2], [0, 2], "EP2 has 512 bytes");
    assert_eq!(rig.ask(SET_ALT_SETTING, 5, &[0, 9])[0].2[0], 2, "no such setting");
}

#[test]
fn a_stall_and_an_unknown_endpoint_are_answered() {
    let mut rig = Rig::new(None);
    rig.pass(400 * MS);
    assert_eq!(rig.control([0xC0, 0xA2, 0, 0, 0, 0, 1, 0], &[]).0, 4);
    let answers = rig.ask(BULK, 9, &bulk(0x86, 512, &[]));
    assert_eq!((answers[0].0, answers[0].1, answers[0].2[1]), (BULK, 9, 3), "not configured");
    assert_eq!(kinds(&rig.ask(START_ISO_STREAM, 1, &[0x82, 8, 2])), [ISO_STREAM_STATUS]);
}

#[test]
fn a_cancelled_packet_is_answered_as_cancelled_and_once() {
    let mut rig = Rig::new(None);
    rig.pass(400 * MS);
    rig.ask(SET_CONFIGURATION, 1, &[1]);
    rig.ask(SET_ALT_SETTING, 2, &[0, 1]);
    assert_eq!(rig.ask(BULK, 30, &bulk(0x86, 512, &[])), [], "NAK for ever");
    let answers = rig.ask(CANCEL, 30, &[]);
    assert_eq!((answers.len(), answers[0].1, answers[0].2[1]), (1, 30, 1));
    assert_eq!(rig.ask(CANCEL, 30, &[]), []);
}

#[test]
fn a_reset_ends_what_is_under_way() {
    let mut rig = Rig::new(None);
    rig.pass(400 * MS);
    rig.ask(SET_CONFIGURATION, 1, &[1]);
    rig.ask(SET_ALT_SETTING, 2, &[0, 1]);
    rig.ask(BULK, 30, &bulk(0x86, 512, &[]));
    rig.ask(BULK, 31, &bulk(0x02, 3, &[1, 2, 3]));
    let answers = rig.ask(RESET, 0, &[]);
    let ended: Vec<(u64, u8)> = answers.iter().map(|packet| (packet.1, packet.2[1])).collect();
    assert_eq!(ended, [(30, 1), (31, 1)]);
    assert_eq!(rig.fx2.usb_address(), 1, "the device has its address again");
    assert_eq!(rig.control([0x80, 8, 0, 0, 0, 0, 1, 0], &[]), (0, vec![0]), "unconfigured");
}

#[test]
fn data_goes_both_ways_in_order() {
    // EP2 AUTOOUT and EP6 AUTOIN share nothing here: the host's packets stay in EP2's four buffers,
    // and EP1 IN sends one byte that the CPU armed.
    let mut code = Vec::new();
    for (address, value) in [
        (0xE600, 0x10),
        (0xE612, 0xA0),
        (0xE618, 0x01),
        (0xE618, 0x11),
        (0xE7C0, 0x5A),
        (0xE68F, 1),
    ] {
        code.extend_from_slice(&xdata(address, value));
    }
    code.extend_from_slice(&[0x80, 0xFE]);
    let mut rig = Rig::new(Some(&code));
    rig.pass(400 * MS);
    rig.ask(SET_CONFIGURATION, 1, &[1]);
    rig.ask(SET_ALT_SETTING, 2, &[0, 1]);
    let data: Vec<u8> = (0..1500u16).map(|n| n as u8).collect();
    let answers = rig.ask(BULK, 40, &bulk(0x02, 1500, &data));
    assert_eq!((answers[0].2[1], answers[0].2[2..4].to_vec()), (0, vec![0xDC, 0x05]));
    let answers = rig.ask(BULK, 41, &bulk(0x81, 512, &[]));
    assert_eq!((answers[0].2[1], answers[0].2[10..].to_vec()), (0, vec![0x5A]));
    // Two packets are short of room: the fifth and sixth wait.
    assert_eq!(rig.ask(BULK, 42, &bulk(0x02, 1500, &data)), []);
    assert_eq!(rig.ask(CANCEL, 42, &[])[0].2[1..4], [1, 0, 2], "512 bytes had gone");
}

#[test]
fn isochronous_streams_run_at_their_interval_both_ways() {
    // EP6 isochronous IN, quad: two packets of 512 bytes and one of 3. EP2 isochronous OUT, double: what
    // has come is copied to EP1 IN's buffer and sent from there.
    let mut code = Vec::new();
    for (address, value) in [
        (0xE600, 0x10),
        (0xE613, 0x20),
        (0xE615, 0x20),
        (0xE612, 0x92),
        (0xE614, 0xD0),
        (0xE618, 0x00),
        (0xE61A, 0x00),
        (0xE691, 0x80),
        (0xE691, 0x80),
        (0xF800, 0x11),
        (0xE698, 0x02),
        (0xE699, 0x00),
        (0xF800, 0x22),
        (0xE698, 0x02),
        (0xE699, 0x00),
        (0xF800, 0x33),
        (0xE698, 0x00),
        (0xE699, 0x03),
    ] {
        code.extend_from_slice(&xdata(address, value));
    }
    // again: MOV A,EP2468STAT; JB ACC.0,again; MOV DPTR,#EP2BUF; MOVX A,@DPTR; MOV DPTR,#EP1INBUF; MOVX
    code.extend_from_slice(&[0xE5, 0xAA, 0x20, 0xE0, 0xFB, 0x90, 0xF0, 0x00, 0xE0]);
    code.extend_from_slice(&[0x90, 0xE7, 0xC0, 0xF0]);
    code.extend_from_slice(&xdata(0xE68F, 1));
    code.extend_from_slice(&[0x80, 0xFE]);
    let mut rig = Rig::new(Some(&code));
    rig.pass(400 * MS);
    rig.ask(SET_CONFIGURATION, 1, &[1]);
    rig.ask(SET_ALT_SETTING, 2, &[0, 3]);
    assert_eq!(rig.ask(START_ISO_STREAM, 3, &[0x88, 8, 2])[0].2, [2, 0x88], "that one is bulk");
    let told = rig.ask(START_ISO_STREAM, 4, &[0x86, 8, 2]);
    assert_eq!((told[0].0, &told[0].2), (ISO_STREAM_STATUS, &vec![0, 0x86]));
    let packets = &told[1..];
    assert!((38..=40).contains(&packets.len()), "{} packets in 5 ms of microframes", packets.len());
    assert!(packets.iter().enumerate().all(|(n, p)| (p.0, p.1) == (ISO, n as u64)), "numbered");
    let sizes: Vec<usize> = packets.iter().map(|p| p.2.len() - 4).take(5).collect();
    assert_eq!(sizes, [512, 512, 3, 0, 0], "then nothing is there to send");
    assert_eq!([packets[0].2[4], packets[1].2[4], packets[2].2[4]], [0x11, 0x22, 0x33]);
    assert_eq!(rig.ask(STOP_ISO_STREAM, 5, &[0x86]).last().unwrap().2, [0, 0x86]);
    assert_eq!(rig.pass(5 * MS), [], "the stream has ended");

    rig.ask(START_ISO_STREAM, 6, &[0x02, 8, 2]);
    rig.session.receive(&packet(ISO, 0, &[0x02, 0, 2, 0, 0x77, 0x78]));
    assert_eq!(rig.pass(2 * MS), [], "isochronous packets are not acknowledged");
    rig.ask(SET_ALT_SETTING, 7, &[0, 1]);
    assert_eq!(rig.ask(BULK, 8, &bulk(0x81, 64, &[]))[0].2[10..], [0x77]);
}

#[test]
fn firmware_that_leaves_the_bus_comes_back_as_a_new_device() {
    // Disconnect at once, reconnect (still as the blank device) after 200 ms of counting.
    let mut code = xdata(0xE680, 0x08).to_vec();
    // R2 x R1 x R0 x 4 cycles at 12 MHz/4: 3 x 256 x 256 x 1.33 us = 262 ms.
    code.extend_from_slice(&[0x7A, 3, 0x79, 0, 0x78, 0, 0xD8, 0xFE, 0xD9, 0xFA, 0xDA, 0xF6]);
    code.extend_from_slice(&xdata(0xE680, 0x00));
    code.extend_from_slice(&[0x80, 0xFE]);
    let mut rig = Rig::new(None);
    rig.pass(400 * MS);
    assert_eq!(rig.session.take_events().len(), 1);
    rig.fx2.load(&Image::raw(&code).unwrap()).unwrap();
    assert_eq!(kinds(&rig.pass(20 * MS)), [DEVICE_DISCONNECT]);
    assert_eq!(rig.pass(800 * MS), [], "the peer has not acknowledged that it went");
    rig.session.receive(&packet(DISCONNECT_ACK, 0, &[]));
    assert_eq!(kinds(&rig.pass(400 * MS)), [4, EP_INFO, DEVICE_CONNECT]);
    let events = rig.session.take_events();
    assert!(matches!(events[..], [Event::Disconnected, Event::Connected { .. }]), "{events:?}");
}

#[test]
fn random_packets_do_no_harm() {
    let mut seed = 20u64;
    let mut random = |limit: u64| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) % limit
    };
    for _ in 0..60 {
        let mut rig = Rig::new(None);
        rig.pass(400 * MS);
        for _ in 0..40 {
            let kinds = [3, 6, 7, 8, 9, 10, 12, 13, 15, 16, 18, 21, 24, 25, 100, 101, 102, 103];
            let kind = kinds[random(18) as usize];
            let length = [0, 1, 2, 3, 4, 8, 10, 10, 12, 74][random(10) as usize];
            let mut body: Vec<u8> = (0..length).map(|_| random(256) as u8).collect();
            if kind >= 100 && length >= 10 && random(2) == 0 {
                // Half of the transfers are well-formed reads of sensible length.
                body.truncate(10);
                body[0] |= 0x80;
                body[8..].fill(0);
            }
            rig.session.receive(&packet(kind, random(50), &body));
            let mut bench = Bench { fx2: &mut rig.fx2, board: &mut Unconnected };
            let until = bench.fx2.now() + MS / 4;
            if rig.session.run_until(&mut bench, until).is_err() {
                break;
            }
        }
        rig.session.close(&mut Bench { fx2: &mut rig.fx2, board: &mut Unconnected });
        assert!(!rig.session.is_busy());
    }
}

/// What a sane peer sends, packet by packet: settings, control transfers, bulk both ways, polling,
/// cancellations, a reset, and all over again.
fn sane_session() -> Vec<Vec<u8>> {
    let control = |id, setup: [u8; 8], data: &[u8]| {
        let mut body = vec![setup[0] & 0x80, setup[1], setup[0], 0];
        body.extend_from_slice(&setup[2..]);
        body.extend_from_slice(data);
        packet(CONTROL, id, &body)
    };
    let mut packets = vec![hello()];
    for round in 0..2_u64 {
        let id = 100 * round;
        packets.extend([
            packet(SET_CONFIGURATION, id, &[1]),
            packet(SET_ALT_SETTING, id + 1, &[0, 1]),
            control(id + 2, [0x80, 6, 0, 2, 0, 0, 171, 0], &[]),
            packet(BULK, id + 3, &bulk(0x02, 700, &[7; 700])),
            packet(BULK, id + 4, &bulk(0x81, 512, &[])),
            packet(BULK, id + 5, &bulk(0x86, 16384, &[])),
            packet(CANCEL, id + 5, &[]),
            control(id + 6, [0x40, 0xA0, 0, 0x10, 0, 0, 64, 0], &[0x5A; 64]),
            control(id + 7, [0xC0, 0xA0, 0, 0x10, 0, 0, 64, 0], &[]),
            packet(SET_ALT_SETTING, id + 8, &[0, 2]),
            packet(SET_ALT_SETTING, id + 8, &[0, 3]),
            packet(START_ISO_STREAM, id + 8, &[0x86, 8, 2]),
            packet(START_ISO_STREAM, id + 8, &[0x02, 8, 2]),
            packet(ISO, id + 8, &[0x02, 0, 2, 0, 0x77, 0x78]),
            packet(SET_ALT_SETTING, id + 8, &[0, 2]),
            packet(START_INTERRUPT, id + 9, &[0x81]),
            packet(STOP_INTERRUPT, id + 10, &[0x81]),
            control(id + 11, [0x02, 1, 0, 0, 0x86, 0, 0, 0], &[]),
            packet(RESET, id + 12, &[]),
        ]);
    }
    packets
}

/// One to four accidents of a session.
fn damage(packets: &mut Vec<Vec<u8>>, random: &mut impl FnMut(usize) -> usize) {
    for _ in 0..=random(4) {
        let at = random(packets.len());
        let other = random(packets.len());
        match random(8) {
            0 => packets.swap(at, other),
            1 => packets.insert(at, packets[other].clone()),
            2 if packets.len() > 1 => drop(packets.remove(at)),
            3 => {
                let length = packets[at].len();
                packets[at].truncate(random(length + 1));
            }
            4 => {
                let mut tail = vec![random(256) as u8; random(40)];
                packets[at].append(&mut tail);
            }
            _ => {
                let places = packets[at].len().max(1);
                for _ in 0..=random(3) {
                    let place = random(places);
                    if let Some(byte) = packets[at].get_mut(place) {
                        *byte = [random(256) as u8, 0, 0xFF, *byte ^ 1 << random(8)][random(4)];
                    }
                }
            }
        }
    }
}

#[test]
fn damaged_sessions_harm_neither_the_chip_nor_the_next_session() {
    let mut seed = 4u64;
    let mut random = |limit: usize| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as usize % limit
    };
    let mut refused = 0;
    for case in 0..400 {
        let mut packets = sane_session();
        damage(&mut packets, &mut random);
        // The stream arrives in pieces that have nothing to do with packets.
        let stream = packets.concat();
        let mut rig = Rig::new(None);
        rig.session = Session::new(true);
        let mut rest = &stream[..];
        while !rest.is_empty() {
            let (piece, behind) = rest.split_at((1 + random(900)).min(rest.len()));
            rest = behind;
            rig.session.receive(piece);
            let mut bench = Bench { fx2: &mut rig.fx2, board: &mut Unconnected };
            let until = bench.fx2.now() + MS * [1, 5, 130][random(3)];
            if let Err(error) = rig.session.run_until(&mut bench, until) {
                let text = error.to_string();
                assert!(!text.is_empty() && !text.contains('\n'), "case {case}: {text}");
                refused += 1;
                break;
            }
            assert!(rig.session.outgoing().len() < 4 << 20, "case {case}: endless answers");
        }
        rig.session.close(&mut Bench { fx2: &mut rig.fx2, board: &mut Unconnected });
        // The next peer finds a chip that works.
        rig.session = Session::new(true);
        rig.session.receive(&hello());
        let told = rig.pass(600 * MS);
        assert_eq!(told.last().map(|packet| packet.0), Some(DEVICE_CONNECT), "case {case}");
        let write = rig.control([0x40, 0xA0, 0, 0x08, 0, 0, 4, 0], &[1, 2, 3, 4]);
        let read = rig.control([0xC0, 0xA0, 0, 0x08, 0, 0, 4, 0], &[]);
        assert_eq!((write.0, read), (0, (0, vec![1, 2, 3, 4])), "case {case}");
    }
    assert!((50..350).contains(&refused), "{refused} of 400 sessions were refused: a poor mixture");
}

#[test]
fn a_peer_that_vanishes_at_any_byte_leaves_a_chip_that_works() {
    let stream = sane_session()[..16].concat();
    for end in (0..stream.len()).step_by(23) {
        let mut rig = Rig::new(None);
        rig.session = Session::new(true);
        rig.session.receive(&stream[..end.min(80)]);
        rig.pass(300 * MS);
        rig.session.receive(&stream[end.min(80)..end]);
        rig.pass(MS);
        rig.session.close(&mut Bench { fx2: &mut rig.fx2, board: &mut Unconnected });
        rig.session = Session::new(true);
        rig.session.receive(&hello());
        assert_eq!(kinds(&rig.pass(400 * MS)), [0, 4, EP_INFO, DEVICE_CONNECT], "cut at {end}");
        assert_eq!(rig.control([0x80, 8, 0, 0, 0, 0, 1, 0], &[]), (0, vec![0]), "cut at {end}");
    }
}

#[test]
fn over_tcp_a_vanished_client_is_followed_by_the_next() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let client = std::thread::spawn(move || {
        for round in 0..3 {
            let mut stream = TcpStream::connect(address).unwrap();
            stream.set_read_timeout(Some(std::time::Duration::from_secs(5))).unwrap();
            stream.write_all(&hello()).unwrap();
            let mut bytes = Vec::new();
            // Until the device is told of: hello 80, infos 148 + 176, connect 26.
            while bytes.len() < 80 + 148 + 176 + 26 {
                let mut buffer = [0; 4096];
                let count = stream.read(&mut buffer).unwrap();
                assert!(count > 0);
                bytes.extend_from_slice(&buffer[..count]);
            }
            assert_eq!(split(&bytes).last().unwrap().0, DEVICE_CONNECT, "round {round}");
            // Gone in the middle of a packet.
            stream.write_all(&packet(CONTROL, 1, &[0x80; 10])[..20]).unwrap();
        }
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        let _ = stream.read(&mut [0; 80]);
    });
    let mut fx2 = Fx2::new(Config::default());
    let mut bench = Bench { fx2: &mut fx2, board: &mut Unconnected };
    let mut gone = Vec::new();
    let options = Options { duration: Some(3000 * MS), ..Options::default() };
    serve(&listener, &mut bench, options, |notice| {
        if let Notice::PeerGone(reason) = notice {
            gone.push(reason);
        }
    })
    .unwrap();
    client.join().unwrap();
    assert_eq!(gone.len(), 4, "{gone:?}");
    assert!(gone[3].as_ref().is_some_and(|reason| reason.contains("does not speak usbredir")));
    assert!(bench.fx2().now() >= 3000 * MS);
}
