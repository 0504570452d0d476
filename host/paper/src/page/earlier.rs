//! The laws over objects: a table.

use super::section as section_with;
use crate::claim::percent;
use crate::earlier::Comparison;
use crate::laws::{Case, Grasped};
use crate::polyhedra::{Outcome, Polyhedra};
use maud::{Markup, html};
use std::ops::RangeInclusive;

/// The numbers of faces that are shown together.
const FACES: [RangeInclusive<usize>; 4] = [4..=6, 7..=10, 11..=20, 21..=30];

pub(super) fn section(comparison: &Comparison, polyhedra: &Polyhedra) -> Markup {
    section_with(
        "earlier",
        html! {
            p {
                "References 14 and 15 have an integral of each joint's velocity where the paper has " i { "u_st" } ". The paper says what \
                 speaks against it, and does not show it. Its words are claims here ("
                a href="#claim-earlier-pose" { "pose" } ", " a href="#claim-earlier-force" { "force" } ", "
                a href="#claim-earlier-disturbs" { "disturbance" } ", " a href="#claim-earlier-expanded" { "shapes" } ", "
                a href="#claim-manipulation" { "manipulation" }
                "); " a href="#fig-earlier-law" { "the figure" } " shows pose and force by the way that the grasp took, over the gains; the \
                 table, what each law holds."
            }
            table.stack {
                caption {
                    "Held or lost, in the paper's model, with the law at 1 kHz; in brackets at 10 kHz, where that is different. Gains: K_st in N m, \
                     K_I in N m/rad"
                }
                thead {
                    tr {
                        th scope="col" { "Object" }
                        @for case in Case::ALL { th scope="col" { (case.words()) } }
                    }
                }
                tbody {
                    @for object in &comparison.objects {
                        tr {
                            th scope="row" { (object.name) ", " (object.duration_s) " s" }
                            @for case in Case::ALL {
                                td data-label=(case.words()) { @if let Some(grasped) = object.under(case) { (outcome(grasped)) } }
                            }
                        }
                    }
                    (shares(&format!("random polyhedra, {} s", polyhedra.duration_s), &polyhedra.outcomes.iter().collect::<Vec<_>>()))
                    @for range in &FACES {
                        (shares(
                            &format!("with {} to {} faces", range.start(), range.end()),
                            &polyhedra.outcomes.iter().filter(|outcome| range.contains(&outcome.faces)).collect::<Vec<_>>(),
                        ))
                    }
                }
            }
        },
    )
}

fn outcome(grasped: &Grasped) -> Markup {
    html! {
        @match (&grasped.lost, &grasped.lost_at_10_khz) {
            (None, _) => { span.held { "\u{2713} held" } },
            (Some(lost), Some(_)) => { span.lost { "\u{2717} lost" } " at " (format!("{:.2}", lost.at_s)) " s" },
            (Some(lost), None) => { span.lost { "\u{2717} lost" } " at " (format!("{:.2}", lost.at_s)) " s (held)" },
        }
    }
}

/// Returns the shares of some polyhedra that each law holds.
fn shares(name: &str, outcomes: &[&Outcome]) -> Markup {
    let held = |case, test: fn(&Grasped) -> bool| {
        outcomes.iter().filter(|outcome| outcome.under(case).is_some_and(test)).count()
    };
    html! {
        tr {
            th scope="row" { (name) }
            @for case in Case::ALL {
                @let (held, often) = (held(case, Grasped::held), held(case, Grasped::held_at_10_khz));
                td data-label=(case.words()) {
                    (held) " of " (outcomes.len())
                    @if !outcomes.is_empty() { ", " (percent(held as f64 / outcomes.len() as f64)) }
                    @if often != held { " (" (often) ")" }
                }
            }
        }
    }
}
