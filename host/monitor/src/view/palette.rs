//! Colours, whose meanings words and signs have as well.

use super::super::model::Level;
use blindgrasp_shared::supervisor::Mode;
use ratatui::style::{Color, Modifier, Style};

/// Styles, with colours of the sixteen that every terminal has, or without.
#[derive(Clone, Copy, Debug)]
pub struct Palette {
    /// `true` if there are colours.
    pub coloured: bool,
}

impl Palette {
    fn coloured(self, colour: Color, plain: Modifier) -> Style {
        if self.coloured { Style::new().fg(colour) } else { Style::new().add_modifier(plain) }
    }

    pub(super) fn good(self) -> Style {
        self.coloured(Color::Green, Modifier::empty())
    }

    pub(super) fn warning(self) -> Style {
        self.coloured(Color::Yellow, Modifier::BOLD)
    }

    pub(super) fn bad(self) -> Style {
        self.coloured(Color::Red, Modifier::BOLD).add_modifier(Modifier::BOLD)
    }

    pub(super) fn faint(self) -> Style {
        self.coloured(Color::DarkGray, Modifier::DIM)
    }

    pub(super) fn title(self) -> Style {
        self.coloured(Color::Cyan, Modifier::empty()).add_modifier(Modifier::BOLD)
    }

    pub(super) fn selected(self) -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    pub(super) fn level(self, level: Level) -> Style {
        match level {
            Level::Info => Style::new(),
            Level::Warning => self.warning(),
            Level::Error => self.bad(),
        }
    }

    pub(super) fn mode(self, mode: Mode) -> Style {
        let style = match mode {
            Mode::Disarmed => Style::new(),
            Mode::Armed => self.warning(),
            Mode::Grasping | Mode::Carrying => self.good(),
            Mode::Moving | Mode::Closing | Mode::PuttingDown | Mode::Releasing => {
                self.coloured(Color::Cyan, Modifier::empty())
            }
            Mode::Fault => self.bad(),
        };
        style.add_modifier(Modifier::REVERSED | Modifier::BOLD)
    }

    /// Of curves that are drawn together.
    pub(super) fn curve(self, number: usize) -> Style {
        const COLOURS: [Color; 6] =
            [Color::Green, Color::Cyan, Color::Yellow, Color::Magenta, Color::Blue, Color::Red];
        self.coloured(COLOURS[number % COLOURS.len()], Modifier::empty())
    }
}
