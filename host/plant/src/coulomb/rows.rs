//! The rows of a contact: what takes the velocities of hand and object to what it feels. Four together, since that is how
//! processors calculate: the rate of the gap, slip along two tangents, and torsion. Those that a contact has not are zero.

use super::linear::{Block, Four, ZERO, add_scaled, dot};
use crate::mass::{Branches, MassFactor};
use crate::vectors::{Everything, OBJECT};
use blindgrasp_body::MAX_CHAIN;

/// Number of velocities that the rows of a contact act on at most.
const MOST: usize = MAX_CHAIN + OBJECT + 2 * MAX_CHAIN;

/// The rows of a contact, by what they act on: the joints of the trunk, the object, and the joints of one finger, seldom
/// of two.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    finger: Option<usize>,
    second: Option<usize>,
    entries: [Four; MOST],
    /// The numbers of those in use: without a finger, with the first one, and all.
    common: usize,
    count: usize,
    all: usize,
}

impl Rows {
    /// Nothing, to be set.
    pub(super) const NONE: Self =
        Self { finger: None, second: None, entries: [[0.0; 4]; MOST], common: 0, count: 0, all: 0 };

    /// Sets what joints and object contribute.
    pub(super) fn set(
        &mut self,
        branches: &Branches,
        fingers: [Option<usize>; 2],
        joint: impl Fn(usize) -> Four,
        object: &[Four; OBJECT],
    ) {
        self.finger = fingers[0].or(fingers[1]);
        self.second = fingers[1].filter(|_| self.finger != fingers[1]);
        let (own, others) = (chain(branches, self.finger), chain(branches, self.second));
        self.common = branches.trunk.len() + OBJECT;
        self.count = self.common + own.len();
        self.all = self.count + others.len();
        let (trunk, rest) = self.entries.split_at_mut(branches.trunk.len());
        rest[..OBJECT].copy_from_slice(object);
        let fingers = rest[OBJECT..].iter_mut().zip(own.iter().chain(others));
        for (entry, &k) in trunk.iter_mut().zip(&branches.trunk).chain(fingers) {
            *entry = joint(k);
        }
    }

    /// Products with velocities; or, once both are whitened, with forces.
    pub(super) fn times(&self, branches: &Branches, v: &Everything) -> Four {
        let mut sums = [0.0; 4];
        let (trunk, rest) = self.entries.split_at(branches.trunk.len());
        for (row, &k) in trunk.iter().zip(&branches.trunk) {
            add_scaled(&mut sums, v.joints[k], row);
        }
        for (row, v) in rest.iter().zip(&v.object) {
            add_scaled(&mut sums, *v, row);
        }
        for (row, &k) in rest[OBJECT..].iter().zip(chain(branches, self.finger)) {
            add_scaled(&mut sums, v.joints[k], row);
        }
        if self.second.is_some() {
            for (row, &k) in self.entries[self.count..].iter().zip(chain(branches, self.second)) {
                add_scaled(&mut sums, v.joints[k], row);
            }
        }
        sums
    }

    /// Adds the rows, scaled by forces.
    pub(super) fn push(&self, branches: &Branches, forces: &Four, sum: &mut Everything) {
        let (trunk, rest) = self.entries.split_at(branches.trunk.len());
        for (row, &k) in trunk.iter().zip(&branches.trunk) {
            sum.joints[k] += dot(row, forces);
        }
        for (row, sum) in rest.iter().zip(&mut sum.object) {
            *sum += dot(row, forces);
        }
        for (row, &k) in rest[OBJECT..].iter().zip(chain(branches, self.finger)) {
            sum.joints[k] += dot(row, forces);
        }
        if self.second.is_some() {
            for (row, &k) in self.entries[self.count..].iter().zip(chain(branches, self.second)) {
                sum.joints[k] += dot(row, forces);
            }
        }
    }

    /// `L^-1 J^T`, in place.
    pub(super) fn whiten(&mut self, mass: &MassFactor) {
        let (head, fingers) = self.entries[..self.all].split_at_mut(self.common);
        let (trunk, object) = head.split_at_mut(mass.branches.trunk.len());
        let (own, others) = fingers.split_at_mut(self.count - self.common);
        for (finger, own) in [(self.finger, own), (self.second, others)] {
            let Some(i) = finger else { break };
            forward(&mass.finger_factors[i], own);
            for (row, shared) in trunk.iter_mut().zip(&mass.finger_trunk[i]) {
                for (own, shared) in own.iter().zip(shared) {
                    add_scaled(row, -shared, own);
                }
            }
        }
        forward(&mass.trunk_factor, trunk);
        let (linear, angular) = object.split_at_mut(3);
        for row in linear {
            *row = row.map(|entry| entry / mass.root_mass);
        }
        forward(&mass.inertia_factor, angular);
    }

    /// Sets the products of all rows with all of another contact, both whitened, times `scale`.
    pub(super) fn multiply(&self, other: &Self, scale: f64, block: &mut Block) {
        if self.second.is_none() && other.second.is_none() {
            let count = if self.finger == other.finger { self.count } else { self.common };
            sum_products(&self.entries[..count], &other.entries[..count], scale, block);
            return;
        }
        sum_products(&self.entries[..self.common], &other.entries[..self.common], scale, block);
        for (finger, own) in self.fingers() {
            for (_, others) in other.fingers().into_iter().filter(|(of, _)| finger.is_some() && *of == finger)
            {
                let mut part = ZERO;
                sum_products(own, others, scale, &mut part);
                for (row, part) in block.iter_mut().zip(&part) {
                    add_scaled(row, 1.0, part);
                }
            }
        }
    }

    fn fingers(&self) -> [(Option<usize>, &[Four]); 2] {
        let (own, others) = self.entries[self.common..self.all].split_at(self.count - self.common);
        [(self.finger, own), (self.second, others)]
    }
}

/// The joints of a finger.
fn chain(branches: &Branches, finger: Option<usize>) -> &[usize] {
    finger.map_or(&[][..], |i| &branches.fingers[i])
}

/// Sets a block to the sum of the products of all with all. On its own, the compiler keeps it in registers.
#[inline(never)]
fn sum_products(a: &[Four], b: &[Four], scale: f64, block: &mut Block) {
    let mut sums = ZERO;
    for (a, b) in a.iter().zip(b) {
        for (row, a) in sums.iter_mut().zip(a) {
            add_scaled(row, *a, b);
        }
    }
    *block = sums.map(|row| row.map(|entry| scale * entry));
}

/// Solves `L y = b` for four right-hand sides, in place; the factor's diagonal is stored inverted.
fn forward<const S: usize>(l: &[[f64; S]; S], b: &mut [Four]) {
    for i in 0..b.len() {
        let (done, rest) = b.split_at_mut(i);
        let row = &mut rest[0];
        for (entry, done) in l[i].iter().zip(done.iter()) {
            add_scaled(row, -entry, done);
        }
        *row = row.map(|entry| entry * l[i][i]);
    }
}
