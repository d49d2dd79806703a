//! Firmware images: ELF32 for the m68k, and Motorola S-records.

use common_sys::constants as board;
use object::elf;
use object::read::elf::{FileHeader, ProgramHeader};
use object::{BigEndian, endian::Endianness};

const FLASH_BASE: u64 = board::BOARD_FLASH_BASE as u64;
const FLASH_SIZE: usize = board::BOARD_FLASH_SIZE as usize;

/// Why an image cannot be put into the base's flash.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// Neither of the formats known.
    #[error(
        "the image is neither an ELF file nor S-records, and its first eight bytes are no stack and \
         program counter; give khepera-firmware.elf or .s37"
    )]
    UnknownFormat,
    /// A damaged ELF file.
    #[error("the ELF file is damaged ({0}); build it again")]
    DamagedElf(String),
    /// An ELF file for something else.
    #[error("the ELF file is not for a big-endian 32-bit 68000-family CPU; build it with m68k gcc")]
    WrongMachine,
    /// An S-record file with a bad line.
    #[error("line {line} of the S-record file: {what}; build or copy the file again")]
    BadRecord {
        /// Line number, from 1.
        line: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Contents that no flash cell exists for.
    #[error(
        "the image has {len} bytes at {address:#x}, outside the flash \
         ({FLASH_BASE:#x}..{:#x}); check the linker script", FLASH_BASE + FLASH_SIZE as u64
    )]
    OutsideFlash {
        /// First address of the piece.
        address: u64,
        /// Its length in bytes.
        len: usize,
    },
    /// Not the contents of a whole flash.
    #[error(
        "{len} bytes are not the contents of the flash, which has {FLASH_SIZE}; give what was saved"
    )]
    NotTheFlash {
        /// Bytes given.
        len: usize,
    },
    /// Nothing to run.
    #[error("the image has no contents for the flash; check how it was linked")]
    Empty,
}

/// Bytes that belong at an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Of the first byte; physical, so that initialised data is where it is loaded from.
    pub address: u64,
    /// The bytes.
    pub data: Vec<u8>,
}

/// What an image file holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Image {
    /// In the order of the file, none of them empty.
    pub segments: Vec<Segment>,
    /// Where the program starts, if the file says so.
    pub entry: Option<u64>,
}

/// Read an ELF file or S-records.
///
/// # Errors
/// See [`ImageError`].
pub fn parse(image: &[u8]) -> Result<Image, ImageError> {
    let parsed = if image.starts_with(&elf::ELFMAG) {
        parse_elf(image)?
    } else if image.starts_with(b"S") {
        parse_srec(image)?
    } else {
        return Err(ImageError::UnknownFormat);
    };
    if parsed.segments.is_empty() { Err(ImageError::Empty) } else { Ok(parsed) }
}

/// The whole flash with `image` in it; cells that the image leaves out are erased (0xFF).
pub(crate) fn load(image: &[u8]) -> Result<Vec<u8>, ImageError> {
    let mut flash = vec![0xFF; FLASH_SIZE];
    match parse(image) {
        Ok(parsed) => {
            for segment in &parsed.segments {
                put(&mut flash, segment.address, &segment.data)?;
            }
        }
        Err(ImageError::UnknownFormat) if has_vectors(image) => put(&mut flash, FLASH_BASE, image)?,
        Err(error) => return Err(error),
    }
    Ok(flash)
}

/// Whether raw bytes begin as the flash of a 68331 does: with a stack pointer and the address of code
/// in the flash, both even.
fn has_vectors(image: &[u8]) -> bool {
    let long = |at: usize| {
        let bytes = image.get(at..at + 4)?.try_into().ok()?;
        Some(u64::from(u32::from_be_bytes(bytes)))
    };
    let (Some(stack), Some(start)) = (long(0), long(4)) else { return false };
    let inside = (FLASH_BASE + 8..FLASH_BASE + image.len() as u64).contains(&start);
    stack.is_multiple_of(2) && start.is_multiple_of(2) && inside && stack <= 1 << 24
}

fn put(flash: &mut [u8], address: u64, data: &[u8]) -> Result<(), ImageError> {
    let outside = || ImageError::OutsideFlash { address, len: data.len() };
    let start = address.checked_sub(FLASH_BASE).ok_or_else(outside)?;
    let start = usize::try_from(start).map_err(|_| outside())?;
    let end = start.checked_add(data.len()).ok_or_else(outside)?;
    flash.get_mut(start..end).ok_or_else(outside)?.copy_from_slice(data);
    Ok(())
}

/// Loads by physical address: initialised data lies in flash and is copied by the start-up code.
fn parse_elf(image: &[u8]) -> Result<Image, ImageError> {
    // A 64-bit file is not a damaged 32-bit one.
    if image.get(elf::ELFMAG.len()).is_some_and(|&class| class != elf::ELFCLASS32.0) {
        return Err(ImageError::WrongMachine);
    }
    let damaged = |e: object::read::Error| ImageError::DamagedElf(e.to_string());
    let header = elf::FileHeader32::<Endianness>::parse(image).map_err(damaged)?;
    let endian = header.endian().map_err(damaged)?;
    if endian != Endianness::Big || header.e_machine(endian) != elf::EM_68K {
        return Err(ImageError::WrongMachine);
    }
    let header = elf::FileHeader32::<BigEndian>::parse(image).map_err(damaged)?;
    let entry = Some(u64::from(header.e_entry(BigEndian)));
    let mut segments = Vec::new();
    for segment in header.program_headers(BigEndian, image).map_err(damaged)? {
        if segment.p_type(BigEndian) != elf::PT_LOAD || segment.p_filesz(BigEndian) == 0 {
            continue;
        }
        let data = segment
            .data(BigEndian, image)
            .map_err(|()| ImageError::DamagedElf("a segment lies outside the file".to_string()))?;
        let address = u64::from(segment.p_paddr(BigEndian));
        segments.push(Segment { address, data: data.to_vec() });
    }
    Ok(Image { segments, entry })
}

fn parse_srec(image: &[u8]) -> Result<Image, ImageError> {
    let mut parsed = Image::default();
    for (index, line) in image.split(|&b| b == b'\n').enumerate() {
        let line = line.trim_ascii();
        if line.is_empty() {
            continue;
        }
        let bad = |what| ImageError::BadRecord { line: index + 1, what };
        let (kind, bytes) = record(line).map_err(bad)?;
        let address_bytes = match kind {
            b'1' => 2,
            b'2' => 3,
            b'3' => 4,
            b'0' | b'5' => continue,
            b'7' | b'8' | b'9' => {
                parsed.entry = Some(bytes.iter().fold(0, |a, &b| a << 8 | u64::from(b)));
                continue;
            }
            _ => return Err(bad("unknown type of record")),
        };
        let (address, data) =
            bytes.split_at_checked(address_bytes).ok_or_else(|| bad("no room for an address"))?;
        let address = address.iter().fold(0, |a, &b| a << 8 | u64::from(b));
        append(&mut parsed.segments, address, data);
    }
    Ok(parsed)
}

/// Records that follow each other become one segment.
fn append(segments: &mut Vec<Segment>, address: u64, data: &[u8]) {
    match segments.last_mut() {
        _ if data.is_empty() => {}
        Some(last) if last.address + last.data.len() as u64 == address => {
            last.data.extend_from_slice(data);
        }
        _ => segments.push(Segment { address, data: data.to_vec() }),
    }
}

/// Type and bytes (address and data) of one S-record whose length and checksum are right.
fn record(line: &[u8]) -> Result<(u8, Vec<u8>), &'static str> {
    let [b'S', kind, digits @ ..] = line else { return Err("not an S-record") };
    if digits.len() % 2 != 0 {
        return Err("odd number of hexadecimal digits");
    }
    let mut bytes = Vec::with_capacity(digits.len() / 2);
    for pair in digits.chunks_exact(2) {
        let digit = |c: u8| (c as char).to_digit(16);
        match (digit(pair[0]), digit(pair[1])) {
            (Some(hi), Some(lo)) => bytes.push((hi << 4 | lo) as u8),
            _ => return Err("not a hexadecimal digit"),
        }
    }
    if bytes.len() < 2 || usize::from(bytes[0]) != bytes.len() - 1 {
        return Err("the length does not match the line");
    }
    if bytes.iter().fold(0u8, |sum, &b| sum.wrapping_add(b)) != 0xFF {
        return Err("wrong checksum");
    }
    bytes.pop();
    bytes.remove(0);
    Ok((*kind, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn s37_lands_at_its_address_and_the_rest_is_erased() {
        let flash = load(b"S00600004844521B\r\nS30900000010112233443C\r\nS70500000000FA\r\n");
        let flash = flash.expect("a right image");
        assert_eq!(flash[0x0F..0x15], [0xFF, 0x11, 0x22, 0x33, 0x44, 0xFF]);
    }

    #[test]
    fn raw_bytes_with_vectors_are_taken_as_the_flash() {
        let image = [0, 0x18, 0, 0, 0, 0, 0, 8, 0x4E, 0x71];
        assert_eq!(load(&image).expect("vectors")[..10], image);
    }

    #[test]
    fn a_wrong_checksum_names_its_line() {
        let error = load(b"S0030000FC\nS309000000101122334449\n").expect_err("damaged");
        assert_eq!(error, ImageError::BadRecord { line: 2, what: "wrong checksum" });
    }

    #[test]
    fn contents_beyond_the_flash_are_refused() {
        let error = load(b"S30800080000010203E9\n").expect_err("outside");
        assert_eq!(error, ImageError::OutsideFlash { address: 0x80000, len: 3 });
    }

    #[test]
    fn truncated_and_foreign_files_are_refused() {
        assert_eq!(load(b""), Err(ImageError::UnknownFormat));
        assert_eq!(load(b"MZ"), Err(ImageError::UnknownFormat));
        assert_eq!(load(&[0xA5; 4096]), Err(ImageError::UnknownFormat));
        assert_eq!(load(b"S70500000000FA\n"), Err(ImageError::Empty));
        assert!(matches!(load(b"\x7FELF\x01\x02\x01"), Err(ImageError::DamagedElf(_))));
    }
}
