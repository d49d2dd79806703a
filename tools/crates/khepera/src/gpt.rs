//! GPT: the general-purpose timer (GPTRM): captures, compares, PWM, port GP.
//!
//! Nothing is counted: TCNT is computed from the system clock when somebody looks, and compares have
//! a known next time. The pulse accumulator counts events; gated, it is not modelled, nor are compares
//! while PCLK clocks TCNT, or a PWM clocked by PCLK.

const NEVER: u64 = u64::MAX;

/// TFLG1 and TMSK1: IC1..IC3 in bits 0..2, OC1..OC4 in bits 3..6, IC4/OC5 in bit 7.
const FIRST_COMPARE: u8 = 3;
/// TFLG2 and TMSK2.
const TOF: u8 = 1 << 7;
/// TFLG2 and TMSK2: the pulse accumulator has wrapped, or has counted.
const PAOVF: u8 = 1 << 5;
const PAIF: u8 = 1 << 4;
/// PACTL: level of pin PAI, on, gated, rising edges count, level of pin PCLK, channel 4/5 is a
/// capture.
const PACTL_PAIS: u8 = 1 << 7;
const PACTL_PAEN: u8 = 1 << 6;
const PACTL_PAMOD: u8 = 1 << 5;
const PACTL_PEDGE: u8 = 1 << 4;
const PACTL_PCLKS: u8 = 1 << 3;
const PACTL_I4: u8 = 1 << 2;
/// TMSK2.CPR that clocks TCNT by pin PCLK.
const CPR_PCLK: u8 = 7;

/// One of the two pulse-width modulators.
#[derive(Clone, Copy, Debug, Default)]
struct Pwm {
    /// What firmware wrote last.
    written: u8,
    /// From this clock on it is used: the duty changes between periods only.
    from: u64,
    /// What is used until then.
    buffer: u8,
}

impl Pwm {
    fn at(&self, clk: u64) -> u8 {
        if clk >= self.from { self.written } else { self.buffer }
    }
}

/// So many writes of the duty registers are remembered for somebody who asks.
const PWM_WRITES_KEPT: usize = 256;

/// The timer's registers and counters.
#[derive(Clone, Debug)]
pub(crate) struct Gpt {
    pub mcr: u16,
    pub icr: u16,
    ddrgp: u8,
    portgp: u8,
    oc1m: u8,
    oc1d: u8,
    pactl: u8,
    pacnt: u8,
    /// What TCNT counts while PCLK clocks it.
    pclk_count: u16,
    capture: [u16; 3],
    /// TOC1..TOC4 and TI4/O5.
    compare: [u16; 5],
    tctl1: u8,
    tctl2: u8,
    tmsk1: u8,
    tmsk2: u8,
    tflg1: u8,
    tflg2: u8,
    /// Flags that were read as 1: only those can be cleared.
    seen1: u8,
    seen2: u8,
    prescaler_written: bool,
    /// Clock at which TCNT was, or would have been, 0.
    origin: u64,
    next_match: [u64; 5],
    next_overflow: u64,
    /// Levels that the compares put on pins 3..7.
    latch: u8,
    /// Levels that the board puts on the pins.
    pub board_pins: u8,
    cforc: u8,
    pwmc: u8,
    pwm: [Pwm; 2],
    /// When the duty registers were written since somebody asked.
    pub pwm_written: Vec<u64>,
    reset_clk: u64,
}

impl Gpt {
    pub fn new(clk: u64) -> Self {
        let mut gpt = Self {
            mcr: 0x0080,
            icr: 0,
            ddrgp: 0,
            portgp: 0,
            oc1m: 0,
            oc1d: 0,
            pactl: 0,
            pacnt: 0,
            pclk_count: 0,
            capture: [0xFFFF; 3],
            compare: [0xFFFF; 5],
            tctl1: 0,
            tctl2: 0,
            tmsk1: 0,
            tmsk2: 0,
            tflg1: 0,
            tflg2: 0,
            seen1: 0,
            seen2: 0,
            prescaler_written: false,
            origin: clk,
            next_match: [NEVER; 5],
            next_overflow: NEVER,
            latch: 0,
            board_pins: 0xFF,
            cforc: 0,
            pwmc: 0,
            pwm: [Pwm::default(); 2],
            pwm_written: Vec::new(),
            reset_clk: clk,
        };
        gpt.plan(clk);
        gpt
    }

    pub fn reset(&mut self, clk: u64) {
        *self = Self { board_pins: self.board_pins, ..Self::new(clk) };
    }

    fn shift(&self) -> u32 {
        2 + u32::from(self.tmsk2 & 7)
    }

    /// Whether TCNT follows the system clock.
    fn counting(&self) -> bool {
        self.tmsk2 & 7 != CPR_PCLK
    }

    fn counts(&self, clk: u64) -> u64 {
        if self.counting() { (clk - self.origin) >> self.shift() } else { 0 }
    }

    pub fn tcnt(&self, clk: u64) -> u16 {
        if self.counting() { self.counts(clk) as u16 } else { self.pclk_count }
    }

    fn match_after(&self, clk: u64, value: u16) -> u64 {
        if !self.counting() {
            return NEVER;
        }
        let counts = self.counts(clk);
        let wait = match value.wrapping_sub(counts as u16) {
            0 => 0x1_0000,
            n => u64::from(n),
        };
        self.origin + ((counts + wait) << self.shift())
    }

    fn plan(&mut self, clk: u64) {
        for channel in 0..5 {
            self.next_match[channel] = self.match_after(clk, self.compare[channel]);
        }
        self.next_overflow = self.match_after(clk, 0);
    }

    fn is_compare(&self, channel: usize) -> bool {
        channel < 4 || self.pactl & PACTL_I4 == 0
    }

    /// Only compares that somebody can notice need to be stopped for.
    fn noticed(&self, channel: usize) -> bool {
        let bit = 1u8 << (FIRST_COMPARE as usize + channel);
        let action = match channel {
            0 => self.oc1m,
            n => self.tctl1 >> (2 * (n - 1)) & 3,
        };
        self.is_compare(channel) && (action != 0 || self.tmsk1 & bit != 0 && self.tflg1 & bit == 0)
    }

    pub fn next_event(&self) -> u64 {
        let compares = (0..5).filter(|&n| self.noticed(n)).map(|n| self.next_match[n]);
        let overflow = if self.tmsk2 & !self.tflg2 & TOF != 0 { self.next_overflow } else { NEVER };
        compares.fold(overflow, u64::min)
    }

    pub fn run_to(&mut self, clk: u64) {
        if self.next_overflow <= clk {
            self.tflg2 |= TOF;
            self.next_overflow = self.match_after(clk, 0);
        }
        for channel in 0..5 {
            if self.next_match[channel] <= clk {
                if self.is_compare(channel) {
                    self.tflg1 |= 1 << (FIRST_COMPARE as usize + channel);
                    self.compare_action(channel);
                }
                self.next_match[channel] = self.match_after(clk, self.compare[channel]);
            }
        }
    }

    fn compare_action(&mut self, channel: usize) {
        if channel == 0 {
            self.latch = self.latch & !self.oc1m | self.oc1d & self.oc1m;
            return;
        }
        let pin = 1u8 << (FIRST_COMPARE as usize + channel);
        match self.tctl1 >> (2 * (channel - 1)) & 3 {
            1 => self.latch ^= pin,
            2 => self.latch &= !pin,
            3 => self.latch |= pin,
            _ => {}
        }
    }

    /// Pins whose level a compare decides.
    fn compare_pins(&self) -> u8 {
        let mut pins = self.oc1m;
        for channel in 1..5 {
            if self.is_compare(channel) && self.tctl1 >> (2 * (channel - 1)) & 3 != 0 {
                pins |= 1 << (FIRST_COMPARE as usize + channel);
            }
        }
        pins
    }

    /// Levels of pins GP0..GP7.
    pub fn pins(&self) -> u8 {
        let compare = self.compare_pins();
        let driven = self.latch & compare | self.portgp & !compare;
        driven & self.ddrgp | self.board_pins & !self.ddrgp
    }

    /// Whether edges of pin `pin` matter beyond its level.
    pub fn watches(&self, pin: u8) -> bool {
        self.edges_of(pin) != 0
    }

    /// TCTL2 field of a capture pin: bit 0 rising, bit 1 falling.
    fn edges_of(&self, pin: u8) -> u8 {
        match pin {
            0..=2 => self.tctl2 >> (2 * pin) & 3,
            7 if self.pactl & PACTL_I4 != 0 => self.tctl2 >> 6,
            _ => 0,
        }
    }

    /// The board changed the level of pin `pin`.
    pub fn edge(&mut self, clk: u64, pin: u8, high: bool) {
        let bit = 1u8 << pin;
        self.board_pins = if high { self.board_pins | bit } else { self.board_pins & !bit };
        let wanted = if high { 1 } else { 2 };
        if self.ddrgp & bit != 0 || self.edges_of(pin) & wanted == 0 {
            return;
        }
        let count = self.tcnt(clk);
        match pin {
            7 => self.compare[4] = count,
            _ => self.capture[usize::from(pin)] = count,
        }
        self.tflg1 |= bit;
    }

    /// Whether edges of pin PAI, of pin PCLK are counted.
    pub fn counts_pulses(&self) -> [bool; 2] {
        [self.pactl & PACTL_PAEN != 0, !self.counting()]
    }

    /// The board changed the level of pin PAI.
    pub fn pulse(&mut self, high: bool) {
        self.pactl = self.pactl & !PACTL_PAIS | if high { PACTL_PAIS } else { 0 };
        let counts_rising = self.pactl & PACTL_PEDGE != 0;
        if self.pactl & (PACTL_PAEN | PACTL_PAMOD) != PACTL_PAEN || high != counts_rising {
            return;
        }
        self.pacnt = self.pacnt.wrapping_add(1);
        self.tflg2 |= if self.pacnt == 0 { PAIF | PAOVF } else { PAIF };
    }

    /// The board changed the level of pin PCLK; its rising edges count (assumption).
    pub fn clock(&mut self, high: bool) {
        self.pactl = self.pactl & !PACTL_PCLKS | if high { PACTL_PCLKS } else { 0 };
        if self.counting() || !high {
            return;
        }
        self.pclk_count = self.pclk_count.wrapping_add(1);
        self.tflg2 |= if self.pclk_count == 0 { TOF } else { 0 };
    }

    /// Sources as bits, the first in the vectors' order in bit 0.
    fn pending(&self) -> u16 {
        let two = self.tflg2 & self.tmsk2;
        let bit = |flag, at| u16::from(two & flag != 0) << at;
        u16::from(self.tflg1 & self.tmsk1) | bit(TOF, 8) | bit(PAOVF, 9) | bit(PAIF, 10)
    }

    pub fn interrupt(&self) -> bool {
        self.pending() != 0
    }

    /// Vector of the most urgent source: the one that ICR.IPA lifts above the others, then by number.
    pub fn vector(&self) -> u8 {
        let pending = self.pending();
        let base = (self.icr & 0xF0) as u8;
        let lifted = self.icr >> 12;
        if lifted != 0 && pending << 1 >> lifted & 1 != 0 {
            return base;
        }
        base | (pending.trailing_zeros() as u8 + 1)
    }

    /// Share of the time that PWM `channel` (0 = A, 1 = B) is high, 0..=1.
    pub fn duty(&self, clk: u64, channel: usize) -> f64 {
        let forced = self.cforc & if channel == 0 { 2 } else { 1 } != 0;
        if forced {
            let high = self.pwmc & if channel == 0 { 2 } else { 1 } != 0;
            return if high { 1.0 } else { 0.0 };
        }
        if self.pwmc >> 4 & 7 == 7 {
            return 0.0; // clocked by PCLK, which is not wired
        }
        f64::from(self.pwm[channel].at(clk)) / 256.0
    }

    fn write_pwm(&mut self, clk: u64, channel: usize, value: u8) {
        let slow = self.pwmc & if channel == 0 { 8 } else { 4 } != 0;
        let shift = 1 + u32::from(self.pwmc >> 4 & 7) + if slow { 15 } else { 8 };
        let buffer = self.pwm[channel].at(clk);
        let from = self.reset_clk + ((((clk - self.reset_clk) >> shift) + 1) << shift);
        self.pwm[channel] = Pwm { written: value, from, buffer };
    }

    fn pwmcnt(&self, clk: u64) -> u16 {
        ((clk - self.reset_clk) >> (1 + (self.pwmc >> 4 & 7))) as u16
    }

    /// Word at even `offset`; side effects only for the bytes in `mask`.
    pub fn read(&mut self, clk: u64, offset: u32, mask: u16) -> u16 {
        let pair = |high: u8, low: u8| u16::from(high) << 8 | u16::from(low);
        match offset {
            0x00 => self.mcr,
            0x04 => self.icr,
            0x06 => pair(self.ddrgp, self.pins()),
            0x08 => pair(self.oc1m, self.oc1d),
            0x0A => self.tcnt(clk),
            0x0C => pair(self.pactl, self.pacnt),
            0x0E..=0x12 => self.capture[(offset as usize - 0x0E) / 2],
            0x14..=0x1C => self.compare[(offset as usize - 0x14) / 2],
            0x1E => pair(self.tctl1, self.tctl2),
            0x20 => pair(self.tmsk1, self.tmsk2),
            0x22 => {
                if mask & 0xFF00 != 0 {
                    self.seen1 |= self.tflg1;
                }
                if mask & 0x00FF != 0 {
                    self.seen2 |= self.tflg2;
                }
                pair(self.tflg1, self.tflg2)
            }
            0x24 => pair(self.cforc & 3, self.pwmc),
            0x26 => pair(self.pwm[0].written, self.pwm[1].written),
            0x28 => self.pwmcnt(clk),
            0x2A => pair(self.pwm[0].at(clk), self.pwm[1].at(clk)),
            0x2C => ((clk - self.reset_clk) & 0x1FF) as u16,
            _ => 0,
        }
    }

    /// Write the bytes in `mask` of the word at even `offset`. Returns what is wrong, if anything.
    pub fn write(&mut self, clk: u64, offset: u32, value: u16, mask: u16) -> Option<&'static str> {
        let high = (mask & 0xFF00 != 0).then_some((value >> 8) as u8);
        let low = (mask & 0x00FF != 0).then_some(value as u8);
        let set = |register: &mut u8, byte: Option<u8>| *register = byte.unwrap_or(*register);
        match offset {
            0x00 => self.mcr = self.mcr & !mask | value & mask & 0xF88F,
            0x04 => self.icr = self.icr & !mask | value & mask & 0xF7F0,
            0x06 => {
                set(&mut self.ddrgp, high);
                set(&mut self.portgp, low);
            }
            0x08 => {
                set(&mut self.oc1m, high.map(|m| m & 0xF8));
                set(&mut self.oc1d, low.map(|d| d & 0xF8));
            }
            0x0C => {
                let pins = self.pactl & (PACTL_PAIS | PACTL_PCLKS);
                set(&mut self.pactl, high.map(|p| p & 0x77 | pins));
                set(&mut self.pacnt, low);
                if self.pactl & (PACTL_PAEN | PACTL_PAMOD) == PACTL_PAEN | PACTL_PAMOD {
                    return Some("gated pulse accumulator: not modelled");
                }
            }
            0x14..=0x1C => self.write_compare(clk, (offset as usize - 0x14) / 2, value, mask),
            0x1E => {
                set(&mut self.tctl1, high);
                set(&mut self.tctl2, low);
                return self.compare_without_clock();
            }
            0x20 => {
                set(&mut self.tmsk1, high);
                return match low {
                    Some(mask2) => self.write_tmsk2(clk, mask2),
                    None => self.compare_without_clock(),
                };
            }
            0x22 => self.clear_flags(high, low),
            0x24 => {
                set(&mut self.pwmc, low.map(|p| p & 0x7F));
                if let Some(force) = high {
                    self.cforc = force & 3;
                    (0..5)
                        .filter(|n| force >> (3 + n) & 1 != 0)
                        .for_each(|n| self.compare_action(n));
                }
            }
            0x26 => {
                if self.pwm_written.len() < PWM_WRITES_KEPT {
                    self.pwm_written.push(clk);
                }
                if let Some(duty) = high {
                    self.write_pwm(clk, 0, duty);
                }
                if let Some(duty) = low {
                    self.write_pwm(clk, 1, duty);
                }
            }
            0x02 => return Some("GPT test register"),
            _ => return Some("read-only GPT register written"),
        }
        None
    }

    fn write_compare(&mut self, clk: u64, channel: usize, value: u16, mask: u16) {
        if self.is_compare(channel) {
            self.compare[channel] = self.compare[channel] & !mask | value & mask;
            self.next_match[channel] = self.match_after(clk, self.compare[channel]);
        }
    }

    fn write_tmsk2(&mut self, clk: u64, value: u8) -> Option<&'static str> {
        let count = self.tcnt(clk);
        let same = (self.tmsk2 ^ value) & 7 == 0;
        if self.prescaler_written && !same {
            self.tmsk2 = value & 0xB8 | self.tmsk2 & 7;
            return Some("TMSK2: CPR can be written once after reset; ignored");
        }
        self.prescaler_written = true;
        self.tmsk2 = value & 0xBF;
        if !same && !self.counting() {
            self.pclk_count = count;
        }
        if !same && self.counting() {
            let span = u64::from(count) << self.shift();
            // Keep the count; where there is no clock that far back, let it start at 0.
            self.origin = clk.saturating_sub(span);
        }
        self.plan(clk);
        self.compare_without_clock()
    }

    fn compare_without_clock(&self) -> Option<&'static str> {
        let used = !self.counting() && (0..5).any(|channel| self.noticed(channel));
        used.then_some("compare while PCLK clocks TCNT: not modelled")
    }

    fn clear_flags(&mut self, high: Option<u8>, low: Option<u8>) {
        if let Some(value) = high {
            self.tflg1 &= value | !self.seen1;
            self.seen1 &= self.tflg1;
        }
        if let Some(value) = low {
            self.tflg2 &= value | !self.seen2;
            self.seen2 &= self.tflg2;
        }
    }

    /// IC4 shares its flag with OC5; used by tests and by the state shown to users.
    #[cfg(test)]
    pub fn flags(&self) -> (u8, u8) {
        (self.tflg1, self.tflg2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tcnt_counts_a_quarter_of_the_clock_after_reset() {
        let gpt = Gpt::new(100);
        assert_eq!(gpt.tcnt(100), 0);
        assert_eq!(gpt.tcnt(103), 0);
        assert_eq!(gpt.tcnt(104), 1);
        assert_eq!(gpt.tcnt(100 + 4 * 0x1_0001), 1);
    }

    #[test]
    fn prescaler_can_be_written_once() {
        let mut gpt = Gpt::new(0);
        assert_eq!(gpt.write(0, 0x20, 0x0006, 0x00FF), None);
        assert_eq!(gpt.tcnt(256 * 7), 7);
        assert!(gpt.write(256 * 7, 0x20, 0x0000, 0x00FF).is_some());
        assert_eq!(gpt.tcnt(256 * 9), 9);
    }

    #[test]
    fn a_capture_holds_the_count_and_its_flag_clears_only_after_being_read() {
        let mut gpt = Gpt::new(0);
        gpt.write(0, 0x1E, 0x0003, 0x00FF);
        gpt.write(0, 0x20, 0x0100, 0xFF00);
        gpt.board_pins = 0;
        gpt.edge(4000, 0, true);
        assert_eq!(gpt.read(4000, 0x0E, 0xFFFF), 1000);
        assert!(gpt.interrupt());
        gpt.write(4100, 0x22, 0x0000, 0xFF00);
        assert_eq!(gpt.flags().0, 1, "not read as 1 yet");
        gpt.read(4200, 0x22, 0xFF00);
        gpt.write(4300, 0x22, 0xFE00, 0xFF00);
        assert_eq!(gpt.flags().0, 0);
    }

    #[test]
    fn vectors_follow_the_source_numbers_and_ipa_lifts_one() {
        let mut gpt = Gpt::new(0);
        gpt.write(0, 0x04, 0x0650, 0xFFFF);
        gpt.write(0, 0x20, 0xFF80, 0xFFFF);
        gpt.tflg1 = 0x82;
        assert_eq!(gpt.vector(), 0x52, "IC2");
        gpt.write(0, 0x04, 0x8650, 0xFFFF);
        assert_eq!(gpt.vector(), 0x50, "IC4 adjusted");
        gpt.tflg1 = 0;
        gpt.tflg2 = TOF;
        assert_eq!(gpt.vector(), 0x59, "overflow");
    }

    #[test]
    fn the_pulse_accumulator_counts_edges_of_one_kind_and_tells_when_it_wraps() {
        let mut gpt = Gpt::new(0);
        assert_eq!(gpt.write(0, 0x0C, 0x50FE, 0xFFFF), None);
        gpt.write(0, 0x20, 0x0020, 0x00FF);
        gpt.write(0, 0x04, 0x0650, 0xFFFF);
        for high in [true, false, true] {
            assert!(!gpt.interrupt() || gpt.read(0, 0x0C, 0xFFFF) as u8 == 0);
            gpt.pulse(high);
        }
        assert_eq!(gpt.read(0, 0x0C, 0xFFFF), 0xD000, "PAIS is high");
        assert_eq!((gpt.interrupt(), gpt.vector()), (true, 0x5A));
        assert!(gpt.write(0, 0x0C, 0x7000, 0xFF00).is_some(), "gated");
    }

    #[test]
    fn pclk_clocks_tcnt_when_it_is_chosen() {
        let mut gpt = Gpt::new(0);
        gpt.clock(true);
        assert_eq!(gpt.write(0, 0x20, 0x0007, 0x00FF), None);
        for _ in 0..3 {
            gpt.clock(true);
            gpt.clock(false);
        }
        assert_eq!(gpt.read(1000, 0x0A, 0xFFFF), 3);
        assert!(gpt.write(0, 0x20, 0x0800, 0xFF00).is_some(), "a compare has no clock");
    }

    #[test]
    fn a_compare_comes_at_its_count_and_again_a_round_later() {
        let mut gpt = Gpt::new(0);
        gpt.write(0, 0x14, 1000, 0xFFFF);
        gpt.write(0, 0x20, 0x0800, 0xFF00);
        assert_eq!(gpt.next_event(), 4000);
        gpt.run_to(3999);
        assert_eq!(gpt.flags().0 & 8, 0);
        gpt.run_to(4000);
        assert_eq!(gpt.flags().0 & 8, 8);
        gpt.read(4001, 0x22, 0xFF00);
        gpt.write(4002, 0x22, 0, 0xFF00);
        assert_eq!(gpt.next_event(), 4000 + 4 * 0x1_0000);
    }

    #[test]
    fn pwm_changes_between_periods_only() {
        let mut gpt = Gpt::new(0);
        gpt.write(100, 0x26, 0x8000, 0xFF00);
        assert_eq!(gpt.duty(511, 0), 0.0);
        assert_eq!(gpt.duty(512, 0), 0.5);
        gpt.write(600, 0x24, 0x0202, 0xFFFF);
        assert_eq!(gpt.duty(600, 0), 1.0, "forced high");
    }
}
