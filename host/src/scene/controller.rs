//! The controller's configuration, from the files: the one of a scene's closed loop, and the one of a hand's firmware.

use super::file::{Actuators, Control, JointFile, Sensors};
use crate::MAX_JOINTS;
use blindgrasp_shared::control::{Hold, LawsConfig};
use blindgrasp_shared::estimate::{Encoder, EstimatorConfig};
use blindgrasp_shared::fault::FaultConfig;
use blindgrasp_shared::limit::LimitConfig;
use blindgrasp_shared::math::Real;
use blindgrasp_shared::supervisor::SupervisorConfig;
use blindgrasp_shared::tick::Config;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A joint's whole torque comes or goes in this time at the least, s.
const SLEW_S: f64 = 0.01;
/// How far before its end stop a joint is slowed, rad; less in a joint of small range.
const STOP_MARGIN_RAD: f64 = 0.1;
/// What a soft end stop pushes back with once its margin is used up, as a share of the joint's torque limit.
const STOP_SHARE: f64 = 0.1;
/// How far a joint may be beyond its range before that is a fault, rad.
const RANGE_SLACK_RAD: f64 = 0.1;
/// How much faster than its motor a joint may seem to be before its counts are not believed.
const IMPOSSIBLE_SPEED: f64 = 1.5;
/// How long a torque may stay at its limit, ms.
const SATURATED_MS: u32 = 1000;
/// How many times as firmly as configured a user may grasp.
const FIRMEST: f64 = 4.0;
/// A counter that stands still is not believed for longer than this, ms, ...
const FROZEN_MS: u32 = 50;
/// ... once the torque changed by this share of its limit ...
const FROZEN_SHARE: f64 = 0.05;
/// ... and a neighbour turned by this, rad. Left alone, a grasp does not come near it: neighbours of joints that really
/// stood still turned by 0.011 rad at most. But somebody who pushes a fingertip of the cube or the prism by 0.25 to 2 N
/// bends the fingers so that a knee, whose angle is at its extremum, stands still while its neighbours turn by a tenth of a
/// radian and more. Of 72 such pushes that the grasp survives, these two numbers mistake none for a frozen counter
/// (`tests/tests/faults.rs`); a share of 0.02 and 0.03 rad mistook one in four or five, and found fewer of the counters that
/// really were frozen.
const FROZEN_NEIGHBOUR_RAD: f64 = 0.1;
/// What the joints do in a second beyond the law's potentials is at most the work of all torque limits over this angle, rad:
/// 50 mJ for the three-fingered hand, what a stretched finger has at 9 rad/s. Hands that hold, pushed ones included, stay
/// below a fiftieth of that (`tests/tests/ledger.rs`); hands that ring after a hard touch, and then hold, below two thirds.
const ENERGY_TRAVEL_RAD: f64 = 3e-3;
/// How long letting go takes, ms.
const RELEASE_MS: u32 = 300;

/// What the configuration follows from.
pub(super) struct Setup<'a> {
    pub(super) joints: &'a [JointFile],
    pub(super) control: &'a Control,
    pub(super) sensors: &'a Sensors,
    pub(super) actuators: &'a Actuators,
    /// Gravity in the hand's base frame, m/s^2.
    pub(super) gravity_m_s2: [f64; 3],
}

impl Setup<'_> {
    /// The laws, in either precision.
    pub(super) fn laws<T: Real>(&self) -> LawsConfig<T, MAX_JOINTS> {
        let gravity = || Vector3::from(self.gravity_m_s2).map(T::from_f64);
        LawsConfig {
            gains: self.control.gains.map(|&gain| T::from_f64(gain)),
            chosen: self.control.laws,
            hold: Hold {
                damping_nm_s: self.each(|joint| self.damping_nm_s(joint)),
                gravity_m_s2: self.control.gravity_compensation.then(gravity),
            },
        }
    }

    /// Everything that the tick needs.
    pub(super) fn config(&self) -> Config<MAX_JOINTS> {
        let &Self { control, sensors, actuators, .. } = self;
        let (watched, limited, stops) = (!sensors.ideal, actuators.torque_limits, control.end_stops);
        Config {
            period_us: (control.period_s * 1e6).round() as u32,
            estimator: EstimatorConfig {
                bandwidth_hz: control.estimator_bandwidth_hz as f32,
                encoders: std::array::from_fn(|k| {
                    self.joints.get(k).map_or(Encoder::default(), |joint| Encoder {
                        zero_count: 0,
                        rad_per_count: (TAU / joint.encoder_counts_per_turn) as f32,
                        reversed: false,
                    })
                }),
            },
            laws: self.laws(),
            limits: LimitConfig {
                gains: control.gains.map(|gain| limited.then_some((FIRMEST * gain) as f32)),
                torque_nm: limited.then(|| self.each(|joint| joint.torque_limit_nm)),
                slew_nm_s: match actuators.slew_limit_nm_s {
                    Some(limit) => Some(self.each(|_| limit)),
                    None if actuators.torque_limits => {
                        Some(self.each(|joint| joint.torque_limit_nm / SLEW_S))
                    }
                    None => None,
                },
                stop_margin_rad: stops.then(|| self.each(stop_margin_rad)),
                stop_stiffness_nm_rad: stops
                    .then(|| self.each(|joint| STOP_SHARE * joint.torque_limit_nm / stop_margin_rad(joint))),
                stop_damping_nm_s: stops.then(|| self.each(|joint| 10.0 * self.damping_nm_s(joint))),
            },
            faults: FaultConfig {
                possible_speed_rad_s: watched
                    .then(|| self.each(|joint| IMPOSSIBLE_SPEED * joint.speed_limit_rad_s)),
                speed_limit_rad_s: watched.then(|| self.each(|joint| joint.speed_limit_rad_s)),
                range_slack_rad: control.end_stops.then_some(RANGE_SLACK_RAD as f32),
                saturated_ms: limited.then_some(SATURATED_MS),
                frozen_torque_nm: (watched && limited)
                    .then(|| self.each(|joint| FROZEN_SHARE * joint.torque_limit_nm)),
                frozen_neighbour_rad: (watched && limited).then_some(FROZEN_NEIGHBOUR_RAD as f32),
                frozen_ms: (watched && limited).then_some(FROZEN_MS),
                heartbeat_ms: None,
                late_ticks: None,
                energy_j: limited.then(|| {
                    let torques: f64 = self.joints.iter().map(|joint| joint.torque_limit_nm).sum();
                    (ENERGY_TRAVEL_RAD * torques) as f32
                }),
            },
            supervisor: SupervisorConfig {
                soft_start_ms: (control.soft_start_s * 1e3).round() as u32,
                release_ms: RELEASE_MS,
            },
        }
    }

    /// Gain `C` of Eq. 30, with the factor, N m s/rad.
    fn damping_nm_s(&self, joint: &JointFile) -> f64 {
        joint.damping_gain_nm_s_rad * self.control.damping_scale
    }

    /// A value of each of the hand's joints; zero beyond them.
    fn each<T: Real>(&self, value: impl Fn(&JointFile) -> f64) -> [T; MAX_JOINTS] {
        std::array::from_fn(|k| self.joints.get(k).map_or(T::zero(), |joint| T::from_f64(value(joint))))
    }
}

fn stop_margin_rad(joint: &JointFile) -> f64 {
    let [lower, upper] = joint.limits_rad;
    STOP_MARGIN_RAD.min((upper - lower) / 8.0)
}
