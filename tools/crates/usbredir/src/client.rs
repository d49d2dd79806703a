//! A host without a kernel: uses a device that [`serve`](crate::serve) or any other usbredir server
//! offers over TCP. Transfers may be under way on several endpoints at once; every wait has an end.

use crate::protocol::{
    Control, LENGTH_MAX, OURS, Status, VERSION_SIZE, Writer, capability, header_size, kind, u16_at,
    u32_at,
};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};
use thiserror::Error;

/// A peer that takes no bytes for so long is given up.
const WRITE_TIMEOUT: Duration = Duration::from_secs(10);

/// Why something did not work.
#[derive(Debug, Error)]
pub enum ClientError {
    /// Nobody listens, or the network fails.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The server has ended the connection.
    #[error("the twin has ended the connection")]
    Closed,
    /// It has not said hello in time: it serves one client at a time.
    #[error("no answer within {0} s: another client is using it, or it is no usbredir server")]
    Silent(u64),
    /// What it says is not usbredir.
    #[error("what answers there does not speak usbredir")]
    NotUsbredir,
    /// It serves, but no device has appeared on its bus.
    #[error("no device has come onto the bus within {0} s")]
    NoDevice(u64),
    /// The device has left the bus.
    #[error("the device has left the bus")]
    Gone,
    /// A transfer did not end in its time.
    #[error("the device did not answer within {0} s")]
    Timeout(u64),
}

/// The device that is on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Device {
    /// Whether it runs at high speed.
    pub high_speed: bool,
    /// idVendor.
    pub vendor: u16,
    /// idProduct.
    pub product: u16,
    /// bcdDevice; 0 if the server does not tell.
    pub release: u16,
}

/// How a transfer ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Its end.
    pub status: Status,
    /// Bytes moved in the data stage, either way.
    pub length: usize,
    /// What was read.
    pub data: Vec<u8>,
}

/// A transfer that was begun.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticket(u64);

/// A connection to a server.
#[derive(Debug)]
pub struct Client {
    stream: TcpStream,
    incoming: Vec<u8>,
    writer: Writer,
    greeted: bool,
    device: Option<Device>,
    arrivals: u64,
    next_id: u64,
    pending: BTreeSet<u64>,
    answers: BTreeMap<u64, Answer>,
}

impl Client {
    /// Connects and greets; the server must answer within `patience`.
    ///
    /// # Errors
    /// If nobody listens, or who listens serves somebody else or something else.
    pub fn connect(address: SocketAddr, patience: Duration) -> Result<Self, ClientError> {
        let stream = TcpStream::connect_timeout(&address, patience)?;
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
        let mut client = Self::on(stream);
        client.writer.hello("stereosot client");
        client.flush()?;
        let end = Instant::now() + patience;
        while !client.greeted {
            if !client.pump(end)? {
                return Err(ClientError::Silent(patience.as_secs()));
            }
        }
        Ok(client)
    }

    /// Before anything was said.
    fn on(stream: TcpStream) -> Self {
        Self {
            stream,
            incoming: Vec::new(),
            writer: Writer::default(),
            greeted: false,
            device: None,
            arrivals: 0,
            next_id: 1,
            pending: BTreeSet::new(),
            answers: BTreeMap::new(),
        }
    }

    /// The device on the bus, if there is one.
    #[must_use]
    pub fn device(&self) -> Option<Device> {
        self.device
    }

    /// How often a device has come onto the bus.
    #[must_use]
    pub fn arrivals(&self) -> u64 {
        self.arrivals
    }

    /// Waits until a device is on the bus, and it is not one of the first `arrivals`.
    ///
    /// # Errors
    /// If none comes within `patience`.
    pub fn wait_for_device(
        &mut self,
        arrivals: u64,
        patience: Duration,
    ) -> Result<Device, ClientError> {
        let end = Instant::now() + patience;
        loop {
            if let Some(device) = self.device.filter(|_| self.arrivals > arrivals) {
                return Ok(device);
            }
            if !self.pump(end)? {
                return Err(ClientError::NoDevice(patience.as_secs()));
            }
        }
    }

    /// Begins a control transfer; `data` for one that writes, `control.length` counts for one that
    /// reads.
    ///
    /// # Errors
    /// If the connection breaks.
    pub fn control(&mut self, control: Control, data: &[u8]) -> Result<Ticket, ClientError> {
        let [value, index, length] =
            [control.value, control.index, control.length].map(u16::to_le_bytes);
        let head = [control.endpoint, control.request, control.request_type, 0];
        self.begin(kind::CONTROL_PACKET, &[&head, &value, &index, &length, data])
    }

    /// Begins a bulk transfer: writes `data`, or reads up to `length` bytes if `endpoint` has bit 7
    /// set.
    ///
    /// # Errors
    /// If the connection breaks.
    ///
    /// # Panics
    /// If more than [`LENGTH_MAX`] / 2 bytes are to be moved.
    pub fn bulk(
        &mut self,
        endpoint: u8,
        length: usize,
        data: &[u8],
    ) -> Result<Ticket, ClientError> {
        assert!(length <= LENGTH_MAX / 2, "a transfer of {length} bytes is too long");
        let length = (length as u32).to_le_bytes();
        let head = [endpoint, 0, length[0], length[1], 0, 0, 0, 0];
        let wide = self.writer.shared & capability::BULK_LENGTH_32 != 0;
        self.begin(kind::BULK_PACKET, &[&head, if wide { &length[2..] } else { &[] }, data])
    }

    /// Begins SET_CONFIGURATION.
    ///
    /// # Errors
    /// If the connection breaks.
    pub fn set_configuration(&mut self, value: u8) -> Result<Ticket, ClientError> {
        self.begin(kind::SET_CONFIGURATION, &[&[value]])
    }

    /// Begins SET_INTERFACE.
    ///
    /// # Errors
    /// If the connection breaks.
    pub fn set_alternate(&mut self, interface: u8, setting: u8) -> Result<Ticket, ClientError> {
        self.begin(kind::SET_ALT_SETTING, &[&[interface, setting]])
    }

    /// Asks for the end of a data transfer; it is answered as cancelled, or as done if it was.
    ///
    /// # Errors
    /// If the connection breaks.
    pub fn cancel(&mut self, ticket: Ticket) -> Result<(), ClientError> {
        if self.pending.contains(&ticket.0) {
            self.writer.packet(kind::CANCEL_DATA_PACKET, ticket.0, &[]);
            self.flush()?;
        }
        Ok(())
    }

    /// Waits for the end of a transfer; `None` if it has not come within `patience`: it goes on then.
    ///
    /// # Errors
    /// If the device leaves, or the connection breaks.
    pub fn wait(
        &mut self,
        ticket: Ticket,
        patience: Duration,
    ) -> Result<Option<Answer>, ClientError> {
        let end = Instant::now() + patience;
        loop {
            if let Some(answer) = self.answers.remove(&ticket.0) {
                return Ok(Some(answer));
            }
            if self.device.is_none() || !self.pending.contains(&ticket.0) {
                return Err(ClientError::Gone);
            }
            if !self.pump(end)? {
                return Ok(None);
            }
        }
    }

    fn begin(&mut self, kind: u32, parts: &[&[u8]]) -> Result<Ticket, ClientError> {
        if self.device.is_none() {
            return Err(ClientError::Gone);
        }
        let id = self.next_id;
        self.next_id += 1;
        self.writer.packet(kind, id, parts);
        self.pending.insert(id);
        self.flush()?;
        Ok(Ticket(id))
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        let bytes = std::mem::take(&mut self.writer.bytes);
        self.stream.write_all(&bytes).map_err(|error| match error.kind() {
            ErrorKind::BrokenPipe | ErrorKind::ConnectionReset => ClientError::Closed,
            _ => ClientError::Io(error),
        })
    }

    /// Takes what comes until `end`, at least once; false if the time is over and nothing came.
    fn pump(&mut self, end: Instant) -> Result<bool, ClientError> {
        // A time of zero would mean to wait for ever.
        let left = end.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        self.stream.set_read_timeout(Some(left))?;
        let mut buffer = [0; 65536];
        match self.stream.read(&mut buffer) {
            Ok(0) => return Err(ClientError::Closed),
            Ok(count) => self.incoming.extend_from_slice(&buffer[..count]),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut => return Ok(Instant::now() < end),
                ErrorKind::Interrupted => return Ok(true),
                ErrorKind::ConnectionReset => return Err(ClientError::Closed),
                _ => return Err(error.into()),
            },
        }
        while self.take_packet()? {}
        self.flush()?;
        Ok(true)
    }

    /// Handles one whole packet, if there is one.
    fn take_packet(&mut self) -> Result<bool, ClientError> {
        let header = header_size(self.writer.shared);
        if self.incoming.len() < header {
            return Ok(false);
        }
        let kind = u32_at(&self.incoming, 0);
        let length = u32_at(&self.incoming, 4) as usize;
        if length > LENGTH_MAX || !self.greeted && kind != kind::HELLO {
            return Err(ClientError::NotUsbredir);
        }
        if self.incoming.len() < header + length {
            return Ok(false);
        }
        let mut id = u64::from(u32_at(&self.incoming, 8));
        if header == 16 {
            id |= u64::from(u32_at(&self.incoming, 12)) << 32;
        }
        let body: Vec<u8> = self.incoming.drain(..header + length).skip(header).collect();
        self.handle(kind, id, &body).ok_or(ClientError::NotUsbredir)?;
        Ok(true)
    }

    /// `None` if the packet is shorter than its kind must be.
    fn handle(&mut self, kind: u32, id: u64, body: &[u8]) -> Option<()> {
        match kind {
            kind::HELLO => {
                body.get(..VERSION_SIZE)?;
                let theirs = body.get(VERSION_SIZE..VERSION_SIZE + 4);
                self.writer.shared = theirs.map_or(0, |word| u32_at(word, 0)) & OURS;
                self.greeted = true;
            }
            kind::DEVICE_CONNECT => {
                let body = body.get(..8).map(|_| body)?;
                let release = body.get(8..10).map_or(0, |word| u16_at(word, 0));
                let (vendor, product) = (u16_at(body, 4), u16_at(body, 6));
                let high_speed = body[0] == 2;
                self.device = Some(Device { high_speed, vendor, product, release });
                self.arrivals += 1;
            }
            kind::DEVICE_DISCONNECT => {
                self.device = None;
                self.pending.clear();
                if self.writer.shared & capability::DEVICE_DISCONNECT_ACK != 0 {
                    self.writer.packet(kind::DEVICE_DISCONNECT_ACK, 0, &[]);
                }
            }
            kind::CONFIGURATION_STATUS | kind::ALT_SETTING_STATUS => {
                self.end(id, *body.first()?, 0, &[]);
            }
            kind::CONTROL_PACKET => {
                let (head, data) = body.split_at_checked(10)?;
                self.end(id, head[3], usize::from(u16_at(head, 8)), data);
            }
            kind::BULK_PACKET => {
                let wide = self.writer.shared & capability::BULK_LENGTH_32 != 0;
                let (head, data) = body.split_at_checked(if wide { 10 } else { 8 })?;
                let high = if wide { usize::from(u16_at(head, 8)) << 16 } else { 0 };
                self.end(id, head[1], high | usize::from(u16_at(head, 2)), data);
            }
            // Interfaces and endpoints are read from the descriptors; the rest was not asked for.
            _ => {}
        }
        Some(())
    }

    fn end(&mut self, id: u64, status: u8, length: usize, data: &[u8]) {
        // What nobody waits for any more is dropped.
        if self.pending.remove(&id) {
            let status = Status::from_code(status);
            self.answers.insert(id, Answer { status, length, data: data.to_vec() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;
    use std::thread;

    const SHORT: Duration = Duration::from_millis(200);

    /// A server that sends `bytes` and, unless it `stays`, goes.
    fn server(bytes: &'static [u8], stays: bool) -> (SocketAddr, thread::JoinHandle<()>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let thread = thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            stream.write_all(bytes).unwrap();
            while stays && matches!(stream.read(&mut [0; 4096]), Ok(1..)) {}
        });
        (address, thread)
    }

    #[test]
    fn a_server_that_is_none_ends_in_an_error_of_its_own() {
        let (address, thread) = server(b"HTTP/1.1 400 Bad Request\r\n\r\n", true);
        let error = Client::connect(address, SHORT).unwrap_err();
        assert!(matches!(error, ClientError::NotUsbredir), "{error}");
        thread.join().unwrap();

        let (address, thread) = server(b"", true);
        let error = Client::connect(address, SHORT).unwrap_err();
        assert!(matches!(error, ClientError::Silent(_)), "{error}");
        thread.join().unwrap();

        let (address, thread) = server(b"", false);
        let error = Client::connect(address, Duration::from_secs(10)).unwrap_err();
        assert!(matches!(error, ClientError::Closed), "{error}");
        thread.join().unwrap();
    }

    #[test]
    fn packets_shorter_than_their_kind_are_refused() {
        for kind in [kind::HELLO, kind::DEVICE_CONNECT, kind::CONTROL_PACKET, kind::BULK_PACKET] {
            let (address, thread) = server(b"", true);
            let mut client = Client::on(TcpStream::connect(address).unwrap());
            client.greeted = true;
            client.incoming.extend_from_slice(&kind.to_le_bytes());
            client.incoming.extend_from_slice(&[4, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4]);
            assert!(matches!(client.take_packet(), Err(ClientError::NotUsbredir)), "{kind}");
            drop(client);
            thread.join().unwrap();
        }
    }

    #[test]
    fn nothing_begins_without_a_device() {
        let (address, thread) = server(b"", true);
        let mut client = Client::on(TcpStream::connect(address).unwrap());
        assert!(matches!(client.set_configuration(1), Err(ClientError::Gone)));
        let error = client.wait_for_device(0, SHORT).unwrap_err();
        assert!(matches!(error, ClientError::NoDevice(_)), "{error}");
        drop(client);
        thread.join().unwrap();
    }
}
