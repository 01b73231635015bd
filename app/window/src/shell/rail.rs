//! The rail that switches between the screens.

use crate::command::{Commands, UiCommand};
use crate::screens::table::SCREENS;
use eframe::egui::{Button, Ui, vec2};

/// Width of the rail in points.
pub const WIDTH: f32 = 100.0;

pub fn rail_ui(ui: &mut Ui, shown: &str, commands: &mut Commands) {
    for screen in SCREENS {
        let Some(key) = screen.key else { continue };
        let button = Button::selectable(screen.name == shown, screen.name)
            .min_size(vec2(ui.available_width(), 32.0));
        let hint = format!("{} (Ctrl+{})", screen.purpose, key.symbol_or_name());
        if ui.add(button).on_hover_text(hint).clicked() {
            commands.push(UiCommand::Show(screen.name));
        }
    }
}
