//! Contact points on chosen faces: where the grasp has the best chance to hold, by [`chance`](super::quality::chance).
//!
//! That is far from the edges, and where the fingertips do not roll much: it is largest where
//! `-a ln(least margin) + b/2 ln(mean of theta_i^2)` is least, with exponents a and b that were measured. The least of the
//! margins is softened to `(sum m_k^-P)^(-1/P)`, so that Newton's method applies and contacts that do not decide move to
//! good places as well; the second term is replaced by its tangent in `theta^2` in each step, which lies above it.
//! Both are convex in the coordinates. Fingertips that would be in each other's way push each other apart.

use super::facet::Facet;
use super::quality::{MARGIN_EXPONENT, ROLL_EXPONENT, ROLL_FLOOR_RAD};
use super::rolling::{COORDINATES, Coordinates, Rolling, of};
use blindgrasp_body::MAX_FINGERS;
use nalgebra::{SMatrix, Vector3};

/// Sharpness P of the softened least.
const SHARPNESS: f64 = 6.0;
/// Steps of Newton's method.
const STEPS: usize = 25;
/// A step that changes no coordinate by more than this share of the rolling radius is the last.
const SMALL: f64 = 1e-4;
/// The price of fingertips that are too close, or that the law hardly presses on: the square of what is missing, in
/// rolling radii, times this.
const PRICE: f64 = 300.0;
/// The centroid should lie this far below each fingertip along its normal, in rolling radii.
const DEPTH: f64 = 0.3;

type Square = SMatrix<f64, COORDINATES, COORDINATES>;

/// The data of the fingertips.
#[derive(Clone, Copy)]
pub(super) struct Fingertips<'a> {
    /// `rho_i`, m.
    pub(super) rolling_radii_m: &'a [f64],
    /// Distances that two centres have to keep, m: by fingertip and fingertip.
    pub(super) apart_m: &'a [[f64; MAX_FINGERS]; MAX_FINGERS],
    /// The coordinates of contact points that are the user's, m.
    pub(super) fixed: &'a [Option<nalgebra::Vector2<f64>>],
}

impl Fingertips<'_> {
    fn unit_m(&self) -> f64 {
        self.rolling_radii_m.iter().sum::<f64>() / self.rolling_radii_m.len() as f64
    }
}

/// Returns the start of the search: the middle of each face; fingertips that share a face stand in a row along it.
pub(super) fn start(facets: &[&Facet], tips: Fingertips<'_>) -> Coordinates {
    let mut z = Coordinates::zeros();
    for (i, facet) in facets.iter().enumerate() {
        let mut along = 0.0;
        if let Some(point) = &tips.fixed[i] {
            (z[2 * i], z[2 * i + 1]) = (point.x, point.y);
            continue;
        }
        let shares = |j: &usize| facets[*j].face == facet.face;
        let (before, after) = ((0..i).filter(shares).count(), (i + 1..facets.len()).filter(shares).count());
        if before + after > 0 {
            let next = (0..facets.len()).filter(|j| *j != i && shares(j)).map(|j| tips.apart_m[i][j]);
            along = (before as f64 - after as f64) / 2.0 * next.fold(0.0, f64::max);
        }
        z[2 * i] = along;
    }
    z
}

/// Moves contact points to where the grasp has the best chance to hold.
pub(super) fn improve(
    facets: &[&Facet],
    rolling: &Rolling,
    tips: Fingertips<'_>,
    start: Coordinates,
) -> Coordinates {
    let task = Task { facets, rolling, tips, unit_m: tips.unit_m() };
    // Not inside of all faces: fingertips in a row that is too long, say.
    let mut z = task.pulled_inside(start);
    let mut cost = task.cost(&z);
    for _ in 0..STEPS {
        let (slope, bend) = task.derivatives(&z);
        let Some(factor) = bend.cholesky() else { break };
        let step = -factor.solve(&slope);
        let longest = step.amax();
        if !(longest > SMALL * task.unit_m) {
            break;
        }
        let mut share = (task.unit_m / longest).min(1.0);
        let mut better = false;
        for _ in 0..8 {
            let next = z + step * share;
            let next_cost = task.cost(&next);
            if next_cost < cost {
                better = cost - next_cost > 1e-9;
                (z, cost) = (next, next_cost);
                break;
            }
            share *= 0.4;
        }
        if !better {
            break;
        }
    }
    z
}

/// The function that is minimised.
struct Task<'a> {
    facets: &'a [&'a Facet],
    rolling: &'a Rolling,
    tips: Fingertips<'a>,
    unit_m: f64,
}

impl Task<'_> {
    /// Contact points outside of their faces, moved along the line to the middle.
    fn pulled_inside(&self, mut z: Coordinates) -> Coordinates {
        for (i, facet) in self.facets.iter().enumerate() {
            let mut share: f64 = 1.0;
            for half in &facet.cell {
                let way = half.inwards.dot(&of(&z, i));
                // Of the distance at the middle, a tenth has to stay.
                if half.offset_m + way < 0.1 * half.offset_m {
                    share = share.min(-0.9 * half.offset_m / way);
                }
            }
            if self.tips.fixed[i].is_none() {
                z[2 * i] *= share;
                z[2 * i + 1] *= share;
            }
        }
        z
    }

    /// Infinite outside of the faces.
    fn cost(&self, z: &Coordinates) -> f64 {
        let mut sum = 0.0;
        for (i, facet) in self.facets.iter().enumerate() {
            let here = of(z, i);
            for half in &facet.cell {
                let margin = (half.inwards.dot(&here) + half.offset_m) / self.unit_m;
                if !(margin > 0.0) && self.tips.fixed[i].is_none() {
                    return f64::INFINITY;
                }
                sum += margin.max(1e-3).powf(-SHARPNESS);
            }
        }
        let roll = self.rolling.mean_square_turn(z) + ROLL_FLOOR_RAD * ROLL_FLOOR_RAD;
        let mut cost = MARGIN_EXPONENT / SHARPNESS * sum.ln() + 0.5 * ROLL_EXPONENT * roll.ln();
        self.for_missing(z, |missing, _| cost += PRICE * missing * missing);
        cost
    }

    /// Slope and curvature of an upper bound that touches the cost here.
    fn derivatives(&self, z: &Coordinates) -> (Coordinates, Square) {
        let mut slope = Coordinates::zeros();
        let mut bend = Square::zeros();
        let mut sum = 0.0;
        for (i, facet) in self.facets.iter().enumerate() {
            let here = of(z, i);
            for half in &facet.cell {
                let margin = ((half.inwards.dot(&here) + half.offset_m) / self.unit_m).max(1e-3);
                let weight = margin.powf(-SHARPNESS);
                sum += weight;
                let way = half.inwards / (margin * self.unit_m);
                for a in 0..2 {
                    slope[2 * i + a] -= weight * way[a];
                    for b in 0..2 {
                        bend[(2 * i + a, 2 * i + b)] += weight * (SHARPNESS + 1.0) * way[a] * way[b];
                    }
                }
            }
        }
        slope /= sum;
        bend /= sum;
        bend.ger(-SHARPNESS, &slope.clone_owned(), &slope.clone_owned(), 1.0);
        slope *= MARGIN_EXPONENT;
        bend *= MARGIN_EXPONENT;
        let (square, turn_slope, turn_bend) = self.rolling.mean_square_turn_derivatives(z);
        let share = 0.5 * ROLL_EXPONENT / (square + ROLL_FLOOR_RAD * ROLL_FLOOR_RAD);
        slope += turn_slope * share;
        bend += turn_bend * share;
        self.for_missing(z, |missing, row| {
            slope.axpy(-2.0 * PRICE * missing, row, 1.0);
            bend.ger(2.0 * PRICE, row, row, 1.0);
        });
        let count = self.facets.len();
        for row in 0..COORDINATES {
            bend[(row, row)] += 1e-3 / (self.unit_m * self.unit_m);
            if row >= 2 * count || self.tips.fixed[row / 2].is_some() {
                slope[row] = 0.0;
                bend.row_mut(row).fill(0.0);
                bend.column_mut(row).fill(0.0);
                bend[(row, row)] = 1.0;
            }
        }
        (slope, bend)
    }

    /// Calls `take` with what is missing, in rolling radii, wherever something is, and with how what is there grows with the
    /// coordinates: distance between fingertips, depth of the centroid.
    fn for_missing(&self, z: &Coordinates, mut take: impl FnMut(f64, &Coordinates)) {
        for i in 0..self.rolling.count() {
            let (value, slope) = self.rolling.depth_row(i);
            let missing = DEPTH - (value + slope.dot(z)) / self.unit_m;
            if missing > 0.0 {
                take(missing, &(slope / self.unit_m));
            }
            for j in 0..i {
                let between: Vector3<f64> = self.rolling.centre_m(z, i) - self.rolling.centre_m(z, j);
                let distance = between.norm();
                let missing = (self.tips.apart_m[i][j] - distance) / self.unit_m;
                if missing > 0.0 {
                    let in_one_place = distance < 1e-6 * self.unit_m;
                    let along = if in_one_place { self.facets[i].axes[0] } else { between / distance };
                    take(missing, &(self.rolling.apart_slope(i, j, &along) / self.unit_m));
                }
            }
        }
    }
}
