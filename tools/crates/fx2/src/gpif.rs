//! The GPIF: waveform descriptors interpreted state by state at IFCLK (TRM chapter 10).
//!
//! # Assumptions
//! The manual leaves some edges open. Here, and nowhere else, they are taken to be:
//! - a state's outputs (CTL, address, data) change at the IFCLK edge that begins it;
//! - what a state does (sample data, NEXT, INCAD) takes effect at the edge that ends it: data is
//!   sampled there before outputs change, and a new address or word appears from there on. In a
//!   decision state that repeats itself, at the end of its first clock, or of each with re-execute;
//! - a decision uses RDY pins as they were at the edge that began the clock (GPIFREADYCFG.SAS = 1) or
//!   one edge earlier (two flip-flops, SAS = 0), and flags as they are when it ends;
//! - the transaction count goes down with each word moved (a sample when reading, NEXT when writing),
//!   so that TCXpire can end a loop inside a waveform. A pass that moves nothing counts as one;
//! - IDLE lasts one clock between two passes of a FIFO transaction;
//! - S0 begins at the second edge after the trigger.

use crate::chip::Chip;
use crate::diagnostics::Rule;
use crate::interrupts::fifo;
use crate::pins::Board;
use crate::ports::IFCFG_GPIF;
use crate::regs::xdata;
use crate::time::{IfClock, tick_to_ps};
use sim::Ps;

/// Bits of an opcode.
const SGL: u8 = 0x20;
const GINT: u8 = 0x10;
const INCAD: u8 = 0x08;
const NEXT: u8 = 0x04;
const DATA: u8 = 0x02;
const DP: u8 = 0x01;
/// Bit of a decision state's branch byte.
const REEXECUTE: u8 = 0x80;
/// Bits of GPIFREADYCFG.
const INTRDY: u8 = 0x80;
const SAS: u8 = 0x40;
const TCXRDY5: u8 = 0x20;
const IDLE: u8 = 7;
/// IFCLK edges from trigger to S0.
const LAUNCH_EDGES: u64 = 2;

/// What a trigger started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Transaction {
    SingleRead,
    SingleWrite,
    /// From FD into the IN endpoint with this index.
    FifoRead(usize),
    /// From the OUT endpoint with this index to FD.
    FifoWrite(usize),
}

impl Transaction {
    fn writes(self) -> bool {
        matches!(self, Self::SingleWrite | Self::FifoWrite(_))
    }

    fn endpoint(self) -> Option<usize> {
        match self {
            Self::FifoRead(index) | Self::FifoWrite(index) => Some(index),
            Self::SingleRead | Self::SingleWrite => None,
        }
    }
}

/// A transaction in progress.
#[derive(Clone, Copy, Debug)]
struct Run {
    transaction: Transaction,
    /// IFCLK as the transaction found it: changing it under way is reported and has no effect.
    clock: IfClock,
    state: u8,
    /// Clocks left in a state that does not decide.
    left: u16,
    /// This is the first clock in the state.
    fresh: bool,
    /// The pass has moved a word.
    moved: bool,
    /// Number of the next IFCLK edge, and its time.
    edge: u64,
    at: Ps,
    /// RDY pins at the last edge and at the one before.
    ready: [Option<u8>; 2],
    /// The waveform looks at RDY pins at all.
    looks: bool,
}

impl Run {
    /// Edges until something happens: inside a long state nothing does, unless RDY pins are watched.
    /// The clocks passed over are counted as gone.
    fn idle_edges(&mut self) -> u64 {
        if self.state == IDLE || self.looks || self.left <= 1 {
            return 1;
        }
        u64::from(std::mem::replace(&mut self.left, 1))
    }
}

/// One state of the waveform in use.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Length, or branches of a decision.
    length: u8,
    opcode: u8,
    output: u8,
    logic: u8,
}

/// The machine and its own registers.
#[derive(Clone, Debug)]
pub(crate) struct Gpif {
    pub(crate) waveforms: [u8; 128],
    /// The states of the waveform that runs; [7] is IDLE, which does nothing.
    states: [State; 8],
    pub(crate) address: u16,
    /// GPIFTCB.
    pub(crate) count: u32,
    /// XGPIFSGLDATH:L, as sampled and as to be written.
    pub(crate) single_in: u16,
    pub(crate) single_out: u16,
    run: Option<Run>,
}

impl Gpif {
    pub(crate) fn new() -> Self {
        Self {
            waveforms: [0; 128],
            states: [State::default(); 8],
            address: 0,
            count: 1,
            single_in: 0,
            single_out: 0,
            run: None,
        }
    }

    pub(crate) fn busy(&self) -> bool {
        self.run.is_some()
    }
}

impl Chip {
    /// A trigger register was touched.
    pub(crate) fn gpif_trigger(&mut self, transaction: Transaction, address: u16) {
        if self.ifcfg() != IFCFG_GPIF {
            self.report(Rule::NotModelled, address, || {
                "the GPIF is triggered while IFCONFIG does not select GPIF master mode".into()
            });
            return;
        }
        if self.gpif.busy() {
            self.report(Rule::GpifBusy, address, || {
                "the GPIF is triggered while it is busy; wait for DONE in GPIFTRIG bit 7".into()
            });
            return;
        }
        if self.reg(xdata::FLOWSTATE) & 0x80 != 0 {
            self.report(Rule::NotModelled, xdata::FLOWSTATE, || {
                "flow states of the GPIF are not modelled; the waveform runs without".into()
            });
        }
        let clock = self.ifclock();
        if clock == IfClock::External {
            self.report(Rule::NotModelled, xdata::IFCONFIG, || {
                "IFCONFIG selects an external IFCLK, which nothing drives".into()
            });
            return;
        }
        self.gpif.run = Some(self.new_run(transaction, clock));
    }

    fn new_run(&mut self, transaction: Transaction, clock: IfClock) -> Run {
        let shift = match transaction {
            Transaction::SingleWrite => 6,
            Transaction::SingleRead => 4,
            Transaction::FifoWrite(_) => 2,
            Transaction::FifoRead(_) => 0,
        };
        let waveform = 32 * usize::from(self.reg(xdata::GPIFWFSELECT) >> shift & 3);
        for (n, state) in self.gpif.states[..7].iter_mut().enumerate() {
            let at = |group: usize| self.gpif.waveforms[waveform + 8 * group + n];
            *state = State { length: at(0), opcode: at(1), output: at(2), logic: at(3) };
        }
        let tc_is_ready5 = self.reg(xdata::GPIFREADYCFG) & TCXRDY5 != 0;
        let is_pin = |term: u8| term < 5 || term == 5 && !tc_is_ready5;
        let looks = self.gpif.states.iter().any(|state| {
            let pins = is_pin(state.logic & 7) || is_pin(state.logic >> 3 & 7);
            state.opcode & DP != 0 && pins
        });
        let edge = clock.edge_at_or_after(tick_to_ps(self.tick)) + LAUNCH_EDGES;
        Run {
            transaction,
            clock,
            state: IDLE,
            left: 0,
            fresh: true,
            moved: false,
            edge,
            at: clock.edge(edge),
            ready: [None; 2],
            looks,
        }
    }

    /// GPIFABORT: back to IDLE at once, as done.
    pub(crate) fn gpif_abort(&mut self) {
        if self.gpif.run.take().is_some() {
            self.update_idle_pins();
            self.int.raise_fifo(fifo::GPIFDONE);
            self.changed();
        }
    }

    /// Runs all edges up to and including `limit`. Returns early, with the time of the edge, when an
    /// interrupt was requested.
    pub(crate) fn gpif_run(&mut self, limit: Ps, board: &mut dyn Board) -> Option<Ps> {
        if self.gpif.run.as_ref()?.at > limit {
            return None;
        }
        let mut run = self.gpif.run?;
        let clock = run.clock;
        while run.at <= limit {
            let at = run.at;
            let exif = self.int.exif;
            let done = self.gpif_edge(&mut run, board);
            self.flush_pins(at, board);
            if done {
                self.gpif.run = None;
                self.int.raise_fifo(fifo::GPIFDONE);
                self.changed();
                return (self.int.exif != exif).then_some(at);
            }
            run.edge += run.idle_edges();
            run.at = clock.edge(run.edge);
            if self.int.exif != exif {
                self.gpif.run = Some(run);
                return Some(at);
            }
        }
        self.gpif.run = Some(run);
        None
    }

    /// One IFCLK edge: ends a clock of the present state and begins the next. True = finished.
    fn gpif_edge(&mut self, run: &mut Run, board: &mut dyn Board) -> bool {
        let mut next = run.state;
        if run.state == IDLE {
            if !run.fresh && self.gpif_finished(run) {
                return true;
            }
            run.moved = false;
            next = 0;
        } else {
            let State { length: branch, opcode, logic, .. } =
                self.gpif.states[usize::from(run.state & 7)];
            if opcode & DP == 0 {
                run.left -= 1;
                if run.left == 0 {
                    self.gpif_act(run, opcode, board);
                    next = run.state + 1;
                }
            } else {
                if run.fresh || branch & REEXECUTE != 0 {
                    self.gpif_act(run, opcode, board);
                }
                next = if self.gpif_decide(run, logic) { branch >> 3 & 7 } else { branch & 7 };
            }
        }
        let entered = next != run.state;
        run.fresh = entered;
        run.state = next;
        if entered {
            self.gpif_enter(run);
            if next == IDLE && run.transaction.endpoint().is_none() {
                return true;
            }
        } else {
            self.gpif_drive_data(run);
        }
        if run.looks {
            let pins = board.sense(run.at).rdy;
            // The flip-flops run all the time; before S0 the pins count as steady.
            run.ready = [pins, run.ready[0].unwrap_or(pins)].map(Some);
        }
        if next == IDLE {
            // The last pass ends the transaction on entering IDLE.
            run.fresh = false;
            return self.gpif_finished(run);
        }
        false
    }

    /// Whether a FIFO transaction ends now that a pass is over.
    fn gpif_finished(&mut self, run: &mut Run) -> bool {
        let Some(index) = run.transaction.endpoint() else { return true };
        if !run.moved {
            self.report(Rule::NotModelled, xdata::GPIFTCB0, || {
                "a GPIF waveform moved no data in a pass: how the transaction count treats that is not \
                 documented; it is counted as one"
                    .into()
            });
            self.gpif.count = self.gpif.count.saturating_sub(1);
            run.moved = true;
        }
        let stop_on_flag = self.reg(xdata::EP2GPIFFLGSEL + 1 + 8 * index as u16) & 1 != 0;
        if stop_on_flag { self.gpif_flag(index) } else { self.gpif.count == 0 }
    }

    /// Outputs at the beginning of a state.
    fn gpif_enter(&mut self, run: &mut Run) {
        if run.state == IDLE {
            self.update_idle_pins();
            self.driven.gpifadr = self.gpif.address;
            return;
        }
        let State { length, opcode, output, .. } = self.gpif.states[usize::from(run.state & 7)];
        run.left = match length {
            _ if opcode & DP != 0 => 1,
            0 => 256,
            length => u16::from(length),
        };
        self.set_ctl(output);
        self.gpif_drive_data(run);
        if opcode & GINT != 0 {
            self.int.raise_fifo(fifo::GPIFWF);
            self.changed();
        }
    }

    /// FD and GPIFADR in the present state.
    fn gpif_drive_data(&mut self, run: &Run) {
        let opcode = self.gpif.states[usize::from(run.state & 7)].opcode;
        self.driven.gpifadr = self.gpif.address;
        if run.transaction.writes() && opcode & DATA != 0 {
            self.driven.fd_enable = self.fd_mask();
            let single = self.gpif.single_out;
            self.driven.fd = match run.transaction {
                Transaction::FifoWrite(index) if opcode & SGL == 0 => {
                    self.eps[index].fifo_peek().unwrap_or(self.driven.fd)
                }
                _ => single,
            } & self.driven.fd_enable;
        } else {
            self.driven.fd_enable = 0;
        }
    }

    /// What the state does besides driving pins.
    fn gpif_act(&mut self, run: &mut Run, opcode: u8, board: &mut dyn Board) {
        match run.transaction {
            Transaction::SingleRead if opcode & DATA != 0 => {
                self.gpif.single_in = board.sense(run.at).fd;
            }
            Transaction::FifoRead(_) if opcode & (DATA | SGL) == DATA | SGL => {
                self.gpif.single_in = board.sense(run.at).fd;
            }
            Transaction::FifoRead(index) if opcode & DATA != 0 => {
                let data = board.sense(run.at).fd;
                let taken = self.eps[index].is_in() && self.eps[index].fifo_write(data);
                self.gpif_moved(run, taken);
            }
            Transaction::FifoWrite(index) if opcode & (NEXT | SGL) == NEXT => {
                let taken = self.eps[index].fifo_next();
                self.gpif_moved(run, taken);
            }
            _ => {}
        }
        if opcode & INCAD != 0 {
            self.gpif.address = (self.gpif.address + 1) & 0x1FF;
        }
    }

    fn gpif_moved(&mut self, run: &mut Run, taken: bool) {
        run.moved = true;
        self.gpif.count = self.gpif.count.saturating_sub(1);
        if !taken {
            // No instruction is at fault at this moment.
            self.diagnostics.report(0, Rule::DataLost, 0, || {
                "the GPIF moved a word into a full FIFO, out of an empty one, or against the \
                 endpoint's direction; it is lost"
                    .into()
            });
        }
        self.fifo_flags_changed();
    }

    fn gpif_decide(&self, run: &Run, logic: u8) -> bool {
        let a = self.gpif_term(run, logic >> 3 & 7);
        let b = self.gpif_term(run, logic & 7);
        match logic >> 6 {
            0 => a && b,
            1 => a || b,
            2 => a != b,
            _ => !a && b,
        }
    }

    fn gpif_term(&self, run: &Run, term: u8) -> bool {
        let config = self.reg(xdata::GPIFREADYCFG);
        match term {
            5 if config & TCXRDY5 != 0 => self.gpif.count == 0,
            0..=5 => {
                let pins = run.ready[usize::from(config & SAS == 0)];
                pins.is_some_and(|pins| pins >> term & 1 != 0)
            }
            6 => run.transaction.endpoint().is_some_and(|index| self.gpif_flag(index)),
            _ => config & INTRDY != 0,
        }
    }

    /// The flag that EPxGPIFFLGSEL selects.
    fn gpif_flag(&self, index: usize) -> bool {
        let ep = &self.eps[index];
        match self.reg(xdata::EP2GPIFFLGSEL + 8 * index as u16) & 3 {
            0 => ep.programmable_flag(),
            1 => ep.fifo_empty_flag(),
            _ => ep.fifo_full(),
        }
    }
}
