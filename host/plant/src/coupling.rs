//! The linear algebra of one step: velocities and multipliers of hand, object and contacts together.
//!
//! Unknown are the velocities `v = (dq, dx, w)` and one multiplier for each contact row:
//!
//! ```text
//! M (v - v0) = tau (F + J^T lambda)
//! J v + E lambda = e
//! ```
//!
//! Rolling rows are rigid (`E = 0`); the implicit parts of indentation and torsion are soft rows, scaled so that
//! `E = 1`. Fingers meet only in the trunk and the object, so `M` is block-arrow
//! (`mass.rs`): its Cholesky factor `L` has no fill between fingers, and the Delassus matrix `tau J M^-1 J^T + E` (Eq. 28, at
//! velocity level) is a small block a finger plus the product of the rows' parts in the trunk and the object. It is
//! positive definite exactly when the Pfaffian matrix `P` of Eq. 23 has full rank.

use super::contact::Rows;
use super::linear::{backward, factorize, forward};
use super::mass::MassFactor;
use super::vectors::{Everything, OBJECT, dot};
use blindgrasp_body::{Hand, MAX_CHAIN, MAX_FINGERS};

/// The size of the part that fingers share: the trunk's joints, then the object.
const MAX_HEAD: usize = MAX_CHAIN + OBJECT;
const MAX_ROWS: usize = Rows::COUNT * MAX_FINGERS;

/// One contact row, in the order of its finger's joints, the trunk's joints and the object's velocities.
#[derive(Clone, Copy, Debug)]
struct Row {
    finger: [f64; MAX_CHAIN],
    head: [f64; MAX_HEAD],
}

const NO_ROW: Row = Row { finger: [0.0; MAX_CHAIN], head: [0.0; MAX_HEAD] };

/// Workspace of the step, kept between steps.
#[derive(Clone, Debug)]
pub(super) struct Coupling {
    pub(super) mass: MassFactor,
    /// The number of fingers that touch the object: the first ones.
    contacts: usize,
    rows: [Row; MAX_ROWS],
    /// Right-hand sides, then multipliers.
    multipliers: [f64; MAX_ROWS],
    delassus: [[f64; MAX_ROWS]; MAX_ROWS],
}

impl Coupling {
    pub(super) fn new(hand: &Hand, contacts: usize) -> Self {
        Self {
            mass: MassFactor::new(hand),
            contacts,
            rows: [NO_ROW; MAX_ROWS],
            multipliers: [0.0; MAX_ROWS],
            delassus: [[0.0; MAX_ROWS]; MAX_ROWS],
        }
    }

    /// Sets contact row `row` of a finger: what each joint that moves it and the object contribute to the rate.
    pub(super) fn set_row(
        &mut self,
        finger: usize,
        row: usize,
        scale: f64,
        joint: impl Fn(usize) -> f64,
        object: &[f64; OBJECT],
    ) {
        let target = &mut self.rows[Rows::COUNT * finger + row];
        for (a, &j) in self.mass.branches.fingers[finger].iter().enumerate() {
            target.finger[a] = scale * joint(j);
        }
        let trunk = self.mass.branches.trunk.len();
        for (t, &k) in self.mass.branches.trunk.iter().enumerate() {
            target.head[t] = scale * joint(k);
        }
        for (entry, value) in target.head[trunk..trunk + OBJECT].iter_mut().zip(object) {
            *entry = scale * value;
        }
    }

    /// Solves for the velocities, given those before (`v`, overwritten), the forces and the step `tau_s`. Rolling rows
    /// and torsion are driven to `J v + E lambda = 0`, indentation to `J (v - v0) + lambda = 0`. Returns the least
    /// relative pivot of the Delassus matrix; the velocities are meaningless unless it is positive.
    pub(super) fn solve(&mut self, v: &mut Everything, forces: &Everything, tau_s: f64) -> f64 {
        let fingers = self.contacts;
        let head = self.mass.branches.trunk.len() + OBJECT;
        let count = Rows::COUNT * fingers;
        let mut push = *forces;
        self.mass.whiten(&mut push);
        for i in 0..fingers {
            for a in 0..Rows::COUNT {
                let before = if a == Rows::INDENTATION { 0.0 } else { self.row_times(i, a, v) };
                self.multipliers[Rows::COUNT * i + a] = -before;
            }
        }
        for i in 0..fingers {
            for a in 0..Rows::COUNT {
                self.whiten_row(i, Rows::COUNT * i + a);
                let r = Rows::COUNT * i + a;
                self.multipliers[r] -= tau_s * self.row_times(i, a, &push);
            }
        }
        for r in 0..count {
            for s in 0..=r {
                let (a, b) = (&self.rows[r], &self.rows[s]);
                let mut entry = dot(&a.head, &b.head, head);
                if r / Rows::COUNT == s / Rows::COUNT {
                    entry += dot(&a.finger, &b.finger, self.mass.branches.fingers[r / Rows::COUNT].len());
                }
                self.delassus[r][s] = tau_s * entry;
            }
            if matches!(r % Rows::COUNT, Rows::INDENTATION | Rows::TORSION) {
                self.delassus[r][r] += 1.0;
            }
        }
        let least = factorize(&mut self.delassus, count);
        forward(&self.delassus, count, &mut self.multipliers);
        backward(&self.delassus, count, &mut self.multipliers);
        self.add_multipliers(&mut push);
        self.mass.unwhiten(&mut push);
        for (v, change) in v.joints.iter_mut().zip(&push.joints).chain(v.object.iter_mut().zip(&push.object))
        {
            *v += tau_s * change;
        }
        least
    }

    /// Product of a row with velocities; or, once both are whitened, with forces.
    fn row_times(&self, finger: usize, row: usize, y: &Everything) -> f64 {
        let row = &self.rows[Rows::COUNT * finger + row];
        let trunk = self.mass.branches.trunk.len();
        let mut sum = dot(&row.head[trunk..], &y.object, OBJECT);
        for (a, &j) in self.mass.branches.fingers[finger].iter().enumerate() {
            sum += row.finger[a] * y.joints[j];
        }
        for (t, &k) in self.mass.branches.trunk.iter().enumerate() {
            sum += row.head[t] * y.joints[k];
        }
        sum
    }

    /// Multiplier of a row after [`Self::solve`].
    pub(super) fn multiplier(&self, finger: usize, row: usize) -> f64 {
        self.multipliers[Rows::COUNT * finger + row]
    }

    /// `L^-1 J^T` of one row, in place.
    fn whiten_row(&mut self, finger: usize, r: usize) {
        let row = &mut self.rows[r];
        let (n, trunk) = (self.mass.branches.fingers[finger].len(), self.mass.branches.trunk.len());
        forward(&self.mass.finger_factors[finger], n, &mut row.finger);
        for t in 0..trunk {
            row.head[t] -= dot(&self.mass.finger_trunk[finger][t], &row.finger, n);
        }
        forward(&self.mass.trunk_factor, trunk, &mut row.head);
        for entry in &mut row.head[trunk..trunk + 3] {
            *entry /= self.mass.root_mass;
        }
        forward(&self.mass.inertia_factor, 3, &mut row.head[trunk + 3..]);
    }

    /// Adds `(L^-1 J^T) lambda` to whitened forces.
    fn add_multipliers(&self, y: &mut Everything) {
        let trunk = self.mass.branches.trunk.len();
        for (i, finger) in self.mass.branches.fingers.iter().enumerate().take(self.contacts) {
            for a in 0..Rows::COUNT {
                let (row, lambda) = (&self.rows[Rows::COUNT * i + a], self.multipliers[Rows::COUNT * i + a]);
                for (a, &j) in finger.iter().enumerate() {
                    y.joints[j] += row.finger[a] * lambda;
                }
                for (t, &k) in self.mass.branches.trunk.iter().enumerate() {
                    y.joints[k] += row.head[t] * lambda;
                }
                for (entry, value) in y.object.iter_mut().zip(&row.head[trunk..]) {
                    *entry += value * lambda;
                }
            }
        }
    }
}
