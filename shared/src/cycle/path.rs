//! Ways from where something is to where it is to be.

use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::math::Real;

/// A way of several numbers at once: with the least jerk, from any state to rest. One that is changed on the way goes on without
/// a jump of position, speed or acceleration, so that a stream of targets is followed smoothly, and ends at the last of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Path<const N: usize> {
    from: [f32; N],
    /// Speed at its beginning, times its time; acceleration, times the square of its time.
    speed: [f32; N],
    acceleration: [f32; N],
    to: [f32; N],
    /// Its ticks, and those that are over.
    ticks: u32,
    age: u32,
}

/// The place on a path, with its derivatives by ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place<const N: usize> {
    pub(crate) value: [f32; N],
    pub(crate) per_tick: [f32; N],
    pub(crate) per_tick2: [f32; N],
}

/// Returns the largest of some numbers that are not negative.
pub(crate) fn largest(values: &[f32]) -> f32 {
    values.iter().fold(0.0, |most: f32, &value| if value > most { value } else { most })
}

/// Largest speed of a way from rest to rest, over its mean.
pub(crate) const PEAK: f32 = 1.875;

impl<const N: usize> Path<N> {
    /// At rest.
    pub(crate) const fn resting(at: [f32; N]) -> Self {
        Self { from: at, speed: [0.0; N], acceleration: [0.0; N], to: at, ticks: 0, age: 0 }
    }

    /// Returns `true` at the end.
    pub(crate) fn is_over(&self) -> bool {
        self.age >= self.ticks
    }

    /// Goes on by a tick.
    pub(crate) fn advance(&mut self) {
        self.age = self.age.saturating_add(1);
    }

    /// Returns the value of this tick alone.
    pub(crate) fn value(&self) -> [f32; N] {
        if self.is_over() {
            return self.to;
        }
        let s = self.age as f32 / self.ticks as f32;
        let (s2, s3) = (s * s, s * s * s);
        let (s4, s5) = (s2 * s2, s2 * s3);
        let way = 10.0 * s3 - 15.0 * s4 + 6.0 * s5;
        let speed = s - 6.0 * s3 + 8.0 * s4 - 3.0 * s5;
        let bend = 0.5 * s2 - 1.5 * s3 + 1.5 * s4 - 0.5 * s5;
        core::array::from_fn(|k| {
            let length = self.to[k] - self.from[k];
            self.from[k] + length * way + self.speed[k] * speed + self.acceleration[k] * bend
        })
    }

    /// Returns the place of this tick.
    pub(crate) fn place(&self) -> Place<N> {
        let zero = [0.0; N];
        if self.is_over() {
            return Place { value: self.to, per_tick: zero, per_tick2: zero };
        }
        let per_tick = 1.0 / self.ticks as f32;
        let s = self.age as f32 * per_tick;
        let (s2, s3, s4) = (s * s, s * s * s, s * s * s * s);
        let s5 = s4 * s;
        // What becomes of the way itself, of a speed and of an acceleration at the beginning; and their derivatives.
        let way = 10.0 * s3 - 15.0 * s4 + 6.0 * s5;
        let way1 = 30.0 * s2 - 60.0 * s3 + 30.0 * s4;
        let way2 = 60.0 * s - 180.0 * s2 + 120.0 * s3;
        let speed = s - 6.0 * s3 + 8.0 * s4 - 3.0 * s5;
        let speed1 = 1.0 - 18.0 * s2 + 32.0 * s3 - 15.0 * s4;
        let speed2 = -36.0 * s + 96.0 * s2 - 60.0 * s3;
        let bend = 0.5 * s2 - 1.5 * s3 + 1.5 * s4 - 0.5 * s5;
        let bend1 = s - 4.5 * s2 + 6.0 * s3 - 2.5 * s4;
        let bend2 = 1.0 - 9.0 * s + 18.0 * s2 - 10.0 * s3;
        let mut place = Place { value: self.to, per_tick: zero, per_tick2: zero };
        for k in 0..N {
            let (length, v, a) = (self.to[k] - self.from[k], self.speed[k], self.acceleration[k]);
            place.value[k] = self.from[k] + length * way + v * speed + a * bend;
            place.per_tick[k] = (length * way1 + v * speed1 + a * bend1) * per_tick;
            place.per_tick2[k] = (length * way2 + v * speed2 + a * bend2) * (per_tick * per_tick);
        }
        place
    }

    /// Goes somewhere else from now on, in so many ticks.
    pub(crate) fn turn_to(&mut self, to: &[f32; N], ticks: u32) {
        let ticks = ticks.max(1);
        let time = ticks as f32;
        let Place { value, per_tick, per_tick2 } = self.place();
        *self = Self {
            from: value,
            speed: per_tick.map(|v| v * time),
            acceleration: per_tick2.map(|a| a * (time * time)),
            to: *to,
            ticks,
            age: 0,
        };
    }

    /// Returns the ways that are left to go there.
    pub(crate) fn ways(&self, to: &[f32; N]) -> [f32; N] {
        let from = self.value();
        core::array::from_fn(|k| (to[k] - from[k]).magnitude())
    }

    pub(crate) fn save(&self, count: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        for values in [&self.from, &self.speed, &self.acceleration, &self.to] {
            to.f32s(values, count)?;
        }
        to.u32(self.ticks)?;
        to.u32(self.age)
    }

    pub(crate) fn load(count: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut path = Self::resting([0.0; N]);
        for values in [&mut path.from, &mut path.speed, &mut path.acceleration, &mut path.to] {
            from.f32s(values, count)?;
        }
        (path.ticks, path.age) = (from.u32()?, from.u32()?);
        Ok(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A way from rest to rest has the least jerk: its middle is half-way, at 1.875 of the mean speed.
    #[test]
    fn from_rest_to_rest() {
        let mut path = Path::resting([1.0]);
        path.turn_to(&[3.0], 100);
        let mut fastest: f32 = 0.0;
        for tick in 0..=100 {
            let Place { value, per_tick, .. } = path.place();
            fastest = fastest.max(per_tick[0]);
            if tick == 50 {
                assert!((value[0] - 2.0).abs() < 1e-6 && (per_tick[0] - PEAK * 2.0 / 100.0).abs() < 1e-6);
            }
            path.advance();
        }
        assert!(path.is_over() && path.place().value == [3.0]);
        assert!((fastest - PEAK * 2.0 / 100.0).abs() < 1e-6);
    }

    /// Wherever it is turned round, nothing jumps: differences of the values are the derivatives, also across the turn.
    #[test]
    fn a_way_that_is_changed_does_not_jump() {
        for turned_at in [1, 17, 50, 99] {
            let mut path = Path::resting([0.0]);
            path.turn_to(&[1.0], 100);
            let mut values = std::vec::Vec::new();
            for tick in 0..300 {
                if tick == turned_at {
                    let before = path.place();
                    path.turn_to(&[-0.5], 150);
                    let after = path.place();
                    assert!((before.value[0] - after.value[0]).abs() < 1e-6);
                    assert!((before.per_tick[0] - after.per_tick[0]).abs() < 1e-6);
                    assert!((before.per_tick2[0] - after.per_tick2[0]).abs() < 1e-7);
                }
                values.push(path.place().value[0]);
                path.advance();
            }
            let jerks = values.windows(4).map(|v| (v[3] - 3.0 * v[2] + 3.0 * v[1] - v[0]).abs());
            assert!(jerks.fold(0.0, f32::max) < 2e-4, "{turned_at}");
            assert!((values[299] + 0.5).abs() < 1e-6);
        }
    }
}
