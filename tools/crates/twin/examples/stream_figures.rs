//! Figures of the stream, from the twin in simulated time: rates on the bus, frames, the FX2's load, and
//! how long a pair takes from its last pixel to its last byte.
//!
//! `cargo run --release -p twin --example stream_figures` prints them as a table; with `--soak SECONDS`
//! both formats are streamed for so long, everything is checked on the fly and nothing is kept. The
//! firmware images are those of CMake's preset `firmware`. Exit code 1 if a check fails.

use std::path::Path;
use std::process::ExitCode;

use fx2::host::{Host, Link};
use sim::{MS, Ps, SECOND};
use twin::desk::Desk;
use twin::receiver::{Error, Receiver, Settings};
use twin::robot::{Images, Robot};
use virtex::bitstream;
use virtex::design::Function;
use virtex::store::{Entry, pack};

const SMALL: Settings = Settings { large: false, pattern: false, rate: 40 };
const LARGE: Settings = Settings { large: true, pattern: false, rate: 30 };
/// Machine cycles of the FX2's CPU in a second.
const CYCLES: f64 = 12e6;
const HEADINGS: &str = "| stream | MB/s | frames/s | FX2's CPU | last pixel to last byte, mean / longest \
                        | pairs | lost | reports that differ |\n|---|---|---|---|---|---|---|---|";

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn desk(function: Function, packets: u8) -> Outcome<(Desk, Receiver)> {
    let built = |path: &str| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../build/firmware");
        std::fs::read(folder.join(path)).map_err(|error| {
            format!("{path}: {error}; cmake --preset firmware && cmake --build --preset firmware")
        })
    };
    let bits = bitstream::make(function, &bitstream::Options::default());
    let images = Images {
        fx2: built("fx2-firmware/fx2-firmware.ihx")?,
        khepera: built("khepera-firmware/khepera-firmware.elf")?,
        flash: pack(&[Entry::from_file(0, &bits, "figures".into())?], 0),
    };
    let mut desk = Desk::new(Robot::new(&images)?, 5);
    let mut host = Host::new();
    host.set_packet_limit(packets);
    host.enumerate(&mut desk)?;
    let settled = desk.robot.now() + 100 * MS;
    desk.run_until(settled);
    let mut receiver = Receiver::new(host);
    receiver.measure_from(desk.robot.turret.fpga.started());
    desk.robot.base.serial_send(b"start 0\r\n");
    Ok((desk, receiver))
}

/// One row of the table. True if everything that came was right, without a loss.
fn row(name: &str, function: Function, packets: u8, wanted: &Settings, time: Ps) -> Outcome<bool> {
    let (mut desk, mut receiver) = desk(function, packets)?;
    receiver.start(&mut desk, wanted)?;
    receiver.read_for(&mut desk, 50 * MS)?;
    let (began, cycles, counts) = (desk.robot.now(), desk.fx2().cycles(), receiver.counts);
    read(&mut desk, &mut receiver, time, name)?;
    let seconds = (desk.robot.now() - began) as f64 / SECOND as f64;
    let load = (desk.fx2().cycles() - cycles) as f64 / CYCLES / seconds;
    let rate = (receiver.counts.bytes - counts.bytes) as f64 / seconds / 1e6;
    let frames = (receiver.counts.frames - counts.frames) as f64 / seconds;
    receiver.stop(&mut desk)?;
    let counts = receiver.counts;
    let found = receiver.finish();
    let latency = match counts.pairs {
        0 => "–".into(),
        pairs => format!(
            "{:.2} / {:.2} ms",
            (counts.latency_sum / pairs) as f64 / MS as f64,
            counts.latency_max as f64 / MS as f64
        ),
    };
    println!(
        "| {name} | {rate:.2} | {frames:.1} | {:.2} % | {latency} | {} | {} | {} |",
        100.0 * load,
        found.pairs,
        found.lost,
        found.reports_differ
    );
    found.problems.iter().for_each(|problem| eprintln!("{name}: {problem}"));
    Ok(found.all_right() && found.lost == 0)
}

/// Read for `time`, and say each simulated minute that it goes on.
fn read(desk: &mut Desk, receiver: &mut Receiver, time: Ps, name: &str) -> Result<(), Error> {
    let until = desk.robot.now() + time;
    while desk.robot.now() < until {
        let left = until - desk.robot.now();
        receiver.read_for(desk, left.min(60 * SECOND))?;
        if time > 60 * SECOND {
            let found = receiver.findings();
            let (pairs, lost, differ) = (found.pairs, found.lost, found.reports_differ);
            eprintln!("{name}: {pairs} pairs, {lost} lost, {differ} reports differ");
        }
    }
    Ok(())
}

fn run() -> Outcome<bool> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let soak = match arguments.as_slice() {
        [] => None,
        [option, seconds] if option == "--soak" => Some(seconds.parse::<u32>()?),
        _ => return Err("usage: stream_figures [--soak SECONDS]".into()),
    };
    println!("{HEADINGS}");
    let time = soak.map_or(5 * SECOND, |seconds| Ps::from(seconds) * SECOND);
    let mut good = row("320×240, 40 a second", Function::Soccer, 13, &SMALL, time)?;
    good &= row("640×480, 30 a second", Function::Soccer, 13, &LARGE, time)?;
    if soak.is_none() {
        let pattern = Settings { pattern: true, ..SMALL };
        for packets in [13, 11] {
            let name = format!("test pattern, {packets} packets a microframe");
            good &= row(&name, Function::Capture, packets, &pattern, SECOND)?;
        }
    }
    Ok(good)
}

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("stream_figures: {error}");
            ExitCode::FAILURE
        }
    }
}
