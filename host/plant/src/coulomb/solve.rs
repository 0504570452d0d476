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
//! with every contact sticking; if all forces are in their cones, that is the answer. Else a semismooth Newton method (Alart
//! and Curnier 1991, with the scaling of Hueeber, Stadler, Wohlmuth 2008) solves for friction and normal forces together,
//! beginning at the forces of the step before. Where it fails, block Gauss-Seidel gets it started from the forces that sticking
//! would take, for as long as it takes.
//!
//! Redundant rows are no error: a box on a table has eight tangential rows of rank three. A proximal term makes the matrix
//! regular and shares the load out in proportion to the normal forces; one refinement takes its effect on the velocities
//! away.

use super::cone::{into_ball, length, one_contact};
use super::linear::{
    Block, Four, ZERO, add_scaled, add_transposed, eliminate, factorize, product, products, solve, times,
    transposed,
};
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

/// A contact.
#[derive(Clone, Copy, Debug)]
struct Place {
    tangents: usize,
    friction: f64,
    /// The law at the velocities that were last looked at, and linearized there: `a + s d'`.
    law: Response,
    a: f64,
    s: f64,
    /// Proximal term of its tangential rows.
    proximal: f64,
    /// The inverse of their mean diagonal.
    step: f64,
}

impl Place {
    /// `1/s`: a pressed contact has `c_n + l_n / s = a / s`.
    fn softness(&self) -> f64 {
        1.0 / self.s
    }

    fn radius(&self, forces: &Four) -> f64 {
        self.friction * forces[0].max(0.0)
    }

    /// Gives rows that the contact has not a diagonal.
    fn fill(&self, block: &mut Block) {
        for r in 1 + self.tangents..4 {
            block[r][r] = 1.0;
        }
    }

    /// Adds what the normal's softness and the proximal term add while it sticks.
    fn soften(&self, block: &mut Block) {
        block[0][0] += self.softness();
        for r in 1..=self.tangents {
            block[r][r] += self.proximal;
        }
        self.fill(block);
    }

    /// The tangential forces that would stick, if the contact's own rows were all there is.
    fn reach(&self, forces: &Four, velocities: &Four) -> [f64; 3] {
        std::array::from_fn(|i| forces[i + 1] - self.step * velocities[i + 1])
    }
}

/// The problem, and the room to solve it in. Of a contact's four numbers the first one is along the normal.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    places: Vec<Place>,
    /// Delassus matrix: the block of contacts `i` and `j`, of which `i` comes first, is at `i n + j`.
    delassus: Vec<Block>,
    /// Velocities without forces.
    pub(super) free: Vec<Four>,
    /// Forces: a guess, then the answer.
    pub(super) forces: Vec<Four>,
    /// Velocities with these forces.
    pub(super) velocities: Vec<Four>,
    /// The forces at which the search for slip begins.
    guess: Vec<Four>,
    pressed: Vec<bool>,
    /// The contacts that are solved for together, their matrix and right-hand sides.
    active: Vec<usize>,
    matrix: Vec<Block>,
    change: Vec<Four>,
    pub(super) counters: Counters,
}

impl Problem {
    /// Begins a new problem.
    pub(super) fn clear(&mut self) {
        self.places.clear();
        for numbers in [&mut self.free, &mut self.forces, &mut self.velocities] {
            numbers.clear();
        }
    }

    /// Adds a contact with a number of tangential rows, its velocities without forces, and a guess of the forces.
    pub(super) fn add(&mut self, tangents: usize, friction: f64, free: Four, forces: Four) {
        self.places.push(Place {
            tangents,
            friction,
            law: Response::default(),
            a: 0.0,
            s: 0.0,
            proximal: 0.0,
            step: 1.0,
        });
        self.free.push(free);
        self.forces.push(forces);
        self.velocities.push([0.0; 4]);
    }

    /// Sets the Delassus matrix by the blocks of two contacts, of which the first one comes first or is the same.
    pub(super) fn couple(&mut self, set: impl Fn(usize, usize, &mut Block)) {
        let n = self.places.len();
        self.delassus.resize(n * n, ZERO);
        for i in 0..n {
            for j in i..n {
                set(i, j, &mut self.delassus[i * n + j]);
            }
        }
    }

    /// A block of the Delassus matrix.
    fn block(&self, i: usize, j: usize) -> Block {
        let n = self.places.len();
        if i <= j { self.delassus[i * n + j] } else { transposed(&self.delassus[j * n + i]) }
    }

    /// The contact's force is inside of the cone, by more than the error that forces have.
    pub(super) fn sticks(&self, contact: usize) -> bool {
        let (place, forces) = (&self.places[contact], &self.forces[contact]);
        let error_n = 10.0 * TOLERANCE * self.largest_n();
        place.tangents > 0 && length(&forces[1..]) < place.radius(forces) - error_n
    }

    /// The largest normal force.
    fn largest_n(&self) -> f64 {
        self.forces.iter().fold(0.0, |largest: f64, forces| largest.max(forces[0]))
    }

    /// Solves. `law` gives a contact's normal force for the rate of its depth; `rates` are the first guess.
    pub(super) fn solve(&mut self, law: impl Fn(usize, f64) -> Response, rates: &[f64]) {
        let n = self.places.len();
        self.counters.steps += 1;
        self.guess.clone_from(&self.forces);
        for (velocities, rate) in self.velocities.iter_mut().zip(rates) {
            velocities[0] = -rate;
        }
        for (k, place) in self.places.iter_mut().enumerate() {
            let own = &self.delassus[k * n + k];
            let sum: f64 = (1..=place.tangents).map(|r| own[r][r]).sum();
            place.step = if sum > 0.0 { place.tangents as f64 / sum } else { 1.0 };
        }
        self.linearize(&law);
        for _ in 0..LINEARIZATIONS {
            self.counters.linearizations += 1;
            self.set_proximal();
            if !self.stick() {
                self.counters.slips += 1;
                self.slip(&law);
            }
            self.linearize(&law);
            if self.is_consistent() {
                return;
            }
        }
        self.counters.unconverged += 1;
    }

    /// The elastic part of a contact's normal force, N.
    pub(super) fn elastic_n(&self, contact: usize) -> f64 {
        self.places[contact].law.elastic_n
    }

    fn linearize(&mut self, law: &impl Fn(usize, f64) -> Response) {
        for (i, (place, velocities)) in self.places.iter_mut().zip(&self.velocities).enumerate() {
            let rate = -velocities[0];
            place.law = law(i, rate);
            place.s = place.law.slope_n_s_m;
            place.a = place.law.force_n - place.s * rate;
        }
    }

    fn set_proximal(&mut self) {
        let (mut most, mut sum, mut rows) = (0.0f64, 0.0, 0.0);
        for place in &mut self.places {
            place.proximal = place.friction * place.law.force_n.max(0.0);
            most = most.max(place.proximal);
            if place.tangents > 0 {
                sum += place.tangents as f64 / place.step;
                rows += place.tangents as f64;
            }
        }
        let mean = if rows > 0.0 { sum / rows } else { 0.0 };
        for place in &mut self.places {
            let share = if most > 0.0 { (place.proximal / most).max(1e-6) } else { 1.0 };
            place.proximal = PROXIMAL * mean / share;
        }
    }

    /// The normal forces are those of the laws, not only of their linearizations.
    fn is_consistent(&self) -> bool {
        let scale = self.largest_n();
        self.places.iter().zip(&self.forces).all(|(place, forces)| {
            let lawful = place.law.force_n.max(0.0);
            !((lawful - forces[0]).abs() > 10.0 * TOLERANCE * scale.max(lawful))
        })
    }

    /// Gathers the matrix of the active contacts, on the diagonal and on the right of it.
    fn gather(&mut self) {
        let (n, m) = (self.places.len(), self.active.len());
        self.matrix.resize(m * m, ZERO);
        self.change.resize(m, [0.0; 4]);
        for (x, &i) in self.active.iter().enumerate() {
            for (y, &j) in self.active.iter().enumerate().skip(x) {
                self.matrix[x * m + y] = self.delassus[i * n + j];
            }
        }
    }

    /// Tries with every pressed contact sticking. Returns `true` if that is the answer.
    fn stick(&mut self) -> bool {
        self.pressed.clear();
        for (place, free) in self.places.iter().zip(&self.free) {
            self.pressed.push(place.s > 0.0 && place.a - place.s * free[0] > 0.0);
        }
        for _ in 0..SETS {
            self.active.clear();
            self.active.extend((0..self.pressed.len()).filter(|&k| self.pressed[k]));
            self.gather();
            let m = self.active.len();
            for (x, &k) in self.active.iter().enumerate() {
                let place = &self.places[k];
                place.soften(&mut self.matrix[x * m + x]);
                self.change[x] = self.free[k].map(|free| -free);
                self.change[x][0] += place.a * place.softness();
            }
            if !factorize(&mut self.matrix, m) {
                return false;
            }
            solve(&self.matrix, m, &mut self.change);
            self.forces.fill([0.0; 4]);
            // One refinement: the velocities that the proximal term has left.
            for (&k, change) in self.active.iter().zip(&mut self.change) {
                let place = &self.places[k];
                self.forces[k] = *change;
                *change = change.map(|force| place.proximal * force);
                change[0] = 0.0;
            }
            solve(&self.matrix, m, &mut self.change);
            for (&k, change) in self.active.iter().zip(&self.change) {
                add_scaled(&mut self.forces[k], 1.0, change);
            }
            self.update_velocities();
            let mut settled = true;
            for (k, (pressed, place)) in self.pressed.iter_mut().zip(&self.places).enumerate() {
                let next = if *pressed {
                    self.forces[k][0] >= 0.0
                } else {
                    place.s > 0.0 && place.a - place.s * self.velocities[k][0] > 0.0
                };
                settled &= next == *pressed;
                *pressed = next;
            }
            if settled {
                let mut contacts = self.places.iter().zip(&self.forces);
                return contacts.all(|(place, forces)| length(&forces[1..]) <= place.radius(forces));
            }
        }
        false
    }

    fn update_velocities(&mut self) {
        let n = self.places.len();
        self.velocities.clone_from(&self.free);
        for k in 0..n {
            let row = &self.delassus[k * n + k..(k + 1) * n];
            let (own, others) = self.velocities[k..].split_at_mut(1);
            add_scaled(&mut own[0], 1.0, &products(row.iter().zip(&self.forces[k..])));
            for (velocities, block) in others.iter_mut().zip(&row[1..]) {
                add_transposed(velocities, block, &self.forces[k]);
            }
        }
    }

    /// Solves with slipping contacts: from where they were before, else from the forces that sticking would take.
    fn slip(&mut self, law: &impl Fn(usize, f64) -> Response) {
        std::mem::swap(&mut self.forces, &mut self.guess);
        if self.newton(law) {
            self.guess.clone_from(&self.forces);
            return;
        }
        std::mem::swap(&mut self.forces, &mut self.guess);
        for (place, forces) in self.places.iter().zip(&mut self.forces) {
            forces[0] = forces[0].max(0.0);
            let radius = place.radius(forces);
            into_ball(&mut forces[1..], radius);
        }
        for (round, sweeps) in SWEEPS.into_iter().enumerate() {
            for _ in 0..sweeps {
                self.counters.fallback_sweeps += u64::from(round > 0);
                self.sweep();
            }
            // Where Newton's method fails, Gauss-Seidel goes on from where it was.
            self.guess.clone_from(&self.forces);
            if self.newton(law) {
                self.guess.clone_from(&self.forces);
                return;
            }
            self.forces.clone_from(&self.guess);
            // Contacts whose rows are nearly redundant creep to where one of them slips, the slower the larger this term is.
            for place in &mut self.places {
                place.proximal *= 0.1;
            }
        }
        self.update_velocities();
        self.counters.unconverged += 1;
    }

    /// Newton's method, for the laws as well. Returns `true` if it converged.
    fn newton(&mut self, law: &impl Fn(usize, f64) -> Response) -> bool {
        for _ in 0..NEWTON_STEPS {
            self.update_velocities();
            self.linearize(law);
            if self.error() <= TOLERANCE {
                return true;
            }
            self.counters.newton_steps += 1;
            if !self.newton_step() {
                return false;
            }
        }
        self.update_velocities();
        self.linearize(law);
        self.error() <= TOLERANCE
    }

    /// Returns the loss of energy, J, when tangential impulses take all tangential velocities away; `forces` are these impulses.
    /// `None` if there is nothing to be solved. The matrix is meant without the half step.
    pub(super) fn project(&mut self) -> Option<f64> {
        let m = self.places.len();
        self.active.clear();
        self.active.extend(0..m);
        self.gather();
        let (mut trace, mut rows) = (0.0, 0.0);
        for (k, place) in self.places.iter().enumerate() {
            let own = &self.delassus[k * m + k];
            trace += (1..=place.tangents).map(|r| own[r][r]).sum::<f64>();
            rows += place.tangents as f64;
        }
        for x in 0..m {
            for y in 0..m {
                let block = &mut self.matrix[x * m + y];
                block[0] = [0.0; 4];
                block.iter_mut().for_each(|row| row[0] = 0.0);
            }
            let own = &mut self.matrix[x * m + x];
            own[0][0] = 1.0;
            for r in 1..=self.places[x].tangents {
                own[r][r] += PROXIMAL * trace / rows;
            }
            self.places[x].fill(own);
        }
        if m == 0 || !factorize(&mut self.matrix, m) {
            return None;
        }
        self.forces.fill([0.0; 4]);
        for _ in 0..2 {
            self.update_velocities();
            for (change, velocities) in self.change.iter_mut().zip(&self.velocities) {
                *change = velocities.map(|velocity| -velocity);
                change[0] = 0.0;
            }
            solve(&self.matrix, m, &mut self.change);
            for (forces, change) in self.forces.iter_mut().zip(&self.change) {
                add_scaled(forces, 1.0, change);
            }
        }
        self.update_velocities();
        let numbers = self
            .forces
            .iter()
            .flatten()
            .zip(self.free.iter().flatten().zip(self.velocities.iter().flatten()));
        Some(-0.5 * numbers.map(|(force, (free, velocity))| force * (free + velocity)).sum::<f64>())
    }

    /// Largest residual of the forces (those of the natural map), relative to the largest force.
    fn error(&self) -> f64 {
        let (mut error, mut scale) = (0.0f64, 0.0f64);
        for (k, (place, forces)) in self.places.iter().zip(&self.forces).enumerate() {
            error = error.max((forces[0] - self.pressing(k).max(0.0)).abs());
            scale = scale.max(forces[0]);
            if place.tangents > 0 {
                let mut target = place.reach(forces, &self.velocities[k]);
                into_ball(&mut target, place.radius(forces));
                for (target, force) in target.iter().zip(&forces[1..]) {
                    error = error.max((target - force).abs());
                }
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
    fn pressing(&self, contact: usize) -> f64 {
        let place = &self.places[contact];
        if !(place.s > 0.0) {
            return 0.0;
        }
        let own = self.delassus[contact * (self.places.len() + 1)][0][0];
        let others = self.velocities[contact][0] - own * self.forces[contact][0];
        (place.a - place.s * others) / (place.s * own + 1.0)
    }

    /// One step of the semismooth Newton method. Returns `false` if its matrix is singular.
    fn newton_step(&mut self) -> bool {
        self.active.clear();
        let mut opens = false;
        for k in 0..self.places.len() {
            if self.pressing(k) > 0.0 {
                self.active.push(k);
            } else if self.forces[k] != [0.0; 4] {
                self.forces[k] = [0.0; 4];
                opens = true;
            }
        }
        if opens {
            self.update_velocities();
        }
        let m = self.active.len();
        self.gather();
        for (x, y) in (0..m).flat_map(|x| (0..x).map(move |y| (x, y))) {
            self.matrix[x * m + y] = transposed(&self.matrix[y * m + x]);
        }
        for (x, &k) in self.active.iter().enumerate() {
            let (place, forces, velocities) = (&self.places[k], &self.forces[k], &self.velocities[k]);
            let row = &mut self.matrix[x * m..(x + 1) * m];
            let change = &mut self.change[x];
            *change = velocities.map(|velocity| -velocity);
            change[0] += (place.a - forces[0]) * place.softness();
            let (radius, y) = (place.radius(forces), place.reach(forces, velocities));
            let reach = length(&y);
            if place.tangents == 0 || reach <= radius && radius > 0.0 {
                place.soften(&mut row[x]);
                continue;
            }
            let direction = if reach > 0.0 { y.map(|y| y / reach) } else { y };
            let share = if reach > 0.0 { radius / reach } else { 0.0 };
            let mut inside = [forces[1], forces[2], forces[3]];
            into_ball(&mut inside, radius);
            // (1 - M) dl + r M dc - direction mu dl_n = radius direction - l, with M = share 1 - inside direction^T / reach,
            // divided by r.
            let mut blend = ZERO;
            blend[0][0] = 1.0;
            let mut own = ZERO;
            for i in 0..place.tangents {
                for j in 0..place.tangents {
                    let (unit, turn) = (
                        f64::from(u8::from(i == j)),
                        if reach > 0.0 { inside[i] * direction[j] / reach } else { 0.0 },
                    );
                    let m = share * unit - turn;
                    blend[i + 1][j + 1] = m;
                    own[i + 1][j + 1] = (unit - m) / place.step;
                }
                own[i + 1][0] = -direction[i] * place.friction / place.step;
                change[i + 1] = (radius * direction[i] - forces[i + 1]) / place.step;
            }
            own[0][0] = place.softness();
            place.fill(&mut own);
            for block in row.iter_mut() {
                *block = product(&blend, block);
            }
            for (row, own) in row[x].iter_mut().zip(&own) {
                add_scaled(row, 1.0, own);
            }
        }
        if !eliminate(&mut self.matrix, m, &mut self.change) {
            return false;
        }
        for (&k, change) in self.active.iter().zip(&self.change) {
            add_scaled(&mut self.forces[k], 1.0, change);
        }
        true
    }

    /// One sweep of block Gauss-Seidel: each contact is solved exactly, all others as they are.
    fn sweep(&mut self) {
        for (k, place) in self.places.iter().enumerate() {
            self.forces[k] = if place.s > 0.0 {
                // Velocities of its rows without its own forces; the proximal term draws to the forces before, so that
                // nothing of it is left in the end.
                let before = std::mem::take(&mut self.forces[k]);
                let mut free = self.free[k];
                for (other, forces) in self.forces.iter().enumerate() {
                    add_scaled(&mut free, 1.0, &times(&self.block(k, other), forces));
                }
                add_scaled(&mut free, -place.proximal, &[0.0, before[1], before[2], before[3]]);
                free[0] -= place.a * place.softness();
                let mut own = self.block(k, k);
                place.soften(&mut own);
                one_contact(&own, &free, place.tangents, place.friction)
            } else {
                [0.0; 4]
            };
        }
    }
}
