//! A hand in the user's frames, and forward kinematics written a second time.
//!
//! [`Hand`] turns a description into frames of its own choosing before it computes anything. What is here does not: it
//! follows the description word by word, with Rodrigues' formula for each joint, so that the two can be compared.

use blindgrasp_shared::hand::{Fingertip, Hand, Joint};
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};

/// A hand as a user describes it.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Joints, parents first.
    pub joints: Vec<Joint<f64>>,
    /// Fingertips.
    pub fingertips: Vec<Fingertip<f64>>,
}

/// Poses in the base frame; one entry a joint, or a fingertip.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Origins of the joints and of their link frames, m.
    pub origins_m: Vec<Vector3<f64>>,
    /// Attitudes of the link frames of the description.
    pub attitudes: Vec<Matrix3<f64>>,
    /// Unit vectors along the joint axes.
    pub axes: Vec<Vector3<f64>>,
    /// Mass centres of the links, m.
    pub mass_centres_m: Vec<Vector3<f64>>,
    /// Inertia tensors of the links about their mass centres in base axes, kg m^2.
    pub inertias_kg_m2: Vec<Matrix3<f64>>,
    /// Centres of the fingertips, m.
    pub centres_m: Vec<Vector3<f64>>,
}

impl Description {
    /// The hand that is described.
    pub fn hand<const J: usize, const F: usize>(&self) -> Hand<f64, J, F> {
        match Hand::new(&self.joints, &self.fingertips) {
            Ok(hand) => hand,
            Err(error) => panic!("{error}"),
        }
    }

    /// The same hand on a base that is turned and shifted.
    pub fn moved(&self, turn: &Matrix3<f64>, shift_m: &Vector3<f64>) -> Self {
        let mut moved = self.clone();
        for joint in moved.joints.iter_mut().filter(|joint| joint.parent.is_none()) {
            joint.offset_m = shift_m + turn * joint.offset_m;
            joint.attitude = turn * joint.attitude;
        }
        moved
    }

    /// The joints between a link and the base, from the link down.
    pub fn chain(&self, link: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(link), |&joint| self.joints[joint].parent)
    }

    /// Number of joints that move a fingertip.
    pub fn chain_length(&self, fingertip: usize) -> usize {
        self.chain(self.fingertips[fingertip].link).count()
    }

    /// Returns the largest distance of a fingertip's centre from the base's origin, m.
    pub fn reach_m(&self, fingertip: usize) -> f64 {
        let tip = &self.fingertips[fingertip];
        tip.offset_m.norm() + self.chain(tip.link).map(|k| self.joints[k].offset_m.norm()).sum::<f64>()
    }

    /// Places everything for the joint angles `q`, rad.
    pub fn placed(&self, angles_rad: &[f64]) -> Placed {
        let mut placed = Placed {
            origins_m: vec![],
            attitudes: vec![],
            axes: vec![],
            mass_centres_m: vec![],
            inertias_kg_m2: vec![],
            centres_m: vec![],
        };
        for (joint, angle) in self.joints.iter().zip(angles_rad) {
            let (origin, attitude) = match joint.parent {
                Some(parent) => (placed.origins_m[parent], placed.attitudes[parent]),
                None => (Vector3::zeros(), Matrix3::identity()),
            };
            let origin = origin + attitude * joint.offset_m;
            let attitude = attitude * joint.attitude * rodrigues(&joint.axis, *angle);
            placed.origins_m.push(origin);
            placed.attitudes.push(attitude);
            placed.axes.push(attitude * joint.axis);
            placed.mass_centres_m.push(origin + attitude * joint.link.mass_centre_m);
            placed.inertias_kg_m2.push(attitude * joint.link.inertia_kg_m2 * attitude.transpose());
        }
        for tip in &self.fingertips {
            placed.centres_m.push(placed.origins_m[tip.link] + placed.attitudes[tip.link] * tip.offset_m);
        }
        placed
    }

    /// Velocity (m/s) of a point that is fixed to a link, and the link's angular velocity (rad/s).
    pub fn velocity(
        &self,
        placed: &Placed,
        link: usize,
        point_m: &Vector3<f64>,
        speeds_rad_s: &[f64],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for k in self.chain(link) {
            let turning = placed.axes[k] * speeds_rad_s[k];
            linear += turning.cross(&(point_m - placed.origins_m[k]));
            angular += turning;
        }
        (linear, angular)
    }

    /// Potential energy of the links in gravity, J.
    pub fn weight_potential_j(&self, placed: &Placed, gravity_m_s2: &Vector3<f64>) -> f64 {
        let weights = self.joints.iter().zip(&placed.mass_centres_m);
        weights.map(|(joint, centre)| -joint.link.mass_kg * gravity_m_s2.dot(centre)).sum()
    }
}

/// Rotation by an angle about a unit vector: `1 + sin K + (1 - cos) K^2`.
pub fn rodrigues(axis: &Vector3<f64>, angle_rad: f64) -> Matrix3<f64> {
    let (sine, cosine) = angle_rad.sine_cosine();
    let k = axis.cross_matrix();
    Matrix3::identity() + k * sine + k * k * (1.0 - cosine)
}

/// The vector `w` of the skew part `[w x]` of a matrix.
pub fn axial(m: &Matrix3<f64>) -> Vector3<f64> {
    0.5 * Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)])
}
