//! The processor's state and its step.

use crate::interrupts::request_mask;
use crate::{Bus, Source, sfr};
use serde::{Deserialize, Serialize};

/// PSW bit: odd number of ones in the accumulator.
const PARITY: u8 = 0x01;

/// PCON bit. STOP (bit 1 of other parts of the family) is not documented for the FX2 and does
/// nothing here: an assumption.
const IDLE: u8 = 0x01;

/// IE bit: all sources but resume.
const EA: u8 = 0x80;

/// In-service bits, one per priority level; a source may interrupt only what is below its level.
const SERVICE_LOW: u8 = 1;
const SERVICE_HIGH: u8 = 2;
const SERVICE_RESUME: u8 = 4;

/// Machine cycles of the LCALL that hardware inserts to enter an interrupt routine.
const VECTOR_CYCLES: u32 = 4;

/// An 8051 core with its internal RAM.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cpu {
    /// Interrupt request lines, level: bit n = `Source` n requests. The chip keeps them current;
    /// the core looks at them before each instruction and never changes them.
    pub requests: u16,
    enabled: u16,
    pub(crate) pc: u16,
    pub(crate) acc: u8,
    pub(crate) b: u8,
    /// Without parity, which is worked out when read.
    pub(crate) psw: u8,
    pub(crate) sp: u8,
    pub(crate) dptr: [u16; 2],
    pub(crate) dps: u8,
    pcon: u8,
    pub(crate) ckcon: u8,
    pub(crate) mpage: u8,
    ie: u8,
    ip: u8,
    eie: u8,
    eip: u8,
    in_service: u8,
    /// The next instruction runs before any interrupt is taken.
    pub(crate) hold: bool,
    #[serde(with = "sim::hex")]
    pub(crate) iram: [u8; 256],
}

impl Default for Cpu {
    fn default() -> Self {
        Self::new()
    }
}

impl Cpu {
    /// A core out of reset, with its RAM cleared and no requests.
    #[must_use]
    pub fn new() -> Self {
        Self {
            requests: 0,
            enabled: Source::Resume.mask(),
            pc: 0,
            acc: 0,
            b: 0,
            psw: 0,
            sp: 0x07,
            dptr: [0; 2],
            dps: 0,
            pcon: 0x30,
            ckcon: 0x01,
            mpage: 0,
            ie: 0,
            ip: 0x80,
            eie: 0xE0,
            eip: 0xE0,
            in_service: 0,
            hold: false,
            iram: [0; 256],
        }
    }

    /// Resets the core. Internal RAM keeps its contents and the request lines are the chip's.
    pub fn reset(&mut self) {
        *self = Self { requests: self.requests, iram: self.iram, ..Self::new() };
    }

    /// Takes an interrupt, or executes one instruction, or idles for one cycle; returns the machine
    /// cycles that took (4 clocks each; at least 1).
    ///
    /// An interrupt is taken by a step of its own, a call of 4 cycles. Not before the instruction
    /// after a RETI or a write of IE, IP, EIE or EIP is one taken, as in the DS80C320.
    pub fn step<B: Bus>(&mut self, bus: &mut B) -> u32 {
        if self.requests & self.enabled != 0
            && !self.hold
            && let Some(source) = self.next_interrupt()
        {
            self.enter(source, bus);
            return VECTOR_CYCLES;
        }
        if self.pcon & IDLE != 0 {
            return 1;
        }
        self.hold = false;
        self.execute(bus)
    }

    /// The address of the next instruction.
    #[must_use]
    pub fn pc(&self) -> u16 {
        self.pc
    }

    /// Continues at `address`, as a debugger does.
    pub fn set_pc(&mut self, address: u16) {
        self.pc = address;
    }

    /// Internal RAM.
    #[must_use]
    pub fn iram(&self) -> &[u8; 256] {
        &self.iram
    }

    /// Internal RAM, to be changed.
    pub fn iram_mut(&mut self) -> &mut [u8; 256] {
        &mut self.iram
    }

    /// Whether the core waits in IDLE for an interrupt. Its steps take one cycle each; a chip may
    /// skip to the next event while this holds and [`Self::next_interrupt`] is `None`.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.pcon & IDLE != 0
    }

    /// The interrupt that the requests, enables and priorities of this moment admit.
    #[must_use]
    pub fn next_interrupt(&self) -> Option<Source> {
        let pending = self.requests & self.enabled;
        let high = pending & request_mask(self.ip, self.eip);
        if pending & Source::Resume.mask() != 0 {
            return (self.in_service < SERVICE_RESUME).then_some(Source::Resume);
        }
        let candidates = match self.in_service {
            0 if high == 0 => pending,
            0..SERVICE_HIGH => high,
            _ => 0,
        };
        Source::ALL.get(candidates.trailing_zeros() as usize).copied()
    }

    /// Reads one of the core's registers without side effects; `None` if the chip owns it.
    #[must_use]
    pub fn sfr(&self, address: u8) -> Option<u8> {
        Some(match address {
            sfr::SP => self.sp,
            sfr::DPL0 => self.dptr[0].to_le_bytes()[0],
            sfr::DPH0 => self.dptr[0].to_le_bytes()[1],
            sfr::DPL1 => self.dptr[1].to_le_bytes()[0],
            sfr::DPH1 => self.dptr[1].to_le_bytes()[1],
            sfr::DPS => self.dps,
            sfr::PCON => self.pcon,
            sfr::CKCON => self.ckcon,
            sfr::MPAGE => self.mpage,
            sfr::IE => self.ie,
            sfr::IP => self.ip,
            sfr::PSW => self.psw | (self.acc.count_ones() as u8 & PARITY),
            sfr::ACC => self.acc,
            sfr::EIE => self.eie,
            sfr::B => self.b,
            sfr::EIP => self.eip,
            _ => return None,
        })
    }

    /// Writes one of the core's registers as a debugger does: without telling the bus and without
    /// delaying an interrupt. `false` if the chip owns it.
    pub fn set_sfr(&mut self, address: u8, value: u8) -> bool {
        fn byte(pointer: u16, index: usize, value: u8) -> u16 {
            let mut bytes = pointer.to_le_bytes();
            bytes[index] = value;
            u16::from_le_bytes(bytes)
        }
        match address {
            sfr::SP => self.sp = value,
            sfr::DPL0 => self.dptr[0] = byte(self.dptr[0], 0, value),
            sfr::DPH0 => self.dptr[0] = byte(self.dptr[0], 1, value),
            sfr::DPL1 => self.dptr[1] = byte(self.dptr[1], 0, value),
            sfr::DPH1 => self.dptr[1] = byte(self.dptr[1], 1, value),
            sfr::DPS => self.dps = value & 0x01,
            sfr::PCON => self.pcon = value | 0x30,
            sfr::CKCON => self.ckcon = value,
            sfr::MPAGE => self.mpage = value,
            sfr::IE => {
                self.ie = value;
                self.update_enabled();
            }
            sfr::IP => self.ip = value | 0x80,
            sfr::PSW => self.psw = value & !PARITY,
            sfr::ACC => self.acc = value,
            sfr::EIE => {
                self.eie = value | 0xE0;
                self.update_enabled();
            }
            sfr::B => self.b = value,
            sfr::EIP => self.eip = value | 0xE0,
            _ => return false,
        }
        true
    }

    fn update_enabled(&mut self) {
        let masked = if self.ie & EA != 0 { request_mask(self.ie, self.eie) } else { 0 };
        self.enabled = Source::Resume.mask() | masked;
    }

    /// Calls the vector of `source`, out of IDLE if need be.
    fn enter<B: Bus>(&mut self, source: Source, bus: &mut B) {
        self.in_service |= if source == Source::Resume {
            SERVICE_RESUME
        } else if source.mask() & request_mask(self.ip, self.eip) != 0 {
            SERVICE_HIGH
        } else {
            SERVICE_LOW
        };
        self.pcon &= !IDLE;
        self.call(source.vector());
        bus.acknowledge(source);
    }

    /// Leaves the highest level in service: RETI.
    pub(crate) fn end_service(&mut self) {
        let highest = [SERVICE_RESUME, SERVICE_HIGH, SERVICE_LOW]
            .into_iter()
            .find(|level| self.in_service & level != 0);
        self.in_service &= !highest.unwrap_or(0);
    }
}
