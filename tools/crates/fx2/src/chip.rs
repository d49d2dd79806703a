//! Everything around the core: memories, registers and their side effects.

use crate::diagnostics::{Diagnostics, Rule};
use crate::eeprom::Identity;
use crate::endpoints::{Commit, Endpoint, SKIP};
use crate::gpif::{Gpif, Transaction};
use crate::i2c::I2c;
use crate::interrupts::{Interrupts, fifo, usb};
use crate::pins::{Board, Driven};
use crate::ports::{PORTACFG_INT0, PORTACFG_INT1, Ports};
use crate::regs::{sfr, xdata};
use crate::time::{IfClock, NEVER, Tick, tick_to_ps};
use crate::timers::Timers;
use crate::uart::Uart;
use crate::usb::Usb;
use crate::{Config, descriptors};
use mcs51::Source;

const SCRATCH: u16 = 0xE000;
const SCRATCH_SIZE: usize = 0x200;
const RAM_MAX: usize = 0x4000;
/// CPUCS bits.
const CPU_RESET: u8 = 0x01;
const CLKSPD: u8 = 0x18;
/// EP0CS bits.
const HSNAK: u8 = 0x80;
const BUSY: u8 = 0x02;
const STALL: u8 = 0x01;
/// REVCTL: OUT endpoints are armed by the firmware.
const DYN_OUT: u8 = 0x02;
/// TCON bits.
const IT0: u8 = 0x01;
const IE0: u8 = 0x02;
const IT1: u8 = 0x04;
const IE1: u8 = 0x08;

/// The chip without its core.
#[derive(Clone, Debug)]
pub(crate) struct Chip {
    pub(crate) ram: Box<[u8; RAM_MAX]>,
    pub(crate) ram_size: usize,
    scratch: [u8; SCRATCH_SIZE],
    /// Memory on the external bus, if the board has some.
    external: Option<Vec<u8>>,
    /// What was written to 0xE600..0xE700; registers with a life of their own have it elsewhere.
    regs: [u8; 0x100],
    pub(crate) gpcr2: u8,
    pub(crate) tick: Tick,
    /// Ticks in a machine cycle: 4, 8 or 16.
    pub(crate) cycle: Tick,
    /// When [`Self::service`] has something to do.
    pub(crate) next_event: Tick,
    /// Address of the instruction being executed.
    pub(crate) pc: u16,
    /// Registers were touched that others depend on: see [`Self::settle`].
    pub(crate) dirty: bool,
    /// End the slice.
    pub(crate) stop: bool,
    pub(crate) requests: u16,
    /// CPUCS holds the CPU in reset.
    pub(crate) held: bool,
    /// The CPU comes out of reset.
    pub(crate) release: bool,
    /// The boot loader is through.
    pub(crate) booted: bool,
    /// Suspended: the oscillator stops once the CPU idles.
    pub(crate) asleep: bool,
    pub(crate) timers: Timers,
    pub(crate) uarts: [Uart; 2],
    pub(crate) i2c: I2c,
    pub(crate) int: Interrupts,
    pub(crate) ports: Ports,
    pub(crate) driven: Driven,
    pub(crate) shown: Driven,
    pub(crate) gpif: Gpif,
    pub(crate) usb: Usb,
    pub(crate) eps: [Endpoint; 4],
    autopointers: [u16; 2],
    autopointer_setup: u8,
    /// FIFO flags at the last look, in the order of INT4's sources.
    flags: u16,
    /// INT0# and INT1# at the last look.
    int_pins: u8,
    /// The endpoints' buffers were looked at since the last change of EPxCFG.
    buffers_checked: bool,
    /// FIFORESET's NAKALL before the present write.
    nak_all: bool,
    /// FIFOADR as the slave FIFO's master sets it: index of EP2, 4, 6, 8.
    pub(crate) fifo_address: u8,
    /// When a register that wants SYNCDELAY was touched last.
    last_slow: Option<Tick>,
    pub(crate) diagnostics: Diagnostics,
}

impl Chip {
    pub(crate) fn new(config: &Config) -> Self {
        let mut chip = Self {
            ram: Box::new([0; RAM_MAX]),
            ram_size: config.ram.bytes(),
            scratch: [0; SCRATCH_SIZE],
            external: config.external_ram.then(|| vec![0; 0x1_0000]),
            regs: [0; 0x100],
            gpcr2: 0,
            tick: 0,
            cycle: 16,
            next_event: 0,
            pc: 0,
            dirty: true,
            stop: false,
            requests: 0,
            held: true,
            release: false,
            booted: false,
            asleep: false,
            timers: Timers::new(16),
            uarts: [Uart::default(), Uart::default()],
            i2c: I2c::default(),
            int: Interrupts::new(),
            ports: Ports::default(),
            driven: Driven::default(),
            shown: Driven::default(),
            gpif: Gpif::new(),
            usb: Usb::new(Identity { device: config.ram.device_release(), ..descriptors::BLANK }),
            eps: [(true, 0xA2), (false, 0xA0), (true, 0xE2), (false, 0xE0)]
                .map(|(large, cfg)| Endpoint::new(large, cfg)),
            autopointers: [0; 2],
            autopointer_setup: 0x06,
            flags: 0,
            int_pins: 3,
            buffers_checked: false,
            nak_all: false,
            fifo_address: 0,
            last_slow: None,
            diagnostics: Diagnostics::default(),
        };
        let reset_values = [
            (xdata::CPUCS, CPU_RESET | 0x02),
            (xdata::IFCONFIG, 0x80),
            (xdata::REVID, config.ram.revision()),
            (xdata::EP2FIFOPFH, 0x89),
            (xdata::EP2FIFOPFH + 2, 0x89),
            (xdata::EP2FIFOPFH + 4, 0x09),
            (xdata::EP2FIFOPFH + 6, 0x09),
            (xdata::ERRCNTLIM, 0x04),
            (xdata::WAKEUPCS, 0x05),
            (xdata::SUDPTRCTL, 0x01),
            (xdata::GPIFWFSELECT, 0xE4),
            (xdata::GPIFIDLECTL, 0xFF),
        ];
        for (address, value) in reset_values {
            chip.set_reg(address, value);
        }
        for (n, ep) in chip.eps.iter_mut().enumerate() {
            ep.pf = if n < 2 { 0x8900 } else { 0x0900 };
        }
        chip
    }

    /// The register at `address` in 0xE600..0xE700 as last written.
    pub(crate) fn reg(&self, address: u16) -> u8 {
        self.regs[usize::from(address & 0xFF)]
    }

    pub(crate) fn set_reg(&mut self, address: u16, value: u8) {
        self.regs[usize::from(address & 0xFF)] = value;
    }

    pub(crate) fn report(&mut self, rule: Rule, address: u16, text: impl FnOnce() -> String) {
        self.diagnostics.report(self.pc, rule, address, text);
    }

    fn not_modelled(&mut self, address: u16, what: &str) {
        self.report(Rule::NotModelled, address, || {
            format!("{address:#06x} is touched: {what} is not modelled")
        });
    }

    /// Something changed that interrupt lines, events or pins depend on.
    pub(crate) fn changed(&mut self) {
        self.dirty = true;
        self.next_event = 0;
    }

    pub(crate) fn ifclock(&self) -> IfClock {
        IfClock::from_ifconfig(self.reg(xdata::IFCONFIG))
    }

    /// Brings request lines, the next event and the pins up to date after registers have changed.
    pub(crate) fn settle(&mut self, board: &mut dyn Board) {
        self.dirty = false;
        self.update_port_pins();
        if !self.gpif.busy() {
            self.update_idle_pins();
        }
        self.flush_pins(tick_to_ps(self.tick), board);
        if self.tick >= self.next_event {
            self.service(board);
        }
    }

    /// Does everything that is due, then works out request lines and the next event.
    pub(crate) fn service(&mut self, board: &mut dyn Board) {
        let now = self.tick;
        self.timers.sync(now);
        for port in 0..2 {
            if self.uarts[port].is_due(now) {
                let frame = self.uart_frame(port, true);
                self.uarts[port].service(now, frame);
            }
        }
        self.int.exif |= self.i2c.service(now, board);
        let sof_counts = self.int.usb_ie & usb::SOF != 0;
        if sof_counts {
            self.sync_sof();
        }
        self.next_event = self
            .timers
            .next_event()
            .min(self.uarts[0].next_event())
            .min(self.uarts[1].next_event())
            .min(self.i2c.next_event())
            .min(if sof_counts { self.usb.next_sof(now) } else { NEVER });
        self.update_requests();
    }

    fn update_requests(&mut self) {
        let tcon = self.timers.tcon;
        let line = |on: bool, source: Source| if on { source.mask() } else { 0 };
        self.requests = self.int.requests()
            | line(self.external_line(IT0, IE0, 1), Source::Int0)
            | line(self.external_line(IT1, IE1, 2), Source::Int1)
            | line(tcon & 0x20 != 0, Source::Timer0)
            | line(tcon & 0x80 != 0, Source::Timer1)
            | line(self.timers.t2con & 0xC0 != 0, Source::Timer2)
            | line(self.uarts[0].requests(), Source::Serial0)
            | line(self.uarts[1].requests(), Source::Serial1);
    }

    /// INT0# or INT1#: the flag in edge mode, the pin (low) in level mode.
    fn external_line(&self, edge_mode: u8, flag: u8, pin: u8) -> bool {
        let tcon = self.timers.tcon;
        tcon & flag != 0 || tcon & edge_mode == 0 && self.int_pins & pin == 0
    }

    /// Looks at the interrupt pins PA0 and PA1, if they are such.
    pub(crate) fn sense_interrupt_pins(&mut self, board: &mut dyn Board) {
        let used = self.reg(xdata::PORTACFG) & (PORTACFG_INT0 | PORTACFG_INT1);
        if used == 0 && self.int_pins == 3 {
            return;
        }
        let pins = board.sense(tick_to_ps(self.tick)).port[0] & used | 3 & !used;
        let fell = self.int_pins & !pins;
        self.int_pins = pins;
        if fell & 1 != 0 && self.timers.tcon & IT0 != 0 {
            self.timers.tcon |= IE0;
        }
        if fell & 2 != 0 && self.timers.tcon & IT1 != 0 {
            self.timers.tcon |= IE1;
        }
        self.update_requests();
    }

    /// The CPU leaves reset: the 8051's own peripherals start afresh.
    pub(crate) fn reset_cpu_peripherals(&mut self) {
        self.timers.reset(self.tick);
        for uart in &mut self.uarts {
            uart.reset();
        }
        self.int.exif = 0x08;
        self.int.eicon = 0x40;
        self.autopointers = [0; 2];
        self.autopointer_setup = 0x06;
        self.changed();
    }

    /// Ticks of a whole frame of serial port `port`.
    fn uart_frame(&self, port: usize, receive: bool) -> Option<Tick> {
        let uart = &self.uarts[port];
        let doubled = if port == 0 { self.timers.smod0 } else { self.int.eicon & 0x80 != 0 };
        let bit = match uart.mode() {
            0 if uart.scon & 0x20 != 0 => self.cycle,
            0 => 3 * self.cycle,
            2 => self.cycle / 4 * if doubled { 32 } else { 64 },
            _ if self.reg(xdata::UART230) >> port & 1 != 0 => {
                48_000_000 / if doubled { 230_400 } else { 115_200 }
            }
            _ if port == 0 => self.timers.baud_ticks(receive, doubled)?,
            _ => self.timers.baud_ticks_timer1(doubled)?,
        };
        Some(bit * uart.frame_bits())
    }

    fn set_cpucs(&mut self, value: u8) {
        let held = value & CPU_RESET != 0;
        self.release |= self.held && !held;
        self.held = held;
        if value & CLKSPD == CLKSPD {
            self.report(Rule::Reserved, xdata::CPUCS, || {
                "CPUCS sets the reserved CLKSPD value 11; 48 MHz is 10".into()
            });
        }
        self.cycle = match value & CLKSPD {
            0x00 => 16,
            0x08 => 8,
            _ => 4,
        };
        self.timers.set_cycle(self.tick, self.cycle);
        self.set_reg(xdata::CPUCS, value & 0x3E);
        self.changed();
    }

    /// A FIFO was moved by other than the interface: its flags go to pins and interrupts.
    pub(crate) fn fifo_changed(&mut self) {
        self.fifo_flags_changed();
        self.changed();
    }

    /// FIFO flags may have changed: interrupts follow their rising edges.
    pub(crate) fn fifo_flags_changed(&mut self) {
        if self.int.fifo_ie & 0x0FFF != 0 {
            let mut flags = 0;
            for (n, ep) in self.eps.iter().enumerate() {
                let bit = |on: bool, first: u16| if on { first << n } else { 0 };
                flags |= bit(ep.programmable_flag(), fifo::EP2PF)
                    | bit(ep.fifo_empty(), fifo::EP2EF)
                    | bit(ep.fifo_full(), fifo::EP2FF);
            }
            let rose = flags & !self.flags;
            self.flags = flags;
            self.int.raise_fifo(rose);
            self.changed();
        }
    }

    /// FIFORESET keeps the host off the FIFOs.
    pub(crate) fn nak_all(&self) -> bool {
        self.nak_all
    }

    fn flag_byte(&self, index: usize) -> u8 {
        let ep = &self.eps[index];
        u8::from(ep.programmable_flag()) << 2
            | u8::from(ep.fifo_empty()) << 1
            | u8::from(ep.fifo_full())
    }
}

/// Memory.
impl Chip {
    /// Whether vendor request 0xA0 and SUDPTR reach `address`.
    pub(crate) fn is_loadable(&self, address: u16) -> bool {
        usize::from(address) < self.ram_size
            || usize::from(address.wrapping_sub(SCRATCH)) < SCRATCH_SIZE
    }

    /// On-chip RAM without side effects; 0xFF elsewhere.
    pub(crate) fn peek_loadable(&self, address: u16) -> u8 {
        if usize::from(address) < self.ram_size {
            self.ram[usize::from(address)]
        } else if self.is_loadable(address) {
            self.scratch[usize::from(address - SCRATCH)]
        } else {
            0xFF
        }
    }

    /// What vendor request 0xA0 and the boot loader write: on-chip RAM and CPUCS.
    pub(crate) fn load(&mut self, address: u16, value: u8) {
        if usize::from(address) < self.ram_size {
            self.ram[usize::from(address)] = value;
        } else if self.is_loadable(address) {
            self.scratch[usize::from(address - SCRATCH)] = value;
        } else if address == xdata::CPUCS {
            let speed = self.reg(xdata::CPUCS) & !CPU_RESET;
            self.set_cpucs(speed | value & CPU_RESET);
        } else {
            self.report(Rule::NotModelled, address, || {
                format!("a load to {address:#06x} is outside RAM and CPUCS; it is ignored")
            });
        }
    }

    fn external_read(&mut self, address: u16) -> u8 {
        match &self.external {
            Some(memory) => memory[usize::from(address)],
            None => {
                self.not_modelled(address, "external memory (the board has none)");
                0xFF
            }
        }
    }

    fn external_write(&mut self, address: u16, value: u8) {
        match &mut self.external {
            Some(memory) => memory[usize::from(address)] = value,
            None => self.not_modelled(address, "external memory (the board has none)"),
        }
    }

    /// The endpoint with its buffer at `address`, and the offset there.
    fn endpoint_buffer(address: u16) -> Option<(usize, usize)> {
        let index = usize::from(address >> 10 & 3);
        let offset = usize::from(address & 0x3FF);
        // EP4 and EP8 have 512 bytes; the space behind is reserved.
        (index % 2 == 0 || offset < 512).then_some((index, offset))
    }

    fn read_high(&mut self, address: u16) -> u8 {
        match address {
            0xE000..0xE200 => self.scratch[usize::from(address - SCRATCH)],
            0xE400..0xE480 => self.gpif.waveforms[usize::from(address - xdata::WAVEDATA)],
            xdata::GPCR2 => self.gpcr2,
            0xE600..0xE700 => self.read_register(address),
            0xE740..0xE780 => self.usb.ep0_buffer[usize::from(address - xdata::EP0BUF)],
            0xE780..0xE7C0 => self.usb.ep1_out.buffer[usize::from(address - xdata::EP1OUTBUF)],
            0xE7C0..0xE800 => self.usb.ep1_in.buffer[usize::from(address - xdata::EP1INBUF)],
            0xF000.. => match Self::endpoint_buffer(address) {
                Some((index, offset)) => self.eps[index].read(offset),
                None => self.reserved_read(address),
            },
            0xE200..0xF000 => self.reserved_read(address),
            _ => self.external_read(address),
        }
    }

    fn write_high(&mut self, address: u16, value: u8) {
        match address {
            0xE000..0xE200 => self.scratch[usize::from(address - SCRATCH)] = value,
            0xE400..0xE480 => {
                self.gpif.waveforms[usize::from(address - xdata::WAVEDATA)] = value;
                if self.gpif.busy() {
                    self.report(Rule::GpifBusy, xdata::WAVEDATA, || {
                        "a waveform is changed while the GPIF runs".into()
                    });
                }
            }
            xdata::GPCR2 => self.gpcr2 = value,
            0xE600..0xE700 => self.write_register(address, value),
            0xE740..0xE780 => self.usb.ep0_buffer[usize::from(address - xdata::EP0BUF)] = value,
            0xE780..0xE7C0 => {
                self.usb.ep1_out.buffer[usize::from(address - xdata::EP1OUTBUF)] = value;
            }
            0xE7C0..0xE800 => {
                self.usb.ep1_in.buffer[usize::from(address - xdata::EP1INBUF)] = value;
            }
            0xF000.. => match Self::endpoint_buffer(address) {
                Some((index, offset)) => self.eps[index].write(offset, value),
                None => self.not_modelled(address, "reserved memory"),
            },
            0xE200..0xF000 => self.not_modelled(address, "reserved memory"),
            _ => self.external_write(address, value),
        }
    }

    fn reserved_read(&mut self, address: u16) -> u8 {
        self.not_modelled(address, "reserved memory");
        0xFF
    }
}

/// Registers in XDATA.
impl Chip {
    fn read_register(&mut self, address: u16) -> u8 {
        self.check_sync_delay(address);
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
            _ if Self::is_plain(address) => self.reg(address),
            _ => {
                self.not_modelled(address, "this register");
                self.reg(address)
            }
        }
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

    fn write_register(&mut self, address: u16, value: u8) {
        self.check_sync_delay(address);
        self.set_reg(address, value);
        self.changed();
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
            xdata::CLRERRCNT | xdata::SUSPEND | xdata::GPIFABORT => self.write_strobe(address),
            xdata::INTSETUP => self.int.setup = value,
            xdata::I2CS => self.i2c.write_status(self.tick, value),
            xdata::I2DAT => self.i2c.write_data(self.tick, value),
            xdata::I2CTL => self.i2c.write_control(value),
            xdata::XAUTODAT1 | xdata::XAUTODAT2 => {
                let at = self.autopointer(usize::from(address - xdata::XAUTODAT1));
                self.write_memory(at, value);
            }
            xdata::USBCS => self.usb.usbcs = value & 0x0F,
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

    fn write_strobe(&mut self, address: u16) {
        match address {
            xdata::SUSPEND => self.asleep = true,
            xdata::GPIFABORT => self.gpif_abort(),
            _ => {}
        }
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

    fn gpif_done_bit(&self) -> u8 {
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
        (3 * (ifclk + clkout)).div_ceil(2 * clkout + 4)
    }
}

/// Special function registers and the paths of data through them.
impl Chip {
    /// The address that an autopointer gives, and its increment.
    fn autopointer(&mut self, index: usize) -> u16 {
        let at = self.autopointers[index];
        if self.autopointer_setup >> (index + 1) & 1 != 0 {
            self.autopointers[index] = at.wrapping_add(1);
        }
        at
    }

    pub(crate) fn read_memory(&mut self, address: u16) -> u8 {
        if usize::from(address) < self.ram_size {
            self.ram[usize::from(address)]
        } else {
            self.read_high(address)
        }
    }

    pub(crate) fn write_memory(&mut self, address: u16, value: u8) {
        if usize::from(address) < self.ram_size {
            self.ram[usize::from(address)] = value;
        } else {
            self.write_high(address, value);
        }
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

    fn port_index(address: u8) -> usize {
        match address {
            sfr::IOA => 0,
            sfr::IOB => 1,
            sfr::IOC => 2,
            sfr::IOD => 3,
            _ => 4,
        }
    }

    /// GPIFREADYSTAT: the RDY pins.
    fn read_ready(&mut self, board: &mut dyn Board) -> u8 {
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

/// The core's view of the chip on its board.
pub(crate) struct View<'a> {
    pub(crate) chip: &'a mut Chip,
    pub(crate) board: &'a mut dyn Board,
}

impl mcs51::Bus for View<'_> {
    #[inline]
    fn read_code(&mut self, address: u16) -> u8 {
        // 0x45 and 0x55 differ in one bit only.
        if address & !0x10 == 0x45
            && let Some(low) = self.chip.int.autovector(address)
        {
            return low;
        }
        if usize::from(address) < self.chip.ram_size {
            self.chip.ram[usize::from(address) % RAM_MAX]
        } else {
            self.chip.external_read(address)
        }
    }

    #[inline]
    fn read_xdata(&mut self, address: u16) -> u8 {
        if usize::from(address) < self.chip.ram_size {
            self.chip.ram[usize::from(address) % RAM_MAX]
        } else if address == xdata::GPIFREADYSTAT {
            self.chip.read_ready(self.board)
        } else {
            self.chip.read_high(address)
        }
    }

    #[inline]
    fn write_xdata(&mut self, address: u16, value: u8) {
        self.chip.write_memory(address, value);
    }

    fn read_sfr(&mut self, address: u8) -> u8 {
        self.chip.read_sfr(address, self.board)
    }

    fn read_sfr_latch(&mut self, address: u8) -> u8 {
        match address {
            sfr::IOA | sfr::IOB | sfr::IOC | sfr::IOD | sfr::IOE => {
                self.chip.ports.latch[Chip::port_index(address)]
            }
            _ => self.chip.read_sfr(address, self.board),
        }
    }

    fn write_sfr(&mut self, address: u8, value: u8) {
        self.chip.write_sfr(address, value);
    }

    fn acknowledge(&mut self, source: Source) {
        let timers = &mut self.chip.timers;
        timers.tcon &= !match source {
            Source::Timer0 => 0x20,
            Source::Timer1 => 0x80,
            Source::Int0 if timers.tcon & IT0 != 0 => IE0,
            Source::Int1 if timers.tcon & IT1 != 0 => IE1,
            _ => 0,
        };
        self.chip.changed();
    }
}
