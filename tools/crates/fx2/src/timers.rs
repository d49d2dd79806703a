//! Timers 0, 1 and 2 (TRM appendix C.2), counted lazily: nothing runs between two looks at them.
//!
//! The counter inputs T0, T1, T2 and T2EX are pins of their own that the board has no line to, so a
//! timer set to count them stands still.

use crate::time::{NEVER, Tick};
use serde::{Deserialize, Serialize};

const TF1: u8 = 0x80;
const TR1: u8 = 0x40;
const TF0: u8 = 0x20;
const TR0: u8 = 0x10;
const COUNTER: u8 = 0x04;
const TF2: u8 = 0x80;
const RCLK_TCLK: u8 = 0x30;
const TR2: u8 = 0x04;
const CT2: u8 = 0x02;
const CPRL2: u8 = 0x01;

/// How one counter runs at present.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Run {
    /// Ticks of one count.
    step: Tick,
    /// Counts from here to the overflow, at least 1.
    to_overflow: u64,
    /// Counts between overflows after that.
    period: u64,
}

/// The three timers with TCON, TMOD, T2CON and the timer bits of CKCON.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Timers {
    pub(crate) tcon: u8,
    pub(crate) tmod: u8,
    pub(crate) t2con: u8,
    /// PCON bit 7: serial port 0 takes twice the rate.
    pub(crate) smod0: bool,
    ckcon: u8,
    /// TL0, TL1, TH0, TH1 in the order of their addresses.
    counts: [u8; 4],
    rcap2: u16,
    t2: u16,
    /// Everything is counted up to here.
    stamp: Tick,
    /// Ticks of a machine cycle (4 clocks).
    cycle: Tick,
}

/// One of the four things that can count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Unit {
    T0,
    T1,
    /// TH0 alone, in mode 3.
    High0,
    T2,
}

impl Timers {
    pub(crate) fn new(cycle: Tick) -> Self {
        Self {
            tcon: 0,
            tmod: 0,
            t2con: 0,
            smod0: false,
            ckcon: 0x01,
            counts: [0; 4],
            rcap2: 0,
            t2: 0,
            stamp: 0,
            cycle,
        }
    }

    /// Power-on or CPU reset at `now`.
    pub(crate) fn reset(&mut self, now: Tick) {
        *self = Self { stamp: now, ..Self::new(self.cycle) };
    }

    /// The clock stood still until `now`.
    pub(crate) fn skip_to(&mut self, now: Tick) {
        self.stamp = now;
    }

    /// The CPU's clock changes: `cycle` is the new length of a machine cycle.
    pub(crate) fn set_cycle(&mut self, now: Tick, cycle: Tick) {
        self.sync(now);
        self.cycle = cycle;
    }

    pub(crate) fn set_ckcon(&mut self, now: Tick, value: u8) {
        self.sync(now);
        self.ckcon = value;
    }

    pub(crate) fn write_tcon(&mut self, now: Tick, value: u8) {
        self.sync(now);
        self.tcon = value;
    }

    pub(crate) fn write_tmod(&mut self, now: Tick, value: u8) {
        self.sync(now);
        self.tmod = value;
    }

    pub(crate) fn write_t2con(&mut self, now: Tick, value: u8) {
        self.sync(now);
        self.t2con = value;
    }

    /// TL0, TL1, TH0, TH1 for `index` 0..=3.
    pub(crate) fn read_count(&mut self, now: Tick, index: usize) -> u8 {
        self.sync(now);
        self.counts[index]
    }

    pub(crate) fn write_count(&mut self, now: Tick, index: usize, value: u8) {
        self.sync(now);
        self.counts[index] = value;
    }

    /// RCAP2L, RCAP2H, TL2, TH2 for `index` 0..=3.
    pub(crate) fn read_timer2(&mut self, now: Tick, index: usize) -> u8 {
        self.sync(now);
        let word = if index < 2 { self.rcap2 } else { self.t2 };
        word.to_le_bytes()[index & 1]
    }

    pub(crate) fn write_timer2(&mut self, now: Tick, index: usize, value: u8) {
        self.sync(now);
        let word = if index < 2 { &mut self.rcap2 } else { &mut self.t2 };
        let mut bytes = word.to_le_bytes();
        bytes[index & 1] = value;
        *word = u16::from_le_bytes(bytes);
    }

    /// Ticks of one UART bit at 16 samples a bit from timer 2's overflows, or from timer 1's with
    /// 32 (16 if `doubled`). `None` if that timer does not produce a rate.
    pub(crate) fn baud_ticks(&self, receive: bool, doubled: bool) -> Option<Tick> {
        if self.t2con & if receive { 0x20 } else { 0x10 } != 0 {
            return (self.t2con & TR2 != 0)
                .then(|| (0x1_0000 - Tick::from(self.rcap2)) * 16 * self.cycle / 2);
        }
        self.baud_ticks_timer1(doubled)
    }

    /// As [`Self::baud_ticks`] from timer 1, which is all that serial port 1 can have.
    pub(crate) fn baud_ticks_timer1(&self, doubled: bool) -> Option<Tick> {
        let run = self.run(Unit::T1)?;
        Some(run.period * run.step * if doubled { 16 } else { 32 })
    }

    /// Counts everything up to `now` and sets the overflow flags.
    pub(crate) fn sync(&mut self, now: Tick) {
        for unit in [Unit::T0, Unit::T1, Unit::High0, Unit::T2] {
            let Some(run) = self.run(unit) else { continue };
            let counts = now / run.step - self.stamp / run.step;
            if counts >= run.to_overflow {
                self.set_flag(unit);
                let since = (counts - run.to_overflow) % run.period;
                self.set_to_overflow(unit, run.period - since);
            } else {
                self.set_to_overflow(unit, run.to_overflow - counts);
            }
        }
        self.stamp = now;
    }

    /// When the next overflow sets a flag that is not set yet. Call after [`Self::sync`].
    pub(crate) fn next_event(&self) -> Tick {
        [Unit::T0, Unit::T1, Unit::High0, Unit::T2]
            .into_iter()
            .filter(|&unit| !self.flag(unit))
            .filter_map(|unit| self.run(unit))
            .map(|run| (self.stamp / run.step + run.to_overflow) * run.step)
            .min()
            .unwrap_or(NEVER)
    }

    fn flag(&self, unit: Unit) -> bool {
        match unit {
            Unit::T0 => self.tcon & TF0 != 0,
            Unit::T1 => self.mode(0) == 3 || self.tcon & TF1 != 0,
            Unit::High0 => self.tcon & TF1 != 0,
            Unit::T2 => self.t2con & (RCLK_TCLK | TF2) != 0,
        }
    }

    /// Timer 1 loses its flag to TH0 in mode 3, timer 2 sets none as a baud rate generator.
    fn set_flag(&mut self, unit: Unit) {
        match unit {
            Unit::T0 => self.tcon |= TF0,
            Unit::T1 if self.mode(0) == 3 => {}
            Unit::T1 | Unit::High0 => self.tcon |= TF1,
            Unit::T2 if self.t2con & RCLK_TCLK != 0 => {}
            Unit::T2 => self.t2con |= TF2,
        }
    }

    fn mode(&self, timer: usize) -> u8 {
        self.tmod >> (4 * timer) & 3
    }

    /// CLKOUT/12, or CLKOUT/4 if its bit in CKCON is set.
    fn step(&self, ckcon_bit: u8) -> Tick {
        if self.ckcon & ckcon_bit != 0 { self.cycle } else { 3 * self.cycle }
    }

    fn run(&self, unit: Unit) -> Option<Run> {
        let (low, high) = match unit {
            Unit::T0 => (self.counts[0], self.counts[2]),
            Unit::T1 => (self.counts[1], self.counts[3]),
            Unit::High0 => (self.counts[2], 0),
            Unit::T2 => (0, 0),
        };
        let (left, period) = match unit {
            Unit::T0 | Unit::T1 => {
                let timer = usize::from(unit == Unit::T1);
                let started = match timer {
                    0 => self.tcon & TR0 != 0,
                    // In timer 0's mode 3, TR1 belongs to TH0 and timer 1 runs freely.
                    _ => self.mode(1) != 3 && (self.tcon & TR1 != 0 || self.mode(0) == 3),
                };
                if !started || self.tmod >> (4 * timer) & COUNTER != 0 {
                    return None;
                }
                match self.mode(timer) {
                    0 => (0x2000 - (u64::from(high) << 5 | u64::from(low & 0x1F)), 0x2000),
                    1 => (0x1_0000 - (u64::from(high) << 8 | u64::from(low)), 0x1_0000),
                    2 => (0x100 - u64::from(low), 0x100 - u64::from(high)),
                    _ => (0x100 - u64::from(low), 0x100),
                }
            }
            Unit::High0 => {
                if self.mode(0) != 3 || self.tcon & TR1 == 0 {
                    return None;
                }
                (0x100 - u64::from(low), 0x100)
            }
            Unit::T2 => {
                if self.t2con & TR2 == 0 || self.t2con & CT2 != 0 {
                    return None;
                }
                let captures = self.t2con & CPRL2 != 0 && self.t2con & RCLK_TCLK == 0;
                let reload = if captures { 0 } else { u64::from(self.rcap2) };
                (0x1_0000 - u64::from(self.t2), 0x1_0000 - reload)
            }
        };
        let step = match unit {
            Unit::T0 | Unit::High0 => self.step(0x08),
            Unit::T1 => self.step(0x10),
            Unit::T2 if self.t2con & RCLK_TCLK != 0 => self.cycle / 2,
            Unit::T2 => self.step(0x20),
        };
        Some(Run { step, to_overflow: left, period })
    }

    fn set_to_overflow(&mut self, unit: Unit, left: u64) {
        let below = |modulus: u64| (modulus - left) as u16;
        match unit {
            Unit::T0 | Unit::T1 => {
                let timer = usize::from(unit == Unit::T1);
                match self.mode(timer) {
                    0 => {
                        let value = below(0x2000);
                        self.counts[timer] = (value & 0x1F) as u8;
                        self.counts[timer + 2] = (value >> 5) as u8;
                    }
                    1 => {
                        let [low, high] = below(0x1_0000).to_le_bytes();
                        self.counts[timer] = low;
                        self.counts[timer + 2] = high;
                    }
                    _ => self.counts[timer] = below(0x100) as u8,
                }
            }
            Unit::High0 => self.counts[2] = below(0x100) as u8,
            Unit::T2 => self.t2 = below(0x1_0000),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks of a machine cycle at 48 MHz.
    const CYCLE: Tick = 4;

    fn timers(tmod: u8, tcon: u8) -> Timers {
        let mut timers = Timers::new(CYCLE);
        timers.tmod = tmod;
        timers.tcon = tcon;
        timers
    }

    #[test]
    fn mode_1_counts_a_twelfth_of_the_clock_and_sets_its_flag() {
        let mut t = timers(0x01, TR0);
        t.write_count(0, 0, 0xFE);
        t.write_count(0, 2, 0xFF);
        assert_eq!(t.next_event(), 24);
        t.sync(23);
        assert_eq!((t.tcon & TF0, t.read_count(23, 0)), (0, 0xFF));
        t.sync(24);
        assert_eq!((t.tcon & TF0, t.read_count(24, 0), t.read_count(24, 2)), (TF0, 0, 0));
        assert_eq!(t.next_event(), NEVER, "the flag is set already");
    }

    #[test]
    fn mode_2_reloads_and_ckcon_makes_it_three_times_faster() {
        let mut t = timers(0x20, TR1);
        t.set_ckcon(0, 0x11);
        t.write_count(0, 1, 0xF0);
        t.write_count(0, 3, 0xF0);
        t.sync(4 * (16 * 5 + 3));
        assert_eq!((t.tcon & TF1, t.read_count(4 * 83, 1)), (TF1, 0xF3));
    }

    #[test]
    fn mode_0_has_13_bits() {
        let mut t = timers(0x00, TR0);
        assert_eq!(t.next_event(), 12 * 8192);
        t.sync(12 * 33);
        assert_eq!((t.read_count(12 * 33, 0), t.read_count(12 * 33, 2)), (1, 1));
    }

    #[test]
    fn mode_3_splits_timer_0() {
        let mut t = timers(0x03, TR0 | TR1);
        t.write_count(0, 0, 0xFF);
        t.write_count(0, 2, 0xFE);
        t.sync(12);
        assert_eq!(t.tcon & (TF0 | TF1), TF0);
        t.sync(24);
        assert_eq!(t.tcon & (TF0 | TF1), TF0 | TF1);
    }

    #[test]
    fn timer_2_reloads_from_rcap2() {
        let mut t = timers(0, 0);
        t.write_timer2(0, 0, 0xF0);
        t.write_timer2(0, 1, 0xFF);
        t.write_timer2(0, 2, 0xFF);
        t.write_timer2(0, 3, 0xFF);
        t.write_t2con(0, TR2);
        t.sync(12);
        assert_eq!((t.t2con & TF2, t.read_timer2(12, 2)), (TF2, 0xF0));
    }

    #[test]
    fn baud_rate_of_timer_1_is_its_overflow_by_32() {
        // TH1 = 0xF3 at 48 MHz / 12, SMOD = 0: 13 * 12 * 32 clocks a bit = 9615 baud.
        let mut t = timers(0x20, TR1);
        t.write_count(0, 3, 0xF3);
        assert_eq!(t.baud_ticks(false, false), Some(13 * 12 * 32));
        assert_eq!(t.baud_ticks(false, true), Some(13 * 12 * 16));
    }
}
