//! `sot`: one command for the robot, its eyes and its twin.

mod bitstream;
mod camera;
mod console;
mod console_lines;
mod console_plot;
mod console_terminal;
mod desk;
mod detect;
mod disparity;
mod eyes;
mod fifo_master;
mod flash;
mod flash_eeprom;
mod flash_khepera;
mod flash_robot;
mod fpga;
mod fpga_reg;
mod interrupt;
mod list;
mod output;
mod play;
mod program_symbols;
mod pty;
mod robot_args;
mod snapshot;
mod stream;
mod twin;
mod twin_eyes;
mod twin_khepera;
mod twin_robot;

use std::process::ExitCode;

use clap::{Parser, Subcommand, error::ErrorKind};

use crate::interrupt::{EXIT_INTERRUPTED, Interrupted};
use crate::output::Usage;

/// The job could not be done: a file is missing or damaged, a device failed.
const EXIT_FAILED: u8 = 1;
/// The command was used wrongly: an unknown option, a value out of range.
const EXIT_USAGE: u8 = 2;

const EXIT_CODES: &str = "\
Exit codes:
  0    done
  1    the job failed: a file missing, truncated or unreadable, a check not passed, no robot found
  2    wrong use: unknown option, value out of range, several robots and none named
  130  interrupted by Ctrl-C";

/// StereoSot: the software of a stereoscopic Khepera soccer robot, and its desk-top twin.
#[derive(Parser)]
#[command(name = "sot", version, after_help = EXIT_CODES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Play(play::Args),
    Detect(detect::Args),
    Disparity(disparity::Args),
    #[command(subcommand)]
    Bitstream(bitstream::Command),
    #[command(subcommand)]
    Twin(twin::Command),
    List(list::ListArgs),
    Info(list::InfoArgs),
    #[command(subcommand)]
    Flash(flash::Command),
    #[command(subcommand)]
    Fpga(fpga::Command),
    Console(console::ConsoleArgs),
    #[command(subcommand)]
    Stream(stream::Command),
    #[command(subcommand)]
    Camera(camera::Command),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage_or_help(&error),
    };
    // Nothing is left half written: files are written beside their place and renamed.
    interrupt::install();

    let result = match cli.verb {
        Verb::Play(args) => play::run(&args),
        Verb::Detect(args) => detect::run(&args),
        Verb::Disparity(args) => disparity::run(&args),
        Verb::Bitstream(command) => bitstream::run(&command),
        Verb::Twin(command) => twin::run(&command),
        Verb::List(args) => list::list(&args),
        Verb::Info(args) => list::info(&args),
        Verb::Flash(command) => flash::run(&command),
        Verb::Fpga(command) => fpga::run(&command),
        Verb::Console(args) => console::run(&args),
        Verb::Stream(command) => stream::run(&command),
        Verb::Camera(command) => camera::run(&command),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<Interrupted>() => ExitCode::from(EXIT_INTERRUPTED),
        Err(error) => {
            eprintln!("sot: {error:#}");
            let wrong_use = error.downcast_ref::<Usage>().is_some();
            ExitCode::from(if wrong_use { EXIT_USAGE } else { EXIT_FAILED })
        }
    }
}

/// Help goes to standard output as clap wrote it; a mistake becomes one line with its cure.
fn usage_or_help(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.render().to_string();
    let mut paragraphs = text.split("\n\n");
    let cause = paragraphs.next().unwrap_or_default();
    let cause = cause.strip_prefix("error: ").unwrap_or(cause);
    let tip = paragraphs
        .filter_map(|p| p.trim().strip_prefix("tip: "))
        .map(|tip| format!(" ({tip})"))
        .next()
        .unwrap_or_default();
    let cause = match error.kind() {
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => "a verb is missing",
        _ => cause,
    };
    let cause = cause.split_whitespace().collect::<Vec<_>>().join(" ");
    eprintln!("sot: {cause}{tip}; --help shows how it is used");
    ExitCode::from(EXIT_USAGE)
}
