//! The EZ-USB FX2 (CY7C68013) without its board: 8051, memories, USB engine, GPIF, FIFOs, ports, I²C,
//! timers and serial ports, and the boot loader.
//!
//! A board implements [`pins::Board`] and calls [`Fx2::run_until`]; a USB host talks to the chip
//! through the `usb_*` methods between two slices, or lets [`host::Host`] do so.
//!
//! What is exact: machine cycles of the 8051, GPIF states, IFCLK, I²C bits and USB frames. Port pins
//! move at the end of the instruction that writes them. What firmware does against the chip's rules,
//! or what is not modelled, is listed once each by [`Fx2::diagnostics`].
//!
//! Sources: EZ-USB Technical Reference Manual (Cypress 001-13670, here "TRM"). Where it is silent,
//! the module concerned states its assumption.
//!
//! ```
//! use fx2::{Config, Fx2, image::Image, pins::Unconnected};
//! // MOV 0x30,#0x42; SJMP $
//! let image = Image::raw(&[0x75, 0x30, 0x42, 0x80, 0xFE]).unwrap();
//! let mut chip = Fx2::new(Config::default());
//! chip.load(&image).unwrap();
//! chip.run_until(sim::MS, &mut Unconnected);
//! assert_eq!(chip.cpu().iram()[0x30], 0x42);
//! ```

mod boot;
pub mod bus;
mod chip;
mod descriptors;
mod diagnostics;
pub mod eeprom;
mod endpoints;
mod frames;
mod gpif;
pub mod host;
mod i2c;
pub mod image;
mod interrupts;
pub mod pins;
mod ports;
mod registers;
pub mod regs;
mod sfrs;
pub mod slave;
pub mod symbols;
mod time;
mod timers;
mod uart;
mod usb;

pub use diagnostics::{Diagnostic, Rule};
pub use endpoints::PACKET_MAX;
use serde::{Deserialize, Serialize};
pub use usb::{InReply, OutReply, Speed};

use boot::Boot;
use chip::{Chip, View};
use image::{Image, ImageError};
use mcs51::Cpu;
use pins::Board;
use sim::Ps;
use time::{NEVER, tick_at_or_after, tick_to_ps};

/// Main RAM, which tells the FX2 from the FX2LP.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ram {
    /// CY7C68013: 8 KiB.
    #[default]
    K8,
    /// CY7C68013A (FX2LP): 16 KiB.
    K16,
}

impl Ram {
    /// Size in bytes.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::K8 => 0x2000,
            Self::K16 => 0x4000,
        }
    }

    /// REVID. Assumption: revision E of the FX2, revision A of the FX2LP.
    const fn revision(self) -> u8 {
        match self {
            Self::K8 => 0x04,
            Self::K16 => 0x01,
        }
    }

    /// bcdDevice of a chip without EEPROM.
    const fn device_release(self) -> u16 {
        match self {
            Self::K8 => 0x0004,
            Self::K16 => 0xA001,
        }
    }
}

/// What can be chosen about a chip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Config {
    /// Main RAM.
    pub ram: Ram,
    /// 64 KiB of RAM on the external bus (128-pin package), seen where the chip has none of its own.
    pub external_ram: bool,
}

/// A chip, from power-on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Fx2 {
    cpu: Cpu,
    chip: Chip,
    boot: Option<Boot>,
    /// Machine cycles executed.
    cycles: u64,
}

impl Fx2 {
    /// A chip at power-on, time 0: it looks for its EEPROM first.
    #[must_use]
    pub fn new(config: Config) -> Self {
        Self { cpu: Cpu::new(), chip: Chip::new(&config), boot: Some(Boot::new()), cycles: 0 }
    }

    /// Loads a program as vendor request 0xA0 does, without the time that takes, and starts it. The
    /// boot loader is skipped if it is still at work.
    ///
    /// # Errors
    /// If the image does not fit the chip's memory; nothing is loaded then.
    pub fn load(&mut self, image: &Image) -> Result<(), ImageError> {
        image.check(self.chip.ram_size)?;
        self.boot = None;
        self.chip.booted = true;
        self.chip.load(regs::xdata::CPUCS, 1);
        for (address, bytes) in image.segments() {
            for (n, &byte) in bytes.iter().enumerate() {
                self.chip.load(address + n as u16, byte);
            }
        }
        self.chip.load(regs::xdata::CPUCS, 0);
        Ok(())
    }

    /// Runs until `t`, or until the board ends the slice; returns the time reached. An instruction
    /// that begins before `t` is finished, so that the time may lie up to 1 µs behind `t`.
    pub fn run_until<B: Board>(&mut self, t: Ps, board: &mut B) -> Ps {
        let target = tick_at_or_after(t);
        self.chip.stop = false;
        while let Some(boot) = &mut self.boot {
            if self.chip.tick >= target {
                return self.now();
            }
            if boot.step(&mut self.chip, board) {
                self.boot = None;
                self.chip.booted = true;
                self.chip.settle(board);
            }
        }
        self.chip.sense_interrupt_pins(board);
        while self.chip.tick < target && !self.chip.stop {
            self.advance(target, board);
        }
        self.chip.gpif_catch_up(board);
        self.now()
    }

    /// One instruction, or as far towards `target` as nothing happens.
    #[inline]
    fn advance(&mut self, target: u64, board: &mut dyn Board) {
        if self.chip.tick >= self.chip.next_event {
            self.chip.gpif_catch_up(board);
            self.chip.settle(board);
        }
        if self.chip.release {
            self.chip.release = false;
            self.cpu.reset();
            self.chip.reset_cpu_peripherals();
        }
        self.cpu.requests = self.chip.requests;
        if self.chip.held || self.cpu.is_idle() && self.cpu.next_interrupt().is_none() {
            return self.skip(target, board);
        }
        self.chip.pc = self.cpu.pc();
        let cycles = self.cpu.step(&mut View { chip: &mut self.chip, board });
        self.cycles += u64::from(cycles);
        self.chip.tick += u64::from(cycles) * self.chip.cycle;
        self.chip.gpif_follow(board);
        if self.chip.dirty {
            self.chip.gpif_catch_up(board);
            self.chip.settle(board);
        }
    }

    /// The CPU waits: on to the next event, or the GPIF's next interrupt.
    fn skip(&mut self, target: u64, board: &mut dyn Board) {
        self.chip.pc = self.cpu.pc();
        if self.chip.asleep && !self.chip.held {
            self.chip.tick = target;
            return;
        }
        let until = target.min(self.chip.next_event);
        let interrupted =
            if self.chip.gpif.busy() { self.chip.gpif_run(tick_to_ps(until), board) } else { None };
        let reached = interrupted.map_or(until, tick_at_or_after);
        self.chip.tick = reached.clamp(self.chip.tick, until);
        if self.chip.dirty {
            self.chip.settle(board);
        }
    }

    /// The chip's time: everything before it has happened.
    #[must_use]
    pub fn now(&self) -> Ps {
        tick_to_ps(self.chip.tick)
    }

    /// When the chip does something next, if nothing from outside comes before: now if the CPU runs,
    /// `Ps::MAX` if it waits for others only.
    #[must_use]
    pub fn next_event(&self) -> Ps {
        let waits = self.chip.held || self.cpu.is_idle() && self.cpu.next_interrupt().is_none();
        let busy = self.boot.is_some() || self.chip.gpif.busy() || self.chip.release;
        if !waits || busy {
            return self.now();
        }
        if self.chip.asleep && !self.chip.held || self.chip.next_event == NEVER {
            return Ps::MAX;
        }
        tick_to_ps(self.chip.next_event).max(self.now())
    }

    /// The core, for inspection.
    #[must_use]
    pub fn cpu(&self) -> &Cpu {
        &self.cpu
    }

    /// Machine cycles that the CPU has executed since power-on; none while it idles or is held.
    #[must_use]
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// On-chip RAM at `address` without side effects; 0xFF where there is none.
    #[must_use]
    pub fn peek(&self, address: u16) -> u8 {
        self.chip.peek_loadable(address)
    }

    /// What the chip drives at present.
    #[must_use]
    pub fn driven(&self) -> &pins::Driven {
        self.chip.shown()
    }

    /// Rules broken and unmodelled things touched so far, each once.
    #[must_use]
    pub fn diagnostics(&self) -> &[Diagnostic] {
        self.chip.diagnostics.list()
    }

    /// Whether the host holds the CPU in reset (CPUCS bit 0).
    #[must_use]
    pub fn is_cpu_held(&self) -> bool {
        self.chip.held
    }

    /// Bytes that serial port 0 or 1 has sent since the last call.
    ///
    /// # Panics
    /// If `port` is above 1.
    pub fn take_serial(&mut self, port: usize) -> Vec<u8> {
        self.chip.uarts[port].take_sent()
    }

    /// A byte for serial port 0 or 1; bytes arrive one frame apart.
    ///
    /// # Panics
    /// If `port` is above 1.
    pub fn push_serial(&mut self, port: usize, byte: u8) {
        self.chip.uarts[port].push(byte);
        self.chip.changed();
    }
}

/// The USB side. Every call happens at [`Fx2::now`].
impl Fx2 {
    /// Whether the pull-up on D+ is on: the host sees a device.
    #[must_use]
    pub fn usb_attached(&self) -> bool {
        self.chip.usb_attached()
    }

    /// Whether the chip answers the high-speed handshake of a bus reset.
    #[must_use]
    pub fn usb_wants_high_speed(&self) -> bool {
        self.chip.usb_wants_high_speed()
    }

    /// A bus reset begins. It lasts 10 ms or more; then call [`Self::usb_reset_done`].
    pub fn usb_reset(&mut self) {
        self.chip.usb_reset();
    }

    /// The reset is over and the bus runs at `speed`, with SOFs from now on.
    pub fn usb_reset_done(&mut self, speed: Speed) {
        self.chip.usb_reset_done(speed);
    }

    /// The bus has gone idle (3 ms without traffic).
    pub fn usb_suspend(&mut self) {
        self.chip.usb_suspend();
    }

    /// The host resumes the bus.
    pub fn usb_resume(&mut self) {
        self.chip.usb_resume();
    }

    /// Whether the firmware asks a suspended host to resume (remote wake-up).
    #[must_use]
    pub fn usb_signals_resume(&self) -> bool {
        self.chip.usb_signals_resume()
    }

    /// The cable is pulled.
    pub fn usb_unplugged(&mut self) {
        self.chip.usb_unplugged();
    }

    /// The address the device answers to.
    #[must_use]
    pub fn usb_address(&self) -> u8 {
        self.chip.usb.address
    }

    /// A SETUP packet; always acknowledged.
    pub fn usb_setup(&mut self, packet: [u8; 8]) {
        self.chip.usb_setup(packet);
    }

    /// An IN token to endpoint `number`; a packet goes into `data` and counts as acknowledged.
    pub fn usb_in(&mut self, number: u8, data: &mut [u8; PACKET_MAX]) -> InReply {
        self.chip.usb_in(number, data)
    }

    /// An OUT packet to endpoint `number`, DATA1 if `toggle`.
    pub fn usb_out(&mut self, number: u8, toggle: bool, data: &[u8]) -> OutReply {
        self.chip.usb_out(number, toggle, data)
    }
}
