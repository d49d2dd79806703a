//! Bodies that move: two robots and a ball, seen from above, 1 ms at a time.
//!
//! rapier2d finds contacts and solves them. What it does not know is added here each step: wheels,
//! which pull no harder than they grip, and the ball's rolling loss. Inside, SI units.

use rapier2d::prelude::*;

use crate::pitch::{
    BALL_MASS_KG, BALL_RADIUS_MM, CORNER_CUT_MM, GOAL_DEPTH_MM, GOAL_HALF_WIDTH_MM, HALF_LENGTH_MM,
    HALF_WIDTH_MM, ROBOT_MASS_KG, ROBOT_RADIUS_MM, WHEEL_BASE_MM,
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

/// The walls' inner faces, goal pockets included, as one closed line.
fn add_walls(world: &mut PhysicsWorld) {
    let quarter = [
        (HALF_LENGTH_MM + GOAL_DEPTH_MM, GOAL_HALF_WIDTH_MM),
        (HALF_LENGTH_MM, GOAL_HALF_WIDTH_MM),
        (HALF_LENGTH_MM, HALF_WIDTH_MM - CORNER_CUT_MM),
        (HALF_LENGTH_MM - CORNER_CUT_MM, HALF_WIDTH_MM),
    ];
    let outline: Vec<Vector> = quarter
        .iter()
        .map(|&(x, y)| point(x, y))
        .chain(quarter.iter().rev().map(|&(x, y)| point(-x, y)))
        .chain(quarter.iter().map(|&(x, y)| point(-x, -y)))
        .chain(quarter.iter().rev().map(|&(x, y)| point(x, -y)))
        .collect();
    for (index, &from) in outline.iter().enumerate() {
        let to = outline[(index + 1) % outline.len()];
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
