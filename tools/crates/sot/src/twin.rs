//! `sot twin`: a robot, or one chip of it alone, for whoever develops its firmware.

use std::fs::File;
use std::io::Read;
use std::net::{SocketAddr, TcpListener, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use clap::{Subcommand, ValueEnum};
use fx2::eeprom::Eeprom;
use fx2::host::{Bench, Host, Link};
use fx2::image::{Image, ImageError};
use fx2::pins::{Board, Driven, Sensed};
use fx2::symbols::Symbols;
use fx2::{Config, Fx2, Ram, Speed};
use serde_json::{Value, json};
use sim::{MS, Ps, SECOND};
use turret_link::registry::{Kind, Twin};
use usbredir::{Event, Notice, Options};

use crate::desk::{Desk, Serial};
use crate::fifo_master::CountingMaster;
use crate::interrupt::{self, Interrupted};
use crate::output::{Usage, write_file};
use crate::program_symbols;
use crate::snapshot::Snapshot;
use crate::twin_khepera::{self, KheperaArgs};
use crate::twin_robot::{self, RobotTwinArgs, listed};

/// Run a robot, or one chip of it alone
#[derive(Subcommand)]
pub enum Command {
    Robot(RobotTwinArgs),
    Fx2(Fx2Args),
    Khepera(KheperaArgs),
}

/// An FX2 (CY7C68013) with any firmware image, served to QEMU's guests over usbredir
///
/// Without IMAGE it is a blank chip, 04b4:8613, that waits for a loader. A guest sees it after
///
///   qemu-system-x86_64 ... -device qemu-xhci,id=hc -chardev socket,id=ur,host=HOST,port=PORT
///   -device usb-redir,chardev=ur,bus=hc.0
///
/// Served, it runs in the pace of the wall clock, one client after another. With --seconds and
/// without --usbredir nothing is served: a simple host inside the program enumerates the chip, and it
/// runs as fast as it can. No board is around: all pins are open, with pull-ups.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot twin fx2                                    a blank chip at 127.0.0.1:4000
  sot twin fx2 firmware.ihx --usbredir :5000      that program, at 127.0.0.1:5000
  sot twin fx2 --eeprom boot.iic --ram 16k        an FX2LP that boots from its EEPROM
  sot twin fx2 firmware.ihx --seconds 2 --json    two simulated seconds, and what came of them
  sot twin fx2 firmware.ihx --seconds 2 --save s  the same, to go on from there with --restore s")]
pub struct Fx2Args {
    /// Program to load: Intel HEX (.ihx, .hex) or raw bytes for address 0
    image: Option<PathBuf>,
    /// Where to serve usbredir; without HOST this machine only, port 0 = any free one
    /// [default: 127.0.0.1:4000, nowhere if only --seconds is given]
    #[arg(long, value_name = "HOST:PORT")]
    usbredir: Option<String>,
    /// Contents of the boot EEPROM (C0 or C2 image; an empty file is a blank EEPROM). What firmware
    /// writes into it is put into FILE at the end
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,
    /// Main memory: 8k is the FX2 of the turret, 16k the FX2LP
    #[arg(long, value_enum, default_value_t = RamSize::K8)]
    ram: RamSize,
    /// The fastest that the bus offers
    #[arg(long, value_enum, default_value_t = BusSpeed::High)]
    speed: BusSpeed,
    /// What is soldered to the slave FIFO: nothing, or a master that writes a 16-bit counter into EP6
    /// and checks that what comes out of EP2 counts
    #[arg(long, value_enum, default_value_t = FifoMaster::None)]
    fifo_master: FifoMaster,
    /// Go on from a state that --save wrote, at its time, instead of from power-on
    #[arg(long, value_name = "FILE", conflicts_with_all = ["image", "eeprom", "ram"])]
    restore: Option<PathBuf>,
    /// Write the state at the end to FILE: the chip with its memories, and the EEPROM
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// What is plugged into both serial ports
    #[arg(long, value_enum, default_value_t = Serial::Open)]
    serial: Serial,
    /// End after so many simulated seconds [default: at Ctrl-C]
    #[arg(long, value_parser = parse_seconds)]
    seconds: Option<f64>,
    /// End with one JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Main memory.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RamSize {
    /// 8 KiB
    #[value(name = "8k")]
    K8,
    /// 16 KiB
    #[value(name = "16k")]
    K16,
}

/// Bus speeds.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BusSpeed {
    /// 480 Mbit/s
    High,
    /// 12 Mbit/s
    Full,
}

/// Masters of the slave FIFO.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FifoMaster {
    /// None
    None,
    /// Counts both ways
    Counter,
}

/// Where a chip is served if nothing else is said.
const DEFAULT_ADDRESS: &str = "127.0.0.1:4000";
/// Longer files are no programs for an 8051, whatever their kind.
const IMAGE_FILE_MAX: u64 = 1 << 20;
const EEPROM_FILE_MAX: u64 = 16 << 10;
const NOT_FX2: &str = "it is not for an FX2";
/// Sizes and I2C addresses of the EEPROMs that the boot loader looks for (TRM 3.4).
const SMALL_EEPROM: usize = 256;
const SMALL_EEPROM_ADDRESS: u8 = 0x50;
const LARGE_EEPROM_ADDRESS: u8 = 0x51;
/// First byte of an EEPROM that holds an identity only.
const IDENTITY_ONLY: u8 = 0xC0;
/// A day.
const SECONDS_MAX: f64 = 86_400.0;
/// How often the host without a guest looks at the pull-up.
const HEADLESS_SLICE: Ps = MS;
/// With less than this left it does not begin to enumerate.
const ENUMERATION_TIME: Ps = 200 * MS;
/// Diagnostics printed in the summary.
const PRINTED_MAX: usize = 20;
/// Time that the host without a guest gives one transfer.
const HEADLESS_BUDGET: Ps = 500 * MS;

/// Simulated seconds of a run.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= SECONDS_MAX => Ok(seconds),
        _ => Err(format!("write simulated seconds, more than 0 and at most {SECONDS_MAX}")),
    }
}

/// Run the verb.
pub fn run(command: &Command) -> Result<()> {
    match command {
        Command::Robot(args) => twin_robot::run(args),
        Command::Fx2(args) => run_fx2(args),
        Command::Khepera(args) => twin_khepera::run(args),
    }
}

/// The chip and its EEPROM, from power-on or as they were saved.
fn begin(args: &Fx2Args) -> Result<Snapshot> {
    if let Some(path) = &args.restore {
        return Snapshot::restore(path);
    }
    let mut chip = Fx2::new(Config {
        ram: match args.ram {
            RamSize::K8 => Ram::K8,
            RamSize::K16 => Ram::K16,
        },
        external_ram: false,
    });
    if let Some(path) = &args.image {
        load_image(&mut chip, path, args.ram)?;
    }
    let eeprom = args.eeprom.as_deref().map(read_eeprom).transpose()?;
    Ok(Snapshot { chip, eeprom })
}

fn run_fx2(args: &Fx2Args) -> Result<()> {
    let Snapshot { mut chip, eeprom } = begin(args)?;
    let symbols = Rc::new(args.image.as_deref().map(program_symbols::beside).unwrap_or_default());
    let mut board = EepromBoard { eeprom };
    let contents = board.contents();
    let listener = listen(args)?;
    let place = listener.as_ref().map(TcpListener::local_addr).transpose()?;
    let _listed = place.and_then(|place| {
        listed(&Twin { kind: Kind::Fx2, usbredir: Some(place.to_string()), serial: None })
    });

    let stop = interrupt::watch();
    let duration = args.seconds.map(|seconds| (seconds * SECOND as f64) as Ps);
    let started = Instant::now();
    let bench = Bench { fx2: &mut chip, board: &mut board };
    let master = CountingMaster::new(bench, args.fifo_master == FifoMaster::Counter);
    let mut link = Desk::new(master, args.serial, Rc::clone(&symbols), listener.is_some());
    let usb = match (&listener, duration) {
        (Some(listener), _) => serve(listener, &mut link, args.speed, duration, stop)?,
        (None, Some(duration)) => run_headless(&mut link, args.speed, duration, stop),
        (None, None) => bail!("nothing to do: neither served nor limited in time"),
    };
    let serial = link.said();
    let fifo = link.inner().as_json();
    let host_seconds = started.elapsed().as_secs_f64();
    let report = Report { usb, fifo, serial, symbols, host_seconds };

    if let (Some(path), Some(new)) = (&args.eeprom, board.contents())
        && contents.as_ref() != Some(&new)
    {
        write_file(path, &new)?;
        eprintln!("{}: the firmware wrote into the EEPROM; contents saved", path.display());
    }
    if let Some(path) = &args.save {
        Snapshot { chip: chip.clone(), eeprom: board.eeprom }.save(path)?;
        eprintln!("state saved in {}", path.display());
    }
    if args.json {
        println!("{}", report.as_json(&chip));
    } else {
        report.print(&chip);
    }
    if stop.load(Ordering::Relaxed) { Err(Interrupted.into()) } else { Ok(()) }
}

/// The bytes of `path` if they are `limit` or less: an endless file must not hang us.
pub fn read_limited(path: &Path, limit: u64, verdict: &str) -> Result<Vec<u8>> {
    let cannot = || format!("cannot read {}", path.display());
    let mut bytes = Vec::new();
    let file = File::open(path).with_context(cannot)?;
    file.take(limit + 1).read_to_end(&mut bytes).with_context(cannot)?;
    if bytes.len() as u64 > limit {
        bail!("{} is longer than {limit} bytes; {verdict}", path.display());
    }
    Ok(bytes)
}

fn load_image(chip: &mut Fx2, path: &Path, ram: RamSize) -> Result<()> {
    let bytes = read_limited(path, IMAGE_FILE_MAX, NOT_FX2)?;
    let has_colon = bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b':');
    let is_hex = path.extension().is_some_and(|ending| {
        ["ihx", "hex", "ihex"].iter().any(|hex| ending.eq_ignore_ascii_case(hex))
    });
    let image = if is_hex && !has_colon && !bytes.is_empty() {
        let cause = "it does not begin with a colon".to_owned();
        Err(ImageError::Hex { line: 1, cause })
    } else {
        Image::parse(&bytes)
    };
    let image = image.with_context(|| format!("{} cannot be used", path.display()))?;
    chip.load(&image).with_context(|| {
        let fits_16k = ram == RamSize::K8 && image.check(Ram::K16.bytes()).is_ok();
        let cure = if fits_16k { " into 8 KB; it fits an FX2LP, --ram 16k" } else { "" };
        format!("cannot load {}{cure}", path.display())
    })?;
    if !has_colon {
        let odd = if bytes.len() % 2 == 1 { ", an odd number" } else { "" };
        eprintln!("{}: {} raw bytes{odd}, taken as they are", path.display(), bytes.len());
    }
    Ok(())
}

fn read_eeprom(path: &Path) -> Result<Eeprom> {
    let bytes = read_limited(path, EEPROM_FILE_MAX, NOT_FX2)?;
    let small = bytes.len() <= SMALL_EEPROM && bytes.first() == Some(&IDENTITY_ONLY);
    let eeprom = if small {
        Eeprom::small(SMALL_EEPROM_ADDRESS, &bytes)
    } else {
        Eeprom::large(LARGE_EEPROM_ADDRESS, &bytes)
    };
    eeprom.with_context(|| format!("{} does not fit into the EEPROM", path.display()))
}

/// The socket, if anything is to be served.
fn listen(args: &Fx2Args) -> Result<Option<TcpListener>> {
    let text = match (&args.usbredir, args.seconds) {
        (Some(text), _) => text,
        (None, None) => DEFAULT_ADDRESS,
        (None, Some(_)) => return Ok(None),
    };
    let address = parse_address(text)?;
    let listener = TcpListener::bind(address).with_context(|| {
        format!("cannot serve at {address}; choose another place with --usbredir")
    })?;
    eprintln!("serving usbredir at {}", listener.local_addr()?);
    Ok(Some(listener))
}

/// HOST:PORT, :PORT or PORT; this machine only if no host is named.
pub fn parse_address(text: &str) -> Result<SocketAddr> {
    let (host, port) = text.rsplit_once(':').unwrap_or(("", text));
    let wrong = || {
        Usage(format!("--usbredir {text}: write HOST:PORT or :PORT, for example 127.0.0.1:4000"))
    };
    let port: u16 = port.parse().map_err(|_| wrong())?;
    let host = host.trim_start_matches('[').trim_end_matches(']');
    let host = if host.is_empty() { "127.0.0.1" } else { host };
    let found = (host, port).to_socket_addrs();
    found
        .with_context(|| format!("cannot find the host of --usbredir {text}"))?
        .next()
        .ok_or_else(|| anyhow!(wrong()))
}

/// The device as a host last saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    vendor: u16,
    product: u16,
    speed: Speed,
}

impl Identity {
    fn speed_name(self) -> &'static str {
        match self.speed {
            Speed::High => "high",
            Speed::Full => "full",
        }
    }

    /// For scripts.
    pub fn as_json(self) -> Value {
        json!({
            "vendor": format!("{:04x}", self.vendor),
            "product": format!("{:04x}", self.product),
            "speed": self.speed_name(),
        })
    }
}

/// Serves clients, and says on standard error who comes and goes.
pub fn serve(
    listener: &TcpListener,
    link: &mut impl Link,
    speed: BusSpeed,
    duration: Option<Ps>,
    stop: &AtomicBool,
) -> Result<Option<Identity>> {
    let options = Options { duration, high_speed: speed == BusSpeed::High, stop: Some(stop) };
    let mut usb = None;
    usbredir::serve(listener, link, options, |notice| match notice {
        Notice::PeerConnected(address) => eprintln!("client {address} connected"),
        Notice::PeerGone(None) => eprintln!("client gone"),
        Notice::PeerGone(Some(reason)) => eprintln!("client gone: {reason}"),
        Notice::Device(Event::Connected { vendor, product, speed }) => {
            let identity = Identity { vendor, product, speed };
            eprintln!("device {vendor:04x}:{product:04x} at {} speed", identity.speed_name());
            usb = Some(identity);
        }
        Notice::Device(Event::Disconnected) => {
            eprintln!("device left the bus");
            usb = None;
        }
        Notice::Device(Event::Silent) => eprintln!("device does not enumerate; trying again"),
    })
    .context("cannot serve usbredir")?;
    Ok(usb)
}

/// Plugged into a host inside the program, which enumerates whatever shows up on the bus.
fn run_headless(
    link: &mut impl Link,
    speed: BusSpeed,
    duration: Ps,
    stop: &AtomicBool,
) -> Option<Identity> {
    let mut host = if speed == BusSpeed::High { Host::new() } else { Host::full_speed() };
    let end = link.fx2().now().saturating_add(duration);
    let mut usb = None;
    let mut tried = false;
    while link.fx2().now() < end && !stop.load(Ordering::Relaxed) {
        if !link.fx2().usb_attached() {
            (usb, tried) = (None, false);
        } else if !tried && link.fx2().now() + ENUMERATION_TIME <= end {
            tried = true;
            // What has begun in time is finished: a silent device may make the run a little longer.
            host.set_budget(HEADLESS_BUDGET.min(end - link.fx2().now()));
            usb = match host.enumerate(link) {
                Ok(device) => {
                    let (vendor, product) = (device.vendor(), device.product());
                    Some(Identity { vendor, product, speed: device.speed })
                }
                Err(error) => {
                    eprintln!("the device does not enumerate: {error}");
                    None
                }
            };
        }
        let until = (link.fx2().now() + HEADLESS_SLICE).min(end);
        link.run_until(until);
    }
    usb
}

/// What is told at the end.
struct Report {
    usb: Option<Identity>,
    /// What the FIFO's master says, if there is one.
    fifo: Option<Value>,
    /// What the serial ports have said.
    serial: [String; 2],
    symbols: Rc<Symbols>,
    host_seconds: f64,
}

impl Report {
    fn realtime_factor(&self, chip: &Fx2) -> f64 {
        sim_seconds(chip) / self.host_seconds.max(1e-9)
    }

    fn as_json(&self, chip: &Fx2) -> Value {
        let usb = self.usb.map(Identity::as_json);
        let diagnostics: Vec<Value> = chip
            .diagnostics()
            .iter()
            .map(|found| {
                let place = self.symbols.locate(found.pc);
                let line = place.as_ref().and_then(|place| place.line);
                json!({
                    "pc": found.pc,
                    "function": place.as_ref().map(|place| place.function),
                    "file": line.map(|(file, _)| file),
                    "line": line.map(|(_, line)| line),
                    "rule": format!("{:?}", found.rule),
                    "address": found.address,
                    "text": found.text,
                })
            })
            .collect();
        json!({
            "sim_seconds": sim_seconds(chip),
            "realtime_factor": self.realtime_factor(chip),
            "cycles": chip.cycles(),
            "pc": chip.cpu().pc(),
            "cpu_held": chip.is_cpu_held(),
            "usb": usb,
            "fifo": self.fifo,
            "serial": self.serial,
            "diagnostics": diagnostics,
        })
    }

    fn print(&self, chip: &Fx2) {
        let usb = match self.usb {
            Some(usb) => {
                format!("{:04x}:{:04x} at {} speed", usb.vendor, usb.product, usb.speed_name())
            }
            None => "not on the bus".to_owned(),
        };
        println!("USB: {usb}");
        println!(
            "{:.3} s simulated, {:.1} times real time, {} CPU cycles",
            sim_seconds(chip),
            self.realtime_factor(chip),
            chip.cycles()
        );
        if let Some(fifo) = &self.fifo {
            println!("FIFO: {fifo}");
        }
        for (port, said) in self.serial.iter().enumerate().filter(|(_, said)| !said.is_empty()) {
            println!("serial port {port} said: {}", said.escape_debug());
        }
        let all = chip.diagnostics();
        for found in all.iter().take(PRINTED_MAX) {
            println!("{}", self.symbols.describe(found));
        }
        if all.len() > PRINTED_MAX {
            println!("and {} more, which --json lists", all.len() - PRINTED_MAX);
        }
    }
}

fn sim_seconds(chip: &Fx2) -> f64 {
    chip.now() as f64 / SECOND as f64
}

/// No board but a boot EEPROM, if there is one.
struct EepromBoard {
    eeprom: Option<Eeprom>,
}

impl EepromBoard {
    fn contents(&self) -> Option<Vec<u8>> {
        self.eeprom.as_ref().map(|eeprom| eeprom.data().to_vec())
    }
}

impl Board for EepromBoard {
    fn drive(&mut self, _now: Ps, _driven: &Driven) {}

    fn sense(&mut self, _now: Ps) -> Sensed {
        Sensed::default()
    }

    fn i2c_start(&mut self, now: Ps, address_and_direction: u8) -> bool {
        self.eeprom.as_mut().is_some_and(|eeprom| eeprom.i2c_start(now, address_and_direction))
    }

    fn i2c_write(&mut self, now: Ps, byte: u8) -> bool {
        self.eeprom.as_mut().is_some_and(|eeprom| eeprom.i2c_write(now, byte))
    }

    fn i2c_read(&mut self, now: Ps, acknowledge: bool) -> u8 {
        self.eeprom.as_mut().map_or(0xFF, |eeprom| eeprom.i2c_read(now, acknowledge))
    }

    fn i2c_stop(&mut self, now: Ps) {
        if let Some(eeprom) = &mut self.eeprom {
            eeprom.i2c_stop(now);
        }
    }

    fn still_pins(&self) -> Option<Sensed> {
        Some(Sensed::default())
    }
}
