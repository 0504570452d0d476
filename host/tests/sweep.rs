//! `blindgrasp sweep` as a user meets it: what it prints and writes, what it says to bad input, and that nothing of it is lost
//! or changed when it is stopped or killed.

#![allow(clippy::unwrap_used, reason = "only tests are here")]

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_blindgrasp"));
    command.current_dir(folder).arg("sweep").args(arguments);
    command
}

fn sweep(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Names and contents of what is in a folder.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<(String, Vec<u8>)> =
        entries.map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap())).collect();
    files.sort();
    files
}

/// The rows of a CSV file by the names of their columns.
fn rows(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let names = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (names, reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect())
}

fn column(path: &Path, name: &str) -> Vec<String> {
    let (names, rows) = rows(path);
    let at = names.iter().position(|other| other == name).unwrap();
    rows.into_iter().map(|mut row| row.swap_remove(at)).collect()
}

const QUICK: [&str; 3] = ["cube", "--duration", "0.3"];

fn quick<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&QUICK, more].concat()
}

#[test]
fn a_sweep_of_one_key_prints_every_run_and_where_the_grasp_fails() {
    let folder = folder();
    let arguments = ["cube", "--vary", "friction.scale=-1..1:5", "--duration", "1", "--out", "out.csv"];
    let output = sweep(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "blindgrasp: wrote out.csv, out.png, out.svg\n");
    let lines: Vec<&str> = text(&output.stdout).lines().collect();
    assert_eq!(lines[0], "scene                 cube");
    assert_eq!(lines[1], "varied                friction.scale: -1, -0.5, 0, 0.5, 1");
    assert!(lines[2].starts_with("runs                  5 in ") && lines[2].ends_with(" s"), "{}", lines[2]);
    let rest = [
        "held                  2, of which 2 came to rest",
        "lost                  1",
        "refused               2 (--vary: friction.scale: -1.0 is out of range; has to be between 0.0 and 10000.0)",
        "begins to fail        between 0 (lost) and 0.5 (held)",
        "friction.scale  grasp  at rest, s  friction needed",
        "-1              refused: --vary: friction.scale: -1.0 is out of range; has to be between 0.0 and 10000.0",
        "-0.5            refused: --vary: friction.scale: -0.5 is out of range; has to be between 0.0 and 10000.0",
    ];
    assert_eq!(lines[3..10], rest);
    assert!(lines[10].starts_with("0               LOST at 0.3"), "{}", lines[10]);
    assert!(lines[11].starts_with("0.5             held        0.6"), "{}", lines[11]);
    assert_eq!(lines.len(), 13);
    assert_eq!(column(&folder.path().join("out.csv"), "grasp_held"), ["", "", "false", "true", "true"]);
    let names: Vec<String> = files(folder.path()).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["out.csv", "out.png", "out.svg"]);
}

#[test]
fn json_is_one_object() {
    let folder = folder();
    let grid = ["--vary", "friction.scale=0..1:2", "--vary", "control.force_n=-1,5", "--vary", "seed=1,2"];
    let output = sweep(folder.path(), &quick(&[&grid[..], &["--out", "new/out.parquet", "--json"]].concat()));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "blindgrasp: wrote new/out.parquet\n", "three keys have no picture");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (key, value) in [
        ("scene", Value::from("cube")),
        ("seeds", 1.into()),
        ("runs", 8.into()),
        ("added", 0.into()),
        ("held", 4.into()),
        ("settled", 0.into()),
        ("lost", 0.into()),
        ("refused", 4.into()),
        ("edges", Value::Array(Vec::new())),
        ("file", "new/out.parquet".into()),
        ("pictures", Value::Array(Vec::new())),
    ] {
        assert_eq!(told[key], value, "{key}");
    }
    assert_eq!(told["varied"][1]["key"], "control.force_n");
    assert_eq!(told["varied"][1]["unit"], "N");
    assert_eq!(told["varied"][1]["values"], serde_json::json!(["-1", "5"]));
    assert!(told["refused_reason"].as_str().unwrap().starts_with("--vary: control.force_n: -1.0 is out"));
    assert!(told["wall_s"].is_f64());
}

#[test]
fn parquet_says_what_csv_says() {
    let folder = folder();
    let set = ["--set", "sensors.noise_counts=0.2", "--seeds", "2"];
    let grid = ["--vary", "object=cube,prism", "--vary", "plant.gravity_on_object=true,false"];
    for out in ["out.csv", "out.parquet"] {
        let output = sweep(folder.path(), &quick(&[&set[..], &grid, &["--out", out, "--force"]].concat()));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    let (names, of_csv) = rows(&folder.path().join("out.csv"));
    let reader = SerializedFileReader::try_from(folder.path().join("out.parquet").as_path()).unwrap();
    let of_parquet: Vec<Vec<(String, Field)>> = reader
        .get_row_iter(None)
        .unwrap()
        .map(|row| {
            row.unwrap().get_column_iter().map(|(name, field)| (name.clone(), field.clone())).collect()
        })
        .collect();
    assert_eq!((of_csv.len(), of_parquet.len()), (8, 8));
    for (csv, parquet) in of_csv.iter().zip(&of_parquet) {
        assert_eq!(names.len(), parquet.len());
        for ((name, text), (other, field)) in names.iter().zip(csv).zip(parquet) {
            assert_eq!(name, other);
            let is_same = match field {
                Field::Null => text.is_empty(),
                Field::Long(value) => text.parse() == Ok(*value),
                Field::Double(value) => text.parse() == Ok(*value),
                Field::Bool(value) => text.parse() == Ok(*value),
                Field::Str(value) => text == value,
                _ => false,
            };
            assert!(is_same, "{name}: {text} and {field}");
        }
    }
    let metadata = reader.metadata().file_metadata().key_value_metadata().unwrap();
    let of = |key: &str| metadata.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.clone());
    assert_eq!(of("scene").as_deref(), Some("cube"));
    assert_eq!(
        of("column settle_time_s").as_deref(),
        Some("[s] the time from which on everything was at rest")
    );
    assert_eq!(column(&folder.path().join("out.csv"), "seed"), ["1", "2", "1", "2", "1", "2", "1", "2"]);
}

/// `sim` runs the effective configuration of a row, and prints what the row says.
#[test]
fn a_row_can_be_simulated_again() {
    let folder = folder();
    let set = ["--set", "sensors.noise_counts=0.3", "--seeds", "2"];
    let output = sweep(
        folder.path(),
        &quick(&[&set[..], &["--vary", "control.force_n=3,4", "--out", "out.csv"]].concat()),
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let path = folder.path().join("out.csv");
    for (run, configuration) in column(&path, "configuration").iter().enumerate() {
        fs::write(folder.path().join("row.toml"), configuration).unwrap();
        let sim = Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
            .current_dir(folder.path())
            .args(["sim", "row.toml", "--json"])
            .output()
            .unwrap();
        let summary: Value = serde_json::from_slice(&sim.stdout).unwrap();
        let same = |name: &str, value: &Value| {
            // JSON is read with an error in the last bit; a test of the library compares all bits.
            match (column(&path, name)[run].parse::<f64>().ok(), value.as_f64()) {
                (Some(a), Some(b)) => assert!((a - b).abs() <= 1e-15 * b.abs(), "{name}: {a} and {b}"),
                (a, b) => assert_eq!(a, b, "{name}"),
            }
        };
        same("friction_demand_max", &summary["friction_demand_max"]);
        same("settle_time_s", &summary["settle_time_s"]);
        same("energy_final_j", &summary["energy"]["final_j"]);
        same("moment_residual_nm", &summary["final"]["moment_residual_nm"]);
        same("finger_3.indentation_m", &summary["final"]["indentation_m"][2]);
    }
    let demands = column(&path, "friction_demand_max");
    assert!((1..4).all(|k| demands[k] != demands[0]), "each run is another: {demands:?}");
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let with = |threads: &str| {
        let folder = folder();
        for out in ["map.csv", "map.parquet"] {
            let grid = [
                "--vary",
                "friction.scale=0..1:4",
                "--vary",
                "control.force_n=4..6:3",
                "--force",
                "--out",
                out,
            ];
            let output =
                command(folder.path(), &quick(&grid)).env("RAYON_NUM_THREADS", threads).output().unwrap();
            assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        }
        files(folder.path())
    };
    let alone = with("1");
    assert_eq!(alone.len(), 4);
    assert!(with("5") == alone);
}

/// Killed again and again at any moment, it comes to the same bytes.
#[test]
fn a_sweep_that_is_killed_goes_on_and_comes_to_the_same_bytes() {
    let sweeps = [
        vec!["--vary", "friction.scale=0..1:5", "--vary", "control.force_n=3..8:6", "--out", "out.csv"],
        vec!["--vary", "friction.scale=0..0.4:9", "--refine", "0.05", "--out", "out.parquet"],
    ];
    let mut random = fastrand::Rng::with_seed(11);
    let (mut kills, mut resumed) = (0, 0);
    for arguments in sweeps {
        let out = *arguments.last().unwrap();
        let arguments = quick(&arguments);
        let (undisturbed, killed) = (folder(), folder());
        assert_eq!(sweep(undisturbed.path(), &arguments).status.code(), Some(0));
        // Longer and longer, so that it comes to an end on a slow machine, too.
        for attempt in 0.. {
            let mut child = command(killed.path(), &arguments)
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            sleep(Duration::from_micros(random.u64(..40_000 + 25_000 * attempt)));
            // One that has just come to its end is not killed.
            child.kill().unwrap();
            let output = child.wait_with_output().unwrap();
            let told = text(&output.stderr);
            resumed += usize::from(told.contains("runs are done already"));
            // Killed behind its last file, it is done, too; the journal may still be there.
            if output.status.success() || killed.path().join(out).is_file() {
                let _ = fs::remove_file(killed.path().join(out.to_owned() + ".journal"));
                break;
            }
            assert!(output.status.code().is_none(), "{told}");
            kills += 1;
        }
        assert!(files(killed.path()) == files(undisturbed.path()), "{arguments:?}");
    }
    println!("killed {kills} times, went on {resumed} times");
    assert!(kills >= 6 && resumed >= 3, "{kills} kills, {resumed} resumed: not much of a test");
}

#[cfg(unix)]
#[test]
fn a_sweep_that_is_stopped_says_what_is_kept_and_goes_on() {
    use nix::sys::signal::{Signal, kill};
    let folder = folder();
    let arguments = ["cube", "--vary", "friction.scale=0.5..1:60", "--duration", "3", "--out", "out.csv"];
    let journal = folder.path().join("out.csv.journal");
    let child =
        command(folder.path(), &arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    while fs::metadata(&journal).map_or(0, |file| file.len()) < 500 {
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing is kept");
        sleep(Duration::from_millis(5));
    }
    kill(nix::unistd::Pid::from_raw(child.id() as i32), Signal::SIGINT).unwrap();
    let output = child.wait_with_output().unwrap();
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(output.stdout.is_empty());
    let done = told.strip_prefix("blindgrasp: stopped after ").and_then(|rest| rest.split_once(' ')).unwrap();
    assert_eq!(done.1, "of 60 runs; they are kept in out.csv.journal: the same command goes on from there\n");
    assert!((1..60).contains(&done.0.parse::<u32>().unwrap()), "{told}");
    assert!(!folder.path().join("out.csv").exists());

    // Another sweep is told so, and this one goes on.
    let mut other = arguments;
    other[2] = "friction.scale=0.5..1:61";
    let output = sweep(folder.path(), &other);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(
        text(&output.stderr),
        "blindgrasp: out.csv.journal: belongs to another sweep: what is to --vary differs; run that one again, choose another --out, or start anew with --force\n"
    );
    let output = sweep(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0));
    let going_on = format!("blindgrasp: going on: {} runs are done already, says out.csv.journal\n", done.0);
    assert!(text(&output.stderr).starts_with(&going_on), "{}", text(&output.stderr));
    assert_eq!(column(&folder.path().join("out.csv"), "run").len(), 60);
    assert!(!journal.exists());
}

#[test]
fn what_cannot_be_swept_is_refused_with_what_to_do() {
    let folder = folder();
    let refused = |arguments: &[&str], message: &str| {
        let output = sweep(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert_eq!(text(&output.stderr), format!("blindgrasp: {message}\n"), "{arguments:?}");
    };
    let force = ["--vary", "control.force_n=4,5", "--out", "x.csv"];
    let with = |more: &[&'static str]| [&["cube"], &force[..], more].concat();
    for (arguments, message) in [
        (
            vec!["cube", "--vary", "control.forc_n=1..2:3", "--out", "x.csv"],
            "--vary: control.forc_n: unknown key; did you mean `force_n`?",
        ),
        (
            vec!["cube", "--vary", "control.force_n=4,5", "--out", "x.xlsx"],
            "--out: x.xlsx: a sweep is written to a file that ends in .parquet or .csv",
        ),
        (
            vec!["cube", "--out", "x.csv"],
            "there is nothing to sweep: give --vary KEY=FROM..TO:N, or --seeds N",
        ),
        (
            with(&["--set", "control.force"]),
            "--set: control.force: is not a setting; write KEY=VALUE, such as control.force_n=4",
        ),
        (
            with(&["--duration", "-1"]),
            "--set: duration_s: -1.0 is out of range; has to be between 0.001 and 3600.0",
        ),
        (
            with(&["--refine", "0.1", "--vary", "friction.scale=0,1"]),
            "--refine: serves for one key that takes numbers; leave it out",
        ),
        (
            vec!["cube", "--vary", "object=cube,prism", "--refine", "0.1", "--out", "x.csv"],
            "--refine: serves for one key that takes numbers; leave it out",
        ),
    ] {
        refused(&arguments, message);
    }
    assert!(files(folder.path()).is_empty(), "nothing was begun");
    fs::write(folder.path().join("x.png"), "a photograph").unwrap();
    refused(&with(&[]), "x.png: is there already; choose another with --out, or overwrite it with --force");
    fs::remove_file(folder.path().join("x.png")).unwrap();
    fs::write(folder.path().join("x.csv"), "a table").unwrap();
    refused(&with(&[]), "x.csv: is there already; choose another with --out, or overwrite it with --force");
    fs::write(folder.path().join("x.csv.journal"), "notes").unwrap();
    refused(
        &with(&[]),
        "x.csv.journal: is not a journal of a sweep; choose another --out, or overwrite it with --force",
    );
    let output = sweep(folder.path(), &with(&["--force", "--duration", "0.1"]));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    fs::create_dir(folder.path().join("y.csv")).unwrap();
    refused(
        &["cube", "--seeds", "2", "--out", "y.csv", "--force"],
        "cannot write y.csv: it is a folder, not a file",
    );
    refused(
        &["cube", "--seeds", "2", "--out", "x.csv/y.csv"],
        "cannot write x.csv: File exists (os error 17)",
    );
}

#[test]
fn seeds_without_noise_are_warned_of() {
    let folder = folder();
    let warning = "blindgrasp: warning: --seeds: the scene has no noise, so that all seeds give the same; set sensors.noise_counts\n";
    let told = |arguments: &[&str]| {
        let output = sweep(folder.path(), &quick(&[arguments, &["--out", "x.csv", "--force"]].concat()));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stderr).to_owned()
    };
    assert_eq!(told(&["--seeds", "3"]), format!("{warning}blindgrasp: wrote x.csv\n"));
    let demands = column(&folder.path().join("x.csv"), "friction_demand_max");
    assert!(demands[1] == demands[0] && demands[2] == demands[0]);
    assert!(!told(&["--seeds", "2", "--set", "sensors.noise_counts=0.5"]).contains("warning"));
    assert!(!told(&["--seeds", "2", "--vary", "sensors.noise_counts=0,0.5"]).contains("warning"));
    let ideal = ["--seeds", "2", "--set", "sensors.noise_counts=0.5", "--set", "sensors.ideal=true"];
    assert!(told(&ideal).contains("the scene has no noise"));
}

#[test]
fn a_table_that_can_not_be_written_is_told_and_what_is_done_is_kept() {
    let folder = folder();
    fs::create_dir(folder.path().join("x.csv.partial")).unwrap();
    let arguments = quick(&[
        "--vary",
        "control.force_n=4,5",
        "--vary",
        "friction.scale=0,1",
        "--vary",
        "seed=1,2",
        "--out",
        "x.csv",
    ]);
    let output = sweep(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    assert!(told.contains("x.csv.partial: is in the way"), "{told}");
    assert!(folder.path().join("x.csv.journal").exists());
    fs::remove_dir(folder.path().join("x.csv.partial")).unwrap();
    let output = sweep(folder.path(), &arguments);
    assert!(
        text(&output.stderr).starts_with("blindgrasp: going on: 8 runs are done already"),
        "{}",
        text(&output.stderr)
    );
    assert_eq!(output.status.code(), Some(0));
}
