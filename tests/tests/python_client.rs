//! `examples/python/blindgrasp_client.py`, written from `docs/protocol.md` alone, against the test vectors and the emulated
//! firmware. Against a simulated hand in real time: `host/tests/python_client.rs`.
//!
//!     cargo test --release -p blindgrasp-tests --features firmware --test science python_client -- --show-output
#![cfg(unix)]

use blindgrasp_tests::images::root;
use std::fs;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const VECTORS: &str = "tests/data/wire/vectors.json";
/// Longest time that the client may take; it has limits of its own, which are shorter.
const PATIENCE: Duration = Duration::from_secs(180);

/// Runs the client.
fn client(arguments: &[&str]) -> Output {
    let mut child = Command::new("python3")
        .arg("examples/python/blindgrasp_client.py")
        .args(arguments)
        .current_dir(root())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("python3 is installed");
    // Read at once, because a full pipe would make it wait.
    let pipes = [
        read_on(child.stdout.take().expect("it is piped")),
        read_on(child.stderr.take().expect("it is piped")),
    ];
    let deadline = Instant::now() + PATIENCE;
    let status = loop {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            break status;
        }
        if Instant::now() > deadline {
            let _ = child.kill();
            panic!("{arguments:?} does not end");
        }
        thread::sleep(Duration::from_millis(10));
    };
    let [stdout, stderr] = pipes.map(|pipe| pipe.join().expect("it was read"));
    Output { status, stdout, stderr }
}

fn read_on(mut pipe: impl std::io::Read + Send + 'static) -> thread::JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.read_to_end(&mut bytes);
        bytes
    })
}

/// Its exit code, and what it said on the standard output and the standard error.
fn said(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = client(arguments);
    let [out, err] =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    (output.status.code(), out, err)
}

/// Returns the client's output when all went well.
fn done(arguments: &[&str]) -> (String, String) {
    let (code, out, err) = said(arguments);
    assert_eq!(code, Some(0), "{arguments:?}: {out}{err}");
    (out, err)
}

#[test]
fn it_decodes_and_encodes_every_vector() {
    let (out, _) = done(&["--self-test", VECTORS]);
    println!("{}", out.trim());
    assert!(out.starts_with("ok: "));
}

#[test]
fn its_self_test_can_fail() {
    let folder = std::env::temp_dir().join(format!("blindgrasp-vectors-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("vectors.json");
    let vectors = fs::read_to_string(root().join(VECTORS)).expect("the vectors are there");
    // One character of each kind of vector.
    let changes = [
        ("\"payload\":\"01b424", "\"payload\":\"02b424"),
        ("\"why\":\"TooShort\"", "\"why\":\"BadCrc\""),
        ("\"digest\":", "\"digest\":1"),
        ("\"interface_version\": 6", "\"interface_version\": 3"),
    ];
    for (from, to) in changes {
        assert!(vectors.contains(from), "{from}");
        fs::write(&path, vectors.replacen(from, to, 1)).expect("it can be written");
        let (code, out, err) = said(&["--self-test", &path.to_string_lossy()]);
        assert_eq!((code, out.as_str()), (Some(1), ""), "{from}: {err}");
    }
    fs::write(&path, "[").expect("it can be written");
    assert_eq!(said(&["--self-test", &path.to_string_lossy()]).0, Some(2));
    fs::remove_dir_all(&folder).expect("it can be removed");
}

#[test]
fn bad_input_is_told() {
    for (arguments, words) in [
        (vec![], "a command or --self-test is needed"),
        (vec!["info"], "--port"),
        (vec!["info", "--port", "/dev/no-such-port"], "cannot open /dev/no-such-port: No such file"),
        (vec!["info", "--port", "unix:/no/socket"], "cannot open unix:/no/socket: No such file"),
        (vec!["info", "--port", "/dev/null"], "/dev/null is not a serial port"),
        (
            vec!["get", "--port", "/dev/null", "force"],
            "there is no parameter force; there are damping_nm_s, ",
        ),
        (vec!["get", "--port", "/dev/null", "limits.torque_nm[x]"], "an index is a number in brackets"),
        (vec!["set", "--port", "/dev/null", "force_n", "nan"], "nan is not a finite number"),
        (vec!["watch", "--port", "/dev/null", "--decimation", "0"], "--decimation is from 1 to 65535"),
        (vec!["pil"], "pil needs either --image or --port"),
        (vec!["pil", "--image", "/no/image"], "there is no image /no/image"),
        (vec!["--self-test", "/no/vectors"], "/no/vectors: "),
    ] {
        let (code, out, err) = said(&arguments);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {err}");
        assert!(err.contains(words), "{arguments:?}: {err}");
    }
}

#[cfg(feature = "firmware")]
mod emulated {
    use super::*;
    use blindgrasp::model::HandModel;
    use blindgrasp_tests::images::{DEFAULT_HAND, kept_image};
    use std::path::Path;
    use std::process::Child;
    use tempfile::TempDir;

    /// A clock that follows the instructions, 16 ns each, and not the time here: on a busy machine the firmware would
    /// otherwise have to make up for ticks, and its queue would be full.
    const STEADY: &str = "-icount shift=4,sleep=off";

    /// An image in QEMU, with its serial port as a socket. It is gone with this value, and with this process.
    struct Emulated {
        shell: Child,
        folder: TempDir,
    }

    impl Emulated {
        fn start(image: &Path, options: &str) -> Self {
            let folder = TempDir::with_prefix("blindgrasp-").expect("a folder for a socket");
            // The end of its input says that nobody needs it any more.
            let script = format!(
                "qemu-system-arm -M netduinoplus2 -nographic -monitor none -serial null \
                 -serial unix:uart,server=on,wait=off {options} -kernel \"$0\" </dev/null >/dev/null & \
                 read -r line; kill -9 $!"
            );
            let shell = Command::new("sh")
                .args(["-c", &script])
                .arg(image)
                .current_dir(folder.path())
                .stdin(Stdio::piped())
                .spawn()
                .expect("sh starts");
            let emulated = Self { shell, folder };
            let deadline = Instant::now() + Duration::from_secs(20);
            while !emulated.folder.path().join("uart").exists() {
                assert!(Instant::now() < deadline, "QEMU does not start");
                thread::sleep(Duration::from_millis(5));
            }
            emulated
        }

        fn port(&self) -> String {
            format!("unix:{}", self.folder.path().join("uart").display())
        }
    }

    impl Drop for Emulated {
        fn drop(&mut self) {
            drop(self.shell.stdin.take());
            let _ = self.shell.wait();
        }
    }

    /// The last line, as JSON.
    fn last(text: &str) -> serde_json::Value {
        let line = text.lines().last().unwrap_or_default();
        serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {text}"))
    }

    /// Asserts that a grasp in lockstep went as it should.
    fn assert_grasped(out: &str) {
        let result = last(out);
        println!("{result}");
        let modes = ["Disarmed", "Armed", "Grasping", "Releasing", "Armed", "Disarmed"];
        assert_eq!(result["modes"], serde_json::json!(modes));
        // One more is that of the hello.
        assert_eq!((&result["ticks"], &result["records"]), (&1500.into(), &1501.into()));
        for fine in ["lost", "damaged", "malformed"] {
            assert_eq!(result[fine], 0, "{fine}");
        }
        let torque_nm = &result["largest_torque_nm"];
        assert_eq!(torque_nm["Disarmed"], 0.0);
        // 1 N at fingers of some 0.15 m: a tenth of a newton metre.
        let grasping_nm = torque_nm["Grasping"].as_f64().expect("a number");
        assert!((0.01..1.0).contains(&grasping_nm), "{grasping_nm} N m");
    }

    #[test]
    fn it_is_the_joints_of_the_processor_in_the_loop() {
        let image = kept_image("pil", DEFAULT_HAND);
        let begun = Instant::now();
        let (out, _) = done(&["pil", "--image", &image.to_string_lossy()]);
        println!("pipes: {:.0} ticks a second", 1500.0 / begun.elapsed().as_secs_f64());
        assert_grasped(&out);
    }

    #[test]
    fn and_so_over_the_serial_port() {
        let options = "-semihosting-config enable=on,target=native,arg=uart";
        let emulated = Emulated::start(&kept_image("pil", DEFAULT_HAND), options);
        let (out, _) = done(&["pil", "--port", &emulated.port()]);
        assert_grasped(&out);
        // The same firmware goes on; another number of joints than the hand's is told.
        let (code, _, err) = said(&["pil", "--port", &emulated.port(), "--joints", "4"]);
        assert_eq!(code, Some(1));
        assert!(err.contains("the hand `three-finger` has 12 joints: tell so with --joints"), "{err}");
    }

    #[test]
    fn it_talks_to_the_hand() {
        let emulated = Emulated::start(&kept_image("hand", DEFAULT_HAND), STEADY);
        let port = emulated.port();
        let ask = |arguments: &[&str]| {
            let (command, rest) = arguments.split_first().expect("a command");
            said(&[&[*command, "--port", &port], rest].concat())
        };
        let (code, out, err) = ask(&["info"]);
        assert_eq!(code, Some(0), "{err}");
        let identity: serde_json::Value = serde_json::from_str(&out).expect("an object");
        let model = HandModel::load("three-finger").expect("it is built in");
        assert_eq!(
            (&identity["image"]["hand"], &identity["image"]["kind"]),
            (&"three-finger".into(), &"hand".into())
        );
        assert_eq!(identity["image"]["hand_hash"], model.hash());
        assert_eq!(identity["clock"], "Emulated");

        // There are no encoders: fault 1, and no arming.
        let (code, out, err) = ask(&["grasp", "--hold", "1"]);
        assert_eq!(code, Some(1));
        assert!(err.contains("Arm is refused: the hand is in a fault: clear it first"), "{err}");
        assert!(out.contains("Fault, fault 1: joint 0: encoder gave no sample"), "{out}");
        let (code, _, err) = ask(&["clear"]);
        assert_eq!(code, Some(1));
        assert!(err.contains("the cause of the fault is still there"), "{err}");

        let (code, out, err) = ask(&["get", "limits.torque_nm[3]"]);
        assert_eq!(code, Some(0), "{err}");
        let told: f32 = out.trim().parse().unwrap_or_else(|_| panic!("no number: {out}"));
        assert_eq!(Some(told), model.config.limits.torque_nm.map(|limits| limits[3]));
        let (code, _, err) = ask(&["get", "limits.torque_nm[12]"]);
        assert_eq!(code, Some(1));
        assert!(err.contains("this hand has no parameter with this index"), "{err}");
        let (code, _, err) = ask(&["set", "force_n", "2"]);
        assert_eq!(code, Some(1));
        assert!(err.contains("set while the hand is disarmed"), "{err}");

        for arguments in
            [&["watch", "--seconds", "2", "--csv"][..], &["watch", "--seconds", "2", "--csv", "--all"]]
        {
            let (code, out, err) = ask(arguments);
            assert_eq!(code, Some(0), "{err}");
            let counted = last(&err);
            println!("{arguments:?}: {counted}");
            let number = |key: &str| counted[key].as_u64().expect("a number");
            // How many there are in 2 s depends on what else this machine does.
            assert!(number("records") >= 200, "{counted}");
            for fine in ["lost", "damaged", "malformed"] {
                assert_eq!(number(fine), 0, "{fine}");
            }
            let all = arguments.len() == 5;
            assert!(all || number("inputs") == 0, "{counted}");
            assert_eq!(number("snapshots") > 0, all, "{counted}");
            // A line each, with as many cells as the head has.
            let cells: Vec<usize> = out.lines().map(|line| line.split(',').count()).collect();
            assert_eq!(cells.len() as u64, number("records") + 1);
            assert!(cells.iter().all(|&count| count == cells[0]), "{out}");
            let ticks: Vec<u64> =
                out.lines().skip(1).map(|line| line.split(',').nth(1).unwrap().parse().unwrap()).collect();
            // Those between are told of by input records, if they were asked for.
            let apart = ticks.windows(2).map(|pair| pair[1] - pair[0] - 1).sum::<u64>();
            assert!(!all || apart <= number("inputs"), "{counted}: {ticks:?}");
        }

        // What led to the fault, from the first tick on.
        let (code, out, err) = ask(&["burst", "--csv"]);
        assert_eq!(code, Some(0), "{err}");
        let modes: Vec<&str> = out.lines().skip(1).map(|line| line.split(',').nth(2).unwrap()).collect();
        assert!(
            modes.len() >= 64 && modes[modes.len() - 64..].iter().all(|&mode| mode == "Fault"),
            "{modes:?}"
        );
        assert!(modes[..modes.len() - 64].iter().all(|&mode| mode != "Fault"), "{modes:?}");
        assert_eq!(ask(&["stop"]).0, Some(0));
    }
}
