//! The chip's own clock: 48 MHz ticks, and the interface clock derived from it.

use serde::{Deserialize, Serialize};
use sim::Ps;

/// A count of 48 MHz ticks since power-on. All internal events fall on ticks.
pub(crate) type Tick = u64;

/// No event.
pub(crate) const NEVER: Tick = u64::MAX;

/// Time of a tick: floor(tick * 10^12 / 48 MHz). Good for 71 days.
pub(crate) const fn tick_to_ps(tick: Tick) -> Ps {
    tick * 62_500 / 3
}

/// The first tick at or after `t`.
pub(crate) const fn tick_at_or_after(t: Ps) -> Tick {
    // floor(tick * 62500 / 3) >= t  <=>  tick * 62500 >= 3 t.
    (t * 3).div_ceil(62_500)
}

/// The interface clock (IFCONFIG bits 7 and 6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum IfClock {
    /// Internal, 30 MHz.
    Internal30,
    /// Internal, 48 MHz.
    Internal48,
    /// From the IFCLK pin, which nothing drives here.
    External,
}

impl IfClock {
    pub(crate) fn from_ifconfig(ifconfig: u8) -> Self {
        match ifconfig & 0xC0 {
            0xC0 => Self::Internal48,
            0x80 => Self::Internal30,
            _ => Self::External,
        }
    }

    /// Time of edge `k`: floor(k * 10^12 / f).
    pub(crate) fn edge(self, k: u64) -> Ps {
        match self {
            Self::Internal30 => k * 100_000 / 3,
            _ => k * 62_500 / 3,
        }
    }

    /// The first edge at or after `t`.
    pub(crate) fn edge_at_or_after(self, t: Ps) -> u64 {
        match self {
            Self::Internal30 => (t * 3).div_ceil(100_000),
            _ => (t * 3).div_ceil(62_500),
        }
    }

    /// Its period in picoseconds, rounded up.
    pub(crate) fn period(self) -> Ps {
        match self {
            Self::Internal30 => 33_334,
            _ => 20_834,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_those_of_the_shared_clock() {
        for (ours, hz) in [(IfClock::Internal30, 30_000_000), (IfClock::Internal48, 48_000_000)] {
            let clock = sim::Clock::new(hz);
            for k in [0, 1, 2, 3, 47_999_999, 123_456_789_012] {
                assert_eq!(ours.edge(k), clock.edge(k));
                assert_eq!(ours.edge_at_or_after(clock.edge(k)), k);
                assert_eq!(ours.edge_at_or_after(clock.edge(k) + 1), k + 1);
            }
        }
    }

    #[test]
    fn ticks_round_up_to_the_next_edge() {
        for k in [0, 1, 2, 3, 48_000_001] {
            assert_eq!(tick_at_or_after(tick_to_ps(k)), k);
            assert_eq!(tick_at_or_after(tick_to_ps(k) + 1), k + 1);
        }
    }
}
