//! Bodies that move: two robots and a ball, seen from above, 1 ms at a time.
//!
//! rapier2d finds contacts and solves them. What it does not know is added here each step: wheels,
//! which pull no harder than they grip, and the ball's spin about its level axes: a ball that is pushed
//! slides until the floor has made it roll, it loses speed while it rolls, and it keeps its spin when
//! it bounces, but for what the wall's friction takes. Inside, SI units.
//!
//! What is not modelled: a ball never leaves the floor, a robot never tips.

use rapier2d::prelude::*;

use crate::materials::Materials;
use crate::noise::{Drive, Floor, Noise};
use crate::pitch::{BALL_RADIUS_MM, ROBOT_RADIUS_MM, WHEEL_BASE_MM, outline_mm};

/// A step, in seconds.
const STEP_S: f32 = 0.001;
const GRAVITY: f32 = 9.81;
/// A hollow sphere's moment of inertia is 2/3 m r^2: a force at its surface changes the speed of that
/// so many times as much as the speed of its middle.
const SPIN_PER_PUSH: f32 = 1.5;
/// What a robot's wheels feel of a push follows it with this time constant: tyres and gears give way.
const PUSH_LAG_S: f64 = 0.02;
/// Ball and robot touch if no more than this is between them.
const TOUCH_MM: f64 = 1.0;

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

/// What moves, beside the bodies' own state.
#[derive(Clone)]
struct Extras {
    materials: Materials,
    drives: [Drive; 2],
    floor: Floor,
    /// Velocity of the ball's surface about its middle, at the bottom backwards: that of the middle
    /// when it rolls.
    spin: Vector,
    /// Force that each robot's left and right wheel feel from what the robot pushes, N; positive =
    /// backwards.
    push_n: [[f64; 2]; 2],
}

/// Two robots and a ball.
pub struct Physics {
    world: PhysicsWorld,
    robots: [RigidBodyHandle; 2],
    ball: RigidBodyHandle,
    extras: Extras,
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
        Self { world, robots: self.robots, ball: self.ball, extras: self.extras.clone() }
    }
}

fn metres(mm: f64) -> f32 {
    (mm / 1000.0) as f32
}

fn point(x_mm: f64, y_mm: f64) -> Vector {
    Vector::new(metres(x_mm), metres(y_mm))
}

impl Physics {
    /// Everything at rest, in the match of that seed.
    pub fn new(
        robots: [Pose; 2],
        ball_mm: [f64; 2],
        materials: Materials,
        noise: Noise,
        seed: u64,
    ) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        world.integration_parameters.dt = STEP_S;
        world.integration_parameters.length_unit = 0.05;
        add_walls(&mut world, &materials);
        let robots = robots.map(|pose| add_robot(&mut world, pose, &materials));
        let ball = add_ball(&mut world, ball_mm, &materials);
        let extras = Extras {
            materials,
            drives: [0, 1].map(|robot| Drive::new(noise, seed, robot)),
            floor: Floor::new(noise, seed),
            spin: Vector::ZERO,
            push_n: [[0.0; 2]; 2],
        };
        Self { world, robots, ball, extras }
    }

    /// Lift everything and put it down here, at rest.
    pub fn place(&mut self, robots: [Pose; 2], ball_mm: [f64; 2]) {
        for (robot, pose) in self.robots.into_iter().zip(robots) {
            put(&mut self.world.bodies[robot], pose);
        }
        self.extras.push_n = [[0.0; 2]; 2];
        self.place_ball(ball_mm);
    }

    /// Lift the ball and put it down here, at rest.
    pub fn place_ball(&mut self, ball_mm: [f64; 2]) {
        let [x_mm, y_mm] = ball_mm;
        put(&mut self.world.bodies[self.ball], Pose { x_mm, y_mm, heading_rad: 0.0 });
        self.extras.spin = Vector::ZERO;
    }

    /// One millisecond, with these speeds of left and right wheel in mm/s for both robots.
    pub fn step(&mut self, wheels_mm_s: [[f64; 2]; 2]) {
        let mut wanted = [(Vector::ZERO, 0.0); 2];
        for (index, rim) in wheels_mm_s.into_iter().enumerate() {
            let body = &mut self.world.bodies[self.robots[index]];
            let way = &mut self.extras.drives[index];
            let wheels = way.over_floor(rim);
            drive(body, wheels, way, &self.extras.materials);
            wanted[index] = (body.linvel(), body.angvel());
        }
        self.roll();
        let before = self.world.bodies[self.ball].linvel();
        self.world.step();
        self.rub(before);
        for (index, (velocity, turn)) in wanted.into_iter().enumerate() {
            self.feel(index, velocity, turn);
        }
    }

    /// The floor's part in the ball's motion: what slides is made to roll, what rolls loses speed.
    fn roll(&mut self) {
        let Extras { materials, floor, spin, .. } = &mut self.extras;
        let body = &mut self.world.bodies[self.ball];
        let mut velocity = body.linvel();
        let slip = velocity - *spin;
        // The share of the slip that is gone goes to the middle and, 1.5 times as much, to the spin.
        let grip = materials.floor_friction as f32 * GRAVITY * STEP_S * (1.0 + SPIN_PER_PUSH);
        let rubbed = if slip.length() > grip { slip * (grip / slip.length()) } else { slip };
        velocity -= rubbed / (1.0 + SPIN_PER_PUSH);
        *spin += rubbed * (SPIN_PER_PUSH / (1.0 + SPIN_PER_PUSH));

        let fall = Vector::new(floor.slope[0] as f32, floor.slope[1] as f32) * GRAVITY * STEP_S;
        let loss = materials.rolling_loss as f32 * GRAVITY * STEP_S;
        let speed = velocity.length();
        if speed <= loss && fall.length() < loss {
            velocity = Vector::ZERO;
            *spin = Vector::ZERO;
        } else {
            let kept = ((speed - loss) / speed.max(loss)).max(0.0);
            let angle = floor.wander(f64::from(speed * STEP_S));
            let (sin, cos) = libm::sincos(angle);
            let turned = |v: Vector| {
                let (sin, cos) = (sin as f32, cos as f32);
                Vector::new(v.x * cos - v.y * sin, v.x * sin + v.y * cos)
            };
            // Slope and loss act on a rolling ball as a whole.
            velocity = turned(velocity) * kept + fall * 0.6;
            *spin = turned(*spin) * kept + fall * 0.6;
        }
        body.set_linvel(velocity, true);
        // About its upright axis it turns on its felt.
        body.set_angvel(body.angvel() * 0.99, true);
    }

    /// What a wall or a robot that has just changed the ball's velocity does to its spin.
    fn rub(&mut self, before: Vector) {
        let change = self.world.bodies[self.ball].linvel() - before;
        let strength = change.length();
        if strength < 1e-6 {
            return;
        }
        let normal = change / strength;
        let upright = self.extras.spin.dot(normal);
        let most = SPIN_PER_PUSH * self.extras.materials.felt_friction as f32 * strength;
        self.extras.spin -= normal * upright.clamp(-most, most);
    }

    /// What a robot's wheels feel of a contact that has just changed its motion.
    fn feel(&mut self, index: usize, wanted: Vector, wanted_turn: f32) {
        let body = &self.world.bodies[self.robots[index]];
        let forward = *body.rotation() * Vector::new(1.0, 0.0);
        let mass = self.extras.materials.robot_mass_kg;
        let radius = ROBOT_RADIUS_MM / 1000.0;
        let per_step = f64::from(1.0 / STEP_S);
        let force = f64::from((wanted - body.linvel()).dot(forward)) * mass * per_step;
        let inertia = mass * radius * radius / 2.0;
        let torque = f64::from(wanted_turn - body.angvel()) * inertia * per_step;
        let sideways = torque / (WHEEL_BASE_MM / 1000.0);
        let share = f64::from(STEP_S) / PUSH_LAG_S;
        let felt = [force / 2.0 - sideways, force / 2.0 + sideways];
        for (push, felt) in self.extras.push_n[index].iter_mut().zip(felt) {
            *push += (felt - *push) * share;
        }
    }

    /// Force in N that resists each wheel's motion now, rims turning at these speeds: drag of the gear,
    /// and what the robot pushes.
    pub fn wheel_loads_n(&self, index: usize, rim_mm_s: [f64; 2]) -> [f64; 2] {
        let drag = self.extras.drives[index].drag_n;
        let push = self.extras.push_n[index];
        core::array::from_fn(|wheel| {
            let resists = if rim_mm_s[wheel] == 0.0 {
                push[wheel].abs()
            } else {
                push[wheel] * rim_mm_s[wheel].signum()
            };
            drag[wheel] + resists.max(0.0)
        })
    }

    /// What is peculiar to a robot's wheels, battery and infrared sensors.
    pub fn drive_mut(&mut self, index: usize) -> &mut Drive {
        &mut self.extras.drives[index]
    }

    /// Whether a robot touches the ball.
    pub fn touches(&self, index: usize) -> bool {
        let (robot, ball) = (self.robot(index), self.ball_mm());
        let apart = libm::hypot(robot.x_mm - ball[0], robot.y_mm - ball[1]);
        apart < ROBOT_RADIUS_MM + BALL_RADIUS_MM + TOUCH_MM
    }

    /// Velocity of the ball.
    pub fn ball_mm_s(&self) -> [f64; 2] {
        let velocity = self.world.bodies[self.ball].linvel();
        [f64::from(velocity.x) * 1000.0, f64::from(velocity.y) * 1000.0]
    }

    /// Speed of a robot's middle in mm/s, and its turn in radians a second.
    pub fn robot_motion(&self, index: usize) -> (f64, f64) {
        let body = &self.world.bodies[self.robots[index]];
        (f64::from(body.linvel().length()) * 1000.0, f64::from(body.angvel()))
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

fn add_walls(world: &mut PhysicsWorld, materials: &Materials) {
    for ends in outline_mm() {
        let [from, to] = ends.map(|[x, y]| point(x, y));
        let wall = ColliderBuilder::segment(from, to)
            .friction(materials.felt_friction as f32)
            .restitution(materials.wall_restitution as f32)
            .restitution_combine_rule(CoefficientCombineRule::Min);
        world.colliders.insert(wall);
    }
}

fn add_robot(world: &mut PhysicsWorld, pose: Pose, materials: &Materials) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(point(pose.x_mm, pose.y_mm))
        .rotation(pose.heading_rad as f32)
        .can_sleep(false);
    let dress = ColliderBuilder::ball(metres(ROBOT_RADIUS_MM))
        .mass(materials.robot_mass_kg as f32)
        .friction(materials.felt_friction as f32)
        .restitution(materials.robot_restitution as f32)
        .restitution_combine_rule(CoefficientCombineRule::Min);
    world.insert(body, dress).0
}

fn add_ball(world: &mut PhysicsWorld, at_mm: [f64; 2], materials: &Materials) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(point(at_mm[0], at_mm[1]))
        .ccd_enabled(true)
        .can_sleep(false);
    let felt = ColliderBuilder::ball(metres(BALL_RADIUS_MM))
        .mass(materials.ball_mass_kg as f32)
        .friction(materials.felt_friction as f32)
        .restitution(1.0)
        .restitution_combine_rule(CoefficientCombineRule::Min);
    world.insert(body, felt).0
}

/// Move a body somewhere else, at rest.
fn put(body: &mut RigidBody, pose: Pose) {
    body.set_translation(point(pose.x_mm, pose.y_mm), true);
    body.set_rotation(Rotation::new(pose.heading_rad as f32), true);
    body.set_linvel(Vector::ZERO, true);
    body.set_angvel(0.0, true);
}

/// `value` moved towards `target`, by no more than `most`.
fn approach(value: f32, target: f32, most: f32) -> f32 {
    value + (target - value).clamp(-most, most)
}

/// What two wheels do to a robot: each pulls it towards its own speed, and neither slips sideways,
/// as far as the tyres grip.
fn drive(body: &mut RigidBody, wheels_mm_s: [f64; 2], wheels: &Drive, materials: &Materials) {
    let [left, right] = wheels_mm_s.map(metres);
    let most = (materials.tyre_grip * wheels.grip) as f32 * GRAVITY * STEP_S;
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
    let turn = (right - left) / metres(WHEEL_BASE_MM) * wheels.turn_scale as f32;
    body.set_angvel(approach(body.angvel(), turn, most_turn), true);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pitch::{CORNER_CUT_MM, GOAL_DEPTH_MM, HALF_LENGTH_MM, HALF_WIDTH_MM};

    const ASIDE: Pose = Pose { x_mm: 300.0, y_mm: 250.0, heading_rad: 0.0 };

    fn perfect(robots: [Pose; 2], ball_mm: [f64; 2]) -> Physics {
        Physics::new(robots, ball_mm, Materials::default(), Noise::None, 1)
    }

    fn with_ball(ball_mm: [f64; 2], velocity_mm_s: [f64; 2]) -> Physics {
        let behind = Pose { x_mm: -300.0, y_mm: -250.0, heading_rad: 0.0 };
        let mut physics = perfect([behind, ASIDE], ball_mm);
        let velocity = point(velocity_mm_s[0], velocity_mm_s[1]);
        physics.world.bodies[physics.ball].set_linvel(velocity, true);
        physics.extras.spin = velocity;
        physics
    }

    fn run(physics: &mut Physics, ms: u32, wheels: [f64; 2]) {
        for _ in 0..ms {
            physics.step([wheels, [0.0; 2]]);
        }
    }

    #[test]
    fn a_rolling_ball_rolls_out_as_far_as_its_loss_allows() {
        for speed in [150.0, 300.0, 450.0] {
            let mut physics = with_ball([-450.0, 0.0], [speed, 0.0]);
            run(&mut physics, 5000, [0.0; 2]);
            let rolled = physics.ball_mm()[0] + 450.0;
            let loss = Materials::default().rolling_loss * f64::from(GRAVITY) * 1000.0;
            let expected = speed * speed / (2.0 * loss);
            assert!((rolled / expected - 1.0).abs() < 0.02, "{rolled} mm, not {expected}");
        }
    }

    #[test]
    fn a_ball_that_slides_ends_up_rolling_at_three_fifths_of_its_speed() {
        // A hollow sphere: v / (1 + 2/3), whatever the friction (any textbook of mechanics).
        let mut physics = with_ball([-450.0, 0.0], [500.0, 0.0]);
        physics.extras.spin = Vector::ZERO;
        let slides_ms = 500.0 * 0.4 / (0.55 * 9810.0) * 1000.0;
        run(&mut physics, slides_ms as u32 + 2, [0.0; 2]);
        let lost = 0.015 * 9.81 * slides_ms / 1000.0 * 1000.0;
        let speed = physics.ball_mm_s()[0] + lost;
        assert!((speed - 300.0).abs() < 6.0, "{speed} mm/s");
        assert!((physics.extras.spin.x - physics.ball_mm_s()[0] as f32 / 1000.0).abs() < 0.01);
    }

    #[test]
    fn a_ball_leaves_a_wall_with_its_restitution_and_loses_speed_to_its_spin_after_it() {
        let mut physics = with_ball([0.0, 290.0], [0.0, 500.0]);
        let mut fastest = 0.0_f64;
        for _ in 0..60 {
            run(&mut physics, 1, [0.0; 2]);
            fastest = fastest.max(-physics.ball_mm_s()[1]);
        }
        let e = Materials::default().wall_restitution;
        assert!((fastest / 490.0 - e).abs() < 0.03, "{fastest} mm/s after 500");
        run(&mut physics, 100, [0.0; 2]);
        // Spin that goes on: 1.5 mu (1 + e) of the speed is taken by the wall, the rest works against
        // the ball on the floor, which splits the difference 3 to 2.
        let spin = 1.0 - 1.5 * Materials::default().felt_friction * (1.0 + e);
        let expected = 490.0 * (0.6 * e - 0.4 * spin);
        let speed = -physics.ball_mm_s()[1];
        assert!((speed - expected).abs() < 25.0, "{speed} mm/s, not {expected}");
    }

    #[test]
    fn a_ball_bounces_off_a_robot_less_than_off_a_wall() {
        let mut physics = with_ball([120.0, 250.0], [400.0, 0.0]);
        let mut slowest = f64::MAX;
        for _ in 0..400 {
            run(&mut physics, 1, [0.0; 2]);
            slowest = slowest.min(physics.ball_mm_s()[0]);
        }
        // Two bodies that meet: (m - e M) / (m + M) of its speed is left to the ball.
        let Materials { ball_mass_kg: m, robot_mass_kg: big, robot_restitution: e, .. } =
            Materials::default();
        let before = 400.0 - 1000.0 * 0.015 * 9.81 * 0.28;
        let expected = before * (m - e * big) / (m + big);
        assert!((slowest - expected).abs() < 8.0, "{slowest} mm/s, not {expected}");
    }

    #[test]
    fn robots_that_meet_stop_each_other_and_the_stronger_grip_wins_nothing() {
        let left = Pose { x_mm: -100.0, y_mm: 0.0, heading_rad: 0.0 };
        let right = Pose { x_mm: 100.0, y_mm: 0.0, heading_rad: core::f64::consts::PI };
        let mut physics = perfect([left, right], [0.0, 300.0]);
        for _ in 0..3000 {
            physics.step([[200.0, 200.0], [200.0, 200.0]]);
        }
        let [a, b] = [0, 1].map(|i| physics.robot(i));
        let apart = libm::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm);
        assert!((apart - 2.0 * ROBOT_RADIUS_MM).abs() < 2.0, "{apart}");
        assert!(a.x_mm.abs() < 60.0 && b.x_mm.abs() < 60.0, "{a:?} {b:?}");
    }

    #[test]
    fn a_robot_pushes_another_that_stands_and_its_wheels_feel_it() {
        let left = Pose { x_mm: -300.0, y_mm: 0.0, heading_rad: 0.0 };
        let across = Pose { x_mm: -200.0, y_mm: 0.0, heading_rad: core::f64::consts::FRAC_PI_2 };
        let mut physics = perfect([left, across], [0.0, 300.0]);
        run(&mut physics, 2000, [150.0, 150.0]);
        let load = physics.wheel_loads_n(0, [150.0; 2]);
        // Both stand on the same tyres: the one pushed sideways resists with all its grip.
        let grip = Materials::default().tyre_grip * 9.81 * Materials::default().robot_mass_kg;
        let total = load[0] + load[1];
        assert!(total > 0.5 * grip && total < 1.1 * grip, "{total} N of {grip}");
    }

    #[test]
    fn a_robot_against_a_wall_feels_its_own_grip_and_none_when_it_leaves() {
        let start = Pose { x_mm: 0.0, y_mm: 300.0, heading_rad: core::f64::consts::FRAC_PI_2 };
        let mut physics = perfect([start, ASIDE], [0.0, 0.0]);
        run(&mut physics, 500, [100.0, 100.0]);
        let [left, right] = physics.wheel_loads_n(0, [100.0; 2]);
        let grip = Materials::default().tyre_grip * 9.81 * Materials::default().robot_mass_kg;
        assert!(((left + right) / grip - 1.0).abs() < 0.1, "{left} {right} N");
        assert_eq!(physics.wheel_loads_n(0, [-100.0; 2]), [0.0; 2]);
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
        let mut physics = perfect([start, ASIDE], [-100.0, 0.0]);
        run(&mut physics, 4000, [150.0, 150.0]);
        assert!(physics.ball_mm()[0] > 300.0, "{:?}", physics.ball_mm());
        assert!(physics.robot(0).x_mm > 250.0, "{:?}", physics.robot(0));
    }

    #[test]
    fn a_robot_does_not_leave_through_a_corner() {
        let heading_rad = libm::atan2(HALF_WIDTH_MM, HALF_LENGTH_MM);
        let start = Pose { x_mm: 300.0, y_mm: 200.0, heading_rad };
        let mut physics = perfect([start, Pose { x_mm: -300.0, ..ASIDE }], [0.0, 0.0]);
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
