//! The plot: signals over the last seconds, in braille dots.

use super::super::history::Range;
use super::super::model::{Model, Plot};
use super::Screen;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Borders, Chart, Dataset, GraphType};
use std::time::Duration;

/// Dots of a braille character side by side.
const DOTS: usize = 2;

/// Markers of a few curves, with their pictures.
const MARKERS: [(Marker, &str); 3] =
    [(Marker::Braille, "fine"), (Marker::Dot, "dots"), (Marker::Block, "blocks")];

/// Draws the plot that is chosen.
pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, screen: &Screen<'_>, now: Duration) {
    let palette = screen.palette;
    let window = Duration::from_secs(screen.window_s);
    let joint = screen.joint.filter(|&joint| joint < model.joint_count());
    let signals = model.plotted(screen.plot, joint, now, window, DOTS * usize::from(area.width));
    let title = title(model, screen, joint);
    let block = Block::new().borders(Borders::TOP).title(Line::styled(title, palette.title()));
    let Some(bounds) = bounds(&signals) else {
        frame.render_widget(block.title_bottom("nothing is known yet"), area);
        return;
    };
    let curves: Vec<(usize, Vec<(f64, f64)>)> = signals
        .iter()
        .enumerate()
        .flat_map(|(number, columns)| {
            pieces(columns, screen.window_s as f64).map(move |piece| (number, piece))
        })
        .collect();
    let datasets = curves.iter().map(|(number, points)| {
        // Where a few are drawn together, their marks differ as well.
        let marker = MARKERS.get(*number).filter(|_| !screen.plot.signals().is_empty());
        let marker = marker.map_or(Marker::Braille, |&(marker, _)| marker);
        let graph = Dataset::default().graph_type(GraphType::Line).marker(marker);
        graph.style(palette.curve(*number)).data(points)
    });
    let [low, high] = bounds;
    let label = |value: f64| format!("{:>9}", number(value, high - low));
    let x_axis = Axis::default().bounds([-(screen.window_s as f64), 0.0]).style(palette.faint()).labels([
        format!("-{} s", screen.window_s),
        format!("-{} s", screen.window_s as f64 / 2.0),
        "now".into(),
    ]);
    let labels: Vec<String> = match area.height {
        // With the title and the times, there would be more labels than rows.
        0..=5 => vec![label(low), label(high)],
        _ => vec![label(low), label((low + high) / 2.0), label(high)],
    };
    let y_axis = Axis::default().bounds(bounds).style(palette.faint()).labels(labels);
    let chart = Chart::new(datasets.collect()).block(block).x_axis(x_axis).y_axis(y_axis);
    frame.render_widget(chart.legend_position(None), area);
}

fn title(model: &Model, screen: &Screen<'_>, joint: Option<usize>) -> String {
    let name = |joint: usize| {
        let known = model.hand().and_then(|hand| hand.joint_names.get(joint).cloned());
        known.unwrap_or_else(|| format!("joint {joint}"))
    };
    let what = match (screen.plot, model.hand().is_some()) {
        (Plot::Angles, false) => "counts".to_owned(),
        (Plot::Speeds, false) => "counts a second".to_owned(),
        (plot, _) => plot.words(),
    };
    let whose = match joint {
        _ if !screen.plot.is_of_joints() => {
            let names = screen.plot.signals();
            let named = names.iter().zip(MARKERS);
            let named = named.map(|(name, (_, looks))| format!("{name} ({looks})")).collect::<Vec<_>>();
            if named.is_empty() { String::new() } else { format!(": {}", named.join(", ")) }
        }
        None => ": all joints".into(),
        Some(joint) => format!(": {}", name(joint)),
    };
    format!(" {what}{whose}  ({} s; tab, w, arrows: others) ", screen.window_s)
}

/// Points of a curve, x from -window to 0; one list for each piece without a gap.
fn pieces(columns: &[Option<Range>], window_s: f64) -> impl Iterator<Item = Vec<(f64, f64)>> {
    let width_s = window_s / columns.len().max(1) as f64;
    // Slow records leave columns empty that are no gap.
    let most_empty = (0.5 / width_s).ceil() as usize;
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut empty = usize::MAX;
    for (k, column) in columns.iter().enumerate() {
        let Some(range) = column else {
            empty = empty.saturating_add(1);
            continue;
        };
        if empty > most_empty {
            pieces.push(Vec::new());
        }
        empty = 0;
        if let Some(piece) = pieces.last_mut() {
            let x = (k as f64 + 0.5) * width_s - window_s;
            piece.extend([(x, f64::from(range.least)), (x, f64::from(range.most))]);
        }
    }
    pieces.into_iter()
}

/// From the least to the greatest value of all, with some room.
fn bounds(signals: &[Vec<Option<Range>>]) -> Option<[f64; 2]> {
    let all = signals.iter().flatten().flatten().copied().reduce(Range::with)?;
    let (least, most) = (f64::from(all.least), f64::from(all.most));
    let room = (0.05 * (most - least)).max(1e-3 * most.abs().max(least.abs())).max(1e-6);
    Some([least - room, most + room])
}

/// A number with the digits that tell values apart that differ by a hundredth of the span.
fn number(value: f64, span: f64) -> String {
    let digits = (2.0 - span.abs().max(1e-9).log10().floor()).clamp(0.0, 7.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_broken_where_nothing_is_known_for_long() {
        let value = |value: f32| Some(Range { least: value, most: value });
        let mut columns = vec![value(1.0); 10];
        columns[5] = None;
        let count = |columns: &[_], window_s| pieces(columns, window_s).count();
        // A tenth of a second without records is how slow ones look; a second is a gap.
        assert_eq!(count(&columns, 1.0), 1);
        assert_eq!(count(&columns, 10.0), 1);
        columns[6] = None;
        assert_eq!(count(&columns, 1.0), 1);
        assert_eq!(count(&columns, 10.0), 2);
        assert_eq!(count(&[None; 4], 1.0), 0);
    }

    #[test]
    fn labels_have_the_digits_that_matter() {
        assert_eq!(number(0.123456, 1.0), "0.12");
        assert_eq!(number(0.123456, 0.01), "0.1235");
        assert_eq!(number(11_234.6, 5000.0), "11235");
        assert_eq!(bounds(&[vec![None]]), None);
        let flat = bounds(&[vec![Some(Range { least: 0.0, most: 0.0 })]]).expect("bounds");
        assert!(flat[0] < 0.0 && flat[1] > 0.0);
    }
}
