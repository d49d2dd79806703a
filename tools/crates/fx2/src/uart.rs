//! A serial port of the 8051 (TRM appendix C.3). Its pins are its own, so bytes are handed over whole.

use crate::time::{NEVER, Tick};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

const RI: u8 = 0x01;
const TI: u8 = 0x02;
const RB8: u8 = 0x04;
const REN: u8 = 0x10;
const SM2: u8 = 0x20;

/// One port.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Uart {
    pub(crate) scon: u8,
    received: u8,
    sending: Option<(Tick, u8)>,
    /// Bytes that wait at RXD, and when the next one is in.
    incoming: VecDeque<u8>,
    next_in: Option<Tick>,
    sent: Vec<u8>,
}

impl Uart {
    /// 0..=3: SM0 and SM1.
    pub(crate) fn mode(&self) -> u8 {
        self.scon >> 6
    }

    /// Bits of a frame with start and stop.
    pub(crate) fn frame_bits(&self) -> Tick {
        match self.mode() {
            0 => 8,
            1 => 10,
            _ => 11,
        }
    }

    /// The 8051 is reset. What waits at RXD, or went out before, is not the port's.
    pub(crate) fn reset(&mut self) {
        let (incoming, sent) = (std::mem::take(&mut self.incoming), std::mem::take(&mut self.sent));
        *self = Self { incoming, sent, ..Self::default() };
    }

    /// Whether it requests its interrupt.
    pub(crate) fn requests(&self) -> bool {
        self.scon & (RI | TI) != 0
    }

    /// SBUF is written: the byte is out after `frame` ticks. A byte written too early replaces the
    /// one that is being sent.
    pub(crate) fn send(&mut self, now: Tick, byte: u8, frame: Option<Tick>) {
        self.sending = frame.map(|frame| (now + frame, byte));
    }

    pub(crate) fn read_sbuf(&self) -> u8 {
        self.received
    }

    /// A byte arrives from outside.
    pub(crate) fn push(&mut self, byte: u8) {
        self.incoming.push_back(byte);
    }

    /// The bytes sent since the last call.
    pub(crate) fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.sent)
    }

    pub(crate) fn next_event(&self) -> Tick {
        let out = self.sending.map_or(NEVER, |(due, _)| due);
        out.min(self.next_in.unwrap_or(NEVER))
    }

    /// Whether [`Self::service`] has something to do.
    pub(crate) fn is_due(&self, now: Tick) -> bool {
        self.next_event() <= now || self.next_in.is_none() && !self.incoming.is_empty()
    }

    /// Does what is due at `now`. `frame` is the length of a received frame in ticks.
    pub(crate) fn service(&mut self, now: Tick, frame: Option<Tick>) {
        if let Some((_, byte)) = self.sending.take_if(|(due, _)| *due <= now) {
            self.sent.push(byte);
            self.scon |= TI;
        }
        if self.next_in.take_if(|due| *due <= now).is_some()
            && let Some(byte) = self.incoming.pop_front()
        {
            self.receive(byte);
        }
        if self.next_in.is_none() && self.scon & REN != 0 && !self.incoming.is_empty() {
            self.next_in = frame.map(|frame| now + frame);
        }
    }

    /// A frame is complete. It is lost if the last one was not taken, or (with SM2) has no ninth bit.
    fn receive(&mut self, byte: u8) {
        let ninth = self.mode() != 0;
        if self.scon & (RI | REN) == REN && (self.scon & SM2 == 0 || ninth) {
            self.received = byte;
            self.scon = self.scon & !RB8 | RI | if ninth { RB8 } else { 0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_takes_its_frame_and_sets_ti() {
        let mut uart = Uart { scon: 0x40, ..Uart::default() };
        uart.send(100, b'x', Some(5000));
        assert_eq!(uart.next_event(), 5100);
        uart.service(5099, None);
        assert!(!uart.requests());
        uart.service(5100, None);
        assert!(uart.requests());
        assert_eq!(uart.take_sent(), b"x");
    }

    #[test]
    fn bytes_arrive_one_frame_apart_and_an_unread_one_is_kept() {
        let mut uart = Uart { scon: 0x50, ..Uart::default() };
        uart.push(1);
        uart.push(2);
        uart.service(0, Some(1000));
        assert_eq!(uart.next_event(), 1000);
        uart.service(1000, Some(1000));
        assert_eq!((uart.read_sbuf(), uart.requests()), (1, true));
        uart.service(2000, Some(1000));
        assert_eq!(uart.read_sbuf(), 1, "RI was not cleared: the second byte is lost");
    }
}
