//! A small USB host inside the program: resets, enumerates, and does control and bulk transfers in
//! simulated time. Deterministic; every wait has an end.

pub use crate::frames::PACKETS_PER_MICROFRAME;

use crate::frames::Frames;
use crate::{Fx2, InReply, OutReply, PACKET_MAX, Speed};
use sim::{MS, Ps, US};
use thiserror::Error;

/// A bus reset lasts this long (USB 2.0, 7.1.7.5: at least 10 ms at a root port).
const RESET_TIME: Ps = 10 * MS;
/// Recovery after it.
const RECOVERY_TIME: Ps = 10 * MS;
/// A device must have been attached this long before its reset (USB 2.0, 7.1.7.3).
const DEBOUNCE_TIME: Ps = 100 * MS;
const ATTACH_POLL_TIME: Ps = 100 * US;
/// Between two control transfers.
pub(crate) const CONTROL_GAP: Ps = 125 * US;
/// A transaction that got NAK carries no data.
const NAK_BYTES: usize = 0;

/// Where the chip lives: lets the host hold it and pass time.
pub trait Link {
    /// The chip.
    fn fx2(&mut self) -> &mut Fx2;
    /// Runs the chip and everything around it until `t`.
    fn run_until(&mut self, t: Ps);
}

/// A chip on a board, with nothing else around.
pub struct Bench<'a, B> {
    /// The chip.
    pub fx2: &'a mut Fx2,
    /// Its board.
    pub board: &'a mut B,
}

impl<B: crate::pins::Board> Link for Bench<'_, B> {
    fn fx2(&mut self) -> &mut Fx2 {
        self.fx2
    }

    fn run_until(&mut self, t: Ps) {
        while self.fx2.now() < t {
            self.fx2.run_until(t, self.board);
        }
    }
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum HostError {
    /// No pull-up on D+.
    #[error("no device on the bus within {0} ms; the firmware keeps itself disconnected (DISCON)")]
    NotAttached(u64),
    /// STALL.
    #[error("the device refused the request (STALL)")]
    Stall,
    /// NAK until the time was over.
    #[error("the device answered NAK for {0} ms; its firmware does not handle the request")]
    Timeout(u64),
    /// No handshake at all.
    #[error("endpoint {0:#04x} does not exist in the device's present configuration")]
    NoResponse(u8),
    /// A packet with the wrong data toggle or longer than asked for.
    #[error("endpoint {0:#04x} sent a packet out of turn")]
    Protocol(u8),
    /// A descriptor is not what it should be.
    #[error("the {0} descriptor is ill-formed")]
    Descriptor(&'static str),
    /// More data than a control transfer carries.
    #[error("{0} bytes are too many for a control transfer; at most 65535 fit")]
    TooLong(usize),
}

/// What enumeration found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The 18 bytes of the device descriptor.
    pub device: [u8; 18],
    /// The whole first configuration.
    pub configuration: Vec<u8>,
    /// Bus speed.
    pub speed: Speed,
}

impl Device {
    /// idVendor.
    #[must_use]
    pub fn vendor(&self) -> u16 {
        u16::from_le_bytes([self.device[8], self.device[9]])
    }

    /// idProduct.
    #[must_use]
    pub fn product(&self) -> u16 {
        u16::from_le_bytes([self.device[10], self.device[11]])
    }

    /// bcdDevice.
    #[must_use]
    pub fn release(&self) -> u16 {
        u16::from_le_bytes([self.device[12], self.device[13]])
    }
}

/// The first four fields of a SETUP packet; the length comes from the transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// bmRequestType; bit 7 must fit the direction of the transfer.
    pub kind: u8,
    /// bRequest.
    pub request: u8,
    /// wValue.
    pub value: u16,
    /// wIndex.
    pub index: u16,
}

impl Request {
    fn packet(self, length: u16) -> [u8; 8] {
        let ([v0, v1], [i0, i1]) = (self.value.to_le_bytes(), self.index.to_le_bytes());
        let [l0, l1] = length.to_le_bytes();
        [self.kind, self.request, v0, v1, i0, i1, l0, l1]
    }
}

/// The host's memory of one device.
#[derive(Clone, Debug)]
pub struct Host {
    frames: Frames,
    /// Data toggle expected next, by endpoint number: IN and OUT.
    toggle_in: u16,
    toggle_out: u16,
    /// Longest time for one transfer.
    budget: Ps,
    allow_high_speed: bool,
}

impl Default for Host {
    fn default() -> Self {
        Self::new()
    }
}

impl Host {
    /// A high-speed host that gives every transfer one simulated second.
    #[must_use]
    pub fn new() -> Self {
        Self {
            frames: Frames::new(),
            toggle_in: 0,
            toggle_out: 0,
            budget: 1000 * MS,
            allow_high_speed: true,
        }
    }

    /// A host (or hub) that knows full speed only.
    #[must_use]
    pub fn full_speed() -> Self {
        Self { allow_high_speed: false, ..Self::new() }
    }

    /// Changes the time that a transfer may take.
    pub fn set_budget(&mut self, budget: Ps) {
        self.budget = budget;
    }

    /// Lets at most `limit` (1..=13) packets with data into a microframe: a host controller that is
    /// busy with others, or a poor one.
    pub fn set_packet_limit(&mut self, limit: u8) {
        self.frames.set_limit(limit);
    }

    /// Waits for a device, resets it, reads its descriptors, gives it address 1 and configuration 1
    /// (the value that its configuration descriptor names).
    ///
    /// # Errors
    /// If no device shows up, or it does not answer as USB 2.0 chapter 9 wants.
    pub fn enumerate(&mut self, link: &mut impl Link) -> Result<Device, HostError> {
        self.wait_attached(link)?;
        self.reset(link);
        let get =
            |kind: u8| Request { kind: 0x80, request: 6, value: u16::from(kind) << 8, index: 0 };
        let first = self.control_in(link, get(1), 8)?;
        if first.len() != 8 || first[..2] != [18, 1] {
            return Err(HostError::Descriptor("device"));
        }
        self.reset(link);
        let address = Request { kind: 0, request: 5, value: 1, index: 0 };
        self.control_out(link, address, &[])?;
        self.pass(link, 2 * MS);
        let device = self.control_in(link, get(1), 18)?;
        let device: [u8; 18] = device.try_into().map_err(|_| HostError::Descriptor("device"))?;
        let head = self.control_in(link, get(2), 9)?;
        if head.len() != 9 || head[..2] != [9, 2] {
            return Err(HostError::Descriptor("configuration"));
        }
        let total = u16::from_le_bytes([head[2], head[3]]);
        let configuration = self.control_in(link, get(2), total)?;
        if configuration.len() != usize::from(total) {
            return Err(HostError::Descriptor("configuration"));
        }
        let set = Request { kind: 0, request: 9, value: u16::from(head[5]), index: 0 };
        self.control_out(link, set, &[])?;
        (self.toggle_in, self.toggle_out) = (0, 0);
        Ok(Device { device, configuration, speed: self.frames.speed })
    }

    /// Waits until the device has been attached for 100 ms on end. A chip that disconnects in order
    /// to come back as another device is so seen as that one only.
    ///
    /// # Errors
    /// If it is not within the budget and this time.
    pub fn wait_attached(&mut self, link: &mut impl Link) -> Result<(), HostError> {
        let end = link.fx2().now() + self.budget + DEBOUNCE_TIME;
        let mut stable: Ps = 0;
        while stable < DEBOUNCE_TIME {
            if link.fx2().now() >= end {
                return Err(HostError::NotAttached(self.budget / MS));
            }
            self.pass(link, ATTACH_POLL_TIME);
            stable = if link.fx2().usb_attached() { stable + ATTACH_POLL_TIME } else { 0 };
        }
        Ok(())
    }

    /// A bus reset with its high-speed handshake and recovery.
    pub fn reset(&mut self, link: &mut impl Link) {
        link.fx2().usb_reset();
        self.pass(link, RESET_TIME);
        let high = self.allow_high_speed && link.fx2().usb_wants_high_speed();
        let speed = if high { Speed::High } else { Speed::Full };
        (self.toggle_in, self.toggle_out) = (0, 0);
        link.fx2().usb_reset_done(speed);
        self.frames.restart(link.fx2().now(), speed);
        self.pass(link, RECOVERY_TIME);
    }

    /// A control transfer that reads up to `length` bytes.
    ///
    /// # Errors
    /// If the device stalls, times out or answers nonsense.
    pub fn control_in(
        &mut self,
        link: &mut impl Link,
        request: Request,
        length: u16,
    ) -> Result<Vec<u8>, HostError> {
        self.setup(link, request.packet(length));
        let mut out = Vec::new();
        let mut toggle = true;
        while out.len() < usize::from(length) {
            let packet = self.in_packet(link, 0, toggle)?;
            toggle = !toggle;
            out.extend_from_slice(&packet);
            if packet.len() < 64 {
                break;
            }
        }
        if out.len() > usize::from(length) {
            return Err(HostError::Protocol(0x80));
        }
        // The status stage goes the other way, but without data always towards the host.
        if length == 0 {
            self.in_packet(link, 0, true)?;
        } else {
            self.out_packet(link, 0, true, &[])?;
        }
        Ok(out)
    }

    /// A control transfer that writes `data`, or has no data stage if that is empty.
    ///
    /// # Errors
    /// If the device stalls or times out, or `data` is longer than 65535 bytes.
    pub fn control_out(
        &mut self,
        link: &mut impl Link,
        request: Request,
        data: &[u8],
    ) -> Result<(), HostError> {
        let length = u16::try_from(data.len()).map_err(|_| HostError::TooLong(data.len()))?;
        self.setup(link, request.packet(length));
        let mut toggle = true;
        for packet in data.chunks(64) {
            self.out_packet(link, 0, toggle, packet)?;
            toggle = !toggle;
        }
        let status = self.in_packet(link, 0, true)?;
        if status.is_empty() { Ok(()) } else { Err(HostError::Protocol(0x80)) }
    }

    /// The SETUP packet of a transfer. Software on a real host leaves at least a microframe between
    /// two, and firmware counts on that.
    fn setup(&mut self, link: &mut impl Link, packet: [u8; 8]) {
        self.pass(link, CONTROL_GAP);
        link.fx2().usb_setup(packet);
        self.packet_time(link, packet.len());
    }

    /// One packet from bulk or interrupt endpoint `number`.
    ///
    /// # Errors
    /// If the endpoint stalls, times out, does not exist, or its toggle is wrong.
    pub fn bulk_in(&mut self, link: &mut impl Link, number: u8) -> Result<Vec<u8>, HostError> {
        let bit = 1 << (number & 0x0F);
        let packet = self.in_packet(link, number, self.toggle_in & bit != 0)?;
        self.toggle_in ^= bit;
        Ok(packet)
    }

    /// One IN token to bulk or interrupt endpoint `number`: its packet, or None if it has none now
    /// (NAK).
    ///
    /// # Errors
    /// If the endpoint stalls, does not exist, or its toggle is wrong.
    pub fn try_bulk_in(
        &mut self,
        link: &mut impl Link,
        number: u8,
    ) -> Result<Option<Vec<u8>>, HostError> {
        let bit = 1 << (number & 0x0F);
        let mut data = [0; PACKET_MAX];
        match link.fx2().usb_in(number, &mut data) {
            InReply::Data { length, toggle } => {
                self.packet_time(link, length);
                if toggle != (self.toggle_in & bit != 0) {
                    return Err(HostError::Protocol(0x80 | number));
                }
                self.toggle_in ^= bit;
                Ok(Some(data[..length].to_vec()))
            }
            InReply::Stall => Err(HostError::Stall),
            InReply::NoResponse => Err(HostError::NoResponse(0x80 | number)),
            InReply::Nak => {
                self.packet_time(link, NAK_BYTES);
                Ok(None)
            }
        }
    }

    /// One packet to bulk or interrupt endpoint `number`.
    ///
    /// # Errors
    /// If the endpoint stalls, times out or does not exist.
    pub fn bulk_out(
        &mut self,
        link: &mut impl Link,
        number: u8,
        data: &[u8],
    ) -> Result<(), HostError> {
        let bit = 1 << (number & 0x0F);
        self.out_packet(link, number, self.toggle_out & bit != 0, data)?;
        self.toggle_out ^= bit;
        Ok(())
    }

    /// Forgets the toggles of endpoint `number`, as after CLEAR_FEATURE or SET_INTERFACE.
    pub fn clear_toggles(&mut self, number: u8) {
        let bit = 1 << (number & 0x0F);
        self.toggle_in &= !bit;
        self.toggle_out &= !bit;
    }

    fn in_packet(
        &mut self,
        link: &mut impl Link,
        number: u8,
        expected: bool,
    ) -> Result<Vec<u8>, HostError> {
        let end = link.fx2().now() + self.budget;
        let mut data = [0; PACKET_MAX];
        loop {
            match link.fx2().usb_in(number, &mut data) {
                InReply::Data { length, toggle } => {
                    self.packet_time(link, length);
                    if toggle != expected {
                        return Err(HostError::Protocol(0x80 | number));
                    }
                    return Ok(data[..length].to_vec());
                }
                InReply::Stall => return Err(HostError::Stall),
                InReply::NoResponse => return Err(HostError::NoResponse(0x80 | number)),
                InReply::Nak => self.retry(link, end)?,
            }
        }
    }

    fn out_packet(
        &mut self,
        link: &mut impl Link,
        number: u8,
        toggle: bool,
        data: &[u8],
    ) -> Result<(), HostError> {
        let end = link.fx2().now() + self.budget;
        loop {
            self.packet_time(link, data.len());
            match link.fx2().usb_out(number, toggle, data) {
                OutReply::Ack => return Ok(()),
                OutReply::Stall => return Err(HostError::Stall),
                OutReply::NoResponse => return Err(HostError::NoResponse(number)),
                OutReply::Nak => self.retry(link, end)?,
            }
        }
    }

    fn retry(&mut self, link: &mut impl Link, end: Ps) -> Result<(), HostError> {
        if link.fx2().now() >= end {
            return Err(HostError::Timeout(self.budget / MS));
        }
        self.packet_time(link, NAK_BYTES);
        Ok(())
    }

    /// The bus is busy with a transaction of `length` data bytes.
    fn packet_time(&mut self, link: &mut impl Link, length: usize) {
        let over = self.frames.place(link.fx2().now(), length);
        link.run_until(over);
    }

    fn pass(&self, link: &mut impl Link, time: Ps) {
        let until = link.fx2().now() + time;
        link.run_until(until);
    }
}
