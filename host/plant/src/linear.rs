//! Cholesky factors of small dense matrices of a run-time size, in place and without allocation.
//!
//! Matrices are row-major arrays with a fixed stride `S`, of which the first `n` rows and columns count.

use blindgrasp_shared::math::Real;

/// Overwrites the lower triangle of a symmetric positive definite matrix with its Cholesky factor, the diagonal stored
/// inverted. Returns the least pivot relative to its diagonal entry: how far the matrix is from singular. A pivot that
/// is not positive (or NaN) stops the factorization and is returned as it is.
#[inline]
pub(super) fn factorize<const S: usize>(a: &mut [[f64; S]; S], n: usize) -> f64 {
    let mut least: f64 = 1.0;
    for j in 0..n {
        let diagonal = a[j][j];
        let mut pivot = diagonal;
        for k in 0..j {
            pivot -= a[j][k] * a[j][k];
        }
        let relative = pivot / diagonal;
        if pivot.is_nan() {
            return f64::NAN;
        }
        if !(relative > 0.0 && diagonal > 0.0) {
            return relative.min(0.0);
        }
        least = least.min(relative);
        let inverse = 1.0 / pivot.square_root();
        a[j][j] = inverse;
        for i in j + 1..n {
            let mut entry = a[i][j];
            for k in 0..j {
                entry -= a[i][k] * a[j][k];
            }
            a[i][j] = entry * inverse;
        }
    }
    least
}

/// Solves `L y = b` in place.
#[inline]
pub(super) fn forward<const S: usize>(l: &[[f64; S]; S], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let mut entry = b[i];
        for k in 0..i {
            entry -= l[i][k] * b[k];
        }
        b[i] = entry * l[i][i];
    }
}

/// Solves `L^T x = y` in place.
#[inline]
pub(super) fn backward<const S: usize>(l: &[[f64; S]; S], n: usize, y: &mut [f64]) {
    for i in (0..n).rev() {
        let mut entry = y[i];
        for k in i + 1..n {
            entry -= l[k][i] * y[k];
        }
        y[i] = entry * l[i][i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_known_system() {
        let a = [[4.0, 2.0, 0.4], [2.0, 5.0, 1.0], [0.4, 1.0, 3.0]];
        let mut l = a;
        assert!(factorize(&mut l, 3) > 0.5);
        let mut x = [1.0, -2.0, 0.5];
        forward(&l, 3, &mut x);
        backward(&l, 3, &mut x);
        for (row, right) in a.iter().zip([1.0, -2.0, 0.5]) {
            let left: f64 = row.iter().zip(x).map(|(a, x)| a * x).sum();
            assert!((left - right).abs() < 1e-15);
        }
    }

    #[test]
    fn singular_and_nan_matrices_are_told() {
        assert!(factorize(&mut [[1.0, 1.0], [1.0, 1.0]], 2) <= 0.0);
        assert!(factorize(&mut [[1.0, 0.0], [f64::NAN, 1.0]], 2).is_nan());
        assert!(factorize(&mut [[0.0]], 1) <= 0.0);
    }
}
