//! Programs of random bytes: whatever they do, the base goes on, and twice in the same way.

mod common;

use common::{Program, Recorder};
use khepera::{Base, Config};
use sim::MS;

/// xorshift64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
}

/// Stack and reset vector in order, everything else random.
fn random_image(seed: u64) -> Vec<u8> {
    let mut random = Random(seed | 1 << 40);
    let mut lines = String::new();
    let mut record = |address: u32, data: &[u8]| {
        let mut bytes = vec![data.len() as u8 + 5];
        bytes.extend(address.to_be_bytes());
        bytes.extend(data);
        bytes.push(!bytes.iter().fold(0u8, |sum, &b| sum.wrapping_add(b)));
        let hex: String = bytes.iter().map(|b| format!("{b:02X}")).collect();
        lines.push_str(&format!("S3{hex}\n"));
    };
    record(0, &[0x00, 0x18, 0x00, 0x00, 0x00, 0x00, 0x04, 0x00]);
    for row in 0..128 {
        let data: Vec<u8> = (0..32).map(|_| random.next() as u8).collect();
        record(0x400 + 32 * row, &data);
    }
    lines.into_bytes()
}

#[test]
fn programs_of_random_bytes_do_no_harm_and_repeat() {
    for seed in 1..=200 {
        let run = || {
            let mut base = Base::new(&random_image(seed), Config::default()).expect("an image");
            base.serial_send(b"random");
            base.run_until(3 * MS, &mut Recorder::default());
            (base.now(), base.registers(), base.pc(), base.sr(), base.load())
        };
        assert_eq!(run(), run(), "seed {seed}");
    }
}

#[test]
fn random_register_writes_do_no_harm() {
    // A linear congruential generator picks register, width and value, and some time passes.
    let code = |seed: u64| {
        format!(
            "move.l #{seed},%d0
             lea (0xFFFFF900).w,%a1
             loop: mulu.l #1664525,%d0
             add.l #1013904223,%d0
             move.l %d0,%d1
             swap %d1
             and.l #0x3FE,%d1
             cmp.w #0x120,%d1          | leave SYPCR, CSBARBT and what is above alone
             beq loop
             cmp.w #0x144,%d1
             bcs safe
             cmp.w #0x180,%d1
             bcs loop
             safe: cmp.w #0x104,%d1
             beq loop
             move.w %d0,(%a1,%d1.w)
             move.w (%a1,%d1.w),%d2
             btst #3,%d0
             beq loop
             move.b %d0,1(%a1,%d1.w)
             move.b (%a1,%d1.w),%d2
             bra loop
             skip: lea 0x180000,%sp
             bra loop"
        )
    };
    for seed in 1..=20 {
        let code = code(seed * 7919);
        let every: Vec<(usize, &str)> = (2..256).map(|n| (n, "skip")).collect();
        let mut base = Program { vectors: &every, sypcr: 4, code: &code }.base();
        base.serial_send(&[0x55; 200]);
        let mut turret = Recorder::default();
        for ms in 1..=40 {
            turret.asserted = (ms * 37) as u8;
            base.run_until(ms * MS, &mut turret);
        }
        assert!(base.load().instructions > 10_000, "seed {seed}: {:?}", base.load());
    }
}
