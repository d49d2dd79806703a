//! `common/link`: every byte that crosses a wire.

#![allow(unsafe_code)] // calls into C; each with the lengths the header asks for

use core::ffi::CStr;
use std::sync::OnceLock;

use crate::ffi;

pub use ffi::{
    config_status_t as ConfigStatus, report_t as Report, slot_header_t as SlotHeader,
    store_status_t as StoreStatus, stream_header_t as StreamHeader,
};

/// Bytes of a vision report.
pub const REPORT_SIZE: usize = ffi::REPORT_SIZE as usize;
/// Bytes of a slot header.
pub const SLOT_HEADER_SIZE: usize = ffi::SLOT_HEADER_SIZE as usize;
/// Bytes of a slot record.
pub const SLOT_RECORD_SIZE: usize = ffi::SLOT_RECORD_SIZE as usize;
/// Bytes of a register write as the base sends it.
pub const REGISTER_WRITE_BYTES: usize = ffi::REGISTER_WRITE_BYTES as usize;
/// Bytes of a register read, question and answer.
pub const REGISTER_READ_BYTES: usize = ffi::REGISTER_READ_BYTES as usize;
/// Bytes of a stream record's header.
pub const STREAM_HEADER_SIZE: usize = ffi::STREAM_HEADER_SIZE as usize;
/// Bytes of the block that a streamed frame's header fills.
pub const STREAM_BLOCK: usize = ffi::STREAM_BLOCK as usize;
/// Bytes of a configuration status.
pub const CONFIG_STATUS_SIZE: usize = ffi::CONFIG_STATUS_SIZE as usize;
/// Bytes of a store status.
pub const STORE_STATUS_SIZE: usize = ffi::STORE_STATUS_SIZE as usize;
/// Bytes of a serial number as the EEPROM holds it.
pub const EEPROM_SERIAL_SIZE: usize = ffi::EEPROM_SERIAL_SIZE as usize;
/// Characters of a serial number.
pub const EEPROM_SERIAL_TEXT: usize = ffi::EEPROM_SERIAL_TEXT as usize;

/// CRC-16/CCITT-FALSE of `data`.
pub fn crc16(data: &[u8]) -> u16 {
    data.chunks(0x8000).fold(ffi::CRC16_INIT as u16, |crc, piece| {
        // SAFETY: `piece` is valid for its own length, which fits u16.
        unsafe { ffi::crc16_ccitt(crc, piece.as_ptr(), piece.len() as u16) }
    })
}

/// CRC-32 of `data`.
pub fn crc32(data: &[u8]) -> u32 {
    let crc = data.chunks(0x8000).fold(ffi::CRC32_INIT, |crc, piece| {
        // SAFETY: `piece` is valid for its own length, which fits u16.
        unsafe { ffi::crc32_update(crc, piece.as_ptr(), piece.len() as u16) }
    });
    crc ^ 0xFFFF_FFFF
}

/// The 32 bytes of `report`, CRC included.
pub fn report_encode(report: &Report) -> [u8; REPORT_SIZE] {
    let mut wire = [0; REPORT_SIZE];
    // SAFETY: `wire` has REPORT_SIZE bytes.
    unsafe { ffi::report_encode(report, wire.as_mut_ptr()) };
    wire
}

/// The report in `wire`, or None if it is damaged or of another version.
pub fn report_decode(wire: &[u8; REPORT_SIZE]) -> Option<Report> {
    let mut report = Report::default();
    // SAFETY: `wire` has REPORT_SIZE bytes.
    let error = unsafe { ffi::report_decode(wire.as_ptr(), &mut report) };
    (error == ffi::report_error_t_REPORT_OK).then_some(report)
}

/// Address and value of the register write in the base's words, if they hold a whole one.
pub fn register_write_decode(wire: &[u8; REGISTER_WRITE_BYTES]) -> Option<(u8, u16)> {
    let (mut address, mut value) = (0, 0);
    // SAFETY: `wire` has REGISTER_WRITE_BYTES bytes.
    let found = unsafe { ffi::register_write_decode(wire.as_ptr(), &mut address, &mut value) };
    (found != 0).then_some((address, value))
}

/// The words by which the base writes an FPGA register.
pub fn register_write_encode(address: u8, value: u16) -> [u8; REGISTER_WRITE_BYTES] {
    let mut wire = [0; REGISTER_WRITE_BYTES];
    // SAFETY: `wire` has REGISTER_WRITE_BYTES bytes.
    unsafe { ffi::register_write_encode(address, value, wire.as_mut_ptr()) };
    wire
}

/// The word that the base sends to read a register, and the FPGA's answer.
pub fn register_read_encode(address: u8, value: u16) -> [u8; REGISTER_READ_BYTES] {
    let mut wire = [0; REGISTER_READ_BYTES];
    // SAFETY: `wire` has REGISTER_READ_BYTES bytes.
    unsafe { ffi::register_read_encode(address, value, wire.as_mut_ptr()) };
    wire
}

/// A register of the FPGA, as `link/registers.h` lists it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Its address, 00 to 3F.
    pub address: u8,
    /// Whether it is a parameter of the detectors.
    pub is_param: bool,
    /// Its name in C.
    pub name: &'static str,
    /// Unit, or nothing.
    pub unit: &'static str,
    /// What it is, in few words.
    pub text: &'static str,
    /// Its value after configuration.
    pub reset: u16,
    /// Smallest and largest value; None if it can only be read.
    pub range: Option<(u16, u16)>,
}

/// Every register with a name, by rising address.
pub fn registers() -> &'static [Register] {
    static LIST: OnceLock<Vec<Register>> = OnceLock::new();
    LIST.get_or_init(|| {
        // SAFETY: the table has FPGA_REGISTER_COUNT entries (link/registers.h), which never change.
        let table = unsafe { &ffi::fpga_registers };
        table.iter().map(register).collect()
    })
}

fn register(entry: &ffi::fpga_register_t) -> Register {
    let text = |text: *const core::ffi::c_char| {
        // SAFETY: all texts of the table are string literals.
        unsafe { CStr::from_ptr(text) }.to_str().expect("ASCII")
    };
    Register {
        address: entry.address,
        is_param: entry.is_param != 0,
        name: text(entry.name),
        unit: text(entry.unit),
        text: text(entry.text),
        reset: entry.reset,
        range: (entry.min <= entry.max).then_some((entry.min, entry.max)),
    }
}

/// The 98 bytes of a stream record's header.
pub fn stream_header_encode(header: &StreamHeader) -> [u8; STREAM_HEADER_SIZE] {
    let mut wire = [0; STREAM_HEADER_SIZE];
    // SAFETY: `wire` has STREAM_HEADER_SIZE bytes.
    unsafe { ffi::stream_header_encode(header, wire.as_mut_ptr()) };
    wire
}

/// Why the bytes at the place of a stream header are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StreamError {
    /// The magic is missing.
    #[error("no record begins here: bytes are missing, or this is no stream of a turret")]
    NoHeader,
    /// The check sum is wrong.
    #[error("the record's header is damaged (CRC)")]
    BadCrc,
    /// Another version or kind.
    #[error("the record is of a version that this program does not know")]
    BadVersion,
    /// Impossible size or eye.
    #[error("the record's header names a size that no camera has")]
    BadSize,
}

/// The stream header in `wire`.
///
/// # Errors
/// What is wrong with it.
pub fn stream_header_decode(wire: &[u8; STREAM_HEADER_SIZE]) -> Result<StreamHeader, StreamError> {
    let mut header = StreamHeader::default();
    // SAFETY: `wire` has STREAM_HEADER_SIZE bytes.
    match unsafe { ffi::stream_header_decode(wire.as_ptr(), &mut header) } {
        ffi::stream_error_t_STREAM_OK => Ok(header),
        ffi::stream_error_t_STREAM_NO_HEADER => Err(StreamError::NoHeader),
        ffi::stream_error_t_STREAM_BAD_CRC => Err(StreamError::BadCrc),
        ffi::stream_error_t_STREAM_BAD_SIZE => Err(StreamError::BadSize),
        _ => Err(StreamError::BadVersion),
    }
}

/// First pixel of the test pattern in the frame of eye `eye` of pair `number`; each further one is
/// higher by 1, with wrap-around.
pub fn stream_pattern_first(number: u32, eye: u8) -> u16 {
    // SAFETY: a pure function of its arguments.
    unsafe { ffi::stream_pattern_first(number, eye) }
}

/// The 64 bytes of a slot header.
pub fn slot_header_encode(header: &SlotHeader) -> [u8; SLOT_HEADER_SIZE] {
    let mut wire = [0; SLOT_HEADER_SIZE];
    // SAFETY: `wire` has SLOT_HEADER_SIZE bytes.
    unsafe { ffi::slot_header_encode(header, wire.as_mut_ptr()) };
    wire
}

/// The slot header in `wire`, or the `slot_error_t` that says what is wrong with it.
pub fn slot_header_decode(wire: &[u8; SLOT_HEADER_SIZE]) -> Result<SlotHeader, i32> {
    let mut header = SlotHeader::default();
    // SAFETY: `wire` has SLOT_HEADER_SIZE bytes.
    match unsafe { ffi::slot_header_decode(wire.as_ptr(), &mut header) } {
        ffi::slot_error_t_SLOT_OK => Ok(header),
        error => Err(error),
    }
}

/// The 8 bytes of a slot record; `kind` is `SLOT_RECORD_DEFAULT` or `SLOT_RECORD_GOLDEN`.
pub fn slot_record_encode(kind: u8, sequence: u32) -> [u8; SLOT_RECORD_SIZE] {
    let mut wire = [0; SLOT_RECORD_SIZE];
    // SAFETY: `wire` has SLOT_RECORD_SIZE bytes.
    unsafe { ffi::slot_record_encode(kind, sequence, wire.as_mut_ptr()) };
    wire
}

/// Kind and sequence number of the slot record in `wire`: kind `SLOT_RECORD_FREE` where none was ever
/// written, 0 if it is damaged; the number counts for the two other kinds only.
pub fn slot_record_decode(wire: &[u8; SLOT_RECORD_SIZE]) -> (u8, u32) {
    let mut sequence = 0;
    // SAFETY: `wire` has SLOT_RECORD_SIZE bytes.
    let kind = unsafe { ffi::slot_record_decode(wire.as_ptr(), &mut sequence) };
    (kind, sequence)
}

/// The configuration status in `wire`, or None if its version is unknown.
pub fn config_status_decode(wire: &[u8; CONFIG_STATUS_SIZE]) -> Option<ConfigStatus> {
    let mut status = ConfigStatus::default();
    // SAFETY: `wire` has CONFIG_STATUS_SIZE bytes.
    let known = unsafe { ffi::config_status_decode(wire.as_ptr(), &mut status) };
    (known != 0).then_some(status)
}

/// The store status in `wire`, or None if its version is unknown.
pub fn store_status_decode(wire: &[u8; STORE_STATUS_SIZE]) -> Option<StoreStatus> {
    let mut status = StoreStatus::default();
    // SAFETY: `wire` has STORE_STATUS_SIZE bytes.
    let known = unsafe { ffi::store_status_decode(wire.as_ptr(), &mut status) };
    (known != 0).then_some(status)
}

/// The 16 bytes of the serial number `text` in the EEPROM.
pub fn eeprom_serial_encode(text: &[u8; EEPROM_SERIAL_TEXT]) -> [u8; EEPROM_SERIAL_SIZE] {
    let mut wire = [0; EEPROM_SERIAL_SIZE];
    // SAFETY: `text` has EEPROM_SERIAL_TEXT bytes, `wire` EEPROM_SERIAL_SIZE; c_char and u8 have the
    // same size and alignment.
    unsafe { ffi::eeprom_serial_encode(text.as_ptr().cast(), wire.as_mut_ptr()) };
    wire
}

/// The serial number in `wire`, or None if there is none or it is damaged.
pub fn eeprom_serial_decode(wire: &[u8; EEPROM_SERIAL_SIZE]) -> Option<[u8; EEPROM_SERIAL_TEXT]> {
    // SAFETY: `wire` has EEPROM_SERIAL_SIZE bytes.
    let whole = unsafe { ffi::eeprom_serial_check(wire.as_ptr()) } != 0;
    let text = &wire[ffi::EEPROM_SERIAL_TEXT_AT as usize..][..EEPROM_SERIAL_TEXT];
    whole.then(|| text.try_into().expect("that many"))
}
