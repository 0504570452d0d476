//! Rotation of a free rigid body, carried by its angular momentum.

use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Inertia tensor in base axes.
pub(super) fn world_inertia(inertia: &Matrix3<f64>, attitude: &UnitQuaternion<f64>) -> Matrix3<f64> {
    let r = attitude.to_rotation_matrix().into_inner();
    r * inertia * r.transpose()
}

/// `I^-1 L` for a symmetric tensor, by cofactors.
pub(super) fn solve_inertia(inertia: &Matrix3<f64>, momentum: &Vector3<f64>) -> Vector3<f64> {
    let (a, b, c) = (inertia.column(0), inertia.column(1), inertia.column(2));
    let cofactors = Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
    cofactors.tr_mul(momentum) / a.dot(&cofactors.column(0))
}

/// Attitude after a time `h_s` of free rotation with a given angular momentum: midpoint rule.
pub(super) fn turn_freely(
    attitude: &UnitQuaternion<f64>,
    inertia: &Matrix3<f64>,
    momentum: &Vector3<f64>,
    h_s: f64,
) -> UnitQuaternion<f64> {
    let spin = |attitude: &UnitQuaternion<f64>| solve_inertia(&world_inertia(inertia, attitude), momentum);
    let half_way = turned(attitude, &(spin(attitude) * (0.5 * h_s)));
    turned(attitude, &(spin(&half_way) * h_s))
}

/// `exp(angle) attitude`, for a rotation vector in base axes.
fn turned(attitude: &UnitQuaternion<f64>, angle_rad: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = 0.5 * angle_rad.norm();
    let (sine, cosine) = half.sine_cosine();
    // sin(half) / |angle|, whose limit at no angle is one half.
    let share = if half > 1e-12 { 0.5 * sine / half } else { 0.5 };
    let turn = Quaternion::from_parts(cosine, angle_rad * share);
    UnitQuaternion::new_normalize(turn * attitude.into_inner())
}
