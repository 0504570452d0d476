//! Pinocchio computes the same of every built-in hand, from the URDF that we write of it.

use blindgrasp::plant::dynamics::{Body, JointMatrix, bias_torques, mass_matrix, place_bodies};
use blindgrasp::scene::HandFile;
use blindgrasp::{Hand, MAX_JOINTS, Posture};
use blindgrasp_tests::random::Draw;
use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// In no direction of the base frame.
const GRAVITY_M_S2: [f64; 3] = [1.3, -2.1, -9.4];
/// Postures of each hand.
const POSTURES: usize = 1000;

/// A matrix by its rows.
fn rows(m: &Matrix3<f64>) -> Value {
    json!(m.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>())
}

/// What we compute of a hand in a posture.
fn values(hand: &Hand, angles_rad: &[f64; MAX_JOINTS]) -> Value {
    let count = hand.joint_count();
    let (mut posture, mut bodies) = (Posture::at_base(), [Body::NONE; MAX_JOINTS]);
    hand.forward_kinematics(angles_rad, &mut posture);
    place_bodies(hand, &posture, &mut bodies);
    let mut mass: JointMatrix = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    mass_matrix(hand, &posture, &bodies, &mut mass);
    let weight = bias_torques(hand, &posture, &bodies, &[0.0; MAX_JOINTS], &Vector3::from(GRAVITY_M_S2));
    let fingertips: Vec<Value> = (0..hand.fingertip_count())
        .map(|i| {
            let (linear, angular) = hand.jacobians(&posture, i);
            let jacobian = |m: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
                (0..3).map(|row| (0..count).map(|k| m(row, k)).collect()).collect()
            };
            // The frame of the description is that of the URDF's link.
            let from_link = hand.prepared_joints()[hand.fingertip_link(i)].from_link;
            json!({
                "centre_m": posture.centres_m[i].as_slice(),
                "attitude": rows(&(posture.attitudes[i] * from_link.transpose())),
                "linear_jacobian": jacobian(&|row, k| linear[(row, k)]),
                "angular_jacobian": jacobian(&|row, k| angular[(row, k)]),
            })
        })
        .collect();
    json!({
        "angles_rad": angles_rad[..count],
        "fingertips": fingertips,
        "mass_matrix": mass[..count].iter().map(|row| &row[..count]).collect::<Vec<_>>(),
        "gravity_torques_nm": weight[..count],
    })
}

/// Tolerance: 1e-9, absolute for values below one and relative above; the mass matrix and the gravity torques are in SI units
/// small, so that their differences are also taken relative to their largest entries: there the 1.1e-14 kg m^2 that the export
/// gives to what has no mass count, against entries of 1e-5 kg m^2 and more.
#[test]
#[ignore = "needs the Python package pin, which tests/run gets"]
fn pinocchio_computes_the_same() {
    let folder = std::env::temp_dir().join(format!("blindgrasp-pinocchio-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/pinocchio_hand.py");
    let mut draw = Draw::new(41);
    let mut hands = 0;
    for name in HandFile::built_in() {
        let (file, hand, _) = HandFile::load_checked(name).expect("a hand");
        let (urdf, postures) = (folder.join(format!("{name}.urdf")), folder.join(format!("{name}.json")));
        std::fs::write(&urdf, file.to_urdf()).expect("a file");
        let ours = json!({
            "gravity_m_s2": GRAVITY_M_S2,
            "joints": file.joints.iter().map(|joint| &joint.name).collect::<Vec<_>>(),
            "fingertips": file.fingertips.iter().map(|tip| format!("{}-tip", tip.name)).collect::<Vec<_>>(),
            "postures": (0..POSTURES).map(|_| values(&hand, &draw.joints(3.0))).collect::<Vec<_>>(),
        });
        std::fs::write(&postures, ours.to_string()).expect("a file");
        let output = Command::new("python3").arg(&script).arg(&urdf).arg(&postures).output().expect("Python");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        println!("{name}: pinocchio {}: {}", told["version"], told["largest"]);
        assert_eq!(told["postures"], POSTURES);
        let largest = told["largest"].as_object().expect("differences");
        assert_eq!(largest.len(), 8, "{largest:?}");
        for (kind, difference) in largest {
            assert!(
                difference.as_f64().is_some_and(|difference| difference < 1e-9),
                "{name}: {kind}: {difference}"
            );
        }
        hands += 1;
    }
    assert!(hands > 0);
    let _ = std::fs::remove_dir_all(&folder);
}
