//! What is not written over, and what is told of what was left.

use super::{blindgrasp, inputs, names, run, succeed, told};
use blindgrasp::record::mcap::{Recording, What, Writer};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// Every command that writes a file, with the file that it reads and is to write; `{}` stands for the second.
const COMMANDS: &[(&str, &[&str])] = &[
    ("run.mcap", &["export", "run.mcap", "--to", "csv", "--out", "{}", "--force"]),
    ("run.mcap", &["export", "run.mcap", "--to", "parquet", "--out", "{}", "--force"]),
    ("run.mcap", &["recording", "finish", "run.mcap", "--out", "{}", "--force"]),
    ("scene.toml", &["sim", "scene.toml", "--duration", "0.01", "--out", "{}", "--force"]),
    ("scene.toml", &["sweep", "scene.toml", "--vary", "friction.scale=0,1", "--out", "{}", "--force"]),
    ("hand.urdf", &["hand", "new", "hand.urdf", "--out", "{}", "--force"]),
    ("hand.toml", &["hand", "export", "hand.toml", "--urdf", "--out", "{}", "--force"]),
    // What the file that is named names.
    ("hand.urdf", &["hand", "export", "hand.toml", "--urdf", "--out", "{}", "--force"]),
    ("hand.urdf", &["hand", "check", "hand.toml", "--picture", "{}"]),
    ("hand.toml", &["hand", "check", "hand.toml", "--picture", "{}"]),
    ("part.stl", &["object", "new", "part.stl", "--unit", "mm", "--mass-kg", "1", "--out", "{}", "--force"]),
    ("part.stl", &["object", "check", "part.toml", "--picture", "{}"]),
    ("part.toml", &["object", "check", "part.toml", "--picture", "{}"]),
    ("hand.toml", &["scene", "new", "hand.toml", "cube", "--out", "{}", "--force"]),
    ("part.stl", &["scene", "new", "three-finger", "part.toml", "--out", "{}", "--force"]),
    (
        "scene.toml",
        &["scene", "export", "scene.toml", "--set", "plant.contact=coulomb", "--mjcf", "{}", "--force"],
    ),
];

/// A scene that MuJoCo can't have, and a file that is there.
#[test]
fn an_export_that_is_refused_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let output = run(folder, &["scene", "export", "cube", "--mjcf", "out.xml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("plant.contact: is \"rolling\""), "{}", told(&output));
    assert!(names(folder).is_empty());
    fs::write(folder.join("out.xml"), "before").unwrap();
    let output = run(folder, &["scene", "export", "cube-table", "--mjcf", "out.xml"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read_to_string(folder.join("out.xml")).unwrap(), "before");
    let output = run(folder, &["scene", "export", "cube-table", "--mjcf", "out.xml", "--force"]);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    assert!(told(&output).contains("not in MJCF: plant.table.1.move"), "{}", told(&output));
    assert!(fs::read_to_string(folder.join("out.xml")).unwrap().contains("<mujoco model=\"cube-table\">"));
}

#[test]
fn nothing_is_written_over_what_is_read_by_whatever_name() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    inputs(folder);
    for (input, arguments) in COMMANDS {
        let before = fs::read(folder.join(input)).unwrap();
        // The ending says what a sweep or a simulation is to write.
        let ending = match arguments[0] {
            "sweep" => "csv",
            "sim" => "mcap",
            _ => Path::new(input).extension().unwrap().to_str().unwrap(),
        };
        let [link, hard] = ["link", "hard"].map(|name| format!("{name}.{ending}"));
        symlink(input, folder.join(&link)).unwrap();
        fs::hard_link(folder.join(input), folder.join(&hard)).unwrap();
        for out in [(*input).to_owned(), format!("./{input}"), link.clone(), hard.clone()] {
            if !out.ends_with(ending) {
                continue;
            }
            let there = names(folder);
            let filled: Vec<&str> =
                arguments.iter().map(|word| if *word == "{}" { &out } else { *word }).collect();
            let output = run(folder, &filled);
            assert_eq!(output.status.code(), Some(2), "{filled:?}: {}", told(&output));
            let words = format!("{out}: is what this command reads");
            assert!(told(&output).contains(&words), "{filled:?}: {}", told(&output));
            assert_eq!(fs::read(folder.join(input)).unwrap(), before, "{filled:?}");
            assert_eq!(names(folder), there, "{filled:?}");
        }
        fs::remove_file(folder.join(link)).unwrap();
        fs::remove_file(folder.join(hard)).unwrap();
    }
    // A run in the folder of its scene: the effective scene would take that name.
    let before = fs::read(folder.join("scene.toml")).unwrap();
    let output = run(folder, &["sim", "scene.toml", "--duration", "0.01", "--out", ".", "--force"]);
    assert!(told(&output).contains("scene.toml: is what this command reads"), "{}", told(&output));
    assert_eq!(fs::read(folder.join("scene.toml")).unwrap(), before);
}

#[test]
fn what_was_there_stays_until_the_new_one_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    inputs(folder);
    let there = names(folder);
    let old = folder.join("old.csv");
    fs::write(&old, "an old table").unwrap();
    let signals =
        ["export", "run.mcap", "--to", "csv", "--out", "old.csv", "--force", "--signals", "angel_rad"];
    assert!(told(&run(folder, &signals)).contains("did you mean"));
    fs::write(folder.join("old.mcap"), "an old recording").unwrap();
    // A socket at which somebody listens and says nothing.
    let _listener = std::os::unix::net::UnixListener::bind(folder.join("silent")).unwrap();
    let silent = ["--port", "unix:silent", "--out", "old.mcap", "--force"];
    for command in [&["record", "--duration", "1"][..], &["console"]] {
        let output = run(folder, &[command, &silent].concat());
        assert_eq!(output.status.code(), Some(2), "{}", told(&output));
        assert_eq!(fs::read(folder.join("old.mcap")).unwrap(), b"an old recording");
    }
    assert_eq!(fs::read(&old).unwrap(), b"an old table");
    // What may not be written is not, nor is a folder.
    fs::set_permissions(&old, fs::Permissions::from_mode(0o444)).unwrap();
    let output = run(folder, &["export", "run.mcap", "--to", "csv", "--out", "old.csv", "--force"]);
    assert!(told(&output).contains("cannot write old.csv: it is write-protected"), "{}", told(&output));
    fs::set_permissions(&old, fs::Permissions::from_mode(0o644)).unwrap();
    fs::create_dir(folder.join("d.csv")).unwrap();
    let output = run(folder, &["export", "run.mcap", "--to", "csv", "--out", "d.csv", "--force"]);
    assert!(told(&output).contains("cannot write d.csv: it is a folder, not a file"), "{}", told(&output));
    let output = run(folder, &["export", "run.mcap", "--to", "csv", "--out", "nowhere/d.csv"]);
    let expected = "blindgrasp: cannot write nowhere/d.csv: there is no such folder; make it first";
    assert_eq!(told(&output).trim(), expected);
    // A link stays one, and what it leads to is replaced.
    symlink("old.csv", folder.join("link.csv")).unwrap();
    succeed(folder, &["export", "run.mcap", "--to", "csv", "--out", "link.csv", "--force"]);
    assert!(fs::read_link(folder.join("link.csv")).is_ok());
    assert!(fs::read_to_string(&old).unwrap().starts_with("time_s,"));
    // A device is written to.
    succeed(folder, &["export", "run.mcap", "--to", "csv", "--out", "/dev/null"]);
    let new = ["d.csv", "link.csv", "old.csv", "old.mcap", "silent"].map(str::to_owned);
    let mut expected = [there, new.to_vec()].concat();
    expected.sort();
    assert_eq!(names(folder), expected);
}

#[test]
fn what_was_left_is_explained_and_what_is_under_way_is_not_disturbed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, &["sim", "cube", "--duration", "0.1", "--out", "run.mcap"]);
    let export = ["export", "run.mcap", "--to", "csv", "--out", "t.csv"];
    fs::write(folder.join("t.csv.partial"), "half a tab").unwrap();
    let left =
        "t.csv.partial: removed: a command that was killed while it wrote t.csv had left it, incomplete";
    // Another writes it.
    let other = File::open(folder.join("t.csv.partial")).unwrap();
    other.try_lock().unwrap();
    let output = run(folder, &export);
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("t.csv: another program is writing it"), "{}", told(&output));
    drop(other);
    assert!(succeed(folder, &export).contains(left));
    assert_eq!(names(folder), ["run.mcap", "t.csv"]);
    // Nobody's: a folder with that name, and one that no run has left.
    fs::create_dir(folder.join("u.csv.partial")).unwrap();
    let output = run(folder, &["export", "run.mcap", "--to", "csv", "--out", "u.csv"]);
    assert!(told(&output).contains("u.csv.partial: is in the way"), "{}", told(&output));
    let sim = ["sim", "cube", "--duration", "0.01", "--out", "run"];
    fs::create_dir(folder.join("run.partial")).unwrap();
    fs::write(folder.join("run.partial/mine.txt"), "mine").unwrap();
    let output = run(folder, &sim);
    assert!(told(&output).contains("run.partial: is in the way"), "{}", told(&output));
    assert_eq!(fs::read(folder.join("run.partial/mine.txt")).unwrap(), b"mine");
    // One that a run has left.
    fs::write(folder.join("run.partial/.partial"), "").unwrap();
    let said = succeed(folder, &sim);
    assert!(said.contains("run.partial: removed: a command that was killed"), "{said}");
    assert_eq!(names(folder), ["run", "run.mcap", "t.csv", "u.csv.partial"]);
    assert!(!names(&folder.join("run")).contains(&".partial".to_owned()));
}

#[test]
fn an_interrupted_export_says_so_and_the_same_command_works() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, &["sim", "cube", "--duration", "20", "--out", "long.mcap"]);
    let export = ["export", "long.mcap", "--to", "csv", "--out", "long.csv"];
    let mut interrupted = 0;
    for _ in 0..20 {
        let child = blindgrasp(folder).args(export).spawn().unwrap();
        let begun = Instant::now();
        while !folder.join("long.csv.partial").exists() && begun.elapsed() < Duration::from_secs(10) {
            thread::sleep(Duration::from_millis(1));
        }
        kill(Pid::from_raw(child.id() as i32), Signal::SIGINT).unwrap();
        let output = child.wait_with_output().unwrap();
        if output.status.code() == Some(130) {
            assert_eq!(told(&output), "blindgrasp: interrupted: long.csv is not written\n");
            assert_eq!(names(folder), ["long.mcap"]);
            interrupted += 1;
            break;
        }
        fs::remove_file(folder.join("long.csv")).unwrap();
    }
    assert_eq!(interrupted, 1);
    succeed(folder, &export);
    assert_eq!(names(folder), ["long.csv", "long.mcap"]);
}

#[test]
fn pipes_and_folders_are_no_inputs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    nix::unistd::mkfifo(&folder.join("pipe.mcap"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    nix::unistd::mkfifo(&folder.join("pipe.toml"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    fs::create_dir(folder.join("folder.mcap")).unwrap();
    fs::create_dir(folder.join("folder.toml")).unwrap();
    for (name, words) in [("pipe", "it is a pipe, not a file"), ("folder", "it is a folder, not a file")] {
        let [mcap, toml] = ["mcap", "toml"].map(|ending| format!("{name}.{ending}"));
        for arguments in [
            &["export", &mcap, "--to", "csv"][..],
            &["replay", &mcap],
            &["recording", "finish", &mcap],
            &["sim", &toml],
            &["hand", "check", &toml],
            &["object", "check", &toml],
        ] {
            let begun = Instant::now();
            let output = run(folder, arguments);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}");
            assert!(told(&output).contains(words), "{arguments:?}: {}", told(&output));
            assert!(begun.elapsed() < Duration::from_secs(10));
        }
    }
}

/// Names in a recording are anybody's: they are shown, and move no cursor.
#[test]
fn control_characters_of_a_recording_are_shown_and_not_sent() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, &["sim", "cube", "--duration", "0.05", "--out", "run.mcap"]);
    let mut writer = Writer::create(&folder.join("odd.mcap"), false).unwrap();
    let device = writer.add_device("hand");
    for entry in Recording::open(&folder.join("run.mcap")).unwrap().entries().unwrap() {
        let entry = entry.unwrap();
        match entry.what {
            What::About(mut about) => {
                about.joint_names[0] = "a\x1b[2Jb\u{9b}1m\r".into();
                about.hand = "\x1b]0;title\x07".into();
                writer.about(device, entry.at, &about).unwrap();
            }
            What::Parameters(values) => writer.parameters(device, entry.at, &values).unwrap(),
            What::Received(payload) => writer.received(device, entry.at, &payload).map(|_| ()).unwrap(),
            _ => {}
        }
    }
    writer.finish().unwrap();
    for (arguments, words) in [
        (&["export", "odd.mcap", "--to", "csv", "--signals", "x"][..], "a\\u001b[2Jb\\u009b1m\\u000d"),
        (&["replay", "odd.mcap"], "hand"),
        (&["replay", "odd.mcap", "--json"], "hand"),
    ] {
        let output = run(folder, arguments);
        let told = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        assert!(told.contains(words), "{arguments:?}: {told}");
        assert!(told.chars().all(|c| c == '\n' || !c.is_control()), "{arguments:?}: {told:?}");
    }
}

#[test]
fn paths_that_are_not_utf8_are_read_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    inputs(folder);
    let odd = |name: &str| folder.join(OsStr::from_bytes(&[name.as_bytes(), b"\xff.x"].concat()));
    for (from, to, before, after) in [
        ("run.mcap", "t", &["export"][..], &["--to", "csv", "--out"][..]),
        ("run.mcap", "r", &["recording", "finish"], &["--out"]),
        ("scene.toml", "s", &["sim"], &["--duration", "0.01", "--out"]),
        ("hand.toml", "u", &["hand", "export"], &["--urdf", "--out"]),
        ("part.toml", "o", &["object", "check"], &["--picture"]),
        ("hand.toml", "h", &["hand", "check"], &["--picture"]),
    ] {
        let ending = Path::new(from).extension().unwrap();
        let input = odd("in").with_extension(ending);
        fs::copy(folder.join(from), &input).unwrap();
        let mut command = blindgrasp(folder);
        let output = command.args(before).arg(&input).args(after).arg(odd(to)).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{before:?}: {}", told(&output));
        assert!(odd(to).exists(), "{before:?}");
    }
}
