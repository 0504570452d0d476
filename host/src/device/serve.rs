//! A simulated hand behind a pseudo-terminal, in real time.

use super::interrupt;
use super::line::Line;
use super::pty::Pty;
use super::simulated::{Happening, SimulatedHand, Turn};
use std::io;
use std::thread;
use std::time::{Duration, Instant};

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    /// Ticks.
    pub ticks: u64,
    /// Ticks that missed their deadline, the start of the next.
    pub late: u64,
    /// Starts that were lost because ticks were late.
    pub missed: u64,
    /// Answers and records that the queues had no room for.
    pub dropped: u32,
    /// Bytes that a program did not read in time.
    pub lost_bytes: u64,
}

/// Does ticks until the user wants an end, each at its time. `tell` is told the tick and what happened in it.
///
/// A tick that ends after the start of the next one is late, and the next one, which is told so, begins at once; further
/// starts that have passed are lost, as in the firmware.
///
/// # Errors
/// If the pseudo-terminal fails.
pub fn serve(
    hand: &mut SimulatedHand,
    line: &mut Line,
    pty: &mut Pty,
    mut tell: impl FnMut(u64, Happening),
) -> io::Result<Served> {
    let period = Duration::from_micros(hand.model.config.period_us.into());
    let mut served = Served::default();
    let (mut received, mut sent) = ([0; 512], Vec::new());
    let mut last = Instant::now();
    let mut start = last;
    let mut late = false;
    while !interrupt::wanted() {
        thread::sleep(start.saturating_duration_since(Instant::now()));
        if line.listens() {
            let count = pty.receive(&mut received)?;
            line.take(&received[..count]);
        }
        let turn = Turn { packet: line.packet(), late, dropped: line.dropped() };
        let (outputs, happened) = hand.turn(turn);
        line.post(outputs);
        let now = Instant::now();
        line.send(now - last, &mut sent);
        last = now;
        if !sent.is_empty() {
            pty.send(&sent)?;
            sent.clear();
        }
        if let Some(happened) = happened {
            tell(served.ticks, happened);
        }
        served.ticks += 1;
        start += period;
        let behind = Instant::now().saturating_duration_since(start);
        late = !behind.is_zero();
        if late {
            let missed = behind.as_nanos() / period.as_nanos();
            start += period * missed as u32;
            served.late += 1;
            served.missed += missed as u64;
        }
    }
    (served.dropped, served.lost_bytes) = (line.dropped(), pty.lost_bytes());
    Ok(served)
}
