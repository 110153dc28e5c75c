//! Ctrl-C and its relatives end a run as an error does: the trace so far is
//! kept, unfinished files are removed.

use std::io;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use super::terminal;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static HANDLER: OnceLock<()> = OnceLock::new();

/// Status of a program that was ended by the user, as shells have it.
const ENDED_BY_USER: i32 = 130;

/// Notes interrupts from now on; the second one ends the program at once.
pub(super) fn watch() {
    watch_aloud("");
}

/// The same; the first one is answered with these words.
pub(super) fn watch_aloud(words: &'static str) {
    HANDLER.get_or_init(|| {
        let handler = move || {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(ENDED_BY_USER);
            }
            terminal::tell(words);
        };
        // Without a handler an interrupt ends the program as it always does.
        let _ = ctrlc::set_handler(handler);
    });
}

/// An error once the user has interrupted the run.
pub(super) fn check() -> io::Result<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        return Err(io::Error::other("interrupted by the user"));
    }
    Ok(())
}
