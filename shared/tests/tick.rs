//! The tick as a whole: modes, limits and faults through the one function.

use crate::common;

use blindgrasp_shared::command::{Answer, Command, Grasp, Move, Refusal};
use blindgrasp_shared::cycle::ClosingConfig;
use blindgrasp_shared::event::{Event, Events};
use blindgrasp_shared::fault::{Fault, FaultConfig, Raised};
use blindgrasp_shared::limit::{Limit, LimitConfig};
use blindgrasp_shared::supervisor::{Mode, SupervisorConfig};
use blindgrasp_shared::telemetry::Record;
use blindgrasp_shared::tick::{Config, Input, Output, Params, Sensed, State, tick};
use common::{
    JOINTS, SLEW_NM_S, TORQUE_NM, apart_counts, config, cycle_config, facing_counts, facing_rad, params,
};
use proptest::prelude::*;

type TestParams = Params<12, 3>;
type TestState = State<12, 3>;

const GRASP: Command = Command::Grasp(Grasp::CONFIGURED);

/// A joint could not be read.
fn missing(joint: usize) -> Input<'static, 12> {
    Input::failed(Raised::at(joint, Fault::SampleMissing), None)
}

/// Counts of a hand in a mode: one that closes has room between its fingertips.
fn counts_in(mode: Mode) -> [i32; 12] {
    match mode {
        Mode::Closing | Mode::Carrying | Mode::PuttingDown => apart_counts(),
        _ => facing_counts(),
    }
}

/// Ticks at the facing posture with one command each, then without; returns the last.
fn drive(params: &TestParams, state: &mut TestState, commands: &[Command], ticks: usize) -> Output<12> {
    drive_at(&facing_counts(), params, state, commands, ticks)
}

/// The same at other counts.
fn drive_at(
    counts: &[i32; 12],
    params: &TestParams,
    state: &mut TestState,
    commands: &[Command],
    ticks: usize,
) -> Output<12> {
    for &command in commands {
        let output = tick(params, state, &Input::counts(counts, Some(command)));
        assert_eq!(output.record.answer, Some(Answer { command, refused: None }));
    }
    for _ in 1..ticks {
        tick(params, state, &Input::counts(counts, None));
    }
    tick(params, state, &Input::counts(counts, None))
}

/// Parameters of a hand that comes into a mode: those of all tests, with the stage that leads there.
fn params_for(mode: Mode) -> TestParams {
    let (earlier, cycle) = (config(), cycle_config());
    let mut config = earlier;
    match mode {
        Mode::Moving => config.cycle.moving = cycle.cycle.moving,
        Mode::Closing => config.cycle.closing = cycle.cycle.closing,
        Mode::Carrying | Mode::PuttingDown => {
            (config.laws, config.limits, config.cycle.carrying) =
                (cycle.laws, cycle.limits, cycle.cycle.carrying);
        }
        _ => {}
    }
    params(&config)
}

/// A state that was led into a mode.
fn in_mode(params: &TestParams, mode: Mode) -> TestState {
    let mut state = State::new();
    let commands: &[Command] = match mode {
        Mode::Disarmed | Mode::Fault => &[],
        Mode::Armed => &[Command::Arm],
        Mode::Moving => &[Command::Arm, Command::Posture { posture: None, time_ms: 0 }],
        _ => &[Command::Arm, GRASP],
    };
    drive_at(&counts_in(mode), params, &mut state, commands, 30);
    match mode {
        Mode::Releasing => {
            tick(params, &mut state, &Input::counts(&facing_counts(), Some(Command::Release)));
        }
        Mode::Fault => {
            tick(params, &mut state, &missing(0));
        }
        Mode::Carrying => {
            drive_at(&counts_in(mode), params, &mut state, &[], 80);
        }
        Mode::PuttingDown => {
            drive_at(&counts_in(mode), params, &mut state, &[], 80);
            tick(params, &mut state, &Input::counts(&counts_in(mode), Some(Command::PutDown)));
        }
        _ => {}
    }
    assert_eq!(state.mode(), mode);
    state
}

fn has_torque(output: &Output<12>) -> bool {
    output.torques_nm.iter().any(|&torque| torque != 0.0)
}

#[test]
fn each_mode_drives_as_it_should() {
    for mode in Mode::ALL {
        let params = params_for(mode);
        let mut state = in_mode(&params, mode);
        let output = tick(&params, &mut state, &Input::counts(&counts_in(mode), None));
        let torque = !matches!(mode, Mode::Disarmed | Mode::Fault);
        assert_eq!(has_torque(&output), torque, "{mode:?}");
        let grip = mode.is_grasp();
        assert_eq!(output.record.gains.grasp[0] > 0.0, grip, "{mode:?}");
        assert_eq!(output.record.gains.grasp[1] > 0.0, grip, "{mode:?}");
        assert_eq!(output.record.potentials_j.grasp[0] > 0.0, grip, "{mode:?}");
        assert_eq!(state.latch().is_some(), grip, "{mode:?}");
    }
}

#[test]
fn stop_takes_the_torque_away_within_one_tick_in_every_mode() {
    for mode in Mode::ALL {
        let params = params_for(mode);
        let mut state = in_mode(&params, mode);
        let output = tick(&params, &mut state, &Input::counts(&counts_in(mode), Some(Command::Stop)));
        assert_eq!(output.torques_nm, [0.0; 12], "{mode:?}");
        assert_eq!(output.record.answer, Some(Answer { command: Command::Stop, refused: None }));
        let next = if mode == Mode::Fault { Mode::Fault } else { Mode::Disarmed };
        assert_eq!(output.record.mode, next);
    }
}

#[test]
fn a_fault_takes_the_torque_away_within_one_tick_in_every_mode() {
    for mode in Mode::ALL {
        let params = params_for(mode);
        let mut state = in_mode(&params, mode);
        let output = tick(&params, &mut state, &missing(5));
        assert_eq!((output.record.mode, output.torques_nm), (Mode::Fault, [0.0; 12]), "{mode:?}");
        assert!(state.latch().is_none());
        let output = tick(&params, &mut state, &Input::counts(&counts_in(mode), Some(Command::ClearFault)));
        assert_eq!((output.record.mode, output.torques_nm), (Mode::Disarmed, [0.0; 12]));
        assert_eq!(output.record.fault, None);
    }
}

#[test]
fn attitudes_are_latched_at_the_first_grasping_tick_and_anew_for_each_grasp() {
    let params = params(&config());
    let mut state = in_mode(&params, Mode::Armed);
    let record = tick(&params, &mut state, &Input::counts(&facing_counts(), Some(GRASP))).record;
    assert!(record.potentials_j.grasp[1].abs() < 1e-7, "{}", record.potentials_j.grasp[1]);
    let first = *state.latch().unwrap();
    let mut turned = facing_counts();
    let mut record = record;
    for _ in 0..50 {
        turned[3] += 20;
        record = tick(&params, &mut state, &Input::counts(&turned, None)).record;
    }
    // 1,000 counts are 0.29 rad: 2 K_st (1 - cos a) for each of the fingertip's two neighbours, in a ring of three.
    let expected = 2.0 * 2.0 * 5e-3 * (1.0 - 0.958_0);
    assert!(
        (record.potentials_j.grasp[1] - expected).abs() < 0.1 * expected,
        "{}",
        record.potentials_j.grasp[1]
    );
    let record = tick(&params, &mut state, &Input::counts(&turned, Some(GRASP))).record;
    assert!(record.potentials_j.grasp[1] > 0.0, "a repeated command must not latch anew");
    assert_eq!(state.latch(), Some(&first));
    for command in [Command::Stop, Command::Arm, GRASP] {
        tick(&params, &mut state, &Input::counts(&turned, Some(command)));
    }
    assert_ne!(state.latch(), Some(&first));
}

#[test]
fn force_grows_over_the_soft_start_and_falls_over_the_release() {
    let mut config = config();
    config.laws.gains.integral[0] = 0.25;
    let params = params(&config);
    let mut state = in_mode(&params, Mode::Armed);
    let counts = facing_counts();
    let mut last = tick(&params, &mut state, &Input::counts(&counts, Some(GRASP))).record;
    assert_eq!(last.gains.grasp[0], 5.0 * (1.0_f32 / 100.0));
    for _ in 1..100 {
        let record = tick(&params, &mut state, &Input::counts(&counts, None)).record;
        assert!(record.gains.grasp[0] > last.gains.grasp[0]);
        assert_eq!((record.gains.grasp[1], record.gains.integral[0]), (5e-3, 0.25));
        last = record;
    }
    assert_eq!(last.gains.grasp[0], 5.0);
    let mut last = tick(&params, &mut state, &Input::counts(&counts, Some(Command::Release))).record;
    for _ in 1..100 {
        let record = tick(&params, &mut state, &Input::counts(&counts, None)).record;
        assert!(record.gains.grasp[0] < last.gains.grasp[0] && record.gains.grasp[1] < last.gains.grasp[1]);
        assert!((record.gains.integral[0] - 50.0 * record.gains.grasp[1]).abs() < 1e-6);
        assert_eq!(record.mode, Mode::Releasing);
        last = record;
    }
    assert_eq!((last.gains.grasp[0], last.gains.grasp[1], last.gains.integral[0]), (0.0, 0.0, 0.0));
    let record = tick(&params, &mut state, &Input::counts(&counts, None)).record;
    assert_eq!((record.mode, state.latch()), (Mode::Armed, None));
}

#[test]
fn refused_commands_are_answered_with_the_reason() {
    let params: TestParams = params(&config());
    let mut state = TestState::new();
    let record = tick(&params, &mut state, &Input::counts(&facing_counts(), Some(GRASP))).record;
    let answer = Answer { command: GRASP, refused: Some(Refusal::NotArmed) };
    assert_eq!((record.answer, record.mode), (Some(answer), Mode::Disarmed));
}

#[test]
fn each_limit_shows_in_the_record() {
    let mut config = config();
    config.laws.gains.grasp[0] = 500.0;
    config.supervisor.soft_start_ms = 0;
    let params = params(&config);
    let mut state = in_mode(&params, Mode::Armed);
    let seen = |output: &Output<12>, limit| output.record.limiting.iter().any(|l| l.contains(limit));
    let output = tick(&params, &mut state, &Input::counts(&facing_counts(), Some(GRASP)));
    assert!(seen(&output, Limit::Slew));
    let output = drive(&params, &mut state, &[], 50);
    assert!(seen(&output, Limit::Torque) && !seen(&output, Limit::LowerStop));
    for (sign, limit) in [(1, Limit::UpperStop), (-1, Limit::LowerStop)] {
        let mut state = TestState::new();
        let mut counts = facing_counts();
        counts[0] = sign * 6_600; // 1.92 rad of 2
        tick(&params, &mut state, &Input::counts(&counts, Some(Command::Arm)));
        let output = tick(&params, &mut state, &Input::counts(&counts, None));
        assert!(output.record.limiting.as_slice()[0].contains(limit));
        assert!(!output.record.limiting.as_slice()[4].contains(limit));
    }
}

#[track_caller]
fn faulted(output: &Output<12>, joint: usize, fault: Fault) {
    assert_eq!(output.record.fault, Some(Raised::at(joint, fault)));
    assert_eq!((output.record.mode, output.torques_nm), (Mode::Fault, [0.0; 12]));
    assert!(output.record.limiting.iter().all(|limiting| limiting.is_empty()));
}

#[test]
fn a_missing_sample_is_a_fault() {
    let params = params(&config());
    let mut state = in_mode(&params, Mode::Grasping);
    faulted(&tick(&params, &mut state, &missing(5)), 5, Fault::SampleMissing);
    // The estimator starts anew: where the joint is by then is no jump.
    let mut counts = facing_counts();
    counts[5] += 2_000;
    let record = tick(&params, &mut state, &Input::counts(&counts, Some(Command::ClearFault))).record;
    assert_eq!(record.mode, Mode::Disarmed);
}

#[test]
fn an_impossible_count_is_a_fault() {
    let params = params(&config());
    // 200 rad/s are 687.5 counts a tick; 687 and the rounding of both ends are possible.
    for (jump, fault) in [(689, Fault::CountJump), (-689, Fault::CountJump), (688, Fault::Overspeed)] {
        let mut state = in_mode(&params, Mode::Grasping);
        let mut counts = facing_counts();
        counts[3] += jump;
        faulted(&tick(&params, &mut state, &Input::counts(&counts, None)), 3, fault);
    }
}

#[test]
fn a_joint_beyond_its_range_is_a_fault_that_persists() {
    let params = params(&config());
    let mut state = TestState::new();
    let mut counts = facing_counts();
    counts[10] = 7_100; // 2.065 rad; the range ends at 2, the slack at 2.05
    faulted(&tick(&params, &mut state, &Input::counts(&counts, None)), 10, Fault::BeyondRange);
    let output = tick(&params, &mut state, &Input::counts(&counts, Some(Command::ClearFault)));
    faulted(&output, 10, Fault::BeyondRange);
    assert_eq!(output.record.answer.unwrap().refused, Some(Refusal::FaultPersists));
}

#[test]
fn a_joint_that_turns_too_fast_is_a_fault() {
    let params = params(&config());
    let mut state = in_mode(&params, Mode::Armed);
    let mut counts = facing_counts();
    // 22 rad/s; the limit is 20. The filter needs some ticks to be sure.
    let found = (0..20).position(|_| {
        counts[6] -= 76;
        tick(&params, &mut state, &Input::counts(&counts, None)).record.mode == Mode::Fault
    });
    assert!(found.is_some_and(|ticks| ticks <= 8), "{found:?}");
    assert_eq!(state.fault(), Some(Raised::at(6, Fault::Overspeed)));
}

#[test]
fn a_torque_at_its_limit_for_too_long_is_a_fault() {
    let mut config = config();
    config.laws.gains.grasp[0] = 500.0;
    config.supervisor.soft_start_ms = 0;
    config.limits.slew_nm_s = None;
    let params = params(&config);
    let mut state = in_mode(&params, Mode::Armed);
    tick(&params, &mut state, &Input::counts(&facing_counts(), Some(GRASP)));
    let record = drive(&params, &mut state, &[], 199).record;
    assert_eq!(record.mode, Mode::Grasping);
    let output = drive(&params, &mut state, &[], 1);
    assert_eq!(output.record.fault.map(|raised| raised.fault), Some(Fault::SaturatedTooLong));
    assert_eq!((output.record.mode, output.torques_nm), (Mode::Fault, [0.0; 12]));
    let record = drive(&params, &mut state, &[Command::ClearFault], 1).record;
    assert_eq!(record.mode, Mode::Disarmed);
}

#[test]
fn what_is_not_finite_is_a_fault_and_never_a_torque() {
    let ideal = Config { limits: LimitConfig::NONE, faults: FaultConfig::LEAST, ..config() };
    for config in [config(), ideal] {
        let params: TestParams = params(&config);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for (bad_angle, bad_speed) in [(bad, 0.0), (0.0, bad)] {
                let mut state = in_mode(&params, Mode::Grasping);
                let (mut angles, mut speeds) = (facing_rad(), [0.0; 12]);
                angles[8] += bad_angle;
                speeds[8] += bad_speed;
                let output = tick(&params, &mut state, &Input::ideal(&angles, &speeds, None));
                faulted(&output, 8, Fault::NotFinite);
                let (angles, clear) = (facing_rad(), Some(Command::ClearFault));
                let output = tick(&params, &mut state, &Input::ideal(&angles, &[0.0; 12], clear));
                assert_eq!(output.record.mode, Mode::Disarmed);
                assert!(
                    drive(&params, &mut state, &[Command::Arm, GRASP], 9)
                        .torques_nm
                        .iter()
                        .all(|t| t.is_finite())
                );
            }
        }
    }
}

#[test]
fn gains_that_overflow_are_a_fault_even_behind_a_torque_limit() {
    let mut config = config();
    config.laws.hold.damping_nm_s[4] = f32::MAX;
    let params: TestParams = params(&config);
    let mut state = in_mode(&params, Mode::Armed);
    let mut speeds = [0.0; 12];
    speeds[4] = 10.0;
    let output = tick(&params, &mut state, &Input::ideal(&facing_rad(), &speeds, None));
    faulted(&output, 4, Fault::NotFinite);
}

#[test]
fn ideal_sensors_and_encoders_differ_by_the_estimator_alone() {
    let params: TestParams = params(&config());
    let (mut with_counts, mut with_angles) = (TestState::new(), TestState::new());
    let mut counts = facing_counts();
    for k in 0..600 {
        counts[k % JOINTS] += (k % 5) as i32 - 2;
        let command = match k {
            5 => Some(Command::Arm),
            20 => Some(GRASP),
            400 => Some(Command::Release),
            _ => None,
        };
        let one = tick(&params, &mut with_counts, &Input::counts(&counts, command));
        let (angles, speeds) = (*with_counts.angles_rad(), *with_counts.speeds_rad_s());
        let other = tick(&params, &mut with_angles, &Input::ideal(&angles, &speeds, command));
        assert_eq!(one.torques_nm, other.torques_nm);
        assert_eq!(other.record.counts.as_slice(), &[]);
        // The ledger's turns are those of the counts, which here are not those of the angles.
        let Record { counts, work_j, excess_j, .. } = one.record;
        assert_eq!(Record { counts, work_j, excess_j, ..other.record }, one.record);
    }
    assert_eq!(with_counts.mode(), Mode::Armed);
}

#[test]
fn records_are_numbered() {
    let params = params(&config());
    let mut state = TestState::new();
    for k in 0..10 {
        let record = tick(&params, &mut state, &Input::counts(&facing_counts(), None)).record;
        assert_eq!((record.sequence, record.tick), (k, k));
        assert_eq!(record.counts.as_slice(), &facing_counts::<12>());
    }
}

#[test]
fn parameters_out_of_range_are_named_with_their_joint() {
    let error = |change: fn(&mut Config<12>)| {
        let mut config = config();
        change(&mut config);
        let error = TestParams::new(common::hand(), &config).unwrap_err();
        (error.parameter.to_string(), error.joint)
    };
    assert_eq!(error(|c| c.period_us = 0), ("period_us".to_owned(), None));
    assert_eq!(error(|c| c.estimator.bandwidth_hz = 0.0), ("estimator.bandwidth_hz".to_owned(), None));
    assert_eq!(
        error(|c| c.estimator.encoders[7].rad_per_count = 0.0),
        ("estimator.rad_per_count".to_owned(), Some(7))
    );
    assert_eq!(error(|c| c.laws.hold.damping_nm_s[7] = -1.0), ("damping_nm_s".to_owned(), Some(7)));
    assert_eq!(
        error(|c| c.limits.torque_nm = Some(with(1.0, 7, 0.0))),
        ("limits.torque_nm".to_owned(), Some(7))
    );
    assert_eq!(
        error(|c| c.limits.slew_nm_s = Some(with(1.0, 7, f32::NAN))),
        ("limits.slew_nm_s".to_owned(), Some(7))
    );
    assert_eq!(
        error(|c| c.limits.stop_margin_rad = Some(with(0.1, 7, 2.1))),
        ("limits.stops.margin_rad".to_owned(), Some(7))
    );
    assert_eq!(
        error(|c| c.limits.stop_stiffness_nm_rad = Some(with(2.0, 7, -1.0))),
        ("limits.stops.stiffness_nm_rad".to_owned(), Some(7))
    );
    assert_eq!(
        error(|c| c.limits.stop_damping_nm_s = Some(with(0.01, 7, f32::INFINITY))),
        ("limits.stops.damping_nm_s".to_owned(), Some(7))
    );
    let name = "faults.possible_speed_rad_s";
    assert_eq!(
        error(|c| c.faults.possible_speed_rad_s = Some(with(1.0, 7, 0.0))),
        (name.to_owned(), Some(7))
    );
    let name = "faults.speed_limit_rad_s";
    assert_eq!(error(|c| c.faults.speed_limit_rad_s = Some(with(1.0, 7, 0.0))), (name.to_owned(), Some(7)));
    assert_eq!(error(|c| c.faults.range_slack_rad = Some(-0.1)), ("faults.range_slack_rad".to_owned(), None));
    assert_eq!(error(|c| c.faults.saturated_ms = Some(u32::MAX)), ("faults.saturated_ms".to_owned(), None));
    let supervisor = SupervisorConfig { release_ms: u32::MAX, ..SupervisorConfig::LEAST };
    let mut config = config();
    config.supervisor = supervisor;
    let told = TestParams::new(common::hand(), &config).unwrap_err().to_string();
    assert_eq!(told, "supervisor.release_ms has to be at most an hour (3600000)");
}

#[test]
fn a_frozen_counter_is_a_fault_once_torque_and_neighbours_change() {
    let params: TestParams = params(&config());
    let mut state = in_mode(&params, Mode::Armed);
    tick(&params, &mut state, &Input::counts(&facing_counts(), Some(GRASP)));
    let mut counts = facing_counts();
    let found = (0..500).find(|&k| {
        // All joints turn, but one tells nothing of it. At rest between, none does.
        for (_, count) in counts.iter_mut().enumerate().filter(|&(joint, _)| joint != 9 && k > 200) {
            *count += 1;
        }
        tick(&params, &mut state, &Input::counts(&counts, None)).record.mode == Mode::Fault
    });
    assert_eq!(state.fault(), Some(Raised::at(9, Fault::CounterFrozen)));
    // 0.03 rad are 103 counts.
    assert!(found.is_some_and(|tick| (304..330).contains(&tick)), "{found:?}");
}

#[test]
fn a_heartbeat_that_stops_lets_go_and_arming_needs_one() {
    let mut config = config();
    config.faults.heartbeat_ms = Some(50);
    let params: TestParams = params(&config);
    let mut state = TestState::new();
    let counts = facing_counts();
    let mut step = |command, alive| {
        let events = Events::NONE.with(Event::Heartbeat, alive);
        tick(&params, &mut state, &Input::counts(&counts, command).with(events)).record
    };
    let refused = step(Some(Command::Arm), false).answer.and_then(|answer| answer.refused);
    assert_eq!(refused, Some(Refusal::NoHeartbeat));
    for command in [Command::Arm, GRASP] {
        assert_eq!(step(Some(command), true).answer, Some(Answer { command, refused: None }));
    }
    for k in 0..200 {
        assert_eq!(step(None, k % 50 == 0).mode, Mode::Grasping);
    }
    // The last was in tick 150.
    assert_eq!(step(None, false).mode, Mode::Grasping);
    let record = step(None, false);
    assert_eq!(record.mode, Mode::Releasing);
    assert_eq!(record.fault, Some(Raised::of_hand(Fault::LinkLost)));
    let mut last_n = 5.0;
    for _ in 1..100 {
        let record = step(None, false);
        assert!(record.mode == Mode::Releasing && record.gains.grasp[0] < last_n);
        last_n = record.gains.grasp[0];
    }
    let record = step(None, false);
    assert_eq!((record.mode, record.gains.grasp[0]), (Mode::Fault, 0.0));
    assert_eq!(record.fault, Some(Raised::of_hand(Fault::LinkLost)));
}

#[test]
fn late_ticks_are_a_fault_and_the_fall_back_clock_does_not_arm() {
    let params: TestParams = params(&config());
    let mut state = in_mode(&params, Mode::Armed);
    let counts = facing_counts();
    let late = Input::counts(&counts, None).with(Events::NONE.with(Event::Late, true));
    for _ in 0..3 {
        assert_eq!(tick(&params, &mut state, &late).record.mode, Mode::Armed);
    }
    let record = tick(&params, &mut state, &late).record;
    assert_eq!(record.fault, Some(Raised::of_hand(Fault::TickLate)));
    assert_eq!(record.late_ticks, 4);
    let mut state = TestState::new();
    let events = Events::NONE.with(Event::FallbackClock, true);
    let arm = Input::counts(&counts, Some(Command::Arm)).with(events);
    let record = tick(&params, &mut state, &arm).record;
    assert_eq!(record.answer.and_then(|answer| answer.refused), Some(Refusal::FallbackClock));
    assert_eq!((record.mode, record.events), (Mode::Disarmed, events));
}

/// A hand without weight and stops, whose ledger may show so much excess.
fn ledger_config(excess_j: f32) -> Config<12> {
    let mut config: Config<12> = config();
    config.laws.hold.gravity_m_s2 = None;
    config.limits.stop_margin_rad = None;
    config.faults = FaultConfig { energy_j: Some(excess_j), ..FaultConfig::LEAST };
    config
}

/// Fingers that close in free air are pulled by the law, which gives what it loses of its potentials: much work, and
/// hardly any excess.
#[test]
fn work_that_the_potentials_give_is_no_fault() {
    let params: TestParams = params(&ledger_config(5e-3));
    let mut state = in_mode(&params, Mode::Grasping);
    let mut counts = facing_counts();
    let mut output = drive(&params, &mut state, &[], 100);
    let first = output.record.clone();
    let potential_j = |record: &Record<12>| record.potentials_j.grasp[0] + record.potentials_j.grasp[1];
    for _ in 0..60 {
        for (count, torque) in counts.iter_mut().zip(output.torques_nm) {
            *count += if torque > 0.0 { 7 } else { -7 };
        }
        output = tick(&params, &mut state, &Input::counts(&counts, None));
        assert_eq!(output.record.fault, None);
    }
    let record = &output.record;
    let (work_j, drop_j) = (record.work_j - first.work_j, potential_j(&first) - potential_j(record));
    println!("work {work_j} J, drop {drop_j} J, damped {} J, excess {} J", record.damped_j, record.excess_j);
    assert!(work_j > 0.02);
    // Torques that are a tick and a half old are those of fingers that are still 3 mrad farther apart, of 50 in all.
    assert!(record.excess_j.abs() < 0.1 * work_j);
    // What fades in 60 ms: 6 % of it.
    assert!((work_j - drop_j - record.excess_j).abs() < 0.06 * record.excess_j.abs() + 1e-4);
}

/// A torque that comes late, here because of the slew limit, feeds a swing: nothing of that comes from the potentials.
#[test]
fn work_beyond_the_potentials_is_a_fault_in_its_tick() {
    let mut config = ledger_config(2e-3);
    config.limits.slew_nm_s = Some([1.0; 12]);
    let params: TestParams = params(&config);
    let mut state = in_mode(&params, Mode::Grasping);
    drive(&params, &mut state, &[], 200);
    let mut last_j = 0.0;
    for k in 0..2000 {
        // 0.2 rad at 5 Hz, as a triangle.
        let way = (k + 50) % 200;
        let turned = 13 * (if way < 100 { way } else { 200 - way } - 50);
        let counts = facing_counts().map(|count: i32| count + turned);
        let record = tick(&params, &mut state, &Input::counts(&counts, None)).record;
        let over = record.excess_j > 2e-3;
        assert_eq!(record.fault, over.then_some(Raised::of_hand(Fault::TooMuchEnergy)), "tick {k}");
        if over {
            assert!(last_j <= 2e-3 && record.torques_nm.iter().all(|&torque| torque == 0.0));
            // Without torque its cause is gone, and the next grasp begins with nothing.
            let counts = facing_counts();
            let cleared =
                tick(&params, &mut state, &Input::counts(&counts, Some(Command::ClearFault))).record;
            assert_eq!((cleared.mode, cleared.excess_j), (Mode::Disarmed, 0.0));
            return;
        }
        last_j = record.excess_j;
    }
    panic!("{last_j} J");
}

/// The sums are those since the latch closed, and stay when the torque is gone.
#[test]
fn the_ledger_begins_anew_with_each_grasp() {
    let params: TestParams = params(&ledger_config(1.0));
    let mut state = in_mode(&params, Mode::Armed);
    let mut counts = facing_counts();
    for tick_in_mode in 0..200 {
        counts.iter_mut().for_each(|count| *count += 7 * (1 - 2 * (tick_in_mode / 10 % 2)));
        tick(&params, &mut state, &Input::counts(&counts, None));
    }
    let armed = tick(&params, &mut state, &Input::counts(&counts, None)).record;
    assert!(armed.work_j < 0.0 && armed.damped_j > 0.0, "somebody moves damped joints");
    let grasp = tick(&params, &mut state, &Input::counts(&counts, Some(GRASP))).record;
    assert_eq!((grasp.work_j, grasp.damped_j), (0.0, 0.0));
    for _ in 0..100 {
        counts.iter_mut().for_each(|count| *count += 3);
        tick(&params, &mut state, &Input::counts(&counts, None));
    }
    let last = tick(&params, &mut state, &Input::counts(&counts, Some(Command::Stop))).record;
    assert!(last.work_j != 0.0 && last.damped_j > 0.0 && last.excess_j == 0.0);
    let work_j = last.work_j;
    for _ in 0..100 {
        let rest = tick(&params, &mut state, &Input::counts(&counts, None)).record;
        assert_eq!((rest.work_j, rest.damped_j), (work_j, last.damped_j));
    }
}

/// The force that a reading would have turned the joints by is not there; nor is its work.
#[test]
fn a_failed_reading_does_no_work() {
    let params: TestParams = params(&ledger_config(1.0));
    let mut state = in_mode(&params, Mode::Grasping);
    let mut counts = facing_counts();
    let mut before = drive(&params, &mut state, &[], 100).record;
    for _ in 0..5 {
        counts.iter_mut().for_each(|count| *count += 7);
        before = tick(&params, &mut state, &Input::counts(&counts, None)).record;
    }
    let failed = tick(&params, &mut state, &missing(3)).record;
    assert_eq!(failed.work_j, before.work_j);
}

#[test]
fn a_grasp_is_as_firm_as_asked_for_within_the_limits() {
    let params: TestParams = params(&config());
    let grasp = |force, stiffness, integral| {
        let mut grasp = Grasp::CONFIGURED;
        (grasp.gains.grasp, grasp.gains.integral) = ([force, stiffness], [integral]);
        Command::Grasp(grasp)
    };
    let counts = facing_counts();
    let mut state = in_mode(&params, Mode::Armed);
    let refused = |state: &mut TestState, command| {
        let record = tick(&params, state, &Input::counts(&counts, Some(command))).record;
        record.answer.and_then(|answer| answer.refused)
    };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for command in
            [grasp(Some(bad), None, None), grasp(None, Some(bad), None), grasp(None, None, Some(bad))]
        {
            assert_eq!(refused(&mut state, command), Some(Refusal::NotFinite));
        }
    }
    for command in [
        grasp(Some(-0.1), None, None),
        grasp(Some(500.1), None, None),
        grasp(None, Some(0.11), None),
        grasp(None, Some(-1e-9), None),
        grasp(None, None, Some(1.1)),
        grasp(None, None, Some(-1e-9)),
    ] {
        assert_eq!(refused(&mut state, command), Some(Refusal::OutOfRange));
    }
    assert_eq!(state.mode(), Mode::Armed);
    assert_eq!(refused(&mut state, grasp(Some(2.0), Some(0.01), Some(0.5))), None);
    let record = drive(&params, &mut state, &[], 100).record;
    let gains = (record.gains.grasp[0], record.gains.grasp[1], record.gains.integral[0]);
    assert_eq!(gains, (2.0, 0.01, 0.5));
    // The same again is done; other gains would be a lie.
    assert_eq!(refused(&mut state, grasp(Some(2.0), Some(0.01), Some(0.5))), None);
    assert_eq!(refused(&mut state, grasp(Some(2.0), Some(0.01), None)), Some(Refusal::Grasping));
    assert_eq!(refused(&mut state, GRASP), Some(Refusal::Grasping));
    let record = drive(&params, &mut state, &[], 1).record;
    assert_eq!(record.gains.grasp[0], 2.0);
}

/// The same value for all joints but one.
fn with(all: f32, joint: usize, value: f32) -> [f32; 12] {
    let mut values = [all; 12];
    values[joint] = value;
    values
}

/// A step of a random run: counts, or for some joints something absurd, and a command.
fn steps() -> impl Strategy<Value = Vec<([i32; 12], Option<i32>, Option<Command>)>> {
    let walk = proptest::array::uniform12(-40..=40_i32);
    let absurd = proptest::option::weighted(0.01, any::<i32>());
    let command = proptest::option::weighted(0.1, proptest::sample::select(&Command::ALL[..]));
    proptest::collection::vec((walk, absurd, command), 1..400)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn whatever_comes_torques_stay_within_their_limits(steps in steps(), start in -(1_i32 << 24)..=1 << 24, relaxed in any::<bool>()) {
        let mut config = config();
        config.laws.gains.grasp[0] = 200.0;
        for encoder in &mut config.estimator.encoders {
            encoder.zero_count = start;
        }
        if relaxed {
            config.faults = FaultConfig::LEAST;
        }
        let params: TestParams = params(&config);
        let mut state = TestState::new();
        let mut counts = facing_counts::<12>().map(|count| count.wrapping_add(start));
        let mut last = [0.0_f32; 12];
        for (walk, absurd, command) in steps {
            for (count, walk) in counts.iter_mut().zip(walk) {
                *count = count.wrapping_add(walk);
            }
            if let Some(absurd) = absurd {
                counts[3] = absurd;
            }
            let output = tick(&params, &mut state, &Input::counts(&counts, command));
            let off = matches!(output.record.mode, Mode::Disarmed | Mode::Fault);
            for (torque, last) in output.torques_nm.into_iter().zip(last) {
                prop_assert!(torque.abs() <= TORQUE_NM as f32);
                // Either off, or within the slew limit, up to the rounding of a sum.
                let steady = (torque - last).abs() <= 1e-3 * SLEW_NM_S as f32 + 1e-6;
                prop_assert!(steady && !off || torque == 0.0);
            }
            prop_assert_eq!(output.record.answer.map(|answer| answer.command), command);
            prop_assert_eq!(output.record.fault.is_some(), output.record.mode == Mode::Fault);
            last = output.torques_nm;
        }
    }

    #[test]
    fn whatever_angles_come_no_torque_is_not_finite(
        angles in proptest::array::uniform12(any::<f32>()),
        speeds in proptest::array::uniform12(any::<f32>()),
        scale in 0.0_f32..1.0,
    ) {
        // All floats there are, and tame ones.
        for scale in [1.0, scale * 1e-35] {
            let config = Config { limits: LimitConfig::NONE, faults: FaultConfig::LEAST, ..config() };
            let params: TestParams = params(&config);
            let mut state = in_mode(&params, Mode::Grasping);
            let (angles, speeds) = (angles.map(|a| a * scale), speeds.map(|s| s * scale));
            let output = tick(&params, &mut state, &Input::ideal(&angles, &speeds, None));
            prop_assert!(output.torques_nm.iter().all(|torque| torque.is_finite()));
        }
    }
}

#[test]
fn joints_that_passed_their_self_test_are_cleared_unless_something_else_is_wrong() {
    let params = params(&config());
    let raised = Raised::at(3, Fault::CounterReset);
    let clear = Some(Command::ClearFault);
    let mut counts = facing_counts();
    let mut state = in_mode(&params, Mode::Grasping);
    let mut turn = |counts: &[i32; 12], is_tested: bool, command| {
        let input = Input::failed(raised, command);
        let sensed = if is_tested { Sensed::Tested { raised, counts } } else { input.sensed };
        let Output { torques_nm, powered, record } = tick(&params, &mut state, &Input { sensed, ..input });
        assert_eq!((torques_nm, powered, record.reading_failed), ([0.0; 12], false, Some(raised)));
        assert_eq!(record.counts.as_slice(), if is_tested { &counts[..] } else { &[] });
        (record.mode, record.fault, record.answer.and_then(|answer| answer.refused))
    };
    let (held, persists) = ((Mode::Fault, Some(raised), None), Some(Refusal::FaultPersists));
    // Even tested, they have to fail first.
    assert_eq!(turn(&counts, true, clear), (Mode::Fault, Some(raised), persists));
    assert_eq!(turn(&counts, false, clear), (Mode::Fault, Some(raised), persists));
    assert_eq!(turn(&counts, true, None), held);
    // A joint that would begin beyond its range.
    counts[5] += 30_000;
    assert_eq!(turn(&counts, true, clear), (Mode::Fault, Some(raised), persists));
    counts[5] -= 30_000;
    // Until its speed, which that was too, has faded.
    (0..300).for_each(|_| assert_eq!(turn(&counts, true, None), held));
    assert_eq!(turn(&counts, true, clear), (Mode::Disarmed, None, None));
    // That they are tested is no reading of joints that work.
    assert_eq!(turn(&counts, true, Some(Command::Arm)), (Mode::Fault, Some(raised), Some(Refusal::InFault)));
}

#[test]
fn amplifiers_have_power_and_no_torque_while_they_start() {
    let mut config = config();
    config.supervisor.amplifier_start_ms = 7;
    let (slow, fast) = (params(&config), params(&common::config()));
    let run = |params: &TestParams, ticks: u32| {
        let mut state = State::new();
        let counts = facing_counts();
        let mut outputs = Vec::new();
        for k in 0..ticks {
            let command = [Command::Arm, GRASP].get(k as usize).copied();
            outputs.push(tick(params, &mut state, &Input::counts(&counts, command)));
        }
        outputs
    };
    let (slow, fast) = (run(&slow, 300), run(&fast, 300));
    for outputs in [&slow, &fast] {
        assert!(outputs.iter().all(|output| output.powered));
    }
    assert!(slow[..7].iter().all(|output| !has_torque(output)));
    assert!(has_torque(&fast[0]) && has_torque(&slow[7]));
    assert_eq!((slow[1].record.mode, slow[1].record.gains.grasp[0]), (Mode::Grasping, 0.0));
    // Then the grasp goes on as one that began without waiting, once it has begun with its soft start.
    let force = |output: &Output<12>| output.record.gains.grasp[0];
    assert!(slow[7..].iter().map(force).eq(fast[1..].iter().take(293).map(force)));
}

#[test]
fn a_supply_that_is_too_low_is_a_fault_until_it_is_not() {
    let low = Events::NONE.with(Event::SupplyLow, true);
    for mode in Mode::ALL.into_iter().filter(|&mode| mode != Mode::Fault) {
        let (params, counts) = (params_for(mode), counts_in(mode));
        let mut state = in_mode(&params, mode);
        // It is named before what it brings with it.
        let output = tick(&params, &mut state, &missing(2).with(low));
        assert_eq!((output.powered, output.torques_nm), (false, [0.0; 12]));
        assert_eq!(output.record.fault, Some(Raised::of_hand(Fault::SupplyLow)), "{mode:?}");
        let clear = Input::counts(&counts, Some(Command::ClearFault));
        let refused = |output: &Output<12>| output.record.answer.and_then(|answer| answer.refused);
        assert_eq!(refused(&tick(&params, &mut state, &clear.with(low))), Some(Refusal::FaultPersists));
        assert_eq!(refused(&tick(&params, &mut state, &clear)), None);
    }
}

/// Commands of the cycle that can't be done: each is refused by name, and no torque changes for it.
#[test]
fn commands_of_the_cycle_that_can_not_be_done_are_refused_by_name() {
    let way = Move::default();
    let moving = |position_m: [f32; 3], turn_rad: [f32; 3], time_ms| {
        Command::Move(Move { position_m, turn_rad, time_ms, ..Move::default() })
    };
    let posture = |posture, time_ms| Command::Posture { posture, time_ms };
    let (none, nan) = ([0.0; 3], f32::NAN);
    let mut weak = Grasp::CONFIGURED;
    weak.gains.grasp[0] = Some(0.0);
    let cases = [
        (Mode::Armed, Command::Move(way), Refusal::NotCarrying),
        (Mode::Armed, Command::PutDown, Refusal::NotCarrying),
        (Mode::Armed, Command::Weigh, Refusal::NotCarrying),
        (Mode::Armed, posture(None, 0), Refusal::NoPath),
        (Mode::Disarmed, posture(None, 0), Refusal::NotArmed),
        (Mode::Moving, posture(Some(3), 0), Refusal::NoSuchPosture),
        // With no force fingertips would close, and then hold nothing.
        (Mode::Closing, Command::Grasp(weak), Refusal::OutOfRange),
        (Mode::Moving, Command::Aim { joint: 12, angle_rad: 0.0 }, Refusal::NoSuchJoint),
        (Mode::Moving, Command::Aim { joint: 0, angle_rad: nan }, Refusal::NotFinite),
        // Within the range of 2 rad, but in the end stop's margin.
        (Mode::Moving, Command::Aim { joint: 0, angle_rad: 1.95 }, Refusal::BeyondRange),
        (Mode::Closing, posture(None, 0), Refusal::Closing),
        (Mode::Closing, Command::Arm, Refusal::Closing),
        (Mode::Carrying, posture(None, 0), Refusal::Grasping),
        (Mode::Carrying, moving([nan, 0.0, 0.0], none, 0), Refusal::NotFinite),
        (Mode::Carrying, moving(none, [0.0, f32::INFINITY, 0.0], 0), Refusal::NotFinite),
        (Mode::Carrying, moving([0.06, 0.0, 0.0], none, 0), Refusal::TooFar),
        (Mode::Carrying, moving(none, [0.0, 0.9, 0.0], 0), Refusal::TooFar),
        (Mode::Carrying, moving([0.04, 0.0, 0.0], none, 100), Refusal::TooFast),
        (Mode::Carrying, moving(none, [0.0, 0.5, 0.0], 100), Refusal::TooFast),
        (Mode::PuttingDown, Command::Move(way), Refusal::PuttingDown),
        (Mode::PuttingDown, Command::Weigh, Refusal::PuttingDown),
    ];
    for (mode, command, refusal) in cases {
        let params = params_for(mode);
        let mut state = in_mode(&params, mode);
        let mut other = state.clone();
        let counts = counts_in(mode);
        let output = tick(&params, &mut state, &Input::counts(&counts, Some(command)));
        let refused = output.record.answer.and_then(|answer| answer.refused);
        assert_eq!(refused, Some(refusal), "{mode:?}, {command:?}");
        let without = tick(&params, &mut other, &Input::counts(&counts, None));
        assert_eq!(output.torques_nm, without.torques_nm, "{mode:?}, {command:?}");
        assert_eq!(output.record.mode, without.record.mode, "{mode:?}, {command:?}");
    }
    let mut config = cycle_config();
    config.cycle.closing = ClosingConfig::AT_ONCE;
    config.laws.hold.gravity_m_s2 = None;
    let params = params(&config);
    let mut state = State::new();
    drive_at(&apart_counts(), &params, &mut state, &[Command::Arm, GRASP], 150);
    for command in [Command::Weigh, Command::PutDown] {
        let output = tick(&params, &mut state, &Input::counts(&apart_counts(), Some(command)));
        let refused = output.record.answer.and_then(|answer| answer.refused);
        assert_eq!(refused, Some(Refusal::NoGravity), "{command:?}");
    }
}

/// A grasp that ended in a fault was not let go, and the next arming does not say so.
#[test]
fn a_fault_is_not_told_as_a_release() {
    let params = params_for(Mode::Releasing);
    let (mut state, counts) = (in_mode(&params, Mode::Releasing), counts_in(Mode::Releasing));
    let failed = Raised::at(0, Fault::SampleMissing);
    let output = tick(&params, &mut state, &Input::failed(failed, None));
    assert_eq!(output.record.mode, Mode::Fault);
    for command in [Some(Command::ClearFault), Some(Command::Arm), None, None] {
        let output = tick(&params, &mut state, &Input::counts(&counts, command));
        assert_eq!(output.record.notice, None, "{command:?}");
    }
    assert_eq!(state.mode(), Mode::Armed);
}

/// A million ticks of commands in any order, of joints that shake, in all modes: no torque changes by more than its slew limit, but to
/// nothing where there is to be none; and `Stop` takes it away from everywhere.
#[test]
fn whatever_is_commanded_no_torque_jumps() {
    let params: TestParams = params(&cycle_config());
    let (home, mut counts) = (apart_counts::<12>(), apart_counts::<12>());
    let mut state = State::new();
    let mut last_nm = [0.0_f32; 12];
    let mut random = 1_u64;
    let mut below = |bound: u32| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((random >> 32) as u32) % bound
    };
    let mut ticks_in = [0_u32; 9];
    for _ in 0..1_000_000 {
        for (count, home) in counts.iter_mut().zip(home) {
            *count = home + below(5) as i32 - 2;
        }
        let mut way = || below(200) as f32 * 1e-4 - 0.01;
        let moving = Move {
            position_m: [way(), way(), way()],
            turn_rad: [10.0 * way(), 10.0 * way(), 10.0 * way()],
            about_m: [way(), way(), way()],
            time_ms: 0,
        };
        let time_ms = below(500) as u16;
        let command = match below(4_000) {
            0..40 => Some(Command::Arm),
            40..60 => Some(GRASP),
            60..70 => Some(Command::Posture { posture: None, time_ms: 0 }),
            70..75 => Some(Command::Aim { joint: below(13) as u8, angle_rad: 100.0 * moving.position_m[0] }),
            75..125 => Some(Command::Move(Move { time_ms, ..moving })),
            125..175 => Some(Command::Move(moving)),
            175..178 => Some(Command::PutDown),
            178..181 => Some(Command::Weigh),
            181 => Some(Command::Release),
            182 => Some(Command::Disarm),
            183 => Some(Command::Stop),
            184..224 => Some(Command::ClearFault),
            _ => None,
        };
        let output = tick(&params, &mut state, &Input::counts(&counts, command));
        ticks_in[output.record.mode as usize] += 1;
        if command == Some(Command::Stop) {
            assert!(!output.powered && output.torques_nm == [0.0; 12]);
        }
        let step_nm = SLEW_NM_S as f32 * 1e-3 * 1.0001;
        for (torque, last) in output.torques_nm.iter().zip(&last_nm) {
            let is_off = !output.powered && *torque == 0.0;
            assert!(is_off || (torque - last).abs() <= step_nm, "{:?}", output.record);
        }
        last_nm = output.torques_nm;
    }
    println!("ticks in each mode {ticks_in:?}");
    assert!(ticks_in[..8].iter().all(|&ticks| ticks > 1_000), "{ticks_in:?}");
}

/// The faults that the readings of a tick can bring, in every mode with torque: no torque from that tick on, and the hand can be
/// cleared. In a mode without torque there is nothing to take away.
#[test]
fn every_fault_of_a_reading_takes_the_torque_away_in_every_mode() {
    for mode in Mode::ALL.into_iter().filter(|mode| mode.is_powered()) {
        let (params, counts) = (params_for(mode), counts_in(mode));
        let changed = |by: i32| {
            let mut changed = counts;
            changed[4] += by;
            changed
        };
        let failed = |fault| Input::failed(Raised::at(3, fault), None);
        let angles_rad = *in_mode(&params, mode).angles_rad();
        let (jump, nan) = (changed(30_000), [f32::NAN; 12]);
        let late = Input::counts(&counts, None).with(Events::NONE.with(Event::Late, true));
        for (input, ticks, fault) in [
            (failed(Fault::SampleMissing), 1, Fault::SampleMissing),
            (failed(Fault::CounterReset), 1, Fault::CounterReset),
            (failed(Fault::OutputFailed), 1, Fault::OutputFailed),
            (Input::counts(&jump, None), 1, Fault::CountJump),
            (Input::ideal(&nan, &[0.0; 12], None), 1, Fault::NotFinite),
            (Input::ideal(&[2.5; 12], &[0.0; 12], None), 1, Fault::BeyondRange),
            (Input::ideal(&angles_rad, &[100.0; 12], None), 1, Fault::Overspeed),
            (late, 10, Fault::TickLate),
        ] {
            let mut state = in_mode(&params, mode);
            let mut output = tick(&params, &mut state, &input);
            for _ in 1..ticks {
                output = tick(&params, &mut state, &input);
            }
            let raised = output.record.fault.map(|raised| raised.fault);
            assert_eq!((output.record.mode, raised), (Mode::Fault, Some(fault)), "{mode:?}");
            assert_eq!((output.powered, output.torques_nm), (false, [0.0; 12]), "{mode:?}, {fault:?}");
        }
    }
}
