//! What can be wrong: numbered faults, and the watch that finds them.
//!
//! A fault takes all torque away in the tick that finds it, and is kept until it is cleared; the one that came first
//! is the one that is reported. A fault's number never changes and is never used again for another.
//!
//! Here are the faults that the tick can see by itself. Limits ([`limit`](crate::limit)) are no faults; a joint whose
//! torque stays at its limit for long is one.

use crate::estimate::{Estimator, Motion};
use crate::hand::Hand;
use crate::limit::{Limit, Limiting};
use crate::math::Real;
use crate::parameter::ParameterError;
use crate::period::Period;
use core::fmt;
use serde::{Deserialize, Serialize};

/// Writes the enum and its tables from one line a fault.
macro_rules! faults {
    ($($name:ident = $number:literal, $words:literal, $remedy:literal;)*) => {
        /// A fault. On the wire it is its number.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(into = "u8", try_from = "u8")]
        #[repr(u8)]
        pub enum Fault {
            $(#[doc = concat!("A joint's ", $words, ".")] $name = $number,)*
        }

        impl Fault {
            /// Every fault, in the order of the numbers.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Its number, for ever.
            pub const fn number(self) -> u8 {
                self as u8
            }

            /// What is wrong with the joint, in words.
            pub const fn words(self) -> &'static str {
                match self { $(Self::$name => $words,)* }
            }

            /// What to do.
            pub const fn remedy(self) -> &'static str {
                match self { $(Self::$name => $remedy,)* }
            }

            /// The fault of a number.
            pub const fn from_number(number: u8) -> Option<Self> {
                match number { $($number => Some(Self::$name),)* _ => None }
            }
        }
    };
}

#[rustfmt::skip]
faults! {
    SampleMissing    = 1, "encoder gave no sample",                                   "check the encoder's wiring and supply";
    NotFinite        = 2, "angle, speed or torque is not a finite number",            "check the gains and the hand's file; report the record";
    CountJump        = 3, "count changed by more than the joint can turn in a tick",  "check the encoder's wiring and screening; set the zero again";
    BeyondRange      = 4, "angle is beyond its range",                                "move the joint back into its range; check its zero";
    Overspeed        = 5, "speed is above its limit",                                 "check what drives the joint; lower the force or raise the damping";
    SaturatedTooLong = 6, "torque stayed at its limit for too long",                  "look for a jam; lower the force";
    CounterReset     = 8, "encoder counter lost its settings and its zero",           "check the counter's supply; move the joint to its zero, then clear the fault";
    OutputFailed     = 9, "torque output failed its read-back",                       "check the output's wiring, supply and load";
}

impl From<Fault> for u8 {
    fn from(fault: Fault) -> u8 {
        fault.number()
    }
}

/// No fault has this number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownFault(pub u8);

impl fmt::Display for UnknownFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no fault has the number {}", self.0)
    }
}

impl core::error::Error for UnknownFault {}

impl TryFrom<u8> for Fault {
    type Error = UnknownFault;

    fn try_from(number: u8) -> Result<Self, UnknownFault> {
        Self::from_number(number).ok_or(UnknownFault(number))
    }
}

/// A fault and where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Raised {
    /// The fault.
    pub fault: Fault,
    /// The joint.
    pub joint: u8,
}

impl Raised {
    /// A fault of a joint.
    pub fn at(joint: usize, fault: Fault) -> Self {
        Self { fault, joint: u8::try_from(joint).unwrap_or(u8::MAX) }
    }
}

impl fmt::Display for Raised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "fault {}: joint {}: {}", self.fault.number(), self.joint, self.fault.words())
    }
}

/// Where faults begin, as a user says; `None` leaves one out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultConfig<T, const J: usize> {
    /// Speed that each joint can't reach, rad/s: a count that changes faster is wrong. The motor's no-load speed over
    /// the gear, with room.
    pub possible_speed_rad_s: Option<[T; J]>,
    /// Speed that each joint must not reach, rad/s. Not the difference of two counts but the filtered speed is meant.
    pub speed_limit_rad_s: Option<[T; J]>,
    /// How far a joint may be beyond its range, rad.
    pub range_slack_rad: Option<T>,
    /// How long a torque may stay at its limit, ms.
    pub saturated_ms: Option<u32>,
}

impl<T: Real, const J: usize> FaultConfig<T, J> {
    /// Only what can't be left out: missing samples and what is not finite.
    pub const LEAST: Self = Self {
        possible_speed_rad_s: None,
        speed_limit_rad_s: None,
        range_slack_rad: None,
        saturated_ms: None,
    };

    /// Checks the parameters and prepares the watch for a hand.
    ///
    /// # Errors
    /// The first parameter that is out of its range.
    pub fn prepare<const F: usize>(
        &self,
        hand: &Hand<T, J, F>,
        estimator: &Estimator<T, J>,
        period: Period,
    ) -> Result<Watch<T, J>, ParameterError> {
        let joint_count = hand.joint_count().min(J);
        let mut joints = [JointWatch { change: None, speed_rad_s: None, range_rad: None }; J];
        if self.range_slack_rad.is_some_and(|slack| !(slack >= T::zero() && slack.is_finite())) {
            let reason = "has to be zero or positive";
            return Err(ParameterError { parameter: "faults.range_slack_rad", joint: None, reason });
        }
        for (k, joint) in joints.iter_mut().enumerate().take(joint_count) {
            let positive = |parameter, v: T| {
                let reason = "has to be positive";
                if v > T::zero() && v.is_finite() {
                    Ok(v)
                } else {
                    Err(ParameterError { parameter, joint: Some(k), reason })
                }
            };
            if let Some(speeds) = self.possible_speed_rad_s {
                let speed = positive("faults.possible_speed_rad_s", speeds[k])?;
                // A count more, because both ends of the tick are rounded to whole counts.
                joint.change = Some(speed / estimator.rad_s(k) + T::one());
            }
            if let Some(speeds) = self.speed_limit_rad_s {
                joint.speed_rad_s = Some(positive("faults.speed_limit_rad_s", speeds[k])?);
            }
            if let Some(slack) = self.range_slack_rad {
                let (lower, upper) = hand.range_rad(k);
                joint.range_rad = Some((lower - slack, upper + slack));
            }
        }
        let saturated_ticks = match self.saturated_ms {
            Some(time) => Some(period.ticks(time, "faults.saturated_ms")?),
            None => None,
        };
        Ok(Watch { joint_count, joints, saturated_ticks })
    }
}

/// The watch, prepared for the joints of one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Watch<T, const J: usize> {
    joint_count: usize,
    joints: [JointWatch<T>; J],
    saturated_ticks: Option<u32>,
}

/// Where the faults of one joint begin.
#[derive(Clone, Copy, Debug, PartialEq)]
struct JointWatch<T> {
    /// Change of the count in a tick.
    change: Option<T>,
    speed_rad_s: Option<T>,
    range_rad: Option<(T, T)>,
}

impl<T: Real, const J: usize> Watch<T, J> {
    /// The first joint whose motion is at fault, with the first of its faults.
    pub fn motion(&self, motion: &Motion<T, J>) -> Option<Raised> {
        for k in 0..self.joint_count.min(J) {
            let fault =
                self.joints[k].motion(motion.angles_rad[k], motion.speeds_rad_s[k], motion.count_changes[k]);
            if let Some(fault) = fault {
                return Some(Raised::at(k, fault));
            }
        }
        None
    }

    /// The first joint whose torque is not a finite number.
    pub fn torques(&self, torques_nm: &[T; J]) -> Option<Raised> {
        let joint = torques_nm.iter().take(self.joint_count).position(|torque| !torque.is_finite())?;
        Some(Raised::at(joint, Fault::NotFinite))
    }

    /// Counts for how many ticks each joint has been at its torque limit; the first that was for too long.
    pub fn saturation(&self, saturated: &mut [u32; J], limiting: &[Limiting; J]) -> Option<Raised> {
        for (ticks, limiting) in saturated.iter_mut().zip(limiting) {
            *ticks = if limiting.contains(Limit::Torque) { ticks.saturating_add(1) } else { 0 };
        }
        let longest = self.saturated_ticks?;
        let joint = saturated.iter().take(self.joint_count).position(|&ticks| ticks > longest)?;
        Some(Raised::at(joint, Fault::SaturatedTooLong))
    }
}

impl<T: Real> JointWatch<T> {
    fn motion(&self, angle_rad: T, speed_rad_s: T, count_change: u32) -> Option<Fault> {
        if !(angle_rad.is_finite() && speed_rad_s.is_finite()) {
            return Some(Fault::NotFinite);
        }
        let change = T::from_i32(i32::try_from(count_change).unwrap_or(i32::MAX));
        if self.change.is_some_and(|largest| change > largest) {
            return Some(Fault::CountJump);
        }
        if self.range_rad.is_some_and(|(lower, upper)| angle_rad < lower || angle_rad > upper) {
            return Some(Fault::BeyondRange);
        }
        if self.speed_rad_s.is_some_and(|largest| speed_rad_s.magnitude() > largest) {
            return Some(Fault::Overspeed);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn numbers_are_what_they_always_were() {
        let numbers = [
            (1, Fault::SampleMissing),
            (2, Fault::NotFinite),
            (3, Fault::CountJump),
            (4, Fault::BeyondRange),
            (5, Fault::Overspeed),
            (6, Fault::SaturatedTooLong),
            (8, Fault::CounterReset),
            (9, Fault::OutputFailed),
        ];
        assert_eq!(numbers.len(), Fault::ALL.len());
        for (number, fault) in numbers {
            assert_eq!(fault.number(), number);
            assert_eq!(Fault::from_number(number), Some(fault));
            assert!(!fault.words().is_empty() && !fault.remedy().is_empty());
        }
        for number in [0, 7, 255] {
            assert_eq!(Fault::try_from(number), Err(UnknownFault(number)));
        }
    }

    #[test]
    fn a_fault_says_what_is_wrong_and_where() {
        let raised = Raised::at(3, Fault::Overspeed);
        assert_eq!(raised.to_string(), "fault 5: joint 3: speed is above its limit");
        assert_eq!(Raised::at(1000, Fault::Overspeed).joint, 255);
    }

    #[test]
    fn each_fault_of_the_motion_begins_where_it_is_set() {
        let watch = JointWatch { change: Some(600.0), speed_rad_s: Some(20.0), range_rad: Some((-1.0, 2.0)) };
        assert_eq!(watch.motion(2.0, 20.0, 600), None);
        assert_eq!(watch.motion(-1.0, -20.0, 0), None);
        assert_eq!(watch.motion(0.0, 0.0, 601), Some(Fault::CountJump));
        assert_eq!(watch.motion(0.0, 0.0, u32::MAX), Some(Fault::CountJump));
        assert_eq!(watch.motion(2.001, 0.0, 0), Some(Fault::BeyondRange));
        assert_eq!(watch.motion(-1.001, 0.0, 0), Some(Fault::BeyondRange));
        assert_eq!(watch.motion(0.0, 20.001, 0), Some(Fault::Overspeed));
        assert_eq!(watch.motion(0.0, -20.001, 0), Some(Fault::Overspeed));
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(watch.motion(bad, 0.0, 0), Some(Fault::NotFinite));
            assert_eq!(watch.motion(0.0, bad, 0), Some(Fault::NotFinite));
        }
        let off = JointWatch { change: None, speed_rad_s: None, range_rad: None };
        assert_eq!(off.motion(1e9, 1e9, u32::MAX), None);
    }

    #[test]
    fn saturation_is_a_fault_after_its_time_without_a_break() {
        let off = JointWatch::<f64> { change: None, speed_rad_s: None, range_rad: None };
        let watch = Watch { joint_count: 2, joints: [off; 2], saturated_ticks: Some(10) };
        let mut at_limit = Limiting::NONE;
        at_limit.insert(Limit::Torque);
        let mut saturated = [0; 2];
        for _ in 0..10 {
            assert_eq!(watch.saturation(&mut saturated, &[Limiting::NONE, at_limit]), None);
        }
        let mut interrupted = saturated;
        assert_eq!(watch.saturation(&mut interrupted, &[Limiting::NONE; 2]), None);
        assert_eq!(interrupted, [0, 0]);
        let raised = watch.saturation(&mut saturated, &[Limiting::NONE, at_limit]);
        assert_eq!(raised, Some(Raised::at(1, Fault::SaturatedTooLong)));
    }
}
