//! The simulated world: the model that does not change, and the motion that does.

use blindgrasp_body::dynamics::{Body, JointMatrix, JointVector, mass_matrix};
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{FaceContact, FingertipModel, Hand, JointFriction, MAX_CHAIN, MAX_JOINTS, Push};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The grasped object.
#[derive(Clone, Debug)]
pub struct ObjectModel {
    /// Its shape, with the centre of mass at the origin.
    pub shape: Polyhedron,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Inertia tensor about the centre of mass in the object frame, kg m^2.
    pub inertia_kg_m2: Matrix3<f64>,
}

/// Everything that does not change during a run.
#[derive(Clone, Debug)]
pub struct PlantModel {
    /// The hand.
    pub hand: Hand,
    /// One a fingertip.
    pub fingertips: Vec<FingertipModel>,
    /// One a joint.
    pub friction: Vec<JointFriction>,
    /// Inertia of each joint's rotor as the joint feels it, times the gear squared, kg m^2; none for joints left out.
    pub rotor_inertia_kg_m2: Vec<f64>,
    /// `true` if the joints stop at the ends of their ranges.
    pub joint_limits: bool,
    /// The object.
    pub object: ObjectModel,
    /// The face that each fingertip rolls on.
    pub faces: Vec<FaceContact>,
    /// Gravity on the hand's links, m/s^2.
    pub hand_gravity_m_s2: Vector3<f64>,
    /// Gravity on the object, m/s^2; the paper neglects it (assumption 5).
    pub object_gravity_m_s2: Vector3<f64>,
    /// The pushes at the object from outside.
    pub pushes: Vec<Push>,
}

impl PlantModel {
    /// Sets the mass matrix of the hand, rotors included.
    pub fn mass_matrix(&self, bodies: &[Body; MAX_JOINTS], mass: &mut JointMatrix) {
        mass_matrix(&self.hand, bodies, mass);
        for (k, rotor) in self.rotor_inertia_kg_m2.iter().enumerate() {
            mass[k][k] += rotor;
        }
    }
}

/// The positions and velocities of everything at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Joint angles `q`, rad.
    pub angles_rad: JointVector,
    /// Joint speeds `dq`, rad/s.
    pub speeds_rad_s: JointVector,
    /// Object's centre of mass `x`, m.
    pub position_m: Vector3<f64>,
    /// Object's attitude `R`.
    pub attitude: UnitQuaternion<f64>,
    /// Object's velocity `dx`, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Object's angular velocity `w`, rad/s, in base axes.
    pub spin_rad_s: Vector3<f64>,
}

impl Motion {
    /// At rest.
    pub fn at_rest(angles_rad: JointVector, position_m: Vector3<f64>, attitude: UnitQuaternion<f64>) -> Self {
        Self {
            angles_rad,
            speeds_rad_s: [0.0; MAX_JOINTS],
            position_m,
            attitude,
            velocity_m_s: Vector3::zeros(),
            spin_rad_s: Vector3::zeros(),
        }
    }
}

/// The reason for which a grasp ended: one of the paper's assumptions no longer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Lost {
    /// A fingertip left its face (assumption 2).
    #[error("finger {} lost contact with the object", .finger + 1)]
    Contact {
        /// The finger, from 0.
        finger: usize,
    },
    /// A fingertip rolled over the edge of its face (assumption 3).
    #[error("finger {} rolled off its face", .finger + 1)]
    OffFace {
        /// The finger, from 0.
        finger: usize,
    },
    /// A fingertip came to another part of the object than its face, which the model knows nothing of (assumption 3).
    #[error("finger {} ran into another part of the object than its face", .finger + 1)]
    Blocked {
        /// The finger, from 0.
        finger: usize,
    },
    /// No fingertip has touched the object for a while.
    #[error("the object fell out of the hand: no fingertip touches it")]
    Untouched,
    /// The object is more than its own size away from where the hand had it.
    #[error("the object is more than its own size away from where the hand had it")]
    Away,
    /// The object went with the table when that went away.
    #[error("the object stayed on the table")]
    OnTable,
    /// No two fingertips touched the object at once while the hand grasped.
    #[error("the object was never grasped: no two fingertips touched it at once")]
    NeverGrasped,
    /// The rolling constraints are no longer independent (Eq. 28 has no solution).
    #[error("the rolling constraints became dependent")]
    Rank,
    /// The numbers overflowed.
    #[error("the motion diverged")]
    Diverged,
}

/// The reason for which a model can't be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A finger or the trunk has too many joints.
    #[error("a finger (or the trunk) has {joints} joints: at most {MAX_CHAIN} are supported")]
    ChainTooLong {
        /// The number of its joints.
        joints: usize,
    },
    /// The mass matrix of the hand or of the object is not positive definite in the initial posture.
    #[error(
        "the mass matrix is not positive definite in the initial posture: a joint moves no mass, or an inertia is impossible"
    )]
    NoMass,
}

/// The force of one contact at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactForce {
    /// Normal force `f_i` (Eq. 14), N: pushes the object along `C_Y`.
    pub normal_n: f64,
    /// Multiplier `lambda_iX`, N: pushes the object along `-C_X`.
    pub lambda_x_n: f64,
    /// Multiplier `lambda_iZ`, N: pushes the object along `-C_Z`.
    pub lambda_z_n: f64,
    /// Torsional torque on the object along `C_Y`, N m.
    pub torsion_nm: f64,
}
