//! Places where two bodies may touch, and the rows that take the velocities of hand and object to what a contact feels:
//! the rate of the gap, slip, and torsion.
//!
//! The normal points from the first body to the second. Slip is the difference of the velocities of the two bodies' material
//! points at the contact: Eq. 10 on a face. All corners of an object on a table are taken on the table's own plane.

use super::linear::Four;
use super::material::Material;
use super::world::Friction;
use blindgrasp_body::{Capsule, FingertipModel, Hand, Part};
use nalgebra::Vector3;

/// The two bodies of a contact, the first one first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pair {
    /// A fingertip and the object.
    FingertipObject {
        /// The finger.
        finger: usize,
        /// Number of the face, edge or vertex of an object that is not convex; of a convex one the whole surface is one.
        feature: usize,
    },
    /// A fingertip and a table.
    FingertipTable {
        /// The finger.
        finger: usize,
        /// The table.
        table: usize,
    },
    /// A corner of the object and a table.
    ObjectTable {
        /// Index of the vertex.
        corner: usize,
        /// The table.
        table: usize,
    },
    /// A capsule of the hand and the object.
    CapsuleObject {
        /// The capsule.
        capsule: usize,
        /// The second of the two places at which it lies on the object.
        is_second: bool,
        /// As of a fingertip.
        feature: usize,
    },
    /// An end of a capsule and a table.
    CapsuleTable {
        /// The capsule.
        capsule: usize,
        /// The table.
        table: usize,
        /// The end of its line: 0 or 1.
        end: usize,
    },
    /// Two parts of the hand.
    Parts {
        /// The one.
        first: Part,
        /// The other.
        second: Part,
    },
    /// A fingertip and the object: the viscous torsion of the rolling contact, one way round.
    #[doc(hidden)]
    Torsion {
        /// The finger.
        finger: usize,
    },
    /// A joint and the end of its range.
    JointLimit {
        /// The joint.
        joint: usize,
        /// The upper end.
        is_upper: bool,
    },
}

/// A body that a contact is between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// A link, by its joint.
    Link(usize),
    Object,
    /// Base or table.
    World,
}

impl Pair {
    /// Both bodies, the first one first. A joint's end of range has none.
    pub(super) fn sides(self, hand: &Hand, capsules: &[Capsule]) -> [Side; 2] {
        let part = |part: Part| part.link(hand, capsules).map_or(Side::World, Side::Link);
        let tip = |finger: usize| Side::Link(hand.fingertip_link(finger));
        match self {
            Self::FingertipObject { finger, .. } | Self::Torsion { finger } => [tip(finger), Side::Object],
            Self::FingertipTable { finger, .. } => [tip(finger), Side::World],
            Self::ObjectTable { .. } => [Side::Object, Side::World],
            Self::CapsuleObject { capsule, .. } => [part(Part::Capsule(capsule)), Side::Object],
            Self::CapsuleTable { capsule, .. } => [part(Part::Capsule(capsule)), Side::World],
            Self::Parts { first, second } => [part(first), part(second)],
            Self::JointLimit { .. } => [Side::World; 2],
        }
    }

    pub(super) fn table(self) -> Option<usize> {
        match self {
            Self::FingertipTable { table, .. }
            | Self::ObjectTable { table, .. }
            | Self::CapsuleTable { table, .. } => Some(table),
            _ => None,
        }
    }
}

/// Two bodies that touch or nearly touch.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// The bodies.
    pub pair: Pair,
    /// Place of the contact, m.
    pub point_m: Vector3<f64>,
    /// Unit vector from the first body to the second.
    pub normal: Vector3<f64>,
    /// Unit vectors across it.
    pub tangents: [Vector3<f64>; 2],
    /// Depth, m; negative where there is a gap. For the end of a joint's range, rad.
    pub depth_m: f64,
    /// Friction.
    pub friction: Friction,
    /// Material.
    pub(super) material: Material,
    /// It takes away what others have too much, with the negative of its force: at a concave edge of the object.
    pub(super) is_negative: bool,
}

impl Touch {
    pub(super) fn new(pair: Pair, depth_m: f64, point_m: Vector3<f64>, normal: Vector3<f64>) -> Self {
        let helper = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let first = helper.cross(&normal).normalize();
        let tangents = [first, normal.cross(&first)];
        let (friction, material) = Default::default();
        Self { pair, point_m, normal, tangents, depth_m, friction, material, is_negative: false }
    }

    /// The number of tangential rows: none without friction, a third one with torsion.
    pub(super) fn tangents(&self) -> usize {
        match self.friction {
            Friction { sliding, .. } if !(sliding > 0.0) => 0,
            Friction { torsion_m, .. } if !(torsion_m > 0.0) => 2,
            Friction { .. } => 3,
        }
    }

    /// The vectors along which each row feels the velocity of the second body against the first, at the contact, and their
    /// spin.
    pub(super) fn along(&self) -> [[Vector3<f64>; 4]; 2] {
        let [mut linear, mut angular] = [[Vector3::zeros(); 4]; 2];
        match self.pair {
            Pair::Torsion { .. } => angular[0] = self.normal,
            _ => linear[0] = self.normal,
        }
        let tangents = self.tangents();
        if tangents > 0 {
            [linear[1], linear[2]] = self.tangents;
        }
        if tangents > 2 {
            angular[3] = self.normal * self.torsion_length_m();
        }
        [linear, angular]
    }

    /// A velocity of the second body as the rows feel it.
    pub(super) fn feels(&self, velocity_m_s: &Vector3<f64>) -> Four {
        self.along()[0].map(|linear| linear.dot(velocity_m_s))
    }

    /// The torsion of a fingertip against the object as the rolling contact has it, one way round.
    pub(super) fn viscous_torsion(&self, sign: f64, fingertips: &[FingertipModel]) -> Option<Self> {
        let Pair::FingertipObject { finger, .. } = self.pair else { return None };
        let tip = &fingertips[finger];
        let pressed_m = self.depth_m.max(0.0);
        let area_m2 = std::f64::consts::PI * (2.0 * tip.radius_m - pressed_m).max(0.0) * pressed_m;
        let material = Material { damping: [tip.torsion_n_s_m * area_m2, 0.0, 0.0], ..Material::default() };
        let friction = Friction::default();
        Some(Self { pair: Pair::Torsion { finger }, normal: self.normal * sign, friction, material, ..*self })
    }

    /// Scale of the torsional row, m: it makes the limits of all three tangential forces one ball.
    pub(super) fn torsion_length_m(&self) -> f64 {
        self.friction.torsion_m / self.friction.sliding
    }
}
