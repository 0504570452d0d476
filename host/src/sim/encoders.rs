//! The encoders of the joints: angles to counts, with noise if the scene asks for it.

use crate::MAX_JOINTS;
use crate::plant::dynamics::JointVector;
use crate::scene::Scene;
use std::f64::consts::TAU;

/// One a joint.
#[derive(Clone, Debug)]
pub(crate) struct Encoders {
    joint_count: usize,
    counts_per_rad: JointVector,
    noise_counts: f64,
    noise: fastrand::Rng,
}

impl Encoders {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut counts_per_rad = [0.0; MAX_JOINTS];
        for (counts, joint) in counts_per_rad.iter_mut().zip(&scene.joints) {
            *counts = joint.encoder_counts_per_turn / TAU;
        }
        Self {
            joint_count: scene.joints.len(),
            counts_per_rad,
            noise_counts: scene.sensors.noise_counts,
            noise: fastrand::Rng::with_seed(u64::from(scene.seed)),
        }
    }

    /// The counts at this instant; zero beyond the hand's joints.
    pub(crate) fn read(&mut self, angles_rad: &JointVector) -> [i32; MAX_JOINTS] {
        let mut counts = [0; MAX_JOINTS];
        for k in 0..self.joint_count {
            let noise = if self.noise_counts > 0.0 { self.noise_counts * self.normal() } else { 0.0 };
            counts[k] = (angles_rad[k] * self.counts_per_rad[k] + noise).round() as i32;
        }
        counts
    }

    /// A normally distributed number: the sum of twelve uniform ones, which has variance one.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.noise.f64()).sum::<f64>() - 6.0
    }
}
