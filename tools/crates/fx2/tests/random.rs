//! Programs of random register accesses under random USB traffic: whatever they do, the chip goes on
//! and does the same again for the same seed.

mod common;

use common::Bench;
use fx2::image::Image;
use fx2::slave::Fifo;
use fx2::{Config, Fx2, PACKET_MAX, Speed};
use sim::{MS, Ps, US};

struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % limit
    }

    fn byte(&mut self) -> u8 {
        self.below(256) as u8
    }
}

/// Random accesses to the chip's registers, waveforms, buffers and SFRs, then round again. With
/// `wild`, random instructions between.
fn program(random: &mut Random, wild: bool) -> Vec<u8> {
    let mut code = Vec::new();
    while code.len() < 0x1F00 {
        let page = [0xE6, 0xE6, 0xE6, 0xE6, 0xE4, 0xE7, 0xF0, 0xF8][random.below(8) as usize];
        let (low, value) = (random.byte(), random.byte());
        match random.below(if wild { 5 } else { 4 }) {
            0 | 1 => code.extend_from_slice(&[0x90, page, low, 0x74, value, 0xF0]),
            2 => code.extend_from_slice(&[0x90, page, low, 0xE0]),
            3 => {
                // MOV sfr,# or MOV A,sfr; the core's own registers but PCON (IDLE for good).
                let sfr = 0x80 | low;
                if !mcs51::sfr::is_core(sfr) {
                    match value & 1 {
                        0 => code.extend_from_slice(&[0xE5, sfr]),
                        _ => code.extend_from_slice(&[0x75, sfr, value]),
                    }
                }
            }
            _ => code.push(value),
        }
    }
    code.extend_from_slice(&[0x02, 0x00, 0x00]);
    code
}

/// What the pins and packets of a run were.
fn run(seed: u64, wild: bool) -> (Vec<(Ps, u8)>, Vec<u8>, usize) {
    let mut random = Random(seed);
    let code = program(&mut random, wild);
    let mut fx2 = Fx2::new(Config::default());
    fx2.load(&Image::raw(&code).unwrap()).unwrap();
    let mut board = Bench { data_is_address: true, ..Bench::default() };
    let mut packets = Vec::new();
    let mut data = [0; PACKET_MAX];
    for step in 1..200u64 {
        fx2.run_until(step * 10 * US, &mut board);
        board.sensed.rdy = random.byte();
        let number = random.below(16) as u8;
        match random.below(12) {
            0 => fx2.usb_reset(),
            1 => fx2.usb_reset_done(Speed::High),
            2 => fx2.usb_suspend(),
            3 => fx2.usb_resume(),
            4 | 5 => fx2.usb_setup(std::array::from_fn(|_| random.byte())),
            6 | 7 => {
                if let fx2::InReply::Data { length, .. } = fx2.usb_in(number, &mut data) {
                    packets.extend_from_slice(&data[..length]);
                }
            }
            8 => fx2.push_serial(usize::from(number & 1), random.byte()),
            9 => {
                let fifo = [Fifo::Ep2, Fifo::Ep4, Fifo::Ep6, Fifo::Ep8][usize::from(number & 3)];
                let now = fx2.now();
                fx2.slave_write(fifo, &[0x1234; 700], now, now + 5 * US);
                fx2.slave_read(fifo, &mut [0; 700], now, now + 5 * US);
                fx2.slave_packet_end(fifo);
            }
            _ => {
                let length = random.below(PACKET_MAX as u64 + 1) as usize;
                fx2.usb_out(number, random.below(2) == 1, &data[..length]);
            }
        }
    }
    fx2.run_until(3 * MS, &mut board);
    assert!(fx2.now() >= 3 * MS && fx2.now() < 3 * MS + 10 * US, "seed {seed}");
    let pins = board.seen.iter().map(|(at, driven)| (*at, driven.ctl)).collect();
    (pins, packets, fx2.diagnostics().len())
}

#[test]
fn no_access_stops_the_chip() {
    for seed in 0..400 {
        run(seed, false);
        run(seed, true);
    }
}

#[test]
fn a_seed_gives_the_same_run() {
    for seed in 1000..1010 {
        assert!(run(seed, true) == run(seed, true), "seed {seed}");
    }
}
