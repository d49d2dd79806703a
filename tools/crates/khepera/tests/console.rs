//! The firmware as CMake's `firmware` preset builds it, on its serial line: K-Team's protocol, the
//! shell, motion, and parameters in flash with the supply cut.

use std::fs;
use std::path::Path;

use common_sys::constants as board;
use khepera::turret_bus::Unconnected;
use khepera::{Base, Config};
use sim::{MS, Ps, SECOND, US};
use world::Noise;
use world::open_floor::OpenFloor;

/// From power-on until the program has greeted: the loader checks it at 3 ms a KiB.
const BOOT: Ps = 600 * MS;
/// What every reply must come within.
const REPLY: Ps = 50 * MS;
const SPEED_100_MM_S: f64 = 100.0 / 12.0 * 100.0;

fn image() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../build/firmware/khepera-firmware/khepera-firmware.elf");
    fs::read(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware",
            path.display()
        )
    })
}

/// A base and the terminal at its serial line.
struct Desk {
    base: Base,
    heard: Vec<u8>,
    first: Option<Ps>,
}

impl Desk {
    fn switch_on(base: Base) -> Self {
        let mut desk = Self { base, heard: vec![], first: None };
        desk.wait(BOOT);
        desk.clear();
        desk
    }

    fn new() -> Self {
        Self::switch_on(Base::new(&image(), Config::default()).expect("a good image"))
    }

    fn at(baud: u32) -> Self {
        let mut desk = Self::new();
        if baud != board::BOARD_BAUD {
            assert!(desk.ask(&format!("baud {baud}")).starts_with("ok: "));
            desk.base.serial_set_baud(Some(baud));
        }
        desk
    }

    fn wait(&mut self, time: Ps) {
        let end = self.base.now() + time;
        while self.base.now() < end {
            let next = (self.base.now() + MS).min(end);
            self.base.run_until(next, &mut Unconnected);
            self.listen();
        }
    }

    fn listen(&mut self) {
        for (time, byte) in self.base.serial_take() {
            self.first.get_or_insert(time);
            self.heard.push(byte);
        }
    }

    fn clear(&mut self) {
        self.heard.clear();
        self.first = None;
    }

    fn text(&self) -> String {
        String::from_utf8_lossy(&self.heard).into_owned()
    }

    /// Send bytes and wait until they are through.
    fn send(&mut self, bytes: &[u8]) {
        self.base.serial_send(bytes);
        while self.base.serial_waiting() > 0 {
            self.base.run_until(self.base.now() + MS, &mut Unconnected);
            self.listen();
        }
    }

    /// Send a line; the answer, which must begin in time and end with CR LF.
    fn ask(&mut self, line: &str) -> String {
        self.clear();
        self.send(line.as_bytes());
        self.send(b"\n");
        let sent = self.base.now();
        self.wait(REPLY);
        let first = self.first.unwrap_or_else(|| panic!("'{line}' was not answered in 50 ms"));
        assert!(first <= sent + REPLY, "'{line}' was answered too late");
        let mut length = 0;
        while self.heard.len() > length {
            length = self.heard.len();
            self.wait(20 * MS);
        }
        let text = self.text();
        assert!(text.ends_with("\r\n"), "'{line}' was answered by '{text}'");
        text
    }

    fn duties(&self) -> [f64; 2] {
        self.base.motors().map(|motor| motor.duty)
    }
}

/// `answer` fits `pattern`, where # stands for a decimal.
fn fits(answer: &str, pattern: &str) -> bool {
    let mut rest = answer;
    for (k, part) in pattern.split('#').enumerate() {
        if k > 0 {
            let number = rest.strip_prefix('-').unwrap_or(rest);
            let digits =
                number.len() - number.trim_start_matches(|c: char| c.is_ascii_digit()).len();
            if digits == 0 {
                return false;
            }
            rest = &number[digits..];
        }
        let Some(after) = rest.strip_prefix(part) else { return false };
        rest = after;
    }
    rest.is_empty()
}

/// Every command of K-Team's protocol, and what it answers.
const PROTOCOL: &[(&str, &str)] = &[
    ("A,3800,800,100", "a"),
    ("B", "b,5.02,5.01"),
    ("C,100,-100", "c"),
    ("D,10,-10", "d"),
    ("E", "e,#,#"),
    ("D,0,0", "d"),
    ("F,3000,20,4000", "f"),
    ("G,1000,-1000", "g"),
    ("H", "h,#,#"),
    ("I,8", "i,#"),
    ("J,20,64,20,64", "j"),
    ("K", "k,#,#,#,#,#,#"),
    ("L,0,1", "l"),
    ("N", "n,#,#,#,#,#,#,#,#"),
    ("O", "o,#,#,#,#,#,#,#,#"),
    ("P,0,0", "p"),
    ("R,3", "r,255"),
    ("T,26,B", "z,Turret does not answer"),
    ("W,1,3", "w"),
    ("D,1", "z,Protocol error"),
    ("D,1,2,3", "z,Protocol error"),
    ("D,999,0", "z,Protocol error"),
    ("D,\u{1}\u{7f}x,0", "z,Protocol error"),
    ("Y", "z,Command not found"),
];

fn check_protocol(baud: u32) {
    let mut desk = Desk::at(baud);
    desk.base.set_proximity([1, 2, 3, 4, 5, 6, 7, 1023]);
    desk.base.set_ambient([500, 400, 300, 200, 100, 50, 20, 10]);
    desk.wait(250 * MS);
    assert_eq!(desk.ask("N"), "n,1,2,3,4,5,6,7,1023\r\n");
    assert_eq!(desk.ask("O"), "o,500,400,300,200,100,50,20,10\r\n");
    for (line, pattern) in PROTOCOL {
        let answer = desk.ask(line);
        assert!(fits(&answer, &format!("{pattern}\r\n")), "'{line}' at {baud}: '{answer}'");
    }
    desk.clear();
    desk.send(b"\r\n\n\r");
    desk.wait(100 * MS);
    assert_eq!(desk.text(), "", "empty lines are silent");
    desk.send(b"D,10");
    desk.wait(500 * MS);
    assert_eq!(desk.text(), "", "half a line waits");
    assert_eq!(desk.ask(",10"), "d\r\n");
    assert_eq!(desk.ask(&"1".repeat(300)), "z,Protocol error\r\n");
    assert_eq!(desk.ask("B"), "b,5.02,5.01\r\n");
    assert_eq!(desk.base.diagnostics().len(), 0, "{:?}", desk.base.diagnostics());
}

#[test]
fn the_protocol_answers_in_time_at_9600_and_38400_baud() {
    check_protocol(9600);
    check_protocol(38400);
}

#[test]
fn speed_100_is_reached_within_2_percent_in_300_ms() {
    let mut desk = Desk::new();
    desk.base.serial_send(b"D,100,-100\n");
    while desk.duties() == [0.0; 2] {
        desk.wait(MS);
    }
    desk.wait(300 * MS);
    for speed in desk.base.wheel_speeds_mm_s() {
        assert!((speed.abs() / SPEED_100_MM_S - 1.0).abs() < 0.02, "{speed} mm/s");
    }
    desk.wait(200 * MS);
    let answer = desk.ask("E");
    let values: Vec<i32> =
        answer.trim_end().split(',').skip(1).map(|v| v.parse().expect("a decimal")).collect();
    assert!((values[0] - 100).abs() <= 2 && (values[1] + 100).abs() <= 2, "{answer}");
}

/// Where the wheels' travel leads, in steps of a millisecond: x, y in mm, heading in radians.
fn follow(pose: &mut [f64; 3], before: [f64; 2], after: [f64; 2]) {
    let [left, right] = [after[0] - before[0], after[1] - before[1]];
    let base = f64::from(board::BOARD_WHEEL_BASE_MM);
    let turn = (right - left) / base;
    let mean = pose[2] + turn / 2.0;
    pose[0] += (left + right) / 2.0 * mean.cos();
    pose[1] += (left + right) / 2.0 * mean.sin();
    pose[2] += turn;
}

/// Run for `time`, integrating the pose.
fn drive(desk: &mut Desk, pose: &mut [f64; 3], time: Ps) {
    let end = desk.base.now() + time;
    while desk.base.now() < end {
        let before = desk.base.wheel_travel_mm();
        desk.base.run_until(desk.base.now() + MS, &mut Unconnected);
        desk.listen();
        follow(pose, before, desk.base.wheel_travel_mm());
    }
}

/// Where a robot is that should be back where it began: distance in mm, turn in degrees.
fn closes(pose: [f64; 3]) -> (f64, f64) {
    (pose[0].hypot(pose[1]), (pose[2] - std::f64::consts::TAU).to_degrees())
}

/// A metre square by eight position commands. `drive` lets time pass.
fn metre_square(desk: &mut Desk, mut drive: impl FnMut(&mut Desk, Ps)) {
    let mut ask = |desk: &mut Desk, line: &str, wait: Ps| {
        drive(desk, wait);
        desk.clear();
        desk.base.serial_send(format!("{line}\n").as_bytes());
        for _ in 0..200 {
            drive(desk, MS);
            if desk.heard.ends_with(b"\r\n") {
                return desk.text();
            }
        }
        panic!("'{line}' was not answered");
    };
    let mut target = [0i32; 2];
    for leg in 0..8 {
        let way = if leg % 2 == 0 { [12000, 12000] } else { [-500, 500] };
        target = [target[0] + way[0], target[1] + way[1]];
        let line = format!("C,{},{}", target[0], target[1]);
        assert_eq!(ask(desk, &line, 0), "c\r\n");
        let mut polls = 0;
        loop {
            let status = ask(desk, "K", 50 * MS);
            let field = |n: usize| status.trim_end().split(',').nth(n).map(str::to_owned);
            if field(1).as_deref() == Some("1") && field(4).as_deref() == Some("1") {
                break;
            }
            polls += 1;
            assert!(polls < 200, "leg {leg} does not end: {status}");
        }
    }
}

#[test]
fn a_metre_square_by_position_commands_closes() {
    let mut desk = Desk::new();
    let mut pose = [0.0; 3];
    metre_square(&mut desk, |desk, time| drive(desk, &mut pose, time));
    let (distance, turn) = closes(pose);
    println!("closes within {distance:.1} mm and {turn:.2} degrees");
    assert!(distance < 10.0 && turn.abs() < 2.0, "{distance} mm, {turn} degrees");
}

/// The same on a floor, worst of some robots: distance in mm and turn in degrees.
fn worst_square(robots: impl Iterator<Item = OpenFloor>) -> (f64, f64) {
    robots.fold((0.0, 0.0), |(far, turned), mut floor| {
        let mut desk = Desk::new();
        desk.base.set_load(floor.wheel_loads_n());
        metre_square(&mut desk, |desk, time| {
            for _ in 0..time / MS {
                desk.base.run_until(desk.base.now() + MS, &mut Unconnected);
                floor.step(desk.base.wheel_speeds_mm_s());
                desk.listen();
            }
        });
        let pose = floor.pose();
        let (distance, turn) = closes([pose.x_mm, pose.y_mm, pose.heading_rad]);
        (f64::max(far, distance), f64::max(turned, turn.abs()))
    })
}

#[test]
fn a_metre_square_with_slip_closes_as_stated() {
    let slip = |noise| worst_square((1..=2).map(|seed| OpenFloor::with_equal_wheels(noise, seed)));
    let all = |noise| worst_square((1..=2).map(|seed| OpenFloor::new(noise, seed)));
    for (name, worst, limit) in [
        ("slip, measured", slip(Noise::Measured), (45.0, 3.0)),
        ("slip, harsh", slip(Noise::Harsh), (120.0, 8.0)),
        ("unequal wheels too, measured", all(Noise::Measured), (400.0, 60.0)),
    ] {
        println!("{name}: closes within {:.0} mm and {:.1} degrees", worst.0, worst.1);
        assert!(worst.0 < limit.0 && worst.1 < limit.1, "{name}: {worst:?}");
        assert!(worst.0 > 0.1, "{name}: nothing slips");
    }
}

#[test]
fn estop_acts_at_once_in_the_middle_of_a_flood() {
    let mut desk = Desk::at(38400);
    desk.ask("D,60,60");
    desk.wait(300 * MS);
    assert!(desk.duties()[0] > 0.0);
    // A flood of whole and broken lines before it, all still waiting to be obeyed.
    desk.send("help\nD,60,60\nget\nD,\u{7f}1".repeat(400).as_bytes());
    desk.send(b"est");
    desk.send(b"op");
    desk.wait(MS);
    assert_eq!(desk.duties(), [0.0; 2]);
    for _ in 0..300 {
        desk.wait(MS);
        assert_eq!(desk.duties(), [0.0; 2], "a command from before must not start them again");
    }
}

#[test]
fn a_paste_of_64_kib_at_full_rate_loses_nothing() {
    let mut desk = Desk::at(38400);
    let line = "G,1,2\n";
    let lines = 65536 / line.len();
    desk.clear();
    desk.send(line.repeat(lines).as_bytes());
    desk.wait(200 * MS);
    assert!(desk.text() == "g\r\n".repeat(lines), "{} bytes of answers", desk.heard.len());
    desk.clear();
    // Answers four times as long as the lines: they come later, but they come.
    desk.send("H\n".repeat(4096).as_bytes());
    desk.wait(9 * SECOND);
    assert!(desk.text() == "h,1,2\r\n".repeat(4096), "{} bytes of answers", desk.heard.len());
    assert!(desk.ask("status").contains("console: 0 characters lost"));
}

#[test]
fn a_thousand_random_lines_leave_a_robot_that_obeys() {
    let mut desk = Desk::at(115_200);
    let mut state = 1u32;
    let mut draw = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % below
    };
    for _ in 0..1000 {
        let mut line: Vec<u8> = match draw(3) {
            0 => (0..draw(60)).map(|_| draw(256) as u8).collect(),
            1 => vec![b'A' + draw(26) as u8],
            _ => format!("{},{},{}", char::from(b'A' + draw(26) as u8), draw(300), draw(300))
                .into_bytes(),
        };
        line.push(b'\n');
        desk.send(&line);
    }
    desk.wait(SECOND);
    desk.send(b"\nraw\n\n");
    desk.wait(200 * MS);
    assert_eq!(desk.ask("B"), "b,5.02,5.01\r\n");
    desk.send(b"estop\n");
    desk.wait(50 * MS);
    assert_eq!(desk.duties(), [0.0; 2]);
    assert_eq!(desk.base.resets().len(), 1, "{:?}", desk.base.resets());
}

/// Random numbers, the same each time.
struct Draw(u32);

impl Draw {
    fn below(&mut self, limit: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) % limit
    }
}

/// Send a line that something may happen to on its way; what is answered until the line is quiet.
fn try_to_ask(desk: &mut Desk, line: &str) -> String {
    desk.clear();
    desk.send(format!("{line}\n").as_bytes());
    desk.wait(40 * MS);
    desk.text()
}

/// Disturb the line now and then for the next `time`: at random, each `longest` bits long at most.
fn disturb(desk: &mut Desk, draw: &mut Draw, time: Ps, longest: f64) {
    let mut at = desk.base.now();
    let end = at + time;
    let bit = SECOND / u64::from(board::BOARD_BAUD);
    while at < end {
        at += u64::from(draw.below(400)) * bit / 8;
        let length = (longest * bit as f64 * f64::from(draw.below(1000)) / 1000.0) as Ps;
        desk.base.serial_disturb(at, length);
        at += length;
    }
}

#[test]
fn a_character_with_a_noisy_bit_never_makes_another_command() {
    let mut desk = Desk::new();
    let mut draw = Draw(1);
    let mut accepted = "h,0,0\r\n".to_owned();
    let (mut good, mut refused) = (0, 0);
    for n in 0..150 {
        // Shorter than the distance of two samples: seen, and never enough to turn a bit.
        disturb(&mut desk, &mut draw, 20 * MS, 1.0 / 16.5);
        match try_to_ask(&mut desk, &format!("G,{},{}", n * 1111, -n)).as_str() {
            "g\r\n" => {
                good += 1;
                accepted = format!("h,{},{}\r\n", n * 1111, -n);
            }
            "z,Protocol error\r\n" | "" => refused += 1,
            other => panic!("line {n}: '{other}'"),
        }
        // If the line's end was hit, it ends now.
        desk.send(b"\n");
        desk.wait(60 * MS);
        assert_eq!(desk.ask("H"), accepted, "line {n}");
    }
    assert!(good > 20 && refused > 20, "{good} good, {refused} refused");
    assert!(!desk.ask("status").contains("console: 0 characters lost"));
}

#[test]
fn a_robot_on_a_line_full_of_noise_lives_and_stops() {
    let mut desk = Desk::new();
    let mut draw = Draw(2);
    for n in 0..150 {
        disturb(&mut desk, &mut draw, 20 * MS, 3.0);
        try_to_ask(&mut desk, &format!("D,{n},{}", 150 - n));
    }
    desk.wait(100 * MS);
    desk.send(b"\r\n");
    assert!(desk.ask("estop").contains("ok: emergency stop"));
    assert_eq!(desk.duties(), [0.0; 2]);
    assert_eq!(desk.base.resets().len(), 1, "{:?}", desk.base.resets());
}

#[test]
fn a_wrong_rate_moves_nothing_and_the_right_one_is_heard_after_it() {
    let lines = "D,20,20\r\nP,100,100\r\nC,500,500\r\nstart 0\r\nrun soccer 0\r\nk D,9,9\r\n";
    for rate in [300, 1200, 2400, 4800, 14_400, 19_200, 38_400, 57_600, 115_200] {
        let mut desk = Desk::new();
        desk.base.serial_set_baud(Some(rate));
        desk.send(lines.as_bytes());
        desk.wait(200 * MS);
        assert_eq!(desk.duties(), [0.0; 2], "{rate}");
        desk.base.serial_set_baud(Some(board::BOARD_BAUD));
        desk.send(b"\r\n");
        desk.wait(50 * MS);
        assert_eq!(desk.ask("B"), "b,5.02,5.01\r\n", "{rate}");
        assert_eq!(desk.ask("H"), "h,0,0\r\n", "{rate}");
        assert_eq!(desk.base.resets().len(), 1, "{rate}");
    }
}

#[test]
fn a_break_spoils_the_line_that_it_cuts_and_no_other() {
    let mut desk = Desk::new();
    desk.clear();
    desk.base.serial_send(b"D,1");
    desk.base.serial_break(5 * MS);
    desk.send(b"2,12\n");
    desk.wait(50 * MS);
    assert_eq!(desk.text(), "z,Protocol error\r\n");
    assert_eq!(desk.duties(), [0.0; 2]);
    desk.base.serial_break(300 * MS);
    desk.wait(310 * MS);
    assert_eq!(desk.ask("B"), "b,5.02,5.01\r\n", "a cable that was pulled and is back");
}

/// Set a value, save it, and wait for the answer; false if the supply went meanwhile.
fn save(desk: &mut Desk, value: u32) -> bool {
    desk.ask(&format!("set speed.kp {value}"));
    desk.clear();
    desk.send(b"save\n");
    for _ in 0..500 {
        desk.wait(10 * MS);
        if desk.text().contains("ok: saved\r\n") {
            return true;
        }
    }
    false
}

fn saved_value(flash: &[u8]) -> String {
    let base = Base::from_flash(flash, Config::default()).expect("the flash's size");
    Desk::switch_on(base).ask("get speed.kp")
}

#[test]
fn a_save_survives_a_power_cut_at_any_flash_operation() {
    let mut desk = Desk::new();
    assert!(save(&mut desk, 100));
    let before = desk.base.flash().to_vec();
    let first = desk.base.flash_operations();
    assert!(save(&mut desk, 200));
    let operations = desk.base.flash_operations() - first;
    assert!(operations > 10, "{operations}");
    assert!(saved_value(desk.base.flash()).starts_with("speed.kp = 200 "));
    for cut in 0..operations {
        let base = Base::from_flash(&before, Config::default()).expect("the flash's size");
        let mut desk = Desk::switch_on(base);
        let start = desk.base.flash_operations();
        desk.ask("set speed.kp 200");
        desk.base.cut_power_at_flash_operation(Some(start + cut));
        desk.base.serial_send(b"save\n");
        desk.wait(100 * MS);
        let value = saved_value(desk.base.flash());
        let good = ["speed.kp = 100 ", "speed.kp = 200 "].iter().any(|v| value.starts_with(v));
        assert!(good, "cut at operation {cut}: {value}");
    }
}

/// Counters as K-Team's command H tells them.
fn counters(desk: &mut Desk) -> [i64; 2] {
    let text = desk.ask("H");
    let values: Vec<i64> =
        text.trim_end().split(',').skip(1).map(|n| n.parse().expect("a number")).collect();
    values.try_into().expect("two counters")
}

#[test]
fn no_count_is_lost_whatever_the_motors_are_told() {
    let mut desk = Desk::new();
    let mut state = 7u32;
    let mut draw = |from: i32, to: i32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        from + ((state >> 8) % (to - from + 1) as u32) as i32
    };
    for round in 0..60 {
        // Speeds, duties and what a player does at worst: full duty, reversed at once.
        let command = match round % 3 {
            0 => format!("D,{},{}\n", draw(-127, 127), draw(-127, 127)),
            1 => format!("P,{},{}\n", draw(-255, 255), draw(-255, 255)),
            _ => format!("P,{},{}\n", 255 * (2 * draw(0, 1) - 1), 255 * (2 * draw(0, 1) - 1)),
        };
        desk.send(command.as_bytes());
        desk.wait(draw(15, 400) as Ps * MS);
        if round % 5 == 4 {
            desk.send(b"P,0,0\n");
            desk.wait(800 * MS);
            assert_eq!(desk.base.wheel_speeds_mm_s(), [0.0; 2]);
            let true_counts = desk.base.wheel_travel_mm().map(|mm| (mm * 12.0).floor() as i64);
            let counted = counters(&mut desk);
            for wheel in 0..2 {
                let error = counted[wheel] - true_counts[wheel];
                assert!(error.abs() <= 1, "round {round}, wheel {wheel}: {error} counts");
            }
        }
    }
}

/// Busy part of two seconds at `units` of K-Team's speed.
fn load_at(desk: &mut Desk, units: u32) -> f64 {
    desk.ask(&format!("D,{units},{units}"));
    desk.wait(SECOND);
    let before = desk.base.load();
    desk.wait(2 * SECOND);
    desk.base.load().since(&before)
}

#[test]
fn motion_takes_a_tenth_of_the_cpu_at_twice_the_count_and_interrupts_are_served_in_time() {
    let mut desk = Desk::new();
    for units in [0, 5, 10, 20, 60, 100, 127] {
        let load = load_at(&mut desk, units);
        println!("load at {units} units: {:.2} %", 100.0 * load);
        assert!(2.0 * load < 0.10, "{units} units: {load}");
    }
    // All the ways of counting, and of changing between them.
    for units in [10, 30, -30, 120, -120, 0] {
        desk.ask(&format!("D,{units},{units}"));
        desk.wait(500 * MS);
    }
    let latency = desk.base.worst_interrupt_latency().map(|time| time / US);
    println!("worst interrupt latency by level, us: {latency:?}");
    assert!(latency[6] < 40, "an encoder edge of 1 m/s must be read within 41 us: {latency:?}");
    assert!(latency[5] < 100 && latency[3] < 260, "a tick, a character of 38400 baud: {latency:?}");
}
