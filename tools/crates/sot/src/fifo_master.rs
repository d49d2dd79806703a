//! What may be soldered to the FX2's slave FIFO of `sot twin fx2`: a master that counts, for firmware
//! that streams.

use fx2::Fx2;
use fx2::host::Link;
use fx2::slave::Fifo;
use serde_json::{Value, json};
use sim::{MS, Ps};

/// Words offered or asked for at a time, more than all buffers of an endpoint hold.
const BURST_WORDS: usize = 2048;
/// A master that had to wait longer does not make up for it.
const CATCH_UP: Ps = MS;

/// Gaps in what was read that are told apart; more are only counted.
const RUNS_MAX: usize = 1000;
/// Words that a host may have under way. A word that lies further ahead of the one due is one that came
/// before.
const AHEAD_MAX: u16 = 0xE000;

/// Writes a 16-bit counter into EP6 at every edge of IFCLK at which there is room, and checks that
/// what it reads from EP2 counts likewise. It rests until the device has its address: before, the bus
/// has not found its speed, and the chip would cut packets for full speed.
pub struct CountingMaster<L> {
    link: L,
    next_written: u16,
    written: u64,
    read: u64,
    /// Words that were not the next ones.
    errors: u64,
    /// Words that had come before, or lie too far ahead.
    backwards: u64,
    /// First and count of the words read without a gap, counted on beyond 16 bits.
    runs: Vec<(u64, u64)>,
    /// The word due, counted on beyond 16 bits.
    due: u64,
    /// The first edge at which it has not been at work.
    free: Ps,
    enabled: bool,
}

impl<L: Link> CountingMaster<L> {
    /// A master beside `link`; a disabled one never touches the FIFO.
    pub fn new(link: L, enabled: bool) -> Self {
        Self {
            link,
            next_written: 0,
            written: 0,
            read: 0,
            errors: 0,
            backwards: 0,
            runs: Vec::new(),
            due: 0,
            free: 0,
            enabled,
        }
    }

    /// Words moved either way, words read that were not the next ones or had come before, and what was
    /// read without a gap as first and count; `None` if disabled.
    pub fn as_json(&self) -> Option<Value> {
        let Self { written, read, errors, backwards, runs, .. } = self;
        self.enabled.then(|| {
            json!({
                "words_written": written,
                "words_read": read,
                "read_errors": errors,
                "read_backwards": backwards,
                "read_runs": runs,
            })
        })
    }

    fn note(&mut self, word: u16) {
        let ahead = word.wrapping_sub(self.due as u16);
        self.errors += u64::from(ahead != 0);
        self.backwards += u64::from(ahead > AHEAD_MAX);
        let at = self.due + u64::from(ahead);
        if let Some((_, count)) = self.runs.last_mut().filter(|_| ahead == 0) {
            *count += 1;
        } else if self.runs.len() < RUNS_MAX {
            self.runs.push((at, 1));
        }
        self.due = at + 1;
    }

    /// Does what the master would have done until `until`.
    fn work(&mut self, until: Ps) {
        self.free = self.free.max(until.saturating_sub(CATCH_UP));
        if self.link.fx2().slave_can_write(Fifo::Ep6) {
            let mut words = [0; BURST_WORDS];
            let mut next = self.next_written;
            for word in &mut words {
                *word = next;
                next = next.wrapping_add(1);
            }
            let burst = self.link.fx2().slave_write(Fifo::Ep6, &words, self.free, until);
            self.next_written = self.next_written.wrapping_add(burst.words as u16);
            self.written += burst.words as u64;
            self.free = burst.next;
        }
        if self.link.fx2().slave_can_read(Fifo::Ep2) {
            let mut words = [0; BURST_WORDS];
            let burst = self.link.fx2().slave_read(Fifo::Ep2, &mut words, self.free, until);
            for &word in &words[..burst.words] {
                self.note(word);
            }
            self.read += burst.words as u64;
            self.free = burst.next;
        }
    }
}

impl<L: Link> Link for CountingMaster<L> {
    fn fx2(&mut self) -> &mut Fx2 {
        self.link.fx2()
    }

    fn run_until(&mut self, t: Ps) {
        self.link.run_until(t);
        if self.enabled && self.link.fx2().usb_address() != 0 {
            self.work(t);
        }
    }
}
