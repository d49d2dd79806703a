//! A match: one robot, the world it plays in, and the referee who starts it.
//!
//! The loop runs from event to event: physics every millisecond, an exposure, the end of a frame's
//! read-out. Between two events both CPUs run, in slices, each no further ahead of the other than
//! [`crate::robot::Robot`] allows.

use common_sys::constants as c;
use common_sys::link::{Report, report_decode};
use fx2::host::Link;
use image::RgbImage;
use sim::{MS, Ps, TraceHash};
use world::{Setup as WorldSetup, World};

pub use world::{BallColour, Eyes, Noise};

use crate::cameras::Cameras;
use crate::robot::{Error, Images, Robot};

/// Physics advances so far at a time.
const TICK: Ps = world::TICK;
/// From switching the robot on to the starting signal: the FPGA is up by then.
const KICK_OFF: Ps = 250 * MS;
/// Which of the world's robots is ours.
const OURS: usize = 0;

/// What a match is made of.
#[derive(Clone)]
pub struct Setup {
    /// Draws where everything stands.
    pub seed: u64,
    /// Firmware and flash.
    pub images: Images,
    /// What the cameras deliver.
    pub eyes: Eyes,
    /// Colour of the ball.
    pub ball: BallColour,
    /// How bad the cameras are.
    pub noise: Noise,
    /// When the match is over, goal or not.
    pub end: Ps,
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

/// What a match came to.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Balls in the opponent's goal.
    pub goals_for: u32,
    /// Balls in ours.
    pub goals_against: u32,
    /// Simulated time from power-on to the end.
    pub time: Ps,
    /// Two runs with the same hash did the same.
    pub trace_hash: u64,
    /// Frame pairs that the FPGA took.
    pub frames: u32,
    /// Reports that the base read from the FPGA, whole.
    pub reports: u32,
    /// Reports with a ball, a goal's edge, an opponent.
    pub saw_ball: u32,
    /// See [`Summary::saw_ball`].
    pub saw_goal: u32,
    /// See [`Summary::saw_ball`].
    pub saw_opponent: u32,
    /// Busy part of the 68331's time since the starting signal, 0..=1.
    pub cpu_load: f64,
    /// The FPGA.
    pub fpga: Fpga,
}

/// What is counted while it is played.
#[derive(Clone, Copy, Default)]
struct Counts {
    frames: u32,
    reports: u32,
    saw_ball: u32,
    saw_goal: u32,
    saw_opponent: u32,
}

/// A match, from switching the robot on to its end.
pub struct Game {
    robot: Robot,
    world: World,
    cameras: Cameras,
    next_tick: Ps,
    kicked_off: bool,
    load_at_kick_off: khepera::Load,
    end: Ps,
    fpga: Fpga,
    counts: Counts,
    telling: Option<Report>,
    hash: TraceHash,
    line: String,
    lines: Vec<String>,
}

impl Game {
    /// Build the robot, switch it on, and let the host at its USB socket ask how the FPGA is.
    ///
    /// # Errors
    /// If an image is unusable. An FPGA that does not come up is no error: the match is played.
    pub fn new(setup: Setup) -> Result<Self, Error> {
        let mut robot = Robot::new(&setup.images)?;
        let fpga = fpga_of(&mut robot);
        let start = robot.now().max(KICK_OFF).next_multiple_of(TICK);
        let world = World::new(&WorldSetup {
            seed: setup.seed,
            eyes: setup.eyes,
            ball: setup.ball,
            noise: setup.noise,
        });
        let cameras = Cameras::new(start);
        let mut hash = TraceHash::default();
        hash.update(format!("{fpga:?}").as_bytes());
        Ok(Self {
            robot,
            world,
            cameras,
            next_tick: start,
            kicked_off: false,
            load_at_kick_off: khepera::Load::default(),
            end: setup.end.max(start),
            fpga,
            counts: Counts::default(),
            telling: None,
            hash,
            line: String::new(),
            lines: Vec::new(),
        })
    }

    /// Time reached.
    pub fn now(&self) -> Ps {
        self.robot.now()
    }

    /// When the match is over at the latest.
    pub fn end(&self) -> Ps {
        self.end
    }

    /// Whether a goal was scored or the time is up.
    pub fn over(&self) -> bool {
        self.world.goals() != [0, 0] || self.now() >= self.end
    }

    /// Play on for `duration`, or until it is over.
    pub fn run_for(&mut self, duration: Ps) {
        let until = (self.now() + duration).min(self.end);
        while self.now() < until && !self.over() {
            self.step(until);
        }
    }

    /// On to the next event, no further than `until`.
    fn step(&mut self, until: Ps) {
        let next = self.next_tick.min(self.cameras.next_event()).min(until);
        self.robot.run_until(next);
        if !self.kicked_off && next >= self.next_tick {
            self.kick_off();
        }
        if next == self.next_tick {
            self.tick();
        }
        let world = &mut self.world;
        let taken = self.cameras.step(next, &mut self.robot, |time, left, right| {
            world.render(OURS, time, left, right);
        });
        if taken {
            self.collect_reports();
        }
    }

    /// The handler types the heading on the console; from now on the robot is on its own.
    fn kick_off(&mut self) {
        self.kicked_off = true;
        self.load_at_kick_off = self.robot.base.load();
        let heading = self.world.kick_off_heading_deg(OURS).round() as i32;
        self.robot.base.serial_send(format!("start {heading}\r\n").as_bytes());
    }

    fn tick(&mut self) {
        let ours = self.robot.base.wheel_speeds_mm_s();
        self.world.step([ours, [0.0; 2]]);
        self.next_tick += TICK;
        self.collect_serial();
        for value in ours {
            self.hash.update(&value.to_bits().to_be_bytes());
        }
    }

    fn collect_reports(&mut self) {
        self.counts.frames += 1;
        for wire in self.robot.turret.take_reports() {
            self.hash.update(&wire);
            if let Some(report) = report_decode(&wire) {
                self.count(report);
            }
        }
    }

    fn count(&mut self, report: Report) {
        let has = |flags: u32| u32::from(u32::from(report.flags) & flags != 0);
        self.counts.reports += 1;
        self.counts.saw_ball += has(c::REPORT_BALL);
        self.counts.saw_goal += has(c::REPORT_GOAL_LEFT_EDGE | c::REPORT_GOAL_RIGHT_EDGE);
        self.counts.saw_opponent += has(c::REPORT_OPPONENT);
        // For the picture: the last report among those that tell most.
        let objects = |report: &Report| {
            let kinds = [
                c::REPORT_BALL,
                c::REPORT_GOAL_LEFT_EDGE,
                c::REPORT_GOAL_RIGHT_EDGE,
                c::REPORT_OPPONENT,
            ];
            let clipped = u32::from(report.flags) & c::REPORT_BALL_CLIPPED != 0;
            let seen = kinds.iter().filter(|&&kind| u32::from(report.flags) & kind != 0).count();
            // Of a ball too near only a part is in the picture.
            seen - usize::from(clipped)
        };
        if self.telling.as_ref().is_none_or(|best| objects(&report) >= objects(best)) {
            self.world.keep(OURS, &report);
            self.telling = Some(report);
        }
    }

    fn collect_serial(&mut self) {
        for (time, byte) in self.robot.base.serial_take() {
            self.hash.update(&time.to_be_bytes());
            self.hash.update(&[byte]);
            match byte {
                b'\n' => self.lines.push(std::mem::take(&mut self.line)),
                b'\r' => {}
                _ => self.line.push(char::from(byte)),
            }
        }
    }

    /// What the robot said on its console since the last call, line by line.
    pub fn take_serial_lines(&mut self) -> Vec<String> {
        std::mem::take(&mut self.lines)
    }

    /// The score in one phrase.
    pub fn headline(&self) -> String {
        match self.world.goals() {
            [0, 0] => "no goal yet".to_owned(),
            [ours, theirs] => format!("{ours} : {theirs}"),
        }
    }

    /// The robot that plays.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// What it came to.
    pub fn summary(&self) -> Summary {
        let [goals_for, goals_against] = self.world.goals();
        let mut hash = self.hash;
        hash.update(&self.now().to_be_bytes());
        hash.update(&self.robot.base.load().instructions.to_be_bytes());
        Summary {
            goals_for,
            goals_against,
            time: self.now(),
            trace_hash: hash.value(),
            frames: self.counts.frames,
            reports: self.counts.reports,
            saw_ball: self.counts.saw_ball,
            saw_goal: self.counts.saw_goal,
            saw_opponent: self.counts.saw_opponent,
            cpu_load: self.robot.base.load().since(&self.load_at_kick_off),
            fpga: self.fpga.clone(),
        }
    }

    /// The match in one picture: what both eyes saw last, and the tracks on the pitch.
    pub fn picture(&mut self) -> RgbImage {
        self.world.picture(OURS, self.telling.as_ref())
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
