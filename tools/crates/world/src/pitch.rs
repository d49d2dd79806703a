//! The pitch and what stands on it: every dimension once, with where it comes from.
//!
//! World coordinates in mm: x towards the goal that our robot attacks, y left, z up, the origin on the
//! centre spot. KheperaSot rules (FIRA) unless marked otherwise.

/// Half the pitch's length and width: 1050 x 680 mm.
pub const HALF_LENGTH_MM: f64 = 525.0;
/// See [`HALF_LENGTH_MM`].
pub const HALF_WIDTH_MM: f64 = 340.0;
/// The corners are cut by a diagonal this far from each corner.
pub const CORNER_CUT_MM: f64 = 50.0;
/// Height of the walls.
pub const WALL_HEIGHT_MM: f64 = 200.0;
/// The goals: opening, height, depth.
pub const GOAL_HALF_WIDTH_MM: f64 = 150.0;
/// See [`GOAL_HALF_WIDTH_MM`].
pub const GOAL_HEIGHT_MM: f64 = 150.0;
/// See [`GOAL_HALF_WIDTH_MM`].
pub const GOAL_DEPTH_MM: f64 = 70.0;
/// White lines: width, centre circle, border before the goals.
pub const LINE_WIDTH_MM: f64 = 5.0;
/// See [`LINE_WIDTH_MM`].
pub const CENTRE_CIRCLE_MM: f64 = 300.0;
/// See [`LINE_WIDTH_MM`].
pub const CENTRE_DOT_MM: f64 = 10.0;
/// The border before a goal: as wide as the goal, so deep into the pitch.
pub const GOAL_BORDER_MM: f64 = 100.0;
/// A tennis ball: diameter (rules), mass (ITF: 56.0 to 59.4 g).
pub const BALL_RADIUS_MM: f64 = 33.5;
/// See [`BALL_RADIUS_MM`].
pub const BALL_MASS_KG: f64 = 0.0577;
/// A Khepera with turrets and dress: radius and height of the striped cylinder (assumptions of ours:
/// the base alone has a radius of 27.5 to 35 mm), and its mass (base 80 g, the rest assumed).
pub const ROBOT_RADIUS_MM: f64 = 30.0;
/// See [`ROBOT_RADIUS_MM`].
pub const ROBOT_HEIGHT_MM: f64 = 100.0;
/// See [`ROBOT_RADIUS_MM`].
pub const ROBOT_MASS_KG: f64 = 0.2;
/// Stripes around the dress, black and white in turn (assumption).
pub const ROBOT_STRIPES: u32 = 16;
/// Between the wheels (K-Team).
pub const WHEEL_BASE_MM: f64 = 53.0;

/// The walls' inner faces, goal pockets included, as pieces of one closed line.
pub fn outline_mm() -> [[[f64; 2]; 2]; 16] {
    let quarter = [
        [HALF_LENGTH_MM + GOAL_DEPTH_MM, GOAL_HALF_WIDTH_MM],
        [HALF_LENGTH_MM, GOAL_HALF_WIDTH_MM],
        [HALF_LENGTH_MM, HALF_WIDTH_MM - CORNER_CUT_MM],
        [HALF_LENGTH_MM - CORNER_CUT_MM, HALF_WIDTH_MM],
    ];
    let corner = |index: usize| {
        let [x, y] =
            if (index / 4).is_multiple_of(2) { quarter[index % 4] } else { quarter[3 - index % 4] };
        match index / 4 {
            0 => [x, y],
            1 => [-x, y],
            2 => [-x, -y],
            _ => [x, -y],
        }
    };
    core::array::from_fn(|index| [corner(index), corner((index + 1) % 16)])
}
