//! The XCV300E: configuration port, register file, and the vision model.

pub mod bitstream;
mod camera_table;
pub mod config;
pub mod design;
pub mod diagnostics;
pub mod fpga;
pub mod listing;
pub mod logic;
pub mod packet;
pub mod part;
pub mod store;
pub mod stream;

pub use fpga::{Fpga, Frame};
