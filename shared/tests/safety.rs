//! The limits that no request can break: make a limit looser than the hand's file, arm without a heartbeat, make a
//! torque jump, leave a fault by itself.

use crate::common;

use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::device::{Device, Inputs};
use blindgrasp_shared::event::Event;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image, Restored};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::{Packet, Reply, Request, Signals};
use blindgrasp_shared::parameters::{Bound, Parameter};
use blindgrasp_shared::saved::Order;
use blindgrasp_shared::store::StoreError;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::burst::Burst;
use blindgrasp_shared::tick::Params;
use common::{JOINTS, config, facing_counts, params};
use proptest::prelude::*;

type HandParams = Params<12, 3>;

/// The hand of the tests, with every limit and fault switched on.
fn hand() -> HandParams {
    let mut config = config();
    config.faults.heartbeat_ms = Some(100);
    config.supervisor.amplifier_start_ms = 5;
    params(&config)
}

/// Values that a host may send: near what is there, far from it, and nonsense.
fn values() -> impl Strategy<Value = f32> {
    let odd =
        [0.0, -0.0, 1.0, f32::MAX, f32::MIN, f32::MIN_POSITIVE, f32::NAN, f32::INFINITY, 1e9, 0.999_999];
    prop_oneof![
        any::<f32>(),
        0.0..2.0_f32,
        (0..1000_u32).prop_map(|n| n as f32),
        proptest::sample::select(odd.to_vec())
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The torque at an amplifier is at most `limits.torque_nm`, the last thing but the slew limit that acts on it, and no
    /// sequence of `set` makes that, or any other limit, looser than the file's. What is refused changes nothing.
    #[test]
    fn no_sequence_of_sets_is_looser_than_the_file(
        sets in proptest::collection::vec((0..Parameter::COUNT, 0..14_u8, values(), any::<bool>()), 1..200)
    ) {
        let mut params = hand();
        let file = params.clone();
        for (number, index, value, scaled) in sets {
            let parameter = Parameter::ALL[number];
            // Half of them close to what is there, so that they are taken.
            let value = match params.get(parameter, index) {
                Ok(setting) if scaled => setting.value * value,
                _ => value,
            };
            let before = *params.config();
            let done = params.set(parameter, index, value);
            if done.is_err() {
                prop_assert_eq!(*params.config(), before, "{} was refused and changed something", parameter);
            } else {
                prop_assert!(value.is_finite());
            }
        }
        let mut changed = 0;
        for parameter in Parameter::ALL {
            for index in 0..parameter.count(JOINTS) {
                let now = params.get(parameter, index).unwrap();
                let then = file.get(parameter, index).unwrap();
                prop_assert_eq!(now.file.to_bits(), then.value.to_bits());
                match parameter.bound() {
                    Bound::Free => {}
                    Bound::AtMost => prop_assert!(now.value <= then.value, "{} {}", parameter, now.value),
                    Bound::AtLeast => prop_assert!(now.value >= then.value, "{} {}", parameter, now.value),
                }
                if now.value != then.value {
                    changed |= 1 << parameter.number();
                }
            }
        }
        prop_assert_eq!(params.changed(), changed, "what differs from the file is told");
        // A gain is bounded by its limit, which is bounded by the file.
        for (gain, limit) in params.config().laws.gains.iter().zip(file.config().limits.gains.iter()) {
            prop_assert!(*gain <= limit.unwrap());
        }
    }
}

/// Repeatable random numbers.
struct Random(u64);

impl Random {
    fn below(&mut self, most: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32 % most
    }

    fn request(&mut self) -> Request<12> {
        let mut gains =
            || [None, Some(self.below(1000) as f32 * 0.6), Some(f32::NAN)][self.below(3) as usize];
        let mut grasp = Grasp::CONFIGURED;
        grasp.gains.iter_mut().for_each(|gain| *gain = gains());
        let value = [0.5, 1.0, 20.0, 1e9, f32::NAN][self.below(5) as usize];
        let parameter = Parameter::ALL[self.below(Parameter::COUNT as u32) as usize];
        let index = self.below(13) as u8;
        match self.below(46) {
            0 => Request::Hello { interface_version: INTERFACE_VERSION },
            1..=8 => Request::Heartbeat,
            9..=13 => Request::Command(Command::Arm),
            14..=17 => Request::Command(Command::Grasp(Grasp::CONFIGURED)),
            18..=20 => Request::Command(Command::Grasp(grasp)),
            21 | 22 => Request::Command(Command::Release),
            23 => Request::Command(Command::Disarm),
            24 => Request::Command(Command::Stop),
            25..=28 => Request::Command(Command::ClearFault),
            29..=32 => Request::SetParameter { parameter, index, value },
            33 => Request::GetParameter { parameter, index },
            34 => Request::Telemetry { decimation: 1, signals: Signals::FULL },
            35 => Request::Goodbye,
            36 => Request::Rate { baud: 3_000_000 },
            37 => Request::Zero { joint: [None, Some(index)][self.below(2) as usize] },
            38..=42 => Request::Confirm,
            43 => Request::Save,
            // Rarely, for it undoes all that the others did.
            44 if self.below(20) == 0 => Request::Defaults,
            _ => Request::Burst { index: index.into() },
        }
    }
}

/// A million requests in whatever order, by a host that now and then loses its session, of a hand whose joints jitter and now
/// and then fail, and whose flash does: nothing is armed without a heartbeat, with signs or zeros that nobody has confirmed, or
/// while parameters are saved, no torque changes by more than its slew limit while there is power,
/// there is none without, and a fault is left by a `ClearFault` that was taken and by nothing else.
#[test]
fn a_million_requests_do_no_harm() {
    let image = Image {
        interface_version: INTERFACE_VERSION,
        kind: "hand",
        hand: "test",
        hand_hash: 0,
        firmware_version: "0.0.0",
        build_hash: 0,
        joint_count: 12,
        fingertip_count: 3,
        period_us: 1000,
    };
    let params = hand();
    let (heartbeat_ms, slew_nm) = (100, params.file().limits.slew_nm_s.unwrap().map(|slew| slew * 1e-3));
    let identity = Identity { restored: Some(Restored::default()), ..Identity::of(image, Clock::External) };
    let mut device = Device::new(params, identity);
    let (mut is_saving, mut stored, mut saved) = (false, None, 0);
    let mut burst = Box::new(Burst::new());
    let mut random = Random(1);
    let (mut session, mut sequence) = (0_u16, 0_u16);
    let (mut mode, mut torques_nm, mut powered) = (Mode::Disarmed, [0.0_f32; 12], false);
    let mut silent = u32::MAX;
    let (mut armed, mut grasped, mut faults, mut cleared) = (0, 0, 0, 0);
    // Not optimised, a tick takes forty times as long.
    let requests = if cfg!(debug_assertions) { 50_000 } else { 1_000_000 };
    for _ in 0..requests {
        sequence = sequence.wrapping_add(1);
        let request = random.request();
        let wrong = random.below(50) == 0;
        let session_sent = if wrong { session.wrapping_add(7) } else { session };
        let counts = facing_counts().map(|count: i32| count + random.below(3) as i32);
        let reading = match random.below(3000) {
            0 => Reading::Failed(Raised::at(3, Fault::SampleMissing)),
            _ => Reading::Counts(counts),
        };
        let packet = Packet { session: session_sent, sequence, request: request.clone() };
        let packet = (random.below(8) != 0).then_some(packet);
        let late = random.below(200) == 0;
        let inputs = Inputs { late, packet, stored: stored.take(), ..Inputs::default() };
        let outputs = device.tick(&reading, &inputs, &mut burst);
        is_saving &= inputs.stored.is_none();
        if let Some(order) = outputs.order {
            is_saving = true;
            saved += u32::from(order == Order::Finish);
        }
        if is_saving && random.below(3) == 0 {
            stored = Some(if random.below(500) == 0 { Err(StoreError::ReadBack) } else { Ok(()) });
        }
        let done = match outputs.reply {
            Some(Reply::Identity { session: begun, .. }) => {
                session = begun;
                false
            }
            Some(Reply::Answer { sequence: answered, refused }) => answered == sequence && refused.is_none(),
            _ => false,
        };
        silent = if request == Request::Heartbeat && done { 0 } else { silent.saturating_add(1) };
        let now = outputs.record.mode;
        if mode == Mode::Disarmed && now == Mode::Armed {
            assert!(silent <= heartbeat_ms, "armed {silent} ticks after the last heartbeat");
            assert!(done && request == Request::Command(Command::Arm), "armed by {request:?}");
            assert!(!outputs.record.events.contains(Event::Unconfirmed), "armed without a confirmation");
            assert!(!is_saving, "armed during a save");
            armed += 1;
        }
        if mode == Mode::Fault && now != Mode::Fault {
            let by = request == Request::Command(Command::ClearFault) && done && !wrong;
            assert!(by && now == Mode::Disarmed, "a fault was left by {request:?} for {now:?}");
            cleared += 1;
        }
        faults += u32::from(mode != Mode::Fault && now == Mode::Fault);
        grasped += u32::from(mode == Mode::Armed && now == Mode::Grasping);
        assert_eq!(outputs.powered, !matches!(now, Mode::Disarmed | Mode::Fault));
        for ((now_nm, before_nm), most) in outputs.torques_nm.iter().zip(torques_nm).zip(slew_nm) {
            if !outputs.powered {
                assert_eq!(*now_nm, 0.0);
            } else if powered {
                // A rounding of the sum of the last torque and the step.
                assert!((now_nm - before_nm).abs() <= most * 1.000_01, "{before_nm} to {now_nm} N m");
            } else {
                assert!(now_nm.abs() <= most * 1.000_01, "{now_nm} N m in the first tick with power");
            }
        }
        (mode, torques_nm, powered) = (now, outputs.torques_nm, outputs.powered);
    }
    println!(
        "{requests} requests: armed {armed}, grasped {grasped}, faults {faults}, cleared {cleared}, saved {saved}"
    );
    assert!(armed > requests / 2000 && grasped > requests / 5000 && faults > 10 && cleared > 10);
    assert!(saved > requests / 10_000);
}
