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
use crate::pins::{Board, Sensed};
use crate::ports::IFCFG_GPIF;
use crate::regs::xdata;
use crate::time::{IfClock, tick_to_ps};
use serde::{Deserialize, Serialize};
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
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
    /// The transaction has lost a word.
    lost: bool,
    /// Number of the next IFCLK edge, and its time.
    edge: u64,
    at: Ps,
    /// RDY pins at the last edge and at the one before.
    ready: [Option<u8>; 2],
    /// The waveform looks at RDY pins at all.
    looks: bool,
    /// GPIFREADYCFG as the transaction found it: RDY5 is the expired count, RDY pins pass two
    /// flip-flops, INTRDY.
    count_is_ready5: bool,
    delayed: bool,
    internal_ready: bool,
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

/// One state of the waveform in use, decoded when the transaction begins.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct State {
    /// Clocks of a state that does not decide; 1 for one that does.
    clocks: u16,
    opcode: u8,
    /// CTL pins and their enables.
    ctl: u8,
    ctl_enable: u8,
    /// FD is driven.
    drives: bool,
    /// What a deciding state does, it does in each of its clocks.
    repeats: bool,
    /// The terms of a decision, and the outcome for each pair of them: bit 2a + b.
    terms: [u8; 2],
    outcomes: u8,
    /// The next state if that is 0 or 1.
    branches: [u8; 2],
}

impl State {
    fn decides(self) -> bool {
        self.opcode & DP != 0
    }

    fn looks_at(self, term: u8) -> bool {
        self.decides() && self.terms.contains(&term)
    }
}

/// Outcomes of the four functions of a decision: AND, OR, XOR, and the complement of A AND B.
const FUNCTIONS: [u8; 4] = [0b1000, 0b1110, 0b0110, 0b0010];
/// Terms of a decision besides the RDY pins.
const TERM_RDY5: u8 = 5;
const TERM_FLAG: u8 = 6;
const TERM_INTRDY: u8 = 7;

/// A loop of states that comes back to where it began.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Round {
    clocks: u64,
    words: u64,
    increments: u64,
}

/// The machine and its own registers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Gpif {
    #[serde(with = "sim::hex")]
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
    /// Until then the GPIF requests no interrupt.
    pub(crate) quiet_until: Ps,
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
            quiet_until: 0,
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
        let run = self.new_run(transaction, clock);
        self.gpif.quiet_until = self.gpif_quiet_until(&run);
        self.gpif.run = Some(run);
    }

    fn new_run(&mut self, transaction: Transaction, clock: IfClock) -> Run {
        let shift = match transaction {
            Transaction::SingleWrite => 6,
            Transaction::SingleRead => 4,
            Transaction::FifoWrite(_) => 2,
            Transaction::FifoRead(_) => 0,
        };
        let waveform = 32 * usize::from(self.reg(xdata::GPIFWFSELECT) >> shift & 3);
        for n in 0..usize::from(IDLE) {
            let at = |group: usize| self.gpif.waveforms[waveform + 8 * group + n];
            self.gpif.states[n] = self.decode([at(0), at(1), at(2), at(3)], transaction);
        }
        let ready = self.reg(xdata::GPIFREADYCFG);
        let pins = if ready & TCXRDY5 != 0 { 0..TERM_RDY5 } else { 0..TERM_FLAG };
        let looks = |state: &State| pins.clone().any(|term| state.looks_at(term));
        let edge = clock.edge_at_or_after(tick_to_ps(self.tick)) + LAUNCH_EDGES;
        Run {
            transaction,
            clock,
            state: IDLE,
            left: 0,
            fresh: true,
            moved: false,
            lost: false,
            edge,
            at: clock.edge(edge),
            ready: [None; 2],
            looks: self.gpif.states.iter().any(looks),
            count_is_ready5: ready & TCXRDY5 != 0,
            delayed: ready & SAS == 0,
            internal_ready: ready & INTRDY != 0,
        }
    }

    /// A state from its four bytes: length or branches, opcode, output, logic.
    fn decode(&self, bytes: [u8; 4], transaction: Transaction) -> State {
        let [length, opcode, output, logic] = bytes;
        let (ctl, ctl_enable) = self.ctl_pins(output);
        State {
            clocks: match length {
                _ if opcode & DP != 0 => 1,
                0 => 256,
                length => u16::from(length),
            },
            opcode,
            ctl,
            ctl_enable,
            drives: transaction.writes() && opcode & DATA != 0,
            repeats: length & REEXECUTE != 0,
            terms: [logic >> 3 & 7, logic & 7],
            outcomes: FUNCTIONS[usize::from(logic >> 6)],
            branches: [length & 7, length >> 3 & 7],
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
        let mut run = self.gpif.run.take()?;
        let clock = run.clock;
        let still = board.still_pins();
        let mut cruises = still.is_some();
        let exif = self.int.exif;
        loop {
            if cruises
                && run.fresh
                && let Some(pins) = still
            {
                cruises = self.gpif_cruise(&mut run, limit, pins);
                if run.at > limit {
                    self.flush_pins(limit, board);
                    self.gpif.quiet_until = self.gpif_quiet_until(&run);
                    self.gpif.run = Some(run);
                    return None;
                }
            }
            let at = run.at;
            let done = self.gpif_edge(&mut run, still, board);
            if still.is_none() {
                self.flush_pins(at, board);
            }
            if done {
                self.flush_pins(at, board);
                self.int.raise_fifo(fifo::GPIFDONE);
                self.changed();
                return (self.int.exif != exif).then_some(at);
            }
            run.edge += run.idle_edges();
            run.at = clock.edge(run.edge);
            let interrupted = self.int.exif != exif;
            if interrupted || run.at > limit {
                self.flush_pins(at, board);
                self.gpif.quiet_until = self.gpif_quiet_until(&run);
                self.gpif.run = Some(run);
                return interrupted.then_some(at);
            }
        }
    }

    /// Runs what the GPIF has done until now, before anybody looks at it or touches what it works with.
    #[inline]
    pub(crate) fn gpif_catch_up(&mut self, board: &mut dyn Board) {
        if self.gpif.busy() {
            let now = tick_to_ps(self.tick);
            while self.gpif_run(now, board).is_some() {}
        }
    }

    /// As [`Self::gpif_catch_up`] if it may have requested an interrupt since.
    #[inline]
    pub(crate) fn gpif_follow(&mut self, board: &mut dyn Board) {
        if self.gpif.busy() {
            let now = tick_to_ps(self.tick);
            if now >= self.gpif.quiet_until {
                self.gpif_run(now, board);
            }
        }
    }

    /// A time before which no interrupt can come from `run`: the end of a count is at least one clock a
    /// word away.
    fn gpif_quiet_until(&self, run: &Run) -> Ps {
        let announces = |state: &State| state.opcode & GINT != 0;
        if self.int.fifo_ie == 0 {
            return Ps::MAX;
        }
        let Some(index) = run.transaction.endpoint() else { return 0 };
        let flags = self.int.fifo_ie & !(fifo::GPIFDONE | fifo::GPIFWF) != 0;
        if flags || self.gpif_stops_on_flag(index) || self.gpif.states.iter().any(announces) {
            return 0;
        }
        run.at + u64::from(self.gpif.count.saturating_sub(1)) * (run.clock.period() - 1)
    }

    /// Many rounds of a loop of states at once, while nothing but the count and the FIFO's fill changes.
    /// The state has just been entered. False = this loop cannot be run so.
    fn gpif_cruise(&mut self, run: &mut Run, limit: Ps, pins: Sensed) -> bool {
        let period = run.clock.period();
        let Some(index) = run.transaction.endpoint().filter(|_| run.at + 32 * period < limit)
        else {
            return true;
        };
        let Some(round) = self.gpif_round(run) else { return false };
        let mut rounds = (limit - run.at) / period / round.clocks;
        let ep = &self.eps[index];
        let by_count = u64::from(self.gpif.count.saturating_sub(1)).checked_div(round.words);
        if let Some(by_count) = by_count {
            if ep.is_in() == run.transaction.writes() {
                return false;
            }
            rounds = rounds.min(by_count);
        }
        // Flags and hand-overs come with the last words of a buffer: those go one by one. Into a full FIFO
        // nothing goes at all.
        if !run.lost || !ep.fifo_stuck() {
            let by_room = (ep.plain_words() as u64).checked_div(round.words);
            rounds = by_room.map_or(rounds, |by_room| rounds.min(by_room));
        }
        if rounds == 0 {
            return true;
        }
        let words = rounds * round.words;
        if words > 0 {
            self.eps[index].move_plain(words as usize, pins.fd);
            self.gpif.count -= words as u32;
            run.moved = true;
        }
        let steps = (rounds * round.increments % 0x200) as u16;
        self.gpif.address = (self.gpif.address + steps) & 0x1FF;
        run.edge += rounds * round.clocks;
        run.at = run.clock.edge(run.edge);
        let state = self.gpif.states[usize::from(run.state & 7)];
        self.gpif_drive_data(run, &state);
        true
    }

    /// One round from the state just entered back to it, if the count does not expire and flags stay as
    /// they are; `None` if it does not come back, or does something that has to be looked at.
    fn gpif_round(&self, run: &Run) -> Option<Round> {
        let index = run.transaction.endpoint()?;
        if run.state == IDLE || self.int.fifo_ie & 0x0FFF != 0 || self.gpif.count == 0 {
            return None;
        }
        let mut round = Round::default();
        let mut number = run.state;
        for _ in 0..IDLE {
            let state = self.gpif.states[usize::from(number & 7)];
            let waits_for_level = state.looks_at(TERM_FLAG) && self.gpif_flag_is_level(index);
            if state.opcode & (GINT | SGL) != 0 || waits_for_level {
                return None;
            }
            let moves = if run.transaction.writes() { NEXT } else { DATA };
            round.words += u64::from(state.opcode & moves != 0);
            round.increments += u64::from(state.opcode & INCAD != 0);
            round.clocks += u64::from(state.clocks);
            let next = if state.decides() { self.gpif_decide(run, &state) } else { number + 1 };
            if next == number && !state.repeats && round.words + round.increments > 0 {
                return None; // it acts in its first clock only
            }
            number = next;
            if number == IDLE {
                return None;
            }
            if number == run.state {
                return Some(round);
            }
        }
        None
    }

    /// One IFCLK edge: ends a clock of the present state and begins the next. True = finished.
    #[inline]
    fn gpif_edge(&mut self, run: &mut Run, still: Option<Sensed>, board: &mut dyn Board) -> bool {
        let mut next = run.state;
        if run.state == IDLE {
            if !run.fresh && self.gpif_finished(run) {
                return true;
            }
            run.moved = false;
            next = 0;
        } else {
            let state = self.gpif.states[usize::from(run.state & 7)];
            let acts = if state.decides() {
                run.fresh || state.repeats
            } else {
                run.left -= 1;
                run.left == 0
            };
            if acts && state.opcode & (DATA | NEXT | INCAD) != 0 {
                self.gpif_act(run, state.opcode, still, board);
            }
            if state.decides() {
                next = self.gpif_decide(run, &state);
            } else if acts {
                next += 1;
            }
        }
        run.fresh = next != run.state;
        run.state = next;
        if next == IDLE {
            return self.gpif_idle(run, still, board);
        }
        let state = self.gpif.states[usize::from(next & 7)];
        if run.fresh {
            self.gpif_enter(run, &state);
        }
        self.gpif_drive_data(run, &state);
        self.gpif_look(run, still, board);
        false
    }

    /// A pass is over. True = so is the transaction.
    fn gpif_idle(&mut self, run: &mut Run, still: Option<Sensed>, board: &mut dyn Board) -> bool {
        if run.fresh {
            self.update_idle_pins();
            self.driven.gpifadr = self.gpif.address;
            if run.transaction.endpoint().is_none() {
                return true;
            }
        }
        self.gpif_look(run, still, board);
        run.fresh = false;
        self.gpif_finished(run)
    }

    /// The flip-flops behind the RDY pins. They run all the time; before S0 the pins count as steady.
    #[inline]
    fn gpif_look(&mut self, run: &mut Run, still: Option<Sensed>, board: &mut dyn Board) {
        if run.looks {
            let pins = still.map_or_else(|| board.sense(run.at).rdy, |pins| pins.rdy);
            run.ready = [pins, run.ready[0].unwrap_or(pins)].map(Some);
        }
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
        if self.gpif_stops_on_flag(index) { self.gpif_flag(index) } else { self.gpif.count == 0 }
    }

    fn gpif_stops_on_flag(&self, index: usize) -> bool {
        self.reg(xdata::EP2GPIFFLGSEL + 1 + 8 * index as u16) & 1 != 0
    }

    /// Outputs at the beginning of a state.
    #[inline]
    fn gpif_enter(&mut self, run: &mut Run, state: &State) {
        run.left = state.clocks;
        self.driven.ctl = state.ctl;
        self.driven.ctl_enable = state.ctl_enable;
        if state.opcode & GINT != 0 {
            self.int.raise_fifo(fifo::GPIFWF);
            self.changed();
        }
    }

    /// FD and GPIFADR in the present state.
    #[inline]
    fn gpif_drive_data(&mut self, run: &Run, state: &State) {
        self.driven.gpifadr = self.gpif.address;
        if !state.drives {
            self.driven.fd_enable = 0;
            return;
        }
        self.driven.fd_enable = self.fd_mask();
        let single = self.gpif.single_out;
        self.driven.fd = match run.transaction {
            Transaction::FifoWrite(index) if state.opcode & SGL == 0 => {
                self.eps[index].fifo_peek().unwrap_or(self.driven.fd)
            }
            _ => single,
        } & self.driven.fd_enable;
    }

    /// What the state does besides driving pins.
    fn gpif_act(
        &mut self,
        run: &mut Run,
        opcode: u8,
        still: Option<Sensed>,
        board: &mut dyn Board,
    ) {
        let mut data = || still.map_or_else(|| board.sense(run.at).fd, |pins| pins.fd);
        match run.transaction {
            Transaction::SingleRead if opcode & DATA != 0 => self.gpif.single_in = data(),
            Transaction::FifoRead(_) if opcode & (DATA | SGL) == DATA | SGL => {
                self.gpif.single_in = data();
            }
            Transaction::FifoRead(index) if opcode & DATA != 0 => {
                let data = data();
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
        if !taken && !std::mem::replace(&mut run.lost, true) {
            // No instruction is at fault at this moment.
            self.diagnostics.report(0, Rule::DataLost, 0, || {
                "the GPIF moved a word into a full FIFO, out of an empty one, or against the \
                 endpoint's direction; it is lost"
                    .into()
            });
        }
        self.fifo_flags_changed();
    }

    /// The state that follows a deciding one.
    #[inline]
    fn gpif_decide(&self, run: &Run, state: &State) -> u8 {
        let [a, b] = state.terms.map(|term| u8::from(self.gpif_term(run, term)));
        state.branches[usize::from(state.outcomes >> (2 * a + b) & 1)]
    }

    #[inline]
    fn gpif_term(&self, run: &Run, term: u8) -> bool {
        match term {
            TERM_RDY5 if run.count_is_ready5 => self.gpif.count == 0,
            TERM_FLAG => run.transaction.endpoint().is_some_and(|index| self.gpif_flag(index)),
            TERM_INTRDY => run.internal_ready,
            pin => run.ready[usize::from(run.delayed)].is_some_and(|pins| pins >> pin & 1 != 0),
        }
    }

    /// Whether that flag depends on every word, not on whole buffers.
    fn gpif_flag_is_level(&self, index: usize) -> bool {
        self.reg(xdata::EP2GPIFFLGSEL + 8 * index as u16) & 3 == 0
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
