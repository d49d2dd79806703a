//! The loop that ties chips and world together.

pub mod cameras;
pub mod desk;
pub mod flash;
pub mod game;
pub mod player;
pub mod robot;
pub mod turret;
