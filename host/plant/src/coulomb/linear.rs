//! Matrices of blocks of four rows and columns, one a contact: factors in place, without allocation.
//!
//! A matrix of `n` by `n` blocks is a slice of them, row-major. Loops over four run all at once.

/// Four numbers of a contact.
pub(super) type Four = [f64; 4];

/// Four rows of a contact, and four columns of one.
pub(super) type Block = [Four; 4];

/// Nothing.
pub(super) const ZERO: Block = [[0.0; 4]; 4];

/// Overwrites a symmetric positive definite matrix `A = U^T D U`: on the right of the diagonal with the blocks of `D U`, mirrored
/// on its left with those of `U^T`, and on it with `U` and the inverse of `D`. Returns `false` if a pivot is not positive. Only
/// blocks on the diagonal and on the right of it are read. There are no roots to wait for.
pub(super) fn factorize(a: &mut [Block], n: usize) -> bool {
    for k in 0..n {
        let (above, rest) = a.split_at_mut((k + 1) * n);
        let (pivot, right) = above[k * n + k..].split_at_mut(1);
        let pivot = &mut pivot[0];
        if !factorize_block(pivot) {
            return false;
        }
        for (i, block) in right.iter_mut().enumerate() {
            for r in 0..4 {
                for below in r + 1..4 {
                    let row = block[r];
                    add_scaled(&mut block[below], -pivot[r][below], &row);
                }
            }
            let row_i = &mut rest[i * n + k..];
            row_i[0] = std::array::from_fn(|c| std::array::from_fn(|r| block[r][c] * pivot[r][r]));
        }
        for i in 0..right.len() {
            let row_i = &mut rest[i * n + k..(i + 1) * n];
            let (left, row_i) = row_i.split_at_mut(1);
            for (block, right_j) in row_i[i..].iter_mut().zip(&right[i..]) {
                subtract(block, &left[0], right_j);
            }
        }
    }
    true
}

/// The factor of one block: `U` above the diagonal, the inverse of `D` on it.
fn factorize_block(a: &mut Block) -> bool {
    for k in 0..4 {
        if !(a[k][k] > 0.0) {
            return false;
        }
        let (row_k, inverse) = (a[k], 1.0 / a[k][k]);
        for i in k + 1..4 {
            let factor = row_k[i] * inverse;
            a[k][i] = factor;
            add_scaled(&mut a[i], -factor, &row_k);
        }
        a[k][k] = inverse;
    }
    true
}

/// Subtracts `A B`.
#[inline(never)]
fn subtract(c: &mut Block, a: &Block, b: &Block) {
    let mut sums = *c;
    for k in 0..4 {
        for i in 0..4 {
            add_scaled(&mut sums[i], -a[i][k], &b[k]);
        }
    }
    *c = sums;
}

/// `A B`.
#[inline]
pub(super) fn product(a: &Block, b: &Block) -> Block {
    let mut c = [[0.0; 4]; 4];
    subtract(&mut c, &a.map(|row| row.map(|entry| -entry)), b);
    c
}

/// `A x`.
#[inline]
pub(super) fn times(a: &Block, x: &Four) -> Four {
    std::array::from_fn(|i| dot(&a[i], x))
}

/// `A^T`.
#[inline]
pub(super) fn transposed(a: &Block) -> Block {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Adds `a v`.
#[inline]
pub(super) fn add_scaled(sum: &mut Four, a: f64, v: &Four) {
    for (sum, v) in sum.iter_mut().zip(v) {
        *sum += a * v;
    }
}

/// Scalar product.
#[inline]
pub(super) fn dot(a: &Four, b: &Four) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

/// Solves with a factor, in place.
pub(super) fn solve(a: &[Block], n: usize, b: &mut [Four]) {
    for k in 0..n {
        let (done, below) = b.split_at_mut(k + 1);
        let (row, x) = (&a[k * n + k..(k + 1) * n], &mut done[k]);
        for i in 0..4 {
            for below in i + 1..4 {
                x[below] -= row[0][i][below] * x[i];
            }
        }
        for i in 0..4 {
            x[i] *= row[0][i][i];
        }
        for (below, block) in below.iter_mut().zip(&row[1..]) {
            add_transposed(below, block, &x.map(|x| -x));
        }
    }
    for k in (0..n).rev() {
        let (above, below) = b.split_at_mut(k + 1);
        let x = &mut above[k];
        for (i, y) in below.iter().enumerate() {
            add_transposed(x, &a[(k + 1 + i) * n + k], &y.map(|y| -y));
        }
        let own = &a[k * n + k];
        for i in (0..4).rev() {
            for right in i + 1..4 {
                x[i] -= own[i][right] * x[right];
            }
        }
    }
}

/// Adds `A^T x`.
#[inline]
pub(super) fn add_transposed(sum: &mut Four, a: &Block, x: &Four) {
    for (x, row) in x.iter().zip(a) {
        add_scaled(sum, *x, row);
    }
}

/// The sum of products of blocks and vectors.
#[inline]
pub(super) fn products<'a>(factors: impl Iterator<Item = (&'a Block, &'a Four)>) -> Four {
    let mut sums = ZERO;
    for (block, x) in factors {
        for (sums, row) in sums.iter_mut().zip(block) {
            for (sum, (a, x)) in sums.iter_mut().zip(row.iter().zip(x)) {
                *sum += a * x;
            }
        }
    }
    sums.map(|sums| (sums[0] + sums[1]) + (sums[2] + sums[3]))
}

/// Solves `A x = b` in place, by elimination block by block with pivots within them; `A` is overwritten. Returns `false` if a
/// block on the diagonal is singular.
pub(super) fn eliminate(a: &mut [Block], n: usize, b: &mut [Four]) -> bool {
    for k in 0..n {
        let (above, rest) = a.split_at_mut((k + 1) * n);
        let row_k = &mut above[k * n + k..];
        let Some(inverse) = inverse(&row_k[0]) else { return false };
        for block in &mut row_k[1..] {
            *block = product(&inverse, block);
        }
        b[k] = times(&inverse, &b[k]);
        let b_k = b[k];
        for (row, b) in rest.chunks_exact_mut(n).zip(&mut b[k + 1..]) {
            let (left, right) = row[k..].split_at_mut(1);
            for (block, block_k) in right.iter_mut().zip(&row_k[1..]) {
                subtract(block, &left[0], block_k);
            }
            add_scaled(b, -1.0, &times(&left[0], &b_k));
        }
    }
    for k in (0..n).rev() {
        let (above, below) = b.split_at_mut(k + 1);
        let sum = products(a[k * n + k + 1..(k + 1) * n].iter().zip(below.iter()));
        add_scaled(&mut above[k], -1.0, &sum);
    }
    true
}

/// The inverse of a block, by elimination with partial pivoting; `None` if it is singular.
fn inverse(a: &Block) -> Option<Block> {
    let mut a = *a;
    let mut inverse: Block = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for k in 0..4 {
        let mut pivot = k;
        for i in k + 1..4 {
            if a[i][k].abs() > a[pivot][k].abs() {
                pivot = i;
            }
        }
        let scale = 1.0 / a[pivot][k];
        if !scale.is_finite() {
            return None;
        }
        a.swap(k, pivot);
        inverse.swap(k, pivot);
        (a[k], inverse[k]) = (a[k].map(|entry| entry * scale), inverse[k].map(|entry| entry * scale));
        let (row_a, row_inverse) = (a[k], inverse[k]);
        for i in (0..4).filter(|&i| i != k) {
            let factor = a[i][k];
            add_scaled(&mut a[i], -factor, &row_a);
            add_scaled(&mut inverse[i], -factor, &row_inverse);
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_meshes::Numbers;

    const N: usize = 3;

    /// A matrix of blocks by its entries.
    fn blocks(entry: impl Fn(usize, usize) -> f64) -> Vec<Block> {
        let block = |k: usize| {
            let (i, j) = (4 * (k / N), 4 * (k % N));
            std::array::from_fn(|a| std::array::from_fn(|b| entry(i + a, j + b)))
        };
        (0..N * N).map(block).collect()
    }

    /// Tolerance: the matrices' condition is below 1e4.
    #[test]
    fn both_solve() {
        let mut numbers = Numbers(5);
        let root: Vec<Vec<f64>> =
            (0..4 * N).map(|_| (0..4 * N).map(|_| numbers.unit() - 0.5).collect()).collect();
        let x: Vec<Four> = (0..N).map(|_| std::array::from_fn(|_| numbers.unit())).collect();
        let product = |i: usize, j: usize| root[i].iter().zip(&root[j]).map(|(a, b)| a * b).sum::<f64>();
        let mut symmetric = blocks(|i, j| product(i, j) + if i == j { 0.1 } else { 0.0 });
        let mut any = blocks(|i, j| root[i][j]);
        let right = |a: &[Block]| -> Vec<Four> {
            let row = |i: usize| {
                let mut sum = [0.0; 4];
                for (block, x) in a[i * N..].iter().zip(&x) {
                    add_scaled(&mut sum, 1.0, &times(block, x));
                }
                sum
            };
            (0..N).map(row).collect()
        };
        let (mut b, mut c) = (right(&symmetric), right(&any));
        assert!(factorize(&mut symmetric, N));
        solve(&symmetric, N, &mut b);
        assert!(eliminate(&mut any, N, &mut c));
        for ((b, c), x) in b.iter().zip(&c).zip(&x) {
            for k in 0..4 {
                assert!((b[k] - x[k]).abs() < 1e-12 && (c[k] - x[k]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn singular_matrices_are_told() {
        let ones = [[[1.0; 4]; 4]];
        assert!(!factorize(&mut ones.clone(), 1));
        assert!(!factorize(&mut [[[f64::NAN; 4]; 4]], 1));
        assert!(!eliminate(&mut ones.clone(), 1, &mut [[1.0; 4]]));
    }
}
