//! A placement that is tried: whether the fingers can take it exactly, without being in each other's way or in the object's.

use super::position::FACING;
use blindgrasp_body::inverse_kinematics::{Unreachable, own_joints, place};
use blindgrasp_body::polyhedron::{Polyhedron, Touchable};
use blindgrasp_body::{Capsule, Hand, Part, Posture, closest_of_lines, overlap_m};
use blindgrasp_model::posture;
use nalgebra::{UnitQuaternion, Vector3};

/// Room that fingertips and links need from what they must not be inside of, m: more than a scene asks for.
const CLEAR_M: f64 = 1e-6;

/// The places of hand and object.
#[derive(Clone, Debug)]
pub(super) struct Stance {
    /// Centre of mass of the object in the base frame, m.
    pub(super) position_m: Vector3<f64>,
    /// Attitude of the object.
    pub(super) attitude: UnitQuaternion<f64>,
    /// Face of each contact.
    pub(super) faces: Vec<usize>,
    /// Contact points in the object frame, m.
    pub(super) points_m: Vec<Vector3<f64>>,
    /// Centres of the fingertips in the object frame, m.
    pub(super) centres_m: Vec<Vector3<f64>>,
}

/// The reason for which fingers can't take a stance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Miss {
    /// A fingertip does not get there.
    Unreachable(Unreachable),
    /// A joint would stand at its end stop.
    AtStop(usize),
    /// Two fingertips overlap, by so many metres.
    Overlap(usize, usize, f64),
    /// A fingertip would touch with its back: the angle between its bone and the inward normal, as a cosine.
    Back(usize, f64),
    /// The bone that ends at a joint passes through the object.
    Through(usize),
    /// The last bone of a fingertip does.
    TipThrough(usize),
    /// A fingertip's sphere meets another part of the object, by so many metres.
    Beside(usize, f64),
    /// Two parts of the hand of which one is no fingertip are inside each other, by so many metres.
    Cross([Part; 2], f64),
    /// A link or the palm is inside the object, by so many metres.
    Inside(Part, f64),
}

/// The hand that takes a stance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taker<'a> {
    pub(super) hand: &'a Hand,
    /// Its links and palm.
    pub(super) capsules: &'a [Capsule],
    /// The parts that may not be inside each other, besides two fingertips.
    pub(super) pairs: &'a [[Part; 2]],
    pub(super) nominal_rad: &'a [f64],
    /// The object's surface.
    pub(super) object: &'a Touchable,
    /// Largest distance of a point of the object from its centre of mass, m.
    pub(super) object_radius_m: f64,
}

/// The pairs of parts that may touch and of which one is no fingertip.
pub(super) fn pairs(hand: &Hand, capsules: &[Capsule]) -> Vec<[Part; 2]> {
    let mut pairs = blindgrasp_body::pairs(hand, capsules);
    pairs.retain(|parts| parts.iter().any(|part| matches!(part, Part::Capsule(_))));
    pairs
}

/// The least distance of a joint that moves one fingertip from an end stop, rad.
pub(super) fn take(taker: &Taker<'_>, shape: &Polyhedron, stance: &Stance) -> Result<f64, Miss> {
    let &Taker { hand, nominal_rad, .. } = taker;
    for (i, centre) in stance.centres_m.iter().enumerate() {
        for (j, other) in stance.centres_m[..i].iter().enumerate() {
            let overlap = hand.radius_m(i) + hand.radius_m(j) - (centre - other).norm();
            if overlap > 0.0 {
                return Err(Miss::Overlap(j, i, overlap));
            }
        }
        // Of parts of the body that rise above the face; a convex body has none.
        let missing = hand.radius_m(i) - shape.clearance_m(stance.faces[i], centre);
        if missing > -CLEAR_M {
            return Err(Miss::Beside(i, missing));
        }
    }
    let targets: Vec<Vector3<f64>> =
        stance.centres_m.iter().map(|centre| stance.position_m + stance.attitude * centre).collect();
    let angles = place(hand, &targets, nominal_rad).map_err(Miss::Unreachable)?;
    let posture = posture(hand, &angles);
    for i in 0..targets.len() {
        let last = posture.link(hand.fingertip_link(i)).origin_m;
        let inward = stance.attitude * -shape.faces[stance.faces[i]].normal;
        if let Some(bone) = (posture.centres_m[i] - last).try_normalize(1e-9)
            && !(bone.dot(&inward) >= FACING)
        {
            return Err(Miss::Back(i, bone.dot(&inward)));
        }
    }
    through(hand, &posture, shape, stance)?;
    apart(taker, &posture)?;
    outside(taker, &posture, stance)?;
    let (room_rad, joint) = room(hand, &angles);
    if room_rad > 0.0 { Ok(room_rad) } else { Err(Miss::AtStop(joint)) }
}

/// Checks that no links are inside each other, a fingertip or the palm.
fn apart(taker: &Taker<'_>, posture: &Posture) -> Result<(), Miss> {
    taker.pairs.iter().try_for_each(|&parts| {
        let overlap = overlap_m(parts, taker.hand, posture, taker.capsules);
        if overlap > -CLEAR_M { Err(Miss::Cross(parts, overlap)) } else { Ok(()) }
    })
}

/// Checks that links and palm are outside the object.
fn outside(taker: &Taker<'_>, posture: &Posture, stance: &Stance) -> Result<(), Miss> {
    (0..taker.capsules.len()).try_for_each(|number| {
        let part = Part::Capsule(number);
        let ends_m = part
            .ends_m(posture, taker.capsules)
            .map(|end_m| stance.attitude.inverse() * (end_m - stance.position_m));
        let radius_m = taker.capsules[number].radius_m;
        let [share, _] = closest_of_lines([&ends_m, &[Vector3::zeros(); 2]]);
        let nearest_m = (ends_m[0] + (ends_m[1] - ends_m[0]) * share).norm();
        if nearest_m > taker.object_radius_m + radius_m + CLEAR_M {
            return Ok(());
        }
        let (_, nearest) = taker.object.closest_to_line(&ends_m);
        let depth = radius_m - nearest.distance_m;
        if depth > -CLEAR_M { Err(Miss::Inside(part, depth)) } else { Ok(()) }
    })
}

/// The least distance of a joint from an end stop, rad, and which it is; of joints that move one fingertip.
pub(super) fn room(hand: &Hand, angles_rad: &[f64]) -> (f64, usize) {
    let own = (0..hand.fingertip_count()).flat_map(|i| own_joints(hand, i));
    own.map(|k| {
        let ((lower, upper), angle) = (hand.range_rad(k), angles_rad[k]);
        (f64::min(angle - lower, upper - angle), k)
    })
    .min_by(|a, b| a.0.total_cmp(&b.0))
    .unwrap_or((f64::INFINITY, 0))
}

/// Checks that no bone passes through the object: the lines between the joints, from the base on.
fn through(hand: &Hand, posture: &Posture, shape: &Polyhedron, stance: &Stance) -> Result<(), Miss> {
    let to_object = |point: Vector3<f64>| stance.attitude.inverse() * (point - stance.position_m);
    for k in 0..hand.joint_count() {
        let from = hand.parent(k).map_or(Vector3::zeros(), |parent| posture.link(parent).origin_m);
        if pierces(shape, &to_object(from), &to_object(posture.link(k).origin_m)) {
            return Err(Miss::Through(k));
        }
    }
    for i in 0..hand.fingertip_count() {
        let from = posture.link(hand.fingertip_link(i)).origin_m;
        if pierces(shape, &to_object(from), &to_object(posture.centres_m[i])) {
            return Err(Miss::TipThrough(i));
        }
    }
    Ok(())
}

/// Returns `true` if the line between two points, in the object frame, passes through a face.
fn pierces(shape: &Polyhedron, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
    shape.faces.iter().enumerate().any(|(k, face)| {
        let (before, after) =
            (face.normal.dot(from) - face.distance_m, face.normal.dot(to) - face.distance_m);
        if (before > 0.0) == (after > 0.0) {
            return false;
        }
        shape.margin_m(k, &(from + (to - from) * (before / (before - after)))) > 0.0
    })
}
