//! The SelectMAP port: pins in, INIT# and DONE out.
//!
//! WRITE# is tied low on the turret, so the port only takes. The caller tells edges and levels with
//! their times; the data pins are looked at only at a rising CCLK, and the caller then says since
//! when they have been stable. A byte that breaks a timing rule arrives inverted and is listed in
//! the diagnostics: real silicon might take it or not, firmware must not depend on it.
//!
//! What is assumed (all of it is data sheet DS022 from memory, none of it confirmed):
//! - the times below and in the turret's board file;
//! - start-up counts every CCLK after the check sum, whatever CS# is, and the design runs one CCLK
//!   after its last cycle;
//! - the DLLs lock at once;
//! - PROG# pulses that are too short do nothing;
//! - after a check sum error in a partial stream DONE stays high and the running design goes on.

use common_sys::constants::{
    TURRET_FPGA_CCLK_MAX_HZ, TURRET_FPGA_HOLD_NS, TURRET_FPGA_PROG_MIN_NS, TURRET_FPGA_SETUP_NS,
};
use sim::{MS, NS, Ps, SECOND, US};

use crate::design::{DESIGN_FRAME, Design};
use crate::diagnostics::Diagnostics;
use crate::logic::{Event, Logic};
use crate::packet::{CTL_PERSIST, Fault};
use crate::part::Part;

/// From power-on until INIT# is released, if PROG# is not used.
pub const POWER_ON_PS: Ps = 2 * MS;
/// From PROG# rising until INIT# is released: the memory is being cleared.
pub const CLEAR_PS: Ps = 100 * US;

const SETUP_PS: Ps = TURRET_FPGA_SETUP_NS as Ps * NS;
const HOLD_PS: Ps = TURRET_FPGA_HOLD_NS as Ps * NS;
const PROG_MIN_PS: Ps = TURRET_FPGA_PROG_MIN_NS as Ps * NS;
/// Edges are rounded down to a picosecond, so that two may lie one closer.
const CCLK_PERIOD_PS: Ps = SECOND / TURRET_FPGA_CCLK_MAX_HZ as Ps - 1;

/// The last of the start-up cycles.
const STARTUP_CYCLES: u32 = 7;

/// What was done to the port that it does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Violation {
    /// D[0..7] changed less than the set-up time before CCLK rose.
    DataSetup,
    /// D[0..7] changed less than the hold time after CCLK rose.
    DataHold,
    /// CS# changed less than the set-up time before CCLK rose.
    SelectSetup,
    /// CCLK rose too soon after it had risen before.
    ClockTooFast,
    /// PROG# was low for too short a time.
    ProgTooShort,
    /// CCLK rose with CS# low while INIT# was still low.
    NotReady,
    /// CCLK rose with CS# low, but the design has kept the port for itself (PERSIST = 0).
    PortClosed,
    /// The stream was not to the logic's taste.
    Stream(Fault),
}

impl std::fmt::Display for Violation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::DataSetup => {
                write!(f, "D changed less than {TURRET_FPGA_SETUP_NS} ns before CCLK")
            }
            Self::DataHold => write!(f, "D changed less than {TURRET_FPGA_HOLD_NS} ns after CCLK"),
            Self::SelectSetup => {
                write!(f, "CS# changed less than {TURRET_FPGA_SETUP_NS} ns before CCLK")
            }
            Self::ClockTooFast => write!(f, "CCLK above {TURRET_FPGA_CCLK_MAX_HZ} Hz"),
            Self::ProgTooShort => write!(f, "PROG# low for less than {TURRET_FPGA_PROG_MIN_NS} ns"),
            Self::NotReady => write!(f, "a byte came while INIT# was low"),
            Self::PortClosed => write!(f, "a byte came, but the running design has PERSIST = 0"),
            Self::Stream(fault) => fault.fmt(f),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StartUp {
    /// Not begun.
    Idle,
    /// So many CCLKs of it have been seen.
    Cycle(u32),
    /// Over: the design is alive.
    Over,
}

/// The port and all behind it.
#[derive(Clone, Debug)]
pub struct ConfigPort {
    logic: Logic,
    /// Since when PROG# is low, and whether that has been acted upon.
    prog_low: Option<Ps>,
    cleared: bool,
    /// When the memory is clear; INIT# is low before.
    ready: Ps,
    selected: bool,
    selected_since: Ps,
    last_rise: Option<Ps>,
    /// How long the data pins have to stay after CCLK rose, as the caller tells it.
    hold: Ps,
    /// A byte whose hold time is not over: when it was latched.
    held: Option<(Ps, u8)>,
    start_up: StartUp,
    done: bool,
    interconnect: bool,
    design: Option<Design>,
    generation: u64,
    bytes: u64,
    diagnostics: Diagnostics<Violation>,
}

impl ConfigPort {
    /// At power-on, PROG# and CS# high. On the board, CCLK arrives up to `cclk_late` after the caller
    /// says it rises; data has to stay for longer by as much.
    pub fn new(part: &'static Part, now: Ps, cclk_late: Ps) -> Self {
        Self {
            logic: Logic::new(part),
            prog_low: None,
            cleared: true,
            ready: now + POWER_ON_PS,
            selected: false,
            selected_since: now,
            last_rise: None,
            hold: HOLD_PS + cclk_late,
            held: None,
            start_up: StartUp::Idle,
            done: false,
            interconnect: false,
            design: None,
            generation: 0,
            bytes: 0,
            diagnostics: Diagnostics::default(),
        }
    }

    /// PROG# is `high` from now on.
    pub fn set_prog(&mut self, now: Ps, high: bool) {
        self.settle(now);
        match (self.prog_low, high) {
            (None, false) => {
                self.prog_low = Some(now);
                self.cleared = false;
            }
            (Some(_), true) => {
                self.prog_low = None;
                if self.cleared {
                    // A pulse within the power-on time does not shorten it.
                    self.ready = self.ready.max(now + CLEAR_PS);
                } else {
                    self.diagnostics.note(now, Violation::ProgTooShort);
                    self.cleared = true;
                }
            }
            _ => {}
        }
    }

    /// CS# is low (`selected`) or high from now on.
    pub fn set_selected(&mut self, now: Ps, selected: bool) {
        if self.selected != selected {
            self.settle(now);
            self.selected = selected;
            self.selected_since = now;
        }
    }

    /// The data pins change now. Needs telling only between a rising CCLK and the end of its hold
    /// time; the level at the next rising CCLK is told there.
    pub fn data_changes(&mut self, now: Ps) {
        if let Some((latched, byte)) = self.held
            && now < latched + self.hold
        {
            self.diagnostics.note(now, Violation::DataHold);
            self.held = Some((latched, !byte));
        }
    }

    /// CCLK rises, with `byte` on D[0..7] (D0 is its most significant bit), stable since
    /// `stable_since`.
    pub fn cclk_rises(&mut self, now: Ps, byte: u8, stable_since: Ps) {
        self.settle(now);
        let too_fast = self.last_rise.is_some_and(|last| now - last < CCLK_PERIOD_PS);
        self.last_rise = Some(now);
        self.count_start_up();
        if !self.selected {
            if now < self.selected_since + SETUP_PS {
                self.diagnostics.note(now, Violation::SelectSetup);
            }
            return;
        }
        if self.prog_low.is_some() || now < self.ready {
            self.diagnostics.note(now, Violation::NotReady);
            return;
        }
        if self.start_up == StartUp::Over && self.logic.ctl() & CTL_PERSIST == 0 {
            self.diagnostics.note(now, Violation::PortClosed);
            return;
        }
        let rules = [
            (too_fast, Violation::ClockTooFast),
            (now < stable_since + SETUP_PS, Violation::DataSetup),
            (now < self.selected_since + SETUP_PS, Violation::SelectSetup),
        ];
        let mut good = true;
        for (_, violation) in rules.into_iter().filter(|(broken, _)| *broken) {
            self.diagnostics.note(now, violation);
            good = false;
        }
        self.bytes += 1;
        let byte = if good { byte } else { !byte };
        if self.hold == 0 {
            self.take(now, byte);
        } else {
            self.held = Some((now, byte));
        }
    }

    /// Level of INIT#.
    pub fn init(&mut self, now: Ps) -> bool {
        self.settle(now);
        let resetting = self.prog_low.is_some() && self.cleared;
        !resetting && now >= self.ready && !matches!(self.logic.fault(), Some(Fault::Crc { .. }))
    }

    /// Level of DONE.
    pub fn done(&mut self, now: Ps) -> bool {
        self.settle(now);
        self.done
    }

    /// When a pin changes by itself next.
    pub fn next_event(&self, now: Ps) -> Option<Ps> {
        let reset = self.prog_low.filter(|_| !self.cleared).map(|since| since + PROG_MIN_PS);
        reset.or((self.prog_low.is_none() && now < self.ready).then_some(self.ready))
    }

    /// Whether a design is alive: DONE is high, start-up over, the interconnect in service.
    pub fn alive(&mut self, now: Ps) -> bool {
        self.settle(now);
        self.start_up == StartUp::Over && self.interconnect
    }

    /// What the living design says it is; None if it says nothing that the model knows.
    pub fn design(&self) -> Option<&Design> {
        self.design.as_ref().filter(|_| self.start_up == StartUp::Over && self.interconnect)
    }

    /// Counts up whenever a design comes to life, changes or dies.
    pub fn generation(&mut self, now: Ps) -> u64 {
        self.settle(now);
        self.generation
    }

    /// Bytes taken since power-on.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The configuration logic.
    pub fn logic(&self) -> &Logic {
        &self.logic
    }

    /// What was done to the port that it does not allow.
    pub fn diagnostics(&self) -> &Diagnostics<Violation> {
        &self.diagnostics
    }

    /// Let happen what time alone brings.
    fn settle(&mut self, now: Ps) {
        if let Some((latched, byte)) = self.held
            && now >= latched + self.hold
        {
            self.held = None;
            self.take(latched, byte);
        }
        if let Some(since) = self.prog_low
            && !self.cleared
            && now >= since + PROG_MIN_PS
        {
            self.clear();
        }
    }

    fn clear(&mut self) {
        self.cleared = true;
        self.logic = Logic::new(self.logic.part());
        self.held = None;
        self.start_up = StartUp::Idle;
        self.done = false;
        self.interconnect = false;
        self.design = None;
        self.generation += 1;
    }

    fn count_start_up(&mut self) {
        let StartUp::Cycle(cycle) = self.start_up else { return };
        let cycle = cycle + 1;
        self.start_up = StartUp::Cycle(cycle);
        if cycle == self.logic.done_cycle() {
            self.done = true;
        }
        if cycle == STARTUP_CYCLES {
            self.start_up = StartUp::Over;
            self.follow_design();
        }
    }

    fn take(&mut self, now: Ps, byte: u8) {
        match self.logic.byte(byte) {
            None => {}
            Some(Event::Fault(fault)) => self.diagnostics.note(now, Violation::Stream(fault)),
            Some(Event::InterconnectOff) => {
                self.interconnect = false;
                self.generation += 1;
            }
            Some(Event::LastFrame) => {
                self.interconnect = true;
                if self.start_up == StartUp::Over {
                    self.follow_design();
                }
            }
            Some(Event::StartUp) if self.start_up == StartUp::Idle => {
                self.start_up = StartUp::Cycle(0);
            }
            // A whole stream over a running design: nothing is left to start.
            Some(Event::StartUp) => self.follow_design(),
        }
    }

    fn follow_design(&mut self) {
        self.design = self.logic.frame(DESIGN_FRAME).and_then(Design::decode);
        self.generation += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bitstream::{Options, make, make_partial};
    use crate::design::Function;
    use crate::part::{XCV50E, XCV300E};

    const PERIOD: Ps = 104_166;

    /// A port and a host that follows the rules.
    struct Bench {
        port: ConfigPort,
        now: Ps,
    }

    impl Bench {
        /// After a PROG# pulse, INIT# high, CS# low.
        fn ready() -> Self {
            let mut bench = Self { port: ConfigPort::new(&XCV300E, 0, 0), now: 3 * MS };
            bench.pulse(300 * NS);
            bench.now += CLEAR_PS;
            assert!(bench.init());
            bench.port.set_selected(bench.now, true);
            bench
        }

        fn pulse(&mut self, width: Ps) {
            self.port.set_prog(self.now, false);
            self.now += width;
            self.port.set_prog(self.now, true);
        }

        fn send(&mut self, bytes: &[u8]) {
            for &byte in bytes {
                self.now += PERIOD;
                self.port.cclk_rises(self.now, byte, self.now - SETUP_PS);
            }
        }

        fn clocks(&mut self, count: usize) {
            self.send(&vec![0; count]);
        }

        fn init(&mut self) -> bool {
            self.port.init(self.now)
        }

        fn done(&mut self) -> bool {
            self.port.done(self.now)
        }

        fn function(&self) -> Option<Function> {
            self.port.design().map(|design| design.function)
        }

        fn count(&self, violation: Violation) -> u64 {
            self.port.diagnostics().count(violation)
        }
    }

    fn soccer() -> Vec<u8> {
        make(Function::Soccer, &Options::default())
    }

    #[test]
    fn init_is_low_after_power_on_and_after_prog_until_the_memory_is_clear() {
        let mut port = ConfigPort::new(&XCV300E, 0, 0);
        assert!(!port.init(POWER_ON_PS - 1));
        assert_eq!(port.next_event(0), Some(POWER_ON_PS));
        assert!(port.init(POWER_ON_PS));
        port.set_prog(10 * MS, false);
        assert_eq!(port.next_event(10 * MS), Some(10 * MS + PROG_MIN_PS));
        assert!(!port.init(10 * MS + PROG_MIN_PS));
        port.set_prog(11 * MS, true);
        assert!(!port.init(11 * MS + CLEAR_PS - 1));
        assert!(port.init(11 * MS + CLEAR_PS));
        assert_eq!(port.next_event(12 * MS), None);
    }

    #[test]
    fn a_whole_stream_raises_done_in_cycle_four_and_starts_the_design() {
        let mut bench = Bench::ready();
        let stream = soccer();
        let (body, padding) = stream.split_at(stream.len() - 16);
        bench.send(body);
        assert!(!bench.done());
        bench.send(&padding[..3]);
        assert!(!bench.done());
        bench.send(&padding[..1]);
        assert!(bench.done());
        assert_eq!(bench.function(), None, "GWE and GSR come two cycles later");
        bench.send(&padding[..3]);
        assert_eq!(bench.function(), Some(Function::Soccer));
        assert!(bench.init());
        assert_eq!(bench.port.diagnostics().list(), []);
    }

    #[test]
    fn a_short_prog_pulse_does_nothing_but_is_noted() {
        let mut bench = Bench::ready();
        bench.send(&soccer());
        bench.pulse(299 * NS);
        assert!(bench.done());
        assert_eq!(bench.count(Violation::ProgTooShort), 1);
        bench.pulse(300 * NS);
        assert!(!bench.done());
        assert_eq!(bench.function(), None);
    }

    #[test]
    fn a_flipped_bit_never_gives_done_and_only_prog_helps() {
        let stream = soccer();
        let end = stream.len() - 16;
        for at in
            [5, 13, 20, 27, 45, 60, 70, 76, 1_000, 212_500, end - 130, end - 24, end - 9, end - 1]
        {
            let mut bench = Bench::ready();
            let mut damaged = stream.clone();
            damaged[at] ^= 0x10;
            bench.send(&damaged);
            bench.clocks(64);
            assert!(!bench.done(), "byte {at}");
            bench.send(&stream);
            assert!(!bench.done() || at == 5, "byte {at}: only an unheard stream may be repeated");
            bench.pulse(PROG_MIN_PS);
            bench.now += CLEAR_PS;
            bench.send(&stream);
            assert!(bench.done(), "byte {at}");
        }
    }

    #[test]
    fn a_check_sum_error_pulls_init_low_until_prog() {
        let mut bench = Bench::ready();
        let mut stream = soccer();
        stream[100_000] ^= 1;
        bench.send(&stream);
        assert!(!bench.init());
        assert!(!bench.done());
        bench.pulse(PROG_MIN_PS);
        bench.now += CLEAR_PS;
        assert!(bench.init());
    }

    #[test]
    fn a_stream_for_another_part_never_gives_done() {
        let mut bench = Bench::ready();
        bench.send(&make(Function::Soccer, &Options { part: &XCV50E, ..Options::default() }));
        bench.clocks(64);
        assert!(!bench.done());
        assert!(bench.init(), "it is no check sum error");
        let fault = Fault::FrameLength { flr: 11, expected: 20 };
        assert_eq!(bench.count(Violation::Stream(fault)), 1);
    }

    #[test]
    fn a_truncated_stream_waits_for_the_rest() {
        let mut bench = Bench::ready();
        let stream = soccer();
        bench.send(&stream[..123_457]);
        assert!(!bench.done());
        assert!(bench.init());
        bench.send(&stream[123_457..]);
        assert!(bench.done());
    }

    #[test]
    fn bytes_count_only_with_select_low_and_init_high() {
        let mut bench = Bench { port: ConfigPort::new(&XCV300E, 0, 0), now: 0 };
        bench.port.set_selected(0, true);
        bench.clocks(10);
        assert_eq!(bench.count(Violation::NotReady), 10);
        bench.now = POWER_ON_PS;
        bench.port.set_selected(bench.now, false);
        bench.now += MS;
        bench.send(&soccer());
        assert!(!bench.done());
        assert_eq!(bench.port.bytes(), 0);
    }

    #[test]
    fn broken_timing_damages_the_byte() {
        type Break = fn(&mut Bench, u8);
        let breaks: [(Violation, Break); 3] = [
            (Violation::DataSetup, |bench, byte| {
                bench.now += PERIOD;
                bench.port.cclk_rises(bench.now, byte, bench.now - SETUP_PS + 1);
            }),
            (Violation::ClockTooFast, |bench, byte| {
                bench.now += CCLK_PERIOD_PS - 1;
                bench.port.cclk_rises(bench.now, byte, bench.now - SETUP_PS);
            }),
            (Violation::SelectSetup, |bench, byte| {
                bench.now += PERIOD;
                bench.port.set_selected(bench.now - 2 * SETUP_PS, false);
                bench.port.set_selected(bench.now - SETUP_PS + 1, true);
                bench.port.cclk_rises(bench.now, byte, bench.now - SETUP_PS);
            }),
        ];
        for (violation, break_rule) in breaks {
            let mut bench = Bench::ready();
            let stream = soccer();
            bench.send(&stream[..5_000]);
            break_rule(&mut bench, stream[5_000]);
            bench.send(&stream[5_001..]);
            assert!(!bench.done(), "{violation}");
            assert_eq!(bench.count(violation), 1, "{violation}");
        }
    }

    #[test]
    fn data_must_stay_while_cclk_may_be_late() {
        let late = 7 * NS;
        for (change, good) in [(0, false), (late - 1, false), (late, true)] {
            let port = ConfigPort::new(&XCV300E, 0, late);
            let mut bench = Bench { port, now: POWER_ON_PS };
            bench.port.set_selected(bench.now, true);
            for &byte in &soccer() {
                bench.now += PERIOD;
                bench.port.cclk_rises(bench.now, byte, bench.now - SETUP_PS);
                bench.port.data_changes(bench.now + change);
            }
            bench.now += PERIOD;
            assert_eq!(bench.done(), good, "{change} ps");
            assert_eq!(bench.count(Violation::DataHold) == 0, good, "{change} ps");
        }
    }

    #[test]
    fn the_fastest_allowed_clock_works() {
        let mut bench = Bench::ready();
        for &byte in &soccer() {
            bench.now += 20 * NS;
            bench.port.cclk_rises(bench.now, byte, bench.now - SETUP_PS);
        }
        assert!(bench.done());
    }

    #[test]
    fn a_partial_stream_swaps_the_function_while_done_stays_high() {
        let mut bench = Bench::ready();
        bench.send(&soccer());
        let before = bench.port.generation(bench.now);
        let partial = make_partial(Function::Capture, &Options::default());
        let (head, tail) = partial.split_at(partial.len() - 24);
        bench.send(head);
        assert_eq!(bench.function(), Some(Function::Soccer), "until LFRM");
        bench.send(tail);
        assert!(bench.done());
        assert_eq!(bench.function(), Some(Function::Capture));
        assert_eq!(bench.port.generation(bench.now), before + 1);
    }

    #[test]
    fn a_damaged_partial_stream_leaves_the_running_design() {
        let mut bench = Bench::ready();
        bench.send(&soccer());
        let mut partial = make_partial(Function::Capture, &Options::default());
        partial[100] ^= 4;
        bench.send(&partial);
        assert!(bench.done());
        assert!(!bench.init());
        assert_eq!(bench.function(), Some(Function::Soccer));
    }

    #[test]
    fn without_persist_the_port_closes() {
        let mut bench = Bench::ready();
        bench.send(&make(Function::Soccer, &Options { persist: false, ..Options::default() }));
        bench.send(&make_partial(Function::Capture, &Options::default()));
        assert_eq!(bench.function(), Some(Function::Soccer));
        assert!(bench.count(Violation::PortClosed) > 5_000);
    }

    #[test]
    fn a_second_whole_stream_without_prog_replaces_the_first() {
        let mut bench = Bench::ready();
        bench.send(&soccer());
        bench.send(&make(Function::Capture, &Options::default()));
        assert!(bench.done());
        assert_eq!(bench.function(), Some(Function::Capture));
        assert_eq!(bench.port.diagnostics().list(), []);
    }

    #[test]
    fn start_up_from_another_clock_never_gives_done() {
        let mut stream = soccer();
        // COR bits 21:20 = 01: the user's clock.
        stream[29] |= 0x10;
        let mut bench = Bench::ready();
        bench.send(&fix_check_sums(&stream));
        bench.clocks(64);
        assert!(!bench.done());
        assert_eq!(bench.count(Violation::Stream(Fault::StartupClock)), 1);
    }

    /// Walk through a stream and put the right value into each CRC packet.
    fn fix_check_sums(stream: &[u8]) -> Vec<u8> {
        let mut fixed = stream.to_vec();
        loop {
            let mut logic = Logic::new(&XCV300E);
            let fault = fixed.iter().enumerate().find_map(|(at, &byte)| match logic.byte(byte) {
                Some(Event::Fault(Fault::Crc { computed, .. })) => Some((at, computed)),
                _ => None,
            });
            let Some((at, computed)) = fault else { return fixed };
            fixed[at - 1..=at].copy_from_slice(&computed.to_be_bytes());
        }
    }
}
