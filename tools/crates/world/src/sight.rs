//! What there truly is to be seen: where an object is from a robot, and whether its eyes can see it.
//!
//! "Visible" means: wholly in the pictures of both eyes, not hidden by robot or ball, and, where the
//! FPGA searches for a disparity, within its search range. What is visible ought to be found; what is not
//! may be found or not.

use crate::camera::{BASELINE_MM, Camera, Eye, FOCAL_PX, HEIGHT, WIDTH};
use crate::physics::Pose;
use crate::pitch as p;

/// The FPGA searches disparities up to this after reset.
const SEARCH_MAX_PX: f64 = 79.0;
/// A little more is asked of the depth than that.
const DEPTH_MIN_MM: f64 = FOCAL_PX * BASELINE_MM / (SEARCH_MAX_PX - 4.0);
/// Rows 60 and 80 look at posts and opponents at about these heights.
const POST_Z_MM: f64 = 100.0;
const BODY_Z_MM: f64 = 60.0;
/// So near to the picture's border nothing is asked for: blocks are 8 pixels wide.
const BORDER_PX: f32 = 6.0;

/// An object as it truly is for a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Distance on the floor from the robot's middle to the object's.
    pub range_mm: f64,
    /// Direction, radians, left positive.
    pub bearing_rad: f64,
    /// It ought to be found.
    pub visible: bool,
    /// At least a part of it may be in one of the pictures.
    pub in_picture: bool,
    /// Column of its middle in the right picture; of both posts for a goal.
    pub x_right_px: [f64; 2],
}

/// All that a robot may see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sights {
    /// The ball.
    pub ball: Sight,
    /// The goal that the robot attacks.
    pub goal: Sight,
    /// The other robot.
    pub opponent: Sight,
}

/// Everything around a robot at `me`.
pub struct Around {
    /// The robot that looks.
    pub me: Pose,
    /// The other one.
    pub other: Pose,
    /// The ball.
    pub ball_mm: [f64; 2],
    /// Which way the robot plays.
    pub attacks: f64,
}

impl Around {
    /// What there is to be seen.
    pub fn sights(&self) -> Sights {
        Sights { ball: self.ball(), goal: self.goal(), opponent: self.opponent() }
    }

    fn cameras(&self) -> [Camera; 2] {
        [Eye::Left, Eye::Right].map(|eye| Camera::of_robot(self.me, eye))
    }

    fn place(&self, [x, y]: [f64; 2]) -> (f64, f64) {
        let (dx, dy) = (x - self.me.x_mm, y - self.me.y_mm);
        let turn = libm::atan2(dy, dx) - self.me.heading_rad;
        let (sin, cos) = libm::sincos(turn);
        (libm::hypot(dx, dy), libm::atan2(sin, cos))
    }

    /// The way to a place passes so near to an obstacle's middle; infinite if that is behind it.
    fn clearance(&self, to: [f64; 2], obstacle: [f64; 2]) -> f64 {
        let way = [to[0] - self.me.x_mm, to[1] - self.me.y_mm];
        let off = [obstacle[0] - self.me.x_mm, obstacle[1] - self.me.y_mm];
        let length = libm::hypot(way[0], way[1]).max(1.0);
        let along = (off[0] * way[0] + off[1] * way[1]) / length;
        if along < 0.0 || along > length {
            return f64::INFINITY;
        }
        ((off[0] * way[1] - off[1] * way[0]) / length).abs()
    }

    fn ball(&self) -> Sight {
        let [x, y] = self.ball_mm;
        let (range_mm, bearing_rad) = self.place(self.ball_mm);
        let centre = [x as f32, y as f32, p::BALL_RADIUS_MM as f32];
        let mut whole = true;
        let mut any = false;
        let mut column = 0.0;
        for camera in self.cameras() {
            let Some([px, py, depth]) = camera.project(centre) else {
                whole = false;
                continue;
            };
            let radius = (FOCAL_PX * p::BALL_RADIUS_MM) as f32 / depth;
            let inside =
                |v: f32, size: usize, margin: f32| v >= margin && v <= (size - 1) as f32 - margin;
            whole &= inside(px, WIDTH, radius + BORDER_PX) && inside(py, HEIGHT, radius);
            any |= inside(px, WIDTH, -radius) && inside(py, HEIGHT, -radius);
            column = f64::from(px);
        }
        let other = [self.other.x_mm, self.other.y_mm];
        let free = self.clearance(self.ball_mm, other) > p::ROBOT_RADIUS_MM + p::BALL_RADIUS_MM;
        // In a goal its post may hide it.
        let before_goal = x.abs() < p::HALF_LENGTH_MM;
        Sight {
            range_mm,
            bearing_rad,
            visible: whole && free && before_goal,
            in_picture: any,
            x_right_px: [column; 2],
        }
    }

    fn goal(&self) -> Sight {
        let x = self.attacks * p::HALF_LENGTH_MM;
        let (range_mm, bearing_rad) = self.place([x, 0.0]);
        let mut columns = [0.0; 2];
        let mut visible = true;
        let mut any = false;
        for (post, column) in columns.iter_mut().enumerate() {
            // The left post as seen by who attacks it.
            let side = if post == 0 { 1.0 } else { -1.0 };
            let at = [x, side * self.attacks * p::GOAL_HALF_WIDTH_MM];
            let seen = self.upright(at, POST_Z_MM, 0.0, column);
            let other = [self.other.x_mm, self.other.y_mm];
            visible &= seen.0 && self.clearance(at, other) > p::ROBOT_RADIUS_MM + 15.0;
            any |= seen.1;
        }
        Sight { range_mm, bearing_rad, visible, in_picture: any, x_right_px: columns }
    }

    fn opponent(&self) -> Sight {
        let at = [self.other.x_mm, self.other.y_mm];
        let (range_mm, bearing_rad) = self.place(at);
        let mut column = 0.0;
        let (whole, any) = self.upright(at, BODY_Z_MM, p::ROBOT_RADIUS_MM, &mut column);
        // A ball's top may reach up to the row that looks at opponents.
        let free = self.clearance(at, self.ball_mm) > p::ROBOT_RADIUS_MM + p::BALL_RADIUS_MM;
        Sight {
            range_mm,
            bearing_rad,
            visible: whole && free,
            in_picture: any,
            x_right_px: [column; 2],
        }
    }

    /// Whether something upright of this radius is wholly, and whether it is at all, between the left
    /// and right border of the pictures.
    fn upright(
        &self,
        at: [f64; 2],
        z_mm: f64,
        radius_mm: f64,
        column_right: &mut f64,
    ) -> (bool, bool) {
        let (mut whole, mut any) = (true, false);
        for camera in self.cameras() {
            let Some([px, _, depth]) = camera.project([at[0] as f32, at[1] as f32, z_mm as f32])
            else {
                whole = false;
                continue;
            };
            let half = (FOCAL_PX * radius_mm) as f32 / depth;
            let most = (WIDTH - 1) as f32;
            let near = f64::from(depth) - radius_mm < DEPTH_MIN_MM;
            whole &= px >= half + BORDER_PX && px <= most - half - BORDER_PX && !near;
            any |= px >= -half && px <= most + half;
            *column_right = f64::from(px);
        }
        (whole, any)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(ball_mm: [f64; 2], other_mm: [f64; 2]) -> Around {
        let other = Pose { x_mm: other_mm[0], y_mm: other_mm[1], heading_rad: 0.0 };
        Around { me: Pose::default(), other, ball_mm, attacks: 1.0 }
    }

    #[test]
    fn what_lies_ahead_is_visible_and_what_lies_behind_is_not() {
        let ahead = around([300.0, 0.0], [-300.0, 0.0]).sights();
        assert!(ahead.ball.visible && !ahead.opponent.visible && !ahead.opponent.in_picture);
        assert!((ahead.ball.range_mm - 300.0).abs() < 1e-9 && ahead.ball.bearing_rad.abs() < 1e-9);
        let behind = around([-300.0, 0.0], [300.0, 0.0]).sights();
        assert!(!behind.ball.visible && behind.opponent.visible && !behind.ball.in_picture);
    }

    #[test]
    fn a_robot_hides_the_ball_behind_it() {
        assert!(!around([400.0, 0.0], [300.0, 10.0]).sights().ball.visible);
        assert!(around([300.0, 10.0], [400.0, 120.0]).sights().ball.visible);
    }

    #[test]
    fn a_goal_is_visible_with_both_posts_only() {
        assert!(around([0.0, 300.0], [-300.0, 0.0]).sights().goal.visible);
        let near = Around {
            me: Pose { x_mm: 250.0, ..Pose::default() },
            ..around([0.0, 300.0], [-300.0, 0.0])
        };
        assert!(!near.sights().goal.visible && near.sights().goal.in_picture);
    }

    #[test]
    fn columns_are_those_of_the_right_picture() {
        // 25 mm left of the right lens, 300 mm ahead: left of the middle.
        let ball = around([300.0, 0.0], [-300.0, 0.0]).sights().ball;
        assert!(ball.x_right_px[0] < 140.0 && ball.x_right_px[0] > 120.0, "{ball:?}");
    }
}
