//! The end of a command when the user interrupts (Ctrl-C, or a signal to terminate).
//!
//! Left alone, a command ends at once, and what it has not written to its end is removed. What waits for a device asks now
//! and then instead, so that a hand is stopped, processes end and recordings are finished on this way out, too.

use blindgrasp_files as files;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, Once, PoisonError};

/// An answer to an interrupt, which is given its number from 1 on.
type Action = Box<dyn Fn(u32) + Send>;

static COUNT: AtomicU32 = AtomicU32::new(0);
/// Set by an interrupt of a command that [listens](listen).
static WANTED: AtomicBool = AtomicBool::new(false);
static ACTION: Mutex<Option<Action>> = Mutex::new(None);
static LISTENING: Once = Once::new();

/// From now on, an interrupt ends the process in good order. Where interrupts are ignored, as behind `nohup`, they still are.
pub fn tidy_up() {
    if !are_ignored() {
        listen_by(|_| end_now());
    }
}

/// From now on, an interrupt is not the end of the process but of whatever waits for a device ([`wanted`]). A second one is.
pub fn listen() {
    listen_by(|number| {
        WANTED.store(true, Ordering::Relaxed);
        if number > 1 {
            end_now();
        }
    });
}

/// From now on, this is done at an interrupt, and nothing else: the line stays open, so that a hand can be stopped over it.
pub fn listen_by(action: impl Fn(u32) + Send + 'static) {
    *ACTION.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(action));
    LISTENING.call_once(|| {
        // Without the handler Ctrl-C does what it always did.
        let _ = ctrlc::set_handler(|| {
            let number = COUNT.fetch_add(1, Ordering::Relaxed) + 1;
            if let Some(action) = &*ACTION.lock().unwrap_or_else(PoisonError::into_inner) {
                action(number);
            }
        });
    });
}

/// Returns how many interrupts there were.
pub fn count() -> u32 {
    COUNT.load(Ordering::Relaxed)
}

/// Returns `true` if the user wants an end of a command that [listens](listen).
pub fn wanted() -> bool {
    WANTED.load(Ordering::Relaxed)
}

/// Ends the process, and removes what is half written.
pub fn end_now() -> ! {
    files::abandon(|paths| {
        let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
        match names.len() {
            0 => eprintln!("blindgrasp: interrupted"),
            _ => eprintln!("blindgrasp: interrupted: {} is not written", names.join(", ")),
        }
        std::process::exit(130)
    });
    std::process::exit(130)
}

/// Returns `true` if the process was started such that it outlives its terminal.
fn are_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    // Hang-up and interrupt are signals 1 and 2.
    ignored & 0b11 != 0
}
