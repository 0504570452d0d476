//! The controller's configuration, from the files: the one of a scene's closed loop, and the one of a hand's firmware.

use super::file::{Actuators, Control, JointFile, Safety, Sensors};
use super::hand::posture;
use blindgrasp_body::dynamics::{Body, mass_matrix, place_bodies};
use blindgrasp_body::{Hand, MAX_JOINTS};
use blindgrasp_shared::control::{FrameConfig, Hold, LawsConfig};
use blindgrasp_shared::cycle::{CarryingConfig, ClosingConfig, CycleConfig, MovingConfig};
use blindgrasp_shared::estimate::{Encoder, EstimatorConfig};
use blindgrasp_shared::fault::FaultConfig;
use blindgrasp_shared::joints::MotorConfig;
use blindgrasp_shared::limit::LimitConfig;
use blindgrasp_shared::math::Real;
use blindgrasp_shared::supervisor::SupervisorConfig;
use blindgrasp_shared::tick::Config;
use nalgebra::{DMatrix, Vector3};
use std::f64::consts::TAU;

/// The data that the configuration follows from.
pub(super) struct Setup<'a> {
    pub(super) hand: &'a Hand,
    pub(super) joints: &'a [JointFile],
    pub(super) control: &'a Control,
    pub(super) safety: &'a Safety,
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
            frame: FrameConfig {
                damping_s: T::from_f64(self.control.frame_damping_s),
                turn_damping_s: T::from_f64(self.control.frame_turn_damping_s),
                reach_m: T::from_f64(self.control.frame_reach_m),
            },
            attitude_error: self.control.attitude_error,
            hold: Hold {
                damping_nm_s: self.each(|joint| self.damping_nm_s(joint)),
                gravity_m_s2: self.control.gravity_compensation.then(gravity),
            },
        }
    }

    /// Everything that the tick needs.
    pub(super) fn config(&self) -> Config<MAX_JOINTS> {
        let &Self { control, safety, sensors, actuators, .. } = self;
        let margin_rad = |joint: &JointFile| stop_margin_rad(safety, joint);
        let (watched, limited, stops) = (!sensors.ideal, actuators.torque_limits, control.end_stops);
        Config {
            period_us: (control.period_s * 1e6).round() as u32,
            estimator: EstimatorConfig {
                bandwidth_hz: control.estimator_bandwidth_hz as f32,
                encoders: std::array::from_fn(|k| {
                    self.joints.get(k).map_or(Encoder::default(), |joint| Encoder {
                        zero_count: joint.encoder_zero_count,
                        rad_per_count: (TAU / joint.encoder_counts_per_turn) as f32,
                        reversed: joint.encoder_reversed,
                    })
                }),
            },
            motors: MotorConfig {
                reversed: std::array::from_fn(|k| {
                    self.joints.get(k).is_some_and(|joint| joint.motor_reversed)
                }),
            },
            laws: self.laws(),
            limits: LimitConfig {
                gains: control.gains.map(|gain| limited.then_some((safety.firmest_factor * gain) as f32)),
                torque_nm: limited.then(|| self.each(|joint| joint.torque_limit_nm)),
                slew_nm_s: match actuators.slew_limit_nm_s {
                    Some(limit) => Some(self.each(|_| limit)),
                    None if actuators.torque_limits => {
                        Some(self.each(|joint| joint.torque_limit_nm / safety.slew_s))
                    }
                    None => None,
                },
                stop_margin_rad: stops.then(|| self.each(margin_rad)),
                stop_stiffness_nm_rad: stops.then(|| {
                    self.each(|joint| safety.stop_torque_share * joint.torque_limit_nm / margin_rad(joint))
                }),
                stop_damping_nm_s: stops
                    .then(|| self.each(|joint| safety.stop_damping_factor * self.damping_nm_s(joint))),
            },
            faults: FaultConfig {
                possible_speed_rad_s: watched
                    .then(|| self.each(|joint| safety.impossible_speed_factor * joint.speed_limit_rad_s)),
                speed_limit_rad_s: watched.then(|| self.each(|joint| joint.speed_limit_rad_s)),
                range_slack_rad: control.end_stops.then_some(safety.range_slack_rad as f32),
                saturated_ms: limited.then_some(safety.saturated_ms),
                frozen_torque_nm: (watched && limited)
                    .then(|| self.each(|joint| safety.frozen_torque_share * joint.torque_limit_nm)),
                frozen_neighbour_rad: (watched && limited).then_some(safety.frozen_neighbour_rad as f32),
                frozen_ms: (watched && limited).then_some(safety.frozen_ms),
                heartbeat_ms: None,
                late_ticks: None,
                energy_j: limited.then(|| {
                    let torques: f64 = self.joints.iter().map(|joint| joint.torque_limit_nm).sum();
                    (safety.energy_travel_rad * torques) as f32
                }),
            },
            supervisor: SupervisorConfig {
                soft_start_ms: (control.soft_start_s * 1e3).round() as u32,
                release_ms: safety.release_ms,
                amplifier_start_ms: control.amplifier_start_ms,
            },
            cycle: self.cycle(),
        }
    }

    /// The stages of the cycle.
    fn cycle(&self) -> CycleConfig<MAX_JOINTS> {
        let control = self.control;
        let friction_nm = self.joints.iter().map(|joint| joint.coulomb_friction_nm).fold(0.0, f64::max);
        CycleConfig {
            moving: MovingConfig {
                inertia_kg_m2: self.felt_inertias_kg_m2(),
                bandwidth_rad_s: control.moving_bandwidth_rad_s as f32,
                speed_rad_s: control.moving_speed_rad_s as f32,
                integral_nm: (control.moving_integral_factor * friction_nm) as f32,
            },
            closing: ClosingConfig {
                speed_m_s: control.closing_speed_m_s as f32,
                stiffness_n_m: control.closing_stiffness_n_m as f32,
                force_n: control.closing_force_n as f32,
                damping_n_s_m: control.closing_damping_n_s_m as f32,
            },
            carrying: CarryingConfig {
                reach_m: control.carrying_reach_m as f32,
                reach_rad: control.carrying_reach_rad as f32,
                speed_m_s: control.carrying_speed_m_s as f32,
                speed_rad_s: control.carrying_speed_rad_s as f32,
                integral_n: control.carrying_integral_n as f32,
                correction_hz: control.carrying_correction_hz as f32,
                still_m: control.carrying_still_m as f32,
                put_down_m_s: control.carrying_put_down_m_s as f32,
                put_down_m: control.carrying_put_down_m as f32,
                put_down_n: control.carrying_put_down_n as f32,
            },
        }
    }

    /// Inertia that each joint feels in the nominal posture with the others free, `1 / (M^-1)_kk` with the rotors in `M`, kg m^2.
    /// Its own, `M_kk`, is several times as much, with which a joint that is moved swings.
    fn felt_inertias_kg_m2(&self) -> [f32; MAX_JOINTS] {
        let count = self.joints.len();
        let nominal: Vec<f64> = self.joints.iter().map(|joint| joint.nominal_rad).collect();
        let (mut bodies, mut mass) = ([Body::NONE; MAX_JOINTS], [[0.0; MAX_JOINTS]; MAX_JOINTS]);
        place_bodies(self.hand, &posture(self.hand, &nominal), &mut bodies);
        mass_matrix(self.hand, &bodies, &mut mass);
        let full = DMatrix::from_fn(count, count, |a, b| {
            let rotor = if a == b { self.joints[a].rotor_inertia_kg_m2 } else { 0.0 };
            rotor + mass[a.max(b)][a.min(b)]
        });
        // A hand whose links have no mass has no inverse, and nothing to move.
        let inverse = full.cholesky().map(|factor| factor.inverse());
        std::array::from_fn(|k| match &inverse {
            Some(inverse) if k < count => (1.0 / inverse[(k, k)]) as f32,
            _ => 0.0,
        })
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

/// Width of a joint's soft end stop, rad.
pub(super) fn stop_margin_rad(safety: &Safety, joint: &JointFile) -> f64 {
    let [lower, upper] = joint.limits_rad;
    safety.stop_margin_rad.min((upper - lower) / 8.0)
}
