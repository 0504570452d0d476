//! The check of a hand's description: the first thing that is wrong, with the joint or fingertip that it is wrong with.

use super::model::{Fingertip, HandError, Joint};
use crate::math::{Real, norm};
use nalgebra::Matrix3;

pub(super) fn check_counts<const J: usize, const F: usize>(
    joints: usize,
    fingertips: usize,
) -> Result<(), HandError> {
    if joints == 0 {
        return Err(HandError::NoJoints);
    }
    if fingertips < 2 {
        return Err(HandError::TooFewFingertips { count: fingertips });
    }
    if joints > J {
        return Err(HandError::TooManyJoints { count: joints, capacity: J });
    }
    if fingertips > F {
        return Err(HandError::TooManyFingertips { count: fingertips, capacity: F });
    }
    Ok(())
}

/// Returns the largest difference of a given unit vector, rotation or symmetric tensor from a true one: file formats
/// print six digits.
fn tolerance<T: Real>() -> T {
    T::from_f64(1e-5)
}

pub(super) fn check_joint<T: Real>(k: usize, joint: &Joint<T>) -> Result<(), HandError> {
    let fail = |parameter, reason| Err(HandError::Joint { joint: k, parameter, reason });
    if !joint.offset_m.iter().all(|v| v.is_finite()) {
        return fail("offset", "has to be finite");
    }
    if !is_rotation(&joint.attitude) {
        return fail("attitude", "has to be a rotation");
    }
    // The comparisons are written so that NaN fails them.
    if !((norm(&joint.axis) - T::one()).magnitude() < tolerance()) {
        return fail("axis", "has to be a unit vector");
    }
    if !(joint.lower_rad.is_finite() && joint.upper_rad.is_finite() && joint.lower_rad < joint.upper_rad) {
        return fail("limits", "have to be finite, the lower below the upper");
    }
    if !(joint.link.mass_kg >= T::zero() && joint.link.mass_kg.is_finite()) {
        return fail("mass", "has to be zero or positive");
    }
    if !joint.link.mass_centre_m.iter().all(|v| v.is_finite()) {
        return fail("mass centre", "has to be finite");
    }
    if !is_semidefinite(&joint.link.inertia_kg_m2) {
        return fail("inertia", "has to be symmetric and positive semidefinite");
    }
    Ok(())
}

pub(super) fn check_fingertip<T: Real>(
    i: usize,
    fingertip: &Fingertip<T>,
    joints: usize,
) -> Result<(), HandError> {
    let fail = |parameter, reason| Err(HandError::Fingertip { fingertip: i, parameter, reason });
    if fingertip.link >= joints {
        return fail("link", "has to be the index of a joint");
    }
    if !fingertip.offset_m.iter().all(|v| v.is_finite()) {
        return fail("offset", "has to be finite");
    }
    if !(fingertip.radius_m > T::zero() && fingertip.radius_m.is_finite()) {
        return fail("radius", "has to be positive");
    }
    Ok(())
}

fn is_rotation<T: Real>(m: &Matrix3<T>) -> bool {
    let product = m.transpose() * m - Matrix3::identity();
    let (x, y, z) = (m.column(0), m.column(1), m.column(2));
    product.iter().all(|v| v.magnitude() < tolerance()) && x.cross(&y).dot(&z) > T::zero()
}

/// Symmetric, with no negative principal minor beyond rounding.
fn is_semidefinite<T: Real>(m: &Matrix3<T>) -> bool {
    let largest = m.iter().fold(T::zero(), |a, v| if v.magnitude() > a { v.magnitude() } else { a });
    if !(m.iter().all(|v| v.is_finite()) && largest.is_finite()) {
        return false;
    }
    if largest.is_zero() {
        return true;
    }
    let m = m / largest;
    let slack = -tolerance::<T>();
    let minor = |a: usize, b: usize| m[(a, a)] * m[(b, b)] - m[(a, b)] * m[(b, a)];
    let determinant = m.column(0).cross(&m.column(1)).dot(&m.column(2));
    (m - m.transpose()).iter().all(|v| v.magnitude() < tolerance())
        && (0..3).all(|k| m[(k, k)] >= slack)
        && minor(0, 1) >= slack
        && minor(0, 2) >= slack
        && minor(1, 2) >= slack
        && determinant >= slack
}
