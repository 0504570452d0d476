//! The device: sessions and requests around the tick. Firmware is this and drivers; a host that holds one too has the
//! firmware's twin.
//!
//! A tick takes at most one request, so that its time is bounded. Requests that the law has nothing to do with are
//! answered here; commands go into the tick, which answers them.

use crate::command::{Command, Refusal};
use crate::event::{Event, Events};
use crate::fault::Raised;
use crate::identity::{Clock, Identity};
use crate::link::message::{Packet, Reply, Request, Signals};
use crate::supervisor::Mode;
use crate::telemetry::{INTERFACE_VERSION, Record};
use crate::tick::{Input, Params, Sensed, State, tick};

/// What a tick gets from the joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading<const J: usize> {
    /// Encoder counts.
    Counts([i32; J]),
    /// Joints that could not be read or driven.
    Failed(Raised),
}

/// What a tick gets.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs<const J: usize> {
    /// The joints.
    pub reading: Reading<J>,
    /// Whether the tick before missed its deadline.
    pub late: bool,
    /// How long it took, processor cycles; 0 where nothing counts them.
    pub cycles: u32,
    /// Records and replies that were lost since the start because a queue was full.
    pub dropped: u32,
    /// A request.
    pub packet: Option<Packet<J>>,
}

/// What a tick gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Outputs<const J: usize> {
    /// Torques of the next tick, N m.
    pub torques_nm: [f32; J],
    /// What the tick did.
    pub record: Record<f32, J>,
    /// Whether the record is to be sent, and what of it.
    pub telemetry: Option<Signals>,
    /// The answer to the request.
    pub reply: Option<Reply<'static, J>>,
}

/// A hand's controller with its link.
#[derive(Clone, Debug)]
pub struct Device<const J: usize, const F: usize> {
    params: Params<f32, J, F>,
    state: State<f32, J, F>,
    identity: Identity<'static>,
    session: Session,
    telemetry: Telemetry,
}

impl<const J: usize, const F: usize> Device<J, F> {
    /// Disarmed, silent, and nobody has said hello.
    pub fn new(params: Params<f32, J, F>, identity: Identity<'static>) -> Self {
        Self {
            params,
            state: State::new(),
            identity,
            session: Session { number: 0, sequence: 0, understood: false },
            telemetry: Telemetry { decimation: 0, signals: Signals::NONE, left: 0, sent: 0 },
        }
    }

    /// The parameters.
    pub fn params(&self) -> &Params<f32, J, F> {
        &self.params
    }

    /// What the tick remembers.
    pub fn state(&self) -> &State<f32, J, F> {
        &self.state
    }

    /// One tick, with its request.
    pub fn tick(&mut self, inputs: &Inputs<J>) -> Outputs<J> {
        let asked = match &inputs.packet {
            Some(packet) => self.ask(packet),
            None => Asked::Nothing,
        };
        let heartbeat = matches!(asked, Asked::Heartbeat { .. });
        let command = match asked {
            Asked::Command { command, .. } => Some(command),
            _ => None,
        };
        let input = Input {
            sensed: match &inputs.reading {
                Reading::Counts(counts) => Sensed::Counts(counts),
                Reading::Failed(raised) => Sensed::Failed(*raised),
            },
            events: Events::NONE
                .with(Event::Heartbeat, heartbeat)
                .with(Event::Late, inputs.late)
                .with(Event::FallbackClock, self.identity.clock == Clock::Fallback),
            command,
        };
        let mut output = tick(&self.params, &mut self.state, &input);
        output.record.cycles = inputs.cycles;
        output.record.dropped = inputs.dropped;
        let telemetry = self.telemetry.due();
        if telemetry.is_some() {
            output.record.sequence = self.telemetry.sent;
            self.telemetry.sent = self.telemetry.sent.wrapping_add(1);
        }
        let reply = match asked {
            Asked::Nothing => None,
            Asked::Answered(reply) => Some(reply),
            Asked::Heartbeat { sequence } => Some(Reply::Answer { sequence, refused: None }),
            Asked::Command { sequence, .. } => {
                let refused = output.record.answer.and_then(|answer| answer.refused);
                Some(Reply::Answer { sequence, refused })
            }
        };
        Outputs { torques_nm: output.torques_nm, record: output.record, telemetry, reply }
    }

    /// What becomes of a request before the tick.
    fn ask(&mut self, packet: &Packet<J>) -> Asked<J> {
        let sequence = packet.sequence;
        let answer = |refused| Asked::Answered(Reply::Answer { sequence, refused });
        match packet.request {
            Request::Hello { interface_version } => {
                self.session = Session {
                    number: self.session.number.wrapping_add(1),
                    sequence,
                    understood: interface_version == INTERFACE_VERSION,
                };
                let (session, identity) = (self.session.number, self.identity);
                return Asked::Answered(Reply::Identity { sequence, session, identity });
            }
            Request::Command(Command::Stop) => {
                return Asked::Command { sequence, command: Command::Stop };
            }
            _ => {}
        }
        if let Some(refusal) = self.session.refuse(packet.session, sequence) {
            return answer(Some(refusal));
        }
        match packet.request {
            Request::Command(command) => Asked::Command { sequence, command },
            Request::Heartbeat => Asked::Heartbeat { sequence },
            Request::SetParameter { parameter, index, value } => {
                if self.state.mode() != Mode::Disarmed {
                    return answer(Some(Refusal::NotDisarmed));
                }
                answer(self.params.set(parameter, index, value).err())
            }
            Request::GetParameter { parameter, index } => match self.params.get(parameter, index) {
                Ok(value) => Asked::Answered(Reply::Value { sequence, parameter, index, value }),
                Err(refusal) => answer(Some(refusal)),
            },
            Request::Telemetry { decimation, signals } => {
                if !signals.are_known() {
                    return answer(Some(Refusal::OutOfRange));
                }
                self.telemetry = Telemetry { decimation, signals, left: 0, ..self.telemetry };
                answer(None)
            }
            Request::Joints(_) => answer(Some(Refusal::JointsAreReal)),
            // Taken above.
            Request::Hello { .. } => answer(None),
        }
    }
}

/// What became of a request before the tick.
enum Asked<const J: usize> {
    Nothing,
    Answered(Reply<'static, J>),
    Heartbeat { sequence: u16 },
    Command { sequence: u16, command: Command },
}

/// With whom the device speaks.
#[derive(Clone, Copy, Debug)]
struct Session {
    /// 0: nobody has said hello.
    number: u16,
    /// Number of the last request that was taken.
    sequence: u16,
    /// Whether the host has the same interface version.
    understood: bool,
}

impl Session {
    /// Why a request of this session and number is not taken; otherwise it is now the last.
    fn refuse(&mut self, session: u16, sequence: u16) -> Option<Refusal> {
        if self.number == 0 || session != self.number {
            return Some(Refusal::NoSession);
        }
        if !self.understood {
            return Some(Refusal::OtherInterface);
        }
        // Ahead by less than half the range, modulo 2^16.
        let ahead = sequence.wrapping_sub(self.sequence);
        if ahead == 0 || ahead >= 1 << 15 {
            return Some(Refusal::OutOfOrder);
        }
        self.sequence = sequence;
        None
    }
}

/// Which records are sent.
#[derive(Clone, Copy, Debug)]
struct Telemetry {
    /// One in so many ticks; 0 for none.
    decimation: u16,
    signals: Signals,
    /// Ticks until the next one.
    left: u16,
    /// Records sent so far.
    sent: u32,
}

impl Telemetry {
    /// Whether this tick's record is to be sent.
    fn due(&mut self) -> Option<Signals> {
        if self.decimation == 0 {
            return None;
        }
        if self.left > 0 {
            self.left -= 1;
            return None;
        }
        self.left = self.decimation - 1;
        Some(self.signals)
    }
}
