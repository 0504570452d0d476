//! The parts of the world that only contact with friction knows: tables, friction, gravity that turns.

use blindgrasp_body::Capsule;
pub use blindgrasp_body::ContactFriction as Friction;
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
    /// Links and palm of the hand, as far as they touch anything.
    pub capsules: Vec<Capsule>,
    /// Coefficient of Coulomb friction of each of them against the object, and against the hand.
    pub capsule_friction: Vec<f64>,
    /// Parts of the hand that are not joined touch each other, fingertips among them.
    pub hand_touches_itself: bool,
    /// Gravity on hand and object, m/s^2, in place of the model's constants: of a hand that is turned or shaken.
    pub gravity_m_s2: Option<Path>,
}

/// The reason for which a world can't be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// Not one friction a fingertip or a capsule.
    #[error("there are {given} frictions for {parts} {what}: give one each")]
    Frictions {
        /// Frictions.
        given: usize,
        /// Fingertips or capsules.
        what: &'static str,
        /// Their number.
        parts: usize,
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
    /// Checks the world of a hand.
    pub(super) fn check(&self, fingertips: usize) -> Result<(), WorldError> {
        for (given, what, parts) in [
            (self.fingertip_friction.len(), "fingertips", fingertips),
            (self.capsule_friction.len(), "capsules", self.capsules.len()),
        ] {
            if given != parts {
                return Err(WorldError::Frictions { given, what, parts });
            }
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
            .chain(self.capsule_friction.iter().map(|&sliding| ("a capsule's friction", sliding)));
        for (what, value) in numbers {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(WorldError::Number { what, value });
            }
        }
        if let Some(table) = self.tables.iter().position(|t| !((t.normal.norm() - 1.0).abs() < 1e-9)) {
            return Err(WorldError::Normal { table });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> World {
        World { fingertip_friction: vec![Friction { sliding: 0.6, torsion_m: 0.002 }; 3], ..World::default() }
    }

    fn said(change: impl Fn(&mut World)) -> String {
        let mut world = world();
        change(&mut world);
        world.check(3).map_or_else(|error| error.to_string(), |_| "fine".to_owned())
    }

    #[test]
    fn what_is_wrong_is_told() {
        let table = |normal: Vector3<f64>| Table {
            point_m: Path::constant(Vector3::zeros()),
            normal,
            object_friction: 0.5,
            fingertip_friction: Friction::default(),
        };
        assert_eq!(said(|_| {}), "fine");
        assert_eq!(said(|world| world.tables.push(table(Vector3::z()))), "fine");
        assert_eq!(
            said(|world| world.fingertip_friction.truncate(2)),
            "there are 2 frictions for 3 fingertips: give one each"
        );
        for (value, number) in [(-0.1, "-0.1"), (f64::INFINITY, "inf"), (f64::NAN, "NaN")] {
            assert_eq!(
                said(|world| world.fingertip_friction[1].sliding = value),
                format!("a coefficient of friction is {number}: it has to be finite and not negative")
            );
        }
        assert_eq!(
            said(|world| world.tables.push(table(Vector3::new(0.0, 1.0, 1.0)))),
            "the normal of table 1 is not a unit vector"
        );
        assert_eq!(
            said(|world| world.capsule_friction.push(0.5)),
            "there are 1 frictions for 0 capsules: give one each"
        );
    }
}
