//! Sensitivity: one quantity at a time is varied, mostly on the cube of the experiments, up to where the grasp fails; and two
//! pairs of them together. Runs, bisection and pictures are those of [`blindgrasp_sweep`].

use super::evidence::EvidenceError;
use blindgrasp_model::Setting;
use blindgrasp_sim::summary::Summary;
use blindgrasp_sweep::{Axis, Edge, Plan, Row, Stretch, Swept, Value, run_refined, stretches};
use rayon::prelude::*;
use serde_json::{Value as Json, json};
use std::convert::Infallible;
use std::fmt::Display;

/// The width to which the value at which a grasp fails is bisected, relative to the larger of the values beside it.
pub const WIDTH: f64 = 0.1;

/// A sweep to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Varied {
    /// Its name.
    pub name: &'static str,
    /// The quantity that is varied, in words.
    pub what: &'static str,
    /// A built-in scene.
    pub scene: &'static str,
    /// Settings that hold for every run.
    pub settings: &'static [&'static str],
    /// One key and its values, or two: `KEY=VALUES`, as `--vary` takes them.
    pub axes: &'static [&'static str],
    /// The value of the scene, if one key is varied.
    pub usual: Option<f64>,
}

/// A sweep that was done.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The plan of the sweep.
    pub varied: Varied,
    /// The runs.
    pub plan: Plan,
    /// The results of the runs.
    pub rows: Vec<Row>,
}

/// The values at which a grasp fails, seen from one at which it is held: below it and above it, if it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Towards smaller values.
    pub below: Option<Edge>,
    /// Towards larger ones.
    pub above: Option<Edge>,
}

const STIFFNESS: &str = "control.attitude_stiffness_nm=0,1e-3,2e-3,5e-3,1e-2,2e-2,5e-2,0.1,0.2,0.5,1";
const INTEGRAL: &str = "control.integral_gain_nm_rad=0,1e-3,2e-3,5e-3,2e-2,0.1,0.2,0.5,2";
const FRICTION: &str = "friction.scale=0,0.05,0.1,0.2,0.5,1,2,5,10";
const ENCODERS: &str = "hand.joint.*.encoder_counts_per_turn=20,50,100,200,500,1000,2000,5000,21600,100000";
/// 10 kHz to 250 Hz.
const PERIOD: &str = "control.period_s=1e-4,2e-4,5e-4,1e-3,2e-3,4e-3";
const DELAY: &str = "actuators.output_delay_ticks=0,1,2,5,10,20,50,100,200,500,1000";

/// The sweeps: of a quantity one after the other; those of two keys last.
#[rustfmt::skip]
pub const SWEEPS: &[Varied] = &[
    one("friction", "Friction of the joints, as a factor on the assumed 4.7 mN m", "cube", &["duration_s=4"], &[FRICTION], 1.0),
    one("friction-without-delay", "Friction of the joints, without the tick of delay", "cube", &["duration_s=4", "actuators.output_delay_ticks=0"], &[FRICTION], 1.0),
    one("encoders", "Encoder counts in a turn of a joint", "cube", &["duration_s=4"], &[ENCODERS], 21600.0),
    one("encoders-little-friction", "Encoder counts in a turn of a joint, with a fifth of the friction", "cube", &["duration_s=4", "friction.scale=0.2"], &[ENCODERS], 21600.0),
    one("period", "Control period, from 10 kHz to 250 Hz", "cube", &["duration_s=4"], &[PERIOD], 1e-3),
    one("period-little-friction", "Control period, with a tenth of the friction", "cube", &["duration_s=4", "friction.scale=0.1"], &[PERIOD], 1e-3),
    one("period-ideal", "Control period, in the paper's model", "cube-ideal", &["duration_s=10"], &[PERIOD], 1e-3),
    one("delay", "Delay between encoders and torques, in ticks of 1 ms", "cube", &["duration_s=4"], &[DELAY], 1.0),
    one("delay-little-friction", "Delay in ticks of 1 ms, with a fifth of the friction", "cube", &["duration_s=4", "friction.scale=0.2"], &[DELAY], 1.0),
    one("delay-ideal", "Delay in ticks of 0.1 ms, in the paper's model", "cube-ideal", &["duration_s=4", "control.period_s=1e-4"], &["actuators.output_delay_ticks=0,1,2,5,10,20,50"], 0.0),
    one("mass", "Mass of the cube, weightless", "cube", &["duration_s=4"], &["object.mass_kg=2e-4,2.1e-3,2e-2,0.1,0.5,2,5,20,100"], 2.1e-3),
    one("weight", "Mass of the cube, with its weight", "cube", &["duration_s=4", "plant.gravity_on_object=true"], &["object.mass_kg=2e-4,2.1e-3,1e-2,2e-2,5e-2,0.1,0.2,0.5,1"], 2.1e-3),
    one("stiffness", "K_st in the paper's model, law at 1 kHz", "cube-ideal", &["duration_s=10"], &[STIFFNESS], 5e-3),
    one("stiffness-continuous", "K_st in the paper's model, law at 10 kHz", "cube-ideal", &["duration_s=10", "control.period_s=1e-4"], &[STIFFNESS], 5e-3),
    one("stiffness-experiment", "K_st with joint friction, encoders and delay", "cube", &["duration_s=4"], &[STIFFNESS], 5e-3),
    one("integral", "K_I of the earlier law in the paper's model, law at 1 kHz", "cube-ideal", &["duration_s=10", "control.attitude_stiffness_nm=0"], &[INTEGRAL], 0.0),
    one("integral-continuous", "K_I of the earlier law in the paper's model, law at 10 kHz", "cube-ideal", &["duration_s=10", "control.attitude_stiffness_nm=0", "control.period_s=1e-4"], &[INTEGRAL], 0.0),
    one("force", "Nominal force f_d", "cube", &["duration_s=4"], &["control.force_n=0.01,0.1,0.5,1,2,5,10,20,50"], 5.0),
    one("normal-viscosity", "Normal viscosity xi of the fingertips, which Table IV leaves out", "cube", &["duration_s=4"], &["hand.fingertip.*.damping_n_s_m_per_m2=0,0.1,1,10,100,1e3,1e4"], 1.0),
    one("torsional-viscosity", "Torsional viscosity b of the fingertips, which Table IV leaves out", "cube", &["duration_s=4"], &["hand.fingertip.*.torsional_damping_nm_s_rad_per_m2=0,10,100,1e3,1e4,1e5,1e6"], 1e4),
    two("map-friction-period", "Joint friction and control period, with encoders and a tick of delay", "cube", &["duration_s=4"], &["friction.scale=0.01..1:9:log", "control.period_s=2e-4,5e-4,1e-3,2e-3,4e-3"]),
    two("map-stiffness-force", "K_st and f_d in the paper's model, law at 1 kHz", "cube-ideal", &["duration_s=10"], &["control.attitude_stiffness_nm=1e-3..0.1:9:log", "control.force_n=1.25..20:5:log"]),
];

const fn one(
    name: &'static str,
    what: &'static str,
    scene: &'static str,
    settings: &'static [&'static str],
    axes: &'static [&'static str],
    usual: f64,
) -> Varied {
    Varied { name, what, scene, settings, axes, usual: Some(usual) }
}

const fn two(
    name: &'static str,
    what: &'static str,
    scene: &'static str,
    settings: &'static [&'static str],
    axes: &'static [&'static str],
) -> Varied {
    Varied { name, what, scene, settings, axes, usual: None }
}

impl Varied {
    /// The runs, before bisection adds to them.
    ///
    /// # Errors
    /// A scene, a setting or a value that is bad: a fault of the program.
    pub fn plan(&self) -> Result<Plan, EvidenceError> {
        fn failed(name: &str, cause: impl Display) -> EvidenceError {
            EvidenceError(format!("sweep `{name}`: {cause}"))
        }
        let settings = self.settings.iter().map(|text| Setting::parse(text)).collect::<Result<_, _>>();
        let axes = self.axes.iter().map(|text| Axis::parse(text)).collect::<Result<_, _>>();
        let settings = settings.map_err(|cause| failed(self.name, cause))?;
        let axes = axes.map_err(|cause| failed(self.name, cause))?;
        Plan::new(self.scene, settings, axes, 1).map_err(|cause| failed(self.name, cause))
    }
}

/// Returns the number of runs of some sweeps, before bisection adds to them.
pub fn runs(sweeps: &[Varied]) -> usize {
    sweeps.iter().filter_map(|varied| varied.plan().ok()).map(|plan| plan.runs()).sum()
}

/// Does all runs of some sweeps, on all cores; `told` is called with the name of the sweep after each run, from any thread.
///
/// # Errors
/// A sweep that can't be planned.
pub fn sweep(sweeps: &[Varied], told: &(dyn Fn(&str) + Sync)) -> Result<Vec<Sweep>, EvidenceError> {
    // Together, because a bisection alone keeps one core busy.
    sweeps.par_iter().with_max_len(1).map(|varied| run(*varied, told)).collect()
}

fn run(varied: Varied, told: &(dyn Fn(&str) + Sync)) -> Result<Sweep, EvidenceError> {
    let mut plan = varied.plan()?;
    let each = |_: &Row| {
        told(varied.name);
        Ok::<(), Infallible>(())
    };
    let Ok(Swept { rows, .. }) = run_refined(&mut plan, Vec::new(), Some(WIDTH), each, || true);
    Ok(Sweep { varied, plan, rows })
}

impl Sweep {
    /// The first key.
    pub fn key(&self) -> &str {
        self.plan.axes().first().map_or("", |axis| axis.key.as_str())
    }

    /// The unit of its values; empty where they have none.
    pub fn unit(&self) -> &'static str {
        self.plan.axes().first().map_or("", Axis::unit)
    }

    /// Returns `true` if the joints have friction in all of its runs.
    pub fn has_friction(&self) -> bool {
        self.plan.first().is_some_and(|file| file.friction.scale > 0.0)
    }

    /// Returns the stretches in which the grasp is held and in which it is lost, in the order of the values.
    pub fn stretches(&self) -> Vec<Stretch> {
        stretches(&self.plan, &self.rows)
    }

    /// Returns the values at which the grasp fails, seen from the scene's own. `None` if it is lost there, or if two
    /// keys are varied.
    pub fn limits(&self) -> Option<Limits> {
        let (usual, stretches) = (self.varied.usual?, self.stretches());
        let here = stretches.iter().position(|s| s.held && (s.from..=s.to).contains(&usual))?;
        let below = here.checked_sub(1).map(|k| Edge { held: stretches[here].from, lost: stretches[k].to });
        let above = stretches.get(here + 1).map(|next| Edge { held: stretches[here].to, lost: next.from });
        Some(Limits { below, above })
    }

    /// Returns the summary of the run with a value of the first key, if it ran.
    pub fn summary(&self, value: f64) -> Option<&Summary> {
        let has = |row: &&Row| self.plan.values(row.run).next().and_then(|value| value.number) == Some(value);
        self.rows.iter().find(has).and_then(Row::summary)
    }

    /// Returns the stretches in which the grasp is held and in which it is lost, in words.
    pub fn outcome(&self) -> String {
        let number = |value: f64| Value::number(value).text;
        let words = |s: &Stretch| {
            let word = if s.held { "held" } else { "lost" };
            if s.from == s.to {
                format!("{word} at {}", number(s.from))
            } else {
                format!("{word} from {} to {}", number(s.from), number(s.to))
            }
        };
        let unit = if self.unit().is_empty() { String::new() } else { format!(" {}", self.unit()) };
        let words: Vec<String> = self.stretches().iter().map(words).collect();
        words.join(", ") + &unit
    }

    /// In how many of its runs the grasp was held, of how many.
    pub fn held(&self) -> [usize; 2] {
        let held = self.rows.iter().filter_map(Row::summary).filter(|summary| summary.grasp_held);
        [held.count(), self.rows.len()]
    }

    /// All of it, for `--json`.
    pub fn json(&self) -> Json {
        let Varied { name, what, scene, settings, usual, .. } = self.varied;
        let rows = self.rows.iter().map(|row| {
            let values: Vec<&str> = self.plan.values(row.run).map(|value| value.text.as_str()).collect();
            json!({ "values": values, "summary": row.summary() })
        });
        let keys: Vec<&str> = self.plan.axes().iter().map(|axis| axis.key.as_str()).collect();
        let limits = self.limits();
        json!({
            "name": name,
            "what": what,
            "scene": scene,
            "settings": settings,
            "keys": keys,
            "units": self.plan.axes().iter().map(Axis::unit).collect::<Vec<_>>(),
            "usual": usual,
            "stretches": self.stretches(),
            "fails_below": limits.and_then(|limits| limits.below),
            "fails_above": limits.and_then(|limits| limits.above),
            "outcome": self.outcome(),
            "rows": rows.collect::<Vec<_>>(),
        })
    }
}

/// The outcome of a sweep by its name, with what it varied.
pub fn outcome(sweeps: &[Sweep], name: &str) -> String {
    match sweeps.iter().find(|sweep| sweep.varied.name == name) {
        Some(sweep) => format!("{}: {}", sweep.varied.what, sweep.outcome()),
        None => format!("{name}: not swept"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_sweep::{Outcome, run};

    /// A sweep of three values that has come out as it should.
    fn swept(usual: f64, held: [bool; 3]) -> Sweep {
        let axes = &["control.force_n=2,5,10"];
        let varied = Varied { axes, ..one("force", "", "cube", &["duration_s=0.01"], &[], usual) };
        let plan = varied.plan().unwrap();
        let mut rows = run(&plan);
        for (row, held) in rows.iter_mut().zip(held) {
            let Outcome::Ran(summary) = &mut row.outcome else { panic!("it runs") };
            summary.grasp_held = held;
        }
        Sweep { varied, plan, rows }
    }

    #[test]
    fn where_it_fails_is_seen_from_the_scene() {
        let limits = |usual, held| swept(usual, held).limits();
        let (none, edge) = (None, |held, lost| Some(Edge { held, lost }));
        assert_eq!(limits(5.0, [true; 3]), Some(Limits { below: none, above: none }));
        assert_eq!(limits(5.0, [false, true, true]), Some(Limits { below: edge(5.0, 2.0), above: none }));
        assert_eq!(limits(2.0, [true, true, false]), Some(Limits { below: none, above: edge(5.0, 10.0) }));
        assert_eq!(
            limits(5.0, [false, true, false]),
            Some(Limits { below: edge(5.0, 2.0), above: edge(5.0, 10.0) })
        );
        assert_eq!(limits(5.0, [true, false, true]), None, "it is lost there");
        assert_eq!(swept(5.0, [false, true, true]).outcome(), "lost at 2, held from 5 to 10 N");
        assert_eq!(swept(5.0, [false, true, true]).held(), [2, 3]);
        assert_eq!(swept(5.0, [true; 3]).summary(10.0).map(|summary| summary.grasp_held), Some(true));
    }

    /// The scenes take every value; the one that is marked as theirs is theirs.
    #[test]
    fn sweeps_can_be_run() {
        let mut names = std::collections::BTreeSet::new();
        for varied in SWEEPS {
            assert!(names.insert(varied.name), "{}", varied.name);
            let plan = varied.plan().unwrap();
            for run in 0..plan.runs() {
                assert!(plan.scene(run).is_ok(), "{}: {:?}", varied.name, plan.scene(run).err());
            }
            assert_eq!(varied.usual.is_some(), plan.axes().len() == 1);
            let Some(usual) = varied.usual else { continue };
            let settings = plan.base_settings().to_vec();
            let unvaried = Plan::new(varied.scene, settings, Vec::new(), 1).unwrap().file(0).unwrap();
            let is_usual =
                |run: &usize| plan.values(*run).next().is_some_and(|value| value.number == Some(usual));
            let at = (0..plan.runs()).find(is_usual).expect("the scene's own value is among them");
            assert_eq!(plan.file(at).unwrap(), unvaried, "{}", varied.name);
        }
        assert_eq!(runs(SWEEPS), SWEEPS.iter().map(|varied| varied.plan().unwrap().runs()).sum::<usize>());
    }
}
