//! `blindgrasp console` and the talk behind it, against the device of `blindgrasp-shared`: in simulated time where the
//! time matters, and as a command with a socket for its port.

#[path = "../../shared/tests/flash/mod.rs"]
mod flash;
#[path = "../../shared/tests/random.rs"]
#[allow(dead_code, reason = "the flash uses its part")]
mod random;

use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp::device::talk::{Event, PATIENCE, Talk, TalkError};
use blindgrasp::model::HandModel;
use blindgrasp::wire::{Answer, Packet, Request};
use blindgrasp_shared::command::{Command, Refusal};
use blindgrasp_shared::device::{Device, Inputs};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::identity::{Clock, Crash, CrashKind, Identity, Image, ResetCause};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::link::rate::{FIRST_BAUD, HandRate};
use blindgrasp_shared::link::{Receiver, encode, most_bytes};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::store::{Store, StoreError};
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_shared::telemetry::burst::Burst;
use flash::Memory;
use serde::Serialize;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// A board with the image `hand` whose joints stand still in the hand's posture `open`.
struct Board {
    device: Device<MAX_JOINTS, MAX_FINGERS>,
    burst: Box<Burst<MAX_JOINTS>>,
    receiver: Receiver<512>,
    waiting: VecDeque<Packet>,
    reading: Reading<MAX_JOINTS>,
    mode: Mode,
    fault: Option<Raised>,
    /// Mode of the last record that was sent.
    told: Option<Mode>,
    heartbeats: usize,
    hand_hash: u32,
    store: Option<Store<Memory>>,
    stored: Option<Result<(), StoreError>>,
}

impl Board {
    fn new() -> Self {
        Self::start(INTERFACE_VERSION, None)
    }

    fn with_version(interface_version: u16) -> Self {
        Self::start(interface_version, None)
    }

    /// A start, with what was saved.
    fn start(interface_version: u16, memory: Option<Memory>) -> Self {
        let hand = HandModel::load("three-finger").expect("the hand");
        let image = Image {
            interface_version,
            kind: "hand",
            hand: "three-finger",
            hand_hash: hand.hash(),
            firmware_version: "0.0.1",
            build_hash: 1,
            joint_count: hand.hand.joint_count() as u8,
            fingertip_count: hand.hand.fingertip_count() as u8,
            period_us: hand.config.period_us,
        };
        let crash = Crash {
            kind: CrashKind::HardFault,
            program_counter: 0x0800_1234,
            link_register: 0x0800_4321,
            line: 0,
            file_hash: 0,
        };
        let clock = Clock::External;
        let identity = Identity { reset: ResetCause::Pin, crash: Some(crash), ..Identity::of(image, clock) };
        // A finger: abduction, and three knuckles that bend.
        let mut counts = [0; MAX_JOINTS];
        for (k, count) in counts.iter_mut().enumerate().take(hand.hand.joint_count()) {
            let angle_rad = [0.0, -0.904, 0.749, 0.894][k % 4];
            *count = (angle_rad / hand.config.estimator.encoders[k].rad_per_count) as i32;
        }
        let mut params = hand.params(&hand.config).expect("parameters");
        let mut store = memory.map(|memory| Store::open(memory).expect("it can be read"));
        let restored = store.as_mut().map(|store| {
            store.prepare().expect("there is power");
            store.restore(hand.hash(), &mut params, |_| {})
        });
        Self {
            device: Device::new(params, Identity { restored, ..identity }),
            burst: Box::new(Burst::new()),
            receiver: Receiver::new(),
            waiting: VecDeque::new(),
            reading: Reading::Counts(counts),
            mode: Mode::Disarmed,
            fault: None,
            told: None,
            heartbeats: 0,
            hand_hash: hand.hash(),
            store,
            stored: None,
        }
    }

    fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(Ok(payload)) = self.receiver.push(byte) {
                let packet = Packet::decode(payload).expect("a request");
                self.heartbeats += usize::from(packet.request == Request::Heartbeat);
                self.waiting.push_back(packet);
            }
        }
    }

    /// A tick; returns what it says.
    fn tick(&mut self) -> Vec<u8> {
        let packet = self.waiting.pop_front();
        let inputs = Inputs { cycles: 7, packet, stored: self.stored.take(), ..Inputs::default() };
        let outputs = self.device.tick(&self.reading, &inputs, &mut self.burst);
        if let (Some(order), Some(store)) = (&outputs.order, &mut self.store) {
            self.stored = Some(store.obey(order, self.hand_hash));
        }
        (self.mode, self.fault) = (outputs.record.mode, outputs.record.fault);
        let mut said = Vec::new();
        if let Some(reply) = outputs.reply {
            said.extend(frame(&reply));
        }
        if let Some(form) = outputs.telemetry {
            self.told = Some(self.mode);
            said.extend(frame(&form.of(&outputs.record)));
        }
        said
    }
}

fn frame(message: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; most_bytes(Reply::<MAX_JOINTS>::MOST_BYTES)];
    encode(message, &mut buffer).expect("room").to_vec()
}

/// A talk and a board, a millisecond at a time.
struct Bench {
    talk: Talk,
    board: Board,
    now: Instant,
    events: Vec<Event>,
}

impl Bench {
    fn new() -> Self {
        let now = Instant::now();
        Self { talk: Talk::new(PATIENCE, now), board: Board::new(), now, events: Vec::new() }
    }

    /// With a session, and nothing to tell.
    fn open() -> Self {
        let mut bench = Self::new();
        bench.run(300).expect("a session");
        assert!(bench.talk.is_idle());
        bench.events.clear();
        bench
    }

    fn run(&mut self, milliseconds: u32) -> Result<(), TalkError> {
        self.run_with(milliseconds, |board, bytes| {
            board.take(bytes);
            board.tick()
        })
    }

    /// With another way from the host's bytes of a millisecond to the board's.
    fn run_with(
        &mut self,
        milliseconds: u32,
        mut way: impl FnMut(&mut Board, &[u8]) -> Vec<u8>,
    ) -> Result<(), TalkError> {
        for _ in 0..milliseconds {
            self.talk.turn(self.now)?;
            let said = way(&mut self.board, &self.talk.outgoing());
            self.talk.take(&said, self.now)?;
            self.events.extend(std::iter::from_fn(|| self.talk.event()));
            self.now += Duration::from_millis(1);
        }
        Ok(())
    }

    fn command(&mut self, command: Command) {
        self.talk.ask(Request::Command(command), self.now);
    }

    fn has_seen(&self, event: &Event) -> bool {
        self.events.contains(event)
    }
}

fn done(command: Command) -> Event {
    Event::Answer(Request::Command(command), Answer::Done)
}

#[test]
fn the_heartbeat_is_kept_and_without_it_the_hand_lets_go() {
    let mut bench = Bench::open();
    bench.command(Command::Arm);
    bench.board.heartbeats = 0;
    bench.run(3000).unwrap();
    assert!(bench.has_seen(&done(Command::Arm)) && bench.has_seen(&Event::Mode(Mode::Armed)));
    assert_eq!(bench.board.mode, Mode::Armed);
    // Three in the 250 ms that they may fail.
    assert!((34..=38).contains(&bench.board.heartbeats), "{}", bench.board.heartbeats);
    for _ in 0..3000 {
        bench.board.tick();
    }
    assert_eq!((bench.board.mode, bench.board.fault), (Mode::Fault, Some(Raised::of_hand(Fault::LinkLost))));
}

#[test]
fn a_heartbeat_that_is_set_is_kept_from_then_on() {
    let mut bench = Bench::open();
    let parameter = Parameter::HEARTBEAT_TIME;
    bench.talk.ask(Request::SetParameter { parameter, index: 0, value: 30.0 }, bench.now);
    bench.run(100).unwrap();
    bench.command(Command::Arm);
    bench.run(1000).unwrap();
    assert_eq!(bench.board.mode, Mode::Armed);
}

#[test]
fn faults_and_modes_are_told_when_they_happen_and_once() {
    let mut bench = Bench::open();
    bench.command(Command::Arm);
    bench.run(200).unwrap();
    bench.events.clear();
    let raised = Raised::at(3, Fault::SampleMissing);
    let counts = bench.board.reading;
    bench.board.reading = Reading::Failed(raised);
    bench.run(500).unwrap();
    let told = |event: &Event| !matches!(event, Event::Record(_));
    bench.events.retain(told);
    assert_eq!(bench.events, [Event::Mode(Mode::Fault), Event::Fault(Some(raised))]);
    bench.board.reading = counts;
    bench.command(Command::ClearFault);
    bench.run(200).unwrap();
    bench.events.retain(told);
    let after = [done(Command::ClearFault), Event::Mode(Mode::Disarmed), Event::Fault(None)];
    assert_eq!(bench.events[2..], after);
}

#[test]
fn a_few_requests_are_asked_at_a_time_and_a_stop_overtakes() {
    let mut bench = Bench::open();
    let gets: Vec<Request> =
        (0..9).map(|index| Request::GetParameter { parameter: Parameter::DAMPING, index }).collect();
    for request in &gets {
        bench.talk.ask(request.clone(), bench.now);
    }
    let mut sent = 0;
    bench
        .run_with(200, |board, bytes| {
            board.take(bytes);
            sent = board.waiting.iter().filter(|packet| packet.request != Request::Heartbeat).count();
            let other: Reply<'_, MAX_JOINTS> = Reply::Answer { sequence: 0, refused: None };
            frame(&other)
        })
        .unwrap();
    assert_eq!(sent, 4);
    bench.command(Command::Stop);
    bench.run(200).unwrap();
    let told: Vec<&Event> = bench.events.iter().filter(|event| !matches!(event, Event::Record(_))).collect();
    let answered =
        |event: &&Event| matches!(event, Event::Answer(Request::GetParameter { .. }, Answer::Value(_)));
    assert_eq!(told.iter().filter(|event| answered(event)).count(), 4);
    for request in &gets[4..] {
        assert!(bench.has_seen(&Event::Unsent(request.clone())));
    }
    assert!(bench.has_seen(&done(Command::Stop)) && bench.talk.is_idle());
}

#[test]
fn what_is_asked_aside_waits_for_the_user_and_is_answered_aside() {
    let mut bench = Bench::open();
    let get = |index| Request::GetParameter { parameter: Parameter::DAMPING, index };
    for index in 0..12 {
        bench.talk.ask_aside(get(index), bench.now);
    }
    bench.talk.ask(get(3), bench.now);
    assert!(!bench.talk.is_idle());
    bench.command(Command::Stop);
    bench.run(100).unwrap();
    let answers: Vec<(bool, u8)> = (bench.events.iter())
        .filter_map(|event| match event {
            Event::Answer(Request::GetParameter { index, .. }, Answer::Value(_)) => Some((true, *index)),
            Event::Aside(Request::GetParameter { index, .. }, Some(Answer::Value(_))) => {
                Some((false, *index))
            }
            _ => None,
        })
        .collect();
    // Four were under way; the stop took the user's place in the queue, and nobody else's.
    let expected: Vec<(bool, u8)> = (0..12).map(|index| (false, index)).collect();
    assert_eq!(answers, expected);
    assert!(bench.has_seen(&Event::Unsent(get(3))) && bench.has_seen(&done(Command::Stop)));
}

#[test]
fn a_tapped_talk_tells_every_payload_before_what_it_means() {
    let mut bench = Bench::new();
    bench.talk = Talk::new(PATIENCE, bench.now).tapped();
    bench.run(300).unwrap();
    bench.events.clear();
    bench.command(Command::Arm);
    bench
        .run_with(1, |board, bytes| {
            board.take(bytes);
            [&[3, 3, 0], &board.tick()[..]].concat()
        })
        .unwrap();
    let at = |wanted: &dyn Fn(&Event) -> bool| bench.events.iter().position(wanted).expect("the event");
    let sent = at(&|event| match event {
        Event::Sent(payload) => Packet::decode(payload).unwrap().request == Request::Command(Command::Arm),
        _ => false,
    });
    let damaged = at(&|event| *event == Event::Damaged);
    let received = at(&|event| match event {
        Event::Received(payload) => {
            matches!(Reply::<MAX_JOINTS>::decode(payload), Ok(Reply::Answer { refused: None, .. }))
        }
        _ => false,
    });
    let meaning = at(&|event| *event == done(Command::Arm));
    assert!(sent < damaged && damaged < received && received < meaning);
}

#[test]
fn what_gets_lost_is_told_but_a_stop_is_sent_again() {
    let mut bench = Bench::open();
    bench.command(Command::Arm);
    bench.run(100).unwrap();
    bench.events.clear();
    bench.talk.ask(Request::GetParameter { parameter: Parameter::gain(0), index: 0 }, bench.now);
    bench.command(Command::Stop);
    // A byte of everything that is sent in this millisecond is another.
    bench
        .run_with(1, |board, bytes| {
            let mut bytes = bytes.to_vec();
            bytes.iter_mut().for_each(|byte| *byte = if *byte == 0 { 0 } else { *byte ^ 0x40 | 1 });
            board.take(&bytes);
            board.tick()
        })
        .unwrap();
    bench.run(150).unwrap();
    assert!(bench.has_seen(&done(Command::Stop)));
    assert_eq!(bench.board.mode, Mode::Disarmed);
    bench.run(1000).unwrap();
    let request = Request::GetParameter { parameter: Parameter::gain(0), index: 0 };
    assert!(bench.has_seen(&Event::Unanswered(request)));
}

#[test]
fn a_board_that_was_reset_is_greeted_again() {
    let mut bench = Bench::open();
    bench.board = Board::new();
    bench.command(Command::Arm);
    bench.run(300).unwrap();
    let refused = Answer::Refused(Refusal::NoSession);
    assert!(bench.has_seen(&Event::Answer(Request::Command(Command::Arm), refused)));
    let at = |wanted: fn(&Event) -> bool| bench.events.iter().position(wanted).expect("the event");
    assert!(at(|event| *event == Event::StartedAnew) < at(|event| matches!(event, Event::Open { .. })));
    bench.command(Command::Arm);
    bench.run(1000).unwrap();
    assert_eq!(bench.board.mode, Mode::Armed);
}

#[test]
fn a_session_that_another_program_takes_ends_the_talk_and_is_told_to_both() {
    let mut bench = Bench::open();
    bench.command(Command::Arm);
    bench.run(200).unwrap();
    // At the same line, as programs are that know of no lock.
    let mut other = Talk::new(PATIENCE, bench.now);
    let mut heard = Vec::new();
    let mut both = |milliseconds: u32, bench: &mut Bench| {
        let mut now = bench.now;
        bench.run_with(milliseconds, |board, bytes| {
            other.turn(now).expect("it leads the hand");
            board.take(bytes);
            board.take(&other.outgoing());
            let said = board.tick();
            other.take(&said, now).expect("it leads the hand");
            heard.extend(std::iter::from_fn(|| other.event()));
            now += Duration::from_millis(1);
            said
        })
    };
    assert_eq!(both(300, &mut bench), Err(TalkError::SessionTaken));
    assert!(!bench.has_seen(&Event::StartedAnew));
    // It does not take it back.
    bench.talk = Talk::new(PATIENCE, bench.now + Duration::from_secs(3600));
    both(1000, &mut bench).unwrap_or_else(|error| panic!("{error}"));
    assert!(heard.iter().any(|event| matches!(event, Event::Open { ends_another: true, .. })));
    assert_eq!(bench.board.mode, Mode::Armed);
}

#[test]
fn the_rate_is_agreed_before_anything_else_is_asked() {
    let wanted = [Some(3_000_000), Some(2_000_000), None];
    let mut bench = Bench::new();
    bench.talk = Talk::new(PATIENCE, bench.now).with_bauds(wanted);
    bench.board.device = bench.board.device.with_faster_bauds(&[2_000_000]);
    let (mut rate, mut asked) = (HandRate::new(), Vec::new());
    let mut lost = 0;
    for now_ms in 0..1000 {
        // What is sent at another rate than the board has is lost.
        let host_baud = bench.talk.baud();
        bench
            .run_with(1, |board, bytes| {
                if rate.turn(now_ms) == host_baud {
                    board.take(bytes);
                } else {
                    lost += bytes.len();
                }
                let request = board.waiting.front().map(|packet| packet.request.clone());
                let said = board.tick();
                let agreed = match request {
                    Some(Request::Rate { baud }) => {
                        rate.heard(true, now_ms);
                        // It has only the one.
                        (baud == 2_000_000).then_some(baud)
                    }
                    Some(_) => {
                        rate.heard(false, now_ms);
                        None
                    }
                    None => None,
                };
                asked.extend(request);
                let heard = if rate.turn(now_ms) == host_baud { said } else { Vec::new() };
                if let Some(baud) = agreed {
                    rate.answered(baud, now_ms);
                }
                heard
            })
            .unwrap_or_else(|error| panic!("{error}"));
    }
    let hello = Request::Hello { interface_version: INTERFACE_VERSION };
    let ask = |baud| Request::Rate { baud };
    assert_eq!(asked[..4], [hello, ask(3_000_000), ask(2_000_000), ask(2_000_000)]);
    assert!(!asked[4..].iter().any(|request| matches!(request, Request::Rate { .. })), "{asked:?}");
    assert_eq!((bench.talk.baud(), rate.turn(1000), lost), (2_000_000, 2_000_000, 0));
    let open = bench.events.iter().position(|event| matches!(event, Event::Open { .. }));
    assert!(open.is_some() && bench.talk.is_idle());
    // The hand was reset: it is found at the first rate, and greeted again.
    bench.board = Board::new();
    bench.events.clear();
    for _ in 0..1000 {
        let is_first = bench.talk.baud() == FIRST_BAUD;
        bench
            .run_with(1, |board, bytes| {
                if is_first {
                    board.take(bytes);
                }
                let said = board.tick();
                if is_first { said } else { Vec::new() }
            })
            .unwrap_or_else(|error| panic!("{error}"));
    }
    assert!(bench.has_seen(&Event::StartedAnew) && bench.talk.baud() == FIRST_BAUD);
}

#[test]
fn damaged_frames_are_counted_and_silence_is_noticed() {
    let mut bench = Bench::open();
    bench
        .run_with(1, |board, bytes| {
            [vec![3, 3, 0, 9, 9, 9, 0], {
                board.take(bytes);
                board.tick()
            }]
            .concat()
        })
        .unwrap();
    bench.run(100).unwrap();
    assert_eq!(bench.talk.traffic().frames_damaged, 2);
    let begun = bench.now;
    let error = bench.run_with(5000, |_, _| Vec::new()).unwrap_err();
    assert!(matches!(error, TalkError::Silence(..)), "{error}");
    assert!(bench.now - begun <= PATIENCE.answer, "{:?}", bench.now - begun);
}

#[test]
fn nobody_there_is_told_in_time_and_garbage_as_such() {
    let mut bench = Bench::new();
    let mut hellos = 0;
    let error = bench
        .run_with(5000, |_, bytes| {
            hellos += usize::from(bytes.first() == Some(&0));
            Vec::new()
        })
        .unwrap_err();
    assert_eq!(hellos, 6);
    assert!(!error.to_string().contains("garbage"), "{error}");
    let mut bench = Bench::new();
    let error = bench.run_with(5000, |_, _| b"U-Boot 2021.04\r\n\0".to_vec()).unwrap_err();
    assert!(error.to_string().starts_with("nothing answers within 3 s but garbage (51000 bytes "), "{error}");
}

#[test]
fn another_interface_version_is_told_whether_the_rest_can_be_read_or_not() {
    let mut bench = Bench::new();
    bench.board = Board::with_version(7);
    assert_eq!(bench.run(100), Err(TalkError::OtherInterface { theirs: 7 }));
    let mut bench = Bench::new();
    let unknown = |_: &mut Board, _: &[u8]| frame(&(0_u8, 1_u16, 1_u16, 9_u16, "and then nobody knows"));
    assert_eq!(bench.run_with(100, unknown), Err(TalkError::OtherInterface { theirs: 9 }));
}

#[cfg(unix)]
mod command {
    use super::*;
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;
    use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
    use std::os::unix::net::{UnixListener, UnixStream};
    use std::process::{Child, Output, Stdio};
    use std::sync::mpsc;
    use std::thread;
    use tempfile::TempDir;

    /// The command, at a socket behind which this runs.
    fn start(behind: impl FnOnce(UnixStream) + Send + 'static) -> (Child, TempDir) {
        start_with(Stdio::piped(), &[], behind)
    }

    /// The same with another input, and more arguments.
    fn start_with(
        stdin: Stdio,
        arguments: &[&str],
        behind: impl FnOnce(UnixStream) + Send + 'static,
    ) -> (Child, TempDir) {
        let folder = TempDir::new().expect("a folder");
        let path = folder.path().join("hand");
        let listener = UnixListener::bind(&path).expect("a socket");
        thread::spawn(move || behind(listener.accept().expect("the command connects").0));
        let child = std::process::Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
            .args(["console", "--port", &format!("unix:{}", path.display())])
            .args(arguments)
            .stdin(stdin)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command starts");
        (child, folder)
    }

    /// Runs a board until the host hangs up.
    fn serve(board: Board, socket: UnixStream) -> Board {
        serve_until(board, socket, |_| false)
    }

    /// Most ticks from one look for what the host says to the next: more than that are not made up for, as if the clock stood still
    /// as long as the machine has no time. A board whose ticks ran on without the host would take it for gone.
    const MOST_TICKS: u128 = 20;

    /// Runs a board as fast as the clock does, until it has come so far, the host hangs up, or a minute is over.
    fn serve_until(mut board: Board, mut socket: UnixStream, is_over: impl Fn(&Board) -> bool) -> Board {
        socket.set_read_timeout(Some(Duration::from_millis(1))).expect("a timeout");
        let begun = Instant::now();
        let mut ticks = 0;
        let mut bytes = [0; 512];
        while begun.elapsed() < Duration::from_secs(60) && !is_over(&board) {
            match socket.read(&mut bytes) {
                Ok(count @ 1..) => board.take(&bytes[..count]),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Ok(0) | Err(_) => {
                    // What was said last counts, too.
                    while !board.waiting.is_empty() {
                        board.tick();
                    }
                    break;
                }
            }
            ticks = ticks.max(begun.elapsed().as_millis().saturating_sub(MOST_TICKS));
            while ticks < begun.elapsed().as_millis() {
                ticks += 1;
                // Whether the host has hung up, the reading tells.
                let _ = socket.write_all(&board.tick());
            }
        }
        board
    }

    fn type_all(board: Board, script: &str) -> (Output, String, String) {
        let (output, said, errors, _) = type_to(board, script);
        (output, said, errors)
    }

    /// The same, with the board as it is left.
    fn type_to(board: Board, script: &str) -> (Output, String, String, Board) {
        let (left, board_left) = mpsc::channel();
        let (mut child, _folder) = start(move |socket| drop(left.send(serve(board, socket))));
        child.stdin.take().expect("stdin").write_all(script.as_bytes()).expect("the script is taken");
        let (output, said, errors) = ended(child);
        (output, said, errors, board_left.recv().expect("the board"))
    }

    /// The same at a terminal.
    fn type_by_hand(board: Board, lines: &str) -> (Output, String, String) {
        let terminal = nix::pty::openpty(None, None).expect("a terminal");
        let (child, _folder) =
            start_with(Stdio::from(terminal.slave), &[], |socket| drop(serve(board, socket)));
        let mut keys = std::fs::File::from(terminal.master);
        keys.write_all(lines.as_bytes()).expect("the lines are taken");
        ended(child)
    }

    fn ended(child: Child) -> (Output, String, String) {
        let output = child.wait_with_output().expect("the command ends");
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
        let (said, errors) = (text(&output.stdout), text(&output.stderr));
        (output, said, errors)
    }

    /// Asserts that these lines are there in this order, each the beginning of one.
    fn assert_lines(said: &str, wanted: &[&str]) {
        let mut lines = said.lines();
        for wanted in wanted {
            assert!(lines.any(|line| line.starts_with(wanted)), "no `{wanted}`, or not there, in:\n{said}");
        }
    }

    #[test]
    fn a_script_arms_grasps_releases_and_stops() {
        let script = "arm\ngrasp 0.5 0.002\nwait holding\nstatus\nrelease\nwait opened 2\nstop\n";
        let (output, said, errors) = type_all(Board::new(), script);
        assert_eq!((output.status.code(), errors.as_str()), (Some(0), ""), "{said}");
        let first = [
            "blindgrasp 0.0.1 (00000001), image `hand` for the hand `three-finger`",
            "clock: crystal; started by: reset pin",
        ];
        assert_lines(&said, &first);
        assert_lines(&said, &["last crash: hard fault at 0x08001234"]);
        assert_lines(
            &said,
            &[
                "arm: done",
                "grasp: done",
                "all fingertips touch: the grasp begins",
                "the grasp is at its force: what is held can be moved",
                "mode       carrying",
                "held       x_mm=0 y_mm=0 z_mm=0 turn_x_deg=0 turn_y_deg=0 turn_z_deg=0",
                "release: done",
                "the grasp is let go",
                "stop: done",
                "stop: done",
            ],
        );
        assert_lines(
            &said,
            &["fault      none", "link  ", "joint name ", "0     finger-1-abduct ", "3     finger-1-flex-3 "],
        );
        let row = said.lines().find(|line| line.starts_with("1     finger-1-flex-1 ")).expect("a row");
        assert!(row.contains(" -0.904 "), "{row}");
    }

    #[test]
    fn a_script_ends_where_what_it_waits_for_does_not_come() {
        let script = "arm\nwait holding 0.2\ngrasp\n";
        let (output, said, errors) = type_all(Board::new(), script);
        assert_eq!(output.status.code(), Some(1), "{said}{errors}");
        assert!(said.contains("stop: done") && !said.contains("grasp:"), "{said}");
        let wanted = [
            "blindgrasp: wait: `holding` did not come within 0.2 s",
            "blindgrasp: line 2 of the script was not done, which ends it",
        ];
        assert_lines(&errors, &wanted);
    }

    #[test]
    fn postures_and_joints_go_by_their_names() {
        let script = "help\naim finger-2-flex-1 20\nposture open\narm\nposture opne\nwait ready\nquit\n";
        let (_, said, errors) = type_by_hand(Board::new(), script);
        assert_lines(
            &said,
            &["posture NAME|NUMBER|aimed [TIME_S]", "wait NOTICE [TIME_S]", "postures: open, preshape"],
        );
        assert_lines(
            &said,
            &["aim: done", "posture: refused, the hand is disarmed: arm it first", "arm: done"],
        );
        let wanted = [
            "blindgrasp: the hand has no posture `opne`: did you mean `open`?",
            "blindgrasp: `ready` is nothing that a hand notices: known: in-posture, touched",
        ];
        assert_lines(&errors, &wanted);
    }

    /// As in docs/bring-up.md: a sign and the zeros are set, looked at, confirmed and saved, and are there after a reset.
    #[test]
    fn signs_and_zeros_are_set_shown_confirmed_and_saved() {
        let board = Board::start(INTERFACE_VERSION, Some(Memory::blank(4)));
        let script = "set encoder_reversed 1 1\nstatus\nzero\narm\n";
        let (output, said, _, mut board) = type_to(board, script);
        assert_eq!(output.status.code(), Some(1), "{said}");
        let count = board.device.params().get(Parameter::ENCODER_ZERO, 1).unwrap().value;
        assert!(count != 0.0);
        let lines = [
            "encoder_reversed[1] = 1: done",
            "1     finger-1-flex-1 ",
            "zero: done",
            "encoder_zero_count[0] = 0  (Count at joint angle zero, counts)",
            &format!(
                "encoder_zero_count[1] = {count}  (Count at joint angle zero, counts; 0 in the hand's file)"
            ),
            "arm: refused, signs or zeros were set: look at the angles, and confirm them, first",
        ];
        assert_lines(&said, &lines);
        let row = said.lines().find(|line| line.starts_with("1     finger-1-flex-1 ")).expect("a row");
        assert!(row.contains(" 0.904 "), "{row}");

        // Another program, and the same board.
        board.waiting.clear();
        let (output, said, errors, board) = type_to(board, "status\nsave\n");
        assert_eq!(output.status.code(), Some(1), "{said}{errors}");
        assert_lines(
            &said,
            &[
                "other than in the hand's file: encoder_reversed, encoder_zero_count; `differs` shows them",
                "save: refused, signs or zeros were set",
            ],
        );
        let row = said.lines().find(|line| line.starts_with("1     finger-1-flex-1 ")).expect("a row");
        assert!(row.contains(" 0.000 ") || row.contains(" -0.000 "), "{row}");
        let (output, said, errors, board) = type_to(board, "confirm\nsave\narm\ndisarm\n");
        assert_eq!((output.status.code(), errors.as_str()), (Some(0), ""), "{said}");
        assert_lines(&said, &["confirm: done", "save: done", "arm: done"]);

        let memory = board.store.expect("it has one").into_flash();
        let board = Board::start(INTERFACE_VERSION, Some(memory));
        let (output, said, errors, board) = type_to(board, "differs\narm\ndisarm\ndefaults\ndiffers\narm\n");
        assert_eq!(output.status.code(), Some(1), "{said}{errors}");
        assert_lines(
            &said,
            &[
                "other than in the hand's file: encoder_reversed, encoder_zero_count; ",
                "encoder_reversed[1] = 1  (",
                &format!("encoder_zero_count[1] = {count}  ("),
                "10 differ from the hand's file",
                "arm: done",
                "disarm: done",
                "defaults: done",
                "every parameter is as in the hand's file",
                "arm: refused, signs or zeros were set",
            ],
        );
        let memory = board.store.expect("it has one").into_flash();
        let board = Board::start(INTERFACE_VERSION, Some(memory));
        let (_, said, errors, _) = type_to(board, "arm\n");
        assert!(said.contains("arm: done") && !said.contains("other than"), "{said}{errors}");
    }

    /// Saved with one hand, started with another.
    #[test]
    fn what_was_saved_for_another_hand_is_told_not_to_be_in_force() {
        let mut board = Board::start(INTERFACE_VERSION, Some(Memory::blank(4)));
        board.hand_hash ^= 1;
        let (output, said, errors, board) = type_to(board, "set force_n 1\nsave\n");
        assert_eq!((output.status.code(), errors.as_str()), (Some(0), ""), "{said}");
        let board = Board::start(INTERFACE_VERSION, board.store.map(Store::into_flash));
        let (_, said, errors, _) = type_to(board, "status\n");
        assert!(errors.contains("of 1 parameters that were saved 1 are not in force"), "{said}{errors}");
        let (_, said, _, _) = type_to(Board::new(), "save\n");
        assert_lines(&said, &["save: refused, this hand has nothing to save to"]);
    }

    #[test]
    fn refusals_and_mistakes_are_told_in_words() {
        let script = "graps\ngrasp\nset limits.torque_nm 0.05\nget limits.torque_nm 3\nget force_m\nset force_n x\n\
            get damping_nm_s 200\narm\nset force_n 1\nset\nwatch 1\nquit\n";
        let (output, said, errors) = type_by_hand(Board::new(), script);
        assert_eq!(output.status.code(), Some(0));
        let lines = [
            "grasp: refused, the hand is disarmed: arm it first",
            "limits.torque_nm[0] = 0.05: done",
            "limits.torque_nm[11] = 0.05: done",
            "limits.torque_nm[3] = 0.05  (Largest torque of a joint, N m; at most 1.3878",
            "damping_nm_s[200]: refused, this hand has no parameter with this index",
            "arm: done",
            "force_n = 1: refused, parameters and the line's rate are set while the hand is disarmed",
            "stop: done",
        ];
        assert_lines(&said, &lines);
        let wanted = [
            "blindgrasp: `graps` is not a command: did you mean `grasp`?",
            "blindgrasp: `force_m` is not a parameter: did you mean `force_n`?",
            "blindgrasp: `x` is not a number",
            "blindgrasp: use: set KEY [INDEX] VALUE: ",
            "blindgrasp: watch: `1` is neither `off` nor whole milliseconds",
        ];
        assert_lines(&errors, &wanted);
        assert_eq!(errors.lines().count(), wanted.len(), "{errors}");
    }

    #[test]
    fn a_script_ends_at_the_first_line_that_is_refused() {
        let (output, said, errors) = type_all(Board::new(), "arm\n\nset force_n 1\ngrasp\nstatus\n");
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert_lines(&said, &["arm: done", "force_n = 1: refused, ", "stop: done"]);
        assert!(!said.contains("grasp:") && !said.contains("mode  "), "{said}");
        assert_eq!(errors, "blindgrasp: line 3 of the script was not done, which ends it\n");
    }

    #[test]
    fn a_script_ends_at_the_first_line_that_is_not_understood() {
        let (output, said, errors) = type_all(Board::new(), "arm\ngraps\ngrasp\n");
        assert_eq!(output.status.code(), Some(2), "{errors}");
        assert_lines(&said, &["arm: done", "stop: done"]);
        assert!(!said.contains("grasp:"), "{said}");
        let wanted = "line 2 of the script, which ends it: `graps` is not a command: did you mean `grasp`?";
        assert!(errors.ends_with(&format!("{wanted}\n")) && errors.lines().count() == 1, "{errors}");
    }

    #[test]
    fn a_script_ends_at_the_first_line_that_is_not_answered() {
        let (mut child, _folder) = start(|mut socket| {
            let mut board = Board::new();
            socket.set_read_timeout(Some(Duration::from_millis(1))).expect("a timeout");
            let begun = Instant::now();
            let mut bytes = [0; 512];
            while begun.elapsed() < Duration::from_secs(30) {
                match socket.read(&mut bytes) {
                    Ok(0) => return,
                    Ok(count) => board.take(&bytes[..count]),
                    Err(_) => {}
                }
                // Arming gets lost on the way.
                board.waiting.retain(|packet| packet.request != Request::Command(Command::Arm));
                let _ = socket.write_all(&board.tick());
            }
        });
        child.stdin.take().expect("stdin").write_all(b"arm\ngrasp\n").expect("the script is taken");
        let (output, said, errors) = ended(child);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(
            errors.contains("arm: no answer; ") && errors.contains("line 1 of the script was not done"),
            "{errors}"
        );
        assert!(said.contains("stop: done") && !said.contains("grasp:"), "{said}");
    }

    #[test]
    fn without_a_port_the_ports_are_told() {
        for command in [&["console"][..], &["record", "--out", "no.mcap"]] {
            let output = std::process::Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
                .args(command)
                .output()
                .expect("the command starts");
            assert_eq!(output.status.code(), Some(2));
            let errors = String::from_utf8_lossy(&output.stderr);
            assert!(errors.contains("which port? Name it with --port; this machine has "), "{errors}");
        }
    }

    #[test]
    fn every_parameter_is_shown() {
        let (output, said, _) = type_all(Board::new(), "get\nhelp\n");
        assert_eq!(output.status.code(), Some(0));
        for parameter in Parameter::ALL {
            assert!(
                said.lines().any(|line| line.starts_with(&parameter.to_string())),
                "{parameter}:\n{said}"
            );
        }
        assert_lines(&said, &["gravity_m_s2[2] = -9.8", "help ", "quit ", "stop: done"]);
    }

    #[test]
    fn a_fault_is_told_with_its_remedy_and_is_not_cleared_while_its_cause_is_there() {
        let mut board = Board::new();
        board.reading = Reading::Failed(Raised::at(0, Fault::SampleMissing));
        let (output, said, _) = type_by_hand(board, "status\narm\nclear\nquit\n");
        assert_eq!(output.status.code(), Some(0));
        let fault = "fault 1: joint 0: encoder gave no sample; check the encoder's wiring and supply";
        assert_lines(
            &said,
            &[
                fault,
                "arm: refused, the hand is in a fault",
                "clear fault: refused, the cause of the fault is still",
            ],
        );
        assert_lines(&said, &["joints     not read: fault 1: joint 0"]);
    }

    #[test]
    fn one_interrupt_stops_and_the_second_ends() {
        let (mut child, _folder) = start(|socket| drop(serve(Board::new(), socket)));
        let mut stdin = child.stdin.take().expect("stdin");
        stdin.write_all(b"watch 20\narm\n").expect("the script is taken");
        let mut said = BufReader::new(child.stdout.take().expect("stdout")).lines().map_while(Result::ok);
        let is_watched = |line: String| line.contains(" armed angles_rad ") && line.contains(" torques_nm ");
        assert!(said.any(is_watched), "no line of watch");
        let id = Pid::from_raw(child.id() as i32);
        kill(id, Signal::SIGINT).expect("a signal");
        assert!(said.any(|line| line == "stop: done") && said.any(|line| line == "mode: disarmed"));
        kill(id, Signal::SIGINT).expect("a signal");
        assert!(said.any(|line| line == "stop: done"));
        assert_eq!(child.wait().expect("the command ends").code(), Some(0));
    }

    #[test]
    fn the_hand_is_stopped_whatever_ends_the_command() {
        let (at_the_end, ended) = mpsc::channel();
        let (mut child, _folder) = start(move |socket| {
            let board = serve(Board::new(), socket);
            let _ = at_the_end.send((board.mode, board.fault));
        });
        let mut stdin = child.stdin.take().expect("stdin");
        stdin.write_all(b"watch 20\narm\n").expect("the script is taken");
        let mut said = BufReader::new(child.stdout.take().expect("stdout")).lines().map_while(Result::ok);
        assert!(said.any(|line| line == "mode: armed"));
        // The next line of `watch` can't be printed.
        drop(said);
        assert_eq!(child.wait().expect("the command ends").code(), Some(2));
        assert_eq!(ended.recv(), Ok((Mode::Disarmed, None)));
    }

    #[test]
    fn a_script_does_not_go_on_after_a_reset() {
        let (mut child, _folder) = start(|socket| {
            let same = socket.try_clone().expect("a socket");
            drop(serve_until(Board::new(), socket, |board| board.told == Some(Mode::Armed)));
            drop(serve(Board::new(), same));
        });
        let mut stdin = child.stdin.take().expect("stdin");
        stdin.write_all(b"arm\n").expect("the script is taken");
        let (output, said, errors) = ended(child);
        assert_eq!(output.status.code(), Some(2));
        assert_lines(&said, &["mode: armed", "the device was reset: "]);
        assert!(errors.contains("the device was reset, which ends a script"), "{errors}");
    }

    #[test]
    fn a_line_that_is_lost_ends_the_command() {
        let (mut child, _folder) =
            start(|socket| drop(serve_until(Board::new(), socket, |board| board.told.is_some())));
        let _kept_open = child.stdin.take();
        let (output, said, errors) = ended(child);
        assert_eq!(output.status.code(), Some(2));
        assert!(
            said.contains("mode: disarmed") && errors.contains("the line is lost: the device hung up"),
            "{errors}"
        );
    }

    #[test]
    fn a_port_where_nobody_answers_is_told() {
        let (mut child, _folder) =
            start(|mut socket| while socket.read(&mut [0; 64]).is_ok_and(|count| count > 0) {});
        let _kept_open = child.stdin.take();
        let (output, said, errors) = ended(child);
        assert_eq!((output.status.code(), said.as_str()), (Some(2), ""));
        assert!(
            errors.contains("nothing answers within 3 s: check ") && errors.contains("; this machine has "),
            "{errors}"
        );
        let nowhere = std::process::Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
            .args(["console", "--port", "unix:/no/such/socket"])
            .output()
            .expect("the command starts");
        assert_eq!(nowhere.status.code(), Some(2));
        assert!(
            String::from_utf8_lossy(&nowhere.stderr).contains("cannot connect to the socket /no/such/socket")
        );
    }
}
