//! A line of progress on stderr that is drawn over; nothing where stderr is not a terminal.

use std::io::{IsTerminal as _, Write as _, stderr};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// From one drawing to the next, at the least.
const PERIOD: Duration = Duration::from_millis(100);
/// Characters of a bar.
const WIDTH: u64 = 40;

/// A line of progress, until it is dropped.
pub(super) struct Progress {
    is_shown: bool,
    drawn: Mutex<Drawn>,
}

/// The last drawing, and the first position, from which the time that is left is reckoned.
#[derive(Default)]
struct Drawn {
    at: Option<Instant>,
    first: Option<(Instant, u64)>,
}

impl Progress {
    pub(super) fn new() -> Self {
        Self { is_shown: stderr().is_terminal(), drawn: Mutex::default() }
    }

    /// Draws a line of words.
    pub(super) fn say(&self, words: impl FnOnce() -> String) {
        self.draw(|_| words());
    }

    /// Draws a bar of what is done, and of how many, with words behind it and the time that is left.
    pub(super) fn show(&self, done: u64, of: u64, words: impl FnOnce(u64) -> String) {
        self.draw(|drawn| {
            let (since, from) = *drawn.first.get_or_insert((Instant::now(), done));
            let done = done.min(of);
            let full = (WIDTH * done).checked_div(of).unwrap_or(WIDTH);
            let bar: String = (0..WIDTH).map(|k| if k < full { '#' } else { '.' }).collect();
            let words = words((100 * done).checked_div(of).unwrap_or(100));
            let share = (of - done) as f64 / done.saturating_sub(from) as f64;
            match Duration::try_from_secs_f64(since.elapsed().as_secs_f64() * share) {
                Ok(left) => format!("{bar} {words}, {} s left", left.as_secs()),
                Err(_) => format!("{bar} {words}"),
            }
        });
    }

    /// Prints what is to stay, above the line.
    pub(super) fn above(&self, print: impl FnOnce()) {
        self.clear();
        print();
    }

    fn draw(&self, line: impl FnOnce(&mut Drawn) -> String) {
        if !self.is_shown {
            return;
        }
        let mut drawn = self.drawn.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if drawn.at.is_none_or(|at| at.elapsed() >= PERIOD) {
            drawn.at = Some(Instant::now());
            // What is wider than the terminal is cut off there, not wrapped.
            let _ = write!(stderr(), "\r\x1b[?7l{}\x1b[K\x1b[?7h", line(&mut drawn));
        }
    }

    fn clear(&self) {
        if self.is_shown {
            let mut drawn = self.drawn.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            if drawn.at.take().is_some() {
                let _ = write!(stderr(), "\r\x1b[K");
            }
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.clear();
    }
}
