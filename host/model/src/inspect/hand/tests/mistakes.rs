//! One mistake, or several, in a hand that was right: the whole line that is said of each, with its place.

use super::HandCheck;
use crate::tests::cases::cases;

/// The number of the first line with these words in it; the second after `2|`, the one before after `^`.
fn line(text: &str, words: &str) -> usize {
    let (before, words) = words.strip_prefix('^').map_or((0, words), |words| (1, words));
    let (skipped, words) = words.strip_prefix("2|").map_or((0, words), |words| (1, words));
    let mut lines = text.lines().enumerate().filter(|(_, line)| line.contains(words));
    let (index, _) = lines.nth(skipped).unwrap_or_else(|| panic!("no line has `{words}`"));
    1 + index - before
}

#[test]
fn every_mistake_is_found_with_its_line() {
    for case in cases(include_str!("mistakes.cases")) {
        let text = case.make(&super::text(case.of.unwrap_or("three-finger")));
        let check = HandCheck::parse(&text, "hand.toml").unwrap_or_else(|error| panic!("{error}"));
        let expected = case.said.iter().map(|&(place, said)| {
            let (severity, rest) = said.split_once(": ").unwrap();
            match place.or_else(|| case.edits[0].1.lines().next()) {
                None | Some("") => format!("{severity}: hand.toml: {rest}"),
                Some(words) => format!("{severity}: hand.toml:{}: {rest}", line(&text, words)),
            }
        });
        assert_eq!(check.findings.lines(), expected.collect::<Vec<_>>(), "{:?}", case.edits);
    }
}
