//! What the firmware did that the model does not cover or that a real chip would not forgive.

use sim::Ps;

/// One such thing. Each is listed once, when it first happens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// When.
    pub time: Ps,
    /// Program counter of the instruction.
    pub pc: u32,
    /// Address touched.
    pub address: u32,
    /// True for a write.
    pub write: bool,
    /// What is odd about it.
    pub what: &'static str,
}

impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let direction = if self.write { "write to" } else { "read of" };
        write!(
            f,
            "{:.6} s, PC {:#08x}: {direction} {:#08x}: {}",
            self.time as f64 / sim::SECOND as f64,
            self.pc,
            self.address,
            self.what
        )
    }
}

/// More would help nobody.
const LIMIT: usize = 64;

/// The list, without repetitions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Diagnostics {
    list: Vec<Diagnostic>,
}

impl Diagnostics {
    pub fn add(&mut self, new: Diagnostic) {
        let same =
            |d: &Diagnostic| d.address == new.address && d.write == new.write && d.what == new.what;
        if self.list.len() < LIMIT && !self.list.iter().any(same) {
            self.list.push(new);
        }
    }

    pub fn list(&self) -> &[Diagnostic] {
        &self.list
    }
}
