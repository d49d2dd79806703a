//! The boot loader in the chip: looks for an EEPROM at power-on and takes identity or program from
//! it (TRM chapter 3).

use crate::chip::Chip;
use crate::diagnostics::Rule;
use crate::eeprom::Identity;
use crate::pins::Board;
use crate::time::{Tick, tick_to_ps};
use serde::{Deserialize, Serialize};

const TAG_ID: u8 = 0xC0;
const TAG_PROGRAM: u8 = 0xC2;
/// Tag, vendor, product, device, configuration.
const HEADER: usize = 8;
/// The first device address: one word-address byte; the next one: two.
const FIRST_DEVICE: u8 = 0xA0;
const LAST_DEVICE: u8 = 0xA2;

/// The next thing to do on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Step {
    Select,
    Address(u8),
    Reselect,
    Read,
}

/// The loader at work, one bus byte at a time.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Boot {
    device: u8,
    step: Step,
    header: Vec<u8>,
    /// Length and address bytes of the present record, then what is left of it.
    record: Vec<u8>,
    address: u16,
    left: u16,
    last: bool,
}

impl Boot {
    pub(crate) fn new() -> Self {
        Self {
            device: FIRST_DEVICE,
            step: Step::Select,
            header: Vec::new(),
            record: Vec::new(),
            address: 0,
            left: 0,
            last: false,
        }
    }

    /// One byte on the bus. True = the loader is through.
    pub(crate) fn step(&mut self, chip: &mut Chip, board: &mut dyn Board) -> bool {
        let bits: Tick =
            if self.step == Step::Read || matches!(self.step, Step::Address(_)) { 9 } else { 10 };
        chip.tick += bits * chip.i2c.bit();
        let now = tick_to_ps(chip.tick);
        let address_bytes = if self.device == FIRST_DEVICE { 1 } else { 2 };
        match self.step {
            Step::Select if board.i2c_start(now, self.device) => {
                chip.i2c.set_id(address_bytes);
                self.step = Step::Address(address_bytes);
            }
            Step::Address(left) if board.i2c_write(now, 0) => {
                self.step = if left > 1 { Step::Address(left - 1) } else { Step::Reselect };
            }
            Step::Reselect if board.i2c_start(now, self.device | 1) => self.step = Step::Read,
            Step::Read => {
                let byte = board.i2c_read(now, true);
                let Some(done) = self.take(byte, chip) else { return self.give_up(chip, board) };
                if done {
                    board.i2c_stop(now);
                    self.finish(chip);
                }
                return done;
            }
            _ => return self.give_up(chip, board),
        }
        false
    }

    /// Nothing usable at this address: the next one, or the chip's own identity.
    fn give_up(&mut self, chip: &mut Chip, board: &mut dyn Board) -> bool {
        board.i2c_stop(tick_to_ps(chip.tick));
        if self.device == LAST_DEVICE {
            return true;
        }
        *self = Self { device: LAST_DEVICE, ..Self::new() };
        false
    }

    /// A byte of the image. `Some(true)` = it was the last; `None` = this is not an image.
    fn take(&mut self, byte: u8, chip: &mut Chip) -> Option<bool> {
        if self.header.len() < HEADER {
            self.header.push(byte);
            let tag = self.header[0];
            if tag != TAG_ID && tag != TAG_PROGRAM {
                return None;
            }
            if self.header.len() < HEADER {
                return Some(false);
            }
            chip.i2c.set_fast(byte & 1 != 0);
            return Some(tag == TAG_ID);
        }
        if self.left > 0 {
            chip.load(self.address, byte);
            self.address = self.address.wrapping_add(1);
            self.left -= 1;
            return Some(self.last && self.left == 0);
        }
        self.record.push(byte);
        if let [high, low, address_high, address_low] = self.record[..] {
            self.last = high & 0x80 != 0;
            self.left = u16::from_be_bytes([high & 0x03, low]);
            self.address = u16::from_be_bytes([address_high, address_low]);
            self.record.clear();
            if self.left == 0 {
                chip.report(Rule::Reserved, self.address, || {
                    "the EEPROM's image has a record without data; the rest is not loaded".into()
                });
                return Some(true);
            }
        }
        Some(false)
    }

    fn finish(&self, chip: &mut Chip) {
        let word = |at: usize| u16::from_le_bytes([self.header[at], self.header[at + 1]]);
        if self.header[0] == TAG_PROGRAM {
            // Firmware answers requests, connected or not as the configuration byte says.
            chip.usb.usbcs = 0x02 | if self.header[7] & 0x40 != 0 { 0x08 } else { 0 };
        }
        chip.usb.identity = Identity { vendor: word(1), product: word(3), device: word(5) };
    }
}
