//! `examples/python/stiffness_sweep.py` drives the command as a user would, and says what is wrong where it can't.

use std::path::Path;
use std::process::Command;

/// Exit code, standard output and standard error. The command is the one that is tested, unless `BLINDGRASP` is said to be
/// another.
fn sweep(arguments: &[&str], command: &str) -> (Option<i32>, String, String) {
    let output = Command::new("python3")
        .arg("examples/python/stiffness_sweep.py")
        .args(arguments)
        .env("BLINDGRASP", command)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .output()
        .expect("python3 is installed");
    let [out, err] =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).replace("\r\n", "\n"));
    (output.status.code(), out, err)
}

const COMMAND: &str = env!("CARGO_BIN_EXE_blindgrasp");

#[test]
fn it_finds_where_the_cube_is_held() {
    let file = std::env::temp_dir().join(format!("blindgrasp-sweep-{}.csv", std::process::id()));
    let path = file.to_str().expect("UTF-8");
    let gains = ["--stiffness", "0", "5e-3", "--force", "5", "--duration", "3", "--jobs", "2", "--csv", path];
    let (code, out, err) = sweep(&[&["cube-ideal"], &gains[..]].concat(), COMMAND);
    println!("{out}");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    let csv = std::fs::read_to_string(&file).expect("it is written");
    std::fs::remove_file(&file).expect("it can be removed");
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|other| *other == name).expect("a column");
    let cells = |name: &str| rows[1..].iter().map(|row| row[column(name)]).collect::<Vec<_>>();
    assert_eq!(cells("attitude_stiffness_nm"), ["0.0", "0.005"]);
    // Normal forces alone lose the cube (as the scene cube-normal-only does), the printed K_st holds it.
    assert_eq!(cells("held"), ["LOST", "yes"]);
    assert!(cells("lost_at_s")[0].parse::<f64>().is_ok_and(|t_s| (2.0..2.3).contains(&t_s)), "{csv}");
    assert_eq!(cells("lost_at_s")[1], "");
    assert!(cells("why_lost")[0].contains("rolled off its face"), "{csv}");
    // The table says the same, a line a run.
    assert_eq!(out.lines().count(), rows.len());
    assert!(out.contains("LOST") && out.lines().nth(2).is_some_and(|line| line.contains("yes")), "{out}");
}

#[test]
fn what_is_set_acts_and_the_standard_output_can_be_csv() {
    let run = |setting: &str| {
        let gains =
            ["--stiffness", "5e-3", "--force", "5", "--duration", "2", "--csv", "-", "--set", setting];
        let (code, out, err) = sweep(&[&["cube"], &gains[..]].concat(), COMMAND);
        assert_eq!((code, err.as_str()), (Some(0), ""));
        assert!(out.starts_with("attitude_stiffness_nm,") && out.lines().count() == 2, "{out}");
        out
    };
    assert!(run("friction.scale=1").contains("yes"));
    // Without friction, encoders and a tick of delay lose the cube.
    assert!(run("friction.scale=0").contains("LOST"));
}

#[test]
fn bad_input_is_told_in_a_line() {
    for (arguments, command, words) in [
        (&["no-such-scene"][..], COMMAND, "stiffness_sweep: blindgrasp: no-such-scene: no built-in scene"),
        (&["cube", "--set", "control.forces=1"], COMMAND, "did you mean `force_n`?"),
        (&["cube", "--duration", "1"], "/no/blindgrasp", "/no/blindgrasp is no program that can be run"),
        (
            &["cube", "--duration", "0.1", "--csv", "/no/folder/rows.csv"],
            COMMAND,
            "cannot write /no/folder/rows.csv",
        ),
        (&["cube", "--force", "0"], COMMAND, "0 is not a number that is above 0"),
        (&["cube", "--stiffness", "nan"], COMMAND, "nan is not a number that is at least 0"),
        (&["cube", "--jobs", "0"], COMMAND, "--jobs has to be at least 1"),
    ] {
        let (code, _, err) = sweep(arguments, command);
        assert_eq!(code, Some(2), "{arguments:?}: {err}");
        assert!(err.contains(words) && !err.contains("Traceback"), "{arguments:?}: {err}");
    }
}
