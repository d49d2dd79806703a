//! How fast the emulated base is, in processor time of this thread: other work on the machine does
//! not count.

mod common;

use common::Program;
use khepera::turret_bus::Unconnected;
use sim::SECOND;

/// Processor time of this thread in seconds.
fn processor_time() -> f64 {
    let statistics = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let nanoseconds = statistics.split(' ').next().and_then(|n| n.parse::<u64>().ok());
    nanoseconds.expect("the time on the processor comes first") as f64 / 1e9
}

/// Simulated seconds a second of processor time.
fn speed(code: &str, seconds: u64) -> f64 {
    let program = Program { vectors: &[(64, "tick"), (0x41, "edge")], sypcr: 4, code };
    let mut base = program.base();
    base.run_until(SECOND / 10, &mut Unconnected);
    let start = processor_time();
    base.run_until(SECOND / 10 + seconds * SECOND, &mut Unconnected);
    let taken = processor_time() - start;
    assert!(taken > 0.0, "the kernel counts no processor time");
    let speed = seconds as f64 / taken;
    println!("{speed:.1} x real time, load {:.3}", base.load().since(&khepera::Load::default()));
    speed
}

/// Ticks at 100 Hz and encoder edges at 6 kHz, as the real firmware has them.
const INTERRUPTS: &str = "
        move.w  #0x0640,(PICR).w
        move.w  #82,(PITR).w
        move.w  #0x0081,(GPTMCR).w
        move.w  #0x0640,(ICR).w
        move.b  #0x03,(TCTL2).w
        move.b  #0x01,(TMSK1).w
        move.b  #0x60,(DDRGP).w
        move.b  #0x20,(PORTGP).w
        move.b  #140,(PWMA).w
        bra     go
        edge:   move.b (TFLG1).w,%d1
        clr.b   (TFLG1).w
        tick:   rte
";

#[test]
fn a_base_that_is_always_busy_runs_at_four_times_real_time() {
    let code = format!(
        "{INTERRUPTS}
         go: move.w #0x2000,%sr
         again: lea (RAM).l,%a0
         lea (RAM+0x10000).l,%a1
         move.w #999,%d7
         next: move.l (%a0)+,%d0
         muls.w %d0,%d1
         add.l %d0,%d2
         lsr.l #3,%d2
         move.l %d2,(%a1)+
         cmp.l %d1,%d2
         blt.s smaller
         addq.l #1,%d3
         smaller: dbra %d7,next
         movem.l %d2-%d7,-(%sp)
         movem.l (%sp)+,%d2-%d7
         bra again"
    );
    assert!(speed(&code, 2) > 4.0);
}

#[test]
fn a_base_that_waits_for_interrupts_runs_much_faster() {
    let code = format!("{INTERRUPTS}\n go: stop #0x2000\n bra go");
    assert!(speed(&code, 10) > 50.0);
}
