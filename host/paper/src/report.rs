//! Everything that was found, together.

use super::choices::{self, Choice};
use super::claim::Claim;
use super::claims;
use super::earlier::{self, Comparison};
use super::evidence::{Evidence, EvidenceError};
use super::expected::{Surprise, surprises};
use super::figures::{self, Drawing, Drawn};
use super::plan::PLAN;
use super::polyhedra::{self, Polyhedra};
use super::sensitivity::{self, SWEEPS, Sweep};
use blindgrasp_plots::Along;
use serde_json::{Value, json};
use std::time::Instant;

/// The paper, run and checked.
pub struct Paper {
    /// The runs.
    pub evidence: Evidence,
    /// The sweeps.
    pub sweeps: Vec<Sweep>,
    /// The laws, compared.
    pub comparison: Comparison,
    /// The random polyhedra.
    pub polyhedra: Polyhedra,
    /// The claims.
    pub claims: Vec<Claim>,
    /// Verdicts that are not those of the table.
    pub surprises: Vec<Surprise>,
    /// The choices.
    pub choices: Vec<Choice>,
    /// The figures.
    pub figures: Vec<Drawn>,
    /// Time that the runs took, s.
    pub wall_s: f64,
    /// Cores that they had.
    pub cores: usize,
}

/// The number of random polyhedra that are grasped.
const POLYHEDRA: usize = 100;

/// Returns the number of runs that are planned, a polyhedron for one; bisection adds a few.
pub fn runs() -> usize {
    PLAN.len() + sensitivity::runs(SWEEPS) + earlier::runs() + POLYHEDRA
}

impl Paper {
    /// Runs and checks everything; `told` is called with a name after each run, from any thread.
    ///
    /// # Errors
    /// A run that can't be done: a fault of the program.
    pub fn reproduce(told: &(dyn Fn(&str) + Sync)) -> Result<Self, EvidenceError> {
        let begun = Instant::now();
        let evidence = Evidence::gather(PLAN, told)?;
        let sweeps = sensitivity::sweep(SWEEPS, told)?;
        let comparison = Comparison::gather(told)?;
        let polyhedra = polyhedra::grasped(POLYHEDRA, told)?;
        let claims = claims::all(&evidence, &sweeps, &comparison, &polyhedra)?;
        Ok(Self {
            surprises: surprises(&claims),
            choices: choices::all(&evidence, &sweeps)?,
            figures: figures::all(&evidence, &comparison)?,
            evidence,
            sweeps,
            comparison,
            polyhedra,
            claims,
            wall_s: begun.elapsed().as_secs_f64(),
            cores: rayon::current_num_threads(),
        })
    }

    /// Returns the number of runs that there were, a polyhedron for one.
    pub fn runs(&self) -> usize {
        let swept = self.sweeps.iter().map(|sweep| sweep.rows.len()).sum::<usize>();
        self.evidence.runs.len() + swept + self.polyhedra.outcomes.len()
    }

    /// Returns `true` if something came out worse than the documentation says.
    pub fn failed(&self) -> bool {
        self.surprises.iter().any(Surprise::is_worse)
    }

    /// All of it as one JSON object: claims, sweeps, choices, runs, and what the figures show in numbers.
    pub fn json(&self) -> Value {
        let runs = self.evidence.runs.iter().map(|done| {
            json!({ "name": done.name, "what": done.what, "scene": done.scene.name, "settings": done.settings, "summary": done.summary() })
        });
        json!({
            "claims": self.claims,
            "surprises": self.surprises,
            "figures": self.figures.iter().map(drawn).collect::<Vec<_>>(),
            "sweeps": self.sweeps.iter().map(Sweep::json).collect::<Vec<_>>(),
            "earlier_law": self.comparison,
            "polyhedra": self.polyhedra,
            "choices": self.choices,
            "runs": runs.collect::<Vec<_>>(),
            "wall_s": self.wall_s,
            "cores": self.cores,
        })
    }
}

/// Returns the content of a figure, in numbers: for each line its first, last, least and largest value.
fn drawn(drawn: &Drawn) -> Value {
    let data = match &drawn.drawing {
        Drawing::Strip(strip) => json!({ "times_s": strip.times_s }),
        Drawing::Chart(chart) => {
            let panels = chart.panels.iter().map(|panel| {
                let lines = panel.lines.iter().map(|line| {
                    let finite = || line.values.iter().copied().filter(|value| value.is_finite());
                    json!({
                        "name": line.name,
                        "first": finite().next(),
                        "last": finite().next_back(),
                        "least": finite().reduce(f64::min),
                        "largest": finite().reduce(f64::max),
                    })
                });
                let lines: Vec<Value> = lines.collect();
                json!({ "heading": panel.heading, "quantity": panel.quantity, "unit": panel.unit, "lines": lines })
            });
            let along = match &chart.along {
                Along::Times(times) => json!({ "quantity": "time, s", "until": times.last() }),
                Along::Decades { words, values } => json!({ "quantity": words, "values": values }),
            };
            json!({ "along": along, "panels": panels.collect::<Vec<_>>() })
        }
    };
    json!({ "number": drawn.number, "file": drawn.file, "title": drawn.title, "caption": drawn.caption, "data": data })
}
