//! Small motions about a grasp at rest: the equations of motion, linearised.
//!
//! Near rest, rolling without slip keeps velocities in the null space `N` of the Pfaffian matrix `P` (Eq. 23) of the grasp, and so
//! displacements, to first order. With `(dq, dx, w) = N dz/dt`,
//!
//! ```text
//! M z'' + D z' + K z = S^T u      q = S z
//! ```
//!
//! `M` and `D` are those of the plant, `K` is the slope of all forces but the motors', with the multipliers of the rolling
//! constraints held: central differences, which the quadratic law of Eq. 14 makes exact but for the geometry. `K` is not symmetric:
//! the constraints are nonholonomic, and their forces follow no potential.
//!
//! Of the joints' friction only the viscous part counts. Joints don't come to the ends of their ranges.

use super::contact::{Contact, Rows};
use super::model::{ContactForce, Motion, PlantModel};
use super::rotation::world_inertia;
use blindgrasp_body::dynamics::{Body, bias_torques, place_bodies};
use blindgrasp_body::{MAX_JOINTS, Posture};
use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

/// A displacement by which slopes are measured, rad or m.
const STEP: f64 = 1e-6;
/// A direction that the constraints resist by less than this share of what they resist most is free.
const FREE: f64 = 1e-10;

/// The matrices of the equations of small motions.
#[derive(Clone, Debug)]
pub struct SmallMotions {
    /// Inertia `M`.
    pub inertia: DMatrix<f64>,
    /// Damping `D` of fingertips and joints.
    pub damping: DMatrix<f64>,
    /// Stiffness `K`.
    pub stiffness: DMatrix<f64>,
    /// Turns `S` of the joints, a row each.
    pub joints: DMatrix<f64>,
}

impl SmallMotions {
    /// Of a grasp at rest, where the contacts have these forces.
    pub fn about(model: &PlantModel, motion: &Motion, forces: &[ContactForce]) -> Self {
        let here = Instant::new(model, motion);
        let (joints, count) = (model.hand.joint_count(), model.hand.joint_count() + 6);
        let rows: Vec<DMatrix<f64>> = (0..here.contacts.len()).map(|i| here.rows(i)).collect();
        let free = null_space(&rows, count);
        let mut damping = DMatrix::zeros(count, count);
        for (rows, contact) in rows.iter().zip(&here.contacts) {
            for (row, coefficient) in
                [(Rows::INDENTATION, contact.damping_n_s_m), (Rows::TORSION, contact.torsion_nm_s)]
            {
                damping += rows.row(row).tr_mul(&rows.row(row)) * coefficient;
            }
        }
        for (k, friction) in model.friction.iter().enumerate() {
            damping[(k, k)] += friction.viscous_nm_s;
        }
        let mut stiffness = DMatrix::zeros(count, count);
        for k in 0..count {
            let forces_at = |step: f64| Instant::new(model, &moved(motion, joints, k, step)).forces(forces);
            stiffness.set_column(k, &((forces_at(-STEP) - forces_at(STEP)) / (2.0 * STEP)));
        }
        Self {
            inertia: free.tr_mul(&(here.inertia() * &free)),
            damping: free.tr_mul(&(damping * &free)),
            stiffness: free.tr_mul(&(stiffness * &free)),
            joints: free.rows(0, joints).into_owned(),
        }
    }
}

/// A motion with one of its coordinates moved: a joint, then the object along or about a base axis.
fn moved(motion: &Motion, joints: usize, coordinate: usize, step: f64) -> Motion {
    let mut moved = *motion;
    match coordinate.checked_sub(joints) {
        None => moved.angles_rad[coordinate] += step,
        Some(axis @ 0..3) => moved.position_m[axis] += step,
        Some(axis) => {
            let mut turn = Vector3::zeros();
            turn[axis - 3] = step;
            moved.attitude = UnitQuaternion::from_scaled_axis(turn) * motion.attitude;
        }
    }
    moved
}

/// An orthonormal basis of the velocities that no fingertip slips at.
fn null_space(rows: &[DMatrix<f64>], count: usize) -> DMatrix<f64> {
    let mut resisted = DMatrix::zeros(count, count);
    for rows in rows {
        for row in [Rows::SLIP_X, Rows::SLIP_Z] {
            resisted += rows.row(row).tr_mul(&rows.row(row));
        }
    }
    let eigen = resisted.symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let free = (0..count).filter(|&k| eigen.eigenvalues[k] < FREE * most);
    DMatrix::from_columns(&free.map(|k| eigen.eigenvectors.column(k)).collect::<Vec<_>>())
}

/// Hand and contacts at some positions.
struct Instant<'a> {
    model: &'a PlantModel,
    motion: Motion,
    posture: Posture,
    bodies: [Body; MAX_JOINTS],
    contacts: Vec<Contact>,
}

impl<'a> Instant<'a> {
    fn new(model: &'a PlantModel, motion: &Motion) -> Self {
        let (mut posture, mut bodies) = (Posture::at_base(), [Body::NONE; MAX_JOINTS]);
        model.hand.forward_kinematics(&motion.angles_rad, &mut posture);
        place_bodies(&model.hand, &posture, &mut bodies);
        let attitude = motion.attitude.to_rotation_matrix().into_inner();
        let parts = model.fingertips.iter().zip(&model.faces).zip(&posture.centres_m);
        let contacts = parts
            .map(|((fingertip, face), centre)| {
                Contact::at(fingertip, face, centre, &motion.position_m, &attitude)
            })
            .collect();
        Self { model, motion: *motion, posture, bodies, contacts }
    }

    /// The rows of a contact, with an entry for each joint and velocity of the object.
    fn rows(&self, contact: usize) -> DMatrix<f64> {
        let joints = self.model.hand.joint_count();
        let mut rows = DMatrix::zeros(Rows::COUNT, joints + 6);
        for (row, entries) in self.contacts[contact].object_rows().iter().enumerate() {
            rows.view_mut((row, joints), (1, 6)).copy_from_slice(entries);
        }
        for k in self.model.hand.joints_to(contact) {
            let entries =
                self.contacts[contact].joint_rows(&self.posture, &self.posture.centres_m[contact], k);
            rows.column_mut(k).copy_from_slice(&entries);
        }
        rows
    }

    /// The mass matrix of hand and object.
    fn inertia(&self) -> DMatrix<f64> {
        let (joints, object) = (self.model.hand.joint_count(), &self.model.object);
        let mut mass = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        self.model.mass_matrix(&self.bodies, &mut mass);
        let turning = world_inertia(&object.inertia_kg_m2, &self.motion.attitude);
        DMatrix::from_fn(joints + 6, joints + 6, |a, b| {
            match (a.checked_sub(joints), b.checked_sub(joints)) {
                (None, None) => mass[a][b],
                (Some(a @ 3..), Some(b @ 3..)) => turning[(a - 3, b - 3)],
                (Some(a), Some(b)) if a == b => object.mass_kg,
                _ => 0.0,
            }
        })
    }

    /// Forces on joints and object at standstill, but for the motors': weights, fingertips, and rolling constraints with the
    /// multipliers given.
    fn forces(&self, held: &[ContactForce]) -> DVector<f64> {
        let PlantModel { hand, object, hand_gravity_m_s2, object_gravity_m_s2, .. } = self.model;
        let joints = hand.joint_count();
        let mut forces = DVector::zeros(joints + 6);
        let bias = bias_torques(hand, &self.bodies, &[0.0; MAX_JOINTS], hand_gravity_m_s2);
        for (force, bias) in forces.iter_mut().zip(&bias).take(joints) {
            *force = -bias;
        }
        forces.fixed_rows_mut::<3>(joints).copy_from(&(object_gravity_m_s2 * object.mass_kg));
        for (i, (contact, held)) in self.contacts.iter().zip(held).enumerate() {
            let rows = self.rows(i);
            for (row, force_n) in [
                (Rows::INDENTATION, contact.elastic_force_n),
                (Rows::SLIP_X, held.lambda_x_n),
                (Rows::SLIP_Z, held.lambda_z_n),
            ] {
                forces -= rows.row(row).transpose() * force_n;
            }
        }
        forces
    }
}
