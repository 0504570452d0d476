//! The outcomes of runs.

use super::{super::*, plan};
use blindgrasp_sim::Simulation;
use blindgrasp_sim::summary::Summary;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// All but the computing time.
fn verdict(summary: &Summary) -> Summary {
    Summary { wall_s: 0.0, real_time_factor: 0.0, ..summary.clone() }
}

fn outcomes(rows: &[Row]) -> Vec<Result<Summary, String>> {
    let outcome = |row: &Row| match &row.outcome {
        Outcome::Refused(reason) => Err(reason.clone()),
        Outcome::Ran(summary) => Ok(verdict(summary)),
    };
    rows.iter().map(outcome).collect()
}

/// Bit for bit, lost runs and faults included.
#[test]
fn a_row_is_the_summary_of_the_same_run_with_all_its_samples() {
    let set = ["duration_s=3", "sensors.noise_counts=0.3"];
    let axes = ["control.attitude_stiffness_nm=0,5e-3", "friction.scale=0,1"];
    let plan = plan("cube-normal-only", &set, &axes, 2).unwrap();
    let rows = run(&plan);
    assert_eq!(rows.iter().map(|row| row.run).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6, 7]);
    for row in &rows {
        let scene = plan.scene(row.run).unwrap();
        let whole = Simulation::new(&scene).unwrap().run();
        assert_eq!(row.summary().map(verdict), Some(verdict(&whole.summary)));
        assert_eq!(plan.seed(row.run), scene.seed);
    }
    let held = rows.iter().filter_map(Row::summary).filter(|summary| summary.grasp_held).count();
    assert!((1..8).contains(&held), "{held} of 8 held: not much of a test");
}

#[test]
fn what_is_refused_says_why() {
    let plan = plan("cube", &["duration_s=0.02"], &["control.force_n=5,-1,much"], 1).unwrap();
    let outcomes = outcomes(&run(&plan));
    assert!(outcomes[0].is_ok());
    let refused = |k: usize| outcomes[k].as_ref().unwrap_err().as_str();
    assert_eq!(
        refused(1),
        "--vary: control.force_n: -1.0 is out of range; has to be between 1e-6 and 10000.0"
    );
    assert_eq!(refused(2), "--vary: control.force_n: is string \"much\"; has to be a number");
}

#[test]
fn an_end_that_is_wanted_comes_and_keeps_what_is_done() {
    let plan = plan("cube", &["duration_s=0.1"], &["control.force_n=1..20:20"], 1).unwrap();
    let all: Vec<usize> = (0..20).collect();
    let seen = Mutex::new(Vec::new());
    let done = AtomicUsize::new(0);
    let each = |row: &Row| {
        done.fetch_add(1, Ordering::Relaxed);
        seen.lock().unwrap().push(row.run);
        Ok::<(), String>(())
    };
    let rows = run_some(&plan, &all, each, || done.load(Ordering::Relaxed) < 3).unwrap();
    let mut seen = seen.into_inner().unwrap();
    seen.sort_unstable();
    assert_eq!(rows.iter().map(|row| row.run).collect::<Vec<_>>(), seen);
    assert!((3..20).contains(&rows.len()), "{}", rows.len());

    // A run that is long ends in the middle.
    let long = super::plan("cube", &["duration_s=3600"], &["control.force_n=5,6"], 1).unwrap();
    let asked = AtomicUsize::new(0);
    let goes_on = || asked.fetch_add(1, Ordering::Relaxed) < 10;
    assert_eq!(run_some(&long, &[0, 1], |_| Ok::<(), String>(()), goes_on), Ok(Vec::new()));

    let error =
        run_some(&plan, &all, |row| Err(format!("no place for run {}", row.run)), || true).unwrap_err();
    assert!(error.starts_with("no place for run"));
}
