//! `sot bitstream`: make, check and pack FPGA bitstreams.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Context, Result, anyhow};
use clap::Subcommand;
use common_sys::constants as c;
use serde_json::json;
use virtex::bitstream::{self, BitHeader, Kind, Options, Summary};
use virtex::design::Function;
use virtex::store;

use crate::output::{Usage, read_file, write_file};

/// Make, check and pack FPGA bitstreams
///
/// A bitstream made here is structurally valid, packet by packet and check sum by check sum, and
/// names the function that the twin's FPGA model takes on. It is for the TWIN ONLY: a real FPGA needs
/// a bitstream from the vendor's place-and-route (Xilinx ISE 10.1 or older).
#[derive(Subcommand)]
pub enum Command {
    Make(MakeArgs),
    Check(CheckArgs),
    Pack(PackArgs),
}

/// Make a bitstream for the twin's XCV300E
///
/// For the TWIN ONLY: a real FPGA needs the vendor's place-and-route.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot bitstream make soccer -o soccer.bin
  sot bitstream make capture -o capture.bit --name 'raw frames'")]
pub struct MakeArgs {
    /// What the FPGA model becomes: soccer (detectors and reports) or capture (raw frames only)
    #[arg(value_parser = Function::from_str)]
    function: Function,
    /// File to write; with the ending .bit it gets the vendor's header, else it is raw
    #[arg(short, long)]
    output: PathBuf,
    /// Name of the design, at most 31 bytes [default: the function]
    #[arg(long)]
    name: Option<String>,
    /// Another seed gives other frame contents
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Check bitstreams as the FPGA would, packet by packet
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot bitstream check soccer.bin
  sot bitstream check *.bit --json")]
pub struct CheckArgs {
    /// Files to check, .bit or raw
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Print one JSON object a file
    #[arg(long)]
    json: bool,
}

/// Put bitstreams into slots of a 16 MiB flash image
///
/// Every bitstream is checked first. The first slot named becomes the default slot unless --default
/// says otherwise.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot bitstream pack 0=soccer.bin 1=capture.bin -o flash.img
  sot play --flash flash.img")]
pub struct PackArgs {
    /// SLOT=FILE, slots 0 to 31
    #[arg(required = true, value_parser = parse_slot)]
    slots: Vec<(u8, PathBuf)>,
    /// Flash image to write
    #[arg(short, long)]
    output: PathBuf,
    /// The slot from which the robot starts
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..i64::from(c::SLOT_COUNT)))]
    default: Option<u8>,
}

fn parse_slot(text: &str) -> Result<(u8, PathBuf), String> {
    let (slot, file) = text.split_once('=').ok_or("write SLOT=FILE, for example 0=soccer.bin")?;
    match slot.parse::<u8>() {
        Ok(slot) if u32::from(slot) < c::SLOT_COUNT => Ok((slot, PathBuf::from(file))),
        _ => Err(format!("slot '{slot}' is not a number from 0 to {}", c::SLOT_COUNT - 1)),
    }
}

/// Run the verb.
pub fn run(command: &Command) -> Result<()> {
    match command {
        Command::Make(args) => make(args),
        Command::Check(args) => check(args),
        Command::Pack(args) => pack(args),
    }
}

fn make(args: &MakeArgs) -> Result<()> {
    let name = args.name.clone().unwrap_or_else(|| args.function.name().to_owned());
    if name.len() > virtex::design::NAME_MAX {
        return Err(Usage(format!(
            "the name is {} bytes long, at most {} fit",
            name.len(),
            virtex::design::NAME_MAX
        ))
        .into());
    }
    let options = Options { name: name.clone(), seed: args.seed, ..Options::default() };
    let raw = bitstream::make(args.function, &options);
    let is_bit = args.output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("bit"));
    let bytes = if is_bit {
        let header = BitHeader {
            design: format!("{name}.ncd"),
            part: options.part.bit_name.to_owned(),
            // The same arguments give the same file, whatever the day.
            date: "2000/01/01".to_owned(),
            time: "00:00:00".to_owned(),
        };
        bitstream::write_bit(&header, &raw)
    } else {
        raw
    };
    write_file(&args.output, &bytes)?;
    eprintln!(
        "{}: {} bytes, function {}, for the twin only",
        args.output.display(),
        bytes.len(),
        args.function.name()
    );
    Ok(())
}

fn check(args: &CheckArgs) -> Result<()> {
    let mut bad = Vec::new();
    for path in &args.files {
        let verdict =
            read_file(path).and_then(|bytes| bitstream::check(&bytes).map_err(anyhow::Error::from));
        match &verdict {
            Ok(summary) if args.json => println!("{}", as_json(path, summary)),
            Ok(summary) => println!("{}: ok, {}", path.display(), in_words(summary)),
            Err(error) => {
                if args.json {
                    println!(
                        "{}",
                        json!({"file": path, "ok": false, "error": format!("{error:#}")})
                    );
                }
                bad.push(format!("{}: {error:#}", path.display()));
            }
        }
    }
    match bad.split_first() {
        None => Ok(()),
        Some((first, [])) => Err(anyhow!("{first}")),
        Some((first, more)) => Err(anyhow!("{first}; and {} more files are bad", more.len())),
    }
}

fn as_json(path: &std::path::Path, summary: &Summary) -> serde_json::Value {
    json!({
        "file": path,
        "ok": true,
        "kind": match summary.kind { Kind::Full => "full", Kind::Partial => "partial" },
        "part": summary.part.name,
        "function": summary.design.as_ref().map(|design| design.function.name()),
        "name": summary.design.as_ref().map(|design| &design.name),
        "bytes": summary.length,
        "frames": summary.counts.frames,
        "crc_checks": summary.counts.crc_checks,
    })
}

fn in_words(summary: &Summary) -> String {
    let design = match &summary.design {
        Some(design) => format!("function {} ({})", design.function.name(), design.name),
        None => "of a function the twin does not know".to_owned(),
    };
    format!(
        "{} stream of {} bytes for {}, {design}, {} frames, {} check sums right",
        match summary.kind {
            Kind::Full => "full",
            Kind::Partial => "partial",
        },
        summary.length,
        summary.part.name,
        summary.counts.frames,
        summary.counts.crc_checks
    )
}

fn pack(args: &PackArgs) -> Result<()> {
    let mut slots = Vec::new();
    for (slot, path) in &args.slots {
        if slots.iter().any(|entry: &store::Entry| entry.slot == *slot) {
            return Err(Usage(format!("slot {slot} is given twice")).into());
        }
        let file = read_file(path)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        slots.push(
            store::Entry::from_file(*slot, &file, name)
                .with_context(|| format!("{} cannot go into a slot", path.display()))?,
        );
    }
    let default = args.default.unwrap_or(slots[0].slot);
    if !slots.iter().any(|entry| entry.slot == default) {
        return Err(Usage(format!("--default {default}: nothing is put into that slot")).into());
    }
    let image = store::pack(&slots, default);
    write_file(&args.output, &image)?;
    eprintln!(
        "{}: {} of {} slots, default slot {default}",
        args.output.display(),
        slots.len(),
        c::SLOT_COUNT
    );
    Ok(())
}
