//! How far things are from perfect: the noise levels, all their values in this file.
//!
//! Cameras: after the tiers of host-tests/data/scenes. Those scenes state what their renderer's sensor
//! did, and the ranges here enclose what they state; no camera of a real robot has been measured.
//! What they do not state - flicker, eyes that are not quite parallel - is an assumption.
//!
//! Wheels: unequal wheels and an uncertain wheel base are what odometry of such robots suffers from
//! first (Borenstein and Feng's UMBmark); `measured` takes 0.5 % and 1 %, what careful turning and
//! measuring leaves, `harsh` three times and twice that. Slip, drag, battery, floor and infrared: assumptions.
//!
//! What a robot is like is drawn once, from its range, when it is made; flicker, slip and pixel noise
//! are drawn all the time.

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;
use sim::device_rng;

/// How bad things are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Noise {
    /// Perfect.
    #[default]
    None,
    /// As things are: pixel noise of 2 to 3 of 255, eyes that differ a little, wheels that are not
    /// quite equal.
    Measured,
    /// A bad day: pixel noise of 5 to 6, half the light, that warm and uneven, eyes that differ by up
    /// to 10 % and by up to 1.5 rows, a low battery, a floor that is not level.
    Harsh,
}

/// Ranges from which a pair of eyes is drawn.
pub(crate) struct CameraRanges {
    /// Deviation of the noise, of 255.
    pub noise: [f64; 2],
    pub exposure: [f64; 2],
    /// From frame to frame the light of both eyes changes by a deviation of so much: mains light,
    /// automatic exposure.
    pub flicker: f64,
    /// Each eye's gain is off by up to so much, one up and the other down.
    pub unequal: f64,
    /// Red's and blue's gain are off by up to so much in both eyes, and by `balance_apart` in each.
    pub balance: f64,
    pub balance_apart: f64,
    /// Colour of the light.
    pub tint: [f64; 3],
    /// What a corner of the picture loses.
    pub vignette: [f64; 2],
    /// Deviation of the blur.
    pub blur_px: [f64; 2],
    /// The right edge of the picture gets up to so much more or less light than its middle.
    pub uneven: f64,
    /// The left eye is up to so many rows off.
    pub misaligned_px: f64,
    /// ... and turned in or out by up to so many columns: disparities are off by that.
    pub squint_px: f64,
}

/// Ranges from which wheels, battery, floor and infrared sensors are drawn.
pub(crate) struct DriveRanges {
    /// A wheel's radius is off by up to so much: encoders count what does not quite happen.
    pub wheel_radius: f64,
    /// The effective wheel base is off by up to so much.
    pub wheel_base: f64,
    /// Deviation of a wheel's slip over a millisecond, as part of its way.
    pub slip: f64,
    /// Force that a wheel's gear takes, N.
    pub drag_n: [f64; 2],
    /// The battery's voltage, as part of the nominal one.
    pub battery: [f64; 2],
    /// Factor of the tyres' grip: dust.
    pub grip: [f64; 2],
    /// The floor falls by up to so much, mm in a metre.
    pub tilt_mm_m: f64,
    /// A rolling ball's direction wanders by this deviation, radians over a metre: felt and seam.
    pub wander: f64,
    /// An infrared sensor's reading is off by up to this part, and by this deviation of 1023.
    pub infrared_gain: f64,
    pub infrared_noise: f64,
}

const CAMERA_MEASURED: CameraRanges = CameraRanges {
    noise: [2.0, 3.0],
    exposure: [0.85, 1.0],
    flicker: 0.01,
    unequal: 0.02,
    balance: 0.06,
    balance_apart: 0.01,
    tint: [1.0, 1.0, 1.0],
    vignette: [0.10, 0.26],
    blur_px: [0.45, 0.75],
    uneven: 0.03,
    misaligned_px: 0.3,
    squint_px: 0.15,
};

const CAMERA_HARSH: CameraRanges = CameraRanges {
    noise: [5.0, 6.0],
    exposure: [0.45, 0.6],
    flicker: 0.03,
    unequal: 0.05,
    balance: 0.02,
    balance_apart: 0.015,
    tint: [1.0, 0.92, 0.72],
    vignette: [0.10, 0.26],
    blur_px: [0.6, 0.85],
    uneven: 0.15,
    misaligned_px: 1.5,
    squint_px: 0.4,
};

const DRIVE_MEASURED: DriveRanges = DriveRanges {
    wheel_radius: 0.005,
    wheel_base: 0.01,
    slip: 0.02,
    drag_n: [0.0, 0.03],
    battery: [0.95, 1.05],
    grip: [0.9, 1.1],
    tilt_mm_m: 1.0,
    wander: 0.05,
    infrared_gain: 0.10,
    infrared_noise: 5.0,
};

const DRIVE_HARSH: DriveRanges = DriveRanges {
    wheel_radius: 0.015,
    wheel_base: 0.02,
    slip: 0.06,
    drag_n: [0.0, 0.08],
    battery: [0.90, 1.05],
    grip: [0.7, 1.1],
    tilt_mm_m: 4.0,
    wander: 0.15,
    infrared_gain: 0.30,
    infrared_noise: 20.0,
};

impl Noise {
    /// None = perfect.
    pub(crate) fn camera(self) -> Option<&'static CameraRanges> {
        match self {
            Self::None => None,
            Self::Measured => Some(&CAMERA_MEASURED),
            Self::Harsh => Some(&CAMERA_HARSH),
        }
    }

    fn drive(self) -> Option<&'static DriveRanges> {
        match self {
            Self::None => None,
            Self::Measured => Some(&DRIVE_MEASURED),
            Self::Harsh => Some(&DRIVE_HARSH),
        }
    }
}

/// Uniform in low..high.
pub(crate) fn between(rng: &mut Pcg64Mcg, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Uniform in -most..most.
pub(crate) fn around(rng: &mut Pcg64Mcg, most: f64) -> f64 {
    between(rng, [-most, most])
}

/// Normally distributed, as the sum of twelve uniform ones is nearly.
pub(crate) fn normal(rng: &mut Pcg64Mcg, deviation: f64) -> f64 {
    // Six numbers of 10 bits from each 64 are enough.
    let sum: u64 = (0..2)
        .map(|_| {
            let bits = rng.next_u64();
            (0..6).map(|i| bits >> (10 * i) & 0x3FF).sum::<u64>()
        })
        .sum();
    ((sum as f64 + 6.0) / 1024.0 - 6.0) * deviation
}

/// What one robot's wheels, battery and infrared sensors are like.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Way on the floor of each wheel for a way of its rim.
    pub scale: [f64; 2],
    /// The same of turning: the nominal wheel base over the true one.
    pub turn_scale: f64,
    /// Force that each wheel's gear takes, N.
    pub drag_n: [f64; 2],
    /// The battery's voltage, as part of the nominal one.
    pub battery: f64,
    /// Factor of the tyres' grip.
    pub grip: f64,
    slip: f64,
    infrared_scale: [f64; 8],
    infrared_noise: f64,
    rng: Pcg64Mcg,
}

impl Drive {
    /// Of one robot in the match of that seed.
    pub fn new(noise: Noise, seed: u64, robot: usize) -> Self {
        let mut rng =
            device_rng(seed, if robot == 0 { "drive of robot 0" } else { "drive of robot 1" });
        let mut drive = Self {
            scale: [1.0; 2],
            turn_scale: 1.0,
            drag_n: [0.0; 2],
            battery: 1.0,
            grip: 1.0,
            slip: 0.0,
            infrared_scale: [1.0; 8],
            infrared_noise: 0.0,
            rng: rng.clone(),
        };
        if let Some(ranges) = noise.drive() {
            drive.scale = [0; 2].map(|_| 1.0 + around(&mut rng, ranges.wheel_radius));
            drive.turn_scale = 1.0 / (1.0 + around(&mut rng, ranges.wheel_base));
            drive.drag_n = [0; 2].map(|_| between(&mut rng, ranges.drag_n));
            drive.battery = between(&mut rng, ranges.battery);
            drive.grip = between(&mut rng, ranges.grip);
            drive.slip = ranges.slip;
            drive.infrared_scale = [0; 8].map(|_| 1.0 + around(&mut rng, ranges.infrared_gain));
            drive.infrared_noise = ranges.infrared_noise;
            drive.rng = rng;
        }
        drive
    }

    /// Speed over the floor that wheels of these rim speeds give in the next millisecond.
    pub fn over_floor(&mut self, rim_mm_s: [f64; 2]) -> [f64; 2] {
        let mut speeds = [rim_mm_s[0] * self.scale[0], rim_mm_s[1] * self.scale[1]];
        if self.slip > 0.0 {
            speeds = speeds.map(|speed| speed * (1.0 + normal(&mut self.rng, self.slip)));
        }
        speeds
    }

    /// What the infrared sensors make of their true readings.
    pub fn infrared(&mut self, readings: [u16; 8]) -> [u16; 8] {
        core::array::from_fn(|i| {
            let off = normal(&mut self.rng, self.infrared_noise);
            let value = f64::from(readings[i]) * self.infrared_scale[i] + off;
            value.clamp(0.0, 1023.0) as u16
        })
    }
}

/// The floor of a match.
#[derive(Clone, Debug)]
pub struct Floor {
    /// Slope in x and y: part of its weight that pulls a ball that way.
    pub slope: [f64; 2],
    wander: f64,
    rng: Pcg64Mcg,
}

impl Floor {
    /// Of the match of that seed.
    pub fn new(noise: Noise, seed: u64) -> Self {
        let mut rng = device_rng(seed, "floor");
        let (tilt, wander) =
            noise.drive().map_or((0.0, 0.0), |ranges| (ranges.tilt_mm_m / 1000.0, ranges.wander));
        let slope = [0; 2].map(|_| around(&mut rng, tilt));
        Self { slope, wander, rng }
    }

    /// By how much a ball that rolls so far changes its direction, radians.
    pub fn wander(&mut self, way_m: f64) -> f64 {
        if self.wander == 0.0 || way_m <= 0.0 {
            return 0.0;
        }
        normal(&mut self.rng, self.wander * libm::sqrt(way_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_their_deviation() {
        let mut rng = device_rng(1, "test");
        let values: Vec<f64> = (0..20_000).map(|_| normal(&mut rng, 2.0)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.05 && (libm::sqrt(square) - 2.0).abs() < 0.05, "{mean} {square}");
    }

    #[test]
    fn perfect_wheels_do_what_they_say_and_others_nearly() {
        let mut perfect = Drive::new(Noise::None, 3, 0);
        assert_eq!(perfect.over_floor([100.0, -50.0]), [100.0, -50.0]);
        assert_eq!(perfect.infrared([7; 8]), [7; 8]);
        for (noise, most) in [(Noise::Measured, 0.01), (Noise::Harsh, 0.03)] {
            let mut largest = 0.0_f64;
            for seed in 0..20 {
                let mut drive = Drive::new(noise, seed, 1);
                let way: f64 = (0..1000).map(|_| drive.over_floor([100.0, 0.0])[0] / 1000.0).sum();
                largest = largest.max((way / 100.0 - 1.0).abs());
            }
            assert!((most / 10.0..most).contains(&largest), "{noise:?}: {largest}");
        }
    }

    #[test]
    fn robots_and_seeds_differ() {
        let scale = |seed, robot| Drive::new(Noise::Measured, seed, robot).scale;
        assert_eq!(scale(1, 0), scale(1, 0));
        assert_ne!(scale(1, 0), scale(1, 1));
        assert_ne!(scale(1, 0), scale(2, 0));
    }
}
