//! One soft hemispherical fingertip on one face of the object: geometry (Eqs. 3-8), forces (Eqs. 14, 15, 18) and the
//! rows that take the velocities of hand and object to what the contact feels (Eqs. 9, 10).
//!
//! Departure from the print: the second term of Eq. 14 is a damper, `xi d(dr)/dt`.

use blindgrasp_body::{FaceContact, FingertipModel, Posture};
use nalgebra::{Matrix3, Vector3};

/// A contact at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Contact frame `(C_X, C_Y, C_Z)` in the base frame.
    pub frame: Matrix3<f64>,
    /// From the fingertip's centre to the object's centre of mass, `x - x_i`, m.
    pub lever_m: Vector3<f64>,
    /// Indentation `dr_i` (Eq. 5), m.
    pub indentation_m: f64,
    /// Rolling radius `r_i - dr_i`, m.
    pub rolling_radius_m: f64,
    /// Elastic part of the normal force, `k dr^2` (Eq. 14), N.
    pub elastic_force_n: f64,
    /// Its slope `2 k dr`, N/m.
    pub stiffness_n_m: f64,
    /// Damping `xi_i`, N s/m.
    pub damping_n_s_m: f64,
    /// Torsional viscosity `b_i`, N m s/rad.
    pub torsion_nm_s: f64,
}

impl Contact {
    /// The contact of a fingertip at `centre_m` with a face of the object at `position_m`, `attitude`. Without contact
    /// (`dr <= 0`) there is no force.
    pub fn at(
        fingertip: &FingertipModel,
        face: &FaceContact,
        centre_m: &Vector3<f64>,
        position_m: &Vector3<f64>,
        attitude: &Matrix3<f64>,
    ) -> Self {
        let frame = attitude * face.frame;
        let lever_m = position_m - centre_m;
        let r = fingertip.radius_m;
        let indentation_m = r + face.distance_m - frame.column(1).dot(&lever_m);
        let pressed = indentation_m.max(0.0);
        let area = std::f64::consts::PI * (2.0 * r - pressed).max(0.0) * pressed;
        Self {
            frame,
            lever_m,
            indentation_m,
            rolling_radius_m: r - indentation_m,
            elastic_force_n: fingertip.stiffness_n_m2 * pressed * pressed,
            stiffness_n_m: 2.0 * fingertip.stiffness_n_m2 * pressed,
            damping_n_s_m: fingertip.damping_n_s_m3 * area,
            torsion_nm_s: fingertip.torsion_n_s_m * area,
        }
    }

    /// Returns the position of the contact on its face: `X_i`, `Z_i` of Eqs. 7 and 8, m, from the foot of the centre of
    /// mass.
    pub fn foot_m(&self) -> [f64; 2] {
        [-self.frame.column(0).dot(&self.lever_m), -self.frame.column(2).dot(&self.lever_m)]
    }

    /// Contact point `x_Ci`, m.
    pub fn point_m(&self, centre_m: &Vector3<f64>) -> Vector3<f64> {
        centre_m + self.frame.column(1) * self.rolling_radius_m
    }

    /// Elastic energy `P_i` (Eq. 18), J.
    pub fn elastic_energy_j(&self) -> f64 {
        self.elastic_force_n * self.indentation_m.max(0.0) / 3.0
    }

    /// Returns the contribution of the object's velocity `(dx, w)` to each row; see [`Rows`].
    #[inline]
    pub fn object_rows(&self) -> [[f64; 6]; 4] {
        let (cx, cy, cz) = (self.column(0), self.column(1), self.column(2));
        let rho = self.rolling_radius_m;
        let row = |linear: Vector3<f64>, angular: Vector3<f64>| {
            [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
        };
        [
            row(cx, cx.cross(&self.lever_m) - cz * rho),
            row(cz, cz.cross(&self.lever_m) + cx * rho),
            row(-cy, -cy.cross(&self.lever_m)),
            row(Vector3::zeros(), cy),
        ]
    }

    /// Returns the contribution of joint `k` of the finger to each row; see [`Rows`].
    #[inline]
    pub fn joint_rows(&self, posture: &Posture, centre_m: &Vector3<f64>, k: usize) -> [f64; 4] {
        let pose = posture.link(k);
        let axis = pose.axis();
        let linear = self.frame.tr_mul(&axis.cross(&(centre_m - pose.origin_m)));
        let angular = self.frame.tr_mul(&axis);
        let rho = self.rolling_radius_m;
        [rho * angular.z - linear.x, -rho * angular.x - linear.z, linear.y, -angular.y]
    }

    fn column(&self, k: usize) -> Vector3<f64> {
        self.frame.column(k).into_owned()
    }
}

/// The four rows of a contact: each takes the velocities `(dq, dx, w)` to one rate that the contact feels.
pub struct Rows;

impl Rows {
    /// Slip along `C_X` (`X_iq`, `X_ix`, `X_iw` of Eq. 10), m/s: held at zero.
    pub const SLIP_X: usize = 0;
    /// Slip along `C_Z` (`Z_iq`, `Z_ix`, `Z_iw` of Eq. 10), m/s: held at zero.
    pub const SLIP_Z: usize = 1;
    /// Rate of indentation `d(dr_i)/dt`, m/s.
    pub const INDENTATION: usize = 2;
    /// Torsion of the object against the fingertip, `C_Y . (w - w_i)` (Eq. 15), rad/s.
    pub const TORSION: usize = 3;
    /// The number of rows.
    pub const COUNT: usize = 4;
}
