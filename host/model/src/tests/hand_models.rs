//! Hands without a scene: what a firmware is built with, and what is said of a file that it can't be built with.

use super::*;
use crate::{HandModel, Safety};
use blindgrasp_body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp_shared::model::{decode, torques_per_volt_nm_v};

fn hand_text() -> &'static str {
    Kind::Hand.built_in().iter().find(|(name, _)| *name == "three-finger").unwrap().1
}

/// The whole message, for a hand whose text is changed in one place, without the folder it is in.
fn message(from: &str, to: &str) -> String {
    assert!(hand_text().contains(from), "{from}");
    let folder = std::env::temp_dir().join(format!("blindgrasp-hand-test-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("h.toml");
    std::fs::write(&path, hand_text().replacen(from, to, 1)).unwrap();
    let error = HandModel::load(path.to_str().unwrap()).expect_err("has to be refused").to_string();
    std::fs::remove_dir_all(&folder).unwrap();
    error.replace(path.to_str().unwrap(), "h.toml")
}

fn line(of: &str) -> usize {
    1 + hand_text().lines().position(|line| line.contains(of)).unwrap()
}

#[test]
fn shipped_hands_are_models_without_warnings() {
    let sizes = [
        ("three-finger", (12, 3)),
        ("hand-arm", (18, 3)),
        ("two-finger", (8, 2)),
        ("four-finger", (16, 4)),
        ("allegro-like", (16, 4)),
    ];
    assert!(HandFile::built_in().eq(sizes.iter().map(|(name, _)| *name)));
    for (name, size) in sizes {
        let model = HandModel::load(name).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(model.name, name);
        assert_eq!((model.hand.joint_count(), model.hand.fingertip_count()), size);
        assert_eq!(model.joint_names.len(), size.0);
        assert_eq!(model.warnings, Vec::<String>::new());
    }
}

/// The scenes with the experiment's model say the same as the hand itself, but for what only a real hand has.
#[test]
fn a_model_has_the_configuration_of_its_experiments() {
    for name in Scene::built_in() {
        let scene = load(name, &[]).unwrap();
        // Those with friction are no experiments of the hands' files: palm down, with forces of their own.
        if scene.sensors.ideal || scene.plant.has_friction() {
            continue;
        }
        let model = HandModel::load(&scene.file.hand.name).unwrap();
        assert_eq!(model.hand, scene.hand);
        let mut expected = scene.controller_config();
        // A hand closes first, and carries what it grasps; the paper's scenes begin in touch, with the law alone.
        expected.cycle = model.config.cycle;
        expected.laws.gains.frame = model.config.laws.gains.frame;
        expected.limits.gains.frame = model.config.limits.gains.frame;
        assert_eq!((expected.faults.heartbeat_ms, expected.faults.late_ticks), (None, None));
        expected.faults.heartbeat_ms = Some(250);
        expected.faults.late_ticks = Some(3);
        assert_eq!(model.config, expected);
    }
}

/// Every key of `[safety]` does something to what a firmware is built with, is refused beyond its range, and has a default
/// within it; the text that `hand new` writes is that of the defaults.
#[test]
fn safety_numbers_come_from_the_file() {
    // Postures are refused within the largest margins.
    let text = hand_text().split("\n# Postures").next().unwrap();
    let with =
        |lines: &str| text.replacen("[joint_defaults]", &format!("[safety]\n{lines}\n[joint_defaults]"), 1);
    let built_in = HandModel::parse(text, "h").unwrap();
    let written: Vec<String> =
        Safety::KEYS.iter().map(|key| format!("{} = {}", key.name, key.default)).collect();
    assert_eq!(HandModel::parse(&with(&written.join("\n")), "h").unwrap(), built_in);
    for key in Safety::KEYS {
        let default: f64 = key.default.parse().unwrap();
        assert!((key.least..=key.most).contains(&default), "{}", key.name);
        for (value, refused) in
            [(key.least, false), (key.most, false), (key.least - 1.0, true), (key.most + 1.0, true)]
        {
            match HandModel::parse(&with(&format!("{} = {value}", key.name)), "h") {
                Ok(model) => {
                    assert!(!refused, "{} = {value}", key.name);
                    assert_ne!(model.config, built_in.config, "{} = {value}", key.name);
                }
                Err(error) => {
                    assert!(refused, "{error}");
                    assert_eq!(error.key, format!("safety.{}", key.name));
                    assert_eq!(error.place.unwrap().line, line("[joint_defaults]") + 1);
                }
            }
        }
    }
}

/// The signs, zeros and scales that a person who wires a hand finds out, joint by joint, are what its firmware is built
/// with.
#[test]
fn signs_zeros_and_scales_come_from_the_file() {
    let defaults = "[joint_defaults]\nencoder_zero_count = -7\ntorque_per_volt_nm_v = 0.25";
    let text = hand_text()
        .replacen("[joint_defaults]", defaults, 1)
        .replacen("name = \"finger-1-abduct\"", "name = \"finger-1-abduct\"\nencoder_reversed = true", 1)
        .replacen(
            "name = \"finger-1-flex-1\"\n",
            "name = \"finger-1-flex-1\"\nmotor_reversed = true\nencoder_zero_count = 9\n",
            1,
        );
    let model = HandModel::parse(&text, "h").unwrap();
    let encoders = model.config.estimator.encoders;
    let signs_and_zeros = [0, 1, 2].map(|k| (encoders[k].reversed, encoders[k].zero_count));
    assert_eq!(signs_and_zeros, [(true, -7), (false, 9), (false, -7)]);
    assert_eq!(model.config.motors.reversed[..3], [false, true, false]);
    assert_eq!(model.torques_per_volt_nm_v, [0.25; 12]);
    let bytes = model.bytes();
    assert_eq!(torques_per_volt_nm_v::<12>(&bytes).unwrap()[..], model.torques_per_volt_nm_v);
    assert_eq!(*decode::<MAX_JOINTS, MAX_FINGERS>(&bytes).unwrap().config(), model.config);
    let mut turned = model.clone();
    turned.config.motors.reversed[11] = true;
    assert_ne!(turned.hash(), model.hash());
    // Unless given: the paper's amplifier, motor and gear.
    let usual = HandModel::load("three-finger").unwrap();
    assert_eq!(usual.torques_per_volt_nm_v, [1.1 * 23.4e-3 * 5.4_f32; 12]);
    assert_ne!(usual.hash(), model.hash());
    assert_eq!(
        message("encoder_counts_per_turn", "torque_per_volt_nm_v = -0.1\nencoder_counts_per_turn"),
        format!(
            "h.toml:{}: joint.1.torque_per_volt_nm_v: -0.1 is out of range; has to be between 1e-6 and 10000.0; its sign is `motor_reversed`",
            line("encoder_counts_per_turn")
        )
    );
}

/// A scene's controller has the hand's safety numbers, and so has what is written of a run.
#[test]
fn safety_numbers_act_in_a_scene_and_are_written_out() {
    let usual = load("cube", &[]).unwrap();
    let slower = load("cube", &["hand.safety.slew_s=0.02"]).unwrap();
    let slew = |scene: &Scene| scene.controller_config().limits.slew_nm_s.unwrap()[0];
    assert_eq!(slew(&slower), slew(&usual) / 2.0);
    let text = slower.effective_toml();
    assert_eq!(Safety::KEYS.iter().filter(|key| text.contains(&format!("\n{} = ", key.name))).count(), 15);
    assert_eq!(Scene::parse(&text, "again", Path::new(""), &[]).unwrap(), slower);
}

/// A firmware is built with everything that the hand's file has: the earlier law, if the hand's file asks for it.
#[test]
fn a_hand_can_have_the_earlier_law() {
    let text = hand_text().replacen(
        "attitude_stiffness_nm = 5e-3",
        "attitude_stiffness_nm = 0.0\nintegral_gain_nm_rad = 0.02",
        1,
    );
    let folder = std::env::temp_dir().join(format!("blindgrasp-earlier-law-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("h.toml");
    std::fs::write(&path, text).unwrap();
    let model = HandModel::load(path.to_str().unwrap());
    std::fs::remove_dir_all(&folder).unwrap();
    let model = model.unwrap();
    let (gains, limits) = (&model.config.laws.gains, &model.config.limits.gains);
    assert_eq!((gains.grasp[1], gains.integral), (0.0, [0.02]));
    // Four times as firmly, if a user asks for it: as with the paper's gains.
    assert_eq!((limits.grasp[1], limits.integral), (Some(0.0), [Some(0.08)]));
    let params = decode::<MAX_JOINTS, MAX_FINGERS>(&model.bytes()).unwrap();
    assert_eq!(*params.config(), model.config);
}

#[test]
fn the_same_hand_gives_the_same_bytes_wherever_it_lies() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = manifest.join("../../models/hands/three-finger.toml");
    let from_disk = HandModel::load(path.to_str().unwrap()).unwrap();
    let built_in = HandModel::load("three-finger").unwrap();
    assert_eq!(from_disk, built_in);
    assert_eq!(from_disk.bytes(), built_in.bytes());
    assert_ne!(built_in.hash(), HandModel::load("two-finger").unwrap().hash());
}

#[test]
fn hands_that_no_firmware_can_be_built_with_are_refused() {
    let gains = hand_text();
    let (begin, end) = (gains.find("[control]").unwrap(), gains.find("[joint_defaults]").unwrap());
    assert_eq!(
        message(&gains[begin..end], ""),
        "h.toml: control: the hand says nothing of its gains, which its firmware needs; add a table [control] with the \
         keys that a scene's has: force_n, attitude_stiffness_nm, ..."
    );
    assert_eq!(
        message("force_n = 5.0 ", "force_n = -5.0 "),
        format!(
            "h.toml:{}: control.force_n: -5.0 is out of range; has to be between 1e-6 and 10000.0",
            line("force_n")
        )
    );
    assert_eq!(
        message("soft_start_s", "soft_start"),
        format!(
            "h.toml:{}: control.soft_start: unknown key; did you mean `soft_start_s`?",
            line("soft_start_s")
        )
    );
    assert_eq!(
        message("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 2.0, 0.0]"),
        format!(
            "h.toml:{}: joint.2.axis: joint `finger-1-flex-1`: axis has to be a unit vector; divide it by its length",
            line("axis = [0.0, 1.0, 0.0]")
        )
    );
    assert_eq!(
        message("limits_rad = [-0.6, 0.6]", "limits_rad = [1e-9, 1.1e-9]"),
        format!(
            "h.toml:{}: joint.1.nominal_rad: 0.0 is outside the limits; has to be between 0.000000001 and 0.0000000011",
            line("name = \"finger-1-abduct\"") - 1
        )
    );
    assert_eq!(
        message("schema = 1", "schema = 2"),
        "h.toml:7: schema: 2 is a format that this program does not know; write it as format 1"
    );
    assert_eq!(
        HandModel::load("five-finger").unwrap_err().to_string(),
        "five-finger: no built-in hand is called `five-finger`; did you mean `four-finger`? (a path has to end in .toml or contain a /)"
    );
    assert_eq!(
        HandModel::load("models/no.toml").unwrap_err().to_string(),
        "models/no.toml: no such file; check the path"
    );
}

#[test]
fn gains_of_the_hand_do_not_act_in_a_scene() {
    let error = load("cube", &["hand.control.force_n=3"]).unwrap_err().to_string();
    assert_eq!(error, "--set: hand.control.force_n: acts in the firmware only; set control.force_n");
    let scene = load("cube", &["control.force_n=3"]).unwrap();
    assert_eq!(scene.controller_config().laws.gains.grasp[0], 3.0);
    // But what the firmware of its hand is, a scene still knows.
    assert_eq!(HandModel::of(&scene).unwrap(), HandModel::load("three-finger").unwrap());
}

/// Surfaces are no part of what a firmware is built with.
#[test]
fn capsules_change_no_firmware() {
    for name in HandFile::built_in() {
        let (model, mut file) = HandModel::load_with_file(name).unwrap();
        assert!(!file.capsules.is_empty());
        file.capsules.clear();
        assert_eq!(HandModel::build(&file).unwrap().bytes(), model.bytes(), "{name}");
    }
}
