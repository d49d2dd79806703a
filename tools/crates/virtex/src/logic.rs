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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::XCV300E;

    const FRAME: u32 = XCV300E.frame_words();

    fn write(register: Register, value: u32) -> [u32; 2] {
        [Header::type1(register, 1), value]
    }

    fn command(command: Command) -> [u32; 2] {
        write(Register::Cmd, command as u32)
    }

    /// Everything that frame data needs before it, with the frame address `far`.
    fn before_data(far: u32) -> Vec<u32> {
        [write(Register::Flr, 20), write(Register::Far, far), command(Command::Wcfg)].concat()
    }

    fn data(words: u32) -> Vec<u32> {
        let header = [Header::type1(Register::Fdri, 0), Header::type2(words)];
        header.into_iter().chain((0..words).map(|word| word | 0x8000_0000)).collect()
    }

    fn feed(logic: &mut Logic, words: &[u32]) -> Vec<Event> {
        words.iter().flat_map(|word| word.to_be_bytes()).filter_map(|b| logic.byte(b)).collect()
    }

    /// The fault at which a synchronised logic stops.
    fn fault_of(words: &[u32]) -> Option<Fault> {
        let mut logic = Logic::new(&XCV300E);
        feed(&mut logic, &[SYNC_WORD]);
        feed(&mut logic, words);
        logic.fault()
    }

    #[test]
    fn structural_faults_are_told_apart() {
        let last_of_logic = FrameAddress { block: 0, major: 54, minor: 26 }.to_far();
        let cases = [
            (write(Register::Flr, 19).to_vec(), Fault::FrameLength { flr: 19, expected: 20 }),
            (data(FRAME), Fault::UnexpectedData),
            ([write(Register::Flr, 20).to_vec(), data(FRAME)].concat(), Fault::UnexpectedData),
            ([before_data(0), data(2 * FRAME + 5)].concat(), Fault::PartialFrame { words: 5 }),
            (
                [before_data(0x0200_0000), data(2 * FRAME)].concat(),
                Fault::FrameAddress { far: 0x0200_0000 },
            ),
            (
                [before_data(last_of_logic), data(3 * FRAME)].concat(),
                Fault::FrameAddress { far: last_of_logic + 0x0002_0000 - (26 << 9) },
            ),
            (write(Register::Cmd, 2).to_vec(), Fault::Command { code: 2 }),
            (vec![0x3000_6001, 0], Fault::Register { address: 3 }),
            (vec![0x2800_E001], Fault::Read),
            (vec![0x1234_5678], Fault::Packet { word: 0x1234_5678 }),
            (vec![Header::type2(3)], Fault::Packet { word: Header::type2(3) }),
            (vec![Header::type1(Register::Cmd, 2)], Fault::Packet { word: 0x3000_8002 }),
            (write(Register::Crc, 1).to_vec(), Fault::Crc { computed: 0, given: 1 }),
        ];
        for (words, fault) in cases {
            assert_eq!(fault_of(&words), Some(fault));
        }
    }

    #[test]
    fn start_up_needs_every_frame() {
        let start = command(Command::Start);
        let mut crc = Crc::default();
        crc.update(Register::Cmd, Command::Start as u32);
        let check = write(Register::Crc, u32::from(crc.value()));
        let missing = XCV300E.frames();
        let words = [command(Command::Rcrc), start, check].concat();
        assert_eq!(fault_of(&words), Some(Fault::FramesMissing { missing }));
    }

    #[test]
    fn a_frame_is_stored_when_the_next_one_has_come() {
        let mut logic = Logic::new(&XCV300E);
        feed(&mut logic, &[SYNC_WORD]);
        feed(&mut logic, &[before_data(0), data(2 * FRAME)].concat());
        assert_eq!(logic.counts().frames, 1);
        let frame = logic.frame(FrameAddress::from_far(0)).expect("it exists");
        assert_eq!(frame[..2], [0x8000_0000, 0x8000_0001]);
        assert_eq!(logic.missing_frames(), XCV300E.frames() - 1);
        // A new address throws away what was held.
        feed(&mut logic, &write(Register::Far, 0x0202_0000));
        feed(&mut logic, &data(FRAME));
        assert_eq!(logic.counts().frames, 1);
    }

    #[test]
    fn control_bits_change_through_the_mask() {
        let mut logic = Logic::new(&XCV300E);
        feed(&mut logic, &[SYNC_WORD]);
        feed(&mut logic, &[write(Register::Mask, 0x40), write(Register::Ctl, 0x1FF)].concat());
        assert_eq!(logic.ctl(), 0x40);
        feed(&mut logic, &[write(Register::Mask, 0x81), write(Register::Ctl, 0x80)].concat());
        assert_eq!(logic.ctl(), 0xC0);
    }

    #[test]
    fn nothing_counts_before_the_synchronisation_word_and_a_second_one_does_no_harm() {
        let mut logic = Logic::new(&XCV300E);
        feed(&mut logic, &write(Register::Flr, 19));
        assert_eq!(logic.fault(), None);
        for byte in [0x12, 0x34, 0xAA, 0x99, 0x55, 0x66] {
            logic.byte(byte);
        }
        assert!(logic.synchronised());
        feed(&mut logic, &[0xFFFF_FFFF, SYNC_WORD, 0]);
        assert_eq!(logic.fault(), None);
        let events = feed(&mut logic, &[command(Command::Aghigh), command(Command::Lfrm)].concat());
        assert_eq!(events, [Event::InterconnectOff, Event::LastFrame]);
    }
}
