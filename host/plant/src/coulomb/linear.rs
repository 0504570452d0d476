//! Dense matrices of a run-time size, row-major in a slice: factors in place, without allocation.

use blindgrasp_shared::math::Real;

/// Overwrites the lower triangle of a symmetric positive definite matrix with its Cholesky factor, the diagonal stored
/// inverted. Returns `false` if a pivot is not positive.
pub(super) fn cholesky(a: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        for i in j..n {
            let (rows_above, row_i) = a.split_at_mut(i * n);
            let row_j = if i == j { &*row_i } else { &rows_above[j * n..] };
            let entry = row_i[j] - dot(&row_i[..j], &row_j[..j]);
            if i == j {
                if !(entry > 0.0) {
                    return false;
                }
                row_i[j] = 1.0 / entry.square_root();
            } else {
                row_i[j] = entry * row_j[j];
            }
        }
    }
    true
}

/// Solves with a Cholesky factor, in place.
pub(super) fn cholesky_solve(l: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        b[i] = (b[i] - dot(&l[i * n..i * n + i], &b[..i])) * l[i * n + i];
    }
    for i in (0..n).rev() {
        b[i] *= l[i * n + i];
        let (above, x) = b.split_at_mut(i);
        for (entry, l) in above.iter_mut().zip(&l[i * n..]) {
            *entry -= l * x[0];
        }
    }
}

/// Solves `A x = b` in place, by elimination with partial pivoting; `A` is overwritten. Returns `false` if it is singular.
pub(super) fn eliminate(a: &mut [f64], n: usize, b: &mut [f64]) -> bool {
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs())).unwrap_or(k);
        if !(a[pivot * n + k].abs() > 0.0 && a[pivot * n + k].is_finite()) {
            return false;
        }
        if pivot != k {
            for j in k..n {
                a.swap(k * n + j, pivot * n + j);
            }
            b.swap(k, pivot);
        }
        let (above, below) = a.split_at_mut((k + 1) * n);
        let row_k = &above[k * n..];
        let inverse = 1.0 / row_k[k];
        for (i, row) in below.chunks_exact_mut(n).enumerate() {
            let factor = row[k] * inverse;
            if factor != 0.0 {
                for j in k + 1..n {
                    row[j] -= factor * row_k[j];
                }
                b[k + 1 + i] -= factor * b[k];
            }
        }
    }
    for k in (0..n).rev() {
        let row = &a[k * n..];
        b[k] = (b[k] - dot(&row[k + 1..n], &b[k + 1..n])) / row[k];
    }
    true
}

/// Scalar product.
#[inline]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums that do not wait for each other.
    let mut sums = [0.0; 4];
    let (mut a, mut b) = (a.chunks_exact(4), b[..a.len()].chunks_exact(4));
    for (a, b) in a.by_ref().zip(b.by_ref()) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_meshes::Numbers;

    /// Tolerance: the matrices' condition is below 1e4.
    #[test]
    fn both_solve() {
        const N: usize = 7;
        let mut numbers = Numbers(5);
        let root: Vec<f64> = (0..N * N).map(|_| numbers.unit() - 0.5).collect();
        let mut a = vec![0.0; N * N];
        for (i, j) in (0..N * N).map(|k| (k / N, k % N)) {
            a[i * N + j] = dot(&root[i * N..][..N], &root[j * N..][..N]) + if i == j { 0.1 } else { 0.0 };
        }
        let x: Vec<f64> = (0..N).map(|_| numbers.unit()).collect();
        let times = |a: &[f64]| (0..N).map(|i| dot(&a[i * N..][..N], &x)).collect::<Vec<_>>();
        let (mut b, mut l) = (times(&a), a);
        assert!(cholesky(&mut l, N));
        cholesky_solve(&l, N, &mut b);
        let (mut c, mut u) = (times(&root), root.clone());
        assert!(eliminate(&mut u, N, &mut c));
        for k in 0..N {
            assert!((b[k] - x[k]).abs() < 1e-12 && (c[k] - x[k]).abs() < 1e-12);
        }
    }

    #[test]
    fn singular_matrices_are_told() {
        assert!(!cholesky(&mut [1.0, 1.0, 1.0, 1.0], 2));
        assert!(!cholesky(&mut [f64::NAN], 1));
        assert!(!eliminate(&mut [1.0, 1.0, 1.0, 1.0], 2, &mut [1.0, 1.0]));
    }
}
