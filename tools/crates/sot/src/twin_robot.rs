//! `sot twin robot`: a whole robot on the desk, with its USB plug and its serial line.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::net::TcpListener;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use common_sys::constants as c;
use fx2::Fx2;
use fx2::host::Link;
use serde_json::{Value, json};
use sim::{MS, Ps, SECOND};
use turret_link::eeprom::encode_serial;
use turret_link::registry::{self, Kind, Twin};
use twin::desk::Desk;
use twin::flash;
use twin::robot::{Images, Robot, boot_image};

use crate::interrupt::{self, Interrupted};
use crate::output::Usage;
use crate::play::{self, default_flash, read_image};
use crate::pty::Pty;
use crate::twin::{BusSpeed, parse_address, parse_seconds, read_limited, serve};
use crate::twin_eyes::{self, CameraFault, Lamps};
use crate::twin_khepera::Line;

/// A whole robot: turret, base, and a quiet pitch around it
///
/// Its USB is served over usbredir: `--robot twin:HOST:PORT` of every other verb, or a QEMU guest, is
/// the PC that is plugged into it; one at a time. It runs in the pace of the wall clock. Flash and boot
/// EEPROM are kept in files, if they are given, at every moment: ending the twin, however, is
/// switching the robot off.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot twin robot                                     as it leaves the workshop, at 127.0.0.1:4000
  sot twin robot --flash flash.img --eeprom boot.img the same robot as the last time
  sot twin robot --usbredir :0 --pty ./serial        any free port; the base's serial line at ./serial
  sot info --robot twin:127.0.0.1:4000               in another terminal
  sot twin robot --camera-fault left:no-ack@5..9     a loose plug, for four seconds
  sot twin robot --lamps 0.4@5..9                    and somebody at the light switch")]
pub struct RobotTwinArgs {
    /// Where to serve usbredir; without HOST this machine only, port 0 = any free one
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:4000")]
    usbredir: String,
    /// Contents of the turret's flash, 16 MiB. A file that is not there is made, with the soccer
    /// bitstream in slot 0; an empty file is an erased chip [default: soccer in slot 0, kept nowhere]
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Contents of the boot EEPROM. A file that is not there is made, with our firmware; an empty file
    /// is a blank EEPROM [default: our firmware, kept nowhere]
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,
    /// The turret's serial number if its EEPROM is made anew: 12 characters 0-9 or A-Z
    /// [default: TWIN and the number of the process]
    #[arg(long, value_name = "TEXT")]
    serial: Option<String>,
    /// The turret's program if its EEPROM is made anew [default: the one just built]
    #[arg(long, value_name = "FILE.ihx")]
    fx2_image: Option<PathBuf>,
    /// The base's program, ELF or S37 [default: the one just built]
    #[arg(long, value_name = "FILE")]
    khepera_image: Option<PathBuf>,
    /// Where to link the pseudo-terminal of the base's serial line [default: there is none]
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// The fastest that the bus offers
    #[arg(long, value_enum, default_value_t = BusSpeed::High)]
    speed: BusSpeed,
    /// Something is wrong with the cameras: [left:|right:]KIND[@FROM[..UNTIL]], times in simulated
    /// seconds; KIND is no-ack, wrong-id, no-pixels, torn, stuck-clock or no-mux. May be given again
    #[arg(long, value_name = "FAULT")]
    camera_fault: Vec<CameraFault>,
    /// Lamps so much brighter or dimmer: FACTOR[@FROM[..UNTIL]], times in simulated seconds. May be
    /// given again
    #[arg(long, value_name = "LIGHT")]
    lamps: Vec<Lamps>,
    /// Draws where the robot stands
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// End after so many simulated seconds [default: at Ctrl-C]
    #[arg(long, value_parser = parse_seconds)]
    seconds: Option<f64>,
    /// End with one JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// How often files and serial line are looked after.
const CHORE_PERIOD: Ps = MS;
/// Bytes of the EEPROM, and of what is written of it at a time.
const EEPROM_SIZE: usize = 16 << 10;
const EEPROM_PAGE: usize = 64;

/// Run the verb.
pub fn run(args: &RobotTwinArgs) -> Result<()> {
    let address = parse_address(&args.usbredir)?;
    let (flash_file, flash) = kept(args.flash.as_deref(), flash::SIZE, default_flash)?;
    let (eeprom_file, eeprom) = kept(args.eeprom.as_deref(), EEPROM_SIZE, || new_eeprom(args))?;
    let images = Images {
        fx2: Vec::new(),
        khepera: read_image(args.khepera_image.as_deref(), play::KHEPERA_IMAGE)?,
        flash,
    };
    let mut robot = Robot::with_eeprom(&images, &eeprom)?;
    if flash_file.is_some() {
        robot.turret.flash.record_changes();
    }
    let line = match &args.pty {
        Some(link) => Some(Line::new(Pty::open(Some(link))?)),
        None => None,
    };
    let listener = TcpListener::bind(address).with_context(|| {
        format!("cannot serve at {address}; choose another place with --usbredir")
    })?;
    let place = listener.local_addr()?.to_string();
    let serial = line.as_ref().map(|line| std::path::absolute(line.name())).transpose()?;
    let twin = Twin { kind: Kind::Robot, usbredir: Some(place.clone()), serial };
    let _listed = listed(&twin);
    eprintln!("serving usbredir at {place}");

    let stop = interrupt::watch();
    let duration = args.seconds.map(|seconds| (seconds * SECOND as f64) as Ps);
    let started = Instant::now();
    let mut bench = Bench {
        desk: Desk::new(robot, args.seed),
        line,
        flash_file,
        eeprom_file,
        eeprom,
        camera_faults: args.camera_fault.clone(),
        lamps: args.lamps.clone(),
        next_chore: 0,
        trouble: None,
    };
    let usb = serve(&listener, &mut bench, args.speed, duration, stop)?;
    bench.switch_off();
    if let Some(trouble) = bench.trouble.take() {
        return Err(trouble);
    }
    let seconds = bench.desk.robot.now() as f64 / SECOND as f64;
    let factor = seconds / started.elapsed().as_secs_f64().max(1e-9);
    if args.json {
        let usb = usb.map(|usb| usb.as_json());
        println!("{}", bench.as_json(usb, seconds, factor));
    } else {
        println!("{seconds:.3} s simulated, {factor:.1} times real time");
        bench.diagnostics().iter().for_each(|line| println!("{line}"));
    }
    if stop.load(Ordering::Relaxed) { Err(Interrupted.into()) } else { Ok(()) }
}

/// Puts a twin on the list of those that run; one that cannot be listed runs nevertheless.
pub fn listed(twin: &Twin) -> Option<registry::Entry> {
    registry::register(twin)
        .inspect_err(|error| eprintln!("sot: `sot list` will not show this twin: {error}"))
        .ok()
}

/// A boot EEPROM as it leaves the workshop.
fn new_eeprom(args: &RobotTwinArgs) -> Result<Vec<u8>> {
    let program = read_image(args.fx2_image.as_deref(), play::FX2_IMAGE)?;
    let serial = match &args.serial {
        Some(serial) => serial.clone(),
        None => format!("TWIN{:08}", std::process::id() % 100_000_000),
    };
    let serial = encode_serial(&serial).map_err(|error| Usage(error.to_string()))?;
    let mut eeprom = boot_image(&program)?;
    eeprom.resize(EEPROM_SIZE, 0xFF);
    eeprom[c::EEPROM_SERIAL_AT as usize..][..serial.len()].copy_from_slice(&serial);
    Ok(eeprom)
}

/// The contents of a memory, and the file that keeps them if there is one: made with `new` if it is not
/// there, all FF if it is empty.
fn kept(
    path: Option<&Path>,
    size: usize,
    new: impl FnOnce() -> Result<Vec<u8>>,
) -> Result<(Option<File>, Vec<u8>)> {
    let Some(path) = path else { return Ok((None, new()?)) };
    let made = !path.exists();
    // Before the file is there: a failure must not leave an empty one.
    let contents = if made { new()? } else { read_limited(path, size as u64, "it is too long")? };
    let cannot = || format!("cannot write {}", path.display());
    let mut file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
        .with_context(cannot)?;
    if file.try_lock().is_err() {
        bail!("{} belongs to another twin that is running; give this one its own", path.display());
    }
    let contents = match contents.len() {
        0 => vec![0xFF; size],
        length if length < size && size == EEPROM_SIZE => {
            let mut contents = contents;
            contents.resize(size, 0xFF);
            contents
        }
        length if length != size => {
            bail!("{} has {length} bytes, the chip {size}", path.display());
        }
        _ => contents,
    };
    file.seek(SeekFrom::Start(0)).with_context(cannot)?;
    file.write_all(&contents).with_context(cannot)?;
    Ok((Some(file), contents))
}

/// The robot with its files and its serial line.
struct Bench {
    desk: Desk,
    line: Option<Line>,
    flash_file: Option<File>,
    eeprom_file: Option<File>,
    /// What the EEPROM's file holds.
    eeprom: Vec<u8>,
    camera_faults: Vec<CameraFault>,
    lamps: Vec<Lamps>,
    next_chore: Ps,
    /// Why a file or the serial line is no longer looked after.
    trouble: Option<anyhow::Error>,
}

impl Bench {
    fn chores(&mut self) {
        let now = self.desk.robot.now();
        self.next_chore = now + CHORE_PERIOD;
        let cameras = &mut self.desk.robot.turret.cameras;
        twin_eyes::apply(&self.camera_faults, now, cameras);
        twin_eyes::light(&self.lamps, now, cameras);
        if let Err(error) = self.keep_flash(now).and_then(|()| self.keep_eeprom()) {
            self.trouble.get_or_insert(error);
        }
        match &mut self.line {
            Some(line) => {
                if let Err(error) = line.forward(&mut self.desk.robot.base) {
                    self.trouble.get_or_insert(error);
                }
            }
            // Nobody listens, and it must not pile up.
            None => drop(self.desk.robot.base.serial_take()),
        }
    }

    /// Writes what has changed, in the order in which it has: whenever this process ends, the file is
    /// what the chip was at some time.
    fn keep_flash(&mut self, now: Ps) -> Result<()> {
        let Some(file) = &self.flash_file else { return Ok(()) };
        let flash = &mut self.desk.robot.turret.flash;
        for range in flash.take_changes(now) {
            file.write_all_at(&flash.image()[range.clone()], range.start as u64)
                .context("cannot keep the flash in its file")?;
        }
        Ok(())
    }

    fn keep_eeprom(&mut self) -> Result<()> {
        let Some(file) = &self.eeprom_file else { return Ok(()) };
        let now = self.desk.robot.turret.eeprom.data();
        if now == self.eeprom {
            return Ok(());
        }
        for (page, bytes) in now.chunks(EEPROM_PAGE).enumerate() {
            let at = page * EEPROM_PAGE;
            if bytes != &self.eeprom[at..at + bytes.len()] {
                file.write_all_at(bytes, at as u64)
                    .context("cannot keep the EEPROM in its file")?;
            }
        }
        self.eeprom = now.to_vec();
        Ok(())
    }

    /// The supply goes, and with it what was under way.
    fn switch_off(&mut self) {
        let now = self.desk.robot.now();
        self.desk.robot.turret.power_cycle(now);
        self.chores();
    }

    fn diagnostics(&self) -> Vec<String> {
        let mut all = self.desk.robot.diagnostics();
        all.extend(self.desk.robot.turret.report());
        all
    }

    fn as_json(&self, usb: Option<Value>, seconds: f64, factor: f64) -> Value {
        json!({
            "sim_seconds": seconds,
            "realtime_factor": factor,
            "usb": usb,
            "diagnostics": self.diagnostics(),
        })
    }
}

impl Link for Bench {
    fn fx2(&mut self) -> &mut Fx2 {
        self.desk.fx2()
    }

    fn run_until(&mut self, t: Ps) {
        self.desk.run_until(t);
        if self.desk.robot.now() >= self.next_chore {
            self.chores();
        }
    }
}
