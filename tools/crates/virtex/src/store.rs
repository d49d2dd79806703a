//! The bitstream store: flash images with up to 32 bitstreams.
//!
//! The layout belongs to `common/link/slots.h`; its codecs are called, not written again.

use common_sys::constants::{
    BANK_COMMIT_AT, BANK_HEADER_AT, BANK_RECORDS_AT, BANK_SIZE, FLASH_SIZE, SLOT_BANKS,
    SLOT_COMMIT_WORD, SLOT_COUNT, SLOT_RECORD_DEFAULT, SLOT_RECORD_FREE, SLOT_RECORD_GOLDEN,
    SLOT_SIZE,
};
use common_sys::link::{
    SLOT_HEADER_SIZE, SLOT_RECORD_SIZE, SlotHeader, crc32, slot_header_decode, slot_header_encode,
    slot_record_decode, slot_record_encode,
};
use thiserror::Error;

use crate::bitstream::{self, Kind, check};
use crate::part::XCV300E;

/// Bytes of a flash image.
pub const IMAGE_SIZE: usize = FLASH_SIZE as usize;
/// Bytes that a name may have.
pub const NAME_MAX: usize = common_sys::constants::SLOT_NAME_SIZE as usize - 1;

/// Why something cannot go into a slot, or be read from an image.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Error {
    /// The file is no whole bitstream.
    #[error(transparent)]
    Bitstream(#[from] bitstream::Error),
    /// For another part.
    #[error("the bitstream is for an {0}, but the turret has an XCV300E")]
    Part(&'static str),
    /// A partial bitstream needs a running design and cannot configure the FPGA from flash.
    #[error("a partial bitstream cannot start the FPGA; a slot needs a full one")]
    Partial,
    /// More than a bank holds.
    #[error("the bitstream has {0} bytes, a slot takes 258048: cut the padding behind it off")]
    TooLong(usize),
    /// No such slot.
    #[error("there is no slot {0}; slots are 0 to 31")]
    Slot(u8),
    /// The image has the wrong size.
    #[error("the flash image has {0} bytes, but the chip has 16777216: make one with pack")]
    ImageSize(usize),
}

/// A bitstream on its way into a slot: checked, and without the header of a `.bit` file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// 0..=31.
    pub slot: u8,
    /// Free text; what does not fit [`NAME_MAX`] bytes is cut.
    pub name: String,
    /// Function code of the bitstream, `FPGA_FUNCTION_*`; 0 if it does not say.
    pub function: u8,
    /// The raw stream.
    pub stream: Vec<u8>,
}

impl Entry {
    /// Check `file`, raw or `.bit`, and take its raw stream.
    ///
    /// # Errors
    /// If it is not a whole, full XCV300E bitstream, or if there is no such slot.
    pub fn from_file(slot: u8, file: &[u8], name: String) -> Result<Self, Error> {
        match Self::of_any_kind(slot, file, name)? {
            (entry, Kind::Full) => Ok(entry),
            (_, Kind::Partial) => Err(Error::Partial),
        }
    }

    /// The same for a bitstream that may be a partial one.
    ///
    /// # Errors
    /// If it is not a whole XCV300E bitstream, or if there is no such slot.
    pub fn of_any_kind(slot: u8, file: &[u8], name: String) -> Result<(Self, Kind), Error> {
        if u32::from(slot) >= SLOT_COUNT {
            return Err(Error::Slot(slot));
        }
        let summary = check(file)?;
        if summary.part != &XCV300E {
            return Err(Error::Part(summary.part.name));
        }
        let function = summary.design.map_or(0, |design| design.function.code());
        let stream = file[summary.offset..summary.offset + summary.length].to_vec();
        if stream.len() > BANK_HEADER_AT as usize {
            return Err(Error::TooLong(stream.len()));
        }
        Ok((Self { slot, name, function, stream }, summary.kind))
    }
}

/// A flash image with `entries` in bank 0 of their slots, of which `default` becomes the default
/// slot. Of several entries for one slot the last stays; a default that no entry fills is not marked.
pub fn pack(entries: &[Entry], default: u8) -> Vec<u8> {
    let mut image = vec![0xFF; IMAGE_SIZE];
    for entry in entries {
        let bank = bank_address(entry.slot, 0);
        let mut put = |at: u32, bytes: &[u8]| {
            let at = bank + at as usize;
            image[at..at + bytes.len()].copy_from_slice(bytes);
        };
        put(0, &entry.stream);
        put(BANK_HEADER_AT, &slot_header_encode(&header(entry)));
        put(BANK_COMMIT_AT, &SLOT_COMMIT_WORD.to_be_bytes());
        if entry.slot == default {
            put(BANK_RECORDS_AT, &slot_record_encode(SLOT_RECORD_DEFAULT as u8, 1));
        }
    }
    image
}

/// The header that goes with an entry, generation 1.
#[must_use]
pub fn header(entry: &Entry) -> SlotHeader {
    let mut header = SlotHeader {
        function: entry.function,
        length: entry.stream.len() as u32,
        crc32: crc32(&entry.stream),
        generation: 1,
        ..SlotHeader::default()
    };
    put_text(&mut header.part, XCV300E.bit_name);
    put_text(&mut header.name, &entry.name);
    header
}

/// NUL-padded and NUL-terminated, cut between characters.
fn put_text(field: &mut [core::ffi::c_char], text: &str) {
    let mut length = text.len().min(field.len() - 1);
    while !text.is_char_boundary(length) {
        length -= 1;
    }
    for (place, byte) in field.iter_mut().zip(text[..length].bytes()) {
        *place = byte as core::ffi::c_char;
    }
}

fn get_text(field: &[core::ffi::c_char]) -> String {
    let bytes: Vec<u8> = field.iter().map(|&c| c as u8).take_while(|&byte| byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

fn bank_address(slot: u8, bank: u32) -> usize {
    usize::from(slot) * SLOT_SIZE as usize + (bank * BANK_SIZE) as usize
}

/// How a slot stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Both banks' headers are erased.
    Empty,
    /// Something is there, but neither bank has a whole header and its commit word: a write was cut
    /// off, or the header is damaged.
    Unfinished,
    /// The bitstream is as it was written.
    Whole,
    /// The header is whole, but the bitstream does not match its CRC-32.
    Damaged,
}

/// A slot with something in it, or without.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slot {
    /// 0..=31.
    pub slot: u8,
    /// How it stands.
    pub state: State,
    /// The bank that counts; 0 if none does.
    pub bank: u32,
    /// Function code of the bitstream, `FPGA_FUNCTION_*`.
    pub function: u8,
    /// Bytes of the bitstream.
    pub length: u32,
    /// Counts up with every write.
    pub generation: u32,
    /// Part, e.g. `v300ecs144`.
    pub part: String,
    /// Free text.
    pub name: String,
    /// The FPGA starts from this slot, if it holds a whole bitstream: a mark outlives its bitstream.
    pub default: bool,
    /// The slot to fall back to.
    pub golden: bool,
}

/// All 32 slots of a flash image, as the firmware sees them.
///
/// # Errors
/// If the image has the wrong size.
pub fn scan(image: &[u8]) -> Result<Vec<Slot>, Error> {
    if image.len() != IMAGE_SIZE {
        return Err(Error::ImageSize(image.len()));
    }
    let mut newest = [None; 2];
    let mut slots = Vec::new();
    for slot in 0..SLOT_COUNT as u8 {
        for bank in 0..SLOT_BANKS {
            let marks = records(image, bank_address(slot, bank));
            for (newest, sequence) in newest.iter_mut().zip(marks) {
                // The first of two equal ones stays.
                if let Some(sequence) = sequence
                    && newest.is_none_or(|(known, _)| sequence > known)
                {
                    *newest = Some((sequence, slot));
                }
            }
        }
        slots.push(describe(image, slot));
    }
    let [default, golden] = newest.map(|mark| mark.map(|(_, slot)| slot));
    for slot in &mut slots {
        slot.default = default == Some(slot.slot);
        slot.golden = golden == Some(slot.slot);
    }
    Ok(slots)
}

/// Bytes from a bank's header up to its records: they tell how the bank stands.
pub const TAIL_SIZE: usize = (BANK_RECORDS_AT - BANK_HEADER_AT) as usize;

/// The bank that counts: whole header, commit word, highest generation.
fn find_bank(tails: [&[u8; TAIL_SIZE]; SLOT_BANKS as usize]) -> Option<(u32, SlotHeader)> {
    let whole = |(bank, tail): (u32, &[u8; TAIL_SIZE])| {
        let (wire, rest) = tail.split_first_chunk::<SLOT_HEADER_SIZE>()?;
        if !rest.starts_with(&SLOT_COMMIT_WORD.to_be_bytes()) {
            return None;
        }
        slot_header_decode(wire).ok().map(|header| (bank, header))
    };
    let banks = (0..).zip(tails).filter_map(whole);
    banks.reduce(|best, next| if next.1.generation > best.1.generation { next } else { best })
}

/// Highest sequence numbers of the DEFAULT and GOLDEN records of a bank.
fn records(image: &[u8], bank: usize) -> [Option<u32>; 2] {
    let area = &image[bank + BANK_RECORDS_AT as usize..bank + BANK_SIZE as usize];
    let mut newest = [None; 2];
    for wire in area.as_chunks::<SLOT_RECORD_SIZE>().0 {
        let (kind, sequence) = slot_record_decode(wire);
        let mark = match u32::from(kind) {
            SLOT_RECORD_FREE => break,
            SLOT_RECORD_DEFAULT => &mut newest[0],
            SLOT_RECORD_GOLDEN => &mut newest[1],
            _ => continue,
        };
        *mark = (*mark).max(Some(sequence));
    }
    newest
}

fn tail_of(image: &[u8], slot: u8, bank: u32) -> &[u8; TAIL_SIZE] {
    let tail = &image[bank_address(slot, bank) + BANK_HEADER_AT as usize..];
    tail.first_chunk().expect("a tail lies within its bank")
}

fn describe(image: &[u8], number: u8) -> Slot {
    let (mut slot, header) = slot_of(number, [0, 1].map(|bank| tail_of(image, number, bank)));
    if let Some(header) = header {
        let stream = &image[bank_address(number, slot.bank)..][..header.length as usize];
        if crc32(stream) != header.crc32 {
            slot.state = State::Damaged;
        }
    }
    slot
}

/// How slot `number` stands as its banks' `tails` tell it, and the header of the bank that counts. A
/// bitstream is believed to be whole without having been looked at, and marks are not told.
#[must_use]
pub fn slot_of(
    number: u8,
    tails: [&[u8; TAIL_SIZE]; SLOT_BANKS as usize],
) -> (Slot, Option<SlotHeader>) {
    let found = find_bank(tails);
    let erased = tails.iter().all(|tail| tail.iter().all(|&byte| byte == 0xFF));
    let (bank, header) = found.unwrap_or_default();
    let slot = Slot {
        slot: number,
        state: match (found, erased) {
            (Some(_), _) => State::Whole,
            (None, true) => State::Empty,
            (None, false) => State::Unfinished,
        },
        bank,
        function: header.function,
        length: header.length,
        generation: header.generation,
        part: get_text(&header.part),
        name: get_text(&header.name),
        default: false,
        golden: false,
    };
    (slot, found.map(|(_, header)| header))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bitstream::{BitHeader, Options, XCV300E_BYTES, make, make_partial, write_bit};
    use crate::design::Function;
    use crate::part::XCV50E;

    fn entry(slot: u8, function: Function) -> Entry {
        let file = make(function, &Options::default());
        Entry::from_file(slot, &file, function.name().to_owned()).expect("it is whole")
    }

    fn two_slots() -> Vec<u8> {
        pack(&[entry(0, Function::Soccer), entry(31, Function::Capture)], 31)
    }

    #[test]
    fn what_is_packed_is_found() {
        let slots = scan(&two_slots()).expect("it has the right size");
        assert_eq!(slots.len(), 32);
        assert!(slots[1..31].iter().all(|slot| slot.state == State::Empty));
        let [soccer, capture] = [&slots[0], &slots[31]];
        assert_eq!((soccer.state, capture.state), (State::Whole, State::Whole));
        assert_eq!((soccer.name.as_str(), capture.function), ("soccer", 2));
        assert_eq!(soccer.length as usize, XCV300E_BYTES);
        assert_eq!(soccer.part, "v300ecs144");
        assert!(capture.default && !soccer.default && !capture.golden);
    }

    #[test]
    fn a_bit_file_loses_its_header() {
        let raw = make(Function::Soccer, &Options::default());
        let header = BitHeader {
            design: "a.ncd".to_owned(),
            part: "v300ecs144".to_owned(),
            date: "2005/07/01".to_owned(),
            time: "12:00:00".to_owned(),
        };
        let entry = Entry::from_file(3, &write_bit(&header, &raw), "a".to_owned());
        assert_eq!(entry.expect("it is whole").stream, raw);
    }

    #[test]
    fn damage_is_seen_and_an_unfinished_write_does_not_count() {
        let mut image = two_slots();
        image[12_345] ^= 1;
        let soccer = &scan(&image).expect("right size")[0];
        assert_eq!(soccer.state, State::Damaged);
        let commit = bank_address(31, 0) + BANK_COMMIT_AT as usize;
        image[commit] = 0xFF;
        let capture = &scan(&image).expect("right size")[31];
        assert_eq!(capture.state, State::Unfinished);
        assert!(capture.default, "the firmware says then that its default slot is bad");
    }

    #[test]
    fn the_newer_bank_counts() {
        let mut image = two_slots();
        let bank = bank_address(31, 1);
        let old = bank_address(31, 0);
        image.copy_within(old..old + BANK_RECORDS_AT as usize, bank);
        let mut header = header(&entry(31, Function::Soccer));
        header.generation = 2;
        let at = bank + BANK_HEADER_AT as usize;
        image[at..at + SLOT_HEADER_SIZE].copy_from_slice(&slot_header_encode(&header));
        let slot = scan(&image).expect("right size").remove(31);
        assert_eq!((slot.bank, slot.generation), (1, 2));
        assert_eq!(slot.state, State::Damaged, "header of soccer, data of capture");
        assert!(slot.default, "marked in the older bank");
    }

    #[test]
    fn the_newest_record_wins_and_a_damaged_one_is_skipped() {
        let mut image = two_slots();
        let mut append = |slot, place: usize, record: [u8; SLOT_RECORD_SIZE]| {
            let at = bank_address(slot, 0) + BANK_RECORDS_AT as usize + place * SLOT_RECORD_SIZE;
            image[at..at + SLOT_RECORD_SIZE].copy_from_slice(&record);
        };
        append(0, 0, slot_record_encode(SLOT_RECORD_DEFAULT as u8, 2));
        let mut damaged = slot_record_encode(SLOT_RECORD_DEFAULT as u8, 9);
        damaged[2] ^= 1;
        append(31, 1, damaged);
        append(31, 2, slot_record_encode(SLOT_RECORD_GOLDEN as u8, 1));
        let slots = scan(&image).expect("right size");
        assert!(slots[0].default && !slots[31].default && slots[31].golden);
    }

    #[test]
    fn only_full_streams_of_the_right_part_go_into_existing_slots() {
        let options = Options::default();
        let refused = |slot, file: &[u8]| Entry::from_file(slot, file, String::new()).err();
        let soccer = make(Function::Soccer, &options);
        assert_eq!(refused(32, &soccer), Some(Error::Slot(32)));
        assert_eq!(refused(0, &make_partial(Function::Soccer, &options)), Some(Error::Partial));
        let small = make(Function::Soccer, &Options { part: &XCV50E, ..options });
        assert_eq!(refused(0, &small), Some(Error::Part("XCV50E")));
        assert!(matches!(refused(0, &soccer[..1_000]), Some(Error::Bitstream(_))));
        let padded = [soccer, vec![0; 30_000]].concat();
        assert_eq!(refused(0, &padded), Some(Error::TooLong(XCV300E_BYTES + 30_000)));
        assert_eq!(scan(&[0; 7]), Err(Error::ImageSize(7)));
    }

    #[test]
    fn a_long_name_is_cut_between_characters() {
        let mut long = entry(0, Function::Soccer);
        long.name = "ä".repeat(20);
        let slots = scan(&pack(&[long], 0)).expect("right size");
        assert_eq!(slots[0].name, "ä".repeat(NAME_MAX / 2));
    }
}
