//! `sot twin khepera`: the emulated base alone, with its serial line on a pseudo-terminal.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use khepera::battery::Battery;
use khepera::turret_bus::Unconnected;
use khepera::{Base, Config, Load, ResetCause, WheelFault};
use serde_json::{Value, json};
use sim::{MS, Ps, SECOND};
use turret_link::registry::{self, Kind, Twin};
use world::open_floor::OpenFloor;

use crate::interrupt::{self, Interrupted};
use crate::output::write_file;
use crate::play::Noise;
use crate::pty::Pty;
use crate::twin::{parse_seconds, read_limited};

/// A Khepera base (MC68331) with any firmware image, its serial line on a pseudo-terminal
///
/// Without IMAGE it runs the firmware just built. The base stands on an endless floor with nothing
/// around it and no turret on top; --noise says how well its wheels hold it, --battery lets it empty.
///
/// It runs in the pace of the wall clock, and the pseudo-terminal is there once the base has been on
/// for half a simulated second. Characters take the time that they take on the wire at the baud rate
/// the firmware has set, whatever rate the client asks of the pseudo-terminal; with --baud the other
/// end of the line has a rate of its own, and a wrong one garbles. With --seconds and without --pty
/// nothing is served: it runs as fast as it can and prints what the base says.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot twin khepera --pty /tmp/khepera             our firmware; then: sot console --robot serial:/tmp/khepera
  sot twin khepera program.s37 --pty ./tty        any other program
  sot twin khepera --flash robot.bin --pty ./tty  a base that keeps what is saved and flashed
  sot twin khepera --seconds 2 --json             two simulated seconds, and what came of them
  sot twin khepera --pty ./tty --fault encoder-stuck-left@5
                                                  after 5 s the left encoder stands still
  sot twin khepera --pty ./tty --noise measured --battery 20
                                                  wheels that slip, and a battery nearly empty")]
pub struct KheperaArgs {
    /// Program: ELF, S-records, or the flash's contents as raw bytes [default: the one just built]
    image: Option<PathBuf>,
    /// The flash's contents: taken from FILE if it is there, and put into it at the end, with what the
    /// program has saved and what was flashed
    #[arg(long, value_name = "FILE", conflicts_with = "image")]
    flash: Option<PathBuf>,
    /// Where to link the pseudo-terminal [default: nowhere, its name is printed]
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Rate of the line's other end, 8N1 [default: follows the firmware's]
    #[arg(long, value_parser = clap::value_parser!(u32).range(300..=1_000_000))]
    baud: Option<u32>,
    /// How its wheels are: none = equal, and they slip only where they must; measured and harsh as in
    /// `sot play`, unequal, with slip and drag and a battery that is not quite full
    #[arg(long, value_enum, default_value_t = Noise::None)]
    noise: Noise,
    /// Draws what is peculiar to this robot, with --noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A battery that empties, charged to so much, in percent [default: one that does not]
    #[arg(long, value_name = "PERCENT", value_parser = parse_percent)]
    battery: Option<f64>,
    /// What breaks when, in simulated seconds; may be given more than once
    #[arg(long, value_name = "FAULT@SECONDS", value_parser = parse_fault)]
    fault: Vec<Fault>,
    /// End after so many simulated seconds [default: at Ctrl-C]
    #[arg(long, value_parser = parse_seconds)]
    seconds: Option<f64>,
    /// End with one JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Longer files are no programs for the base: S-records take under three characters a byte.
const IMAGE_FILE_MAX: u64 = 16 << 20;
/// The pseudo-terminal appears when the base has been on for so long: programs take a moment to set
/// their serial line up, and characters that come sooner are lost.
const START_UP: Ps = SECOND / 2;
/// How far the base runs between two looks at the pseudo-terminal.
const SLICE: Ps = MS;
const REST: Duration = Duration::from_millis(1);
/// Further behind the wall clock than this, the lost time is given up, not made up for.
const LAG_MAX: Duration = Duration::from_millis(200);
/// Characters handed to the emulated line at a time: the client's own buffer is the long one.
const LINE_QUEUE: usize = 32;
const BROWN_OUT_MV: u32 = 3000;

/// What can break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Break {
    Wheel(usize, WheelFault),
    AdcSilent,
    BrownOut,
    PowerOff,
}

const FAULTS: [(&str, Break); 10] = [
    ("encoder-stuck-left", Break::Wheel(0, WheelFault::EncoderStuck)),
    ("encoder-stuck-right", Break::Wheel(1, WheelFault::EncoderStuck)),
    ("motor-stalled-left", Break::Wheel(0, WheelFault::Stalled)),
    ("motor-stalled-right", Break::Wheel(1, WheelFault::Stalled)),
    ("motor-open-left", Break::Wheel(0, WheelFault::MotorOpen)),
    ("motor-open-right", Break::Wheel(1, WheelFault::MotorOpen)),
    ("adc-silent", Break::AdcSilent),
    ("brown-out", Break::BrownOut),
    ("power-off", Break::PowerOff),
    ("repaired", Break::Wheel(usize::MAX, WheelFault::None)),
];

/// A fault and when it comes.
#[derive(Clone, Copy, Debug)]
struct Fault {
    what: Break,
    at: Ps,
}

fn parse_fault(text: &str) -> Result<Fault, String> {
    let names = || FAULTS.map(|(name, _)| name).join(", ");
    let wrong = || format!("write FAULT@SECONDS with FAULT one of {}", names());
    let (name, seconds) = text.split_once('@').ok_or_else(wrong)?;
    let (_, what) = FAULTS.into_iter().find(|(known, _)| *known == name).ok_or_else(wrong)?;
    let at = if seconds == "0" { 0 } else { (parse_seconds(seconds)? * SECOND as f64) as Ps };
    Ok(Fault { what, at })
}

impl Fault {
    fn inject(self, base: &mut Base) {
        match self.what {
            Break::Wheel(wheel @ (0 | 1), fault) => base.set_wheel_fault(wheel, fault),
            Break::AdcSilent => base.set_adc_silent(true),
            Break::BrownOut => base.set_battery_mv(BROWN_OUT_MV),
            Break::PowerOff => base.set_power(false),
            Break::Wheel(..) => {
                base.set_wheel_fault(0, WheelFault::None);
                base.set_wheel_fault(1, WheelFault::None);
                base.set_adc_silent(false);
                base.set_battery_mv(Config::default().battery_mv);
                base.set_power(true);
            }
        }
    }
}

fn parse_percent(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(percent) if (0.0..=100.0).contains(&percent) => Ok(percent),
        _ => Err("write a percentage, 0 to 100".to_owned()),
    }
}

/// Run the verb.
pub fn run(args: &KheperaArgs) -> Result<()> {
    let (base, name) = switched_on(args)?;
    let mut bench = Bench::new(base, args);
    let stop = interrupt::watch();
    let end = args.seconds.map_or(Ps::MAX, |seconds| (seconds * SECOND as f64) as Ps);
    let headless = args.pty.is_none() && args.seconds.is_some();
    let started = Instant::now();
    let said = if headless {
        Some(bench.run_free(end, stop))
    } else {
        bench.serve(args, &name, end, stop)?;
        None
    };
    let host_seconds = started.elapsed().as_secs_f64();
    if let Some(path) = &args.flash {
        write_file(path, bench.base.flash())?;
    }
    if args.json {
        println!("{}", bench.as_json(host_seconds, said.as_deref()));
    } else {
        bench.print(host_seconds, said.as_deref());
    }
    if stop.load(Ordering::Relaxed) { Err(Interrupted.into()) } else { Ok(()) }
}

/// The base, its flash filled, and what it was filled with.
fn switched_on(args: &KheperaArgs) -> Result<(Base, PathBuf)> {
    let config = Config { host_baud: args.baud, ..Config::default() };
    let unusable = |name: &Path| format!("{} cannot be used", name.display());
    if let Some(path) = args.flash.as_ref().filter(|path| path.exists()) {
        let contents = read_limited(path, IMAGE_FILE_MAX, "it is not a Khepera's flash")?;
        let base = Base::from_flash(&contents, config).with_context(|| unusable(path))?;
        return Ok((base, path.clone()));
    }
    let (image, name) = read_image(args.image.as_deref())?;
    let base = Base::new(&image, config).with_context(|| unusable(&name))?;
    Ok((base, name))
}

fn read_image(given: Option<&Path>) -> Result<(Vec<u8>, PathBuf)> {
    let path = match given {
        Some(path) => path.to_owned(),
        None => crate::play::built_image(crate::play::KHEPERA_IMAGE)?,
    };
    Ok((read_limited(&path, IMAGE_FILE_MAX, "it is not for a Khepera")?, path))
}

/// The base and what is to happen to it.
struct Bench {
    base: Base,
    /// Faults still to come, the last one first.
    faults: Vec<Fault>,
    floor: OpenFloor,
    battery: Option<Battery>,
    /// A fault has taken the supply's voltage over.
    supply_fault: bool,
    /// When floor and battery are looked after next.
    next_step: Ps,
}

impl Bench {
    fn new(mut base: Base, args: &KheperaArgs) -> Self {
        let mut faults = args.fault.clone();
        faults.sort_by_key(|fault| std::cmp::Reverse(fault.at));
        let floor = OpenFloor::new(args.noise.into(), args.seed);
        base.set_load(floor.wheel_loads_n());
        let full_mv = f64::from(Config::default().battery_mv) * floor.battery();
        base.set_battery_mv(full_mv as u32);
        let battery = args.battery.map(|percent| Battery::connect(&mut base, percent / 100.0));
        Self { base, faults, floor, battery, supply_fault: false, next_step: MS }
    }

    fn run_until(&mut self, t: Ps) {
        while self.base.now() < t {
            while let Some(fault) = self.faults.pop_if(|fault| fault.at <= self.base.now()) {
                self.supply_fault = match fault.what {
                    Break::BrownOut => true,
                    Break::Wheel(usize::MAX, _) => false,
                    _ => self.supply_fault,
                };
                fault.inject(&mut self.base);
            }
            let fault = self.faults.last().map_or(Ps::MAX, |fault| fault.at);
            let next = (self.base.now() / MS + 1) * MS;
            self.base.run_until(next.min(fault).min(t), &mut Unconnected);
            if self.base.now() >= self.next_step {
                self.step();
            }
        }
    }

    /// What a millisecond does to floor and battery.
    fn step(&mut self) {
        self.next_step += MS;
        self.floor.step(self.base.wheel_speeds_mm_s());
        if let Some(battery) = self.battery.as_mut().filter(|_| !self.supply_fault) {
            battery.step(&mut self.base);
        }
    }

    /// As fast as it goes; returns what the base said.
    fn run_free(&mut self, end: Ps, stop: &AtomicBool) -> Vec<u8> {
        let mut said = Vec::new();
        while self.base.now() < end && !stop.load(Ordering::Relaxed) {
            self.run_until((self.base.now() + SLICE).min(end));
            said.extend(self.base.serial_take().into_iter().map(|(_, byte)| byte));
        }
        said
    }

    /// With a pseudo-terminal, in the pace of the wall clock.
    fn serve(
        &mut self,
        args: &KheperaArgs,
        image: &Path,
        end: Ps,
        stop: &AtomicBool,
    ) -> Result<()> {
        self.run_until(START_UP.min(end));
        self.base.serial_take();
        let mut line = Line::new(Pty::open(args.pty.as_deref())?);
        let serial = std::path::absolute(line.name())?;
        let twin = Twin { kind: Kind::Khepera, usbredir: None, serial: Some(serial) };
        // As long as this is kept, `sot list` shows it.
        let _entry = registry::register(&twin).context("cannot tell others of this twin")?;
        eprintln!("{}: serial line at {}", image.display(), line.pty.name().display());
        let mut pace = Pace::new(self.base.now());
        while self.base.now() < end && !stop.load(Ordering::Relaxed) {
            self.run_until(pace.now().min(end));
            line.forward(&mut self.base)?;
            line.rest();
        }
        Ok(())
    }

    fn sim_seconds(&self) -> f64 {
        self.base.now() as f64 / SECOND as f64
    }

    fn as_json(&self, host_seconds: f64, said: Option<&[u8]>) -> Value {
        let base = &self.base;
        let resets: Vec<Value> = base
            .resets()
            .iter()
            .map(|reset| {
                let seconds = reset.time as f64 / SECOND as f64;
                json!({ "seconds": seconds, "cause": cause_name(reset.cause) })
            })
            .collect();
        let motors: Vec<Value> = base
            .motors()
            .iter()
            .map(|motor| json!(if motor.forward { motor.duty } else { -motor.duty }))
            .collect();
        let latency =
            base.worst_interrupt_latency().map(|ps| ps as f64 / (SECOND / 1_000_000) as f64);
        let diagnostics: Vec<String> = base.diagnostics().iter().map(ToString::to_string).collect();
        let pose = self.floor.pose();
        let battery = self.battery.as_ref().map(|battery| {
            json!({
                "percent": 100.0 * battery.charge(),
                "millivolt": battery.millivolt(),
                "ampere": battery.current_a(),
            })
        });
        json!({
            "sim_seconds": self.sim_seconds(),
            "realtime_factor": self.sim_seconds() / host_seconds.max(1e-9),
            "cpu": format!("{:?}", base.cpu_state()).to_lowercase(),
            "cpu_load": base.load().since(&Load::default()),
            "pc": base.pc(),
            "system_hz": base.system_hz(),
            "resets": resets,
            "motors": motors,
            "wheel_travel_mm": base.wheel_travel_mm(),
            "wheel_speed_mm_s": base.wheel_speeds_mm_s(),
            "pose": { "x_mm": pose.x_mm, "y_mm": pose.y_mm, "heading_deg": pose.heading_rad.to_degrees() },
            "battery": battery,
            "leds": base.leds(),
            "interrupt_latency_us": latency,
            "serial_framing_errors": base.serial_framing_errors(),
            "serial": said.map(String::from_utf8_lossy),
            "diagnostics": diagnostics,
        })
    }

    fn print(&self, host_seconds: f64, said: Option<&[u8]>) {
        if let Some(said) = said {
            print!("{}", String::from_utf8_lossy(said));
        }
        let base = &self.base;
        let load = base.load().since(&Load::default());
        println!(
            "{:.3} s simulated, {:.1} times real time; 68331 {:.1} % busy, {:?}",
            self.sim_seconds(),
            self.sim_seconds() / host_seconds.max(1e-9),
            load * 100.0,
            base.cpu_state()
        );
        if let Some(battery) = &self.battery {
            let (percent, mv) = (100.0 * battery.charge(), battery.millivolt());
            println!("battery {percent:.1} %, {mv} mV, {:.3} A", battery.current_a());
        }
        for reset in base.resets() {
            let seconds = reset.time as f64 / SECOND as f64;
            println!("reset at {seconds:.3} s by {}", cause_name(reset.cause));
        }
        for found in base.diagnostics() {
            println!("{found}");
        }
    }
}

fn cause_name(cause: ResetCause) -> &'static str {
    match cause {
        ResetCause::External => "external",
        ResetCause::PowerUp => "power",
        ResetCause::Watchdog => "watchdog",
        ResetCause::Halt => "halt monitor",
    }
}

/// The wall clock as simulated time.
struct Pace {
    started: Instant,
    origin: Ps,
    last: Instant,
}

impl Pace {
    fn new(origin: Ps) -> Self {
        let now = Instant::now();
        Self { started: now, origin, last: now }
    }

    /// Simulated time that has come. After a pause of the whole program it goes on, it does not jump.
    fn now(&mut self) -> Ps {
        let now = Instant::now();
        let missed = now.duration_since(self.last);
        if missed > LAG_MAX {
            self.started += missed - LAG_MAX;
        }
        self.last = now;
        self.origin + now.duration_since(self.started).as_nanos() as Ps * (SECOND / 1_000_000_000)
    }
}

/// Carries characters between the pseudo-terminal and the base.
pub struct Line {
    pty: Pty,
    /// From the base, not yet taken by the client.
    to_client: Vec<u8>,
    /// The emulated line can take no more for the moment.
    full: bool,
}

impl Line {
    /// A line at `pty`.
    pub fn new(pty: Pty) -> Self {
        Self { pty, to_client: Vec::new(), full: false }
    }

    /// The device that clients open.
    pub fn name(&self) -> &Path {
        self.pty.name()
    }

    /// Carries what has come, both ways; to be called every millisecond or so.
    pub fn forward(&mut self, base: &mut Base) -> Result<()> {
        let mut buffer = [0; LINE_QUEUE];
        let room = LINE_QUEUE.saturating_sub(base.serial_waiting());
        // Without room it only asks whether somebody is there.
        let count = self.pty.read(&mut buffer[..room])?;
        base.serial_send(&buffer[..count]);
        self.full = room == 0;
        self.to_client.extend(base.serial_take().into_iter().map(|(_, byte)| byte));
        let taken = self.pty.write(&self.to_client)?;
        self.to_client.drain(..taken);
        // Nobody reads: a UART does not wait either.
        let keep = self.to_client.len().min(CLIENT_BUFFER);
        self.to_client.drain(..self.to_client.len() - keep);
        Ok(())
    }

    fn rest(&self) {
        if self.full {
            std::thread::sleep(REST);
        } else {
            self.pty.wait(REST);
        }
    }
}

/// What is kept for a client that has opened the pseudo-terminal and does not read, beside what the
/// system keeps.
const CLIENT_BUFFER: usize = 64 << 10;
