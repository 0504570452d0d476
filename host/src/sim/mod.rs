//! The closed loop on the host: the tick that the microcontroller runs, in `f32`, against the plant, in `f64`.
//!
//! One control period has these stages, as on the hand:
//!
//! 1. **Sense**: the encoders count the joint angles of this instant (with noise, if asked for).
//! 2. **Control**: the tick takes the counts to torques.
//! 3. **Actuate**: the amplifiers hold, for one period, the torques of the tick before (the one-cycle output delay of a
//!    controller that reads first and writes last), within what the motors can do.
//! 4. **Plant**: sub-steps up to the next period. Friction of the joints is the plant's.
//! 5. **Record**: the state at the beginning of the period.
//!
//! Time 0 is the tick that is told to grasp. Before it the hand is armed while everything stands still, which starts the
//! estimator. Everything is deterministic: the same scene and seed give the same bytes.

mod controller;
pub mod observe;
pub mod summary;

use crate::MAX_JOINTS;
use crate::plant::dynamics::JointVector;
use crate::plant::{Lost, ModelError, Motion, ObjectModel, Plant, PlantModel};
use crate::record::sample::Sample;
use crate::scene::Scene;
use blindgrasp_shared::control::GraspLaw;
use blindgrasp_shared::parameter::ParameterError;
use controller::Controller;
use nalgebra::Vector3;
use observe::{Observer, Seen};
use std::time::Instant;
use summary::{Ending, Summary};

/// Why a scene can't be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The plant has no equations of motion.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The controller refuses its parameters.
    #[error("control: {0}")]
    Control(#[from] ParameterError),
}

/// A finished run.
#[derive(Clone, Debug)]
pub struct Run {
    /// One sample a control tick.
    pub samples: Vec<Sample>,
    /// The verdict.
    pub summary: Summary,
}

/// A scene, ready to run.
pub struct Simulation {
    name: String,
    joints: usize,
    ticks: u64,
    period_us: u64,
    substeps: usize,
    torque_limits_nm: JointVector,
    delayed: bool,
    controller: Controller,
    plant: Plant,
    observer: Observer,
}

impl Simulation {
    /// Prepares a scene.
    ///
    /// # Errors
    /// What is wrong with its model or its gains.
    pub fn new(scene: &Scene) -> Result<Self, SimulationError> {
        let mut angles_rad = [0.0; MAX_JOINTS];
        angles_rad[..scene.start.angles_rad.len()].copy_from_slice(&scene.start.angles_rad);
        let start = Motion::at_rest(angles_rad, scene.start.position_m, scene.start.attitude);
        let plant = Plant::new(model(scene), start, scene.plant.substep_s)?;
        let mut torque_limits_nm = [f64::INFINITY; MAX_JOINTS];
        for (limit, joint) in torque_limits_nm.iter_mut().zip(&scene.joints) {
            *limit = joint.torque_limit_nm;
        }
        let mut controller = Controller::new(scene)?;
        controller.arm(&angles_rad);
        Ok(Self {
            name: scene.name.clone(),
            joints: scene.hand.joint_count(),
            ticks: (scene.duration_s / scene.control.period_s).round() as u64,
            period_us: (scene.control.period_s * 1e6).round() as u64,
            substeps: scene.substeps,
            torque_limits_nm,
            delayed: scene.actuators.output_delay_ticks > 0,
            observer: Observer::new(law(scene)?, plant.posture()),
            controller,
            plant,
        })
    }

    /// Runs to the end, or until the grasp is lost. `progress` is told the simulated time once in a while.
    pub fn run(mut self, mut progress: impl FnMut(f64)) -> Run {
        let begun = Instant::now();
        let mut samples = Vec::with_capacity(self.ticks as usize + 1);
        let mut applied = None;
        let mut lost = None;
        for tick in 0..=self.ticks {
            let t_s = self.time_s(tick);
            if tick % 100 == 0 {
                progress(t_s);
            }
            if let Err(reason) = self.period(t_s, &mut applied, &mut samples) {
                lost = Some(reason);
                break;
            }
        }
        let duration_s = lost.map_or(self.time_s(self.ticks), |(t_s, _)| t_s);
        let wall_s = begun.elapsed().as_secs_f64();
        let fault = self.controller.fault();
        let summary = Summary::of(Ending { scene: self.name, duration_s, lost, fault, wall_s }, &samples);
        Run { samples, summary }
    }

    /// Time of a tick, s. From whole microseconds, so that it prints as what it is.
    fn time_s(&self, tick: u64) -> f64 {
        (tick * self.period_us) as f64 / 1e6
    }

    /// One control period that begins at `t_s`. `applied` are the torques on the joints, before (if there was a before) and
    /// after.
    fn period(
        &mut self,
        t_s: f64,
        applied: &mut Option<JointVector>,
        samples: &mut Vec<Sample>,
    ) -> Result<(), (f64, Lost)> {
        // 1, 2: sense and control.
        let motion = self.plant.motion();
        let computed_before = self.controller.torques_nm();
        self.controller.tick(&motion.angles_rad, &motion.speeds_rad_s);
        // 3: actuate.
        let wanted = if self.delayed { computed_before } else { self.controller.torques_nm() };
        let now: JointVector =
            std::array::from_fn(|k| wanted[k].clamp(-self.torque_limits_nm[k], self.torque_limits_nm[k]));
        let before = applied.replace(now).unwrap_or(now);
        // 4: plant. The torques change at the very instant of the first sub-step, whose kick covers half a sub-step on
        // either side: it gets their mean, which keeps the integrator's second order.
        let mut torques: JointVector = std::array::from_fn(|k| 0.5 * (before[k] + now[k]));
        for substep in 0..self.substeps {
            let at_s = t_s + (self.period_us * substep as u64) as f64 / (1e6 * self.substeps as f64);
            self.plant.solve(&torques).map_err(|lost| (at_s, lost))?;
            if substep == 0 {
                // 5: record.
                samples.push(self.sample(t_s, &now));
                torques = now;
            }
            self.plant.advance();
        }
        Ok(())
    }

    fn sample(&self, t_s: f64, applied: &JointVector) -> Sample {
        let (angles_rad, speeds_rad_s) = self.controller.estimate();
        let seen = Seen {
            angles_rad: &angles_rad[..self.joints],
            speeds_rad_s: &speeds_rad_s[..self.joints],
            torques_nm: &applied[..self.joints],
            force_share: self.controller.force_share(),
            mode: self.controller.mode(),
        };
        self.observer.sample(t_s, &self.plant, &seen)
    }
}

/// The grasp law of a scene in the precision of the plant.
///
/// # Errors
/// A gain that is out of its range.
pub fn law(scene: &Scene) -> Result<GraspLaw<f64, MAX_JOINTS>, ParameterError> {
    scene.law_config().prepare(&scene.hand)
}

/// The plant of a scene.
pub fn model(scene: &Scene) -> PlantModel {
    let gravity = Vector3::from(scene.plant.gravity_m_s2);
    PlantModel {
        hand: scene.hand.clone(),
        fingertips: scene.fingertips.clone(),
        friction: scene.joints.iter().map(|joint| joint.friction).collect(),
        object: ObjectModel {
            shape: scene.object.clone(),
            mass_kg: scene.mass_kg,
            inertia_kg_m2: scene.inertia_kg_m2,
        },
        faces: scene.contacts.clone(),
        hand_gravity_m_s2: gravity,
        object_gravity_m_s2: if scene.plant.gravity_on_object { gravity } else { Vector3::zeros() },
    }
}
