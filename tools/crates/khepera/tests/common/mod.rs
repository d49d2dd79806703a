//! Small 68k programs for the emulated base, assembled when a test runs.

#![allow(dead_code)] // every test file uses a part of it

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use khepera::turret_bus::TurretBus;
use khepera::{Base, Config};
use sim::Ps;

/// Where programs leave their results.
pub const RESULTS: u32 = 0x10_1000;
/// What `unexpected` leaves at `RESULTS`.
pub const UNEXPECTED: u16 = 0xDEAD;

/// Register addresses, and the set-up that every program starts with: 25.166 MHz, watchdog off and
/// bus monitor on, flash and RAM on their chip selects with one wait state.
const PRELUDE: &str = "
        .equ    SIMCR, 0xFFFFFA00
        .equ    SYNCR, 0xFFFFFA04
        .equ    RSR, 0xFFFFFA07
        .equ    PORTF, 0xFFFFFA19
        .equ    DDRF, 0xFFFFFA1D
        .equ    PEPAR, 0xFFFFFA17
        .equ    PFPAR, 0xFFFFFA1F
        .equ    SYPCR, 0xFFFFFA21
        .equ    PICR, 0xFFFFFA22
        .equ    PITR, 0xFFFFFA24
        .equ    SWSR, 0xFFFFFA27
        .equ    CSBARBT, 0xFFFFFA48
        .equ    CSORBT, 0xFFFFFA4A
        .equ    CSBAR0, 0xFFFFFA4C
        .equ    CSOR0, 0xFFFFFA4E
        .equ    CSBAR1, 0xFFFFFA50
        .equ    CSOR1, 0xFFFFFA52
        .equ    GPTMCR, 0xFFFFF900
        .equ    ICR, 0xFFFFF904
        .equ    DDRGP, 0xFFFFF906
        .equ    PORTGP, 0xFFFFF907
        .equ    TCNT, 0xFFFFF90A
        .equ    TIC1, 0xFFFFF90E
        .equ    TOC1, 0xFFFFF914
        .equ    TCTL2, 0xFFFFF91F
        .equ    TMSK1, 0xFFFFF920
        .equ    TFLG1, 0xFFFFF922
        .equ    PWMA, 0xFFFFF926
        .equ    PWMB, 0xFFFFF927
        .equ    QSMCR, 0xFFFFFC00
        .equ    QILR, 0xFFFFFC04
        .equ    QIVR, 0xFFFFFC05
        .equ    SCCR0, 0xFFFFFC08
        .equ    SCCR1, 0xFFFFFC0A
        .equ    SCSR, 0xFFFFFC0C
        .equ    SCDR, 0xFFFFFC0E
        .equ    PORTQS, 0xFFFFFC15
        .equ    PQSPAR, 0xFFFFFC16
        .equ    DDRQS, 0xFFFFFC17
        .equ    SPCR0, 0xFFFFFC18
        .equ    SPCR1, 0xFFFFFC1A
        .equ    SPCR2, 0xFFFFFC1C
        .equ    SPCR3, 0xFFFFFC1E
        .equ    SPSR, 0xFFFFFC1F
        .equ    QRX, 0xFFFFFD00
        .equ    QTX, 0xFFFFFD20
        .equ    QCMD, 0xFFFFFD40
        .equ    RAM, 0x100000
        .equ    RESULTS, 0x101000
reset:  move.b  #SYPCR_VALUE,(SYPCR).w
        move.w  #0xD700,(SYNCR).w
        move.w  #0x0006,(CSBARBT).w
        move.w  #0x7870,(CSORBT).w
        move.w  #0x1006,(CSBAR0).w
        move.w  #0x5870,(CSOR0).w
        move.w  #0x1006,(CSBAR1).w
        move.w  #0x3870,(CSOR1).w
        jmp     main
unexpected:
        move.w  #0xDEAD,(RESULTS).l
        stop    #0x2700
main:
";

/// A program: vectors that it handles, and its code from `main` on.
pub struct Program<'a> {
    /// Vector number and label of the handler; others lead to `unexpected`.
    pub vectors: &'a [(usize, &'a str)],
    /// What goes to SYPCR: 4 = bus monitor only.
    pub sypcr: u8,
    /// GNU assembler source.
    pub code: &'a str,
}

impl Program<'_> {
    /// The ELF image.
    ///
    /// # Panics
    /// If the assembler is missing or does not like the program.
    pub fn build(&self) -> Vec<u8> {
        let vectors = |n: usize| match n {
            0 => "0x180000",
            1 => "reset",
            _ => self.vectors.iter().find(|v| v.0 == n).map_or("unexpected", |v| v.1),
        };
        let table: String = (0..256).map(|n| format!("        .long {}\n", vectors(n))).collect();
        let sypcr = self.sypcr;
        let source = format!("        .equ SYPCR_VALUE, {sypcr}\n{table}{PRELUDE}{}\n", self.code);
        assemble(&source)
    }

    /// A base with this program in its flash.
    pub fn base(&self) -> Base {
        Base::new(&self.build(), Config::default()).expect("the program is an image")
    }
}

/// Assembles and links `source` with its text at `text`; what `with_file` makes of the ELF file.
pub fn build_at<R>(source: &str, text: &str, with_file: impl FnOnce(&Path) -> R) -> R {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let unique = format!("{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let file = |ending: &str| -> PathBuf {
        PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("program-{unique}.{ending}"))
    };
    std::fs::write(file("s"), source).expect("the target directory is writable");
    run(Command::new("m68k-linux-gnu-as").arg("-mcpu32").arg("-o").arg(file("o")).arg(file("s")));
    run(Command::new("m68k-linux-gnu-ld")
        .arg(format!("-Ttext={text}"))
        .arg(format!("-e{text}"))
        .arg("-o")
        .arg(file("elf"))
        .arg(file("o")));
    let made = with_file(&file("elf"));
    for ending in ["s", "o", "elf"] {
        std::fs::remove_file(file(ending)).expect("it was there");
    }
    made
}

fn assemble(source: &str) -> Vec<u8> {
    build_at(source, "0", |elf| std::fs::read(elf).expect("the linker wrote it"))
}

fn run(command: &mut Command) {
    let output =
        command.output().expect("m68k-linux-gnu binutils (Debian: binutils-m68k-linux-gnu)");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The word at `RESULTS + offset`.
pub fn result(base: &Base, offset: u32) -> u16 {
    base.peek_word(RESULTS + offset).expect("RAM is mapped")
}

/// The long word at `RESULTS + offset`.
pub fn result_long(base: &Base, offset: u32) -> u32 {
    u32::from(result(base, offset)) << 16 | u32::from(result(base, offset + 2))
}

/// A turret that notes what happens on the bus and answers from a list.
#[derive(Clone, Default)]
pub struct Recorder {
    pub selects: Vec<(Ps, u8)>,
    pub words: Vec<(Ps, u16, u8)>,
    pub answers: Vec<u16>,
    /// IRQ lines that are pulled low.
    pub asserted: u8,
    /// Time of the last call.
    pub last: Ps,
}

impl Recorder {
    fn at(&mut self, now: Ps) {
        assert!(now >= self.last, "time went back from {} to {now}", self.last);
        self.last = now;
    }
}

impl TurretBus for Recorder {
    fn select(&mut self, now: Ps, pcs: u8) {
        self.at(now);
        self.selects.push((now, pcs));
    }

    fn exchange(&mut self, now: Ps, word: u16, bits: u8) -> u16 {
        self.at(now);
        self.words.push((now, word, bits));
        self.answers.get(self.words.len() - 1).copied().unwrap_or(0xFFFF)
    }

    fn irq_pins(&mut self, now: Ps) -> u8 {
        self.at(now);
        !self.asserted
    }
}
