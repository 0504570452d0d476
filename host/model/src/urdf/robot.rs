//! A URDF as it is written: links, joints, and where each of them stands.

use super::super::error::{Place, SceneError, suggestion};
use super::body::Body;
use super::shape::Shape;
use super::transform::{Transform, roll_pitch_yaw};
use nalgebra::Vector3;

/// A robot, in the file's order.
#[derive(Clone, Debug)]
pub(super) struct Robot {
    pub(super) place: Place,
    pub(super) name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<Joint>,
}

/// A link.
#[derive(Clone, Debug)]
pub(super) struct Link {
    pub(super) name: String,
    pub(super) place: Place,
    /// Its own mass, in its frame; what is wrong with it matters only if it moves.
    pub(super) body: Result<Body, SceneError>,
    /// The place where that is written.
    pub(super) body_place: Place,
    /// Its shapes, as far as no mesh is needed to know them: those that touch, then those that are only seen.
    pub(super) shapes: Vec<Shape>,
    /// Meshes that touch.
    pub(super) meshes: Vec<Mesh>,
    /// The other shapes that touch, in words.
    pub(super) left_out: Vec<String>,
}

/// A mesh of a link.
#[derive(Clone, Debug)]
pub(super) struct Mesh {
    /// Its file, as the URDF names it.
    pub(super) file: String,
    /// Factors on its coordinates, which are m with them.
    pub(super) scale: [f64; 3],
    /// Its frame in the link's.
    pub(super) pose: Transform,
}

/// A joint.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub(super) name: String,
    pub(super) place: Place,
    pub(super) kind: Kind,
    /// Index of the link that it sits on.
    pub(super) parent: usize,
    /// Index of the link that it carries.
    pub(super) child: usize,
    pub(super) origin: Origin,
    /// A unit vector in the joint's frame, which is the child's; as written, where that is exact enough.
    pub(super) axis: Vector3<f64>,
    pub(super) axis_place: Place,
    pub(super) limit: Limit,
    pub(super) dynamics: Dynamics,
    /// The joint that it follows.
    pub(super) mimics: Option<String>,
}

/// The kind of a joint's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
    Floating,
    Planar,
    Spherical,
}

impl Kind {
    /// By the words that URDF has for them.
    pub(super) const ALL: [(&'static str, Self); 7] = [
        ("fixed", Self::Fixed),
        ("revolute", Self::Revolute),
        ("continuous", Self::Continuous),
        ("prismatic", Self::Prismatic),
        ("floating", Self::Floating),
        ("planar", Self::Planar),
        ("spherical", Self::Spherical),
    ];

    pub(super) fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, kind)| *kind == self).map_or("", |(word, _)| word)
    }

    pub(super) fn turns(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous)
    }
}

/// The pose of a frame in its parent's.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    pub(super) transform: Transform,
    /// The angles as written; nothing for a quaternion.
    pub(super) rpy_rad: Option<[f64; 3]>,
    pub(super) place: Place,
}

/// `<limit>`: what is given of it.
#[derive(Clone, Debug)]
pub(super) struct Limit {
    pub(super) lower: Option<f64>,
    pub(super) upper: Option<f64>,
    pub(super) effort: Option<f64>,
    pub(super) velocity: Option<f64>,
    pub(super) place: Place,
}

/// `<dynamics>`: what is given of it.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    pub(super) damping: Option<f64>,
    pub(super) friction: Option<f64>,
    pub(super) place: Place,
}

impl Robot {
    /// Index of a joint.
    pub(super) fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Index of a link.
    pub(super) fn link_index(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Returns the remedy for a link that is not there.
    pub(super) fn link_suggestion(&self, name: &str) -> String {
        suggestion(name, self.links.iter().map(|link| link.name.as_str()))
    }
}

impl Origin {
    /// Roll, pitch and yaw, rad: as written, if they are.
    pub(super) fn rpy_rad(&self) -> [f64; 3] {
        self.rpy_rad.unwrap_or_else(|| roll_pitch_yaw(&self.transform.attitude))
    }
}
