//! The rail that switches between the screens.

use crate::command::{Commands, UiCommand};
use crate::screens::screen::ScreenEntry;
use crate::screens::table::GROUPS;
use crate::theme::icon_text;
use crate::widgets::quiet_ui;
use eframe::egui::{Button, ScrollArea, Ui, vec2};

/// Widths of the rail in points: with icons and words, and with icons alone.
const WIDTHS: [f32; 2] = [140.0, 60.0];
/// Points of window below which the words have no room.
const ROOM_FOR_WORDS: f32 = 1260.0;
/// Height of an entry in points: large enough for a gloved finger.
const ENTRY_HEIGHT: f32 = 44.0;

/// Width of the rail in a window so wide, in points.
#[must_use]
pub fn width(window: f32) -> f32 {
    if window >= ROOM_FOR_WORDS { WIDTHS[0] } else { WIDTHS[1] }
}

pub fn rail_ui(ui: &mut Ui, shown: &str, commands: &mut Commands) {
    ScrollArea::vertical().id_salt("rail").show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        for group in &GROUPS {
            if has_words(ui) {
                quiet_ui(ui, group.name);
            }
            for screen in group.screens {
                entry_ui(ui, screen, screen.name == shown, commands);
            }
            ui.add_space(6.0);
        }
    });
}

fn entry_ui(ui: &mut Ui, screen: &ScreenEntry, is_shown: bool, commands: &mut Commands) {
    let Some(key) = screen.key else { return };
    let icon = icon_text(screen.icon);
    let button = match has_words(ui) {
        true => Button::selectable(is_shown, (icon, screen.name)),
        false => Button::selectable(is_shown, icon),
    };
    let button = button.min_size(vec2(ui.available_width(), ENTRY_HEIGHT));
    let hint = format!("{}: {} (Ctrl+{})", screen.name, screen.purpose, key.symbol_or_name());
    // A screen reader cannot say an icon.
    let entry = ui.add(button).accessible_name(screen.name);
    if entry.on_hover_text(hint).clicked() {
        commands.push(UiCommand::Show(screen.name));
    }
}

fn has_words(ui: &Ui) -> bool {
    ui.ctx().content_rect().width() >= ROOM_FOR_WORDS
}
