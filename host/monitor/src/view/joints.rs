//! A row a joint: where it is in its range, its torque in its limit, its speed, and what limits it.

use super::super::model::{Joint, Model};
use super::{Screen, cut, fixed};
use blindgrasp_shared::limit::Limiting;
use ratatui::text::{Line, Span};

/// Width from which on rows also tell the ends of ranges and the limits.
const WIDE: usize = 104;
/// Columns of a number.
const NUMBER: usize = 8;
/// Least columns of what limits.
const LIMITS: usize = 12;

/// The widths of the columns of a row.
struct Columns {
    name: usize,
    bar: usize,
    ends: bool,
}

impl Columns {
    fn of(model: &Model, width: usize) -> Self {
        let longest = model.joints().filter_map(|joint| joint.name.map(|name| name.chars().count())).max();
        let name = longest.unwrap_or(8).clamp(5, if width < WIDE { 15 } else { 24 });
        let ends = width >= WIDE;
        // Mark, name, three numbers; the ends of the range and the limit, or a space behind each bar.
        let fixed = 2 + name + 1 + 3 * (NUMBER + 1) + if ends { 6 + 7 + 7 } else { 2 };
        let bar = (width.saturating_sub(fixed + LIMITS) / 2).clamp(0, 25);
        Self { name, bar, ends }
    }
}

/// The title and the rows of some joints.
pub(super) fn lines<'a>(
    model: &'a Model,
    screen: &Screen<'a>,
    width: u16,
    rows: std::ops::Range<usize>,
) -> Vec<Line<'a>> {
    let width = usize::from(width);
    let columns = Columns::of(model, width);
    let mut lines = vec![Line::styled(cut(&title(model, &columns), width), screen.palette.title())];
    let joints = model.joints().enumerate().skip(rows.start).take(rows.len());
    lines.extend(joints.map(|(k, joint)| row(screen, &columns, k, &joint, width)));
    lines
}

fn title(model: &Model, columns: &Columns) -> String {
    let &Columns { name, bar, ends } = columns;
    let (angle, speed) = if model.hand().is_some() { ("rad", "rad/s") } else { ("count", "count/s") };
    let (range, torque) = if ends { (bar + 13, bar + 7) } else { (bar + 1, bar + 1) };
    format!(
        "  {:name$} {angle:>NUMBER$} {:range$}{:>NUMBER$} {:torque$}{speed:>NUMBER$} limited by",
        "joint", "in its range", "N m", "in its limit",
    )
}

fn row<'a>(
    screen: &Screen<'a>,
    columns: &Columns,
    index: usize,
    joint: &Joint<'a>,
    width: usize,
) -> Line<'a> {
    let &Columns { name, bar, ends } = columns;
    let palette = screen.palette;
    let is_chosen = screen.joint == Some(index);
    let number = |value: Option<f32>, digits: usize| {
        let words = value.map_or("-".into(), |value| fixed(value, digits));
        format!("{words:>NUMBER$} ")
    };
    let end = |value: Option<f32>| value.map_or("     ".into(), |value| format!("{value:>5.2}"));
    let title = joint.name.map_or_else(|| format!("joint {index}"), str::to_owned);
    let mark = if is_chosen { "> " } else { "  " };
    let name_style = if is_chosen { palette.selected() } else { Default::default() };
    let mut spans = vec![
        Span::raw(mark),
        Span::styled(format!("{:name$}", cut(&title, name)), name_style),
        Span::raw(" "),
    ];
    let angle = match (joint.angle_rad, joint.count) {
        (None, Some(count)) => format!("{count:>NUMBER$} "),
        (angle, _) => number(angle, 3),
    };
    spans.push(Span::raw(angle));
    let (lower, upper) = joint.range_rad.unzip();
    if ends {
        spans.push(Span::styled(end(lower) + " ", palette.faint()));
    }
    let (within, is_outside) = angle_bar(joint.angle_rad, joint.range_rad, bar);
    spans.push(Span::styled(within, if is_outside { palette.bad() } else { palette.good() }));
    spans.push(match ends {
        true => Span::styled(format!(" {:<6}", end(upper).trim()), palette.faint()),
        false => Span::raw(" "),
    });
    spans.push(Span::raw(number(joint.torque_nm, 3)));
    let is_limited = !joint.limiting.is_empty();
    let torque = torque_bar(joint.torque_nm, joint.most_nm, bar);
    spans.push(Span::styled(torque, if is_limited { palette.warning() } else { palette.good() }));
    spans.push(match joint.most_nm.filter(|_| ends) {
        Some(most) => Span::styled(format!(" {most:<6.2}"), palette.faint()),
        None if ends => "       ".into(),
        None => " ".into(),
    });
    let digits = if joint.angle_rad.is_some() { 3 } else { 0 };
    spans.push(Span::raw(number(joint.speed, digits)));
    let left = width.saturating_sub(spans.iter().map(Span::width).sum());
    spans.push(Span::styled(limited_by(joint.limiting, left), palette.warning()));
    Line::from(spans)
}

/// Returns the limit that acts, in as many words as there is room for; nothing where nothing does.
fn limited_by(limiting: Limiting, width: usize) -> String {
    if limiting.is_empty() {
        return String::new();
    }
    let words = limiting.to_string();
    if words.chars().count() <= width {
        return words;
    }
    cut(&words.replace(" limit", "").replace(" end", ""), width)
}

/// Returns the bar of an angle between the ends, and `true` if it is beyond one. A `!` stands where it is.
fn angle_bar(angle_rad: Option<f32>, range_rad: Option<(f32, f32)>, width: usize) -> (String, bool) {
    let (Some(angle), Some((lower, upper))) = (angle_rad, range_rad) else {
        return (" ".repeat(width), false);
    };
    if width < 3 {
        return (" ".repeat(width), false);
    }
    let share = (angle - lower) / (upper - lower);
    let is_outside = !(0.0..=1.0).contains(&share);
    let inner = width - 2;
    // A position is in the middle of its cell.
    let at = ((share.clamp(0.0, 1.0) * inner as f32) as usize).min(inner - 1);
    let mark = if is_outside { '!' } else { '●' };
    let cells = (0..inner).map(|cell| if cell == at { mark } else { '─' });
    (['├'].into_iter().chain(cells).chain(['┤']).collect(), is_outside)
}

/// A torque from the middle, to the left if it is negative; its end is the limit.
fn torque_bar(torque_nm: Option<f32>, most_nm: Option<f32>, width: usize) -> String {
    let (Some(torque), Some(most)) = (torque_nm, most_nm.filter(|&most| most > 0.0)) else {
        return " ".repeat(width);
    };
    let side = width.saturating_sub(1) / 2;
    if side == 0 {
        return " ".repeat(width);
    }
    let halves = ((torque.abs() / most).min(1.0) * 2.0 * side as f32).round() as usize;
    let filled = |cell: usize, half: char| match halves.saturating_sub(2 * cell) {
        0 => '·',
        1 => half,
        _ => '█',
    };
    let left = (0..side).rev().map(|cell| if torque < 0.0 { filled(cell, '▐') } else { '·' });
    let right = (0..side).map(|cell| if torque > 0.0 { filled(cell, '▌') } else { '·' });
    let bar: String = left.chain(['│']).chain(right).collect();
    format!("{bar:<width$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_show_where_a_value_is() {
        let range = Some((-1.0, 1.0));
        let angle = |rad| angle_bar(Some(rad), range, 12);
        assert_eq!(angle(-1.0), ("├●─────────┤".into(), false));
        assert_eq!(angle(0.05), ("├─────●────┤".into(), false));
        assert_eq!(angle(1.0), ("├─────────●┤".into(), false));
        assert_eq!(angle(1.01), ("├─────────!┤".into(), true));
        assert_eq!(angle(f32::NAN), ("├!─────────┤".into(), true));
        assert_eq!(angle_bar(None, range, 4), ("    ".into(), false));
        let torque = |nm| torque_bar(Some(nm), Some(1.0), 9);
        assert_eq!(torque(0.0), "····│····");
        assert_eq!(torque(0.5), "····│██··");
        assert_eq!(torque(-0.125), "···▐│····");
        assert_eq!(torque(0.375), "····│█▌··");
        assert_eq!(torque(-7.0), "████│····");
        assert_eq!(torque_bar(Some(1.0), None, 3), "   ");
        for width in 0..30 {
            assert_eq!(angle_bar(Some(0.3), range, width).0.chars().count(), width);
            assert_eq!(torque_bar(Some(0.3), Some(1.0), width).chars().count(), width);
        }
    }

    #[test]
    fn what_limits_is_said_in_words() {
        use blindgrasp_shared::limit::Limit;
        let mut limiting = Limiting::NONE;
        assert_eq!(limited_by(limiting, 20), "");
        limiting.insert(Limit::Torque);
        assert_eq!(limited_by(limiting, 20), "torque limit");
        limiting.insert(Limit::UpperStop);
        assert_eq!(limited_by(limiting, 40), "torque limit, upper end stop");
        assert_eq!(limited_by(limiting, 20), "torque, upper stop");
        assert_eq!(limited_by(limiting, 10), "torque, u…");
    }
}
