//! A floor without end or anything on it, for a robot's base alone: what its wheels do, and where it
//! gets to. The rules are those of a match: wheels, grip and slip of [`crate::noise`] and
//! [`crate::materials`].

use crate::Noise;
use crate::materials::Materials;
use crate::noise::Drive;
use crate::physics::Pose;
use crate::pitch::{ROBOT_RADIUS_MM, WHEEL_BASE_MM};

const GRAVITY_MM_S2: f64 = 9810.0;
const STEP_S: f64 = 0.001;

/// The floor, and the robot on it.
#[derive(Clone, Debug)]
pub struct OpenFloor {
    drive: Drive,
    /// Most that the grip changes in a step: speed in mm/s, turning in rad/s.
    most: f64,
    most_turn: f64,
    mm_s: f64,
    rad_s: f64,
    pose: Pose,
}

impl OpenFloor {
    /// A robot at rest at the origin, facing x. `seed` draws what is peculiar to it.
    pub fn new(noise: Noise, seed: u64) -> Self {
        Self::with_drive(Drive::new(noise, seed, 0))
    }

    /// The same with equal wheels of the right size: what is left is slip, grip and drag.
    pub fn with_equal_wheels(noise: Noise, seed: u64) -> Self {
        let mut drive = Drive::new(noise, seed, 0);
        drive.scale = [1.0; 2];
        drive.turn_scale = 1.0;
        Self::with_drive(drive)
    }

    fn with_drive(drive: Drive) -> Self {
        let most = Materials::default().tyre_grip * drive.grip * GRAVITY_MM_S2 * STEP_S;
        // The same force at half a wheel base from the middle turns a disc: I = m r^2 / 2.
        let most_turn = most * WHEEL_BASE_MM / (ROBOT_RADIUS_MM * ROBOT_RADIUS_MM);
        let pose = Pose { x_mm: 0.0, y_mm: 0.0, heading_rad: 0.0 };
        Self { drive, most, most_turn, mm_s: 0.0, rad_s: 0.0, pose }
    }

    /// Force in N that resists each wheel: the drag of its gear.
    pub fn wheel_loads_n(&self) -> [f64; 2] {
        self.drive.drag_n
    }

    /// The battery's voltage, as part of the nominal one.
    pub fn battery(&self) -> f64 {
        self.drive.battery
    }

    /// One millisecond with wheels whose rims turn at these speeds, left and right.
    pub fn step(&mut self, rim_mm_s: [f64; 2]) {
        let [left, right] = self.drive.over_floor(rim_mm_s);
        let turn = (right - left) / WHEEL_BASE_MM * self.drive.turn_scale;
        self.mm_s += ((left + right) / 2.0 - self.mm_s).clamp(-self.most, self.most);
        self.rad_s += (turn - self.rad_s).clamp(-self.most_turn, self.most_turn);
        let heading = self.pose.heading_rad + self.rad_s * STEP_S / 2.0;
        self.pose.x_mm += self.mm_s * STEP_S * libm::cos(heading);
        self.pose.y_mm += self.mm_s * STEP_S * libm::sin(heading);
        self.pose.heading_rad += self.rad_s * STEP_S;
    }

    /// Where the robot is. Its heading counts whole turns on.
    pub fn pose(&self) -> Pose {
        self.pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn driven(mut floor: OpenFloor, ms: u32, rims: [f64; 2]) -> Pose {
        (0..ms).for_each(|_| floor.step(rims));
        floor.pose()
    }

    #[test]
    fn perfect_wheels_go_where_they_turn_once_they_grip() {
        let pose = driven(OpenFloor::new(Noise::None, 1), 1000, [200.0; 2]);
        // A wheel at 200 mm/s from the start slips until the robot has its speed.
        let lost = 200.0 * 200.0 / (2.0 * 0.6 * GRAVITY_MM_S2);
        assert!((pose.x_mm - (200.0 - lost)).abs() < 0.5, "{pose:?}");
        let pose = driven(OpenFloor::new(Noise::None, 1), 1000, [-53.0, 53.0]);
        assert!((pose.heading_rad - 2.0).abs() < 0.01 && pose.x_mm.abs() < 1e-9, "{pose:?}");
    }

    #[test]
    fn slip_alone_leads_astray_by_little_and_unequal_wheels_by_much() {
        let aside = |floor| driven(floor, 5000, [200.0; 2]).y_mm.abs();
        let slipped = aside(OpenFloor::with_equal_wheels(Noise::Measured, 1));
        let unequal = aside(OpenFloor::new(Noise::Measured, 1));
        assert!((0.01..10.0).contains(&slipped), "{slipped} mm");
        assert!(unequal > slipped, "{unequal} mm");
    }
}
