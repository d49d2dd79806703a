//! The rules of a match, all in this file, and the referee who applies them.
//!
//! | rule | value | provenance |
//! |---|---|---|
//! | players | one robot a side | FIRA KheperaSot |
//! | playing time | two halves of 5 min, ends changed between them | FIRA KheperaSot |
//! | draw | 3 min of extra time, then sudden death | FIRA KheperaSot |
//! | sudden death | at most as long as the extra time | decided here: a match must end |
//! | free ball | after more than 10 s of stalemate | FIRA KheperaSot |
//! | stalemate | the ball has not left a circle of [`STALEMATE_MM`] | decided here |
//! | free ball's place | the nearest of four spots, both robots [`BALL_FROM_ROBOT_MM`] away; they play on | the league has grey circles; their places are assumed |
//! | goal | the whole ball is over the line | football's rule; the league's page is not readable there |
//! | after a goal or a half | [`PAUSE`], then kick-off; the clock runs on | decided here: a handler types `stop` and `start` |
//! | our robot | anywhere in its own half, any heading | decided here; the league lets the teams place it |
//! | opponent | anywhere in its own half | decided here |
//! | ball at kick-off | anywhere, 90 mm from walls, 120 mm from both robots | decided here, so that it can be reached |
//! | own goal | the robot that touched the ball last defends that goal | football's usage; statistics only |
//!
//! A match is played by whoever implements [`Rules`]; [`Referee`] is the league's.

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;
use sim::{MS, Ps, SECOND, device_rng};

use crate::physics::Pose;
use crate::pitch::{
    BALL_RADIUS_MM, CORNER_CUT_MM, GOAL_HALF_WIDTH_MM, HALF_LENGTH_MM, HALF_WIDTH_MM,
    ROBOT_RADIUS_MM,
};

/// A ball that stays within a circle of this radius for longer than [`STALEMATE`] is not in play.
pub const STALEMATE_MM: f64 = 50.0;
/// See [`STALEMATE_MM`].
pub const STALEMATE: Ps = 10 * SECOND;
/// From a goal or the end of a half to the next kick-off.
pub const PAUSE: Ps = 1000 * MS;
/// Where a free ball is put, in each quarter of the pitch.
const FREE_BALL_MM: [f64; 2] = [HALF_LENGTH_MM / 2.0, HALF_WIDTH_MM / 2.0];

/// Least distance of a robot's centre from a wall: it can turn there and see something.
const ROBOT_CLEARANCE_MM: f64 = 70.0;
/// Least distance of the ball's centre from a wall.
const BALL_CLEARANCE_MM: f64 = 90.0;
/// Least distance of the ball's centre from a robot's.
const BALL_FROM_ROBOT_MM: f64 = 120.0;
/// Least distance between the robots' centres.
const ROBOTS_APART_MM: f64 = 150.0;

/// Where everything stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KickOff {
    /// Robot 0, then robot 1.
    pub robots: [Pose; 2],
    /// Centre of the ball.
    pub ball_mm: [f64; 2],
}

impl KickOff {
    /// The same with ends changed if `side` is -1: turned by half a turn about the centre spot.
    fn turned(self, side: f64) -> Self {
        if side > 0.0 {
            return self;
        }
        let turn = |pose: Pose| Pose {
            x_mm: -pose.x_mm,
            y_mm: -pose.y_mm,
            heading_rad: pose.heading_rad + core::f64::consts::PI,
        };
        Self { robots: self.robots.map(turn), ball_mm: self.ball_mm.map(|v| -v) }
    }
}

/// Draw kick-off `number` of a match, robot 0 attacking +x.
pub fn kick_off(seed: u64, number: u32) -> KickOff {
    let device =
        if number == 0 { "kick-off".to_owned() } else { format!("kick-off {}", number + 1) };
    let rng = &mut device_rng(seed, &device);
    let ours = draw_robot(rng, [-1.0, 0.0]);
    let opponent = loop {
        let pose = draw_robot(rng, [0.0, 1.0]);
        if distance([ours.x_mm, ours.y_mm], [pose.x_mm, pose.y_mm]) >= ROBOTS_APART_MM {
            break pose;
        }
    };
    let robots = [ours, opponent];
    let ball_mm = loop {
        let at = draw_place(rng, [-1.0, 1.0], BALL_CLEARANCE_MM);
        if robots.iter().all(|r| distance(at, [r.x_mm, r.y_mm]) >= BALL_FROM_ROBOT_MM) {
            break at;
        }
    };
    KickOff { robots, ball_mm }
}

/// Uniform in 0..1.
fn uniform(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn between(rng: &mut Pcg64Mcg, from: f64, to: f64) -> f64 {
    from + (to - from) * uniform(rng)
}

fn draw_robot(rng: &mut Pcg64Mcg, half: [f64; 2]) -> Pose {
    let [x_mm, y_mm] = draw_place(rng, half, ROBOT_CLEARANCE_MM.max(ROBOT_RADIUS_MM));
    let heading_rad = between(rng, -core::f64::consts::PI, core::f64::consts::PI);
    Pose { x_mm, y_mm, heading_rad }
}

/// A place between two fractions of the half length, clear of walls and cut corners.
fn draw_place(rng: &mut Pcg64Mcg, part: [f64; 2], clearance_mm: f64) -> [f64; 2] {
    let (length, width) = (HALF_LENGTH_MM - clearance_mm, HALF_WIDTH_MM - clearance_mm);
    loop {
        let at = [between(rng, part[0] * length, part[1] * length), between(rng, -width, width)];
        let corner = HALF_LENGTH_MM + HALF_WIDTH_MM - CORNER_CUT_MM - at[0].abs() - at[1].abs();
        if corner / core::f64::consts::SQRT_2 >= clearance_mm {
            return at;
        }
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// At which end a ball is in the goal: 1 = that at +x, -1 = the other.
pub fn goal_at(ball_mm: [f64; 2]) -> Option<f64> {
    let over = ball_mm[0].abs() - HALF_LENGTH_MM >= BALL_RADIUS_MM;
    (over && ball_mm[1].abs() < GOAL_HALF_WIDTH_MM).then_some(libm::copysign(1.0, ball_mm[0]))
}

/// How long is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Halves; ends are changed between them.
    pub halves: u32,
    /// Length of a half.
    pub half: Ps,
    /// Length of the extra time after a draw, and of the sudden death after that; 0 = neither.
    pub extra_time: Ps,
    /// The first goal ends the match.
    pub first_goal_ends: bool,
}

impl Format {
    /// One period, played to its end.
    pub fn single(length: Ps) -> Self {
        Self { halves: 1, half: length, extra_time: 0, first_goal_ends: false }
    }

    /// As the league plays, with all its times in proportion to these of both halves together: there
    /// they are 10 min, and the extra time is 3 min.
    pub fn league(length: Ps) -> Self {
        Self { halves: 2, half: length / 2, extra_time: length / 10 * 3, first_goal_ends: false }
    }

    /// The longest that a match can take.
    pub fn longest(&self) -> Ps {
        Ps::from(self.halves) * self.half + 2 * self.extra_time
    }
}

/// What the referee sees at one time.
#[derive(Clone, Copy, Debug)]
pub struct Situation {
    /// Since power-on; periods are counted from there.
    pub time: Ps,
    /// Centre of the ball.
    pub ball_mm: [f64; 2],
    /// Both robots.
    pub robots: [Pose; 2],
    /// Who touched the ball last since the kick-off.
    pub last_touch: Option<usize>,
}

/// What the referee calls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Call {
    /// Everything is put where it says; both robots are started. `attacks`: towards +x (1) or -x
    /// (-1), for each robot.
    KickOff {
        /// Where everything stands.
        places: KickOff,
        /// Which way the robots play.
        attacks: [f64; 2],
        /// What begins with it.
        period: Period,
    },
    /// A goal; both robots are stopped.
    Goal {
        /// Who gets it.
        robot: usize,
        /// The other one put it there itself.
        own_goal: bool,
    },
    /// The ball is put here; the robots play on.
    FreeBall([f64; 2]),
    /// A half or the extra time is over; both robots are stopped.
    Whistle,
    /// The match is over.
    End,
}

/// Part of a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Period {
    /// Half 0, 1.
    Half(u32),
    /// After a draw.
    ExtraTime,
    /// The next goal wins.
    SuddenDeath,
}

/// What makes a game of two robots and a ball.
pub trait Rules {
    /// Look at the pitch, every millisecond. One call at a time.
    fn watch(&mut self, situation: &Situation) -> Option<Call>;

    /// Goals of robot 0 and of robot 1.
    fn goals(&self) -> [u32; 2];

    /// The match is over.
    fn over(&self) -> bool;
}

/// Where a match stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Kick-off comes then.
    Waiting(Ps),
    /// The ball is in play; it has been about here since then.
    Playing {
        at_mm: [f64; 2],
        since: Ps,
    },
    Over,
}

/// The league's referee.
#[derive(Clone, Debug)]
pub struct Referee {
    seed: u64,
    format: Format,
    period: Period,
    period_end: Ps,
    phase: Phase,
    kick_offs: u32,
    goals: [u32; 2],
}

impl Referee {
    /// For the match of that seed, whose first kick-off is at `start`.
    pub fn new(seed: u64, format: Format, start: Ps) -> Self {
        Self {
            seed,
            format,
            period: Period::Half(0),
            period_end: format.half,
            phase: Phase::Waiting(start),
            kick_offs: 0,
            goals: [0; 2],
        }
    }

    /// Which way robot 0 plays: ends are changed after each half.
    fn side(&self) -> f64 {
        let turned = match self.period {
            Period::Half(half) => half % 2 == 1,
            Period::ExtraTime => self.format.halves % 2 == 1,
            Period::SuddenDeath => self.format.halves.is_multiple_of(2),
        };
        if turned { -1.0 } else { 1.0 }
    }

    fn kick_off(&mut self, situation: &Situation) -> Call {
        let side = self.side();
        let places = kick_off(self.seed, self.kick_offs).turned(side);
        self.kick_offs += 1;
        self.phase = Phase::Playing { at_mm: places.ball_mm, since: situation.time };
        Call::KickOff { places, attacks: [side, -side], period: self.period }
    }

    fn goal(&mut self, end: f64, situation: &Situation) -> Call {
        let robot = usize::from(end != self.side());
        self.goals[robot] += 1;
        let decided = self.format.first_goal_ends || self.period == Period::SuddenDeath;
        self.phase = if decided { Phase::Over } else { Phase::Waiting(situation.time + PAUSE) };
        Call::Goal { robot, own_goal: situation.last_touch == Some(1 - robot) }
    }

    fn end_of_period(&mut self, situation: &Situation) -> Call {
        let level = self.goals[0] == self.goals[1] && self.format.extra_time > 0;
        let (next, length) = match self.period {
            Period::Half(half) if half + 1 < self.format.halves => {
                (Period::Half(half + 1), self.format.half)
            }
            Period::Half(_) if level => (Period::ExtraTime, self.format.extra_time),
            Period::ExtraTime if level => (Period::SuddenDeath, self.format.extra_time),
            _ => {
                self.phase = Phase::Over;
                return Call::End;
            }
        };
        self.period = next;
        self.period_end += length;
        self.phase = Phase::Waiting(situation.time + PAUSE);
        Call::Whistle
    }

    /// Where a ball that nobody gets away is put.
    fn free_ball(situation: &Situation) -> Option<[f64; 2]> {
        let [x, y] = FREE_BALL_MM;
        let mut spots = [[x, y], [x, -y], [-x, y], [-x, -y]];
        spots.sort_by(|a, b| {
            distance(*a, situation.ball_mm).total_cmp(&distance(*b, situation.ball_mm))
        });
        let clear = |spot: &[f64; 2]| {
            situation
                .robots
                .iter()
                .all(|robot| distance(*spot, [robot.x_mm, robot.y_mm]) >= BALL_FROM_ROBOT_MM)
        };
        spots.into_iter().find(clear)
    }
}

impl Rules for Referee {
    fn watch(&mut self, situation: &Situation) -> Option<Call> {
        if self.phase == Phase::Over {
            return None;
        }
        if situation.time >= self.period_end {
            return Some(self.end_of_period(situation));
        }
        let (at_mm, since) = match self.phase {
            Phase::Over => return None,
            Phase::Waiting(until) => {
                return (situation.time >= until).then(|| self.kick_off(situation));
            }
            Phase::Playing { at_mm, since } => (at_mm, since),
        };
        if let Some(end) = goal_at(situation.ball_mm) {
            return Some(self.goal(end, situation));
        }
        if distance(at_mm, situation.ball_mm) > STALEMATE_MM {
            self.phase = Phase::Playing { at_mm: situation.ball_mm, since: situation.time };
        } else if situation.time - since > STALEMATE {
            let spot = Self::free_ball(situation)?;
            self.phase = Phase::Playing { at_mm: spot, since: situation.time };
            return Some(Call::FreeBall(spot));
        }
        None
    }

    fn goals(&self) -> [u32; 2] {
        self.goals
    }

    fn over(&self) -> bool {
        self.phase == Phase::Over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AWAY: [Pose; 2] = [
        Pose { x_mm: -300.0, y_mm: -250.0, heading_rad: 0.0 },
        Pose { x_mm: 300.0, y_mm: 250.0, heading_rad: 0.0 },
    ];
    const IN_GOAL: [f64; 2] = [HALF_LENGTH_MM + BALL_RADIUS_MM, 10.0];

    /// Watches a ball that lies still from `from` to `to`, every millisecond; all calls with their times.
    fn watch(
        referee: &mut Referee,
        [from, to]: [Ps; 2],
        ball_mm: [f64; 2],
        last_touch: Option<usize>,
    ) -> Vec<(Ps, Call)> {
        (from / MS..to / MS)
            .filter_map(|ms| {
                let time = ms * MS;
                let situation = Situation { time, ball_mm, robots: AWAY, last_touch };
                referee.watch(&situation).map(|call| (time, call))
            })
            .collect()
    }

    fn started(format: Format) -> Referee {
        let mut referee = Referee::new(1, format, 0);
        let calls = watch(&mut referee, [0, 2 * MS], [0.0; 2], None);
        assert!(matches!(calls[..], [(0, Call::KickOff { attacks: [1.0, -1.0], .. })]));
        referee
    }

    #[test]
    fn every_kick_off_is_playable() {
        for seed in 0..2000 {
            let KickOff { robots: [ours, opponent], ball_mm } = kick_off(seed, seed as u32 % 3);
            assert!(ours.x_mm <= 0.0 && opponent.x_mm >= 0.0, "seed {seed}");
            for robot in [ours, opponent] {
                assert!(distance(ball_mm, [robot.x_mm, robot.y_mm]) >= BALL_FROM_ROBOT_MM);
                assert!(robot.x_mm.abs() <= HALF_LENGTH_MM - ROBOT_CLEARANCE_MM);
                assert!(robot.y_mm.abs() <= HALF_WIDTH_MM - ROBOT_CLEARANCE_MM);
            }
            assert!(ball_mm[0].abs() <= HALF_LENGTH_MM - BALL_CLEARANCE_MM);
        }
    }

    #[test]
    fn seeds_and_numbers_draw_different_kick_offs_and_the_same_ones_the_same() {
        assert_eq!(kick_off(1, 0), kick_off(1, 0));
        assert_ne!(kick_off(1, 0), kick_off(2, 0));
        assert_ne!(kick_off(1, 0), kick_off(1, 1));
    }

    #[test]
    fn only_the_whole_ball_over_the_line_is_a_goal() {
        assert_eq!(goal_at([558.4, 0.0]), None);
        assert_eq!(goal_at([558.5, 0.0]), Some(1.0));
        assert_eq!(goal_at([-558.5, 100.0]), Some(-1.0));
        assert_eq!(goal_at([558.5, 150.0]), None);
    }

    #[test]
    fn a_goal_counts_once_and_kick_off_follows_after_the_pause() {
        let mut referee = started(Format::single(60 * SECOND));
        let calls = watch(&mut referee, [2 * MS, 1500 * MS], IN_GOAL, Some(0));
        assert_eq!(calls[0], (2 * MS, Call::Goal { robot: 0, own_goal: false }));
        assert_eq!(calls[1].0, 2 * MS + PAUSE);
        assert!(matches!(calls[1].1, Call::KickOff { .. }));
        // The ball is still there: whoever watches has not put it to its place.
        assert_eq!(referee.goals(), [2, 0]);
    }

    #[test]
    fn who_touches_the_ball_last_before_his_own_goal_scores_an_own_goal() {
        let mut referee = started(Format::single(60 * SECOND));
        let calls = watch(&mut referee, [2 * MS, 3 * MS], IN_GOAL, Some(1));
        assert_eq!(calls[0].1, Call::Goal { robot: 0, own_goal: true });
    }

    #[test]
    fn a_kick_off_match_ends_with_its_first_goal() {
        let format = Format { first_goal_ends: true, ..Format::single(60 * SECOND) };
        let mut referee = started(format);
        watch(&mut referee, [2 * MS, 3 * MS], IN_GOAL, None);
        assert!(referee.over());
        assert_eq!(referee.goals(), [1, 0]);
    }

    #[test]
    fn a_ball_that_lies_still_for_ten_seconds_becomes_a_free_ball() {
        let mut referee = started(Format::single(60 * SECOND));
        let corner = [480.0, 300.0];
        let calls = watch(&mut referee, [2 * MS, 11 * SECOND], corner, None);
        let [(time, Call::FreeBall(spot))] = calls[..] else { panic!("{calls:?}") };
        assert!((STALEMATE..STALEMATE + 10 * MS).contains(&time), "{time}");
        // The nearest spot is robot 1's place: the next one.
        assert_eq!(spot, [FREE_BALL_MM[0], -FREE_BALL_MM[1]]);
    }

    #[test]
    fn a_ball_that_moves_on_is_in_play() {
        let mut referee = started(Format::single(60 * SECOND));
        for second in 1..30 {
            let places = [[0.0, 0.0], [60.0, 0.0]];
            let span = [second * SECOND, (second + 1) * SECOND];
            let calls = watch(&mut referee, span, places[second as usize % 2], None);
            assert_eq!(calls, []);
        }
    }

    #[test]
    fn ends_are_changed_at_half_time_and_goals_are_told_apart() {
        let mut referee = started(Format { extra_time: 0, ..Format::league(20 * SECOND) });
        let calls = watch(&mut referee, [2 * MS, 11 * SECOND + 2 * MS], [0.0; 2], None);
        let [(whistle, Call::Whistle), (_, Call::KickOff { places, attacks, period })] = calls[..]
        else {
            panic!("{calls:?}")
        };
        assert_eq!((whistle, attacks, period), (10 * SECOND, [-1.0, 1.0], Period::Half(1)));
        assert!(places.robots[0].x_mm >= 0.0 && places.robots[1].x_mm <= 0.0);
        let calls = watch(&mut referee, [12 * SECOND, 12 * SECOND + MS], IN_GOAL, Some(1));
        assert_eq!(calls[0].1, Call::Goal { robot: 1, own_goal: false });
        let calls = watch(&mut referee, [20 * SECOND, 20 * SECOND + MS], [0.0; 2], None);
        assert_eq!(calls, [(20 * SECOND, Call::End)]);
    }

    #[test]
    fn a_draw_is_followed_by_extra_time_and_sudden_death() {
        let mut referee = started(Format::league(20 * SECOND));
        let calls = watch(&mut referee, [2 * MS, 27 * SECOND + 10 * MS], [0.0; 2], None);
        let periods: Vec<Period> = calls
            .iter()
            .filter_map(|(_, call)| match call {
                Call::KickOff { period, .. } => Some(*period),
                _ => None,
            })
            .collect();
        assert_eq!(periods, [Period::Half(1), Period::ExtraTime, Period::SuddenDeath]);
        let calls = watch(&mut referee, [28 * SECOND, 28 * SECOND + MS], IN_GOAL, None);
        assert!(matches!(calls[..], [(_, Call::Goal { .. })]) && referee.over());
    }
}
