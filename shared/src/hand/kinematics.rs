//! Forward kinematics, fingertip Jacobians (Eq. 11), and products with their transposes.
//!
//! The joints of a finger that flex are parallel. Such a **planar chain** has axes of its own, z along its joints, and in
//! these everything is plane geometry: angles add up, links turn in the plane, and every joint sees the same force in
//! the plane and the same moment about z, of which its torque takes its own lever. Only where a chain starts is a frame
//! computed in space. A joint without parallel neighbours is a chain of one.
//!
//! Positions and moments are taken from the base's origin, also in a chain's axes, so that nothing has to be shifted from
//! one point to another.

use super::frame::{cross, dot, turn_about_z, turn_vector, x_axis, y_axis, z_axis};
use super::model::Hand;
use crate::math::Real;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// The pose of a link in the base frame.
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

/// The poses of all links for one set of joint angles.
///
/// Joints are kept in the axes of their planar chain, where they only turn in the plane; [`link`](Self::link) puts the
/// pose of a link in the base frame together.
#[derive(Clone, Debug, PartialEq)]
pub struct Posture<T, const J: usize, const F: usize> {
    /// Axes of each planar chain in the base frame, as columns; by the first joint of the chain.
    chains: [Matrix3<T>; J],
    joints: [JointPose<T>; J],
    /// Centre `x_i` of each fingertip, m.
    pub centres_m: [Vector3<T>; F],
    /// Attitude `R_fi` of each fingertip. The law only uses how it changes, so that any frame fixed to the fingertip
    /// serves (Eq. 33); this is the prepared frame of its link.
    pub attitudes: [Matrix3<T>; F],
}

/// The pose of a joint within its planar chain.
#[derive(Clone, Copy, Debug, PartialEq)]
struct JointPose<T> {
    /// First joint of the chain.
    chain: usize,
    /// Of the angle between the chain's axes and the link.
    sine: T,
    cosine: T,
    /// From the base's origin, in the chain's axes, m.
    origin_m: Vector3<T>,
}

impl<T: Real> JointPose<T> {
    /// A vector of the link in the chain's axes.
    #[inline]
    fn turned(&self, v: &Vector3<T>) -> Vector3<T> {
        Vector3::new(v.x * self.cosine - v.y * self.sine, v.x * self.sine + v.y * self.cosine, v.z)
    }
}

impl<T: Real, const J: usize, const F: usize> Posture<T, J, F> {
    /// Everything at the base: what [`Hand::forward_kinematics`] fills.
    pub fn at_base() -> Self {
        let joint = JointPose { chain: 0, sine: T::zero(), cosine: T::one(), origin_m: Vector3::zeros() };
        Self {
            chains: [Matrix3::identity(); J],
            joints: [joint; J],
            centres_m: [Vector3::zeros(); F],
            attitudes: [Matrix3::identity(); F],
        }
    }

    /// Returns the pose of a link; the base, for a joint that the hand has not.
    #[inline]
    pub fn link(&self, joint: usize) -> LinkPose<T> {
        match self.at(joint) {
            Some((joint, axes)) => LinkPose {
                origin_m: turn_vector(axes, &joint.origin_m),
                attitude: turn_about_z(axes, joint.sine, joint.cosine),
            },
            None => LinkPose { origin_m: Vector3::zeros(), attitude: Matrix3::identity() },
        }
    }

    /// A joint, and the axes of its chain.
    #[inline]
    fn at(&self, joint: usize) -> Option<(&JointPose<T>, &Matrix3<T>)> {
        let joint = self.joints.get(joint)?;
        Some((joint, self.chains.get(joint.chain)?))
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
        // The joint before, and the angle between its chain's axes and its link.
        let mut before =
            JointPose { chain: 0, sine: T::zero(), cosine: T::one(), origin_m: Vector3::zeros() };
        let mut angle = T::zero();
        for k in 0..self.joint_count.min(J) {
            let joint = &self.joints[k];
            let (chain, origin_m) = match &joint.bend {
                None => {
                    angle += angles_rad[k];
                    (before.chain, before.origin_m + before.turned(&joint.offset_m))
                }
                Some(bend) => {
                    angle = angles_rad[k];
                    // The chain of the parent, which comes before, began before.
                    let (begun, axes) = posture.chains.split_at_mut(k);
                    let parent = joint.parent.and_then(|parent| posture.joints.get(parent));
                    let origin_m = match parent.and_then(|parent| Some((parent, begun.get(parent.chain)?))) {
                        Some((parent, old)) => {
                            let bend = bend.after(parent.sine, parent.cosine);
                            bend.turn_axes(old, &mut axes[0]);
                            bend.into_new(&parent.origin_m) + joint.offset_m
                        }
                        None => {
                            axes[0] = bend.axes();
                            joint.offset_m
                        }
                    };
                    (k, origin_m)
                }
            };
            let (sine, cosine) = angle.sine_cosine();
            before = JointPose { chain, sine, cosine, origin_m };
            posture.joints[k] = before;
        }
        for i in 0..self.fingertip_count.min(F) {
            let fingertip = &self.fingertips[i];
            if let Some((joint, axes)) = posture.at(fingertip.link) {
                let centre = turn_vector(axes, &(joint.origin_m + joint.turned(&fingertip.offset_m)));
                let attitude = turn_about_z(axes, joint.sine, joint.cosine);
                posture.centres_m[i] = centre;
                posture.attitudes[i] = attitude;
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
            let pose = posture.link(k);
            let (axis, lever) = (pose.axis(), posture.centres_m[fingertip] - pose.origin_m);
            linear.set_column(k, &axis.cross(&lever));
            angular.set_column(k, &axis);
        }
        (linear, angular)
    }

    /// Velocities of the fingertips' centres, `J_i dq`, m/s: from each to the base, chain by chain, as
    /// `push` goes, whose transpose it is.
    pub fn fingertip_velocities(&self, posture: &Posture<T, J, F>, speeds_rad_s: &[T; J]) -> [Vector3<T>; F] {
        let mut velocities = [Vector3::zeros(); F];
        let fingertips = self.prepared_fingertips().iter().zip(&posture.centres_m);
        for ((fingertip, centre), velocity) in fingertips.zip(&mut velocities) {
            let mut link = Some(fingertip.link);
            while let Some((last, (pose, axes))) = link.and_then(|last| Some((last, posture.at(last)?))) {
                // In the plane of the chain: the speeds, and their moment about the base's origin.
                let (mut turning, mut x, mut y) = (T::zero(), T::zero(), T::zero());
                for k in (pose.chain..last + 1).rev() {
                    let (Some(pose), Some(&speed)) = (posture.joints.get(k), speeds_rad_s.get(k)) else {
                        break;
                    };
                    turning += speed;
                    x += speed * pose.origin_m.x;
                    y += speed * pose.origin_m.y;
                }
                let (x_axis, y_axis) = (x_axis(axes), y_axis(axes));
                let along_x = y - turning * dot(&y_axis, centre);
                let along_y = turning * dot(&x_axis, centre) - x;
                *velocity += x_axis * along_x + y_axis * along_y;
                link = self.parent(pose.chain);
            }
        }
        velocities
    }

    /// Joint torques that put wrenches on the fingertips, `sum(J_i^T F_i + J_Omega i^T M_i)`, N m.
    pub fn fingertip_torques(&self, posture: &Posture<T, J, F>, wrenches: &[Wrench<T>; F]) -> [T; J] {
        let mut torques = [T::zero(); J];
        let fingertips = self.prepared_fingertips().iter().zip(&posture.centres_m);
        for ((fingertip, centre), wrench) in fingertips.zip(wrenches) {
            self.push(posture, fingertip.link, centre, wrench, &mut torques);
        }
        torques
    }

    /// Joint torques `g(q)` that hold the weight of the links, N m.
    pub fn gravity_torques(&self, posture: &Posture<T, J, F>, gravity_m_s2: &Vector3<T>) -> [T; J] {
        let mut torques = [T::zero(); J];
        self.hold_weight(posture, gravity_m_s2, &mut torques);
        torques
    }

    /// Adds the joint torques that put a wrench on a link, at a point in the base frame, m, without forming a Jacobian: from
    /// the link to the base, it is projected on the plane of each chain, where all joints see the same force and the same
    /// moment about the base's origin.
    #[inline]
    pub(crate) fn push(
        &self,
        posture: &Posture<T, J, F>,
        link: usize,
        point_m: &Vector3<T>,
        wrench: &Wrench<T>,
        torques: &mut [T; J],
    ) {
        let force = &wrench.force_n;
        let moment = wrench.moment_nm + cross(point_m, force);
        let mut link = Some(link);
        while let Some((last, (pose, axes))) = link.and_then(|last| Some((last, posture.at(last)?))) {
            let (x, y) = (dot(&x_axis(axes), force), dot(&y_axis(axes), force));
            let z = dot(&z_axis(axes), &moment);
            for k in (pose.chain..last + 1).rev() {
                let (Some(pose), Some(torque)) = (posture.joints.get(k), torques.get_mut(k)) else { return };
                *torque += z - (pose.origin_m.x * y - pose.origin_m.y * x);
            }
            link = self.parent(pose.chain);
        }
    }

    /// Adds the joint torques that hold the weight of the links: one pass from the fingertips to the base, which sums up
    /// the first moments of the augmented bodies above each joint. Returns the potential energy of the weight, J, above
    /// what it would be with all mass at the joints that stand on the base.
    #[inline]
    pub(crate) fn hold_weight(
        &self,
        posture: &Posture<T, J, F>,
        gravity_m_s2: &Vector3<T>,
        torques: &mut [T; J],
    ) -> T {
        let upwards = -gravity_m_s2;
        let upwards_in_plane = |joint: usize| match posture.at(joint) {
            Some((_, axes)) => (dot(&x_axis(axes), &upwards), dot(&y_axis(axes), &upwards)),
            None => (T::zero(), T::zero()),
        };
        // In the axes of the joint's chain, as are all moments.
        let own = |joint: usize| posture.joints[joint].turned(&self.joints[joint].first_moment_kg_m);
        // Of a joint on which other chains stand, with what these have: few, so that the others need not be kept.
        let mut carrying: [Option<Vector3<T>>; J] = [None; J];
        let count = self.joint_count.min(J);
        let (mut x, mut y) = upwards_in_plane(count.wrapping_sub(1));
        let mut moment = Vector3::zeros();
        let mut potential_j = T::zero();
        for k in (0..count).rev() {
            moment += carrying[k].unwrap_or_else(|| own(k));
            torques[k] += moment.x * y - moment.y * x;
            let joint = &self.joints[k];
            if let Some(bend) = &joint.bend {
                let parent = joint.parent.unwrap_or(J);
                match (posture.joints.get(parent), carrying.get_mut(parent)) {
                    (Some(pose), Some(below)) => {
                        *below.get_or_insert_with(|| own(parent)) +=
                            bend.after(pose.sine, pose.cosine).into_old(&moment);
                    }
                    _ => {
                        let z = dot(&z_axis(&posture.chains[k]), &upwards);
                        potential_j += moment.x * x + moment.y * y + moment.z * z;
                    }
                }
                moment = Vector3::zeros();
                (x, y) = upwards_in_plane(k.wrapping_sub(1));
            }
        }
        potential_j
    }
}
