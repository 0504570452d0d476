//! Processor in the loop: a simulated hand whose controller is the firmware.
//!
//! ```text
//! Simulation --joints, command--> Pilot --packet, joints--> Linked --+--> Client --> firmware --> torques --> plant
//!                                                                    +--> Twin, the same on the host: compared
//! ```
//!
//! The [`Pilot`] is the host's part of a session: it says hello, gives the firmware the parameters of the scene, keeps the
//! heartbeat up, and passes commands on. To which [`Peer`] it speaks it does not know: [`Linked`] is a firmware and its twin;
//! a [`Twin`] alone is a simulation of the whole device, without a link.
//!
//! Before it arms, the pilot lets the firmware do as many ticks as it has requests, with joints that stand still. From the
//! first command on everything is as in a simulation without firmware, to the bit.

use super::twin::Twin;
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_device::client::{Client, ClientError, Traffic};
use blindgrasp_device::transport::Transport;
use blindgrasp_model::{HandModel, Scene, SceneError};
use blindgrasp_record::compare::Comparison;
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List};
use blindgrasp_shared::tick::{Params, Sensed};
use blindgrasp_sim::controller::{Controller, Reach, Stepped, Turn};
use blindgrasp_wire::{Answer, Firmware, Packet, Request, Sample, Turned, in_words};
use std::fmt::Display;

/// Heartbeats in the time that the firmware can do without one.
const HEARTBEATS: u32 = 3;
const IDEAL_SENSORS: &str = "sensors.ideal: a firmware has encoders: set it to false";

/// The reason for which a run with a firmware can't begin, or go on.
#[derive(Debug, thiserror::Error)]
pub enum PilError {
    /// The link.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The scene's hand can't be that of a firmware.
    #[error(transparent)]
    Hand(#[from] SceneError),
    /// The controller refuses the scene's parameters.
    #[error(
        "control: {0}; of a gain, the hand's own file allows `firmest_factor` ([safety]) times its own: lower it in the scene or with --set, or raise it in that file"
    )]
    Control(#[from] ParameterError),
    /// The scene and the firmware do not go together, or the firmware refuses something.
    #[error("{0}")]
    Refused(String),
}

fn refuse<T>(reason: impl Into<String>) -> Result<T, PilError> {
    Err(PilError::Refused(reason.into()))
}

fn refused<T>(request: &str, refusal: Refusal) -> Result<T, PilError> {
    refuse(format!("the firmware refuses {request}: {}", refusal.words()))
}

/// Returns the error of an answer that fits no question.
fn odd<T>(request: &str, answer: impl Display) -> Result<T, PilError> {
    refuse(format!("the firmware answers {request} with {answer}"))
}

fn on(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

/// The demands of a scene on a firmware, checked.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The scene's hand, with the configuration that its firmware starts with.
    pub hand: HandModel,
    /// The parameters that the firmware is to have before it arms.
    params: Params<MAX_JOINTS, MAX_FINGERS>,
}

impl Plan {
    /// Of a scene.
    ///
    /// # Errors
    /// If no firmware can do what the scene wants.
    pub fn new(scene: &Scene) -> Result<Self, PilError> {
        if scene.sensors.ideal {
            return refuse(IDEAL_SENSORS);
        }
        if scene.plant.turns.iter().any(|turn| turn.told) {
            return refuse(
                "plant.turn: a firmware that grasps can't be told of gravity yet: set told to false",
            );
        }
        let hand = HandModel::of(scene)?;
        let mut config = scene.controller_config();
        // How firm a grasp may be asked for is the file's affair: a scene asks for its own.
        for (limit, file) in config.limits.gains.iter_mut().zip(hand.config.limits.gains.iter()) {
            *limit = limit.map(|limit| file.map_or(limit, |file| limit.min(file)));
        }
        let (firmware_us, scene_us) = (hand.config.period_us, config.period_us);
        if firmware_us != scene_us {
            return refuse(format!(
                "control.period_s: the firmware's tick has {firmware_us} us, the scene's {scene_us} us: set it to the hand's, or \
                 the hand's to it"
            ));
        }
        Ok(Self { params: hand.params(&config)?, hand })
    }

    /// The scene's parameters, with the heartbeat that the hand wants of a host.
    ///
    /// # Errors
    /// The first that the controller refuses.
    pub fn with_heartbeat(&self) -> Result<Params<MAX_JOINTS, MAX_FINGERS>, ParameterError> {
        let mut config = *self.params.config();
        config.faults.heartbeat_ms = self.hand.config.faults.heartbeat_ms;
        self.hand.params(&config)
    }
}

/// A device that does a tick for each sample of joints.
pub trait Peer {
    /// One tick.
    ///
    /// # Errors
    /// If it was not done.
    fn turn(&mut self, packet: Option<&Packet>, sample: &Sample) -> Result<Turned, PilError>;

    /// Joint angles, rad, and speeds, rad/s, as the last tick saw them.
    fn motion_rad(&self) -> ([f32; MAX_JOINTS], [f32; MAX_JOINTS]);
}

/// A firmware and its twin, compared.
pub struct Linked<T> {
    client: Client<T>,
    hand: HandModel,
    firmware: Option<Firmware>,
    twin: Option<Twin>,
    comparison: Comparison,
    /// Tick of the firmware in which the grasp began.
    grasped_at: Option<u32>,
}

impl<T: Transport> Linked<T> {
    /// Waits until a firmware is there.
    ///
    /// # Errors
    /// If none is.
    pub fn connect(plan: &Plan, mut client: Client<T>) -> Result<Self, ClientError> {
        let hand = plan.hand.clone();
        client.knock()?;
        let comparison = Comparison::new(hand.joint_names.clone());
        Ok(Self { client, hand, firmware: None, twin: None, comparison, grasped_at: None })
    }

    /// Returns the comparison so far.
    pub fn comparison(&self) -> &Comparison {
        &self.comparison
    }

    /// Returns the traffic on the line so far.
    pub fn traffic(&self) -> &Traffic {
        self.client.traffic()
    }

    /// Returns the firmware at the other end, once it was asked.
    pub fn firmware(&self) -> Option<&Firmware> {
        self.firmware.as_ref()
    }

    /// Checks that a firmware is for the scene's hand and has not done anything yet.
    fn accept(&self, firmware: &Firmware, tick: u32) -> Result<(), PilError> {
        let HandModel { name, hand, .. } = &self.hand;
        let hand_hash = self.hand.hash();
        if (firmware.hand.as_str(), firmware.hand_hash, firmware.joint_count)
            != (name.as_str(), hand_hash, hand.joint_count())
        {
            return refuse(format!(
                "the firmware is for another hand than the scene, which needs `{name}` ({hand_hash:08x}); it is {}. Build it with \
                 HAND=FILE (a path from the root of the repository), the file of the scene's hand",
                firmware.words
            ));
        }
        if tick != 0 {
            return refuse(format!(
                "the firmware has done {tick} ticks since it started, so that nothing can be compared: reset it"
            ));
        }
        Ok(())
    }
}

impl<T: Transport> Peer for Linked<T> {
    fn turn(&mut self, packet: Option<&Packet>, sample: &Sample) -> Result<Turned, PilError> {
        let turned = self.client.turn(packet, sample)?;
        if let Some(Answer::Identity { firmware, .. }) = &turned.answer {
            self.accept(firmware, turned.record.tick)?;
            self.twin = Some(Twin::new(&self.hand, firmware.clock)?);
            self.firmware = Some(firmware.clone());
        }
        if let Some(Packet { request: Request::Command(Command::Grasp(_)), .. }) = packet {
            self.grasped_at.get_or_insert(turned.record.tick);
        }
        if let Some(twin) = &mut self.twin {
            let host = twin.tick(packet, sample);
            let tick = i64::from(turned.record.tick) - i64::from(self.grasped_at.unwrap_or(0));
            self.comparison.add(tick, &turned, &host);
        }
        Ok(turned)
    }

    fn motion_rad(&self) -> ([f32; MAX_JOINTS], [f32; MAX_JOINTS]) {
        self.twin.as_ref().map_or(([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]), Twin::motion_rad)
    }
}

/// The host's part of a session.
pub struct Pilot<P> {
    peer: P,
    joint_count: usize,
    /// The parameters of the scene.
    params: Params<MAX_JOINTS, MAX_FINGERS>,
    session: u16,
    sequence: u16,
    /// Ticks from one heartbeat to the next, if the peer wants any.
    heartbeat_ticks: Option<u32>,
    /// Ticks since the last one.
    silent_ticks: u32,
    greeted: bool,
}

impl<P: Peer> Pilot<P> {
    /// Before the first request.
    pub fn new(plan: &Plan, peer: P) -> Self {
        Self {
            peer,
            joint_count: plan.hand.hand.joint_count(),
            params: plan.params.clone(),
            session: 0,
            sequence: 0,
            heartbeat_ticks: None,
            silent_ticks: 0,
            greeted: false,
        }
    }

    /// To whom it speaks.
    pub fn peer(&self) -> &P {
        &self.peer
    }

    /// One tick, with a request if there is one.
    fn turn(&mut self, request: Option<Request>, sample: &Sample) -> Result<Turned, PilError> {
        let packet = request.map(|request| {
            self.sequence = self.sequence.wrapping_add(1);
            Packet { session: self.session, sequence: self.sequence, request }
        });
        self.silent_ticks = match &packet {
            Some(Packet { request: Request::Heartbeat, .. }) => 1,
            _ => self.silent_ticks.saturating_add(1),
        };
        self.peer.turn(packet.as_ref(), sample)
    }

    /// The answer to a request that takes a tick of its own.
    fn ask(&mut self, request: Request, sample: &Sample) -> Result<Answer, PilError> {
        let words = self.words(&request);
        match self.turn(Some(request), sample)?.answer {
            Some(answer) => Ok(answer),
            None => odd(&words, "nothing"),
        }
    }

    fn words(&self, request: &Request) -> String {
        in_words(Some(&Packet { session: self.session, sequence: self.sequence, request: request.clone() }))
    }

    /// A request whose answer is that it is done.
    fn tell(&mut self, request: Request, sample: &Sample) -> Result<(), PilError> {
        let words = self.words(&request);
        done(self.ask(request, sample)?, words)
    }

    /// Everything from hello to the first heartbeat, while the joints stand still.
    fn greet(&mut self, sample: &Sample) -> Result<(), PilError> {
        let hello = Request::Hello { interface_version: INTERFACE_VERSION };
        let words = self.words(&hello);
        match self.ask(hello, sample)? {
            Answer::Identity { session, .. } => self.session = session,
            answer => return odd(&words, format_args!("{answer:?}")),
        }
        let changes = self.changes(sample)?;
        self.configure(changes, sample)?;
        self.tell(Request::Heartbeat, sample)
    }

    /// Every parameter that is different in the peer, with what it has to be.
    fn changes(&mut self, sample: &Sample) -> Result<Vec<(Parameter, u8, f32)>, PilError> {
        let mut changes = Vec::new();
        for parameter in Parameter::ALL {
            for index in 0..parameter.count(self.joint_count) {
                let request = Request::GetParameter { parameter, index };
                let words = self.words(&request);
                let theirs = match self.ask(request, sample)? {
                    Answer::Value(setting) => Some(setting.value),
                    Answer::Refused(Refusal::SwitchedOff) => None,
                    Answer::Refused(refusal) => return refused(&words, refusal),
                    answer => return odd(&words, format_args!("{answer:?}")),
                };
                // What only a link and a clock can hurt, a scene does not know.
                if let Parameter::HEARTBEAT_TIME | Parameter::LATE_TICKS = parameter {
                    if let (Parameter::HEARTBEAT_TIME, Some(time_ms)) = (parameter, theirs) {
                        let ticks = (time_ms as u32).saturating_mul(1000)
                            / self.params.config().period_us
                            / HEARTBEATS;
                        self.heartbeat_ticks = Some(ticks.max(1));
                    }
                    continue;
                }
                match (self.params.get(parameter, index).ok().map(|setting| setting.value), theirs) {
                    (Some(ours), Some(theirs)) if ours.to_bits() != theirs.to_bits() => {
                        changes.push((parameter, index, ours));
                    }
                    (Some(_), Some(_)) | (None, None) => {}
                    (ours, _) => {
                        let (scene, firmware) = (on(ours.is_some()), on(ours.is_none()));
                        return refuse(format!(
                            "`{parameter}` is switched {scene} in the scene and {firmware} in the firmware, and can't be switched \
                             over the link: change the scene, or the hand's file"
                        ));
                    }
                }
            }
        }
        Ok(changes)
    }

    /// Sets parameters. Some have to fit others, so that it depends on the order whether they are taken: what is refused
    /// is tried again after the others.
    fn configure(&mut self, mut changes: Vec<(Parameter, u8, f32)>, sample: &Sample) -> Result<(), PilError> {
        let is_read_otherwise = changes.iter().any(|(parameter, ..)| parameter.is_reading());
        while !changes.is_empty() {
            let mut left = Vec::new();
            let mut first_refusal = None;
            for &(parameter, index, value) in &changes {
                let request = Request::SetParameter { parameter, index, value };
                let words = self.words(&request);
                match self.ask(request, sample)? {
                    Answer::Refused(refusal) => {
                        first_refusal.get_or_insert_with(|| {
                            format!(
                                "the firmware refuses the scene's `{parameter}` [{index}] = {value}: {}",
                                refusal.words()
                            )
                        });
                        left.push((parameter, index, value));
                    }
                    answer => done(answer, words)?,
                }
            }
            match first_refusal {
                Some(reason) if left.len() == changes.len() => return refuse(reason),
                _ => changes = left,
            }
        }
        if is_read_otherwise {
            // Where the joints are, the plant knows.
            let words = self.words(&Request::Confirm);
            done(self.ask(Request::Confirm, sample)?, words)?;
        }
        Ok(())
    }

    /// Returns the request that is to be made in a tick.
    fn request(&self, turn: &Turn<'_>) -> Option<Request> {
        match (turn.reach, turn.command) {
            (Reach::Nothing, _) => None,
            (_, Some(command)) => Some(Request::Command(command)),
            (Reach::Commands, None) => None,
            (Reach::Everything, None) => {
                self.heartbeat_ticks.filter(|&ticks| self.silent_ticks >= ticks).map(|_| Request::Heartbeat)
            }
        }
    }
}

impl<P: Peer> Controller for Pilot<P> {
    type Error = PilError;

    fn step(&mut self, turn: &Turn<'_>) -> Result<Stepped, PilError> {
        let (counts, failed) = match turn.sensed {
            Sensed::Counts(counts) => (List::first_of(*counts, self.joint_count), None),
            Sensed::Failed(raised) => (List::default(), Some(raised)),
            Sensed::Tested { raised, counts } => (List::first_of(*counts, self.joint_count), Some(raised)),
            Sensed::Ideal { .. } => return refuse(IDEAL_SENSORS),
        };
        let sample = Sample { counts, failed, late: turn.late };
        if !self.greeted {
            self.greeted = true;
            self.greet(&sample)?;
        }
        let request = self.request(turn);
        let words = request.as_ref().map(|request| self.words(request));
        let turned = self.turn(request, &sample)?;
        if let (Some(words), Some(answer)) = (words, turned.answer) {
            done(answer, words)?;
        }
        let record = turned.record;
        let mut torques_nm = [0.0; MAX_JOINTS];
        torques_nm.iter_mut().zip(&record.torques_nm).for_each(|(torque, &told)| *torque = told);
        let (angles_rad, speeds_rad_s) = self.peer.motion_rad();
        let (force_n, mode, fault) = (record.gains.grasp[0], record.mode, record.fault);
        let (noticed, refused) = (record.notice, record.answer.and_then(|answer| answer.refused));
        Ok(Stepped { torques_nm, angles_rad, speeds_rad_s, force_n, mode, fault, noticed, refused })
    }
}

fn done(answer: Answer, request: String) -> Result<(), PilError> {
    match answer {
        Answer::Done => Ok(()),
        Answer::Refused(refusal) => refused(&request, refusal),
        answer => odd(&request, format_args!("{answer:?}")),
    }
}
