//! Which robot is meant. There is no guessing: of several one must be named.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use common_sys::constants as c;
use nusb::DeviceInfo;
use thiserror::Error;

use crate::device::{Device, Identity, LinkError};
use crate::real::{self, Real};
use crate::redirected::Redirected;
use crate::registry::{self, Kind, Running};

/// A chip without a program: the FX2 as it leaves its factory.
pub const BLANK_VENDOR: u16 = 0x04B4;
/// See [`BLANK_VENDOR`].
pub const BLANK_PRODUCT: u16 = 0x8613;

/// What `--robot` says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Selector {
    /// A device on USB, by its serial number; `@1-2.3` is the place where it is plugged in.
    Usb(String),
    /// A serial line.
    Serial(PathBuf),
    /// A twin's HOST:PORT.
    Twin(String),
}

impl FromStr for Selector {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("usb", serial)) if !serial.is_empty() => Ok(Self::Usb(serial.to_owned())),
            Some(("serial", path)) if !path.is_empty() => Ok(Self::Serial(path.into())),
            Some(("twin", place)) if is_place(place) => Ok(Self::Twin(place.to_owned())),
            _ => Err(
                "write usb:SERIAL, serial:PATH or twin:HOST:PORT; `sot list` shows what there is"
                    .to_owned(),
            ),
        }
    }
}

fn is_place(text: &str) -> bool {
    text.rsplit_once(':')
        .is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok())
}

impl fmt::Display for Selector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usb(serial) => write!(f, "usb:{serial}"),
            Self::Serial(path) => write!(f, "serial:{}", path.display()),
            Self::Twin(place) => write!(f, "twin:{place}"),
        }
    }
}

/// Why no robot was chosen.
#[derive(Debug, Error)]
pub enum SelectError {
    /// More than one fits.
    #[error("there are {}: {}; say which one with --robot", .0.len(), .0.join(", "))]
    Several(Vec<String>),
    /// This verb needs another way to the robot.
    #[error("{0} does not lead to a turret; name it by usb:SERIAL or twin:HOST:PORT")]
    NotUsb(String),
    /// This verb needs a serial line.
    #[error("{0} does not lead to a serial line; name it by serial:PATH")]
    NotSerial(String),
    /// Nothing fits.
    #[error("no robot found; plug one in and switch it on, or start a twin with `sot twin robot`")]
    None,
    /// The one that was named is not there.
    #[error("{0} is not there; `sot list` shows what is")]
    NotThere(String),
    /// It is there, but cannot be used.
    #[error(transparent)]
    Link(#[from] LinkError),
}

impl SelectError {
    /// Whether another command line would help.
    pub fn is_wrong_use(&self) -> bool {
        matches!(self, Self::Several(_) | Self::NotUsb(_) | Self::NotSerial(_))
    }
}

/// Everything that may be a robot.
#[derive(Debug, Default)]
pub struct Found {
    /// On USB: turrets and chips without a program.
    pub usb: Vec<DeviceInfo>,
    /// Running twins.
    pub twins: Vec<Running>,
}

/// Whether an identity is a turret's with our firmware.
pub fn is_turret(identity: &Identity) -> bool {
    (u32::from(identity.vendor), u32::from(identity.product))
        == (c::USB_VENDOR_ID, c::USB_PRODUCT_ID)
}

/// Whether an identity is that of an FX2 without a program.
pub fn is_blank(identity: &Identity) -> bool {
    (identity.vendor, identity.product) == (BLANK_VENDOR, BLANK_PRODUCT)
}

/// Looks for everything that may be a robot.
///
/// # Errors
/// If the system does not let us look.
pub fn find() -> Result<Found, LinkError> {
    let usb = real::all()?
        .into_iter()
        .filter(|info| {
            let identity = real::identity(info);
            is_turret(&identity) || is_blank(&identity)
        })
        .collect();
    let twins = registry::running()
        .map_err(|error| LinkError::Other(format!("cannot look for twins: {error}")))?;
    Ok(Found { usb, twins })
}

/// Opens the turret that is meant; without a selector the only one there is. `blank` = a chip without
/// a program will do as well.
///
/// # Errors
/// If none or more than one fits, or it cannot be used.
pub fn open(selector: Option<&Selector>, blank: bool) -> Result<Box<dyn Device>, SelectError> {
    match selector {
        Some(Selector::Twin(place)) => Ok(Box::new(Redirected::open(place)?)),
        Some(Selector::Usb(serial)) => Ok(Box::new(Real::open(named(serial)?)?)),
        Some(other @ Selector::Serial(_)) => Err(SelectError::NotUsb(other.to_string())),
        None => open_only(blank),
    }
}

fn named(serial: &str) -> Result<DeviceInfo, SelectError> {
    let found = find()?.usb;
    let fits = |info: &DeviceInfo| match serial.strip_prefix('@') {
        Some(place) => real::socket(info) == place,
        None => info.serial_number() == Some(serial),
    };
    let mut fitting: Vec<DeviceInfo> = found.into_iter().filter(fits).collect();
    match fitting.len() {
        0 => Err(SelectError::NotThere(format!("usb:{serial}"))),
        1 => Ok(fitting.remove(0)),
        _ => Err(SelectError::Several(
            fitting.iter().map(|info| format!("usb:@{}", real::socket(info))).collect(),
        )),
    }
}

fn open_only(blank: bool) -> Result<Box<dyn Device>, SelectError> {
    let found = find()?;
    let mut usb: Vec<DeviceInfo> =
        found.usb.into_iter().filter(|info| blank || is_turret(&real::identity(info))).collect();
    let places: Vec<String> = found
        .twins
        .into_iter()
        .filter(|running| running.twin.kind != Kind::Khepera)
        .filter_map(|running| running.twin.usbredir)
        .collect();
    match (usb.len(), places.as_slice()) {
        (0, []) => Err(SelectError::None),
        (1, []) => Ok(Box::new(Real::open(usb.remove(0))?)),
        (0, [place]) => Ok(Box::new(Redirected::open(place)?)),
        _ => {
            let twins = places.iter().map(|place| format!("twin:{place}"));
            Err(SelectError::Several(usb.iter().map(real::name).chain(twins).collect()))
        }
    }
}

/// The serial line of the base that is meant; without a selector that of the only twin.
///
/// # Errors
/// If none or more than one fits: a serial line of this machine must be named.
pub fn serial_line(selector: Option<&Selector>) -> Result<PathBuf, SelectError> {
    let lines = || -> Result<Vec<Running>, SelectError> {
        let mut twins = find()?.twins;
        twins.retain(|running| running.twin.serial.is_some());
        Ok(twins)
    };
    let line_of = |running: Running| running.twin.serial.ok_or(SelectError::None);
    match selector {
        Some(Selector::Serial(path)) => Ok(path.clone()),
        Some(Selector::Usb(_)) => {
            Err(SelectError::NotSerial(selector.map(Selector::to_string).unwrap_or_default()))
        }
        Some(Selector::Twin(place)) => lines()?
            .into_iter()
            .find(|running| running.twin.usbredir.as_deref() == Some(place))
            .ok_or_else(|| SelectError::NotThere(format!("the serial line of twin:{place}")))
            .and_then(line_of),
        None => {
            let mut twins = lines()?;
            match twins.len() {
                0 => Err(SelectError::None),
                1 => line_of(twins.remove(0)),
                _ => Err(SelectError::Several(
                    twins
                        .iter()
                        .filter_map(|running| running.twin.serial.as_ref())
                        .map(|path| format!("serial:{}", path.display()))
                        .collect(),
                )),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn selectors_are_read_and_written() {
        for text in
            ["usb:A1B2", "usb:@1-2.3", "serial:/dev/ttyUSB0", "twin:127.0.0.1:4000", "twin:[::1]:7"]
        {
            assert_eq!(text.parse::<Selector>().unwrap().to_string(), text);
        }
        for text in
            ["", "usb:", "twin:4000", "twin::4000", "twin:host:70000", "/dev/ttyUSB0", "USB:1"]
        {
            assert!(text.parse::<Selector>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_serial_line_is_no_turret_and_a_turret_no_serial_line() {
        let serial = Selector::Serial("/dev/ttyS0".into());
        assert!(open(Some(&serial), false).is_err_and(|error| error.is_wrong_use()));
        assert_eq!(serial_line(Some(&serial)).unwrap(), PathBuf::from("/dev/ttyS0"));
        let usb = Selector::Usb("A1".into());
        assert!(serial_line(Some(&usb)).is_err_and(|error| error.is_wrong_use()));
    }
}
