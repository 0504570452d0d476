//! Scenes with weight, friction and tables: what they are there to show, and their energy.

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::model::Scene;
use blindgrasp::sim::csv;
use blindgrasp::sim::sample::Sample;
use blindgrasp::sim::verdict::Outcome;
use blindgrasp::sim::{Run, Simulation};
use blindgrasp_shared::command::Command;
use blindgrasp_tests::supervised::{self, Course, push_nm, scene};
use std::f64::consts::FRAC_1_SQRT_2;

fn run(name: &str, settings: &[&str]) -> (Scene, Run) {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    let scene = Scene::load(name, &settings).unwrap_or_else(|error| panic!("{error}"));
    let run = Simulation::new(&scene).unwrap_or_else(|error| panic!("{error}")).run();
    (scene, run)
}

fn at(run: &Run, t_s: f64) -> &Sample {
    &run.samples[(t_s * 1e3).round() as usize]
}

/// The most by which stored energy, flows and losses do not fit together, in units of the energy that was exchanged.
fn off(run: &Run) -> f64 {
    let first_j = run.samples[0].energies.stored_j();
    let (mut off_j, mut exchanged_j) = (0.0f64, 0.0f64);
    for now in run.samples.iter().map(|sample| &sample.energies) {
        off_j = off_j.max((now.stored_j() - first_j + now.dissipated_j() - now.given_j()).abs());
        exchanged_j = exchanged_j.max(now.motors_j.abs() + now.weight_j.abs() + now.dissipated_j());
    }
    off_j / exchanged_j
}

/// Grasped on a table that goes away, shaken, and held fast to the end, at rest.
///
/// Tolerances: the ledger closes to 1e-3 of the exchanged energy; when the table is gone it carries nothing; at the end nothing
/// creeps: 1e-9 m/s is a thousandth of what the best of other engines' settings do.
#[test]
fn what_is_grasped_on_a_table_is_held_without_it() {
    for name in
        ["cube-table", "prism-table", "four-finger-cube-table", "allegro-like-prism-table", "brick-allegro"]
    {
        let (_, run) = run(name, &[]);
        let (last, summary) = (run.samples.last().expect("samples"), &run.summary);
        let off = off(&run);
        let creep_m_s = last.velocity_m_s.norm();
        println!(
            "{name}: ledger off by {off:.1e}, {creep_m_s:.1e} m/s at the end, slipped {:?}",
            summary.last.slipped_m
        );
        assert_eq!((summary.outcome, summary.fault.as_ref()), (Outcome::Held, None), "{name}");
        assert!(summary.settled && last.others.is_empty(), "{name}");
        assert!(off < 1e-3 && creep_m_s < 1e-9, "{name}");
    }
}

/// An L, which is not convex, in a hand that looks down: held with its weight, at rest, without creep. With links and without, since
/// none of them is near.
///
/// Tolerances: as above.
#[test]
fn what_is_not_convex_is_held_with_its_weight() {
    let weight = ["plant.contact=\"coulomb\"", "plant.gravity_m_s2=[0.0, 0.0, 9.81]"];
    let (_, run_with) = run("l-bracket", &weight);
    let (_, run_without) = run("l-bracket", &[&weight[..], &["plant.links=false"]].concat());
    let (last, summary) = (run_with.samples.last().expect("samples"), &run_with.summary);
    let creep_m_s = last.velocity_m_s.norm();
    println!(
        "ledger off by {:.1e}, {creep_m_s:.1e} m/s, slipped {:?}",
        off(&run_with),
        summary.last.slipped_m
    );
    assert_eq!((summary.outcome, summary.fault.as_ref()), (Outcome::Held, None));
    assert!(summary.settled && off(&run_with) < 1e-3 && creep_m_s < 1e-9);
    assert_eq!(last.position_m, run_without.samples.last().expect("samples").position_m);
}

/// The object lies on the table, and the whole of its weight on that, where fingertips have no friction.
///
/// Tolerance: 1e-3 of the weight, once it has come to rest on its corners.
#[test]
fn a_table_carries_what_lies_on_it() {
    let (scene, run) = run("cube-table", &["plant.friction=0.0", "duration_s=0.05"]);
    let weight_n = scene.mass_kg * 9.81;
    let carried_n = run.samples.last().expect("samples").table_force_n();
    println!("{:.4} of the weight", -carried_n.z / weight_n);
    assert!((-carried_n.z / weight_n - 1.0).abs() < 1e-3);
}

/// Over the edge of the face and back: at some instant the normal of the contact is none of a face, and in the end it is again.
/// The contact force turns with it and never jumps.
///
/// Tolerance: from one millisecond to the next a normal force changes by less than a tenth of the largest there is.
#[test]
fn a_fingertip_rolls_over_an_edge_and_back() {
    let (_, run) = run("over-an-edge", &[]);
    assert_eq!(run.summary.outcome, Outcome::Held);
    assert!(off(&run) < 1e-3, "{}", off(&run));
    // In the object's frame all faces look along an axis.
    let tilt = |sample: &Sample| {
        let normal = sample.attitude.inverse() * sample.contacts[0].frame.column(1);
        normal.abs().max()
    };
    let most = run.samples.iter().map(tilt).fold(1.0, f64::min);
    println!("the normal is up to {:.1} degrees from the face's", most.acos().to_degrees());
    assert!(most < 0.999 && most > FRAC_1_SQRT_2);
    assert!((tilt(run.samples.last().expect("samples")) - 1.0).abs() < 1e-12);
    let largest_n = run.samples.iter().map(|sample| sample.contacts[0].normal_force_n).fold(0.0, f64::max);
    let jump_n = run
        .samples
        .windows(2)
        .skip(500)
        .map(|pair| (pair[1].contacts[0].normal_force_n - pair[0].contacts[0].normal_force_n).abs());
    let jump_n = jump_n.fold(0.0, f64::max);
    println!("normal force {largest_n:.2} N at most, changes by {jump_n:.3} N in a millisecond at most");
    assert!(jump_n < 0.1 * largest_n);
}

/// Too weak: it slips, and says by how much and which finger; weaker still: it stays on the table; never touched: never grasped.
#[test]
fn a_grasp_that_is_too_weak_is_told() {
    let (_, slipped) = run("too-weak", &[]);
    let most_m = slipped.summary.last.slipped_m.iter().fold(0.0f64, |most, &way_m| most.max(way_m));
    assert_eq!(slipped.summary.outcome, Outcome::Slipped);
    assert!(slipped.summary.grasp_held && most_m > 1e-3, "{most_m}");
    let (_, left) = run("too-weak", &["control.force_n=0.3"]);
    assert_eq!(left.summary.outcome, Outcome::Dropped);
    assert!(!left.summary.grasp_held);
    assert!(left.summary.lost_at_s.is_some_and(|t_s| t_s > 1.0 && t_s < 3.0), "{:?}", left.summary.lost_at_s);
}

/// An open hand over what lies on a table: until a fingertip touches it, the table carries all of it and nothing else presses; whatever
/// the law alone then does with it, which knows no way to close gently, every number of every sample is one.
///
/// Tolerances: 1e-3 of the weight; the ledger's, as above, with a fifth of the step: joints hit each other at 20 rad/s.
#[test]
fn an_open_hand_closes_on_what_it_has_not_touched() {
    for (name, posture) in
        [("pick-cube", "open"), ("pick-cube", "preshape"), ("pick-prism", "open"), ("pick-prism", "preshape")]
    {
        let (scene, run) =
            run(name, &[&format!("start.posture={posture}"), "duration_s=1.0", "plant.substep_s=1e-4"]);
        let presses = |sample: &Sample| sample.contacts.iter().any(|contact| contact.normal_force_n > 0.0);
        let touch = run.samples.iter().position(presses).expect("it is touched");
        let before = &run.samples[..touch];
        println!(
            "{name}, {posture}: touched at {:.3} s, {:?} at {:.3} s, ledger off by {:.1e}",
            run.samples[touch].t_s,
            run.summary.outcome,
            run.summary.duration_s,
            off(&run)
        );
        assert!(touch > 20 && before.iter().all(|sample| sample.contacts.len() == 3));
        assert!(before.iter().flat_map(|sample| &sample.contacts).all(|contact| {
            contact.indentation_m < 0.0 && contact.friction.is_some_and(|friction| friction.slipped_m == 0.0)
        }));
        let carried_n = before[touch - 1].table_force_n();
        assert!((-carried_n.z / (scene.mass_kg * 9.81) - 1.0).abs() < 1e-3, "{carried_n}");
        assert!(off(&run) < 1e-3);
        let mut trace = Vec::new();
        csv::write(&mut trace, &run.samples).expect("in memory");
        let trace = String::from_utf8(trace).expect("text");
        let mut rows = trace.lines().skip(1).map(|row| row.rsplit_once(',').expect("a mode").0);
        assert!(rows.all(|row| row.split(',').all(|cell| cell.parse::<f64>().is_ok_and(f64::is_finite))));
    }
    let (_, waits) = run("pick-cube", &["duration_s=0.02"]);
    assert_eq!((waits.summary.outcome, waits.summary.grasp_held), (Outcome::NeverGrasped, false));
}

/// Picked up from a table and put down on it: the table goes away and comes back under what is held, and the hand lets go and opens,
/// for which somebody leans on its fingers. The same without the way back, or let go before it, drops the object.
#[test]
fn what_is_put_down_is_not_dropped() {
    let opened = |name: &str, moves: &str, let_go_tick: u64| {
        let moves = format!("plant.table.1.move=[{moves}]");
        let scene = scene(
            name,
            &[&moves, "plant.shake=[]", &format!("duration_s={:?}", let_go_tick as f64 * 1e-3 + 0.8)],
        );
        let push_nm = (0..3).map(|finger| {
            let out = scene.start.attitude * scene.contacts[finger].frame.column(1) * -0.2;
            push_nm(&scene, finger, out)
        });
        let push_nm =
            push_nm.fold([0.0; MAX_JOINTS], |sum, push_nm| std::array::from_fn(|k| sum[k] + push_nm[k]));
        let course = Course {
            commands: vec![(let_go_tick, Command::Release)],
            pushes: vec![(let_go_tick + 300..let_go_tick + 340, push_nm)],
            ..Course::default()
        };
        let Run { samples, summary, .. } = supervised::run(&scene, &course).run;
        let pressing = |sample: &Sample| sample.contacts.iter().any(|contact| contact.normal_force_n > 0.0);
        assert!(!samples.last().is_some_and(pressing), "the hand is open");
        println!("{name}, let go at {let_go_tick} ms: {:?} at {:.3} s", summary.outcome, summary.duration_s);
        (summary.outcome, summary.grasp_held)
    };
    let away = "{from_s=0.5,for_s=0.5,by_m=[0.0,0.0,0.1]}";
    let and_back = format!("{away},{{from_s=1.5,for_s=0.5,by_m=[0.0,0.0,-0.0998]}}");
    for name in ["cube-table", "prism-table"] {
        assert_eq!(opened(name, "", 1500), (Outcome::PutDown, true));
        assert_eq!(opened(name, &and_back, 2500), (Outcome::PutDown, true));
        assert_eq!(opened(name, &and_back, 1000), (Outcome::Dropped, false));
        assert_eq!(opened(name, away, 2500), (Outcome::Dropped, false));
    }
}

/// Closed at once, fingertips bounce off the object and come back: that has lost nothing. Without friction the object slips out at
/// last, and is dropped.
#[test]
fn a_fingertip_that_bounces_has_lost_nothing() {
    let (_, bounced) = run("cube-table", &["control.soft_start_s=0.0", "friction.scale=2", "duration_s=3.0"]);
    let touches = |sample: &Sample, finger: usize| sample.contacts[finger].normal_force_n > 0.0;
    let lets_go = |finger: usize| {
        bounced
            .samples
            .windows(2)
            .filter(|pair| touches(&pair[0], finger) && !touches(&pair[1], finger))
            .count()
    };
    let let_go: Vec<usize> = (0..3).map(lets_go).collect();
    println!("fingertips let go {let_go:?} times, {:?}", bounced.summary.outcome);
    assert!(let_go.iter().sum::<usize>() > 0 && bounced.summary.grasp_held);
    let last = bounced.samples.last().expect("samples");
    assert!((0..3).all(|finger| touches(last, finger)));

    let (_, slipped_out) = run("cube-table", &["plant.friction=0.0", "duration_s=3.0"]);
    assert_eq!(slipped_out.summary.outcome, Outcome::Dropped);
}

/// Gravity that turns: a hand that is turned over with what it holds. A controller that is told holds the weight of the links as
/// it did; one that is not holds it the wrong way round, and the hand sinks with what is in it.
///
/// Tolerance: the ledger's, as above. Told, the object comes to be within a millimetre of where it was.
#[test]
fn a_hand_is_turned_over() {
    let moved_m = |told: bool| {
        let turn = format!("plant.turn=[{{from_s=3.0,for_s=2.0,gravity_m_s2=[0.0,0.0,-9.81],told={told}}}]");
        let (_, run) = run("cube-table", &[&turn, "duration_s=7.0"]);
        assert!(run.summary.grasp_held, "{:?}", run.summary.lost_reason);
        assert!(off(&run) < 1e-3, "{}", off(&run));
        (at(&run, 7.0).position_m - at(&run, 2.9).position_m).norm()
    };
    let (told_m, not_told_m) = (moved_m(true), moved_m(false));
    println!(
        "the object moved by {:.2} mm where the controller is told, else by {:.2}",
        told_m * 1e3,
        not_told_m * 1e3
    );
    assert!(told_m < 1e-3 && not_told_m > 0.01);
}

/// The ends of the joints' ranges and the rotors act where fingertips roll too, if the scene asks: without, the ideal cube swings
/// far beyond them.
///
/// Tolerance: 5e-3 rad, by which the soft stops give; a rotor adds its kinetic energy at the same speeds.
#[test]
fn joints_stop_and_rotors_turn_where_a_scene_asks() {
    let beyond_rad = |settings: &[&str]| {
        let (scene, run) = run("cube-ideal", settings);
        let beyond = |sample: &Sample| {
            let each = sample.angles_rad.iter().enumerate().map(|(k, &angle)| {
                let (lower, upper) = scene.hand.range_rad(k);
                (angle - upper).max(lower - angle)
            });
            each.fold(0.0, f64::max)
        };
        run.samples.iter().map(beyond).fold(0.0, f64::max)
    };
    let free = beyond_rad(&["duration_s=12"]);
    let stopped = beyond_rad(&["duration_s=12", "plant.joint_limits=true"]);
    println!("beyond the joints' ranges by {free:.3} rad, with stops by {stopped:.4} rad");
    assert!(free > 0.5 && stopped < 5e-3);

    let kinetic_j = |setting: &str| {
        let (scene, run) = run("cube-ideal", &["duration_s=0.05", setting]);
        let last = run.samples.last().expect("samples");
        let rotors = scene.rotors_kg_m2();
        let of_rotors: f64 =
            rotors.iter().zip(&last.speeds_rad_s).map(|(rotor, speed)| 0.5 * rotor * speed * speed).sum();
        (last.energies.kinetic_j, of_rotors)
    };
    let ((_, none), (all, of_rotors)) = (kinetic_j("plant.rotors=false"), kinetic_j("plant.rotors=true"));
    println!("{of_rotors:.2e} J of {all:.2e} J are the rotors'");
    assert!(none == 0.0 && of_rotors > 0.2 * all && of_rotors < all);
}
