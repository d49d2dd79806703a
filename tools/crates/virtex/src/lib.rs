//! The XCV300E: configuration port, register file, and the vision model.

pub mod bitstream;
pub mod config;
pub mod design;
pub mod diagnostics;
pub mod fpga;
pub mod listing;
pub mod logic;
pub mod packet;
pub mod part;
pub mod store;

pub use fpga::{Fpga, Frame};
