//! `sot play`: a match on the twin.

use std::env;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::{ArgAction, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use sim::{MS, Ps, SECOND};
use twin::game::{Fpga, Game, Setup, Summary};
use twin::robot::Images;
use virtex::bitstream;
use virtex::design::Function;
use virtex::store;

use crate::output::{read_file, write_picture};

/// A match on the twin: the firmware images just built, an emulated robot, a simulated pitch
///
/// The seed draws where ball and robots stand and how our robot is turned. The referee types its
/// heading on the robot's serial console, as a handler would, and from then on it plays alone. The
/// match ends with the first goal, or when the time is over. Without --headless a bar shows how it
/// stands, and a picture of it is written.
#[derive(clap::Args)]
#[command(after_help = "\
Exit code 0 if the match was played, goal or not.

Examples:
  sot play                                   a match, a bar, a picture
  sot play --headless --seed 7 --json        for scripts; the last line is one JSON object
  sot play --eyes black                      what it is worth without eyes
  sot play --flash flash.img                 with a flash image from `sot bitstream pack`")]
pub struct Args {
    /// Which match: the same seed gives the same match on any machine
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Simulated seconds after which the match ends
    #[arg(long, default_value_t = 60.0, value_parser = parse_seconds)]
    seconds: f64,
    /// No bar, and no picture unless --picture asks for it
    #[arg(long)]
    headless: bool,
    /// The other robot
    #[arg(long, value_enum, default_value_t = Opponent::Idle)]
    opponent: Opponent,
    /// How far the cameras are from perfect
    #[arg(long, value_enum, default_value_t = Noise::None)]
    noise: Noise,
    /// The turret's flash image [default: one with the soccer bitstream in slot 0]
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Write a picture of the match, PNG [default: match.png, with --headless none]
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
    /// What the cameras deliver
    #[arg(long, value_enum, default_value_t = Eyes::Open)]
    eyes: Eyes,
    /// Colour of the ball
    #[arg(long, value_enum, default_value_t = Ball::Yellow)]
    ball: Ball,
    /// The turret's program [default: the one just built]
    #[arg(long, value_name = "FILE.ihx")]
    fx2_image: Option<PathBuf>,
    /// The base's program, ELF or S37 [default: the one just built]
    #[arg(long, value_name = "FILE")]
    khepera_image: Option<PathBuf>,
    /// Print what is said on the serial line, to standard error
    #[arg(long)]
    serial: bool,
    /// End with one JSON object
    #[arg(long, action = ArgAction::SetTrue)]
    json: bool,
}

/// Who plays on the other side.
#[derive(Clone, Copy, ValueEnum)]
enum Opponent {
    /// Stands where the seed puts it
    Idle,
}

/// Noise levels.
#[derive(Clone, Copy, ValueEnum)]
enum Noise {
    /// Perfect cameras and motors
    None,
    /// Cameras with noise, blur, vignetting and slightly unequal eyes; perfect motors
    Measured,
    /// Half the light, twice the noise, eyes that differ in gain and rows; perfect motors
    Harsh,
}

/// What the cameras deliver.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Eyes {
    /// What is before them
    Open,
    /// Black pictures
    Black,
}

/// Colours of the ball.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Ball {
    /// As the league plays
    Yellow,
    /// One that the robot must not find
    Pink,
}

/// The longest match: an hour.
const SECONDS_MAX: f64 = 3600.0;

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= SECONDS_MAX => Ok(seconds),
        _ => Err(format!("write simulated seconds, more than 0 and at most {SECONDS_MAX}")),
    }
}

/// Run the verb.
pub fn run(args: &Args) -> Result<()> {
    let setup = Setup {
        seed: args.seed,
        images: load_images(args)?,
        eyes: match args.eyes {
            Eyes::Open => twin::game::Eyes::Open,
            Eyes::Black => twin::game::Eyes::Black,
        },
        ball: match args.ball {
            Ball::Yellow => twin::game::BallColour::Yellow,
            Ball::Pink => twin::game::BallColour::Pink,
        },
        noise: match args.noise {
            Noise::None => twin::game::Noise::None,
            Noise::Measured => twin::game::Noise::Measured,
            Noise::Harsh => twin::game::Noise::Harsh,
        },
        end: (args.seconds * SECOND as f64) as Ps,
    };
    let mut game = Game::new(setup)?;

    let started = Instant::now();
    watch(&mut game, args);
    let host_seconds = started.elapsed().as_secs_f64();
    let summary = game.summary();

    let picture = match (&args.picture, args.headless) {
        (Some(path), _) => Some(path.clone()),
        (None, false) => Some(PathBuf::from("match.png")),
        (None, true) => None,
    };
    let factor = summary.time as f64 / SECOND as f64 / host_seconds;
    if args.json {
        println!("{}", as_json(args.seed, &summary, factor));
    } else {
        print_summary(args, &summary, factor);
    }
    // After the summary: a folder that is not there must not cost the match.
    if let Some(path) = &picture {
        write_picture(path, game.picture())?;
        if !args.json {
            println!("picture   {}", path.display());
        }
    }
    Ok(())
}

/// Play to the end, showing on a terminal how it stands.
fn watch(game: &mut Game, args: &Args) {
    let bar = ProgressBar::new(game.end() / MS);
    let shown = !args.headless && std::io::stderr().is_terminal();
    bar.set_draw_target(if shown {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    });
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {msg}").expect("the template is constant and right"),
    );
    while !game.over() {
        game.run_for(100 * MS);
        bar.set_position(game.now() / MS);
        bar.set_message(format!(
            "{:.1} s simulated, {}",
            game.now() as f64 / SECOND as f64,
            game.headline()
        ));
        for line in game.take_serial_lines() {
            if args.serial {
                bar.suspend(|| eprintln!("{line}"));
            }
        }
    }
    bar.finish_and_clear();
}

fn as_json(seed: u64, summary: &Summary, factor: f64) -> serde_json::Value {
    json!({
        "seed": seed,
        "goals_for": summary.goals_for,
        "goals_against": summary.goals_against,
        "sim_seconds": summary.time as f64 / SECOND as f64,
        "realtime_factor": factor,
        "trace_hash": format!("{:016x}", summary.trace_hash),
        "frames": summary.frames,
        "reports": summary.reports,
        "cpu_load": summary.cpu_load,
        "fpga": {
            "configured": summary.fpga.configured,
            "function": summary.fpga.function,
            "slot": summary.fpga.slot,
            "bytes": summary.fpga.bytes,
            "time_ms": summary.fpga.time_us.map(|us| f64::from(us) / 1000.0),
            "why": summary.fpga.why,
        },
    })
}

fn print_summary(args: &Args, summary: &Summary, factor: f64) {
    let seconds = summary.time as f64 / SECOND as f64;
    let verdict = match (summary.goals_for, summary.goals_against) {
        (0, 0) => "no goal".to_owned(),
        (1, 0) => format!("GOAL after {seconds:.1} s"),
        (0, 1) => format!("own goal after {seconds:.1} s"),
        (ours, theirs) => format!("{ours} : {theirs}"),
    };
    println!("match {}   {verdict}", args.seed);
    println!("FPGA      {}", fpga_in_words(&summary.fpga));
    println!(
        "eyes      {} frame pairs, {} reports taken by the base; ball in {}, goal in {}, opponent in {}",
        summary.frames, summary.reports, summary.saw_ball, summary.saw_goal, summary.saw_opponent
    );
    println!(
        "base      68331 {:.0} % busy (approximate: see docs/DESIGN.md)",
        summary.cpu_load * 100.0
    );
    println!(
        "twin      {seconds:.1} s simulated, {factor:.1} times as fast as real time, trace {:016x}",
        summary.trace_hash
    );
}

fn fpga_in_words(fpga: &Fpga) -> String {
    let slot = fpga.slot.map_or("no slot".to_owned(), |slot| format!("slot {slot}"));
    match (&fpga.why, fpga.function) {
        (Some(why), _) => format!("NOT CONFIGURED ({slot}): {why}"),
        (None, Some(function)) => format!(
            "{function} from {slot}, {} bytes, done {:.1} ms after the 8051's start",
            fpga.bytes,
            f64::from(fpga.time_us.unwrap_or(0)) / 1000.0
        ),
        (None, None) => format!("configured from {slot}, with a function the twin does not know"),
    }
}

/// Both firmware images and the flash.
fn load_images(args: &Args) -> Result<Images> {
    let flash = match &args.flash {
        Some(path) => read_file(path)?,
        None => default_flash()?,
    };
    Ok(Images {
        fx2: read_image(args.fx2_image.as_deref(), "fx2-firmware/fx2-firmware.ihx")?,
        khepera: read_image(args.khepera_image.as_deref(), KHEPERA_IMAGE)?,
        flash,
    })
}

/// The flash of a robot as it leaves the workshop: the soccer bitstream in slot 0.
fn default_flash() -> Result<Vec<u8>> {
    let stream = bitstream::make(Function::Soccer, &bitstream::Options::default());
    let entry = store::Entry::from_file(0, &stream, Function::Soccer.name().to_owned())?;
    Ok(store::pack(&[entry], 0))
}

fn read_image(given: Option<&Path>, built: &str) -> Result<Vec<u8>> {
    match given {
        Some(path) => read_file(path),
        None => read_file(&built_image(built)?),
    }
}

/// The base's program in the build folder.
pub const KHEPERA_IMAGE: &str = "khepera-firmware/khepera-firmware.elf";

/// A firmware image as built from this tree.
pub fn built_image(image: &str) -> Result<PathBuf> {
    let path = build_folder()?.join(image);
    if path.is_file() {
        Ok(path)
    } else {
        bail!("{} is not built yet; tools/play builds it", path.display())
    }
}

/// Where CMake's `firmware` preset builds: `build/firmware` at the top of the tree this program was
/// built in. The variable STEREOSOT_FIRMWARE names another place.
fn build_folder() -> Result<PathBuf> {
    if let Some(folder) = env::var_os("STEREOSOT_FIRMWARE") {
        return Ok(PathBuf::from(folder));
    }
    let exe = env::current_exe().context("cannot tell where this program is")?;
    exe.ancestors()
        .map(|folder| folder.join("build/firmware"))
        .find(|folder| folder.is_dir())
        .context("the firmware images are not built yet; tools/play builds them")
}
