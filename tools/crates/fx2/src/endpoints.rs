//! The large endpoints EP2, EP4, EP6 and EP8: packet buffers that pass between USB, CPU and the
//! interface side (slave FIFO or GPIF), TRM chapters 8 and 9.
//!
//! ```text
//!  OUT:  idle --arm--> usb --packet--> cpu --commit--> fifo --emptied--> usb
//!                        \---------- AUTOOUT ---------/
//!  IN:   idle --filled--> cpu (manual) --commit--> usb --sent--> idle
//!           \------------- AUTOIN / PKTEND ------/
//! ```

use crate::usb::Speed;
use serde::{Deserialize, Serialize};

/// Bits of EPxCFG.
const VALID: u8 = 0x80;
const DIR_IN: u8 = 0x40;
const SIZE_1024: u8 = 0x08;
/// Bits of EPxFIFOCFG.
const INFM1: u8 = 0x40;
const OEP1: u8 = 0x20;
const AUTOOUT: u8 = 0x10;
const AUTOIN: u8 = 0x08;
const ZEROLENIN: u8 = 0x04;
pub(crate) const WORDWIDE: u8 = 0x01;
/// SKIP in EPxBCL, INPKTEND and OUTPKTEND.
pub(crate) const SKIP: u8 = 0x80;

/// Bytes of the largest packet.
pub const PACKET_MAX: usize = 1024;
const BUFFERS_MAX: usize = 4;

/// Buffer numbers in the order in which they were handed over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Queue {
    items: [u8; BUFFERS_MAX],
    len: u8,
}

impl Queue {
    fn push(&mut self, item: u8) {
        self.items[usize::from(self.len)] = item;
        self.len += 1;
    }

    fn first(&self) -> Option<u8> {
        (self.len > 0).then_some(self.items[0])
    }

    fn last(&self) -> Option<u8> {
        self.len.checked_sub(1).map(|n| self.items[usize::from(n)])
    }

    fn pop(&mut self) -> Option<u8> {
        let item = self.first()?;
        self.items.copy_within(1.., 0);
        self.len -= 1;
        Some(item)
    }

    fn iter(&self) -> impl Iterator<Item = u8> {
        self.items[..usize::from(self.len)].iter().copied()
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Buffer {
    len: usize,
    #[serde(with = "sim::hex")]
    data: Box<[u8; PACKET_MAX]>,
}

/// What a commit by the CPU did, so that the engine can raise the right interrupts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Commit {
    Done,
    /// There was no buffer to hand over.
    Nothing,
}

/// One of EP2, EP4, EP6, EP8.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Endpoint {
    pub(crate) cfg: u8,
    pub(crate) fifocfg: u8,
    pub(crate) autoinlen: u16,
    /// EPxFIFOPFH:L.
    pub(crate) pf: u16,
    pub(crate) stall: bool,
    pub(crate) toggle: bool,
    /// EPxBCH as written last, for the EPxBCL write that uses it.
    pub(crate) count_high: u8,
    /// EP2 and EP6 can be triple and quad buffered and take 1024 bytes.
    large: bool,
    buffers: [Buffer; BUFFERS_MAX],
    usb: Queue,
    cpu: Queue,
    fifo: Queue,
    idle: Queue,
    /// Bytes moved by the interface side: of the first buffer of `fifo` (OUT) or `idle` (IN).
    position: usize,
    speed: Speed,
}

impl Endpoint {
    pub(crate) fn new(large: bool, cfg: u8) -> Self {
        let buffer = || Buffer { len: 0, data: Box::new([0; PACKET_MAX]) };
        let mut endpoint = Self {
            cfg,
            fifocfg: 0x05,
            autoinlen: 512,
            pf: 0,
            stall: false,
            toggle: false,
            count_high: 0,
            large,
            buffers: [buffer(), buffer(), buffer(), buffer()],
            usb: Queue::default(),
            cpu: Queue::default(),
            fifo: Queue::default(),
            idle: Queue::default(),
            position: 0,
            speed: Speed::Full,
        };
        endpoint.reset_fifo();
        endpoint
    }

    pub(crate) fn is_valid(&self) -> bool {
        self.cfg & VALID != 0
    }

    pub(crate) fn is_in(&self) -> bool {
        self.cfg & DIR_IN != 0
    }

    /// EPxCFG TYPE = 01.
    pub(crate) fn is_isochronous(&self) -> bool {
        self.cfg & 0x30 == 0x10
    }

    pub(crate) fn word_wide(&self) -> bool {
        self.fifocfg & WORDWIDE != 0
    }

    fn auto_out(&self) -> bool {
        self.fifocfg & AUTOOUT != 0
    }

    fn auto_in(&self) -> bool {
        self.fifocfg & AUTOIN != 0
    }

    pub(crate) fn set_speed(&mut self, speed: Speed) {
        self.speed = speed;
    }

    /// Buffers of this configuration: EP4 and EP8 always have two.
    pub(crate) fn buffer_count(&self) -> u8 {
        match self.cfg & 3 {
            0 if self.large => 4,
            3 if self.large => 3,
            _ => 2,
        }
    }

    /// Bytes a packet can have: full-speed bulk packets have 64.
    pub(crate) fn packet_size(&self) -> usize {
        let bulk = self.cfg & 0x30 == 0x20;
        if self.speed == Speed::Full && bulk { 64 } else { self.buffer_size() }
    }

    /// Bytes of the chip's 4 KiB that its buffers take.
    pub(crate) fn memory(&self) -> usize {
        if self.is_valid() { usize::from(self.buffer_count()) * self.buffer_size() } else { 0 }
    }

    fn buffer_size(&self) -> usize {
        if self.large && self.cfg & SIZE_1024 != 0 { 1024 } else { 512 }
    }

    /// EPxCFG is written: the buffers start afresh.
    pub(crate) fn configure(&mut self, cfg: u8) {
        self.cfg = cfg;
        self.reset_fifo();
    }

    /// EPxFIFOCFG is written: the rising edge of AUTOOUT arms the buffers of an OUT endpoint, unless
    /// REVCTL bit 1 leaves that to the firmware.
    pub(crate) fn configure_fifo(&mut self, fifocfg: u8, firmware_arms: bool) {
        let rises = fifocfg & AUTOOUT != 0 && !self.auto_out();
        self.fifocfg = fifocfg;
        if rises && !self.is_in() && !firmware_arms {
            while self.arm() {}
        }
    }

    /// FIFORESET: all buffers empty and in nobody's hands.
    pub(crate) fn reset_fifo(&mut self) {
        self.usb = Queue::default();
        self.cpu = Queue::default();
        self.fifo = Queue::default();
        self.idle = Queue::default();
        self.position = 0;
        for buffer in 0..self.buffer_count() {
            self.idle.push(buffer);
        }
    }

    fn arm(&mut self) -> bool {
        let armed = self.idle.pop();
        if let Some(buffer) = armed {
            self.usb.push(buffer);
        }
        armed.is_some()
    }
}

/// The USB side.
impl Endpoint {
    /// Whether the host's next OUT packet has room.
    pub(crate) fn can_receive(&self) -> bool {
        self.usb.len > 0
    }

    /// A packet from the host; `data` is not longer than [`PACKET_MAX`].
    pub(crate) fn receive(&mut self, data: &[u8]) {
        let Some(buffer) = self.usb.pop() else { return };
        let slot = &mut self.buffers[usize::from(buffer)];
        slot.data[..data.len()].copy_from_slice(data);
        slot.len = data.len();
        if self.auto_out() && self.cpu.len == 0 {
            // The interface side never sees a packet without bytes.
            if data.is_empty() { self.usb.push(buffer) } else { self.fifo.push(buffer) }
        } else {
            self.cpu.push(buffer);
        }
    }

    /// The packet that the next IN token gets.
    pub(crate) fn to_send(&self) -> Option<&[u8]> {
        let buffer = &self.buffers[usize::from(self.usb.first()?)];
        Some(&buffer.data[..buffer.len])
    }

    /// The host has acknowledged that packet.
    pub(crate) fn sent(&mut self) {
        if let Some(buffer) = self.usb.pop() {
            self.idle.push(buffer);
        }
    }
}

/// The CPU's side.
impl Endpoint {
    /// The buffer that the CPU sees at the endpoint's address.
    fn active(&self) -> u8 {
        self.cpu.first().or(self.idle.first()).or(self.fifo.last()).or(self.usb.last()).unwrap_or(0)
    }

    pub(crate) fn read(&self, offset: usize) -> u8 {
        self.buffers[usize::from(self.active())].data[offset]
    }

    pub(crate) fn write(&mut self, offset: usize, value: u8) {
        let active = usize::from(self.active());
        self.buffers[active].data[offset] = value;
    }

    /// EPxBCH:L.
    pub(crate) fn byte_count(&self) -> usize {
        if self.is_in() {
            self.position
        } else {
            self.cpu.first().map_or(0, |buffer| self.buffers[usize::from(buffer)].len)
        }
    }

    /// EPxBCL is written with `low`. IN: the active buffer becomes a packet of EPxBCH:L bytes.
    /// OUT: the packet goes on to the interface side, or with SKIP back to USB; with no packet there,
    /// an idle buffer is armed, if there is one left. A count of 0 is as good as SKIP (assumption, on
    /// which firmware of usbdux boxes relies): the interface side never sees a packet without bytes.
    pub(crate) fn commit(&mut self, low: u8) -> Commit {
        let count = usize::from(self.count_high & 0x07) << 8;
        if self.is_in() {
            return self.commit_in(count | usize::from(low));
        }
        let len = (count | usize::from(low)).min(PACKET_MAX);
        let skip = low & SKIP != 0 || len == 0;
        match self.cpu.pop() {
            Some(buffer) if skip => self.usb.push(buffer),
            Some(buffer) => {
                self.buffers[usize::from(buffer)].len = len;
                self.fifo.push(buffer);
            }
            None if skip => {
                self.arm();
            }
            None => match self.idle.pop() {
                Some(buffer) => {
                    self.buffers[usize::from(buffer)].len = len;
                    self.fifo.push(buffer);
                }
                None => return Commit::Nothing,
            },
        }
        Commit::Done
    }

    fn commit_in(&mut self, len: usize) -> Commit {
        let Some(buffer) = self.take_filled() else { return Commit::Nothing };
        self.buffers[usize::from(buffer)].len = len.min(PACKET_MAX);
        self.usb.push(buffer);
        Commit::Done
    }

    /// INPKTEND: the packet goes to USB as it is, or with `skip` is thrown away.
    pub(crate) fn end_in(&mut self, skip: bool) -> Commit {
        if !self.is_in() {
            return Commit::Nothing;
        }
        let from_fifo = self.cpu.len == 0;
        let len = self.position;
        let Some(buffer) = self.take_filled() else { return Commit::Nothing };
        if from_fifo {
            self.buffers[usize::from(buffer)].len = len;
        }
        if skip {
            self.idle.push(buffer)
        } else {
            self.usb.push(buffer)
        }
        Commit::Done
    }

    /// OUTPKTEND: the packet goes on with its own length, or with `skip` back to USB.
    pub(crate) fn end_out(&mut self, skip: bool) -> Commit {
        if self.is_in() {
            return Commit::Nothing;
        }
        match self.cpu.pop() {
            Some(buffer) if skip => self.usb.push(buffer),
            Some(buffer) => self.fifo.push(buffer),
            None if skip => {
                self.arm();
            }
            None => return Commit::Nothing,
        }
        Commit::Done
    }

    /// The oldest IN buffer that waits for the CPU, else the one being filled.
    fn take_filled(&mut self) -> Option<u8> {
        self.cpu.pop().or_else(|| {
            self.position = 0;
            self.idle.pop()
        })
    }

    /// EPxCS without the stall bit: packets in bits 6..4, FULL 3, EMPTY 2.
    pub(crate) fn status(&self) -> u8 {
        let packets = if self.is_in() { self.usb.len } else { self.cpu.len };
        packets << 4 | u8::from(self.cpu_full()) << 3 | u8::from(packets == 0) << 2
    }

    /// EP2468STAT: the CPU finds no buffer (IN), or no more packets fit (OUT).
    pub(crate) fn cpu_full(&self) -> bool {
        if self.is_in() {
            self.idle.len == 0 && self.cpu.len == 0
        } else {
            self.usb.len == 0 && self.idle.len == 0
        }
    }

    /// EP2468STAT: nothing committed (IN), nothing received (OUT).
    pub(crate) fn cpu_empty(&self) -> bool {
        if self.is_in() { self.usb.len == 0 } else { self.cpu.len == 0 }
    }
}

/// The interface side: slave FIFO and GPIF.
impl Endpoint {
    /// EPxFIFOBCH:L: bytes on this side.
    pub(crate) fn fifo_bytes(&self) -> usize {
        let queue = if self.is_in() { self.cpu } else { self.fifo };
        let total: usize = queue.iter().map(|n| self.buffers[usize::from(n)].len).sum();
        if self.is_in() { total + self.position } else { total - self.position }
    }

    /// Nothing to read (OUT), nothing filled (IN).
    pub(crate) fn fifo_empty(&self) -> bool {
        self.fifo_bytes() == 0
    }

    /// No room to write (IN), no free buffer (OUT). With INFM1 or OEP1 the flag comes a word early.
    pub(crate) fn fifo_full(&self) -> bool {
        if self.is_in() {
            let ahead = self.fifocfg & INFM1 != 0
                && self.idle.len == 1
                && self.position + self.unit() >= self.fill_limit();
            self.idle.len == 0 || ahead
        } else {
            self.usb.len == 0 && self.idle.len == 0
        }
    }

    /// The empty flag as a pin shows it.
    pub(crate) fn fifo_empty_flag(&self) -> bool {
        let early = !self.is_in() && self.fifocfg & OEP1 != 0;
        self.fifo_empty() || early && self.fifo_bytes() <= self.unit()
    }

    /// The programmable flag (TRM 15.6.8).
    pub(crate) fn programmable_flag(&self) -> bool {
        let [high, low] = self.pf.to_be_bytes();
        let (have, threshold);
        if self.is_in() && high & 0x40 == 0 {
            // Packets committed, then bytes of the current one.
            let bytes = usize::from(high & 3) << 8 | usize::from(low);
            threshold = usize::from(high >> 3 & 7) * 4096 + bytes;
            have = usize::from(self.usb.len) * 4096 + self.position;
        } else if self.is_in() {
            threshold = usize::from(high & 3) << 8 | usize::from(low);
            have = self.position;
        } else {
            let upper = usize::from(high >> 3 & 7) << 10;
            threshold = upper | usize::from(high & 3) << 8 | usize::from(low);
            have = self.fifo_bytes();
        }
        if high & 0x80 != 0 { have >= threshold } else { have <= threshold }
    }

    fn unit(&self) -> usize {
        if self.word_wide() { 2 } else { 1 }
    }

    /// Bytes at which the buffer being filled is handed over: AUTOINLEN, or in manual mode the whole
    /// buffer, whatever USB's packet size is.
    fn fill_limit(&self) -> usize {
        match usize::from(self.autoinlen) {
            len if self.auto_in() && len > 0 => len.min(self.packet_size()),
            _ if self.auto_in() => self.packet_size(),
            _ => self.buffer_size(),
        }
    }

    /// One transfer into an IN FIFO: a byte, or with WORDWIDE a word, low byte first. `false` = full,
    /// the data is lost.
    pub(crate) fn fifo_write(&mut self, data: u16) -> bool {
        let Some(buffer) = self.idle.first() else { return false };
        let limit = self.fill_limit();
        let slot = &mut self.buffers[usize::from(buffer)];
        slot.data[self.position] = data as u8;
        self.position += 1;
        if self.fifocfg & WORDWIDE != 0 && self.position < PACKET_MAX {
            slot.data[self.position] = (data >> 8) as u8;
            self.position += 1;
        }
        if self.position >= limit {
            slot.len = self.position;
            self.position = 0;
            self.idle.pop();
            if self.auto_in() { self.usb.push(buffer) } else { self.cpu.push(buffer) }
        }
        true
    }

    /// As many transfers of `words` as fit, like [`Self::fifo_write`] for each; returns their number.
    pub(crate) fn fifo_write_words(&mut self, words: &[u16]) -> usize {
        let mut done = 0;
        while done < words.len() && !self.fifo_full() {
            let Some(buffer) = self.idle.first() else { break };
            let limit = self.fill_limit();
            let room = limit.saturating_sub(self.position) / 2;
            // All but the last word of a buffer go without ceremony; that one hands it over.
            let plain =
                if self.word_wide() { room.saturating_sub(2).min(words.len() - done) } else { 0 };
            let slot = &mut self.buffers[usize::from(buffer)].data;
            for word in &words[done..done + plain] {
                slot[self.position..self.position + 2].copy_from_slice(&word.to_le_bytes());
                self.position += 2;
            }
            done += plain;
            if plain == 0 && self.fifo_write(words[done]) {
                done += 1;
            }
        }
        done
    }

    /// Transfers that the present buffer takes or gives without any flag changing or the buffer being
    /// handed over, but for a first byte in an empty one.
    pub(crate) fn plain_words(&self) -> usize {
        let end = if self.is_in() {
            self.idle.first().map_or(0, |_| self.fill_limit())
        } else {
            self.fifo.first().map_or(0, |buffer| self.buffers[usize::from(buffer)].len)
        };
        if self.position == 0 {
            return 0;
        }
        (end.saturating_sub(self.position) / self.unit()).saturating_sub(2)
    }

    /// Nothing goes in any more (IN) or comes out (OUT).
    pub(crate) fn fifo_stuck(&self) -> bool {
        if self.is_in() { self.idle.len == 0 } else { self.fifo.len == 0 }
    }

    /// `count` transfers, not more than [`Self::plain_words`]: `word` each time into an IN FIFO, or out
    /// of an OUT FIFO. Does nothing to a FIFO that is stuck.
    pub(crate) fn move_plain(&mut self, count: usize, word: u16) {
        if self.fifo_stuck() {
            return;
        }
        let end = self.position + count * self.unit();
        if self.is_in()
            && let Some(buffer) = self.idle.first()
        {
            let word = word.to_le_bytes();
            let unit = self.unit();
            let slot = &mut self.buffers[usize::from(buffer)].data[self.position..end];
            for bytes in slot.chunks_mut(unit) {
                bytes.copy_from_slice(&word[..unit]);
            }
        }
        self.position = end;
    }

    /// The next transfer of an OUT FIFO without taking it; `None` = empty.
    pub(crate) fn fifo_peek(&self) -> Option<u16> {
        let buffer = &self.buffers[usize::from(self.fifo.first()?)];
        let low = buffer.data[self.position];
        let high = if self.word_wide() && self.position + 1 < buffer.len {
            buffer.data[self.position + 1]
        } else {
            0
        };
        Some(u16::from_le_bytes([low, high]))
    }

    /// Takes that transfer; `false` = empty.
    pub(crate) fn fifo_next(&mut self) -> bool {
        let Some(buffer) = self.fifo.first() else { return false };
        self.position += self.unit();
        if self.position >= self.buffers[usize::from(buffer)].len {
            self.position = 0;
            self.fifo.pop();
            self.usb.push(buffer);
        }
        true
    }

    /// PKTEND of a slave FIFO's master: commits what is in the buffer; an empty packet only with
    /// ZEROLENIN. `false` = nothing was committed.
    pub(crate) fn packet_end(&mut self) -> bool {
        if !self.is_in() || self.position == 0 && self.fifocfg & ZEROLENIN == 0 {
            return false;
        }
        let len = self.position;
        let Some(buffer) = self.idle.pop() else { return false };
        self.position = 0;
        self.buffers[usize::from(buffer)].len = len;
        self.usb.push(buffer);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn high_speed(cfg: u8) -> Endpoint {
        let mut endpoint = Endpoint::new(true, cfg);
        endpoint.set_speed(Speed::High);
        endpoint
    }

    fn drain(endpoint: &mut Endpoint) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some(byte) = endpoint.fifo_peek() {
            bytes.push(byte as u8);
            endpoint.fifo_next();
        }
        bytes
    }

    #[test]
    fn out_packets_wait_for_the_cpu_and_skip_arms_again() {
        let mut ep = high_speed(0xA2);
        assert!(!ep.can_receive(), "nothing is armed after reset");
        ep.commit(SKIP);
        ep.commit(0);
        ep.commit(SKIP);
        assert_eq!(ep.usb.len, 2, "double buffered");
        ep.receive(&[1, 2, 3]);
        ep.receive(&[4]);
        assert!(!ep.can_receive() && ep.cpu_full());
        assert_eq!((ep.byte_count(), ep.read(2), ep.status()), (3, 3, 0x28));
        ep.commit(SKIP);
        assert_eq!((ep.byte_count(), ep.read(0), ep.can_receive()), (1, 4, true));
    }

    #[test]
    fn a_committed_out_packet_reaches_the_fifo_with_the_cpus_length() {
        let mut ep = high_speed(0xA2);
        ep.fifocfg = 0;
        ep.commit(SKIP);
        ep.receive(&[1, 2, 3]);
        ep.commit(2);
        assert_eq!(drain(&mut ep), [1, 2]);
        assert!(ep.can_receive(), "emptied buffers arm themselves");
    }

    #[test]
    fn autoout_arms_all_buffers_and_passes_packets_on() {
        for (cfg, count) in [(0xA0, 4), (0xA2, 2), (0xA3, 3)] {
            let mut ep = high_speed(cfg);
            ep.configure_fifo(0x01, false);
            ep.configure_fifo(AUTOOUT, false);
            for n in 0..count {
                assert!(ep.can_receive(), "buffer {n} of {count}");
                ep.receive(&[n; 512]);
            }
            assert!(!ep.can_receive() && ep.fifo_full());
            assert_eq!(drain(&mut ep).len(), 512 * usize::from(count));
        }
    }

    #[test]
    fn revctl_leaves_arming_to_the_firmware() {
        let mut ep = high_speed(0xA2);
        ep.configure_fifo(AUTOOUT, true);
        assert!(!ep.can_receive());
        assert_eq!(ep.end_out(true), Commit::Done);
        assert!(ep.can_receive());
    }

    #[test]
    fn autoin_commits_at_its_length_and_full_means_no_buffer() {
        let mut ep = high_speed(0xE2);
        ep.configure_fifo(AUTOIN, false);
        ep.autoinlen = 300;
        for n in 0..600u16 {
            assert!(ep.fifo_write(n & 0xFF), "byte {n}");
        }
        assert!(ep.fifo_full() && !ep.fifo_write(0));
        assert_eq!(ep.to_send().map(<[u8]>::len), Some(300));
        ep.sent();
        assert_eq!(ep.to_send().and_then(|packet| packet.first().copied()), Some(44));
        assert!(!ep.fifo_full());
    }

    #[test]
    fn words_go_low_byte_first() {
        let mut ep = high_speed(0xE2);
        ep.configure_fifo(AUTOIN | WORDWIDE, false);
        ep.autoinlen = 4;
        ep.fifo_write(0x0201);
        ep.fifo_write(0x0403);
        assert_eq!(ep.to_send(), Some(&[1, 2, 3, 4][..]));
    }

    #[test]
    fn packet_end_makes_short_and_zero_packets() {
        let mut ep = high_speed(0xE2);
        ep.configure_fifo(AUTOIN, false);
        assert!(!ep.packet_end(), "ZEROLENIN is clear");
        ep.fifo_write(7);
        assert!(ep.packet_end());
        assert_eq!(ep.to_send(), Some(&[7][..]));
        ep.sent();
        ep.configure_fifo(AUTOIN | ZEROLENIN, false);
        assert!(ep.packet_end());
        assert_eq!(ep.to_send(), Some(&[][..]));
    }

    #[test]
    fn manual_in_waits_for_the_cpu_and_can_be_skipped() {
        let mut ep = high_speed(0xE2);
        ep.configure_fifo(0, false);
        for _ in 0..512 {
            ep.fifo_write(5);
        }
        assert_eq!((ep.to_send(), ep.fifo_bytes()), (None, 512));
        ep.end_in(true);
        assert_eq!((ep.to_send(), ep.fifo_bytes()), (None, 0));
        ep.fifo_write(6);
        ep.end_in(false);
        assert_eq!(ep.to_send(), Some(&[6][..]));
    }

    #[test]
    fn the_cpu_writes_and_commits_in_packets() {
        let mut ep = high_speed(0xE2);
        ep.write(0, 9);
        ep.write(1, 8);
        ep.commit(2);
        assert_eq!(ep.to_send(), Some(&[9, 8][..]));
        ep.commit(0);
        assert!(ep.cpu_full());
        assert_eq!(ep.commit(1), Commit::Nothing);
    }

    #[test]
    fn programmable_flag_of_an_out_fifo_compares_bytes() {
        let mut ep = high_speed(0xA2);
        ep.configure_fifo(AUTOOUT, false);
        ep.pf = 0x8003;
        ep.receive(&[0; 2]);
        assert!(!ep.programmable_flag());
        ep.receive(&[0; 1]);
        assert!(ep.programmable_flag());
    }

    #[test]
    fn full_speed_bulk_packets_have_64_bytes() {
        let mut ep = Endpoint::new(true, 0xE2);
        assert_eq!(ep.packet_size(), 64);
        ep.set_speed(Speed::High);
        assert_eq!(ep.packet_size(), 512);
        ep.cfg |= SIZE_1024;
        assert_eq!(ep.packet_size(), 1024);
    }
}
