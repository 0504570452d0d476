//! A state that was saved and loaded goes on as the one that was not, to the bit; and hostile bytes are refused.

use crate::common;

use blindgrasp_shared::bytes::SnapshotError;
use blindgrasp_shared::command::{Command, Grasp, Move};
use blindgrasp_shared::event::{Event, Events};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::Record;
use blindgrasp_shared::telemetry::snapshot::BYTES_PER_JOINT;
use blindgrasp_shared::tick::{Config, Input, Output, Params, State, tick};
use common::{JOINTS, apart_counts, config, cycle_config, facing_counts, params};
use proptest::prelude::*;

type HandState = State<12, 3>;
type HandParams = Params<12, 3>;

/// Linear congruences.
struct Lcg(u64);

impl Lcg {
    fn below(&mut self, bound: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 32) as u32) % bound
    }
}

/// The inputs of a tick.
struct Step {
    counts: [i32; 12],
    failed: Option<Raised>,
    events: Events,
    command: Option<Command>,
}

impl Step {
    fn run(&self, params: &HandParams, state: &mut HandState) -> Output<12> {
        let input = match self.failed {
            None => Input::counts(&self.counts, self.command),
            Some(raised) => Input::failed(raised, self.command),
        };
        tick(params, state, &input.with(self.events))
    }
}

/// Ticks with everything in them: jitter, fast motion, jumps, failed readings, late ticks, pauses of the heartbeat, commands.
/// Those of the whole cycle are drawn only for it, from hands with room between the fingertips.
fn script(seed: u64, ticks: usize, is_cycle: bool) -> Vec<Step> {
    let mut lcg = Lcg(seed);
    let home: [i32; 12] = if is_cycle { apart_counts() } else { facing_counts() };
    let mut counts = home;
    let mut silent = 0_u32;
    (0..ticks)
        .map(|_| {
            for count in counts.iter_mut().take(JOINTS) {
                *count += lcg.below(9) as i32 - 4;
            }
            match lcg.below(if is_cycle { 1500 } else { 150 }) {
                0 => counts = home,
                1 => counts[lcg.below(12) as usize] += 30_000,
                2 => counts[lcg.below(12) as usize] -= 400,
                3 => silent = 60,
                _ => {}
            }
            silent = silent.saturating_sub(1);
            let mut grasp = Grasp::CONFIGURED;
            grasp.gains.integral = [Some(0.01 * lcg.below(3) as f32)];
            grasp.gains.grasp = [Some(lcg.below(16) as f32), None];
            let command = match lcg.below(160) {
                0..10 => Some(Command::Arm),
                10..20 => Some(Command::Grasp(Grasp::CONFIGURED)),
                20..25 => Some(Command::Grasp(grasp)),
                25..40 => Some(Command::ClearFault),
                // The whole cycle takes longer.
                40..44 if is_cycle && lcg.below(8) > 0 => None,
                40..42 => Some(Command::Release),
                42 => Some(Command::Stop),
                43 => Some(Command::Disarm),
                44..46 if is_cycle => Some(Command::Posture { posture: None, time_ms: 100 }),
                46 if is_cycle => Some(Command::Aim { joint: 3, angle_rad: 0.5 }),
                47..50 if is_cycle => {
                    Some(Command::Move(Move { turn_rad: [0.1, 0.2, -0.1], ..Move::default() }))
                }
                50 if is_cycle => Some(Command::Weigh),
                51 if is_cycle => Some(Command::PutDown),
                _ => None,
            };
            if command == Some(Command::ClearFault) {
                counts = home;
            }
            let fault = [Fault::SampleMissing, Fault::CounterReset, Fault::LinkLost][lcg.below(3) as usize];
            Step {
                counts,
                failed: (lcg.below(if is_cycle { 3000 } else { 300 }) == 0)
                    .then(|| Raised::at(lcg.below(12) as usize, fault)),
                events: Events::NONE
                    .with(Event::Heartbeat, silent == 0)
                    .with(Event::Late, lcg.below(30) == 0),
                command,
            }
        })
        .collect()
}

fn hand(mut config: Config<12>) -> HandParams {
    config.faults.heartbeat_ms = Some(30);
    params(&config)
}

fn bytes(record: &Record<12>) -> Vec<u8> {
    let mut buffer = [0; Record::<12>::MOST_BYTES];
    record.encode(&mut buffer).expect("room").to_vec()
}

fn saved(state: &HandState, params: &HandParams) -> Vec<u8> {
    let mut buffer = [0; 12 * BYTES_PER_JOINT];
    state.save(params, &mut buffer).expect("room").to_vec()
}

/// At every tick: saved, loaded, and run to the end beside the one that runs through.
#[test]
fn a_loaded_state_goes_on_to_the_bit_from_every_tick() {
    const AHEAD: usize = 250;
    let (mut modes, mut longest, mut compared) = ([0; 9], 0, 0);
    for seed in 0..6 {
        let is_cycle = seed >= 4;
        let params = hand(if is_cycle { cycle_config() } else { config() });
        let script = script(seed, if is_cycle { 2400 } else { 1200 }, is_cycle);
        let mut state = HandState::new();
        let mut records = Vec::new();
        let mut snapshots = Vec::new();
        for step in &script {
            snapshots.push(saved(&state, &params));
            let record = step.run(&params, &mut state).record;
            modes[record.mode as usize] += 1;
            records.push(bytes(&record));
        }
        for (at, snapshot) in snapshots.iter().enumerate() {
            longest = longest.max(snapshot.len());
            let mut state = HandState::load(&params, snapshot).expect("it was saved");
            assert_eq!(&saved(&state, &params), snapshot, "what is loaded is what was saved");
            // Every tenth runs on for long, the others for a little.
            let ahead = if at % 10 == 0 { AHEAD } else { 10 };
            for (step, record) in script.iter().zip(&records).skip(at).take(ahead) {
                assert_eq!(&bytes(&step.run(&params, &mut state).record), record, "seed {seed}, from {at}");
                compared += 1;
            }
        }
    }
    println!("ticks in each mode {modes:?}; at most {longest} bytes; {compared} ticks compared");
    assert!(modes.iter().all(|&ticks| ticks > 10), "{modes:?}");
}

/// Bytes of a state with a latch.
fn grasping() -> (HandParams, Vec<u8>) {
    let params = params::<12, 3>(&config());
    let mut state = HandState::new();
    let counts = facing_counts::<12>();
    for command in [Command::Arm, Command::Grasp(Grasp::CONFIGURED)] {
        tick(&params, &mut state, &Input::counts(&counts, Some(command)));
    }
    assert_eq!(state.mode(), Mode::Grasping);
    let bytes = saved(&state, &params);
    (params, bytes)
}

#[test]
fn the_bytes_do_not_depend_on_the_capacity() {
    let (_, bytes) = grasping();
    let large = params::<20, 5>(&config());
    let state = State::<20, 5>::load(&large, &bytes).expect("of the same hand");
    let mut buffer = [0; 4096];
    assert_eq!(state.save(&large, &mut buffer).unwrap(), &bytes[..]);
    assert!(state.save(&large, &mut buffer[..bytes.len() - 1]).is_err());
}

#[test]
fn what_is_no_snapshot_is_refused_for_its_reason() {
    let (params, bytes) = grasping();
    let load = |bytes: &[u8]| HandState::load(&params, bytes).err();
    for length in 0..bytes.len() {
        assert_eq!(load(&bytes[..length]), Some(SnapshotError::TooShort), "{length}");
    }
    assert_eq!(load(&[&bytes[..], &[0]].concat()), Some(SnapshotError::TrailingBytes));
    let changed = |at: usize, byte: u8| {
        let mut bytes = bytes.clone();
        bytes[at] = byte;
        load(&bytes)
    };
    assert_eq!(changed(0, 11), Some(SnapshotError::OtherHand { joints: 11, fingertips: 3 }));
    assert_eq!(changed(1, 4), Some(SnapshotError::OtherHand { joints: 12, fingertips: 4 }));
    assert_eq!(changed(6, 9), Some(SnapshotError::Malformed("no mode has this number")));
    assert_eq!(changed(7, 99), Some(SnapshotError::Malformed("no fault has this number")));
    assert_eq!(changed(8, 2), Some(SnapshotError::Malformed("a flag is neither 0 nor 1")));
}

proptest! {
    /// Whatever the bytes: refused, or a state with which ticks can be done.
    #[test]
    fn hostile_bytes_are_refused_or_run(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..40),
        length in proptest::option::of(0..1000_usize),
    ) {
        let (params, mut bytes) = grasping();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some(length) = length {
            bytes.resize(length, 0xff);
        }
        if let Ok(mut state) = HandState::load(&params, &bytes) {
            for step in script(1, 20, true) {
                step.run(&params, &mut state);
            }
        }
    }
}
