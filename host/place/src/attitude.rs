//! Attitudes and directions that are spread evenly, and the same on every machine.

use blindgrasp_shared::math::Real;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Attitudes that the search chooses among: no rotation, and so many others.
const SPREAD: usize = 144;

/// No rotation; then attitudes spread evenly over all (a Super-Fibonacci spiral, M. Alexa, CVPR 2022).
pub(super) fn spread() -> Vec<UnitQuaternion<f64>> {
    const PHI: f64 = std::f64::consts::SQRT_2;
    // The real root of psi^4 = psi + 4.
    const PSI: f64 = 1.533_751_168_755_204_3;
    let spiral = (0..SPREAD).map(|k| {
        let s = k as f64 + 0.5;
        let t = s / SPREAD as f64;
        let (small, large) = (t.square_root(), (1.0 - t).square_root());
        let (a_sine, a_cosine) = (TAU * s / PHI).sine_cosine();
        let (b_sine, b_cosine) = (TAU * s / PSI).sine_cosine();
        let quaternion = Quaternion::new(large * b_cosine, small * a_sine, small * a_cosine, large * b_sine);
        UnitQuaternion::new_normalize(quaternion)
    });
    std::iter::once(UnitQuaternion::identity()).chain(spiral).collect()
}

/// Directions spread evenly over the sphere (a Fibonacci lattice).
pub(super) fn directions(count: usize) -> Vec<Vector3<f64>> {
    // The golden angle.
    let step = TAU * (2.0 - (1.0 + 5.0_f64.square_root()) / 2.0);
    (0..count)
        .map(|k| {
            let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
            let radius = (1.0 - z * z).square_root();
            let (sine, cosine) = (k as f64 * step).sine_cosine();
            Vector3::new(radius * cosine, radius * sine, z)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The farthest rotation from the nearest of the spread. If balls of a radius could fill all rotations without overlap, 144 of
    /// them would have 29 degrees ((t - sin t) / pi of the whole each); no spread does as well.
    #[test]
    fn attitudes_leave_no_gap() {
        let spread = spread();
        let mut random = fastrand::Rng::with_seed(3);
        let mut worst: f64 = 0.0;
        for _ in 0..2000 {
            let mut part = || 2.0 * random.f64() - 1.0;
            let quaternion = Quaternion::new(part(), part(), part(), part());
            if !(0.1..=1.0).contains(&quaternion.norm()) {
                continue;
            }
            let any = UnitQuaternion::new_normalize(quaternion);
            let nearest = spread.iter().map(|one| any.angle_to(one)).fold(f64::INFINITY, f64::min);
            worst = worst.max(nearest);
        }
        assert!(worst < 50.0_f64.to_radians(), "{} degrees", worst.to_degrees());
    }

    #[test]
    fn directions_are_spread() {
        let all = directions(96);
        assert!(all.iter().all(|way| (way.norm() - 1.0).abs() < 1e-12));
        assert!(all.iter().sum::<Vector3<f64>>().norm() < 1.0);
        let nearest = |a: &Vector3<f64>| {
            let others = all.iter().filter(|b| *b != a).map(|b| (a - b).norm());
            others.fold(f64::INFINITY, f64::min)
        };
        // 96 evenly spread points are about 0.36 apart.
        assert!(all.iter().all(|a| (0.25..0.5).contains(&nearest(a))));
    }
}
