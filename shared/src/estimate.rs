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

use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::math::Real;
use crate::parameter::ParameterError;
use crate::period::Period;

/// The reading of one joint's counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoder {
    /// The count at joint angle zero.
    pub zero_count: i32,
    /// Joint angle of one count, rad; positive.
    pub rad_per_count: f32,
    /// `true` if the joint angle falls while the count rises.
    pub reversed: bool,
}

/// Encoders and filter, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorConfig<const J: usize> {
    /// Bandwidth `f` of the filter, Hz: a speed that swings at this frequency is reported at about half its size. 100 Hz suits 0.0167 degree counts.
    pub bandwidth_hz: f32,
    /// One a joint.
    pub encoders: [Encoder; J],
}

impl Encoder {
    /// The largest zero, up or down, in counts: every whole number up to it is an `f32`, as it goes over the line.
    pub const MOST_ZERO_COUNT: u32 = 1 << 24;

    /// Returns 1, or -1 where the joint angle falls while the count rises.
    pub fn sign(&self) -> f32 {
        if self.reversed { -1.0 } else { 1.0 }
    }

    /// Returns the joint angle at a count, rad.
    pub fn angle_rad(&self, count: i32) -> f32 {
        count.wrapping_sub(self.zero_count) as f32 * self.rad_per_count * self.sign()
    }
}

impl<const J: usize> EstimatorConfig<J> {
    /// Checks the parameters and prepares the estimator.
    ///
    /// # Errors
    /// The first parameter that is out of its range.
    pub fn prepare(&self, joint_count: usize, period: Period) -> Result<Estimator<J>, ParameterError> {
        let fail = |parameter: &'static str, joint, reason| {
            Err(ParameterError { parameter: parameter.into(), joint, reason })
        };
        let period_s: f32 = period.seconds();
        let w = core::f32::consts::PI * self.bandwidth_hz * period_s;
        if !(1e-3..=1.0).contains(&w) {
            let reason =
                "times pi times the tick period has to be from 0.001 to 1 (0.32 Hz to 318 Hz at 1 kHz)";
            return fail("estimator.bandwidth_hz", None, reason);
        }
        let mut scales = [Scale { zero_count: 0, rad: 0.0, rad_s: 0.0 }; J];
        for (k, (scale, encoder)) in scales.iter_mut().zip(&self.encoders).take(joint_count).enumerate() {
            let rad = encoder.rad_per_count;
            if !(rad > 0.0 && rad <= 1.0) {
                return fail("estimator.rad_per_count", Some(k), "has to be positive and at most 1");
            }
            if encoder.zero_count.unsigned_abs() > Encoder::MOST_ZERO_COUNT {
                return fail("encoder_zero_count", Some(k), "has to be from -16777216 to 16777216");
            }
            let rad = rad * encoder.sign();
            *scale = Scale { zero_count: encoder.zero_count, rad, rad_s: rad / period_s };
        }
        let pole = pole(self.bandwidth_hz, period_s);
        let rest = 1.0 - pole;
        Ok(Estimator { joint_count, n: 1.0 / w, keep: pole * pole, beta: rest * rest, period_s, scales })
    }
}

/// Returns the filter's double pole `t` for a bandwidth (Hz) and a tick period (s).
pub fn pole(bandwidth_hz: f32, period_s: f32) -> f32 {
    let w = core::f32::consts::PI * bandwidth_hz * period_s;
    (1.0 - w) / (1.0 + w)
}

/// The encoder of one joint, prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    zero_count: i32,
    /// Angle of one count with its sign, rad.
    rad: f32,
    /// Speed of one count a tick with its sign, rad/s.
    rad_s: f32,
}

/// The filter, prepared for the joints of one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimator<const J: usize> {
    joint_count: usize,
    /// `1 / (pi f T)`, at least 1.
    n: f32,
    /// `t^2`: how much of the prediction's error is kept in the angle.
    keep: f32,
    /// `(1 - t)^2`.
    beta: f32,
    period_s: f32,
    scales: [Scale; J],
}

/// The filter's memory of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Track {
    /// The newest count.
    count: i32,
    /// The assumed position of the joint ahead of the newest count, counts: between -1/2 and 1/2.
    play: f32,
    /// Estimated angle ahead of the newest count, counts.
    ahead: f32,
    /// Estimated speed, counts a tick.
    speed: f32,
}

/// The filter's memory from tick to tick; the first sample starts it, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks<const J: usize> {
    started: bool,
    tracks: [Track; J],
}

impl<const J: usize> Tracks<J> {
    /// Waits for the first sample.
    pub fn new() -> Self {
        Self { started: false, tracks: [Track { count: 0, play: 0.0, ahead: 0.0, speed: 0.0 }; J] }
    }

    /// Forgets everything: the next sample counts as the first.
    pub fn restart(&mut self) {
        self.started = false;
    }
}

impl<const J: usize> Tracks<J> {
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

impl<const J: usize> Default for Tracks<J> {
    fn default() -> Self {
        Self::new()
    }
}

/// The motion of the joints; zero beyond the hand's joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion<const J: usize> {
    /// Joint angles `q`, rad.
    pub angles_rad: [f32; J],
    /// Joint speeds `dq/dt`, rad/s.
    pub speeds_rad_s: [f32; J],
    /// By how much each joint turned in this tick, rad, as the counts themselves have it: not late, and in whole counts.
    pub moved_rad: [f32; J],
    /// By how many counts each encoder moved in this tick, up or down: a large number means that it miscounts.
    pub count_changes: [u32; J],
}

impl<const J: usize> Motion<J> {
    /// At rest at zero.
    pub fn still() -> Self {
        Self { angles_rad: [0.0; J], speeds_rad_s: [0.0; J], moved_rad: [0.0; J], count_changes: [0; J] }
    }
}

impl<const J: usize> Motion<J> {
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

impl<const J: usize> Estimator<J> {
    /// Takes the counts of this tick to the motion.
    pub fn update(&self, tracks: &mut Tracks<J>, counts: &[i32; J], motion: &mut Motion<J>) {
        if !tracks.started {
            tracks.started = true;
            for (track, &count) in tracks.tracks.iter_mut().zip(counts) {
                *track = Track { count, play: 0.0, ahead: 0.0, speed: 0.0 };
            }
        }
        for k in 0..self.joint_count.min(J) {
            let (scale, track) = (&self.scales[k], &mut tracks.tracks[k]);
            let moved = track.follow(self.keep, self.beta, counts[k]);
            motion.moved_rad[k] = moved as f32 * scale.rad;
            motion.count_changes[k] = moved.unsigned_abs();
            motion.angles_rad[k] =
                (track.count.wrapping_sub(scale.zero_count) as f32 + track.ahead) * scale.rad;
            motion.speeds_rad_s[k] = track.speed * scale.rad_s;
        }
    }

    /// Delay `D` of the speed, s.
    pub fn speed_delay_s(&self) -> f32 {
        (self.n - 0.5) * self.period_s
    }

    /// Noise of a joint's speed by quantisation, mean over all constant speeds, rad/s rms.
    pub fn speed_noise_rad_s(&self, joint: usize) -> f32 {
        let six = 6.0;
        self.rad_s(joint) / (self.n * (six * self.n).square_root())
    }

    /// Speed of one count a tick, rad/s.
    pub(crate) fn rad_s(&self, joint: usize) -> f32 {
        self.scales.get(joint).map_or(0.0, |scale| scale.rad_s.magnitude())
    }
}

impl Track {
    /// One step of the filter; returns by how many counts the joint moved. Everything is measured from the newest count, so
    /// that the residual is the prediction's lead with the opposite sign.
    fn follow(&mut self, keep: f32, beta: f32, count: i32) -> i32 {
        let moved = count.wrapping_sub(self.count);
        self.count = count;
        let moved_counts = moved as f32;
        let half = 0.5;
        self.play = (self.play - moved_counts).limited(-half, half);
        let lead = self.ahead + self.speed - moved_counts - self.play;
        self.ahead = self.play + keep * lead;
        self.speed -= beta * lead;
        // A millionth of a count is nothing; without this a joint at rest would crawl through the subnormal numbers.
        let nothing = 1e-6;
        if lead.magnitude() < nothing && self.speed.magnitude() < nothing {
            self.ahead = self.play;
            self.speed = 0.0;
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

    fn estimator(bandwidth_hz: f64, zero_count: i32, reversed: bool) -> Estimator<1> {
        let rad_per_count = RAD_PER_COUNT as f32;
        EstimatorConfig {
            bandwidth_hz: bandwidth_hz as f32,
            encoders: [Encoder { zero_count, rad_per_count, reversed }],
        }
        .prepare(1, Period::from_us(1000).unwrap())
        .unwrap()
    }

    fn run(estimator: &Estimator<1>, counts: impl Iterator<Item = i32>) -> Vec<Motion<1>> {
        let mut tracks = Tracks::new();
        let mut motion = Motion::still();
        counts
            .map(|count| {
                estimator.update(&mut tracks, &[count], &mut motion);
                motion.clone()
            })
            .collect()
    }

    /// Root of the mean square of `speed - true speed`, after the filter has settled.
    fn speed_rms(estimator: &Estimator<1>, speed_rad_s: f64, counts: impl Iterator<Item = i32>) -> f64 {
        let motions = run(estimator, counts);
        let settled = &motions[500..];
        let squares: f64 = settled.iter().map(|m| (f64::from(m.speeds_rad_s[0]) - speed_rad_s).powi(2)).sum();
        (squares / settled.len() as f64).square_root()
    }

    #[test]
    fn delay_is_what_the_essay_says() {
        // Counts k^2 have the acceleration of 2 counts per tick per tick exactly, without quantisation; the speed at
        // tick k is 2 k.
        for (bandwidth_hz, stated_ms) in [(50.0, 5.87), (100.0, 2.68), (200.0, 1.09)] {
            // Zero is where it ends, so that the angle is a small number there.
            let estimator = estimator(bandwidth_hz, 200 * 200, false);
            let n = f64::from(estimator.n);
            let last = run(&estimator, (0..=200).map(|k| k * k)).pop().unwrap();
            let acceleration = 2.0 * RAD_PER_COUNT / 1e-6;
            let speed_rad_s = 2.0 * 200.0 * RAD_PER_COUNT / 1e-3;
            let delay_s = (speed_rad_s - f64::from(last.speeds_rad_s[0])) / acceleration;
            // Less the half count of the play.
            let lag_s2 = (-0.5 * RAD_PER_COUNT - f64::from(last.angles_rad[0])) / acceleration;
            println!(
                "{bandwidth_hz} Hz: speed late by {:.3} ms, angle by {:.3} ms^2",
                1e3 * delay_s,
                1e6 * lag_s2
            );
            // Speeds of 400 counts a tick are rounded by 2e-5 of a count; the loop keeps the roundings of some `n` ticks. A
            // thousandth of a count a tick is half a microsecond of delay.
            assert!((delay_s - f64::from(estimator.speed_delay_s())).abs() < 5e-7, "{delay_s}");
            assert!((lag_s2 - 1e-6 * (0.5 * (n - 1.0)).powi(2)).abs() < 1e-9, "{lag_s2}");
            assert!((1e3 * delay_s - stated_ms).abs() < 0.005, "{delay_s}");
        }
    }

    #[test]
    fn noise_is_what_the_essay_says() {
        for (bandwidth_hz, mean, worst) in
            [(50.0, 0.007, 0.013), (100.0, 0.021, 0.028), (200.0, 0.059, 0.068)]
        {
            let estimator = estimator(bandwidth_hz, 0, false);
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
            let derived = f64::from(estimator.speed_noise_rad_s(0));
            let bound = RAD_PER_COUNT
                / 12.0_f64.square_root()
                / 1e-3
                / (f64::from(estimator.n).powi(2) - 1.0).square_root();
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
        let estimator = estimator(50.0, 0, false);
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
        let estimator = estimator(100.0, 0, false);
        let motions = run(&estimator, (0..500).map(|k| k.min(100)));
        assert!(motions[100].speeds_rad_s[0] > 0.2);
        let last = motions.last().unwrap();
        assert_eq!(last.speeds_rad_s[0], 0.0);
        assert_eq!(last.angles_rad[0], 99.5 * RAD_PER_COUNT as f32, "half a count late");
    }

    #[test]
    fn the_first_sample_starts_it_at_rest() {
        let estimator = estimator(100.0, 1000, true);
        let mut tracks = Tracks::new();
        let mut motion = Motion::still();
        estimator.update(&mut tracks, &[400], &mut motion);
        assert_eq!(motion.speeds_rad_s, [0.0]);
        assert_eq!(motion.count_changes, [0]);
        assert!((motion.angles_rad[0] - 600.0 * RAD_PER_COUNT as f32).abs() < 1e-6);
        tracks.restart();
        estimator.update(&mut tracks, &[90_000], &mut motion);
        assert_eq!(motion.count_changes, [0]);
    }

    #[test]
    fn counters_may_wrap_and_counts_may_be_large() {
        // Once around zero, once around the largest count: the same motion to the last bit.
        let small = run(&estimator(100.0, 0, false), (0..2000).map(|k| k * k / 500 - 2000));
        let mut far = estimator(100.0, 0, false);
        far.scales[0].zero_count = i32::MAX;
        let large = run(&far, (0..2000).map(|k| i32::MAX.wrapping_add(k * k / 500 - 2000)));
        assert_eq!(small, large);
    }

    #[test]
    fn a_jump_is_told_and_forgotten() {
        let estimator = estimator(100.0, 0, false);
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
        for bandwidth_hz in [0.0, -1.0, f32::NAN, f32::INFINITY, 0.1, 319.0] {
            let config = EstimatorConfig { bandwidth_hz, encoders: [encoder; 2] };
            assert_eq!(config.prepare(2, period).unwrap_err().parameter, "estimator.bandwidth_hz");
        }
        for rad_per_count in [0.0, -1.0, f32::NAN, f32::INFINITY, 2.0] {
            let config = EstimatorConfig {
                bandwidth_hz: 100.0,
                encoders: [encoder, Encoder { rad_per_count, ..encoder }],
            };
            let error = config.prepare(2, period).unwrap_err();
            assert_eq!(error.parameter, "estimator.rad_per_count");
            assert_eq!(error.joint, Some(1));
            assert!(config.prepare(1, period).is_ok(), "unused capacity is not checked");
        }
    }
}
