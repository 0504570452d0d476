//! `blindgrasp pil` as a user meets it when there is no firmware to be had.

use crate::elf::{self, Elf};
use blindgrasp_shared::identity::Image;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// An image, a program that is taken for QEMU, and a folder for temporary files.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new(script: Option<&str>) -> Self {
        let folder = TempDir::new().expect("a folder");
        let image = Image { kind: "pil", ..elf::image() };
        fs::write(folder.path().join("pil.elf"), Elf::good(&image).bytes()).expect("an image");
        fs::create_dir(folder.path().join("tmp")).expect("a folder");
        fs::create_dir(folder.path().join("bin")).expect("a folder");
        if let Some(script) = script {
            let program = folder.path().join("bin/qemu-system-arm");
            let here = folder.path().display();
            let script = format!("#!/bin/sh\necho $$ >{here}/new && mv {here}/new {here}/id\n{script}\n");
            fs::write(&program, script).expect("a script");
            fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("executable");
        }
        Self { folder }
    }

    fn start(&self, arguments: &[&str]) -> Child {
        let path = |name: &str| self.folder.path().join(name);
        Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
            .arg("pil")
            .args(arguments)
            .current_dir(self.folder.path())
            .env("TMPDIR", path("tmp"))
            .env("PATH", format!("{}:/usr/bin:/bin", path("bin").display()))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command starts")
    }

    /// Exit code 2, one line with all of these words, and nothing left.
    fn assert_refused(&self, output: &Output, words: &[&str]) {
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(output.stdout.is_empty());
        assert_eq!(error.lines().count(), 1, "{error}");
        for word in words {
            assert!(error.contains(word), "no `{word}` in: {error}");
        }
        let left: Vec<_> = fs::read_dir(self.folder.path().join("tmp")).expect("the folder").collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn without_an_image_outside_the_repository_it_says_where_to_get_one() {
    let bench = Bench::new(None);
    let output = bench.start(&["cube"]).wait_with_output().expect("an end");
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        error.contains("no firmware image: run this inside the repository") && error.contains("--image"),
        "{error}"
    );
}

#[test]
fn qemu_that_ends_ends_it_with_its_last_words() {
    let bench = Bench::new(Some("echo broken >&2; exit 1"));
    for arguments in
        [&["cube", "--image", "pil.elf"][..], &["cube", "--image", "pil.elf", "--uart", "--json"]]
    {
        let output = bench.start(arguments).wait_with_output().expect("an end");
        bench.assert_refused(&output, &["QEMU ended (exit status: 1) and has printed: broken"]);
    }
    let output = bench.start(&["--bench", "--image", "pil.elf"]).wait_with_output().expect("an end");
    bench.assert_refused(&output, &["QEMU ended (exit status: 1)"]);
}

#[test]
fn a_port_or_a_scene_that_can_not_be_used_is_told() {
    let bench = Bench::new(None);
    let refused = |arguments: &[&str], words: &[&str]| {
        bench.assert_refused(&bench.start(arguments).wait_with_output().expect("an end"), words);
    };
    refused(&["cube", "--port", "/dev/none"], &["cannot open the serial port /dev/none", "this machine has"]);
    refused(&["cube-ideal", "--image", "pil.elf"], &["sensors.ideal"]);
    refused(&["cubes", "--image", "pil.elf"], &["did you mean `cube`"]);
}

/// Ctrl-C, or the end of a terminal, while the firmware does not come up.
#[test]
fn a_signal_ends_it_with_all_that_it_has_started() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let bench = Bench::new(Some("sleep 1000"));
        let command = bench.start(&["cube", "--image", "pil.elf"]);
        let note = bench.folder.path().join("id");
        let deadline = Instant::now() + Duration::from_secs(20);
        while !note.exists() {
            assert!(Instant::now() < deadline, "QEMU was not started");
            thread::sleep(Duration::from_millis(10));
        }
        kill(Pid::from_raw(command.id() as i32), signal).expect("it runs");
        bench.assert_refused(&command.wait_with_output().expect("an end"), &["interrupted"]);
        let group = fs::read_to_string(note).expect("a number").trim().parse().expect("a number");
        while nix::sys::signal::killpg(Pid::from_raw(group), None).is_ok() {
            assert!(Instant::now() < deadline, "QEMU still runs");
            thread::sleep(Duration::from_millis(10));
        }
    }
}
