//! Joint limits and rotors.

use super::*;

/// A hand of two arms of 0.1 m, far from everything, in a world.
fn arms(change: impl Fn(&mut PlantModel, &mut World)) -> Plant {
    let mut world = world(2, vec![]);
    let mut model = model(no_hand(), object(Polyhedron::cuboid([0.05; 3]).unwrap(), 0.1));
    change(&mut model, &mut world);
    Plant::new(model, world, at(Vector3::zeros()), 5e-4).unwrap()
}

/// About the joint: a mass in the middle of the arm, and its own inertia.
const ARM_KG_M2: f64 = 0.02 * (0.05 * 0.05 + 0.01 / 12.0);

/// A constant torque on a free joint: `t^2 / 2` of its acceleration.
///
/// Tolerance: 1e-12: the leapfrog is exact there.
#[test]
fn a_rotor_adds_its_inertia_to_the_joint() {
    for rotor_kg_m2 in [0.0, 1e-5, 3e-4] {
        let mut plant = arms(|model, _| model.rotor_inertia_kg_m2 = vec![rotor_kg_m2; 2]);
        plant.run(&[1e-3], 0.1, |_| {});
        let expected_rad = 0.5 * 1e-3 / (ARM_KG_M2 + rotor_kg_m2) * (0.1 * 0.1);
        let off = plant.motion().angles_rad[0] / expected_rad - 1.0;
        println!("rotor {rotor_kg_m2:.0e}: off by {off:.1e}");
        assert!(off.abs() < 1e-12);
    }
}

/// A joint that runs into its end stop at some speed, pushed on by its torque.
///
/// Tolerances: it comes to rest where stop and torque are in balance, to 1e-9 of the depth; on the way it is not deeper than
/// without damping; the ledger closes to 1e-4 of the work, what the half step of the start costs (`h^2`).
#[test]
fn an_end_stop_holds_a_joint() {
    const TORQUE_NM: f64 = 0.05;
    let mut free = arms(|_, _| {});
    free.run(&[TORQUE_NM], 0.5, |_| {});
    assert!(free.motion().angles_rad[0] > 10.0);

    let mut plant = arms(|model, _| model.joint_limits = true);
    plant.model.object_gravity_m_s2 = Vector3::zeros();
    let mut deepest_rad: f64 = 0.0;
    plant.run(&[TORQUE_NM], 0.5, |plant| deepest_rad = deepest_rad.max(plant.motion().angles_rad[0] - 1.0));
    let stiffness = plant.surfaces.materials.limits[0].linear_n_m;
    let sunk_rad = plant.motion().angles_rad[0] - 1.0;
    let flows = plant.flows();
    let off_j = plant.kinetic_energy_j() + plant.elastic_energy_j() + flows.dissipated() - flows.motors;
    println!(
        "stop of {stiffness:.1} N m/rad: {deepest_rad:.1e} rad at most, at rest {sunk_rad:.3e} rad, ledger off by {off_j:.1e} J of {:.1e} J",
        flows.motors
    );
    assert!((sunk_rad * stiffness / TORQUE_NM - 1.0).abs() < 1e-9);
    assert!(deepest_rad < (2.0 * TORQUE_NM * (1.0 + deepest_rad) / stiffness).square_root());
    assert!(off_j.abs() < 1e-4 * flows.motors);
}

/// Gravity given as a path that does not change is that of the model, to the bit; one that turns makes a pendulum follow, and
/// its work is what the arm's energy changes by.
///
/// Tolerance: 1e-5 of the largest energy, an error of second order in the step.
#[test]
fn gravity_may_turn() {
    let across = Vector3::new(2.0, -1.0, -9.0);
    let (mut constant, mut path) =
        (arms(|_, _| {}), arms(|_, world| world.gravity_m_s2 = Some(Path::constant(across))));
    constant.model.hand_gravity_m_s2 = across;
    constant.model.object_gravity_m_s2 = across;
    for plant in [&mut constant, &mut path] {
        plant.run(&[], 0.2, |_| {});
    }
    assert_eq!(constant.motion(), path.motion());

    let mut turning = arms(|_, world| {
        world.gravity_m_s2 = Some(Path::new(|t_s| {
            let (sine, cosine) = (5.0 * t_s).sine_cosine();
            Vector3::new(sine, -cosine, 0.0) * GRAVITY_M_S2
        }));
    });
    let (mut off_j, mut most_j) = (0.0f64, 0.0f64);
    turning.run(&[], 1.0, |plant| {
        most_j = most_j.max(plant.kinetic_energy_j());
        off_j = off_j.max((plant.kinetic_energy_j() - plant.flows().weight).abs());
    });
    println!("off by {off_j:.1e} J of {most_j:.1e} J, at {:.2} rad", turning.motion().angles_rad[0]);
    assert!(off_j < 1e-5 * most_j && turning.motion().angles_rad[0].abs() > 0.1);
}
