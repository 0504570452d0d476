//! The rows of a sweep as a table.

use super::plan::Plan;
use super::run::{Outcome, Row};
use blindgrasp_record::table::{Cell, Heading, Kind, Layout};
use blindgrasp_sim::summary::{Last, Summary};

/// The cell of a column for a run that ran, and for each finger at its end.
type OfSummary = fn(&Summary) -> Cell<'_>;
type OfFingers = fn(&Last) -> &[f64];

/// A column: name, kind, unit, words, and where its values come from.
#[derive(Clone, Copy)]
struct Described<V>(&'static str, Kind, &'static str, &'static str, V);

#[rustfmt::skip]
const OF_RUN: [Described<Source>; 2] = [
    Described("run", Kind::Whole, "", "number of the run, from 1", Source::Run),
    Described("seed", Kind::Whole, "", "seed of the noise", Source::Seed),
];

#[rustfmt::skip]
const OF_REFUSAL: Described<Source> =
    Described("refused", Kind::Words, "", "why the scene refuses the values; nothing was run then", Source::Refused);

#[rustfmt::skip]
const OF_SUMMARY: [Described<OfSummary>; 16] = [
    Described("grasp_held", Kind::Truth, "", "whether every fingertip stayed on its face to the end", |s| Cell::Truth(s.grasp_held)),
    Described("lost_at_s", Kind::Double, "s", "when the grasp was lost", |s| double(s.lost_at_s)),
    Described("lost_reason", Kind::Words, "", "why the grasp was lost", |s| words(s.lost_reason.as_ref())),
    Described("fault", Kind::Words, "", "the fault that the controller ended in", |s| words(s.fault.as_ref())),
    Described("settled", Kind::Truth, "", "whether everything was at rest in the end", |s| Cell::Truth(s.settled)),
    Described("settle_time_s", Kind::Double, "s", "the time from which on everything was at rest", |s| double(s.settle_time_s)),
    Described("duration_s", Kind::Double, "s", "simulated time", |s| Cell::Double(s.duration_s)),
    Described("friction_demand_max", Kind::Double, "", "largest ratio of tangential to normal force", |s| Cell::Double(s.friction_demand_max)),
    Described("energy_initial_j", Kind::Double, "J", "energy of Eq. 40 at the start", |s| Cell::Double(s.energy.initial_j)),
    Described("energy_final_j", Kind::Double, "J", "energy of Eq. 40 at the end", |s| Cell::Double(s.energy.final_j)),
    Described("energy_increase_max_j", Kind::Double, "J", "the most that it ever rose above an earlier value", |s| Cell::Double(s.energy.increase_max_j)),
    Described("joint_speed_max_rad_s", Kind::Double, "rad/s", "fastest joint at the end", |s| Cell::Double(s.last.joint_speed_max_rad_s)),
    Described("object_speed_m_s", Kind::Double, "m/s", "speed of the object at the end", |s| Cell::Double(s.last.object_speed_m_s)),
    Described("object_spin_rad_s", Kind::Double, "rad/s", "angular speed of the object at the end", |s| Cell::Double(s.last.object_spin_rad_s)),
    Described("force_residual_n", Kind::Double, "N", "largest residual force of Eq. 38 at the end", |s| Cell::Double(s.last.force_residual_n)),
    Described("moment_residual_nm", Kind::Double, "N m", "largest residual moment of Eq. 38 at the end", |s| Cell::Double(s.last.moment_residual_nm)),
];

#[rustfmt::skip]
const OF_FINGER: [Described<OfFingers>; 4] = [
    Described("normal_force_n", Kind::Double, "N", "normal force at the end", |last| &last.normal_force_n),
    Described("desired_normal_force_n", Kind::Double, "N", "the normal force that Eq. 57 asks for at the end", |last| &last.desired_normal_force_n),
    Described("tangential_force_n", Kind::Double, "N", "tangential force at the end", |last| &last.tangential_force_n),
    Described("indentation_m", Kind::Double, "m", "indentation at the end", |last| &last.indentation_m),
];

#[rustfmt::skip]
const OF_CONFIGURATION: Described<Source> =
    Described("configuration", Kind::Words, "", "effective configuration (TOML): a scene that reproduces this run", Source::Configuration);

/// A column of a table.
struct Column {
    name: String,
    kind: Kind,
    unit: &'static str,
    words: &'static str,
    source: Source,
}

impl<V> Described<V> {
    fn column(self, name: impl Fn(&str) -> String, source: impl FnOnce(V) -> Source) -> Column {
        let Self(own, kind, unit, words, value) = self;
        Column { name: name(own), kind, unit, words, source: source(value) }
    }
}

/// The source of a column's values.
#[derive(Clone, Copy)]
enum Source {
    Run,
    Seed,
    Axis(usize),
    Refused,
    Summary(OfSummary),
    Finger(usize, OfFingers),
    Configuration,
}

/// The columns of a sweep's table: the run, what is varied, what came of it, and its effective configuration. A row depends
/// on its run alone: nothing in it says when or how fast it was run.
pub(super) struct Columns<'a> {
    plan: &'a Plan,
    columns: Vec<Column>,
}

impl<'a> Columns<'a> {
    /// For some rows: there are columns for as many fingers as any of them has.
    pub(super) fn new(plan: &'a Plan, rows: &[Row]) -> Self {
        let mut columns: Vec<Column> =
            OF_RUN.map(|column| column.column(str::to_owned, |source| source)).into();
        columns.extend(plan.axes().iter().enumerate().map(|(k, axis)| Column {
            name: axis.key.clone(),
            kind: plan.kind(k),
            unit: axis.unit(),
            words: "varied",
            source: Source::Axis(k),
        }));
        columns.push(OF_REFUSAL.column(str::to_owned, |source| source));
        columns.extend(OF_SUMMARY.map(|column| column.column(str::to_owned, Source::Summary)));
        let fingers = rows.iter().filter_map(Row::summary).map(|summary| summary.last.normal_force_n.len());
        for finger in 0..fingers.max().unwrap_or(0) {
            let name = |name: &str| format!("finger_{}.{name}", finger + 1);
            columns
                .extend(OF_FINGER.map(|column| column.column(name, |values| Source::Finger(finger, values))));
        }
        columns.push(OF_CONFIGURATION.column(str::to_owned, |source| source));
        // A key that is varied stands for the column of the same name.
        let is_varied = |column: &Column| plan.axes().iter().any(|axis| axis.key == column.name);
        columns.retain(|column| matches!(column.source, Source::Axis(_)) || !is_varied(column));
        Self { plan, columns }
    }
}

impl Layout for Columns<'_> {
    type Row = Row;

    fn row_name(&self) -> &str {
        "run"
    }

    fn headings(&self) -> impl Iterator<Item = Heading<'_>> {
        self.columns.iter().map(|column| Heading {
            name: &column.name,
            kind: column.kind,
            unit: column.unit,
            words: column.words,
        })
    }

    fn cell<'a>(&'a self, row: &'a Row, column: usize) -> Cell<'a> {
        let Column { kind, source, .. } = &self.columns[column];
        match (source, &row.outcome) {
            (Source::Run, _) => Cell::Whole(row.run as i64 + 1),
            (Source::Seed, _) => Cell::Whole(self.plan.seed(row.run).into()),
            (Source::Axis(k), _) => {
                let value = &self.plan.axes()[*k].values[self.plan.place(row.run)[*k]];
                match (kind, value.number) {
                    (Kind::Whole, Some(number)) => Cell::Whole(number as i64),
                    (Kind::Double, Some(number)) => Cell::Double(number),
                    (Kind::Truth, _) => Cell::Truth(value.text == "true"),
                    _ => Cell::Word(&value.text),
                }
            }
            (Source::Refused, Outcome::Refused(reason)) => Cell::Word(reason),
            (_, Outcome::Refused(_)) | (Source::Refused, _) => Cell::Missing,
            (Source::Summary(value), Outcome::Ran(summary)) => value(summary),
            (Source::Finger(finger, values), Outcome::Ran(summary)) => {
                double(values(&summary.last).get(*finger).copied())
            }
            (Source::Configuration, Outcome::Ran(_)) => {
                self.plan.file(row.run).map_or(Cell::Missing, |file| Cell::Text(file.to_toml()))
            }
        }
    }

    fn about(&self) -> Vec<(String, String)> {
        vec![
            ("scene".to_owned(), self.plan.name().to_owned()),
            ("swept_by".to_owned(), concat!("blindgrasp ", env!("CARGO_PKG_VERSION")).to_owned()),
        ]
    }
}

fn double(value: Option<f64>) -> Cell<'static> {
    value.map_or(Cell::Missing, Cell::Double)
}

fn words(value: Option<&String>) -> Cell<'_> {
    value.map_or(Cell::Missing, |words| Cell::Word(words))
}
