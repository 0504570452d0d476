//! The structure is as the documents say: arrows between the modules of `shared/` go down only, and what the tables of
//! signals and parameters list is listed nowhere else.

use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::telemetry::Record;
use blindgrasp_tests::images::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Names in the first column of the table below a heading of docs/architecture.md, row by row.
fn modules(heading: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(root().join("docs/architecture.md")).expect("the document");
    let (_, below) = text.split_once(heading).unwrap_or_else(|| panic!("no table `{heading}`"));
    let rows = below.lines().skip_while(|line| !line.starts_with('|')).skip(2);
    rows.take_while(|line| line.starts_with('|'))
        .map(|row| {
            let first = row.split('|').nth(1).unwrap_or_default();
            first.split('`').skip(1).step_by(2).map(|name| name.trim_end_matches('/').to_owned()).collect()
        })
        .collect()
}

/// The files below a folder whose names end so.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.to_string_lossy().ends_with(ending) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Code without its tests and comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source");
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// The modules of its crate that code names.
fn named(code: &str) -> BTreeSet<String> {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut names = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            // `use crate::{a::B, c::{D, E}};`: what stands at depth one.
            Some(group) => {
                let mut depth = 1;
                let mut start = true;
                for (k, c) in group.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' => depth -= 1,
                        ',' if depth == 1 => start = true,
                        c if c.is_alphabetic() && start => {
                            names.insert(word(&group[k..]));
                            start = false;
                        }
                        _ => {}
                    }
                    if depth == 0 {
                        break;
                    }
                }
            }
            None => {
                names.insert(word(rest));
            }
        }
    }
    names.remove("");
    names
}

#[test]
fn in_the_shared_crate_no_arrow_runs_upwards() {
    let floors = modules("`shared/src/`, from the ground up:");
    let floor = |name: &str| floors.iter().position(|row| row.iter().any(|module| module == name));
    let source = root().join("shared/src");
    let mut seen = 0;
    for path in files(&source, ".rs") {
        let relative = path.strip_prefix(&source).expect("below").to_string_lossy().replace('\\', "/");
        let module = relative.split(['/', '.']).next().unwrap_or_default();
        if module == "lib" {
            continue;
        }
        let own = floor(module).unwrap_or_else(|| panic!("docs/architecture.md has no row for `{module}`"));
        for other in named(&code(&path)) {
            let below = floor(&other).unwrap_or_else(|| panic!("{relative}: no row for `{other}`"));
            // Modules of one row are on one floor: they may know each other one way, which the compiler does not check.
            assert!(
                below <= own,
                "{relative} names `{other}`, which docs/architecture.md has above `{module}`"
            );
            seen += 1;
        }
    }
    assert!(seen > 80, "only {seen} arrows were found: is the test blind?");
    // The test sees an arrow that runs upwards.
    assert!(floor("tick") > floor("hand") && named("use crate::tick::State;").contains("tick"));
}

/// Most names of a table that may stand in one file that is not the table.
const MOST_NAMES: usize = 4;

/// Names are listed in the tables only. What stands elsewhere are single names: where a parameter is checked, or a test.
#[test]
fn signals_and_parameters_are_listed_once() {
    let mut names: Vec<String> = Parameter::ALL.iter().map(|parameter| parameter.to_string()).collect();
    Record::<1>::BLANK.tell(|told| names.push(told.signal.key.to_owned()));
    // Plain words are everywhere.
    names.retain(|name| name.contains(['_', '.']));
    names.sort();
    names.dedup();
    let tables = [
        "shared/src/signals.rs",
        "shared/src/parameters.rs",
        // Each group checks its own.
        "shared/src/limit.rs",
        "shared/src/fault/watch.rs",
        "shared/src/cycle/carry.rs",
        "shared/src/cycle/closing.rs",
        "shared/src/cycle/moving.rs",
        // What it shows of a hand, by name.
        "examples/python/blindgrasp_client.py",
        // Written by a test.
        "examples/python/blindgrasp_tables.py",
    ];
    let folders = ["shared/src", "firmware/src", "host", "examples"];
    let sources = folders.iter().flat_map(|folder| {
        let folder = root().join(folder);
        [files(&folder, ".rs"), files(&folder, ".py")].concat()
    });
    let mut read = 0;
    for path in sources {
        let relative = path.strip_prefix(root()).expect("below").to_string_lossy().replace('\\', "/");
        // A law declares its own.
        if tables.contains(&relative.as_str()) || relative.starts_with("shared/src/control/") {
            continue;
        }
        let code = code(&path);
        let listed: Vec<_> = names.iter().filter(|name| code.contains(&format!("\"{name}\""))).collect();
        assert!(listed.len() <= MOST_NAMES, "{relative} lists {listed:?}: take them from the table");
        read += 1;
    }
    assert!(read > 100, "only {read} files were read");
}
