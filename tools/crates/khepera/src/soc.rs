//! The chip around the CPU, and the board around the chip: registers, events, interrupts.

use common_sys::constants as board;
use sim::{Ps, US};

use crate::adc::Adc;
use crate::bus::Fault;
use crate::diagnostics::{Diagnostic, Diagnostics};
use crate::drive::{Channel, Drive, Edge, MotorDrive, WHEELS};
use crate::gpt::Gpt;
use crate::integration::{Integration, ResetCause};
use crate::memory::{Device, Memory};
use crate::qsm::Qsm;
use crate::qspi::Pins;
use crate::timebase::Timebase;
use crate::turret_bus::TurretBus;

/// How often the turret's interrupt lines are looked at.
const PIN_POLL: Ps = 50 * US;
/// At 0, the interrupt arbitration fields say that a module takes no part.
const SPURIOUS_VECTOR: u8 = 24;
/// Encoder pins on port GP: left A, left B, right A, right B.
const ENCODER_PINS: [[u8; 2]; WHEELS] = [
    [board::BOARD_GP_LEFT_A as u8, board::BOARD_GP_LEFT_B as u8],
    [board::BOARD_GP_RIGHT_A as u8, board::BOARD_GP_RIGHT_B as u8],
];
/// Wheels whose channel A also goes to pin PAI, and to pin PCLK.
const COUNTED_WHEELS: [usize; 2] =
    [board::BOARD_PAI_WHEEL as usize, board::BOARD_PCLK_WHEEL as usize];
const DIRECTION_PINS: [u8; WHEELS] =
    [board::BOARD_GP_LEFT_FORWARD as u8, board::BOARD_GP_RIGHT_FORWARD as u8];

/// Chip and board without the CPU.
#[derive(Clone)]
pub(crate) struct Soc {
    pub time: Timebase,
    /// System clocks since power-on: now.
    pub clk: u64,
    pub next_event: u64,
    pub memory: Memory,
    pub system: Integration,
    pub qsm: Qsm,
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
    /// Cut the supply in the middle of the flash operation of this number.
    pub cut_operation: Option<u64>,
    cut_clk: u64,
    /// The supply was cut; whoever holds the switch finds out.
    pub supply_cut: bool,
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

const RESET_HZ: u64 = 4 * board::BOARD_CRYSTAL_HZ as u64 * 64;

impl Soc {
    /// Powered on at time `start` with this flash.
    pub fn new(flash: Vec<u8>, host_baud: Option<u32>, battery_mv: u32, start: Ps) -> Self {
        let time = Timebase::new(RESET_HZ, start);
        let system = Integration::new(ResetCause::PowerUp, 0, &time);
        let mut soc = Self {
            time,
            clk: 0,
            next_event: 0,
            memory: Memory::new(flash),
            system,
            qsm: Qsm::new(host_baud),
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
            cut_operation: None,
            cut_clk: u64::MAX,
            supply_cut: false,
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
        soc.memory.remap(&soc.system);
        soc
    }

    /// Chip reset; RAM, flash and the world go on.
    pub fn reset(&mut self, cause: ResetCause) {
        let now = self.now();
        self.memory.flash.interrupt(now);
        if cause == ResetCause::PowerUp {
            self.memory.lose_ram();
        }
        self.time.set_hz(self.clk, RESET_HZ);
        self.system = Integration::new(cause, self.clk, &self.time);
        self.reset_modules();
        self.fault = None;
        self.reset_request = None;
        self.irq7_edge = false;
        self.requested = 0; // what was asked of the program before is not its successor's latency
        self.memory.remap(&self.system);
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
    pub fn reset_modules(&mut self) {
        self.qsm.reset();
        self.gpt.reset(self.clk);
    }

    pub fn warn(&mut self, address: u32, write: bool, what: &'static str) {
        let time = self.time.ps(self.clk);
        self.diagnostics.add(Diagnostic { time, pc: self.pc, address, write, what });
    }

    pub fn diagnostics(&self) -> &[Diagnostic] {
        self.diagnostics.list()
    }

    fn check_speed(&mut self, address: u32) {
        let needed = 3 + board::BOARD_WAIT_STATES as u8;
        let page = self.memory.read_page(address);
        if page.clocks < needed && matches!(page.device, Device::Flash | Device::Ram) {
            self.warn(address, false, "fewer wait states than the memory needs");
        }
    }

    // ---- events

    fn watched(&self) -> [[bool; 2]; WHEELS] {
        let mut watched = ENCODER_PINS.map(|pins| pins.map(|pin| self.gpt.watches(pin)));
        for (wheel, counted) in COUNTED_WHEELS.into_iter().zip(self.gpt.counts_pulses()) {
            watched[wheel][Channel::A as usize] |= counted;
        }
        watched
    }

    fn encoder_edge(&mut self, clk: u64, edge: Edge) {
        self.gpt.edge(clk, ENCODER_PINS[edge.wheel][edge.channel as usize], edge.high);
        if edge.channel == Channel::A && edge.wheel == COUNTED_WHEELS[0] {
            self.gpt.pulse(edge.high);
        } else if edge.channel == Channel::A {
            self.gpt.clock(edge.high);
        }
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
            .qsm
            .sci
            .next_event(&self.time)
            .min(self.qsm.qspi.next_event())
            .min(self.gpt.next_event())
            .min(self.drive_clk)
            .min(self.system.pit_clk)
            .min(self.system.watchdog_clk)
            .min(self.pin_poll_clk)
            .min(self.cut_clk);
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
        self.qsm.sci.run_to(clk, &self.time);
        self.gpt.run_to(clk);
        while self.qsm.qspi.next_event() <= clk {
            let at = self.qsm.qspi.next_event();
            let pins = self.qsm.qspi.event();
            self.drive_pins(at, pins, turret);
        }
        if self.drive_clk <= clk {
            let t = self.time.ps(clk);
            let drives = self.motors();
            if let Some(edge) = self.drive.event(t, self.watched(), drives, self.battery_mv) {
                self.encoder_edge(clk, edge);
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
            self.poll_pins(clk, turret);
        }
        if self.cut_clk <= clk {
            self.cut_clk = u64::MAX;
            self.cut_operation = None;
            self.supply_cut = true;
            self.reset_request = Some(ResetCause::PowerUp);
        }
    }

    /// After a write to the flash: is this the operation in which the supply is to fail?
    pub fn plan_cut(&mut self) {
        if self.cut_operation.is_none_or(|number| self.memory.flash.operations() <= number) {
            return;
        }
        let now = self.now();
        if let Some(t) = self.memory.flash.half_done(now) {
            self.cut_clk = self.time.clk_at_or_after(t);
            self.plan();
        }
    }

    /// Time of the present clock.
    pub fn now(&self) -> Ps {
        self.time.ps(self.clk)
    }

    /// Look at the turret's interrupt lines at clock `clk`: times on the border never go back.
    pub fn poll_pins(&mut self, clk: u64, turret: &mut impl TurretBus) {
        let now = self.time.ps(clk);
        let levels = turret.irq_pins(now);
        self.irq7_edge |= self.irq_levels & !levels & 0x80 != 0;
        self.irq_levels = levels;
        self.pin_poll_clk = self.time.clk_at_or_after(now + PIN_POLL).max(clk + 1);
    }

    fn drive_pins(&mut self, clk: u64, pins: Option<Pins>, turret: &mut impl TurretBus) {
        let now = self.time.ps(clk);
        match pins {
            None => return,
            Some(Pins::Select(pcs)) => turret.select(now, pcs),
            Some(Pins::Exchange { word, bits }) => {
                let answer = if u32::from(self.qsm.qspi.pcs()) == board::BOARD_PCS_ADC {
                    let off = self.system.port_f_low() >> board::BOARD_PF_EMITTERS & 1 != 0;
                    self.adc.exchange(now, word, bits, !off)
                } else {
                    turret.exchange(now, word, bits)
                };
                self.qsm.qspi.received(answer, bits);
            }
        }
        self.poll_pins(clk, turret);
    }

    // ---- interrupts

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
    pub fn request(&mut self) {
        let [sci, qspi] = self.qsm.levels();
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
        let clocks = u128::from(self.clk - since);
        let latency = (clocks * u128::from(sim::SECOND) / u128::from(self.time.hz())) as Ps;
        let worst = &mut self.worst_latency[usize::from(level)];
        *worst = latency.max(*worst);
        // If the level is still requested after this, that counts from now.
        self.requested &= !(1 << level);
    }

    /// Interrupt acknowledge: the modules that request `level` arbitrate by IARB, 0 takes no part.
    pub fn acknowledge(&mut self, level: u8) -> u8 {
        self.note_latency(level);
        let pin = self.system.irq_asserted(self.irq_levels) >> level & 1 != 0
            || level == 7 && self.irq7_edge;
        let pit = self.system.pit_level() == level;
        let requests = [
            (pit || pin, self.system.iarb()),
            (self.qsm.levels().contains(&level), self.qsm.iarb()),
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
            Some(1) => self.qsm.vector(level),
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

    /// When the duty registers have been written since the last call; the first 256 times.
    pub fn take_pwm_writes(&mut self) -> Vec<Ps> {
        let clocks = std::mem::take(&mut self.gpt.pwm_written);
        clocks.into_iter().map(|clk| self.time.ps(clk)).collect()
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
    pub fn read_register(&mut self, address: u32, mask: u16) -> Option<u16> {
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
            0xC00..=0xDFF => self.qsm.read(address & 0x1FF, mask),
            _ => return None,
        })
    }

    /// False where the chip has no register.
    pub fn write_register(
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
            0xC00..=0xDFF => {
                let now = self.time.ps(self.clk);
                let effect = self.qsm.write(self.clk, now, address & 0x1FF, value, mask);
                self.drive_pins(self.clk, effect.pins, turret);
                effect.warning
            }
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
            self.memory.remap(&self.system);
            self.check_speed(board::BOARD_FLASH_BASE);
            self.check_speed(board::BOARD_RAM_BASE);
        }
        effect.warning
    }
}
