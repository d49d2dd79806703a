//! Whole matches with the firmware images as CMake's `firmware` preset builds them; without the
//! images these tests fail and say how to build them.
//!
//! Each match is deterministic, so a failure names the seeds that replay it with `sot play`.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};
use std::{fs, thread};

use fx2::host::Link;
use khepera::WheelFault;
use sim::{MS, Ps, SECOND, TraceHash};
use twin::game::{BallColour, Eyes, Format, Game, Materials, Noise, Other, Setup, Summary};
use twin::robot::{Images, Robot};
use twin::tally::Samples;
use virtex::bitstream;
use virtex::design::Function;
use virtex::store::{Entry, pack};
use world::opponents::Kind;

/// These are played here; tools/bench-match plays the sets that the figures in docs are about.
const SEEDS: std::ops::RangeInclusive<u64> = 1..=5;
/// So many of them must score; with measured noise it is 90 of 100.
const SCORE: usize = 4;
/// Simulated time of a match.
const MATCH: Ps = 60 * SECOND;
/// ... and of one in which nothing can come: thrice what a goal takes.
const BLIND: Ps = 20 * SECOND;
/// Busy part of the 68331's time, in a match.
const LOAD_LIMIT: f64 = 0.25;
/// Its instruction times are approximate: the limit is to hold at so many times the count.
const LOAD_MARGIN: f64 = 1.25;
/// 99 of 100 reports reach the motors within this.
const REPORT_TO_PWM_MS: f64 = 5.0;
/// Bytes of a slot's bank before its header; the first slot's bitstream lies there.
const SOMEWHERE_IN_THE_BITSTREAM: usize = 100_000;

fn built(path: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../build/firmware").join(path);
    fs::read(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware",
            path.display()
        )
    })
}

fn images() -> Images {
    static IMAGES: OnceLock<Images> = OnceLock::new();
    IMAGES
        .get_or_init(|| {
            let stream = bitstream::make(Function::Soccer, &bitstream::Options::default());
            let slot = Entry::from_file(0, &stream, "soccer".into()).expect("a good stream");
            Images {
                fx2: built("fx2-firmware/fx2-firmware.ihx"),
                khepera: built("khepera-firmware/khepera-firmware.elf"),
                flash: pack(&[slot], 0),
            }
        })
        .clone()
}

fn setup(seed: u64) -> Setup {
    Setup {
        seed,
        images: images(),
        eyes: Eyes::Open,
        ball: BallColour::Yellow,
        other: Other::Program(Kind::Idle),
        noise: Noise::None,
        materials: Materials::default(),
        format: kick_off(MATCH),
    }
}

/// Played until the first goal.
fn kick_off(length: Ps) -> Format {
    Format { first_goal_ends: true, ..Format::single(length) }
}

fn play(setup: Setup) -> Summary {
    let mut game = Game::new(setup).expect("the images are good");
    while !game.over() {
        game.run_for(SECOND);
    }
    game.summary()
}

/// All seeds' matches, as many at a time as there are processors; in the order of the seeds.
fn play_all(change: impl Fn(&mut Setup) + Sync) -> Vec<(u64, Summary)> {
    let next = AtomicU64::new(*SEEDS.start());
    let results = Mutex::new(Vec::new());
    let workers = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if !SEEDS.contains(&seed) {
                        return;
                    }
                    let mut setup = setup(seed);
                    change(&mut setup);
                    let summary = play(setup);
                    results.lock().expect("no worker panicked").push((seed, summary));
                }
            });
        }
    });
    let mut results = results.into_inner().expect("no worker panicked");
    results.sort_by_key(|&(seed, _)| seed);
    results
}

/// From the attention line to the motors, the 99th percentile of all matches.
fn report_to_pwm_ms(results: &[(u64, Summary)]) -> f64 {
    let mut all = Samples::default();
    for (_, summary) in results {
        all.extend(&summary.tally.report_to_pwm_ms);
    }
    all.percentile(0.99).expect("reports reach the motors")
}

fn scoring_seeds(results: &[(u64, Summary)]) -> Vec<u64> {
    results.iter().filter(|(_, summary)| summary.goals_for > 0).map(|&(seed, _)| seed).collect()
}

#[test]
fn most_seeds_score_within_a_minute_and_the_first_among_them() {
    let results = play_all(|setup| setup.noise = Noise::Measured);
    for (seed, summary) in &results {
        println!(
            "seed {seed:2}: {} : {} after {:4.1} s, 68331 {:2.0} % busy",
            summary.goals_for,
            summary.goals_against,
            summary.time as f64 / SECOND as f64,
            summary.cpu_load * 100.0
        );
        assert!(summary.fpga.configured, "seed {seed}: {:?}", summary.fpga);
        let busy = summary.cpu_load;
        assert!(LOAD_MARGIN * busy <= LOAD_LIMIT, "seed {seed}: 68331 busy for {busy}");
    }
    let late = report_to_pwm_ms(&results);
    println!("report to PWM: {late:.1} ms (99 %)");
    assert!(late <= REPORT_TO_PWM_MS, "{late} ms");
    let scoring = scoring_seeds(&results);
    assert!(scoring.contains(&1), "seed 1 did not score; these did: {scoring:?}");
    assert!(scoring.len() >= SCORE, "only these seeds score: {scoring:?}");
}

#[test]
fn without_eyes_nobody_scores() {
    let scoring = scoring_seeds(&play_all(|setup| {
        setup.eyes = Eyes::Black;
        setup.format = kick_off(BLIND);
    }));
    assert_eq!(scoring, [0_u64; 0], "these seeds score with black eyes");
}

#[test]
fn with_a_pink_ball_nobody_scores() {
    let scoring = scoring_seeds(&play_all(|setup| {
        setup.ball = BallColour::Pink;
        setup.format = kick_off(BLIND);
    }));
    assert_eq!(scoring, [0_u64; 0], "these seeds score with a pink ball");
}

#[test]
fn the_same_seed_does_the_same_and_another_another() {
    let five_seconds =
        |seed| play(Setup { format: kick_off(5 * SECOND), ..setup(seed) }).trace_hash;
    assert_eq!(five_seconds(1), five_seconds(1));
    assert_ne!(five_seconds(1), five_seconds(2));
}

#[test]
fn a_damaged_bitstream_leaves_the_fpga_unconfigured_and_the_summary_says_why() {
    let mut setup = Setup { format: kick_off(10 * SECOND), ..setup(1) };
    setup.images.flash[SOMEWHERE_IN_THE_BITSTREAM] ^= 0x10;
    let summary = play(setup);
    let why = summary.fpga.why.expect("a reason");
    assert!(why.contains("CRC error"), "{why}");
    assert!(!summary.fpga.configured);
    assert_eq!((summary.goals_for, summary.frames, summary.reports), (0, 0, 0));
}

#[test]
fn an_empty_flash_leaves_the_fpga_unconfigured_and_the_summary_says_why() {
    let mut setup = Setup { format: kick_off(10 * SECOND), ..setup(1) };
    setup.images.flash.fill(0xFF);
    let summary = play(setup);
    let why = summary.fpga.why.expect("a reason");
    assert!(why.contains("no default slot"), "{why}");
    assert_eq!((summary.goals_for, summary.reports), (0, 0));
}

#[test]
fn a_capture_bitstream_runs_but_reports_nothing() {
    let mut setup = Setup { format: kick_off(10 * SECOND), ..setup(1) };
    let stream = bitstream::make(Function::Capture, &bitstream::Options::default());
    let slot = Entry::from_file(3, &stream, "capture".into()).expect("a good stream");
    setup.images.flash = pack(&[slot], 3);
    let summary = play(setup);
    assert_eq!(summary.fpga.function, Some("capture"));
    assert_eq!(summary.fpga.slot, Some(3));
    assert_eq!((summary.goals_for, summary.reports), (0, 0));
}

/// Runs on; everything that both chips do on the way, and how they are at the end.
fn traced(robot: &mut Robot, until: Ps) -> u64 {
    let mut trace = TraceHash::default();
    while robot.now() < until {
        robot.run_until(robot.now() + MS);
        let base = &mut robot.base;
        trace.update(format!("{:?} {:?}", base.registers(), base.motors()).as_bytes());
        trace.update(format!("{:?} {:#x}", base.serial_take(), base.pc()).as_bytes());
        let fx2 = robot.fx2();
        trace.update(format!("{:?} {} {}", fx2.driven(), fx2.cycles(), fx2.cpu().pc()).as_bytes());
    }
    trace.update(format!("{:?}", robot.fx2()).as_bytes());
    trace.value()
}

#[test]
fn a_robot_copied_in_mid_configuration_goes_on_with_the_same_trace() {
    let mut robot = Robot::new(&images()).unwrap();
    // The loader reads the EEPROM; then the GPIF moves the bitstream from the flash into the FPGA.
    while robot.fx2().is_cpu_held() {
        robot.run_until(robot.now() + MS);
        assert!(robot.now() < SECOND, "the firmware never starts");
    }
    let configured = robot.now() + 60 * MS;
    while robot.now() < configured {
        let mut copy = robot.clone();
        let end = robot.now() + 9 * MS;
        assert_eq!(traced(&mut copy, end), traced(&mut robot, end), "at {} ms", robot.now() / MS);
    }
}

#[test]
fn a_second_robot_with_the_same_firmware_plays_on_the_other_side() {
    let mut game = Game::new(Setup {
        other: Other::Firmware(Box::new(images())),
        noise: Noise::Measured,
        format: Format::single(4 * SECOND),
        ..setup(3)
    })
    .expect("the images are good");
    let start = [0, 1].map(|robot| game.world().robot(robot));
    while !game.over() {
        game.run_for(SECOND);
    }
    let other = game.other().expect("it has firmware");
    assert!(other.fpga().configured);
    assert!(other.counts().reports > 100, "{:?}", other.counts());
    for (robot, was) in start.into_iter().enumerate() {
        assert_ne!(game.world().robot(robot), was, "robot {robot} stands");
    }
}

#[test]
fn after_each_half_ends_are_changed_and_the_robot_is_started_anew() {
    let mut game = Game::new(Setup { format: Format::league(6 * SECOND), ..setup(2) })
        .expect("the images are good");
    let mut started = 0;
    while !game.over() {
        game.run_for(SECOND / 10);
        started += game.take_serial_lines().iter().filter(|l| l.contains("playing")).count();
    }
    let kick_offs: Vec<_> = game.events().iter().filter_map(|event| event.period()).collect();
    assert!(kick_offs.contains(&"first half") && kick_offs.contains(&"second half"));
    assert_eq!(started, kick_offs.len(), "{:?}", game.events());
    // Latencies and beliefs have been measured on the way.
    let tally = game.summary().tally;
    assert!(tally.report_to_pwm_ms.len() > 50 && tally.ball_errors.range_percent.len() > 20);
}

#[test]
fn a_base_that_misses_its_starting_signal_gets_it_again() {
    let mut game = Game::new(setup(2)).expect("the images are good");
    while game.events().is_empty() {
        game.run_for(MS);
    }
    // The line is on its way: a reset loses it, and what it has begun.
    game.ours_mut().robot_mut().base.reset();
    game.run_for(2 * SECOND);
    let lines = game.take_serial_lines();
    let ready = lines.iter().filter(|line| line.contains("ready;")).count();
    let started = lines.iter().filter(|line| line.starts_with("ok: playing")).count();
    assert_eq!([ready, started], [2, 1], "{lines:?}");
}

#[test]
fn a_robot_whose_wheels_are_blocked_is_stuck_as_long_as_that() {
    let mut game = Game::new(setup(3)).expect("the images are good");
    game.run_for(SECOND);
    assert_eq!(game.summary().tally.stuck_ms, 0, "it moves freely");
    let block = |game: &mut Game, fault| {
        for wheel in 0..2 {
            game.ours_mut().robot_mut().base.set_wheel_fault(wheel, fault);
        }
    };
    block(&mut game, WheelFault::Stalled);
    game.run_for(2 * SECOND);
    // Not while it has no wish to drive.
    let stuck_ms = game.summary().tally.stuck_ms;
    assert!((1000..=2000).contains(&stuck_ms), "{stuck_ms} ms of 2000");
    block(&mut game, WheelFault::None);
    game.run_for(SECOND);
    let later_ms = game.summary().tally.stuck_ms;
    assert!(later_ms < stuck_ms + 600, "{stuck_ms} ms, then {later_ms} ms");
}
