//! How long a step takes: run alone, `cargo test --release -p blindgrasp-plant speed -- --ignored --nocapture`.

use super::*;
use std::time::Instant;

/// A hand of three fingers with four joints each, which stand upright under a prism that they hold; and perhaps a table under it.
fn upright(friction: f64, tables: Vec<Table>) -> (Plant, Vec<f64>) {
    let shape = Polyhedron::regular_prism(3, 0.06, 0.04).unwrap();
    let (mut joints, mut fingertips, mut torques_nm) = (vec![], vec![], vec![]);
    for face in shape.faces.iter().filter(|face| face.normal.z.abs() < 0.1) {
        let tip_m = face.normal * (face.distance_m + TIP.radius_m - 1e-3);
        for link in 0..4 {
            let (first, axis) =
                (link == 0, if link == 0 { face.normal } else { Vector3::z().cross(&face.normal) });
            joints.push(Joint {
                parent: (!first).then(|| joints.len() - 1),
                offset_m: if first { tip_m - Vector3::z() * 0.1 } else { Vector3::z() * 0.025 },
                attitude: Matrix3::identity(),
                axis,
                lower_rad: -1.0,
                upper_rad: 1.0,
                link: Link {
                    mass_kg: 0.02,
                    mass_centre_m: Vector3::z() * 0.0125,
                    inertia_kg_m2: Matrix3::identity() * 2e-6,
                },
            });
            // A force inwards at the fingertip.
            let lever_m = Vector3::z() * (0.1 - 0.025 * f64::from(link));
            torques_nm.push(axis.dot(&lever_m.cross(&(face.normal * -2.39))));
        }
        let offset_m = Vector3::z() * 0.025;
        fingertips.push(Fingertip { link: joints.len() - 1, offset_m, radius_m: TIP.radius_m });
    }
    let world = World {
        fingertip_friction: vec![Friction { sliding: friction, torsion_m: 2e-3 }; 3],
        tables,
        joint_limits: true,
        rotor_inertia_kg_m2: vec![1e-5; 12],
        ..World::default()
    };
    let model = model(Hand::new(&joints, &fingertips).unwrap(), object(shape, 0.045));
    (Plant::new(model, world, at(Vector3::zeros()), 5e-4).unwrap(), torques_nm)
}

#[test]
#[ignore = "a measurement"]
fn of_a_step() {
    let mut under = table(0.5);
    under.point_m = Path::constant(Vector3::new(0.0, 0.0, -0.02));
    for (name, friction, tables) in
        [("held", 1.0, vec![]), ("held on a table", 1.0, vec![under]), ("sliding", 0.02, vec![])]
    {
        let mut best_us = f64::INFINITY;
        for _ in 0..200 {
            let (mut plant, torques_nm) = upright(friction, tables.clone());
            let (mut torques, steps) = ([0.0; MAX_JOINTS], 40);
            torques[..12].copy_from_slice(&torques_nm);
            let begun = Instant::now();
            for _ in 0..steps {
                plant.solve(&torques).unwrap();
                plant.advance();
            }
            best_us = best_us.min(begun.elapsed().as_secs_f64() / f64::from(steps) * 1e6);
            if best_us.is_nan() {
                println!("{:?}", plant.counters());
            }
        }
        let (mut plant, torques_nm) = upright(friction, tables);
        plant.run(&torques_nm, 0.02, |_| {});
        println!(
            "{name}: {best_us:.2} us a step, {:?}, {} contacts",
            plant.counters(),
            plant.contacts().len()
        );
    }
}

#[test]
#[ignore = "a measurement"]
fn of_its_parts() {
    let (mut plant, torques_nm) = upright(1.0, vec![]);
    let mut torques = [0.0; MAX_JOINTS];
    torques[..12].copy_from_slice(&torques_nm);
    plant.run(&torques_nm, 0.01, |_| {});
    let time = |name: &str, work: &mut dyn FnMut(&mut Plant), plant: &mut Plant| {
        let mut best_us = f64::INFINITY;
        for _ in 0..50 {
            let begun = Instant::now();
            for _ in 0..100 {
                work(plant);
            }
            best_us = best_us.min(begun.elapsed().as_secs_f64() * 1e4);
        }
        println!("{name}: {best_us:.2} us");
    };
    time("place", &mut |plant| plant.place(), &mut plant);
    time(
        "external forces",
        &mut |plant| {
            let (mut push, mut softness) = (Everything::ZERO, [0.0; MAX_JOINTS]);
            plant.external_forces(&torques, 2.5e-4, &mut push, &mut softness);
        },
        &mut plant,
    );
    let object = plant.object_mass();
    time(
        "factorize",
        &mut |plant| {
            plant.mass.factorize(&plant.now.mass, &[0.0; MAX_JOINTS], &object);
        },
        &mut plant,
    );
    time("collect", &mut |plant| plant.collect(), &mut plant);
    time("set problem", &mut |plant| plant.set_problem(2.5e-4, &Everything::ZERO), &mut plant);
    time(
        "powers",
        &mut |plant| {
            plant.power = plant.powers(&torques, 2.5e-4);
        },
        &mut plant,
    );
    time("report", &mut |plant| plant.report(), &mut plant);
    time("solve", &mut |plant| plant.solve(&torques).unwrap(), &mut plant);
    let mut clock = plant.clone();
    time("hold", &mut |plant| plant.hold_what_sticks(), &mut clock);
}
