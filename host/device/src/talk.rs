//! A talk with the image `hand`, which does its ticks whether it is asked or not: requests go out, and answers and records
//! come in, in whatever order.
//!
//! [`Talk`] knows neither lines nor clocks: it is given bytes and the time, and gives bytes and events. It says hello until
//! it is heard, and then keeps the heartbeat going; a hand with torque lets go without it. What is asked is asked a few at a
//! time, because the firmware has little room, and told when it is not answered; only `Stop`, which may be repeated, is
//! sent again, and ahead of all that waits. A device that was reset knows nothing of the session: another one begins. A session
//! that another program has taken is not taken back, which would go on for ever: the talk ends.
//!
//! A session begins with the line's rate, before anything else is asked: the talk says at which rate the line is to be, and whoever
//! has the line sees to it.
//!
//! Beside the talk of a user something else may go on that he does not see: what is asked aside waits for what he asks, and is
//! answered aside. Who records takes a talk that is tapped, which tells every payload that goes over the line.

use super::client::{Patience, Traffic};
#[cfg(unix)]
use super::transport::Streams;
use super::transport::{OpenError, SerialPort, Transport};
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::fault::Raised;
use blindgrasp_shared::link::message::{Reply, Signals};
use blindgrasp_shared::link::rate::{self, FASTER_BAUDS, FIRST_BAUD, HostRate, Wanted};
use blindgrasp_shared::link::{Receiver, encode, most_bytes};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_wire::{Answer, Firmware, Packet, Record, Request, other_interface};
use std::collections::VecDeque;
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Most payload and CRC of a reply.
const MOST_RECEIVED: usize = Reply::<MAX_JOINTS>::MOST_BYTES + 4;
/// Most bytes of a request on the wire.
const MOST_SENT: usize = most_bytes(Packet::MOST_BYTES);
/// From one hello to the next.
const HELLO_AGAIN: Duration = Duration::from_millis(500);
/// From one heartbeat to the next, before it is known how many are wanted, or if none are: then they show that the line
/// is there.
const HEARTBEAT: Duration = Duration::from_millis(50);
/// Heartbeats in the time that they may fail.
const HEARTBEATS: f32 = 3.0;
/// The longest time from one to the next, ms: at a fast rate a hand takes silence for the end.
const HEARTBEAT_MOST_MS: f32 = 300.0;
/// From one look at what is to be agreed about the rate to the next.
const RATE_TURN: Duration = Duration::from_millis(10);
/// Time for which a `Stop` may be unanswered before it is sent again, and the number of times that it is sent.
const STOP_AGAIN: Duration = Duration::from_millis(100);
const STOPS: u8 = 5;
/// Requests that may be unanswered at once, besides heartbeats; the firmware has room for eight.
const WINDOW: usize = 4;
/// Ticks from one record to the next, if nobody wants more: often enough to tell of changes.
pub const SELDOM: u16 = 100;

/// A request for records with everything in them.
pub const fn telemetry(decimation: u16) -> Request {
    Request::Telemetry { decimation, signals: Signals::ALL }
}

/// Longest time to wait for a hand: it is there, and answers within a tick or two.
pub const PATIENCE: Patience = Patience { start: Duration::from_secs(3), answer: Duration::from_secs(1) };

/// An event of a talk.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A session began, and the line's rate is agreed.
    Open {
        /// With whom.
        firmware: Firmware,
        /// Time from one of its ticks to the next, us.
        period_us: u32,
        /// It has ended another program's, which was in use a moment ago.
        ends_another: bool,
    },
    /// The device does not know the session: it was reset. What was asked is lost; hello is said again.
    StartedAnew,
    /// A request was answered.
    Answer(Request, Answer),
    /// A request was not answered in time: whether it was done is not known.
    Unanswered(Request),
    /// A request was not sent, because `Stop` came after it.
    Unsent(Request),
    /// The mode is another than in the record before, or is known for the first time.
    Mode(Mode),
    /// The same for the fault.
    Fault(Option<Raised>),
    /// A record came.
    Record(Record),
    /// A request that was asked aside was answered; `None`: not in time.
    Aside(Request, Option<Answer>),
    /// A good frame came, with this payload. Told by a tapped talk, before what follows from it.
    Received(Vec<u8>),
    /// A frame with this payload is sent. Told by a tapped talk.
    Sent(Vec<u8>),
    /// A damaged frame came. Told by a tapped talk.
    Damaged,
}

/// The reason for which a talk has ended.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TalkError {
    /// Nothing that answers.
    #[error(
        "nothing answers within {} s{}: check supply, cable (TX and RX crossed, ground) and port, and that the image `hand` is flashed; the image `pil` talks to `blindgrasp pil` only",
        .0.as_secs_f64(), heard(.1)
    )]
    NobodyThere(Duration, Traffic),
    /// Something answers, but not as a hand does.
    #[error(
        "the firmware has interface version {theirs}, this program {INTERFACE_VERSION}: build and flash the firmware that belongs to this program"
    )]
    OtherInterface {
        /// Its version.
        theirs: u16,
    },
    /// Another program has said hello.
    #[error(
        "another program has said hello to this hand, and leads it now: see that one program alone has the line, then start this one again"
    )]
    SessionTaken,
    /// It answered, and does not any more.
    #[error("the line is lost: nothing came for {} s{}", .0.as_secs_f64(), heard(.1))]
    Silence(Duration, Traffic),
}

/// Returns the words for what came over the line instead of answers.
fn heard(traffic: &Traffic) -> String {
    match traffic {
        Traffic { frames_received: 0, frames_damaged: 0, bytes_received: 0, .. } => String::new(),
        Traffic { frames_received: 0, bytes_received, .. } => format!(
            " but garbage ({bytes_received} bytes without a good frame: another program, or not {FIRST_BAUD} baud)"
        ),
        traffic => format!(" (so far {traffic})"),
    }
}

/// The asker who is told what becomes of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asker {
    /// Nobody but the talk itself.
    Talk,
    User,
    Aside,
}

/// A request that was sent.
struct Asked {
    sequence: u16,
    request: Request,
    asker: Asker,
    deadline: Instant,
    /// The number of times that it may still be sent.
    again: u8,
}

/// The host's end of a session.
pub struct Talk {
    patience: Patience,
    receiver: Receiver<MOST_RECEIVED>,
    /// Payload of the last good frame.
    payload: Vec<u8>,
    tapped: bool,
    /// Number that is wished for of a session: by chance, so that no other program has it.
    wished: u16,
    /// Number of the session, if there is one.
    session: Option<u16>,
    /// Told when the rate is agreed.
    opening: Option<Event>,
    rate: HostRate,
    wanted_bauds: Wanted,
    /// Since when the time of the rate is counted.
    start: Instant,
    /// Number of the last request.
    sequence: u16,
    /// Since when hello is said.
    begun: Instant,
    /// The time of the last good frame.
    heard: Instant,
    /// The time at which the next hello, or heartbeat, is due.
    due: Instant,
    heartbeat: Duration,
    waiting: VecDeque<(Request, Asker)>,
    /// The requests that wait for those.
    aside: VecDeque<Request>,
    asked: Vec<Asked>,
    outgoing: Vec<u8>,
    events: VecDeque<Event>,
    /// Mode and fault of the last record.
    state: Option<(Mode, Option<Raised>)>,
    traffic: Traffic,
}

impl Talk {
    /// Begins to say hello.
    pub fn new(patience: Patience, now: Instant) -> Self {
        Self {
            patience,
            receiver: Receiver::new(),
            payload: Vec::new(),
            tapped: false,
            wished: RandomState::new().build_hasher().finish() as u16,
            session: None,
            opening: None,
            rate: HostRate::new(),
            wanted_bauds: [None; FASTER_BAUDS.len()],
            start: now,
            sequence: 0,
            begun: now,
            heard: now,
            due: now,
            heartbeat: HEARTBEAT,
            waiting: VecDeque::new(),
            aside: VecDeque::new(),
            asked: Vec::new(),
            outgoing: Vec::new(),
            events: VecDeque::new(),
            state: None,
            traffic: Traffic::default(),
        }
    }

    /// The same over a line that may have other rates, of which the first is wanted that the hand has, too.
    #[must_use]
    pub fn with_bauds(mut self, wanted: Wanted) -> Self {
        self.wanted_bauds = wanted;
        self
    }

    /// The rate that the line is to have for what is sent now, baud.
    pub fn baud(&self) -> u32 {
        self.rate.baud()
    }

    /// Time as the rate counts it.
    fn ms(&self, now: Instant) -> u32 {
        now.saturating_duration_since(self.start).as_millis() as u32
    }

    /// The same, telling every payload that goes over the line.
    #[must_use]
    pub fn tapped(mut self) -> Self {
        self.tapped = true;
        self
    }

    /// Asks for something. `Stop` goes at once, session or not, and takes the place of all that waits.
    pub fn ask(&mut self, request: Request, now: Instant) {
        if request == Request::Command(Command::Stop) {
            let (unsent, kept) = self.waiting.drain(..).partition(|&(_, asker)| asker == Asker::User);
            self.waiting = kept;
            let unsent: VecDeque<(Request, Asker)> = unsent;
            self.events.extend(unsent.into_iter().map(|(request, _)| Event::Unsent(request)));
            self.send(request, Asker::User, STOPS, now);
        } else {
            self.waiting.push_back((request, Asker::User));
            self.send_waiting(now);
        }
    }

    /// Asks for something besides: what the user asks goes before it, and does not wait for it.
    pub fn ask_aside(&mut self, request: Request, now: Instant) {
        self.aside.push_back(request);
        self.send_waiting(now);
    }

    /// Ends the session, and the records. Nobody waits for the answer.
    pub fn say_goodbye(&mut self, now: Instant) {
        if self.session.is_some() {
            self.send(Request::Goodbye, Asker::Talk, 1, now);
        }
    }

    /// Takes bytes that came.
    ///
    /// # Errors
    /// If they come from a firmware of another interface version, or another program has taken the session.
    pub fn take(&mut self, bytes: &[u8], now: Instant) -> Result<(), TalkError> {
        self.traffic.bytes_received += bytes.len() as u64;
        // Kept from one call to the next: frames come a thousand times a second.
        let mut payload = std::mem::take(&mut self.payload);
        for &byte in bytes {
            match self.receiver.push(byte) {
                None => continue,
                Some(Ok(good)) => {
                    payload.clear();
                    payload.extend_from_slice(good);
                }
                Some(Err(_)) => {
                    self.traffic.frames_damaged += 1;
                    if self.tapped {
                        self.events.push_back(Event::Damaged);
                    }
                    continue;
                }
            }
            self.traffic.frames_received += 1;
            self.heard = now;
            self.rate.heard(self.ms(now));
            if self.tapped {
                self.events.push_back(Event::Received(payload.clone()));
            }
            match Reply::decode(&payload) {
                Ok(reply) => self.hear(reply, now)?,
                Err(_) => match other_interface(&payload) {
                    Some(theirs) => return Err(TalkError::OtherInterface { theirs }),
                    None => self.traffic.frames_unexpected += 1,
                },
            }
        }
        self.payload = payload;
        self.send_waiting(now);
        Ok(())
    }

    /// Does what is due at this time: hello, heartbeat, looking after what is not answered.
    ///
    /// # Errors
    /// If nobody is there, or not any more.
    pub fn turn(&mut self, now: Instant) -> Result<(), TalkError> {
        match self.session {
            None if now - self.begun >= self.patience.start => {
                return Err(TalkError::NobodyThere(self.patience.start, self.traffic));
            }
            Some(_) if now.saturating_duration_since(self.heard) >= self.patience.answer => {
                return Err(TalkError::Silence(self.patience.answer, self.traffic));
            }
            _ => {}
        }
        let (late, asked) = self.asked.drain(..).partition(|asked| asked.deadline <= now);
        self.asked = asked;
        let late: Vec<Asked> = late;
        for Asked { request, asker, again, .. } in late {
            match asker {
                _ if again > 0 => self.send(request, asker, again, now),
                Asker::Talk => {}
                Asker::User => self.events.push_back(Event::Unanswered(request)),
                Asker::Aside => self.events.push_back(Event::Aside(request, None)),
            }
        }
        if self.session.is_some()
            && let Some(baud) = self.rate.turn(self.ms(now))
        {
            self.send(Request::Rate { baud }, Asker::Talk, 1, now);
        }
        if !self.rate.is_settled() {
            self.due = now + RATE_TURN;
        } else if now >= self.due {
            let request = match self.session {
                None => {
                    // Whatever was on the line before ends here. Of hellos, only the last one's session lasts.
                    self.outgoing.push(0);
                    self.asked.retain(|asked| !matches!(asked.request, Request::Hello { .. }));
                    self.due = now + HELLO_AGAIN;
                    Request::Hello { interface_version: INTERFACE_VERSION }
                }
                Some(_) => {
                    self.due = now + self.heartbeat;
                    Request::Heartbeat
                }
            };
            self.send(request, Asker::Talk, 1, now);
        }
        self.send_waiting(now);
        Ok(())
    }

    /// Returns the time at which [`Self::turn`] has something to do next, at the latest.
    pub fn due(&self) -> Instant {
        self.asked.iter().map(|asked| asked.deadline).fold(self.due, Instant::min)
    }

    /// Returns the bytes that are to be sent; they count as sent.
    pub fn outgoing(&mut self) -> Vec<u8> {
        self.traffic.bytes_sent += self.outgoing.len() as u64;
        std::mem::take(&mut self.outgoing)
    }

    /// The oldest event that was not told yet.
    pub fn event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Returns `true` if there is a session, and everything that was asked is answered.
    pub fn is_idle(&self) -> bool {
        self.session.is_some()
            && self.rate.is_settled()
            && self.waiting.is_empty()
            && !self.asked.iter().any(|asked| asked.asker == Asker::User)
    }

    /// Returns the traffic on the line.
    pub fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    fn send_waiting(&mut self, now: Instant) {
        if !self.rate.is_settled() {
            return;
        }
        if let Some(opening) = self.opening.take() {
            self.events.push_back(opening);
            self.due = now;
        }
        let busy = |asked: &&Asked| asked.request != Request::Heartbeat;
        while self.session.is_some()
            && self.asked.iter().filter(busy).count() < WINDOW
            && let Some((request, asker)) = (self.waiting.pop_front())
                .or_else(|| self.aside.pop_front().map(|request| (request, Asker::Aside)))
        {
            self.send(request, asker, 1, now);
        }
    }

    /// Sends a request, the first of so many times.
    fn send(&mut self, request: Request, asker: Asker, times: u8, now: Instant) {
        self.sequence = self.sequence.wrapping_add(1);
        let sequence = self.sequence;
        let session = match request {
            Request::Hello { .. } => self.wished,
            _ => self.session.unwrap_or(0),
        };
        let packet = Packet { session, sequence, request };
        let mut buffer = [0; MOST_SENT];
        // The buffer is as large as the largest request.
        if let Ok(frame) = encode(&packet, &mut buffer) {
            self.outgoing.extend_from_slice(frame);
            self.traffic.frames_sent += 1;
        }
        if self.tapped {
            let mut payload = [0; Packet::MOST_BYTES];
            // As above.
            if let Ok(payload) = postcard::to_slice(&packet, &mut payload) {
                self.events.push_back(Event::Sent(payload.to_vec()));
            }
        }
        let wait = if times > 1 { STOP_AGAIN } else { self.patience.answer };
        let request = packet.request;
        self.asked.push(Asked { sequence, request, asker, deadline: now + wait, again: times - 1 });
    }

    fn hear(&mut self, reply: Reply<'_, MAX_JOINTS>, now: Instant) -> Result<(), TalkError> {
        let (sequence, answer) = match reply {
            Reply::Record(record) => {
                self.look(record);
                return Ok(());
            }
            Reply::Identity { sequence, session, identity, ends_another } => {
                let theirs = identity.image.interface_version;
                if theirs != INTERFACE_VERSION {
                    return Err(TalkError::OtherInterface { theirs });
                }
                let is_asked = self.asked.iter().any(|asked| {
                    asked.sequence == sequence && matches!(asked.request, Request::Hello { .. })
                });
                if !is_asked {
                    self.traffic.frames_unexpected += 1;
                } else if self.take_asked(sequence).is_some() {
                    let (firmware, period_us) = (Firmware::from(&identity), identity.image.period_us);
                    self.open(session, now);
                    self.opening = Some(Event::Open { firmware, period_us, ends_another });
                }
                return Ok(());
            }
            Reply::Answer { sequence, refused } => (sequence, refused.map_or(Answer::Done, Answer::Refused)),
            Reply::Value { sequence, setting, .. } => (sequence, Answer::Value(setting)),
            Reply::Burst { sequence, count, record, .. } => {
                (sequence, Answer::Burst { count, record: Box::new(record) })
            }
            // For those who record.
            Reply::Snapshot(_) | Reply::Input(_) => return Ok(()),
        };
        let Some(asked) = self.take_asked(sequence) else { return Ok(()) };
        if asked.again > 0 && answer == Answer::Refused(Refusal::Busy) {
            // It is sent again when its time is over.
            self.asked.push(asked);
            return Ok(());
        }
        let Asked { request, asker, .. } = asked;
        let heartbeat_ms = match (&request, &answer) {
            (Request::GetParameter { parameter: Parameter::HEARTBEAT_TIME, .. }, &Answer::Value(setting)) => {
                Some(setting.value)
            }
            (&Request::SetParameter { parameter: Parameter::HEARTBEAT_TIME, value, .. }, Answer::Done) => {
                Some(value)
            }
            _ => None,
        };
        // What is not a number is no reason to change it.
        if let Some(ms) = heartbeat_ms.filter(|ms| !ms.is_nan()) {
            self.heartbeat = Duration::from_secs_f32((ms / HEARTBEATS).clamp(1.0, HEARTBEAT_MOST_MS) / 1e3);
            self.due = self.due.min(now + self.heartbeat);
        }
        if answer == Answer::Refused(Refusal::SessionTaken) {
            return Err(TalkError::SessionTaken);
        }
        if let Request::Rate { .. } = request {
            let asked = match answer {
                Answer::Refused(Refusal::NoSuchRate) => rate::Asked::NoSuchRate,
                Answer::Refused(_) => rate::Asked::Refused,
                _ => rate::Asked::Done,
            };
            self.rate.answered(asked, self.ms(now));
        }
        // Where there is none, none can be forgotten.
        let is_forgotten = self.session.is_some() && answer == Answer::Refused(Refusal::NoSession);
        match asker {
            Asker::Talk => {}
            Asker::User => self.events.push_back(Event::Answer(request, answer)),
            Asker::Aside => self.events.push_back(Event::Aside(request, Some(answer))),
        }
        if is_forgotten {
            self.start_anew(now);
        }
        Ok(())
    }

    /// The request that an answer belongs to.
    fn take_asked(&mut self, sequence: u16) -> Option<Asked> {
        let at = self.asked.iter().position(|asked| asked.sequence == sequence);
        if at.is_none() {
            self.traffic.frames_unexpected += 1;
        }
        at.map(|at| self.asked.remove(at))
    }

    fn open(&mut self, session: u16, now: Instant) {
        self.session = Some(session);
        (self.heartbeat, self.due) = (HEARTBEAT, now);
        self.rate.begin(self.wanted_bauds, self.ms(now));
        let heartbeat = Request::GetParameter { parameter: Parameter::HEARTBEAT_TIME, index: 0 };
        // Ahead of what the user asked for meanwhile.
        self.waiting.push_front((telemetry(SELDOM), Asker::Talk));
        self.waiting.push_front((heartbeat, Asker::Talk));
    }

    fn start_anew(&mut self, now: Instant) {
        self.session = None;
        (self.begun, self.due, self.state) = (now, now, None);
        self.opening = None;
        self.events.push_back(Event::StartedAnew);
        // Who asked aside begins anew, too.
        self.aside.clear();
        let (asked, waiting) = (self.asked.drain(..), self.waiting.drain(..));
        let lost = asked.map(|asked| (asked.request, asked.asker)).chain(waiting);
        let lost = lost.filter(|&(_, asker)| asker == Asker::User);
        self.events.extend(lost.map(|(request, _)| Event::Unanswered(request)));
    }

    /// Looks for what is new in a record.
    fn look(&mut self, record: Record) {
        let (mode, fault) = self.state.map_or((None, None), |(mode, fault)| (Some(mode), fault));
        if mode != Some(record.mode) {
            self.events.push_back(Event::Mode(record.mode));
        }
        if fault != record.fault {
            self.events.push_back(Event::Fault(record.fault));
        }
        self.state = Some((record.mode, record.fault));
        self.events.push_back(Event::Record(record));
    }
}

/// The reason for which a line could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// It is not a serial port that can be used.
    #[error(transparent)]
    Serial(#[from] OpenError),
    /// It can't have the rate that was asked for.
    #[error("--baud {baud}: {port} can't do that; it can do {}", in_words(.can))]
    NoSuchRate {
        /// The port.
        port: String,
        /// The rate.
        baud: u32,
        /// The rates that it can have.
        can: Wanted,
    },
    /// Nobody listens at a socket.
    #[error("cannot connect to the socket {}: {reason}; start the program that listens there first", .path.display())]
    Socket {
        /// Its path.
        path: PathBuf,
        /// The cause.
        reason: io::Error,
    },
}

impl LineError {
    /// Returns `true` if there is nothing of that name, as when an adapter is unplugged.
    pub fn is_absence(&self) -> bool {
        match self {
            Self::Serial(error) => matches!(error, OpenError::NoSuchPort { .. }),
            Self::Socket { reason, .. } => reason.kind() == io::ErrorKind::NotFound,
            Self::NoSuchRate { .. } => false,
        }
    }
}

/// Rates in words, and the first rate, which every line has.
fn in_words(bauds: &Wanted) -> String {
    let faster: String = bauds.iter().flatten().map(|baud| format!("{baud}, ")).collect();
    format!("{faster}{FIRST_BAUD}")
}

/// Rates that are wanted of a line: the one that is asked for, or all that it can have.
///
/// # Errors
/// If it can't have the one.
pub fn wanted_bauds(line: &mut dyn Transport, port: &str, baud: Option<u32>) -> Result<Wanted, LineError> {
    let can = line.bauds();
    match baud {
        None => Ok(can),
        Some(FIRST_BAUD) => Ok([None; FASTER_BAUDS.len()]),
        Some(baud) if can.contains(&Some(baud)) => Ok(can.map(|one| one.filter(|&one| one == baud))),
        Some(baud) => Err(LineError::NoSuchRate { port: port.to_owned(), baud, can }),
    }
}

/// Opens a line at the first rate: a serial port, or `unix:PATH`, a socket at which somebody listens, such as QEMU.
///
/// # Errors
/// If it can't be opened.
pub fn open(port: &str) -> Result<Box<dyn Transport + Send>, LineError> {
    open_at(port, FIRST_BAUD)
}

/// Opens a line at a rate, which a socket does not have.
///
/// # Errors
/// If it can't be opened.
pub fn open_at(port: &str, baud: u32) -> Result<Box<dyn Transport + Send>, LineError> {
    #[cfg(unix)]
    if let Some(path) = port.strip_prefix("unix:") {
        let connect = || {
            let socket = std::os::unix::net::UnixStream::connect(path)?;
            socket.set_nonblocking(true)?;
            Ok(Streams { from: socket.try_clone()?, to: socket })
        };
        let socket = connect().map_err(|reason| LineError::Socket { path: path.into(), reason })?;
        return Ok(Box::new(socket));
    }
    Ok(Box::new(SerialPort::open(Path::new(port), baud)?))
}
