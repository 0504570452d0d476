//! The shipped scenes, run as `blindgrasp sim` runs them.

use blindgrasp::model::Scene;
use blindgrasp::sim::{Run, Simulation};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A scene with settings `KEY=VALUE`.
pub fn load(name: &str, settings: &[&str]) -> Scene {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    Scene::load(name, &settings).unwrap_or_else(|error| panic!("{error}"))
}

/// The run of a scene with settings.
pub fn run(name: &str, settings: &[&str]) -> Run {
    Simulation::new(&load(name, settings)).expect("the scene can be simulated").run()
}

/// The run of a scene as it is shipped: one for all tests of a program, because those of a minute take seconds.
pub fn as_shipped(name: &str) -> Arc<Run> {
    type Runs = BTreeMap<String, Arc<OnceLock<Arc<Run>>>>;
    static RUNS: Mutex<Runs> = Mutex::new(BTreeMap::new());
    let of_scene =
        RUNS.lock().unwrap_or_else(PoisonError::into_inner).entry(name.to_owned()).or_default().clone();
    of_scene.get_or_init(|| Arc::new(run(name, &[]))).clone()
}
