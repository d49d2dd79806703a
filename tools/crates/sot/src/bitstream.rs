//! `sot bitstream`: make, show, check and pack FPGA bitstreams.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, anyhow};
use clap::Subcommand;
use common_sys::constants as c;
use serde_json::json;
use virtex::bitstream::{self, BitHeader, Kind, Options, Summary};
use virtex::design::Function;
use virtex::listing::{Packet, packets};
use virtex::store;

use crate::fpga;
use crate::output::{Usage, read_file, write_file};

/// Make, show, check and pack FPGA bitstreams
///
/// A bitstream made here is structurally valid, packet by packet and check sum by check sum, and
/// names the function that the twin's FPGA model takes on. It is for the TWIN ONLY: a real FPGA needs
/// a bitstream from the vendor's place-and-route (Xilinx ISE 10.1 or older).
#[derive(Subcommand)]
pub enum Command {
    Make(MakeArgs),
    Info(InfoArgs),
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
  sot bitstream make capture -o capture.bit --name 'raw frames'
  sot bitstream make capture --partial -o change.bin")]
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
    /// Make a partial bitstream, which changes a running design into this one
    #[arg(long)]
    partial: bool,
}

/// Show what is in bitstreams
///
/// Header, part, kind, and what the check found; with --packets every packet. A damaged file is shown
/// as far as it can be understood.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot bitstream info soccer.bit
  sot bitstream info soccer.bit --packets
  sot bitstream info soccer.bit --json      one JSON object a file, with its packets

Exit code 1 if the FPGA would not take it.")]
pub struct InfoArgs {
    /// Files to show, .bit or raw
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Show every packet
    #[arg(long)]
    packets: bool,
    /// Print one JSON object a file
    #[arg(long)]
    json: bool,
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
    #[arg(long, value_parser = fpga::parse_slot)]
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
        Command::Info(args) => info(args),
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
    let raw = if args.partial {
        bitstream::make_partial(args.function, &options)
    } else {
        bitstream::make(args.function, &options)
    };
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

fn info(args: &InfoArgs) -> Result<()> {
    let mut bad = Vec::new();
    for path in &args.files {
        if let Err(error) = show(args, path) {
            bad.push(format!("{}: {error:#}", path.display()));
        }
    }
    all_good(&bad)
}

/// Shows one file; the error is why the FPGA would not take it.
fn show(args: &InfoArgs, path: &Path) -> Result<()> {
    let file = read_file(path)?;
    let verdict = bitstream::check(&file);
    let (header, offset, length) = bitstream::split_bit(&file)?;
    let list = packets(&file[offset..offset + length]);
    if args.json {
        let error = verdict.as_ref().err().map(ToString::to_string);
        let mut object = json!({
            "file": path,
            "ok": verdict.is_ok(),
            "error": error,
            "header": header.as_ref().map(|header| json!({
                "design": header.design,
                "part": header.part,
                "date": header.date,
                "time": header.time,
            })),
            "offset": offset,
            "bytes": length,
            "packets": list.iter().map(packet_as_json).collect::<Vec<_>>(),
        });
        if let (Ok(summary), Some(object)) = (&verdict, object.as_object_mut()) {
            for (key, value) in as_json(path, summary).as_object().into_iter().flatten() {
                object.insert(key.clone(), value.clone());
            }
        }
        println!("{object}");
    } else {
        println!("{}", path.display());
        print_info(header.as_ref(), offset, length, verdict.as_ref().ok());
        if args.packets {
            list.iter().for_each(|packet| print_packet(packet, offset));
        } else {
            let wrong = list.iter().filter(|packet| packet.bad).count();
            println!("  packets   {}, {wrong} of them bad", list.len());
        }
    }
    verdict.map(|_| ()).map_err(anyhow::Error::from)
}

fn print_info(header: Option<&BitHeader>, offset: usize, length: usize, summary: Option<&Summary>) {
    match header {
        Some(header) => println!(
            "  header    {} for {}, {} {}, {offset} bytes",
            header.design, header.part, header.date, header.time
        ),
        None => println!("  header    none, raw"),
    }
    println!("  stream    {length} bytes");
    if let Some(summary) = summary {
        println!("  check     ok, {}", in_words(summary));
    }
    if let Some(summary) = summary.filter(|summary| summary.kind == Kind::Full) {
        let persist = if summary.persist { "stays one" } else { "is given up" };
        println!("  options   COR {:08X}; the configuration port {persist}", summary.cor);
    }
}

fn print_packet(packet: &Packet, offset: usize) {
    let Packet { what, words, value, meaning, bad, .. } = packet;
    let at = packet.offset + offset;
    let value = value.map_or(format!("{words} words"), |value| format!("{value:08X}"));
    let mark = if *bad { " <--" } else { "" };
    println!("  {at:>8}  {what:<12} {value:<12} {meaning}{mark}");
}

fn packet_as_json(packet: &Packet) -> serde_json::Value {
    json!({
        "offset": packet.offset,
        "what": packet.what,
        "words": packet.words,
        "value": packet.value,
        "meaning": packet.meaning,
        "bad": packet.bad,
    })
}

fn all_good(bad: &[String]) -> Result<()> {
    match bad.split_first() {
        None => Ok(()),
        Some((first, [])) => Err(anyhow!("{first}")),
        Some((first, more)) => Err(anyhow!("{first}; and {} more files are bad", more.len())),
    }
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
    all_good(&bad)
}

fn as_json(path: &Path, summary: &Summary) -> serde_json::Value {
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
