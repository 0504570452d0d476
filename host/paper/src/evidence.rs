//! The runs, done: on all cores, in the order of the plan.

use super::plan::Planned;
use blindgrasp_model::Scene;
use blindgrasp_sim::summary::Summary;
use blindgrasp_sim::{Run, Simulation};
use rayon::prelude::*;
use std::fmt::Display;
use std::num::NonZeroU64;

/// Time between samples, s: that of the experiments' servo loop.
const SAMPLE_S: f64 = 1e-3;

/// The reason for which a run of the plan can't be done. Its scenes are built in, so that this is a fault of the
/// program.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct EvidenceError(pub String);

impl EvidenceError {
    /// The fault of a run, in words.
    pub fn of(run: &str, cause: impl Display) -> Self {
        Self(format!("run `{run}`: {cause}"))
    }
}

/// A run that was done.
#[derive(Clone, Debug)]
pub struct Done {
    /// Its name in the plan.
    pub name: String,
    /// Its purpose.
    pub what: String,
    /// The settings of its scene.
    pub settings: Vec<String>,
    /// Its scene.
    pub scene: Scene,
    /// The run; a sample a millisecond.
    pub run: Run,
}

impl Done {
    /// Its verdict as a simulation.
    pub fn summary(&self) -> &Summary {
        &self.run.summary
    }
}

/// A scene with settings.
///
/// # Errors
/// What is wrong with them.
pub fn scene(run: &str, name: &str, settings: &[String]) -> Result<Scene, EvidenceError> {
    Scene::load(name, settings).map_err(|cause| EvidenceError::of(run, cause))
}

/// A simulation that keeps a sample a millisecond, whatever the period of its controller.
///
/// # Errors
/// What is wrong with the scene's model or gains.
pub fn simulation(run: &str, scene: &Scene) -> Result<Simulation, EvidenceError> {
    let mut simulation = Simulation::new(scene).map_err(|cause| EvidenceError::of(run, cause))?;
    let ticks = (SAMPLE_S / scene.control.period_s).round().max(1.0) as u64;
    simulation.sample_every(NonZeroU64::new(ticks).unwrap_or(NonZeroU64::MIN));
    Ok(simulation)
}

/// Everything that was simulated.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// The runs, in the order of the plan.
    pub runs: Vec<Done>,
}

impl Evidence {
    /// Does the runs of a plan; `told` is called with the name of each that ended, from any thread.
    ///
    /// # Errors
    /// The first run that can't be done.
    pub fn gather(plan: &[Planned], told: &(dyn Fn(&str) + Sync)) -> Result<Self, EvidenceError> {
        let one = |planned: &Planned| {
            let settings: Vec<String> = planned.settings.iter().map(|&setting| setting.to_owned()).collect();
            let scene = scene(planned.name, planned.scene, &settings)?;
            let run = simulation(planned.name, &scene)?.run();
            told(planned.name);
            Ok(Done { name: planned.name.to_owned(), what: planned.what.to_owned(), settings, scene, run })
        };
        // In the order of the plan: the long ones are first.
        let mut runs = plan
            .iter()
            .enumerate()
            .par_bridge()
            .map(|(k, planned)| Ok((k, one(planned)?)))
            .collect::<Result<Vec<_>, EvidenceError>>()?;
        runs.sort_by_key(|(k, _)| *k);
        let runs = runs.into_iter().map(|(_, done)| done).collect();
        Ok(Self { runs })
    }

    /// A run by its name.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn run(&self, name: &str) -> Result<&Done, EvidenceError> {
        self.runs
            .iter()
            .find(|done| done.name == name)
            .ok_or_else(|| EvidenceError(format!("no run is called `{name}`")))
    }
}
