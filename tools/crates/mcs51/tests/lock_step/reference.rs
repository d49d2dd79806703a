//! ucsim's `s51`, driven by a script, and its answers.
//!
//! One process a batch: it gets a script file, so there is no dialogue that could stall, and a
//! deadline.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{Batch, Case, Registers};

/// Generous: a batch takes about three seconds.
const DEADLINE: Duration = Duration::from_secs(60);
const CLOCKS_PER_CYCLE: u32 = 4;

/// Machine cycles that the reference charges although the data books (TRM and DS80C320) say
/// otherwise: it adds the time of the plain 8051's MUL and DIV to that of the DS80C320's (2 + 5),
/// and it does not charge the reserved opcode.
pub fn charged_cycles(opcode: u8, cycles: u32) -> u32 {
    match opcode {
        0x84 | 0xA4 => cycles + 2,
        0xA5 => 0,
        _ => cycles,
    }
}

/// What the reference reported after a step.
pub struct Stop {
    pub pc: u16,
    pub cycles: u32,
    /// `None` when it stopped with "stack overflow", which it reports when SP wraps: it has
    /// executed the instruction then, but shows no registers until the next.
    pub registers: Option<Registers>,
}

/// A memory dump: addresses and bytes.
pub type Dump = Vec<(u16, u8)>;

#[derive(Default)]
pub struct Answers {
    pub stops: Vec<Stop>,
    pub dumps: Vec<Dump>,
}

/// Runs `script` on the reference; `files` are what it loads.
pub fn run(name: &str, files: &[(&str, String)], script: &str) -> Answers {
    let directory = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("lock-step-{name}"));
    fs::create_dir_all(&directory).expect("a scratch directory");
    for (file, text) in files {
        fs::write(directory.join(file), text).expect("a file is written");
    }
    fs::write(directory.join("script"), format!("{script}quit\n")).expect("the script is written");
    let text = execute(&directory);
    let answers = parse(&text);
    fs::remove_dir_all(&directory).expect("the scratch directory is removed");
    answers
}

/// Runs a batch on the reference.
pub fn run_batch(seed: u64, batch: &Batch) -> Answers {
    run(&format!("{seed:x}"), &[("code.ihx", intel_hex(&batch.code))], &script(batch))
}

fn execute(directory: &Path) -> String {
    let output = directory.join("output");
    let mut child = Command::new("s51")
        .args(["-q", "-b", "-P", "-t", "DS320", "-C", "script"])
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(File::create(&output).expect("an output file"))
        .stderr(Stdio::null())
        .spawn()
        .expect("s51 starts: it is the reference of this test; install sdcc-ucsim");
    let start = Instant::now();
    while child.try_wait().expect("s51 can be waited for").is_none() {
        if start.elapsed() > DEADLINE {
            child.kill().expect("s51 can be killed");
            child.wait().expect("s51 ends");
            panic!("s51 did not finish within {DEADLINE:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let bytes = fs::read(output).expect("s51's output");
    String::from_utf8_lossy(&bytes).into_owned()
}

fn intel_hex(code: &[u8]) -> String {
    let mut text = String::new();
    for (row, bytes) in code.chunks(16).enumerate() {
        let address = (row * 16) as u16;
        let mut record = vec![bytes.len() as u8];
        record.extend(address.to_be_bytes());
        record.push(0);
        record.extend(bytes);
        let sum = record.iter().fold(0_u8, |sum, &byte| sum.wrapping_add(byte));
        record.push(sum.wrapping_neg());
        let digits: String = record.iter().map(|byte| format!("{byte:02X}")).collect();
        writeln!(text, ":{digits}").expect("a string grows");
    }
    text + ":00000001FF\n"
}

fn script(batch: &Batch) -> String {
    let mut text = String::from("file \"code.ihx\"\n");
    for (page, bytes) in batch.xdata.chunks(256).enumerate() {
        set_memory(&mut text, "xram", (page * 256) as u16, bytes);
    }
    for case in &batch.cases {
        script_case(&mut text, case);
    }
    text + "dump xram 0 0xffff\n"
}

fn script_case(text: &mut String, case: &Case) {
    set_memory(text, "iram", 0, &case.iram);
    for run in case.sfr.chunk_by(|(address, _), (next, _)| *next == address + 1) {
        let values: Vec<u8> = run.iter().map(|&(_, value)| value).collect();
        set_memory(text, "sfr", run[0].0.into(), &values);
    }
    // Again, because a write of ACC changes its parity.
    for &(address, value) in case.sfr.iter().filter(|(address, _)| *address == mcs51::sfr::PSW) {
        set_memory(text, "sfr", address.into(), &[value]);
    }
    writeln!(text, "pc {:#x}", case.pc).expect("a string grows");
    for step in &case.steps {
        text.push_str("step\n");
        if let Some((address, value)) = step.written {
            writeln!(text, "dump sfr {address:#x} {address:#x}").expect("a string grows");
            set_memory(text, "sfr", address.into(), &[value]);
        }
    }
    text.push_str("dump iram 0 0xff\ndump sfr 0x80 0xff\n");
    for (address, _) in &case.xdata_after {
        writeln!(text, "dump xram {address:#x} {address:#x}").expect("a string grows");
    }
}

pub fn set_memory(text: &mut String, space: &str, address: u16, bytes: &[u8]) {
    write!(text, "set memory {space} {address:#x}").expect("a string grows");
    for byte in bytes {
        write!(text, " {byte}").expect("a string grows");
    }
    text.push('\n');
}

fn parse(text: &str) -> Answers {
    let mut answers = Answers::default();
    let mut in_dump = false;
    let mut lines = text.lines().map(|line| line.trim_end_matches('\r')).peekable();
    while let Some(line) = lines.next() {
        if line.starts_with("dump ") {
            answers.dumps.push(Dump::new());
            in_dump = true;
        } else if let Some(rest) = line.strip_prefix("Stop at 0x") {
            in_dump = false;
            let block: Vec<&str> = std::iter::once(rest)
                .chain(std::iter::from_fn(|| lines.next_if(|next| !is_end_of_stop(next))))
                .collect();
            answers.stops.push(parse_stop(&block));
        } else if !line.starts_with("0x") {
            in_dump = false;
        } else if let (true, Some(dump)) = (in_dump, answers.dumps.last_mut()) {
            parse_dump_line(line, dump);
        }
    }
    answers
}

/// The next command's echo.
fn is_end_of_stop(line: &str) -> bool {
    ["step", "dump", "set", "quit"].iter().any(|command| line.starts_with(command))
}

fn hex(digits: &str) -> u16 {
    let end = digits.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(digits.len());
    u16::from_str_radix(&digits[end.saturating_sub(4)..end], 16)
        .unwrap_or_else(|_| panic!("s51 shows a number at {digits:?}"))
}

fn hex_byte(digits: &str) -> u8 {
    hex(digits).to_le_bytes()[0]
}

/// `block` starts behind "Stop at 0x" and ends before the next command.
fn parse_stop(block: &[&str]) -> Stop {
    let text = block.join("\n");
    let after = |key: &str| text.split_once(key).map(|(_, rest)| rest);
    let ticks = after("stepped ").or_else(|| after("Simulated ")).expect("s51 shows the ticks");
    let end = ticks.find(' ').expect("a unit follows the ticks");
    let clocks: u32 = ticks[..end].parse().expect("the ticks are a number");
    assert_eq!(clocks % CLOCKS_PER_CYCLE, 0, "whole machine cycles: {text}");
    Stop {
        pc: hex(&text),
        cycles: clocks / CLOCKS_PER_CYCLE,
        registers: after("R0 R1 R2 R3 R4 R5 R6 R7\n").map(parse_registers),
    }
}

/// `text` starts with the values of R0..R7.
fn parse_registers(text: &str) -> Registers {
    let field = |key: &str| {
        text.split_once(key).map(|(_, rest)| rest).unwrap_or_else(|| panic!("{key} in {text:?}"))
    };
    let mut values = text.split_whitespace().map(hex_byte);
    Registers {
        r: std::array::from_fn(|_| values.next().expect("eight registers")),
        acc: hex_byte(field("ACC= 0x")),
        b: hex_byte(field(" B= 0x")),
        psw: hex_byte(field("PSW= 0x")),
        sp: hex_byte(field("SP 0x")),
        dptr: [hex(field("DPTR0= 0x")), hex(field("DPTR1= 0x"))],
        dps: u8::from(text.contains("*DPTR1")),
        at_r0: hex_byte(field("@R0 ")),
        at_r1: hex_byte(field("@R1 ")),
        at_sp: hex_byte(field("-> ")),
    }
}

/// Two forms: `0x86 DPS: 0b00000000 0x00 ...` for a named register, or an address and up to eight
/// bytes in fixed columns, then text.
fn parse_dump_line(line: &str, dump: &mut Dump) {
    const FIRST_COLUMN_AFTER_ADDRESS: usize = 22;
    let mut address = hex(&line[2..]);
    if let Some((_, value)) = line.split_once(" 0b").and_then(|(_, rest)| rest.split_once(" 0x")) {
        dump.push((address, hex_byte(value)));
        return;
    }
    let digits = line.find(' ').unwrap_or(line.len());
    let column = digits + FIRST_COLUMN_AFTER_ADDRESS;
    for n in 0..8 {
        let Some(cell) = line.get(column + 3 * n..column + 3 * n + 2) else { return };
        if cell.trim().is_empty() {
            return;
        }
        dump.push((address, hex_byte(cell)));
        address = address.wrapping_add(1);
    }
}
