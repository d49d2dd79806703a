//! The chip's peripheral blocks as firmware sees them: times, flags, interrupts, pins.

mod common;

use common::{Program, RESULTS, Recorder, result, result_long};
use khepera::turret_bus::Unconnected;
use khepera::{Base, Parity, WheelFault};
use sim::{MS, Ps, SECOND, US};

const SYSTEM_HZ: u64 = 25_165_824;

/// `clocks` system clocks in ps.
fn clocks(clocks: u64) -> Ps {
    (u128::from(clocks) * u128::from(SECOND) / u128::from(SYSTEM_HZ)) as Ps
}

fn program(vectors: &[(usize, &str)], code: &str) -> Base {
    Program { vectors, sypcr: 4, code }.base()
}

/// Sends A, B, C ... as fast as it can at SCBR `scbr`.
fn sender(scbr: u16) -> Base {
    let code = format!(
        "move.w #{scbr},(SCCR0).w
         move.w #0x0008,(SCCR1).w
         moveq #0x41,%d0
         loop: btst #0,(SCSR).w
         beq loop
         move.w %d0,(SCDR).w
         addq.b #1,%d0
         bra loop"
    );
    program(&[], &code)
}

#[test]
fn a_character_takes_exactly_ten_bits_of_32_scbr_clocks() {
    let mut base = sender(82);
    base.run_until(50 * MS, &mut Unconnected);
    let sent = base.serial_take();
    assert!(sent.len() > 40);
    assert_eq!(sent[..3].iter().map(|s| s.1).collect::<Vec<_>>(), b"ABC");
    let first = sent[0].0;
    for (n, &(time, _)) in sent.iter().enumerate() {
        assert!(time.abs_diff(first + clocks(n as u64 * 10 * 32 * 82)) <= 1);
    }
    let baud = 10.0 * SECOND as f64 / (sent[1].0 - sent[0].0) as f64;
    assert!((baud / 9600.0 - 1.0).abs() < 0.0015, "{baud} baud");
}

#[test]
fn twice_the_baud_rate_does_not_pass_for_the_right_one() {
    let mut base = sender(41);
    base.run_until(50 * MS, &mut Unconnected);
    let sent: Vec<u8> = base.serial_take().iter().map(|s| s.1).collect();
    assert!(!sent.starts_with(b"AB"), "{sent:?}");
}

#[test]
fn received_characters_interrupt_and_are_echoed() {
    let mut base = program(
        &[(0x42, "serial")],
        "move.w #82,(SCCR0).w
         move.w #0x0081,(QSMCR).w
         move.b #0x04,(QILR).w         | SCI level 4
         move.b #0x43,(QIVR).w
         move.w #0x002C,(SCCR1).w      | RIE, TE, RE
         again: stop #0x2000
         bra again
         serial: move.w (SCSR).w,%d1
         move.w (SCDR).w,%d0
         move.w %d0,(SCDR).w
         rte",
    );
    base.run_until(5 * MS, &mut Unconnected);
    base.serial_send(b"Khepera 26\r");
    base.run_until(30 * MS, &mut Unconnected);
    let echo: Vec<u8> = base.serial_take().iter().map(|s| s.1).collect();
    assert_eq!(echo, b"Khepera 26\r");
    assert_eq!(base.serial_waiting(), 0);
}

#[test]
fn a_character_that_nobody_fetches_is_an_overrun_and_the_first_one_stays() {
    let mut base = program(
        &[],
        "move.w #82,(SCCR0).w
         move.w #0x0004,(SCCR1).w
         wait: btst #3,(SCSR+1).w      | OR
         beq wait
         move.w (SCSR).w,(RESULTS).l
         move.w (SCDR).w,(RESULTS+2).l
         move.w (SCSR).w,(RESULTS+4).l
         stop #0x2700",
    );
    base.run_until(MS, &mut Unconnected);
    base.serial_send(b"xy");
    base.run_until(10 * MS, &mut Unconnected);
    assert_eq!(result(&base, 0) & 0x48, 0x48, "RDRF and OR");
    assert_eq!(result(&base, 2), u16::from(b'x'));
    assert_eq!(result(&base, 4) & 0x48, 0, "cleared by reading SCSR, then SCDR");
}

#[test]
fn a_break_in_the_rate_is_a_framing_error() {
    let mut base = program(
        &[],
        "move.w #41,(SCCR0).w          | 19200, the host has 9600
         move.w #0x0004,(SCCR1).w
         wait: btst #6,(SCSR+1).w
         beq wait
         move.w (SCSR).w,(RESULTS).l
         stop #0x2700",
    );
    base.run_until(MS, &mut Unconnected);
    base.serial_send(&[0x00]);
    base.run_until(10 * MS, &mut Unconnected);
    assert_eq!(result(&base, 0) & 0x02, 0x02, "FE");
}

/// Notes SCSR and SCDR of each character, at `RESULTS` one after the other.
const LISTENER: &str = "
        lea (RESULTS).l,%a0
 wait:  move.w (SCSR).w,%d0
        btst #6,%d0
        beq wait
        move.w %d0,(%a0)+
        move.w (SCDR).w,(%a0)+
        bra wait";
const BIT_9600: Ps = 32 * 82 * SECOND / SYSTEM_HZ;

/// What a listener with `sccr1` got of what `send` does: flags NF, FE and PF, and the data.
fn heard(sccr1: u16, send: impl FnOnce(&mut Base)) -> Vec<(u16, u16)> {
    let code = format!("move.w #82,(SCCR0).w\n move.w #{sccr1},(SCCR1).w\n{LISTENER}");
    let mut base = program(&[], &code);
    base.run_until(5 * MS, &mut Unconnected);
    base.serial_set_baud(None);
    send(&mut base);
    base.run_until(40 * MS, &mut Unconnected);
    let entry = |n: u32| (result(&base, 4 * n), result(&base, 4 * n + 2));
    let written = (base.registers()[8] - RESULTS) / 4;
    (0..written).map(entry).map(|(status, data)| (status & 7, data)).collect()
}

const RECEIVE: u16 = 0x0004;
const NOISE: u16 = 4;
const FRAMING: u16 = 2;
const PARITY: u16 = 1;

#[test]
fn a_break_is_one_framing_error_and_what_follows_it_is_received() {
    let got = heard(RECEIVE, |base| {
        base.serial_send(b"a");
        base.serial_break(7 * MS);
        base.serial_send(b"b");
    });
    assert_eq!(got, [(0, 97), (FRAMING, 0), (0, 98)]);
}

#[test]
fn a_sample_that_disagrees_is_noise_and_two_turn_the_bit() {
    // Bit 2 of 0x00: its samples are taken at 7, 8 and 9 sixteenths of the third bit.
    for (sixteenths, expected) in [(1, (NOISE, 0)), (2, (NOISE, 4)), (3, (0, 4))] {
        let got = heard(RECEIVE, |base| {
            let start = base.now();
            base.serial_send(&[0]);
            let rt = BIT_9600 / 16;
            base.serial_disturb(start + 3 * BIT_9600 + 6 * rt + rt / 2, sixteenths * rt);
        });
        assert_eq!(got, [expected], "{sixteenths} samples");
    }
}

#[test]
fn a_short_disturbance_of_a_line_at_rest_is_nothing_and_a_long_one_a_character() {
    let disturbed = |sixteenths: u64| {
        heard(RECEIVE, |base| {
            base.serial_disturb(base.now() + MS, sixteenths * BIT_9600 / 16);
        })
    };
    assert_eq!(disturbed(3), []);
    assert_eq!(disturbed(16), [(0, 0xFF)]);
}

#[test]
fn parity_is_checked_as_the_registers_say() {
    const NINE_EVEN: u16 = RECEIVE | 1 << 9 | 1 << 10;
    const NINE_ODD: u16 = NINE_EVEN | 1 << 11;
    for (sccr1, host, flag) in [
        (NINE_EVEN, Parity::Even, 0),
        (NINE_ODD, Parity::Odd, 0),
        (NINE_EVEN, Parity::Odd, PARITY),
        (NINE_ODD, Parity::Even, PARITY),
    ] {
        let got = heard(sccr1, |base| {
            base.serial_set_parity(Some(host));
            base.serial_send(&[0x00, 0x01, 0xFF]);
        });
        let (flags, data): (Vec<u16>, Vec<u16>) = got.into_iter().unzip();
        assert_eq!(flags, [flag; 3], "{sccr1:#06x} {host:?}");
        assert_eq!(data.iter().map(|d| d & 0xFF).collect::<Vec<_>>(), [0, 1, 0xFF]);
    }
}

#[test]
fn parity_and_breaks_are_sent_as_the_registers_say() {
    let mut base = program(
        &[],
        "move.w #82,(SCCR0).w
         move.w #0x0608,(SCCR1).w      | M, PE: even, TE
         move.w (SCSR).w,%d0
         move.w #0x55,(SCDR).w
 wait:   move.w (SCSR).w,%d0
         btst #7,%d0                   | TC
         beq wait
         move.w #0x0609,(SCCR1).w      | a break
         move.w #0x0608,(SCCR1).w
         stop #0x2700",
    );
    base.serial_set_parity(Some(Parity::Even));
    base.run_until(10 * MS, &mut Unconnected);
    let sent: Vec<u8> = base.serial_take().iter().map(|s| s.1).collect();
    assert_eq!((sent, base.serial_framing_errors()), (vec![0x55], 1));
    assert_eq!(base.diagnostics().len(), 0, "{:?}", base.diagnostics());
}

#[test]
fn the_periodic_interrupt_keeps_the_crystal_s_time() {
    // PITM = 82: 82 / 8192 s = 10.009765625 ms; PTP prescales by 512
    for (pitr, period) in [(82u32, 82 * SECOND / 8192), (0x101, SECOND / 16)] {
        let code = format!(
            "move.w #0x0640,(PICR).w
             move.w #{pitr},(PITR).w
             again: stop #0x2000
             bra again
             tick: addq.l #1,(RESULTS).l
             rte"
        );
        let mut base = program(&[(0x40, "tick")], &format!("clr.l (RESULTS).l\n{code}"));
        base.run_until(10 * SECOND + 5 * MS, &mut Unconnected);
        assert_eq!(u64::from(result_long(&base, 0)), 10 * SECOND / period, "PITR {pitr:#x}");
    }
}

/// Port QS and SCK as the board needs them, 16 words to the turret at fsys / (2 * 6) = 2.1 MHz.
const QUEUE: &str = "
        move.b  #0x78,(PORTQS).w      | all PCS high
        move.b  #0x7B,(PQSPAR).w
        move.b  #0x7E,(DDRQS).w
        move.w  #0x8006,(SPCR0).w     | master, 16 bits, CPHA = 0
        lea     (QTX).w,%a0
        lea     (QCMD).w,%a1
        moveq   #15,%d1
        fill: move.w #0xA500,%d0
        add.w   %d1,%d0
        move.w  %d0,(%a0)+
        move.b  #0xCD,(%a1)+          | CONT, BITSE, PCS = turret
        dbra    %d1,fill
        move.b  #0x4D,(QCMD+15).w     | the last one lets go of PCS
";

#[test]
fn the_queue_sends_and_receives_sixteen_words_in_one_run() {
    let code = format!(
        "{QUEUE}
         move.w #0x0081,(QSMCR).w
         move.b #0x28,(QILR).w         | QSPI level 5
         move.b #0x50,(QIVR).w
         move.w #0x8F00,(SPCR2).w      | SPIFIE, entries 0..15
         move.w #0x8404,(SPCR1).w      | SPE
         stop #0x2000
         move.w (SPCR1).w,(RESULTS+32).l
         lea (QRX).w,%a0
         lea (RESULTS).l,%a1
         moveq #15,%d1
         copy: move.w (%a0)+,(%a1)+
         dbra %d1,copy
         stop #0x2700
         done: move.b (SPSR).w,(RESULTS+34).l
         clr.b (SPSR).w
         move.b (SPSR).w,(RESULTS+35).l
         rte"
    );
    let mut base = program(&[(0x51, "done")], &code);
    let mut turret =
        Recorder { answers: (0..16).map(|n| 0x1230 + n).collect(), ..Recorder::default() };
    base.run_until(5 * MS, &mut turret);
    let words: Vec<u16> = turret.words.iter().map(|w| w.1).collect();
    assert_eq!(words, (0..16).map(|n| 0xA50F - n).collect::<Vec<u16>>());
    let levels: Vec<u8> = turret.selects.iter().map(|s| s.1).collect();
    assert_eq!(levels, [0xF, 0xD, 0xF], "reset, selected once, released");
    for n in 0..16 {
        assert_eq!(result(&base, 2 * n), 0x1230 + n as u16);
    }
    assert_eq!(result(&base, 32) & 0x8000, 0, "SPE clears itself");
    assert_eq!(result(&base, 34), 0x8F0F, "SPIF and CPTQP, then SPIF cleared");
    // 16 bits of 12 clocks, half a bit from PCS to SCK, 17 clocks after each word.
    let word = 16 * 12 + 6 + 17;
    let run = turret.words[15].0 - turret.words[0].0;
    assert!(run.abs_diff(clocks(15 * word)) <= 2, "{run} ps");
}

#[test]
fn queue_delays_and_widths_are_those_of_the_registers() {
    let code = format!(
        "{QUEUE}
         move.b #0x3D,(QCMD).w         | DT, DSCK, 8 bits
         move.b #0x3D,(QCMD+1).w
         move.w #0x0100,(SPCR2).w
         move.w #0x9402,(SPCR1).w      | SPE, DSCKL = 20, DTL = 2
         stop #0x2700"
    );
    let mut base = program(&[], &code);
    let mut turret = Recorder::default();
    base.run_until(5 * MS, &mut turret);
    assert_eq!(turret.words.iter().map(|w| w.2).collect::<Vec<_>>(), [8, 8]);
    let between = turret.words[1].0 - turret.words[0].0;
    assert!(between.abs_diff(clocks(2 * 32 + 20 + 8 * 12)) <= 2, "{between} ps");
    assert_eq!(turret.selects.len(), 5, "selected and released for each word");
}

#[test]
fn a_wrapping_queue_runs_until_halted_and_goes_on_after() {
    let code = format!(
        "{QUEUE}
         move.w #0x4301,(SPCR2).w      | WREN, WRTO = 0: entries 1, 2, 3, then 0..3 for ever
         move.w #0x8404,(SPCR1).w
         move.w #1000,%d0
         first: dbra %d0,first
         move.b #0x01,(SPCR3).w        | HALT
         halting: btst #5,(SPSR).w     | HALTA
         beq halting
         move.b (SPSR).w,(RESULTS).l
         move.w #2000,%d0
         second: dbra %d0,second
         move.b (SPSR).w,(RESULTS+1).l
         clr.b (SPSR).w
         clr.b (SPCR3).w
         third: tst.b (SPSR).w         | SPIF again
         bpl third
         clr.w (SPCR1).w
         stop #0x2700"
    );
    let mut base = program(&[], &code);
    let mut turret = Recorder::default();
    base.run_until(5 * MS, &mut turret);
    let words: Vec<u16> = turret.words.iter().map(|w| w.1).collect();
    assert!(words.len() > 20, "{} words", words.len());
    assert_eq!(words[..8], [0xA50E, 0xA50D, 0xA50C, 0xA50F, 0xA50E, 0xA50D, 0xA50C, 0xA50F]);
    let pauses = turret.words.windows(2).filter(|w| w[1].0 - w[0].0 > 300 * US);
    assert_eq!(pauses.count(), 1, "halted once");
    assert_eq!(result(&base, 0) >> 8, result(&base, 0) & 0xFF, "nothing went on while halted");
    let count = turret.words.len();
    base.run_until(10 * MS, &mut turret);
    assert_eq!(turret.words.len(), count, "clearing SPE stops it");
}

#[test]
fn without_its_pins_the_queue_reaches_nobody() {
    let code = format!(
        "{QUEUE}
         clr.b (DDRQS).w
         move.w #0x0F00,(SPCR2).w
         move.w #0x8404,(SPCR1).w
         wait: tst.b (SPSR).w
         bpl wait
         move.w (QRX).w,(RESULTS).l
         stop #0x2700"
    );
    let mut base = program(&[], &code);
    let mut turret = Recorder { answers: vec![0; 16], ..Recorder::default() };
    base.run_until(5 * MS, &mut turret);
    assert!(turret.words.is_empty());
    assert_eq!(result(&base, 0), 0xFFFF);
}

#[test]
fn the_adc_answers_at_its_own_select() {
    let code = "
        move.b  #0x78,(PORTQS).w
        move.b  #0x7B,(PQSPAR).w
        move.b  #0x7E,(DDRQS).w
        move.w  #0x800D,(SPCR0).w
        move.w  #0x3000,(QTX).w       | input 3, read in the second transfer
        move.w  #0x8000,(QTX+2).w     | battery, read in the third
        move.b  #0x6E,(QCMD).w        | BITSE, DT, PCS = ADC
        move.b  #0x6E,(QCMD+1).w
        move.b  #0x6E,(QCMD+2).w
        move.w  #0x0200,(SPCR2).w
        move.w  #0x8414,(SPCR1).w     | DTL = 20: 25 us
        wait: tst.b (SPSR).w
        bpl wait
        move.l (QRX+2).w,(RESULTS).l
        stop #0x2700";
    let mut base = program(&[], code);
    base.set_proximity([0, 0, 0, 777, 0, 0, 0, 0]);
    base.set_battery_mv(5000);
    base.run_until(5 * MS, &mut Unconnected);
    assert_eq!(result(&base, 0) >> 6, 777);
    assert_eq!(result(&base, 2) >> 6, 511, "5 V of 10 V");
}

const ATTENTION: &str = "
        clr.l (RESULTS).l
        again: stop #0x2000
        bra again
        attention: addq.l #1,(RESULTS).l
        rte";

#[test]
fn an_attention_line_is_a_level_and_autovectors() {
    let mut base = program(&[(28, "attention")], ATTENTION);
    let mut turret = Recorder::default();
    base.run_until(5 * MS, &mut turret);
    assert_eq!(result_long(&base, 0), 0);
    turret.asserted = 1 << 4;
    base.run_until(6 * MS, &mut turret);
    let while_low = result_long(&base, 0);
    assert!(while_low > 100, "comes again as long as it is low: {while_low}");
    turret.asserted = 0;
    base.run_until(7 * MS, &mut turret);
    base.run_until(8 * MS, &mut turret);
    assert!(result_long(&base, 0) - while_low <= 1);
}

#[test]
fn a_pin_that_is_a_port_does_not_interrupt() {
    let code = format!("clr.b (PFPAR).w\n{ATTENTION}");
    let mut base = program(&[(28, "attention")], &code);
    let mut turret = Recorder { asserted: 1 << 4, ..Recorder::default() };
    base.run_until(5 * MS, &mut turret);
    assert_eq!(result_long(&base, 0), 0);
}

#[test]
fn a_pin_that_is_an_input_of_port_f_can_be_read() {
    let code = "clr.b (PFPAR).w\n again: move.b (PORTF).w,(RESULTS).l\n bra again";
    let mut base = program(&[], code);
    let mut turret = Recorder::default();
    base.run_until(5 * MS, &mut turret);
    assert_eq!(result(&base, 0) >> 8, 0xFF);
    turret.asserted = 1 << 4;
    base.run_until(6 * MS, &mut turret);
    assert_eq!(result(&base, 0) >> 8, 0xEF);
}

#[test]
fn leds_light_when_port_f_drives_them() {
    let mut base = program(
        &[],
        "move.b #0xFC,(PFPAR).w\n move.b #0x02,(PORTF).w\n move.b #0x03,(DDRF).w\n stop #0x2700",
    );
    assert_eq!(base.leds(), [false, false]);
    base.run_until(5 * MS, &mut Unconnected);
    assert_eq!(base.leds(), [false, true]);
}

/// Left wheel forward at half duty, right backward at a quarter; counts edges of both A channels by
/// interrupt, with B as direction.
const WHEELS: &str = "
        clr.l   (RESULTS).l
        clr.l   (RESULTS+4).l
        move.w  #0x0081,(GPTMCR).w
        move.w  #0x0640,(ICR).w
        move.b  #0x0F,(TCTL2).w       | IC1, IC2 on both edges
        move.b  #0x03,(TMSK1).w
        move.b  #0x60,(DDRGP).w
        move.b  #0x20,(PORTGP).w
        move.b  #128,(PWMA).w
        move.b  #64,(PWMB).w
        again: stop #0x2000
        bra again
        left:   move.b (PORTGP).w,%d0
        move.b  (TFLG1).w,%d1
        and.b   #0xFE,%d1
        move.b  %d1,(TFLG1).w
        moveq   #1,%d2
        lsr.b   #1,%d0                | A to carry
        scs     %d3
        lsr.b   #2,%d0                | B to carry
        scs     %d4
        cmp.b   %d3,%d4
        bne     f1
        neg.l   %d2
        f1:     add.l %d2,(RESULTS).l
        rte
        right:  move.b (PORTGP).w,%d0
        move.b  (TFLG1).w,%d1
        and.b   #0xFD,%d1
        move.b  %d1,(TFLG1).w
        moveq   #1,%d2
        btst    #1,%d0
        sne     %d3
        btst    #7,%d0
        sne     %d4
        cmp.b   %d3,%d4
        bne     f2
        neg.l   %d2
        f2:     add.l %d2,(RESULTS+4).l
        rte
";

#[test]
fn encoder_interrupts_count_what_the_wheels_roll() {
    let mut base = program(&[(0x41, "left"), (0x42, "right")], WHEELS);
    base.run_until(2 * SECOND, &mut Unconnected);
    let [left, right] = base.wheel_travel_mm();
    let counted = [0, 4].map(|at| f64::from(result_long(&base, at) as i32) / 12.0);
    assert!(left > 700.0 && right < -250.0, "{left} {right} mm");
    assert!((counted[0] - left).abs() < 0.2, "{} of {left} mm", counted[0]);
    assert!((counted[1] - right).abs() < 0.2, "{} of {right} mm", counted[1]);
    assert_eq!(base.motors().map(|m| (m.duty, m.forward)), [(0.5, true), (0.25, false)]);
    assert_eq!(base.diagnostics(), []);
}

#[test]
fn a_stuck_encoder_counts_nothing_and_a_stalled_wheel_stands() {
    let mut base = program(&[(0x41, "left"), (0x42, "right")], WHEELS);
    base.set_wheel_fault(0, WheelFault::EncoderStuck);
    base.set_wheel_fault(1, WheelFault::Stalled);
    base.run_until(SECOND, &mut Unconnected);
    assert_eq!((result_long(&base, 0), result_long(&base, 4)), (0, 0));
    assert!(base.wheel_speeds_mm_s()[0] > 300.0);
    assert_eq!(base.wheel_speeds_mm_s()[1], 0.0);
}

#[test]
fn a_load_slows_a_wheel_and_a_flat_battery_too() {
    let speed = |prepare: fn(&mut Base)| {
        let mut base = program(&[(0x41, "left"), (0x42, "right")], WHEELS);
        prepare(&mut base);
        base.run_until(SECOND, &mut Unconnected);
        base.wheel_speeds_mm_s()[0]
    };
    let free = speed(|_| {});
    assert!(speed(|b| b.set_load([0.3, 0.0])) < free - 50.0);
    assert!(speed(|b| b.set_battery_mv(3600)) < 0.8 * free);
}

#[test]
fn a_capture_holds_the_time_of_its_edge() {
    // The time between captures against the wheel's speed at 12 edges a mm.
    let code = "
        move.w  #0x0081,(GPTMCR).w
        move.w  #0x0640,(ICR).w
        move.b  #0x03,(TCTL2).w
        move.b  #0x01,(TMSK1).w
        move.b  #0x60,(DDRGP).w
        move.b  #0x20,(PORTGP).w
        move.b  #192,(PWMA).w
        again: stop #0x2000
        bra again
        left:   move.w (TIC1).w,%d0
        move.w  %d0,%d1
        sub.w   (RESULTS+2).l,%d1
        move.w  %d1,(RESULTS).l
        move.w  %d0,(RESULTS+2).l
        move.b  (TFLG1).w,%d1
        clr.b   (TFLG1).w
        rte";
    let mut base = program(&[(0x41, "left")], code);
    base.run_until(SECOND, &mut Unconnected);
    let speed = base.wheel_speeds_mm_s()[0];
    let seconds = f64::from(result(&base, 0)) * 4.0 / SYSTEM_HZ as f64;
    let measured = 1.0 / 12.0 / seconds;
    assert!((measured / speed - 1.0).abs() < 0.005, "{measured} against {speed} mm/s");
}

#[test]
fn a_compare_interrupts_at_its_count() {
    let code = "
        move.w  #0x0081,(GPTMCR).w
        move.w  #0x0640,(ICR).w
        move.b  #0x08,(TMSK1).w
        clr.l   (RESULTS).l
        again: stop #0x2000
        bra again
        compare: move.b (TFLG1).w,%d0
        clr.b   (TFLG1).w
        add.w   #6291,(TOC1).w        | 1 ms
        addq.l  #1,(RESULTS).l
        rte";
    let mut base = program(&[(0x44, "compare")], code);
    base.run_until(200 * MS, &mut Unconnected);
    let first = result_long(&base, 0);
    base.run_until(1200 * MS, &mut Unconnected);
    assert!((result_long(&base, 0) - first).abs_diff(1000) <= 1);
}

#[test]
fn registers_that_are_not_modelled_are_listed_once_with_their_pc() {
    let mut base = program(
        &[(2, "missing")],
        "move.b #0x60,(0xFFFFF90C).w   | pulse accumulator, gated
         move.b #0x60,(0xFFFFF90C).w
         tst.w (0xFFFFFE00).w          | the 68332's TPU, not here
         stop #0x2700
         missing: stop #0x2700",
    );
    base.run_until(MS, &mut Unconnected);
    let list = base.diagnostics();
    assert_eq!(list.iter().map(|d| d.address).collect::<Vec<_>>(), [0xFF_F90C, 0xFF_FE00]);
    assert!(list[0].write && !list[1].write && list[0].pc != 0);
    assert!(list[0].to_string().contains("0xfff90c"), "{}", list[0]);
    assert!(list[0].time < 200 * US);
}
