//! `--robot`, and how work on a robot is told.

use std::fmt;
use std::io::IsTerminal;

use anyhow::{Error, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use turret_link::Device;
use turret_link::select::{self, SelectError, Selector};
use turret_link::turret::{Turret, TurretError};

use crate::output::Usage;

/// Which robot.
#[derive(clap::Args)]
pub struct RobotArgs {
    /// usb:SERIAL, usb:@BUS-PORT, serial:PATH or twin:HOST:PORT, as `sot list` names them
    /// [default: the only one there is]
    #[arg(long, value_name = "ROBOT")]
    pub robot: Option<Selector>,
}

impl RobotArgs {
    /// The turret that is meant, with our firmware in it.
    pub fn turret(&self) -> Result<Turret> {
        Turret::open(self.robot.as_ref()).map_err(|error| match error {
            TurretError::Select(error) => self.wrong(error),
            other => other.into(),
        })
    }

    /// The turret that is meant, with any firmware or none.
    pub fn device(&self) -> Result<Box<dyn Device>> {
        select::open(self.robot.as_ref(), true).map_err(|error| self.wrong(error))
    }

    fn wrong(&self, error: SelectError) -> Error {
        if error.is_wrong_use() { Usage(error.to_string()).into() } else { error.into() }
    }
}

/// Which robot to ask, and how to tell.
#[derive(clap::Args)]
pub struct AskArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Print JSON: one object, or one array
    #[arg(long)]
    pub json: bool,
}

/// Which robot to work on, whether in earnest, and how to tell.
#[derive(clap::Args)]
pub struct WorkArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Only look and tell what would be done
    #[arg(long)]
    pub dry_run: bool,
    /// Print JSON: one object for each step
    #[arg(long)]
    pub json: bool,
}

/// A bar on standard error, if that is a terminal.
pub fn bar(what: &str) -> ProgressBar {
    let bar = ProgressBar::new(1);
    bar.set_draw_target(if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    });
    bar.set_style(
        ProgressStyle::with_template("{msg} {bar:40} {bytes}/{total_bytes}")
            .expect("the template is constant and right"),
    );
    bar.set_message(what.to_owned());
    bar
}

/// What moves a bar.
pub fn moves(bar: &ProgressBar) -> impl FnMut(usize, usize) {
    let bar = bar.clone();
    move |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    }
}

/// What was done to a part of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// It was as it should be.
    Unchanged,
    /// It is now as it should be, and was looked at to know.
    Written,
    /// It would have been changed, but that was not wanted.
    WouldWrite,
    /// It is not as it should be.
    Failed,
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unchanged => "unchanged",
            Self::Written => "written",
            Self::WouldWrite => "would be written",
            Self::Failed => "FAILED",
        })
    }
}

/// One part of a robot, and what was done to it.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Which part: `eeprom`, `slot 3`, `fpga` ...
    pub part: String,
    /// What was done.
    pub action: Action,
    /// What it is now, or why it is not.
    pub detail: String,
}

impl Outcome {
    /// Of `part`.
    pub fn new(part: impl Into<String>, action: Action, detail: impl Into<String>) -> Self {
        Self { part: part.into(), action, detail: detail.into() }
    }

    /// On standard output, as a line or as JSON.
    pub fn print(&self, json: bool) {
        if json {
            println!("{}", serde_json::json!(self));
        } else {
            println!("{:<9} {:<16} {}", self.part, self.action.to_string(), self.detail);
        }
    }
}
