//! What things are made of: every number of the physics once, with where it comes from.
//!
//! A match must not depend on any of them: [`Materials::vary`] changes each by a factor, and the
//! figures in docs hold with all of them 30 % up or down.

use crate::pitch::{BALL_MASS_KG, ROBOT_MASS_KG};

/// Friction, losses, masses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Materials {
    /// Rubber tyres on smooth wood: coefficient of friction (assumption; tables have 0.5 to 0.9).
    pub tyre_grip: f64,
    /// A tennis ball's rolling resistance on a hard floor, as part of its weight (assumption: tables
    /// have 0.01 to 0.02, felt on wood lies at the upper end).
    pub rolling_loss: f64,
    /// Sliding friction of the ball's felt on the floor (assumption; measured 0.5 to 0.6 on courts).
    pub floor_friction: f64,
    /// Restitution of the ball at a wall: ITF's rebound test (dropped from 254 cm, it must come back
    /// to 135..147 cm) gives 0.73 to 0.76 on concrete; wooden walls that give way have less
    /// (assumption).
    pub wall_restitution: f64,
    /// The same at a robot's plastic (assumption).
    pub robot_restitution: f64,
    /// Sliding friction of the felt on a wall or a robot (assumption).
    pub felt_friction: f64,
    /// Mass of the ball (ITF: 56.0 to 59.4 g).
    pub ball_mass_kg: f64,
    /// Mass of a robot: see [`ROBOT_MASS_KG`].
    pub robot_mass_kg: f64,
}

impl Default for Materials {
    fn default() -> Self {
        Self {
            tyre_grip: 0.6,
            rolling_loss: 0.015,
            floor_friction: 0.55,
            wall_restitution: 0.6,
            robot_restitution: 0.3,
            felt_friction: 0.2,
            ball_mass_kg: BALL_MASS_KG,
            robot_mass_kg: ROBOT_MASS_KG,
        }
    }
}

/// No such property.
#[derive(Debug, thiserror::Error)]
#[error("there is no `{0}`; there are {names}", names = Materials::NAMES.join(", "))]
pub struct Unknown(String);

impl Materials {
    /// What can be varied.
    pub const NAMES: [&str; 8] = [
        "tyre-grip",
        "rolling-loss",
        "floor-friction",
        "wall-restitution",
        "robot-restitution",
        "felt-friction",
        "ball-mass",
        "robot-mass",
    ];

    /// Change one property by a factor.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn vary(&mut self, name: &str, factor: f64) -> Result<(), Unknown> {
        let value = match name {
            "tyre-grip" => &mut self.tyre_grip,
            "rolling-loss" => &mut self.rolling_loss,
            "floor-friction" => &mut self.floor_friction,
            "wall-restitution" => &mut self.wall_restitution,
            "robot-restitution" => &mut self.robot_restitution,
            "felt-friction" => &mut self.felt_friction,
            "ball-mass" => &mut self.ball_mass_kg,
            "robot-mass" => &mut self.robot_mass_kg,
            _ => return Err(Unknown(name.to_owned())),
        };
        *value *= factor;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_changes_one_property() {
        for name in Materials::NAMES {
            let mut varied = Materials::default();
            varied.vary(name, 1.3).expect("it is listed");
            assert_ne!(varied, Materials::default(), "{name}");
        }
        let unknown = Materials::default().vary("grip", 1.0).expect_err("not listed");
        assert!(unknown.to_string().contains("tyre-grip"), "{unknown}");
    }
}
