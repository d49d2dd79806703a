//! SCI: the serial communication interface of the QSM (QSMRM section 5), and the line at it.
//!
//! Times are exact: one bit lasts 32 * SCBR system clocks. What comes from the host is a level that
//! changes with time: characters at the host's own rate, breaks, and disturbances over both. The
//! receiver does with it what the manual says: a start bit is looked at three times (RT3, RT5, RT7),
//! every bit three times (RT8, RT9, RT10), two of three decide, and a disagreement is noise. So a
//! wrong rate, a break or a disturbed line give the wrong characters and errors that they would give on
//! a wire. The host's own receiver looks at each bit once.
//!
//! Not modelled: the loop mode, wake-up, and idle detection by long idle characters.

use std::collections::VecDeque;

use sim::{Ps, SECOND};

use crate::timebase::Timebase;

const NEVER: u64 = u64::MAX;

/// SCCR1.
mod cr1 {
    pub const PT: u16 = 1 << 11;
    pub const PE: u16 = 1 << 10;
    pub const M: u16 = 1 << 9;
    pub const TIE: u16 = 1 << 7;
    pub const TCIE: u16 = 1 << 6;
    pub const RIE: u16 = 1 << 5;
    pub const ILIE: u16 = 1 << 4;
    pub const TE: u16 = 1 << 3;
    pub const RE: u16 = 1 << 2;
    pub const SBK: u16 = 1;
    /// LOOPS, ILT, WAKE, RWU.
    pub const NOT_MODELLED: u16 = 1 << 14 | 1 << 12 | 1 << 8 | 1 << 1;
}

/// SCSR.
mod sr {
    pub const TDRE: u16 = 1 << 8;
    pub const TC: u16 = 1 << 7;
    pub const RDRF: u16 = 1 << 6;
    pub const RAF: u16 = 1 << 5;
    pub const IDLE: u16 = 1 << 4;
    pub const OR: u16 = 1 << 3;
    pub const NF: u16 = 1 << 2;
    pub const FE: u16 = 1 << 1;
    pub const PF: u16 = 1;
    pub const RECEIVER: u16 = RDRF | IDLE | OR | NF | FE | PF;
}

/// Receiver samples, in sixteenths of a bit after its beginning.
const START_SAMPLES: [u64; 3] = [2, 4, 6];
const BIT_SAMPLES: [u64; 3] = [7, 8, 9];

/// Parity bit after the eight data bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parity {
    /// The number of ones is even.
    Even,
    /// It is odd.
    Odd,
}

impl Parity {
    /// The parity bit of `data`.
    fn bit(self, data: u16) -> u16 {
        let odd = (data.count_ones() & 1) as u16;
        if self == Self::Even { odd } else { 1 - odd }
    }
}

/// Bits that follow each other on a wire: bit n of `levels` is the n-th.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Frame {
    start: Ps,
    bit: Ps,
    bits: u64,
    levels: u16,
}

impl Frame {
    fn end(&self) -> Ps {
        self.start + self.bits * self.bit
    }

    fn covers(&self, t: Ps) -> bool {
        (self.start..self.end()).contains(&t)
    }

    /// The level at `t`, which it covers.
    fn level(&self, t: Ps) -> bool {
        self.levels >> ((t - self.start) / self.bit) & 1 != 0
    }
}

/// Start bit, `data_bits` data bits, stop bit.
fn framed(data: u16, data_bits: u64) -> u16 {
    (1 << (data_bits + 1)) | ((data & ((1 << data_bits) - 1)) << 1)
}

/// What the host sends.
#[derive(Clone, Copy, Debug)]
enum Symbol {
    Character(u8),
    /// The line is low for so long.
    Break(Ps),
}

/// The wire from the host.
#[derive(Clone, Debug, Default)]
struct Wire {
    /// Still to be sent.
    queue: VecDeque<Symbol>,
    /// When the first of them may start.
    free: Ps,
    /// Under way, and those over that the receiver may still look at.
    frames: VecDeque<Frame>,
    /// From when to when the level is the opposite of what is sent; in order, apart from each other.
    disturbed: VecDeque<(Ps, Ps)>,
}

impl Wire {
    fn level(&self, t: Ps) -> bool {
        let sent = self.frames.iter().find(|frame| frame.covers(t)).is_none_or(|f| f.level(t));
        sent != self.disturbed.iter().any(|&(from, to)| (from..to).contains(&t))
    }

    /// The first time from `from` on at which the level falls, as far as it is known.
    fn fall(&self, from: Ps) -> Option<Ps> {
        let bits = self
            .frames
            .iter()
            .flat_map(|frame| (0..=frame.bits).map(|n| frame.start + n * frame.bit));
        let edges = self.disturbed.iter().flat_map(|&(from, to)| [from, to]);
        let falls = |t: &Ps| *t > 0 && self.level(*t - 1) && !self.level(*t);
        bits.chain(edges).filter(|&t| t >= from).filter(falls).min()
    }

    /// When it is high again after `t`.
    fn rise(&self, t: Ps) -> Ps {
        let low = |frame: &&Frame| frame.covers(t) && !frame.level(t);
        self.frames.iter().find(low).map_or(t, Frame::end)
    }

    /// The next symbol starts.
    fn begin(&mut self, bit: Ps, parity: Option<Parity>) {
        let start = self.free;
        let frame = match self.queue.pop_front() {
            None => return,
            Some(Symbol::Break(time)) => Frame { start, bit: time, bits: 1, levels: 0 },
            Some(Symbol::Character(byte)) => {
                let data = u16::from(byte);
                let (data, data_bits) =
                    parity.map_or((data, 8), |parity| (parity.bit(data) << 8 | data, 9));
                Frame { start, bit, bits: data_bits + 2, levels: framed(data, data_bits) }
            }
        };
        // After a break the line is high for a bit, or no start bit could be told.
        let gap = if frame.bits == 1 { bit } else { 0 };
        self.free = frame.end() + gap;
        self.frames.push_back(frame);
    }

    /// Forget what lies before `t`.
    fn forget(&mut self, t: Ps) {
        while self.frames.front().is_some_and(|frame| frame.end() < t) {
            self.frames.pop_front();
        }
        while self.disturbed.front().is_some_and(|&(_, to)| to < t) {
            self.disturbed.pop_front();
        }
    }
}

/// What a UART that takes frames of `bits` bits of `bit` for its own makes of one that starts with
/// `frame`, and whether it finds the stop bit.
fn resample(frame: &Frame, bit: Ps, bits: u64) -> (u16, bool) {
    let sample = |n: u64| {
        let t = frame.start + (2 * n + 1) * bit / 2;
        !frame.covers(t) || frame.level(t)
    };
    let data = (1..bits - 1).fold(0, |data, n| data | u16::from(sample(n)) << (n - 1));
    (data, sample(bits - 1))
}

fn bit_of(baud: u32) -> Ps {
    SECOND / u64::from(baud.max(1))
}

/// A frame that the receiver takes.
#[derive(Clone, Copy, Debug)]
struct Reception {
    start: Ps,
    /// A sixteenth of a bit.
    rt: Ps,
    noise: bool,
}

/// The SCI with both directions of its line.
#[derive(Clone, Debug)]
pub(crate) struct Sci {
    pub sccr0: u16,
    pub sccr1: u16,
    status: u16,
    /// Flags that were set when SCSR was last read: only those can be cleared by touching SCDR.
    seen: u16,
    tdr: u16,
    /// What is sent, without a character while the transmitter starts.
    shifter: Option<u16>,
    tx_end: u64,
    rdr: u16,
    reception: Option<Reception>,
    rx_end: u64,
    idle_at: u64,
    /// From when on the receiver looks for a start bit, and the first fall of the line since.
    look_from: Ps,
    fall: Option<Ps>,
    wire: Wire,
    /// The host's bit; None: it follows the SCI's own.
    host_bit: Option<Ps>,
    host_parity: Option<Parity>,
    to_host: Vec<(Ps, u8)>,
    /// Characters that arrived with a wrong stop bit or parity at the host.
    pub host_framing_errors: u64,
}

impl Sci {
    pub fn new(host_baud: Option<u32>) -> Self {
        Self {
            sccr0: 0x0004,
            sccr1: 0,
            status: sr::TDRE | sr::TC,
            seen: 0,
            tdr: 0,
            shifter: None,
            tx_end: NEVER,
            rdr: 0,
            reception: None,
            rx_end: NEVER,
            idle_at: NEVER,
            look_from: 0,
            fall: None,
            wire: Wire::default(),
            host_bit: host_baud.map(bit_of),
            host_parity: None,
            to_host: Vec::new(),
            host_framing_errors: 0,
        }
    }

    /// Chip reset. What is on the wire from the host goes on.
    pub fn reset(&mut self) {
        *self = Self {
            wire: std::mem::take(&mut self.wire),
            to_host: std::mem::take(&mut self.to_host),
            host_bit: self.host_bit,
            host_parity: self.host_parity,
            host_framing_errors: self.host_framing_errors,
            ..Self::new(None)
        };
    }

    fn bit_clocks(&self) -> u64 {
        32 * u64::from(self.sccr0 & 0x1FFF)
    }

    fn frame_bits(&self) -> u64 {
        if self.sccr1 & cr1::M != 0 { 11 } else { 10 }
    }

    fn parity(&self) -> Option<Parity> {
        let kind = if self.sccr1 & cr1::PT != 0 { Parity::Odd } else { Parity::Even };
        (self.sccr1 & cr1::PE != 0).then_some(kind)
    }

    fn listens(&self) -> bool {
        self.sccr1 & cr1::RE != 0 && self.bit_clocks() != 0
    }

    pub fn set_host_baud(&mut self, baud: Option<u32>) {
        self.host_bit = baud.map(bit_of);
    }

    pub fn set_host_parity(&mut self, parity: Option<Parity>) {
        self.host_parity = parity;
    }

    fn own_bit(&self, time: &Timebase) -> Ps {
        (self.bit_clocks() * SECOND / time.hz()).max(1)
    }

    fn host_bit(&self, time: &Timebase) -> Ps {
        self.host_bit.unwrap_or_else(|| self.own_bit(time))
    }

    pub fn send(&mut self, now: Ps, bytes: &[u8]) {
        self.queue(now, bytes.iter().map(|&byte| Symbol::Character(byte)));
    }

    pub fn send_break(&mut self, now: Ps, time: Ps) {
        self.queue(now, [Symbol::Break(time.max(1))]);
    }

    fn queue(&mut self, now: Ps, symbols: impl IntoIterator<Item = Symbol>) {
        if self.wire.queue.is_empty() {
            self.wire.free = self.wire.free.max(now);
        }
        self.wire.queue.extend(symbols);
    }

    /// Invert the level of the wire from the host for a while; not before one that is set already.
    pub fn disturb(&mut self, now: Ps, from: Ps, time: Ps) {
        let last = self.wire.disturbed.back().map_or(0, |&(_, to)| to);
        let from = from.max(now).max(last);
        self.wire.disturbed.push_back((from, from + time));
        self.look();
    }

    /// Characters that have not been sent completely.
    pub fn waiting(&self, now: Ps) -> usize {
        self.wire.queue.len() + self.wire.frames.iter().filter(|frame| frame.end() > now).count()
    }

    pub fn take(&mut self) -> Vec<(Ps, u8)> {
        std::mem::take(&mut self.to_host)
    }

    pub fn next_event(&self, time: &Timebase) -> u64 {
        let start = if self.wire.queue.is_empty() { None } else { Some(self.wire.free) };
        let line = [start, self.start_due(time)].into_iter().flatten().min();
        let line = line.map_or(NEVER, |due| time.clk_at_or_after(due));
        self.tx_end.min(self.rx_end).min(self.idle_at).min(line)
    }

    /// When the receiver knows whether the next fall of the line is a start bit.
    fn start_due(&self, time: &Timebase) -> Option<Ps> {
        Some(self.fall? + START_SAMPLES[2] * self.own_bit(time) / 16)
    }

    pub fn run_to(&mut self, clk: u64, time: &Timebase) {
        if self.tx_end <= clk {
            self.end_of_sent_frame(time);
        }
        if self.rx_end <= clk {
            self.end_of_received_frame(time);
        }
        while !self.wire.queue.is_empty() && time.clk_at_or_after(self.wire.free) <= clk {
            self.wire.begin(self.host_bit(time), self.host_parity);
            self.look();
        }
        if self.start_due(time).is_some_and(|due| time.clk_at_or_after(due) <= clk) {
            self.start_bit(time);
        }
        if self.idle_at <= clk {
            self.idle_at = NEVER;
            self.status |= sr::IDLE;
        }
    }

    /// Find the next fall of the line, if somebody wants it.
    fn look(&mut self) {
        let looks = self.listens() && self.reception.is_none();
        self.fall = if looks { self.wire.fall(self.look_from) } else { None };
        if !self.listens() {
            let last = self.wire.frames.back().map_or(0, |frame| frame.start);
            self.wire.forget(last);
        }
    }

    fn end_of_sent_frame(&mut self, time: &Timebase) {
        let end = self.tx_end;
        if let Some(levels) = self.shifter.take() {
            let bits = self.frame_bits();
            let frame = Frame { start: 0, bit: self.own_bit(time), bits, levels };
            let host_bits = if self.host_parity.is_some() { 11 } else { 10 };
            let (data, stop) = resample(&frame, self.host_bit(time), host_bits);
            let good = self.host_parity.is_none_or(|parity| data >> 8 == parity.bit(data & 0xFF));
            if stop && good {
                self.to_host.push((time.ps(end), data as u8));
            } else {
                self.host_framing_errors += 1;
            }
        }
        self.tx_end = NEVER;
        if self.sccr1 & cr1::SBK != 0 && self.sccr1 & cr1::TE != 0 {
            self.start_frame(end, 0);
        } else if self.status & sr::TDRE == 0 && self.sccr1 & cr1::TE != 0 {
            self.start_character(end);
        } else {
            self.status |= sr::TC;
        }
    }

    fn start_character(&mut self, clk: u64) {
        let data_bits = self.frame_bits() - 2;
        let top = 1 << (data_bits - 1);
        let data = match self.parity() {
            None => self.tdr,
            Some(parity) => (self.tdr & (top - 1)) | (parity.bit(self.tdr & (top - 1)) * top),
        };
        if self.start_frame(clk, framed(data, data_bits)) {
            self.status |= sr::TDRE;
        }
    }

    fn start_frame(&mut self, clk: u64, levels: u16) -> bool {
        if self.bit_clocks() == 0 {
            return false; // SCBR = 0 stops the baud generator
        }
        self.shifter = Some(levels);
        self.status &= !sr::TC;
        self.tx_end = clk + self.frame_bits() * self.bit_clocks();
        true
    }

    /// Is the fall of the line a start bit, or nothing?
    fn start_bit(&mut self, time: &Timebase) {
        let Some(start) = self.fall.take() else { return };
        let rt = (self.own_bit(time) / 16).max(1);
        let high = START_SAMPLES.iter().filter(|&&n| self.wire.level(start + n * rt)).count();
        if high >= 2 {
            self.look_from = start + START_SAMPLES[2] * rt;
            self.look();
            return;
        }
        self.reception = Some(Reception { start, rt, noise: high > 0 });
        self.status |= sr::RAF;
        self.idle_at = NEVER;
        let sixteenths = 16 * (self.frame_bits() - 1) + BIT_SAMPLES[2];
        self.rx_end = time.clk_at_or_after(start) + sixteenths * self.bit_clocks() / 16;
        self.wire.forget(start);
    }

    /// The levels of a frame, start bit first, and whether samples of a bit disagreed.
    fn sampled(&self, reception: &Reception, bits: u64) -> (u16, bool) {
        let Reception { start, rt, noise } = *reception;
        (0..bits).fold((0, noise), |(levels, noise), n| {
            let high = |&&k: &&u64| self.wire.level(start + (16 * n + k) * rt);
            let votes = BIT_SAMPLES.iter().filter(high).count();
            (levels | (u16::from(votes >= 2) << n), noise || votes % 3 != 0)
        })
    }

    fn end_of_received_frame(&mut self, time: &Timebase) {
        let end = self.rx_end;
        self.rx_end = NEVER;
        self.status &= !sr::RAF;
        let Some(reception) = self.reception.take() else { return };
        self.look_from = time.ps(end);
        if !self.listens() {
            self.look();
            return;
        }
        let high = self.wire.rise(self.look_from);
        self.idle_at = time.clk_at_or_after(high) + self.frame_bits() * self.bit_clocks();
        let bits = self.frame_bits();
        let (levels, noise) = self.sampled(&reception, bits);
        self.wire.forget(self.look_from);
        self.look();
        self.take_frame(levels, noise, bits);
    }

    fn take_frame(&mut self, levels: u16, noise: bool, bits: u64) {
        if self.status & sr::RDRF != 0 {
            self.status |= sr::OR;
            return;
        }
        let data = (levels >> 1) & ((1 << (bits - 2)) - 1);
        let wrong_parity = self.parity().is_some_and(|parity| {
            let top = bits - 3;
            data >> top != parity.bit(data & ((1 << top) - 1))
        });
        self.rdr = data;
        self.status |= sr::RDRF;
        let errors =
            [(levels >> (bits - 1) & 1 == 0, sr::FE), (noise, sr::NF), (wrong_parity, sr::PF)];
        self.status |= errors.iter().filter(|error| error.0).fold(0, |flags, e| flags | e.1);
    }

    pub fn interrupt(&self) -> bool {
        let (s, c) = (self.status, self.sccr1);
        s & sr::TDRE != 0 && c & cr1::TIE != 0
            || s & sr::TC != 0 && c & cr1::TCIE != 0
            || s & (sr::RDRF | sr::OR) != 0 && c & cr1::RIE != 0
            || s & sr::IDLE != 0 && c & cr1::ILIE != 0
    }

    pub fn read_status(&mut self) -> u16 {
        self.seen = self.status;
        self.status
    }

    pub fn read_data(&mut self) -> u16 {
        self.status &= !(self.seen & sr::RECEIVER);
        self.seen &= !sr::RECEIVER;
        self.rdr
    }

    /// Returns what is wrong with the access, if anything.
    pub fn write_data(&mut self, clk: u64, value: u16) -> Option<&'static str> {
        self.tdr = value & 0x1FF;
        if self.status & sr::TDRE != 0 && self.seen & sr::TDRE == 0 {
            return Some("SCDR written without having read TDRE as 1 in SCSR: nothing is sent");
        }
        self.status &= !(self.seen & (sr::TDRE | sr::TC));
        self.seen &= !(sr::TDRE | sr::TC);
        if self.tx_end == NEVER && self.sccr1 & cr1::TE != 0 {
            self.start_character(clk);
        }
        None
    }

    /// Returns what is wrong with the access, if anything.
    pub fn write_control(&mut self, clk: u64, now: Ps, value: u16) -> Option<&'static str> {
        let rising = value & !self.sccr1;
        self.sccr1 = value & 0x7FFF;
        if rising & cr1::TE != 0 && self.tx_end == NEVER {
            // The transmitter starts with an idle character.
            self.tx_end = clk + self.frame_bits() * self.bit_clocks();
            self.status &= !sr::TC;
        } else if rising & cr1::SBK != 0 && self.tx_end == NEVER && value & cr1::TE != 0 {
            self.start_frame(clk, 0);
        }
        if rising & cr1::RE != 0 {
            self.look_from = now;
            self.look();
        }
        (value & cr1::NOT_MODELLED != 0).then_some("SCCR1 mode that is not modelled")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(character: u8, bit: Ps) -> Frame {
        Frame { start: 0, bit, bits: 10, levels: framed(u16::from(character), 8) }
    }

    #[test]
    fn equal_rates_give_the_character_sent() {
        for character in 0..=255 {
            for bit in [960, 1000, 1040] {
                let data = u16::from(character);
                assert_eq!(resample(&frame(character, 1000), bit, 10), (data, true));
            }
        }
    }

    #[test]
    fn half_the_rate_is_a_framing_error_or_another_character() {
        let (data, stop) = resample(&frame(0x55, 2000), 1000, 10);
        assert!(data != 0x55 || !stop);
        assert!(!resample(&frame(0x00, 2000), 1000, 10).1);
    }

    #[test]
    fn a_wire_falls_at_start_bits_and_disturbances() {
        let mut wire = Wire::default();
        wire.queue.extend([Symbol::Character(0xF0), Symbol::Break(300), Symbol::Character(0xFF)]);
        wire.free = 1000;
        for _ in 0..3 {
            wire.begin(10, None);
        }
        assert_eq!([0, 1001, 1100, 1101].map(|t| wire.fall(t)), [1000, 1100, 1100, 1410].map(Some));
        assert_eq!(wire.rise(1200), 1400);
        assert_eq!(wire.fall(1411), None);
        wire.disturbed.push_back((2000, 2005));
        assert_eq!(wire.fall(1411), Some(2000));
        assert!(!wire.level(2004) && wire.level(2005));
    }
}
