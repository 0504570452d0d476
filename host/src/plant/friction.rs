//! Friction in the joints: viscous, and Coulomb friction that really sticks.
//!
//! Coulomb friction is an elastoplastic element (Dupont, Hayward, Armstrong, Altpeter, *Single state elastoplastic
//! friction models*, 2002, with a piecewise linear transition): a damped spring between the joint and a slider that gives
//! way at the Coulomb torque. Below it the joint rests on the spring and does not creep, however long it is loaded;
//! above it the torque is constant. Real gears show this *presliding* displacement and its damping.

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

/// What friction does to a joint at one instant: `-(torque + damping * speed)`, with a stiffness against displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionTorque {
    /// Torque at standstill, N m.
    pub torque_nm: f64,
    /// Damping, N m s/rad.
    pub damping_nm_s: f64,
    /// Stiffness, N m/rad; zero while the joint slides.
    pub stiffness_nm: f64,
}

impl FrictionTorque {
    /// No friction.
    pub const NONE: Self = Self { torque_nm: 0.0, damping_nm_s: 0.0, stiffness_nm: 0.0 };
}

impl JointFriction {
    /// Friction of a joint whose spring is stretched by `stretch_rad` and which moves at about `speed_rad_s`.
    pub fn torque(&self, stretch_rad: f64, speed_rad_s: f64) -> FrictionTorque {
        let stiffness_nm = if self.coulomb_nm > 0.0 { self.coulomb_nm / self.presliding_rad } else { 0.0 };
        let sticking = stiffness_nm * stretch_rad + self.presliding_damping_nm_s * speed_rad_s;
        if sticking.abs() > self.coulomb_nm {
            FrictionTorque {
                torque_nm: self.coulomb_nm.copysign(sticking),
                damping_nm_s: self.viscous_nm_s,
                stiffness_nm: 0.0,
            }
        } else {
            FrictionTorque {
                torque_nm: stiffness_nm * stretch_rad,
                damping_nm_s: self.viscous_nm_s + self.presliding_damping_nm_s,
                stiffness_nm,
            }
        }
    }

    /// The spring's stretch after a move: it never exceeds the presliding displacement.
    pub fn stretch(&self, stretch_rad: f64, move_rad: f64) -> f64 {
        (stretch_rad + move_rad).clamp(-self.presliding_rad, self.presliding_rad)
    }
}
