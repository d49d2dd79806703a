//! `sot flash robot`: everything of one robot, to what a manifest says.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use base_link::Program;
use common_sys::constants as c;
use common_sys::link::ConfigStatus;
use serde::Deserialize;
use serde_json::json;
use turret_link::select;
use turret_link::turret::Turret;
use virtex::store::Entry;

use crate::flash::put_slot;
use crate::flash_eeprom::{self, Wanted};
use crate::flash_khepera;
use crate::fpga::{load_entry, put_mark, status_in_words};
use crate::robot_args::{Action, Outcome, WorkArgs};

/// Bring one robot to what a manifest says, and tell whether it is fit to play
///
/// The manifest is TOML, or JSON if its name ends in .json. Files are looked for beside it; whatever it
/// does not name is left alone:
///
///   eeprom = "fx2-firmware.ihx"       what the turret boots
///   serial = "SOT000000042"           its serial number
///   default = 0                       the slot that the robot starts from
///   golden = 31                       the slot that serves when another fails
///   base = "khepera-firmware.elf"     what the base runs
///
///   [slots]
///   0 = "soccer.bit"
///   31 = "rescue.bit"
///
/// Everything is read and checked before the first byte is written. A line a part, then one verdict: fit
/// to play if every part is as the manifest says and the FPGA runs from its default slot.
#[derive(clap::Args)]
#[command(
    verbatim_doc_comment,
    after_help = "\
Examples:
  sot flash robot team.toml --dry-run
  sot flash robot team.toml --robot usb:SOT000000042 --json

Exit code 0: fit to play. 1: not, or with --dry-run: something would have to be written."
)]
pub struct ManifestArgs {
    /// The manifest
    manifest: PathBuf,
    #[command(flatten)]
    on: WorkArgs,
    /// The base's serial line [default: that of the twin, if it is one]
    #[arg(long, value_name = "PATH")]
    base_line: Option<PathBuf>,
    /// Knock for so many seconds if the base does not listen: switch it off and on meanwhile
    #[arg(long, value_name = "SECONDS", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=600))]
    wait: u64,
    /// The program that writes the EEPROM [default: the one just built]
    #[arg(long, value_name = "FILE.ihx")]
    loader: Option<PathBuf>,
}

/// The manifest as it is written.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    eeprom: Option<PathBuf>,
    serial: Option<String>,
    #[serde(default)]
    slots: BTreeMap<String, PathBuf>,
    default: Option<u8>,
    golden: Option<u8>,
    base: Option<PathBuf>,
}

/// The manifest, its files read and checked.
struct Plan {
    eeprom: Option<Wanted>,
    entries: Vec<Entry>,
    default: Option<u8>,
    golden: Option<u8>,
    base: Option<Program>,
}

impl Plan {
    fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        let manifest: Manifest = if is_json {
            serde_json::from_str(&text).map_err(anyhow::Error::from)
        } else {
            toml::from_str(&text).map_err(anyhow::Error::from)
        }
        .map_err(|error| {
            let cause = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
            anyhow!("{} is no manifest: {cause}; --help shows one", path.display())
        })?;
        Self::check(manifest, path.parent().unwrap_or(Path::new("")))
            .with_context(|| format!("{} cannot be used", path.display()))
    }

    fn check(manifest: Manifest, folder: &Path) -> Result<Self> {
        let eeprom = match &manifest.eeprom {
            Some(file) => Some(Wanted::load(&folder.join(file), manifest.serial.as_deref())?),
            None if manifest.serial.is_some() => bail!("a serial number needs an eeprom beside it"),
            None => None,
        };
        let mut entries = Vec::new();
        for (slot, file) in &manifest.slots {
            let number = slot.parse().ok().filter(|&slot| u32::from(slot) < c::SLOT_COUNT);
            let number = number.with_context(|| {
                format!("there is no slot {slot}, only 0 to {}", c::SLOT_COUNT - 1)
            })?;
            entries.push(load_entry(&folder.join(file), number, None)?);
        }
        entries.sort_by_key(|entry: &Entry| entry.slot);
        if let Some(pair) = entries.windows(2).find(|pair| pair[0].slot == pair[1].slot) {
            bail!("slot {} is named twice", pair[0].slot);
        }
        for slot in [manifest.default, manifest.golden].into_iter().flatten() {
            if u32::from(slot) >= c::SLOT_COUNT {
                bail!("there is no slot {slot}, only 0 to {}", c::SLOT_COUNT - 1);
            }
        }
        let load = |file: PathBuf| flash_khepera::load_program(&folder.join(file));
        let base = manifest.base.map(load).transpose()?;
        let Manifest { default, golden, .. } = manifest;
        Ok(Self { eeprom, entries, default, golden, base })
    }
}

/// Run the verb.
pub fn run(args: &ManifestArgs) -> Result<()> {
    let plan = Plan::load(&args.manifest)?;
    let mut outcomes = Vec::new();
    let tell = |outcomes: &mut Vec<Outcome>, outcome: Outcome| {
        if !args.on.json {
            outcome.print(false);
        }
        outcomes.push(outcome);
    };
    if let Err(error) = turret_parts(args, &plan, &mut |outcome| tell(&mut outcomes, outcome)) {
        tell(&mut outcomes, Outcome::new("turret", Action::Failed, format!("{error:#}")));
    }
    if let Some(program) = &plan.base {
        let outcome = base_part(args, program)
            .unwrap_or_else(|error| Outcome::new("base", Action::Failed, format!("{error:#}")));
        tell(&mut outcomes, outcome);
    }
    verdict(args, &plan, &outcomes)
}

/// All that is behind USB.
fn turret_parts(args: &ManifestArgs, plan: &Plan, tell: &mut dyn FnMut(Outcome)) -> Result<()> {
    let mut device = args.on.robot.device()?;
    if let Some(wanted) = &plan.eeprom {
        let (back, outcomes) =
            flash_eeprom::put(device, wanted, args.loader.as_deref(), args.on.dry_run)?;
        device = back;
        outcomes.into_iter().for_each(&mut *tell);
    }
    let mut turret = Turret::new(device)?;
    let mut written = false;
    for entry in &plan.entries {
        let outcome = put_slot(&mut turret, entry, args.on.dry_run)?;
        written |= outcome.action == Action::Written;
        tell(outcome);
    }
    let marks = [(plan.default, c::SLOT_RECORD_DEFAULT), (plan.golden, c::SLOT_RECORD_GOLDEN)];
    for (slot, kind) in marks {
        if let Some(slot) = slot {
            // A slot that would only be written now cannot be looked at.
            let outcome = put_mark(&mut turret, slot, kind, args.on.dry_run)?;
            written |= outcome.action == Action::Written;
            tell(outcome);
        }
    }
    tell(fpga_part(&mut turret, written, args.on.dry_run)?);
    Ok(())
}

/// The FPGA must run from its default slot, with what is in that slot now.
fn fpga_part(turret: &mut Turret, written: bool, dry_run: bool) -> Result<Outcome> {
    let status = turret.config_settled()?;
    let from_default = |status: &ConfigStatus| {
        u32::from(status.result) == c::CONFIG_OK
            && status.done != 0
            && u32::from(status.source) == c::CONFIG_FROM_DEFAULT
    };
    if from_default(&status) && !written {
        return Ok(Outcome::new("fpga", Action::Unchanged, status_in_words(&status)));
    }
    if dry_run {
        return Ok(Outcome::new("fpga", Action::WouldWrite, "from the default slot"));
    }
    let status = turret.boot(None)?;
    Ok(Outcome::new("fpga", Action::Written, status_in_words(&status)))
}

/// The base, over its serial line.
fn base_part(args: &ManifestArgs, program: &Program) -> Result<Outcome> {
    let line = match &args.base_line {
        Some(line) => line.clone(),
        None => select::serial_line(args.on.robot.robot.as_ref())?,
    };
    let options = base_link::Options {
        dry_run: args.on.dry_run,
        wait: Duration::from_secs(args.wait),
        ..base_link::Options::default()
    };
    flash_khepera::put(&line, program, &options)
}

fn verdict(args: &ManifestArgs, plan: &Plan, outcomes: &[Outcome]) -> Result<()> {
    let parts = |action: Action| -> Vec<&str> {
        let has = outcomes.iter().filter(|outcome| outcome.action == action);
        has.map(|outcome| outcome.part.as_str()).collect()
    };
    let (failed, missing) = (parts(Action::Failed), parts(Action::WouldWrite));
    let fit = failed.is_empty() && missing.is_empty();
    let without = if plan.base.is_some() { "" } else { " (the manifest names no base)" };
    if args.on.json {
        println!("{}", json!({ "fit": fit, "dry_run": args.on.dry_run, "parts": outcomes }));
    } else if fit {
        println!("fit to play{without}");
    }
    if !failed.is_empty() {
        bail!("NOT fit to play: {} failed", failed.join(", "));
    }
    if !missing.is_empty() {
        bail!("not fit to play yet: {} would be written", missing.join(", "));
    }
    Ok(())
}
