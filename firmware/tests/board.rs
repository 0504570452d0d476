//! The tasks of the image `hand` on a board that is nothing but the trait: what they do is no board's.

use blindgrasp_firmware::boards::{Board, Found, Parts};
use blindgrasp_firmware::control::{Control, HandBurst, Timing};
use blindgrasp_firmware::link::{Link, Port};
use blindgrasp_firmware::model::{IMAGE_HAND, JOINTS, params};
use blindgrasp_firmware::queue::{HandPacket, HandReply, Queues};
use blindgrasp_firmware::tasks::{ControlTask, IdleTask, LineErrors};
use blindgrasp_shared::command::Command;
use blindgrasp_shared::device::Device;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{BrownOut, Clock, Identity, Image, ResetCause};
use blindgrasp_shared::joints::{Joints, Reading};
use blindgrasp_shared::link::message::{Packet, Reply, Request};
use blindgrasp_shared::link::{Receiver, encode, most_bytes};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::store::{SLOT_BYTES, Store};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use std::array;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

/// The wires and registers of this test's board: of this test's thread alone, as the trait's functions have no board.
#[derive(Default)]
struct World {
    incoming: VecDeque<u8>,
    outgoing: Vec<u8>,
    powered: bool,
    supply_is_low: bool,
    is_late: bool,
    cycles: u32,
    errors: (u32, u32),
    fed: u32,
}

thread_local! {
    static WORLD: RefCell<World> = RefCell::default();
}

fn world<T>(act: impl FnOnce(&mut World) -> T) -> T {
    WORLD.with(|world| act(&mut world.borrow_mut()))
}

struct Still;

impl Joints<JOINTS> for Still {
    /// In the middle of their ranges.
    fn collect(&mut self) -> Reading<JOINTS> {
        let params = params();
        Reading::Counts(array::from_fn(|joint| {
            let (lower, upper) = params.hand().range_rad(joint);
            let encoder = params.config().estimator.encoders[joint];
            let turned = (0.5 * (lower + upper) / encoder.rad_per_count) as i32;
            encoder.zero_count + if encoder.reversed { -turned } else { turned }
        }))
    }

    fn write(&mut self, _: &[f32; JOINTS], powered: bool) -> Option<Raised> {
        world(|world| world.powered = powered);
        None
    }
}

struct Wires;

impl Port for Wires {
    fn receive(&mut self) -> Option<u8> {
        world(|world| world.incoming.pop_front())
    }

    fn is_silent(&self) -> bool {
        world(|world| world.incoming.is_empty())
    }

    fn send(&mut self, bytes: &[u8]) -> usize {
        world(|world| world.outgoing.extend(bytes));
        bytes.len()
    }

    fn is_sent(&self) -> bool {
        true
    }

    fn set_baud(&mut self, _: u32) {}
}

struct Bytes(Rc<RefCell<Vec<u8>>>);

impl ErrorType for Bytes {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Bytes {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        bytes.copy_from_slice(&self.0.borrow()[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().len()
    }
}

impl NorFlash for Bytes {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SLOT_BYTES as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0.borrow_mut()[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.0.borrow_mut()[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

struct Dog;

struct Bench {
    found: Found,
    flash: Option<Bytes>,
}

impl Bench {
    fn with(flash: &Rc<RefCell<Vec<u8>>>) -> Self {
        let found = Found {
            clock: Clock::External,
            reset: ResetCause::PowerOn,
            crash: None,
            brown_out: BrownOut::Level3,
        };
        Self { found, flash: Some(Bytes(Rc::clone(flash))) }
    }
}

impl Board for Bench {
    type Joints = Still;
    type Line = Wires;
    type Interrupts = ();
    type Flash = Bytes;
    type Watchdog = Dog;
    type Memory = ();

    const CLOCK_HZ: u32 = 100_000_000;
    const EMULATED_HZ: u32 = 0;

    fn found(&self) -> &Found {
        &self.found
    }

    fn take_flash(&mut self) -> Option<Bytes> {
        self.flash.take()
    }

    fn start(self, (): &'static mut ()) -> Parts<Self> {
        Parts { joints: Still, line: Wires, interrupts: (), watchdog: Some(Dog) }
    }

    fn start_line(self) -> ((), Wires) {
        ((), Wires)
    }

    fn feed(_: &mut Dog) {
        world(|world| world.fed += 1);
    }

    fn amplifiers_off() {
        world(|world| world.powered = false);
    }

    fn supply_is_low() -> bool {
        world(|world| world.supply_is_low)
    }

    fn take_supply_low() -> bool {
        Self::supply_is_low()
    }

    fn line_errors() -> (u32, u32) {
        world(|world| world.errors)
    }

    fn cycle_count() -> u32 {
        world(|world| {
            world.cycles += 1234;
            world.cycles
        })
    }

    fn is_late() -> bool {
        world(|world| world.is_late)
    }
}

/// The two tasks, and who talks to them.
struct Running {
    control: ControlTask<Bench>,
    idle: IdleTask<Bench>,
    session: u16,
    sequence: u16,
}

/// The image's start without its logs, which only the target has.
fn started(mut board: Bench) -> Running {
    let mut params = params();
    let image = Image::decode(&IMAGE_HAND).expect("the build wrote it");
    let mut store = Store::open(board.take_flash().expect("there is one")).expect("it can be read");
    store.prepare().expect("it can be erased");
    let restored = store.restore(image.hand_hash, &mut params, |_| panic!("all of it is known"));
    let told = Identity { restored: Some(restored), ..Identity::of(image, board.found().clock) };
    let device = Device::new(params, told);
    let control = Box::leak(Box::new(Control::new(device, Box::leak(Box::new(HandBurst::new())))));
    let (queues, end, store_end) = Box::leak(Box::new(Queues::new())).split();
    let Parts { joints, line, interrupts: (), watchdog } = board.start(Box::leak(Box::new(())));
    Running {
        control: ControlTask { control, joints, queues, last: Timing::default(), watchdog },
        idle: IdleTask {
            link: Link::new(line, end),
            errors: LineErrors::default(),
            store: Some((store, image.hand_hash)),
            store_end,
        },
        session: 0,
        sequence: 0,
    }
}

impl Running {
    /// A tick, and time for all that waits; the bytes that the hand said.
    fn tick(&mut self, request: Option<Request<JOINTS>>) -> Vec<u8> {
        if let Some(request) = request {
            self.sequence += 1;
            let packet = Packet { session: self.session, sequence: self.sequence, request };
            let mut buffer = [0; most_bytes(HandPacket::MOST_BYTES)];
            world(|world| world.incoming.extend(encode(&packet, &mut buffer).expect("there is room")));
            self.idle.poll();
        }
        self.control.run();
        self.idle.poll();
        while !self.idle.is_idle() {
            self.idle.poll();
        }
        world(|world| core::mem::take(&mut world.outgoing))
    }

    /// Asks, and looks at the answer.
    fn ask<T>(&mut self, request: Request<JOINTS>, look: impl FnOnce(Reply<'_, JOINTS>) -> T) -> T {
        let mut receiver = Receiver::<{ HandReply::MOST_BYTES + 4 }>::new();
        for byte in self.tick(Some(request)) {
            if let Some(payload) = receiver.push(byte) {
                return look(Reply::decode(payload.expect("a good frame")).expect("a reply"));
            }
        }
        panic!("there is no answer")
    }

    fn hello(&mut self) {
        self.session =
            self.ask(Request::Hello { interface_version: INTERFACE_VERSION }, |reply| match reply {
                Reply::Identity { session, .. } => session,
                other => panic!("{other:?}"),
            });
    }

    fn done(&mut self, request: Request<JOINTS>) {
        self.ask(request, |answer| {
            assert!(matches!(answer, Reply::Answer { refused: None, .. }), "{answer:?}")
        });
    }

    fn mode(&self) -> Mode {
        self.control.control.device().state().mode()
    }
}

fn framed(reply: &HandReply) -> Vec<u8> {
    let mut buffer = [0; most_bytes(HandReply::MOST_BYTES)];
    encode(reply, &mut buffer).expect("there is room").to_vec()
}

fn blank() -> Rc<RefCell<Vec<u8>>> {
    Rc::new(RefCell::new(vec![0; 32 * SLOT_BYTES as usize]))
}

#[test]
fn it_answers_arms_feeds_the_watchdog_and_counts_its_time() {
    let mut hand = started(Bench::with(&blank()));
    hand.hello();
    hand.done(Request::Heartbeat);
    assert!(!world(|world| world.powered));
    hand.done(Request::Command(Command::Arm));
    hand.tick(Some(Request::Heartbeat));
    assert!(world(|world| world.powered));
    assert_eq!(world(|world| world.fed), 4);
    assert_eq!(hand.control.last, Timing { late: false, cycles: 1234 });
    world(|world| world.is_late = true);
    hand.tick(None);
    assert!(hand.control.last.late);
}

#[test]
fn a_supply_that_sags_takes_the_amplifiers_power_in_the_same_turn_and_is_a_fault() {
    let mut hand = started(Bench::with(&blank()));
    hand.hello();
    hand.done(Request::Heartbeat);
    hand.done(Request::Command(Command::Arm));
    hand.tick(None);
    assert!(world(|world| world.powered));
    world(|world| world.supply_is_low = true);
    hand.tick(None);
    assert!(!world(|world| world.powered));
    assert_eq!(hand.mode(), Mode::Fault);
    let fault = hand.control.control.device().state().fault();
    assert_eq!(fault.map(|raised| raised.fault), Some(Fault::SupplyLow));
}

#[test]
fn errors_of_the_line_are_told_once_and_not_at_once() {
    let mut hand = started(Bench::with(&blank()));
    world(|world| world.errors = (3, 2));
    let mut told = Vec::new();
    for _ in 0..4000 {
        hand.control.run();
        told.extend(hand.idle.poll());
    }
    let told: Vec<_> = told.iter().map(|errors| (errors.bytes, errors.lost)).collect();
    assert_eq!(told, [(3, 2)]);
}

#[test]
fn what_was_saved_is_in_effect_after_the_next_start() {
    let flash = blank();
    let file = params().get(Parameter::gain(0), 0).expect("it is there").file;
    let mut hand = started(Bench::with(&flash));
    hand.hello();
    hand.done(Request::SetParameter { parameter: Parameter::gain(0), index: 0, value: 0.5 * file });
    // It is answered once it was written and read back, some ticks later.
    let mut said = hand.tick(Some(Request::Save));
    (0..1000).for_each(|_| said.extend(hand.tick(None)));
    assert_eq!(said, framed(&Reply::Answer { sequence: hand.sequence, refused: None }));
    drop(hand);

    let mut hand = started(Bench::with(&flash));
    hand.hello();
    let request = Request::GetParameter { parameter: Parameter::gain(0), index: 0 };
    let value = hand.ask(request, |reply| match reply {
        Reply::Value { setting, .. } => (setting.value, setting.file),
        other => panic!("{other:?}"),
    });
    assert_eq!(value, (0.5 * file, file));
}
