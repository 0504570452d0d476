//! The friction problem of one step: the forces of soft contacts with Coulomb friction.
//!
//! Given are the contacts' velocities without forces, `b`, and the Delassus matrix `W`, so that forces `l` make them
//! `c = W l + b`; and for each contact its law: the normal force as a function of the normal velocity (monotonous, by
//! [`Response`]), and the coefficient of friction. Wanted are forces with
//!
//! - `l_n = max(0, f(-c_n))`;
//! - `|l_t| <= mu l_n`, and `c_t = 0` inside; on the boundary `c_t` is opposite to `l_t` (maximum dissipation).
//!
//! Normal forces are smooth enough for Newton's method, which linearizes them: `f = a + s d'`. What is left is tried first
//! with every contact sticking; if all forces are in their cones, that is the answer. Else block Gauss-Seidel gets a
//! semismooth Newton method started (Alart and Curnier 1991, with the scaling of Hueeber, Stadler, Wohlmuth 2008), and
//! takes over where that fails.
//!
//! Redundant rows are no error: a box on a table has eight tangential rows of rank three. A proximal term makes the matrix
//! regular and shares the load out in proportion to the normal forces; one refinement takes its effect on the velocities
//! away.

use super::cone::{into_ball, length, one_contact};
use super::linear::{cholesky, cholesky_solve, dot, eliminate};
use super::material::Response;

#[cfg(test)]
mod tests;

/// Proximal term, relative to the mean of the tangential diagonal.
const PROXIMAL: f64 = 1e-8;
/// Linearizations of the normal forces in one step.
const LINEARIZATIONS: usize = 12;
/// Changes of the set of pressed contacts while all stick.
const SETS: usize = 8;
/// Sweeps of Gauss-Seidel before Newton's method; and where that fails, before it is tried again.
const SWEEPS: [usize; 5] = [3, 10, 30, 100, 300];
const NEWTON_STEPS: usize = 15;
/// Error of forces, relative to the largest.
const TOLERANCE: f64 = 1e-10;

/// Counters of what the solver did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Steps solved.
    pub steps: u64,
    /// Linearizations of normal forces.
    pub linearizations: u64,
    /// Of these, the ones with a contact that slips.
    pub slips: u64,
    /// Steps of Newton's method for these.
    pub newton_steps: u64,
    /// Sweeps of Gauss-Seidel where Newton's method failed.
    pub fallback_sweeps: u64,
    /// Solutions whose error stayed above 1e-10 of the largest force.
    pub unconverged: u64,
    /// Times that the velocities of half a step were projected, because a contact began to stick.
    pub projections: u64,
}

/// A contact's place among the rows.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Row of its normal; the tangential ones follow.
    normal: usize,
    tangents: usize,
    friction: f64,
    /// The linearized law: `a + s d'`.
    a: f64,
    s: f64,
    /// Proximal term of its tangential rows.
    proximal: f64,
}

impl Place {
    fn tangential(&self) -> std::ops::Range<usize> {
        self.normal + 1..self.normal + 1 + self.tangents
    }

    /// `1/s`: a pressed contact has `c_n + l_n / s = a / s`.
    fn softness(&self) -> f64 {
        1.0 / self.s
    }

    fn is_soft(&self) -> bool {
        self.s > 0.0
    }

    fn radius(&self, forces: &[f64]) -> f64 {
        self.friction * forces[self.normal].max(0.0)
    }
}

/// The problem, and the room to solve it in.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    places: Vec<Place>,
    /// Rows.
    count: usize,
    /// Delassus matrix, row-major.
    pub(super) delassus: Vec<f64>,
    /// Velocities without forces.
    pub(super) free: Vec<f64>,
    /// Forces: the answer.
    pub(super) forces: Vec<f64>,
    /// Velocities with these forces.
    pub(super) velocities: Vec<f64>,
    pressed: Vec<bool>,
    matrix: Vec<f64>,
    right: Vec<f64>,
    change: Vec<f64>,
    pub(super) counters: Counters,
}

impl Problem {
    /// Begins a new problem.
    pub(super) fn clear(&mut self) {
        self.places.clear();
        self.count = 0;
    }

    /// Adds a contact with a number of tangential rows. Returns the row of its normal.
    pub(super) fn add(&mut self, tangents: usize, friction: f64) -> usize {
        let normal = self.count;
        self.places.push(Place { normal, tangents, friction, a: 0.0, s: 0.0, proximal: 0.0 });
        self.count += 1 + tangents;
        normal
    }

    /// Makes room for matrix and vectors, all zero.
    pub(super) fn make_room(&mut self) {
        let n = self.count;
        for (room, size) in [
            (&mut self.delassus, n * n),
            (&mut self.matrix, n * n),
            (&mut self.free, n),
            (&mut self.forces, n),
            (&mut self.velocities, n),
            (&mut self.right, n),
            (&mut self.change, n),
        ] {
            room.clear();
            room.resize(size, 0.0);
        }
        self.pressed.clear();
        self.pressed.resize(self.places.len(), false);
    }

    /// Returns the tangential rows of a contact if it sticks: its force is inside of the cone.
    pub(super) fn sticking(&self, contact: usize) -> Option<std::ops::Range<usize>> {
        let place = &self.places[contact];
        let rows = place.tangential();
        let radius = place.radius(&self.forces);
        let inside = length(&self.forces[rows.clone()]) < radius * (1.0 - 1e-9);
        (inside && place.tangents > 0).then_some(rows)
    }

    /// Solves. `law` gives a contact's normal force for the rate of its depth; `rates` are the first guess.
    pub(super) fn solve(&mut self, law: impl Fn(usize, f64) -> Response, rates: &[f64]) {
        self.counters.steps += 1;
        for (place, rate) in self.places.iter().zip(rates) {
            self.velocities[place.normal] = -rate;
        }
        for _ in 0..LINEARIZATIONS {
            self.counters.linearizations += 1;
            self.linearize(&law);
            if !self.stick() {
                self.counters.slips += 1;
                self.slip();
            }
            if self.is_consistent(&law) {
                return;
            }
        }
        self.counters.unconverged += 1;
    }

    fn linearize(&mut self, law: &impl Fn(usize, f64) -> Response) {
        let mut most = 0.0f64;
        for (i, place) in self.places.iter_mut().enumerate() {
            let rate = -self.velocities[place.normal];
            let Response { force_n, slope_n_s_m, .. } = law(i, rate);
            place.s = slope_n_s_m;
            place.a = force_n - slope_n_s_m * rate;
            place.proximal = place.friction * force_n.max(0.0);
            most = most.max(place.proximal);
        }
        let (mut sum, mut rows) = (0.0, 0);
        for place in &self.places {
            for r in place.tangential() {
                sum += self.delassus[r * self.count + r];
                rows += 1;
            }
        }
        let mean = sum / f64::from(rows.max(1));
        for place in &mut self.places {
            let share = if most > 0.0 { (place.proximal / most).max(1e-6) } else { 1.0 };
            place.proximal = PROXIMAL * mean / share;
        }
    }

    /// The normal forces are those of the laws, not only of their linearizations.
    fn is_consistent(&self, law: &impl Fn(usize, f64) -> Response) -> bool {
        let normals = || self.places.iter().map(|place| self.forces[place.normal]);
        let scale = normals().fold(0.0, f64::max);
        self.places.iter().zip(normals()).enumerate().all(|(i, (place, force))| {
            let lawful = law(i, -self.velocities[place.normal]).force_n.max(0.0);
            !((lawful - force).abs() > 10.0 * TOLERANCE * scale.max(lawful))
        })
    }

    /// Tries with every pressed contact sticking. Returns `true` if that is the answer.
    fn stick(&mut self) -> bool {
        let n = self.count;
        for (pressed, place) in self.pressed.iter_mut().zip(&self.places) {
            *pressed = place.is_soft() && place.a - place.s * self.free[place.normal] > 0.0;
        }
        for _ in 0..SETS {
            // A contact that is not pressed keeps its rows, without coupling: its forces are zero.
            for r in 0..n {
                self.matrix[r * n..r * n + r + 1].copy_from_slice(&self.delassus[r * n..r * n + r + 1]);
            }
            for (place, &pressed) in self.places.iter().zip(&self.pressed) {
                let rows = place.normal..place.normal + 1 + place.tangents;
                for r in rows {
                    if pressed {
                        let is_normal = r == place.normal;
                        self.matrix[r * n + r] += if is_normal { place.softness() } else { place.proximal };
                        let law = if is_normal { place.a * place.softness() } else { 0.0 };
                        self.right[r] = law - self.free[r];
                    } else {
                        self.matrix[r * n..r * n + r].fill(0.0);
                        for below in r + 1..n {
                            self.matrix[below * n + r] = 0.0;
                        }
                        self.matrix[r * n + r] = 1.0;
                        self.right[r] = 0.0;
                    }
                }
            }
            if !cholesky(&mut self.matrix, n) {
                return false;
            }
            self.forces.copy_from_slice(&self.right);
            cholesky_solve(&self.matrix, n, &mut self.forces);
            // One refinement: the residual without the proximal term.
            self.update_velocities();
            self.change.fill(0.0);
            for (place, _) in self.places.iter().zip(&self.pressed).filter(|(_, pressed)| **pressed) {
                let r = place.normal;
                self.change[r] = (place.a - self.forces[r]) * place.softness() - self.velocities[r];
                for r in place.tangential() {
                    self.change[r] = -self.velocities[r];
                }
            }
            cholesky_solve(&self.matrix, n, &mut self.change);
            for (force, change) in self.forces.iter_mut().zip(&self.change) {
                *force += change;
            }
            self.update_velocities();
            let mut settled = true;
            for (pressed, place) in self.pressed.iter_mut().zip(&self.places) {
                let next = if *pressed {
                    self.forces[place.normal] >= 0.0
                } else {
                    place.is_soft() && place.a - place.s * self.velocities[place.normal] > 0.0
                };
                settled &= next == *pressed;
                *pressed = next;
            }
            if settled {
                return self.places.iter().all(|place| {
                    let radius = place.radius(&self.forces);
                    length(&self.forces[place.tangential()]) <= radius
                });
            }
        }
        false
    }

    fn update_velocities(&mut self) {
        let n = self.count;
        for (r, velocity) in self.velocities.iter_mut().enumerate() {
            *velocity = self.free[r] + dot(&self.delassus[r * n..(r + 1) * n], &self.forces);
        }
    }

    /// Solves with slipping contacts, from the forces that sticking would take.
    fn slip(&mut self) {
        for place in &self.places {
            self.forces[place.normal] = self.forces[place.normal].max(0.0);
            let radius = place.radius(&self.forces);
            into_ball(&mut self.forces[place.tangential()], radius);
        }
        for (round, sweeps) in SWEEPS.into_iter().enumerate() {
            for _ in 0..sweeps {
                self.counters.fallback_sweeps += u64::from(round > 0);
                self.sweep();
            }
            // Where Newton's method fails, Gauss-Seidel goes on from where it was.
            self.right.copy_from_slice(&self.forces);
            if self.newton() {
                return;
            }
            self.forces.copy_from_slice(&self.right);
        }
        self.update_velocities();
        self.counters.unconverged += 1;
    }

    /// Newton's method. Returns `true` if it converged.
    fn newton(&mut self) -> bool {
        for _ in 0..NEWTON_STEPS {
            self.update_velocities();
            if self.error() <= TOLERANCE {
                return true;
            }
            self.counters.newton_steps += 1;
            if !self.newton_step() {
                return false;
            }
        }
        self.update_velocities();
        self.error() <= TOLERANCE
    }

    /// Returns the loss of energy, J, when impulses take all velocities away; `forces` are these impulses. `None` if there is
    /// nothing to be solved. The matrix is meant without the half step, and every row for itself.
    pub(super) fn project(&mut self) -> Option<f64> {
        let n = self.count;
        let trace: f64 = (0..n).map(|r| self.delassus[r * n + r]).sum();
        self.matrix.copy_from_slice(&self.delassus);
        for r in 0..n {
            self.matrix[r * n + r] += PROXIMAL * trace / n as f64;
        }
        if n == 0 || !cholesky(&mut self.matrix, n) {
            return None;
        }
        for _ in 0..2 {
            for r in 0..n {
                self.change[r] = -self.free[r] - dot(&self.delassus[r * n..(r + 1) * n], &self.forces);
            }
            cholesky_solve(&self.matrix, n, &mut self.change);
            for (force, change) in self.forces.iter_mut().zip(&self.change) {
                *force += change;
            }
        }
        let mut lost_j = 0.0;
        for r in 0..n {
            let change = dot(&self.delassus[r * n..(r + 1) * n], &self.forces);
            lost_j -= self.forces[r] * (self.free[r] + 0.5 * change);
        }
        Some(lost_j)
    }

    /// Largest residual of the forces (those of the natural map), relative to the largest force.
    fn error(&self) -> f64 {
        let (mut error, mut scale) = (0.0f64, 0.0f64);
        for place in &self.places {
            let force = self.forces[place.normal];
            error = error.max((force - self.pressing(place).max(0.0)).abs());
            scale = scale.max(force);
            let rows = place.tangential();
            if rows.is_empty() {
                continue;
            }
            let step = self.step_size(place);
            let mut target = [0.0; 3];
            for (target, r) in target.iter_mut().zip(rows.clone()) {
                *target = self.forces[r] - step * self.velocities[r];
            }
            let target = &mut target[..rows.len()];
            into_ball(target, place.radius(&self.forces));
            for (target, r) in target.iter().zip(rows) {
                error = error.max((target - self.forces[r]).abs());
            }
        }
        if error > 0.0 {
            error / scale.max(f64::MIN_POSITIVE)
        } else if error == 0.0 {
            0.0
        } else {
            f64::INFINITY
        }
    }

    /// The normal force that the law asks of a contact, all others as they are, before it is cut at zero.
    fn pressing(&self, place: &Place) -> f64 {
        if !place.is_soft() {
            return 0.0;
        }
        let own = self.delassus[place.normal * self.count + place.normal];
        let others = self.velocities[place.normal] - own * self.forces[place.normal];
        (place.a * place.softness() - others) / (own + place.softness())
    }

    /// The inverse of the mean tangential diagonal.
    fn step_size(&self, place: &Place) -> f64 {
        let sum: f64 = place.tangential().map(|r| self.delassus[r * self.count + r]).sum();
        if sum > 0.0 { place.tangents as f64 / sum } else { 1.0 }
    }

    /// One step of the semismooth Newton method. Returns `false` if its matrix is singular.
    fn newton_step(&mut self) -> bool {
        let n = self.count;
        self.matrix.copy_from_slice(&self.delassus);
        for k in 0..self.places.len() {
            let place = self.places[k];
            let (normal, rows) = (place.normal, place.tangential());
            if !(self.pressing(&place) > 0.0) {
                for r in normal..normal + 1 + place.tangents {
                    self.matrix[r * n..(r + 1) * n].fill(0.0);
                    self.matrix[r * n + r] = 1.0;
                    self.change[r] = -self.forces[r];
                }
                continue;
            }
            self.matrix[normal * n + normal] += place.softness();
            self.change[normal] =
                (place.a - self.forces[normal]) * place.softness() - self.velocities[normal];
            if rows.is_empty() {
                continue;
            }
            let (radius, step) = (place.radius(&self.forces), self.step_size(&place));
            // The force that would stick, its length and direction.
            let mut y = [0.0; 3];
            for (y, r) in y.iter_mut().zip(rows.clone()) {
                *y = self.forces[r] - step * self.velocities[r];
            }
            let reach = length(&y);
            if reach <= radius && radius > 0.0 {
                for r in rows {
                    self.matrix[r * n + r] += place.proximal;
                    self.change[r] = -self.velocities[r];
                }
                continue;
            }
            let direction = if reach > 0.0 { y.map(|y| y / reach) } else { [0.0; 3] };
            let share = if reach > 0.0 { radius / reach } else { 0.0 };
            let mut force = [0.0; 3];
            force[..rows.len()].copy_from_slice(&self.forces[rows.clone()]);
            let mut inside = force;
            into_ball(&mut inside, radius);
            // (1 - M) dl + r M dc - direction mu dl_n = radius direction - l, with M = share 1 - inside direction^T / reach,
            // divided by r.
            let blend: [[f64; 3]; 3] = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let unit = if i == j { share } else { 0.0 };
                    unit - if reach > 0.0 { inside[i] * direction[j] / reach } else { 0.0 }
                })
            });
            for (i, r) in rows.clone().enumerate() {
                let row = r * n;
                self.matrix[row..row + n].fill(0.0);
                for (j, s) in rows.clone().enumerate() {
                    let m = blend[i][j];
                    for c in 0..n {
                        self.matrix[row + c] += m * self.delassus[s * n + c];
                    }
                    self.matrix[row + s] += (if i == j { 1.0 } else { 0.0 } - m) / step;
                }
                self.matrix[row + normal] -= direction[i] * place.friction / step;
                self.change[r] = (radius * direction[i] - force[i]) / step;
            }
        }
        if !eliminate(&mut self.matrix, n, &mut self.change) {
            return false;
        }
        for (force, change) in self.forces.iter_mut().zip(&self.change) {
            *force += change;
        }
        true
    }

    /// One sweep of block Gauss-Seidel: each contact is solved exactly, all others as they are.
    fn sweep(&mut self) {
        for k in 0..self.places.len() {
            let place = self.places[k];
            let all = place.normal..place.normal + 1 + place.tangents;
            if !place.is_soft() {
                self.forces[all].fill(0.0);
                continue;
            }
            let n = self.count;
            // Velocities of its rows without its own forces.
            let mut free = [0.0; 4];
            let mut own = [[0.0; 4]; 4];
            for (i, r) in all.clone().enumerate() {
                let row = &self.delassus[r * n..(r + 1) * n];
                free[i] = self.free[r]
                    + dot(&row[..all.start], &self.forces[..all.start])
                    + dot(&row[all.end..], &self.forces[all.end..]);
                own[i][..all.len()].copy_from_slice(&row[all.clone()]);
            }
            // The proximal term draws to the forces before, so that nothing of it is left in the end.
            for (i, r) in place.tangential().enumerate() {
                own[i + 1][i + 1] += place.proximal;
                free[i + 1] -= place.proximal * self.forces[r];
            }
            own[0][0] += place.softness();
            free[0] -= place.a * place.softness();
            let forces = one_contact(&own, &free, place.tangents, place.friction);
            self.forces[all.clone()].copy_from_slice(&forces[..all.len()]);
        }
    }
}
