//! A hand for the tests of the tick: three fingers of four joints, with the lengths and masses of the paper's Table IV.

#![allow(dead_code, reason = "each test file uses its part")]

use blindgrasp_shared::control::{AttitudeError, Chosen, FrameConfig, Hold, LawsConfig, PerGain};
use blindgrasp_shared::cycle::{CarryingConfig, ClosingConfig, CycleConfig, MovingConfig};
use blindgrasp_shared::estimate::{Encoder, EstimatorConfig};
use blindgrasp_shared::fault::FaultConfig;
use blindgrasp_shared::hand::{Fingertip, Hand, Joint, Link};
use blindgrasp_shared::joints::MotorConfig;
use blindgrasp_shared::limit::LimitConfig;
use blindgrasp_shared::math::Real;
use blindgrasp_shared::supervisor::SupervisorConfig;
use blindgrasp_shared::tick::{Config, Params};
use nalgebra::{Matrix3, Vector3};

/// Joints of the hand.
pub(crate) const JOINTS: usize = 12;

/// Counts of one radian: 4,000 counts a turn behind a gear of 5.4 : 1, 0.0167 degrees each.
pub(crate) const COUNTS_PER_RAD: f64 = 4000.0 * 5.4 / core::f64::consts::TAU;

/// Largest torque of a joint, N m.
pub(crate) const TORQUE_NM: f64 = 1.39;

/// Largest change of a joint's torque, N m/s.
pub(crate) const SLEW_NM_S: f64 = 100.0;

/// Angles with which the fingertips face each other, rad.
pub(crate) const FACING_RAD: [f64; 4] = [0.0, -0.5, 0.9, 0.8];

/// Angles with which there is room for an object between the fingertips, rad.
const APART_RAD: [f64; 4] = [0.0, -1.0, 0.9, 0.8];

fn vector(x: f64, y: f64, z: f64) -> Vector3<f32> {
    Vector3::new(x, y, z).map(|entry: f64| entry as f32)
}

/// The hand.
pub(crate) fn hand<const J: usize, const F: usize>() -> Hand<f32, J, F> {
    let mut joints = Vec::new();
    let mut fingertips = Vec::new();
    let half_root_of_three = 0.866_025_403_784_438_6;
    for (c, s) in [(1.0, 0.0), (-0.5, half_root_of_three), (-0.5, -half_root_of_three)] {
        let first = joints.len();
        // Local axes of a finger: x away from the palm's axis, z out of the palm.
        let azimuth = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0).map(|entry: f64| entry as f32);
        let flexion = vector(0.0, -1.0, 0.0);
        let link = |mass: f64, centre: f64, inertia: f64| Link {
            mass_kg: mass as f32,
            mass_centre_m: vector(0.0, 0.0, centre),
            inertia_kg_m2: Matrix3::identity() * inertia as f32,
        };
        let joint = |parent, z, axis, link| Joint {
            parent,
            offset_m: vector(0.0, 0.0, z),
            attitude: Matrix3::identity(),
            axis,
            lower_rad: -2.0,
            upper_rad: 2.0,
            link,
        };
        joints.push(Joint {
            offset_m: vector(0.035 * c, 0.035 * s, 0.0),
            attitude: azimuth,
            ..joint(None, 0.0, vector(-1.0, 0.0, 0.0), link(0.0, 0.0, 0.0))
        });
        joints.push(joint(Some(first), 0.0, flexion, link(0.038, 0.023, 1.3e-5)));
        joints.push(joint(Some(first + 1), 0.064, flexion, link(0.024, 0.035, 0.8e-5)));
        joints.push(joint(Some(first + 2), 0.064, flexion, link(0.054, 0.010, 0.4e-5)));
        let (offset_m, radius_m) = (vector(0.0, 0.0, 0.030), 0.015);
        fingertips.push(Fingertip { link: first + 3, offset_m, radius_m });
    }
    Hand::new(&joints, &fingertips).expect("the test's hand is a hand")
}

/// The gains of the paper's Table VII, and every limit and fault switched on.
pub(crate) fn config<const J: usize>() -> Config<J> {
    let encoder = Encoder { zero_count: 0, rad_per_count: 1.0 / COUNTS_PER_RAD as f32, reversed: false };
    let mut damping_nm_s = [0.0; J];
    for (k, damping) in damping_nm_s.iter_mut().enumerate().take(JOINTS) {
        *damping = [4e-4, 4e-4, 3e-4, 2e-4][k % 4];
    }
    Config {
        period_us: 1000,
        estimator: EstimatorConfig { bandwidth_hz: 100.0, encoders: [encoder; J] },
        motors: MotorConfig::FORWARD,
        laws: LawsConfig {
            gains: PerGain { grasp: [5.0, 5e-3], ..PerGain::all(0.0) },
            chosen: Chosen::ALL,
            frame: FrameConfig::least(),
            attitude_error: AttitudeError::Sine,
            hold: Hold { damping_nm_s, gravity_m_s2: Some(vector(0.0, 0.0, -9.81)) },
        },
        limits: LimitConfig {
            gains: PerGain { grasp: [Some(500.0), Some(0.1)], ..PerGain::all(Some(1.0)) },
            torque_nm: Some([TORQUE_NM as f32; J]),
            slew_nm_s: Some([SLEW_NM_S as f32; J]),
            stop_margin_rad: Some([0.1; J]),
            stop_stiffness_nm_rad: Some([2.0; J]),
            stop_damping_nm_s: Some([0.01; J]),
        },
        faults: FaultConfig {
            possible_speed_rad_s: Some([200.0; J]),
            speed_limit_rad_s: Some([20.0; J]),
            range_slack_rad: Some(0.05),
            saturated_ms: Some(200),
            frozen_torque_nm: Some([0.02; J]),
            frozen_neighbour_rad: Some(0.03),
            frozen_ms: Some(50),
            heartbeat_ms: None,
            late_ticks: Some(3),
            energy_j: Some(1.0),
        },
        supervisor: SupervisorConfig { soft_start_ms: 100, release_ms: 100, ..SupervisorConfig::LEAST },
        cycle: CycleConfig::LEAST,
    }
}

/// The same with all stages of the cycle.
pub(crate) fn cycle_config<const J: usize>() -> Config<J> {
    let earlier = config::<J>();
    Config {
        laws: LawsConfig {
            gains: PerGain { frame: [300.0, 0.3], ..earlier.laws.gains },
            frame: FrameConfig { damping_s: 0.027, turn_damping_s: 0.01, reach_m: 0.015 },
            ..earlier.laws
        },
        limits: LimitConfig {
            gains: PerGain { frame: [Some(1000.0), Some(1.0)], ..earlier.limits.gains },
            ..earlier.limits
        },
        cycle: CycleConfig {
            moving: MovingConfig {
                inertia_kg_m2: [1e-4; J],
                bandwidth_rad_s: 25.0,
                speed_rad_s: 2.0,
                integral_nm: 0.01,
            },
            closing: ClosingConfig { speed_m_s: 0.05, stiffness_n_m: 60.0, force_n: 0.2, damping_n_s_m: 2.5 },
            carrying: CarryingConfig {
                reach_m: 0.05,
                reach_rad: 0.8,
                speed_m_s: 0.1,
                speed_rad_s: 1.0,
                integral_n: 4.0,
                still_m: 3e-4,
                correction_hz: 1.0,
                put_down_m_s: 0.01,
                put_down_m: 0.01,
                put_down_n: 0.5,
            },
        },
        ..earlier
    }
}

/// The hand with a configuration.
pub(crate) fn params<const J: usize, const F: usize>(config: &Config<J>) -> Params<J, F> {
    Params::new(hand(), config).expect("the test's parameters are good")
}

/// Angles of all joints with the fingertips facing each other, rad.
pub(crate) fn facing_rad<T: Real, const J: usize>() -> [T; J] {
    let mut angles = [T::zero(); J];
    for (k, angle) in angles.iter_mut().enumerate().take(JOINTS) {
        *angle = T::from_f64(FACING_RAD[k % 4]);
    }
    angles
}

/// Counts of all joints with room for an object between the fingertips.
pub(crate) fn apart_counts<const J: usize>() -> [i32; J] {
    let mut counts = [0; J];
    for (k, count) in counts.iter_mut().enumerate().take(JOINTS) {
        *count = (APART_RAD[k % 4] * COUNTS_PER_RAD).round() as i32;
    }
    counts
}

/// Counts of all joints with the fingertips facing each other.
pub(crate) fn facing_counts<const J: usize>() -> [i32; J] {
    facing_rad::<f64, J>().map(|angle| (angle * COUNTS_PER_RAD).round() as i32)
}
