//! Both runs side by side.

use std::fmt::Write as _;

use crate::program::{Batch, Case, Registers, Step, reserved_bits};
use crate::reference::{Answers, Dump, Stop, charged_cycles};

/// Instructions shown before a difference.
const CONTEXT: usize = 12;

/// Compares everything; the error tells the first difference.
pub fn compare(batch: &Batch, answers: &Answers) -> Result<(), String> {
    let mut stops = answers.stops.iter();
    let mut dumps = answers.dumps.iter();
    for (number, case) in batch.cases.iter().enumerate() {
        compare_case(case, &mut stops, &mut dumps)
            .map_err(|difference| format!("case {number}: {difference}"))?;
    }
    let xdata = dumps.next().ok_or("s51 ended before its last dump")?;
    let expected: Dump = (0..=0xFFFF).zip(batch.xdata_after.iter().copied()).collect();
    compare_memory("xdata at the end", &expected, xdata, |_| 0)?;
    if stops.next().is_some() || dumps.next().is_some() {
        return Err("s51 answered more than it was asked".into());
    }
    Ok(())
}

fn compare_case<'a>(
    case: &Case,
    stops: &mut impl Iterator<Item = &'a Stop>,
    dumps: &mut impl Iterator<Item = &'a Dump>,
) -> Result<(), String> {
    for (index, step) in case.steps.iter().enumerate() {
        let stop = stops.next().ok_or("s51 ended early")?;
        let difference = compare_step(step, stop).and_then(|()| match step.written {
            Some(written) => compare_written(written, dumps.next().ok_or("s51 ended early")?),
            None => Ok(()),
        });
        difference.map_err(|difference| format!("{difference}\n{}", listing(case, index)))?;
    }
    let last = case.steps.len().saturating_sub(1);
    compare_end(case, dumps).map_err(|difference| format!("{difference}\n{}", listing(case, last)))
}

fn compare_step(step: &Step, stop: &Stop) -> Result<(), String> {
    let cycles = charged_cycles(step.opcode, step.cycles);
    if stop.pc != step.pc || stop.cycles != cycles {
        return Err(format!(
            "PC {:04X}, {cycles} cycles; s51 has {:04X}, {}",
            step.pc, stop.pc, stop.cycles
        ));
    }
    let Some(shown) = &stop.registers else { return Ok(()) };
    let parity = match step.written {
        Some((address, _)) if address == mcs51::sfr::PSW => reserved_bits(address),
        _ => 0,
    };
    let masked = |registers: &Registers| Registers { psw: registers.psw & !parity, ..*registers };
    if masked(shown) == masked(&step.registers) {
        return Ok(());
    }
    Err(format!("{:02X?};\n    s51 has {shown:02X?}", step.registers))
}

fn compare_written((address, value): (u8, u8), dump: &Dump) -> Result<(), String> {
    compare_memory("written register", &vec![(address.into(), value)], dump, |_| {
        reserved_bits(address)
    })
}

fn compare_end<'a>(case: &Case, dumps: &mut impl Iterator<Item = &'a Dump>) -> Result<(), String> {
    let iram: Dump = (0..=0xFF).zip(case.iram_after).collect();
    compare_memory("internal RAM", &iram, dumps.next().ok_or("s51 ended early")?, |_| 0)?;
    let sfr: Dump =
        case.sfr_after.iter().map(|&(address, value)| (address.into(), value)).collect();
    let all = dumps.next().ok_or("s51 ended early")?;
    let shared: Dump =
        all.iter().copied().filter(|(address, _)| sfr.iter().any(|(a, _)| a == address)).collect();
    compare_memory("special function register", &sfr, &shared, |_| 0)?;
    for &written in &case.xdata_after {
        let dump = dumps.next().ok_or("s51 ended early")?;
        compare_memory("xdata", &vec![written], dump, |_| 0)?;
    }
    Ok(())
}

/// Compares bytes but for the bits that `ignored` gives for an address.
pub fn compare_memory(
    what: &str,
    ours: &Dump,
    theirs: &Dump,
    ignored: impl Fn(u16) -> u8,
) -> Result<(), String> {
    if ours.len() != theirs.len() {
        return Err(format!("{what}: s51 showed {} of {} bytes", theirs.len(), ours.len()));
    }
    for (&(address, our), &(at, their)) in ours.iter().zip(theirs) {
        if at != address || (our ^ their) & !ignored(address) != 0 {
            return Err(format!(
                "{what} {address:04X} is {our:02X}; s51 has {their:02X} at {at:04X}"
            ));
        }
    }
    Ok(())
}

/// The instructions up to number `index` of a case, the differing one last.
fn listing(case: &Case, index: usize) -> String {
    let first = (index + 1).saturating_sub(CONTEXT);
    let mut text = String::new();
    for step in case.steps.iter().take(index + 1).skip(first) {
        writeln!(text, "  {:04X}  {:24} {:02X?}", step.address, step.text, step.registers)
            .expect("a string grows");
    }
    text
}
