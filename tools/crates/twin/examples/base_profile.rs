//! Where the 68331's time goes, by function: `cargo run --release -p twin --example base_profile`
//! after the firmware has been built. Three cases: standing, driving at a number of K-Team's speed
//! units, and a match against `chaser` with measured noise. Clocks are those of the emulated base,
//! approximate as its instruction times are; an interrupt's own clocks count to its handler.
//!
//!     base_profile stand | drive UNITS | play SEED SECONDS

use std::collections::BTreeMap;
use std::env;
use std::path::Path;
use std::process::ExitCode;

use khepera::turret_bus::Unconnected;
use khepera::{Base, Config};
use object::{Object, ObjectSymbol, SymbolKind};
use sim::{MS, Ps, SECOND};
use twin::game::{BallColour, Eyes, Format, Game, Materials, Noise, Other, Setup};
use twin::robot::Images;
use virtex::bitstream;
use virtex::design::Function;
use virtex::store::{Entry, pack};
use world::opponents::Kind;

/// From power-on until the program listens, and until a wheel has its speed.
const READY: Ps = 500 * MS;
const SETTLED: Ps = 500 * MS;
const MEASURED: Ps = 2 * SECOND;
/// Functions that take less of the time than this are summed up.
const SMALL: f64 = 0.0005;
const TICKS_A_SECOND: f64 = 100.0;

fn built(path: &str) -> Result<Vec<u8>, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../build/firmware").join(path);
    std::fs::read(&path).map_err(|error| {
        format!(
            "{}: {error}; build it with: cmake --preset firmware && cmake --build --preset firmware",
            path.display()
        )
    })
}

/// Functions of an ELF by their addresses.
fn functions(image: &[u8]) -> Result<BTreeMap<u32, String>, String> {
    let file = object::File::parse(image).map_err(|error| error.to_string())?;
    let symbols = file.symbols().filter(|s| {
        s.kind() == SymbolKind::Text || s.kind() == SymbolKind::Unknown && s.is_definition()
    });
    Ok(symbols.map(|s| (s.address() as u32, s.name().unwrap_or("?").to_owned())).collect())
}

fn print(base: &Base, image: &[u8], seconds: f64) -> Result<(), String> {
    let functions = functions(image)?;
    let mut clocks: BTreeMap<&str, u64> = BTreeMap::new();
    for (address, count) in base.profiled() {
        let name = functions.range(..=address).next_back().map_or("?", |(_, name)| name);
        *clocks.entry(name).or_default() += count;
    }
    let all = base.system_hz() as f64 * seconds;
    let mut rows: Vec<(&str, u64)> = clocks.into_iter().collect();
    rows.sort_by_key(|row| std::cmp::Reverse(row.1));
    println!("{:>7} {:>12}  function", "share", "clocks/tick");
    let mut small = 0;
    for (name, count) in &rows {
        let share = *count as f64 / all;
        if share < SMALL {
            small += count;
        } else {
            let tick = *count as f64 / (seconds * TICKS_A_SECOND);
            println!("{:6.2}% {tick:12.0}  {name}", share * 100.0);
        }
    }
    let sum: u64 = rows.iter().map(|row| row.1).sum();
    println!("{:6.2}% {:12}  all others", small as f64 / all * 100.0, "");
    println!("{:6.2}% {:12}  all", sum as f64 / all * 100.0, "");
    Ok(())
}

fn drive(units: &str) -> Result<(), String> {
    let image = built("khepera-firmware/khepera-firmware.elf")?;
    let mut base = Base::new(&image, Config::default()).map_err(|error| error.to_string())?;
    base.run_until(READY, &mut Unconnected);
    base.serial_send(format!("D,{units},{units}\n").as_bytes());
    base.run_until(READY + SETTLED, &mut Unconnected);
    base.profile();
    base.run_until(READY + SETTLED + MEASURED, &mut Unconnected);
    print(&base, &image, MEASURED as f64 / SECOND as f64)
}

fn play(seed: u64, seconds: u64) -> Result<(), String> {
    let stream = bitstream::make(Function::Soccer, &bitstream::Options::default());
    let slot = Entry::from_file(0, &stream, "soccer".into()).map_err(|error| error.to_string())?;
    let images = Images {
        fx2: built("fx2-firmware/fx2-firmware.ihx")?,
        khepera: built("khepera-firmware/khepera-firmware.elf")?,
        flash: pack(&[slot], 0),
    };
    let image = images.khepera.clone();
    let mut game = Game::new(Setup {
        seed,
        images,
        other: Other::Program(Kind::Chaser),
        eyes: Eyes::Open,
        ball: BallColour::Yellow,
        noise: Noise::Measured,
        materials: Materials::default(),
        format: Format::single(seconds * SECOND),
    })
    .map_err(|error| error.to_string())?;
    let start = game.now();
    game.ours_mut().robot_mut().base.profile();
    game.run_for(seconds * SECOND);
    let span = (game.now() - start) as f64 / SECOND as f64;
    print(&game.ours().robot().base, &image, span)?;
    let late = game.summary().tally.report_to_pwm_ms;
    for share in [0.5, 0.9, 0.99, 1.0] {
        let ms = late.percentile(share).unwrap_or(f64::NAN);
        println!("report to PWM, {:.0} %: {ms:.2} ms", share * 100.0);
    }
    Ok(())
}

fn main() -> ExitCode {
    let words: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let done = match *words.as_slice() {
        ["stand"] => drive("0"),
        ["drive", units] if units.parse::<i8>().is_ok() => drive(units),
        ["play", seed, seconds] => match (seed.parse(), seconds.parse()) {
            (Ok(seed), Ok(seconds)) => play(seed, seconds),
            _ => Err("SEED and SECONDS are whole numbers".to_owned()),
        },
        _ => {
            eprintln!("usage: base_profile stand | drive UNITS | play SEED SECONDS");
            return ExitCode::from(2);
        }
    };
    if let Err(error) = done {
        eprintln!("base_profile: {error}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
