//! `blindgrasp record`, `console --out` and `serve` end to end: real processes, a pseudo-terminal, and time that passes. The machine may
//! have other things to do: what happens is waited for, ticks that the simulated hand gave up are told by it, and what is asserted
//! of time has room for a process that waits for its turn.
//!
//!     cargo test --release -p blindgrasp --test command record -- --show-output --include-ignored
#![cfg(unix)]

use blindgrasp::record::mcap::{Decoded, Decoder, Recording, Stamp, What};
use blindgrasp::wire::Record;
use blindgrasp_shared::event::Event;
use blindgrasp_shared::fault::Fault;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::burst;
use blindgrasp_shared::telemetry::snapshot::Collector;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longest time that a process may take for what takes a moment.
const PATIENCE: Duration = Duration::from_secs(60);

/// The command.
fn blindgrasp(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_blindgrasp"));
    command.args(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// A process that is gone when this is dropped.
struct Process(Child);

impl Process {
    fn start(mut command: Command) -> Self {
        Self(command.spawn().expect("the command starts"))
    }

    fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.0.id() as i32), signal).expect("a signal");
    }

    /// Returns the output until it has printed this.
    fn said_until(&mut self, wanted: &str) -> String {
        let stdout = self.0.stdout.as_mut().expect("stdout");
        let (mut said, mut byte) = (Vec::new(), [0]);
        while !said.ends_with(wanted.as_bytes()) {
            let count = stdout.read(&mut byte).expect("stdout");
            assert!(count > 0, "no `{wanted}`: {}", String::from_utf8_lossy(&said));
            said.push(byte[0]);
        }
        String::from_utf8(said).expect("UTF-8")
    }

    /// Exit code, stdout and stderr at its end.
    fn end(&mut self, patience: Duration) -> (Option<i32>, String, String) {
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = self.0.try_wait().expect("it can be waited for") {
                break status;
            }
            assert!(begun.elapsed() < patience, "it does not end");
            thread::sleep(Duration::from_millis(5));
        };
        let (mut said, mut errors) = (String::new(), String::new());
        if let Some(mut stdout) = self.0.stdout.take() {
            stdout.read_to_string(&mut said).expect("UTF-8");
        }
        if let Some(mut stderr) = self.0.stderr.take() {
            stderr.read_to_string(&mut errors).expect("UTF-8");
        }
        (status.code(), said, errors)
    }

    /// Time of a processor that it has used, s.
    fn processor_s(&self) -> f64 {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.0.id())).expect("it runs");
        // Behind the name, which may contain anything: user and system time are the 14th and 15th field, in 1/100 s.
        let fields: Vec<&str> = stat.rsplit(')').next().expect("a name").split_whitespace().collect();
        [fields[11], fields[12]].map(|field| field.parse::<f64>().expect("a number")).iter().sum::<f64>()
            / 100.0
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A console at a link, and the way to type more.
fn console(link: &Path, arguments: &[&str]) -> (Process, ChildStdin) {
    let port = ["console", "--port", link.to_str().expect("UTF-8")];
    let mut command = blindgrasp(&[&port, arguments].concat());
    command.stdin(Stdio::piped());
    let mut console = Process::start(command);
    let stdin = console.0.stdin.take().expect("stdin");
    (console, stdin)
}

/// The same, whose hand grasps.
fn grasping(link: &Path) -> (Process, ChildStdin) {
    let (mut console, mut stdin) = console(link, &[]);
    writeln!(stdin, "arm\ngrasp").expect("the lines are taken");
    console.said_until("mode: grasping\n");
    (console, stdin)
}

/// The hand is still held as it was, when the console ends; its last words and those of the hand.
fn assert_still_grasping((mut console, mut stdin): (Process, ChildStdin), hand: &mut Process) -> String {
    writeln!(stdin, "status").expect("the line is taken");
    drop(stdin);
    let (code, said, errors) = console.end(PATIENCE);
    assert_eq!(code, Some(0), "{said}\n{errors}");
    let mode = said.lines().find(|line| line.starts_with("mode"));
    assert!(mode == Some("mode       grasping") && said.contains("stop: done\n"), "{said}\n{errors}");
    hand.signal(Signal::SIGINT);
    let (code, _, told) = hand.end(PATIENCE);
    assert_eq!((code, told.matches("a grasp begins").count()), (Some(0), 1), "{told}");
    told
}

#[test]
fn a_port_in_use_is_refused_and_the_grasp_goes_on() {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("a.mcap"));
    let mut hand = serve(&link, &[]);
    let console = grasping(&link);
    // Whatever it is called, and by whatever command it is asked for.
    let (node, by_id) = (fs::read_link(&link).expect("a link"), folder.path().join("by-id"));
    std::os::unix::fs::symlink(&link, &by_id).expect("a link");
    let who = format!("it is in use by `blindgrasp`, process {}; stop that first", console.0.0.id());
    for port in [&link, &node, &by_id] {
        let port = port.to_str().expect("UTF-8");
        let out = out.to_str().expect("UTF-8");
        for command in [&["record", "--duration", "1", "--out", out][..], &["console"], &["pil", "cube"]] {
            let mut second = Process::start(blindgrasp(&[command, &["--port", port]].concat()));
            let (code, said, errors) = second.end(PATIENCE);
            assert_eq!((code, said.as_str()), (Some(2), ""), "{command:?}: {errors}");
            assert!(errors.contains(&who) && errors.lines().count() == 1, "{command:?}: {errors}");
        }
        assert!(!fs::exists(out).expect("a folder"));
    }
    assert_still_grasping(console, &mut hand);
    // The port of a program that was killed is free.
    let mut hand = serve(&link, &[]);
    let (mut console, _stdin) = grasping(&link);
    console.signal(Signal::SIGKILL);
    console.end(PATIENCE);
    let mut record = Process::start(recorded(&out, &[&link], &["--duration", "3"]));
    assert_eq!(record.end(PATIENCE).0, Some(0));
    hand.signal(Signal::SIGINT);
    hand.end(PATIENCE);
}

#[test]
fn a_served_hand_that_stood_still_keeps_its_grasp_and_says_what_it_missed() {
    let folder = TempDir::new().expect("a folder");
    let link = folder.path().join("hand");
    let mut hand = serve(&link, &[]);
    let console = grasping(&link);
    for _ in 0..3 {
        hand.signal(Signal::SIGSTOP);
        thread::sleep(Duration::from_millis(500));
        hand.signal(Signal::SIGCONT);
        thread::sleep(Duration::from_millis(500));
    }
    let told = assert_still_grasping(console, &mut hand);
    let stops = told.lines().filter_map(|line| line.split_once("this program stood still: "));
    let missed: Vec<u64> = stops
        .filter_map(|(_, words)| words.strip_suffix(" ticks are missed")?.parse().ok())
        .filter(|&missed| missed > 300)
        .collect();
    assert!(missed.len() >= 3, "{told}");
    assert!(missed_in_all(&told) >= missed.iter().sum(), "{told}");
}

/// Ticks that a hand has given up, because the machine had no time for it, as its last words tell.
fn missed_in_all(told: &str) -> u64 {
    let summary = told.lines().last().expect("a summary");
    let count = summary.split_once(" late, ").and_then(|(_, words)| words.split_once(" missed"));
    count.and_then(|(count, _)| count.parse().ok()).expect("a count")
}

/// A hand that is served at a link, by a line that has time for every record in full.
fn serve(link: &Path, arguments: &[&str]) -> Process {
    serve_at("3000000", link, arguments)
}

fn serve_at(baud: &str, link: &Path, arguments: &[&str]) -> Process {
    let link = link.to_str().expect("UTF-8");
    let all = [&["serve", "cube", "--link", link, "--baud", baud], arguments].concat();
    let mut hand = Process::start(blindgrasp(&all));
    let mut line = String::new();
    let mut stdout = BufReader::new(hand.0.stdout.take().expect("stdout"));
    stdout.read_line(&mut line).expect("a line");
    assert!(line.starts_with("port /"), "{line}");
    hand
}

fn recorded(out: &Path, links: &[&Path], arguments: &[&str]) -> Command {
    let mut all = vec!["record", "--json", "--out", out.to_str().expect("UTF-8")];
    for link in links {
        all.extend(["--port", link.to_str().expect("UTF-8")]);
    }
    all.extend(arguments);
    blindgrasp(&all)
}

/// The content of a file on a device.
#[derive(Default)]
struct Content {
    records: Vec<Decoded>,
    sessions: usize,
    settings: usize,
    /// The numbers of records before each gap.
    gaps: Vec<usize>,
    /// Ticks of whole snapshots.
    snapshots: Vec<u32>,
    /// Records around a fault.
    burst: usize,
    last_received: Option<Stamp>,
    damaged: bool,
}

fn read(path: &Path) -> Vec<Content> {
    let recording = Recording::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut contents: Vec<Content> = recording.devices().iter().map(|_| Content::default()).collect();
    let mut collectors: Vec<Collector> = contents.iter().map(|_| Collector::new()).collect();
    let mut decoder = Decoder::new();
    let mut entries = recording.entries().expect("entries");
    for entry in &mut entries {
        let entry = entry.expect("an entry");
        let content = &mut contents[entry.device];
        match &entry.what {
            What::About(_) => content.sessions += 1,
            What::Parameters(settings) => content.settings = content.settings.max(settings.len()),
            What::Gap { .. } => content.gaps.push(content.records.len()),
            What::Received(payload) => {
                content.last_received = content.last_received.max(Some(entry.at));
                match Reply::<{ blindgrasp::body::MAX_JOINTS }>::decode(payload) {
                    Ok(Reply::Snapshot(part)) => {
                        let whole = collectors[entry.device].add(&part).map(|(tick, _)| tick);
                        content.snapshots.extend(whole);
                    }
                    Ok(Reply::Burst { .. }) => content.burst += 1,
                    _ => {}
                }
            }
            _ => {}
        }
        content.records.extend(decoder.take(&entry));
    }
    let damaged = !entries.damage().is_none();
    if damaged {
        println!("{}", entries.damage());
    }
    contents.iter_mut().for_each(|content| content.damaged = damaged);
    contents
}

/// Returns the content of a file that is being written on its first device, if there is one yet.
fn so_far(path: &Path) -> Option<Content> {
    Recording::open(path).ok()?;
    read(path).into_iter().next()
}

fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < PATIENCE, "waiting until {what}");
        thread::sleep(Duration::from_millis(200));
    }
}

/// The part of the records that has every tick: from the first of two neighbours on.
fn every_tick(records: &[Decoded]) -> &[Decoded] {
    let begin =
        records.windows(2).position(|pair| pair[1].record.tick == pair[0].record.tick.wrapping_add(1));
    &records[begin.expect("neighbours")..]
}

/// Asserts that no tick is missing.
fn assert_whole(records: &[Decoded]) {
    for pair in every_tick(records).windows(2) {
        assert_eq!(pair[1].record.tick, pair[0].record.tick.wrapping_add(1), "{} lost", pair[1].lost_before);
    }
}

/// Asserts the results of the other commands for a recording without a gap: the same bits again, and a row a record.
fn assert_replayed_and_exported(path: &Path, records: &[Decoded]) {
    let file = path.to_str().expect("UTF-8");
    let run = |arguments: &[&str]| {
        let (code, said, errors) = Process::start(blindgrasp(arguments)).end(PATIENCE);
        assert_eq!(code, Some(0), "{said}\n{errors}");
        said
    };
    let replay: Value = serde_json::from_str(&run(&["replay", "--json", file])).expect("JSON");
    println!("replay: {} ticks, {} bits differ", replay["ticks"], replay["bits_differ"]);
    assert_eq!(replay["bits_differ"], 0);
    let [ticks, not_replayed] = ["ticks", "not_replayed"].map(|key| replay[key].as_u64().expect("a number"));
    assert_eq!(ticks + not_replayed, records.len() as u64);
    // What comes before the first state, and after a parameter was set.
    assert!(not_replayed < 200, "{not_replayed}");
    let table = path.with_extension("csv");
    run(&["export", file, "--to", "csv", "--out", table.to_str().expect("UTF-8")]);
    let rows = fs::read_to_string(&table).expect("a table").lines().count() - 1;
    assert_eq!(rows, records.len());
}

/// Records a hand that does nothing for so long; returns the shares of a processor that recording and serving took.
fn idle_hand(seconds: u32) -> [f64; 2] {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("idle.mcap"));
    let mut hand = serve(&link, &[]);
    let mut record = Process::start(recorded(&out, &[&link], &["--duration", &seconds.to_string()]));
    let begun = Instant::now();
    let served_s = hand.processor_s();
    thread::sleep(Duration::from_millis(u64::from(seconds) * 1000 - 500));
    let shares =
        [record.processor_s(), hand.processor_s() - served_s].map(|s| s / begun.elapsed().as_secs_f64());
    let (code, said, errors) = record.end(PATIENCE);
    hand.signal(Signal::SIGINT);
    let missed = missed_in_all(&hand.end(PATIENCE).2);
    let report: Value = serde_json::from_str(&said).expect("JSON");
    println!(
        "{seconds} s: {} records, none missing; recording takes {:.1} %, serving {:.1} % of a processor",
        report["records"],
        1e2 * shares[0],
        1e2 * shares[1]
    );
    assert_eq!((code, &report["whole"]), (Some(0), &Value::Bool(true)), "{said}\n{errors}");
    let [content] = &read(&out)[..] else { panic!("one device") };
    assert!(!content.damaged && content.gaps.is_empty());
    let settings: usize = Parameter::ALL.iter().map(|parameter| usize::from(parameter.count(12))).sum();
    assert_eq!((content.sessions, content.settings), (1, settings));
    assert_whole(&content.records);
    assert_eq!(report["records"].as_u64(), Some(content.records.len() as u64));
    // Everything but the first moments, in which parameters are read.
    let ticks = every_tick(&content.records).len() as u64;
    assert!(ticks + missed + 3000 > 1000 * u64::from(seconds), "{ticks} ticks, {missed} missed");
    let snapshots = content.snapshots.len() as u64;
    assert!(1000 * (snapshots + 1) >= ticks, "{snapshots} snapshots of {ticks} ticks");
    assert_replayed_and_exported(&out, &content.records);
    // Four times what it is without optimization.
    assert!(cfg!(debug_assertions) || shares[0] < 0.15, "{shares:?}");
    shares
}

#[test]
fn every_tick_is_recorded() {
    idle_hand(10);
}

#[test]
#[ignore = "takes a minute"]
fn every_tick_of_a_minute_is_recorded() {
    idle_hand(60);
}

/// A line that has no time for every record in full: each tick is told of all the same, and replayed to the bit.
#[test]
fn at_one_megabaud_every_tick_is_recorded_by_input_records_and_full_ones() {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("slow.mcap"));
    let _hand = serve_at("1000000", &link, &[]);
    let (code, said, errors) = Process::start(recorded(&out, &[&link], &["--duration", "4"])).end(PATIENCE);
    let report: Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!((code, &report["whole"]), (Some(0), &Value::Bool(true)), "{said}\n{errors}");
    let number = |value: &Value| value.as_u64().expect("a number");
    let [all, inputs] = ["records", "input_records"].map(|key| number(&report["devices"][0][key]));
    let [content] = &read(&out)[..] else { panic!("one device") };
    assert_eq!(content.records.len() as u64, all - inputs);
    assert!(inputs > all / 5 && inputs < all * 4 / 5, "{inputs} of {all}");
    let file = out.to_str().expect("UTF-8");
    let (code, said, errors) = Process::start(blindgrasp(&["replay", "--json", file])).end(PATIENCE);
    assert_eq!(code, Some(0), "{said}\n{errors}");
    let replay: Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!(number(&replay["bits_differ"]), 0);
    assert_eq!(number(&replay["ticks"]) + number(&replay["not_replayed"]), all);
    // What comes before the first state.
    assert!(number(&replay["not_replayed"]) < 200, "{replay}");
}

#[test]
fn a_script_is_recorded_with_its_grasp_a_fault_and_what_was_caught_around_it() {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("grasp.mcap"));
    let _hand = serve(&link, &["--fail-after", "1.5"]);
    let (mut console, mut stdin) = console(&link, &["--out", out.to_str().expect("UTF-8")]);
    writeln!(stdin, "arm\ngrasp").expect("the lines are taken");
    console.said_until("fault 1: ");
    // Its records are read out in the 5 s that the line has time for.
    wait_until("the burst is read", || so_far(&out).is_some_and(|content| content.burst == BURST));
    writeln!(stdin, "clear\nset force_n 4").expect("the lines are taken");
    console.said_until("force_n = 4: done\n");
    let snapshots = so_far(&out).map_or(0, |content| content.snapshots.len());
    wait_until("a state follows", || {
        so_far(&out).is_some_and(|content| content.snapshots.len() > snapshots + 1)
    });
    drop(stdin);
    let (code, said, errors) = console.end(PATIENCE);
    assert_eq!(code, Some(0), "{said}\n{errors}");
    let [content] = &read(&out)[..] else { panic!("one device") };
    assert_whole(&content.records);
    let modes: Vec<Mode> = content.records.iter().map(|decoded| decoded.record.mode).collect();
    let mut passed = modes.clone();
    passed.dedup();
    assert_eq!(passed, [Mode::Disarmed, Mode::Armed, Mode::Grasping, Mode::Fault, Mode::Disarmed]);
    let grasping = modes.iter().filter(|mode| **mode == Mode::Grasping).count();
    assert!((1499..=1501).contains(&grasping), "{grasping} ticks");
    let fault = content.records.iter().find_map(|decoded| decoded.record.fault).expect("a fault");
    assert_eq!(fault.fault, Fault::SampleMissing);
    assert_eq!(content.burst, BURST);
    // After the parameter was set: a state to go on from, at once.
    // The one before may have been broken off for it.
    assert!(content.snapshots.windows(2).any(|pair| pair[1].wrapping_sub(pair[0]) % 1000 > 0));
    let angles = content.records.iter().filter(|decoded| !decoded.angles_rad.as_slice().is_empty()).count();
    assert!(angles + 200 > content.records.len(), "{angles} records with angles");
    assert_replayed_and_exported(&out, &content.records);
}

/// Records around a fault.
const BURST: usize = burst::BEFORE + burst::AFTER;

/// A sign and a zero that are set while it is recorded: what was computed with them is replayed to the bit.
#[test]
fn signs_and_zeros_that_are_set_are_replayed() {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("zero.mcap"));
    let _hand = serve(&link, &[]);
    let path = out.to_str().expect("UTF-8");
    let (mut console, mut stdin) = console(&link, &["--out", path]);
    for (line, milliseconds) in [
        ("status", 1000),
        ("zero 4", 1500),
        ("set encoder_reversed 5 1", 1500),
        ("confirm", 500),
        ("arm", 1500),
    ] {
        writeln!(stdin, "{line}").expect("the line is taken");
        thread::sleep(Duration::from_millis(milliseconds));
    }
    drop(stdin);
    let (code, said, errors) = console.end(PATIENCE);
    assert_eq!(code, Some(0), "{said}\n{errors}");
    let [content] = &read(&out)[..] else { panic!("one device") };
    let of = |wanted: &dyn Fn(&Record) -> bool| {
        content.records.iter().filter(|decoded| wanted(&decoded.record)).count()
    };
    let unconfirmed = of(&|record| record.events.contains(Event::Unconfirmed));
    assert!(unconfirmed > 1000, "{unconfirmed} ticks");
    assert!(of(&|record| record.mode == Mode::Armed) > 500);
    let (code, said, errors) = Process::start(blindgrasp(&["replay", "--json", path])).end(PATIENCE);
    assert_eq!(code, Some(0), "{said}\n{errors}");
    let replay: Value = serde_json::from_str(&said).expect("JSON");
    let number = |value: &Value| value.as_u64().expect("a number");
    assert_eq!(number(&replay["bits_differ"]), 0);
    // While parameters are read anew, the state is not known.
    assert!(number(&replay["ticks"]) > 3 * number(&replay["not_replayed"]), "{replay}");
}

#[test]
fn a_hand_that_is_cut_off_is_waited_for_and_another_loses_nothing() {
    let folder = TempDir::new().expect("a folder");
    let links = ["left", "right"].map(|name| folder.path().join(name));
    let out = folder.path().join("two.mcap");
    let [left, mut right] = [&links[0], &links[1]].map(|link| serve(link, &[]));
    let mut record = Process::start(recorded(&out, &[&links[0], &links[1]], &["--duration", "12"]));
    thread::sleep(Duration::from_secs(3));
    left.signal(Signal::SIGKILL);
    drop(left);
    thread::sleep(Duration::from_secs(1));
    let _left = serve(&links[0], &[]);
    let back = Stamp::now();
    let (code, said, errors) = record.end(PATIENCE);
    right.signal(Signal::SIGINT);
    let missed = missed_in_all(&right.end(PATIENCE).2);
    assert_eq!(code, Some(1), "{said}\n{errors}");
    assert!(errors.contains("; waiting for it to come back") && errors.contains("back after "), "{errors}");
    let report: Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!((&report["whole"], &report["error"]), (&Value::Bool(false), &Value::Null));
    assert_eq!((&report["devices"][0]["gaps"], &report["devices"][1]["gaps"]), (&1.into(), &0.into()));
    assert!(report["devices"][0]["gaps_s"].as_f64().is_some_and(|s| (0.9..6.0).contains(&s)), "{said}");
    assert_eq!((&report["devices"][1]["missing"], &report["devices"][1]["sessions"]), (&0.into(), &1.into()));
    let [left, right] = &read(&out)[..] else { panic!("two devices") };
    assert!(!left.damaged && right.gaps.is_empty());
    assert_whole(&right.records);
    // Everything but the first moments, in which parameters are read, and the ticks that it gave up.
    let ticks = every_tick(&right.records).len() as u64;
    assert!(ticks + missed + 3000 > 12_000, "{ticks} ticks, {missed} missed");
    let [gap] = left.gaps[..] else { panic!("{:?}", left.gaps) };
    assert_eq!(left.sessions, 2);
    let (before, after) = left.records.split_at(gap);
    assert_whole(before);
    assert_whole(after);
    // Another hand than before, which has just been switched on.
    assert!(after[0].record.tick < before[before.len() - 1].record.tick);
    let resumed_ms = (after[0].arrived.0.saturating_sub(back.0)) as f64 / 1e6;
    println!("recorded again {resumed_ms:.0} ms after it was back");
    assert!(resumed_ms < 3000.0, "{resumed_ms} ms");
}

/// A cable between a served hand and a socket, which can be cut: the hand does not notice.
struct Cable {
    listening: Arc<AtomicBool>,
    _threads: Vec<thread::JoinHandle<()>>,
}

impl Cable {
    fn lay(link: &Path, socket: PathBuf) -> Self {
        let listening = Arc::new(AtomicBool::new(true));
        let mut port = fs::OpenOptions::new().read(true).write(true).open(link).expect("the hand's port");
        let mut reading = port.try_clone().expect("a second handle");
        let plugged: Arc<Mutex<Option<UnixStream>>> = Arc::default();
        let (out, to) = (Arc::clone(&plugged), Arc::clone(&listening));
        let from_hand = thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = reading.read(&mut buffer) {
                // What nobody is there for is gone, as on a wire.
                let mut plugged = out.lock().expect("a lock");
                if let Some(stream) = plugged.as_mut().filter(|_| to.load(Ordering::Relaxed)) {
                    let _ = stream.write_all(&buffer[..count]);
                }
            }
        });
        let is_plugged = Arc::clone(&listening);
        let to_hand = thread::spawn(move || {
            loop {
                while !is_plugged.load(Ordering::Relaxed) {
                    thread::sleep(Duration::from_millis(5));
                }
                let _ = fs::remove_file(&socket);
                let Ok(listener) = UnixListener::bind(&socket) else { return };
                let Ok((mut stream, _)) = listener.accept() else { return };
                drop(listener);
                let _ = fs::remove_file(&socket);
                stream.set_read_timeout(Some(Duration::from_millis(20))).expect("a timeout");
                *plugged.lock().expect("a lock") = stream.try_clone().ok();
                let mut buffer = [0; 4096];
                while is_plugged.load(Ordering::Relaxed) {
                    match stream.read(&mut buffer) {
                        Ok(0) => break,
                        Ok(count) => port.write_all(&buffer[..count]).expect("the hand takes it"),
                        Err(_) => {}
                    }
                }
                *plugged.lock().expect("a lock") = None;
            }
        });
        Self { listening, _threads: vec![from_hand, to_hand] }
    }

    fn plug(&self, plugged: bool) {
        self.listening.store(plugged, Ordering::Relaxed);
    }
}

/// A cable that is cut for 3 s: every record that the hand sent meanwhile is counted as lost, in the summary, the file and the
/// table, and the time is that from the last record before to the first one after.
#[test]
fn what_is_lost_while_a_cable_is_cut_is_counted_and_so_is_the_time() {
    let folder = TempDir::new().expect("a folder");
    let (link, socket) = (folder.path().join("hand"), folder.path().join("socket"));
    let out = folder.path().join("cut.mcap");
    let _hand = serve(&link, &[]);
    let cable = Cable::lay(&link, socket.clone());
    let begun = Instant::now();
    while !socket.exists() {
        assert!(begun.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(5));
    }
    let port = format!("unix:{}", socket.display());
    let mut record = Process::start(recorded(&out, &[Path::new(&port)], &["--duration", "12"]));
    thread::sleep(Duration::from_secs(3));
    cable.plug(false);
    thread::sleep(Duration::from_secs(3));
    cable.plug(true);
    let (code, said, errors) = record.end(PATIENCE);
    assert_eq!(code, Some(1), "{said}\n{errors}");
    let report: Value = serde_json::from_str(&said).expect("JSON");
    let device = &report["devices"][0];
    assert_eq!((&device["gaps"], &device["sessions"]), (&1.into(), &2.into()), "{said}\n{errors}");
    let [content] = &read(&out)[..] else { panic!("one device") };
    let numbers: Vec<u32> = content.records.iter().map(|decoded| decoded.record.sequence).collect();
    let between: u64 = numbers.windows(2).map(|pair| u64::from(pair[1] - pair[0] - 1)).sum();
    let told: u64 = content.records[1..].iter().map(|decoded| decoded.lost_before).sum();
    let missing = device["missing"].as_u64().expect("a number");
    assert!(between > 2500, "{between}");
    assert_eq!((missing, told), (between, between), "{said}");
    let silent_s = content
        .records
        .windows(2)
        .map(|pair| (pair[1].arrived.0 - pair[0].arrived.0) as f64 * 1e-9)
        .fold(0.0, f64::max);
    let told_s = device["gaps_s"].as_f64().expect("a number");
    println!("cut for 3 s: {missing} records missing, {told_s:.3} s told, {silent_s:.3} s in the file");
    assert!(told_s > 2.9 && (told_s - silent_s).abs() < 0.1, "{told_s} s and {silent_s} s: {said}");
    let path = out.to_str().expect("UTF-8");
    let (_, _, errors) = Process::start(blindgrasp(&["export", path, "--to", "csv"])).end(PATIENCE);
    assert!(errors.contains(&format!("{missing} records lost, 1 gaps")), "{errors}");
}

/// Kills a recording after this time, and looks at what is left: the time of which nothing was saved, s.
fn killed(folder: &Path, link: &Path, number: usize, after: Duration) -> f64 {
    let out = folder.join(format!("killed-{number}.mcap"));
    let record = Process::start(recorded(&out, &[link], &[]));
    let begun = Instant::now();
    while !out.exists() {
        assert!(begun.elapsed() < PATIENCE, "no file");
        thread::sleep(Duration::from_millis(1));
    }
    let first = Stamp::now();
    thread::sleep(after);
    let end = Stamp::now();
    record.signal(Signal::SIGKILL);
    drop(record);
    let bytes = fs::read(&out).expect("the file");
    for message in mcap::MessageStream::new(&bytes).expect("MCAP") {
        message.unwrap_or_else(|error| panic!("{number}, after {after:?}: {error}"));
    }
    let contents = read(&out);
    assert!(contents.iter().all(|content| !content.damaged), "{number}, after {after:?}");
    let last = contents.first().and_then(|content| content.last_received).unwrap_or(first).max(first);
    fs::remove_file(&out).expect("the file goes");
    end.0.saturating_sub(last.0) as f64 / 1e9
}

#[test]
fn what_was_killed_at_any_moment_is_whole_to_the_last_second() {
    const HANDS: usize = 5;
    const KILLS: usize = 20;
    let folder = TempDir::new().expect("a folder");
    let mut lost_s: Vec<f64> = thread::scope(|scope| {
        let hands: Vec<_> = (0..HANDS)
            .map(|hand| {
                let folder = folder.path();
                scope.spawn(move || {
                    let link = folder.join(format!("hand-{hand}"));
                    let _hand = serve(&link, &[]);
                    let mut random = fastrand::Rng::with_seed(hand as u64);
                    (0..KILLS)
                        .map(|kill| {
                            let after = Duration::from_millis(random.u64(0..2000));
                            killed(folder, &link, KILLS * hand + kill, after)
                        })
                        .collect::<Vec<f64>>()
                })
            })
            .collect();
        hands.into_iter().flat_map(|hand| hand.join().expect("no panic")).collect()
    });
    let most_s = lost_s.iter().copied().fold(0.0, f64::max);
    let mean_s = lost_s.iter().sum::<f64>() / lost_s.len() as f64;
    println!(
        "{} recordings were killed: at most {most_s:.3} s were lost, {mean_s:.3} s on average",
        lost_s.len()
    );
    assert_eq!(lost_s.len(), HANDS * KILLS);
    // Where the machine gives a hand, or its recording, no time for a while, no record comes that could be saved: nine of ten are
    // not to be blamed for that. By the stamps, all of it is in the file: `at_any_tick_all_but_the_last_half_second_is_in_the_file`.
    lost_s.sort_by(f64::total_cmp);
    let usual_s = lost_s[lost_s.len() * 9 / 10 - 1];
    assert!(usual_s <= 1.0, "{usual_s} s");
}

#[test]
fn a_full_disk_stops_the_recording_and_what_was_saved_is_good() {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("full.mcap"));
    let _hand = serve(&link, &[]);
    // No file may be longer than 200 KiB; a write beyond that is an error, and no signal.
    let mut command = Command::new("sh");
    command.args(["-c", "trap '' XFSZ; ulimit -f 400; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_blindgrasp")]);
    command.args(["record", "--json", "--duration", "30", "--port"]).arg(&link).arg("--out").arg(&out);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut record = Process::start(command);
    let (code, said, errors) = record.end(Duration::from_secs(25));
    assert_eq!(code, Some(1), "{said}\n{errors}");
    assert!(errors.contains("the recording has stopped: "), "{errors}");
    let report: Value = serde_json::from_str(&said).expect("JSON");
    assert!(report["error"].as_str().is_some_and(|error| error.contains(" records, ")), "{said}");
    assert!(fs::metadata(&out).expect("the file").len() <= 200 << 10);
    let [content] = &read(&out)[..] else { panic!("one device") };
    assert!(!content.damaged);
    assert!(content.records.len() > 200, "{} records", content.records.len());
    assert_whole(&content.records);
}

#[test]
fn a_slow_line_is_recorded_with_all_that_it_lost() {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("slow.mcap"));
    let _hand = serve_at("230400", &link, &[]);
    let mut record = Process::start(recorded(&out, &[&link], &["--duration", "5"]));
    let (code, said, errors) = record.end(PATIENCE);
    assert_eq!(code, Some(1), "{said}\n{errors}");
    let report: Value = serde_json::from_str(&said).expect("JSON");
    let device = &report["devices"][0];
    let number = |key: &str| device[key].as_u64().expect("a number");
    // Half of the input records have time; now and then there is a full one.
    assert!(number("dropped_by_device") >= 1 && number("missing") >= 1, "{said}");
    assert!(number("input_records") > 1000, "{said}");
    let [content] = &read(&out)[..] else { panic!("one device") };
    assert_eq!(content.records.len() as u64, number("records") - number("input_records"));
    assert!(content.records.len() > 20, "{said}");
}

#[test]
fn misuse_is_told() {
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().join("a.mcap");
    let path = out.to_str().expect("UTF-8");
    let refused = |arguments: &[&str], words: &[&str]| {
        let (code, said, errors) = Process::start(blindgrasp(arguments)).end(PATIENCE);
        assert_eq!((code, said.as_str()), (Some(2), ""), "{arguments:?}: {errors}");
        assert!(words.iter().all(|word| errors.contains(word)), "{arguments:?}: {errors}");
    };
    refused(&["record", "--out", path], &["which port?", "this machine has "]);
    refused(
        &["record", "--out", path, "--port", "/dev/no"],
        &["cannot open the serial port /dev/no", "this machine has"],
    );
    refused(&["record", "--out", path, "--port", "a", "--port", "a"], &["one is named twice"]);
    // A rate wherever there is a port.
    let monitor = cfg!(feature = "monitor").then_some(&["monitor"][..]);
    let others = [&["console"][..], &["pil", "cube"], &["record", "--out", path]];
    for command in others.into_iter().chain(monitor) {
        refused(
            &[command, &["--port", "/dev/no", "--baud", "fast"]].concat(),
            &["invalid value 'fast' for '--baud <BAUD>'"],
        );
    }
    for command in [&["console"][..], &["pil", "cube"], &["record", "--out", path]] {
        let with = |port| [command, &["--port", port]].concat();
        let no = "cannot open the serial port /dev/no: there is no such port; this machine has ";
        refused(&with("/dev/no"), &[no]);
        for other in ["/dev/null", "/etc/passwd", "/tmp"] {
            refused(
                &with(other),
                &[&format!("serial port {other}: it is not a serial port; this machine has ")],
            );
        }
        refused(&with("unix:/no"), &["cannot connect to the socket /no: ", "start the program that listens"]);
        assert!(!out.exists());
    }
    refused(&["record", "--out", path, "--port", "a", "--duration", "0"], &["--duration"]);
    refused(&["record", "--out", path, "--port", "a", "--hand", "nobody"], &["nobody"]);
    assert!(!out.exists());

    // Somebody is there, but says nothing.
    let silent = folder.path().join("silent");
    let _listener = std::os::unix::net::UnixListener::bind(&silent).expect("a socket");
    let port = format!("unix:{}", silent.display());
    let socket = silent.to_str().expect("UTF-8");
    refused(&["console", "--port", socket], &[&format!("it is a socket: name it as {port}")]);
    refused(&["record", "--out", path, "--port", &port], &["nothing answers within 3 s"]);
    // No longer patience than the recording was to be long.
    refused(&["record", "--out", path, "--port", &port, "--duration", "0.3"], &["nothing answers within 0."]);
    assert!(!out.exists(), "a file without anything in it");

    // A gain beyond the hand's own file: told once, with what to do.
    let (_, _, errors) =
        Process::start(blindgrasp(&["serve", "cube", "--set", "control.force_n=100"])).end(PATIENCE);
    assert!(
        errors.contains("`firmest_factor`") && errors.matches("has to be at most").count() == 1,
        "{errors}"
    );

    // A file is not overwritten.
    let link: PathBuf = folder.path().join("hand");
    let _hand = serve(&link, &[]);
    fs::write(&out, "mine").expect("a file");
    let port = link.to_str().expect("UTF-8");
    refused(&["record", "--out", path, "--port", port], &["is there already", "--force"]);
    let node = fs::read_link(&link).expect("a link");
    let twice = ["it is in use by this program, under another name; name it once"];
    refused(&["record", "--out", "no.mcap", "--port", port, "--port", node.to_str().expect("UTF-8")], &twice);
    let can = ["--baud 2500000: ", "can't do that; it can do 3000000, 2000000, 1500000, 1000000"];
    refused(&["record", "--out", path, "--port", port, "--force", "--baud", "2500000"], &can);
    assert_eq!(fs::read(&out).expect("the file"), b"mine");
    let mut record = Process::start(recorded(&out, &[&link], &["--force", "--duration", "3"]));
    assert_eq!(record.end(PATIENCE).0, Some(0));
}

#[test]
fn an_interrupt_ends_a_recording_cleanly() {
    let folder = TempDir::new().expect("a folder");
    let (link, out) = (folder.path().join("hand"), folder.path().join("a.mcap"));
    let hand = serve(&link, &[]);
    let mut record = Process::start(recorded(&out, &[&link], &[]));
    wait_until("it records", || so_far(&out).is_some_and(|content| content.records.len() > 500));
    record.signal(Signal::SIGINT);
    let (code, said, errors) = record.end(PATIENCE);
    assert_eq!(code, Some(0), "{said}\n{errors}");
    assert!(Recording::open(&out).expect("a recording").is_finished());
    hand.signal(Signal::SIGINT);
    let mut hand = hand;
    let (code, _, errors) = hand.end(PATIENCE);
    assert_eq!(code, Some(0), "{errors}");
    assert!(errors.contains(" ticks, ") && !link.exists(), "{errors}");
}
