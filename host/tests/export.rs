//! Recordings as tables: every row, every value, and what is missing.

#![allow(clippy::unwrap_used, reason = "only tests are here")]

use crate::recorded;

use blindgrasp::record::export::{Cell, Column, Row};
use blindgrasp::record::mcap::{Decoded, Decoder, Recording};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::link::message::Signals;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use recorded::{Fate, Session};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Output, Stdio};
use tempfile::TempDir;

fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.mcap");
    (folder, path)
}

fn command(path: &Path, arguments: &[&str]) -> Output {
    Process::new(env!("CARGO_BIN_EXE_blindgrasp")).arg("export").arg(path).args(arguments).output().unwrap()
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A few seconds with a grasp, losses and a fault; then a session without counts.
fn eventful(path: &Path) -> u64 {
    let mut session = Session::new(path);
    session.hello();
    session.telemetry(1, Signals::FULL);
    session.run(10);
    session.command(Command::Arm);
    session.command(Command::Grasp(Grasp::CONFIGURED));
    session.run(1100);
    for _ in 0..3 {
        session.turn(None, Fate::IsLost);
    }
    session.run(900);
    session.fail(Raised::at(3, Fault::SampleMissing));
    session.run(300);
    session.telemetry(2, Signals::TORQUES);
    session.run(200);
    let arrived = session.arrived;
    session.finish();
    arrived
}

fn decoded(path: &Path) -> (u64, Vec<Decoded>) {
    let recording = Recording::open(path).unwrap();
    let mut decoder = Decoder::new();
    let entries = recording.entries().unwrap().map(|entry| entry.unwrap());
    let decoded = entries.filter_map(|entry| decoder.take(&entry)).collect();
    (recording.span().unwrap().0.0, decoded)
}

fn joint_names() -> Vec<String> {
    recorded::Hand::load("three-finger").model.joint_names
}

/// A table as text: its header, and its rows.
fn csv_rows(bytes: &[u8]) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_reader(bytes);
    let header = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows = reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect());
    (header, rows.collect())
}

/// Returns `true` if a field has a cell's value, to the bit.
fn is_told(cell: &Cell<'_>, field: &str) -> bool {
    match cell {
        Cell::Missing => field.is_empty(),
        Cell::Whole(value) => field.parse() == Ok(*value),
        Cell::Real(value) => field.parse::<f32>().is_ok_and(|told| told.to_bits() == value.to_bits()),
        Cell::Double(value) => field.parse::<f64>().is_ok_and(|told| told.to_bits() == value.to_bits()),
        Cell::Truth(value) => field.parse() == Ok(*value),
        Cell::Word(word) => field == *word,
        Cell::Text(text) => field == text,
    }
}

#[test]
fn csv_has_every_record_and_every_value() {
    let (folder, path) = folder();
    let arrived = eventful(&path);
    let output = command(&path, &["--to", "csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    assert!(told(&output).contains(&format!("{arrived} rows; 3 records lost, 1 gaps")), "{}", told(&output));
    let (header, rows) = csv_rows(&std::fs::read(folder.path().join("recording.csv")).unwrap());
    let (start_ns, decoded) = decoded(&path);
    assert_eq!((rows.len() as u64, decoded.len() as u64), (arrived, arrived));
    let names = joint_names();
    let columns = Column::all(&names);
    assert_eq!(header, columns.iter().map(|column| column.name.clone()).collect::<Vec<_>>());
    let mut missing = 0;
    for (row, decoded) in rows.iter().zip(&decoded) {
        for (column, field) in columns.iter().zip(row) {
            let cell = column.cell(&Row::of(decoded.clone(), start_ns, names.len()), &names);
            missing += u32::from(cell == Cell::Missing);
            assert!(is_told(&cell, field), "{}: {cell:?}, {field}", column.name);
        }
    }
    // What was not sent is empty: counts, angles and speeds in the last 100 records, 12 joints; faults mostly.
    assert!(missing > 100 * 3 * 12);

    // The same by name, as a user reads it.
    let at = |name: &str| header.iter().position(|column| column == name).unwrap();
    let tick = |tick: u32| rows.iter().find(|row| row[at("tick")] == tick.to_string()).unwrap();
    let grasping = tick(1000);
    assert_eq!(grasping[at("mode")], "grasping");
    assert_eq!(grasping[at("fault")], "");
    assert_eq!(grasping[at("force_n")], "5.0");
    assert_eq!(grasping[at("time_s")], "1.0");
    assert!(rows.iter().any(|row| row[at("answer")] == "grasp: done"));
    let faulty = rows.iter().find(|row| row[at("mode")] == "fault").unwrap();
    assert_eq!((faulty[at("fault")].as_str(), faulty[at("fault_joint")].as_str()), ("1", names[3].as_str()));
    assert_eq!(rows.iter().map(|row| row[at("lost_before")].parse::<u64>().unwrap()).sum::<u64>(), 3);
}

#[test]
fn parquet_says_the_same_as_csv() {
    let (folder, path) = folder();
    eventful(&path);
    let table = folder.path().join("table.parquet");
    let output = command(&path, &["--to", "parquet", "--out", table.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    let csv = command(&path, &["--to", "csv", "--out", "-"]);
    let (header, rows) = csv_rows(&csv.stdout);

    let reader = SerializedFileReader::new(std::fs::File::open(&table).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let value = |key: &str| {
        let pairs = metadata.key_value_metadata().unwrap();
        pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.clone()).unwrap()
    };
    assert_eq!(value("hand"), "three-finger");
    assert!(value("hand_file").contains("finger-1-abduct"));
    assert!(value("column force_n").starts_with("[N] "));
    assert!(value("column finger-1-abduct.torque_nm").starts_with("[N m] "));
    assert_eq!(metadata.num_rows(), rows.len() as i64);

    let mut compared = 0;
    for (row, fields) in reader.get_row_iter(None).unwrap().zip(&rows) {
        for (((name, field), text), column) in row.unwrap().get_column_iter().zip(fields).zip(&header) {
            assert_eq!(name, column);
            let cell = match field {
                Field::Null => Cell::Missing,
                Field::Long(value) => Cell::Whole(*value),
                Field::Float(value) => Cell::Real(*value),
                Field::Double(value) => Cell::Double(*value),
                Field::Bool(value) => Cell::Truth(*value),
                Field::Str(word) => Cell::Word(word),
                other => panic!("{name}: {other:?}"),
            };
            assert!(is_told(&cell, text), "{name}: {cell:?}, {text}");
            compared += 1;
        }
    }
    assert_eq!(compared, rows.len() * header.len());
}

#[test]
fn several_row_groups_are_one_table() {
    let (folder, path) = folder();
    let mut session = Session::new(&path);
    session.hello();
    session.telemetry(1, Signals::FULL);
    session.run(70_000);
    let arrived = session.arrived;
    session.finish();
    let table = folder.path().join("table.parquet");
    let output = command(&path, &["--to", "parquet", "--out", table.to_str().unwrap(), "--signals", "tick"]);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    let reader = SerializedFileReader::new(std::fs::File::open(&table).unwrap()).unwrap();
    assert_eq!(reader.metadata().num_row_groups(), 2);
    let ticks = reader.get_row_iter(None).unwrap().map(|row| match row.unwrap().get_column_iter().nth(1) {
        Some((_, Field::Long(tick))) => *tick,
        other => panic!("{other:?}"),
    });
    let ticks: Vec<i64> = ticks.collect();
    assert_eq!(ticks, (1..=arrived as i64).collect::<Vec<_>>());
}

#[test]
fn signals_and_times_are_chosen() {
    let (_folder, path) = folder();
    eventful(&path);
    let arguments = [
        "--to",
        "csv",
        "--out",
        "-",
        "--signals",
        "mode,finger-1-*.torque_nm",
        "--from",
        "0.5",
        "--until",
        "0.6",
    ];
    let output = command(&path, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    let (header, rows) = csv_rows(&output.stdout);
    let fingers = joint_names().into_iter().filter(|name| name.starts_with("finger-1-"));
    let joints = fingers.map(|name| name + ".torque_nm");
    assert_eq!(header, ["time_s", "mode"].map(str::to_owned).into_iter().chain(joints).collect::<Vec<_>>());
    assert!((100..=101).contains(&rows.len()), "{}", rows.len());

    let output = command(&path, &["--to", "csv", "--out", "-", "--signals", "torqe_nm"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("did you mean `torque_nm`?"), "{}", told(&output));
    let output = command(&path, &["--to", "csv", "--out", "-", "--from", "2", "--until", "1"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn nothing_is_overwritten_without_being_asked() {
    let (folder, path) = folder();
    eventful(&path);
    let table = folder.path().join("recording.csv");
    std::fs::write(&table, "precious").unwrap();
    let output = command(&path, &["--to", "csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("--force"), "{}", told(&output));
    assert_eq!(std::fs::read(&table).unwrap(), b"precious");
    assert_eq!(command(&path, &["--to", "csv", "--force"]).status.code(), Some(0));
    assert!(std::fs::read(&table).unwrap().starts_with(b"time_s,"));
}

#[test]
fn of_a_damaged_recording_what_can_be_read_is_exported() {
    let (_folder, path) = folder();
    let arrived = eventful(&path);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let output = command(&path, &["--to", "csv", "--out", "-"]);
    assert_eq!(output.status.code(), Some(1), "{}", told(&output));
    let (_, rows) = csv_rows(&output.stdout);
    assert!(!rows.is_empty() && (rows.len() as u64) < arrived, "{}", rows.len());
    std::fs::write(&path, b"this is not a recording, and never was one").unwrap();
    assert_eq!(command(&path, &["--to", "csv", "--out", "-"]).status.code(), Some(2));
}

#[cfg(unix)]
#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let (_folder, path) = folder();
    eventful(&path);
    let mut child = Process::new(env!("CARGO_BIN_EXE_blindgrasp"))
        .arg("export")
        .arg(&path)
        .args(["--to", "csv", "--out", "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), told(&output)), (Some(0), String::new()));
}

/// An hour of a hand with 12 joints at full rate, for measuring:
/// `HOUR=/tmp/hour.mcap cargo test --release -p blindgrasp --test command export -- --ignored`.
#[test]
#[ignore = "writes a recording of some gigabytes, to the path in HOUR"]
fn an_hour() {
    let path = PathBuf::from(std::env::var("HOUR").expect("HOUR: the path of the recording"));
    let mut session = Session::new(&path);
    session.hello();
    session.telemetry(1, Signals::FULL);
    session.run(10);
    session.command(Command::Arm);
    session.command(Command::Grasp(Grasp::CONFIGURED));
    session.run(3_600_000 - 12);
    assert_eq!(session.arrived, 3_600_001);
    println!("{:?}", session.finish());
}

/// What is lost while a link is cut is counted by the numbers that go on behind it; where the device has started anew, from its
/// start. Rows tell their session, and the host's time never runs back.
#[test]
fn what_is_lost_across_cuts_is_counted_and_rows_tell_their_session() {
    let (folder, path) = folder();
    let mut session = Session::new(&path);
    let lose = |session: &mut Session, ticks: u32| {
        for _ in 0..ticks {
            session.turn(None, Fate::IsLost);
        }
    };
    let begin = |session: &mut Session| {
        session.hello();
        session.telemetry(1, Signals::FULL);
        session.run(700);
    };
    begin(&mut session);
    // A cable is cut for 5 s, of which the host notices a part only.
    lose(&mut session, 700);
    session.cut();
    lose(&mut session, 4300);
    begin(&mut session);
    // The same once more, twice in a row, and longer than the device had been there.
    session.cut();
    lose(&mut session, 900);
    session.cut();
    lose(&mut session, 30_000);
    begin(&mut session);
    assert_eq!(session.sent - session.arrived, 35_900);
    // It starts anew: before anybody asks there are no records, and then some are lost.
    session.restart(2000);
    session.hello();
    session.telemetry(1, Signals::FULL);
    lose(&mut session, 40);
    session.run(700);
    // Again, but for longer than it has counted before.
    session.restart(6000);
    begin(&mut session);
    let (sent, arrived) = (session.sent, session.arrived);
    assert_eq!(sent - arrived, 35_940);
    session.finish();

    let output = command(&path, &["--to", "csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    let words = format!("{arrived} rows; 35940 records lost, 5 gaps");
    assert!(told(&output).contains(&words), "{}", told(&output));
    let (header, rows) = csv_rows(&std::fs::read(folder.path().join("recording.csv")).unwrap());
    let at = |name: &str| header.iter().position(|column| column == name).unwrap();
    let lost: Vec<u64> = rows.iter().map(|row| row[at("lost_before")].parse().unwrap()).collect();
    assert_eq!(lost.iter().filter(|lost| **lost > 0).copied().collect::<Vec<_>>(), [5000, 30_900, 40]);
    let column =
        |name: &str| rows.iter().map(|row| row[at(name)].parse::<f64>().unwrap()).collect::<Vec<_>>();
    let (sessions, host_s) = (column("session"), column("host_time_s"));
    let in_turn = |values: &[f64]| values.windows(2).all(|pair| pair[0] <= pair[1]);
    assert!(in_turn(&sessions) && in_turn(&host_s));
    for number in 1..=5 {
        let count = sessions.iter().filter(|session| **session == f64::from(number)).count();
        assert!((690..=710).contains(&count), "session {number}: {count} rows");
    }
    // A session's records are where they were: 5 s are 5 s.
    let first = |number: f64| host_s[sessions.iter().position(|session| *session == number).unwrap()];
    assert!((first(2.0) - 5.7).abs() < 0.01, "{}", first(2.0));
}
