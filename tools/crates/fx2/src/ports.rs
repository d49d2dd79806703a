//! Which pin is driven by what (TRM chapter 13 and table 9-2).

use crate::chip::Chip;
use crate::endpoints::Endpoint;
use crate::pins::{Board, Driven, Sensed};
use crate::regs::xdata;
use serde::{Deserialize, Serialize};
use sim::Ps;

/// IFCONFIG bits 1..0.
const IFCFG: u8 = 0x03;
pub(crate) const IFCFG_GPIF: u8 = 0x02;
pub(crate) const IFCFG_SLAVE: u8 = 0x03;
/// GPIFCTLCFG: CTL pins have output enables instead of drive types.
const TRICTL: u8 = 0x80;
/// PORTACFG bits.
pub(crate) const PORTACFG_INT0: u8 = 0x01;
pub(crate) const PORTACFG_INT1: u8 = 0x02;
const PORTACFG_FLAGD: u8 = 0x80;
/// Port A pins of the slave FIFO: SLOE, FIFOADR0, FIFOADR1, PKTEND.
const SLAVE_PA: u8 = 0x74;
/// GPIFADR8 on PE7.
const PORTE_GPIFA8: u8 = 0x80;

/// Latches and output enables of ports A to E.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Ports {
    pub(crate) latch: [u8; 5],
    pub(crate) enable: [u8; 5],
}

impl Chip {
    /// IFCONFIG's mode.
    pub(crate) fn ifcfg(&self) -> u8 {
        self.reg(xdata::IFCONFIG) & IFCFG
    }

    /// Port D carries `FD[15:8]`.
    pub(crate) fn word_wide(&self) -> bool {
        self.eps.iter().any(Endpoint::word_wide)
    }

    /// A port's pins as IOx reads them: what the chip drives itself, else what the board does.
    pub(crate) fn read_port(&self, port: usize, sensed: &Sensed) -> u8 {
        let own = self.driven.port_enable[port];
        self.ports.latch[port] & own | sensed.port[port] & !own
    }

    /// Works out the port pins after a register has changed.
    pub(crate) fn update_port_pins(&mut self) {
        let bus = self.ifcfg() & 2 != 0;
        let slave = self.ifcfg() == IFCFG_SLAVE;
        let port_a = self.reg(xdata::PORTACFG);
        let mut others = [0; 5];
        others[0] = port_a & (PORTACFG_INT0 | PORTACFG_INT1)
            | if slave { SLAVE_PA | port_a & (PORTACFG_FLAGD | 0x40) } else { 0 };
        others[1] = if bus { 0xFF } else { 0 };
        others[2] = self.reg(xdata::PORTCCFG);
        others[3] = if bus && self.word_wide() { 0xFF } else { 0 };
        others[4] = self.reg(xdata::PORTECFG);
        for (port, other) in others.into_iter().enumerate() {
            self.driven.port[port] = self.ports.latch[port];
            self.driven.port_enable[port] = self.ports.enable[port] & !other;
        }
        if slave && port_a & PORTACFG_FLAGD != 0 {
            let flag = self.flag_pin(3);
            self.driven.port[0] = self.driven.port[0] & 0x7F | u8::from(flag) << 7;
            self.driven.port_enable[0] |= 0x80;
        }
        let a8 = self.reg(xdata::PORTECFG) & PORTE_GPIFA8 != 0;
        self.driven.gpifadr_enable = u16::from(self.reg(xdata::PORTCCFG)) | u16::from(a8) << 8;
        self.driven.gpifadr = self.gpif.address;
    }

    /// Works out CTL and FD for a GPIF at rest, or the flags of the slave FIFO.
    pub(crate) fn update_idle_pins(&mut self) {
        (self.driven.ctl, self.driven.ctl_enable) = self.ctl_pins(self.reg(xdata::GPIFIDLECTL));
        let drive = self.ifcfg() == IFCFG_GPIF && self.reg(xdata::GPIFIDLECS) & 1 != 0;
        self.driven.fd_enable = if drive { self.fd_mask() } else { 0 };
        if self.ifcfg() == IFCFG_SLAVE {
            let flags = (0..3).fold(0, |bits, n| bits | u8::from(self.flag_pin(n)) << n);
            self.driven.ctl = self.driven.ctl & !7 | flags;
            self.driven.ctl_enable |= 7;
        }
    }

    /// FD pins in use.
    pub(crate) fn fd_mask(&self) -> u16 {
        if self.word_wide() { 0xFFFF } else { 0x00FF }
    }

    /// Levels and enables of `CTL[5:0]` for an OUTPUT byte (or GPIFIDLECTL, which has the same form).
    pub(crate) fn ctl_pins(&self, output: u8) -> (u8, u8) {
        let config = self.reg(xdata::GPIFCTLCFG);
        if config & TRICTL != 0 {
            // CTL[3:0] with their enables above them; CTL5 and CTL4 are not available.
            (output & 0x0F, output >> 4)
        } else {
            // An open-drain pin is driven only to 0.
            (output & 0x3F, 0x3F & !(config & output))
        }
    }

    /// Hands a change of the pins to the board.
    pub(crate) fn flush_pins(&mut self, now: Ps, board: &mut dyn Board) {
        if self.driven != self.shown {
            self.shown = self.driven;
            board.drive(now, &self.shown);
            self.stop |= board.end_slice();
        }
    }

    /// What the chip drives at present.
    pub(crate) fn shown(&self) -> &Driven {
        &self.shown
    }
}
