//! The edges at which the grasp begins to fail.

use super::{super::*, plan};
use blindgrasp_sim::summary::Summary;
use std::convert::Infallible;
use std::sync::Mutex;

/// Rows that are held where they should be, without running anything.
fn rows(plan: &Plan, held: impl Fn(f64, u32) -> Option<bool>) -> Vec<Row> {
    let scene = super::plan("cube", &["duration_s=0.02"], &["seed=1"], 1).unwrap();
    let Outcome::Ran(summary) = run(&scene).remove(0).outcome else { panic!("it runs") };
    let outcome =
        |run| match held(plan.values(run).next().unwrap().number.unwrap(), run as u32 % plan.seeds()) {
            Some(grasp_held) => Outcome::Ran(Box::new(Summary { grasp_held, ..*summary.clone() })),
            None => Outcome::Refused("no".into()),
        };
    (0..plan.runs()).map(|run| Row { run, outcome: outcome(run) }).collect()
}

fn edges_of(axis: &str, seeds: u32, held: impl Fn(f64, u32) -> Option<bool>) -> Vec<(f64, f64)> {
    let plan = plan("cube", &[], &[axis], seeds).unwrap();
    edges(&plan, &rows(&plan, held)).into_iter().map(|edge| (edge.held, edge.lost)).collect()
}

/// Relative to the larger value.
fn width_of(Edge { held, lost }: Edge) -> f64 {
    (held - lost).abs() / held.abs().max(lost.abs())
}

#[test]
fn edges_are_between_neighbours_in_the_order_of_the_values() {
    let axis = "control.force_n=1..10:10";
    assert_eq!(edges_of(axis, 1, |force, _| Some((3.0..7.5).contains(&force))), [(3.0, 2.0), (7.0, 8.0)]);
    assert_eq!(edges_of(axis, 1, |_, _| Some(true)), []);
    assert_eq!(edges_of(axis, 1, |_, _| Some(false)), []);
    assert_eq!(edges_of("control.force_n=9,1,5,3", 1, |force, _| Some(force > 4.0)), [(5.0, 3.0)]);
    // What is refused is as if it were not there.
    let refused = |force: f64| (force != 5.0).then_some(force < 5.0);
    assert_eq!(edges_of(axis, 1, |force, _| refused(force)), [(4.0, 6.0)]);
    // One seed that loses it is enough.
    assert_eq!(edges_of(axis, 3, |force, seed| Some(force < 5.0 || seed != 1 && force < 8.0)), [(4.0, 5.0)]);
}

#[test]
fn only_one_number_has_edges() {
    let plan = plan("cube", &["duration_s=0.02"], &["control.force_n=1,2", "friction.scale=0,1"], 1).unwrap();
    let mut rows = run(&plan);
    let Outcome::Ran(summary) = &mut rows[0].outcome else { panic!("it runs") };
    summary.grasp_held = false;
    assert_eq!(edges(&plan, &rows), []);
}

/// Against the grasp itself: the bisection ends where a finer grid has the same edge.
#[test]
fn bisection_finds_the_edge() {
    let set = ["duration_s=0.5"];
    let mut plan = plan("cube", &set, &["friction.scale=0..0.4:3"], 1).unwrap();
    let seen = Mutex::new(Vec::new());
    let each = |row: &Row| {
        seen.lock().unwrap().push(row.run);
        Ok::<(), Infallible>(())
    };
    let Ok(Swept { rows, is_whole }) = run_refined(&mut plan, Vec::new(), Some(0.1), each, || true);
    assert!(is_whole);
    let [edge] = edges(&plan, &rows)[..] else { panic!("{rows:?}") };
    assert!(width_of(edge) <= 0.1 && edge.lost < edge.held, "{edge:?}");
    let numbers: Vec<f64> = plan.axes()[0].values.iter().map(|value| value.number.unwrap()).collect();
    assert_eq!(numbers[..4], [0.0, 0.2, 0.4, 0.1], "the grid comes first, and keeps its numbers");
    assert_eq!((rows.len(), plan.added()), (numbers.len(), numbers.len() - 3));
    assert!(numbers.iter().all(|number| format!("{number}").len() <= 7), "few digits: {numbers:?}");
    for row in &rows {
        let held = row.summary().unwrap().grasp_held;
        assert_eq!(held, plan.values(row.run).next().unwrap().number.unwrap() >= edge.held);
    }

    // What is known is not run again, and the same comes out.
    let half = rows[..5].to_vec();
    let mut again = super::plan("cube", &set, &["friction.scale=0..0.4:3"], 1).unwrap();
    seen.lock().unwrap().clear();
    let Ok(swept) = run_refined(&mut again, half, Some(0.1), each, || true);
    assert_eq!(swept.rows.len(), rows.len());
    assert_eq!(again.axes(), plan.axes());
    assert_eq!(*seen.lock().unwrap(), (5..rows.len()).collect::<Vec<_>>());
}

/// Whole numbers are bisected down to neighbours; a logarithmic axis in its logarithm.
#[test]
fn bisection_keeps_to_what_a_key_takes() {
    let bisect = |axis: &str, width, held: fn(f64) -> bool| {
        let mut plan = plan("cube", &["sensors.noise_counts=1"], &[axis], 1).unwrap();
        loop {
            let rows = rows(&plan, |number, _| Some(held(number)));
            let more = edge::between(&plan, &rows, width);
            if more.is_empty() {
                let [edge] = edges(&plan, &rows)[..] else { panic!("{axis}") };
                return (edge, plan.axes()[0].values.len());
            }
            assert!(plan.runs() < 60, "{axis}: no end");
            plan.add(more);
        }
    };
    let (edge, _) = bisect("seed=1..100:2", 1e-6, |seed| seed < 37.5);
    assert_eq!((edge.held, edge.lost), (37.0, 38.0));
    let (edge, runs) = bisect("control.force_n=1e-5..1e3:2:log", 1e-3, |force| force < 0.0123);
    assert!(edge.held < 0.0123 && edge.lost >= 0.0123 && width_of(edge) <= 1e-3, "{edge:?}");
    assert!(runs < 26, "{runs} values: 2^14 is finer");
    // At zero no relative width is ever reached; there is an end all the same.
    let (edge, runs) = bisect("friction.scale=0..1:2", 1e-3, |scale| scale > 0.0);
    assert!(edge.lost == 0.0 && edge.held < 2e-6 && runs < 40, "{edge:?} with {runs}");
}
