//! The rail that switches between the screens: those of a day at the rig, then those of research.

use crate::command::{Commands, UiCommand};
use crate::screens::table::{SCREENS, TECHNICIAN_SCREENS};
use crate::widgets::quiet_ui;
use eframe::egui::{Button, ScrollArea, Ui, vec2};

/// Width of the rail in points.
pub const WIDTH: f32 = 118.0;
/// Height of an entry in points: large enough for a gloved finger.
const ENTRY_HEIGHT: f32 = 48.0;

pub fn rail_ui(ui: &mut Ui, shown: &str, commands: &mut Commands) {
    let (technician, research) = SCREENS.split_at(TECHNICIAN_SCREENS);
    ScrollArea::vertical().id_salt("rail").show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        for (group, screens) in [("At the rig", technician), ("Research", research)] {
            quiet_ui(ui, group);
            for screen in screens {
                let Some(key) = screen.key else { continue };
                let button = Button::selectable(screen.name == shown, screen.name)
                    .min_size(vec2(ui.available_width(), ENTRY_HEIGHT));
                let hint = format!("{} (Ctrl+{})", screen.purpose, key.symbol_or_name());
                if ui.add(button).on_hover_text(hint).clicked() {
                    commands.push(UiCommand::Show(screen.name));
                }
            }
            ui.add_space(6.0);
        }
    });
}
