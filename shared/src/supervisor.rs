//! The modes of the hand, and what takes it from one to the next.
//!
//! - **Disarmed**: no torque. The hand starts here.
//! - **Armed**: the joints are damped and their weight is held.
//! - **Moving**: the joints follow a path to a posture, and hold it then.
//! - **Closing**: the fingertips close until all of them touch. Where the hand's file gives no speed for that, the grasp begins at once.
//! - **Grasping**: the laws. Everything they remember is latched in the first tick; the force `f_d` grows from
//!   nothing over the soft start, attitudes (and joints, where the law has `u_I`) are held at full stiffness at once.
//! - **Carrying**: the laws at their force. What is held stays where it is, or goes where it is told. Without the virtual frame there
//!   is no such mode: the grasp stays a grasp.
//! - **PuttingDown**: what is held sinks until it stands on something.
//! - **Releasing**: force and stiffness fall in proportion to zero over the release time; fingertips that had closed go outwards
//!   again. Then the hand moves to its posture `open`, or, if it has none, is armed.
//! - **Fault**: no torque, until the fault is cleared.
//!
//! Where no torque is allowed there is none in the tick that enters the mode: no slew limit delays it. There the
//! amplifiers have no power either: without torque they are switched off, not merely told zero. From `Arm` on they have
//! it, and while they start ([`SupervisorConfig::amplifier_start_ms`]) the modes change as ever, but torque is zero and
//! time does not count: a `Grasp` that comes meanwhile is done, and its soft start begins when they have started.
//!
//! | in \ command    | Arm       | Disarm     | Grasp        | Release      | Stop     | ClearFault | Aim         | Posture    | Move         | PutDown      | Weigh        |
//! |-----------------|-----------|------------|--------------|--------------|----------|------------|-------------|------------|--------------|--------------|--------------|
//! | **Disarmed**    | Armed     | Disarmed   | NotArmed!    | NotGrasping! | Disarmed | NoFault!   | Disarmed    | NotArmed!  | NotCarrying! | NotCarrying! | NotCarrying! |
//! | **Armed**       | Armed     | Disarmed   | Closing      | NotGrasping! | Disarmed | NoFault!   | Armed       | Moving     | NotCarrying! | NotCarrying! | NotCarrying! |
//! | **Moving**      | Armed     | Disarmed   | Closing      | NotGrasping! | Disarmed | NoFault!   | Moving      | Moving     | NotCarrying! | NotCarrying! | NotCarrying! |
//! | **Closing**     | Closing!  | Closing!   | Closing      | Releasing    | Disarmed | NoFault!   | Closing     | Closing!   | NotCarrying! | NotCarrying! | NotCarrying! |
//! | **Grasping**    | Grasping! | Grasping!  | Grasping     | Releasing    | Disarmed | NoFault!   | Grasping    | Grasping!  | NotCarrying! | NotCarrying! | NotCarrying! |
//! | **Carrying**    | Grasping! | Grasping!  | Carrying     | Releasing    | Disarmed | NoFault!   | Carrying    | Grasping!  | Carrying     | PuttingDown  | Carrying     |
//! | **PuttingDown** | Grasping! | Grasping!  | PuttingDown! | Releasing    | Disarmed | NoFault!   | PuttingDown | Grasping!  | PuttingDown! | PuttingDown  | PuttingDown! |
//! | **Releasing**   | Releasing!| Releasing! | Releasing!   | Releasing    | Disarmed | NoFault!   | Releasing   | Releasing! | Releasing!   | Releasing!   | Releasing!   |
//! | **Fault**       | InFault!  | InFault!   | InFault!     | InFault!     | Fault    | Disarmed   | InFault!    | InFault!   | InFault!     | InFault!     | InFault!     |
//!
//! | in \ event       | *fault* | *released* | *opened*    | *touched*   | *missed*  | *firm*      | *down*      |
//! |------------------|---------|------------|-------------|-------------|-----------|-------------|-------------|
//! | **Disarmed**     | Fault   | Disarmed   | Disarmed    | Disarmed    | Disarmed  | Disarmed    | Disarmed    |
//! | **Armed**        | Fault   | Armed      | Armed       | Armed       | Armed     | Armed       | Armed       |
//! | **Moving**       | Fault   | Moving     | Moving      | Moving      | Moving    | Moving      | Moving      |
//! | **Closing**      | Fault   | Closing    | Closing     | Grasping    | Releasing | Closing     | Closing     |
//! | **Grasping**     | Fault   | Grasping   | Grasping    | Grasping    | Releasing | Carrying    | Grasping    |
//! | **Carrying**     | Fault   | Carrying   | Carrying    | Carrying    | Releasing | Carrying    | Carrying    |
//! | **PuttingDown**  | Fault   | PuttingDown| PuttingDown | PuttingDown | Releasing | PuttingDown | Carrying    |
//! | **Releasing**    | Fault   | Armed      | Moving      | Releasing   | Releasing | Releasing   | Releasing   |
//! | **Fault**        | Fault   | Fault      | Fault       | Fault       | Fault     | Fault       | Fault       |
//!
//! With `!`: refused, for this reason. A command that asks for what already is, is done and changes nothing; a grasp is
//! not latched anew. `Stop` is done in every mode: what was held falls. It does not hide a fault. `ClearFault` is refused
//! (`FaultPersists`) while the cause is there. Where the table takes a command, its tick may still object: no arming without a
//! heartbeat, no posture beyond the joints' ranges.
//!
//! A fault whose reaction is to let go (the loss of the link) turns closing and what comes after it into a release, and ends in the
//! mode *fault* like any other: when the release is over, or at once where there is nothing to release. Without torque it is
//! no fault: then nobody needs the link.
//!
//! In a tick, a fault that is there comes first, then the command, then the end of a release, then what the fingertips tell.

use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::command::{Answer, Command, Refusal};
use crate::fault::{Fault, Raised, Reaction};
use crate::parameter::ParameterError;
use crate::period::Period;
use serde::{Deserialize, Serialize};

/// A mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// No torque.
    Disarmed,
    /// The joints are damped and their weight is held.
    Armed,
    /// The joints follow a path to a posture, or hold it.
    Moving,
    /// The fingertips close until all of them touch.
    Closing,
    /// The grasp law is at work.
    Grasping,
    /// The object stays where it is, or goes where it is told.
    Carrying,
    /// The object sinks until it stands on something.
    PuttingDown,
    /// The grasp is let go.
    Releasing,
    /// No torque, because something is wrong.
    Fault,
}

impl Mode {
    /// Every mode.
    pub const ALL: [Self; 9] = [
        Self::Disarmed,
        Self::Armed,
        Self::Moving,
        Self::Closing,
        Self::Grasping,
        Self::Carrying,
        Self::PuttingDown,
        Self::Releasing,
        Self::Fault,
    ];

    /// Returns `true` if the amplifiers have power in it.
    pub const fn is_powered(self) -> bool {
        !matches!(self, Self::Disarmed | Self::Fault)
    }

    /// Returns `true` if the laws of a grasp are at work in it.
    pub const fn is_grasp(self) -> bool {
        matches!(self, Self::Grasping | Self::Carrying | Self::PuttingDown | Self::Releasing)
    }

    /// Its name in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Disarmed => "disarmed",
            Self::Armed => "armed",
            Self::Moving => "moving",
            Self::Closing => "closing",
            Self::Grasping => "grasping",
            Self::Carrying => "carrying",
            Self::PuttingDown => "putting down",
            Self::Releasing => "releasing",
            Self::Fault => "fault",
        }
    }

    pub(crate) fn load(from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mode = Self::ALL.get(usize::from(from.u8()?)).copied();
        mode.ok_or(SnapshotError::Malformed("no mode has this number"))
    }
}

/// An event in a mode: the commands, and what the tick itself notices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A command.
    Command(Command),
    /// A fault is there.
    Fault,
    /// The release time is over, and the hand has no posture to open to.
    Released,
    /// The release time is over, and the hand opens.
    Opened,
    /// All fingertips touch.
    Touched,
    /// There is nothing between the fingertips, or not between all of them.
    Missed,
    /// The force has grown to its full, and the hand can carry.
    Firm,
    /// The object that was put down stands.
    Down,
}

/// The outcome of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The mode after it, which may be the one before.
    Enter(Mode),
    /// The mode stays, and the command is refused.
    Refuse(Refusal),
}

/// The tables of the module's essay: a row a mode, a column a command or an event.
#[rustfmt::skip]
const TABLE: [[Outcome; COLUMNS]; 9] = {
    use Mode::{Armed, Carrying, Closing, Disarmed, Fault, Grasping, Moving, PuttingDown, Releasing};
    const fn to(mode: Mode) -> Outcome { Outcome::Enter(mode) }
    const fn no(refusal: Refusal) -> Outcome { Outcome::Refuse(refusal) }
    use Refusal as R;
    let (held, none, fault) = (no(R::NotCarrying), no(R::NoFault), to(Fault));
    let (grasp, sink, open, broken) = (no(R::Grasping), no(R::PuttingDown), no(R::Releasing), no(R::InFault));
    [
        // Arm             Disarm           Grasp             Release             Stop          Clear           Aim              Posture           Move         PutDown          Weigh         fault  released         opened           touched          missed          firm             down
        [to(Armed),        to(Disarmed),    no(R::NotArmed),  no(R::NotGrasping), to(Disarmed), none,           to(Disarmed),    no(R::NotArmed),  held,        held,            held,         fault, to(Disarmed),    to(Disarmed),    to(Disarmed),    to(Disarmed),   to(Disarmed),    to(Disarmed)],
        [to(Armed),        to(Disarmed),    to(Closing),      no(R::NotGrasping), to(Disarmed), none,           to(Armed),       to(Moving),       held,        held,            held,         fault, to(Armed),       to(Armed),       to(Armed),       to(Armed),      to(Armed),       to(Armed)],
        [to(Armed),        to(Disarmed),    to(Closing),      no(R::NotGrasping), to(Disarmed), none,           to(Moving),      to(Moving),       held,        held,            held,         fault, to(Moving),      to(Moving),      to(Moving),      to(Moving),     to(Moving),      to(Moving)],
        [no(R::Closing),   no(R::Closing),  to(Closing),      to(Releasing),      to(Disarmed), none,           to(Closing),     no(R::Closing),   held,        held,            held,         fault, to(Closing),     to(Closing),     to(Grasping),    to(Releasing),  to(Closing),     to(Closing)],
        [grasp,            grasp,           to(Grasping),     to(Releasing),      to(Disarmed), none,           to(Grasping),    grasp,            held,        held,            held,         fault, to(Grasping),    to(Grasping),    to(Grasping),    to(Releasing),  to(Carrying),    to(Grasping)],
        [grasp,            grasp,           to(Carrying),     to(Releasing),      to(Disarmed), none,           to(Carrying),    grasp,            to(Carrying),to(PuttingDown), to(Carrying), fault, to(Carrying),    to(Carrying),    to(Carrying),    to(Releasing),  to(Carrying),    to(Carrying)],
        [grasp,            grasp,           sink,             to(Releasing),      to(Disarmed), none,           to(PuttingDown), grasp,            sink,        to(PuttingDown), sink,         fault, to(PuttingDown), to(PuttingDown), to(PuttingDown), to(Releasing),  to(PuttingDown), to(Carrying)],
        [open,             open,            open,             to(Releasing),      to(Disarmed), none,           to(Releasing),   open,             open,        open,            open,         fault, to(Armed),       to(Moving),      to(Releasing),   to(Releasing),  to(Releasing),   to(Releasing)],
        [broken,           broken,          broken,           broken,             fault,        to(Disarmed),   broken,          broken,           broken,      broken,          broken,       fault, fault,           fault,           fault,           fault,          fault,           fault],
    ]
};
/// Commands and events.
const COLUMNS: usize = 18;

/// Returns the outcome of an event in a mode.
pub fn outcome(mode: Mode, event: Event) -> Outcome {
    let column = match event {
        Event::Command(command) => match command {
            Command::Arm => 0,
            Command::Disarm => 1,
            Command::Grasp(_) => 2,
            Command::Release => 3,
            Command::Stop => 4,
            Command::ClearFault => 5,
            Command::Aim { .. } => 6,
            Command::Posture { .. } => 7,
            Command::Move(_) => 8,
            Command::PutDown => 9,
            Command::Weigh => 10,
        },
        Event::Fault => 11,
        Event::Released => 12,
        Event::Opened => 13,
        Event::Touched => 14,
        Event::Missed => 15,
        Event::Firm => 16,
        Event::Down => 17,
    };
    // The table covers everything; were it ever to miss something, the safe side is without torque.
    TABLE.get(mode as usize).and_then(|row| row.get(column)).copied().unwrap_or(Outcome::Enter(Mode::Fault))
}

/// Times, as a user gives them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SupervisorConfig {
    /// Time over which the force grows, ms.
    pub soft_start_ms: u32,
    /// Time over which force and stiffness fall to zero, ms.
    pub release_ms: u32,
    /// Time that the amplifiers take to start, without torque, ms.
    pub amplifier_start_ms: u32,
}

impl SupervisorConfig {
    /// No time for anything.
    pub const LEAST: Self = Self { soft_start_ms: 0, release_ms: 0, amplifier_start_ms: 0 };

    /// Checks the times and prepares them.
    ///
    /// # Errors
    /// A time above an hour.
    pub fn prepare(&self, period: Period) -> Result<Ramps, ParameterError> {
        Ok(Ramps {
            soft_start: Ramp::new(period.ticks(self.soft_start_ms, "supervisor.soft_start_ms")?),
            release: Ramp::new(period.ticks(self.release_ms, "supervisor.release_ms")?),
            amplifier_start_ticks: period.ticks(self.amplifier_start_ms, "supervisor.amplifier_start_ms")?,
            has: Stages::NONE,
            retreat_ticks: 0,
        })
    }
}

/// The ramps of force and stiffness, prepared, and what comes before them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramps {
    soft_start: Ramp,
    release: Ramp,
    amplifier_start_ticks: u32,
    has: Stages,
    retreat_ticks: u32,
}

/// The stages of the cycle that a hand has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stages {
    /// Fingertips close before a grasp, and go outwards after it.
    pub closing: bool,
    /// After a release, the hand opens.
    pub opening: bool,
}

impl Stages {
    /// A grasp that begins at once, and ends armed.
    pub const NONE: Self = Self { closing: false, opening: false };
}

impl Ramps {
    /// The same for a hand that has such stages, and takes so many ticks to go outwards.
    #[must_use]
    pub fn with(self, has: Stages, retreat_ticks: u32) -> Self {
        Self { has, retreat_ticks: if has.closing { retreat_ticks } else { 0 }, ..self }
    }

    /// The stages that the hand has.
    pub fn has(&self) -> Stages {
        self.has
    }
}

/// A share that grows by the tick from nothing to one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ramp {
    ticks: u32,
    per_tick: f32,
}

impl Ramp {
    fn new(ticks: u32) -> Self {
        let whole = i32::try_from(ticks.max(1)).unwrap_or(i32::MAX);
        Self { ticks, per_tick: 1.0 / whole as f32 }
    }

    /// The share in the tick after `age` others; the last tick of the ramp has exactly one.
    fn share(&self, age: u32) -> f32 {
        let tick = age.saturating_add(1);
        if tick >= self.ticks {
            return 1.0;
        }
        tick as f32 * self.per_tick
    }
}

/// The source of the joints' torques in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// Nothing: no torque.
    Off,
    /// Damping, and what holds the weight.
    Hold,
    /// A path to a posture.
    Path,
    /// Fingertips that close, or go outwards.
    Close,
    /// The grasp law.
    Grip {
        /// Share of forces: see [`Ramp`](crate::control::Ramp).
        force_share: f32,
        /// Share of stiffnesses: see [`Ramp`](crate::control::Ramp).
        stiffness_share: f32,
    },
}

/// The mode and how long it has lasted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Supervisor {
    mode: Mode,
    fault: Option<Raised>,
    /// Ticks in this mode before this one, but for those in which the amplifiers started.
    age: u32,
    /// Ticks until the amplifiers have started.
    starting: u32,
    /// The progress of the soft start when the release began, in ticks of grasping.
    grasped: u32,
}

impl Supervisor {
    /// Disarmed, without a fault.
    pub const fn new() -> Self {
        Self { mode: Mode::Disarmed, fault: None, age: 0, starting: 0, grasped: 0 }
    }

    pub(crate) fn save(&self, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        to.u8(self.mode as u8)?;
        // No fault has the number 0.
        to.u8(self.fault.map_or(0, |raised| raised.fault.number()))?;
        let joint = self.fault.and_then(|raised| raised.joint);
        to.u8(u8::from(joint.is_some()))?;
        to.u8(joint.unwrap_or(0))?;
        to.u32(self.age)?;
        to.u32(self.starting)?;
        to.u32(self.grasped)
    }

    pub(crate) fn load(from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mode = Mode::load(from)?;
        let (number, has_joint, joint) = (from.u8()?, from.flag()?, from.u8()?);
        let fault = match number {
            0 => None,
            number => {
                let fault = Fault::from_number(number);
                let fault = fault.ok_or(SnapshotError::Malformed("no fault has this number"))?;
                Some(Raised { fault, joint: has_joint.then_some(joint) })
            }
        };
        Ok(Self { mode, fault, age: from.u32()?, starting: from.u32()?, grasped: from.u32()? })
    }

    /// The mode.
    pub const fn mode(&self) -> Mode {
        self.mode
    }

    /// The fault that led to the mode [`Mode::Fault`], or lets the object go now.
    pub const fn fault(&self) -> Option<Raised> {
        self.fault
    }

    /// Begins a tick: `fault` is one that is there now, `objection` why the command can't be done even in a mode that
    /// takes it. Answers the command.
    pub fn begin(
        &mut self,
        ramps: &Ramps,
        fault: Option<Raised>,
        command: Option<Command>,
        objection: Option<Refusal>,
    ) -> Option<Answer> {
        if self.starting > 0 {
            self.starting -= 1;
        } else {
            self.age = self.age.saturating_add(1);
        }
        if let Some(raised) = fault {
            self.raise(raised);
        }
        let was_powered = self.mode.is_powered();
        let answer = command.map(|command| Answer { command, refused: self.obey(command, fault, objection) });
        if !was_powered && self.mode.is_powered() {
            self.starting = ramps.amplifier_start_ticks;
        }
        if !ramps.has.closing && self.mode == Mode::Closing {
            self.take(Event::Touched);
        }
        let released = ramps.release.ticks.saturating_add(ramps.retreat_ticks);
        if self.mode == Mode::Releasing && self.starting == 0 && self.age >= released {
            self.take(if ramps.has.opening { Event::Opened } else { Event::Released });
        }
        answer
    }

    /// Takes what the tick notices by itself.
    pub(crate) fn notice(&mut self, event: Event) {
        self.take(event);
    }

    /// Does what the fault asks for; the fault that came first is kept.
    pub fn raise(&mut self, raised: Raised) {
        let event = match raised.fault.reaction() {
            Reaction::TorqueOff => Event::Fault,
            Reaction::Release => match self.mode {
                Mode::Disarmed => return,
                Mode::Armed | Mode::Moving | Mode::Fault => Event::Fault,
                Mode::Closing | Mode::Grasping | Mode::Carrying | Mode::PuttingDown | Mode::Releasing => {
                    Event::Command(Command::Release)
                }
            },
        };
        self.take(event);
        self.fault = self.fault.or(Some(raised));
    }

    /// Returns the source of the joints' torques in this tick.
    pub fn drive(&self, ramps: &Ramps) -> Drive {
        match self.mode {
            Mode::Disarmed | Mode::Fault => Drive::Off,
            _ if self.starting > 0 => Drive::Off,
            Mode::Armed => Drive::Hold,
            Mode::Moving => Drive::Path,
            Mode::Closing => Drive::Close,
            Mode::Carrying | Mode::PuttingDown => Drive::Grip { force_share: 1.0, stiffness_share: 1.0 },
            Mode::Releasing if ramps.retreat_ticks > 0 && self.age >= ramps.release.ticks => Drive::Close,
            Mode::Grasping => {
                Drive::Grip { force_share: ramps.soft_start.share(self.age), stiffness_share: 1.0 }
            }
            Mode::Releasing => {
                let left = 1.0 - ramps.release.share(self.age);
                Drive::Grip {
                    force_share: ramps.soft_start.share(self.grasped) * left,
                    stiffness_share: left,
                }
            }
        }
    }

    /// Returns `true` if the force is on its way up or down, so that torques change with it.
    pub fn ramps(&self, ramps: &Ramps) -> bool {
        match self.mode {
            Mode::Grasping => self.age < ramps.soft_start.ticks,
            Mode::PuttingDown | Mode::Releasing => true,
            _ => false,
        }
    }

    fn obey(
        &mut self,
        command: Command,
        fault: Option<Raised>,
        objection: Option<Refusal>,
    ) -> Option<Refusal> {
        if command == Command::ClearFault && fault.is_some() {
            return Some(Refusal::FaultPersists);
        }
        let event = Event::Command(command);
        match (outcome(self.mode, event), objection) {
            (Outcome::Enter(_), Some(objection)) => Some(objection),
            _ => self.take(event),
        }
    }

    fn take(&mut self, event: Event) -> Option<Refusal> {
        match outcome(self.mode, event) {
            Outcome::Refuse(refusal) => return Some(refusal),
            Outcome::Enter(mode) if mode == self.mode => {}
            Outcome::Enter(mode) => {
                // A fault that lets go is not hidden by a Stop, nor forgotten at the end of the release.
                let letting_go = self.mode == Mode::Releasing && self.fault.is_some();
                let mode = if letting_go { Mode::Fault } else { mode };
                self.grasped = match self.mode {
                    Mode::Grasping => self.age.saturating_sub(1),
                    _ => u32::MAX,
                };
                if self.mode == Mode::Fault {
                    self.fault = None;
                }
                // Fingertips that have grasped nothing have nothing to let go.
                let is_empty = self.mode == Mode::Closing && mode == Mode::Releasing;
                self.mode = mode;
                self.age = if is_empty { u32::MAX } else { 0 };
                if !mode.is_powered() {
                    self.starting = 0;
                }
            }
        }
        None
    }
}

impl Default for Supervisor {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Grasp;
    use crate::fault::Fault;
    use std::format;
    use std::vec::Vec;

    const RAISED: Raised = Raised { fault: Fault::Overspeed, joint: Some(2) };
    const GRASP: Command = Command::Grasp(Grasp::CONFIGURED);
    const POSTURE: Command = Command::Posture { posture: None, time_ms: 0 };

    fn starting_ramps(soft_start_ms: u32, release_ms: u32, amplifier_start_ms: u32) -> Ramps {
        let config = SupervisorConfig { soft_start_ms, release_ms, amplifier_start_ms };
        config.prepare(Period::from_us(1000).unwrap()).unwrap()
    }

    fn ramps(soft_start_ms: u32, release_ms: u32) -> Ramps {
        starting_ramps(soft_start_ms, release_ms, 0)
    }

    /// A supervisor that was led into a mode.
    fn in_mode(mode: Mode, ramps: &Ramps) -> Supervisor {
        let mut supervisor = Supervisor::new();
        let commands: &[Command] = match mode {
            Mode::Disarmed | Mode::Fault => &[],
            Mode::Armed => &[Command::Arm],
            Mode::Moving => &[Command::Arm, POSTURE],
            Mode::Closing | Mode::Grasping | Mode::Carrying | Mode::PuttingDown => &[Command::Arm, GRASP],
            Mode::Releasing => &[Command::Arm, GRASP, Command::Release],
        };
        let ramps = &ramps.with(Stages { closing: mode == Mode::Closing, opening: false }, 0);
        for &command in commands {
            let answer = supervisor.begin(ramps, None, Some(command), None);
            assert_eq!(answer, Some(Answer { command, refused: None }));
        }
        match mode {
            Mode::Fault => assert_eq!(supervisor.begin(ramps, Some(RAISED), None, None), None),
            Mode::Carrying | Mode::PuttingDown => supervisor.notice(Event::Firm),
            _ => {}
        }
        if mode == Mode::PuttingDown {
            supervisor.begin(ramps, None, Some(Command::PutDown), None);
        }
        assert_eq!(supervisor.mode(), mode);
        supervisor
    }

    fn events() -> Vec<Event> {
        let noticed =
            [Event::Released, Event::Opened, Event::Touched, Event::Missed, Event::Firm, Event::Down];
        Command::ALL.map(Event::Command).into_iter().chain([Event::Fault]).chain(noticed).collect()
    }

    #[test]
    fn the_code_is_the_table_of_the_essay() {
        let table: Vec<Vec<&str>> = include_str!("supervisor.rs")
            .lines()
            .filter_map(|line| line.strip_prefix("//! | **"))
            .map(|line| line.split('|').map(|cell| cell.trim().trim_end_matches("**")).collect())
            .collect();
        // One of the commands, one of the events.
        let (commands, noticed) = table.split_at(Mode::ALL.len());
        assert_eq!(noticed.len(), Mode::ALL.len());
        for (mode, (row, rest)) in Mode::ALL.into_iter().zip(commands.iter().zip(noticed)) {
            assert_eq!((row[0], rest[0]), (&*format!("{mode:?}"), &*format!("{mode:?}")));
            let cells: Vec<_> = row[1..=Command::ALL.len()].iter().chain(&rest[1..]).collect();
            for (event, cell) in events().into_iter().zip(cells) {
                let told = match outcome(mode, event) {
                    Outcome::Enter(mode) => format!("{mode:?}"),
                    Outcome::Refuse(refusal) => format!("{refusal:?}!"),
                };
                assert_eq!(&told, cell, "{mode:?}, {event:?}");
            }
        }
    }

    #[test]
    fn what_the_table_must_never_allow() {
        for mode in Mode::ALL {
            for event in events() {
                let Outcome::Enter(next) = outcome(mode, event) else { continue };
                // Torque begins by Arm from Disarmed alone, a grasp by Grasp without one, or by the touch that it led to.
                if matches!(mode, Mode::Disarmed | Mode::Fault)
                    && !matches!(next, Mode::Disarmed | Mode::Fault)
                {
                    assert_eq!((mode, event), (Mode::Disarmed, Event::Command(Command::Arm)));
                }
                if next == Mode::Closing && mode != Mode::Closing {
                    assert!(matches!(mode, Mode::Armed | Mode::Moving) && event == Event::Command(GRASP));
                }
                if next == Mode::Grasping && mode != Mode::Grasping {
                    assert_eq!((mode, event), (Mode::Closing, Event::Touched));
                }
                // A fault is left by ClearFault alone.
                if mode == Mode::Fault && next != Mode::Fault {
                    assert_eq!((next, event), (Mode::Disarmed, Event::Command(Command::ClearFault)));
                }
            }
            assert_eq!(outcome(mode, Event::Fault), Outcome::Enter(Mode::Fault));
            assert!(matches!(
                outcome(mode, Event::Command(Command::Stop)),
                Outcome::Enter(Mode::Disarmed | Mode::Fault)
            ));
        }
    }

    #[test]
    fn every_mode_and_command_does_what_the_table_says() {
        let ramps = ramps(100, 100).with(Stages { closing: true, opening: false }, 0);
        for mode in Mode::ALL {
            for command in Command::ALL {
                let mut supervisor = in_mode(mode, &ramps);
                let answer = supervisor.begin(&ramps, None, Some(command), None).unwrap();
                assert_eq!(answer.command, command);
                let (next, refused) = match outcome(mode, Event::Command(command)) {
                    // Where nothing was grasped, there is nothing to let go: the release is over in its tick.
                    Outcome::Enter(Mode::Releasing) if mode == Mode::Closing => (Mode::Armed, None),
                    Outcome::Enter(next) => (next, None),
                    Outcome::Refuse(refusal) => (mode, Some(refusal)),
                };
                assert_eq!((supervisor.mode(), answer.refused), (next, refused), "{mode:?}, {command:?}");
                assert_eq!(supervisor.fault().is_some(), next == Mode::Fault);
                if command == Command::Stop {
                    assert_eq!((answer.refused, supervisor.drive(&ramps)), (None, Drive::Off));
                }
            }
        }
    }

    #[test]
    fn a_fault_wins_over_every_command() {
        let ramps = ramps(100, 100);
        for mode in Mode::ALL {
            for command in Command::ALL {
                let mut supervisor = in_mode(mode, &ramps);
                let answer = supervisor.begin(&ramps, Some(RAISED), Some(command), None).unwrap();
                assert_eq!((supervisor.mode(), supervisor.drive(&ramps)), (Mode::Fault, Drive::Off));
                let refusal = match command {
                    Command::Stop => None,
                    Command::ClearFault => Some(Refusal::FaultPersists),
                    _ => Some(Refusal::InFault),
                };
                assert_eq!(answer.refused, refusal, "{mode:?}, {command:?}");
            }
        }
    }

    #[test]
    fn the_first_fault_is_the_one_that_is_reported() {
        let ramps = ramps(100, 100);
        let mut supervisor = in_mode(Mode::Fault, &ramps);
        supervisor.begin(&ramps, Some(Raised::at(0, Fault::CountJump)), None, None);
        assert_eq!(supervisor.fault(), Some(RAISED));
        supervisor.begin(&ramps, None, Some(Command::ClearFault), None);
        assert_eq!((supervisor.mode(), supervisor.fault()), (Mode::Disarmed, None));
        supervisor.begin(&ramps, Some(Raised::at(0, Fault::CountJump)), None, None);
        assert_eq!(supervisor.fault(), Some(Raised::at(0, Fault::CountJump)));
    }

    const LINK_LOST: Raised = Raised::of_hand(Fault::LinkLost);

    #[test]
    fn a_lost_link_lets_go_and_then_is_a_fault() {
        let ramps = ramps(4, 4).with(Stages { closing: true, opening: false }, 0);
        for stopped in [false, true] {
            let mut supervisor = in_mode(Mode::Grasping, &ramps);
            for left in [0.75, 0.5, 0.25] {
                supervisor.begin(&ramps, Some(LINK_LOST), None, None);
                assert_eq!((supervisor.mode(), supervisor.fault()), (Mode::Releasing, Some(LINK_LOST)));
                near(shares(&supervisor, &ramps), 0.25 * left, left);
            }
            // The link may come back meanwhile: what began is brought to its end, and is not hidden by a stop.
            let command = stopped.then_some(Command::Stop);
            supervisor.begin(&ramps, None, command, None);
            assert_eq!(supervisor.mode() == Mode::Fault, stopped);
            supervisor.begin(&ramps, None, None, None);
            assert_eq!((supervisor.mode(), supervisor.fault()), (Mode::Fault, Some(LINK_LOST)));
            supervisor.begin(&ramps, None, Some(Command::ClearFault), None);
            assert_eq!((supervisor.mode(), supervisor.fault()), (Mode::Disarmed, None));
        }
        for (mode, next) in [
            (Mode::Disarmed, Mode::Disarmed),
            (Mode::Armed, Mode::Fault),
            (Mode::Moving, Mode::Fault),
            // Nothing is held yet: there is nothing to let go.
            (Mode::Closing, Mode::Fault),
            (Mode::Grasping, Mode::Releasing),
            (Mode::Carrying, Mode::Releasing),
            (Mode::PuttingDown, Mode::Releasing),
            (Mode::Releasing, Mode::Releasing),
            (Mode::Fault, Mode::Fault),
        ] {
            let mut supervisor = in_mode(mode, &ramps);
            supervisor.begin(&ramps, Some(LINK_LOST), None, None);
            assert_eq!(supervisor.mode(), next, "from {mode:?}");
            assert_eq!(supervisor.fault().is_some(), next != Mode::Disarmed);
        }
        // Another fault takes the torque away at once; the first is the one that is reported.
        let mut supervisor = in_mode(Mode::Grasping, &ramps);
        supervisor.begin(&ramps, Some(LINK_LOST), None, None);
        supervisor.begin(&ramps, Some(RAISED), None, None);
        assert_eq!((supervisor.mode(), supervisor.fault()), (Mode::Fault, Some(LINK_LOST)));
    }

    #[test]
    fn an_objection_refuses_what_the_table_would_take_and_nothing_else() {
        let ramps = ramps(100, 100).with(Stages { closing: true, opening: false }, 0);
        let objection = Some(Refusal::NoHeartbeat);
        for mode in Mode::ALL {
            for command in Command::ALL {
                let mut supervisor = in_mode(mode, &ramps);
                let answer = supervisor.begin(&ramps, None, Some(command), objection).unwrap();
                let refused = match outcome(mode, Event::Command(command)) {
                    Outcome::Enter(_) => objection,
                    Outcome::Refuse(refusal) => Some(refusal),
                };
                assert_eq!((answer.refused, supervisor.mode()), (refused, mode));
            }
        }
    }

    /// Force and attitude shares of a tick.
    fn shares(supervisor: &Supervisor, ramps: &Ramps) -> (f32, f32) {
        match supervisor.drive(ramps) {
            Drive::Grip { force_share, stiffness_share } => (force_share, stiffness_share),
            drive => panic!("{drive:?}"),
        }
    }

    #[track_caller]
    fn near(shares: (f32, f32), force: f32, attitude: f32) {
        assert!((shares.0 - force).abs() < 1e-6 && (shares.1 - attitude).abs() < 1e-6, "{shares:?}");
    }

    #[test]
    fn force_grows_and_falls_over_the_stated_times() {
        let ramps = ramps(4, 5);
        let mut supervisor = in_mode(Mode::Grasping, &ramps);
        for force in [0.25, 0.5, 0.75, 1.0, 1.0] {
            near(shares(&supervisor, &ramps), force, 1.0);
            supervisor.begin(&ramps, None, None, None);
        }
        supervisor.begin(&ramps, None, Some(Command::Release), None);
        for left in [0.8, 0.6, 0.4, 0.2, 0.0] {
            assert_eq!(supervisor.mode(), Mode::Releasing);
            near(shares(&supervisor, &ramps), left, left);
            supervisor.begin(&ramps, None, None, None);
        }
        assert_eq!((supervisor.mode(), supervisor.drive(&ramps)), (Mode::Armed, Drive::Hold));
    }

    #[test]
    fn a_release_amid_the_soft_start_begins_from_the_force_reached() {
        let ramps = ramps(4, 2);
        let mut supervisor = in_mode(Mode::Grasping, &ramps);
        supervisor.begin(&ramps, None, None, None);
        near(shares(&supervisor, &ramps), 0.5, 1.0);
        supervisor.begin(&ramps, None, Some(Command::Release), None);
        near(shares(&supervisor, &ramps), 0.25, 0.5);
        supervisor.begin(&ramps, None, Some(Command::Release), None);
        near(shares(&supervisor, &ramps), 0.0, 0.0);
    }

    #[test]
    fn without_times_everything_is_at_once() {
        let ramps = ramps(0, 0);
        let mut supervisor = in_mode(Mode::Grasping, &ramps);
        near(shares(&supervisor, &ramps), 1.0, 1.0);
        supervisor.begin(&ramps, None, Some(Command::Release), None);
        assert_eq!(supervisor.mode(), Mode::Armed);
    }

    #[test]
    fn a_grasp_of_many_hours_does_not_start_again() {
        let ramps = ramps(4, 2);
        let mut supervisor = Supervisor { age: u32::MAX - 1, ..in_mode(Mode::Grasping, &ramps) };
        for _ in 0..4 {
            supervisor.begin(&ramps, None, None, None);
            near(shares(&supervisor, &ramps), 1.0, 1.0);
        }
    }

    #[test]
    fn times_out_of_range_are_named() {
        let period = Period::from_us(1000).unwrap();
        let good = SupervisorConfig::LEAST;
        let parameter = |config: SupervisorConfig| config.prepare(period).unwrap_err().parameter;
        let config = SupervisorConfig { soft_start_ms: 4_000_000, ..good };
        assert_eq!(parameter(config), "supervisor.soft_start_ms");
        let config = SupervisorConfig { release_ms: 4_000_000, ..good };
        assert_eq!(parameter(config), "supervisor.release_ms");
        let config = SupervisorConfig { amplifier_start_ms: 4_000_000, ..good };
        assert_eq!(parameter(config), "supervisor.amplifier_start_ms");
    }

    #[test]
    fn while_the_amplifiers_start_there_is_power_but_no_torque() {
        let ramps = starting_ramps(4, 5, 3);
        let mut supervisor = Supervisor::new();
        let mut tick = |command| {
            let answer = supervisor.begin(&ramps, None, command, None);
            assert_eq!(answer.and_then(|answer| answer.refused), None);
            (supervisor.mode(), supervisor.drive(&ramps))
        };
        assert_eq!(tick(None), (Mode::Disarmed, Drive::Off));
        assert_eq!(tick(Some(Command::Arm)), (Mode::Armed, Drive::Off));
        assert_eq!(tick(None), (Mode::Armed, Drive::Off));
        assert_eq!(
            tick(Some(Command::Arm)),
            (Mode::Armed, Drive::Off),
            "armed already: it does not start anew"
        );
        assert_eq!(tick(None), (Mode::Armed, Drive::Hold));
        // Armed again after a stop, they start again; so they do after a fault.
        assert_eq!(tick(Some(Command::Stop)), (Mode::Disarmed, Drive::Off));
        for _ in 0..2 {
            assert_eq!(tick(Some(Command::Arm)), (Mode::Armed, Drive::Off));
            assert_eq!(tick(Some(Command::Stop)), (Mode::Disarmed, Drive::Off));
        }
    }

    #[test]
    fn a_grasp_while_the_amplifiers_start_is_the_same_grasp_later() {
        let late = |start_ms, release| {
            let ramps = starting_ramps(4, 5, start_ms);
            let mut supervisor = in_mode(Mode::Grasping, &ramps);
            let mut drives = Vec::new();
            for tick in 0..40 {
                let command = (release == Some(tick)).then_some(Command::Release);
                if tick > 0 {
                    supervisor.begin(&ramps, None, command, None);
                }
                drives.push((supervisor.mode(), supervisor.drive(&ramps)));
            }
            drives
        };
        let torque = |drives: &[(Mode, Drive)]| {
            let drives = drives.iter().map(|&(_, drive)| drive).skip_while(|&drive| drive == Drive::Off);
            drives.take(20).collect::<Vec<_>>()
        };
        let (now, then) = (late(0, None), late(10, None));
        assert_eq!(torque(&now), torque(&then));
        assert_eq!(now[0].1, Drive::Grip { force_share: 0.25, stiffness_share: 1.0 });
        // Armed a tick before the grasp: nine are left of ten.
        assert!(then[..9].iter().all(|&tick| tick == (Mode::Grasping, Drive::Off)) && then[9].1 == now[0].1);
        // A release that comes before any torque takes its time too, and ends armed.
        let released = late(10, Some(3));
        assert_eq!(released[3], (Mode::Releasing, Drive::Off));
        assert!(released[9..14].iter().all(|tick| tick.0 == Mode::Releasing));
        assert_eq!(released[14], (Mode::Armed, Drive::Hold));
    }

    #[test]
    fn power_is_where_torque_may_be() {
        for mode in Mode::ALL {
            let ramps = ramps(4, 4);
            let off = in_mode(mode, &ramps).drive(&ramps) == Drive::Off;
            assert_eq!(mode.is_powered(), !off, "{mode:?}");
        }
    }
}
