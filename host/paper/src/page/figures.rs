//! The figures: charts as SVG elements, pictures as bitmaps in the page.

use super::section as section_with;
use crate::figures::{Drawing, Drawn};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use blindgrasp_plots::{Axis, Dash, Figure, Line, Panel};
use blindgrasp_view::Strip;
use maud::{Markup, PreEscaped, html};

pub(super) fn section(figures: &[Drawn]) -> Result<Markup, String> {
    let figures = figures.iter().map(figure).collect::<Result<Vec<_>, _>>()?;
    Ok(section_with(
        "figures",
        html! {
            p.faint { "Numbers are those of the paper's figures. " code { "--out DIR" } " writes each as PNG and SVG too." }
            @for figure in &figures { (figure) }
        },
    ))
}

fn figure(drawn: &Drawn) -> Result<Markup, String> {
    let heading = match drawn.number {
        "new" => drawn.title.clone(),
        number => format!("Fig. {number}: {}", drawn.title),
    };
    let content = match &drawn.drawing {
        Drawing::Chart(chart) => panels(chart)?,
        Drawing::Strip(strip) => pictures(&drawn.title, strip)?,
    };
    Ok(html! {
        figure.strip[matches!(drawn.drawing, Drawing::Strip(_))] id=(drawn.file) {
            h3 { (heading) }
            (content)
            figcaption { (drawn.caption) }
        }
    })
}

fn panels(chart: &Figure) -> Result<Markup, String> {
    let drawn: Vec<(&Panel, Vec<u8>)> = chart
        .panels
        .iter()
        .enumerate()
        .filter_map(|(k, panel)| chart.panel_svg(k).map(|svg| svg.map(|svg| (panel, svg))))
        .collect::<Result<_, _>>()?;
    Ok(html! {
        div.panels {
            @for (panel, svg) in &drawn {
                div.panel {
                    h4 { (panel.heading) }
                    (PreEscaped(described(&String::from_utf8_lossy(svg), &words(chart, panel))))
                    ul.legend { @for line in &panel.lines { li { (key(line)) (line.name) } } }
                }
            }
        }
    })
}

/// The element with what it shows in words.
pub(super) fn described(svg: &str, words: &str) -> String {
    let label = html! { svg role="img" aria-label=(words) {} }.into_string();
    svg.replacen("<svg ", &label.replace("></svg>", " "), 1)
}

/// Returns the content of a panel, in words.
fn words(chart: &Figure, panel: &Panel) -> String {
    let values = panel.lines.iter().flat_map(|line| &line.values).filter(|value| value.is_finite());
    let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
        (least.min(*value), most.max(*value))
    });
    let end = chart.along.end();
    let names: Vec<&str> = panel.lines.iter().map(|line| line.name.as_str()).collect();
    let scale = if matches!(panel.axis, Axis::Decades(_)) { "logarithmic" } else { "" };
    let unit =
        [panel.unit, scale].into_iter().filter(|words| !words.is_empty()).collect::<Vec<_>>().join(", ");
    let unit = if unit.is_empty() { unit } else { format!(" ({unit})") };
    format!(
        "Line chart, {}: {}{unit} over {end} of {}; between {} and {}",
        panel.heading,
        panel.quantity,
        names.join(", "),
        crate::claim::number(least),
        crate::claim::number(most)
    )
}

/// A sample of a line.
fn key(line: &Line) -> Markup {
    let [r, g, b] = line.colour;
    let dash = match line.dash {
        Dash::Solid => String::new(),
        Dash::Broken(on, off) => format!("{on} {off}"),
    };
    html! {
        svg viewBox="0 0 32 10" aria-hidden="true" {
            line x1="0" y1="5" x2="32" y2="5" stroke=(format!("#{r:02X}{g:02X}{b:02X}")) stroke-width="2.4" stroke-dasharray=(dash) {}
        }
    }
}

/// The last picture of a strip, without a caption.
pub(super) fn last_picture(drawn: &Drawn, words: &str) -> Result<Option<Markup>, String> {
    let Drawing::Strip(strip) = &drawn.drawing else { return Ok(None) };
    let Some(png) = strip.times_s.len().checked_sub(1).and_then(|last| strip.picture_png(last)) else {
        return Ok(None);
    };
    let source = format!("data:image/png;base64,{}", STANDARD.encode(png?));
    Ok(Some(html! { img.hero src=(source) width="480" height="400" alt=(words); }))
}

fn pictures(title: &str, strip: &Strip) -> Result<Markup, String> {
    let files: Vec<(f64, String)> = strip
        .times_s
        .iter()
        .enumerate()
        .filter_map(|(k, t_s)| strip.picture_png(k).map(|png| png.map(|png| (*t_s, STANDARD.encode(png)))))
        .collect::<Result<_, _>>()?;
    Ok(html! {
        div.pictures {
            @for (t_s, png) in &files {
                img src={ "data:image/png;base64," (png) } width="480" height="400"
                    alt=(format!("{title} at {t_s} s: fingers, object and contact forces, seen from the side"));
            }
        }
    })
}
