//! Both eyes to the PC, with the firmware images as CMake's `firmware` preset builds them: through the
//! cameras' registers, FPGA, frame memory, slave FIFO and USB, in simulated time.
//!
//! `cargo run --release -p twin --example stream_figures` prints the figures that are asserted here.

use std::path::Path;
use std::sync::OnceLock;

use common_sys::constants as c;
use common_sys::link::registers;
use fx2::host::{Host, HostError, Link, Request};
use sim::{MS, Ps, SECOND, US};
use stream::Findings;
use twin::desk::Desk;
use twin::receiver::{Receiver, Settings};
use twin::robot::{Images, Robot};
use twin::sensor::Fault;
use virtex::bitstream;
use virtex::design::Function;
use virtex::store::{Entry, pack};

const SMALL: Settings = Settings { large: false, pattern: false, rate: 40 };
const LARGE: Settings = Settings { large: true, pattern: false, rate: 30 };

fn built(path: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../build/firmware").join(path);
    std::fs::read(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware",
            path.display()
        )
    })
}

/// A robot whose FPGA and cameras are up, and a PC that has enumerated it.
fn desk(function: Function, mut host: Host) -> (Desk, Receiver) {
    static SLOTS: [OnceLock<Vec<u8>>; 2] = [OnceLock::new(), OnceLock::new()];
    let flash = SLOTS[usize::from(function == Function::Capture)].get_or_init(|| {
        let bits = bitstream::make(function, &bitstream::Options::default());
        pack(&[Entry::from_file(0, &bits, "test".into()).expect("a good stream")], 0)
    });
    let images = Images {
        fx2: built("fx2-firmware/fx2-firmware.ihx"),
        khepera: built("khepera-firmware/khepera-firmware.elf"),
        flash: flash.clone(),
    };
    let mut desk = Desk::new(Robot::new(&images).expect("good images"), 5);
    host.enumerate(&mut desk).expect("it enumerates");
    let settled = desk.robot.now() + 100 * MS;
    desk.run_until(settled);
    let mut receiver = Receiver::new(host);
    receiver.measure_from(desk.robot.turret.fpga.started());
    (desk, receiver)
}

/// The robot turns on the spot, so that every picture is a new one.
fn turn(desk: &mut Desk) {
    desk.robot.base.serial_send(b"start 0\r\n");
}

fn run(desk: &mut Desk, receiver: &mut Receiver, settings: &Settings, time: Ps) {
    receiver.start(desk, settings).expect("it starts");
    receiver.read_for(desk, time).expect("it streams");
    receiver.stop(desk).expect("it ends");
}

fn assert_clean(desk: &Desk, found: &Findings) {
    assert!(found.all_right(), "{found:#?}");
    assert_eq!(desk.robot.diagnostics(), [""; 0]);
    assert_eq!(desk.robot.turret.report(), [""; 0]);
}

#[test]
fn ten_seconds_of_320x240_arrive_without_a_gap_and_with_the_right_reports() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    turn(&mut desk);
    run(&mut desk, &mut receiver, &SMALL, 10 * SECOND);
    let counts = receiver.counts;
    let found = receiver.finish();
    assert_clean(&desk, &found);
    assert_eq!(found.lost, 0);
    assert!((399..=402).contains(&found.pairs), "{} pairs", found.pairs);
    assert_eq!(found.reports, found.pairs);
    // 0.42 ms for the report, 307,200 bytes at 53.2 MB/s, and the poll.
    assert!(counts.latency_max < 7 * MS, "{} us", counts.latency_max / US);
}

#[test]
fn ten_seconds_of_640x480_arrive_without_a_gap_and_with_the_right_reports() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    turn(&mut desk);
    run(&mut desk, &mut receiver, &LARGE, 10 * SECOND);
    let counts = receiver.counts;
    let found = receiver.finish();
    assert_clean(&desk, &found);
    assert_eq!(found.lost, 0);
    assert!((298..=302).contains(&found.pairs), "{} pairs", found.pairs);
    assert_eq!(found.reports, found.pairs);
    assert!(counts.latency_max < 25 * MS, "{} us", counts.latency_max / US);
}

#[test]
fn registers_that_change_while_it_streams_are_told_with_every_pair() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    turn(&mut desk);
    receiver.start(&mut desk, &SMALL).expect("it starts");
    for (n, register) in (0..).zip(registers().iter().filter(|register| register.is_param)) {
        let (low, high) = register.range.expect("parameters can be written");
        let value = if n % 2 == 0 { low } else { high };
        receiver.set(&mut desk, register.address.into(), value).expect("it is written");
        assert_eq!(receiver.get(&mut desk, register.address.into()).expect("it is read"), value);
        receiver.read_for(&mut desk, 31 * MS).expect("it streams");
        receiver.set(&mut desk, register.address.into(), register.reset).expect("it is written");
    }
    receiver.stop(&mut desk).expect("it ends");
    let found = receiver.finish();
    assert_clean(&desk, &found);
    assert!(found.reports == found.pairs && found.pairs > 21, "{found:?}");
}

#[test]
fn when_the_lights_are_switched_the_exposure_follows_and_reports_say_so() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    receiver.start(&mut desk, &SMALL).expect("it starts");
    let mut unsettled_after = |desk: &mut Desk, lamps: f32| {
        let before = receiver.findings().unsettled;
        desk.robot.turret.cameras.lamps = lamps;
        receiver.read_for(desk, SECOND).expect("it streams");
        (receiver.findings().unsettled - before, desk.brightness())
    };
    let (none, full) = unsettled_after(&mut desk, 1.0);
    assert_eq!(none, 0, "steady light");
    for lamps in [0.4, 1.0] {
        let (unsettled, bright) = unsettled_after(&mut desk, lamps);
        assert!((4..40).contains(&unsettled), "{unsettled} pairs, lamps {lamps}");
        assert!((0.85..1.15).contains(&(bright / full)), "{bright} of {full}, lamps {lamps}");
        assert_eq!(unsettled_after(&mut desk, lamps).0, 0, "and then it is settled");
    }
    receiver.stop(&mut desk).expect("it ends");
    assert_clean(&desk, &receiver.finish());
}

/// Megabytes a second of the test pattern, and the share of its cycles that the FX2's CPU was awake.
fn pattern_rate(packets: u8) -> (f64, f64) {
    let mut host = Host::new();
    host.set_packet_limit(packets);
    let (mut desk, mut receiver) = desk(Function::Capture, host);
    let settings = Settings { pattern: true, ..SMALL };
    receiver.start(&mut desk, &settings).expect("it starts");
    receiver.read_for(&mut desk, 10 * MS).expect("it streams");
    let (bytes, began) = (receiver.counts.bytes, desk.robot.now());
    let cycles = desk.fx2().cycles();
    receiver.read_for(&mut desk, 500 * MS).expect("it streams");
    let seconds = (desk.robot.now() - began) as f64 / SECOND as f64;
    let rate = (receiver.counts.bytes - bytes) as f64 / seconds / 1e6;
    let load = (desk.fx2().cycles() - cycles) as f64 / (12e6 * seconds);
    receiver.stop(&mut desk).expect("it ends");
    assert_clean(&desk, &receiver.finish());
    (rate, load)
}

#[test]
fn the_pattern_fills_the_bus_at_13_and_at_11_packets_without_the_cpu() {
    let (rate, load) = pattern_rate(13);
    assert!(rate >= 53.0, "{rate} MB/s at 13 packets");
    let (slower, _) = pattern_rate(11);
    assert!(slower >= 44.9, "{slower} MB/s at 11 packets");
    // Timer 0 wakes it 61 times a second; a CPU that touched every packet would need 100,000 cycles
    // for that alone.
    assert!(load < 0.005, "{load}");
}

#[test]
fn a_client_that_pauses_loses_whole_pairs_and_both_sides_count_the_same() {
    for (settings, seed) in [(SMALL, 1), (LARGE, 2)] {
        let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
        receiver.start(&mut desk, &settings).expect("it starts");
        receiver.read_with_pauses(&mut desk, 6 * SECOND, seed).expect("it streams");
        receiver.stop(&mut desk).expect("it ends");
        let lost = receiver.get(&mut desk, c::FPGA_REG_LOST).expect("a register");
        let found = receiver.finish();
        assert_clean(&desk, &found);
        assert!(found.lost > 0, "the pauses are too short to tell anything");
        let [number, sent, end_lost] = found.end.expect("an end record");
        assert_eq!((u64::from(sent), u64::from(end_lost)), (found.pairs, found.lost));
        assert_eq!(number, sent + end_lost);
        assert_eq!(u32::from(lost), end_lost);
    }
}

/// Ends, restarts and changes of format at moments that fall anywhere within a frame: what comes
/// afterwards is a stream from its beginning, never a byte of the one before.
#[test]
fn start_stop_and_format_change_at_any_moment_leave_no_stale_bytes() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    for n in 0..24_u64 {
        let settings = if n % 3 == 0 { LARGE } else { SMALL };
        receiver.start(&mut desk, &settings).expect("it starts");
        let time = 61 * MS + n * 7_919 * US % (90 * MS);
        receiver.read_for(&mut desk, time).expect("only whole records come");
        match n % 4 {
            0 => receiver.stop(&mut desk).expect("it ends"),
            1 => receiver.choose(&mut desk, c::USB_ALTERNATE_CONTROL).expect("it is left"),
            2 => receiver.set(&mut desk, c::FPGA_REG_STREAM, 0).expect("it is cut"),
            _ => {}
        }
    }
    run(&mut desk, &mut receiver, &SMALL, 200 * MS);
    let found = receiver.finish();
    // Eyes without their other are the last of a stream that was cut; everything else is right.
    assert_eq!(
        (found.sessions, found.counts_differ, found.reports_differ),
        (25, 0, 0),
        "{found:?}"
    );
    assert!(found.disorder <= u64::from(found.unended), "{found:?}");
    assert_eq!(found.unended, 18, "{found:?}");
    assert_eq!(desk.robot.turret.report(), [""; 0]);
}

#[test]
fn the_flash_can_be_used_again_after_a_stream() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    run(&mut desk, &mut receiver, &SMALL, 100 * MS);
    receiver.choose(&mut desk, c::USB_ALTERNATE_CONTROL).expect("it is left");
    let boot = Request {
        kind: 0x40,
        request: c::REQUEST_CONFIG_BOOT as u8,
        value: c::CONFIG_BOOT_DEFAULT as u16,
        index: 0,
    };
    receiver.host.control_out(&mut desk, boot, &[]).expect("it boots a slot");
    let settled = desk.robot.now() + 100 * MS;
    desk.run_until(settled);
    run(&mut desk, &mut receiver, &SMALL, 100 * MS);
    assert_clean(&desk, &receiver.finish());
}

#[test]
fn at_full_speed_whole_pairs_are_lost_and_the_rest_is_right() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::full_speed());
    receiver.start(&mut desk, &SMALL).expect("it starts");
    receiver.read_for(&mut desk, 2 * SECOND).expect("it streams");
    receiver.set(&mut desk, c::FPGA_REG_STREAM, c::FPGA_STREAM_END as u16).expect("it is told");
    receiver.read_for(&mut desk, 5 * SECOND).expect("it streams to its end");
    let found = receiver.finish();
    assert_clean(&desk, &found);
    assert!(found.pairs > 4 && found.lost > 40, "{found:?}");
}

fn status(desk: &mut Desk, receiver: &mut Receiver) -> [u8; 2] {
    let ask = Request { kind: 0xC0, request: c::REQUEST_CAMERAS as u8, value: 0, index: 0 };
    let reply = receiver.host.control_in(desk, ask, 4).expect("a status");
    [reply[1], reply[2]]
}

fn set_up(desk: &mut Desk, receiver: &mut Receiver) -> [u8; 2] {
    let setup = Request { kind: 0x40, request: c::REQUEST_CAMERAS as u8, value: 0, index: 0 };
    receiver.host.control_out(desk, setup, &[]).expect("it is done");
    status(desk, receiver)
}

fn camera_register(eye: u16, register: u32, kind: u8, value: u16) -> Request {
    let index = eye << 8 | register as u16;
    Request { kind, request: c::REQUEST_CAMERA_REGISTER as u8, value, index }
}

const OK: u8 = c::CAMERA_OK as u8;

#[test]
fn camera_faults_on_the_bus_have_names_and_go_with_their_cause() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    assert_eq!(
        status(&mut desk, &mut receiver),
        [OK, OK],
        "the firmware has set them up by itself"
    );
    for (fault, name) in [(Fault::NoAck, c::CAMERA_NO_ACK), (Fault::WrongId, c::CAMERA_WRONG_ID)] {
        desk.robot.turret.cameras.eyes[1].fault = Some(fault);
        assert_eq!(set_up(&mut desk, &mut receiver), [OK, name as u8]);
        desk.robot.turret.cameras.eyes[1].fault = None;
        // Nobody asks: the firmware tries again.
        let later = desk.robot.now() + 1200 * MS;
        desk.run_until(later);
        assert_eq!(status(&mut desk, &mut receiver), [OK, OK]);
    }
    desk.robot.turret.cameras.clock_held = true;
    assert_eq!(set_up(&mut desk, &mut receiver), [c::CAMERA_BUS_STUCK as u8; 2]);
    let gain = camera_register(0, c::CAMERA_REG_GAIN, 0xC0, 0);
    assert_eq!(receiver.host.control_in(&mut desk, gain, 1), Err(HostError::Stall));
    desk.robot.turret.cameras.clock_held = false;
    assert_eq!(set_up(&mut desk, &mut receiver), [OK, OK]);
    desk.robot.turret.cameras.mux_present = false;
    assert_eq!(set_up(&mut desk, &mut receiver), [c::CAMERA_NO_MUX as u8; 2]);
    desk.robot.turret.cameras.mux_present = true;
    assert_eq!(set_up(&mut desk, &mut receiver), [OK, OK]);
    run(&mut desk, &mut receiver, &SMALL, 200 * MS);
    assert_clean(&desk, &receiver.finish());
}

#[test]
fn eyes_that_send_nothing_or_torn_frames_are_seen_by_the_fpga() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    let alive = c::FPGA_EYES_ALIVE as u16;
    let torn = c::FPGA_EYES_TORN as u16;
    let eyes = |receiver: &mut Receiver, desk: &mut Desk| {
        let later = desk.robot.now() + 400 * MS;
        desk.run_until(later);
        let eyes = receiver.get(desk, c::FPGA_REG_EYES).expect("a register");
        [eyes & 0xFF, eyes >> 8]
    };
    assert_eq!(eyes(&mut receiver, &mut desk), [alive, alive]);
    desk.robot.turret.cameras.eyes[0].fault = Some(Fault::NoPixels);
    assert_eq!(eyes(&mut receiver, &mut desk), [0, alive]);
    desk.robot.turret.cameras.eyes[0].fault = Some(Fault::TornFrames);
    assert_eq!(eyes(&mut receiver, &mut desk), [alive | torn, alive]);
    run(&mut desk, &mut receiver, &SMALL, 200 * MS);
    desk.robot.turret.cameras.eyes[0].fault = None;
    assert_eq!(eyes(&mut receiver, &mut desk), [alive, alive]);
    run(&mut desk, &mut receiver, &SMALL, 200 * MS);
    let found = receiver.finish();
    assert!((7..=9).contains(&found.torn), "every torn pair is marked: {found:?}");
    assert_eq!((found.reports_differ, found.disorder, found.lost), (0, 0, 0), "{found:?}");
}

#[test]
fn exposure_gain_and_pattern_act_on_what_is_streamed() {
    let (mut desk, mut receiver) = desk(Function::Soccer, Host::new());
    let write = |desk: &mut Desk, receiver: &mut Receiver, register: u32, value: u16| {
        for eye in 0..2 {
            let request = camera_register(eye, register, 0x40, value);
            receiver.host.control_out(desk, request, &[]).expect("it is written");
        }
        let later = desk.robot.now() + 100 * MS;
        desk.run_until(later);
        desk.brightness()
    };
    let full = desk.brightness();
    // By hand at the nominal exposure nothing changes; with half of it the light is half.
    let nominal = write(&mut desk, &mut receiver, c::CAMERA_REG_COM8, 0);
    assert!((nominal - full).abs() < 1e-6);
    let half = write(&mut desk, &mut receiver, c::CAMERA_REG_AECH, 0x20);
    assert!((0.45..0.55).contains(&(half / full)), "{half} of {full}");
    let gained = write(&mut desk, &mut receiver, c::CAMERA_REG_GAIN, 0x10);
    assert!((0.95..1.05).contains(&(gained / full)), "{gained} of {full}");
    write(&mut desk, &mut receiver, c::CAMERA_REG_TEST_Y, 0x80 | 0x35);
    let bars = [0xFFFF, 0xFFE0, 0x07FF, 0x07E0, 0xF81F, 0xF800, 0x001F, 0];
    for (n, bar) in bars.into_iter().enumerate() {
        assert_eq!(desk.last_pair()[0][40 * n + 20], bar, "bar {n}");
    }
}
