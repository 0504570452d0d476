//! Friction in the joints: viscous, and Coulomb friction that really sticks.
//!
//! Coulomb friction is an elastoplastic element (Dupont, Hayward, Armstrong, Altpeter, *Single state elastoplastic
//! friction models*, 2002, with a piecewise linear transition): a damped spring between the joint and a slider that gives
//! way at the Coulomb torque. Below it the joint rests on the spring and does not creep, however long it is loaded;
//! above it the torque is constant. Real gears show this *presliding* displacement and its damping.

use blindgrasp_body::JointFriction;

/// The friction of a joint at one instant: `-(torque + damping * speed)`, with a stiffness against displacement.
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

/// Friction of a joint whose spring is stretched by `stretch_rad` and which moves at about `speed_rad_s`.
pub fn torque(friction: &JointFriction, stretch_rad: f64, speed_rad_s: f64) -> FrictionTorque {
    let stiffness_nm =
        if friction.coulomb_nm > 0.0 { friction.coulomb_nm / friction.presliding_rad } else { 0.0 };
    let sticking = stiffness_nm * stretch_rad + friction.presliding_damping_nm_s * speed_rad_s;
    if sticking.abs() > friction.coulomb_nm {
        FrictionTorque {
            torque_nm: friction.coulomb_nm.copysign(sticking),
            damping_nm_s: friction.viscous_nm_s,
            stiffness_nm: 0.0,
        }
    } else {
        FrictionTorque {
            torque_nm: stiffness_nm * stretch_rad,
            damping_nm_s: friction.viscous_nm_s + friction.presliding_damping_nm_s,
            stiffness_nm,
        }
    }
}

/// The spring's stretch after a move: it never exceeds the presliding displacement.
pub fn stretch(friction: &JointFriction, stretch_rad: f64, move_rad: f64) -> f64 {
    (stretch_rad + move_rad).clamp(-friction.presliding_rad, friction.presliding_rad)
}
