//! Properties of the parts: numbers that a scene gives, and a plant acts on.

use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};

/// The material of a fingertip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingertipModel {
    /// Radius `r_i`, m.
    pub radius_m: f64,
    /// Elastic coefficient `k_i` of Eq. 14, N/m^2.
    pub stiffness_n_m2: f64,
    /// Damping `xi_i` for each square metre of contact area, N s/m^3.
    pub damping_n_s_m3: f64,
    /// Torsional viscosity `b_i` for each square metre of contact area, N m s/rad/m^2 = N s/m.
    pub torsion_n_s_m: f64,
}

impl FingertipModel {
    /// The fingertip that gives way as this one and another one do that are pressed onto each other, each by its own law, with the
    /// same force: `k_1 dr_1^2 = k_2 dr_2^2`, and their indentations add up.
    pub fn onto(&self, other: &Self) -> Self {
        let sum = 1.0 / self.stiffness_n_m2.square_root() + 1.0 / other.stiffness_n_m2.square_root();
        Self {
            radius_m: self.radius_m.min(other.radius_m),
            stiffness_n_m2: 1.0 / (sum * sum),
            damping_n_s_m3: 1.0 / (1.0 / self.damping_n_s_m3 + 1.0 / other.damping_n_s_m3),
            torsion_n_s_m: 0.0,
        }
    }
}

/// The face that a fingertip rolls on, for the whole run (the paper's assumption 3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceContact {
    /// Index of the face.
    pub face: usize,
    /// Contact frame `R_Ci` in the object frame (Eq. 3): columns `C_X`, `C_Y` (unit normal **into** the object), `C_Z`,
    /// with `C_X x C_Y = C_Z`.
    pub frame: Matrix3<f64>,
    /// Distance `Y_i` of the face from the object's centre of mass, m.
    pub distance_m: f64,
}

/// Stiffness of a corner of the object on a table, N/m: that of hard plastic on wood.
pub const CORNER_STIFFNESS_N_M: f64 = 6e4;

/// Friction of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactFriction {
    /// Coefficient of Coulomb friction.
    pub sliding: f64,
    /// Largest torsional torque for each newton of normal force, m; it shares the limit with the tangential force, as the
    /// ellipsoidal limit surface has it.
    pub torsion_m: f64,
}

/// Friction of one joint; zero in the paper's model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointFriction {
    /// Viscous coefficient, N m s/rad.
    pub viscous_nm_s: f64,
    /// Coulomb torque, N m.
    pub coulomb_nm: f64,
    /// Displacement at which a joint begins to slide, rad; positive wherever the Coulomb torque is.
    pub presliding_rad: f64,
    /// Damping of a joint that sticks, N m s/rad (`sigma_1` of the LuGre family).
    pub presliding_damping_nm_s: f64,
}

/// A force and a moment on the object, for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Its beginning, s from the plant's start.
    pub from_s: f64,
    /// Its length, s.
    pub for_s: f64,
    /// Time in which it rises at its beginning, and falls at its end, s; at most half of its length.
    pub rise_s: f64,
    /// Force at the centre of mass, base axes, N.
    pub force_n: Vector3<f64>,
    /// Moment, base axes, N m.
    pub moment_nm: Vector3<f64>,
}
