//! What a match was like, for the picture: who had the ball and where, shots, and when what happened.
//!
//! Places are turned so that robot 0 always plays towards +x.

use crate::materials::Materials;
use crate::pitch as p;

/// Cells of the heat map: 25 mm each.
pub const CELL_MM: f64 = 25.0;
/// Cells along the pitch, goals included.
pub const COLUMNS: usize = 48;
/// Cells across it.
pub const ROWS: usize = 28;
/// A robot so near to the ball has it, if it is the nearer one and touched it last or nobody did.
const HAS_MM: f64 = 110.0;
/// The ball has left a robot when they have not touched for so long.
const LEFT_MS: u32 = 40;
/// A push goes on if the robot touches the ball again within this time.
const PUSH_MS: u32 = 400;
/// Slower than this nothing is a shot, and a shot is over.
const SHOT_MM_S: f64 = 100.0;
const OVER_MM_S: f64 = 25.0;
/// The time line has a mark for so many milliseconds.
pub const MOMENT_MS: u32 = 250;

/// What happened on the pitch in a millisecond.
#[derive(Clone, Copy, Debug)]
pub struct Instant {
    /// Centre of the ball, and its velocity.
    pub ball_mm: [f64; 2],
    /// See [`Instant::ball_mm`].
    pub ball_mm_s: [f64; 2],
    /// Distance of each robot's middle from the ball's.
    pub apart_mm: [f64; 2],
    /// Which robots touch the ball.
    pub touches: [bool; 2],
}

/// A ball that went towards a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Who sent it.
    pub robot: usize,
    /// Where the push began, and where it ended.
    pub from_mm: [f64; 2],
    /// See [`Shot::from_mm`].
    pub to_mm: [f64; 2],
    /// It went in.
    pub goal: bool,
}

/// What the referee called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A goal for this robot.
    Goal(usize),
    /// A free ball.
    FreeBall,
    /// A kick-off.
    KickOff,
}

/// All of a match.
#[derive(Clone, Debug)]
pub struct Chronicle {
    /// Milliseconds that the ball spent in each cell with each robot, row by row from -y.
    pub heat: [Vec<u32>; 2],
    /// Milliseconds that each robot had the ball.
    pub possession_ms: [u32; 2],
    /// Who had the ball most of each [`MOMENT_MS`]: robot 0, robot 1, or nobody.
    pub line: Vec<Option<usize>>,
    /// Shots.
    pub shots: Vec<Shot>,
    /// What was called, with the milliseconds since the first kick-off.
    pub marks: Vec<(u32, Mark)>,
    now_ms: u32,
    in_play: bool,
    moment: [u32; 2],
    /// Where each robot's push began, and when it last touched.
    push: [Option<([f64; 2], u32)>; 2],
    flight: Option<(usize, [f64; 2])>,
    last_touch: Option<usize>,
    roll_mm_s2: f64,
}

impl Chronicle {
    /// Nothing has happened yet.
    pub fn new(materials: &Materials) -> Self {
        Self {
            heat: [0, 1].map(|_| vec![0; COLUMNS * ROWS]),
            possession_ms: [0; 2],
            line: Vec::new(),
            shots: Vec::new(),
            marks: Vec::new(),
            now_ms: 0,
            in_play: true,
            moment: [0; 2],
            push: [None; 2],
            flight: None,
            last_touch: None,
            roll_mm_s2: materials.rolling_loss * 9810.0,
        }
    }

    /// The referee called something.
    pub fn mark(&mut self, mark: Mark, ball_mm: [f64; 2]) {
        if mark == Mark::KickOff && self.marks.is_empty() {
            self.now_ms = 0;
        }
        self.marks.push((self.now_ms, mark));
        self.in_play = !matches!(mark, Mark::Goal(_));
        if let Mark::Goal(robot) = mark {
            let pushed = self.push[robot].map(|(from, _)| from);
            let flown = self.flight.filter(|(by, _)| *by == robot).map(|(_, from)| from);
            if let Some(from_mm) = flown.or(pushed) {
                self.shots.push(Shot { robot, from_mm, to_mm: ball_mm, goal: true });
            }
        }
        self.flight = None;
        self.push = [None; 2];
        self.last_touch = None;
    }

    /// A millisecond passes.
    pub fn step(&mut self, now: &Instant) {
        self.now_ms += 1;
        self.possess(now);
        self.follow_shot(now);
        for robot in [0, 1] {
            if now.touches[robot] {
                self.last_touch = Some(robot);
                let goes_on = self.push[robot].filter(|(_, last)| last + PUSH_MS >= self.now_ms);
                let from = goes_on.map_or(now.ball_mm, |(from, _)| from);
                self.push[robot] = Some((from, self.now_ms));
            }
        }
        if self.in_play {
            self.find_shot(now);
        }
        if self.now_ms.is_multiple_of(MOMENT_MS) {
            let [a, b] = std::mem::take(&mut self.moment);
            let most = if a >= b { (0, a) } else { (1, b) };
            self.line.push((most.1 > MOMENT_MS / 4).then_some(most.0));
        }
    }

    fn possess(&mut self, now: &Instant) {
        let nearer = usize::from(now.apart_mm[1] < now.apart_mm[0]);
        let has = self.in_play
            && now.apart_mm[nearer] < HAS_MM
            && (self.last_touch.is_none_or(|last| last == nearer) || now.touches[nearer]);
        if !has {
            return;
        }
        self.possession_ms[nearer] += 1;
        self.moment[nearer] += 1;
        let index = |v: f64, cells: usize| {
            ((v / CELL_MM + cells as f64 / 2.0).max(0.0) as usize).min(cells - 1)
        };
        let cell = index(now.ball_mm[1], ROWS) * COLUMNS + index(now.ball_mm[0], COLUMNS);
        self.heat[nearer][cell] += 1;
    }

    fn follow_shot(&mut self, now: &Instant) {
        let Some((robot, from_mm)) = self.flight else { return };
        let [vx, vy] = now.ball_mm_s;
        if now.touches.contains(&true) || libm::hypot(vx, vy) < OVER_MM_S {
            self.shots.push(Shot { robot, from_mm, to_mm: now.ball_mm, goal: false });
            self.flight = None;
        }
    }

    /// A ball that has left a robot, and would roll into the other's goal.
    fn find_shot(&mut self, now: &Instant) {
        if self.flight.is_some() {
            return;
        }
        for robot in [0, 1] {
            let Some((from, last)) = self.push[robot] else { continue };
            let toward = if robot == 0 { 1.0 } else { -1.0 };
            let [vx, vy] = now.ball_mm_s;
            let speed = libm::hypot(vx, vy);
            if last + LEFT_MS != self.now_ms || speed < SHOT_MM_S || vx * toward <= 0.0 {
                continue;
            }
            let way = p::HALF_LENGTH_MM - now.ball_mm[0] * toward;
            let at = now.ball_mm[1] + vy / (vx * toward) * way;
            let reach = speed * speed / (2.0 * self.roll_mm_s2);
            let mouth = p::GOAL_HALF_WIDTH_MM - p::BALL_RADIUS_MM;
            if at.abs() < mouth && reach > way * speed / (vx * toward) {
                self.flight = Some((robot, from));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AWAY: Instant = Instant {
        ball_mm: [0.0; 2],
        ball_mm_s: [0.0; 2],
        apart_mm: [500.0; 2],
        touches: [false; 2],
    };

    fn run(chronicle: &mut Chronicle, ms: u32, now: &Instant) {
        for _ in 0..ms {
            chronicle.step(now);
        }
    }

    #[test]
    fn who_is_at_the_ball_has_it_there() {
        let mut chronicle = Chronicle::new(&Materials::default());
        let at = Instant { apart_mm: [64.0, 300.0], touches: [true, false], ..AWAY };
        run(&mut chronicle, 500, &at);
        run(&mut chronicle, 500, &AWAY);
        assert_eq!(chronicle.possession_ms, [500, 0]);
        assert_eq!(chronicle.heat[0][ROWS / 2 * COLUMNS + COLUMNS / 2], 500);
        assert_eq!(chronicle.line, [Some(0), Some(0), None, None]);
    }

    #[test]
    fn a_ball_sent_into_the_goal_s_direction_is_a_shot_and_one_beside_it_is_none() {
        for (vy, shots) in [(0.0, 1), (300.0, 0)] {
            let mut chronicle = Chronicle::new(&Materials::default());
            let push = Instant { apart_mm: [64.0, 300.0], touches: [true, false], ..AWAY };
            run(&mut chronicle, 100, &push);
            run(&mut chronicle, 200, &Instant { ball_mm_s: [450.0, vy], ..AWAY });
            run(&mut chronicle, 1, &Instant { ball_mm: [400.0, 0.0], ..AWAY });
            assert_eq!(chronicle.shots.len(), shots, "{vy}");
        }
    }

    #[test]
    fn a_goal_that_was_pushed_in_is_a_shot_from_where_the_push_began() {
        let mut chronicle = Chronicle::new(&Materials::default());
        let push = |x| Instant {
            ball_mm: [x, 0.0],
            apart_mm: [300.0, 64.0],
            touches: [false, true],
            ..AWAY
        };
        for x in [-100.0, -300.0, -550.0] {
            run(&mut chronicle, 300, &push(x));
        }
        chronicle.mark(Mark::Goal(1), [-560.0, 0.0]);
        let shot = Shot { robot: 1, from_mm: [-100.0, 0.0], to_mm: [-560.0, 0.0], goal: true };
        assert_eq!(chronicle.shots, [shot]);
    }
}
