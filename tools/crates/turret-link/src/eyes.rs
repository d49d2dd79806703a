//! The turret's eyes: FPGA registers, cameras, and the stream.

use std::fmt;

use common_sys::constants as c;

use crate::device::{LinkError, Setup};
use crate::turret::{Turret, TurretError};

const VENDOR_OUT: u8 = 0x40;
const VENDOR_IN: u8 = 0xC0;

/// How a camera is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraState {
    /// Set up, and sending whole frames.
    Ok,
    /// No acknowledge.
    NoAck,
    /// The clock line is held low.
    BusStuck,
    /// Another chip.
    WrongId,
    /// The multiplexer before it does not acknowledge.
    NoMux,
    /// No design in the FPGA, so that it has no clock.
    NoFpga,
    /// It answers, but no picture comes.
    NoPixels,
    /// Its frames lack rows or columns.
    TornFrames,
    /// Never set up, or a code that this program does not know.
    Unknown,
}

impl CameraState {
    fn from_code(code: u8) -> Self {
        match u32::from(code) {
            c::CAMERA_OK => Self::Ok,
            c::CAMERA_NO_ACK => Self::NoAck,
            c::CAMERA_BUS_STUCK => Self::BusStuck,
            c::CAMERA_WRONG_ID => Self::WrongId,
            c::CAMERA_NO_MUX => Self::NoMux,
            c::CAMERA_NO_FPGA => Self::NoFpga,
            _ => Self::Unknown,
        }
    }

    /// One word for programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::NoAck => "no_ack",
            Self::BusStuck => "bus_stuck",
            Self::WrongId => "wrong_id",
            Self::NoMux => "no_mux",
            Self::NoFpga => "no_fpga",
            Self::NoPixels => "no_pixels",
            Self::TornFrames => "torn_frames",
            Self::Unknown => "unknown",
        }
    }
}

impl fmt::Display for CameraState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ok => "ok",
            Self::NoAck => "does not answer on I2C (no acknowledge); look at its plug",
            Self::BusStuck => "the I2C clock line is held low; unplug the cameras one by one",
            Self::WrongId => "is another chip than an OV7670 (wrong id); plug the right one in",
            Self::NoMux => "the I2C multiplexer does not answer; the turret's board is broken",
            Self::NoFpga => "has no clock: the FPGA runs no design; `sot fpga boot` starts one",
            Self::NoPixels => "answers, but sends no pixels; look at its pixel clock and plug",
            Self::TornFrames => "sends torn frames: rows or columns are missing; look at its plug",
            Self::Unknown => "was never set up; `sot camera setup` does that",
        })
    }
}

/// What is streamed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamSettings {
    /// 640x480 instead of 320x240.
    pub large: bool,
    /// The test pattern instead of the cameras; needs the FPGA function `capture`.
    pub pattern: bool,
    /// Frames a second; `None` leaves that as it is.
    pub rate: Option<u16>,
}

/// FPGA registers.
impl Turret {
    /// Value of an FPGA register, 00..=7F.
    ///
    /// # Errors
    /// If the turret does not tell, or no design runs in the FPGA.
    pub fn register(&mut self, address: u8) -> Result<u16, TurretError> {
        let value = self.raw_register(address)?;
        if value == u16::MAX
            && u32::from(self.raw_register(c::FPGA_REG_ID as u8)?) != c::FPGA_ID_VALUE
        {
            return Err(TurretError::Config(
                "the FPGA runs no design, so it has no registers; `sot fpga boot SLOT` or \
                 `sot flash fpga FILE` configures it"
                    .into(),
            ));
        }
        Ok(value)
    }

    fn raw_register(&mut self, address: u8) -> Result<u16, TurretError> {
        let request = c::REQUEST_FPGA_REGISTER as u8;
        let setup = Setup { kind: VENDOR_IN, request, value: 0, index: u16::from(address) };
        let reply = self.device().control_in(setup, 2).map_err(busy)?;
        reply.try_into().map(u16::from_be_bytes).map_err(|_| TurretError::Status)
    }

    /// Write an FPGA register. Whether it took the value only reading it tells.
    ///
    /// # Errors
    /// If the turret refuses.
    pub fn set_register(&mut self, address: u8, value: u16) -> Result<(), TurretError> {
        let request = c::REQUEST_FPGA_REGISTER as u8;
        let setup = Setup { kind: VENDOR_OUT, request, value, index: u16::from(address) };
        self.device().control_out(setup, &[]).map_err(busy)
    }

    /// The same, and look whether it took the value.
    fn put_register(&mut self, address: u32, value: u16, what: &str) -> Result<(), TurretError> {
        self.set_register(address as u8, value)?;
        if self.register(address as u8)? == value {
            return Ok(());
        }
        Err(TurretError::Refused(format!("{what} (FPGA register {address:02x} := {value})")))
    }
}

/// A refused register: the flash is in use, or the alternate setting is another one.
fn busy(error: LinkError) -> TurretError {
    match error {
        LinkError::Refused => TurretError::Refused(
            "let the FPGA's registers be reached while its flash is used".into(),
        ),
        other => other.into(),
    }
}

/// Cameras.
impl Turret {
    /// What the firmware knows of both cameras, left first.
    ///
    /// # Errors
    /// If the turret does not tell.
    pub fn camera_codes(&mut self) -> Result<[CameraState; 2], TurretError> {
        let request = c::REQUEST_CAMERAS as u8;
        let setup = Setup { kind: VENDOR_IN, request, value: 0, index: 0 };
        let reply = self.device().control_in(setup, c::CAMERAS_STATUS_SIZE as u16)?;
        match reply.as_slice() {
            [version, left, right, _] if u32::from(*version) == c::CAMERAS_STATUS_VERSION => {
                Ok([*left, *right].map(CameraState::from_code))
            }
            _ => Err(TurretError::Status),
        }
    }

    /// How both cameras are, left first: what the firmware knows, and what the FPGA sees of them.
    ///
    /// # Errors
    /// If the turret does not tell.
    pub fn cameras(&mut self) -> Result<[CameraState; 2], TurretError> {
        let mut states = self.camera_codes()?;
        let eyes = u32::from(self.raw_register(c::FPGA_REG_EYES as u8)?);
        for (eye, state) in states.iter_mut().enumerate() {
            let bits = eyes >> (eye as u32 * c::FPGA_EYES_RIGHT_SHIFT);
            if *state == CameraState::Ok && bits & c::FPGA_EYES_ALIVE == 0 {
                *state = CameraState::NoPixels;
            } else if *state == CameraState::Ok && bits & c::FPGA_EYES_TORN != 0 {
                *state = CameraState::TornFrames;
            }
        }
        Ok(states)
    }

    /// Reset both cameras and set them up for the FPGA's format.
    ///
    /// # Errors
    /// If the turret refuses. A camera that fails is no error here.
    pub fn set_up_cameras(&mut self) -> Result<(), TurretError> {
        let request = c::REQUEST_CAMERAS as u8;
        let setup = Setup { kind: VENDOR_OUT, request, value: 0, index: 0 };
        self.device().control_out(setup, &[]).map_err(busy)
    }

    /// Choose the cameras' format, and set them up for it.
    ///
    /// # Errors
    /// If the turret refuses.
    pub fn set_format(&mut self, large: bool) -> Result<(), TurretError> {
        self.put_register(c::FPGA_REG_FORMAT, u16::from(large), "take frames of that size")?;
        self.set_up_cameras()
    }

    /// A camera's register. `eye`: 0 left, 1 right.
    ///
    /// # Errors
    /// [`TurretError::Refused`] if the camera does not answer.
    pub fn camera_register(&mut self, eye: u8, register: u8) -> Result<u8, TurretError> {
        let setup = camera_setup(VENDOR_IN, eye, register, 0);
        match self.device().control_in(setup, 1) {
            Ok(reply) => reply.first().copied().ok_or(TurretError::Status),
            Err(error) => Err(self.camera_error(eye, error)),
        }
    }

    /// Write it.
    ///
    /// # Errors
    /// [`TurretError::Refused`] if the camera does not answer.
    pub fn set_camera_register(
        &mut self,
        eye: u8,
        register: u8,
        value: u8,
    ) -> Result<(), TurretError> {
        let setup = camera_setup(VENDOR_OUT, eye, register, u16::from(value));
        let done = self.device().control_out(setup, &[]);
        done.map_err(|error| self.camera_error(eye, error))
    }

    fn camera_error(&mut self, eye: u8, error: LinkError) -> TurretError {
        if !matches!(error, LinkError::Refused) {
            return error.into();
        }
        let name = if eye == 0 { "left" } else { "right" };
        match self.camera_codes() {
            Ok(states) => {
                TurretError::Config(format!("the {name} camera {}", states[usize::from(eye & 1)]))
            }
            Err(error) => error,
        }
    }
}

fn camera_setup(kind: u8, eye: u8, register: u8, value: u16) -> Setup {
    let index = u16::from(eye) << 8 | u16::from(register);
    Setup { kind, request: c::REQUEST_CAMERA_REGISTER as u8, value, index }
}

/// The stream.
impl Turret {
    /// Open the way for a stream, and set everything as wanted. Reads may begin now;
    /// [`Turret::stream_on`] follows.
    ///
    /// # Errors
    /// If the turret refuses any of it.
    pub fn stream_open(&mut self, settings: &StreamSettings) -> Result<(), TurretError> {
        self.device().set_alternate(c::USB_ALTERNATE_STREAM as u8)?;
        if self.register(c::FPGA_REG_FORMAT as u8)? != u16::from(settings.large) {
            self.set_format(settings.large)?;
        }
        self.put_register(
            c::FPGA_REG_SOURCE,
            u16::from(settings.pattern),
            "stream the test pattern: only the FPGA function `capture` has one",
        )?;
        match settings.rate {
            Some(rate) => self.put_register(c::FPGA_REG_FRAME_RATE, rate, "take so many frames"),
            None => Ok(()),
        }
    }

    /// Begin.
    ///
    /// # Errors
    /// If the turret refuses.
    pub fn stream_on(device: &mut dyn crate::Device) -> Result<(), TurretError> {
        Self::stream(device, c::FPGA_STREAM_ON)
    }

    /// No new pairs; those taken come, then the end record.
    ///
    /// # Errors
    /// If the turret refuses.
    pub fn stream_end(device: &mut dyn crate::Device) -> Result<(), TurretError> {
        Self::stream(device, c::FPGA_STREAM_END)
    }

    fn stream(device: &mut dyn crate::Device, value: u32) -> Result<(), TurretError> {
        let request = c::REQUEST_FPGA_REGISTER as u8;
        let index = c::FPGA_REG_STREAM as u16;
        let setup = Setup { kind: VENDOR_OUT, request, value: value as u16, index };
        Ok(device.control_out(setup, &[])?)
    }

    /// The way is closed; frames are 320x240 again, as soccer has them. All reads must have ended.
    ///
    /// # Errors
    /// If the turret refuses.
    pub fn stream_close(&mut self) -> Result<(), TurretError> {
        self.device().set_alternate(c::USB_ALTERNATE_CONTROL as u8)?;
        if self.register(c::FPGA_REG_FORMAT as u8)? != c::FPGA_FORMAT_320X240 as u16 {
            self.set_format(false)?;
        }
        Ok(())
    }
}
