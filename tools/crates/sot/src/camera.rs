//! `sot camera`: the two cameras.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use clap::{Subcommand, ValueEnum};
use common_sys::constants as c;
use serde_json::{Value, json};
use turret_link::eyes::CameraState;
use turret_link::turret::Turret;

use crate::output::Usage;
use crate::robot_args::AskArgs;
use crate::stream::Size;

/// Look after the two cameras
#[derive(Subcommand)]
pub enum Command {
    Probe(ProbeArgs),
    Setup(SetupArgs),
    Exposure(SettingArgs<Exposure>),
    Gain(SettingArgs<Gain>),
    White(SettingArgs<White>),
    Pattern(SettingArgs<Pattern>),
    Reg(RegArgs),
}

/// Ask both cameras who they are, and look whether pictures come
///
/// Exit code 1 if one of them cannot work; the line says what is wrong with it.
#[derive(clap::Args)]
#[command(
    visible_alias = "status",
    after_help = "\
Examples:
  sot camera probe
  sot camera probe --json"
)]
pub struct ProbeArgs {
    #[command(flatten)]
    on: AskArgs,
}

/// Reset both cameras and set them up from the table of the FPGA's design
///
/// Exposure, gain and white balance are automatic again, and test patterns are off.
#[derive(clap::Args)]
#[command(
    visible_alias = "reset",
    after_help = "\
Examples:
  sot camera setup
  sot camera setup --size 640x480"
)]
pub struct SetupArgs {
    #[command(flatten)]
    on: AskArgs,
    /// Size of the frames [default: as it is]
    #[arg(long, value_enum)]
    size: Option<Size>,
}

/// Which camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Eyes {
    Left,
    Right,
    Both,
}

impl Eyes {
    fn numbers(self) -> &'static [u8] {
        match self {
            Self::Left => &[0],
            Self::Right => &[1],
            Self::Both => &[0, 1],
        }
    }
}

/// One setting of the cameras.
#[derive(clap::Args)]
#[command(about = T::ABOUT, long_about = None, after_help = T::EXAMPLES)]
pub struct SettingArgs<T: Setting> {
    /// What to set it to; without it, the setting is shown
    #[arg(value_name = T::VALUE)]
    value: Option<T>,
    /// Which camera
    #[arg(long, value_enum, default_value_t = Eyes::Both)]
    eye: Eyes,
    #[command(flatten)]
    on: AskArgs,
}

/// Read or write a register of a camera
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot camera reg 0a                 the left and the right camera's product number, 76
  sot camera reg 13 0x00 --eye left everything by hand in the left one")]
pub struct RegArgs {
    /// Its address, 00 to FF in hexadecimal, as in the sensor's data sheet
    register: String,
    /// What to write: decimal, or hexadecimal with 0x
    value: Option<String>,
    /// Which camera
    #[arg(long, value_enum, default_value_t = Eyes::Both)]
    eye: Eyes,
    #[command(flatten)]
    on: AskArgs,
}

/// Run the verb.
pub fn run(command: &Command) -> Result<()> {
    match command {
        Command::Probe(args) => probe(args),
        Command::Setup(args) => setup(args),
        Command::Exposure(args) => setting(args),
        Command::Gain(args) => setting(args),
        Command::White(args) => setting(args),
        Command::Pattern(args) => setting(args),
        Command::Reg(args) => reg(args),
    }
}

const NAMES: [&str; 2] = ["left", "right"];
/// A camera has sent a frame within this, if it sends any.
const FIRST_FRAME: Duration = Duration::from_millis(1500);

/// How both are, once they had the time to send a frame.
fn settled(turret: &mut Turret) -> Result<[CameraState; 2]> {
    let began = Instant::now();
    loop {
        let states = turret.cameras()?;
        let waits =
            |state: &CameraState| matches!(state, CameraState::NoPixels | CameraState::TornFrames);
        if !states.iter().any(waits) || began.elapsed() > FIRST_FRAME {
            return Ok(states);
        }
        thread::sleep(Duration::from_millis(50));
    }
}

fn tell(states: [CameraState; 2], ids: [Option<[u8; 2]>; 2], as_json: bool) -> Result<()> {
    if as_json {
        let eye = |n: usize| {
            let id = ids[n].map(|[pid, ver]| format!("{pid:02x}{ver:02x}"));
            json!({"state": states[n].name(), "id": id, "what": states[n].to_string()})
        };
        println!("{}", json!({"left": eye(0), "right": eye(1)}));
    } else {
        for n in 0..2 {
            let id =
                ids[n].map_or(String::new(), |[pid, ver]| format!(" (id {pid:02x} {ver:02x})"));
            println!("{:<6} {}{id}", NAMES[n], states[n]);
        }
    }
    match states.iter().zip(NAMES).find(|(state, _)| **state != CameraState::Ok) {
        Some((state, name)) => bail!("the {name} camera {state}"),
        None => Ok(()),
    }
}

fn probe(args: &ProbeArgs) -> Result<()> {
    let mut turret = args.on.robot.turret()?;
    turret.config_settled()?;
    let mut ids = [None; 2];
    for eye in 0..2 {
        // An access that fails shows in the state.
        let pid = turret.camera_register(eye, c::CAMERA_REG_PID as u8);
        let ver = turret.camera_register(eye, c::CAMERA_REG_VER as u8);
        if let (Ok(pid), Ok(ver)) = (pid, ver) {
            ids[usize::from(eye)] = Some([pid, ver]);
        }
    }
    let mut states = settled(&mut turret)?;
    for (state, id) in states.iter_mut().zip(ids) {
        let wrong = id.is_some_and(|id| id.map(u32::from) != [c::CAMERA_PID, c::CAMERA_VER]);
        if wrong && *state == CameraState::Ok {
            *state = CameraState::WrongId;
        }
    }
    tell(states, ids, args.on.json)
}

fn setup(args: &SetupArgs) -> Result<()> {
    let mut turret = args.on.robot.turret()?;
    turret.config_settled()?;
    match args.size {
        Some(size) => turret.set_format(size == Size::Large)?,
        None => turret.set_up_cameras()?,
    }
    tell(settled(&mut turret)?, [None; 2], args.on.json)
}

/// A setting that lies in some registers of a camera.
pub trait Setting: Clone + Send + Sync + std::str::FromStr<Err = String> + 'static {
    /// For --help.
    const ABOUT: &'static str;
    /// For --help.
    const VALUE: &'static str;
    /// For --help.
    const EXAMPLES: &'static str;

    /// Put it into the camera.
    fn set(&self, camera: &mut Camera<'_>) -> Result<()>;
    /// What is in the camera, as it is given on the command line.
    fn get(camera: &mut Camera<'_>) -> Result<String>;
}

/// One camera of an open turret.
pub struct Camera<'a> {
    turret: &'a mut Turret,
    eye: u8,
}

impl Camera<'_> {
    fn read(&mut self, register: u32) -> Result<u8> {
        Ok(self.turret.camera_register(self.eye, register as u8)?)
    }

    fn write(&mut self, register: u32, value: u32) -> Result<()> {
        Ok(self.turret.set_camera_register(self.eye, register as u8, value as u8)?)
    }

    /// Change some bits of a register.
    fn change(&mut self, register: u32, bits: u32, value: u32) -> Result<()> {
        let old = u32::from(self.read(register)?);
        self.write(register, old & !bits | value & bits)
    }

    /// Whether the camera controls that by itself.
    fn automatic(&mut self, bit: u32) -> Result<bool> {
        Ok(u32::from(self.read(c::CAMERA_REG_COM8)?) & bit != 0)
    }
}

fn setting<T: Setting>(args: &SettingArgs<T>) -> Result<()> {
    let mut turret = args.on.robot.turret()?;
    turret.config_settled()?;
    let mut object = serde_json::Map::new();
    for &eye in args.eye.numbers() {
        let mut camera = Camera { turret: &mut turret, eye };
        if let Some(value) = &args.value {
            value.set(&mut camera)?;
        }
        let name = NAMES[usize::from(eye)];
        let now = T::get(&mut camera)?;
        if args.on.json {
            object.insert(name.into(), json!(now));
        } else {
            println!("{name:<6} {now}");
        }
    }
    if args.on.json {
        println!("{}", Value::Object(object));
    }
    Ok(())
}

/// Rows, or None for automatic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exposure(Option<u16>);

impl std::str::FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self(None)),
            _ => text.parse().map(|rows| Self(Some(rows))).map_err(|_| {
                "give auto, or 0 to 65535 rows (256 are as bright as auto at gain 1)".into()
            }),
        }
    }
}

impl Setting for Exposure {
    const ABOUT: &'static str = "Show or set the exposure: automatic, or so many rows";
    const VALUE: &'static str = "auto|ROWS";
    const EXAMPLES: &'static str = "\
Examples:
  sot camera exposure 128            half of the nominal 256 rows; the gain may still make up for it
  sot camera exposure auto --eye left";

    fn set(&self, camera: &mut Camera<'_>) -> Result<()> {
        let bit = c::CAMERA_COM8_AUTO_EXPOSURE;
        let Some(rows) = self.0.map(u32::from) else {
            return camera.change(c::CAMERA_REG_COM8, bit, bit);
        };
        camera.change(c::CAMERA_REG_COM8, bit, 0)?;
        camera.change(c::CAMERA_REG_AECHH, 0x3F, rows >> 10)?;
        camera.write(c::CAMERA_REG_AECH, rows >> 2 & 0xFF)?;
        camera.change(c::CAMERA_REG_COM1, 3, rows)
    }

    fn get(camera: &mut Camera<'_>) -> Result<String> {
        if camera.automatic(c::CAMERA_COM8_AUTO_EXPOSURE)? {
            return Ok("auto".into());
        }
        let high = u16::from(camera.read(c::CAMERA_REG_AECHH)? & 0x3F);
        let middle = u16::from(camera.read(c::CAMERA_REG_AECH)?);
        let low = u16::from(camera.read(c::CAMERA_REG_COM1)? & 3);
        Ok((high << 10 | middle << 2 | low).to_string())
    }
}

/// The gain register, or None for automatic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gain(Option<u8>);

/// What a gain register stands for.
fn gain_of(register: u8) -> f64 {
    (1.0 + f64::from(register & 0x0F) / 16.0) * f64::from(1_u32 << (register >> 4).count_ones())
}

impl std::str::FromStr for Gain {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(None));
        }
        let factor: f64 = text.parse().unwrap_or(0.0);
        if !(1.0..=31.0).contains(&factor) {
            return Err("give auto, or a factor of 1 to 31".into());
        }
        // Doublings from the lowest bit on; of registers alike the one nearest to the factor.
        let registers =
            [0x00, 0x10, 0x30, 0x70, 0xF0].into_iter().flat_map(|high: u8| high..=high + 15);
        let off = |register: &u8| (gain_of(*register) - factor).abs();
        Ok(Self(registers.min_by(|a, b| off(a).total_cmp(&off(b)))))
    }
}

impl Setting for Gain {
    const ABOUT: &'static str = "Show or set the gain: automatic, or a factor";
    const VALUE: &'static str = "auto|FACTOR";
    const EXAMPLES: &'static str = "\
Examples:
  sot camera gain 2
  sot camera gain auto --eye right";

    fn set(&self, camera: &mut Camera<'_>) -> Result<()> {
        let bit = c::CAMERA_COM8_AUTO_GAIN;
        match self.0 {
            None => camera.change(c::CAMERA_REG_COM8, bit, bit),
            Some(register) => {
                camera.change(c::CAMERA_REG_COM8, bit, 0)?;
                camera.write(c::CAMERA_REG_GAIN, u32::from(register))
            }
        }
    }

    fn get(camera: &mut Camera<'_>) -> Result<String> {
        if camera.automatic(c::CAMERA_COM8_AUTO_GAIN)? {
            return Ok("auto".into());
        }
        Ok(gain_of(camera.read(c::CAMERA_REG_GAIN)?).to_string())
    }
}

/// Red and blue in 1/128, or None for automatic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct White(Option<[u8; 2]>);

impl std::str::FromStr for White {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(None));
        }
        let factor = |text: &str| {
            let factor: f64 = text.parse().ok()?;
            (0.0..2.0).contains(&factor).then(|| (factor * 128.0).round().min(255.0) as u8)
        };
        let both = text.split_once(',').and_then(|(red, blue)| Some([factor(red)?, factor(blue)?]));
        both.map(|both| Self(Some(both)))
            .ok_or_else(|| "give auto, or factors of red and blue below 2, as 1.1,0.9".into())
    }
}

impl Setting for White {
    const ABOUT: &'static str =
        "Show or set the white balance: automatic, or factors of red and blue";
    const VALUE: &'static str = "auto|RED,BLUE";
    const EXAMPLES: &'static str = "\
Examples:
  sot camera white 1.1,0.9
  sot camera white auto";

    fn set(&self, camera: &mut Camera<'_>) -> Result<()> {
        let bit = c::CAMERA_COM8_AUTO_WHITE;
        match self.0 {
            None => camera.change(c::CAMERA_REG_COM8, bit, bit),
            Some([red, blue]) => {
                camera.change(c::CAMERA_REG_COM8, bit, 0)?;
                camera.write(c::CAMERA_REG_RED, u32::from(red))?;
                camera.write(c::CAMERA_REG_BLUE, u32::from(blue))
            }
        }
    }

    fn get(camera: &mut Camera<'_>) -> Result<String> {
        if camera.automatic(c::CAMERA_COM8_AUTO_WHITE)? {
            return Ok("auto".into());
        }
        let red = f64::from(camera.read(c::CAMERA_REG_RED)?) / 128.0;
        let blue = f64::from(camera.read(c::CAMERA_REG_BLUE)?) / 128.0;
        Ok(format!("{red},{blue}"))
    }
}

/// Number of a test pattern.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern(u32);

const PATTERNS: [&str; 4] = ["none", "ones", "bars", "fade"];

impl std::str::FromStr for Pattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = PATTERNS.iter().position(|name| *name == text);
        number
            .map(|number| Self(number as u32))
            .ok_or_else(|| format!("give one of {}", PATTERNS.join(", ")))
    }
}

impl Setting for Pattern {
    const ABOUT: &'static str = "Show or set the cameras' own test pattern";
    const VALUE: &'static str = "none|ones|bars|fade";
    const EXAMPLES: &'static str = "\
Examples:
  sot camera pattern bars            eight bars: white, yellow, cyan, green, magenta, red, blue, black
  sot camera pattern none";

    fn set(&self, camera: &mut Camera<'_>) -> Result<()> {
        let bit = |number: u32| if self.0 >> number & 1 != 0 { c::CAMERA_TEST_BIT } else { 0 };
        camera.change(c::CAMERA_REG_TEST_X, c::CAMERA_TEST_BIT, bit(0))?;
        camera.change(c::CAMERA_REG_TEST_Y, c::CAMERA_TEST_BIT, bit(1))
    }

    fn get(camera: &mut Camera<'_>) -> Result<String> {
        let x = camera.read(c::CAMERA_REG_TEST_X)? >> 7;
        let y = camera.read(c::CAMERA_REG_TEST_Y)? >> 7;
        Ok(PATTERNS[usize::from(x | y << 1)].into())
    }
}

fn reg(args: &RegArgs) -> Result<()> {
    let Ok(register) = u8::from_str_radix(args.register.trim_start_matches("0x"), 16) else {
        let text = &args.register;
        return Err(Usage(format!("\"{text}\" is no register; give 00 to ff, hexadecimal")).into());
    };
    let value = match &args.value {
        None => None,
        Some(text) => match crate::fpga_reg::parse_value(text)? {
            value @ 0..=0xFF => Some(value as u8),
            _ => return Err(Usage(format!("\"{text}\" is no value; give 0 to 255")).into()),
        },
    };
    let mut turret = args.on.robot.turret()?;
    turret.config_settled()?;
    let mut object = serde_json::Map::new();
    for &eye in args.eye.numbers() {
        if let Some(value) = value {
            turret.set_camera_register(eye, register, value)?;
        }
        let now = turret.camera_register(eye, register)?;
        let name = NAMES[usize::from(eye)];
        if args.on.json {
            object.insert(name.into(), json!(now));
        } else {
            println!("{name:<6} {register:02x} = {now:02x}");
        }
    }
    if args.on.json {
        println!("{}", Value::Object(object));
    }
    Ok(())
}
