//! One contact with friction, all others as they are.

use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};

/// Forces of one contact: normal first, then tangential ones, of which there are none, two or three. `own` is its block of the
/// Delassus matrix, with the softness of its normal, and `free` are the velocities that it has to take away.
pub(super) fn one_contact(own: &[[f64; 4]; 4], free: &[f64; 4], tangents: usize, friction: f64) -> [f64; 4] {
    let mut forces = [0.0; 4];
    // l_n = alpha - beta . l_t
    let alpha = -free[0] / own[0][0];
    if !(alpha > 0.0) {
        return forces;
    }
    if tangents == 0 {
        forces[0] = alpha;
        return forces;
    }
    let beta = Vector3::new(own[0][1], own[0][2], own[0][3]) / own[0][0];
    let mut s = Matrix3::identity();
    let mut right = Vector3::zeros();
    for i in 0..tangents {
        for j in 0..tangents {
            s[(i, j)] = own[i + 1][j + 1] - own[i + 1][0] * beta[j];
        }
        right[i] = -(free[i + 1] + own[i + 1][0] * alpha);
    }
    // (S + kappa) l_t = right, with the least kappa for which l_t is in its ball: the secular equation of trust regions,
    // 1 / |l_t| - 1 / radius = 0, which is nearly linear in kappa.
    let solve = |kappa: f64| {
        let inverse = (s + Matrix3::from_diagonal_element(kappa)).try_inverse().unwrap_or_default();
        let tangential = inverse * right;
        let radius = friction * (alpha - beta.dot(&tangential));
        let squared = tangential.norm_squared();
        let excess = squared.square_root() - radius;
        let step = squared / tangential.dot(&(inverse * tangential)) * excess / radius;
        (tangential, excess, if radius > 0.0 { kappa + step } else { f64::NAN })
    };
    let (mut tangential, mut excess, mut next) = solve(0.0);
    if excess > 0.0 {
        let (mut low, mut high, mut kappa) = (0.0, f64::INFINITY, 0.0);
        for _ in 0..100 {
            kappa = if next > low && next < high {
                next
            } else if high.is_finite() {
                0.5 * (low + high)
            } else {
                4.0 * kappa + s.trace()
            };
            (tangential, excess, next) = solve(kappa);
            if excess > 0.0 {
                low = kappa
            } else {
                high = kappa
            }
            let is_closed = high.is_finite() && high - low <= 1e-15 * high;
            if excess.abs() <= 1e-14 * tangential.norm() || is_closed {
                break;
            }
        }
    }
    forces[0] = (alpha - beta.dot(&tangential)).max(0.0);
    forces[1..].copy_from_slice(tangential.as_slice());
    forces
}

/// Length of a vector.
pub(super) fn length(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().square_root()
}

/// Shortens a vector to a radius.
pub(super) fn into_ball(v: &mut [f64], radius: f64) {
    let long = length(v);
    if long > radius {
        for v in v {
            *v *= radius / long;
        }
    }
}
