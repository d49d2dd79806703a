//! The turret firmware's times on the twin, as a table: `tools/fx2-timing` runs it. Everything is
//! counted in simulated time, exact to the clock. Exits with 1 if a limit is not kept.

use std::process::ExitCode;

use common_sys::constants as c;
use common_sys::link::{SlotHeader, config_status_decode, slot_header_encode};
use fx2::Fx2;
use fx2::eeprom::Eeprom;
use fx2::host::{Bench, Host, Request};
use fx2::image::Image;
use fx2::pins::{Driven, Tap, Tapped};
use sim::{MS, NS, Ps, US};
use twin::flash::Flash;
use twin::turret::Turret;
use virtex::bitstream;
use virtex::design::Function;
use virtex::store::{Entry, pack};

const SLOT: u8 = 0;
/// Of the 8051.
const CPU_HZ: f64 = 12e6;
const USB_VECTOR: u16 = 0x43;

/// Somebody who counts the bytes that the FPGA is given.
struct Watch {
    cclk: bool,
    bytes: u32,
    first: Ps,
    last: Ps,
}

impl Watch {
    fn forget(&mut self) {
        self.bytes = 0;
    }
}

impl Tap for Watch {
    fn driven(&mut self, now: Ps, driven: &Driven) {
        let cclk = (driven.ctl | !driven.ctl_enable) >> c::TURRET_CTL_CCLK & 1 != 0;
        let deselected = (driven.port[0] | !driven.port_enable[0]) >> c::TURRET_PA_FPGA_CS & 1 != 0;
        if cclk && !self.cclk && !deselected {
            if self.bytes == 0 {
                self.first = now;
            }
            self.bytes += 1;
            self.last = now;
        }
        self.cclk = cclk;
    }
}

struct Robot {
    fx2: Fx2,
    board: Tapped<Turret, Watch>,
    host: Host,
}

impl Robot {
    fn new(image: &Image, flash: &[u8]) -> Result<Self, Box<dyn std::error::Error>> {
        let eeprom = Eeprom::large(c::TURRET_EEPROM_ADDRESS as u8, &[])?;
        let turret = Turret::new(Flash::from_image(flash)?, eeprom);
        let tap = Watch { cclk: true, bytes: 0, first: 0, last: 0 };
        let board = Tapped { board: turret, tap };
        let mut fx2 = Fx2::new(fx2::Config::default());
        fx2.load(image)?;
        Ok(Self { fx2, board, host: Host::new() })
    }

    fn run_until(&mut self, t: Ps) {
        while self.fx2.now() < t {
            self.fx2.run_until(t, &mut self.board);
        }
    }

    /// Until the FPGA runs a design: the time, to 10 us.
    fn run_until_done(&mut self) -> Result<Ps, String> {
        let end = self.fx2.now() + 200 * MS;
        while self.fx2.now() < end {
            self.run_until(self.fx2.now() + 10 * US);
            let now = self.fx2.now();
            if self.board.board.fpga.function(now).is_some() {
                return Ok(now);
            }
        }
        Err("DONE did not rise within 200 ms".into())
    }

    fn out(&mut self, request: Request, data: &[u8]) -> Result<(), fx2::host::HostError> {
        let mut bench = Bench { fx2: &mut self.fx2, board: &mut self.board };
        self.host.control_out(&mut bench, request, data)
    }

    /// Enumerated, nothing under way, alternate setting with the data endpoints.
    fn connect(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        let mut bench = Bench { fx2: &mut self.fx2, board: &mut self.board };
        self.host.enumerate(&mut bench)?;
        let setting =
            Request { kind: 0x01, request: 11, value: c::USB_ALTERNATE_DATA as u16, index: 0 };
        self.out(setting, &[])?;
        self.host.clear_toggles(2);
        Ok(())
    }

    /// Clock cycles of the 8051 from a SETUP packet until it takes the interrupt.
    fn interrupt_cycles(&mut self) -> f64 {
        let begin = self.fx2.now();
        self.fx2.usb_setup([0xC0, c::REQUEST_CONFIG_STATUS as u8, 0, 0, 0, 0, 0, 0]);
        while self.fx2.cpu().pc() != USB_VECTOR && self.fx2.now() < begin + MS {
            self.run_until(self.fx2.now() + 20 * NS);
        }
        let cycles = (self.fx2.now() - begin) as f64 * CPU_HZ / 1e12;
        self.run_until(self.fx2.now() + MS);
        cycles
    }
}

fn vendor(request: u32, value: u16) -> Request {
    Request { kind: 0x40, request: request as u8, value, index: 0 }
}

struct Row {
    what: &'static str,
    measured: f64,
    limit: Option<f64>,
    unit: &'static str,
    peer: &'static str,
}

fn milliseconds(time: Ps) -> f64 {
    time as f64 / MS as f64
}

fn cycles_a_byte(watch: &Watch) -> f64 {
    (watch.last - watch.first) as f64 / 1e12 * CPU_HZ / f64::from(watch.bytes - 1)
}

fn from_flash(image: &Image, stream: &[u8]) -> Result<Vec<Row>, Box<dyn std::error::Error>> {
    let entry = Entry::from_file(SLOT, stream, "soccer".into())?;
    let mut robot = Robot::new(image, &pack(&[entry], SLOT))?;
    let up = robot.run_until_done()?;
    let stream_time = robot.board.tap.last - robot.board.tap.first;
    let a_byte = cycles_a_byte(&robot.board.tap);
    robot.connect()?;
    let idle = robot.interrupt_cycles();

    robot.board.tap.forget();
    let begin = robot.fx2.now();
    robot.out(vendor(c::REQUEST_CONFIG_BOOT, SLOT.into()), &[])?;
    robot.run_until(begin + 2 * MS); // PROG# has taken the old design away
    let change = robot.run_until_done()? - begin;
    robot.run_until(robot.fx2.now() + 20 * MS);
    robot.out(vendor(c::REQUEST_CONFIG_BOOT, SLOT.into()), &[])?;
    robot.run_until(robot.fx2.now() + 10 * MS);
    let streaming = robot.interrupt_cycles();

    let row = |what, measured, limit, unit, peer| Row { what, measured, limit, unit, peer };
    Ok(vec![
        row(
            "from flash: CPU start to DONE",
            milliseconds(up),
            Some(40.0),
            "ms",
            "8051 loop: 156 ms",
        ),
        row(
            "from flash: first to last byte",
            milliseconds(stream_time),
            None,
            "ms",
            "5 GPIF states: 24.4 ms",
        ),
        row("from flash: CPU cycles a byte", a_byte, None, "cycles", "8051 loop: 8"),
        row("change of slot: request to DONE", milliseconds(change), Some(30.0), "ms", "-"),
        row("interrupt latency, idle", idle, None, "cycles", "-"),
        row("interrupt latency, streaming", streaming, None, "cycles", "-"),
    ])
}

fn over_usb(image: &Image, stream: &[u8]) -> Result<Vec<Row>, Box<dyn std::error::Error>> {
    let mut robot = Robot::new(image, &vec![0xFF; c::FLASH_SIZE as usize])?;
    robot.connect()?;
    let mut header = SlotHeader { length: stream.len() as u32, ..SlotHeader::default() };
    for (place, byte) in header.part.iter_mut().zip(&c::TURRET_FPGA_PART[..]) {
        *place = *byte as core::ffi::c_char;
    }
    let begin = vendor(c::REQUEST_CONFIG_BEGIN, c::CONFIG_BEGIN_FULL as u16);
    robot.out(begin, &slot_header_encode(&header))?;
    robot.run_until(robot.fx2.now() + 10 * MS); // it clears itself
    robot.board.tap.forget();
    for packet in stream.chunks(512) {
        let mut bench = Bench { fx2: &mut robot.fx2, board: &mut robot.board };
        robot.host.bulk_out(&mut bench, 2, packet)?;
    }
    robot.run_until_done()?;
    let ask = Request { kind: 0xC0, ..vendor(c::REQUEST_CONFIG_STATUS, 0) };
    let mut bench = Bench { fx2: &mut robot.fx2, board: &mut robot.board };
    let wire = robot.host.control_in(&mut bench, ask, 16)?;
    let status = config_status_decode(&wire.try_into().map_err(|_| "the status is short")?);
    if status.is_none_or(|status| u32::from(status.result) != c::CONFIG_OK) {
        return Err("the configuration over USB failed".into());
    }
    let time = milliseconds(robot.board.tap.last - robot.board.tap.first);
    let a_byte = cycles_a_byte(&robot.board.tap);
    let row = |what, measured, limit, unit, peer| Row { what, measured, limit, unit, peer };
    Ok(vec![
        row("over USB: first to last byte", time, Some(12.0), "ms", "2 GPIF states: 9.8 ms"),
        row("over USB: CPU cycles a byte", a_byte, None, "cycles", "8051 loop: 8"),
    ])
}

fn table(path: &str) -> Result<Vec<Row>, Box<dyn std::error::Error>> {
    let image = Image::parse(&std::fs::read(path)?)?;
    let stream = bitstream::make(Function::Soccer, &bitstream::Options::default());
    let mut rows = over_usb(&image, &stream)?;
    rows.extend(from_flash(&image, &stream)?);
    Ok(rows)
}

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: fx2_timing IMAGE.ihx");
        return ExitCode::from(2);
    };
    let rows = match table(&path) {
        Ok(rows) => rows,
        Err(error) => {
            eprintln!("{path}: {error}");
            return ExitCode::FAILURE;
        }
    };
    println!("| XCV300E, 234,456 bytes | measured | limit | peer |\n|---|---|---|---|");
    let mut kept = true;
    for Row { what, measured, limit, unit, peer } in rows {
        let limit = limit.map_or("-".to_owned(), |limit| {
            kept &= measured <= limit;
            format!("{limit} {unit}")
        });
        println!("| {what} | {measured:.2} {unit} | {limit} | {peer} |");
    }
    if kept {
        ExitCode::SUCCESS
    } else {
        eprintln!("a limit is not kept: see the table");
        ExitCode::FAILURE
    }
}
