//! The order of the integrator through everything that is not smooth: against itself with a very short step.

use super::*;
use crate::coulomb::plant::tests::tables::cube;
use crate::coulomb::stiffness::corner;
use blindgrasp_body::polyhedron::{Face, Flatness};
use blindgrasp_meshes::valley;

/// What is compared: object's position, m, and attitude, as a rotation vector times 3 cm; and joint angles times 3 cm.
fn state(plant: &Plant) -> Vec<f64> {
    let motion = plant.motion();
    let turned = motion.attitude.scaled_axis() * 0.03;
    let joints = motion.angles_rad.iter().take(plant.model.hand.joint_count()).map(|angle| 0.03 * angle);
    motion.position_m.iter().chain(turned.iter()).copied().chain(joints).collect()
}

/// Largest errors at all multiples of the coarsest step, for steps that halve.
fn errors(steps_s: &[f64], time_s: f64, torques_nm: &[f64], scene: &dyn Fn(f64) -> Plant) -> Vec<f64> {
    let path = |substep_s: f64| {
        let mut plant = scene(substep_s);
        let every = (steps_s[0] / substep_s).round() as u64;
        let mut states = vec![];
        plant.run(torques_nm, time_s, |plant| {
            if plant.steps.is_multiple_of(every) {
                states.push(state(plant));
            }
        });
        states
    };
    let reference = path(steps_s[steps_s.len() - 1] / 16.0);
    let difference = |states: &Vec<Vec<f64>>| {
        let all = states.iter().flatten().zip(reference.iter().flatten());
        all.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    steps_s.iter().map(|&substep_s| difference(&path(substep_s))).collect()
}

/// Prints the errors, on average over scenes whose events fall into so many phases of the step. Returns the order over all
/// halvings.
fn order(name: &str, phases: u32, time_s: f64, torques_nm: &[f64], scene: &dyn Fn(f64, f64) -> Plant) -> f64 {
    let steps_s = [4e-4, 2e-4, 1e-4, 5e-5];
    let mut mean = [0.0; 4];
    for phase in 0..phases {
        let phase = f64::from(phase) / f64::from(phases);
        let errors = errors(&steps_s, time_s, torques_nm, &|substep_s| scene(substep_s, phase));
        for (mean, error) in mean.iter_mut().zip(&errors) {
            *mean += error / f64::from(phases);
        }
    }
    println!("{name}");
    for (k, (step_s, error)) in steps_s.iter().zip(&mean).enumerate() {
        let order = if k > 0 { format!("{:.2}", log2(mean[k - 1] / error)) } else { String::new() };
        println!("  {step_s:7.1e} {error:10.2e} {order:>6}");
    }
    let order = log2(mean[0] / mean[3]) / 3.0;
    println!("  in all {order:.2}");
    order
}

/// Binary logarithm: the exponent, and the mantissa by its series.
fn log2(ratio: f64) -> f64 {
    let (mut whole, mut rest) = (0.0, ratio);
    while rest >= 2.0 {
        rest /= 2.0;
        whole += 1.0;
    }
    while rest < 1.0 {
        rest *= 2.0;
        whole -= 1.0;
    }
    let z = (rest - 1.0) / (rest + 1.0);
    whole
        + 2.0 * (0..30).map(|k| z.powi(2 * k + 1) / f64::from(2 * k + 1)).sum::<f64>()
            / std::f64::consts::LN_2
}

/// The cube and a table; phases differ in height, speed and time of gravity.
fn on_table(start: Motion, friction: f64, gravity: Path, damping: f64) -> impl Fn(f64, f64) -> Plant {
    move |substep_s, phase| {
        let mut start = start;
        let model = model(no_hand(), cube(0.045));
        let material = corner(&model, 4e-4);
        let mut world = world(2, vec![table(friction)]);
        let gravity = gravity.clone();
        world.gravity_m_s2 = Some(Path::new(move |t_s| gravity.at(t_s - 1e-3 * phase)));
        if start.position_m.z > 0.03 {
            start.position_m.z += 1e-3 * phase;
        }
        start.velocity_m_s *= 1.0 + 0.02 * phase;
        let mut plant = Plant::new(model, world, start, substep_s).unwrap();
        plant.surfaces.materials.corner = material;
        plant.surfaces.materials.corner.damping[0] *= damping;
        plant
    }
}

fn weight() -> Path {
    Path::constant(Vector3::new(0.0, 0.0, -GRAVITY_M_S2))
}

/// The cube on the table, sunk in.
fn resting() -> Motion {
    let stiffness = corner(&model(no_hand(), cube(0.045)), 4e-4).linear_n_m;
    at(Vector3::new(0.0, 0.0, 0.024 - 0.045 * GRAVITY_M_S2 / (4.0 * stiffness)))
}

/// Tolerance of all: order 1.9 over three halvings.
fn assert_second_order(name: &str, time_s: f64, torques_nm: &[f64], scene: &dyn Fn(f64, f64) -> Plant) {
    let order = order(name, 6, time_s, torques_nm, scene);
    assert!(order > 1.9, "{name}: {order:.2}");
}

/// A cube falls on a corner, slips or sticks there, and leaves the table again.
#[test]
fn touch_and_lift_off() {
    let mut start = at(Vector3::new(0.0, 0.0, 0.045));
    start.attitude = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.5, 0.1));
    for (friction, damping) in [(0.0, 0.0), (0.3, 0.0), (2.0, 0.0), (0.0, 1.0), (0.3, 1.0), (2.0, 1.0)] {
        let scene = on_table(start, friction, weight(), damping);
        assert_second_order(&format!("landing, friction {friction}, damping {damping}"), 0.05, &[], &scene);
    }
}

/// A table that begins to lean.
#[test]
fn stick_to_slip() {
    let gravity = Path::new(|t_s| {
        let angle: f64 = 0.6 * t_s / 0.2;
        let (sine, cosine) = angle.sine_cosine();
        Vector3::new(sine, 0.3 * sine, -cosine) * GRAVITY_M_S2
    });
    assert_second_order("stick to slip", 0.3, &[], &on_table(resting(), 0.4, gravity, 1.0));
}

/// A cube that slides and spins until it lies still.
#[test]
fn slip_to_stick() {
    let mut start = resting();
    start.velocity_m_s = Vector3::new(0.2, 0.1, 0.0);
    start.spin_rad_s = Vector3::new(0.0, 0.0, 2.0);
    // The error hangs on the phase at which it stops: it takes more of them for an average.
    let order = order("slip to stick", 24, 0.15, &[], &on_table(start, 0.4, weight(), 1.0));
    assert!(order > 1.9, "{order:.2}");
}

/// A fingertip that comes from beside a free cube, over its edge, across its face, and over the other edge; without gravity.
fn over_edges(friction: Friction, substep_s: f64, phase: f64) -> Plant {
    let tip_m = Vector3::new(0.0388, 0.0, 0.0);
    let fingers =
        [arm(tip_m - Vector3::x(), tip_m), arm(Vector3::new(1.0, 0.0, 0.0), Vector3::new(1.1, 0.0, 0.0))];
    let mut model = model(hand(&fingers), cube(0.3));
    model.object_gravity_m_s2 = Vector3::zeros();
    let mut start = at(Vector3::zeros());
    start.angles_rad[0] = 0.05 + 2e-4 * phase;
    start.speeds_rad_s[0] = -0.8;
    let world = World { fingertip_friction: vec![friction; 2], ..World::default() };
    Plant::new(model, world, start, substep_s).unwrap()
}

/// A fingertip over edges: it slips all the time, or sticks and rolls.
#[test]
fn over_the_edge() {
    for (sliding, torsion_m) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.002), (3.0, 0.002)] {
        let friction = Friction { sliding, torsion_m };
        let mut seen = vec![];
        over_edges(friction, 1e-4, 0.0).run(&[], 0.12, |plant| {
            for contact in plant.contacts().iter().filter(|contact| contact.normal_n > 0.0) {
                let normal = plant.motion().attitude.inverse() * contact.touch.normal;
                let feature = (if normal.amax() > 1.0 - 1e-12 { "face" } else { "edge" }, contact.sticks);
                if seen.last() != Some(&feature) {
                    seen.push(feature);
                }
            }
        });
        println!("{seen:?}");
        let scene = |substep_s: f64, phase: f64| over_edges(friction, substep_s, phase);
        assert_second_order(&format!("over the edge, {friction:?}"), 0.12, &[], &scene);
    }
}

/// A body that slides past a fingertip, on which it leans: down into a valley of ten degrees and out of it again.
fn through_a_valley(friction: Friction, substep_s: f64, phase: f64) -> Plant {
    let (vertices, triangles) = valley();
    let flatness = Flatness { angle_rad: 1e-3, distance_m: 1e-6 };
    let shape = Polyhedron::mesh(&vertices, &triangles, &flatness).unwrap();
    // Over the left face, 1.1 mm deep.
    let on_left = |face: &&Face| face.normal.z > 0.9 && face.normal.x > 0.0;
    let left = shape.faces.iter().find(on_left).unwrap();
    let (out, edge_m) = (left.normal, shape.vertices_m[3]);
    let tip_m = edge_m + out * (TIP.radius_m - 1.1e-3) + out.cross(&Vector3::y()) * (0.018 + 1e-4 * phase);
    // Arms turn about the vertical: the body lies on its side.
    let on_its_side = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let tip_m = on_its_side * Vector3::new(tip_m.x, 0.0, tip_m.z);
    let fingers =
        [arm(tip_m - Vector3::x(), tip_m), arm(Vector3::new(1.0, 0.0, 0.0), Vector3::new(1.1, 0.0, 0.0))];
    let mut model = model(hand(&fingers), object(shape, 3.0));
    model.object_gravity_m_s2 = Vector3::new(0.0, -1.0, 0.0);
    let mut start = at(Vector3::zeros());
    start.attitude = on_its_side;
    start.velocity_m_s.x = -0.4;
    let world = World { fingertip_friction: vec![friction; 2], ..World::default() };
    Plant::new(model, world, start, substep_s).unwrap()
}

/// A fingertip over a concave edge: it slips all the time, or sticks and rolls.
#[test]
fn over_a_concave_edge() {
    for (sliding, torsion_m) in [(0.0, 0.0), (0.3, 0.002), (3.0, 0.002)] {
        let friction = Friction { sliding, torsion_m };
        let mut seen = vec![];
        through_a_valley(friction, 1e-4, 0.0).run(&[3.0], 0.1, |plant| {
            let pressed = plant.contacts().iter().filter(|contact| contact.normal_n > 0.0).count();
            let place = (pressed, plant.reliefs.len());
            if seen.last() != Some(&place) {
                seen.push(place);
            }
        });
        println!("{seen:?}");
        assert!(seen.contains(&(2, 1)), "it is on both sides at once: {seen:?}");
        let scene = |substep_s: f64, phase: f64| through_a_valley(friction, substep_s, phase);
        assert_second_order(&format!("over a concave edge, {friction:?}"), 0.1, &[3.0], &scene);
    }
}

/// The same, seen by the ledger: what kinetic and elastic energy changed by, once it is over, is what flowed.
///
/// Tolerance: 1e-3 of the energy that the contact takes up, falling with the square of the step over one edge, at least with the step
/// where places come and go.
#[test]
fn the_ledger_closes_over_edges() {
    ledger_closes(0.12, &[], 10.0, &over_edges);
    ledger_closes(0.1, &[3.0], 4.0, &through_a_valley);
}

fn ledger_closes(time_s: f64, torques_nm: &[f64], falls: f64, scene: &dyn Fn(Friction, f64, f64) -> Plant) {
    for sliding in [0.0, 0.3, 3.0] {
        let mut coarser = None;
        for substep_s in [4e-4, 1e-4] {
            let mut plant = scene(Friction { sliding, torsion_m: 0.002 }, substep_s, 0.0);
            let stored_j = |plant: &Plant| plant.kinetic_energy_j() + plant.elastic_energy_j();
            let (mut at_start_j, mut off_j, mut exchanged_j) = (None, 0.0f64, 0.0f64);
            plant.run(torques_nm, time_s, |plant| {
                let flows = plant.flows();
                let balance_j = stored_j(plant) + flows.dissipated() - flows.motors - flows.weight;
                off_j = (balance_j - *at_start_j.get_or_insert(balance_j)).abs();
                exchanged_j = exchanged_j.max(plant.elastic_energy_j() + plant.flows().dissipated());
            });
            println!("friction {sliding}, step {substep_s}: {off_j:.1e} J of {exchanged_j:.1e} J");
            assert!(off_j < 1e-3 * exchanged_j);
            assert!(coarser.is_none_or(|coarser| coarser > falls * off_j));
            coarser = Some(off_j);
        }
    }
}

/// Slip that passes through zero and goes on the other way is not located within its step: that costs an order.
///
/// Tolerance: order one.
#[test]
fn slip_that_turns_round_is_of_first_order() {
    let gravity = Path::new(|t_s| {
        let (sine, _) = (60.0 * t_s).sine_cosine();
        Vector3::new(0.8 * sine, 0.0, -1.0) * GRAVITY_M_S2
    });
    assert!(order("slip turns round", 6, 0.3, &[], &on_table(resting(), 0.2, gravity, 1.0)) > 0.9);
}

/// After a cube has slid to rest, the forces of friction stay what they are.
///
/// Tolerance: what alternates from step to step is at most 1 % of the weight at 0.5 ms, and half of it at half the step.
#[test]
fn forces_do_not_ring_once_it_sticks() {
    let mut coarser = None;
    for substep_s in [5e-4, 2.5e-4] {
        let mut worst: f64 = 0.0;
        for phase in 0..12 {
            let mut start = resting();
            start.velocity_m_s = Vector3::new(0.2, 0.1, 0.0);
            start.spin_rad_s = Vector3::new(0.0, 0.0, 2.0);
            let mut plant = on_table(start, 0.4, weight(), 1.0)(substep_s, f64::from(phase) / 12.0);
            // Friction on the cube as a whole, and steps since all corners stick.
            let (mut forces, mut steps) = ([Vector3::zeros(); 3], 0);
            plant.run(&[], 0.15, |plant| {
                let pressed = || plant.contacts().iter().filter(|contact| contact.normal_n > 0.0);
                let force = pressed().fold(Vector3::zeros(), |sum, contact| {
                    let [first, second] = contact.tangential_n;
                    sum + contact.touch.tangents[0] * first + contact.touch.tangents[1] * second
                });
                forces = [forces[1], forces[2], force];
                steps = if pressed().all(|contact| contact.sticks) { steps + 1 } else { 0 };
                if steps > 3 {
                    let alternating = (forces[0] - 2.0 * forces[1] + forces[2]).norm() / 4.0;
                    worst = worst.max(alternating / (0.045 * GRAVITY_M_S2));
                }
            });
        }
        println!("step {substep_s}: {:.2} % of the weight", 100.0 * worst);
        assert!(worst < 0.01 && coarser.is_none_or(|coarser: f64| worst < 0.6 * coarser));
        coarser = Some(worst);
    }
}
