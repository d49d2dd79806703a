//! The Khepera base: 68331, motors, encoders, sensors.

pub mod turret_bus;
