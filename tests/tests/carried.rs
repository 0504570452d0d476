//! What is carried: moved to where it is asked to be, weighed, pushed, and lost.

use blindgrasp::model::Scene;
use blindgrasp::sim::Simulation;
use blindgrasp::sim::controller::Alone;
use blindgrasp_shared::cycle::Notice;
use blindgrasp_shared::hand::Turn;
use blindgrasp_shared::supervisor::Mode;
use nalgebra::{UnitQuaternion, Vector3};

/// A scene with some settings, whose script is replaced by steps: an order, what it waits for, the time before which it is not done, s.
fn scene(name: &str, settings: &[&str], steps: &[(&str, Option<&str>, f64)]) -> Scene {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    let mut file = Scene::load(name, &settings).expect("a scene").file;
    let step = |&(order, when, at_s): &(&str, Option<&str>, f64)| {
        let mut step = blindgrasp::model::StepFile {
            order: order.to_owned(),
            at_s,
            within_s: 30.0,
            ..Default::default()
        };
        step.when = when.map(str::to_owned);
        step
    };
    file.script = steps.iter().map(step).collect();
    Scene::build(file).expect("a scene")
}

/// Steps through a run to its end, and looks at each tick.
fn watch(scene: &Scene, mut see: impl FnMut(f64, &Simulation<Alone>)) -> blindgrasp::sim::summary::Summary {
    let mut simulation = Simulation::new(scene).expect("it can be simulated");
    while let Ok(Some(step)) = simulation.step() {
        let t_s = step.t_s;
        see(t_s, &simulation);
    }
    simulation.summary()
}

const LIFTED: [(&str, Option<&str>, f64); 2] =
    [("posture preshape", None, 0.0), ("grasp", Some("in-posture"), 0.0)];

/// The arm's joints take part, by 0.2 m and 30 degrees: at rest the frame of the fingertips' centres is there. (Advantage 6 of the paper.)
/// With joints in the fingers alone it is not, uncorrected, by a millimetre and some degrees: fingertips that can't turn along roll, the
/// object turns further than they do, and the pull of `u_s` resists that. There the slow correction makes the *object's* turn right: as the
/// rolling fingertips tell it to 0.01 degrees, and in truth to 1.5.
#[test]
fn what_is_held_goes_where_it_is_asked_to() {
    let way = Vector3::new(-0.1, 0.1, 0.14);
    let arm = [
        "control.frame_stiffness_n_m=300",
        "control.frame_turn_stiffness_nm=3",
        "control.frame_damping_s=0.1",
        "control.frame_turn_damping_s=0.1",
        "control.frame_reach_m=0.05",
        "control.carrying_reach_m=0.3",
        "control.carrying_correction_hz=0",
        "control.carrying_integral_n=0",
        "duration_s=20",
    ];
    let arm = moved("hand-arm-firm", &arm, "move x_mm=-100 y_mm=100 z_mm=140 turn_z_deg=30 time_s=6", way);
    println!("hand-arm-firm: frame off by {:.4} mm, {:.4} deg", arm.off_m * 1e3, arm.frame_deg - 30.0);
    assert!(arm.off_m < 1e-4 && (arm.frame_deg - 30.0).abs() < 0.2);
    for name in ["cube-ideal", "prism-ideal"] {
        let with = |correction: &str| {
            // Touched first, then pressed: so the hand knows by how much its fingertips are pressed in.
            let settings = [
                "start.indentation_m=1e-4",
                "control.soft_start_s=0.2",
                "control.frame_stiffness_n_m=300",
                "control.frame_turn_stiffness_nm=0.3",
                "control.carrying_still_m=0",
                correction,
                "duration_s=30",
            ];
            moved(name, &settings, "move x_mm=20 turn_z_deg=20 time_s=2", Vector3::new(0.02, 0.0, 0.0))
        };
        let Moved { off_m, frame_deg, told_deg, object_deg } = with("control.carrying_correction_hz=0");
        println!(
            "{name}: frame off by {:.3} mm, {:.2} deg; the object turns by {object_deg:.2}, told as {told_deg:.2}",
            off_m * 1e3,
            frame_deg - 20.0
        );
        assert!((told_deg - object_deg).abs() < 1.0);
        let Moved { told_deg, object_deg, .. } = with("control.carrying_correction_hz=1");
        println!("{name}: corrected, the object turns by {object_deg:.2} deg, told as {told_deg:.4}");
        assert!((told_deg - 20.0).abs() < 0.01 && (object_deg - 20.0).abs() < 1.5);
    }
}

/// The end of a movement.
struct Moved {
    /// Distance of the frame of the fingertips' centres from where it was asked to be, m.
    off_m: f64,
    /// By how much that has turned, and the object: as it is told, and in truth, degrees.
    frame_deg: f64,
    told_deg: f64,
    object_deg: f64,
}

/// Moves what a scene holds.
fn moved(name: &str, settings: &[&str], order: &str, way_m: Vector3<f64>) -> Moved {
    let scene = scene(name, settings, &[("grasp", None, 0.0), (order, Some("holding"), 3.0)]);
    let (mut first, mut last, mut held) = (None, None, None);
    watch(&scene, |_, simulation| {
        let attitude = simulation.plant().motion().attitude;
        first.get_or_insert(attitude);
        last = Some(attitude);
        held = Some(*simulation.controller().state().held());
    });
    let (Some(first), Some(last), Some(held)) = (first, last, held) else { panic!("no tick") };
    let turn: UnitQuaternion<f64> = last * first.inverse();
    let told = |turn: &Turn<f32>| 2.0 * f64::from(turn.v.norm()).asin().to_degrees();
    Moved {
        off_m: (held.frame.pose.way_m.map(f64::from) - way_m).norm(),
        frame_deg: told(&held.frame.pose.turn),
        told_deg: told(&held.object.turn),
        object_deg: turn.angle().to_degrees(),
    }
}

/// Weighed by a slow stroke, to 15 g, where it began to be held, and up there.
#[test]
fn weight_is_told() {
    for (name, grams, force_n, up_mm) in [
        ("pick-prism", 2.1, 5.0, 0),
        ("pick-prism", 20.0, 5.0, 0),
        ("pick-prism", 100.0, 5.0, 0),
        ("pick-prism", 100.0, 10.0, 0),
        ("pick-prism", 200.0, 10.0, 0),
        ("pick-prism", 100.0, 5.0, 30),
        ("pick-cube", 100.0, 5.0, 0),
        ("pick-cube", 100.0, 5.0, 15),
    ] {
        let (mass, force) =
            (format!("object.mass_kg={}", grams * 1e-3), format!("control.force_n={force_n}"));
        let up = format!("move z_mm={}", -up_mm);
        let steps = [LIFTED[0], LIFTED[1], (&*up, Some("holding"), 6.0), ("weigh", Some("at-target"), 8.0)];
        let scene = scene(name, &[&mass, &force, "duration_s=12"], &steps);
        let mut weight_n = 0.0;
        let summary = watch(&scene, |_, simulation| {
            weight_n = simulation.controller().record().map_or(0.0, |record| f64::from(record.weight_n));
        });
        assert!(summary.fault.is_none(), "{summary:?}");
        let told = weight_n / 9.81 * 1e3;
        println!("{name}, {grams} g, {force_n} N, {up_mm} mm up: told as {told:.1} g");
        assert!(summary.noticed.iter().any(|(_, words)| words == Notice::Weighed.words()));
        assert!((told - grams).abs() < 15.0, "{grams} g: {told}");
    }
}

const WAYS: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];

/// Pushes 100 g, off its table, for a time with a force along each axis. Returns how many were held, and the time after the push from
/// which on the object was slower than 5 mm/s, at most, s.
fn pushed(name: &str, settings: &[&str], force_n: f64, for_s: f64) -> (usize, f64) {
    let (mut count, mut rest_s) = (0, 0.0_f64);
    for way in WAYS {
        let push = way.map(|axis| axis * force_n);
        let push = format!("plant.push=[{{from_s=6.0,for_s={for_s:?},force_n={push:?}}}]");
        let settings: Vec<&str> = settings.iter().copied().chain([&*push, "duration_s=9"]).collect();
        let scene = scene(name, &settings, &LIFTED);
        let mut moved_s = 0.0;
        let summary = watch(&scene, |t_s, simulation| {
            if simulation.plant().motion().velocity_m_s.norm() > 5e-3 {
                moved_s = t_s;
            }
        });
        let is_held =
            summary.grasp_held && !summary.noticed.iter().any(|(_, words)| words == Notice::Lost.words());
        count += usize::from(is_held);
        if is_held {
            rest_s = rest_s.max(moved_s - 6.0 - for_s);
        }
    }
    (count, rest_s)
}

/// Holding 100 g, 2.5 N for 0.1 s, and 1 N for 1.2 s, in each of six directions, are held.
#[test]
fn pushes_are_held() {
    for name in ["pick-prism", "pick-cube-four-finger"] {
        let (short, short_s) = pushed(name, &[], 2.5, 0.1);
        let (long, long_s) = pushed(name, &[], 1.0, 1.2);
        println!(
            "{name}: 2.5 N for 0.1 s: {short} of 6, at rest after {short_s:.2} s; 1 N for 1.2 s: {long} of 6, {long_s:.2} s"
        );
        assert_eq!((short, long), (6, 6));
        assert!(short_s < 0.5);
    }
}

/// The largest push of 0.1 s that is held in each direction, of 2.5, 5, 7.5 and 10 N.
#[test]
#[ignore = "a table: tests/run all"]
fn at_large_pushes_that_are_held() {
    for name in ["pick-cube", "pick-prism", "pick-cube-four-finger", "pick-prism-allegro"] {
        for force_n in [2.5, 5.0, 7.5, 10.0] {
            let (count, rest_s) = pushed(name, &[], force_n, 0.1);
            println!("{name}: {force_n} N for 0.1 s: {count} of 6 held, at rest after {rest_s:.2} s");
        }
    }
}

/// Torn out of the hand: told within 50 ms after the last fingertip has lost it, and not as a fault.
#[test]
fn what_is_torn_away_is_told() {
    let push = "plant.push=[{from_s=6.0,for_s=0.2,force_n=[0.0,0.0,10.0]}]";
    let scene = scene("pick-prism", &[push, "duration_s=7"], &LIFTED);
    let (mut touched_s, mut told_s, mut carried) = (0.0, None, false);
    let summary = watch(&scene, |t_s, simulation| {
        let presses =
            simulation.plant().fingers().iter().filter(|finger| finger.force.normal_n > 0.0).count();
        if presses >= 2 && told_s.is_none() {
            touched_s = t_s;
        }
        let record = simulation.controller().record();
        carried |= record.is_some_and(|record| record.mode == Mode::Carrying);
        if record.and_then(|record| record.notice).is_some_and(|noticed| noticed.notice == Notice::Lost) {
            told_s = told_s.or(Some(t_s));
        }
    });
    assert!(summary.fault.is_none(), "{summary:?}");
    let told_s = told_s.expect("it is told");
    println!("torn away: told {:.0} ms after two fingertips touched it last", 1e3 * (told_s - touched_s));
    assert!(carried && told_s - touched_s < 0.05);
}
