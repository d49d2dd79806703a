//! Ports, timers, serial ports, I²C, autopointers, interrupts and rules, each by a small program.

mod common;

use common::{Bench, Program};
use fx2::eeprom::Eeprom;
use fx2::pins::Unconnected;
use fx2::{Config, Fx2, InReply, OutReply, PACKET_MAX, Ram, Rule, Speed};
use sim::{MS, Ps, US};

/// An 8051 machine cycle at 48 MHz, in thirds of a picosecond.
const CYCLE_THIRDS: Ps = 250_000;

fn run(program: &Program) -> (Fx2, Bench) {
    let mut fx2 = program.start();
    let mut board = Bench::default();
    fx2.run_until(5 * MS, &mut board);
    (fx2, board)
}

fn iram(fx2: &Fx2, address: u8) -> u8 {
    fx2.cpu().iram()[usize::from(address)]
}

fn rules(fx2: &Fx2) -> Vec<Rule> {
    fx2.diagnostics().iter().map(|found| found.rule).collect()
}

#[test]
fn port_pins_move_with_their_instruction_and_float_until_enabled() {
    // Three writes of IOA, 3 cycles each: MOV direct,#data.
    let program = Program::new()
        .sfr(0x80, 0x00)
        .sfr(0xB2, 0x0F)
        .sfr(0x80, 0x05)
        .sfr(0x80, 0x0A)
        .sfr(0x80, 0x05)
        .stop();
    let (_, board) = run(&program);
    let moves: Vec<(Ps, u8)> = board
        .seen
        .iter()
        .filter(|(_, driven)| driven.port_enable[0] == 0x0F)
        .map(|(at, driven)| (*at, driven.port[0]))
        .collect();
    assert_eq!(moves.iter().map(|m| m.1).collect::<Vec<_>>(), [0x00, 0x05, 0x0A, 0x05]);
    for pair in moves.windows(2) {
        let cycles = (3 * (pair[1].0 - pair[0].0) + CYCLE_THIRDS / 2) / CYCLE_THIRDS;
        assert_eq!(cycles, 3);
    }
}

#[test]
fn reading_a_port_gives_pins_but_changing_a_bit_works_on_the_latch() {
    let program = Program::new()
        .sfr(0xB2, 0x01)
        .sfr(0x80, 0x00)
        .copy(0x30, 0x80)
        .code(&[0xD2, 0x87]) // SETB IOA.7: the other latches keep what was written
        .sfr(0xB2, 0xFF)
        .copy(0x31, 0x80)
        .stop();
    let mut fx2 = program.start();
    let mut board = Bench::default();
    board.sensed.port[0] = 0x7E;
    fx2.run_until(MS, &mut board);
    assert_eq!((iram(&fx2, 0x30), iram(&fx2, 0x31)), (0x7E, 0x80));
}

#[test]
fn the_cpu_clock_follows_cpucs() {
    for (cpucs, cycle_ns) in [(0x00, 333), (0x08, 166), (0x10, 83)] {
        let program =
            Program::default().xdata(0xE600, cpucs).sfr(0xB2, 1).sfr(0x80, 1).sfr(0x80, 0).stop();
        let (_, board) = run(&program);
        let at: Vec<Ps> = board.seen.iter().rev().take(2).map(|(at, _)| *at).collect();
        assert_eq!((at[0] - at[1]) / 1000 / 3, cycle_ns, "CPUCS {cpucs:#04x}");
    }
}

#[test]
fn timer_0_interrupts_an_idle_cpu_at_its_overflow() {
    // 16 bits at CLKOUT/12 from 0xFC18: 1000 counts = 250 us.
    let program = Program::default()
        .code(&[0x02, 0x01, 0x00])
        .org(0x0B)
        .sfr(0x80, 0xFF)
        .code(&[0x32])
        .org(0x100)
        .xdata(0xE600, 0x10)
        .sfr(0xB2, 0xFF)
        .sfr(0x8C, 0xFC)
        .sfr(0x8A, 0x18)
        .sfr(0x89, 0x01)
        .sfr(0xA8, 0x82)
        .sfr(0x88, 0x10)
        .idle();
    let mut fx2 = program.start();
    let mut board = Bench::default();
    fx2.run_until(200 * US, &mut board);
    assert!(fx2.cpu().is_idle());
    let due = fx2.next_event();
    assert!((250 * US..270 * US).contains(&due), "{due}");
    fx2.run_until(MS, &mut board);
    let at = board.seen.iter().find(|(_, d)| d.port[0] == 0xFF).map(|(at, _)| *at).unwrap();
    assert!((due..due + US).contains(&at), "overflow {due}, pin {at}");
}

#[test]
fn both_serial_ports_send_and_receive_at_their_rate() {
    for (scon, sbuf, bit) in [(0x98, 0x99, 0), (0xC0, 0xC1, 1)] {
        let program = Program::new()
            .xdata(0xE608, 0x03) // 115200 baud, SMOD clear
            .sfr(scon, 0x50)
            .sfr(sbuf, b'A')
            .code(&[0x30, scon, 0xFD]) // JNB RI,$
            .copy(0x30, sbuf)
            .sfr(0x31, 1)
            .stop();
        let mut fx2 = program.start();
        fx2.push_serial(bit, b'Z');
        let sent_by = |fx2: &mut Fx2, t| {
            fx2.run_until(t, &mut Unconnected);
            fx2.take_serial(bit)
        };
        // Ten bits take 86.8 us.
        assert_eq!(sent_by(&mut fx2, 80 * US), b"");
        assert_eq!(iram(&fx2, 0x31), 0);
        assert_eq!(sent_by(&mut fx2, 110 * US), b"A");
        fx2.run_until(MS, &mut Unconnected);
        assert_eq!((iram(&fx2, 0x30), iram(&fx2, 0x31)), (b'Z', 1));
    }
}

/// Waits for I2CS.DONE.
fn done(program: Program) -> Program {
    program.wait(0xE678, 0)
}

#[test]
fn firmware_writes_and_reads_an_eeprom_in_the_time_of_the_bus() {
    let write = |program: Program, byte| done(program.xdata(0xE679, byte));
    // Write 0x5A, 0xA5 to 0x0010; wait for the write cycle; read both back.
    let mut program = Program::new().xdata(0xE67A, 1).xdata(0xE678, 0x80);
    for byte in [0xA2, 0x00, 0x10, 0x5A, 0xA5] {
        program = write(program, byte);
    }
    program = program.xdata(0xE678, 0x40).sfr(0x40, 0x11).copy(0x41, 0x40);
    // 6 ms: two nested loops of DJNZ.
    program = program.code(&[0x7A, 0x00, 0x7B, 0x64, 0xDB, 0xFE, 0xDA, 0xFA]);
    program = program.xdata(0xE678, 0x80);
    for byte in [0xA2, 0x00, 0x10] {
        program = write(program, byte);
    }
    program = program.xdata(0xE678, 0x80);
    program = write(program, 0xA3).read(0xE678, 0x32);
    program = done(program.read(0xE679, 0x33)); // starts the first byte
    program = done(program.xdata(0xE678, 0x20).read(0xE679, 0x30)); // last one follows
    program = program.xdata(0xE678, 0x40).read(0xE679, 0x31).sfr(0x34, 1).stop();
    let mut fx2 = program.start();
    let mut board = Bench { eeprom: Some(Eeprom::large(0x51, &[]).unwrap()), ..Bench::default() };
    // Start, address and four bytes: 5 x 9 + 1 bits of 2.5 us.
    fx2.run_until(110 * US, &mut board);
    assert_eq!(iram(&fx2, 0x41), 0, "the bus cannot be so fast");
    fx2.run_until(200 * US, &mut board);
    assert_eq!(iram(&fx2, 0x41), 0x11, "nor so slow");
    fx2.run_until(50 * MS, &mut board);
    assert_eq!(iram(&fx2, 0x34), 1, "through");
    assert_eq!([iram(&fx2, 0x30), iram(&fx2, 0x31)], [0x5A, 0xA5]);
    assert_eq!(iram(&fx2, 0x32) & 0x03, 0x03, "acknowledged and done");
}

#[test]
fn an_absent_device_gives_no_acknowledge() {
    let program = done(Program::new().xdata(0xE678, 0x80).xdata(0xE679, 0x42))
        .read(0xE678, 0x30)
        .xdata(0xE678, 0x40)
        .stop();
    let (fx2, _) = run(&program);
    assert_eq!(iram(&fx2, 0x30) & 0x07, 0x01);
}

#[test]
fn autopointers_step_through_memory() {
    let program = Program::new()
        .sfr(0xAF, 0x07)
        .sfr(0x9A, 0xE0)
        .sfr(0x9B, 0x10)
        .sfr(0x9D, 0xE0)
        .sfr(0x9E, 0x10)
        .xdata(0xE67B, 0x11)
        .xdata(0xE67B, 0x22)
        .read(0xE67C, 0x30)
        .read(0xE67C, 0x31)
        .copy(0x32, 0x9B)
        .stop();
    let (fx2, _) = run(&program);
    assert_eq!((fx2.peek(0xE010), fx2.peek(0xE011)), (0x11, 0x22));
    assert_eq!([iram(&fx2, 0x30), iram(&fx2, 0x31), iram(&fx2, 0x32)], [0x11, 0x22, 0x12]);
}

#[test]
fn int0_is_pin_pa0_by_edge_or_level() {
    for (tcon, count) in [(0x01, 1), (0x00, 2)] {
        // The routine counts in 0x30; in level mode it is entered again while the pin is low.
        let program = Program::default()
            .code(&[0x02, 0x01, 0x00])
            .org(0x03)
            .code(&[0x05, 0x30, 0x32])
            .org(0x100)
            .xdata(0xE670, 0x01)
            .sfr(0x88, tcon)
            .sfr(0xA8, 0x81)
            .stop();
        let mut fx2 = program.start();
        let mut board = Bench::default();
        fx2.run_until(MS, &mut board);
        assert_eq!(iram(&fx2, 0x30), 0);
        board.sensed.port[0] = 0xFE;
        fx2.run_until(2 * MS, &mut board);
        board.sensed.port[0] = 0xFF;
        fx2.run_until(3 * MS, &mut board);
        let entered = iram(&fx2, 0x30);
        assert!(if count == 1 { entered == 1 } else { entered != 1 }, "TCON {tcon}: {entered}");
    }
}

#[test]
fn the_usb_interrupt_reaches_its_own_vector() {
    // Autovectoring: jump table at 0x0400, reset is its fifth entry.
    let program = Program::default()
        .code(&[0x02, 0x01, 0x00])
        .org(0x43)
        .code(&[0x02, 0x04, 0x00])
        .org(0x100)
        .xdata(0xE680, 0x02)
        .xdata(0xE668, 0x08)
        .xdata(0xE65C, 0x10)
        .sfr(0xE8, 0xE1)
        .sfr(0xA8, 0x80)
        .idle()
        .org(0x410)
        .sfr(0x30, 0x99)
        .code(&[0x53, 0x91, 0xEF])
        .xdata(0xE65D, 0x10)
        .code(&[0x32]);
    let (mut fx2, mut board) = run(&program);
    assert!(fx2.cpu().is_idle());
    assert_eq!(fx2.next_event(), Ps::MAX);
    fx2.usb_reset();
    let until = fx2.now() + MS;
    fx2.run_until(until, &mut board);
    assert_eq!(iram(&fx2, 0x30), 0x99);
    assert!(fx2.cpu().is_idle(), "back in IDLE");
}

/// A program that answers any SETUP by sending 3 bytes from EP0BUF, in a polling loop.
#[test]
fn ep0_answers_from_its_buffer_with_handshake() {
    let program = Program::new()
        .xdata(0xE680, 0x02)
        .wait(0xE65D, 0)
        .xdata(0xE65D, 0x01)
        .xdata(0xE740, 7)
        .xdata(0xE741, 8)
        .xdata(0xE742, 9)
        .xdata(0xE68A, 0)
        .xdata(0xE68B, 3)
        .xdata(0xE6A0, 0x80)
        .read(0xE6B9, 0x30)
        .stop();
    let (mut fx2, mut board) = run(&program);
    let mut data = [0; PACKET_MAX];
    fx2.usb_setup([0xC0, 0x55, 0, 0, 0, 0, 8, 0]);
    assert_eq!(fx2.usb_in(0, &mut data), InReply::Nak, "the firmware has not seen it yet");
    assert_eq!(fx2.usb_out(0, true, &[]), OutReply::Nak, "HSNAK");
    fx2.run_until(6 * MS, &mut board);
    assert_eq!(fx2.usb_in(0, &mut data), InReply::Data { length: 3, toggle: true });
    assert_eq!(data[..3], [7, 8, 9]);
    assert_eq!(fx2.usb_in(0, &mut data), InReply::Nak, "sent once");
    assert_eq!(fx2.usb_out(0, true, &[]), OutReply::Ack);
    assert_eq!(iram(&fx2, 0x30), 0x55);
}

#[test]
fn sudptr_sends_a_descriptor_or_a_length_from_memory() {
    let descriptor: Vec<u8> = (0..100).collect();
    // At 0x0800: a descriptor of 70 bytes by its own first byte.
    let base = |sudptrctl: u8| {
        Program::new()
            .xdata(0xE680, 0x02)
            .wait(0xE65D, 0)
            .xdata(0xE6B5, sudptrctl)
            .xdata(0xE68A, 0)
            .xdata(0xE68B, 64)
            .xdata(0xE6B3, 0x08)
            .xdata(0xE6B4, 0x00)
            .xdata(0xE6A0, 0x80)
            .stop()
            .org(0x800)
            .code(&[70, 1])
            .code(&descriptor)
    };
    for (sudptrctl, lengths) in [(1, &[64, 6][..]), (0, &[64, 0][..])] {
        let (mut fx2, mut board) = run(&base(sudptrctl));
        fx2.usb_setup([0x80, 6, 0, 1, 0, 0, 255, 0]);
        fx2.run_until(7 * MS, &mut board);
        let mut data = [0; PACKET_MAX];
        let mut toggle = true;
        for &length in lengths {
            assert_eq!(fx2.usb_in(0, &mut data), InReply::Data { length, toggle });
            toggle = !toggle;
        }
        assert_eq!(fx2.usb_in(0, &mut data), InReply::Nak, "SUDPTRCTL {sudptrctl}");
    }
}

#[test]
fn a_stall_lasts_until_the_next_setup() {
    let program = Program::new().xdata(0xE680, 0x02).wait(0xE65D, 0).xdata(0xE6A0, 0x01).stop();
    let (mut fx2, mut board) = run(&program);
    let mut data = [0; PACKET_MAX];
    fx2.usb_setup([0xC0, 1, 0, 0, 0, 0, 8, 0]);
    fx2.run_until(6 * MS, &mut board);
    assert_eq!(fx2.usb_in(0, &mut data), InReply::Stall);
    fx2.usb_setup([0xC0, 1, 0, 0, 0, 0, 8, 0]);
    assert_eq!(fx2.usb_in(0, &mut data), InReply::Nak);
}

#[test]
fn ep1_echoes_and_repeats_are_dropped() {
    let program = Program::new()
        .xdata(0xE680, 0x02)
        .xdata(0xE68D, 0)
        .wait(0xE65F, 3)
        .read(0xE780, 0x30)
        .read(0xE68D, 0x31)
        .xdata(0xE7C0, 0x42)
        .xdata(0xE68F, 1)
        .stop();
    let (mut fx2, mut board) = run(&program);
    let mut data = [0; PACKET_MAX];
    assert_eq!(fx2.usb_in(1, &mut data), InReply::Nak);
    assert_eq!(fx2.usb_out(1, false, &[0x77, 1, 2]), OutReply::Ack);
    assert_eq!(fx2.usb_out(1, false, &[0x77, 1, 2]), OutReply::Ack, "a repetition");
    assert_eq!(fx2.usb_out(1, true, &[1]), OutReply::Nak);
    fx2.run_until(6 * MS, &mut board);
    assert_eq!([iram(&fx2, 0x30), iram(&fx2, 0x31)], [0x77, 3]);
    assert_eq!(fx2.usb_in(1, &mut data), InReply::Data { length: 1, toggle: false });
    assert_eq!(data[0], 0x42);
}

#[test]
fn frame_numbers_count_microframes_at_high_speed() {
    let program = Program::new().read(0xE684, 0x30).read(0xE685, 0x31).read(0xE686, 0x32).code(&[
        0x02, 0x00, 0x09, // LJMP to the first read
    ]);
    let mut fx2 = program.start();
    fx2.usb_reset();
    fx2.usb_reset_done(Speed::High);
    fx2.run_until(300 * MS + 300 * US, &mut Unconnected);
    assert_eq!([iram(&fx2, 0x30), iram(&fx2, 0x31), iram(&fx2, 0x32)], [0x01, 0x2C, 2]);
}

#[test]
fn broken_rules_are_named_once_with_their_place() {
    // MOVX @DPTR twice in a row on INPKTEND: no SYNCDELAY between.
    let hasty = Program::new()
        .code(&[0x90, 0xE6, 0x04, 0x74, 0x80, 0xF0, 0xF0]) // FIFORESET = 80, twice
        .stop();
    let (fx2, _) = run(&hasty);
    assert_eq!(rules(&fx2), [Rule::SyncDelay]);
    assert_eq!(fx2.diagnostics()[0].pc, 9 + 6);

    let cases = [
        (0xE604, 0x06, Rule::FifoResetOrder),
        (0xE612, 0xA1, Rule::Reserved),
        (0xE601, 0x81, Rule::Reserved),
        (0xE600, 0x18, Rule::Reserved),
        (0xE62A, 0x00, Rule::NotModelled),
        (0xE300, 0x00, Rule::NotModelled),
        (0x3000, 0x00, Rule::NotModelled),
        (0xE648, 0x03, Rule::Reserved),
    ];
    for (address, value, rule) in cases {
        let again = Program::new().xdata(address, value).code(&[0x80, 0xF5]); // for ever
        let (fx2, _) = run(&again);
        assert_eq!(rules(&fx2), [rule], "{address:#06x} = {value:#04x}");
        assert_eq!(fx2.diagnostics()[0].address, address);
    }
}

#[test]
fn buffers_that_overlap_are_reported_when_they_are_used() {
    // EP2, EP4, EP6 and EP8 as they are written, and whether they fit.
    let cases = [
        ([0xA2, 0xA0, 0xE2, 0xE0], true),
        ([0xA0, 0x20, 0xE0, 0x60], true),
        ([0xA3, 0x20, 0xE3, 0xE0], true),
        ([0xA8, 0x20, 0x62, 0x60], true),
        ([0xA0, 0xA0, 0xE2, 0x60], false),
        ([0xA0, 0x20, 0xE0, 0xE0], false),
        ([0xA8, 0x20, 0xE2, 0x60], false),
    ];
    for (cfg, fits) in cases {
        let program = (0xE612..).zip(cfg).fold(Program::new(), |p, (at, value)| p.xdata(at, value));
        let (mut fx2, _) = run(&program.stop());
        assert_eq!(fx2.diagnostics(), [], "{cfg:02x?}: nothing is used yet");
        fx2.usb_out(2, false, &[]);
        assert_eq!(fx2.diagnostics().is_empty(), fits, "{cfg:02x?}");
    }
}

#[test]
fn a_bus_reset_wakes_a_suspended_chip() {
    let program = Program::new()
        .xdata(0xE680, 0x02)
        .sfr(0xD8, 0x20)
        .xdata(0xE681, 0x01)
        .code(&[0x43, 0x87, 0x01])
        .sfr(0x30, 1)
        .xdata(0xE680, 0x03)
        .stop();
    // The resume interrupt's vector lies in the program: it must be a RETI.
    let program = Program::default()
        .code(&[0x02, 0x01, 0x00])
        .org(0x33)
        .code(&[0x53, 0xD8, 0xEF, 0x32])
        .org(0x100)
        .code(&program.0);
    let (mut fx2, mut board) = run(&program);
    assert_eq!(fx2.next_event(), Ps::MAX);
    fx2.usb_reset();
    fx2.run_until(6 * MS, &mut board);
    assert_eq!(iram(&fx2, 0x30), 1);
    assert!(fx2.usb_signals_resume());
}

#[test]
fn external_memory_is_there_if_the_board_has_it() {
    let config = Config { ram: Ram::K8, external_ram: true };
    let mut fx2 = Fx2::new(config);
    let program = Program::new().xdata(0x8000, 0x66).read(0x8000, 0x30).stop();
    fx2.load(&program.image()).unwrap();
    fx2.run_until(MS, &mut Unconnected);
    assert_eq!((iram(&fx2, 0x30), fx2.diagnostics().len()), (0x66, 0));
}

#[test]
fn a_board_can_end_the_slice_when_a_pin_moves() {
    #[derive(Default)]
    struct Impatient(Bench);
    impl fx2::pins::Board for Impatient {
        fn drive(&mut self, now: Ps, driven: &fx2::pins::Driven) {
            self.0.drive(now, driven);
        }
        fn sense(&mut self, now: Ps) -> fx2::pins::Sensed {
            self.0.sense(now)
        }
        fn i2c_start(&mut self, _: Ps, _: u8) -> bool {
            false
        }
        fn i2c_write(&mut self, _: Ps, _: u8) -> bool {
            false
        }
        fn i2c_read(&mut self, _: Ps, _: bool) -> u8 {
            0xFF
        }
        fn i2c_stop(&mut self, _: Ps) {}
        fn end_slice(&mut self) -> bool {
            self.0.driven.port[0] & self.0.driven.port_enable[0] & 1 != 0
        }
    }
    let program = Program::new().sfr(0xB2, 1).sfr(0x80, 0).sfr(0x80, 1).stop();
    let mut fx2 = program.start();
    let mut board = Impatient::default();
    let reached = fx2.run_until(MS, &mut board);
    assert!(reached < 100 * US);
    assert_eq!(board.0.seen.last().map(|seen| seen.0), Some(reached));
}

#[test]
fn a_suspended_chip_sleeps_until_the_host_resumes() {
    // SUSPEND, then IDLE; the resume interrupt at 0x33.
    let program = Program::default()
        .code(&[0x02, 0x01, 0x00])
        .org(0x33)
        .sfr(0x30, 0x33)
        .code(&[0x53, 0xD8, 0xEF, 0x32])
        .org(0x100)
        .sfr(0xD8, 0x20)
        .sfr(0x89, 0x01)
        .sfr(0x88, 0x10)
        .xdata(0xE681, 0x01)
        .idle();
    let (mut fx2, mut board) = run(&program);
    assert_eq!(fx2.next_event(), Ps::MAX, "even timer 0 stands still");
    fx2.run_until(500 * MS, &mut board);
    assert_eq!(iram(&fx2, 0x30), 0);
    fx2.usb_resume();
    fx2.run_until(501 * MS, &mut board);
    assert_eq!(iram(&fx2, 0x30), 0x33);
}

/// The twelve ways in which EP2, EP4, EP6 and EP8 may share their 4 KiB (TRM figure 1-16): bytes of a packet
/// and number of buffers of each, 0 = switched off.
const BUFFERINGS: [[(usize, u8); 4]; 12] = [
    [(512, 2), (512, 2), (512, 2), (512, 2)],
    [(512, 2), (512, 2), (512, 4), (0, 0)],
    [(512, 2), (512, 2), (1024, 2), (0, 0)],
    [(512, 4), (0, 0), (512, 2), (512, 2)],
    [(512, 4), (0, 0), (512, 4), (0, 0)],
    [(512, 4), (0, 0), (1024, 2), (0, 0)],
    [(1024, 2), (0, 0), (512, 2), (512, 2)],
    [(1024, 2), (0, 0), (512, 4), (0, 0)],
    [(1024, 2), (0, 0), (1024, 2), (0, 0)],
    [(512, 3), (0, 0), (512, 3), (512, 2)],
    [(1024, 3), (0, 0), (0, 0), (512, 2)],
    [(1024, 4), (0, 0), (0, 0), (0, 0)],
];

#[test]
fn every_legal_buffering_takes_and_gives_its_number_of_packets() {
    for (case, buffering) in BUFFERINGS.iter().enumerate() {
        let mut program = Program::new();
        for (index, &(size, count)) in buffering.iter().enumerate() {
            // EP2 and EP4 OUT, EP6 and EP8 IN; packets of 1024 bytes are interrupt packets, others bulk.
            let direction = if index < 2 { 0x00 } else { 0x40 };
            let kind = if size == 1024 { 0x38 } else { 0x20 };
            // EP4 and EP8 have no choice.
            let number = if index % 2 == 1 { 0 } else { [0, 0, 2, 3, 0][usize::from(count)] };
            let valid = if count > 0 { 0x80 } else { 0x00 };
            let cfg = valid | direction | kind | number;
            program = program.xdata(0xE612 + index as u16, cfg).xdata(0xE618 + index as u16, 0);
        }
        for (index, &(size, count)) in buffering.iter().enumerate() {
            let bch = 0xE690 + 4 * index as u16;
            for packet in 0..count {
                program = if index < 2 {
                    program.xdata(bch + 1, 0x80)
                } else {
                    let [high, low] = (size as u16).to_be_bytes();
                    let buffer = 0xF000 + 0x400 * index as u16;
                    program.xdata(buffer, packet).xdata(bch, high).xdata(bch + 1, low)
                };
            }
        }
        let mut fx2 = program.stop().start();
        fx2.usb_reset();
        fx2.usb_reset_done(Speed::High);
        fx2.run_until(5 * MS, &mut Unconnected);
        let mut data = [0; PACKET_MAX];
        for (index, &(size, count)) in buffering.iter().enumerate() {
            let number = 2 * index as u8 + 2;
            for packet in 0..count {
                let toggle = packet % 2 != 0;
                if index < 2 {
                    let reply = fx2.usb_out(number, toggle, &data[..size]);
                    assert_eq!(reply, OutReply::Ack, "case {case}, EP{number}, packet {packet}");
                } else {
                    let reply = fx2.usb_in(number, &mut data);
                    assert_eq!(
                        reply,
                        InReply::Data { length: size, toggle },
                        "case {case}, EP{number}"
                    );
                    assert_eq!(data[0], packet, "case {case}, EP{number}");
                }
            }
            let full = match (index < 2, count) {
                (true, 0) => fx2.usb_out(number, false, &[]) == OutReply::NoResponse,
                (true, _) => fx2.usb_out(number, count % 2 != 0, &[1]) == OutReply::Nak,
                (false, 0) => fx2.usb_in(number, &mut data) == InReply::NoResponse,
                (false, _) => fx2.usb_in(number, &mut data) == InReply::Nak,
            };
            assert!(full, "case {case}: EP{number} has more than {count} buffers");
        }
        assert_eq!(fx2.diagnostics(), [], "case {case}");
    }
}
