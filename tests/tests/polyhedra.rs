//! The paper's title: an *arbitrary* polyhedral object. Random polyhedra in the paper's own model, with and without `u_st`.

use blindgrasp::scene::Scene;
use blindgrasp::sim::Simulation;
use blindgrasp::sim::summary::Summary;
use blindgrasp_tests::polyhedra::{corners, grasp};
use blindgrasp_tests::random::Draw;
use std::sync::Mutex;
use std::thread;

const OBJECTS: usize = 200;
/// Long enough for a grasp that is going to be lost to be lost, mostly: the cube without `u_st` takes 2.2 s.
const DURATION: &str = "duration_s=5.0";

fn run(scene: &Scene) -> Summary {
    let run = Simulation::new(scene).expect("a scene that was built can be simulated").run(|_| {});
    for sample in &run.samples {
        let speeds = sample.speeds_rad_s.iter().chain(sample.position_m.iter()).chain([&sample.energy_j]);
        assert!(speeds.into_iter().all(|v| v.is_finite()), "not finite at {} s", sample.t_s);
        assert!(sample.contacts.iter().all(|contact| contact.normal_force_n.is_finite()));
    }
    run.summary
}

/// No panic, nothing that is not a number; and the table that the README quotes.
#[test]
fn random_polyhedra_are_grasped() {
    let like = Scene::load("cube-ideal", &[DURATION.to_owned()]).expect("built in").file;
    let mut draw = Draw::new(17);
    // Objects that have three faces that the hand can reach; how many it took to find them is part of the result.
    let mut tried = 0;
    let mut scenes = Vec::new();
    while scenes.len() < OBJECTS {
        tried += 1;
        assert!(tried < 50 * OBJECTS, "hardly any polyhedron is graspable");
        scenes.extend(grasp(&like, corners(&mut draw)));
    }
    let results = Mutex::new(Vec::new());
    let next = Mutex::new(scenes.iter());
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let Some(scene) = next.lock().unwrap().next() else { break };
                    let with = run(scene);
                    let mut file = scene.file.clone();
                    file.control.attitude_stiffness_nm = 0.0;
                    let without = run(&Scene::build(file).expect("the same scene"));
                    results.lock().unwrap().push((with, without));
                }
            });
        }
    });
    let results = results.into_inner().unwrap();
    let share = |held: usize| 100.0 * held as f64 / results.len() as f64;
    let with = results.iter().filter(|(with, _)| with.grasp_held).count();
    let without = results.iter().filter(|(_, without)| without.grasp_held).count();
    let only_without =
        results.iter().filter(|(with, without)| without.grasp_held && !with.grasp_held).count();
    println!("random convex polyhedra: {OBJECTS} graspable of {tried}, 5 s each in the paper's model");
    println!("  held with u_st    {:5.1} %", share(with));
    println!("  held without      {:5.1} %", share(without));
    println!("  held only without {:5.1} %", share(only_without));
    for words in ["lost contact", "rolled off", "dependent", "diverged"] {
        let lost = |s: &Summary| s.lost_reason.as_ref().is_some_and(|reason| reason.contains(words));
        let count = |which: fn(&(Summary, Summary)) -> &Summary| {
            results.iter().map(which).filter(|s| lost(s)).count()
        };
        println!("  {words}: {} with u_st, {} without", count(|pair| &pair.0), count(|pair| &pair.1));
    }
    assert_eq!(results.len(), OBJECTS);
    // What the paper claims, in its weakest form: u_st is there to hold what the normal forces alone do not.
    assert!(with > without, "{with} of {OBJECTS} with u_st, {without} without");
}
