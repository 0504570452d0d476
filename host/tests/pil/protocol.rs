//! Messages of the link, and the answers to wrong ones.

use super::device::{Firmware, PATIENCE, Wrong};
use blindgrasp::device::client::Client;
use blindgrasp::model::{HandModel, Scene};
use blindgrasp::record::compare::Value;
use blindgrasp::rig::pil::{Linked, PilError, Pilot, Plan};
use blindgrasp::sim::{Run, Simulation};
use blindgrasp_shared::parameters::Parameter;
use std::time::{Duration, Instant};

/// Ticks before the grasp of a scene: hello, what it changes, 11 parameters of the hand, 9 of each of 12 joints, 3 of
/// gravity, a heartbeat, arming; the slew limit and what else is switched off is asked for, too.
fn ticks_before(scene: &Scene) -> u32 {
    use blindgrasp_shared::parameters::Each;
    let joints = scene.joints.len() as u32;
    let asked: u32 = Parameter::ALL
        .iter()
        .map(|parameter| match parameter.each() {
            Each::Hand => 1,
            Each::Joint => joints,
            Each::Axis => 3,
        })
        .sum();
    asked + changed(scene) + 3
}

/// Parameters that are other in a scene than in its hand's file, and are set.
fn changed(scene: &Scene) -> u32 {
    let hand = HandModel::of(scene).expect("a hand");
    let params = |config| hand.params(config).expect("parameters");
    let (ours, theirs) = (params(&scene.controller_config()), params(&hand.config));
    let all = Parameter::ALL
        .into_iter()
        .flat_map(|parameter| (0..parameter.count(scene.joints.len())).map(move |index| (parameter, index)));
    let is_changed = |&(parameter, index): &(Parameter, u8)| {
        let (Ok(ours), Ok(theirs)) = (ours.get(parameter, index), theirs.get(parameter, index)) else {
            return false;
        };
        // The file says the most that may be asked for.
        match parameter.key().to_string().starts_with("limits.") {
            true => ours.value < theirs.value,
            false => ours.value != theirs.value,
        }
    };
    all.filter(is_changed).count() as u32
}

fn scene(settings: &[&str]) -> Scene {
    let mut settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    settings.push("duration_s=0.25".to_owned());
    Scene::load("cube", &settings).expect("a scene")
}

fn run(scene: &Scene, wrong: Wrong) -> (Result<Run, PilError>, Simulation<Pilot<Linked<Firmware>>>) {
    let plan = Plan::new(scene).expect("a plan");
    let client = Client::new(Firmware::new(scene, wrong), PATIENCE);
    let linked = Linked::connect(&plan, client).expect("a firmware");
    let mut simulation = Simulation::with_controller(scene, Pilot::new(&plan, linked)).expect("a simulation");
    (simulation.try_run(), simulation)
}

/// The error of a run, and how long it took until it was there.
fn error(settings: &[&str], wrong: Wrong) -> String {
    let scene = scene(settings);
    let begun = Instant::now();
    let (run, _) = run(&scene, wrong);
    assert!(begun.elapsed() < Duration::from_secs(30), "{wrong:?}");
    run.expect_err("an error").to_string()
}

fn assert_says(error: &str, words: &[&str]) {
    for word in words {
        assert!(error.contains(word), "no `{word}` in: {error}");
    }
}

/// The same samples as of a simulation without a firmware, to the bit: with noise, whatever the firmware has done before the
/// grasp leaves no trace; with other gains and limits, none looser than the firmware's own, they have arrived.
#[test]
fn a_run_is_that_of_a_simulation() {
    let others = [
        "sensors.noise_counts=0.4",
        "control.force_n=16",
        "control.attitude_stiffness_nm=1e-3",
        "control.damping_scale=1.5",
        "control.soft_start_s=0.4",
        "control.estimator_bandwidth_hz=70",
        "plant.gravity_m_s2=[0.0, 1.0, -9.0]",
        "hand.joint.*.encoder_reversed=true",
        "hand.joint.*.encoder_zero_count=-300",
    ];
    for settings in [&[][..], &others] {
        let scene = scene(settings);
        let alone = Simulation::new(&scene).expect("a simulation").run();
        let (run, simulation) = run(&scene, Wrong::Nothing);
        let run = run.expect("a run");
        let linked = simulation.controller().peer();
        assert_eq!(linked.comparison().first_difference, None);
        assert_eq!(linked.comparison().bits_differ, 0);
        assert_eq!(run.samples, alone.samples);
        assert_eq!(run.summary.settle_time_s, alone.summary.settle_time_s);
        let traffic = linked.traffic();
        assert_eq!((traffic.frames_damaged, traffic.frames_unexpected), (0, 0));
        // A heartbeat every 83 ticks after the one before arming.
        let ticks = u64::from(ticks_before(&scene)) + run.samples.len() as u64;
        assert!(traffic.frames_sent > 2 * u64::from(ticks_before(&scene)) + run.samples.len() as u64);
        assert!(traffic.frames_received >= ticks + 3, "{traffic}");
    }
}

#[test]
fn a_firmware_that_starts_late_is_waited_for() {
    let (run, simulation) = run(&scene(&[]), Wrong::StartsLate(Duration::from_millis(300)));
    assert_eq!(run.expect("a run").samples.len(), 251);
    assert_eq!(simulation.controller().peer().comparison().bits_differ, 0);
}

#[test]
fn noise_between_frames_is_counted_and_changes_nothing() {
    let (run, simulation) = run(&scene(&[]), Wrong::Noise);
    assert_eq!(run.expect("a run").samples.len(), 251);
    let linked = simulation.controller().peer();
    assert_eq!(linked.comparison().bits_differ, 0);
    // Two bits of noise before each frame.
    assert_eq!(linked.traffic().frames_damaged, 2 * linked.traffic().frames_received);
}

#[test]
fn where_nobody_answers_that_is_told_soon() {
    for (wrong, words) in [(Wrong::Dead, "0 received"), (Wrong::Babble, "damaged")] {
        let scene = scene(&[]);
        let plan = Plan::new(&scene).expect("a plan");
        let begun = Instant::now();
        let linked = Linked::connect(&plan, Client::new(Firmware::new(&scene, wrong), PATIENCE));
        let error = linked.err().expect("nobody").to_string();
        assert_says(&error, &["no firmware answers within 0.6 s", words]);
        assert!(begun.elapsed() >= PATIENCE.start && begun.elapsed() < 10 * PATIENCE.start, "{wrong:?}");
    }
}

#[test]
fn another_hand_is_told_with_what_to_do() {
    let error = error(&[], Wrong::For("left", 0xabcd));
    assert_says(&error, &["another hand", "needs `three-finger` (", "hand `left` (0000abcd)", "HAND=FILE"]);
    // Of the same name, but changed.
    let error = self::error(&["hand.joint.1.torque_limit_nm=1.0"], Wrong::For("three-finger", 0xabcd));
    assert_says(&error, &["another hand", "(0000abcd)"]);
}

#[test]
fn another_interface_image_or_past_is_told() {
    let error = |wrong| error(&[], wrong);
    assert_says(&error(Wrong::Speaks(77)), &["interface version 77, this program"]);
    assert_says(&error(Wrong::Is("hand")), &["image `hand`", "needs the image `pil`"]);
    assert_says(&error(Wrong::Used), &["has done 7 ticks", "reset it"]);
}

#[test]
fn a_parameter_that_is_refused_is_named() {
    let error = error(&["control.damping_scale=2"], Wrong::Refuses(Parameter::DAMPING));
    assert_says(&error, &["refuses the scene's `damping_nm_s` [0] = ", "out of its range"]);
}

#[test]
fn what_is_switched_off_on_one_side_only_is_named() {
    let error = |setting| error(&[setting], Wrong::Nothing);
    assert_says(
        &error("control.gravity_compensation=false"),
        &["`gravity_m_s2` is switched off in the scene and on"],
    );
    assert_says(
        &error("actuators.torque_limits=false"),
        &["`limits.torque_nm` is switched off in the scene and on"],
    );
}

#[test]
fn scenes_that_no_firmware_can_do_are_refused_before_anything_is_sent() {
    let refused = |name: &str, settings: &[&str]| {
        let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
        Plan::new(&Scene::load(name, &settings).expect("a scene")).expect_err("refused").to_string()
    };
    assert_says(&refused("cube-ideal", &[]), &["sensors.ideal"]);
    let error = refused("cube", &["control.period_s=2e-3"]);
    assert_says(&error, &["control.period_s", "1000 us", "2000 us"]);
}

#[test]
fn silence_in_a_run_ends_it_with_what_was_asked() {
    let before = ticks_before(&scene(&[]));
    let error = |tick| error(&[], Wrong::SilentFrom(tick));
    assert_says(&error(0), &["no answer of the firmware to `hello` within 0.2 s"]);
    assert_says(&error(1), &["to what `damping_nm_s` [0] is"]);
    assert_says(&error(before - 1), &["to `arm`"]);
    assert_says(&error(before), &["to `grasp`"]);
    assert_says(&error(before + 50), &["to the joints of a tick", "can't go on"]);
}

#[test]
fn a_damaged_or_lost_frame_ends_the_run() {
    let before = ticks_before(&scene(&[]));
    let error = |wrong| error(&[], wrong);
    assert_says(&error(Wrong::DamagedAt(before + 50)), &["no answer", "1 of them damaged"]);
    assert_says(&error(Wrong::RequestLostAt(before)), &["did the tick without `grasp`, which was lost"]);
    assert_says(&error(Wrong::HangsUpAt(before + 50)), &["the line to the firmware failed"]);
}

#[test]
fn a_bit_that_differs_is_found_and_acts() {
    let scene = scene(&[]);
    let alone = Simulation::new(&scene).expect("a simulation").run();
    let (run, simulation) = run(&scene, Wrong::BitAt(ticks_before(&scene) + 20, 5));
    let comparison = simulation.controller().peer().comparison();
    // The twin gets the counts that follow from the firmware's torque: afterwards both do the same again.
    assert_eq!(comparison.bits_differ, 1);
    let first = comparison.first_difference.clone().expect("a difference");
    assert_eq!((first.tick, first.what), (20, "torque_nm"));
    assert_eq!(first.joint.as_deref(), Some(scene.joints[5].name.as_str()));
    let (Value::Number { value: device, .. }, Value::Number { value: host, .. }) = (first.device, first.host)
    else {
        panic!("two numbers");
    };
    assert_eq!(device.to_bits(), host.to_bits() ^ 1);
    // The torques of tick 20 act from tick 21 on.
    let run = run.expect("a run");
    assert_eq!(run.samples[..21], alone.samples[..21]);
    assert_eq!(run.samples[21].torques_nm[5], f64::from(device));
    assert_ne!(run.samples[21].torques_nm[5], alone.samples[21].torques_nm[5]);
}
