//! Limits of the joints' torques: soft end stops, torque limits, slew limits, in this order.
//!
//! - A **soft end stop** acts in a margin before each end of the joint's range. Towards the end it fades out the torque
//!   that pushes there, to nothing at the end itself; a spring pushes back with the depth, and a damper, which fades in
//!   over the margin, brakes motion towards the end. Torque and motion away from the end are left alone.
//! - The **torque limit** cuts the torque to what the joint bears.
//! - The **slew limit** bounds how fast the torque changes, so that nothing jumps. It comes last; since it moves from
//!   the last torque towards one within the torque limit, its result is within the torque limit too.
//!
//! Each can be left out, and each says where it acted ([`Limiting`]). Limits are no faults: a hand that is limited does
//! what it can.

use crate::control::{GAINS, Gain, PerGain};
use crate::hand::Hand;
use crate::math::Real;
use crate::parameter::{ParameterError, Text};
use crate::period::Period;
use core::fmt;
use serde::{Deserialize, Serialize};

/// A reason why a joint's torque is not what the law asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Limit {
    /// The torque limit.
    Torque = 1,
    /// The slew limit.
    Slew = 1 << 1,
    /// The soft stop before the lower end of the range.
    LowerStop = 1 << 2,
    /// The soft stop before the upper end of the range.
    UpperStop = 1 << 3,
}

impl Limit {
    /// Every reason.
    pub const ALL: [Self; 4] = [Self::Torque, Self::Slew, Self::LowerStop, Self::UpperStop];

    /// Its name in recordings and tables.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::Slew => "slew",
            Self::LowerStop => "lower_stop",
            Self::UpperStop => "upper_stop",
        }
    }

    /// The reason in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Torque => "torque limit",
            Self::Slew => "slew limit",
            Self::LowerStop => "lower end stop",
            Self::UpperStop => "upper end stop",
        }
    }
}

/// The reasons that limit one joint: a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limiting(u8);

impl Limiting {
    /// Nothing limits.
    pub const NONE: Self = Self(0);

    /// Adds a reason.
    pub fn insert(&mut self, limit: Limit) {
        self.0 |= limit as u8;
    }

    /// Returns `true` if a reason is among them.
    pub const fn contains(self, limit: Limit) -> bool {
        self.0 & limit as u8 != 0
    }

    /// Returns `true` if nothing limits.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The bits, as they go over the wire.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The reasons.
    pub fn iter(self) -> impl Iterator<Item = Limit> {
        Limit::ALL.into_iter().filter(move |&limit| self.contains(limit))
    }
}

impl fmt::Display for Limiting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return write!(f, "nothing");
        }
        for (k, limit) in self.iter().enumerate() {
            write!(f, "{}{}", if k == 0 { "" } else { ", " }, limit.words())?;
        }
        Ok(())
    }
}

/// Limits, as a user gives them; `None` leaves one out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitConfig<const J: usize> {
    /// Largest gains that may be asked for.
    pub gains: PerGain<Option<f32>>,
    /// Largest torque of each joint, N m.
    pub torque_nm: Option<[f32; J]>,
    /// Largest change of each joint's torque, N m/s.
    pub slew_nm_s: Option<[f32; J]>,
    /// Distance from the end of each joint's range at which its soft end stop begins to act, rad; at most half the
    /// range.
    pub stop_margin_rad: Option<[f32; J]>,
    /// Torque with which a stop pushes back, by depth into the margin, N m/rad.
    pub stop_stiffness_nm_rad: Option<[f32; J]>,
    /// Torque that brakes motion towards the end, once the margin is used up, N m s/rad.
    pub stop_damping_nm_s: Option<[f32; J]>,
}

impl<const J: usize> LimitConfig<J> {
    /// No limits.
    pub const NONE: Self = Self {
        gains: PerGain::all(None),
        torque_nm: None,
        slew_nm_s: None,
        stop_margin_rad: None,
        stop_stiffness_nm_rad: None,
        stop_damping_nm_s: None,
    };
}

/// The limits, prepared for the joints of one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits<const J: usize> {
    gains: PerGain<Option<f32>>,
    joint_count: usize,
    joints: [JointLimits; J],
}

/// The limits of one joint. What is not limited has an infinite limit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct JointLimits {
    torque_nm: f32,
    /// Largest change of the torque in a tick, N m.
    slew_nm: f32,
    stop: Stop,
}

impl JointLimits {
    const NONE: Self = Self { torque_nm: f32::INFINITY, slew_nm: f32::INFINITY, stop: Stop::NONE };
}

/// The soft end stops of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stop {
    /// Beginning of the lower margin, rad.
    lower_rad: f32,
    /// Beginning of the upper margin, rad.
    upper_rad: f32,
    /// One over the margin, 1/rad.
    per_margin: f32,
    stiffness_nm_rad: f32,
    damping_nm_s: f32,
}

impl<const J: usize> LimitConfig<J> {
    /// Checks the limits and prepares them for a hand.
    ///
    /// # Errors
    /// The first limit that is out of its range.
    pub fn prepare<const F: usize>(
        &self,
        hand: &Hand<f32, J, F>,
        period: Period,
    ) -> Result<Limits<J>, ParameterError> {
        for (gain, limit) in GAINS.iter().zip(self.gains.iter()) {
            if limit.is_some_and(|limit| !(limit >= 0.0 && limit.is_finite())) {
                let (parameter, reason) = (Text::new("limits.", gain.key), "has to be zero or positive");
                return Err(ParameterError { parameter, joint: None, reason });
            }
        }
        let joint_count = hand.joint_count().min(J);
        let mut joints = [JointLimits::NONE; J];
        for (k, joint) in joints.iter_mut().enumerate().take(joint_count) {
            let of_joint = JointConfig {
                joint: k,
                range_rad: hand.range_rad(k),
                torque_nm: self.torque_nm.map(|torques| torques[k]),
                slew_nm_s: self.slew_nm_s.map(|slews| slews[k]),
                stop: self.stop_margin_rad.map(|margins| StopConfig {
                    margin_rad: margins[k],
                    stiffness_nm_rad: self.stop_stiffness_nm_rad.map_or(0.0, |stiffnesses| stiffnesses[k]),
                    damping_nm_s: self.stop_damping_nm_s.map_or(0.0, |dampings| dampings[k]),
                }),
            };
            *joint = of_joint.prepare(period)?;
        }
        Ok(Limits { gains: self.gains, joint_count, joints })
    }
}

/// The configuration of one joint.
struct JointConfig {
    joint: usize,
    range_rad: (f32, f32),
    torque_nm: Option<f32>,
    slew_nm_s: Option<f32>,
    stop: Option<StopConfig>,
}

/// The soft end stops of one joint.
struct StopConfig {
    margin_rad: f32,
    stiffness_nm_rad: f32,
    damping_nm_s: f32,
}

impl JointConfig {
    /// Not inlined: the firmware would have it once for each joint.
    #[inline(never)]
    fn prepare(&self, period: Period) -> Result<JointLimits, ParameterError> {
        let positive = |value: Option<f32>, parameter| match value {
            Some(value) if !is_positive(value) => self.fail(parameter, "has to be positive"),
            value => Ok(value.unwrap_or(f32::INFINITY)),
        };
        Ok(JointLimits {
            torque_nm: positive(self.torque_nm, "limits.torque_nm")?,
            slew_nm: positive(self.slew_nm_s, "limits.slew_nm_s")? * period.seconds(),
            stop: match &self.stop {
                Some(stop) => self.prepare_stop(stop)?,
                None => Stop::NONE,
            },
        })
    }

    fn prepare_stop(&self, stop: &StopConfig) -> Result<Stop, ParameterError> {
        let &StopConfig { margin_rad, stiffness_nm_rad, damping_nm_s } = stop;
        let (lower, upper) = self.range_rad;
        if !(is_positive(margin_rad) && margin_rad + margin_rad <= upper - lower) {
            let reason = "has to be positive and at most half the joint's range";
            return self.fail("limits.stops.margin_rad", reason);
        }
        if !(stiffness_nm_rad >= 0.0 && stiffness_nm_rad.is_finite()) {
            return self.fail("limits.stops.stiffness_nm_rad", "has to be zero or positive");
        }
        if !(damping_nm_s >= 0.0 && damping_nm_s.is_finite()) {
            return self.fail("limits.stops.damping_nm_s", "has to be zero or positive");
        }
        Ok(Stop {
            lower_rad: lower + margin_rad,
            upper_rad: upper - margin_rad,
            per_margin: 1.0 / margin_rad,
            stiffness_nm_rad,
            damping_nm_s,
        })
    }

    fn fail<R>(&self, parameter: &'static str, reason: &'static str) -> Result<R, ParameterError> {
        Err(ParameterError { parameter: parameter.into(), joint: Some(self.joint), reason })
    }
}

fn is_positive(v: f32) -> bool {
    v > 0.0 && v.is_finite()
}

impl<const J: usize> Limits<J> {
    /// Returns the gain that is below zero, above the largest that may be asked for, or not finite.
    pub fn forbidden(&self, gains: &PerGain<f32>) -> Option<&'static Gain> {
        let mut values = gains.iter().zip(self.gains.iter());
        let k = values.position(|(&gain, most)| {
            !(gain >= 0.0 && gain.is_finite() && most.is_none_or(|most| gain <= most))
        })?;
        GAINS.get(k)
    }

    /// Takes the wanted torques to the allowed ones, N m, and says what limited each joint.
    pub fn apply(
        &self,
        angles_rad: &[f32; J],
        speeds_rad_s: &[f32; J],
        last_nm: &[f32; J],
        torques_nm: &mut [f32; J],
    ) -> [Limiting; J] {
        let mut limiting = [Limiting::NONE; J];
        for k in 0..self.joint_count.min(J) {
            (torques_nm[k], limiting[k]) =
                self.joints[k].apply(angles_rad[k], speeds_rad_s[k], last_nm[k], torques_nm[k]);
        }
        limiting
    }
}

impl JointLimits {
    fn apply(&self, angle_rad: f32, speed_rad_s: f32, last_nm: f32, wanted_nm: f32) -> (f32, Limiting) {
        let mut torque = wanted_nm;
        let mut limiting = Limiting::NONE;
        let Self { torque_nm: limit, slew_nm: step, stop } = self;
        // The lower stop is the upper one in a mirror.
        let (into_upper, into_lower) = (angle_rad - stop.upper_rad, stop.lower_rad - angle_rad);
        if into_upper > 0.0 {
            torque = stop.hold_back(into_upper, speed_rad_s, torque);
            limiting.insert(Limit::UpperStop);
        } else if into_lower > 0.0 {
            torque = -stop.hold_back(into_lower, -speed_rad_s, -torque);
            limiting.insert(Limit::LowerStop);
        }
        if torque.magnitude() > *limit {
            torque = torque.limited(-limit, *limit);
            limiting.insert(Limit::Torque);
        }
        if (torque - last_nm).magnitude() > *step {
            torque = last_nm + (torque - last_nm).limited(-step, *step);
            limiting.insert(Limit::Slew);
        }
        (torque, limiting)
    }
}

impl Stop {
    const NONE: Self = Self {
        lower_rad: f32::NEG_INFINITY,
        upper_rad: f32::INFINITY,
        per_margin: 0.0,
        stiffness_nm_rad: 0.0,
        damping_nm_s: 0.0,
    };

    /// The torque at a depth into the margin; positive torque and speed are towards the end.
    fn hold_back(&self, depth_rad: f32, speed_rad_s: f32, torque_nm: f32) -> f32 {
        let share = (depth_rad * self.per_margin).limited(0.0, 1.0);
        let mut torque = torque_nm;
        if torque > 0.0 {
            torque *= 1.0 - share;
        }
        if speed_rad_s > 0.0 {
            torque -= share * self.damping_nm_s * speed_rad_s;
        }
        torque - self.stiffness_nm_rad * depth_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    /// Range -1 to 1 rad, margin 0.1 rad; ticks of a millisecond.
    fn joint(torque_nm: Option<f32>, slew_nm: Option<f32>, stops: bool) -> JointLimits {
        let stop = StopConfig { margin_rad: 0.1, stiffness_nm_rad: 2.0, damping_nm_s: 0.5 };
        let config = JointConfig {
            joint: 0,
            range_rad: (-1.0, 1.0),
            torque_nm,
            slew_nm_s: slew_nm.map(|slew_nm| 1e3 * slew_nm),
            stop: stops.then_some(stop),
        };
        config.prepare(Period::from_us(1000).unwrap()).unwrap()
    }

    /// Up to ten roundings of numbers below two, 6e-8 each.
    #[track_caller]
    fn check(result: (f32, Limiting), torque: f32, words: &str) {
        assert!((result.0 - torque).abs() < 1e-6, "{} instead of {torque}", result.0);
        assert_eq!(result.1.to_string(), words);
    }

    #[test]
    fn nothing_limits_when_nothing_is_set() {
        check(joint(None, None, false).apply(5.0, -7.0, 0.0, 1e9), 1e9, "nothing");
    }

    #[test]
    fn torque_is_limited_both_ways() {
        let joint = joint(Some(1.0), None, false);
        check(joint.apply(0.0, 0.0, 0.0, 1.0), 1.0, "nothing");
        check(joint.apply(0.0, 0.0, 0.0, 1.5), 1.0, "torque limit");
        check(joint.apply(0.0, 0.0, 0.0, -1.5), -1.0, "torque limit");
    }

    #[test]
    fn slew_is_limited_both_ways() {
        let joint = joint(None, Some(0.25), false);
        check(joint.apply(0.0, 0.0, 0.5, 0.75), 0.75, "nothing");
        check(joint.apply(0.0, 0.0, 0.5, 2.0), 0.75, "slew limit");
        check(joint.apply(0.0, 0.0, 0.5, -2.0), 0.25, "slew limit");
    }

    #[test]
    fn end_stops_push_back_and_fade_out_what_pushes_there() {
        let joint = joint(None, None, true);
        check(joint.apply(0.9, 3.0, 0.0, 1.0), 1.0, "nothing");
        // Half-way into the margin: half the torque, 0.05 rad of the spring, half the damper.
        check(joint.apply(0.95, 0.0, 0.0, 1.0), 0.5 - 0.1, "upper end stop");
        check(joint.apply(0.95, 2.0, 0.0, 1.0), 0.5 - 0.1 - 0.5, "upper end stop");
        check(joint.apply(0.95, -2.0, 0.0, -1.0), -1.0 - 0.1, "upper end stop");
        check(joint.apply(-0.95, -2.0, 0.0, -1.0), -0.5 + 0.1 + 0.5, "lower end stop");
        check(joint.apply(-0.95, 2.0, 0.0, 1.0), 1.0 + 0.1, "lower end stop");
        // At the end and beyond it nothing is left of the torque, and the spring grows.
        check(joint.apply(1.0, 0.0, 0.0, 1.0), -0.2, "upper end stop");
        check(joint.apply(1.5, 0.0, 0.0, 1.0), -1.2, "upper end stop");
    }

    #[test]
    fn end_stops_begin_without_a_jump() {
        let joint = joint(None, None, true);
        let (outside, inside) = (joint.apply(0.9, 5.0, 0.0, 1.0).0, joint.apply(0.9 + 1e-6, 5.0, 0.0, 1.0).0);
        assert!((outside - inside).abs() < 1e-4);
    }

    #[test]
    fn several_reasons_are_all_told() {
        let joint = joint(Some(1.0), Some(0.25), true);
        check(joint.apply(1.5, 9.0, 0.0, 1.0), -0.25, "torque limit, slew limit, upper end stop");
    }

    #[test]
    fn what_is_not_a_number_is_not_hidden() {
        let (torque, _) = joint(Some(1.0), Some(0.25), true).apply(0.95, 1.0, 0.0, f32::NAN);
        assert!(torque.is_nan());
    }

    #[test]
    fn bits_are_stable() {
        assert_eq!(Limit::ALL.map(|limit| limit as u8), [1, 2, 4, 8]);
    }
}
