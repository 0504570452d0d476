//! The state of a hand as it is known: fed with news, each with its time, from a line or from a recording.
//!
//! Its clock is whatever the news come with: of a line, the time since the monitor was started; of a recording, the time
//! since its beginning. The model does not look at a clock itself.

use super::history::{History, Range};
use super::rate::Rate;
use blindgrasp_model::{HandModel, order};
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::control::Signal;
use blindgrasp_shared::cycle;
use blindgrasp_shared::estimate::Encoder;
use blindgrasp_shared::event;
use blindgrasp_shared::limit::Limiting;
use blindgrasp_shared::link::rate::FIRST_BAUD;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::supervisor::{self, Mode, Outcome};
use blindgrasp_wire::{Record, label, potentials, scalars, take_encoder};
use std::collections::VecDeque;
use std::sync::LazyLock;
use std::time::Duration;

/// Bits on the wire a byte: with start and stop bit.
const BITS_A_BYTE: f64 = 10.0;
/// Over which the speed of a joint is the mean, s: a count is 0.3 mrad.
const SPEED_TIME_S: f64 = 0.02;
/// Notices that are kept.
const NOTICES: usize = 200;

/// The severity of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// As it should be.
    Info,
    /// To be looked at: a refusal.
    Warning,
    /// A fault, or a line that is lost.
    Error,
}

/// With whom a session began.
#[derive(Clone, Debug)]
pub struct Session {
    /// Its number, if that is known.
    pub number: Option<u16>,
    /// The firmware, in a few words.
    pub firmware: String,
    /// Name of its hand.
    pub hand_name: String,
    /// CRC-32 of its hand's model and configuration.
    pub hand_hash: u32,
    /// Joints of its hand.
    pub joint_count: usize,
    /// Time from one of its ticks to the next, us.
    pub period_us: u32,
    /// Frequency of the clock that its cycles are counted in, Hz; 0 where nothing counts them.
    pub clock_hz: u32,
    /// Rate of the line, baud.
    pub baud: u32,
    /// Its hand, or why that is not known.
    pub hand: Result<Box<HandModel>, String>,
}

/// A piece of news.
#[derive(Clone, Debug)]
pub enum News {
    /// A session began.
    Open(Box<Session>),
    /// A tick's record came.
    Record(Box<Record>),
    /// An input record came in place of a tick's record.
    Input {
        /// Its number, in one row with records.
        sequence: u32,
    },
    /// The device has answered a heartbeat.
    Heartbeat,
    /// A parameter's value; `None` if what it belongs to is switched off.
    Setting {
        /// The parameter.
        parameter: Parameter,
        /// Of which joint or axis.
        index: u8,
        /// To what it is set.
        value: Option<f32>,
    },
    /// Bytes came, and so many frames of them can't be used.
    Traffic {
        /// All of them.
        bytes: u64,
        /// Frames with a wrong CRC, or that were cut.
        damaged: u64,
    },
    /// The device is not heard any more, or not yet.
    Cut(String),
    /// Something happened, in words.
    Notice(Level, String),
}

/// The state of the link.
#[derive(Clone, Debug, PartialEq)]
pub enum Link {
    /// Nobody has answered yet.
    Waiting,
    /// Somebody answers.
    Open,
    /// Nobody does.
    Cut {
        /// Since when.
        since: Duration,
        /// The reason, in words.
        words: String,
    },
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// The time.
    pub at: Duration,
    /// Its severity.
    pub level: Level,
    /// Its words.
    pub words: String,
}

/// A joint, as far as it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint<'m> {
    /// Its name, if the hand is known.
    pub name: Option<&'m str>,
    /// Encoder count.
    pub count: Option<i32>,
    /// Angle, rad.
    pub angle_rad: Option<f32>,
    /// Ends of its range, rad.
    pub range_rad: Option<(f32, f32)>,
    /// Torque, N m.
    pub torque_nm: Option<f32>,
    /// Largest torque, N m.
    pub most_nm: Option<f32>,
    /// Speed, rad/s; counts a second where the hand is not known.
    pub speed: Option<f32>,
    /// The limit that acts on its torque.
    pub limiting: Limiting,
}

/// A plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plot {
    /// Torques of the joints.
    Torques,
    /// Angles of the joints; counts where the hand is not known.
    Angles,
    /// Speeds of the joints.
    Speeds,
    /// Potentials of the laws.
    Potentials,
    /// Another signal of the hand, by its number among the [scalars].
    Scalar(usize),
}

impl Plot {
    /// Every plot.
    pub fn all() -> &'static [Self] {
        static ALL: LazyLock<Vec<Plot>> = LazyLock::new(|| {
            let potentials = potentials();
            let others = (0..scalars(&Record::BLANK).len()).filter(|k| !potentials.contains(k));
            let of_joints = [Plot::Torques, Plot::Angles, Plot::Speeds];
            of_joints.into_iter().chain(others.map(Plot::Scalar)).chain([Plot::Potentials]).collect()
        });
        &ALL
    }

    /// Returns its title, with the unit.
    pub fn words(self) -> String {
        match self {
            Self::Torques => "torques, N m".into(),
            Self::Angles => "angles, rad".into(),
            Self::Speeds => "speeds, rad/s".into(),
            Self::Potentials => "potentials of the laws, J".into(),
            Self::Scalar(k) => {
                let Signal { unit, words, .. } = scalars(&Record::BLANK)[k].0;
                format!("{}, {unit}", words.split(';').next().unwrap_or(words))
            }
        }
    }

    /// Names of the signals that are drawn together, where they are not joints'.
    pub fn signals(self) -> Vec<String> {
        let named = scalars(&Record::BLANK);
        match self {
            Self::Potentials => potentials().map(|k| label(&named[k].0)).collect(),
            _ => Vec::new(),
        }
    }

    /// Returns `true` if there is one signal a joint.
    pub const fn is_of_joints(self) -> bool {
        matches!(self, Self::Torques | Self::Angles | Self::Speeds)
    }
}

/// The state of a hand as it is known.
#[derive(Clone, Debug)]
pub struct Model {
    link: Link,
    session: Option<Session>,
    record: Option<(Duration, Record)>,
    /// Ticks and counts of the last records, the newest last; as far back as speeds need.
    counts: VecDeque<(u32, Vec<i32>)>,
    /// Last number of a record.
    sequence: Option<u32>,
    lost: u64,
    damaged: u64,
    records: Rate,
    bytes: Rate,
    heartbeat_ms: Option<f32>,
    heartbeat_at: Option<Duration>,
    torque_limits_nm: Vec<Option<f32>>,
    /// Of a hand that is known.
    encoders: Vec<Encoder>,
    notices: VecDeque<Notice>,
    history: History,
}

impl Default for Model {
    fn default() -> Self {
        Self::new()
    }
}

impl Model {
    /// Nothing is known.
    pub fn new() -> Self {
        Self {
            link: Link::Waiting,
            session: None,
            record: None,
            counts: VecDeque::new(),
            sequence: None,
            lost: 0,
            damaged: 0,
            records: Rate::default(),
            bytes: Rate::default(),
            heartbeat_ms: None,
            heartbeat_at: None,
            torque_limits_nm: Vec::new(),
            encoders: Vec::new(),
            notices: VecDeque::new(),
            history: History::default(),
        }
    }

    /// Takes news that came at some time.
    pub fn take(&mut self, at: Duration, news: News) {
        match news {
            News::Open(session) => self.open(*session),
            News::Record(record) => self.look(at, *record),
            News::Input { sequence } => self.number(sequence),
            News::Heartbeat => self.heartbeat_at = Some(at),
            News::Setting { parameter, index, value } => self.set(parameter, index, value),
            News::Traffic { bytes, damaged } => {
                self.bytes.add(at, bytes);
                self.damaged += damaged;
            }
            News::Cut(words) => self.cut(at, words),
            News::Notice(level, words) => self.note(at, level, words),
        }
    }

    fn open(&mut self, session: Session) {
        self.link = Link::Open;
        // What was counted belongs to the device that was there before, and may be of another.
        (self.sequence, self.heartbeat_ms, self.heartbeat_at) = (None, None, None);
        self.counts.clear();
        let hand = session.hand.as_ref().ok();
        // As built; what is set since, the device will tell.
        self.torque_limits_nm = (0..session.joint_count)
            .map(|joint| hand?.config.limits.torque_nm.as_ref()?.get(joint).copied())
            .collect();
        let encoders = hand.map_or(&[][..], |hand| &hand.config.estimator.encoders);
        self.encoders = encoders.iter().take(session.joint_count).copied().collect();
        let joints = |session: &Session| (session.hand_hash, session.joint_count);
        if self.session.as_ref().is_some_and(|before| joints(before) != joints(&session)) {
            self.record = None;
            self.history.clear();
        }
        self.session = Some(session);
    }

    fn cut(&mut self, at: Duration, words: String) {
        // As long as nobody answers, it is the same silence, and its reason is told once.
        let (since, is_new) = match &self.link {
            Link::Cut { since, words: before } => (*since, *before != words),
            Link::Waiting | Link::Open => (at, true),
        };
        if is_new {
            self.note(at, Level::Error, words.clone());
        }
        self.link = Link::Cut { since, words };
        (self.heartbeat_at, self.sequence) = (None, None);
        self.counts.clear();
    }

    fn note(&mut self, at: Duration, level: Level, words: String) {
        if self.notices.len() == NOTICES {
            self.notices.pop_front();
        }
        self.notices.push_back(Notice { at, level, words });
    }

    fn set(&mut self, parameter: Parameter, index: u8, value: Option<f32>) {
        match parameter {
            Parameter::HEARTBEAT_TIME => self.heartbeat_ms = value,
            Parameter::TORQUE_LIMIT => {
                if let Some(limit) = self.torque_limits_nm.get_mut(usize::from(index)) {
                    *limit = value;
                }
            }
            _ => {
                if let Some(value) = value {
                    take_encoder(&mut self.encoders, parameter, index, value);
                }
            }
        }
    }

    fn look(&mut self, at: Duration, record: Record) {
        self.records.add(at, 1);
        if self.session.is_some() {
            // A recording can go on after a gap without another session.
            self.link = Link::Open;
        }
        self.number(record.sequence);
        self.remember_counts(&record);
        if let Some(noticed) = &record.notice {
            let fingertips = self.hand().map_or(&[][..], |hand| &hand.fingertip_names);
            let words = order::notice(noticed, fingertips);
            let words = match noticed.notice {
                cycle::Notice::Weighed => format!("{words}: {:.3} N", record.weight_n),
                _ => words,
            };
            self.note(at, Level::Info, words);
        }
        self.record = Some((at, record));
        self.remember(at);
    }

    /// Counts what is missing before a number.
    fn number(&mut self, sequence: u32) {
        // A number that is not ahead is that of a device that counts anew.
        let ahead = self.sequence.map(|last| sequence.wrapping_sub(last));
        if let Some(ahead) = ahead.filter(|ahead| (1..1 << 31).contains(ahead)) {
            self.lost += u64::from(ahead) - 1;
        }
        self.sequence = Some(sequence);
    }

    fn remember_counts(&mut self, record: &Record) {
        let period_s = self.period_s();
        let age_s = |tick: u32| f64::from(record.tick.wrapping_sub(tick) as i32) * period_s;
        if record.counts.as_slice().is_empty()
            || self.counts.back().is_some_and(|&(tick, _)| !(0.0..=1.0).contains(&age_s(tick)))
        {
            self.counts.clear();
        }
        // The oldest is the last that is old enough.
        while self.counts.get(1).is_some_and(|&(tick, _)| age_s(tick) >= SPEED_TIME_S) {
            self.counts.pop_front();
        }
        if !record.counts.as_slice().is_empty() {
            self.counts.push_back((record.tick, record.counts.as_slice().to_vec()));
        }
    }

    /// Adds what is known now to the history.
    fn remember(&mut self, at: Duration) {
        let Some((_, record)) = &self.record else { return };
        let scalars = scalars(record).into_iter().map(|(_, value)| value);
        let joints: Vec<Joint<'_>> = self.joints().collect();
        let unknown = |value: Option<f32>| value.unwrap_or(f32::NAN);
        let torques = joints.iter().map(|joint| unknown(joint.torque_nm));
        let angles =
            joints.iter().map(|joint| unknown(joint.angle_rad.or(joint.count.map(|count| count as f32))));
        let speeds = joints.iter().map(|joint| unknown(joint.speed));
        let values: Vec<f32> = scalars.chain(torques).chain(angles).chain(speeds).collect();
        self.history.add(at, values.into_iter());
    }

    /// Returns the state of the link.
    pub fn link(&self) -> &Link {
        &self.link
    }

    /// The session, which may be the last one.
    pub fn session(&self) -> Option<&Session> {
        self.session.as_ref()
    }

    /// The newest record.
    pub fn record(&self) -> Option<&Record> {
        self.record.as_ref().map(|(_, record)| record)
    }

    /// Returns the time of the newest record.
    pub fn record_at(&self) -> Option<Duration> {
        self.record.as_ref().map(|&(at, _)| at)
    }

    /// The hand, if it is known.
    pub fn hand(&self) -> Option<&HandModel> {
        self.session.as_ref()?.hand.as_deref().ok()
    }

    /// The mode, which may be the last that was heard of.
    pub fn mode(&self) -> Option<Mode> {
        self.record().map(|record| record.mode)
    }

    /// Returns the reason for which the hand can't be armed: a sentence.
    pub fn why_not_armed(&self) -> Option<&'static str> {
        if self.link != Link::Open {
            return Some("nobody answers");
        }
        let record = self.record()?;
        match supervisor::outcome(record.mode, supervisor::Event::Command(Command::Arm)) {
            Outcome::Refuse(refusal) => Some(refusal.words()),
            Outcome::Enter(_) if record.events.contains(event::Event::FallbackClock) => {
                Some(Refusal::FallbackClock.words())
            }
            Outcome::Enter(_) if record.events.contains(event::Event::Unconfirmed) => {
                Some(Refusal::Unconfirmed.words())
            }
            Outcome::Enter(_) => None,
        }
    }

    /// Returns the longest time for which the heartbeat may be missing, ms; `None`: for ever, or it is not known.
    pub fn heartbeat_ms(&self) -> Option<f32> {
        self.heartbeat_ms
    }

    /// Time until the device does without the host, ms, reckoned from the last heartbeat that it answered; negative when
    /// it is over.
    pub fn heartbeat_left_ms(&self, now: Duration) -> Option<f32> {
        let (most, at) = (self.heartbeat_ms?, self.heartbeat_at?);
        Some(most - 1e3 * now.saturating_sub(at).as_secs_f32())
    }

    /// Records a second.
    pub fn records_s(&self, now: Duration) -> f64 {
        self.records.per_second(now)
    }

    /// Bytes from the device a second.
    pub fn bytes_s(&self, now: Duration) -> f64 {
        self.bytes.per_second(now)
    }

    /// Share of the serial line that the device uses.
    pub fn line_share(&self, now: Duration) -> f64 {
        self.bytes_s(now) * BITS_A_BYTE
            / f64::from(self.session.as_ref().map_or(FIRST_BAUD, |session| session.baud))
    }

    /// Records that were numbered and did not come.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Frames that came with damage.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// Share of the tick's time that the last one took; `None` where nothing counts it.
    pub fn tick_share(&self) -> Option<f64> {
        let cycles = self.record()?.cycles;
        let clock_hz = self.session.as_ref()?.clock_hz;
        (cycles > 0 && clock_hz > 0).then(|| f64::from(cycles) / (f64::from(clock_hz) * self.period_s()))
    }

    /// Time since the device's start, s, in the newest record.
    pub fn device_time_s(&self) -> Option<f64> {
        Some(f64::from(self.record()?.tick) * self.period_s())
    }

    fn period_s(&self) -> f64 {
        1e-6 * f64::from(self.session.as_ref().map_or(1000, |session| session.period_us))
    }

    /// Returns the notices, the newest first.
    pub fn notices(&self) -> impl Iterator<Item = &Notice> {
        self.notices.iter().rev()
    }

    /// Number of joints, as far as it is known.
    pub fn joint_count(&self) -> usize {
        self.session.as_ref().map_or(0, |session| session.joint_count)
    }

    /// The joints.
    pub fn joints(&self) -> impl Iterator<Item = Joint<'_>> {
        (0..self.joint_count()).map(|joint| self.joint(joint))
    }

    fn joint(&self, joint: usize) -> Joint<'_> {
        let hand = self.hand();
        let record = self.record();
        let count = record.and_then(|record| record.counts.as_slice().get(joint).copied());
        // Angle of so many counts from somewhere; counts without a hand.
        let encoder = self.encoders.get(joint);
        let turn = |counts: i32| {
            encoder.map_or(counts as f32, |encoder| counts as f32 * encoder.rad_per_count * encoder.sign())
        };
        let speed = || {
            let ((first, before), (last, after)) = (self.counts.front()?, self.counts.back()?);
            let ticks = last.wrapping_sub(*first);
            let turned = after.get(joint)?.wrapping_sub(*before.get(joint)?);
            (ticks > 0).then(|| turn(turned) / (f64::from(ticks) * self.period_s()) as f32)
        };
        Joint {
            name: hand.and_then(|hand| hand.joint_names.get(joint)).map(String::as_str),
            count,
            angle_rad: count.zip(encoder).map(|(count, encoder)| encoder.angle_rad(count)),
            range_rad: hand.filter(|hand| joint < hand.hand.joint_count()).map(|hand| {
                let (lower, upper) = hand.hand.range_rad(joint);
                (lower as f32, upper as f32)
            }),
            torque_nm: record.and_then(|record| record.torques_nm.as_slice().get(joint).copied()),
            most_nm: self.torque_limits_nm.get(joint).copied().flatten(),
            speed: speed(),
            limiting: record
                .and_then(|record| record.limiting.as_slice().get(joint).copied())
                .unwrap_or_default(),
        }
    }

    /// The signals of a plot over the time before `until`, in columns: of all joints, or of one.
    pub fn plotted(
        &self,
        plot: Plot,
        joint: Option<usize>,
        until: Duration,
        window: Duration,
        columns: usize,
    ) -> Vec<Vec<Option<Range>>> {
        let of_joints = |place: usize| {
            let first = scalars(&Record::BLANK).len() + place * self.joint_count();
            match joint {
                Some(joint) => vec![first + joint],
                None => (first..first + self.joint_count()).collect(),
            }
        };
        let signals = match plot {
            Plot::Torques => of_joints(0),
            Plot::Angles => of_joints(1),
            Plot::Speeds => of_joints(2),
            Plot::Potentials => potentials().collect(),
            Plot::Scalar(k) => vec![k],
        };
        signals.iter().map(|&signal| self.history.columns(signal, until, window, columns)).collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use blindgrasp_shared::event::Events;
    use blindgrasp_shared::fault::{Fault, Raised};
    use blindgrasp_shared::telemetry::List;

    pub(crate) fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    pub(crate) fn session(with_hand: bool) -> News {
        let hand = HandModel::load("three-finger").expect("the hand");
        let hand_hash = hand.hash();
        let hand = if with_hand { Ok(Box::new(hand)) } else { Err("it is not built in".into()) };
        News::Open(Box::new(Session {
            number: Some(3),
            firmware: "blindgrasp 0.1.0 (25c42b05)".into(),
            hand_name: "three-finger".into(),
            hand_hash,
            joint_count: 12,
            period_us: 1000,
            clock_hz: 100_000_000,
            baud: FIRST_BAUD,
            hand,
        }))
    }

    pub(crate) fn record(tick: u32) -> Record {
        let mut counts = [0; blindgrasp_body::MAX_JOINTS];
        // 10 counts a tick.
        counts[1] = 10 * tick as i32;
        Record {
            sequence: tick,
            tick,
            cycles: 10_000,
            decimation: 1,
            counts: List::first_of(counts, 12),
            torques_nm: List::first_of([0.25; blindgrasp_body::MAX_JOINTS], 12),
            limiting: List::first_of([Limiting::NONE; blindgrasp_body::MAX_JOINTS], 12),
            ..Record::BLANK
        }
    }

    pub(crate) fn fed(ticks: impl Iterator<Item = u32>) -> Model {
        let mut model = Model::new();
        model.take(ms(0), session(true));
        for tick in ticks {
            model.take(ms(u64::from(tick)), News::Record(Box::new(record(tick))));
            model.take(ms(u64::from(tick)), News::Traffic { bytes: 65, damaged: 0 });
        }
        model
    }

    #[test]
    fn rates_and_losses_are_counted() {
        let model = fed((1..3000).filter(|tick| !(500..507).contains(tick) && *tick != 600));
        assert_eq!(model.lost(), 8);
        let now = ms(3000);
        assert_eq!((model.records_s(now), model.bytes_s(now)), (1000.0, 65_000.0));
        assert!((model.line_share(now) - 0.65).abs() < 1e-9);
        assert!((model.tick_share().expect("cycles") - 0.1).abs() < 1e-9);
    }

    #[test]
    fn numbers_that_begin_anew_are_no_loss_and_those_that_wrap_are_followed() {
        let mut model = fed(1..100);
        model.take(ms(200), News::Record(Box::new(record(5))));
        assert_eq!(model.lost(), 0);
        model.take(ms(201), News::Record(Box::new(Record { sequence: u32::MAX, ..record(6) })));
        model.take(ms(202), News::Record(Box::new(Record { sequence: 2, ..record(7) })));
        assert_eq!(model.lost(), 2);
        // What happens while nobody is heard is no loss of the link's.
        model.take(ms(203), News::Cut("the line is lost".into()));
        model.take(ms(900), session(true));
        model.take(ms(901), News::Record(Box::new(Record { sequence: 900, ..record(900) })));
        assert_eq!(model.lost(), 2);
    }

    #[test]
    fn the_heartbeat_that_is_left_counts_from_the_last_answer() {
        let mut model = fed(1..2);
        assert_eq!(model.heartbeat_left_ms(ms(10)), None);
        model.take(
            ms(10),
            News::Setting { parameter: Parameter::HEARTBEAT_TIME, index: 0, value: Some(250.0) },
        );
        assert_eq!(model.heartbeat_left_ms(ms(10)), None);
        model.take(ms(20), News::Heartbeat);
        assert_eq!(model.heartbeat_left_ms(ms(20)), Some(250.0));
        assert_eq!(model.heartbeat_left_ms(ms(120)), Some(150.0));
        model.take(ms(103), News::Heartbeat);
        assert_eq!(model.heartbeat_left_ms(ms(403)), Some(-50.0));
        model.take(ms(500), News::Cut("nothing came".into()));
        assert_eq!(model.heartbeat_left_ms(ms(500)), None);
    }

    #[test]
    fn angles_and_speeds_come_from_counts_whatever_was_lost() {
        let rad_s = 10.0 * 1000.0 * std::f32::consts::TAU / 21_600.0;
        let all = fed(1..200);
        let few = fed((1..200).step_by(66));
        for (model, last) in [(all, 199), (few, 199)] {
            let joint = model.joint(1);
            assert_eq!(joint.name, Some("finger-1-flex-1"));
            assert_eq!(joint.range_rad, Some((-1.2, 1.6)));
            let angle_rad = 10.0 * last as f32 * std::f32::consts::TAU / 21_600.0;
            assert!((joint.angle_rad.expect("an angle") - angle_rad).abs() < 1e-5, "{joint:?}");
            assert!((joint.speed.expect("a speed") - rad_s).abs() < 1e-4, "{joint:?}");
            assert_eq!((joint.torque_nm, joint.most_nm), (Some(0.25), Some(1.3878)));
        }
        let mut unknown = Model::new();
        unknown.take(ms(0), session(false));
        unknown.take(ms(1), News::Record(Box::new(record(1))));
        let joint = unknown.joint(1);
        assert_eq!((joint.name, joint.angle_rad, joint.count), (None, None, Some(10)));
    }

    #[test]
    fn it_is_said_why_the_hand_cannot_be_armed() {
        let mut model = Model::new();
        assert_eq!(model.why_not_armed(), Some("nobody answers"));
        model.take(ms(0), session(true));
        let mut why = |record: Record| {
            model.take(ms(1), News::Record(Box::new(record)));
            model.why_not_armed()
        };
        assert_eq!(why(record(1)), None);
        let fault = Some(Raised::at(2, Fault::CountJump));
        assert_eq!(
            why(Record { mode: Mode::Fault, fault, ..record(2) }),
            Some("the hand is in a fault: clear it first")
        );
        let events = Events::NONE.with(event::Event::FallbackClock, true);
        assert_eq!(why(Record { events, ..record(3) }), Some(Refusal::FallbackClock.words()));
        let events = Events::NONE.with(event::Event::Unconfirmed, true);
        assert_eq!(why(Record { events, ..record(4) }), Some(Refusal::Unconfirmed.words()));
    }

    #[test]
    fn a_cut_lasts_from_its_beginning_and_is_told_once() {
        let mut model = fed(1..10);
        model.take(ms(100), News::Cut("the device hung up".into()));
        model.take(ms(600), News::Cut("the port is gone".into()));
        model.take(ms(1100), News::Cut("the port is gone".into()));
        let Link::Cut { since, words } = model.link() else { panic!("{:?}", model.link()) };
        assert_eq!((*since, words.as_str()), (ms(100), "the port is gone"));
        assert_eq!(model.notices().count(), 2);
        assert_eq!(model.mode(), Some(Mode::Disarmed), "the last known");
        model.take(ms(2000), session(true));
        assert_eq!(model.link(), &Link::Open);
    }

    #[test]
    fn plots_are_of_all_joints_or_of_one() {
        let model = fed(1..1000);
        let torques = model.plotted(Plot::Torques, None, ms(1000), ms(1000), 10);
        assert_eq!(torques.len(), 12);
        assert_eq!(torques[5][9], Some(Range { least: 0.25, most: 0.25 }));
        let angle = model.plotted(Plot::Angles, Some(1), ms(1000), ms(1000), 2);
        let at = |tick: f32| 10.0 * tick * std::f32::consts::TAU / 21_600.0;
        let [first, Some(second)] = angle[0][..] else { panic!("{angle:?}") };
        assert!(first.is_some() && (second.most - at(999.0)).abs() < 1e-4, "{second:?}");
        for &plot in Plot::all() {
            let count = model.plotted(plot, Some(0), ms(1000), ms(1000), 3).len();
            assert_eq!(count, plot.signals().len().max(1), "{plot:?}");
        }
    }
}
