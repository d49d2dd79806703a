//! The XCV300E: configuration port, register file, and the vision model.

pub mod bitstream;
pub mod design;
pub mod logic;
pub mod packet;
pub mod part;
