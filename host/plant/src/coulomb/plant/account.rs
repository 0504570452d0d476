//! The account of a solved instant: contacts with their forces, and the powers that flow.

use super::{Plant, respond, table_velocity};
use crate::coulomb::solve::Problem;
use crate::coulomb::touch::{Pair, Touch};
use crate::friction::FrictionTorque;
use crate::ledger::Flows;
use crate::model::ContactForce;
use crate::plant::{FingerContact, FrictionState, TableContact};
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
    /// Share of the limit of friction that is used: 1 where it slips; 0 where there is none.
    pub fn used(&self) -> f64 {
        let limit_n = self.touch.friction.sliding * self.normal_n;
        if !(limit_n > 0.0) {
            return 0.0;
        }
        if !self.sticks {
            return 1.0;
        }
        let turning_n = match self.touch.tangents() {
            3 => self.torsion_nm / self.touch.torsion_length_m(),
            _ => 0.0,
        };
        let [x, z] = self.tangential_n;
        (Vector3::new(x, z, turning_n).norm() / limit_n).min(1.0)
    }

    /// Force on the second body, N.
    fn force_n(&self) -> Vector3<f64> {
        let Touch { normal, tangents: [x, z], .. } = self.touch;
        normal * self.normal_n + x * self.tangential_n[0] + z * self.tangential_n[1]
    }

    /// The contact as one with a table, if it is one and carries something.
    pub(crate) fn on_table(&self) -> Option<TableContact> {
        self.touch.pair.table().filter(|_| self.normal_n > 0.0)?;
        // The table is the second body.
        let (pair, point_m) = (self.touch.pair, self.touch.point_m);
        Some(TableContact { pair, point_m, force_n: -self.force_n(), used: self.used() })
    }
}

impl Plant {
    /// A fingertip against the object at this instant, after [`Self::solve`].
    pub(crate) fn finger(&self, finger: usize) -> FingerContact {
        let pair = Pair::FingertipObject { finger };
        let known = self.contacts.iter().find(|contact| contact.touch.pair == pair);
        let touch = known.map_or_else(
            || self.now.fingertip_touch((&self.model, &self.world), (&self.shape, &self.materials), finger),
            |contact| contact.touch,
        );
        let Touch { normal, point_m, depth_m, .. } = touch;
        // As scenes have it: `C_Z` as near to the object's z axis (on faces that look along z, its x axis) as the face allows.
        let [across, _, along] = [0, 1, 2].map(|k| self.now.turned.column(k).into_owned());
        let near = if normal.dot(&along).abs() < 0.9 { along } else { across };
        let z = (near - normal * normal.dot(&near)).normalize();
        let x = normal.cross(&z);
        let force = known.map_or_else(ContactForce::default, |contact| ContactForce {
            normal_n: contact.normal_n,
            lambda_x_n: -x.dot(&contact.force_n()),
            lambda_z_n: -z.dot(&contact.force_n()),
            torsion_nm: contact.torsion_nm,
        });
        let lever_m = point_m - self.motion.position_m;
        FingerContact {
            frame: Matrix3::from_columns(&[x, normal, z]),
            point_m,
            foot_m: [x.dot(&lever_m), z.dot(&lever_m)],
            indentation_m: depth_m,
            rolling_radius_m: self.model.fingertips[finger].radius_m - depth_m,
            force,
            friction: Some(FrictionState {
                used: known.map_or(0.0, Contact::used),
                limit_n: known.map_or(0.0, |contact| contact.touch.friction.sliding * contact.normal_n),
                slipped_m: self.slipped_m[finger],
            }),
        }
    }

    /// Adds what contacts of fingertips and object slip in so much time.
    pub(super) fn count_slip(&mut self, time_s: f64) {
        for contact in self.contacts.iter().filter(|contact| contact.normal_n > 0.0 && !contact.sticks) {
            if let Pair::FingertipObject { finger } = contact.touch.pair {
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
        let mut r = 0;
        for (k, touch) in self.touches.iter().enumerate() {
            let rate = -velocities[r];
            let law = respond(
                touch,
                self.rates_m_s[k],
                rate,
                (self.path_s(), tau),
                (self.started, self.as_rolling),
            );
            let damped = (forces[r] - law.elastic_n) * rate;
            match touch.pair {
                Pair::JointLimit { .. } => flows.friction += damped,
                Pair::Torsion { .. } => flows.torsion += damped,
                _ => flows.indentation += damped,
            }
            let table_m_s = self.table_velocity_now(touch);
            for part in 0..=touch.tangents() {
                if part > 0 {
                    flows.slip -= forces[r] * velocities[r];
                }
                // The table is the second body: what it takes from it is the negative of the force on it.
                flows.tables -= forces[r] * touch.along(part, &table_m_s);
                r += 1;
            }
        }
        let object = &solution.object;
        flows.pushes = dot6(&self.pushed, object);
        flows.weight += model.object.mass_kg * object_gravity.dot(&head(object));
        flows.velocity_squared = head(object).norm_squared();
        flows.spin_squared = tail(object).norm_squared();
        flows
    }

    fn table_velocity_now(&self, touch: &Touch) -> Vector3<f64> {
        let (t_s, h) = (self.time_s(), self.substep_s);
        table_velocity(&self.world, touch, (if self.started { t_s - h } else { t_s }, t_s + h))
    }

    /// Makes the list of contacts with their forces.
    pub(super) fn report(&mut self) {
        let Self { touches, problem, contacts, .. } = self;
        contacts.clear();
        let mut r = 0;
        for (k, touch) in touches.iter().enumerate() {
            let mut contact = Contact {
                touch: *touch,
                normal_n: problem.forces[r],
                tangential_n: [0.0; 2],
                torsion_nm: 0.0,
                velocity_m_s: [problem.velocities[r], 0.0, 0.0],
                torsion_rad_s: 0.0,
                sticks: problem.sticking(k).is_some(),
            };
            for part in 1..=touch.tangents() {
                let (force, velocity) = (problem.forces[r + part], problem.velocities[r + part]);
                if part < 3 {
                    contact.tangential_n[part - 1] = force;
                    contact.velocity_m_s[part] = velocity;
                } else {
                    contact.torsion_nm = force * touch.torsion_length_m();
                    contact.torsion_rad_s = velocity / touch.torsion_length_m();
                }
            }
            contacts.push(contact);
            r += 1 + touch.tangents();
        }
    }
}
