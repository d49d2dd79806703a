//! Everything around the core: memories, registers and their side effects.

use crate::diagnostics::{Diagnostics, Rule};
use crate::eeprom::Identity;
use crate::endpoints::Endpoint;
use crate::gpif::Gpif;
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
use serde::{Deserialize, Serialize};

const SCRATCH: u16 = 0xE000;
const SCRATCH_SIZE: usize = 0x200;
const RAM_MAX: usize = 0x4000;
/// CPUCS bits.
pub(crate) const CPU_RESET: u8 = 0x01;
const CLKSPD: u8 = 0x18;
/// TCON bits.
const IT0: u8 = 0x01;
const IE0: u8 = 0x02;
const IT1: u8 = 0x04;
const IE1: u8 = 0x08;

/// The chip without its core.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Chip {
    #[serde(with = "sim::hex")]
    pub(crate) ram: Box<[u8; RAM_MAX]>,
    pub(crate) ram_size: usize,
    #[serde(with = "sim::hex")]
    scratch: [u8; SCRATCH_SIZE],
    /// Memory on the external bus, if the board has some.
    external: Option<Vec<u8>>,
    /// What was written to 0xE600..0xE700; registers with a life of their own have it elsewhere.
    #[serde(with = "sim::hex")]
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
    pub(crate) autopointers: [u16; 2],
    pub(crate) autopointer_setup: u8,
    /// FIFO flags at the last look, in the order of INT4's sources.
    flags: u16,
    /// INT0# and INT1# at the last look.
    int_pins: u8,
    /// The endpoints' buffers were looked at since the last change of EPxCFG.
    pub(crate) buffers_checked: bool,
    /// FIFORESET's NAKALL before the present write.
    pub(crate) nak_all: bool,
    /// FIFOADR as the slave FIFO's master sets it: index of EP2, 4, 6, 8.
    pub(crate) fifo_address: u8,
    /// When a register that wants SYNCDELAY was touched last.
    pub(crate) last_slow: Option<Tick>,
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

    pub(crate) fn not_modelled(&mut self, address: u16, what: &str) {
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
    pub(crate) fn uart_frame(&self, port: usize, receive: bool) -> Option<Tick> {
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

    pub(crate) fn set_cpucs(&mut self, value: u8) {
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

    pub(crate) fn flag_byte(&self, index: usize) -> u8 {
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
        } else {
            self.chip.gpif_catch_up(self.board);
            if address == xdata::GPIFREADYSTAT {
                self.chip.read_ready(self.board)
            } else {
                self.chip.read_high(address)
            }
        }
    }

    #[inline]
    fn write_xdata(&mut self, address: u16, value: u8) {
        if usize::from(address) < self.chip.ram_size {
            self.chip.ram[usize::from(address) % RAM_MAX] = value;
        } else {
            self.chip.gpif_catch_up(self.board);
            self.chip.write_high(address, value);
        }
    }

    fn read_sfr(&mut self, address: u8) -> u8 {
        self.chip.gpif_catch_up(self.board);
        self.chip.read_sfr(address, self.board)
    }

    fn read_sfr_latch(&mut self, address: u8) -> u8 {
        match address {
            sfr::IOA | sfr::IOB | sfr::IOC | sfr::IOD | sfr::IOE => {
                self.chip.ports.latch[Chip::port_index(address)]
            }
            _ => self.read_sfr(address),
        }
    }

    fn write_sfr(&mut self, address: u8, value: u8) {
        self.chip.gpif_catch_up(self.board);
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
