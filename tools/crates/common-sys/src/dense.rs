//! `common/vision`'s dense disparity maps of whole pictures.

#![allow(unsafe_code)] // calls into C; each with the lengths the header asks for

use core::ptr;

use crate::ffi;

/// How two blocks are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Sum of absolute differences.
    Sad,
    /// Sum of squared differences.
    Ssd,
    /// Cross correlation divided by the energy of both blocks.
    Ncc,
}

/// What of a pixel is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Color {
    /// Brightness.
    Grey,
    /// Red, green and blue, added up.
    Rgb,
    /// Hue (the shorter way round), saturation and value, added up.
    Hsv,
}

impl Color {
    const fn to_c(self) -> ffi::dense_color_t {
        match self {
            Self::Grey => ffi::dense_color_t_DENSE_GREY,
            Self::Rgb => ffi::dense_color_t_DENSE_RGB,
            Self::Hsv => ffi::dense_color_t_DENSE_HSV,
        }
    }

    const fn planes(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::Rgb | Self::Hsv => 3,
        }
    }
}

/// The eye whose pixels the map belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The left eye, as OpenCV has it.
    Left,
    /// The right eye, as the robot has it.
    Right,
}

/// The paper's block matching.
#[derive(Clone, Copy, Debug)]
pub struct Params {
    /// How two blocks are compared.
    pub method: Method,
    /// What of a pixel is compared.
    pub color: Color,
    /// Width and height of a block, 1..=[`MAX_BLOCK`].
    pub block: u8,
    /// 0..disparities are searched; 1..=[`MAX_DISPARITIES`].
    pub disparities: u16,
    /// The eye whose pixels the map belongs to.
    pub reference: Reference,
}

/// Block matching equal to OpenCV's `cv::StereoBM`, on grey, for the left eye. The fields are
/// described in `common/vision/dense_bm.h`.
pub use ffi::bm_params_t as BmParams;

/// The parameters that OpenCV starts with.
pub fn bm_defaults(block: u8, disparities: u16) -> BmParams {
    // SAFETY: a pure function of its arguments.
    unsafe { ffi::bm_defaults(block, disparities) }
}

/// Blocks of [`block_match`]: odd numbers in this range.
pub const BM_BLOCKS: core::ops::RangeInclusive<u8> =
    ffi::BM_MIN_BLOCK as u8..=ffi::BM_MAX_BLOCK as u8;
/// Disparities of [`block_match`] are a multiple of this.
pub const BM_DISPARITY_STEP: u16 = ffi::BM_DISPARITY_STEP as u16;

/// The largest block.
pub const MAX_BLOCK: u8 = ffi::MATCH_MAX_BLOCK as u8;
/// The largest number of disparities.
pub const MAX_DISPARITIES: u16 = ffi::DENSE_MAX_DISPARITIES as u16;
/// The longest side of a picture.
pub const MAX_SIDE: usize = ffi::DENSE_MAX_SIDE as usize;

/// Both eyes of a stereo pair: red, green, blue bytes, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// `width * height * 3` bytes of the left eye.
    pub left: &'a [u8],
    /// As many of the right eye.
    pub right: &'a [u8],
    /// Pixels of a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Why there is no map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// See the limits in [`Params`] and [`MAX_SIDE`].
    #[error("a parameter or the size of the pictures is out of range")]
    OutOfRange,
    /// No block fits into the picture.
    #[error("no block fits into the pictures; take larger ones or a smaller block")]
    TooSmall,
}

/// A disparity for each pixel of the reference eye.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Map {
    /// Pixels of a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row from the top, in 1/16 px; [`INVALID_Q4`] where there is none.
    pub disparity_q4: Vec<i16>,
}

/// Says in a [`Map`] that a pixel has no disparity.
pub const INVALID_Q4: i16 = ffi::DENSE_INVALID_Q4 as i16;

impl Map {
    fn empty(pair: &Pair) -> Self {
        Self {
            width: pair.width,
            height: pair.height,
            disparity_q4: vec![INVALID_Q4; pair.width * pair.height],
        }
    }

    /// Without islands of at most `max_pixels` pixels; neighbours belong together if their disparities
    /// differ by at most `max_difference_q4`. Equal to cv::filterSpeckles.
    #[must_use]
    pub fn without_speckles(mut self, max_pixels: u32, max_difference_q4: u16) -> Self {
        let (width, height) = (self.width as u16, self.height as u16);
        let mut work = vec![0_u32; self.disparity_q4.len()];
        // SAFETY: map and work hold `width * height` words; `check` saw that both fit u16.
        unsafe {
            ffi::dense_speckles(
                self.disparity_q4.as_mut_ptr(),
                width,
                height,
                width,
                max_pixels,
                max_difference_q4,
                work.as_mut_ptr(),
            );
        }
        self
    }

    /// The median of 3x3 pixels. Equal to cv::medianBlur.
    #[must_use]
    pub fn median(&self) -> Self {
        let (width, height) = (self.width as u16, self.height as u16);
        let mut out = self.clone();
        // SAFETY: both maps hold `width * height` words and do not overlap.
        unsafe {
            let to = out.disparity_q4.as_mut_ptr();
            ffi::dense_median(self.disparity_q4.as_ptr(), width, height, width, to, width);
        }
        out
    }

    /// Disparities in pixels, row by row from the top.
    pub fn pixels(&self) -> impl Iterator<Item = Option<f32>> {
        self.disparity_q4.iter().map(|&d| (d >= 0).then(|| f32::from(d) / 16.0))
    }
}

/// The planes of one eye in one piece, `width * height` bytes each.
struct Planes {
    bytes: Vec<u8>,
    size: usize,
}

impl Planes {
    fn new(rgb: &[u8], size: usize, color: Color) -> Self {
        let mut bytes = vec![0; size * color.planes()];
        let mut pointers = [ptr::null_mut(); ffi::DENSE_MAX_PLANES as usize];
        for (pointer, plane) in pointers.iter_mut().zip(bytes.chunks_exact_mut(size)) {
            *pointer = plane.as_mut_ptr();
        }
        // SAFETY: `rgb` holds `size` pixels, and each plane that the colour has `size` bytes.
        unsafe { ffi::dense_planes(rgb.as_ptr(), size as u32, color.to_c(), pointers.as_ptr()) };
        Self { bytes, size }
    }

    fn eye(&self, pair: &Pair) -> ffi::dense_eye_t {
        let mut planes = [ptr::null(); ffi::DENSE_MAX_PLANES as usize];
        for (pointer, plane) in planes.iter_mut().zip(self.bytes.chunks_exact(self.size)) {
            *pointer = plane.as_ptr();
        }
        let width = pair.width as u16;
        ffi::dense_eye_t { planes, width, height: pair.height as u16, stride: width }
    }
}

/// Check what the C side cannot see: how long the slices are.
fn check(pair: &Pair) -> Result<usize, Error> {
    let side = 1..=MAX_SIDE;
    if !side.contains(&pair.width) || !side.contains(&pair.height) {
        return Err(Error::OutOfRange);
    }
    let size = pair.width * pair.height;
    if pair.left.len() != 3 * size || pair.right.len() != 3 * size {
        return Err(Error::OutOfRange);
    }
    Ok(size)
}

fn result(code: ffi::dense_error_t) -> Result<(), Error> {
    match code {
        ffi::dense_error_t_DENSE_OK => Ok(()),
        ffi::dense_error_t_DENSE_TOO_SMALL => Err(Error::TooSmall),
        _ => Err(Error::OutOfRange),
    }
}

/// The dense map of the paper's simulation, in whole pixels.
pub fn map(pair: &Pair, params: &Params) -> Result<Map, Error> {
    let size = check(pair)?;
    let c_params = ffi::dense_params_t {
        method: match params.method {
            Method::Sad => ffi::match_method_t_MATCH_SAD,
            Method::Ssd => ffi::match_method_t_MATCH_SSD,
            Method::Ncc => ffi::match_method_t_MATCH_NCC,
        },
        planes: params.color.planes() as u8,
        hue_first: u8::from(params.color == Color::Hsv),
        block: params.block,
        disparities: params.disparities,
        reference_is_right: u8::from(params.reference == Reference::Right),
    };
    // SAFETY: a pure function of its arguments.
    let words = unsafe { ffi::dense_work_words(pair.width as u16, &c_params) };
    if words == 0 {
        return Err(Error::OutOfRange);
    }
    let left = Planes::new(pair.left, size, params.color);
    let right = Planes::new(pair.right, size, params.color);
    let mut work = vec![0u32; words as usize];
    let mut map = Map::empty(pair);
    // SAFETY: the planes have the size that `eye` says, `work` the words, and the map a disparity
    // for each pixel.
    result(unsafe {
        ffi::dense_map(
            &left.eye(pair),
            &right.eye(pair),
            &c_params,
            work.as_mut_ptr(),
            words,
            map.disparity_q4.as_mut_ptr(),
            pair.width as u16,
        )
    })?;
    Ok(map)
}

/// The dense map of block matching, in 1/16 px. The pictures must be larger than a block.
pub fn block_match(pair: &Pair, params: &BmParams) -> Result<Map, Error> {
    let size = check(pair)?;
    let (width, height) = (pair.width as u16, pair.height as u16);
    // SAFETY: a pure function of its arguments.
    let words = unsafe { ffi::bm_work_words(width, height, params) };
    if words == 0 {
        return Err(Error::OutOfRange);
    }
    let left = Planes::new(pair.left, size, Color::Grey);
    let right = Planes::new(pair.right, size, Color::Grey);
    let mut work = vec![0u32; words as usize];
    let mut map = Map::empty(pair);
    // SAFETY: the planes have the size that `eye` says, `work` the words, and the map a disparity
    // for each pixel.
    result(unsafe {
        ffi::bm_map(
            &left.eye(pair),
            &right.eye(pair),
            params,
            work.as_mut_ptr(),
            words,
            map.disparity_q4.as_mut_ptr(),
            width,
        )
    })?;
    Ok(map)
}
