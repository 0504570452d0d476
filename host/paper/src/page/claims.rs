//! The claims.

use super::section as section_with;
use crate::claim::{Claim, Row, Verdict};
use crate::expected::expected;
use crate::report::Paper;
use maud::{Markup, html};

/// Returns the number of verdicts of each kind.
pub(super) fn tally(paper: &Paper) -> Markup {
    let count = |verdict| {
        paper.claims.iter().flat_map(|claim| &claim.rows).filter(|row| row.verdict == verdict).count()
    };
    html! {
        ul.tally {
            @for verdict in [Verdict::Reproduced, Verdict::Differs, Verdict::NotReproduced] {
                li { b class=(class(verdict)) { (count(verdict)) } (verdict.words()) }
            }
            li { b { (paper.claims.len()) } "claims, each in one run or several" }
        }
        @if paper.surprises.is_empty() {
            p { "Every verdict is the one that the documentation states." }
        } @else {
            p { strong { "Verdicts that are not those that the documentation states: " (paper.surprises.len()) } ", marked below." }
        }
    }
}

/// All claims at a glance.
fn overview(claims: &[Claim]) -> Markup {
    html! {
        table.stack {
            caption { "In how many runs each claim was reproduced, and in which it was not" }
            thead {
                tr {
                    th scope="col" { "Claim" } th scope="col" { "Place" } th scope="col" { "Reproduced" }
                    th scope="col" { "Not, or not quite" }
                }
            }
            tbody {
                @for claim in claims {
                    @let good = claim.rows.iter().filter(|row| row.verdict == Verdict::Reproduced).count();
                    tr {
                        th scope="row" { a href={ "#claim-" (claim.key) } { (claim.words) } }
                        td data-label="place" { (claim.place) }
                        td data-label="reproduced" {
                            span.reproduced[good > 0] { (good) " of " (claim.rows.len()) }
                        }
                        td {
                            @for row in claim.rows.iter().filter(|row| row.verdict != Verdict::Reproduced) {
                                span.part { span.verdict.(class(row.verdict)) { (sign(row.verdict)) } " " (row.run) } " "
                            }
                        }
                    }
                }
            }
        }
        p.small {
            span.verdict.reproduced { (sign(Verdict::Reproduced)) } " reproduced  "
            span.verdict.differs { (sign(Verdict::Differs)) } " differs as explained  "
            span.verdict.not-reproduced { (sign(Verdict::NotReproduced)) } " not reproduced"
        }
    }
}

fn article(claim: &Claim) -> Markup {
    html! {
        article id={ "claim-" (claim.key) } {
            h3 { (claim.words) }
            p.place { (claim.place) }
            dl.criterion {
                dt { "Criterion" } dd { (claim.criterion) }
                dt { "Tolerance" } dd { (claim.tolerance) }
            }
            table.stack {
                thead { tr { th scope="col" { "Run" } th scope="col" { "Measured" } th scope="col" { "Verdict" } } }
                tbody { @for row in &claim.rows { (line(claim, row)) } }
            }
        }
    }
}

fn line(claim: &Claim, row: &Row) -> Markup {
    let stated = expected(claim.key, &row.run);
    html! {
        tr {
            th scope="row" { (row.run) }
            td {
                (row.measured)
                @if !row.remark.is_empty() { span.remark { (row.remark) } }
            }
            td {
                span.verdict.(class(row.verdict)) { (sign(row.verdict)) " " (row.verdict.words()) }
                @if stated != Some(row.verdict) {
                    " " span.surprise { "stated: " (stated.map_or("nothing", Verdict::words)) }
                }
            }
        }
    }
}

/// A sign, so that nothing hangs on colour.
pub(super) fn sign(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Reproduced => "\u{2713}",
        Verdict::Differs => "\u{2248}",
        Verdict::NotReproduced => "\u{2717}",
    }
}

pub(super) fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Reproduced => "reproduced",
        Verdict::Differs => "differs",
        Verdict::NotReproduced => "not-reproduced",
    }
}

pub(super) fn section(paper: &Paper) -> Markup {
    section_with(
        "claims",
        html! { (overview(&paper.claims)) @for claim in &paper.claims { (article(claim)) } },
    )
}
