//! A sweep before it is run: the scene, what is set, what is varied, and from these the settings of every run.

use super::axis::{Axis, Value};
use crate::scene::{Draft, Scene, SceneError, SceneFile, Setting, is_reference};
use thiserror::Error;

/// The most runs.
const MOST_RUNS: usize = 1_000_000;

/// A sweep: a scene, run once for each combination of the values of its axes, and each of these with so many seeds.
///
/// Runs are numbered from 0: the seed changes fastest, then the last axis, the first one slowest. The files of the scene
/// are read once, when the plan is made.
#[derive(Clone, Debug)]
pub struct Plan {
    scene: String,
    settings: Vec<Setting>,
    axes: Vec<Axis>,
    seeds: u32,
    /// The scene with each combination of hands and objects that axes name.
    drafts: Vec<Opened>,
}

/// A scene with a hand and an object.
#[derive(Clone, Debug)]
struct Opened {
    draft: Result<Draft, SceneError>,
    /// The first run of it that can be read, and its effective configuration.
    first: Option<(usize, SceneFile)>,
}

/// Why a sweep can't be run at all.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// A key stands in two places.
    #[error("--vary: {key}: {problem}; leave one of them out")]
    Twice {
        /// The key.
        key: String,
        /// Where it stands.
        problem: &'static str,
    },
    /// There are too many.
    #[error("--vary: the values combine to more than {MOST_RUNS} runs; give fewer")]
    TooMany,
    /// Not a single run can be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl Plan {
    /// Plans to run a scene, by its built-in name or its path, with settings that hold for every run. Each combination of
    /// values is run with `seeds` seeds, counted up from the scene's.
    ///
    /// # Errors
    /// A key stands twice; there are too many runs; or not a single run can be read: a key that no scene knows, or values that
    /// none can take. That a scene refuses some of the values is no error but what came of their runs.
    pub fn new(scene: &str, settings: Vec<Setting>, axes: Vec<Axis>, seeds: u32) -> Result<Self, PlanError> {
        for (k, Axis { key, .. }) in axes.iter().enumerate() {
            let problem = if axes[..k].iter().any(|axis| axis.key == *key) {
                "is varied twice"
            } else if settings.iter().any(|setting| setting.key() == key) {
                "is both set and varied"
            } else if key == "seed" && seeds > 1 {
                "is varied, and by --seeds as well"
            } else {
                continue;
            };
            return Err(PlanError::Twice { key: key.clone(), problem });
        }
        let counts = axes.iter().map(|axis| axis.values.len());
        let runs = counts.fold(seeds.max(1) as usize, usize::saturating_mul);
        if runs > MOST_RUNS {
            return Err(PlanError::TooMany);
        }
        let mut plan =
            Self { scene: scene.to_owned(), settings, axes, seeds: seeds.max(1), drafts: Vec::new() };
        plan.open()?;
        Ok(plan)
    }

    /// Reads the scene's files, and finds out what can be read at all.
    fn open(&mut self) -> Result<(), SceneError> {
        let references = self.axes.iter().filter(|axis| is_reference(&axis.key));
        let mut drafts = vec![None; references.map(|axis| axis.values.len()).product()];
        let mut missing = drafts.len();
        let mut first_error = None;
        for run in 0..self.runs() {
            let settings = self.settings_without_seed(run);
            let opened = drafts[self.draft_number(run)]
                .get_or_insert_with(|| Opened { draft: Draft::open(&self.scene, &settings), first: None });
            if opened.first.is_some() {
                continue;
            }
            match opened.draft.as_ref().map_err(SceneError::clone).and_then(|draft| draft.file(&settings)) {
                Ok(file) => {
                    opened.first = Some((run, file));
                    missing -= 1;
                    if missing == 0 {
                        break;
                    }
                }
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        self.drafts = drafts.into_iter().flatten().collect();
        match first_error {
            Some(error) if self.first().is_none() => Err(error),
            _ => Ok(()),
        }
    }

    /// The scene's name or path.
    pub fn scene_name(&self) -> &str {
        &self.scene
    }

    /// What is varied.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// How many seeds each combination is run with.
    pub fn seeds(&self) -> u32 {
        self.seeds
    }

    /// How many runs there are.
    pub fn runs(&self) -> usize {
        self.axes.iter().map(|axis| axis.values.len()).product::<usize>() * self.seeds as usize
    }

    /// The number of the value that each axis has in a run.
    pub fn place(&self, run: usize) -> Vec<usize> {
        let mut rest = run / self.seeds as usize;
        let mut place: Vec<usize> = self
            .axes
            .iter()
            .rev()
            .map(|axis| {
                let k = rest % axis.values.len();
                rest /= axis.values.len();
                k
            })
            .collect();
        place.reverse();
        place
    }

    /// The value that each axis has in a run.
    pub fn values(&self, run: usize) -> impl Iterator<Item = &Value> {
        self.axes.iter().zip(self.place(run)).map(|(axis, k)| &axis.values[k])
    }

    /// The settings of a run.
    pub fn settings(&self, run: usize) -> Vec<Setting> {
        let mut settings = self.settings_without_seed(run);
        if self.seeds > 1 {
            let seed = self.first().map_or(0, |file| file.seed).wrapping_add(run as u32 % self.seeds);
            settings.push(Setting::varied("seed", &seed.to_string()));
        }
        settings
    }

    fn settings_without_seed(&self, run: usize) -> Vec<Setting> {
        let varied = self.axes.iter().zip(self.values(run));
        let varied = varied.map(|(axis, value)| Setting::varied(&axis.key, &value.text));
        self.settings.iter().cloned().chain(varied).collect()
    }

    /// The effective configuration of a run.
    ///
    /// # Errors
    /// Why the values can't be read.
    pub fn file(&self, run: usize) -> Result<SceneFile, SceneError> {
        self.draft(run)?.file(&self.settings(run))
    }

    /// The scene of a run.
    ///
    /// # Errors
    /// Why the values are refused.
    pub fn scene(&self, run: usize) -> Result<Scene, SceneError> {
        self.draft(run)?.scene(&self.settings(run))
    }

    /// The effective configuration of the first run that has one, with the scene's own seed.
    pub fn first(&self) -> Option<&SceneFile> {
        let firsts = self.drafts.iter().filter_map(|opened| opened.first.as_ref());
        firsts.min_by_key(|(run, _)| *run).map(|(_, file)| file)
    }

    fn draft(&self, run: usize) -> Result<&Draft, SceneError> {
        self.drafts[self.draft_number(run)].draft.as_ref().map_err(SceneError::clone)
    }

    fn draft_number(&self, run: usize) -> usize {
        let references = self.axes.iter().zip(self.place(run)).filter(|(axis, _)| is_reference(&axis.key));
        references.fold(0, |number, (axis, k)| number * axis.values.len() + k)
    }
}
