//! The account of a solved instant: contacts with their forces, and the powers that flow.

use super::{Plant, Relief};
use crate::coulomb::linear::{Four, dot};
use crate::coulomb::solve::Problem;
use crate::coulomb::touch::{Pair, Touch};
use crate::friction::FrictionTorque;
use crate::ledger::Flows;
use crate::model::ContactForce;
use crate::plant::{FingerContact, FrictionState, OtherContact};
use crate::vectors::{dot6, head, tail};
use blindgrasp_body::dynamics::JointVector;
use nalgebra::{Matrix3, Vector3};

/// A contact's force at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// The bodies and the geometry.
    pub touch: Touch,
    /// Normal force, N: on the second body along the normal. N m at the end of a joint's range.
    pub normal_n: f64,
    /// Force along the tangents on the second body, N.
    pub tangential_n: [f64; 2],
    /// Torsional torque on the second body along the normal, N m.
    pub torsion_nm: f64,
    /// Velocities of the second body against the first: opening of the gap, slip along the tangents, m/s.
    pub velocity_m_s: [f64; 3],
    /// Torsion, rad/s.
    pub torsion_rad_s: f64,
    /// Its force is inside of the limit of friction.
    pub sticks: bool,
}

impl Contact {
    /// Its forces as the solver has them.
    pub(super) fn forces(&self) -> Four {
        let [first, second] = self.tangential_n;
        let has_torsion = self.touch.tangents() == 3;
        let third = if has_torsion { self.torsion_nm / self.touch.torsion_length_m() } else { 0.0 };
        [self.normal_n, first, second, third]
    }

    /// Share of the limit of friction that is used: 1 where it slips; 0 where there is none.
    pub fn used(&self) -> f64 {
        let limit_n = self.touch.friction.sliding * self.normal_n;
        if !(limit_n > 0.0) {
            return 0.0;
        }
        if !self.sticks {
            return 1.0;
        }
        let [_, x, z, turning_n] = self.forces();
        (Vector3::new(x, z, turning_n).norm() / limit_n).min(1.0)
    }

    /// Force on the second body, N.
    fn force_n(&self) -> Vector3<f64> {
        let Touch { normal, tangents: [x, z], .. } = self.touch;
        normal * self.normal_n + x * self.tangential_n[0] + z * self.tangential_n[1]
    }

    /// The contact, if it is not between a fingertip and the object and carries something.
    pub(crate) fn other(&self) -> Option<OtherContact> {
        let (pair, point_m) = (self.touch.pair, self.touch.point_m);
        // A table is the second body; else the force is wanted on the second one.
        let sign = match pair {
            Pair::FingertipTable { .. } | Pair::ObjectTable { .. } | Pair::CapsuleTable { .. } => -1.0,
            Pair::CapsuleObject { .. } | Pair::Parts { .. } => 1.0,
            Pair::FingertipObject { .. } | Pair::Torsion { .. } | Pair::JointLimit { .. } => return None,
        };
        let force_n = self.force_n() * sign;
        (self.normal_n > 0.0).then(|| OtherContact { pair, point_m, force_n, used: self.used() })
    }
}

impl Plant {
    /// A fingertip against the object at this instant, after [`Self::solve`]: all its forces, at the place where it presses most.
    pub(crate) fn finger(&self, finger: usize) -> FingerContact {
        let is_mine =
            |touch: &Touch| matches!(touch.pair, Pair::FingertipObject { finger: of, .. } if of == finger);
        let mine = || self.contacts.iter().filter(|contact| is_mine(&contact.touch));
        let known = mine().reduce(|a, b| if b.normal_n > a.normal_n { b } else { a });
        let touch = known.map_or_else(
            || self.now.fingertip_touch(&self.model, &self.surfaces.object, finger),
            |contact| contact.touch,
        );
        let Touch { normal, point_m, depth_m, .. } = touch;
        // As scenes have it: `C_Z` as near to the object's z axis (on faces that look along z, its x axis) as the face allows.
        let [across, _, along] = [0, 1, 2].map(|k| self.now.turned.column(k).into_owned());
        let near = if normal.dot(&along).abs() < 0.9 { along } else { across };
        let z = (near - normal * normal.dot(&near)).normalize();
        let x = normal.cross(&z);
        let mut force = known.map_or_else(ContactForce::default, |contact| ContactForce {
            normal_n: contact.normal_n,
            lambda_x_n: -x.dot(&contact.force_n()),
            lambda_z_n: -z.dot(&contact.force_n()),
            torsion_nm: contact.torsion_nm,
        });
        let others = mine().filter(|contact| contact.touch.pair != touch.pair).map(Contact::force_n);
        let taken = self.reliefs.iter().filter(|relief| is_mine(&relief.touch));
        let taken = taken.map(|relief| relief.touch.normal * -relief.response.force_n.max(0.0));
        for force_n in others.chain(taken) {
            force.normal_n += normal.dot(&force_n);
            force.lambda_x_n -= x.dot(&force_n);
            force.lambda_z_n -= z.dot(&force_n);
        }
        let lever_m = point_m - self.motion.position_m;
        FingerContact {
            frame: Matrix3::from_columns(&[x, normal, z]),
            point_m,
            foot_m: [x.dot(&lever_m), z.dot(&lever_m)],
            indentation_m: depth_m,
            rolling_radius_m: self.model.fingertips[finger].radius_m - depth_m,
            force,
            friction: Some(FrictionState {
                used: mine().map(Contact::used).fold(0.0, f64::max),
                limit_n: mine().map(|contact| contact.touch.friction.sliding * contact.normal_n).sum(),
                slipped_m: self.slipped_m[finger],
            }),
        }
    }

    /// Adds what contacts of fingertips and object slip in so much time.
    pub(super) fn count_slip(&mut self, time_s: f64) {
        for contact in self.contacts.iter().filter(|contact| contact.normal_n > 0.0 && !contact.sticks) {
            if let Pair::FingertipObject { finger, .. } = contact.touch.pair {
                let [_, x, z] = contact.velocity_m_s;
                self.slipped_m[finger] += time_s * x.hypot(z);
            }
        }
    }

    /// Powers at this instant, with the velocities that were solved for.
    pub(super) fn powers(&self, torques_nm: &JointVector, tau: f64) -> Flows {
        let mut flows = Flows::NONE;
        let Self { model, solution, .. } = self;
        let [hand_gravity, object_gravity] = &self.gravity_m_s2;
        let weight_nm = model.hand.gravity_torques(&self.now.posture, hand_gravity);
        for (k, speed) in solution.joints.iter().enumerate().take(model.hand.joint_count()) {
            // As in `external_forces`, with the part that is implicit.
            let FrictionTorque { torque_nm, damping_nm_s, stiffness_nm } = self.friction[k];
            let friction_nm =
                torque_nm + damping_nm_s * speed + tau * stiffness_nm * (speed - self.before.joints[k]);
            flows.motors += torques_nm[k] * speed;
            flows.friction += friction_nm * speed;
            flows.weight -= weight_nm[k] * speed;
            flows.joint_speeds_squared[k] = speed * speed;
        }
        let Problem { forces, velocities, .. } = &self.problem;
        for (k, (touch, (forces, velocities))) in
            self.touches.iter().zip(forces.iter().zip(velocities)).enumerate()
        {
            let rate = -velocities[0];
            let damped = (forces[0] - self.problem.elastic_n(k)) * rate;
            match touch.pair {
                Pair::JointLimit { .. } => flows.friction += damped,
                Pair::Torsion { .. } => flows.torsion += damped,
                _ => flows.indentation += damped,
            }
            flows.slip -= dot(&[0.0, forces[1], forces[2], forces[3]], velocities);
            // The table is the second body: what it takes from it is the negative of the force on it.
            flows.tables -= dot(forces, &self.tables_m_s[k]);
        }
        for Relief { rows, response, .. } in &self.reliefs {
            let rate = -rows.times(&self.mass.branches, solution)[0];
            flows.indentation -= (response.force_n.max(0.0) - response.elastic_n) * rate;
        }
        let object = &solution.object;
        flows.pushes = dot6(&self.pushed, object);
        flows.weight += model.object.mass_kg * object_gravity.dot(&head(object));
        flows.velocity_squared = head(object).norm_squared();
        flows.spin_squared = tail(object).norm_squared();
        flows
    }

    /// Makes the list of contacts with their forces.
    pub(super) fn report(&mut self) {
        let Self { touches, problem, contacts, .. } = self;
        contacts.clear();
        for (k, (touch, (forces, velocities))) in
            touches.iter().zip(problem.forces.iter().zip(&problem.velocities)).enumerate()
        {
            let has_torsion = touch.tangents() == 3;
            let torsion_m = if has_torsion { touch.torsion_length_m() } else { 1.0 };
            contacts.push(Contact {
                touch: *touch,
                normal_n: forces[0],
                tangential_n: [forces[1], forces[2]],
                torsion_nm: forces[3] * torsion_m,
                velocity_m_s: [velocities[0], velocities[1], velocities[2]],
                torsion_rad_s: velocities[3] / torsion_m,
                sticks: problem.sticks(k),
            });
        }
    }
}
