//! The XCV300E: configuration port, register file, and the vision model.
