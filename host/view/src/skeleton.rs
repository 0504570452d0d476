//! The hand as shapes: links and palm as their capsules, or rods for links, spheres for joints and a plate for the palm where there are
//! none; spheres for fingertips.

use super::mesh::{Mesh, ROUND, WIDE};
use super::palette::{self, Rgb};
use super::palm::Palm;
use blindgrasp_body::{Capsule, Hand, Part, Posture};
use nalgebra::Vector3;

pub(super) const LINK: Rgb = [208, 212, 218];
pub(super) const JOINT: Rgb = [112, 119, 130];
pub(super) const PALM: Rgb = [176, 182, 190];

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

/// The links that are drawn as their capsules.
pub(super) struct Covered<'a>(pub(super) &'a [Capsule]);

impl Covered<'_> {
    /// Returns `true` for a link with capsules; `None` is the base.
    pub(super) fn link(&self, link: Option<usize>) -> bool {
        self.0.iter().any(|capsule| capsule.link == link)
    }

    /// Returns `true` for a joint between links of which one has capsules.
    pub(super) fn joint(&self, hand: &Hand, joint: usize) -> bool {
        self.link(Some(joint)) || self.link(hand.parent(joint))
    }

    /// Returns the colour of a link: a finger's own, `share` of it; grey for trunk and palm.
    pub(super) fn colour(hand: &Hand, link: Option<usize>, share: f64) -> Rgb {
        match link {
            None => PALM,
            Some(joint) => {
                owner(hand, joint).map_or(LINK, |finger| palette::mix(palette::of(finger), LINK, share))
            }
        }
    }
}

/// Adds the hand to a mesh.
pub(super) fn add(
    mesh: &mut Mesh,
    hand: &Hand,
    capsules: &[Capsule],
    posture: &Posture,
    sizes: &Sizes,
    palms: &[Palm],
) {
    let (origin, covered) = (|k: usize| posture.link(k).origin_m, Covered(capsules));
    for (k, capsule) in capsules.iter().enumerate() {
        let ends = Part::Capsule(k).ends_m(posture, capsules);
        let colour = Covered::colour(hand, capsule.link, 0.26);
        mesh.cone(ends, [capsule.radius_m; 2], ROUND, colour);
        ends.iter().for_each(|end| mesh.sphere(*end, capsule.radius_m, ROUND, colour));
    }
    for joint in 0..hand.joint_count() {
        let parent = hand.parent(joint);
        // Links that start from a plate lie in it.
        if covered.link(parent) || palms.iter().any(|palm| palm.link == parent) {
            continue;
        }
        let foot = parent.map_or(Vector3::zeros(), origin);
        if parent.is_none() {
            pedestal(mesh, origin(joint), sizes);
        }
        link(mesh, hand, joint, [foot, origin(joint)], sizes);
    }
    for palm in palms.iter().filter(|palm| !covered.link(palm.link)) {
        let (centre, normal) = palm.placed(posture);
        plate(mesh, centre, normal, palm.radius_m, sizes);
        if let Some(link) = palm.link {
            let inside = centre - normal * sizes.link_radius_m;
            mesh.cone([origin(link), inside], [sizes.trunk_radius_m; 2], ROUND, LINK);
        }
    }
    for joint in (0..hand.joint_count()).filter(|&joint| !covered.joint(hand, joint)) {
        let radius =
            if owner(hand, joint).is_some() { sizes.joint_radius_m } else { 1.2 * sizes.trunk_radius_m };
        mesh.sphere(origin(joint), radius, ROUND, JOINT);
    }
    for finger in 0..hand.fingertip_count() {
        let (centre, radius, link) =
            (posture.centres_m[finger], hand.radius_m(finger), hand.fingertip_link(finger));
        if !covered.link(Some(link)) {
            let colour = palette::mix(palette::of(finger), LINK, 0.26);
            mesh.cone([origin(link), centre], [sizes.link_radius_m; 2], ROUND, colour);
        }
        mesh.sphere(centre, radius, ROUND, palette::mix(palette::of(finger), palette::WHITE, 0.85));
    }
}

/// The only finger that a joint moves; `None` for a joint of the trunk.
pub(super) fn owner(hand: &Hand, joint: usize) -> Option<usize> {
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

/// Draws the pedestal of an arm.
fn pedestal(mesh: &mut Mesh, top: Vector3<f64>, sizes: &Sizes) {
    let radius = 3.0 * sizes.trunk_radius_m;
    mesh.cone([top - Vector3::z() * 0.4 * radius, top], [radius, 0.8 * radius], WIDE, PALM);
}

/// A disc that fingers start from; `normal` points out of its face.
fn plate(mesh: &mut Mesh, centre: Vector3<f64>, normal: Vector3<f64>, spokes_m: f64, sizes: &Sizes) {
    let radius = spokes_m + 2.2 * sizes.link_radius_m;
    let face = centre - normal * 0.3 * sizes.link_radius_m;
    let rim = 0.12 * sizes.link_radius_m.max(radius * 0.3);
    let thickness = 0.14 * radius + sizes.link_radius_m;
    // A chamfer catches the light.
    mesh.cone([face - normal * rim, face], [radius, radius - rim], WIDE, PALM);
    mesh.cone([face - normal * thickness, face - normal * rim], [radius; 2], WIDE, PALM);
}
