//! The data of the plots: least and greatest value of each signal in each short slot of the last minute.

use std::collections::VecDeque;
use std::time::Duration;

/// Length of a slot whose values are kept together, ms.
const SLOT_MS: u128 = 20;
/// Length of the history: the longest window.
pub const SPAN: Duration = Duration::from_secs(60);

/// Least and greatest value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Least.
    pub least: f32,
    /// Greatest.
    pub most: f32,
}

impl Range {
    fn of(value: f32) -> Self {
        Self { least: value, most: value }
    }

    /// Both, and what is between them.
    pub fn with(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), most: self.most.max(other.most) }
    }
}

/// Values of some signals over the last minute.
#[derive(Clone, Debug, Default)]
pub struct History {
    slots: VecDeque<Slot>,
}

#[derive(Clone, Debug)]
struct Slot {
    number: u128,
    ranges: Vec<Option<Range>>,
}

impl History {
    /// Adds a value of each signal; what is not finite is none. What is older than the newest belongs to it.
    pub fn add(&mut self, at: Duration, values: impl Iterator<Item = f32>) {
        let number = at.as_millis() / SLOT_MS;
        if self.slots.back().is_none_or(|last| last.number < number) {
            self.slots.push_back(Slot { number, ranges: Vec::new() });
            let oldest = number.saturating_sub(SPAN.as_millis() / SLOT_MS);
            while self.slots.front().is_some_and(|slot| slot.number < oldest) {
                self.slots.pop_front();
            }
        }
        let Some(Slot { ranges, .. }) = self.slots.back_mut() else { return };
        for (signal, value) in values.enumerate() {
            if ranges.len() <= signal {
                ranges.push(None);
            }
            if value.is_finite() {
                let range = Range::of(value);
                ranges[signal] = Some(ranges[signal].map_or(range, |before| before.with(range)));
            }
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.slots.clear();
    }

    /// A signal in the time before `until`, in so many columns of equal length; `None` where nothing is known.
    pub fn columns(
        &self,
        signal: usize,
        until: Duration,
        window: Duration,
        count: usize,
    ) -> Vec<Option<Range>> {
        let mut columns = vec![None; count];
        let (until_ms, window_ms) = (until.as_millis(), window.as_millis().max(1));
        // Everything that far back; it may be before all time.
        let begin = self.slots.partition_point(|slot| slot.number * SLOT_MS + window_ms < until_ms);
        for slot in self.slots.range(begin..) {
            let Some(range) = slot.ranges.get(signal).copied().flatten() else { continue };
            let column = (slot.number * SLOT_MS + window_ms - until_ms) * count as u128 / window_ms;
            // The slot that is still being filled may begin at the end of the window.
            let last = columns.len().saturating_sub(1);
            if let Some(column) = columns.get_mut((column as usize).min(last)) {
                *column = Some(column.map_or(range, |before: Range| before.with(range)));
            }
        }
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_column_has_the_extremes_of_its_time_and_a_gap_has_none() {
        let mut history = History::default();
        for at in (0..1000).chain(2000..4000) {
            let spike = if at == 2345 { 100.0 } else { 0.0 };
            history.add(ms(at), [at as f32, spike, f32::NAN].into_iter());
        }
        let columns = history.columns(0, ms(4000), ms(4000), 4);
        let range = |least, most| Some(Range { least, most });
        assert_eq!(columns, [range(0.0, 999.0), None, range(2000.0, 2999.0), range(3000.0, 3999.0)]);
        // However narrow, a spike is seen.
        let spikes = history.columns(1, ms(4000), ms(4000), 4);
        assert_eq!(spikes[2..], [range(0.0, 100.0), range(0.0, 0.0)]);
        assert_eq!(history.columns(2, ms(4000), ms(4000), 2), [None, None]);
        assert_eq!(history.columns(9, ms(4000), ms(4000), 2), [None, None]);
        // Before all time there is nothing.
        let early = history.columns(0, ms(1000), ms(4000), 4);
        assert_eq!(early[..3], [None, None, None]);
        assert!(early[3].is_some());
    }

    #[test]
    fn a_minute_is_kept() {
        let mut history = History::default();
        for at in (0..200_000).step_by(5) {
            history.add(ms(at), std::iter::once(at as f32));
        }
        assert!((3000..=3001).contains(&history.slots.len()), "{}", history.slots.len());
        let columns = history.columns(0, ms(200_000), ms(60_000), 60);
        assert!(columns.iter().all(Option::is_some));
    }
}
