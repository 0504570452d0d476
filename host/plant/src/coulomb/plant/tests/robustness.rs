//! Random scenes: nothing panics, diverges, hangs, or makes energy.

use super::*;
use blindgrasp_body::polyhedron::Flatness;
use blindgrasp_body::{Capsule, Push};
use blindgrasp_meshes::{Numbers, bracket, pit, plate, valley};

/// The objects of random scenes.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    /// Convex; of the hand, fingertips alone touch.
    Convex,
    /// With concave edges, tunnels and pits.
    Concave,
    /// Convex or not; links and palm touch as well.
    Links,
}

/// A number between two, its logarithm evenly spread.
fn spread(numbers: &mut Numbers, least: f64, most: f64) -> f64 {
    // By squaring: 2^10 levels are enough for a test.
    let (mut low, mut high) = (least, most);
    for _ in 0..10 {
        let middle = (low * high).square_root();
        if numbers.unit() < 0.5 { high = middle } else { low = middle }
    }
    low
}

fn friction(numbers: &mut Numbers) -> Friction {
    let sliding = if numbers.below(8) == 0 { 0.0 } else { spread(numbers, 0.03, 3.0) };
    Friction { sliding, torsion_m: if numbers.below(2) == 0 { 0.0 } else { 3e-3 * numbers.unit() } }
}

/// A scene in which nothing is deep inside something else at the start, with a share of its step.
pub(super) fn scene(numbers: &mut Numbers, share: f64, kind: Kind) -> (Plant, Vec<f64>) {
    loop {
        let (mut plant, torques_nm) = any_scene(numbers, share, kind);
        plant.collect(&mut Everything::ZERO.clone());
        if plant.touches.iter().all(|touch| touch.depth_m < 1e-3) {
            return (plant, torques_nm);
        }
    }
}

/// An object, up to two tables of which one may move, up to five arms that push at it, and pushes from outside.
fn any_scene(numbers: &mut Numbers, share: f64, kind: Kind) -> (Plant, Vec<f64>) {
    let size_m = spread(numbers, 0.01, 0.1);
    let shape = match numbers.below(4) {
        0 => Polyhedron::cuboid([size_m, size_m * (0.2 + numbers.unit()), size_m * (0.2 + numbers.unit())]),
        1 => Polyhedron::regular_prism(3 + numbers.below(10), size_m, size_m),
        2 => Polyhedron::regular_pyramid(3 + numbers.below(5), size_m, size_m),
        _ => Polyhedron::hull(
            &(0..4 + numbers.below(12)).map(|_| numbers.vector() * size_m).collect::<Vec<_>>(),
        ),
    };
    let mut shape = shape.unwrap_or_else(|_| Polyhedron::cuboid([size_m; 3]).unwrap());
    if matches!(kind, Kind::Concave) || (matches!(kind, Kind::Links) && numbers.below(2) == 0) {
        let (mut vertices, triangles) = [bracket, plate, pit, valley][numbers.below(4)]();
        for vertex in &mut vertices {
            *vertex *= size_m / 0.05;
        }
        let flatness = Flatness { angle_rad: 1e-3, distance_m: 1e-6 };
        shape = Polyhedron::mesh(&vertices, &triangles, &flatness).unwrap();
    }
    let radius_m = shape.radius_m();
    let object = object(shape, spread(numbers, 1e-3, 10.0));
    let fingers = 2 + numbers.below(4);
    let mut torques_nm = vec![];
    let arms: Vec<_> = (0..fingers)
        .map(|_| {
            let away = numbers.vector().normalize();
            let tip_m = away * (radius_m + TIP.radius_m) + numbers.vector() * 0.3 * radius_m;
            torques_nm.push((numbers.unit() - 0.7) * spread(numbers, 0.003, 0.3));
            arm(tip_m + Vector3::z().cross(&away).normalize() * 0.1, tip_m)
        })
        .collect();
    let mut model = model(hand(&arms), object);
    model
        .friction
        .fill(JointFriction { viscous_nm_s: 1e-3 * (1.0 + numbers.unit()), ..JointFriction::default() });
    let force_n = numbers.vector() * model.object.mass_kg * 30.0;
    let push = Push { from_s: 0.05, for_s: 0.1, rise_s: 0.0, force_n, moment_nm: force_n * 0.01 * size_m };
    model.pushes = vec![push];
    let mut tables = vec![table(friction(numbers).sliding)];
    tables[0].point_m = Path::constant(Vector3::new(0.0, 0.0, -radius_m * (1.0 + numbers.unit())));
    if numbers.below(2) == 0 {
        let moves = numbers.vector() * 0.02;
        let mut wall = table(friction(numbers).sliding);
        wall.normal = numbers.vector().normalize();
        let far_m = wall.normal * -1.2 * radius_m;
        wall.point_m = Path::new(move |t_s| far_m + moves * (20.0 * t_s).sine_cosine().0);
        tables.push(wall);
    }
    let mut world = World {
        fingertip_friction: (0..fingers).map(|_| friction(numbers)).collect(),
        tables,
        ..World::default()
    };
    if let Kind::Links = kind {
        // Arms up to their fingertips, and a ball in their middle.
        for (link, (_, arm_m)) in arms.iter().enumerate() {
            let ends_m = [arm_m * 0.5, *arm_m]
                .map(|end_m| model.hand.prepared_joints()[link].from_link.tr_mul(&end_m));
            world.capsules.push(Capsule { link: Some(link), ends_m, radius_m: 0.008 });
        }
        world.hand_touches_itself = true;
        let ends_m = [numbers.vector() * 2.0 * radius_m; 2];
        world.capsules.push(Capsule { link: None, ends_m, radius_m: 0.01 });
        world.capsule_friction = world.capsules.iter().map(|_| friction(numbers).sliding).collect();
    }
    model.joint_limits = numbers.below(2) == 0;
    model.rotor_inertia_kg_m2 = if numbers.below(2) == 0 { vec![] } else { vec![3e-5; fingers] };
    let mut start = at(Vector3::zeros());
    start.velocity_m_s = numbers.vector() * 0.5;
    start.spin_rad_s = numbers.vector() * 10.0;
    let substep_s = share * [2.5e-4, 5e-4, 1e-3][numbers.below(3)];
    (Plant::new(model, world, start, substep_s).unwrap(), torques_nm)
}

/// Runs a scene for 0.3 s. Returns the most energy that the flows do not explain, in units of the largest that was or flowed.
fn gained(seed: u64, plant: &mut Plant, torques_nm: &[f64]) -> f64 {
    let mut least_j = f64::INFINITY;
    let (mut gained_j, mut scale_j) = (0.0f64, 0.0f64);
    plant.run(torques_nm, 0.3, |plant| {
        if !plant.started {
            return;
        }
        let (work, stored_j) = (&plant.work, plant.half_step_energy_j());
        let given_j = work.motors + work.pushes + work.tables + work.weight;
        let balance_j = stored_j + work.dissipated() - given_j;
        assert!(balance_j.is_finite(), "scene {seed}");
        least_j = least_j.min(balance_j);
        gained_j = gained_j.max(balance_j - least_j);
        scale_j = scale_j.max(stored_j).max(work.dissipated());
    });
    gained_j / scale_j
}

/// Tolerances: 1 % of the energy; where a light object between hard fingertips is more than a step of up to 1 ms resolves,
/// half of it or less at a quarter of the step. A link that a corner is jammed into by millimetres gets a second place with elastic
/// energy of its own: 5 % in one scene of two hundred. Solutions that did not converge: one in a thousand, all of them jammed.
fn run_scenes(seeds: std::ops::Range<u64>, kind: Kind) {
    let mut total = Counters::default();
    let (mut most, mut brought, scenes) = ((0.0, 0), 0, (seeds.end - seeds.start) as u32);
    for seed in seeds {
        let (mut plant, torques_nm) = scene(&mut Numbers(seed), 1.0, kind);
        let gain = gained(seed, &mut plant, &torques_nm);
        let counters = plant.counters();
        total.steps += counters.steps;
        total.linearizations += counters.linearizations;
        total.slips += counters.slips;
        total.newton_steps += counters.newton_steps;
        total.fallback_sweeps += counters.fallback_sweeps;
        total.unconverged += counters.unconverged;
        total.projections += counters.projections;
        if counters.unconverged > 0 {
            println!("scene {seed}: {} of {} not converged", counters.unconverged, counters.steps);
        }
        if gain > 0.01 {
            let (mut plant, torques_nm) = scene(&mut Numbers(seed), 0.25, kind);
            let finer = gained(seed, &mut plant, &torques_nm);
            println!("scene {seed}: {gain:.1e} gained, {finer:.1e} at a quarter of the step");
            brought += u32::from(finer >= 0.5 * gain);
            assert!(finer < if let Kind::Links = kind { 0.05 } else { 0.5 * gain });
        }
        if gain > most.0 {
            most = (gain, seed);
        }
    }
    // Of links: one scene in two hundred, or one of a few.
    assert!(200 * brought <= scenes + 200, "{brought} scenes");
    println!("{total:?}; most energy from nothing: {:.1e} in scene {}", most.0, most.1);
    assert!(1000 * total.unconverged <= total.linearizations);
}

#[test]
fn a_hundred_random_scenes() {
    run_scenes(0..100, Kind::Convex);
    run_scenes(0..100, Kind::Concave);
    run_scenes(0..100, Kind::Links);
}

#[test]
#[ignore = "takes a minute"]
fn two_thousand_random_scenes() {
    run_scenes(0..2000, Kind::Convex);
    run_scenes(0..2000, Kind::Concave);
    run_scenes(0..2000, Kind::Links);
}
