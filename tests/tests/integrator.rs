//! The integrator: its order, the energy that it keeps, and that it stays stable where it is coarse.

use blindgrasp::body::FingertipModel;
use blindgrasp::plant::Motion;
use blindgrasp::plant::integrator::Plant;
use blindgrasp_tests::books::contact_power_w;
use blindgrasp_tests::grasps::{DAMPING_NM_S, FINGERTIP, Grasp, Held, cube, prism};
use blindgrasp_tests::hands::{FINGER_JOINTS, three_finger};
use blindgrasp_tests::numeric::{Errors, order};
use nalgebra::Vector3;

/// The grasp of an object whose mass centre starts off its place, so that the fingertips are pressed in unevenly.
fn grasp(held: &Held, off_m: Vector3<f64>) -> Grasp {
    let mut grasp = Grasp::new(three_finger(), held);
    grasp.start.position_m += off_m;
    grasp
}

/// Positions at every `interval_s`, under the law or under the torques that it had at the start.
fn path(grasp: &Grasp, substep_s: f64, duration_s: f64, interval_s: f64, law: bool) -> Vec<Motion> {
    let mut plant = grasp.plant(substep_s);
    let first = grasp.torques(&plant);
    let steps = |time: f64| (time / substep_s).round() as usize;
    let mut path = vec![];
    for _ in 0..steps(duration_s) / steps(interval_s) {
        let torques = |plant: &Plant| if law { grasp.torques(plant) } else { first };
        grasp.drive(&mut plant, steps(interval_s), torques, |_| {});
        path.push(*plant.motion());
    }
    path
}

/// Largest difference of two paths in joint angles (rad), object position (m) and attitude (rad).
fn distance(a: &[Motion], b: &[Motion]) -> [f64; 3] {
    let mut errors = [Errors::new(); 3];
    for (a, b) in a.iter().zip(b) {
        for (p, q) in a.angles_rad.iter().zip(&b.angles_rad) {
            errors[0].add(p - q);
        }
        errors[1].add((a.position_m - b.position_m).norm());
        // Not the angle from a quaternion's scalar part, which cannot tell small angles.
        errors[2].add(2.0 * (a.attitude.inverse() * b.attitude).imag().norm());
    }
    errors.map(|errors| errors.largest())
}

/// Global error against a run with a step of 6.25 us, at steps of 0.4, 0.2 and 0.1 ms: the largest over all multiples
/// of 0.8 ms of the run, because at one instant errors may cross zero.
///
/// The reference's own error is 1/256 of that at 0.1 ms; it raises the last observed order by 0.004.
///
/// Tolerance: order at least 1.9 in joint angles and in the object's pose.
#[test]
fn the_order_is_two() {
    const REFERENCE_S: f64 = 6.25e-6;
    const INTERVAL_S: f64 = 8e-4;
    for (name, held) in [("cube", cube()), ("prism", prism())] {
        let grasp = grasp(&held, Vector3::zeros());
        // Without the law the grasp is unstable and soon lost.
        for (drive, law, duration_s) in
            [("law at every sub-step", true, 0.2), ("constant torques", false, 0.04)]
        {
            println!("{name}, {drive}, {duration_s} s");
            println!("   step s   angles rad  order  position m  order  attitude rad  order");
            let reference = path(&grasp, REFERENCE_S, duration_s, INTERVAL_S, law);
            let mut coarser: Option<[f64; 3]> = None;
            for h in [4e-4, 2e-4, 1e-4] {
                let errors = distance(&path(&grasp, h, duration_s, INTERVAL_S, law), &reference);
                let orders = coarser.map(|coarser| [0, 1, 2].map(|k| order(coarser[k], errors[k])));
                let [a, b, c] =
                    orders.map_or([const { String::new() }; 3], |orders| orders.map(|o| format!("{o:.2}")));
                println!(
                    "  {h:7.0e}  {:11.2e}  {a:>5}  {:10.2e}  {b:>5}  {:12.2e}  {c:>5}",
                    errors[0], errors[1], errors[2]
                );
                if let Some(orders) = orders {
                    assert!(orders.iter().all(|&order| order > 1.9));
                }
                coarser = Some(errors);
            }
        }
    }
}

/// Power that the dampers take at a solved instant, W: `dq^T C dq + sum(2 T_i + xi (d(dr)/dt)^2)`, Eq. 39 as corrected.
fn dissipation_w(grasp: &Grasp, plant: &Plant) -> f64 {
    let (motion, hand) = (plant.motion(), &grasp.model.hand);
    let mut power = 0.0;
    for (k, speed) in motion.speeds_rad_s.iter().enumerate().take(hand.joint_count()) {
        power += DAMPING_NM_S[k % FINGER_JOINTS] * speed * speed;
    }
    power + contact_power_w(plant)
}

/// The energies of a run.
#[derive(Clone, Copy, Debug)]
struct Ledger {
    /// Largest rise in one step, J.
    rise_j: f64,
    /// Largest error of one step: what energy changed by beyond what the dampers took, J.
    step_error_j: f64,
    /// Error of the whole run, J.
    error_j: f64,
    initial_j: f64,
    final_j: f64,
}

/// Time that torsion takes to forget that it started from rest, s: see [`energy_falls_by_what_the_dampers_take`].
const START_S: f64 = 0.05;

/// Runs for a time; the errors of single steps count from [`START_S`] on.
fn ledger(grasp: &Grasp, substep_s: f64, duration_s: f64) -> Ledger {
    let mut plant = grasp.plant(substep_s);
    let mut ledger = Ledger { rise_j: 0.0, step_error_j: 0.0, error_j: 0.0, initial_j: 0.0, final_j: 0.0 };
    let mut before: Option<(f64, f64)> = None;
    let mut step = 0;
    grasp.run(&mut plant, (duration_s / substep_s).round() as usize, |plant| {
        let (energy, power) = (grasp.energy_j(plant), dissipation_w(grasp, plant));
        assert!(energy.is_finite());
        if let Some((energy_before, power_before)) = before {
            let change = energy - energy_before;
            let error = change + 0.5 * substep_s * (power + power_before);
            ledger.rise_j = ledger.rise_j.max(change);
            ledger.error_j += error;
            if step as f64 * substep_s > START_S {
                ledger.step_error_j = ledger.step_error_j.max(error.abs());
            }
        } else {
            ledger.initial_j = energy;
        }
        ledger.final_j = energy;
        before = Some((energy, power));
        step += 1;
    });
    ledger
}

/// Passivity (Eq. 39, as corrected): with the law at every sub-step the energy of Eq. 40 falls by what the dampers
/// take, and by nothing else.
///
/// The error of a step is `c h^3`, where `c` depends on how violent the motion is: 60 W/s^2 for a grasp that starts
/// with the forces of Eq. 57, and 4e4 W/s^2 where the object starts 0.45 mm off, so that fingertips and object ring
/// at some 100 Hz with a third of the grasping force. Over ten seconds the errors add up to one of second order.
///
/// Tolerances: no step raises the energy by more than `c h^3`; the largest error of a step falls with an order of at
/// least 2.8, that of the run with at least 1.9. The first 50 ms do not count for the error of a step (for rises they
/// do): from rest, torsion reaches its speed within a microsecond, which no step here resolves. The midpoint rule
/// answers with an error that changes its sign with every step (some 1e-10 J) and dies out within about `h^2 / 4`
/// times torsion's rate of 1e6 1/s, 10 ms at the larger step.
#[test]
fn energy_falls_by_what_the_dampers_take() {
    let off = Vector3::new(3e-4, 3e-4, 1.5e-4);
    for (name, held, off_m, c) in [
        ("cube", cube(), Vector3::zeros(), 60.0),
        ("prism", prism(), Vector3::zeros(), 60.0),
        ("cube, 0.45 mm off", cube(), off, 4e4),
        ("prism, 0.45 mm off", prism(), off, 4e4),
    ] {
        let grasp = grasp(&held, off_m);
        let steps_s = [2e-4, 1e-4];
        let [coarse, fine] = steps_s.map(|h| {
            let ledger = ledger(&grasp, h, 10.0);
            println!(
                "{name}, h {h:.0e} s: {:.4} J -> {:.4} J; largest rise {:.1e} J; errors: run {:.1e} J, step {:.1e} J",
                ledger.initial_j, ledger.final_j, ledger.rise_j, ledger.error_j, ledger.step_error_j
            );
            assert!(ledger.rise_j <= c * h * h * h);
            assert!(ledger.step_error_j <= c * h * h * h);
            assert!(ledger.final_j < ledger.initial_j);
            ledger
        });
        let step_order = order(coarse.step_error_j, fine.step_error_j);
        let run_order = order(coarse.error_j.abs(), fine.error_j.abs());
        println!("{name}: orders {step_order:.2} of a step, {run_order:.2} of the run");
        assert!(step_order > 2.8);
        assert!(run_order > 1.9);
    }
}

/// Far too stiff for the step, and still stable: an object of 0.1 g, which makes torsion relax at 4e5 1/s and more,
/// at a step of 0.5 ms. Between fingertips ten times as hard the grasp rings at up to 210 Hz; ten thousand times as
/// hard (and with the torsional viscosity that keeps `b`, whose contact area is so much smaller) at up to 1.2 kHz,
/// where an explicit integrator would need a step below 0.27 ms.
///
/// Tolerance: the energy is never more than a ten-thousandth above the initial one, over twenty seconds, and lower at
/// the end.
#[test]
fn a_light_object_between_hard_fingertips_stays_stable() {
    const STEP_S: f64 = 5e-4;
    for (hardness, torsion, off_m) in [(10.0, 1.0, 1e-4), (1e4, 30.0, 3e-6)] {
        for (name, mut held) in [("cube", cube()), ("prism", prism())] {
            held.mass_kg = 1e-4;
            let fingertip = FingertipModel {
                stiffness_n_m2: hardness * FINGERTIP.stiffness_n_m2,
                torsion_n_s_m: torsion * FINGERTIP.torsion_n_s_m,
                ..FINGERTIP
            };
            let mut grasp = Grasp::with_fingertips(three_finger(), &held, fingertip);
            grasp.start.position_m += Vector3::new(off_m, off_m, 0.5 * off_m);
            let mut plant = grasp.plant(STEP_S);
            let (mut initial, mut largest, mut last) = (None, 0.0_f64, 0.0);
            grasp.run(&mut plant, 40_000, |plant| {
                last = grasp.energy_j(plant);
                assert!(last.is_finite());
                initial.get_or_insert(last);
                largest = largest.max(last);
            });
            let initial = initial.expect("it ran");
            println!(
                "{name}, hardness {hardness:.0e}: {initial:.5} J -> {last:.5} J, at most {:.1e} J above the start",
                largest - initial
            );
            assert!(largest <= initial * 1.0001);
            assert!(last < initial);
        }
    }
}
