//! The analogue-to-digital converter on the QSPI.
//!
//! Which converter the base has is not public. ASSUMPTION (board/khepera.h): one of the kind of TI's
//! TLC1543, 10 bits, 11 inputs. A transfer clocks in the input to convert next, first four bits, and
//! clocks out the result of the conversion before, most significant bit first, then zeros. A
//! conversion takes 21 us after the transfer; a transfer that comes sooner reads the old result.

use common_sys::constants as board;
use sim::{Ps, US};

/// Longest conversion (TLC1543 data sheet).
const CONVERSION: Ps = 21 * US;
const FULL_SCALE: u32 = 1023;
/// Inputs 0..=10 are pins; 11..=13 measure the references: half, low, high.
const INPUTS: usize = 11;
const SENSORS: usize = 8;
/// Ambient light in the dark: brighter is lower (K-Team's command O).
const DARK: u16 = 500;
const SELF_TEST: [u16; 3] = [512, 0, 1023];

/// The converter and what lies at its inputs.
#[derive(Clone, Debug)]
pub(crate) struct Adc {
    inputs: [u16; INPUTS],
    /// What the proximity inputs measure while their emitters are off.
    ambient: [u16; SENSORS],
    result: u16,
    converting: u16,
    ready: Ps,
    silent: bool,
}

impl Adc {
    pub fn new() -> Self {
        Self {
            inputs: [0; INPUTS],
            ambient: [DARK; SENSORS],
            result: 0,
            converting: 0,
            ready: 0,
            silent: false,
        }
    }

    pub fn set_ambient(&mut self, values: [u16; SENSORS]) {
        self.ambient = values.map(|value| value.min(FULL_SCALE as u16));
    }

    pub fn set_proximity(&mut self, values: [u16; SENSORS]) {
        let first = board::BOARD_ADC_PROXIMITY as usize;
        for (input, value) in self.inputs[first..first + SENSORS].iter_mut().zip(values) {
            *input = value.min(FULL_SCALE as u16);
        }
    }

    pub fn set_battery_mv(&mut self, millivolt: u32) {
        let full_scale_mv = board::BOARD_ADC_BATTERY_FULL_SCALE_MV;
        let code = u64::from(millivolt) * u64::from(FULL_SCALE) / u64::from(full_scale_mv);
        self.inputs[board::BOARD_ADC_BATTERY as usize] = code.min(u64::from(FULL_SCALE)) as u16;
    }

    /// A silent converter leaves MISO to its pull-up.
    pub fn set_silent(&mut self, silent: bool) {
        self.silent = silent;
    }

    fn level(&self, input: usize, emitters: bool) -> u16 {
        let sensor = input.wrapping_sub(board::BOARD_ADC_PROXIMITY as usize);
        match (self.ambient.get(sensor), self.inputs.get(input)) {
            (Some(&ambient), _) if !emitters => ambient,
            (_, Some(&value)) => value,
            _ => SELF_TEST.get(input - INPUTS).copied().unwrap_or(0),
        }
    }

    /// One transfer of `bits` bits, right-aligned both ways, with the infrared emitters on or off.
    pub fn exchange(&mut self, now: Ps, word: u16, bits: u8, emitters: bool) -> u16 {
        if self.silent {
            return 0xFFFF;
        }
        if now >= self.ready {
            self.result = self.converting;
            let input = usize::from(word >> (bits - 4) & 0xF);
            self.converting = self.level(input, emitters);
            self.ready = now + CONVERSION;
        }
        let shifted = u32::from(self.result) << 6;
        (shifted >> (16 - bits)) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transfer_reads_the_input_that_the_one_before_asked_for() {
        let mut adc = Adc::new();
        adc.set_proximity([10, 20, 30, 40, 50, 60, 70, 2000]);
        adc.exchange(0, 0x1000, 16, true);
        assert_eq!(adc.exchange(30 * US, 0x7000, 16, true) >> 6, 20);
        assert_eq!(adc.exchange(60 * US, 0xB000, 16, true) >> 6, 1023, "limited to full scale");
        assert_eq!(adc.exchange(90 * US, 0x0000, 16, true) >> 6, 512, "half of the reference");
    }

    #[test]
    fn without_emitters_the_sensors_see_the_ambient_light_only() {
        let mut adc = Adc::new();
        adc.set_proximity([900; 8]);
        adc.set_battery_mv(5000);
        adc.exchange(0, 0x7000, 16, false);
        assert_eq!(adc.exchange(30 * US, 0x8000, 16, false) >> 6, DARK);
        assert_eq!(adc.exchange(60 * US, 0x0000, 16, false) >> 6, 511, "the battery is no sensor");
        adc.set_ambient([40; 8]);
        adc.exchange(90 * US, 0x3000, 16, false);
        assert_eq!(adc.exchange(120 * US, 0, 16, false) >> 6, 40);
    }

    #[test]
    fn a_transfer_during_a_conversion_changes_nothing() {
        let mut adc = Adc::new();
        adc.set_proximity([10, 20, 30, 40, 50, 60, 70, 80]);
        adc.exchange(0, 0x1000, 16, true);
        adc.exchange(10 * US, 0x2000, 16, true);
        assert_eq!(adc.exchange(30 * US, 0, 16, true) >> 6, 20);
    }

    #[test]
    fn a_silent_converter_reads_as_ones() {
        let mut adc = Adc::new();
        adc.set_silent(true);
        assert_eq!(adc.exchange(0, 0, 16, true), 0xFFFF);
    }
}
