//! Seeded random inertias and hands, besides what the library draws. The same seed gives the same hand on every machine.

use crate::description::Description;
use blindgrasp::place::population;
use blindgrasp_shared::hand::{Fingertip, Joint, Link};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use std::ops::{Deref, DerefMut};

/// A source of random things: of all that the library draws, and of hands.
#[derive(Clone, Debug)]
pub struct Draw(population::Draw);

impl Deref for Draw {
    type Target = population::Draw;

    fn deref(&self) -> &population::Draw {
        &self.0
    }
}

impl DerefMut for Draw {
    fn deref_mut(&mut self) -> &mut population::Draw {
        &mut self.0
    }
}

impl Draw {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(population::Draw::new(seed))
    }

    /// Inertia about the mass centre (kg m^2) of a body of a mass that spreads over about `size_m`. It is that of a
    /// real distribution of mass, so that it is positive definite and obeys the triangle inequality, with strict
    /// signs.
    pub fn inertia(&mut self, mass_kg: f64, size_m: f64) -> Matrix3<f64> {
        let turn = self.rotation();
        let spread = Vector3::from_fn(|_, _| {
            let radius = self.within(0.1, 0.5) * size_m;
            mass_kg * radius * radius
        });
        let second_moment = turn * Matrix3::from_diagonal(&spread) * turn.transpose();
        let inertia = Matrix3::identity() * second_moment.trace() - second_moment;
        (inertia + inertia.transpose()) * 0.5
    }

    /// One number for each of `J` joints in `[-size, size]`.
    pub fn joints<const J: usize>(&mut self, size: f64) -> [f64; J] {
        std::array::from_fn(|_| self.within(-size, size))
    }

    /// A hand of two to five fingers with one to five joints each; with a trunk, one to five joints carry them all.
    ///
    /// Links are up to 0.1 m long in each direction. Some axes are parallel to their neighbour's or lie along a
    /// coordinate axis, and some inner links have no mass, as in real descriptions.
    pub fn hand(&mut self, trunk: bool) -> Description {
        let mut hand = Description::default();
        let mut last = None;
        if trunk {
            for _ in 0..self.count(1..=5) {
                let joint = self.joint(last, &hand, true);
                last = Some(hand.joints.len());
                hand.joints.push(joint);
            }
        }
        for _ in 0..self.count(2..=5) {
            let mut link = last;
            let count = self.count(1..=5);
            for k in 0..count {
                let joint = self.joint(link, &hand, k + 1 < count);
                link = Some(hand.joints.len());
                hand.joints.push(joint);
            }
            let tip = Fingertip {
                link: hand.joints.len() - 1,
                offset_m: self.vector(0.05),
                radius_m: self.within(0.005, 0.03),
            };
            hand.fingertips.push(tip);
        }
        hand
    }

    /// A random hand of at most `joints` joints.
    pub fn hand_up_to(&mut self, joints: usize, trunk: bool) -> Description {
        loop {
            let hand = self.hand(trunk);
            if hand.joints.len() <= joints {
                return hand;
            }
        }
    }

    fn joint(&mut self, parent: Option<usize>, hand: &Description, inner: bool) -> Joint<f64> {
        let mass_kg = if inner && self.chance(0.2) { 0.0 } else { self.within(0.01, 0.3) };
        let parallel = self.chance(0.25);
        let axis = match parent {
            Some(parent) if parallel => hand.joints[parent].axis,
            _ if self.chance(0.2) => {
                let sign = if self.chance(0.5) { 1.0 } else { -1.0 };
                [Vector3::x(), Vector3::y(), Vector3::z()][self.count(0..=2)] * sign
            }
            _ => self.unit(),
        };
        Joint {
            parent,
            offset_m: self.vector(0.1),
            attitude: if parallel { Matrix3::identity() } else { self.rotation() },
            axis,
            lower_rad: -PI,
            upper_rad: PI,
            link: Link {
                mass_kg,
                mass_centre_m: self.vector(0.05),
                inertia_kg_m2: self.inertia(mass_kg, 0.1),
            },
        }
    }
}
