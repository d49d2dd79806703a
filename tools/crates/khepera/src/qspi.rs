//! QSPI: the queued serial peripheral interface of the QSM (QSMRM section 4), as master.
//!
//! A queue entry takes PCS-to-SCK delay + bits + delay after transfer, all in system clocks as the
//! registers say. Slave mode and mode fault are not modelled.

const NEVER: u64 = u64::MAX;

/// SPSR.
mod sr {
    pub const SPIF: u8 = 1 << 7;
    pub const MODF: u8 = 1 << 6;
    pub const HALTA: u8 = 1 << 5;
}

/// SPCR3, the high byte of the word it shares with SPSR.
mod cr3 {
    pub const LOOPQ: u8 = 1 << 2;
    pub const HMIE: u8 = 1 << 1;
    pub const HALT: u8 = 1 << 0;
}

const SPE: u16 = 1 << 15;
const MSTR: u16 = 1 << 15;
const SPIFIE: u16 = 1 << 15;
const WREN: u16 = 1 << 14;
const WRTO: u16 = 1 << 13;

/// Command RAM.
mod command {
    pub const CONT: u8 = 1 << 7;
    pub const BITSE: u8 = 1 << 6;
    pub const DT: u8 = 1 << 5;
    pub const DSCK: u8 = 1 << 4;
}

/// Pins of port QS, and of PQSPAR and DDRQS.
mod pin {
    pub const MISO: u8 = 1 << 0;
    pub const MOSI: u8 = 1 << 1;
    pub const SCK: u8 = 1 << 2;
}

/// What the QSPI does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    /// Selecting the peripheral of the entry.
    Start,
    /// Clocking its bits.
    Shift,
    /// After its last bit: PCS back, delay.
    After,
}

/// What the pins do, for the board to act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pins {
    /// PCS[3:0] took this value.
    Select(u8),
    /// Bits went out on MOSI, right-aligned; what is on MISO must be handed to `received`.
    Exchange { word: u16, bits: u8 },
}

/// The QSPI and port QS.
#[derive(Clone, Debug)]
pub(crate) struct Qspi {
    pub spcr0: u16,
    pub spcr1: u16,
    pub spcr2: u16,
    pub spcr3: u8,
    status: u8,
    seen: u8,
    pub receive: [u16; 16],
    pub transmit: [u16; 16],
    pub commands: [u8; 16],
    pub portqs: u8,
    pub pqspar: u8,
    pub ddrqs: u8,
    phase: Phase,
    at: u64,
    /// Entry under way or next.
    entry: u8,
    /// SPCR2 was written during a run: go on at its NEWQP.
    new_entry: bool,
    /// Entry finished last (CPTQP).
    completed: u8,
    pcs: u8,
}

impl Default for Qspi {
    fn default() -> Self {
        Self {
            spcr0: 0x0104,
            spcr1: 0x0404,
            spcr2: 0,
            spcr3: 0,
            status: 0,
            seen: 0,
            receive: [0; 16],
            transmit: [0; 16],
            commands: [0; 16],
            portqs: 0,
            pqspar: 0,
            ddrqs: 0,
            phase: Phase::Idle,
            at: NEVER,
            entry: 0,
            new_entry: false,
            completed: 0,
            pcs: 0xF,
        }
    }
}

impl Qspi {
    /// Chip reset; the queue RAM keeps its contents.
    pub fn reset(&mut self) {
        *self = Self {
            receive: self.receive,
            transmit: self.transmit,
            commands: self.commands,
            ..Self::default()
        };
    }

    pub fn next_event(&self) -> u64 {
        self.at
    }

    pub fn interrupt(&self) -> bool {
        self.status & sr::SPIF != 0 && self.spcr2 & SPIFIE != 0
            || self.status & (sr::MODF | sr::HALTA) != 0 && self.spcr3 & cr3::HMIE != 0
    }

    pub fn read_status(&mut self) -> u8 {
        self.seen = self.status;
        self.status | self.completed
    }

    /// Flags are cleared by reading them as 1 and then writing 0.
    pub fn write_status(&mut self, value: u8) {
        self.status &= !(self.seen & !value);
        self.seen = 0;
    }

    /// Returns what is wrong with the access, if anything.
    pub fn write_spcr1(&mut self, clk: u64, value: u16) -> Option<&'static str> {
        let started = value & SPE != 0 && self.spcr1 & SPE == 0;
        self.spcr1 = value;
        if value & SPE == 0 {
            self.phase = Phase::Idle;
            self.at = NEVER;
        } else if started {
            if self.spcr0 & MSTR == 0 {
                return Some("QSPI started as slave: not modelled, it stays idle");
            }
            if self.spcr0 & 0xFF < 2 {
                return Some("QSPI started with SPBR < 2: its clock does not run");
            }
            self.entry = (self.spcr2 & 0xF) as u8;
            self.new_entry = false;
            self.phase = Phase::Start;
            self.at = clk;
        }
        None
    }

    /// A write during a run is buffered until the entry under way is done.
    pub fn write_spcr2(&mut self, value: u16) {
        self.spcr2 = value & 0xEF0F;
        self.new_entry = self.phase != Phase::Idle;
    }

    pub fn write_spcr3(&mut self, clk: u64, value: u8) {
        let released = self.spcr3 & cr3::HALT != 0 && value & cr3::HALT == 0;
        self.spcr3 = value & 7;
        if released && self.phase == Phase::Start && self.at == NEVER {
            self.at = clk;
        }
    }

    /// The value on PCS[3:0] when the QSPI drives `value` on those pins that are assigned to it;
    /// others follow port QS, and what nobody drives is pulled up.
    fn pcs_pins(&self, value: u8) -> u8 {
        let assigned = self.pqspar >> 3 & 0xF;
        let output = self.ddrqs >> 3 & 0xF;
        let port = self.portqs >> 3 & 0xF;
        let driven = value & assigned | port & !assigned;
        driven & output | 0xF & !output
    }

    /// PCS as it is when no transfer is under way.
    pub fn idle_pcs(&self) -> u8 {
        self.pcs_pins(self.portqs >> 3 & 0xF)
    }

    /// What is on PCS[3:0] now.
    pub fn pcs(&self) -> u8 {
        self.pcs
    }

    /// Port pins changed: the new PCS if they differ, while no transfer is under way.
    pub fn port_changed(&mut self) -> Option<Pins> {
        (self.phase == Phase::Idle).then(|| self.set_pcs(self.idle_pcs())).flatten()
    }

    fn set_pcs(&mut self, pcs: u8) -> Option<Pins> {
        let changed = pcs != self.pcs;
        self.pcs = pcs;
        changed.then_some(Pins::Select(pcs))
    }

    fn bits(&self) -> u8 {
        match (self.commands[usize::from(self.entry)] & command::BITSE, self.spcr0 >> 10 & 0xF) {
            (0, _) => 8,
            (_, n @ 8..) => n as u8,
            (_, _) => 16,
        }
    }

    fn sck_clocks(&self) -> u64 {
        2 * u64::from(self.spcr0 & 0xFF)
    }

    /// Do what is due at `self.at`; what the pins do is returned.
    pub fn event(&mut self) -> Option<Pins> {
        let now = self.at;
        let control = self.commands[usize::from(self.entry)];
        match self.phase {
            Phase::Idle => {
                self.at = NEVER;
                None
            }
            Phase::Start => {
                if self.spcr3 & cr3::HALT != 0 {
                    self.status |= sr::HALTA;
                    self.at = NEVER;
                    return None;
                }
                let delay = match (control & command::DSCK, self.spcr1 >> 8 & 0x7F) {
                    (0, _) => self.sck_clocks() / 2,
                    (_, 0) => 128,
                    (_, n) => u64::from(n),
                };
                self.phase = Phase::Shift;
                self.at = now + delay + u64::from(self.bits()) * self.sck_clocks();
                let pcs = self.pcs_pins(control & 0xF);
                self.set_pcs(pcs)
            }
            Phase::Shift => {
                self.phase = Phase::After;
                self.at = now;
                let word = self.transmit[usize::from(self.entry)];
                let bits = self.bits();
                let mask = (0xFFFFu32 >> (16 - bits)) as u16;
                if self.ddrqs & pin::SCK == 0 || self.spcr3 & cr3::LOOPQ != 0 {
                    // Nobody outside sees a clock.
                    let inside = if self.spcr3 & cr3::LOOPQ != 0 { word & mask } else { mask };
                    self.receive[usize::from(self.entry)] = inside;
                    return None;
                }
                let driven = self.pqspar & self.ddrqs & pin::MOSI != 0;
                let word = if driven { word & mask } else { mask };
                Some(Pins::Exchange { word, bits })
            }
            Phase::After => self.after_transfer(now, control),
        }
    }

    /// The answer to `Pins::Exchange`.
    pub fn received(&mut self, word: u16, bits: u8) {
        let mask = (0xFFFFu32 >> (16 - bits)) as u16;
        let connected = self.pqspar & pin::MISO != 0 && self.ddrqs & pin::MISO == 0;
        let word = if connected { word & mask } else { mask };
        self.receive[usize::from(self.entry)] = word;
    }

    fn after_transfer(&mut self, now: u64, control: u8) -> Option<Pins> {
        let delay = match (control & command::DT, self.spcr1 & 0xFF) {
            (0, _) => 17,
            (_, 0) => 8192,
            (_, n) => 32 * u64::from(n),
        };
        let last = u16::from(self.entry) == self.spcr2 >> 8 & 0xF;
        self.completed = self.entry;
        self.phase = Phase::Start;
        self.at = now + delay;
        if last {
            self.status |= sr::SPIF;
            if self.spcr2 & WREN != 0 {
                self.entry = if self.spcr2 & WRTO != 0 { (self.spcr2 & 0xF) as u8 } else { 0 };
            } else {
                self.spcr1 &= !SPE;
                self.phase = Phase::Idle;
                self.at = NEVER;
            }
        } else {
            self.entry = (self.entry + 1) & 0xF;
        }
        if std::mem::take(&mut self.new_entry) {
            self.entry = (self.spcr2 & 0xF) as u8;
        }
        let ends = control & command::CONT == 0 || self.phase == Phase::Idle;
        if ends {
            let pcs = self.idle_pcs();
            return self.set_pcs(pcs);
        }
        None
    }
}
