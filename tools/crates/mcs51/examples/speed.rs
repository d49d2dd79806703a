//! How fast the core runs alone, in million instructions a second, and how many times faster than
//! the chip at 48 MHz: `cargo run --release -p mcs51 --example speed`.

use std::hint::black_box;
use std::time::Instant;

use mcs51::{Bus, Cpu};

/// Machine cycles a second of an FX2 at 48 MHz.
const CHIP_CYCLES_PER_S: f64 = 12e6;
const INSTRUCTIONS: u32 = 50_000_000;

struct Memory {
    code: [u8; 0x2000],
    xdata: [u8; 0x2000],
    sfr: [u8; 256],
}

impl Bus for Memory {
    fn read_code(&mut self, address: u16) -> u8 {
        self.code[usize::from(address & 0x1FFF)]
    }
    fn read_xdata(&mut self, address: u16) -> u8 {
        self.xdata[usize::from(address & 0x1FFF)]
    }
    fn write_xdata(&mut self, address: u16, value: u8) {
        self.xdata[usize::from(address & 0x1FFF)] = value;
    }
    fn read_sfr(&mut self, address: u8) -> u8 {
        self.sfr[usize::from(address)]
    }
    fn write_sfr(&mut self, address: u8, value: u8) {
        self.sfr[usize::from(address)] = value;
    }
}

/// MOV R7,#0; loop: ADD A,R6; XRL A,R5; INC R6; DJNZ R7,loop; SJMP loop
const REGISTER_LOOP: &[u8] = &[0x7F, 0x00, 0x2E, 0x6D, 0x0E, 0xDF, 0xFB, 0x80, 0xF9];

/// A checksum over xdata with a subroutine, as compiled C has it: LCALL 0x20 and SJMP back; there
/// MOVX, ADD, RLC, direct and bit operations, MOVC, PUSH, POP, INC DPTR, CJNE, a port write, RET.
const MIX: &[u8] = &[
    0x90, 0x00, 0x00, 0x7E, 0x00, 0x12, 0x00, 0x20, 0x80, 0xFB, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, // 0x20:
    0xE0, 0x25, 0x30, 0xF5, 0x30, 0x33, 0x92, 0x08, 0xC0, 0xE0, 0x54, 0x0F, 0x83, 0xC3, 0x95, 0x31,
    0xF5, 0x31, 0xD0, 0xE0, 0xA3, 0xF0, 0x20, 0x08, 0x02, 0x05, 0x32, 0x0E, 0xBE, 0x40, 0x03, 0x85,
    0x30, 0x80, 0x88, 0x33, 0xAF, 0x33, 0xE6, 0xF6, 0x22,
];

fn run(name: &str, program: &[u8]) {
    let mut memory = Memory { code: [0; 0x2000], xdata: [0x5A; 0x2000], sfr: [0; 256] };
    memory.code[..program.len()].copy_from_slice(program);
    let mut cpu = Cpu::new();
    let start = Instant::now();
    let cycles: u64 = (0..INSTRUCTIONS).map(|_| u64::from(cpu.step(&mut memory))).sum();
    let seconds = start.elapsed().as_secs_f64();
    black_box((&cpu, &memory));
    println!(
        "{name:<14} {:6.1} MIPS  {:5.1} x real time",
        f64::from(INSTRUCTIONS) / seconds / 1e6,
        cycles as f64 / CHIP_CYCLES_PER_S / seconds
    );
}

fn main() {
    run("register loop", REGISTER_LOOP);
    run("compiled mix", MIX);
}
