//! `sot detect`: the robot's own detectors on one pair of pictures.

use anyhow::Result;
use common_sys::constants as c;
use common_sys::link::{Report, registers};
use common_sys::vision::{self, EyeParams, HEIGHT, WIDTH};
use serde::Serialize;

use crate::eyes::{Pair, PairArgs, rgb565};
use crate::fpga_reg::{name_of, named, parse_value};
use crate::output::Usage;

/// What the robot sees in one stereo pair: ball, goal, opponent and wall
///
/// Runs the same kernels as the robot's FPGA on the RGB565 of two pictures; pictures of another size
/// than the robot's 320x240 are scaled to it first. All coordinates are pixels of the right picture, disparities are x_left - x_right in pixels, ranges
/// are millimetres along the floor from below the right lens.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot detect left.png right.png
  sot detect left.png right.png --json | jq .ball.range_mm
  sot detect left.png right.png --set goal-row=61 --set yellow-margin=40
  sot fpga reg                  lists the names, what they take, and what they are by default")]
pub struct Args {
    #[command(flatten)]
    pair: PairArgs,
    /// A parameter of the detectors, as `sot fpga reg` names it; may be given again
    #[arg(long = "set", value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
pub struct Detection {
    ball: Option<Ball>,
    goal: Option<Goal>,
    opponent: Option<Opponent>,
    /// Rows of the wall's foot in columns 40, 160 and 280.
    wall: [Option<u8>; 3],
}

#[derive(Serialize)]
struct Ball {
    /// Centre in the right picture; null when only the left eye sees it.
    x_right: Option<f64>,
    /// Centre in the left picture; null when only the right eye sees it.
    x_left: Option<f64>,
    y: u8,
    width: u8,
    disparity: Option<f64>,
    range_mm: Option<f64>,
    clipped: bool,
    seen: &'static str,
    confidence: f64,
}

#[derive(Serialize)]
struct Goal {
    x_left_edge: Option<f64>,
    x_right_edge: Option<f64>,
    d_left: Option<f64>,
    d_right: Option<f64>,
    range_mm: Option<f64>,
    confidence: f64,
}

#[derive(Serialize)]
struct Opponent {
    x: f64,
    disparity: Option<f64>,
    range_mm: Option<f64>,
    confidence: f64,
}

/// Run the verb.
pub fn run(args: &Args) -> Result<()> {
    let params = params(&args.set)?;
    let pair = Pair::load(&args.pair)?;
    let size = pair.left.dimensions();
    if size != (WIDTH as u32, HEIGHT as u32) {
        eprintln!(
            "sot: scaled from {}x{} to the robot's {WIDTH}x{HEIGHT}; all coordinates are of that size",
            size.0, size.1
        );
    }
    let pair = pair.resized(WIDTH as u32, HEIGHT as u32);
    let report = vision::detect(&rgb565(&pair.left), &rgb565(&pair.right), &params);
    let detection = Detection::from_report(&report, &params);
    if args.json {
        println!("{}", serde_json::to_string(&detection)?);
    } else {
        print_for_people(&detection);
    }
    Ok(())
}

/// The parameters as they are by default, but for those that are set.
fn params(set: &[String]) -> Result<EyeParams> {
    let mut bytes = EyeParams::usual().to_bytes();
    for setting in set {
        let Some((name, value)) = setting.split_once('=') else {
            return Err(Usage(format!("\"{setting}\" sets nothing; give NAME=VALUE")).into());
        };
        let mut parameters = registers().iter().filter(|register| register.is_param);
        let place = named(name).and_then(|register| parameters.position(|one| one == register));
        let (Some(place), Some(register)) = (place, named(name)) else {
            let names: Vec<_> =
                registers().iter().filter(|one| one.is_param).map(name_of).collect();
            return Err(Usage(format!(
                "\"{name}\" is no parameter of the detectors; they are {}",
                names.join(", ")
            ))
            .into());
        };
        let (low, high) = register.range.unwrap_or_default();
        let value = parse_value(value)?;
        match u8::try_from(value) {
            Ok(byte) if (low..=high).contains(&value) => bytes[place] = byte,
            _ => return Err(Usage(format!("{name} takes {low} to {high}, not {value}")).into()),
        }
    }
    Ok(EyeParams::from_bytes(&bytes))
}

fn q4(value: u16) -> f64 {
    f64::from(value) / 16.0
}

/// A disparity of 0 in a report means that there is none.
fn disparity(value_q4: u16) -> Option<f64> {
    (value_q4 != 0).then(|| q4(value_q4))
}

/// Range along the floor from below the right lens to what it sees at (x, row).
fn range_mm(x_q4: u16, row: u16, disparity_q4: u16) -> Option<f64> {
    let point = vision::ground_point(x_q4, row * 16, disparity_q4)?;
    let lens_left_mm = -f64::from(c::CAMERA_RIGHT_LENS_MM_Q4) / 16.0;
    Some(f64::from(point.forward_mm).hypot(f64::from(point.left_mm) - lens_left_mm))
}

impl Detection {
    /// What a report says, in pixels and millimetres.
    pub fn from_report(report: &Report, params: &EyeParams) -> Self {
        let has = |flag: u32| u32::from(report.flags) & flag != 0;
        Self {
            ball: has(c::REPORT_BALL).then(|| Ball::from_report(report)),
            goal: (has(c::REPORT_GOAL_LEFT_EDGE) || has(c::REPORT_GOAL_RIGHT_EDGE))
                .then(|| Goal::from_report(report, params.goal_row)),
            opponent: has(c::REPORT_OPPONENT)
                .then(|| Opponent::from_report(report, params.opponent_row)),
            wall: report.wall_row.map(|row| (has(c::REPORT_WALL) && row != 0).then_some(row)),
        }
    }
}

impl Ball {
    fn from_report(report: &Report) -> Self {
        let has = |flag: u32| u32::from(report.flags) & flag != 0;
        let seen = match (has(c::REPORT_BALL_RIGHT_ONLY), has(c::REPORT_BALL_LEFT_ONLY)) {
            (true, _) => "right",
            (_, true) => "left",
            _ => "both",
        };
        let disparity = disparity(report.ball_disparity_q4);
        let x = q4(report.ball_x_q4);
        Self {
            x_right: (seen != "left").then_some(x),
            x_left: match seen {
                "left" => Some(x),
                _ => disparity.map(|d| x + d),
            },
            y: report.ball_row,
            width: report.ball_width_px,
            disparity,
            range_mm: range_mm(
                report.ball_x_q4,
                u16::from(report.ball_row),
                report.ball_disparity_q4,
            ),
            clipped: has(c::REPORT_BALL_CLIPPED),
            seen,
            confidence: f64::from(report.ball_confidence) / 255.0,
        }
    }
}

impl Goal {
    fn from_report(report: &Report, row: u8) -> Self {
        let edge = |side: usize, flag: u32| {
            (u32::from(report.flags) & flag != 0)
                .then(|| (report.goal_x_q4[side], report.goal_disparity_q4[side]))
        };
        let edges = [edge(0, c::REPORT_GOAL_LEFT_EDGE), edge(1, c::REPORT_GOAL_RIGHT_EDGE)];
        let ranges: Vec<f64> =
            edges.iter().flatten().filter_map(|&(x, d)| range_mm(x, u16::from(row), d)).collect();
        Self {
            x_left_edge: edges[0].map(|(x, _)| q4(x)),
            x_right_edge: edges[1].map(|(x, _)| q4(x)),
            d_left: edges[0].and_then(|(_, d)| disparity(d)),
            d_right: edges[1].and_then(|(_, d)| disparity(d)),
            range_mm: (!ranges.is_empty())
                .then(|| ranges.iter().sum::<f64>() / ranges.len() as f64),
            confidence: f64::from(report.goal_confidence) / 15.0,
        }
    }
}

impl Opponent {
    fn from_report(report: &Report, row: u8) -> Self {
        let surface = range_mm(report.opponent_x_q4, u16::from(row), report.opponent_disparity_q4);
        Self {
            x: q4(report.opponent_x_q4),
            disparity: disparity(report.opponent_disparity_q4),
            // The stripes match on the surface; the axis is a radius behind it.
            range_mm: surface.map(|mm| mm + f64::from(c::OPPONENT_RADIUS_MM)),
            confidence: f64::from(report.opponent_confidence) / 15.0,
        }
    }
}

fn print_for_people(detection: &Detection) {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.1}"));
    match &detection.ball {
        Some(ball) => println!(
            "ball      x {} row {} d {} px, {} mm, seen by {}{}, confidence {:.0} %",
            number(ball.x_right.or(ball.x_left)),
            ball.y,
            number(ball.disparity),
            number(ball.range_mm),
            ball.seen,
            if ball.clipped { ", nearer than the search range" } else { "" },
            ball.confidence * 100.0
        ),
        None => println!("ball      not seen"),
    }
    match &detection.goal {
        Some(goal) => println!(
            "goal      edges x {} .. {}, d {} and {} px, {} mm, confidence {:.0} %",
            number(goal.x_left_edge),
            number(goal.x_right_edge),
            number(goal.d_left),
            number(goal.d_right),
            number(goal.range_mm),
            goal.confidence * 100.0
        ),
        None => println!("goal      not seen"),
    }
    match &detection.opponent {
        Some(opponent) => println!(
            "opponent  x {:.1} d {} px, {} mm, confidence {:.0} %",
            opponent.x,
            number(opponent.disparity),
            number(opponent.range_mm),
            opponent.confidence * 100.0
        ),
        None => println!("opponent  not seen"),
    }
    let rows: Vec<String> = detection
        .wall
        .iter()
        .map(|row| row.map_or("-".to_owned(), |row| row.to_string()))
        .collect();
    println!("wall      foot in rows {}", rows.join(", "));
}
