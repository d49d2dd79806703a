//! Program images: Intel HEX and raw.

use thiserror::Error;

/// Why an image cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ImageError {
    /// Nothing in it.
    #[error("the image is empty; give a program built for the FX2")]
    Empty,
    /// A line of Intel HEX is damaged.
    #[error("line {line}: {cause}; the file is damaged or not Intel HEX")]
    Hex {
        /// Line number, from 1.
        line: usize,
        /// What is wrong.
        cause: String,
    },
    /// No end-of-file record.
    #[error("the end-of-file record is missing; the file is cut short")]
    NoEnd,
    /// A record lies outside what the chip can load.
    #[error(
        "{length} bytes at {address:#06x} are not in the chip's memory (0..{ram:#06x} and \
         0xe000..0xe200); link for the right chip"
    )]
    OutOfRange {
        /// First address of the record.
        address: u32,
        /// Its length in bytes.
        length: usize,
        /// Size of the main RAM in bytes.
        ram: usize,
    },
    /// More bytes than fit.
    #[error("{length} bytes do not fit into {limit}")]
    TooLong {
        /// Bytes given.
        length: usize,
        /// Bytes that fit.
        limit: usize,
    },
}

/// Bytes with their addresses: segments in ascending order that neither touch nor overlap.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Image {
    segments: Vec<(u16, Vec<u8>)>,
}

impl Image {
    /// An image of Intel HEX text (.ihx, .hex). Blank lines are skipped.
    ///
    /// # Errors
    /// If a line is damaged, the end is missing, an address is above 64 KiB or nothing is in it.
    pub fn ihex(text: &str) -> Result<Self, ImageError> {
        let mut bytes: Vec<Option<u8>> = Vec::new();
        let mut ended = false;
        let mut base = 0u32;
        for (n, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let bad = |cause: String| ImageError::Hex { line: n + 1, cause };
            if ended {
                return Err(bad("a record follows the end-of-file record".into()));
            }
            let record = ihex::Record::from_record_string(line.trim())
                .map_err(|error| bad(error.to_string()))?;
            match record {
                ihex::Record::Data { offset, value } => {
                    let at = base + u32::from(offset);
                    put(&mut bytes, at, &value)?;
                }
                ihex::Record::EndOfFile => ended = true,
                ihex::Record::ExtendedSegmentAddress(segment) => base = u32::from(segment) << 4,
                ihex::Record::ExtendedLinearAddress(upper) => base = u32::from(upper) << 16,
                ihex::Record::StartSegmentAddress { .. } | ihex::Record::StartLinearAddress(_) => {}
            }
        }
        if !ended && !bytes.is_empty() {
            return Err(ImageError::NoEnd);
        }
        Self::from_bytes(&bytes)
    }

    /// A raw image, to be loaded at address 0.
    ///
    /// # Errors
    /// If it is empty or longer than 64 KiB.
    pub fn raw(bytes: &[u8]) -> Result<Self, ImageError> {
        let mut all = Vec::new();
        put(&mut all, 0, bytes)?;
        Self::from_bytes(&all)
    }

    /// What the chip loads from an EEPROM that holds the C2 image `bytes` (TRM 3.4.3).
    ///
    /// # Errors
    /// If the records do not end within `bytes`.
    pub fn c2(bytes: &[u8]) -> Result<Self, ImageError> {
        const HEADER: usize = 8;
        const LAST: u8 = 0x80;
        let mut all = Vec::new();
        let mut rest = bytes.get(HEADER..).ok_or(ImageError::NoEnd)?;
        loop {
            let (head, behind) = rest.split_first_chunk::<4>().ok_or(ImageError::NoEnd)?;
            if head[0] & LAST != 0 {
                return Self::from_bytes(&all);
            }
            let length = usize::from(u16::from_be_bytes([head[0] & 3, head[1]]));
            let (data, behind) = behind.split_at_checked(length).ok_or(ImageError::NoEnd)?;
            put(&mut all, u32::from(u16::from_be_bytes([head[2], head[3]])), data)?;
            rest = behind;
        }
    }

    /// An image of either kind: Intel HEX if the first visible character is a colon.
    ///
    /// # Errors
    /// As [`Self::ihex`] and [`Self::raw`].
    pub fn parse(bytes: &[u8]) -> Result<Self, ImageError> {
        match bytes.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b':') => match std::str::from_utf8(bytes) {
                Ok(text) => Self::ihex(text),
                Err(error) => {
                    let line =
                        1 + bytes[..error.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
                    Err(ImageError::Hex { line, cause: "a byte is not text".into() })
                }
            },
            _ => Self::raw(bytes),
        }
    }

    /// Start address and bytes of each segment.
    pub fn segments(&self) -> impl Iterator<Item = (u16, &[u8])> {
        self.segments.iter().map(|(address, bytes)| (*address, bytes.as_slice()))
    }

    /// Checks that everything lies in `ram` bytes of main RAM or in the scratch RAM.
    ///
    /// # Errors
    /// [`ImageError::OutOfRange`] for the first segment that does not.
    pub fn check(&self, ram: usize) -> Result<(), ImageError> {
        for (address, bytes) in self.segments() {
            let (first, end) = (usize::from(address), usize::from(address) + bytes.len());
            if end > ram && !(first >= 0xE000 && end <= 0xE200) {
                return Err(ImageError::OutOfRange {
                    address: u32::from(address),
                    length: bytes.len(),
                    ram,
                });
            }
        }
        Ok(())
    }

    fn from_bytes(bytes: &[Option<u8>]) -> Result<Self, ImageError> {
        let mut segments: Vec<(u16, Vec<u8>)> = Vec::new();
        let mut previous = None;
        for (at, byte) in bytes.iter().enumerate() {
            let Some(byte) = *byte else { continue };
            match segments.last_mut() {
                Some((_, run)) if previous == at.checked_sub(1) => run.push(byte),
                _ => segments.push((at as u16, vec![byte])),
            }
            previous = Some(at);
        }
        if segments.is_empty() { Err(ImageError::Empty) } else { Ok(Self { segments }) }
    }
}

/// Stores `value` at `at`; the 8051 addresses 64 KiB.
fn put(bytes: &mut Vec<Option<u8>>, at: u32, value: &[u8]) -> Result<(), ImageError> {
    let end = at as usize + value.len();
    if end > 0x1_0000 {
        return Err(ImageError::OutOfRange { address: at, length: value.len(), ram: 0x1_0000 });
    }
    if bytes.len() < end {
        bytes.resize(end, None);
    }
    for (slot, &byte) in bytes[at as usize..].iter_mut().zip(value) {
        *slot = Some(byte);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ihex_records_become_segments() {
        let text = ":0200000001020B\n:02000200030405\n";
        let cut = Image::ihex(text);
        assert!(matches!(cut, Err(ImageError::Hex { line: 1, .. })), "wrong checksum: {cut:?}");
        let text = ":020000000102FB\n:020002000304F5\n:01E000000718\n:00000001FF\n";
        let image = Image::ihex(text).unwrap();
        let segments: Vec<_> = image.segments().collect();
        assert_eq!(segments, [(0, &[1u8, 2, 3, 4][..]), (0xE000, &[7][..])]);
        assert_eq!(image.check(0x2000), Ok(()));
    }

    #[test]
    fn damaged_input_is_refused_with_its_place() {
        assert_eq!(Image::ihex(""), Err(ImageError::Empty));
        assert_eq!(Image::ihex(":00000001FF\n"), Err(ImageError::Empty));
        assert_eq!(Image::raw(&[]), Err(ImageError::Empty));
        assert_eq!(Image::ihex(":020000000102FB\n"), Err(ImageError::NoEnd));
        assert!(matches!(Image::parse(b":02\xFF"), Err(ImageError::Hex { line: 1, .. })));
        assert!(matches!(
            Image::ihex(":020000000102FB\n:0200"),
            Err(ImageError::Hex { line: 2, .. })
        ));
        assert!(matches!(Image::raw(&[0; 0x1_0001]), Err(ImageError::OutOfRange { .. })));
    }

    #[test]
    fn memory_bounds_depend_on_the_chip() {
        let image = Image::raw(&[0; 0x2001]).unwrap();
        assert_eq!(
            image.check(0x2000),
            Err(ImageError::OutOfRange { address: 0, length: 0x2001, ram: 0x2000 })
        );
        assert_eq!(image.check(0x4000), Ok(()));
    }

    #[test]
    fn an_odd_raw_length_is_a_program_like_any_other() {
        assert_eq!(Image::raw(&[1, 2, 3]).unwrap().segments().next(), Some((0, &[1, 2, 3][..])));
    }
}
