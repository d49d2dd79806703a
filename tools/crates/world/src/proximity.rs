//! The base's eight infrared proximity sensors: how far each of them sees.
//!
//! Poses as published for the Khepera (Player's driver), readings near-linear from 1023 at contact to 0
//! at 50 mm (Webots, KiKS). The beam is taken for a ray, which it is not: an assumption.

use crate::physics::Pose;
use crate::pitch as p;

/// Number of sensors.
pub const SENSORS: usize = 8;
/// Nothing further away is noticed.
pub const RANGE_MM: f64 = 50.0;

/// Place on the robot and direction: mm forward, mm left, degrees to the left. Order of command N.
const POSES: [[f64; 3]; SENSORS] = [
    [10.0, 24.0, 90.0],
    [19.0, 17.0, 45.0],
    [25.0, 6.0, 0.0],
    [25.0, -6.0, 0.0],
    [19.0, -17.0, -45.0],
    [10.0, -24.0, -90.0],
    [-24.0, -10.0, 180.0],
    [-24.0, 10.0, 180.0],
];

/// Distance in mm that each sensor of a robot at `robot` sees, at most [`RANGE_MM`]; `others` are discs
/// (middle, radius) in its way.
pub fn distances_mm(robot: Pose, others: &[([f64; 2], f64)]) -> [f64; SENSORS] {
    POSES.map(|[forward, left, degrees]| {
        let (sin, cos) = libm::sincos(robot.heading_rad);
        let from =
            [robot.x_mm + forward * cos - left * sin, robot.y_mm + forward * sin + left * cos];
        let (sin, cos) = libm::sincos(robot.heading_rad + degrees.to_radians());
        let beam = [cos, sin];
        others
            .iter()
            .map(|&(middle, radius)| to_disc(from, beam, middle, radius))
            .chain(p::outline_mm().into_iter().map(|wall| to_wall(from, beam, wall)))
            .fold(RANGE_MM, f64::min)
    })
}

/// The sensor's reading, 0..=1023, at a distance.
pub fn reading(distance_mm: f64) -> u16 {
    let near = 1.0 - distance_mm.clamp(0.0, RANGE_MM) / RANGE_MM;
    (near * 1023.0 + 0.5) as u16
}

fn to_disc(from: [f64; 2], beam: [f64; 2], middle: [f64; 2], radius: f64) -> f64 {
    let offset = [from[0] - middle[0], from[1] - middle[1]];
    let along = offset[0] * beam[0] + offset[1] * beam[1];
    let outside = offset[0] * offset[0] + offset[1] * offset[1] - radius * radius;
    if outside <= 0.0 {
        return 0.0;
    }
    let square = along * along - outside;
    if square < 0.0 || along > 0.0 { f64::MAX } else { -along - libm::sqrt(square) }
}

fn to_wall(from: [f64; 2], beam: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let wall = [b[0] - a[0], b[1] - a[1]];
    let offset = [a[0] - from[0], a[1] - from[1]];
    let cross = |u: [f64; 2], v: [f64; 2]| u[0] * v[1] - u[1] * v[0];
    let steep = cross(beam, wall);
    if steep == 0.0 {
        return f64::MAX;
    }
    let (distance, part) = (cross(offset, wall) / steep, cross(offset, beam) / steep);
    if distance >= 0.0 && (0.0..=1.0).contains(&part) { distance } else { f64::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_ahead_is_seen_by_the_two_in_front() {
        let robot = Pose { x_mm: 0.0, y_mm: 285.0, heading_rad: core::f64::consts::FRAC_PI_2 };
        let seen = distances_mm(robot, &[]);
        assert!((seen[2] - 30.0).abs() < 1e-9 && (seen[3] - 30.0).abs() < 1e-9, "{seen:?}");
        assert!((seen[1] - 36.0 * core::f64::consts::SQRT_2).abs() > 0.5, "{seen:?}");
        assert_eq!(seen[1], RANGE_MM);
        assert_eq!(seen[6], RANGE_MM);
    }

    #[test]
    fn a_ball_at_the_left_is_seen_by_the_sensor_at_the_left() {
        let ball = ([10.0, 24.0 + 20.0 + p::BALL_RADIUS_MM], p::BALL_RADIUS_MM);
        let seen = distances_mm(Pose::default(), &[ball]);
        assert!((seen[0] - 20.0).abs() < 1e-9, "{seen:?}");
        assert_eq!(seen[3], RANGE_MM);
        assert_eq!(seen[5], RANGE_MM);
    }

    #[test]
    fn readings_fall_from_contact_to_nothing() {
        assert_eq!([reading(0.0), reading(25.0), reading(50.0)], [1023, 512, 0]);
    }
}
