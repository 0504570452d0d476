//! A controller, which stands between the sensors and the motors of a simulated hand, and the simplest one: the tick
//! alone.

use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_model::Scene;
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::cycle::Noticed;
use blindgrasp_shared::event::{Event, Events};
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::parameter::ParameterError;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::Record;
use blindgrasp_shared::tick::{Input, Params, Sensed, State, tick};
use std::convert::Infallible;

/// A controller of the hand, a tick at a time.
pub trait Controller {
    /// The error of a tick that can't be done.
    type Error;

    /// One tick.
    ///
    /// # Errors
    /// If the tick could not be done. The run ends then.
    fn step(&mut self, turn: &Turn<'_>) -> Result<Stepped, Self::Error>;
}

/// The inputs of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Turn<'a> {
    /// The state of the joints; zero beyond the hand's.
    pub sensed: Sensed<'a, MAX_JOINTS>,
    /// `true` if the tick before is to count as late.
    pub late: bool,
    /// The command of the user.
    pub command: Option<Command>,
    /// The reach of the host.
    pub reach: Reach,
    /// Gravity in the base frame, m/s^2, where somebody who knows it tells it.
    pub gravity_m_s2: Option<[f32; 3]>,
}

/// The part of the host that reaches the hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reach {
    /// Commands and heartbeats.
    Everything,
    /// Commands; no heartbeat is sent.
    Commands,
    /// Neither.
    Nothing,
}

/// The outputs of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepped {
    /// Torques of the next tick, N m; zero beyond the hand's joints.
    pub torques_nm: [f32; MAX_JOINTS],
    /// Joint angles as the tick saw them, rad.
    pub angles_rad: [f32; MAX_JOINTS],
    /// Joint speeds as the tick saw them, rad/s.
    pub speeds_rad_s: [f32; MAX_JOINTS],
    /// The force `f_d` that acts, N.
    pub force_n: f32,
    /// The mode.
    pub mode: Mode,
    /// The fault that the hand is in.
    pub fault: Option<Raised>,
    /// The notice of the tick.
    pub noticed: Option<Noticed>,
    /// The reason for which its command was refused.
    pub refused: Option<Refusal>,
}

/// The tick alone, as the scene configures it: no link, and so nobody whose heartbeat could stop.
#[derive(Clone, Debug)]
pub struct Alone {
    params: Params<MAX_JOINTS, MAX_FINGERS>,
    state: State<MAX_JOINTS, MAX_FINGERS>,
    record: Option<Record<MAX_JOINTS>>,
}

impl Alone {
    /// Disarmed.
    ///
    /// # Errors
    /// The first parameter of the scene that the controller refuses.
    pub fn new(scene: &Scene) -> Result<Self, ParameterError> {
        let params = Params::new(scene.hand.cast(), &scene.controller_config())?
            .with_postures(scene.named_postures())?;
        Ok(Self { params, state: State::new(), record: None })
    }

    /// Its parameters.
    pub fn params(&self) -> &Params<MAX_JOINTS, MAX_FINGERS> {
        &self.params
    }

    /// Returns the state after its last tick.
    pub fn state(&self) -> &State<MAX_JOINTS, MAX_FINGERS> {
        &self.state
    }

    /// Returns the record of its last tick; `None` before the first.
    pub fn record(&self) -> Option<&Record<MAX_JOINTS>> {
        self.record.as_ref()
    }
}

impl Controller for Alone {
    type Error = Infallible;

    fn step(&mut self, turn: &Turn<'_>) -> Result<Stepped, Infallible> {
        let input = Input {
            sensed: turn.sensed,
            events: Events::NONE.with(Event::Late, turn.late),
            command: turn.command.filter(|_| turn.reach != Reach::Nothing),
        };
        for (axis, gravity) in (0..).zip(turn.gravity_m_s2.into_iter().flatten()) {
            // Where the weight of the links is not held, gravity is not asked for.
            let _ = self.params.set(Parameter::GRAVITY, axis, gravity);
        }
        let output = tick(&self.params, &mut self.state, &input);
        let stepped = Stepped {
            torques_nm: output.torques_nm,
            angles_rad: *self.state.angles_rad(),
            speeds_rad_s: *self.state.speeds_rad_s(),
            force_n: output.record.gains.grasp[0],
            mode: output.record.mode,
            fault: output.record.fault,
            noticed: output.record.notice,
            refused: output.record.answer.and_then(|answer| answer.refused),
        };
        self.record = Some(output.record);
        Ok(stepped)
    }
}
