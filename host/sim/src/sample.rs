//! One sample a control tick: the state of everything.

use blindgrasp_body::{Hand, MAX_JOINTS, Posture};
use blindgrasp_plant::coulomb::Pair;
use blindgrasp_plant::{FrictionState, OtherContact};
use blindgrasp_shared::control::PerGain;
use nalgebra::{UnitQuaternion, Vector3};

/// The state of everything at one control tick. Vectors are in the base frame of the hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Time since the start of the run, s.
    pub t_s: f64,
    /// True joint angles, rad.
    pub angles_rad: Vec<f64>,
    /// True joint speeds, rad/s.
    pub speeds_rad_s: Vec<f64>,
    /// Joint angles as the controller estimates them, rad.
    pub estimated_angles_rad: Vec<f64>,
    /// Joint speeds as the controller estimates them, rad/s.
    pub estimated_speeds_rad_s: Vec<f64>,
    /// Torques applied to the joints, N m.
    pub torques_nm: Vec<f64>,
    /// Centre of mass of the object, m.
    pub position_m: Vector3<f64>,
    /// Attitude `R` of the object.
    pub attitude: UnitQuaternion<f64>,
    /// Velocity of the object's centre of mass, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular velocity of the object, rad/s.
    pub spin_rad_s: Vector3<f64>,
    /// One for each finger.
    pub contacts: Vec<ContactSample>,
    /// All other contacts that carry something: with tables, of links, of parts of the hand with each other.
    pub others: Vec<OtherContact>,
    /// The tables: a point of each, m, and its normal.
    pub tables: Vec<[Vector3<f64>; 2]>,
    /// Energy of Eq. 40 with its constants added, J.
    pub energy_j: f64,
    /// Its parts, and what flowed since the start of the run.
    pub energies: EnergySample,
    /// The controller's mode, as a word.
    pub mode: &'static str,
}

impl Sample {
    /// The joint angles as the law and the kinematics take them: unused joints at zero, rad.
    pub fn joint_angles_rad(&self) -> [f64; MAX_JOINTS] {
        let mut angles_rad = [0.0; MAX_JOINTS];
        for (slot, angle) in angles_rad.iter_mut().zip(&self.angles_rad) {
            *slot = *angle;
        }
        angles_rad
    }

    /// The force of tables on the object, N.
    pub fn table_force_n(&self) -> Vector3<f64> {
        let on_object = self.others.iter().filter(|of| matches!(of.pair, Pair::ObjectTable { .. }));
        on_object.map(|of| of.force_n).sum()
    }

    /// The force of links and palm on the object, N.
    pub fn link_force_n(&self) -> Vector3<f64> {
        let on_object = self.others.iter().filter(|of| matches!(of.pair, Pair::CapsuleObject { .. }));
        on_object.map(|of| of.force_n).sum()
    }

    /// The posture of the hand, whose joints are where they were.
    pub fn posture(&self, hand: &Hand) -> Posture {
        let mut posture = Posture::at_base();
        hand.forward_kinematics(&self.joint_angles_rad(), &mut posture);
        posture
    }
}

/// Energy at one control tick: what is stored where, and what flowed since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergySample {
    /// Kinetic energy `K` (Eq. 16), J.
    pub kinetic_j: f64,
    /// Elastic energy of the fingertips (Eq. 18), J.
    pub elastic_j: f64,
    /// Potential energy of the weight of hand and object, J, above some level.
    pub weight_j: f64,
    /// Potential of each gain of the laws, at its full force, J: `V_s` (Eq. 43), `V_st` (Eq. 44) above its least value, and what
    /// other laws have.
    pub potentials_j: PerGain<f64>,
    /// Work of the motors, J.
    pub motors_j: f64,
    /// Work of what pushes the object from outside, J.
    pub pushes_j: f64,
    /// The part of it that the damping `C` of the law takes, the integral of `dq^T C dq`, J.
    pub damping_j: f64,
    /// Taken by the dampers of the normal forces, `xi (d(dr)/dt)^2`, J.
    pub indentation_j: f64,
    /// Taken by the torsional viscosity of the fingertips, `2 T_i`, J.
    pub torsion_j: f64,
    /// Taken by the friction of the joints, J.
    pub friction_j: f64,
    /// Taken by the friction of contacts that slip, J.
    pub slip_j: f64,
    /// Work of tables that move, J.
    pub tables_j: f64,
    /// Integral of `|dq|^2`, rad^2/s.
    pub joint_speeds_squared: f64,
    /// Integral of `|dx/dt|^2`, m^2/s.
    pub velocity_squared: f64,
    /// Integral of `|w|^2`, rad^2/s.
    pub spin_squared: f64,
}

impl EnergySample {
    /// Energy of Eq. 40 with its constants added, J.
    pub fn of_equation_40_j(&self) -> f64 {
        self.potentials_j.iter().fold(self.kinetic_j + self.elastic_j, |sum, potential_j| sum + potential_j)
    }

    /// Returns the energy that the plant stores, J: without the law's potentials, which are the motors' to give.
    pub fn stored_j(&self) -> f64 {
        self.kinetic_j + self.elastic_j + self.weight_j
    }

    /// Returns the work that motors, pushes and tables have done, J.
    pub fn given_j(&self) -> f64 {
        self.motors_j + self.pushes_j + self.tables_j
    }

    /// Returns the energy that dampers and friction have taken, J; without the law's damping, which is the motors'
    /// work.
    pub fn dissipated_j(&self) -> f64 {
        self.indentation_j + self.torsion_j + self.friction_j + self.slip_j
    }
}

/// A fingertip against the object at one control tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSample {
    /// Normal force `f_i`, N.
    pub normal_force_n: f64,
    /// Desired normal force of Eq. 57, N.
    pub desired_normal_force_n: f64,
    /// The same once all of the grasping force acts, N.
    pub full_force_n: f64,
    /// Multipliers `lambda_iX`, `lambda_iZ`, N. The force on the object is `f C_Y - lambda_X C_X - lambda_Z C_Z`.
    pub lambda_n: [f64; 2],
    /// Moment of the torsional viscosity on the object about `C_Y`, N m; on the fingertip it is the opposite.
    pub torsion_nm: f64,
    /// Indentation `dr_i`, m; negative where there is a gap.
    pub indentation_m: f64,
    /// Contact point `x_Ci`, m.
    pub point_m: Vector3<f64>,
    /// Contact frame `(C_X, C_Y, C_Z)`, columns; `C_Y` points into the object.
    pub frame: nalgebra::Matrix3<f64>,
    /// The position of the contact on its face: coordinates along `C_X` and `C_Z` from the foot of the centre of mass,
    /// m.
    pub foot_m: [f64; 2],
    /// Friction, where contacts have some.
    pub friction: Option<FrictionState>,
    /// Residual force `Delta lambda_i1` of Eq. 38 in the contact frame, N.
    pub force_residual_n: Vector3<f64>,
    /// Residual moment `Delta lambda_i2` of Eq. 38 in the contact frame, N m.
    pub moment_residual_nm: Vector3<f64>,
}

impl ContactSample {
    /// The force on the object, `f C_Y - lambda_X C_X - lambda_Z C_Z`, N.
    pub fn force_on_object_n(&self) -> Vector3<f64> {
        self.frame * Vector3::new(-self.lambda_n[0], self.normal_force_n, -self.lambda_n[1])
    }

    /// Tangential force, N.
    pub fn tangential_force_n(&self) -> f64 {
        let [x, z] = self.lambda_n;
        nalgebra::Vector2::new(x, z).norm()
    }
}
