//! The verdicts that the documentation states: one table. Whatever comes out worse fails the command.

use super::claim::{Claim, Verdict};
use Verdict::{Differs, NotReproduced, Reproduced};
use serde::Serialize;

/// Claim, run (`*`: every run that has no line of its own), verdict.
pub const EXPECTED: &[(&str, &str, Verdict)] = &[
    ("table-iii", "hand-arm", Reproduced),
    ("latch", "*", Reproduced),
    // The printed K_st is too small for the hand-arm: see docs/paper.md.
    ("contact", "hand-arm", NotReproduced),
    ("contact", "hand-arm-consistent", NotReproduced),
    ("contact", "hand-arm-continuous", NotReproduced),
    ("contact", "*", Reproduced),
    ("energy-balance", "*", Reproduced),
    ("energy-order", "*", Reproduced),
    ("energy-falls", "prism-ideal-minute", Differs),
    ("energy-falls", "*", Reproduced),
    ("bound", "cube-above-bound", Differs),
    ("bound", "*", Reproduced),
    ("square-integrable", "hand-arm", NotReproduced),
    ("square-integrable", "*", Reproduced),
    ("counter-force", "hand-arm", NotReproduced),
    ("counter-force", "hand-arm-consistent", NotReproduced),
    ("counter-force", "*", Reproduced),
    ("residuals", "cube", Differs),
    ("residuals", "hand-arm", NotReproduced),
    ("residuals", "hand-arm-stiff", Differs),
    ("residuals", "*", Reproduced),
    ("tangential", "cube", Differs),
    ("tangential", "hand-arm", NotReproduced),
    ("tangential", "*", Reproduced),
    ("nothing-normal", "hand-arm", NotReproduced),
    ("nothing-normal", "hand-arm-stiff", Differs),
    ("nothing-normal", "*", Reproduced),
    ("normal-force", "hand-arm", NotReproduced),
    ("normal-force", "*", Reproduced),
    ("rest", "prism-ideal-minute", Differs),
    ("rest", "cube-ideal", Differs),
    ("rest", "hand-arm", NotReproduced),
    ("rest", "hand-arm-continuous", NotReproduced),
    ("rest", "hand-arm-consistent", NotReproduced),
    ("rest", "hand-arm-stiff", Differs),
    ("rest", "*", Reproduced),
    ("transient", "*", Reproduced),
    ("normal-only", "cube-normal-only-friction", Differs),
    ("normal-only", "*", Reproduced),
    ("stiffness-region", "stiffness", Differs),
    ("stiffness-region", "stiffness-continuous", Differs),
    ("stiffness-region", "stiffness-experiment", Differs),
    ("no-net-wrench", "*", Reproduced),
    ("weight", "*", Reproduced),
    ("arbitrary", "every", NotReproduced),
    ("arbitrary", "more", Reproduced),
    // The earlier law: see docs/paper.md.
    ("earlier-effective", "*", Reproduced),
    ("earlier-expanded", "*", Reproduced),
    ("earlier-force", "*", Reproduced),
    ("earlier-pose", "*", NotReproduced),
    ("earlier-disturbs", "*", Reproduced),
    // An arm with five joints, and fingers with four: see docs/paper.md.
    ("manipulation", "hand-arm, 100 %", Reproduced),
    ("manipulation", "hand-arm, torques", Reproduced),
    ("manipulation", "*", Differs),
    ("arm-takes-part", "hand-arm", Reproduced),
];

/// A verdict that is not the one of the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Surprise {
    /// The claim.
    pub claim: String,
    /// The run.
    pub run: String,
    /// The verdict of the table; `None` if it has no line for it.
    pub expected: Option<Verdict>,
    /// The verdict that came out; `None` if the claim was not checked in this run.
    pub found: Option<Verdict>,
}

impl Surprise {
    /// Returns `true` if it came out worse than the documentation says.
    pub fn is_worse(&self) -> bool {
        match (self.expected, self.found) {
            (Some(expected), Some(found)) => found < expected,
            _ => true,
        }
    }
}

/// The verdict that the table states.
pub fn expected(claim: &str, run: &str) -> Option<Verdict> {
    let line = |name: &str| EXPECTED.iter().find(|(of, in_run, _)| *of == claim && *in_run == name);
    line(run).or_else(|| line("*")).map(|(_, _, verdict)| *verdict)
}

/// Returns the differences from the table.
pub fn surprises(claims: &[Claim]) -> Vec<Surprise> {
    let surprise = |claim: &str, run: &str, expected, found| Surprise {
        claim: claim.to_owned(),
        run: run.to_owned(),
        expected,
        found,
    };
    let rows = claims.iter().flat_map(|claim| claim.rows.iter().map(|row| (claim.key, row)));
    let found = rows.map(|(key, row)| surprise(key, &row.run, expected(key, &row.run), Some(row.verdict)));
    let missing = EXPECTED.iter().filter(|(key, run, _)| {
        let mut rows = claims.iter().filter(|claim| claim.key == *key).flat_map(|claim| &claim.rows);
        !rows.any(|row| *run == "*" || row.run == *run)
    });
    let missing = missing.map(|(key, run, verdict)| surprise(key, run, Some(*verdict), None));
    found.filter(|surprise| surprise.expected != surprise.found).chain(missing).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::Row;

    fn claims(verdict: Verdict) -> Vec<Claim> {
        let row = |run: &str, verdict| Row {
            run: run.to_owned(),
            measured: String::new(),
            figures: Vec::new(),
            verdict,
            remark: String::new(),
        };
        // Every line of the table, and one claim with a verdict of its own.
        let mut claims: Vec<Claim> = Vec::new();
        for &(key, run, stated) in EXPECTED {
            let verdict = if key == "weight" { verdict } else { stated };
            let row = row(run, verdict);
            match claims.iter_mut().find(|claim| claim.key == key) {
                Some(claim) => claim.rows.push(row),
                None => claims.push(Claim {
                    key,
                    words: "",
                    place: "",
                    criterion: "",
                    tolerance: "",
                    rows: vec![row],
                }),
            }
        }
        claims
    }

    #[test]
    fn what_is_worse_than_stated_fails() {
        assert!(surprises(&claims(Reproduced)).is_empty());
        let worse = surprises(&claims(NotReproduced));
        assert_eq!(worse.len(), 1);
        assert!(worse[0].is_worse() && worse[0].claim == "weight");
        let mut fewer = claims(Reproduced);
        fewer.retain(|claim| claim.key != "rest");
        assert!(surprises(&fewer).iter().all(Surprise::is_worse), "a claim that was not checked");
        let mut better = claims(Reproduced);
        for row in better.iter_mut().flat_map(|claim| &mut claim.rows) {
            row.verdict = Reproduced;
        }
        let better = surprises(&better);
        assert!(!better.is_empty() && better.iter().all(|surprise| !surprise.is_worse()));
    }
}
