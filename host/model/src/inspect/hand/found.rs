//! The findings so far, and the values that are in doubt because of them.

use super::specimen::Specimen;
use crate::SceneError;
use crate::inspect::finding::{Finding, Severity};
use std::collections::BTreeSet;

/// Findings about a hand. One thing is said of a key, the first; what has no key is always said.
#[derive(Default)]
pub(super) struct Found {
    pub(super) findings: Vec<Finding>,
    /// Keys that something is wrong with: what would follow from them is not worth saying.
    doubted: BTreeSet<String>,
}

impl Found {
    /// Adds a finding, unless its key has one.
    pub(super) fn push(&mut self, finding: Finding) {
        if !finding.key.is_empty() && self.of(&finding.key).is_some() {
            return;
        }
        if finding.severity < Severity::Notice {
            self.doubted.insert(finding.key.clone());
        }
        self.findings.push(finding);
    }

    /// Adds what the loader refuses. Where a rule said more of the key, that becomes an error.
    pub(super) fn refuse(&mut self, error: SceneError, subject: String) {
        if let Some(finding) = self.of(&error.key) {
            finding.severity = Severity::Error;
            return;
        }
        // The subject and the key are not said twice.
        let named = error.problem.strip_prefix(subject.as_str()).filter(|_| !subject.is_empty());
        let what = match (named, error.key.rsplit('.').find(|part| part.parse::<usize>().is_err())) {
            (Some(what), _) => what.trim_start_matches([':', ' ']).to_owned(),
            (None, Some(key)) if !error.problem.contains(key) => format!("{key}: {}", error.problem),
            (None, _) => error.problem,
        };
        self.push(Finding::new(Severity::Error, what, error.remedy).about(subject).key(error.key));
    }

    /// Returns `true` if nothing is wrong with these values, of whatever joint or fingertip.
    pub(super) fn trusts(&self, keys: &[&str]) -> bool {
        !self.doubted.iter().any(|doubted| keys.iter().any(|key| doubted.ends_with(&format!(".{key}"))))
    }

    /// Returns `true` if nothing is wrong with this value of a joint.
    pub(super) fn trusts_joint(&self, specimen: &Specimen, joint: usize, key: &str) -> bool {
        !self.doubted.contains(&specimen.joint_key(joint, key))
    }

    fn of(&mut self, key: &str) -> Option<&mut Finding> {
        self.findings.iter_mut().find(|finding| finding.key == key)
    }
}
