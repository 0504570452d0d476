//! The check of a hand's description: all that is wrong with a joint or a fingertip, and the first of it in a hand.

use super::model::{Fingertip, HandError, Joint, Link};
use crate::math::{Real, norm};
use nalgebra::{Matrix3, Vector3};

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

impl<T: Real> Joint<T> {
    /// Returns the parameters that are not what they have to be, each with what that is.
    pub fn faults(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let Link { mass_kg, mass_centre_m, inertia_kg_m2 } = &self.link;
        let (lower, upper) = (self.lower_rad, self.upper_rad);
        // The comparisons are written so that NaN fails them.
        faults([
            (are_finite(&self.offset_m), "offset", "has to be finite"),
            (is_rotation(&self.attitude), "attitude", "has to be a rotation"),
            ((norm(&self.axis) - T::one()).magnitude() < tolerance(), "axis", "has to be a unit vector"),
            (
                lower.is_finite() && upper.is_finite() && lower < upper,
                "limits",
                "have to be finite, the lower below the upper",
            ),
            (*mass_kg >= T::zero() && mass_kg.is_finite(), "mass", "has to be zero or positive"),
            (are_finite(mass_centre_m), "mass centre", "has to be finite"),
            (is_semidefinite(inertia_kg_m2), "inertia", "has to be symmetric and positive semidefinite"),
        ])
    }
}

impl<T: Real> Fingertip<T> {
    /// Returns the parameters other than its link that are not what they have to be, each with what that is.
    pub fn faults(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let radius_m = self.radius_m;
        faults([
            (are_finite(&self.offset_m), "offset", "has to be finite"),
            (radius_m > T::zero() && radius_m.is_finite(), "radius", "has to be positive"),
        ])
    }
}

fn faults<const N: usize>(
    checks: [(bool, &'static str, &'static str); N],
) -> impl Iterator<Item = (&'static str, &'static str)> {
    checks.into_iter().filter_map(|(is_right, parameter, reason)| (!is_right).then_some((parameter, reason)))
}

pub(super) fn check_joint<T: Real>(k: usize, joint: &Joint<T>) -> Result<(), HandError> {
    let fault = joint.faults().next();
    fault.map_or(Ok(()), |(parameter, reason)| Err(HandError::Joint { joint: k, parameter, reason }))
}

pub(super) fn check_fingertip<T: Real>(
    i: usize,
    fingertip: &Fingertip<T>,
    joints: usize,
) -> Result<(), HandError> {
    let link = (fingertip.link >= joints).then_some(("link", "has to be the index of a joint"));
    let fault = link.or_else(|| fingertip.faults().next());
    fault.map_or(Ok(()), |(parameter, reason)| Err(HandError::Fingertip { fingertip: i, parameter, reason }))
}

fn are_finite<T: Real>(v: &Vector3<T>) -> bool {
    v.iter().all(|v| v.is_finite())
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
