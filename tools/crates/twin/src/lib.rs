//! The loop that ties chips and world together.

pub mod belief;
pub mod cameras;
pub mod desk;
pub mod flash;
pub mod game;
pub mod player;
pub mod receiver;
pub mod robot;
pub mod sensor;
pub mod tally;
pub mod turret;
