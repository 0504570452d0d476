//! docs/equations.md tells the truth: it has every number from 1 to 59 once, and the files, functions and tests that it names are
//! there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The numbered equations of the paper.
const LAST: u32 = 59;
/// Folders of code that is named without them: as the page says.
const CODE: [&str; 3] = ["", "shared/src", "tests/src"];
/// Folders of tests.
const TESTS: [&str; 3] = ["", "tests/tests", "host/tests"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn page() -> String {
    fs::read_to_string(root().join("docs/equations.md")).expect("the page")
}

/// The rows of every table, cells without the bars, by the table's first header.
fn tables(page: &str) -> BTreeMap<String, Vec<Vec<String>>> {
    let cells = |line: &str| -> Vec<String> {
        let line = line.strip_prefix('|').unwrap_or(line);
        line.strip_suffix('|').unwrap_or(line).split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    let mut tables = BTreeMap::new();
    for block in page.split("\n\n").filter(|block| block.starts_with('|')) {
        let mut rows = block.lines().map(cells);
        let header = rows.next().unwrap_or_default().swap_remove(0);
        tables.insert(header, rows.skip(1).collect());
    }
    tables
}

/// The numbers that a first cell names: `1, 2`, `24-28`.
fn numbers(cell: &str) -> Result<Vec<u32>, String> {
    let mut numbers = vec![];
    for part in cell.split(',') {
        let ends: Result<Vec<u32>, _> = part.split('-').map(|end| end.trim().parse()).collect();
        match ends.as_deref() {
            Ok([one]) => numbers.push(*one),
            Ok([first, last]) if first < last => numbers.extend(*first..=*last),
            _ => return Err(format!("`{cell}` is not a list of numbers")),
        }
    }
    Ok(numbers)
}

/// Returns the words between backticks.
fn quoted(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// The text of a file that is named from the top or without one of some folders; empty for a folder, and for files whose names
/// have a `*`. `shared/x.rs` stands for `shared/src/x.rs`, and `plant/x.rs` for `host/plant/src/x.rs`.
fn open(name: &str, folders: &[&str]) -> Option<String> {
    let (room, rest) = name.split_once('/').unwrap_or(("", name));
    let paths = folders.iter().map(|folder| root().join(folder).join(name));
    let paths = paths.chain(["", "host"].map(|above| root().join(above).join(room).join("src").join(rest)));
    let found = |path: &Path| {
        if path.is_dir() {
            return Some(String::new());
        }
        let (before, after) = path.file_name()?.to_str()?.split_once('*').unwrap_or_default();
        if (before, after) == ("", "") {
            return fs::read_to_string(path).ok();
        }
        let names =
            fs::read_dir(path.parent()?).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        names
            .into_iter()
            .find(|name| name.starts_with(before) && name.ends_with(after))
            .map(|_| String::new())
    };
    paths.into_iter().find_map(|path| found(&path))
}

/// Returns `true` if a text defines a function, type or constant of this very name.
fn defines(text: &str, name: &str) -> bool {
    let name = name.rsplit("::").next().unwrap_or(name);
    ["fn", "struct", "const", "enum", "trait"].iter().any(|kind| {
        let definition = format!("{kind} {name}");
        let ends = |(at, _): (usize, &str)| {
            let next = text[at + definition.len()..].chars().next();
            !next.is_some_and(|next| next.is_alphanumeric() || next == '_')
        };
        text.match_indices(&definition).any(ends)
    })
}

/// Returns `true` if a text has a test of this name that is run: `#[test]` among the attributes before the function,
/// and no `#[ignore]` except for those of which `tests/run` sees to what they need.
fn tests(text: &str, name: &str) -> bool {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    lines.iter().enumerate().filter(|(_, line)| line.starts_with(&format!("fn {name}("))).any(|(at, _)| {
        let attributes = || lines[..at].iter().rev().take_while(|line| line.starts_with("#["));
        attributes().any(|line| *line == "#[test]")
            && !attributes().any(|line| line.starts_with("#[ignore") && !line.contains("tests/run"))
    })
}

/// Returns the errors in the names of a cell: each has to be a file or a folder, or something in the file before it.
/// Formulas are not names.
fn missing(cell: &str, folders: &[&str], has: fn(&str, &str) -> bool) -> Vec<String> {
    let mut wrong = vec![];
    let mut current: Option<(&str, String)> = None;
    for name in quoted(cell).filter(|name| !name.contains([' ', '(', '=', '+', '^'])) {
        if name.contains(['.', '/']) {
            // `a.toml` beside `folder/b.toml` is in that folder.
            let beside = current.as_ref().and_then(|(path, _)| path.rsplit_once('/'));
            let beside = beside.map(|(folder, _)| format!("{folder}/{name}"));
            let path = name.trim_end_matches('/');
            match open(path, folders).or_else(|| open(&beside?, folders)) {
                Some(text) => current = Some((name, text)),
                None => wrong.push(format!("there is no {name}")),
            }
        } else {
            match &current {
                Some((path, text)) if has(text, name) => (),
                Some((path, _)) => wrong.push(format!("{path} has no {name}")),
                None => wrong.push(format!("{name} of which file?")),
            }
        }
    }
    wrong
}

/// Everything that is wrong with the page.
fn wrong(page: &str) -> Vec<String> {
    let mut wrong = vec![];
    let tables = tables(page);
    let mut named = vec![];
    for (header, width) in [("Eq.", 5), ("Table", 4), ("what", 4)] {
        let rows = tables.get(header).map_or(&[][..], Vec::as_slice);
        if rows.is_empty() {
            wrong.push(format!("no table `{header}`"));
        }
        for row in rows {
            let place = format!("{header} {}", row[0]);
            if row.len() != width {
                wrong.push(format!("{place}: {} cells instead of {width}", row.len()));
                continue;
            }
            // The columns for code and test end the same in all tables, before that for departures.
            let code = if header == "what" { 1 } else { 2 };
            let test = &row[code + 1];
            if row[..=code + 1].iter().any(String::is_empty) {
                wrong.push(format!("{place}: an empty cell"));
            }
            if quoted(test).count() == 0 {
                wrong.push(format!("{place}: no test"));
            }
            let names = missing(&row[code], &CODE, defines).into_iter().chain(missing(test, &TESTS, tests));
            wrong.extend(names.map(|name| format!("{place}: {name}")));
            if header == "Eq." {
                match numbers(&row[0]) {
                    Ok(numbers) => named.extend(numbers),
                    Err(error) => wrong.push(error),
                }
            }
        }
    }
    for number in 1..=LAST.max(named.iter().copied().max().unwrap_or(0)) {
        let times = named.iter().filter(|&&named| named == number).count();
        if number > LAST || times != 1 {
            wrong.push(format!("Eq. {number} is there {times} times"));
        }
    }
    wrong
}

#[test]
fn the_page_tells_the_truth() {
    let wrong = wrong(&page());
    assert!(wrong.is_empty(), "docs/equations.md:\n{}", wrong.join("\n"));
}

/// Every kind of mistake, put into the page that is right, is found.
#[test]
fn a_page_that_lies_is_found_out() {
    let page = page();
    let row = |number: &str| {
        let start = format!("| {number} |");
        page.lines().find(|line| line.starts_with(&start)).expect("a row").to_owned() + "\n"
    };
    let test = "`fingertips_roll_without_slip`";
    for (before, after, found) in [
        (row("59"), String::new(), "Eq. 59 is there 0 times"),
        (row("5"), row("5") + &row("5"), "Eq. 5 is there 2 times"),
        ("| 24-28 |".into(), "| 24-27 |".into(), "Eq. 28 is there 0 times"),
        ("| 59 |".into(), "| 59, 60 |".into(), "Eq. 60 is there 1 times"),
        ("| 59 |".into(), "| latch |".into(), "is not a list of numbers"),
        ("`plant/rotation.rs`".into(), "`plant/rotations.rs`".into(), "there is no plant/rotations.rs"),
        ("`turn_freely`".into(), "`turn_free`".into(), "plant/rotation.rs has no turn_free"),
        ("`constraints.rs`".into(), "`constraint.rs`".into(), "there is no constraint.rs"),
        (test.into(), "`fingertips_roll_without`".into(), "constraints.rs has no fingertips_roll_without"),
        // A function that is not a test, and one that nobody runs unasked.
        (test.into(), "`slip_from_scratch`".into(), "constraints.rs has no slip_from_scratch"),
        (
            format!("`constraints.rs` {test}"),
            "`polyhedra.rs` `the_whole_table`".into(),
            "polyhedra.rs has no the_whole_table",
        ),
        (
            "`models/objects/cuboid*.toml`".into(),
            "`models/objects/ball*.toml`".into(),
            "there is no models/objects/ball",
        ),
        ("`cube.toml`".into(), "`dice.toml`".into(), "there is no dice.toml"),
    ] {
        assert!(page.contains(&before), "{before}");
        let wrong = wrong(&page.replacen(&before, &after, 1));
        assert!(wrong.iter().any(|wrong| wrong.contains(found)), "{after}: {wrong:?}");
    }
}
