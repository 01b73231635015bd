//! Edits of the sessions chosen: tags, notes, a verdict, a review. Each is a record next to the log; tags and verdicts can
//! be undone.

use crate::widgets::{
    progress_ui, quiet_ui, reason_button, require, section_ui, small_alarm_ui, text_row,
};
use crate::workers::BackgroundTask;
use eframe::egui::{Button, Context, Key, Modifiers, Popup, Ui, vec2};
use palpate_analysis::edits::{
    EditOutcome, SessionEdit, UndoableEdits, author, edit_sessions, undo_edits,
};
use palpate_sessions::edits::{DataQuality, ReviewDecision};
use std::path::PathBuf;

/// Edits that can be undone.
const UNDO_MAX: usize = 50;

/// Size of a button in points.
const BUTTON: f32 = 24.0;

/// The kind of work in progress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum EditStep {
    #[default]
    Edit,
    Undo,
    Redo,
}

pub(super) struct EditPanel {
    by: String,
    tags: String,
    note: String,
    reason: String,
    task: BackgroundTask<EditOutcome>,
    step: EditStep,
    undo: Vec<UndoableEdits>,
    redo: Vec<UndoableEdits>,
}

impl Default for EditPanel {
    fn default() -> Self {
        Self {
            by: author(None),
            tags: String::new(),
            note: String::new(),
            reason: String::new(),
            task: BackgroundTask::default(),
            step: EditStep::default(),
            undo: Vec::new(),
            redo: Vec::new(),
        }
    }
}

/// The words of a line as tags to add and, with a `-` before them, to remove.
fn tags(line: &str) -> (Vec<String>, Vec<String>) {
    let (mut add, mut remove) = (Vec::new(), Vec::new());
    for word in line.split([' ', ',']).filter(|word| !word.is_empty()) {
        match word.strip_prefix('-') {
            Some(word) => remove.push(word.to_owned()),
            None => add.push(word.strip_prefix('+').unwrap_or(word).to_owned()),
        }
    }
    (add, remove)
}

impl EditPanel {
    /// Fetches the result of an edit; true when it has ended.
    pub fn poll(&mut self) -> bool {
        if !self.task.poll() {
            return false;
        }
        let Some(Ok(edited)) = self.task.answer() else { return true };
        if let Some(act) = edited.undo.clone() {
            match self.step {
                EditStep::Edit => {
                    self.undo.push(act);
                    self.redo.clear();
                }
                EditStep::Undo => self.redo.push(act),
                EditStep::Redo => self.undo.push(act),
            }
            if self.undo.len() > UNDO_MAX {
                self.undo.remove(0);
            }
        }
        if self.step == EditStep::Edit && edited.failed.is_empty() {
            self.tags.clear();
            self.note.clear();
            self.reason.clear();
        }
        true
    }

    fn may(&self, chosen: usize) -> Result<(), String> {
        require(!self.task.is_busy(), "an edit is being written")?;
        require(chosen > 0, "choose sessions first")?;
        require(!self.by.trim().is_empty(), "type your name into the field 'by'")
    }

    fn start(&mut self, ctx: &Context, sessions: &[PathBuf], edit: SessionEdit) {
        let (sessions, by) = (sessions.to_vec(), self.by.trim().to_owned());
        self.step = EditStep::Edit;
        self.task.start("edits", ctx, move |progress| {
            Ok(edit_sessions(&edit, &sessions, &by, progress))
        });
    }

    fn undo_or_redo(&mut self, ctx: &Context, step: EditStep) {
        if self.may(1).is_err() {
            return;
        }
        let is_redo = step == EditStep::Redo;
        let stack = if is_redo { &mut self.redo } else { &mut self.undo };
        let Some(act) = stack.pop() else { return };
        let by = self.by.trim().to_owned();
        self.step = step;
        self.task.start("undo", ctx, move |progress| Ok(undo_edits(&act, &by, progress)));
    }

    /// Ctrl+Z undoes, Ctrl+Shift+Z and Ctrl+Y redo, while no text is typed.
    pub fn read_keys(&mut self, ctx: &Context) {
        if ctx.egui_wants_keyboard_input() || Popup::is_any_open(ctx) {
            return;
        }
        let pressed =
            |modifiers: Modifiers, key| ctx.input_mut(|input| input.consume_key(modifiers, key));
        let both = Modifiers::COMMAND | Modifiers::SHIFT;
        if pressed(both, Key::Z) || pressed(Modifiers::COMMAND, Key::Y) {
            self.undo_or_redo(ctx, EditStep::Redo);
        } else if pressed(Modifiers::COMMAND, Key::Z) {
            self.undo_or_redo(ctx, EditStep::Undo);
        }
    }

    /// Draws the fields and buttons; `sessions` are the folders of those chosen.
    /// Takes the operator of Run for the author, until another name is typed.
    pub fn offer_author(&mut self, operator: &str) {
        if !operator.is_empty() && self.by == author(None) {
            operator.clone_into(&mut self.by);
        }
    }

    pub fn ui(&mut self, ui: &mut Ui, sessions: &[PathBuf]) {
        let ctx = ui.ctx().clone();
        section_ui(ui, "Edit sessions");
        text_row(ui, "by", "your name", &mut self.by);
        let may = self.may(sessions.len());
        let needs = |text: &str, what: &str| {
            may.clone().and(require(!text.trim().is_empty(), format!("type {what} first")))
        };
        let mut edit = None;
        text_row(ui, "new tags", "+pilot -doubtful", &mut self.tags);
        if button(ui, "Change tags", &needs(&self.tags, "tags")) {
            let (add, remove) = tags(&self.tags);
            edit = Some(SessionEdit::Tags { add, remove });
        }
        text_row(ui, "note", "a remark", &mut self.note);
        if button(ui, "Add note", &needs(&self.note, "the note")) {
            edit = Some(SessionEdit::Note(self.note.clone()));
        }
        text_row(ui, "reason", "of a verdict or a review", &mut self.reason);
        let needs_reason = needs(&self.reason, "the reason");
        let verdicts = [
            ("Valid", DataQuality::Valid),
            ("Suspect", DataQuality::Suspect),
            ("Rejected", DataQuality::Rejected),
        ];
        if let Some(verdict) = choice_buttons(ui, verdicts, needs_reason.is_ok()) {
            edit = Some(SessionEdit::Verdict(verdict, self.reason.clone()));
        }
        let decisions = [
            ("Accept", ReviewDecision::Accepted),
            ("Reject", ReviewDecision::Rejected),
            ("Repeat", ReviewDecision::Repeat),
        ];
        if let Some(decision) = choice_buttons(ui, decisions, needs_reason.is_ok()) {
            edit = Some(SessionEdit::Review(decision, self.reason.clone()));
        }
        if let Err(reason) = &needs_reason {
            quiet_ui(ui, format!("Verdict and review: {reason}"));
        }
        if let Some(edit) = edit {
            self.start(&ctx, sessions, edit);
        }
        self.undo_ui(ui, &ctx);
    }

    fn undo_ui(&mut self, ui: &mut Ui, ctx: &Context) {
        ui.add_space(6.0);
        if let Some(state) = self.task.state() {
            if state.seconds > 1.0 && progress_ui(ui, &state, "Cancel edits") {
                self.task.cancel();
            }
        } else {
            match self.task.answer() {
                Some(Ok(edited)) => {
                    let done = match self.step {
                        EditStep::Undo if edited.undo.is_some() => "undone: ",
                        EditStep::Redo if edited.undo.is_some() => "redone: ",
                        _ => "",
                    };
                    quiet_ui(ui, format!("{done}{}", edited.words));
                    edited.failed.iter().for_each(|reason| small_alarm_ui(ui, reason));
                }
                Some(Err(err)) => small_alarm_ui(ui, err),
                None => {}
            }
        }
        let may = self.may(1);
        let words = |name: &str, stack: &[UndoableEdits]| {
            let act = stack.last()?;
            Some(format!("{name}: {}", act.words))
        };
        for (text, step) in [
            (words("Undo", &self.undo), EditStep::Undo),
            (words("Redo", &self.redo), EditStep::Redo),
        ] {
            let Some(text) = text else { continue };
            // The text may be long; the hint has all of it.
            let button = Button::new(&text).truncate();
            let button = ui.add_enabled(may.is_ok(), button).on_hover_text(&text);
            if button.clicked() {
                self.undo_or_redo(ctx, step);
                break;
            }
        }
        if self.undo.is_empty() && self.redo.is_empty() && self.task.answer().is_none() {
            let text = "Tags and verdicts can be undone, and each undo is recorded; notes and reviews cannot be undone.";
            quiet_ui(ui, text);
        }
    }
}

fn button(ui: &mut Ui, text: &str, verdict: &Result<(), String>) -> bool {
    reason_button(ui, text, vec2(96.0, BUTTON), verdict)
}

/// Draws buttons in a row; returns the choice of the one that was pressed.
fn choice_buttons<T>(ui: &mut Ui, choices: [(&str, T); 3], is_enabled: bool) -> Option<T> {
    let mut chosen = None;
    ui.horizontal_wrapped(|ui| {
        for (name, choice) in choices {
            let button = Button::new(name).min_size(vec2(64.0, BUTTON));
            if ui.add_enabled(is_enabled, button).clicked() {
                chosen = Some(choice);
            }
        }
    });
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_add_and_remove_tags() {
        let words = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<_>>();
        let line = " +pilot, good  -doubtful";
        assert_eq!(tags(line), (words(&["pilot", "good"]), words(&["doubtful"])));
        assert_eq!(tags(" , "), (words(&[]), words(&[])));
    }
}
