//! A hand that is simulated, with the firmware's own code for its controller: a tick at a time, for as long as anybody
//! likes.
//!
//! Where the fingertips touch the object from the start, the world begins with the first grasp: until then everything stands still,
//! as the scene puts it. When the hand has lost the object, or has no grasp any more, the joints glide back to where they began, as
//! if somebody opened the hand and put the object back; the next grasp begins there.
//!
//! Where the hand begins open, the world runs as long as the hand is armed, or in a fault: what it drops stays where it falls. Once it
//! is disarmed, everything is put back. Whoever drives such a hand takes his time, so that nothing happens at a time of the scene:
//! its tables stay where they are.

use super::pil::{PilError, Plan};
use blindgrasp_body::dynamics::JointVector;
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_model::{HandModel, Scene};
use blindgrasp_plant::{Lost, Plant};
use blindgrasp_shared::device::{Device, Inputs, Outputs};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, Identity, Image, ResetCause};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::rate::FASTER_BAUDS;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::burst::Burst;
use blindgrasp_sim::SimulationError;
use blindgrasp_sim::delay::Delay;
use blindgrasp_sim::encoders::Encoders;
use blindgrasp_sim::motors::Motors;
use blindgrasp_sim::verdict::Judge;
use blindgrasp_wire::Packet;

/// Time that putting the object back takes, s: less than an open hand takes from being armed until its fingertips could seem to touch,
/// so that none closes on what is not back yet.
const PUT_BACK_S: f64 = 0.2;
/// Time for which an encoder fails, s.
const FAILURE_S: f64 = 0.1;

/// The reason for which a scene can't be a hand.
#[derive(Debug, thiserror::Error)]
pub enum SimulatedError {
    /// No firmware can do what it wants.
    #[error(transparent)]
    Plan(#[from] PilError),
    /// It can't be simulated.
    #[error(transparent)]
    World(#[from] SimulationError),
}

/// An event in the world, in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Happening {
    /// A grasp began.
    Grasped,
    /// The object was lost, and is put back.
    Lost(Lost),
    /// The object was lost, and stays where it is.
    Dropped(Lost),
    /// There is no grasp any more, or the hand is disarmed: everything is put back.
    LetGo,
    /// Everything is as it was at the start.
    PutBack,
}

/// Inputs of the tick besides the joints.
#[derive(Clone, Debug, Default)]
pub struct Turn {
    /// A request.
    pub packet: Option<Packet>,
    /// `true` if the tick before was late.
    pub late: bool,
    /// The number of messages that were dropped since the start.
    pub dropped: u32,
    /// Records and parts of snapshots that wait for the line.
    pub waiting: usize,
}

/// The state of the world.
#[derive(Clone, Debug)]
enum World {
    /// At the start.
    Still,
    /// Everything moves.
    Running(Box<Running>),
    /// On the way back, for so many ticks.
    PutBack { from_rad: JointVector, ticks: u64 },
}

/// A world that runs.
#[derive(Clone, Debug)]
struct Running {
    plant: Plant,
    motors: Motors,
    /// None once the object is lost.
    judge: Option<Judge>,
    /// For so many ticks.
    ticks: u64,
}

/// A simulated hand.
pub struct SimulatedHand {
    /// The scene's hand.
    pub model: HandModel,
    device: Device<MAX_JOINTS, MAX_FINGERS>,
    burst: Box<Burst<MAX_JOINTS>>,
    encoders: Encoders,
    /// At the start.
    plant: Plant,
    motors: Motors,
    delay: Delay,
    world: World,
    /// `true` if the hand begins open.
    begins_open: bool,
    /// `true` if the next grasp, or arming, is a new one.
    ready: bool,
    period_s: f64,
    /// The time at which an encoder fails, ticks after the world has begun to run.
    failure: Option<u64>,
}

impl SimulatedHand {
    /// A hand that was just switched on, in a scene, behind a line of so many baud (0: as fast as one likes).
    ///
    /// # Errors
    /// If no firmware can do what the scene wants, or it can't be simulated.
    pub fn new(scene: &Scene, baud: u32) -> Result<Self, SimulatedError> {
        let plan = Plan::new(scene)?;
        // Ticks may be late as often as they like: a host is no real-time computer, and what is simulated waits for it.
        let params = plan.with_heartbeat().map_err(PilError::from)?;
        let model = plan.hand;
        let image = Image {
            interface_version: INTERFACE_VERSION,
            kind: "hand",
            // An identity lives as long as a firmware.
            hand: model.name.clone().leak(),
            hand_hash: model.hash(),
            firmware_version: env!("CARGO_PKG_VERSION"),
            build_hash: 0,
            joint_count: model.hand.joint_count() as u8,
            fingertip_count: model.hand.fingertip_count() as u8,
            period_us: model.config.period_us,
        };
        let identity =
            Identity { reset: ResetCause::PowerOn, most_baud: baud, ..Identity::of(image, Clock::External) };
        // From the fastest on.
        let slower = FASTER_BAUDS.iter().position(|&faster| baud == 0 || faster <= baud);
        let faster_bauds = slower.map_or(&[][..], |first| &FASTER_BAUDS[first..]);
        let begins_open = begins_open(scene);
        let mut scene = scene.clone();
        if begins_open {
            leave_out_times(&mut scene);
        }
        let scene = &scene;
        Ok(Self {
            device: Device::new(params, identity).with_faster_bauds(faster_bauds),
            burst: Box::new(Burst::new()),
            encoders: Encoders::new(scene),
            plant: blindgrasp_sim::plant(scene)?,
            motors: Motors::new(scene),
            delay: Delay::new(scene.actuators.output_delay_ticks, [0.0; MAX_JOINTS]),
            world: World::Still,
            begins_open,
            ready: true,
            period_s: scene.control.period_s,
            failure: None,
            model,
        })
    }

    /// Lets the first joint's encoder fail for a tenth of a second, so many seconds after each grasp, or arming where the hand
    /// begins open.
    pub fn fail_after(&mut self, after_s: f64) {
        self.failure = Some((after_s / self.period_s).round() as u64);
    }

    /// One tick.
    pub fn turn(&mut self, turn: Turn) -> (Outputs<MAX_JOINTS>, Option<Happening>) {
        let Turn { packet, late, dropped, waiting } = turn;
        // There is no processor whose cycles could be counted.
        let inputs = Inputs { late, dropped, waiting, packet, ..Inputs::default() };
        let reading = self.read();
        let outputs = self.device.tick(&reading, &inputs, &mut self.burst);
        let mut wanted_nm = outputs.torques_nm;
        // The motors are as the hand's file says, whatever the controller believes of them.
        self.model.config.motors.turn(&mut wanted_nm);
        let wanted_nm = self.delay.pass(wanted_nm);
        let happened = self.move_on(outputs.record.mode, &wanted_nm);
        (outputs, happened)
    }

    fn read(&mut self) -> Reading<MAX_JOINTS> {
        if let (World::Running(running), Some(begin)) = (&self.world, self.failure)
            && (begin..begin + self.ticks(FAILURE_S)).contains(&running.ticks)
        {
            return Reading::Failed(Raised::at(0, Fault::SampleMissing));
        }
        let start_rad = &self.plant.motion().angles_rad;
        let angles_rad = match &self.world {
            World::Still => *start_rad,
            World::Running(running) => running.plant.motion().angles_rad,
            World::PutBack { from_rad, ticks } => {
                // As smooth as a hand that is moved by hand.
                let share = (*ticks as f64 * self.period_s / PUT_BACK_S).min(1.0);
                let way = share * share * (3.0 - 2.0 * share);
                std::array::from_fn(|k| from_rad[k] + way * (start_rad[k] - from_rad[k]))
            }
        };
        Reading::Counts(self.encoders.read(&angles_rad))
    }

    /// Moves the world on under these torques until the next tick.
    fn move_on(&mut self, mode: Mode, wanted_nm: &[f32; MAX_JOINTS]) -> Option<Happening> {
        let put_back = self.ticks(PUT_BACK_S);
        let runs = match self.begins_open {
            true => mode != Mode::Disarmed,
            false => mode.is_grasp() || mode == Mode::Closing,
        };
        self.ready |= !runs;
        match &mut self.world {
            World::Still if runs && self.ready => {
                self.ready = false;
                let (plant, motors) = (self.plant.clone(), self.motors.clone());
                let judge = Some(Judge::new(self.period_s));
                self.world = World::Running(Box::new(Running { plant, motors, judge, ticks: 0 }));
                // What goes wrong in the very first tick is found in the next.
                self.run(mode, wanted_nm).or((!self.begins_open).then_some(Happening::Grasped))
            }
            World::Still => None,
            World::Running(running) if !runs => {
                self.world = World::PutBack { from_rad: running.plant.motion().angles_rad, ticks: 0 };
                Some(Happening::LetGo)
            }
            World::Running(_) => self.run(mode, wanted_nm),
            World::PutBack { ticks, .. } => {
                *ticks += 1;
                (*ticks > put_back).then(|| {
                    self.world = World::Still;
                    Happening::PutBack
                })
            }
        }
    }

    fn run(&mut self, mode: Mode, wanted_nm: &[f32; MAX_JOINTS]) -> Option<Happening> {
        let World::Running(running) = &mut self.world else { return None };
        let Running { plant, motors, judge, ticks } = &mut **running;
        *ticks += 1;
        let mut gone = None;
        let moved = motors.turn(plant, wanted_nm, |plant, _| {
            gone = judge.as_mut().and_then(|judge| judge.see(plant, mode));
        });
        match moved {
            Ok(()) if self.begins_open => {
                let lost = gone?;
                *judge = None;
                Some(Happening::Dropped(lost))
            }
            Ok(()) => gone.map(|lost| self.put_back(lost)),
            // It can't be computed any further.
            Err((_, lost)) => Some(self.put_back(lost)),
        }
    }

    fn put_back(&mut self, lost: Lost) -> Happening {
        if let World::Running(running) = &self.world {
            self.world = World::PutBack { from_rad: running.plant.motion().angles_rad, ticks: 0 };
        }
        Happening::Lost(lost)
    }

    fn ticks(&self, time_s: f64) -> u64 {
        (time_s / self.period_s).round() as u64
    }
}

/// Returns `true` if no fingertip touches the object at the start.
pub fn begins_open(scene: &Scene) -> bool {
    scene.contacts.is_empty()
}

/// Leaves out all that happens at a time since the scene began.
fn leave_out_times(scene: &mut Scene) {
    let plant = &mut scene.plant;
    plant.tables.iter_mut().for_each(|table| table.moves.clear());
    plant.turns.clear();
    plant.shakes.clear();
    plant.pushes.clear();
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::command::{Command, Grasp, Move};
    use blindgrasp_shared::cycle::Notice;
    use blindgrasp_wire::Request;

    struct Bench {
        hand: SimulatedHand,
        sequence: u16,
        happened: Vec<Happening>,
        counts: Vec<i32>,
    }

    impl Bench {
        fn new(settings: &[&str]) -> Self {
            Self::of("cube", settings)
        }

        fn of(scene: &str, settings: &[&str]) -> Self {
            let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
            let hand = SimulatedHand::new(&Scene::load(scene, &settings).unwrap(), 0).unwrap();
            let mut bench = Self { hand, sequence: 0, happened: Vec::new(), counts: Vec::new() };
            bench.ask(Request::Hello { interface_version: INTERFACE_VERSION });
            bench
        }

        fn turn(&mut self, packet: Option<Packet>) -> Mode {
            let (outputs, happened) = self.hand.turn(Turn { packet, ..Turn::default() });
            self.happened.extend(happened);
            self.counts = outputs.record.counts.as_slice().to_vec();
            outputs.record.mode
        }

        fn ask(&mut self, request: Request) -> Mode {
            self.sequence += 1;
            self.turn(Some(Packet { session: 1, sequence: self.sequence, request }))
        }

        fn command(&mut self, command: Command) -> Mode {
            self.ask(Request::Heartbeat);
            self.ask(Request::Command(command))
        }

        /// Ticks with the heartbeat of a host.
        fn run(&mut self, ticks: usize) -> Mode {
            let modes = (0..ticks).map(|k| match k % 50 {
                0 => self.ask(Request::Heartbeat),
                _ => self.turn(None),
            });
            modes.last().expect("a tick")
        }
    }

    #[test]
    fn the_world_stands_still_until_a_grasp_and_is_put_back_after_it() {
        let mut bench = Bench::new(&[]);
        bench.run(100);
        let start = bench.counts.clone();
        bench.command(Command::Arm);
        bench.run(100);
        assert_eq!((&bench.counts, bench.happened.len()), (&start, 0));
        for _ in 0..2 {
            bench.happened.clear();
            assert_eq!(bench.command(Command::Grasp(Grasp::CONFIGURED)), Mode::Grasping);
            assert_eq!(bench.run(1500), Mode::Grasping);
            assert_ne!(bench.counts, start);
            assert_eq!(bench.happened, [Happening::Grasped], "the cube is held");
            bench.command(Command::Stop);
            bench.run(1100);
            assert_eq!(bench.happened, [Happening::Grasped, Happening::LetGo, Happening::PutBack]);
            assert_eq!(bench.counts, start);
            assert_eq!(bench.command(Command::Arm), Mode::Armed);
        }
    }

    /// Runs until a notice comes.
    fn until(bench: &mut Bench, notice: Notice) {
        for k in 0..10_000 {
            let packet = (k % 50 == 0).then(|| {
                bench.sequence += 1;
                Packet { session: 1, sequence: bench.sequence, request: Request::Heartbeat }
            });
            let (outputs, happened) = bench.hand.turn(Turn { packet, ..Turn::default() });
            bench.happened.extend(happened);
            bench.counts = outputs.record.counts.as_slice().to_vec();
            if outputs.record.notice.is_some_and(|noticed| noticed.notice == notice) {
                return;
            }
        }
        panic!("{notice:?} does not come: {:?}", bench.happened);
    }

    /// The cube of `pick-cube` is picked up and put down, with all the time that the user takes: its table stays.
    #[test]
    fn an_open_hand_picks_up_what_lies_before_it_until_it_is_disarmed() {
        let mut bench = Bench::of("pick-cube", &[]);
        bench.run(100);
        let start = bench.counts.clone();
        let preshape = Command::Posture { posture: Some(1), time_ms: 0 };
        bench.command(Command::Arm);
        bench.run(5000);
        bench.command(preshape);
        until(&mut bench, Notice::InPosture);
        assert_ne!(bench.counts, start);
        bench.command(Command::Grasp(Grasp::CONFIGURED));
        until(&mut bench, Notice::Holding);
        bench.command(Command::Move(Move { position_m: [0.0, 0.0, -0.015], ..Move::default() }));
        until(&mut bench, Notice::AtTarget);
        bench.run(10_000);
        bench.command(Command::PutDown);
        until(&mut bench, Notice::OnGround);
        bench.command(Command::Release);
        until(&mut bench, Notice::InPosture);
        assert_eq!(bench.happened, []);
        // Let go from up there, it falls, and stays there.
        bench.command(preshape);
        until(&mut bench, Notice::InPosture);
        bench.command(Command::Grasp(Grasp::CONFIGURED));
        until(&mut bench, Notice::Holding);
        bench.command(Command::Move(Move { position_m: [0.0, 0.0, -0.04], ..Move::default() }));
        until(&mut bench, Notice::AtTarget);
        bench.command(Command::Release);
        bench.run(2000);
        assert!(matches!(bench.happened[..], [Happening::Dropped(_)]), "{:?}", bench.happened);
        bench.command(Command::Disarm);
        bench.run(1100);
        assert!(matches!(bench.happened[1..], [Happening::LetGo, Happening::PutBack]));
        assert_eq!(bench.counts, start);
    }

    /// Armed at once after it was stopped, before everything is back, a hand takes nothing for an object.
    #[test]
    fn a_hand_that_is_armed_at_once_grasps_what_is_there() {
        let mut bench = Bench::of("pick-cube", &[]);
        for _ in 0..3 {
            bench.happened.clear();
            bench.command(Command::Arm);
            bench.command(Command::Posture { posture: Some(1), time_ms: 0 });
            until(&mut bench, Notice::InPosture);
            bench.command(Command::Grasp(Grasp::CONFIGURED));
            until(&mut bench, Notice::Holding);
            bench.command(Command::Move(Move { position_m: [0.0, 0.0, -0.015], ..Move::default() }));
            until(&mut bench, Notice::AtTarget);
            assert_eq!(bench.run(500), Mode::Carrying);
            assert!(matches!(bench.happened[..], [] | [Happening::PutBack]), "{:?}", bench.happened);
            bench.command(Command::Stop);
        }
    }

    /// The device's own estimator undoes what the encoders do.
    #[test]
    fn a_reversed_hand_with_odd_zeros_does_the_same() {
        let torques = |settings: &[&str]| {
            let mut bench = Bench::new(settings);
            bench.command(Command::Arm);
            bench.command(Command::Grasp(Grasp::CONFIGURED));
            let torques: Vec<_> = (0..500)
                .map(|k| {
                    let packet = (k % 50 == 0).then(|| {
                        bench.sequence += 1;
                        Packet { session: 1, sequence: bench.sequence, request: Request::Heartbeat }
                    });
                    bench.hand.turn(Turn { packet, ..Turn::default() }).0.torques_nm.map(f32::to_bits)
                })
                .collect();
            (torques, bench.counts)
        };
        let odd = ["hand.joint.*.encoder_reversed=true", "hand.joint.*.encoder_zero_count=1000"];
        let ((usual, counts), (other, turned)) = (torques(&[]), torques(&odd));
        assert_eq!(usual, other);
        assert_eq!(turned, counts.iter().map(|count| 1000 - count).collect::<Vec<_>>());
    }

    #[test]
    fn a_grasp_that_was_lost_is_not_begun_again_without_a_command() {
        let mut bench = Bench::new(&["friction.scale=0"]);
        bench.command(Command::Arm);
        bench.command(Command::Grasp(Grasp::CONFIGURED));
        bench.run(3000);
        assert!(matches!(bench.happened[..], [Happening::Grasped, Happening::Lost(_), Happening::PutBack]));
    }

    #[test]
    fn an_encoder_fails_when_it_should_and_works_again() {
        let mut bench = Bench::new(&[]);
        bench.hand.fail_after(0.5);
        bench.command(Command::Arm);
        bench.command(Command::Grasp(Grasp::CONFIGURED));
        assert_eq!(bench.run(499), Mode::Grasping);
        assert_eq!(bench.run(2), Mode::Fault);
        bench.run(200);
        assert_eq!(bench.command(Command::ClearFault), Mode::Disarmed);
    }
}
