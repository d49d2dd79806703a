//! What the cameras make of the light: noise, unequal eyes, white balance, vignetting, blur, rows that
//! do not match.
//!
//! How bad they are is drawn once, when they are made, from the ranges in [`crate::noise`]; flicker is
//! drawn for each frame, noise for each pixel of it.

use pulp::{Arch, NullaryFnOnce};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;
use sim::device_rng;

use crate::camera::{Eye, HEIGHT, WIDTH};
use crate::noise::{Noise, around, between, normal};
use crate::render::Frame;
use crate::shade::Rgb;

/// Channels of a row.
const ROW: usize = 3 * WIDTH;
/// A blur reaches so many pixels to either side.
const REACH: usize = 2;
/// Weights of a blur that also moves by a part of a pixel.
const KERNEL: usize = 2 * REACH + 2;
/// Pixels that a row is continued by: the blur's reach, and the most that an eye squints.
const MARGIN: usize = 4;
/// Blurred rows that are kept: those which one of the frame is made from, and those in between.
const RING: usize = 16;
/// Bits that choose one of the normally distributed numbers.
const NORMAL_BITS: u32 = 12;
const NORMALS: usize = 1 << NORMAL_BITS;

/// A number 0..2^22 rounded, as a float and its lowest eight bits. From 2^23 on a float has no
/// fraction; quicker than a conversion, and the compiler does it for many pixels at once.
#[inline(always)]
pub(crate) fn rounded(value: f32) -> (f32, u8) {
    const SHIFT: f32 = 12_582_912.0;
    let shifted = value + SHIFT;
    (shifted - SHIFT, shifted.to_bits() as u8)
}

/// The sum of six series, each with its weight.
#[inline(always)]
fn weighed(out: &mut [f32; ROW], weights: &[f32; KERNEL], series: [&[f32; ROW]; KERNEL]) {
    let [a, b, c, d, e, f] = series;
    for (i, sum) in out.iter_mut().enumerate() {
        *sum = weights[0] * a[i]
            + weights[1] * b[i]
            + weights[2] * c[i]
            + weights[3] * d[i]
            + weights[4] * e[i]
            + weights[5] * f[i];
    }
}

/// A row of this length from there on.
#[inline(always)]
fn row_from(values: &[f32], start: usize) -> &[f32; ROW] {
    values[start..start + ROW].try_into().expect("the range is that long")
}

/// Both eyes of a robot.
#[derive(Clone)]
pub struct Sensors {
    /// What each eye makes of each channel of each pixel, in units of 1/255.
    gain: [Vec<f32>; 2],
    /// Weights of the pixel and its neighbours to one side.
    blur: [f32; REACH + 1],
    /// The left eye's offset in columns and rows.
    misaligned_px: [f64; 2],
    flicker: f64,
    /// Factor of this frame's light, the same in both eyes.
    frame_light: f32,
    rng: Pcg64Mcg,
    /// Normally distributed numbers of the noise's deviation.
    normals: Box<[f32; NORMALS]>,
}

impl Sensors {
    /// The eyes of one robot, `robot`, in the match of that seed; None for perfect ones.
    pub fn new(noise: Noise, seed: u64, robot: usize) -> Option<Self> {
        let ranges = noise.camera()?;
        let mut rng =
            device_rng(seed, if robot == 0 { "eyes of robot 0" } else { "eyes of robot 1" });
        let exposure = between(&mut rng, ranges.exposure) * 255.0;
        let unequal = around(&mut rng, ranges.unequal);
        let balance = [around(&mut rng, ranges.balance), 0.0, around(&mut rng, ranges.balance)];
        let gain = [1.0 + unequal, 1.0 - unequal].map(|eye| {
            [0, 1, 2].map(|channel| {
                let apart = if channel == 1 { 0.0 } else { around(&mut rng, ranges.balance_apart) };
                let white = 1.0 + balance[channel] + apart;
                (exposure * eye * white * ranges.tint[channel]) as f32
            })
        });
        let vignette = between(&mut rng, ranges.vignette);
        let uneven = around(&mut rng, ranges.uneven);
        let light = light(vignette, uneven);
        let gain = gain.map(|gain| light.iter().flat_map(|l| gain.map(|g| g * l)).collect());
        Some(Self {
            gain,
            blur: blur(between(&mut rng, ranges.blur_px)),
            misaligned_px: [ranges.squint_px, ranges.misaligned_px]
                .map(|most| around(&mut rng, most)),
            flicker: ranges.flicker,
            frame_light: 1.0,
            normals: {
                let noise = between(&mut rng, ranges.noise) as f32;
                Box::new(normals().map(|x| x * noise))
            },
            rng,
        })
    }

    /// Turn what falls on an eye into what its sensor gives: still 0..1 a channel, but in steps of
    /// 1/255.
    pub fn expose(&mut self, eye: Eye, frame: &mut Frame) {
        let (index, misaligned_px) = match eye {
            Eye::Left => {
                // Both eyes are exposed at once; the left one is read first.
                self.frame_light = 1.0 + normal(&mut self.rng, self.flicker) as f32;
                (0, self.misaligned_px)
            }
            Eye::Right => (1, [0.0; 2]),
        };
        let shift = misaligned_px.map(|px| self.shift(px));
        Arch::new().dispatch(Development { sensors: self, eye: index, shift, frame });
    }

    /// Weights of the pixels around one, from `REACH` before it to `REACH + 1` after it, blurred and
    /// moved by a part of a pixel: blurring and moving make one kernel.
    fn kernel(&self, part: f32) -> [f32; KERNEL] {
        let weight = |step: usize| *self.blur.get(step.abs_diff(REACH)).unwrap_or(&0.0);
        core::array::from_fn(|step| {
            let before = if step == 0 { 0.0 } else { weight(step - 1) };
            weight(step) * (1.0 - part) + before * part
        })
    }

    fn shift(&self, px: f64) -> Shift {
        let whole = libm::floor(px);
        Shift { whole: whole as isize, kernel: self.kernel((px - whole) as f32) }
    }
}

/// A blur that also moves by so many whole pixels.
struct Shift {
    whole: isize,
    kernel: [f32; KERNEL],
}

/// A frame to be turned into what its sensor gives, row by row: blurred along, blurred across, made
/// uneven and noisy. Compiled for several sets of instructions like [`crate::render::render`].
struct Development<'a> {
    sensors: &'a mut Sensors,
    eye: usize,
    /// Along the rows, and across.
    shift: [Shift; 2],
    frame: &'a mut Frame,
}

impl NullaryFnOnce for Development<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { sensors, eye, shift: [along, across], frame } = self;
        let Sensors { gain, normals, frame_light, rng, .. } = sensors;
        let mut blurred = vec![[0.0; ROW]; RING];
        let mut ready = 0;
        for y in 0..HEIGHT {
            // Rows that the blur across reaches; this one, too, whose place is about to be needed.
            let reached = (y + REACH).saturating_add_signed(-across.whole).max(y);
            while ready <= reached.min(HEIGHT - 1) {
                along.blur_row(&frame[ready * WIDTH..][..WIDTH], &mut blurred[ready % RING]);
                ready += 1;
            }
            let from = |i: usize| {
                let row = (y + REACH).saturating_add_signed(-across.whole).saturating_sub(i);
                &blurred[row.min(HEIGHT - 1) % RING]
            };
            let row = frame[y * WIDTH..][..WIDTH].as_flattened_mut();
            let row: &mut [f32; ROW] = row.try_into().expect("a row's length");
            weighed(row, &across.kernel, core::array::from_fn(from));
            let mut noise = [0.0_f32; ROW];
            for pixel in noise.chunks_exact_mut(3) {
                let bits = rng.next_u64();
                for (i, value) in pixel.iter_mut().enumerate() {
                    *value = normals[(bits >> (NORMAL_BITS * i as u32)) as usize % NORMALS];
                }
            }
            let gain = row_from(&gain[eye], y * ROW);
            for ((channel, gain), noise) in row.iter_mut().zip(gain).zip(&noise) {
                let level = (*channel * gain * *frame_light + noise).clamp(0.0, 255.0);
                *channel = rounded(level).0 * (1.0 / 255.0);
            }
        }
    }
}

impl Shift {
    /// Blur a row along itself, moved to the right.
    #[inline(always)]
    fn blur_row(&self, row: &[Rgb], out: &mut [f32; ROW]) {
        let mut kernel = self.kernel;
        kernel.reverse();
        // A pixel takes from those before it if the picture moves right.
        let first = 3 * (MARGIN as isize - REACH as isize - 1 - self.whole) as usize;
        let mut padded = [0.0_f32; ROW + 6 * MARGIN];
        padded[3 * MARGIN..3 * MARGIN + ROW].copy_from_slice(row.as_flattened());
        for i in 0..3 * MARGIN {
            padded[i] = row[0][i % 3];
            padded[3 * MARGIN + ROW + i] = row[WIDTH - 1][i % 3];
        }
        weighed(out, &kernel, core::array::from_fn(|i| row_from(&padded, first + 3 * i)));
    }
}

/// What is left of the light at each pixel.
fn light(vignette: f64, uneven: f64) -> Vec<f32> {
    let (half_x, half_y) = ((WIDTH - 1) as f64 / 2.0, (HEIGHT - 1) as f64 / 2.0);
    let square = half_x * half_x + half_y * half_y;
    (0..WIDTH * HEIGHT)
        .map(|i| {
            let (x, y) = ((i % WIDTH) as f64 - half_x, (i / WIDTH) as f64 - half_y);
            ((1.0 - vignette * (x * x + y * y) / square) * (1.0 + uneven * x / half_x)) as f32
        })
        .collect()
}

/// Weights of a Gauss of this deviation.
fn blur(deviation_px: f64) -> [f32; REACH + 1] {
    let weight = |i: usize| libm::exp(-((i * i) as f64) / (2.0 * deviation_px * deviation_px));
    let sum = weight(0) + 2.0 * (1..=REACH).map(weight).sum::<f64>();
    core::array::from_fn(|i| (weight(i) / sum) as f32)
}

/// Normally distributed numbers, each as probable as any other: quantiles in the middle of as many
/// equal parts.
fn normals() -> [f32; NORMALS] {
    let half = NORMALS / 2;
    let mut upper = Vec::with_capacity(half);
    let mut x = 0.0_f64;
    for i in 0..half {
        let wanted = 0.5 + (i as f64 + 0.5) / (2 * half) as f64;
        // Newton's method, from the quantile before.
        for _ in 0..6 {
            let reached = 0.5 * (1.0 + libm::erf(x * core::f64::consts::FRAC_1_SQRT_2));
            let density = libm::exp(-x * x / 2.0) * 0.398_942_280_401_432_7;
            x += (wanted - reached) / density;
        }
        upper.push(x as f32);
    }
    core::array::from_fn(|i| if i < half { -upper[half - 1 - i] } else { upper[i - half] })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(level: f32) -> Frame {
        vec![[level; 3]; WIDTH * HEIGHT]
    }

    fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
        let count = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / count;
        let square = values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
        (mean, libm::sqrt(square))
    }

    #[test]
    fn the_numbers_are_normally_distributed() {
        let (mean, deviation) = moments(normals().into_iter().map(f64::from));
        assert!(mean.abs() < 1e-6 && (deviation - 1.0).abs() < 2e-3, "{mean} {deviation}");
    }

    #[test]
    fn noise_and_light_lie_in_the_ranges_of_the_scenes() {
        // The ranges, widened by what 400 pixels tell of a deviation.
        for (noise, deviation, level) in
            [(Noise::Measured, 1.7..3.4, 80.0..135.0), (Noise::Harsh, 4.4..6.7, 45.0..85.0)]
        {
            for seed in 0..8 {
                let mut eyes = Sensors::new(noise, seed, 0).expect("not perfect");
                let mut frame = flat(0.5);
                eyes.expose(Eye::Right, &mut frame);
                // In the middle vignetting hardly matters.
                let middle = (110..130).flat_map(|y| (150..170).map(move |x| y * WIDTH + x));
                let green = middle.map(|i| f64::from(frame[i][1]) * 255.0);
                let (mean, sigma) = moments(green);
                assert!(level.contains(&mean), "{noise:?} {seed}: level {mean}");
                assert!(deviation.contains(&sigma), "{noise:?} {seed}: noise {sigma}");
            }
        }
    }

    #[test]
    fn only_the_left_eye_is_rows_off() {
        let mut found = 0.0_f64;
        for seed in 0..12 {
            let mut eyes = Sensors::new(Noise::Harsh, seed, 0).expect("not perfect");
            // Not black: noise about black has lost its lower half.
            let edge = |eye: Eye, eyes: &mut Sensors| {
                let mut frame = flat(1.0);
                frame[..120 * WIDTH].fill([0.3; 3]);
                eyes.expose(eye, &mut frame);
                let mean = |rows: core::ops::Range<usize>| {
                    let places = rows.flat_map(|y| (100..220).map(move |x| y * WIDTH + x));
                    moments(places.map(|i| f64::from(frame[i][1]))).0
                };
                let (dark, bright) = (mean(108..114), mean(126..132));
                132.0 - 24.0 * (mean(108..132) - dark) / (bright - dark)
            };
            let (left, right) = (edge(Eye::Left, &mut eyes), edge(Eye::Right, &mut eyes));
            assert!((right - 120.0).abs() < 0.1, "seed {seed}: {right}");
            assert!(
                (left - right - eyes.misaligned_px[1]).abs() < 0.1,
                "seed {seed}: {left} {right}"
            );
            found = found.max((left - right).abs());
        }
        assert!((0.7..1.6).contains(&found), "{found}");
    }

    #[test]
    fn only_the_left_eye_squints() {
        let mut found = 0.0_f64;
        for seed in 0..12 {
            let mut eyes = Sensors::new(Noise::Harsh, seed, 0).expect("not perfect");
            let edge = |eye: Eye, eyes: &mut Sensors| {
                let mut frame = flat(1.0);
                for row in frame.chunks_exact_mut(WIDTH) {
                    row[..160].fill([0.3; 3]);
                }
                eyes.expose(eye, &mut frame);
                let mean = |columns: core::ops::Range<usize>| {
                    let places = columns.flat_map(|x| (60..180).map(move |y| y * WIDTH + x));
                    moments(places.map(|i| f64::from(frame[i][1]))).0
                };
                let (dark, bright) = (mean(148..154), mean(166..172));
                172.0 - 24.0 * (mean(148..172) - dark) / (bright - dark)
            };
            let (left, right) = (edge(Eye::Left, &mut eyes), edge(Eye::Right, &mut eyes));
            assert!((right - 160.0).abs() < 0.1, "seed {seed}: {right}");
            assert!(
                (left - right - eyes.misaligned_px[0]).abs() < 0.1,
                "seed {seed}: {left} {right}"
            );
            found = found.max((left - right).abs());
        }
        assert!((0.2..0.5).contains(&found), "{found}");
    }

    #[test]
    fn eyes_are_the_same_for_a_seed_and_differ_between_robots() {
        let shot = |seed: u64, robot: usize| {
            let mut frame = flat(0.4);
            Sensors::new(Noise::Measured, seed, robot)
                .expect("not perfect")
                .expose(Eye::Left, &mut frame);
            frame
        };
        assert_eq!(shot(5, 0), shot(5, 0));
        assert_ne!(shot(5, 0), shot(6, 0));
        assert_ne!(shot(5, 0), shot(5, 1));
        assert!(Sensors::new(Noise::None, 5, 0).is_none());
    }
}
