//! Lock step with ucsim: random programs run on this core and on Debian's `s51 -t DS320`, and after
//! every instruction both must agree on registers, flags, PC and cycles, after every case on all
//! RAM.
//!
//! The DS80C320 has the FX2's instruction timing, stretch and second data pointer. Where the two
//! differ, a function or table says so with the reason, and nothing else is left out:
//! [`program::EXCLUDED`], [`program::reserved_bits`], [`program::constant_beyond_code`],
//! [`reference::charged_cycles`] and [`reference::Stop::registers`].
//!
//! `MCS51_SEED=0x1234 cargo test --release -p mcs51 --test lock_step` replays one batch.

mod arithmetic;
mod compare;
mod program;
mod reference;

use program::Batch;

/// Seeds of the batches; each makes its own 64 KB of code and its own cases.
const BATCHES: u64 = 4;
/// Each opcode that the reference knows must have run at least this often in all.
const RUNS_PER_OPCODE: u32 = 40;

#[test]
fn random_programs_run_as_on_ucsim() {
    if let Ok(seed) = std::env::var("MCS51_SEED") {
        let digits = seed.trim_start_matches("0x");
        let seed = u64::from_str_radix(digits, 16).expect("MCS51_SEED is a hexadecimal number");
        run_batch(seed, &mut [0; 256]);
        return;
    }
    let mut runs = [0; 256];
    for seed in 0..BATCHES {
        run_batch(seed, &mut runs);
    }
    println!("{} instructions agreed", runs.iter().sum::<u32>());
    for (opcode, &count) in runs.iter().enumerate() {
        assert!(count >= RUNS_PER_OPCODE, "opcode {opcode:02X} ran only {count} times");
    }
}

#[test]
fn arithmetic_of_all_bytes_is_as_on_ucsim() {
    if let Err(difference) = arithmetic::compare() {
        panic!("{difference}");
    }
}

/// Runs one batch on both, panics where they differ, and counts the opcodes that ran.
fn run_batch(seed: u64, runs: &mut [u32; 256]) {
    let batch = Batch::generate(seed);
    let answers = reference::run_batch(seed, &batch);
    if let Err(difference) = compare::compare(&batch, &answers) {
        panic!("seed {seed:#x} (replay with MCS51_SEED={seed:#x}):\n{difference}");
    }
    for step in batch.cases.iter().flat_map(|case| &case.steps) {
        runs[usize::from(step.opcode)] += 1;
    }
}
