//! The projection of velocities where contacts begin to stick.

use super::{LEAST_PIVOT, Plant, delassus, table_velocity};
use crate::mass::ObjectMass;
use crate::rotation::{solve_inertia, turn_freely};
use crate::vectors::{Everything, add, head, set_tail, tail};
use blindgrasp_body::MAX_JOINTS;

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
        let Self { ahead, model, world, shape, materials, motion, before, spin_momentum, stuck, .. } = self;
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

        let Self { touches, fingers, whitened, mass, problem, projection, .. } = self;
        touches.clear();
        ahead.touches((model, world), (shape, materials), t_s + 0.5 * h, f64::INFINITY, |touch| {
            if stuck.contains(&touch.pair) {
                touches.push(touch);
            }
        });
        let object = ObjectMass { mass_kg: model.object.mass_kg, inertia_kg_m2 };
        if !(mass.factorize(&ahead.mass, &[0.0; MAX_JOINTS], &object) > LEAST_PIVOT) {
            return;
        }
        whitened.clear();
        fingers.clear();
        projection.clear();
        for touch in touches.iter() {
            (0..touch.tangents()).for_each(|_| {
                projection.add(0, 0.0);
            });
        }
        projection.make_room();
        for touch in touches.iter() {
            let finger = touch.pair.finger(&mass.branches);
            let table_m_s = table_velocity(world, touch, (t_s, t_s + h));
            for part in 1..=touch.tangents() {
                let (mut row, r) = (ahead.row(model, touch, part), whitened.len());
                projection.velocities[r] = touch.along(part, &table_m_s);
                projection.free[r] = mass.product(finger, &row, &half) + projection.velocities[r];
                mass.whiten_branch(finger, &mut row);
                whitened.push(row);
                fingers.push(finger);
            }
        }
        delassus(mass, fingers, whitened, 1.0, projection);
        let Some(lost_j) = projection.project() else { return };
        problem.counters.projections += 1;
        let mut change = Everything::ZERO;
        for (row, impulse) in whitened.iter().zip(&projection.forces) {
            add(&mut change, *impulse, row);
        }
        mass.unwhiten(&mut change);
        add(before, 1.0, &change);
        *spin_momentum += inertia_kg_m2 * tail(&change.object);
        self.work.slip += lost_j;
        let tables: f64 = projection.forces.iter().zip(&projection.velocities).map(|(l, v)| l * v).sum();
        self.work.tables -= tables;
    }
}
