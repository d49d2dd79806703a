//! The border between the base and what is stacked on top of it.

use sim::Ps;

/// The turret bus: QSPI transfers and attention lines. Times never go back from call to call.
pub trait TurretBus {
    /// The chip selects `PCS[3:0]` changed (active low, 0xF = nobody selected).
    fn select(&mut self, now: Ps, pcs: u8);

    /// One queue entry of `bits` (8..=16) bits, right-aligned, out and in at the same time.
    /// Nobody answering reads as all ones.
    fn exchange(&mut self, now: Ps, word: u16, bits: u8) -> u16;

    /// Level of the interrupt lines IRQ7..IRQ1 (bit n = IRQn, active low, pulled up) at `now`.
    fn irq_pins(&mut self, now: Ps) -> u8;
}

/// Nothing on the turret bus.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unconnected;

impl TurretBus for Unconnected {
    fn select(&mut self, _now: Ps, _pcs: u8) {}

    fn exchange(&mut self, _now: Ps, _word: u16, bits: u8) -> u16 {
        (0xFFFF_u32 >> (16 - bits.clamp(1, 16))) as u16
    }

    fn irq_pins(&mut self, _now: Ps) -> u8 {
        0xFF
    }
}
