//! The screens and the rail that switches between them.

use crate::command::{Command, Commands};
use eframe::egui::{Button, Key, Ui, vec2};

/// Width of the rail in points.
pub const WIDTH: f32 = 100.0;

/// What stands between the top bar and the event log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Screen {
    /// The rig: what it reports, and moving it by hand.
    Rig,
    /// Which calibrations there are and what they are worth.
    Calibration,
    /// A protocol: rig, parameters, plots, what is known.
    #[default]
    Run,
    /// Sessions found by what is known of them.
    Library,
    /// One session or several, as they were measured.
    Review,
    /// Which model a recording needs.
    Models,
    /// What accuracy costs on this machine.
    Trade,
    /// What happens at the ends of every range.
    Extremes,
    /// A body felt through a device.
    Haptics,
    /// Tissue that is seen and felt.
    Scene,
}

impl Screen {
    /// All, in the order of a day's work.
    pub const ALL: [Self; 10] = [
        Self::Rig,
        Self::Calibration,
        Self::Run,
        Self::Library,
        Self::Review,
        Self::Models,
        Self::Trade,
        Self::Extremes,
        Self::Haptics,
        Self::Scene,
    ];

    /// Name on the rail.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rig => "Rig",
            Self::Calibration => "Calibration",
            Self::Run => "Run",
            Self::Library => "Library",
            Self::Review => "Review",
            Self::Models => "Models",
            Self::Trade => "Trade",
            Self::Extremes => "Extremes",
            Self::Haptics => "Haptics",
            Self::Scene => "Scene",
        }
    }

    /// The screen of this name.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|screen| screen.name() == name)
    }

    /// What it is for, for the rail's hint.
    #[must_use]
    pub const fn purpose(self) -> &'static str {
        match self {
            Self::Rig => "what the rig reports, and moving it by hand",
            Self::Calibration => "volts to newtons: which calibrations there are",
            Self::Run => "run a protocol and see what comes of it",
            Self::Library => "find sessions",
            Self::Review => "look at sessions: one closely, several beside each other",
            Self::Models => "how much model a recording needs",
            Self::Trade => "what accuracy costs on this machine",
            Self::Extremes => "what is right and what is refused at the ends of every range",
            Self::Haptics => "feel a body through a device: margin, buzz and loop",
            Self::Scene => "press into a piece of tissue and see it give way",
        }
    }

    /// The key that shows it, with Ctrl (Command on a Mac).
    #[must_use]
    pub const fn key(self) -> Key {
        match self {
            Self::Rig => Key::Num1,
            Self::Calibration => Key::Num2,
            Self::Run => Key::Num3,
            Self::Library => Key::Num4,
            Self::Review => Key::Num5,
            Self::Models => Key::Num6,
            Self::Trade => Key::Num7,
            Self::Extremes => Key::Num8,
            Self::Haptics => Key::Num9,
            // Every number is taken: Ctrl+0 is the usual size of text.
            Self::Scene => Key::E,
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
