//! A program for the base, as it shall lie in RAM.

use common_sys::constants as c;
use common_sys::link::crc32;
use common_sys::loader::{BASE_IMAGE_HEADER_SIZE, BaseImage, base_image_decode};
use khepera::image::{self, ImageError, Segment};

/// A program that the loader can take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Program {
    /// Address of its first byte, even.
    pub load: u32,
    /// Where it starts.
    pub entry: u32,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Its build id, or zeros.
    pub build: [u8; BUILD_SIZE],
}

/// Bytes of a build id.
pub const BUILD_SIZE: usize = c::BASE_IMAGE_BUILD_SIZE as usize;
const FIRST: u64 = c::BOARD_PROGRAM_BASE as u64;
const END: u64 = c::BOARD_PROGRAM_END as u64;
const BANK: u64 = c::BOARD_IMAGE_A as u64;
const BANK_SIZE: u64 = c::BOARD_IMAGE_BANK_SIZE as u64;
/// The longest program.
const LENGTH_MAX: u64 = BANK_SIZE - c::BASE_IMAGE_PROGRAM_AT as u64;

/// Why a file cannot be flashed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProgramError {
    /// Not an image at all.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It lies where no program may.
    #[error(
        "the file has {len} bytes at {address:#x}, but the loader takes programs for RAM \
         {FIRST:#x}..{END:#x}; link it there, or give khepera-firmware.elf or .s37"
    )]
    Elsewhere {
        /// First address of the piece.
        address: u64,
        /// Its length.
        len: usize,
    },
    /// Too long for a bank.
    #[error("the program takes {len} bytes, a bank holds {LENGTH_MAX}; make it smaller")]
    TooLong {
        /// Bytes.
        len: u64,
    },
    /// No usable entry point.
    #[error(
        "the program starts at {0:#x}, which is odd or not in it; give the linker an entry symbol"
    )]
    Entry(u64),
    /// The file's own check sum is wrong.
    #[error("the image in the file does not have the check sum its header says; build it again")]
    Damaged,
}

impl Program {
    /// The program in an ELF file or in S-records: either our firmware's file, which holds the image as
    /// it lies in a bank, or one that is linked for RAM.
    ///
    /// # Errors
    /// See [`ProgramError`].
    pub fn from_file(file: &[u8]) -> Result<Self, ProgramError> {
        let parsed = image::parse(file)?;
        let in_bank = |segment: &Segment| (BANK..BANK + BANK_SIZE).contains(&segment.address);
        if parsed.segments.iter().any(in_bank) {
            let bank = span(&parsed.segments, BANK, BANK + BANK_SIZE);
            return Self::from_bank(&bank);
        }
        Self::for_ram(&parsed)
    }

    fn from_bank(bank: &[u8]) -> Result<Self, ProgramError> {
        let header = bank.first_chunk::<BASE_IMAGE_HEADER_SIZE>().ok_or(ProgramError::Damaged)?;
        let header: BaseImage = base_image_decode(header).ok_or(ProgramError::Damaged)?;
        let start = c::BASE_IMAGE_PROGRAM_AT as usize;
        let end = start.saturating_add(header.length as usize);
        let bytes = bank.get(start..end).ok_or(ProgramError::Damaged)?.to_vec();
        if crc32(&bytes) != header.crc32 {
            return Err(ProgramError::Damaged);
        }
        let (load, entry, build) = (header.load, header.entry, header.build);
        Self { load, entry, bytes, build }.checked()
    }

    fn for_ram(parsed: &image::Image) -> Result<Self, ProgramError> {
        for segment in &parsed.segments {
            let end = segment.address.saturating_add(segment.data.len() as u64);
            if segment.address < FIRST || end > END {
                let (address, len) = (segment.address, segment.data.len());
                return Err(ProgramError::Elsewhere { address, len });
            }
        }
        let first = parsed.segments.iter().map(|s| s.address).min().unwrap_or(FIRST) & !1;
        let bytes = span(&parsed.segments, first, END);
        let entry = parsed.entry.unwrap_or(first);
        let entry = u32::try_from(entry).map_err(|_| ProgramError::Entry(entry))?;
        Self { load: first as u32, entry, bytes, build: [0; BUILD_SIZE] }.checked()
    }

    fn checked(self) -> Result<Self, ProgramError> {
        let len = self.bytes.len() as u64;
        if len > LENGTH_MAX {
            return Err(ProgramError::TooLong { len });
        }
        let inside = self.entry.checked_sub(self.load).is_some_and(|at| u64::from(at) < len);
        if !self.entry.is_multiple_of(2) || !inside {
            return Err(ProgramError::Entry(self.entry.into()));
        }
        Ok(self)
    }

    /// Its CRC-32.
    pub fn crc32(&self) -> u32 {
        crc32(&self.bytes)
    }
}

/// The bytes from `first` up to the last one that a segment has before `end`; gaps as erased flash.
fn span(segments: &[Segment], first: u64, end: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    for segment in segments.iter().filter(|s| (first..end).contains(&s.address)) {
        let at = (segment.address - first) as usize;
        let len = segment.data.len().min((end - segment.address) as usize);
        if bytes.len() < at + len {
            bytes.resize(at + len, 0xFF);
        }
        bytes[at..at + len].copy_from_slice(&segment.data[..len]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An S3 record.
    fn record(address: u32, data: &[u8]) -> String {
        let mut bytes = vec![data.len() as u8 + 5];
        bytes.extend(address.to_be_bytes());
        bytes.extend(data);
        let sum = bytes.iter().fold(0u8, |sum, &b| sum.wrapping_add(b));
        bytes.push(!sum);
        let digits: String = bytes.iter().map(|b| format!("{b:02X}")).collect();
        format!("S3{digits}\n")
    }

    #[test]
    fn a_program_linked_for_ram_is_taken_as_it_lies_there() {
        let file = record(0x10_2804, &[3, 4]) + &record(0x10_2800, &[1, 2]) + "S70500102800C2\n";
        let program = Program::from_file(file.as_bytes()).expect("a program");
        assert_eq!((program.load, program.entry), (0x10_2800, 0x10_2800));
        assert_eq!(program.bytes, [1, 2, 0xFF, 0xFF, 3, 4]);
    }

    #[test]
    fn programs_for_elsewhere_are_refused_by_their_address() {
        let file = record(0x17_8000, &[1, 2]);
        let error = Program::from_file(file.as_bytes()).expect_err("the loader's own RAM");
        assert_eq!(error, ProgramError::Elsewhere { address: 0x17_8000, len: 2 });
        let file = record(0x10_2800, &[1, 2]) + "S70500102803BF\n";
        let error = Program::from_file(file.as_bytes()).expect_err("an odd entry");
        assert_eq!(error, ProgramError::Entry(0x10_2803));
    }

    #[test]
    fn a_bank_without_a_good_header_is_refused() {
        let file = record(0x1_0000, &[0; 80]);
        assert_eq!(Program::from_file(file.as_bytes()), Err(ProgramError::Damaged));
    }
}
