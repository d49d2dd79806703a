//! How fast the chip is emulated, in times real time: a busy CPU with timers, serial port, SOF
//! interrupts and the GPIF at work, the same without GPIF, and one in IDLE. The best of five runs counts,
//! so that other work on the machine shows less.

use fx2::image::Image;
use fx2::pins::Unconnected;
use fx2::{Config, Fx2, Speed};
use sim::{MS, Ps, SECOND};
use std::time::Instant;

/// MOV DPTR,#address; MOV A,#value; MOVX @DPTR,A; three NOPs.
fn xdata(code: &mut Vec<u8>, address: u16, value: u8) {
    let [high, low] = address.to_be_bytes();
    code.extend_from_slice(&[0x90, high, low, 0x74, value, 0xF0, 0, 0, 0]);
}

/// Timer 0 interrupts every 256 counts, SOF interrupts, serial port 0 sending, and a loop of
/// arithmetic and MOVX; with `gpif`, a FIFO read that never ends.
fn busy(gpif: bool) -> Vec<u8> {
    let mut code = vec![0x02, 0x01, 0x00];
    code.resize(0x0B, 0);
    code.extend_from_slice(&[0x05, 0x40, 0x32]); // timer 0: INC 0x40; RETI
    code.resize(0x43, 0);
    // SOF: EXIF and USBIRQ off, with DPTR and A kept.
    code.extend_from_slice(&[0x02, 0x00, 0x80]);
    code.resize(0x80, 0);
    code.extend_from_slice(&[0xC0, 0x82, 0xC0, 0x83, 0xC0, 0xE0, 0x53, 0x91, 0xEF]);
    xdata(&mut code, 0xE65D, 0x02);
    code.extend_from_slice(&[0xD0, 0xE0, 0xD0, 0x83, 0xD0, 0x82, 0x32]);
    code.resize(0x100, 0);
    for (address, value) in
        [(0xE600, 0x10), (0xE608, 1), (0xE65C, 2), (0xE601, 0xE2), (0xE614, 0xE0)]
    {
        xdata(&mut code, address, value);
    }
    if gpif {
        // S0: 3 clocks, S1: sample, address + 1, back to S0.
        for (address, value) in [(0xE400, 3), (0xE401, 0), (0xE409, 0x0B), (0xE410, 0x3F)] {
            xdata(&mut code, address, value);
        }
        for (address, value) in [(0xE6CE, 0xFF), (0xE6C0, 0), (0xE61A, 8)] {
            xdata(&mut code, address, value);
        }
        code.extend_from_slice(&[0x75, 0xBB, 0x06]);
    }
    // TMOD, TCON, SCON0, EIE, IE.
    for (sfr, value) in [(0x89, 0x02), (0x88, 0x10), (0x98, 0x40), (0xE8, 0xE1), (0xA8, 0x82)] {
        code.extend_from_slice(&[0x75, sfr, value]);
    }
    let start = code.len() as u16;
    // MOV SBUF0,A; ADD A,0x40; MOV DPTR,#0x1000; MOVX @DPTR,A; XRL A,#0x5A; MOV R0,#8; again:
    // RLC A; MOVX A,@DPTR; DJNZ R0,again; LJMP start.
    code.extend_from_slice(&[0xF5, 0x99, 0x25, 0x40, 0x90, 0x10, 0x00, 0xF0, 0x64, 0x5A, 0x78, 8]);
    code.extend_from_slice(&[0x33, 0xE0, 0xD8, 0xFC, 0x02]);
    code.extend_from_slice(&start.to_be_bytes());
    code
}

const RUNS: usize = 5;

fn measure(name: &str, code: &[u8], time: Ps) {
    let image = Image::raw(code).expect("a program");
    let mut best = 0.0_f64;
    for _ in 0..RUNS {
        let mut fx2 = Fx2::new(Config::default());
        fx2.load(&image).expect("it fits");
        fx2.usb_reset_done(Speed::High);
        fx2.run_until(MS, &mut Unconnected);
        let started = Instant::now();
        fx2.run_until(time, &mut Unconnected);
        best = best.max(time as f64 / SECOND as f64 / started.elapsed().as_secs_f64());
    }
    println!("{name}: {best:.1} times real time");
}

fn main() {
    measure("busy CPU, timer, SOF, serial port", &busy(false), SECOND / 2);
    measure("the same with the GPIF at work   ", &busy(true), SECOND / 2);
    // ORL PCON,#1 for ever.
    measure("IDLE                             ", &[0x43, 0x87, 0x01, 0x80, 0xFB], 100 * SECOND);
}
