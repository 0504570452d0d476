//! Parameters that can be read and set one by one, over the link: every number of the configuration that belongs to
//! gains, limits and faults. What belongs to the hand itself is built in.

use crate::command::Refusal;
use crate::fault::FrozenConfig;
use crate::limit::StopConfig;
use crate::tick::{Config, Params};
use core::fmt;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// What the index of a parameter counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Each {
    /// Nothing: there is one, with index 0.
    Hand,
    /// The joints.
    Joint,
    /// The axes x, y, z.
    Axis,
}

/// Writes the enum and its tables from one line a parameter.
macro_rules! parameters {
    ($($name:ident, $each:ident, $key:literal, $words:literal;)*) => {
        /// A parameter.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        pub enum Parameter {
            $(#[doc = concat!($words, ".")] $name,)*
        }

        impl Parameter {
            /// Every parameter, in the order of their bytes on the wire.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Its name.
            pub const fn key(self) -> &'static str {
                match self { $(Self::$name => $key,)* }
            }

            /// What it is, with its unit.
            pub const fn words(self) -> &'static str {
                match self { $(Self::$name => $words,)* }
            }

            /// What its index counts.
            pub const fn each(self) -> Each {
                match self { $(Self::$name => Each::$each,)* }
            }
        }
    };
}

#[rustfmt::skip]
parameters! {
    Force,               Hand,  "force_n",                        "Nominal grasping force, N";
    AttitudeStiffness,   Hand,  "attitude_stiffness_nm",          "Stiffness of the relative attitudes, N m";
    IntegralGain,        Hand,  "integral_gain_nm_rad",           "Gain of the earlier law's integral of each joint's velocity, N m/rad";
    Damping,             Joint, "damping_nm_s",                   "Damping of a joint, N m s/rad";
    Gravity,             Axis,  "gravity_m_s2",                   "Gravity in the base frame, m/s^2";
    EstimatorBandwidth,  Hand,  "estimator.bandwidth_hz",         "Bandwidth of the estimator, Hz";
    ForceLimit,          Hand,  "limits.force_n",                 "Largest nominal grasping force, N";
    StiffnessLimit,      Hand,  "limits.attitude_stiffness_nm",   "Largest attitude stiffness, N m";
    IntegralLimit,       Hand,  "limits.integral_gain_nm_rad",    "Largest gain of the integral, N m/rad";
    TorqueLimit,         Joint, "limits.torque_nm",               "Largest torque of a joint, N m";
    SlewLimit,           Joint, "limits.slew_nm_s",               "Largest change of a joint's torque, N m/s";
    StopMargin,          Joint, "limits.stops.margin_rad",        "Where a soft end stop begins before its end, rad";
    StopStiffness,       Joint, "limits.stops.stiffness_nm_rad",  "Stiffness of a soft end stop, N m/rad";
    StopDamping,         Joint, "limits.stops.damping_nm_s",      "Damping of a soft end stop, N m s/rad";
    PossibleSpeed,       Joint, "faults.possible_speed_rad_s",    "Speed that a joint can't reach, rad/s";
    SpeedLimit,          Joint, "faults.speed_limit_rad_s",       "Speed that a joint must not reach, rad/s";
    RangeSlack,          Hand,  "faults.range_slack_rad",         "How far a joint may be beyond its range, rad";
    SaturatedTime,       Hand,  "faults.saturated_ms",            "How long a torque may stay at its limit, ms";
    FrozenTorque,        Joint, "faults.frozen_torque_nm",        "Change of torque that is too much for a joint that stands still, N m";
    FrozenNeighbour,     Hand,  "faults.frozen_neighbour_rad",    "Turn of a neighbour that is too much for a joint that stands still, rad";
    FrozenTime,          Hand,  "faults.frozen_ms",               "Shortest standstill that counts, ms";
    HeartbeatTime,       Hand,  "faults.heartbeat_ms",            "How long the heartbeat may fail, ms";
    LateTicks,           Hand,  "faults.late_ticks",              "How many ticks in a row may be late";
    Energy,              Hand,  "faults.energy_j",                "Work in a second that the joints may do beyond the drop of the law's potentials, J";
    SoftStartTime,       Hand,  "supervisor.soft_start_ms",       "Time over which the force grows, ms";
    ReleaseTime,         Hand,  "supervisor.release_ms",          "Time over which force and stiffness fall, ms";
    AmplifierStartTime,  Hand,  "supervisor.amplifier_start_ms",  "Time that the amplifiers take to start, at least that of the hand's file, ms";
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.key())
    }
}

/// Where a parameter is kept.
enum Slot<'a> {
    Real(&'a mut f32),
    Whole(&'a mut u32),
}

impl Slot<'_> {
    fn put(self, value: f32) -> Result<(), Refusal> {
        match self {
            Self::Real(slot) => *slot = value,
            Self::Whole(slot) => {
                let whole = value as u32;
                if whole as f32 != value {
                    return Err(Refusal::OutOfRange);
                }
                *slot = whole;
            }
        }
        Ok(())
    }
}

impl<const J: usize, const F: usize> Params<f32, J, F> {
    /// Reads a parameter. Times in ms are whole numbers.
    ///
    /// # Errors
    /// There is no such parameter, or what it belongs to is switched off.
    pub fn get(&self, parameter: Parameter, index: u8) -> Result<f32, Refusal> {
        let mut config = *self.config();
        Ok(match slot(&mut config, self.hand().joint_count(), parameter, index)? {
            Slot::Real(value) => *value,
            Slot::Whole(value) => *value as f32,
        })
    }

    /// Sets a parameter, if it can be used with all the others.
    ///
    /// # Errors
    /// There is no such parameter, what it belongs to is switched off, or the value is not finite, not whole where it
    /// has to be, or out of its range. Nothing changes then.
    pub fn set(&mut self, parameter: Parameter, index: u8, value: f32) -> Result<(), Refusal> {
        if !value.is_finite() {
            return Err(Refusal::NotFinite);
        }
        let mut config = *self.config();
        slot(&mut config, self.hand().joint_count(), parameter, index)?.put(value)?;
        self.configure(&config).map_err(|_| Refusal::OutOfRange)
    }
}

impl<const J: usize> Config<f32, J> {
    /// Puts a parameter in, without looking at the others: [`Params::new`] does. `None` switches off what it belongs to,
    /// with all its joints and parameters; a value switches it on, with zeros for the rest.
    ///
    /// # Errors
    /// There is no such parameter, it can't be switched off, or it is a whole number and the value is none.
    pub fn put(
        &mut self,
        joint_count: usize,
        parameter: Parameter,
        index: u8,
        value: Option<f32>,
    ) -> Result<(), Refusal> {
        self.switch(parameter, value.is_some())?;
        let Some(value) = value else { return Ok(()) };
        slot(self, joint_count, parameter, index)?.put(value)
    }

    /// Switches on, if it is off, or off what a parameter belongs to.
    fn switch(&mut self, parameter: Parameter, on: bool) -> Result<(), Refusal> {
        fn turn<T>(switched: &mut Option<T>, on: bool, blank: T) {
            if on {
                switched.get_or_insert(blank);
            } else {
                *switched = None;
            }
        }
        let zeros = [0.0; J];
        let Self { law, limits, faults, .. } = self;
        match parameter {
            Parameter::Force
            | Parameter::AttitudeStiffness
            | Parameter::IntegralGain
            | Parameter::Damping
            | Parameter::EstimatorBandwidth
            | Parameter::SoftStartTime
            | Parameter::ReleaseTime
            | Parameter::AmplifierStartTime => return if on { Ok(()) } else { Err(Refusal::OutOfRange) },
            Parameter::Gravity => turn(&mut law.gravity_m_s2, on, Vector3::zeros()),
            Parameter::ForceLimit => turn(&mut limits.force_n, on, 0.0),
            Parameter::StiffnessLimit => turn(&mut limits.attitude_stiffness_nm, on, 0.0),
            Parameter::IntegralLimit => turn(&mut limits.integral_gain_nm_rad, on, 0.0),
            Parameter::TorqueLimit => turn(&mut limits.torque_nm, on, zeros),
            Parameter::SlewLimit => turn(&mut limits.slew_nm_s, on, zeros),
            Parameter::StopMargin | Parameter::StopStiffness | Parameter::StopDamping => {
                let blank = StopConfig { margin_rad: zeros, stiffness_nm_rad: zeros, damping_nm_s: zeros };
                turn(&mut limits.stops, on, blank);
            }
            Parameter::PossibleSpeed => turn(&mut faults.possible_speed_rad_s, on, zeros),
            Parameter::SpeedLimit => turn(&mut faults.speed_limit_rad_s, on, zeros),
            Parameter::RangeSlack => turn(&mut faults.range_slack_rad, on, 0.0),
            Parameter::SaturatedTime => turn(&mut faults.saturated_ms, on, 0),
            Parameter::FrozenTorque | Parameter::FrozenNeighbour | Parameter::FrozenTime => {
                turn(
                    &mut faults.frozen,
                    on,
                    FrozenConfig { torque_nm: zeros, neighbour_rad: 0.0, after_ms: 0 },
                );
            }
            Parameter::HeartbeatTime => turn(&mut faults.heartbeat_ms, on, 0),
            Parameter::LateTicks => turn(&mut faults.late_ticks, on, 0),
            Parameter::Energy => turn(&mut faults.energy_j, on, 0.0),
        }
        Ok(())
    }
}

/// Where a parameter is kept in a configuration.
fn slot<const J: usize>(
    config: &mut Config<f32, J>,
    joint_count: usize,
    parameter: Parameter,
    index: u8,
) -> Result<Slot<'_>, Refusal> {
    let k = usize::from(index);
    let count = match parameter.each() {
        Each::Hand => 1,
        Each::Joint => joint_count,
        Each::Axis => 3,
    };
    if k >= count {
        return Err(Refusal::NoSuchParameter);
    }
    let Config { estimator, law, limits, faults, supervisor, .. } = config;
    let slot = match parameter {
        Parameter::Force => Some(Slot::Real(&mut law.force_n)),
        Parameter::AttitudeStiffness => Some(Slot::Real(&mut law.attitude_stiffness_nm)),
        Parameter::IntegralGain => Some(Slot::Real(&mut law.integral_gain_nm_rad)),
        Parameter::Damping => law.damping_nm_s.get_mut(k).map(Slot::Real),
        Parameter::Gravity => {
            law.gravity_m_s2.as_mut().and_then(|gravity| gravity.as_mut_slice().get_mut(k)).map(Slot::Real)
        }
        Parameter::EstimatorBandwidth => Some(Slot::Real(&mut estimator.bandwidth_hz)),
        Parameter::ForceLimit => limits.force_n.as_mut().map(Slot::Real),
        Parameter::StiffnessLimit => limits.attitude_stiffness_nm.as_mut().map(Slot::Real),
        Parameter::IntegralLimit => limits.integral_gain_nm_rad.as_mut().map(Slot::Real),
        Parameter::TorqueLimit => joint(limits.torque_nm.as_mut(), k),
        Parameter::SlewLimit => joint(limits.slew_nm_s.as_mut(), k),
        Parameter::StopMargin => joint(limits.stops.as_mut().map(|stops| &mut stops.margin_rad), k),
        Parameter::StopStiffness => joint(limits.stops.as_mut().map(|stops| &mut stops.stiffness_nm_rad), k),
        Parameter::StopDamping => joint(limits.stops.as_mut().map(|stops| &mut stops.damping_nm_s), k),
        Parameter::PossibleSpeed => joint(faults.possible_speed_rad_s.as_mut(), k),
        Parameter::SpeedLimit => joint(faults.speed_limit_rad_s.as_mut(), k),
        Parameter::RangeSlack => faults.range_slack_rad.as_mut().map(Slot::Real),
        Parameter::SaturatedTime => faults.saturated_ms.as_mut().map(Slot::Whole),
        Parameter::FrozenTorque => joint(faults.frozen.as_mut().map(|frozen| &mut frozen.torque_nm), k),
        Parameter::FrozenNeighbour => {
            faults.frozen.as_mut().map(|frozen| Slot::Real(&mut frozen.neighbour_rad))
        }
        Parameter::FrozenTime => faults.frozen.as_mut().map(|frozen| Slot::Whole(&mut frozen.after_ms)),
        Parameter::HeartbeatTime => faults.heartbeat_ms.as_mut().map(Slot::Whole),
        Parameter::LateTicks => faults.late_ticks.as_mut().map(Slot::Whole),
        Parameter::Energy => faults.energy_j.as_mut().map(Slot::Real),
        Parameter::SoftStartTime => Some(Slot::Whole(&mut supervisor.soft_start_ms)),
        Parameter::ReleaseTime => Some(Slot::Whole(&mut supervisor.release_ms)),
        Parameter::AmplifierStartTime => Some(Slot::Whole(&mut supervisor.amplifier_start_ms)),
    };
    slot.ok_or(Refusal::SwitchedOff)
}

fn joint<const J: usize>(values: Option<&mut [f32; J]>, k: usize) -> Option<Slot<'_>> {
    values.and_then(|values| values.get_mut(k)).map(Slot::Real)
}
