//! A device on a twin's bus, over the twin's usbredir socket.

use std::collections::{BTreeMap, VecDeque};
use std::net::{SocketAddr, ToSocketAddrs};
use std::time::Duration;

use usbredir::client::{Answer, Client, ClientError, Ticket};
use usbredir::protocol::{Control, Status};

use crate::device::{Device, Identity, LinkError, Setup};

/// How long a twin may take to answer a new client; it serves one at a time.
const HELLO_PATIENCE: Duration = Duration::from_secs(5);
/// How long its device may take to come onto the bus: simulated time may be slower than ours.
const ARRIVAL_PATIENCE: Duration = Duration::from_secs(10);
/// For one control transfer.
const CONTROL_PATIENCE: Duration = Duration::from_secs(10);
/// Size of the transfers that a long write is made of, and how many are under way.
const WRITE_SIZE: usize = 64 << 10;
const WRITES: usize = 4;

const IN: u8 = 0x80;
const GET_DESCRIPTOR: u8 = 6;
const CLEAR_FEATURE: u8 = 1;
const TO_ENDPOINT: u8 = 2;
const DEVICE: u16 = 1 << 8;
const CONFIGURATION: u16 = 2 << 8;
const STRING: u16 = 3 << 8;
const ENGLISH: u16 = 0x0409;

/// A device at the other end of a socket.
pub struct Redirected {
    client: Client,
    name: String,
    identity: Identity,
    arrivals: u64,
    reads: BTreeMap<u8, VecDeque<Ticket>>,
}

impl Redirected {
    /// Opens the device that the twin at `place`, HOST:PORT, serves.
    ///
    /// # Errors
    /// If no twin is there, it is in use, or nothing is on its bus.
    pub fn open(place: &str) -> Result<Self, LinkError> {
        let name = format!("twin:{place}");
        let address = resolve(place)?;
        let mut client = Client::connect(address, HELLO_PATIENCE).map_err(|error| match error {
            ClientError::Io(error) => LinkError::Other(format!(
                "no twin answers at {place} ({error}); `sot list` shows those that run"
            )),
            ClientError::Silent(_) | ClientError::Closed => LinkError::Busy(name.clone()),
            other => LinkError::Other(format!("{name}: {other}")),
        })?;
        client
            .wait_for_device(0, ARRIVAL_PATIENCE)
            .map_err(|error| LinkError::Other(format!("{name}: {error}")))?;
        let identity = Identity {
            name: name.clone(),
            vendor: 0,
            product: 0,
            release: 0,
            serial: None,
            high_speed: false,
        };
        let mut device = Self { client, name, identity, arrivals: 0, reads: BTreeMap::new() };
        device.meet()?;
        Ok(device)
    }

    /// A device has come: who is it? Configures it, as a kernel does.
    fn meet(&mut self) -> Result<(), LinkError> {
        let device = self.client.device().ok_or(LinkError::Gone)?;
        self.arrivals = self.client.arrivals();
        self.reads.clear();
        self.identity = Identity {
            name: self.name.clone(),
            vendor: device.vendor,
            product: device.product,
            release: device.release,
            serial: None,
            high_speed: device.high_speed,
        };
        let descriptor = self.descriptor(DEVICE, 0, 18)?;
        if let Some(&index) = descriptor.get(16)
            && index != 0
        {
            self.identity.serial = Some(self.string(index)?);
        }
        let configuration = self.descriptor(CONFIGURATION, 0, 9)?;
        let value = *configuration
            .get(5)
            .ok_or_else(|| LinkError::Other(format!("{}: it has no configuration", self.name)))?;
        let ticket = self.client.set_configuration(value).map_err(broken)?;
        self.finish(ticket, CONTROL_PATIENCE).map(|_| ())
    }

    fn descriptor(&mut self, value: u16, index: u16, length: u16) -> Result<Vec<u8>, LinkError> {
        self.control_in(Setup { kind: IN, request: GET_DESCRIPTOR, value, index }, length)
    }

    fn string(&mut self, index: u8) -> Result<String, LinkError> {
        let bytes = self.descriptor(STRING | u16::from(index), ENGLISH, 255)?;
        let units: Vec<u16> = bytes
            .get(2..)
            .unwrap_or(&[])
            .as_chunks()
            .0
            .iter()
            .map(|&c| u16::from_le_bytes(c))
            .collect();
        Ok(String::from_utf16_lossy(&units))
    }

    /// Waits for the end of a transfer, which is ended if it takes too long.
    fn finish(&mut self, ticket: Ticket, patience: Duration) -> Result<Answer, LinkError> {
        if let Some(answer) = self.client.wait(ticket, patience).map_err(broken)? {
            return self.judge(answer);
        }
        self.client.cancel(ticket).map_err(broken)?;
        // Without this answer the next one would be taken for it.
        self.client.wait(ticket, patience).map_err(broken)?;
        Err(LinkError::Timeout(patience.as_secs_f64()))
    }

    fn judge(&self, answer: Answer) -> Result<Answer, LinkError> {
        match answer.status {
            Status::Success => Ok(answer),
            Status::Stall | Status::Invalid => Err(LinkError::Refused),
            Status::Cancelled => Err(LinkError::Gone),
            Status::Babble => Err(LinkError::Other("the device sent more than asked for".into())),
            Status::IoError if self.client.device().is_none() => Err(LinkError::Gone),
            Status::IoError => Err(LinkError::Other(
                "the transfer failed: there is no such endpoint in this alternate setting".into(),
            )),
        }
    }

    fn transfer(
        &mut self,
        endpoint: u8,
        setup: Setup,
        length: u16,
        data: &[u8],
    ) -> Result<Answer, LinkError> {
        let control = Control {
            endpoint,
            request: setup.request,
            request_type: setup.kind,
            value: setup.value,
            index: setup.index,
            length,
        };
        let ticket = self.client.control(control, data).map_err(broken)?;
        self.finish(ticket, CONTROL_PATIENCE)
    }
}

impl Device for Redirected {
    fn identity(&self) -> &Identity {
        &self.identity
    }

    fn control_in(&mut self, setup: Setup, length: u16) -> Result<Vec<u8>, LinkError> {
        Ok(self.transfer(IN, setup, length, &[])?.data)
    }

    fn control_out(&mut self, setup: Setup, data: &[u8]) -> Result<(), LinkError> {
        let length = u16::try_from(data.len())
            .map_err(|_| LinkError::Other("too many bytes for a control transfer".into()))?;
        self.transfer(0, setup, length, data).map(|_| ())
    }

    fn set_alternate(&mut self, setting: u8) -> Result<(), LinkError> {
        let ticket = self.client.set_alternate(0, setting).map_err(broken)?;
        self.finish(ticket, CONTROL_PATIENCE).map(|_| ())
    }

    fn clear_halt(&mut self, endpoint: u8) -> Result<(), LinkError> {
        let index = u16::from(endpoint);
        let setup = Setup { kind: TO_ENDPOINT, request: CLEAR_FEATURE, value: 0, index };
        self.control_out(setup, &[])
    }

    fn bulk_out(&mut self, endpoint: u8, data: &[u8], patience: Duration) -> Result<(), LinkError> {
        let mut tickets = VecDeque::new();
        let mut result = Ok(());
        let mut chunks = data.chunks(WRITE_SIZE);
        while result.is_ok() {
            match chunks.next() {
                Some(chunk) => {
                    tickets
                        .push_back(self.client.bulk(endpoint, chunk.len(), chunk).map_err(broken)?);
                    if tickets.len() < WRITES {
                        continue;
                    }
                }
                None if tickets.is_empty() => return Ok(()),
                None => {}
            }
            if let Some(ticket) = tickets.pop_front() {
                result = self.finish(ticket, patience).map(|_| ());
            }
        }
        // Those behind the one that failed must not be written.
        for &ticket in &tickets {
            self.client.cancel(ticket).map_err(broken)?;
        }
        for ticket in tickets {
            self.client.wait(ticket, patience).map_err(broken)?;
        }
        result
    }

    fn submit_read(&mut self, endpoint: u8, length: usize) -> Result<(), LinkError> {
        let ticket = self.client.bulk(endpoint, length, &[]).map_err(broken)?;
        self.reads.entry(endpoint).or_default().push_back(ticket);
        Ok(())
    }

    fn next_read(
        &mut self,
        endpoint: u8,
        patience: Duration,
    ) -> Result<Option<Vec<u8>>, LinkError> {
        let Some(&ticket) = self.reads.get(&endpoint).and_then(VecDeque::front) else {
            return Ok(None);
        };
        let Some(answer) = self.client.wait(ticket, patience).map_err(broken)? else {
            return Ok(None);
        };
        if let Some(queue) = self.reads.get_mut(&endpoint) {
            queue.pop_front();
        }
        Ok(Some(self.judge(answer)?.data))
    }

    fn cancel_reads(&mut self, endpoint: u8) -> Result<(), LinkError> {
        let tickets = self.reads.remove(&endpoint).unwrap_or_default();
        // Youngest first: none may take what another was to read.
        for &ticket in tickets.iter().rev() {
            self.client.cancel(ticket).map_err(broken)?;
        }
        for ticket in tickets {
            self.client.wait(ticket, CONTROL_PATIENCE).map_err(broken)?;
        }
        Ok(())
    }

    fn wait_for_return(&mut self, patience: Duration) -> Result<(), LinkError> {
        match self.client.wait_for_device(self.arrivals, patience) {
            Ok(_) => self.meet(),
            Err(ClientError::NoDevice(seconds)) => Err(LinkError::NotBack(seconds)),
            Err(error) => Err(broken(error)),
        }
    }
}

fn broken(error: ClientError) -> LinkError {
    match error {
        ClientError::Closed | ClientError::Gone => LinkError::Gone,
        other => LinkError::Other(other.to_string()),
    }
}

fn resolve(place: &str) -> Result<SocketAddr, LinkError> {
    place
        .to_socket_addrs()
        .ok()
        .and_then(|mut found| found.next())
        .ok_or_else(|| LinkError::Other(format!("{place} is no HOST:PORT that can be found")))
}
