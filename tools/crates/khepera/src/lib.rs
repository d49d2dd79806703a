//! The Khepera base: 68331, motors, encoders, sensors.
//!
//! [`Base`] runs a 68331 image. The chip's blocks are modelled from their registers: SIM, QSM
//! (SCI and QSPI) and GPT; the board around them is that of `khepera-firmware/board/khepera.h`.
//! The turret bus goes out through [`turret_bus::TurretBus`].
//!
//! What is exact: times of the serial line, the queue, captures, compares, the periodic interrupt
//! and the watchdog, all counted in system or crystal clocks. What is approximate: how many clocks an
//! instruction takes (see [`Load`]), and the CPU's fault frames (the data buffer and transfer count
//! in them are 0, and a faulted instruction is restarted from its beginning).
//!
//! ```no_run
//! use khepera::{Base, Config, turret_bus::Unconnected};
//!
//! let image = std::fs::read("khepera-firmware.elf")?;
//! let mut base = Base::new(&image, Config::default())?;
//! base.run_until(sim::SECOND, &mut Unconnected);
//! for (_time, byte) in base.serial_take() {
//!     print!("{}", byte as char);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adc;
pub mod battery;
mod bus;
mod cpu32;
mod diagnostics;
mod drive;
mod flash;
mod gpt;
pub mod image;
mod integration;
mod memory;
mod qsm;
mod qspi;
mod sci;
mod soc;
mod timebase;
pub mod turret_bus;

use common_sys::constants as board;
use sim::Ps;

pub use cpu32::CpuState;
pub use diagnostics::Diagnostic;
pub use drive::{MotorDrive, WheelFault};
pub use image::ImageError;
pub use integration::ResetCause;
pub use sci::Parity;

use bus::Bus;
use cpu32::Cpu;
use soc::Soc;
use turret_bus::TurretBus;

/// Below this battery voltage the base's supply supervisor holds the chip in reset, and until it is
/// `RECOVERY_MV` again. ASSUMPTION: a 5 V part behind a low-drop regulator.
const BROWN_OUT_MV: u32 = 3600;
const RECOVERY_MV: u32 = 3800;

/// How long the chip stays in reset, in system clocks (SIMRM 5.7).
const RESET_CLOCKS: u64 = 512;

/// What can be chosen about a base.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Config {
    /// When it is switched on.
    pub start: Ps,
    /// Bits a second at the other end of the serial line, 8N1; None: whatever the base's SCI is set
    /// to.
    pub host_baud: Option<u32>,
    /// Battery voltage in mV.
    pub battery_mv: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self { start: 0, host_baud: Some(board::BOARD_BAUD), battery_mv: drive::NOMINAL_MV }
    }
}

/// How much the CPU had to do since power-on. The model's instruction times are approximate: hold
/// limits at twice the busy count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Load {
    /// System clocks in which instructions or exceptions were executed.
    pub busy_clocks: u64,
    /// System clocks in STOP or LPSTOP, halted or hung.
    pub idle_clocks: u64,
    /// Instructions executed.
    pub instructions: u64,
    /// Exceptions taken, interrupts included.
    pub exceptions: u64,
}

impl Load {
    /// Busy part of the time since `before`, 0..=1.
    pub fn since(&self, before: &Load) -> f64 {
        let busy = self.busy_clocks - before.busy_clocks;
        let all = busy + self.idle_clocks - before.idle_clocks;
        if all == 0 { 0.0 } else { busy as f64 / all as f64 }
    }
}

/// What lies outside the RAM is the loader's, and not of interest.
fn count_clocks(profile: &mut [u64], pc: u32, clocks: u64) {
    let word = pc.wrapping_sub(board::BOARD_RAM_BASE) as usize / 2;
    if let Some(sum) = profile.get_mut(word) {
        *sum += clocks;
    }
}

/// A reset of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reset {
    /// When.
    pub time: Ps,
    /// Why.
    pub cause: ResetCause,
}

/// A base with its firmware. Cloning it is a snapshot.
#[derive(Clone)]
pub struct Base {
    cpu: Cpu,
    soc: Soc,
    load: Load,
    resets: Vec<Reset>,
    switched_on: bool,
    lost_power: bool,
    /// Clocks by word of RAM, if somebody wants to know.
    profile: Option<Vec<u64>>,
}

impl Base {
    /// A base with `image` (ELF32 for the m68k, S-records, or raw bytes) in its flash, switched on at
    /// `config.start`.
    ///
    /// # Errors
    /// See [`ImageError`].
    pub fn new(image: &[u8], config: Config) -> Result<Self, ImageError> {
        Ok(Self::with_flash(image::load(image)?, config))
    }

    /// A base with these contents of its flash, as [`Base::flash`] gave them.
    ///
    /// # Errors
    /// If they are not `BOARD_FLASH_SIZE` bytes.
    pub fn from_flash(contents: &[u8], config: Config) -> Result<Self, ImageError> {
        if contents.len() != board::BOARD_FLASH_SIZE as usize {
            return Err(ImageError::NotTheFlash { len: contents.len() });
        }
        Ok(Self::with_flash(contents.to_vec(), config))
    }

    fn with_flash(flash: Vec<u8>, config: Config) -> Self {
        let soc = Soc::new(flash, config.host_baud, config.battery_mv, config.start);
        let mut base = Self {
            cpu: Cpu::new(),
            soc,
            load: Load::default(),
            resets: vec![],
            switched_on: true,
            lost_power: true,
            profile: None,
        };
        base.soc.reset_request = Some(ResetCause::PowerUp);
        base
    }

    /// Run until time `t`. The last instruction may end a little later: see [`Base::now`].
    pub fn run_until(&mut self, t: Ps, turret: &mut impl TurretBus) {
        self.soc.poll_pins(self.soc.clk, turret);
        self.soc.plan();
        self.supervise(turret);
        let mut end = self.soc.time.clk_at_or_after(t);
        let mut hz = self.soc.time.hz();
        while self.soc.clk < end {
            if self.soc.reset_request.is_some() {
                self.reset_now(turret);
            } else if self.cpu.state == CpuState::Running {
                self.run_busy(end, turret);
            } else {
                self.run_idle(end, turret);
            }
            if hz != self.soc.time.hz() {
                hz = self.soc.time.hz();
                end = self.soc.time.clk_at_or_after(t);
            }
        }
    }

    /// Instructions until `end`, STOP, a reset or a change of frequency.
    fn run_busy(&mut self, end: u64, turret: &mut impl TurretBus) {
        let start = self.soc.clk;
        let hz = self.soc.time.hz();
        let mut bus = Bus { soc: &mut self.soc, turret };
        while bus.soc.clk < end && self.cpu.state == CpuState::Running {
            if bus.soc.next_event <= bus.soc.clk {
                bus.soc.catch_up(bus.turret);
            }
            if bus.soc.reset_request.is_some() || bus.soc.time.hz() != hz {
                break;
            }
            let before = bus.soc.clk;
            let level = bus.soc.level;
            if level != 0 && self.cpu.takes(level) {
                self.cpu.interrupt(&mut bus, level);
            }
            self.cpu.step(&mut bus);
            if let Some(profile) = &mut self.profile {
                count_clocks(profile, bus.soc.pc, bus.soc.clk - before);
            }
        }
        self.load.busy_clocks += self.soc.clk - start;
    }

    /// From event to event until something wakes the CPU.
    fn run_idle(&mut self, end: u64, turret: &mut impl TurretBus) {
        let start = self.soc.clk;
        if self.cpu.state == CpuState::Halted && self.soc.system.halt_monitor() {
            self.soc.reset_request = Some(ResetCause::Halt);
            return;
        }
        while self.soc.clk < end && self.soc.reset_request.is_none() {
            self.soc.catch_up(turret);
            let level = self.soc.level;
            if self.cpu.state == CpuState::Stopped && level != 0 && self.cpu.takes(level) {
                break;
            }
            self.soc.clk = self.soc.next_event.min(end).max(self.soc.clk);
        }
        self.load.idle_clocks += self.soc.clk - start;
        let level = self.soc.level;
        let woken = self.cpu.state == CpuState::Stopped && self.soc.reset_request.is_none();
        if woken && level != 0 && self.cpu.takes(level) && self.soc.clk < end {
            let start = self.soc.clk;
            self.cpu.interrupt(&mut Bus { soc: &mut self.soc, turret }, level);
            self.load.busy_clocks += self.soc.clk - start;
            if let Some(profile) = &mut self.profile {
                count_clocks(profile, self.cpu.pc(), self.soc.clk - start);
            }
        }
    }

    /// Battery low or switched off: hold the chip; good again: let it go.
    fn supervise(&mut self, turret: &mut impl TurretBus) {
        let good = if self.soc.running { BROWN_OUT_MV } else { RECOVERY_MV };
        let runs = self.switched_on && self.soc.battery_mv >= good;
        if self.soc.running && !runs {
            self.soc.hold();
            self.cpu.state = CpuState::Held;
            turret.select(self.now(), 0xF);
        } else if runs && !self.soc.running {
            self.soc.running = true;
            let on = if self.lost_power { ResetCause::PowerUp } else { ResetCause::External };
            self.soc.reset_request = Some(on);
        }
        self.lost_power |= !self.switched_on;
    }

    fn reset_now(&mut self, turret: &mut impl TurretBus) {
        let Some(cause) = self.soc.reset_request.take() else { return };
        if std::mem::take(&mut self.soc.supply_cut) {
            self.switched_on = false;
            self.supervise(turret);
            return;
        }
        let start = self.soc.clk;
        self.lost_power = false;
        self.resets.push(Reset { time: self.now(), cause });
        self.soc.reset(cause);
        turret.select(self.soc.time.ps(self.soc.clk), 0xF);
        self.soc.clk += RESET_CLOCKS;
        self.cpu.reset(&mut Bus { soc: &mut self.soc, turret });
        self.load.idle_clocks += self.soc.clk - start;
    }

    /// Time up to which everything has happened.
    pub fn now(&self) -> Ps {
        self.soc.time.ps(self.soc.clk)
    }

    /// Pull the reset pin for a moment. Takes effect with the next [`Base::run_until`].
    pub fn reset(&mut self) {
        if self.soc.running {
            self.soc.reset_request = Some(ResetCause::External);
        }
    }

    /// Switch the base on or off. Off, nothing runs, and RAM is lost. Takes effect with the next
    /// [`Base::run_until`].
    pub fn set_power(&mut self, on: bool) {
        self.switched_on = on;
    }

    /// Contents of the flash.
    pub fn flash(&self) -> &[u8] {
        self.soc.memory.flash.cells()
    }

    /// Program and erase operations that the flash has begun so far.
    pub fn flash_operations(&self) -> u64 {
        self.soc.memory.flash.operations()
    }

    /// Switch the base off in the middle of the flash operation with this number, counted from 0 as
    /// [`Base::flash_operations`] counts; None: never. [`Base::set_power`] switches it on again.
    pub fn cut_power_at_flash_operation(&mut self, number: Option<u64>) {
        self.soc.cut_operation = number;
    }

    /// Resets so far, the first being power-on.
    pub fn resets(&self) -> &[Reset] {
        &self.resets
    }

    // ---- serial line

    /// Queue characters from the host to the base; they follow each other at the host's baud rate.
    pub fn serial_send(&mut self, bytes: &[u8]) {
        let now = self.now();
        self.soc.qsm.sci.send(now, bytes);
        self.soc.plan();
    }

    /// Characters of [`Base::serial_send`] that have not been sent completely.
    pub fn serial_waiting(&self) -> usize {
        self.soc.qsm.sci.waiting(self.now())
    }

    /// Characters that the base has sent since the last call, with the times of their stop bits'
    /// ends. Those that a UART of the host's baud rate cannot frame are left out and counted by
    /// [`Base::serial_framing_errors`].
    pub fn serial_take(&mut self) -> Vec<(Ps, u8)> {
        self.soc.qsm.sci.take()
    }

    /// Characters lost at the host because their stop bit was wrong.
    pub fn serial_framing_errors(&self) -> u64 {
        self.soc.qsm.sci.host_framing_errors
    }

    /// Change the host's baud rate (None: it follows the SCI's); not while characters are waiting.
    pub fn serial_set_baud(&mut self, baud: Option<u32>) {
        self.soc.qsm.sci.set_host_baud(baud);
    }

    /// Parity bit of the host's characters, both ways; None: 8N1.
    pub fn serial_set_parity(&mut self, parity: Option<Parity>) {
        self.soc.qsm.sci.set_host_parity(parity);
    }

    /// Hold the line to the base low for `time`, after the characters that wait.
    pub fn serial_break(&mut self, time: Ps) {
        let now = self.now();
        self.soc.qsm.sci.send_break(now, time);
        self.soc.plan();
    }

    /// Disturb the line to the base: from `from` on, `time` long, it has the level that it should not
    /// have. Disturbances come in the order of these calls.
    pub fn serial_disturb(&mut self, from: Ps, time: Ps) {
        let now = self.now();
        self.soc.qsm.sci.disturb(now, from, time);
        self.soc.plan();
    }

    // ---- wheels

    /// Speed of the left and right wheel's rim in mm/s, forward positive.
    pub fn wheel_speeds_mm_s(&self) -> [f64; 2] {
        self.soc.drive.speeds_mm_s()
    }

    /// Distance that the left and right wheel have rolled since power-on, in mm.
    pub fn wheel_travel_mm(&self) -> [f64; 2] {
        self.soc.drive.travel_mm(self.now())
    }

    /// Force in N at the rim of the left and right wheel that resists their motion (never drives
    /// them). Stays until changed.
    pub fn set_load(&mut self, newton: [f64; 2]) {
        self.soc.drive.set_load(newton);
    }

    /// Break or repair wheel 0 (left) or 1 (right).
    ///
    /// # Panics
    /// If there is no such wheel.
    pub fn set_wheel_fault(&mut self, wheel: usize, fault: WheelFault) {
        let now = self.now();
        self.soc.drive.set_fault(wheel, fault, now);
        self.soc.plan_drive();
        self.soc.plan();
    }

    /// What the left and right motor get.
    pub fn motors(&self) -> [MotorDrive; 2] {
        self.soc.motors()
    }

    /// When the firmware has written the motors' duty registers since the last call; the first 256
    /// times.
    pub fn take_pwm_writes(&mut self) -> Vec<Ps> {
        self.soc.take_pwm_writes()
    }

    // ---- sensors and LEDs

    /// Readings of the IR sensors, 0..=1023, in the order of K-Team's command N.
    pub fn set_proximity(&mut self, values: [u16; 8]) {
        self.soc.adc.set_proximity(values);
    }

    /// What the IR sensors read with their emitters off, 0..=1023, brighter is lower; 500 until set.
    pub fn set_ambient(&mut self, values: [u16; 8]) {
        self.soc.adc.set_ambient(values);
    }

    /// Battery voltage in mV: what the ADC reads and what the motors get. Below 3600 mV the supply
    /// supervisor holds the chip in reset until there are 3800 mV again. Takes effect with the next
    /// [`Base::run_until`].
    pub fn set_battery_mv(&mut self, millivolt: u32) {
        self.soc.battery_mv = millivolt;
        self.soc.adc.set_battery_mv(millivolt);
    }

    /// True: the ADC does not answer.
    pub fn set_adc_silent(&mut self, silent: bool) {
        self.soc.adc.set_silent(silent);
    }

    /// Whether LED 0 and 1 are on.
    pub fn leds(&self) -> [bool; 2] {
        let port = self.soc.system.port_f_high();
        [board::BOARD_PF_LED0, board::BOARD_PF_LED1].map(|bit| port >> bit & 1 != 0)
    }

    // ---- looking inside

    /// What the CPU is doing.
    pub fn cpu_state(&self) -> CpuState {
        self.cpu.state
    }

    /// Program counter.
    pub fn pc(&self) -> u32 {
        self.cpu.pc()
    }

    /// Status register.
    pub fn sr(&self) -> u16 {
        self.cpu.sr()
    }

    /// D0..D7, A0..A7.
    pub fn registers(&self) -> [u32; 16] {
        self.cpu.registers()
    }

    /// Busy and idle clocks so far.
    pub fn load(&self) -> Load {
        let cpu = &self.cpu;
        Load { instructions: cpu.instructions, exceptions: cpu.exceptions, ..self.load }
    }

    /// From now on, count the clocks of each instruction in RAM, from 0.
    pub fn profile(&mut self) {
        self.profile = Some(vec![0; board::BOARD_RAM_SIZE as usize / 2]);
    }

    /// Addresses of the instructions executed since [`Base::profile`], with the clocks they took. An
    /// interrupt's own clocks count to its handler's first instruction.
    pub fn profiled(&self) -> impl Iterator<Item = (u32, u64)> {
        let clocks = self.profile.iter().flatten().zip(0..);
        clocks.filter(|&(&n, _)| n > 0).map(|(&n, word)| (board::BOARD_RAM_BASE + 2 * word, n))
    }

    /// Longest time from an interrupt's request to its acknowledge so far, by level 0..=7.
    pub fn worst_interrupt_latency(&self) -> [Ps; 8] {
        self.soc.worst_latency
    }

    /// System clock in Hz as SYNCR has it now.
    pub fn system_hz(&self) -> u64 {
        self.soc.time.hz()
    }

    /// The word in flash or RAM at `address`, None elsewhere.
    pub fn peek_word(&self, address: u32) -> Option<u16> {
        self.soc.memory.peek_word(address)
    }

    /// Put a word into RAM at `address`, as a debugger would; false where there is no RAM.
    pub fn poke_word(&mut self, address: u32, value: u16) -> bool {
        self.soc.memory.poke_word(address, value)
    }

    /// What the firmware did that the model does not cover or a chip would not forgive; each thing
    /// once.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        self.soc.diagnostics()
    }
}
