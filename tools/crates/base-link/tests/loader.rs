//! The resident loader, run on the emulated base, against everything that can go wrong on the way.
//!
//! The flash starts as production leaves it: our firmware's file with the loader in it. The programs
//! that are flashed are a few instructions that send one letter again and again, so that a test hears
//! which of them runs.

use std::io;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use base_link::{Error, Line, Options, Outcome, Program, Step, flash};
use common_sys::constants as c;
use khepera::turret_bus::Unconnected;
use khepera::{Base, Config};
use rand_core::Rng;
use rand_pcg::Pcg32;
use sim::{MS, Ps, SECOND};

const RAM: u32 = c::BOARD_PROGRAM_BASE;

/// Sends `letter` for ever and serves the watchdog; filled up with `filler` to `length` bytes.
fn program(letter: u8, length: usize, filler: u32) -> Program {
    let words = [
        0x31FC,
        0x0052,
        0xFC08, // move.w #82,SCCR0
        0x31FC,
        0x0008,
        0xFC0A, // move.w #TE,SCCR1
        0x11FC,
        0x0055,
        0xFA27, // again: move.b #0x55,SWSR
        0x11FC,
        0x00AA,
        0xFA27, //        move.b #0xAA,SWSR
        0x0838,
        0x0000,
        0xFC0C, //        btst #0,SCSR
        0x67EC, //                        beq again
        0x31FC,
        u16::from(letter),
        0xFC0E, // move.w #letter,SCDR
        0x60E4, //                        bra again
    ];
    let mut bytes: Vec<u8> = words.iter().flat_map(|word: &u16| word.to_be_bytes()).collect();
    let mut random = Pcg32::new(u64::from(filler), 1);
    bytes.resize_with(length.max(bytes.len()), || (random.next_u32() >> 11) as u8);
    Program { load: RAM, entry: RAM, bytes, build: [letter; 20] }
}

fn firmware() -> &'static [u8] {
    static FILE: OnceLock<Vec<u8>> = OnceLock::new();
    FILE.get_or_init(|| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../../build/firmware/khepera-firmware/khepera-firmware.elf");
        std::fs::read(&path).unwrap_or_else(|error| {
            panic!("{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware", path.display())
        })
    })
}

fn run(base: &mut Base, duration: Ps) {
    base.run_until(base.now() + duration, &mut Unconnected);
}

/// What one request finds, so that it can be tried again with a cut in it.
#[derive(Clone)]
struct Moment {
    base: Base,
    bytes: Vec<u8>,
}

/// The line to an emulated base.
struct Wire {
    base: Base,
    /// When the base is switched off and on, for the loader to hear a knock.
    power_cycle: Option<Ps>,
    /// One of so many characters, in either direction, is hit: lost, doubled, or changed.
    noise: Option<(Pcg32, u32)>,
    moments: Option<Vec<Moment>>,
}

impl Wire {
    fn new(base: Base) -> Self {
        Self { base, power_cycle: None, noise: None, moments: None }
    }

    fn pass(&mut self, bytes: &[u8]) -> Vec<u8> {
        let Some((random, one_of)) = &mut self.noise else { return bytes.to_vec() };
        let mut through = Vec::new();
        for &byte in bytes {
            if random.next_u32() % *one_of != 0 {
                through.push(byte);
                continue;
            }
            match random.next_u32() % 3 {
                0 => {}
                1 => through.extend([byte, byte]),
                _ => through.push(byte ^ (1 << (random.next_u32() % 8))),
            }
        }
        through
    }
}

impl Line for Wire {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        if let Some(moments) = &mut self.moments {
            moments.push(Moment { base: self.base.clone(), bytes: bytes.to_vec() });
        }
        let bytes = self.pass(bytes);
        self.base.serial_send(&bytes);
        Ok(())
    }

    fn receive(&mut self, limit: Duration) -> io::Result<Vec<u8>> {
        let end = self.base.now() + limit.as_nanos() as Ps * 1000;
        while self.base.now() < end {
            if self.power_cycle.is_some_and(|t| self.base.now() >= t) {
                self.power_cycle = None;
                self.base.set_power(false);
                run(&mut self.base, 50 * MS);
                self.base.set_power(true);
            }
            run(&mut self.base, MS);
            let heard: Vec<u8> =
                self.base.serial_take().into_iter().map(|(_, byte)| byte).collect();
            if !heard.is_empty() {
                return Ok(self.pass(&heard));
            }
        }
        Ok(vec![])
    }

    fn set_baud(&mut self, baud: u32) -> io::Result<()> {
        while self.base.serial_waiting() > 0 {
            run(&mut self.base, MS);
        }
        self.base.serial_set_baud(Some(baud));
        Ok(())
    }

    fn now(&self) -> Duration {
        Duration::from_nanos(self.base.now() / 1000)
    }
}

/// A base whose flash holds `contents`, switched on, in its loader: somebody knocked.
fn in_loader(contents: &[u8]) -> Base {
    let mut base = Base::from_flash(contents, Config::default()).expect("a flash");
    run(&mut base, 30 * MS);
    let hello =
        common_sys::loader::Frame { kind: c::LOADER_HELLO as u8, sequence: 1, payload: vec![] };
    base.serial_send(&hello.encode());
    run(&mut base, 300 * MS);
    assert!(!base.serial_take().is_empty(), "the loader answers a knock");
    base
}

fn new_base() -> &'static [u8] {
    static FLASH: OnceLock<Vec<u8>> = OnceLock::new();
    FLASH.get_or_init(|| {
        Base::new(firmware(), Config::default()).expect("an image").flash().to_vec()
    })
}

fn put(wire: &mut Wire, program: &Program, options: &Options) -> Result<Outcome, Error> {
    flash(wire, program, options, &mut |_| true)
}

/// The flash of a base that runs program A.
fn with_a() -> &'static [u8] {
    static FLASH: OnceLock<Vec<u8>> = OnceLock::new();
    FLASH.get_or_init(|| {
        let mut wire = Wire::new(in_loader(new_base()));
        put(&mut wire, &program(b'A', 700, 1), &Options::default()).expect("a new base takes it");
        wire.base.flash().to_vec()
    })
}

/// Switch on and hear which program runs; '-' for none, which means the loader waits.
fn runs(base: &mut Base) -> char {
    base.set_power(false);
    run(base, 10 * MS);
    base.set_power(true);
    base.serial_set_baud(Some(c::BOARD_BAUD));
    base.serial_take();
    for _ in 0..60 {
        run(base, 5 * MS);
        let heard = base.serial_take();
        if let Some(&(_, letter)) = heard.last() {
            return char::from(letter);
        }
    }
    '-'
}

#[test]
fn a_program_is_written_and_runs_and_the_next_time_nothing_is_to_do() {
    let mut base = Base::from_flash(with_a(), Config::default()).expect("a flash");
    assert_eq!(runs(&mut base), 'A');
    let mut wire = Wire::new(in_loader(with_a()));
    let new = program(b'B', 3000, 2);
    let first = put(&mut wire, &new, &Options::default()).expect("it takes it");
    assert_eq!((first.unchanged, first.sent, first.generation), (false, 12, 3));
    assert_eq!(runs(&mut wire.base), 'B');
    let mut wire = Wire::new(in_loader(wire.base.flash()));
    let again = put(&mut wire, &new, &Options::default()).expect("it takes it");
    assert!(again.unchanged);
    assert_eq!(runs(&mut wire.base), 'B');
    assert_eq!(wire.base.diagnostics(), []);
}

#[test]
fn only_what_changed_crosses_the_line() {
    let mut old = program(b'C', 40_000, 3);
    let mut wire = Wire::new(in_loader(new_base()));
    put(&mut wire, &old, &Options::default()).expect("it takes it");
    old.bytes[30_000] ^= 1;
    let mut wire = Wire::new(in_loader(wire.base.flash()));
    let outcome = put(&mut wire, &old, &Options::default()).expect("it takes it");
    assert_eq!((outcome.sent, outcome.copied), (1, 156), "{outcome:?}");
    assert_eq!(runs(&mut wire.base), 'C');
}

#[test]
fn sixty_four_kib_take_seconds_and_one_block_of_them_less() {
    let seconds = |wire: &mut Wire, program: &Program| {
        let before = wire.base.now();
        put(wire, program, &Options::default()).expect("it takes it");
        (wire.base.now() - before) as f64 / SECOND as f64
    };
    let mut new = program(b'E', 64 << 10, 4);
    let mut wire = Wire::new(in_loader(new_base()));
    let all = seconds(&mut wire, &new);
    new.bytes[40_000] ^= 1;
    let mut wire = Wire::new(in_loader(wire.base.flash()));
    let one = seconds(&mut wire, &new);
    println!("64 KiB: {all:.1} s; one block of them: {one:.1} s");
    assert!(all < 15.0 && one < 8.0, "{all} and {one} s");
}

#[test]
fn a_dry_run_changes_nothing() {
    let mut wire = Wire::new(in_loader(with_a()));
    let options = Options { dry_run: true, ..Options::default() };
    let outcome = put(&mut wire, &program(b'B', 3000, 2), &options).expect("it answers");
    assert_eq!((outcome.sent, outcome.erased), (12, 1));
    assert_eq!(wire.base.flash_operations(), 0);
    assert_eq!(runs(&mut wire.base), 'A');
}

#[test]
fn a_base_that_does_not_listen_is_reached_by_switching_it_off_and_on() {
    let mut wire = Wire::new(Base::from_flash(with_a(), Config::default()).expect("a flash"));
    wire.power_cycle = Some(6 * SECOND);
    let new = program(b'B', 700, 2);
    let options = Options { wait: Duration::from_secs(10), ..Options::default() };
    let mut knocked = false;
    let outcome = flash(&mut wire, &new, &options, &mut |step| {
        knocked |= step == Step::Knocking;
        true
    });
    assert!(!outcome.expect("it takes it").unchanged && knocked);
    assert_eq!(runs(&mut wire.base), 'B');
    let mut wire = Wire::new(Base::from_flash(with_a(), Config::default()).expect("a flash"));
    let error = put(&mut wire, &new, &Options::default()).expect_err("nobody answers");
    assert!(matches!(error, Error::Silent), "{error}");
}

#[test]
fn line_noise_costs_repetitions_and_nothing_else() {
    for seed in 0..4 {
        let mut wire = Wire::new(in_loader(with_a()));
        wire.noise = Some((Pcg32::new(seed, 5), 700));
        let new = program(b'B', 8000, seed as u32);
        let outcome = put(&mut wire, &new, &Options::default()).expect("it gets through");
        assert!(outcome.repeated > 0, "seed {seed}: no noise?");
        wire.noise = None;
        assert_eq!(runs(&mut wire.base), 'B', "seed {seed}");
    }
}

/// Flash B over A on a base that has erased its other bank before, and keep every request's moment.
fn session() -> (Vec<Moment>, Program) {
    let mut contents = with_a().to_vec();
    let other = c::BOARD_IMAGE_A as usize;
    // As a third flashing finds it: an old program in the way.
    contents[other..other + 2000].fill(0x5A);
    let mut wire = Wire::new(in_loader(&contents));
    wire.moments = Some(vec![]);
    let new = program(b'B', 700, 2);
    put(&mut wire, &new, &Options::default()).expect("it takes it");
    (wire.moments.unwrap_or_default(), new)
}

#[test]
fn power_cut_in_any_flash_operation_leaves_the_old_program_or_the_new() {
    let (moments, new) = session();
    let mut letters = std::collections::BTreeMap::new();
    let mut cuts = 0;
    for (number, moment) in moments.iter().enumerate() {
        let first = moment.base.flash_operations();
        let end = moments.get(number + 1).map_or(first + 64, |next| next.base.flash_operations());
        for operation in first..end {
            let mut base = moment.base.clone();
            base.cut_power_at_flash_operation(Some(operation));
            base.serial_send(&moment.bytes);
            for _ in 0..1200 {
                if base.cpu_state() == khepera::CpuState::Held {
                    break;
                }
                run(&mut base, MS);
            }
            if base.cpu_state() != khepera::CpuState::Held {
                assert_eq!(operation, end - 64, "request {number}, operation {operation}: not cut");
                break;
            }
            cuts += 1;
            let letter = runs(&mut base);
            assert!(
                "AB".contains(letter),
                "request {number}, operation {operation}: '{letter}' runs"
            );
            *letters.entry(letter).or_insert(0) += 1;
            if cuts % 100 == 1 {
                let mut wire = Wire::new(in_loader(base.flash()));
                put(&mut wire, &new, &Options::default()).expect("the next try takes it");
                assert_eq!(runs(&mut wire.base), 'B', "after a cut in operation {operation}");
            }
        }
    }
    assert!(cuts > 300, "only {cuts} cuts");
    assert!(letters[&'A'] > 300, "{letters:?}");
    println!("{cuts} cuts: {letters:?}");
}

#[test]
fn power_cut_at_any_byte_of_the_line_leaves_the_old_program_or_the_new() {
    let (moments, _) = session();
    let mut cuts = 0;
    let mut long_ones = 0;
    for (number, moment) in moments.iter().enumerate() {
        // The blocks differ in nothing but their number: the first one at each byte, the others less.
        let long = moment.bytes.len() > 64;
        long_ones += u32::from(long);
        let step = if long && long_ones > 1 { 7 } else { 1 };
        for count in (1..=moment.bytes.len()).step_by(step) {
            let mut base = moment.base.clone();
            base.serial_send(&moment.bytes[..count]);
            while base.serial_waiting() > 0 {
                base.run_until(base.now() + MS / 10, &mut Unconnected);
            }
            let letter = runs(&mut base);
            assert!("AB".contains(letter), "request {number}, byte {count}: '{letter}' runs");
            cuts += 1;
        }
    }
    assert!(cuts > 400, "only {cuts} cuts");
    println!("{cuts} cuts");
}

#[test]
fn a_damaged_image_never_runs() {
    let bank = c::BOARD_IMAGE_B as usize;
    let program = bank + c::BASE_IMAGE_PROGRAM_AT as usize;
    // A lies in bank B; bank A holds the firmware, which greets and then is silent.
    let mut base = Base::from_flash(with_a(), Config::default()).expect("a flash");
    assert_eq!(runs(&mut base), 'A');
    for at in (bank..bank + 68).step_by(3).chain((program..program + 700).step_by(17)) {
        let mut contents = with_a().to_vec();
        contents[at] ^= 0x08;
        // What the header's check sum does not cover is not read.
        let mut base = Base::from_flash(&contents, Config::default()).expect("a flash");
        assert_ne!(runs(&mut base), 'A', "with byte {at:#x} changed");
    }
    let mut contents = with_a().to_vec();
    contents[c::BOARD_IMAGE_A as usize + 300] ^= 1;
    contents[program] ^= 1;
    let mut base = Base::from_flash(&contents, Config::default()).expect("a flash");
    assert_eq!(runs(&mut base), '-', "no whole image: the loader waits");
    let mut wire = Wire::new(base);
    put(&mut wire, &self::program(b'D', 100, 1), &Options::default()).expect("it can be flashed");
    assert_eq!(runs(&mut wire.base), 'D');
}

#[test]
fn a_flash_that_fails_is_told_and_the_old_program_stays() {
    let mut wire = Wire::new(in_loader(with_a()));
    let mut steps = 0;
    let result = flash(&mut wire, &program(b'B', 9000, 2), &Options::default(), &mut |step| {
        steps += u32::from(matches!(step, Step::Writing(..)));
        steps < 10
    });
    assert!(matches!(result, Err(Error::Interrupted)));
    assert_eq!(runs(&mut wire.base), 'A');
}
