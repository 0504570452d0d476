//! Signs, zeros and saved parameters, asked for over the line.

use crate::common;
use crate::flash;

use crate::random::Random;
use blindgrasp_shared::command::{Command, Grasp, Refusal};
use blindgrasp_shared::device::{Device, Inputs, Outputs};
use blindgrasp_shared::event::Event;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image, Restored};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::{Packet, Reply, Request};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::store::{Store, StoreError};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::burst::Burst;
use blindgrasp_shared::tick::Params;
use common::{COUNTS_PER_RAD, FACING_RAD, JOINTS, config, facing_counts, params};
use flash::Memory;

const HAND: u32 = 7;
const IMAGE: Image<'_> = Image {
    interface_version: INTERFACE_VERSION,
    kind: "hand",
    hand: "test",
    hand_hash: HAND,
    firmware_version: "0.1.0",
    build_hash: 0,
    joint_count: JOINTS as u8,
    fingertip_count: 3,
    period_us: 1000,
};

/// A hand with a store, over a line on which nothing is lost.
struct Bench {
    device: Device<JOINTS, 3>,
    burst: Box<Burst<JOINTS>>,
    store: Option<Store<Memory>>,
    reading: Reading<JOINTS>,
    session: u16,
    sequence: u16,
    stored: Option<Result<(), StoreError>>,
    /// Ticks that the store takes for an order.
    slow: u32,
    order_due: Option<(u32, blindgrasp_shared::saved::Order)>,
    orders: usize,
}

impl Bench {
    /// A start: what was saved is put in force.
    fn start(memory: Option<Memory>) -> Self {
        let mut params = params(&config());
        let mut store = memory.map(|memory| Store::open(memory).expect("it can be read"));
        let restored = store.as_mut().map(|store| {
            store.prepare().expect("there is power");
            store.restore(HAND, &mut params, |_| {})
        });
        let identity = Identity { restored, ..Identity::of(IMAGE, Clock::External) };
        let mut bench = Self {
            device: Device::new(params, identity),
            burst: Box::new(Burst::new()),
            store,
            reading: Reading::Counts(facing_counts()),
            session: 0,
            sequence: 0,
            stored: None,
            slow: 0,
            order_due: None,
            orders: 0,
        };
        bench.hello();
        bench
    }

    fn new() -> Self {
        Self::start(Some(Memory::blank(4)))
    }

    fn restart(self) -> Self {
        Self::start(self.store.map(Store::into_flash))
    }

    fn hello(&mut self) -> Identity<'static> {
        let Some(Reply::Identity { session, identity, .. }) =
            self.ask(Request::Hello { interface_version: INTERFACE_VERSION }).reply
        else {
            panic!("a hello is answered")
        };
        self.session = session;
        identity
    }

    fn tick(&mut self, request: Option<Request<JOINTS>>) -> Outputs<JOINTS> {
        let packet = request.map(|request| {
            self.sequence += 1;
            Packet { session: self.session, sequence: self.sequence, request }
        });
        if let (Some((0, order)), Some(store)) = (&self.order_due, &mut self.store) {
            self.stored = Some(store.obey(order, HAND));
            self.order_due = None;
        } else if let Some((ticks, _)) = &mut self.order_due {
            *ticks -= 1;
        }
        let inputs = Inputs { packet, stored: self.stored.take(), ..Inputs::default() };
        let outputs = self.device.tick(&self.reading, &inputs, &mut self.burst);
        if let Some(order) = outputs.order {
            assert!(self.order_due.is_none(), "the store is still at work");
            self.order_due = Some((self.slow, order));
            self.orders += 1;
        }
        outputs
    }

    fn ask(&mut self, request: Request<JOINTS>) -> Outputs<JOINTS> {
        self.tick(Some(request))
    }

    #[track_caller]
    fn answer(&self, outputs: &Outputs<JOINTS>) -> Option<Refusal> {
        match outputs.reply {
            Some(Reply::Answer { sequence, refused }) if sequence == self.sequence => refused,
            ref reply => panic!("{reply:?}"),
        }
    }

    #[track_caller]
    fn refused(&mut self, request: Request<JOINTS>) -> Option<Refusal> {
        let outputs = self.ask(request);
        self.answer(&outputs)
    }

    /// The answer to a request that takes its time.
    #[track_caller]
    fn saved(&mut self, request: Request<JOINTS>) -> Option<Refusal> {
        let mut outputs = self.ask(request);
        for _ in 0..10_000 {
            if outputs.reply.is_some() {
                return self.answer(&outputs);
            }
            outputs = self.tick(None);
        }
        panic!("it is never answered")
    }

    fn set(parameter: Parameter, index: u8, value: f32) -> Request<JOINTS> {
        Request::SetParameter { parameter, index, value }
    }

    fn value(&self, parameter: Parameter, index: u8) -> f32 {
        self.device.params().get(parameter, index).expect("it is there").value
    }

    fn params(&self) -> Params<JOINTS, 3> {
        self.device.params().clone()
    }

    fn arm(&mut self) -> Option<Refusal> {
        self.ask(Request::Heartbeat);
        self.refused(Request::Command(Command::Arm))
    }

    fn is_unconfirmed(&mut self) -> bool {
        self.tick(None).record.events.contains(Event::Unconfirmed)
    }
}

fn bit(parameter: Parameter) -> u64 {
    1 << parameter.number()
}

#[test]
fn a_zero_is_set_where_the_joints_stand_and_holds_after_it_was_confirmed() {
    let mut bench = Bench::new();
    let counts = facing_counts::<JOINTS>();
    assert!(!bench.is_unconfirmed());
    assert_eq!(bench.refused(Request::Zero { joint: Some(2) }), None);
    bench.tick(None);
    let angles = *bench.device.state().angles_rad();
    for (k, angle) in angles.iter().enumerate() {
        let expected = if k == 2 { 0.0 } else { counts[k] as f32 / COUNTS_PER_RAD as f32 };
        assert!((angle - expected).abs() < 1e-4, "joint {k}: {angle}, not {expected}");
    }
    assert_eq!(bench.refused(Request::Zero { joint: None }), None);
    bench.tick(None);
    assert_eq!(bench.device.state().angles_rad(), &[0.0; JOINTS]);
    assert_eq!((0..12).map(|k| bench.value(Parameter::ENCODER_ZERO, k) as i32).collect::<Vec<_>>(), counts);
    assert_eq!(bench.hello().changed, bit(Parameter::ENCODER_ZERO));

    assert!(bench.is_unconfirmed());
    assert_eq!(bench.arm(), Some(Refusal::Unconfirmed));
    assert_eq!(bench.saved(Request::Save), Some(Refusal::Unconfirmed));
    assert_eq!(bench.refused(Request::Confirm), None);
    assert!(!bench.is_unconfirmed());
    assert_eq!(bench.arm(), None);
    assert_eq!(bench.refused(Request::Zero { joint: None }), Some(Refusal::NotDisarmed));
    assert_eq!(bench.refused(Bench::set(Parameter::ENCODER_REVERSED, 0, 1.0)), Some(Refusal::NotDisarmed));
    assert!(!bench.is_unconfirmed(), "what was refused changed nothing");
}

#[test]
fn a_sign_turns_the_angle_and_has_to_be_confirmed() {
    let mut bench = Bench::new();
    bench.tick(None);
    let before = *bench.device.state().angles_rad();
    assert_eq!(bench.refused(Bench::set(Parameter::ENCODER_REVERSED, 1, 1.0)), None);
    bench.tick(None);
    let after = bench.device.state().angles_rad();
    assert_eq!(after[1], -before[1]);
    assert_eq!((after[0], &after[2..]), (before[0], &before[2..]));
    assert_eq!(bench.arm(), Some(Refusal::Unconfirmed));
    for value in [0.5, 2.0, -1.0, f32::NAN] {
        assert!(bench.refused(Bench::set(Parameter::ENCODER_REVERSED, 1, value)).is_some(), "{value}");
        assert_eq!(bench.value(Parameter::ENCODER_REVERSED, 1), 1.0);
    }
    // A parameter that has nothing to do with it needs no confirmation, and gives none.
    assert_eq!(bench.refused(Bench::set(Parameter::DAMPING, 1, 1e-3)), None);
    assert_eq!(bench.arm(), Some(Refusal::Unconfirmed));
}

#[test]
fn a_zero_that_can_t_be_set_changes_nothing() {
    let mut bench = Bench::new();
    let before = bench.params();
    assert_eq!(bench.refused(Request::Zero { joint: Some(12) }), Some(Refusal::NoSuchParameter));
    let mut far = facing_counts();
    far[5] = -(1 << 24) - 1;
    bench.reading = Reading::Counts(far);
    // It may well be a fault: the joint is far out of its range, and without torque.
    let refused = bench.refused(Request::Zero { joint: None });
    assert_eq!(refused, Some(Refusal::OutOfRange));
    bench.reading = Reading::Failed(Raised::at(5, Fault::SampleMissing));
    assert_eq!(bench.refused(Request::Zero { joint: None }), Some(Refusal::NotRead));
    for value in [16_777_218.0, -16_777_218.0, 0.5, f32::INFINITY] {
        assert!(bench.refused(Bench::set(Parameter::ENCODER_ZERO, 0, value)).is_some(), "{value}");
    }
    assert!(!bench.is_unconfirmed());
    assert_eq!(bench.params(), before);
}

/// A drive tells angles: the same sign and zero are applied to them.
#[test]
fn a_drive_that_tells_angles_has_a_sign_and_a_zero_too() {
    let mut bench = Bench::new();
    let angles_rad: [f32; JOINTS] = std::array::from_fn(|k| FACING_RAD[k % 4] as f32 + 0.25);
    let mut speeds_rad_s = [0.0; JOINTS];
    speeds_rad_s[3] = 0.5;
    bench.reading = Reading::Motion { angles_rad, speeds_rad_s };
    bench.tick(None);
    assert_eq!(bench.device.state().angles_rad(), &angles_rad);
    assert_eq!(bench.refused(Request::Zero { joint: Some(3) }), None);
    assert_eq!(bench.refused(Bench::set(Parameter::ENCODER_REVERSED, 3, 1.0)), None);
    let turned = angles_rad[3] + 0.125;
    let mut moved = angles_rad;
    moved[3] = turned;
    bench.reading = Reading::Motion { angles_rad: moved, speeds_rad_s };
    let record = bench.tick(None).record;
    let (angles, speeds) = (bench.device.state().angles_rad(), bench.device.state().speeds_rad_s());
    // A zero is a whole number of counts.
    assert!((angles[3] + 0.125).abs() <= 0.5 / COUNTS_PER_RAD as f32 + 1e-6, "{}", angles[3]);
    assert_eq!((speeds[3], angles[2]), (-0.5, angles_rad[2]));
    assert!(record.counts.is_empty(), "there are no counts to tell");
}

#[test]
fn a_reversed_motor_gets_the_opposite_torque_and_the_record_tells_the_joint_s() {
    let mut bench = Bench::new();
    assert_eq!(bench.refused(Bench::set(Parameter::MOTOR_REVERSED, 2, 1.0)), None);
    assert_eq!(bench.arm(), None);
    assert_eq!(bench.refused(Request::Command(Command::Grasp(Grasp::CONFIGURED))), None);
    let outputs = (0..50).map(|_| bench.ask(Request::Heartbeat)).last().expect("a tick");
    assert_eq!(outputs.record.mode, Mode::Grasping);
    for (k, (motor_nm, joint_nm)) in
        outputs.torques_nm.iter().zip(outputs.record.torques_nm.iter()).enumerate()
    {
        assert!(k != 2 || *joint_nm != 0.0);
        assert_eq!(*motor_nm, if k == 2 { -joint_nm } else { *joint_nm }, "joint {k}");
    }
}

#[test]
fn what_was_saved_is_in_force_after_a_start_and_defaults_forget_it() {
    for slow in [0, 1, 7] {
        let mut bench = Bench::new();
        bench.slow = slow;
        assert_eq!(bench.refused(Request::Zero { joint: None }), None);
        assert_eq!(bench.refused(Bench::set(Parameter::TORQUE_LIMIT, 3, 0.1)), None);
        assert_eq!(bench.refused(Bench::set(Parameter::MOTOR_REVERSED, 4, 1.0)), None);
        assert_eq!(bench.refused(Request::Confirm), None);
        assert_eq!(bench.saved(Request::Save), None);
        let set = bench.params();
        // Of twelve zeros, those that are not 0 in the file.
        let zeros = facing_counts::<JOINTS>().iter().filter(|count| **count != 0).count();
        assert_eq!(bench.orders, 2 + zeros + 2);

        let mut bench = bench.restart();
        assert_eq!(bench.params().config(), set.config());
        let identity = bench.hello();
        assert_eq!(identity.restored, Some(Restored { saved: zeros as u16 + 2, ignored: 0 }));
        let changed = [Parameter::ENCODER_ZERO, Parameter::TORQUE_LIMIT, Parameter::MOTOR_REVERSED];
        assert_eq!(identity.changed, changed.into_iter().map(bit).sum::<u64>());
        assert!(!bench.is_unconfirmed(), "it was confirmed before it was saved");
        assert_eq!(bench.arm(), None);
        assert_eq!(bench.saved(Request::Defaults), Some(Refusal::NotDisarmed));
        assert_eq!(bench.refused(Request::Command(Command::Disarm)), None);

        assert_eq!(bench.saved(Request::Defaults), None);
        assert_eq!(bench.params().config(), &config());
        assert_eq!(bench.hello().changed, 0);
        assert_eq!(bench.arm(), Some(Refusal::Unconfirmed), "the zeros are others");
        let mut bench = bench.restart();
        assert_eq!((bench.params().config(), bench.hello().restored), (&config(), Some(Restored::default())));
    }
}

#[test]
fn while_parameters_are_saved_none_is_set_and_nothing_moves() {
    let mut bench = Bench::new();
    bench.slow = 5;
    assert_eq!(bench.refused(Bench::set(Parameter::DAMPING, 3, 1e-3)), None);
    bench.ask(Request::Heartbeat);
    assert_eq!(bench.ask(Request::Save).reply, None);
    let save = bench.sequence;
    let before = bench.params();
    for request in [
        Bench::set(Parameter::DAMPING, 3, 2e-3),
        Request::Zero { joint: None },
        Request::Save,
        Request::Defaults,
        Request::Command(Command::Arm),
    ] {
        assert_eq!(bench.refused(request.clone()), Some(Refusal::Saving), "{request:?}");
    }
    assert_eq!(bench.params(), before);
    assert_eq!(bench.refused(Request::Heartbeat), None);
    let answers: Vec<_> = (0..1000).filter_map(|_| bench.tick(None).reply).collect();
    assert_eq!(answers, [Reply::Answer { sequence: save, refused: None }]);
    assert_eq!(bench.arm(), None);
}

#[test]
fn a_save_is_refused_by_name_and_what_was_saved_stays() {
    let mut bench = Bench::start(None);
    for request in [Request::Save, Request::Defaults] {
        assert_eq!(bench.refused(request), Some(Refusal::NoStore));
    }

    let mut bench = Bench::new();
    let mut refused = None;
    let mut saves = 0;
    while refused.is_none() {
        assert_eq!(bench.refused(Bench::set(Parameter::RELEASE_TIME, 0, 90.0 - saves as f32)), None);
        refused = bench.saved(Request::Save);
        saves += usize::from(refused.is_none());
    }
    // Of a sector of four slots three are for sets, and nothing is erased between starts.
    assert_eq!((refused, saves), (Some(Refusal::NoSpare), 3));
    assert_eq!(bench.saved(Request::Defaults), Some(Refusal::NoSpare));
    assert_eq!(bench.value(Parameter::RELEASE_TIME, 0), 87.0, "refused, it changes nothing");
    let mut bench = bench.restart();
    assert_eq!(bench.value(Parameter::RELEASE_TIME, 0), 88.0);
    assert_eq!(bench.saved(Request::Save), None);
}

/// The power goes at any byte of a save: after the next start the old set is in force, or the new one.
#[test]
fn a_save_that_is_cut_leaves_the_old_set_or_the_new_one() {
    let (mut random, mut old_ones, mut new_ones) = (Random::new(9), 0, 0);
    let mut bench = Bench::new();
    let runs = if cfg!(debug_assertions) { 100 } else { 1000 };
    for run in 0..runs {
        let old = bench.params();
        let value = 1e-4 * (1.0 + random.below(20) as f32);
        for index in 0..random.below(12) as u8 {
            assert_eq!(bench.refused(Bench::set(Parameter::DAMPING, index, value)), None);
        }
        assert_eq!(bench.refused(Bench::set(Parameter::RELEASE_TIME, 0, (run % 90) as f32)), None);
        let new = bench.params();
        let mut store = bench.store.take().expect("it has one").into_flash();
        store.power = random.below(200);
        bench.store = Some(Store::open(store).expect("it can be read"));
        let is_told = match bench.saved(Request::Save) {
            None => true,
            Some(Refusal::NotSaved) => false,
            other => panic!("{other:?}"),
        };
        let mut memory = bench.store.take().expect("it has one").into_flash();
        memory.power = usize::MAX;
        bench = Bench::start(Some(memory));
        let found = bench.params();
        assert!(found == old || found == new, "a mixture, in run {run}");
        assert!(!is_told || found == new, "what was told to be saved is not, in run {run}");
        if found == new {
            new_ones += 1;
        } else {
            old_ones += 1;
        }
    }
    println!("{runs} saves that were cut: {old_ones} old, {new_ones} new");
    assert!(old_ones > runs / 10 && new_ones > runs / 10);
}

#[test]
fn the_answer_to_a_save_is_not_given_to_another_session() {
    let mut bench = Bench::new();
    bench.slow = 3;
    assert_eq!(bench.refused(Bench::set(Parameter::DAMPING, 3, 1e-3)), None);
    assert_eq!(bench.ask(Request::Save).reply, None);
    bench.hello();
    assert!((0..1000).all(|_| bench.tick(None).reply.is_none()));
    assert_eq!(bench.restart().value(Parameter::DAMPING, 3), 1e-3, "it was saved all the same");
}
