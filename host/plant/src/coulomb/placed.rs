//! Everything at its place at one instant: what touches there, and what contacts feel.

use super::links::Links;
use super::material::Material;
use super::rows::Rows;
use super::stiffness::Materials;
use super::touch::{Pair, Side, Touch};
use super::world::{Friction, World};
use crate::mass::Branches;
use crate::model::PlantModel;
use crate::vectors::OBJECT;
use blindgrasp_body::dynamics::{Body, JointMatrix, JointVector, place_bodies};
use blindgrasp_body::polyhedron::{Closest, Critical, Touchable};
use blindgrasp_body::{Hand, MAX_JOINTS, Posture};
use blindgrasp_shared::hand::LinkPose;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The least share of a contact's force for which it has friction, if not for all of it.
const LEAST_SHARE: f64 = 1e-6;

/// The surfaces of everything.
#[derive(Clone, Debug)]
pub(super) struct Surfaces {
    pub(super) object: Touchable,
    /// Largest distance of the object's surface from its centre of mass, m.
    pub(super) radius_m: f64,
    pub(super) materials: Materials,
    pub(super) links: Links,
    /// Room for the places where one ball touches.
    pub(super) places: Vec<Critical>,
}

/// Positions of everything at one instant, and what follows from them.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) angles_rad: JointVector,
    pub(super) position_m: Vector3<f64>,
    pub(super) attitude: UnitQuaternion<f64>,
    pub(super) turned: Matrix3<f64>,
    pub(super) posture: Posture,
    pub(super) links: [LinkPose<f64>; MAX_JOINTS],
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

    /// A point of the base frame in that of the object.
    pub(super) fn to_object(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.turned.tr_mul(&(point_m - self.position_m))
    }

    /// A part of the hand that is closer than a distance, and the object where it is closest.
    pub(super) fn onto_object(&self, pair: Pair, within_m: f64, closest: &Closest) -> Touch {
        let point_m = self.position_m + self.turned * closest.point_m;
        Touch::new(pair, within_m - closest.distance_m, point_m, -(self.turned * closest.normal))
    }

    /// A fingertip and the object, however far they are from each other.
    pub(super) fn fingertip_touch(&self, model: &PlantModel, surface: &Touchable, finger: usize) -> Touch {
        let closest = surface.closest(&self.to_object(&self.posture.centres_m[finger]));
        let pair = Pair::FingertipObject { finger, feature: 0 };
        self.onto_object(pair, model.fingertips[finger].radius_m, &closest)
    }

    /// Gives the contacts of a ball of the hand with the object, at all places where it touches.
    pub(super) fn ball_on_object(
        &self,
        pair: impl Fn(usize) -> Pair,
        within_m: f64,
        places: &[Critical],
        (material, friction): (&Material, &Friction),
        mut see: impl FnMut(&Touch),
    ) {
        for critical in places {
            let share = if places.len() == 1 { 1.0 } else { share(critical, places, within_m, material) };
            let (sliding, torsion_m) = (share * friction.sliding, share * friction.torsion_m);
            see(&Touch {
                friction: Friction { sliding, torsion_m },
                material: material.times(f64::from(critical.index.abs())),
                is_negative: critical.index < 0,
                ..self.onto_object(pair(critical.feature), within_m, &critical.place)
            });
        }
    }

    /// Gives every pair of bodies closer than a distance, with the tables at a time; of parts of the hand those that `links` had
    /// near.
    pub(super) fn touches(
        &self,
        (model, world): (&PlantModel, &World),
        surfaces: &mut Surfaces,
        t_s: f64,
        within_m: f64,
        mut see: impl FnMut(&Touch),
    ) {
        let hand = &model.hand;
        let Surfaces { object, radius_m: object_radius_m, materials, places, links } = surfaces;
        for (finger, material) in materials.fingertips.iter().enumerate() {
            let radius_m = model.fingertips[finger].radius_m;
            let touches_m = radius_m + within_m.min(links.within_m);
            object.touches(&self.to_object(&self.posture.centres_m[finger]), touches_m, places);
            let pair = |feature: usize| Pair::FingertipObject { finger, feature };
            let friction = &world.fingertip_friction[finger];
            self.ball_on_object(pair, radius_m, places, (material, friction), &mut see);
        }
        links.see(self, (model, world), (object, places), (t_s, within_m), &mut see);
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
            if table.normal.dot(&(self.position_m - origin_m)) - *object_radius_m > within_m {
                continue;
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
    pub(super) fn set_rows(
        &self,
        (model, world): (&PlantModel, &World),
        branches: &Branches,
        touch: &Touch,
        rows: &mut Rows,
    ) {
        let hand = &model.hand;
        let [linear, angular] = touch.along();
        let sides = touch.pair.sides(hand, &world.capsules);
        // Velocity of the second body against the first one.
        let moves = |k: usize| {
            let is_moved = |side: Side| matches!(side, Side::Link(link) if is_below(hand, link, k));
            f64::from(u8::from(is_moved(sides[0]))) - f64::from(u8::from(is_moved(sides[1])))
        };
        let joint = |k: usize| {
            if let Pair::JointLimit { joint, is_upper } = touch.pair {
                let sign = if is_upper { -1.0 } else { 1.0 };
                return [if joint == k { sign } else { 0.0 }, 0.0, 0.0, 0.0];
            }
            let sign = moves(k);
            if sign == 0.0 {
                return [0.0; 4];
            }
            let axis = self.links[k].axis() * sign;
            let velocity = (touch.point_m - self.links[k].origin_m).cross(&axis);
            std::array::from_fn(|r| linear[r].dot(&velocity) - angular[r].dot(&axis))
        };
        let lever_m = touch.point_m - self.position_m;
        let mut object = [[0.0; 4]; OBJECT];
        let sign = sides.map(|side| f64::from(u8::from(side == Side::Object)));
        let second = sign[1] - sign[0];
        for r in 0..4 {
            let turning = lever_m.cross(&linear[r]) + angular[r];
            for k in 0..3 {
                object[k][r] = second * linear[r][k];
                object[3 + k][r] = second * turning[k];
            }
        }
        let fingers = match touch.pair {
            Pair::JointLimit { joint, .. } => [branches.finger(joint), None],
            _ => sides.map(|side| match side {
                Side::Link(link) => branches.finger(link),
                Side::Object | Side::World => None,
            }),
        };
        rows.set(branches, fingers, joint, &object);
    }
}

/// Returns `true` if a link moves with a joint.
fn is_below(hand: &Hand, link: usize, joint: usize) -> bool {
    let mut at = Some(link);
    while let Some(k) = at.filter(|&k| k > joint) {
        at = hand.parent(k);
    }
    at == Some(joint)
}

/// The share of its force for which a place where a ball touches has friction. A concave edge takes friction from all, the
/// more the nearer they are: as one of them comes to the edge to cancel with it, nothing is left of that one's, and all of the
/// others'.
fn share(critical: &Critical, places: &[Critical], within_m: f64, material: &Material) -> f64 {
    let force_n = |of: &Critical| material.elastic_force_n(within_m - of.place.distance_m);
    let own_n = force_n(critical);
    if critical.index < 0 || !(own_n > 0.0) {
        return f64::from(u8::from(critical.index > 0));
    }
    let taken_n = |negative: &Critical| {
        let near = |of: &Critical| {
            1.0 / ((of.place.point_m - negative.place.point_m).norm_squared() + f64::MIN_POSITIVE)
        };
        let all: f64 = places.iter().filter(|place| place.index > 0).map(near).sum();
        f64::from(-negative.index) * force_n(negative) * (near(critical) / all).min(1.0)
    };
    let taken_n: f64 = places.iter().filter(|place| place.index < 0).map(taken_n).sum();
    let share = 1.0 - taken_n / own_n;
    // Friction that the solver can't tell from none is none.
    if share > LEAST_SHARE { share } else { 0.0 }
}
