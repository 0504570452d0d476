//! Places where two bodies may touch, and the rows that take the velocities of hand and object to what a contact feels:
//! the rate of the gap, slip, and torsion.
//!
//! The normal points from the first body to the second. Slip is the difference of the velocities of the two bodies' material
//! points at the contact: Eq. 10 on a face. All corners of an object on a table are taken on the table's own plane.

use super::linear::Four;
use super::material::Material;
use super::rows::Rows;
use super::stiffness::Materials;
use super::world::{Friction, World};
use crate::mass::Branches;
use crate::model::PlantModel;
use crate::vectors::OBJECT;
use blindgrasp_body::dynamics::{Body, JointMatrix, JointVector, place_bodies};
use blindgrasp_body::polyhedron::Convex;
use blindgrasp_body::{FingertipModel, Hand, MAX_JOINTS, Posture};
use blindgrasp_shared::hand::LinkPose;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The two bodies of a contact, the first one first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pair {
    /// A fingertip and the object.
    FingertipObject {
        /// The finger.
        finger: usize,
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

impl Pair {
    /// The finger that the rows of a contact act on, if one does.
    pub(super) fn finger(self, branches: &Branches) -> Option<usize> {
        match self {
            Self::FingertipObject { finger }
            | Self::FingertipTable { finger, .. }
            | Self::Torsion { finger } => Some(finger),
            Self::ObjectTable { .. } => None,
            Self::JointLimit { joint, .. } => {
                branches.fingers.iter().position(|finger| finger.contains(&joint))
            }
        }
    }

    pub(super) fn table(self) -> Option<usize> {
        match self {
            Self::FingertipTable { table, .. } | Self::ObjectTable { table, .. } => Some(table),
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
}

impl Touch {
    fn new(pair: Pair, depth_m: f64, point_m: Vector3<f64>, normal: Vector3<f64>) -> Self {
        let helper = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let first = helper.cross(&normal).normalize();
        let tangents = [first, normal.cross(&first)];
        let (friction, material) = Default::default();
        Self { pair, point_m, normal, tangents, depth_m, friction, material }
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
        let Pair::FingertipObject { finger } = self.pair else { return None };
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

/// Positions of everything at one instant, and what follows from them.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) angles_rad: JointVector,
    pub(super) position_m: Vector3<f64>,
    pub(super) attitude: UnitQuaternion<f64>,
    pub(super) turned: Matrix3<f64>,
    pub(super) posture: Posture,
    links: [LinkPose<f64>; MAX_JOINTS],
    pub(super) bodies: [Body; MAX_JOINTS],
    pub(super) mass: JointMatrix,
}

impl Placed {
    pub(super) fn new() -> Self {
        Self {
            angles_rad: [0.0; MAX_JOINTS],
            position_m: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            turned: Matrix3::identity(),
            posture: Posture::at_base(),
            links: [LinkPose { origin_m: Vector3::zeros(), attitude: Matrix3::identity() }; MAX_JOINTS],
            bodies: [Body::NONE; MAX_JOINTS],
            mass: [[0.0; MAX_JOINTS]; MAX_JOINTS],
        }
    }

    /// Places everything.
    pub(super) fn place(
        &mut self,
        model: &PlantModel,
        angles_rad: &JointVector,
        position_m: Vector3<f64>,
        attitude: UnitQuaternion<f64>,
    ) {
        let hand = &model.hand;
        (self.angles_rad, self.position_m, self.attitude) = (*angles_rad, position_m, attitude);
        self.turned = attitude.to_rotation_matrix().into_inner();
        hand.forward_kinematics(angles_rad, &mut self.posture);
        for k in 0..hand.joint_count() {
            self.links[k] = self.posture.link(k);
        }
        place_bodies(hand, &self.posture, &mut self.bodies);
        model.mass_matrix(&self.bodies, &mut self.mass);
    }

    /// The object's inertia about its mass centre in base axes, kg m^2.
    pub(super) fn inertia_kg_m2(&self, model: &PlantModel) -> Matrix3<f64> {
        self.turned * model.object.inertia_kg_m2 * self.turned.transpose()
    }

    /// A fingertip and the object, however far they are from each other.
    pub(super) fn fingertip_touch(
        &self,
        (model, world): (&PlantModel, &World),
        (shape, materials): (&Convex, &Materials),
        finger: usize,
    ) -> Touch {
        let (centre_m, radius_m) = (self.posture.centres_m[finger], model.fingertips[finger].radius_m);
        let closest = shape.closest(&self.turned.tr_mul(&(centre_m - self.position_m)));
        let point_m = self.position_m + self.turned * closest.point_m;
        let (pair, depth_m) = (Pair::FingertipObject { finger }, radius_m - closest.distance_m);
        Touch {
            friction: world.fingertip_friction[finger],
            material: materials.fingertips[finger],
            ..Touch::new(pair, depth_m, point_m, -(self.turned * closest.normal))
        }
    }

    /// Gives every pair of bodies closer than a distance, with the tables at a time.
    pub(super) fn touches(
        &self,
        (model, world): (&PlantModel, &World),
        (shape, materials): (&Convex, &Materials),
        t_s: f64,
        within_m: f64,
        mut see: impl FnMut(&Touch),
    ) {
        let hand = &model.hand;
        for finger in 0..materials.fingertips.len() {
            let touch = self.fingertip_touch((model, world), (shape, materials), finger);
            if touch.depth_m > -within_m {
                see(&touch);
            }
        }
        for (t, table) in world.tables.iter().enumerate() {
            let origin_m = table.point_m.at(t_s);
            let corner = Pair::ObjectTable { corner: 0, table: t };
            // The same for all.
            let under = Touch::new(corner, 0.0, origin_m, -table.normal);
            for (finger, material) in materials.fingertips.iter().enumerate() {
                let centre_m = self.posture.centres_m[finger];
                let height_m = table.normal.dot(&(centre_m - origin_m));
                let depth_m = model.fingertips[finger].radius_m - height_m;
                if depth_m > -within_m {
                    let (pair, friction) =
                        (Pair::FingertipTable { finger, table: t }, table.fingertip_friction);
                    let point_m = centre_m - table.normal * height_m;
                    see(&Touch { pair, point_m, depth_m, friction, material: *material, ..under });
                }
            }
            for (corner, vertex_m) in model.object.shape.vertices_m.iter().enumerate() {
                let corner_m = self.position_m + self.turned * vertex_m;
                let height_m = table.normal.dot(&(corner_m - origin_m));
                if height_m < within_m {
                    let pair = Pair::ObjectTable { corner, table: t };
                    let friction = Friction { sliding: table.object_friction, torsion_m: 0.0 };
                    let (point_m, material) = (corner_m - table.normal * height_m, materials.corner);
                    see(&Touch { pair, point_m, depth_m: -height_m, friction, material, ..under });
                }
            }
        }
        for (joint, material) in materials.limits.iter().enumerate() {
            let (lower_rad, upper_rad) = hand.range_rad(joint);
            let angle_rad = self.angles_rad[joint];
            let is_upper = angle_rad > 0.5 * (lower_rad + upper_rad);
            let depth_rad = if is_upper { angle_rad - upper_rad } else { lower_rad - angle_rad };
            if depth_rad > -within_m {
                let pair = Pair::JointLimit { joint, is_upper };
                let touch = Touch::new(pair, depth_rad, Vector3::zeros(), Vector3::z());
                see(&Touch { material: *material, ..touch });
            }
        }
    }

    /// Sets the rows of a contact.
    pub(super) fn set_rows(&self, hand: &Hand, branches: &Branches, touch: &Touch, rows: &mut Rows) {
        let [linear, angular] = touch.along();
        let (finger, second) = match touch.pair {
            Pair::FingertipObject { finger } | Pair::Torsion { finger } => (Some(finger), 1.0),
            Pair::FingertipTable { finger, .. } => (Some(finger), 0.0),
            Pair::ObjectTable { .. } => (None, -1.0),
            Pair::JointLimit { .. } => (None, 0.0),
        };
        let joint = |k: usize| match (finger, touch.pair) {
            (Some(finger), _) if hand.moves(k, finger) => {
                let axis = self.links[k].axis();
                let velocity = (touch.point_m - self.links[k].origin_m).cross(&axis);
                std::array::from_fn(|r| linear[r].dot(&velocity) - angular[r].dot(&axis))
            }
            (None, Pair::JointLimit { joint, is_upper }) if joint == k => {
                [if is_upper { -1.0 } else { 1.0 }, 0.0, 0.0, 0.0]
            }
            _ => [0.0; 4],
        };
        let lever_m = touch.point_m - self.position_m;
        let mut object = [[0.0; 4]; OBJECT];
        for r in 0..4 {
            let turning = lever_m.cross(&linear[r]) + angular[r];
            for k in 0..3 {
                object[k][r] = second * linear[r][k];
                object[3 + k][r] = second * turning[k];
            }
        }
        rows.set(branches, touch.pair.finger(branches), joint, &object);
    }
}
