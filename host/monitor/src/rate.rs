//! Rates a second of late.

use std::collections::VecDeque;
use std::time::Duration;

/// Length of a slot that is counted together, ms.
const SLOT_MS: u128 = 100;
/// So many slots are a second.
const SLOTS: u128 = 10;

/// Counts of the last second.
#[derive(Clone, Debug, Default)]
pub struct Rate {
    /// Number of the slot, and its count; in order.
    slots: VecDeque<(u128, u64)>,
    /// Slot of the first count.
    first: Option<u128>,
}

impl Rate {
    /// Counts so many more. Time does not run backwards: what is late counts as now.
    pub fn add(&mut self, at: Duration, count: u64) {
        let slot = at.as_millis() / SLOT_MS;
        self.first.get_or_insert(slot);
        match self.slots.back_mut() {
            Some((last, sum)) if *last >= slot => *sum += count,
            _ => self.slots.push_back((slot, count)),
        }
        while self.slots.front().is_some_and(|&(first, _)| first + SLOTS < slot) {
            self.slots.pop_front();
        }
    }

    /// Mean of the last whole second, 1/s; of what there is, where it is less. The slot that is still being filled does
    /// not count.
    pub fn per_second(&self, now: Duration) -> f64 {
        let slot = now.as_millis() / SLOT_MS;
        let Some(age) = self.first.and_then(|first| slot.checked_sub(first)).filter(|&age| age > 0) else {
            return 0.0;
        };
        let counted = self.slots.iter().filter(|&&(at, _)| at < slot && at + SLOTS >= slot);
        let sum: u64 = counted.map(|&(_, count)| count).sum();
        sum as f64 * SLOTS as f64 / age.min(SLOTS) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_steady_stream_has_its_rate_at_any_time_and_none_when_it_ends() {
        let mut rate = Rate::default();
        assert_eq!(rate.per_second(ms(50)), 0.0);
        for at in 0..3000 {
            rate.add(ms(at), 7);
            if at >= 100 {
                assert_eq!(rate.per_second(ms(at)), 7000.0, "at {at} ms");
            }
        }
        assert_eq!(rate.per_second(ms(3500)), 3500.0);
        assert_eq!(rate.per_second(ms(4000)), 0.0);
        assert!(rate.slots.len() <= 12, "{}", rate.slots.len());
    }
}
