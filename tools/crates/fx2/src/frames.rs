//! How the bus's time is shared out: frames, and transactions that fit into them.

use crate::Speed;
use serde::{Deserialize, Serialize};
use sim::{MS, Ps, US};

/// Most bulk packets of 512 bytes that fit into a microframe (USB 2.0, table 5-10).
pub const PACKETS_PER_MICROFRAME: u8 = 13;

/// Frames of one speed (USB 2.0, tables 5-9 and 5-10): so many byte times each, and what a bulk
/// transaction takes besides its data.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Shape {
    time: Ps,
    bytes: u64,
    overhead: u64,
}

const MICROFRAME: Shape = Shape { time: 125 * US, bytes: 7500, overhead: 55 };
const FRAME: Shape = Shape { time: MS, bytes: 1500, overhead: 13 };

/// The present frame and what is left of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Frames {
    pub(crate) speed: Speed,
    /// The end of the last reset: frames are counted from here.
    epoch: Ps,
    number: u64,
    /// Byte times and packets with data used in this frame.
    used: u64,
    packets: u8,
    limit: u8,
}

impl Frames {
    pub(crate) fn new() -> Self {
        Self {
            speed: Speed::Full,
            epoch: 0,
            number: 0,
            used: 0,
            packets: 0,
            limit: PACKETS_PER_MICROFRAME,
        }
    }

    /// Lets at most `limit` (1..=13) packets with data into a microframe.
    pub(crate) fn set_limit(&mut self, limit: u8) {
        self.limit = limit.clamp(1, PACKETS_PER_MICROFRAME);
    }

    /// A bus reset ends at `now`.
    pub(crate) fn restart(&mut self, now: Ps, speed: Speed) {
        *self = Self { speed, epoch: now, limit: self.limit, ..Self::new() };
    }

    /// Places a transaction of `length` data bytes (0 for one that gets NAK) at or after `now`; one
    /// that does not fit into the present frame is put off to the next. Returns its end.
    pub(crate) fn place(&mut self, now: Ps, length: usize) -> Ps {
        let (shape, limit) = match self.speed {
            Speed::Full => (FRAME, u8::MAX),
            Speed::High => (MICROFRAME, self.limit),
        };
        let need = length as u64 + shape.overhead;
        let passed = now.saturating_sub(self.epoch);
        let present = passed / shape.time;
        if present > self.number {
            (self.number, self.used, self.packets) = (present, 0, 0);
        }
        if present == self.number {
            // Bus time that went by unused is gone.
            let gone = passed % shape.time * shape.bytes / shape.time;
            self.used = self.used.max(gone);
        }
        if self.used + need > shape.bytes || length > 0 && self.packets >= limit {
            (self.number, self.used, self.packets) = (self.number + 1, 0, 0);
        }
        self.used += need;
        self.packets += u8::from(length > 0);
        self.epoch + self.number * shape.time + self.used * shape.time / shape.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirteen_packets_fit_and_the_fourteenth_waits() {
        let mut frames = Frames::new();
        frames.restart(MS, Speed::High);
        let mut now = MS;
        for _ in 0..13 {
            now = frames.place(now, 512);
        }
        assert!(now < MS + 125 * US);
        let next = frames.place(now, 512);
        assert!(next > MS + 125 * US && next < MS + 135 * US);
    }

    #[test]
    fn time_that_went_by_is_not_used_again() {
        let mut frames = Frames::new();
        frames.restart(0, Speed::High);
        let end = frames.place(120 * US, 512);
        assert!(end > 125 * US, "9.5 us do not fit into the last 5");
    }

    #[test]
    fn nineteen_full_speed_packets_fit_into_a_frame() {
        let mut frames = Frames::new();
        frames.restart(0, Speed::Full);
        let mut now = 0;
        let mut count = 0;
        while now < MS {
            now = frames.place(now, 64);
            count += u32::from(now <= MS);
        }
        assert_eq!(count, 19);
    }
}
