//! Masses and inertias that no link has.

use super::super::found::Found;
use super::super::specimen::Specimen;
use super::length;
use crate::breaks_triangle;
use crate::inspect::finding::Severity;
use blindgrasp_shared::math::Real;
use nalgebra::{SymmetricEigen, Vector3};
use std::f64::consts::PI;

/// All links weigh less than a ball of water that has the length of their finger for a radius; those of a finger of solid
/// steel, ten times as long as thick, a tenth of that. Written in grams, most weigh more.
const DENSEST_KG_M3: f64 = 1000.0;
/// Largest distance of a mass, as a multiple of that of everything on its link. A palm is wider than the joints on it
/// are apart.
const BEYOND: f64 = 2.0;
/// A link below this, kg and kg m^2, is one without mass: URDFs have such numbers because loaders refuse zeros.
const NOTHING: f64 = 1e-12;
/// A body of this share of its link's size is none.
const POINT: f64 = 0.01;

/// All of it.
pub(in super::super) fn links(specimen: &Specimen, found: &mut Found) {
    let sizes_known = found.trusts(&["offset_m", "radius_m"]);
    for k in 0..specimen.joints() {
        if found.trusts_joint(specimen, k, "mass_kg") && sizes_known {
            weight(specimen, k, found);
        }
        if found.trusts_joint(specimen, k, "mass_centre_m") && sizes_known {
            mass_centre(specimen, k, found);
        }
        if found.trusts_joint(specimen, k, "inertia_kg_m2") && found.trusts_joint(specimen, k, "mass_kg") {
            inertia(specimen, k, found);
        }
    }
}

/// Grams for kilograms.
fn weight(specimen: &Specimen, k: usize, found: &mut Found) {
    let mass = specimen.hand.link(k).mass_kg;
    let (size, of) = match specimen.finger_of(k) {
        Some(finger) => (specimen.finger_length_m(finger), "finger"),
        None => (specimen.span_m(), "hand"),
    };
    let ball = 4.0 / 3.0 * PI * size * size * size;
    if mass > DENSEST_KG_M3 * ball && size > 0.0 {
        let what = format!("its mass of {mass} kg is more than a {of} of {} can have", length(size));
        let remedy = format!("write kilograms: {mass} g are {} kg", mass / 1e3);
        found.push(specimen.on_joint(Severity::Warning, (k, "mass_kg"), what, remedy));
    }
}

/// The mass centre of a link is among what is on it.
fn mass_centre(specimen: &Specimen, k: usize, found: &mut Found) {
    let link = specimen.hand.link(k);
    let (distance, size) = (link.mass_centre_m.norm(), size_m(specimen, k, &Vector3::zeros()));
    if link.mass_kg > 0.0 && distance > BEYOND * size {
        let what =
            format!("its mass centre is {} from the joint, on a link of {}", length(distance), length(size));
        let remedy = "give mass_centre_m in metres, in the link frame";
        found.push(specimen.on_joint(Severity::Warning, (k, "mass_centre_m"), what, remedy));
    }
}

/// A link without mass and inertia is counted in another; one with either needs both, and those of a body.
fn inertia(specimen: &Specimen, k: usize, found: &mut Found) {
    let link = specimen.hand.link(k);
    let moments = SymmetricEigen::new(link.inertia_kg_m2).eigenvalues;
    let (least, most) = (moments.min(), moments.max());
    if link.mass_kg < NOTHING && most.abs() < NOTHING {
        return;
    }
    let mut tell = |severity, what: String, remedy: &str| {
        found.push(specimen.on_joint(severity, (k, "inertia_kg_m2"), what, remedy));
    };
    let about = "give inertia_kg_m2 about the mass centre, in the axes of the link frame";
    if !(most > 0.0) {
        if link.mass_kg > 0.0 {
            tell(Severity::Warning, format!("has a mass of {} kg and no inertia", link.mass_kg), about);
        }
        return;
    }
    if !(link.mass_kg > 0.0) {
        tell(Severity::Warning, "has an inertia and no mass".into(), "give mass_kg");
        return;
    }
    if least < -1e-9 * most {
        tell(Severity::Error, format!("its inertia has a negative moment, {least:.2e} kg m^2"), about);
        return;
    }
    if breaks_triangle(&link.inertia_kg_m2) {
        let what = format!(
            "its inertia is that of no body: of its principal moments {}, the largest is more than the sum of the others",
            listed(&moments)
        );
        tell(Severity::Error, what, about);
        return;
    }
    if least <= 1e-9 * most {
        let what = format!("its inertia is that of a body without thickness: {}", listed(&moments));
        tell(Severity::Warning, what, "give all three moments");
        return;
    }
    gyration(specimen, k, most, found);
}

/// The radius of gyration is the distance from the mass centre at which all the mass would have the same inertia: some of a
/// body is at least as far out.
fn gyration(specimen: &Specimen, k: usize, most: f64, found: &mut Found) {
    if !found.trusts(&["offset_m", "radius_m"]) || !found.trusts_joint(specimen, k, "mass_centre_m") {
        return;
    }
    let mass_kg = specimen.hand.link(k).mass_kg;
    // The roots first: the mass may be the smallest of all numbers.
    let radius = most.square_root() / mass_kg.square_root();
    let size = size_m(specimen, k, &specimen.file.joints[k].mass_centre_m.into());
    if !(size > 0.0) {
        return;
    }
    let key = (k, "inertia_kg_m2");
    if radius > BEYOND * size {
        // A unit with which it would fit.
        let units = [("g cm^2", 1e-7), ("kg mm^2", 1e-6), ("kg cm^2", 1e-4), ("g mm^2", 1e-9)];
        let fits = |factor: &f64| (0.05..=1.0).contains(&(radius * factor.square_root() / size));
        let unit = units.iter().find(|(_, factor)| fits(factor));
        let remedy = match unit {
            Some((unit, factor)) => format!("write kg m^2: 1 {unit} is {factor:e} kg m^2"),
            None => "write kg m^2, about the mass centre".to_owned(),
        };
        // Larger than the whole hand is no matter of what is on the link.
        let severity = if radius > specimen.span_m() { Severity::Error } else { Severity::Warning };
        let what = format!(
            "its inertia of {most:.2e} kg m^2 needs its {:?} kg {} from the mass centre, on a link of {}",
            mass_kg,
            length(radius),
            length(size)
        );
        found.push(specimen.on_joint(severity, key, what, remedy));
    } else if radius < POINT * size {
        let what = format!(
            "its inertia of {most:.2e} kg m^2 is that of a body of {}, on a link of {}",
            length(radius),
            length(size)
        );
        let remedy = "give inertia_kg_m2 in kg m^2, about the mass centre";
        found.push(specimen.on_joint(Severity::Warning, key, what, remedy));
    }
}

/// Returns the distance of everything on a link from a point of its frame, m: the joint, those that it carries, its
/// fingertips; a short link, one that carries a joint right beside its own, may be as large as the bones of the hand
/// are.
fn size_m(specimen: &Specimen, k: usize, point_m: &Vector3<f64>) -> f64 {
    let (hand, file) = (&specimen.hand, &specimen.file);
    let distance = |place: [f64; 3]| (Vector3::from(place) - point_m).norm();
    let carried = (0..specimen.joints()).filter(|&j| hand.parent(j) == Some(k));
    let carried = carried.map(|j| distance(file.joints[j].offset_m));
    let tips = (0..specimen.fingers()).filter(|&i| hand.fingertip_link(i) == k);
    let tips = tips.map(|i| distance(file.fingertips[i].offset_m) + hand.radius_m(i));
    carried.chain(tips).chain([point_m.norm()]).fold(specimen.typical_bone_m(), f64::max)
}

fn listed(moments: &Vector3<f64>) -> String {
    let mut sorted: Vec<f64> = moments.iter().copied().collect();
    sorted.sort_by(f64::total_cmp);
    sorted.iter().map(|moment| format!("{moment:.2e}")).collect::<Vec<_>>().join(", ")
}
