//! What a bitstream of ours says about itself.
//!
//! A real bitstream is a netlist, and no model can run one. So a stream made for the twin carries a
//! description of the function that the model is to take on, in the frame data, where it is covered
//! by the stream's own check sum and where a partial reconfiguration can replace it:
//!
//! **frame 0 of the first column of block RAM content (FAR 02020000), words 0..19 as 80 bytes,
//! most significant byte first:**
//!
//! | at | field |
//! |---|---|
//! | 0 | `SOT1` |
//! | 4 | name of the function, 16 bytes, NUL-padded (`soccer`, `capture`) |
//! | 20 | name of the design, 32 bytes, NUL-padded |
//! | 52 | zeros |
//! | 78 | u16 CRC-16/CCITT-FALSE over bytes 0..77 |
//!
//! A stream without it configures the FPGA like any other, but the model then does nothing.

use std::fmt;
use std::str::FromStr;

use common_sys::constants::{FPGA_FUNCTION_CAPTURE, FPGA_FUNCTION_SOCCER};
use common_sys::link::crc16;

use crate::part::{BLOCK_RAM, FrameAddress};

/// Where the description lies.
pub const DESIGN_FRAME: FrameAddress = FrameAddress { block: BLOCK_RAM, major: 1, minor: 0 };

const SIZE: usize = 80;
const MAGIC: &[u8; 4] = b"SOT1";
const FUNCTION_AT: usize = 4;
const NAME_AT: usize = 20;
const NAME_END: usize = 52;
const CRC_AT: usize = 78;

/// Longest name of a design, in bytes.
pub const NAME_MAX: usize = NAME_END - NAME_AT - 1;

/// What the FPGA does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Detectors and reports.
    Soccer,
    /// Raw frames only.
    Capture,
}

impl Function {
    /// All functions.
    pub const ALL: [Self; 2] = [Self::Soccer, Self::Capture];

    /// Its name in bitstreams and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Soccer => "soccer",
            Self::Capture => "capture",
        }
    }

    /// Its number in reports, registers and slot headers.
    pub const fn code(self) -> u8 {
        match self {
            Self::Soccer => FPGA_FUNCTION_SOCCER as u8,
            Self::Capture => FPGA_FUNCTION_CAPTURE as u8,
        }
    }
}

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The name is of no function.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no function \"{0}\"; the model knows soccer and capture")]
pub struct UnknownFunction(String);

impl FromStr for Function {
    type Err = UnknownFunction;

    fn from_str(name: &str) -> Result<Self, UnknownFunction> {
        Self::ALL
            .into_iter()
            .find(|function| function.name() == name)
            .ok_or_else(|| UnknownFunction(name.to_owned()))
    }
}

/// The description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Design {
    /// What the model does.
    pub function: Function,
    /// Free text, at most [`NAME_MAX`] bytes; longer names are cut.
    pub name: String,
}

impl Design {
    /// Words 0..19 of the frame.
    pub fn encode(&self) -> [u32; SIZE / 4] {
        let mut bytes = [0; SIZE];
        let function = self.function.name().as_bytes();
        bytes[..MAGIC.len()].copy_from_slice(MAGIC);
        bytes[FUNCTION_AT..FUNCTION_AT + function.len()].copy_from_slice(function);
        let mut length = self.name.len().min(NAME_MAX);
        while !self.name.is_char_boundary(length) {
            length -= 1;
        }
        bytes[NAME_AT..NAME_AT + length].copy_from_slice(&self.name.as_bytes()[..length]);
        let crc = crc16(&bytes[..CRC_AT]);
        bytes[CRC_AT..].copy_from_slice(&crc.to_be_bytes());
        std::array::from_fn(|word| {
            u32::from_be_bytes([0, 1, 2, 3].map(|byte| bytes[4 * word + byte]))
        })
    }

    /// The description in a frame; None if it has none, or one that this model does not know.
    pub fn decode(frame: &[u32]) -> Option<Self> {
        let bytes: Vec<u8> = frame.get(..SIZE / 4)?.iter().flat_map(|w| w.to_be_bytes()).collect();
        let crc = u16::from_be_bytes([bytes[CRC_AT], bytes[CRC_AT + 1]]);
        if !bytes.starts_with(MAGIC) || crc16(&bytes[..CRC_AT]) != crc {
            return None;
        }
        let text = |field: &[u8]| {
            let text = field.split(|&byte| byte == 0).next().unwrap_or_default();
            std::str::from_utf8(text).map(str::to_owned).ok()
        };
        Some(Self {
            function: text(&bytes[FUNCTION_AT..NAME_AT])?.parse().ok()?,
            name: text(&bytes[NAME_AT..NAME_END])?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_survives_and_any_flipped_bit_is_noticed() {
        let design = Design { function: Function::Soccer, name: "cup 2005".to_owned() };
        let frame = design.encode();
        assert_eq!(Design::decode(&frame), Some(design));
        for bit in 0..SIZE * 8 {
            let mut damaged = frame;
            damaged[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Design::decode(&damaged), None, "bit {bit}");
        }
    }

    #[test]
    fn a_long_name_is_cut_between_characters() {
        let design = Design { function: Function::Capture, name: "é".repeat(40) };
        let read = Design::decode(&design.encode()).expect("it is whole");
        assert_eq!(read.name, "é".repeat(NAME_MAX / 2));
    }

    #[test]
    fn an_empty_or_short_frame_says_nothing() {
        assert_eq!(Design::decode(&[0; 21]), None);
        assert_eq!(Design::decode(&[0; 12]), None);
    }
}
