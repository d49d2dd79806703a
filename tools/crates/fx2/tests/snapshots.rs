//! A chip, its host controller and its EEPROM written down as text in the middle of whatever they do, read
//! back, and run on: the same pins at the same times, the same packets, the same end.

mod common;

use common::{Bench, Program};
use fx2::bus::{Bus, Completion, Job};
use fx2::eeprom::Eeprom;
use fx2::host;
use fx2::{Fx2, pins};
use sim::{MS, Ps, TraceHash, US};

/// Everything that has a state.
struct Desk {
    fx2: Fx2,
    bus: Bus,
    board: Bench,
    trace: TraceHash,
    /// Transfers that are over.
    done: usize,
}

impl Desk {
    fn new() -> Self {
        let eeprom = Some(Eeprom::large(0x51, &[0xFF, 1, 2, 3]).unwrap());
        let board = Bench { data_is_address: true, eeprom, ..Bench::default() };
        let mut desk = Self {
            fx2: program().start(),
            bus: Bus::default(),
            board,
            trace: TraceHash::default(),
            done: 0,
        };
        let mut link = host::Bench { fx2: &mut desk.fx2, board: &mut desk.board };
        desk.bus.reset(&mut link);
        // Bulk IN that the GPIF fills, bulk OUT that it empties, and a control transfer now and then.
        for id in 0..8 {
            desk.bus.submit(id, Job::In { number: 6, length: 4096, packet: 512 });
            let data = (0..3000).map(|n| (n * 7 + id) as u8).collect();
            desk.bus.submit(100 + id, Job::Out { number: 2, data, packet: 512 });
            desk.bus.submit(200 + id, Job::ControlIn([0xC0, 0xA0, 0, 0, 0, 0, 200, 0]));
        }
        desk
    }

    fn run(&mut self, until: Ps) {
        let mut link = host::Bench { fx2: &mut self.fx2, board: &mut self.board };
        let completed = self.bus.run_until(&mut link, until);
        let seen = std::mem::take(&mut self.board.seen);
        for (at, driven) in &seen {
            self.trace.update(format!("{at} {driven:?}").as_bytes());
        }
        self.done += completed.len();
        for Completion { id, status, data, length, .. } in &completed {
            self.trace.update(format!("{id} {status:?} {length}").as_bytes());
            self.trace.update(data);
        }
        self.trace.update(&self.fx2.take_serial(0));
        self.board.sampled.clear();
    }

    /// The state as text.
    fn save(&self) -> [String; 4] {
        [
            serde_json::to_string(&self.fx2).unwrap(),
            serde_json::to_string(&self.bus).unwrap(),
            serde_json::to_string(&self.board.eeprom).unwrap(),
            serde_json::to_string(&self.board.driven).unwrap(),
        ]
    }

    fn restore(saved: &[String; 4], trace: TraceHash) -> Self {
        let driven: pins::Driven = serde_json::from_str(&saved[3]).unwrap();
        let eeprom: Option<Eeprom> = serde_json::from_str(&saved[2]).unwrap();
        let board = Bench { data_is_address: true, eeprom, driven, ..Bench::default() };
        Self {
            fx2: serde_json::from_str(&saved[0]).unwrap(),
            bus: serde_json::from_str(&saved[1]).unwrap(),
            board,
            trace,
            done: 0,
        }
    }
}

/// The GPIF reads into EP6 and writes out of EP2 in turns, timer 0 runs, serial port 0 sends, and an
/// EEPROM is being read, for ever.
fn program() -> Program {
    let mut program = Program::new();
    // Waveform 0 reads: 4 clocks, then a byte; waveform 1 writes likewise.
    for (address, value) in [
        (0xE400, 4),
        (0xE401, 0x38),
        (0xE409, 0x0B),
        (0xE410, 0x05),
        (0xE411, 0x0F),
        (0xE419, 0x2D),
        (0xE420, 3),
        (0xE421, 0x38),
        (0xE428, 0x02),
        (0xE429, 0x07),
        (0xE430, 0x11),
        (0xE431, 0x15),
        (0xE439, 0x2D),
        (0xE601, 0xE2),
        (0xE608, 0x01),
        (0xE671, 0xFF),
        (0xE6F3, 0x20),
        (0xE6C0, 0x04),
        (0xE612, 0xA0),
        (0xE613, 0x20),
        (0xE614, 0xE0),
        (0xE615, 0x20),
        (0xE618, 0x10),
        (0xE61A, 0x08),
        (0xE67A, 0x01),
        (0xE6D0, 0x01),
        (0xE6CF, 0x00),
        (0xE6CE, 0x00),
    ] {
        program = program.xdata(address, value);
    }
    program = program.sfr(0x89, 0x02).sfr(0x88, 0x10).sfr(0x98, 0x40);
    let round = program.0.len() as u16;
    program = program.xdata(0xE6D0, 1).xdata(0xE6D1, 0x2C).sfr(0xBB, 0x06).sfr(0x99, 0x55);
    // START and address on I2C; the byte comes while the GPIF is at work.
    program = program.xdata(0xE678, 0x80).xdata(0xE679, 0xA3).wait(0xE678, 0);
    program = program.xdata(0xE678, 0x40).wait_gpif();
    program = program.xdata(0xE6D1, 0x64).sfr(0xBB, 0x00).wait_gpif();
    let [high, low] = round.to_be_bytes();
    program.code(&[0x02, high, low])
}

#[test]
fn a_state_read_back_in_mid_transfer_goes_on_with_the_same_trace() {
    let mut desk = Desk::new();
    let start = desk.fx2.now();
    let end = start + 4 * MS;
    let mut saved = Vec::new();
    for n in 1..40 {
        desk.run(start + n * 97 * US);
        saved.push((desk.save(), desk.trace));
    }
    desk.run(end);
    let last = desk.save();
    // What was cut through: transfers half done, a GPIF at work, bytes on the serial line and on I2C.
    let text = |n: usize| saved[n].0[0].as_str();
    assert!(
        (0..saved.len()).any(|n| text(n).contains("\"run\":{")),
        "no cut went through the GPIF"
    );
    assert!(
        (0..saved.len()).any(|n| text(n).contains("\"sending\":[")),
        "none through a serial byte"
    );
    assert!(desk.done > 10, "only {} transfers came to their end", desk.done);
    for (n, (state, trace)) in saved.iter().enumerate() {
        let mut again = Desk::restore(state, *trace);
        assert_eq!(again.save(), *state, "cut {n}: what was read back is what was written");
        for later in n + 2..40 {
            again.run(start + later as Ps * 97 * US);
        }
        again.run(end);
        assert_eq!(again.trace, desk.trace, "cut {n}: another trace");
        assert_eq!(again.save(), last, "cut {n}: another end");
    }
}

#[test]
fn a_damaged_state_is_refused() {
    let text = serde_json::to_string(&program().start()).unwrap();
    let short = text.replacen("\"ram\":\"", "\"ram\":\"0", 1);
    assert!(serde_json::from_str::<Fx2>(&short).is_err());
    assert!(serde_json::from_str::<Fx2>(&text[..text.len() / 2]).is_err());
    assert!(serde_json::from_str::<Fx2>("{}").is_err());
}
