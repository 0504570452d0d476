//! Everything that can go wrong, mid-grasp, in simulation: is it found, how soon, how soon is the torque gone, and does
//! nothing jump? The tables of docs/safety.md are made here.
//!
//! **Nothing jumps** means, for a fault that takes the torque away ([`falls_off`]):
//! - in the tick that finds it all torques are zero, and stay so; the joints feel it one tick later (the output delay);
//! - before that, no torque changed by more from one tick to the next than in the same run without the fault (where the
//!   fault is one of measuring);
//! - from then on the mechanical energy of hand and object (kinetic, of the squeezed fingertips, of the links' weight)
//!   only falls: whatever moves is moved by what was stored, and by the weight.
//!
//! For the loss of the link, which lets go ([`lets_go`]): force and stiffness fall in equal steps to zero over the release
//! time; no torque changes by more in a tick than two such steps of the largest torque; no torque becomes larger than it
//! was or than the links' weight asks for; then there is none.
//!
//! The simulated world ends when a fingertip leaves the object, a few milliseconds after the torque is gone. What a hand
//! without an object does then is not simulated; its energy is what is measured here.

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::model::Scene;
use blindgrasp::sim::injection::Kind;
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::fault::{Fault, Raised, Reaction};
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::tick::Config;
use blindgrasp_tests::books::true_excess_j;
use blindgrasp_tests::generated;
use blindgrasp_tests::supervised::{
    Course, HEARTBEAT_TICKS, Outcome, Turned, config, friction_energy_j, mechanical_energy_j, push_nm, run,
    run_with, scene,
};
use nalgebra::Vector3;
use std::ops::RangeInclusive;

const DOCUMENT: &str = "docs/safety.md";
/// Something goes wrong while the hand closes, and when everything is at rest.
const INSTANTS: [u64; 2] = [150, 1000];
const JOINTS: usize = 12;

/// The range of no number: what is added to it is all there is.
pub(crate) const NEVER: RangeInclusive<u64> = RangeInclusive::new(u64::MAX, 0);

/// The results of one fault, over all joints and instants.
struct Row {
    fault: Fault,
    what: &'static str,
    scene: &'static str,
    /// From the instant at which it is so, ticks.
    found: RangeInclusive<u64>,
    /// From the tick that found it until the joints have no torque, ticks.
    off: RangeInclusive<u64>,
    /// Fastest joint from then on, while the fingertips touch, rad/s.
    fastest_rad_s: f64,
}

impl Row {
    fn new(fault: Fault, what: &'static str, scene: &'static str) -> Self {
        Self { fault, what, scene, found: NEVER, off: NEVER, fastest_rad_s: 0.0 }
    }

    fn add(&mut self, since: u64, at: u64, ending: &End) {
        widen(&mut self.found, at - since);
        widen(&mut self.off, ending.off);
        self.fastest_rad_s = self.fastest_rad_s.max(ending.fastest_rad_s);
    }
}

/// Takes a number into a range.
pub(crate) fn widen(range: &mut RangeInclusive<u64>, value: u64) {
    *range = value.min(*range.start())..=value.max(*range.end());
}

pub(crate) fn in_words(range: &RangeInclusive<u64>) -> String {
    match (range.start(), range.end()) {
        (least, most) if least == most => least.to_string(),
        (least, most) => format!("{least} to {most}"),
    }
}

/// The course of the torque.
pub(crate) struct End {
    pub(crate) off: u64,
    pub(crate) fastest_rad_s: f64,
}

pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// Fastest joint of the plant in samples from one on, rad/s.
pub(crate) fn fastest_rad_s(outcome: &Outcome, from: u64) -> f64 {
    let samples = outcome.run.samples.iter().skip(from as usize);
    largest(samples.flat_map(|sample| sample.speeds_rad_s.iter().map(|speed| speed.abs())))
}

/// Ticks from the one that found the fault until the joints have no torque.
pub(crate) fn off(outcome: &Outcome, at: u64) -> u64 {
    let without = |torques: &[f64]| torques.iter().all(|&torque| torque == 0.0);
    let samples = &outcome.run.samples[at as usize..];
    let off = samples.iter().position(|sample| without(&sample.torques_nm)).expect("the torque goes");
    assert!(samples[off..].iter().all(|sample| without(&sample.torques_nm)), "the torque comes back");
    off as u64
}

/// Mechanical energy only falls once the torque is gone. The first sub-step without torque still has half of it.
fn energy_falls(scene: &Scene, outcome: &Outcome, from: u64) {
    let energy_j = mechanical_energy_j(scene, outcome, from as usize + 1);
    let first_j = energy_j.first().copied().unwrap_or(0.0);
    for (tick, energy) in energy_j.iter().enumerate() {
        let gained_j = energy - first_j;
        assert!(gained_j <= friction_energy_j(scene) + 1e-9, "{gained_j} J more, {tick} ticks later");
    }
}

/// Largest change of a joint's torque from one tick to the next, N m, in the ticks before one.
pub(crate) fn joint_step_nm(outcome: &Outcome, until: usize, joint: usize) -> f64 {
    let pairs = outcome.turned[..until].windows(2);
    largest(pairs.map(|pair| f64::from((pair[1].torques_nm[joint] - pair[0].torques_nm[joint]).abs())))
}

/// A fault that takes the torque away. `healthy`: the same without the fault, where the fault is one of measuring.
fn falls_off(scene: &Scene, healthy: Option<&Outcome>, outcome: &Outcome, at: u64) -> End {
    let found = at as usize;
    for (tick, turned) in outcome.turned.iter().enumerate().skip(found) {
        assert_eq!(turned.mode, Mode::Fault, "tick {tick}");
        assert!(
            turned.torques_nm.iter().all(|&torque| torque == 0.0),
            "tick {tick}: {:?}",
            turned.torques_nm
        );
    }
    if let Some(healthy) = healthy {
        for joint in 0..scene.joints.len() {
            let (with, without) =
                (joint_step_nm(outcome, found, joint), joint_step_nm(healthy, healthy.turned.len(), joint));
            assert!(
                with <= 1.0001 * without,
                "joint {joint} jumps by {with} N m, without the fault {without}"
            );
        }
    }
    let off = off(outcome, at);
    energy_falls(scene, outcome, at + off);
    End { off, fastest_rad_s: fastest_rad_s(outcome, at + off) }
}

/// The loss of the link: lets go over `ticks`.
fn lets_go(scene: &Scene, outcome: &Outcome, at: u64, ticks: usize) -> End {
    let (found, over) = (at as usize, at as usize + ticks);
    let turned = &outcome.turned;
    let full = turned[found - 1];
    for tick in found..over {
        let (before, now) = (&turned[tick - 1], &turned[tick]);
        assert_eq!(now.mode, Mode::Releasing, "tick {tick}");
        let left = 1.0 - (tick - found + 1) as f32 / ticks as f32;
        assert!(
            (now.gains.grasp[0] - left * full.gains.grasp[0]).abs() < 1e-4
                && now.gains.grasp[0] < before.gains.grasp[0]
        );
        assert!(now.gains.grasp[1] < before.gains.grasp[1]);
    }
    assert_eq!(turned[over - 1].gains.grasp[0], 0.0);
    assert_eq!(turned[over - 1].gains.grasp[1], 0.0);
    let strongest_nm = largest(full.torques_nm.map(|torque| f64::from(torque.abs())));
    for joint in 0..scene.joints.len() {
        let magnitude = |tick: usize| turned[tick].torques_nm[joint].abs();
        // What is left at the end holds the links' weight.
        let most = magnitude(found - 1).max(magnitude(over - 1));
        for tick in found..over {
            let step_nm = turned[tick].torques_nm[joint] - turned[tick - 1].torques_nm[joint];
            assert!(
                f64::from(step_nm.abs()) <= 2.0 * strongest_nm / ticks as f64,
                "joint {joint}: {step_nm} N m in tick {tick}"
            );
            assert!(magnitude(tick) <= most + 1e-3, "joint {joint}, tick {tick}: {} N m", magnitude(tick));
        }
    }
    for turned in &turned[over..] {
        assert_eq!(turned.mode, Mode::Fault);
        assert!(turned.torques_nm.iter().all(|&torque| torque == 0.0));
    }
    let off = off(outcome, at);
    energy_falls(scene, outcome, at + off);
    End { off, fastest_rad_s: fastest_rad_s(outcome, at) }
}

/// A course in which a fault has to be found, of a joint if there is one.
fn found(outcome: &Outcome, fault: Fault, joint: Option<usize>) -> u64 {
    let (at, raised) = outcome.found().unwrap_or_else(|| panic!("{fault:?} of {joint:?} is not found"));
    assert_eq!(raised.fault, fault, "{raised}, joint {joint:?}");
    if let Some(joint) = joint {
        assert_eq!(raised.joint.map(usize::from), Some(joint), "{raised}");
    }
    at
}

/// The same scene with nothing wrong, for a length of time.
fn healthy(name: &str) -> (Scene, Outcome) {
    let scene = scene(name, &["duration_s=1.5"]);
    let outcome = run(&scene, &Course::default());
    assert!(outcome.found().is_none() && outcome.run.summary.grasp_held);
    (scene, outcome)
}

/// Each joint, in both scenes, at both instants.
fn of_each_joint(fault: Fault, what: &'static str, kind: impl Fn(usize) -> Kind) -> Row {
    let mut row = Row::new(fault, what, "cube, prism");
    for name in ["cube", "prism"] {
        let (scene, healthy) = healthy(name);
        for at_tick in INSTANTS {
            for joint in 0..JOINTS {
                let outcome = run(&scene, &Course::fault(at_tick, kind(joint)));
                let at = found(&outcome, fault, Some(joint));
                row.add(at_tick, at, &falls_off(&scene, Some(&healthy), &outcome, at));
            }
        }
    }
    row
}

fn lost_counters() -> Row {
    of_each_joint(Fault::SampleMissing, "a counter does not answer, each joint", |joint| {
        Kind::ReadingLost(Raised::at(joint, Fault::SampleMissing))
    })
}

fn reset_counters() -> Row {
    of_each_joint(Fault::CounterReset, "a counter's settings read back wrong, each joint", |joint| {
        Kind::ReadingLost(Raised::at(joint, Fault::CounterReset))
    })
}

fn failed_outputs() -> Row {
    of_each_joint(Fault::OutputFailed, "an output reads back wrong, each joint", |joint| {
        Kind::ReadingLost(Raised::at(joint, Fault::OutputFailed))
    })
}

/// A jump by a little more than the joint can turn: 185 rad/s and half as much again are 956 counts a tick.
fn jumping_counters() -> Row {
    of_each_joint(Fault::CountJump, "a counter jumps by 1000 counts (0.29 rad), each joint", |joint| {
        Kind::CounterJump { joint, counts: if joint % 2 == 0 { 1000 } else { -1000 } }
    })
}

fn late_ticks() -> Row {
    let mut row = Row::new(Fault::TickLate, "every tick is late", "cube, prism");
    for name in ["cube", "prism"] {
        let (scene, healthy) = healthy(name);
        for at_tick in INSTANTS {
            let outcome = run(&scene, &Course::fault(at_tick, Kind::LateTicks));
            let at = found(&outcome, Fault::TickLate, None);
            row.add(at_tick, at, &falls_off(&scene, Some(&healthy), &outcome, at));
        }
    }
    row
}

fn lost_links(kind: Kind, what: &'static str) -> Row {
    let mut row = Row::new(Fault::LinkLost, what, "cube, prism");
    for name in ["cube", "prism"] {
        let (scene, _) = healthy(name);
        let release_ticks = config(&scene).supervisor.release_ms as usize;
        // Right after a heartbeat, and right before the next: the most and the least that it takes.
        for at_tick in [1, HEARTBEAT_TICKS, 750 + 1, 750 + HEARTBEAT_TICKS] {
            let outcome = run(&scene, &Course::fault(at_tick, kind));
            let at = found(&outcome, Fault::LinkLost, None);
            row.add(at_tick, at, &lets_go(&scene, &outcome, at, release_ticks));
        }
    }
    row
}

/// The cube needs 0.57 N m of a joint and the prism 0.45, and they get less.
fn saturated_torques() -> Row {
    let mut row =
        Row::new(Fault::SaturatedTooLong, "torque limits a little below what the force needs", "cube, prism");
    for (name, limit) in [("cube", "0.56"), ("prism", "0.44")] {
        let scene = scene(name, &["duration_s=2.0", &format!("hand.joint.*.torque_limit_nm={limit}")]);
        let outcome = run(&scene, &Course::default());
        let at = found(&outcome, Fault::SaturatedTooLong, None);
        let joint =
            outcome.found().and_then(|(_, raised)| raised.joint).map(usize::from).expect("of a joint");
        let since = outcome.turned[..at as usize]
            .iter()
            .rposition(|turned| !turned.limiting[joint].contains(Limit::Torque))
            .map_or(0, |tick| tick as u64 + 1);
        row.add(since, at, &falls_off(&scene, None, &outcome, at));
    }
    row
}

/// Somebody bends a finger for half a second, with a torque at its knuckle.
pub(crate) fn bent(at_tick: u64, joint: usize, torque_nm: f32) -> Course {
    let mut push_nm = [0.0; MAX_JOINTS];
    push_nm[joint] = torque_nm;
    Course { pushes: vec![(at_tick..at_tick + 500, push_nm)], ..Course::default() }
}

/// The first sample of which something is true, as a tick.
fn since(outcome: &Outcome, is_so: impl FnMut(&blindgrasp::sim::sample::Sample) -> bool) -> u64 {
    outcome.run.samples.iter().position(is_so).expect("it comes to that") as u64
}

fn bent_fingers() -> Row {
    let mut row = Row::new(Fault::BeyondRange, "somebody bends a finger back with 0.3 N m", "cube, prism");
    for name in ["cube", "prism"] {
        let (scene, _) = healthy(name);
        // What a healthy, pushed hand does about frozen counters is looked at below.
        let mut config = config(&scene);
        config.faults.frozen_ms = None;
        let slack_rad = f64::from(config.faults.range_slack_rad.expect("it is watched"));
        for joint in [1, 5, 9] {
            let course = bent(1000, joint, -0.3);
            let outcome = run_with(&scene, &config, &course);
            let at = found(&outcome, Fault::BeyondRange, Some(joint));
            let (lower_rad, _) = scene.hand.range_rad(joint);
            let since = since(&outcome, |sample| sample.angles_rad[joint] < lower_rad - slack_rad);
            row.add(since, at, &pushed_off(&outcome, &course, at, Mode::Fault));
        }
    }
    row
}

/// As [`falls_off`], while somebody still pushes: energy comes in, and nothing but the push is on the joints.
pub(crate) fn pushed_off(outcome: &Outcome, course: &Course, at: u64, mode: Mode) -> End {
    for turned in &outcome.turned[at as usize..] {
        assert_eq!(turned.mode, mode);
        assert!(turned.torques_nm.iter().all(|&torque| torque == 0.0));
    }
    let alone = |tick: &u64| {
        let mut push_nm = [0.0; MAX_JOINTS];
        // The push comes with the torques, a tick late.
        for (_, torques_nm) in course.pushes.iter().filter(|(ticks, _)| ticks.contains(&(tick - 1))) {
            push_nm = *torques_nm;
        }
        let torques_nm = &outcome.run.samples[*tick as usize].torques_nm;
        torques_nm.iter().zip(push_nm).all(|(&torque, push)| torque == f64::from(push))
    };
    let ticks = at..outcome.run.samples.len() as u64;
    let off = ticks.clone().find(alone).expect("the torque goes");
    assert!((off..ticks.end).all(|tick| alone(&tick)), "the torque comes back");
    End { off: off - at, fastest_rad_s: fastest_rad_s(outcome, off) }
}

fn changed(scene: &Scene, change: impl FnOnce(&mut Config<MAX_JOINTS>)) -> Config<MAX_JOINTS> {
    let mut config = config(scene);
    config.faults.frozen_ms = None;
    change(&mut config);
    config
}

fn fast_joints() -> Row {
    let mut row = Row::new(
        Fault::Overspeed,
        "somebody pushes a finger with 0.3 N m; limit 2 rad/s, as for a first start",
        "cube, prism",
    );
    for name in ["cube", "prism"] {
        let (scene, _) = healthy(name);
        let config = changed(&scene, |config| config.faults.speed_limit_rad_s = Some([2.0; MAX_JOINTS]));
        for joint in [1, 5, 9] {
            let course = bent(1000, joint, -0.3);
            let outcome = run_with(&scene, &config, &course);
            let at = found(&outcome, Fault::Overspeed, None);
            let since = since(&outcome, |sample| sample.speeds_rad_s.iter().any(|speed| speed.abs() > 2.0));
            row.add(since, at, &pushed_off(&outcome, &course, at, Mode::Fault));
        }
    }
    row
}

/// Four times the force that the gains are for: the delay feeds a swing that the damping does not take out. In truth the
/// excess is reckoned from the plant's own turns and the torques that acted.
fn swings_up() -> Row {
    let what = "four times the force: what is fed by the delay swings up";
    let mut row = Row::new(Fault::TooMuchEnergy, what, "cube, prism");
    for name in ["cube", "prism"] {
        let scene = scene(name, &["duration_s=1.5", "control.force_n=20"]);
        let limit_j = f64::from(config(&scene).faults.energy_j.expect("it is watched"));
        let outcome = run(&scene, &Course::default());
        let at = found(&outcome, Fault::TooMuchEnergy, None);
        let so = true_excess_j(&scene, &outcome).iter().position(|&beyond_j| beyond_j > limit_j);
        // Counted turns and the mean of two torques may tell of it a little before.
        let since = so.map_or(at, |since| at.min(since as u64));
        row.add(since, at, &falls_off(&scene, None, &outcome, at));
    }
    row
}

/// A force that only a broken file can have, and nothing that limits it: the torque that the law asks for overflows at once.
fn overflows() -> Row {
    let mut row = Row::new(Fault::NotFinite, "a force of 3e38 N, without limits", "cube");
    let (scene, _) = healthy("cube");
    let config = changed(&scene, |config| {
        config.laws.gains.grasp[0] = 3e38;
        config.limits.gains.grasp[0] = None;
        config.supervisor.soft_start_ms = 0;
    });
    let outcome = run_with(&scene, &config, &Course::default());
    let at = found(&outcome, Fault::NotFinite, None);
    row.add(0, at, &falls_off(&scene, None, &outcome, at));
    row
}

#[test]
fn faults_are_found_and_the_torque_goes() {
    let rows = [
        lost_counters(),
        overflows(),
        jumping_counters(),
        bent_fingers(),
        fast_joints(),
        saturated_torques(),
        reset_counters(),
        failed_outputs(),
        lost_links(Kind::LinkCut, "the link is cut"),
        lost_links(Kind::HeartbeatStops, "the heartbeat stops, commands still arrive"),
        late_ticks(),
        swings_up(),
    ];
    for row in &rows {
        println!("{:?} found {:?} off {:?} fastest {}", row.fault, row.found, row.off, row.fastest_rad_s);
    }
    let lines: Vec<[String; 6]> = rows
        .iter()
        .map(|row| {
            [
                row.fault.number().to_string(),
                row.what.to_owned(),
                row.scene.to_owned(),
                in_words(&row.found),
                in_words(&row.off),
                format!("{:.1}", row.fastest_rad_s),
            ]
        })
        .collect();
    let head = [
        "fault",
        "what happens",
        "scene",
        "found after, ticks",
        "then without torque after, ticks",
        "fastest joint from then on, rad/s",
    ];
    generated::check(DOCUMENT, "measured", &generated::table(head, &lines));

    // What a tick's own reading shows is found in that tick; torque is gone at most 2 ticks later.
    for row in &rows {
        match row.fault.reaction() {
            Reaction::TorqueOff => assert!(*row.off.end() <= 2, "{:?}", row.fault),
            Reaction::Release => assert_eq!(row.off, 301..=301, "{:?}", row.fault),
        }
        if let Fault::SampleMissing
        | Fault::CountJump
        | Fault::CounterReset
        | Fault::OutputFailed
        | Fault::NotFinite = row.fault
        {
            assert_eq!(row.found, 0..=0, "{:?}", row.fault);
        }
    }
}

#[test]
fn the_table_of_faults_is_that_of_the_code() {
    let rows: Vec<[String; 5]> = Fault::ALL
        .iter()
        .map(|fault| {
            let reaction = match fault.reaction() {
                Reaction::TorqueOff => "torque off",
                Reaction::Release => "lets go, then torque off",
            };
            let [number, words] = [fault.number().to_string(), format!("`{fault:?}`: {}", fault.words())];
            let [reaction, found, remedy] = [reaction, fault.found(), fault.remedy()].map(str::to_owned);
            [number, words, reaction, found, remedy]
        })
        .collect();
    let head = ["number", "what is wrong", "what is done", "how it is found, and how soon", "what to do"];
    generated::check(DOCUMENT, "faults", &generated::table(head, &rows));
}

/// Returns the error of each fingertip's force in a tick, against the same grasp without a fault: largest relative
/// difference.
fn force_error(outcome: &Outcome, healthy: &Outcome, tick: usize) -> f64 {
    let forces = |outcome: &Outcome| {
        outcome.run.samples[tick].contacts.iter().map(|c| c.normal_force_n).collect::<Vec<_>>()
    };
    largest(forces(outcome).iter().zip(forces(healthy)).map(|(with, without)| (with / without - 1.0).abs()))
}

/// Counters that freeze where the joints hardly move, or not at all: in each scene, each joint.
fn frozen_in_a_grasp() -> Vec<[String; 3]> {
    let (mut closing, mut resting, mut releasing) = (0, 0, 0);
    let (mut closing_error, mut resting_error): (f64, f64) = (0.0, 0.0);
    for name in ["cube", "prism"] {
        let (scene, healthy) = healthy(name);
        assert_eq!(scene.joints.len(), JOINTS);
        for joint in 0..JOINTS {
            let kind = Kind::CounterFrozen { joint };
            let outcome = run(&scene, &Course::fault(50, kind));
            assert!(outcome.run.summary.grasp_held, "joint {joint}");
            closing += usize::from(outcome.found().is_some());
            closing_error = closing_error.max(force_error(&outcome, &healthy, 1200));

            let mut course = Course::fault(1000, kind);
            course.commands = vec![(1200, Command::Release)];
            let outcome = run(&scene, &course);
            assert!(outcome.found().is_none_or(|(tick, _)| tick > 1200), "nothing moves: the count is right");
            resting_error = resting_error.max(force_error(&outcome, &healthy, 1200));
            resting += 1;
            releasing += usize::from(outcome.found().is_some());
            let armed = outcome.turned.iter().position(|turned| turned.mode == Mode::Armed);
            assert_eq!(armed, Some(1500), "the hand lets go all the same");
            for pair in outcome.turned[1200..1500].windows(2) {
                assert!(pair[1].gains.grasp[0] < pair[0].gains.grasp[0]);
            }
        }
    }
    assert!(closing_error < 0.05 && resting_error < 0.01, "{closing_error}, {resting_error}");
    let row = |situation: &str, found: String, hand: String| [situation.to_owned(), found, hand];
    vec![
        row(
            "freezes while the hand closes, each joint of cube and prism",
            format!("{closing} of 24"),
            format!("the grasp is held, forces off by {:.1} % at most", 100.0 * closing_error),
        ),
        row(
            "freezes at rest",
            format!("0 of {resting}: nothing moves, so that the count is right"),
            format!("the grasp is held, forces off by {:.1} % at most", 100.0 * resting_error),
        ),
        row(
            "freezes at rest, then `Release`",
            format!("{releasing} of 24"),
            "it lets go as without the fault".to_owned(),
        ),
    ]
}

/// Somebody pushes fingertips of a hand at rest, each along and against each axis, for a tenth of a second from tick 800.
fn pushed(scene: &Scene, fingertips: usize, forces_n: &[f64]) -> Vec<Course> {
    let mut courses = Vec::new();
    for fingertip in 0..fingertips {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            for force_n in forces_n.iter().flat_map(|force| [*force, -force]) {
                let push_nm = push_nm(scene, fingertip, axis * force_n);
                courses.push(Course { pushes: vec![(800..900, push_nm)], ..Course::default() });
            }
        }
    }
    courses
}

/// The results of pushed hands.
#[derive(Default)]
struct Pushed {
    /// Hands without a fault whose grasp survives the push, or would, ...
    healthy: usize,
    /// ... those of them in which a frozen counter is seen, ...
    mistaken: usize,
    /// ... and the largest change of a torque in a tick, N m.
    healthy_step_nm: f64,
    /// Hands with a frozen counter, ...
    frozen: usize,
    /// ... and the largest change of a torque in a tick before something is found, N m.
    frozen_step_nm: f64,
    /// Those in which the very counter is found, after how many ticks of pushing.
    right: Vec<u64>,
    /// Those in which another is.
    wrong: usize,
    /// Those with another fault.
    other: usize,
    /// Those with no fault that lose the grasp.
    lost: usize,
}

/// Largest change of a torque from one tick to the next, N m, before a fault is found.
fn step_nm(outcome: &Outcome) -> f64 {
    let until = outcome.found().map_or(outcome.turned.len(), |(at, _)| at as usize);
    let joints = (0..JOINTS).map(|joint| joint_step_nm(outcome, until, joint));
    largest(joints)
}

fn push(name: &str) -> Pushed {
    let scene = scene(name, &["duration_s=1.4"]);
    let unwatched = changed(&scene, |_| {});
    let survives = |course: &Course| {
        let outcome = run_with(&scene, &unwatched, course);
        outcome.run.summary.grasp_held && outcome.found().is_none()
    };
    let is_frozen = |raised: Raised| raised.fault == Fault::CounterFrozen;
    let mut pushed_hands = Pushed::default();
    for course in pushed(&scene, 3, &[0.5, 1.0]) {
        let outcome = run(&scene, &course);
        let mistaken = outcome.found().is_some_and(|(_, raised)| is_frozen(raised));
        pushed_hands.mistaken += usize::from(mistaken);
        if mistaken || outcome.run.summary.grasp_held {
            pushed_hands.healthy += 1;
            pushed_hands.healthy_step_nm = pushed_hands.healthy_step_nm.max(step_nm(&outcome));
        }
    }
    for mut course in pushed(&scene, 1, &[1.0]) {
        if !survives(&course) {
            continue;
        }
        for joint in 0..JOINTS {
            course.injections = Course::fault(700, Kind::CounterFrozen { joint }).injections;
            let outcome = run(&scene, &course);
            pushed_hands.frozen += 1;
            pushed_hands.frozen_step_nm = pushed_hands.frozen_step_nm.max(step_nm(&outcome));
            match outcome.found() {
                Some((at, raised)) if raised == Raised::at(joint, Fault::CounterFrozen) => {
                    pushed_off(&outcome, &course, at, Mode::Fault);
                    pushed_hands.right.push(at - 800);
                }
                Some((_, raised)) if is_frozen(raised) => pushed_hands.wrong += 1,
                Some(_) => pushed_hands.other += 1,
                None => pushed_hands.lost += usize::from(!outcome.run.summary.grasp_held),
            }
        }
    }
    pushed_hands
}

#[test]
fn frozen_counters_in_a_grasp_and_in_a_pushed_hand() {
    let mut rows = frozen_in_a_grasp();
    let hands = std::thread::scope(|scope| {
        let threads = ["cube", "prism"].map(|name| scope.spawn(move || push(name)));
        threads.map(|thread| thread.join().expect("no panic"))
    });
    let sum = |count: fn(&Pushed) -> usize| hands.iter().map(count).sum::<usize>();
    let mut after: Vec<u64> = hands.iter().flat_map(|hand| hand.right.iter().copied()).collect();
    after.sort_unstable();
    let (frozen, right) = (sum(|hand| hand.frozen), after.len());
    let most = |step_nm: fn(&Pushed) -> f64| largest(hands.iter().map(step_nm));
    let (frozen_step_nm, healthy_step_nm) =
        (most(|hand| hand.frozen_step_nm), most(|hand| hand.healthy_step_nm));
    rows.push([
        "freezes at rest, then somebody pushes fingertip 1 with 1 N for 0.1 s, along and against each axis".to_owned(),
        format!(
            "{right} of {frozen} at the joint, {} to {} ticks after the push begins, half of them within {}; {} at another \
             joint; {} end in another fault",
            after[0],
            after[right - 1],
            after[right / 2],
            sum(|hand| hand.wrong),
            sum(|hand| hand.other),
        ),
        format!(
            "of those not found, {} lose the grasp; before it is found no torque changes by more than {frozen_step_nm:.3} N m \
             in a tick ({healthy_step_nm:.3} where nothing freezes)",
            sum(|hand| hand.lost)
        ),
    ]);
    let (healthy, mistaken) = (sum(|hand| hand.healthy), sum(|hand| hand.mistaken));
    rows.push([
        "nothing freezes; somebody pushes any fingertip with 0.5 N or 1 N in the same way".to_owned(),
        format!("**false alarm** in {mistaken} of {healthy}"),
        "the torque goes, the object falls; without the watch the grasp would have survived".to_owned(),
    ]);
    generated::check(
        DOCUMENT,
        "frozen",
        &generated::table(["situation", "found", "what the hand does"], &rows),
    );
    // 5 % of the motors' torque: a joint that is not seen moves the others fast, some into their soft end stops.
    assert!(frozen_step_nm < 0.07, "{frozen_step_nm} N m in a tick");
    assert!(3 * right > frozen, "{right} of {frozen}");
    assert!(50 * mistaken <= 2 * healthy, "{mistaken} false alarms in {healthy} pushed hands");
}

#[test]
fn nothing_is_found_where_nothing_is_wrong() {
    let conditions = [
        "duration_s=2",
        "friction.scale=0.2",
        "friction.scale=3",
        "sensors.noise_counts=1",
        "control.attitude_stiffness_nm=0",
    ];
    let again = Course {
        // The fingertips leave the object some ten ticks after the force is gone.
        commands: vec![(1000, Command::Release), (1301, Command::Grasp(Grasp::CONFIGURED))],
        ..Course::default()
    };
    for name in Scene::built_in() {
        let shipped = scene(name, &[]);
        // Faults are looked for where there are encoders. What is let go falls where it has weight: no second grasp there.
        if shipped.sensors.ideal || shipped.plant.has_friction() {
            continue;
        }
        let forces =
            [0.4, 2.0].map(|factor| format!("control.force_n={}", factor * shipped.control.force_n()));
        for condition in conditions.into_iter().chain(forces.iter().map(String::as_str)) {
            let scene = scene(name, &["duration_s=2", condition]);
            let outcome = run(&scene, &Course::default());
            assert_eq!(outcome.found(), None, "{name}, {condition}");
            assert!(outcome.run.summary.grasp_held, "{name}, {condition}");
        }
        let scene = scene(name, &["duration_s=2"]);
        let outcome = run(&scene, &again);
        assert_eq!(outcome.found(), None, "{name}, a second grasp");
        let last = outcome.turned.last().expect("it ran");
        assert!(last.mode == Mode::Grasping && outcome.run.summary.grasp_held, "{name}: {:?}", last.mode);
    }
    let scene = scene("cube", &["duration_s=60"]);
    let outcome = run(&scene, &Course::default());
    assert!(outcome.found().is_none() && outcome.run.summary.settled, "a minute");
}

/// The work of the joints is told from the torques that were asked for and the turns that were counted: a motor the
/// wrong way round looks like somebody who pushes: the potentials rise, and the excess is nothing. docs/safety.md says
/// so.
#[test]
fn a_reversed_motor_is_not_seen_by_its_work() {
    let scene = scene("cube", &["duration_s=1"]);
    let mut fallen = 0;
    for joint in 0..JOINTS {
        let outcome = run(&scene, &Course { reversed_motors: vec![(500, joint)], ..Course::default() });
        let beyond_j = largest(outcome.turned[500..].iter().map(|turned| f64::from(turned.excess)));
        let limit_j = config(&scene).faults.energy_j.map_or(f64::INFINITY, f64::from);
        assert!(beyond_j < 0.1 * limit_j, "joint {joint}: {beyond_j} J of {limit_j} J");
        assert!(outcome.found().is_none_or(|(_, raised)| raised.fault != Fault::TooMuchEnergy));
        if !outcome.run.summary.grasp_held {
            fallen += 1;
            // What is pushed against rises.
            let potential_j = |turned: &Turned| turned.potentials_j.iter().sum::<f32>();
            let last = outcome.turned.iter().rfind(|turned| turned.mode == Mode::Grasping).expect("it ran");
            assert!(potential_j(last) > potential_j(&outcome.turned[499]), "joint {joint}");
        }
    }
    // All but the abduction of the first finger, which has no torque in this grasp.
    assert_eq!(fallen, JOINTS - 1);
}
