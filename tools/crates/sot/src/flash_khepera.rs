//! `sot flash khepera`: a program into the base, through its resident loader.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use base_link::{Error, Line as _, Options, Program, SerialLine, Step};
use common_sys::constants as c;
use indicatif::ProgressBar;

use crate::interrupt::{self, Interrupted};
use crate::output::Usage;
use crate::play::{KHEPERA_IMAGE, built_image};
use crate::robot_args::{Action, Outcome, RobotArgs, bar};
use crate::twin::read_limited;

/// Write a program into the base over its serial line
///
/// The base's resident loader puts it into the bank that is not in use, block by block; what the base has
/// already is copied there by the base itself. Then it reads the whole back, sums it up, and only then
/// makes it the one that starts. Whatever happens before that, the old program starts.
///
/// The running program is told to enter the loader (shell word `loader`): the motors stop. A base whose
/// program does not listen is reached with --wait: switch it off and on while the command knocks.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot flash khepera                                    the firmware just built, into the only base there is
  sot flash khepera khepera-firmware.s37 --robot serial:/dev/ttyUSB0
  sot flash khepera other.elf --wait 30                a base that hangs: switch it off and on meanwhile
  sot flash khepera --dry-run --json                   what would have to be written")]
pub struct KheperaArgs {
    /// Program: ELF or S-records, our firmware's or one linked for the RAM [default: the one just built]
    file: Option<PathBuf>,
    #[command(flatten)]
    robot: RobotArgs,
    /// Rate for the transfer
    #[arg(long, default_value_t = 115_200, value_parser = parse_baud)]
    baud: u32,
    /// Knock so many seconds at a base that does not answer
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=600))]
    wait: u64,
    /// Write it even if the base has it already
    #[arg(long)]
    force: bool,
    /// Say what would be done, and do nothing (the base enters its loader and comes back)
    #[arg(long)]
    dry_run: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// A program takes a third of a second to start, and need not say anything.
const START_MAX: Duration = Duration::from_secs(1);
const GREETING_QUIET: Duration = Duration::from_millis(100);
/// Longer files are no programs for the base.
const FILE_MAX: u64 = 16 << 20;

fn parse_baud(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(baud @ (9600 | 19200 | 38400 | 57600 | 115_200)) => Ok(baud),
        _ => Err("write 9600, 19200, 38400, 57600 or 115200".to_owned()),
    }
}

/// Run the verb.
pub fn run(args: &KheperaArgs) -> Result<()> {
    let file = match &args.file {
        Some(file) => file.clone(),
        None => built_image(KHEPERA_IMAGE)?,
    };
    let line = match turret_link::select::serial_line(args.robot.robot.as_ref()) {
        Ok(line) => line,
        Err(error) if error.is_wrong_use() => return Err(Usage(error.to_string()).into()),
        Err(error) => return Err(error.into()),
    };
    let program = load_program(&file)?;
    let options = Options {
        baud: args.baud,
        force: args.force,
        dry_run: args.dry_run,
        wait: Duration::from_secs(args.wait),
    };
    put(&line, &program, &options)?.print(args.json);
    Ok(())
}

/// The program in `file`.
pub fn load_program(file: &Path) -> Result<Program> {
    let bytes = read_limited(file, FILE_MAX, "it is not for a Khepera")?;
    Program::from_file(&bytes).with_context(|| format!("{} cannot be used", file.display()))
}

/// Bring the base at the serial line `line` to run `program`.
pub fn put(line: &Path, program: &Program, options: &Options) -> Result<Outcome> {
    let stop = interrupt::watch();
    let mut port = SerialLine::open(line, c::BOARD_BAUD)?;
    let progress = bar("base");
    let done = base_link::flash(&mut port, program, options, &mut |step| {
        show(&progress, step);
        !stop.load(Ordering::Relaxed)
    });
    progress.finish_and_clear();
    let outcome = match done {
        Err(Error::Interrupted) => {
            eprintln!("sot: interrupted; the base keeps its program");
            return Err(Interrupted.into());
        }
        other => other?,
    };
    wait_for_program(&mut port)?;
    let size = format!("{} bytes, CRC-32 {:08x}", program.bytes.len(), program.crc32());
    if outcome.unchanged {
        return Ok(Outcome::new("base", Action::Unchanged, size));
    }
    let (action, read_back) = match options.dry_run {
        true => (Action::WouldWrite, ""),
        false => (Action::Written, ", read back"),
    };
    let detail = format!(
        "{size}: {} blocks sent, {} copied, {} kept, {} sectors erased, {} repetitions{read_back}",
        outcome.sent, outcome.copied, outcome.kept, outcome.erased, outcome.repeated
    );
    Ok(Outcome::new("base", action, detail))
}

/// The loader is starting the program: whoever comes next shall find it listening, and its greeting gone.
fn wait_for_program(port: &mut SerialLine) -> Result<()> {
    let started = Instant::now();
    let mut greeted = false;
    while started.elapsed() < START_MAX {
        let silent = port.receive(GREETING_QUIET)?.is_empty();
        if greeted && silent {
            break;
        }
        greeted |= !silent;
    }
    Ok(())
}

fn show(progress: &ProgressBar, step: Step) {
    let block = u64::from(c::LOADER_BLOCK_SIZE);
    let (what, done, all) = match step {
        Step::Entering => ("looking for the loader", 0, 1),
        Step::Knocking => ("knocking: switch the base off and on", 0, 1),
        Step::Comparing(done, all) => ("comparing", done, all),
        Step::Erasing(done, all) => ("erasing", done, all),
        Step::Writing(done, all) => ("writing", done, all),
        Step::Committing => ("verifying", 0, 1),
    };
    if progress.message() != what {
        progress.set_message(what);
    }
    progress.set_length(all as u64 * block);
    progress.set_position(done as u64 * block);
}
