//! A USB device as the tools use it, whatever lies in between.

use std::time::Duration;

use thiserror::Error;

/// Why a device does not do what it was asked for.
#[derive(Debug, Error)]
pub enum LinkError {
    /// STALL.
    #[error("the device refuses the request (STALL)")]
    Refused,
    /// It answers nothing.
    #[error("the device did not answer within {0:.1} s; unplug it and plug it in again")]
    Timeout(f64),
    /// Unplugged, or re-enumerated.
    #[error("the device has gone: unplugged, reset, or its twin has ended")]
    Gone,
    /// It was expected to come back and did not.
    #[error("the device has not come back within {0} s; unplug it and plug it in again")]
    NotBack(u64),
    /// Somebody else has it.
    #[error("{0} is in use by another program; end that one first")]
    Busy(String),
    /// The system does not let us.
    #[error(
        "no permission to use {0}: install the udev rule (sudo cp tools/99-stereosot.rules \
         /etc/udev/rules.d/; sudo udevadm control --reload; sudo udevadm trigger) and plug the robot in \
         again"
    )]
    Permission(String),
    /// All else.
    #[error("{0}")]
    Other(String),
}

/// Who a device is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// What `--robot` takes to mean it.
    pub name: String,
    /// idVendor.
    pub vendor: u16,
    /// idProduct.
    pub product: u16,
    /// bcdDevice.
    pub release: u16,
    /// Serial number, if it has one.
    pub serial: Option<String>,
    /// Whether it runs at high speed.
    pub high_speed: bool,
}

/// The first four fields of a SETUP packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setup {
    /// bmRequestType.
    pub kind: u8,
    /// bRequest.
    pub request: u8,
    /// wValue.
    pub value: u16,
    /// wIndex.
    pub index: u16,
}

/// An open device: configured, its interface 0 ours, in alternate setting 0 at first.
pub trait Device {
    /// Who it is.
    fn identity(&self) -> &Identity;

    /// A control transfer that reads up to `length` bytes, 4096 at most.
    ///
    /// # Errors
    /// If the device refuses, is silent, or has gone.
    fn control_in(&mut self, setup: Setup, length: u16) -> Result<Vec<u8>, LinkError>;

    /// A control transfer that writes `data`, 4096 bytes at most, or nothing.
    ///
    /// # Errors
    /// If the device refuses, is silent, or has gone.
    fn control_out(&mut self, setup: Setup, data: &[u8]) -> Result<(), LinkError>;

    /// Chooses an alternate setting of interface 0; all reads must have ended.
    ///
    /// # Errors
    /// If the device refuses, is silent, or has gone.
    fn set_alternate(&mut self, setting: u8) -> Result<(), LinkError>;

    /// Ends the halt of a bulk endpoint.
    ///
    /// # Errors
    /// If the device refuses, is silent, or has gone.
    fn clear_halt(&mut self, endpoint: u8) -> Result<(), LinkError>;

    /// Writes all of `data` to bulk endpoint `endpoint`, with several transfers under way. `patience`
    /// is for each of them.
    ///
    /// # Errors
    /// If the endpoint stalls, takes nothing for `patience`, or the device has gone.
    fn bulk_out(&mut self, endpoint: u8, data: &[u8], patience: Duration) -> Result<(), LinkError>;

    /// Begins to read `length` bytes, a multiple of 512, from bulk endpoint `endpoint` (bit 7 set).
    ///
    /// # Errors
    /// If there is no such endpoint, or the device has gone.
    fn submit_read(&mut self, endpoint: u8, length: usize) -> Result<(), LinkError>;

    /// Waits for the oldest read of that endpoint; less than asked for if a short packet ended it.
    /// `None` if it has not ended within `patience`, or none is under way; it goes on then.
    ///
    /// # Errors
    /// If the endpoint stalls, or the device has gone.
    fn next_read(&mut self, endpoint: u8, patience: Duration)
    -> Result<Option<Vec<u8>>, LinkError>;

    /// Ends all reads of that endpoint; what they have read is lost.
    ///
    /// # Errors
    /// If the device has gone.
    fn cancel_reads(&mut self, endpoint: u8) -> Result<(), LinkError>;

    /// The device is about to leave the bus, or has left it, and will come back: waits for that, and
    /// opens it as what it is then.
    ///
    /// # Errors
    /// If it is not there again within `patience`.
    fn wait_for_return(&mut self, patience: Duration) -> Result<(), LinkError>;
}

/// Reads a bulk endpoint without a gap: always `count` transfers under way. Dropping it ends them.
pub struct BulkReader<'a> {
    device: &'a mut dyn Device,
    endpoint: u8,
    size: usize,
}

impl<'a> BulkReader<'a> {
    /// Begins with `count` transfers of `size` bytes, a multiple of 512.
    ///
    /// # Errors
    /// As [`Device::submit_read`].
    pub fn start(
        device: &'a mut dyn Device,
        endpoint: u8,
        size: usize,
        count: usize,
    ) -> Result<Self, LinkError> {
        let reader = Self { device, endpoint, size };
        for _ in 0..count {
            reader.device.submit_read(endpoint, size)?;
        }
        Ok(reader)
    }

    /// The next bytes; `None` if none have come within `patience`.
    ///
    /// # Errors
    /// As [`Device::next_read`].
    pub fn next(&mut self, patience: Duration) -> Result<Option<Vec<u8>>, LinkError> {
        let bytes = self.device.next_read(self.endpoint, patience)?;
        if bytes.is_some() {
            self.device.submit_read(self.endpoint, self.size)?;
        }
        Ok(bytes)
    }

    /// The device, for control transfers in between.
    pub fn device(&mut self) -> &mut dyn Device {
        self.device
    }
}

impl Drop for BulkReader<'_> {
    fn drop(&mut self) {
        // A device that has gone has ended them itself.
        let _ = self.device.cancel_reads(self.endpoint);
    }
}
