//! Pinocchio computes the same of every built-in hand, from the URDF that we write of it; and with its algorithms the plant
//! accelerates as it should.

use blindgrasp::body::dynamics::{Body, JointMatrix, bias_torques, mass_matrix, place_bodies};
use blindgrasp::body::{Hand, MAX_JOINTS, Posture};
use blindgrasp::model::{HandFile, Scene};
use blindgrasp_tests::random::Draw;
use blindgrasp_tests::rolling::{State, trunk, velocities};
use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// In no direction of the base frame.
const GRAVITY_M_S2: [f64; 3] = [1.3, -2.1, -9.4];
/// Postures of each hand.
const POSTURES: usize = 1000;
/// States of each scene whose accelerations are compared.
const STATES: usize = 200;

/// A matrix by its rows.
fn rows(m: &Matrix3<f64>) -> Value {
    json!(m.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>())
}

/// Returns our values of a hand in a posture.
fn values(hand: &Hand, angles_rad: &[f64; MAX_JOINTS]) -> Value {
    let count = hand.joint_count();
    let (mut posture, mut bodies) = (Posture::at_base(), [Body::NONE; MAX_JOINTS]);
    hand.forward_kinematics(angles_rad, &mut posture);
    place_bodies(hand, &posture, &mut bodies);
    let mut mass: JointMatrix = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    mass_matrix(hand, &bodies, &mut mass);
    let weight = bias_torques(hand, &bodies, &[0.0; MAX_JOINTS], &Vector3::from(GRAVITY_M_S2));
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

/// A script of Python for two files in a folder of their own.
struct Script {
    folder: PathBuf,
    path: PathBuf,
}

impl Script {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("blindgrasp-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("python").join(name);
        Self { folder, path }
    }

    fn tell(&self, name: &str, urdf: &str, ours: &Value) -> Value {
        let [description, values] =
            ["urdf", "json"].map(|extension| self.folder.join(format!("{name}.{extension}")));
        std::fs::write(&description, urdf).expect("a file");
        std::fs::write(&values, ours.to_string()).expect("a file");
        let output =
            Command::new("python3").arg(&self.path).arg(&description).arg(&values).output().expect("Python");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    }

    /// The largest differences that a script tells, which have to be so many, each below a bound.
    fn check(name: &str, told: &Value, kinds: usize, bound: f64) {
        let largest = told["largest"].as_object().expect("differences");
        assert_eq!(largest.len(), kinds, "{largest:?}");
        for (kind, difference) in largest {
            assert!(
                difference.as_f64().is_some_and(|difference| difference < bound),
                "{name}: {kind}: {difference}"
            );
        }
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Tolerance: 1e-9, absolute for values below one and relative above; the mass matrix and the gravity torques are in SI units
/// small, so that their differences are also taken relative to their largest entries: there the 1.1e-14 kg m^2 that the export
/// gives to what has no mass count, against entries of 1e-5 kg m^2 and more.
#[test]
#[ignore = "needs the Python package pin, which tests/run gets"]
fn pinocchio_computes_the_same() {
    let script = Script::new("pinocchio_hand.py");
    let mut draw = Draw::new(41);
    let mut hands = 0;
    for name in HandFile::built_in() {
        let (file, hand, _) = HandFile::load_checked(name).expect("a hand");
        let ours = json!({
            "gravity_m_s2": GRAVITY_M_S2,
            "joints": file.joints.iter().map(|joint| &joint.name).collect::<Vec<_>>(),
            "fingertips": file.fingertips.iter().map(|tip| format!("{}-tip", tip.name)).collect::<Vec<_>>(),
            "postures": (0..POSTURES).map(|_| values(&hand, &draw.joints(3.0))).collect::<Vec<_>>(),
        });
        let told = script.tell(name, &file.to_urdf(), &ours);
        println!("{name}: pinocchio {}: {}", told["version"], told["largest"]);
        assert_eq!(told["postures"], POSTURES);
        Script::check(name, &told, 8, 1e-9);
        hands += 1;
    }
    assert!(hands > 0);
}

/// A state, and what our plant makes of it.
fn rolling(state: &State) -> Value {
    let (model, motion) = (&state.model, &state.motion);
    let joints = model.hand.joint_count();
    let contacts: Vec<Value> = model
        .faces
        .iter()
        .zip(&model.fingertips)
        .map(|(contact, tip)| {
            let corners = &model.object.shape.faces[contact.face].corners;
            let corners =
                corners.iter().map(|&corner| model.object.shape.vertices_m[corner].as_slice().to_vec());
            json!({
                "corners_m": corners.collect::<Vec<_>>(),
                "directions": ([0, 2].map(|k| contact.frame.column(k).as_slice().to_vec())),
                "radius_m": tip.radius_m,
                "stiffness_n_m2": tip.stiffness_n_m2,
                "damping_n_s_m3": tip.damping_n_s_m3,
                "torsion_n_s_m": tip.torsion_n_s_m,
            })
        })
        .collect();
    let response = state.response();
    json!({
        "angles_rad": motion.angles_rad[..joints],
        "position_m": motion.position_m.as_slice(),
        "attitude": rows(&motion.attitude.to_rotation_matrix().into_inner()),
        "given_velocities": velocities(motion, joints),
        "torques_nm": state.torques_nm[..joints],
        "contacts": contacts,
        "velocities": response.velocities,
        "accelerations": response.accelerations,
        "multipliers_n": response.multipliers_n,
        "normal_n": response.normal_n,
        "torsion_nm": response.torsion_nm,
        "uncertainty": response.uncertainty,
    })
}

/// Accelerations and contact forces of our plant at random states, as its integrator has them (see `rolling`), against the system of
/// equations that the script assembles from Pinocchio's mass matrix and bias. Joint friction is off, gravity acts on hand and object.
///
/// Tolerance: 1e-8 of the largest number of a kind in a state; kinds are the accelerations of the trunk's joints, of the fingers', of
/// the object's centre, its rotation, multipliers, normal forces, torsional torques, and the velocities projected. Ours have to be
/// certain to 1e-9.
#[test]
#[ignore = "needs the Python package pin, which tests/run gets"]
fn the_plant_accelerates_as_pinocchio_has_it() {
    let script = Script::new("pinocchio_plant.py");
    let mut draw = Draw::new(6);
    for (name, hand, kinds) in [
        ("cube-ideal", "three-finger", 7),
        ("prism-ideal", "three-finger", 7),
        ("hand-arm", "hand-arm", 8),
        ("hand-arm-consistent", "hand-arm", 8),
    ] {
        let scene = Scene::load(name, &[]).expect("the scene is built in");
        let (file, _, _) = HandFile::load_checked(hand).expect("a hand");
        let gravity = Vector3::from(GRAVITY_M_S2);
        let (mut states, mut tried) = (Vec::new(), 0);
        while states.len() < STATES {
            tried += 1;
            assert!(tried < 100 * STATES, "{name}: {} states of {tried}", states.len());
            states.extend(State::random(&scene, &gravity, &mut draw));
        }
        let faces: BTreeSet<Vec<usize>> =
            states.iter().map(|state| state.model.faces.iter().map(|face| face.face).collect()).collect();
        let model = &states[0].model;
        let values: Vec<Value> = states.iter().map(rolling).collect();
        let uncertain = values.iter().filter_map(|value| value["uncertainty"].as_f64()).fold(0.0, f64::max);
        let ours = json!({
            "gravity_m_s2": GRAVITY_M_S2,
            "joints": file.joints.iter().map(|joint| &joint.name).collect::<Vec<_>>(),
            "fingertips": file.fingertips.iter().map(|tip| format!("{}-tip", tip.name)).collect::<Vec<_>>(),
            "trunk": trunk(model),
            "mass_kg": model.object.mass_kg,
            "inertia_kg_m2": rows(&model.object.inertia_kg_m2),
            "states": values,
        });
        let told = script.tell(name, &file.to_urdf(), &ours);
        println!(
            "{name}: {STATES} states of {tried}, {} sets of faces, ours to {uncertain:.1e}: {told:#}",
            faces.len()
        );
        assert_eq!(told["states"], STATES);
        assert!(uncertain < 1e-9);
        // The drift of the constraints, `(dP/dt) v`, in two ways.
        assert!(told["drift by differences"].as_f64().is_some_and(|difference| difference < 1e-9));
        Script::check(name, &told, kinds, 1e-8);
    }
}
