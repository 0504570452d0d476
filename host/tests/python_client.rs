//! `examples/python/blindgrasp_client.py` against a simulated hand in real time: the processes that a user would start.
#![cfg(unix)]

use crate::patient;

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// `blindgrasp serve`, and its port.
struct Served {
    child: Child,
    port: String,
}

impl Served {
    fn start(scene: &Path) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_blindgrasp"))
            .arg("serve")
            .arg(scene)
            .args(["--baud", "3000000"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the command starts");
        let mut line = String::new();
        let stdout = child.stdout.take().expect("it is piped");
        BufReader::new(stdout).read_line(&mut line).expect("it prints its port");
        let port = line.trim().strip_prefix("port ").unwrap_or_else(|| panic!("{line}")).to_owned();
        Self { child, port }
    }

    /// Exit code of the client, and what it said.
    fn client(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        let (command, rest) = arguments.split_first().expect("a command");
        let output = Command::new("python3")
            .arg("examples/python/blindgrasp_client.py")
            .args([command, "--port", &self.port])
            .args(rest)
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
            .output()
            .expect("python3 is installed");
        let [out, err] =
            [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        (output.status.code(), out, err)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_python_client_grasps_with_a_simulated_hand() {
    // Tests run beside this one: the client is not to be blamed for a machine without time.
    let folder = TempDir::new().expect("a folder");
    let served = Served::start(&patient::scene(&folder, 5000));
    let (key, value) = ("faults.heartbeat_ms", "4000");
    let (code, _, err) = served.client(&["set", key, value]);
    assert_eq!(code, Some(0), "{err}");
    let (code, out, err) = served.client(&["get", key]);
    assert_eq!((code, out.trim().parse::<f64>().ok()), (Some(0), value.parse().ok()), "{err}");
    let (code, _, err) = served.client(&["grasp", "--force", "900"]);
    assert_eq!(code, Some(1));
    assert!(
        err.contains("Grasp is refused: a value is out of its range: the limits are parameters"),
        "{err}"
    );

    let (code, out, err) = served.client(&["grasp", "--hold", "2", "--csv"]);
    assert_eq!(code, Some(0), "{err}");
    let counted: serde_json::Value = serde_json::from_str(err.lines().last().unwrap_or_default())
        .unwrap_or_else(|error| panic!("{error}: {err}"));
    println!("{counted}");
    for fine in ["lost", "damaged", "malformed"] {
        assert_eq!(counted[fine], 0, "{fine}");
    }
    let records = counted["records"].as_u64().expect("a number");
    // 2 s of grasping and 0.3 s of releasing; fewer where the hand's ticks were late and had to be left out.
    assert!(records >= 1500, "{counted}");

    let rows: Vec<Vec<&str>> = out.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len() as u64, records);
    let mut modes: Vec<&str> = rows.iter().map(|row| row[2]).collect();
    let releasing = modes.iter().filter(|&&mode| mode == "Releasing").count();
    modes.dedup();
    assert_eq!(modes, ["Disarmed", "Armed", "Grasping", "Releasing", "Moving", "Disarmed"]);
    assert_eq!(releasing, 300, "the release takes 300 ms");
    let names: Vec<&str> = out.lines().next().expect("a head").split(',').collect();
    let column = |name: &str| names.iter().position(|&other| other == name).expect("a column");
    // The force that was asked for is there after the soft start.
    let force_n = column("force_n");
    assert!(rows.iter().any(|row| row[2] == "Grasping" && row[force_n] == "5"));
    let (first, last) = (column("count_0"), column("count_11"));
    assert!(rows.iter().all(|row| row[first..=last].iter().all(|count| count.parse::<i32>().is_ok())));
    // The fingers close.
    assert_ne!(rows[0][first..=last], rows[rows.len() / 2][first..=last]);
}

#[test]
fn the_python_client_picks_up_what_lies_before_a_simulated_hand() {
    let served = Served::start(Path::new("pick-cube"));
    let (code, out, err) =
        served.client(&["pick", "--posture", "1", "--move", "0,0,-15", "--turn", "0,0,20", "--csv"]);
    assert_eq!(code, Some(0), "{err}");
    let told: Vec<&str> = err.lines().filter(|line| !line.starts_with('{')).collect();
    let wanted = [
        "the posture is reached",
        "all fingertips touch: the grasp begins",
        "the grasp is at its force: what is held can be moved",
        "the target is where it was to go",
        "it stands on something",
        "the grasp is let go",
    ];
    assert_eq!(told, wanted, "{err}");
    // It was up there, as the hand knows it.
    let names: Vec<&str> = out.lines().next().expect("a head").split(',').collect();
    let column = names.iter().position(|&name| name == "object_z_m").expect("a column");
    let heights_m = out
        .lines()
        .skip(1)
        .map(|row| row.split(',').nth(column).expect("a cell").parse::<f64>().expect("a number"));
    let highest_m = heights_m.fold(0.0, f64::min);
    assert!((-0.02..=-0.012).contains(&highest_m), "{highest_m}");
}
