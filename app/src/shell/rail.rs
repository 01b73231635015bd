//! The screens and the rail that switches between them.

use crate::command::{Command, Commands};
use eframe::egui::{Button, Key, Ui, vec2};

/// Width of the rail in points.
pub const WIDTH: f32 = 100.0;

/// What stands between the top bar and the event log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Screen {
    /// A protocol: rig, parameters, plots, what is known.
    #[default]
    Run,
    /// Which model a recording needs.
    Models,
    /// What accuracy costs on this machine.
    Trade,
    /// What happens at the ends of every range.
    Extremes,
    /// Which calibrations there are and what they are worth.
    Calibration,
}

impl Screen {
    /// All, in the order of a day's work.
    pub const ALL: [Self; 5] = [
        Self::Run,
        Self::Models,
        Self::Trade,
        Self::Extremes,
        Self::Calibration,
    ];

    /// Name on the rail.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Run => "Run",
            Self::Models => "Models",
            Self::Trade => "Trade",
            Self::Extremes => "Extremes",
            Self::Calibration => "Calibration",
        }
    }

    /// What it is for, for the rail's hint.
    const fn purpose(self) -> &'static str {
        match self {
            Self::Run => "run a protocol and see what comes of it",
            Self::Models => "how much model a recording needs",
            Self::Trade => "what accuracy costs on this machine",
            Self::Extremes => "what is right and what is refused at the ends of every range",
            Self::Calibration => "volts to newtons: which calibrations there are",
        }
    }

    /// The key that shows it, with Ctrl (Command on a Mac).
    #[must_use]
    pub const fn key(self) -> Key {
        match self {
            Self::Run => Key::Num1,
            Self::Models => Key::Num2,
            Self::Trade => Key::Num3,
            Self::Extremes => Key::Num4,
            Self::Calibration => Key::Num5,
        }
    }
}

/// Draws the rail.
pub fn rail_ui(ui: &mut Ui, shown: Screen, commands: &mut Commands) {
    for screen in Screen::ALL {
        let button = Button::selectable(screen == shown, screen.name())
            .min_size(vec2(ui.available_width(), 32.0));
        let hint = format!(
            "{} (Ctrl+{})",
            screen.purpose(),
            screen.key().symbol_or_name()
        );
        if ui.add(button).on_hover_text(hint).clicked() {
            commands.push(Command::Show(screen));
        }
    }
}
