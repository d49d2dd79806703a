//! Isochronous streams: one service a (micro)frame or a power of two of them, whatever else is on the bus.
//! They take no time from the other transfers of the modelled bus.

use crate::protocol::{Endpoint, Status, Writer};
use fx2::host::Link;
use fx2::{InReply, PACKET_MAX, Speed};
use sim::{MS, Ps, US};
use std::collections::{BTreeMap, VecDeque};

/// Packets of an OUT stream that may wait; what comes on top is lost, as on a bus that is too slow.
const WAITING_MAX: usize = 1024;
/// Bit of an endpoint address.
const IN: u8 = 0x80;

/// One stream.
#[derive(Clone, Debug)]
struct Stream {
    /// The next service, and the time between two.
    due: Ps,
    period: Ps,
    /// Number of the next packet to the peer.
    number: u64,
    /// Bytes of a transaction, and transactions in a microframe.
    packet: usize,
    transactions: usize,
    /// What an OUT stream is to send.
    waiting: VecDeque<Vec<u8>>,
}

/// All streams, by endpoint address.
#[derive(Clone, Debug, Default)]
pub(crate) struct Streams(BTreeMap<u8, Stream>);

impl Streams {
    /// Starts the stream of `address`; one that runs goes on.
    pub(crate) fn start(&mut self, address: u8, endpoint: Endpoint, speed: Speed, now: Ps) {
        let frame = if speed == Speed::High { 125 * US } else { MS };
        self.0.entry(address).or_insert_with(|| Stream {
            due: now + frame,
            period: frame << endpoint.interval.clamp(1, 16).saturating_sub(1),
            number: 0,
            packet: usize::from(endpoint.max_packet & 0x7FF),
            transactions: usize::from(endpoint.max_packet >> 11 & 3).min(2) + 1,
            waiting: VecDeque::new(),
        });
    }

    pub(crate) fn stop(&mut self, address: u8) {
        self.0.remove(&address);
    }

    pub(crate) fn stop_all(&mut self) {
        self.0.clear();
    }

    /// Whether any runs.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// A packet for an OUT stream.
    pub(crate) fn push(&mut self, address: u8, data: Vec<u8>) {
        if let Some(stream) = self.0.get_mut(&address)
            && stream.waiting.len() < WAITING_MAX
        {
            stream.waiting.push_back(data);
        }
    }

    /// When one has to be served next.
    pub(crate) fn due(&self) -> Ps {
        self.0.values().map(|stream| stream.due).min().unwrap_or(Ps::MAX)
    }

    /// Serves those that are due.
    pub(crate) fn serve(&mut self, link: &mut impl Link, writer: &mut Writer) {
        let now = link.fx2().now();
        for (&address, stream) in &mut self.0 {
            if stream.due > now {
                continue;
            }
            // Services that the chip ran past are gone.
            stream.due += ((now - stream.due) / stream.period + 1) * stream.period;
            if address & IN != 0 {
                let (status, data) = stream.read(link, address & 0x0F);
                writer.iso(stream.number, address, status, &data);
                stream.number += 1;
            } else if let Some(data) = stream.waiting.pop_front() {
                for piece in data.chunks(stream.packet.max(1)) {
                    link.fx2().usb_out(address & 0x0F, false, piece);
                }
            }
        }
    }
}

impl Stream {
    /// The transactions of one service: each but the last is full.
    fn read(&self, link: &mut impl Link, number: u8) -> (Status, Vec<u8>) {
        let mut data = Vec::new();
        let mut buffer = [0; PACKET_MAX];
        for _ in 0..self.transactions {
            match link.fx2().usb_in(number, &mut buffer) {
                InReply::Data { length, .. } if length <= self.packet => {
                    data.extend_from_slice(&buffer[..length]);
                    if length < self.packet {
                        break;
                    }
                }
                InReply::Data { .. } => return (Status::Babble, Vec::new()),
                _ => return (Status::IoError, Vec::new()),
            }
        }
        (Status::Success, data)
    }
}
