//! From bytes to records.

use common_sys::constants as c;
use common_sys::link::{STREAM_BLOCK, STREAM_HEADER_SIZE, StreamError, stream_header_decode};
use thiserror::Error;

use crate::{Frame, Record, StreamHeader, frame_bytes};

/// Where a record lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Its first byte.
    pub at: u64,
    /// How many it has.
    pub bytes: usize,
    /// Their CRC-32.
    pub crc32: u32,
}

/// Bytes that are no record.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Damage {
    /// No record begins where one should.
    #[error("byte {at}: {why}; {skipped} bytes are passed over")]
    Lost {
        /// Where.
        at: u64,
        /// Why.
        why: StreamError,
        /// Bytes until the next record.
        skipped: u64,
    },
    /// It ends within a record.
    #[error("it ends within a record: {have} of {want} bytes are there from byte {at} on")]
    CutShort {
        /// Where the record begins.
        at: u64,
        /// Bytes of it that are there.
        have: usize,
        /// Bytes that it should have.
        want: usize,
    },
}

/// Cuts bytes, however they come in pieces, into records. After damage it goes on with the next record,
/// wherever that begins.
#[derive(Clone, Debug, Default)]
pub struct Parser {
    buffer: Vec<u8>,
    /// Bytes of it that are done with.
    used: usize,
    /// Place of the buffer's first byte in all that came.
    base: u64,
    /// Since where, and why, no record has been found.
    lost: Option<(u64, StreamError)>,
}

impl Parser {
    /// More bytes, in the order in which they came.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.used > 0 {
            self.buffer.drain(..self.used);
            self.base += self.used as u64;
            self.used = 0;
        }
        self.buffer.extend_from_slice(bytes);
    }

    fn at(&self) -> u64 {
        self.base + self.used as u64
    }

    fn rest(&self) -> &[u8] {
        &self.buffer[self.used..]
    }

    /// The next record that is whole, None if more bytes are needed.
    ///
    /// # Errors
    /// Once for each place where bytes had to be passed over; the next call goes on behind it.
    pub fn next_record(&mut self) -> Result<Option<(Place, Record)>, Damage> {
        while let Some(wire) = self.rest().first_chunk::<STREAM_HEADER_SIZE>() {
            match stream_header_decode(wire) {
                Ok(header) => {
                    if let Some((at, why)) = self.lost.take() {
                        return Err(Damage::Lost { at, why, skipped: self.at() - at });
                    }
                    return Ok(self.take(&header));
                }
                Err(why) => {
                    self.lost = self.lost.or(Some((self.at(), why)));
                    self.used += 1 + next_magic(&self.rest()[1..]);
                }
            }
        }
        Ok(None)
    }

    fn take(&mut self, header: &StreamHeader) -> Option<(Place, Record)> {
        let at = self.at();
        let end = u32::from(header.kind) == c::STREAM_END;
        let bytes = if end { STREAM_HEADER_SIZE } else { frame_bytes(header) };
        let record = self.rest().get(..bytes)?;
        let place = Place { at, bytes, crc32: crc32fast::hash(record) };
        if end {
            self.used += bytes;
            return Some((place, Record::End(*header)));
        }
        let pixels = record[STREAM_BLOCK..]
            .chunks_exact(2)
            .map(|pixel| u16::from_be_bytes([pixel[0], pixel[1]]))
            .collect();
        self.used += bytes;
        Some((place, Record::Frame(Frame { header: *header, pixels })))
    }

    /// No more bytes will come.
    ///
    /// # Errors
    /// If some are left that make no record.
    pub fn finish(self) -> Result<(), Damage> {
        let (at, have) = (self.at(), self.rest().len());
        if let Some((at, why)) = self.lost {
            return Err(Damage::Lost {
                at,
                why,
                skipped: self.base + self.buffer.len() as u64 - at,
            });
        }
        if have == 0 {
            return Ok(());
        }
        let header = self.rest().first_chunk().map(stream_header_decode);
        let want = match header {
            Some(Ok(header)) => frame_bytes(&header),
            _ => STREAM_HEADER_SIZE,
        };
        Err(Damage::CutShort { at, have, want })
    }
}

/// How many bytes are before the next magic number, or before what may be the beginning of one.
fn next_magic(bytes: &[u8]) -> usize {
    let magic = c::STREAM_MAGIC.to_be_bytes();
    let whole = bytes.windows(magic.len()).position(|four| four == magic);
    whole.unwrap_or_else(|| bytes.len().saturating_sub(magic.len() - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests_support::{end, frame};

    fn stream() -> Vec<u8> {
        [frame(0, 0, 0), frame(0, 1, 0), frame(1, 0, 0), end(2, 2, 0)].concat()
    }

    fn numbers(parser: &mut Parser) -> Vec<(u32, u8)> {
        std::iter::from_fn(|| parser.next_record().expect("no damage"))
            .map(|(_, record)| (record.header().number, record.header().eye))
            .collect()
    }

    #[test]
    fn pieces_of_any_size_make_the_same_records() {
        let bytes = stream();
        for size in [1, 7, 64, 512, 4096, bytes.len()] {
            let mut parser = Parser::default();
            let mut found = Vec::new();
            for piece in bytes.chunks(size) {
                parser.push(piece);
                found.extend(numbers(&mut parser));
            }
            assert_eq!(found, [(0, 0), (0, 1), (1, 0), (2, 0)], "pieces of {size}");
            assert_eq!(parser.finish(), Ok(()));
        }
    }

    #[test]
    fn missing_bytes_are_named_once_and_the_next_record_is_found() {
        for missing in [1, 3, 512, 700, 100_000] {
            let mut bytes = stream();
            let frame_length = frame(0, 0, 0).len();
            bytes.drain(frame_length + 512..frame_length + 512 + missing);
            let mut parser = Parser::default();
            parser.push(&bytes);
            // The second frame swallows the beginning of the third.
            assert!(matches!(parser.next_record(), Ok(Some(_))));
            assert!(matches!(parser.next_record(), Ok(Some(_))));
            let damage = parser.next_record().expect_err("the third frame has no header");
            assert!(matches!(damage, Damage::Lost { why: StreamError::NoHeader, .. }), "{damage}");
            assert!(matches!(parser.next_record(), Ok(Some((_, Record::End(_))))), "{missing}");
            assert_eq!(parser.finish(), Ok(()));
        }
    }

    #[test]
    fn a_magic_number_that_comes_in_two_pieces_is_found() {
        let bytes = [vec![0xAA; 100], end(0, 0, 0)].concat();
        for cut in 98..106 {
            let mut parser = Parser::default();
            parser.push(&bytes[..cut]);
            assert_eq!(parser.next_record(), Ok(None));
            parser.push(&bytes[cut..]);
            assert!(matches!(parser.next_record(), Err(Damage::Lost { at: 0, skipped: 100, .. })));
            assert!(matches!(parser.next_record(), Ok(Some((_, Record::End(_))))), "{cut}");
        }
    }

    #[test]
    fn a_cut_is_noticed_wherever_it_is() {
        let bytes = frame(0, 0, 0);
        for cut in [1, 97, 98, 511, 512, bytes.len() - 1] {
            let mut parser = Parser::default();
            parser.push(&bytes[..cut]);
            assert_eq!(parser.next_record(), Ok(None));
            assert!(
                matches!(parser.finish(), Err(Damage::CutShort { at: 0, have, .. }) if have == cut)
            );
        }
    }

    #[test]
    fn what_is_no_stream_at_all_is_said_so() {
        let mut parser = Parser::default();
        parser.push(&[0x5A; 5000]);
        assert_eq!(parser.next_record(), Ok(None));
        assert!(matches!(
            parser.finish(),
            Err(Damage::Lost { at: 0, skipped: 5000, why: StreamError::NoHeader })
        ));
    }
}
