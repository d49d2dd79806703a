//! The I²C master (TRM chapter 13): one byte and its acknowledge bit at a time, charged at the bus's
//! speed. The board's device is called when the byte is over.

use crate::interrupts::EXIF_I2C;
use crate::pins::Board;
use crate::time::{NEVER, Tick, tick_to_ps};
use serde::{Deserialize, Serialize};

const START: u8 = 0x80;
const STOP: u8 = 0x40;
const LASTRD: u8 = 0x20;
const ID: u8 = 0x18;
const BERR: u8 = 0x04;
const ACK: u8 = 0x02;
const DONE: u8 = 0x01;
const I2CTL_400KHZ: u8 = 0x01;
const I2CTL_STOPIE: u8 = 0x02;

/// What is on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Operation {
    Start(u8),
    Write(u8),
    Read,
    Stop,
}

/// The master with I2CS, I2DAT, I2CTL.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct I2c {
    control: u8,
    status: u8,
    data: u8,
    current: Option<(Tick, Operation)>,
    /// The device addressed is to be read, and has acknowledged.
    reading: bool,
}

impl I2c {
    /// What the boot loader found: 0 nothing, 1 one address byte, 2 two (I2CS ID bits).
    pub(crate) fn set_id(&mut self, id: u8) {
        self.status = self.status & !ID | id << 3;
    }

    /// The speed that the boot loader leaves.
    pub(crate) fn set_fast(&mut self, fast: bool) {
        self.control = self.control & !I2CTL_400KHZ | u8::from(fast);
    }

    /// Ticks of one bit.
    pub(crate) fn bit(&self) -> Tick {
        if self.control & I2CTL_400KHZ != 0 { 120 } else { 480 }
    }

    pub(crate) fn read_status(&self) -> u8 {
        self.status
    }

    pub(crate) fn control(&self) -> u8 {
        self.control
    }

    pub(crate) fn write_control(&mut self, value: u8) {
        self.control = value & (I2CTL_400KHZ | I2CTL_STOPIE);
    }

    /// START, STOP and LASTRD. A STOP with nothing on the bus begins at once; otherwise it follows
    /// the byte that is on its way.
    pub(crate) fn write_status(&mut self, now: Tick, value: u8) {
        self.status = self.status & !(START | LASTRD) | value & (START | LASTRD);
        if value & STOP != 0 && self.status & STOP == 0 {
            self.status |= STOP;
            // While a read is pending the firmware still fetches the last byte from I2DAT, which
            // must not start another one; the stop itself does not wait for that.
            if self.current.is_none() {
                self.begin(now, Operation::Stop, 1);
            }
        }
    }

    pub(crate) fn write_data(&mut self, now: Tick, value: u8) {
        self.status &= !DONE;
        if self.status & START != 0 {
            self.begin(now, Operation::Start(value), 10);
        } else {
            self.begin(now, Operation::Write(value), 9);
        }
    }

    /// Reading I2DAT clears DONE and, unless a stop was asked for, starts the next byte.
    pub(crate) fn read_data(&mut self, now: Tick) -> u8 {
        self.status &= !DONE;
        if self.reading && self.status & STOP == 0 && self.current.is_none() {
            self.begin(now, Operation::Read, 9);
        }
        self.data
    }

    pub(crate) fn next_event(&self) -> Tick {
        self.current.map_or(NEVER, |(due, _)| due)
    }

    /// Finishes what is due; returns the EXIF flag it raises.
    pub(crate) fn service(&mut self, now: Tick, board: &mut dyn Board) -> u8 {
        let Some((due, operation)) = self.current.take_if(|(due, _)| *due <= now) else { return 0 };
        let at = tick_to_ps(due);
        if board.i2c_clock_held(at) {
            self.current = Some((due + self.bit(), operation));
            return 0;
        }
        if operation == Operation::Stop {
            board.i2c_stop(at);
            self.status &= !(STOP | START);
            self.reading = false;
            return if self.control & I2CTL_STOPIE != 0 { EXIF_I2C } else { 0 };
        }
        let acknowledged = match operation {
            Operation::Start(address) => {
                self.status &= !START;
                let acknowledged = board.i2c_start(at, address);
                self.reading = acknowledged && address & 1 != 0;
                acknowledged
            }
            Operation::Write(byte) => board.i2c_write(at, byte),
            Operation::Read | Operation::Stop => {
                let last = self.status & LASTRD != 0;
                self.data = board.i2c_read(at, !last);
                if last {
                    self.status &= !LASTRD;
                    self.reading = false;
                }
                !last
            }
        };
        self.status = self.status & !(ACK | BERR) | DONE | if acknowledged { ACK } else { 0 };
        if self.status & STOP != 0 {
            self.begin(due, Operation::Stop, 1);
        }
        EXIF_I2C
    }

    fn begin(&mut self, now: Tick, operation: Operation, bits: Tick) {
        self.current = Some((now + bits * self.bit(), operation));
    }
}
