//! What an operator says of the run that has just ended: accept it, reject it, or reject and repeat it.

use crate::command::{Commands, UiCommand};
use crate::widgets::{
    NamedControl, alarm_ui, quiet_ui, require, section_ui, sentence_ui, text_row,
};
use crate::workers::BackgroundTask;
use eframe::egui::{Button, Context, Ui, Vec2, vec2};
use palpate_analysis::session_actions::{Attribution, set_data_quality};
use palpate_sessions::edits::DataQuality;
use std::path::{Path, PathBuf};

/// Large enough for a gloved finger, in points.
const BUTTON: Vec2 = vec2(86.0, 48.0);

#[derive(Default)]
pub struct RunVerdict {
    reason: String,
    writing: BackgroundTask<String>,
    /// The session that it is or was about.
    session: Option<PathBuf>,
}

impl RunVerdict {
    /// Draws it for a run that has ended; `may_start` says why it cannot be repeated now.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        session: &Path,
        operator: &str,
        may_start: &Result<(), String>,
        commands: &mut Commands,
    ) {
        self.writing.poll();
        if self.session.as_deref() != Some(session) && !self.writing.is_busy() {
            *self = Self { session: Some(session.to_owned()), ..Self::default() };
        }
        section_ui(ui, "Verdict");
        match self.writing.answer() {
            Some(Ok(words)) => sentence_ui(ui, words),
            Some(Err(reason)) => alarm_ui(ui, format!("the verdict was not written: {reason}")),
            None => {}
        }
        text_row(ui, "reason", "for a rejection", &mut self.reason);
        let has_reason =
            require(!self.reason.trim().is_empty(), "to reject a run, give the reason");
        let can_reject = require(!self.writing.is_busy(), "writing the verdict").and(has_reason);
        let can_repeat = can_reject.clone().and_then(|()| may_start.clone());
        ui.horizontal(|ui| {
            if button_ui(ui, "Accept", !self.writing.is_busy()) {
                self.write(ui.ctx(), DataQuality::Valid, operator);
            }
            if button_ui(ui, "Reject", can_reject.is_ok()) {
                self.write(ui.ctx(), DataQuality::Rejected, operator);
            }
            if button_ui(ui, "Repeat", can_repeat.is_ok()) {
                self.write(ui.ctx(), DataQuality::Rejected, operator);
                commands.push(UiCommand::Start);
            }
        });
        if let Err(reason) = can_reject.and(can_repeat) {
            quiet_ui(ui, reason);
        }
    }

    fn write(&mut self, ctx: &Context, verdict: DataQuality, operator: &str) {
        let Some(session) = self.session.clone() else { return };
        let typed = self.reason.trim();
        let reason = if typed.is_empty() { "looked at after the run" } else { typed };
        let by = palpate_analysis::edits::author(Some(operator).filter(|name| !name.is_empty()));
        let who = Attribution { by, reason: reason.to_owned() };
        self.writing.start("verdict", ctx, move |_| {
            let written = set_data_quality(&session, verdict, &who);
            written.map_err(|err| err.to_string())?;
            Ok(format!("{verdict}: {}", who.reason))
        });
    }
}

fn button_ui(ui: &mut Ui, name: &str, is_enabled: bool) -> bool {
    ui.add_enabled(is_enabled, Button::new(name).min_size(BUTTON)).named(name).clicked()
}
