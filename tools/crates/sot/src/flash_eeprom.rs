//! `sot flash eeprom`: the turret's boot EEPROM.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use common_sys::constants as c;
use common_sys::link::{EEPROM_SERIAL_SIZE, EEPROM_SERIAL_TEXT, eeprom_serial_decode};
use fx2::eeprom::{BootConfig, c2_image};
use fx2::image::Image;
use turret_link::eeprom::{Loader, check_image, encode_serial};
use turret_link::turret::Turret;
use turret_link::{Device, ram, select};

use crate::flash::{load_program, read_program, returned};
use crate::output::Usage;
use crate::play;
use crate::robot_args::{Action, Outcome, WorkArgs, bar, moves};

/// Write the firmware that the turret boots, and its serial number
///
/// Works with a blank turret too. A small program is loaded into the FX2's RAM, writes the EEPROM, and
/// reads it back; whenever that is cut off, the turret starts as a blank chip or with a whole image,
/// and this command can be repeated. Afterwards the new firmware is started.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot flash eeprom fx2-firmware.ihx
  sot flash eeprom fx2-firmware.ihx --serial SOT000000042      a new board
  sot flash eeprom boot.iic --robot usb:SOT000000042")]
pub struct EepromArgs {
    /// Program (Intel HEX), or a boot image (C2)
    file: PathBuf,
    /// Serial number to write: 12 characters 0-9 or A-Z [default: the one that is there stays]
    #[arg(long, value_name = "TEXT")]
    serial: Option<String>,
    /// The program that writes the EEPROM [default: the one just built]
    #[arg(long, value_name = "FILE.ihx")]
    loader: Option<PathBuf>,
    #[command(flatten)]
    on: WorkArgs,
}

/// The program that writes the EEPROM, in the build folder.
const LOADER_IMAGE: &str = "fx2-firmware/eeprom-loader.ihx";

/// What is to be in the EEPROM.
pub struct Wanted {
    /// The boot image.
    pub image: Vec<u8>,
    /// What it starts.
    pub program: Image,
    /// The serial number, if it is to be written.
    pub serial: Option<String>,
}

impl Wanted {
    /// Reads a program or a boot image from `path`.
    pub fn load(path: &Path, serial: Option<&str>) -> Result<Self> {
        if let Some(serial) = serial {
            encode_serial(serial).map_err(|error| Usage(error.to_string()))?;
        }
        let bytes = read_program(path)?;
        let cannot = || format!("{} cannot be used", path.display());
        let (image, program) = if bytes.first().map(|&byte| u32::from(byte)) == Some(c::EEPROM_BOOT)
        {
            let program = Image::c2(&bytes).with_context(cannot)?;
            (bytes, program)
        } else {
            let program = load_program(path)?;
            let config = BootConfig { fast: true, ..BootConfig::default() };
            (c2_image(&program, ram::identity(), config), program)
        };
        check_image(&image).with_context(cannot)?;
        Ok(Self { image, program, serial: serial.map(str::to_owned) })
    }
}

/// Run the verb.
pub fn run(args: &EepromArgs) -> Result<()> {
    let wanted = Wanted::load(&args.file, args.serial.as_deref())?;
    let loader = args.loader.as_deref();
    let device = args.on.robot.device()?;
    let (_, outcomes) = put(device, &wanted, loader, args.on.dry_run)?;
    for outcome in outcomes {
        outcome.print(args.on.json);
    }
    Ok(())
}

/// Brings the EEPROM to what is wanted, if it is not yet, and starts what is in it. Gives the device
/// back as what it is then.
pub fn put(
    device: Box<dyn Device>,
    wanted: &Wanted,
    loader: Option<&Path>,
    dry_run: bool,
) -> Result<(Box<dyn Device>, Vec<Outcome>)> {
    let identity = device.identity();
    let ours = select::is_turret(identity) && u32::from(identity.release >> 8) == c::USB_API_LEVEL;
    if !ours && !select::is_turret(identity) && !select::is_blank(identity) {
        bail!(
            "{} is {:04x}:{:04x}: neither a turret nor a blank FX2",
            identity.name,
            identity.vendor,
            identity.product
        );
    }
    let detail = format!("{} bytes to boot", wanted.image.len());
    let serial_detail = wanted.serial.clone().unwrap_or_default();
    let all = |image: Action, serial: Action, note: &str| {
        let mut outcomes = vec![Outcome::new("eeprom", image, format!("{detail}{note}"))];
        if wanted.serial.is_some() {
            outcomes.push(Outcome::new("serial", serial, serial_detail.clone()));
        }
        outcomes
    };
    // The firmware that is there can tell without being disturbed.
    let mut device = device;
    if ours {
        let mut turret = Turret::new(device)?;
        let image = turret.read_eeprom(0..wanted.image.len())? == wanted.image;
        let serial = wanted.serial.is_none() || turret.stored_serial()? == wanted.serial;
        let verdict = |same: bool| if same { Action::Unchanged } else { Action::WouldWrite };
        if image && serial || dry_run {
            return Ok((turret.into_device(), all(verdict(image), verdict(serial), "")));
        }
        device = turret.into_device();
    } else if dry_run {
        return Ok((device, all(Action::WouldWrite, Action::WouldWrite, "")));
    }
    let (mut device, image, serial) = write(device, wanted, loader)?;
    ram::run(&mut *device, &wanted.program)?;
    let runs = returned(&mut *device)?;
    Ok((device, all(image, serial, &format!(", read back; started, {runs}"))))
}

/// Writes, through the loader, what is not there yet.
fn write(
    device: Box<dyn Device>,
    wanted: &Wanted,
    loader: Option<&Path>,
) -> Result<(Box<dyn Device>, Action, Action)> {
    let program = match loader {
        Some(path) => load_program(path)?,
        None => load_program(&play::built_image(LOADER_IMAGE)?)?,
    };
    let mut loader = Loader::start(device, &program)?;
    let image = if loader.read(0..wanted.image.len())? == wanted.image {
        Action::Unchanged
    } else {
        let progress = bar("writing the EEPROM");
        let written = loader.write_image(&wanted.image, &mut moves(&progress));
        progress.finish_and_clear();
        written?;
        Action::Written
    };
    let serial = match &wanted.serial {
        None => Action::Unchanged,
        Some(serial) if stored_serial(&mut loader)?.as_ref() == Some(serial) => Action::Unchanged,
        Some(serial) => {
            loader.write_serial(serial)?;
            Action::Written
        }
    };
    Ok((loader.into_device(), image, serial))
}

fn stored_serial(loader: &mut Loader) -> Result<Option<String>> {
    let at = c::EEPROM_SERIAL_AT as usize;
    let bytes = loader.read(at..at + EEPROM_SERIAL_SIZE)?;
    let text: Option<[u8; EEPROM_SERIAL_TEXT]> = bytes.first_chunk().and_then(eeprom_serial_decode);
    Ok(text.map(|text| String::from_utf8_lossy(&text).into_owned()))
}
