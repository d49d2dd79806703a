//! The 8051 core of the EZ-USB FX2: registers, instructions, cycles and interrupts, without the
//! chip around it.
//!
//! The chip supplies memories and all other special function registers through [`Bus`], keeps the
//! interrupt request lines in [`Cpu::requests`] up to date and calls [`Cpu::step`].
//!
//! Times are machine cycles: one is 4 clocks, so 12 million a second at 48 MHz.
//!
//! ```
//! struct Memory([u8; 0x2000]);
//! impl mcs51::Bus for Memory {
//!     fn read_code(&mut self, address: u16) -> u8 {
//!         self.0[usize::from(address) % self.0.len()]
//!     }
//!     fn read_xdata(&mut self, address: u16) -> u8 {
//!         self.read_code(address)
//!     }
//!     fn write_xdata(&mut self, address: u16, value: u8) {
//!         self.0[usize::from(address) % 0x2000] = value;
//!     }
//!     fn read_sfr(&mut self, _address: u8) -> u8 {
//!         0
//!     }
//!     fn write_sfr(&mut self, _address: u8, _value: u8) {}
//! }
//! let mut memory = Memory([0; 0x2000]); // NOP everywhere
//! let mut cpu = mcs51::Cpu::new();
//! let cycles: u32 = (0..10).map(|_| cpu.step(&mut memory)).sum();
//! assert_eq!((cpu.pc(), cycles), (10, 10));
//! ```
//!
//! Sources: EZ-USB FX2 Technical Reference Manual v2.1 (Cypress, here "TRM"); ucsim's DS80C320,
//! with which the tests compare instruction by instruction.

mod cpu;
mod disassembler;
mod execute;
mod interrupts;
pub mod sfr;

pub use cpu::Cpu;
pub use disassembler::{Instruction, Operand};
pub use interrupts::Source;

/// What the core reaches outside itself.
///
/// A call belongs to the instruction that [`Cpu::step`] is executing; the time it is charged with
/// is known only when the step returns.
pub trait Bus {
    /// Fetches an instruction byte or a constant (MOVC). Interrupt autovectors are the chip's: it
    /// substitutes the byte at 0x45 or 0x55.
    fn read_code(&mut self, address: u16) -> u8;

    /// MOVX read.
    fn read_xdata(&mut self, address: u16) -> u8;

    /// MOVX write.
    fn write_xdata(&mut self, address: u16, value: u8);

    /// Reads a special function register that the core does not own (see [`sfr::is_core`]).
    fn read_sfr(&mut self, address: u8) -> u8;

    /// Reads the latch of such a register, on behalf of an instruction that writes it back: ANL,
    /// ORL, XRL, INC, DEC, DJNZ, JBC, CPL, CLR, SETB and MOV bit,C.
    fn read_sfr_latch(&mut self, address: u8) -> u8 {
        self.read_sfr(address)
    }

    /// Writes a special function register that the core does not own. Writes to the core's CKCON
    /// and PCON are announced here as well, because timers and serial ports depend on them.
    fn write_sfr(&mut self, address: u8, value: u8);

    /// The core vectors to `source`: flags that hardware clears are cleared by this (TF0, TF1, and
    /// IE0, IE1 of edge-triggered inputs).
    fn acknowledge(&mut self, source: Source) {
        let _ = source;
    }
}
