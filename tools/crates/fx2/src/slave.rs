//! The slave FIFO, as its external master uses it (TRM chapter 9): words at the pace of IFCLK, flags,
//! PKTEND.
//!
//! The master works in bursts: it says from when on it strobes SLWR or SLRD at every edge of IFCLK,
//! and until when it may. A burst ends by itself when the FIFO's full or empty flag tells the master
//! to stop. Assumption: the master obeys the flag at once, so nothing is lost on the way.

use crate::Fx2;
use crate::chip::Chip;
use crate::diagnostics::Rule;
use crate::endpoints::Endpoint;
use crate::ports::IFCFG_SLAVE;
use crate::regs::xdata;
use crate::time::IfClock;
use sim::Ps;

/// Which FIFO `FIFOADR[1:0]` selects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fifo {
    /// EP2.
    Ep2,
    /// EP4.
    Ep4,
    /// EP6.
    Ep6,
    /// EP8.
    Ep8,
}

/// What a burst has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Burst {
    /// Words (bytes with WORDWIDE = 0) moved.
    pub words: usize,
    /// The first IFCLK edge that is still free.
    pub next: Ps,
}

impl Fx2 {
    /// The levels of FLAGA..FLAGD (bits 0..=3) while FIFOADR selects `fifo`.
    pub fn slave_flags(&mut self, fifo: Fifo) -> u8 {
        self.chip.select(fifo);
        (0..4).fold(0, |bits, pin| bits | u8::from(self.chip.flag_pin(pin)) << pin)
    }

    /// Whether the master may write to `fifo` now: an IN endpoint with room.
    #[must_use]
    pub fn slave_can_write(&self, fifo: Fifo) -> bool {
        let ep = &self.chip.eps[fifo as usize];
        self.chip.ifcfg() == IFCFG_SLAVE && ep.is_valid() && ep.is_in() && !ep.fifo_full()
    }

    /// Whether the master may read from `fifo` now: an OUT endpoint with data.
    #[must_use]
    pub fn slave_can_read(&self, fifo: Fifo) -> bool {
        let ep = &self.chip.eps[fifo as usize];
        self.chip.ifcfg() == IFCFG_SLAVE && ep.is_valid() && !ep.is_in() && !ep.fifo_empty()
    }

    /// Writes `words` at the edges of IFCLK at or after `from` and before `until`, as long as there is
    /// room. Words not taken stay the master's.
    pub fn slave_write(&mut self, fifo: Fifo, words: &[u16], from: Ps, until: Ps) -> Burst {
        let Some((clock, first, edges)) = self.chip.slave_edges(fifo, true, from, until) else {
            return Burst { words: 0, next: until };
        };
        let ready = words.len().min(edges);
        let moved = self.chip.eps[fifo as usize].fifo_write_words(&words[..ready]);
        self.chip.end_burst(moved);
        Burst { words: moved, next: clock.edge(first + moved as u64) }
    }

    /// Reads into `words` as [`Self::slave_write`] writes.
    pub fn slave_read(&mut self, fifo: Fifo, words: &mut [u16], from: Ps, until: Ps) -> Burst {
        let Some((clock, first, edges)) = self.chip.slave_edges(fifo, false, from, until) else {
            return Burst { words: 0, next: until };
        };
        let ep = &mut self.chip.eps[fifo as usize];
        let mut moved = 0;
        for slot in words.iter_mut().take(edges) {
            let Some(word) = ep.fifo_peek() else { break };
            *slot = word;
            ep.fifo_next();
            moved += 1;
        }
        self.chip.end_burst(moved);
        Burst { words: moved, next: clock.edge(first + moved as u64) }
    }

    /// PKTEND: sends what is in the buffer as a short packet; an empty one only with ZEROLENIN.
    /// `false` = there was nothing to send, or no buffer.
    pub fn slave_packet_end(&mut self, fifo: Fifo) -> bool {
        let ended = self.chip.eps[fifo as usize].packet_end();
        self.chip.end_burst(usize::from(ended));
        ended
    }
}

impl Chip {
    /// FIFOADR: the flags that follow it are those of `fifo`.
    fn select(&mut self, fifo: Fifo) {
        if self.fifo_address != fifo as u8 {
            self.fifo_address = fifo as u8;
            self.changed();
        }
    }

    /// The clock, the first edge and the number of edges of a burst; `None` if the interface is not
    /// a slave FIFO of that direction.
    fn slave_edges(
        &mut self,
        fifo: Fifo,
        writes: bool,
        from: Ps,
        until: Ps,
    ) -> Option<(IfClock, u64, usize)> {
        self.select(fifo);
        let clock = self.ifclock();
        let ep: &Endpoint = &self.eps[fifo as usize];
        let fits = self.ifcfg() == IFCFG_SLAVE && ep.is_valid() && ep.is_in() == writes;
        if !fits || clock == IfClock::External {
            self.report(Rule::NotModelled, xdata::IFCONFIG, || {
                "the slave FIFO is used while IFCONFIG, IFCLK or the endpoint does not allow it"
                    .into()
            });
            return None;
        }
        let first = clock.edge_at_or_after(from);
        let edges = clock.edge_at_or_after(until).saturating_sub(first);
        Some((clock, first, edges as usize))
    }

    fn end_burst(&mut self, moved: usize) {
        if moved > 0 {
            self.fifo_changed();
        }
    }
}
