//! The mass matrix of hand and object, factored: block-arrow, since fingers meet only in the trunk.

use super::linear::{backward, factorize, forward};
use super::vectors::{Everything, dot};
use blindgrasp_body::dynamics::{JointMatrix, JointVector};
use blindgrasp_body::{Hand, MAX_CHAIN, MAX_FINGERS};
use blindgrasp_shared::math::Real;
use nalgebra::Matrix3;

/// The joints of the trunk and of each finger.
#[derive(Clone, Debug)]
pub(super) struct Branches {
    /// Joints that move more than one fingertip.
    pub(super) trunk: Vec<usize>,
    /// Joints that move one fingertip only, by fingertip, from the base outwards.
    pub(super) fingers: Vec<Vec<usize>>,
}

impl Branches {
    pub(super) fn of(hand: &Hand) -> Self {
        let fingertips = 0..hand.fingertip_count();
        let moved = |k: usize| fingertips.clone().filter(|&i| hand.moves(k, i)).count();
        let joints = || 0..hand.joint_count();
        Self {
            trunk: joints().filter(|&k| moved(k) > 1).collect(),
            fingers: fingertips
                .clone()
                .map(|i| joints().filter(|&k| moved(k) == 1 && hand.moves(k, i)).collect())
                .collect(),
        }
    }

    /// The finger that a joint belongs to; `None` for a joint of the trunk.
    pub(super) fn finger(&self, joint: usize) -> Option<usize> {
        self.fingers.iter().position(|finger| finger.contains(&joint))
    }

    /// The longest chain, to be compared with [`MAX_CHAIN`].
    pub(super) fn longest(&self) -> usize {
        self.fingers.iter().chain([&self.trunk]).map(Vec::len).max().unwrap_or(0)
    }
}

/// The object's mass matrix.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectMass {
    pub(super) mass_kg: f64,
    /// About the centre of mass, in base axes, kg m^2.
    pub(super) inertia_kg_m2: Matrix3<f64>,
}

/// The Cholesky factor `L` of the mass matrix. There is no fill between fingers.
#[derive(Clone, Debug)]
pub(super) struct MassFactor {
    pub(super) branches: Branches,
    pub(super) finger_factors: [[[f64; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
    /// `L_i^-1 H_it`, by trunk joint.
    pub(super) finger_trunk: [[[f64; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
    pub(super) trunk_factor: [[f64; MAX_CHAIN]; MAX_CHAIN],
    pub(super) inertia_factor: [[f64; 3]; 3],
    pub(super) root_mass: f64,
}

impl MassFactor {
    pub(super) fn new(hand: &Hand) -> Self {
        Self {
            branches: Branches::of(hand),
            finger_factors: [[[0.0; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
            finger_trunk: [[[0.0; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
            trunk_factor: [[0.0; MAX_CHAIN]; MAX_CHAIN],
            inertia_factor: [[0.0; 3]; 3],
            root_mass: 0.0,
        }
    }

    /// Factors the mass matrix, with `softness` added to the joints' diagonal. Returns the least relative pivot.
    pub(super) fn factorize(&mut self, h: &JointMatrix, softness: &JointVector, object: &ObjectMass) -> f64 {
        let mut least: f64 = 1.0;
        let trunk = &self.branches.trunk;
        for (a, &j) in trunk.iter().enumerate() {
            for (b, &k) in trunk.iter().enumerate() {
                self.trunk_factor[a][b] = h[j][k];
            }
            self.trunk_factor[a][a] += softness[j];
        }
        for (i, finger) in self.branches.fingers.iter().enumerate() {
            let (factor, shared) = (&mut self.finger_factors[i], &mut self.finger_trunk[i]);
            for (a, &j) in finger.iter().enumerate() {
                for (b, &k) in finger.iter().enumerate() {
                    factor[a][b] = h[j][k];
                }
                factor[a][a] += softness[j];
            }
            least = least.min(factorize(factor, finger.len()));
            for (t, &k) in trunk.iter().enumerate() {
                for (a, &j) in finger.iter().enumerate() {
                    shared[t][a] = h[j][k];
                }
                forward(factor, finger.len(), &mut shared[t]);
                for u in 0..=t {
                    self.trunk_factor[t][u] -= dot(&shared[t], &shared[u], finger.len());
                }
            }
        }
        least = least.min(factorize(&mut self.trunk_factor, trunk.len()));
        self.inertia_factor = std::array::from_fn(|a| std::array::from_fn(|b| object.inertia_kg_m2[(a, b)]));
        self.root_mass = object.mass_kg.square_root();
        least.min(factorize(&mut self.inertia_factor, 3))
    }

    /// `L^-1 b`, in place.
    pub(super) fn whiten(&self, b: &mut Everything) {
        for i in 0..self.branches.fingers.len() {
            self.whiten_finger(i, b);
        }
        self.whiten_head(b);
    }

    fn whiten_finger(&self, i: usize, b: &mut Everything) {
        let finger = &self.branches.fingers[i];
        let mut part = [0.0; MAX_CHAIN];
        for (a, &j) in finger.iter().enumerate() {
            part[a] = b.joints[j];
        }
        forward(&self.finger_factors[i], finger.len(), &mut part);
        for (a, &j) in finger.iter().enumerate() {
            b.joints[j] = part[a];
        }
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            b.joints[k] -= dot(&self.finger_trunk[i][t], &part, finger.len());
        }
    }

    fn whiten_head(&self, b: &mut Everything) {
        let mut part = [0.0; MAX_CHAIN];
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            part[t] = b.joints[k];
        }
        forward(&self.trunk_factor, self.branches.trunk.len(), &mut part);
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            b.joints[k] = part[t];
        }
        for v in &mut b.object[..3] {
            *v /= self.root_mass;
        }
        forward(&self.inertia_factor, 3, &mut b.object[3..]);
    }

    /// `L^-T y`, in place.
    pub(super) fn unwhiten(&self, y: &mut Everything) {
        let mut trunk = [0.0; MAX_CHAIN];
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            trunk[t] = y.joints[k];
        }
        backward(&self.trunk_factor, self.branches.trunk.len(), &mut trunk);
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            y.joints[k] = trunk[t];
        }
        for (i, finger) in self.branches.fingers.iter().enumerate() {
            let mut part = [0.0; MAX_CHAIN];
            for (a, &j) in finger.iter().enumerate() {
                part[a] = y.joints[j];
            }
            for t in 0..self.branches.trunk.len() {
                for (a, shared) in self.finger_trunk[i][t].iter().enumerate().take(finger.len()) {
                    part[a] -= shared * trunk[t];
                }
            }
            backward(&self.finger_factors[i], finger.len(), &mut part);
            for (a, &j) in finger.iter().enumerate() {
                y.joints[j] = part[a];
            }
        }
        for v in &mut y.object[..3] {
            *v /= self.root_mass;
        }
        backward(&self.inertia_factor, 3, &mut y.object[3..]);
    }
}
