//! The chip's registers in XDATA: what reading and writing them does (TRM chapter 15).

use crate::chip::{CPU_RESET, Chip};
use crate::diagnostics::Rule;
use crate::endpoints::{Commit, SKIP};
use crate::gpif::Transaction;
use crate::interrupts::fifo;
use crate::regs::xdata;
use crate::time::{NEVER, Tick, tick_to_ps};

/// EP0CS bits.
const HSNAK: u8 = 0x80;
const BUSY: u8 = 0x02;
const STALL: u8 = 0x01;
/// REVCTL: OUT endpoints are armed by the firmware.
const DYN_OUT: u8 = 0x02;

/// Registers in XDATA.
impl Chip {
    pub(crate) fn read_register(&mut self, address: u16) -> u8 {
        self.check_sync_delay(address);
        match address {
            ..0xE670 => self.read_setup_register(address),
            0xE670..0xE680 => self.read_io_register(address),
            0xE680..0xE6C0 => self.read_usb_register(address),
            _ => self.read_gpif_register(address),
        }
    }

    /// E600 to E66F: configuration and interrupts.
    fn read_setup_register(&mut self, address: u16) -> u8 {
        match address {
            xdata::EP1OUTCFG => self.usb.ep1_out.cfg,
            xdata::EP1INCFG => self.usb.ep1_in.cfg,
            xdata::EP2CFG..=xdata::EP8CFG => self.eps[usize::from(address - xdata::EP2CFG)].cfg,
            xdata::EP2FIFOCFG..=xdata::EP8FIFOCFG => {
                self.eps[usize::from(address - xdata::EP2FIFOCFG)].fifocfg
            }
            xdata::EP2FIFOIE..=xdata::EP8FIFOIRQ => self.read_fifo_interrupt(address),
            xdata::IBNIE => self.int.ibn_ie,
            xdata::IBNIRQ => self.int.ibn_irq,
            xdata::NAKIE..=xdata::EPIRQ | xdata::USBERRIE | xdata::USBERRIRQ => {
                self.sync_sof();
                let (shift, enable) = Self::usb_interrupt_byte(address);
                let word = if enable { self.int.usb_ie } else { self.int.usb_irq };
                (word >> shift) as u8
            }
            xdata::GPIFIE => (self.int.fifo_ie >> 12) as u8,
            xdata::GPIFIRQ => (self.int.fifo_irq >> 12) as u8,
            xdata::INT2IVEC => self.int.usb_vector(),
            xdata::INT4IVEC => self.int.fifo_vector(),
            xdata::INTSETUP => self.int.setup,
            _ => self.read_plain(address),
        }
    }

    /// E670 to E67F: ports, I²C and autopointers.
    fn read_io_register(&mut self, address: u16) -> u8 {
        match address {
            xdata::I2CS => self.i2c.read_status(),
            xdata::I2DAT => {
                self.changed();
                self.i2c.read_data(self.tick)
            }
            xdata::I2CTL => self.i2c.control(),
            xdata::XAUTODAT1 | xdata::XAUTODAT2 => {
                let at = self.autopointer(usize::from(address - xdata::XAUTODAT1));
                self.read_memory(at)
            }
            _ => self.read_plain(address),
        }
    }

    /// E680 to E6BF: USB and endpoints.
    fn read_usb_register(&mut self, address: u16) -> u8 {
        match address {
            xdata::USBCS => self.read_usbcs(),
            xdata::TOGCTL => self.usb.togctl,
            xdata::USBFRAMEH => (self.usb.frame(self.tick).0 >> 8) as u8,
            xdata::USBFRAMEL => self.usb.frame(self.tick).0 as u8,
            xdata::MICROFRAME => self.usb.frame(self.tick).1,
            xdata::FNADDR => self.usb.address,
            xdata::EP0BCH => (self.usb.ep0_count >> 8) as u8,
            xdata::EP0BCL => self.usb.ep0_count as u8,
            xdata::EP1OUTBC => self.usb.ep1_out.count,
            xdata::EP1INBC => self.usb.ep1_in.count,
            xdata::EP2BCH..=xdata::EP8BCL => self.read_byte_count(address),
            xdata::EP0CS => {
                u8::from(self.usb.hsnak) << 7
                    | u8::from(self.usb.ep0_busy) << 1
                    | u8::from(self.usb.ep0_stall)
            }
            xdata::EP1OUTCS => {
                u8::from(self.usb.ep1_out.busy) << 1 | u8::from(self.usb.ep1_out.stall)
            }
            xdata::EP1INCS => u8::from(self.usb.ep1_in.busy) << 1 | u8::from(self.usb.ep1_in.stall),
            xdata::EP2CS..=xdata::EP8CS => {
                let ep = &self.eps[usize::from(address - xdata::EP2CS)];
                ep.status() | u8::from(ep.stall)
            }
            xdata::EP2FIFOFLGS..=xdata::EP8FIFOFLGS => {
                self.flag_byte(usize::from(address - xdata::EP2FIFOFLGS))
            }
            xdata::EP2FIFOBCH..=xdata::EP8FIFOBCL => {
                let offset = usize::from(address - xdata::EP2FIFOBCH);
                let bytes = self.eps[offset / 2].fifo_bytes() as u16;
                bytes.to_be_bytes()[offset % 2]
            }
            0xE6B8..=0xE6BF => self.usb.setup[usize::from(address - xdata::SETUPDAT)],
            _ => self.read_plain(address),
        }
    }

    /// E6C0 to E6FF: the GPIF.
    fn read_gpif_register(&mut self, address: u16) -> u8 {
        match address {
            xdata::GPIFIDLECS => self.gpif_done_bit() | self.reg(address) & 0x01,
            xdata::GPIFADRH => (self.gpif.address >> 8) as u8,
            xdata::GPIFADRL => self.gpif.address as u8,
            xdata::GPIFTCB3..=xdata::GPIFTCB0 => {
                self.gpif.count.to_be_bytes()[usize::from(address - xdata::GPIFTCB3)]
            }
            xdata::EP2GPIFFLGSEL..=xdata::EP8GPIFTRIG => self.read_gpif_endpoint(address),
            xdata::XGPIFSGLDATH => (self.gpif.single_in >> 8) as u8,
            xdata::XGPIFSGLDATLX => {
                let low = self.gpif.single_in as u8;
                self.gpif_trigger(Transaction::SingleRead, address);
                low
            }
            xdata::XGPIFSGLDATLNOX => self.gpif.single_in as u8,
            _ => self.read_plain(address),
        }
    }

    fn read_plain(&mut self, address: u16) -> u8 {
        if !Self::is_plain(address) {
            self.not_modelled(address, "this register");
        }
        self.reg(address)
    }

    /// Registers that just keep what is written.
    fn is_plain(address: u16) -> bool {
        matches!(
            address,
            xdata::CPUCS..=xdata::FIFORESET
                | xdata::UART230..=xdata::GPIFHOLDAMOUNT
                | xdata::EP2AUTOINLENH..=xdata::EP8AUTOINLENL
                | xdata::EP2FIFOPFH..=xdata::EP8FIFOPFL
                | 0xE640..=0xE643
                | xdata::ERRCNTLIM
                | xdata::PORTACFG..=xdata::PORTECFG
                | xdata::WAKEUPCS
                | xdata::SUDPTRH..=xdata::SUDPTRCTL
                | xdata::GPIFWFSELECT..=xdata::GPIFCTLCFG
                | xdata::FLOWSTATE..=xdata::FLOWSTBPERIOD
                | xdata::GPIFREADYCFG
        )
    }

    pub(crate) fn write_register(&mut self, address: u16, value: u8) {
        self.check_sync_delay(address);
        self.set_reg(address, value);
        self.changed();
        self.gpif.quiet_until = 0;
        match address {
            ..0xE670 => self.write_setup_register(address, value),
            0xE670..0xE680 => self.write_io_register(address, value),
            0xE680..0xE6C0 => self.write_usb_register(address, value),
            _ => self.write_gpif_register(address, value),
        }
    }

    /// E600 to E66F: configuration and interrupts.
    fn write_setup_register(&mut self, address: u16, value: u8) {
        match address {
            xdata::CPUCS => self.write_cpucs(value),
            xdata::IFCONFIG => self.write_ifconfig(value),
            xdata::FIFORESET => self.write_fiforeset(value),
            xdata::EP1OUTCFG => self.usb.ep1_out.cfg = value,
            xdata::EP1INCFG => self.usb.ep1_in.cfg = value,
            xdata::EP2CFG..=xdata::EP8CFG => self.write_epcfg(address, value),
            xdata::EP2FIFOCFG..=xdata::EP8FIFOCFG => {
                let firmware_arms = self.reg(xdata::REVCTL) & DYN_OUT != 0;
                let index = usize::from(address - xdata::EP2FIFOCFG);
                self.eps[index].configure_fifo(value, firmware_arms);
                self.fifo_changed();
            }
            xdata::EP2AUTOINLENH..=xdata::EP8AUTOINLENL => {
                let at = address & !1;
                let length = u16::from_be_bytes([self.reg(at) & 0x07, self.reg(at | 1)]);
                self.eps[usize::from(address - xdata::EP2AUTOINLENH) / 2].autoinlen = length;
            }
            xdata::EP2FIFOPFH..=xdata::EP8FIFOPFL => {
                let at = address & !1;
                let flag = u16::from_be_bytes([self.reg(at), self.reg(at | 1)]);
                self.eps[usize::from(address - xdata::EP2FIFOPFH) / 2].pf = flag;
                self.fifo_changed();
            }
            xdata::INPKTEND | xdata::OUTPKTEND => self.write_pktend(address, value),
            xdata::EP2FIFOIE..=xdata::EP8FIFOIRQ => self.write_fifo_interrupt(address, value),
            xdata::IBNIE => self.int.ibn_ie = value & 0x3F,
            xdata::IBNIRQ => self.int.ibn_irq &= !value,
            xdata::NAKIE..=xdata::EPIRQ | xdata::USBERRIE | xdata::USBERRIRQ => {
                self.write_usb_interrupt(address, value);
            }
            xdata::GPIFIE => {
                let others = self.int.fifo_ie & 0x0FFF;
                self.int.set_fifo_ie(others | u16::from(value & 3) << 12);
            }
            xdata::GPIFIRQ => self.int.clear_fifo(u16::from(value & 3) << 12),
            xdata::CLRERRCNT => {}
            xdata::INTSETUP => self.int.setup = value,
            _ if Self::is_plain(address) => {}
            _ => self.not_modelled(address, "this register"),
        }
    }

    /// E670 to E67F: ports, I²C and autopointers.
    fn write_io_register(&mut self, address: u16, value: u8) {
        match address {
            xdata::I2CS => self.i2c.write_status(self.tick, value),
            xdata::I2DAT => self.i2c.write_data(self.tick, value),
            xdata::I2CTL => self.i2c.write_control(value),
            xdata::XAUTODAT1 | xdata::XAUTODAT2 => {
                let at = self.autopointer(usize::from(address - xdata::XAUTODAT1));
                self.write_memory(at, value);
            }
            _ if Self::is_plain(address) => {}
            _ => self.not_modelled(address, "this register"),
        }
    }

    /// E680 to E6BF: USB and endpoints.
    fn write_usb_register(&mut self, address: u16, value: u8) {
        match address {
            xdata::USBCS => self.usb.usbcs = value & 0x0F,
            xdata::SUSPEND => self.asleep = true,
            xdata::TOGCTL => self.write_togctl(value),
            xdata::EP0BCH => {
                self.usb.ep0_count = u16::from(value) << 8 | self.usb.ep0_count & 0xFF;
            }
            xdata::EP0BCL => self.write_ep0bcl(value),
            xdata::EP1OUTBC => self.usb.ep1_out.busy = true,
            xdata::EP1INBC => {
                self.usb.ep1_in.count = value;
                self.usb.ep1_in.busy = true;
            }
            xdata::EP2BCH..=xdata::EP8BCL => self.write_byte_count(address, value),
            xdata::EP0CS => {
                self.usb.ep0_stall = value & STALL != 0;
                self.usb.hsnak &= value & HSNAK == 0;
            }
            xdata::EP1OUTCS => self.usb.ep1_out.stall = value & STALL != 0,
            xdata::EP1INCS => {
                self.usb.ep1_in.stall = value & STALL != 0;
                // Writing 1 to BUSY takes back an armed packet.
                self.usb.ep1_in.busy &= value & BUSY == 0;
            }
            xdata::EP2CS..=xdata::EP8CS => {
                self.eps[usize::from(address - xdata::EP2CS)].stall = value & STALL != 0;
            }
            xdata::SUDPTRL => self.start_pointer(),
            _ if Self::is_plain(address) => {}
            _ => self.not_modelled(address, "this register"),
        }
    }

    /// E6C0 to E6FF: the GPIF.
    fn write_gpif_register(&mut self, address: u16, value: u8) {
        match address {
            xdata::GPIFADRH => {
                self.gpif.address = self.gpif.address & 0xFF | u16::from(value & 1) << 8;
            }
            xdata::GPIFADRL => {
                self.gpif.address = self.gpif.address & 0x100 | u16::from(value);
            }
            xdata::GPIFTCB3..=xdata::GPIFTCB0 => {
                let mut bytes = self.gpif.count.to_be_bytes();
                bytes[usize::from(address - xdata::GPIFTCB3)] = value;
                self.gpif.count = u32::from_be_bytes(bytes);
            }
            xdata::EP2GPIFFLGSEL..=xdata::EP8GPIFTRIG => {
                let offset = address - xdata::EP2GPIFFLGSEL;
                if offset & 7 == 2 {
                    self.gpif_trigger(Transaction::FifoWrite(usize::from(offset >> 3)), address);
                }
            }
            xdata::XGPIFSGLDATH => {
                self.gpif.single_out = self.gpif.single_out & 0xFF | u16::from(value) << 8;
            }
            xdata::XGPIFSGLDATLX => self.single_write(value, address),
            xdata::GPIFABORT => self.gpif_abort(),
            // Read-only, but firmware clears it along with its neighbours.
            xdata::GPIFREADYSTAT => {}
            _ if Self::is_plain(address) => {}
            _ => self.not_modelled(address, "this register"),
        }
    }

    fn single_write(&mut self, value: u8, address: u16) {
        self.gpif.single_out = self.gpif.single_out & 0xFF00 | u16::from(value);
        self.gpif_trigger(Transaction::SingleWrite, address);
    }

    /// The firmware cannot touch bit 0; the host resets the CPU.
    fn write_cpucs(&mut self, value: u8) {
        self.set_cpucs(value & !CPU_RESET | u8::from(self.held));
    }

    fn write_ifconfig(&mut self, value: u8) {
        if self.gpif.busy() {
            self.report(Rule::GpifBusy, xdata::IFCONFIG, || {
                "IFCONFIG is changed while the GPIF runs".into()
            });
        }
        if value & 3 == 1 {
            self.report(Rule::Reserved, xdata::IFCONFIG, || {
                "IFCONFIG sets the reserved interface mode 01".into()
            });
        }
    }

    fn write_fiforeset(&mut self, value: u8) {
        let number = value & 0x0F;
        let was = self.nak_all;
        if number == 0 {
            self.nak_all = value & 0x80 != 0;
            return;
        }
        self.nak_all |= value & 0x80 != 0;
        // NAKALL may come in the same write (it does on chips with the enhanced register).
        if value & 0x80 == 0 && !was {
            self.report(Rule::FifoResetOrder, xdata::FIFORESET, || {
                format!("FIFORESET resets EP{number} while NAKALL is clear; write 0x80 first")
            });
        }
        match number {
            2 | 4 | 6 | 8 => self.eps[usize::from(number / 2 - 1)].reset_fifo(),
            _ => self.report(Rule::Reserved, xdata::FIFORESET, || {
                format!("FIFORESET names endpoint {number}, which has no FIFO")
            }),
        }
        self.fifo_changed();
    }

    fn write_epcfg(&mut self, address: u16, value: u8) {
        let index = usize::from(address - xdata::EP2CFG);
        let reserved = if index % 2 == 1 { 0x0F } else { 0x04 };
        if value & reserved != 0 || index % 2 == 0 && value & 3 == 1 {
            self.report(Rule::Reserved, address, || {
                format!("EP{}CFG is set to {value:#04x}, which is not allowed", 2 * index + 2)
            });
        }
        self.eps[index].configure(value);
        self.buffers_checked = false;
        self.fifo_changed();
    }

    /// Looks, when USB first uses them, whether the buffers of EP2 to EP8 fit into their 4 KiB. EP4
    /// begins where a doubly buffered EP2 of 512 bytes ends (TRM figure 1-16).
    pub(crate) fn check_buffers(&mut self) {
        if std::mem::replace(&mut self.buffers_checked, true) {
            return;
        }
        let [ep2, ep4, ep6, ep8] = [0, 1, 2, 3].map(|index| self.eps[index].memory());
        if ep2 + ep4 + ep6 + ep8 > 4096 || ep4 > 0 && ep2 > 1024 {
            self.report(Rule::Reserved, xdata::EP2CFG, || {
                format!(
                    "EP2, EP4, EP6 and EP8 take {ep2}, {ep4}, {ep6} and {ep8} bytes of buffers, \
                     which overlap in the chip's 4096; switch unused endpoints off"
                )
            });
        }
    }

    fn write_pktend(&mut self, address: u16, value: u8) {
        let number = value & 0x0F;
        if !matches!(number, 2 | 4 | 6 | 8) {
            self.report(Rule::Reserved, address, || {
                format!("{address:#06x} names endpoint {number}; only 2, 4, 6 and 8 have FIFOs")
            });
            return;
        }
        let ep = &mut self.eps[usize::from(number / 2 - 1)];
        let skip = value & SKIP != 0;
        let commit = if address == xdata::INPKTEND { ep.end_in(skip) } else { ep.end_out(skip) };
        self.report_commit(commit, address);
    }

    fn read_byte_count(&mut self, address: u16) -> u8 {
        let offset = address - xdata::EP2BCH;
        match offset & 3 {
            high_low @ (0 | 1) => {
                let count = self.eps[usize::from(offset >> 2)].byte_count() as u16;
                count.to_be_bytes()[usize::from(high_low)]
            }
            _ => {
                self.not_modelled(address, "this register");
                0
            }
        }
    }

    fn write_byte_count(&mut self, address: u16, value: u8) {
        let offset = address - xdata::EP2BCH;
        let ep = &mut self.eps[usize::from(offset >> 2)];
        match offset & 3 {
            0 => ep.count_high = value,
            1 => {
                let commit = ep.commit(value);
                self.report_commit(commit, address);
            }
            _ => self.not_modelled(address, "this register"),
        }
    }

    fn report_commit(&mut self, commit: Commit, address: u16) {
        if commit == Commit::Nothing {
            self.report(Rule::DataLost, address, || {
                format!("{address:#06x} commits a packet, but no buffer is the CPU's")
            });
        }
        self.fifo_changed();
    }

    fn read_fifo_interrupt(&self, address: u16) -> u8 {
        let offset = address - xdata::EP2FIFOIE;
        let word = if offset & 1 == 0 { self.int.fifo_ie } else { self.int.fifo_irq };
        let bit = |first: u16| u8::from(word & first << (offset >> 1) != 0);
        bit(fifo::EP2PF) << 2 | bit(fifo::EP2EF) << 1 | bit(fifo::EP2FF)
    }

    fn write_fifo_interrupt(&mut self, address: u16, value: u8) {
        let offset = address - xdata::EP2FIFOIE;
        let bit = |on: u8, first: u16| if on != 0 { first << (offset >> 1) } else { 0 };
        let bits =
            bit(value & 4, fifo::EP2PF) | bit(value & 2, fifo::EP2EF) | bit(value & 1, fifo::EP2FF);
        if offset & 1 == 0 {
            let all = (fifo::EP2PF | fifo::EP2EF | fifo::EP2FF) << (offset >> 1);
            self.int.set_fifo_ie(self.int.fifo_ie & !all | bits);
            self.fifo_changed();
        } else {
            self.int.clear_fifo(bits);
        }
    }

    /// Position of a register in the 32 sources of INT2, and whether it is an enable.
    fn usb_interrupt_byte(address: u16) -> (u32, bool) {
        let shift = match address & !1 {
            xdata::USBIE => 0,
            xdata::EPIE => 8,
            xdata::NAKIE => 16,
            _ => 24,
        };
        (shift, address & 1 == 0)
    }

    fn write_usb_interrupt(&mut self, address: u16, value: u8) {
        self.sync_sof();
        let (shift, enable) = Self::usb_interrupt_byte(address);
        let bits = u32::from(value) << shift;
        if enable {
            self.int.set_usb_ie(self.int.usb_ie & !(0xFF << shift) | bits);
        } else {
            self.int.clear_usb(bits);
        }
    }

    pub(crate) fn gpif_done_bit(&self) -> u8 {
        u8::from(!self.gpif.busy()) << 7
    }

    fn read_gpif_endpoint(&mut self, address: u16) -> u8 {
        let offset = address - xdata::EP2GPIFFLGSEL;
        match offset & 7 {
            0 | 1 => self.reg(address),
            2 => {
                let done = self.gpif_done_bit();
                self.gpif_trigger(Transaction::FifoRead(usize::from(offset >> 3)), address);
                done
            }
            _ => {
                self.not_modelled(address, "this register");
                0
            }
        }
    }

    /// The registers of TRM 15.14 must not be accessed too soon after one another.
    fn check_sync_delay(&mut self, address: u16) {
        let slow = matches!(
            address,
            xdata::FIFORESET
                | xdata::FIFOPINPOLAR
                | xdata::REVCTL
                | xdata::EP2FIFOCFG..=xdata::EP8FIFOCFG
                | xdata::EP2AUTOINLENH..=xdata::EP8AUTOINLENL
                | xdata::EP2FIFOPFH..=xdata::EP8FIFOPFL
                | xdata::INPKTEND
                | xdata::OUTPKTEND
                | xdata::PINFLAGSAB
                | xdata::PINFLAGSCD
                | xdata::EP2FIFOIE..=xdata::EP8FIFOIRQ
                | xdata::GPIFIE
                | xdata::GPIFIRQ
                | xdata::EP2BCH..=xdata::EP8BCL
                | xdata::GPIFADRH
                | xdata::GPIFADRL
                | xdata::GPIFTCB3..=xdata::GPIFTCB0
                | xdata::EP2GPIFFLGSEL..=xdata::EP8GPIFTRIG
        );
        if !slow {
            return;
        }
        // The bus is asked while its instruction begins, so two accesses lie the length of the first
        // MOVX (at least 2 cycles) plus what stands between them apart.
        let needed = self.sync_delay_cycles() + 2;
        let since = self.last_slow.map_or(NEVER, |last| self.tick.saturating_sub(last));
        if since != 0 && since < needed * self.cycle {
            self.report(Rule::SyncDelay, address, || {
                format!("{address:#06x} is accessed too soon after another FIFO register: put SYNCDELAY between")
            });
        }
        self.last_slow = Some(self.tick);
    }

    /// ceil(1.5 (T_IFCLK / T_CLKOUT + 1)) machine cycles.
    fn sync_delay_cycles(&self) -> Tick {
        let ifclk = self.ifclock().period();
        let clkout = tick_to_ps(self.cycle) / 4;
        // Periods are cut to picoseconds; the 4 keeps that from adding a cycle.
        (3 * (ifclk + clkout)).div_ceil(2 * clkout + 4)
    }
}
