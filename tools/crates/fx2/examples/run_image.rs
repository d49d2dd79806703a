//! Runs a program image on a chip without a board, enumerates it, and prints what was found.
//!
//! `cargo run --release -p fx2 --example run_image -- IMAGE [SECONDS] [full]`

use fx2::host::{Bench, Host, Link, Request};
use fx2::image::Image;
use fx2::pins::Unconnected;
use fx2::symbols::Symbols;
use fx2::{Config, Fx2, Ram};
use sim::SECOND;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("give an image: .ihx, .hex or raw")?;
    let seconds: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let mut host = if arguments.next().is_some() { Host::full_speed() } else { Host::new() };
    let image = Image::parse(&std::fs::read(&path)?)?;

    let mut fx2 = Fx2::new(Config { ram: Ram::K16, external_ram: false });
    fx2.load(&image)?;
    let mut board = Unconnected;
    let mut bench = Bench { fx2: &mut fx2, board: &mut board };
    // Firmware that was just loaded takes its time to leave the bus and come back as another device.
    bench.run_until(SECOND);
    match host.enumerate(&mut bench) {
        Ok(device) => {
            println!(
                "{:04x}:{:04x} release {:04x}, {:?} speed, configuration of {} bytes",
                device.vendor(),
                device.product(),
                device.release(),
                device.speed,
                device.configuration.len()
            );
            for index in device.device[14..17].iter().filter(|&&index| index != 0) {
                let value = 0x0300 | u16::from(*index);
                let get = Request { kind: 0x80, request: 6, value, index: 0x0409 };
                let bytes = host.control_in(&mut bench, get, 255)?;
                let units: Vec<u16> = bytes
                    .get(2..)
                    .unwrap_or_default()
                    .chunks_exact(2)
                    .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
                    .collect();
                println!("string {index}: {}", String::from_utf16_lossy(&units));
            }
        }
        Err(error) => println!("no enumeration: {error}"),
    }
    let started = Instant::now();
    let until = bench.fx2.now() + seconds * SECOND;
    bench.run_until(until);
    let factor = seconds as f64 / started.elapsed().as_secs_f64();
    println!("{seconds} s more at {factor:.1} times real time, PC {:#06x}", fx2.cpu().pc());
    let map = std::fs::read_to_string(Path::new(&path).with_extension("map")).unwrap_or_default();
    let symbols = Symbols::parse(&map);
    for diagnostic in fx2.diagnostics() {
        println!("{}", symbols.describe(diagnostic));
    }
    Ok(())
}
