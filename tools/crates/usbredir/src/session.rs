//! One peer's session: its requests become transfers on the emulated bus, and the device's comings
//! and goings become packets to the peer. Knows neither sockets nor clocks.

use crate::isochronous::Streams;
use crate::kept::Kept;
use crate::protocol::{
    Control, ENDPOINTS, Endpoint, Interface, ProtocolError, Reader, Request, Status, Writer,
};
use fx2::Speed;
use fx2::bus::{self, Bus, Completion, Job};
use fx2::host::Link;
use sim::{MS, Ps};
use std::collections::BTreeMap;
use thiserror::Error;

/// A device must have been attached this long before it is told of (USB 2.0, 7.1.7.3).
const DEBOUNCE_TIME: Ps = 100 * MS;
/// A device that does not enumerate is tried again after this time.
const RETRY_TIME: Ps = 1000 * MS;
/// Time for one of the transfers that the session makes itself.
const CONTROL_BUDGET: Ps = 1000 * MS;
/// Transfers that a peer may have under way; no real host comes near.
const TRANSFERS_MAX: usize = 4096;
/// Where the session's own transfer numbers begin; the peer's are counted from 0.
const OWN_IDS: u64 = 1 << 63;

const IN: u8 = 0x80;
/// bmAttributes of an endpoint.
const ISOCHRONOUS: u8 = 1;
const GET_DESCRIPTOR: u8 = 6;
const DEVICE: u8 = 1;
const CONFIGURATION: u8 = 2;

/// Why a session ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SessionError {
    /// The peer does not speak usbredir.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    /// Too much at once.
    #[error("the peer has more than {TRANSFERS_MAX} transfers under way")]
    TooMany,
}

/// Something worth telling the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The peer sees this device now.
    Connected {
        /// idVendor.
        vendor: u16,
        /// idProduct.
        product: u16,
        /// Bus speed.
        speed: Speed,
    },
    /// The device has left the bus.
    Disconnected,
    /// It is attached, but does not answer as USB wants.
    Silent,
}

/// What becomes of a transfer's completion.
#[derive(Clone, Copy, Debug)]
enum Reply {
    Control(u64, Control),
    Bulk(u64, u8),
    InterruptOut(u64, u8),
    /// A poll that goes on.
    InterruptIn(u8),
}

/// How far the device is known to the peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Presence {
    /// Not on the bus, or not long enough: attached since.
    Away(Option<Ps>),
    /// The peer has been told.
    Present,
    /// The peer has been told that it went, and has not acknowledged that.
    Leaving,
}

/// The session.
#[derive(Clone, Debug)]
pub struct Session {
    bus: Bus,
    reader: Reader,
    writer: Writer,
    presence: Presence,
    /// Descriptors as read at connection.
    configurations: Vec<Vec<u8>>,
    configuration: u8,
    alternates: BTreeMap<u8, u8>,
    pending: BTreeMap<u64, Reply>,
    kept: Kept,
    next_id: u64,
    /// Endpoints that are polled, with the number of the next packet.
    polled: BTreeMap<u8, u64>,
    streams: Streams,
    events: Vec<Event>,
}

impl Session {
    /// A peer has connected. `high_speed` = the bus grants it.
    #[must_use]
    pub fn new(high_speed: bool) -> Self {
        let mut writer = Writer::default();
        writer.hello("stereosot");
        Self {
            bus: Bus::new(high_speed),
            reader: Reader::default(),
            writer,
            presence: Presence::Away(None),
            configurations: Vec::new(),
            configuration: 0,
            alternates: BTreeMap::new(),
            pending: BTreeMap::new(),
            kept: Kept::default(),
            next_id: 0,
            polled: BTreeMap::new(),
            streams: Streams::default(),
            events: Vec::new(),
        }
    }

    /// Bytes from the peer.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.reader.push(bytes);
    }

    /// Bytes for the peer; the caller takes away what it could send.
    pub fn outgoing(&mut self) -> &mut Vec<u8> {
        &mut self.writer.bytes
    }

    /// Whether the peer has said hello.
    #[must_use]
    pub fn is_greeted(&self) -> bool {
        self.reader.greeted()
    }

    /// Bytes of the peer that wait for the device.
    #[must_use]
    pub fn backlog(&self) -> usize {
        self.bus.backlog()
    }

    /// Whether transfers wait for the device.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.bus.is_busy() || !self.streams.is_empty()
    }

    /// What has happened since the last call.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Answers what has come, and runs bus and device until `until`.
    ///
    /// # Errors
    /// If the peer does not follow the protocol; the session is over then.
    pub fn run_until(&mut self, link: &mut impl Link, until: Ps) -> Result<(), SessionError> {
        while let Some((id, request)) = self.reader.take()? {
            self.writer.shared = self.reader.shared();
            if self.pending.len() > TRANSFERS_MAX {
                return Err(SessionError::TooMany);
            }
            self.handle(link, id, request);
        }
        if self.reader.greeted() {
            self.watch(link);
        }
        while link.fx2().now() < until {
            let completed = self.bus.run_until(link, until.min(self.streams.due()));
            self.complete(completed);
            self.streams.serve(link, &mut self.writer);
        }
        Ok(())
    }

    /// The session ends: nothing stays on the bus, and the device sees its host go.
    pub fn close(&mut self, link: &mut impl Link) {
        self.bus.cancel_all();
        self.streams.stop_all();
        link.fx2().usb_unplugged();
    }

    fn handle(&mut self, link: &mut impl Link, id: u64, request: Request) {
        if let Request::DisconnectAck = request {
            if self.presence == Presence::Leaving {
                self.presence = Presence::Away(None);
            }
            return;
        }
        let present = self.presence == Presence::Present;
        match request {
            Request::Hello(_) | Request::DisconnectAck | Request::Other(_) => {}
            Request::Reset if present => self.reset(link),
            Request::Reset => {}
            Request::SetConfiguration(value) => {
                let ok = present && self.set_configuration(link, value);
                self.writer.configuration_status(id, verdict(ok), self.configuration);
            }
            Request::GetConfiguration => {
                self.writer.configuration_status(id, verdict(present), self.configuration);
            }
            Request::SetAlternate(interface, alternate) => {
                let ok = present && self.set_alternate(link, interface, alternate);
                self.writer.alternate_status(id, verdict(ok), interface, alternate);
            }
            Request::GetAlternate(interface) => {
                let alternate = self.alternates.get(&interface).copied().unwrap_or(0);
                self.writer.alternate_status(id, verdict(present), interface, alternate);
            }
            Request::StartIso(endpoint) => {
                let ok = self.start_stream(link.fx2().now(), endpoint);
                self.writer.iso_status(id, verdict(ok), endpoint);
            }
            Request::StopIso(endpoint) => {
                self.streams.stop(endpoint);
                self.writer.iso_status(id, Status::Success, endpoint);
            }
            Request::Iso(endpoint, data) => self.streams.push(endpoint, data),
            Request::StartInterrupt(endpoint) => self.start_polling(id, endpoint),
            Request::StopInterrupt(endpoint) => {
                self.stop_polling(endpoint);
                self.writer.interrupt_status(id, Status::Success, endpoint);
            }
            Request::Cancel => self.cancel(id),
            Request::Control(control, data) => self.control(id, control, data),
            Request::Bulk(endpoint, length, data) => self.bulk(id, endpoint, length, data),
            Request::Interrupt(endpoint, data) => self.interrupt_out(id, endpoint, data),
        }
    }
}

/// Transfers of the peer.
impl Session {
    fn submit(&mut self, job: Job, reply: Reply) {
        let number = self.next_id;
        self.next_id += 1;
        self.pending.insert(number, reply);
        self.bus.submit(number, job);
    }

    /// The packet size of an endpoint in the present settings.
    fn packet_size(&self, address: u8) -> Option<usize> {
        let endpoint = self.endpoints()[slot(address)]?;
        (endpoint.kind != 0).then_some(usize::from(endpoint.max_packet & 0x7FF).max(1))
    }

    fn control(&mut self, id: u64, control: Control, data: Vec<u8>) {
        if self.presence != Presence::Present || control.endpoint & 0x0F != 0 {
            let control = Control { length: 0, ..control };
            return self.writer.control(id, control, Status::IoError, &[]);
        }
        let setup = setup(control);
        let job = if control.endpoint & IN != 0 {
            Job::ControlIn(setup)
        } else {
            Job::ControlOut(setup, data)
        };
        self.submit(job, Reply::Control(id, control));
    }

    fn bulk(&mut self, id: u64, endpoint: u8, length: usize, data: Vec<u8>) {
        let size = self.packet_size(endpoint).filter(|_| self.presence == Presence::Present);
        let Some(packet) = size else {
            return self.writer.bulk(id, endpoint, Status::IoError, 0, &[]);
        };
        // Kept data belong before what is under way; once others have overtaken them, they are lost.
        if self.bus.is_endpoint_busy(endpoint) {
            self.kept.forget_taken(endpoint);
        }
        let number = endpoint & 0x0F;
        let reply = Reply::Bulk(id, endpoint);
        if endpoint & IN != 0 {
            let (data, over) = self.kept.read(endpoint, length);
            let job = Job::In { number, length, packet };
            self.go_on(reply, job, data.len(), data, over);
        } else {
            let done = self.kept.written(id, endpoint, &data);
            let over = done == Some(data.len());
            let job = Job::Out { number, data, packet };
            self.go_on(reply, job, done.unwrap_or(0), Vec::new(), over);
        }
    }

    /// Submits a transfer of which `done` bytes have been moved before, or answers it if that was all.
    fn go_on(&mut self, reply: Reply, job: Job, done: usize, data: Vec<u8>, over: bool) {
        let id = self.next_id;
        self.next_id += 1;
        if over {
            let completion = Completion { id, status: bus::Status::Done, data, length: done, job };
            return self.answer(reply, completion);
        }
        self.pending.insert(id, reply);
        self.bus.resume(id, job, done, data);
    }

    fn interrupt_out(&mut self, id: u64, endpoint: u8, data: Vec<u8>) {
        let size = self.packet_size(endpoint).filter(|_| self.presence == Presence::Present);
        let Some(packet) = size else {
            return self.writer.interrupt(id, endpoint, Status::IoError, 0, &[]);
        };
        let job = Job::Out { number: endpoint & 0x0F, data, packet };
        self.submit(job, Reply::InterruptOut(id, endpoint));
    }

    /// Whether that is an isochronous endpoint of the present settings.
    fn start_stream(&mut self, now: Ps, address: u8) -> bool {
        let found = self.endpoints()[slot(address)];
        let Some(endpoint) = found.filter(|endpoint| endpoint.kind == ISOCHRONOUS) else {
            return false;
        };
        let ok = self.presence == Presence::Present;
        if ok {
            self.streams.start(address, endpoint, self.bus.speed(), now);
        }
        ok
    }

    fn start_polling(&mut self, id: u64, endpoint: u8) {
        let ok = self.presence == Presence::Present
            && endpoint & IN != 0
            && self.packet_size(endpoint).is_some();
        if ok && !self.polled.contains_key(&endpoint) {
            self.polled.insert(endpoint, 0);
            self.poll(endpoint);
        }
        self.writer.interrupt_status(id, verdict(ok), endpoint);
    }

    fn poll(&mut self, endpoint: u8) {
        if let Some(packet) = self.packet_size(endpoint) {
            let job = Job::In { number: endpoint & 0x0F, length: packet, packet };
            self.submit(job, Reply::InterruptIn(endpoint));
        }
    }

    fn stop_polling(&mut self, endpoint: u8) {
        self.polled.remove(&endpoint);
        let polls =
            |reply: &Reply| matches!(reply, Reply::InterruptIn(address) if *address == endpoint);
        let number = self.pending.iter().find(|(_, reply)| polls(reply)).map(|(number, _)| *number);
        if let Some(number) = number {
            self.pending.remove(&number);
            self.bus.cancel(number);
        }
    }

    /// The peer takes packet `id` back. If it is not over, it is answered as cancelled.
    fn cancel(&mut self, id: u64) {
        let number = self.pending.iter().find_map(|(number, reply)| match reply {
            Reply::Control(n, _) | Reply::Bulk(n, _) | Reply::InterruptOut(n, _) if *n == id => {
                Some(*number)
            }
            _ => None,
        });
        match number.and_then(|number| self.bus.cancel(number)) {
            Some(completion) => self.complete(vec![completion]),
            None => self.kept.recall(id),
        }
    }

    fn complete(&mut self, completed: Vec<Completion>) {
        for completion in completed {
            if let Some(reply) = self.pending.remove(&completion.id) {
                self.answer(reply, completion);
            }
        }
    }

    fn answer(&mut self, reply: Reply, done: Completion) {
        let status = match done.status {
            bus::Status::Done => Status::Success,
            bus::Status::Stall => Status::Stall,
            bus::Status::Error => Status::IoError,
            bus::Status::Babble => Status::Babble,
            bus::Status::Cancelled => Status::Cancelled,
        };
        match reply {
            Reply::Control(id, control) => {
                if status == Status::Success {
                    self.note_control(control);
                }
                let length = done.length as u16;
                self.writer.control(id, Control { length, ..control }, status, &done.data);
            }
            Reply::Bulk(id, endpoint) => {
                self.writer.bulk(id, endpoint, status, done.length, &done.data);
                match status {
                    Status::Success => self.kept.answered(id, endpoint, done),
                    Status::Cancelled => self.kept.taken_back(id, endpoint, done, false),
                    _ => {}
                }
            }
            Reply::InterruptOut(id, endpoint) => {
                self.writer.interrupt(id, endpoint, status, done.length, &[]);
            }
            Reply::InterruptIn(endpoint) => self.answer_poll(endpoint, status, &done.data),
        }
    }

    fn answer_poll(&mut self, endpoint: u8, status: Status, data: &[u8]) {
        if status == Status::Success {
            let Some(number) = self.polled.get_mut(&endpoint) else { return };
            let id = *number;
            *number += 1;
            self.writer.interrupt(id, endpoint, status, data.len(), data);
            self.poll(endpoint);
        } else if self.polled.remove(&endpoint).is_some() {
            self.writer.interrupt_status(0, status, endpoint);
        }
    }

    /// CLEAR_FEATURE(ENDPOINT_HALT) starts the toggle afresh on both sides.
    fn note_control(&mut self, control: Control) {
        if (control.request_type, control.request, control.value) == (0x02, 1, 0) {
            self.bus.clear_toggle(control.index as u8);
            self.kept.forget(control.index as u8);
        }
    }
}

/// The device's comings and goings.
impl Session {
    fn watch(&mut self, link: &mut impl Link) {
        let attached = link.fx2().usb_attached();
        let now = link.fx2().now();
        match self.presence {
            Presence::Away(_) if !attached => self.presence = Presence::Away(None),
            Presence::Away(None) => self.presence = Presence::Away(Some(now)),
            Presence::Away(Some(since)) if now >= since + DEBOUNCE_TIME => self.connect(link),
            Presence::Present if !attached => self.disconnect(link),
            _ => {}
        }
    }

    fn connect(&mut self, link: &mut impl Link) {
        self.bus.reset(link);
        let Some(device) = self.enumerate(link) else {
            // Looked at again, as if it had just been attached, after a while.
            let retry = link.fx2().now() + RETRY_TIME - DEBOUNCE_TIME;
            self.presence = Presence::Away(Some(retry));
            self.events.push(Event::Silent);
            return;
        };
        self.configuration = 0;
        self.alternates.clear();
        self.presence = Presence::Present;
        self.tell_settings();
        let word = |at: usize| u16::from_le_bytes([device[at], device[at + 1]]);
        let speed = self.bus.speed();
        let code = if speed == Speed::High { 2 } else { 1 };
        let class = [device[4], device[5], device[6]];
        self.writer.device_connect(code, class, [word(8), word(10), word(12)]);
        self.events.push(Event::Connected { vendor: word(8), product: word(10), speed });
    }

    fn disconnect(&mut self, link: &mut impl Link) {
        self.drop_transfers();
        link.fx2().usb_unplugged();
        self.writer.device_disconnect();
        let acknowledges =
            self.reader.shared() & crate::protocol::capability::DEVICE_DISCONNECT_ACK != 0;
        self.presence = if acknowledges { Presence::Leaving } else { Presence::Away(None) };
        self.events.push(Event::Disconnected);
    }

    /// Ends everything under way, with answers.
    fn drop_transfers(&mut self) {
        self.polled.clear();
        self.streams.stop_all();
        let cancelled = self.bus.cancel_all();
        self.complete(cancelled);
        self.kept = Kept::default();
    }

    /// A port reset: the device forgets its configuration, and gets its address again.
    fn reset(&mut self, link: &mut impl Link) {
        self.drop_transfers();
        self.bus.reset(link);
        self.configuration = 0;
        self.alternates.clear();
        self.set_address(link);
    }

    fn set_address(&mut self, link: &mut impl Link) -> bool {
        self.transfer(link, Job::ControlOut([0, 5, 1, 0, 0, 0, 0, 0], Vec::new())).is_some()
    }

    /// Reads the descriptors that the peer must be told of; gives the device's back.
    fn enumerate(&mut self, link: &mut impl Link) -> Option<Vec<u8>> {
        let first = self.descriptor(link, DEVICE, 0, 8)?;
        if first.len() < 8 || first[1] != DEVICE {
            return None;
        }
        self.bus.reset(link);
        if !self.set_address(link) {
            return None;
        }
        let device = self.descriptor(link, DEVICE, 0, 18)?;
        if device.len() != 18 {
            return None;
        }
        self.configurations.clear();
        for index in 0..device[17] {
            let head = self.descriptor(link, CONFIGURATION, index, 9)?;
            if head.len() < 9 || head[1] != CONFIGURATION {
                return None;
            }
            let total = u16::from_le_bytes([head[2], head[3]]);
            let whole = self.descriptor(link, CONFIGURATION, index, total)?;
            self.configurations.push(whole);
        }
        Some(device)
    }

    fn descriptor(
        &mut self,
        link: &mut impl Link,
        kind: u8,
        index: u8,
        length: u16,
    ) -> Option<Vec<u8>> {
        let [low, high] = length.to_le_bytes();
        self.transfer(link, Job::ControlIn([IN, GET_DESCRIPTOR, index, kind, 0, 0, low, high]))
    }

    fn set_configuration(&mut self, link: &mut impl Link, value: u8) -> bool {
        self.drop_transfers();
        let job = Job::ControlOut([0, 9, value, 0, 0, 0, 0, 0], Vec::new());
        if self.transfer(link, job).is_none() {
            return false;
        }
        self.bus.clear_toggles();
        self.configuration = value;
        self.alternates.clear();
        self.tell_settings();
        true
    }

    fn set_alternate(&mut self, link: &mut impl Link, interface: u8, alternate: u8) -> bool {
        let job = Job::ControlOut([1, 11, alternate, 0, interface, 0, 0, 0], Vec::new());
        if self.transfer(link, job).is_none() {
            return false;
        }
        self.alternates.insert(interface, alternate);
        for (number, endpoint) in self.endpoints().iter().enumerate() {
            if endpoint
                .is_some_and(|endpoint| endpoint.kind != 0 && endpoint.interface == interface)
            {
                let address = (number & 0x0F | (number & 0x10) << 3) as u8;
                self.bus.clear_toggle(address);
                self.kept.forget(address);
                self.streams.stop(address);
            }
        }
        self.tell_settings();
        true
    }

    /// A transfer of the session's own, waited for in simulated time.
    fn transfer(&mut self, link: &mut impl Link, job: Job) -> Option<Vec<u8>> {
        let number = OWN_IDS + self.next_id;
        self.next_id += 1;
        self.bus.submit(number, job);
        let end = link.fx2().now() + CONTROL_BUDGET;
        loop {
            let now = link.fx2().now();
            let (own, others): (Vec<_>, Vec<_>) = self
                .bus
                .run_until(link, now + MS / 10)
                .into_iter()
                .partition(|completion| completion.id == number);
            self.complete(others);
            if let Some(completion) = own.into_iter().next() {
                return (completion.status == bus::Status::Done).then_some(completion.data);
            }
            if link.fx2().now() >= end {
                self.bus.cancel(number);
                return None;
            }
        }
    }

    fn tell_settings(&mut self) {
        let interfaces: Vec<Interface> = self
            .settings()
            .filter(|descriptor| descriptor[1] == 4 && descriptor[3] == 0)
            .map(|d| Interface { number: d[2], class: [d[5], d[6], d[7]] })
            .collect();
        let endpoints = self.endpoints();
        self.writer.interface_info(&interfaces);
        self.writer.ep_info(&endpoints);
    }

    /// The descriptors of the present configuration, of the first one if none is set: each at least
    /// 9 bytes for interfaces (kind 4) and 7 for endpoints (kind 5), others left out.
    fn settings(&self) -> impl Iterator<Item = &[u8]> {
        let set = self.configurations.iter().find(|c| c.get(5) == Some(&self.configuration));
        let mut rest: &[u8] = set.or(self.configurations.first()).map_or(&[], Vec::as_slice);
        std::iter::from_fn(move || {
            loop {
                let length = usize::from(*rest.first()?);
                if length < 2 || length > rest.len() {
                    return None;
                }
                let (descriptor, behind) = rest.split_at(length);
                rest = behind;
                match descriptor[1] {
                    4 if length >= 9 => return Some(descriptor),
                    5 if length >= 7 => return Some(descriptor),
                    _ => {}
                }
            }
        })
    }

    /// The endpoints of the present alternate settings.
    fn endpoints(&self) -> [Option<Endpoint>; ENDPOINTS] {
        let mut out = [None; ENDPOINTS];
        let control = Endpoint { kind: 0, interval: 0, interface: 0, max_packet: 64 };
        out[slot(0)] = Some(control);
        out[slot(IN)] = Some(control);
        let mut active = None;
        for descriptor in self.settings() {
            if descriptor[1] == 4 {
                let (interface, alternate) = (descriptor[2], descriptor[3]);
                let chosen = self.alternates.get(&interface).copied().unwrap_or(0);
                active = (alternate == chosen).then_some(interface);
            } else if let Some(interface) = active {
                out[slot(descriptor[2])] = Some(Endpoint {
                    kind: descriptor[3] & 3,
                    interval: descriptor[6],
                    interface,
                    max_packet: u16::from_le_bytes([descriptor[4], descriptor[5]]),
                });
            }
        }
        out
    }
}

fn slot(address: u8) -> usize {
    usize::from(address & 0x0F) | usize::from(address & IN) >> 3
}

fn verdict(ok: bool) -> Status {
    if ok { Status::Success } else { Status::Invalid }
}

fn setup(control: Control) -> [u8; 8] {
    let [v0, v1] = control.value.to_le_bytes();
    let [i0, i1] = control.index.to_le_bytes();
    let [l0, l1] = control.length.to_le_bytes();
    [control.request_type, control.request, v0, v1, i0, i1, l0, l1]
}
