//! What is counted and measured in a match, for one robot with firmware.

use common_sys::constants as c;
use common_sys::link::Report;
use sim::{Ps, US};
use world::pitch;
use world::sight::{Sight, Sights};

use crate::belief::Belief;

/// A report's column may be so far from the truth.
const COLUMN_SLACK_PX: f64 = 6.0;
/// A belief is compared while its object is visible and was seen so recently: a report takes that long.
const FRESH_TICKS: i32 = 12;
/// A robot whose wheels are driven this hard ...
const DRIVEN_DUTY: f64 = 0.08;
/// ... and that stays slower than this for so long is stuck, until it moves. A free one is faster
/// within 20 ms; the base's motion control gives up after 160 ms, and stands with its motors off.
const STANDS_MM_S: f64 = 8.0;
const STANDS_RAD_S: f64 = 0.2;
const STUCK_MS: u32 = 100;

/// How often an object was there to be found, and was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Detection {
    /// Frames in which it was visible.
    pub visible: u32,
    /// Of those, the ones whose report has it, and at its place.
    pub found: u32,
    /// Reports that have it where nothing of it is in the pictures, or elsewhere.
    pub wrong: u32,
}

impl Detection {
    fn count(&mut self, sight: &Sight, reported: Option<bool>) {
        self.visible += u32::from(sight.visible);
        match reported {
            Some(true) => self.found += u32::from(sight.visible),
            Some(false) => self.wrong += 1,
            None => {}
        }
    }

    /// Share of the visible ones that were found; None if there was none.
    pub fn rate(&self) -> Option<f64> {
        (self.visible > 0).then(|| f64::from(self.found) / f64::from(self.visible))
    }
}

/// Measured values.
#[derive(Clone, Debug, Default)]
pub struct Samples(Vec<f32>);

impl Samples {
    fn add(&mut self, value: f64) {
        self.0.push(value as f32);
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether nothing was measured.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Put two series together.
    pub fn extend(&mut self, other: &Self) {
        self.0.extend(&other.0);
    }

    /// The value that this share (0..=1) of them does not exceed; None without any.
    pub fn percentile(&self, share: f64) -> Option<f64> {
        let mut sorted = self.0.clone();
        sorted.sort_by(f32::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        sorted.get((share * last as f64 + 0.5) as usize).map(|value| f64::from(*value))
    }
}

/// How far belief is from truth while an object is visible.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    /// Of the range, percent.
    pub range_percent: Samples,
    /// Of the bearing, degrees.
    pub bearing_deg: Samples,
}

impl Errors {
    fn add(&mut self, truth: &Sight, (range_mm, bearing_rad): (f64, f64)) {
        self.range_percent.add((range_mm / truth.range_mm - 1.0).abs() * 100.0);
        let turn = bearing_rad - truth.bearing_rad;
        let (sin, cos) = libm::sincos(turn);
        self.bearing_deg.add(libm::atan2(sin, cos).abs().to_degrees());
    }

    /// Put two series together.
    pub fn extend(&mut self, other: &Self) {
        self.range_percent.extend(&other.range_percent);
        self.bearing_deg.extend(&other.bearing_deg);
    }
}

/// All of a match.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Frames in which ball, goal, opponent were visible, and found.
    pub ball: Detection,
    /// See [`Tally::ball`]. The goal that is attacked.
    pub goal: Detection,
    /// See [`Tally::ball`].
    pub opponent: Detection,
    /// Belief against truth.
    pub ball_errors: Errors,
    /// See [`Tally::ball_errors`].
    pub goal_errors: Errors,
    /// See [`Tally::ball_errors`].
    pub opponent_errors: Errors,
    /// Milliseconds from the middle of an exposure to the first write of the motors' duty after its
    /// report had been read.
    pub exposure_to_pwm_ms: Samples,
    /// Milliseconds from the attention line to that write.
    pub report_to_pwm_ms: Samples,
    /// Milliseconds in which the robot was stuck: driven without moving, or standing after that.
    pub stuck_ms: u32,
    standing_ms: u32,
    belief_ticks: i32,
}

impl Tally {
    /// A report, and what there was to be seen when its frames were exposed.
    pub fn report(&mut self, report: &Report, sights: &Sights) {
        let has = |flags: u32| u32::from(report.flags) & flags != 0;
        let near = |x_q4: u16, x: f64| (f64::from(x_q4) / 16.0 - x).abs() < COLUMN_SLACK_PX;

        let ball = &sights.ball;
        let one_eye = has(c::REPORT_BALL_LEFT_ONLY | c::REPORT_BALL_RIGHT_ONLY);
        let ball_right = ball.in_picture
            && (one_eye || !ball.visible || near(report.ball_x_q4, ball.x_right_px[0]));
        self.ball.count(ball, has(c::REPORT_BALL).then_some(ball_right));

        // Either goal may be seen, and a hidden edge is none: only whole sights of this one count.
        let goal = &sights.goal;
        let both = has(c::REPORT_GOAL_LEFT_EDGE) && has(c::REPORT_GOAL_RIGHT_EDGE);
        let edges = [0, 1].map(|i| near(report.goal_x_q4[i], goal.x_right_px[i])) == [true, true];
        self.goal.count(goal, (both && goal.visible).then_some(edges));

        let opponent = &sights.opponent;
        let opponent_right = opponent.in_picture
            && (!opponent.visible || near(report.opponent_x_q4, opponent.x_right_px[0]));
        self.opponent.count(opponent, has(c::REPORT_OPPONENT).then_some(opponent_right));
    }

    /// What the robot believes now, and what is true now.
    pub fn believe(&mut self, belief: &Belief, sights: &Sights) {
        if belief.ticks == self.belief_ticks {
            return;
        }
        self.belief_ticks = belief.ticks;
        if let Some(ball) = belief.ball
            && sights.ball.visible
            && ball.age_ticks <= FRESH_TICKS
        {
            self.ball_errors.add(&sights.ball, belief.polar(ball.mm));
        }
        if let Some(opponent) = belief.opponent
            && sights.opponent.visible
            && opponent.age_ticks <= FRESH_TICKS
        {
            self.opponent_errors.add(&sights.opponent, belief.polar(opponent.mm));
        }
        if belief.localised && sights.goal.visible {
            self.goal_errors.add(&sights.goal, belief.polar([pitch::HALF_LENGTH_MM, 0.0]));
        }
    }

    /// A report has reached the motors.
    pub fn latency(&mut self, mid_exposure: Ps, ready: Ps, pwm: Ps) {
        let ms = |from: Ps| pwm.saturating_sub(from) as f64 / (1000 * US) as f64;
        self.exposure_to_pwm_ms.add(ms(mid_exposure));
        self.report_to_pwm_ms.add(ms(ready));
    }

    /// A millisecond: the harder driven motor's duty, and how the robot moves.
    pub fn move_on(&mut self, duty: f64, (mm_s, rad_s): (f64, f64)) {
        let stands = mm_s < STANDS_MM_S && rad_s.abs() < STANDS_RAD_S;
        let stuck = self.standing_ms >= STUCK_MS;
        if !stands || (duty < DRIVEN_DUTY && !stuck) {
            self.standing_ms = 0;
            return;
        }
        self.standing_ms += 1;
        self.stuck_ms += match self.standing_ms {
            ..STUCK_MS => 0,
            STUCK_MS => STUCK_MS,
            _ => 1,
        };
    }

    /// The robot is stopped, and may be put elsewhere.
    pub fn rest(&mut self) {
        self.standing_ms = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_sorted_values() {
        let mut samples = Samples::default();
        assert_eq!(samples.percentile(0.5), None);
        for value in (0..=100).rev() {
            samples.add(f64::from(value));
        }
        let of = |share| samples.percentile(share);
        assert_eq!([of(0.0), of(0.5), of(0.9), of(1.0)], [0.0, 50.0, 90.0, 100.0].map(Some));
    }

    #[test]
    fn a_robot_that_is_driven_and_does_not_move_is_stuck_until_it_does() {
        let mut tally = Tally::default();
        for _ in 0..99 {
            tally.move_on(0.3, (1.0, 0.0));
        }
        assert_eq!(tally.stuck_ms, 0);
        tally.move_on(0.3, (1.0, 0.0));
        assert_eq!(tally.stuck_ms, 100);
        // Motion control has given up.
        tally.move_on(0.0, (0.0, 0.0));
        assert_eq!(tally.stuck_ms, 101);
        tally.move_on(0.3, (50.0, 0.0));
        tally.move_on(0.3, (1.0, 0.0));
        assert_eq!(tally.stuck_ms, 101);
    }

    #[test]
    fn a_robot_that_stands_because_nothing_drives_it_is_not_stuck() {
        let mut tally = Tally::default();
        for _ in 0..1000 {
            tally.move_on(0.0, (0.0, 0.0));
        }
        for _ in 0..60 {
            tally.move_on(0.3, (1.0, 0.0));
        }
        tally.rest();
        for _ in 0..60 {
            tally.move_on(0.3, (1.0, 0.0));
        }
        assert_eq!(tally.stuck_ms, 0);
    }

    #[test]
    fn a_belief_is_compared_once_a_tick_and_only_while_the_object_is_visible() {
        let seen = |range_mm, visible| Sight {
            range_mm,
            bearing_rad: 0.0,
            visible,
            in_picture: visible,
            x_right_px: [160.0; 2],
        };
        let sights = Sights {
            ball: seen(400.0, true),
            goal: seen(525.0, true),
            opponent: seen(300.0, false),
        };
        let place = |x| Some(crate::belief::Place { mm: [x, 0.0], age_ticks: 3 });
        let belief = Belief {
            ticks: 7,
            state: 0,
            mm: [0.0; 2],
            heading_rad: 0.0,
            localised: true,
            ball: place(408.0),
            opponent: place(100.0),
        };
        let mut tally = Tally::default();
        tally.believe(&belief, &sights);
        tally.believe(&belief, &sights);
        assert_eq!(tally.ball_errors.range_percent.len(), 1);
        let error = tally.ball_errors.range_percent.percentile(0.5).expect("one");
        assert!((error - 2.0).abs() < 1e-3, "{error}");
        assert!(tally.opponent_errors.range_percent.is_empty());
        assert_eq!(tally.goal_errors.bearing_deg.percentile(1.0), Some(0.0));
    }
}
