//! The encoders of the joints: angles to counts, each with the sign and the zero of the hand's file, and with noise if the scene
//! asks for it.

use blindgrasp_body::MAX_JOINTS;
use blindgrasp_body::dynamics::JointVector;
use blindgrasp_model::Scene;
use std::array::from_fn;
use std::f64::consts::TAU;

/// One a joint.
#[derive(Clone, Debug)]
pub struct Encoders {
    joint_count: usize,
    counts_per_rad: JointVector,
    reversed: [bool; MAX_JOINTS],
    zero_counts: [i32; MAX_JOINTS],
    noise_counts: f64,
    noise: fastrand::Rng,
}

impl Encoders {
    /// The encoders of a scene.
    pub fn new(scene: &Scene) -> Self {
        let joints = &scene.joints;
        Self {
            joint_count: joints.len(),
            counts_per_rad: from_fn(|k| {
                joints.get(k).map_or(0.0, |joint| joint.encoder_counts_per_turn / TAU)
            }),
            reversed: from_fn(|k| joints.get(k).is_some_and(|joint| joint.encoder_reversed)),
            zero_counts: from_fn(|k| joints.get(k).map_or(0, |joint| joint.encoder_zero_count)),
            noise_counts: scene.sensors.noise_counts,
            noise: fastrand::Rng::with_seed(u64::from(scene.seed)),
        }
    }

    /// The counts at this instant; zero beyond the hand's joints.
    pub fn read(&mut self, angles_rad: &JointVector) -> [i32; MAX_JOINTS] {
        let mut counts = [0; MAX_JOINTS];
        for k in 0..self.joint_count {
            let noise = if self.noise_counts > 0.0 { self.noise_counts * self.normal() } else { 0.0 };
            let turned = (angles_rad[k] * self.counts_per_rad[k] + noise).round() as i32;
            let counted = if self.reversed[k] { turned.wrapping_neg() } else { turned };
            counts[k] = self.zero_counts[k].wrapping_add(counted);
        }
        counts
    }

    /// A normally distributed number: the sum of twelve uniform ones, which has variance one.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.noise.f64()).sum::<f64>() - 6.0
    }
}
