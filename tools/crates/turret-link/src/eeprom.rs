//! Writing the boot EEPROM, through a small program of its own that is loaded into the FX2's RAM and
//! answers nothing else: `common/link/eeprom.h`. Whenever it is cut off, the turret starts as a blank
//! chip or with a whole image.

use std::ops::Range;

use common_sys::constants as c;
use common_sys::link::{EEPROM_SERIAL_SIZE, EEPROM_SERIAL_TEXT, crc16, eeprom_serial_encode};
use fx2::image::Image;
use thiserror::Error;

use crate::device::{Device, LinkError, Setup};
use crate::ram::{self, RamError};
use crate::turret::Progress;

const VENDOR_OUT: u8 = 0x40;
const VENDOR_IN: u8 = 0xC0;
const PAGE: usize = c::EEPROM_PAGE as usize;
/// Bytes that a boot image may have.
pub const IMAGE_MAX: usize = c::EEPROM_SERIAL_AT as usize;

/// Why the EEPROM was not written.
#[derive(Debug, Error)]
pub enum EepromError {
    /// The program that writes it does not run.
    #[error("the EEPROM loader does not run: {0}")]
    Loader(#[from] RamError),
    /// The way to the device is broken.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The image is too long.
    #[error("the boot image has {0} bytes; {IMAGE_MAX} fit")]
    TooLong(usize),
    /// It is no image to boot from.
    #[error("it is no boot image: the first byte is {0:02X}, not C2")]
    NoImage(u8),
    /// A serial number of another form.
    #[error("a serial number has {EEPROM_SERIAL_TEXT} characters 0-9 or A-Z, not \"{0}\"")]
    Serial(String),
    /// It reads back differently.
    #[error("the EEPROM reads back differently at {0:#06x}: it is worn or write-protected")]
    Differs(usize),
    /// The loader says why.
    #[error("the EEPROM {0}")]
    Failed(&'static str),
}

/// The loader, running.
pub struct Loader {
    device: Box<dyn Device>,
}

impl Loader {
    /// Loads and starts it, whatever ran before.
    ///
    /// # Errors
    /// If it does not answer then.
    pub fn start(mut device: Box<dyn Device>, program: &Image) -> Result<Self, EepromError> {
        ram::run(&mut *device, program)?;
        let mut loader = Self { device };
        loader.status()?;
        Ok(loader)
    }

    /// The device, with the loader still in its RAM.
    pub fn into_device(self) -> Box<dyn Device> {
        self.device
    }

    fn setup(kind: u8, request: u32, value: usize, index: u16) -> Setup {
        Setup { kind, request: request as u8, value: value as u16, index }
    }

    /// Result of the last request.
    fn status(&mut self) -> Result<u8, EepromError> {
        let setup = Self::setup(VENDOR_IN, c::REQUEST_LOADER_STATUS, 0, 0);
        let reply = self.device.control_in(setup, c::LOADER_STATUS_SIZE as u16)?;
        match reply.as_slice() {
            &[version, result, _, _] if u32::from(version) == c::LOADER_VERSION => Ok(result),
            _ => Err(EepromError::Failed("loader is of a version that this program does not know")),
        }
    }

    fn request(
        &mut self,
        request: u32,
        value: usize,
        index: u16,
        data: &[u8],
    ) -> Result<(), EepromError> {
        let setup = Self::setup(VENDOR_OUT, request, value, index);
        match self.device.control_out(setup, data) {
            Err(LinkError::Refused) => Err(self.why()),
            other => Ok(other?),
        }
    }

    fn why(&mut self) -> EepromError {
        let result = match self.status() {
            Ok(result) => result,
            Err(error) => return error,
        };
        EepromError::Failed(match u32::from(result) {
            c::LOADER_NO_EEPROM => "does not answer on the I2C bus: is it fitted?",
            c::LOADER_TIMEOUT => "did not finish writing a page: it is worn",
            c::LOADER_DIFFERS => "reads back differently: it is worn or write-protected",
            c::LOADER_BAD_CRC => "holds something else than was written; write it again",
            c::LOADER_NOT_BEGUN => "loader was restarted in between; write it again",
            _ => "loader refuses the request",
        })
    }

    /// Reads.
    ///
    /// # Errors
    /// If the EEPROM does not answer.
    pub fn read(&mut self, range: Range<usize>) -> Result<Vec<u8>, EepromError> {
        let mut bytes = Vec::new();
        for at in range.clone().step_by(PAGE) {
            let count = PAGE.min(range.end - at);
            let setup = Self::setup(VENDOR_IN, c::REQUEST_LOADER_READ, at, 0);
            match self.device.control_in(setup, count as u16) {
                Ok(piece) => bytes.extend(piece),
                Err(LinkError::Refused) => return Err(self.why()),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(bytes)
    }

    /// Writes a boot image, whole or not at all: while it is being written, and if that is cut off, the
    /// turret starts as a blank chip. Reads it back.
    ///
    /// # Errors
    /// If it is not there now.
    pub fn write_image(&mut self, image: &[u8], progress: Progress) -> Result<(), EepromError> {
        check_image(image)?;
        self.request(c::REQUEST_LOADER_BEGIN, 0, 0, &[])?;
        for (number, page) in image.chunks(PAGE).enumerate() {
            self.request(c::REQUEST_LOADER_WRITE, number * PAGE, 0, page)?;
            progress(number * PAGE + page.len(), image.len());
        }
        self.request(c::REQUEST_LOADER_COMMIT, image.len(), crc16(image), &[])?;
        let read = self.read(0..image.len())?;
        match read.iter().zip(image).position(|(a, b)| a != b) {
            None if read.len() == image.len() => Ok(()),
            at => Err(EepromError::Differs(at.unwrap_or(read.len()))),
        }
    }

    /// Writes the serial number, and reads it back.
    ///
    /// # Errors
    /// If it is not there now.
    pub fn write_serial(&mut self, serial: &str) -> Result<(), EepromError> {
        let wire = encode_serial(serial)?;
        let at = c::EEPROM_SERIAL_AT as usize;
        self.request(c::REQUEST_LOADER_WRITE, at, 0, &wire)?;
        if self.read(at..at + wire.len())? == wire {
            return Ok(());
        }
        Err(EepromError::Differs(at))
    }
}

/// The bytes of a serial number in the EEPROM.
///
/// # Errors
/// If it is none.
pub fn encode_serial(serial: &str) -> Result<[u8; EEPROM_SERIAL_SIZE], EepromError> {
    let good = |text: &&[u8; EEPROM_SERIAL_TEXT]| {
        text.iter().all(|byte| byte.is_ascii_digit() || byte.is_ascii_uppercase())
    };
    let text = serial.as_bytes().try_into().ok().filter(good);
    text.map(eeprom_serial_encode).ok_or_else(|| EepromError::Serial(serial.to_owned()))
}

/// Whether `image` is one to boot from, and fits.
///
/// # Errors
/// If not.
pub fn check_image(image: &[u8]) -> Result<(), EepromError> {
    if image.len() > IMAGE_MAX {
        return Err(EepromError::TooLong(image.len()));
    }
    match image.first() {
        Some(&first) if u32::from(first) == c::EEPROM_BOOT => Ok(()),
        first => Err(EepromError::NoImage(first.copied().unwrap_or(c::EEPROM_BLANK as u8))),
    }
}
