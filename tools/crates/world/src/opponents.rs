//! Opponents without firmware: programs that drive a robot's wheels directly, to play against.
//!
//! | opponent | knows | does |
//! |---|---|---|
//! | idle | nothing | stands where it was put |
//! | wall | where it and the ball are, [`DELAY`] late | stays before its goal, between the ball and the goal's middle |
//! | chaser | the same | runs for the ball, wherever that pushes it |
//! | striker | the same | runs for the ball; drives around it first if it would push it the wrong way |
//! | linear | where it is; the ball only by a line of 64 grey pixels | as the striker, with a ball that it has to find |
//!
//! Their speeds are assumptions: those of a match between Kheperas of that time, 60 to 80 % of what
//! ours drives. Wheels follow a program's wish with a motor's lag, and no quicker than the tyres grip.

use core::f64::consts::PI;
use std::collections::VecDeque;

use rand_pcg::Pcg64Mcg;
use sim::{MS, Ps, device_rng};

use crate::camera::Camera;
use crate::noise::normal;
use crate::physics::Pose;
use crate::pitch as p;
use crate::render::{self, Scene};
use crate::shade::Rgb;

/// How late an opponent that sees from above knows of what happens: two frames and a radio message.
pub const DELAY: Ps = 100 * MS;
/// Opponents decide so often, and the line camera looks so often (the K213's 50 Hz at indoor light
/// is an assumption; its manual gives the scan as adapting to the light).
const PERIOD: Ps = 20 * MS;
/// Speed of all that run for the ball.
const CHASE_MM_S: f64 = 220.0;
/// Speed of the wall along its line.
const WALL_MM_S: f64 = 180.0;
/// The wall stands so far before its goal line, and strays so far from the goal's middle.
const WALL_BEFORE_MM: f64 = 50.0;
const WALL_REACH_MM: f64 = 110.0;
/// Time constant of the motors, as in the emulated base.
const MOTOR_LAG_S: f64 = 0.05;
/// Turn at the wheels' rims for an error of heading of a radian, and the most of it.
const TURN_MM_S: f64 = 130.0;
const TURN_MOST_MM_S: f64 = 110.0;

/// The K213 vision turret (K-Team, user manual 1.2): 64 grey cells of 8 bits over 36 degrees.
pub const LINE_PIXELS: usize = 64;
const LINE_VIEW_RAD: f64 = 36.0 * PI / 180.0;
/// Height of its lens on the base (assumption; the lens looks level).
const LINE_HEIGHT_MM: f64 = 50.0;
/// Noise of its cells, of 256 (assumption).
const LINE_NOISE: f64 = 2.0;
/// Half of the ball's width at the lens' height.
const CHORD_MM: f64 = 29.0;
/// A ball so near fills a good part of the line; further away it is lost among stripes and lines.
const LINE_RANGE_MM: [f64; 2] = [60.0, 700.0];
/// Without a sight of the ball for so long it turns to look for it.
const FORGET: Ps = 800 * MS;

/// Who plays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Stands.
    #[default]
    Idle,
    /// Defends its goal line.
    Wall,
    /// Runs for the ball.
    Chaser,
    /// Runs for the ball so as to push it towards the other goal.
    Striker,
    /// Runs for the ball that its 64 grey pixels show.
    Linear,
}

/// What there is to know, in the frame of the one who plays: +x is where it attacks.
#[derive(Clone, Copy, Debug)]
struct View {
    pose: Pose,
    ball_mm: [f64; 2],
}

/// What an opponent may be told about the world.
pub struct Surroundings<'a> {
    /// Its own pose on the pitch.
    pub pose: Pose,
    /// The ball.
    pub ball_mm: [f64; 2],
    /// +1 if it attacks the goal at +x, -1 otherwise.
    pub attacks: f64,
    /// What a camera on it would see.
    pub scene: &'a Scene,
}

/// An opponent.
#[derive(Clone)]
pub struct Opponent {
    kind: Kind,
    playing: bool,
    ticks: u64,
    past: VecDeque<View>,
    /// Where it takes the ball to be, and since when it has not seen it there.
    ball_mm: Option<[f64; 2]>,
    unseen: Ps,
    /// Which way it turns while it searches.
    turn: f64,
    wanted_mm_s: [f64; 2],
    wheels_mm_s: [f64; 2],
    rng: Pcg64Mcg,
}

impl Opponent {
    /// In the match of that seed.
    pub fn new(kind: Kind, seed: u64) -> Self {
        Self {
            kind,
            playing: false,
            ticks: 0,
            past: VecDeque::new(),
            ball_mm: None,
            unseen: 0,
            turn: 1.0,
            wanted_mm_s: [0.0; 2],
            wheels_mm_s: [0.0; 2],
            rng: device_rng(seed, "opponent"),
        }
    }

    /// The referee starts the game.
    pub fn kick_off(&mut self) {
        let fresh = Self { rng: self.rng.clone(), ..Self::new(self.kind, 0) };
        *self = Self { playing: true, wheels_mm_s: self.wheels_mm_s, ..fresh };
    }

    /// The referee stops it.
    pub fn halt(&mut self) {
        self.playing = false;
        self.wanted_mm_s = [0.0; 2];
    }

    /// A millisecond: the rims' speeds of left and right wheel.
    pub fn step(&mut self, around: &Surroundings) -> [f64; 2] {
        if self.playing && self.kind != Kind::Idle {
            let now = View::of(around);
            self.past.push_back(now);
            let late = self.past.len() as u64 > DELAY / MS;
            let known = if late { self.past.pop_front() } else { None }.unwrap_or(now);
            if self.ticks.is_multiple_of(PERIOD / MS) {
                self.wanted_mm_s = self.decide(&known, around);
            }
            self.ticks += 1;
        }
        for (wheel, wanted) in self.wheels_mm_s.iter_mut().zip(self.wanted_mm_s) {
            *wheel += (wanted - *wheel) * (MS as f64 / sim::SECOND as f64) / MOTOR_LAG_S;
            if wheel.abs() < 0.5 && wanted == 0.0 {
                *wheel = 0.0;
            }
        }
        self.wheels_mm_s
    }

    fn decide(&mut self, known: &View, around: &Surroundings) -> [f64; 2] {
        match self.kind {
            Kind::Idle => [0.0; 2],
            Kind::Wall => keep_goal(known),
            Kind::Chaser => drive_to(&known.pose, known.ball_mm, CHASE_MM_S),
            Kind::Striker => strike(&known.pose, known.ball_mm),
            Kind::Linear => self.chase_by_line(around),
        }
    }

    /// Look along the line, believe, chase; turn where the ball is not known.
    fn chase_by_line(&mut self, around: &Surroundings) -> [f64; 2] {
        let pose = View::of(around).pose;
        let grey = line(around, &mut self.rng);
        self.unseen += PERIOD;
        if let Some((bearing, range_mm)) = ball_in(&grey) {
            let (sin, cos) = libm::sincos(pose.heading_rad + bearing);
            self.ball_mm = Some([pose.x_mm + range_mm * cos, pose.y_mm + range_mm * sin]);
            self.unseen = 0;
            self.turn = if bearing < 0.0 { -1.0 } else { 1.0 };
        }
        match self.ball_mm {
            Some(ball) if self.unseen < FORGET => strike(&pose, ball),
            _ => {
                self.ball_mm = None;
                [-50.0 * self.turn, 50.0 * self.turn]
            }
        }
    }
}

impl View {
    fn of(around: &Surroundings) -> Self {
        let Pose { x_mm, y_mm, heading_rad } = around.pose;
        let turned = if around.attacks > 0.0 { 0.0 } else { PI };
        Self {
            pose: Pose {
                x_mm: x_mm * around.attacks,
                y_mm: y_mm * around.attacks,
                heading_rad: heading_rad + turned,
            },
            ball_mm: around.ball_mm.map(|v| v * around.attacks),
        }
    }
}

/// An angle in -pi..pi.
fn wrap(angle: f64) -> f64 {
    let turns = libm::floor((angle + PI) / (2.0 * PI));
    angle - turns * 2.0 * PI
}

fn direction(from: [f64; 2], to: [f64; 2]) -> f64 {
    libm::atan2(to[1] - from[1], to[0] - from[0])
}

fn place(pose: &Pose) -> [f64; 2] {
    [pose.x_mm, pose.y_mm]
}

/// Wheels that drive towards a point: turned first while it is far aside.
fn drive_to(pose: &Pose, target: [f64; 2], speed_mm_s: f64) -> [f64; 2] {
    let error = wrap(direction(place(pose), target) - pose.heading_rad);
    let turn = (error * TURN_MM_S).clamp(-TURN_MOST_MM_S, TURN_MOST_MM_S);
    let ahead = libm::cos(error).max(0.0);
    let forward = speed_mm_s * ahead * ahead;
    [forward - turn, forward + turn]
}

/// Through the ball if that moves it towards the goal; otherwise around it first.
fn strike(pose: &Pose, ball: [f64; 2]) -> [f64; 2] {
    const AROUND_MM: f64 = 130.0;
    let goal = [p::HALF_LENGTH_MM + p::GOAL_DEPTH_MM, 0.0];
    let shot = direction(ball, goal);
    let to_ball = direction(place(pose), ball);
    let off = wrap(to_ball - shot);
    if off.abs() < PI / 4.0 {
        return drive_to(pose, ball, CHASE_MM_S);
    }
    // On a circle around the ball, a step further towards the place behind it.
    let step = off.abs().min(PI / 3.0);
    let (sin, cos) = libm::sincos(to_ball + PI - libm::copysign(step, off));
    let (most_x, most_y) =
        (p::HALF_LENGTH_MM - p::ROBOT_RADIUS_MM - 5.0, p::HALF_WIDTH_MM - p::ROBOT_RADIUS_MM - 5.0);
    let target = [
        (ball[0] + AROUND_MM * cos).clamp(-most_x, most_x),
        (ball[1] + AROUND_MM * sin).clamp(-most_y, most_y),
    ];
    drive_to(pose, target, CHASE_MM_S)
}

/// Before the own goal, across it, between the ball and the goal's middle.
fn keep_goal(known: &View) -> [f64; 2] {
    let pose = &known.pose;
    let line_x = -p::HALF_LENGTH_MM + WALL_BEFORE_MM;
    let toward = known.ball_mm[1].clamp(-WALL_REACH_MM, WALL_REACH_MM);
    if (pose.x_mm - line_x).abs() > 15.0 {
        return drive_to(pose, [line_x, pose.y_mm.clamp(-WALL_REACH_MM, WALL_REACH_MM)], WALL_MM_S);
    }
    // Along the line, forwards or backwards, whichever way it happens to look; back to the line on
    // the way.
    let up = if libm::sin(pose.heading_rad) >= 0.0 { 1.0 } else { -1.0 };
    let lean = ((pose.x_mm - line_x) / 60.0).clamp(-0.4, 0.4);
    let way = toward - pose.y_mm;
    let forward = if way.abs() < 6.0 { 0.0 } else { (way * 6.0).clamp(-WALL_MM_S, WALL_MM_S) * up };
    let heading = up * (PI / 2.0 + lean * forward.signum());
    let error = wrap(heading - pose.heading_rad);
    let turn = (error * TURN_MM_S).clamp(-TURN_MOST_MM_S, TURN_MOST_MM_S);
    let forward = if error.abs() > 0.6 { 0.0 } else { forward };
    [forward - turn, forward + turn]
}

/// What the line camera sees, from left to right.
fn line(around: &Surroundings, rng: &mut Pcg64Mcg) -> [u8; LINE_PIXELS] {
    let camera = Camera::level(place(&around.pose), LINE_HEIGHT_MM, around.pose.heading_rad);
    let colours: Vec<Rgb> = render::line(&camera, around.scene, LINE_PIXELS, LINE_VIEW_RAD);
    core::array::from_fn(|i| {
        let [r, g, b] = colours[i].map(f64::from);
        let grey = 255.0 * (0.299 * r + 0.587 * g + 0.114 * b);
        (grey + normal(rng, LINE_NOISE)).clamp(0.0, 255.0) as u8
    })
}

/// Bearing (left positive) and range of what may be the ball: the widest part that is brighter than
/// the walls, if its width is that of a ball within range.
fn ball_in(grey: &[u8; LINE_PIXELS]) -> Option<(f64, f64)> {
    /// Walls lie at 100, the ball at 130 to 220.
    const BRIGHT: u8 = 122;
    let mut best: Option<(usize, usize)> = None;
    let mut start = None;
    for (i, value) in grey.iter().chain(&[0]).enumerate() {
        match (*value > BRIGHT, start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                start = None;
                if best.is_none_or(|(a, b)| i - from > b - a) {
                    best = Some((from, i));
                }
            }
            _ => {}
        }
    }
    let (from, to) = best?;
    let per_pixel = LINE_VIEW_RAD / LINE_PIXELS as f64;
    let width = (to - from) as f64 * per_pixel;
    let range_mm = CHORD_MM / libm::tan(width / 2.0);
    if !(LINE_RANGE_MM[0]..LINE_RANGE_MM[1]).contains(&range_mm) {
        return None;
    }
    let middle = (from + to) as f64 / 2.0;
    Some(((LINE_PIXELS as f64 / 2.0 - middle) * per_pixel, range_mm))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::materials::Materials;
    use crate::noise::Noise;
    use crate::physics::Physics;
    use crate::render::BallColour;

    /// Robot 1 attacks -x and plays alone with the ball for so long.
    fn play(kind: Kind, start: Pose, ball_mm: [f64; 2], ms: u32) -> Physics {
        let aside = Pose { x_mm: 0.0, y_mm: -300.0, heading_rad: 0.0 };
        let mut physics =
            Physics::new([aside, start], ball_mm, Materials::default(), Noise::None, 1);
        let mut opponent = Opponent::new(kind, 1);
        opponent.kick_off();
        for _ in 0..ms {
            let scene = Scene {
                ball_mm: Some(physics.ball_mm()),
                ball_colour: BallColour::Yellow,
                robot: Some(physics.robot(0)),
            };
            let wheels = opponent.step(&Surroundings {
                pose: physics.robot(1),
                ball_mm: physics.ball_mm(),
                attacks: -1.0,
                scene: &scene,
            });
            physics.step([[0.0; 2], wheels]);
            if crate::referee::goal_at(physics.ball_mm()).is_some() {
                break;
            }
        }
        physics
    }

    #[test]
    fn a_chaser_takes_the_ball_with_it_the_way_it_runs() {
        let start = Pose { x_mm: 300.0, y_mm: 0.0, heading_rad: 1.0 };
        let physics = play(Kind::Chaser, start, [100.0, 30.0], 4000);
        assert!(physics.ball_mm()[0] < -100.0, "{:?}", physics.ball_mm());
    }

    #[test]
    fn who_strikes_scores_alone_from_either_side_of_the_ball() {
        for kind in [Kind::Striker, Kind::Linear] {
            for (x_mm, heading_rad) in [(300.0, PI), (-350.0, 0.0)] {
                let start = Pose { x_mm, y_mm: 60.0, heading_rad };
                let physics = play(kind, start, [20.0, 30.0], 40_000);
                let goal = crate::referee::goal_at(physics.ball_mm());
                assert_eq!(goal, Some(-1.0), "{kind:?} from {x_mm}: {:?}", physics.ball_mm());
            }
        }
    }

    #[test]
    fn the_wall_stands_before_its_goal_between_ball_and_goal() {
        for y in [-250.0, -60.0, 0.0, 80.0, 300.0] {
            let start = Pose { x_mm: 100.0, y_mm: 200.0, heading_rad: 1.0 };
            let pose = play(Kind::Wall, start, [-200.0, y], 8000).robot(1);
            assert!((pose.x_mm - p::HALF_LENGTH_MM + WALL_BEFORE_MM).abs() < 25.0, "{pose:?}");
            assert!((pose.y_mm - y.clamp(-WALL_REACH_MM, WALL_REACH_MM)).abs() < 12.0, "{pose:?}");
        }
    }

    #[test]
    fn the_line_camera_finds_a_ball_and_its_distance() {
        for range in [100.0, 200.0, 350.0, 500.0] {
            for bearing in [-0.1_f64, 0.0, 0.05, 0.2] {
                // All of it must be in view.
                let half = libm::asin(CHORD_MM / range);
                if bearing.abs() + half > LINE_VIEW_RAD / 2.0 {
                    continue;
                }
                let (sin, cos) = libm::sincos(bearing);
                let ball = [-200.0 + range * cos, range * sin];
                let scene =
                    Scene { ball_mm: Some(ball), ball_colour: BallColour::Yellow, robot: None };
                let around = Surroundings {
                    pose: Pose { x_mm: -200.0, y_mm: 0.0, heading_rad: 0.0 },
                    ball_mm: ball,
                    attacks: 1.0,
                    scene: &scene,
                };
                let grey = line(&around, &mut device_rng(1, "test"));
                let (found, distance) = ball_in(&grey).expect("a ball");
                assert!((found - bearing).abs() < 0.03, "{range} {bearing}: {found}, {grey:?}");
                assert!((distance / range - 1.0).abs() < 0.2, "{range} {bearing}: {distance}");
            }
        }
    }

    #[test]
    fn the_line_camera_sees_no_ball_where_there_is_none() {
        let scene = Scene { ball_mm: None, ball_colour: BallColour::Yellow, robot: None };
        for step in 0..24 {
            let around = Surroundings {
                pose: Pose { x_mm: 0.0, y_mm: 0.0, heading_rad: f64::from(step) * PI / 12.0 },
                ball_mm: [0.0; 2],
                attacks: 1.0,
                scene: &scene,
            };
            assert_eq!(ball_in(&line(&around, &mut device_rng(1, "test"))), None, "step {step}");
        }
    }
}
