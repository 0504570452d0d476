//! The Python package `mcap` reads the same as we do.

use crate::hand::{Hand, about, read, settings};
use blindgrasp::record::mcap::{Decoded, Decoder, Stamp, What, Writer};
use blindgrasp_shared::limit::Limit;
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
    let numbers = [
        ("log_time", ours.at.0),
        ("sequence", record.sequence.into()),
        ("tick", record.tick.into()),
        ("cycles", record.cycles.into()),
        ("late_ticks", record.late_ticks.into()),
        ("dropped", record.dropped.into()),
        ("decimation", record.decimation.into()),
        ("lost_before", ours.lost_before),
    ];
    for (name, ours) in numbers {
        assert_eq!(told[name].as_u64(), Some(ours), "{name}: {told}");
    }
    assert_eq!(told["time_s"].as_f64(), Some(ours.time_s));
    assert_eq!(told["mode"], record.mode.words().to_uppercase());
    let fault = record.fault.map_or("NO_FAULT".to_owned(), |raised| format!("{:?}", raised.fault));
    assert_eq!(told["fault"].as_str().unwrap().replace('_', ""), fault.to_uppercase().replace('_', ""));
    let joint = record.fault.and_then(|raised| raised.joint).map_or("", |k| &joint_names[usize::from(k)]);
    assert_eq!(told["fault_joint"], joint);
    let floats = [
        ("force_n", record.gains.grasp[0]),
        ("attitude_stiffness_nm", record.gains.grasp[1]),
        ("approach_potential_j", record.potentials_j.grasp[0]),
        ("attitude_potential_j", record.potentials_j.grasp[1]),
        ("integral_gain_nm_rad", record.gains.integral[0]),
        ("integral_potential_j", record.potentials_j.integral[0]),
        ("work_j", record.work_j),
        ("damped_j", record.damped_j),
        ("excess_j", record.excess_j),
    ];
    for (name, ours) in floats {
        assert!(same(&told[name], ours), "{name}: {told}, {ours}");
    }
    for (k, name) in joint_names.iter().enumerate() {
        let told = &told["joints"][name.replace('-', "_")];
        let count = record.counts.as_slice().get(k).map(|&count| i64::from(count));
        assert_eq!(told["count"].as_i64(), count, "{told}");
        let lists = [
            ("angle_rad", &ours.angles_rad),
            ("speed_rad_s", &ours.speeds_rad_s),
            ("torque_nm", &record.torques_nm),
        ];
        for (name, list) in lists {
            let ours = list.as_slice().get(k).copied().unwrap_or(f32::NAN);
            assert!(same(&told[name], ours), "{name}: {told}, {ours}");
        }
        let names =
            ["limited_by_torque", "limited_by_slew", "limited_by_lower_stop", "limited_by_upper_stop"];
        for (limit, name) in Limit::ALL.into_iter().zip(names) {
            let limited = record.limiting.as_slice().get(k).is_some_and(|limiting| limiting.contains(limit));
            assert_eq!(told[name], limited);
        }
    }
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
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/read_recording.py");
        let output = Command::new("python3").arg(script).arg(&path).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
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
        assert_eq!(units("excess_j"), "J");
        assert_eq!(units("joints.<joint>.angle_rad"), "rad");
        assert_eq!(units("joints.<joint>.torque_nm"), "N m");
        assert_eq!(told["metadata"]["interface_version"], "4");
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
