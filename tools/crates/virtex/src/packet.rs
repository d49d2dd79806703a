//! The words of a Virtex-E configuration stream: packet headers, registers, commands, check sum.
//!
//! Source: XAPP151; the check sum's bit order was checked against real bitstreams.

use std::fmt;

/// Fills the stream before the synchronisation word.
pub const DUMMY_WORD: u32 = 0xFFFF_FFFF;
/// After it, and not before, words are packets.
pub const SYNC_WORD: u32 = 0xAA99_5566;

/// Value of COR that the vendor's tools write by default: start-up clocked by CCLK, DONE in cycle 4,
/// I/Os in cycle 5, GSR and GWE in cycle 6, no waiting for a DLL.
pub const COR_DEFAULT: u32 = 0x0080_3F2D;

/// CTL bit: the configuration port stays a configuration port after start-up.
pub const CTL_PERSIST: u32 = 1 << 6;

/// The configuration registers that a stream can write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// Check sum: a write of the right value leaves it 0.
    Crc = 0,
    /// Frame address.
    Far = 1,
    /// Frame data input.
    Fdri = 2,
    /// Command.
    Cmd = 4,
    /// Control, through [`Register::Mask`].
    Ctl = 5,
    /// Which bits of CTL the next write may change.
    Mask = 6,
    /// Output to a daisy chain.
    Lout = 8,
    /// Configuration options.
    Cor = 9,
    /// Frame length.
    Flr = 11,
}

impl Register {
    /// The writable register at `address`, if there is one.
    pub const fn from_address(address: u32) -> Option<Self> {
        Some(match address {
            0 => Self::Crc,
            1 => Self::Far,
            2 => Self::Fdri,
            4 => Self::Cmd,
            5 => Self::Ctl,
            6 => Self::Mask,
            8 => Self::Lout,
            9 => Self::Cor,
            11 => Self::Flr,
            _ => return None,
        })
    }
}

/// The commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Write configuration data.
    Wcfg = 1,
    /// The last frame follows; interconnect comes alive.
    Lfrm = 3,
    /// Read configuration data.
    Rcfg = 4,
    /// Begin start-up at the next check sum that is right.
    Start = 5,
    /// Reset the capture signal.
    Rcap = 6,
    /// Clear the check sum.
    Rcrc = 7,
    /// Take the interconnect out of service.
    Aghigh = 8,
    /// Switch to the CCLK frequency in COR (master modes only).
    Switch = 9,
}

impl Command {
    /// The command with that code, if there is one.
    pub const fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            1 => Self::Wcfg,
            3 => Self::Lfrm,
            4 => Self::Rcfg,
            5 => Self::Start,
            6 => Self::Rcap,
            7 => Self::Rcrc,
            8 => Self::Aghigh,
            9 => Self::Switch,
            _ => return None,
        })
    }
}

/// Largest count of a type-1 packet.
pub const TYPE1_MAX: u32 = 0x7FF;

/// What a word is while the logic waits for a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Header {
    /// `count` words for the register at `address` follow.
    Write {
        /// The register's address, checked by nobody yet.
        address: u32,
        /// Words that follow.
        count: u32,
    },
    /// `count` more words for the register of the last type-1 packet follow.
    WriteMore {
        /// Words that follow.
        count: u32,
    },
    /// The stream wants to read.
    Read,
    /// Zero between packets: padding.
    Padding,
    /// Dummy or synchronisation word of a further stream.
    Resync,
    /// None of these.
    Unknown,
}

impl Header {
    /// Read a header. The reserved bits 12:11 of a type-1 packet must be 0: they are not covered by
    /// the check sum, and a stream in which they are set is damaged.
    pub const fn decode(word: u32) -> Self {
        let op = word >> 27 & 3;
        match (word, word >> 29, op) {
            (0, _, _) => Self::Padding,
            (DUMMY_WORD | SYNC_WORD, _, _) => Self::Resync,
            (_, 1, 2) if word >> 11 & 3 == 0 => {
                Self::Write { address: word >> 13 & 0x3FFF, count: word & TYPE1_MAX }
            }
            (_, 2, 2) => Self::WriteMore { count: word & 0x07FF_FFFF },
            (_, 1 | 2, 1) => Self::Read,
            _ => Self::Unknown,
        }
    }

    /// Type-1 write of `count` <= [`TYPE1_MAX`] words.
    pub const fn type1(register: Register, count: u32) -> u32 {
        1 << 29 | 2 << 27 | (register as u32) << 13 | count
    }

    /// Type-2 write of `count` words.
    pub const fn type2(count: u32) -> u32 {
        2 << 29 | 2 << 27 | count
    }
}

/// The running check sum over all register writes.
///
/// Reflected CRC-16 with polynomial 0xA001 (x^16 + x^15 + x^2 + 1), initial 0: for each word written
/// its 32 bits, least significant first, then the 4 low bits of the register's address.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crc(u16);

const CRC_POLYNOMIAL: u16 = 0xA001;

/// What eight bits do to the check sum; the four address bits have a table of their own.
const CRC_TABLE: [u16; 256] = {
    let mut table = [0; 256];
    let mut index = 0;
    while index < 256 {
        table[index] = crc_bits(index as u16, 8);
        index += 1;
    }
    table
};

const fn crc_bits(mut crc: u16, bits: u32) -> u16 {
    let mut bit = 0;
    while bit < bits {
        crc = if crc & 1 != 0 { crc >> 1 ^ CRC_POLYNOMIAL } else { crc >> 1 };
        bit += 1;
    }
    crc
}

/// What four bits do to the check sum.
const CRC_NIBBLE: [u16; 16] = {
    let mut table = [0; 16];
    let mut index = 0;
    while index < 16 {
        table[index] = crc_bits(index as u16, 4);
        index += 1;
    }
    table
};

impl Crc {
    /// Take in one word written to `register`.
    pub fn update(&mut self, register: Register, word: u32) {
        let mut crc = self.0;
        for byte in word.to_le_bytes() {
            crc = crc >> 8 ^ CRC_TABLE[usize::from(crc as u8 ^ byte)];
        }
        self.0 = crc >> 4 ^ CRC_NIBBLE[usize::from((crc ^ register as u16) & 15)];
    }

    /// The sum so far: what a CRC packet has to carry.
    pub const fn value(self) -> u16 {
        self.0
    }

    /// As the command RCRC does.
    pub fn clear(&mut self) {
        self.0 = 0;
    }
}

/// Why the configuration logic stopped, or would never start the design.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The check sum did not come out 0.
    Crc {
        /// Check sum of what arrived.
        computed: u16,
        /// What the stream says.
        given: u32,
    },
    /// FLR is not that of this part.
    FrameLength {
        /// Value written to FLR.
        flr: u32,
        /// Value that this part needs.
        expected: u32,
    },
    /// Frame data for a frame that this part does not have.
    FrameAddress {
        /// The frame address register.
        far: u32,
    },
    /// A packet of frame data ends within a frame.
    PartialFrame {
        /// Words beyond the last whole frame.
        words: u32,
    },
    /// Frame data without FLR, or without the command WCFG or LFRM.
    UnexpectedData,
    /// Start-up is asked for, but some frames were never written.
    FramesMissing {
        /// How many.
        missing: u32,
    },
    /// Start-up would be clocked by the user's or JTAG's clock, which do not run here.
    StartupClock,
    /// COR asks for DONE in a cycle that does not exist, or for a shut-down sequence.
    Options {
        /// The value of COR.
        cor: u32,
    },
    /// No such command.
    Command {
        /// The value written to CMD.
        code: u32,
    },
    /// No such register, or one that cannot be written.
    Register {
        /// Its address.
        address: u32,
    },
    /// The stream wants to read, but WRITE# is tied low.
    Read,
    /// Not a packet header.
    Packet {
        /// The word.
        word: u32,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Crc { computed, given } => {
                write!(f, "the CRC is {computed:04X} but the stream says {given:04X}")
            }
            Self::FrameLength { flr, expected } => {
                write!(f, "frame length register {flr}, but this part needs {expected}")
            }
            Self::FrameAddress { far } => write!(f, "this part has no frame at address {far:08X}"),
            Self::PartialFrame { words } => {
                write!(f, "a packet of frame data ends {words} words into a frame")
            }
            Self::UnexpectedData => write!(f, "frame data without FLR or without WCFG before it"),
            Self::FramesMissing { missing } => {
                write!(f, "start-up is asked for, but {missing} frames were never written")
            }
            Self::StartupClock => write!(f, "start-up is not clocked by CCLK"),
            Self::Options { cor } => {
                write!(f, "configuration options {cor:08X} that this model does not take")
            }
            Self::Command { code } => write!(f, "unknown command {code}"),
            Self::Register { address } => write!(f, "no register {address} to write"),
            Self::Read => write!(f, "the stream reads, but WRITE# is tied low"),
            Self::Packet { word } => write!(f, "{word:08X} is not a packet"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same sum by its definition, one bit at a time, most significant coefficient first: long
    /// division of the message by x^16 + x^15 + x^2 + 1, remainder reflected at the end.
    fn crc_by_division(writes: &[(Register, u32)]) -> u16 {
        let mut remainder: u32 = 0;
        for &(register, word) in writes {
            let bits = u64::from(word) | (register as u64) << 32;
            for position in 0..36 {
                let feedback = remainder >> 15 & 1 ^ (bits >> position & 1) as u32;
                remainder = remainder << 1 & 0xFFFF;
                if feedback != 0 {
                    remainder ^= 0x8005;
                }
            }
        }
        (remainder as u16).reverse_bits()
    }

    #[test]
    fn the_table_agrees_with_long_division() {
        let mut word = 0x1234_5678_u32;
        let mut writes = Vec::new();
        let mut crc = Crc::default();
        for register in [Register::Flr, Register::Cor, Register::Cmd, Register::Fdri] {
            for _ in 0..50 {
                word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                writes.push((register, word));
                crc.update(register, word);
                assert_eq!(crc.value(), crc_by_division(&writes));
            }
        }
    }

    #[test]
    fn known_answers_worked_out_elsewhere() {
        let crc = |writes: &[(Register, u32)]| {
            let mut crc = Crc::default();
            writes.iter().for_each(|&(register, word)| crc.update(register, word));
            crc.value()
        };
        let options = [(Register::Cor, COR_DEFAULT), (Register::Mask, 0), (Register::Cmd, 9)];
        assert_eq!(crc(&[(Register::Flr, 20)]), 0x8701);
        assert_eq!(crc(&[&[(Register::Flr, 20)], &options[..]].concat()), 0x68B8);
        assert_eq!(crc(&[(Register::Fdri, 0xFFFF_FFFF)]), 0x1D40);
    }

    #[test]
    fn writing_the_sum_leaves_zero_and_anything_else_does_not() {
        let mut crc = Crc::default();
        crc.update(Register::Flr, 20);
        crc.update(Register::Cor, COR_DEFAULT);
        let before = crc;
        crc.update(Register::Crc, u32::from(before.value()));
        assert_eq!(crc.value(), 0);
        for bit in 0..32 {
            let mut wrong = before;
            wrong.update(Register::Crc, u32::from(before.value()) ^ 1 << bit);
            assert_ne!(wrong.value(), 0, "bit {bit}");
        }
    }

    #[test]
    fn headers_are_those_of_the_configuration_guide() {
        assert_eq!(Header::type1(Register::Cmd, 1), 0x3000_8001);
        assert_eq!(Header::type1(Register::Flr, 1), 0x3001_6001);
        assert_eq!(Header::type1(Register::Cor, 1), 0x3001_2001);
        assert_eq!(Header::type1(Register::Fdri, 0), 0x3000_4000);
        assert_eq!(Header::type2(53109), 0x5000_CF75);
        assert_eq!(Header::decode(0x3000_8001), Header::Write { address: 4, count: 1 });
        assert_eq!(Header::decode(0x5000_CF75), Header::WriteMore { count: 53109 });
        assert_eq!(Header::decode(0x2800_E001), Header::Read);
        assert_eq!(Header::decode(0x0000_0007), Header::Unknown);
        assert_eq!(Header::decode(0x7000_0001), Header::Unknown);
    }
}
