//! The journal: what is kept is what was there, whatever happens to its file.

use super::{super::*, plan};
use blindgrasp_sim::summary::Summary;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sweep.csv.journal");
    (folder, path)
}

fn identity(axis: &str) -> Identity {
    Identity::of(&plan("cube", &["duration_s=0.1"], &[axis], 1).unwrap(), None)
}

/// Rows as they may be, with numbers that are hard to keep.
fn rows(count: usize) -> Vec<Row> {
    let numbers = [0.1, -0.0, f64::MIN_POSITIVE, f64::INFINITY, 1.0 / 3.0];
    let mut rows = run(&plan("cube", &["duration_s=0.02"], &["control.force_n=5,-1"], 1).unwrap());
    let Outcome::Ran(summary) = rows[0].outcome.clone() else { panic!("it runs") };
    let refused = rows.pop().unwrap().outcome;
    (0..count)
        .map(|run| {
            let number = numbers[run % numbers.len()];
            let lost_reason = (run % 2 == 0).then(|| format!("finger {run} rolled off\nits \"face\", é"));
            let summary = Summary { friction_demand_max: number, lost_reason, ..*summary.clone() };
            let ran = Outcome::Ran(Box::new(summary));
            Row { run, outcome: if run % 3 == 2 { refused.clone() } else { ran } }
        })
        .collect()
}

fn write(path: &std::path::Path, identity: &Identity, rows: &[Row]) {
    let (journal, found) = Journal::open(path, identity, true).unwrap();
    assert!(found.rows.is_empty() && found.dropped == 0);
    rows.iter().for_each(|row| journal.keep(row).unwrap());
}

#[test]
fn what_is_kept_is_found_again() {
    let (_folder, path) = folder();
    let identity = identity("control.force_n=1..2:2");
    let rows = rows(40);
    write(&path, &identity, &rows[..30]);
    let (journal, found) = Journal::open(&path, &identity, false).unwrap();
    assert_eq!((found.rows.as_slice(), found.dropped), (&rows[..30], 0));
    rows[30..].iter().for_each(|row| journal.keep(row).unwrap());
    let busy = Journal::open(&path, &identity, true).unwrap_err().to_string();
    assert_eq!(
        busy,
        format!("{}: another sweep is writing it; wait for it, or choose another --out", path.display())
    );
    drop(journal);
    let (journal, found) = Journal::open(&path, &identity, false).unwrap();
    assert_eq!(found.rows, rows);
    journal.remove().unwrap();
    assert!(!path.exists());
}

/// Cut anywhere, as a kill may leave it, it has the rows before the cut; and what is kept then is found behind them.
#[test]
fn a_journal_that_is_cut_keeps_what_is_whole() {
    let (_folder, path) = folder();
    let identity = identity("control.force_n=1..2:2");
    let rows = rows(4);
    write(&path, &identity, &rows);
    let whole = fs::read(&path).unwrap();
    let mut counts = Vec::new();
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        let (journal, found) = Journal::open(&path, &identity, false).unwrap();
        assert_eq!(found.rows, rows[..found.rows.len()], "{length}");
        counts.push(found.rows.len());
        journal.keep(&rows[3]).unwrap();
        drop(journal);
        let (_, again) = Journal::open(&path, &identity, false).unwrap();
        assert_eq!(again.rows.split_last(), Some((&rows[3], &found.rows[..])), "{length}");
        assert_eq!(again.dropped, 0);
    }
    counts.dedup();
    assert_eq!(counts, [0, 1, 2, 3]);
}

/// Bytes changed, inserted, removed and swapped at random: no row that was not kept, ever.
#[test]
fn a_damaged_journal_gives_no_wrong_row() {
    let (_folder, path) = folder();
    let identity = identity("control.force_n=1..2:2");
    let rows = rows(12);
    write(&path, &identity, &rows);
    let whole = fs::read(&path).unwrap();
    let mut random = fastrand::Rng::with_seed(6);
    let (mut refused, mut kept) = (0, 0);
    for _ in 0..3000 {
        let mut bytes = whole.clone();
        for _ in 0..random.usize(1..4) {
            let at = random.usize(..bytes.len());
            match random.u8(..5) {
                0 => bytes[at] ^= 1 << random.u8(..8),
                1 => bytes[at] = random.u8(..),
                2 => bytes.insert(at, random.u8(..)),
                3 => drop(bytes.remove(at)),
                _ => {
                    let to = random.usize(..bytes.len());
                    bytes.swap(at, to);
                }
            }
        }
        fs::write(&path, &bytes).unwrap();
        match Journal::open(&path, &identity, false) {
            Ok((_, found)) => {
                kept += found.rows.len();
                assert_eq!(found.rows, rows[..found.rows.len()]);
            }
            Err(error) => {
                refused += 1;
                assert!(matches!(error, JournalError::NoJournal(_)), "{error}");
                assert_eq!(fs::read(&path).unwrap(), bytes, "what is refused is left alone");
            }
        }
    }
    assert!(refused > 10 && kept > 3000, "{refused} refused, {kept} rows kept: not much of a test");
}

#[test]
fn the_journal_of_another_sweep_is_refused_with_what_differs() {
    let (folder, path) = folder();
    let scene = folder.path().join("scene.toml");
    let copy = |force_n: &str| {
        let text = include_str!("../../../../models/scenes/cube.toml").replace("force_n = 5.0", force_n);
        fs::write(&scene, text).unwrap();
    };
    let identity = |settings: &[&str], axis: &str, seeds, refine| {
        Identity::of(&plan(scene.to_str().unwrap(), settings, &[axis], seeds).unwrap(), refine)
    };
    let friction = "friction.scale=0..1:3";
    copy("force_n = 5.0");
    write(&path, &identity(&[], friction, 1, None), &rows(2));
    let refusal = |identity: &Identity| Journal::open(&path, identity, false).unwrap_err().to_string();
    let told = |what: &str| {
        let path = path.display();
        format!(
            "{path}: belongs to another sweep: {what} differs; run that one again, choose another --out, or start anew with --force"
        )
    };
    assert_eq!(refusal(&identity(&["control.force_n=4"], friction, 1, None)), told("what is --set"));
    assert_eq!(refusal(&identity(&["control.force_n=5"], friction, 1, None)), told("what is --set"));
    assert_eq!(refusal(&identity(&[], "friction.scale=0..1:4", 1, None)), told("what is to --vary"));
    assert_eq!(refusal(&identity(&[], "friction.scale=0,0.5,1", 1, None)), told("what is to --vary"));
    assert_eq!(refusal(&identity(&[], friction, 2, None)), told("the number of --seeds"));
    assert_eq!(refusal(&identity(&[], friction, 1, Some(0.1))), told("--refine"));
    copy("force_n = 4.0");
    assert_eq!(refusal(&identity(&[], friction, 1, None)), told("the scene"));
    // A value that is varied anyway may differ, and so may comments.
    copy("force_n = 5.0 # N");
    assert_eq!(Journal::open(&path, &identity(&[], friction, 1, None), false).unwrap().1.rows.len(), 2);
}

/// Nothing is kept by halves: after a write that failed, the next one follows what is whole.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let error = Journal::open(std::path::Path::new("/dev/full"), &identity("control.force_n=1..2:2"), true);
    assert!(error.unwrap_err().to_string().starts_with("cannot write /dev/full"));
}
