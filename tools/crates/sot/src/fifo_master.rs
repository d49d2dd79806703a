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

/// Writes a 16-bit counter into EP6 at every edge of IFCLK at which there is room, and checks that
/// what it reads from EP2 counts likewise. It rests until the device has its address: before, the bus
/// has not found its speed, and the chip would cut packets for full speed.
pub struct CountingMaster<L> {
    link: L,
    next_written: u16,
    next_read: u16,
    written: u64,
    read: u64,
    errors: u64,
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
            next_read: 0,
            written: 0,
            read: 0,
            errors: 0,
            free: 0,
            enabled,
        }
    }

    /// Words moved either way, and words read that were not the next ones; `None` if disabled.
    pub fn as_json(&self) -> Option<Value> {
        let Self { written, read, errors, .. } = self;
        self.enabled
            .then(|| json!({ "words_written": written, "words_read": read, "read_errors": errors }))
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
                self.errors += u64::from(word != self.next_read);
                self.next_read = word.wrapping_add(1);
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
