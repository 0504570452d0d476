//! Interruptions at random moments, over every command that writes.
//!
//!     cargo test --release -p blindgrasp --features full --test command interrupted_300 -- --ignored --nocapture

use super::{blindgrasp, inputs, names, run, told};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Commands, with what they write: files, or a folder of files. Inputs are in the folder above.
const COMMANDS: &[(&[&str], &[&str])] = &[
    (&["sim", "../scene.toml", "--duration", "0.2", "--out", "out"], &["out"]),
    (&["sim", "../scene.toml", "--duration", "0.5", "--out", "out.mcap"], &["out.mcap"]),
    (&["export", "../run.mcap", "--to", "csv", "--out", "out.csv"], &["out.csv"]),
    (&["export", "../run.mcap", "--to", "parquet", "--out", "out.parquet"], &["out.parquet"]),
    (
        &[
            "sweep",
            "../scene.toml",
            "--duration",
            "0.05",
            "--vary",
            "friction.scale=0..1:4",
            "--out",
            "out.csv",
        ],
        &["out.csv", "out.png", "out.svg"],
    ),
    (&["hand", "new", "../hand.urdf", "--out", "out.toml"], &["out.toml"]),
    (&["hand", "export", "three-finger", "--urdf", "--out", "out.urdf"], &["out.urdf"]),
    (&["hand", "check", "three-finger", "--picture", "out.svg"], &["out.svg"]),
    (&["object", "new", "../part.stl", "--unit", "mm", "--mass-kg", "1", "--out", "out.toml"], &["out.toml"]),
    (&["object", "check", "cube", "--picture", "out.svg"], &["out.svg"]),
    (&["scene", "new", "three-finger", "cube", "--out", "out.toml"], &["out.toml"]),
    (&["scene", "export", "cube-table", "--mjcf", "out.xml"], &["out.xml"]),
    (&["recording", "finish", "../run.mcap", "--out", "out.mcap"], &["out.mcap"]),
    (&["record", "--port", "../link", "--duration", "1", "--out", "out.mcap"], &["out.mcap"]),
    (&["console", "--port", "../link", "--out", "out.mcap"], &["out.mcap"]),
];

/// Content of a file that is there before, and is replaced by force.
const OLD: &[u8] = b"what was there before";

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum How {
    Interrupt,
    Terminate,
    Kill,
    FullDisk,
}

/// Content of every file that a command writes, by its path.
type Files = BTreeMap<PathBuf, Vec<u8>>;

fn contents(folder: &Path, written: &[&str]) -> Files {
    let mut files = Files::new();
    for name in written {
        let path = folder.join(name);
        if path.is_dir() {
            for below in names(&path).iter().filter(|below| *below != ".partial") {
                files.insert(Path::new(name).join(below), fs::read(path.join(below)).unwrap());
            }
        } else if let Ok(bytes) = fs::read(&path) {
            files.insert(name.into(), bytes);
        }
    }
    files
}

/// The number of files and folders left that are not whole: beside files and folders, or in a folder that was there before.
fn left_over(folder: &Path) -> usize {
    let beside = names(folder).iter().filter(|name| name.ends_with(".partial")).count();
    beside + usize::from(folder.join("out/.partial").exists())
}

/// Returns `true` if a file is what the command writes when nothing happens to it.
fn is_whole(path: &Path, bytes: &[u8], folder: &Path, whole: &Files) -> bool {
    let name = path.file_name().unwrap();
    // How long a run takes, and when it was, is not the same twice.
    if name == "summary.json" {
        return serde_json::from_slice::<serde_json::Value>(bytes).is_ok();
    }
    if path.extension().is_some_and(|ending| ending == "mcap") && !whole.contains_key(path) {
        let recording = blindgrasp::record::mcap::Recording::open(&folder.join(path)).unwrap();
        let mut entries = recording.entries().unwrap();
        let count = entries.by_ref().map(Result::unwrap).count();
        // A program that is killed while it writes leaves half a piece behind the end, which is told.
        let at_the_end = entries.damage().places.iter().all(|place| place.until == bytes.len() as u64);
        return count > 0 && entries.damage().lost == 0 && at_the_end;
    }
    whole.get(path).is_some_and(|whole| whole == bytes)
}

struct Serving(Child);

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn serve(folder: &Path) -> Serving {
    let child = blindgrasp(folder)
        .args(["serve", "cube", "--link", "link", "--baud", "3000000"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !folder.join("link").exists() {
        assert!(begun.elapsed() < Duration::from_secs(20));
        thread::sleep(Duration::from_millis(5));
    }
    Serving(child)
}

/// Returns `true` if a file system of a given size can be had, in a namespace of its own.
fn has_small_disks(folder: &Path) -> bool {
    let script = format!("mount -t tmpfs -o size=64k t {}", folder.display());
    Command::new("unshare").args(["-rm", "sh", "-c", &script]).status().is_ok_and(|status| status.success())
}

/// The command on a disk of so many KiB, whose content is copied to `to` at the end. Where there are no such disks, no file
/// may be longer.
fn on_a_small_disk(folder: &Path, to: &Path, kib: u64, small_disks: bool, arguments: &[&str]) -> Command {
    let script = if small_disks {
        // What was there before is there, too.
        "cp -a . ../before; mount -t tmpfs -o size=${1}k t . && cd \"$PWD\" && cp -a ../before/. .; to=$2; shift 2; \"$@\"; code=$?; cp -a . \"$to\"; exit $code"
    } else {
        "trap '' XFSZ; ulimit -f $((2 * $1)); to=$2; shift 2; \"$@\"; code=$?; cp -a . \"$to\"; exit $code"
    };
    let mut command = if small_disks { Command::new("unshare") } else { Command::new("sh") };
    if small_disks {
        command.args(["-rm", "sh"]);
    }
    command.args(["-c", script, "sh"]).arg(kib.to_string()).arg(to);
    command.arg(env!("CARGO_BIN_EXE_blindgrasp")).args(arguments);
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Interrupts commands so many times, and prints what came of it.
fn interrupt(times: usize, seed: u64) {
    let mut random = fastrand::Rng::with_seed(seed);
    let above = tempfile::tempdir().unwrap();
    let above = above.path();
    inputs(above);
    let _serving = serve(above);
    fs::create_dir(above.join("disk")).unwrap();
    let small_disks = has_small_disks(&above.join("disk"));
    // What each writes when nothing happens to it, and how long that takes.
    let mut undisturbed = Vec::new();
    for (k, (arguments, written)) in COMMANDS.iter().enumerate() {
        let folder = above.join(format!("whole-{k}"));
        fs::create_dir(&folder).unwrap();
        let begun = Instant::now();
        let output = run(&folder, arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", told(&output));
        let mut files = contents(&folder, written);
        assert!(files.len() >= written.len(), "{arguments:?}");
        let kib = files.values().map(|bytes| bytes.len() as u64).sum::<u64>() >> 10;
        // What is recorded in real time is another each time.
        files.retain(|_, _| !["record", "console"].contains(&arguments[0]));
        undisturbed.push((files, begun.elapsed(), kib));
    }
    let mut counts: BTreeMap<How, [u32; 4]> = BTreeMap::new();
    for number in 0..times {
        let which = if number < COMMANDS.len() { number } else { random.usize(0..COMMANDS.len()) };
        let (arguments, written) = COMMANDS[which];
        let (whole, takes, kib) = &undisturbed[which];
        let how = [How::Interrupt, How::Terminate, How::Kill, How::FullDisk][random.usize(0..4)];
        let replaces = random.bool();
        let folder = above.join(format!("{number}"));
        fs::create_dir(&folder).unwrap();
        let mut arguments = arguments.to_vec();
        if replaces {
            for name in written {
                let is_folder = !name.contains('.');
                if is_folder {
                    fs::create_dir(folder.join(name)).unwrap();
                    for path in whole.keys() {
                        fs::write(folder.join(path), OLD).unwrap();
                    }
                } else {
                    fs::write(folder.join(name), OLD).unwrap();
                }
            }
        }
        if replaces && !arguments.contains(&"--picture") {
            arguments.push("--force");
        }
        let about = format!("{number}: {how:?} {arguments:?} in {}", folder.display());
        let (folder, said, ended_by_itself) = if how == How::FullDisk {
            let to = above.join(format!("{number}-end"));
            fs::create_dir(&to).unwrap();
            let kib = random.u64(4..=2 * kib + 16);
            let output = on_a_small_disk(&folder, &to, kib, small_disks, &arguments).output().unwrap();
            let _ = fs::remove_dir_all(above.join("before"));
            (to, told(&output), output.status.success())
        } else {
            let child = blindgrasp(&folder).args(&arguments).spawn().unwrap();
            thread::sleep(takes.mul_f64(1.1 * random.f64()));
            let signal = match how {
                How::Interrupt => Signal::SIGINT,
                How::Terminate => Signal::SIGTERM,
                _ => Signal::SIGKILL,
            };
            let _ = kill(Pid::from_raw(child.id() as i32), signal);
            let output = child.wait_with_output().unwrap();
            (folder, told(&output), output.status.success())
        };
        let there = contents(&folder, written);
        let mut new = 0;
        for (path, bytes) in &there {
            let is_old = replaces && bytes == OLD;
            assert!(is_old || is_whole(path, bytes, &folder, whole), "{about}: {}: {said}", path.display());
            new += u32::from(!is_old);
        }
        if replaces || (0 < new && written.len() == 1) {
            // Nothing is gone, and a folder is there as a whole.
            assert!(there.len() >= whole.len(), "{about}: {:?}: {said}", there.keys());
        }
        let partial = left_over(&folder);
        if how != How::Kill {
            assert_eq!(partial, 0, "{about}: {said}");
        }
        let count = counts.entry(how).or_default();
        count[0] += 1;
        count[1] += u32::from(new > 0);
        count[2] += u32::from(ended_by_itself);
        count[3] += u32::from(partial > 0);
        // The same command works; it may have to be told that what is there is not wanted.
        if new > 0 && !replaces && !arguments.contains(&"--picture") {
            arguments.push("--force");
        }
        let output = run(&folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{about}, again: {}", told(&output));
        assert_eq!(told(&output).contains(".partial: removed: "), partial > 0, "{about}: {}", told(&output));
        assert_eq!(left_over(&folder), 0, "{about}");
        let _ = fs::remove_dir_all(&folder);
    }
    println!("full disks: {}", if small_disks { "file systems of a given size" } else { "limits of files" });
    for (how, [all, new, ended, partial]) in counts {
        println!(
            "{how:?}: {all}; new files there after {new}, ended by itself {ended}, left .partial behind {partial}; none half"
        );
    }
}

#[test]
fn interrupted_at_random_moments_everything_is_whole_or_as_before() {
    interrupt(2 * COMMANDS.len(), 1);
}

#[test]
#[ignore = "takes minutes"]
fn interrupted_300_times_everything_is_whole_or_as_before() {
    interrupt(300, 2);
}
