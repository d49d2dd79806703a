//! Programs of random register accesses under random USB traffic: whatever they do, the chip goes on
//! and does the same again for the same seed.

mod common;

use common::Bench;
use fx2::image::Image;
use fx2::slave::Fifo;
use fx2::{Config, Fx2, PACKET_MAX, Speed};
use sim::{MS, Ps, US};

struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % limit
    }

    fn byte(&mut self) -> u8 {
        self.below(256) as u8
    }
}

/// Random accesses to the chip's registers, waveforms, buffers and SFRs, then round again. With
/// `wild`, random instructions between.
fn program(random: &mut Random, wild: bool) -> Vec<u8> {
    let mut code = Vec::new();
    while code.len() < 0x1F00 {
        let page = [0xE6, 0xE6, 0xE6, 0xE6, 0xE4, 0xE7, 0xF0, 0xF8][random.below(8) as usize];
        let (low, value) = (random.byte(), random.byte());
        match random.below(if wild { 5 } else { 4 }) {
            0 | 1 => code.extend_from_slice(&[0x90, page, low, 0x74, value, 0xF0]),
            2 => code.extend_from_slice(&[0x90, page, low, 0xE0]),
            3 => {
                // MOV sfr,# or MOV A,sfr; the core's own registers but PCON (IDLE for good).
                let sfr = 0x80 | low;
                if !mcs51::sfr::is_core(sfr) {
                    match value & 1 {
                        0 => code.extend_from_slice(&[0xE5, sfr]),
                        _ => code.extend_from_slice(&[0x75, sfr, value]),
                    }
                }
            }
            _ => code.push(value),
        }
    }
    code.extend_from_slice(&[0x02, 0x00, 0x00]);
    code
}

/// What the pins and packets of a run were.
fn run(seed: u64, wild: bool) -> (Vec<(Ps, u8)>, Vec<u8>, usize) {
    let mut random = Random(seed);
    let code = program(&mut random, wild);
    let mut fx2 = Fx2::new(Config::default());
    fx2.load(&Image::raw(&code).unwrap()).unwrap();
    let mut board = Bench { data_is_address: true, ..Bench::default() };
    let mut packets = Vec::new();
    let mut data = [0; PACKET_MAX];
    for step in 1..200u64 {
        fx2.run_until(step * 10 * US, &mut board);
        board.sensed.rdy = random.byte();
        let number = random.below(16) as u8;
        match random.below(12) {
            0 => fx2.usb_reset(),
            1 => fx2.usb_reset_done(Speed::High),
            2 => fx2.usb_suspend(),
            3 => fx2.usb_resume(),
            4 | 5 => fx2.usb_setup(std::array::from_fn(|_| random.byte())),
            6 | 7 => {
                if let fx2::InReply::Data { length, .. } = fx2.usb_in(number, &mut data) {
                    packets.extend_from_slice(&data[..length]);
                }
            }
            8 => fx2.push_serial(usize::from(number & 1), random.byte()),
            9 => {
                let fifo = [Fifo::Ep2, Fifo::Ep4, Fifo::Ep6, Fifo::Ep8][usize::from(number & 3)];
                let now = fx2.now();
                fx2.slave_write(fifo, &[0x1234; 700], now, now + 5 * US);
                fx2.slave_read(fifo, &mut [0; 700], now, now + 5 * US);
                fx2.slave_packet_end(fifo);
            }
            _ => {
                let length = random.below(PACKET_MAX as u64 + 1) as usize;
                fx2.usb_out(number, random.below(2) == 1, &data[..length]);
            }
        }
    }
    fx2.run_until(3 * MS, &mut board);
    assert!(fx2.now() >= 3 * MS && fx2.now() < 3 * MS + 10 * US, "seed {seed}");
    let pins = board.seen.iter().map(|(at, driven)| (*at, driven.ctl)).collect();
    (pins, packets, fx2.diagnostics().len())
}

#[test]
fn no_access_stops_the_chip() {
    for seed in 0..150 {
        run(seed, false);
        run(seed, true);
    }
}

#[test]
fn a_seed_gives_the_same_run() {
    for seed in 1000..1010 {
        assert!(run(seed, true) == run(seed, true), "seed {seed}");
    }
}

/// Sets up random waveforms, endpoints and flags, triggers them now and then, and in between either
/// looks at the GPIF's registers or minds its own business.
fn gpif_program(random: &mut Random) -> Vec<u8> {
    let mut code = vec![0x02, 0x01, 0x00];
    code.resize(0x53, 0);
    // INT4: counts in 0x40, clears EXIF and the first of its requests.
    code.extend_from_slice(&[0x05, 0x40, 0x53, 0x91, 0xBF, 0x75, 0xA2, 0, 0x32]);
    code.resize(0x100, 0);
    let xdata = |code: &mut Vec<u8>, address: u16, value: u8| {
        let [high, low] = address.to_be_bytes();
        code.extend_from_slice(&[0x90, high, low, 0x74, value, 0xF0, 0, 0, 0]);
    };
    let word_wide = random.below(2) as u8;
    let settings = [
        (0xE600, 0x10),
        (0xE601, [0xE2, 0xA2][random.below(2) as usize]),
        (0xE612, [0xA0, 0xA2][random.below(2) as usize]),
        (0xE614, [0xE0, 0xE2][random.below(2) as usize]),
        (0xE618, 0x10 + random.below(2) as u8 * 0x20 + word_wide),
        (0xE61A, 0x08 + random.below(2) as u8 * 0x40 + word_wide),
        (0xE6F3, random.byte() & 0xE0),
        (0xE6D2, random.below(3) as u8),
        (0xE6D3, random.below(2) as u8),
        (0xE6E2, random.below(3) as u8),
        (0xE6E3, random.below(2) as u8),
        (0xE668, 0x02),
        (0xE660, [0, 0, 1, 3][random.below(4) as usize]),
        (0xE654, [0, 0, 0, 7][random.below(4) as usize]),
    ];
    for (address, value) in settings {
        xdata(&mut code, address, value);
    }
    for address in 0xE400..0xE480_u16 {
        let value = match address >> 3 & 3 {
            0 => random.byte() & 0xBF,
            1 => random.byte() & if random.below(8) == 0 { 0x3F } else { 0x0F },
            _ => random.byte(),
        };
        xdata(&mut code, address, value);
    }
    code.extend_from_slice(&[0x75, 0xE8, 0xE4, 0x75, 0xA8, 0x80]);
    let start = code.len() as u16;
    for _ in 0..8 {
        xdata(&mut code, 0xE6D0, random.below(8) as u8);
        xdata(&mut code, 0xE6D1, random.byte());
        let trigger = [0x06, 0x06, 0x00, 0x04][random.below(4) as usize];
        code.extend_from_slice(&[0x75, 0xBB, trigger]);
        // MOV R7,#n; DJNZ R7,$; then a look, an abort, or nothing.
        code.extend_from_slice(&[0x7F, random.byte(), 0xDF, 0xFE]);
        match random.below(4) {
            0 => code.extend_from_slice(&[0xE5, 0xBB, 0xE5, 0xAC]),
            1 => xdata(&mut code, 0xE6F5, 1),
            2 => code.extend_from_slice(&[0x90, 0xE6, 0xD1, 0xE0]),
            _ => {}
        }
    }
    code.push(0x02);
    code.extend_from_slice(&start.to_be_bytes());
    code
}

/// A board like [`fx2::pins::Unconnected`] that is called at every edge.
struct Watching;

impl fx2::pins::Board for Watching {
    fn drive(&mut self, _now: Ps, _driven: &fx2::pins::Driven) {}

    fn sense(&mut self, _now: Ps) -> fx2::pins::Sensed {
        fx2::pins::Sensed::default()
    }

    fn i2c_start(&mut self, _now: Ps, _address_and_direction: u8) -> bool {
        false
    }

    fn i2c_write(&mut self, _now: Ps, _byte: u8) -> bool {
        false
    }

    fn i2c_read(&mut self, _now: Ps, _acknowledge: bool) -> u8 {
        0xFF
    }

    fn i2c_stop(&mut self, _now: Ps) {}
}

/// Everything that can be seen of a chip with random GPIF work and random traffic.
fn gpif_run(seed: u64, board: &mut impl fx2::pins::Board) -> Vec<String> {
    let mut random = Random(seed);
    let code = gpif_program(&mut random);
    let mut fx2 = Fx2::new(Config::default());
    fx2.load(&Image::raw(&code).unwrap()).unwrap();
    fx2.usb_reset_done(Speed::High);
    let mut seen = Vec::new();
    let mut data = [0; PACKET_MAX];
    let mut toggle = false;
    for _ in 0..60 {
        let until = fx2.now() + random.below(400 * US);
        fx2.run_until(until, board);
        let read = fx2.usb_in(6, &mut data);
        let packet = [random.byte(); 512];
        let wrote = fx2.usb_out(2, toggle, &packet[..1 + random.below(512) as usize]);
        toggle ^= wrote == fx2::OutReply::Ack;
        let registers: Vec<u8> = (0x30..0x48).map(|at| fx2.cpu().iram()[at]).collect();
        let pins = fx2.driven();
        seen.push(format!("{} {read:?} {wrote:?} {registers:?} {pins:?}", fx2.cycles()));
        seen.push(format!("{:?}", &data[..16]));
    }
    seen.push(format!("{:?}", fx2.diagnostics()));
    seen
}

#[test]
fn a_gpif_on_an_empty_board_does_the_same_as_one_that_is_watched() {
    for seed in 0..150 {
        let watched = gpif_run(seed, &mut Watching);
        let still = gpif_run(seed, &mut fx2::pins::Unconnected);
        for (step, (a, b)) in watched.iter().zip(&still).enumerate() {
            assert_eq!(a, b, "seed {seed}, step {step}");
        }
    }
}
