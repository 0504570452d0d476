//! Recordings through the controller again: the same bits, what differs, and what can't be computed.

#![allow(clippy::unwrap_used, reason = "only tests are here")]

use crate::recorded;

use blindgrasp::body::MAX_JOINTS;
use blindgrasp::record::mcap::{Decoder, Recording};
use blindgrasp::record::replay::{Reason, ReplayError, Report, Wanted, replay};
use blindgrasp_shared::command::{Command, Grasp};
use blindgrasp_shared::control::PerGain;
use blindgrasp_shared::estimate::{Motion, Tracks};
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::joints::Reading;
use blindgrasp_shared::limit::{Limit, LimitConfig};
use blindgrasp_shared::link::message::Signals;
use blindgrasp_shared::math::Real;
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::tick::State;
use recorded::{AnyRecord, Fate, Hand, Session, Told, simulation};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Output};
use tempfile::TempDir;

/// Ticks from one snapshot to the next.
const SNAPSHOT_TICKS: u32 = 1000;

fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.mcap");
    (folder, path)
}

fn replayed_with(path: &Path, wanted: Wanted) -> Result<Report, ReplayError> {
    let recording = Recording::open(path).unwrap();
    let mut entries = recording.entries().unwrap();
    replay(&mut entries, |_| {}, 0, "hand", recording.span().unwrap().0.0, wanted)
}

fn replayed(path: &Path) -> Report {
    replayed_with(path, Wanted::default()).unwrap()
}

fn set(texts: &[&str]) -> Wanted {
    let typed: Vec<String> = texts.iter().map(|&text| text.to_owned()).collect();
    Wanted { changes: typed.iter().map(|text| text.parse().unwrap()).collect(), typed, ..Wanted::default() }
}

fn command(path: &Path, arguments: &[&str]) -> Output {
    Process::new(env!("CARGO_BIN_EXE_blindgrasp")).arg("replay").arg(path).args(arguments).output().unwrap()
}

/// A session that records everything from its third tick on.
fn streaming(path: &Path) -> Session {
    let mut session = Session::new(path);
    session.hello();
    // A grasp that begins at once: nothing is there to be touched.
    session.set(Parameter::CLOSING_SPEED, 0, 0.0);
    session.telemetry(1, Signals::FULL);
    session
}

fn armed(path: &Path) -> Session {
    let mut session = streaming(path);
    session.run(10);
    assert_eq!(session.command(Command::Arm).mode, Mode::Armed);
    session
}

#[test]
fn a_whole_session_gives_the_same_bits() {
    // A line that takes every record in full, and one that takes one in four, and an input record of each other tick.
    for waiting in [|_| 0, |tick| if tick % 4 == 0 { 0 } else { 2 }] {
        whole_session(waiting);
    }
}

fn whole_session(waiting: fn(u32) -> usize) {
    let (_folder, path) = folder();
    let mut session = Session::new(&path);
    session.waiting = waiting;
    session.hello();
    // A grasp that begins at once: nothing is there to be touched.
    session.set(Parameter::CLOSING_SPEED, 0, 0.0);
    session.telemetry(1, Signals::FULL);
    session.run(10);
    assert_eq!(session.command(Command::Arm).mode, Mode::Armed);
    session.run(500);
    let firm = Grasp { gains: PerGain { grasp: [Some(3.0), None], ..PerGain::all(None) } };
    assert_eq!(session.command(Command::Grasp(firm)).mode, Mode::Grasping);
    session.run(1500);
    // Late ticks, fewer than are a fault; a command that is refused.
    for k in 0..40 {
        let reading = Reading::Counts(session.hand.counts(session.time));
        session.turn_with(None, Fate::Arrives, reading, k % 20 == 0);
    }
    session.command(Command::Arm);
    session.command(Command::Release);
    session.run(700);
    session.command(Command::Grasp(Grasp::CONFIGURED));
    session.run(400);
    // A joint that can't be read; back to work.
    assert_eq!(session.fail(Raised::at(3, Fault::SampleMissing)).mode, Mode::Fault);
    session.run(300);
    session.command(Command::ClearFault);
    session.run(50);
    assert_eq!(session.command(Command::Arm).mode, Mode::Armed);
    // The host falls silent: the hand lets go, and is in a fault.
    session.command(Command::Grasp(Grasp::CONFIGURED));
    let last = (0..1200).map(|_| session.pass()).last().unwrap();
    assert_eq!((last.mode, last.fault), (Mode::Fault, Some(Raised::of_hand(Fault::LinkLost))));
    let sent = session.sent;
    session.finish();

    let report = replayed(&path);
    assert_eq!(report.first_difference, None);
    assert_eq!((report.bits_differ, report.missing), (0, 0));
    // The tick that asks for records is the one after which the first snapshot is taken.
    assert_eq!((report.not_replayed, report.ticks), (1, sent - 1));
    assert_eq!(report.gaps.len(), 1);
    assert_eq!(report.gaps[0].reason, Reason::Start);
    // The second interval is the first that can be foreseen.
    assert!(report.snapshots >= 2, "{}", report.snapshots);
}

#[test]
fn lost_records_cost_no_more_than_up_to_the_next_snapshot() {
    let (_folder, path) = folder();
    let mut session = armed(&path);
    session.command(Command::Grasp(Grasp::CONFIGURED));
    session.run(1700);
    session.turn(None, Fate::IsLost);
    session.run(2600);
    for _ in 0..20 {
        session.turn(None, Fate::IsLost);
    }
    session.run(2600);
    let (sent, arrived) = (session.sent, session.arrived);
    assert_eq!(sent - arrived, 21);
    session.finish();

    let report = replayed(&path);
    assert_eq!((report.bits_differ, report.first_difference.clone()), (0, None));
    assert_eq!(report.ticks + report.not_replayed + report.missing, sent);
    assert_eq!(
        report.gaps.iter().map(|gap| &gap.reason).collect::<Vec<_>>(),
        [&Reason::Start, &Reason::Lost, &Reason::Lost]
    );
    assert_eq!((report.gaps[1].missing, report.gaps[2].missing), (1, 20));
    for gap in &report.gaps[1..] {
        assert!(gap.not_replayed <= u64::from(SNAPSHOT_TICKS), "{gap:?}");
        assert_eq!(u64::from(gap.until_tick - gap.from_tick) + 1, gap.missing + gap.not_replayed);
    }
}

#[test]
fn a_device_that_starts_anew_is_followed_again() {
    let (_folder, path) = folder();
    let mut session = armed(&path);
    session.run(1300);
    let first = session.arrived;
    session.restart(37);
    session.hello();
    // A grasp that begins at once: nothing is there to be touched.
    session.set(Parameter::CLOSING_SPEED, 0, 0.0);
    session.telemetry(1, Signals::FULL);
    session.run(10);
    session.command(Command::Arm);
    session.run(1300);
    let sent = session.sent;
    session.finish();
    let report = replayed(&path);
    assert_eq!((report.bits_differ, report.missing), (0, 0));
    assert_eq!(report.not_replayed, 2, "{:?}", report.gaps);
    assert_eq!(report.ticks, sent - 2);
    assert_eq!(report.gaps[1].reason, Reason::Restarted);
    assert!((report.gaps[1].time_s - (first as f64 + 39.0) * 1e-3).abs() < 0.01, "{:?}", report.gaps);
}

#[test]
fn parameters_that_change_are_taken_over_with_the_next_snapshot() {
    let (_folder, path) = folder();
    let mut session = armed(&path);
    session.run(200);
    // Refused, for the hand is armed: nothing changes, and nothing is lost.
    session.set(Parameter::DAMPING, 2, 0.125);
    session.run(400);
    session.command(Command::Disarm);
    session.run(10);
    session.set(Parameter::gain(0), 0, 7.0);
    // Without the virtual frame nobody misses what is not there.
    session.set(Parameter::gain(3), 0, 0.0);
    session.set(Parameter::gain(4), 0, 0.0);
    session.set(Parameter::DAMPING, 2, 0.125);
    session.run(1100);
    session.command(Command::Arm);
    assert_eq!(session.command(Command::Grasp(Grasp::CONFIGURED)).mode, Mode::Grasping);
    session.run(1000);
    assert_eq!(session.pass().gains.grasp[0], 7.0);
    let sent = session.sent;
    session.finish();

    let report = replayed(&path);
    assert_eq!((report.bits_differ, report.missing), (0, 0), "{:?}", report.first_difference);
    assert_eq!(report.ticks + report.not_replayed, sent);
    let reasons: Vec<_> = report.gaps.iter().map(|gap| gap.reason.clone()).collect();
    assert_eq!(reasons, [Reason::Start, Reason::ParametersChanged]);
    assert!(report.gaps[1].not_replayed <= u64::from(SNAPSHOT_TICKS), "{:?}", report.gaps[1]);
}

#[test]
fn a_flipped_bit_is_found_in_its_tick() {
    // It shows in a full record by itself, and in the digest of an input record.
    for (bit, waiting, what) in
        [(0, 0, "torque_nm"), (20, 0, "torque_nm"), (0, 2, "digest of all that the tick computed")]
    {
        let (_folder, path) = folder();
        let mut session = armed(&path);
        session.command(Command::Grasp(Grasp::CONFIGURED));
        session.run(1234);
        if waiting > 0 {
            session.waiting = |_| 2;
        }
        let flipped = session.turn(None, Fate::Flipped { joint: 5, bit });
        session.run(700);
        session.finish();
        let report = replayed(&path);
        assert_eq!(report.bits_differ, 1, "{:?}", report.first_difference);
        let first = report.first_difference.unwrap();
        assert_eq!((first.tick, first.what), (i64::from(flipped.tick), what));
        if waiting == 0 {
            assert_eq!(first.joint.as_deref(), Some("finger-2-flex-1"));
        }
        let output = command(&path, &["--json"]);
        assert_eq!(output.status.code(), Some(1));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["bits_differ"], 1);
        assert_eq!(json["first_difference"]["tick"], flipped.tick);
    }
}

/// A grasp of a simulation with nothing that limits torques, from the first tick on.
fn unlimited(path: &Path, ticks: u32) -> (Hand, recorded::AnyConfig, Vec<AnyRecord>) {
    let hand = Hand::load("three-finger");
    let mut config = hand.model.config;
    config.limits = LimitConfig::NONE;
    config.faults.heartbeat_ms = None;
    let records = simulation(path, &hand, &config, Signals::FULL, |k| {
        let command = match k {
            5 => Some(Command::Arm),
            50 => Some(Command::Grasp(Grasp::CONFIGURED)),
            _ => None,
        };
        (k < ticks).then(|| (Told::Counts(hand.counts(k)), command))
    });
    (hand, config, records)
}

#[test]
fn a_simulation_is_replayed_from_its_first_tick() {
    let (_folder, path) = folder();
    let (.., records) = unlimited(&path, 3000);
    let report = replayed(&path);
    assert_eq!((report.ticks, report.bits_differ, report.not_replayed), (records.len() as u64, 0, 0));
    assert!(report.gaps.is_empty());
    let part = replayed_with(&path, Wanted { from_s: Some(1.0), until_s: Some(1.9995), ..Wanted::default() });
    assert_eq!(part.unwrap().ticks, 1000);
    let output = command(&path, &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["ticks"], &json["bits_differ"]), (&3000.into(), &0.into()));
}

#[test]
fn damping_makes_the_difference_that_the_law_says() {
    let (_folder, path) = folder();
    let (hand, config, records) = unlimited(&path, 4000);
    // In Eq. 30, damping is a torque -C dq by itself: of another C, nothing differs but that.
    let change_nm_s = 0.02 - f64::from(config.laws.hold.damping_nm_s[4]);
    let estimator = hand.model.params(&config).unwrap();
    let (mut tracks, mut motion) = (Tracks::new(), Motion::still());
    let (mut squares, mut largest, mut powered) = (0.0, 0.0_f64, 0_u32);
    for (k, record) in records.iter().enumerate() {
        estimator.estimator().update(&mut tracks, &hand.counts(k as u32), &mut motion);
        if record.mode != Mode::Disarmed {
            let difference_nm = change_nm_s * f64::from(motion.speeds_rad_s[4]);
            squares += difference_nm * difference_nm;
            largest = largest.max(difference_nm.abs());
            powered += 1;
        }
    }
    let rms_nm = (squares / f64::from(powered)).square_root();
    assert!(rms_nm > 1e-4, "the joint hardly moves");

    let report = replayed_with(&path, set(&["damping_nm_s[4]=0.02"])).unwrap();
    assert_eq!(report.bits_differ, 0);
    let open_loop = report.open_loop.unwrap();
    assert_eq!(open_loop.powered_ticks, u64::from(powered));
    // Torques are sums of f32 of less than 1 N m: each of the two is rounded by less than some 1e-7.
    assert!((open_loop.joints[4].rms_nm - rms_nm).abs() < 1e-6, "{} {rms_nm}", open_loop.joints[4].rms_nm);
    assert!((open_loop.joints[4].largest_nm - largest).abs() < 1e-6);
    for (k, joint) in open_loop.joints.iter().enumerate() {
        assert!(k == 4 || joint.largest_nm == 0.0, "{joint:?}");
    }
    assert!(open_loop.limits.iter().all(|limit| limit.recorded == 0.0 && limit.changed == 0.0));
    let named = replayed_with(&path, set(&["damping_nm_s.finger-2-abduct=0.02"])).unwrap();
    assert_eq!(named.open_loop.unwrap().joints[4].rms_nm, open_loop.joints[4].rms_nm);
}

#[test]
fn limits_and_faults_of_other_parameters_are_counted() {
    let (_folder, path) = folder();
    let (.., records) = unlimited(&path, 2000);
    let limit_nm = 0.01_f32;
    let over = |record: &&AnyRecord| record.torques_nm.iter().any(|torque| torque.abs() > limit_nm);
    let share = records.iter().filter(over).count() as f64 / 2000.0;
    let report = replayed_with(
        &path,
        set(&[
            "limits.torque_nm=0.01",
            "limits.force_n=20",
            "limits.attitude_stiffness_nm=1",
            "faults.saturated_ms=off",
            // Joints that move by themselves take the potentials along, and the limited torques do not pay for it.
            "faults.energy_j=off",
        ]),
    );
    let open_loop = report.unwrap().open_loop.unwrap();
    let torque = &open_loop.limits[0];
    assert_eq!((torque.limit, torque.recorded), (Limit::Torque.words(), 0.0));
    assert!((torque.changed - share).abs() < 1e-12 && share > 0.1, "{} {share}", torque.changed);

    // The joints swing faster than that now and then.
    let report = replayed_with(&path, set(&["faults.speed_limit_rad_s=0.2"]));
    let open_loop = report.unwrap().open_loop.unwrap();
    assert_eq!(open_loop.faults_only_recorded, 0);
    assert!(open_loop.faults_only_changed >= 1);
    let output = command(&path, &["--set", "faults.speed_limit_rad_s=0.2"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(text.contains("open loop") && text.contains("speed is above its limit"), "{text}");
}

#[test]
fn what_cannot_be_replayed_says_why() {
    let told = |path: &Path, arguments: &[&str]| {
        let output = command(path, arguments);
        assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stdout));
        String::from_utf8(output.stderr).unwrap()
    };
    let hand = Hand::load("three-finger");
    let (_folder, path) = folder();
    simulation(&path, &hand, &hand.model.config, Signals::FULL, |k| (k < 50).then_some((Told::Ideal, None)));
    let error = told(&path, &[]);
    assert!(error.contains("no counts (ideal sensors"), "{error}");
    let error = told(&path, &["--hand", "two-finger"]);
    assert!(error.contains("built for the hand `three-finger`") && error.contains("`two-finger`"), "{error}");

    // One record in four ticks.
    let (_folder, path) = recorded_folder(|session| {
        session.telemetry(4, Signals::ALL.and(Signals::STATE));
        session.run(3000);
    });
    let error = told(&path, &[]);
    assert!(error.contains("one record in 4 ticks was sent"), "{error}");

    // Without snapshots.
    let (_folder, path) = recorded_folder(|session| {
        session.telemetry(1, Signals::ALL);
        session.run(3000);
    });
    let error = told(&path, &[]);
    assert!(error.contains("the state before the first snapshot is not known"), "{error}");

    let (_folder, path) = folder();
    let (..) = unlimited(&path, 100);
    for (arguments, words) in [
        (["--set", "dampng_nm_s=1"], "did you mean `damping_nm_s`?"),
        (["--set", "damping_nm_s=-1"], "damping_nm_s"),
        (["--set", "limits.force_n=1"], "force_n has to be at most its limit"),
        (["--device", "hand7"], "there is no `hand7` in the recording; it has hand"),
        (["--from", "-1"], "--from"),
    ] {
        let error = told(&path, &arguments);
        assert!(error.contains(words), "{error}");
    }
}

fn recorded_folder(what: impl FnOnce(&mut Session)) -> (TempDir, PathBuf) {
    let (folder, path) = folder();
    let mut session = Session::new(&path);
    session.hello();
    what(&mut session);
    session.finish();
    (folder, path)
}

/// The decoder of recordings and a controller's own state agree on angles.
#[test]
fn angles_of_a_recording_are_those_of_the_controller() {
    let (_folder, path) = folder();
    let (hand, config, _) = unlimited(&path, 500);
    let params = hand.model.params(&config).unwrap();
    let mut state: State<MAX_JOINTS, { blindgrasp::body::MAX_FINGERS }> = State::new();
    let mut decoder = Decoder::new();
    let recording = Recording::open(&path).unwrap();
    let mut compared = 0;
    for entry in recording.entries().unwrap() {
        let Some(decoded) = decoder.take(&entry.unwrap()) else { continue };
        let counts = hand.counts(decoded.record.tick);
        blindgrasp_shared::tick::tick(
            &params,
            &mut state,
            &blindgrasp_shared::tick::Input::counts(&counts, None),
        );
        assert_eq!(decoded.angles_rad.as_slice(), &state.angles_rad()[..12]);
        assert_eq!(decoded.speeds_rad_s.as_slice(), &state.speeds_rad_s()[..12]);
        compared += 1;
    }
    assert_eq!(compared, 500);
}

/// The recording of a simulation by the command, which is replayed by the command.
#[test]
fn what_the_simulation_records_is_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.mcap");
    let simulated = Process::new(env!("CARGO_BIN_EXE_blindgrasp"))
        .args(["sim", "cube", "--duration", "1.2", "--out"])
        .arg(&path)
        .output()
        .unwrap();
    assert_eq!(simulated.status.code(), Some(0), "{}", String::from_utf8_lossy(&simulated.stderr));
    let output = command(&path, &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["bits_differ"], &json["not_replayed"]), (&0.into(), &0.into()), "{json}");
    assert!(json["ticks"].as_u64().unwrap() >= 1200, "{json}");
    assert_eq!(json["gaps"], serde_json::json!([]));
}
