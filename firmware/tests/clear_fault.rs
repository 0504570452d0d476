//! A fault of the joints is left by the user's command alone, once the tick has taken it: a refused one changes nothing.

use crate::model;

use blindgrasp_firmware::control::{Control, HandBurst};
use blindgrasp_firmware::joints::ls7366r::FilterClock;
use blindgrasp_firmware::joints::{BoardJoints, JointsConfig, OutputConfig};
use blindgrasp_firmware::model::{IMAGE_HAND, JOINTS, params};
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::device::{Device, Inputs, Outputs};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::link::message::{Packet, Reply, Request};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use model::{CounterChip, DacChip, Pin, PinEnd, Select, Traffic, share};
use std::array;
use std::cell::{RefCell, RefMut};
use std::rc::Rc;

const DACS: usize = JOINTS.div_ceil(4);
/// The joint whose counter loses its power.
const WEAK: usize = 3;
const LOST: Raised = Raised { fault: Fault::CounterReset, joint: Some(WEAK as u8) };

/// A hand that was just switched on.
struct Bench {
    counters: [Rc<RefCell<CounterChip>>; JOINTS],
    dacs: [Rc<RefCell<DacChip>>; DACS],
    enable: Rc<Pin>,
    joints: BoardJoints<Select<CounterChip>, Select<DacChip>, PinEnd, JOINTS, DACS>,
    control: Control,
    sequence: u16,
}

impl Bench {
    fn new() -> Self {
        let counters: [_; JOINTS] = array::from_fn(|_| share(CounterChip::powered_up()));
        let dacs: [_; DACS] = array::from_fn(|_| share(DacChip::default()));
        let traffic = share(Traffic::default());
        let enable: Rc<Pin> = Rc::default();
        let outputs = [OutputConfig { nm_per_volt: 0.15 }; JOINTS];
        let joints = BoardJoints::new(
            counters.each_ref().map(|chip| Select::to(chip, &traffic)),
            dacs.each_ref().map(|chip| Select::to(chip, &traffic)),
            PinEnd(Rc::clone(&enable)),
            &JointsConfig { filter_clock: FilterClock::Half, outputs },
        );
        let joints = joints.expect("the board's numbers are right");
        let image = Image::decode(&IMAGE_HAND).expect("the build wrote it");
        let device = Device::new(params(), Identity::of(image, Clock::External));
        let control = Control::new(device, Box::leak(Box::new(HandBurst::new())));
        Self { counters, dacs, enable, joints, control, sequence: 0 }
    }

    /// The same, 60 ticks after a counter lost its power: the self-test has passed since.
    fn in_fault() -> Self {
        let mut bench = Self::new();
        bench.turns(5);
        bench.counter(WEAK).lose_power();
        let outputs = bench.turns(60);
        assert_eq!((outputs.record.mode, outputs.record.fault), (Mode::Fault, Some(LOST)));
        bench
    }

    fn counter(&self, joint: usize) -> RefMut<'_, CounterChip> {
        self.counters[joint].borrow_mut()
    }

    fn turn(&mut self, packet: Option<Packet<JOINTS>>) -> Outputs<JOINTS> {
        self.control.turn(&mut self.joints, &Inputs { packet, ..Inputs::default() }).clone()
    }

    fn turns(&mut self, count: usize) -> Outputs<JOINTS> {
        (1..count).for_each(|_| _ = self.turn(None));
        self.turn(None)
    }

    /// Asks in a session, and returns why that was refused.
    fn ask(&mut self, session: u16, request: Request<JOINTS>) -> (Outputs<JOINTS>, Option<Refusal>) {
        self.sequence += 1;
        let outputs = self.turn(Some(Packet { session, sequence: self.sequence, request }));
        let refused = match outputs.reply {
            Some(Reply::Answer { refused, .. }) => refused,
            ref other => panic!("{other:?}"),
        };
        (outputs, refused)
    }

    fn clear(&mut self, session: u16) -> (Outputs<JOINTS>, Option<Refusal>) {
        self.ask(session, Request::Command(Command::ClearFault))
    }

    fn hello(&mut self) -> u16 {
        self.sequence += 1;
        let request = Request::Hello { interface_version: INTERFACE_VERSION };
        match self.turn(Some(Packet { session: 0, sequence: self.sequence, request })).reply {
            Some(Reply::Identity { session, .. }) => session,
            other => panic!("{other:?}"),
        }
    }

    fn assert_untouched(&self) {
        assert!(!self.enable.high.get(), "the amplifiers have power");
        assert!(self.dacs.iter().all(|dac| dac.borrow().power & 0xf == 0), "an output is on");
        assert!(self.counter(WEAK).power_lost, "the counter was started");
    }
}

#[test]
fn a_clear_of_no_session_does_nothing_and_the_users_own_sets_the_zero() {
    let mut bench = Bench::in_fault();
    assert_eq!(bench.clear(4711).1, Some(Refusal::NoSession));
    bench.assert_untouched();
    let session = bench.hello();
    bench.assert_untouched();
    // The joint is put to its starting posture: its counter does not count yet.
    bench.counter(WEAK).turn(700);
    let (outputs, refused) = bench.clear(session);
    assert_eq!((refused, outputs.record.mode), (None, Mode::Disarmed));
    assert_eq!(outputs.record.counts.as_slice(), [0; JOINTS]);
    assert!(!bench.enable.high.get(), "disarmed without power");
    bench.counter(WEAK).turn(-12);
    let record = bench.turn(None).record;
    assert_eq!(
        (record.mode, record.reading_failed, record.counts.as_slice()[WEAK]),
        (Mode::Disarmed, None, -12)
    );
}

#[test]
fn a_clear_while_the_cause_is_there_does_nothing() {
    let mut bench = Bench::in_fault();
    let session = bench.hello();
    // Another joint is beyond its range meanwhile.
    bench.counter(WEAK + 2).turn(40_000);
    for _ in 0..30 {
        let (outputs, refused) = bench.clear(session);
        assert_eq!(refused, Some(Refusal::FaultPersists));
        assert_eq!((outputs.record.mode, outputs.record.fault), (Mode::Fault, Some(LOST)));
        bench.assert_untouched();
    }
    bench.counter(WEAK + 2).turn(-40_000);
    bench.turns(300);
    assert_eq!(bench.clear(session).1, None);
    assert_eq!(bench.turn(None).record.mode, Mode::Disarmed);
}

#[test]
fn a_clear_before_the_self_test_has_passed_does_nothing() {
    let mut bench = Bench::new();
    let session = bench.hello();
    bench.counter(WEAK).lose_power();
    bench.turn(None);
    let mut refusals = 0;
    while bench.clear(session).1 == Some(Refusal::FaultPersists) {
        bench.assert_untouched();
        refusals += 1;
    }
    // A chip a tick: two rounds of the counters and one of the DACs.
    assert_eq!(refusals, 2 * JOINTS + DACS);
}

#[test]
fn the_amplifiers_have_power_only_while_there_may_be_torque() {
    let mut bench = Bench::new();
    let session = bench.hello();
    let expect = |bench: &mut Bench, request, mode| {
        let (outputs, refused) = bench.ask(session, request);
        assert_eq!((refused, outputs.record.mode), (None, mode));
        assert_eq!(bench.enable.high.get(), mode.is_powered(), "{mode:?}");
    };
    expect(&mut bench, Request::Heartbeat, Mode::Disarmed);
    expect(&mut bench, Request::Command(Command::Arm), Mode::Armed);
    expect(&mut bench, Request::Heartbeat, Mode::Armed);
    expect(&mut bench, Request::Command(Command::Disarm), Mode::Disarmed);
    expect(&mut bench, Request::Heartbeat, Mode::Disarmed);
    expect(&mut bench, Request::Command(Command::Arm), Mode::Armed);
    // The supply sags.
    let sagged = Inputs { supply_low: true, ..Inputs::default() };
    let outputs = bench.control.turn(&mut bench.joints, &sagged);
    assert_eq!(outputs.record.fault, Some(Raised::of_hand(Fault::SupplyLow)));
    assert!(!bench.enable.high.get());
    assert_eq!(bench.clear(session).1, None);
    assert!(!bench.enable.high.get());
}
