//! A host controller: many transfers at once, shared out over the frames of the bus, for front ends
//! that pass on what a real host wants. [`Host`](crate::host::Host) is the simple one, a transfer at
//! a time.

use crate::frames::Frames;
use crate::host::{CONTROL_GAP, Link};
use crate::{InReply, OutReply, PACKET_MAX, Speed};
use serde::{Deserialize, Serialize};
use sim::{MS, Ps, US};
use std::collections::VecDeque;

/// A pipe that got NAK is left alone for this time.
const NAK_BACKOFF: Ps = 10 * US;
/// A bus reset, and the recovery after it.
const RESET_TIME: Ps = 10 * MS;
const RECOVERY_TIME: Ps = 10 * MS;
/// Packet size of EP0.
const CONTROL_PACKET: usize = 64;

/// How a transfer ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// All of it, or less because the device sent a short packet.
    Done,
    /// STALL.
    Stall,
    /// No such endpoint, or a packet out of turn.
    Error,
    /// The device sent more than was asked for.
    Babble,
    /// [`Bus::cancel`], a reset, or the device has gone.
    Cancelled,
}

/// A transfer that is over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Completion {
    /// The number it was submitted with.
    pub id: u64,
    /// How it ended.
    pub status: Status,
    /// What was read.
    pub data: Vec<u8>,
    /// Bytes moved in the data stage, either way.
    pub length: usize,
    /// What was asked for.
    pub job: Job,
}

/// What a transfer does.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Job {
    /// Control read: SETUP packet, whose length field counts.
    ControlIn([u8; 8]),
    /// Control write or no data stage: SETUP packet and data.
    ControlOut([u8; 8], Vec<u8>),
    /// Read up to `length` bytes from endpoint `number` in packets of `packet`.
    In {
        /// Endpoint number, 1..=15.
        number: u8,
        /// Bytes wanted.
        length: usize,
        /// Its wMaxPacketSize.
        packet: usize,
    },
    /// Write to endpoint `number` in packets of `packet`; no data is one packet without data.
    Out {
        /// Endpoint number, 1..=15.
        number: u8,
        /// What to write.
        data: Vec<u8>,
        /// Its wMaxPacketSize.
        packet: usize,
    },
}

impl Job {
    /// 0: control; 1..=15: OUT; 17..=31: IN.
    fn pipe(&self) -> usize {
        match self {
            Self::ControlIn(_) | Self::ControlOut(..) => 0,
            Self::In { number, .. } => 16 + usize::from(number & 0x0F),
            Self::Out { number, .. } => usize::from(number & 0x0F),
        }
    }
}

/// Where a control transfer stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Stage {
    Setup,
    Data,
    Status,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Transfer {
    id: u64,
    job: Job,
    stage: Stage,
    /// Bytes moved.
    done: usize,
    data: Vec<u8>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Pipe {
    number: usize,
    queue: VecDeque<Transfer>,
    /// Not before this time.
    rest_until: Ps,
}

/// What one transaction came to.
enum Step {
    Moved,
    Nak,
    End(Status),
}

/// The controller.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Bus {
    frames: Frames,
    pipes: Vec<Pipe>,
    /// Data toggle expected next, by pipe.
    toggles: u32,
    /// The pipe that is served next.
    turn: usize,
    high_speed: bool,
}

impl Default for Bus {
    fn default() -> Self {
        Self::new(true)
    }
}

impl Bus {
    /// A controller that grants high speed or not.
    #[must_use]
    pub fn new(high_speed: bool) -> Self {
        Self { frames: Frames::new(), pipes: Vec::new(), toggles: 0, turn: 0, high_speed }
    }

    /// The speed since the last reset.
    #[must_use]
    pub fn speed(&self) -> Speed {
        self.frames.speed
    }

    /// Whether any transfer is under way.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.pipes.iter().any(|pipe| !pipe.queue.is_empty())
    }

    /// Bytes that wait to be written, or have been read by transfers that are not over.
    #[must_use]
    pub fn backlog(&self) -> usize {
        let bytes = |transfer: &Transfer| match &transfer.job {
            Job::Out { data, .. } | Job::ControlOut(_, data) => data.len(),
            Job::In { .. } | Job::ControlIn(_) => transfer.data.len(),
        };
        self.pipes.iter().flat_map(|pipe| &pipe.queue).map(bytes).sum()
    }

    /// Resets the device: all transfers end as cancelled, toggles start afresh.
    pub fn reset(&mut self, link: &mut impl Link) -> Vec<Completion> {
        let cancelled = self.cancel_all();
        link.fx2().usb_reset();
        let until = link.fx2().now() + RESET_TIME;
        link.run_until(until);
        let high = self.high_speed && link.fx2().usb_wants_high_speed();
        let speed = if high { Speed::High } else { Speed::Full };
        link.fx2().usb_reset_done(speed);
        self.frames.restart(link.fx2().now(), speed);
        self.toggles = 0;
        let until = link.fx2().now() + RECOVERY_TIME;
        link.run_until(until);
        cancelled
    }

    /// The toggles of all pipes but control start at DATA0 again, as after SET_CONFIGURATION.
    pub fn clear_toggles(&mut self) {
        self.toggles = 0;
    }

    /// The toggle of endpoint `address` (bit 7 = IN) starts at DATA0 again, as after CLEAR_FEATURE.
    pub fn clear_toggle(&mut self, address: u8) {
        self.toggles &= !(1 << (usize::from(address & 0x0F) | usize::from(address >> 7) << 4));
    }

    /// Queues a transfer. Transfers of one pipe run in order.
    pub fn submit(&mut self, id: u64, job: Job) {
        self.resume(id, job, 0, Vec::new());
    }

    /// Queues a bulk transfer of which `done` bytes have been moved before; `data` is what was read.
    pub fn resume(&mut self, id: u64, job: Job, done: usize, data: Vec<u8>) {
        let number = job.pipe();
        let transfer = Transfer { id, job, stage: Stage::Setup, done, data };
        match self.pipes.iter_mut().find(|pipe| pipe.number == number) {
            Some(pipe) => pipe.queue.push_back(transfer),
            None => {
                let queue = VecDeque::from([transfer]);
                self.pipes.push(Pipe { number, queue, rest_until: 0 });
            }
        }
    }

    /// Whether transfers of that endpoint (bit 7 = IN) are under way.
    #[must_use]
    pub fn is_endpoint_busy(&self, address: u8) -> bool {
        let number = usize::from(address & 0x0F) | usize::from(address >> 7) << 4;
        self.pipes.iter().any(|pipe| pipe.number == number && !pipe.queue.is_empty())
    }

    /// Takes a transfer back; what it has moved so far stays moved. `None` if it is over already.
    pub fn cancel(&mut self, id: u64) -> Option<Completion> {
        for pipe in &mut self.pipes {
            if let Some(at) = pipe.queue.iter().position(|transfer| transfer.id == id) {
                return pipe.queue.remove(at).map(|transfer| transfer.complete(Status::Cancelled));
            }
        }
        None
    }

    /// Takes everything back.
    pub fn cancel_all(&mut self) -> Vec<Completion> {
        let all = self.pipes.drain(..).flat_map(|pipe| pipe.queue);
        all.map(|transfer| transfer.complete(Status::Cancelled)).collect()
    }

    /// Runs the bus and the chip until `until`; returns what was completed.
    pub fn run_until(&mut self, link: &mut impl Link, until: Ps) -> Vec<Completion> {
        let mut completed = Vec::new();
        loop {
            let now = link.fx2().now();
            if now >= until {
                return completed;
            }
            match self.next_pipe(now) {
                Ok(index) => completed.extend(self.transact(link, index)),
                Err(wake) => link.run_until(wake.min(until)),
            }
        }
    }

    /// The next pipe in turn that may go, or the time when one may.
    fn next_pipe(&mut self, now: Ps) -> Result<usize, Ps> {
        let count = self.pipes.len();
        let mut wake = Ps::MAX;
        for offset in 0..count {
            let index = (self.turn + offset) % count;
            let pipe = &self.pipes[index];
            if pipe.queue.is_empty() {
                continue;
            }
            if pipe.rest_until <= now {
                self.turn = index + 1;
                return Ok(index);
            }
            wake = wake.min(pipe.rest_until);
        }
        Err(wake)
    }

    /// One transaction of the first transfer of a pipe.
    fn transact(&mut self, link: &mut impl Link, index: usize) -> Option<Completion> {
        let number = self.pipes[index].number;
        let toggle = &mut self.toggles;
        let transfer = self.pipes[index].queue.front_mut()?;
        let before = transfer.done;
        let step = transfer.step(link, number, toggle);
        let length = transfer.done - before;
        let end = self.frames.place(link.fx2().now(), length);
        link.run_until(end);
        let pipe = &mut self.pipes[index];
        let status = match step {
            Step::Nak => {
                pipe.rest_until = end + NAK_BACKOFF;
                return None;
            }
            Step::Moved => return None,
            Step::End(status) => status,
        };
        if number == 0 {
            pipe.rest_until = end + CONTROL_GAP;
        }
        pipe.queue.pop_front().map(|transfer| transfer.complete(status))
    }
}

impl Transfer {
    fn complete(self, status: Status) -> Completion {
        Completion { id: self.id, status, data: self.data, length: self.done, job: self.job }
    }

    fn step(&mut self, link: &mut impl Link, pipe: usize, toggles: &mut u32) -> Step {
        match self.job {
            Job::ControlIn(setup) | Job::ControlOut(setup, _) => self.control(link, setup),
            Job::In { number, length, packet } => {
                self.read(link, number, length, packet, pipe, toggles)
            }
            Job::Out { number, packet, .. } => self.write(link, number, packet, pipe, toggles),
        }
    }

    fn control(&mut self, link: &mut impl Link, setup: [u8; 8]) -> Step {
        let wanted = usize::from(u16::from_le_bytes([setup[6], setup[7]]));
        let reads = matches!(self.job, Job::ControlIn(_));
        match self.stage {
            Stage::Setup => {
                link.fx2().usb_setup(setup);
                self.stage = if wanted > 0 { Stage::Data } else { Stage::Status };
                Step::Moved
            }
            Stage::Data if reads => self.control_data_in(link, wanted),
            Stage::Data => self.control_data_out(link),
            Stage::Status if reads && wanted > 0 => match link.fx2().usb_out(0, true, &[]) {
                OutReply::Ack => Step::End(Status::Done),
                OutReply::Nak => Step::Nak,
                OutReply::Stall => Step::End(Status::Stall),
                OutReply::NoResponse => Step::End(Status::Error),
            },
            Stage::Status => match link.fx2().usb_in(0, &mut [0; PACKET_MAX]) {
                InReply::Data { length: 0, .. } => Step::End(Status::Done),
                InReply::Nak => Step::Nak,
                InReply::Stall => Step::End(Status::Stall),
                InReply::Data { .. } | InReply::NoResponse => Step::End(Status::Error),
            },
        }
    }

    fn control_data_in(&mut self, link: &mut impl Link, wanted: usize) -> Step {
        let mut packet = [0; PACKET_MAX];
        match link.fx2().usb_in(0, &mut packet) {
            InReply::Data { length, .. } if self.done + length > wanted => {
                Step::End(Status::Babble)
            }
            InReply::Data { length, .. } => {
                self.data.extend_from_slice(&packet[..length]);
                self.done += length;
                if length < CONTROL_PACKET || self.done == wanted {
                    self.stage = Stage::Status;
                }
                Step::Moved
            }
            InReply::Nak => Step::Nak,
            InReply::Stall => Step::End(Status::Stall),
            InReply::NoResponse => Step::End(Status::Error),
        }
    }

    fn control_data_out(&mut self, link: &mut impl Link) -> Step {
        let Job::ControlOut(_, data) = &self.job else { return Step::End(Status::Error) };
        let end = data.len().min(self.done + CONTROL_PACKET);
        let toggle = (self.done / CONTROL_PACKET).is_multiple_of(2);
        match link.fx2().usb_out(0, toggle, &data[self.done..end]) {
            OutReply::Ack => {
                self.done = end;
                if end == data.len() {
                    self.stage = Stage::Status;
                }
                Step::Moved
            }
            OutReply::Nak => Step::Nak,
            OutReply::Stall => Step::End(Status::Stall),
            OutReply::NoResponse => Step::End(Status::Error),
        }
    }

    fn read(
        &mut self,
        link: &mut impl Link,
        number: u8,
        wanted: usize,
        packet: usize,
        pipe: usize,
        toggles: &mut u32,
    ) -> Step {
        let mut buffer = [0; PACKET_MAX];
        match link.fx2().usb_in(number, &mut buffer) {
            InReply::Data { length, .. } if length > packet || self.done + length > wanted => {
                Step::End(Status::Babble)
            }
            InReply::Data { toggle, .. } if toggle != (*toggles >> pipe & 1 != 0) => {
                Step::End(Status::Error)
            }
            InReply::Data { length, .. } => {
                *toggles ^= 1 << pipe;
                self.data.extend_from_slice(&buffer[..length]);
                self.done += length;
                if length < packet || self.done == wanted {
                    Step::End(Status::Done)
                } else {
                    Step::Moved
                }
            }
            InReply::Nak => Step::Nak,
            InReply::Stall => Step::End(Status::Stall),
            InReply::NoResponse => Step::End(Status::Error),
        }
    }

    fn write(
        &mut self,
        link: &mut impl Link,
        number: u8,
        packet: usize,
        pipe: usize,
        toggles: &mut u32,
    ) -> Step {
        let Job::Out { data, .. } = &self.job else { return Step::End(Status::Error) };
        let end = data.len().min(self.done + packet.max(1));
        let toggle = *toggles >> pipe & 1 != 0;
        match link.fx2().usb_out(number, toggle, &data[self.done..end]) {
            OutReply::Ack => {
                *toggles ^= 1 << pipe;
                self.done = end;
                if end == data.len() { Step::End(Status::Done) } else { Step::Moved }
            }
            OutReply::Nak => Step::Nak,
            OutReply::Stall => Step::End(Status::Stall),
            OutReply::NoResponse => Step::End(Status::Error),
        }
    }
}
