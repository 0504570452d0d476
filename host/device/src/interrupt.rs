//! The user's wish for an end (Ctrl-C, or a signal to terminate). What waits for a device asks now and then, so that
//! processes are stopped and temporary files removed on this way out, too.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static WANTED: AtomicBool = AtomicBool::new(false);
static LISTENING: Once = Once::new();

/// From now on, Ctrl-C is not the end of the process but is remembered. A second one is.
pub fn listen() {
    LISTENING.call_once(|| {
        // Without the handler Ctrl-C does what it always did.
        let _ = ctrlc::set_handler(|| {
            if WANTED.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
    });
}

/// Returns `true` if the user wants an end.
pub fn wanted() -> bool {
    WANTED.load(Ordering::Relaxed)
}
