//! Numbered faults, and what finds them (`watch`).
//!
//! A fault takes all torque away in the tick that finds it; only the loss of the link lets the object go slowly first.
//! It is kept until it is cleared; the one that came first is the one that is reported. A fault's number never changes
//! and is never used again for another.
//!
//! Limits ([`limit`](crate::limit)) are no faults; a joint whose torque stays at its limit for long is one.

mod watch;

pub use watch::{Driven, FaultConfig, Watch, Watched};

use core::fmt;
use serde::{Deserialize, Serialize};

/// Writes the enum and its tables from one line a fault.
macro_rules! faults {
    ($($name:ident = $number:literal, $reaction:ident, $words:literal, $found:literal, $remedy:literal;)*) => {
        /// A fault. On the wire it is its number.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(into = "u8", try_from = "u8")]
        #[repr(u8)]
        pub enum Fault {
            $(#[doc = concat!("\"", $words, "\"")] $name = $number,)*
        }

        impl Fault {
            /// Every fault, in the order of the numbers.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Its number, for ever.
            pub const fn number(self) -> u8 {
                self as u8
            }

            /// Returns the reaction to it at once.
            pub const fn reaction(self) -> Reaction {
                match self { $(Self::$name => Reaction::$reaction,)* }
            }

            /// Returns the fault, in words.
            pub const fn words(self) -> &'static str {
                match self { $(Self::$name => $words,)* }
            }

            /// Returns how it is found, and how soon.
            pub const fn found(self) -> &'static str {
                match self { $(Self::$name => $found,)* }
            }

            /// Returns the remedy.
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

/// The reaction to a fault in the tick that finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// The torque is taken away.
    TorqueOff,
    /// The object is let go over the release time; then the torque is taken away.
    Release,
}

#[rustfmt::skip]
faults! {
    SampleMissing    =  1, TorqueOff, "encoder gave no sample",
        "in the tick whose reading failed",
        "check the encoder's wiring and supply";
    NotFinite        =  2, TorqueOff, "angle, speed or torque is not a finite number",
        "in the tick that computes it",
        "check the gains and the hand's file; report the record";
    CountJump        =  3, TorqueOff, "count changed by more than the joint can turn in a tick",
        "in the tick that reads it: a change above `faults.possible_speed_rad_s`",
        "check the encoder's wiring and screening; set the zero again";
    BeyondRange      =  4, TorqueOff, "angle is beyond its range",
        "in the tick that reads it: more than `faults.range_slack_rad` beyond an end stop",
        "move the joint back into its range; check its zero";
    Overspeed        =  5, TorqueOff, "speed is above its limit",
        "as soon as the estimated speed is above `faults.speed_limit_rad_s`; the estimate is late by the estimator's delay",
        "check what drives the joint; lower the force or raise the damping";
    SaturatedTooLong =  6, TorqueOff, "torque stayed at its limit for too long",
        "after `faults.saturated_ms` without a break",
        "look for a jam; lower the force";
    CounterFrozen    =  7, TorqueOff, "count stands still although torque and neighbours changed",
        "while grasping, after `faults.frozen_ms` without a count, once both the torque has changed by `faults.frozen_torque_nm`, what the soft start and the release change left out, and a neighbouring joint has turned by `faults.frozen_neighbour_rad` since; while nothing moves a frozen counter is right, and not found",
        "check the encoder and its coupling; look for a jam";
    CounterReset     =  8, TorqueOff, "encoder lost its settings",
        "one joint's settings are read back a tick: within as many ticks as there are joints",
        "check the encoder's supply; set the zero again";
    OutputFailed     =  9, TorqueOff, "amplifier's output does not answer",
        "by read-back, one tick after the writing; at the start by a self-test",
        "check the wiring and the supply of the outputs; the motor may have torque: switch its power off";
    LinkLost         = 10, Release,   "heartbeat of the host stopped",
        "after `faults.heartbeat_ms` without one",
        "check the cable and the host's program";
    TickLate         = 11, TorqueOff, "tick was late too often",
        "a late tick counts 10, each one in time takes 1 off again: above 10 times `faults.late_ticks`",
        "report the record; choose a longer period";
    TooMuchEnergy    = 12, TorqueOff, "joints put more energy into the world than they may",
        "in the tick in which the work of the last second (fading) is above the drop of the law's potentials by more than `faults.energy_j`: a swing that is fed by delays or limits. The work is reckoned from the torques that are asked for and the turns that are counted, so that a motor or an encoder the wrong way round looks like somebody who pushes",
        "lower the force or raise the damping; look for joints whose limits cut off what the law asks for";
    SupplyLow        = 13, TorqueOff, "supply of the microcontroller is too low",
        "in the tick after the supply monitor's threshold was passed; the amplifiers lose their power before that, at once",
        "check the supply, its wiring and what else draws from it";
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
    /// The joint; `None` for what concerns the whole hand.
    pub joint: Option<u8>,
}

impl Raised {
    /// A fault of a joint.
    pub fn at(joint: usize, fault: Fault) -> Self {
        Self { fault, joint: Some(u8::try_from(joint).unwrap_or(u8::MAX)) }
    }

    /// A fault of the whole hand.
    pub const fn of_hand(fault: Fault) -> Self {
        Self { fault, joint: None }
    }
}

impl fmt::Display for Raised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "fault {}: ", self.fault.number())?;
        if let Some(joint) = self.joint {
            write!(f, "joint {joint}: ")?;
        }
        write!(f, "{}", self.fault.words())
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
            (7, Fault::CounterFrozen),
            (8, Fault::CounterReset),
            (9, Fault::OutputFailed),
            (10, Fault::LinkLost),
            (11, Fault::TickLate),
            (12, Fault::TooMuchEnergy),
            (13, Fault::SupplyLow),
        ];
        assert_eq!(numbers.len(), Fault::ALL.len());
        for (number, fault) in numbers {
            assert_eq!(fault.number(), number);
            assert_eq!(Fault::from_number(number), Some(fault));
            assert!(!fault.words().is_empty() && !fault.remedy().is_empty());
        }
        for number in [0, 14, 255] {
            assert_eq!(Fault::try_from(number), Err(UnknownFault(number)));
        }
    }

    #[test]
    fn a_fault_says_what_is_wrong_and_where() {
        let raised = Raised::at(3, Fault::Overspeed);
        assert_eq!(raised.to_string(), "fault 5: joint 3: speed is above its limit");
        assert_eq!(Raised::at(1000, Fault::Overspeed).joint, Some(255));
        let raised = Raised::of_hand(Fault::LinkLost);
        assert_eq!(raised.to_string(), "fault 10: heartbeat of the host stopped");
    }
}
