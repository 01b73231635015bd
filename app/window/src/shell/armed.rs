//! The line above every screen while runs may start over the network.

use crate::command::{Commands, UiCommand};
use crate::widgets::{NamedControl, announce, tokens_of};
use crate::workers::station::StationCommand;
use chrono::{DateTime, Local};
use eframe::egui::accesskit::Live;
use eframe::egui::{Button, Label, RichText, Ui, vec2};
use palpate_station::remote::ArmedState;

/// Says what is armed, and takes it back.
pub fn armed_ui(ui: &mut Ui, armed: &ArmedState, commands: &mut Commands) {
    let tokens = tokens_of(ui);
    let until = DateTime::parse_from_rfc3339(&armed.until);
    let until = until.map_or_else(
        |_| armed.until.clone(),
        |at| at.with_timezone(&Local).format("%H:%M").to_string(),
    );
    let words = format!(
        "Runs may start over the network: queue '{}', until {until}, {} left. Keep hands away.",
        armed.queue, armed.runs_left
    );
    ui.horizontal_wrapped(|ui| {
        let button = Button::new("Disarm").min_size(vec2(90.0, 32.0));
        if ui.add(button).named("Disarm").clicked() {
            commands.push(UiCommand::Station(StationCommand::Disarm));
        }
        let shown =
            ui.add(Label::new(RichText::new(words).strong().color(tokens.alarm_text)).wrap());
        announce(&shown, Live::Polite);
    });
}
