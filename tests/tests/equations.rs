//! docs/equations.md tells the truth: it has every number from 1 to 59, and the files, functions and tests that it names are there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The numbered equations of the paper.
const LAST: u32 = 59;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The rows of the table: cells without the bars.
fn rows() -> Vec<Vec<String>> {
    let text = fs::read_to_string(root().join("docs/equations.md")).expect("the table");
    let rows = text.lines().filter(|line| line.starts_with('|'));
    let rows =
        rows.map(|line| line.trim_matches('|').split(" | ").map(|cell| cell.trim().to_owned()).collect());
    // The header and the line under it.
    rows.skip(2).collect()
}

/// The numbers that a first cell names: `1, 2`, `24-28`.
fn numbers(cell: &str) -> Vec<u32> {
    cell.split(',')
        .flat_map(|part| {
            let ends: Vec<u32> = part
                .split('-')
                .map(|end| end.trim().parse().unwrap_or_else(|_| panic!("`{cell}`")))
                .collect();
            ends[0]..=ends[ends.len() - 1]
        })
        .collect()
}

/// What stands between backticks.
fn quoted(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// A file that the table names, from the top or from one of the folders that it may leave out.
fn file(name: &str, folders: &[&str]) -> Option<String> {
    let paths = folders.iter().map(|folder| root().join(folder).join(name));
    paths.filter_map(|path| fs::read_to_string(path).ok()).next()
}

const CODE: [&str; 4] = ["", "host/src", "shared/src", "tests/src"];
const TESTS: [&str; 4] = ["", "tests/tests", "host/src", "host/tests"];

/// `shared/x.rs` stands for `shared/src/x.rs`.
fn code(name: &str) -> Option<String> {
    file(name, &CODE).or_else(|| file(name.strip_prefix("shared/")?, &["shared/src"]))
}

/// Checks that every name in a cell is a file, or something in the file before it.
fn check(cell: &str, open: impl Fn(&str) -> Option<String>, defined: impl Fn(&str, &str) -> bool) {
    let mut current: Option<(String, String)> = None;
    for name in quoted(cell).filter(|name| !name.contains(['(', '=', '+', '^']) && *name != "P v") {
        if name.ends_with(".rs") || name.contains('/') {
            let path = name.trim_end_matches('/');
            let text = if name.ends_with(".rs") { open(path) } else { Some(String::new()) };
            current = Some((name.to_owned(), text.unwrap_or_else(|| panic!("`{cell}`: there is no {name}"))));
        } else {
            let (path, text) =
                current.as_ref().unwrap_or_else(|| panic!("`{cell}`: `{name}` of which file?"));
            assert!(defined(text, name), "`{cell}`: {path} has no {name}");
        }
    }
}

#[test]
fn every_equation_has_its_row() {
    let named: Vec<u32> = rows().iter().flat_map(|row| numbers(&row[0])).collect();
    let all: BTreeSet<u32> = named.iter().copied().collect();
    assert_eq!(all, (1..=LAST).collect(), "every number from 1 to {LAST}");
    assert_eq!(named.len(), all.len(), "each number once");
    assert!(
        rows()
            .iter()
            .all(|row| row.len() == 5 && !row[1].is_empty() && !row[2].is_empty() && !row[3].is_empty())
    );
}

#[test]
fn the_code_that_the_table_names_is_there() {
    for row in rows() {
        check(&row[2], code, |text, name| {
            let name = name.rsplit("::").next().unwrap_or(name);
            ["fn ", "struct ", "const ", "enum ", "trait "]
                .iter()
                .any(|kind| text.contains(&format!("{kind}{name}")))
        });
    }
}

#[test]
fn the_tests_that_the_table_names_are_there() {
    for row in rows() {
        let before = quoted(&row[3]).count();
        assert!(before > 0, "Eq. {}: no test", row[0]);
        check(
            &row[3],
            |name| file(name, &TESTS),
            |text, name| {
                text.contains(&format!("#[test]\nfn {name}("))
                    || text.contains(&format!("#[test]\n    fn {name}("))
                    || text.contains(&format!("]\nfn {name}("))
            },
        );
    }
}

#[test]
fn a_wrong_table_is_found_out() {
    assert_eq!(numbers("24-28"), [24, 25, 26, 27, 28]);
    assert_eq!(numbers("1, 2"), [1, 2]);
    let nothing = |_: &str| None;
    let found = std::panic::catch_unwind(|| check("`plant/nothing.rs` `f`", nothing, |_, _| true));
    assert!(found.is_err(), "a file that is not there");
    let found = std::panic::catch_unwind(|| check("`a.rs` `f`", |_| Some(String::new()), |_, _| false));
    assert!(found.is_err(), "a function that is not there");
}
