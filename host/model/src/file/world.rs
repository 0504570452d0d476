//! The simulated world, in a file: contact, gravity, tables, and what comes from outside.

use super::key::{FileKey, keys};
use super::push::PushFile;
use serde::{Deserialize, Deserializer, Serialize, de};

/// The law of contact between fingertips and object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ContactLaw {
    /// Fingertips roll on the faces that they touch at the start, and never slip: the paper's.
    #[default]
    Rolling,
    /// Contacts stick, slip, break and come back, with Coulomb friction.
    Coulomb,
}

impl<'de> Deserialize<'de> for ContactLaw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = ContactLaw;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "\"rolling\" or \"coulomb\"")
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<ContactLaw, E> {
                match word {
                    "rolling" => Ok(ContactLaw::Rolling),
                    "coulomb" => Ok(ContactLaw::Coulomb),
                    _ => Err(E::invalid_value(de::Unexpected::Str(word), &self)),
                }
            }
        }
        deserializer.deserialize_str(Visitor)
    }
}

keys! {
    /// The simulated world.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct PlantSettings {
        /// `"rolling"`: fingertips roll on their faces and never slip, as the paper assumes; the run ends where one leaves its
        /// face. `"coulomb"`: fingertips, object and tables touch, stick, slip, let go and come back, with friction.
        #[serde(default)]
        pub contact: ContactLaw,
        /// Step of the integrator, s; it has to divide `control.period_s`. Without it, the longest that does and is at most 0.0005.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub substep_s: Option<f64>,
        /// Gravity in the hand's base frame, m/s^2. It acts on the hand; on the object only with `gravity_on_object`.
        #[serde(default = "PlantSettings::gravity_m_s2")]
        pub gravity_m_s2: [f64; 3],
        /// `true`: gravity acts on the object too. Without it, it does so where `contact` is `"coulomb"`; the paper neglects the
        /// object's weight (assumption 5).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub gravity_on_object: Option<bool>,
        /// Coefficient of friction between hand and object; without it, the least of those that the object's and the
        /// hand's files give, or 0.6.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub friction: Option<f64>,
        /// Largest torque by which a fingertip holds the object against turning about the contact's normal, for each newton of
        /// normal force, m; without it, that of the hand's file, or 0.002.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub torsional_friction_m: Option<f64>,
        /// `true`: the joints stop at the ends of their ranges. Without it, they do so where `contact` is `"coulomb"`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub joint_limits: Option<bool>,
        /// `true`: the rotors of the motors have the inertia that the hand's file gives. Without it, they have it where
        /// `contact` is `"coulomb"`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub rotors: Option<bool>,
        /// `true`: links and palm touch the object, tables and each other, as the hand's file has them (`[[capsule]]`). Without it,
        /// they do so where `contact` is `"coulomb"`; where it is `"rolling"`, they can't.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub links: Option<bool>,
        /// Tables, one `[[plant.table]]` each; with `contact = "coulomb"`.
        #[serde(rename = "table", default, skip_serializing_if = "Vec::is_empty")]
        pub tables: Vec<TableFile>,
        /// Turns of gravity, as of a hand that is turned, one `[[plant.turn]]` each, one after the other; with `contact =
        /// "coulomb"`.
        #[serde(rename = "turn", default, skip_serializing_if = "Vec::is_empty")]
        pub turns: Vec<TurnFile>,
        /// Shaking of the hand, one `[[plant.shake]]` each; with `contact = "coulomb"`.
        #[serde(rename = "shake", default, skip_serializing_if = "Vec::is_empty")]
        pub shakes: Vec<ShakeFile>,
        /// Pushes at the object from outside, one `[[plant.push]]` each; several at a time add up.
        #[serde(rename = "push", default, skip_serializing_if = "Vec::is_empty")]
        pub pushes: Vec<PushFile>,
    }
}

impl PlantSettings {
    fn gravity_m_s2() -> [f64; 3] {
        [0.0, 0.0, -9.81]
    }

    /// `true` if contacts have friction.
    pub fn has_friction(&self) -> bool {
        self.contact == ContactLaw::Coulomb
    }

    /// `true` if the object has weight.
    pub fn object_has_weight(&self) -> bool {
        self.gravity_on_object.unwrap_or(self.has_friction())
    }

    /// `true` if the joints stop at the ends of their ranges.
    pub fn joints_stop(&self) -> bool {
        self.joint_limits.unwrap_or(self.has_friction())
    }

    /// `true` if links and palm touch.
    pub fn links_touch(&self) -> bool {
        self.links.unwrap_or(self.has_friction())
    }

    /// `true` if rotors have inertia.
    pub fn rotors_turn(&self) -> bool {
        self.rotors.unwrap_or(self.has_friction())
    }
}

impl Default for PlantSettings {
    fn default() -> Self {
        Self {
            contact: ContactLaw::Rolling,
            substep_s: None,
            gravity_m_s2: Self::gravity_m_s2(),
            gravity_on_object: None,
            friction: None,
            torsional_friction_m: None,
            joint_limits: None,
            rotors: None,
            links: None,
            tables: Vec::new(),
            turns: Vec::new(),
            shakes: Vec::new(),
            pushes: Vec::new(),
        }
    }
}

keys! {
    /// A half-space that bears what lies on it.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct TableFile {
        /// A point of its surface at the start in the base frame of the hand, m.
        pub point_m: [f64; 3],
        /// Its direction out of the table, a unit vector.
        #[serde(default = "TableFile::normal")]
        pub normal: [f64; 3],
        /// Coefficient of friction against object and links.
        #[serde(default = "TableFile::friction")]
        pub friction: f64,
        /// Coefficient of friction against fingertips.
        #[serde(default = "TableFile::friction")]
        pub fingertip_friction: f64,
        /// Ways that it goes, one `[[plant.table.move]]` each; several at a time add up. A table that is lowered is a hand that
        /// is lifted.
        #[serde(rename = "move", default, skip_serializing_if = "Vec::is_empty")]
        pub moves: Vec<MoveFile>,
    }
}

impl Default for TableFile {
    fn default() -> Self {
        Self {
            point_m: [0.0; 3],
            normal: Self::normal(),
            friction: Self::friction(),
            fingertip_friction: Self::friction(),
            moves: Vec::new(),
        }
    }
}

impl TableFile {
    fn normal() -> [f64; 3] {
        [0.0, 0.0, 1.0]
    }

    fn friction() -> f64 {
        0.5
    }
}

keys! {
    /// A way of a table, begun and ended at rest: a polynomial of fifth degree.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct MoveFile {
        /// Its beginning, s; the grasp begins at 0.
        pub from_s: f64,
        /// Its length, s.
        pub for_s: f64,
        /// The way, m.
        pub by_m: [f64; 3],
    }
}

keys! {
    /// A turn of gravity in the base frame of the hand, begun and ended at rest. The hand's base is at rest otherwise: what its
    /// turning itself would add is neglected.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct TurnFile {
        /// Its beginning, s; the grasp begins at 0.
        pub from_s: f64,
        /// Its length, s.
        pub for_s: f64,
        /// Gravity at its end, m/s^2.
        pub gravity_m_s2: [f64; 3],
        /// `true`: from its beginning on the controller is told of gravity each tick, as by a robot that knows its wrist; otherwise
        /// it goes on to believe what it did.
        #[serde(default)]
        pub told: bool,
    }
}

keys! {
    /// A sine of the base's acceleration, felt as so much more gravity the other way. The controller is never told.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct ShakeFile {
        /// Its beginning, s; the grasp begins at 0.
        pub from_s: f64,
        /// Its length, s.
        pub for_s: f64,
        /// Its amplitude, m/s^2.
        pub amplitude_m_s2: [f64; 3],
        /// Its frequency, Hz.
        pub frequency_hz: f64,
    }
}
