//! System clocks and picoseconds.

use sim::{Ps, SECOND};

/// Maps the chip's system clock, whose frequency firmware may change, to simulated time.
///
/// Clocks are counted since power-on and never jump: a change of frequency only changes how much
/// time the clocks after it take.
#[derive(Clone, Debug)]
pub(crate) struct Timebase {
    hz: u64,
    base_clk: u64,
    base_ps: Ps,
}

impl Timebase {
    /// Clock 0 at time `start`.
    pub fn new(hz: u64, start: Ps) -> Self {
        Self { hz, base_clk: 0, base_ps: start }
    }

    /// Frequency in Hz.
    pub fn hz(&self) -> u64 {
        self.hz
    }

    /// From clock `clk` on, run at `hz`.
    pub fn set_hz(&mut self, clk: u64, hz: u64) {
        self.base_ps = self.ps(clk);
        self.base_clk = clk;
        self.hz = hz;
    }

    /// Time of clock `clk`, which must not lie before the last change of frequency.
    pub fn ps(&self, clk: u64) -> Ps {
        let clocks = u128::from(clk - self.base_clk);
        self.base_ps + (clocks * u128::from(SECOND) / u128::from(self.hz)) as u64
    }

    /// The first clock at or after `t`; times before the last change of frequency give the clock of
    /// that change.
    pub fn clk_at_or_after(&self, t: Ps) -> u64 {
        let span = u128::from(t.saturating_sub(self.base_ps));
        let clocks = (span * u128::from(self.hz)).div_ceil(u128::from(SECOND));
        self.base_clk + clocks as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_and_times_agree_across_a_change_of_frequency() {
        let mut time = Timebase::new(8_388_608, 0);
        time.set_hz(8_388_608, 25_165_824);
        assert_eq!(time.ps(8_388_608), SECOND);
        assert_eq!(time.ps(8_388_608 + 25_165_824), 2 * SECOND);
        for clk in 8_388_608..8_388_700 {
            assert_eq!(time.clk_at_or_after(time.ps(clk)), clk);
            assert_eq!(time.clk_at_or_after(time.ps(clk) + 1), clk + 1);
        }
    }
}
