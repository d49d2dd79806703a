//! The turret's flash: 128 Mbit NOR as M29W128FH, eight bits wide, AMD command set.
//!
//! Pins in, data and RY/BY# out; a read says when its data is valid, programming can only clear bits,
//! and a power cut leaves behind what a power cut leaves behind.
//!
//! Exact: commands, identification, status bits, sector map. From memory of the data sheet, so
//! assumptions of ours: the timing constants below and the CFI table's times and voltages. Every read
//! takes the full access time (the real chip is faster within a page). Not there: suspending an
//! erase, block protection, the extended block; their commands are listed in the diagnostics.

use std::fmt;
use std::ops::Range;

use common_sys::constants::{FLASH_SECTOR_SIZE, FLASH_SIZE, TURRET_FLASH_ACCESS_NS};
use sim::{MS, NS, Ps, TraceHash, US};
use thiserror::Error;
use virtex::diagnostics::Diagnostics;

/// Bytes of the chip.
pub const SIZE: usize = FLASH_SIZE as usize;
/// Bytes of a sector.
pub const SECTOR: usize = FLASH_SECTOR_SIZE as usize;

/// From a stable address or CE# low to valid data.
const ACCESS_PS: Ps = TURRET_FLASH_ACCESS_NS as Ps * NS;
/// From OE# low to valid data.
const OUTPUT_ENABLE_PS: Ps = 30 * NS;
/// How long the chip may still drive after OE# or CE# has risen.
pub const OUTPUT_DISABLE_PS: Ps = 25 * NS;
/// Shortest write pulse.
const WRITE_PULSE_PS: Ps = 45 * NS;
/// How long data must be stable before the write pulse ends.
const WRITE_DATA_PS: Ps = 45 * NS;

/// Typical time to program a byte.
pub const PROGRAM_PS: Ps = 10 * US;
/// Bytes of the write buffer.
pub const BUFFER: usize = 64;
/// Typical time to program from the write buffer.
pub const BUFFER_PROGRAM_PS: Ps = 180 * US;
/// Typical time to erase a sector.
pub const SECTOR_ERASE_PS: Ps = 800 * MS;
/// After a sector erase command, so long are further sectors accepted.
const ERASE_WINDOW_PS: Ps = 50 * US;

const MANUFACTURER: u8 = 0x20;
const DEVICE_CODES: [u8; 3] = [0x7E, 0x12, 0x8A];

/// CFI query, words 10 to 3C: identification, system interface, geometry.
const CFI: [u8; 0x2D] = [
    b'Q', b'R', b'Y', 0x02, 0x00, 0x40, 0x00, 0x00, 0x00, 0x00,
    0x00, // AMD set, extension at 40
    0x27, 0x36, 0xB5, 0xC5, // 2.7 to 3.6 V; 11.5 to 12.5 V for fast programming
    0x04, 0x08, 0x0A, 0x00, 0x04, 0x04, 0x03, 0x00, // typical times, then the longest
    0x18, // 2^24 bytes
    0x02, 0x00, 0x06, 0x00, // x8 and x16; write buffer of 2^6 bytes
    0x01, 0xFF, 0x00, 0x00, 0x01, // one region: 256 sectors of 256 * 256 bytes
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
];
const CFI_AT: u32 = 0x10;
/// The AMD extension, words 40 to 4F.
const CFI_EXTENDED: [u8; 16] = [
    b'P', b'R', b'I', b'1', b'3', 0x0C, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xB5, 0xC5, 0x00,
];
const CFI_EXTENDED_AT: u32 = 0x40;

/// An image does not fit the chip.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "the flash image has {length} bytes, but the chip has {SIZE}: make one with `sot bitstream pack`"
)]
pub struct ImageError {
    /// Bytes of the image.
    pub length: usize,
}

/// What was done to the chip that it does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Violation {
    /// The write pulse was too short; the write is lost.
    WritePulse,
    /// Data changed too shortly before the end of the write pulse; the write is lost.
    WriteData,
    /// CE#, OE# and WE# were low together.
    OutputDuringWrite,
    /// A command that the model does not know.
    Command(u8),
    /// A write to the buffer with a wrong count, outside its page, or without its confirmation.
    BufferAbort,
    /// A byte was programmed that needs bits set which are cleared.
    ProgramNeedsErase,
    /// The supply failed during an operation.
    PowerCut,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WritePulse => write!(f, "WE# low for less than {} ns", WRITE_PULSE_PS / NS),
            Self::WriteData => {
                write!(f, "data changed less than {} ns before WE# rose", WRITE_DATA_PS / NS)
            }
            Self::OutputDuringWrite => write!(f, "OE# and WE# low together"),
            Self::Command(byte) => write!(f, "unknown command {byte:02X}"),
            Self::BufferAbort => write!(f, "write to buffer aborted: count, page or confirmation"),
            Self::ProgramNeedsErase => write!(f, "programming cannot set a cleared bit"),
            Self::PowerCut => write!(f, "the supply failed during an operation"),
        }
    }
}

/// What the chip understands next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Reads show the array.
    Array,
    /// Reads show manufacturer and device code.
    Autoselect,
    /// Reads show the CFI table.
    Query,
    /// Programming or erasing has failed: reads show status until the reset command.
    Failed,
    /// Filling the write buffer went wrong: reads show status until its own reset sequence.
    Aborted,
}

/// How far a command has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Idle,
    Unlock1,
    Unlock2,
    /// The next write programs.
    Program,
    /// After 80.
    Erase,
    EraseUnlock1,
    EraseUnlock2,
    /// The next write says how many bytes go into the buffer, less one.
    BufferCount,
    /// So many more bytes go into the buffer.
    BufferData(usize),
    /// The buffer is full and waits for 29.
    BufferConfirm,
    /// After 90 in unlock bypass: 00 leaves it.
    LeaveBypass,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Job {
    /// The bytes, in the order in which they are programmed.
    Program { bytes: Vec<(usize, u8)> },
    /// The sectors, and until when more are accepted.
    Erase { sectors: Vec<usize>, window: Ps },
}

/// The control pins and what is on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pins {
    /// A[23:0].
    pub address: u32,
    /// CE#, true = high.
    pub ce: bool,
    /// OE#.
    pub oe: bool,
    /// WE#.
    pub we: bool,
}

/// The chip.
#[derive(Clone, Debug)]
pub struct Flash {
    array: Vec<u8>,
    pins: Pins,
    address_since: Ps,
    ce_since: Ps,
    oe_since: Ps,
    /// When the write pulse began, and the address it took.
    write: Option<(Ps, u32)>,
    mode: Mode,
    step: Step,
    bypass: bool,
    /// The sector that the write buffer is for, and what is in it.
    buffer_sector: usize,
    buffer: Vec<(usize, u8)>,
    job: Option<(Job, Ps, Ps)>,
    toggle: bool,
    /// Places that have changed, oldest first, if somebody wants to know.
    changes: Option<Vec<Range<usize>>>,
    diagnostics: Diagnostics<Violation>,
}

impl Flash {
    /// An erased chip.
    pub fn erased() -> Self {
        Self::with_array(vec![0xFF; SIZE])
    }

    /// A chip with `image` in it.
    ///
    /// # Errors
    /// If the image has not exactly [`SIZE`] bytes.
    pub fn from_image(image: &[u8]) -> Result<Self, ImageError> {
        if image.len() != SIZE {
            return Err(ImageError { length: image.len() });
        }
        Ok(Self::with_array(image.to_vec()))
    }

    fn with_array(array: Vec<u8>) -> Self {
        Self {
            array,
            pins: Pins { address: 0, ce: true, oe: true, we: true },
            address_since: 0,
            ce_since: 0,
            oe_since: 0,
            write: None,
            mode: Mode::Array,
            step: Step::Idle,
            bypass: false,
            buffer_sector: 0,
            buffer: Vec::new(),
            job: None,
            toggle: false,
            changes: None,
            diagnostics: Diagnostics::default(),
        }
    }

    /// What is stored. An operation under way is not in it yet.
    pub fn image(&self) -> &[u8] {
        &self.array
    }

    /// From now on [`Flash::take_changes`] tells what changes, for whoever keeps the contents in a file.
    pub fn record_changes(&mut self) {
        self.changes.get_or_insert_default();
    }

    /// Where the contents have changed since the last call, oldest first; what an operation under way
    /// does is told when it has ended.
    pub fn take_changes(&mut self, now: Ps) -> Vec<Range<usize>> {
        self.settle(now);
        self.changes.as_mut().map(std::mem::take).unwrap_or_default()
    }

    fn note_change(&mut self, range: Range<usize>) {
        let Some(changes) = &mut self.changes else { return };
        match changes.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => changes.push(range),
        }
    }

    /// What was done to the chip that it does not allow.
    pub fn diagnostics(&self) -> &Diagnostics<Violation> {
        &self.diagnostics
    }

    /// The pins change. `data` is what lies on DQ until now, and since when.
    pub fn set_pins(&mut self, now: Ps, pins: Pins, data: (u8, Ps)) {
        let old = self.pins;
        if old == pins {
            return;
        }
        if pins.address != old.address {
            self.address_since = now;
        }
        if pins.ce != old.ce {
            self.ce_since = now;
        }
        if pins.oe != old.oe {
            self.oe_since = now;
        }
        self.pins = pins;
        let reading = |p: Pins| !p.ce && !p.oe && p.we;
        if reading(pins) && !reading(old) {
            // Every read of the status shows DQ6 turned over.
            self.toggle = !self.toggle;
        }
        let writing = |p: Pins| !p.ce && !p.we;
        if writing(pins) && !pins.oe {
            self.diagnostics.note(now, Violation::OutputDuringWrite);
        }
        match (writing(old), writing(pins)) {
            (false, true) => self.write = Some((now, pins.address)),
            (true, false) => self.end_write(now, data),
            _ => {}
        }
    }

    /// Whether the chip drives DQ.
    pub fn drives(&self) -> bool {
        !self.pins.ce && !self.pins.oe && self.pins.we
    }

    /// Since when the chip has not driven DQ, if it does not.
    pub fn released_since(&self) -> Ps {
        self.ce_since.max(self.oe_since)
    }

    /// The byte on DQ while the chip drives it, and since when it is valid. That time may lie ahead
    /// of `now`: then the access time has not passed and what is on the pins is undefined.
    pub fn output(&mut self, now: Ps) -> (u8, Ps) {
        let valid = (self.address_since.max(self.ce_since) + ACCESS_PS)
            .max(self.oe_since + OUTPUT_ENABLE_PS);
        (self.read(now), valid)
    }

    /// Level of RY/BY#: high when nothing is going on.
    pub fn ready(&mut self, now: Ps) -> bool {
        self.settle(now);
        self.job.is_none()
    }

    /// When RY/BY# rises next.
    pub fn next_event(&self) -> Option<Ps> {
        self.job.as_ref().map(|(_, _, end)| *end)
    }

    /// The supply fails at `now`: an operation under way stops where it is. The next use is after
    /// power has returned.
    pub fn power_off(&mut self, now: Ps) {
        self.settle(now);
        if let Some((job, begin, end)) = self.job.take() {
            self.diagnostics.note(now, Violation::PowerCut);
            let done = (now.saturating_sub(begin)) as f64 / (end - begin) as f64;
            match job {
                Job::Program { bytes } => self.program_partly(&bytes, done),
                Job::Erase { sectors, .. } => self.erase_partly(&sectors, done),
            }
        }
        let array = std::mem::take(&mut self.array);
        let changes = self.changes.take();
        let diagnostics = std::mem::take(&mut self.diagnostics);
        *self = Self { changes, diagnostics, ..Self::with_array(array) };
    }

    fn read(&mut self, now: Ps) -> u8 {
        self.settle(now);
        let address = self.pins.address;
        if self.job.is_some() || matches!(self.mode, Mode::Failed | Mode::Aborted) {
            return self.status(now, address as usize);
        }
        // Tables are read at even addresses; A-1 does not matter.
        let word = address >> 1 & 0xFF;
        match self.mode {
            Mode::Array | Mode::Failed | Mode::Aborted => self.array[address as usize % SIZE],
            Mode::Autoselect => match word {
                0x00 => MANUFACTURER,
                0x01 => DEVICE_CODES[0],
                0x0E => DEVICE_CODES[1],
                0x0F => DEVICE_CODES[2],
                // Block protection status and all else: not protected.
                _ => 0,
            },
            Mode::Query => {
                let table = |at: u32, table: &[u8]| {
                    word.checked_sub(at).and_then(|index| table.get(index as usize).copied())
                };
                table(CFI_AT, &CFI).or_else(|| table(CFI_EXTENDED_AT, &CFI_EXTENDED)).unwrap_or(0)
            }
        }
    }

    /// DQ7 data polling, DQ6 toggle, DQ5 error, DQ3 erase timer, DQ2 toggle within the sectors being
    /// erased, DQ1 aborted buffer.
    fn status(&self, now: Ps, address: usize) -> u8 {
        let toggle = u8::from(self.toggle) << 6;
        match &self.job {
            None if self.mode == Mode::Aborted => toggle | 0x02,
            None => toggle | 0x20,
            Some((Job::Program { bytes }, ..)) => {
                let last = bytes.last().map_or(0, |&(_, value)| value);
                !last & 0x80 | toggle
            }
            Some((Job::Erase { sectors, window }, ..)) => {
                let within = sectors.contains(&(address / SECTOR));
                let timer = u8::from(now >= *window) << 3;
                toggle | timer | u8::from(self.toggle && within) << 2
            }
        }
    }

    fn end_write(&mut self, now: Ps, (data, stable_since): (u8, Ps)) {
        let Some((begin, address)) = self.write.take() else { return };
        if now - begin < WRITE_PULSE_PS {
            self.diagnostics.note(now, Violation::WritePulse);
            return;
        }
        if now < stable_since + WRITE_DATA_PS {
            self.diagnostics.note(now, Violation::WriteData);
            return;
        }
        self.settle(now);
        self.command(now, address, data);
    }

    fn command(&mut self, now: Ps, address: u32, data: u8) {
        if let Some((job, begin, end)) = &mut self.job {
            // Only one thing is heard while busy: further sectors, within the window.
            if let (Job::Erase { sectors, window }, 0x30) = (job, data)
                && now < *window
            {
                let sector = address as usize % SIZE / SECTOR;
                if !sectors.contains(&sector) {
                    sectors.push(sector);
                }
                *window = now + ERASE_WINDOW_PS;
                *begin = *window;
                *end = *window + SECTOR_ERASE_PS * sectors.len() as Ps;
            }
            return;
        }
        let at = address as usize % SIZE;
        match std::mem::replace(&mut self.step, Step::Idle) {
            Step::Program => self.start_program(now, vec![(at, data)], PROGRAM_PS),
            step @ (Step::BufferCount | Step::BufferData(_) | Step::BufferConfirm) => {
                self.fill_buffer(now, step, at, data);
            }
            step => self.cycle(now, step, at, data),
        }
    }

    /// One cycle of a command that is neither data nor heard while busy.
    fn cycle(&mut self, now: Ps, step: Step, at: usize, data: u8) {
        match (step, data, at & 0xFFF) {
            (Step::LeaveBypass, 0x00, _) => self.bypass = false,
            (Step::Idle, 0xA0, _) if self.bypass => self.step = Step::Program,
            (Step::Idle, 0x90, _) if self.bypass => self.step = Step::LeaveBypass,
            (Step::Unlock2, 0xF0, _) => self.mode = Mode::Array,
            (_, 0xF0, _) if self.mode != Mode::Aborted => self.mode = Mode::Array,
            (Step::Idle, 0xAA, 0xAAA) => self.step = Step::Unlock1,
            (Step::Unlock1, 0x55, 0x555) => self.step = Step::Unlock2,
            // After an error nothing but its reset is heard.
            _ if matches!(self.mode, Mode::Failed | Mode::Aborted) => {}
            (Step::Idle, 0x98, 0x0AA | 0xAAA) => self.mode = Mode::Query,
            (Step::Unlock2, 0x90, 0xAAA) => self.mode = Mode::Autoselect,
            (Step::Unlock2, 0xA0, 0xAAA) => self.step = Step::Program,
            (Step::Unlock2, 0x20, 0xAAA) => self.bypass = true,
            (Step::Unlock2, 0x25, _) => {
                self.buffer_sector = at / SECTOR;
                self.step = Step::BufferCount;
            }
            (Step::Unlock2, 0x80, 0xAAA) => self.step = Step::Erase,
            (Step::Erase, 0xAA, 0xAAA) => self.step = Step::EraseUnlock1,
            (Step::EraseUnlock1, 0x55, 0x555) => self.step = Step::EraseUnlock2,
            (Step::EraseUnlock2, 0x10, 0xAAA) => {
                self.start_erase(now, (0..SIZE / SECTOR).collect());
            }
            (Step::EraseUnlock2, 0x30, _) => self.start_erase(now, vec![at / SECTOR]),
            _ => {
                self.mode = Mode::Array;
                self.diagnostics.note(now, Violation::Command(data));
            }
        }
    }

    fn fill_buffer(&mut self, now: Ps, step: Step, at: usize, data: u8) {
        let same_sector = at / SECTOR == self.buffer_sector;
        match step {
            Step::BufferCount if same_sector && usize::from(data) < BUFFER => {
                self.buffer.clear();
                self.step = Step::BufferData(usize::from(data) + 1);
            }
            Step::BufferData(left)
                if same_sector
                    && self
                        .buffer
                        .first()
                        .is_none_or(|(first, _)| first / BUFFER == at / BUFFER) =>
            {
                self.buffer.push((at, data));
                self.step = if left > 1 { Step::BufferData(left - 1) } else { Step::BufferConfirm };
            }
            Step::BufferConfirm if same_sector && data == 0x29 => {
                let bytes = std::mem::take(&mut self.buffer);
                self.start_program(now, bytes, BUFFER_PROGRAM_PS);
            }
            _ => {
                self.mode = Mode::Aborted;
                self.diagnostics.note(now, Violation::BufferAbort);
            }
        }
    }

    fn start_program(&mut self, now: Ps, bytes: Vec<(usize, u8)>, time: Ps) {
        self.mode = Mode::Array;
        self.job = Some((Job::Program { bytes }, now, now + time));
    }

    fn start_erase(&mut self, now: Ps, sectors: Vec<usize>) {
        self.mode = Mode::Array;
        let window = now + ERASE_WINDOW_PS;
        let end = window + SECTOR_ERASE_PS * sectors.len() as Ps;
        self.job = Some((Job::Erase { sectors, window }, window, end));
    }

    /// Finish what time has finished.
    fn settle(&mut self, now: Ps) {
        let Some((job, _, end)) = self.job.take_if(|(_, _, end)| *end <= now) else { return };
        match job {
            Job::Program { bytes } => {
                for (at, value) in bytes {
                    self.note_change(at..at + 1);
                    self.array[at] &= value;
                    if self.array[at] != value {
                        self.diagnostics.note(end, Violation::ProgramNeedsErase);
                        self.mode = Mode::Failed;
                    }
                }
            }
            Job::Erase { sectors, .. } => {
                for sector in sectors {
                    let bytes = sector * SECTOR..(sector + 1) * SECTOR;
                    self.array[bytes.clone()].fill(0xFF);
                    self.note_change(bytes);
                }
            }
        }
    }

    /// The bytes before the one under way are programmed; of that one, some of the bits that were to
    /// be cleared are.
    fn program_partly(&mut self, bytes: &[(usize, u8)], done: f64) {
        let position = done * bytes.len() as f64;
        for (index, &(at, value)) in bytes.iter().enumerate() {
            let share = position - index as f64;
            let cleared =
                (0..8).filter(|&bit| chance(at, bit, share)).fold(0, |bits, bit| bits | 1 << bit);
            self.array[at] &= value | !cleared;
            self.note_change(at..at + 1);
        }
    }

    /// An erase first clears every bit of a sector, then sets them again; where it stops, bits are
    /// neither.
    fn erase_partly(&mut self, sectors: &[usize], done: f64) {
        const CLEARING: f64 = 0.25;
        let position = done * sectors.len() as f64;
        for (index, &sector) in sectors.iter().enumerate() {
            let done = (position - index as f64).clamp(0.0, 1.0);
            let first = sector * SECTOR;
            self.note_change(first..first + SECTOR);
            for at in first..first + SECTOR {
                let share = if done < CLEARING { done / CLEARING } else { 1.0 };
                let set = ((done - CLEARING) / (1.0 - CLEARING)).max(0.0);
                let byte = &mut self.array[at];
                for bit in 0..8 {
                    if chance(at, bit, share) {
                        *byte &= !(1 << bit);
                    }
                    if chance(at, bit + 8, set) {
                        *byte |= 1 << bit;
                    }
                }
            }
        }
    }
}

/// True for the given share of all (at, salt); always the same for the same arguments.
fn chance(at: usize, salt: u32, share: f64) -> bool {
    let mut hash = TraceHash::default();
    hash.update(&(at as u64).to_be_bytes());
    hash.update(&salt.to_be_bytes());
    // The hash's high bits hardly depend on the last byte; this spreads it (2^64 / golden ratio).
    let spread = (hash.value() ^ hash.value() >> 32).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((spread >> 32) as f64) < share * 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE: Ps = 100 * NS;

    /// A bus master that keeps every time.
    struct Bench {
        flash: Flash,
        now: Ps,
    }

    impl Bench {
        fn new() -> Self {
            Self { flash: Flash::erased(), now: 0 }
        }

        fn pins(&mut self, address: u32, ce: bool, oe: bool, we: bool, data: u8, stable: Ps) {
            self.flash.set_pins(self.now, Pins { address, ce, oe, we }, (data, stable));
        }

        fn read(&mut self, address: u32) -> u8 {
            self.pins(address, false, false, true, 0xFF, 0);
            self.now += CYCLE;
            let (value, _) = self.flash.output(self.now);
            self.pins(address, true, true, true, value, 0);
            self.now += CYCLE;
            value
        }

        fn write(&mut self, address: u32, data: u8) {
            self.write_with(address, data, CYCLE, CYCLE);
        }

        fn write_with(&mut self, address: u32, data: u8, pulse: Ps, stable: Ps) {
            self.pins(address, false, true, false, data, self.now);
            self.now += pulse;
            self.pins(address, true, true, true, data, self.now - stable);
            self.now += CYCLE;
        }

        fn unlock(&mut self, command: u8) {
            self.write(0xAAA, 0xAA);
            self.write(0x555, 0x55);
            self.write(0xAAA, command);
        }

        fn program(&mut self, address: u32, data: u8) {
            self.unlock(0xA0);
            self.write(address, data);
        }

        fn erase(&mut self, address: u32) {
            self.unlock(0x80);
            self.write(0xAAA, 0xAA);
            self.write(0x555, 0x55);
            self.write(address, 0x30);
        }

        fn wait(&mut self) {
            self.now = self.flash.next_event().expect("it is busy");
            assert!(self.flash.ready(self.now));
        }
    }

    #[test]
    fn data_is_valid_when_the_access_time_has_passed() {
        let mut flash = Flash::erased();
        flash.array[5] = 0x12;
        let pins = Pins { address: 5, ce: false, oe: false, we: true };
        flash.set_pins(1_000 * NS, pins, (0xFF, 0));
        assert_eq!(flash.output(1_010 * NS), (0x12, 1_070 * NS));
        flash.set_pins(1_100 * NS, Pins { address: 4, ..pins }, (0xFF, 0));
        assert_eq!(flash.output(1_300 * NS), (0xFF, 1_170 * NS));
        flash.set_pins(1_400 * NS, Pins { oe: true, address: 4, ..pins }, (0xFF, 0));
        assert!(!flash.drives());
        flash.set_pins(1_500 * NS, Pins { address: 4, ..pins }, (0xFF, 0));
        assert_eq!(flash.output(1_600 * NS), (0xFF, 1_530 * NS), "OE# is faster than CE#");
    }

    #[test]
    fn cfi_and_autoselect_name_the_chip() {
        let mut bench = Bench::new();
        bench.write(0xAA, 0x98);
        assert_eq!([0x20, 0x22, 0x24].map(|at| bench.read(at)), *b"QRY");
        assert_eq!(bench.read(0x26), 2, "AMD command set");
        assert_eq!(bench.read(0x4E), 24, "2^24 bytes");
        assert_eq!([0x5A, 0x5C, 0x5E, 0x60].map(|at| bench.read(at)), [0xFF, 0, 0, 1]);
        assert_eq!([0x80, 0x82, 0x84].map(|at| bench.read(at)), *b"PRI");
        bench.write(0, 0xF0);
        assert_eq!(bench.read(0x20), 0xFF);
        bench.unlock(0x90);
        assert_eq!([0x00, 0x02, 0x1C, 0x1E].map(|at| bench.read(at)), [0x20, 0x7E, 0x12, 0x8A]);
        bench.write(0, 0xF0);
        assert_eq!(bench.read(0), 0xFF);
        assert_eq!(bench.flash.diagnostics().list(), []);
    }

    #[test]
    fn programming_takes_its_time_and_shows_status() {
        let mut bench = Bench::new();
        bench.program(0x12_3456, 0x5A);
        assert!(!bench.flash.ready(bench.now));
        let [first, second] = [bench.read(0x12_3456), bench.read(0x12_3456)];
        assert_eq!(first & 0x80, 0x80, "DQ7 is the complement of the data");
        assert_eq!((first ^ second) & 0x40, 0x40, "DQ6 toggles");
        assert_eq!(first & 0x20, 0);
        bench.wait();
        assert_eq!(bench.read(0x12_3456), 0x5A);
        assert_eq!(bench.flash.image()[0x12_3456], 0x5A);
    }

    #[test]
    fn programming_only_clears_bits_and_says_so() {
        let mut bench = Bench::new();
        bench.program(7, 0xF0);
        bench.wait();
        bench.program(7, 0x3C);
        bench.wait();
        let status = [bench.read(7), bench.read(7)];
        assert_eq!(status[0] & 0x20, 0x20, "DQ5");
        assert_eq!((status[0] ^ status[1]) & 0x40, 0x40);
        bench.write(0, 0xF0);
        assert_eq!(bench.read(7), 0x30);
        assert_eq!(bench.flash.diagnostics().count(Violation::ProgramNeedsErase), 1);
    }

    #[test]
    fn unlock_bypass_needs_two_writes_a_byte() {
        let mut bench = Bench::new();
        bench.unlock(0x20);
        for (at, value) in [(100, 1), (101, 2)] {
            bench.write(0, 0xA0);
            bench.write(at, value);
            bench.wait();
        }
        bench.write(0, 0x90);
        bench.write(0, 0x00);
        assert_eq!([bench.read(100), bench.read(101)], [1, 2]);
        bench.write(0, 0xA0);
        bench.write(102, 3);
        assert_eq!(bench.read(102), 0xFF, "bypass is over");
    }

    fn fill(bench: &mut Bench, first: u32, values: &[u8]) {
        bench.unlock(0x25);
        // The last unlock cycle's address is the sector's; these tests stay in sector 0.
        bench.write(first, values.len() as u8 - 1);
        for (at, &value) in (first..).zip(values) {
            bench.write(at, value);
        }
    }

    #[test]
    fn the_write_buffer_programs_up_to_a_page_at_once() {
        let mut bench = Bench::new();
        let values: Vec<u8> = (0xC0..=0xFF).collect();
        fill(&mut bench, 0x1000, &values);
        assert!(bench.flash.ready(bench.now), "until it is confirmed");
        bench.write(0x1000, 0x29);
        assert_eq!(bench.read(0x103F) & 0x80, 0, "DQ7 is the complement of the last byte's");
        bench.wait();
        assert_eq!(bench.flash.image()[0x1000..0x1040], values);
        assert_eq!(bench.read(0x1001), 0xC1);
        assert_eq!(bench.flash.diagnostics().list(), []);
    }

    #[test]
    fn a_write_buffer_that_is_misused_aborts_and_has_its_own_reset() {
        type Misuse = fn(&mut Bench);
        let misuses: [Misuse; 3] = [
            |bench| fill(bench, 0x1000, &[0; BUFFER + 1]),
            |bench| fill(bench, 0x103F, &[0; 2]),
            |bench| {
                fill(bench, 0x1000, &[0; 2]);
                bench.write(0x1000, 0x28);
            },
        ];
        for misuse in misuses {
            let mut bench = Bench::new();
            misuse(&mut bench);
            assert_eq!(bench.read(0x1000) & 0x22, 0x02, "DQ1 but not DQ5");
            bench.write(0, 0xF0);
            assert_eq!(bench.read(0x1000) & 0x22, 0x02, "the plain reset is not enough");
            bench.unlock(0xF0);
            assert_eq!(bench.read(0x1000), 0xFF);
            assert_eq!(bench.flash.diagnostics().count(Violation::BufferAbort), 1);
        }
    }

    #[test]
    fn erase_takes_sectors_together_and_sets_all_their_bits() {
        let mut bench = Bench::new();
        for at in [0x1_0000, 0x1_FFFF, 0x2_0000, 0x3_0000] {
            bench.program(at, 0);
            bench.wait();
        }
        bench.erase(0x1_1234);
        assert_eq!(bench.read(0x1_0000) & 0x88, 0, "DQ7 low, window open");
        bench.write(0x3_0000, 0x30);
        bench.now += ERASE_WINDOW_PS;
        let [first, second] = [bench.read(0x1_0000), bench.read(0x1_0000)];
        assert_eq!(first & 0x88, 0x08, "DQ3: no more sectors");
        assert_eq!((first ^ second) & 0x44, 0x44, "DQ6 and DQ2 toggle");
        bench.write(0x2_0000, 0x30);
        let begin = bench.now;
        bench.wait();
        assert!(bench.now - begin > 2 * SECTOR_ERASE_PS - MS);
        let read = [0x1_0000, 0x1_FFFF, 0x2_0000, 0x3_0000].map(|at| bench.read(at));
        assert_eq!(read, [0xFF, 0xFF, 0x00, 0xFF]);
    }

    #[test]
    fn writes_that_break_a_time_are_lost_and_listed() {
        let mut bench = Bench::new();
        bench.unlock(0xA0);
        bench.write_with(3, 0, WRITE_PULSE_PS - 1, WRITE_PULSE_PS - 1);
        assert!(bench.flash.ready(bench.now));
        bench.write_with(3, 0, CYCLE, WRITE_DATA_PS - 1);
        assert!(bench.flash.ready(bench.now));
        assert_eq!(bench.flash.diagnostics().count(Violation::WritePulse), 1);
        assert_eq!(bench.flash.diagnostics().count(Violation::WriteData), 1);
        bench.write_with(3, 0, WRITE_PULSE_PS, WRITE_DATA_PS);
        assert!(!bench.flash.ready(bench.now));
    }

    #[test]
    fn an_unknown_command_is_listed() {
        let mut bench = Bench::new();
        bench.write(0x100, 0xB0);
        bench.unlock(0x77);
        assert_eq!(bench.flash.diagnostics().count(Violation::Command(0xB0)), 1);
        assert_eq!(bench.flash.diagnostics().count(Violation::Command(0x77)), 1);
    }

    #[test]
    fn a_power_cut_leaves_a_byte_between_old_and_new() {
        let mut seen = [false; 256];
        for step in 0..=10 {
            let mut bench = Bench::new();
            bench.program(9, 0x00);
            let begin = bench.now - CYCLE;
            bench.flash.power_off(begin + PROGRAM_PS * step / 10);
            seen[usize::from(bench.flash.image()[9])] = true;
            assert_eq!(bench.read(8), 0xFF, "its neighbours stay");
        }
        assert!(seen[0xFF] && seen[0x00]);
        assert!(seen.iter().filter(|&&value| value).count() > 4, "and states between");
    }

    #[test]
    fn a_power_cut_leaves_a_sector_half_erased() {
        let ones = |share: Ps| {
            let mut bench = Bench::new();
            bench.flash.array[SECTOR..2 * SECTOR].fill(0x0F);
            bench.erase(SECTOR as u32);
            let begin = bench.now - CYCLE + ERASE_WINDOW_PS;
            bench.flash.power_off(begin + SECTOR_ERASE_PS / 100 * share);
            assert!(bench.flash.image()[2 * SECTOR..].iter().all(|&byte| byte == 0xFF));
            let sector = &bench.flash.image()[SECTOR..2 * SECTOR];
            sector.iter().map(|byte| byte.count_ones()).sum::<u32>()
        };
        let all = 8 * SECTOR as u32;
        assert_eq!(ones(0), all / 2);
        assert!((all / 5..all / 3).contains(&ones(12)), "half of them cleared: {}", ones(12));
        assert_eq!(ones(25), 0);
        assert!((all / 3..all * 2 / 3).contains(&ones(63)), "{}", ones(63));
        assert_eq!(ones(100), all);
    }

    #[test]
    fn an_image_must_fill_the_chip() {
        assert_eq!(Flash::from_image(&[0; 5]).err(), Some(ImageError { length: 5 }));
        let mut image = vec![0xFF; SIZE];
        image[SIZE - 1] = 7;
        let flash = Flash::from_image(&image).expect("it fits");
        assert_eq!(flash.image(), image);
    }
}
