//! Links and palm: what they carry, what they keep apart, and that nothing near is overlooked.

use super::robustness::{Kind, scene};
use super::tables::cube;
use super::*;
use blindgrasp_body::Capsule;
use blindgrasp_meshes::Numbers;

/// Rods on the base.
fn rods(ends_m: &[[[f64; 3]; 2]], radius_m: f64, friction: f64) -> World {
    let rod = |ends_m: &[[f64; 3]; 2]| Capsule { link: None, ends_m: ends_m.map(Vector3::from), radius_m };
    World {
        capsules: ends_m.iter().map(rod).collect(),
        capsule_friction: vec![friction; ends_m.len()],
        ..world(2, vec![])
    }
}

/// Forces of the hand on the object, N.
fn carried_n(plant: &Plant) -> Vector3<f64> {
    let contacts = plant.contacts().iter().filter(|contact| contact.normal_n > 0.0);
    contacts.fold(Vector3::zeros(), |sum, contact| {
        assert!(matches!(contact.touch.pair, Pair::CapsuleObject { .. }));
        let [first, second] = contact.tangential_n;
        let Touch { normal, tangents, .. } = contact.touch;
        sum + normal * contact.normal_n + tangents[0] * first + tangents[1] * second
    })
}

/// A cube on two rods, which are shorter than it: four contacts at their ends carry its weight, and it does not creep on a slope of
/// half a radian, below its friction of 0.8; on three rods that are longer it rests on its edges' places.
///
/// Tolerances: the weight to 1e-6 after 2 s; creep as of grasps, 1e-3 um/s.
#[test]
fn a_cube_rests_on_rods() {
    let (sine, cosine) = 0.5f64.sine_cosine();
    let gravity = Vector3::new(0.0, sine, -cosine) * GRAVITY_M_S2;
    for (half_m, rods_at) in [(0.015, vec![-0.012, 0.012]), (0.05, vec![-0.015, 0.0, 0.015])] {
        let ends: Vec<_> = rods_at.iter().map(|&x| [[x, -half_m, -0.01], [x, half_m, -0.01]]).collect();
        let mut model = model(no_hand(), cube(0.045));
        model.object_gravity_m_s2 = gravity;
        let start = at(Vector3::new(0.0, 0.0, 0.024));
        let mut plant = Plant::new(model, rods(&ends, 0.01, 0.8), start, 5e-4).unwrap();
        plant.run(&[], 2.0, |_| ());
        let force_n = carried_n(&plant);
        assert!((force_n + gravity * 0.045).norm() < 1e-6, "{force_n}");
        let before_m = plant.motion().position_m;
        plant.run(&[], 10.0, |_| ());
        let creep_m_s = (plant.motion().position_m - before_m).norm() / 10.0;
        println!("{} rods: {:.1e} um/s", rods_at.len(), creep_m_s * 1e6);
        assert!(creep_m_s < 1e-9);
        assert!(plant.contacts().iter().all(|contact| contact.sticks == (contact.normal_n > 0.0)));
    }
}

/// Too steep: it slides along the rods as it must.
///
/// Tolerance: 1e-4 of the acceleration's difference, as of a table.
#[test]
fn it_slides_off_rods_that_are_too_steep() {
    let (sine, cosine) = 0.5f64.sine_cosine();
    let mut model = model(no_hand(), cube(0.045));
    model.object_gravity_m_s2 = Vector3::new(0.0, sine, -cosine) * GRAVITY_M_S2;
    let ends = [-0.012, 0.012].map(|x| [[x, -0.5, -0.01], [x, 0.5, -0.01]]);
    let stiffness = 4.0 * 6e4f64;
    let start = at(Vector3::new(0.0, 0.0, 0.024 - 0.045 * GRAVITY_M_S2 * cosine / stiffness));
    let mut plant = Plant::new(model, rods(&ends, 0.01, 0.2), start, 2e-4).unwrap();
    plant.run(&[], 0.1, |_| ());
    let (y_m, v_m_s) = (plant.motion().position_m.y, plant.motion().velocity_m_s.y);
    plant.run(&[], 0.3, |_| ());
    let accelerated = (plant.motion().velocity_m_s.y - v_m_s) / 0.3;
    let expected = GRAVITY_M_S2 * (sine - 0.2 * cosine);
    println!("{accelerated} {expected}, {} m", plant.motion().position_m.y - y_m);
    assert!((accelerated / expected - 1.0).abs() < 1e-4);
}

/// Two arms that swing into each other, as links with a radius or with their fingertips: they stay apart by it, torques are carried, and
/// energy is accounted for.
///
/// Tolerances: hard parts give by less than half a millimetre under 2 N, soft ones as their springs say; the ledger to 1e-3.
#[test]
fn arms_stay_apart() {
    for has_links in [true, false] {
        let fingers = [
            arm(Vector3::new(-0.05, 0.0, 0.0), Vector3::new(-0.05, 0.1, 0.0)),
            arm(Vector3::new(0.05, 0.0, 0.0), Vector3::new(0.05, 0.1, 0.0)),
        ];
        let mut model = model(hand(&fingers), object(Polyhedron::cuboid([0.05; 3]).unwrap(), 0.1));
        model.object_gravity_m_s2 = Vector3::zeros();
        let mut world = World { hand_touches_itself: true, ..world(2, vec![]) };
        if has_links {
            let link = |k: usize| Capsule {
                link: Some(k),
                ends_m: [0.03, 0.15]
                    .map(|y| model.hand.prepared_joints()[k].from_link.tr_mul(&Vector3::new(0.0, y, 0.0))),
                radius_m: 0.02,
            };
            world.capsules = vec![link(0), link(1)];
            world.capsule_friction = vec![0.5; 2];
        }
        let start = at(Vector3::new(0.0, 0.0, 1.0));
        let mut plant = Plant::new(model, world, start, 2.5e-4).unwrap();
        let (mut least_m, mut deepest_m, mut touched) = (f64::INFINITY, 0.0f64, false);
        // Right arm to the left, left arm to the right.
        let torques_nm = [-0.1, 0.1];
        plant.run(&torques_nm, 1.0, |plant| {
            for contact in plant.contacts() {
                assert!(matches!(contact.touch.pair, Pair::Parts { .. }), "{:?}", contact.touch.pair);
                touched |= contact.normal_n > 0.0;
                deepest_m = deepest_m.max(contact.touch.depth_m);
            }
            least_m = least_m.min((plant.posture().centres_m[0] - plant.posture().centres_m[1]).norm());
        });
        let flows = plant.flows();
        let stored_j = plant.kinetic_energy_j() + plant.elastic_energy_j();
        let off_j = stored_j + flows.dissipated() - flows.motors;
        println!("links {has_links}: {deepest_m} m deep, {least_m} m apart, {off_j} J of {}", flows.motors);
        assert!(touched && plant.kinetic_energy_j() < 1e-9);
        assert!(off_j.abs() < 1e-3 * flows.motors);
        let pressed = plant.contacts().iter().find(|contact| contact.normal_n > 0.0).unwrap();
        let lever_m = pressed.touch.point_m.y;
        let normal_n = pressed.normal_n * pressed.touch.normal.x.abs();
        // At rest each arm's torque is that of the contact.
        assert!(
            (normal_n * lever_m
                + pressed.normal_n * pressed.touch.normal.y * (pressed.touch.point_m.x + 0.05)
                - 0.1)
                .abs()
                < 1e-3
        );
        if has_links {
            assert!(pressed.touch.depth_m < 5e-4);
        } else {
            let expected_m = 2.0 * (pressed.normal_n / TIP.stiffness_n_m2).square_root();
            assert!((pressed.touch.depth_m / expected_m - 1.0).abs() < 1e-3);
        }
    }
}

/// To look at everything in each step comes to the same motion, to the bit.
#[test]
fn nothing_near_is_overlooked() {
    let mut touched = 0;
    for seed in 0..60 {
        let path = |everything: bool| {
            let (mut plant, torques) = scene(&mut Numbers(seed), 1.0, Kind::Links);
            let mut torques_nm = [0.0; MAX_JOINTS];
            torques_nm[..torques.len()].copy_from_slice(&torques);
            let mut seen = 0;
            for _ in 0..400 {
                if everything {
                    plant.surfaces.links.forget();
                }
                plant.solve(&torques_nm).unwrap();
                let of_links = |contact: &&Contact| {
                    contact.normal_n > 0.0
                        && matches!(
                            contact.touch.pair,
                            Pair::CapsuleObject { .. } | Pair::CapsuleTable { .. } | Pair::Parts { .. }
                        )
                };
                seen += plant.contacts().iter().filter(of_links).count();
                plant.advance();
            }
            (*plant.motion(), seen)
        };
        let (all, some) = (path(true), path(false));
        assert_eq!(all, some, "scene {seed}");
        touched += usize::from(all.1 > 0);
    }
    assert!(touched > 10, "{touched} of 60");
}
