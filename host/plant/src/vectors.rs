//! Velocities and forces of everything that moves, as vectors.

use super::model::Motion;
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_body::dynamics::JointVector;
use nalgebra::Vector3;

/// Velocities of the object.
pub(super) const OBJECT: usize = 6;

/// Velocities or forces of everything.
#[derive(Clone, Copy, Debug)]
pub(super) struct Everything {
    pub(super) joints: JointVector,
    pub(super) object: [f64; OBJECT],
}

impl Everything {
    pub(super) const ZERO: Self = Self { joints: [0.0; MAX_JOINTS], object: [0.0; OBJECT] };
}

/// Velocities of a motion.
pub(super) fn velocities(motion: &Motion) -> Everything {
    let (v, w) = (&motion.velocity_m_s, &motion.spin_rad_s);
    Everything { joints: motion.speeds_rad_s, object: [v.x, v.y, v.z, w.x, w.y, w.z] }
}

/// Gives a motion its velocities.
pub(super) fn set_velocities(motion: &mut Motion, v: &Everything) {
    motion.speeds_rad_s = v.joints;
    motion.velocity_m_s = Vector3::new(v.object[0], v.object[1], v.object[2]);
    motion.spin_rad_s = tail(&v.object);
}

/// `a u + b v`.
pub(super) fn combine(a: f64, u: &Everything, b: f64, v: &Everything) -> Everything {
    let mut sum = Everything::ZERO;
    let joints = u.joints.iter().zip(&v.joints);
    let object = u.object.iter().zip(&v.object);
    for (sum, (u, v)) in sum.joints.iter_mut().chain(&mut sum.object).zip(joints.chain(object)) {
        *sum = a * u + b * v;
    }
    sum
}

/// Adds `a v`.
pub(super) fn add(sum: &mut Everything, a: f64, v: &Everything) {
    for (sum, v) in sum.joints.iter_mut().chain(&mut sum.object).zip(v.joints.iter().chain(&v.object)) {
        *sum += a * v;
    }
}

/// Linear part of an object's velocity or force.
pub(super) fn head(v: &[f64; OBJECT]) -> Vector3<f64> {
    Vector3::new(v[0], v[1], v[2])
}

/// Angular part.
pub(super) fn tail(v: &[f64; 6]) -> Vector3<f64> {
    Vector3::new(v[3], v[4], v[5])
}

/// Sets the angular part.
pub(super) fn set_tail(v: &mut [f64; 6], w: &Vector3<f64>) {
    v[3..].copy_from_slice(w.as_slice());
}

/// Scalar product of an object's.
pub(super) fn dot6(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Scalar product of the first `n` entries.
#[inline]
pub(super) fn dot(a: &[f64], b: &[f64], n: usize) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b).take(n) {
        sum += a * b;
    }
    sum
}
