//! Loading a program into the FX2's RAM: vendor request A0, which the chip answers by itself, whatever
//! firmware runs.

use common_sys::constants as c;
use fx2::image::Image;
use thiserror::Error;

use crate::device::{Device, LinkError, Setup};

const VENDOR_OUT: u8 = 0x40;
const VENDOR_IN: u8 = 0xC0;
const RAM_REQUEST: u8 = 0xA0;
/// The register whose bit 0 holds the CPU.
const CPUCS: u16 = 0xE600;
/// Bytes of a transfer: what every host controller takes.
const PIECE: usize = 1024;
/// Main memory of the turret's FX2.
const RAM_SIZE: usize = 0x2000;

/// Why the program does not run.
#[derive(Debug, Error)]
pub enum RamError {
    /// The way to the device is broken.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It does not fit.
    #[error(transparent)]
    Image(#[from] fx2::image::ImageError),
    /// What was loaded reads back differently.
    #[error("the RAM reads back differently at {0:#06x}; is it an FX2?")]
    Differs(usize),
}

fn setup(kind: u8, at: usize) -> Setup {
    Setup { kind, request: RAM_REQUEST, value: at as u16, index: 0 }
}

fn hold(device: &mut dyn Device, held: bool) -> Result<(), LinkError> {
    device.control_out(setup(VENDOR_OUT, usize::from(CPUCS)), &[u8::from(held)])
}

/// Stops the CPU, loads `image`, reads it back, and starts the CPU.
///
/// # Errors
/// If it does not fit, is not in the RAM afterwards, or the device does not answer. The CPU is held
/// then.
pub fn run(device: &mut dyn Device, image: &Image) -> Result<(), RamError> {
    image.check(RAM_SIZE)?;
    hold(device, true)?;
    for (address, bytes) in image.segments() {
        for (number, piece) in bytes.chunks(PIECE).enumerate() {
            let at = usize::from(address) + number * PIECE;
            device.control_out(setup(VENDOR_OUT, at), piece)?;
        }
    }
    for (address, bytes) in image.segments() {
        for (number, piece) in bytes.chunks(PIECE).enumerate() {
            let at = usize::from(address) + number * PIECE;
            let read = device.control_in(setup(VENDOR_IN, at), piece.len() as u16)?;
            if read != piece {
                let same = read.iter().zip(piece).take_while(|(a, b)| a == b).count();
                return Err(RamError::Differs(at + same));
            }
        }
    }
    Ok(hold(device, false)?)
}

/// What a turret with our firmware is in its boot image.
pub fn identity() -> fx2::eeprom::Identity {
    fx2::eeprom::Identity {
        vendor: c::USB_VENDOR_ID as u16,
        product: c::USB_PRODUCT_ID as u16,
        device: ((c::USB_API_LEVEL << 8) | c::USB_BOARD_REVISION) as u16,
    }
}
