//! Who plays: a robot with its firmware, or a program that drives wheels.
//!
//! Both sides of a match are [`Player`]s; the match asks nothing else of them. So any pair of firmware
//! images can play on either side.

use common_sys::constants as c;
use common_sys::link::{Report, report_decode};
use fx2::host::Link;
use sim::{MS, Ps, TraceHash};
use virtex::fpga::Delivery;
use world::World;
use world::opponents::Opponent;

use crate::belief::{Belief, Reader};
use crate::cameras::Cameras;
use crate::robot::{Error, Images, Robot};
use crate::tally::Tally;

/// The infrared sensors are looked at so often (K-Team: every 20 ms).
const INFRARED_TICKS: u64 = 20;
/// Exposures and writes to the motors are remembered for so long, to find out what led to what.
const MEMORY: Ps = 200 * MS;
/// What the base's program says when it listens, and when it has begun to play.
const READY: &str = "ready;";
const STARTED: &str = "ok: playing";
/// A handler waits so long for the former, and for the latter before typing again.
const READY_BUDGET: Ps = 1000 * MS;
const ANSWER_TICKS: u64 = 500;
/// Latencies are measured from so long after a start on: the console's line has arrived.
const SETTLED_TICKS: u64 = 100;

/// One side of a match. `side` is its robot in the world.
pub trait Player {
    /// Time up to which it has been run.
    fn now(&self) -> Option<Ps> {
        None
    }

    /// When it has to look at the world next.
    fn next_event(&self) -> Ps {
        Ps::MAX
    }

    /// Run until then; nothing in the world changes meanwhile.
    fn run_until(&mut self, _t: Ps) {}

    /// The time is `now`: look at the world if that is due.
    fn look(&mut self, _now: Ps, _world: &mut World, _side: usize) {}

    /// A handler starts it: the robot has been put to its place and looks there, degrees; 0 = towards
    /// the goal that it attacks, positive = turned left.
    fn start(&mut self, heading_deg: f64);

    /// A handler stops it.
    fn stop(&mut self);

    /// A millisecond has passed: the speeds of its wheels' rims.
    fn tick(&mut self, world: &mut World, side: usize) -> [f64; 2];

    /// Take in what it did since the last call.
    fn trace(&mut self, hash: &mut TraceHash);
}

impl Player for Opponent {
    fn start(&mut self, _heading_deg: f64) {
        self.kick_off();
    }

    fn stop(&mut self) {
        self.halt();
    }

    fn tick(&mut self, world: &mut World, side: usize) -> [f64; 2] {
        world.drive_opponent(self, side)
    }

    // What it does shows in its wheels, which the match traces.
    fn trace(&mut self, _hash: &mut TraceHash) {}
}

/// How the FPGA's configuration went, as the robot's own firmware tells it over USB.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fpga {
    /// DONE is high.
    pub configured: bool,
    /// What the design does.
    pub function: Option<&'static str>,
    /// The slot it came from.
    pub slot: Option<u8>,
    /// Bytes that went into the FPGA.
    pub bytes: u32,
    /// From the 8051's start to the result.
    pub time_us: Option<u32>,
    /// Why it is not configured.
    pub why: Option<String>,
}

/// What is counted while it is played.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Frame pairs that the FPGA took.
    pub frames: u32,
    /// Reports that the base read from the FPGA, whole.
    pub reports: u32,
    /// Reports with a ball.
    pub saw_ball: u32,
    /// Reports with a goal's edge.
    pub saw_goal: u32,
    /// Reports with an opponent.
    pub saw_opponent: u32,
}

/// A robot with its firmware, its eyes, and a handler at its console.
pub struct FirmwarePlayer {
    robot: Robot,
    cameras: Cameras,
    fpga: Fpga,
    counts: Counts,
    /// The report that tells most, for the picture.
    telling: Option<Report>,
    ticks: u64,
    /// Ticks since it was started; None while it is stopped.
    playing: Option<u64>,
    /// The base has said that it listens.
    ready: bool,
    /// The line that starts it and when it is typed again, until the base answers.
    unanswered: Option<(String, u64)>,
    belief: Option<Reader>,
    tally: Tally,
    /// Middles of exposures, with the times that their reports bear.
    exposures: Vec<(u16, Ps)>,
    /// Reports that have been read and have not reached the motors, with the middles of exposure.
    on_the_way: Vec<(Ps, Delivery)>,
    pwm_writes: Vec<Ps>,
    load_at_start: Option<khepera::Load>,
    /// Bytes for the trace.
    said: Vec<u8>,
    line: String,
    lines: Vec<String>,
}

impl FirmwarePlayer {
    /// Build a robot and switch it on; the host at its USB socket asks how the FPGA is. Its battery
    /// has so much of the nominal voltage.
    ///
    /// # Errors
    /// If an image is unusable. An FPGA that does not come up is no error.
    pub fn new(images: &Images, battery: f64) -> Result<Self, Error> {
        let mut robot = Robot::new(images)?;
        let nominal = khepera::Config::default().battery_mv;
        robot.base.set_battery_mv((f64::from(nominal) * battery) as u32);
        let fpga = fpga_of(&mut robot);
        let cameras = Cameras::new(robot.now());
        let said = format!("{fpga:?}").into_bytes();
        Ok(Self {
            robot,
            cameras,
            fpga,
            counts: Counts::default(),
            telling: None,
            ticks: 0,
            playing: None,
            ready: false,
            unanswered: None,
            belief: Reader::new(&images.khepera),
            tally: Tally::default(),
            exposures: Vec::new(),
            on_the_way: Vec::new(),
            pwm_writes: Vec::new(),
            load_at_start: None,
            said,
            line: String::new(),
            lines: Vec::new(),
        })
    }

    /// Run until the base says that it listens. One that does not is started all the same.
    pub fn wait_until_ready(&mut self) {
        let end = self.robot.now() + READY_BUDGET;
        while self.robot.now() < end && !self.ready {
            self.robot.run_until(self.robot.now() + MS);
            self.collect_serial();
        }
    }

    /// The cameras expose for the first time at `start`.
    pub fn open_eyes(&mut self, start: Ps) {
        self.cameras = Cameras::new(start);
    }

    /// The robot.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// The robot, to break something.
    pub fn robot_mut(&mut self) -> &mut Robot {
        &mut self.robot
    }

    /// How its FPGA is.
    pub fn fpga(&self) -> &Fpga {
        &self.fpga
    }

    /// What has been counted.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// What has been measured.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// What it believes now; None if its image does not tell.
    pub fn belief(&self) -> Option<Belief> {
        self.belief?.read(&self.robot.base)
    }

    /// The report that tells most so far.
    pub fn telling(&self) -> Option<&Report> {
        self.telling.as_ref()
    }

    /// Busy part of the 68331's time since the first start, 0..=1.
    pub fn cpu_load(&self) -> f64 {
        self.load_at_start.map_or(0.0, |start| self.robot.base.load().since(&start))
    }

    /// What it said on its console since the last call, line by line.
    pub fn take_lines(&mut self) -> Vec<String> {
        std::mem::take(&mut self.lines)
    }

    fn type_line(&mut self, line: &str) {
        self.robot.base.serial_send(line.as_bytes());
        self.robot.base.serial_send(b"\r\n");
    }

    /// Type the line that starts it again if the base does not answer: characters may be lost.
    fn insist(&mut self) {
        if let Some((line, _)) = self.unanswered.take_if(|(_, again)| self.ticks >= *again) {
            self.start_by(line);
        }
    }

    fn start_by(&mut self, line: String) {
        self.type_line(&line);
        self.unanswered = Some((line, self.ticks + ANSWER_TICKS));
    }

    fn collect_serial(&mut self) {
        for (time, byte) in self.robot.base.serial_take() {
            self.said.extend(time.to_be_bytes());
            self.said.push(byte);
            match byte {
                b'\n' => {
                    let line = std::mem::take(&mut self.line);
                    self.ready |= line.contains(READY);
                    if line.starts_with(STARTED) {
                        self.unanswered = None;
                    }
                    self.lines.push(line);
                }
                b'\r' => {}
                _ => self.line.push(char::from(byte)),
            }
        }
    }

    fn count(&mut self, report: Report, world: &mut World, side: usize) {
        if let Some(sights) = world.sights_then(side, report.exposure_time)
            && self.playing.is_some()
        {
            self.tally.report(&report, &sights);
        }
        let has = |flags: u32| u32::from(u32::from(report.flags) & flags != 0);
        self.counts.reports += 1;
        self.counts.saw_ball += has(c::REPORT_BALL);
        self.counts.saw_goal += has(c::REPORT_GOAL_LEFT_EDGE | c::REPORT_GOAL_RIGHT_EDGE);
        self.counts.saw_opponent += has(c::REPORT_OPPONENT);
        // For the picture: the last report among those that tell most.
        if self.telling.as_ref().is_none_or(|best| tells(&report) >= tells(best)) {
            world.keep(side, &report);
            self.telling = Some(report);
        }
    }
}

impl FirmwarePlayer {
    /// A report has been read: find out when it reaches the motors.
    fn delivered(&mut self, report: &Report, delivery: Delivery) {
        let exposed = self.exposures.iter().find(|(time, _)| *time == report.exposure_time);
        let settled = self.playing.is_some_and(|ticks| ticks > SETTLED_TICKS);
        if let (Some((_, middle)), true) = (exposed, settled) {
            self.on_the_way.push((*middle, delivery));
        }
    }

    /// Which reports have reached the motors? The first write after a report has been read is its
    /// own: the firmware decides at once, and the control period's writes are few.
    fn follow_reports(&mut self, now: Ps) {
        let written = self.robot.base.take_pwm_writes();
        self.pwm_writes.extend(written);
        let Self { on_the_way, pwm_writes, tally, .. } = self;
        on_the_way.retain(|(middle, delivery)| {
            let Some(pwm) = pwm_writes.iter().find(|pwm| **pwm >= delivery.read) else {
                return delivery.read + MEMORY > now;
            };
            tally.latency(*middle, delivery.ready, *pwm);
            false
        });
        pwm_writes.retain(|pwm| pwm + MEMORY > now);
        self.exposures.retain(|(_, middle)| middle + MEMORY > now);
    }

    /// Compare what it believes and does with what is true.
    fn examine(&mut self, world: &World, side: usize) {
        let duty = self.robot.base.motors().map(|motor| motor.duty).into_iter().fold(0.0, f64::max);
        self.tally.move_on(duty, world.physics().robot_motion(side));
        if let Some(belief) = self.belief() {
            self.tally.believe(&belief, &world.sights(side));
        }
    }
}

/// How many objects a report tells of. Of a ball too near only a part is in the picture.
fn tells(report: &Report) -> usize {
    let kinds =
        [c::REPORT_BALL, c::REPORT_GOAL_LEFT_EDGE, c::REPORT_GOAL_RIGHT_EDGE, c::REPORT_OPPONENT];
    let clipped = u32::from(report.flags) & c::REPORT_BALL_CLIPPED != 0;
    let seen = kinds.iter().filter(|&&kind| u32::from(report.flags) & kind != 0).count();
    seen - usize::from(clipped && seen > 0)
}

impl Player for FirmwarePlayer {
    fn now(&self) -> Option<Ps> {
        Some(self.robot.now())
    }

    fn next_event(&self) -> Ps {
        self.cameras.next_event()
    }

    fn run_until(&mut self, t: Ps) {
        self.robot.run_until(t);
    }

    fn look(&mut self, now: Ps, world: &mut World, side: usize) {
        let exposures = &mut self.exposures;
        let taken = self.cameras.step(now, &mut self.robot, |exposure, left, right| {
            exposures.push((exposure.time, now));
            world.expose(side, exposure, left, right);
        });
        if !taken {
            return;
        }
        self.counts.frames += 1;
        let deliveries = self.robot.turret.fpga.deliveries().to_vec();
        for (wire, delivery) in self.robot.turret.take_reports().into_iter().zip(deliveries) {
            self.said.extend(wire);
            if let Some(report) = report_decode(&wire) {
                self.delivered(&report, delivery);
                self.count(report, world, side);
            }
        }
        self.follow_reports(now);
    }

    fn start(&mut self, heading_deg: f64) {
        if self.load_at_start.is_none() {
            self.load_at_start = Some(self.robot.base.load());
        }
        self.playing = Some(0);
        self.start_by(format!("start {}", heading_deg.round() as i32));
    }

    fn stop(&mut self) {
        self.playing = None;
        self.unanswered = None;
        self.tally.rest();
        self.on_the_way.clear();
        self.type_line("stop");
    }

    fn tick(&mut self, world: &mut World, side: usize) -> [f64; 2] {
        let base = &mut self.robot.base;
        let wheels = base.wheel_speeds_mm_s();
        base.set_load(world.physics().wheel_loads_n(side, wheels));
        if self.ticks.is_multiple_of(INFRARED_TICKS) {
            base.set_proximity(world.infrared(side));
        }
        self.ticks += 1;
        if let Some(ticks) = self.playing {
            self.playing = Some(ticks + 1);
            self.examine(world, side);
        }
        self.collect_serial();
        self.insist();
        wheels
    }

    fn trace(&mut self, hash: &mut TraceHash) {
        hash.update(&self.said);
        self.said.clear();
    }
}

/// How the FPGA is, in the words of a summary.
fn fpga_of(robot: &mut Robot) -> Fpga {
    let status = match robot.ask_turret() {
        Ok(status) => status,
        Err(silent) => return Fpga { why: Some(silent.to_string()), ..Fpga::default() },
    };
    let why = match u32::from(status.result) {
        c::CONFIG_OK => None,
        c::CONFIG_NO_FLASH => Some("the flash does not answer its CFI query"),
        c::CONFIG_NO_DEFAULT => Some("the flash has no default slot"),
        c::CONFIG_BAD_SLOT => Some("the default slot holds no whole bitstream"),
        c::CONFIG_NO_INIT => Some("INIT# did not rise after PROG#"),
        c::CONFIG_CRC_ERROR => Some("CRC error: the bitstream is damaged (INIT# fell)"),
        c::CONFIG_NO_DONE => Some("DONE stayed low after the last byte: not a whole bitstream"),
        c::CONFIG_BUS_STUCK => Some("the transfer from flash to FPGA did not end in its time"),
        _ => Some("the firmware gave a result that this version does not know"),
    };
    let now = robot.now();
    let function = robot.turret.fpga.function(now).map(|function| function.name());
    Fpga {
        configured: why.is_none(),
        function: if why.is_none() { function } else { None },
        slot: (u32::from(status.slot) != c::CONFIG_NO_SLOT).then_some(status.slot),
        bytes: status.bytes,
        time_us: Some(status.time_us),
        why: why.map(str::to_owned),
    }
}
