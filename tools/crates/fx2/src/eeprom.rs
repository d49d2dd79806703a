//! Serial EEPROMs of the 24LC family: the device, and boot images for it.

use crate::image::{Image, ImageError};
use serde::{Deserialize, Serialize};
use sim::{MS, Ps};

/// Longest write cycle (24LC128 data sheet, t_WC); the device does not answer during it.
const WRITE_TIME: Ps = 5 * MS;

/// An EEPROM on the I²C bus. A board embeds it and hands its I²C calls on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Eeprom {
    address: u8,
    address_bytes: u8,
    page: usize,
    data: Vec<u8>,
    pointer: usize,
    /// Bytes of the word address still expected, counted down while the master sends them.
    expect: u8,
    selected: bool,
    /// Bytes of the page write in progress.
    pending: Vec<(usize, u8)>,
    busy_until: Ps,
}

impl Eeprom {
    /// A 24LC128-like device with `contents` at its beginning and 0xFF behind: 16 KiB, two address
    /// bytes, 64-byte pages. `address` is its 7-bit I²C address; the FX2 boots from 0x51.
    ///
    /// # Errors
    /// If `contents` is longer than the device.
    pub fn large(address: u8, contents: &[u8]) -> Result<Self, ImageError> {
        Self::new(address, 16384, 2, 64, contents)
    }

    /// A 24LC02-like device: 256 bytes, one address byte, 8-byte pages. The FX2 looks for such a
    /// device at 0x50, which is good for C0 images only.
    ///
    /// # Errors
    /// If `contents` is longer than the device.
    pub fn small(address: u8, contents: &[u8]) -> Result<Self, ImageError> {
        Self::new(address, 256, 1, 8, contents)
    }

    fn new(
        address: u8,
        size: usize,
        address_bytes: u8,
        page: usize,
        contents: &[u8],
    ) -> Result<Self, ImageError> {
        if contents.len() > size {
            return Err(ImageError::TooLong { length: contents.len(), limit: size });
        }
        let mut data = vec![0xFF; size];
        data[..contents.len()].copy_from_slice(contents);
        Ok(Self {
            address,
            address_bytes,
            page,
            data,
            pointer: 0,
            expect: 0,
            selected: false,
            pending: Vec::new(),
            busy_until: 0,
        })
    }

    /// The stored bytes.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// See [`Board::i2c_start`](crate::pins::Board::i2c_start).
    pub fn i2c_start(&mut self, now: Ps, address_and_direction: u8) -> bool {
        self.pending.clear();
        self.selected = address_and_direction >> 1 == self.address && now >= self.busy_until;
        if self.selected && address_and_direction & 1 == 0 {
            self.expect = self.address_bytes;
        }
        self.selected
    }

    /// See [`Board::i2c_write`](crate::pins::Board::i2c_write).
    pub fn i2c_write(&mut self, _now: Ps, byte: u8) -> bool {
        if !self.selected {
            return false;
        }
        if self.expect > 0 {
            // The address counter is as wide as the memory; further bits are not looked at.
            let high = if self.expect == self.address_bytes { 0 } else { self.pointer };
            self.pointer = (high << 8 | usize::from(byte)) % self.data.len();
            self.expect -= 1;
        } else {
            self.pending.push((self.pointer, byte));
            // A write never leaves its page: the address wraps inside.
            let base = self.pointer / self.page * self.page;
            self.pointer = base + (self.pointer + 1) % self.page;
        }
        true
    }

    /// See [`Board::i2c_read`](crate::pins::Board::i2c_read).
    pub fn i2c_read(&mut self, _now: Ps, acknowledge: bool) -> u8 {
        if !self.selected {
            return 0xFF;
        }
        let byte = self.data[self.pointer];
        self.pointer = (self.pointer + 1) % self.data.len();
        self.selected = acknowledge;
        byte
    }

    /// See [`Board::i2c_stop`](crate::pins::Board::i2c_stop). Starts the write cycle.
    pub fn i2c_stop(&mut self, now: Ps) {
        self.selected = false;
        if !self.pending.is_empty() {
            for (at, byte) in self.pending.drain(..) {
                self.data[at] = byte;
            }
            self.busy_until = now + WRITE_TIME;
        }
    }
}

/// USB identity in a boot image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// idVendor.
    pub vendor: u16,
    /// idProduct.
    pub product: u16,
    /// bcdDevice.
    pub device: u16,
}

/// Configuration byte of a boot image (TRM 3.4.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BootConfig {
    /// Start disconnected from USB (bit 6).
    pub disconnected: bool,
    /// Read the rest of the EEPROM at 400 kHz instead of 100 kHz (bit 0).
    pub fast: bool,
}

/// Longest data record of a C2 image: its length field has 10 bits.
const C2_RECORD_MAX: usize = 1023;

/// A C0 image: identity only; the chip enumerates by itself (TRM table 3-3).
#[must_use]
pub fn c0_image(identity: Identity, config: BootConfig) -> Vec<u8> {
    header(0xC0, identity, config)
}

/// A C2 image: identity, the program's records, and the record that starts the CPU (TRM table 3-4).
#[must_use]
pub fn c2_image(image: &Image, identity: Identity, config: BootConfig) -> Vec<u8> {
    let mut out = header(0xC2, identity, config);
    for (address, bytes) in image.segments() {
        for (n, chunk) in bytes.chunks(C2_RECORD_MAX).enumerate() {
            let at = usize::from(address) + n * C2_RECORD_MAX;
            out.extend_from_slice(&(chunk.len() as u16).to_be_bytes());
            out.extend_from_slice(&(at as u16).to_be_bytes());
            out.extend_from_slice(chunk);
        }
    }
    // Bit 7 of the length marks the last record; it clears CPUCS and so lets the CPU go.
    out.extend_from_slice(&[0x80, 0x01, 0xE6, 0x00, 0x00]);
    out
}

fn header(tag: u8, identity: Identity, config: BootConfig) -> Vec<u8> {
    let mut out = vec![tag];
    for word in [identity.vendor, identity.product, identity.device] {
        out.extend_from_slice(&word.to_le_bytes());
    }
    out.push(u8::from(config.disconnected) << 6 | u8::from(config.fast));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: Identity = Identity { vendor: 0x1209, product: 0x0001, device: 0x0101 };

    fn write(eeprom: &mut Eeprom, now: Ps, bytes: &[u8]) -> bool {
        let ok = eeprom.i2c_start(now, eeprom.address << 1)
            && bytes.iter().all(|&byte| eeprom.i2c_write(now, byte));
        eeprom.i2c_stop(now);
        ok
    }

    fn read(eeprom: &mut Eeprom, now: Ps, at: &[u8], count: usize) -> Vec<u8> {
        assert!(eeprom.i2c_start(now, eeprom.address << 1));
        assert!(at.iter().all(|&byte| eeprom.i2c_write(now, byte)));
        assert!(eeprom.i2c_start(now, eeprom.address << 1 | 1));
        let bytes = (1..=count).map(|n| eeprom.i2c_read(now, n < count)).collect();
        eeprom.i2c_stop(now);
        bytes
    }

    #[test]
    fn a_page_write_wraps_in_its_page_and_takes_its_time() {
        let mut eeprom = Eeprom::large(0x51, &[]).unwrap();
        assert!(write(&mut eeprom, 0, &[0x00, 0x3E, 1, 2, 3]));
        assert!(!eeprom.i2c_start(WRITE_TIME - 1, 0xA2), "still writing");
        assert_eq!(read(&mut eeprom, WRITE_TIME, &[0x00, 0x3E], 3), [1, 2, 0xFF]);
        assert_eq!(read(&mut eeprom, WRITE_TIME, &[0x00, 0x00], 1), [3]);
    }

    #[test]
    fn one_address_byte_reads_on_from_the_last_position() {
        let mut eeprom = Eeprom::small(0x50, &[10, 11, 12]).unwrap();
        assert_eq!(read(&mut eeprom, 0, &[1], 1), [11]);
        assert!(eeprom.i2c_start(0, 0xA1));
        assert_eq!(eeprom.i2c_read(0, false), 12);
    }

    #[test]
    fn other_addresses_and_too_long_contents_are_refused() {
        let mut eeprom = Eeprom::small(0x50, &[]).unwrap();
        assert!(!eeprom.i2c_start(0, 0xA2));
        assert!(!eeprom.i2c_write(0, 0));
        assert!(Eeprom::small(0x50, &[0; 257]).is_err());
    }

    #[test]
    fn boot_images_have_the_bytes_of_the_manual() {
        let fast = BootConfig { fast: true, disconnected: false };
        assert_eq!(c0_image(ID, fast), [0xC0, 0x09, 0x12, 0x01, 0x00, 0x01, 0x01, 0x01]);
        let image = Image::raw(&[0xAA, 0xBB]).unwrap();
        let c2 = c2_image(&image, ID, BootConfig { fast: false, disconnected: true });
        assert_eq!(c2[..8], [0xC2, 0x09, 0x12, 0x01, 0x00, 0x01, 0x01, 0x40]);
        assert_eq!(c2[8..], [0, 2, 0, 0, 0xAA, 0xBB, 0x80, 0x01, 0xE6, 0x00, 0x00]);
        assert_eq!(Image::c2(&c2), Ok(image));
        // The last record's data starts the CPU; what it is does not matter here.
        for end in 0..c2.len() - 1 {
            assert_eq!(Image::c2(&c2[..end]), Err(ImageError::NoEnd), "cut at {end}");
        }
    }
}
