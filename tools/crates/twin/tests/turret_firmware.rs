//! The real FX2 image on the emulated turret: from the boot EEPROM to a configured FPGA, what it says
//! when something is broken, and what it answers on USB.
//!
//! The image is built here, with sdcc; without it these tests fail.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use common_sys::constants as c;
use common_sys::link::{ConfigStatus, SlotHeader, config_status_decode, slot_header_encode};
use fx2::eeprom::{BootConfig, Eeprom, Identity, c2_image};
use fx2::host::{Bench, Host, HostError, Request};
use fx2::image::Image;
use fx2::pins::{Board, Driven, Sensed};
use fx2::{Fx2, Speed};
use sim::{MS, Ps, US};
use twin::flash::Flash;
use twin::turret::Turret;
use virtex::bitstream;
use virtex::design::Function;
use virtex::store::{Entry, pack};

const SLOT: u8 = 9;
const LENGTH: u32 = 234_456;

/// The firmware as the top project builds it.
fn firmware() -> &'static Vec<u8> {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../fx2-firmware");
        let build = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fx2-firmware");
        let cmake = |arguments: &[&str]| {
            let done = Command::new("cmake").args(arguments).output().expect("cmake is installed");
            let said = String::from_utf8_lossy(&done.stdout).into_owned()
                + &String::from_utf8_lossy(&done.stderr);
            assert!(done.status.success(), "the FX2 firmware does not build:\n{said}");
        };
        let toolchain = format!("-DCMAKE_TOOLCHAIN_FILE={}/toolchain.cmake", source.display());
        let (source, build) = (source.display().to_string(), build.display().to_string());
        cmake(&["-S", &source, "-B", &build, &toolchain]);
        cmake(&["--build", &build]);
        std::fs::read(Path::new(&build).join("fx2-firmware.ihx")).expect("the image was built")
    })
}

/// A flash image with a bitstream in the default slot.
fn flash_image() -> Vec<u8> {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE
        .get_or_init(|| {
            let stream = bitstream::make(Function::Soccer, &bitstream::Options::default());
            let entry = Entry::from_file(SLOT, &stream, "soccer".into()).expect("a good stream");
            pack(&[entry], SLOT)
        })
        .clone()
}

/// Offset of the bitstream in that image.
fn stream_at() -> usize {
    usize::from(SLOT) * c::SLOT_SIZE as usize
}

/// A turret whose INIT#, DONE and RY/BY# somebody may hold: pins that are stuck.
struct Stuck {
    turret: Turret,
    high: u8,
    low: u8,
}

impl Board for Stuck {
    fn drive(&mut self, now: Ps, driven: &Driven) {
        self.turret.drive(now, driven);
    }
    fn sense(&mut self, now: Ps) -> Sensed {
        let mut sensed = self.turret.sense(now);
        sensed.rdy = (sensed.rdy | self.high) & !self.low;
        sensed
    }
    fn i2c_start(&mut self, now: Ps, address_and_direction: u8) -> bool {
        self.turret.i2c_start(now, address_and_direction)
    }
    fn i2c_write(&mut self, now: Ps, byte: u8) -> bool {
        self.turret.i2c_write(now, byte)
    }
    fn i2c_read(&mut self, now: Ps, acknowledge: bool) -> u8 {
        self.turret.i2c_read(now, acknowledge)
    }
    fn i2c_stop(&mut self, now: Ps) {
        self.turret.i2c_stop(now);
    }
}

struct Robot {
    fx2: Fx2,
    board: Stuck,
}

impl Robot {
    /// Firmware already in RAM, CPU started at time 0.
    fn new(firmware: &[u8], flash: &[u8]) -> Self {
        let mut robot = Self::with_eeprom(flash, &[]);
        robot.fx2.load(&Image::parse(firmware).expect("an image")).expect("it fits");
        robot
    }

    fn with_eeprom(flash: &[u8], eeprom: &[u8]) -> Self {
        let flash = Flash::from_image(flash).expect("16 MiB");
        let eeprom = Eeprom::large(c::TURRET_EEPROM_ADDRESS as u8, eeprom).expect("it fits");
        let board = Stuck { turret: Turret::new(flash, eeprom), high: 0, low: 0 };
        Self { fx2: Fx2::new(fx2::Config::default()), board }
    }

    fn run_until(&mut self, t: Ps) {
        while self.fx2.now() < t {
            self.fx2.run_until(t, &mut self.board);
        }
    }

    fn bench(&mut self) -> Bench<'_, Stuck> {
        Bench { fx2: &mut self.fx2, board: &mut self.board }
    }

    /// Enumerates and asks for the outcome.
    fn status(&mut self) -> ConfigStatus {
        let mut host = Host::new();
        host.enumerate(&mut self.bench()).expect("it enumerates");
        ask(&mut host, &mut self.bench())
    }

    fn is_configured(&mut self) -> bool {
        let now = self.fx2.now();
        self.board.turret.fpga.function(now).is_some()
    }

    /// What chips and board have to complain about.
    fn complaints(&self) -> Vec<String> {
        let chip = self.fx2.diagnostics().iter().map(ToString::to_string);
        chip.chain(self.board.turret.report()).collect()
    }
}

fn get(kind: u8, request: u8, value: u16, index: u16) -> Request {
    Request { kind, request, value, index }
}

fn ask(host: &mut Host, bench: &mut Bench<'_, Stuck>) -> ConfigStatus {
    let wire = host
        .control_in(bench, get(0xC0, c::REQUEST_CONFIG_STATUS as u8, 0, 0), 16)
        .expect("the status is answered");
    config_status_decode(&wire.try_into().expect("16 bytes")).expect("a known version")
}

fn result_of(mut robot: Robot) -> u32 {
    robot.run_until(100 * MS);
    let status = robot.status();
    assert!(status.done == 0 && !robot.is_configured(), "the FPGA must not run");
    u32::from(status.result)
}

#[test]
fn fpga_runs_40_ms_after_the_cpu_started() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut done = None;
    while done.is_none() && robot.fx2.now() < 60 * MS {
        robot.run_until(robot.fx2.now() + 10 * US);
        done = robot.is_configured().then(|| robot.fx2.now());
    }
    let done = done.expect("DONE rises");
    println!("CPU start to DONE: {} us", done / US);
    assert!(done <= 40 * MS);

    let status = robot.status();
    assert_eq!(u32::from(status.result), c::CONFIG_OK);
    assert_eq!((status.slot, status.bytes, status.init, status.done), (SLOT, LENGTH, 1, 1));
    assert!(status.time_us.abs_diff((done / US) as u32) < 200, "{} us", status.time_us);
    assert_eq!(robot.complaints(), [""; 0]);
}

#[test]
fn it_boots_from_its_eeprom_without_a_host() {
    let image = Image::parse(firmware()).expect("an image");
    let identity = Identity { vendor: 0x1209, product: 1, device: 0x0101 };
    let boot = c2_image(&image, identity, BootConfig { fast: true, ..BootConfig::default() });
    let mut robot = Robot::with_eeprom(&flash_image(), &boot);
    robot.run_until(1000 * MS);
    assert!(robot.is_configured());
    assert_eq!(robot.complaints(), [""; 0]);
}

#[test]
fn a_flipped_bit_leaves_the_fpga_unconfigured() {
    for at in [5_000, 100_000, 234_000] {
        let mut flash = flash_image();
        flash[stream_at() + at] ^= 0x08;
        assert_eq!(result_of(Robot::new(firmware(), &flash)), c::CONFIG_CRC_ERROR, "byte {at}");
    }
}

#[test]
fn a_stream_that_ends_early_never_raises_done() {
    let mut flash = flash_image();
    let header = SlotHeader { length: 200_000, generation: 1, ..SlotHeader::default() };
    let at = stream_at() + c::BANK_HEADER_AT as usize;
    flash[at..at + 64].copy_from_slice(&slot_header_encode(&header));
    assert_eq!(result_of(Robot::new(firmware(), &flash)), c::CONFIG_NO_DONE);
}

#[test]
fn a_slot_without_commit_word_is_named() {
    let mut flash = flash_image();
    flash[stream_at() + c::BANK_COMMIT_AT as usize] = 0;
    assert_eq!(result_of(Robot::new(firmware(), &flash)), c::CONFIG_BAD_SLOT);
}

#[test]
fn an_erased_flash_has_no_default() {
    let flash = vec![0xFF; c::FLASH_SIZE as usize];
    assert_eq!(result_of(Robot::new(firmware(), &flash)), c::CONFIG_NO_DEFAULT);
}

#[test]
fn stuck_pins_are_told_apart() {
    let stuck = |high: u32, low: u32| {
        let mut robot = Robot::new(firmware(), &flash_image());
        (robot.board.high, robot.board.low) = (high as u8, low as u8);
        robot.run_until(100 * MS);
        let status = robot.status();
        u32::from(status.result)
    };
    assert_eq!(stuck(1 << c::TURRET_RDY_INIT, 0), c::CONFIG_NO_INIT, "INIT# never falls");
    assert_eq!(stuck(0, 1 << c::TURRET_RDY_INIT), c::CONFIG_NO_INIT, "INIT# never rises");
    assert_eq!(stuck(0, 1 << c::TURRET_RDY_DONE), c::CONFIG_NO_DONE, "DONE never rises");
}

#[test]
fn a_flash_that_stays_busy_is_given_up() {
    let mut robot = Robot::new(firmware(), &flash_image());
    robot.board.low = 1 << c::TURRET_RDY_FLASH;
    robot.run_until(100 * MS);
    assert_eq!(u32::from(robot.status().result), c::CONFIG_BUSY, "it may still be erasing");
    robot.run_until(2500 * MS);
    assert_eq!(u32::from(robot.status().result), c::CONFIG_NO_FLASH);
}

/// The waveforms have no slack: with one state less the FPGA does not come up.
#[test]
fn a_waveform_shorter_by_a_state_fails() {
    // Lengths and branches of the stream's and of the write's waveform in gpif.c, the byte to
    // shorten, and what it is shortened to.
    for (waveform, at) in [([1, 3, 0x38, 1], 1), ([1, 3, 1, 0x3F], 1)] {
        let image = Image::parse(firmware()).expect("an image");
        let mut ram = vec![0; fx2::Ram::K8.bytes()];
        for (start, bytes) in image.segments() {
            let start = usize::from(start);
            if start + bytes.len() <= ram.len() {
                ram[start..start + bytes.len()].copy_from_slice(bytes);
            }
        }
        let found: Vec<_> = (0..ram.len() - 4).filter(|&i| ram[i..i + 4] == waveform).collect();
        assert_eq!(found.len(), 1, "{waveform:?} is in the image once");
        ram[found[0] + at] -= 1;
        let mut robot = Robot::with_eeprom(&flash_image(), &[]);
        robot.fx2.load(&Image::raw(&ram).expect("an image")).expect("it fits");
        robot.run_until(100 * MS);
        assert!(!robot.is_configured(), "{waveform:?}");
        assert_ne!(robot.complaints(), [""; 0]);
    }
}

#[test]
fn it_enumerates_at_both_speeds() {
    for (mut host, speed) in [(Host::new(), Speed::High), (Host::full_speed(), Speed::Full)] {
        let mut robot = Robot::new(firmware(), &flash_image());
        let device = host.enumerate(&mut robot.bench()).expect("it enumerates");
        assert_eq!((device.vendor(), device.product()), (0x1209, 0x0001));
        assert_eq!(device.release(), 0x0101);
        assert_eq!(device.speed, speed);
        assert_eq!(u32::from(ask(&mut host, &mut robot.bench()).result), c::CONFIG_OK);
        assert_eq!(robot.complaints(), [""; 0]);
    }
}

#[test]
fn strings_are_read_in_one_piece_or_several() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = Host::new();
    host.enumerate(&mut robot.bench()).expect("it enumerates");
    let string = |host: &mut Host, robot: &mut Robot, length| {
        host.control_in(&mut robot.bench(), get(0x80, 6, 0x0302, 0x0409), length)
    };
    let whole = string(&mut host, &mut robot, 255).expect("it has a name");
    let name: Vec<u16> = whole[2..].chunks(2).map(|c| u16::from_le_bytes([c[0], c[1]])).collect();
    assert_eq!(String::from_utf16_lossy(&name), "StereoSot turret");
    for length in 1..=40 {
        let part = string(&mut host, &mut robot, length).expect("part of its name");
        assert_eq!(part, whole[..usize::from(length).min(whole.len())]);
    }
}

#[test]
fn loaded_anew_over_usb_it_leaves_the_bus_and_comes_back() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = Host::new();
    host.enumerate(&mut robot.bench()).expect("it enumerates");
    let mut load = |robot: &mut Robot, address: u16, data: &[u8]| {
        let request = get(0x40, 0xA0, address, 0);
        host.control_out(&mut robot.bench(), request, data).expect("RAM is loaded");
    };
    load(&mut robot, 0xE600, &[1]);
    for (start, bytes) in Image::parse(firmware()).expect("an image").segments() {
        for (n, piece) in bytes.chunks(1024).enumerate() {
            load(&mut robot, start + 1024 * n as u16, piece);
        }
    }
    load(&mut robot, 0xE600, &[0]);

    let started = robot.fx2.now();
    robot.run_until(started + MS);
    assert!(!robot.fx2.usb_attached(), "the host must see that the device has changed");
    while !robot.fx2.usb_attached() && robot.fx2.now() < started + 100 * MS {
        robot.run_until(robot.fx2.now() + 100 * US);
    }
    assert!(robot.fx2.now() - started >= 10 * MS, "a hub needs time to see it");
    robot.run_until(started + 100 * MS);
    assert_eq!(u32::from(robot.status().result), c::CONFIG_OK);
    assert_eq!(robot.complaints(), [""; 0]);
}

/// Chooses alternate setting 1: endpoint 2 swallows, endpoint 6 gives zeros.
fn open_source_and_sink(host: &mut Host, robot: &mut Robot) {
    host.enumerate(&mut robot.bench()).expect("it enumerates");
    while u32::from(ask(host, &mut robot.bench()).result) == c::CONFIG_BUSY {
        robot.run_until(robot.fx2.now() + MS);
    }
    host.control_out(&mut robot.bench(), get(0x01, 11, 1, 0), &[]).expect("SET_INTERFACE");
    for endpoint in [2, 6] {
        host.clear_toggles(endpoint);
    }
}

#[test]
fn source_and_sink_move_packets_at_both_speeds() {
    for (mut host, packet) in [(Host::new(), 512), (Host::full_speed(), 64)] {
        let mut robot = Robot::new(firmware(), &flash_image());
        host.set_budget(50 * MS);
        open_source_and_sink(&mut host, &mut robot);
        for n in 0..50 {
            let length = [packet, 1, 0, packet - 1][n % 4];
            host.bulk_out(&mut robot.bench(), 2, &vec![0xA5; length]).expect("the sink takes it");
            let data = host.bulk_in(&mut robot.bench(), 6).expect("the source gives");
            assert_eq!(data, vec![0; packet]);
        }
        assert_eq!(robot.complaints(), [""; 0]);
    }
}

#[test]
fn a_halted_endpoint_stalls_until_it_is_cleared() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = Host::new();
    host.set_budget(50 * MS);
    open_source_and_sink(&mut host, &mut robot);
    for (address, number) in [(0x02, 2), (0x86, 6)] {
        let transfer = |host: &mut Host, robot: &mut Robot| match number {
            2 => host.bulk_out(&mut robot.bench(), 2, &[1; 512]),
            _ => host.bulk_in(&mut robot.bench(), 6).map(drop),
        };
        for _ in 0..3 {
            transfer(&mut host, &mut robot).expect("a packet passes");
        }
        host.control_out(&mut robot.bench(), get(0x02, 3, 0, address), &[]).expect("SET_FEATURE");
        assert_eq!(transfer(&mut host, &mut robot), Err(HostError::Stall));
        host.control_out(&mut robot.bench(), get(0x02, 1, 0, address), &[]).expect("CLEAR_FEATURE");
        host.clear_toggles(number);
        for _ in 0..10 {
            transfer(&mut host, &mut robot).expect("a packet passes again");
        }
    }
    assert_eq!(robot.complaints(), [""; 0]);
}

/// Requests of all kinds in a row, answered or refused, and the turret goes on.
#[test]
fn no_request_hangs_it() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = Host::new();
    host.set_budget(50 * MS);
    host.enumerate(&mut robot.bench()).expect("it enumerates");
    let mut seed = 0x1234_5678_u32;
    let mut draw = || {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        seed
    };
    for n in 0..2000 {
        let kinds = [0x00, 0x01, 0x02, 0x40, 0x41, 0x80, 0x81, 0x82, 0xC0, 0xC1, 0x21, 0xA1];
        let kind = kinds[draw() as usize % kinds.len()];
        let number = if draw() % 4 == 0 { draw() as u8 } else { (draw() % 13) as u8 };
        // 5 would give it another address than the host uses, A0 is the chip's own.
        if number == 5 || number == 0xA0 {
            continue;
        }
        let request = get(kind, number, (draw() % 4) as u16, (draw() % 3) as u16);
        let data = vec![0; draw() as usize % 3 * 40];
        let done = if kind & 0x80 != 0 {
            host.control_in(&mut robot.bench(), request, data.len() as u16).map(drop)
        } else {
            host.control_out(&mut robot.bench(), request, &data)
        };
        assert!(
            matches!(done, Ok(()) | Err(HostError::Stall)),
            "request {n}: {request:02x?} with {} bytes: {done:?}",
            data.len()
        );
        if n % 100 == 0 {
            assert_eq!(u32::from(ask(&mut host, &mut robot.bench()).result), c::CONFIG_OK);
        }
    }
    assert_eq!(robot.complaints(), [""; 0]);
}
