//! The PC's side of the Khepera base's serial line: the line itself, and the resident loader at its
//! other end (docs/SPEC.md, "The base's loader").

pub mod flash;
pub mod line;
pub mod program;

pub use flash::{Error, Options, Outcome, Step, flash};
pub use line::{Line, SerialLine};
pub use program::{Program, ProgramError};
