//! A free object and tables.

use super::*;
use crate::coulomb::stiffness::corner;

const SIDE_M: f64 = 0.048;
const MASS_KG: f64 = 0.045;

pub(super) fn cube(mass_kg: f64) -> ObjectModel {
    object(Polyhedron::cuboid([SIDE_M; 3]).unwrap(), mass_kg)
}

/// A cube on a table, sunk in as its weight asks for, with gravity of a direction in the x-z plane.
fn on_slope(friction: f64, slope_rad: f64, substep_s: f64) -> Plant {
    let (sine, cosine) = slope_rad.sine_cosine();
    let mut model = model(no_hand(), cube(MASS_KG));
    model.object_gravity_m_s2 = Vector3::new(sine, 0.0, -cosine) * GRAVITY_M_S2;
    let stiffness = corner(&model, substep_s).linear_n_m;
    let sunk_m = MASS_KG * GRAVITY_M_S2 * cosine / (4.0 * stiffness);
    let start = at(Vector3::new(0.0, 0.0, 0.5 * SIDE_M - sunk_m));
    Plant::new(model, world(2, vec![table(friction)]), start, substep_s).unwrap()
}

/// Sixty seconds at 95 % of the slope that friction holds, with the default steps' length of 0.5 ms and a longer one.
///
/// Tolerance: 1e-3 um/s; what is left is rounding of positions.
#[test]
fn it_does_not_creep_on_a_slope() {
    for (friction, substep_s) in [(0.5, 5e-4), (0.8, 1e-3)] {
        let mut plant = on_slope(friction, arc_tangent(0.95 * friction), substep_s);
        plant.run(&[], 1.0, |_| {});
        let settled_m = plant.motion().position_m;
        plant.run(&[], 60.0, |_| {});
        let creep_um_s = (plant.motion().position_m - settled_m).norm() / 60.0 * 1e6;
        println!("friction {friction}, step {substep_s}: {creep_um_s:.1e} um/s");
        assert!(creep_um_s < 1e-3);
    }
}

/// Tolerance: 1e-4 of the acceleration, between two times at which it no longer rocks; corners sink in differently by a
/// hundredth of a millimetre, which turns the cube by less than a milliradian.
#[test]
fn it_slides_down_a_steeper_slope() {
    for friction in [0.1, 0.5, 0.7] {
        let slope_rad: f64 = arc_tangent(friction) + 0.05;
        let mut plant = on_slope(friction, slope_rad, 2e-4);
        let mut speeds = vec![];
        for _ in 0..2 {
            plant.run(&[], 0.25, |_| {});
            speeds.push(plant.motion().velocity_m_s.x);
        }
        let (sine, cosine) = slope_rad.sine_cosine();
        let expected = GRAVITY_M_S2 * (sine - friction * cosine);
        let measured = (speeds[1] - speeds[0]) / 0.25;
        println!("friction {friction}: {measured:.6} m/s^2, off by {:.1e}", measured / expected - 1.0);
        assert!((measured / expected - 1.0).abs() < 1e-4);
    }
}

/// A cube tips over at a slope of one, if it does not slide before.
#[test]
fn it_tips_over_where_its_weight_leaves_the_face() {
    for (slope, tips) in [(0.98, false), (1.02, true)] {
        let mut plant = on_slope(1.5, arc_tangent(slope), 2e-4);
        plant.run(&[], 0.5, |_| {});
        let angle_rad = plant.motion().attitude.angle();
        println!("slope {slope}: {angle_rad:.4} rad");
        assert_eq!(angle_rad > 0.3, tips);
    }
}

/// Tolerance: 1e-4. The cube rocks when it begins to slide, which takes a millionth of its energy.
#[test]
fn it_stops_after_the_distance_that_friction_allows() {
    for friction in [0.1, 0.3] {
        let mut plant = on_slope(friction, 0.0, 1e-4);
        const SPEED_M_S: f64 = 0.5;
        plant.motion.velocity_m_s.x = SPEED_M_S;
        plant.before = velocities(&plant.motion);
        plant.previous = plant.before;
        let stop_s = SPEED_M_S / (friction * GRAVITY_M_S2);
        plant.run(&[], stop_s + 0.1, |_| {});
        let expected = SPEED_M_S * SPEED_M_S / (2.0 * friction * GRAVITY_M_S2);
        let off = plant.motion().position_m.x / expected - 1.0;
        println!("friction {friction}: off by {off:.1e}, speed {:.1e}", plant.motion().velocity_m_s.norm());
        assert!(off.abs() < 1e-4 && plant.motion().velocity_m_s.norm() < 1e-9);
    }
}

/// A cube that spins on its face: four corners, each with a quarter of the weight, on a circle.
///
/// Tolerance: 1e-4; one step is a thousandth of the time, and second order.
#[test]
fn a_spinning_cube_is_slowed_by_its_corners() {
    const SPIN_RAD_S: f64 = 10.0;
    let friction = 0.2;
    let mut plant = on_slope(friction, 0.0, 1e-4);
    plant.motion.spin_rad_s.z = SPIN_RAD_S;
    plant.before = velocities(&plant.motion);
    plant.previous = plant.before;
    plant.spin_momentum = plant.now.inertia_kg_m2(&plant.model) * plant.motion.spin_rad_s;
    let inertia = plant.model.object.inertia_kg_m2[(2, 2)];
    let torque_nm = friction * MASS_KG * GRAVITY_M_S2 * SIDE_M / 2f64.square_root();
    let expected_rad = 0.5 * inertia * SPIN_RAD_S * SPIN_RAD_S / torque_nm;
    plant.run(&[], SPIN_RAD_S * inertia / torque_nm + 0.05, |_| {});
    let off = plant.motion().attitude.angle() / expected_rad - 1.0;
    println!("{expected_rad:.4} rad, off by {off:.1e}");
    assert!(off.abs() < 1e-4);
}

/// In the air: linear and angular momentum.
///
/// Tolerance: 1e-10 of themselves after 10,000 steps, which is rounding; the integrator keeps both exactly.
#[test]
fn momentum_is_kept_in_the_air() {
    let mut model = model(no_hand(), object(Polyhedron::cuboid([0.03, 0.05, 0.08]).unwrap(), 0.1));
    model.object_gravity_m_s2 = Vector3::zeros();
    let mut start = at(Vector3::new(0.0, 0.0, 10.0));
    start.velocity_m_s = Vector3::new(0.3, -0.2, 0.1);
    start.spin_rad_s = Vector3::new(1.0, 20.0, -2.0);
    let mut plant = Plant::new(model, world(2, vec![table(0.5)]), start, 1e-3).unwrap();
    let spin_momentum = plant.spin_momentum;
    let mut off: f64 = 0.0;
    plant.run(&[], 10.0, |plant| {
        let motion = plant.motion();
        let angular =
            plant.now.inertia_kg_m2(&plant.model) * Vector3::from_column_slice(&plant.solution.object[3..]);
        off = off.max((angular - spin_momentum).norm() / spin_momentum.norm());
        off = off.max((motion.velocity_m_s - start.velocity_m_s).norm() / start.velocity_m_s.norm());
    });
    println!("off by {off:.1e}");
    assert!(off < 1e-10);
}

/// Largest change of energy that the flows do not explain, in units of the largest energy, from the first whole step on.
fn imbalance(plant: &mut Plant, time_s: f64) -> [f64; 2] {
    let (mut first, mut most, mut least, mut scale) = (None, 0.0f64, 0.0f64, 0.0f64);
    plant.run(&[], time_s, |plant| {
        if !plant.started {
            return;
        }
        let energy_j = plant.half_step_energy_j();
        let work = &plant.work;
        let balance = energy_j + work.dissipated() - work.weight - work.tables;
        let off = balance - *first.get_or_insert(balance);
        (most, least, scale) = (most.max(off), least.min(off), scale.max(energy_j));
    });
    [most / scale, -least / scale]
}

/// A cube that falls on its face, with and without damping.
///
/// Tolerance: 1e-12 of the largest energy, rounding of a few hundred steps.
#[test]
fn a_flat_landing_makes_no_energy() {
    for damping in [0.0, 1.0] {
        for height_m in [1e-3, 0.02] {
            let model = model(no_hand(), cube(MASS_KG));
            let start = at(Vector3::new(0.0, 0.0, 0.5 * SIDE_M + height_m));
            let mut plant = Plant::new(model, world(2, vec![table(0.5)]), start, 5e-4).unwrap();
            plant.surfaces.materials.corner.damping[0] *= damping;
            let [gained, lost] = imbalance(&mut plant, 0.2);
            println!("damping {damping}, from {height_m} m: {gained:.1e} gained, {lost:.1e} lost");
            assert!(gained < 1e-12 && lost < 1e-12);
        }
    }
}

/// A cube that falls on a corner and turns while it bounces.
///
/// Tolerances: none gained but by rounding; what is lost beyond the flows is at most 1e-5 and falls with order 1.9 at least
/// over four halvings, in which the phases of touch even out.
#[test]
fn a_landing_on_a_corner_makes_no_energy() {
    let mut losses = vec![];
    for substep_s in [4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5] {
        let model = model(no_hand(), cube(MASS_KG));
        let material = corner(&model, 4e-4);
        let mut start = at(Vector3::new(0.0, 0.0, 0.05));
        start.attitude = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.5, 0.1));
        start.spin_rad_s = Vector3::new(3.0, -2.0, 4.0);
        let mut plant = Plant::new(model, world(2, vec![table(0.3)]), start, substep_s).unwrap();
        plant.surfaces.materials.corner = material;
        let [gained, lost] = imbalance(&mut plant, 0.3);
        println!("step {substep_s}: {gained:.1e} gained, {lost:.1e} lost {:?}", plant.counters());
        assert!(gained < 1e-12 && lost < 1e-5);
        losses.push(lost);
    }
    assert!(losses[0] > 16f64.powf(1.9) * losses[4]);
}

/// A light cube without damping that falls on its face, at sixteen phases of the step.
///
/// Tolerance: it comes back with 0.97 to 1.00 of its speed. The energy is kept; the last hundredth is that of rounding to the
/// step at which its speed is taken.
#[test]
fn it_rebounds_the_same_in_every_phase_of_the_step() {
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for phase in 0..16 {
        let mut model = model(no_hand(), cube(0.002));
        model.object_gravity_m_s2 = Vector3::zeros();
        const SPEED_M_S: f64 = 0.3;
        let mut start =
            at(Vector3::new(0.0, 0.0, 0.5 * SIDE_M + 0.001 + SPEED_M_S * 1e-3 * f64::from(phase) / 16.0));
        start.velocity_m_s.z = -SPEED_M_S;
        let mut plant = Plant::new(model, world(2, vec![table(0.5)]), start, 1e-3).unwrap();
        plant.surfaces.materials.corner.damping[0] = 0.0;
        plant.run(&[], 0.1, |_| {});
        let share = plant.motion().velocity_m_s.z / SPEED_M_S;
        (least, most) = (least.min(share), most.max(share));
    }
    println!("{least:.6} to {most:.6}");
    assert!(least > 0.97 && most < 1.0 + 1e-9);
}

/// A table that rises, stands, and moves aside carries the cube along; all of its energy comes from the table.
///
/// Tolerances: it is where the table is to 1 um, the depth that it sinks in; kinetic and elastic energy are what flowed in, to
/// 1e-9 of the work.
#[test]
fn a_moving_table_carries_it() {
    let mut plant = on_slope(0.5, 0.0, 5e-4);
    let start_m = plant.motion().position_m;
    let path = |t_s: f64| {
        let part = (t_s / 0.5).clamp(0.0, 1.0);
        let smooth = part * part * part * (10.0 - 15.0 * part + 6.0 * part * part);
        Vector3::new(0.02, -0.01, 0.05) * smooth
    };
    plant.world.tables[0].point_m = Path::new(path);
    let stored_j = |plant: &Plant| plant.kinetic_energy_j() + plant.elastic_energy_j();
    let mut at_start_j = None;
    plant.run(&[], 1.0, |plant| {
        at_start_j.get_or_insert(stored_j(plant));
    });
    let off_m = plant.motion().position_m - start_m - path(1.0);
    let flows = plant.flows();
    let balance_j = stored_j(&plant) - at_start_j.unwrap() + flows.dissipated() - flows.tables - flows.weight;
    println!("off by {:.1e} m, ledger by {balance_j:.1e} J of {:.1e} J", off_m.norm(), flows.tables);
    assert!(off_m.norm() < 1e-6 && balance_j.abs() < 1e-9 * flows.tables);
    let lifted_j = MASS_KG * GRAVITY_M_S2 * 0.05;
    assert!((flows.weight + lifted_j).abs() < 1e-5 * lifted_j);
}

/// Arc tangent, by Newton's method on the tangent.
fn arc_tangent(tangent: f64) -> f64 {
    let mut angle: f64 = 0.5;
    for _ in 0..50 {
        let (sine, cosine) = angle.sine_cosine();
        angle -= (sine / cosine - tangent) * cosine * cosine;
    }
    angle
}
