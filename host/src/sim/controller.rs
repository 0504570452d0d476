//! The controller of the hand as the simulation sees it: encoders in front of the tick, the tick in `f32`.

use crate::plant::dynamics::JointVector;
use crate::scene::Scene;
use crate::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::tick::{Input, Output, Params, State, tick};
use std::f64::consts::TAU;

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
        let config = scene.controller_config();
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
