//! The Python package `mcap` reads the same as we do.

use super::hand::{Hand, about, read, settings};
use blindgrasp::model::Scene;
use blindgrasp::record::mcap::{Decoded, Decoder, Stamp, What, Writer};
use blindgrasp_shared::limit::Limit;
use blindgrasp_shared::parameters::Each;
use blindgrasp_shared::signals::{Kind, Value as Told};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// A float as Python told it: every `f32` is an `f64` that JSON keeps.
fn float(value: &Value) -> f32 {
    value.as_f64().map_or(f32::NAN, |value| value as f32)
}

fn same(told: &Value, ours: f32) -> bool {
    float(told).to_bits() == ours.to_bits() || (told.is_null() && ours.is_nan())
}

fn compare(told: &Value, ours: &Decoded, joint_names: &[String]) {
    let record = &ours.record;
    for (name, ours) in [("log_time", ours.at.0), ("lost_before", ours.lost_before)] {
        assert_eq!(told[name].as_u64(), Some(ours), "{name}: {told}");
    }
    assert_eq!(told["time_s"].as_f64(), Some(ours.time_s));
    let joint = |k: usize| &told["joints"][joint_names[k].replace('-', "_")];
    record.tell(|signal| {
        let key = signal.signal.key;
        match signal.each {
            Each::Joint => (0..joint_names.len()).for_each(|k| match signal.kind {
                Kind::Limiting => same_limits(joint(k), key, signal.value.of_joint(k)),
                Kind::Count => {
                    let count = &joint(k)[key];
                    let ours = signal.value.of_joint(k);
                    let theirs = count.as_i64().map_or(Told::Missing, |count| Told::Count(count as i32));
                    assert_eq!(theirs, ours, "{key}: {told}");
                }
                _ => same_value(joint(k), key, signal.value.of_joint(k), joint_names),
            }),
            Each::Hand | Each::Axis => same_value(told, key, signal.value, joint_names),
        }
    });
    for (k, _) in joint_names.iter().enumerate() {
        for (name, list) in [("angle_rad", &ours.angles_rad), ("speed_rad_s", &ours.speeds_rad_s)] {
            let ours = list.as_slice().get(k).copied().unwrap_or(f32::NAN);
            assert!(same(&joint(k)[name], ours), "{name}: {told}, {ours}");
        }
    }
}

/// A field of a message against the value that the hand told.
fn same_value(message: &Value, key: &str, ours: Told<'_>, joint_names: &[String]) {
    let theirs = &message[key];
    let same = match ours {
        Told::Missing if theirs == "NO_FAULT" || theirs == "" => true,
        Told::Missing => same(theirs, f32::NAN),
        Told::Whole(value) => theirs.as_u64() == Some(value.into()),
        Told::Real(value) => same(theirs, value),
        Told::Truth(value) => theirs == value,
        Told::Mode(mode) => *theirs == mode.words().to_uppercase().replace(' ', "_"),
        Told::Fault(fault) => {
            let plain = |name: &str| name.replace('_', "").to_uppercase();
            theirs.as_str().is_some_and(|theirs| plain(theirs) == plain(&format!("{fault:?}")))
        }
        Told::Joint(k) => *theirs == joint_names[usize::from(k)],
        Told::Answer(answer) => *theirs == answer.to_string(),
        other => panic!("{key}: {other:?} is not of the whole hand"),
    };
    assert!(same, "{key}: {theirs} instead of {ours:?}");
}

/// The fields of the limits of a joint's torque.
fn same_limits(message: &Value, key: &str, ours: Told<'_>) {
    for limit in Limit::ALL {
        let limited = matches!(ours, Told::Limiting(limiting) if limiting.contains(limit));
        assert_eq!(message[format!("{key}_{}", limit.key())], limited);
    }
}

/// Returns what Python finds in a recording.
fn python(path: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/read_recording.py");
    let output = Command::new("python3").arg(script).arg(path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
#[ignore = "needs the Python packages mcap and mcap-protobuf-support, which tests/run gets"]
fn python_reads_the_same_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for finish in [true, false] {
        let mut random = fastrand::Rng::with_seed(7);
        let mut writer = Writer::create(&path, true).unwrap();
        let names = ["three-finger", "two-finger"];
        let devices = ["hand1", "hand2"].map(|name| writer.add_device(name));
        let mut hands = names.map(|name| Hand::new(about(name).joint_names.len()));
        for (k, name) in names.into_iter().enumerate() {
            writer.about(devices[k], Stamp(0), &about(name)).unwrap();
            writer.parameters(devices[k], Stamp(0), &settings(name)).unwrap();
        }
        for tick in 1..=700_u64 {
            for k in 0..2 {
                let (_, payload) = hands[k].tick(&mut random);
                if random.u32(0..90) > 0 {
                    let at = Stamp(1_000_000 * tick + random.u64(0..300_000));
                    writer.received(devices[k], at, &payload).unwrap();
                }
            }
        }
        writer.checkpoint().unwrap();
        if finish {
            writer.finish().unwrap();
        } else {
            std::mem::forget(writer);
        }
        let told = python(&path);
        assert_eq!(told["finished"], finish);
        let (entries, _, recording) = read(&path);
        let mut decoder = Decoder::new();
        let decoded: Vec<Decoded> = entries.iter().filter_map(|entry| decoder.take(entry)).collect();
        let mut compared = 0;
        for (k, device) in recording.devices().iter().enumerate() {
            let topic = format!("/{device}/tick");
            let theirs: Vec<&Value> = told["ticks"]
                .as_array()
                .unwrap()
                .iter()
                .filter(|tick| tick["topic"] == topic.as_str())
                .collect();
            let ours: Vec<&Decoded> = decoded.iter().filter(|decoded| decoded.device == k).collect();
            assert_eq!(theirs.len(), ours.len());
            // Python gives messages by their time, which is that of the tick.
            for (theirs, ours) in theirs.iter().zip(&ours) {
                compare(theirs, ours, &about(names[k]).joint_names);
                compared += 1;
            }
            let received =
                entries.iter().filter(|e| e.device == k && matches!(e.what, What::Received(_))).count();
            assert_eq!(told["counts"][format!("/{device}/received")].as_u64(), Some(received as u64));
            assert_eq!(told["about"][k]["hand"], names[k]);
            assert_eq!(told["about"][k]["hand_file"], about(names[k]).hand_file.unwrap());
            for (theirs, ours) in
                told["parameters"][k]["values"].as_array().unwrap().iter().zip(settings(names[k]))
            {
                assert_eq!(theirs["key"], ours.parameter.to_string());
                assert!(ours.value.map_or(theirs["value"].is_null(), |value| same(&theirs["value"], value)));
            }
        }
        assert!(compared > 1000, "{compared}");
        // Units stand in the names, and in the table.
        let units = |name: &str| {
            told["signals"]["tick"].as_array().unwrap().iter().find(|row| row["name"] == name).unwrap()["unit"].clone()
        };
        assert_eq!(units("force_n"), "N");
        assert_eq!(units("work_j"), "J");
        assert_eq!(units("joints.<joint>.angle_rad"), "rad");
        assert_eq!(units("joints.<joint>.torque_nm"), "N m");
        assert_eq!(
            told["metadata"]["interface_version"],
            blindgrasp_shared::telemetry::INTERFACE_VERSION.to_string()
        );
    }
}

/// The true state that only a simulation knows, by the schemas that stand in the file.
#[test]
#[ignore = "needs the Python packages mcap and mcap-protobuf-support, which tests/run gets"]
fn python_reads_the_true_state_of_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let scene = Scene::load("cube", &["duration_s=0.3".to_owned()]).unwrap();
    let samples = super::simulation::run(&scene, &path);
    let told = python(&path);
    let truth = |topic: &str| told["truth"][topic].as_array().unwrap();
    let (objects, joints, contacts) =
        (truth("/truth/object"), truth("/truth/joints"), truth("/truth/contacts"));
    assert_eq!([objects.len(), joints.len(), contacts.len()], [samples.len(); 3]);
    // The parser of JSON may be wrong in the last bit; protobuf leaves out what is zero.
    let is_same = |told: &Value, ours: f64| (told.as_f64().unwrap_or(0.0) - ours).abs() <= 1e-15 * ours.abs();
    let is_vector = |told: &Value, ours: nalgebra::Vector3<f64>| {
        ["x", "y", "z"].into_iter().zip(ours.iter()).all(|(name, ours)| is_same(&told[name], *ours))
    };
    for (k, sample) in samples.iter().enumerate() {
        assert!(is_vector(&objects[k]["translation"], sample.position_m));
        assert!(is_vector(&objects[k]["rotation"], sample.attitude.imag()));
        assert!(is_same(&objects[k]["rotation"]["w"], sample.attitude.w));
        for (j, joint) in scene.joints.iter().enumerate() {
            let told = &joints[k]["joints"][j];
            assert_eq!(told["name"], joint.name.as_str());
            assert!(is_same(&told["position"], sample.angles_rad[j]), "{told}");
            assert!(is_same(&told["velocity"], sample.speeds_rad_s[j]), "{told}");
            assert!(is_same(&told["effort"], sample.torques_nm[j]), "{told}");
        }
        for (told, ours) in contacts[k]["contacts"].as_array().unwrap().iter().zip(&sample.contacts) {
            assert!(is_vector(&told["point_m"], ours.point_m), "{told}");
            assert!(is_vector(&told["force_n"], ours.force_on_object_n()), "{told}");
        }
    }
}

#[test]
#[ignore = "needs the Python packages mcap and mcap-protobuf-support, which tests/run gets"]
fn the_example_in_python_reads_what_a_simulation_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let command = |program: &str, arguments: &[&str]| {
        let output = Command::new(program)
            .args(arguments)
            .arg(&path)
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
            .output()
            .unwrap();
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        (output.status.code(), out, err)
    };
    let (code, _, err) = command(
        env!("CARGO_BIN_EXE_blindgrasp"),
        &["sim", "allegro-like-prism", "--duration", "0.5", "--out"],
    );
    assert_eq!(code, Some(0), "{err}");
    let example = "examples/python/read_recording.py";
    let signal = ["--joint", "thumb_flex_1", "--signal", "angle_rad", "--every", "100"];
    let (code, out, err) = command("python3", &[&[example], &signal[..]].concat());
    assert_eq!(code, Some(0), "{err}");
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines[0].contains("hand allegro-like (") && lines[0].contains("thumb-flex-1"), "{out}");
    assert!(lines.iter().any(|line| line.contains("parameters")), "{out}");
    // The tick that arms the hand, the one at time 0, and 500 more.
    assert_eq!(lines.last(), Some(&"502 records"), "{out}");
    let angles: Vec<f64> = lines
        .iter()
        .filter_map(|line| line.split_once("thumb_flex_1 ")?.1.strip_suffix(" rad")?.parse().ok())
        .collect();
    assert_eq!(angles.len(), 6, "{out}");
    assert!(angles.iter().all(|angle| (0.5..1.5).contains(angle)), "{angles:?}");
    let (code, _, err) = command("python3", &[example, "--joint", "no_such"]);
    assert_eq!(code, Some(1));
    assert!(err.contains("no joint is called no_such: index_turn, "), "{err}");
}
