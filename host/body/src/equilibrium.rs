//! The forces at which a grasp settles (Eq. 57), and the indentations that belong to them.

use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

/// The indentations at which the normal forces are those of Eq. 57: `k dr^2 = f_d / sum(r) C_Y.(x_c - x_i)`, where the
/// fingertip centres are `x_i = contact point - (r - dr) C_Y`. In any frame.
///
/// # Errors
/// The first fingertip that the law would pull away from its face.
pub fn equilibrium_indentations(
    points_m: &[Vector3<f64>],
    inward_normals: &[Vector3<f64>],
    radii_m: &[f64],
    stiffnesses_n_m2: &[f64],
    force_n: f64,
) -> Result<Vec<f64>, usize> {
    let count = points_m.len();
    let gain = force_n / radii_m.iter().sum::<f64>();
    let mut indentations = vec![0.0; count];
    // A contraction by about 0.01 a turn for the hands of the paper.
    for _ in 0..200 {
        let centres: Vec<Vector3<f64>> =
            (0..count).map(|i| points_m[i] - inward_normals[i] * (radii_m[i] - indentations[i])).collect();
        let middle = centres.iter().sum::<Vector3<f64>>() / count as f64;
        let mut change: f64 = 0.0;
        for i in 0..count {
            let force = gain * inward_normals[i].dot(&(middle - centres[i]));
            if !(force > 0.0) {
                return Err(i);
            }
            let next = (force / stiffnesses_n_m2[i]).square_root();
            change = change.max((next - indentations[i]).abs());
            indentations[i] = next;
        }
        if change < 1e-16 {
            break;
        }
    }
    Ok(indentations)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equilibrium_needs_faces_that_look_outwards() {
        let points = [Vector3::x() * 0.03, Vector3::x() * -0.03];
        let normals = [-Vector3::x(), Vector3::x()];
        let found = equilibrium_indentations(&points, &normals, &[0.015; 2], &[2e6; 2], 5.0).unwrap();
        // k dr^2 = f_d / (2 r) (0.03 + r - dr)
        let left = 2e6 * found[0] * found[0] - 5.0 / 0.03 * (0.045 - found[0]);
        assert!(left.abs() < 1e-12);
        let inside_out =
            equilibrium_indentations(&points, &[normals[0], normals[0]], &[0.015; 2], &[2e6; 2], 5.0);
        assert_eq!(inside_out, Err(1));
    }
}
