//! Machine code to text, in the notation of Intel's assembler.

use std::fmt;

use crate::sfr;

/// What a byte (or two) after the opcode means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// RAM below 0x80, a special function register above.
    Direct(u8),
    /// A bit address.
    Bit(u8),
    /// An 8-bit constant.
    Constant(u8),
    /// A 16-bit constant.
    Constant16(u16),
    /// The target of a jump or call.
    Target(u16),
}

/// One decoded instruction; displays as text.
///
/// ```
/// let instruction = mcs51::Instruction::decode(0x0100, [0xB5, 0xE0, 0xFD]);
/// assert_eq!(instruction.to_string(), "CJNE A,ACC,0x0100");
/// assert_eq!(instruction.length(), 3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    address: u16,
    bytes: [u8; 3],
}

/// Columns 0, 2 and 3 of the opcode map, row by row. Small letters stand for what follows the
/// opcode: b bit, c constant, d direct, r relative target, w 16-bit constant, l 16-bit target.
/// Column 1 is AJMP and ACALL; there p stands for a target within 2 KB.
const IRREGULAR: [[&str; 3]; 16] = [
    ["NOP", "LJMP l", "RR A"],
    ["JBC b,r", "LCALL l", "RRC A"],
    ["JB b,r", "RET", "RL A"],
    ["JNB b,r", "RETI", "RLC A"],
    ["JC r", "ORL d,A", "ORL d,#c"],
    ["JNC r", "ANL d,A", "ANL d,#c"],
    ["JZ r", "XRL d,A", "XRL d,#c"],
    ["JNZ r", "ORL C,b", "JMP @A+DPTR"],
    ["SJMP r", "ANL C,b", "MOVC A,@A+PC"],
    ["MOV DPTR,#w", "MOV b,C", "MOVC A,@A+DPTR"],
    ["ORL C,/b", "MOV C,b", "INC DPTR"],
    ["ANL C,/b", "CPL b", "CPL C"],
    ["PUSH d", "CLR b", "CLR C"],
    ["POP d", "SETB b", "SETB C"],
    ["MOVX A,@DPTR", "MOVX A,@R0", "MOVX A,@R1"],
    ["MOVX @DPTR,A", "MOVX @R0,A", "MOVX @R1,A"],
];

/// Columns 4, 5 and 6..F, row by row; x is @R0, @R1, R0..R7.
const REGULAR: [[&str; 3]; 16] = [
    ["INC A", "INC d", "INC x"],
    ["DEC A", "DEC d", "DEC x"],
    ["ADD A,#c", "ADD A,d", "ADD A,x"],
    ["ADDC A,#c", "ADDC A,d", "ADDC A,x"],
    ["ORL A,#c", "ORL A,d", "ORL A,x"],
    ["ANL A,#c", "ANL A,d", "ANL A,x"],
    ["XRL A,#c", "XRL A,d", "XRL A,x"],
    ["MOV A,#c", "MOV d,#c", "MOV x,#c"],
    ["DIV AB", MOVE_DIRECT, "MOV d,x"],
    ["SUBB A,#c", "SUBB A,d", "SUBB A,x"],
    ["MUL AB", "DB 0xA5", "MOV x,d"],
    ["CJNE A,#c,r", "CJNE A,d,r", "CJNE x,#c,r"],
    ["SWAP A", "XCH A,d", "XCH A,x"],
    ["DA A", "DJNZ d,r", "DJNZ x,r"],
    ["CLR A", "MOV A,d", "MOV A,x"],
    ["CPL A", "MOV d,A", "MOV x,A"],
];

/// The only instruction whose operands do not stand in the order of its bytes: source comes first.
const MOVE_DIRECT: &str = "MOV d,d";

fn template(opcode: u8) -> &'static str {
    let row = usize::from(opcode >> 4);
    match opcode & 0x0F {
        0 => IRREGULAR[row][0],
        1 if opcode & 0x10 != 0 => "ACALL p",
        1 => "AJMP p",
        2 => IRREGULAR[row][1],
        3 => IRREGULAR[row][2],
        4 => REGULAR[row][0],
        5 => REGULAR[row][1],
        6 | 7 if row == 0xD => "XCHD A,x",
        _ => REGULAR[row][2],
    }
}

/// How many bytes a letter of a template stands for.
fn width(letter: u8) -> u8 {
    match letter {
        b'b' | b'c' | b'd' | b'r' | b'p' => 1,
        b'w' | b'l' => 2,
        _ => 0,
    }
}

impl Instruction {
    /// Decodes the instruction at `address`. Bytes beyond its length do not matter.
    #[must_use]
    pub fn decode(address: u16, bytes: [u8; 3]) -> Self {
        Self { address, bytes }
    }

    /// Bytes that it takes: 1..=3.
    #[must_use]
    pub fn length(&self) -> u16 {
        1 + template(self.bytes[0]).bytes().map(|letter| u16::from(width(letter))).sum::<u16>()
    }

    /// Its operands after the opcode in the order of the bytes.
    pub fn operands(&self) -> impl Iterator<Item = Operand> {
        let mut at = 1;
        template(self.bytes[0]).bytes().filter(|&letter| width(letter) > 0).map(move |letter| {
            let operand = self.operand(letter, at);
            at += usize::from(width(letter));
            operand
        })
    }

    /// The operand that `letter` names and whose first byte is number `at`.
    fn operand(&self, letter: u8, at: usize) -> Operand {
        let byte = self.bytes[at];
        let next = self.address.wrapping_add(self.length());
        match letter {
            b'b' => Operand::Bit(byte),
            b'c' => Operand::Constant(byte),
            b'd' => Operand::Direct(byte),
            b'w' => Operand::Constant16(u16::from_be_bytes([self.bytes[1], self.bytes[2]])),
            b'l' => Operand::Target(u16::from_be_bytes([self.bytes[1], self.bytes[2]])),
            b'p' => Operand::Target(
                next & 0xF800 | u16::from(self.bytes[0] >> 5) << 8 | u16::from(byte),
            ),
            _ => Operand::Target(next.wrapping_add_signed(i16::from(byte.cast_signed()))),
        }
    }
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direct = |f: &mut fmt::Formatter<'_>, address| match sfr::name(address) {
            Some(name) => write!(f, "{name}"),
            None => write!(f, "0x{address:02X}"),
        };
        match *self {
            Self::Direct(address) => direct(f, address),
            Self::Bit(bit) if bit < 0x80 => write!(f, "0x{:02X}.{}", 0x20 + (bit >> 3), bit & 7),
            Self::Bit(bit) => direct(f, bit & 0xF8).and_then(|()| write!(f, ".{}", bit & 7)),
            Self::Constant(value) => write!(f, "0x{value:02X}"),
            Self::Constant16(value) | Self::Target(value) => write!(f, "0x{value:04X}"),
        }
    }
}

impl fmt::Display for Instruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let opcode = self.bytes[0];
        let template = template(opcode);
        if template == MOVE_DIRECT {
            let [destination, source] = [self.bytes[2], self.bytes[1]].map(Operand::Direct);
            return write!(f, "MOV {destination},{source}");
        }
        let mut operands = self.operands();
        for letter in template.bytes() {
            match letter {
                b'x' if opcode & 0x08 != 0 => write!(f, "R{}", opcode & 7)?,
                b'x' => write!(f, "@R{}", opcode & 1)?,
                _ => match (width(letter) > 0).then(|| operands.next()).flatten() {
                    Some(operand) => write!(f, "{operand}")?,
                    None => write!(f, "{}", char::from(letter))?,
                },
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(bytes: [u8; 3], length: u16, text: &str) {
        let instruction = Instruction::decode(0x1234, bytes);
        assert_eq!(instruction.to_string(), text);
        assert_eq!(instruction.length(), length, "{text}");
    }

    #[test]
    fn operands_stand_in_the_assembler_s_order() {
        check([0x85, 0x30, 0xD0], 3, "MOV PSW,0x30");
        check([0x88, 0x30, 0], 2, "MOV 0x30,R0");
        check([0xA7, 0x83, 0], 2, "MOV @R1,DPH0");
        check([0x75, 0x92, 0x40], 3, "MOV MPAGE,#0x40");
    }

    #[test]
    fn jumps_show_their_target() {
        check([0x80, 0xFE, 0], 2, "SJMP 0x1234");
        check([0xDF, 0x02, 0], 2, "DJNZ R7,0x1238");
        check([0xB6, 0x55, 0x80], 3, "CJNE @R0,#0x55,0x11B7");
        check([0xE1, 0x22, 0], 2, "AJMP 0x1722");
        check([0x31, 0x22, 0], 2, "ACALL 0x1122");
        check([0x02, 0xAB, 0xCD], 3, "LJMP 0xABCD");
        check([0xD5, 0x20, 0xFD], 3, "DJNZ 0x20,0x1234");
    }

    #[test]
    fn bits_show_byte_and_number() {
        check([0x10, 0x0B, 0x00], 3, "JBC 0x21.3,0x1237");
        check([0xD2, 0xE7, 0], 2, "SETB ACC.7");
        check([0xA0, 0x93, 0], 2, "ORL C,/0x90.3");
    }

    /// Counts the bytes fetched from address 0 on; constants (MOVC) lie above.
    struct Fetches(u8, u16);

    impl crate::Bus for Fetches {
        fn read_code(&mut self, address: u16) -> u8 {
            self.1 += u16::from(address < 3);
            if address == 0 { self.0 } else { 0 }
        }
        fn read_xdata(&mut self, _: u16) -> u8 {
            0
        }
        fn write_xdata(&mut self, _: u16, _: u8) {}
        fn read_sfr(&mut self, _: u8) -> u8 {
            0
        }
        fn write_sfr(&mut self, _: u8, _: u8) {}
    }

    #[test]
    fn lengths_are_those_that_the_core_fetches() {
        for opcode in 0..=255 {
            let mut bus = Fetches(opcode, 0);
            let mut cpu = crate::Cpu::new();
            cpu.set_sfr(sfr::ACC, 0x80);
            cpu.step(&mut bus);
            let instruction = Instruction::decode(0, [opcode, 0, 0]);
            assert_eq!(instruction.length(), bus.1, "{instruction}");
        }
    }
}
