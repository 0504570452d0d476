//! `blindgrasp sim` as a user meets it: what it prints, what it writes, and what it says to bad input.

use crate::folder::{Folder, text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn blindgrasp(arguments: &[&str]) -> Output {
    Folder::new().run(arguments)
}

fn assert_refused(arguments: &[&str], words: &[&str]) {
    Folder::new().refused(arguments, words);
}

#[test]
fn json_is_one_object_with_every_field() {
    let output = blindgrasp(&["sim", "prism-ideal", "--json", "--duration", "0.2"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    for key in [
        "scene",
        "duration_s",
        "settled",
        "settle_time_s",
        "grasp_held",
        "lost_at_s",
        "lost_reason",
        "final",
        "friction_demand_max",
        "energy",
        "wall_s",
        "real_time_factor",
    ] {
        assert!(summary.get(key).is_some(), "{key}");
    }
    for key in [
        "joint_speed_max_rad_s",
        "object_speed_m_s",
        "object_spin_rad_s",
        "force_residual_n",
        "moment_residual_nm",
    ] {
        assert!(summary["final"][key].is_f64(), "{key}");
    }
    for key in ["normal_force_n", "desired_normal_force_n", "tangential_force_n", "indentation_m"] {
        assert_eq!(summary["final"][key].as_array().map(Vec::len), Some(3), "{key}");
    }
    for key in ["initial_j", "final_j", "increase_max_j"] {
        assert!(summary["energy"][key].is_f64(), "{key}");
    }
    assert_eq!(summary["duration_s"], 0.2);
    assert_eq!(summary["lost_at_s"], Value::Null);
}

#[test]
fn the_help_names_every_built_in_scene() {
    let output = blindgrasp(&["sim", "--help"]);
    assert_eq!(output.status.code(), Some(0));
    let help = text(&output.stdout);
    for name in blindgrasp::model::Scene::built_in() {
        assert!(help.contains(name), "no `{name}` in: {help}");
    }
}

#[test]
fn exit_code_says_whether_the_grasp_held() {
    let held = blindgrasp(&["sim", "cube"]);
    assert_eq!(held.status.code(), Some(0));
    assert!(text(&held.stdout).contains("held"));
    let lost = blindgrasp(&["sim", "cube-normal-only"]);
    assert_eq!(lost.status.code(), Some(1));
    assert!(text(&lost.stdout).contains("LOST") && text(&lost.stdout).contains("finger"));
}

/// A hand that lets go because of a fault says so, with the joint's name: not only that the object is gone.
#[test]
fn a_fault_of_the_controller_is_named() {
    let slow = "hand.joint.finger-2-flex-1.speed_limit_rad_s=0.05";
    let output = blindgrasp(&["sim", "cube", "--set", slow]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    assert!(table.contains("fault 5") && table.contains("finger-2-flex-1"), "{table}");
}

#[test]
fn out_writes_every_file_and_the_scene_reproduces_the_run() {
    let folder = Folder::new();
    let (first, second) = (folder.path("first"), folder.path("second"));
    let changed = ["--set", "control.force_n=4.5", "--duration", "0.3", "--set", "sensors.noise_counts=0.3"];
    let output = blindgrasp(&[&["sim", "cube", "--out", &first], &changed[..]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    for name in [
        "summary.json",
        "scene.toml",
        "trace.csv",
        "grasp.gif",
        "grasp-start.png",
        "grasp-end.png",
        "joint-velocities.png",
        "joint-velocities.svg",
        "object-velocities.png",
        "object-velocities.svg",
        "contact-forces.png",
        "contact-forces.svg",
        "residuals.png",
        "residuals.svg",
    ] {
        assert!(Path::new(&first).join(name).metadata().is_ok_and(|file| file.len() > 100), "{name}");
    }
    let trace = fs::read_to_string(Path::new(&first).join("trace.csv")).expect("a trace");
    let mut lines = trace.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let mut expected = vec!["t_s".to_owned()];
    for quantity in ["q", "dq", "q_est", "dq_est", "u"] {
        expected.extend((1..=12).map(|k| format!("{quantity}_{k}")));
    }
    expected.extend("x y z qw qx qy qz vx vy vz wx wy wz".split(' ').map(str::to_owned));
    for finger in 1..=3 {
        let quantities = "f_N lambda_x lambda_z dr foot_x foot_z".split(' ');
        expected.extend(quantities.map(|quantity| format!("{quantity}_{finger}")));
    }
    let energies = "energy kinetic elastic weight approach attitude integral frame frame_turn motors damping indentation torsion friction pushes";
    expected.extend(energies.split(' ').map(|name| format!("{name}_j")));
    expected.push("mode".to_owned());
    assert_eq!(header, expected);
    assert_eq!(lines.clone().count(), 301, "a row a control tick, and the start");
    assert!(lines.clone().all(|line| line.split(',').count() == header.len()));
    assert!(lines.all(|line| line.ends_with(",grasping")));

    let scene = Path::new(&first).join("scene.toml");
    let output = blindgrasp(&["sim", scene.to_str().expect("UTF-8"), "--out", &second]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let again = fs::read_to_string(Path::new(&second).join("trace.csv")).expect("a trace");
    assert!(trace == again, "the effective scene reproduces the run, byte for byte");
}

#[test]
fn another_run_is_overwritten_only_by_force() {
    let folder = Folder::new();
    folder.write("notes.txt", "mine");
    let out = folder.path("");
    assert_refused(&["sim", "prism", "--duration", "0.01", "--out", &out], &["not empty", "--force"]);
    let output = blindgrasp(&["sim", "prism", "--duration", "0.01", "--out", &out, "--force"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(Path::new(&folder.path("summary.json")).exists());
    assert_eq!(folder.read("notes.txt"), "mine", "other files stay");
}

#[test]
fn what_can_not_be_written_is_said_after_the_summary() {
    let folder = Folder::new();
    // A file where a directory has to be: this stops root too.
    let blocked = folder.write("file", "") + "/run";
    let output = blindgrasp(&["sim", "prism", "--duration", "0.01", "--json", "--out", &blocked]);
    assert_eq!(output.status.code(), Some(2));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("the summary is printed all the same");
    assert_eq!(summary["scene"], "prism");
    let error = text(&output.stderr);
    assert!(error.contains(&blocked) && error.lines().count() == 1, "{error}");
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_said_after_the_summary_and_what_was_there_stays() {
    let folder = Folder::new();
    folder.write("run/trace.csv", "an old one");
    // No file may be longer than 4 KiB; a write beyond that is an error, and no signal.
    let output = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_blindgrasp")])
        .args(["sim", "prism", "--duration", "0.05", "--force", "--out", &folder.path("run")])
        .output()
        .expect("the command starts");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stdout).contains("prism"), "the summary is printed all the same");
    let error = text(&output.stderr);
    assert!(error.contains("File too large") && error.contains("nothing is written"), "{error}");
    assert_eq!(folder.read("run/trace.csv"), "an old one");
    assert_eq!(fs::read_dir(folder.path("")).expect("a folder").count(), 1);
}

/// What is no file is not taken for one that may be replaced.
#[cfg(target_os = "linux")]
#[test]
fn a_device_in_a_folder_is_not_replaced() {
    let folder = Folder::new();
    fs::create_dir(folder.path("run")).expect("a directory");
    std::os::unix::fs::symlink("/dev/null", folder.path("run/trace.csv")).expect("a link");
    let output = blindgrasp(&["sim", "prism", "--duration", "0.05", "--force", "--out", &folder.path("run")]);
    let error = text(&output.stderr);
    assert!(error.contains("trace.csv: it is a device or a socket, not a file"), "{error}");
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read_dir(folder.path("run")).expect("a folder").count(), 1);
}

#[test]
fn usage_errors_have_exit_code_2() {
    for arguments in [
        &[][..],
        &["sim"],
        &["sin", "cube"],
        &["sim", "cube", "--durations", "1"],
        &["sim", "cube", "--force"],
    ] {
        assert_eq!(blindgrasp(arguments).status.code(), Some(2), "{arguments:?}");
    }
    assert_eq!(blindgrasp(&["--version"]).status.code(), Some(0));
}

#[test]
fn settings_that_are_none_are_refused() {
    assert_refused(
        &["sim", "cube", "--set", "control.forc_n=4"],
        &["control.forc_n", "did you mean", "force_n"],
    );
    assert_refused(&["sim", "cube", "--set", "control.force_n"], &["--set", "control.force_n"]);
    assert_refused(&["sim", "cube", "--set", "control.force_n=strong"], &["control.force_n"]);
    assert_refused(&["sim", "cube", "--set", "control.force_n=nan"], &["control.force_n"]);
    assert_refused(&["sim", "cube", "--duration", "-1"], &["duration_s"]);
    assert_refused(&["sim", "cube", "--duration", "nan"], &["duration_s"]);
    assert_refused(&["sim", "cubes"], &["cubes", "cube"]);
    assert_refused(&["sim", "nowhere/scene.toml"], &["nowhere/scene.toml"]);
}

/// The shipped scene in one file, to be damaged.
fn whole_scene() -> String {
    let folder = Folder::new();
    let out = folder.path("run");
    assert_eq!(blindgrasp(&["sim", "cube", "--duration", "0.01", "--out", &out]).status.code(), Some(0));
    folder.read("run/scene.toml")
}

#[test]
fn bad_scene_files_are_refused_with_file_key_and_remedy() {
    let folder = Folder::new();
    let whole = whole_scene();
    let cases: &[(&str, &str, &str, &[&str])] = &[
        ("broken TOML", "[control]", "[control", &["bad.toml:"]),
        ("unknown key", "soft_start_s", "soft_strat_s", &["soft_strat_s", "did you mean", "soft_start_s"]),
        ("another format", "schema = 1", "schema = 99", &["schema", "99"]),
    ];
    for (what, from, to, words) in cases {
        assert!(whole.contains(from), "{what}: the scene has no `{from}`");
        let path = folder.write("bad.toml", whole.replacen(from, to, 1));
        assert_refused(&["sim", &path], &[&["bad.toml"], *words].concat());
    }
    // Zero fingers: no fingertip, no contact.
    let start = whole.find("[[hand.fingertip]]").expect("fingertips");
    let end = whole[start..].find("\n[object]").map_or(whole.len(), |at| start + at);
    let fingerless = whole[..start].to_owned() + &whole[end..];
    let path = folder.write("bad.toml", &fingerless);
    assert_refused(&["sim", &path], &["bad.toml", "fingertip"]);
    // Not text at all.
    let path = folder.write("bad.toml", [0xff, 0xfe, 0x00, 0x80]);
    assert_refused(&["sim", &path], &["bad.toml"]);
    assert_refused(&["sim", &folder.path("missing.toml")], &["missing.toml"]);
}

/// An inertia that no body has is a warning while it can be simulated, an error when not.
#[test]
fn impossible_inertias_warn_or_are_refused() {
    let odd = "object.inertia_kg_m2=[1e-6, 1e-6, 5e-6]";
    let output = blindgrasp(&["sim", "cube-ideal", "--duration", "0.01", "--set", odd]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("warning"), "{}", text(&output.stderr));
    assert_refused(
        &["sim", "cube-ideal", "--set", "object.inertia_kg_m2=[1e-6, 1e-6, -1e-6]"],
        &["object.inertia_kg_m2"],
    );
}

/// From a mesh to an object in a scene, as a new user does it.
#[test]
fn objects_are_checked_and_made_from_meshes() {
    let folder = Folder::new();
    // A tetrahedron in millimetres, whose last triangle shows its inside.
    let corners = [[0, 0, 0], [40, 0, 0], [0, 40, 0], [0, 0, 40]];
    let mut mesh = "solid\n".to_owned();
    for triangle in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 3, 2]] {
        mesh += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in triangle.map(|k: usize| corners[k]) {
            mesh += &format!("vertex {x} {y} {z}\n");
        }
        mesh += "endloop\nendfacet\n";
    }
    let mesh = folder.write("part.stl", &(mesh + "endsolid\n"));
    assert_refused(
        &["object", "check", &mesh],
        &["part.stl: a mesh file does not say its unit", "--unit mm if it measures 40 x 40 x 40 mm"],
    );
    assert_refused(&["object", "check", &folder.path("no.stl"), "--unit", "mm"], &["no.stl: no such file"]);
    let output = blindgrasp(&["object", "check", &mesh, "--unit", "mm"]);
    let shown = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    for words in [
        "4 of 4 triangles",
        "volume                10.67 cm^3",
        "1 triangle that showed their inside turned over",
        "good: 1 notice",
    ] {
        assert!(shown.contains(words), "no `{words}` in {shown}");
    }

    let output =
        blindgrasp(&["object", "new", &mesh, "--unit", "mm", "--density-kg-m3", "20", "--name", "my part"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let made = folder.path("part.toml");
    let file = fs::read_to_string(&made).expect("the file");
    assert!(
        file.contains("name = \"my part\"")
            && file.contains("file = \"part.stl\"")
            && file.contains("unit = \"mm\""),
        "{file}"
    );
    let output = blindgrasp(&["object", "new", &mesh, "--unit", "mm", "--mass-kg", "1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("part.toml: is there already; choose another with --out"));
    let output = blindgrasp(&["object", "check", &made, "--json"]);
    let check: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(check["verdict"], "good");
    assert_eq!(check["faces"].as_array().map(Vec::len), Some(4));
    let mass = check["body"]["mass_kg"].as_f64().expect("a mass");
    assert!((mass / (20.0 * 64e-6 / 6.0) - 1.0).abs() < 1e-9, "{mass}");

    // Broken: exit code 1, nothing written.
    let open = fs::read_to_string(&mesh).expect("the mesh").replacen("vertex 40 0 0", "vertex 41 0 0", 1);
    let open = folder.write("open.stl", &open);
    let output = blindgrasp(&["object", "new", &open, "--unit", "mm", "--mass-kg", "1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("it is not closed"), "{}", text(&output.stderr));
    assert!(!Path::new(&folder.path("open.toml")).exists());
}
