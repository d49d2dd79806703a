//! `sot fpga reg`: the FPGA's registers.

use anyhow::{Result, bail};
use common_sys::constants as c;
use common_sys::link::{Register, registers};
use serde_json::{Value, json};

use crate::output::Usage;
use crate::robot_args::AskArgs;

/// Read or write the FPGA's registers
///
/// Without REGISTER all that have a name are listed, with what they take and what they are after
/// configuration. Rows, thresholds and the search range of the detectors take effect with the next pair
/// of frames. A value that was written is read back: the exit code is 1 if the FPGA did not take it.
/// Registers last until the next full configuration.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga reg                          all of them
  sot fpga reg goal-row                 one, by name or by address (hexadecimal, as in the list)
  sot fpga reg goal-row 61
  sot fpga reg goal-row default         as after configuration
  sot fpga reg 06 0x64                  the largest disparity searched := 100
  sot fpga reg --json                   {\"id\": 21249, \"function\": 1, ...}
  sot fpga reg --json --describe        the same with ranges, units and texts")]
pub struct RegArgs {
    /// Its name, or its address 00 to 7F in hexadecimal
    register: Option<String>,
    /// What to write: decimal, hexadecimal with 0x, or "default"
    value: Option<String>,
    #[command(flatten)]
    on: AskArgs,
    /// With --json: for each name an object with value, address, unit, reset, min, max and text
    #[arg(long, requires = "json")]
    describe: bool,
}

/// Run `sot fpga reg`.
pub fn run(args: &RegArgs) -> Result<()> {
    let chosen = args.register.as_deref().map(parse_register).transpose()?;
    let value = match (chosen, args.value.as_deref()) {
        (Some(address), Some("default")) => Some(default_of(address)?),
        (_, value) => value.map(parse_value).transpose()?,
    };
    let mut turret = args.on.robot.turret()?;
    turret.config_settled()?;
    if let (Some(address), Some(value)) = (chosen, value) {
        turret.set_register(address, value).map_err(|error| match u32::from(address) {
            c::FPGA_REG_STREAM => {
                anyhow::anyhow!("streams are begun by `sot stream record` only")
            }
            _ => error.into(),
        })?;
        let now = turret.register(address)?;
        if now != value {
            bail!("{} did not take {value} and is {now}; {}", shown_name(address), takes(address));
        }
    }
    let shown: Vec<u8> = match chosen {
        Some(address) => vec![address],
        None => registers().iter().map(|register| register.address).collect(),
    };
    let mut object = serde_json::Map::new();
    for address in shown {
        let value = turret.register(address)?;
        if args.describe {
            object.insert(shown_name(address), described(address, value));
        } else if args.on.json {
            object.insert(shown_name(address), json!(value));
        } else {
            println!("{}", line(address, value));
        }
    }
    if args.on.json {
        println!("{}", Value::Object(object));
    }
    Ok(())
}

/// A register as people read it: address, name, value, and what there is to know.
fn line(address: u8, value: u16) -> String {
    let start = format!("{address:02x}  {:<14} {value:>5}  0x{value:04x}", shown_name(address));
    let Some(register) = find(address) else { return start };
    let range = match register.range {
        Some((low, high)) => format!("{low}..{high}, {}", register.reset),
        None => "read only".into(),
    };
    format!("{start}  {range:<11}  {:<6} {}", register.unit, register.text).trim_end().to_owned()
}

fn described(address: u8, value: u16) -> Value {
    let Some(register) = find(address) else {
        return json!({ "value": value, "address": address });
    };
    let Register { unit, reset, range, text, is_param, .. } = register;
    json!({
        "value": value, "address": address, "unit": unit, "reset": reset,
        "min": range.map(|(low, _)| low), "max": range.map(|(_, high)| high),
        "detectors": is_param, "text": text,
    })
}

fn find(address: u8) -> Option<&'static Register> {
    registers().iter().find(|register| register.address == address)
}

/// Names have hyphens on the command line, and underscores are taken too.
pub fn name_of(register: &Register) -> String {
    register.name.replace('_', "-")
}

/// The register of that name.
pub fn named(name: &str) -> Option<&'static Register> {
    let name = name.replace('-', "_");
    registers().iter().find(|register| register.name == name)
}

fn shown_name(address: u8) -> String {
    find(address).map_or_else(|| format!("{address:02x}"), name_of)
}

fn default_of(address: u8) -> Result<u16> {
    match find(address) {
        Some(Register { range: Some(_), reset, .. }) => Ok(*reset),
        _ => Err(Usage(format!("{} has no default; give a value", shown_name(address))).into()),
    }
}

/// What can be written to a register.
fn takes(address: u8) -> String {
    match find(address) {
        Some(Register { range: Some((low, high)), .. }) => {
            let only = if u32::from(address) == c::FPGA_REG_SOURCE {
                ", and 1 only while the function is `capture`"
            } else {
                ""
            };
            format!("it takes {low} to {high}{only}")
        }
        Some(_) => "it can only be read".into(),
        None => "there is no such register, or it can only be read".into(),
    }
}

fn parse_register(text: &str) -> Result<u8> {
    if let Some(register) = named(text) {
        return Ok(register.address);
    }
    match u8::from_str_radix(text.trim_start_matches("0x"), 16) {
        Ok(address) if u32::from(address) < c::FPGA_REG_COUNT => Ok(address),
        _ => Err(Usage(format!(
            "\"{text}\" is no register; give a name that `sot fpga reg` lists, or 00 to 7f"
        ))
        .into()),
    }
}

/// A number, decimal or with 0x.
pub fn parse_value(text: &str) -> Result<u16> {
    let number = match text.strip_prefix("0x") {
        Some(digits) => u16::from_str_radix(digits, 16),
        None => text.parse(),
    };
    number.map_err(|_| {
        Usage(format!("\"{text}\" is no value; give 0 to 65535, or 0x0 to 0xffff")).into()
    })
}
