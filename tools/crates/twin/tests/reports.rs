//! Vision reports that go wrong on their way to the base: damaged, lost, held up, repeated, out of
//! order, or telling of nothing. The 68331 runs the image that would be flashed; a turret made by hand
//! shows it what its eyes would see, and spoils the reports.
//!
//! What is asked of the firmware: it never drives for more than 200 ms on what it saw before, it turns
//! on the spot to search after a second, and it plays on as soon as reports are good again.

use std::collections::VecDeque;
use std::fs;
use std::path::Path;

use common_sys::constants as c;
use common_sys::link::{REPORT_SIZE, Report, report_encode};
use khepera::turret_bus::TurretBus;
use khepera::{Base, Config};
use sim::{MS, Ps, SECOND};

/// Frame period of the eyes, and the time from the middle of an exposure to the attention interrupt.
const FRAME: Ps = 25 * MS;
const LATENCY: Ps = 24 * MS;
/// So long the firmware may drive on old news; a control period comes on top.
const STALE: Ps = 200 * MS;
const PERIOD: Ps = 10 * MS + MS;
/// From here on it searches.
const SEARCH: Ps = SECOND;
/// Wheels of a search turn slowly, mm/s.
const SEARCH_MM_S: f64 = 60.0;
/// When the faults begin and how long they last: the robot is at full speed by then.
const FAULT: Ps = 900 * MS;
const FAULT_LASTS: Ps = 2500 * MS;
/// After good reports come back it has to find the ball in a turn, and to drive to it.
const RECOVERY: Ps = 4 * SECOND;

type Wire = [u8; REPORT_SIZE];

/// Hands out reports at their times, as the FPGA does.
#[derive(Default)]
struct Turret {
    coming: VecDeque<(Ps, Wire)>,
    ready: Option<Wire>,
    words: Option<(Option<Wire>, usize)>,
}

impl Turret {
    fn settle(&mut self, now: Ps) {
        while self.coming.front().is_some_and(|(due, _)| *due <= now) {
            self.ready = self.coming.pop_front().map(|(_, wire)| wire);
        }
    }
}

impl TurretBus for Turret {
    fn select(&mut self, now: Ps, pcs: u8) {
        self.settle(now);
        let selected = u32::from(pcs) == c::BOARD_PCS_TURRET;
        if selected != self.words.is_some() {
            self.words = selected.then_some((self.ready, 0));
        }
    }

    fn exchange(&mut self, now: Ps, _word: u16, bits: u8) -> u16 {
        self.settle(now);
        let ones = u16::MAX >> (16 - u32::from(bits.clamp(1, 16)));
        let Some((wire, word)) = &mut self.words else { return ones };
        let at = 2 * *word;
        *word += 1;
        let Some(wire) = wire.filter(|_| bits == 16 && at + 2 <= REPORT_SIZE) else { return ones };
        if at + 2 == REPORT_SIZE && self.ready == Some(wire) {
            self.ready = None;
        }
        u16::from_be_bytes([wire[at], wire[at + 1]])
    }

    fn irq_pins(&mut self, now: Ps) -> u8 {
        self.settle(now);
        !(u8::from(self.ready.is_some()) << c::BOARD_TURRET_ATTENTION_IRQ)
    }
}

/// Where the robot is, from its wheels: mm, radians.
#[derive(Clone, Copy)]
struct Place {
    x: f64,
    y: f64,
    heading: f64,
    rolled: [f64; 2],
}

impl Place {
    fn follow(&mut self, rolled: [f64; 2]) {
        let [left, right] = [0, 1].map(|wheel| rolled[wheel] - self.rolled[wheel]);
        self.heading += (right - left) / f64::from(c::BOARD_WHEEL_BASE_MM);
        self.x += (left + right) / 2.0 * libm::cos(self.heading);
        self.y += (left + right) / 2.0 * libm::sin(self.heading);
        self.rolled = rolled;
    }

    /// Column, row and disparity in 1/16 px of a point of the pitch, if both eyes see it.
    fn project(&self, x: f64, y: f64, height: f64) -> Option<[u16; 3]> {
        let (sin, cos) = libm::sincos(self.heading);
        let (dx, dy) = (x - self.x, y - self.y);
        let (forward, left) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let tilt =
            [c::CAMERA_TILT_SIN_Q12, c::CAMERA_TILT_COS_Q12].map(|q12| f64::from(q12) / 4096.0);
        let drop = f64::from(c::CAMERA_LENS_HEIGHT_MM) - height;
        let focal = f64::from(c::CAMERA_FOCAL_PX);
        let depth = forward * tilt[1] + drop * tilt[0];
        if depth < 210.0 {
            return None;
        }
        let column = f64::from(c::CAMERA_CX_Q4) / 16.0
            - focal * (left + f64::from(c::CAMERA_RIGHT_LENS_MM_Q4) / 16.0) / depth;
        let row = f64::from(c::CAMERA_CY_Q4) / 16.0
            + focal * (drop * tilt[1] - forward * tilt[0]) / depth;
        let disparity = focal * f64::from(c::CAMERA_BASELINE_UM) / 1000.0 / depth;
        let inside = column > 20.0 && column + disparity < 299.0;
        inside.then(|| [column * 16.0, row, disparity * 16.0].map(|value| (value + 0.5) as u16))
    }
}

/// What the eyes see: the ball at (300, 60), the goal that is attacked, the foot of a wall.
fn look(place: &Place, sequence: u8, now: Ps) -> Report {
    let mut report = Report {
        function: c::FPGA_FUNCTION_SOCCER as u8,
        sequence,
        exposure_time: (now / (MS / 10)) as u16,
        flags: c::REPORT_WALL as u16,
        wall_row: [40; 3],
        delay: ((LATENCY - Ps::from(c::CAMERA_EXPOSURE_TO_END_US) * (MS / 1000)) / (MS / 10)) as u8,
        ..Report::default()
    };
    if let Some([x, row, disparity]) = place.project(300.0, 60.0, 33.5) {
        report.flags |= c::REPORT_BALL as u16;
        (report.ball_x_q4, report.ball_row, report.ball_disparity_q4) = (x, row as u8, disparity);
        report.ball_width_px = 40;
        report.ball_confidence = 200;
    }
    for (edge, flag) in
        [c::REPORT_GOAL_LEFT_EDGE, c::REPORT_GOAL_RIGHT_EDGE].into_iter().enumerate()
    {
        let y = if edge == 0 { 150.0 } else { -150.0 };
        if let Some([x, _, disparity]) = place.project(525.0, y, 95.0) {
            report.flags |= flag as u16;
            report.goal_x_q4[edge] = x;
            report.goal_disparity_q4[edge] = disparity;
        }
    }
    report
}

/// What happens to report number `n` while the fault lasts: what arrives instead, and how much later.
/// `news` tells whether the firmware may take it for news.
struct Arrival {
    wire: Wire,
    later: Ps,
    news: bool,
}

fn arrives(report: &Report, news: bool) -> Vec<Arrival> {
    vec![Arrival { wire: report_encode(report), later: 0, news }]
}

/// What was seen of a run.
struct Run {
    /// Each millisecond since the start of play: time, time of the last news, duty and speed of wheels.
    trace: Vec<(Ps, Ps, [f64; 2], [f64; 2])>,
    said: String,
}

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

/// Play for `length`, with `fault` acting on the reports that are exposed from [`FAULT`] on, for
/// [`FAULT_LASTS`].
fn run(length: Ps, mut fault: impl FnMut(usize, &Report) -> Vec<Arrival>) -> Run {
    let mut base = Base::new(&image(), Config::default()).expect("a good image");
    let mut turret = Turret::default();
    let mut place = Place { x: -380.0, y: 0.0, heading: 0.0, rolled: [0.0; 2] };
    base.run_until(SECOND, &mut turret);
    base.serial_send(b"start 0\r\n");
    base.run_until(SECOND + 20 * MS, &mut turret);
    let start = base.now().next_multiple_of(MS);
    let (mut sequence, mut faulty, mut last_news) = (0_u8, 0, start);
    let mut news: VecDeque<Ps> = VecDeque::new();
    let mut run = Run { trace: Vec::new(), said: String::new() };
    for ms in 0..length / MS {
        let now = start + ms * MS;
        if now.is_multiple_of(FRAME) {
            let report = look(&place, sequence, now);
            sequence = sequence.wrapping_add(1);
            let time = now - start;
            let arrivals = if (FAULT..FAULT + FAULT_LASTS).contains(&time) {
                faulty += 1;
                fault(faulty - 1, &report)
            } else {
                arrives(&report, true)
            };
            for Arrival { wire, later, news: is_news } in arrivals {
                turret.coming.push_back((now + LATENCY + later, wire));
                if is_news {
                    news.push_back(now + LATENCY + later);
                }
            }
            turret.coming.make_contiguous().sort_by_key(|(due, _)| *due);
        }
        base.run_until(now + MS, &mut turret);
        place.follow(base.wheel_travel_mm());
        while news.front().is_some_and(|due| *due <= now) {
            last_news = news.pop_front().unwrap_or(last_news);
        }
        let duty = base.motors().map(|motor| motor.duty);
        run.trace.push((now - start, last_news - start, duty, base.wheel_speeds_mm_s()));
    }
    base.serial_take();
    base.serial_send(b"status\r\n");
    base.run_until(base.now() + SECOND, &mut turret);
    run.said = base.serial_take().into_iter().map(|(_, byte)| char::from(byte)).collect();
    run
}

impl Run {
    /// The promise: on old news no motor runs, and after a second wheels only turn it on the spot.
    fn never_drives_on_old_news(&self) {
        for (time, news, duty, speed) in &self.trace {
            let age = time - news.min(time);
            if age > STALE + PERIOD && age + PERIOD < SEARCH {
                assert_eq!(*duty, [0.0; 2], "{} ms: news is {} ms old", time / MS, age / MS);
            }
            if age > SEARCH + 300 * MS {
                let forward = (speed[0] + speed[1]) / 2.0;
                assert!(
                    forward.abs() < 20.0 && speed[0].abs() < SEARCH_MM_S,
                    "{} ms: {speed:?} mm/s with news {} ms old",
                    time / MS,
                    age / MS
                );
            }
        }
    }

    /// Longest time without a running motor between `from` and `to`.
    fn longest_stop(&self, [from, to]: [Ps; 2]) -> Ps {
        let (mut longest, mut since) = (0, from);
        for (time, _, duty, _) in self.trace.iter().filter(|(time, ..)| (from..to).contains(time)) {
            if *duty != [0.0; 2] {
                since = *time;
            }
            longest = longest.max(time - since);
        }
        longest
    }

    fn drove_before_the_fault(&self) {
        let (_, _, _, speed) = self.trace[(FAULT / MS) as usize];
        assert!((speed[0] + speed[1]) / 2.0 > 150.0, "{speed:?} mm/s when the fault begins");
    }

    fn stopped_in_the_fault(&self) {
        assert!(self.longest_stop([FAULT, FAULT + FAULT_LASTS]) > 700 * MS, "it went on");
    }

    /// Motors run at once when reports are good again, and it drives when it has found the ball.
    fn recovers(&self) {
        let good = FAULT + FAULT_LASTS + FRAME + LATENCY;
        assert!(self.longest_stop([good + PERIOD, good + SECOND]) < 50 * MS, "it stands");
        let driving = self
            .trace
            .iter()
            .find(|(time, _, _, speed)| *time > good && (speed[0] + speed[1]).abs() / 2.0 > 100.0);
        let after = driving.map(|(time, ..)| time - good);
        assert!(after.is_some_and(|after| after < RECOVERY), "drives again after {after:?} ps");
    }
}

const LENGTH: Ps = FAULT + FAULT_LASTS + LATENCY + RECOVERY;

#[test]
fn with_good_reports_it_plays() {
    let run = run(1500 * MS, |_, report| arrives(report, true));
    run.drove_before_the_fault();
    assert!(run.longest_stop([300 * MS, 1500 * MS]) < 50 * MS, "it stops without a reason");
    let (_, _, _, speed) = run.trace[1400];
    assert!(speed[0] + speed[1] > 200.0, "{speed:?} mm/s");
}

#[test]
fn a_report_damaged_in_any_bit_is_no_news() {
    // Each bit of a report once; what gets through would say that the ball is elsewhere.
    for part in 0..3 {
        let bits = 8 * REPORT_SIZE;
        let run = run(LENGTH, |n, report| {
            let mut wire = report_encode(report);
            let bit = (part * 86 + n % 86) % bits;
            wire[bit / 8] ^= 0x80 >> (bit % 8);
            vec![Arrival { wire, later: 0, news: false }]
        });
        run.drove_before_the_fault();
        run.never_drives_on_old_news();
        run.stopped_in_the_fault();
        run.recovers();
        assert!(run.said.contains(" 100 damaged"), "{}", run.said);
    }
}

#[test]
fn reports_that_are_lost_stop_it_and_single_ones_do_not() {
    let lost = run(LENGTH, |_, _| vec![]);
    lost.drove_before_the_fault();
    lost.never_drives_on_old_news();
    lost.stopped_in_the_fault();
    lost.recovers();
    // Three of four lost: news every 100 ms.
    let some = run(2 * SECOND, |n, report| if n % 4 == 3 { arrives(report, true) } else { vec![] });
    assert!(some.longest_stop([FAULT, 2 * SECOND]) < 60 * MS, "it stops without a reason");
}

#[test]
fn reports_that_are_held_up_are_no_news() {
    let run = run(LENGTH, |_, report| {
        vec![Arrival { wire: report_encode(report), later: 400 * MS, news: false }]
    });
    run.drove_before_the_fault();
    run.never_drives_on_old_news();
    run.stopped_in_the_fault();
    run.recovers();
}

#[test]
fn a_report_that_is_repeated_is_news_once() {
    let mut first = None;
    let run = run(LENGTH, |n, report| {
        let wire = *first.get_or_insert_with(|| report_encode(report));
        vec![Arrival { wire, later: 0, news: n == 0 }]
    });
    run.drove_before_the_fault();
    run.never_drives_on_old_news();
    run.stopped_in_the_fault();
    run.recovers();
}

#[test]
fn reports_out_of_order_are_news_only_forwards() {
    // Old ones again, the newest first.
    let mut past: Vec<Wire> = Vec::new();
    let backwards = run(LENGTH, |n, report| {
        if n < 10 {
            past.push(report_encode(report));
            return arrives(report, true);
        }
        let wire = past[(20 - n % 10 - 1) % 10];
        vec![Arrival { wire, later: 0, news: false }]
    });
    backwards.drove_before_the_fault();
    backwards.never_drives_on_old_news();
    backwards.stopped_in_the_fault();
    // In pairs that have changed places, every other one is news.
    let pairs = run(2 * SECOND, |n, report| {
        let later = if n % 2 == 0 { FRAME + 5 * MS } else { 0 };
        vec![Arrival { wire: report_encode(report), later, news: n % 2 == 1 }]
    });
    assert!(pairs.longest_stop([FAULT, 2 * SECOND]) < 60 * MS, "it stops without a reason");
}

#[test]
fn dark_eyes_are_no_news() {
    let run = run(LENGTH, |_, report| {
        let dark = Report {
            function: report.function,
            sequence: report.sequence,
            exposure_time: report.exposure_time,
            delay: report.delay,
            ..Report::default()
        };
        arrives(&dark, false)
    });
    run.drove_before_the_fault();
    run.never_drives_on_old_news();
    run.stopped_in_the_fault();
    run.recovers();
}
