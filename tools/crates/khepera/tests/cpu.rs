//! The CPU as a CPU32: exceptions, frames, what it lacks, STOP; memory map; resets.

mod common;

use common::{Program, RESULTS, UNEXPECTED, result, result_long};
use khepera::turret_bus::Unconnected;
use khepera::{CpuState, ResetCause};
use sim::{MS, SECOND, US};

/// Runs a program for 20 ms.
fn ran(vectors: &[(usize, &str)], code: &str) -> khepera::Base {
    let mut base = Program { vectors, sypcr: 4, code }.base();
    base.run_until(20 * MS, &mut Unconnected);
    base
}

#[test]
fn after_reset_the_cause_is_power_on_and_the_clock_8_mhz_until_set() {
    let code = "move.b (RSR).w,(RESULTS).l\n move.w (SYNCR).w,(RESULTS+2).l\n stop #0x2700";
    let program = Program { vectors: &[], sypcr: 4, code };
    let mut base = program.base();
    assert_eq!(base.system_hz(), 8_388_608);
    base.run_until(MS, &mut Unconnected);
    assert_eq!(base.system_hz(), 25_165_824);
    assert_eq!(result(&base, 0) >> 8, 0x40, "RSR.POW");
    assert_eq!(result(&base, 2), 0xD700, "not locked yet");
    assert_eq!(base.cpu_state(), CpuState::Stopped);
    assert_eq!(base.diagnostics(), []);
}

#[test]
fn ram_is_out_of_reach_before_its_chip_selects_are_set() {
    let image = Program { vectors: &[], sypcr: 4, code: "stop #0x2700" }.build();
    let mut base = khepera::Base::new(&image, khepera::Config::default()).expect("an image");
    assert_eq!(base.peek_word(RESULTS), None);
    base.run_until(MS, &mut Unconnected);
    assert!(base.peek_word(RESULTS).is_some());
}

#[test]
fn half_a_ram_keeps_only_its_own_byte() {
    let base = ran(
        &[],
        "move.w #0,(CSOR1).w          | the lower byte's chip is no longer selected
         move.w #0x1234,(RESULTS).l
         move.w #0x3870,(CSOR1).w
         move.b (RESULTS).l,(RESULTS+2).l
         stop #0x2700",
    );
    assert_eq!(result(&base, 0) >> 8, 0x12);
    assert_ne!(result(&base, 0) & 0xFF, 0x34, "what RAM held at power-on");
}

#[test]
fn an_odd_word_is_an_address_error_with_the_cpu32_s_frame() {
    for (access, address, write) in [
        ("move.w (0x100001).l,%d0", 0x10_0001, false),
        ("move.l %d0,(0x100003).l", 0x10_0003, true),
        ("jmp (0x2001).l", 0x2001, false),
    ] {
        let code = format!(
            "move.w #0x2200,%sr\nmarked: {access}\n stop #0x2700
             handler: move.l %sp,%d1
             sub.l #0x180000,%d1
             move.l %d1,(RESULTS).l
             move.w (%sp),(RESULTS+4).l
             move.l 2(%sp),(RESULTS+6).l
             move.w 6(%sp),(RESULTS+10).l
             move.l 8(%sp),(RESULTS+12).l
             move.w 22(%sp),(RESULTS+16).l
             move.l #marked,(RESULTS+20).l
             stop #0x2700"
        );
        let base = ran(&[(3, "handler")], &code);
        assert_eq!(result_long(&base, 0) as i32, -24, "{access}: twelve words");
        assert_eq!(result(&base, 4) & 0xFF00, 0x2200, "{access}: SR");
        assert_eq!(result(&base, 10), 0xC00C, "{access}: format and vector");
        assert_eq!(result_long(&base, 12), address, "{access}");
        let instruction = access.starts_with("jmp");
        let pc = if instruction { address } else { result_long(&base, 20) };
        assert_eq!(result_long(&base, 6), pc, "{access}: PC");
        let status = result(&base, 16);
        assert_eq!(status & 0x40 == 0, write, "{access}: RW");
        assert_eq!(status & 0x80 != 0, instruction, "{access}: IN");
        assert_eq!(status & 7, if instruction { 6 } else { 5 }, "{access}: function code");
    }
}

#[test]
fn bytes_may_lie_at_odd_addresses() {
    let base =
        ran(&[], "move.b #0x5A,(RESULTS+1).l\n move.b (RESULTS+1).l,(RESULTS).l\n stop #0x2700");
    assert_eq!(result(&base, 0), 0x5A5A);
}

#[test]
fn nobody_s_space_is_a_bus_error_and_rte_starts_the_instruction_again() {
    let base = ran(
        &[(2, "handler")],
        "move.l #0x400000,%a0
         clr.w (RESULTS).l
         move.w (%a0)+,(RESULTS+2).l
         move.l %a0,(RESULTS+4).l
         move.l %sp,(RESULTS+8).l
         stop #0x2700
         handler: addq.w #1,(RESULTS).l
         move.l #0x100000,%a0         | where there is something
         move.w #0x4321,(%a0)
         rte",
    );
    assert_eq!(result(&base, 0), 1, "one bus error");
    assert_eq!(result(&base, 2), 0x4321);
    assert_eq!(result_long(&base, 4), 0x10_0002);
    assert_eq!(result_long(&base, 8), 0x18_0000, "the frame is off the stack");
    let diagnostic = &base.diagnostics()[0];
    assert_eq!((diagnostic.address, diagnostic.write), (0x40_0000, false));
}

#[test]
fn frames_of_trap_and_of_division_by_zero() {
    let base = ran(
        &[(33, "handler"), (5, "divided")],
        "trap #1
         clr.w %d0
         divu.w %d0,%d1
         stop #0x2700
         handler: move.w 6(%sp),(RESULTS).l
         rte
         divided: move.w 6(%sp),(RESULTS+2).l
         move.l %sp,(RESULTS+4).l
         rte",
    );
    assert_eq!(result(&base, 0), 0x0084, "format $0, vector 33");
    assert_eq!(result(&base, 2), 0x2014, "format $2, vector 5");
    assert_eq!(result_long(&base, 4), 0x18_0000 - 12, "six words");
    assert_eq!(base.cpu_state(), CpuState::Stopped);
}

#[test]
fn instructions_that_a_cpu32_lacks_are_illegal() {
    // bfffo %d0{0:8},%d1; cas.w %d0,%d1,(%a0); pack; unpk; rtm %d1
    for words in ["0xEDC0,0x1008", "0x0CD0,0x0040", "0x8101+0x40,0", "0x8181,0", "0x06C1"] {
        let code = format!(
            "marked: .short {words}\n stop #0x2700
             handler: move.l 2(%sp),%d0
             sub.l #marked,%d0
             move.l %d0,(RESULTS).l
             move.w 6(%sp),(RESULTS+4).l
             stop #0x2700"
        );
        let base = ran(&[(4, "handler")], &code);
        assert_eq!((result_long(&base, 0), result(&base, 4)), (0, 0x0010), "{words}");
    }
    // fmove.x %fp0,%fp1: no coprocessor
    let fpu = ran(
        &[(11, "handler")],
        ".short 0xF200,0x0080\n stop #0x2700\nhandler: move.w 6(%sp),(RESULTS).l\n stop #0x2700",
    );
    assert_eq!(result(&fpu, 0), 0x002C);
}

#[test]
fn stop_and_lpstop_wait_for_the_periodic_interrupt() {
    for wait in ["stop #0x2000", ".short 0xF800,0x01C0,0x2000"] {
        let code = format!(
            "clr.w (RESULTS).l
             move.w #0x0640,(PICR).w       | level 6, vector 64
             move.w #82,(PITR).w
             again: {wait}
             addq.w #1,(RESULTS+2).l
             bra again
             tick: addq.w #1,(RESULTS).l
             clr.w (RESULTS+2).l
             rte"
        );
        let mut base = Program { vectors: &[(64, "tick")], sypcr: 4, code: &code }.base();
        base.run_until(105 * MS, &mut Unconnected);
        assert_eq!(result(&base, 0), 10, "{wait}: ticks of 10.01 ms");
        assert_eq!(result(&base, 2), 1, "{wait}: one pass a tick");
        let load = base.load();
        assert!(load.busy_clocks < load.idle_clocks / 100, "{wait}: {load:?}");
        assert_eq!(base.diagnostics().len(), usize::from(wait.starts_with(".short")), "{wait}");
    }
}

#[test]
fn without_service_the_watchdog_resets_and_ram_survives() {
    // SWE, SWP = 0, SWT = 0: 512 crystal clocks = 15.625 ms
    let program = Program {
        vectors: &[],
        sypcr: 0x84,
        code: "btst #5,(RSR).w
               bne again
               move.l #0x12345678,(RESULTS).l
               hang: bra hang
               again: move.b (RSR).w,(RESULTS+4).l
               addq.w #1,(RESULTS+6).l
               loop: move.b #0x55,(SWSR).w
               move.b #0xAA,(SWSR).w
               bra loop",
    };
    let mut base = program.base();
    base.run_until(100 * MS, &mut Unconnected);
    assert_eq!(base.resets().len(), 2);
    assert_eq!(base.resets()[1].cause, ResetCause::Watchdog);
    let after = base.resets()[1].time - base.resets()[0].time;
    assert!(after.abs_diff(15_625_000_000) < 200_000_000, "{after} ps");
    assert_eq!(result_long(&base, 0), 0x1234_5678);
    assert_eq!(result(&base, 4) >> 8, 0x20, "RSR.SW");
}

#[test]
fn a_wrong_service_sequence_does_not_help() {
    let code =
        "loop: move.b #0x55,(SWSR).w\n move.b #0x12,(SWSR).w\n move.b #0xAA,(SWSR).w\n bra loop";
    let mut base = Program { vectors: &[], sypcr: 0x84, code }.base();
    base.run_until(20 * MS, &mut Unconnected);
    assert_eq!(base.resets().len(), 2);
}

#[test]
fn with_the_bus_monitor_off_nobody_s_space_hangs_until_the_watchdog() {
    let mut base = Program { vectors: &[], sypcr: 0x80, code: "tst.w (0x400000).l" }.base();
    base.run_until(10 * MS, &mut Unconnected);
    assert_eq!(base.cpu_state(), CpuState::Hung);
    base.run_until(17 * MS, &mut Unconnected);
    assert_eq!(base.resets().last().map(|r| r.cause), Some(ResetCause::Watchdog));
}

#[test]
fn a_double_fault_halts_and_the_halt_monitor_resets() {
    let code = "move.l #0x400000,%sp\n trap #0";
    let mut base = Program { vectors: &[], sypcr: 4, code }.base();
    base.run_until(20 * MS, &mut Unconnected);
    assert_eq!(base.cpu_state(), CpuState::Halted);
    assert_eq!(base.resets().len(), 1);
    let code = "btst #4,(RSR).w\n beq fail\n stop #0x2700\nfail: move.l #0x400000,%sp\n trap #0";
    let mut base = Program { vectors: &[], sypcr: 0x0C, code }.base();
    base.run_until(20 * MS, &mut Unconnected);
    assert_eq!(base.resets().last().map(|r| r.cause), Some(ResetCause::Halt));
    assert_eq!(base.cpu_state(), CpuState::Stopped);
}

#[test]
fn an_interrupt_from_a_module_without_iarb_is_spurious() {
    let base = ran(
        &[(24, "spurious")],
        "move.w #0x0650,(ICR).w       | GPT level 6, vectors $50..., but GPTMCR.IARB = 0
         move.w #0x0800,(TMSK1).w     | OC1
         move.w #0x2000,%sr
         wait: bra wait
         spurious: move.w #1,(RESULTS).l
         stop #0x2700",
    );
    assert_eq!(result(&base, 0), 1);
    assert_ne!(result(&base, 0), UNEXPECTED);
}

#[test]
fn a_power_cycle_loses_ram_and_the_reset_pin_does_not() {
    let mut base = Program {
        vectors: &[],
        sypcr: 4,
        code: "move.b (RSR).w,(RESULTS+4).l
               btst #6,(RSR).w
               beq kept
               move.l #0x12345678,(RESULTS).l
               move.l (RESULTS+8).l,%d0
               move.l #0x12345678,(RESULTS+8).l
               move.l %d0,(RESULTS+12).l
               kept: stop #0x2700",
    }
    .base();
    base.run_until(5 * MS, &mut Unconnected);
    base.reset();
    base.run_until(10 * MS, &mut Unconnected);
    assert_eq!((result(&base, 4) >> 8, result_long(&base, 0)), (0x80, 0x1234_5678));
    base.set_power(false);
    base.run_until(12 * MS, &mut Unconnected);
    assert_eq!(base.cpu_state(), CpuState::Held);
    base.set_power(true);
    base.run_until(15 * MS, &mut Unconnected);
    assert_eq!(result(&base, 4) >> 8, 0x40);
    assert_ne!(result_long(&base, 12), 0x1234_5678, "what was in RAM is gone");
}

#[test]
fn a_snapshot_goes_on_as_the_original_does_and_slices_do_not_matter() {
    let code = "
        move.w #82,(SCCR0).w
        move.w #0x000C,(SCCR1).w
        move.w #0xFF60,(DDRGP).w
        move.b #0x80,(PWMA).w
        loop: addq.l #1,%d7
        btst #0,(SCSR).w
        beq loop
        move.b (TCNT+1).w,(SCDR+1).w
        bra loop";
    let mut whole = Program { vectors: &[], sypcr: 4, code }.base();
    whole.run_until(50 * MS, &mut Unconnected);
    let mut copy = whole.clone();
    whole.run_until(100 * MS, &mut Unconnected);
    for ms in 51..=100 {
        copy.run_until(ms * MS, &mut Unconnected);
    }
    assert_eq!(whole.registers(), copy.registers());
    assert_eq!(whole.now(), copy.now());
    assert_eq!(whole.wheel_travel_mm(), copy.wheel_travel_mm());
    let sent = whole.serial_take();
    assert!(sent.len() > 80, "{} characters", sent.len());
    assert_eq!(sent, copy.serial_take());
}

#[test]
fn a_flat_battery_holds_the_chip_in_reset_with_the_motors_off() {
    let code = "move.b #0x20,(DDRGP).w\n move.b #0x80,(PWMA).w\n stop #0x2700";
    let mut base = Program { vectors: &[], sypcr: 4, code }.base();
    base.run_until(200 * MS, &mut Unconnected);
    assert_eq!(base.motors()[0].duty, 0.5);
    base.set_battery_mv(3500);
    base.run_until(201 * MS, &mut Unconnected);
    assert_eq!((base.cpu_state(), base.motors()[0].duty), (CpuState::Held, 0.0));
    base.set_battery_mv(3700);
    base.run_until(202 * MS, &mut Unconnected);
    assert_eq!(base.cpu_state(), CpuState::Held, "not before 3800 mV");
    base.set_battery_mv(4000);
    base.run_until(210 * MS, &mut Unconnected);
    assert_eq!(base.resets().last().map(|r| r.cause), Some(ResetCause::External));
    assert_eq!(base.motors()[0].duty, 0.5, "it has started again");
}

#[test]
fn the_worst_interrupt_latency_is_the_longest_time_masked() {
    let code = "
        move.w #0x0640,(PICR).w
        move.w #82,(PITR).w
        move.w #0x2000,%sr
        move.l #5,%d1
        again: stop #0x2000
        dbra %d1,again
        move.w #0x2700,%sr
        move.l #4000000,%d0
        busy: subq.l #1,%d0
        bne.s busy
        stop #0x2000
        bra again
        tick: rte";
    let mut base = Program { vectors: &[(64, "tick")], sypcr: 4, code }.base();
    base.run_until(50 * MS, &mut Unconnected);
    let short = base.worst_interrupt_latency()[6];
    assert!(short < 2 * US, "{short} ps");
    base.run_until(3 * SECOND, &mut Unconnected);
    let long = base.worst_interrupt_latency()[6];
    assert!(long > SECOND && long < 3 * SECOND, "{long} ps");
}

#[test]
fn user_state_has_its_own_stack_and_may_not_do_everything() {
    let base = ran(
        &[(8, "privilege"), (3, "odd"), (33, "back")],
        "move.l #0x170000,%a0
         move.l %a0,%usp
         move.w #0,%sr                 | user
         user: move.w #0x2700,%sr
         tst.w (0x100001).l
         pea (RAM).l
         trap #1
         privilege: move.l 2(%sp),%d0
         sub.l #user,%d0
         move.l %d0,(RESULTS).l
         addq.l #4,2(%sp)              | skip it
         rte
         odd: move.w 22(%sp),(RESULTS+4).l
         move.w (%sp),(RESULTS+6).l
         addq.l #6,2(%sp)
         rte
         back: move.l %sp,(RESULTS+8).l
         move.l %usp,%a0
         move.l %a0,(RESULTS+12).l
         stop #0x2700",
    );
    assert_eq!(result_long(&base, 0), 0, "the privileged instruction is where it was stopped");
    assert_eq!(result(&base, 4) & 7, 1, "user data");
    assert_eq!(result(&base, 6) & 0x2000, 0, "from user state");
    assert_eq!(result_long(&base, 8), 0x18_0000 - 8, "one frame on the supervisor's stack");
    assert_eq!(result_long(&base, 12), 0x17_0000 - 4, "what PEA left on the user's");
}

#[test]
fn tracing_stops_after_every_instruction() {
    let base = ran(
        &[(9, "trace")],
        "clr.w (RESULTS).l
         move.w #0xA700,%sr            | T1
         nop
         moveq #1,%d0
         move.w #0x2700,%sr
         stop #0x2700
         trace: addq.w #1,(RESULTS).l
         move.w 6(%sp),(RESULTS+2).l
         rte",
    );
    assert_eq!(result(&base, 0), 3, "nop, moveq and the move that ends it");
    assert_eq!(result(&base, 2), 0x2024, "format $2, vector 9");
}
