//! What firmware did that the chip forbids or that is not modelled, each reported once.

use serde::{Deserialize, Serialize};
use std::fmt;

/// The rule that was broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Rule {
    /// A register, memory or mode that this model does not have.
    NotModelled,
    /// Two accesses to registers of the FIFO unit came closer than SYNCDELAY allows (TRM 15.14).
    SyncDelay,
    /// FIFORESET: an endpoint was reset while NAKALL was clear (TRM 15.5.4).
    FifoResetOrder,
    /// A bit that must be written as 0 was set, or a field has a value that is not allowed.
    Reserved,
    /// The GPIF was triggered, or its interface changed, while it was still busy.
    GpifBusy,
    /// Data was lost: a full FIFO was written, or an empty one read.
    DataLost,
    /// A descriptor pointer or length that the USB engine cannot serve.
    SetupData,
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Address of the instruction that did it; 0 when no instruction was at fault.
    pub pc: u16,
    /// Which rule.
    pub rule: Rule,
    /// The register or memory address concerned (SFRs as 0x80..=0xFF), 0 if none.
    pub address: u16,
    /// What happened and what to do about it.
    pub text: String,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:#06x}: {}", self.pc, self.text)
    }
}

/// The list, without repetitions of the same rule at the same address and program counter.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Diagnostics {
    found: Vec<Diagnostic>,
}

impl Diagnostics {
    /// A program that strays through memory would otherwise fill the list with every address.
    const MAX: usize = 200;

    pub(crate) fn report(
        &mut self,
        pc: u16,
        rule: Rule,
        address: u16,
        text: impl FnOnce() -> String,
    ) {
        let known = |d: &Diagnostic| d.rule == rule && d.address == address && d.pc == pc;
        if self.found.len() < Self::MAX && !self.found.iter().any(known) {
            self.found.push(Diagnostic { pc, rule, address, text: text() });
        }
    }

    pub(crate) fn list(&self) -> &[Diagnostic] {
        &self.found
    }
}
