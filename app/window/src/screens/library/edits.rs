//! What is said of the sessions chosen: tags, notes, a verdict, a review; each an edit beside the log, and what of it can
//! be taken back.

use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::reason_button::reason_button;
use crate::widgets::task_bar::progress_ui;
use crate::widgets::text_row::text_row;
use crate::workers::task::BackgroundTask;
use eframe::egui::{Context, Key, Label, Modifiers, Popup, RichText, Ui, vec2};
use palpate_analysis::edits::{Act, Said, Saying, author, say, take_back};
use palpate_sessions::edits::{Decision, Verdict};
use std::path::PathBuf;

/// Acts of this window's life that can be taken back.
const KEPT: usize = 50;

/// Size of a button in points.
const BUTTON: f32 = 24.0;

/// What is under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EditStep {
    Say,
    Undo,
    Redo,
}

/// The panel.
pub(super) struct EditPanel {
    by: String,
    tags: String,
    note: String,
    reason: String,
    task: BackgroundTask<Said>,
    doing: EditStep,
    undo: Vec<Act>,
    redo: Vec<Act>,
}

impl Default for EditPanel {
    fn default() -> Self {
        Self {
            by: author(None),
            tags: String::new(),
            note: String::new(),
            reason: String::new(),
            task: BackgroundTask::default(),
            doing: EditStep::Say,
            undo: Vec::new(),
            redo: Vec::new(),
        }
    }
}

/// The words of a line as tags to give and, with a `-` before them, to take away.
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
    /// Fetches what came of an edit; true when something was written.
    pub fn poll(&mut self) -> bool {
        let was_busy = self.task.state().is_some();
        self.task.poll();
        if !was_busy || self.task.state().is_some() {
            return false;
        }
        let Some(Ok(said)) = self.task.answer() else {
            return true;
        };
        if let Some(act) = said.act.clone() {
            match self.doing {
                EditStep::Say => {
                    self.undo.push(act);
                    // What was taken back before is another story now.
                    self.redo.clear();
                }
                EditStep::Undo => self.redo.push(act),
                EditStep::Redo => self.undo.push(act),
            }
            if self.undo.len() > KEPT {
                self.undo.remove(0);
            }
        }
        if self.doing == EditStep::Say && said.failed.is_empty() {
            self.tags.clear();
            self.note.clear();
            self.reason.clear();
        }
        true
    }

    fn may(&self, chosen: usize) -> Result<(), String> {
        if self.task.state().is_some() {
            return Err("an edit is being written".into());
        }
        if chosen == 0 {
            return Err("choose sessions first".into());
        }
        if self.by.trim().is_empty() {
            return Err("say who says so, in 'by'".into());
        }
        Ok(())
    }

    fn say(&mut self, ctx: &Context, sessions: &[PathBuf], saying: Saying) {
        let (sessions, by) = (sessions.to_vec(), self.by.trim().to_owned());
        self.doing = EditStep::Say;
        self.task.start("edits", ctx, move |progress| Ok(say(&saying, &sessions, &by, progress)));
    }

    fn turn_back(&mut self, ctx: &Context, doing: EditStep) {
        if self.may(1).is_err() {
            return;
        }
        let stack = match doing {
            EditStep::Redo => &mut self.redo,
            EditStep::Say | EditStep::Undo => &mut self.undo,
        };
        let Some(act) = stack.pop() else { return };
        let by = self.by.trim().to_owned();
        self.doing = doing;
        self.task.start("undo", ctx, move |progress| Ok(take_back(&act, &by, progress)));
    }

    /// Ctrl+Z takes back, Ctrl+Shift+Z and Ctrl+Y do again, while no text is being typed.
    pub fn keys(&mut self, ctx: &Context) {
        if ctx.egui_wants_keyboard_input() || Popup::is_any_open(ctx) {
            return;
        }
        let pressed =
            |modifiers: Modifiers, key| ctx.input_mut(|input| input.consume_key(modifiers, key));
        let both = Modifiers::COMMAND | Modifiers::SHIFT;
        if pressed(both, Key::Z) || pressed(Modifiers::COMMAND, Key::Y) {
            self.turn_back(ctx, EditStep::Redo);
        } else if pressed(Modifiers::COMMAND, Key::Z) {
            self.turn_back(ctx, EditStep::Undo);
        }
    }

    /// Draws the fields and buttons; `sessions` are the folders of those chosen.
    pub fn ui(&mut self, ui: &mut Ui, sessions: &[PathBuf]) {
        let ctx = ui.ctx().clone();
        section_ui(ui, "Say of them");
        text_row(ui, "by", "your name", &mut self.by);
        let may = self.may(sessions.len());
        let needs = |text: &str, what: &str| match text.trim() {
            "" => may.clone().and(Err(format!("write {what} first"))),
            _ => may.clone(),
        };
        let mut wanted = None;
        text_row(ui, "new tags", "+pilot -doubtful", &mut self.tags);
        if button(ui, "Change tags", &needs(&self.tags, "tags")) {
            let (add, remove) = tags(&self.tags);
            wanted = Some(Saying::Tags { add, remove });
        }
        text_row(ui, "note", "what is to be remembered", &mut self.note);
        if button(ui, "Add note", &needs(&self.note, "the note")) {
            wanted = Some(Saying::Note(self.note.clone()));
        }
        text_row(ui, "reason", "of a verdict or a review", &mut self.reason);
        let needs_reason = needs(&self.reason, "the reason");
        ui.horizontal_wrapped(|ui| {
            for (name, verdict) in [
                ("Valid", Verdict::Valid),
                ("Suspect", Verdict::Suspect),
                ("Rejected", Verdict::Rejected),
            ] {
                if pressed(ui, name, needs_reason.is_ok()) {
                    wanted = Some(Saying::Verdict(verdict, self.reason.clone()));
                }
            }
        });
        ui.horizontal_wrapped(|ui| {
            for (name, decision) in [
                ("Accept", Decision::Accepted),
                ("Reject", Decision::Rejected),
                ("Repeat", Decision::Repeat),
            ] {
                if pressed(ui, name, needs_reason.is_ok()) {
                    wanted = Some(Saying::Review(decision, self.reason.clone()));
                }
            }
        });
        if let Err(reason) = &needs_reason {
            sentence(ui, &format!("Verdict and review: {reason}"), false);
        }
        if let Some(saying) = wanted {
            self.say(&ctx, sessions, saying);
        }
        self.back_ui(ui, &ctx);
    }

    fn back_ui(&mut self, ui: &mut Ui, ctx: &Context) {
        ui.add_space(6.0);
        if let Some(state) = self.task.state() {
            if state.seconds > 1.0 && progress_ui(ui, &state, "Cancel edits") {
                self.task.cancel();
            }
        } else {
            match self.task.answer() {
                Some(Ok(said)) => {
                    let done = match self.doing {
                        EditStep::Undo if said.act.is_some() => "taken back: ",
                        EditStep::Redo if said.act.is_some() => "done again: ",
                        _ => "",
                    };
                    sentence(ui, &format!("{done}{}", said.words), false);
                    said.failed.iter().for_each(|why| sentence(ui, why, true));
                }
                Some(Err(err)) => sentence(ui, err, true),
                None => {}
            }
        }
        let may = self.may(1);
        let words = |name: &str, stack: &[Act]| {
            let act = stack.last()?;
            Some(format!("{name}: {}", act.words))
        };
        for (text, doing) in [
            (words("Undo", &self.undo), EditStep::Undo),
            (words("Redo", &self.redo), EditStep::Redo),
        ] {
            let Some(text) = text else { continue };
            // The words may be many; under the pointer stands all of it.
            let button = eframe::egui::Button::new(&text).truncate();
            let button = ui.add_enabled(may.is_ok(), button).on_hover_text(&text);
            if button.clicked() {
                self.turn_back(ctx, doing);
                break;
            }
        }
        if self.undo.is_empty() && self.redo.is_empty() && self.task.answer().is_none() {
            let text = "Tags and verdicts given here can be taken back, by a record of their own; notes and reviews stay.";
            sentence(ui, text, false);
        }
    }
}

fn button(ui: &mut Ui, text: &str, verdict: &Result<(), String>) -> bool {
    reason_button(ui, text, vec2(96.0, BUTTON), verdict)
}

fn pressed(ui: &mut Ui, text: &str, is_enabled: bool) -> bool {
    let button = eframe::egui::Button::new(text).min_size(vec2(64.0, BUTTON));
    ui.add_enabled(is_enabled, button).clicked()
}

/// A sentence that wraps.
pub(super) fn sentence(ui: &mut Ui, text: &str, is_wrong: bool) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let ink = match is_wrong {
        true => tokens.alarm_text,
        false => tokens.text_quiet,
    };
    ui.add(Label::new(RichText::new(text).color(ink).small()).wrap());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_given_and_taken_away_by_their_signs() {
        let words = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<_>>();
        let line = " +pilot, good  -doubtful";
        assert_eq!(tags(line), (words(&["pilot", "good"]), words(&["doubtful"])));
        assert_eq!(tags(" , "), (words(&[]), words(&[])));
    }
}
