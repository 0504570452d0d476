//! The times of ticks, on the host's clock.
//!
//! A record comes some time after its tick: it waits in queues, and in the buffers of a USB bridge and of two operating
//! systems. The shortest of these delays is nearly always the same, whatever the others are. So the difference between the
//! host's clock and the device's is taken from the record that came with the **least delay**: the minimum, over a
//! window, of `arrival - tick * period`. That is later than the truth by the least delay, which nobody can see from here.
//!
//! The two clocks **drift** apart, by some 1e-4 of the time for two crystals and 1e-2 where the device has none. A minimum
//! over all times would follow in one direction only; over a window of one to two seconds it follows in both, late by what
//! the clocks drift in a window (0.1 ms for crystals).
//!
//! No tick is later than its record came, and none is earlier than the one before.

use super::Stamp;

/// Half of the window, ns: the minimum is kept for the half that is under way and for the one before.
const HALF_WINDOW_NS: i64 = 1_000_000_000;

/// Maps one device's ticks to the host's clock.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    period_ns: i64,
    /// The first arrival; everything is measured from it.
    origin: Stamp,
    /// The first tick, and the newest with its wraps.
    first: u64,
    tick: u64,
    /// Least `arrival - tick * period` of the half before and of this one.
    before: i64,
    now: i64,
    /// The beginning of this half.
    begun: i64,
    last: Stamp,
}

impl Clock {
    /// Begins with a record.
    pub(super) fn new(period_us: u32, tick: u32, arrival: Stamp) -> Self {
        Self {
            period_ns: i64::from(period_us) * 1000,
            origin: arrival,
            first: tick.into(),
            tick: tick.into(),
            before: i64::MAX,
            now: i64::MAX,
            begun: 0,
            last: Stamp(0),
        }
    }

    /// The next record: when its tick was.
    pub(super) fn map(&mut self, tick: u32, arrival: Stamp) -> Stamp {
        let ahead = tick.wrapping_sub(self.tick as u32);
        self.tick += u64::from(ahead);
        let device = (self.tick - self.first) as i64 * self.period_ns;
        let host = arrival.0.wrapping_sub(self.origin.0) as i64;
        if host - self.begun >= HALF_WINDOW_NS {
            (self.before, self.now) = (self.now, i64::MAX);
            self.begun = host;
        }
        self.now = self.now.min(host - device);
        let at = self.origin.0.wrapping_add_signed(device + self.now.min(self.before));
        self.last = Stamp(at).max(self.last).min(arrival);
        self.last
    }

    /// The newest tick, counted on without wrapping.
    pub(super) fn tick(&self) -> u64 {
        self.tick
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: f64 = 1e6;

    /// Runs a device whose clock is fast by `drift` for 20 s, with delays of a serial line, and returns the largest and the
    /// smallest `mapped - true - least delay`, ms, after the first two seconds.
    fn errors(drift: f64, seed: u64) -> (f64, f64) {
        let mut random = fastrand::Rng::with_seed(seed);
        let start = 1.7e18;
        let least_ms = 0.3;
        let mut clock = None;
        let (mut arrival, mut last) = (0.0_f64, Stamp(0));
        let (mut least, mut most) = (f64::MAX, f64::MIN);
        for tick in 0..20_000_u32 {
            let truth = f64::from(tick) * MS / (1.0 + drift);
            // Exponential delays of 2 ms in the mean, and once in a while the host is away for 50 ms. Nothing overtakes.
            let away = if random.u32(0..2000) == 0 { 50.0 } else { 0.0 };
            let delay_ms = least_ms - 2.0 * (1.0 - random.f64()).ln() + away;
            arrival = arrival.max(truth + delay_ms * MS);
            let arrived = Stamp((start + arrival) as u64);
            // The counter wraps on the way.
            let number = tick.wrapping_sub(7000);
            let clock = clock.get_or_insert_with(|| Clock::new(1000, number, arrived));
            let at = clock.map(number, arrived);
            assert!(at <= arrived && at >= last, "{tick}");
            last = at;
            if tick > 2000 {
                let error = (at.0 as f64 - start - truth) / MS - least_ms;
                (least, most) = (least.min(error), most.max(error));
            }
        }
        (least, most)
    }

    #[test]
    fn ticks_are_where_the_least_delay_puts_them() {
        for seed in 0..5 {
            for drift in [0.0, 1e-4, -1e-4] {
                let (least, most) = errors(drift, seed);
                // A window of at least a second has a thousand delays; the least of them exceeds the least possible one by
                // 2 ms / 1000 in the mean. With the drift over the window of at most 2 s (0.2 ms either way), and
                // as much again for the time that the host was away, 0.3 ms suffices. f64 keeps 256 ns at this date.
                assert!(least > -0.3 && most < 0.3, "drift {drift}: {least} to {most} ms");
            }
        }
        // A device without a crystal.
        for drift in [1e-2, -1e-2] {
            let (least, most) = errors(drift, 9);
            assert!(least > -21.0 && most < 21.0, "{least} to {most} ms");
        }
    }

    #[test]
    fn exact_arrivals_stay_exact() {
        let mut clock = Clock::new(500, u32::MAX, Stamp(77));
        for k in 0..10_000_u64 {
            let at = Stamp(77 + k * 500_000);
            assert_eq!(clock.map(u32::MAX.wrapping_add(k as u32), at), at);
        }
        assert_eq!(clock.tick(), u64::from(u32::MAX) + 9999);
    }

    #[test]
    fn two_devices_are_on_one_clock() {
        // The same instants, told by two devices of different periods, starts and delays.
        let mut slow = Clock::new(1000, 5000, Stamp(1_000_200));
        let mut fast = Clock::new(250, 9, Stamp(1_000_100));
        for k in 0..4000_u64 {
            let truth = 1_000_000 + k * 1_000_000;
            let slow_at = slow.map(5000 + k as u32, Stamp(truth + 200 + (k % 7) * 30_000));
            let fast_at = fast.map(9 + 4 * k as u32, Stamp(truth + 100 + (k % 5) * 90_000));
            // They differ by their least delays.
            assert_eq!(slow_at.0 - fast_at.0, 100);
        }
    }
}
