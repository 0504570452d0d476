//! The table: its columns, their types, and that a row's configuration reproduces the row.

use super::{super::*, plan};
use blindgrasp_model::Scene;
use blindgrasp_record::table::{Cell, Kind, Layout as _};
use blindgrasp_sim::Simulation;
use std::path::Path;
use table::Columns;

/// The cell of a column by its name.
fn cell<'a>(columns: &'a Columns<'_>, row: &'a Row, name: &str) -> Cell<'a> {
    let at = columns.headings().position(|heading| heading.name == name);
    columns.cell(row, at.unwrap_or_else(|| panic!("no column {name}")))
}

#[test]
fn columns_have_the_types_of_their_keys() {
    let axes = [
        "control.force_n=4,5",
        "control.amplifier_start_ms=0..1:2",
        "plant.gravity_on_object=true,false",
        "object=cube,prism",
        "hand.joint.*.encoder_counts_per_turn=20000,21600",
        "hand.joint.finger-2-flex-1.mass_kg=1,2",
        "start.indentation_m=1e-4,equilibrium",
    ];
    let plan = plan("cube", &["duration_s=0.001"], &axes, 1).unwrap();
    let columns = Columns::new(&plan, &[]);
    let kinds: Vec<Kind> = columns.headings().skip(2).take(7).map(|heading| heading.kind).collect();
    let expected =
        [Kind::Double, Kind::Whole, Kind::Truth, Kind::Words, Kind::Double, Kind::Double, Kind::Words];
    assert_eq!(kinds, expected);
    let row = Row { run: plan.runs() - 1, outcome: Outcome::Refused("for this reason".into()) };
    assert_eq!(cell(&columns, &row, axes[0].split_once('=').unwrap().0), Cell::Double(5.0));
    assert_eq!(cell(&columns, &row, "control.amplifier_start_ms"), Cell::Whole(1));
    assert_eq!(cell(&columns, &row, "plant.gravity_on_object"), Cell::Truth(false));
    assert_eq!(cell(&columns, &row, "object"), Cell::Word("prism"));
    assert_eq!(cell(&columns, &row, "start.indentation_m"), Cell::Word("equilibrium"));
    assert_eq!(cell(&columns, &row, "refused"), Cell::Word("for this reason"));
    for name in ["grasp_held", "friction_demand_max", "configuration"] {
        assert_eq!(cell(&columns, &row, name), Cell::Missing, "{name}");
    }
}

#[test]
fn there_are_columns_for_as_many_fingers_as_any_hand_has() {
    let plan = plan("two-finger-prism", &["duration_s=0.01"], &["hand=two-finger,three-finger"], 1).unwrap();
    let rows = run(&plan);
    let columns = Columns::new(&plan, &rows);
    let of_finger = columns.headings().filter(|heading| heading.name.starts_with("finger_")).count();
    assert_eq!(of_finger, 8, "{rows:?}");
    assert!(
        matches!(cell(&columns, &rows[0], "finger_2.normal_force_n"), Cell::Double(force) if force > 0.0)
    );
    assert_eq!(
        cell(&columns, &rows[1], "finger_2.normal_force_n"),
        Cell::Missing,
        "three fingers, two contacts"
    );
}

/// A key that is varied takes the place of the column of its name.
#[test]
fn no_name_is_there_twice() {
    let plan = plan("cube", &["sensors.noise_counts=0.1"], &["seed=3,4", "duration_s=0.01,0.02"], 1).unwrap();
    let rows = run(&plan);
    let columns = Columns::new(&plan, &rows);
    let mut names: Vec<&str> = columns.headings().map(|heading| heading.name).collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
    assert_eq!(cell(&columns, &rows[3], "seed"), Cell::Whole(4));
    assert_eq!(cell(&columns, &rows[3], "duration_s"), Cell::Double(0.02));
}

#[test]
fn the_configuration_of_a_row_reproduces_it() {
    let set = ["duration_s=0.3", "sensors.noise_counts=0.5"];
    let axes = ["control.force_n=3..5:2", "object=cube,prism", "hand.joint.*.mass_kg=1e-3,2e-3"];
    let plan = plan("cube", &set, &axes, 2).unwrap();
    let rows = run(&plan);
    let columns = Columns::new(&plan, &rows);
    let mut ran = 0;
    for row in &rows {
        if row.summary().is_none() {
            continue;
        }
        let Cell::Text(text) = cell(&columns, row, "configuration") else { panic!("it has one") };
        let scene = Scene::parse(&text, "row.toml", Path::new(""), &[]).unwrap();
        let again = Simulation::new(&scene).unwrap().run().summary;
        assert_eq!(cell(&columns, row, "seed"), Cell::Whole(scene.seed.into()));
        let again = Row { run: row.run, outcome: Outcome::Ran(Box::new(again)) };
        for heading in columns.headings().filter(|heading| heading.name != "configuration") {
            assert_eq!(
                cell(&columns, &again, heading.name),
                cell(&columns, row, heading.name),
                "{}",
                heading.name
            );
        }
        ran += 1;
    }
    assert!(ran >= 8, "{ran} of {} ran: not much of a test", rows.len());
}
