//! A camera that is not perfect, in three qualities: what the renderer draws becomes the pixels that
//! the detectors get. The qualities follow those of host-tests/data/scenes.

use common_sys::vision::rgb565;
use world::camera::{Camera, HEIGHT, WIDTH};
use world::pitch as p;
use world::render::render;

use crate::setting::{Random, Setting};

type Frame = Vec<[f32; 3]>;

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Tier {
    /// The picture as it is.
    Clean,
    /// Noise, eyes that differ by up to 4 %, a shift of white balance, vignetting, slight blur.
    Nominal,
    /// Twice the noise, half the light and that warm and uneven, eyes that differ by up to 10 % and by
    /// up to two rows, and something yellow or white beyond the wall.
    Harsh,
}

impl Tier {
    pub fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Nominal => "nominal",
            Self::Harsh => "harsh",
        }
    }
}

/// What both cameras of a pair do to the light.
struct Sensor {
    /// Of 255.
    noise: f64,
    /// Factors of each channel, left and right eye.
    gain: [[f64; 3]; 2],
    vignette: f64,
    blur_px: f64,
    /// How much the light falls from left to right.
    slope: f64,
    /// Rows that the left eye is off.
    misalignment: f64,
}

impl Sensor {
    fn draw(tier: Tier, seed: u64) -> Self {
        let random = &mut Random::new(seed, 2 + tier as u64);
        let (noise, unequal, balance, exposure, tint, blur) = match tier {
            Tier::Clean => ([0.0, 0.0], 0.0, 0.0, [1.0, 1.0], [1.0, 1.0, 1.0], [0.0, 0.0]),
            Tier::Nominal => ([2.0, 3.0], 0.02, 0.05, [0.85, 1.0], [1.0, 1.0, 1.0], [0.45, 0.75]),
            Tier::Harsh => ([5.0, 6.0], 0.05, 0.02, [0.45, 0.6], [1.0, 0.92, 0.72], [0.6, 0.85]),
        };
        let exposure = random.between(exposure[0], exposure[1]);
        let imbalance = random.between(-unequal, unequal);
        let white =
            [1.0 + random.between(-balance, balance), 1.0, 1.0 + random.between(-balance, balance)];
        let gain = [1.0 + imbalance, 1.0 - imbalance]
            .map(|eye| [0, 1, 2].map(|i| exposure * tint[i] * white[i] * eye));
        let harsh = tier == Tier::Harsh;
        Self {
            noise: random.between(noise[0], noise[1]),
            gain,
            vignette: if tier == Tier::Clean { 0.0 } else { random.between(0.1, 0.26) },
            blur_px: random.between(blur[0], blur[1]),
            slope: if harsh { random.between(-0.15, 0.15) } else { 0.0 },
            misalignment: if harsh { random.between(-2.0, 2.0) } else { 0.0 },
        }
    }
}

/// Left and right picture of a setting.
pub fn take_pair(setting: &Setting, tier: Tier, seed: u64) -> [Vec<u16>; 2] {
    let sensor = Sensor::draw(tier, seed);
    let cameras = setting.cameras();
    [0, 1].map(|eye| {
        let mut frame = Frame::new();
        render(&cameras[eye], &setting.scene(), &mut frame);
        if tier == Tier::Harsh {
            add_distractor(setting, &cameras[eye], &mut frame);
        }
        if eye == 0 {
            frame = shifted_down(&frame, sensor.misalignment);
        }
        frame = blurred(&frame, sensor.blur_px);
        expose(&frame, &sensor, eye, &mut Random::new(seed, 10 + 2 * tier as u64 + eye as u64))
    })
}

/// Paint what stands beyond the wall: far away, so both eyes see it in the same direction.
fn add_distractor(setting: &Setting, camera: &Camera, frame: &mut Frame) {
    let Some(distractor) = setting.distractor else { return };
    let colour = if distractor.yellow { [0.9, 0.75, 0.1] } else { [0.85, 0.85, 0.83] };
    for y in 0..HEIGHT / 3 {
        for x in 0..WIDTH {
            let ray = camera.ray(x as f32, y as f32).map(f64::from);
            let bearing = libm::atan2(ray[1], ray[0]) - setting.robot.heading_rad;
            let bearing = libm::remainder(bearing, 2.0 * core::f64::consts::PI);
            let [from, to] = distractor.bearing;
            if (from..to).contains(&bearing) && passes_over_the_wall(camera, ray) {
                frame[y * WIDTH + x] = colour;
            }
        }
    }
}

fn passes_over_the_wall(camera: &Camera, ray: [f64; 3]) -> bool {
    let at = camera.at.map(f64::from);
    let to_plane = |n: [f64; 2], c: f64| {
        let speed = n[0] * ray[0] + n[1] * ray[1];
        if speed > 0.0 { (c - n[0] * at[0] - n[1] * at[1]) / speed } else { f64::INFINITY }
    };
    let ends =
        to_plane([1.0, 0.0], p::HALF_LENGTH_MM).min(to_plane([-1.0, 0.0], p::HALF_LENGTH_MM));
    let sides = to_plane([0.0, 1.0], p::HALF_WIDTH_MM).min(to_plane([0.0, -1.0], p::HALF_WIDTH_MM));
    at[2] + ends.min(sides) * ray[2] > p::WALL_HEIGHT_MM + 15.0
}

fn mixed(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * share)
}

fn shifted_down(frame: &Frame, rows: f64) -> Frame {
    let whole = libm::floor(rows);
    let share = (rows - whole) as f32;
    let row_at = |y: isize| y.clamp(0, HEIGHT as isize - 1) as usize;
    (0..HEIGHT * WIDTH)
        .map(|i| {
            let (y, x) = ((i / WIDTH) as isize - whole as isize, i % WIDTH);
            mixed(frame[row_at(y) * WIDTH + x], frame[row_at(y - 1) * WIDTH + x], share)
        })
        .collect()
}

/// A Gauss of that deviation, five pixels wide, along rows and then columns.
fn blurred(frame: &Frame, deviation: f64) -> Frame {
    if deviation == 0.0 {
        return frame.clone();
    }
    let weight = |i: f64| libm::exp(-i * i / (2.0 * deviation * deviation));
    let sum = 1.0 + 2.0 * weight(1.0) + 2.0 * weight(2.0);
    let weights = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|i| (weight(i) / sum) as f32);
    let pass = |source: &Frame, dx: isize, dy: isize| -> Frame {
        (0..HEIGHT * WIDTH)
            .map(|i| {
                let (x, y) = ((i % WIDTH) as isize, (i / WIDTH) as isize);
                let mut sum = [0.0_f32; 3];
                for (k, weight) in weights.iter().enumerate() {
                    let step = k as isize - 2;
                    let at_x = (x + step * dx).clamp(0, WIDTH as isize - 1) as usize;
                    let at_y = (y + step * dy).clamp(0, HEIGHT as isize - 1) as usize;
                    let pixel = source[at_y * WIDTH + at_x];
                    sum = [0, 1, 2].map(|c| sum[c] + weight * pixel[c]);
                }
                sum
            })
            .collect()
    };
    pass(&pass(frame, 1, 0), 0, 1)
}

fn expose(frame: &Frame, sensor: &Sensor, eye: usize, random: &mut Random) -> Vec<u16> {
    let (cx, cy) = ((WIDTH - 1) as f64 / 2.0, (HEIGHT - 1) as f64 / 2.0);
    frame
        .iter()
        .enumerate()
        .map(|(i, pixel)| {
            let (x, y) = ((i % WIDTH) as f64 - cx, (i / WIDTH) as f64 - cy);
            let far = (x * x + y * y) / (cx * cx + cy * cy);
            let light = (1.0 - sensor.vignette * far) * (1.0 + sensor.slope * x / cx);
            let [r, g, b] = [0, 1, 2].map(|c| {
                let level = 255.0 * f64::from(pixel[c]) * light * sensor.gain[eye][c];
                let level =
                    level + if sensor.noise > 0.0 { sensor.noise * random.normal() } else { 0.0 };
                level.round().clamp(0.0, 255.0) as u8
            });
            rgb565(r, g, b)
        })
        .collect()
}
