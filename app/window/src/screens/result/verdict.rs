//! What an operator says of the run that has just ended: accept it, reject it, or reject and repeat it. Then the next
//! specimen of the queue.

use crate::command::{Commands, UiCommand};
use crate::screens::run;
use crate::widgets::{
    NamedControl, alarm_ui, quiet_ui, require, section_ui, sentence_ui, text_row,
};
use crate::workers::queue_desk::{QueueDesk, QueueWork};
use eframe::egui::{Button, Ui, Vec2, vec2};
use palpate_sessions::specimen_queue::QueueVerdict;
use std::path::{Path, PathBuf};

/// Large enough for a gloved finger, in points.
const BUTTON: Vec2 = vec2(86.0, 48.0);

#[derive(Default)]
pub struct RunVerdict {
    reason: String,
    /// The session that it is about.
    session: Option<PathBuf>,
}

impl RunVerdict {
    /// The reason that is typed.
    pub fn reason(&self) -> &str {
        &self.reason
    }

    /// Draws it for a run that has ended; `may_repeat` says why it cannot be repeated now.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        session: &Path,
        queue: &QueueDesk,
        may_repeat: &Result<(), String>,
        commands: &mut Commands,
    ) {
        if self.session.as_deref() != Some(session) {
            *self = Self { session: Some(session.to_owned()), reason: String::new() };
        }
        section_ui(ui, "Verdict");
        text_row(ui, "reason", "for a rejection", &mut self.reason);
        let is_free = require(!queue.is_busy(), "writing the verdict");
        let has_reason =
            require(!self.reason.trim().is_empty(), "to reject a run, give the reason");
        let can_reject = is_free.clone().and(has_reason);
        let can_repeat = can_reject.clone().and_then(|()| may_repeat.clone());
        ui.horizontal(|ui| {
            if button_ui(ui, "Accept", "Ctrl+Enter", is_free.is_ok()) {
                commands.push(UiCommand::AcceptRun);
            }
            for (name, verdict, can) in [
                ("Reject", QueueVerdict::Reject, &can_reject),
                ("Repeat", QueueVerdict::Repeat, &can_repeat),
            ] {
                if button_ui(ui, name, "", can.is_ok()) {
                    let work = QueueWork::Judge(session.to_owned(), verdict);
                    commands.push(UiCommand::Queue(work, std::mem::take(&mut self.reason)));
                    // Nothing moves before the specimen lies as it should and Start is pressed.
                    if verdict == QueueVerdict::Repeat {
                        commands.push(UiCommand::Show(run::SCREEN.name));
                    }
                }
            }
        });
        // What comes with a verdict stands below the buttons, which stay where they are.
        match queue.verdict_of(session) {
            Some(Ok(verdict)) => {
                sentence_ui(ui, verdict_words(*verdict));
                next_ui(ui, queue, commands);
            }
            Some(Err(reason)) => alarm_ui(ui, format!("the verdict was not written: {reason}")),
            None => {
                if let Err(reason) = can_reject.and(can_repeat) {
                    quiet_ui(ui, reason);
                }
            }
        }
    }
}

const fn verdict_words(verdict: QueueVerdict) -> &'static str {
    match verdict {
        QueueVerdict::Accept => "Accepted. The session's verdict is valid.",
        QueueVerdict::Reject => "Rejected. The session's verdict is rejected.",
        QueueVerdict::Repeat => {
            "Rejected, to be repeated: the screen Run has the same specimen and protocol."
        }
    }
}

/// The way on to the next specimen.
fn next_ui(ui: &mut Ui, queue: &QueueDesk, commands: &mut Commands) {
    let Some(next) = queue.queue().next() else { return };
    let name = format!("Next: {}", next.wanted.specimen);
    let size = vec2(ui.available_width(), BUTTON.y);
    if ui.add(Button::new(&name).min_size(size).wrap()).named(&name).clicked() {
        commands.push(UiCommand::TakeSpecimen(next.number));
    }
}

fn button_ui(ui: &mut Ui, name: &str, key: &str, is_enabled: bool) -> bool {
    let button = ui.add_enabled(is_enabled, Button::new(name).min_size(BUTTON)).named(name);
    let button = if key.is_empty() { button } else { button.on_hover_text(key) };
    button.clicked()
}
