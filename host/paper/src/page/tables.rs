//! The choices, the paper's tables as the scenes have them, and the runs.

use super::section as section_with;
use crate::choices::Choice;
use crate::claim::number;
use crate::evidence::{Done, Evidence};
use crate::figures::gains;
use maud::{Markup, html};

pub(super) fn choices(choices: &[Choice]) -> Markup {
    section_with(
        "choices",
        html! {
            p.faint { "Where the paper is silent or contradicts itself: what was chosen, and how much the answer hangs on it." }
            table.stack {
                thead {
                    tr {
                        th scope="col" { "Where" } th scope="col" { "Printed" } th scope="col" { "Chosen" }
                        th scope="col" { "What hangs on it" }
                    }
                }
                tbody {
                    @for choice in choices {
                        tr {
                            th scope="row" { (choice.place) }
                            td data-label="printed" { (choice.printed) }
                            td data-label="chosen" { (choice.chosen) }
                            td data-label="what hangs on it" { (choice.depends) }
                        }
                    }
                }
            }
        },
    )
}

pub(super) fn tables(evidence: &Evidence) -> Markup {
    let systems = [
        ("hand-arm", "Tables I to III: hand-arm and object of the simulation"),
        ("prism", "Tables IV to VII: hand and prism of the experiments"),
        ("cube", "Tables IV to VII: hand and cube of the experiments"),
    ];
    section_with(
        "tables",
        html! {
            p.faint { "The paper's tables as the scenes have them: what was really simulated." }
            @for (name, title) in systems {
                @if let Ok(done) = evidence.run(name) { (system(title, done)) }
            }
        },
    )
}

fn system(title: &str, done: &Done) -> Markup {
    let (scene, file) = (&done.scene, &done.scene.file);
    let vector = |values: &[f64]| values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", ");
    html! {
        article {
            h3 { (title) }
            p.small { (gains(scene)) }
            table.stack {
                caption { "Joints and links" }
                thead {
                    tr {
                        th scope="col" { "Joint" } th.number scope="col" { "Start, rad" } th.number scope="col" { "C, N m s/rad" }
                        th.number scope="col" { "Link, kg" } th scope="col" { "Centre of mass, m" } th scope="col" { "Inertia about it, kg m\u{b2}" }
                    }
                }
                tbody {
                    @for (joint, angle) in file.hand.joints.iter().zip(&scene.start.angles_rad) {
                        tr {
                            th scope="row" { (joint.name) }
                            td.number data-label="start, rad" { (format!("{angle:.3}")) }
                            td.number data-label="C, N m s/rad" { (number(joint.damping_gain_nm_s_rad)) }
                            td.number data-label="link, kg" { (number(joint.mass_kg)) }
                            td data-label="centre of mass, m" { (vector(&joint.mass_centre_m)) }
                            td data-label="inertia, kg m\u{b2}" { (vector(&joint.inertia_kg_m2.0)) }
                        }
                    }
                }
            }
            table.stack {
                caption { "Fingertips and object" }
                thead { tr { th scope="col" { "What" } th scope="col" { "Values" } } }
                tbody {
                    @for tip in &file.hand.fingertips {
                        tr {
                            th scope="row" { "fingertip " (tip.name) }
                            td {
                                "r " (number(tip.radius_m)) " m, k " (number(tip.stiffness_n_m2)) " N/m\u{b2}, \u{3be} "
                                (number(tip.damping_n_s_m_per_m2)) " and b " (number(tip.torsional_damping_nm_s_rad_per_m2))
                                " for each square metre of contact"
                            }
                        }
                    }
                    tr {
                        th scope="row" { "object " (scene.object_name) }
                        td {
                            (number(scene.mass_kg)) " kg, inertia "
                            (vector(&[scene.inertia_kg_m2[(0, 0)], scene.inertia_kg_m2[(1, 1)], scene.inertia_kg_m2[(2, 2)]]))
                            " kg m\u{b2}, " (scene.object.faces.len()) " faces, centre of mass at "
                            (vector(scene.start.position_m.as_slice())) " m"
                        }
                    }
                    tr {
                        th scope="row" { "indentations at the start" }
                        td { (vector(&scene.start.indentations_m.iter().map(|m| 1e3 * m).collect::<Vec<_>>())) " mm" }
                    }
                }
            }
        }
    }
}

pub(super) fn runs(evidence: &Evidence) -> Markup {
    section_with(
        "runs",
        html! {
            table.stack {
                thead {
                    tr {
                        th scope="col" { "Run" } th scope="col" { "What" } th scope="col" { "Outcome" }
                        th.number scope="col" { "Simulated, s" } th.number scope="col" { "Computed in, s" }
                    }
                }
                tbody { @for done in &evidence.runs { (run(done)) } }
            }
        },
    )
}

fn run(done: &Done) -> Markup {
    let summary = done.summary();
    html! {
        tr {
            th scope="row" { (done.name) }
            td {
                (done.what)
                span.remark { "Scene " (done.scene.name) @for setting in &done.settings { ", " code { (setting) } } }
            }
            td data-label="outcome" {
                @match (summary.lost_at_s, &summary.lost_reason) {
                    (Some(t_s), Some(reason)) => { span.lost { "lost" } " at " (format!("{t_s:.2}")) " s: " (reason) },
                    _ => { span.held { "held" } },
                }
            }
            td.number data-label="simulated, s" { (format!("{:.1}", summary.duration_s)) }
            td.number data-label="computed in, s" { (format!("{:.1}", summary.wall_s)) }
        }
    }
}
