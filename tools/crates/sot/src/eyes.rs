//! Reading a stereo pair from picture files.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use common_sys::vision;
use image::{ImageReader, RgbImage, imageops::FilterType};

use crate::output::read_file;

/// The largest picture taken, in each direction.
pub const MAX_SIDE: u32 = 4096;

/// Where the two pictures of a pair are.
#[derive(clap::Args)]
pub struct PairArgs {
    /// Picture of the left eye: PNG, JPEG, PGM or PPM, up to 4096x4096
    pub left: PathBuf,
    /// Picture of the right eye, of the same size
    pub right: PathBuf,
}

/// Both eyes, equal in size.
pub struct Pair {
    pub left: RgbImage,
    pub right: RgbImage,
}

impl Pair {
    /// Read and check both pictures.
    pub fn load(args: &PairArgs) -> Result<Self> {
        let left = load(&args.left)?;
        let right = load(&args.right)?;
        if left.dimensions() != right.dimensions() {
            bail!(
                "the eyes differ in size: {} is {}x{}, {} is {}x{}; give two pictures of one pair",
                args.left.display(),
                left.width(),
                left.height(),
                args.right.display(),
                right.width(),
                right.height()
            );
        }
        Ok(Self { left, right })
    }

    /// Both eyes at `width` x `height`, averaged down or interpolated up.
    pub fn resized(self, width: u32, height: u32) -> Self {
        if self.left.dimensions() == (width, height) {
            return self;
        }
        let scale =
            |eye: &RgbImage| image::imageops::resize(eye, width, height, FilterType::Triangle);
        Self { left: scale(&self.left), right: scale(&self.right) }
    }
}

fn load(path: &Path) -> Result<RgbImage> {
    let bytes = read_file(path)?;
    let mut reader = ImageReader::new(Cursor::new(&bytes))
        .with_guessed_format()
        .with_context(|| format!("cannot read {}", path.display()))?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    reader.limits(limits);
    let picture = reader.decode().with_context(|| {
        format!(
            "{} is no picture that can be read (PNG, JPEG, PGM or PPM up to {MAX_SIDE}x{MAX_SIDE})",
            path.display()
        )
    })?;
    // The PNM reader does not know the limits.
    if picture.width() == 0 || picture.width() > MAX_SIDE || picture.height() > MAX_SIDE {
        bail!(
            "{} is {}x{}; the largest picture taken is {MAX_SIDE}x{MAX_SIDE}",
            path.display(),
            picture.width(),
            picture.height()
        );
    }
    Ok(picture.to_rgb8())
}

/// The picture as the robot's cameras give it: RGB565, row by row.
pub fn rgb565(picture: &RgbImage) -> Vec<u16> {
    picture.pixels().map(|p| vision::rgb565(p[0], p[1], p[2])).collect()
}
