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
    /// Ticks that began later than the next one should have.
    pub late: u64,
    /// Ticks that were given up, because the host stood still.
    pub missed: u64,
    /// Answers and records that the queues had no room for.
    pub dropped: u32,
    /// Bytes that a program did not read in time.
    pub lost_bytes: u64,
}

/// How far the ticks may be behind before what is missing is given up: a host that slept is not made up for.
const MOST_BEHIND: Duration = Duration::from_secs(1);

/// Does ticks until the user wants an end, each at its time, or as soon after it as the host has the time: then it is told
/// so, as a tick after a late one is in the firmware. Hand and line live in the time of the ticks, so that a host that is busy
/// for a moment loses nothing. `tell` is told the tick and what happened in it.
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
    let mut start = Instant::now();
    while !interrupt::wanted() {
        let mut behind = Instant::now().saturating_duration_since(start);
        if behind.is_zero() {
            thread::sleep(start.saturating_duration_since(Instant::now()));
            behind = Instant::now().saturating_duration_since(start);
        } else if behind > MOST_BEHIND {
            let missed = behind.as_nanos() / period.as_nanos();
            served.missed += missed as u64;
            start += period * missed as u32;
        }
        let late = behind >= period;
        served.late += u64::from(late);
        if line.listens() {
            let count = pty.receive(&mut received)?;
            line.take(&received[..count]);
        }
        let turn = Turn { packet: line.packet(), late, dropped: line.dropped() };
        let (outputs, happened) = hand.turn(turn);
        line.post(outputs);
        line.send(period, &mut sent);
        if !sent.is_empty() {
            pty.send(&sent)?;
            sent.clear();
        }
        if let Some(happened) = happened {
            tell(served.ticks, happened);
        }
        served.ticks += 1;
        start += period;
    }
    (served.dropped, served.lost_bytes) = (line.dropped(), pty.lost_bytes());
    Ok(served)
}
