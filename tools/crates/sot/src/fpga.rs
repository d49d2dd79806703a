//! `sot fpga`: the turret's FPGA and its bitstream store.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Subcommand;
use common_sys::constants as c;
use common_sys::link::ConfigStatus;
use serde_json::{Value, json};
use turret_link::turret::{Turret, config_result};
use virtex::design::Function;
use virtex::store::{Entry, State};

use crate::list::{print_slot, slot_as_json};
use crate::output::{Usage, read_file, write_file};
use crate::robot_args::{Action, AskArgs, Outcome, RobotArgs, WorkArgs, bar, moves};

/// The turret's FPGA and its 32 bitstream slots
#[derive(Subcommand)]
pub enum Command {
    Slots(SlotsArgs),
    Status(StatusArgs),
    Boot(BootArgs),
    Verify(VerifyArgs),
    Read(ReadArgs),
    Erase(EraseArgs),
    Default(MarkArgs),
    Golden(GoldenArgs),
    Reg(crate::fpga_reg::RegArgs),
}

/// List the slots
///
/// A slot is `whole` if its header and its commit word are there; `sot fpga verify` reads the
/// bitstream too. `unfinished`: a write was interrupted; it does not count, and can be written anew.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga slots
  sot fpga slots --json       one JSON array of all 32")]
pub struct SlotsArgs {
    #[command(flatten)]
    on: AskArgs,
}

/// Tell how the FPGA's configuration stands
///
/// Exit code 1 if the FPGA runs no design.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga status
  sot fpga status --json")]
pub struct StatusArgs {
    #[command(flatten)]
    on: AskArgs,
}

/// Configure the FPGA from a slot
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga boot 3             until it is switched off
  sot fpga boot               the default slot, as at power-on")]
pub struct BootArgs {
    /// Slot, 0 to 31 [default: the default slot]
    #[arg(value_parser = parse_slot)]
    slot: Option<u8>,
    #[command(flatten)]
    on: AskArgs,
}

/// Read slots back and check them, against their check sums or a file
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga verify             every slot that is in use
  sot fpga verify 3
  sot fpga verify 3 soccer.bit")]
pub struct VerifyArgs {
    /// Slot, 0 to 31 [default: all that are in use]
    #[arg(value_parser = parse_slot)]
    slot: Option<u8>,
    /// Bitstream that must be in it
    file: Option<PathBuf>,
    #[command(flatten)]
    on: AskArgs,
}

/// Read a slot's bitstream into a file
///
/// The file gets the raw configuration bytes, without a .bit header.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga read 3 -o soccer.bin")]
pub struct ReadArgs {
    /// Slot, 0 to 31
    #[arg(value_parser = parse_slot)]
    slot: u8,
    /// File to write
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    robot: RobotArgs,
}

/// Erase a slot
///
/// Its marks as default or golden slot go with it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga erase 3")]
pub struct EraseArgs {
    /// Slot, 0 to 31
    #[arg(value_parser = parse_slot)]
    slot: u8,
    #[command(flatten)]
    on: WorkArgs,
}

/// Make a slot the one that the robot starts from
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga default 3          from the next power-on; `sot fpga boot` does it now")]
pub struct MarkArgs {
    /// Slot, 0 to 31
    #[arg(value_parser = parse_slot)]
    slot: u8,
    #[command(flatten)]
    on: WorkArgs,
}

/// Make a slot the one that serves when another fails
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga golden 31")]
pub struct GoldenArgs {
    #[command(flatten)]
    mark: MarkArgs,
}

/// The number of a slot.
pub fn parse_slot(text: &str) -> Result<u8, String> {
    let slots = c::SLOT_COUNT as u8;
    let slot = text.parse().ok().filter(|slot| *slot < slots);
    slot.ok_or_else(|| format!("slots are 0 to {}", slots - 1))
}

/// Run the verb.
pub fn run(command: &Command) -> Result<()> {
    match command {
        Command::Slots(args) => slots(args),
        Command::Status(args) => status(args),
        Command::Boot(args) => boot(args),
        Command::Verify(args) => verify(args),
        Command::Read(args) => read(args),
        Command::Erase(args) => erase(args),
        Command::Default(args) => mark(args, c::SLOT_RECORD_DEFAULT),
        Command::Golden(args) => mark(&args.mark, c::SLOT_RECORD_GOLDEN),
        Command::Reg(args) => crate::fpga_reg::run(args),
    }
}

fn slots(args: &SlotsArgs) -> Result<()> {
    let slots = args.on.robot.turret()?.slots()?;
    if args.on.json {
        println!("{}", Value::Array(slots.iter().map(slot_as_json).collect()));
        return Ok(());
    }
    let empty = slots.iter().filter(|slot| slot.state == State::Empty).count();
    slots.iter().filter(|slot| slot.state != State::Empty).for_each(print_slot);
    println!("  {empty} slots empty");
    Ok(())
}

fn status(args: &StatusArgs) -> Result<()> {
    let status = args.on.robot.turret()?.config_settled()?;
    if args.on.json {
        println!("{}", status_as_json(&status));
    } else {
        println!("{}", status_in_words(&status));
    }
    if status.done == 0 {
        bail!(
            "the FPGA runs no design; `sot fpga boot SLOT` or `sot flash fpga FILE` configures it"
        );
    }
    Ok(())
}

fn boot(args: &BootArgs) -> Result<()> {
    let status = args.on.robot.turret()?.boot(args.slot)?;
    if args.on.json {
        println!("{}", status_as_json(&status));
    } else {
        println!("{}", status_in_words(&status));
    }
    Ok(())
}

fn verify(args: &VerifyArgs) -> Result<()> {
    let wanted = match (&args.file, args.slot) {
        (Some(path), Some(slot)) => Some(load_entry(path, slot, None)?),
        _ => None,
    };
    let mut turret = args.on.robot.turret()?;
    let slots: Vec<u8> = match args.slot {
        Some(slot) => vec![slot],
        None => {
            let used = |slot: &virtex::store::Slot| slot.state == State::Whole;
            turret.slots()?.iter().filter(|slot| used(slot)).map(|slot| slot.slot).collect()
        }
    };
    let mut bad = Vec::new();
    for slot in &slots {
        let verdict = verify_slot(&mut turret, *slot, wanted.as_ref());
        if args.on.json {
            let error = verdict.as_ref().err().map(|error| format!("{error:#}"));
            println!("{}", json!({"slot": slot, "ok": verdict.is_ok(), "error": error}));
        } else if let Ok(words) = &verdict {
            println!("slot {slot}: {words}");
        }
        bad.extend(verdict.err());
    }
    if slots.is_empty() && !args.on.json {
        println!("no slot is in use");
    }
    match bad.len() {
        0 => Ok(()),
        1 => Err(bad.remove(0)),
        more => {
            let others = more - 1;
            Err(bad.remove(0).context(format!("{others} other slots are bad too, and first")))
        }
    }
}

fn verify_slot(turret: &mut Turret, slot: u8, wanted: Option<&Entry>) -> Result<String> {
    let bar = bar(&format!("slot {slot}"));
    let read = turret.read_whole(slot, &mut moves(&bar));
    bar.finish_and_clear();
    let (header, bytes) = read?;
    match wanted {
        None => Ok(format!("ok, {} bytes, check sum {:08x}", bytes.len(), header.crc32)),
        Some(entry) if entry.stream == bytes => {
            Ok(format!("ok, {} bytes as in the file", bytes.len()))
        }
        Some(entry) if entry.stream.len() != bytes.len() => bail!(
            "slot {slot} holds {} bytes, the file {}: another bitstream",
            bytes.len(),
            entry.stream.len()
        ),
        Some(entry) => {
            let same = bytes.iter().zip(&entry.stream).take_while(|(a, b)| a == b).count();
            bail!("slot {slot} differs from the file from byte {same} on: another bitstream")
        }
    }
}

fn read(args: &ReadArgs) -> Result<()> {
    let mut turret = args.robot.turret()?;
    let bar = bar(&format!("slot {}", args.slot));
    let read = turret.read_whole(args.slot, &mut moves(&bar));
    bar.finish_and_clear();
    let (_, bytes) = read?;
    write_file(&args.output, &bytes)?;
    eprintln!("{}: {} bytes from slot {}", args.output.display(), bytes.len(), args.slot);
    Ok(())
}

fn erase(args: &EraseArgs) -> Result<()> {
    let mut turret = args.on.robot.turret()?;
    let part = format!("slot {}", args.slot);
    let (slot, _) = turret.slot(args.slot)?;
    if slot.state == State::Empty {
        Outcome::new(part, Action::Unchanged, "was empty").print(args.on.json);
    } else if args.on.dry_run {
        Outcome::new(part, Action::WouldWrite, "it would be erased").print(args.on.json);
    } else {
        turret.erase(args.slot)?;
        Outcome::new(part, Action::Written, "erased").print(args.on.json);
    }
    Ok(())
}

/// What a kind of mark is called.
pub fn mark_name(kind: u32) -> &'static str {
    if kind == c::SLOT_RECORD_DEFAULT { "default" } else { "golden" }
}

fn mark(args: &MarkArgs, kind: u32) -> Result<()> {
    put_mark(&mut args.on.robot.turret()?, args.slot, kind, args.on.dry_run)?.print(args.on.json);
    Ok(())
}

/// Marks a slot, if it is not marked yet.
pub fn put_mark(turret: &mut Turret, slot: u8, kind: u32, dry_run: bool) -> Result<Outcome> {
    let name = mark_name(kind);
    let marks = turret.marks()?;
    let marked = if kind == c::SLOT_RECORD_DEFAULT { marks[0] } else { marks[1] };
    let detail = format!("slot {slot}");
    if marked == Some(slot) {
        return Ok(Outcome::new(name, Action::Unchanged, detail));
    }
    if dry_run {
        return Ok(Outcome::new(name, Action::WouldWrite, detail));
    }
    turret.mark(slot, kind)?;
    Ok(Outcome::new(name, Action::Written, detail))
}

/// A bitstream from a file, for `slot`.
pub fn load_entry(path: &std::path::Path, slot: u8, name: Option<&str>) -> Result<Entry> {
    let file = read_file(path)?;
    Entry::from_file(slot, &file, entry_name(path, name)?)
        .with_context(|| format!("{} cannot go into a slot", path.display()))
}

/// What a bitstream from `path` is called: `name`, or what the file is called.
pub fn entry_name(path: &std::path::Path, name: Option<&str>) -> Result<String> {
    match name {
        Some(name) if name.len() > virtex::store::NAME_MAX => Err(Usage(format!(
            "the name is {} bytes long, at most {} fit",
            name.len(),
            virtex::store::NAME_MAX
        ))
        .into()),
        Some(name) => Ok(name.to_owned()),
        None => Ok(path.file_stem().unwrap_or_default().to_string_lossy().into_owned()),
    }
}

/// The name of a function code.
pub fn function_name(code: u8) -> &'static str {
    Function::ALL
        .into_iter()
        .find(|function| function.code() == code)
        .map_or("unknown", |function| function.name())
}

fn source_name(source: u8) -> &'static str {
    match u32::from(source) {
        c::CONFIG_FROM_DEFAULT => "default slot",
        c::CONFIG_FROM_SLOT => "slot",
        c::CONFIG_FROM_USB => "USB",
        c::CONFIG_PARTIAL => "USB, in part",
        c::CONFIG_FROM_GOLDEN => "golden slot",
        _ => "somewhere unknown",
    }
}

fn slot_number(status: &ConfigStatus) -> Option<u8> {
    (u32::from(status.slot) != c::CONFIG_NO_SLOT).then_some(status.slot)
}

/// How a configuration stands, in one line.
pub fn status_in_words(status: &ConfigStatus) -> String {
    let slot = slot_number(status).map_or(String::new(), |slot| format!(" {slot}"));
    let from = format!("{}{slot}", source_name(status.source));
    let pins = format!("INIT# {}, DONE {}", level(status.init), level(status.done));
    let result = u32::from(status.result);
    if result != c::CONFIG_OK {
        return format!("NOT CONFIGURED from {from}: {}; {pins}", config_result(status.result));
    }
    let instead = if u32::from(status.source) == c::CONFIG_FROM_GOLDEN {
        format!(" because of what came before: {}", config_result(status.cause))
    } else {
        String::new()
    };
    let ms = f64::from(status.time_us) / 1000.0;
    format!("configured from {from}{instead}, {} bytes in {ms:.1} ms; {pins}", status.bytes)
}

fn level(pin: u8) -> &'static str {
    if pin != 0 { "high" } else { "low" }
}

/// The same for scripts.
pub fn status_as_json(status: &ConfigStatus) -> Value {
    let golden = u32::from(status.source) == c::CONFIG_FROM_GOLDEN;
    json!({
        "configured": u32::from(status.result) == c::CONFIG_OK && status.done != 0,
        "result": config_result(status.result),
        "source": source_name(status.source),
        "slot": slot_number(status),
        "instead_of": golden.then(|| config_result(status.cause)),
        "init": status.init != 0,
        "done": status.done != 0,
        "bytes": status.bytes,
        "time_ms": f64::from(status.time_us) / 1000.0,
    })
}
