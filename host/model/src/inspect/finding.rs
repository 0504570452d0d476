//! A finding: one line that says how bad, where, about what, what is wrong, and what to do; and the list of them, with the
//! verdict that follows from it.

use crate::{Place, SceneError, one_line};
use serde::ser::{Serialize, SerializeStruct, Serializer};
use std::fmt;

/// As many findings of a kind are told one by one.
const LARGEST_GROUP_TOLD: usize = 3;

/// The severity of a finding. The worst comes first in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Can't be used, or is wrong whatever the file is for.
    Error,
    /// Can be used, and is likely a mistake.
    Warning,
    /// Worth knowing, and may be as it was meant.
    Notice,
}

impl Severity {
    /// The word for it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Notice => "notice",
        }
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// Something that a check found. One line: ``error: hand.toml:42: joint `x`: what is wrong; remedy``.
///
/// In JSON: `severity`, `subject`, `key`, `file`, `line` (the last two `null` where unknown), `what`, `remedy`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Its severity.
    pub severity: Severity,
    /// The subject, such as ``joint `finger-1-flex-2` ``; empty for the file as a whole.
    pub subject: String,
    /// The key in the file, as `--set` takes it, such as `joint.3.axis`; empty where there is none.
    pub key: String,
    /// File and line, where known.
    pub place: Option<Place>,
    /// The fault.
    pub what: String,
    /// The remedy; may be empty.
    pub remedy: String,
}

impl Finding {
    /// A finding about the file as a whole, without place: add what is known with [`about`](Self::about),
    /// [`key`](Self::key) and [`at`](Self::at).
    pub fn new(severity: Severity, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            severity,
            subject: String::new(),
            key: String::new(),
            place: None,
            what: what.into(),
            remedy: remedy.into(),
        }
    }

    /// A notice on something odd in a file that can be used all the same.
    pub(crate) fn notice(place: &Place, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(Severity::Notice, what, remedy).at(place.clone())
    }

    /// The same, about something.
    #[must_use]
    pub fn about(self, subject: impl Into<String>) -> Self {
        Self { subject: subject.into(), ..self }
    }

    /// The same, of a key.
    #[must_use]
    pub fn key(self, key: impl Into<String>) -> Self {
        Self { key: key.into(), ..self }
    }

    /// The same, at a place.
    #[must_use]
    pub fn at(self, place: Place) -> Self {
        Self { place: Some(place), ..self }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.line(0))
    }
}

impl From<SceneError> for Finding {
    fn from(error: SceneError) -> Self {
        let SceneError { place, key, problem, remedy } = error;
        Self { place, ..Self::new(Severity::Error, problem, remedy).key(key) }
    }
}

impl Finding {
    /// The line, for this and so many other subjects.
    fn line(&self, others: usize) -> String {
        format!("{}: {}", self.severity, self.words(others))
    }

    /// The line without its severity.
    pub(crate) fn words(&self, others: usize) -> String {
        let mut line = String::new();
        if let Some(place) = &self.place {
            line += &format!("{place}: ");
        }
        let others = match others {
            0 => String::new(),
            1 => " and another".to_owned(),
            others => format!(" and {others} others"),
        };
        if !self.subject.is_empty() || !others.is_empty() {
            line = line + &self.subject + &others + ": ";
        }
        line += &self.what;
        if !self.remedy.is_empty() {
            line = line + "; " + &self.remedy;
        }
        one_line(&line)
    }

    /// Returns the fault without names and numbers: the same for findings of a kind.
    fn kind(&self) -> String {
        let quoted = self.what.split('`').step_by(2);
        let words = quoted.flat_map(|part| part.split([' ', ',', '[', ']', '(', ')']));
        words.filter(|word| !word.contains(|c: char| c.is_ascii_digit())).collect::<Vec<_>>().join(" ")
    }
}

impl Serialize for Finding {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_struct("Finding", 7)?;
        object.serialize_field("severity", &self.severity)?;
        object.serialize_field("subject", &self.subject)?;
        object.serialize_field("key", &self.key)?;
        object.serialize_field("file", &self.place.as_ref().map(|place| &*place.source))?;
        let line = self.place.as_ref().map(|place| place.line).filter(|&line| line > 0);
        object.serialize_field("line", &line)?;
        object.serialize_field("what", &self.what)?;
        object.serialize_field("remedy", &self.remedy)?;
        object.end()
    }
}

/// The verdict that follows from the findings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Nothing worse than notices.
    Good,
    /// There are warnings, but no errors.
    Doubtful,
    /// There are errors.
    Broken,
}

impl Verdict {
    /// The word for it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Doubtful => "doubtful",
            Self::Broken => "broken",
        }
    }
}

/// The number of findings of each severity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Errors.
    pub errors: usize,
    /// Warnings.
    pub warnings: usize,
    /// Notices.
    pub notices: usize,
}

/// All that a check found. In JSON, the list.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(transparent)]
pub struct Findings(Vec<Finding>);

impl Findings {
    /// Adds one.
    pub fn push(&mut self, finding: Finding) {
        self.0.push(finding);
    }

    /// All of them, in the order of the list.
    pub fn iter(&self) -> impl Iterator<Item = &Finding> {
        self.0.iter()
    }

    /// The worst first; those of equal severity by their line, then in the order in which they were found.
    pub fn sort(&mut self) {
        let line = |finding: &Finding| finding.place.as_ref().map_or(0, |place| place.line);
        self.0.sort_by_key(|finding| (finding.severity, line(finding)));
    }

    /// Tells the keys that findings are of, and where these stand in the file.
    pub(crate) fn locate(&mut self, place_of: impl Fn(&str) -> Place) {
        for finding in self.0.iter_mut().filter(|finding| !finding.key.is_empty()) {
            finding.subject = finding.key.clone();
            finding.place = Some(place_of(&finding.key));
        }
    }

    /// A line for each, as people want to read them: of findings that differ in names and numbers only, the first and how
    /// many others there are, if they come from one place (a default) or are more than three.
    pub fn lines(&self) -> Vec<String> {
        let mut told = vec![false; self.0.len()];
        let mut lines = Vec::new();
        for (first, finding) in self.0.iter().enumerate() {
            if told[first] {
                continue;
            }
            let alike = |k: &usize| {
                let other = &self.0[*k];
                !told[*k] && other.severity == finding.severity && other.kind() == finding.kind()
            };
            let mut group: Vec<usize> = (first + 1..self.0.len()).filter(alike).collect();
            if group.len() < LARGEST_GROUP_TOLD {
                group.retain(|&k| finding.place.is_some() && self.0[k].place == finding.place);
            }
            group.iter().for_each(|&k| told[k] = true);
            lines.push(finding.line(group.len()));
        }
        lines
    }

    /// Returns the number of findings of each severity.
    pub fn counts(&self) -> Counts {
        let count = |severity| self.iter().filter(|finding| finding.severity == severity).count();
        Counts {
            errors: count(Severity::Error),
            warnings: count(Severity::Warning),
            notices: count(Severity::Notice),
        }
    }

    /// Returns the verdict that follows.
    pub fn verdict(&self) -> Verdict {
        match self.iter().map(|finding| finding.severity).min() {
            Some(Severity::Error) => Verdict::Broken,
            Some(Severity::Warning) => Verdict::Doubtful,
            Some(Severity::Notice) | None => Verdict::Good,
        }
    }

    /// The verdict with the counts, in words: `broken: 2 errors, 1 notice`.
    pub fn summary(&self) -> String {
        let Counts { errors, warnings, notices } = self.counts();
        let counts: Vec<String> = [(errors, "error"), (warnings, "warning"), (notices, "notice")]
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, word)| format!("{count} {word}{}", if count == 1 { "" } else { "s" }))
            .collect();
        let counts = if counts.is_empty() { "nothing found".to_owned() } else { counts.join(", ") };
        format!("{}: {counts}", self.verdict().word())
    }
}

impl Extend<Finding> for Findings {
    fn extend<I: IntoIterator<Item = Finding>>(&mut self, findings: I) {
        self.0.extend(findings);
    }
}

impl IntoIterator for Findings {
    type Item = Finding;
    type IntoIter = std::vec::IntoIter<Finding>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(number: usize) -> Place {
        Place { line: number, ..Place::whole("hand.toml") }
    }

    fn axis() -> Finding {
        Finding::new(Severity::Error, "its axis is [0, 0, 0]", "give a unit vector")
            .about("joint `x`")
            .key("joint.3.axis")
            .at(line(42))
    }

    #[test]
    fn a_finding_is_one_line() {
        assert_eq!(
            axis().to_string(),
            "error: hand.toml:42: joint `x`: its axis is [0, 0, 0]; give a unit vector"
        );
        let bare = Finding::new(Severity::Notice, "something", "");
        assert_eq!(bare.to_string(), "notice: something");
        let odd = Finding::new(Severity::Warning, "a\nb\u{7}", "x".repeat(5000)).to_string();
        assert!(odd.starts_with("warning: a\\nb\\u{7}; xxx") && odd.len() < 900, "{odd}");
    }

    #[test]
    fn the_verdict_is_that_of_the_worst() {
        let mut findings = Findings::default();
        assert_eq!((findings.verdict(), findings.summary().as_str()), (Verdict::Good, "good: nothing found"));
        findings.push(Finding::new(Severity::Notice, "a", ""));
        assert_eq!((findings.verdict(), findings.summary().as_str()), (Verdict::Good, "good: 1 notice"));
        findings.extend([Finding::new(Severity::Warning, "b", ""), Finding::new(Severity::Warning, "c", "")]);
        assert_eq!(findings.summary(), "doubtful: 2 warnings, 1 notice");
        findings.push(axis());
        assert_eq!(findings.summary(), "broken: 1 error, 2 warnings, 1 notice");
        assert_eq!(findings.counts(), Counts { errors: 1, warnings: 2, notices: 1 });
    }

    #[test]
    fn the_worst_comes_first_and_then_the_lines() {
        let mut findings = Findings::default();
        for (severity, number, what) in [
            (Severity::Notice, 1, "d"),
            (Severity::Error, 9, "b"),
            (Severity::Warning, 2, "c"),
            (Severity::Error, 3, "a"),
        ] {
            findings.push(Finding::new(severity, what, "").at(line(number)));
        }
        findings.sort();
        assert_eq!(findings.iter().map(|finding| finding.what.as_str()).collect::<String>(), "abcd");
    }

    #[test]
    fn findings_of_a_kind_are_told_in_one_line() {
        let one = |joint: usize, at: usize| {
            let what =
                format!("its mass of {joint}.5e-3 kg is more than `link-{joint}` [{joint}, 2] can have");
            Finding::new(Severity::Warning, what, format!("give {joint}"))
                .about(format!("joint `{joint}`"))
                .at(line(at))
        };
        let mut findings = Findings::default();
        findings.extend([one(1, 7), one(2, 7), one(3, 8)]);
        findings.push(Finding::new(Severity::Warning, "another", ""));
        let told = "its mass of 1.5e-3 kg is more than `link-1` [1, 2] can have; give 1";
        assert_eq!(findings.lines()[0], format!("warning: hand.toml:7: joint `1` and another: {told}"));
        assert_eq!(findings.lines()[1], findings.0[2].to_string());
        assert_eq!(findings.lines().len(), 3);
        findings.push(one(4, 9));
        assert_eq!(findings.lines()[0], format!("warning: hand.toml:7: joint `1` and 3 others: {told}"));
        assert_eq!(findings.lines()[1..], ["warning: another"]);
    }
    #[test]
    fn json_has_these_keys() {
        let mut findings = Findings::default();
        findings.push(axis());
        findings.push(Finding::new(Severity::Notice, "w", "").at(Place::whole("h.toml")));
        assert_eq!(
            serde_json::to_string(&findings).unwrap(),
            "[{\"severity\":\"error\",\"subject\":\"joint `x`\",\"key\":\"joint.3.axis\",\"file\":\"hand.toml\",\"line\":42,\
             \"what\":\"its axis is [0, 0, 0]\",\"remedy\":\"give a unit vector\"},\
             {\"severity\":\"notice\",\"subject\":\"\",\"key\":\"\",\"file\":\"h.toml\",\"line\":null,\"what\":\"w\",\"remedy\":\"\"}]"
        );
        assert_eq!(serde_json::to_string(&findings.verdict()).unwrap(), "\"broken\"");
        assert_eq!(
            serde_json::to_string(&findings.counts()).unwrap(),
            "{\"errors\":1,\"warnings\":0,\"notices\":1}"
        );
    }
}
