//! A device that says anything: well framed, and otherwise as it likes. Nothing of it stops the host, is taken for a path, or gets
//! to a terminal as it is.
#![cfg(unix)]

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::device::recorder::Recording;
use blindgrasp::device::talk::{PATIENCE, Talk};
use blindgrasp::model::HandModel;
use blindgrasp::record::mcap;
use blindgrasp::wire::{Packet, Record, Request, printable};
use blindgrasp_shared::command::{Command, Grasp, Refusal};
use blindgrasp_shared::identity::{Clock, Identity, Image};
use blindgrasp_shared::link::message::{self, Form, Signals};
use blindgrasp_shared::link::{Receiver, encode};
use blindgrasp_shared::parameters::{Parameter, Setting};
use blindgrasp_shared::telemetry::{INTERFACE_VERSION, List};
use fastrand::Rng;
use serde::ser::SerializeTuple as _;
use serde::{Serialize, Serializer};
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{self, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Texts that do something to a terminal, or to whoever takes them for a path.
const TEXTS: [&str; 10] = [
    "\x1b[2J\x1b]0;mine\x07",
    "\u{9b}31m\r\n\t\0",
    "\u{202e}dnah\u{200b}",
    "",
    "../../../../etc/passwd",
    "/dev/zero",
    "/no/such/hand.toml",
    "three-finger",
    "{}{0:?}%s%n",
    "fingers, fingers, fingers, fingers, fingers, fingers",
];
const NUMBERS: [f32; 10] =
    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-45, -0.0, 0.0, 1.0, 250.0];

type Reply<'a> = message::Reply<'a, MAX_JOINTS>;

/// Bytes as they are, for [`encode`].
struct Raw<'b>(&'b [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

fn frame(message: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; 4096];
    encode(message, &mut buffer).expect("room").to_vec()
}

/// The device.
struct Liar {
    random: Rng,
    /// The share of times that it does something else than it should.
    lies: f64,
    kind: &'static str,
    receiver: Receiver<{ Packet::MOST_BYTES + 4 }>,
    asked: Vec<Packet>,
    tick: u32,
}

impl Liar {
    fn new(seed: u64, kind: &'static str) -> Self {
        let mut random = Rng::with_seed(seed);
        let lies = [0.5, 0.1, 0.02, 0.005][random.usize(0..4)];
        Self { random, lies, kind, receiver: Receiver::new(), asked: Vec::new(), tick: 0 }
    }

    fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(Ok(payload)) = self.receiver.push(byte) {
                self.asked.extend(Packet::decode(payload));
            }
        }
    }

    fn lies(&mut self) -> bool {
        self.random.f64() < self.lies
    }

    fn number(&mut self) -> f32 {
        match self.lies() {
            true => f32::from_bits(self.random.u32(..)),
            false => NUMBERS[self.random.usize(0..NUMBERS.len())],
        }
    }

    fn text(&mut self, right: &'static str) -> &'static str {
        if self.lies() { TEXTS[self.random.usize(0..TEXTS.len())] } else { right }
    }

    /// Returns the right value, or another.
    fn or<T>(&mut self, right: T, others: &[T]) -> T
    where
        T: Copy,
    {
        if self.lies() { others[self.random.usize(0..others.len())] } else { right }
    }

    fn identity(&mut self, sequence: u16, hand_hash: u32) -> Vec<u8> {
        let image = Image {
            interface_version: INTERFACE_VERSION,
            kind: self.text(self.kind),
            hand: self.text("three-finger"),
            hand_hash: self.or(hand_hash, &[0, 1]),
            firmware_version: self.text("0.1.0"),
            build_hash: 1,
            joint_count: self.or(12, &[0, 1, 11, 13, MAX_JOINTS as u8, 255]),
            fingertip_count: self.or(3, &[0, 255]),
            period_us: self.or(1000, &[0, 1, 7, u32::MAX]),
        };
        let identity = Identity {
            clock_hz: self.or(168_000_000, &[0, 1, u32::MAX]),
            changed: self.or(0, &[u64::MAX, 1 << 40]),
            ..Identity::of(image, Clock::External)
        };
        let session = self.random.u16(..);
        let ends_another = self.lies();
        frame(&Reply::Identity { sequence, session, identity, ends_another })
    }

    fn record(&mut self) -> Record {
        self.tick = self.or(self.tick.wrapping_add(1), &[0, 1, self.tick, u32::MAX, self.tick ^ 1 << 31]);
        let joints = self.or(12, &[0, 1, 11, MAX_JOINTS]);
        let counts = std::array::from_fn(|_| self.random.i32(..));
        let torques_nm = std::array::from_fn(|_| self.number());
        let mut record = Record {
            sequence: self.or(self.tick, &[0, u32::MAX]),
            tick: self.tick,
            work_j: self.number(),
            cycles: self.or(7, &[u32::MAX]),
            decimation: self.or(1, &[0, u16::MAX]),
            counts: List::first_of(counts, joints),
            torques_nm: List::first_of(torques_nm, joints),
            ..Record::BLANK
        };
        record.gains.grasp = [self.number(), self.number()];
        record
    }

    /// Bytes of a record that are something else in one place, and may still be one.
    fn mutated(&mut self) -> Vec<u8> {
        let record = self.record();
        let form = if self.random.bool() { Form::Input } else { Form::Full(Signals::FULL) };
        let mut payload = postcard::to_stdvec(&form.of(&record)).expect("bytes");
        for _ in 0..=self.random.usize(0..3) {
            let at = self.random.usize(0..payload.len());
            payload[at] = self.random.u8(..);
        }
        frame(&Raw(&payload))
    }

    fn answer(&mut self, packet: &Packet, hand_hash: u32) -> Vec<u8> {
        let sequence = packet.sequence;
        let refused = Refusal::ALL[self.random.usize(0..Refusal::ALL.len())];
        if self.lies() {
            return match self.random.u8(0..6) {
                0 => Vec::new(),
                1 => self.identity(sequence, hand_hash),
                2 => self.mutated(),
                3 => frame(&Raw(&std::array::from_fn::<u8, 40, _>(|_| self.random.u8(..)))),
                4 => vec![9, 9, 0],
                _ => frame(&Reply::Answer { sequence, refused: Some(refused) }),
            };
        }
        match packet.request {
            Request::Hello { .. } => self.identity(sequence, hand_hash),
            Request::GetParameter { parameter, index } => {
                let setting = Setting { value: self.number(), file: self.number() };
                frame(&Reply::Value { sequence, parameter, index, setting })
            }
            Request::Burst { index } => {
                let count = self.or(256, &[0, 1, u16::MAX]);
                let record = self.record();
                frame(&Reply::Burst { sequence, index, count, record })
            }
            Request::Joints(_) => Vec::new(),
            _ => frame(&Reply::Answer { sequence, refused: None }),
        }
    }

    /// Everything that it has to say for now.
    fn say(&mut self, hand_hash: u32) -> Vec<u8> {
        let mut said = Vec::new();
        for packet in std::mem::take(&mut self.asked) {
            said.extend(self.answer(&packet, hand_hash));
            if let (Request::Joints(_), false) = (&packet.request, self.lies()) {
                let record = self.record();
                said.extend(frame(&Reply::Record(record)));
            }
        }
        if self.kind == "hand" && self.random.bool() {
            let record = self.record();
            said.extend(frame(&Reply::Record(record)));
        }
        if self.lies() {
            said.extend(self.mutated());
        }
        said
    }

    /// Talks to whoever is at a socket, for so long.
    fn serve(mut self, mut socket: UnixStream, time: Duration) {
        let hand_hash = hash();
        socket.set_read_timeout(Some(Duration::from_millis(1))).expect("a timeout");
        let begun = Instant::now();
        let mut bytes = [0; 512];
        while begun.elapsed() < time {
            match socket.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => self.take(&bytes[..count]),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(_) => return,
            }
            let said = self.say(hand_hash);
            if socket.write_all(&said).is_err() {
                return;
            }
        }
    }
}

fn hash() -> u32 {
    HandModel::load("three-finger").expect("the hand").hash()
}

/// Something that a user may ask for.
fn wish(random: &mut Rng) -> Request {
    let parameter = Parameter::ALL[random.usize(0..Parameter::ALL.len())];
    let index = random.u8(0..16);
    match random.u8(0..8) {
        0 => Request::Command(Command::Arm),
        1 => Request::Command(Command::Grasp(Grasp::CONFIGURED)),
        2 => Request::Command(Command::Stop),
        3 => Request::SetParameter { parameter, index, value: NUMBERS[random.usize(0..NUMBERS.len())] },
        4 => Request::Zero { joint: None },
        5 => Request::Defaults,
        _ => Request::GetParameter { parameter, index },
    }
}

#[test]
fn talk_and_recorder_take_whatever_a_device_says() {
    let folder = TempDir::new().expect("a folder");
    let (hand_hash, begun) = (hash(), Instant::now());
    let (mut sessions, mut records) = (0, 0);
    for seed in 0..150 {
        let path = folder.path().join(format!("{seed}.mcap"));
        let recording = Recording::create(&path, false).expect("a recording");
        let mut recorder = recording.add("hand", "port", &[], 1);
        let mut liar = Liar::new(seed, "hand");
        let mut random = Rng::with_seed(!seed);
        let mut now = begun;
        let mut talk = Talk::new(PATIENCE, now).tapped();
        for _ in 0..600 {
            now += Duration::from_micros(random.u64(0..8000));
            let mut turn = || {
                talk.turn(now)?;
                liar.take(&talk.outgoing());
                talk.take(&liar.say(hand_hash), now)
            };
            if turn().is_err() {
                recorder.cut("it said so", now).expect("it records");
                talk = Talk::new(PATIENCE, now).tapped();
            }
            while let Some(event) = talk.event() {
                recorder.take(&event, &mut talk, now).expect("it records");
            }
            recorder.turn(&mut talk, now).expect("it records");
            if random.u8(0..20) == 0 {
                talk.ask(wish(&mut random), now);
            }
        }
        let totals = recorder.finish(now).expect("it was recorded");
        recording.finish().expect("it was recorded");
        (sessions, records) = (sessions + totals.sessions, records + totals.records);
        // One that never said who it is leaves nothing.
        if totals.sessions == 0 {
            assert!(!path.exists());
            continue;
        }
        let recording = mcap::Recording::open(&path).expect("a recording");
        let mut entries = recording.entries().expect("entries");
        let mut decoder = mcap::Decoder::new();
        for entry in &mut entries {
            decoder.take(&entry.expect("an entry"));
        }
        assert!(entries.damage().is_none(), "{seed}");
    }
    // It was believed often enough for that to be a test.
    assert!(sessions > 150 && records > 10_000, "{sessions} sessions, {records} records");
}

/// A port, and the device behind it: as often as it is opened, for so long each time.
fn port(folder: &Path, seed: u64, kind: &'static str, time: Duration) -> String {
    let path = folder.join(format!("{kind}-{seed}"));
    let listener = UnixListener::bind(&path).expect("a socket");
    thread::spawn(move || {
        for socket in listener.incoming().map_while(Result::ok) {
            Liar::new(seed, kind).serve(socket, time);
        }
    });
    format!("unix:{}", path.display())
}

#[cfg(feature = "monitor")]
mod monitor {
    use super::*;
    use blindgrasp::monitor::live::{Live, Told};
    use blindgrasp::monitor::model::{Model, Plot};
    use blindgrasp::monitor::view::{self, Palette, Screen, Source};
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    #[test]
    fn the_monitor_shows_whatever_a_device_says() {
        let folder = TempDir::new().expect("a folder");
        let folder = folder.path();
        let drawn: Vec<bool> = thread::scope(|scope| {
            let monitors: Vec<_> = (1000..1016)
                .map(|seed| {
                    scope.spawn(move || watched(&port(folder, seed, "hand", Duration::from_secs(1)), seed))
                })
                .collect();
            monitors.into_iter().map(|monitor| monitor.join().expect("no panic")).collect()
        });
        assert!(drawn.iter().filter(|has_record| **has_record).count() > drawn.len() / 2, "{drawn:?}");
    }

    /// Watches for a while; returns whether there was a record to be shown.
    fn watched(port: &str, seed: u64) -> bool {
        let mut random = Rng::with_seed(!seed);
        let live = Live::open(port, None, None, None).expect("a line");
        let mut model = Model::new();
        let mut was_shown = false;
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(2) {
            for told in live.fetch().expect("its thread goes on") {
                if let Told::News(at, news) = told {
                    model.take(at, news);
                }
            }
            was_shown |= model.record().is_some();
            let joints = model.joint_count();
            let screen = Screen {
                is_jogging: false,
                source: Source::Port { port, saved: None },
                plot: Plot::all()[random.usize(0..Plot::all().len())],
                window_s: [5, 20, 60][random.usize(0..3)],
                joint: (joints > 0 && random.bool()).then(|| random.usize(0..joints)),
                help: random.u8(0..10) == 0,
                question: None,
                palette: Palette { coloured: random.bool() },
            };
            let size = TestBackend::new(random.u16(1..160), random.u16(1..60));
            let mut terminal = Terminal::new(size).expect("a terminal");
            terminal.draw(|frame| view::draw(frame, &model, &screen, live.now())).expect("it can be drawn");
            let cells = terminal.backend().buffer().content.iter();
            let symbols: String = cells.map(|cell| cell.symbol()).collect();
            assert_eq!(printable(&symbols), symbols);
            if random.u8(0..10) == 0 {
                live.ask(Command::Arm);
            }
            thread::sleep(Duration::from_millis(5));
        }
        live.close();
        was_shown
    }
}

/// Runs the command at a device that hangs up after a while; asserts that it ends in order, and prints nothing that does something
/// to a terminal.
fn assert_ends_in_order(seed: u64, kind: &'static str, arguments: &[&str], typed: &str) -> String {
    let folder = TempDir::new().expect("a folder");
    let port = port(folder.path(), seed, kind, Duration::from_secs(2));
    let keys = nix::pty::openpty(None, None).expect("a terminal");
    let child = process::Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
        .args(arguments)
        .args(["--port", &port])
        .current_dir(folder.path())
        .stdin(Stdio::from(keys.slave))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    std::fs::File::from(keys.master.try_clone().expect("a file")).write_all(typed.as_bytes()).expect("keys");
    let output = child.wait_with_output().expect("the command ends");
    let said = String::from_utf8([output.stdout, output.stderr].concat()).expect("UTF-8");
    assert!(matches!(output.status.code(), Some(0..=2)), "{arguments:?}, {seed}: {}: {said}", output.status);
    assert!(!said.contains("panicked"), "{arguments:?}, {seed}: {said}");
    for line in said.lines() {
        assert_eq!(printable(line), line, "{arguments:?}, {seed}");
    }
    said
}

#[test]
fn commands_end_in_order_whatever_a_device_says() {
    let typed = "status\nget\nwatch 5\narm\nzero\nsave\ndiffers\nquit\n";
    let record = ["record", "--out", "a.mcap", "--duration", "3"];
    let said: Vec<String> = thread::scope(|scope| {
        let runs: Vec<_> = (2000..2008)
            .flat_map(|seed| {
                [
                    scope.spawn(move || assert_ends_in_order(seed, "hand", &["console"], typed)),
                    scope.spawn(move || assert_ends_in_order(seed, "hand", &record, "")),
                    scope.spawn(move || assert_ends_in_order(seed, "pil", &["pil", "cube"], "")),
                ]
            })
            .collect();
        runs.into_iter().map(|run| run.join().expect("no panic")).collect()
    });
    let greeted = said.iter().filter(|said| said.contains("image `")).count();
    assert!(greeted > said.len() / 4, "{greeted} of {}: {said:#?}", said.len());
}

/// A name that a device tells is not a path: what stands there is not even looked at.
#[test]
fn a_hand_s_name_is_not_taken_for_a_path() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("hand.toml");
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/hands/three-finger.toml");
    std::fs::copy(models, &path).expect("a copy");
    let path = path.to_str().expect("UTF-8");
    let why = HandModel::of_device(None, path, hash()).expect_err("it is a path");
    assert!(why.contains("is not built in; name its file with --hand"), "{why}");
    assert!(HandModel::of_device(Some(path), "\x1b[2J", hash()).is_ok());
    assert!(HandModel::of_device(None, "three-finger", hash()).is_ok());
    let why = HandModel::of_device(None, "\x1b[2J", hash()).expect_err("there is none");
    assert_eq!(printable(&why), why);
}

#[test]
fn a_heartbeat_time_that_is_no_number_changes_nothing() {
    let now = Instant::now();
    for value in NUMBERS {
        let mut talk = Talk::new(PATIENCE, now);
        let mut liar = Liar { lies: 0.0, ..Liar::new(1, "hand") };
        talk.turn(now).expect("nothing is wrong");
        liar.take(&talk.outgoing());
        let mut at = now;
        for _ in 0..100 {
            at += Duration::from_millis(1);
            let mut said = Vec::new();
            for packet in std::mem::take(&mut liar.asked) {
                let sequence = packet.sequence;
                said.extend(match packet.request {
                    Request::GetParameter { parameter, index } => {
                        let setting = Setting { value, file: value };
                        frame(&Reply::Value { sequence, parameter, index, setting })
                    }
                    _ => liar.answer(&packet, 0),
                });
            }
            talk.take(&said, at).expect("nothing is wrong");
            talk.turn(at).expect("nothing is wrong");
            liar.take(&talk.outgoing());
        }
        // Never less than once a millisecond, nor more seldom than 300 ms.
        assert!(talk.due() <= at + Duration::from_millis(300), "{value}");
    }
}
