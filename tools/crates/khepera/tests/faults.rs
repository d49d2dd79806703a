//! What our firmware does when something breaks: motors off in time, and nothing damaged runs.
//!
//! Faults come from outside only: from the model of the base, or from a word put into the running
//! program as a debugger would put it. The firmware is the image as built, with nothing in it for these
//! tests.

use std::path::Path;
use std::sync::OnceLock;

use common_sys::constants as board;
use khepera::battery::Battery;
use khepera::turret_bus::Unconnected;
use khepera::{Base, Config, CpuState, ResetCause, WheelFault};
use object::read::elf::ElfFile32;
use object::{BigEndian, Object, ObjectSymbol};
use sim::{MS, Ps, SECOND};

/// Motors are off so soon after anything that stops control.
const LIMIT: Ps = 200 * MS;
/// From power-on to a program that answers, with some margin.
const START_UP: Ps = 600 * MS;

fn firmware() -> &'static [u8] {
    static FILE: OnceLock<Vec<u8>> = OnceLock::new();
    FILE.get_or_init(|| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../../build/firmware/khepera-firmware/khepera-firmware.elf");
        std::fs::read(&path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware",
                path.display()
            )
        })
    })
}

/// Address of a function of the firmware.
fn symbol(name: &str) -> u32 {
    let file = ElfFile32::<BigEndian>::parse(firmware()).expect("an ELF file");
    let found = file.symbols().find(|symbol| symbol.name() == Ok(name));
    found.unwrap_or_else(|| panic!("the firmware has no function {name}")).address() as u32
}

fn run(base: &mut Base, duration: Ps) {
    base.run_until(base.now() + duration, &mut Unconnected);
}

fn heard(base: &mut Base) -> String {
    base.serial_take().into_iter().map(|(_, byte)| char::from(byte)).collect()
}

/// What the base answers to a line.
fn ask(base: &mut Base, line: &str) -> String {
    base.serial_take();
    base.serial_send(line.as_bytes());
    base.serial_send(b"\r\n");
    // The longest answers are lists of some hundred characters, a millisecond each.
    let mut quiet = 0;
    let mut answer = String::new();
    for _ in 0..300 {
        run(base, 5 * MS);
        let more = heard(base);
        quiet = if more.is_empty() { quiet + 1 } else { 0 };
        answer += &more;
        if quiet > 12 && !answer.is_empty() {
            break;
        }
    }
    answer
}

/// A base that has started.
fn started() -> Base {
    static STARTED: OnceLock<Base> = OnceLock::new();
    let base = STARTED.get_or_init(|| {
        let mut base = Base::new(firmware(), Config::default()).expect("an image");
        run(&mut base, START_UP);
        heard(&mut base);
        base
    });
    base.clone()
}

/// A base that drives straight on at 20 counts a period, 167 mm/s.
fn driving() -> Base {
    let mut base = started();
    assert_eq!(ask(&mut base, "D,20,20"), "d\r\n");
    run(&mut base, 500 * MS);
    for speed in base.wheel_speeds_mm_s() {
        assert!((speed - 166.7).abs() < 10.0, "it drives at {speed} mm/s");
    }
    base
}

fn motors_are_off(base: &Base) -> bool {
    base.motors().iter().all(|motor| motor.duty == 0.0)
}

/// Time until both motors are off, which they must stay for a second.
fn time_to_motors_off(base: &mut Base) -> Ps {
    let fault = base.now();
    while !motors_are_off(base) {
        assert!(base.now() < fault + SECOND, "the motors still run after a second");
        run(base, MS);
    }
    let off = base.now() - fault;
    for _ in 0..1000 {
        run(base, MS);
        assert!(motors_are_off(base), "the motors run again");
    }
    off
}

fn assert_off_in_time(base: &mut Base, what: &str) {
    let off = time_to_motors_off(base);
    assert!(off <= LIMIT, "{what}: motors off after {} ms", off / MS);
}

#[test]
fn a_stuck_encoder_turns_both_motors_off() {
    for wheel in 0..2 {
        let mut base = driving();
        base.set_wheel_fault(wheel, WheelFault::EncoderStuck);
        assert_off_in_time(&mut base, "encoder");
        base.set_wheel_fault(wheel, WheelFault::None);
        assert_eq!(ask(&mut base, "D,20,20"), "d\r\n", "a new command drives again");
        run(&mut base, 500 * MS);
        assert!(base.wheel_speeds_mm_s()[wheel] > 150.0);
    }
}

#[test]
fn a_stalled_wheel_turns_both_motors_off() {
    for wheel in 0..2 {
        let mut base = driving();
        base.set_wheel_fault(wheel, WheelFault::Stalled);
        assert_off_in_time(&mut base, "stalled wheel");
    }
}

#[test]
fn a_silent_adc_is_told_and_stops_nothing() {
    let mut base = driving();
    base.set_adc_silent(true);
    run(&mut base, 500 * MS);
    assert!(ask(&mut base, "N").starts_with("z,"), "no readings, so an error");
    assert_eq!(ask(&mut base, "E").split(',').next(), Some("e"));
    assert!(base.wheel_speeds_mm_s().iter().all(|&speed| speed > 150.0));
    base.set_adc_silent(false);
    run(&mut base, 200 * MS);
    assert_eq!(ask(&mut base, "N").split(',').next(), Some("n"), "it is back");
}

#[test]
fn a_flooded_console_neither_stops_control_nor_hides_an_estop() {
    let mut base = driving();
    let mut random = 12345u32;
    for _ in 0..4 {
        let flood: Vec<u8> = (0..500)
            .map(|_| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // No line ends, and no capital that could be a command after one.
                b'a' + (random >> 24) as u8 % 26
            })
            .collect();
        base.serial_send(&flood);
        run(&mut base, 500 * MS);
        for speed in base.wheel_speeds_mm_s() {
            assert!((speed - 166.7).abs() < 10.0, "{speed} mm/s under the flood");
        }
    }
    base.serial_send(b"xxestopxx");
    while base.serial_waiting() > 0 {
        run(&mut base, MS);
    }
    assert_off_in_time(&mut base, "estop");
    // 100 characters of the flood and a line's end: it is a line too long or unknown, and it is over.
    base.serial_send(b"\r\n");
    run(&mut base, SECOND);
    assert_eq!(ask(&mut base, "E").split(',').next(), Some("e"), "it listens again");
}

/// What happens when the firmware's control loop comes upon `words` while driving.
fn struck_by(words: &[u16]) -> Base {
    let mut base = driving();
    let at = symbol("robot_tick");
    for (address, &word) in (at..).step_by(2).zip(words) {
        assert!(base.poke_word(address, word));
    }
    base
}

#[test]
fn a_program_that_hangs_is_reset_by_the_watchdog() {
    let mut base = struck_by(&[0x60FE]); // bra to itself
    assert_off_in_time(&mut base, "hang");
    assert_eq!(base.resets().last().map(|reset| reset.cause), Some(ResetCause::Watchdog));
    assert!(ask(&mut base, "status").contains("watchdog"));
}

#[test]
fn every_exception_turns_the_motors_off_and_leaves_its_record() {
    let cases: [(&str, u8, &[u16]); 13] = [
        ("bus error", 2, &[0x2039, 0x0040, 0x0000]), // move.l 0x400000,d0
        ("address error", 3, &[0x3039, 0x0010, 0x0001]), // move.w 0x100001,d0
        ("illegal instruction", 4, &[0x4AFC]),
        ("division by zero", 5, &[0x80FC, 0x0000]), // divu #0,d0
        ("CHK", 6, &[0x70FF, 0x41BC, 0x0000]),      // moveq #-1,d0; chk #0,d0
        ("TRAPcc", 7, &[0x50FC]),                   // trapt
        ("privilege", 8, &[0x46FC, 0x0000, 0x4E72, 0x2700]), // to user state; stop
        ("trace", 9, &[0x46FC, 0xA000, 0x4E71]),    // trace on; nop
        ("line A", 10, &[0xA000]),
        ("line F", 11, &[0xF000]),
        ("format error", 14, &[0x3F3C, 0xF000, 0x42A7, 0x3F3C, 0x2700, 0x4E73]), // rte with a format F
        ("TRAP #0", 32, &[0x4E40]),
        ("TRAP #15", 47, &[0x4E4F]),
    ];
    for (name, vector, words) in cases {
        let mut base = struck_by(words);
        assert_off_in_time(&mut base, name);
        let record = ask(&mut base, "crash show");
        assert!(record.contains(&format!("vector {vector}")), "{name}: {record}");
    }
}

#[test]
fn a_spurious_interrupt_is_an_exception_too() {
    let mut base = struck_by(&[0x4278, 0xFC00, 0x4E75]); // clr.w QSMCR: no IARB; rts
    base.serial_send(b"E\r\n");
    assert_off_in_time(&mut base, "spurious interrupt");
    assert!(ask(&mut base, "crash show").contains("vector 24"));
}

#[test]
fn a_stack_overflow_is_caught_where_the_ram_ends() {
    let mut base = struck_by(&[0x6100, 0xFFFE]); // bsr to itself
    assert_off_in_time(&mut base, "stack overflow");
    assert_eq!(base.resets().last().map(|reset| reset.cause), Some(ResetCause::Halt));
    assert!(ask(&mut base, "status").contains("halt monitor"));
}

#[test]
fn a_brown_out_stops_and_what_comes_back_stands_still() {
    let mut base = driving();
    base.set_battery_mv(3000);
    run(&mut base, MS);
    assert!(motors_are_off(&base), "no supply, no motor");
    run(&mut base, 100 * MS);
    base.set_battery_mv(4800);
    for _ in 0..1000 {
        run(&mut base, MS);
        assert!(motors_are_off(&base), "the motors run after a brown-out");
    }
    assert_eq!(ask(&mut base, "E").split(',').next(), Some("e"), "it is back");
}

#[test]
fn a_battery_that_empties_is_told_and_ends_in_a_brown_out_with_the_motors_off() {
    let mut base = Base::new(firmware(), Config::default()).expect("a good image");
    let mut battery = Battery::connect(&mut base, 0.05);
    let mut seconds = 0.0;
    let mut run = |base: &mut Base, battery: &mut Battery, time: Ps| {
        let end = base.now() + time;
        while base.now() < end {
            base.run_until(base.now() + 5 * MS, &mut Unconnected);
            battery.step(base);
            seconds += 0.005;
        }
    };
    run(&mut base, &mut battery, SECOND);
    base.serial_send(b"log live on\r\nD,60,60\r\n");
    run(&mut base, &mut battery, SECOND);
    assert!((0.15..0.6).contains(&battery.current_a()), "{} A", battery.current_a());
    base.serial_take();
    base.serial_send(b"I,8\r\n");
    run(&mut base, &mut battery, 100 * MS);
    let said: Vec<u8> = base.serial_take().into_iter().map(|(_, byte)| byte).collect();
    let read = String::from_utf8_lossy(&said).trim_end().rsplit(',').next().map(str::to_owned);
    let read: f64 = read.and_then(|text| text.parse().ok()).expect("i,VALUE");
    let shown_mv = read * f64::from(board::BOARD_ADC_BATTERY_FULL_SCALE_MV) / 1023.0;
    assert!((shown_mv - f64::from(battery.millivolt())).abs() < 60.0, "{shown_mv} mV");

    let mut said = String::new();
    for _ in 0..600 {
        run(&mut base, &mut battery, SECOND);
        said.extend(base.serial_take().into_iter().map(|(_, byte)| char::from(byte)));
        if base.cpu_state() == CpuState::Held {
            break;
        }
    }
    assert_eq!(base.cpu_state(), CpuState::Held, "{battery:?}");
    assert!(said.contains("battery low"), "{said}");
    assert!(motors_are_off(&base));
    // Without load the voltage recovers: the base must not start and drive again.
    run(&mut base, &mut battery, 20 * SECOND);
    assert!(motors_are_off(&base) && base.resets().len() < 4, "{:?}", base.resets());
    println!("empty after {seconds:.0} s from 5 %, at {} mV", battery.millivolt());
}

/// A parameter's value, from the answer `NAME = VALUE unit (...)`.
fn parameter(base: &mut Base, name: &str) -> String {
    let answer = ask(base, &format!("get {name}"));
    let value = answer.split_whitespace().nth(2);
    value.unwrap_or_else(|| panic!("no value in '{answer}'")).to_owned()
}

/// `save`, and what comes of it: erasing both copies takes two seconds.
fn save(base: &mut Base) {
    base.serial_send(b"save\r\n");
    let mut answer = String::new();
    let end = base.now() + 8 * SECOND;
    while !answer.ends_with("\r\n") {
        assert!(base.now() < end, "no answer to save");
        run(base, 5 * MS);
        answer += &heard(base);
    }
    assert!(answer.contains("ok: saved"), "{answer}");
}

/// One parameter that was saved before, and one that the cut save would change.
const KEPT: &str = "speed.kd";
const CHANGED: &str = "battery.low_mv";

/// Cut the power in every flash operation of a `save` that changes CHANGED from 3001 to 3002, and look
/// what the base has afterwards.
fn cut_everywhere(moment: &Base, end: u64) {
    let mut seen = std::collections::BTreeMap::new();
    let first = moment.flash_operations();
    assert!(end > first + 10, "a save programs something");
    for operation in first..end {
        let mut base = moment.clone();
        base.cut_power_at_flash_operation(Some(operation));
        base.serial_send(b"save\r\n");
        while base.cpu_state() != CpuState::Held {
            assert!(base.now() < moment.now() + 5 * SECOND, "operation {operation}: not cut");
            run(&mut base, MS);
        }
        base.set_power(true);
        run(&mut base, START_UP);
        heard(&mut base);
        assert_eq!(parameter(&mut base, KEPT), "901", "cut in operation {operation}");
        let value = parameter(&mut base, CHANGED);
        assert!(
            ["3001", "3002"].contains(&value.as_str()),
            "cut in operation {operation}: {value}"
        );
        *seen.entry(value).or_insert(0) += 1;
    }
    println!("{} cuts: {seen:?}", end - first);
}

/// A base that has saved KEPT = 901 and CHANGED = 3001.
fn saved() -> Base {
    let mut base = started();
    assert!(ask(&mut base, &format!("set {KEPT} 901")).starts_with("ok"), "a parameter's name");
    assert!(ask(&mut base, &format!("set {CHANGED} 3001")).starts_with("ok"), "a parameter's name");
    save(&mut base);
    base
}

#[test]
fn power_cut_in_any_flash_operation_of_save_loses_no_saved_parameter() {
    let mut base = saved();
    assert!(ask(&mut base, &format!("set {CHANGED} 3002")).starts_with("ok"));
    let moment = base.clone();
    save(&mut base);
    cut_everywhere(&moment, base.flash_operations());
}

#[test]
fn the_same_when_the_save_has_to_erase_a_sector_first() {
    let mut base = saved();
    for _ in 0..1000 {
        let before = base.now();
        let mut moment = base.clone();
        save(&mut base);
        if base.now() - before > SECOND / 2 {
            assert!(ask(&mut moment, &format!("set {CHANGED} 3002")).starts_with("ok"));
            let mut whole = moment.clone();
            save(&mut whole);
            return cut_everywhere(&moment, whole.flash_operations());
        }
    }
    panic!("no sector is ever full");
}
