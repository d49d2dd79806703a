//! The real FX2 image on the emulated turret: from the boot EEPROM to a configured FPGA, what it says
//! when something is broken, and what it answers on USB.
//!
//! The image is built here, with sdcc; without it these tests fail.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use common_sys::constants as c;
use common_sys::link::{
    ConfigStatus, SlotHeader, StoreStatus, config_status_decode, slot_header_encode,
    store_status_decode,
};
use fx2::eeprom::{BootConfig, Eeprom, Identity, c2_image};
use fx2::host::{Bench, Host, HostError, Link, Request};
use fx2::image::Image;
use fx2::pins::{Sensed, Tap, Tapped};
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

fn blank_flash() -> Vec<u8> {
    vec![0xFF; c::FLASH_SIZE as usize]
}

fn header(length: u32) -> SlotHeader {
    let mut header = SlotHeader { length, generation: 1, ..SlotHeader::default() };
    for (place, byte) in header.part.iter_mut().zip(b"v300ecs144") {
        *place = *byte as core::ffi::c_char;
    }
    header
}

/// Offset of the bitstream in that image.
fn stream_at() -> usize {
    usize::from(SLOT) * c::SLOT_SIZE as usize
}

/// Somebody who may hold INIT#, DONE and RY/BY#: pins that are stuck.
#[derive(Default)]
struct Stuck {
    high: u8,
    low: u8,
}

impl Tap for Stuck {
    fn sensed(&mut self, _now: Ps, levels: Sensed) -> Sensed {
        Sensed { rdy: (levels.rdy | self.high) & !self.low, ..levels }
    }
}

struct Robot {
    fx2: Fx2,
    board: Tapped<Turret, Stuck>,
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
        let board = Tapped { board: Turret::new(flash, eeprom), tap: Stuck::default() };
        Self { fx2: Fx2::new(fx2::Config::default()), board }
    }

    fn run_until(&mut self, t: Ps) {
        while self.fx2.now() < t {
            self.fx2.run_until(t, &mut self.board);
        }
    }

    fn bench(&mut self) -> Bench<'_, Tapped<Turret, Stuck>> {
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
        self.board.board.fpga.function(now).is_some()
    }

    /// What chips and board have to complain about.
    fn complaints(&self) -> Vec<String> {
        let chip = self.fx2.diagnostics().iter().map(ToString::to_string);
        chip.chain(self.board.board.report()).collect()
    }
}

fn get(kind: u8, request: u8, value: u16, index: u16) -> Request {
    Request { kind, request, value, index }
}

fn ask(host: &mut Host, bench: &mut Bench<'_, Tapped<Turret, Stuck>>) -> ConfigStatus {
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
    // It begins when the chip has been set up.
    assert!(status.time_us.abs_diff((done / US) as u32) < 700, "{} us", status.time_us);
    assert_eq!(robot.complaints(), [""; 0]);
}

#[test]
fn the_marks_are_known_from_the_beginning() {
    for (flash, default) in [(flash_image(), u32::from(SLOT)), (blank_flash(), c::CONFIG_NO_SLOT)] {
        let mut robot = Robot::new(firmware(), &flash);
        let mut host = data_host(&mut robot);
        let status = store_status(&mut host, &mut robot);
        assert_eq!(u32::from(status.default_slot), default);
        assert_eq!(u32::from(status.golden_slot), c::CONFIG_NO_SLOT);
    }
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
    let at = stream_at() + c::BANK_HEADER_AT as usize;
    flash[at..at + 64].copy_from_slice(&slot_header_encode(&header(200_000)));
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
        (robot.board.tap.high, robot.board.tap.low) = (high as u8, low as u8);
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
    robot.board.tap.low = 1 << c::TURRET_RDY_FLASH;
    robot.run_until(100 * MS);
    assert_eq!(u32::from(robot.status().result), c::CONFIG_BUSY, "it may still be erasing");
    robot.run_until(2500 * MS);
    assert_eq!(u32::from(robot.status().result), c::CONFIG_NO_FLASH);
}

/// Where the waveforms lie in the image's scratch RAM.
const WAVEFORMS_AT: usize = 0xE18A;
/// Bytes of a waveform and what they become.
type Changes = &'static [(usize, u8, u8)];
/// Of each waveform one state less. The read loses the state in which it waits for the flash (there is
/// a clock to spare in it, for the edge at which the GPIF samples is not documented), the others a
/// clock.
const FLASH_WAVEFORMS: [(&str, Changes); 3] = [
    (
        "read",
        &[
            (0, 5, 1),
            (1, 1, 0x3F),
            (2, 0x3F, 1),
            (4, 0, 2),
            (5, 2, 9),
            (6, 9, 0),
            (10, 0x20, 0x30),
            (13, 0, 0x2D),
            (14, 0x2D, 0),
        ],
    ),
    ("write", &[(17, 3, 2)]),
    ("stream from flash", &[(33, 3, 2)]),
];
/// It goes on from waiting to the clocked state by itself: branches of states 0 and 2.
const USB_WAVEFORM: Changes = &[(48, 0x01, 0x02), (50, 0x19, 0x1A)];

fn with_changes(changes: Changes) -> Vec<u8> {
    let image = firmware().clone();
    changes.iter().fold(image, |image, &(at, from, to)| with_waveform(&image, at, from, to))
}

/// The image with a byte of the waveforms changed.
fn with_waveform(image: &[u8], at: usize, from: u8, to: u8) -> Vec<u8> {
    let text = std::str::from_utf8(image).expect("Intel hex is text");
    let mut changed = 0;
    let lines: Vec<String> = text
        .lines()
        .map(|line| {
            let mut bytes: Vec<u8> = (1..line.trim_end().len())
                .step_by(2)
                .map(|i| u8::from_str_radix(&line[i..i + 2], 16).expect("hex digits"))
                .collect();
            let address = usize::from(u16::from_be_bytes([bytes[1], bytes[2]]));
            let wanted = WAVEFORMS_AT + at;
            if bytes[3] == 0 && (address..address + usize::from(bytes[0])).contains(&wanted) {
                let place = 4 + wanted - address;
                assert_eq!(bytes[place], from, "the waveform is as this test knows it");
                bytes[place] = to;
                changed += 1;
            }
            let last = bytes.len() - 1;
            let sum = bytes[..last].iter().fold(0u8, |sum, &byte| sum.wrapping_add(byte));
            bytes[last] = sum.wrapping_neg();
            bytes.iter().fold(":".to_owned(), |text, byte| text + &format!("{byte:02X}"))
        })
        .collect();
    assert_eq!(changed, 1);
    lines.join("\n").into_bytes()
}

/// The waveforms have no slack: with one state less the FPGA does not come up.
#[test]
fn a_flash_waveform_shorter_by_a_state_fails() {
    for (name, changes) in FLASH_WAVEFORMS {
        let mut robot = Robot::new(&with_changes(changes), &flash_image());
        robot.run_until(100 * MS);
        assert!(!robot.is_configured(), "{name}");
    }
}

#[test]
fn the_usb_waveform_shorter_by_a_state_fails() {
    let mut robot = Robot::new(&with_changes(USB_WAVEFORM), &blank_flash());
    let mut host = data_host(&mut robot);
    host.set_budget(10 * MS);
    let stream = bitstream::make(Function::Soccer, &bitstream::Options::default());
    begin_configuration(&mut host, &mut robot, 0, stream.len()).expect("it begins");
    // The FPGA gets rubbish: sooner or later the turret refuses to go on.
    let sent = stream.chunks(512).try_for_each(|p| host.bulk_out(&mut robot.bench(), 2, p));
    let status = wait_configured(&mut host, &mut robot);
    assert_ne!(u32::from(status.result), c::CONFIG_OK, "{sent:?}");
    assert!(!robot.is_configured());
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

/// Every vendor request there is, and one beside each group.
const VENDOR_REQUESTS: [u32; 16] = [
    c::REQUEST_CONFIG_STATUS,
    c::REQUEST_CONFIG_BEGIN,
    c::REQUEST_ABORT,
    c::REQUEST_CONFIG_BOOT,
    0xB4,
    c::REQUEST_STORE_STATUS,
    c::REQUEST_STORE_READ,
    c::REQUEST_STORE_WRITE,
    c::REQUEST_STORE_ERASE,
    c::REQUEST_STORE_MARK,
    0xBD,
    c::REQUEST_FPGA_REGISTER,
    c::REQUEST_CAMERA_REGISTER,
    c::REQUEST_CAMERAS,
    c::REQUEST_EEPROM_READ,
    c::REQUEST_MICROSOFT,
];

/// Requests of all kinds in any order, jobs among them, answered or refused; the turret goes on.
#[test]
fn no_request_hangs_it() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = Host::new();
    host.set_budget(100 * MS);
    host.enumerate(&mut robot.bench()).expect("it enumerates");
    let mut seed = 0x1234_5678_u32;
    let mut draw = || {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        seed
    };
    let good_header = slot_header_encode(&header(1000));
    for n in 0..3000 {
        let kinds = [0x00, 0x01, 0x02, 0x40, 0x41, 0x80, 0x81, 0x82, 0xC0, 0xC1, 0x21, 0xA1];
        let (kind, number) = match draw() % 4 {
            0 => (kinds[draw() as usize % kinds.len()], draw() as u8),
            1 => ([0x40, 0xC0][draw() as usize % 2], VENDOR_REQUESTS[draw() as usize % 16] as u8),
            _ => (kinds[draw() as usize % kinds.len()], (draw() % 13) as u8),
        };
        // 5 would give it another address than the host uses, A0 is the chip's own.
        if number == 5 || number == 0xA0 {
            continue;
        }
        let request = get(kind, number, (draw() % 4) as u16, (draw() % 3) as u16);
        let length = [0, 1, 4, 40, 64, 64, 80][draw() as usize % 7];
        let done = if kind & 0x80 != 0 {
            host.control_in(&mut robot.bench(), request, length as u16).map(drop)
        } else if length == good_header.len() && draw() % 2 == 0 {
            host.control_out(&mut robot.bench(), request, &good_header)
        } else {
            host.control_out(&mut robot.bench(), request, &vec![0; length])
        };
        assert!(
            matches!(done, Ok(()) | Err(HostError::Stall)),
            "request {n}: {request:02x?} with {length} bytes: {done:?}"
        );
        if n % 100 == 0 {
            ask(&mut host, &mut robot.bench());
        }
    }
    // It still does its work.
    host.reset(&mut robot.bench());
    wait_stored(&mut host, &mut robot);
    wait_configured(&mut host, &mut robot);
    let mut host = data_host(&mut robot);
    let status = configure_over_usb(&mut host, &mut robot, &soccer());
    assert_eq!(u32::from(status.result), c::CONFIG_OK);
}

// ---- jobs over USB ----

fn put(request: u32, value: u16, index: u16) -> Request {
    Request { kind: 0x40, request: request as u8, value, index }
}

/// Enumerated, in the setting whose endpoints carry the data of jobs, with nothing under way.
fn data_host(robot: &mut Robot) -> Host {
    let mut host = Host::new();
    host.enumerate(&mut robot.bench()).expect("it enumerates");
    wait_configured(&mut host, robot);
    choose_data(&mut host, robot);
    host
}

fn choose_data(host: &mut Host, robot: &mut Robot) {
    let setting = get(0x01, 11, c::USB_ALTERNATE_DATA as u16, 0);
    host.control_out(&mut robot.bench(), setting, &[]).expect("SET_INTERFACE");
    host.clear_toggles(2);
    host.clear_toggles(6);
}

fn wait_configured(host: &mut Host, robot: &mut Robot) -> ConfigStatus {
    for _ in 0..8000 {
        let status = ask(host, &mut robot.bench());
        if u32::from(status.result) != c::CONFIG_BUSY {
            return status;
        }
        robot.run_until(robot.fx2.now() + MS);
    }
    panic!("the configuration does not end");
}

fn begin_configuration(
    host: &mut Host,
    robot: &mut Robot,
    kind: u32,
    length: usize,
) -> Result<(), HostError> {
    let wire = slot_header_encode(&header(length as u32));
    host.control_out(&mut robot.bench(), put(c::REQUEST_CONFIG_BEGIN, kind as u16, 0), &wire)
}

fn send(host: &mut Host, robot: &mut Robot, data: &[u8]) -> Result<(), HostError> {
    data.chunks(512).try_for_each(|packet| host.bulk_out(&mut robot.bench(), 2, packet))
}

fn configure_over_usb(host: &mut Host, robot: &mut Robot, stream: &[u8]) -> ConfigStatus {
    begin_configuration(host, robot, c::CONFIG_BEGIN_FULL, stream.len()).expect("it begins");
    send(host, robot, stream).expect("it takes the data");
    wait_configured(host, robot)
}

fn soccer() -> Vec<u8> {
    bitstream::make(Function::Soccer, &bitstream::Options::default())
}

fn store_status(host: &mut Host, robot: &mut Robot) -> StoreStatus {
    let request = get(0xC0, c::REQUEST_STORE_STATUS as u8, 0, 0);
    let wire = host.control_in(&mut robot.bench(), request, 12).expect("the status is answered");
    store_status_decode(&wire.try_into().expect("12 bytes")).expect("a known version")
}

fn wait_stored(host: &mut Host, robot: &mut Robot) -> StoreStatus {
    for _ in 0..2000 {
        let status = store_status(host, robot);
        if u32::from(status.result) != c::STORE_BUSY {
            return status;
        }
        robot.run_until(robot.fx2.now() + 10 * MS);
    }
    panic!("the job does not end");
}

fn begin_write(host: &mut Host, robot: &mut Robot, slot: u16, length: usize) {
    let wire = slot_header_encode(&header(length as u32));
    host.control_out(&mut robot.bench(), put(c::REQUEST_STORE_WRITE, slot, 0), &wire)
        .expect("the write begins");
}

fn store_job(host: &mut Host, robot: &mut Robot, request: u32, slot: u16, index: u16) -> u32 {
    host.control_out(&mut robot.bench(), put(request, slot, index), &[]).expect("it begins");
    u32::from(wait_stored(host, robot).result)
}

#[test]
fn a_bitstream_over_usb_takes_at_most_12_ms() {
    let mut robot = Robot::new(firmware(), &blank_flash());
    let mut host = data_host(&mut robot);
    let stream = soccer();
    begin_configuration(&mut host, &mut robot, 0, stream.len()).expect("it begins");
    robot.run_until(robot.fx2.now() + 10 * MS);
    let begin = robot.fx2.now();
    send(&mut host, &mut robot, &stream).expect("it takes the data");
    while !robot.is_configured() {
        robot.run_until(robot.fx2.now() + 10 * US);
        assert!(robot.fx2.now() < begin + 100 * MS, "DONE rises");
    }
    let took = robot.fx2.now() - begin;
    println!("first byte on USB to DONE: {} us", took / US);
    assert!(took <= 12 * MS);
    let status = wait_configured(&mut host, &mut robot);
    assert_eq!(u32::from(status.result), c::CONFIG_OK);
    assert_eq!((status.bytes, u32::from(status.source)), (LENGTH, c::CONFIG_FROM_USB));
    assert_eq!(robot.complaints(), [""; 0]);
}

#[test]
fn full_and_partial_bitstreams_follow_each_other() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = data_host(&mut robot);
    for _ in 0..2 {
        let status = configure_over_usb(&mut host, &mut robot, &soccer());
        assert_eq!(u32::from(status.result), c::CONFIG_OK);
        let options = bitstream::Options::default();
        let partial = bitstream::make_partial(Function::Capture, &options);
        let length = partial.len();
        begin_configuration(&mut host, &mut robot, c::CONFIG_BEGIN_PARTIAL, length)
            .expect("it begins");
        send(&mut host, &mut robot, &partial).expect("it takes the data");
        let status = wait_configured(&mut host, &mut robot);
        assert_eq!(u32::from(status.result), c::CONFIG_OK);
        assert_eq!((status.done, u32::from(status.source)), (1, c::CONFIG_PARTIAL));
        let now = robot.fx2.now();
        assert_eq!(robot.board.board.fpga.function(now), Some(Function::Capture));
    }
    assert_eq!(robot.complaints(), [""; 0]);
}

#[test]
fn a_damaged_bitstream_over_usb_ends_with_the_golden_slot_or_none() {
    for golden in [false, true] {
        let mut robot = Robot::new(firmware(), &flash_image());
        let mut host = data_host(&mut robot);
        if golden {
            let index = c::SLOT_RECORD_GOLDEN as u16;
            let job = store_job(&mut host, &mut robot, c::REQUEST_STORE_MARK, SLOT.into(), index);
            assert_eq!(job, c::STORE_OK);
        }
        let mut stream = soccer();
        stream[100_000] ^= 1;
        begin_configuration(&mut host, &mut robot, 0, stream.len()).expect("it begins");
        host.set_budget(100 * MS);
        let _ = send(&mut host, &mut robot, &stream);
        let status = wait_configured(&mut host, &mut robot);
        assert_eq!(robot.is_configured(), golden);
        if golden {
            assert_eq!(u32::from(status.source), c::CONFIG_FROM_GOLDEN);
            assert_eq!((u32::from(status.cause), status.slot), (c::CONFIG_CRC_ERROR, SLOT));
        } else {
            assert_eq!(u32::from(status.result), c::CONFIG_CRC_ERROR);
        }
    }
}

#[test]
fn a_host_that_goes_away_leaves_no_half_configured_fpga() {
    type Leave = fn(&mut Host, &mut Robot);
    let ways: [(&str, u32, Leave); 5] = [
        ("abort", c::CONFIG_ABORTED, |host, robot| {
            host.control_out(&mut robot.bench(), put(c::REQUEST_ABORT, 0, 0), &[]).expect("abort");
        }),
        // The bus falls silent, and the supply from the host goes.
        ("cable pulled", c::CONFIG_ABORTED, |_, robot| {
            robot.fx2.usb_suspend();
            robot.run_until(robot.fx2.now() + 5 * MS);
            robot.fx2.usb_unplugged();
        }),
        ("suspend", c::CONFIG_ABORTED, |_, robot| robot.fx2.usb_suspend()),
        ("another host", c::CONFIG_ABORTED, |host, robot| host.reset(&mut robot.bench())),
        ("silence", c::CONFIG_NO_DATA, |_, _| ()),
    ];
    for (name, result, leave) in ways {
        let mut robot = Robot::new(firmware(), &blank_flash());
        let mut host = data_host(&mut robot);
        let stream = soccer();
        begin_configuration(&mut host, &mut robot, 0, stream.len()).expect("it begins");
        send(&mut host, &mut robot, &stream[..100 * 512]).expect("it takes the data");
        leave(&mut host, &mut robot);
        robot.run_until(robot.fx2.now() + 3000 * MS);
        assert!(!robot.is_configured(), "{name}");
        assert_eq!(u32::from(robot.status().result), result, "{name}");
        let mut host = data_host(&mut robot);
        let status = configure_over_usb(&mut host, &mut robot, &stream);
        assert_eq!(u32::from(status.result), c::CONFIG_OK, "afterwards: {name}");
    }
}

#[test]
fn wrong_part_length_and_setting_are_refused_and_change_nothing() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = data_host(&mut robot);
    let mut wrong_part = header(LENGTH);
    wrong_part.part[1] = b'6' as core::ffi::c_char;
    for wire in
        [wrong_part, header(0), header(c::BANK_HEADER_AT + 1)].map(|h| slot_header_encode(&h))
    {
        for request in [c::REQUEST_CONFIG_BEGIN, c::REQUEST_STORE_WRITE] {
            let refused = host.control_out(&mut robot.bench(), put(request, 0, 0), &wire);
            assert_eq!(refused, Err(HostError::Stall));
        }
    }
    assert!(robot.is_configured());
    assert_eq!(u32::from(ask(&mut host, &mut robot.bench()).result), c::CONFIG_OK);
    assert_eq!(robot.complaints(), [""; 0]);
}

#[test]
fn a_change_of_slot_takes_at_most_30_ms() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = data_host(&mut robot);
    let begin = robot.fx2.now();
    host.control_out(&mut robot.bench(), put(c::REQUEST_CONFIG_BOOT, SLOT.into(), 0), &[])
        .expect("it begins");
    robot.run_until(begin + 2 * MS);
    while !robot.is_configured() {
        robot.run_until(robot.fx2.now() + 10 * US);
        assert!(robot.fx2.now() < begin + 100 * MS, "DONE rises");
    }
    let took = robot.fx2.now() - begin;
    println!("request to DONE: {} us", took / US);
    assert!(took <= 30 * MS, "{} us", took / US);
    let status = wait_configured(&mut host, &mut robot);
    assert_eq!((status.slot, u32::from(status.source)), (SLOT, c::CONFIG_FROM_SLOT));
}

#[test]
fn a_slot_is_written_read_back_marked_booted_and_erased() {
    let mut robot = Robot::new(firmware(), &blank_flash());
    let mut host = data_host(&mut robot);
    host.set_budget(5000 * MS);
    let stream = soccer();
    begin_write(&mut host, &mut robot, 30, stream.len());
    send(&mut host, &mut robot, &stream).expect("it takes the data");
    let status = wait_stored(&mut host, &mut robot);
    assert_eq!((u32::from(status.result), status.bytes, status.slot), (c::STORE_OK, LENGTH, 30));

    let blocks = stream.len().div_ceil(512) as u16;
    let first = (30 * c::SLOT_SIZE / 512) as u16;
    host.control_out(&mut robot.bench(), put(c::REQUEST_STORE_READ, first, blocks), &[])
        .expect("read");
    let mut back = Vec::new();
    while back.len() < usize::from(blocks) * 512 {
        back.extend(host.bulk_in(&mut robot.bench(), 6).expect("it gives data"));
    }
    assert_eq!(back[..stream.len()], stream);
    assert_eq!(u32::from(wait_stored(&mut host, &mut robot).result), c::STORE_OK);

    let kind = c::SLOT_RECORD_DEFAULT as u16;
    assert_eq!(store_job(&mut host, &mut robot, c::REQUEST_STORE_MARK, 30, kind), c::STORE_OK);
    assert_eq!(store_status(&mut host, &mut robot).default_slot, 30);
    let boot = put(c::REQUEST_CONFIG_BOOT, c::CONFIG_BOOT_DEFAULT as u16, 0);
    host.control_out(&mut robot.bench(), boot, &[]).expect("it begins");
    assert_eq!(wait_configured(&mut host, &mut robot).slot, 30);
    assert!(robot.is_configured());

    assert_eq!(store_job(&mut host, &mut robot, c::REQUEST_STORE_ERASE, 30, 0), c::STORE_OK);
    assert!(robot.board.board.flash.image().iter().all(|&byte| byte == 0xFF));
    assert_eq!(robot.complaints(), [""; 0]);
}

#[test]
fn jobs_that_follow_each_other_at_once_lose_nothing() {
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = data_host(&mut robot);
    host.set_budget(5000 * MS);
    let stream = soccer();
    // Twice the same way, and then into the FPGA: each finds endpoint 02 as the one before has left it.
    for _ in 0..2 {
        begin_write(&mut host, &mut robot, SLOT.into(), stream.len());
        send(&mut host, &mut robot, &stream).expect("it takes the data");
        let status = wait_stored(&mut host, &mut robot);
        assert_eq!((u32::from(status.result), status.bytes), (c::STORE_OK, LENGTH));
    }
    let wire = slot_header_encode(&header(stream.len() as u32));
    let full = put(c::REQUEST_CONFIG_BEGIN, 0, 0);
    host.control_out(&mut robot.bench(), full, &wire).expect("the configuration begins");
    send(&mut host, &mut robot, &stream).expect("it takes the data");
    let status = wait_configured(&mut host, &mut robot);
    assert_eq!((u32::from(status.result), status.bytes), (c::CONFIG_OK, LENGTH));
}

/// A robot whose supply fails, on a copy of its flash, at each N-th operation of that.
struct Cutting<'a> {
    robot: &'a mut Robot,
    /// The flash before.
    whole: &'a [u8],
    every: usize,
    operations: usize,
    next: usize,
    cuts: usize,
}

/// Shorter than programming a buffer takes.
const CUT_STEP: Ps = 50 * US;

impl Link for Cutting<'_> {
    fn fx2(&mut self) -> &mut Fx2 {
        &mut self.robot.fx2
    }

    fn run_until(&mut self, t: Ps) {
        while self.robot.fx2.now() < t {
            let step = t.min(self.robot.fx2.now() + CUT_STEP);
            self.robot.run_until(step);
            let now = self.robot.fx2.now();
            self.operations += self.robot.board.board.flash.take_changes(now).len();
            if self.operations >= self.next {
                self.next = self.operations + self.every;
                self.cut(now);
            }
        }
    }
}

impl Cutting<'_> {
    /// Whatever is left, the turret comes up with the old bitstream or the new one, and the other slots
    /// are as they were.
    fn cut(&mut self, now: Ps) {
        let mut flash = self.robot.board.board.flash.clone();
        flash.power_off(now);
        let (left, whole) = (flash.image(), self.whole);
        let slot = stream_at()..stream_at() + c::SLOT_SIZE as usize;
        assert!(left[..slot.start] == whole[..slot.start] && left[slot.end..] == whole[slot.end..]);
        let mut robot = Robot::new(firmware(), left);
        robot.run_until(100 * MS);
        let operation = self.operations;
        assert!(robot.is_configured(), "cut at operation {operation}");
        let status = robot.status();
        assert_eq!(u32::from(status.source), c::CONFIG_FROM_DEFAULT, "operation {operation}");
        self.cuts += 1;
    }
}

/// A write whose power is cut at each `every`-th operation of the flash. Returns how many cuts and
/// operations there were.
fn cut_a_write(every: usize) -> (usize, usize) {
    let stream = soccer();
    let mut robot = Robot::new(firmware(), &flash_image());
    let mut host = data_host(&mut robot);
    host.set_budget(5000 * MS);
    begin_write(&mut host, &mut robot, SLOT.into(), stream.len());
    // Twice, so that the second write has to save the mark and to erase a used bank.
    send(&mut host, &mut robot, &stream).expect("it takes the data");
    assert_eq!(u32::from(wait_stored(&mut host, &mut robot).result), c::STORE_OK);
    let whole = robot.board.board.flash.image().to_vec();
    robot.board.board.flash.record_changes();
    let robot = &mut robot;
    let mut link = Cutting { robot, whole: &whole, every, operations: 0, next: 0, cuts: 0 };
    let wire = slot_header_encode(&header(stream.len() as u32));
    host.control_out(&mut link, put(c::REQUEST_STORE_WRITE, SLOT.into(), 0), &wire)
        .expect("the write begins");
    for packet in stream.chunks(512) {
        host.bulk_out(&mut link, 2, packet).expect("it takes the data");
    }
    for _ in 0..200 {
        let later = link.robot.fx2.now() + 10 * MS;
        link.run_until(later);
        if u32::from(store_status(&mut host, link.robot).result) != c::STORE_BUSY {
            break;
        }
    }
    assert_eq!(u32::from(store_status(&mut host, link.robot).result), c::STORE_OK);
    (link.cuts, link.operations)
}

#[test]
fn killing_the_power_during_a_write_never_loses_the_default() {
    let (cuts, operations) = cut_a_write(100);
    assert!(cuts > 30, "{cuts} cuts in {operations} operations");
}

/// `cargo test --release -p twin --test turret_firmware -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes; the same as the one above, at every single operation"]
fn killing_the_power_at_every_flash_operation_never_loses_the_default() {
    let (cuts, operations) = cut_a_write(1);
    println!("{cuts} cuts in {operations} operations");
    assert!(cuts + 10 > operations, "{cuts} cuts in {operations} operations");
}
