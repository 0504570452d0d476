//! The sweeps: where the grasp fails, at a glance; then a curve and its runs for each, and maps.

use super::figures::described;
use super::section as section_with;
use crate::claim::number;
use crate::sensitivity::{Limits, Sweep};
use blindgrasp_plots::sweep::{Curve, Map};
use blindgrasp_sim::summary::Summary;
use blindgrasp_sweep::{Edge, Picture, Row, Value, picture};
use maud::{Markup, PreEscaped, html};

pub(super) fn section(sweeps: &[Sweep]) -> Result<Markup, String> {
    let (curves, maps): (Vec<&Sweep>, Vec<&Sweep>) =
        sweeps.iter().partition(|sweep| sweep.varied.usual.is_some());
    let articles = curves.iter().map(|sweep| article(sweep)).collect::<Result<Vec<_>, _>>()?;
    let maps = maps.iter().map(|sweep| article(sweep)).collect::<Result<Vec<_>, _>>()?;
    Ok(section_with(
        "sensitivity",
        html! {
            p.faint {
                "One quantity at a time, up to where the grasp fails: a fingertip leaves its face, or rolls off it. That point is bisected to \
                 a tenth of its value. The model's fingertips never slip. "
                code { "blindgrasp sweep SCENE --vary KEY=VALUES --set KEY=VALUE --refine 0.1" } " does any of them."
            }
            (overview(&curves))
            (legend())
            div.sweeps { @for article in &articles { (article) } }
            @for map in &maps { (map) }
        },
    ))
}

/// Returns the table of the values at which the grasp fails, a line a sweep.
fn overview(sweeps: &[&Sweep]) -> Markup {
    html! {
        table.stack {
            caption { "Where the grasp fails, seen from the value of the scene" }
            thead {
                tr {
                    th scope="col" { "Varied" } th scope="col" { "Scene has" }
                    th scope="col" { "Fails below" } th scope="col" { "Fails above" }
                }
            }
            tbody {
                @for sweep in sweeps {
                    tr {
                        th scope="row" { a href={ "#sweep-" (sweep.varied.name) } { (sweep.varied.what) } }
                        td data-label="scene has" { (text(sweep.varied.usual.unwrap_or_default())) " " (sweep.unit()) }
                        @match sweep.limits() {
                            Some(Limits { below, above }) => {
                                td data-label="fails below" { (limit(sweep, below, "down to", f64::min)) }
                                td data-label="fails above" { (limit(sweep, above, "up to", f64::max)) }
                            }
                            None => { td { span.lost { "lost there" } } td {} }
                        }
                    }
                }
            }
        }
    }
}

/// Returns the value at which it fails in one direction, and its distance from the value of the scene.
fn limit(sweep: &Sweep, edge: Option<Edge>, direction: &str, extreme: fn(f64, f64) -> f64) -> Markup {
    let usual = sweep.varied.usual.unwrap_or_default();
    match edge {
        Some(Edge { held, lost }) => {
            let (many, of) = if held < usual { (usual / held, "less") } else { (held / usual, "more") };
            html! {
                span.lost { (text(lost)) } " " span.faint { "(held at " (text(held)) ")" }
                @if many > 1.0 && many.is_finite() { span.remark { (number(many)) " times " (of) } }
            }
        }
        None => {
            let numbers =
                sweep.plan.axes().iter().flat_map(|axis| &axis.values).filter_map(|value| value.number);
            let last = numbers.reduce(extreme).unwrap_or(usual);
            html! { span.held { "held " (direction) " " (text(last)) } }
        }
    }
}

fn text(value: f64) -> String {
    Value::number(value).text
}

/// Returns the legend of the curves.
fn legend() -> Markup {
    html! {
        ul.legend aria-label="Signs of the curves" {
            li { (sign(html! { circle cx="16" cy="5" r="4" fill="#0072B2" {} })) "held, at rest from" }
            li { (sign(html! { circle cx="16" cy="5" r="3.4" fill="none" stroke="#686E78" stroke-width="2" {} })) "held, still moving at the end" }
            li { (sign(html! { path d="M12 1 20 9 M12 9 20 1" stroke="#D55E00" stroke-width="2" {} })) "lost at" }
        }
    }
}

fn sign(drawn: Markup) -> Markup {
    html! { svg viewBox="0 0 32 10" aria-hidden="true" { (drawn) } }
}

fn article(sweep: &Sweep) -> Result<Markup, String> {
    let varied = &sweep.varied;
    let [held, runs] = sweep.held();
    let drawn = picture(&sweep.plan, &sweep.rows);
    let drawn = drawn.map(|picture| match picture {
        Picture::Curve(curve) => self::curve(sweep, &curve),
        Picture::Map(map) => self::map(sweep, &map),
    });
    Ok(html! {
        article.keep id={ "sweep-" (varied.name) } {
            h3 { (varied.what) }
            @if let Some(drawn) = drawn { (drawn?) }
            @if varied.usual.is_some() {
                p.small { (sweep.outcome()) "." @if let Some(reason) = reason(sweep) { " " (reason) } }
            } @else {
                p.small { "Held in " (held) " of " (runs) " runs." }
            }
            p.place {
                "Scene " (varied.scene) ", " @for axis in varied.axes { code { (axis.split('=').next().unwrap_or_default()) } " " }
                @for setting in varied.settings { code { (setting) } " " }
            }
            @if varied.usual.is_some() { (runs_of(sweep)) }
        }
    })
}

/// Returns the reasons of the losses, at the values next to those at which it is held.
fn reason(sweep: &Sweep) -> Option<String> {
    let Limits { below, above } = sweep.limits()?;
    let at = |edge: Edge| {
        let Summary { lost_at_s, lost_reason, .. } = sweep.summary(edge.lost)?;
        let reason = lost_reason.as_ref()?;
        Some(format!("At {} after {:.2} s: {reason}.", text(edge.lost), (*lost_at_s)?))
    };
    let reasons: Vec<String> = [below, above].into_iter().flatten().filter_map(at).collect();
    (!reasons.is_empty()).then(|| reasons.join(" "))
}

fn curve(sweep: &Sweep, curve: &Curve) -> Result<Markup, String> {
    let words =
        format!("Time to rest, or to the loss of the grasp, over {}: {}", sweep.key(), sweep.outcome());
    let svg = curve.panel_svg()?;
    Ok(html! { div.panel { (PreEscaped(described(&String::from_utf8_lossy(&svg), &words))) } })
}

fn map(sweep: &Sweep, map: &Map) -> Result<Markup, String> {
    let [held, runs] = sweep.held();
    let words = format!("Map of {}: held in {held} of {runs} runs", sweep.varied.what);
    let [fields, key] = map.panel_svgs()?;
    let key = String::from_utf8_lossy(&key).replacen("<svg ", "<svg aria-hidden=\"true\" ", 1);
    Ok(html! {
        div.map {
            (PreEscaped(described(&String::from_utf8_lossy(&fields), &words)))
            (PreEscaped(key))
        }
    })
}

/// All runs of a sweep, in the order of the values.
fn runs_of(sweep: &Sweep) -> Markup {
    let value = |row: &Row| sweep.plan.values(row.run).next().and_then(|value| value.number);
    let mut rows: Vec<(f64, &Row)> = sweep.rows.iter().filter_map(|row| Some((value(row)?, row))).collect();
    rows.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let unit = if sweep.unit().is_empty() { String::new() } else { format!(", {}", sweep.unit()) };
    html! {
        details {
            summary { (rows.len()) " runs, with the largest ratio of tangential to normal force at the end" }
            table {
                thead { tr { th.number scope="col" { "Value" (unit) } th scope="col" { "Grasp" } th.number scope="col" { "Ratio" } } }
                tbody {
                    @for (value, row) in rows {
                        tr {
                            th.number scope="row" { (text(value)) @if Some(value) == sweep.varied.usual { " \u{25c2}" } }
                            td { @if let Some(summary) = row.summary() { (ended(summary)) } @else { "refused" } }
                            td.number { @if let Some(ratio) = row.summary().and_then(ratio) { (number(ratio)) } @else { "\u{2013}" } }
                        }
                    }
                }
            }
        }
    }
}

fn ended(summary: &Summary) -> Markup {
    html! {
        @match (summary.lost_at_s, summary.settle_time_s) {
            (Some(t_s), _) => { span.lost { "\u{2717} lost" } " at " (format!("{t_s:.2}")) " s" },
            (None, Some(t_s)) => { span.held { "\u{2713} held" } ", rest from " (format!("{t_s:.2}")) " s" },
            (None, None) => { span.held { "\u{2713} held" } ", moving" },
        }
    }
}

/// The largest ratio of tangential to normal force at the end of a run that was held.
fn ratio(summary: &Summary) -> Option<f64> {
    let forces = summary.last.tangential_force_n.iter().zip(&summary.last.normal_force_n);
    let ratio = forces.map(|(tangential, normal)| tangential / normal).reduce(f64::max)?;
    summary.grasp_held.then_some(ratio)
}
