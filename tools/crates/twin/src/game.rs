//! A match: two players, the world they play in, and the rules they play by.
//!
//! The loop runs from event to event: physics every millisecond, an exposure, the end of a frame's
//! read-out. Between two events the players run one after the other: they meet in the world only. Within
//! a robot both CPUs run in slices, each no further ahead of the other than [`crate::robot::Robot`]
//! allows.

use image::RgbImage;
use sim::{MS, Ps, TraceHash};
use world::opponents::{Kind, Opponent};
use world::referee::{Call, Period, Referee, Rules, Situation};
use world::{Setup as WorldSetup, World};

pub use world::materials::Materials;
pub use world::referee::Format;
pub use world::{BallColour, Eyes, Noise};

pub use crate::player::Fpga;
use crate::player::{FirmwarePlayer, Player};
use crate::robot::{Error, Images};
use crate::tally::Tally;

/// Physics advances so far at a time.
const TICK: Ps = world::TICK;
/// Which of the world's robots is ours, and which the other.
const OURS: usize = 0;
const OTHER: usize = 1;
/// The other robot's cameras expose so much later: nothing keeps both in step (assumption).
const OTHER_EYES_LATER: Ps = 7 * MS;

/// Who plays on the other side.
#[derive(Clone)]
pub enum Other {
    /// A program that drives wheels.
    Program(Kind),
    /// A robot with these images.
    Firmware(Box<Images>),
}

/// What a match is made of.
#[derive(Clone)]
pub struct Setup {
    /// Draws where everything stands, and what robots, eyes and floor are like.
    pub seed: u64,
    /// Firmware and flash.
    pub images: Images,
    /// The other side.
    pub other: Other,
    /// What the cameras deliver.
    pub eyes: Eyes,
    /// Colour of the ball.
    pub ball: BallColour,
    /// How bad cameras, wheels and floor are.
    pub noise: Noise,
    /// Friction, losses, masses.
    pub materials: Materials,
    /// How long is played.
    pub format: Format,
}

/// What the referee called, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Since power-on.
    pub time: Ps,
    /// What.
    pub call: Call,
}

impl Event {
    /// One word for it.
    pub fn name(&self) -> &'static str {
        match self.call {
            Call::KickOff { .. } => "kick-off",
            Call::Goal { own_goal: true, .. } => "own goal",
            Call::Goal { .. } => "goal",
            Call::FreeBall(_) => "free ball",
            Call::Whistle => "end of period",
            Call::End => "end",
        }
    }

    /// Who gets the goal.
    pub fn robot(&self) -> Option<usize> {
        match self.call {
            Call::Goal { robot, .. } => Some(robot),
            _ => None,
        }
    }

    /// Which part of the match begins.
    pub fn period(&self) -> Option<&'static str> {
        match self.call {
            Call::KickOff { period, .. } => Some(match period {
                Period::Half(0) => "first half",
                Period::Half(_) => "second half",
                Period::ExtraTime => "extra time",
                Period::SuddenDeath => "sudden death",
            }),
            _ => None,
        }
    }
}

/// What a match came to.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Balls in the opponent's goal.
    pub goals_for: u32,
    /// Balls in ours.
    pub goals_against: u32,
    /// Of those, the ones that our robot touched last.
    pub own_goals: u32,
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
    /// What the referee called.
    pub events: Vec<Event>,
    /// From the first kick-off to our robot's first touch of the ball.
    pub time_to_ball: Option<Ps>,
    /// From the first kick-off to our first goal.
    pub time_to_goal: Option<Ps>,
    /// What was measured of our robot.
    pub tally: Tally,
}

/// The other side.
enum OtherPlayer {
    Program(Box<Opponent>),
    Firmware(Box<FirmwarePlayer>),
}

impl OtherPlayer {
    fn player(&mut self) -> &mut dyn Player {
        match self {
            Self::Program(opponent) => &mut **opponent,
            Self::Firmware(robot) => &mut **robot,
        }
    }
}

/// A match, from switching the robots on to its end.
pub struct Game {
    ours: FirmwarePlayer,
    other: OtherPlayer,
    rules: Box<dyn Rules + Send>,
    world: World,
    now: Ps,
    next_tick: Ps,
    end: Ps,
    events: Vec<Event>,
    first_touch: Option<Ps>,
    hash: TraceHash,
}

impl Game {
    /// A match by the league's rules. Builds the robots, switches them on, lets the host at their USB
    /// sockets ask how their FPGAs are, and waits until their consoles say that they are ready.
    ///
    /// # Errors
    /// If an image is unusable. An FPGA that does not come up is no error: the match is played.
    pub fn new(setup: Setup) -> Result<Self, Error> {
        let mut world = World::new(&WorldSetup {
            seed: setup.seed,
            eyes: setup.eyes,
            ball: setup.ball,
            noise: setup.noise,
            materials: setup.materials,
        });
        let mut ours = FirmwarePlayer::new(&setup.images, world.battery(OURS))?;
        ours.wait_until_ready();
        let mut other = match setup.other {
            Other::Program(kind) => OtherPlayer::Program(Box::new(Opponent::new(kind, setup.seed))),
            Other::Firmware(images) => {
                let mut robot = FirmwarePlayer::new(&images, world.battery(OTHER))?;
                robot.wait_until_ready();
                OtherPlayer::Firmware(Box::new(robot))
            }
        };
        let other_now = other.player().now().unwrap_or(0);
        let start = ours.robot().now().max(other_now).next_multiple_of(TICK);
        ours.open_eyes(start);
        if let OtherPlayer::Firmware(robot) = &mut other {
            robot.open_eyes(start + OTHER_EYES_LATER);
        }
        Ok(Self {
            ours,
            other,
            rules: Box::new(Referee::new(setup.seed, setup.format, start)),
            world,
            now: start,
            next_tick: start,
            end: setup.format.longest().max(start),
            events: Vec::new(),
            first_touch: None,
            hash: TraceHash::default(),
        })
    }

    /// Time reached.
    pub fn now(&self) -> Ps {
        self.now
    }

    /// When the match is over at the latest.
    pub fn end(&self) -> Ps {
        self.end
    }

    /// Whether the referee has ended it.
    pub fn over(&self) -> bool {
        self.rules.over()
    }

    /// Play on for `duration`, or until it is over.
    pub fn run_for(&mut self, duration: Ps) {
        let until = self.now + duration;
        while self.now < until && !self.over() {
            self.step(until);
        }
    }

    /// On to the next event, no further than `until`.
    fn step(&mut self, until: Ps) {
        let looks = self.ours.next_event().min(self.other.player().next_event());
        let next = self.next_tick.min(looks).min(until);
        self.ours.run_until(next);
        self.other.player().run_until(next);
        self.now = next;
        if next == self.next_tick {
            self.tick();
            self.next_tick += TICK;
        }
        self.ours.look(next, &mut self.world, OURS);
        self.other.player().look(next, &mut self.world, OTHER);
        self.ours.trace(&mut self.hash);
        self.other.player().trace(&mut self.hash);
    }

    fn tick(&mut self) {
        let situation = Situation {
            time: self.now,
            ball_mm: self.world.ball_mm(),
            robots: [self.world.robot(OURS), self.world.robot(OTHER)],
            last_touch: self.world.last_touch(),
        };
        if let Some(call) = self.rules.watch(&situation) {
            self.obey(call);
        }
        let wheels = [
            self.ours.tick(&mut self.world, OURS),
            self.other.player().tick(&mut self.world, OTHER),
        ];
        for value in wheels.as_flattened() {
            self.hash.update(&value.to_bits().to_be_bytes());
        }
        self.world.step(wheels);
        if self.first_touch.is_none() && self.world.last_touch() == Some(OURS) {
            self.first_touch = Some(self.now);
        }
    }

    /// What handlers and referee do after a call.
    fn obey(&mut self, call: Call) {
        self.events.push(Event { time: self.now, call });
        match call {
            Call::KickOff { places, attacks, .. } => {
                self.world.kick_off(&places, attacks);
                self.ours.start(self.world.heading_deg(OURS));
                self.other.player().start(self.world.heading_deg(OTHER));
            }
            Call::FreeBall(at_mm) => self.world.free_ball(at_mm),
            Call::Goal { .. } | Call::Whistle | Call::End => {
                if let Call::Goal { robot, .. } = call {
                    self.world.goal(robot);
                }
                self.ours.stop();
                self.other.player().stop();
            }
        }
    }

    /// What our robot said on its console since the last call, line by line.
    pub fn take_serial_lines(&mut self) -> Vec<String> {
        self.ours.take_lines()
    }

    /// The score in one phrase.
    pub fn headline(&self) -> String {
        match self.rules.goals() {
            [0, 0] => "no goal yet".to_owned(),
            [ours, theirs] => format!("{ours} : {theirs}"),
        }
    }

    /// Our robot and its eyes.
    pub fn ours(&self) -> &FirmwarePlayer {
        &self.ours
    }

    /// Our robot, to break something.
    pub fn ours_mut(&mut self) -> &mut FirmwarePlayer {
        &mut self.ours
    }

    /// The other side's robot and its eyes, if it has firmware.
    pub fn other(&self) -> Option<&FirmwarePlayer> {
        match &self.other {
            OtherPlayer::Firmware(robot) => Some(robot),
            OtherPlayer::Program(_) => None,
        }
    }

    /// The pitch and what is on it.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What the referee has called so far.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// What it came to.
    pub fn summary(&self) -> Summary {
        let [goals_for, goals_against] = self.rules.goals();
        let own_goal = |event: &&Event| event.call == Call::Goal { robot: OTHER, own_goal: true };
        let mut hash = self.hash;
        hash.update(&self.now.to_be_bytes());
        hash.update(&self.ours.robot().base.load().instructions.to_be_bytes());
        let counts = self.ours.counts();
        Summary {
            goals_for,
            goals_against,
            own_goals: self.events.iter().filter(own_goal).count() as u32,
            time: self.now,
            trace_hash: hash.value(),
            frames: counts.frames,
            reports: counts.reports,
            saw_ball: counts.saw_ball,
            saw_goal: counts.saw_goal,
            saw_opponent: counts.saw_opponent,
            cpu_load: self.ours.cpu_load(),
            fpga: self.ours.fpga().clone(),
            events: self.events.clone(),
            time_to_ball: self.since_kick_off(self.first_touch),
            time_to_goal: self.since_kick_off(
                self.events.iter().find(|event| event.robot() == Some(OURS)).map(|e| e.time),
            ),
            tally: self.ours.tally().clone(),
        }
    }

    fn since_kick_off(&self, time: Option<Ps>) -> Option<Ps> {
        Some(time? - self.events.first()?.time)
    }

    /// The match in one picture: what both eyes saw last, and the tracks on the pitch.
    pub fn picture(&mut self) -> RgbImage {
        self.world.picture(OURS, self.ours.telling(), self.rules.goals())
    }
}
