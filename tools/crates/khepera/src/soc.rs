//! The chip around the CPU, and the board around the chip: memory map, registers, events,
//! interrupts.

use common_sys::constants as board;
use m68k::AddressBus;
use m68k::core::memory::{BusFault, BusFaultKind};
use sim::{Ps, US};

use crate::adc::Adc;
use crate::diagnostics::{Diagnostic, Diagnostics};
use crate::drive::{Channel, Drive, MotorDrive, WHEELS};
use crate::gpt::Gpt;
use crate::integration::{CHIP_SELECTS, CS0, CS1, CSBOOT, Integration, ResetCause};
use crate::qspi::{Pins, Qspi};
use crate::sci::Sci;
use crate::timebase::Timebase;
use crate::turret_bus::TurretBus;

pub(crate) const FLASH_SIZE: usize = board::BOARD_FLASH_SIZE as usize;
pub(crate) const RAM_SIZE: usize = board::BOARD_RAM_SIZE as usize;
const _: () = assert!(FLASH_SIZE.is_power_of_two() && RAM_SIZE.is_power_of_two());

/// The finest grain of chip selects: 2 KiB.
const PAGE_BITS: u32 = 11;
const PAGES: usize = 1 << (24 - PAGE_BITS);
/// System clocks of an access to a register.
const REGISTER_CLOCKS: u64 = 2;
/// System clocks after which the bus monitor ends an access that nobody answers (BMT = 0).
const BUS_MONITOR_CLOCKS: u64 = 64;
/// How often the turret's interrupt lines are looked at.
const PIN_POLL: Ps = 50 * US;
/// At 0, the interrupt arbitration fields say that a module takes no part.
const SPURIOUS_VECTOR: u8 = 24;
/// Encoder pins on port GP: left A, left B, right A, right B.
const ENCODER_PINS: [[u8; 2]; WHEELS] = [
    [board::BOARD_GP_LEFT_A as u8, board::BOARD_GP_LEFT_B as u8],
    [board::BOARD_GP_RIGHT_A as u8, board::BOARD_GP_RIGHT_B as u8],
];
const DIRECTION_PINS: [u8; WHEELS] =
    [board::BOARD_GP_LEFT_FORWARD as u8, board::BOARD_GP_RIGHT_FORWARD as u8];

/// What answers in a page of the address space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Device {
    /// Nobody.
    None,
    Flash,
    /// Both bytes of the RAM, each with its own byte select.
    Ram,
    /// The RAM with other selects: bits 0 and 1 = lower and upper byte are reached.
    HalfRam,
    Registers,
}

/// One page, for one direction of access.
#[derive(Clone, Copy, Debug)]
struct Page {
    device: Device,
    clocks: u8,
    /// For `HalfRam`: CSOR.BYTE of CS0 (upper byte's chip) and CS1 (lower byte's chip).
    upper: u8,
    lower: u8,
}

const NOBODY: Page = Page { device: Device::None, clocks: 0, upper: 0, lower: 0 };

/// An access that ended in a bus or address error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub address: u32,
    pub write: bool,
    /// Bytes of the operand.
    pub size: u8,
    pub instruction: bool,
    /// Odd address: vector 3. Otherwise nobody answered: vector 2.
    pub odd: bool,
    /// Nobody answered and no monitor watched: the CPU waits for ever.
    pub hangs: bool,
}

/// Chip and board without the CPU.
#[derive(Clone)]
pub(crate) struct Soc {
    pub time: Timebase,
    /// System clocks since power-on: now.
    pub clk: u64,
    pub next_event: u64,
    flash: Box<[u8; FLASH_SIZE]>,
    ram: Box<[u8; RAM_SIZE]>,
    read_map: Vec<Page>,
    write_map: Vec<Page>,
    pub system: Integration,
    pub sci: Sci,
    qsmcr: u16,
    qilr: u8,
    qivr: u8,
    pub qspi: Qspi,
    gpt: Gpt,
    pub adc: Adc,
    pub drive: Drive,
    drive_clk: u64,
    pub battery_mv: u32,
    diagnostics: Diagnostics,
    /// Set by a failed access; until it is dealt with, all further accesses do nothing.
    pub fault: Option<Fault>,
    /// Address after the last instruction word fetched, and what a fetch there costs.
    pub fetched_to: u32,
    pub fetch_clocks: u64,
    /// Program counter of the instruction under way.
    pub pc: u32,
    pub reset_request: Option<ResetCause>,
    irq_levels: u8,
    irq7_edge: bool,
    pin_poll_clk: u64,
    /// Highest interrupt level requested.
    pub level: u8,
    /// Levels requested, as bits, and since when.
    requested: u8,
    requested_since: [u64; 8],
    /// Longest time from request to acknowledge, by level.
    pub worst_latency: [Ps; 8],
    /// False: held in reset or without supply; the motors get nothing.
    pub running: bool,
}

fn boxed<const N: usize>(bytes: Vec<u8>) -> Box<[u8; N]> {
    bytes.into_boxed_slice().try_into().unwrap_or_else(|_| unreachable!("sized by the caller"))
}

/// What RAM holds at power-on: nothing that a program could rely on.
fn power_on_ram() -> Vec<u8> {
    let mut state = 0x2545_F491_4F6C_DD1Du64;
    (0..RAM_SIZE)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 32) as u8
        })
        .collect()
}

const RESET_HZ: u64 = 4 * board::BOARD_CRYSTAL_HZ as u64 * 64;

impl Soc {
    /// Powered on at time `start` with this flash.
    pub fn new(flash: Vec<u8>, host_baud: u32, battery_mv: u32, start: Ps) -> Self {
        let time = Timebase::new(RESET_HZ, start);
        let system = Integration::new(ResetCause::PowerUp, 0, &time);
        let mut soc = Self {
            time,
            clk: 0,
            next_event: 0,
            flash: boxed(flash),
            ram: boxed(power_on_ram()),
            read_map: vec![NOBODY; PAGES],
            write_map: vec![NOBODY; PAGES],
            system,
            sci: Sci::new(host_baud),
            qsmcr: 0x0080,
            qilr: 0,
            qivr: 0x0F,
            qspi: Qspi::default(),
            gpt: Gpt::new(0),
            adc: Adc::new(),
            drive: Drive::new(),
            drive_clk: 0,
            battery_mv,
            diagnostics: Diagnostics::default(),
            fault: None,
            fetched_to: 0,
            fetch_clocks: 0,
            pc: 0,
            reset_request: None,
            irq_levels: 0xFF,
            irq7_edge: false,
            pin_poll_clk: 0,
            level: 0,
            requested: 0,
            requested_since: [0; 8],
            worst_latency: [0; 8],
            running: true,
        };
        soc.adc.set_battery_mv(battery_mv);
        soc.remap();
        soc
    }

    /// Chip reset; RAM, flash and the world go on.
    pub fn reset(&mut self, cause: ResetCause) {
        if cause == ResetCause::PowerUp {
            self.ram = boxed(power_on_ram());
        }
        self.time.set_hz(self.clk, RESET_HZ);
        self.system = Integration::new(cause, self.clk, &self.time);
        self.reset_modules();
        self.fault = None;
        self.reset_request = None;
        self.irq7_edge = false;
        self.remap();
        self.plan_drive();
        self.plan();
    }

    /// Held in reset, or without supply: nothing runs, all pins float.
    pub fn hold(&mut self) {
        self.running = false;
        self.reset(ResetCause::External);
        self.system.stop_timers();
        self.plan();
    }

    /// What the RESET instruction reaches.
    fn reset_modules(&mut self) {
        self.sci.reset();
        self.qspi.reset();
        (self.qsmcr, self.qilr, self.qivr) = (0x0080, 0, 0x0F);
        self.gpt.reset(self.clk);
    }

    pub fn warn(&mut self, address: u32, write: bool, what: &'static str) {
        let time = self.time.ps(self.clk);
        self.diagnostics.add(Diagnostic { time, pc: self.pc, address, write, what });
    }

    pub fn diagnostics(&self) -> &[Diagnostic] {
        self.diagnostics.list()
    }

    // ---- memory map

    fn remap(&mut self) {
        for page in 0..PAGES {
            let address = (page as u32) << PAGE_BITS;
            self.read_map[page] = self.page(address, false);
            self.write_map[page] = self.page(address, true);
        }
    }

    fn page(&self, address: u32, write: bool) -> Page {
        let registers: u32 = if self.system.registers_high() { 0xFFF000 } else { 0x7FF000 };
        if address & 0xFFF000 == registers {
            return Page { device: Device::Registers, ..NOBODY };
        }
        let select = |n| self.system.select(n, address, write);
        // The first select that brings its own DSACK ends the access.
        let clocks = (0..CHIP_SELECTS).filter_map(select).find_map(|s| s.clocks);
        let Some(clocks) = clocks else { return NOBODY };
        let byte = |n| select(n).map_or(0, |s| s.byte);
        let (flash, upper, lower) = (byte(CSBOOT), byte(CS0), byte(CS1));
        let device = match (flash, upper, lower) {
            (1.., _, _) => Device::Flash,
            (0, 0, 0) => Device::None,
            (0, 2, 1) => Device::Ram,
            (0, 2.., 1 | 3) if !write => Device::Ram,
            _ => Device::HalfRam,
        };
        Page { device, clocks, upper, lower }
    }

    fn check_speed(&mut self, address: u32) {
        let needed = 3 + board::BOARD_WAIT_STATES as u8;
        let page = self.read_map[(address >> PAGE_BITS) as usize];
        if page.clocks < needed && matches!(page.device, Device::Flash | Device::Ram) {
            self.warn(address, false, "fewer wait states than the memory needs");
        }
    }

    // ---- events

    fn watched(&self) -> [[bool; 2]; WHEELS] {
        ENCODER_PINS.map(|pins| pins.map(|pin| self.gpt.watches(pin)))
    }

    /// What the motors get now.
    pub fn motors(&self) -> [MotorDrive; WHEELS] {
        if !self.running {
            return [MotorDrive::default(); WHEELS];
        }
        let pins = self.gpt.pins();
        [0, 1].map(|n| MotorDrive {
            duty: self.gpt.duty(self.clk, n),
            forward: pins >> DIRECTION_PINS[n] & 1 != 0,
        })
    }

    pub fn plan_drive(&mut self) {
        self.drive_clk = self.time.clk_at_or_after(self.drive.next_event(self.watched()));
    }

    pub fn plan(&mut self) {
        self.next_event = self
            .sci
            .next_event(&self.time)
            .min(self.qspi.next_event())
            .min(self.gpt.next_event())
            .min(self.drive_clk)
            .min(self.system.pit_clk)
            .min(self.system.watchdog_clk)
            .min(self.pin_poll_clk);
        self.request();
    }

    /// Let every event up to now happen.
    #[inline]
    pub fn catch_up(&mut self, turret: &mut impl TurretBus) {
        while self.next_event <= self.clk {
            self.event(self.next_event, turret);
            self.plan();
        }
    }

    fn event(&mut self, clk: u64, turret: &mut impl TurretBus) {
        self.sci.run_to(clk, &self.time);
        self.gpt.run_to(clk);
        while self.qspi.next_event() <= clk {
            let at = self.qspi.next_event();
            let pins = self.qspi.event();
            self.drive_pins(at, pins, turret);
        }
        if self.drive_clk <= clk {
            let t = self.time.ps(clk);
            let drives = self.motors();
            if let Some(edge) = self.drive.event(t, self.watched(), drives, self.battery_mv) {
                self.gpt.edge(clk, ENCODER_PINS[edge.wheel][edge.channel as usize], edge.high);
            }
            self.plan_drive();
        }
        if self.system.pit_clk <= clk {
            self.system.pit_event(&self.time);
        }
        if self.system.watchdog_clk <= clk {
            self.system.watchdog_clk = u64::MAX;
            self.reset_request = Some(ResetCause::Watchdog);
        }
        if self.pin_poll_clk <= clk {
            self.poll_pins(turret);
        }
    }

    /// Look at the turret's interrupt lines.
    pub fn poll_pins(&mut self, turret: &mut impl TurretBus) {
        let now = self.time.ps(self.clk);
        let levels = turret.irq_pins(now);
        self.irq7_edge |= self.irq_levels & !levels & 0x80 != 0;
        self.irq_levels = levels;
        self.pin_poll_clk = self.time.clk_at_or_after(now + PIN_POLL).max(self.clk + 1);
    }

    fn drive_pins(&mut self, clk: u64, pins: Option<Pins>, turret: &mut impl TurretBus) {
        let now = self.time.ps(clk);
        match pins {
            None => return,
            Some(Pins::Select(pcs)) => turret.select(now, pcs),
            Some(Pins::Exchange { word, bits }) => {
                let answer = if u32::from(self.qspi.pcs()) == board::BOARD_PCS_ADC {
                    self.adc.exchange(now, word, bits)
                } else {
                    turret.exchange(now, word, bits)
                };
                self.qspi.received(answer, bits);
            }
        }
        self.poll_pins(turret);
    }

    // ---- interrupts

    fn qsm_levels(&self) -> (u8, u8) {
        let sci = if self.sci.interrupt() { self.qilr & 7 } else { 0 };
        let qspi = if self.qspi.interrupt() { self.qilr >> 3 & 7 } else { 0 };
        (sci, qspi)
    }

    fn gpt_level(&self) -> u8 {
        if self.gpt.interrupt() { (self.gpt.icr >> 8 & 7) as u8 } else { 0 }
    }

    /// Levels asserted on IRQ1..IRQ7 as bits; 7 counts by its edge only.
    fn pin_levels(&self) -> u8 {
        let asserted = self.system.irq_asserted(self.irq_levels) & 0x7F;
        let edge = u8::from(self.irq7_edge) << 7 & self.system.irq_asserted(0);
        asserted | edge
    }

    /// Find out which levels are requested now.
    fn request(&mut self) {
        let (sci, qspi) = self.qsm_levels();
        let modules = [sci, qspi, self.gpt_level(), self.system.pit_level()];
        let levels = modules.iter().fold(self.pin_levels(), |all, level| all | 1 << level) & 0xFE;
        let mut risen = levels & !self.requested;
        while risen != 0 {
            self.requested_since[risen.trailing_zeros() as usize] = self.clk;
            risen &= risen - 1;
        }
        self.requested = levels;
        self.level = if levels == 0 { 0 } else { levels.ilog2() as u8 };
    }

    fn note_latency(&mut self, level: u8) {
        let since = self.requested_since[usize::from(level)];
        let latency = (self.clk - since) * sim::SECOND / self.time.hz();
        let worst = &mut self.worst_latency[usize::from(level)];
        *worst = latency.max(*worst);
        // If the level is still requested after this, that counts from now.
        self.requested &= !(1 << level);
    }

    /// Interrupt acknowledge: the modules that request `level` arbitrate by IARB, 0 takes no part.
    pub fn acknowledge(&mut self, level: u8) -> u8 {
        self.note_latency(level);
        let (sci, qspi) = self.qsm_levels();
        let pin = self.system.irq_asserted(self.irq_levels) >> level & 1 != 0
            || level == 7 && self.irq7_edge;
        let pit = self.system.pit_level() == level;
        let requests = [
            (pit || pin, self.system.iarb()),
            (sci == level || qspi == level, (self.qsmcr & 0xF) as u8),
            (self.gpt_level() == level, (self.gpt.mcr & 0xF) as u8),
        ];
        let iarb = requests.iter().filter(|r| r.0).map(|r| r.1).max().unwrap_or(0);
        let winners = requests.iter().filter(|r| r.0 && r.1 == iarb).count();
        if iarb != 0 && winners > 1 {
            self.warn(u32::from(level), false, "two modules with the same IARB at one level");
        }
        let vector = match requests.iter().position(|r| r.0 && r.1 == iarb) {
            _ if iarb == 0 => {
                self.warn(u32::from(level), false, "spurious interrupt: no module with an IARB");
                SPURIOUS_VECTOR
            }
            Some(0) if pit => self.system.acknowledge_pit(),
            Some(0) => self.acknowledge_pin(level),
            // Vectors: bit 0 tells the two apart. The QSPI comes first (QSMRM 3.3).
            Some(1) if qspi == level => self.qivr | 1,
            Some(1) => self.qivr & 0xFE,
            _ => self.gpt.vector(),
        };
        self.plan();
        vector
    }

    fn acknowledge_pin(&mut self, level: u8) -> u8 {
        if level == 7 {
            self.irq7_edge = false;
        }
        if self.system.autovector(level) {
            return SPURIOUS_VECTOR + level;
        }
        self.warn(u32::from(level), false, "IRQ pin without autovector (PEPAR, CSOR.AVEC)");
        SPURIOUS_VECTOR
    }

    // ---- registers

    fn refresh_encoder_pins(&mut self) {
        let now = self.time.ps(self.clk);
        for (wheel, pins) in ENCODER_PINS.iter().enumerate() {
            for (channel, pin) in [Channel::A, Channel::B].into_iter().zip(pins) {
                let high = u8::from(self.drive.level(now, wheel, channel));
                self.gpt.board_pins = self.gpt.board_pins & !(1 << pin) | high << pin;
            }
        }
    }

    /// Word of the register at even `address`, side effects only for the bytes in `mask`; None where
    /// the chip has no register.
    fn read_register(&mut self, address: u32, mask: u16) -> Option<u16> {
        let offset = address & 0xFF;
        Some(match address & 0xFFF {
            0x900..=0x93F => {
                if offset == 0x06 {
                    self.refresh_encoder_pins();
                }
                self.gpt.run_to(self.clk);
                self.gpt.read(self.clk, offset, mask)
            }
            0xA00..=0xA7F => self.system.read(self.clk, offset, self.irq_levels),
            0xC00..=0xDFF => self.read_qsm(address & 0x1FF, mask),
            _ => return None,
        })
    }

    fn read_qsm(&mut self, offset: u32, mask: u16) -> u16 {
        let pair = |high: u8, low: u8| u16::from(high) << 8 | u16::from(low);
        let queue = (offset as usize & 0x1F) / 2;
        match offset {
            0x00 => self.qsmcr,
            0x04 => pair(self.qilr, self.qivr),
            0x08 => self.sci.sccr0,
            0x0A => self.sci.sccr1,
            0x0C => self.sci.read_status(),
            0x0E if mask & 0x00FF != 0 => self.sci.read_data(),
            // Pins that the QSPI does not drive are pulled up.
            0x14 => u16::from(self.qspi.portqs | !self.qspi.ddrqs),
            0x16 => pair(self.qspi.pqspar, self.qspi.ddrqs),
            0x18 => self.qspi.spcr0,
            0x1A => self.qspi.spcr1,
            0x1C => self.qspi.spcr2,
            0x1E if mask & 0x00FF != 0 => pair(self.qspi.spcr3, self.qspi.read_status()),
            0x1E => pair(self.qspi.spcr3, 0),
            0x100..=0x11F => self.qspi.receive[queue],
            0x120..=0x13F => self.qspi.transmit[queue],
            0x140..=0x14F => {
                let first = offset as usize - 0x140;
                pair(self.qspi.commands[first], self.qspi.commands[first + 1])
            }
            _ => 0,
        }
    }

    /// False where the chip has no register.
    fn write_register(
        &mut self,
        address: u32,
        value: u16,
        mask: u16,
        turret: &mut impl TurretBus,
    ) -> bool {
        let offset = address & 0xFF;
        let warning = match address & 0xFFF {
            0x900..=0x93F => {
                self.gpt.run_to(self.clk);
                let warning = self.gpt.write(self.clk, offset, value, mask);
                self.plan_drive();
                warning
            }
            0xA00..=0xA7F => self.write_system(offset, value, mask),
            0xC00..=0xDFF => self.write_qsm(address & 0x1FF, value, mask, turret),
            _ => return false,
        };
        if let Some(what) = warning {
            self.warn(address, true, what);
        }
        self.plan();
        true
    }

    fn write_system(&mut self, offset: u32, value: u16, mask: u16) -> Option<&'static str> {
        let effect = self.system.write(self.clk, &self.time, offset, value, mask);
        if effect.frequency {
            self.time.set_hz(self.clk, self.system.system_hz());
            self.system.replan(&self.time);
            self.plan_drive();
            self.pin_poll_clk = self.clk + 1;
        }
        if effect.map {
            self.remap();
            self.check_speed(board::BOARD_FLASH_BASE);
            self.check_speed(board::BOARD_RAM_BASE);
        }
        effect.warning
    }

    fn write_qsm(
        &mut self,
        offset: u32,
        value: u16,
        mask: u16,
        turret: &mut impl TurretBus,
    ) -> Option<&'static str> {
        let clk = self.clk;
        let merge = |old: u16| old & !mask | value & mask;
        let high = (mask & 0xFF00 != 0).then_some((value >> 8) as u8);
        let low = (mask & 0x00FF != 0).then_some(value as u8);
        let queue = (offset as usize & 0x1F) / 2;
        let qspi = &mut self.qspi;
        match offset {
            0x00 => {
                self.qsmcr = merge(self.qsmcr) & 0xE08F;
                return (self.qsmcr & 0x8000 != 0).then_some("QSMCR.STOP: not modelled");
            }
            0x04 => {
                self.qilr = high.map_or(self.qilr, |v| v & 0x3F);
                self.qivr = low.map_or(self.qivr, |v| v | 1);
            }
            0x08 => self.sci.sccr0 = merge(self.sci.sccr0) & 0x1FFF,
            0x0A => return self.sci.write_control(clk, merge(self.sci.sccr1)),
            0x0E => return self.sci.write_data(clk, value & mask),
            0x14 => {
                qspi.portqs = low.unwrap_or(qspi.portqs);
                let pins = qspi.port_changed();
                self.drive_pins(clk, pins, turret);
            }
            0x16 => {
                qspi.pqspar = high.unwrap_or(qspi.pqspar);
                qspi.ddrqs = low.unwrap_or(qspi.ddrqs);
                let pins = qspi.port_changed();
                self.drive_pins(clk, pins, turret);
            }
            0x18 => qspi.spcr0 = merge(qspi.spcr0),
            0x1A => return qspi.write_spcr1(clk, merge(qspi.spcr1)),
            0x1C => qspi.write_spcr2(merge(qspi.spcr2)),
            0x1E => {
                high.into_iter().for_each(|v| qspi.write_spcr3(clk, v));
                low.into_iter().for_each(|v| qspi.write_status(v));
            }
            0x100..=0x11F => qspi.receive[queue] = merge(qspi.receive[queue]),
            0x120..=0x13F => qspi.transmit[queue] = merge(qspi.transmit[queue]),
            0x140..=0x14F => {
                let first = offset as usize - 0x140;
                high.into_iter().for_each(|v| qspi.commands[first] = v);
                low.into_iter().for_each(|v| qspi.commands[first + 1] = v);
            }
            _ => return Some("QSM register that is read-only or not modelled"),
        }
        None
    }

    /// The word at `address` if it lies in memory; for looking, not for the CPU.
    pub fn peek_word(&self, address: u32) -> Option<u16> {
        let address = address & 0xFF_FFFE;
        match self.read_map[(address >> PAGE_BITS) as usize].device {
            Device::Flash => Some(word(&self.flash, address)),
            Device::Ram => Some(word(&self.ram, address)),
            _ => None,
        }
    }
}

fn word<const N: usize>(memory: &[u8; N], address: u32) -> u16 {
    let at = address as usize & (N - 2);
    u16::from_be_bytes([memory[at], memory[at + 1]])
}

/// The CPU's view: chip, board and turret.
pub(crate) struct Bus<'a, T> {
    pub soc: &'a mut Soc,
    pub turret: &'a mut T,
}

impl<T: TurretBus> Bus<'_, T> {
    #[cold]
    fn fail(&mut self, fault: Fault) -> BusFault {
        if !fault.odd {
            self.soc.clk += BUS_MONITOR_CLOCKS;
            let what = match (fault.hangs, fault.instruction) {
                (true, _) => "nobody answers and SYPCR.BME is 0: the CPU hangs",
                (false, true) => "nobody answers: bus error (instruction fetch)",
                (false, false) => "nobody answers: bus error",
            };
            self.soc.warn(fault.address, fault.write, what);
        } else {
            self.soc.warn(fault.address, fault.write, "odd address: address error");
        }
        self.soc.fault = Some(fault);
        BusFault { kind: BusFaultKind::BusError, address: fault.address }
    }

    #[cold]
    fn nobody(&mut self, address: u32, write: bool, size: u8) -> BusFault {
        let hangs = !self.soc.system.bus_monitor();
        self.fail(Fault { address, write, size, instruction: false, odd: false, hangs })
    }

    #[cold]
    fn odd(&mut self, address: u32, write: bool, size: u8) -> BusFault {
        let odd = Fault { address, write, size, instruction: false, odd: true, hangs: false };
        self.fail(odd)
    }

    fn register_read(&mut self, address: u32, mask: u16) -> Result<u16, BusFault> {
        self.soc.clk += REGISTER_CLOCKS;
        self.soc.catch_up(self.turret);
        let value = self.soc.read_register(address & !1, mask);
        match value {
            Some(value) => {
                self.soc.request();
                Ok(value)
            }
            None => Err(self.nobody(address, false, 2)),
        }
    }

    fn register_write(&mut self, address: u32, value: u16, mask: u16) -> Result<(), BusFault> {
        self.soc.clk += REGISTER_CLOCKS;
        self.soc.catch_up(self.turret);
        if self.soc.write_register(address & !1, value, mask, self.turret) {
            Ok(())
        } else {
            Err(self.nobody(address, true, 2))
        }
    }

    fn read_half_ram(&mut self, address: u32, page: Page) -> u16 {
        let value = word(&self.soc.ram, address);
        let upper = if page.upper & 2 != 0 { value & 0xFF00 } else { 0xFF00 };
        let lower = if page.lower & 1 != 0 { value & 0x00FF } else { 0x00FF };
        upper | lower
    }

    /// `lanes`: bit 1 = the access drives the upper byte's select, bit 0 = the lower's.
    fn write_half_ram(&mut self, address: u32, value: u16, lanes: u8, page: Page) {
        let at = address as usize & (RAM_SIZE - 2);
        let [upper, lower] = value.to_be_bytes();
        if page.upper & lanes != 0 {
            self.soc.ram[at] = upper;
        }
        if page.lower & lanes != 0 {
            self.soc.ram[at + 1] = lower;
        }
    }

    fn read_word_slow(&mut self, address: u32, page: Page) -> Result<u16, BusFault> {
        match page.device {
            Device::Registers => self.register_read(address, 0xFFFF),
            Device::HalfRam => {
                self.soc.clk += u64::from(page.clocks);
                Ok(self.read_half_ram(address, page))
            }
            _ => Err(self.nobody(address, false, 2)),
        }
    }

    #[inline]
    fn fetch_word(&mut self, address: u32) -> Result<u16, BusFault> {
        let before = self.soc.clk;
        let result = self.try_read_word(address);
        self.soc.fetched_to = address.wrapping_add(2);
        self.soc.fetch_clocks = self.soc.clk - before;
        if result.is_err()
            && let Some(fault) = &mut self.soc.fault
        {
            fault.instruction = true;
        }
        result
    }
}

impl<T: TurretBus> AddressBus for Bus<'_, T> {
    fn read_byte(&mut self, address: u32) -> u8 {
        self.try_read_byte(address).unwrap_or(0xFF)
    }

    fn read_word(&mut self, address: u32) -> u16 {
        self.try_read_word(address).unwrap_or(0xFFFF)
    }

    fn read_long(&mut self, address: u32) -> u32 {
        self.try_read_long(address).unwrap_or(0xFFFF_FFFF)
    }

    fn write_byte(&mut self, address: u32, value: u8) {
        // A fault is kept in `soc.fault`.
        let _ = self.try_write_byte(address, value);
    }

    fn write_word(&mut self, address: u32, value: u16) {
        let _ = self.try_write_word(address, value);
    }

    fn write_long(&mut self, address: u32, value: u32) {
        let _ = self.try_write_long(address, value);
    }

    #[inline]
    fn try_read_byte(&mut self, address: u32) -> Result<u8, BusFault> {
        if self.soc.fault.is_some() {
            return Ok(0);
        }
        let address = address & 0xFF_FFFF;
        let page = self.soc.read_map[(address >> PAGE_BITS) as usize];
        self.soc.clk += u64::from(page.clocks);
        match page.device {
            Device::Flash => Ok(self.soc.flash[address as usize & (FLASH_SIZE - 1)]),
            Device::Ram => Ok(self.soc.ram[address as usize & (RAM_SIZE - 1)]),
            Device::None => Err(self.nobody(address, false, 1)),
            Device::HalfRam => {
                let both = self.read_half_ram(address, page).to_be_bytes();
                Ok(both[address as usize & 1])
            }
            Device::Registers => {
                let mask = 0xFF00 >> (8 * (address & 1));
                let both = self.register_read(address, mask)?.to_be_bytes();
                Ok(both[address as usize & 1])
            }
        }
    }

    #[inline]
    fn try_read_word(&mut self, address: u32) -> Result<u16, BusFault> {
        if self.soc.fault.is_some() {
            return Ok(0);
        }
        let address = address & 0xFF_FFFF;
        if address & 1 != 0 {
            return Err(self.odd(address, false, 2));
        }
        let page = self.soc.read_map[(address >> PAGE_BITS) as usize];
        match page.device {
            Device::Flash => {
                self.soc.clk += u64::from(page.clocks);
                Ok(word(&self.soc.flash, address))
            }
            Device::Ram => {
                self.soc.clk += u64::from(page.clocks);
                Ok(word(&self.soc.ram, address))
            }
            _ => self.read_word_slow(address, page),
        }
    }

    #[inline]
    fn try_read_long(&mut self, address: u32) -> Result<u32, BusFault> {
        if address & 1 != 0 && self.soc.fault.is_none() {
            return Err(self.odd(address & 0xFF_FFFF, false, 4));
        }
        let upper = self.try_read_word(address)?;
        let lower = self.try_read_word(address.wrapping_add(2))?;
        Ok(u32::from(upper) << 16 | u32::from(lower))
    }

    #[inline]
    fn try_write_byte(&mut self, address: u32, value: u8) -> Result<(), BusFault> {
        if self.soc.fault.is_some() {
            return Ok(());
        }
        let address = address & 0xFF_FFFF;
        let page = self.soc.write_map[(address >> PAGE_BITS) as usize];
        self.soc.clk += u64::from(page.clocks);
        match page.device {
            Device::Ram => self.soc.ram[address as usize & (RAM_SIZE - 1)] = value,
            Device::None => return Err(self.nobody(address, true, 1)),
            Device::Flash => self.soc.warn(address, true, "flash written: it keeps its contents"),
            // The CPU drives the byte on both halves of the data bus.
            Device::HalfRam => {
                let lanes = 2 >> (address & 1);
                self.write_half_ram(address, u16::from(value) * 0x0101, lanes, page);
            }
            Device::Registers => {
                let mask = 0xFF00 >> (8 * (address & 1));
                return self.register_write(address, u16::from(value) * 0x0101, mask);
            }
        }
        Ok(())
    }

    #[inline]
    fn try_write_word(&mut self, address: u32, value: u16) -> Result<(), BusFault> {
        if self.soc.fault.is_some() {
            return Ok(());
        }
        let address = address & 0xFF_FFFF;
        if address & 1 != 0 {
            return Err(self.odd(address, true, 2));
        }
        let page = self.soc.write_map[(address >> PAGE_BITS) as usize];
        self.soc.clk += u64::from(page.clocks);
        match page.device {
            Device::Ram => {
                let at = address as usize & (RAM_SIZE - 2);
                [self.soc.ram[at], self.soc.ram[at + 1]] = value.to_be_bytes();
            }
            Device::None => return Err(self.nobody(address, true, 2)),
            Device::Flash => self.soc.warn(address, true, "flash written: it keeps its contents"),
            Device::HalfRam => self.write_half_ram(address, value, 3, page),
            Device::Registers => return self.register_write(address, value, 0xFFFF),
        }
        Ok(())
    }

    #[inline]
    fn try_write_long(&mut self, address: u32, value: u32) -> Result<(), BusFault> {
        if address & 1 != 0 && self.soc.fault.is_none() {
            return Err(self.odd(address & 0xFF_FFFF, true, 4));
        }
        self.try_write_word(address, (value >> 16) as u16)?;
        self.try_write_word(address.wrapping_add(2), value as u16)
    }

    #[inline]
    fn try_read_immediate_word(&mut self, address: u32) -> Result<u16, BusFault> {
        self.fetch_word(address)
    }

    #[inline]
    fn try_read_immediate_long(&mut self, address: u32) -> Result<u32, BusFault> {
        let upper = self.fetch_word(address)?;
        let lower = self.fetch_word(address.wrapping_add(2))?;
        Ok(u32::from(upper) << 16 | u32::from(lower))
    }

    fn reset_devices(&mut self) {
        self.soc.reset_modules();
        self.soc.plan_drive();
        self.soc.plan();
    }
}
