//! Forward kinematics, fingertip Jacobians (Eq. 11), and products with their transposes.

use super::frame::{cross, dot, product, turn_about_z, turn_vector, z_axis};
use super::model::Hand;
use crate::math::Real;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Where a link is, in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkPose<T> {
    /// The joint, and the origin of the link frame, m.
    pub origin_m: Vector3<T>,
    /// Axes of the prepared link frame; its third column is the joint axis.
    pub attitude: Matrix3<T>,
}

impl<T: Real> LinkPose<T> {
    /// Unit vector along the joint axis.
    #[inline]
    pub fn axis(&self) -> Vector3<T> {
        z_axis(&self.attitude)
    }

    /// A point of the link in the base frame, m.
    #[inline]
    pub fn point(&self, local_m: &Vector3<T>) -> Vector3<T> {
        self.origin_m + turn_vector(&self.attitude, local_m)
    }
}

/// Where everything is for one set of joint angles.
#[derive(Clone, Debug, PartialEq)]
pub struct Posture<T, const J: usize, const F: usize> {
    /// One a joint.
    pub links: [LinkPose<T>; J],
    /// Centre `x_i` of each fingertip, m.
    pub centres_m: [Vector3<T>; F],
    /// Attitude `R_fi` of each fingertip. The law only uses how it changes, so that any frame fixed to the fingertip
    /// serves (Eq. 33); this is the prepared frame of its link.
    pub attitudes: [Matrix3<T>; F],
}

impl<T: Real, const J: usize, const F: usize> Posture<T, J, F> {
    /// Everything at the base: what [`Hand::forward_kinematics`] fills.
    pub fn at_base() -> Self {
        let pose = LinkPose { origin_m: Vector3::zeros(), attitude: Matrix3::identity() };
        Self { links: [pose; J], centres_m: [Vector3::zeros(); F], attitudes: [Matrix3::identity(); F] }
    }
}

/// A force and a moment about the point where it acts, in the base frame; for a fingertip its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<T> {
    /// Force, N.
    pub force_n: Vector3<T>,
    /// Moment, N m.
    pub moment_nm: Vector3<T>,
}

impl<T: Real> Wrench<T> {
    /// No force and no moment.
    pub fn zero() -> Self {
        Self { force_n: Vector3::zeros(), moment_nm: Vector3::zeros() }
    }
}

impl<T: Real, const J: usize, const F: usize> Hand<T, J, F> {
    /// Places every link and fingertip for the joint angles `q`, rad.
    pub fn forward_kinematics(&self, angles_rad: &[T; J], posture: &mut Posture<T, J, F>) {
        let base = LinkPose { origin_m: Vector3::zeros(), attitude: Matrix3::identity() };
        // All sines and cosines first: they are independent, and a machine with vector registers computes several at once.
        let turns = angles_rad.map(Real::sine_cosine);
        for k in 0..self.joint_count.min(J) {
            let (joint, (sine, cosine)) = (&self.joints[k], turns[k]);
            let parent = joint.parent.and_then(|parent| posture.links.get(parent)).unwrap_or(&base);
            let origin_m = parent.point(&joint.offset_m);
            let attitude = match &joint.attitude {
                Some(attitude) => turn_about_z(&product(&parent.attitude, attitude), sine, cosine),
                None => turn_about_z(&parent.attitude, sine, cosine),
            };
            posture.links[k] = LinkPose { origin_m, attitude };
        }
        for (i, fingertip) in self.fingertips.iter().take(self.fingertip_count).enumerate() {
            if let (Some(pose), Some(centre), Some(attitude)) = (
                posture.links.get(fingertip.link),
                posture.centres_m.get_mut(i),
                posture.attitudes.get_mut(i),
            ) {
                *centre = pose.point(&fingertip.offset_m);
                *attitude = pose.attitude;
            }
        }
    }

    /// Jacobians `J_i` (3 x joints, m) and `J_Omega i` (3 x joints, unit-free) of a fingertip: they take joint speeds to
    /// the velocity of its centre and to its angular velocity (Eq. 11). Columns beyond the hand's joints are zero.
    pub fn jacobians(
        &self,
        posture: &Posture<T, J, F>,
        fingertip: usize,
    ) -> (SMatrix<T, 3, J>, SMatrix<T, 3, J>) {
        let mut linear = SMatrix::<T, 3, J>::zeros();
        let mut angular = SMatrix::<T, 3, J>::zeros();
        for k in self.joints_to(fingertip) {
            let axis = posture.links[k].axis();
            let lever = posture.centres_m[fingertip] - posture.links[k].origin_m;
            linear.set_column(k, &axis.cross(&lever));
            angular.set_column(k, &axis);
        }
        (linear, angular)
    }

    /// Joint torques that put wrenches on the fingertips, `sum(J_i^T F_i + J_Omega i^T M_i)`, N m, without forming a Jacobian.
    pub fn fingertip_torques(&self, posture: &Posture<T, J, F>, wrenches: &[Wrench<T>; F]) -> [T; J] {
        let mut torques = [T::zero(); J];
        let placed = wrenches.iter().zip(&posture.centres_m);
        for (fingertip, (wrench, centre)) in self.fingertips.iter().zip(placed).take(self.fingertip_count) {
            let mut below = Some(fingertip.link);
            while let Some(k) = below.filter(|&k| k < J) {
                let pose = &posture.links[k];
                let moment = wrench.moment_nm + cross(&(centre - pose.origin_m), &wrench.force_n);
                torques[k] += dot(&pose.axis(), &moment);
                below = self.joints[k].parent;
            }
        }
        torques
    }

    /// Joint torques `g(q)` that hold the weight of the links, N m. One pass from the fingertips to the base, which carries
    /// the first moment of everything above each joint.
    pub fn gravity_torques(&self, posture: &Posture<T, J, F>, gravity_m_s2: &Vector3<T>) -> [T; J] {
        let mut torques = [T::zero(); J];
        let upwards = -gravity_m_s2;
        let mut carried = [Vector3::zeros(); J];
        for k in (0..self.joint_count.min(J)).rev() {
            let (joint, pose) = (&self.joints[k], &posture.links[k]);
            let moment = carried[k] + turn_vector(&pose.attitude, &joint.first_moment_kg_m);
            torques[k] = dot(&pose.axis(), &cross(&moment, &upwards));
            let parent = joint.parent.unwrap_or(J);
            if let (Some(below), Some(carried)) = (posture.links.get(parent), carried.get_mut(parent)) {
                *carried += moment + (pose.origin_m - below.origin_m) * joint.carried_kg;
            }
        }
        torques
    }
}
