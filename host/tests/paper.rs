//! `blindgrasp paper` end to end: exit code, verdicts, files, and a page that is whole and stands alone.

use html5ever::tendril::TendrilSink;
use html5ever::{ParseOpts, parse_document};
use markup5ever_rcdom::{Handle, NodeData, RcDom};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn blindgrasp(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_blindgrasp")).args(arguments).output().expect("the command")
}

/// Returns the folder where the report stays, for a browser to look at: see tests/run.
fn folder() -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("paper");
    let _ = fs::remove_dir_all(&path);
    path
}

/// The whole command: the verdicts are those that the documentation states, and every file is there.
#[test]
#[ignore = "takes a minute and a half: `tests/run all` runs it"]
fn the_paper_is_run_and_checked() {
    let folder = folder();
    let path = folder.to_str().expect("a path");
    let output = blindgrasp(&["paper", "--json", "--out", path]);
    let errors = String::from_utf8_lossy(&output.stderr);
    let report: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("one JSON object; {errors}"));
    assert_eq!(report["surprises"].as_array().map(Vec::len), Some(0), "{:#}", report["surprises"]);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    println!("{} s on {} cores", report["wall_s"], report["cores"]);

    let claims = report["claims"].as_array().expect("claims");
    assert!(claims.len() >= 18);
    for claim in claims {
        assert!(claim["rows"].as_array().is_some_and(|rows| !rows.is_empty()), "{claim:#}");
    }
    // What is not reproduced is there, with its evidence.
    let rows = claims.iter().flat_map(|claim| claim["rows"].as_array().into_iter().flatten());
    let failed: Vec<&Value> = rows.filter(|row| row["verdict"] == "not-reproduced").collect();
    assert!(!failed.is_empty());
    assert!(failed.iter().all(|row| row["measured"].as_str().is_some_and(|words| !words.is_empty())));

    let numbers: BTreeSet<&str> = report["figures"]
        .as_array()
        .expect("figures")
        .iter()
        .filter_map(|figure| figure["number"].as_str())
        .collect();
    assert!(["6", "7", "8", "12", "13"].iter().all(|number| numbers.contains(number)), "{numbers:?}");
    for figure in report["figures"].as_array().expect("figures") {
        let file = figure["file"].as_str().expect("a name");
        let read =
            |ending: &str| fs::read(folder.join(format!("figures/{file}.{ending}"))).expect("a figure");
        assert!(read("png").starts_with(b"\x89PNG"));
        assert!(read("svg").starts_with(b"<svg"));
        assert!(figure["caption"].as_str().is_some_and(|caption| caption.len() > 40));
    }
    for trace in ["hand-arm", "prism", "cube"] {
        let trace = fs::read_to_string(folder.join(format!("traces/{trace}.csv"))).expect("a trace");
        assert!(trace.starts_with("t_s,q_1") && trace.lines().count() > 1000);
    }
    let sweeps = report["sweeps"].as_array().expect("sweeps");
    for sweep in sweeps {
        let name = sweep["name"].as_str().expect("a name");
        let rows = sweep["rows"].as_array().expect("rows");
        assert!(rows.iter().all(|row| row["summary"].is_object()), "{name}: nothing is refused");
        let table = fs::read_to_string(folder.join(format!("sweeps/{name}.csv"))).expect("a table");
        assert!(table.starts_with("run,") && table.contains(sweep["keys"][0].as_str().expect("a key")));
        assert!(
            fs::read(folder.join(format!("sweeps/{name}.png"))).expect("a picture").starts_with(b"\x89PNG")
        );
        // The point of failure is as close as it should be, unless there is no whole number between.
        for edge in [&sweep["fails_below"], &sweep["fails_above"]] {
            let (Some(held), Some(lost)) = (edge["held"].as_f64(), edge["lost"].as_f64()) else { continue };
            let apart = (held - lost).abs();
            assert!(
                apart <= 0.1 * held.max(lost) * (1.0 + 1e-9) || apart <= 1.0 && held.fract() == 0.0,
                "{name}: {edge}"
            );
        }
    }
    // Every quantity is varied, and the grasp fails in most.
    let keys: BTreeSet<&str> = sweeps.iter().filter_map(|sweep| sweep["keys"][0].as_str()).collect();
    assert!(keys.len() >= 9, "{keys:?}");
    let fails = |sweep: &&Value| sweep["fails_below"].is_object() || sweep["fails_above"].is_object();
    assert!(sweeps.iter().filter(fails).count() >= 8);
    assert!(sweeps.iter().any(|sweep| sweep["keys"].as_array().is_some_and(|keys| keys.len() == 2)), "a map");

    let again: Value =
        serde_json::from_slice(&fs::read(folder.join("claims.json")).expect("claims.json")).expect("JSON");
    assert_eq!(again, report);
    page_is_whole(&folder.join("paper.html"));

    // A report is not overwritten unasked: found out before anything is run.
    let refused = blindgrasp(&["paper", "--out", path]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("not empty"));
}

/// Well formed for a browser's parser, nothing in it that runs or is fetched, and words for what only eyes see.
fn page_is_whole(path: &Path) {
    let text = fs::read_to_string(path).expect("the page");
    let dom = parse_document(RcDom::default(), ParseOpts::default()).one(text.as_str());
    assert!(dom.errors.borrow().is_empty(), "{:?}", dom.errors.borrow());
    let mut seen = Seen::default();
    seen.walk(&dom.document);
    assert!(seen.problems.is_empty(), "{:?}", seen.problems);
    let missing: Vec<&String> = seen.links.difference(&seen.ids).collect();
    assert!(missing.is_empty(), "links to nothing: {missing:?}");
    assert!(seen.tables > 10 && seen.charts > 20 && seen.pictures >= 12, "{seen:?}");
    assert!(text.len() < 2_500_000, "{} bytes", text.len());
    // In a style sheet, too.
    assert!(!text.contains("@import") && !text.contains("url("));
}

#[derive(Debug, Default)]
struct Seen {
    problems: Vec<String>,
    ids: BTreeSet<String>,
    links: BTreeSet<String>,
    tables: usize,
    charts: usize,
    pictures: usize,
}

impl Seen {
    fn walk(&mut self, node: &Handle) {
        if let NodeData::Element { name, attrs, .. } = &node.data {
            let attributes: Vec<(String, String)> = attrs
                .borrow()
                .iter()
                .map(|attribute| (attribute.name.local.to_string(), attribute.value.to_string()))
                .collect();
            self.element(&name.local, &attributes);
        }
        for child in node.children.borrow().iter() {
            self.walk(child);
        }
    }

    fn element(&mut self, name: &str, attributes: &[(String, String)]) {
        let get =
            |key: &str| attributes.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str());
        if ["script", "iframe", "object", "embed", "link", "form"].contains(&name) {
            self.problems.push(format!("<{name}>"));
        }
        if let Some((key, _)) = attributes.iter().find(|(key, _)| key.starts_with("on")) {
            self.problems.push(format!("<{name} {key}>"));
        }
        for key in ["src", "href", "srcset"] {
            match get(key) {
                Some(link) if link.starts_with('#') => drop(self.links.insert(link[1..].to_owned())),
                Some(link) if !link.starts_with("data:") => {
                    self.problems.push(format!("<{name} {key}={link}>"))
                }
                _ => {}
            }
        }
        if let Some(id) = get("id")
            && !self.ids.insert(id.to_owned())
        {
            self.problems.push(format!("two are called {id}"));
        }
        match name {
            "img" => {
                self.pictures += 1;
                if get("alt").is_none_or(str::is_empty) {
                    self.problems.push("a picture without words".to_owned());
                }
            }
            "svg" if get("role") == Some("img") => {
                self.charts += 1;
                if get("aria-label").is_none_or(str::is_empty) {
                    self.problems.push("a chart without words".to_owned());
                }
            }
            "table" => self.tables += 1,
            "th" if get("scope").is_none() => self.problems.push("a header of nothing".to_owned()),
            "html" if get("lang").is_none() => self.problems.push("no language".to_owned()),
            _ => {}
        }
    }
}

#[test]
fn bad_usage_is_told() {
    assert_eq!(blindgrasp(&["paper", "--force"]).status.code(), Some(2), "--force is for --out");
    assert_eq!(blindgrasp(&["paper", "nonsense"]).status.code(), Some(2));
    // A file where a directory has to be: told at once, and not after minutes of runs.
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("paper-blocked");
    fs::write(&file, "").expect("a file");
    let refused = blindgrasp(&["paper", "--out", file.join("report").to_str().expect("a path")]);
    assert_eq!((refused.status.code(), refused.stdout.as_slice()), (Some(2), &[][..]));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("paper-blocked"));
}
