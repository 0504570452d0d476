//! The controller of the hand as the simulation sees it: encoders in front of the tick, the tick in `f32`.

use crate::plant::dynamics::JointVector;
use crate::scene::Scene;
use crate::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::control::GraspConfig;
use blindgrasp_shared::estimate::{Encoder, EstimatorConfig};
use blindgrasp_shared::fault::{FaultConfig, FrozenConfig};
use blindgrasp_shared::limit::{LimitConfig, StopConfig};
use blindgrasp_shared::math::Real;
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::supervisor::SupervisorConfig;
use blindgrasp_shared::tick::{Config, Input, Output, Params, State, tick};
use nalgebra::Vector3;
use std::f64::consts::TAU;

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
const FROZEN_SHARE: f64 = 0.02;
/// ... and a neighbour turned by this, rad. In grasps of the prism and the cube, with up to three times the friction and
/// twice the force, neighbours of joints that really stood still turned by 0.011 rad at most.
const FROZEN_NEIGHBOUR_RAD: f64 = 0.03;
/// The work of a second is at most that of all torque limits over this angle, rad.
const ENERGY_TRAVEL_RAD: f64 = 0.1;
/// How long letting go takes, ms.
const RELEASE_MS: u32 = 300;

/// Encoders and the tick.
pub(super) struct Controller {
    params: Params<f32, MAX_JOINTS, MAX_FINGERS>,
    state: State<f32, MAX_JOINTS, MAX_FINGERS>,
    output: Option<Output<f32, MAX_JOINTS>>,
    started: bool,
    force_n: f32,
    ideal: bool,
    counts_per_rad: JointVector,
    noise_counts: f64,
    noise: fastrand::Rng,
    joint_names: Vec<String>,
}

impl Controller {
    pub(super) fn new(scene: &Scene) -> Result<Self, ParameterError> {
        let config = config(scene);
        let mut counts_per_rad = [0.0; MAX_JOINTS];
        for (counts, joint) in counts_per_rad.iter_mut().zip(&scene.joints) {
            *counts = joint.encoder_counts_per_turn / TAU;
        }
        Ok(Self {
            params: Params::new(scene.hand.cast(), &config)?,
            state: State::new(),
            output: None,
            started: false,
            force_n: config.law.force_n,
            ideal: scene.sensors.ideal,
            counts_per_rad,
            noise_counts: scene.sensors.noise_counts,
            noise: fastrand::Rng::with_seed(u64::from(scene.seed)),
            joint_names: scene.joints.iter().map(|joint| joint.name.clone()).collect(),
        })
    }

    /// Arms the hand while it stands still.
    pub(super) fn arm(&mut self, angles_rad: &JointVector) {
        self.step(angles_rad, &[0.0; MAX_JOINTS], Some(Command::Arm));
    }

    /// One tick; the first is told to grasp.
    pub(super) fn tick(&mut self, angles_rad: &JointVector, speeds_rad_s: &JointVector) {
        let command = if self.started { None } else { Some(Command::Grasp(Grasp::CONFIGURED)) };
        self.started = true;
        self.step(angles_rad, speeds_rad_s, command);
    }

    fn step(&mut self, angles_rad: &JointVector, speeds_rad_s: &JointVector, command: Option<Command>) {
        let output = if self.ideal {
            let (angles, speeds) = (angles_rad.map(|v| v as f32), speeds_rad_s.map(|v| v as f32));
            tick(&self.params, &mut self.state, &Input::ideal(&angles, &speeds, command))
        } else {
            let counts = self.read_encoders(angles_rad);
            tick(&self.params, &mut self.state, &Input::counts(&counts, command))
        };
        self.output = Some(output);
    }

    fn read_encoders(&mut self, angles_rad: &JointVector) -> [i32; MAX_JOINTS] {
        let mut counts = [0; MAX_JOINTS];
        for k in 0..self.joint_names.len() {
            let noise = if self.noise_counts > 0.0 { self.noise_counts * self.normal() } else { 0.0 };
            counts[k] = (angles_rad[k] * self.counts_per_rad[k] + noise).round() as i32;
        }
        counts
    }

    /// A normally distributed number: the sum of twelve uniform ones, which has variance one.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.noise.f64()).sum::<f64>() - 6.0
    }

    /// Torques that the last tick put out, N m.
    pub(super) fn torques_nm(&self) -> JointVector {
        self.output.as_ref().map_or([0.0; MAX_JOINTS], |output| output.torques_nm.map(f64::from))
    }

    /// Estimated angles, rad, and speeds, rad/s.
    pub(super) fn estimate(&self) -> (JointVector, JointVector) {
        (self.state.angles_rad().map(f64::from), self.state.speeds_rad_s().map(f64::from))
    }

    /// Share of `f_d` that acts.
    pub(super) fn force_share(&self) -> f64 {
        match &self.output {
            Some(output) if self.force_n > 0.0 => f64::from(output.record.force_n / self.force_n),
            _ => 0.0,
        }
    }

    /// Mode, in words.
    pub(super) fn mode(&self) -> &'static str {
        self.state.mode().words()
    }

    /// The fault that the hand is in, in words.
    pub(super) fn fault(&self) -> Option<String> {
        let raised = self.state.fault()?;
        let joint = raised.joint.and_then(|joint| self.joint_names.get(usize::from(joint)));
        let joint = joint.map_or(String::new(), |name| format!("joint `{name}`: "));
        Some(format!("fault {}: {joint}{}", raised.fault.number(), raised.fault.words()))
    }
}

/// Gains of the law, in either precision.
pub(super) fn grasp_config<T: Real>(scene: &Scene) -> GraspConfig<T, MAX_JOINTS> {
    GraspConfig {
        force_n: T::from_f64(scene.control.force_n),
        attitude_stiffness_nm: T::from_f64(scene.control.attitude_stiffness_nm),
        damping_nm_s: each(scene, 0.0, |k| scene.joints[k].damping_gain_nm_s_rad),
        gravity_m_s2: scene
            .control
            .gravity_compensation
            .then(|| Vector3::from(scene.plant.gravity_m_s2).map(T::from_f64)),
    }
}

/// Everything that the tick needs, as the scene has it.
fn config(scene: &Scene) -> Config<f32, MAX_JOINTS> {
    let joint_files = &scene.file.hand.joints;
    let range = |k: usize| joint_files[k].limits_rad[1] - joint_files[k].limits_rad[0];
    let margin = |k: usize| STOP_MARGIN_RAD.min(range(k) / 8.0);
    let stops = scene.control.end_stops.then(|| StopConfig {
        margin_rad: each(scene, 1.0, margin),
        stiffness_nm_rad: each(scene, 0.0, |k| STOP_SHARE * joint_files[k].torque_limit_nm / margin(k)),
        damping_nm_s: each(scene, 0.0, |k| 10.0 * scene.joints[k].damping_gain_nm_s_rad),
    });
    let watched = !scene.sensors.ideal;
    Config {
        period_us: (scene.control.period_s * 1e6).round() as u32,
        estimator: EstimatorConfig {
            bandwidth_hz: scene.control.estimator_bandwidth_hz as f32,
            encoders: std::array::from_fn(|k| Encoder {
                zero_count: 0,
                rad_per_count: scene
                    .joints
                    .get(k)
                    .map_or(1.0, |joint| (TAU / joint.encoder_counts_per_turn) as f32),
                reversed: false,
            }),
        },
        law: grasp_config(scene),
        limits: LimitConfig {
            force_n: scene.actuators.torque_limits.then_some((FIRMEST * scene.control.force_n) as f32),
            attitude_stiffness_nm: scene
                .actuators
                .torque_limits
                .then_some((FIRMEST * scene.control.attitude_stiffness_nm) as f32),
            torque_nm: scene
                .actuators
                .torque_limits
                .then(|| each(scene, 1.0, |k| scene.joints[k].torque_limit_nm)),
            slew_nm_s: scene.actuators.slew_limit_nm_s.map(|limit| each(scene, limit, |_| limit)),
            stops,
        },
        faults: FaultConfig {
            possible_speed_rad_s: watched
                .then(|| each(scene, 1.0, |k| IMPOSSIBLE_SPEED * scene.joints[k].speed_limit_rad_s)),
            speed_limit_rad_s: watched.then(|| each(scene, 1.0, |k| scene.joints[k].speed_limit_rad_s)),
            range_slack_rad: scene.control.end_stops.then_some(RANGE_SLACK_RAD as f32),
            saturated_ms: scene.actuators.torque_limits.then_some(SATURATED_MS),
            frozen: (watched && scene.actuators.torque_limits).then(|| FrozenConfig {
                torque_nm: each(scene, 1.0, |k| FROZEN_SHARE * scene.joints[k].torque_limit_nm),
                neighbour_rad: FROZEN_NEIGHBOUR_RAD as f32,
                after_ms: FROZEN_MS,
            }),
            heartbeat_ms: None,
            late_ticks: None,
            energy_j: scene.actuators.torque_limits.then(|| {
                let torques: f64 = scene.joints.iter().map(|joint| joint.torque_limit_nm).sum();
                (ENERGY_TRAVEL_RAD * torques) as f32
            }),
        },
        supervisor: SupervisorConfig {
            soft_start_ms: (scene.control.soft_start_s * 1e3).round() as u32,
            release_ms: RELEASE_MS,
        },
    }
}

/// A value a joint of the scene's hand, `rest` beyond them.
fn each<T: Real>(scene: &Scene, rest: f64, value: impl Fn(usize) -> f64) -> [T; MAX_JOINTS] {
    let joints = scene.joints.len();
    std::array::from_fn(|k| T::from_f64(if k < joints { value(k) } else { rest }))
}
