//! `sot disparity`: a dense disparity map of two pictures.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::ValueEnum;
use common_sys::dense::{self, BmParams, Color, Map, Method, Params, Reference};
use image::{Rgb, RgbImage};
use serde::Serialize;

use crate::eyes::{MAX_SIDE, Pair, PairArgs};
use crate::output::{Usage, write_file, write_picture};

/// Dense disparity map of two pictures, as in the paper's simulation
///
/// For each pixel of the left eye: by how many pixels the same thing lies further right there than
/// in the right eye. The picture shows near things bright and pixels without a disparity black.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot disparity left.png right.png -o map.png
  sot disparity left.jpg right.jpg --size 320x240 --method sad --color rgb -o map.png --paper
  sot disparity left.png right.png -o map.png --method bm --left-right 1 --median --speckles 100
  sot disparity left.png right.png -o map.png --raw map.pfm --json | jq .density")]
pub struct Args {
    #[command(flatten)]
    pair: PairArgs,
    /// Where to write the map as a picture (PNG)
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,
    /// How blocks are compared
    #[arg(long, value_enum, default_value = "sad")]
    method: MethodArg,
    /// Width and height of a block in pixels, 1..32; 8 covers -4..+3 around its pixel. With bm odd,
    /// 5..21 [default: 8, with bm 9]
    #[arg(long, value_name = "N")]
    block: Option<u8>,
    /// Disparities 0..N-1 are searched, 1..256; with bm a multiple of 16
    #[arg(long, value_name = "N", default_value_t = 80)]
    disparities: u16,
    /// What of a pixel is compared; of colours the differences of all three parts are added
    #[arg(long, value_enum, default_value = "gray")]
    color: ColorArg,
    /// bm: refuse a pixel if its block's texture (sum of clipped gradients) is smaller; 0 = never
    #[arg(long, value_name = "SUM", help_heading = "Checks and filters")]
    texture: Option<u16>,
    /// bm: refuse a pixel if a rival is not worse by so much, 0..100; 0 = never
    #[arg(long, value_name = "PERCENT", help_heading = "Checks and filters",
        value_parser = clap::value_parser!(u8).range(0..=100))]
    uniqueness: Option<u8>,
    /// bm: where the pre-filter clips gradients, 1..63
    #[arg(long, value_name = "CAP", help_heading = "Checks and filters",
        value_parser = clap::value_parser!(u8).range(1..=63))]
    cap: Option<u8>,
    /// bm: refuse a pixel if the right eye's disparity differs by more than so many pixels
    #[arg(long, value_name = "PX", help_heading = "Checks and filters",
        value_parser = clap::value_parser!(i16).range(0..=255))]
    left_right: Option<i16>,
    /// Take away islands of at most so many pixels (neighbours within 1 px belong together)
    #[arg(long, value_name = "PIXELS", help_heading = "Checks and filters")]
    speckles: Option<u32>,
    /// Take the median of 3x3 pixels, before --speckles
    #[arg(long, help_heading = "Checks and filters")]
    median: bool,
    /// Scale both pictures first, e.g. 320x240, the robot's size
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Draw as in the paper: grey, near things dark, pixels without a disparity white
    #[arg(long)]
    paper: bool,
    /// Write the disparities too: PFM, pixels, infinity where there is none
    #[arg(long, value_name = "OUT.pfm")]
    raw: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Neighbours whose disparities differ by no more belong to one island: 1 px.
const SPECKLE_DIFFERENCE_Q4: u16 = 16;

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodArg {
    /// Sum of absolute differences
    Sad,
    /// Sum of squared differences
    Ssd,
    /// Normalised cross correlation
    Ncc,
    /// Equal to OpenCV's StereoBM bit for bit: pre-filter, SAD, texture and uniqueness checks,
    /// sub-pixel
    Bm,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ColorArg {
    /// Brightness
    Gray,
    /// Hue, saturation and value
    Hsv,
    /// Red, green and blue
    Rgb,
}

/// What `--json` prints. Disparities are in pixels, null if no pixel has one.
#[derive(Serialize)]
struct Summary {
    width: usize,
    height: usize,
    method: String,
    color: String,
    block: u8,
    disparities: u16,
    /// The share of pixels that have a disparity.
    density: f64,
    disparity_min: Option<f32>,
    disparity_median: Option<f32>,
    disparity_max: Option<f32>,
}

/// Run the verb.
pub fn run(args: &Args) -> Result<()> {
    let matching = args.matching()?;
    let mut pair = Pair::load(&args.pair)?;
    if let Some((width, height)) = args.size {
        pair = pair.resized(width, height);
    }
    let map = args.filter(matching.compute(&pair)?);

    write_picture(&args.output, picture(&map, args.disparities, args.paper))?;
    if let Some(raw) = &args.raw {
        write_file(raw, &pfm(&map)?)?;
    }
    let summary = Summary::new(args, matching.block(), &map);
    if args.json {
        println!("{}", serde_json::to_string(&summary)?);
    } else {
        summary.print(&args.output);
    }
    Ok(())
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let side = |part: &str| part.parse::<u32>().ok().filter(|side| (1..=MAX_SIDE).contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some((side(width)?, side(height)?)))
        .ok_or_else(|| format!("a size is WIDTHxHEIGHT, each 1..{MAX_SIDE}, such as 320x240"))
}

/// What is to be computed, with everything in range.
enum Matching {
    Paper(Params),
    Bm(BmParams),
}

impl Args {
    /// What is asked for, or what is wrong with it.
    fn matching(&self) -> Result<Matching> {
        if !(1..=dense::MAX_DISPARITIES).contains(&self.disparities) {
            bail!(Usage(format!(
                "--disparities {}: must be 1..{}",
                self.disparities,
                dense::MAX_DISPARITIES
            )));
        }
        let method = match self.method {
            MethodArg::Bm => return self.bm().map(Matching::Bm),
            MethodArg::Sad => Method::Sad,
            MethodArg::Ssd => Method::Ssd,
            MethodArg::Ncc => Method::Ncc,
        };
        let color = match self.color {
            ColorArg::Gray => Color::Grey,
            ColorArg::Hsv => Color::Hsv,
            ColorArg::Rgb => Color::Rgb,
        };
        if let Some(option) = self.given_for_bm() {
            bail!(Usage(format!("{option} is for --method bm only; leave it away")));
        }
        let block = self.block.unwrap_or(8);
        if !(1..=dense::MAX_BLOCK).contains(&block) {
            bail!(Usage(format!("--block {block}: must be 1..{}", dense::MAX_BLOCK)));
        }
        let disparities = self.disparities;
        Ok(Matching::Paper(Params {
            method,
            color,
            block,
            disparities,
            reference: Reference::Left,
        }))
    }

    fn bm(&self) -> Result<BmParams> {
        let block = self.block.unwrap_or(9);
        if !dense::BM_BLOCKS.contains(&block) || block.is_multiple_of(2) {
            bail!(Usage(format!(
                "--block {block}: with --method bm it must be odd, {}..{}",
                dense::BM_BLOCKS.start(),
                dense::BM_BLOCKS.end()
            )));
        }
        if !self.disparities.is_multiple_of(dense::BM_DISPARITY_STEP) {
            bail!(Usage(format!(
                "--disparities {}: with --method bm it must be a multiple of {}",
                self.disparities,
                dense::BM_DISPARITY_STEP
            )));
        }
        if self.color != ColorArg::Gray {
            bail!(Usage("--method bm compares brightness only; leave --color away".to_owned()));
        }
        let defaults = dense::bm_defaults(block, self.disparities);
        Ok(BmParams {
            texture_min: self.texture.unwrap_or(defaults.texture_min),
            uniqueness_percent: self.uniqueness.unwrap_or(defaults.uniqueness_percent),
            prefilter_cap: self.cap.unwrap_or(defaults.prefilter_cap),
            left_right_max: self.left_right.unwrap_or(defaults.left_right_max),
            ..defaults
        })
    }

    /// An option that only bm knows, if one is given.
    fn given_for_bm(&self) -> Option<&'static str> {
        let given = [
            ("--texture", self.texture.is_some()),
            ("--uniqueness", self.uniqueness.is_some()),
            ("--cap", self.cap.is_some()),
            ("--left-right", self.left_right.is_some()),
        ];
        given.into_iter().find_map(|(option, is_given)| is_given.then_some(option))
    }

    fn filter(&self, map: Map) -> Map {
        let map = if self.median { map.median() } else { map };
        match self.speckles {
            Some(pixels) => map.without_speckles(pixels, SPECKLE_DIFFERENCE_Q4),
            None => map,
        }
    }
}

impl Matching {
    fn block(&self) -> u8 {
        match self {
            Self::Paper(params) => params.block,
            Self::Bm(params) => params.block,
        }
    }

    fn compute(&self, pair: &Pair) -> Result<Map> {
        let (width, height) = pair.left.dimensions();
        let block = u32::from(self.block());
        // OpenCV wants more than one block.
        let least = if matches!(self, Self::Bm(_)) { block + 1 } else { block };
        if width < least || height < least {
            bail!(
                "the pictures have {width}x{height} pixels, blocks of {block}x{block} need \
                 {least}x{least}; take larger pictures or a smaller --block"
            );
        }
        let pair = dense::Pair {
            left: pair.left.as_raw(),
            right: pair.right.as_raw(),
            width: width as usize,
            height: height as usize,
        };
        Ok(match self {
            Self::Paper(params) => dense::map(&pair, params)?,
            Self::Bm(params) => dense::block_match(&pair, params)?,
        })
    }
}

/// The map as a picture. The scale is that of the search range, so that maps can be compared.
fn picture(map: &Map, disparities: u16, paper: bool) -> RgbImage {
    let range = f64::from(disparities.max(2) - 1);
    let color = |disparity: Option<f32>| match disparity.map(|d| f64::from(d) / range) {
        Some(near) if paper => Rgb([(230.0 * (1.0 - near)) as u8; 3]),
        None if paper => Rgb([255; 3]),
        // Not from the scale's dark end: what is far must not look like what is unknown.
        Some(near) => {
            Rgb(colorous::INFERNO.eval_continuous(0.15 + 0.85 * near.min(1.0)).into_array())
        }
        None => Rgb([0; 3]),
    };
    let mut picture = RgbImage::new(map.width as u32, map.height as u32);
    for (pixel, disparity) in picture.pixels_mut().zip(map.pixels()) {
        *pixel = color(disparity);
    }
    picture
}

/// Portable float map: a text header, then the rows from the bottom up; the minus sign of the
/// scale says little-endian.
fn pfm(map: &Map) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    writeln!(bytes, "Pf\n{} {}\n-1.0", map.width, map.height)?;
    let pixels: Vec<f32> = map.pixels().map(|d| d.unwrap_or(f32::INFINITY)).collect();
    for row in pixels.chunks_exact(map.width).rev() {
        bytes.extend(row.iter().flat_map(|d| d.to_le_bytes()));
    }
    Ok(bytes)
}

impl Summary {
    fn new(args: &Args, block: u8, map: &Map) -> Self {
        let name = |value: Option<clap::builder::PossibleValue>| {
            value.map_or_else(String::new, |value| value.get_name().to_owned())
        };
        let mut found: Vec<f32> = map.pixels().flatten().collect();
        found.sort_unstable_by(f32::total_cmp);
        Self {
            width: map.width,
            height: map.height,
            method: name(args.method.to_possible_value()),
            color: name(args.color.to_possible_value()),
            block,
            disparities: args.disparities,
            density: found.len() as f64 / map.disparity_q4.len() as f64,
            disparity_min: found.first().copied(),
            disparity_median: found.get(found.len() / 2).copied(),
            disparity_max: found.last().copied(),
        }
    }

    fn print(&self, output: &Path) {
        println!(
            "{}: {}x{}, {} of {} disparities, block {}, {}",
            output.display(),
            self.width,
            self.height,
            self.method,
            self.disparities,
            self.block,
            self.color
        );
        match (self.disparity_min, self.disparity_median, self.disparity_max) {
            (Some(min), Some(median), Some(max)) => println!(
                "{:.1} % of the pixels have a disparity: {min} .. {max} px, median {median} px",
                self.density * 100.0
            ),
            _ => println!("no pixel has a disparity"),
        }
    }
}
