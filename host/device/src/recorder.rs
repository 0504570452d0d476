//! Recording of a line: every payload as it is, and between them who the device is and what its parameters are.
//!
//! A [`Recorder`] stands beside a tapped talk and takes its events. In each session it asks, aside, for all parameters and
//! then for every tick's record and for snapshots of the state; after a parameter was set, for these again, so that a replay
//! has a state to go on from. What was caught around a fault is read slowly, in the time that the records leave on the line.

use super::talk::{Event, Talk};
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_model::{HandFile, HandModel};
use blindgrasp_record::mcap::{
    About, Device, Level, LinkStatus, RecordingError, Saved, Setting, Stamp, Writer,
};
use blindgrasp_shared::command::Refusal;
use blindgrasp_shared::link::message::{Reply, Signals};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_wire::{Answer, Firmware, Request};
use std::path::Path;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// From one status of the link to the next.
const STATUS: Duration = Duration::from_secs(1);
/// From one record of a burst to the next: 8 bytes a tick, which input records and snapshots leave on the line.
const BURST: Duration = Duration::from_millis(20);
/// Time for which a parameter waits for others that are set together with it.
const SETTLED: Duration = Duration::from_millis(50);
/// Number of times that something is asked that was not answered.
const TRIES: u8 = 3;
/// Said of a session that was not the only one.
pub const ENDED_ANOTHER: &str =
    "another program was talking to this hand: its session has ended with this one";
/// Payloads that were sent before a session, and are kept for it.
const KEPT: usize = 8;

/// Entries that may wait to be written: a minute of one hand. Beyond that, who brings more waits.
const WAITING: usize = 1 << 16;

/// Something to be written; none at the end.
type Entry = Box<dyn FnOnce(&mut Writer) -> Result<(), RecordingError> + Send>;

/// News of the writing thread.
#[derive(Default)]
struct Told {
    saved: Saved,
    /// The error for which nothing is written any more, until it was told.
    error: Option<RecordingError>,
}

/// The writing thread, and the way to it.
struct Writing {
    entries: SyncSender<Option<Entry>>,
    thread: JoinHandle<Writer>,
}

/// A recording that several devices may share. A thread writes, so that a disk that takes its time does not keep those who
/// read from their lines.
#[derive(Clone)]
pub struct Recording {
    thread: Arc<Mutex<Option<Writing>>>,
    told: Arc<Mutex<Told>>,
    /// The host's clock, which does not jump.
    begun: (Instant, Stamp),
}

impl Recording {
    /// Begins a file.
    ///
    /// # Errors
    /// If it is there already, and not to be overwritten by `force`, or can't be made.
    pub fn create(path: &Path, force: bool) -> Result<Self, RecordingError> {
        let writer = Writer::create(path, force)?;
        let told = Arc::new(Mutex::new(Told::default()));
        let (entries, waiting) = mpsc::sync_channel(WAITING);
        let telling = Arc::clone(&told);
        let thread = thread::spawn(move || write_down(writer, &waiting, &telling));
        let thread = Arc::new(Mutex::new(Some(Writing { entries, thread })));
        Ok(Self { thread, told, begun: (Instant::now(), Stamp::now()) })
    }

    /// Adds a device, with whom nobody has spoken yet. `hands` are files that its hand may be found in.
    pub fn add(&self, name: &str, port: &str, hands: &[String], decimation: u16) -> Recorder {
        let device = Arc::new(OnceLock::new());
        let (added, name) = (Arc::clone(&device), name.to_owned());
        let entries = lock(&self.thread).as_ref().map(|writing| writing.entries.clone());
        let recorder = Recorder {
            recording: self.clone(),
            entries,
            device,
            port: port.to_owned(),
            hands: hands.to_vec(),
            decimation,
            kept: Vec::new(),
            identity: Vec::new(),
            phase: Phase::Nobody,
            asked: 0,
            settings: Vec::new(),
            changed: None,
            burst: None,
            status_due: None,
            heard: None,
            silent_since: None,
            totals: Arc::default(),
        };
        recorder.send(Box::new(move |writer| {
            let _ = added.set(writer.add_device(&name));
            Ok(())
        }));
        recorder
    }

    /// Returns the contents of the file so far.
    pub fn saved(&self) -> Saved {
        lock(&self.told).saved
    }

    /// Ends the file, once everything is written that recorders have given. They can add nothing any more. If nobody had a session,
    /// there is no file.
    ///
    /// # Errors
    /// If that can't be written.
    pub fn finish(&self) -> Result<Saved, RecordingError> {
        let Some(Writing { entries, thread }) = lock(&self.thread).take() else { return Ok(self.saved()) };
        let _ = entries.send(None);
        match thread.join() {
            Ok(writer) if writer.is_empty() => Ok(Saved::default()),
            Ok(writer) => writer.finish(),
            Err(_) => Ok(self.saved()),
        }
    }

    fn stamp(&self, now: Instant) -> Stamp {
        let (begun, stamp) = self.begun;
        Stamp(stamp.0 + now.saturating_duration_since(begun).as_nanos() as u64)
    }
}

/// The writing thread.
fn write_down(mut writer: Writer, entries: &Receiver<Option<Entry>>, told: &Mutex<Told>) -> Writer {
    let mut has_stopped = false;
    while let Ok(Some(entry)) = entries.recv() {
        if has_stopped {
            continue;
        }
        let written = entry(&mut writer);
        let mut told = lock(told);
        told.saved = writer.saved();
        if let Err(error) = written {
            told.error = Some(error);
            has_stopped = true;
        }
    }
    writer
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The totals of a device's records.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Sessions.
    pub sessions: u64,
    /// Records that came and could be decoded, input records among them.
    pub records: u64,
    /// Input records.
    pub inputs: u64,
    /// Records that are missing, by the numbers of those that came.
    pub missing: u64,
    /// Records and answers that the device dropped because a queue was full.
    pub dropped: u64,
    /// Whole frames that can't be decoded.
    pub unusable: u64,
    /// Damaged frames.
    pub damaged: u64,
    /// Times that the link was cut, and for how long in all: from what came last to the first record after.
    pub gaps: u64,
    /// See [`Self::gaps`].
    pub gaps_time: Duration,
    /// Largest number of ticks from one record to the next.
    pub decimation: u32,
}

impl Totals {
    /// Returns `true` if every record that was asked for is there.
    pub fn is_whole(&self) -> bool {
        self.missing == 0 && self.dropped == 0 && self.gaps == 0
    }

    fn add(&mut self, status: &LinkStatus) {
        self.records += status.records;
        self.inputs += status.inputs;
        self.missing += status.missing;
        self.dropped += status.dropped;
        self.unusable += status.unusable;
        self.damaged += status.damaged;
        self.decimation = self.decimation.max(status.decimation);
    }
}

/// The progress with a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// No session.
    Nobody,
    /// Parameters are asked for; so many answers are still to come.
    Parameters(usize),
    /// Records are asked for.
    Telemetry,
    /// They come.
    Records,
}

/// A burst that is read.
struct Burst {
    next: u16,
    count: Option<u16>,
    due: Instant,
    tries: u8,
    asked: bool,
}

/// Writes down what goes over the line to one device.
pub struct Recorder {
    recording: Recording,
    entries: Option<SyncSender<Option<Entry>>>,
    /// Known to the writing thread.
    device: Arc<OnceLock<Device>>,
    port: String,
    hands: Vec<String>,
    decimation: u16,
    /// Payloads that were sent before the session.
    kept: Vec<Vec<u8>>,
    /// Payload of the last introduction.
    identity: Vec<u8>,
    phase: Phase,
    /// The number of times that parameters or records were asked for in vain.
    asked: u8,
    settings: Vec<Setting>,
    /// The time at which the parameters that were set are written down.
    changed: Option<Instant>,
    burst: Option<Burst>,
    status_due: Option<Instant>,
    /// The time at which something came last, and since which nothing does.
    heard: Option<Instant>,
    silent_since: Option<Instant>,
    totals: Arc<Mutex<Totals>>,
}

impl Recorder {
    /// Returns `true` if everything that is done from now on is recorded.
    pub fn is_ready(&self) -> bool {
        self.phase == Phase::Records
    }

    /// Returns the totals of the records so far, to the last second.
    pub fn totals(&self) -> Totals {
        *lock(&self.totals)
    }

    /// Ticks from one record to the next that are asked for: whoever asks the device for records asks for these.
    pub fn telemetry(&self) -> Request {
        // Where not every tick is asked for, none is to be told of instead.
        let inputs = if self.decimation == 1 { Signals::INPUTS } else { Signals::NONE };
        let signals = Signals::ALL.and(Signals::STATE).and(inputs);
        Request::Telemetry { decimation: self.decimation, signals }
    }

    /// Takes an event of the talk, and asks it for what it needs.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn take(&mut self, event: &Event, talk: &mut Talk, now: Instant) -> Result<(), RecordingError> {
        match event {
            Event::Received(payload) if is_identity(payload) => payload.clone_into(&mut self.identity),
            Event::Received(payload) if self.phase != Phase::Nobody => {
                self.heard = Some(now);
                let payload = payload.clone();
                self.write(now, move |writer, device, at| writer.received(device, at, &payload).map(|_| ()))?;
            }
            Event::Sent(payload) if self.phase != Phase::Nobody => {
                let payload = payload.clone();
                self.write(now, move |writer, device, at| writer.sent(device, at, &payload))?;
            }
            Event::Sent(payload) => {
                self.kept.truncate(KEPT - 1);
                self.kept.insert(0, payload.clone());
            }
            Event::Damaged => self.write(now, move |writer, device, _| {
                writer.damaged(device, 1);
                Ok(())
            })?,
            Event::Open { firmware, ends_another, .. } => {
                self.open(firmware, talk, now)?;
                if *ends_another {
                    self.write(now, |writer, device, at| {
                        writer.event(device, at, Level::Warning, ENDED_ANOTHER)
                    })?;
                }
            }
            Event::Record(_) if self.phase != Phase::Nobody => self.end_silence(now),
            Event::StartedAnew => self.cut("the device was reset", now)?,
            Event::Aside(request, answer) => self.answered(request, answer.as_ref(), talk, now)?,
            Event::Answer(Request::SetParameter { parameter, index, value }, Answer::Done) => {
                self.set(*parameter, *index, Some(*value));
                self.changed = Some(now + SETTLED);
            }
            Event::Answer(Request::Zero { .. } | Request::Defaults, Answer::Done)
            | Event::Unanswered(Request::SetParameter { .. } | Request::Zero { .. } | Request::Defaults) => {
                self.ask_parameters(talk, now);
            }
            Event::Fault(Some(_)) if self.burst.is_none() => {
                self.burst = Some(Burst { next: 0, count: None, due: now + BURST, tries: 0, asked: false });
            }
            _ => {}
        }
        Ok(())
    }

    /// Does what is due. Returns, once a second, whether there is something new in [`Self::totals`].
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn turn(&mut self, talk: &mut Talk, now: Instant) -> Result<bool, RecordingError> {
        if self.changed.is_some_and(|due| due <= now) {
            self.changed = None;
            self.told_parameters(talk, now)?;
        }
        if self.phase == Phase::Records
            && let Some(burst) = &mut self.burst
            && !burst.asked
            && burst.due <= now
        {
            burst.asked = true;
            talk.ask_aside(Request::Burst { index: burst.next }, now);
        }
        if self.status_due.is_some_and(|due| due <= now) {
            self.status_due = Some(now + STATUS);
            self.status(now)?;
            return Ok(true);
        }
        Ok(false)
    }

    /// The link was cut: what comes after has no connexion with what came before.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn cut(&mut self, words: &str, now: Instant) -> Result<(), RecordingError> {
        if self.phase == Phase::Nobody {
            return Ok(());
        }
        self.phase = Phase::Nobody;
        (self.changed, self.burst, self.status_due) = (None, None, None);
        self.kept.clear();
        lock(&self.totals).gaps += 1;
        self.silent_since = Some(self.heard.unwrap_or(now));
        self.status(now)?;
        let words = words.to_owned();
        self.write(now, move |writer, device, at| writer.gap(device, at, &words))
    }

    /// For how long nothing has come, where the link was cut.
    pub fn silence(&self, now: Instant) -> Option<Duration> {
        self.silent_since.map(|since| now - since)
    }

    fn end_silence(&mut self, now: Instant) {
        if let Some(since) = self.silent_since.take() {
            lock(&self.totals).gaps_time += now - since;
        }
    }

    /// The last status of the link. Waits until all of it is written, and returns what became of the records.
    ///
    /// # Errors
    /// The recording has stopped.
    pub fn finish(&mut self, now: Instant) -> Result<Totals, RecordingError> {
        self.end_silence(now);
        if self.phase != Phase::Nobody {
            self.status(now)?;
            self.phase = Phase::Nobody;
        }
        let (done, is_done) = mpsc::channel();
        self.send(Box::new(move |_| {
            let _ = done.send(());
            Ok(())
        }));
        // It is not done, and dropped, where the recording has stopped.
        let _ = is_done.recv();
        self.entries = None;
        match lock(&self.recording.told).error.take() {
            Some(error) => Err(error),
            None => Ok(self.totals()),
        }
    }

    fn status(&mut self, now: Instant) -> Result<(), RecordingError> {
        let totals = Arc::clone(&self.totals);
        self.write(now, move |writer, device, at| {
            let status = writer.link(device, at)?;
            lock(&totals).add(&status);
            Ok(())
        })
    }

    fn open(&mut self, firmware: &Firmware, talk: &mut Talk, now: Instant) -> Result<(), RecordingError> {
        let identity = std::mem::take(&mut self.identity);
        let Ok(Reply::Identity { identity: who, .. }) = Reply::<MAX_JOINTS>::decode(&identity) else {
            return Ok(());
        };
        let mut about = About::of(&who);
        about.port = Some(self.port.clone());
        // A socket or a pseudo-terminal has no speed, but what is behind it does.
        about.baud = Some(talk.baud());
        let hand = self.hand(firmware);
        if let Some(file) = &hand {
            about = about.with_hand(file);
        }
        lock(&self.totals).sessions += 1;
        let kept = std::mem::take(&mut self.kept);
        let is_known = hand.is_some();
        self.write(now, move |writer, device, at| {
            writer.about(device, at, &about)?;
            if !is_known {
                let words = "the hand's file is not known: there are counts, but no angles";
                writer.event(device, at, Level::Warning, words)?;
            }
            kept.iter().rev().try_for_each(|payload| writer.sent(device, at, payload))?;
            writer.received(device, at, &identity).map(|_| ())
        })?;
        let each = |parameter: Parameter| {
            (0..parameter.count(firmware.joint_count)).map(move |index| Setting {
                parameter,
                index,
                value: None,
            })
        };
        self.settings = Parameter::ALL.into_iter().flat_map(each).collect();
        self.status_due = Some(now + STATUS);
        self.asked = 0;
        self.ask_parameters(talk, now);
        Ok(())
    }

    /// The file of a firmware's hand, among those that are known.
    fn hand(&self, firmware: &Firmware) -> Option<HandFile> {
        let files = self.hands.iter().map(|file| Some(file.as_str())).chain([None]);
        let mut known =
            files.filter_map(|file| HandModel::of_device(file, &firmware.hand, firmware.hand_hash).ok());
        known.next().map(|(_, file)| file)
    }

    fn ask_parameters(&mut self, talk: &mut Talk, now: Instant) {
        self.phase = Phase::Parameters(self.settings.len());
        for &Setting { parameter, index, .. } in &self.settings {
            talk.ask_aside(Request::GetParameter { parameter, index }, now);
        }
    }

    fn set(&mut self, parameter: Parameter, index: u8, value: Option<f32>) {
        let known = (self.settings.iter_mut())
            .find(|setting| (setting.parameter, setting.index) == (parameter, index));
        if let Some(setting) = known {
            setting.value = value;
        }
    }

    /// All parameters are known: they are written down, and records asked for, with a snapshot.
    fn told_parameters(&mut self, talk: &mut Talk, now: Instant) -> Result<(), RecordingError> {
        let settings = self.settings.clone();
        self.write(now, move |writer, device, at| writer.parameters(device, at, &settings))?;
        self.phase = Phase::Telemetry;
        talk.ask_aside(self.telemetry(), now);
        Ok(())
    }

    /// An answer to what was asked aside.
    fn answered(
        &mut self,
        request: &Request,
        answer: Option<&Answer>,
        talk: &mut Talk,
        now: Instant,
    ) -> Result<(), RecordingError> {
        match (request, answer) {
            (&Request::GetParameter { parameter, index }, Some(answer)) => {
                match answer {
                    Answer::Value(setting) => self.set(parameter, index, Some(setting.value)),
                    Answer::Refused(Refusal::Busy) => {
                        talk.ask_aside(request.clone(), now);
                        return Ok(());
                    }
                    // Switched off.
                    _ => self.set(parameter, index, None),
                }
                if let Phase::Parameters(left) = &mut self.phase {
                    *left = left.saturating_sub(1);
                    if *left == 0 {
                        self.told_parameters(talk, now)?;
                    }
                }
            }
            (Request::Telemetry { .. }, Some(Answer::Done)) if self.phase == Phase::Telemetry => {
                self.phase = Phase::Records;
            }
            (Request::Telemetry { .. }, Some(Answer::Done)) => {}
            (Request::GetParameter { .. } | Request::Telemetry { .. }, _) => {
                self.asked += 1;
                if self.asked > TRIES * 2 {
                    let words = format!("no answer to {request:?}");
                    self.write(now, move |writer, device, at| {
                        writer.event(device, at, Level::Error, &words)
                    })?;
                } else {
                    talk.ask_aside(request.clone(), now);
                }
            }
            (&Request::Burst { index }, answer) => self.caught(index, answer, now)?,
            _ => {}
        }
        Ok(())
    }

    /// An answer to the request for a record of a burst. The record itself is among the payloads.
    fn caught(&mut self, index: u16, answer: Option<&Answer>, now: Instant) -> Result<(), RecordingError> {
        let Some(burst) = self.burst.as_mut().filter(|burst| burst.next == index) else { return Ok(()) };
        burst.asked = false;
        burst.due = now + BURST;
        let words = match answer {
            Some(Answer::Burst { count, .. }) => {
                burst.count = Some(*count);
                burst.next += 1;
                burst.tries = 0;
                if burst.next < *count {
                    return Ok(());
                }
                format!("the records around the fault are read out: {count}")
            }
            Some(Answer::Refused(Refusal::BurstNotOver | Refusal::Busy)) => return Ok(()),
            Some(Answer::Refused(Refusal::NoBurst)) if burst.count.is_none() => {
                self.burst = None;
                return Ok(());
            }
            None if burst.tries < TRIES => {
                burst.tries += 1;
                return Ok(());
            }
            _ => format!("of the records around the fault, only {index} were read out: the hand was armed"),
        };
        self.burst = None;
        self.write(now, move |writer, device, at| writer.event(device, at, Level::Info, &words))
    }

    fn write(
        &self,
        now: Instant,
        write: impl FnOnce(&mut Writer, Device, Stamp) -> Result<(), RecordingError> + Send + 'static,
    ) -> Result<(), RecordingError> {
        if let Some(error) = lock(&self.recording.told).error.take() {
            return Err(error);
        }
        let (at, device) = (self.recording.stamp(now), Arc::clone(&self.device));
        self.send(Box::new(move |writer| match device.get() {
            Some(&device) => write(writer, device, at),
            None => Ok(()),
        }));
        Ok(())
    }

    fn send(&self, entry: Entry) {
        if let Some(entries) = &self.entries {
            // After the end of the file it goes nowhere.
            let _ = entries.send(Some(entry));
        }
    }
}

/// Returns `true` if a payload is an introduction.
fn is_identity(payload: &[u8]) -> bool {
    payload.first() == Some(&0)
}
