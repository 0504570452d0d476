//! The plant of a scene, and the world around it.

use super::SimulationError;
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_model::Scene;
use blindgrasp_model::file::{MoveFile, PlantSettings, PushFile, TableFile};
use blindgrasp_plant::coulomb::{Friction, Path, Table, World};
use blindgrasp_plant::{Motion, ObjectModel, Plant, PlantModel};
use blindgrasp_shared::math::Real;
use nalgebra::{Rotation3, Unit, Vector3};
use std::f64::consts::{PI, TAU};

/// The plant of a scene, as everything is at the start.
///
/// # Errors
/// A model or a world that can't be simulated.
pub fn plant(scene: &Scene) -> Result<Plant, SimulationError> {
    let mut angles_rad = [0.0; MAX_JOINTS];
    angles_rad[..scene.start.angles_rad.len()].copy_from_slice(&scene.start.angles_rad);
    let start = Motion::at_rest(angles_rad, scene.start.position_m, scene.start.attitude);
    Ok(Plant::new(model(scene), world(scene), start, scene.substep_s)?)
}

/// The model of a scene.
pub fn model(scene: &Scene) -> PlantModel {
    let gravity = Vector3::from(scene.plant.gravity_m_s2);
    PlantModel {
        hand: scene.hand.clone(),
        fingertips: scene.fingertips.clone(),
        friction: scene.joints.iter().map(|joint| joint.friction).collect(),
        rotor_inertia_kg_m2: scene.rotors_kg_m2(),
        joint_limits: scene.plant.joints_stop(),
        object: ObjectModel {
            shape: scene.object.clone(),
            mass_kg: scene.mass_kg,
            inertia_kg_m2: scene.inertia_kg_m2,
        },
        faces: scene.contacts.clone(),
        hand_gravity_m_s2: gravity,
        object_gravity_m_s2: if scene.plant.object_has_weight() { gravity } else { Vector3::zeros() },
        pushes: scene.plant.pushes.iter().map(PushFile::push).collect(),
    }
}

/// The world of contact with friction; `None` where contact rolls.
pub fn world(scene: &Scene) -> Option<World> {
    let plant = &scene.plant;
    let turns = !(plant.turns.is_empty() && plant.shakes.is_empty());
    plant.has_friction().then(|| World {
        fingertip_friction: scene.fingertip_friction.clone(),
        capsules: scene.capsules.clone(),
        capsule_friction: scene.capsule_friction.clone(),
        hand_touches_itself: plant.links_touch(),
        tables: plant.tables.iter().map(|file| table(file, scene)).collect(),
        gravity_m_s2: turns.then(|| {
            let plant = plant.clone();
            Path::new(move |t_s| gravity_m_s2(&plant, t_s) - shaking_m_s2(&plant, t_s))
        }),
    })
}

fn table(file: &TableFile, scene: &Scene) -> Table {
    let (point_m, moves) = (Vector3::from(file.point_m), file.moves.clone());
    let torsion_m = scene.fingertip_friction.iter().map(|friction| friction.torsion_m);
    Table {
        point_m: Path::new(move |t_s| moves.iter().fold(point_m, |point_m, way| point_m + moved_m(way, t_s))),
        normal: Vector3::from(file.normal).normalize(),
        object_friction: file.friction,
        fingertip_friction: Friction {
            sliding: file.fingertip_friction,
            torsion_m: torsion_m.fold(0.0, f64::max),
        },
    }
}

/// The part of a way that is done by a time, m.
fn moved_m(way: &MoveFile, t_s: f64) -> Vector3<f64> {
    Vector3::from(way.by_m) * done((t_s - way.from_s) / way.for_s)
}

/// From 0 to 1 with speed and acceleration zero at both ends.
fn done(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

/// Gravity at a time as the controller is told of it, m/s^2; `None` as long as it is not.
pub(crate) fn told_gravity_m_s2(plant: &PlantSettings, t_s: f64) -> Option<Vector3<f64>> {
    let begun = plant.turns.iter().rfind(|turn| turn.from_s <= t_s)?;
    begun.told.then(|| gravity_m_s2(plant, t_s))
}

/// Gravity at a time without shaking, m/s^2.
fn gravity_m_s2(plant: &PlantSettings, t_s: f64) -> Vector3<f64> {
    plant.turns.iter().fold(Vector3::from(plant.gravity_m_s2), |before, turn| {
        turned(&before, &Vector3::from(turn.gravity_m_s2), done((t_s - turn.from_s) / turn.for_s))
    })
}

/// A vector on its way to another one: its direction turns about one axis, its length changes in proportion.
fn turned(from: &Vector3<f64>, to: &Vector3<f64>, share: f64) -> Vector3<f64> {
    let Some((direction, length)) = Unit::try_new_and_get(*from, 0.0) else { return to * share };
    let Some((end, end_length)) = Unit::try_new_and_get(*to, 0.0) else { return from * (1.0 - share) };
    let around = Rotation3::rotation_between(&direction, &end).unwrap_or_else(|| {
        // Straight back: about any axis across.
        let near = if direction.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        Rotation3::from_axis_angle(&Unit::new_normalize(direction.cross(&near)), PI)
    });
    around.powf(share) * direction.into_inner() * (length + share * (end_length - length))
}

/// Acceleration of the hand's base by shaking at a time, m/s^2.
fn shaking_m_s2(plant: &PlantSettings, t_s: f64) -> Vector3<f64> {
    let acting = plant.shakes.iter().filter(|shake| (0.0..shake.for_s).contains(&(t_s - shake.from_s)));
    acting.fold(Vector3::zeros(), |sum, shake| {
        let sine = (TAU * shake.frequency_hz * (t_s - shake.from_s)).sine_cosine().0;
        sum + Vector3::from(shake.amplitude_m_s2) * sine
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gravity keeps its length, ends where it should, and neither it nor a table jumps.
    #[test]
    fn what_moves_begins_and_ends_where_it_should() {
        let (down, up) = (Vector3::new(0.0, 0.0, -9.81), Vector3::new(0.0, 0.0, 9.81));
        for end in [up, Vector3::new(9.81, 0.0, 0.0), down, Vector3::new(0.0, 5.0, -1.0)] {
            assert!((turned(&down, &end, 0.0) - down).norm() < 1e-12);
            assert!((turned(&down, &end, 1.0) - end).norm() < 1e-12, "{end}");
            let half = turned(&down, &end, 0.5);
            assert!((half.norm() - 0.5 * (9.81 + end.norm())).abs() < 1e-12);
            assert!((half.angle(&down) - half.angle(&end)).abs() < 1e-7);
        }
        let way = MoveFile { from_s: 1.0, for_s: 0.5, by_m: [0.0, 0.0, -0.1] };
        assert_eq!((moved_m(&way, 0.0).z, moved_m(&way, 1.25).z, moved_m(&way, 9.0).z), (0.0, -0.05, -0.1));
        let fastest = (0..1000).map(|k| f64::from(k) * 1e-3).map(|s| (done(s + 1e-3) - done(s)) * 1e3);
        assert!((fastest.fold(0.0, f64::max) - 1.875).abs() < 1e-3);
    }
}
