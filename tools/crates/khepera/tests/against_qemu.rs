//! The CPU against another implementation: random instructions run on the emulated base and under
//! qemu-m68k (Debian package qemu-user), and every register and flag is compared after each.
//!
//! Flags that the programmer's reference manual leaves undefined are left out.

mod common;

use std::path::Path;
use std::process::Command;

use common::{Program, RESULTS, build_at};
use khepera::turret_bus::Unconnected;
use sim::SECOND;

/// Condition codes and D0..D7 after each instruction.
const RECORD_BYTES: usize = 2 + 8 * 4;
const INSTRUCTIONS: usize = 3000;
/// Stands for the flags of a division: all of them, or only V after an overflow.
const DIVISION: u16 = 0x8000;
/// Scratch memory for operands, at A1.
const SCRATCH_BYTES: usize = 256;

/// xorshift64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 >> 16
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    fn pick<'a>(&mut self, list: &[&'a str]) -> &'a str {
        list[self.below(list.len() as u64) as usize]
    }

    /// Mostly edge cases.
    fn value(&mut self) -> u32 {
        match self.below(8) {
            0 => 0,
            1 => 1,
            2 => 0x7FFF_FFFF,
            3 => 0x8000_0000,
            4 => 0xFFFF_FFFF,
            5 => self.next() as u32 & 0xFF,
            6 => (self.next() as u32 & 0xFFFF).wrapping_sub(0x8000),
            _ => self.next() as u32,
        }
    }
}

/// An operand in memory or a register, valid for words and longs as well.
fn operand(random: &mut Random) -> String {
    let even = 2 * random.below(32);
    match random.below(8) {
        0 => "(%a1)".to_string(),
        1 => format!("({even},%a1)"),
        2 => format!("(-{even},%a2)"),
        3 => format!("({even},%a1,%d7.w*{})", 1 << random.below(4)),
        4 => format!("({even},%a1,%d7.l*2)"),
        5 => "(%a3)+".to_string(),
        6 => "-(%a3)".to_string(),
        _ => format!("%d{}", random.below(6)),
    }
}

/// One instruction with what must come before it; and which condition codes it defines.
fn instruction(random: &mut Random) -> (String, u16) {
    const ALL: u16 = 0x1F;
    let size = random.pick(&["b", "w", "l"]);
    let (x, y) = (random.below(6), random.below(6));
    let z = (x + 1 + random.below(5)) % 6;
    let value = random.value();
    match random.below(16) {
        0 => (format!("move.l #{value},%d{x}"), ALL),
        1 => {
            let name = random.pick(&["add", "sub", "cmp", "and", "or"]);
            (format!("{name}.{size} {},%d{x}", operand(random)), ALL)
        }
        2 => {
            let name = random.pick(&["add", "sub", "and", "or", "eor"]);
            (format!("{name}.{size} %d{x},{}", operand(random)), ALL)
        }
        3 => {
            let name = random.pick(&["addi", "subi", "cmpi", "andi", "ori", "eori"]);
            let limit = match size {
                "b" => value & 0xFF,
                "w" => value & 0xFFFF,
                _ => value,
            };
            (format!("{name}.{size} #{limit},{}", operand(random)), ALL)
        }
        4 => (format!("{}.{size} %d{x},%d{y}", random.pick(&["addx", "subx"])), ALL),
        5 => {
            let name = random.pick(&["neg", "negx", "not", "clr", "tst"]);
            (format!("{name}.{size} {}", operand(random)), ALL)
        }
        6 => {
            let name = random.pick(&["ext.w", "ext.l", "extb.l", "swap"]);
            (format!("{name} %d{x}"), ALL)
        }
        7 => (format!("{}.w {},%d{x}", random.pick(&["mulu", "muls"]), operand(random)), ALL),
        8 => {
            let name = random.pick(&["mulu", "muls"]);
            let to = if random.below(2) == 0 { format!("%d{x}") } else { format!("%d{x}:%d{z}") };
            // With Dh = Dl the product is undefined; z differs from x. C is cleared.
            (format!("{name}.l {},{to}", operand(random)), ALL)
        }
        9 => {
            let name = random.pick(&["divu.w", "divs.w", "divul.l", "divsl.l", "divu.l", "divs.l"]);
            let to = match name {
                "divul.l" | "divsl.l" => format!("%d{z}:%d{x}"),
                "divu.l" | "divs.l" if random.below(2) == 0 => format!("%d{z}:%d{x}"),
                _ => format!("%d{x}"),
            };
            // After an overflow only V is defined. qemu itself stops at $80000000 / -1.
            let divisor = if value | 1 == 0xFFFF_FFFF { 3 } else { value | 1 };
            let divisor = if divisor & 0xFFFF == 0xFFFF { divisor ^ 2 } else { divisor };
            (format!("move.l #{divisor},%d6\n {name} %d6,{to}"), DIVISION)
        }
        10 => {
            let name = random.pick(&["lsl", "lsr", "asl", "asr", "rol", "ror", "roxl", "roxr"]);
            let count = if random.below(2) == 0 {
                format!("#{}", 1 + random.below(8))
            } else {
                format!("%d{y}")
            };
            (format!("{name}.{size} {count},%d{x}"), ALL)
        }
        11 => {
            let name = random.pick(&["btst", "bset", "bclr", "bchg"]);
            (format!("{name} %d{y},%d{x}"), ALL)
        }
        12 => {
            let condition = random
                .pick(&["cc", "cs", "eq", "ne", "ge", "lt", "gt", "le", "hi", "ls", "vc", "vs"]);
            (format!("s{condition} %d{x}"), ALL)
        }
        13 => (
            format!("{}.{size} #{},%d{x}", random.pick(&["addq", "subq"]), 1 + random.below(8)),
            ALL,
        ),
        14 => (format!("move.{size} {},{}", operand(random), operand(random)), ALL),
        _ => {
            let list = random.pick(&["%d0/%d3-%d5", "%d1-%d2", "%d0-%d5"]);
            let there = random.below(2) == 0;
            let offset = 4 * random.below(16);
            let code = if there {
                format!("movem.l {list},({offset},%a1)")
            } else {
                format!("movem.{} ({offset},%a1),{list}", random.pick(&["w", "l"]))
            };
            (code, ALL)
        }
    }
}

/// The instructions, each followed by its record at (%a0)+, and the flags each defines.
fn sequence(seed: u64) -> (String, Vec<u16>) {
    let mut random = Random(seed);
    let mut code = String::from(
        "        moveq #0,%d7
        lea (128,%a1),%a2
        move.l %a1,%a3
        move.w #63,%d6
        clear: clr.l (%a3)+
        dbra %d6,clear\n",
    );
    let mut defined = Vec::new();
    for n in 0..6 {
        code.push_str(&format!("        move.l #{},%d{n}\n", random.value()));
    }
    for _ in 0..INSTRUCTIONS {
        let (instruction, flags) = instruction(&mut random);
        code.push_str(&format!(
            "        lea (64,%a1),%a3
        move.w #{},%d7
        move.w #0,%ccr
        {instruction}
        move.w %ccr,(%a0)+
        movem.l %d0-%d7,(%a0)
        lea (32,%a0),%a0\n",
            2 * random.below(8)
        ));
        defined.push(flags);
    }
    (code, defined)
}

fn on_the_base(code: &str) -> Vec<u8> {
    let code = format!("lea (RESULTS).l,%a0\n lea (RAM+0x60000).l,%a1\n{code}\n stop #0x2700");
    let mut base = Program { vectors: &[], sypcr: 4, code: &code }.base();
    base.run_until(SECOND / 5, &mut Unconnected);
    assert_eq!(base.cpu_state(), khepera::CpuState::Stopped, "{:?}", base.diagnostics());
    assert_eq!(base.diagnostics(), []);
    let words = (0..INSTRUCTIONS * RECORD_BYTES / 2)
        .map(|n| base.peek_word(RESULTS + 2 * n as u32).expect("RAM"));
    words.flat_map(u16::to_be_bytes).collect()
}

fn under_qemu(code: &str) -> Vec<u8> {
    let bytes = INSTRUCTIONS * RECORD_BYTES;
    // Linux: write(1, records, bytes); exit(0)
    let source = format!(
        "        lea records,%a0
        lea scratch,%a1
{code}
        moveq #4,%d0
        moveq #1,%d1
        move.l #records,%d2
        move.l #{bytes},%d3
        trap #0
        moveq #1,%d0
        moveq #0,%d1
        trap #0
        .bss
        .even
records: .space {bytes}
scratch: .space {}
",
        4 * SCRATCH_BYTES
    );
    let run = |elf: &Path| {
        Command::new("qemu-m68k")
            .args(["-cpu", "m68020"])
            .arg(elf)
            .output()
            .expect("qemu-m68k (Debian: qemu-user) runs programs for the m68k")
    };
    let output = build_at(&source, "0x80000000", run);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

#[test]
fn random_instructions_do_the_same_under_qemu() {
    for seed in 1..=6 {
        let (code, defined) = sequence(0x9E37_79B9_7F4A_7C15 ^ seed);
        let (ours, theirs) = (on_the_base(&code), under_qemu(&code));
        assert_eq!(ours.len(), theirs.len());
        let instructions: Vec<&str> = code.lines().collect();
        for (n, flags) in defined.iter().enumerate() {
            let record = n * RECORD_BYTES..(n + 1) * RECORD_BYTES;
            let (a, b) = (&ours[record.clone()], &theirs[record]);
            let codes = |record: &[u8]| u16::from(record[1]);
            let overflow = *flags == DIVISION && codes(a) & codes(b) & 2 != 0;
            let mask =
                if overflow { 2 } else { flags & 0x1F | if *flags == DIVISION { 0x1F } else { 0 } };
            let what = || {
                let record = |r: &[u8]| r.iter().map(|b| format!("{b:02x}")).collect::<String>();
                let marks = instructions.iter().enumerate().filter(|l| l.1.contains("%ccr,(%a0)+"));
                let at = marks.map(|l| l.0).nth(n).unwrap_or(0);
                format!(
                    "seed {seed}, instruction {n}: {}\nours  {}\nqemu  {}",
                    instructions[at - 3..at].join(";"),
                    record(a),
                    record(b)
                )
            };
            assert!(a[2..] == b[2..], "registers: {}", what());
            assert!(codes(a) & mask == codes(b) & mask, "flags: {}", what());
        }
    }
}
