//! One mistake, or several, in a hand that was right: the whole line that is said of each, with its place.

mod numbers;
mod whole;

use super::super::HandCheck;

/// A hand with mistakes.
struct Case {
    hand: &'static str,
    /// The replacements: the old text, the new one, and how often it stands there.
    edits: &'static [(&'static str, &'static str, usize)],
    /// The findings: severity, line, and the rest. The line is the first one with these words in it; the second after
    /// `2|`, the one before after `^`; nowhere without words.
    found: &'static [(&'static str, &'static str, &'static str)],
}

const THREE: &str = "three-finger";
const TWO: &str = "two-finger";

fn line(text: &str, words: &str) -> usize {
    let (before, words) = words.strip_prefix('^').map_or((0, words), |words| (1, words));
    let (skipped, words) = words.strip_prefix("2|").map_or((0, words), |words| (1, words));
    let mut lines = text.lines().enumerate().filter(|(_, line)| line.contains(words));
    let (index, _) = lines.nth(skipped).unwrap_or_else(|| panic!("no line has `{words}`"));
    1 + index - before
}

#[test]
fn every_mistake_is_found_with_its_line() {
    for case in numbers::CASES.iter().chain(whole::CASES) {
        let mut text = super::text(case.hand).to_owned();
        for (from, to, times) in case.edits {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, *times);
        }
        let check = HandCheck::parse(&text, "hand.toml").unwrap_or_else(|error| panic!("{error}"));
        let expected = case.found.iter().map(|(severity, words, rest)| match *words {
            "" => format!("{severity}: hand.toml: {rest}"),
            words => format!("{severity}: hand.toml:{}: {rest}", line(&text, words)),
        });
        assert_eq!(check.findings.lines(), expected.collect::<Vec<_>>(), "{:?}", case.edits);
    }
}
