//! The GPIF against a board that writes down every pin change.

mod common;

use common::{Bench, Program};
use fx2::pins::Driven;
use fx2::{InReply, PACKET_MAX, Rule, Speed};
use sim::{Clock, MS, US};

const IFCLK: Clock = Clock::new(48_000_000);
const READ: usize = 0;
const WRITE: usize = 1;
const STREAM: usize = 2;

const DP: u8 = 1;
const DATA: u8 = 2;
const NEXT: u8 = 4;
const INCAD: u8 = 8;

/// A waveform: length or branch, opcode, CTL, logic of each state.
fn waveform(program: Program, number: usize, states: &[[u8; 4]]) -> Program {
    let mut program = program;
    for (state, bytes) in states.iter().enumerate() {
        for (group, &byte) in bytes.iter().enumerate() {
            let address = 0xE400 + 32 * number + 8 * group + state;
            program = program.xdata(address as u16, byte);
        }
    }
    program
}

/// GPIF master at 48 MHz, GPIFADR on port C and PE7, 8 bits, TCXpire as ready input 5.
fn setup() -> Program {
    let program = Program::new()
        .xdata(0xE601, 0xE2)
        .xdata(0xE671, 0xFF)
        .xdata(0xE672, 0x80)
        .xdata(0xE6C2, 0x3F)
        .xdata(0xE6F3, 0x20)
        .xdata(0xE6C0, (WRITE << 6 | READ << 4 | STREAM << 2 | STREAM) as u8);
    (0xE618..=0xE61B).fold(program, |program, fifocfg| program.xdata(fifocfg, 0))
}

/// CTL bits as numbers in the tests' waveforms: CTL4 is OE#, CTL5 WE#, CTL3 a clock.
const REST: u8 = 0x37;
const OE_LOW: u8 = 0x27;
const WE_LOW: u8 = 0x17;
const CLOCK: u8 = 0x2F;

fn read_waveform(program: Program) -> Program {
    let done = [0x3F, DP | INCAD, REST, 0x2D];
    waveform(program, READ, &[[4, 0, OE_LOW, 0], [1, DATA, OE_LOW, 0], done])
}

fn ctl_changes(board: &Bench) -> Vec<(u64, u8)> {
    let mut changes = Vec::new();
    let mut last = 0x3F;
    for (at, driven) in &board.seen {
        if driven.ctl != last {
            last = driven.ctl;
            let edge = IFCLK.edge_at_or_after(*at);
            assert_eq!(IFCLK.edge(edge), *at, "CTL moves at IFCLK edges only");
            changes.push((edge, driven.ctl));
        }
    }
    changes
}

#[test]
fn a_single_read_drives_ctl_state_by_state_and_samples_at_the_end_of_its_data_state() {
    let program = read_waveform(setup())
        .xdata(0xE6C4, 1)
        .xdata(0xE6C5, 0x34)
        .copy(0x30, 0xBE) // starts the read; what it returns is of no interest
        .wait_gpif()
        .copy(0x31, 0xBF)
        .read(0xE6C5, 0x32)
        .stop();
    let mut fx2 = program.start();
    let mut board = Bench { data_is_address: true, ..Bench::default() };
    fx2.run_until(MS, &mut board);
    assert_eq!(fx2.cpu().iram()[0x31..0x33], [0x34, 0x35], "data, then the address one further");
    let changes = ctl_changes(&board);
    let start = changes[0].0;
    assert_eq!(changes, [(start, OE_LOW), (start + 5, REST), (start + 6, 0x3F)]);
    let sampled = board.sampled.iter().filter(|&&at| at == IFCLK.edge(start + 5)).count();
    assert_eq!(sampled, 1, "FD is sampled as the data state ends");
    assert_eq!(fx2.driven().gpifadr, 0x135);
}

#[test]
fn a_single_write_drives_data_and_strobe_for_their_states_only() {
    let program = waveform(
        setup(),
        WRITE,
        &[[1, DATA, REST, 0], [3, DATA, WE_LOW, 0], [1, DATA, REST, 0], [0x3F, DP, REST, 0x2D]],
    )
    .sfr(0xBE, 0xA5)
    .wait_gpif()
    .stop();
    let mut fx2 = program.start();
    let mut board = Bench::default();
    fx2.run_until(MS, &mut board);
    let changes = ctl_changes(&board);
    let start = changes[0].0;
    assert_eq!(changes, [(start, REST), (start + 1, WE_LOW), (start + 4, REST), (start + 6, 0x3F)]);
    let driving: Vec<&Driven> =
        board.seen.iter().map(|(_, driven)| driven).filter(|d| d.fd_enable != 0).collect();
    assert!(!driving.is_empty());
    assert!(driving.iter().all(|d| d.fd_enable == 0xFF && d.fd == 0xA5), "{driving:?}");
    assert_eq!(fx2.driven().fd_enable, 0);
}

/// Reads `count` bytes at 5 states a byte into EP6, as the turret's firmware does.
fn stream(count: u16) -> Program {
    let program = waveform(
        setup(),
        STREAM,
        &[[1, DATA, OE_LOW, 0], [3, 0, OE_LOW, 0], [7 << 3, DP | INCAD, CLOCK, 0x2D]],
    );
    let [high, low] = count.to_be_bytes();
    program
        .xdata(0xE614, 0xE2)
        .xdata(0xE6CE, 0)
        .xdata(0xE6CF, 0)
        .xdata(0xE6D0, high)
        .xdata(0xE6D1, low)
}

#[test]
fn a_fifo_read_ends_when_its_count_expires_and_takes_five_states_a_byte() {
    let program = stream(512).sfr(0xBB, 0x06).wait_gpif().sfr(0x80, 1).stop();
    let mut fx2 = program.start();
    let mut board = Bench { data_is_address: true, ..Bench::default() };
    fx2.run_until(MS, &mut board);
    let clocks: Vec<_> = ctl_changes(&board).into_iter().filter(|c| c.1 == CLOCK).collect();
    assert_eq!(clocks.len(), 512);
    assert!(clocks.windows(2).all(|pair| pair[1].0 - pair[0].0 == 5), "5 states a byte");
    assert_eq!(fx2.driven().gpifadr, 0, "512 increments of 9 bits");
    assert_eq!(fx2.diagnostics(), []);
}

#[test]
fn bytes_that_the_gpif_reads_go_out_by_usb() {
    // EP6FIFOCFG: AUTOIN, 8 bits; AUTOINLEN 256.
    let program = stream(300)
        .xdata(0xE61A, 0x08)
        .xdata(0xE624, 1)
        .xdata(0xE625, 0)
        .sfr(0xBB, 0x06)
        .wait_gpif()
        .xdata(0xE648, 6)
        .stop();
    let mut fx2 = program.start();
    let mut board = Bench { data_is_address: true, ..Bench::default() };
    fx2.usb_reset();
    fx2.usb_reset_done(Speed::High);
    fx2.run_until(MS, &mut board);
    let mut data = [0; PACKET_MAX];
    assert_eq!(fx2.usb_in(6, &mut data), InReply::Data { length: 256, toggle: false });
    assert!((0..=255).eq(data[..256].iter().copied()));
    assert_eq!(fx2.usb_in(6, &mut data), InReply::Data { length: 44, toggle: true });
    assert!((0..44).eq(data[..44].iter().copied()));
    assert_eq!(fx2.usb_in(6, &mut data), InReply::Nak);
}

#[test]
fn a_fifo_write_puts_the_hosts_bytes_on_fd_in_order() {
    // EP2: bulk OUT, double; AUTOOUT by its edge. The waveform holds each byte for two states and
    // passes over IDLE, where the count is looked at.
    let program = waveform(
        setup(),
        STREAM,
        &[[1, DATA, REST, 0], [1, DATA | NEXT, WE_LOW, 0], [0x3F, DP, REST, 0x2D]],
    )
    .xdata(0xE612, 0xA2)
    .xdata(0xE618, 0x10)
    .xdata(0xE6CE, 0)
    .xdata(0xE6CF, 0)
    .xdata(0xE6D0, 0)
    .xdata(0xE6D1, 5)
    .code(&[0xE5, 0xAB, 0x20, 0xE1, 0xFB]) // until EP2 is no longer empty
    .sfr(0xBB, 0x00)
    .wait_gpif()
    .stop();
    let mut fx2 = program.start();
    let mut board = Bench::default();
    fx2.usb_reset();
    fx2.usb_reset_done(Speed::High);
    fx2.run_until(500 * US, &mut board);
    assert_eq!(fx2.usb_out(2, false, &[9, 8, 7, 6, 5, 4]), fx2::OutReply::Ack);
    fx2.run_until(MS, &mut board);
    let strobes: Vec<u16> = board
        .seen
        .windows(2)
        .filter(|pair| pair[0].1.ctl != WE_LOW && pair[1].1.ctl == WE_LOW)
        .map(|pair| pair[1].1.fd)
        .collect();
    assert_eq!(strobes, [9, 8, 7, 6, 5], "five of the six, as GPIFTCB says");
}

#[test]
fn the_end_of_a_transaction_wakes_an_idle_cpu_through_its_own_vector() {
    // INT4 from the GPIF with autovectoring: the jump at 0x53 lands at 0x0BB0 for GPIFDONE.
    let main = stream(512)
        .xdata(0xE668, 0x03)
        .xdata(0xE660, 0x01)
        .sfr(0xE8, 0xE4)
        .sfr(0xA8, 0x80)
        .sfr(0xBB, 0x06)
        .idle();
    let program = Program::default()
        .code(&[0x02, 0x01, 0x00])
        .org(0x53)
        .code(&[0x02, 0x0B, 0x00])
        .org(0x100)
        .code(&main.0)
        .org(0xBB0)
        .sfr(0x30, 0x77)
        .code(&[0x53, 0x91, 0xBF]) // EXIF: INT4 off
        .xdata(0xE661, 0x01)
        .code(&[0x32]);
    let mut fx2 = program.start();
    let mut board = Bench::default();
    fx2.run_until(MS, &mut board);
    assert_eq!(fx2.cpu().iram()[0x30], 0x77);
    assert!(fx2.cpu().is_idle());
    let done = ctl_changes(&board).last().map(|change| IFCLK.edge(change.0));
    assert!(done.is_some_and(|at| at < MS));
}

#[test]
fn an_abort_ends_a_transaction_that_never_would() {
    // Waits for RDY0 to fall, which it never does.
    let program = waveform(setup(), READ, &[[0x38, DP, OE_LOW, 0x00]])
        .copy(0x30, 0xBE)
        .copy(0x31, 0xBB)
        .xdata(0xE6F5, 0xFF)
        .copy(0x32, 0xBB)
        .stop();
    let program = Program(program.0.clone());
    let mut fx2 = program.start();
    let mut board = Bench::default();
    board.sensed.rdy = 0;
    fx2.run_until(MS, &mut board);
    assert_eq!(fx2.cpu().iram()[0x31] & 0x80, 0, "busy");
    assert_eq!(fx2.cpu().iram()[0x32] & 0x80, 0x80, "done");
    assert_eq!(fx2.driven().ctl, 0x3F);
}

#[test]
fn triggers_out_of_place_are_reported() {
    let program = setup().xdata(0xE601, 0x80).copy(0x30, 0xBE).stop();
    let mut fx2 = program.start();
    fx2.run_until(MS, &mut Bench::default());
    assert_eq!(fx2.diagnostics().len(), 1, "{:?}", fx2.diagnostics());
    let program = waveform(setup(), READ, &[[200, 0, OE_LOW, 0], [0x3F, DP, REST, 0]])
        .copy(0x30, 0xBE)
        .copy(0x30, 0xBE)
        .stop();
    let mut fx2 = program.start();
    fx2.run_until(MS, &mut Bench::default());
    assert!(fx2.diagnostics().iter().all(|d| d.rule == Rule::GpifBusy));
    assert_eq!(fx2.diagnostics().len(), 1);
}

#[test]
fn the_same_run_gives_the_same_pins() {
    let run = || {
        let mut fx2 = stream(512).sfr(0xBB, 0x06).wait_gpif().stop().start();
        let mut board = Bench { data_is_address: true, ..Bench::default() };
        for n in 1..100 {
            fx2.run_until(n * 7 * US, &mut board);
        }
        board.seen
    };
    assert!(run() == run());
}
