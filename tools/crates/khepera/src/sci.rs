//! SCI: the serial communication interface of the QSM (QSMRM section 5).
//!
//! Times are exact: one bit lasts 32 * SCBR system clocks. The other end of the line has its own
//! baud rate, and both ends sample in the middle of what they take for a bit, so a wrong rate gives
//! wrong characters and framing errors as it would on a wire. Parity, break, wake-up and loop mode
//! are not modelled.

use std::collections::VecDeque;

use sim::{Ps, SECOND};

use crate::timebase::Timebase;

const NEVER: u64 = u64::MAX;

/// SCCR1.
mod cr1 {
    pub const M: u16 = 1 << 9;
    pub const TIE: u16 = 1 << 7;
    pub const TCIE: u16 = 1 << 6;
    pub const RIE: u16 = 1 << 5;
    pub const ILIE: u16 = 1 << 4;
    pub const TE: u16 = 1 << 3;
    pub const RE: u16 = 1 << 2;
    /// LOOPS, ILT, PT, PE, WAKE, RWU and SBK: not modelled.
    pub const NOT_MODELLED: u16 = 1 << 14 | 1 << 12 | 1 << 11 | 1 << 10 | 1 << 8 | 1 << 1 | 1;
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
    pub const RECEIVER: u16 = RDRF | IDLE | OR | NF | FE;
}

/// The bits on a wire while one character passes: start, 8 data bits, stop; idle before and after.
fn level(character: u8, bit: u64) -> bool {
    match bit {
        0 => false,
        1..=8 => character >> (bit - 1) & 1 != 0,
        _ => true,
    }
}

/// What a UART with bits of `own_ps` makes of a character sent in bits of `sent_ps`, and whether it
/// finds the stop bit. `next` is the character that follows at once, if any.
fn resample(character: u8, sent_ps: Ps, own_ps: Ps, next: Option<u8>) -> (u8, bool) {
    let sample = |bit: u64| {
        let position = (2 * bit + 1) * own_ps / (2 * sent_ps);
        match (position, next) {
            (10.., Some(next)) => level(next, position - 10),
            _ => level(character, position),
        }
    };
    let data = (1..=8).fold(0, |byte, bit| byte | u8::from(sample(bit)) << (bit - 1));
    (data, sample(9))
}

fn bit_of(baud: u32) -> Ps {
    SECOND / u64::from(baud.max(1))
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
    shifter: Option<u16>,
    tx_end: u64,
    rdr: u16,
    rx_end: u64,
    idle_at: u64,
    /// Characters that the host has still to send, the first one possibly on the wire.
    from_host: VecDeque<u8>,
    /// When the first of them starts or started.
    host_start: Ps,
    /// The host's bit; None: it follows the SCI's own.
    host_bit: Option<Ps>,
    to_host: Vec<(Ps, u8)>,
    /// Characters that arrived with a wrong stop bit at the host.
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
            rx_end: NEVER,
            idle_at: NEVER,
            from_host: VecDeque::new(),
            host_start: 0,
            host_bit: host_baud.map(bit_of),
            to_host: Vec::new(),
            host_framing_errors: 0,
        }
    }

    /// Chip reset. What is on the wire from the host goes on.
    pub fn reset(&mut self) {
        let host = std::mem::take(&mut self.from_host);
        let sent = std::mem::take(&mut self.to_host);
        *self = Self {
            from_host: host,
            to_host: sent,
            host_start: self.host_start,
            host_bit: self.host_bit,
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

    pub fn set_host_baud(&mut self, baud: Option<u32>) {
        self.host_bit = baud.map(bit_of);
    }

    fn own_bit(&self, time: &Timebase) -> Ps {
        (self.bit_clocks() * SECOND / time.hz()).max(1)
    }

    fn host_bit(&self, time: &Timebase) -> Ps {
        self.host_bit.unwrap_or_else(|| self.own_bit(time))
    }

    pub fn send(&mut self, now: Ps, bytes: &[u8]) {
        if self.from_host.is_empty() {
            self.host_start = self.host_start.max(now);
        }
        self.from_host.extend(bytes);
    }

    pub fn waiting(&self) -> usize {
        self.from_host.len()
    }

    pub fn take(&mut self) -> Vec<(Ps, u8)> {
        std::mem::take(&mut self.to_host)
    }

    pub fn next_event(&self, time: &Timebase) -> u64 {
        let start = if self.rx_end == NEVER && !self.from_host.is_empty() {
            time.clk_at_or_after(self.host_start)
        } else {
            NEVER
        };
        self.tx_end.min(self.rx_end).min(self.idle_at).min(start)
    }

    pub fn run_to(&mut self, clk: u64, time: &Timebase) {
        if self.tx_end <= clk {
            self.end_of_sent_frame(time);
        }
        if self.rx_end <= clk {
            self.end_of_received_frame(time);
        }
        if self.rx_end == NEVER && !self.from_host.is_empty() {
            let start = time.clk_at_or_after(self.host_start);
            if start <= clk {
                self.start_bit(start, time);
            }
        }
        if self.idle_at <= clk {
            self.idle_at = NEVER;
            self.status |= sr::IDLE;
        }
    }

    fn end_of_sent_frame(&mut self, time: &Timebase) {
        let end = self.tx_end;
        if let Some(character) = self.shifter.take() {
            let (byte, stop) =
                resample(character as u8, self.own_bit(time), self.host_bit(time), None);
            if stop {
                self.to_host.push((time.ps(end), byte));
            } else {
                self.host_framing_errors += 1;
            }
        }
        self.tx_end = NEVER;
        if self.status & sr::TDRE == 0 && self.sccr1 & cr1::TE != 0 {
            self.start_frame(end);
        } else {
            self.status |= sr::TC;
        }
    }

    fn start_frame(&mut self, clk: u64) {
        if self.bit_clocks() == 0 {
            return; // SCBR = 0 stops the baud generator
        }
        self.shifter = Some(self.tdr);
        self.status |= sr::TDRE;
        self.status &= !sr::TC;
        self.tx_end = clk + self.frame_bits() * self.bit_clocks();
    }

    fn start_bit(&mut self, clk: u64, time: &Timebase) {
        if self.sccr1 & cr1::RE == 0 || self.bit_clocks() == 0 {
            self.next_from_host(time); // nobody listens
            return;
        }
        self.status |= sr::RAF;
        self.idle_at = NEVER;
        // The receiver is done in the middle of the stop bit.
        self.rx_end = clk + (2 * self.frame_bits() - 1) * self.bit_clocks() / 2;
    }

    fn next_from_host(&mut self, time: &Timebase) {
        self.from_host.pop_front();
        self.host_start += 10 * self.host_bit(time);
    }

    fn end_of_received_frame(&mut self, time: &Timebase) {
        let end = self.rx_end;
        self.rx_end = NEVER;
        self.status &= !sr::RAF;
        self.idle_at = end + self.frame_bits() * self.bit_clocks();
        let Some(&sent) = self.from_host.front() else { return };
        let next = self.from_host.get(1).copied();
        let (byte, stop) = resample(sent, self.host_bit(time), self.own_bit(time), next);
        self.next_from_host(time);
        if self.sccr1 & cr1::RE == 0 {
            return;
        }
        if self.status & sr::RDRF != 0 {
            self.status |= sr::OR;
            return;
        }
        self.rdr = u16::from(byte);
        self.status |= sr::RDRF | if stop { 0 } else { sr::FE };
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
            self.start_frame(clk);
        }
        None
    }

    /// Returns what is wrong with the access, if anything.
    pub fn write_control(&mut self, clk: u64, value: u16) -> Option<&'static str> {
        let rising = value & !self.sccr1;
        self.sccr1 = value & 0x7FFF;
        if rising & cr1::TE != 0 && self.tx_end == NEVER {
            // The transmitter starts with an idle character.
            self.tx_end = clk + self.frame_bits() * self.bit_clocks();
            self.status &= !sr::TC;
        }
        (value & cr1::NOT_MODELLED != 0).then_some("SCCR1 mode that is not modelled")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_rates_give_the_character_sent() {
        for character in 0..=255 {
            assert_eq!(resample(character, 1000, 1000, Some(0)), (character, true));
            assert_eq!(resample(character, 1000, 1040, None), (character, true));
            assert_eq!(resample(character, 1000, 960, Some(0)), (character, true));
        }
    }

    #[test]
    fn half_the_rate_is_a_framing_error_or_another_character() {
        let (byte, stop) = resample(0x55, 2000, 1000, None);
        assert!(byte != 0x55 || !stop);
        assert!(!resample(0x00, 2000, 1000, None).1);
    }
}
