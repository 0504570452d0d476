//! A hand that is simulated, with the firmware's own code for its controller: a tick at a time, for as long as anybody
//! likes.
//!
//! The world begins with the first grasp: until then everything stands still, as the scene puts it. When the hand has lost
//! the object, or has no grasp any more, the joints glide back to where they began, as if somebody opened the hand and put
//! the object back; the next grasp begins there.

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

/// Time that putting the object back takes, s.
const PUT_BACK_S: f64 = 1.0;
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
    /// The object was lost.
    Lost(Lost),
    /// There is no grasp any more.
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
    /// In a grasp.
    Grasp(Box<Held>),
    /// On the way back, for so many ticks.
    PutBack { from_rad: JointVector, ticks: u64 },
}

/// The object that is held.
#[derive(Clone, Debug)]
struct Held {
    plant: Plant,
    motors: Motors,
    judge: Judge,
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
    /// Before a grasp.
    plant: Plant,
    motors: Motors,
    delay: Delay,
    world: World,
    /// `true` if the next grasp is a new one.
    ready: bool,
    period_s: f64,
    /// The time at which an encoder fails, ticks after each grasp.
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
        Ok(Self {
            device: Device::new(params, identity).with_faster_bauds(faster_bauds),
            burst: Box::new(Burst::new()),
            encoders: Encoders::new(scene),
            plant: blindgrasp_sim::plant(scene)?,
            motors: Motors::new(scene),
            delay: Delay::new(scene.actuators.output_delay_ticks, [0.0; MAX_JOINTS]),
            world: World::Still,
            ready: true,
            period_s: scene.control.period_s,
            failure: None,
            model,
        })
    }

    /// Lets the first joint's encoder fail for a tenth of a second, so many seconds after each grasp.
    pub fn fail_after(&mut self, grasp_s: f64) {
        self.failure = Some((grasp_s / self.period_s).round() as u64);
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
        if let (World::Grasp(held), Some(begin)) = (&self.world, self.failure)
            && (begin..begin + self.ticks(FAILURE_S)).contains(&held.ticks)
        {
            return Reading::Failed(Raised::at(0, Fault::SampleMissing));
        }
        let start_rad = &self.plant.motion().angles_rad;
        let angles_rad = match &self.world {
            World::Still => *start_rad,
            World::Grasp(held) => held.plant.motion().angles_rad,
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
        let grasps = matches!(mode, Mode::Grasping | Mode::Releasing);
        self.ready |= !grasps;
        match &mut self.world {
            World::Still if grasps && self.ready => {
                self.ready = false;
                let (plant, motors) = (self.plant.clone(), self.motors.clone());
                let judge = Judge::new(self.period_s);
                self.world = World::Grasp(Box::new(Held { plant, motors, judge, ticks: 0 }));
                // What goes wrong in the very first tick is found in the next.
                self.grasp(mode, wanted_nm).or(Some(Happening::Grasped))
            }
            World::Still => None,
            World::Grasp(held) if !grasps => {
                self.world = World::PutBack { from_rad: held.plant.motion().angles_rad, ticks: 0 };
                Some(Happening::LetGo)
            }
            World::Grasp(_) => self.grasp(mode, wanted_nm),
            World::PutBack { ticks, .. } => {
                *ticks += 1;
                (*ticks > put_back).then(|| {
                    self.world = World::Still;
                    Happening::PutBack
                })
            }
        }
    }

    fn grasp(&mut self, mode: Mode, wanted_nm: &[f32; MAX_JOINTS]) -> Option<Happening> {
        let World::Grasp(held) = &mut self.world else { return None };
        let Held { plant, motors, judge, ticks } = &mut **held;
        *ticks += 1;
        let mut gone = None;
        let moved = motors.turn(plant, wanted_nm, |plant, _| gone = judge.see(plant, mode));
        let lost = moved.err().map(|(_, lost)| lost).or(gone)?;
        self.world = World::PutBack { from_rad: plant.motion().angles_rad, ticks: 0 };
        Some(Happening::Lost(lost))
    }

    fn ticks(&self, time_s: f64) -> u64 {
        (time_s / self.period_s).round() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::command::{Command, Grasp};
    use blindgrasp_wire::Request;

    struct Bench {
        hand: SimulatedHand,
        sequence: u16,
        happened: Vec<Happening>,
        counts: Vec<i32>,
    }

    impl Bench {
        fn new(settings: &[&str]) -> Self {
            let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
            let hand = SimulatedHand::new(&Scene::load("cube", &settings).unwrap(), 0).unwrap();
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
