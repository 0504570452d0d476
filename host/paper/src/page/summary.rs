//! The results in a few sentences, for whoever reads no further.

use super::claims::{class, sign};
use crate::claim::{Verdict, number};
use crate::evidence::Done;
use crate::laws::Case;
use crate::report::Paper;
use crate::sensitivity::Limits;
use blindgrasp_sweep::Value;
use maud::{Markup, html};

pub(super) fn summary(paper: &Paper) -> Markup {
    let sentences =
        [theory(paper), stiffness(paper), arm(paper), polyhedra(paper), earlier(paper), friction(paper)];
    html! {
        section aria-labelledby="summary" {
            h2.first id="summary" { "In short" }
            ul.summary {
                @for (verdict, words, numbers) in sentences.into_iter().flatten() {
                    li {
                        span.verdict.(class(verdict)) aria-label=(verdict.words()) { (sign(verdict)) }
                        span { b { (words) } " " (numbers) }
                    }
                }
            }
        }
    }
}

type Sentence = Option<(Verdict, &'static str, String)>;

/// Returns the sentence on the theory in its own model, in continuous time.
fn theory(paper: &Paper) -> Sentence {
    let runs = ["prism-continuous", "cube-continuous"];
    let rows =
        paper.claims.iter().flat_map(|claim| &claim.rows).filter(|row| runs.contains(&row.run.as_str()));
    let verdicts: Vec<Verdict> = rows.map(|row| row.verdict).collect();
    let good = verdicts.iter().filter(|verdict| **verdict == Verdict::Reproduced).count();
    let worst = *verdicts.iter().min()?;
    let numbers = format!("{good} of {} checks on prism and cube are reproduced.", verdicts.len());
    Some((worst, "In the paper's own model, in continuous time, its theory holds.", numbers))
}

/// Returns the sentence on the use of `u_st`.
fn stiffness(paper: &Paper) -> Sentence {
    let [without, with] = ["cube-normal-only", "cube-continuous"].map(|name| paper.evidence.run(name).ok());
    let holds = without?.summary().lost_at_s.is_some() && with?.summary().grasp_held;
    let numbers = format!("Without it the cube is {}; with it, {}.", end(without?), end(with?));
    Some((Verdict::holds(holds), "The relative attitude u_st holds what normal forces can't.", numbers))
}

/// The simulation of Sec. 5.
fn arm(paper: &Paper) -> Sentence {
    let [printed, stiff] = ["hand-arm", "hand-arm-stiff"].map(|name| paper.evidence.run(name).ok());
    let gain = |done: &Done| number(done.scene.control.attitude_stiffness_nm());
    let numbers = format!(
        "With the printed K_st of {}\u{a0}N\u{a0}m it is {}; with {}\u{a0}N\u{a0}m, {}.",
        gain(printed?),
        end(printed?),
        gain(stiff?),
        end(stiff?)
    );
    let verdict = Verdict::holds(printed?.summary().grasp_held);
    Some((verdict, "The hand-arm of Sec. 5 needs a larger gain than is printed.", numbers))
}

/// The paper's title.
fn polyhedra(paper: &Paper) -> Sentence {
    let polyhedra = &paper.polyhedra;
    let [with, without] =
        [Case::PAPER, Case::NORMAL_ONLY].map(|case| 100.0 * polyhedra.share(polyhedra.held(case)));
    let count = polyhedra.outcomes.len();
    let numbers = format!(
        "Of {count} random convex ones {with:.0}\u{a0}% are held with u_st, {without:.0}\u{a0}% without."
    );
    Some((
        Verdict::of(with >= 100.0, with > without),
        "An arbitrary polyhedron is too much said, many more is not.",
        numbers,
    ))
}

/// The law before the paper's.
fn earlier(paper: &Paper) -> Sentence {
    let verdict = |key: &str| {
        let rows = paper.claims.iter().filter(|claim| claim.key == key).flat_map(|claim| &claim.rows);
        rows.map(|row| row.verdict).min()
    };
    let (pose, disturbs) = (verdict("earlier-pose")?, verdict("earlier-disturbs")?);
    let holds = disturbs == Verdict::Reproduced;
    let numbers = format!(
        "An arm {} u_st and {} the earlier integral; the final pose {}.",
        if holds { "does not feel" } else { "feels" },
        if holds { "feels" } else { "does not feel" },
        if pose == Verdict::Reproduced {
            "is what u_st determines better"
        } else {
            "is what the integral determines better, against the paper's words"
        }
    );
    Some((
        Verdict::of(holds && pose == Verdict::Reproduced, holds),
        "Against the earlier law, half is shown.",
        numbers,
    ))
}

/// Returns the sentence on the friction that the experiments rest on.
fn friction(paper: &Paper) -> Sentence {
    let sweep = paper.sweeps.iter().find(|sweep| sweep.varied.name == "friction")?;
    let Limits { below, .. } = sweep.limits()?;
    let lost = below?.lost;
    let numbers = format!(
        "At 1\u{a0}kHz, with encoders and a tick of delay, the cube is lost below {} of what is assumed.",
        Value::number(lost).text
    );
    Some((Verdict::Differs, "The experiments need friction in the joints.", numbers))
}

fn end(done: &Done) -> String {
    match (done.summary().lost_at_s, done.summary().settle_time_s) {
        (Some(t_s), _) => format!("lost after {t_s:.1}\u{a0}s"),
        (None, Some(t_s)) => format!("at rest after {t_s:.1}\u{a0}s"),
        (None, None) => format!("held for {:.0}\u{a0}s", done.summary().duration_s),
    }
}
