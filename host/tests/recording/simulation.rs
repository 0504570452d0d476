//! A simulation leaves the recording that its hand would.

use crate::hand::read;
use blindgrasp::body::{MAX_FINGERS, MAX_JOINTS};
use blindgrasp::model::Scene;
use blindgrasp::record::mcap::{Decoded, Decoder, What};
use blindgrasp::sim::Simulation;
use blindgrasp::sim::recorder::Recorder;
use blindgrasp_shared::link::message::Reply;
use blindgrasp_shared::telemetry::snapshot::Collector;
use blindgrasp_shared::tick::{Params, State};
use std::path::Path;

fn run(scene: &Scene, path: &Path) -> blindgrasp::sim::Run {
    let simulation = Simulation::new(scene).unwrap();
    let mut recorder = Recorder::create(path, true, scene, simulation.controller()).unwrap();
    let run = simulation.run_watched(|_| {}, |controller| recorder.tick(controller));
    let saved = recorder.finish().unwrap();
    assert_eq!(saved.records as usize, run.samples.len() + 1);
    run
}

fn decode(path: &Path) -> Vec<Decoded> {
    let (entries, damage, _) = read(path);
    assert!(damage.is_none() && !damage.unfinished);
    let mut decoder = Decoder::new();
    entries.iter().filter_map(|entry| decoder.take(entry)).collect()
}

#[test]
fn each_tick_is_recorded_to_the_bit_and_the_file_is_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    let noise = ["duration_s=1.2".to_owned(), "sensors.noise_counts=0.5".to_owned()];
    let scene = Scene::load("cube", &noise).unwrap();
    let sampled = run(&scene, &a);
    run(&scene, &b);
    assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
    let decoded = decode(&a);
    // Before the samples comes the tick that arms the hand.
    for (decoded, sample) in decoded[1..].iter().zip(&sampled.samples) {
        assert_eq!(decoded.at.0, u64::from(decoded.record.tick) * 1_000_000);
        assert_eq!(decoded.lost_before, 0);
        let told = |values: &[f32]| -> Vec<f64> { values.iter().map(|&value| value.into()).collect() };
        // The estimator of the decoder is the controller's, from the first tick on.
        assert_eq!(told(decoded.angles_rad.as_slice()), sample.estimated_angles_rad);
        assert_eq!(told(decoded.speeds_rad_s.as_slice()), sample.estimated_speeds_rad_s);
    }
}

#[test]
fn the_state_can_be_had_from_the_snapshots() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let scene = Scene::load("cube", &["duration_s=1.1".to_owned()]).unwrap();
    let mut states = Vec::new();
    let simulation = Simulation::new(&scene).unwrap();
    let mut recorder = Recorder::create(&path, true, &scene, simulation.controller()).unwrap();
    let watch = |controller: &blindgrasp::sim::controller::Alone| {
        recorder.tick(controller);
        let mut bytes = [0; 8192];
        states.push(controller.state().save(controller.params(), &mut bytes).unwrap().to_vec());
    };
    simulation.run_watched(|_| {}, watch);
    recorder.finish().unwrap();
    let (entries, _, _) = read(&path);
    let params =
        Params::<MAX_JOINTS, MAX_FINGERS>::new(scene.hand.cast(), &scene.controller_config()).unwrap();
    let mut collector = Collector::new();
    let mut found = 0;
    for entry in &entries {
        let What::Received(payload) = &entry.what else { continue };
        let Ok(Reply::Snapshot(part)) = Reply::<MAX_JOINTS>::decode(payload) else { continue };
        if let Some((tick, bytes)) = collector.add(&part) {
            assert_eq!(bytes, states[tick as usize]);
            State::load(&params, bytes).unwrap();
            found += 1;
        }
    }
    assert_eq!(found, 2);
}

#[test]
fn ideal_sensors_have_no_counts_and_are_recorded_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    run(&Scene::load("cube-ideal", &["duration_s=0.05".to_owned()]).unwrap(), &path);
    let decoded = decode(&path);
    assert_eq!(decoded.len(), 52);
    assert!(decoded.iter().all(|decoded| decoded.record.counts.is_empty() && decoded.angles_rad.is_empty()));
    assert!(decoded.iter().any(|decoded| decoded.record.torques_nm.iter().any(|&torque| torque != 0.0)));
}
