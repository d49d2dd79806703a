//! `sot flash`: putting something onto a robot, and making sure that it is there.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::Subcommand;
use common_sys::constants as c;
use fx2::image::Image;
use turret_link::select;
use turret_link::turret::Turret;
use turret_link::{Device, LinkError, ram};
use virtex::bitstream::Kind;
use virtex::store::{Entry, header};

use crate::flash_eeprom::{self, EepromArgs};
use crate::flash_khepera::{self, KheperaArgs};
use crate::flash_robot::{self, ManifestArgs};
use crate::fpga::{entry_name, parse_slot, put_mark, status_in_words};
use crate::output::read_file;
use crate::robot_args::{Action, Outcome, WorkArgs, bar, moves};
use crate::twin::read_limited;

/// Put firmware and bitstreams onto a robot
///
/// What is written is read back and compared; what is there already is left alone. A write that is
/// interrupted, by Ctrl-C or by a pulled cable, leaves what was there before, nothing, or all of the
/// new, never a mixture.
#[derive(Subcommand)]
pub enum Command {
    Fx2(Fx2Args),
    Eeprom(EepromArgs),
    Fpga(FpgaArgs),
    Khepera(KheperaArgs),
    Robot(ManifestArgs),
}

/// Load a program into the FX2's RAM and start it
///
/// It runs until the turret is switched off. The RAM is read back before the program starts. Then the
/// device is waited for as it comes back onto the bus.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot flash fx2 fx2-firmware.ihx
  sot flash fx2 other.ihx --no-wait        a program that does not leave the bus to come back")]
pub struct Fx2Args {
    /// Program: Intel HEX, or raw bytes for address 0
    file: PathBuf,
    #[command(flatten)]
    on: WorkArgs,
    /// Do not wait for the device to come back
    #[arg(long)]
    no_wait: bool,
}

/// Configure the FPGA, or write a bitstream into a slot
///
/// Without --slot the FPGA gets the bitstream now and keeps it until it is switched off; a partial
/// bitstream changes the running design. With --slot the bitstream goes into the turret's flash; the
/// FPGA goes on with what it runs.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot flash fpga soccer.bit                  now, until it is switched off
  sot flash fpga soccer.bit --slot 0 --default --boot
  sot flash fpga rescue.bit --slot 31 --golden")]
pub struct FpgaArgs {
    /// Bitstream, .bit or raw
    file: PathBuf,
    /// Slot, 0 to 31
    #[arg(long, value_parser = parse_slot)]
    slot: Option<u8>,
    /// Name of the bitstream in its slot, at most 23 bytes [default: the file's name]
    #[arg(long, requires = "slot")]
    name: Option<String>,
    /// Make that slot the one that the robot starts from
    #[arg(long, requires = "slot")]
    default: bool,
    /// Make that slot the one that serves when another fails
    #[arg(long, requires = "slot")]
    golden: bool,
    /// Configure the FPGA from that slot afterwards
    #[arg(long, requires = "slot")]
    boot: bool,
    #[command(flatten)]
    on: WorkArgs,
}

/// How long a program may take to come back onto the bus.
pub const RETURN_PATIENCE: Duration = Duration::from_secs(15);
/// Longer files are no programs for an 8051, whatever their kind.
const IMAGE_FILE_MAX: u64 = 1 << 20;

/// Run the verb.
pub fn run(command: &Command) -> Result<()> {
    match command {
        Command::Fx2(args) => fx2(args),
        Command::Eeprom(args) => flash_eeprom::run(args),
        Command::Fpga(args) => fpga(args),
        Command::Khepera(args) => flash_khepera::run(args),
        Command::Robot(args) => flash_robot::run(args),
    }
}

/// The bytes of a file that is a program for the FX2.
pub fn read_program(path: &Path) -> Result<Vec<u8>> {
    read_limited(path, IMAGE_FILE_MAX, "it is not for an FX2")
}

/// A program for the turret's FX2.
pub fn load_program(path: &Path) -> Result<Image> {
    let image = Image::parse(&read_program(path)?);
    let image = image.with_context(|| format!("{} cannot be used", path.display()))?;
    image
        .check(fx2::Ram::K8.bytes())
        .with_context(|| format!("{} is not for the turret's FX2", path.display()))?;
    Ok(image)
}

fn fx2(args: &Fx2Args) -> Result<()> {
    let image = load_program(&args.file)?;
    let mut device = args.on.robot.device()?;
    let bytes: usize = image.segments().map(|(_, bytes)| bytes.len()).sum();
    if args.on.dry_run {
        let detail = format!("{bytes} bytes into the RAM of {}", device.identity().name);
        Outcome::new("fx2", Action::WouldWrite, detail).print(args.on.json);
        return Ok(());
    }
    ram::run(&mut *device, &image)?;
    let runs = if args.no_wait { "running".to_owned() } else { returned(&mut *device)? };
    let detail = format!("{bytes} bytes into RAM, read back; {runs}");
    Outcome::new("fx2", Action::Written, detail).print(args.on.json);
    Ok(())
}

/// A program was started: waits until it is on the bus. What it is, in words.
pub fn returned(device: &mut dyn Device) -> Result<String> {
    match device.wait_for_return(RETURN_PATIENCE) {
        Ok(()) => {}
        Err(LinkError::NotBack(seconds)) => bail!(
            "the program was started, but the device has not come back onto the bus within {seconds} s; \
             if it is not meant to, use --no-wait"
        ),
        Err(error) => return Err(error.into()),
    }
    let identity = device.identity();
    Ok(if select::is_turret(identity) {
        format!("it is back as {}, API level {}", identity.name, identity.release >> 8)
    } else {
        format!("it is back as {:04x}:{:04x}", identity.vendor, identity.product)
    })
}

fn fpga(args: &FpgaArgs) -> Result<()> {
    match args.slot {
        Some(slot) => fpga_slot(args, slot),
        None => fpga_ram(args),
    }
}

fn fpga_ram(args: &FpgaArgs) -> Result<()> {
    let name = entry_name(&args.file, None)?;
    let (entry, kind) = Entry::of_any_kind(0, &read_file(&args.file)?, name)
        .with_context(|| format!("{} cannot go into the FPGA", args.file.display()))?;
    let mut turret = args.on.robot.turret()?;
    if args.on.dry_run {
        let detail = format!("{} bytes", entry.stream.len());
        Outcome::new("fpga", Action::WouldWrite, detail).print(args.on.json);
        return Ok(());
    }
    let status = turret.configure(&header(&entry), &entry.stream, kind == Kind::Partial)?;
    Outcome::new("fpga", Action::Written, status_in_words(&status)).print(args.on.json);
    Ok(())
}

fn fpga_slot(args: &FpgaArgs, slot: u8) -> Result<()> {
    let entry = crate::fpga::load_entry(&args.file, slot, args.name.as_deref())?;
    let mut turret = args.on.robot.turret()?;
    put_slot(&mut turret, &entry, args.on.dry_run)?.print(args.on.json);
    if args.default {
        put_mark(&mut turret, slot, c::SLOT_RECORD_DEFAULT, args.on.dry_run)?.print(args.on.json);
    }
    if args.golden {
        put_mark(&mut turret, slot, c::SLOT_RECORD_GOLDEN, args.on.dry_run)?.print(args.on.json);
    }
    if args.boot && !args.on.dry_run {
        let status = turret.boot(Some(slot))?;
        Outcome::new("fpga", Action::Written, status_in_words(&status)).print(args.on.json);
    }
    Ok(())
}

/// Writes a bitstream into its slot, if it is not there yet, and reads it back.
pub fn put_slot(turret: &mut Turret, entry: &Entry, dry_run: bool) -> Result<Outcome> {
    let part = format!("slot {}", entry.slot);
    let header = header(entry);
    let detail = format!("{}, {} bytes", entry.name, entry.stream.len());
    if turret.holds(entry.slot, &header, &entry.stream)? {
        return Ok(Outcome::new(part, Action::Unchanged, detail));
    }
    if dry_run {
        return Ok(Outcome::new(part, Action::WouldWrite, detail));
    }
    let progress = bar(&format!("writing {part}"));
    let written = turret.write(entry.slot, &header, &entry.stream, &mut moves(&progress));
    progress.finish_and_clear();
    written?;
    let progress = bar(&format!("verifying {part}"));
    let same = turret.verify(entry.slot, &entry.stream, &mut moves(&progress));
    progress.finish_and_clear();
    same?;
    Ok(Outcome::new(part, Action::Written, format!("{detail}, read back")))
}
