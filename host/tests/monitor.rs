//! `blindgrasp monitor` in a pseudo-terminal, with a terminal's emulator for its user's eyes, and `blindgrasp serve` for a hand.

#![cfg(unix)]

use crate::patient;

use nix::sys::signal::{Signal, kill};
use nix::sys::termios::{LocalFlags, tcgetattr};
use nix::unistd::Pid;
use pty_process::Size;
use pty_process::blocking::{self, Pty};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const BLINDGRASP: &str = env!("CARGO_BIN_EXE_blindgrasp");
/// Longest time that anything may take: machines that do a lot else are slow.
const PATIENCE: Duration = Duration::from_secs(30);
const ROWS: u16 = 30;
const COLUMNS: u16 = 100;

/// A simulated hand behind a port.
struct Hand {
    child: Child,
    port: PathBuf,
}

impl Hand {
    /// With a port whose name stays the same when another one takes its place.
    fn serve(folder: &TempDir) -> Self {
        Self::serve_with(folder, &[])
    }

    fn serve_with(folder: &TempDir, arguments: &[&str]) -> Self {
        let is_patient = std::env::var_os("BLINDGRASP_BLESS").is_none();
        let scene = if is_patient { patient::scene(folder, 1000) } else { "cube".into() };
        Self::serve_scene(folder, &scene, arguments)
    }

    fn serve_scene(folder: &TempDir, scene: &Path, arguments: &[&str]) -> Self {
        let port = folder.path().join("hand");
        let _ = std::fs::remove_file(&port);
        let mut child = Command::new(BLINDGRASP)
            .arg("serve")
            .arg(scene)
            .arg("--link")
            .arg(&port)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the command starts");
        let mut line = String::new();
        let stdout = child.stdout.as_mut().expect("stdout");
        BufReader::new(stdout).read_line(&mut line).expect("it says its port");
        assert!(line.starts_with("port "), "{line}");
        Self { child, port }
    }

    /// The arguments that tell a monitor of such a hand, at a port in the same folder.
    fn known(port: &str) -> Vec<String> {
        let hand = Path::new(port).with_file_name(patient::HAND);
        if hand.exists() { vec!["--hand".into(), text(&hand).into()] } else { Vec::new() }
    }
}

impl Drop for Hand {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A terminal with the monitor in it.
struct Terminal {
    pty: Arc<Pty>,
    screen: Arc<Mutex<vt100::Parser>>,
    /// `true` if nobody takes what the monitor writes.
    is_stuck: Arc<AtomicBool>,
    child: Child,
    /// Keeps the terminal there when the monitor has ended.
    kept: std::fs::File,
}

impl Terminal {
    fn start(arguments: &[&str]) -> Self {
        Self::with(arguments, &[])
    }

    fn with(arguments: &[&str], environment: &[(&str, &str)]) -> Self {
        let (pty, pts) = blocking::open().expect("a pseudo-terminal");
        pty.resize(Size::new(ROWS, COLUMNS)).expect("a size");
        let kept = pts.as_fd().try_clone_to_owned().expect("a file").into();
        let child = blocking::Command::new(BLINDGRASP)
            .arg("monitor")
            .args(arguments)
            .args(
                arguments
                    .windows(2)
                    .find(|pair| pair[0] == "--port")
                    .map_or(Vec::new(), |pair| Hand::known(pair[1])),
            )
            .env("TERM", "xterm-256color")
            .env_remove("NO_COLOR")
            .envs(environment.iter().copied())
            .spawn(pts)
            .expect("the command starts");
        let pty = Arc::new(pty);
        let screen = Arc::new(Mutex::new(vt100::Parser::new(ROWS, COLUMNS, 0)));
        let is_stuck = Arc::new(AtomicBool::new(false));
        let (shown, from, waits) = (Arc::clone(&screen), Arc::clone(&pty), Arc::clone(&is_stuck));
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = (&*from).read(&mut bytes) {
                while waits.load(Ordering::Relaxed) {
                    thread::sleep(Duration::from_millis(10));
                }
                shown.lock().expect("no panic").process(&bytes[..count]);
            }
        });
        Self { pty, screen, is_stuck, child, kept }
    }

    fn watching(hand: &Hand) -> Self {
        let terminal = Self::start(&["--port", text(&hand.port)]);
        terminal.wait_for("disarmed, with records", |screen| {
            screen.contains(" DISARMED ") && screen.contains("heartbeat: ")
        });
        terminal
    }

    fn text(&self) -> String {
        self.screen.lock().expect("no panic").screen().contents()
    }

    /// Waits until the screen is as it should be; returns it.
    fn wait_for(&self, what: &str, is_so: impl Fn(&str) -> bool) -> String {
        let begun = Instant::now();
        loop {
            let shown = self.text();
            if is_so(&shown) {
                return shown;
            }
            assert!(begun.elapsed() < PATIENCE, "waiting for {what}:\n{shown}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until something stands there, whether it goes on in the next row or not.
    fn wait_for_text(&self, wanted: &str) -> String {
        self.wait_for(wanted, |screen| in_a_row(screen).contains(wanted))
    }

    fn wait_for_mode(&self, mode: &str) -> String {
        self.wait_for(mode, |screen| screen.starts_with(&format!(" {mode} ")))
    }

    /// Asserts that something stays away for a while.
    fn never_shows(&self, unwanted: &str, time: Duration) {
        let begun = Instant::now();
        while begun.elapsed() < time {
            let shown = self.text();
            assert!(!shown.contains(unwanted), "{shown}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn press(&self, keys: &str) {
        (&*self.pty).write_all(keys.as_bytes()).expect("keys");
    }

    fn resize(&self, rows: u16, columns: u16) {
        self.screen.lock().expect("no panic").screen_mut().set_size(rows, columns);
        self.pty.resize(Size::new(rows, columns)).expect("a size");
    }

    fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.child.id() as i32), signal).expect("a signal");
    }

    /// Waits for the end, asserts that the terminal is as it was, and returns what stands there.
    fn ended(mut self) -> (ExitStatus, String) {
        let begun = Instant::now();
        let status = loop {
            match self.child.try_wait().expect("a child") {
                Some(status) => break status,
                None if begun.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(20)),
                None => panic!("it does not end:\n{}", self.text()),
            }
        };
        self.wait_for_screen("the screen that was there before", |screen| {
            !screen.alternate_screen() && !screen.hide_cursor()
        });
        let flags = tcgetattr(&*self.pty).expect("a terminal").local_flags;
        assert!(flags.contains(LocalFlags::ECHO | LocalFlags::ICANON | LocalFlags::ISIG), "{flags:?}");
        // What was printed last is on its way: behind it comes this.
        const LAST: &str = "-- that is all --";
        self.kept.write_all(format!("\r\n{LAST}").as_bytes()).expect("the terminal is there");
        self.wait_for(LAST, |screen| screen.contains(LAST));
        (status, self.text().replace(LAST, ""))
    }

    fn wait_for_screen(&self, what: &str, is_so: impl Fn(&vt100::Screen) -> bool) {
        let begun = Instant::now();
        while !is_so(self.screen.lock().expect("no panic").screen()) {
            assert!(begun.elapsed() < PATIENCE, "waiting for {what}:\n{}", self.text());
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn in_a_row(screen: &str) -> String {
    screen.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn folder() -> TempDir {
    TempDir::new().expect("a folder")
}

#[test]
fn keys_arm_grasp_and_stop_and_ask_before_what_moves() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let terminal = Terminal::watching(&hand);
    // Refused, with the reason, which stays.
    terminal.press("g");
    terminal.wait_for_text("GRASP: the fingers close.");
    terminal.press("y");
    terminal.wait_for_text("! grasp: refused, the hand is disarmed: arm it first");
    // Not confirmed is not done.
    terminal.press("a");
    terminal.wait_for_text("ARM: the joints get torque and may move.");
    terminal.press("\x1b");
    terminal.wait_for("no question", |screen| !screen.contains("ARM: "));
    terminal.never_shows(" ARMED ", Duration::from_millis(300));
    terminal.press("a\r");
    terminal.wait_for_mode("ARMED");
    terminal.press("gy");
    let shown = terminal.wait_for_mode("GRASPING");
    assert!(shown.contains("grasp: done"), "{shown}");
    // The force grows to what is configured, and the hand holds the cube.
    terminal.wait_for_text("5.00 N");
    terminal.press("d");
    terminal.wait_for_text("DISARM: what is held may fall.");
    terminal.press("y");
    terminal.wait_for_text("! disarm: refused, a grasp is under way: release it first, or stop");
    // A stop asks nothing, not even while there is a question.
    terminal.press("r");
    terminal.wait_for_text("RELEASE: what is held is let go.");
    terminal.press(" ");
    terminal.wait_for_mode("DISARMED");
    terminal.press("q");
    let (status, _) = terminal.ended();
    assert_eq!(status.code(), Some(0));
}

#[test]
fn keys_pick_a_cube_up_move_it_and_put_it_down() {
    let folder = folder();
    let hand = Hand::serve_scene(&folder, Path::new("pick-cube"), &[]);
    let terminal = Terminal::watching(&hand);
    terminal.press("j");
    terminal.wait_for_text("! move: nothing is held firmly");
    terminal.press("ayp");
    terminal.wait_for_text("POSTURE: the fingers move. 1 open 2 preshape Esc: don't");
    terminal.press("2");
    terminal.wait_for_mode("MOVING");
    terminal.press("gy");
    terminal.wait_for_mode("CARRYING");
    terminal.press("j");
    terminal.wait_for_text("JOG: keys move what is held.");
    terminal.press("\rZZZZZZZZw");
    terminal.wait_for_text("JOG x y z: 1 mm along");
    terminal.wait_for_text("the target is where it was to go");
    terminal.press("\x1b");
    terminal.wait_for("no jog", |screen| !screen.contains("JOG"));
    terminal.press("l");
    terminal.wait_for_text("PUT DOWN: what is held sinks until it stands.");
    terminal.press("y");
    terminal.wait_for_mode("PUTTING DOWN");
    terminal.wait_for_mode("CARRYING");
    terminal.press("ry");
    terminal.wait_for_mode("MOVING");
    terminal.press(" ");
    terminal.wait_for_mode("DISARMED");
    terminal.press("q");
    let (status, _) = terminal.ended();
    assert_eq!(status.code(), Some(0));
}

#[test]
fn quitting_with_torque_asks_and_stops_first() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let terminal = Terminal::watching(&hand);
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    terminal.press("q");
    let shown = terminal.wait_for_text("QUIT: with this program its heartbeat ends");
    assert!(in_a_row(&shown).contains("s or Enter: stop it first"), "{shown}");
    terminal.press("s");
    let (status, shown) = terminal.ended();
    assert_eq!(status.code(), Some(0));
    assert!(shown.contains("stop: done"), "{shown}");
    // It was stopped, not left to its fault.
    let again = Terminal::watching(&hand);
    again.never_shows("fault 10", Duration::from_millis(1500));
    again.press("ay");
    again.wait_for_mode("ARMED");
    again.press("qy");
    let (status, shown) = again.ended();
    assert_eq!(status.code(), Some(0));
    assert!(shown.contains("the heartbeat has ended: the hand lets go"), "{shown}");
    // Longer than the heartbeat may fail.
    thread::sleep(Duration::from_millis(1500));
    let after = Terminal::start(&["--port", text(&hand.port)]);
    after.wait_for_text("fault 10: heartbeat of the host stopped: check the cable and the host's program");
    after.press("a\r");
    after.wait_for_text("! arm: refused, the hand is in a fault: clear it first");
    after.press("c");
    after.wait_for_mode("DISARMED");
}

#[test]
fn ctrl_c_and_signals_stop_the_hand_and_give_the_terminal_back() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let terminal = Terminal::watching(&hand);
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    terminal.press("\x03");
    terminal.wait_for_text("stop: done");
    terminal.wait_for_mode("DISARMED");
    terminal.press("\x03");
    assert_eq!(terminal.ended().0.code(), Some(0));
    for signal in [Signal::SIGTERM, Signal::SIGHUP, Signal::SIGINT] {
        let terminal = Terminal::watching(&hand);
        terminal.press("ay");
        terminal.wait_for_mode("ARMED");
        terminal.signal(signal);
        let (status, shown) = terminal.ended();
        assert_eq!(status.code(), Some(0), "{signal}: {shown}");
        assert!(shown.contains("stop: done"), "{signal}: {shown}");
    }
}

#[test]
fn a_terminal_that_is_gone_ends_it_and_stops_the_hand() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let (mut pty, pts) = blocking::open().expect("a pseudo-terminal");
    pty.resize(Size::new(ROWS, COLUMNS)).expect("a size");
    let mut child = blocking::Command::new(BLINDGRASP)
        .args(["monitor", "--port", text(&hand.port)])
        .args(Hand::known(text(&hand.port)))
        .env("TERM", "xterm-256color")
        .spawn(pts)
        .expect("the command starts");
    let mut screen = vt100::Parser::new(ROWS, COLUMNS, 0);
    let mut wait_for = |pty: &mut Pty, mode: &str| {
        let begun = Instant::now();
        let mut bytes = [0; 4096];
        while !screen.screen().contents().starts_with(&format!(" {mode} ")) {
            assert!(begun.elapsed() < PATIENCE, "waiting for {mode}:\n{}", screen.screen().contents());
            let count = pty.read(&mut bytes).expect("a picture");
            screen.process(&bytes[..count]);
        }
    };
    wait_for(&mut pty, "DISARMED");
    pty.write_all(b"a\r").expect("keys");
    wait_for(&mut pty, "ARMED");
    drop(pty);
    let begun = Instant::now();
    let status = loop {
        match child.try_wait().expect("a child") {
            Some(status) => break status,
            None if begun.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(20)),
            None => {
                let _ = child.kill();
                panic!("it goes on without a terminal");
            }
        }
    };
    assert!(status.code().is_some(), "{status}");
    // Stopped, not left to its fault: that would not be disarmed.
    Terminal::watching(&hand);
}

#[test]
fn every_size_can_be_worked_with() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let terminal = Terminal::watching(&hand);
    let mut sizes = vec![(24, 80), (10, 40), (5, 20), (2, 8), (1, 1), (60, 200)];
    sizes.extend(sizes.clone());
    for (rows, columns) in sizes {
        terminal.resize(rows, columns);
        thread::sleep(Duration::from_millis(60));
    }
    terminal.resize(10, 40);
    terminal
        .wait_for("a small screen", |screen| screen.contains(" DISARMED ") && screen.contains("space STOP"));
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    terminal.resize(24, 80);
    terminal.wait_for("everything", |screen| {
        ["finger-1-abduct", "finger-3-flex-3", "torques, N m", "records/s", " ARMED ", "? help"]
            .iter()
            .all(|wanted| screen.contains(wanted))
    });
    for (keys, wanted) in [
        ("\t", "angles, rad: all joints"),
        ("\x1b[B\x1b[B", "angles, rad: finger-1-flex-1"),
        ("\x1b[Z", "torques, N m: finger-1-flex-1"),
        ("w", "(60 s"),
        ("\x1b[A\x1b[A", "torques, N m: all joints"),
        ("?", "STOP at once: no torque"),
    ] {
        terminal.press(keys);
        terminal.wait_for_text(wanted);
    }
    terminal.press("?s");
    terminal.wait_for_mode("DISARMED");
}

#[test]
fn a_dead_link_is_said_and_taken_up_again() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let terminal = Terminal::watching(&hand);
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    drop(hand);
    let shown = terminal.wait_for_mode("NO LINK");
    assert!(shown.contains("was ARMED") && shown.contains("finger-1-abduct"), "{shown}");
    // The screen can be used; what can't be sent is said.
    terminal.press("\t");
    terminal.wait_for_text("angles, rad: all joints");
    terminal.press(" ");
    terminal.wait_for_text("stop: NOT SENT, nobody answers: take the motors' power away");
    // Nothing that was asked for meanwhile is done afterwards.
    terminal.press("ay");
    terminal.wait_for_text("arm: not sent, nobody answers");
    let hand = Hand::serve(&folder);
    terminal.wait_for_mode("DISARMED");
    terminal.never_shows(" ARMED ", Duration::from_millis(500));
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    terminal.press("s");
    terminal.wait_for_mode("DISARMED");
    drop(hand);
    terminal.wait_for_mode("NO LINK");
    terminal.press("q");
    assert_eq!(terminal.ended().0.code(), Some(0));
}

#[test]
fn a_port_where_nobody_answers_is_said_and_waited_at() {
    let (_pty, pts) = blocking::open().expect("a pseudo-terminal");
    let port = nix::unistd::ttyname(&pts).expect("a name");
    let terminal = Terminal::start(&["--port", text(&port)]);
    terminal.wait_for_mode("NO ANSWER YET");
    terminal.wait_for_mode("NO LINK");
    let shown = terminal.wait_for_text("nothing answers within 3 s: check supply");
    assert!(shown.contains("the joints are shown as soon as the hand answers"), "{shown}");
    terminal.press("q");
    assert_eq!(terminal.ended().0.code(), Some(0));
}

/// As when the network to a terminal is gone: nobody could see anything, nor stop the hand.
#[test]
fn a_terminal_that_takes_nothing_ends_the_heartbeat() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let terminal = Terminal::watching(&hand);
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    terminal.is_stuck.store(true, Ordering::Relaxed);
    // Fills whatever is between them, so that the next picture waits.
    for columns in 180..200 {
        terminal.resize(60, columns);
        thread::sleep(Duration::from_millis(60));
    }
    // Nobody has watched for 5 s then, and there was no heartbeat for another.
    thread::sleep(Duration::from_millis(7500));
    terminal.is_stuck.store(false, Ordering::Relaxed);
    terminal.wait_for_text("fault 10: heartbeat of the host stopped");
    terminal.wait_for_text("nobody has watched for 5 s, so that the heartbeat was ended");
    terminal.press("c");
    terminal.wait_for_mode("DISARMED");
}

#[test]
fn what_is_watched_can_be_recorded_and_played_back() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let file = folder.path().join("run.mcap");
    let arguments = ["--port", text(&hand.port), "--out", text(&file)];
    let terminal = Terminal::start(&arguments);
    terminal.wait_for_mode("DISARMED");
    terminal.wait_for_text("recording: ");
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    terminal.press("gy");
    terminal.wait_for_mode("GRASPING");
    terminal.wait_for_text("5.00 N");
    thread::sleep(Duration::from_secs(2));
    terminal.press("q");
    terminal.wait_for_text("QUIT: with this program");
    terminal.press("s");
    let (status, shown) = terminal.ended();
    assert_eq!(status.code(), Some(0), "{shown}");
    assert!(in_a_row(&shown).contains("blindgrasp: recorded ") && shown.contains("stop: done"), "{shown}");
    // It is not overwritten unasked.
    let (status, shown) = Terminal::start(&arguments).ended();
    assert_eq!(status.code(), Some(2), "{shown}");
    drop(hand);

    let terminal = Terminal::start(&[text(&file)]);
    let shown = terminal.wait_for_mode("GRASPING");
    for wanted in ["PLAYING ", "hand three-finger", "run.mcap, hand", "finger-3-flex-3", "mode: armed"] {
        assert!(shown.contains(wanted), "no `{wanted}` in\n{shown}");
    }
    terminal.press("g");
    terminal.wait_for_text("this is a recording, which takes no commands");
    terminal.press(" ");
    let paused = terminal.wait_for_text("PAUSED ");
    thread::sleep(Duration::from_millis(300));
    assert_eq!(place(&terminal.wait_for_text("PAUSED ")), place(&paused), "it goes on");
    // Before anything happened, and to the end.
    terminal.press("\x1b[5~");
    terminal.wait_for("the beginning", |screen| place(screen).starts_with("0.00 of "));
    terminal.press("\x1b[C");
    terminal.wait_for("a second on", |screen| place(screen).starts_with("1.00 of "));
    terminal.press("+");
    terminal.wait_for_text("2 x");
    terminal.press("\x1b[6~");
    let shown = terminal.wait_for("the end", |screen| {
        let place = place(screen);
        place.split_once(" of ").is_some_and(|(now, length)| now == length)
    });
    assert!(shown.contains(" DISARMED ") && shown.contains("stop: done"), "{shown}");
    terminal.press("q");
    assert_eq!(terminal.ended().0.code(), Some(0));
    let (status, shown) = Terminal::start(&[text(&file), "--device", "hand7"]).ended();
    assert_eq!(status.code(), Some(2));
    assert!(in_a_row(&shown).contains("no device `hand7` in this recording: it has hand"), "{shown}");
}

/// Returns the position in a recording: `1.00 of 5.23`.
fn place(screen: &str) -> String {
    let words: Vec<&str> = screen.lines().last().unwrap_or("").split_whitespace().collect();
    words.get(1..4).map_or(String::new(), |words| words.join(" "))
}

#[test]
fn without_colours_everything_is_said_in_words() {
    let folder = folder();
    let hand = Hand::serve(&folder);
    let terminal = Terminal::with(&["--port", text(&hand.port)], &[("NO_COLOR", "1")]);
    terminal.wait_for_mode("DISARMED");
    let parser = terminal.screen.lock().expect("no panic");
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let cell = parser.screen().cell(row, column).expect("a cell");
            let colours = (cell.fgcolor(), cell.bgcolor());
            assert_eq!(colours, (vt100::Color::Default, vt100::Color::Default), "{row}, {column}");
        }
    }
}

#[test]
fn what_can_not_be_watched_is_told_before_the_terminal_is_taken() {
    let run = |arguments: &[&str]| {
        let output = Command::new(BLINDGRASP)
            .arg("monitor")
            .args(arguments)
            .stdin(Stdio::null())
            .output()
            .expect("the command runs");
        assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(2), &[][..]));
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    let said = run(&[]);
    assert!(said.contains("name a port with --port, or a recording; this machine has "), "{said}");
    let said = run(&["--port", "/dev/no-such-port"]);
    assert!(said.contains("monitor needs a terminal"), "{said}");
    let (status, shown) = Terminal::start(&["--port", "/dev/no-such-port"]).ended();
    assert_eq!(status.code(), Some(2));
    let said = in_a_row(&shown);
    assert!(said.contains("cannot open the serial port /dev/no-such-port"), "{shown}");
    assert!(said.contains("this machine has "), "{shown}");
    let (status, shown) = Terminal::start(&[concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")]).ended();
    assert_eq!(status.code(), Some(2));
    assert!(in_a_row(&shown).contains("Cargo.toml: not an MCAP file"), "{shown}");
}

/// The picture of the README: a grasp that is held. Its numbers are those of the machine that drew it; what is compared is
/// everything else.
#[test]
fn the_picture_in_the_readme_is_what_is_shown() {
    let folder = folder();
    // Of a line that has room for what a busy machine sends late.
    let hand = Hand::serve_with(&folder, &["--baud", "3000000"]);
    let terminal = Terminal::watching(&hand);
    terminal.press("ay");
    terminal.wait_for_mode("ARMED");
    terminal.press("gy");
    terminal.wait_for_text("5.00 N");
    // The end of the soft start and the rest are seen in the plot of 20 s.
    thread::sleep(Duration::from_secs(8));
    let shown = terminal.text();
    assert!(shown.starts_with(" GRASPING ") && shown.contains("no fault"), "{shown}");
    let shown = shown.replace(text(&hand.port), "/dev/ttyUSB0");
    let shown: String = shown.lines().map(|row| format!("{}\n", row.trim_end())).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/images/monitor.txt");
    if std::env::var_os("BLINDGRASP_BLESS").is_some() {
        std::fs::write(&path, &shown).expect("the picture is written");
    }
    let before = std::fs::read_to_string(&path).expect("the picture");
    assert_eq!(shape(&shown), shape(&before), "BLINDGRASP_BLESS=1 draws it anew:\n{shown}");
}

/// The words of a picture, row by row, without numbers, bars and curves.
fn shape(picture: &str) -> Vec<Vec<String>> {
    let is_word = |word: &&str| word.starts_with(char::is_alphabetic) && word.is_ascii();
    let row = |row: &str| {
        let words = row.split_whitespace().filter(is_word);
        // What limits a joint comes and goes, what the link does is the machine's affair, and of the last the row shows a part.
        let changes = ["torque", "slew", "lower", "upper", "each", "only", "kB/s", "device", "work"];
        let words = words.take_while(|word| !changes.contains(word));
        words.map(|word| word.trim_end_matches(|c: char| !c.is_alphabetic()).to_owned()).collect::<Vec<_>>()
    };
    picture.lines().map(row).filter(|words| !words.is_empty()).collect()
}
