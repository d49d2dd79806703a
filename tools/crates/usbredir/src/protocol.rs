//! The usbredir protocol, version 0.7: packets to and from bytes (usb-redirection-protocol.md of the
//! usbredir project). Little-endian throughout. Only what a device's side needs.

use thiserror::Error;

/// Capability bits.
pub mod capability {
    /// device_connect carries bcdDevice.
    pub const CONNECT_DEVICE_VERSION: u32 = 1 << 1;
    /// device_disconnect is acknowledged.
    pub const DEVICE_DISCONNECT_ACK: u32 = 1 << 3;
    /// ep_info carries packet sizes.
    pub const EP_INFO_MAX_PACKET_SIZE: u32 = 1 << 4;
    /// Packet ids have 64 bits.
    pub const IDS_64: u32 = 1 << 5;
    /// Bulk lengths have 32 bits.
    pub const BULK_LENGTH_32: u32 = 1 << 6;
}

/// What this side offers.
pub const OURS: u32 = capability::CONNECT_DEVICE_VERSION
    | capability::DEVICE_DISCONNECT_ACK
    | capability::EP_INFO_MAX_PACKET_SIZE
    | capability::IDS_64
    | capability::BULK_LENGTH_32;

/// The longest packet taken from a peer; a bulk transfer of a real host has at most 1 MiB.
pub const LENGTH_MAX: usize = 4 << 20;

/// Bytes of the version string in hello.
pub(crate) const VERSION_SIZE: usize = 64;
/// Endpoint slots: 0..=15 OUT, 16..=31 IN.
pub const ENDPOINTS: usize = 32;

pub(crate) mod kind {
    pub const HELLO: u32 = 0;
    pub const DEVICE_CONNECT: u32 = 1;
    pub const DEVICE_DISCONNECT: u32 = 2;
    pub const RESET: u32 = 3;
    pub const INTERFACE_INFO: u32 = 4;
    pub const EP_INFO: u32 = 5;
    pub const SET_CONFIGURATION: u32 = 6;
    pub const GET_CONFIGURATION: u32 = 7;
    pub const CONFIGURATION_STATUS: u32 = 8;
    pub const SET_ALT_SETTING: u32 = 9;
    pub const GET_ALT_SETTING: u32 = 10;
    pub const ALT_SETTING_STATUS: u32 = 11;
    pub const START_ISO_STREAM: u32 = 12;
    pub const STOP_ISO_STREAM: u32 = 13;
    pub const ISO_STREAM_STATUS: u32 = 14;
    pub const START_INTERRUPT_RECEIVING: u32 = 15;
    pub const STOP_INTERRUPT_RECEIVING: u32 = 16;
    pub const INTERRUPT_RECEIVING_STATUS: u32 = 17;
    pub const CANCEL_DATA_PACKET: u32 = 21;
    pub const DEVICE_DISCONNECT_ACK: u32 = 24;
    pub const CONTROL_PACKET: u32 = 100;
    pub const BULK_PACKET: u32 = 101;
    pub const ISO_PACKET: u32 = 102;
    pub const INTERRUPT_PACKET: u32 = 103;
}

/// How something ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// Done.
    Success = 0,
    /// Taken back.
    Cancelled = 1,
    /// Not possible with this device.
    Invalid = 2,
    /// The device failed.
    IoError = 3,
    /// STALL.
    Stall = 4,
    /// More data than asked for.
    Babble = 6,
}

impl Status {
    /// From its number; what is unknown is a failure.
    pub(crate) fn from_code(code: u8) -> Self {
        [Self::Success, Self::Cancelled, Self::Invalid, Self::Stall, Self::Babble]
            .into_iter()
            .find(|status| *status as u8 == code)
            .unwrap_or(Self::IoError)
    }
}

/// A control transfer's fields; `length` is what was asked for, or moved in an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Control {
    /// Endpoint with direction in bit 7.
    pub endpoint: u8,
    /// bRequest.
    pub request: u8,
    /// bmRequestType.
    pub request_type: u8,
    /// wValue.
    pub value: u16,
    /// wIndex.
    pub index: u16,
    /// wLength.
    pub length: u16,
}

/// What a peer (the side that has the host) sends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Its capabilities.
    Hello(u32),
    /// Reset the device.
    Reset,
    /// SET_CONFIGURATION.
    SetConfiguration(u8),
    /// GET_CONFIGURATION.
    GetConfiguration,
    /// SET_INTERFACE: interface and alternate setting.
    SetAlternate(u8, u8),
    /// GET_INTERFACE.
    GetAlternate(u8),
    /// Start an isochronous stream.
    StartIso(u8),
    /// End it.
    StopIso(u8),
    /// Poll an interrupt endpoint.
    StartInterrupt(u8),
    /// Stop that.
    StopInterrupt(u8),
    /// Take a packet back.
    Cancel,
    /// It has seen that the device went.
    DisconnectAck,
    /// A control transfer; data if it writes.
    Control(Control, Vec<u8>),
    /// A bulk transfer: endpoint, length, data if it writes.
    Bulk(u8, usize, Vec<u8>),
    /// An isochronous OUT packet.
    Iso(u8, Vec<u8>),
    /// An interrupt OUT packet.
    Interrupt(u8, Vec<u8>),
    /// Something that this side does not offer.
    Other(u32),
}

/// Why a peer's bytes make no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ProtocolError {
    /// A length beyond reason.
    #[error("a usbredir packet of {0} bytes is announced; the peer does not speak usbredir")]
    TooLong(usize),
    /// A packet of the wrong size.
    #[error("a usbredir packet of type {0} has {1} bytes, which does not fit its type")]
    BadLength(u32, usize),
    /// Something before hello.
    #[error("the peer did not begin with a usbredir hello")]
    NoHello,
}

/// Takes bytes in, gives requests out.
#[derive(Clone, Debug, Default)]
pub struct Reader {
    buffer: Vec<u8>,
    peer: Option<u32>,
}

impl Reader {
    /// Bytes as they came.
    pub fn push(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
    }

    /// Capabilities that both sides have; none before hello.
    #[must_use]
    pub fn shared(&self) -> u32 {
        self.peer.unwrap_or(0) & OURS
    }

    /// Whether hello was received.
    #[must_use]
    pub fn greeted(&self) -> bool {
        self.peer.is_some()
    }

    /// The next whole packet: its id and content.
    ///
    /// # Errors
    /// If the bytes are not usbredir. The connection cannot go on then.
    pub fn take(&mut self) -> Result<Option<(u64, Request)>, ProtocolError> {
        let header = header_size(self.shared());
        if self.buffer.len() < header {
            return Ok(None);
        }
        let kind = u32_at(&self.buffer, 0);
        let length = u32_at(&self.buffer, 4) as usize;
        if length > LENGTH_MAX {
            return Err(ProtocolError::TooLong(length));
        }
        if kind != kind::HELLO && !self.greeted() {
            return Err(ProtocolError::NoHello);
        }
        if self.buffer.len() < header + length {
            return Ok(None);
        }
        let mut id = u64::from(u32_at(&self.buffer, 8));
        if header == 16 {
            id |= u64::from(u32_at(&self.buffer, 12)) << 32;
        }
        let body: Vec<u8> = self.buffer.drain(..header + length).skip(header).collect();
        let request = parse(kind, &body, self.shared())?;
        if let Request::Hello(capabilities) = request {
            self.peer = Some(capabilities);
        }
        Ok(Some((id, request)))
    }
}

pub(crate) fn header_size(shared: u32) -> usize {
    if shared & capability::IDS_64 != 0 { 16 } else { 12 }
}

pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from(u16_at(bytes, at)) | u32::from(u16_at(bytes, at + 2)) << 16
}

/// Size of a packet's fixed part, `None` for packets of no interest.
fn fixed_size(kind: u32, shared: u32) -> Option<usize> {
    Some(match kind {
        kind::HELLO => VERSION_SIZE,
        kind::RESET | kind::GET_CONFIGURATION => 0,
        kind::CANCEL_DATA_PACKET | kind::DEVICE_DISCONNECT_ACK => 0,
        kind::SET_CONFIGURATION | kind::GET_ALT_SETTING | kind::STOP_ISO_STREAM => 1,
        kind::START_INTERRUPT_RECEIVING | kind::STOP_INTERRUPT_RECEIVING => 1,
        kind::SET_ALT_SETTING => 2,
        kind::START_ISO_STREAM => 3,
        kind::CONTROL_PACKET => 10,
        kind::BULK_PACKET if shared & capability::BULK_LENGTH_32 != 0 => 10,
        kind::BULK_PACKET => 8,
        kind::ISO_PACKET | kind::INTERRUPT_PACKET => 4,
        _ => return None,
    })
}

fn parse(kind: u32, body: &[u8], shared: u32) -> Result<Request, ProtocolError> {
    let Some(size) = fixed_size(kind, shared) else { return Ok(Request::Other(kind)) };
    let bad = ProtocolError::BadLength(kind, body.len());
    let carries = matches!(
        kind,
        kind::HELLO
            | kind::CONTROL_PACKET
            | kind::BULK_PACKET
            | kind::ISO_PACKET
            | kind::INTERRUPT_PACKET
    );
    if body.len() < size || body.len() > size && !carries {
        return Err(bad);
    }
    let (fixed, data) = body.split_at(size);
    Ok(match kind {
        // Further capability words are of later versions.
        kind::HELLO => Request::Hello(if data.len() >= 4 { u32_at(data, 0) } else { 0 }),
        kind::RESET => Request::Reset,
        kind::GET_CONFIGURATION => Request::GetConfiguration,
        kind::CANCEL_DATA_PACKET => Request::Cancel,
        kind::DEVICE_DISCONNECT_ACK => Request::DisconnectAck,
        kind::SET_CONFIGURATION => Request::SetConfiguration(fixed[0]),
        kind::GET_ALT_SETTING => Request::GetAlternate(fixed[0]),
        kind::SET_ALT_SETTING => Request::SetAlternate(fixed[0], fixed[1]),
        kind::START_ISO_STREAM => Request::StartIso(fixed[0]),
        kind::STOP_ISO_STREAM => Request::StopIso(fixed[0]),
        kind::START_INTERRUPT_RECEIVING => Request::StartInterrupt(fixed[0]),
        kind::STOP_INTERRUPT_RECEIVING => Request::StopInterrupt(fixed[0]),
        kind::CONTROL_PACKET => control(fixed, data).ok_or(bad)?,
        kind::BULK_PACKET => bulk(fixed, data).ok_or(bad)?,
        _ => {
            let length = usize::from(u16_at(fixed, 2));
            if fixed[0] & 0x80 != 0 || data.len() != length {
                return Err(bad);
            }
            match kind {
                kind::ISO_PACKET => Request::Iso(fixed[0], data.to_vec()),
                _ => Request::Interrupt(fixed[0], data.to_vec()),
            }
        }
    })
}

/// Data must be there exactly if the transfer writes.
fn control(fixed: &[u8], data: &[u8]) -> Option<Request> {
    let control = Control {
        endpoint: fixed[0],
        request: fixed[1],
        request_type: fixed[2],
        value: u16_at(fixed, 4),
        index: u16_at(fixed, 6),
        length: u16_at(fixed, 8),
    };
    let expected = if control.endpoint & 0x80 != 0 { 0 } else { usize::from(control.length) };
    (data.len() == expected).then(|| Request::Control(control, data.to_vec()))
}

fn bulk(fixed: &[u8], data: &[u8]) -> Option<Request> {
    let high = if fixed.len() == 10 { usize::from(u16_at(fixed, 8)) } else { 0 };
    let length = high << 16 | usize::from(u16_at(fixed, 2));
    let expected = if fixed[0] & 0x80 != 0 { 0 } else { length };
    let fits = data.len() == expected && length <= LENGTH_MAX;
    fits.then(|| Request::Bulk(fixed[0], length, data.to_vec()))
}

/// An endpoint as ep_info tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// 0 control, 1 isochronous, 2 bulk, 3 interrupt.
    pub kind: u8,
    /// bInterval.
    pub interval: u8,
    /// Its interface.
    pub interface: u8,
    /// wMaxPacketSize.
    pub max_packet: u16,
}

/// An interface as interface_info tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// bInterfaceNumber.
    pub number: u8,
    /// bInterfaceClass, bInterfaceSubClass, bInterfaceProtocol.
    pub class: [u8; 3],
}

/// Builds packets for a peer.
#[derive(Clone, Debug, Default)]
pub struct Writer {
    /// Bytes to send.
    pub bytes: Vec<u8>,
    /// Capabilities that both sides have.
    pub shared: u32,
}

impl Writer {
    pub(crate) fn packet(&mut self, kind: u32, id: u64, parts: &[&[u8]]) {
        let length: usize = parts.iter().map(|part| part.len()).sum();
        self.bytes.extend_from_slice(&kind.to_le_bytes());
        self.bytes.extend_from_slice(&(length as u32).to_le_bytes());
        let id = id.to_le_bytes();
        self.bytes.extend_from_slice(&id[..header_size(self.shared) - 8]);
        for part in parts {
            self.bytes.extend_from_slice(part);
        }
    }

    fn has(&self, capability: u32) -> bool {
        self.shared & capability != 0
    }

    /// hello, the first packet of all.
    pub fn hello(&mut self, version: &str) {
        let mut name = [0; VERSION_SIZE];
        for (slot, byte) in name[..VERSION_SIZE - 1].iter_mut().zip(version.bytes()) {
            *slot = byte;
        }
        self.packet(kind::HELLO, 0, &[&name, &OURS.to_le_bytes()]);
    }

    /// device_connect: `speed` 1 full, 2 high; class, subclass, protocol; vendor, product, bcdDevice.
    pub fn device_connect(&mut self, speed: u8, class: [u8; 3], ids: [u16; 3]) {
        let mut body = vec![speed, class[0], class[1], class[2]];
        let count = if self.has(capability::CONNECT_DEVICE_VERSION) { 3 } else { 2 };
        for id in &ids[..count] {
            body.extend_from_slice(&id.to_le_bytes());
        }
        self.packet(kind::DEVICE_CONNECT, 0, &[&body]);
    }

    /// device_disconnect.
    pub fn device_disconnect(&mut self) {
        self.packet(kind::DEVICE_DISCONNECT, 0, &[]);
    }

    /// interface_info; at most 32 are told.
    pub fn interface_info(&mut self, interfaces: &[Interface]) {
        let mut fields = [[0u8; ENDPOINTS]; 4];
        for (n, interface) in interfaces.iter().take(ENDPOINTS).enumerate() {
            fields[0][n] = interface.number;
            for (field, value) in fields[1..].iter_mut().zip(interface.class) {
                field[n] = value;
            }
        }
        let count = (interfaces.len().min(ENDPOINTS) as u32).to_le_bytes();
        let [number, class, subclass, protocol] = &fields;
        let parts: [&[u8]; 5] = [&count, number, class, subclass, protocol];
        self.packet(kind::INTERFACE_INFO, 0, &parts);
    }

    /// ep_info.
    pub fn ep_info(&mut self, endpoints: &[Option<Endpoint>; ENDPOINTS]) {
        let field = |get: fn(&Endpoint) -> u8, none: u8| {
            endpoints.map(|endpoint| endpoint.as_ref().map_or(none, get))
        };
        let mut body = Vec::new();
        body.extend_from_slice(&field(|e| e.kind, 0xFF));
        body.extend_from_slice(&field(|e| e.interval, 0));
        body.extend_from_slice(&field(|e| e.interface, 0));
        if self.has(capability::EP_INFO_MAX_PACKET_SIZE) {
            for endpoint in endpoints {
                let size = endpoint.map_or(0, |e| e.max_packet);
                body.extend_from_slice(&size.to_le_bytes());
            }
        }
        self.packet(kind::EP_INFO, 0, &[&body]);
    }

    /// configuration_status.
    pub fn configuration_status(&mut self, id: u64, status: Status, configuration: u8) {
        self.packet(kind::CONFIGURATION_STATUS, id, &[&[status as u8, configuration]]);
    }

    /// alt_setting_status.
    pub fn alternate_status(&mut self, id: u64, status: Status, interface: u8, alternate: u8) {
        self.packet(kind::ALT_SETTING_STATUS, id, &[&[status as u8, interface, alternate]]);
    }

    /// iso_stream_status.
    pub fn iso_status(&mut self, id: u64, status: Status, endpoint: u8) {
        self.packet(kind::ISO_STREAM_STATUS, id, &[&[status as u8, endpoint]]);
    }

    /// interrupt_receiving_status.
    pub fn interrupt_status(&mut self, id: u64, status: Status, endpoint: u8) {
        self.packet(kind::INTERRUPT_RECEIVING_STATUS, id, &[&[status as u8, endpoint]]);
    }

    /// The answer to a control transfer.
    pub fn control(&mut self, id: u64, control: Control, status: Status, data: &[u8]) {
        let [value, index, length] =
            [control.value, control.index, control.length].map(u16::to_le_bytes);
        let head = [control.endpoint, control.request, control.request_type, status as u8];
        self.packet(kind::CONTROL_PACKET, id, &[&head, &value, &index, &length, data]);
    }

    /// The answer to a bulk transfer of `length` bytes.
    pub fn bulk(&mut self, id: u64, endpoint: u8, status: Status, length: usize, data: &[u8]) {
        let length = (length as u32).to_le_bytes();
        let head = [endpoint, status as u8, length[0], length[1], 0, 0, 0, 0];
        let high: &[u8] = if self.has(capability::BULK_LENGTH_32) { &length[2..] } else { &[] };
        self.packet(kind::BULK_PACKET, id, &[&head, high, data]);
    }

    /// An isochronous packet.
    pub fn iso(&mut self, id: u64, endpoint: u8, status: Status, data: &[u8]) {
        let [low, high] = (data.len() as u16).to_le_bytes();
        self.packet(kind::ISO_PACKET, id, &[&[endpoint, status as u8, low, high], data]);
    }

    /// An interrupt packet, or the answer to one of `length` bytes.
    pub fn interrupt(&mut self, id: u64, endpoint: u8, status: Status, length: usize, data: &[u8]) {
        let [low, high] = (length as u16).to_le_bytes();
        self.packet(kind::INTERRUPT_PACKET, id, &[&[endpoint, status as u8, low, high], data]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A peer's packet as the protocol writes it.
    fn packet(kind: u32, id: u64, wide: bool, body: &[u8]) -> Vec<u8> {
        let mut bytes = kind.to_le_bytes().to_vec();
        bytes.extend_from_slice(&(body.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&id.to_le_bytes()[..if wide { 8 } else { 4 }]);
        bytes.extend_from_slice(body);
        bytes
    }

    fn hello(capabilities: u32) -> Vec<u8> {
        let mut body = vec![0; VERSION_SIZE];
        body.extend_from_slice(&capabilities.to_le_bytes());
        packet(kind::HELLO, 0, false, &body)
    }

    fn greeted(capabilities: u32) -> Reader {
        let mut reader = Reader::default();
        reader.push(&hello(capabilities));
        assert_eq!(reader.take(), Ok(Some((0, Request::Hello(capabilities)))));
        reader
    }

    #[test]
    fn packets_are_found_however_the_bytes_come() {
        let mut reader = greeted(OURS);
        let mut bytes = packet(kind::SET_CONFIGURATION, 5, true, &[1]);
        bytes.extend(packet(kind::BULK_PACKET, 1 << 40, true, &[0x86, 0, 0, 2, 0, 0, 0, 0, 1, 0]));
        for byte in &bytes[..bytes.len() - 1] {
            reader.push(&[*byte]);
        }
        assert_eq!(reader.take(), Ok(Some((5, Request::SetConfiguration(1)))));
        assert_eq!(reader.take(), Ok(None));
        reader.push(&bytes[bytes.len() - 1..]);
        assert_eq!(reader.take(), Ok(Some((1 << 40, Request::Bulk(0x86, 0x1_0200, vec![])))));
    }

    #[test]
    fn a_peer_without_wide_ids_and_lengths_is_understood() {
        let mut reader = greeted(0);
        reader.push(&packet(kind::BULK_PACKET, 7, false, &[0x02, 0, 3, 0, 0, 0, 0, 0, 1, 2, 3]));
        assert_eq!(reader.take(), Ok(Some((7, Request::Bulk(2, 3, vec![1, 2, 3])))));
    }

    #[test]
    fn nonsense_is_refused() {
        let mut reader = Reader::default();
        reader.push(b"GET / HTTP/1.1\r\n");
        assert!(matches!(reader.take(), Err(ProtocolError::TooLong(_))));
        let mut reader = Reader::default();
        reader.push(&packet(kind::RESET, 0, false, &[]));
        assert_eq!(reader.take(), Err(ProtocolError::NoHello));
        let cases: [(u32, &[u8]); 5] = [
            (kind::SET_CONFIGURATION, &[]),
            (kind::SET_ALT_SETTING, &[1]),
            (kind::CONTROL_PACKET, &[0x00, 0, 0, 0, 0, 0, 0, 0, 5, 0, 1]),
            (kind::BULK_PACKET, &[0x02, 0, 9, 0, 0, 0, 0, 0, 0, 0, 1]),
            (kind::INTERRUPT_PACKET, &[0x81, 0, 0, 0]),
        ];
        for (kind, body) in cases {
            let mut reader = greeted(OURS);
            reader.push(&packet(kind, 0, true, body));
            assert_eq!(reader.take(), Err(ProtocolError::BadLength(kind, body.len())));
        }
    }

    #[test]
    fn any_bytes_end_in_requests_or_an_error() {
        let mut seed = 1u64;
        for _ in 0..2000 {
            let mut reader = greeted(OURS);
            for _ in 0..8 {
                let mut body = Vec::new();
                for _ in 0..seed >> 33 & 15 {
                    seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1);
                    body.push((seed >> 40) as u8);
                }
                seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1);
                reader.push(&packet((seed >> 35) as u32 % 110, seed, true, &body));
            }
            while let Ok(Some(_)) = reader.take() {}
        }
    }

    #[test]
    fn what_is_written_has_the_sizes_of_the_protocol() {
        let mut writer = Writer { shared: OURS, ..Writer::default() };
        let mut size = |write: &dyn Fn(&mut Writer)| {
            writer.bytes.clear();
            write(&mut writer);
            let announced = u32_at(&writer.bytes, 4) as usize;
            assert_eq!(announced + 16, writer.bytes.len());
            announced
        };
        assert_eq!(size(&|w| w.device_connect(2, [0; 3], [0x04B4, 0x8613, 0])), 10);
        assert_eq!(size(&|w| w.interface_info(&[])), 132);
        assert_eq!(size(&|w| w.ep_info(&[None; ENDPOINTS])), 160);
        assert_eq!(size(&|w| w.bulk(1, 0x86, Status::Success, 4, &[0; 4])), 14);
        let mut first = Writer::default();
        first.hello("test");
        assert_eq!(first.bytes.len(), 12 + 68, "hello has a 32-bit id");
    }
}
