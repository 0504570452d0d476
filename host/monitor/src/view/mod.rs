//! The model as characters: everything that matters in 80 columns and 24 rows, the most important of it in less.
//!
//! Colour is never the only sign: the mode is a word, what is bad has a `!` or a word, and a joint that is chosen a `>`.

mod header;
mod joints;
mod palette;
mod plots;
#[cfg(test)]
mod tests;

pub use palette::Palette;

use super::model::{Model, Plot};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};
use std::time::Duration;

/// Rows of a plot, at least: title, times, and some between.
const PLOT_ROWS: u16 = 5;
/// Rows of a plot before anything else gets more room.
const GOOD_PLOT_ROWS: u16 = 8;
/// Rows of joints below which there is no plot.
const JOINT_ROWS: u16 = 5;
/// Most rows of the list of what happened.
const NOTICE_ROWS: u16 = 8;

/// The source of the view.
#[derive(Clone, Copy, Debug)]
pub enum Source<'s> {
    /// A line.
    Port {
        /// Its name.
        port: &'s str,
        /// The words on the recording so far, if there is one.
        saved: Option<&'s str>,
    },
    /// A recording.
    Recording {
        /// Its name.
        file: &'s str,
        /// The device of the recording.
        device: &'s str,
        /// Its length.
        length: Duration,
        /// The speed of playing, as a multiple of the recording's.
        speed: f64,
        /// `true` if it waits.
        is_paused: bool,
        /// `true` if it is on its way to where it was told to go.
        is_seeking: bool,
    },
}

/// The choices of the user.
#[derive(Clone, Copy, Debug)]
pub struct Screen<'s> {
    /// The source of the view.
    pub source: Source<'s>,
    /// The plot.
    pub plot: Plot,
    /// Its time, s.
    pub window_s: u64,
    /// The joint; `None` for all.
    pub joint: Option<usize>,
    /// `true` if the keys are explained.
    pub help: bool,
    /// The question, and how long it waits for an answer, s.
    pub question: Option<(&'s str, u64)>,
    /// `true` while keys move what is held.
    pub is_jogging: bool,
    /// Colours.
    pub palette: Palette,
}

impl Screen<'_> {
    fn is_live(&self) -> bool {
        matches!(self.source, Source::Port { .. })
    }
}

/// Draws everything.
pub fn draw(frame: &mut Frame<'_>, model: &Model, screen: &Screen<'_>, now: Duration) {
    let area = frame.area();
    let foot = foot(screen, now);
    // As many rows as the words need, so that no answer to a question is cut off.
    let foot_rows = (foot.width() as u16).div_ceil(area.width.max(1)).clamp(1, (area.height / 2).max(1));
    let head_rows = 5.min(area.height.saturating_sub(foot_rows));
    let rest = area.height - foot_rows - head_rows;
    let joints = model.joint_count() as u16 + 1;
    let plot_rows = match rest.saturating_sub(joints) {
        left @ PLOT_ROWS.. => left,
        _ if rest >= PLOT_ROWS + JOINT_ROWS => PLOT_ROWS,
        _ => 0,
    };
    let notice_rows = plot_rows.saturating_sub(GOOD_PLOT_ROWS).min(NOTICE_ROWS);
    // A title without a line is nothing.
    let notice_rows = if notice_rows < 2 { 0 } else { notice_rows };
    let [head, middle, plot, notices, bottom] = Layout::vertical([
        Constraint::Length(head_rows),
        Constraint::Length(rest - plot_rows),
        Constraint::Length(plot_rows - notice_rows),
        Constraint::Length(notice_rows),
        Constraint::Length(foot_rows),
    ])
    .areas(area);
    frame.render_widget(Paragraph::new(header::lines(model, screen, now, area.width).to_vec()), head);
    draw_joints(frame, middle, model, screen);
    if plot.height > 0 {
        plots::draw(frame, plot, model, screen, now);
    }
    if notices.height > 0 {
        draw_notices(frame, notices, model, screen, now);
    }
    frame.render_widget(Paragraph::new(foot).wrap(Wrap { trim: true }), bottom);
    if screen.help {
        draw_help(frame, area, screen);
    }
}

fn draw_joints(frame: &mut Frame<'_>, area: Rect, model: &Model, screen: &Screen<'_>) {
    if area.height == 0 {
        return;
    }
    let count = model.joint_count();
    if count == 0 {
        let words = "the joints are shown as soon as the hand answers";
        frame.render_widget(Paragraph::new(words).wrap(Wrap { trim: true }), area);
        return;
    }
    let room = usize::from(area.height).saturating_sub(1);
    // The chosen joint stays in sight.
    let chosen = screen.joint.unwrap_or(0);
    let first = (chosen + 1).saturating_sub(room).min(count.saturating_sub(room));
    frame.render_widget(Paragraph::new(joints::lines(model, screen, area.width, first..first + room)), area);
}

fn draw_notices(frame: &mut Frame<'_>, area: Rect, model: &Model, screen: &Screen<'_>, now: Duration) {
    let mut lines = vec![Line::styled(" what happened", screen.palette.title())];
    lines.extend(model.notices().take(usize::from(area.height) - 1).map(|notice| {
        let ago_s = now.saturating_sub(notice.at).as_secs_f64();
        Line::styled(format!("{ago_s:>8.1} s ago  {}", notice.words), screen.palette.level(notice.level))
    }));
    frame.render_widget(Paragraph::new(lines), area);
}

/// The last rows: a question, or the keys.
fn foot<'s>(screen: &Screen<'s>, now: Duration) -> Line<'s> {
    if let Some((words, left_s)) = screen.question {
        return Line::styled(format!("{words}  ({left_s} s)"), screen.palette.selected());
    }
    match screen.source {
        Source::Port { .. } if screen.is_jogging => {
            let words = "JOG  x y z: 1 mm along, u v w: 1 degree about; capitals: back  Esc: end  space STOP";
            Line::styled(words, screen.palette.selected())
        }
        Source::Port { .. } => {
            Line::raw("a arm  d disarm  g grasp  r release  space STOP  c clear fault  q quit  ? help")
        }
        Source::Recording { length, speed, is_paused, is_seeking, .. } => {
            let state = match (is_seeking, is_paused) {
                (true, _) => "SEEKING",
                (_, true) => "PAUSED",
                _ => "PLAYING",
            };
            let (now_s, length_s) = (now.as_secs_f64(), length.as_secs_f64());
            Line::raw(format!(
                "{state} {now_s:.2} of {length_s:.2} s, {speed} x  space, arrows, pages, + -  q quit  ? help"
            ))
        }
    }
}

const LIVE_KEYS: [&str; 16] = [
    "a            arm (asks first)",
    "p            move to a posture (asks which)",
    "g            grasp (asks first)",
    "j            move what is held by keys (asks first): a step a key",
    "k            weigh it (asks first)",
    "l            put it down (asks first)",
    "r            release (asks first)",
    "d            disarm (asks first if something may be held)",
    "space, s     STOP at once: no torque, what is held falls",
    "c            clear the fault",
    "Ctrl-C       stop at once; once more: quit",
    "q            quit (asks first if the hand has torque)",
    "tab, arrows  another plot; w: 5, 20 or 60 s",
    "up, down     one joint, or all",
    "y, Enter     yes to a question; Esc: no",
    "?            this list, or no longer",
];

const RECORDING_KEYS: [&str; 8] = [
    "space        pause, or go on",
    "left, right  a second back or on",
    "page up, dn  ten seconds back or on",
    "+ -          twice as fast, half as fast",
    "tab          another plot; w: 5, 20 or 60 s",
    "up, down     one joint, or all",
    "q, Ctrl-C    quit",
    "?            this list, or no longer",
];

fn draw_help(frame: &mut Frame<'_>, area: Rect, screen: &Screen<'_>) {
    let keys: &[&str] = if screen.is_live() { &LIVE_KEYS } else { &RECORDING_KEYS };
    let width = keys.iter().map(|line| line.len()).max().unwrap_or(0) as u16 + 4;
    let area = area.centered(Constraint::Length(width), Constraint::Length(keys.len() as u16 + 2));
    frame.render_widget(Clear, area);
    let lines: Vec<Line<'_>> = keys.iter().map(|&line| Line::raw(line)).collect();
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" keys ")), area);
}

/// As many of the parts as there is room for, the last one of them cut if need be.
fn fit(parts: Vec<Span<'_>>, width: usize) -> Line<'_> {
    let mut line = Line::default();
    for part in parts {
        let used = line.width();
        let gap = if used == 0 { 0 } else { 2 };
        let room = width.saturating_sub(used + gap);
        if part.width() > room && used > 0 && room < 12 {
            break;
        }
        if gap > 0 {
            line.push_span("  ");
        }
        let is_cut = part.width() > room;
        line.push_span(Span::styled(cut(&part.content, room), part.style));
        if is_cut {
            break;
        }
    }
    line
}

/// A number with so many digits behind the point; what is printed as zero has no sign.
fn fixed(value: f32, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        _ => text,
    }
}

/// A text in at most so many columns; `…` says that there was more.
fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let kept = text.chars().take(width.saturating_sub(1));
    if width == 0 { String::new() } else { kept.chain(['…']).collect() }
}
