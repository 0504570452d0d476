//! Forward kinematics, fingertip Jacobians (Eq. 11), and products with their transposes.

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
        self.attitude.column(2).into_owned()
    }

    /// A point of the link in the base frame, m.
    #[inline]
    pub fn point(&self, local_m: &Vector3<T>) -> Vector3<T> {
        self.origin_m + self.attitude * local_m
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

/// A force and a moment that act at a fingertip's centre, in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<T> {
    /// Force, N.
    pub force_n: Vector3<T>,
    /// Moment about the fingertip's centre, N m.
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
        for (k, (joint, angle)) in self.joints.iter().zip(angles_rad).take(self.joint_count).enumerate() {
            let parent = joint.parent.and_then(|parent| posture.links.get(parent)).unwrap_or(&base);
            let origin_m = parent.point(&joint.offset_m);
            let attitude = match &joint.attitude {
                Some(attitude) => turned(&(parent.attitude * attitude), *angle),
                None => turned(&parent.attitude, *angle),
            };
            if let Some(pose) = posture.links.get_mut(k) {
                *pose = LinkPose { origin_m, attitude };
            }
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

    /// Joint torques (N m) that hold the weight of the links in `gravity_m_s2` and put `wrenches` on the fingertips:
    /// `g(q) + sum(J_i^T F_i + J_Omega i^T M_i)`.
    ///
    /// One pass from the fingertips to the base, without forming a Jacobian: each joint sees the wrench of everything
    /// that it carries, taken about the origin of the base frame.
    pub fn joint_torques(
        &self,
        posture: &Posture<T, J, F>,
        wrenches: &[Wrench<T>; F],
        gravity_m_s2: Option<&Vector3<T>>,
    ) -> [T; J] {
        let mut carried = [Wrench::zero(); J];
        for (i, (fingertip, wrench)) in
            self.fingertips.iter().zip(wrenches).take(self.fingertip_count).enumerate()
        {
            if let (Some(link), Some(centre)) = (carried.get_mut(fingertip.link), posture.centres_m.get(i)) {
                link.force_n += wrench.force_n;
                link.moment_nm += wrench.moment_nm + centre.cross(&wrench.force_n);
            }
        }
        let mut torques = [T::zero(); J];
        for k in (0..self.joint_count.min(J)).rev() {
            let (joint, pose) = (&self.joints[k], &posture.links[k]);
            let mut wrench = carried[k];
            if let Some(gravity) = gravity_m_s2 {
                let support = -gravity * joint.link.mass_kg;
                wrench.force_n += support;
                wrench.moment_nm += pose.point(&joint.link.mass_centre_m).cross(&support);
            }
            torques[k] = pose.axis().dot(&(wrench.moment_nm - pose.origin_m.cross(&wrench.force_n)));
            if let Some(parent) = joint.parent.and_then(|parent| carried.get_mut(parent)) {
                parent.force_n += wrench.force_n;
                parent.moment_nm += wrench.moment_nm;
            }
        }
        torques
    }

    /// Joint torques `g(q)` that hold the weight of the links, N m.
    pub fn gravity_torques(&self, posture: &Posture<T, J, F>, gravity_m_s2: &Vector3<T>) -> [T; J] {
        self.joint_torques(posture, &[Wrench::zero(); F], Some(gravity_m_s2))
    }
}

/// A frame after a turn about its own z axis.
#[inline]
fn turned<T: Real>(frame: &Matrix3<T>, angle_rad: T) -> Matrix3<T> {
    let (sine, cosine) = angle_rad.sine_cosine();
    let (x, y) = (frame.column(0), frame.column(1));
    Matrix3::from_columns(&[x * cosine + y * sine, y * cosine - x * sine, frame.column(2).into_owned()])
}
