//! What has moved for bulk transfers that the peer then took back.
//!
//! A guest that cancels one transfer makes QEMU take back all of that endpoint, and submit the others
//! anew when the endpoint goes on. usbredir cannot say how far a cancelled transfer had come, and an
//! answer that crosses its cancellation on the way is thrown away. So what was read is kept for the
//! next transfer, and a write that comes again goes on where it was; else data would be lost or
//! doubled where a host controller loses and doubles none.

use fx2::bus::{Completion, Job};
use std::collections::{BTreeMap, VecDeque};

/// Answers that the peer may not have seen yet: so many, and so many bytes.
const ANSWERED_MAX: usize = 64;
const ANSWERED_BYTES_MAX: usize = 8 << 20;

/// A transfer that was answered.
#[derive(Clone, Debug)]
struct Answered {
    packet: u64,
    endpoint: u8,
    completion: Completion,
}

/// Bytes read, and whether a short packet was the last of them.
#[derive(Clone, Debug)]
struct Read {
    order: u64,
    data: Vec<u8>,
    ended: bool,
}

/// What was to be written, and how much of it was.
#[derive(Clone, Debug)]
struct Write {
    order: u64,
    packet: u64,
    data: Vec<u8>,
    done: usize,
}

/// Everything kept, by endpoint address.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kept {
    answered: VecDeque<Answered>,
    answered_bytes: usize,
    reads: BTreeMap<u8, VecDeque<Read>>,
    writes: BTreeMap<u8, VecDeque<Write>>,
}

/// The bytes that a transfer holds.
fn size(completion: &Completion) -> usize {
    match &completion.job {
        Job::Out { data, .. } => data.len(),
        _ => completion.data.len(),
    }
}

impl Kept {
    /// Bulk packet `packet` has been answered.
    pub(crate) fn answered(&mut self, packet: u64, endpoint: u8, completion: Completion) {
        self.answered_bytes += size(&completion);
        self.answered.push_back(Answered { packet, endpoint, completion });
        while self.answered.len() > ANSWERED_MAX || self.answered_bytes > ANSWERED_BYTES_MAX {
            let Some(oldest) = self.answered.pop_front() else { break };
            self.answered_bytes -= size(&oldest.completion);
        }
    }

    /// The peer takes bulk packet `packet` back, although it has been answered.
    pub(crate) fn recall(&mut self, packet: u64) {
        let Some(at) = self.answered.iter().position(|answered| answered.packet == packet) else {
            return;
        };
        if let Some(answered) = self.answered.remove(at) {
            self.answered_bytes -= size(&answered.completion);
            self.taken_back(packet, answered.endpoint, answered.completion, true);
        }
    }

    /// Bulk packet `packet` was taken back; `over` = it had come to its end.
    pub(crate) fn taken_back(
        &mut self,
        packet: u64,
        endpoint: u8,
        completion: Completion,
        over: bool,
    ) {
        let order = completion.id;
        match completion.job {
            Job::In { length, .. } if over || completion.length > 0 => {
                let ended = over && completion.length < length;
                let reads = self.reads.entry(endpoint).or_default();
                let at = reads.partition_point(|read| read.order < order);
                reads.insert(at, Read { order, data: completion.data, ended });
            }
            Job::Out { data, .. } if over || completion.length > 0 => {
                let writes = self.writes.entry(endpoint).or_default();
                let at = writes.partition_point(|write| write.order < order);
                writes.insert(at, Write { order, packet, data, done: completion.length });
            }
            _ => {}
        }
    }

    /// Bytes for a read of `length`, and whether they are all that it gets.
    pub(crate) fn read(&mut self, endpoint: u8, length: usize) -> (Vec<u8>, bool) {
        let mut out = Vec::new();
        let Some(reads) = self.reads.get_mut(&endpoint) else { return (out, false) };
        while let Some(front) = reads.front_mut() {
            let count = front.data.len().min(length - out.len());
            out.extend(front.data.drain(..count));
            if !front.data.is_empty() {
                break;
            }
            let ended = front.ended;
            reads.pop_front();
            if ended {
                return (out, true);
            }
        }
        let full = length > 0 && out.len() == length;
        (out, full)
    }

    /// How much of `data` was written before, if this is a write that comes again; `None` if not.
    /// QEMU names a packet after its place in the guest's memory: one that comes again has its number,
    /// the same data sent once more have another.
    pub(crate) fn written(&mut self, packet: u64, endpoint: u8, data: &[u8]) -> Option<usize> {
        let front = self.writes.get_mut(&endpoint)?.pop_front()?;
        if front.packet == packet && front.data == data {
            return Some(front.done);
        }
        self.writes.remove(&endpoint);
        None
    }

    /// What was taken back of that endpoint will not come again.
    pub(crate) fn forget_taken(&mut self, endpoint: u8) {
        self.reads.remove(&endpoint);
        self.writes.remove(&endpoint);
    }

    /// The endpoint starts afresh.
    pub(crate) fn forget(&mut self, endpoint: u8) {
        self.forget_taken(endpoint);
        self.answered.retain(|answered| answered.endpoint != endpoint);
        self.answered_bytes = self.answered.iter().map(|a| size(&a.completion)).sum();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fx2::bus::Status;

    fn read(id: u64, length: usize, data: &[u8]) -> Completion {
        let job = Job::In { number: 6, length, packet: 4 };
        Completion { id, status: Status::Done, data: data.to_vec(), length: data.len(), job }
    }

    fn write(id: u64, data: &[u8], done: usize) -> Completion {
        let job = Job::Out { number: 2, data: data.to_vec(), packet: 4 };
        Completion { id, status: Status::Done, data: Vec::new(), length: done, job }
    }

    #[test]
    fn reads_come_again_in_their_order_whatever_the_order_of_cancelling() {
        let mut kept = Kept::default();
        kept.answered(70, 0x86, read(1, 8, b"abcdefgh"));
        kept.taken_back(71, 0x86, read(2, 8, b"ijkl"), false);
        kept.recall(70);
        assert_eq!(kept.read(0x86, 8), (b"abcdefgh".to_vec(), true));
        assert_eq!(kept.read(0x86, 8), (b"ijkl".to_vec(), false));
        assert_eq!(kept.read(0x86, 8), (vec![], false));
    }

    #[test]
    fn a_short_packet_still_ends_its_transfer() {
        let mut kept = Kept::default();
        kept.taken_back(70, 0x86, read(1, 8, b"abcde"), true);
        kept.taken_back(71, 0x86, read(2, 8, b"fghi"), false);
        assert_eq!(kept.read(0x86, 8), (b"abcde".to_vec(), true));
        assert_eq!(kept.read(0x86, 2), (b"fg".to_vec(), true));
    }

    #[test]
    fn a_write_that_comes_again_goes_on_and_another_one_does_not() {
        let mut kept = Kept::default();
        kept.taken_back(70, 2, write(1, b"abcdefgh", 4), false);
        assert_eq!(kept.written(70, 2, b"abcdefgh"), Some(4));
        assert_eq!(kept.written(70, 2, b"abcdefgh"), None);
        kept.taken_back(70, 2, write(2, b"abcdefgh", 4), false);
        kept.taken_back(71, 2, write(3, b"ijkl", 4), true);
        assert_eq!(kept.written(72, 2, b"abcdefgh"), None, "the same data in another packet");
        assert_eq!(kept.written(71, 2, b"ijkl"), None, "what followed is not believed either");
    }

    #[test]
    fn what_is_kept_has_a_limit_and_an_end() {
        let mut kept = Kept::default();
        for packet in 0..200 {
            kept.answered(packet, 0x86, read(packet, 4, b"abcd"));
        }
        assert_eq!(kept.answered.len(), ANSWERED_MAX);
        kept.recall(199);
        kept.forget(0x86);
        assert_eq!(kept.read(0x86, 4), (vec![], false));
        assert_eq!(kept.answered_bytes, 0);
    }
}
