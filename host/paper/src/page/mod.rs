//! The report as one HTML file: everything is in it, nothing is fetched, nothing runs.
//!
//! It is read on a telephone, on a screen, in the dark and on paper; the style sheet does all of that. Charts are SVG elements
//! of single panels that flow into as many columns as there is room for, with legends of text, so that nothing shrinks to what
//! can't be read.

mod claims;
mod earlier;
mod figures;
mod summary;
mod sweeps;
mod tables;

use super::report::Paper;
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("style.css");

/// The page.
///
/// # Errors
/// A figure that can't be drawn.
pub(super) fn page(paper: &Paper) -> Result<String, String> {
    let figures = figures::section(&paper.figures)?;
    let sweeps = sweeps::section(&paper.sweeps)?;
    let cube = paper.figures.iter().find(|drawn| drawn.file == "fig-13-cube-pictures");
    let words = "The hand of the experiments holds the cube";
    let picture = cube.map(|drawn| figures::last_picture(drawn, words)).transpose()?.flatten();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "Dynamic grasping of an arbitrary polyhedral object, run and checked" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "The paper, run and checked" }
                    p.lead {
                        "A. Kawamura, K. Tahara, R. Kurazume, T. Hasegawa, " cite { "Dynamic grasping of an arbitrary polyhedral object" }
                        ": its simulation and its experiments, simulated with the controller of blindgrasp; the counterparts of its \
                         figures; and each of its claims with what was measured."
                    }
                    div.opening {
                        (summary::summary(paper))
                        @if let Some(picture) = &picture { (picture) }
                    }
                    (claims::tally(paper))
                    nav aria-label="Sections" {
                        ul {
                            @for (id, title) in SECTIONS { li { a href={ "#" (id) } { (title) } } }
                        }
                    }
                }
                main {
                    (claims::section(paper))
                    (figures)
                    (earlier::section(&paper.comparison, &paper.polyhedra))
                    (sweeps)
                    (tables::choices(&paper.choices))
                    (tables::tables(&paper.evidence))
                    (tables::runs(&paper.evidence))
                }
                footer {
                    p.small {
                        "Written by " code { "blindgrasp paper" } " " (env!("CARGO_PKG_VERSION")) ": "
                        (paper.evidence.runs.len()) " runs and " (paper.sweeps.iter().map(|sweep| sweep.rows.len()).sum::<usize>())
                        " runs of sweeps in " (format!("{:.0}", paper.wall_s)) " s on " (paper.cores) " cores. All numbers on this page \
                         are of this run."
                    }
                }
            }
        }
    };
    Ok(page.into_string())
}

const SECTIONS: [(&str, &str); 7] = [
    ("claims", "Claims"),
    ("figures", "Figures"),
    ("earlier", "The earlier law"),
    ("sensitivity", "Sensitivity"),
    ("choices", "Choices"),
    ("tables", "Tables"),
    ("runs", "Runs"),
];

/// A section with its heading.
fn section(id: &str, content: Markup) -> Markup {
    let title = SECTIONS.iter().find(|(of, _)| *of == id).map_or("", |(_, title)| title);
    html! {
        section aria-labelledby=(id) {
            h2.major[id != "claims"] id=(id) { (title) }
            (content)
        }
    }
}
