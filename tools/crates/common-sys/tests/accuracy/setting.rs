//! What stands where, drawn from a seed, and what each eye ought to see of it.

use world::camera::{BASELINE_MM, Camera, FOCAL_PX, HEIGHT, WIDTH};
use world::physics::Pose;
use world::pitch as p;
use world::render::{BallColour, Scene};

/// A small generator of random numbers (splitmix64): the same scenes everywhere.
pub struct Random(u64);

impl Random {
    /// Of a seed and of what it is for.
    pub fn new(seed: u64, purpose: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ purpose.wrapping_mul(0xD134_2543_DE82_EF95))
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In low..high.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Nearly normally distributed, mean 0 and deviation 1: the sum of four uniform numbers.
    pub fn normal(&mut self) -> f64 {
        let bits = self.bits();
        let sum: u64 = (0..4).map(|i| (bits >> (16 * i)) & 0xFFFF).sum();
        (sum as f64 / 65536.0 - 2.0) * 1.732_050_8
    }
}

/// Whether a thing should be reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expect {
    /// Plainly there, in both eyes.
    Yes,
    /// Not there.
    No,
    /// Cut, hidden in part or too near: either is right.
    Free,
}

/// What is true of a thing.
pub struct Truth {
    pub expect: Expect,
    pub disparity_px: f64,
    pub range_mm: f64,
}

/// What is true of the foot of the wall in one column.
pub struct Foot {
    pub expect: Expect,
    pub row: f64,
}

/// The goal before the robot: its edges as they lie in the picture, None if there is no goal.
pub struct Goal {
    pub expect: Expect,
    pub edges: [Option<Truth>; 2],
}

/// Something yellow or white beyond the wall: ranges of bearing (rad, from the robot) and of height
/// above the wall's top (share of the picture), and whether it is yellow.
#[derive(Clone, Copy)]
pub struct Distractor {
    pub bearing: [f64; 2],
    pub yellow: bool,
}

pub struct Setting {
    pub robot: Pose,
    pub ball_mm: Option<[f64; 2]>,
    pub opponent: Option<Pose>,
    pub distractor: Option<Distractor>,
}

const NEAR_END_PX: f64 = 78.0;
const BALL_HEIGHT_MM: f32 = 33.5;
/// Rows that the detectors use.
const GOAL_ROW: f64 = 60.0;
const OPPONENT_ROW: f64 = 80.0;

/// Columns that something covers in an eye, and its depth.
#[derive(Clone, Copy)]
struct Cover {
    first: f64,
    last: f64,
    depth_mm: f64,
}

impl Cover {
    fn overlaps(&self, first: f64, last: f64, margin: f64) -> bool {
        self.first - margin < last && first < self.last + margin
    }
}

fn clear_of(place: [f64; 2], other: [f64; 2], distance_mm: f64) -> bool {
    libm::hypot(place[0] - other[0], place[1] - other[1]) > distance_mm
}

fn on_pitch(place: [f64; 2], margin_mm: f64) -> bool {
    let (x, y) = (place[0].abs(), place[1].abs());
    x < p::HALF_LENGTH_MM - margin_mm
        && y < p::HALF_WIDTH_MM - margin_mm
        && x + y < p::HALF_LENGTH_MM + p::HALF_WIDTH_MM - p::CORNER_CUT_MM - 1.42 * margin_mm
}

/// A place before the robot, within its sight or nearly, and on the pitch; None after some tries.
fn place_ahead(random: &mut Random, robot: Pose, margin_mm: f64) -> Option<[f64; 2]> {
    (0..40).find_map(|_| {
        let range = random.between(120.0, 1000.0);
        let bearing = robot.heading_rad + random.between(-0.5, 0.5);
        let place =
            [robot.x_mm + range * libm::cos(bearing), robot.y_mm + range * libm::sin(bearing)];
        on_pitch(place, margin_mm).then_some(place)
    })
}

impl Setting {
    /// Everything where the seed puts it: ball and opponent before the robot in three of four.
    pub fn draw(seed: u64) -> Self {
        let random = &mut Random::new(seed, 1);
        let robot = Pose {
            x_mm: random.between(-470.0, 470.0),
            y_mm: random.between(-290.0, 290.0),
            heading_rad: random.between(-core::f64::consts::PI, core::f64::consts::PI),
        };
        let here = [robot.x_mm, robot.y_mm];
        let with_ball = random.unit() < 0.75;
        let ball_mm = if with_ball { place_ahead(random, robot, 34.0) } else { None };
        let with_opponent = random.unit() < 0.75;
        let opponent = if with_opponent { place_ahead(random, robot, 31.0) } else { None };
        let opponent = opponent
            .filter(|at| {
                clear_of(*at, here, 80.0) && ball_mm.is_none_or(|b| clear_of(*at, b, 65.0))
            })
            .map(|at| Pose { x_mm: at[0], y_mm: at[1], heading_rad: random.between(0.0, 6.0) });
        let middle = random.between(-0.4, 0.4);
        let half = random.between(0.02, 0.09);
        let yellow = seed.is_multiple_of(2);
        let distractor = (random.unit() < 0.5)
            .then_some(Distractor { bearing: [middle - half, middle + half], yellow });
        Self { robot, ball_mm, opponent, distractor }
    }

    pub fn scene(&self) -> Scene {
        Scene { ball_mm: self.ball_mm, ball_colour: BallColour::Yellow, robot: self.opponent }
    }

    /// Left and right camera.
    pub fn cameras(&self) -> [Camera; 2] {
        [world::camera::Eye::Left, world::camera::Eye::Right]
            .map(|eye| Camera::of_robot(self.robot, eye))
    }

    fn range_mm(&self, x: f64, y: f64) -> f64 {
        libm::hypot(x - self.robot.x_mm, y - self.robot.y_mm)
    }

    /// x, y and depth in the left and in the right eye, None if it is behind them.
    fn project(&self, x: f64, y: f64, z: f64) -> Option<[[f64; 3]; 2]> {
        let [left, right] =
            self.cameras().map(|camera| camera.project([x as f32, y as f32, z as f32]));
        Some([left?.map(f64::from), right?.map(f64::from)])
    }

    /// Height at which a row of the picture meets a vertical line at this depth: on the axis of the
    /// picture, which is near enough for what is asked here.
    fn height_at_row(&self, x: f64, y: f64, row: f64) -> Option<f64> {
        let (mut low, mut high) = (-200.0, 400.0);
        for _ in 0..40 {
            let middle = (low + high) / 2.0;
            // Higher things appear further up.
            if self.project(x, y, middle)?[1][1] > row {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some((low + high) / 2.0)
    }

    fn opponent_cover(&self) -> Option<[Cover; 2]> {
        let robot = self.opponent?;
        let eyes = self.project(robot.x_mm, robot.y_mm, 60.0)?;
        Some(eyes.map(|[x, _, depth]| {
            let half = 1.1 * FOCAL_PX * p::ROBOT_RADIUS_MM / (depth - p::ROBOT_RADIUS_MM).max(1.0);
            Cover { first: x - half, last: x + half, depth_mm: depth }
        }))
    }

    fn ball_cover(&self) -> Option<[Cover; 2]> {
        let [x, y] = self.ball_mm?;
        let eyes = self.project(x, y, f64::from(BALL_HEIGHT_MM))?;
        Some(eyes.map(|[x, _, depth]| {
            let half = 1.05 * FOCAL_PX * p::BALL_RADIUS_MM / depth;
            Cover { first: x - half, last: x + half, depth_mm: depth }
        }))
    }

    pub fn ball(&self) -> Truth {
        let nothing = Truth { expect: Expect::No, disparity_px: 0.0, range_mm: 0.0 };
        let (Some([x, y]), Some(cover)) = (self.ball_mm, self.ball_cover()) else { return nothing };
        let Some(eyes) = self.project(x, y, f64::from(BALL_HEIGHT_MM)) else { return nothing };
        let disparity_px = FOCAL_PX * BASELINE_MM / eyes[1][2];
        let edge = (WIDTH - 1) as f64;
        let outside = cover.iter().all(|c| c.last < -3.0 || c.first > edge + 3.0);
        let radius = FOCAL_PX * p::BALL_RADIUS_MM / eyes[1][2];
        let whole = cover.iter().all(|c| c.first > 1.0 && c.last < edge - 1.0)
            && eyes[1][1] + radius < HEIGHT as f64 - 3.0;
        let hidden = self.opponent_cover().is_some_and(|opponent| {
            (0..2).any(|eye| {
                opponent[eye].depth_mm < cover[eye].depth_mm
                    && opponent[eye].overlaps(cover[eye].first, cover[eye].last, 0.0)
            })
        });
        let expect = match () {
            () if outside => Expect::No,
            () if whole && !hidden && disparity_px < NEAR_END_PX => Expect::Yes,
            () => Expect::Free,
        };
        Truth { expect, disparity_px, range_mm: self.range_mm(x, y) }
    }

    pub fn opponent(&self) -> Truth {
        let nothing = Truth { expect: Expect::No, disparity_px: 0.0, range_mm: 0.0 };
        let (Some(robot), Some(cover)) = (self.opponent, self.opponent_cover()) else {
            return nothing;
        };
        let Some(height) = self.height_at_row(robot.x_mm, robot.y_mm, OPPONENT_ROW) else {
            return nothing;
        };
        let Some(eyes) = self.project(robot.x_mm, robot.y_mm, height) else { return nothing };
        let range_mm = self.range_mm(robot.x_mm, robot.y_mm);
        // The nearest surface is a radius before the axis.
        let disparity_px =
            FOCAL_PX * BASELINE_MM / eyes[1][2] * range_mm / (range_mm - p::ROBOT_RADIUS_MM);
        let edge = (WIDTH - 1) as f64;
        let outside = cover.iter().all(|c| c.last < -2.0 || c.first > edge + 2.0);
        let whole = cover.iter().all(|c| c.first > 1.0 && c.last < edge - 1.0);
        let hidden = self.ball_cover().is_some_and(|ball| {
            (0..2).any(|eye| {
                ball[eye].depth_mm < cover[eye].depth_mm
                    && ball[eye].overlaps(cover[eye].first, cover[eye].last, 2.0)
            })
        });
        // The dress ends 8 mm below the top.
        let dressed = height < p::ROBOT_HEIGHT_MM - 14.0;
        let expect = match () {
            () if outside => Expect::No,
            () if whole && !hidden && dressed && disparity_px < NEAR_END_PX => Expect::Yes,
            () => Expect::Free,
        };
        Truth { expect, disparity_px, range_mm }
    }

    /// One edge of a goal: its column in the right eye and what is true of it.
    fn goal_edge(&self, x: f64, y: f64) -> Option<(f64, Truth)> {
        let height = self.height_at_row(x, y, GOAL_ROW)?;
        let eyes = self.project(x, y, height)?;
        let disparity_px = FOCAL_PX * BASELINE_MM / eyes[1][2];
        let inside = eyes.iter().all(|[x, ..]| (8.0..(WIDTH - 8) as f64).contains(x));
        let hidden = self.opponent_cover().is_some_and(|opponent| {
            // Room for the black and for the wall beside the edge, too.
            (0..2).any(|eye| opponent[eye].overlaps(eyes[eye][0], eyes[eye][0], 22.0))
        });
        let expect = if inside && !hidden && disparity_px < NEAR_END_PX {
            Expect::Yes
        } else {
            Expect::Free
        };
        Some((eyes[1][0], Truth { expect, disparity_px, range_mm: self.range_mm(x, y) }))
    }

    pub fn goal(&self) -> Goal {
        for side in [-1.0, 1.0] {
            let x = side * p::HALF_LENGTH_MM;
            let ends = [p::GOAL_HALF_WIDTH_MM, -p::GOAL_HALF_WIDTH_MM]
                .map(|y| self.goal_edge(x, side * y));
            // Seen from the pitch, +y is left at the +x goal, and the reverse at the other.
            let outside = |column: f64| !(-12.0..=WIDTH as f64 + 12.0).contains(&column);
            let [left, right] = match ends {
                [Some(left), Some(right)] => [left, right],
                [None, None] => continue,
                [Some((column, _)), None] | [None, Some((column, _))] if outside(column) => {
                    continue;
                }
                // One post is behind the lens: seen from very near, along the wall.
                _ => return Goal { expect: Expect::Free, edges: [None, None] },
            };
            let (first, last) = (left.0, right.0);
            if last < -12.0 || first > WIDTH as f64 + 12.0 {
                continue;
            }
            let visible = last.min(WIDTH as f64) - first.max(0.0);
            // An edge is plain to see if more black lies beside it than a robot is wide.
            let plain = [&left.1, &right.1].iter().any(|edge| {
                edge.expect == Expect::Yes && visible * BASELINE_MM > 80.0 * edge.disparity_px
            });
            let expect = if plain { Expect::Yes } else { Expect::Free };
            return Goal { expect, edges: [Some(left.1), Some(right.1)] };
        }
        Goal { expect: Expect::No, edges: [None, None] }
    }

    /// Where the wall stands on the floor in the three columns of the report.
    pub fn wall_feet(&self) -> [Foot; 3] {
        let [_, camera] = self.cameras();
        [40.0_f32, 160.0, 280.0].map(|column| {
            let mut row = f64::NAN;
            for y in 64..HEIGHT {
                let ray = camera.ray(column, y as f32);
                let t = -camera.at[2] / ray[2];
                let place =
                    [f64::from(camera.at[0] + t * ray[0]), f64::from(camera.at[1] + t * ray[1])];
                if t > 0.0 && on_pitch(place, 0.0) {
                    row = y as f64;
                    break;
                }
            }
            let column = f64::from(column);
            let covers = |cover: Option<[Cover; 2]>| {
                cover.is_some_and(|c| c[1].overlaps(column, column, 6.0))
            };
            let hidden = covers(self.opponent_cover()) || covers(self.ball_cover());
            let expect = if hidden || row.is_nan() || row > (HEIGHT - 12) as f64 {
                Expect::Free
            } else {
                Expect::Yes
            };
            Foot { expect, row }
        })
    }
}
