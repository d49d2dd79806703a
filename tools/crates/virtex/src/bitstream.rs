//! Bitstreams: making ones that are structurally valid, and checking any.
//!
//! **What [`make`] writes is for the twin only.** Its frames hold no netlist; they hold noise and a
//! description of the function that the model takes on ([`crate::design`]). A real FPGA needs the
//! vendor's place-and-route.

use sim::TraceHash;
use thiserror::Error;

use crate::design::{DESIGN_FRAME, Design, Function};
use crate::logic::{Counts, Event, Logic};
use crate::packet::{
    COR_DEFAULT, CTL_PERSIST, Command, Crc, DUMMY_WORD, Fault, Header, Register, SYNC_WORD,
    TYPE1_MAX,
};
use crate::part::{BLOCK_RAM, FrameAddress, PARTS, Part, RAM_FRAMES, XCV300E};

/// Bytes of a full XCV300E bitstream.
pub const XCV300E_BYTES: usize = 234_456;

/// Zero words at the end of a stream: 16 CCLKs, enough for the start-up sequence.
const TRAILING_WORDS: usize = 4;

/// How [`make`] shall write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The part.
    pub part: &'static Part,
    /// Name of the design, at most [`crate::design::NAME_MAX`] bytes.
    pub name: String,
    /// Another seed, other frames.
    pub seed: u64,
    /// Whether the configuration port stays one after start-up, which partial reconfiguration needs.
    pub persist: bool,
}

impl Default for Options {
    /// An XCV300E that can be reconfigured partially.
    fn default() -> Self {
        Self { part: &XCV300E, name: "stereosot".to_owned(), seed: 1, persist: true }
    }
}

/// A full bitstream, dummy word first: [`XCV300E_BYTES`] bytes for the turret's part. The same
/// arguments always give the same bytes.
///
/// Parts whose frames are too short for the description (XCV50E) get a stream without one.
pub fn make(function: Function, options: &Options) -> Vec<u8> {
    let part = options.part;
    let content = Content::new(function, options);
    let mut out = Writer::new();
    out.preamble();
    out.write(Register::Flr, part.flr());
    out.write(Register::Cor, COR_DEFAULT);
    out.write(Register::Mask, if options.persist { CTL_PERSIST } else { 0 });
    out.command(Command::Switch);

    out.write(Register::Far, 0);
    out.command(Command::Wcfg);
    let frames = 0..part.logic_frames();
    out.frame_data(frames.flat_map(|index| content.frame(index)).chain(content.pad()).collect());
    for major in 1..=part.ram_columns {
        out.write(Register::Far, ram_column(major).to_far());
        let first = part.logic_frames() + (major - 1) * RAM_FRAMES;
        let frames = (first..first + RAM_FRAMES).flat_map(|index| content.frame(index));
        // The last column's pad frame follows the command LFRM.
        let pad = if major < part.ram_columns { content.pad() } else { Vec::new() };
        out.frame_data(frames.chain(pad).collect());
    }
    out.check_sum();
    out.command(Command::Lfrm);
    out.frame_data(content.pad());
    out.command(Command::Start);
    out.write(Register::Ctl, if options.persist { CTL_PERSIST } else { 0 });
    out.check_sum();
    out.finish()
}

/// A partial bitstream that swaps the function of a running FPGA: the first column of block RAM
/// content, with the description in it. The stream of the running design must have had
/// [`Options::persist`]; its part must be [`Options::part`].
pub fn make_partial(function: Function, options: &Options) -> Vec<u8> {
    let content = Content::new(function, options);
    let first = options.part.logic_frames();
    let mut out = Writer::new();
    out.preamble();
    out.write(Register::Far, DESIGN_FRAME.to_far());
    out.command(Command::Wcfg);
    let frames = (first..first + RAM_FRAMES).flat_map(|index| content.frame(index));
    out.frame_data(frames.chain(content.pad()).collect());
    out.check_sum();
    out.command(Command::Lfrm);
    out.finish()
}

fn ram_column(major: u32) -> FrameAddress {
    FrameAddress { block: BLOCK_RAM, major, minor: 0 }
}

/// The frames of one stream.
struct Content {
    part: &'static Part,
    noise: TraceHash,
    design: Design,
    design_index: Option<u32>,
}

impl Content {
    fn new(function: Function, options: &Options) -> Self {
        let part = options.part;
        let design = Design { function, name: options.name.clone() };
        let mut noise = TraceHash::default();
        noise.update(function.name().as_bytes());
        noise.update(&options.seed.to_be_bytes());
        let fits = design.encode().len() < part.frame_words() as usize;
        let design_index = part.frame_index(DESIGN_FRAME).filter(|_| fits);
        Self { part, noise, design, design_index }
    }

    /// Frame number `index`: a quarter of its bits set, pad word zero.
    fn frame(&self, index: u32) -> Vec<u32> {
        let words = self.part.frame_words();
        if self.design_index == Some(index) {
            let mut frame = self.design.encode().to_vec();
            frame.resize(words as usize, 0);
            return frame;
        }
        let noise = |word: u32| {
            let mut hash = self.noise;
            hash.update(&(index * words + word).to_be_bytes());
            // The hash's high bits hardly depend on the last byte; this spreads it (2^64 / golden
            // ratio).
            let spread = (hash.value() ^ hash.value() >> 32).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            (spread >> 32 & spread) as u32
        };
        (0..words - 1).map(noise).chain([0]).collect()
    }

    fn pad(&self) -> Vec<u32> {
        vec![0; self.part.frame_words() as usize]
    }
}

/// Puts packets together and keeps the check sum.
struct Writer {
    words: Vec<u32>,
    crc: Crc,
}

impl Writer {
    fn new() -> Self {
        Self { words: Vec::new(), crc: Crc::default() }
    }

    fn preamble(&mut self) {
        self.words.extend([DUMMY_WORD, SYNC_WORD]);
        self.command(Command::Rcrc);
        self.crc.clear();
    }

    fn write(&mut self, register: Register, value: u32) {
        self.words.extend([Header::type1(register, 1), value]);
        self.crc.update(register, value);
    }

    fn command(&mut self, command: Command) {
        self.write(Register::Cmd, command as u32);
    }

    fn check_sum(&mut self) {
        self.write(Register::Crc, u32::from(self.crc.value()));
    }

    fn frame_data(&mut self, data: Vec<u32>) {
        let count = data.len() as u32;
        if count <= TYPE1_MAX {
            self.words.push(Header::type1(Register::Fdri, count));
        } else {
            self.words.extend([Header::type1(Register::Fdri, 0), Header::type2(count)]);
        }
        for &word in &data {
            self.crc.update(Register::Fdri, word);
        }
        self.words.extend(data);
    }

    fn finish(mut self) -> Vec<u8> {
        self.words.extend([0; TRAILING_WORDS]);
        self.words.iter().flat_map(|word| word.to_be_bytes()).collect()
    }
}

/// What a `.bit` file says before its bitstream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BitHeader {
    /// Name of the design, as a rule with `.ncd` behind it.
    pub design: String,
    /// Part and package, e.g. `v300ecs144`.
    pub part: String,
    /// Date, `2005/07/01`.
    pub date: String,
    /// Time of day, `12:00:00`.
    pub time: String,
}

const BIT_MAGIC: [u8; 13] = [0, 9, 0x0F, 0xF0, 0x0F, 0xF0, 0x0F, 0xF0, 0x0F, 0xF0, 0, 0, 1];

/// `raw` as a `.bit` file. Texts longer than 65534 bytes are cut.
pub fn write_bit(header: &BitHeader, raw: &[u8]) -> Vec<u8> {
    let mut out = BIT_MAGIC.to_vec();
    let fields = [&header.design, &header.part, &header.date, &header.time];
    for (key, text) in (b'a'..=b'd').zip(fields) {
        let text = &text.as_bytes()[..text.len().min(usize::from(u16::MAX) - 1)];
        out.push(key);
        out.extend((text.len() as u16 + 1).to_be_bytes());
        out.extend(text);
        out.push(0);
    }
    out.push(b'e');
    out.extend((raw.len() as u32).to_be_bytes());
    out.extend(raw);
    out
}

/// Why a file is no bitstream that would configure the part. Offsets count bytes from the start of
/// the file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Error {
    /// A `.bit` header that makes no sense.
    #[error("the .bit header is damaged at byte {offset}: {what}")]
    Header {
        /// Where.
        offset: usize,
        /// What is wrong there.
        what: &'static str,
    },
    /// No synchronisation word at all.
    #[error(
        "there is no synchronisation word AA995566 in {length} bytes: this is not a bitstream, or its \
         bits are swapped"
    )]
    NoSync {
        /// Bytes searched.
        length: usize,
    },
    /// For a part that is not known.
    #[error("byte {offset}: frame length register {flr}: neither an XCV300E nor an XCV50E")]
    UnknownPart {
        /// Where FLR is written.
        offset: usize,
        /// Its value.
        flr: u32,
    },
    /// The logic would stop here.
    #[error("byte {offset}: {fault}")]
    Fault {
        /// First byte of the word that causes it.
        offset: usize,
        /// What the logic would stop at.
        fault: Fault,
    },
    /// The file ends too early.
    #[error("the stream ends at byte {length}, {what}")]
    Truncated {
        /// Length of the file.
        length: usize,
        /// What is still missing.
        what: &'static str,
    },
}

/// What a stream does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Writes every frame and starts the design.
    Full,
    /// Changes frames of a running design.
    Partial,
}

/// What [`check`] found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Full or partial.
    pub kind: Kind,
    /// For this part.
    pub part: &'static Part,
    /// The `.bit` header, if the file has one.
    pub header: Option<BitHeader>,
    /// Where in the file the raw stream begins, and how long it is.
    pub offset: usize,
    /// See [`Summary::offset`].
    pub length: usize,
    /// What the twin's model would do; None for a stream that does not come from [`make`].
    pub design: Option<Design>,
    /// Packets, check sums and frames.
    pub counts: Counts,
    /// The configuration options register at the end.
    pub cor: u32,
    /// Whether the configuration port stays one after start-up.
    pub persist: bool,
}

/// Separate the `.bit` header, if `file` has one, from the raw stream: header, offset, length.
pub fn split_bit(file: &[u8]) -> Result<(Option<BitHeader>, usize, usize), Error> {
    if !file.starts_with(&BIT_MAGIC) {
        return Ok((None, 0, file.len()));
    }
    let mut offset = BIT_MAGIC.len();
    let mut fields: [String; 4] = Default::default();
    for (key, field) in (b'a'..=b'd').zip(&mut fields) {
        if file.get(offset) != Some(&key) {
            return Err(Error::Header { offset, what: "the fields are not in the order a to e" });
        }
        let bytes = take(file, offset + 1, 2)?;
        let length = usize::from(u16::from_be_bytes([bytes[0], bytes[1]]));
        let text = take(file, offset + 3, length)?;
        let text = text.strip_suffix(&[0]).unwrap_or(text);
        *field = String::from_utf8_lossy(text).into_owned();
        offset += 3 + length;
    }
    if file.get(offset) != Some(&b'e') {
        return Err(Error::Header { offset, what: "the fields are not in the order a to e" });
    }
    let bytes = take(file, offset + 1, 4)?;
    let length = u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize;
    take(file, offset + 5, length).map_err(|_| Error::Truncated {
        length: file.len(),
        what: "before the length in its .bit header is reached: copy the file again",
    })?;
    let [design, part, date, time] = fields;
    Ok((Some(BitHeader { design, part, date, time }), offset + 5, length))
}

fn take(file: &[u8], offset: usize, length: usize) -> Result<&[u8], Error> {
    file.get(offset..offset + length)
        .ok_or(Error::Header { offset, what: "the file ends within the header" })
}

/// Walk through `file`, raw or `.bit`, packet by packet, as the chip would, and say what it does or
/// why it would not configure the part.
pub fn check(file: &[u8]) -> Result<Summary, Error> {
    let (header, offset, length) = split_bit(file)?;
    let raw = &file[offset..offset + length];
    let named = find_part(raw, offset)?;
    let part = named.unwrap_or(&XCV300E);
    let mut logic = if named.is_some() { Logic::new(part) } else { Logic::running(part) };
    let mut last_frame = false;
    let mut started_at = None;
    for (index, &byte) in raw.iter().enumerate() {
        match logic.byte(byte) {
            Some(Event::Fault(fault)) => {
                return Err(Error::Fault { offset: offset + index.saturating_sub(3), fault });
            }
            Some(Event::LastFrame) => last_frame = true,
            Some(Event::StartUp) => started_at = Some(index),
            Some(Event::InterconnectOff) | None => {}
        }
    }
    let ended = |what| Err(Error::Truncated { length: file.len(), what });
    if !logic.synchronised() {
        return Err(Error::NoSync { length });
    }
    if logic.within_packet() {
        return ended("within a packet: the file is not whole");
    }
    let kind = match started_at {
        Some(at) if raw.len() - 1 - at < logic.done_cycle() as usize => {
            return ended("before start-up is over: it lacks the zero words at its end");
        }
        Some(_) => Kind::Full,
        None if last_frame && logic.counts().crc_checks > 0 && logic.counts().frames > 0 => {
            Kind::Partial
        }
        None => return ended("before the design is started: the file is not whole"),
    };
    if kind == Kind::Partial && logic.missing_frames() == 0 {
        return ended("before the design is started: the file is not whole");
    }
    Ok(Summary {
        kind,
        part,
        header,
        offset,
        length,
        design: logic.frame(DESIGN_FRAME).and_then(Design::decode),
        counts: logic.counts(),
        cor: logic.cor(),
        persist: logic.ctl() & CTL_PERSIST != 0,
    })
}

/// The part whose frame length the stream sets before its first frame. None if it sets none, as a
/// partial stream may: it is then taken to be for the turret's part.
fn find_part(raw: &[u8], offset: usize) -> Result<Option<&'static Part>, Error> {
    let sync = SYNC_WORD.to_be_bytes();
    let Some(sync) = raw.windows(sync.len()).position(|bytes| bytes == sync) else {
        return Ok(None);
    };
    let mut at = sync + 4;
    while let Some(Header::Write { address, count }) = word_at(raw, at).map(Header::decode) {
        if address == Register::Fdri as u32 {
            break;
        }
        if address == Register::Flr as u32 && count == 1 {
            let Some(flr) = word_at(raw, at + 4) else { break };
            let part = PARTS.into_iter().find(|part| part.flr() == flr);
            return part.map(Some).ok_or(Error::UnknownPart { offset: offset + at + 4, flr });
        }
        at += 4 + 4 * count as usize;
    }
    Ok(None)
}

fn word_at(raw: &[u8], at: usize) -> Option<u32> {
    let bytes = raw.get(at..at + 4)?;
    Some(u32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::XCV50E;

    fn soccer() -> Vec<u8> {
        make(Function::Soccer, &Options::default())
    }

    fn words(stream: &[u8]) -> Vec<u32> {
        (0..stream.len() / 4).filter_map(|index| word_at(stream, 4 * index)).collect()
    }

    #[test]
    fn sizes_are_those_of_real_bitstreams() {
        assert_eq!(soccer().len(), XCV300E_BYTES);
        assert_eq!(XCV300E_BYTES * 8, 1_875_648);
        let small = make(Function::Capture, &Options { part: &XCV50E, ..Options::default() });
        assert_eq!(small.len() * 8, 630_048);
        assert_eq!(check(&small).expect("it is whole").part, &XCV50E);
    }

    #[test]
    fn packets_come_in_the_vendors_order() {
        let words = words(&soccer());
        let start = [
            0xFFFF_FFFF,
            0xAA99_5566,
            0x3000_8001,
            7,
            0x3001_6001,
            20,
            0x3001_2001,
            0x0080_3F2D,
            0x3000_C001,
            0x40,
            0x3000_8001,
            9,
            0x3000_2001,
            0,
            0x3000_8001,
            1,
            0x3000_4000,
            0x5000_CF75,
        ];
        assert_eq!(words[..start.len()], start);
        let ram = start.len() + 53_109;
        assert_eq!(words[ram..ram + 3], [0x3000_2001, 0x0202_0000, 0x3000_4555]);
        let last = words.len() - 4 - 6 - 22 - 2 - 2;
        assert_eq!(words[last], 0x3000_0001, "CRC");
        assert_eq!(words[last + 2..last + 5], [0x3000_8001, 3, 0x3000_4015]);
        let tail = words.len() - 10;
        assert_eq!(words[tail..tail + 5], [0x3000_8001, 5, 0x3000_A001, 0x40, 0x3000_0001]);
        assert_eq!(words[words.len() - 4..], [0; 4]);
    }

    #[test]
    fn a_made_stream_checks_and_says_what_it_is() {
        let options = Options { name: "cup".to_owned(), ..Options::default() };
        let summary = check(&make(Function::Capture, &options)).expect("it is whole");
        assert_eq!(summary.kind, Kind::Full);
        assert_eq!(summary.part, &XCV300E);
        let design = Design { function: Function::Capture, name: "cup".to_owned() };
        assert_eq!(summary.design, Some(design));
        assert_eq!(summary.counts.crc_checks, 2);
        assert_eq!(summary.counts.frames, 2784);
        assert!(summary.persist);
    }

    #[test]
    fn the_same_arguments_give_the_same_bytes_and_others_do_not() {
        assert_eq!(soccer(), soccer());
        assert_ne!(soccer(), make(Function::Capture, &Options::default()));
        assert_ne!(soccer(), make(Function::Soccer, &Options { seed: 2, ..Options::default() }));
        let ones: u32 = words(&soccer()).iter().map(|word| word.count_ones()).sum();
        assert!((400_000..500_000).contains(&ones), "a quarter of 1.78 M bits, not {ones}");
    }

    #[test]
    fn a_partial_stream_is_told_from_a_full_one() {
        let partial = make_partial(Function::Capture, &Options::default());
        let summary = check(&partial).expect("it is whole");
        assert_eq!(summary.kind, Kind::Partial);
        assert_eq!(summary.counts.frames, 64);
        assert_eq!(summary.design.expect("it has one").function, Function::Capture);
    }

    #[test]
    fn any_flipped_bit_between_sync_and_padding_is_found() {
        let stream = soccer();
        let end = stream.len() - 16;
        // Everything but frame data bit by bit, and a sample of the frame data.
        let places = (4..80).chain((80..end - 150).step_by(4_099)).chain(end - 150..end);
        for at in places {
            for bit in 0..8 {
                let mut damaged = stream.clone();
                damaged[at] ^= 1 << bit;
                assert!(check(&damaged).is_err(), "byte {at} bit {bit}");
            }
        }
    }

    #[test]
    fn the_dummy_word_does_not_matter() {
        for bit in 0..32 {
            let mut stream = soccer();
            stream[bit / 8] ^= 1 << (bit % 8);
            assert!(check(&stream).is_ok(), "bit {bit}");
        }
    }

    #[test]
    fn any_truncation_is_found() {
        let stream = soccer();
        for length in
            (0..stream.len() - 12).step_by(9_973).chain(stream.len() - 60..stream.len() - 12)
        {
            assert!(check(&stream[..length]).is_err(), "{length} bytes");
        }
        assert!(check(&stream[..stream.len() - 12]).is_ok(), "4 CCLKs are enough for DONE");
    }

    #[test]
    fn errors_name_the_byte_and_the_cause() {
        let mut stream = soccer();
        stream[1_000] ^= 1;
        let Err(Error::Fault { offset, fault: Fault::Crc { .. } }) = check(&stream) else {
            panic!("the CRC finds it: {:?}", check(&stream));
        };
        assert_eq!(offset, stream.len() - 4 * 35, "the first CRC packet's value");
        assert_eq!(check(b"hello"), Err(Error::NoSync { length: 5 }));
        let mut other = soccer();
        other[23] = 21;
        assert_eq!(check(&other), Err(Error::UnknownPart { offset: 20, flr: 21 }));
    }

    #[test]
    fn whatever_comes_there_is_an_answer() {
        let mut state = 1_u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as usize
        };
        let partial = make_partial(Function::Soccer, &Options::default());
        for round in 0..3_000 {
            // Noise that is synchronised, and a stream in which a few bytes are noise; both also
            // behind the beginning of a .bit file.
            let mut file = if round % 2 == 0 {
                let noise = (0..random() % 300).map(|_| random() as u8);
                SYNC_WORD.to_be_bytes().into_iter().chain(noise).collect()
            } else {
                let mut file = partial.clone();
                for _ in 0..3 {
                    file[random() % 60] = random() as u8;
                }
                file
            };
            if round % 3 == 0 {
                file.splice(0..0, BIT_MAGIC);
            }
            if let Ok(summary) = check(&file) {
                assert!(summary.counts.crc_checks > 0, "round {round}");
            }
        }
    }

    #[test]
    fn a_bit_file_survives() {
        let header = BitHeader {
            design: "soccer.ncd".to_owned(),
            part: XCV300E.bit_name.to_owned(),
            date: "2005/07/01".to_owned(),
            time: "12:00:00".to_owned(),
        };
        let raw = soccer();
        let file = write_bit(&header, &raw);
        let summary = check(&file).expect("it is whole");
        assert_eq!(summary.header, Some(header));
        assert_eq!(&file[summary.offset..summary.offset + summary.length], raw);
        for length in 13..summary.offset {
            assert!(matches!(check(&file[..length]), Err(Error::Header { .. })), "{length} bytes");
        }
        assert!(matches!(check(&file[..file.len() - 1]), Err(Error::Truncated { .. })));
    }
}
