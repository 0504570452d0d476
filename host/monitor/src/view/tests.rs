//! The screen in many sizes, as characters.

use super::super::model::tests::{fed, ms, record, session};
use super::super::model::{Level, News};
use super::*;
use blindgrasp_shared::control::PerGain;
use blindgrasp_shared::fault::{Fault, Raised};
use blindgrasp_shared::limit::{Limit, Limiting};
use blindgrasp_shared::parameters::Parameter;
use blindgrasp_shared::supervisor::Mode;
use blindgrasp_shared::telemetry::List;
use blindgrasp_wire::Record;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;

const SCREEN: Screen<'static> = Screen {
    source: Source::Port { port: "/dev/ttyUSB0", saved: None },
    plot: Plot::Torques,
    window_s: 5,
    joint: None,
    help: false,
    question: None,
    is_jogging: false,
    palette: Palette { coloured: true },
};

fn drawn(model: &Model, screen: &Screen<'_>, now: Duration, width: u16, height: u16) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
    terminal.draw(|frame| draw(frame, model, screen, now)).expect("it can be drawn");
    terminal.backend().buffer().clone()
}

fn rows(buffer: &Buffer) -> Vec<String> {
    let width = usize::from(buffer.area.width);
    let row = |cells: &[ratatui::buffer::Cell]| cells.iter().map(|cell| cell.symbol()).collect::<String>();
    buffer.content.chunks(width).map(row).collect()
}

fn text(model: &Model, screen: &Screen<'_>, now: Duration, width: u16, height: u16) -> String {
    rows(&drawn(model, screen, now, width, height)).join("\n")
}

/// A hand that grasps, with a joint at its torque limit.
fn grasping() -> Model {
    let mut model = fed(1..2990);
    model.take(ms(10), News::Setting { parameter: Parameter::HEARTBEAT_TIME, index: 0, value: Some(250.0) });
    model.take(ms(2950), News::Heartbeat);
    model.take(ms(2960), News::Notice(Level::Info, "grasp: done".into()));
    let mut limiting = [Limiting::NONE; blindgrasp_body::MAX_JOINTS];
    limiting[2].insert(Limit::Torque);
    let torques = std::array::from_fn(|k| if k == 2 { 1.3878 } else { 0.1 * k as f32 });
    let held = Record {
        mode: Mode::Grasping,
        gains: PerGain { grasp: [5.0, 0.0], ..PerGain::all(0.0) },
        limiting: List::first_of(limiting, 12),
        torques_nm: List::first_of(torques, 12),
        ..record(2990)
    };
    model.take(ms(2990), News::Record(Box::new(held)));
    model
}

fn faulty() -> Model {
    let mut model = grasping();
    let fault = Some(Raised::at(3, Fault::Overspeed));
    let record =
        Record { mode: Mode::Fault, fault, late_ticks: 4, dropped: 2, decimation: 4, ..record(2991) };
    model.take(ms(2991), News::Record(Box::new(record)));
    let refused = "arm: refused, the hand is in a fault: clear it first";
    model.take(ms(2992), News::Notice(Level::Warning, refused.into()));
    model
}

#[test]
fn everything_that_matters_is_there_in_80_columns_and_24_rows() {
    let shown = text(&grasping(), &SCREEN, ms(3000), 80, 24);
    for wanted in [
        " GRASPING ",
        "heartbeat: 200 of 250 ms left",
        "5.00 N",
        "no fault",
        "grasp: done",
        // The last one came in this slot, and nine of the slot before are missing.
        "991 records/s",
        "64.3 kB/s",
        "64 % of the line",
        "lost 0",
        "CRC 0",
        "late 0",
        "dropped 0",
        "hand three-finger",
        "port /dev/ttyUSB0",
        "finger-1-abduct",
        "finger-3-flex-3",
        "torque limit",
        "1.388",
        "torques, N m: all joints",
        "-5 s",
        "space STOP",
    ] {
        assert!(shown.contains(wanted), "no `{wanted}` in\n{shown}");
    }
    let row = |name: &str| shown.lines().find(|row| row.contains(name)).expect("a row").to_owned();
    assert!(row("finger-1-flex-2").contains("│████ "), "{}", row("finger-1-flex-2"));
    assert!(row("finger-1-flex-2").contains("torque limit"));
    assert!(shown.contains('⠉') || shown.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)), "no plot");
}

#[test]
fn a_fault_its_remedy_and_a_refusal_are_told_in_words() {
    let shown = text(&faulty(), &SCREEN, ms(3000), 120, 30);
    for wanted in [
        " FAULT ",
        "fault 5: joint 3: speed is above its limit: check what drives the joint",
        "! arm: refused, the hand is in a fault: clear it first",
        "only 1 tick in 4!",
        "late 4!",
        "dropped 2!",
    ] {
        assert!(shown.contains(wanted), "no `{wanted}` in\n{shown}");
    }
}

#[test]
fn a_dead_link_says_since_when_and_what_was_known() {
    let mut model = grasping();
    model.take(ms(3000), News::Cut("the device hung up".into()));
    let shown = text(&model, &SCREEN, ms(7300), 80, 24);
    for wanted in
        [" NO LINK ", "for 4 s, trying again: the device hung up", "was GRASPING", "finger-1-flex-2"]
    {
        assert!(shown.contains(wanted), "no `{wanted}` in\n{shown}");
    }
    assert!(!shown.contains("heartbeat"), "{shown}");
}

#[test]
fn without_an_answer_nothing_is_claimed() {
    let shown = text(&Model::new(), &SCREEN, ms(10), 80, 24);
    assert!(shown.contains("NO ANSWER YET") && shown.contains("as soon as the hand answers"), "{shown}");
    assert!(!shown.contains("no fault"), "{shown}");
}

#[test]
fn without_the_hands_file_there_are_counts_and_the_reason() {
    let mut model = Model::new();
    model.take(ms(0), session(false));
    for tick in 1..100 {
        model.take(ms(tick.into()), News::Record(Box::new(record(tick))));
    }
    let screen = Screen { plot: Plot::Angles, ..SCREEN };
    let shown = text(&model, &screen, ms(100), 80, 24);
    for wanted in ["no angles: it is not built in", "joint 11", "990", "10000", "counts: all joints"] {
        assert!(shown.contains(wanted), "no `{wanted}` in\n{shown}");
    }
}

#[test]
fn no_size_is_too_small_and_nothing_panics() {
    let questions = [None, Some(("QUIT: with this program its heartbeat ends, and the hand lets go", 5))];
    let mut cut = grasping();
    cut.take(ms(3000), News::Cut("the device hung up".into()));
    for model in [Model::new(), grasping(), faulty(), cut] {
        for (width, height) in (1_u16..50).map(|k| (k, k.div_ceil(2))).chain([
            (1, 60),
            (200, 1),
            (40, 10),
            (300, 90),
            (80, 17),
            (80, 15),
        ]) {
            for help in [false, true] {
                for question in questions {
                    let joint = Some(11);
                    let screen = Screen { help, question, joint, ..SCREEN };
                    drawn(&model, &screen, ms(3000), width, height);
                }
            }
        }
    }
    // What is most important stays.
    let shown = text(&faulty(), &SCREEN, ms(3000), 40, 10);
    for wanted in [" FAULT ", "fault 5: joint 3: speed is", "! arm: refused", "space STOP"] {
        assert!(shown.contains(wanted), "no `{wanted}` in\n{shown}");
    }
}

#[test]
fn the_chosen_joint_stays_in_sight_and_is_marked_without_colour() {
    let screen = Screen { joint: Some(11), ..SCREEN };
    let shown = text(&grasping(), &screen, ms(3000), 80, 17);
    assert!(
        shown.contains("> finger-3-flex-3") && shown.contains("torques, N m: finger-3-flex-3"),
        "{shown}"
    );
}

#[test]
fn a_question_is_whole_whatever_the_width() {
    let words = "QUIT: with this program its heartbeat ends.  s or Enter: stop it first  y: quit  Esc: stay";
    let screen = Screen { question: Some((words, 4)), ..SCREEN };
    for width in [30, 40, 80, 120] {
        let shown = text(&grasping(), &screen, ms(3000), width, 24);
        let flat = shown.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(flat.contains("Esc: stay (4 s)"), "{width}:\n{shown}");
    }
}

#[test]
fn without_colours_there_are_none_and_the_words_are_the_same() {
    let plain = Screen { palette: Palette { coloured: false }, ..SCREEN };
    for model in [grasping(), faulty()] {
        let buffer = drawn(&model, &plain, ms(3000), 100, 30);
        assert!(buffer.content.iter().all(|cell| {
            (cell.fg, cell.bg) == (ratatui::style::Color::Reset, ratatui::style::Color::Reset)
        }));
        assert_eq!(rows(&buffer), rows(&drawn(&model, &SCREEN, ms(3000), 100, 30)));
    }
}

#[test]
fn nothing_has_no_sign() {
    for (value, digits, words) in
        [(-0.0004, 3, "0.000"), (-0.0006, 3, "-0.001"), (-0.4, 0, "0"), (2.0, 1, "2.0")]
    {
        assert_eq!(fixed(value, digits), words);
    }
}

#[test]
fn the_keys_are_explained() {
    let screen = Screen { help: true, ..SCREEN };
    let shown = text(&grasping(), &screen, ms(3000), 80, 24);
    assert!(shown.contains("STOP at once: no torque") && shown.contains("asks first"), "{shown}");
    let source = Source::Recording {
        file: "run.mcap",
        device: "hand",
        length: ms(60_000),
        speed: 2.0,
        is_paused: true,
        is_seeking: false,
    };
    let shown = text(&grasping(), &Screen { source, ..SCREEN }, ms(3000), 80, 24);
    assert!(shown.contains("PAUSED 3.00 of 60.00 s, 2 x") && shown.contains("run.mcap, hand"), "{shown}");
}
