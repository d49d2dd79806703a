//! `sot list` and `sot info`: which robots there are, and how one of them is.

use anyhow::Result;
use common_sys::constants as c;
use serde_json::{Value, json};
use turret_link::registry::{Kind, Running};
use turret_link::turret::{Turret, state_name};
use turret_link::{Identity, real, select};
use virtex::store::{Slot, State};

use crate::fpga::{function_name, status_as_json, status_in_words};
use crate::robot_args::AskArgs;

/// List the robots on USB and the running twins
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot list
  sot list --json           one JSON array

A robot is named to other verbs by what stands in the first column:
  sot info --robot twin:127.0.0.1:4000")]
pub struct ListArgs {
    /// Print one JSON array
    #[arg(long)]
    json: bool,
}

/// Tell how a robot's turret is: firmware, FPGA, bitstream slots
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot info
  sot info --robot usb:SOT000000042 --json")]
pub struct InfoArgs {
    #[command(flatten)]
    on: AskArgs,
}

/// Run `sot list`.
pub fn list(args: &ListArgs) -> Result<()> {
    let found = select::find()?;
    let usb = found.usb.iter().map(|info| of_usb(&real::identity(info)));
    let rows: Vec<Row> = usb.chain(found.twins.iter().map(of_twin)).collect();
    if args.json {
        let all: Vec<Value> = rows.into_iter().map(|row| row.json).collect();
        println!("{}", Value::Array(all));
        return Ok(());
    }
    if rows.is_empty() {
        eprintln!("no robot on USB and no twin running; `sot twin robot` starts one");
    }
    let width = rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    for row in rows {
        println!("{:width$}  {}", row.name, row.what);
    }
    Ok(())
}

struct Row {
    name: String,
    what: String,
    json: Value,
}

fn of_usb(identity: &Identity) -> Row {
    let speed = if identity.high_speed { "high" } else { "full" };
    let (kind, what) = if select::is_turret(identity) {
        let (api, board) = (identity.release >> 8, identity.release & 0xFF);
        let fits = if u32::from(api) == c::USB_API_LEVEL { "" } else { ", NOT this program's" };
        ("turret", format!("turret, firmware API {api}{fits}, board {board}, {speed} speed"))
    } else {
        ("blank", format!("FX2 without firmware, {speed} speed"))
    };
    let json = json!({
        "robot": identity.name,
        "kind": kind,
        "serial": identity.serial,
        "vendor": format!("{:04x}", identity.vendor),
        "product": format!("{:04x}", identity.product),
        "api_level": (kind == "turret").then_some(identity.release >> 8),
        "board_revision": (kind == "turret").then_some(identity.release & 0xFF),
        "speed": speed,
    });
    Row { name: identity.name.clone(), what, json }
}

fn of_twin(running: &Running) -> Row {
    let twin = &running.twin;
    let name = match (&twin.usbredir, &twin.serial) {
        (Some(place), _) => format!("twin:{place}"),
        (None, Some(path)) => format!("serial:{}", path.display()),
        (None, None) => format!("(process {})", running.pid),
    };
    let what = match twin.kind {
        Kind::Robot => "twin of a whole robot",
        Kind::Fx2 => "twin of an FX2",
        Kind::Khepera => "twin of a base",
    };
    let line = match (&twin.usbredir, &twin.serial) {
        (Some(_), Some(path)) => format!(", serial line at {}", path.display()),
        _ => String::new(),
    };
    let json = json!({
        "robot": name,
        "kind": format!("twin-{}", twin.kind.name()),
        "pid": running.pid,
        "usbredir": twin.usbredir,
        "serial_line": twin.serial,
    });
    Row { what: format!("{what}, process {}{line}", running.pid), name, json }
}

/// Run `sot info`.
pub fn info(args: &InfoArgs) -> Result<()> {
    let mut turret = args.on.robot.turret()?;
    let status = turret.config_settled()?;
    // A turret without flash still tells the rest.
    let slots = turret.slots().map_err(|error| error.to_string());
    let eeprom = boots_from(&mut turret);
    let identity = turret.device().identity().clone();
    if args.on.json {
        let (slots, flash_error) = match &slots {
            Ok(slots) => (slots.iter().filter(|s| is_used(s)).map(slot_as_json).collect(), None),
            Err(error) => (Vec::new(), Some(error)),
        };
        println!(
            "{}",
            json!({
                "robot": identity.name,
                "serial": identity.serial,
                "api_level": identity.release >> 8,
                "board_revision": identity.release & 0xFF,
                "speed": if identity.high_speed { "high" } else { "full" },
                "eeprom": eeprom.as_ref().ok(),
                "eeprom_error": eeprom.as_ref().err(),
                "fpga": status_as_json(&status),
                "slots": slots,
                "flash_error": flash_error,
            })
        );
        return Ok(());
    }
    println!("robot     {}", identity.name);
    println!(
        "serial    {}",
        identity.serial.as_deref().unwrap_or("none; `sot flash eeprom --serial`")
    );
    println!(
        "firmware  API level {}, board revision {}, {} speed",
        identity.release >> 8,
        identity.release & 0xFF,
        if identity.high_speed { "high" } else { "full" }
    );
    println!("eeprom    {}", eeprom.unwrap_or_else(|error| error));
    println!("fpga      {}", status_in_words(&status));
    match slots {
        Ok(slots) => {
            println!(
                "slots     {} of {} used",
                slots.iter().filter(|s| is_used(s)).count(),
                slots.len()
            );
            slots.iter().filter(|slot| is_used(slot)).for_each(print_slot);
        }
        Err(error) => println!("slots     {error}"),
    }
    Ok(())
}

/// What the turret starts from when it is switched on.
fn boots_from(turret: &mut Turret) -> Result<String, String> {
    let first = turret.read_eeprom(0..8).map_err(|error| error.to_string())?;
    Ok(match first.first() {
        Some(&byte) if u32::from(byte) == c::EEPROM_BOOT => {
            "boots our firmware's kind (C2)".to_owned()
        }
        Some(0xC0) => "holds an identity only (C0): the turret starts blank".to_owned(),
        _ => "empty: the turret starts blank".to_owned(),
    })
}

fn is_used(slot: &Slot) -> bool {
    slot.state != State::Empty
}

/// One line for a slot.
pub fn print_slot(slot: &Slot) {
    let marks = match (slot.default, slot.golden) {
        (true, true) => "default, golden",
        (true, false) => "default",
        (false, true) => "golden",
        (false, false) => "",
    };
    let what = match slot.state {
        State::Empty | State::Unfinished => state_name(slot.state).to_owned(),
        State::Whole | State::Damaged => format!(
            "{:<10} {:<24} {:<12} {:>6} bytes, generation {}",
            function_name(slot.function),
            slot.name,
            slot.part,
            slot.length,
            slot.generation
        ),
    };
    println!("  slot {:<2} {what}  {marks}", slot.slot);
}

/// The same for scripts.
pub fn slot_as_json(slot: &Slot) -> Value {
    let there = slot.state == State::Whole;
    json!({
        "slot": slot.slot,
        "state": state_name(slot.state),
        "name": there.then_some(&slot.name),
        "function": there.then(|| function_name(slot.function)),
        "part": there.then_some(&slot.part),
        "bytes": there.then_some(slot.length),
        "generation": there.then_some(slot.generation),
        "default": slot.default,
        "golden": slot.golden,
    })
}
