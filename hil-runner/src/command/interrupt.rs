//! SIGINT (Ctrl-C), SIGTERM and SIGHUP end a run as an error does: the trace so
//! far is kept, unfinished files are removed. Who sent which is not known, so no
//! message names the user.

use std::io;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use super::terminal;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static HANDLER: OnceLock<()> = OnceLock::new();

/// Status of an interrupted program, as shells have it.
const STATUS: i32 = 130;

/// Notes interrupts from now on; the second one ends the program at once.
pub(super) fn watch() {
    watch_aloud("");
}

/// The same; the first one is answered with these words.
pub(super) fn watch_aloud(words: &'static str) {
    HANDLER.get_or_init(|| {
        let handler = move || {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(STATUS);
            }
            terminal::tell(words);
        };
        // Without a handler an interrupt ends the program as it always does.
        let _ = ctrlc::set_handler(handler);
    });
}

/// An error once the run was interrupted.
pub(super) fn check() -> io::Result<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        return Err(io::Error::other("interrupted"));
    }
    Ok(())
}
