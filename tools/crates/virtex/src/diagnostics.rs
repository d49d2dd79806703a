//! A list of what went wrong at a pin: each kind once, with its first time and how often.

use sim::Ps;

/// One kind of trouble.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diagnostic<T> {
    /// What.
    pub what: T,
    /// When it was first seen.
    pub first: Ps,
    /// How often it was seen.
    pub count: u64,
}

/// The list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostics<T>(Vec<Diagnostic<T>>);

impl<T> Default for Diagnostics<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: Copy + PartialEq> Diagnostics<T> {
    /// Note `what`, seen at `now`.
    pub fn note(&mut self, now: Ps, what: T) {
        match self.0.iter_mut().find(|known| known.what == what) {
            Some(known) => known.count += 1,
            None => self.0.push(Diagnostic { what, first: now, count: 1 }),
        }
    }

    /// What has been seen, in the order of its first time.
    pub fn list(&self) -> &[Diagnostic<T>] {
        &self.0
    }

    /// How often `what` has been seen.
    pub fn count(&self, what: T) -> u64 {
        self.0.iter().find(|known| known.what == what).map_or(0, |known| known.count)
    }
}
