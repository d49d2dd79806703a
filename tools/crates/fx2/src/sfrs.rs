//! The chip's special function registers, and the autopointers (TRM chapter 15).

use crate::chip::Chip;
use crate::gpif::Transaction;
use crate::pins::Board;
use crate::regs::{sfr, xdata};
use crate::time::tick_to_ps;

/// Special function registers and the paths of data through them.
impl Chip {
    /// The address that an autopointer gives, and its increment.
    pub(crate) fn autopointer(&mut self, index: usize) -> u16 {
        let at = self.autopointers[index];
        if self.autopointer_setup >> (index + 1) & 1 != 0 {
            self.autopointers[index] = at.wrapping_add(1);
        }
        at
    }

    pub(crate) fn read_sfr(&mut self, address: u8, board: &mut dyn Board) -> u8 {
        match address {
            sfr::IOA | sfr::IOB | sfr::IOC | sfr::IOD | sfr::IOE => {
                let sensed = board.sense(tick_to_ps(self.tick));
                self.read_port(Self::port_index(address), &sensed)
            }
            sfr::TCON => {
                self.timers.sync(self.tick);
                self.timers.tcon
            }
            sfr::TMOD => self.timers.tmod,
            sfr::TL0..=sfr::TH1 => {
                self.timers.read_count(self.tick, usize::from(address - sfr::TL0))
            }
            sfr::EXIF => self.int.exif,
            sfr::SCON0 => self.uarts[0].scon,
            sfr::SBUF0 => self.uarts[0].read_sbuf(),
            sfr::AUTOPTRH1 => (self.autopointers[0] >> 8) as u8,
            sfr::AUTOPTRL1 => self.autopointers[0] as u8,
            sfr::AUTOPTRH2 => (self.autopointers[1] >> 8) as u8,
            sfr::AUTOPTRL2 => self.autopointers[1] as u8,
            sfr::INT2CLR | sfr::INT4CLR => 0,
            sfr::EP2468STAT => self.eps.iter().enumerate().fold(0, |bits, (n, ep)| {
                bits | (u8::from(ep.cpu_full()) << 1 | u8::from(ep.cpu_empty())) << (2 * n)
            }),
            sfr::EP24FIFOFLGS => self.flag_byte(1) << 4 | self.flag_byte(0),
            sfr::EP68FIFOFLGS => self.flag_byte(3) << 4 | self.flag_byte(2),
            sfr::AUTOPTRSETUP => self.autopointer_setup,
            sfr::OEA..=sfr::OEE => self.ports.enable[usize::from(address - sfr::OEA)],
            sfr::EP01STAT => {
                u8::from(self.usb.ep1_in.busy) << 2
                    | u8::from(self.usb.ep1_out.busy) << 1
                    | u8::from(self.usb.ep0_busy)
            }
            sfr::GPIFTRIG => self.gpif_done_bit(),
            sfr::GPIFSGLDATH => (self.gpif.single_in >> 8) as u8,
            sfr::GPIFSGLDATLX => self.read_register(xdata::XGPIFSGLDATLX),
            sfr::GPIFSGLDATLNOX => self.gpif.single_in as u8,
            sfr::SCON1 => self.uarts[1].scon,
            sfr::SBUF1 => self.uarts[1].read_sbuf(),
            sfr::T2CON => {
                self.timers.sync(self.tick);
                self.timers.t2con
            }
            sfr::RCAP2L..=sfr::TH2 => {
                self.timers.read_timer2(self.tick, usize::from(address - sfr::RCAP2L))
            }
            sfr::EICON => self.int.eicon,
            _ => {
                self.not_modelled(u16::from(address), "this special function register");
                0xFF
            }
        }
    }

    pub(crate) fn write_sfr(&mut self, address: u8, value: u8) {
        let now = self.tick;
        self.dirty = true;
        match address {
            sfr::AUTOPTRH1 | sfr::AUTOPTRL1 | sfr::AUTOPTRH2 | sfr::AUTOPTRL2 => {}
            sfr::IOA | sfr::IOB | sfr::IOC | sfr::IOD | sfr::IOE | sfr::OEA..=sfr::OEE => {}
            _ => self.next_event = 0,
        }
        match address {
            sfr::IOA | sfr::IOB | sfr::IOC | sfr::IOD | sfr::IOE => {
                self.ports.latch[Self::port_index(address)] = value;
            }
            mcs51::sfr::CKCON => self.timers.set_ckcon(now, value),
            mcs51::sfr::PCON => self.timers.smod0 = value & 0x80 != 0,
            sfr::TCON => self.timers.write_tcon(now, value),
            sfr::TMOD => self.timers.write_tmod(now, value),
            sfr::TL0..=sfr::TH1 => {
                self.timers.write_count(now, usize::from(address - sfr::TL0), value);
            }
            sfr::EXIF => self.int.exif = value | 0x08,
            sfr::SCON0 => self.uarts[0].scon = value,
            sfr::SCON1 => self.uarts[1].scon = value,
            sfr::SBUF0 | sfr::SBUF1 => {
                let port = usize::from(address == sfr::SBUF1);
                let frame = self.uart_frame(port, false);
                self.uarts[port].send(now, value, frame);
            }
            sfr::AUTOPTRH1 => self.set_autopointer(0, 0xFF00, u16::from(value) << 8),
            sfr::AUTOPTRL1 => self.set_autopointer(0, 0x00FF, u16::from(value)),
            sfr::AUTOPTRH2 => self.set_autopointer(1, 0xFF00, u16::from(value) << 8),
            sfr::AUTOPTRL2 => self.set_autopointer(1, 0x00FF, u16::from(value)),
            sfr::INT2CLR => {
                let pending = self.int.usb_irq & self.int.usb_ie;
                self.int.clear_usb(pending & pending.wrapping_neg());
            }
            sfr::INT4CLR => {
                let pending = self.int.fifo_irq & self.int.fifo_ie;
                self.int.clear_fifo(pending & pending.wrapping_neg());
            }
            sfr::AUTOPTRSETUP => self.autopointer_setup = value & 7,
            sfr::OEA..=sfr::OEE => self.ports.enable[usize::from(address - sfr::OEA)] = value,
            sfr::GPIFTRIG => {
                let index = usize::from(value & 3);
                let transaction = if value & 4 != 0 {
                    Transaction::FifoRead(index)
                } else {
                    Transaction::FifoWrite(index)
                };
                self.gpif_trigger(transaction, u16::from(address));
            }
            sfr::GPIFSGLDATH => self.write_register(xdata::XGPIFSGLDATH, value),
            sfr::GPIFSGLDATLX => self.write_register(xdata::XGPIFSGLDATLX, value),
            sfr::T2CON => self.timers.write_t2con(now, value),
            sfr::RCAP2L..=sfr::TH2 => {
                self.timers.write_timer2(now, usize::from(address - sfr::RCAP2L), value);
            }
            sfr::EICON => self.int.eicon = value | 0x40,
            _ => self.not_modelled(u16::from(address), "this special function register"),
        }
    }

    fn set_autopointer(&mut self, index: usize, mask: u16, bits: u16) {
        self.autopointers[index] = self.autopointers[index] & !mask | bits;
    }

    pub(crate) fn port_index(address: u8) -> usize {
        match address {
            sfr::IOA => 0,
            sfr::IOB => 1,
            sfr::IOC => 2,
            sfr::IOD => 3,
            _ => 4,
        }
    }

    /// GPIFREADYSTAT: the RDY pins.
    pub(crate) fn read_ready(&mut self, board: &mut dyn Board) -> u8 {
        board.sense(tick_to_ps(self.tick)).rdy & 0x3F
    }

    /// The level of FLAGA..FLAGD (`pin` 0..=3) in slave-FIFO mode: active low unless FIFOPINPOLAR
    /// turns empty and full around.
    pub(crate) fn flag_pin(&self, pin: usize) -> bool {
        let select = match pin {
            0 => self.reg(xdata::PINFLAGSAB) & 0x0F,
            1 => self.reg(xdata::PINFLAGSAB) >> 4,
            2 => self.reg(xdata::PINFLAGSCD) & 0x0F,
            _ => self.reg(xdata::PINFLAGSCD) >> 4,
        };
        // 0: PF, FF, EF of the FIFO that FIFOADR selects, on FLAGA, B, C.
        let (kind, index) = match select {
            0 => (pin, usize::from(self.fifo_address)),
            4..=7 => (0, usize::from(select - 4)),
            8..=11 => (2, usize::from(select - 8)),
            12..=15 => (1, usize::from(select - 12)),
            _ => return true,
        };
        let ep = &self.eps[index];
        let polarity = self.reg(xdata::FIFOPINPOLAR);
        match kind {
            0 => !ep.programmable_flag(),
            1 => ep.fifo_full() == (polarity & 1 != 0),
            2 => ep.fifo_empty_flag() == (polarity & 2 != 0),
            _ => true,
        }
    }
}
