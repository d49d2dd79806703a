//! `sot play`: a match on the twin.

mod series;
mod stats;

use std::env;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::{ArgAction, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use sim::{MS, Ps, SECOND};
use twin::game::{Event, Format, Fpga, Game, Materials, Other, Setup, Summary};
use twin::robot::Images;
use virtex::bitstream;
use virtex::design::Function;
use virtex::store;
use world::opponents::Kind;

use crate::output::{Usage, read_file, write_picture};

/// A match on the twin: the firmware images just built, an emulated robot, a simulated pitch
///
/// The seed draws where ball and robots stand and how they are turned. A handler types a robot's
/// heading on its serial console, and from then on it plays alone; after a goal it is stopped, put
/// to a new place and started again. Without --headless a bar shows how it stands, and a picture of
/// it is written.
#[derive(clap::Args)]
#[command(after_help = "\
Exit code 0 if the match was played, goal or not.

Examples:
  sot play                                   a match, a bar, a picture
  sot play --headless --seed 7 --json        for scripts; the last line is one JSON object
  sot play --opponent chaser --noise measured   somebody who runs for the ball; cameras as they are
  sot play --opponent self --format league --seconds 600   our robot against itself, a whole match
  sot play --opponent self --opponent-image other.elf      ... against another strategy
  sot play --matches 100 --noise measured --jobs 2 --csv kick-offs.csv   statistics
  sot play --eyes black                      what it is worth without eyes
  sot play --flash flash.img                 with a flash image from `sot bitstream pack`")]
pub struct Args {
    /// Which match: the same seed gives the same match on any machine
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Simulated seconds of the match, from switching the robots on
    #[arg(long, default_value_t = 60.0, value_parser = parse_seconds)]
    seconds: f64,
    /// No bar, and no picture unless --picture asks for it
    #[arg(long)]
    headless: bool,
    /// The other robot
    #[arg(long, value_enum, default_value_t = Opponent::Idle)]
    opponent: Opponent,
    /// What ends the match [default: the first goal against `idle`, else the time]
    #[arg(long, value_enum)]
    end: Option<End>,
    /// How the time is divided
    #[arg(long, value_enum, default_value_t = FormatName::Single)]
    format: FormatName,
    /// How far cameras, wheels and floor are from perfect
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
    /// The base's program - the strategy -, ELF or S37 [default: the one just built]
    #[arg(long, visible_alias = "image", value_name = "FILE")]
    khepera_image: Option<PathBuf>,
    /// With --opponent self: its base's program [default: the same as ours]
    #[arg(long, visible_alias = "opponent-image", value_name = "FILE")]
    opponent_khepera_image: Option<PathBuf>,
    /// With --opponent self: its turret's program [default: the same as ours]
    #[arg(long, value_name = "FILE.ihx")]
    opponent_fx2_image: Option<PathBuf>,
    /// With --opponent self: its turret's flash image [default: the same as ours]
    #[arg(long, value_name = "FILE")]
    opponent_flash: Option<PathBuf>,
    /// Change a property of the physics by a factor, as rolling-loss=1.3; may be repeated
    #[arg(long, value_name = "NAME=FACTOR", value_parser = parse_vary)]
    vary: Vec<(String, f64)>,
    /// Play so many matches, of the seeds from --seed on, and say what they come to together
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    matches: Option<u64>,
    /// With --matches: so many at once [default: one for each processor]
    #[arg(long, value_name = "J", requires = "matches",
          value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: Option<u16>,
    /// With --matches: write a row for each match
    #[arg(long, value_name = "FILE", requires = "matches")]
    csv: Option<PathBuf>,
    /// Print what is said on the serial line, to standard error
    #[arg(long)]
    serial: bool,
    /// End with one JSON object
    #[arg(long, action = ArgAction::SetTrue)]
    json: bool,
}

/// Who plays on the other side.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Opponent {
    /// Stands where the seed puts it
    Idle,
    /// Defends its goal line
    Wall,
    /// Runs for the ball
    Chaser,
    /// Runs for the ball so as to push it towards our goal
    Striker,
    /// Runs for the ball that 64 grey pixels in a line show it: the league's old camera
    Linear,
    /// A second emulated robot with the same firmware, or with --opponent-image another
    #[value(name = "self")]
    Itself,
}

/// What ends a match.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum End {
    /// The first goal, or the time
    Goal,
    /// The time
    Time,
}

/// How the time of a match is divided.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FormatName {
    /// One period of --seconds
    Single,
    /// Two halves with a change of ends, together --seconds; after a draw extra time of 3/10 of that,
    /// then sudden death as long at most
    League,
}

/// Noise levels.
#[derive(Clone, Copy, ValueEnum)]
pub enum Noise {
    /// Perfect cameras, wheels and floor
    None,
    /// Pixel noise, blur, vignetting, eyes and wheels slightly unequal
    Measured,
    /// Half the light, twice the noise, eyes and wheels that differ, a sloping floor
    Harsh,
}

impl From<Noise> for world::Noise {
    fn from(noise: Noise) -> Self {
        match noise {
            Noise::None => Self::None,
            Noise::Measured => Self::Measured,
            Noise::Harsh => Self::Harsh,
        }
    }
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

fn parse_vary(text: &str) -> Result<(String, f64), String> {
    let wrong = || "write NAME=FACTOR, the factor between 0.1 and 10".to_owned();
    let (name, factor) = text.split_once('=').ok_or_else(wrong)?;
    let factor: f64 = factor.parse().map_err(|_| wrong())?;
    if !(0.1..=10.0).contains(&factor) {
        return Err(wrong());
    }
    // An unknown name is told here, before anything is loaded.
    Materials::default().vary(name, factor).map_err(|unknown| unknown.to_string())?;
    Ok((name.to_owned(), factor))
}

/// The match that the arguments ask for.
fn setup(args: &Args) -> Result<Setup> {
    let images = load_images(args)?;
    let mut materials = Materials::default();
    for (name, factor) in &args.vary {
        materials.vary(name, *factor)?;
    }
    let length = (args.seconds * SECOND as f64) as Ps;
    let format = match args.format {
        FormatName::Single => Format::single(length),
        FormatName::League => Format::league(length),
    };
    let first_goal_ends = match args.end {
        Some(end) => end == End::Goal,
        None => args.opponent == Opponent::Idle && args.format == FormatName::Single,
    };
    Ok(Setup {
        seed: args.seed,
        other: other(args, &images)?,
        images,
        eyes: match args.eyes {
            Eyes::Open => twin::game::Eyes::Open,
            Eyes::Black => twin::game::Eyes::Black,
        },
        ball: match args.ball {
            Ball::Yellow => twin::game::BallColour::Yellow,
            Ball::Pink => twin::game::BallColour::Pink,
        },
        noise: args.noise.into(),
        materials,
        format: Format { first_goal_ends, ..format },
    })
}

/// The other side.
fn other(args: &Args, ours: &Images) -> Result<Other> {
    let kind = match args.opponent {
        Opponent::Idle => Kind::Idle,
        Opponent::Wall => Kind::Wall,
        Opponent::Chaser => Kind::Chaser,
        Opponent::Striker => Kind::Striker,
        Opponent::Linear => Kind::Linear,
        Opponent::Itself => {
            let mut images = ours.clone();
            for (given, bytes) in [
                (&args.opponent_khepera_image, &mut images.khepera),
                (&args.opponent_fx2_image, &mut images.fx2),
                (&args.opponent_flash, &mut images.flash),
            ] {
                if let Some(path) = given {
                    *bytes = read_file(path)?;
                }
            }
            return Ok(Other::Firmware(Box::new(images)));
        }
    };
    let has_image = args.opponent_khepera_image.is_some()
        || args.opponent_fx2_image.is_some()
        || args.opponent_flash.is_some();
    if has_image {
        let cause =
            "an image for the opponent needs an opponent with firmware: add --opponent self";
        return Err(Usage(cause.to_owned()).into());
    }
    Ok(Other::Program(kind))
}

/// Run the verb.
pub fn run(args: &Args) -> Result<()> {
    if let Some(matches) = args.matches {
        return run_series(args, matches);
    }
    let mut game = Game::new(setup(args)?)?;

    let started = Instant::now();
    watch(&mut game, args);
    let host_seconds = started.elapsed().as_secs_f64();
    let summary = game.summary();

    let picture = match (&args.picture, args.headless) {
        (Some(path), _) => Some(path.clone()),
        (None, false) => Some(PathBuf::from("match.png")),
        (None, true) => None,
    };
    if args.json {
        let factor = summary.time as f64 / SECOND as f64 / host_seconds;
        println!("{}", as_json(args.seed, &summary, Some(factor)));
    } else {
        print_summary(args, &summary, host_seconds);
    }
    // After the summary: a folder that is not there must not cost the match.
    if let Some(path) = &picture {
        write_picture(path, game.picture())?;
        if !args.json {
            println!("picture     {}", path.display());
        }
    }
    Ok(())
}

/// Many matches.
fn run_series(args: &Args, matches: u64) -> Result<()> {
    if args.picture.is_some() || args.serial {
        let cause = "a picture and the serial line are those of one match: leave out --matches";
        return Err(Usage(cause.to_owned()).into());
    }
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let outcome = series::Series {
        setup: &setup(args)?,
        matches,
        jobs: args.jobs.map_or(processors, usize::from),
        csv: args.csv.as_deref(),
        show: !args.headless,
    }
    .play()?;
    let together = outcome.together();
    if !args.json {
        together.print();
        return Ok(());
    }
    // What each match took of the host's time is not known: jobs share it.
    for (seed, summary) in (outcome.first_seed..).zip(&outcome.summaries) {
        println!("{}", as_json(seed, summary, None));
    }
    println!("{}", together.as_json());
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

fn as_json(seed: u64, summary: &Summary, factor: Option<f64>) -> serde_json::Value {
    let together = series::Together::of(seed, summary);
    json!({
        "seed": seed,
        "goals_for": summary.goals_for,
        "goals_against": summary.goals_against,
        "sim_seconds": summary.time as f64 / SECOND as f64,
        "realtime_factor": factor,
        "trace_hash": format!("{:016x}", summary.trace_hash),
        "frames": summary.frames,
        "reports": summary.reports,
        "own_goals": summary.own_goals,
        "events": summary.events.iter().map(event_as_json).collect::<Vec<_>>(),
        "cpu_load": summary.cpu_load,
        "time_to_ball_s": summary.time_to_ball.map(|time| time as f64 / SECOND as f64),
        "time_to_goal_s": summary.time_to_goal.map(|time| time as f64 / SECOND as f64),
        "detection_rate": summary.tally.ball.rate(),
        "stuck_s": f64::from(summary.tally.stuck_ms) / 1000.0,
        "exposure_to_pwm_ms": summary.tally.exposure_to_pwm_ms.percentile(0.5),
        "exposure_to_pwm_p99_ms": summary.tally.exposure_to_pwm_ms.percentile(0.99),
        "report_to_pwm_ms": summary.tally.report_to_pwm_ms.percentile(0.5),
        "report_to_pwm_p99_ms": summary.tally.report_to_pwm_ms.percentile(0.99),
        "detection": together.detection_as_json(),
        "belief": together.belief_as_json(),
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

fn event_as_json(event: &Event) -> serde_json::Value {
    json!({
        "seconds": event.time as f64 / SECOND as f64,
        "event": event.name(),
        "robot": event.robot(),
        "period": event.period(),
    })
}

/// What the referee called, a line each.
fn print_events(events: &[Event]) {
    for event in events {
        let who = match event.robot() {
            Some(0) => " for us",
            Some(_) => " for the opponent",
            None => "",
        };
        let period = event.period().map_or(String::new(), |period| format!(", {period}"));
        let seconds = event.time as f64 / SECOND as f64;
        println!("{seconds:7.2} s {}{who}{period}", event.name());
    }
}

fn print_summary(args: &Args, summary: &Summary, host_seconds: f64) {
    let seconds = summary.time as f64 / SECOND as f64;
    let factor = seconds / host_seconds;
    let verdict = match (summary.goals_for, summary.goals_against) {
        (0, 0) => "no goal".to_owned(),
        (1, 0) => "GOAL, 1 : 0".to_owned(),
        (ours, theirs) => format!("{ours} : {theirs}"),
    };
    print_events(&summary.events);
    println!("match {:<5} {verdict}, {seconds:.1} s", args.seed);
    println!("FPGA        {}", fpga_in_words(&summary.fpga));
    println!(
        "eyes        {} frame pairs, {} reports taken by the base; ball in {}, goal in {}, opponent in {}",
        summary.frames, summary.reports, summary.saw_ball, summary.saw_goal, summary.saw_opponent
    );
    series::Together::of(args.seed, summary).print_measured();
    println!(
        "twin        {seconds:.1} s simulated, {factor:.1} times as fast as real time, trace {:016x}",
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
        fx2: read_image(args.fx2_image.as_deref(), FX2_IMAGE)?,
        khepera: read_image(args.khepera_image.as_deref(), KHEPERA_IMAGE)?,
        flash,
    })
}

/// The flash of a robot as it leaves the workshop: the soccer bitstream in slot 0.
pub fn default_flash() -> Result<Vec<u8>> {
    let stream = bitstream::make(Function::Soccer, &bitstream::Options::default());
    let entry = store::Entry::from_file(0, &stream, Function::Soccer.name().to_owned())?;
    Ok(store::pack(&[entry], 0))
}

/// The bytes of an image, the one just built if none is given.
pub fn read_image(given: Option<&Path>, built: &str) -> Result<Vec<u8>> {
    match given {
        Some(path) => read_file(path),
        None => read_file(&built_image(built)?),
    }
}

/// The turret's program in the build folder.
pub const FX2_IMAGE: &str = "fx2-firmware/fx2-firmware.ihx";
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
