//! SIM: the system integration module (SIMRM): clock, watchdog, periodic interrupt, ports, chip
//! selects, reset.

use common_sys::constants as board;
use sim::{Clock, MS, Ps};

use crate::timebase::Timebase;

const NEVER: u64 = u64::MAX;
const CRYSTAL: Clock = Clock::new(board::BOARD_CRYSTAL_HZ as u64);
/// How long the PLL stays unlocked after a change of W or Y. ASSUMPTION: the data sheet's limit is
/// 20 ms, typical parts are quicker.
const LOCK_TIME: Ps = 5 * MS;

/// CSBOOT and CS0..CS10.
pub(crate) const CHIP_SELECTS: usize = 12;
pub(crate) const CSBOOT: usize = 0;
pub(crate) const CS0: usize = 1;
pub(crate) const CS1: usize = 2;

/// Why the chip was last reset, as RSR says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The reset pin.
    External,
    /// Power-on.
    PowerUp,
    /// The software watchdog.
    Watchdog,
    /// The halt monitor, after a double bus fault.
    Halt,
}

impl ResetCause {
    fn rsr(self) -> u8 {
        match self {
            Self::External => 1 << 7,
            Self::PowerUp => 1 << 6,
            Self::Watchdog => 1 << 5,
            Self::Halt => 1 << 4,
        }
    }
}

/// SYPCR.
mod sypcr {
    pub const SWE: u8 = 1 << 7;
    pub const SWP: u8 = 1 << 6;
    pub const HME: u8 = 1 << 3;
    pub const BME: u8 = 1 << 2;
}

/// How a chip select answers an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Selected {
    /// CSOR.BYTE: 1 lower, 2 upper, 3 both.
    pub byte: u8,
    /// System clocks of the access; None if it waits for somebody else's DSACK.
    pub clocks: Option<u8>,
}

/// The SIM's registers and timers.
#[derive(Clone, Debug)]
pub(crate) struct Integration {
    simcr: u16,
    simcr_written: bool,
    syncr: u16,
    locked_at: u64,
    rsr: u8,
    sypcr: u8,
    sypcr_written: bool,
    swsr: u8,
    watchdog_edge: u64,
    pub watchdog_clk: u64,
    picr: u16,
    pitr: u16,
    pit_edge: u64,
    pub pit_clk: u64,
    pit_pending: bool,
    porte: u8,
    ddre: u8,
    pepar: u8,
    portf: u8,
    ddrf: u8,
    pfpar: u8,
    portc: u8,
    cspar: [u16; 2],
    csbar: [u16; CHIP_SELECTS],
    csor: [u16; CHIP_SELECTS],
}

/// What a write to a register changed beyond the register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Effect {
    pub frequency: bool,
    pub map: bool,
    pub warning: Option<&'static str>,
}

impl Effect {
    fn warn(what: &'static str) -> Self {
        Self { warning: Some(what), ..Self::default() }
    }
}

impl Integration {
    /// State after a reset at clock `clk`.
    pub fn new(cause: ResetCause, clk: u64, time: &Timebase) -> Self {
        let mut csbar = [0; CHIP_SELECTS];
        let mut csor = [0; CHIP_SELECTS];
        // Data bus pulled up: CSBOOT for a 16-bit port, 13 wait states, 1 MByte at 0.
        csbar[CSBOOT] = 0x0007;
        csor[CSBOOT] = 0x7B70;
        let mut new = Self {
            simcr: 0x60CF,
            simcr_written: false,
            syncr: 0x3F00,
            locked_at: clk,
            rsr: cause.rsr(),
            sypcr: sypcr::SWE,
            sypcr_written: false,
            swsr: 0,
            watchdog_edge: NEVER,
            watchdog_clk: NEVER,
            picr: 0x000F,
            pitr: 0,
            pit_edge: NEVER,
            pit_clk: NEVER,
            pit_pending: false,
            porte: 0xFF,
            ddre: 0,
            pepar: 0xFF,
            portf: 0xFF,
            ddrf: 0,
            pfpar: 0xFF,
            portc: 0x7F,
            cspar: [0x3FFF, 0x03FF],
            csbar,
            csor,
        };
        new.restart_watchdog(clk, time);
        new
    }

    /// fsys = 4 * fref * (Y + 1) * 2^(2W + X).
    pub fn system_hz(&self) -> u64 {
        let y = u64::from(self.syncr >> 8 & 0x3F);
        let exponent = 2 * (self.syncr >> 15) + (self.syncr >> 14 & 1);
        (4 * CRYSTAL.hz() * (y + 1)) << exponent
    }

    pub fn iarb(&self) -> u8 {
        (self.simcr & 0xF) as u8
    }

    /// SIMCR.MM: the registers lie at FFF000, else at 7FF000.
    pub fn registers_high(&self) -> bool {
        self.simcr & 0x40 != 0
    }

    pub fn bus_monitor(&self) -> bool {
        self.sypcr & sypcr::BME != 0
    }

    /// System clocks after which the bus monitor ends an access that nobody answers (BMT).
    pub fn bus_monitor_clocks(&self) -> u64 {
        64 >> (self.sypcr & 3)
    }

    pub fn halt_monitor(&self) -> bool {
        self.sypcr & sypcr::HME != 0
    }

    pub fn pit_level(&self) -> u8 {
        if self.pit_pending { (self.picr >> 8 & 7) as u8 } else { 0 }
    }

    /// No supply, no clock: nothing times out.
    pub fn stop_timers(&mut self) {
        (self.watchdog_edge, self.watchdog_clk) = (NEVER, NEVER);
        (self.pit_edge, self.pit_clk) = (NEVER, NEVER);
    }

    pub fn acknowledge_pit(&mut self) -> u8 {
        self.pit_pending = false;
        self.picr as u8
    }

    /// Interrupt pins (bit n = IRQn, 1 = asserted) that PFPAR makes interrupt pins, given their
    /// levels.
    pub fn irq_asserted(&self, levels: u8) -> u8 {
        !levels & self.pfpar & 0xFE
    }

    /// Whether an external interrupt of `level` is told to use its autovector: by a chip select for
    /// CPU space, or by the AVEC pin, which the board ties low (ASSUMPTION).
    pub fn autovector(&self, level: u8) -> bool {
        let avec_pin = self.pepar & 1 << 2 != 0;
        let by_select = self.csor.iter().any(|&csor| {
            let ipl = (csor >> 1 & 7) as u8;
            csor >> 13 & 3 != 0 && csor >> 4 & 3 == 0 && csor & 1 != 0 && (ipl == 0 || ipl == level)
        });
        avec_pin || by_select
    }

    /// Port F as read: the pin's level for a discrete input, else what was written (SIMRM 8). The
    /// interrupt lines lie on its pins.
    fn port_f(&self, irq_levels: u8) -> u8 {
        let input = !self.ddrf & !self.pfpar;
        irq_levels & input | self.portf & !input
    }

    /// Pins of port F that are outputs and high.
    pub fn port_f_high(&self) -> u8 {
        self.portf & self.ddrf & !self.pfpar
    }

    /// Pins of port F that are outputs and low; inputs are pulled up.
    pub fn port_f_low(&self) -> u8 {
        !self.portf & self.ddrf & !self.pfpar
    }

    /// Port E as read; nothing but pull-ups lies on its pins.
    fn port_e(&self) -> u8 {
        let input = !self.ddre & !self.pepar;
        self.porte | input
    }

    fn crystal_edge(time: &Timebase, clk: u64) -> u64 {
        CRYSTAL.edge_at_or_after(time.ps(clk))
    }

    fn edge_clk(time: &Timebase, edge: u64) -> u64 {
        if edge == NEVER { NEVER } else { time.clk_at_or_after(CRYSTAL.edge(edge)) }
    }

    /// After a change of frequency: timers run from the crystal and keep their times.
    pub fn replan(&mut self, time: &Timebase) {
        self.pit_clk = Self::edge_clk(time, self.pit_edge);
        self.watchdog_clk = Self::edge_clk(time, self.watchdog_edge);
    }

    fn restart_watchdog(&mut self, clk: u64, time: &Timebase) {
        self.watchdog_edge = if self.sypcr & sypcr::SWE == 0 {
            NEVER
        } else {
            let first = if self.sypcr & sypcr::SWP != 0 { 18 } else { 9 };
            let edges = 1u64 << (first + 2 * u32::from(self.sypcr >> 4 & 3));
            Self::crystal_edge(time, clk) + edges
        };
        self.watchdog_clk = Self::edge_clk(time, self.watchdog_edge);
    }

    /// PIT period in crystal edges, 0 = stopped.
    fn pit_edges(&self) -> u64 {
        let prescale = if self.pitr & 0x100 != 0 { 512 } else { 1 };
        4 * prescale * u64::from(self.pitr & 0xFF)
    }

    /// PITR was written: a running timer finishes its count first (SIMRM 4.2.10).
    fn write_pitr(&mut self, clk: u64, time: &Timebase) {
        if self.pit_edge != NEVER {
            return;
        }
        let edges = self.pit_edges();
        self.pit_edge = if edges == 0 { NEVER } else { Self::crystal_edge(time, clk) + edges };
        self.pit_clk = Self::edge_clk(time, self.pit_edge);
    }

    /// The periodic timer ran down.
    pub fn pit_event(&mut self, time: &Timebase) {
        self.pit_pending = self.picr & 0x0700 != 0;
        let edges = self.pit_edges();
        self.pit_edge = if edges == 0 { NEVER } else { self.pit_edge + edges };
        self.pit_clk = Self::edge_clk(time, self.pit_edge);
    }

    /// How chip select `n` answers at `address`; None if it does not.
    pub fn select(&self, n: usize, address: u32, write: bool) -> Option<Selected> {
        const BLOCK_BITS: [u32; 8] = [11, 13, 14, 16, 17, 18, 19, 20];
        let field = if n < 7 { self.cspar[0] >> (2 * n) } else { self.cspar[1] >> (2 * (n - 7)) };
        let csor = self.csor[n];
        let byte = (csor >> 13 & 3) as u8;
        let direction = csor >> 11 & if write { 2 } else { 1 };
        // The CPU is taken to be in supervisor state, where this firmware always is.
        let space = csor >> 4 & 2;
        if field & 2 == 0 || byte == 0 || direction == 0 || space == 0 {
            return None;
        }
        let base = u32::from(self.csbar[n] & 0xFFF8) << 8;
        let bits = BLOCK_BITS[usize::from(self.csbar[n] & 7)];
        if address >> bits != base >> bits {
            return None;
        }
        let clocks = match csor >> 6 & 0xF {
            15 => None,
            14 => Some(2),
            waits => Some(3 + waits as u8),
        };
        Some(Selected { byte, clocks })
    }

    /// Word at even `offset`.
    pub fn read(&self, clk: u64, offset: u32, irq_levels: u8) -> u16 {
        match offset {
            0x00 => self.simcr,
            0x04 => self.syncr | u16::from(clk >= self.locked_at) << 3,
            0x06 => u16::from(self.rsr),
            0x10 | 0x12 => u16::from(self.port_e()),
            0x14 => u16::from(self.ddre),
            0x16 => u16::from(self.pepar),
            0x18 | 0x1A => u16::from(self.port_f(irq_levels)),
            0x1C => u16::from(self.ddrf),
            0x1E => u16::from(self.pfpar),
            0x20 => u16::from(self.sypcr),
            0x22 => self.picr,
            0x24 => self.pitr,
            0x40 => u16::from(self.portc),
            0x44 | 0x46 => self.cspar[(offset as usize - 0x44) / 2],
            0x48..=0x77 if offset & 2 == 0 => self.csbar[(offset as usize - 0x48) / 4],
            0x48..=0x77 => self.csor[(offset as usize - 0x48) / 4],
            _ => 0,
        }
    }

    /// Write the bytes in `mask` of the word at even `offset`.
    pub fn write(
        &mut self,
        clk: u64,
        time: &Timebase,
        offset: u32,
        value: u16,
        mask: u16,
    ) -> Effect {
        let merge = |old: u16| old & !mask | value & mask;
        let low = mask & 0x00FF != 0;
        let byte = value as u8;
        match offset {
            0x00 => {
                // MM can be written once.
                let keep = if self.simcr_written { 0x40 } else { 0 };
                self.simcr = merge(self.simcr) & !keep | self.simcr & keep;
                self.simcr_written = true;
                return Effect { map: true, ..Effect::default() };
            }
            0x04 => return self.write_syncr(clk, time, merge(self.syncr)),
            0x10 | 0x12 if low => self.porte = byte,
            0x14 if low => self.ddre = byte,
            0x16 if low => self.pepar = byte,
            0x18 | 0x1A if low => self.portf = byte,
            0x1C if low => self.ddrf = byte,
            0x1E if low => self.pfpar = byte,
            0x20 if low => {
                if self.sypcr_written {
                    return Effect::warn("SYPCR can be written once after reset; ignored");
                }
                self.sypcr_written = true;
                self.sypcr = byte;
                self.restart_watchdog(clk, time);
            }
            0x22 => {
                self.picr = merge(self.picr) & 0x07FF;
                self.pit_pending &= self.picr & 0x0700 != 0;
            }
            0x24 => {
                self.pitr = merge(self.pitr) & 0x01FF;
                self.write_pitr(clk, time);
            }
            0x26 if low => self.service_watchdog(clk, time, byte),
            0x40 if low => self.portc = byte & 0x7F,
            0x44 | 0x46 => {
                let n = (offset as usize - 0x44) / 2;
                self.cspar[n] = merge(self.cspar[n]);
                return Effect { map: true, ..Effect::default() };
            }
            0x48..=0x77 => {
                let n = (offset as usize - 0x48) / 4;
                let register = if offset & 2 == 0 { &mut self.csbar[n] } else { &mut self.csor[n] };
                *register = *register & !mask | value & mask;
                return Effect { map: true, ..Effect::default() };
            }
            0x10..=0x1F | 0x20 | 0x26 | 0x40 => {}
            _ => return Effect::warn("SIM register that is read-only or not modelled"),
        }
        Effect::default()
    }

    fn write_syncr(&mut self, clk: u64, time: &Timebase, value: u16) -> Effect {
        let relock = (self.syncr ^ value) & 0xBF00 != 0;
        self.syncr = value & 0xFF97;
        if relock {
            self.locked_at = clk + LOCK_TIME / 1_000 * time.hz() / 1_000_000_000;
        }
        Effect { frequency: true, ..Effect::default() }
    }

    fn service_watchdog(&mut self, clk: u64, time: &Timebase, byte: u8) {
        if self.swsr == 0x55 && byte == 0xAA {
            self.restart_watchdog(clk, time);
        }
        self.swsr = byte;
    }
}
