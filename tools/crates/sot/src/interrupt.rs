//! Ctrl-C: ends the program at once, unless a verb has asked to be told and to end by itself.

use std::process;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Exit code after Ctrl-C, as shells count it.
pub const EXIT_INTERRUPTED: u8 = 130;

/// One Ctrl-C may arrive twice: from the terminal, and from a parent that passes it on.
const AGAIN_AFTER: Duration = Duration::from_millis(300);

static WATCHED: AtomicBool = AtomicBool::new(false);
static HEARD: AtomicBool = AtomicBool::new(false);
static FIRST: OnceLock<Instant> = OnceLock::new();

/// What a verb returns that was ended by Ctrl-C and has said all it had to say.
#[derive(Debug, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// From now on Ctrl-C is ours. If the system refuses, it stays the system's, which ends the program
/// too.
pub fn install() {
    let _ = ctrlc::set_handler(|| {
        HEARD.store(true, Ordering::Relaxed);
        let again = FIRST.get_or_init(Instant::now).elapsed() > AGAIN_AFTER;
        if again || !WATCHED.load(Ordering::Relaxed) {
            process::exit(i32::from(EXIT_INTERRUPTED));
        }
    });
}

/// The caller ends by itself when the flag turns true. A second Ctrl-C does not wait for it.
pub fn watch() -> &'static AtomicBool {
    WATCHED.store(true, Ordering::Relaxed);
    &HEARD
}
