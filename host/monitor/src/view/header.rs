//! The lines at the top: who, how, what is wrong, what was answered, and how the link is.

use super::super::model::{Level, Link, Model};
use super::{Screen, Source, fit, fixed};
use blindgrasp_shared::event::Event;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_wire::{label, potentials, scalars};
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use std::time::Duration;

/// Time for which an event stays in the header.
const STAYS: Duration = Duration::from_secs(10);
/// Without a record for so long, what is shown is said to be old.
const OLD: Duration = Duration::from_millis(500);

/// The lines of the header, the least important last.
pub(super) fn lines<'a>(model: &'a Model, screen: &Screen<'a>, now: Duration, width: u16) -> [Line<'a>; 5] {
    let width = usize::from(width);
    [
        state(model, screen, now, width),
        wrong(model, screen, width),
        latest(model, screen, now, width),
        link(model, screen, now, width),
        identity(model, screen, width),
    ]
}

/// The mode, what acts, and how long the heartbeat may fail.
fn state<'a>(model: &'a Model, screen: &Screen<'a>, now: Duration, width: usize) -> Line<'a> {
    let palette = screen.palette;
    let mut parts = Vec::new();
    match model.link() {
        Link::Open => {}
        Link::Waiting => parts.push(Span::styled(" NO ANSWER YET ", palette.selected())),
        Link::Cut { since, words } => {
            let style = palette.bad().add_modifier(Modifier::REVERSED);
            parts.push(Span::styled(" NO LINK ", style));
            let seconds = now.saturating_sub(*since).as_secs_f64();
            parts.push(Span::styled(format!("for {seconds:.0} s, trying again: {words}"), palette.bad()));
        }
    }
    let Some(record) = model.record() else { return fit(parts, width) };
    let mode = record.mode;
    let is_open = *model.link() == Link::Open;
    let words = mode.words().to_uppercase();
    let style = palette.mode(mode);
    parts.push(match is_open {
        true => Span::styled(format!(" {words} "), style),
        false => Span::styled(format!("was {words}"), Style::new()),
    });
    if !is_open {
        return fit(parts, width);
    }
    if let Some(left_ms) = model.heartbeat_left_ms(now) {
        let most_ms = model.heartbeat_ms().unwrap_or(0.0);
        let style = if left_ms < most_ms / 3.0 { palette.bad() } else { Style::new() };
        let words = format!("heartbeat: {:.0} of {most_ms:.0} ms left", left_ms.max(0.0));
        parts.push(Span::styled(words, style));
    }
    if let Some(age) = model.record_at().map(|at| now.saturating_sub(at)).filter(|&age| age > OLD) {
        let words = format!("no record for {:.1} s", age.as_secs_f64());
        parts.push(Span::styled(words, palette.bad()));
    }
    for event in [Event::FallbackClock, Event::Unconfirmed] {
        if record.events.contains(event) {
            parts.push(Span::styled(event.words(), palette.warning()));
        }
    }
    for (k, (signal, value)) in scalars(record).into_iter().enumerate() {
        // What does not act says nothing, and potentials have a plot.
        let is_shown = signal.unit != "cycles" && !potentials().contains(&k) && value != 0.0;
        if is_shown {
            let digits = if value.abs() < 1.0 { 4 } else { 2 };
            parts.push(Span::raw(format!("{} {} {}", label(&signal), fixed(value, digits), signal.unit)));
        }
    }
    if let Some(time_s) = model.device_time_s() {
        parts.push(Span::styled(format!("device {time_s:.1} s"), palette.faint()));
    }
    fit(parts, width)
}

/// The fault with its remedy, joints that can't be read, and why the hand can't be armed.
fn wrong<'a>(model: &'a Model, screen: &Screen<'a>, width: usize) -> Line<'a> {
    let palette = screen.palette;
    let mut parts = Vec::new();
    let record = model.record();
    if let Some(raised) = record.and_then(|record| record.fault) {
        parts.push(Span::styled(format!("{raised}: {}", raised.fault.remedy()), palette.bad()));
    }
    if let Some(raised) = record.and_then(|record| record.reading_failed) {
        parts.push(Span::styled(format!("joints not read: {raised}"), palette.bad()));
    }
    if record.is_some_and(|record| record.fault.is_none()) && *model.link() == Link::Open {
        parts.push(Span::styled("no fault", palette.good()));
    }
    match (model.mode(), model.why_not_armed().filter(|_| screen.is_live())) {
        (Some(Mode::Fault), _) if screen.is_live() => {
            parts.push(Span::raw("c: clear it, once its cause is gone"));
        }
        (Some(Mode::Disarmed), Some(why)) => {
            parts.push(Span::styled(format!("arming is refused: {why}"), palette.warning()));
        }
        _ => {}
    }
    if let Some(Err(why)) = model.session().map(|session| &session.hand) {
        parts.push(Span::styled(format!("no angles: {why}"), palette.warning()));
    }
    fit(parts, width)
}

/// Returns the latest answers and events, the newest first.
fn latest<'a>(model: &'a Model, screen: &Screen<'a>, now: Duration, width: usize) -> Line<'a> {
    let palette = screen.palette;
    let recent = model.notices().take_while(|notice| now.saturating_sub(notice.at) < STAYS);
    let parts = recent.map(|notice| {
        let mark = if notice.level == Level::Info { "" } else { "! " };
        Span::styled(format!("{mark}{}", notice.words), palette.level(notice.level))
    });
    fit(parts.collect(), width)
}

/// Returns the line on the link's load and losses.
fn link<'a>(model: &'a Model, screen: &Screen<'a>, now: Duration, width: usize) -> Line<'a> {
    let palette = screen.palette;
    let Some(record) = model.record() else { return Line::default() };
    let counted = |name: &str, count: u64| {
        let style = if count > 0 { palette.warning() } else { Style::new() };
        let mark = if count > 0 { "!" } else { "" };
        Span::styled(format!("{name} {count}{mark}"), style)
    };
    let share = 100.0 * model.line_share(now);
    let mut parts = vec![
        Span::raw(format!("{:.0} records/s", model.records_s(now))),
        Span::raw(format!("{:.1} kB/s", 1e-3 * model.bytes_s(now))),
        Span::raw(format!("{share:.0} % of the line")),
        counted("lost", model.lost()),
        counted("CRC", model.damaged()),
        counted("late", u64::from(record.late_ticks)),
        counted("dropped", u64::from(record.dropped)),
    ];
    match record.decimation {
        0 | 1 => parts.push(Span::raw("each tick")),
        // Ahead of what may be cut off.
        every => parts.insert(1, Span::styled(format!("only 1 tick in {every}!"), palette.warning())),
    }
    if let Some(share) = model.tick_share() {
        parts.push(Span::raw(format!("tick {:.1} % ({} cycles)", 100.0 * share, record.cycles)));
    }
    fit(parts, width)
}

/// Returns the line on the hand's identity and port.
fn identity<'a>(model: &'a Model, screen: &Screen<'a>, width: usize) -> Line<'a> {
    let palette = screen.palette;
    let mut parts = match screen.source {
        Source::Port { port, saved } => {
            let saved = saved.map(|saved| Span::styled(format!("recording: {saved}"), palette.good()));
            [Some(Span::raw(format!("port {port}"))), saved].into_iter().flatten().collect::<Vec<_>>()
        }
        Source::Recording { file, device, .. } => vec![Span::raw(format!("{file}, {device}"))],
    };
    if let Some(session) = model.session() {
        parts.insert(0, Span::styled(format!("hand {}", session.hand_name), palette.title()));
        if let Some(number) = session.number {
            parts.push(Span::raw(format!("session {number}")));
        }
        parts.push(Span::raw(session.firmware.as_str()));
    }
    fit(parts, width)
}
