//! Time, seeds and trace: what every device of the twin shares.
//!
//! The twin is one deterministic, single-threaded event loop. No device looks at a wall clock, and
//! each draws its random numbers from a generator of its own, so that adding a device never changes
//! what another one does.

pub mod hex;

use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Simulated time in picoseconds since power-on. A `u64` lasts 213 days.
pub type Ps = u64;

/// Picoseconds in a nanosecond, microsecond, millisecond and second.
pub const NS: Ps = 1_000;
/// See [`NS`].
pub const US: Ps = 1_000_000;
/// See [`NS`].
pub const MS: Ps = 1_000_000_000;
/// See [`NS`].
pub const SECOND: Ps = 1_000_000_000_000;

/// A free-running clock whose edge 0 is at time 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    hz: u64,
}

impl Clock {
    /// A clock of `hz` > 0 edges a second.
    ///
    /// # Panics
    /// If `hz` is 0.
    pub const fn new(hz: u64) -> Self {
        assert!(hz > 0, "a clock needs a frequency");
        Self { hz }
    }

    /// Frequency in Hz.
    pub const fn hz(self) -> u64 {
        self.hz
    }

    /// Time of edge `k`: floor(k * 10^12 / f). Never drifts, whatever the frequency.
    pub const fn edge(self, k: u64) -> Ps {
        (k as u128 * SECOND as u128 / self.hz as u128) as Ps
    }

    /// The first edge at or after `t`.
    pub const fn edge_at_or_after(self, t: Ps) -> u64 {
        let mut k = (t as u128 * self.hz as u128 / SECOND as u128) as u64;
        while self.edge(k) < t {
            k += 1;
        }
        k
    }
}

/// The random numbers of one device. `match_seed` is what the user gave, `device` the device's name.
pub fn device_rng(match_seed: u64, device: &str) -> Pcg64Mcg {
    let mut hash = TraceHash::default();
    hash.update(&match_seed.to_be_bytes());
    hash.update(device.as_bytes());
    Pcg64Mcg::seed_from_u64(hash.value())
}

/// A running 64-bit FNV-1a hash over everything a run does that can be seen from outside. Two runs
/// with the same hash did the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TraceHash(u64);

impl Default for TraceHash {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl TraceHash {
    /// Take in some bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// The hash so far.
    pub const fn value(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_do_not_drift() {
        let clock = Clock::new(48_000_000);
        assert_eq!(clock.edge(1), 20_833);
        assert_eq!(clock.edge(3), 62_500);
        assert_eq!(clock.edge(48_000_000 * 3600), 3600 * SECOND);
    }

    #[test]
    fn an_edge_is_found_from_its_own_time_and_from_just_before() {
        let clock = Clock::new(30_000_000);
        for k in [0, 1, 2, 3, 29_999_999, 30_000_001] {
            let t = clock.edge(k);
            assert_eq!(clock.edge_at_or_after(t), k);
            assert_eq!(clock.edge_at_or_after(t + 1), k + 1);
        }
    }

    #[test]
    fn trace_hash_is_fnv_1a() {
        let mut hash = TraceHash::default();
        hash.update(b"foobar");
        assert_eq!(hash.value(), 0x8594_4171_f739_67e8);
    }
}
