//! A simulated hand behind a pseudo-terminal, in real time.

use super::line::Line;
use super::pty::Pty;
use super::simulated::{Happening, SimulatedHand, Turn};
use blindgrasp_device::interrupt;
use std::io;
use std::thread;
use std::time::{Duration, Instant};

/// The totals of what was served.
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

/// Longest delay of the ticks before those that are missing are given up. Ticks that are made up for run without a
/// heartbeat between them, of which a hand wants one in 250 ms, and gets one in 83 at the latest: so many more are no
/// trouble.
const MOST_BEHIND: Duration = Duration::from_millis(50);

/// The times at which ticks are done: each at its time, or as soon after it as the host has the time. A host that stood
/// still for longer does not make up for what it has missed.
#[derive(Clone, Debug)]
pub struct Pace {
    period: Duration,
    /// The time at which the next tick is due.
    due: Duration,
}

/// The next thing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Nothing, for so long.
    Wait(Duration),
    /// A tick.
    Tick {
        /// It begins later than the next one should have.
        late: bool,
        /// So many before it are given up.
        missed: u64,
    },
}

impl Pace {
    /// The first tick is due at once.
    pub fn new(period: Duration, now: Duration) -> Self {
        Self { period, due: now }
    }

    /// Returns what there is to do now. A tick counts as done.
    pub fn step(&mut self, now: Duration) -> Step {
        if now < self.due {
            return Step::Wait(self.due - now);
        }
        let behind = now - self.due;
        let missed = match behind > MOST_BEHIND {
            true => (behind.as_nanos() / self.period.as_nanos()) as u64,
            false => 0,
        };
        self.due += Duration::from_nanos(self.period.as_nanos() as u64 * missed) + self.period;
        Step::Tick { late: behind >= self.period, missed }
    }
}

/// News of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum News {
    /// Something happened in the world.
    World(Happening),
    /// So many ticks before it were given up, because the host stood still.
    Missed(u64),
}

/// Does ticks until the user wants an end, at their [`Pace`]; a late one is told to the hand, as a tick after a late one is in
/// the firmware. Hand and line live in the time of the ticks, so that a host that is busy for a moment loses nothing. `tell`
/// is told the tick and what happened in it.
///
/// # Errors
/// If the pseudo-terminal fails.
pub fn serve(
    hand: &mut SimulatedHand,
    line: &mut Line,
    pty: &mut Pty,
    mut tell: impl FnMut(u64, News),
) -> io::Result<Served> {
    let period = Duration::from_micros(hand.model.config.period_us.into());
    let mut served = Served::default();
    let (mut received, mut sent) = ([0; 512], Vec::new());
    let begun = Instant::now();
    let mut pace = Pace::new(period, begun.elapsed());
    while !interrupt::wanted() {
        let late = match pace.step(begun.elapsed()) {
            Step::Wait(time) => {
                thread::sleep(time);
                continue;
            }
            Step::Tick { late, missed } => {
                if missed > 0 {
                    tell(served.ticks, News::Missed(missed));
                }
                served.missed += missed;
                late
            }
        };
        served.late += u64::from(late);
        if line.listens() {
            let count = pty.receive(&mut received)?;
            line.take(&received[..count]);
        }
        let turn = Turn { packet: line.packet(), late, dropped: line.dropped(), waiting: line.waiting() };
        let (outputs, happened) = hand.turn(turn);
        line.post(outputs);
        line.send(period, &mut sent);
        pty.send(&sent)?;
        sent.clear();
        if let Some(happened) = happened {
            tell(served.ticks, News::World(happened));
        }
        served.ticks += 1;
    }
    (served.dropped, served.lost_bytes) = (line.dropped(), pty.lost_bytes());
    Ok(served)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: Duration = Duration::from_millis(1);

    /// Ticks that are done at a time, of these late, and those given up.
    fn done(pace: &mut Pace, now: Duration) -> (u64, u64, u64) {
        let (mut ticks, mut lates, mut all_missed) = (0, 0, 0);
        while let Step::Tick { late, missed } = pace.step(now) {
            ticks += 1;
            lates += u64::from(late);
            all_missed += missed;
        }
        (ticks, lates, all_missed)
    }

    #[test]
    fn a_tick_is_done_at_its_time_and_made_up_for_a_moment_later() {
        let mut pace = Pace::new(MS, Duration::ZERO);
        assert_eq!(pace.step(Duration::ZERO), Step::Tick { late: false, missed: 0 });
        assert_eq!(pace.step(MS / 4), Step::Wait(MS * 3 / 4));
        assert_eq!(pace.step(MS), Step::Tick { late: false, missed: 0 });
        assert_eq!(done(&mut pace, 41 * MS), (40, 39, 0));
    }

    #[test]
    fn what_is_missed_in_a_long_stop_is_given_up_and_counted() {
        for stop in [51, 200, 1000, 3_600_000] {
            let mut pace = Pace::new(MS, Duration::ZERO);
            assert_eq!(done(&mut pace, stop * MS), (1, 1, u64::from(stop)), "{stop} ms");
        }
    }

    proptest! {
        /// Every tick is done or given up, whatever the host does; never are more made up for than a heartbeat allows.
        #[test]
        fn every_tick_is_done_or_given_up(stops in proptest::collection::vec(0..400_000_u32, 1..100)) {
            let mut pace = Pace::new(MS, Duration::ZERO);
            let (mut now, mut all) = (Duration::ZERO, 0);
            for us in stops {
                now += Duration::from_micros(us.into());
                let (ticks, _, missed) = done(&mut pace, now);
                prop_assert!(ticks <= 51);
                all += ticks + missed;
                prop_assert_eq!(u128::from(all), now.as_micros() / 1000 + 1);
            }
        }
    }
}
