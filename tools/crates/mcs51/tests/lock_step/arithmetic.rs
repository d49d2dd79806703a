//! Every value of A with every operand, for the instructions whose flags are hard: random programs
//! alone meet too few of them.
//!
//! A little program runs through all 65,536 pairs and folds A, PSW and B of each into one byte per
//! operand, which both machines must leave in xdata, after the same number of cycles.

use mcs51::{Cpu, sfr};

use crate::compare::compare_memory;
use crate::program::Memory;
use crate::reference::{self, Dump, charged_cycles};

/// One run of the program.
pub struct Pass {
    name: &'static str,
    instruction: &'static [u8],
    /// PSW before the instruction.
    flags: u8,
    /// Values of R6 and B: 256 or, for instructions without operand, 1.
    operands: u16,
}

const fn pass(name: &'static str, instruction: &'static [u8], flags: u8, operands: u16) -> Pass {
    Pass { name, instruction, flags, operands }
}

pub const PASSES: [Pass; 16] = [
    pass("ADD A,R6", &[0x2E], 0x00, 256),
    pass("ADDC A,R6", &[0x3E], 0x00, 256),
    pass("ADDC A,R6 with CY", &[0x3E], 0x80, 256),
    pass("SUBB A,R6", &[0x9E], 0x00, 256),
    pass("SUBB A,R6 with CY", &[0x9E], 0x80, 256),
    pass("CJNE A,B", &[0xB5, sfr::B, 0x00], 0x44, 256),
    pass("MUL", &[0xA4], 0xC4, 256),
    pass("DIV", &[0x84], 0xC4, 256),
    pass("DA", &[0xD4], 0x00, 1),
    pass("DA with AC", &[0xD4], 0x40, 1),
    pass("DA with CY", &[0xD4], 0x80, 1),
    pass("DA with CY and AC", &[0xD4], 0xC0, 1),
    pass("RLC", &[0x33], 0x00, 1),
    pass("RLC with CY", &[0x33], 0x80, 1),
    pass("RRC", &[0x13], 0x00, 1),
    pass("RRC with CY", &[0x13], 0x80, 1),
];

impl Pass {
    /// The program and the address of its end, where it stays.
    fn program(&self) -> (Vec<u8>, u16) {
        let mut code = vec![0x90, 0x00, 0x00, 0x7E, self.operands as u8]; // MOV DPTR,#0; MOV R6,#
        let outer = code.len();
        code.extend([0x7F, 0x00, 0x7B, 0x00]); // MOV R7,#0; MOV R3,#0
        let inner = code.len();
        code.extend([0x75, sfr::PSW, self.flags, 0x8E, sfr::B, 0xEF]); // MOV B,R6; MOV A,R7
        code.extend(self.instruction);
        code.extend([0xAA, sfr::PSW]); // MOV R2,PSW
        code.extend([0xCB, 0x23, 0x2B]); // XCH A,R3; RL A; ADD A,R3
        code.extend([0x23, 0x2A, 0x23, 0x25, sfr::B]); // RL A; ADD A,R2; RL A; ADD A,B
        code.push(0xFB); // MOV R3,A
        loop_back(&mut code, 0xDF, inner); // DJNZ R7
        code.extend([0xF0, 0xA3]); // MOVX @DPTR,A; INC DPTR
        loop_back(&mut code, 0xDE, outer); // DJNZ R6
        let end = code.len() as u16;
        code.extend([0x80, 0xFE]); // SJMP here
        (code, end)
    }

    /// Cycles and xdata on this core. As the reference, it stops behind the instruction at `end`.
    fn run(&self) -> (u32, Dump) {
        let (code, end) = self.program();
        let mut memory = Memory::new(&code);
        let mut cpu = Cpu::new();
        let mut cycles = 0;
        loop {
            let address = cpu.pc();
            let opcode = memory.code[usize::from(address)];
            cycles += charged_cycles(opcode, cpu.step(&mut memory));
            if address == end {
                break;
            }
        }
        (cycles, (0..self.operands).zip(memory.xdata).collect())
    }

    fn script(&self) -> String {
        let (code, end) = self.program();
        let last = self.operands - 1;
        let mut text = String::new();
        reference::set_memory(&mut text, "rom", 0, &code);
        text + &format!("pc 0\nrun 0 {end:#x}\ndump xram 0 {last:#x}\n")
    }
}

fn loop_back(code: &mut Vec<u8>, opcode: u8, target: usize) {
    let next = code.len() + 2;
    code.extend([opcode, (target as u8).wrapping_sub(next as u8)]);
}

/// Runs all passes on both; the error tells the first difference.
pub fn compare() -> Result<(), String> {
    let script: String = PASSES.iter().map(Pass::script).collect();
    let answers = reference::run("arithmetic", &[], &script);
    if (answers.stops.len(), answers.dumps.len()) != (PASSES.len(), PASSES.len()) {
        return Err(format!("s51 stopped {} times", answers.stops.len()));
    }
    for (pass, (stop, dump)) in PASSES.iter().zip(answers.stops.iter().zip(&answers.dumps)) {
        let (cycles, xdata) = pass.run();
        compare_memory("the sum for operand -", &xdata, dump, |_| 0)
            .map_err(|difference| format!("{}: {difference}", pass.name))?;
        if stop.cycles != cycles {
            return Err(format!("{}: {cycles} cycles; s51 has {}", pass.name, stop.cycles));
        }
    }
    Ok(())
}
