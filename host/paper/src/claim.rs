//! A claim of the paper, and what became of it.

use serde::Serialize;

/// The verdict on a claim in one run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It does not hold.
    NotReproduced,
    /// It holds up to a difference that is explained, and whose explanation is checked.
    Differs,
    /// It holds.
    Reproduced,
}

impl Verdict {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::Differs => "differs as explained",
            Self::NotReproduced => "not reproduced",
        }
    }

    /// Reproduced, or not.
    pub fn holds(holds: bool) -> Self {
        if holds { Self::Reproduced } else { Self::NotReproduced }
    }

    /// Reproduced, or at least explained, or neither.
    pub fn of(holds: bool, explained: bool) -> Self {
        match (holds, explained) {
            (true, _) => Self::Reproduced,
            (false, true) => Self::Differs,
            (false, false) => Self::NotReproduced,
        }
    }
}

/// A number that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit; empty for a ratio.
    pub unit: &'static str,
}

impl Figure {
    /// A number with its unit.
    pub fn new(name: &'static str, value: f64, unit: &'static str) -> Self {
        Self { name, value, unit }
    }
}

/// A claim in one run, or over several.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The run, by its name in the plan.
    pub run: String,
    /// The measurement, in words.
    pub measured: String,
    /// The numbers.
    pub figures: Vec<Figure>,
    /// The verdict.
    pub verdict: Verdict,
    /// The reason for which it differs, or the evidence that it fails. Empty where it holds.
    pub remark: String,
}

/// A claim and all that was found of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// A word or two that name it.
    pub key: &'static str,
    /// The paper's words, shortened.
    pub words: &'static str,
    /// Equation, figure or section.
    pub place: &'static str,
    /// The criterion by which it counts as reproduced.
    pub criterion: &'static str,
    /// The reason for the tolerance.
    pub tolerance: &'static str,
    /// The results.
    pub rows: Vec<Row>,
}

/// `value` with three significant digits, as a person would write it.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "not a number".to_owned() };
    }
    let magnitude = value.abs().log10().floor() as i32;
    if (-3..5).contains(&magnitude) {
        let decimals = usize::try_from(2 - magnitude).unwrap_or(0);
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

/// A ratio in per cent; what is less than a hundred-thousandth as that.
pub fn percent(ratio: f64) -> String {
    if ratio.abs() < 1e-5 { "< 0.001 %".to_owned() } else { format!("{} %", number(100.0 * ratio)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (1.0, "1.00"),
            (-12.345, "-12.3"),
            (0.012_345, "0.0123"),
            (123_456.0, "1.23e5"),
            (4.2e-7, "4.20e-7"),
            (99_999.0, "99999"),
            (f64::NAN, "not a number"),
        ];
        for (value, words) in cases {
            assert_eq!(number(value), words);
        }
        assert_eq!(percent(0.0123), "1.23 %");
        assert_eq!(percent(4e-7), "< 0.001 %");
        assert_eq!(percent(f64::NAN), "not a number %");
    }

    #[test]
    fn a_verdict_is_as_good_as_its_evidence() {
        assert_eq!(Verdict::of(true, false), Verdict::Reproduced);
        assert_eq!(Verdict::of(false, true), Verdict::Differs);
        assert_eq!(Verdict::of(false, false), Verdict::NotReproduced);
        assert!(Verdict::NotReproduced < Verdict::Differs && Verdict::Differs < Verdict::Reproduced);
    }
}
