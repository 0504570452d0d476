//! The axis of a sweep: a key, and the values that it takes.

use super::unit;
use std::collections::BTreeSet;
use thiserror::Error;

/// The most values of a key.
const MOST_VALUES: usize = 1_000_000;
/// The most digits of the values between the ends of a range, and the fewest where they are evenly spread in their
/// logarithms.
const MOST_DIGITS: usize = 12;
const FEWEST_DIGITS: usize = 4;

/// A key and its values, in the order in which they are run; at least one.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Axis {
    /// The key, as `--set` takes it.
    pub key: String,
    /// Its values.
    pub values: Vec<Value>,
    /// The spread of the values.
    pub scale: Scale,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// As `--set` takes it.
    pub text: String,
    /// The number that it is, if it is one.
    pub number: Option<f64>,
}

/// The spread of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// Evenly in their logarithms.
    Logarithmic,
    /// As somebody listed them.
    Listed,
}

/// An error in a `KEY=VALUES`.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("--vary: {key}: {problem}; write KEY=FROM..TO:N, KEY=FROM..TO:N:log or KEY=A,B,C")]
pub struct AxisError {
    key: String,
    problem: String,
}

impl Axis {
    /// Reads `KEY=FROM..TO:N` (N values, evenly from FROM to TO, both included), `KEY=FROM..TO:N:log` (evenly in their
    /// logarithms) or `KEY=A,B,C`, where brackets and quotes keep commas together.
    ///
    /// The ends of a range are exactly what was written. Between them values are rounded, so that they are the decimals that
    /// one would write: to twelve digits; in a logarithmic range to so few that it is a thousandth of a step.
    ///
    /// # Errors
    /// What is wrong, and how it is written.
    pub fn parse(text: &str) -> Result<Self, AxisError> {
        let (key, values) = text.split_once('=').unwrap_or((text, ""));
        let (key, values) = (key.trim(), values.trim());
        let error = |problem: String| AxisError { key: key.to_owned(), problem };
        if key.is_empty() || values.is_empty() {
            return Err(AxisError { key: text.to_owned(), problem: "is not a key with values".into() });
        }
        let (values, scale) = match Range::parse(values) {
            Some(range) => range.and_then(|range| Ok((range.values()?, range.scale))).map_err(error)?,
            None => (list(values).map_err(error)?, Scale::Listed),
        };
        let mut seen = BTreeSet::new();
        let same =
            |value: &Value| value.number.map_or(value.text.clone(), |number| Value::number(number).text);
        if let Some(twice) = values.iter().find(|value| !seen.insert(same(value))) {
            return Err(error(format!("`{}` is there twice", twice.text)));
        }
        Ok(Self { key: key.to_owned(), values, scale })
    }

    /// The unit of its values; empty where they have none.
    pub fn unit(&self) -> &'static str {
        unit::of(&self.key)
    }

    /// Returns `true` if all values are numbers.
    pub fn is_numeric(&self) -> bool {
        self.values.iter().all(|value| value.number.is_some())
    }
}

impl Value {
    /// A word, or a number as somebody wrote it.
    pub fn written(text: &str) -> Self {
        let is_like_a_number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let number = text.replace('_', "").parse().ok().filter(|number: &f64| number.is_finite());
        Self { text: text.to_owned(), number: number.filter(|_| is_like_a_number) }
    }

    /// A number. Whole ones are written without a point, so that they serve for keys of either kind.
    pub fn number(number: f64) -> Self {
        // Adding zero turns a negative zero into a positive one.
        let number = number + 0.0;
        let is_whole = number.fract() == 0.0 && number.abs() < 1e15;
        let text = if is_whole { format!("{number:.0}") } else { format!("{number:?}") };
        Self { text, number: Some(number) }
    }
}

/// `FROM..TO:N`.
struct Range {
    from: f64,
    to: f64,
    count: usize,
    scale: Scale,
}

impl Range {
    /// `None` if the text is not a range: something else may have two points in it, such as a path.
    fn parse(text: &str) -> Option<Result<Self, String>> {
        let (from, rest) = text.split_once("..")?;
        let from = Value::written(from.trim()).number?;
        Some(Self::parse_rest(from, rest))
    }

    fn parse_rest(from: f64, rest: &str) -> Result<Self, String> {
        let mut parts = rest.split(':').map(str::trim);
        let to = parts.next().unwrap_or_default();
        let to = Value::written(to).number.ok_or_else(|| format!("`{to}` is not a number"))?;
        let count = parts.next().ok_or("the number of values is missing")?;
        let count = count.parse().map_err(|_| format!("`{count}` is not a number of values"))?;
        let scale = match parts.next() {
            None => Scale::Linear,
            Some("log") => Scale::Logarithmic,
            Some(other) => return Err(format!("`{other}` is unknown")),
        };
        if let Some(more) = parts.next() {
            return Err(format!("`{more}` is too much"));
        }
        Ok(Self { from, to, count, scale })
    }

    fn values(&self) -> Result<Vec<Value>, String> {
        let &Self { from, to, count, scale } = self;
        if !(2..=MOST_VALUES).contains(&count) {
            return Err(format!("{count} values are no range: it has 2 to {MOST_VALUES}"));
        }
        if scale == Scale::Logarithmic && !(from > 0.0 && to > 0.0) {
            return Err("a logarithmic range has to be above zero".into());
        }
        let digits = match scale {
            Scale::Logarithmic => digits((to / from).ln() / (count - 1) as f64),
            _ => MOST_DIGITS,
        };
        let largest = from.abs().max(to.abs());
        let value = |k: usize| {
            let share = k as f64 / (count - 1) as f64;
            match scale {
                _ if k == 0 => from,
                _ if k == count - 1 => to,
                Scale::Logarithmic => rounded(from.powf(1.0 - share) * to.powf(share), digits),
                _ => rounded_as(largest, from * (1.0 - share) + to * share, digits),
            }
        };
        let numbers: Vec<f64> = (0..count).map(value).collect();
        let rises = |pair: &[f64]| if from < to { pair[0] < pair[1] } else { pair[0] > pair[1] };
        if !numbers.windows(2).all(rises) {
            return Err(format!(
                "there are no {count} values of {digits} digits between {from:?} and {to:?}"
            ));
        }
        Ok(numbers.into_iter().map(Value::number).collect())
    }
}

/// Returns the number of digits that keep rounding below a thousandth of a step in the natural logarithm.
fn digits(step: f64) -> usize {
    let needed = 1.0 + (500.0 / step.abs()).log10().ceil();
    needed.clamp(FEWEST_DIGITS as f64, MOST_DIGITS as f64) as usize
}

/// The nearest number of so many digits.
fn rounded(number: f64, digits: usize) -> f64 {
    format!("{number:.*e}", digits - 1).parse().unwrap_or(number)
}

/// The nearest number with the decimals that another has with so many digits: beside it, what should be zero is.
fn rounded_as(largest: f64, number: f64, digits: usize) -> f64 {
    let decimals = (digits as f64 - 1.0 - largest.log10().floor()).clamp(0.0, 300.0) as usize;
    format!("{number:.decimals$}").parse().unwrap_or(number)
}

/// Splits at commas that are in neither brackets nor quotes.
fn list(text: &str) -> Result<Vec<Value>, String> {
    let (mut depth, mut quote, mut start) = (0_usize, None, 0);
    let mut items = Vec::new();
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                items.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    items.push(&text[start..]);
    let items = items.into_iter().map(str::trim);
    items
        .map(|item| if item.is_empty() { Err("a value is missing".into()) } else { Ok(Value::written(item)) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn texts(text: &str) -> Vec<String> {
        let axis = Axis::parse(text).unwrap();
        assert_eq!(axis.key, "k.x");
        axis.values.into_iter().map(|value| value.text).collect()
    }

    #[test]
    fn ranges_are_the_decimals_that_one_would_write() {
        assert_eq!(texts("k.x=0..1:11")[..4], ["0", "0.1", "0.2", "0.3"]);
        assert_eq!(texts("k.x = 0 .. 1 : 3"), ["0", "0.5", "1"]);
        assert_eq!(texts("k.x=1..-1:3"), ["1", "0", "-1"]);
        assert_eq!(texts("k.x=-0.2..0.4:7"), ["-0.2", "-0.1", "0", "0.1", "0.2", "0.3", "0.4"]);
        let zero = Axis::parse("k=-0.2..0.4:7").unwrap().values[2].number.unwrap();
        assert_eq!(zero.to_bits(), 0.0_f64.to_bits(), "no negative zero");
        assert_eq!(texts("k.x=-3e-9..3e-9:7")[2..5], ["-1e-9", "0", "1e-9"]);
        assert_eq!(texts("k.x=-1e12..1e12:3"), ["-1000000000000", "0", "1000000000000"]);
        assert_eq!(texts("k.x=1e-4..1e-1:4:log"), ["0.0001", "0.001", "0.01", "0.1"]);
        assert_eq!(texts("k.x=1e-4..1e-3:5:log"), ["0.0001", "0.0001778", "0.0003162", "0.0005623", "0.001"]);
        assert_eq!(texts("k.x=1..1.1:101:log")[1], "1.000954");
        assert_eq!(texts("k.x=100..1e-6:5:log"), ["100", "1", "0.01", "0.0001", "1e-6"]);
        assert_eq!(texts("k.x=1_000..3_000:3"), ["1000", "2000", "3000"]);
        assert_eq!(Axis::parse("k=1..2:3:log").unwrap().scale, Scale::Logarithmic);
        assert_eq!(Axis::parse("k=1..2:3").unwrap().scale, Scale::Linear);
    }

    #[test]
    fn lists_keep_what_was_written() {
        assert_eq!(texts("k.x=1e-3, 2,0.5"), ["1e-3", "2", "0.5"]);
        assert_eq!(texts("k.x=true,false"), ["true", "false"]);
        assert_eq!(texts("k.x=../cube.toml,../a..b.toml"), ["../cube.toml", "../a..b.toml"]);
        assert_eq!(texts("k.x=[0, 0, -9.81],[0, 0, 0]"), ["[0, 0, -9.81]", "[0, 0, 0]"]);
        assert_eq!(texts("k.x='a,b',\"c]\",{d=1,e=2}"), ["'a,b'", "\"c]\"", "{d=1,e=2}"]);
        let axis = Axis::parse("k=1,inf,nan,infinite,-.5,1e999").unwrap();
        let numbers: Vec<Option<f64>> = axis.values.iter().map(|value| value.number).collect();
        assert_eq!(numbers, [Some(1.0), None, None, None, Some(-0.5), None]);
        assert!(!axis.is_numeric() && axis.scale == Scale::Listed);
    }

    #[test]
    fn mistakes_are_told_with_how_it_is_written() {
        for (text, problem) in [
            ("control.force_n", "control.force_n: is not a key with values"),
            ("=1,2", "=1,2: is not a key with values"),
            ("k=", "k=: is not a key with values"),
            ("k=1..2", "k: the number of values is missing"),
            ("k=1..two:3", "k: `two` is not a number"),
            ("k=1..2:three", "k: `three` is not a number of values"),
            ("k=1..2:-3", "k: `-3` is not a number of values"),
            ("k=1..2:1", "k: 1 values are no range: it has 2 to 1000000"),
            ("k=1..2:1000001", "k: 1000001 values are no range: it has 2 to 1000000"),
            ("k=1..2:3:ln", "k: `ln` is unknown"),
            ("k=1..2:3:log:4", "k: `4` is too much"),
            ("k=0..2:3:log", "k: a logarithmic range has to be above zero"),
            ("k=2..2:3", "k: there are no 3 values of 12 digits between 2.0 and 2.0"),
            ("k=1..1.00000000001:30", "k: there are no 30 values of 12 digits between 1.0 and 1.00000000001"),
            ("k=1,,2", "k: a value is missing"),
            ("k=1,2,1.0", "k: `1.0` is there twice"),
            ("k=cube,cube", "k: `cube` is there twice"),
        ] {
            let how = "write KEY=FROM..TO:N, KEY=FROM..TO:N:log or KEY=A,B,C";
            assert_eq!(Axis::parse(text).unwrap_err().to_string(), format!("--vary: {problem}; {how}"));
        }
    }

    proptest! {
        #[test]
        fn a_range_runs_from_end_to_end(
            from in -1e6..1e6_f64, to in -1e6..1e6_f64, count in 2..200_usize, logarithmic: bool,
        ) {
            let (from, to) = if logarithmic { (from.abs(), to.abs()) } else { (from, to) };
            prop_assume!((from - to).abs() > 1e-3 && from != 0.0 && to != 0.0);
            let log = if logarithmic { ":log" } else { "" };
            let axis = Axis::parse(&format!("k={from:?}..{to:?}:{count}{log}")).unwrap();
            let numbers: Vec<f64> = axis.values.iter().map(|value| value.number.unwrap()).collect();
            prop_assert_eq!(numbers.len(), count);
            prop_assert_eq!((numbers[0], numbers[count - 1]), (from, to));
            for (k, pair) in numbers.windows(2).enumerate() {
                prop_assert_eq!(pair[0] < pair[1], from < to);
                // Even steps, but for the rounding of both: a thousandth of a step, and the twelve digits.
                let step = if logarithmic { (to / from).ln() } else { to - from } / (count - 1) as f64;
                let taken = if logarithmic { (pair[1] / pair[0]).ln() } else { pair[1] - pair[0] };
                let (share, size) = if logarithmic { (2e-3, 1.0) } else { (0.0, from.abs().max(to.abs())) };
                let allowed = share * step.abs() + 2e-11 * size;
                prop_assert!((taken - step).abs() <= allowed, "step {}: {} for {}", k, taken, step);
            }
            for value in &axis.values {
                // What is set is the number, bit for bit, and a TOML value.
                prop_assert_eq!(value.text.parse::<f64>().ok(), value.number);
                let document = format!("k = {}", value.text);
                prop_assert!(toml::from_str::<toml::Table>(&document).is_ok(), "{}", document);
            }
        }

        #[test]
        fn whatever_is_written_is_a_list_or_an_error(text in "\\PC{0,40}") {
            if let Ok(axis) = Axis::parse(&text) {
                prop_assert!(!axis.key.is_empty() && !axis.values.is_empty());
                prop_assert!(axis.values.iter().all(|value| !value.text.is_empty()));
            }
        }
    }
}
