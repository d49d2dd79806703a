//! `common/vision`: the robot's eye and what its numbers mean on the pitch.

#![allow(unsafe_code)] // calls into C; each with the lengths the header asks for

use core::mem::MaybeUninit;

use crate::ffi;
pub use crate::link::Report;

pub use ffi::{eye_params_t as EyeParams, ground_point_t as GroundPoint};

/// Pixels of a row.
pub const WIDTH: usize = ffi::CAMERA_WIDTH_PX as usize;
/// Rows of a frame.
pub const HEIGHT: usize = ffi::CAMERA_HEIGHT_PX as usize;

/// Parameters of the detectors.
pub const PARAM_COUNT: usize = EyeParams::SIZE;

impl EyeParams {
    const SIZE: usize = size_of::<Self>();

    /// As the FPGA's registers have them after configuration.
    pub fn usual() -> Self {
        // SAFETY: a constant of the C side.
        unsafe { ffi::eye_params_default }
    }

    /// In the order of their registers.
    pub fn to_bytes(&self) -> [u8; PARAM_COUNT] {
        let mut bytes = [0; PARAM_COUNT];
        // SAFETY: `bytes` has a byte for each; all of them are bytes.
        unsafe { ffi::eye_params_encode(self, bytes.as_mut_ptr()) };
        bytes
    }

    /// From their registers' values.
    pub fn from_bytes(bytes: &[u8; PARAM_COUNT]) -> Self {
        let mut params = Self::default();
        // SAFETY: `bytes` has a byte for each.
        unsafe { ffi::eye_params_decode(bytes.as_ptr(), &mut params) };
        params
    }
}

/// What the robot's eye reports of a pair of frames: `WIDTH` * `HEIGHT` RGB565 pixels each, row by
/// row from the top. `sequence`, `exposure_time`, `delay` and `function` are 0.
///
/// # Panics
/// If a frame has another number of pixels.
pub fn detect(left: &[u16], right: &[u16], params: &EyeParams) -> Report {
    assert!(
        left.len() == WIDTH * HEIGHT && right.len() == WIDTH * HEIGHT,
        "a frame has {WIDTH}x{HEIGHT} pixels"
    );
    let mut eye = MaybeUninit::<ffi::robot_eye_t>::uninit();
    let mut report = Report::default();
    let frames = ffi::frame_pair_t { pixels: [left.as_ptr(), right.as_ptr()] };
    // SAFETY: begin initialises all that row and end read; each row slice has WIDTH pixels, and
    // `frames` WIDTH * HEIGHT each.
    unsafe {
        ffi::robot_eye_begin(eye.as_mut_ptr(), params);
        for (row, (l, r)) in left.chunks_exact(WIDTH).zip(right.chunks_exact(WIDTH)).enumerate() {
            ffi::robot_eye_row(eye.as_mut_ptr(), row as u8, l.as_ptr(), r.as_ptr());
        }
        ffi::robot_eye_end(eye.as_mut_ptr(), &frames, &mut report);
    }
    report
}

/// Whether both cameras' exposure is settled, as the FPGA sees it in their pictures.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExposureWatch([ffi::exposure_watch_t; 2]);

impl ExposureWatch {
    /// Take a pair of frames of `WIDTH` * `HEIGHT` pixels. True while one of them is unsettled.
    ///
    /// # Panics
    /// If a frame has another number of pixels.
    pub fn is_unsettled(&mut self, left: &[u16], right: &[u16]) -> bool {
        let mut unsettled = false;
        for (watch, pixels) in self.0.iter_mut().zip([left, right]) {
            assert_eq!(pixels.len(), WIDTH * HEIGHT, "a frame has {WIDTH}x{HEIGHT} pixels");
            for row in pixels.chunks_exact(WIDTH) {
                // SAFETY: `row` has WIDTH pixels. A watch of zeros is one that was reset.
                unsafe { ffi::exposure_row(watch, row.as_ptr()) };
            }
            // SAFETY: as above.
            unsettled |= unsafe { ffi::exposure_end(watch) } != 0;
        }
        unsettled
    }
}

/// A frame of twice `WIDTH` by twice `HEIGHT` as the eye sees it: the mean of each four pixels.
///
/// # Panics
/// If the frame has another number of pixels.
pub fn halve(large: &[u16]) -> Vec<u16> {
    assert_eq!(
        large.len(),
        4 * WIDTH * HEIGHT,
        "a large frame has {}x{} pixels",
        2 * WIDTH,
        2 * HEIGHT
    );
    let mut small = vec![0; WIDTH * HEIGHT];
    for (row, rows) in small.chunks_exact_mut(WIDTH).zip(large.chunks_exact(4 * WIDTH)) {
        let (upper, lower) = rows.split_at(2 * WIDTH);
        // SAFETY: both rows have 2 * WIDTH pixels, and `row` has WIDTH.
        unsafe { ffi::frame_halve_rows(upper.as_ptr(), lower.as_ptr(), row.as_mut_ptr()) };
    }
    small
}

/// The RGB565 pixel of an 8-bit colour, as the cameras cut it.
pub const fn rgb565(red: u8, green: u8, blue: u8) -> u16 {
    ((red as u16 >> 3) << 11) | ((green as u16 >> 2) << 5) | (blue as u16 >> 3)
}

/// Depth along the optical axis in mm, or None below 1 px of disparity.
pub fn depth_mm(disparity_q4: u16) -> Option<u16> {
    // SAFETY: a pure function of its argument.
    let depth = unsafe { ffi::depth_mm(disparity_q4) };
    (depth != ffi::DEPTH_FAR_MM as u16).then_some(depth)
}

/// Where the point is that the right eye sees at (x, y) with this disparity, or None below 1 px.
pub fn ground_point(x_q4: u16, y_q4: u16, disparity_q4: u16) -> Option<GroundPoint> {
    let mut point = GroundPoint::default();
    // SAFETY: `point` is valid for writing.
    let found = unsafe { ffi::depth_ground_point(x_q4, y_q4, disparity_q4, &mut point) };
    (found != 0).then_some(point)
}

/// Where the point is that the right eye sees at (x, y), known to be `height_mm` above the floor,
/// or None if the ray never comes down to it.
pub fn point_on_plane(x_q4: u16, y_q4: u16, height_mm: i16) -> Option<GroundPoint> {
    let mut point = GroundPoint::default();
    // SAFETY: `point` is valid for writing.
    let found = unsafe { ffi::depth_on_plane(x_q4, y_q4, height_mm, &mut point) };
    (found != 0).then_some(point)
}
