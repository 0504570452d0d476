//! The page `docs/pick-up.md`, as a new user would go through it: what it says is typed, one line after the other, when the hand has
//! said what the page says.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The most lines that may have to be typed, those in the shell among them.
const MOST: usize = 8;
/// Longest time that the hand may take for a line.
const PATIENCE: Duration = Duration::from_secs(30);

/// A command that is ended with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a command of the page, with its port in a folder of the test; returns what it says, line by line.
fn start(command: &str, folder: &TempDir) -> (Running, ChildStdin, Receiver<String>) {
    let command = command.split("  #").next().expect("a command");
    let rest = command.strip_prefix("cargo run --release -- ").expect("a command of this repository");
    let port = folder.path().join("hand").display().to_string();
    let mut child = Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
        .args(rest.split_whitespace().map(|word| if word == "/tmp/hand" { port.as_str() } else { word }))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let (stdin, stdout) =
        (child.stdin.take().expect("it is piped"), child.stdout.take().expect("it is piped"));
    let (told, lines) = mpsc::channel();
    std::thread::spawn(move || {
        BufReader::new(stdout).lines().map_while(Result::ok).try_for_each(|line| told.send(line))
    });
    (Running(child), stdin, lines)
}

/// Waits for a line that begins so; returns it, and fails with all that came instead.
fn wait(lines: &Receiver<String>, wanted: &str) -> String {
    let (until, mut said) = (Instant::now() + PATIENCE, String::new());
    loop {
        match lines.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(line) if line.starts_with(wanted) => return line,
            Ok(line) => said += &format!("{line}\n"),
            Err(_) => panic!("no line `{wanted}`, but:\n{said}"),
        }
    }
}

fn script(page: &str) -> String {
    page.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a script").to_owned()
}

fn page() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    fs::read_to_string(root.join("docs/pick-up.md")).expect("the page")
}

/// Commands of the page for the shell: the hand, and the console.
fn commands(page: &str) -> Vec<&str> {
    let block = page.split("```sh\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block");
    block.lines().collect()
}

#[test]
fn a_cube_is_picked_up_in_eight_lines() {
    let (folder, page) = (TempDir::new().expect("a folder"), page());
    let commands = commands(&page);
    let [serve, console] = commands[..] else { panic!("{commands:?}") };
    let rows =
        page.lines().skip_while(|line| *line != "| type | which does | and wait for the line |").skip(2);
    let rows: Vec<Vec<&str>> =
        rows.take_while(|line| line.starts_with('|')).map(|row| row.split('`').collect()).collect();
    assert!(!rows.is_empty() && commands.len() + rows.len() <= MOST, "{commands:?}, {rows:?}");

    let (_served, _, port) = start(serve, &folder);
    wait(&port, "port ");
    let (mut running, mut keys, lines) = start(console, &folder);
    let mut type_in = |line: &str| writeln!(keys, "{line}").expect("the console listens");
    for row in rows {
        let &[_, typed, _, wanted, _] = &row[..] else { panic!("{row:?}") };
        type_in(typed);
        wait(&lines, wanted);
        if typed.starts_with("move") {
            // It is up there, as the hand knows it.
            type_in("status");
            let held = wait(&lines, "held ");
            let z_mm = held.split("z_mm=").nth(1).and_then(|rest| rest.split(' ').next());
            let z_mm: f64 = z_mm.expect("its height").parse().expect("a number");
            assert!((-18.0..=-12.0).contains(&z_mm), "{held}");
        }
    }
    drop(keys);
    assert!(running.0.wait().expect("it ends").success());
}

#[test]
fn the_script_of_the_page_does_the_same_and_its_record_is_replayed_to_the_bit() {
    let (folder, page) = (TempDir::new().expect("a folder"), page());
    let commands = commands(&page);
    let (_served, _, port) = start(commands[0], &folder);
    wait(&port, "port ");
    let path = folder.path().join("pick.mcap");
    let console = commands[1].split("  #").next().expect("a command");
    let (mut running, mut keys, lines) = start(&format!("{console} --out {}", path.display()), &folder);
    keys.write_all(script(&page).as_bytes()).expect("the console listens");
    drop(keys);
    wait(&lines, "it stands on something");
    wait(&lines, "disarm: done");
    assert!(running.0.wait().expect("it ends").success());
    let replay =
        Command::new(env!("CARGO_BIN_EXE_blindgrasp")).arg("replay").arg(&path).output().expect("it runs");
    let report = String::from_utf8_lossy(&replay.stdout);
    assert!(replay.status.success() && report.contains("none differs"), "{report}");
}
