//! The two eyes: where they sit on a robot and along which rays their pixels look.

use crate::physics::Pose;

/// Focal length in px at 320 px width, tilt, height of the lenses and baseline: the fit of
/// `common/vision/camera.h`, here in floating point as the world needs them.
pub const FOCAL_PX: f64 = common_sys::constants::CAMERA_FOCAL_PX as f64;
/// See [`FOCAL_PX`].
pub const LENS_HEIGHT_MM: f64 = common_sys::constants::CAMERA_LENS_HEIGHT_MM as f64;
/// See [`FOCAL_PX`].
pub const BASELINE_MM: f64 = common_sys::constants::CAMERA_BASELINE_UM as f64 / 1000.0;
/// Both lenses look down by 9.8 degrees.
pub const TILT_RAD: f64 = 9.8 * core::f64::consts::PI / 180.0;
/// The lenses are this far before the robot's centre (assumption).
pub const LENS_FORWARD_MM: f64 = 0.0;
/// Pixels of a row, rows of a frame.
pub const WIDTH: usize = common_sys::vision::WIDTH;
/// See [`WIDTH`].
pub const HEIGHT: usize = common_sys::vision::HEIGHT;

/// Which eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {
    /// The left one.
    Left,
    /// The right one, the reference.
    Right,
}

/// A pinhole camera in the world.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// The lens, mm.
    pub at: [f32; 3],
    /// Directions of the optical axis, of the picture's x and of its y.
    axes: [[f32; 3]; 3],
    /// Where the optical axis meets the picture, px.
    pub centre_px: [f32; 2],
}

impl Camera {
    /// One eye of a robot at `pose`.
    pub fn of_robot(pose: Pose, eye: Eye) -> Self {
        let left_mm = match eye {
            Eye::Left => BASELINE_MM / 2.0,
            Eye::Right => -BASELINE_MM / 2.0,
        };
        let (sin, cos) = libm::sincos(pose.heading_rad);
        let x = pose.x_mm + LENS_FORWARD_MM * cos - left_mm * sin;
        let y = pose.y_mm + LENS_FORWARD_MM * sin + left_mm * cos;
        Self::at_lens([x, y], pose.heading_rad)
    }

    /// An eye whose lens is above this place, turned like this.
    pub fn at_lens(lens_mm: [f64; 2], heading_rad: f64) -> Self {
        Self::tilted([lens_mm[0], lens_mm[1], LENS_HEIGHT_MM], heading_rad, TILT_RAD)
    }

    /// A camera above this place that looks level.
    pub fn level(lens_mm: [f64; 2], height_mm: f64, heading_rad: f64) -> Self {
        Self::tilted([lens_mm[0], lens_mm[1], height_mm], heading_rad, 0.0)
    }

    fn tilted(lens_mm: [f64; 3], heading_rad: f64, tilt_rad: f64) -> Self {
        let (sin, cos) = libm::sincos(heading_rad);
        let (tilt_sin, tilt_cos) = libm::sincos(tilt_rad);
        let vector = |v: [f64; 3]| v.map(|component| component as f32);
        Self {
            at: vector(lens_mm),
            axes: [
                vector([cos * tilt_cos, sin * tilt_cos, -tilt_sin]),
                vector([sin, -cos, 0.0]),
                vector([-cos * tilt_sin, -sin * tilt_sin, -tilt_cos]),
            ],
            centre_px: [(WIDTH - 1) as f32 / 2.0, (HEIGHT - 1) as f32 / 2.0],
        }
    }

    /// The camera whose pixel (x, y) is pixel (2 x + column, 2 y + row) of this one at twice the
    /// resolution: four of them make a large picture.
    pub fn quarter(self, column: usize, row: usize) -> Self {
        let [x, y] = self.centre_px;
        let moved = |centre: f32, place: usize| centre + 0.25 - place as f32 / 2.0;
        Self { centre_px: [moved(x, column), moved(y, row)], ..self }
    }

    /// The ray through a point of the picture; its length along the optical axis is 1.
    pub fn ray(&self, x_px: f32, y_px: f32) -> [f32; 3] {
        let u = (x_px - self.centre_px[0]) / FOCAL_PX as f32;
        let v = (y_px - self.centre_px[1]) / FOCAL_PX as f32;
        let [axis, right, down] = self.axes;
        [0, 1, 2].map(|i| axis[i] + u * right[i] + v * down[i])
    }

    /// A point of the world from the lens: its depth along the optical axis, how far right of that
    /// and how far down, mm.
    pub fn seen_from_lens(&self, point: [f32; 3]) -> [f32; 3] {
        let offset = [0, 1, 2].map(|i| point[i] - self.at[i]);
        self.axes.map(|axis| axis[0] * offset[0] + axis[1] * offset[1] + axis[2] * offset[2])
    }

    /// Where a point of the world appears: x and y in pixels, and its depth; None behind the lens.
    pub fn project(&self, point: [f32; 3]) -> Option<[f32; 3]> {
        let [depth, right, down] = self.seen_from_lens(point);
        if depth <= 1.0 {
            return None;
        }
        let scale = FOCAL_PX as f32 / depth;
        Some([self.centre_px[0] + right * scale, self.centre_px[1] + down * scale, depth])
    }
}
