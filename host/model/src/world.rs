//! The checks of a scene's world: contact, friction, tables, gravity that turns.

use super::check::{Result, all_within, fail, item, within};
use super::file::{PlantSettings, SceneFile, TableFile};
use super::{Parts, Scene, Start, crossing, hand::posture};
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{CORNER_STIFFNESS_N_M, ContactFriction};
use nalgebra::Vector3;

/// Coefficient of friction where no file gives one: that of rubber on a smooth box.
const FRICTION: f64 = 0.6;
/// Torsional friction where no file gives one, m: `3 pi / 16` (that of a round contact with the pressure of Hertz) of a friction
/// of 0.6 and a contact that is 5.7 mm in radius, as a fingertip of 15 mm has it 1.1 mm deep.
const TORSIONAL_FRICTION_M: f64 = 2e-3;
/// Largest coefficient of friction.
const MOST_FRICTION: f64 = 100.0;
/// Depth to which the object may lie in a table at the start, m: more than its weight alone presses it in.
const SUNK_M: f64 = 1e-4;
/// Corners that an object may lie on.
const CORNERS: f64 = 4.0;
/// Depth from which on an object that sinks into a table is told, m.
const SINKS_M: f64 = 1e-3;
/// The most of a table's own length unit that its normal may be off by.
const OFF_UNIT: f64 = 1e-3;

/// Checks the numbers of the world.
pub(super) fn settings(plant: &PlantSettings, longest_s: f64) -> Result<()> {
    if !plant.has_friction() {
        return paper_only(plant);
    }
    within("plant.friction", plant.friction.unwrap_or_default(), 0.0, MOST_FRICTION)?;
    within("plant.torsional_friction_m", plant.torsional_friction_m.unwrap_or_default(), 0.0, 1.0)?;
    for (t, table) in plant.tables.iter().enumerate() {
        let key = |key: &str| item("plant.table", t, key);
        all_within(&key("point_m"), &table.point_m, 100.0)?;
        let length = Vector3::from(table.normal).norm();
        if !((length - 1.0).abs() < OFF_UNIT) {
            return fail(key("normal"), format!("has length {length}"), "divide it by its length");
        }
        within(&key("friction"), table.friction, 0.0, MOST_FRICTION)?;
        within(&key("fingertip_friction"), table.fingertip_friction, 0.0, MOST_FRICTION)?;
        for (m, way) in table.moves.iter().enumerate() {
            let key = |of: &str| item(&key("move"), m, of);
            within(&key("from_s"), way.from_s, 0.0, longest_s)?;
            all_within(&key("by_m"), &way.by_m, 100.0)?;
            if !(way.for_s > 0.0) {
                let remedy = "give it a length in seconds: a table can't be in two places at once";
                return fail(key("for_s"), format!("jumps: {:?} s is no time", way.for_s), remedy);
            }
            within(&key("for_s"), way.for_s, 1e-2, longest_s)?;
        }
    }
    if !plant.tables.is_empty() && !plant.object_has_weight() {
        let problem = "an object with a mass but no weight does not lie on a table";
        return fail("plant.gravity_on_object", problem, "leave it out, or set it to true");
    }
    let mut over_s = 0.0;
    for (k, turn) in plant.turns.iter().enumerate() {
        let key = |key: &str| item("plant.turn", k, key);
        within(&key("from_s"), turn.from_s, over_s, longest_s).map_err(|error| super::SceneError {
            remedy: error.remedy + ": turns follow each other",
            ..error
        })?;
        within(&key("for_s"), turn.for_s, 1e-2, longest_s)?;
        all_within(&key("gravity_m_s2"), &turn.gravity_m_s2, 1000.0)?;
        over_s = turn.from_s + turn.for_s;
    }
    for (k, shake) in plant.shakes.iter().enumerate() {
        let key = |key: &str| item("plant.shake", k, key);
        within(&key("from_s"), shake.from_s, 0.0, longest_s)?;
        within(&key("for_s"), shake.for_s, 1e-6, longest_s)?;
        all_within(&key("amplitude_m_s2"), &shake.amplitude_m_s2, 1000.0)?;
        within(&key("frequency_hz"), shake.frequency_hz, 1e-3, 1e3)?;
    }
    Ok(())
}

/// Refuses what contact that rolls does not know.
fn paper_only(plant: &PlantSettings) -> Result<()> {
    let given = [
        ("plant.friction", plant.friction.is_some()),
        ("plant.torsional_friction_m", plant.torsional_friction_m.is_some()),
        ("plant.links", plant.links == Some(true)),
        ("plant.table", !plant.tables.is_empty()),
        ("plant.turn", !plant.turns.is_empty()),
        ("plant.shake", !plant.shakes.is_empty()),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        None => Ok(()),
        Some((key, _)) => fail(
            key,
            "does nothing where fingertips roll: contact that rolls has neither friction nor links nor tables",
            "set plant.contact = \"coulomb\", or leave it out",
        ),
    }
}

/// The friction of each fingertip against the object.
pub(super) fn frictions(file: &SceneFile) -> Vec<ContactFriction> {
    let plant = &file.plant;
    let of = |fingertip: &super::file::FingertipFile| {
        let torsion_m = plant.torsional_friction_m.or(fingertip.torsional_friction_m);
        ContactFriction {
            sliding: sliding(file, fingertip.friction),
            torsion_m: torsion_m.unwrap_or(TORSIONAL_FRICTION_M),
        }
    };
    file.hand.fingertips.iter().map(of).collect()
}

/// The friction of each capsule against the object; nothing where links don't touch.
pub(super) fn capsule_frictions(file: &SceneFile) -> Vec<f64> {
    let capsules = file.hand.capsules.iter().filter(|_| file.plant.links_touch());
    capsules.map(|capsule| sliding(file, capsule.friction)).collect()
}

/// The coefficient of friction between the object and a part of the hand, which may have one in its file.
fn sliding(file: &SceneFile, of_part: Option<f64>) -> f64 {
    let least = [of_part, file.object.friction].into_iter().flatten().reduce(f64::min);
    file.plant.friction.or(least).unwrap_or(FRICTION)
}

/// Checks that nothing is inside anything else at the start, where contacts have friction.
pub(super) fn at_start(file: &SceneFile, parts: &Parts, start: &Start) -> Result<()> {
    let shape = &parts.object.shape;
    if !file.plant.has_friction() {
        return Ok(());
    }
    let posture = &posture(&parts.hand, &start.angles_rad);
    let capsules = if file.plant.links_touch() { &parts.capsules[..] } else { &[] };
    let touches = !file.contacts.is_empty();
    let posed = crossing::Posed { file: &file.hand, hand: &parts.hand, capsules, posture, touches };
    posed.are_above(&file.plant.tables)?;
    for (t, table) in file.plant.tables.iter().enumerate() {
        let lowest_m = lowest_m(table, shape, start);
        if lowest_m < -SUNK_M {
            let problem = format!("the object is {:.3} mm inside the table", -lowest_m * 1e3);
            return fail(item("plant.table", t, "point_m"), problem, "move the table or the object's pose");
        }
    }
    posed.are_apart()?;
    posed.are_outside(shape, start)
}

/// Height of the object's lowest corner above a table at the start, m.
fn lowest_m(table: &TableFile, shape: &Polyhedron, start: &Start) -> f64 {
    let corners = shape.vertices_m.iter().map(|corner_m| start.position_m + start.attitude * corner_m);
    corners.map(|corner_m| crossing::height_m(table, &corner_m)).fold(f64::INFINITY, f64::min)
}

/// Tells an object that neither a hand nor a table holds at the start.
pub(super) fn falling(file: &SceneFile, shape: &Polyhedron, start: &Start, warnings: &mut Vec<String>) {
    let lies = |table: &TableFile| lowest_m(table, shape, start) < SUNK_M;
    if file.contacts.is_empty() && file.plant.object_has_weight() && !file.plant.tables.iter().any(lies) {
        warnings.push("pose.position_m: the object lies on no table, and the hand is open: it falls".into());
    }
}

/// Tells an object that is too heavy for the softness of tables.
pub(super) fn sinking(plant: &PlantSettings, mass_kg: f64, warnings: &mut Vec<String>) {
    let weight_n = mass_kg * Vector3::from(plant.gravity_m_s2).norm();
    let sunk_m = weight_n / (CORNERS * CORNER_STIFFNESS_N_M);
    if !plant.tables.is_empty() && sunk_m > SINKS_M {
        warnings.push(format!(
            "plant.table: the object of {mass_kg} kg sinks in by {:.1} mm or more: a table gives way under each corner by 1 mm for 60 N",
            sunk_m * 1e3
        ));
    }
}

impl Scene {
    /// Inertia of each joint's rotor as the joint feels it, kg m^2; nothing where rotors don't act.
    pub fn rotors_kg_m2(&self) -> Vec<f64> {
        let joints = self.file.hand.joints.iter().filter(|_| self.plant.rotors_turn());
        joints.map(|joint| joint.rotor_inertia_kg_m2).collect()
    }
}
