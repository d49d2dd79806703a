//! The USB engine: EP0 with its data pointer, EP1, and the packets of all endpoints, seen as the
//! transactions of a host (TRM chapters 2, 3 and 8).
//!
//! A transaction happens at the chip's present time and always arrives intact: every packet that an
//! IN token gets counts as acknowledged.

use crate::chip::Chip;
use crate::descriptors;
use crate::diagnostics::Rule;
use crate::eeprom::Identity;
use crate::endpoints::PACKET_MAX;
use crate::interrupts::{EICON_RESUME, usb};
use crate::regs::xdata;
use crate::time::{NEVER, Tick};
use serde::{Deserialize, Serialize};

/// USBCS bits.
const SIGRSUME: u8 = 0x01;
const RENUM: u8 = 0x02;
const DISCON: u8 = 0x08;
const HSM: u8 = 0x80;
/// SUDPTRCTL: the length is taken from the descriptor.
const SDPAUTO: u8 = 0x01;
/// GPCR2: no high-speed handshake.
const FULL_SPEED_ONLY: u8 = 0x10;
/// Bytes of an EP0 and EP1 buffer.
const SMALL: usize = 64;
/// The vendor request that the chip itself answers: load or read RAM.
const FIRMWARE_LOAD: u8 = 0xA0;

/// Bus speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Speed {
    /// 12 Mbit/s.
    Full,
    /// 480 Mbit/s.
    High,
}

impl Speed {
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Full => Self::High,
            Self::High => Self::Full,
        }
    }

    /// Ticks between two SOF packets.
    fn frame(self) -> Tick {
        match self {
            Self::Full => 48_000,
            Self::High => 6_000,
        }
    }
}

/// Answer to an IN token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum InReply {
    /// A packet of `length` bytes with PID DATA1 if `toggle`.
    Data {
        /// Bytes put into the caller's buffer.
        length: usize,
        /// DATA1 instead of DATA0.
        toggle: bool,
    },
    /// Not now.
    Nak,
    /// Halted, or a refused request.
    Stall,
    /// No such endpoint: the host sees a time-out.
    NoResponse,
}

/// Answer to an OUT packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum OutReply {
    /// Taken.
    Ack,
    /// Not now.
    Nak,
    /// Halted, or a refused request.
    Stall,
    /// No such endpoint: the host sees a time-out.
    NoResponse,
}

/// Who answers the control transfer in progress.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Handler {
    Firmware,
    /// The engine sends these bytes from `sent` on.
    CoreIn {
        data: Vec<u8>,
        sent: usize,
    },
    /// The engine writes what comes into memory.
    CoreLoad {
        address: u16,
    },
    CoreNoData,
    CoreStall,
}

/// Data that EP0 sends from memory (SUDPTR).
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Pointer {
    address: u16,
    left: usize,
    /// A zero-length packet closes the data stage.
    zero: bool,
}

/// EP1 in one direction.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Small {
    pub(crate) cfg: u8,
    pub(crate) busy: bool,
    pub(crate) stall: bool,
    pub(crate) count: u8,
    #[serde(with = "sim::hex")]
    pub(crate) buffer: [u8; SMALL],
    toggle: bool,
}

impl Small {
    fn new() -> Self {
        Self { cfg: 0xA0, busy: false, stall: false, count: 0, buffer: [0; SMALL], toggle: false }
    }
}

/// State of the engine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Usb {
    pub(crate) identity: Identity,
    pub(crate) usbcs: u8,
    pub(crate) speed: Speed,
    pub(crate) address: u8,
    new_address: Option<u8>,
    pub(crate) setup: [u8; 8],
    handler: Handler,
    #[serde(with = "sim::hex")]
    pub(crate) ep0_buffer: [u8; SMALL],
    /// EP0BCH:L.
    pub(crate) ep0_count: u16,
    pub(crate) ep0_busy: bool,
    pub(crate) ep0_stall: bool,
    pub(crate) hsnak: bool,
    ep0_toggle: bool,
    pointer: Option<Pointer>,
    pub(crate) ep1_out: Small,
    pub(crate) ep1_in: Small,
    configuration: u8,
    alternate: u8,
    /// SOF packets come from here on; `None` = none come.
    sof_from: Option<Tick>,
    /// Number of SOFs that USBIRQ has been told of.
    sof_seen: u64,
    pub(crate) togctl: u8,
}

impl Usb {
    pub(crate) fn new(identity: Identity) -> Self {
        Self {
            identity,
            usbcs: 0,
            speed: Speed::Full,
            address: 0,
            new_address: None,
            setup: [0; 8],
            handler: Handler::CoreNoData,
            ep0_buffer: [0; SMALL],
            ep0_count: 0,
            ep0_busy: false,
            ep0_stall: false,
            hsnak: true,
            ep0_toggle: true,
            pointer: None,
            ep1_out: Small::new(),
            ep1_in: Small::new(),
            configuration: 0,
            alternate: 0,
            sof_from: None,
            sof_seen: 0,
            togctl: 0,
        }
    }

    /// Whether firmware answers requests.
    pub(crate) fn renumerated(&self) -> bool {
        self.usbcs & RENUM != 0
    }

    /// SOFs sent until `now`.
    fn sof_count(&self, now: Tick) -> u64 {
        self.sof_from.map_or(0, |from| now.saturating_sub(from) / self.speed.frame())
    }

    /// Frame number (11 bits) and microframe.
    pub(crate) fn frame(&self, now: Tick) -> (u16, u8) {
        let count = self.sof_count(now);
        match self.speed {
            Speed::Full => ((count & 0x7FF) as u16, 0),
            Speed::High => ((count >> 3 & 0x7FF) as u16, (count & 7) as u8),
        }
    }

    /// The next SOF.
    pub(crate) fn next_sof(&self, now: Tick) -> Tick {
        let next = |from| from + (self.sof_count(now) + 1) * self.speed.frame();
        self.sof_from.map_or(NEVER, next)
    }

    fn request_is_in(&self) -> bool {
        self.setup[0] & 0x80 != 0
    }

    fn word(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.setup[at], self.setup[at + 1]])
    }

    fn data_toggle(&mut self) -> bool {
        let toggle = self.ep0_toggle;
        self.ep0_toggle = !toggle;
        toggle
    }
}

/// What the bus does to the whole device.
impl Chip {
    /// Whether the pull-up is on the bus.
    pub(crate) fn usb_attached(&self) -> bool {
        self.booted && self.usb.usbcs & DISCON == 0
    }

    /// Whether the chip answers the high-speed handshake of a bus reset.
    pub(crate) fn usb_wants_high_speed(&self) -> bool {
        self.gpcr2 & FULL_SPEED_ONLY == 0
    }

    /// A bus reset begins: full speed, address 0. It wakes a suspended chip.
    pub(crate) fn usb_reset(&mut self) {
        if self.asleep {
            self.usb_resume();
        }
        self.usb.address = 0;
        self.usb.new_address = None;
        self.usb.configuration = 0;
        self.usb.alternate = 0;
        self.usb.pointer = None;
        self.usb.ep0_busy = false;
        self.clear_toggles();
        self.set_speed(Speed::Full);
        self.int.raise_usb(usb::RESET);
        self.changed();
    }

    /// The reset ends at `speed`; SOFs follow.
    pub(crate) fn usb_reset_done(&mut self, speed: Speed) {
        self.set_speed(speed);
        self.usb.sof_from = Some(self.tick);
        self.usb.sof_seen = 0;
        if speed == Speed::High {
            self.int.raise_usb(usb::HSGRANT);
        }
        self.changed();
    }

    fn set_speed(&mut self, speed: Speed) {
        self.usb.speed = speed;
        for ep in &mut self.eps {
            ep.set_speed(speed);
        }
    }

    /// The bus has been idle for 3 ms.
    pub(crate) fn usb_suspend(&mut self) {
        self.usb.sof_from = None;
        self.int.raise_usb(usb::SUSPEND);
        self.changed();
    }

    /// The host resumes, or the device is unplugged (`false`) in which case no SOFs follow.
    pub(crate) fn usb_resume(&mut self) {
        self.usb.sof_from = Some(self.tick);
        self.usb.sof_seen = 0;
        self.int.eicon |= EICON_RESUME;
        self.asleep = false;
        self.timers.skip_to(self.tick);
        self.changed();
    }

    /// Whether the firmware signals a remote wake-up (USBCS.SIGRSUME).
    pub(crate) fn usb_signals_resume(&self) -> bool {
        self.usb.usbcs & SIGRSUME != 0
    }

    pub(crate) fn usb_unplugged(&mut self) {
        self.usb.sof_from = None;
        self.usb.address = 0;
        self.changed();
    }

    /// Brings USBIRQ's SOF bit up to the present.
    pub(crate) fn sync_sof(&mut self) {
        let count = self.usb.sof_count(self.tick);
        if count > self.usb.sof_seen {
            self.usb.sof_seen = count;
            self.int.raise_usb(usb::SOF);
        }
    }

    /// USBCS as read.
    pub(crate) fn read_usbcs(&self) -> u8 {
        self.usb.usbcs & !HSM | if self.usb.speed == Speed::High { HSM } else { 0 }
    }

    /// TOGCTL: Q reads the toggle that S and R change; bits 3..0 and IO name the endpoint.
    pub(crate) fn write_togctl(&mut self, value: u8) {
        let (number, is_in) = (value & 0x0F, value & 0x10 != 0);
        let toggle = match number {
            0 => &mut self.usb.ep0_toggle,
            1 if is_in => &mut self.usb.ep1_in.toggle,
            1 => &mut self.usb.ep1_out.toggle,
            2 | 4 | 6 | 8 => &mut self.eps[usize::from(number / 2 - 1)].toggle,
            _ => return,
        };
        match value & 0x60 {
            0x20 => *toggle = false,
            0x40 => *toggle = true,
            _ => {}
        }
        self.usb.togctl = value & 0x7F | if *toggle { 0x80 } else { 0 };
    }
}

/// Control transfers.
impl Chip {
    /// A SETUP packet. It is always acknowledged and ends whatever EP0 was doing.
    pub(crate) fn usb_setup(&mut self, packet: [u8; 8]) {
        self.usb.setup = packet;
        self.usb.pointer = None;
        self.usb.ep0_busy = false;
        self.usb.ep0_stall = false;
        self.usb.hsnak = true;
        self.usb.ep0_toggle = true;
        self.usb.new_address = None;
        self.usb.handler = self.handler_for(packet);
        if self.usb.handler == Handler::Firmware {
            self.int.raise_usb(usb::SUTOK | usb::SUDAV);
            self.changed();
        }
    }

    fn handler_for(&mut self, setup: [u8; 8]) -> Handler {
        let (value, length) = (self.usb.word(2), usize::from(self.usb.word(6)));
        match (setup[0], setup[1]) {
            (0x40, FIRMWARE_LOAD) => Handler::CoreLoad { address: value },
            (0xC0, FIRMWARE_LOAD) => {
                let bytes = (0..length).map(|n| self.peek_loadable(value.wrapping_add(n as u16)));
                Handler::CoreIn { data: bytes.collect(), sent: 0 }
            }
            (0x00, 0x05) => {
                self.usb.new_address = Some((value & 0x7F) as u8);
                Handler::CoreNoData
            }
            _ if self.usb.renumerated() => Handler::Firmware,
            _ => self.default_device(setup),
        }
    }

    /// The standard requests of the chip's own device.
    fn default_device(&mut self, setup: [u8; 8]) -> Handler {
        let index = self.usb.word(4);
        let reply = |data: Vec<u8>| Handler::CoreIn { data, sent: 0 };
        match (setup[0], setup[1]) {
            (0x80, 0x00) => reply(vec![0, 0]),
            (0x81, 0x00) if index == 0 => reply(vec![0, 0]),
            (0x82, 0x00) => match self.halt(setup[4]) {
                Some(stall) => reply(vec![u8::from(*stall), 0]),
                None => Handler::CoreStall,
            },
            (0x02, request @ (0x01 | 0x03)) if setup[2] == 0 => match self.halt(setup[4]) {
                Some(stall) => {
                    *stall = request == 0x03;
                    self.clear_toggle(setup[4]);
                    Handler::CoreNoData
                }
                None => Handler::CoreStall,
            },
            (0x80, 0x06) => {
                let usb = &self.usb;
                match descriptors::descriptor(setup[3], setup[2], usb.identity, usb.speed) {
                    Some(data) => reply(data),
                    None => Handler::CoreStall,
                }
            }
            (0x80, 0x08) => reply(vec![self.usb.configuration]),
            (0x00, 0x09) if setup[2] <= 1 => {
                self.usb.configuration = setup[2];
                self.usb.alternate = 0;
                self.clear_toggles();
                Handler::CoreNoData
            }
            (0x81, 0x0A) if index == 0 => reply(vec![self.usb.alternate]),
            (0x01, 0x0B) if index == 0 && setup[2] < descriptors::ALTERNATE_COUNT => {
                self.usb.alternate = setup[2];
                self.clear_toggles();
                Handler::CoreNoData
            }
            _ => Handler::CoreStall,
        }
    }

    /// All endpoints but 0 start at DATA0, as after SET_CONFIGURATION (USB 2.0, 9.1.1.5).
    fn clear_toggles(&mut self) {
        self.usb.ep1_in.toggle = false;
        self.usb.ep1_out.toggle = false;
        for ep in &mut self.eps {
            ep.toggle = false;
        }
    }

    /// One endpoint starts at DATA0, as after CLEAR_FEATURE(ENDPOINT_HALT) (USB 2.0, 9.4.5).
    fn clear_toggle(&mut self, address: u8) {
        match address & 0x0F {
            1 if address & 0x80 != 0 => self.usb.ep1_in.toggle = false,
            1 => self.usb.ep1_out.toggle = false,
            n @ (2 | 4 | 6 | 8) => self.eps[usize::from(n / 2 - 1)].toggle = false,
            _ => {}
        }
    }

    /// The halt bit of an endpoint address.
    fn halt(&mut self, address: u8) -> Option<&mut bool> {
        let is_in = address & 0x80 != 0;
        match address & 0x0F {
            0 => Some(&mut self.usb.ep0_stall),
            1 if is_in => Some(&mut self.usb.ep1_in.stall),
            1 => Some(&mut self.usb.ep1_out.stall),
            n @ (2 | 4 | 6 | 8) => {
                let ep = &mut self.eps[usize::from(n / 2 - 1)];
                (ep.is_in() == is_in).then_some(&mut ep.stall)
            }
            _ => None,
        }
    }

    fn ep0_in(&mut self, out: &mut [u8; PACKET_MAX]) -> InReply {
        if self.usb.ep0_stall && self.usb.handler == Handler::Firmware {
            return InReply::Stall;
        }
        let wanted = usize::from(self.usb.word(6));
        let reads = self.usb.request_is_in() && wanted > 0;
        match &mut self.usb.handler {
            Handler::CoreStall => InReply::Stall,
            Handler::CoreIn { data, sent } => {
                let end = data.len().min(wanted);
                let length = (end - *sent).min(SMALL);
                out[..length].copy_from_slice(&data[*sent..*sent + length]);
                *sent += length;
                InReply::Data { length, toggle: self.usb.data_toggle() }
            }
            Handler::CoreLoad { .. } | Handler::CoreNoData => {
                if let Some(address) = self.usb.new_address.take() {
                    self.usb.address = address;
                }
                InReply::Data { length: 0, toggle: true }
            }
            Handler::Firmware if reads => self.ep0_data_in(out),
            Handler::Firmware if self.usb.hsnak => self.ep0_nak_in(),
            Handler::Firmware => self.ep0_status_done(),
        }
    }

    fn ep0_nak_in(&mut self) -> InReply {
        self.int.raise_ibn(0);
        self.changed();
        InReply::Nak
    }

    fn ep0_status_done(&mut self) -> InReply {
        self.int.raise_usb(usb::EP0ACK);
        self.changed();
        InReply::Data { length: 0, toggle: true }
    }

    /// A packet of the firmware's answer: from memory if SUDPTR was set, else from EP0BUF.
    fn ep0_data_in(&mut self, out: &mut [u8; PACKET_MAX]) -> InReply {
        if let Some(mut pointer) = self.usb.pointer {
            let length = pointer.left.min(SMALL);
            for byte in &mut out[..length] {
                *byte = self.peek_loadable(pointer.address);
                pointer.address = pointer.address.wrapping_add(1);
            }
            pointer.left -= length;
            let over = pointer.left == 0 && (length < SMALL || !pointer.zero);
            self.usb.pointer = (!over).then_some(pointer);
            if over {
                self.usb.ep0_busy = false;
                self.int.raise_usb(usb::EP0IN);
                self.changed();
            }
            return InReply::Data { length, toggle: self.usb.data_toggle() };
        }
        if !self.usb.ep0_busy {
            return self.ep0_nak_in();
        }
        let length = usize::from(self.usb.ep0_count).min(SMALL);
        out[..length].copy_from_slice(&self.usb.ep0_buffer[..length]);
        self.usb.ep0_busy = false;
        self.int.raise_usb(usb::EP0IN);
        self.changed();
        InReply::Data { length, toggle: self.usb.data_toggle() }
    }

    fn ep0_out(&mut self, data: &[u8]) -> OutReply {
        if self.usb.ep0_stall && self.usb.handler == Handler::Firmware {
            return OutReply::Stall;
        }
        let reads = self.usb.request_is_in();
        match &mut self.usb.handler {
            Handler::CoreStall => OutReply::Stall,
            Handler::CoreIn { .. } | Handler::CoreNoData => OutReply::Ack,
            Handler::CoreLoad { address } => {
                let start = *address;
                *address = start.wrapping_add(data.len() as u16);
                for (n, &byte) in data.iter().enumerate() {
                    self.load(start.wrapping_add(n as u16), byte);
                }
                OutReply::Ack
            }
            Handler::Firmware if reads => {
                if self.usb.hsnak {
                    return OutReply::Nak;
                }
                self.ep0_status_done();
                OutReply::Ack
            }
            Handler::Firmware if self.usb.ep0_busy && data.len() <= SMALL => {
                self.usb.ep0_buffer[..data.len()].copy_from_slice(data);
                self.usb.ep0_count = data.len() as u16;
                self.usb.ep0_busy = false;
                self.int.raise_usb(usb::EP0OUT);
                self.changed();
                OutReply::Ack
            }
            Handler::Firmware => {
                self.ping_nak(0);
                OutReply::Nak
            }
        }
    }

    /// EP0BCL is written: arms EP0, or with SDPAUTO = 0 only gives SUDPTR its length.
    pub(crate) fn write_ep0bcl(&mut self, value: u8) {
        self.usb.ep0_count = self.usb.ep0_count & 0xFF00 | u16::from(value);
        if self.reg(xdata::SUDPTRCTL) & SDPAUTO != 0 {
            self.usb.pointer = None;
            self.usb.ep0_busy = true;
        }
    }

    /// SUDPTRL is written: the data stage comes from memory.
    pub(crate) fn start_pointer(&mut self) {
        let address = u16::from_be_bytes([self.reg(xdata::SUDPTRH), self.reg(xdata::SUDPTRL)]);
        if address & 1 != 0 {
            self.report(Rule::SetupData, xdata::SUDPTRL, || {
                format!(
                    "SUDPTR is set to the odd address {address:#06x}; data must be word-aligned"
                )
            });
        }
        let address = address & !1;
        if !self.is_loadable(address) {
            self.report(Rule::SetupData, xdata::SUDPTRL, || {
                format!("SUDPTR is set to {address:#06x}, which is not in on-chip RAM")
            });
        }
        let wanted = usize::from(self.usb.word(6));
        let have = if self.reg(xdata::SUDPTRCTL) & SDPAUTO != 0 {
            self.descriptor_length(address)
        } else {
            usize::from(self.usb.ep0_count)
        };
        let left = have.min(wanted);
        // A data stage shorter than asked for ends with a short packet.
        self.usb.pointer = Some(Pointer { address, left, zero: have < wanted });
        self.usb.ep0_busy = true;
    }

    /// Configurations have their total length in the second word, all else in the first byte.
    fn descriptor_length(&self, address: u16) -> usize {
        let byte = |n| self.peek_loadable(address.wrapping_add(n));
        match byte(1) {
            2 | 7 => usize::from(u16::from_le_bytes([byte(2), byte(3)])),
            _ => usize::from(byte(0)),
        }
    }
}

/// Packets of all endpoints.
impl Chip {
    /// An IN token to endpoint `number` (0..=15).
    pub(crate) fn usb_in(&mut self, number: u8, out: &mut [u8; PACKET_MAX]) -> InReply {
        match number {
            0 => self.ep0_in(out),
            1 => self.ep1_in(out),
            2 | 4 | 6 | 8 => self.large_in(usize::from(number / 2 - 1), out),
            _ => InReply::NoResponse,
        }
    }

    /// An OUT packet to endpoint `number` with PID DATA1 if `toggle`.
    pub(crate) fn usb_out(&mut self, number: u8, toggle: bool, data: &[u8]) -> OutReply {
        match number {
            0 => self.ep0_out(data),
            1 => self.ep1_out(toggle, data),
            2 | 4 | 6 | 8 => self.large_out(usize::from(number / 2 - 1), toggle, data),
            _ => OutReply::NoResponse,
        }
    }

    /// An OUT packet found no room; `index` 0 = EP0, 1 = EP1, 2.. = EP2, 4, 6, 8.
    fn ping_nak(&mut self, index: u32) {
        if self.usb.speed == Speed::High {
            self.int.raise_usb(usb::PING_EP0 << index);
            self.changed();
        }
    }

    fn ep1_in(&mut self, out: &mut [u8; PACKET_MAX]) -> InReply {
        let ep = &mut self.usb.ep1_in;
        if ep.cfg & 0x80 == 0 {
            return InReply::NoResponse;
        }
        if ep.stall {
            return InReply::Stall;
        }
        if !ep.busy {
            self.int.raise_ibn(1);
            self.changed();
            return InReply::Nak;
        }
        let length = usize::from(ep.count).min(SMALL);
        out[..length].copy_from_slice(&ep.buffer[..length]);
        ep.busy = false;
        let toggle = ep.toggle;
        ep.toggle = !toggle;
        self.int.raise_usb(usb::EP1IN);
        self.changed();
        InReply::Data { length, toggle }
    }

    fn ep1_out(&mut self, toggle: bool, data: &[u8]) -> OutReply {
        let ep = &mut self.usb.ep1_out;
        if ep.cfg & 0x80 == 0 || data.len() > SMALL {
            return OutReply::NoResponse;
        }
        if ep.stall {
            return OutReply::Stall;
        }
        if toggle != ep.toggle {
            return OutReply::Ack; // a repetition
        }
        if !ep.busy {
            self.ping_nak(1);
            return OutReply::Nak;
        }
        ep.buffer[..data.len()].copy_from_slice(data);
        ep.count = data.len() as u8;
        ep.busy = false;
        ep.toggle = !toggle;
        self.int.raise_usb(usb::EP1OUT);
        self.changed();
        OutReply::Ack
    }

    fn large_in(&mut self, index: usize, out: &mut [u8; PACKET_MAX]) -> InReply {
        self.check_buffers();
        let nak_all = self.nak_all();
        let ep = &mut self.eps[index];
        if !ep.is_valid() || !ep.is_in() {
            return InReply::NoResponse;
        }
        if ep.stall {
            return InReply::Stall;
        }
        let isochronous = ep.is_isochronous();
        let Some(packet) = ep.to_send().filter(|_| !nak_all) else {
            // An isochronous endpoint has no NAK: the host gets a packet without data.
            if isochronous {
                return InReply::Data { length: 0, toggle: false };
            }
            self.int.raise_ibn(2 + index as u8);
            self.changed();
            return InReply::Nak;
        };
        let length = packet.len();
        out[..length].copy_from_slice(packet);
        ep.sent();
        let toggle = ep.toggle;
        ep.toggle = !toggle && !isochronous;
        self.int.raise_usb(usb::EP2 << index);
        self.fifo_changed();
        InReply::Data { length, toggle }
    }

    fn large_out(&mut self, index: usize, toggle: bool, data: &[u8]) -> OutReply {
        self.check_buffers();
        let nak_all = self.nak_all();
        let ep = &mut self.eps[index];
        if !ep.is_valid() || ep.is_in() || data.len() > ep.packet_size() {
            return OutReply::NoResponse;
        }
        if ep.stall {
            return OutReply::Stall;
        }
        let isochronous = ep.is_isochronous();
        if toggle != ep.toggle && !isochronous {
            return OutReply::Ack; // a repetition
        }
        if nak_all || !ep.can_receive() {
            // Without room an isochronous packet is lost: there is no handshake.
            if isochronous {
                return OutReply::Ack;
            }
            self.ping_nak(2 + index as u32);
            return OutReply::Nak;
        }
        ep.receive(data);
        ep.toggle = !toggle && !isochronous;
        self.int.raise_usb(usb::EP2 << index);
        self.fifo_changed();
        OutReply::Ack
    }
}
