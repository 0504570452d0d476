//! Follows a device tick by tick, as far as its state is known.

use super::hearing::{Item, Told};
use super::model::{AnyParams, Model};
use super::open_loop::Beside;
use super::report::Report;
use super::{Gap, Reason, ReplayError, Wanted};
use crate::compare::{Comparison, Value};
use crate::mcap::{About, Setting};
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::snapshot::{BYTES_PER_JOINT, Collector, Part};
use blindgrasp_shared::tick::{Config, Input, Sensed, State, tick};
use blindgrasp_wire::Record;
use std::collections::VecDeque;

/// Records that are kept until it is known whether they can be replayed: those of a few snapshots.
const PENDING: usize = 4096;
/// Gaps that are listed; all are counted.
const LISTED: usize = 100;

type AnyState = State<MAX_JOINTS, MAX_FINGERS>;

/// A replay under way.
pub struct Follower {
    device: String,
    wanted: Wanted,
    model: Option<Model>,
    controller: Option<Controller>,
    progress: Progress,
    /// Records that wait for a state, or for what became of a change of parameters.
    pending: VecDeque<Told>,
    collector: Collector,
    /// A snapshot that has not been used yet: after which tick, and its bytes.
    snapshot: Option<(u32, Vec<u8>)>,
    /// The snapshots that were made with the parameters in force.
    usable: Usable,
    /// The tick of the last snapshot, the one after which the next is to be expected, and the state that was computed
    /// for it.
    told: Option<u32>,
    expected: Option<u32>,
    computed: Option<(u32, Vec<u8>)>,
    /// Changes of parameters that were asked for and not answered yet.
    asked: Vec<(u16, Option<Setting>)>,
    /// `true` if the parameters are still to be told.
    parameters_due: bool,
    /// The last record that came: its tick and decimation.
    last: Option<(u32, u16)>,
    /// Time of the last record that was replayed, s.
    last_s: f64,
    /// The words on the link since.
    cut: Option<String>,
    comparison: Comparison,
    beside: Option<Beside>,
    began_in_a_grasp: bool,
    ticks: u64,
    not_replayed: u64,
    missing: u64,
    snapshots: u64,
    gaps: Vec<Gap>,
    gap_count: u64,
}

/// Parameters, as recorded and changed.
struct Controller {
    config: Config<MAX_JOINTS>,
    recorded: AnyParams,
    changed: Option<AnyParams>,
}

enum Progress {
    /// The state before the tick `next` is known.
    Running(Box<Running>),
    /// It is not.
    Waiting(Pause),
}

struct Running {
    next: u32,
    recorded: AnyState,
    changed: Option<AnyState>,
}

/// A gap that has not ended.
struct Pause {
    reason: Reason,
    /// The first tick that is not replayed, with its time.
    from: Option<(u32, f64)>,
    /// Records that came and are not replayed.
    passed: u64,
}

impl Pause {
    fn new(reason: Reason) -> Self {
        Self { reason, from: None, passed: 0 }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Usable {
    Any,
    /// Those from the next record's tick on.
    FromNext,
    From(u32),
}

impl Follower {
    /// Before the first entry.
    pub fn new(device: &str, wanted: Wanted) -> Self {
        Self {
            device: device.to_owned(),
            wanted,
            model: None,
            controller: None,
            progress: Progress::Waiting(Pause::new(Reason::Start)),
            pending: VecDeque::new(),
            collector: Collector::new(),
            snapshot: None,
            usable: Usable::Any,
            told: None,
            expected: None,
            computed: None,
            asked: Vec::new(),
            parameters_due: true,
            last: None,
            last_s: 0.0,
            cut: None,
            comparison: Comparison::default(),
            beside: None,
            began_in_a_grasp: false,
            ticks: 0,
            not_replayed: 0,
            missing: 0,
            snapshots: 0,
            gaps: Vec::new(),
            gap_count: 0,
        }
    }

    /// Takes the next item.
    ///
    /// # Errors
    /// Why the recording can't be replayed.
    pub fn take(&mut self, item: Item) -> Result<(), ReplayError> {
        match item {
            Item::Session(about) => self.session(&about)?,
            Item::Parameters(settings) => self.parameters(&settings)?,
            Item::Asked { sequence, setting } => self.ask(sequence, setting),
            Item::Answered { sequence, refused } => self.answer(sequence, refused)?,
            Item::Record(told) => return self.record(told),
            Item::Part(part) => self.part(&part),
            Item::Cut(words) => self.cut = Some(words),
        }
        self.advance()
    }

    /// Ends the replay and returns its report.
    ///
    /// # Errors
    /// If nothing could be replayed.
    pub fn finish(mut self) -> Result<Report, ReplayError> {
        if !self.pending.is_empty() && matches!(self.progress, Progress::Running(_)) {
            self.pause(Reason::ParametersUnknown);
        }
        while let Some(told) = self.pending.pop_front() {
            self.pass(&told);
        }
        if let (Progress::Waiting(pause), Some((last, _))) = (&self.progress, self.last) {
            let (reason, next) = (pause.reason.clone(), last.wrapping_add(1));
            self.end_pause(next);
            if self.ticks == 0 {
                let reason = self.gaps.first().map_or(reason, |gap| gap.reason.clone());
                let remedy = reason.remedy();
                return Err(ReplayError::Nothing(format!("{reason}; {remedy}")));
            }
        }
        let Some(model) = self.model.filter(|_| self.last.is_some()) else {
            return Err(ReplayError::Nothing(format!("device `{}` has no records", self.device)));
        };
        let Comparison { bits_differ, first_difference, .. } = self.comparison;
        let (typed, began) = (self.wanted.typed, self.began_in_a_grasp);
        Ok(Report {
            device: self.device,
            hand: model.name,
            ticks: self.ticks,
            bits_differ,
            first_difference,
            not_replayed: self.not_replayed,
            missing: self.missing,
            snapshots: self.snapshots,
            gaps: self.gaps,
            gap_count: self.gap_count,
            open_loop: self.beside.map(|beside| beside.finish(typed, began)),
            damage: None,
        })
    }

    fn session(&mut self, about: &About) -> Result<(), ReplayError> {
        if about.interface_version != INTERFACE_VERSION {
            let (theirs, release) = (about.interface_version, about.host_version.clone());
            return Err(ReplayError::OtherInterface(theirs, release));
        }
        let model = Model::new(about, self.wanted.hand.as_ref())?;
        if self.model.as_ref().is_none_or(|known| known.hash != model.hash) {
            self.comparison.rename(model.joint_names.clone());
            if !self.wanted.changes.is_empty() {
                self.beside = Some(Beside::new(&model.joint_names));
            }
            if self.model.is_some() {
                self.pause(Reason::Restarted);
            }
            self.controller = None;
        }
        self.model = Some(model);
        self.parameters_due = true;
        self.asked.clear();
        Ok(())
    }

    fn parameters(&mut self, settings: &[Setting]) -> Result<(), ReplayError> {
        let Some(model) = &self.model else { return Ok(()) };
        // At the beginning of a session they are all told, then those that change.
        let before = self.controller.as_ref().filter(|_| !self.parameters_due);
        let config = model.config(before.map(|controller| &controller.config), settings)?;
        self.parameters_due = false;
        self.configure(config)
    }

    /// Takes another configuration, if it is another.
    fn configure(&mut self, config: Config<MAX_JOINTS>) -> Result<(), ReplayError> {
        let Some(model) = &self.model else { return Ok(()) };
        if self.controller.as_ref().is_some_and(|controller| controller.config == config) {
            return Ok(());
        }
        let changed = match self.wanted.changes.as_slice() {
            [] => None,
            changes => Some(model.changed(&config, changes)?),
        };
        let controller = Controller { recorded: model.params(&config)?, changed, config };
        if self.controller.replace(controller).is_some() {
            self.parameters_changed();
        }
        Ok(())
    }

    /// From some tick on, before the next record's, other parameters are in force.
    fn parameters_changed(&mut self) {
        self.pause(Reason::ParametersChanged);
        while let Some(told) = self.pending.pop_front() {
            self.pass(&told);
        }
        self.snapshot = None;
        self.usable = Usable::FromNext;
    }

    fn ask(&mut self, sequence: u16, setting: Option<Setting>) {
        let known = self.controller.as_ref();
        let now = known
            .zip(setting.as_ref())
            .and_then(|(known, setting)| known.recorded.get(setting.parameter, setting.index).ok());
        if setting.as_ref().is_none_or(|setting| now.map(|now| now.value) != setting.value) {
            self.asked.push((sequence, setting));
        }
    }

    fn answer(&mut self, sequence: u16, refused: Option<Refusal>) -> Result<(), ReplayError> {
        let Some(at) = self.asked.iter().position(|(asked, _)| *asked == sequence) else { return Ok(()) };
        let (_, setting) = self.asked.remove(at);
        match (refused, &self.controller, setting.as_ref().zip(self.model.as_ref())) {
            (None, Some(controller), Some((setting, model))) => {
                let mut config = controller.config;
                let put =
                    config.put(model.joint_names.len(), setting.parameter, setting.index, setting.value);
                if put.is_ok() {
                    self.configure(config)?;
                }
            }
            // It was taken, or a later one was, or it was done by what the device found: what is in force has still to be told.
            (Some(Refusal::OutOfOrder), ..) | (None, ..) if refused.is_some() || setting.is_none() => {
                self.parameters_changed();
                self.parameters_due = true;
            }
            _ => {}
        }
        Ok(())
    }

    /// Returns `true` if the parameters in force are not known.
    fn is_held(&self) -> bool {
        self.parameters_due || self.controller.is_none() || !self.asked.is_empty()
    }

    fn record(&mut self, told: Told) -> Result<(), ReplayError> {
        let Record { tick, decimation, .. } = told.record;
        let before = self.last.replace((tick, decimation));
        if before.is_some_and(|(last, _)| tick.wrapping_sub(last) as i32 <= 0) {
            self.restarted(before);
        }
        if self.usable == Usable::FromNext {
            self.usable = Usable::From(tick);
        }
        if !self.is_held()
            && self.pending.is_empty()
            && let Progress::Running(running) = &self.progress
            && running.next == tick
            && has_input(&told.record)
        {
            return self.step(&told);
        }
        if let Progress::Waiting(pause) = &mut self.progress
            && pause.reason == Reason::Start
        {
            // There may be another reason why it will not be known.
            if !has_input(&told.record) {
                pause.reason = Reason::NoCounts;
            } else if decimation > 1 {
                pause.reason = Reason::Decimated(decimation);
            }
        }
        self.pending.push_back(told);
        if self.pending.len() > PENDING {
            if matches!(self.progress, Progress::Running(_)) {
                self.pause(Reason::ParametersUnknown);
                self.parameters_due = true;
                self.asked.clear();
            }
            if let Some(told) = self.pending.pop_front() {
                self.pass(&told);
            }
        }
        self.advance()
    }

    /// The ticks begin anew: nothing of before has a meaning.
    fn restarted(&mut self, before: Option<(u32, u16)>) {
        if matches!(self.progress, Progress::Running(_)) {
            self.pause(Reason::Restarted);
        }
        while let Some(told) = self.pending.pop_front() {
            self.pass(&told);
        }
        if let Some((last, _)) = before {
            self.end_pause(last.wrapping_add(1));
        }
        self.progress = Progress::Waiting(Pause::new(Reason::Restarted));
        self.collector = Collector::new();
        (self.snapshot, self.told, self.expected, self.computed) = (None, None, None, None);
        self.usable = Usable::Any;
    }

    fn part(&mut self, part: &Part) {
        if self.told != Some(part.tick) {
            // They come at regular intervals.
            let before = self.told.replace(part.tick);
            self.expected = before.map(|before| part.tick.wrapping_mul(2).wrapping_sub(before));
        }
        let Some((tick, bytes)) = self.collector.add(part) else { return };
        match &self.progress {
            Progress::Running(_) => {
                if let Some((_, computed)) = self.computed.take_if(|(computed, _)| *computed == tick) {
                    self.snapshots += 1;
                    if computed != bytes {
                        let words = |bytes: &[u8]| Value::Words(format!("{} bytes of state", bytes.len()));
                        let what = "the state after the tick";
                        self.comparison.differs(i64::from(tick), what, None, words(bytes), words(&computed));
                    }
                }
            }
            Progress::Waiting(_) => {
                let usable = match self.usable {
                    Usable::Any => true,
                    Usable::FromNext => false,
                    Usable::From(first) => tick.wrapping_sub(first) as i32 >= 0,
                };
                if usable {
                    self.snapshot = Some((tick, bytes.to_vec()));
                }
            }
        }
    }

    /// Replays what can be replayed.
    fn advance(&mut self) -> Result<(), ReplayError> {
        while !self.is_held() {
            match &self.progress {
                Progress::Running(running) => {
                    let Some(told) = self.pending.front() else { return Ok(()) };
                    if told.record.tick != running.next {
                        let reason = self.why_missing(told.record.decimation);
                        self.pause(reason);
                    } else if !has_input(&told.record) {
                        self.pause(Reason::NoCounts);
                    } else if let Some(told) = self.pending.pop_front() {
                        self.step(&told)?;
                    }
                }
                Progress::Waiting(_) => {
                    if !self.resume() {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }

    fn why_missing(&mut self, decimation: u16) -> Reason {
        match self.cut.take() {
            Some(words) => Reason::Cut(words),
            None if decimation > 1 => Reason::Decimated(decimation),
            None => Reason::Lost,
        }
    }

    /// Goes on, if the state is known; says whether.
    fn resume(&mut self) -> bool {
        let Some(controller) = &self.controller else { return false };
        if let Some(front) = self.pending.front()
            && front.record.tick == 0
            && self.usable == Usable::Any
            && has_input(&front.record)
        {
            // The device's first: before it there was nothing.
            return self.run(0, State::new());
        }
        let Some((tick, bytes)) = self.snapshot.take() else { return false };
        let state = match State::load(&controller.recorded, &bytes) {
            Ok(state) => state,
            Err(error) => {
                let reason = Reason::BadSnapshot(error.to_string());
                if let Progress::Waiting(pause) = &mut self.progress {
                    pause.reason = reason;
                }
                return false;
            }
        };
        let is_before = |told: &Told| told.record.tick.wrapping_sub(tick) as i32 <= 0;
        while self.pending.front().is_some_and(is_before) {
            if let Some(told) = self.pending.pop_front() {
                self.pass(&told);
            }
        }
        let next = tick.wrapping_add(1);
        let is_next = match self.pending.front() {
            Some(front) => {
                let Record { tick, decimation, .. } = front.record;
                tick == next && decimation <= 1 && has_input(&front.record)
            }
            None => self.last.is_none_or(|(last, decimation)| last == tick && decimation <= 1),
        };
        is_next && self.run(next, state)
    }

    /// Begins to run before a tick.
    fn run(&mut self, next: u32, state: AnyState) -> bool {
        self.end_pause(next);
        if matches!(state.mode(), Mode::Grasping | Mode::Releasing) {
            self.began_in_a_grasp |= self.wanted.changes.iter().any(super::Change::is_of_the_grasp);
        }
        let changed = (!self.wanted.changes.is_empty()).then(|| state.clone());
        self.computed = None;
        self.progress = Progress::Running(Box::new(Running { next, recorded: state, changed }));
        true
    }

    /// The state is not known any more. If it was not before, that stays the reason.
    fn pause(&mut self, reason: Reason) {
        if let Progress::Running(running) = &self.progress {
            let from = Some((running.next, self.last_s));
            self.progress = Progress::Waiting(Pause { from, ..Pause::new(reason) });
        }
    }

    /// A record that is not replayed.
    fn pass(&mut self, told: &Told) {
        if let Progress::Waiting(pause) = &mut self.progress {
            pause.from.get_or_insert((told.record.tick, told.time_s));
            pause.passed += 1;
        }
    }

    /// Ends the gap before a tick, and lists it.
    fn end_pause(&mut self, next: u32) {
        let Progress::Waiting(pause) = &self.progress else { return };
        let Some((from_tick, time_s)) = pause.from else { return };
        let span = u64::from(next.wrapping_sub(from_tick));
        if span == 0 || self.wanted.from_s.is_some_and(|from_s| time_s < from_s) {
            return;
        }
        let missing = span.saturating_sub(pause.passed);
        self.not_replayed += pause.passed;
        self.missing += missing;
        self.gap_count += 1;
        if self.gaps.len() < LISTED {
            self.gaps.push(Gap {
                time_s,
                from_tick,
                until_tick: next.wrapping_sub(1),
                missing,
                not_replayed: pause.passed,
                reason: pause.reason.clone(),
            });
        }
    }

    /// Computes a tick again.
    fn step(&mut self, told: &Told) -> Result<(), ReplayError> {
        let (Progress::Running(running), Some(controller)) = (&mut self.progress, &self.controller) else {
            return Ok(());
        };
        let record = &told.record;
        let counts = std::array::from_fn(|k| record.counts.as_slice().get(k).copied().unwrap_or(0));
        let input = Input {
            sensed: match record.reading_failed {
                Some(raised) if record.counts.as_slice().is_empty() => Sensed::Failed(raised),
                Some(raised) => Sensed::Tested { raised, counts: &counts },
                None => Sensed::Counts(&counts),
            },
            events: record.events,
            command: record.answer.map(|answer| answer.command),
        };
        let computed = tick(&controller.recorded, &mut running.recorded, &input).record;
        running.next = record.tick.wrapping_add(1);
        self.last_s = told.time_s;
        if self.expected == Some(record.tick) {
            let mut buffer = [0; BYTES_PER_JOINT * MAX_JOINTS];
            let saved = running.recorded.save(&controller.recorded, &mut buffer);
            self.computed = saved.ok().map(|bytes| (record.tick, bytes.to_vec()));
        }
        let changed = match (&controller.changed, &mut running.changed) {
            (Some(params), Some(state)) => Some(tick(params, state, &input).record),
            _ => None,
        };
        self.cut = None;
        if self.wanted.from_s.is_some_and(|from_s| told.time_s < from_s) {
            return Ok(());
        }
        self.ticks += 1;
        if let (Some(beside), Some(changed)) = (&mut self.beside, &changed) {
            beside.add(told.time_s, &computed, changed);
        }
        self.compare(told, computed);
        Ok(())
    }

    /// Compares a tick, but for what only its sender knows.
    fn compare(&mut self, told: &Told, computed: Record) {
        let record = &told.record;
        let tick = i64::from(record.tick);
        if let Some(told) = told.digest {
            let computed = computed.digest();
            if computed != told {
                let words = |digest: u32| Value::Words(format!("{digest:#010x}"));
                let what = "digest of all that the tick computed";
                self.comparison.differs(tick, what, None, words(told), words(computed));
            }
            return;
        }
        let mut computed = Record {
            sequence: record.sequence,
            cycles: record.cycles,
            dropped: record.dropped,
            decimation: record.decimation,
            ..computed
        };
        if record.torques_nm.as_slice().is_empty() {
            computed.torques_nm = Default::default();
        }
        if record.limiting.as_slice().is_empty() {
            computed.limiting = Default::default();
        }
        self.comparison.records(tick, record, &computed);
    }
}

/// Returns `true` if a record has what its tick took in.
fn has_input(record: &Record) -> bool {
    record.reading_failed.is_some() || !record.counts.as_slice().is_empty()
}
