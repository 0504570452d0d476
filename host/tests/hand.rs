//! `blindgrasp hand` as a user meets it: a URDF, a hand's file for it, and back.

use crate::folder::Folder;
use std::fs;
use std::path::Path;

/// From a hand to a URDF, to a hand's file with guessed gains, to a grasp that settles.
#[test]
fn a_urdf_becomes_a_hand_that_grasps() {
    let folder = Folder::new();
    let (_, said) = folder.done(&["hand", "export", "three-finger", "--urdf", "--out", "my.urdf"]);
    assert_eq!(said, "blindgrasp: wrote my.urdf\n");
    let (out, said) = folder.done(&["hand", "new", "my.urdf"]);
    assert!(out.is_empty());
    assert!(said.ends_with("blindgrasp: wrote my.toml\n"), "{said}");
    assert_eq!(said.lines().filter(|line| line.starts_with("blindgrasp: guessed: ")).count(), 4, "{said}");
    assert!(folder.read("my.toml").contains("file = \"my.urdf\"\n"));
    for scene in ["cube", "prism"] {
        let settings = ["hand=./my.toml", "control.force_n=5", "control.attitude_stiffness_nm=5e-3"];
        let mut arguments = vec!["sim", scene, "--json"];
        arguments.extend(settings.iter().flat_map(|setting| ["--set", *setting]));
        let (out, said) = folder.done(&arguments);
        assert_eq!(said, "");
        assert!(out.contains("\"settled\":true") && out.contains("\"grasp_held\":true"), "{out}");
    }
    // The effective scene needs neither file.
    folder.done(&["sim", "cube", "--set", "hand=./my.toml", "--out", "run"]);
    fs::remove_file(folder.path("my.urdf")).expect("a file");
    folder.done(&["sim", "run/scene.toml", "--duration", "0.1"]);
}

/// The same text on stdout and in a file; the file of a hand in another folder names the URDF from there.
#[test]
fn files_name_each_other_wherever_they_are() {
    let folder = Folder::new();
    for name in ["parts", "hands"] {
        fs::create_dir(folder.path(name)).expect("a folder");
    }
    let (out, said) = folder.done(&["hand", "export", "two-finger", "--urdf"]);
    assert_eq!(said, "");
    folder.done(&["hand", "export", "two-finger", "--urdf", "--out", "parts/two.urdf"]);
    assert_eq!(out, folder.read("parts/two.urdf"));
    for (toml, file) in [("two.toml", "parts/two.urdf"), ("parts/two.toml", "two.urdf")] {
        folder.done(&["hand", "new", "parts/two.urdf", "--out", toml]);
        assert!(folder.read(toml).contains(&format!("file = \"{file}\"\n")), "{}", folder.read(toml));
        folder.done(&["hand", "export", &format!("./{toml}"), "--urdf"]);
    }
    folder.done(&["hand", "new", "./parts/two.urdf", "--out", "hands/two.toml"]);
    assert!(folder.read("hands/two.toml").contains("file = \"../parts/two.urdf\"\n"));
    folder.done(&["hand", "export", "hands/two.toml", "--urdf"]);
    let absolute = &folder.path("parts/two.urdf");
    folder.done(&["hand", "new", absolute, "--out", "hands/absolute.toml"]);
    assert!(folder.read("hands/absolute.toml").contains(&format!("file = \"{absolute}\"\n")));
    folder.done(&["hand", "export", "hands/absolute.toml", "--urdf"]);
    // Beside it, where it can move with it.
    folder.done(&["hand", "new", absolute, "--force"]);
    assert!(folder.read("parts/two.toml").contains("file = \"two.urdf\"\n"));
}

#[test]
fn nothing_is_overwritten_unasked() {
    let folder = Folder::new();
    folder.done(&["hand", "export", "two-finger", "--urdf", "--out", "a.urdf"]);
    folder.write("a.toml", "mine");
    let expected =
        "blindgrasp: a.toml: is there already; choose another with --out, or overwrite it with --force";
    assert_eq!(folder.refused(&["hand", "new", "a.urdf"], &[]), expected);
    assert_eq!(folder.read("a.toml"), "mine");
    let again = folder.refused(&["hand", "export", "two-finger", "--urdf", "--out", "a.urdf"], &[]);
    assert_eq!(again, expected.replace("a.toml", "a.urdf"));
    folder.done(&["hand", "new", "a.urdf", "--force"]);
    folder.done(&["hand", "export", "two-finger", "--urdf", "--out", "a.urdf", "--force"]);
    // What can't be used is not written.
    folder.write("b.urdf", "<robot name=\"b\"><link name=\"a\"/></robot>");
    folder.refused(&["hand", "new", "b.urdf"], &[]);
    assert!(!Path::new(&folder.path("b.toml")).exists());
}

#[test]
fn mistakes_are_one_line() {
    let folder = Folder::new();
    folder.done(&["hand", "export", "two-finger", "--urdf", "--out", "a.urdf"]);
    let cases: [(&[&str], &str); 6] = [
        (&["hand", "new", "none.urdf"], "blindgrasp: none.urdf: no such file; check the path"),
        (
            &["hand", "export", "a.urdf", "--urdf"],
            "blindgrasp: a.urdf: a URDF alone is not a hand: it has no fingertips and gains; `blindgrasp hand new a.urdf` writes a hand's file that names it",
        ),
        (
            &["sim", "cube", "--set", "hand=a.urdf"],
            "blindgrasp: --set: hand: a URDF alone is not a hand: it has no fingertips and gains; `blindgrasp hand new a.urdf` writes a hand's file that names it",
        ),
        (
            &["hand", "export", "three-fingers", "--urdf"],
            "blindgrasp: three-fingers: no built-in hand is called `three-fingers`; did you mean `three-finger`? (a path has to end in .toml or contain a /)",
        ),
        (&["hand", "new", "a.urdf", "--lock", "finger-1-flex-1"], "write JOINT=RAD, such as wrist=0.3"),
        (&["hand", "new", "a.urdf", "--fingertip", "a:1,2"], "`1,2` is not x,y,z: three numbers, m"),
    ];
    for (arguments, expected) in cases {
        let error = folder.refused(arguments, &[]);
        if expected.starts_with("blindgrasp: ") {
            assert_eq!(error, expected, "{arguments:?}");
        } else {
            // Told by the parser of the command line, with its usage.
            assert!(error.contains(expected), "{arguments:?}: {error}");
        }
    }
}

/// Margins are told, gains with more are printed and written nowhere, and what can't be tuned is one line.
#[test]
fn tuned_gains_are_told() {
    let folder = Folder::new();
    let (out, said) = folder.done(&["hand", "tune", "two-finger", "--json"]);
    assert!(said.is_empty(), "{said}");
    let report: serde_json::Value = serde_json::from_str(&out).expect("it is JSON");
    let margin = |of: &serde_json::Value| of["margins"]["delay_margin_ticks"].as_f64();
    assert!(margin(&report).is_none_or(|ticks| ticks < 0.0), "the printed gains have none: {report}");
    assert!(margin(&report["tuned"]).is_some_and(|ticks| ticks >= 0.5), "{report}");
    assert_eq!(report["tuned"]["damping_nm_s_rad"].as_array().map(Vec::len), Some(8), "{report}");
    let (out, _) = folder.done(&["hand", "tune", "two-finger"]);
    assert!(out.contains("delay margin, ticks") && out.contains("estimator_bandwidth_hz = "), "{out}");
}
