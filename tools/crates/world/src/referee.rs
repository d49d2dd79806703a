//! The referee: where everything stands at kick-off, and what counts as a goal.
//!
//! | rule | value | provenance |
//! |---|---|---|
//! | our robot | anywhere in its own half, any heading | decided here; the league lets the teams place it |
//! | ball | anywhere, 90 mm from walls, 120 mm from both robots | decided here, so that it can be reached |
//! | opponent | anywhere in its own half | decided here |
//! | goal | the whole ball is over the line | football's rule; the league's page is not readable there |

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;
use sim::device_rng;

use crate::physics::Pose;
use crate::pitch::{
    BALL_RADIUS_MM, CORNER_CUT_MM, GOAL_HALF_WIDTH_MM, HALF_LENGTH_MM, HALF_WIDTH_MM,
    ROBOT_RADIUS_MM,
};

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
    /// Ours, then the opponent.
    pub robots: [Pose; 2],
    /// Centre of the ball.
    pub ball_mm: [f64; 2],
}

/// Draw a kick-off.
pub fn kick_off(seed: u64) -> KickOff {
    let rng = &mut device_rng(seed, "kick-off");
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

/// Who gets a goal for a ball that lies at `ball_mm`: `Some(0)` is our robot, which attacks +x.
pub fn scorer(ball_mm: [f64; 2]) -> Option<usize> {
    let over = ball_mm[0].abs() - HALF_LENGTH_MM >= BALL_RADIUS_MM;
    if !over || ball_mm[1].abs() >= GOAL_HALF_WIDTH_MM {
        return None;
    }
    Some(if ball_mm[0] > 0.0 { 0 } else { 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kick_off_is_playable() {
        for seed in 0..2000 {
            let KickOff { robots: [ours, opponent], ball_mm } = kick_off(seed);
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
    fn seeds_draw_different_kick_offs_and_the_same_seed_the_same() {
        assert_eq!(kick_off(1), kick_off(1));
        assert_ne!(kick_off(1), kick_off(2));
    }

    #[test]
    fn only_the_whole_ball_over_the_line_is_a_goal() {
        assert_eq!(scorer([558.4, 0.0]), None);
        assert_eq!(scorer([558.5, 0.0]), Some(0));
        assert_eq!(scorer([-558.5, 100.0]), Some(1));
        assert_eq!(scorer([558.5, 150.0]), None);
    }
}
