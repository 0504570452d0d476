//! An object between fingers of one joint each, under constant torques.

use super::*;

const MASS_KG: f64 = 0.045;
const FRICTION: f64 = 0.7;
const ARM_M: f64 = 0.2;
/// Of a soft fingertip: two thirds of the radius of the contact, in its order of magnitude.
const TORSION_M: f64 = 2e-3;

/// The object, and outwards normals and distances of the faces that fingers touch.
fn held(fingers: usize) -> (Polyhedron, Vec<(Vector3<f64>, f64)>) {
    let shape = match fingers {
        3 => Polyhedron::regular_prism(3, 0.06, 0.04).unwrap(),
        _ => Polyhedron::cuboid([0.048; 3]).unwrap(),
    };
    let mut sides: Vec<_> = shape
        .faces
        .iter()
        .filter(|face| face.normal.z.abs() < 0.1 && (fingers > 2 || face.normal.x.abs() > 0.9))
        .map(|face| (face.normal, face.distance_m))
        .collect();
    sides.truncate(fingers);
    (shape, sides)
}

/// A grasp with so many times the friction that its weight needs, held off the middle; and the torques that hold it.
fn grasp(fingers: usize, margin: f64, off_m: Vector3<f64>, substep_s: f64) -> (Plant, Vec<f64>) {
    let (shape, sides) = held(fingers);
    let force_n = margin * MASS_KG * GRAVITY_M_S2 / (fingers as f64 * FRICTION);
    let pressed_m = (force_n / TIP.stiffness_n_m2).square_root();
    let arms: Vec<_> = sides
        .iter()
        .map(|(normal, distance_m)| {
            let tip_m = normal * (distance_m + TIP.radius_m - pressed_m) + off_m;
            arm(tip_m + Vector3::z().cross(normal) * ARM_M, tip_m)
        })
        .collect();
    let world = World {
        fingertip_friction: vec![Friction { sliding: FRICTION, torsion_m: TORSION_M }; fingers],
        ..World::default()
    };
    let model = model(hand(&arms), object(shape, MASS_KG));
    let plant = Plant::new(model, world, at(Vector3::zeros()), substep_s).unwrap();
    (plant, vec![-force_n * ARM_M; fingers])
}

/// Tolerance: 1e-3 um/s over a minute, as the issue asks for; in height, and anywhere.
#[test]
fn a_held_object_does_not_creep() {
    for fingers in [2, 3, 4] {
        for margin in [1.05, 95.0] {
            let (mut plant, torques_nm) = grasp(fingers, margin, Vector3::zeros(), 1e-3);
            plant.run(&torques_nm, 1.0, |_| {});
            let settled_m = plant.motion().position_m;
            plant.run(&torques_nm, 60.0, |_| {});
            let crept = (plant.motion().position_m - settled_m) / 60.0 * 1e6;
            println!(
                "{fingers} fingers, margin {margin}: {:.1e} um/s down, {:.1e} in all, {:?}",
                -crept.z,
                crept.norm(),
                plant.counters()
            );
            assert!(crept.norm() < 1e-3);
        }
    }
}

/// Held 4 mm beside the middle by two fingers, where only torsion keeps it from turning: not at all below its limit.
///
/// Tolerance: a microradian in ten seconds.
#[test]
fn torsion_holds_what_is_held_beside_the_middle() {
    for (margin, holds) in [(4.0, true), (1.5, false)] {
        let (mut plant, torques_nm) = grasp(2, margin, Vector3::new(0.0, 0.004, 0.0), 1e-3);
        plant.run(&torques_nm, 0.2, |_| {});
        let settled = plant.motion().attitude;
        plant.run(&torques_nm, if holds { 10.0 } else { 0.1 }, |_| {});
        let turned_rad = settled.angle_to(&plant.motion().attitude);
        println!("margin {margin}: {turned_rad:.1e} rad, {:?}", plant.counters());
        assert_eq!(turned_rad < 1e-6, holds);
    }
}

/// Tolerances: the acceleration that the measured normal forces leave to 1e-6; the way after a while to 1e-3 of that of the
/// forces that the torques ask for.
#[test]
fn a_grasp_too_weak_slides_as_it_must() {
    for fingers in [2, 3, 4] {
        let (mut plant, torques_nm) = grasp(fingers, 0.95, Vector3::zeros(), 2e-4);
        const TIME_S: f64 = 0.2;
        let mut off: f64 = 0.0;
        plant.run(&torques_nm, TIME_S, |plant| {
            // The step's change of speed is twice that from the half step before.
            let measured = (plant.solution.object[2] - plant.before.object[2]) / (0.5 * plant.substep_s);
            let normal_n: f64 = plant.contacts().iter().map(|contact| contact.normal_n).sum();
            let expected = -GRAVITY_M_S2 + FRICTION * normal_n / MASS_KG;
            off = off.max((measured - expected).abs() / GRAVITY_M_S2);
        });
        let expected_m = -0.5 * 0.05 * GRAVITY_M_S2 * TIME_S * TIME_S;
        let way = plant.motion().position_m.z / expected_m - 1.0;
        println!(
            "{fingers} fingers: acceleration off by {off:.1e} g, way by {way:.1e}, {:?}",
            plant.counters()
        );
        assert!(off < 1e-6 && way.abs() < 1e-3);
    }
}

/// The normal force as an average along the path, against that of the rolling contact, which is frozen at the step: in a grasp
/// that swings without slipping, since one finger pushes harder.
///
/// Tolerance: their difference falls with the square of the step, by a factor of 3.5 at least for each halving.
#[test]
fn an_average_along_the_path_differs_by_the_square_of_the_step() {
    let mut coarser: Option<f64> = None;
    for substep_s in [2e-4, 1e-4, 5e-5, 2.5e-5] {
        let (mut plant, mut torques_nm) = grasp(3, 10.0, Vector3::zeros(), substep_s);
        for friction in &mut plant.world.fingertip_friction {
            *friction = Friction { sliding: 10.0, torsion_m: 0.0 };
        }
        torques_nm[0] *= 1.3;
        let every = (2e-4 / substep_s).round() as u64;
        let forces = |mut plant: Plant| {
            let mut forces = vec![];
            plant.run(&torques_nm, 0.04, |plant| {
                if plant.steps.is_multiple_of(every) {
                    forces.extend(plant.contacts().iter().map(|contact| contact.normal_n));
                }
            });
            forces
        };
        let (average, frozen) = (forces(plant.clone()), forces(plant.compare_with_rolling()));
        assert_eq!(average.len(), frozen.len() / 3);
        let largest = average.iter().copied().fold(0.0, f64::max);
        // Each fingertip's contact is followed by the two halves of its torsion.
        let frozen = frozen.iter().step_by(3);
        let off_n = average.iter().zip(frozen).fold(0.0f64, |off, (a, b)| off.max((a - b).abs()));
        println!("step {substep_s}: {off_n:.1e} N of {largest:.2} N");
        assert!(coarser.is_none_or(|coarser| coarser > 3.5 * off_n));
        coarser = Some(off_n);
    }
}
