//! A battery that empties, beside the base: whoever wants one steps it along.
//!
//! Four nickel cells in series, as Kheperas had (that they are four, and of 180 mAh, follows from the 4.8 V
//! that the motors' figures hold at, and from about three quarters of an hour of driving that K-Team
//! states). What they give, cell by cell, is the usual curve of a discharge over some hours: flat, with a
//! knee at either end. ASSUMPTIONS, like the figures below.

use sim::{Ps, SECOND};

use crate::drive::{FULL_SPEED_MM_S, NOMINAL_MV, STALL_FORCE_N};
use crate::{Base, CpuState, Load};

const CELLS: f64 = 4.0;
/// Charge of a full battery, coulombs.
const CAPACITY_C: f64 = 0.180 * 3600.0;
/// Of all cells, switch and contacts.
const RESISTANCE_OHM: f64 = 0.2;
/// Voltage of a cell without load at these parts of its charge.
const CURVE: [(f64, f64); 7] = [
    (0.0, 0.80),
    (0.03, 1.08),
    (0.10, 1.17),
    (0.25, 1.21),
    (0.60, 1.25),
    (0.90, 1.30),
    (1.0, 1.38),
];
/// What the electronics draw: the 68331 running, and resting in STOP (its data sheet gives 140 mA at
/// most, running at 20.97 MHz and 5.5 V; half of it is taken here); and everything else, turret
/// apart: what makes a robot that drives about last for the stated time.
const CPU_RUNS_A: f64 = 0.070;
const CPU_RESTS_A: f64 = 0.030;
const OTHERS_A: f64 = 0.130;

/// A battery and what it has left.
#[derive(Clone, Debug)]
pub struct Battery {
    charge_c: f64,
    current_a: f64,
    load: Load,
    now: Ps,
}

impl Battery {
    /// One that is charged to this part, 0..=1, and connected to `base` now.
    pub fn connect(base: &mut Base, charge: f64) -> Self {
        let charge_c = charge.clamp(0.0, 1.0) * CAPACITY_C;
        let battery = Self { charge_c, current_a: 0.0, load: base.load(), now: base.now() };
        base.set_battery_mv(battery.millivolt());
        battery
    }

    /// What part of its charge is left.
    pub fn charge(&self) -> f64 {
        self.charge_c / CAPACITY_C
    }

    /// What was drawn in the last step, ampere.
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Its voltage under that load.
    pub fn millivolt(&self) -> u32 {
        let volt = CELLS * cell_volt(self.charge()) - self.current_a * RESISTANCE_OHM;
        (1000.0 * volt.max(0.0)) as u32
    }

    /// Drains what the base has drawn since the last step, and gives it what voltage is left. Steps of a
    /// few milliseconds are short enough.
    pub fn step(&mut self, base: &mut Base) {
        let seconds = base.now().saturating_sub(self.now) as f64 / SECOND as f64;
        self.now = base.now();
        let load = base.load();
        let busy = load.since(&std::mem::replace(&mut self.load, load));
        let electronics = match base.cpu_state() {
            // Held in reset for want of voltage: what leaks is forgotten.
            CpuState::Held => 0.0,
            _ => OTHERS_A + CPU_RESTS_A + busy * (CPU_RUNS_A - CPU_RESTS_A),
        };
        self.current_a = electronics + motors_a(base, self.millivolt());
        self.charge_c = (self.charge_c - self.current_a * seconds).max(0.0);
        base.set_battery_mv(self.millivolt());
    }
}

fn cell_volt(charge: f64) -> f64 {
    let charge = charge.clamp(0.0, 1.0);
    let above =
        CURVE.iter().position(|&(part, _)| part >= charge).unwrap_or(CURVE.len() - 1).max(1);
    let ((low, from), (high, to)) = (CURVE[above - 1], CURVE[above]);
    from + (to - from) * (charge - low) / (high - low)
}

/// What both motors draw: without losses in the gear, the force at the rim of each ampere is the voltage
/// that the motor makes at each m/s. A bridge takes the current from the battery for its duty only.
fn motors_a(base: &Base, millivolt: u32) -> f64 {
    let nominal_v = f64::from(NOMINAL_MV) / 1000.0;
    let volt_per_m_s = nominal_v / (FULL_SPEED_MM_S / 1000.0);
    let winding_ohm = nominal_v * volt_per_m_s / STALL_FORCE_N;
    let currents = base.motors().into_iter().zip(base.wheel_speeds_mm_s()).map(|(motor, mm_s)| {
        let sign = if motor.forward { 1.0 } else { -1.0 };
        let applied = motor.duty * f64::from(millivolt) / 1000.0;
        let current = (applied - sign * mm_s / 1000.0 * volt_per_m_s) / winding_ohm;
        current.max(0.0) * motor.duty
    });
    currents.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_follows_its_curve() {
        for (charge, volt) in CURVE {
            assert!((cell_volt(charge) - volt).abs() < 1e-12);
        }
        assert!((cell_volt(0.75) - 1.275).abs() < 1e-9);
        assert!(CELLS * cell_volt(0.5) * 1000.0 > f64::from(NOMINAL_MV));
    }
}
