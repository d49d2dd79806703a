//! `sot fpga reg`: the FPGA's registers.

use anyhow::{Result, bail};
use common_sys::constants as c;
use serde_json::{Value, json};

use crate::output::Usage;
use crate::robot_args::RobotArgs;

/// Read or write the FPGA's registers
///
/// Without REGISTER all that have a name are listed. A value that was written is read back: the exit
/// code is 1 if the FPGA did not take it. Registers last until the next full configuration.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot fpga reg                          all of them
  sot fpga reg goal-row                 one, by name or by address (hexadecimal, as in the list)
  sot fpga reg goal-row 61
  sot fpga reg 06 0x64                  the largest disparity searched := 100
  sot fpga reg --json")]
pub struct RegArgs {
    /// Its name, or its address 00 to 7F in hexadecimal
    register: Option<String>,
    /// What to write: decimal, or hexadecimal with 0x
    value: Option<String>,
    #[command(flatten)]
    robot: RobotArgs,
    /// Print one JSON object, names and values
    #[arg(long)]
    json: bool,
}

/// A register with a name.
struct Register {
    address: u32,
    name: &'static str,
    /// Smallest and largest value, if it can be written.
    range: Option<(u16, u16)>,
    what: &'static str,
}

const fn fixed(address: u32, name: &'static str, what: &'static str) -> Register {
    Register { address, name, range: None, what }
}

const fn ranged(
    address: u32,
    name: &'static str,
    range: (u16, u16),
    what: &'static str,
) -> Register {
    Register { address, name, range: Some(range), what }
}

/// As docs/SPEC.md section 2 has them.
const REGISTERS: [Register; 16] = [
    fixed(c::FPGA_REG_ID, "id", "identity and version of this list"),
    fixed(c::FPGA_REG_FUNCTION, "function", "1 soccer, 2 capture"),
    fixed(c::FPGA_REG_STREAM, "stream", "1 streaming, 2 ending; `sot stream record` sets it"),
    fixed(c::FPGA_REG_FRAME_COUNT, "frames", "pairs taken since configuration, wraps"),
    ranged(c::FPGA_REG_GOAL_ROW, "goal-row", (4, 235), "row in which the goal is looked for"),
    ranged(c::FPGA_REG_OPPONENT_ROW, "opponent-row", (4, 235), "row of the opponent"),
    ranged(c::FPGA_REG_SEARCH_MAX, "search-max", (16, 127), "largest disparity searched, px"),
    ranged(c::FPGA_REG_FRAME_RATE, "frame-rate", (1, 40), "frames a second"),
    ranged(c::FPGA_REG_FORMAT, "format", (0, 1), "0 320x240, 1 640x480"),
    ranged(c::FPGA_REG_SOURCE, "source", (0, 1), "streamed: 0 cameras, 1 pattern (capture only)"),
    ranged(c::FPGA_REG_YELLOW_MARGIN, "yellow-margin", (0, 255), "how yellow a ball is at least"),
    fixed(c::FPGA_REG_SESSION, "session", "streams begun since configuration, wraps"),
    fixed(c::FPGA_REG_SENT, "sent", "pairs of the stream sent whole, wraps"),
    fixed(c::FPGA_REG_LOST, "lost", "pairs of the stream lost, wraps"),
    fixed(c::FPGA_REG_EYES, "eyes", "bit 0 left alive, 1 left torn, 8 right alive, 9 right torn"),
    fixed(c::FPGA_REG_TORN, "torn", "pairs torn by a camera since configuration, wraps"),
];

/// Run `sot fpga reg`.
pub fn run(args: &RegArgs) -> Result<()> {
    let chosen = args.register.as_deref().map(parse_register).transpose()?;
    let value = args.value.as_deref().map(parse_value).transpose()?;
    let mut turret = args.robot.turret()?;
    turret.config_settled()?;
    if let (Some(address), Some(value)) = (chosen, value) {
        turret.set_register(address, value).map_err(|error| match name_of(address) {
            Some("stream") => anyhow::anyhow!("streams are begun by `sot stream record` only"),
            _ => error.into(),
        })?;
        let now = turret.register(address)?;
        if now != value {
            bail!("register {address:02x} did not take {value} and is {now}; {}", takes(address));
        }
    }
    let shown: Vec<u8> = match chosen {
        Some(address) => vec![address],
        None => REGISTERS.iter().map(|register| register.address as u8).collect(),
    };
    let mut object = serde_json::Map::new();
    for address in shown {
        let value = turret.register(address)?;
        let name = name_of(address).map_or_else(|| format!("{address:02x}"), str::to_owned);
        if args.json {
            object.insert(name, json!(value));
        } else {
            let what = find(address).map_or("", |register| register.what);
            println!("{address:02x}  {name:<14} {value:>5}  0x{value:04x}  {what}");
        }
    }
    if args.json {
        println!("{}", Value::Object(object));
    }
    Ok(())
}

fn find(address: u8) -> Option<&'static Register> {
    REGISTERS.iter().find(|register| register.address == u32::from(address))
}

fn name_of(address: u8) -> Option<&'static str> {
    find(address).map(|register| register.name)
}

/// What can be written to a register.
fn takes(address: u8) -> String {
    match find(address) {
        Some(Register { range: Some((low, high)), .. }) => format!("it takes {low} to {high}"),
        Some(_) => "it can only be read".into(),
        None => "there is no such register, or it can only be read".into(),
    }
}

fn parse_register(text: &str) -> Result<u8> {
    if let Some(register) = REGISTERS.iter().find(|register| register.name == text) {
        return Ok(register.address as u8);
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
