//! Joint angle and speed from encoder counts.
//!
//! The counts first pass a **play** of one count, as between gear teeth: the joint is believed to be where it was, as
//! long as that is within half a count of what the encoder says, else moved just so far. A joint at rest on the edge
//! between two counts toggles between them; the position feedback of a grasp turns that into a limit cycle that shakes
//! the hand. Behind the play it stands still. A moving joint is seen half a count late.
//!
//! The **filter** is a tracking loop: it predicts the count of this tick from the angle and the speed of the last, and
//! corrects both by what the encoder says instead (an alpha-beta filter, with both its poles at `t`):
//!
//! ```text
//! p = x + v                 prediction           x: angle in counts, v: speed in counts a tick
//! e = z - p                 residual             z: the encoder's count behind the play
//! x = p + (1 - t^2) e       v = v + (1 - t)^2 e
//! ```
//!
//! Its one parameter is the bandwidth `f`: `t = (n - 1) / (n + 1)` with `n = 1 / (pi f T)`, the bilinear image of a
//! double pole at `2 pi f`; `T` is the tick period. At `n = 1` it is the plain difference of two counts. Of a
//! low-passed difference with the same delay it has `sqrt(2 n - 1) / n` times the noise, and its angle has no lag at
//! constant speed.
//!
//! **Delay.** A steady acceleration `a` is reported late by `D = (n - 1/2) T`; the angle then lags by
//! `((n - 1) / 2)^2 a T^2`. A constant speed is reported without error, and its angle without lag.
//!
//! **Noise** of the speed, rms, from counts of `d` rad each:
//! - quantisation, mean over all constant speeds: `d / (sqrt(6) T n^(3/2))`. An encoder's error is then uniform over one
//!   count and, averaged over the speeds, uncorrelated from tick to tick, so that its variance `d^2 / 12` is multiplied
//!   by the filter's noise gain `2 / n^3` and divided by `T^2`;
//! - quantisation at the worst constant speed: at most `d / (sqrt(12) T sqrt(n^2 - 1))`, the filter's largest gain over
//!   all frequencies;
//! - standstill, also on the edge between two counts: zero, exactly.
//!
//! With the 0.0167 degree counts of the paper's hand (Table V) at 1 kHz, as the tests measure them:
//!
//! | bandwidth | delay   | constant speed, mean and worst |
//! |-----------|---------|--------------------------------|
//! | 50 Hz     | 5.87 ms | 0.007 and 0.013 rad/s          |
//! | 100 Hz    | 2.68 ms | 0.021 and 0.028 rad/s          |
//! | 200 Hz    | 1.09 ms | 0.059 and 0.068 rad/s          |
//!
//! Counts are subtracted as integers, with wrap-around, before anything becomes a float: what the filter keeps are
//! small numbers, however far the counters have run.

use crate::buffer::BufferTooSmall;
use crate::math::Real;
use crate::parameter::ParameterError;
use crate::period::Period;
use crate::telemetry::snapshot::{Loader, Saver, SnapshotError};

/// How the counts of one joint are read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoder<T> {
    /// The count at joint angle zero.
    pub zero_count: i32,
    /// Joint angle of one count, rad; positive.
    pub rad_per_count: T,
    /// Whether the joint angle falls while the count rises.
    pub reversed: bool,
}

/// Encoders and filter, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorConfig<T, const J: usize> {
    /// Bandwidth `f` of the filter, Hz: a speed that swings at this frequency is reported at about half its size. 100 Hz suits 0.0167 degree counts.
    pub bandwidth_hz: T,
    /// One a joint.
    pub encoders: [Encoder<T>; J],
}

impl<T: Real, const J: usize> EstimatorConfig<T, J> {
    /// Checks the parameters and prepares the estimator.
    ///
    /// # Errors
    /// The first parameter that is out of its range.
    pub fn prepare(&self, joint_count: usize, period: Period) -> Result<Estimator<T, J>, ParameterError> {
        let fail = |parameter, joint, reason| Err(ParameterError { parameter, joint, reason });
        let period_s: T = period.seconds();
        let w = T::from_f64(core::f64::consts::PI) * self.bandwidth_hz * period_s;
        if !(w >= T::from_f64(1e-3) && w <= T::one()) {
            let reason =
                "times pi times the tick period has to be from 0.001 to 1 (0.32 Hz to 318 Hz at 1 kHz)";
            return fail("estimator.bandwidth_hz", None, reason);
        }
        let mut scales = [Scale { zero_count: 0, rad: T::zero(), rad_s: T::zero() }; J];
        for (k, (scale, encoder)) in scales.iter_mut().zip(&self.encoders).take(joint_count).enumerate() {
            let rad = encoder.rad_per_count;
            if !(rad > T::zero() && rad <= T::one()) {
                return fail("estimator.rad_per_count", Some(k), "has to be positive and at most 1");
            }
            let rad = if encoder.reversed { -rad } else { rad };
            *scale = Scale { zero_count: encoder.zero_count, rad, rad_s: rad / period_s };
        }
        let pole = (T::one() - w) / (T::one() + w);
        let rest = T::one() - pole;
        Ok(Estimator { joint_count, n: T::one() / w, keep: pole * pole, beta: rest * rest, period_s, scales })
    }
}

/// The encoder of one joint, prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale<T> {
    zero_count: i32,
    /// Angle of one count with its sign, rad.
    rad: T,
    /// Speed of one count a tick with its sign, rad/s.
    rad_s: T,
}

/// The filter, prepared for the joints of one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimator<T, const J: usize> {
    joint_count: usize,
    /// `1 / (pi f T)`, at least 1.
    n: T,
    /// `t^2`: how much of the prediction's error is kept in the angle.
    keep: T,
    /// `(1 - t)^2`.
    beta: T,
    period_s: T,
    scales: [Scale<T>; J],
}

/// What the filter remembers of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Track<T> {
    /// The newest count.
    count: i32,
    /// Where the joint is believed to be, ahead of the newest count, counts: between -1/2 and 1/2.
    play: T,
    /// Estimated angle ahead of the newest count, counts.
    ahead: T,
    /// Estimated speed, counts a tick.
    speed: T,
}

/// What the filter remembers from tick to tick; the first sample starts it, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks<T, const J: usize> {
    started: bool,
    tracks: [Track<T>; J],
}

impl<T: Real, const J: usize> Tracks<T, J> {
    /// Waits for the first sample.
    pub fn new() -> Self {
        Self {
            started: false,
            tracks: [Track { count: 0, play: T::zero(), ahead: T::zero(), speed: T::zero() }; J],
        }
    }

    /// Forgets everything: the next sample counts as the first.
    pub fn restart(&mut self) {
        self.started = false;
    }
}

impl<const J: usize> Tracks<f32, J> {
    pub(crate) fn save(&self, joints: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        to.u8(u8::from(self.started))?;
        for track in self.tracks.iter().take(joints) {
            to.u32(track.count as u32)?;
            to.f32s(&[track.play, track.ahead, track.speed], 3)?;
        }
        Ok(())
    }

    pub(crate) fn load(joints: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut tracks = Self::new();
        tracks.started = from.flag()?;
        for track in tracks.tracks.iter_mut().take(joints) {
            *track = Track {
                count: from.u32()? as i32,
                play: from.f32()?,
                ahead: from.f32()?,
                speed: from.f32()?,
            };
        }
        Ok(tracks)
    }
}

impl<T: Real, const J: usize> Default for Tracks<T, J> {
    fn default() -> Self {
        Self::new()
    }
}

/// How the joints move; zero beyond the hand's joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion<T, const J: usize> {
    /// Joint angles `q`, rad.
    pub angles_rad: [T; J],
    /// Joint speeds `dq/dt`, rad/s.
    pub speeds_rad_s: [T; J],
    /// By how much each joint turned in this tick, rad, as the counts themselves have it: not late, and in whole counts.
    pub moved_rad: [T; J],
    /// By how many counts each encoder moved in this tick, up or down: a large number means that it miscounts.
    pub count_changes: [u32; J],
}

impl<T: Real, const J: usize> Motion<T, J> {
    /// At rest at zero.
    pub fn still() -> Self {
        Self {
            angles_rad: [T::zero(); J],
            speeds_rad_s: [T::zero(); J],
            moved_rad: [T::zero(); J],
            count_changes: [0; J],
        }
    }
}

impl<const J: usize> Motion<f32, J> {
    /// Without what has changed in the tick: that says something of its own tick only.
    pub(crate) fn save(&self, joints: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        for (&angle_rad, &speed_rad_s) in self.angles_rad.iter().zip(&self.speeds_rad_s).take(joints) {
            to.f32s(&[angle_rad, speed_rad_s], 2)?;
        }
        Ok(())
    }

    pub(crate) fn load(joints: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut motion = Self::still();
        for (angle_rad, speed_rad_s) in
            motion.angles_rad.iter_mut().zip(&mut motion.speeds_rad_s).take(joints)
        {
            *angle_rad = from.f32()?;
            *speed_rad_s = from.f32()?;
        }
        Ok(motion)
    }
}

impl<T: Real, const J: usize> Estimator<T, J> {
    /// Takes the counts of this tick.
    pub fn update(&self, tracks: &mut Tracks<T, J>, counts: &[i32; J]) -> Motion<T, J> {
        if !tracks.started {
            tracks.started = true;
            for (track, &count) in tracks.tracks.iter_mut().zip(counts) {
                *track = Track { count, play: T::zero(), ahead: T::zero(), speed: T::zero() };
            }
        }
        let mut motion = Motion::still();
        for k in 0..self.joint_count.min(J) {
            let (scale, track) = (&self.scales[k], &mut tracks.tracks[k]);
            let moved = track.follow(self.keep, self.beta, counts[k]);
            motion.moved_rad[k] = T::from_i32(moved) * scale.rad;
            motion.count_changes[k] = moved.unsigned_abs();
            motion.angles_rad[k] =
                (T::from_i32(track.count.wrapping_sub(scale.zero_count)) + track.ahead) * scale.rad;
            motion.speeds_rad_s[k] = track.speed * scale.rad_s;
        }
        motion
    }

    /// Delay `D` of the speed, s.
    pub fn speed_delay_s(&self) -> T {
        (self.n - T::from_f64(0.5)) * self.period_s
    }

    /// Noise of a joint's speed by quantisation, mean over all constant speeds, rad/s rms.
    pub fn speed_noise_rad_s(&self, joint: usize) -> T {
        let six = T::from_i32(6);
        self.rad_s(joint) / (self.n * (six * self.n).square_root())
    }

    /// Speed of one count a tick, rad/s.
    pub(crate) fn rad_s(&self, joint: usize) -> T {
        self.scales.get(joint).map_or(T::zero(), |scale| scale.rad_s.magnitude())
    }
}

impl<T: Real> Track<T> {
    /// One step of the filter; returns by how many counts the joint moved. Everything is measured from the newest count, so
    /// that the residual is the prediction's lead with the opposite sign.
    fn follow(&mut self, keep: T, beta: T, count: i32) -> i32 {
        let moved = count.wrapping_sub(self.count);
        self.count = count;
        let moved_counts = T::from_i32(moved);
        let half = T::from_f64(0.5);
        self.play = (self.play - moved_counts).limited(-half, half);
        let lead = self.ahead + self.speed - moved_counts - self.play;
        self.ahead = self.play + keep * lead;
        self.speed -= beta * lead;
        // A millionth of a count is nothing; without this a joint at rest would crawl through the subnormal numbers.
        let nothing = T::from_f64(1e-6);
        if lead.magnitude() < nothing && self.speed.magnitude() < nothing {
            self.ahead = self.play;
            self.speed = T::zero();
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::println;
    use std::vec::Vec;

    /// The paper's encoder behind its gear (Table V): 4,000 counts a turn, 5.4 : 1.
    const RAD_PER_COUNT: f64 = core::f64::consts::TAU / (4000.0 * 5.4);

    fn estimator<T: Real>(bandwidth_hz: f64, zero_count: i32, reversed: bool) -> Estimator<T, 1> {
        let rad_per_count = T::from_f64(RAD_PER_COUNT);
        EstimatorConfig {
            bandwidth_hz: T::from_f64(bandwidth_hz),
            encoders: [Encoder { zero_count, rad_per_count, reversed }],
        }
        .prepare(1, Period::from_us(1000).unwrap())
        .unwrap()
    }

    fn run<T: Real>(estimator: &Estimator<T, 1>, counts: impl Iterator<Item = i32>) -> Vec<Motion<T, 1>> {
        let mut tracks = Tracks::new();
        counts.map(|count| estimator.update(&mut tracks, &[count])).collect()
    }

    /// Root of the mean square of `speed - true speed`, after the filter has settled.
    fn speed_rms(estimator: &Estimator<f64, 1>, speed_rad_s: f64, counts: impl Iterator<Item = i32>) -> f64 {
        let motions = run(estimator, counts);
        let settled = &motions[500..];
        let squares: f64 = settled.iter().map(|m| (m.speeds_rad_s[0] - speed_rad_s).powi(2)).sum();
        (squares / settled.len() as f64).square_root()
    }

    #[test]
    fn delay_is_what_the_essay_says() {
        // Counts k^2 have the acceleration of 2 counts per tick per tick exactly, without quantisation; the speed at
        // tick k is 2 k.
        for (bandwidth_hz, stated_ms) in [(50.0, 5.87), (100.0, 2.68), (200.0, 1.09)] {
            let estimator = estimator::<f64>(bandwidth_hz, 0, false);
            let motions = run(&estimator, (0..2000).map(|k| k * k));
            let (k, last) = (1999.0, motions.last().unwrap());
            let acceleration = 2.0 * RAD_PER_COUNT / 1e-6;
            let delay_s = (2.0 * k * RAD_PER_COUNT / 1e-3 - last.speeds_rad_s[0]) / acceleration;
            // Less the half count of the play.
            let lag_s2 = ((k * k - 0.5) * RAD_PER_COUNT - last.angles_rad[0]) / acceleration;
            println!(
                "{bandwidth_hz} Hz: speed late by {:.3} ms, angle by {:.3} ms^2",
                1e3 * delay_s,
                1e6 * lag_s2
            );
            // Rounding of speeds of 4,000 counts a tick in f64, with room.
            assert!((delay_s - estimator.speed_delay_s()).abs() < 1e-9, "{delay_s}");
            assert!((lag_s2 - 1e-6 * (0.5 * (estimator.n - 1.0)).powi(2)).abs() < 1e-12, "{lag_s2}");
            assert!((1e3 * delay_s - stated_ms).abs() < 0.005, "{delay_s}");
        }
    }

    #[test]
    fn noise_is_what_the_essay_says() {
        for (bandwidth_hz, mean, worst) in
            [(50.0, 0.007, 0.013), (100.0, 0.021, 0.028), (200.0, 0.059, 0.068)]
        {
            let estimator = estimator::<f64>(bandwidth_hz, 0, false);
            // Speeds spread evenly over zero to one count a tick: beyond, the quantisation error repeats.
            let speeds = 401;
            let (mut squares, mut largest) = (0.0, 0.0_f64);
            for step in 0..speeds {
                let per_tick = (f64::from(step) + 0.618_034) / f64::from(speeds);
                let rms = speed_rms(
                    &estimator,
                    per_tick * RAD_PER_COUNT / 1e-3,
                    (0..6000).map(|k| (per_tick * f64::from(k)).floor() as i32),
                );
                squares += rms * rms;
                largest = largest.max(rms);
            }
            let rms = (squares / f64::from(speeds)).square_root();
            let derived = estimator.speed_noise_rad_s(0);
            let bound =
                RAD_PER_COUNT / 12.0_f64.square_root() / 1e-3 / (estimator.n.powi(2) - 1.0).square_root();
            println!(
                "{bandwidth_hz} Hz: {rms:.4} rad/s over all speeds (derived {derived:.4}), worst {largest:.4} (bound {bound:.4})"
            );
            // The mean over 401 speeds differs from the integral over all of them by what the few speeds near simple
            // fractions weigh: about one in 401 of a variance that is at most twice the mean.
            assert!((rms / derived - 1.0).abs() < 0.01, "{rms} {derived}");
            assert!(largest <= 1.02 * bound, "{largest} {bound}");
            assert!((rms - mean).abs() < 0.0015 && (bound - worst).abs() < 0.0006, "{rms} {bound}");
        }
    }

    #[test]
    fn a_count_that_toggles_on_its_edge_is_standstill() {
        let estimator = estimator::<f32>(50.0, 0, false);
        for pace in [1, 2, 7, 40] {
            let motions = run(&estimator, (0..2000).map(|k| 100 + (k / pace) % 2));
            for motion in &motions[500..] {
                assert_eq!(motion.speeds_rad_s[0], 0.0);
                assert_eq!(motion.angles_rad[0], 100.5 * RAD_PER_COUNT as f32);
            }
        }
        // Two counts to and fro are motion.
        let motions = run(&estimator, (0..2000).map(|k| 100 + 2 * ((k / 10) % 2)));
        assert!(motions[500..].iter().any(|motion| motion.speeds_rad_s[0].magnitude() > 1e-3));
    }

    #[test]
    fn a_joint_at_rest_has_exactly_no_speed() {
        let estimator = estimator::<f32>(100.0, 0, false);
        let motions = run(&estimator, (0..500).map(|k| k.min(100)));
        assert!(motions[100].speeds_rad_s[0] > 0.2);
        let last = motions.last().unwrap();
        assert_eq!(last.speeds_rad_s[0], 0.0);
        assert_eq!(last.angles_rad[0], 99.5 * RAD_PER_COUNT as f32, "half a count late");
    }

    #[test]
    fn the_first_sample_starts_it_at_rest() {
        let estimator = estimator::<f32>(100.0, 1000, true);
        let mut tracks = Tracks::new();
        let motion = estimator.update(&mut tracks, &[400]);
        assert_eq!(motion.speeds_rad_s, [0.0]);
        assert_eq!(motion.count_changes, [0]);
        assert!((motion.angles_rad[0] - 600.0 * RAD_PER_COUNT as f32).abs() < 1e-6);
        tracks.restart();
        assert_eq!(estimator.update(&mut tracks, &[90_000]).count_changes, [0]);
    }

    #[test]
    fn counters_may_wrap_and_counts_may_be_large() {
        // Once around zero, once around the largest count: the same motion to the last bit.
        let small = run(&estimator::<f32>(100.0, 0, false), (0..2000).map(|k| k * k / 500 - 2000));
        let large = run(
            &estimator::<f32>(100.0, i32::MAX, false),
            (0..2000).map(|k| i32::MAX.wrapping_add(k * k / 500 - 2000)),
        );
        assert_eq!(small, large);
    }

    #[test]
    fn a_jump_is_told_and_forgotten() {
        let estimator = estimator::<f32>(100.0, 0, false);
        let counts = [0, 0, i32::MIN, i32::MIN];
        let motions = run(&estimator, counts.into_iter().chain(std::iter::repeat_n(i32::MIN, 300)));
        assert_eq!(motions[2].count_changes, [1 << 31]);
        assert_eq!(motions[3].count_changes, [0]);
        assert!(motions.iter().all(|m| m.angles_rad[0].is_finite() && m.speeds_rad_s[0].is_finite()));
        assert_eq!(motions.last().unwrap().speeds_rad_s, [0.0]);
    }

    #[test]
    fn parameters_out_of_range_are_named() {
        let encoder = Encoder { zero_count: 0, rad_per_count: 1e-3, reversed: false };
        let period = Period::from_us(1000).unwrap();
        for bandwidth_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.1, 319.0] {
            let config = EstimatorConfig { bandwidth_hz, encoders: [encoder; 2] };
            assert_eq!(config.prepare(2, period).unwrap_err().parameter, "estimator.bandwidth_hz");
        }
        for rad_per_count in [0.0, -1.0, f64::NAN, f64::INFINITY, 2.0] {
            let config = EstimatorConfig {
                bandwidth_hz: 100.0,
                encoders: [encoder, Encoder { rad_per_count, ..encoder }],
            };
            let error = config.prepare(2, period).unwrap_err();
            assert_eq!((error.parameter, error.joint), ("estimator.rad_per_count", Some(1)));
            assert!(config.prepare(1, period).is_ok(), "unused capacity is not checked");
        }
    }
}
