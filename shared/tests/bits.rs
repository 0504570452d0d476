//! The tick gives the same bits everywhere: on every target and at every optimisation, in `f32`.

use crate::common;

use blindgrasp_shared::command::{Command, Grasp, Move};
use blindgrasp_shared::control::AttitudeError;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::Record;
use blindgrasp_shared::tick::{Config, Input, State, tick};
use common::{JOINTS, apart_counts, config, cycle_config, facing_counts, params};
use std::fmt;

/// Knuth's MMIX generator, its high half.
struct Lcg(u64);

impl Lcg {
    fn below(&mut self, bound: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 32) as u32) % bound
    }
}

/// FNV-1a, 64 bits.
#[derive(PartialEq)]
struct Fnv(u64);

impl fmt::Debug for Fnv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#018x}", self.0)
    }
}

impl Fnv {
    const START: Self = Self(0xcbf2_9ce4_8422_2325);

    fn take(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

/// A hand of some capacity through 5,000 ticks of jittering, wandering (if nothing holds it) and now and then impossible counts
/// and of commands in any order; the hashes of all torques and of all records, and how many ticks were spent in each mode.
fn run<const J: usize, const F: usize>(
    config: &Config<J>,
    home: [i32; J],
    is_held: bool,
    command: fn(u32) -> Option<Command>,
) -> (Fnv, Fnv, [u32; 9]) {
    let params = params::<J, F>(config);
    let mut state = State::new();
    let mut lcg = Lcg(2009);
    let (mut torques, mut records) = (Fnv::START, Fnv::START);
    let mut ticks_in = [0; 9];
    let mut counts = home;
    let mut buffer = vec![0; Record::<J>::MOST_BYTES];
    for _ in 0..5_000 {
        if is_held {
            counts = home;
        }
        for count in counts.iter_mut().take(JOINTS) {
            *count += lcg.below(9) as i32 - 4;
        }
        match lcg.below(if is_held { 2_000 } else { 500 }) {
            0 => counts = home,
            1 => counts[lcg.below(JOINTS as u32) as usize] += 30_000,
            2 => counts[lcg.below(JOINTS as u32) as usize] -= 400,
            _ => {}
        }
        let command = command(lcg.below(400));
        let output = match lcg.below(1_000) {
            0 => tick(&params, &mut state, &Input::failed(Raised::at(7, Fault::SampleMissing), command)),
            _ => tick(&params, &mut state, &Input::counts(&counts, command)),
        };
        if let Some(ticks) = ticks_in.get_mut(output.record.mode as usize) {
            *ticks += 1;
        }
        if output.record.mode == Mode::Fault {
            counts = facing_counts();
        }
        for torque in output.torques_nm.iter().take(JOINTS) {
            torques.take(&torque.to_bits().to_le_bytes());
        }
        records.take(output.record.encode(&mut buffer).expect("the buffer is large enough"));
    }
    (torques, records, ticks_in)
}

/// Commands as they are drawn: those that lead to a grasp come often enough for one, the others seldom.
fn grasps(drawn: u32) -> Option<Command> {
    match drawn {
        0..10 => Some(Command::Arm),
        10..20 => Some(Command::Grasp(Grasp::CONFIGURED)),
        20..30 => Some(Command::ClearFault),
        30 => Some(Command::Release),
        31 => Some(Command::Stop),
        32 => Some(Command::Disarm),
        _ => None,
    }
}

/// The same, with those of the whole cycle.
fn cycles(drawn: u32) -> Option<Command> {
    let way = Move { position_m: [0.01, -0.005, 0.008], turn_rad: [0.1, 0.2, -0.1], ..Move::default() };
    match drawn {
        33 | 39..44 => Some(Command::Posture { posture: None, time_ms: 0 }),
        34 => Some(Command::Aim { joint: 3, angle_rad: 0.5 }),
        35 | 36 => Some(Command::Move(way)),
        37 => Some(Command::Weigh),
        38 => Some(Command::PutDown),
        drawn => grasps(drawn),
    }
}

/// A failure without a change to the tick's computations means that bit equality is lost. If what it computes was meant
/// to change, so are the hashes. That of the torques outlives a record that tells more.
#[test]
fn the_bits_are_those_of_every_other_machine() {
    let (torques, records, ticks_in) = run::<12, 3>(&config(), facing_counts(), false, grasps);
    println!("torques {torques:?}, records {records:?}, ticks in each mode {ticks_in:?}");
    // Without the other stages.
    let [disarmed, armed, 0, 0, grasping, 0, 0, releasing, fault] = ticks_in else { panic!("{ticks_in:?}") };
    assert!([disarmed, armed, grasping, releasing, fault].iter().all(|&ticks| ticks >= 100), "{ticks_in:?}");
    assert_eq!(torques, Fnv(0x2986_1f50_40fb_190d));
    assert_eq!(records, Fnv(0xb1b1_32a7_8f9d_8a79));
}

/// The same hand with the earlier law: `u_I` in the place of `u_st`.
fn earlier<const J: usize>() -> Config<J> {
    let mut config = config();
    (config.laws.gains.grasp[1], config.laws.gains.integral[0]) = (0.0, 0.02);
    config
}

/// The image for the microcontroller is compared with the host in `tests/tests/pil.rs`.
#[test]
fn the_bits_of_the_earlier_law_are_those_of_every_other_machine() {
    let (torques, records, ticks_in) = run::<12, 3>(&earlier(), facing_counts(), false, grasps);
    println!("torques {torques:?}, records {records:?}, ticks in each mode {ticks_in:?}");
    // Without the other stages.
    let [disarmed, armed, 0, 0, grasping, 0, 0, releasing, fault] = ticks_in else { panic!("{ticks_in:?}") };
    assert!([disarmed, armed, grasping, releasing, fault].iter().all(|&ticks| ticks >= 100), "{ticks_in:?}");
    assert_eq!(torques, Fnv(0xac55_ea9c_cd4d_190e));
    assert_eq!(records, Fnv(0xd153_08ed_3bea_c2e7));
}

/// The whole cycle: postures, closing, the virtual frame, putting down.
#[test]
fn the_bits_of_the_cycle_are_those_of_every_other_machine() {
    let (torques, records, ticks_in) = run::<12, 3>(&cycle_config(), apart_counts(), true, cycles);
    println!("torques {torques:?}, records {records:?}, ticks in each mode {ticks_in:?}");
    assert!(ticks_in.iter().all(|&ticks| ticks >= 20), "{ticks_in:?}");
    assert_eq!(torques, Fnv(0x7d12_fbbf_ddd9_3131));
    assert_eq!(records, Fnv(0x6686_775b_0266_a757));
}

/// The same hand with the other form of the attitude error.
fn half_angle<const J: usize>() -> Config<J> {
    let mut config = config();
    config.laws.attitude_error = AttitudeError::HalfAngle;
    config
}

#[test]
fn the_bits_of_half_angles_are_those_of_every_other_machine() {
    let (torques, records, ticks_in) = run::<12, 3>(&half_angle(), facing_counts(), false, grasps);
    println!("torques {torques:?}, records {records:?}, ticks in each mode {ticks_in:?}");
    assert_eq!(torques, Fnv(0x7e11_ff3d_82da_db2d));
    assert_eq!(records, Fnv(0x4a60_c800_2540_7b6a));
}

#[test]
fn the_bits_do_not_depend_on_the_capacity() {
    assert_eq!(
        run::<12, 3>(&cycle_config(), apart_counts(), true, cycles),
        run::<20, 5>(&cycle_config(), apart_counts(), true, cycles)
    );
    assert_eq!(
        run::<12, 3>(&config(), facing_counts(), false, grasps),
        run::<20, 5>(&config(), facing_counts(), false, grasps)
    );
    assert_eq!(
        run::<12, 3>(&earlier(), facing_counts(), false, grasps),
        run::<20, 5>(&earlier(), facing_counts(), false, grasps)
    );
    assert_eq!(
        run::<12, 3>(&half_angle(), facing_counts(), false, grasps),
        run::<20, 5>(&half_angle(), facing_counts(), false, grasps)
    );
}
