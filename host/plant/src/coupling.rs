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
//! `E = 1`. Fingers meet only in the trunk and the object, so `M` is block-arrow: a small block a finger, and the trunk.
//! Its Cholesky factor `L` has no fill between fingers, and the Delassus matrix `tau J M^-1 J^T + E` (Eq. 28, at
//! velocity level) is a small block a finger plus the product of the rows' parts in the trunk and the object. It is
//! positive definite exactly when the Pfaffian matrix `P` of Eq. 23 has full rank.

use super::contact::Rows;
use super::linear::{backward, factorize, forward};
use blindgrasp_body::dynamics::{JointMatrix, JointVector};
use blindgrasp_body::{Hand, MAX_CHAIN, MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::math::Real;
use nalgebra::Matrix3;

/// Velocities of the object.
const OBJECT: usize = 6;
/// The size of the part that fingers share: the trunk's joints, then the object.
const MAX_HEAD: usize = MAX_CHAIN + OBJECT;
const MAX_ROWS: usize = Rows::COUNT * MAX_FINGERS;

/// The joints of the trunk and of each finger.
#[derive(Clone, Debug)]
pub(super) struct Branches {
    /// Joints that move more than one fingertip.
    pub(super) trunk: Vec<usize>,
    /// Joints that move one fingertip only, by fingertip, from the base outwards.
    pub(super) fingers: Vec<Vec<usize>>,
}

impl Branches {
    pub(super) fn of(hand: &Hand) -> Self {
        let fingertips = 0..hand.fingertip_count();
        let moved = |k: usize| fingertips.clone().filter(|&i| hand.moves(k, i)).count();
        let joints = || 0..hand.joint_count();
        Self {
            trunk: joints().filter(|&k| moved(k) > 1).collect(),
            fingers: fingertips
                .clone()
                .map(|i| joints().filter(|&k| moved(k) == 1 && hand.moves(k, i)).collect())
                .collect(),
        }
    }

    /// The longest chain, to be compared with [`MAX_CHAIN`].
    pub(super) fn longest(&self) -> usize {
        self.fingers.iter().chain([&self.trunk]).map(Vec::len).max().unwrap_or(0)
    }
}

/// One contact row, in the order of its finger's joints, the trunk's joints and the object's velocities.
#[derive(Clone, Copy, Debug)]
struct Row {
    finger: [f64; MAX_CHAIN],
    head: [f64; MAX_HEAD],
}

const NO_ROW: Row = Row { finger: [0.0; MAX_CHAIN], head: [0.0; MAX_HEAD] };

/// The object's mass matrix.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectMass {
    pub(super) mass_kg: f64,
    /// About the centre of mass, in base axes, kg m^2.
    pub(super) inertia_kg_m2: Matrix3<f64>,
}

/// Velocities or forces of everything.
#[derive(Clone, Copy, Debug)]
pub(super) struct Everything {
    pub(super) joints: JointVector,
    pub(super) object: [f64; OBJECT],
}

impl Everything {
    pub(super) const ZERO: Self = Self { joints: [0.0; MAX_JOINTS], object: [0.0; OBJECT] };
}

/// Workspace of the step, kept between steps.
#[derive(Clone, Debug)]
pub(super) struct Coupling {
    branches: Branches,
    /// The number of fingers that touch the object: the first ones.
    contacts: usize,
    rows: [Row; MAX_ROWS],
    /// Right-hand sides, then multipliers.
    multipliers: [f64; MAX_ROWS],
    finger_factors: [[[f64; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
    /// `L_i^-1 H_it`, by trunk joint.
    finger_trunk: [[[f64; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
    trunk_factor: [[f64; MAX_CHAIN]; MAX_CHAIN],
    inertia_factor: [[f64; 3]; 3],
    root_mass: f64,
    delassus: [[f64; MAX_ROWS]; MAX_ROWS],
}

impl Coupling {
    pub(super) fn new(hand: &Hand, contacts: usize) -> Self {
        Self {
            branches: Branches::of(hand),
            contacts,
            rows: [NO_ROW; MAX_ROWS],
            multipliers: [0.0; MAX_ROWS],
            finger_factors: [[[0.0; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
            finger_trunk: [[[0.0; MAX_CHAIN]; MAX_CHAIN]; MAX_FINGERS],
            trunk_factor: [[0.0; MAX_CHAIN]; MAX_CHAIN],
            inertia_factor: [[0.0; 3]; 3],
            root_mass: 0.0,
            delassus: [[0.0; MAX_ROWS]; MAX_ROWS],
        }
    }

    /// Factors the mass matrix, with `softness` added to the joints' diagonal. Returns the least relative pivot.
    pub(super) fn factorize_mass(
        &mut self,
        h: &JointMatrix,
        softness: &JointVector,
        object: &ObjectMass,
    ) -> f64 {
        let mut least: f64 = 1.0;
        let trunk = &self.branches.trunk;
        for (a, &j) in trunk.iter().enumerate() {
            for (b, &k) in trunk.iter().enumerate() {
                self.trunk_factor[a][b] = h[j][k];
            }
            self.trunk_factor[a][a] += softness[j];
        }
        for (i, finger) in self.branches.fingers.iter().enumerate() {
            let (factor, shared) = (&mut self.finger_factors[i], &mut self.finger_trunk[i]);
            for (a, &j) in finger.iter().enumerate() {
                for (b, &k) in finger.iter().enumerate() {
                    factor[a][b] = h[j][k];
                }
                factor[a][a] += softness[j];
            }
            least = least.min(factorize(factor, finger.len()));
            for (t, &k) in trunk.iter().enumerate() {
                for (a, &j) in finger.iter().enumerate() {
                    shared[t][a] = h[j][k];
                }
                forward(factor, finger.len(), &mut shared[t]);
                for u in 0..=t {
                    self.trunk_factor[t][u] -= dot(&shared[t], &shared[u], finger.len());
                }
            }
        }
        least = least.min(factorize(&mut self.trunk_factor, trunk.len()));
        self.inertia_factor = std::array::from_fn(|a| std::array::from_fn(|b| object.inertia_kg_m2[(a, b)]));
        self.root_mass = object.mass_kg.square_root();
        least.min(factorize(&mut self.inertia_factor, 3))
    }

    /// `L^-1 b`, in place.
    fn whiten(&self, b: &mut Everything) {
        for (i, finger) in self.branches.fingers.iter().enumerate() {
            let mut part = [0.0; MAX_CHAIN];
            for (a, &j) in finger.iter().enumerate() {
                part[a] = b.joints[j];
            }
            forward(&self.finger_factors[i], finger.len(), &mut part);
            for (a, &j) in finger.iter().enumerate() {
                b.joints[j] = part[a];
            }
            for (t, &k) in self.branches.trunk.iter().enumerate() {
                b.joints[k] -= dot(&self.finger_trunk[i][t], &part, finger.len());
            }
        }
        let mut part = [0.0; MAX_CHAIN];
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            part[t] = b.joints[k];
        }
        forward(&self.trunk_factor, self.branches.trunk.len(), &mut part);
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            b.joints[k] = part[t];
        }
        for v in &mut b.object[..3] {
            *v /= self.root_mass;
        }
        forward(&self.inertia_factor, 3, &mut b.object[3..]);
    }

    /// `L^-T y`, in place.
    fn unwhiten(&self, y: &mut Everything) {
        let mut trunk = [0.0; MAX_CHAIN];
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            trunk[t] = y.joints[k];
        }
        backward(&self.trunk_factor, self.branches.trunk.len(), &mut trunk);
        for (t, &k) in self.branches.trunk.iter().enumerate() {
            y.joints[k] = trunk[t];
        }
        for (i, finger) in self.branches.fingers.iter().enumerate() {
            let mut part = [0.0; MAX_CHAIN];
            for (a, &j) in finger.iter().enumerate() {
                part[a] = y.joints[j];
            }
            for t in 0..self.branches.trunk.len() {
                for (a, shared) in self.finger_trunk[i][t].iter().enumerate().take(finger.len()) {
                    part[a] -= shared * trunk[t];
                }
            }
            backward(&self.finger_factors[i], finger.len(), &mut part);
            for (a, &j) in finger.iter().enumerate() {
                y.joints[j] = part[a];
            }
        }
        for v in &mut y.object[..3] {
            *v /= self.root_mass;
        }
        backward(&self.inertia_factor, 3, &mut y.object[3..]);
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
        for (a, &j) in self.branches.fingers[finger].iter().enumerate() {
            target.finger[a] = scale * joint(j);
        }
        let trunk = self.branches.trunk.len();
        for (t, &k) in self.branches.trunk.iter().enumerate() {
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
        let head = self.branches.trunk.len() + OBJECT;
        let count = Rows::COUNT * fingers;
        let mut push = *forces;
        self.whiten(&mut push);
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
                    entry += dot(&a.finger, &b.finger, self.branches.fingers[r / Rows::COUNT].len());
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
        self.unwhiten(&mut push);
        for (v, change) in v.joints.iter_mut().zip(&push.joints).chain(v.object.iter_mut().zip(&push.object))
        {
            *v += tau_s * change;
        }
        least
    }

    /// Product of a row with velocities; or, once both are whitened, with forces.
    fn row_times(&self, finger: usize, row: usize, y: &Everything) -> f64 {
        let row = &self.rows[Rows::COUNT * finger + row];
        let trunk = self.branches.trunk.len();
        let mut sum = dot(&row.head[trunk..], &y.object, OBJECT);
        for (a, &j) in self.branches.fingers[finger].iter().enumerate() {
            sum += row.finger[a] * y.joints[j];
        }
        for (t, &k) in self.branches.trunk.iter().enumerate() {
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
        let (n, trunk) = (self.branches.fingers[finger].len(), self.branches.trunk.len());
        forward(&self.finger_factors[finger], n, &mut row.finger);
        for t in 0..trunk {
            row.head[t] -= dot(&self.finger_trunk[finger][t], &row.finger, n);
        }
        forward(&self.trunk_factor, trunk, &mut row.head);
        for entry in &mut row.head[trunk..trunk + 3] {
            *entry /= self.root_mass;
        }
        forward(&self.inertia_factor, 3, &mut row.head[trunk + 3..]);
    }

    /// Adds `(L^-1 J^T) lambda` to whitened forces.
    fn add_multipliers(&self, y: &mut Everything) {
        let trunk = self.branches.trunk.len();
        for (i, finger) in self.branches.fingers.iter().enumerate().take(self.contacts) {
            for a in 0..Rows::COUNT {
                let (row, lambda) = (&self.rows[Rows::COUNT * i + a], self.multipliers[Rows::COUNT * i + a]);
                for (a, &j) in finger.iter().enumerate() {
                    y.joints[j] += row.finger[a] * lambda;
                }
                for (t, &k) in self.branches.trunk.iter().enumerate() {
                    y.joints[k] += row.head[t] * lambda;
                }
                for (entry, value) in y.object.iter_mut().zip(&row.head[trunk..]) {
                    *entry += value * lambda;
                }
            }
        }
    }
}

#[inline]
fn dot(a: &[f64], b: &[f64], n: usize) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b).take(n) {
        sum += a * b;
    }
    sum
}
