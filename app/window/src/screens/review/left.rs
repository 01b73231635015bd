//! The sessions shown, and how they are laid over each other.

use super::{ReviewScreen, ReviewSubject, View};
use crate::command::{Commands, UiCommand};
use crate::screens::library;
use crate::theme::Tokens;
use crate::widgets::{
    NamedControl, alarm_ui, quiet_ui, reason_button, require, section_ui, share_ui, task_ui,
    text_row, tick_box, tokens_of,
};
use crate::workers::review::{Quantity, Stage, TimeOrigin};
use eframe::egui::{Color32, Label, RichText, Sense, Ui, vec2};
use std::path::PathBuf;

/// A button of a session.
enum SessionAction {
    Front(usize),
    Remove(usize),
    Cancel(usize),
    ReadAgain(usize),
}

/// The colour of a session.
pub(super) fn color_of(tokens: &Tokens, id: u64) -> Color32 {
    tokens.sessions[(id % tokens.sessions.len() as u64) as usize]
}

/// A small button of one word, which says aloud of which session.
fn action_ui(ui: &mut Ui, word: &str, session: &str) -> bool {
    let name = format!("{word}: {session}");
    ui.small_button(word).accessible_name(&name).named(&name).clicked()
}

/// Draws how far a session is read; returns the button that was pressed.
fn stage_ui(ui: &mut Ui, index: usize, subject: &ReviewSubject) -> Option<SessionAction> {
    let recording = &subject.recording;
    let share = recording.share();
    let mut pressed = None;
    match &recording.stage {
        Stage::Whole => return None,
        Stage::Waiting => quiet_ui(ui, "waiting to be read"),
        Stage::Reading => {
            share_ui(ui, share);
            ui.horizontal(|ui| {
                quiet_ui(ui, format!("still reading {:.0} %", 100.0 * share));
                if action_ui(ui, "cancel", &subject.name) {
                    pressed = Some(SessionAction::Cancel(index));
                }
            });
            return pressed;
        }
        Stage::Cancelled => {
            quiet_ui(ui, format!("reading was cancelled at {:.0} % of the session", 100.0 * share))
        }
        Stage::Failed(reason) => alarm_ui(ui, reason),
    }
    let can_read = matches!(recording.stage, Stage::Cancelled | Stage::Failed(_));
    (can_read && action_ui(ui, "read again", &subject.name))
        .then_some(SessionAction::ReadAgain(index))
}

impl ReviewScreen {
    pub(super) fn draw_left(&mut self, ui: &mut Ui, commands: &mut Commands) {
        section_ui(ui, "Sessions shown");
        self.sessions_ui(ui);
        self.add_ui(ui);
        if ui.button("Find sessions in the library").clicked() {
            commands.push(UiCommand::Show(library::SCREEN.name));
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
        section_ui(ui, "Fit");
        self.model.ui(ui, "fit with", "include rejected sessions");
        let verdict = self.fit_verdict();
        if task_ui(ui, "Fit the sessions shown", &self.fits, &verdict) {
            self.start_fits(ui.ctx());
        }
        if let (Some(Err(reason)), None) = (self.fits.answer(), self.fits.state()) {
            alarm_ui(ui, reason);
        }
    }

    fn sessions_ui(&mut self, ui: &mut Ui) {
        let tokens = tokens_of(ui);
        if self.subjects.is_empty() {
            quiet_ui(
                ui,
                "no session is shown yet: choose some in the library, or type the path of a session",
            );
        }
        let mut pressed = None;
        for (index, subject) in self.subjects.iter().enumerate() {
            ui.horizontal(|ui| {
                let (rect, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
                ui.painter().rect_filled(rect, 2.0, color_of(tokens, subject.id));
                let mut name = RichText::new(&subject.name);
                if index == 0 {
                    name = name.strong();
                }
                ui.add(Label::new(name).wrap());
            });
            ui.horizontal(|ui| {
                if index == 0 {
                    quiet_ui(ui, "in front");
                } else if action_ui(ui, "front", &subject.name) {
                    pressed = Some(SessionAction::Front(index));
                }
                if action_ui(ui, "remove", &subject.name) {
                    pressed = Some(SessionAction::Remove(index));
                }
            });
            pressed = pressed.or(stage_ui(ui, index, subject));
            ui.add_space(4.0);
        }
        match pressed {
            Some(SessionAction::Front(index)) => self.subjects[..=index].rotate_right(1),
            Some(SessionAction::Remove(index)) => {
                self.subjects.remove(index);
            }
            Some(SessionAction::Cancel(index)) => self.subjects[index].recording.cancel(),
            Some(SessionAction::ReadAgain(index)) => self.subjects[index].read_again(),
            None => {}
        }
    }

    fn add_ui(&mut self, ui: &mut Ui) {
        let hint = "the folder of a session";
        let is_entered = text_row(ui, "session", hint, &mut self.path);
        let verdict = require(!self.path.trim().is_empty(), "type the path of a session's folder");
        let is_pressed = reason_button(ui, "Add to view", vec2(0.0, 22.0), &verdict);
        if is_pressed || (is_entered && verdict.is_ok()) {
            let path = PathBuf::from(std::mem::take(&mut self.path).trim());
            self.add(path, ui.ctx());
            // The keys of the plots are next.
            ui.memory_mut(|memory| memory.stop_text_input());
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

    pub(super) fn views_ui(&mut self, ui: &mut Ui) {
        for view in View::ALL {
            ui.selectable_value(&mut self.view, view, view.name()).named(view.name());
        }
    }
}
