//! One sample a control tick: the state of everything.

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
    /// Energy of Eq. 40 with its constants added, J.
    pub energy_j: f64,
    /// The controller's mode, as a word.
    pub mode: &'static str,
}

/// One contact at one control tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSample {
    /// Normal force `f_i`, N.
    pub normal_force_n: f64,
    /// Desired normal force of Eq. 57, N.
    pub desired_normal_force_n: f64,
    /// Multipliers `lambda_iX`, `lambda_iZ`, N. The force on the object is `f C_Y - lambda_X C_X - lambda_Z C_Z`.
    pub lambda_n: [f64; 2],
    /// Indentation `dr_i`, m.
    pub indentation_m: f64,
    /// Contact point `x_Ci`, m.
    pub point_m: Vector3<f64>,
    /// Contact frame `(C_X, C_Y, C_Z)`, columns; `C_Y` points into the object.
    pub frame: nalgebra::Matrix3<f64>,
    /// Where the contact is on its face: coordinates along `C_X` and `C_Z` from the foot of the centre of mass, m.
    pub foot_m: [f64; 2],
    /// Residual force `Delta lambda_i1` of Eq. 38 in the contact frame, N.
    pub force_residual_n: Vector3<f64>,
    /// Residual moment `Delta lambda_i2` of Eq. 38 in the contact frame, N m.
    pub moment_residual_nm: Vector3<f64>,
}

impl ContactSample {
    /// Tangential force, N.
    pub fn tangential_force_n(&self) -> f64 {
        let [x, z] = self.lambda_n;
        nalgebra::Vector2::new(x, z).norm()
    }
}
