//! The hand as shapes: rods for the links, spheres for joints and fingertips, a plate for the palm.

use super::mesh::{Mesh, ROUND, WIDE};
use super::palette::{self, Rgb};
use crate::{Hand, MAX_JOINTS, Posture};
use nalgebra::Vector3;

const LINK: Rgb = [208, 212, 218];
const JOINT: Rgb = [112, 119, 130];
const PALM: Rgb = [176, 182, 190];

/// Thickness of what has none in the model, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sizes {
    pub(super) link_radius_m: f64,
    pub(super) joint_radius_m: f64,
    pub(super) trunk_radius_m: f64,
}

impl Sizes {
    /// In proportion to the fingertips and to the length of the links.
    pub(super) fn of(hand: &Hand) -> Self {
        let tips = hand.fingertip_count().max(1) as f64;
        let tip_radius = (0..hand.fingertip_count()).map(|i| hand.radius_m(i)).sum::<f64>() / tips;
        let mut lengths: Vec<f64> = (0..hand.joint_count())
            .filter(|&k| hand.parent(k).is_some())
            .map(|k| hand.offset_m(k).norm())
            .filter(|length| *length > 0.0)
            .collect();
        lengths.sort_by(f64::total_cmp);
        let typical = lengths.get(lengths.len() / 2).copied().unwrap_or(f64::INFINITY);
        let link_radius_m = (0.6 * tip_radius).min(0.16 * typical);
        Self { link_radius_m, joint_radius_m: 1.3 * link_radius_m, trunk_radius_m: 1.7 * link_radius_m }
    }
}

/// Places the hand for these joint angles; joints that are not given stand at zero.
pub(super) fn posture(hand: &Hand, angles_rad: &[f64]) -> Posture {
    let mut all = [0.0; MAX_JOINTS];
    for (slot, angle) in all.iter_mut().zip(angles_rad) {
        *slot = *angle;
    }
    let mut posture = Posture::at_base();
    hand.forward_kinematics(&all, &mut posture);
    posture
}

/// Adds the hand to a mesh.
pub(super) fn add(mesh: &mut Mesh, hand: &Hand, posture: &Posture, sizes: &Sizes) {
    let origin = |k: usize| posture.links[k].origin_m;
    let parents: Vec<Option<usize>> =
        std::iter::once(None).chain((0..hand.joint_count()).map(Some)).collect();
    for parent in parents {
        let children: Vec<usize> = (0..hand.joint_count()).filter(|&k| hand.parent(k) == parent).collect();
        let foot = parent.map_or(Vector3::zeros(), origin);
        match children.as_slice() {
            [] => {}
            [only] => {
                if parent.is_none() {
                    pedestal(mesh, origin(*only), sizes);
                }
                link(mesh, hand, *only, [foot, origin(*only)], sizes);
            }
            several => {
                let bases: Vec<Vector3<f64>> = several.iter().map(|&k| origin(k)).collect();
                let palm = Palm::new(&bases, &middle(&posture.centres_m[..hand.fingertip_count()]));
                palm.add(mesh, sizes);
                if parent.is_some() {
                    mesh.cone([foot, palm.centre_m], [sizes.trunk_radius_m; 2], ROUND, LINK);
                }
            }
        }
    }
    for joint in 0..hand.joint_count() {
        let radius =
            if owner(hand, joint).is_some() { sizes.joint_radius_m } else { 1.2 * sizes.trunk_radius_m };
        mesh.sphere(origin(joint), radius, ROUND, JOINT);
    }
    for finger in 0..hand.fingertip_count() {
        let (centre, radius) = (posture.centres_m[finger], hand.radius_m(finger));
        let colour = palette::mix(palette::of(finger), LINK, 0.26);
        mesh.cone([origin(hand.fingertip_link(finger)), centre], [sizes.link_radius_m; 2], ROUND, colour);
        mesh.sphere(centre, radius, ROUND, palette::mix(palette::of(finger), palette::WHITE, 0.85));
    }
}

/// The only finger that a joint moves; `None` for a joint of the trunk.
fn owner(hand: &Hand, joint: usize) -> Option<usize> {
    let mut moved = (0..hand.fingertip_count()).filter(|&i| hand.moves(joint, i));
    moved.next().filter(|_| moved.next().is_none())
}

/// The rod that carries `joint`: a finger's in its colour, the trunk's grey and thicker.
fn link(mesh: &mut Mesh, hand: &Hand, joint: usize, ends: [Vector3<f64>; 2], sizes: &Sizes) {
    match owner(hand, joint) {
        Some(finger) => {
            mesh.cone(ends, [sizes.link_radius_m; 2], ROUND, palette::mix(palette::of(finger), LINK, 0.26));
        }
        None => mesh.cone(ends, [sizes.trunk_radius_m; 2], ROUND, LINK),
    }
}

/// What an arm stands on.
fn pedestal(mesh: &mut Mesh, top: Vector3<f64>, sizes: &Sizes) {
    let radius = 3.0 * sizes.trunk_radius_m;
    mesh.cone([top - Vector3::z() * 0.4 * radius, top], [radius, 0.8 * radius], WIDE, PALM);
}

/// Mean of some points; the origin if there is none.
pub(super) fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64
}

/// The plate that fingers start from.
pub(super) struct Palm {
    pub(super) centre_m: Vector3<f64>,
    radius_m: f64,
    /// Unit vector out of its face, towards the fingertips.
    normal: Vector3<f64>,
}

impl Palm {
    fn new(bases: &[Vector3<f64>], towards: &Vector3<f64>) -> Self {
        let centre_m = middle(bases);
        let spokes: Vec<Vector3<f64>> = bases.iter().map(|base| base - centre_m).collect();
        let longest = |best: Vector3<f64>, v: Vector3<f64>| if v.norm() > best.norm() { v } else { best };
        let widest = spokes.iter().copied().fold(Vector3::zeros(), longest);
        let out = towards - centre_m;
        // Two fingers span no plane: then the plate faces the fingertips as well as it can.
        let plane = spokes.iter().map(|spoke| widest.cross(spoke)).fold(Vector3::zeros(), longest);
        let radius_m = widest.norm();
        let normal = if plane.norm() > 1e-3 * radius_m * radius_m && radius_m > 0.0 {
            plane * plane.dot(&out).signum()
        } else if radius_m > 0.0 {
            out - widest * (out.dot(&widest) / (radius_m * radius_m))
        } else {
            out
        };
        let normal = normal.try_normalize(0.0).unwrap_or(Vector3::z());
        Self { centre_m, radius_m, normal }
    }

    fn add(&self, mesh: &mut Mesh, sizes: &Sizes) {
        let radius = self.radius_m + 2.2 * sizes.link_radius_m;
        let face = self.centre_m - self.normal * 0.3 * sizes.link_radius_m;
        let rim = 0.12 * sizes.link_radius_m.max(radius * 0.3);
        let thickness = 0.14 * radius + sizes.link_radius_m;
        // A chamfer catches the light.
        mesh.cone([face - self.normal * rim, face], [radius, radius - rim], WIDE, PALM);
        mesh.cone([face - self.normal * thickness, face - self.normal * rim], [radius; 2], WIDE, PALM);
    }
}

/// The plate that carries most fingers: where the grasp is seen from. The origin if no plate does.
pub(super) fn palm_centre(hand: &Hand, posture: &Posture) -> Vector3<f64> {
    let joints = |parent| (0..hand.joint_count()).filter(move |&k| hand.parent(k) == parent);
    std::iter::once(None)
        .chain((0..hand.joint_count()).map(Some))
        .map(|parent| joints(parent).map(|k| posture.links[k].origin_m).collect::<Vec<_>>())
        .filter(|bases| bases.len() > 1)
        .max_by_key(Vec::len)
        .map_or(Vector3::zeros(), |bases| middle(&bases))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_palm_faces_the_fingertips() {
        let bases = [Vector3::x(), -Vector3::x(), Vector3::y()];
        let palm = Palm::new(&bases, &Vector3::new(0.2, 0.1, -3.0));
        assert!((palm.normal + Vector3::z()).norm() < 1e-12);
        let pair = Palm::new(&bases[..2], &Vector3::new(0.5, 0.0, 2.0));
        assert!((pair.normal - Vector3::z()).norm() < 1e-12, "square to the line between two fingers");
        assert_eq!(Palm::new(&[Vector3::zeros(); 3], &Vector3::zeros()).normal, Vector3::z());
    }
}
