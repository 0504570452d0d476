//! The rows of a contact: what takes the velocities of hand and object to what it feels. Four together, since that is how
//! processors calculate: the rate of the gap, slip along two tangents, and torsion. Those that a contact has not are zero.

use super::linear::{Block, Four, ZERO, add_scaled, dot};
use crate::mass::{Branches, MassFactor};
use crate::vectors::{Everything, OBJECT};
use blindgrasp_body::MAX_CHAIN;

/// Number of velocities that the rows of a contact act on at most.
const MOST: usize = MAX_CHAIN + OBJECT + MAX_CHAIN;

/// The rows of a contact, by what they act on: the joints of the trunk, the object, and the joints of one finger at most.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    finger: Option<usize>,
    entries: [Four; MOST],
    /// The numbers of those in use: without a finger, and all.
    common: usize,
    count: usize,
}

impl Rows {
    /// Nothing, to be set.
    pub(super) const NONE: Self = Self { finger: None, entries: [[0.0; 4]; MOST], common: 0, count: 0 };

    /// Sets what joints and object contribute.
    pub(super) fn set(
        &mut self,
        branches: &Branches,
        finger: Option<usize>,
        joint: impl Fn(usize) -> Four,
        object: &[Four; OBJECT],
    ) {
        let own = finger.map_or(&[][..], |i| &branches.fingers[i]);
        self.finger = finger;
        self.common = branches.trunk.len() + OBJECT;
        self.count = self.common + own.len();
        let (trunk, rest) = self.entries.split_at_mut(branches.trunk.len());
        rest[..OBJECT].copy_from_slice(object);
        for (entry, &k) in trunk.iter_mut().zip(&branches.trunk).chain(rest[OBJECT..].iter_mut().zip(own)) {
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
        let own = self.finger.map_or(&[][..], |i| &branches.fingers[i]);
        for (row, &k) in rest[OBJECT..].iter().zip(own) {
            add_scaled(&mut sums, v.joints[k], row);
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
        let own = self.finger.map_or(&[][..], |i| &branches.fingers[i]);
        for (row, &k) in rest[OBJECT..].iter().zip(own) {
            sum.joints[k] += dot(row, forces);
        }
    }

    /// `L^-1 J^T`, in place.
    pub(super) fn whiten(&mut self, mass: &MassFactor) {
        let (head, own) = self.entries[..self.count].split_at_mut(self.common);
        let (trunk, object) = head.split_at_mut(mass.branches.trunk.len());
        if let Some(i) = self.finger {
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
        let count = if self.finger == other.finger { self.count } else { self.common };
        sum_products(&self.entries[..count], &other.entries[..count], scale, block);
    }
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
