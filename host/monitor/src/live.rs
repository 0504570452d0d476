//! A line with a hand behind it, in a thread of its own: the heartbeat does not wait for a terminal, nor for a disk.
//!
//! A line that is lost is opened again until it is there; meanwhile nothing is kept back that would be sent to whoever
//! answers then. But a heartbeat says that somebody is watching: when nobody has fetched the news for a while, because the
//! terminal takes nothing any more, it ends, and the hand lets go.

use super::exchange::Exchange;
use super::model::{Level, News, Session};
use blindgrasp_device::recorder::{ENDED_ANOTHER, Recorder};
use blindgrasp_device::talk::{self, Event, LineError, Talk, TalkError};
use blindgrasp_device::transport::{self, Transport, TransportError};
use blindgrasp_model::HandModel;
use blindgrasp_record::mcap::RecordingError;
use blindgrasp_shared::command::{self, Command, Move, Refusal};
use blindgrasp_shared::link::message::Signals;
use blindgrasp_shared::link::rate::Wanted;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_wire::{Answer, Firmware, Request};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Longest time for which nothing is looked at but the line.
const SLICE: Duration = Duration::from_millis(10);
/// Longest time for which the line may take no bytes.
const SENDING: Duration = Duration::from_secs(1);
/// From a line that is lost to the next attempt.
const AGAIN: Duration = Duration::from_millis(500);
/// Longest time for which the news may stay unfetched.
const UNWATCHED: Duration = Duration::from_secs(5);
/// From one count of the bytes to the next.
const TRAFFIC: Duration = Duration::from_millis(50);

/// News of a line.
#[derive(Debug)]
pub enum Told {
    /// News, and when, since the begin.
    News(Duration, News),
    /// The result of a stop: `true` if the hand has confirmed it.
    Stopped(bool),
    /// The result of a movement of what is held: `true` if the hand has taken it.
    Moved(Move, bool),
    /// The recording has ended too early.
    Unrecorded(RecordingError),
}

/// The end of the line that is watched.
pub struct Live {
    begun: Instant,
    orders: Sender<Request>,
    told: Receiver<Told>,
    thread: JoinHandle<()>,
    /// The time at which the news were fetched last, ms since the begin.
    fetched_ms: Arc<AtomicU64>,
}

impl Live {
    /// Opens a line, and says hello all the time from then on. `baud` is the line's rate, if not the fastest that
    /// there is; `hand` is the file of the hand, if it is not built in;
    /// `recorder` writes down what goes over the line.
    ///
    /// # Errors
    /// If the line can't be opened now.
    pub fn open(
        port: &str,
        baud: Option<u32>,
        hand: Option<&str>,
        recorder: Option<Recorder>,
    ) -> Result<Self, LineError> {
        let begun = Instant::now();
        let (orders, asked) = mpsc::channel();
        let (tell, told) = mpsc::channel();
        let (opened, is_open) = mpsc::channel();
        let fetched_ms = Arc::new(AtomicU64::new(0));
        let follower = Follower {
            begun,
            port: port.to_owned(),
            baud,
            hand: hand.map(str::to_owned),
            asked,
            tell,
            fetched_ms: Arc::clone(&fetched_ms),
            recorder,
            is_taken: false,
        };
        let thread = thread::spawn(move || follower.follow(&opened));
        match is_open.recv() {
            Ok(Err(error)) => Err(error),
            // Without an answer the thread has ended, which is found out when news are fetched.
            Ok(Ok(())) | Err(_) => Ok(Self { begun, orders, told, thread, fetched_ms }),
        }
    }

    /// Time since the begin.
    pub fn now(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Asks the hand for something. A stop overtakes everything.
    pub fn ask(&self, command: Command) {
        // A thread that has ended is noticed by who fetches the news.
        let _ = self.orders.send(Request::Command(command));
    }

    /// Ends the heartbeat, and what is recorded.
    pub fn close(self) {
        drop(self.orders);
        // If it has panicked, that is told already.
        let _ = self.thread.join();
    }

    /// Returns the news since the last fetch, if the line is still being followed.
    pub fn fetch(&self) -> Option<Vec<Told>> {
        self.fetched_ms.store(self.now().as_millis() as u64, Ordering::Relaxed);
        let mut told = Vec::new();
        loop {
            match self.told.try_recv() {
                Ok(one) => told.push(one),
                Err(TryRecvError::Empty) => return Some(told),
                Err(TryRecvError::Disconnected) if told.is_empty() => return None,
                Err(TryRecvError::Disconnected) => return Some(told),
            }
        }
    }
}

/// Nobody wants the line any more.
struct Over;

/// The end of the line with the hand.
struct Follower {
    begun: Instant,
    port: String,
    baud: Option<u32>,
    hand: Option<String>,
    asked: Receiver<Request>,
    tell: Sender<Told>,
    fetched_ms: Arc<AtomicU64>,
    recorder: Option<Recorder>,
    /// Another program leads the hand: the line is left to it.
    is_taken: bool,
}

impl Follower {
    /// Until nobody wants the line any more.
    fn follow(mut self, opened: &Sender<Result<(), LineError>>) {
        let mut is_first = true;
        loop {
            let line = talk::open(&self.port).and_then(|mut line| {
                let bauds = talk::wanted_bauds(&mut *line, &self.port, self.baud)?;
                Ok((line, bauds))
            });
            let why = match line {
                Ok((mut line, bauds)) => {
                    if std::mem::take(&mut is_first) {
                        let _ = opened.send(Ok(()));
                    }
                    match self.talk(&mut *line, bauds) {
                        Ok(why) => why,
                        Err(Over) => break,
                    }
                }
                Err(error) if is_first => {
                    let _ = opened.send(Err(error));
                    return;
                }
                Err(error) => error.to_string(),
            };
            self.record(|recorder| recorder.cut(&why, Instant::now()));
            self.news(News::Cut(why));
            if self.pause().is_err() {
                break;
            }
        }
        self.record(|recorder| recorder.finish(Instant::now()).map(|_| ()));
    }

    /// Writes something down, as long as that can be done; a hand is not let go for the sake of a disk.
    fn record(&mut self, write: impl FnOnce(&mut Recorder) -> Result<(), RecordingError>) {
        if let Some(recorder) = &mut self.recorder
            && let Err(error) = write(recorder)
        {
            self.recorder = None;
            self.note(Level::Error, format!("the recording has ended: {error}"));
            self.send(Told::Unrecorded(error));
        }
    }

    /// Talks until the line is lost; returns why.
    fn talk(&mut self, line: &mut dyn Transport, bauds: Wanted) -> Result<String, Over> {
        let mut talk = Talk::new(talk::PATIENCE, Instant::now()).with_bauds(bauds).tapped();
        let mut exchange = Exchange::default();
        let mut buffer = [0; 4096];
        let (mut counted, mut count_at) = (*talk.traffic(), Instant::now());
        loop {
            let now = Instant::now();
            if let Err(error) = talk.turn(now) {
                return Ok(self.lost(&error));
            }
            while let Some(event) = talk.event() {
                if matches!(event, Event::Open { .. }) {
                    // Who joins a stream begins in the middle of a frame, which is no damage.
                    counted.frames_damaged = talk.traffic().frames_damaged;
                }
                self.record(|recorder| recorder.take(&event, &mut talk, now));
                self.hear(event, &mut talk, &mut exchange, now);
            }
            self.record(|recorder| recorder.turn(&mut talk, now).map(|_| ()));
            if self.is_unwatched() {
                return Ok("nobody has watched for 5 s, so that the heartbeat was ended".into());
            }
            let is_over = loop {
                match self.asked.try_recv() {
                    Ok(request) => talk.ask(request, now),
                    Err(TryRecvError::Empty) => break false,
                    Err(TryRecvError::Disconnected) => break true,
                }
            };
            let sent = line.set_baud(talk.baud()).and_then(|()| line.send(&talk.outgoing(), now + SENDING));
            if let Err(error) = sent {
                return Ok(broken(&error));
            }
            if is_over {
                talk.say_goodbye(now);
                let _ = line.send(&talk.outgoing(), now + SENDING);
                return Err(Over);
            }
            if now >= count_at {
                let traffic = *talk.traffic();
                let bytes = traffic.bytes_received - counted.bytes_received;
                let damaged = traffic.frames_damaged - counted.frames_damaged;
                let damaged = if exchange.session().is_some() { damaged } else { 0 };
                self.news(News::Traffic { bytes, damaged });
                (counted, count_at) = (traffic, now + TRAFFIC);
            }
            let deadline = talk.due().clamp(now + Duration::from_millis(1), now + SLICE);
            match line.receive(&mut buffer, deadline) {
                Ok(count) => {
                    if let Err(error) = talk.take(&buffer[..count], Instant::now()) {
                        self.is_taken = error == TalkError::SessionTaken;
                        return Ok(self.lost(&error));
                    }
                }
                Err(TransportError::TimedOut) => {}
                Err(error) => return Ok(broken(&error)),
            }
        }
    }

    /// Waits for the next attempt, and until somebody watches; for ever, if another program leads the hand. What is asked
    /// meanwhile can't be sent.
    fn pause(&self) -> Result<(), Over> {
        let until = Instant::now() + AGAIN;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() && !self.is_unwatched() && !self.is_taken {
                return Ok(());
            }
            match self.asked.recv_timeout(left.max(SLICE)) {
                Ok(Request::Command(command)) => {
                    let words = command.words();
                    let why = if self.is_taken { "another program leads the hand" } else { "nobody answers" };
                    let words = match command {
                        Command::Stop => {
                            self.send(Told::Stopped(false));
                            format!("{words}: NOT SENT, {why}: take the motors' power away")
                        }
                        _ => format!("{words}: not sent, {why}"),
                    };
                    self.note(Level::Error, words);
                }
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(Over),
            }
        }
    }

    fn is_unwatched(&self) -> bool {
        let fetched = Duration::from_millis(self.fetched_ms.load(Ordering::Relaxed));
        self.begun.elapsed().saturating_sub(fetched) > UNWATCHED
    }

    fn lost(&self, error: &TalkError) -> String {
        match error {
            TalkError::NobodyThere(..) => format!("{error}; {}", transport::ports_in_words()),
            error => error.to_string(),
        }
    }

    fn hear(&self, event: Event, talk: &mut Talk, exchange: &mut Exchange, now: Instant) {
        match event {
            Event::Sent(payload) => exchange.sent(&payload),
            Event::Received(payload) => {
                if let Some(news) = exchange.received(&payload) {
                    self.news(news);
                }
            }
            Event::Open { firmware, period_us, ends_another } => {
                ask_for_everything(&firmware, talk, now);
                self.greet(firmware, period_us, talk.baud(), exchange.session());
                if ends_another {
                    self.note(Level::Warning, ENDED_ANOTHER.into());
                }
            }
            Event::StartedAnew => {
                let words = "the device was reset: it has forgotten the session, and what was not saved";
                self.news(News::Cut(words.into()));
            }
            Event::Mode(mode) => self.note(Level::Info, format!("mode: {}", mode.words())),
            Event::Fault(None) => self.note(Level::Info, "fault: none any more".into()),
            Event::Fault(Some(raised)) => {
                self.note(Level::Error, format!("{raised}: {}", raised.fault.remedy()));
            }
            Event::Answer(request, answer) => self.answered(&request, &answer),
            Event::Unsent(Request::Command(command)) => {
                self.note(Level::Warning, format!("{}: not sent, because of stop", command.words()));
            }
            Event::Unanswered(Request::Command(Command::Stop)) => {
                self.note(Level::Error, "stop: NO ANSWER: take the motors' power away".into());
                self.send(Told::Stopped(false));
            }
            Event::Unanswered(Request::Command(command)) => {
                let words = format!("{}: no answer; whether it was done is not known", command.words());
                self.note(Level::Warning, words);
            }
            // What the monitor itself wants to know.
            Event::Unsent(request) | Event::Unanswered(request) => talk.ask(request, now),
            Event::Record(record) => self.news(News::Record(Box::new(record))),
            // The traffic counts damage, and nothing is asked aside.
            Event::Damaged | Event::Aside(..) => {}
        }
    }

    fn answered(&self, request: &Request, answer: &Answer) {
        match (request, answer) {
            (&Request::Command(command), answer) => {
                let refused = match answer {
                    Answer::Refused(refusal) => Some(*refusal),
                    _ => None,
                };
                if let Command::Move(to) = command {
                    self.send(Told::Moved(to, refused.is_none()));
                    if refused.is_none() {
                        // One a key would hide everything else.
                        return;
                    }
                }
                let level = if refused.is_some() { Level::Warning } else { Level::Info };
                self.note(level, command::Answer { command, refused }.to_string());
                if command == Command::Stop {
                    self.send(Told::Stopped(refused.is_none()));
                }
            }
            (&Request::GetParameter { parameter, index }, &Answer::Value(setting)) => {
                self.news(News::Setting { parameter, index, value: Some(setting.value) });
            }
            (
                &Request::GetParameter { parameter, index },
                Answer::Refused(Refusal::SwitchedOff | Refusal::NoSuchParameter),
            ) => self.news(News::Setting { parameter, index, value: None }),
            (Request::Telemetry { .. }, Answer::Refused(refusal)) => {
                self.note(Level::Warning, format!("telemetry: refused, {}", refusal.words()));
            }
            _ => {}
        }
    }

    fn greet(&self, firmware: Firmware, period_us: u32, baud: u32, number: Option<u16>) {
        let Firmware { words, hand: hand_name, hand_hash, joint_count, clock_hz, .. } = firmware;
        let hand = HandModel::of_device(self.hand.as_deref(), &hand_name, hand_hash);
        let hand = hand.map(|(hand, _)| Box::new(hand));
        self.note(Level::Info, format!("a session: {words}"));
        let firmware = words.split(',').next().unwrap_or_default().to_owned();
        let session =
            Session { number, firmware, hand_name, hand_hash, joint_count, period_us, clock_hz, baud, hand };
        self.news(News::Open(Box::new(session)));
    }

    fn note(&self, level: Level, words: String) {
        self.news(News::Notice(level, words));
    }

    fn news(&self, news: News) {
        self.send(Told::News(self.begun.elapsed(), news));
    }

    fn send(&self, told: Told) {
        // If nobody listens any more, nobody asks either, which ends the thread.
        let _ = self.tell.send(told);
    }
}

/// Every tick's record, and the parameters that are shown.
fn ask_for_everything(firmware: &Firmware, talk: &mut Talk, now: Instant) {
    talk.ask(Request::Telemetry { decimation: 1, signals: Signals::ALL }, now);
    talk.ask(Request::GetParameter { parameter: Parameter::HEARTBEAT_TIME, index: 0 }, now);
    // Without an answer, or one that says otherwise, they are as in the hand's file.
    let reading = firmware.changed.iter().copied().filter(|parameter| parameter.is_reading());
    for parameter in reading.chain([Parameter::TORQUE_LIMIT]) {
        for index in 0..parameter.count(firmware.joint_count) {
            talk.ask(Request::GetParameter { parameter, index }, now);
        }
    }
}

fn broken(error: &TransportError) -> String {
    format!("the line is lost: {error}")
}
