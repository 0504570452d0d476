//! The sweeps: a table each.

use super::section as section_with;
use crate::paper::claim::percent;
use crate::paper::sensitivity::{Point, Sweep};
use maud::{Markup, html};

pub(super) fn section(sweeps: &[Sweep]) -> Markup {
    section_with(
        "sensitivity",
        html! {
            p.faint {
                "One quantity at a time, up to where the grasp fails. The value of the experiments is marked; "
                code { "blindgrasp sim SCENE --set KEY=VALUE" } " does one run of any of them."
            }
            div.sweeps { @for sweep in sweeps { (table(sweep)) } }
        },
    )
}

fn table(sweep: &Sweep) -> Markup {
    let unit = if sweep.unit.is_empty() { String::new() } else { format!(", {}", sweep.unit) };
    html! {
        article {
            h3 { (sweep.what) }
            p.place { "Scene " (sweep.scene) ", " code { (sweep.key) } @for setting in &sweep.settings { ", " code { (setting) } } }
            table {
                thead { tr { th.number scope="col" { "Value" (unit) } th scope="col" { "Grasp" } th.number scope="col" { "Off Eq. 57" } } }
                tbody { @for point in &sweep.points { (line(point, point.value == sweep.usual)) } }
            }
        }
    }
}

fn line(point: &Point, usual: bool) -> Markup {
    html! {
        tr {
            th.number scope="row" { (point.value) @if usual { " \u{25c2}" } }
            td {
                @match (point.lost_at_s, point.settle_time_s) {
                    (Some(t_s), _) => { span.lost { "\u{2717} lost" } " at " (format!("{t_s:.2}")) " s" },
                    (None, Some(t_s)) => { span.held { "\u{2713} held" } ", rest from " (format!("{t_s:.2}")) " s" },
                    (None, None) => { span.held { "\u{2713} held" } ", moving" },
                }
            }
            td.number { @if point.held { (percent(point.normal_error)) } @else { "\u{2013}" } }
        }
    }
}
