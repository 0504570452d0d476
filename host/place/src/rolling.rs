//! The rest of the fingertips under the law, if they could move freely: how far they roll, by Eqs. 30 to 34.
//!
//! Seen from the object, a fingertip that rolls on its face without slip or spin moves by `d_i` in the plane of the face and
//! turns by `psi_i = d_i x C_Yi / rho_i` (`rho_i = r_i - dr_i`). The normal stiffness is some fifty times the pull of the law,
//! so that the distance from the face stays. What the law's potentials (Eqs. 43, 44) are of these displacements is, to second
//! order,
//!
//! ```text
//! V(d) = A/2 sum_i |x_i + d_i - (x_c + d_c)|^2 + K_st sum_i |psi_i - psi_(i+1)|^2,    A = f_d / sum(r)
//! ```
//!
//! Its gradient at `d = 0` is minus the tangential part of the pull `F_i = A (x_c - x_i)`, and where it vanishes, every
//! tangential force is carried by a moment of `u_st`: Eqs. 53 and 54. V is convex; so there is one such place, `H d = F_t`.
//! Real fingers can't move their fingertips freely, and swing about that place before they rest there.

use super::facet::Facet;
use blindgrasp_body::MAX_FINGERS;
use nalgebra::{SMatrix, SVector, Vector2, Vector3};

/// Coordinates of all contacts: two a fingertip; zero beyond the hand's.
pub(super) const COORDINATES: usize = 2 * MAX_FINGERS;
/// One number a coordinate.
pub(super) type Coordinates = SVector<f64, COORDINATES>;
type Square = SMatrix<f64, COORDINATES, COORDINATES>;

/// The gains of the law, as far as they decide about forces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    /// `A = f_d / sum(r)` (Eq. 38), N/m.
    pub(super) approach_n_m: f64,
    /// `K_st`, N m.
    pub(super) attitude_nm: f64,
}

/// Chosen faces with contacts in their middles, where all coordinates are zero.
pub(super) struct Middle {
    count: usize,
    gains: Gains,
    inwards: [Vector3<f64>; MAX_FINGERS],
    axes: [[Vector3<f64>; 2]; MAX_FINGERS],
    /// Fingertip centres, m.
    centres_m: [Vector3<f64>; MAX_FINGERS],
    /// Their mean, m.
    centroid_m: Vector3<f64>,
    rolling_radii_m: [f64; MAX_FINGERS],
}

impl Middle {
    /// Fingertips with these rolling radii `rho_i` (m) on these faces.
    pub(super) fn new(facets: &[&Facet], rolling_radii_m: &[f64], gains: Gains) -> Self {
        let count = facets.len();
        let mut middle = Self {
            count,
            gains,
            inwards: [Vector3::zeros(); MAX_FINGERS],
            axes: [[Vector3::zeros(); 2]; MAX_FINGERS],
            centres_m: [Vector3::zeros(); MAX_FINGERS],
            centroid_m: Vector3::zeros(),
            rolling_radii_m: [1.0; MAX_FINGERS],
        };
        for (i, facet) in facets.iter().enumerate() {
            middle.inwards[i] = facet.inward;
            middle.axes[i] = facet.axes;
            middle.rolling_radii_m[i] = rolling_radii_m[i];
            middle.centres_m[i] = facet.origin_m - facet.inward * rolling_radii_m[i];
            middle.centroid_m += middle.centres_m[i] / count as f64;
        }
        middle
    }

    /// The least depth of the centroid below a fingertip along its normal, m: Eq. 57 over `A`.
    pub(super) fn least_depth_m(&self) -> f64 {
        (0..self.count)
            .map(|i| self.inwards[i].dot(&(self.centroid_m - self.centres_m[i])))
            .fold(f64::INFINITY, f64::min)
    }

    /// Mean of the squares of the angles by which the fingertips roll, rad^2.
    pub(super) fn mean_square_turn(&self) -> f64 {
        let rolled =
            self.hessian_n_m(&self.approach_n_m()).cholesky().map(|factor| factor.solve(&self.pull_n()));
        let square =
            |row: usize, d: f64| (d / self.rolling_radii_m[row / 2]) * (d / self.rolling_radii_m[row / 2]);
        rolled.map_or(f64::NAN, |rolled| {
            rolled.iter().enumerate().map(|(row, &d)| square(row, d)).sum::<f64>() / self.count as f64
        })
    }

    /// Tangential pull `F_t` on each fingertip, N.
    fn pull_n(&self) -> Coordinates {
        let mut pull = Coordinates::zeros();
        for i in 0..self.count {
            for a in 0..2 {
                let away = self.centroid_m - self.centres_m[i];
                pull[2 * i + a] = self.gains.approach_n_m * self.axes[i][a].dot(&away);
            }
        }
        pull
    }

    /// The curvature of the first term of V, N/m.
    fn approach_n_m(&self) -> Square {
        let share = 1.0 / self.count as f64;
        let mut approach = Square::zeros();
        for i in 0..self.count {
            for j in 0..self.count {
                for (a, b) in PAIRS {
                    let own = if i == j && a == b { 1.0 } else { 0.0 };
                    approach[(2 * i + a, 2 * j + b)] =
                        self.gains.approach_n_m * (own - share * self.axes[i][a].dot(&self.axes[j][b]));
                }
            }
        }
        approach
    }

    /// The curvature H of V, N/m; one where there is no fingertip.
    fn hessian_n_m(&self, approach: &Square) -> Square {
        let mut hessian = *approach;
        // A trace of stiffness everywhere: without u_st, two fingertips may roll to and fro between parallel faces.
        for row in 0..COORDINATES {
            hessian[(row, row)] += if row < 2 * self.count { 1e-9 * self.gains.approach_n_m } else { 1.0 };
        }
        let turn = |i: usize, a: usize| self.axes[i][a].cross(&self.inwards[i]) / self.rolling_radii_m[i];
        let stiffness = 2.0 * self.gains.attitude_nm;
        for i in 0..self.count {
            let next = (i + 1) % self.count;
            for (a, b) in PAIRS {
                let between = stiffness * turn(i, a).dot(&turn(next, b));
                hessian[(2 * i + a, 2 * i + b)] += stiffness * turn(i, a).dot(&turn(i, b));
                hessian[(2 * next + a, 2 * next + b)] += stiffness * turn(next, a).dot(&turn(next, b));
                hessian[(2 * i + a, 2 * next + b)] -= between;
                hessian[(2 * next + b, 2 * i + a)] -= between;
            }
        }
        hessian
    }
}

/// Both axes of the one face with both of the other.
const PAIRS: [(usize, usize); 4] = [(0, 0), (0, 1), (1, 0), (1, 1)];

/// Chosen faces with contacts anywhere: everything is linear in their coordinates `z`.
pub(super) struct Rolling {
    middle: Middle,
    /// Tangential pull at `z = 0`, N.
    pull_n: Coordinates,
    /// Its slope with the coordinates, N/m.
    pull_slope_n_m: Square,
    /// By how much the fingertips roll from `z = 0`, `d_i / rho_i`, rad.
    turns_rad: Coordinates,
    /// Its slope with the coordinates, rad/m.
    turn_slope: Square,
    /// Curvature of the mean square turn, rad^2/m^2.
    turn_bend: Square,
}

impl Rolling {
    /// Of fingertips with these rolling radii `rho_i` (m) on these faces.
    pub(super) fn new(facets: &[&Facet], rolling_radii_m: &[f64], gains: Gains) -> Self {
        let middle = Middle::new(facets, rolling_radii_m, gains);
        let (pull_n, approach) = (middle.pull_n(), middle.approach_n_m());
        // Positive definite by construction; if rounding has it otherwise, nothing is known: NaN, which no check passes.
        let (mut turns_rad, mut turn_slope) = middle
            .hessian_n_m(&approach)
            .cholesky()
            .map_or((Coordinates::repeat(f64::NAN), Square::repeat(f64::NAN)), |factor| {
                (factor.solve(&pull_n), -factor.solve(&approach))
            });
        for row in 0..COORDINATES {
            let radius = middle.rolling_radii_m[row / 2];
            turns_rad[row] /= radius;
            turn_slope.row_mut(row).scale_mut(1.0 / radius);
        }
        let turn_bend = turn_slope.tr_mul(&turn_slope) * (2.0 / middle.count as f64);
        Self { middle, pull_n, pull_slope_n_m: -approach, turns_rad, turn_slope, turn_bend }
    }

    /// Returns the number of fingertips.
    pub(super) fn count(&self) -> usize {
        self.middle.count
    }

    /// By how much a fingertip rolls from contacts at `z`, as `d_i / rho_i` in the axes of its face, rad.
    pub(super) fn turn_rad(&self, z: &Coordinates, fingertip: usize) -> Vector2<f64> {
        of(&(self.turns_rad + self.turn_slope * z), fingertip)
    }

    /// Rolling radius `rho_i` of a fingertip, m.
    pub(super) fn rolling_radius_m(&self, fingertip: usize) -> f64 {
        self.middle.rolling_radii_m[fingertip]
    }

    /// Tangential pull `F_t` on a fingertip, N, in the axes of its face.
    pub(super) fn pull_n(&self, z: &Coordinates, fingertip: usize) -> Vector2<f64> {
        of(&(self.pull_n + self.pull_slope_n_m * z), fingertip)
    }

    /// Normal force of Eq. 57 at each contact, N: negative where the law pulls a fingertip away from its face.
    pub(super) fn normal_n(&self, z: &Coordinates, fingertip: usize) -> f64 {
        let middle = (0..self.middle.count).map(|i| self.centre_m(z, i)).sum::<Vector3<f64>>()
            / self.middle.count as f64;
        let away = middle - self.centre_m(z, fingertip);
        self.middle.gains.approach_n_m * self.middle.inwards[fingertip].dot(&away)
    }

    /// Returns the depth of a fingertip's centre below the centroid along its normal, m (the force of Eq. 57 over `A`):
    /// the value at `z = 0`, and its slope.
    pub(super) fn depth_row(&self, fingertip: usize) -> (f64, Coordinates) {
        let inward = &self.middle.inwards[fingertip];
        let share = 1.0 / self.middle.count as f64;
        let middle = self.middle.centres_m[..self.middle.count].iter().sum::<Vector3<f64>>() * share;
        let mut slope = Coordinates::zeros();
        for j in (0..self.middle.count).filter(|&j| j != fingertip) {
            for a in 0..2 {
                slope[2 * j + a] = share * inward.dot(&self.middle.axes[j][a]);
            }
        }
        (inward.dot(&(middle - self.middle.centres_m[fingertip])), slope)
    }

    /// Centre of a fingertip, object frame, m.
    pub(super) fn centre_m(&self, z: &Coordinates, fingertip: usize) -> Vector3<f64> {
        let [x, y] = self.middle.axes[fingertip];
        self.middle.centres_m[fingertip] + x * z[2 * fingertip] + y * z[2 * fingertip + 1]
    }

    /// Returns the slope of the distance of two fingertips' centres along a direction with the coordinates.
    pub(super) fn apart_slope(&self, i: usize, j: usize, along: &Vector3<f64>) -> Coordinates {
        let mut slope = Coordinates::zeros();
        for a in 0..2 {
            slope[2 * i + a] += along.dot(&self.middle.axes[i][a]);
            slope[2 * j + a] -= along.dot(&self.middle.axes[j][a]);
        }
        slope
    }

    /// Mean of the squares of the angles by which the fingertips roll, `theta_i = |d_i| / rho_i`, rad^2.
    pub(super) fn mean_square_turn(&self, z: &Coordinates) -> f64 {
        let turn = self.turns_rad + self.turn_slope * z;
        turn.norm_squared() / self.middle.count as f64
    }

    /// The same, with its slope and its curvature.
    pub(super) fn mean_square_turn_derivatives(&self, z: &Coordinates) -> (f64, Coordinates, Square) {
        let turn = self.turns_rad + self.turn_slope * z;
        let share = 1.0 / self.middle.count as f64;
        (turn.norm_squared() * share, self.turn_slope.tr_mul(&turn) * (2.0 * share), self.turn_bend)
    }
}

/// The coordinates of one fingertip.
pub(super) fn of(z: &Coordinates, fingertip: usize) -> Vector2<f64> {
    Vector2::new(z[2 * fingertip], z[2 * fingertip + 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_body::polyhedron::Polyhedron;
    use blindgrasp_shared::math::Real;
    use nalgebra::{DMatrix, DVector, Matrix3, Rotation3};

    const RADII_M: [f64; 4] = [0.0138, 0.0138, 0.02, 0.01];
    const GAINS: Gains = Gains { approach_n_m: 111.0, attitude_nm: 5e-3 };

    /// The law's potentials as printed (Eqs. 43, 44), of fingertips that have rolled by `d`.
    fn potential_j(rolling: &Rolling, z: &Coordinates, d: &DVector<f64>) -> f64 {
        let count = rolling.count();
        let mut centres = Vec::new();
        let mut attitudes: Vec<Matrix3<f64>> = Vec::new();
        for i in 0..count {
            let [x, y] = rolling.middle.axes[i];
            let moved = x * d[2 * i] + y * d[2 * i + 1];
            let turn = moved.cross(&rolling.middle.inwards[i]) / RADII_M[i];
            centres.push(rolling.centre_m(z, i) + moved);
            attitudes.push(Rotation3::from_scaled_axis(turn).into_inner());
        }
        let mut squares = 0.0;
        let mut traces = 0.0;
        for i in 0..count {
            squares +=
                centres.iter().map(|other: &Vector3<f64>| (centres[i] - other).norm_squared()).sum::<f64>();
            traces += (attitudes[i].transpose() * attitudes[(i + 1) % count]).trace();
        }
        GAINS.approach_n_m / (4.0 * count as f64) * squares - GAINS.attitude_nm * traces
    }

    /// The fingertips roll to where the potential is least, by differences.
    #[test]
    fn fingertips_roll_to_where_the_potential_is_least() {
        let shape = Polyhedron::regular_prism(5, 0.04, 0.05).unwrap();
        let facets: Vec<Facet> = (0..shape.faces.len()).map(|face| Facet::of(&shape, face)).collect();
        for faces in [vec![0, 2], vec![0, 2, 3], vec![4, 1, 6, 2]] {
            let facets: Vec<&Facet> = faces.iter().map(|&face: &usize| &facets[face]).collect();
            let rolling = Rolling::new(&facets, &RADII_M, GAINS);
            let rows = 2 * facets.len();
            let z = Coordinates::from_fn(
                |row, _| if row < rows { 1e-3 * ((row * 7 % 5) as f64 - 2.0) } else { 0.0 },
            );
            let at = |d: &DVector<f64>| potential_j(&rolling, &z, d);
            let h = 1e-5;
            let unit =
                |row: usize, size: f64| DVector::from_fn(rows, |k, _| if k == row { size } else { 0.0 });
            let slope = DVector::from_fn(rows, |row, _| (at(&unit(row, h)) - at(&unit(row, -h))) / (2.0 * h));
            let bend = DMatrix::from_fn(rows, rows, |a, b| {
                let corner = |p: f64, q: f64| at(&(unit(a, p * h) + unit(b, q * h)));
                (corner(1.0, 1.0) - corner(1.0, -1.0) - corner(-1.0, 1.0) + corner(-1.0, -1.0))
                    / (4.0 * h * h)
            });
            let roll = -bend.lu().solve(&slope).unwrap();
            let mut squares = 0.0;
            for i in 0..facets.len() {
                let turn = rolling.turn_rad(&z, i);
                for a in 0..2 {
                    // Differences of 1e-5 m of potentials near 0.1 J: 1e-6 of them are lost.
                    assert!((turn[a] - roll[2 * i + a] / RADII_M[i]).abs() < 1e-3, "{turn} {roll}");
                }
                // Minus the slope is the pull.
                let pull = rolling.pull_n(&z, i);
                assert!((pull[0] + slope[2 * i]).abs() < 1e-7 && (pull[1] + slope[2 * i + 1]).abs() < 1e-7);
                squares += turn.norm_squared();
            }
            assert!((rolling.mean_square_turn(&z) - squares / facets.len() as f64).abs() < 1e-12);
            let middle = Middle::new(&facets, &RADII_M, GAINS);
            let none = Coordinates::zeros();
            assert!((middle.mean_square_turn() - rolling.mean_square_turn(&none)).abs() < 1e-12);
            let depths = (0..facets.len()).map(|i| rolling.normal_n(&none, i) / GAINS.approach_n_m);
            assert!((middle.least_depth_m() - depths.fold(f64::INFINITY, f64::min)).abs() < 1e-15);
        }
    }

    /// The derivatives that the choice of points uses, against differences.
    #[test]
    fn slopes_are_those_of_the_values() {
        let shape = Polyhedron::cuboid([0.04, 0.05, 0.06]).unwrap();
        let facets: Vec<Facet> = [0, 1, 2].iter().map(|&face| Facet::of(&shape, face)).collect();
        let facets: Vec<&Facet> = facets.iter().collect();
        let rolling = Rolling::new(&facets, &RADII_M, GAINS);
        let z = Coordinates::from_fn(|row, _| if row < 6 { 1e-3 * row as f64 } else { 0.0 });
        let (_, slope, _) = rolling.mean_square_turn_derivatives(&z);
        for row in 0..6 {
            let step = |size: f64| Coordinates::from_fn(|k, _| if k == row { size } else { 0.0 });
            let value = |size: f64| rolling.mean_square_turn(&(z + step(size)));
            assert!(
                (slope[row] - (value(1e-4) - value(-1e-4)) / 2e-4).abs() < 1e-8 * (1.0 + slope[row].abs())
            );
            for i in 0..3 {
                let (at_zero, depth) = rolling.depth_row(i);
                let expected = rolling.normal_n(&(z + step(1e-3)), i) / GAINS.approach_n_m;
                assert!((at_zero + depth.dot(&(z + step(1e-3))) - expected).abs() < 1e-15);
            }
        }
        let apart = rolling.centre_m(&z, 0) - rolling.centre_m(&z, 1);
        let along = apart / apart.dot(&apart).square_root();
        let slope = rolling.apart_slope(0, 1, &along);
        let moved = z + slope * 1e-7;
        let grown = (rolling.centre_m(&moved, 0) - rolling.centre_m(&moved, 1)).norm() - apart.norm();
        assert!((grown - 1e-7 * slope.norm_squared()).abs() < 1e-12);
    }
}
