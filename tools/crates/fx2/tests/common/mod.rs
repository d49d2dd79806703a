//! A tiny assembler and a board that writes down what it sees.

#![allow(dead_code, reason = "each test program uses a part")]

use fx2::eeprom::Eeprom;
use fx2::image::Image;
use fx2::pins::{Board, Driven, Sensed};
use fx2::{Config, Fx2};
use sim::Ps;

/// 8051 code at growing addresses from 0.
#[derive(Clone, Default)]
pub struct Program(pub Vec<u8>);

impl Program {
    /// Code that runs the CPU at 48 MHz.
    pub fn new() -> Self {
        Self::default().xdata(0xE600, 0x10)
    }

    pub fn code(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    /// MOV DPTR,#address; MOV A,#value; MOVX @DPTR,A, and 3 NOPs as SYNCDELAY.
    pub fn xdata(self, address: u16, value: u8) -> Self {
        let [high, low] = address.to_be_bytes();
        self.code(&[0x90, high, low, 0x74, value, 0xF0, 0, 0, 0])
    }

    /// MOV DPTR,#address; MOVX A,@DPTR; MOV to,A.
    pub fn read(self, address: u16, to: u8) -> Self {
        let [high, low] = address.to_be_bytes();
        self.code(&[0x90, high, low, 0xE0, 0xF5, to])
    }

    /// MOV sfr,#value.
    pub fn sfr(self, address: u8, value: u8) -> Self {
        self.code(&[0x75, address, value])
    }

    /// MOV to,from: any direct addresses.
    pub fn copy(self, to: u8, from: u8) -> Self {
        self.code(&[0x85, from, to])
    }

    /// Waits until `bit` (0..=7) of XDATA register `address` is set.
    pub fn wait(self, address: u16, bit: u8) -> Self {
        let [high, low] = address.to_be_bytes();
        // MOV DPTR; again: MOVX A,@DPTR; JNB ACC.bit,again
        self.code(&[0x90, high, low, 0xE0, 0x30, 0xE0 + bit, 0xFC])
    }

    /// Waits for GPIFTRIG bit 7: again: MOV A,GPIFTRIG; JNB ACC.7,again.
    pub fn wait_gpif(self) -> Self {
        self.code(&[0xE5, 0xBB, 0x30, 0xE7, 0xFB])
    }

    /// Fills up to `address`.
    pub fn org(mut self, address: usize) -> Self {
        assert!(self.0.len() <= address, "code is {} bytes long", self.0.len());
        self.0.resize(address, 0);
        self
    }

    /// SJMP $.
    pub fn stop(self) -> Self {
        self.code(&[0x80, 0xFE])
    }

    /// ORL PCON,#1 for ever: the CPU idles but for interrupts.
    pub fn idle(self) -> Self {
        self.code(&[0x43, 0x87, 0x01, 0x80, 0xFB])
    }

    pub fn image(&self) -> Image {
        Image::raw(&self.0).unwrap()
    }

    pub fn start(&self) -> Fx2 {
        let mut fx2 = Fx2::new(Config::default());
        fx2.load(&self.image()).unwrap();
        fx2
    }
}

/// A board that records pin changes and answers with what the test sets.
#[derive(Clone, Default)]
pub struct Bench {
    pub seen: Vec<(Ps, Driven)>,
    pub sensed: Sensed,
    /// FD shows the low byte of GPIFADR.
    pub data_is_address: bool,
    pub eeprom: Option<Eeprom>,
    pub sampled: Vec<Ps>,
    pub driven: Driven,
}

impl Board for Bench {
    fn drive(&mut self, now: Ps, driven: &Driven) {
        assert!(self.seen.last().is_none_or(|(last, _)| *last <= now), "time went back to {now}");
        self.seen.push((now, *driven));
        self.driven = *driven;
    }

    fn sense(&mut self, now: Ps) -> Sensed {
        self.sampled.push(now);
        let mut sensed = self.sensed;
        if self.data_is_address {
            sensed.fd = self.driven.gpifadr & 0xFF;
        }
        sensed
    }

    fn i2c_start(&mut self, now: Ps, byte: u8) -> bool {
        self.eeprom.as_mut().is_some_and(|e| e.i2c_start(now, byte))
    }

    fn i2c_write(&mut self, now: Ps, byte: u8) -> bool {
        self.eeprom.as_mut().is_some_and(|e| e.i2c_write(now, byte))
    }

    fn i2c_read(&mut self, now: Ps, acknowledge: bool) -> u8 {
        self.eeprom.as_mut().map_or(0xFF, |e| e.i2c_read(now, acknowledge))
    }

    fn i2c_stop(&mut self, now: Ps) {
        if let Some(e) = self.eeprom.as_mut() {
            e.i2c_stop(now);
        }
    }
}
