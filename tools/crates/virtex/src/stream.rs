//! The way from the frame memory to the slave FIFO: docs/SPEC.md section 7.
//!
//! Pairs wait in the PSRAM until the FIFO has taken them. One place always belongs to the cameras, so
//! a pair that is complete when no other place is free is lost, whole. What is sent has been complete
//! before: a slow host never gets half a frame.
//!
//! The FIFO takes 16-bit words, low byte first; bytes of the stream are in that order.

use std::collections::VecDeque;
use std::mem;

use common_sys::constants as c;
use common_sys::link::{
    REPORT_SIZE, STREAM_BLOCK, StreamHeader, stream_header_encode, stream_pattern_first,
};
use common_sys::vision::EyeParams;
use sim::{Ps, US};

/// The turret's PSRAM, 32 Mbit.
pub const PSRAM_BYTES: usize = 4 << 20;

/// Pairs of frames of so many pixels that it holds, the one being written included.
pub const fn places(pixels: usize) -> usize {
    PSRAM_BYTES / (2 * 2 * pixels)
}

/// What is streamed when nobody looks through the cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Pairs from the cameras.
    Cameras,
    /// The test pattern in frames of this size.
    Pattern {
        /// Pixels of a row.
        width: u16,
        /// Rows.
        height: u16,
    },
}

/// A pair that the cameras have delivered.
#[derive(Clone, Copy, Debug)]
pub struct Taken<'a> {
    /// When it may be sent: its report is there.
    pub ready: Ps,
    /// Middle of the exposure, from the design's start.
    pub exposure: Ps,
    /// Pixels of a row.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// `STREAM_FLAG_*`.
    pub flags: u8,
    /// The design's parameters.
    pub params: EyeParams,
    /// Its report, or zeros.
    pub report: [u8; REPORT_SIZE],
    /// Left and right eye.
    pub pixels: [&'a [u16]; 2],
}

/// A pair in the memory, both frames with the place for their header before them.
#[derive(Clone, Debug)]
struct Pair {
    ready: Ps,
    header: StreamHeader,
    words: [Vec<u16>; 2],
}

/// What goes to the FIFO at present.
#[derive(Clone, Debug)]
enum Sending {
    Nothing,
    Frame { pair: Pair, eye: usize, position: usize },
    End { words: Vec<u16>, position: usize },
}

/// The stream.
#[derive(Clone, Debug)]
pub struct Stream {
    /// `FPGA_STREAM_*`.
    state: u16,
    source: Source,
    /// Streams begun.
    session: u16,
    number: u32,
    sent: u32,
    lost: u32,
    waiting: VecDeque<Pair>,
    sending: Sending,
    /// The first edge of IFCLK that it has not used.
    free: Ps,
    /// Buffers to use again.
    spare: Vec<[Vec<u16>; 2]>,
}

/// Words of the block that a frame's header fills.
const BLOCK_WORDS: usize = STREAM_BLOCK / 2;

impl Default for Stream {
    fn default() -> Self {
        Self {
            state: c::FPGA_STREAM_OFF as u16,
            source: Source::Cameras,
            session: 0,
            number: 0,
            sent: 0,
            lost: 0,
            waiting: VecDeque::new(),
            sending: Sending::Nothing,
            free: 0,
            spare: Vec::new(),
        }
    }
}

impl Stream {
    /// The register: `FPGA_STREAM_*`.
    pub fn state(&self) -> u16 {
        self.state
    }

    /// Streams begun, pairs sent, pairs lost.
    pub fn counts(&self) -> [u16; 3] {
        [self.session, self.sent as u16, self.lost as u16]
    }

    /// Whether it drives the FIFO's pins.
    pub fn drives(&self) -> bool {
        u32::from(self.state) != c::FPGA_STREAM_OFF
    }

    /// The register is written.
    pub fn control(&mut self, now: Ps, value: u16, source: Source) {
        match (u32::from(self.state), u32::from(value)) {
            (_, c::FPGA_STREAM_OFF) => self.stop(),
            (c::FPGA_STREAM_OFF, c::FPGA_STREAM_ON) => {
                self.state = value;
                self.source = source;
                self.session = self.session.wrapping_add(1);
                (self.number, self.sent, self.lost) = (0, 0, 0);
                self.free = now;
            }
            (c::FPGA_STREAM_ON, c::FPGA_STREAM_END) => self.state = value,
            _ => {}
        }
    }

    /// The pins float; what was not sent is forgotten.
    fn stop(&mut self) {
        self.state = c::FPGA_STREAM_OFF as u16;
        self.waiting.clear();
        self.sending = Sending::Nothing;
    }

    /// The cameras have delivered a pair: it waits its turn, or is lost.
    pub fn take(&mut self, taken: &Taken<'_>) {
        if u32::from(self.state) != c::FPGA_STREAM_ON || self.source != Source::Cameras {
            return;
        }
        let number = self.number;
        self.number += 1;
        let under_way = usize::from(matches!(self.sending, Sending::Frame { .. }));
        // One place is the cameras' own, and one this pair's.
        if self.waiting.len() + under_way + 2 > places(taken.pixels[0].len()) {
            self.lost += 1;
            return;
        }
        let mut words = self.spare.pop().unwrap_or_default();
        for (words, pixels) in words.iter_mut().zip(taken.pixels) {
            words.resize(BLOCK_WORDS, 0);
            words.extend(pixels.iter().map(|pixel| pixel.swap_bytes()));
        }
        self.waiting.push_back(Pair {
            ready: taken.ready,
            header: StreamHeader {
                kind: c::STREAM_FRAME as u8,
                flags: taken.flags,
                width_px: taken.width,
                height_px: taken.height,
                number,
                sent: number - self.lost,
                lost: self.lost,
                exposure_us: (taken.exposure / US) as u32,
                params: taken.params,
                report: taken.report,
                ..StreamHeader::default()
            },
            words,
        });
    }

    /// The next pair of the test pattern.
    fn pattern(&mut self, width: u16, height: u16) -> Pair {
        let number = self.number;
        self.number += 1;
        let mut words = self.spare.pop().unwrap_or_default();
        for (eye, words) in words.iter_mut().enumerate() {
            let first = stream_pattern_first(number, eye as u8);
            let pixels = usize::from(width) * usize::from(height);
            words.resize(BLOCK_WORDS, 0);
            words.extend((0..pixels).map(|n| first.wrapping_add(n as u16).swap_bytes()));
        }
        let header = StreamHeader {
            kind: c::STREAM_FRAME as u8,
            flags: c::STREAM_FLAG_PATTERN as u8,
            width_px: width,
            height_px: height,
            number,
            sent: number,
            ..StreamHeader::default()
        };
        Pair { ready: self.free, header, words }
    }

    /// The words that wait for the FIFO until `until`, and the first edge at which they may be written;
    /// None if there are none.
    pub fn words(&mut self, until: Ps) -> Option<(&[u16], Ps)> {
        if matches!(self.sending, Sending::Nothing) {
            self.begin(until);
        }
        let words = match &self.sending {
            Sending::Nothing => {
                self.free = self.free.max(until);
                return None;
            }
            Sending::Frame { pair, eye, position } => &pair.words[*eye][*position..],
            Sending::End { words, position } => &words[*position..],
        };
        Some((words, self.free))
    }

    /// Begin with the next record, if there is one by `until`.
    fn begin(&mut self, until: Ps) {
        let on = u32::from(self.state) == c::FPGA_STREAM_ON;
        if self.waiting.front().is_some_and(|pair| pair.ready >= until) {
            return;
        }
        let pair = match (self.waiting.pop_front(), self.source) {
            (Some(pair), _) => Some(pair),
            (None, Source::Pattern { width, height }) if on => Some(self.pattern(width, height)),
            _ => None,
        };
        if let Some(mut pair) = pair {
            self.free = self.free.max(pair.ready);
            pair.header.session = self.session;
            self.write_headers(&mut pair);
            self.sending = Sending::Frame { pair, eye: 0, position: 0 };
        } else if u32::from(self.state) == c::FPGA_STREAM_END {
            let header = StreamHeader {
                kind: c::STREAM_END as u8,
                number: self.number,
                sent: self.sent,
                lost: self.lost,
                session: self.session,
                ..StreamHeader::default()
            };
            self.sending = Sending::End { words: words_of(&header), position: 0 };
        }
    }

    /// A pair's header says what was lost before its first frame goes out; both frames say the same.
    fn write_headers(&self, pair: &mut Pair) {
        for eye in 0..2 {
            pair.header.eye = eye as u8;
            let words = words_of(&pair.header);
            pair.words[eye][..words.len()].copy_from_slice(&words);
        }
    }

    /// The FIFO has taken so many of them; `next` is the first edge that is free. True if PKTEND follows:
    /// with it the stream is over.
    pub fn advance(&mut self, count: usize, next: Ps) -> bool {
        self.free = next;
        match &mut self.sending {
            Sending::Nothing => false,
            Sending::Frame { pair, eye, position } => {
                *position += count;
                if *position == pair.words[*eye].len() {
                    *position = 0;
                    *eye += 1;
                }
                if *eye == 2 {
                    self.sent += 1;
                    if let Sending::Frame { pair, .. } =
                        mem::replace(&mut self.sending, Sending::Nothing)
                    {
                        let mut words = pair.words;
                        words.iter_mut().for_each(Vec::clear);
                        self.spare.push(words);
                    }
                }
                false
            }
            Sending::End { words, position } => {
                *position += count;
                let over = *position == words.len();
                if over {
                    self.stop();
                }
                over
            }
        }
    }

    /// The FIFO is full at `now`: nothing can be written to it before.
    pub fn held_up(&mut self, now: Ps) {
        self.free = self.free.max(now);
    }
}

/// A header as the FIFO takes it.
fn words_of(header: &StreamHeader) -> Vec<u16> {
    let wire = stream_header_encode(header);
    wire.chunks_exact(2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use common_sys::link::{STREAM_HEADER_SIZE, stream_header_decode};
    use sim::MS;

    const PIXELS: usize = 320 * 240;

    fn on(source: Source) -> Stream {
        let mut stream = Stream::default();
        stream.control(0, c::FPGA_STREAM_ON as u16, source);
        stream
    }

    fn take(stream: &mut Stream, ready: Ps, colour: u16) {
        let pixels = vec![colour; PIXELS];
        stream.take(&Taken {
            ready,
            exposure: ready,
            width: 320,
            height: 240,
            flags: 0,
            params: EyeParams::usual(),
            report: [0; REPORT_SIZE],
            pixels: [&pixels, &pixels],
        });
    }

    /// What the FIFO gets until `now` if it always has room; true if it ends with PKTEND.
    fn drain(stream: &mut Stream, now: Ps) -> (Vec<u8>, bool) {
        let mut bytes = Vec::new();
        while let Some((words, from)) = stream.words(now) {
            bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
            let count = words.len();
            if stream.advance(count, from) {
                return (bytes, true);
            }
            if matches!(stream.source, Source::Pattern { .. }) && bytes.len() > 1 << 20 {
                break;
            }
        }
        (bytes, false)
    }

    fn header(bytes: &[u8]) -> StreamHeader {
        let wire: &[u8; STREAM_HEADER_SIZE] =
            bytes[..STREAM_HEADER_SIZE].try_into().expect("whole");
        stream_header_decode(wire).expect("a header")
    }

    const FRAME: usize = STREAM_BLOCK + 2 * PIXELS;

    #[test]
    fn a_pair_is_two_frames_of_whole_packets_with_the_high_byte_first() {
        let mut stream = on(Source::Cameras);
        take(&mut stream, MS, 0x1234);
        assert_eq!(drain(&mut stream, MS).0.len(), 0, "it is not ready before its report");
        let (bytes, _) = drain(&mut stream, MS + 1);
        assert_eq!(bytes.len(), 2 * FRAME);
        assert_eq!(FRAME % STREAM_BLOCK, 0);
        let (left, right) = (header(&bytes), header(&bytes[FRAME..]));
        assert_eq!((left.eye, right.eye, left.number, right.number), (0, 1, 0, 0));
        assert_eq!(bytes[STREAM_HEADER_SIZE..STREAM_BLOCK], [0; STREAM_BLOCK - STREAM_HEADER_SIZE]);
        assert_eq!(bytes[STREAM_BLOCK..STREAM_BLOCK + 4], [0x12, 0x34, 0x12, 0x34]);
    }

    #[test]
    fn when_the_memory_is_full_whole_pairs_are_lost_and_counted() {
        let mut stream = on(Source::Cameras);
        for n in 0..20 {
            take(&mut stream, n, 0);
        }
        assert_eq!(places(PIXELS), 13);
        assert_eq!(stream.counts(), [1, 0, 8]);
        let (bytes, _) = drain(&mut stream, MS);
        let numbers: Vec<u32> = bytes.chunks(FRAME).map(|frame| header(frame).number).collect();
        assert_eq!(numbers, (0..12).flat_map(|n| [n, n]).collect::<Vec<_>>());
        take(&mut stream, MS, 0);
        let (bytes, _) = drain(&mut stream, 2 * MS);
        let after = header(&bytes);
        assert_eq!((after.number, after.sent, after.lost), (20, 12, 8));
        stream.control(2 * MS, c::FPGA_STREAM_END as u16, Source::Cameras);
        let (bytes, over) = drain(&mut stream, 3 * MS);
        let end = header(&bytes);
        assert!(over && bytes.len() == STREAM_HEADER_SIZE);
        assert_eq!((end.kind, end.number, end.sent, end.lost), (c::STREAM_END as u8, 21, 13, 8));
        assert!(!stream.drives());
    }

    #[test]
    fn at_the_end_what_was_taken_is_sent_and_nothing_new_is_taken() {
        let mut stream = on(Source::Cameras);
        take(&mut stream, 0, 0);
        take(&mut stream, 0, 0);
        stream.control(1, c::FPGA_STREAM_END as u16, Source::Cameras);
        take(&mut stream, 2, 0);
        let (bytes, over) = drain(&mut stream, MS);
        assert!(over);
        assert_eq!(bytes.len(), 4 * FRAME + STREAM_HEADER_SIZE);
        assert_eq!(header(&bytes[4 * FRAME..]).number, 2);
    }

    #[test]
    fn off_forgets_everything_and_the_next_stream_begins_anew() {
        let mut stream = on(Source::Cameras);
        take(&mut stream, 0, 0);
        let _ = stream.words(1);
        stream.advance(100, 1);
        take(&mut stream, 0, 0);
        stream.control(2, c::FPGA_STREAM_OFF as u16, Source::Cameras);
        assert_eq!(drain(&mut stream, MS), (vec![], false));
        stream.control(MS, c::FPGA_STREAM_ON as u16, Source::Cameras);
        take(&mut stream, MS, 0);
        let first = header(&drain(&mut stream, 2 * MS).0);
        assert_eq!((first.session, first.number, first.lost), (2, 0, 0));
    }

    #[test]
    fn the_pattern_never_ends_and_counts_up() {
        let mut stream = on(Source::Pattern { width: 320, height: 240 });
        let (bytes, _) = drain(&mut stream, MS);
        for (n, frame) in bytes.chunks_exact(FRAME).enumerate() {
            let header = header(frame);
            assert_eq!((header.number as usize, usize::from(header.eye)), (n / 2, n % 2));
            let first = stream_pattern_first(header.number, header.eye);
            for (n, pixel) in frame[STREAM_BLOCK..].chunks_exact(2).enumerate() {
                let pixel = u16::from_be_bytes([pixel[0], pixel[1]]);
                assert_eq!(pixel, first.wrapping_add(n as u16));
            }
        }
    }
}
