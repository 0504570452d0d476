//! Pushes at the object from outside (`[[plant.push]]`): the books close with its work, and it moves what it should.

use blindgrasp::body::Push;
use blindgrasp::body::dynamics::JointVector;
use blindgrasp::model::Scene;
use blindgrasp::model::file::PushFile;
use blindgrasp::plant::Motion;
use blindgrasp::plant::integrator::Plant;
use blindgrasp::sim::{Simulation, model};
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};

/// The run of a scene whose object is pushed.
fn pushed(name: &str, settings: &[&str], pushes: &[PushFile]) -> blindgrasp::sim::Run {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    let mut file = Scene::load(name, &settings).unwrap_or_else(|error| panic!("{error}")).file;
    file.plant.pushes = pushes.to_vec();
    let scene = Scene::build(file).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(&scene).expect("a plant").run()
}

fn sideways() -> PushFile {
    PushFile { from_s: 0.5, for_s: 0.4, rise_s: 0.1, force_n: [0.2, 0.3, -0.1], moment_nm: [1e-3, 0.0, 2e-3] }
}

/// Work of motors and pushes, stored and dissipated energy: what is left is the integrator's error, as without a push, and
/// shrinks with its second order.
///
/// Tolerance: 1e-3 of the energy exchanged, as for every scene; a quarter with half the step, and a blur of 2^0.2.
#[test]
fn the_books_close_with_the_work_of_a_push() {
    let missed = |substep: &str| {
        let settings = ["duration_s=1.5", "control.period_s=1e-3", substep];
        let run = pushed("cube-ideal", &settings, &[sideways()]);
        assert!(run.summary.grasp_held, "{:?}", run.summary);
        let first = run.samples[0].energies;
        let misses = run.samples.iter().map(|sample| {
            let now = sample.energies;
            let stored = now.stored_j() - first.stored_j();
            (stored + now.dissipated_j() - now.motors_j - now.pushes_j).abs()
        });
        let last = run.samples.last().expect("samples").energies;
        (misses.fold(0.0, f64::max), last.pushes_j)
    };
    let ((coarse, work_j), (fine, _)) = (missed("plant.substep_s=1e-4"), missed("plant.substep_s=5e-5"));
    println!("misses {coarse:.3e} J of {work_j:.3e} J that the push did, {fine:.3e} J with half the step");
    assert!(work_j > 1e-3, "the push did something");
    assert!(coarse < 1e-3 * work_j);
    assert!((coarse / fine).log2() > 1.8, "{}", (coarse / fine).log2());
}

/// An object that nothing holds: its momentum is the impulse, and so is its angular momentum, at whatever step; and the work is
/// what it moves with.
///
/// Tolerance: rounding, 1e-16 of a second in each of up to 3000 steps, of impulses over 50 ms; the attitude, through which the spin
/// is seen, is normalized in each of them. The cube's inertia is the same about every axis, so that the work is as exact.
#[test]
fn a_free_object_takes_the_impulse() {
    let scene = Scene::load("cube", &[]).expect("built in");
    for (substep_s, rise_s) in [(1e-3, 0.0), (3.3e-4, 0.02), (1e-4, 0.05)] {
        let mut free = model(&scene);
        free.faces.clear();
        free.fingertips.clear();
        free.object_gravity_m_s2 = Vector3::zeros();
        let (force_n, moment_nm) = (Vector3::new(0.01, -0.02, 0.03), Vector3::new(1e-6, 2e-6, -3e-6));
        free.pushes = vec![Push { from_s: 0.0123, for_s: 0.1, rise_s, force_n, moment_nm }];
        let (mass_kg, inertia) = (free.object.mass_kg, free.object.inertia_kg_m2);
        let still: JointVector = [0.0; blindgrasp::body::MAX_JOINTS];
        let start = Motion::at_rest(still, scene.start.position_m, scene.start.attitude);
        let mut plant = Plant::new(free, start, substep_s).expect("a plant");
        for _ in 0..(0.3 / substep_s) as usize {
            plant.solve(&still).expect("nothing to lose");
            plant.advance();
        }
        plant.solve(&still).expect("nothing to lose");
        let motion = plant.motion();
        let r: Matrix3<f64> = motion.attitude.to_rotation_matrix().into_inner();
        let momentum = motion.velocity_m_s * mass_kg;
        let spin = r * inertia * r.transpose() * motion.spin_rad_s;
        let effective_s = 0.1 - rise_s;
        let off = (momentum - force_n * effective_s).norm() / force_n.norm();
        let off_spin = (spin - moment_nm * effective_s).norm() / moment_nm.norm();
        println!("step {substep_s} s: off {off:.1e} and {off_spin:.1e}");
        assert!(off < 1e-11 * effective_s && off_spin < 1e-11 * effective_s, "{off} {off_spin}");
        let kinetic_j = 0.5 * (momentum.norm_squared() / mass_kg + motion.spin_rad_s.dot(&spin));
        let work_j = plant.flows().pushes;
        assert!((work_j / kinetic_j - 1.0).abs() < 1e-11, "{work_j} {kinetic_j}");
    }
}

/// Before a push, a run is the same to the bit.
#[test]
fn nothing_happens_before_it() {
    let settings = ["duration_s=0.6"];
    let (with, without) =
        (pushed("cube-ideal", &settings, &[sideways()]), pushed("cube-ideal", &settings, &[]));
    // The step at the instant itself reaches half a step ahead.
    let before = |run: &blindgrasp::sim::Run| run.samples.partition_point(|sample| sample.t_s < 0.5);
    assert_eq!(before(&with), before(&without));
    assert!(with.samples[..before(&with)] == without.samples[..before(&without)], "it is felt too early");
    let apart =
        |k: usize| (with.samples[k].position_m - without.samples[k].position_m).norm_squared().square_root();
    assert!(apart(600) > 1e-4, "{}", apart(600));
}

/// A scene with a push is a file, and is read as one.
#[test]
fn it_is_kept_in_the_effective_scene() {
    let mut file = Scene::load("cube", &[]).expect("built in").file;
    file.plant.pushes = vec![sideways()];
    let scene = Scene::build(file).expect("a scene");
    let text = scene.effective_toml();
    assert!(text.contains("[[plant.push]]"), "{text}");
    let again =
        Scene::parse(&text, "scene.toml", std::path::Path::new(""), &["plant.push.1.for_s=0.5".to_owned()]);
    assert_eq!(again.expect("a scene").plant.pushes[0].for_s, 0.5);
}
