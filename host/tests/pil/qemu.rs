//! QEMU's process, whatever it does: a clear error soon, nothing left running, nothing left on the disk.

use crate::elf::{self, Elf};
use blindgrasp::device::client::{Client, Patience};
use blindgrasp::device::qemu::{Qemu, QemuError};
use blindgrasp_shared::identity::Image;
use nix::sys::signal::killpg;
use nix::unistd::Pid;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_millis(700);

/// A folder with an image, and with programs that do not do what QEMU does.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let bench = Self { folder: TempDir::new().expect("a folder") };
        bench.image("pil");
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn image(&self, kind: &'static str) -> PathBuf {
        let path = self.path(kind);
        fs::write(&path, Elf::good(&Image { kind, ..elf::image() }).bytes()).expect("an image");
        path
    }

    /// A script that leaves its process number and its folder behind before it does anything.
    fn qemu(&self, script: &str) -> Qemu {
        let program = self.path("qemu");
        let here = self.folder.path().display();
        let script =
            format!("#!/bin/sh\necho $$ >{here}/id\npwd >{here}/pwd\necho \"$@\" >{here}/args\n{script}\n");
        fs::write(&program, script).expect("a script");
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("executable");
        let mut qemu = Qemu::new(&self.path("pil"), PATIENCE).expect("an image");
        qemu.program = program;
        qemu
    }

    fn note(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect("the script ran").trim().to_owned()
    }

    /// Asserts that neither the process, nor one that it has started, nor its folder is there.
    fn assert_nothing_left(&self) {
        let group = self.note("id");
        let deadline = Instant::now() + Duration::from_secs(2);
        while is_alive(&group) {
            assert!(Instant::now() < deadline, "process group {group} still runs");
            thread::sleep(Duration::from_millis(10));
        }
        let folder = self.note("pwd");
        assert!(!Path::new(&folder).exists(), "{folder} is still there");
    }
}

/// Returns `true` if a process of the group is there.
fn is_alive(group: &str) -> bool {
    killpg(Pid::from_raw(group.parse().expect("a number")), None).is_ok()
}

/// Starts it in every way, and returns how that failed.
fn failures(bench: &Bench, script: &str) -> Vec<String> {
    let qemu = bench.qemu(script);
    let starts: [&dyn Fn() -> Option<QemuError>; 2] =
        [&|| qemu.with_pipes().err(), &|| qemu.with_uart().err()];
    starts
        .iter()
        .map(|start| {
            let begun = Instant::now();
            let error = start().expect("an error").to_string();
            assert!(begun.elapsed() < PATIENCE + Duration::from_secs(3), "{error}");
            bench.assert_nothing_left();
            error
        })
        .collect()
}

fn assert_says(error: &str, words: &[&str]) {
    for word in words {
        assert!(error.contains(word), "no `{word}` in: {error}");
    }
}

#[test]
fn qemu_that_is_not_there_is_told_with_how_to_get_it() {
    let bench = Bench::new();
    let mut qemu = Qemu::new(&bench.path("pil"), PATIENCE).expect("an image");
    qemu.program = "no-such-qemu-system-arm".into();
    for error in [qemu.with_pipes().err(), qemu.with_uart().err(), qemu.bench(&[]).err()] {
        let error = error.expect("an error").to_string();
        assert_says(
            &error,
            &["no-such-qemu-system-arm is not installed", "apt-get install qemu-system-arm", "--port"],
        );
    }
}

#[test]
fn qemu_that_ends_at_once_is_told_with_its_last_words() {
    let bench = Bench::new();
    for error in failures(&bench, "echo \"qemu: no such machine\" >&2; exit 3") {
        assert_says(&error, &["QEMU ended (exit status: 3) and has printed: qemu: no such machine"]);
    }
    for error in failures(&bench, "exit 0") {
        assert_says(&error, &["QEMU ended (exit status: 0) and has printed nothing"]);
    }
}

#[test]
fn qemu_that_hangs_is_ended_with_all_that_it_has_started() {
    let bench = Bench::new();
    for error in failures(&bench, "trap '' TERM INT HUP\nsleep 1000 &\nsleep 1000") {
        assert_says(&error, &["did not start within 0.7 s", "QEMU still runs and has printed nothing"]);
    }
    for error in failures(&bench, "kill -STOP $$") {
        assert_says(&error, &["did not start within 0.7 s"]);
    }
}

#[test]
fn qemu_that_prints_garbage_without_end_is_told_with_some_of_it() {
    let bench = Bench::new();
    for error in failures(&bench, "while :; do printf 'garbage \\377\\033[31m \\n'; done") {
        assert_says(&error, &["did not start within 0.7 s", "has printed: ... ", "garbage"]);
        assert!(error.len() < 1000 && !error.contains(char::is_control), "{error}");
    }
}

/// It takes the pipes, and then says nothing, or garbage, or hangs up.
#[test]
fn a_firmware_that_does_not_answer_is_told_with_what_qemu_said() {
    let bench = Bench::new();
    let patience = Patience { start: PATIENCE, answer: PATIENCE };
    let open = "exec 3<to 4>from\necho started >&2\n";
    let ways = [
        ("sleep 1000", "no firmware answers within 0.7 s"),
        ("yes garbage >&4", "no firmware answers within 0.7 s"),
        ("exit 1", "the line to the firmware failed"),
    ];
    for (script, words) in ways {
        let emulated = bench.qemu(&format!("{open}{script}")).with_pipes().expect("it takes the pipes");
        assert!(is_alive(&bench.note("id")) || script == "exit 1", "the test would not see it");
        let mut client = Client::new(emulated, patience);
        let error = client.knock().expect_err("no firmware").to_string();
        assert_says(&error, &[words, "started"]);
        drop(client);
        bench.assert_nothing_left();
    }
}

#[test]
fn nothing_is_left_after_a_panic() {
    let bench = Bench::new();
    let qemu = bench.qemu("exec 3<to 4>from\nsleep 1000");
    let panicked = thread::spawn(move || {
        let _emulated = qemu.with_pipes().expect("it takes the pipes");
        panic!("on purpose");
    })
    .join();
    assert!(panicked.is_err());
    bench.assert_nothing_left();
}

#[test]
fn the_firmware_is_told_how_it_is_reached() {
    let bench = Bench::new();
    failures(&bench, "exit 1");
    let image = fs::canonicalize(bench.path("pil")).expect("an image");
    let expected = format!(
        "-M netduinoplus2 -nographic -monitor none -serial null -serial unix:uart \
         -semihosting-config enable=on,target=native,arg=uart -kernel {}",
        image.display()
    );
    assert_eq!(bench.note("args"), expected);
    let _ = bench.qemu("exit 1").with_pipes();
    assert_says(&bench.note("args"), &["-serial null -serial null", "arg=fifo,arg=to,arg=from"]);
}

#[test]
fn figures_are_passed_on_if_they_are_whole() {
    let bench = Bench::new();
    let keys = ["law_gravity_off", "tick"];
    let figures = bench.qemu("echo '{\"law_gravity_off\": 2000, \"tick\": 7000, \"more\": 1}'").bench(&keys);
    assert_eq!(figures.expect("figures")["tick"], 7000);
    assert_says(&bench.note("args"), &["arg=bench", "-icount shift=4,sleep=off"]);
    bench.assert_nothing_left();
    for (script, words) in [
        ("echo '{\"law_gravity_off\": 2000}'", "`tick` is not among them"),
        ("echo '{\"law_gravity_off\": 2000, \"tick\": \"many\"}'", "`tick` is not among them"),
        ("echo oops", "can't be read"),
        (
            "echo 'pil: a request was refused'; exit 1",
            "QEMU ended (exit status: 1) and has printed: pil: a request",
        ),
    ] {
        let error = bench.qemu(script).bench(&keys).expect_err("an error").to_string();
        assert_says(&error, &[words]);
        bench.assert_nothing_left();
    }
}

#[test]
fn what_is_no_image_for_this_is_refused() {
    let bench = Bench::new();
    let refused = |path: &Path| Qemu::new(path, PATIENCE).expect_err("refused").to_string();
    assert_says(&refused(&bench.path("nothing")), &["nothing", "No such file"]);
    assert_says(&refused(&bench.image("hand")), &["image `hand`", "needs the image `pil`"]);
    fs::write(bench.path("text"), "text").expect("a file");
    assert_says(&refused(&bench.path("text")), &["not an ELF file"]);
}
