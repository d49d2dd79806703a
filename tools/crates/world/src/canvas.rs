//! Drawing with smooth edges into an RGB picture.

use image::{Rgb, RgbImage};

use crate::font;

/// A colour, 0..=255 a channel.
pub type Colour = [u8; 3];

/// A picture that can be drawn into. Coordinates are pixels, integers = pixel centres; what lies
/// outside is left out.
pub struct Canvas {
    /// What has been drawn.
    pub picture: RgbImage,
}

impl Canvas {
    /// A picture of one colour.
    pub fn new(width: u32, height: u32, colour: Colour) -> Self {
        Self { picture: RgbImage::from_pixel(width, height, Rgb(colour)) }
    }

    /// Lay `share` (0..=1) of a colour over a pixel.
    fn blend(&mut self, x: i64, y: i64, colour: Colour, share: f64) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if let Some(Rgb(pixel)) = self.picture.get_pixel_mut_checked(x, y) {
            for (old, new) in pixel.iter_mut().zip(colour) {
                let mixed = f64::from(*old) + (f64::from(new) - f64::from(*old)) * share;
                *old = (mixed + 0.5) as u8;
            }
        }
    }

    /// Paint where `distance_px` (negative inside) says so, within a box around it.
    fn paint(
        &mut self,
        [from, to]: [[f64; 2]; 2],
        colour: Colour,
        opacity: f64,
        distance_px: impl Fn(f64, f64) -> f64,
    ) {
        let (width, height) = self.picture.dimensions();
        let range = |low: f64, high: f64, most: u32| {
            (low.floor() - 1.0).clamp(0.0, f64::from(most)) as i64
                ..(high.ceil() + 2.0).clamp(0.0, f64::from(most)) as i64
        };
        for y in range(from[1], to[1], height) {
            for x in range(from[0], to[0], width) {
                let share = (0.5 - distance_px(x as f64, y as f64)).clamp(0.0, 1.0) * opacity;
                if share > 0.0 {
                    self.blend(x, y, colour, share);
                }
            }
        }
    }

    /// A filled rectangle between two corners.
    pub fn rectangle(&mut self, from: [f64; 2], to: [f64; 2], colour: Colour, opacity: f64) {
        self.paint([from, to], colour, opacity, |x, y| {
            (from[0] - x).max(x - to[0]).max(from[1] - y).max(y - to[1])
        });
    }

    /// A filled disc.
    pub fn disc(&mut self, centre: [f64; 2], radius: f64, colour: Colour, opacity: f64) {
        self.ring(centre, [0.0, radius], colour, opacity);
    }

    /// What lies between two radii.
    pub fn ring(&mut self, centre: [f64; 2], radii: [f64; 2], colour: Colour, opacity: f64) {
        let [inner, outer] = radii;
        let corner = |sign: f64| [centre[0] + sign * outer, centre[1] + sign * outer];
        self.paint([corner(-1.0), corner(1.0)], colour, opacity, |x, y| {
            let radius = libm::hypot(x - centre[0], y - centre[1]);
            let hole = if inner > 0.0 { inner - radius } else { f64::NEG_INFINITY };
            (radius - outer).max(hole)
        });
    }

    /// A straight line with round ends.
    pub fn line(&mut self, [a, b]: [[f64; 2]; 2], width: f64, colour: Colour, opacity: f64) {
        let half = width / 2.0;
        let low = [a[0].min(b[0]) - half, a[1].min(b[1]) - half];
        let high = [a[0].max(b[0]) + half, a[1].max(b[1]) + half];
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        self.paint([low, high], colour, opacity, |x, y| {
            let offset = [x - a[0], y - a[1]];
            let dot = offset[0] * along[0] + offset[1] * along[1];
            let part = if square > 0.0 { (dot / square).clamp(0.0, 1.0) } else { 0.0 };
            libm::hypot(offset[0] - part * along[0], offset[1] - part * along[1]) - half
        });
    }

    /// A convex polygon.
    pub fn polygon(&mut self, points: &[[f64; 2]], colour: Colour) {
        let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
            points.iter().fold(start, |best, point| pick(best, point[axis]))
        };
        let low = [bound(0, f64::min, f64::MAX), bound(1, f64::min, f64::MAX)];
        let high = [bound(0, f64::max, f64::MIN), bound(1, f64::max, f64::MIN)];
        let turn: f64 = (0..points.len())
            .map(|i| {
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                a[0] * b[1] - a[1] * b[0]
            })
            .sum();
        self.paint([low, high], colour, 1.0, |x, y| {
            (0..points.len()).fold(f64::MIN, |most, i| {
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let outside = (x - a[0]) * dy - (y - a[1]) * dx;
                most.max(outside * turn.signum() / libm::hypot(dx, dy))
            })
        });
    }

    /// Text, its top left corner at `at`, a dot of a letter `scale` pixels wide. Returns its width.
    pub fn text(&mut self, at: [i64; 2], scale: i64, colour: Colour, text: &str) -> i64 {
        let step = (font::COLUMNS as i64 + 1) * scale;
        let mut x = at[0];
        for letter in text.chars() {
            for (row, dots) in (0..).zip(font::rows(letter)) {
                for column in 0..font::COLUMNS as i64 {
                    if dots & (0x10 >> column) != 0 {
                        self.dot([x + column * scale, at[1] + row * scale], scale, colour);
                    }
                }
            }
            x += step;
        }
        x - at[0] - scale
    }

    fn dot(&mut self, at: [i64; 2], size: i64, colour: Colour) {
        for y in at[1]..at[1] + size {
            for x in at[0]..at[0] + size {
                self.blend(x, y, colour, 1.0);
            }
        }
    }

    /// Copy a picture in, each of its pixels `scale` times as large.
    pub fn insert(&mut self, from: &RgbImage, at: [i64; 2], scale: i64) {
        for (x, y, Rgb(colour)) in from.enumerate_pixels() {
            let corner = [at[0] + i64::from(x) * scale, at[1] + i64::from(y) * scale];
            self.dot(corner, scale, *colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_covers_its_area() {
        let mut canvas = Canvas::new(64, 64, [0; 3]);
        canvas.disc([31.3, 30.8], 20.0, [255; 3], 1.0);
        let sum: f64 = canvas.picture.pixels().map(|p| f64::from(p.0[0]) / 255.0).sum();
        let area = core::f64::consts::PI * 400.0;
        assert!((sum - area).abs() < 0.01 * area, "{sum} is not {area}");
    }

    #[test]
    fn what_lies_outside_is_left_out() {
        let mut canvas = Canvas::new(8, 8, [0; 3]);
        canvas.disc([-50.0, 900.0], 3.0, [255; 3], 1.0);
        canvas.line([[-20.0, -20.0], [-9.0, 30.0]], 2.0, [255; 3], 1.0);
        canvas.text([-100, 100], 2, [255; 3], "out");
        assert!(canvas.picture.pixels().all(|p| p.0 == [0; 3]));
    }
}
