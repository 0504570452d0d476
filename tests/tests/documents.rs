//! README and `docs/`: every link leads somewhere, and the README stays short enough to be read.

use blindgrasp_tests::images::root;
use std::fs;
use std::path::{Path, PathBuf};

/// The most lines of the README.
const LONGEST_README: usize = 200;

/// All pages.
fn pages() -> Vec<PathBuf> {
    let folder = fs::read_dir(root().join("docs")).expect("the folder");
    let docs = folder.map(|entry| entry.expect("an entry").path());
    let pages = docs.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    let others = ["README.md", "examples/python/README.md", "firmware/src/boards/stm32f405/README.md"];
    pages.chain(others.map(|page| root().join(page))).collect()
}

/// The text of a page without its blocks of code.
fn prose(page: &Path) -> String {
    let text = fs::read_to_string(page).unwrap_or_else(|error| panic!("{}: {error}", page.display()));
    text.split("```").step_by(2).collect()
}

/// Targets of links and pictures that are not addresses.
fn links(prose: &str) -> Vec<&str> {
    let parts = prose.split("](").skip(1);
    let targets = parts.filter_map(|part| part.split_once(')')).map(|(target, _)| target);
    targets.filter(|target| !target.starts_with("http")).collect()
}

/// Names of the headings of a page, as GitHub makes them.
fn anchors(prose: &str) -> Vec<String> {
    let name = |heading: &str| {
        let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
        kept.collect::<String>().to_lowercase().replace(' ', "-")
    };
    prose
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| name(line.trim_start_matches('#')))
        .collect()
}

#[test]
fn every_link_leads_somewhere() {
    let mut broken = Vec::new();
    for page in pages() {
        for link in links(&prose(&page)) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target =
                if file.is_empty() { page.clone() } else { page.parent().expect("its folder").join(file) };
            let is_there = target.exists()
                && (anchor.is_empty() || anchors(&prose(&target)).iter().any(|a| a == anchor));
            if !is_there {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_readme_is_short() {
    let lines = fs::read_to_string(root().join("README.md")).expect("the README").lines().count();
    assert!(lines <= LONGEST_README, "{lines} lines");
}

#[test]
fn the_picture_of_the_monitor_is_the_one_that_its_test_draws() {
    let picture = fs::read_to_string(root().join("docs/images/monitor.txt")).expect("the picture");
    let page = fs::read_to_string(root().join("docs/recordings.md")).expect("the page");
    assert!(page.contains(&picture), "docs/recordings.md shows another picture than docs/images/monitor.txt");
}
