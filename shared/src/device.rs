//! The device: sessions and requests around the tick. Firmware is this and drivers; a host that holds one too has the
//! firmware's twin.
//!
//! A tick takes at most one request, so that its time is bounded. Requests that the law has nothing to do with are
//! answered here; commands go into the tick, which answers them.

use crate::command::{self, Command, Refusal};
use crate::event::{Event, Events};
use crate::fault::Raised;
use crate::identity::{Clock, Identity};
use crate::joints::{Joints, Reading};
use crate::link::message::{Form, Packet, Reply, Request, Signals};
use crate::link::rate::FIRST_BAUD;
use crate::saved::{Order, Saving};
use crate::store::StoreError;
use crate::supervisor::Mode;
use crate::telemetry::burst::{Burst, Caught};
use crate::telemetry::snapshot::{Outgoing, Part};
use crate::telemetry::{INTERFACE_VERSION, Record};
use crate::tick::{self, Input, Params, Sensed, State};

/// The inputs of a tick besides the joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inputs<const J: usize> {
    /// `true` if the tick before missed its deadline.
    pub late: bool,
    /// `true` if the supply was too low at some time since the tick before.
    pub supply_low: bool,
    /// Its time, processor cycles; 0 where nothing counts them.
    pub cycles: u32,
    /// Records and replies that were lost since the start because a queue was full.
    pub dropped: u32,
    /// Records and parts of snapshots that still wait for the line.
    pub waiting: usize,
    /// A request.
    pub packet: Option<Packet<J>>,
    /// `true` if there is no room for an answer; then there is no request either.
    pub no_room: bool,
    /// The result of the order that an earlier tick gave to the store.
    pub stored: Option<Result<(), StoreError>>,
}

/// The outputs of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Outputs<const J: usize> {
    /// Torques of the motors in the next tick, N m.
    pub torques_nm: [f32; J],
    /// `true` if the amplifiers have power in it.
    pub powered: bool,
    /// The record of the tick.
    pub record: Record<J>,
    /// The form in which the tick is told, if it is.
    pub telemetry: Option<Form>,
    /// The answer to the request.
    pub reply: Option<Reply<'static, J>>,
    /// The rate that the line is to have once the answer has left, baud.
    pub baud: Option<u32>,
    /// A part of a snapshot that is to be sent.
    pub part: Option<Part>,
    /// The order to the store; there is no other until [`Inputs::stored`] says what became of it.
    pub order: Option<Order>,
}

impl<const J: usize> Outputs<J> {
    /// Returns the outputs before the first tick: nothing.
    pub const fn none() -> Self {
        Self {
            torques_nm: [0.0; J],
            powered: false,
            record: Record::BLANK,
            telemetry: None,
            reply: None,
            baud: None,
            part: None,
            order: None,
        }
    }
}

/// A hand's controller with its link.
#[derive(Clone, Debug)]
pub struct Device<const J: usize, const F: usize> {
    params: Params<J, F>,
    state: State<J, F>,
    identity: Identity<'static>,
    session: Session,
    telemetry: Telemetry,
    snapshot: Outgoing<J>,
    /// Rates that its line has besides the first.
    faster_bauds: &'static [u32],
    saving: Option<Save>,
    /// The answer to a save that is over, until a tick has no other.
    saved: Option<(u16, Option<Refusal>)>,
    /// `true` if what is read with the signs and zeros that were set is known to be right.
    is_confirmed: bool,
    /// The failure of the joints when they were last written.
    failed: Option<Raised>,
}

impl<const J: usize, const F: usize> Device<J, F> {
    /// Disarmed, silent, and nobody has said hello.
    pub fn new(params: Params<J, F>, identity: Identity<'static>) -> Self {
        Self {
            params,
            state: State::new(),
            identity,
            session: Session::NONE,
            telemetry: Telemetry::OFF,
            snapshot: Outgoing::new(),
            faster_bauds: &[],
            saving: None,
            saved: None,
            is_confirmed: true,
            failed: None,
        }
    }

    /// The same with a line that has faster rates than the first.
    #[must_use]
    pub fn with_faster_bauds(self, faster_bauds: &'static [u32]) -> Self {
        Self { faster_bauds, ..self }
    }

    /// The parameters.
    pub fn params(&self) -> &Params<J, F> {
        &self.params
    }

    /// Returns the state of the tick.
    pub fn state(&self) -> &State<J, F> {
        &self.state
    }

    /// One tick, with the joints read before and written after it. Torques that could not be written are a failed reading in
    /// the next. Joints that failed work again when the tick has taken the user's command to clear the fault, and not
    /// before.
    pub fn turn(
        &mut self,
        joints: &mut impl Joints<J>,
        inputs: &Inputs<J>,
        burst: &mut Burst<J>,
        outputs: &mut Outputs<J>,
    ) {
        let read = joints.collect();
        let failed = self.failed.take().map(Reading::Failed);
        self.tick_into(failed.as_ref().unwrap_or(&read), inputs, burst, outputs);
        if outputs.record.answer == Some(CLEARED) {
            joints.recover();
        }
        self.failed = joints.write(&outputs.torques_nm, outputs.powered);
    }

    /// One tick, with its request. Its record goes into the burst, too.
    pub fn tick(&mut self, reading: &Reading<J>, inputs: &Inputs<J>, burst: &mut Burst<J>) -> Outputs<J> {
        let mut outputs = Outputs::none();
        self.tick_into(reading, inputs, burst, &mut outputs);
        outputs
    }

    /// As [`Self::tick`]; what it gives is written where it stays, since a record takes long to move.
    pub fn tick_into(
        &mut self,
        reading: &Reading<J>,
        inputs: &Inputs<J>,
        burst: &mut Burst<J>,
        outputs: &mut Outputs<J>,
    ) {
        self.session.quiet_ticks = self.session.quiet_ticks.saturating_add(1);
        outputs.reply = None;
        let asked = match &inputs.packet {
            Some(packet) => self.ask(packet, reading, burst, &mut outputs.reply),
            None => Asked::Done,
        };
        outputs.order = self.save(inputs.stored);
        let heartbeat = matches!(asked, Asked::Heartbeat { .. });
        let command = match asked {
            Asked::Command { command, .. } => Some(command),
            _ => None,
        };
        let motion;
        let input = Input {
            sensed: match reading {
                Reading::Counts(counts) => Sensed::Counts(counts),
                Reading::Motion { angles_rad, speeds_rad_s } => {
                    motion = self.params.config().estimator.motion(angles_rad, speeds_rad_s);
                    Sensed::Ideal { angles_rad: &motion.0, speeds_rad_s: &motion.1 }
                }
                Reading::Failed(raised) => Sensed::Failed(*raised),
                Reading::Tested { raised, counts } => Sensed::Tested { raised: *raised, counts },
            },
            events: Events::NONE
                .with(Event::Heartbeat, heartbeat)
                .with(Event::Late, inputs.late)
                .with(Event::SupplyLow, inputs.supply_low)
                .with(Event::FallbackClock, self.identity.clock == Clock::Fallback)
                .with(Event::Unconfirmed, !self.is_confirmed),
            command,
        };
        let record = &mut outputs.record;
        tick::tick_into(&self.params, &mut self.state, &input, record);
        record.cycles = inputs.cycles;
        record.dropped = inputs.dropped;
        burst.take(record);
        outputs.torques_nm = *self.state.torques_nm();
        self.params.config().motors.turn(&mut outputs.torques_nm);
        outputs.powered = record.mode.is_powered();
        outputs.part = self.part(record.tick, inputs.waiting);
        outputs.telemetry = self.telemetry.due(inputs.waiting, record.notice.is_some());
        record.decimation = self.telemetry.told_every();
        if outputs.telemetry.is_some() {
            record.sequence = self.telemetry.sent;
            self.telemetry.sent = self.telemetry.sent.wrapping_add(1);
        }
        outputs.baud = match asked {
            Asked::Rate { baud, .. } => Some(baud),
            _ => None,
        };
        let answer = match asked {
            Asked::Done if inputs.no_room || outputs.reply.is_some() => None,
            Asked::Done => self.saved.take(),
            Asked::Heartbeat { sequence } | Asked::Rate { sequence, .. } => Some((sequence, None)),
            Asked::Command { sequence, .. } => {
                Some((sequence, record.answer.and_then(|answer| answer.refused)))
            }
        };
        if let Some((sequence, refused)) = answer {
            outputs.reply = Some(Reply::Answer { sequence, refused });
        }
    }

    /// Goes on with a save, if there is one, once the store has done what it was told before.
    fn save(&mut self, stored: Option<Result<(), StoreError>>) -> Option<Order> {
        if self.saving.is_some() { self.go_on(stored) } else { None }
    }

    #[cold]
    #[inline(never)]
    fn go_on(&mut self, stored: Option<Result<(), StoreError>>) -> Option<Order> {
        let save = self.saving.as_mut()?;
        if save.is_waiting {
            let done = stored?;
            save.is_waiting = false;
            if done.is_err() || save.saving.is_over() {
                self.end_save(done);
                return None;
            }
        }
        let order = save.saving.next(&self.params);
        save.is_waiting = order.is_some();
        order
    }

    /// Ends a save, and leaves its answer.
    fn end_save(&mut self, done: Result<(), StoreError>) {
        let Some(Save { sequence, session, forgets, .. }) = self.saving.take() else { return };
        let refused = done.err().map(|error| match error {
            StoreError::NoSpare => Refusal::NoSpare,
            _ => Refusal::NotSaved,
        });
        if forgets && refused.is_none() {
            self.is_confirmed &= !self.params.reading_differs();
            self.params.reset();
        }
        // Who asked may be gone.
        if session == self.session.number {
            self.saved = Some((sequence, refused));
        }
    }

    /// Begins a save, or says why not.
    fn begin_save(&mut self, sequence: u16, forgets: bool) -> Option<Refusal> {
        if self.identity.restored.is_none() {
            return Some(Refusal::NoStore);
        }
        if self.state.mode() != Mode::Disarmed {
            return Some(Refusal::NotDisarmed);
        }
        // What is forgotten need not be right.
        if !(forgets || self.is_confirmed) {
            return Some(Refusal::Unconfirmed);
        }
        let saving = if forgets { Saving::NOTHING } else { Saving::DIFFERENCES };
        self.saving =
            Some(Save { sequence, session: self.session.number, forgets, saving, is_waiting: false });
        None
    }

    /// Changes the configuration while the hand is disarmed, or says why not.
    fn configure(
        &mut self,
        is_reading: bool,
        change: impl FnOnce(&mut Params<J, F>) -> Result<(), Refusal>,
    ) -> Option<Refusal> {
        if self.state.mode() != Mode::Disarmed {
            return Some(Refusal::NotDisarmed);
        }
        let refused = change(&mut self.params).err();
        self.is_confirmed &= refused.is_some() || !is_reading;
        refused
    }

    /// Saves the state where it is due, and the part of it that is to be sent now.
    fn part(&mut self, tick: u32, waiting: usize) -> Option<Part> {
        if !self.telemetry.sends_state() {
            return None;
        }
        if self.telemetry.state_is_due(self.snapshot.is_over()) {
            let (state, params) = (&self.state, &self.params);
            self.snapshot.begin(tick, |buffer| state.save(params, buffer));
        }
        if self.telemetry.part_is_due(waiting) { self.snapshot.next() } else { None }
    }

    /// Takes a request before the tick. Its reply, if there is one yet, is written where it stays.
    #[inline(never)]
    fn ask(
        &mut self,
        packet: &Packet<J>,
        reading: &Reading<J>,
        burst: &Burst<J>,
        reply: &mut Option<Reply<'static, J>>,
    ) -> Asked {
        let sequence = packet.sequence;
        match packet.request {
            Request::Hello { interface_version } => {
                let ends_another = self.session.is_in_use();
                self.session.begin(packet.session, sequence, interface_version == INTERFACE_VERSION);
                let identity = Identity { changed: self.params.changed(), ..self.identity };
                let session = self.session.number;
                *reply = Some(Reply::Identity { sequence, session, identity, ends_another });
                return Asked::Done;
            }
            Request::Command(Command::Stop) => {
                return Asked::Command { sequence, command: Command::Stop };
            }
            _ => {}
        }
        let mut refused = self.session.refuse(packet.session, sequence);
        if refused.is_none() && self.saving.is_some() && packet.request.is_to_wait_for_a_save() {
            refused = Some(Refusal::Saving);
        }
        if refused.is_some() {
            *reply = Some(Reply::Answer { sequence, refused });
            return Asked::Done;
        }
        let refused = match packet.request {
            Request::Command(command) => return Asked::Command { sequence, command },
            Request::Heartbeat => return Asked::Heartbeat { sequence },
            Request::SetParameter { parameter, index, value } => {
                let set = |params: &mut Params<J, F>| params.set(parameter, index, value);
                self.configure(parameter.is_reading(), set)
            }
            Request::Zero { joint } => match self.params.config().estimator.counts(reading) {
                Some(counts) => self.configure(true, |params| params.set_zero(joint, &counts)),
                None => Some(Refusal::NotRead),
            },
            Request::Confirm => {
                self.is_confirmed = true;
                None
            }
            Request::Save | Request::Defaults => {
                match self.begin_save(sequence, packet.request == Request::Defaults) {
                    // It is answered when it is over.
                    None => return Asked::Done,
                    refused => refused,
                }
            }
            Request::GetParameter { parameter, index } => match self.params.get(parameter, index) {
                Ok(setting) => {
                    *reply = Some(Reply::Value { sequence, parameter, index, setting });
                    return Asked::Done;
                }
                Err(refusal) => Some(refusal),
            },
            Request::Telemetry { decimation, signals } => {
                let is_known = signals.are_known();
                if is_known {
                    self.telemetry.begin(decimation, signals);
                    self.snapshot.stop();
                }
                (!is_known).then_some(Refusal::OutOfRange)
            }
            Request::Burst { index } => match burst.get(index) {
                Caught::Nothing => Some(Refusal::NoBurst),
                Caught::NotOver => Some(Refusal::BurstNotOver),
                Caught::NoSuchRecord => Some(Refusal::OutOfRange),
                Caught::Record { count, record } => {
                    *reply = Some(Reply::Burst { sequence, index, count, record });
                    return Asked::Done;
                }
            },
            Request::Joints(_) => Some(Refusal::JointsAreReal),
            Request::Goodbye => {
                self.session.is_open = false;
                self.telemetry.begin(0, Signals::NONE);
                self.snapshot.stop();
                return Asked::Rate { sequence, baud: FIRST_BAUD };
            }
            Request::Rate { .. } if self.state.mode() != Mode::Disarmed => Some(Refusal::NotDisarmed),
            Request::Rate { baud } if baud == FIRST_BAUD || self.faster_bauds.contains(&baud) => {
                return Asked::Rate { sequence, baud };
            }
            Request::Rate { .. } => Some(Refusal::NoSuchRate),
            // Taken above.
            Request::Hello { .. } => None,
        };
        *reply = Some(Reply::Answer { sequence, refused });
        Asked::Done
    }
}

/// The result of a request before the tick.
enum Asked {
    /// Nothing is left to be done; the reply is there, or comes later.
    Done,
    Heartbeat {
        sequence: u16,
    },
    Rate {
        sequence: u16,
        baud: u32,
    },
    Command {
        sequence: u16,
        command: Command,
    },
}

/// A save under way.
#[derive(Clone, Copy, Debug)]
struct Save {
    /// Number of the request, and of its session.
    sequence: u16,
    session: u16,
    /// `true` if the hand's file is to hold once it is over.
    forgets: bool,
    saving: Saving,
    /// `true` if the store has not yet done what it was told.
    is_waiting: bool,
}

/// A fault that was cleared.
const CLEARED: command::Answer = command::Answer { command: Command::ClearFault, refused: None };

/// Ticks without a request after which nobody is thought to use a session.
const IN_USE_TICKS: u32 = 250;

/// With whom the device speaks.
#[derive(Clone, Copy, Debug)]
struct Session {
    /// 0: nobody has said hello yet. No session has this number.
    number: u16,
    /// Nobody has said goodbye.
    is_open: bool,
    /// Number of the session before, which this one has ended.
    before: u16,
    /// Number of the last request that was taken.
    sequence: u16,
    /// `true` if the host has the same interface version.
    understood: bool,
    /// Ticks since the last request that was taken.
    quiet_ticks: u32,
}

impl Session {
    const NONE: Self =
        Self { number: 0, is_open: false, before: 0, sequence: 0, understood: false, quiet_ticks: 0 };

    /// Begins another session, with the number that is wished for. If none is (0), it is the next; a number that could be
    /// taken for one of the last two is counted on from.
    ///
    /// A device knows nothing by chance, and counts from 1 after each reset. A host wishes for a number by chance, so that
    /// one that has not noticed the reset is not taken for the owner of the first session after it.
    fn begin(&mut self, wished: u16, sequence: u16, understood: bool) {
        let before = self.number;
        let mut number = if wished == 0 { before.wrapping_add(1) } else { wished };
        // Three times at most.
        while [0, before, self.before].contains(&number) {
            number = number.wrapping_add(1);
        }
        *self = Self { number, is_open: true, before, sequence, understood, quiet_ticks: 0 };
    }

    /// Returns `true` if somebody has asked for something a moment ago, and has not said goodbye.
    fn is_in_use(&self) -> bool {
        self.is_open && self.quiet_ticks < IN_USE_TICKS
    }

    /// Returns the reason for which a request of this session and number is refused; otherwise it is now the last.
    fn refuse(&mut self, session: u16, sequence: u16) -> Option<Refusal> {
        if session != 0 && session == self.before && self.is_open {
            return Some(Refusal::SessionTaken);
        }
        if !self.is_open || session != self.number {
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
        self.quiet_ticks = 0;
        None
    }
}

/// Ticks from one snapshot of the state to the next.
const STATE_EVERY_TICKS: u32 = 1000;
/// Ticks from one part of a snapshot to the next.
const PART_EVERY_TICKS: u32 = 4;
/// Records and parts of snapshots that can wait for the line.
pub const WAITING_MOST: usize = 7;
/// A full record is told while no more than so many wait, and a part of a snapshot while no more than so many do; input
/// records always are. So a line that has time for the input records gets all of them, and in the time that is left, snapshots,
/// and then full records.
const FULL_WAITING_MOST: usize = 1;
const PART_WAITING_MOST: usize = 3;
/// A full record that is overdue for so many ticks is told as soon as there is room at all: the line has no time even for
/// the input records.
const OVERDUE_TICKS: u16 = 100;

/// The records that are sent.
#[derive(Clone, Copy, Debug)]
struct Telemetry {
    /// The decimation that was asked for: one in so many ticks; 0 for none.
    decimation: u16,
    signals: Signals,
    /// Ticks until the next full record, and for how long it could not be told.
    left: u16,
    overdue: u16,
    /// Records sent so far, input records among them.
    sent: u32,
    /// Ticks until the next snapshot, and until the next part of one.
    state_left: u32,
    part_left: u32,
}

impl Telemetry {
    const OFF: Self = Self {
        decimation: 0,
        signals: Signals::NONE,
        left: 0,
        overdue: 0,
        sent: 0,
        state_left: 0,
        part_left: 0,
    };

    /// Begins to send these signals, one record in so many ticks.
    fn begin(&mut self, decimation: u16, signals: Signals) {
        *self = Self { decimation, signals, sent: self.sent, ..Self::OFF };
    }

    /// Returns `true` if input records stand in for full ones.
    fn has_inputs(&self) -> bool {
        self.signals.contain(Signals::INPUTS)
    }

    /// Ticks from one that is told of to the next, if the line takes it.
    fn told_every(&self) -> u16 {
        if self.has_inputs() { 1 } else { self.decimation.max(1) }
    }

    /// Returns the form in which this tick is told. Nothing that was noticed is left out: there is no other record of it.
    fn due(&mut self, waiting: usize, is_notable: bool) -> Option<Form> {
        if self.decimation == 0 {
            return None;
        }
        if is_notable {
            (self.left, self.overdue) = (self.decimation - 1, 0);
            return Some(Form::Full(self.signals));
        }
        if self.left > 0 {
            self.left -= 1;
        } else if waiting <= FULL_WAITING_MOST || self.overdue >= OVERDUE_TICKS - 1 && waiting < WAITING_MOST
        {
            (self.left, self.overdue) = (self.decimation - 1, 0);
            return Some(Form::Full(self.signals));
        } else {
            self.overdue = self.overdue.saturating_add(1);
        }
        self.has_inputs().then_some(Form::Input)
    }

    /// Returns `true` if snapshots are sent.
    fn sends_state(&self) -> bool {
        self.decimation > 0 && self.signals.contain(Signals::STATE)
    }

    /// Returns `true` if the state is to be saved; never before the last snapshot is on its way.
    fn state_is_due(&mut self, is_over: bool) -> bool {
        self.state_left = self.state_left.saturating_sub(1);
        let is_due = self.state_left == 0 && is_over;
        if is_due {
            self.state_left = STATE_EVERY_TICKS;
        }
        is_due
    }

    /// Returns `true` if a part is to be sent.
    fn part_is_due(&mut self, waiting: usize) -> bool {
        self.part_left = self.part_left.saturating_sub(1);
        let is_due = self.part_left == 0 && waiting <= PART_WAITING_MOST;
        if is_due {
            self.part_left = PART_EVERY_TICKS;
        }
        is_due
    }
}
