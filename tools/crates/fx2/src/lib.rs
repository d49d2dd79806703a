//! The EZ-USB FX2 (CY7C68013) without its board.
pub mod pins;
