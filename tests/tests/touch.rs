//! Touch by joint angles alone: how hard fingertips meet what is not where it was thought to be, how far they move it before all of
//! them touch, how often it is grasped then; and that an empty hand, and one that loses what it holds, say so.

use blindgrasp::model::{Scene, SceneError};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::sample::Sample;
use blindgrasp::sim::summary::Summary;
use blindgrasp_shared::cycle::Notice;
use blindgrasp_tests::random::Draw;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// The outcome of a closing.
struct Touch {
    mass_kg: f64,
    /// The largest force of a fingertip before the grasp began, N.
    force_n: f64,
    /// Way of the object before that, m.
    way_m: f64,
    /// The hand held it to the end.
    is_held: bool,
}

fn noticed(summary: &Summary, notice: Notice) -> Option<f64> {
    summary.noticed.iter().find(|(_, words)| words.ends_with(notice.words())).map(|&(t_s, _)| t_s)
}

/// A scene that begins with the hand somewhere between its postures `open` and `preshape`, and the object moved, which is told to
/// grasp at once.
fn scene(name: &str, draw: &mut Draw, mass_kg: f64, moved: (Vector3<f64>, f64)) -> Result<Scene, SceneError> {
    let mut file = Scene::load(name, &[])?.file;
    let angles = |of: &str| {
        let posture = file.hand.postures.iter().find(|posture| posture.name == of);
        posture.expect("a built-in hand has it").angles_rad.clone()
    };
    let share = draw.within(0.0, 1.0);
    let between = angles("open")
        .iter()
        .zip(angles("preshape"))
        .map(|(open, near)| open + share * (near - open))
        .collect();
    (file.start.posture, file.start.angles_rad) = (None, Some(between));
    file.object.mass_kg = Some(mass_kg);
    for (place, way) in file.pose.position_m.iter_mut().zip(moved.0.iter()) {
        *place += way;
    }
    let mut turn = file.pose.rotation_rpy_rad.unwrap_or_default();
    turn[2] += moved.1;
    file.pose.rotation_rpy_rad = Some(turn);
    file.script.truncate(1);
    file.script[0].order = "grasp".to_owned();
    file.plant.tables[0].moves.clear();
    file.duration_s = 3.0;
    Scene::build(file)
}

/// Closes on an object of a random mass, at a random place. None where the hand would begin in the object.
fn touch(name: &str, draw: &mut Draw) -> Option<Touch> {
    let mass_kg = 0.002 * 100.0_f64.powf(draw.within(0.0, 1.0));
    let moved = Vector3::new(draw.within(-0.015, 0.015), draw.within(-0.015, 0.015), 0.0);
    let turned = draw.within(-20.0, 20.0) * PI / 180.0;
    let scene = scene(name, draw, mass_kg, (moved, turned)).ok()?;
    let run = Simulation::new(&scene).expect("it can be simulated").run();
    let begun_s = noticed(&run.summary, Notice::Touched).unwrap_or(f64::INFINITY);
    let before: Vec<&Sample> = run.samples.iter().take_while(|sample| sample.t_s <= begun_s).collect();
    let first_m = run.samples[0].position_m;
    let forces =
        before.iter().flat_map(|sample| sample.contacts.iter().map(|contact| contact.normal_force_n));
    let is_held = run.summary.grasp_held && noticed(&run.summary, Notice::Holding).is_some();
    if !is_held {
        println!(
            "{name}, {:.0} g, moved by {:.0?} mm, {:.0} deg: {:?}",
            mass_kg * 1e3,
            moved.xy() * 1e3,
            turned * 180.0 / PI,
            run.summary.noticed
        );
    }
    Some(Touch {
        mass_kg,
        force_n: forces.fold(0.0, f64::max),
        way_m: before.last().map_or(0.0, |sample| (sample.position_m - first_m).norm()),
        is_held,
    })
}

fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

/// So many closings of each scene: forces and ways by mass, and the share that is held at the end.
fn closings(count: usize) -> f64 {
    let mut draw = Draw::new(20);
    let mut touches = Vec::new();
    for k in 0.. {
        if touches.len() == count {
            break;
        }
        let name = ["pick-cube", "pick-prism"][k % 2];
        touches.extend(touch(name, &mut draw));
    }
    for (from_g, to_g) in [(2.0, 10.0), (10.0, 50.0), (50.0, 200.0)] {
        let some: Vec<&Touch> =
            touches.iter().filter(|touch| (from_g..to_g).contains(&(touch.mass_kg * 1e3))).collect();
        let (forces, ways) = (
            some.iter().map(|touch| touch.force_n).collect::<Vec<_>>(),
            some.iter().map(|touch| touch.way_m * 1e3).collect::<Vec<_>>(),
        );
        let held = some.iter().filter(|touch| touch.is_held).count();
        println!(
            "{from_g} to {to_g} g: {held} of {} held; force before the last touch {:.2} N (median), {:.2} (95 %), {:.2} (most); way {:.1}, {:.1}, {:.1} mm",
            some.len(),
            quantile(forces.clone(), 0.5),
            quantile(forces.clone(), 0.95),
            quantile(forces, 1.0),
            quantile(ways.clone(), 0.5),
            quantile(ways.clone(), 0.95),
            quantile(ways, 1.0)
        );
    }
    // Fingertips press with F + D v, 0.33 N, while they come to rest; what is pushed onto others by two of them meets these with both.
    assert!(touches.iter().all(|touch| touch.force_n < 1.2));
    touches.iter().filter(|touch| touch.is_held).count() as f64 / count as f64
}

#[test]
fn what_is_not_where_it_was_thought_to_be_is_grasped() {
    let share = closings(24);
    assert!(share >= 0.9, "{share}");
}

#[test]
#[ignore = "500 closings: tests/run all"]
fn at_large_what_is_not_where_it_was_thought_to_be_is_grasped() {
    let share = closings(500);
    assert!(share >= 0.98, "{share}");
}

/// With nothing between the fingertips, every closing ends by saying so, and none begins a grasp.
#[test]
fn an_empty_hand_is_told() {
    let mut draw = Draw::new(21);
    for _ in 0..10 {
        let scene = scene("pick-cube", &mut draw, 0.1, (Vector3::new(0.4, 0.0, 0.0), 0.0)).expect("far away");
        let run = Simulation::new(&scene).expect("it can be simulated").run();
        assert!(noticed(&run.summary, Notice::Empty).is_some(), "{:?}", run.summary.noticed);
        assert!(noticed(&run.summary, Notice::Touched).is_none(), "{:?}", run.summary.noticed);
    }
}

/// The table comes up against what is held, at 0.1 m/s and by 30 mm: the hand is driven up, and holds; the force is bounded by the
/// reach of the frame's pull, its damping, the grasp's friction.
#[test]
fn a_table_that_comes_up_is_borne() {
    let mut file = Scene::load("pick-cube", &[]).expect("built in").file;
    file.script.truncate(2);
    file.plant.tables[0].moves.truncate(1);
    (file.plant.tables[0].moves[0].from_s, file.plant.tables[0].moves[0].for_s) = (3.0, 0.3);
    file.plant.tables[0].moves[0].by_m = [0.0, 0.0, -0.03];
    file.duration_s = 5.0;
    let run = Simulation::new(&Scene::build(file).expect("a scene")).expect("it can be simulated").run();
    let most_n = run.samples.iter().map(|sample| sample.table_force_n().norm()).fold(0.0, f64::max);
    println!(
        "a table that comes up by 30 mm: {:?}, at most {most_n:.1} N on it, {:?}",
        run.summary.outcome, run.summary.noticed
    );
    assert!(run.summary.fault.is_none());
    assert!(most_n < 40.0);
}
