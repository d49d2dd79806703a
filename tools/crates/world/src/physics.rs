//! Bodies that move: two robots and a ball, seen from above, 1 ms at a time.
//!
//! rapier2d finds contacts and solves them. What it does not know is added here each step: wheels,
//! which pull no harder than they grip, and the ball's rolling loss. Inside, SI units.

use rapier2d::prelude::*;

use crate::pitch::{
    BALL_MASS_KG, BALL_RADIUS_MM, ROBOT_MASS_KG, ROBOT_RADIUS_MM, WHEEL_BASE_MM, outline_mm,
};

/// A step, in seconds.
const STEP_S: f32 = 0.001;
const GRAVITY: f32 = 9.81;
/// Rubber tyres on smooth wood: coefficient of friction (assumption, 0.5 to 0.9 in tables).
const TYRE_GRIP: f32 = 0.6;
/// A tennis ball's rolling resistance on a hard floor, as part of its weight (assumption: 0.01 to 0.02;
/// felt on wood lies at the upper end).
const ROLLING_LOSS: f32 = 0.015;
/// Restitution: ITF's rebound test (254 cm to about 140 cm on concrete) gives 0.74 for a hard floor;
/// wood and a robot's plastic give less (assumption).
const WALL_RESTITUTION: f32 = 0.6;
const ROBOT_RESTITUTION: f32 = 0.3;
/// Sliding friction of the felt on a wall or a robot (assumption).
const FELT_FRICTION: f32 = 0.2;
/// A tennis ball is a hollow sphere: rolling adds 2/3 of its mass to what a push feels.
const ROLLING_INERTIA: f64 = 5.0 / 3.0;

/// Where a robot is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Of its centre.
    pub x_mm: f64,
    /// See [`Pose::x_mm`].
    pub y_mm: f64,
    /// 0 = towards +x, positive = turned left.
    pub heading_rad: f64,
}

/// Two robots and a ball.
pub struct Physics {
    world: PhysicsWorld,
    robots: [RigidBodyHandle; 2],
    ball: RigidBodyHandle,
}

impl Clone for Physics {
    fn clone(&self) -> Self {
        // The pipelines and the CCD solver hold no state between steps.
        let world = PhysicsWorld {
            gravity: self.world.gravity,
            integration_parameters: self.world.integration_parameters,
            islands: self.world.islands.clone(),
            broad_phase: self.world.broad_phase.clone(),
            narrow_phase: self.world.narrow_phase.clone(),
            bodies: self.world.bodies.clone(),
            colliders: self.world.colliders.clone(),
            impulse_joints: self.world.impulse_joints.clone(),
            multibody_joints: self.world.multibody_joints.clone(),
            soft_bodies: self.world.soft_bodies.clone(),
            ..PhysicsWorld::default()
        };
        Self { world, robots: self.robots, ball: self.ball }
    }
}

fn metres(mm: f64) -> f32 {
    (mm / 1000.0) as f32
}

fn point(x_mm: f64, y_mm: f64) -> Vector {
    Vector::new(metres(x_mm), metres(y_mm))
}

impl Physics {
    /// Everything at rest.
    pub fn new(robots: [Pose; 2], ball_mm: [f64; 2]) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        world.integration_parameters.dt = STEP_S;
        world.integration_parameters.length_unit = 0.05;
        add_walls(&mut world);
        let robots = robots.map(|pose| add_robot(&mut world, pose));
        let ball = add_ball(&mut world, ball_mm);
        Self { world, robots, ball }
    }

    /// One millisecond, with these speeds of left and right wheel in mm/s for both robots.
    pub fn step(&mut self, wheels_mm_s: [[f64; 2]; 2]) {
        for (robot, wheels) in self.robots.into_iter().zip(wheels_mm_s) {
            drive(&mut self.world.bodies[robot], wheels);
        }
        roll(&mut self.world.bodies[self.ball]);
        self.world.step();
    }

    /// Where robot 0 or 1 is.
    pub fn robot(&self, index: usize) -> Pose {
        let body = &self.world.bodies[self.robots[index]];
        let at = body.translation();
        Pose {
            x_mm: f64::from(at.x) * 1000.0,
            y_mm: f64::from(at.y) * 1000.0,
            heading_rad: f64::from(body.rotation().angle()),
        }
    }

    /// Centre of the ball.
    pub fn ball_mm(&self) -> [f64; 2] {
        let at = self.world.bodies[self.ball].translation();
        [f64::from(at.x) * 1000.0, f64::from(at.y) * 1000.0]
    }
}

fn add_walls(world: &mut PhysicsWorld) {
    for ends in outline_mm() {
        let [from, to] = ends.map(|[x, y]| point(x, y));
        let wall = ColliderBuilder::segment(from, to)
            .friction(FELT_FRICTION)
            .restitution(WALL_RESTITUTION)
            .restitution_combine_rule(CoefficientCombineRule::Min);
        world.colliders.insert(wall);
    }
}

fn add_robot(world: &mut PhysicsWorld, pose: Pose) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(point(pose.x_mm, pose.y_mm))
        .rotation(pose.heading_rad as f32)
        .can_sleep(false);
    let dress = ColliderBuilder::ball(metres(ROBOT_RADIUS_MM))
        .mass(ROBOT_MASS_KG as f32)
        .friction(FELT_FRICTION)
        .restitution(ROBOT_RESTITUTION)
        .restitution_combine_rule(CoefficientCombineRule::Min);
    world.insert(body, dress).0
}

fn add_ball(world: &mut PhysicsWorld, at_mm: [f64; 2]) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(point(at_mm[0], at_mm[1]))
        .ccd_enabled(true)
        .can_sleep(false);
    let felt = ColliderBuilder::ball(metres(BALL_RADIUS_MM))
        .mass((BALL_MASS_KG * ROLLING_INERTIA) as f32)
        .friction(FELT_FRICTION)
        .restitution(1.0)
        .restitution_combine_rule(CoefficientCombineRule::Min);
    world.insert(body, felt).0
}

/// `value` moved towards `target`, by no more than `most`.
fn approach(value: f32, target: f32, most: f32) -> f32 {
    value + (target - value).clamp(-most, most)
}

/// What two wheels do to a robot: each pulls it towards its own speed, and neither slips sideways,
/// as far as the tyres grip.
fn drive(body: &mut RigidBody, wheels_mm_s: [f64; 2]) {
    let [left, right] = wheels_mm_s.map(metres);
    let most = TYRE_GRIP * GRAVITY * STEP_S;
    let rotation = *body.rotation();
    let forward = rotation * Vector::new(1.0, 0.0);
    let sideways = rotation * Vector::new(0.0, 1.0);
    let velocity = body.linvel();
    let along = approach(velocity.dot(forward), (left + right) / 2.0, most);
    let across = approach(velocity.dot(sideways), 0.0, most);
    body.set_linvel(forward * along + sideways * across, true);

    // The same grip at half a wheel base from the middle turns a disc of radius r: I = m r^2 / 2.
    let half_base = metres(WHEEL_BASE_MM) / 2.0;
    let radius = metres(ROBOT_RADIUS_MM);
    let most_turn = 2.0 * most * half_base / (radius * radius);
    let turn = (right - left) / metres(WHEEL_BASE_MM);
    body.set_angvel(approach(body.angvel(), turn, most_turn), true);
}

/// Rolling takes a constant part of the weight from the ball's motion.
fn roll(body: &mut RigidBody) {
    let velocity = body.linvel();
    let speed = velocity.length();
    let loss = ROLLING_LOSS * GRAVITY * STEP_S;
    let kept = if speed > loss { (speed - loss) / speed } else { 0.0 };
    body.set_linvel(velocity * kept, true);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pitch::{CORNER_CUT_MM, GOAL_DEPTH_MM, HALF_LENGTH_MM, HALF_WIDTH_MM};

    const ASIDE: Pose = Pose { x_mm: 300.0, y_mm: 250.0, heading_rad: 0.0 };

    fn with_ball(ball_mm: [f64; 2], velocity_mm_s: [f64; 2]) -> Physics {
        let behind = Pose { x_mm: -300.0, y_mm: -250.0, heading_rad: 0.0 };
        let mut physics = Physics::new([behind, ASIDE], ball_mm);
        let velocity = point(velocity_mm_s[0], velocity_mm_s[1]);
        physics.world.bodies[physics.ball].set_linvel(velocity, true);
        physics
    }

    fn run(physics: &mut Physics, ms: u32, wheels: [f64; 2]) {
        for _ in 0..ms {
            physics.step([wheels, [0.0; 2]]);
        }
    }

    #[test]
    fn a_ball_rolls_out_as_far_as_its_loss_allows() {
        let mut physics = with_ball([-400.0, 0.0], [300.0, 0.0]);
        run(&mut physics, 4000, [0.0; 2]);
        let rolled = physics.ball_mm()[0] + 400.0;
        let expected = 300.0 * 300.0 / (2.0 * f64::from(ROLLING_LOSS * GRAVITY) * 1000.0);
        assert!((rolled - expected).abs() < 0.02 * expected, "{rolled} mm, not {expected}");
    }

    #[test]
    fn a_ball_bounces_off_a_wall_with_its_restitution() {
        let mut physics = with_ball([0.0, 290.0], [0.0, 500.0]);
        run(&mut physics, 100, [0.0; 2]);
        let speed = -f64::from(physics.world.bodies[physics.ball].linvel().y);
        assert!((0.25..=0.31).contains(&speed), "{speed} m/s after 0.5 m/s");
    }

    #[test]
    fn a_fast_ball_stays_on_the_pitch_whatever_its_direction() {
        // Three times what a robot can drive; so far it goes in a step, into felt or wall.
        const STEP_MM: f64 = 3.0;
        for degrees in (0..360).step_by(7) {
            let (sin, cos) = libm::sincos(f64::from(degrees).to_radians());
            let mut physics = with_ball([20.0, -10.0], [3000.0 * cos, 3000.0 * sin]);
            for _ in 0..1500 {
                physics.step([[0.0; 2]; 2]);
                let [x, y] = physics.ball_mm().map(f64::abs);
                let most = HALF_LENGTH_MM + GOAL_DEPTH_MM - BALL_RADIUS_MM + STEP_MM;
                assert!(
                    x < most && y < HALF_WIDTH_MM - BALL_RADIUS_MM + STEP_MM,
                    "{degrees}: {x} {y}"
                );
            }
        }
    }

    #[test]
    fn a_robot_drives_as_fast_and_turns_as_much_as_its_wheels() {
        let mut physics = with_ball([0.0, 0.0], [0.0; 2]);
        run(&mut physics, 1100, [100.0, 100.0]);
        let driven = physics.robot(0).x_mm + 300.0;
        assert!((driven - 110.0).abs() < 2.0, "{driven} mm");
        run(&mut physics, 1000, [-26.5, 26.5]);
        let turned = physics.robot(0).heading_rad;
        assert!((turned - 1.0).abs() < 0.03, "{turned} rad");
    }

    #[test]
    fn a_robot_pushes_the_ball_before_it() {
        let start = Pose { x_mm: -200.0, y_mm: 0.0, heading_rad: 0.0 };
        let mut physics = Physics::new([start, ASIDE], [-100.0, 0.0]);
        run(&mut physics, 4000, [150.0, 150.0]);
        assert!(physics.ball_mm()[0] > 300.0, "{:?}", physics.ball_mm());
        assert!(physics.robot(0).x_mm > 250.0, "{:?}", physics.robot(0));
    }

    #[test]
    fn a_robot_does_not_leave_through_a_corner() {
        let heading_rad = libm::atan2(HALF_WIDTH_MM, HALF_LENGTH_MM);
        let start = Pose { x_mm: 300.0, y_mm: 200.0, heading_rad };
        let mut physics = Physics::new([start, Pose { x_mm: -300.0, ..ASIDE }], [0.0, 0.0]);
        run(&mut physics, 3000, [400.0, 400.0]);
        let Pose { x_mm, y_mm, .. } = physics.robot(0);
        let corner = HALF_LENGTH_MM + HALF_WIDTH_MM - CORNER_CUT_MM - x_mm - y_mm;
        assert!(corner / core::f64::consts::SQRT_2 > ROBOT_RADIUS_MM - 2.0, "{x_mm}, {y_mm}");
    }

    #[test]
    fn a_copy_goes_on_as_the_original_does() {
        let mut original = with_ball([-100.0, -230.0], [-500.0, 0.0]);
        run(&mut original, 333, [200.0, 210.0]);
        let mut copy = original.clone();
        for physics in [&mut original, &mut copy] {
            run(physics, 1500, [200.0, 190.0]);
        }
        assert_eq!(copy.robot(0), original.robot(0));
        assert_eq!(copy.ball_mm(), original.ball_mm());
    }

    #[test]
    fn the_same_steps_lead_to_the_same_place() {
        let outcome = || {
            let mut physics = with_ball([40.0, 30.0], [900.0, 700.0]);
            run(&mut physics, 2000, [210.0, 180.0]);
            (physics.robot(0), physics.robot(1), physics.ball_mm())
        };
        assert_eq!(outcome(), outcome());
    }
}
