//! The projection of velocities where contacts begin to stick.

use super::{LEAST_PIVOT, Plant, couple, room};
use crate::coulomb::linear::{add_scaled, dot};
use crate::coulomb::touch::Touch;
use crate::mass::ObjectMass;
use crate::rotation::{solve_inertia, turn_freely};
use crate::vectors::{Everything, add, head, set_tail, tail};
use blindgrasp_body::MAX_JOINTS;
use nalgebra::Vector3;

impl Plant {
    /// Projects, where a contact begins to stick, the velocities of the half step ahead onto no slip of all that stick.
    pub(super) fn hold_what_sticks(&mut self) {
        let begins = self.contacts.iter().any(|c| c.sticks && !self.stuck.contains(&c.touch.pair));
        self.stuck.clear();
        self.stuck.extend(self.contacts.iter().filter(|c| c.sticks).map(|c| c.touch.pair));
        if !begins || self.as_rolling {
            return;
        }
        let (h, t_s) = (self.substep_s, self.time_s());
        let Self { ahead, model, world, surfaces, motion, before, spin_momentum, stuck, .. } = self;
        let mut angles_rad = motion.angles_rad;
        for (angle, speed) in angles_rad.iter_mut().zip(&before.joints) {
            *angle += 0.5 * h * speed;
        }
        let inertia = &model.object.inertia_kg_m2;
        let attitude = turn_freely(&motion.attitude, inertia, spin_momentum, 0.5 * h);
        let position_m = motion.position_m + 0.5 * h * head(&before.object);
        ahead.place(model, &angles_rad, position_m, attitude);
        let inertia_kg_m2 = ahead.inertia_kg_m2(model);
        let mut half = *before;
        set_tail(&mut half.object, &solve_inertia(&inertia_kg_m2, spin_momentum));

        let Self { touches, rows, mass, problem, projection, .. } = self;
        touches.clear();
        ahead.touches((model, world), surfaces, t_s + 0.5 * h, f64::INFINITY, |touch| {
            if !touch.is_negative && stuck.contains(&touch.pair) {
                touches.push(*touch);
            }
        });
        let object = ObjectMass { mass_kg: model.object.mass_kg, inertia_kg_m2 };
        if !(mass.factorize(&ahead.mass, &[0.0; MAX_JOINTS], &object) > LEAST_PIVOT) {
            return;
        }
        projection.clear();
        let table_m_s = |touch: &Touch| {
            let ahead = |table: usize| {
                let point_m = &world.tables[table].point_m;
                (point_m.at(t_s + h) - point_m.at(t_s)) / h
            };
            touch.feels(&touch.pair.table().map_or_else(Vector3::zeros, ahead))
        };
        for (k, touch) in touches.iter().enumerate() {
            let own = room(rows, k);
            ahead.set_rows((model, world), &mass.branches, touch, own);
            let mut free = own.times(&mass.branches, &half);
            add_scaled(&mut free, 1.0, &table_m_s(touch));
            projection.add(touch.tangents(), touch.friction.sliding, free, [0.0; 4]);
            own.whiten(mass);
        }
        couple(rows, 1.0, projection);
        let Some(lost_j) = projection.project() else { return };
        problem.counters.projections += 1;
        let mut change = Everything::ZERO;
        for (rows, impulses) in rows.iter().zip(&projection.forces) {
            rows.push(&mass.branches, impulses, &mut change);
        }
        mass.unwhiten(&mut change);
        add(before, 1.0, &change);
        *spin_momentum += inertia_kg_m2 * tail(&change.object);
        self.work.slip += lost_j;
        let tables = touches.iter().zip(&projection.forces).map(|(touch, l)| dot(l, &table_m_s(touch)));
        self.work.tables -= tables.sum::<f64>();
    }
}
