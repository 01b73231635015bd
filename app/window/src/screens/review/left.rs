//! The sessions shown, and how they are laid over each other.

use super::ReviewScreen;
use crate::command::{Commands, UiCommand};
use crate::screens::library;
use crate::widgets::{
    NamedControl, alarm_ui, quiet_ui, reason_button, require, section_ui, task_ui, text_row,
    tick_box,
};
use crate::workers::review::{Quantity, TimeOrigin};
use eframe::egui::{Ui, vec2};
use std::path::PathBuf;

impl ReviewScreen {
    pub(super) fn draw_left(&mut self, ui: &mut Ui, commands: &mut Commands) {
        section_ui(ui, "Sessions shown");
        self.sessions_ui(ui);
        if self.subjects.len() > 1 {
            self.grouping_ui(ui);
        }
        self.add_ui(ui);
        if ui.button("Find sessions in the library").clicked() {
            commands.push(UiCommand::Show(library::SCREEN.name));
        }
        section_ui(ui, "Fit");
        self.model.ui(ui, "fit with", "include rejected sessions");
        let verdict = self.fit_verdict();
        if task_ui(ui, "Fit the sessions shown", &self.fits, &verdict) {
            self.start_fits(ui.ctx());
        }
        if let (Some(Err(reason)), None) = (self.fits.answer(), self.fits.state()) {
            alarm_ui(ui, reason);
        }
        section_ui(ui, "Time zero at");
        for time_origin in TimeOrigin::ALL {
            ui.radio_value(&mut self.time_origin, time_origin, time_origin.name())
                .named(time_origin.name());
        }
        self.missing_origins_ui(ui);
        section_ui(ui, "Shown over time");
        for quantity in Quantity::ALL {
            let mut is_shown = self.quantities.contains(&quantity);
            if tick_box(ui, &mut is_shown, quantity.name()).changed() {
                self.quantities.retain(|one| *one != quantity);
                self.quantities.extend(is_shown.then_some(quantity));
                // Always in the same order on the screen.
                self.quantities.sort_by_key(|one| *one as usize);
            }
        }
        let has_fit = self.subjects.iter().any(|one| one.fitted().is_some());
        ui.add_enabled_ui(has_fit, |ui| {
            tick_box(ui, &mut self.has_residuals, "Residuals of the fit")
        });
        if !has_fit {
            quiet_ui(ui, "fit the sessions shown to see their residuals");
        }
    }

    fn add_ui(&mut self, ui: &mut Ui) {
        let hint = "the folder of a session";
        let is_entered = text_row(ui, "session", hint, &mut self.path);
        let verdict = require(!self.path.trim().is_empty(), "type the path of a session's folder");
        let is_pressed = reason_button(ui, "Add to view", vec2(0.0, 22.0), &verdict);
        if is_pressed || (is_entered && verdict.is_ok()) {
            let path = PathBuf::from(self.path.trim());
            self.wrong_path = (!path.is_dir()).then(|| self.path.clone());
            if self.wrong_path.is_none() {
                self.path.clear();
                self.add(path, ui.ctx());
                // The keys of the plots are next.
                ui.memory_mut(|memory| memory.stop_text_input());
            }
        }
        if self.wrong_path.as_ref() == Some(&self.path) {
            alarm_ui(ui, "there is no such folder; type the path of a session's folder");
        }
    }

    fn missing_origins_ui(&self, ui: &mut Ui) {
        for subject in &self.subjects {
            if subject.is_settled() && subject.moment(self.time_origin).is_none() {
                let words = format!(
                    "{} has no {}, so its time counts from the start of the session",
                    subject.name,
                    self.time_origin.name()
                );
                quiet_ui(ui, &words);
            }
        }
    }
}
