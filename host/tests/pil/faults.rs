//! Faults in a grasp, with the whole device in the loop: alone, and behind a link with its twin.

use super::device::{Firmware, PATIENCE, Wrong};
use blindgrasp::device::client::Client;
use blindgrasp::model::Scene;
use blindgrasp::rig::pil::{Linked, Peer, Pilot, Plan};
use blindgrasp::rig::twin::Twin;
use blindgrasp::sim::injection::{Injection, Kind};
use blindgrasp::sim::sample::Sample;
use blindgrasp::sim::{Run, Simulation};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::Clock;

/// In the middle of the soft start, while everything moves.
const AT: u64 = 100;

fn inject<P: Peer>(scene: &Scene, plan: &Plan, peer: P, kind: Kind) -> (Run, Simulation<Pilot<P>>) {
    let mut simulation = Simulation::with_controller(scene, Pilot::new(plan, peer)).expect("a simulation");
    simulation.inject(Injection { at_tick: AT, kind });
    (simulation.try_run().expect("a run"), simulation)
}

/// Runs it both ways, which have to be one.
fn run(kind: Kind, duration_s: f64) -> Run {
    let scene = Scene::load("cube", &[format!("duration_s={duration_s:?}")]).expect("a scene");
    let plan = Plan::new(&scene).expect("a plan");
    let (alone, _) = inject(&scene, &plan, Twin::new(&plan.hand, Clock::Emulated).expect("a twin"), kind);
    let client = Client::new(Firmware::new(&scene, Wrong::Nothing), PATIENCE);
    let linked = Linked::connect(&plan, client).expect("a firmware");
    let (linked, simulation) = inject(&scene, &plan, linked, kind);
    assert_eq!(simulation.controller().peer().comparison().bits_differ, 0, "{kind:?}");
    assert_eq!(linked.samples, alone.samples, "{kind:?}");
    assert_eq!(linked.first_fault, alone.first_fault, "{kind:?}");
    alone
}

/// The fault, after how many ticks it was found, and that there is no torque from the tick after that.
fn assert_torque_off(kind: Kind, raised: Raised, ticks: std::ops::RangeInclusive<u64>) {
    let run = run(kind, 0.25);
    let (tick, found) = run.first_fault.expect("a fault");
    assert_eq!(found, raised, "{kind:?}");
    assert!(ticks.contains(&(tick - AT)), "{kind:?}: after {} ticks", tick - AT);
    let at = |tick: u64| &run.samples[tick as usize];
    assert_eq!(at(tick).mode, "fault", "{kind:?}");
    assert!(at(tick - 1).torques_nm.iter().any(|&torque| torque != 0.0), "{kind:?}");
    // One tick of delay to the amplifiers.
    assert!(at(tick + 1).torques_nm.iter().all(|&torque| torque == 0.0), "{kind:?}");
}

#[test]
fn a_counter_that_jumps_is_found_in_its_tick() {
    for joint in [0, 5, 11] {
        let kind = Kind::CounterJump { joint, counts: -2000 };
        assert_torque_off(kind, Raised::at(joint, Fault::CountJump), 0..=0);
    }
}

#[test]
fn a_reading_that_fails_is_found_in_its_tick() {
    for raised in [Raised::at(3, Fault::SampleMissing), Raised::at(7, Fault::CounterReset)] {
        assert_torque_off(Kind::ReadingLost(raised), raised, 0..=0);
    }
    let raised = Raised::of_hand(Fault::OutputFailed);
    assert_torque_off(Kind::ReadingLost(raised), raised, 0..=0);
}

#[test]
fn ticks_that_are_always_late_are_found_after_as_many_as_are_allowed() {
    // Three late ticks in a row are allowed.
    assert_torque_off(Kind::LateTicks, Raised::of_hand(Fault::TickLate), 3..=3);
}

/// The last heartbeat before is at most 83 ticks old, and the fault comes 250 ticks after it.
#[test]
fn a_heartbeat_that_stops_lets_the_object_go() {
    for kind in [Kind::HeartbeatStops, Kind::LinkCut] {
        let run = run(kind, 0.4);
        let (tick, found) = run.first_fault.expect("a fault");
        assert_eq!(found, Raised::of_hand(Fault::LinkLost), "{kind:?}");
        assert!((AT + 250 - 83..=AT + 251).contains(&tick), "{kind:?}: in tick {tick}");
        let releasing = &run.samples[tick as usize];
        assert_eq!(releasing.mode, "releasing", "{kind:?}");
        // The force that is asked for falls from tick to tick, and nothing jumps.
        let asked = |sample: &Sample| sample.contacts[0].desired_normal_force_n;
        let falls = run.samples[tick as usize..].windows(2).all(|pair| asked(&pair[1]) < asked(&pair[0]));
        assert!(falls && run.samples.len() as u64 > tick + 20, "{kind:?}");
        for pair in run.samples[tick as usize - 2..].windows(2) {
            for (before, after) in pair[0].torques_nm.iter().zip(&pair[1].torques_nm) {
                assert!((after - before).abs() < 0.02, "{kind:?}: {before} N m to {after} N m");
            }
        }
    }
}

#[test]
#[should_panic(expected = "the hand has 12 joints")]
fn a_joint_that_is_not_there_can_do_nothing() {
    let scene = Scene::load("cube", &[]).expect("a scene");
    let mut simulation = Simulation::new(&scene).expect("a simulation");
    simulation.inject(Injection { at_tick: 0, kind: Kind::CounterFrozen { joint: 12 } });
}
