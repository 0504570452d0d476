//! A sweep before it is run: the scene, what is set, what is varied, and from these the settings of every run.

use super::axis::{Axis, Value};
use blindgrasp_model::{Draft, Scene, SceneError, SceneFile, Setting, is_of_files};
use blindgrasp_record::table::Kind;
use thiserror::Error;

/// The most runs.
const MOST_RUNS: usize = 1_000_000;

/// A sweep: a scene, run once for each combination of the values of its axes, and each of these with so many seeds.
///
/// Runs are numbered from 0: the seed changes fastest, then the last axis, the first one slowest. Values that bisection adds
/// to an only axis come behind. The files of the scene are read once, when the plan is made.
#[derive(Clone, Debug)]
pub struct Plan {
    scene: String,
    settings: Vec<Setting>,
    axes: Vec<Axis>,
    seeds: u32,
    /// Runs of the grid; those after these were added.
    grid: usize,
    /// The scene with each combination of files that axes name.
    drafts: Vec<Opened>,
}

/// A scene with its files.
#[derive(Clone, Debug)]
struct Opened {
    draft: Result<Draft, SceneError>,
    /// The first run of it that can be read, and its effective configuration; or why not even the first one can be.
    first: Result<(usize, SceneFile), SceneError>,
}

/// The reason for which a sweep can't be run at all.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// A key stands in two places.
    #[error("--vary: {key}: {problem}; leave one of them out")]
    Twice {
        /// The key.
        key: String,
        /// Its place.
        problem: &'static str,
    },
    /// There are too many.
    #[error("--vary: the values combine to more than {MOST_RUNS} runs; give fewer")]
    TooMany,
    /// The scene refuses every run; of the first one, why.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl Plan {
    /// Plans to run a scene, by its built-in name or its path, with settings that hold for every run. Each combination of
    /// values is run with `seeds` seeds, counted up from the scene's.
    ///
    /// # Errors
    /// A key stands twice; there are too many runs; or the scene refuses every single one: it does not know the key, or can't
    /// take any of the values. That it refuses some of them is no error but what comes of their runs.
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
        let drafts = Vec::new();
        let mut plan =
            Self { scene: scene.to_owned(), settings, axes, seeds: seeds.max(1), grid: runs, drafts };
        plan.open();
        match plan.scene(0) {
            Err(error) if !(1..plan.runs()).any(|run| plan.scene(run).is_ok()) => Err(error.into()),
            _ => Ok(plan),
        }
    }

    /// Reads the scene's files, and finds out what can be read of them at all.
    fn open(&mut self) {
        let of_files = self.axes.iter().filter(|axis| is_of_files(&axis.key));
        let mut drafts = vec![None; of_files.map(|axis| axis.values.len()).product()];
        for run in 0..self.runs() {
            let settings = self.settings_without_seed(run);
            let file = |draft: &Result<Draft, SceneError>| {
                Ok((run, draft.as_ref().map_err(SceneError::clone)?.file(&settings)?))
            };
            match &mut drafts[self.draft_number(run)] {
                Some(Opened { first: Ok(_), .. }) => continue,
                Some(Opened { draft, first }) => *first = file(draft).or(first.clone()),
                unopened => {
                    let draft = Draft::open(&self.scene, &settings);
                    *unopened = Some(Opened { first: file(&draft), draft });
                }
            }
            if drafts.iter().all(|opened| matches!(opened, Some(Opened { first: Ok(_), .. }))) {
                break;
            }
        }
        self.drafts = drafts.into_iter().flatten().collect();
    }

    /// The scene's name.
    pub fn name(&self) -> &str {
        self.first().map_or(&self.scene, |file| &file.name)
    }

    /// Returns the axes.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Returns the settings of all runs.
    pub fn base_settings(&self) -> &[Setting] {
        &self.settings
    }

    /// Returns the number of seeds that each combination is run with.
    pub fn seeds(&self) -> u32 {
        self.seeds
    }

    /// Returns the number of runs.
    pub fn runs(&self) -> usize {
        self.axes.iter().map(|axis| axis.values.len()).product::<usize>() * self.seeds as usize
    }

    /// Returns the number of them that were added by bisection.
    pub fn added(&self) -> usize {
        self.runs() - self.grid
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

    /// The seed of a run, if it is not varied by its key.
    pub fn seed(&self, run: usize) -> u32 {
        self.first().map_or(0, |file| file.seed).wrapping_add(run as u32 % self.seeds)
    }

    /// The settings of a run.
    pub fn settings(&self, run: usize) -> Vec<Setting> {
        let mut settings = self.settings_without_seed(run);
        if self.seeds > 1 {
            settings.push(Setting::varied("seed", &self.seed(run).to_string()));
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
        let firsts = self.drafts.iter().filter_map(|opened| opened.first.as_ref().ok());
        firsts.min_by_key(|(run, _)| *run).map(|(_, file)| file)
    }

    /// Returns the content of the scene's files, for each combination that axes name: an effective configuration, or an
    /// error. What settings and axes change is in it as the first run has it.
    pub(super) fn contents(&self) -> Vec<String> {
        let content = |opened: &Opened| match &opened.first {
            Ok((_, file)) => file.to_toml(),
            Err(error) => error.to_string(),
        };
        self.drafts.iter().map(content).collect()
    }

    /// Returns the kind of the values of an axis. Numbers are whole if that is what the key takes.
    pub fn kind(&self, axis: usize) -> Kind {
        let Axis { key, values, .. } = &self.axes[axis];
        let effective = || self.first().and_then(|file| toml::Value::try_from(file).ok());
        if values.iter().all(|value| value.text == "true" || value.text == "false") {
            Kind::Truth
        } else if !self.axes[axis].is_numeric() {
            Kind::Words
        } else if effective().is_some_and(|value| matches!(below(&value, key), Some(toml::Value::Integer(_))))
        {
            Kind::Whole
        } else {
            Kind::Double
        }
    }

    /// Adds values to the only axis, behind all others. The runs before keep their numbers.
    pub(super) fn add(&mut self, values: Vec<Value>) {
        if let [axis] = self.axes.as_mut_slice() {
            axis.values.extend(values);
        }
    }

    fn draft(&self, run: usize) -> Result<&Draft, SceneError> {
        self.drafts[self.draft_number(run)].draft.as_ref().map_err(SceneError::clone)
    }

    fn draft_number(&self, run: usize) -> usize {
        let of_files = self.axes.iter().zip(self.place(run)).filter(|(axis, _)| is_of_files(&axis.key));
        of_files.fold(0, |number, (axis, k)| number * axis.values.len() + k)
    }
}

/// The value of a key as `--set` takes it; of all items of a list, the first.
fn below<'a>(value: &'a toml::Value, key: &str) -> Option<&'a toml::Value> {
    key.split('.').try_fold(value, |value, name| match value {
        toml::Value::Table(table) => table.get(name),
        toml::Value::Array(items) => match name.parse::<usize>() {
            Ok(number) => items.get(number.checked_sub(1)?),
            Err(_) if name == "*" => items.first(),
            Err(_) => items.iter().find(|item| item.get("name").and_then(toml::Value::as_str) == Some(name)),
        },
        _ => None,
    })
}
