//! The configuration logic behind the port: it takes bytes, finds the synchronisation word, and
//! carries out packets. The stream checker and the emulated chip both use it, so that they cannot
//! disagree.
//!
//! What is assumed, because no document at hand says it:
//! - between packets, a dummy or synchronisation word of a further stream is skipped;
//! - only FDRI and LOUT take packets of other than one word;
//! - after any fault the logic is deaf until PROG#. The real chip checks less: it takes a wrong frame
//!   length, a missing frame or a packet that is too long as it comes, and only the check sum stops
//!   it;
//! - COR holds its default value until it is written.

use crate::packet::{COR_DEFAULT, Command, Crc, Fault, Header, Register, SYNC_WORD};
use crate::part::{FrameAddress, Part};

/// What a byte brought about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The command LFRM: all frames of a partial reconfiguration are in, and what they say holds.
    LastFrame,
    /// The command AGHIGH: the interconnect is out of service until LFRM.
    InterconnectOff,
    /// START was given and the check sum after it is right: start-up begins with the next CCLK.
    StartUp,
    /// The logic stopped.
    Fault(Fault),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Before the synchronisation word.
    Unsynchronised,
    /// The next word is a header.
    Header,
    /// `left` more words go to `register`.
    Data { register: Register, left: u32 },
    /// After a fault.
    Deaf,
}

/// Sizes and settings that a stream brought, for those who want to look at it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Packets with a known register.
    pub packets: u32,
    /// Check sums that were right.
    pub crc_checks: u32,
    /// Frames written, repeated ones counted again.
    pub frames: u32,
}

/// The configuration logic and its memory.
#[derive(Clone, Debug)]
pub struct Logic {
    part: &'static Part,
    state: State,
    /// The last four bytes, and how many of them belong to the word now coming in.
    shift: u32,
    bytes: u32,
    last_register: Option<Register>,
    crc: Crc,
    command: Option<Command>,
    start: bool,
    flr: bool,
    cor: u32,
    ctl: u32,
    mask: u32,
    far: Option<FrameAddress>,
    /// Frames as the part stores them, [`Part::frame_words`] words each.
    frames: Vec<u32>,
    written: Vec<bool>,
    missing: u32,
    /// A frame is stored only when the next one has come in behind it.
    incoming: Vec<u32>,
    held: Option<Vec<u32>>,
    fault: Option<Fault>,
    counts: Counts,
}

impl Logic {
    /// As after power-on or PROG#.
    pub fn new(part: &'static Part) -> Self {
        let frames = part.frames();
        Self {
            part,
            state: State::Unsynchronised,
            shift: 0,
            bytes: 0,
            last_register: None,
            crc: Crc::default(),
            command: None,
            start: false,
            flr: false,
            cor: COR_DEFAULT,
            ctl: 0,
            mask: 0,
            far: None,
            frames: vec![0; (frames * part.frame_words()) as usize],
            written: vec![false; frames as usize],
            missing: frames,
            incoming: Vec::with_capacity(part.frame_words() as usize),
            held: None,
            fault: None,
            counts: Counts::default(),
        }
    }

    /// As in a part whose running design was told its frame length long ago: what a partial stream
    /// finds.
    pub fn running(part: &'static Part) -> Self {
        Self { flr: true, ..Self::new(part) }
    }

    /// The part.
    pub fn part(&self) -> &'static Part {
        self.part
    }

    /// Why the logic stopped, if it did.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Whether the synchronisation word has been seen.
    pub fn synchronised(&self) -> bool {
        self.state != State::Unsynchronised
    }

    /// Whether the logic waits for more words of a packet, or for more bytes of a word.
    pub fn within_packet(&self) -> bool {
        matches!(self.state, State::Data { .. }) || self.synchronised() && self.bytes != 0
    }

    /// The configuration options register.
    pub fn cor(&self) -> u32 {
        self.cor
    }

    /// Start-up cycle 2..=6 in which DONE is released.
    pub fn done_cycle(&self) -> u32 {
        (self.cor >> 12 & 7) + 1
    }

    /// The control register.
    pub fn ctl(&self) -> u32 {
        self.ctl
    }

    /// What has been seen so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Frames that were never written.
    pub fn missing_frames(&self) -> u32 {
        self.missing
    }

    /// The words of a frame, or None if the part has no such frame.
    pub fn frame(&self, address: FrameAddress) -> Option<&[u32]> {
        let words = self.part.frame_words() as usize;
        let first = self.part.frame_index(address)? as usize * words;
        self.frames.get(first..first + words)
    }

    /// Take in one byte, as one CCLK with CS# low does.
    pub fn byte(&mut self, byte: u8) -> Option<Event> {
        self.shift = self.shift << 8 | u32::from(byte);
        self.bytes += 1;
        match self.state {
            State::Unsynchronised => {
                if self.shift == SYNC_WORD {
                    self.state = State::Header;
                    self.bytes = 0;
                }
                None
            }
            State::Deaf => None,
            _ if self.bytes < 4 => None,
            _ => {
                self.bytes = 0;
                match self.word(self.shift) {
                    Ok(event) => event,
                    Err(fault) => {
                        self.state = State::Deaf;
                        self.fault = Some(fault);
                        Some(Event::Fault(fault))
                    }
                }
            }
        }
    }

    fn word(&mut self, word: u32) -> Result<Option<Event>, Fault> {
        let State::Data { register, left } = self.state else {
            self.header(word)?;
            return Ok(None);
        };
        self.state =
            if left > 1 { State::Data { register, left: left - 1 } } else { State::Header };
        let before = self.crc;
        self.crc.update(register, word);
        match register {
            Register::Fdri => {
                self.frame_data(word)?;
                if left == 1 && !self.incoming.is_empty() {
                    return Err(Fault::PartialFrame { words: self.incoming.len() as u32 });
                }
                Ok(None)
            }
            Register::Crc => self.check_crc(before, word),
            Register::Cmd => self.command(word),
            _ => self.set(register, word).map(|()| None),
        }
    }

    fn header(&mut self, word: u32) -> Result<(), Fault> {
        let (register, count) = match Header::decode(word) {
            Header::Padding | Header::Resync => return Ok(()),
            Header::Read => return Err(Fault::Read),
            Header::Unknown => return Err(Fault::Packet { word }),
            Header::Write { address, count } => {
                let register =
                    Register::from_address(address).ok_or(Fault::Register { address })?;
                self.counts.packets += 1;
                (register, count)
            }
            Header::WriteMore { count } => {
                (self.last_register.ok_or(Fault::Packet { word })?, count)
            }
        };
        // Header words are not covered by the check sum; this finds a damaged count.
        if count != 1 && !matches!(register, Register::Fdri | Register::Lout) {
            return Err(Fault::Packet { word });
        }
        self.last_register = Some(register);
        if count > 0 {
            self.state = State::Data { register, left: count };
        }
        Ok(())
    }

    fn check_crc(&mut self, before: Crc, given: u32) -> Result<Option<Event>, Fault> {
        if self.crc.value() != 0 {
            return Err(Fault::Crc { computed: before.value(), given });
        }
        self.counts.crc_checks += 1;
        if !self.start {
            return Ok(None);
        }
        self.start = false;
        if self.missing > 0 {
            return Err(Fault::FramesMissing { missing: self.missing });
        }
        // COR: start-up clock 21:20 (0 = CCLK), shut-down 15, DONE cycle 14:12 (1..=5).
        if self.cor >> 20 & 3 != 0 {
            return Err(Fault::StartupClock);
        }
        if self.cor >> 15 & 1 != 0 || !(2..=6).contains(&self.done_cycle()) {
            return Err(Fault::Options { cor: self.cor });
        }
        Ok(Some(Event::StartUp))
    }

    fn command(&mut self, code: u32) -> Result<Option<Event>, Fault> {
        let command = Command::from_code(code).ok_or(Fault::Command { code })?;
        self.command = Some(command);
        Ok(match command {
            Command::Rcrc => {
                self.crc.clear();
                None
            }
            Command::Start => {
                self.start = true;
                None
            }
            Command::Lfrm => Some(Event::LastFrame),
            Command::Aghigh => Some(Event::InterconnectOff),
            // RCFG alone does no harm; it is the read packet after it that cannot work. SWITCH
            // concerns the CCLK that a master makes.
            Command::Wcfg | Command::Rcfg | Command::Rcap | Command::Switch => None,
        })
    }

    fn set(&mut self, register: Register, word: u32) -> Result<(), Fault> {
        match register {
            Register::Far => {
                self.far = Some(FrameAddress::from_far(word));
                self.incoming.clear();
                self.held = None;
            }
            Register::Flr => {
                let expected = self.part.flr();
                if word != expected {
                    return Err(Fault::FrameLength { flr: word, expected });
                }
                self.flr = true;
            }
            Register::Cor => self.cor = word,
            Register::Mask => self.mask = word,
            Register::Ctl => self.ctl = self.ctl & !self.mask | word & self.mask,
            // Nobody is chained behind us; the others have been dealt with.
            Register::Lout | Register::Crc | Register::Cmd | Register::Fdri => {}
        }
        Ok(())
    }

    fn frame_data(&mut self, word: u32) -> Result<(), Fault> {
        if !self.flr || !matches!(self.command, Some(Command::Wcfg | Command::Lfrm)) {
            return Err(Fault::UnexpectedData);
        }
        self.incoming.push(word);
        if self.incoming.len() < self.part.frame_words() as usize {
            return Ok(());
        }
        if let Some(mut frame) = self.held.take() {
            self.store(&frame)?;
            frame.clear();
            self.held = Some(std::mem::replace(&mut self.incoming, frame));
        } else {
            let next = Vec::with_capacity(self.incoming.len());
            self.held = Some(std::mem::replace(&mut self.incoming, next));
        }
        Ok(())
    }

    /// Store a frame at the frame address, which then counts on.
    fn store(&mut self, frame: &[u32]) -> Result<(), Fault> {
        let address = self.far.ok_or(Fault::UnexpectedData)?;
        let index =
            self.part.frame_index(address).ok_or(Fault::FrameAddress { far: address.to_far() })?
                as usize;
        self.frames[index * frame.len()..(index + 1) * frame.len()].copy_from_slice(frame);
        if !self.written[index] {
            self.written[index] = true;
            self.missing -= 1;
        }
        self.counts.frames += 1;
        // Beyond the last frame of a block the address points nowhere, which is no fault as long as
        // nothing is stored there: the pad frame stays in the buffer.
        self.far = Some(self.part.next_frame(address).unwrap_or(FrameAddress {
            major: address.major + 1,
            minor: 0,
            ..address
        }));
        Ok(())
    }
}
