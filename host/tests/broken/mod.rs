//! Broken files, as a user meets them: what the command says of each is compared to the letter with
//! `tests/data/broken/expected.toml`, and nothing takes long or much memory. Damaged copies of all of them follow in
//! `damage`.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "only tests are here")]

mod damage;
mod input;
mod property;

use input::{Input, Table};
use nix::sys::resource::{Usage, UsageWho, getrusage};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Of the processor; and of the wall clock, on a machine that does other things too.
const LONGEST_S: f64 = 2.0;
const LONGEST_WAIT_S: f64 = 60.0;
/// Of memory; as address space, which counts more, no command gets more.
const LARGEST_KIB: u64 = 1 << 20;
/// As many inputs were asked for.
const FEWEST: usize = 60;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/broken")
}

/// A folder with all committed inputs: commands write beside them.
fn copy_of_corpus() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(corpus()).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    folder
}

/// The output of a command, and what it took.
struct Said {
    exit: Option<i32>,
    stdout: String,
    stderr: String,
    processor_s: f64,
}

/// Runs the command in a folder.
fn run(arguments: &str, folder: &Path) -> Said {
    let streams = ["stdout", "stderr"].map(|name| folder.join(name));
    let before = children();
    let mut command = Command::new("sh");
    // Where the address space can't be limited, the peak is still measured.
    command.args(["-c", &format!("ulimit -v {LARGEST_KIB} 2>/dev/null; exec \"$@\""), "sh"]);
    command.arg(env!("CARGO_BIN_EXE_blindgrasp")).args(arguments.split(' ')).current_dir(folder);
    command.stdin(Stdio::null());
    command.stdout(File::create(&streams[0]).unwrap()).stderr(File::create(&streams[1]).unwrap());
    let mut child = command.spawn().unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed().as_secs_f64() > LONGEST_WAIT_S {
            child.kill().unwrap();
            panic!("`blindgrasp {arguments}` does not end");
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let [stdout, stderr] = streams.map(|path| {
        let text = fs::read_to_string(&path).unwrap();
        fs::remove_file(path).unwrap();
        text
    });
    Said { exit: status.code(), stdout, stderr, processor_s: processor_s(&children()) - processor_s(&before) }
}

/// Returns the usage of all children that have ended. The peak of memory is that of the largest.
fn children() -> Usage {
    getrusage(UsageWho::RUSAGE_CHILDREN).unwrap()
}

fn processor_s(usage: &Usage) -> f64 {
    [usage.user_time(), usage.system_time()]
        .map(|time| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6)
        .iter()
        .sum()
}

/// The unit of the peak differs between systems.
fn peak_kib() -> u64 {
    let peak = children().max_rss() as u64;
    if cfg!(target_vendor = "apple") { peak >> 10 } else { peak }
}

/// Returns the differences from what is expected.
fn differences(input: &Input, said: &Said) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut compare = |what: &str, expected: &str, found: &str| {
        if expected != found {
            wrong.push(format!("{}: {what} is\n{found}\nand not\n{expected}", input.run));
        }
    };
    compare("exit code", &input.exit.to_string(), &said.exit.map_or("none".into(), |code| code.to_string()));
    compare("stderr", &input.stderr, &said.stderr);
    // The tables before the findings are what other tests are about.
    match (&input.findings, said.stdout.rsplit_once("\n\n")) {
        (None, _) => compare("stdout", "", &said.stdout),
        (Some(expected), Some((_, findings))) => compare("list of findings", expected, findings),
        (Some(_), None) => compare("stdout", "a table and findings", &said.stdout),
    }
    wrong
}

#[test]
fn every_broken_file_gets_its_message_in_bounded_time_and_memory() {
    let Table { inputs } = Table::read(&corpus().join("expected.toml"));
    let folder = copy_of_corpus();
    let mut wrong = Vec::new();
    let (mut slowest, mut largest, mut kinds) = ((0.0, ""), (0, ""), std::collections::BTreeMap::new());
    for input in &inputs {
        let made = input.make(folder.path());
        if let Some(first) = &input.first {
            assert_eq!(run(first, folder.path()).exit, Some(0), "{first}");
        }
        let said = run(&input.run, folder.path());
        wrong.extend(differences(input, &said));
        assert!(said.processor_s < LONGEST_S, "`{}` takes {:.2} s", input.run, said.processor_s);
        slowest = if said.processor_s > slowest.0 { (said.processor_s, &input.file) } else { slowest };
        largest = if peak_kib() > largest.0 { (peak_kib(), &input.file) } else { largest };
        assert!(largest.0 < LARGEST_KIB, "`{}` takes {} MiB", input.run, largest.0 >> 10);
        *kinds.entry(input.file.split(['-', '.']).next().unwrap()).or_insert(0) += 1;
        if let Some(path) = made {
            if path.is_dir() { fs::remove_dir(path).unwrap() } else { fs::remove_file(path).unwrap() }
        }
        let _ = fs::remove_file(folder.path().join("new.toml"));
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    println!("{} broken inputs: {}", inputs.len(), kinds.join(", "));
    println!("longest: {:.2} s of the processor, {}", slowest.0, slowest.1);
    println!("largest: {} MiB, {}", largest.0 >> 10, largest.1);
    assert!(wrong.is_empty(), "{} differ:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn every_file_is_in_the_table_and_there_are_enough() {
    let Table { inputs } = Table::read(&corpus().join("expected.toml"));
    let mut listed: Vec<&str> = inputs.iter().map(|input| input.file.as_str()).collect();
    listed.sort_unstable();
    assert!(listed.windows(2).all(|pair| pair[0] != pair[1]), "a file is listed twice");
    assert!(listed.len() >= FEWEST, "only {}", listed.len());
    for entry in fs::read_dir(corpus()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(name == "expected.toml" || listed.contains(&name.as_str()), "{name} is not in expected.toml");
    }
    for input in &inputs {
        assert_ne!(
            input.is_made(),
            corpus().join(&input.file).exists(),
            "{}: committed, or made",
            input.file
        );
        assert!(input.run.contains(&input.file) || input.first.is_some(), "{}: not what is run", input.file);
    }
}
