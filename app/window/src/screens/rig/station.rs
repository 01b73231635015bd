//! The part of the rig's screen that serves it, and arms a queue for runs over the network.

use crate::command::{Commands, UiCommand};
use crate::widgets::{
    NamedControl, QuantityField, alarm_ui, form_label, placeholder_ui, quantity_ui, reason_button,
    require,
};
use crate::workbench::Workbench;
use crate::workers::PathPurpose;
use crate::workers::station::StationCommand;
use eframe::egui::{Button, TextEdit, Ui, vec2};
use std::path::PathBuf;

/// Longest arming in minutes: a day.
const MINUTES_MAX: f64 = 24.0 * 60.0;

#[derive(Debug)]
pub struct StationForm {
    /// Path of a remote queue.
    pub file: String,
    minutes: QuantityField,
}

impl Default for StationForm {
    fn default() -> Self {
        Self { file: String::new(), minutes: QuantityField::new(60.0) }
    }
}

impl StationForm {
    pub fn ui(&mut self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        let station = &workbench.station;
        let mut push = |command| commands.push(UiCommand::Station(command));
        match station.url() {
            None => {
                let address = station.planned().map_or_else(String::new, |at| at.to_string());
                let can = require(!address.is_empty(), "there is no library for the tokens");
                if reason_button(ui, "Serve this rig", vec2(130.0, 40.0), &can) {
                    push(StationCommand::Serve);
                }
                placeholder_ui(
                    ui,
                    format!(
                        "Shows state, curve and progress to browsers at {address}, and takes a stop from there. Nothing can be started over the network unless you arm it here."
                    ),
                );
            }
            Some(url) => {
                ui.horizontal_wrapped(|ui| {
                    ui.label("served at");
                    ui.hyperlink(format!("{url}/"));
                    if ui.button("Stop serving").clicked() {
                        push(StationCommand::EndServing);
                    }
                });
                self.arming_ui(ui, workbench, commands);
            }
        }
        if let Some(reason) = &station.refusal {
            alarm_ui(ui, reason);
        }
    }

    fn arming_ui(&mut self, ui: &mut Ui, workbench: &Workbench, commands: &mut Commands) {
        // What is armed stands above every screen, with the button that takes it back.
        if workbench.station.armed().is_some() {
            return;
        }
        ui.horizontal(|ui| {
            let label = form_label(ui, "remote queue");
            let field = ui.add(TextEdit::singleline(&mut self.file).desired_width(260.0));
            field.labelled_by(label.id).named("remote queue");
            if ui.add(Button::new("Choose...")).clicked() {
                commands.push(UiCommand::Choose(PathPurpose::RemoteQueue));
            }
        });
        ui.horizontal(|ui| quantity_ui(ui, "armed for", "min", &mut self.minutes));
        self.minutes.check(|minutes| {
            require((1.0..=MINUTES_MAX).contains(&minutes), "type a time from 1 minute to 24 hours")
        });
        let can = require(!self.file.trim().is_empty(), "choose the file of a remote queue")
            .and_then(|()| self.minutes.value.clone().map(|_| ()));
        if reason_button(ui, "Arm the remote queue", vec2(170.0, 40.0), &can)
            && let Ok(minutes) = self.minutes.value
        {
            let file = PathBuf::from(self.file.trim());
            commands.push(UiCommand::Station(StationCommand::Arm(file, minutes as u64)));
        }
        placeholder_ui(
            ui,
            "While a queue is armed, programs with a token may start its runs, within the limits of its file. Any fault and any stop takes the arming back.",
        );
        if let Some(reason) = workbench.station.disarmed() {
            placeholder_ui(ui, format!("The last arming was taken back: {reason}."));
        }
    }
}
