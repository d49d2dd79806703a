//! The 8051 core of the EZ-USB FX2.
