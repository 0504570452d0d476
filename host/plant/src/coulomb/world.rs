//! The parts of the world that only contact with friction knows: tables, friction, gravity that turns, joint limits, rotors.

use blindgrasp_body::polyhedron::{Convex, Polyhedron};
use nalgebra::Vector3;
use std::fmt;
use std::sync::Arc;

/// A vector as a function of time.
#[derive(Clone)]
pub struct Path(Arc<dyn Fn(f64) -> Vector3<f64> + Send + Sync>);

impl Path {
    /// A function of the time in seconds since the plant's start. It is also asked for times a step before and after those
    /// of the run.
    pub fn new(function: impl Fn(f64) -> Vector3<f64> + Send + Sync + 'static) -> Self {
        Self(Arc::new(function))
    }

    /// A vector that does not change.
    pub fn constant(vector: Vector3<f64>) -> Self {
        Self::new(move |_| vector)
    }

    /// The vector at a time, s.
    pub fn at(&self, t_s: f64) -> Vector3<f64> {
        (self.0)(t_s)
    }
}

impl fmt::Debug for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Path(from {:?})", self.at(0.0).as_slice())
    }
}

/// Friction of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// Coefficient of Coulomb friction.
    pub sliding: f64,
    /// Largest torsional torque for each newton of normal force, m; it shares the limit with the tangential force, as the
    /// ellipsoidal limit surface has it.
    pub torsion_m: f64,
}

/// A half-space.
#[derive(Clone, Debug)]
pub struct Table {
    /// A point of its surface, m. It may move; the half-space does not turn.
    pub point_m: Path,
    /// Unit normal, out of the table.
    pub normal: Vector3<f64>,
    /// Coefficient of Coulomb friction against the object, at each of its corners.
    pub object_friction: f64,
    /// Friction against fingertips.
    pub fingertip_friction: Friction,
}

/// The world around hand and object.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// Friction of each fingertip against the object.
    pub fingertip_friction: Vec<Friction>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Gravity on hand and object, m/s^2, in place of the model's constants: of a hand that is turned or shaken.
    pub gravity_m_s2: Option<Path>,
    /// The ends of the joints' ranges act.
    pub joint_limits: bool,
    /// Inertia of each joint's rotor as the joint feels it, times the gear squared, kg m^2; none for joints left out.
    pub rotor_inertia_kg_m2: Vec<f64>,
}

/// The reason for which a world can't be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// The object is not convex.
    #[error("the object is not convex: contact with friction needs a convex object")]
    NotConvex,
    /// Not one friction a fingertip.
    #[error("there are {given} frictions for {fingertips} fingertips: give one each")]
    Fingertips {
        /// Frictions.
        given: usize,
        /// Fingertips.
        fingertips: usize,
    },
    /// A number is not what it has to be.
    #[error("{what} is {value}: it has to be finite and not negative")]
    Number {
        /// Its name.
        what: &'static str,
        /// It.
        value: f64,
    },
    /// A table's normal is not a unit vector.
    #[error("the normal of table {} is not a unit vector", .table + 1)]
    Normal {
        /// The table, from 0.
        table: usize,
    },
    /// The model has no equations of motion.
    #[error(transparent)]
    Model(#[from] crate::ModelError),
}

impl World {
    /// Checks the world of a hand and an object. Returns the object's shape, prepared.
    pub(super) fn check(&self, fingertips: usize, shape: &Polyhedron) -> Result<Convex, WorldError> {
        if self.fingertip_friction.len() != fingertips {
            return Err(WorldError::Fingertips { given: self.fingertip_friction.len(), fingertips });
        }
        let frictions =
            self.fingertip_friction.iter().chain(self.tables.iter().map(|t| &t.fingertip_friction));
        let numbers = frictions
            .flat_map(|friction| {
                [
                    ("a coefficient of friction", friction.sliding),
                    ("a torsional friction", friction.torsion_m),
                ]
            })
            .chain(self.tables.iter().map(|table| ("a table's friction", table.object_friction)))
            .chain(self.rotor_inertia_kg_m2.iter().map(|&inertia| ("a rotor's inertia", inertia)));
        for (what, value) in numbers {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(WorldError::Number { what, value });
            }
        }
        if let Some(table) = self.tables.iter().position(|t| !((t.normal.norm() - 1.0).abs() < 1e-9)) {
            return Err(WorldError::Normal { table });
        }
        Convex::of(shape).ok_or(WorldError::NotConvex)
    }
}
