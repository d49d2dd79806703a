//! The turret's stream as a PC gets it (docs/SPEC.md section 7): cut into records, and checked.
//!
//! ```
//! let mut parser = stream::Parser::default();
//! parser.push(&[]);
//! assert!(parser.next_record().unwrap().is_none());
//! ```

mod checker;
mod parser;

pub use checker::{Checker, Findings};
pub use common_sys::link::StreamHeader;
pub use parser::{Damage, Parser, Place};

use common_sys::constants as c;
use common_sys::vision::{HEIGHT, WIDTH};

/// One record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Record {
    /// A frame of one eye.
    Frame(Frame),
    /// The end of a stream, with what the FPGA has counted.
    End(StreamHeader),
}

impl Record {
    /// Its header.
    pub fn header(&self) -> &StreamHeader {
        match self {
            Self::Frame(frame) => &frame.header,
            Self::End(header) => header,
        }
    }
}

/// A frame of one eye.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its header.
    pub header: StreamHeader,
    /// RGB565, row by row.
    pub pixels: Vec<u16>,
}

impl Frame {
    /// "left" or "right".
    pub fn eye(&self) -> &'static str {
        eye_name(self.header.eye)
    }

    /// Whether it has the size that the detectors see, or twice that.
    pub fn is_of_a_camera(&self) -> bool {
        let size = (usize::from(self.header.width_px), usize::from(self.header.height_px));
        size == (WIDTH, HEIGHT) || size == (2 * WIDTH, 2 * HEIGHT)
    }

    /// Whether its flags have `STREAM_FLAG_*`.
    pub fn has(&self, flag: u32) -> bool {
        u32::from(self.header.flags) & flag != 0
    }
}

/// "left" or "right".
pub fn eye_name(eye: u8) -> &'static str {
    if u32::from(eye) == c::STREAM_EYE_LEFT { "left" } else { "right" }
}

/// Bytes of a frame's record.
pub fn frame_bytes(header: &StreamHeader) -> usize {
    c::STREAM_BLOCK as usize + 2 * usize::from(header.width_px) * usize::from(header.height_px)
}

/// Records for this crate's tests.
#[cfg(test)]
mod tests_support {
    use super::*;
    use common_sys::link::stream_pattern_first;
    use common_sys::link::{STREAM_BLOCK, report_encode, stream_header_encode};
    use common_sys::vision::{EyeParams, detect};

    fn record(header: &StreamHeader, pixels: impl Iterator<Item = u16>) -> Vec<u8> {
        let mut bytes = stream_header_encode(header).to_vec();
        bytes.resize(STREAM_BLOCK, 0);
        bytes.extend(pixels.flat_map(u16::to_be_bytes));
        bytes
    }

    fn header(number: u32, eye: u8, lost: u32) -> StreamHeader {
        StreamHeader {
            kind: c::STREAM_FRAME as u8,
            eye,
            width_px: WIDTH as u16,
            height_px: HEIGHT as u16,
            number,
            sent: number - lost,
            lost,
            exposure_us: 1000 * number,
            session: 1,
            ..StreamHeader::default()
        }
    }

    /// A grey frame with its report.
    pub fn frame(number: u32, eye: u8, lost: u32) -> Vec<u8> {
        let pixels = vec![0x8410; WIDTH * HEIGHT];
        let params = EyeParams::usual();
        let mut report = detect(&pixels, &pixels, &params);
        report.function = c::FPGA_FUNCTION_SOCCER as u8;
        report.sequence = number as u8;
        report.exposure_time = (10 * number) as u16;
        let flags = c::STREAM_FLAG_REPORT as u8;
        let report = report_encode(&report);
        record(
            &StreamHeader { flags, params, report, ..header(number, eye, lost) },
            pixels.into_iter(),
        )
    }

    /// A frame of the test pattern.
    pub fn pattern(number: u32, eye: u8) -> Vec<u8> {
        let first = stream_pattern_first(number, eye);
        record(
            &StreamHeader { flags: c::STREAM_FLAG_PATTERN as u8, ..header(number, eye, 0) },
            (0..WIDTH * HEIGHT).map(|n| first.wrapping_add(n as u16)),
        )
    }

    /// An end record.
    pub fn end(number: u32, sent: u32, lost: u32) -> Vec<u8> {
        stream_header_encode(&StreamHeader {
            kind: c::STREAM_END as u8,
            number,
            sent,
            lost,
            session: 1,
            ..StreamHeader::default()
        })
        .to_vec()
    }
}
