//! The border between the chip and the board it is soldered to.

use serde::{Deserialize, Serialize};
use sim::Ps;

/// What the chip drives. A bit of `*_enable` set means that the chip drives that pin; clear, the pin
/// floats and the board's pull-ups decide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Driven {
    /// Ports A..E as general-purpose pins. While a port's pins serve another unit (PB and PD as FD,
    /// PC and PE7 as GPIFADR), they appear there and are not enabled here.
    pub port: [u8; 5],
    /// Which of those pins are outputs (OEA..OEE).
    pub port_enable: [u8; 5],
    /// `CTL[5:0]` of the GPIF; in slave-FIFO mode `CTL[2:0]` are the flags.
    pub ctl: u8,
    /// Which CTL pins are driven.
    pub ctl_enable: u8,
    /// `FD[15:0]`.
    pub fd: u16,
    /// Which FD pins are driven.
    pub fd_enable: u16,
    /// `GPIFADR[8:0]`.
    pub gpifadr: u16,
    /// Which GPIFADR pins are driven.
    pub gpifadr_enable: u16,
}

/// What the board drives onto the chip's pins, pull-ups included: every bit is a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sensed {
    /// Ports A..E.
    pub port: [u8; 5],
    /// `RDY[5:0]`.
    pub rdy: u8,
    /// `FD[15:0]`.
    pub fd: u16,
}

impl Default for Sensed {
    /// Nothing connected: pull-ups only.
    fn default() -> Self {
        Self { port: [0xFF; 5], rdy: 0x3F, fd: 0xFFFF }
    }
}

/// What the chip's pins are soldered to.
///
/// Times never go backwards from call to call. All methods are called with the time at which the
/// pins really change or are really sampled, GPIF states included, so that a board can check
/// set-up, hold and access times.
pub trait Board {
    /// The chip changed what it drives, at `now`. Called on change only.
    fn drive(&mut self, now: Ps, driven: &Driven);

    /// The levels that others put on the pins at `now`.
    fn sense(&mut self, now: Ps) -> Sensed;

    /// I2C start (or repeated start) and address byte, bit 0 = read. True = acknowledged.
    fn i2c_start(&mut self, now: Ps, address_and_direction: u8) -> bool;
    /// One byte to the addressed device. True = acknowledged.
    fn i2c_write(&mut self, now: Ps, byte: u8) -> bool;
    /// One byte from the addressed device; `acknowledge` is what the master answers to it.
    fn i2c_read(&mut self, now: Ps, acknowledge: bool) -> u8;
    /// I2C stop.
    fn i2c_stop(&mut self, now: Ps);
    /// Whether somebody holds the clock line low: the byte under way does not end before he lets go.
    fn i2c_clock_held(&mut self, _now: Ps) -> bool {
        false
    }

    /// Asked after each [`Board::drive`]: true = the chip's slice ends here, because others have to
    /// see the change before the chip goes on.
    fn end_slice(&mut self) -> bool {
        false
    }

    /// The levels on all pins, if they never change and nobody looks at what the GPIF drives: that
    /// spares a GPIF at work a call at every edge. [`Board::drive`] then only shows what is driven
    /// when the chip's slice ends.
    fn still_pins(&self) -> Option<Sensed> {
        None
    }
}

/// What listens to the pins between chip and board, or meddles with them.
pub trait Tap {
    /// The chip changed what it drives, at `now`.
    fn driven(&mut self, _now: Ps, _driven: &Driven) {}

    /// The levels that the chip gets to see instead of those that the board puts on the pins.
    fn sensed(&mut self, _now: Ps, levels: Sensed) -> Sensed {
        levels
    }
}

/// A board whose pins are tapped.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tapped<B, T> {
    /// The board.
    pub board: B,
    /// What is between it and the chip.
    pub tap: T,
}

impl<B: Board, T: Tap> Board for Tapped<B, T> {
    fn drive(&mut self, now: Ps, driven: &Driven) {
        self.tap.driven(now, driven);
        self.board.drive(now, driven);
    }

    fn sense(&mut self, now: Ps) -> Sensed {
        let levels = self.board.sense(now);
        self.tap.sensed(now, levels)
    }

    fn i2c_start(&mut self, now: Ps, address_and_direction: u8) -> bool {
        self.board.i2c_start(now, address_and_direction)
    }

    fn i2c_write(&mut self, now: Ps, byte: u8) -> bool {
        self.board.i2c_write(now, byte)
    }

    fn i2c_read(&mut self, now: Ps, acknowledge: bool) -> u8 {
        self.board.i2c_read(now, acknowledge)
    }

    fn i2c_stop(&mut self, now: Ps) {
        self.board.i2c_stop(now);
    }

    fn i2c_clock_held(&mut self, now: Ps) -> bool {
        self.board.i2c_clock_held(now)
    }

    fn end_slice(&mut self) -> bool {
        self.board.end_slice()
    }
}

/// A chip on no board: pull-ups, and nobody answers on I2C.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Unconnected;

impl Board for Unconnected {
    fn drive(&mut self, _now: Ps, _driven: &Driven) {}

    fn sense(&mut self, _now: Ps) -> Sensed {
        Sensed::default()
    }

    fn i2c_start(&mut self, _now: Ps, _address_and_direction: u8) -> bool {
        false
    }

    fn i2c_write(&mut self, _now: Ps, _byte: u8) -> bool {
        false
    }

    fn i2c_read(&mut self, _now: Ps, _acknowledge: bool) -> u8 {
        0xFF
    }

    fn i2c_stop(&mut self, _now: Ps) {}

    fn still_pins(&self) -> Option<Sensed> {
        Some(Sensed::default())
    }
}
