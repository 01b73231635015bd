//! Controls of the run in progress, on every screen: pause, resume, finish early, abort, and the answer to a prompt. Stop
//! and halt are in the top bar.

use crate::command::{Commands, UiCommand};
use crate::widgets::{NamedControl, tokens_of};
use eframe::egui::{
    Align, Button, Frame, Key, Label, Layout, Margin, RichText, Stroke, TextEdit, Ui, vec2,
};
use palpate_figures::uncertain::clock;
use palpate_model::rig::Phase;
use palpate_protocols::engine::{Operator, PauseView};
use palpate_runner::{PromptView, RunView};

/// A control of a run in progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunControl {
    Pause,
    /// Pause at the next checkpoint.
    PauseAfter,
    /// Go on, or cancel a pause that is pending.
    Resume,
    /// While paused: skip the remaining measurements.
    Finish,
    /// Stop and mark the run failed.
    Abort,
    /// The work of the prompt is done.
    Confirm,
    /// The work of the prompt will not be done.
    Decline,
    /// Read the last weight again.
    Redo,
}

impl RunControl {
    /// The choice to send to the runner, or why it is not possible now.
    pub fn operator(self, run: &RunView) -> Result<Operator, String> {
        let is_paused = matches!(run.pause, PauseView::Paused { .. });
        let refuse = |reason: &str| Err(reason.to_owned());
        if !is_controllable(run) {
            return refuse("the run has stopped");
        }
        match (self, run.pause) {
            (Self::Pause | Self::PauseAfter, _) if is_paused => refuse("the run is paused"),
            (Self::Pause, _) => Ok(Operator::Pause),
            (Self::PauseAfter, PauseView::Pending { .. }) => refuse("a pause is pending already"),
            (Self::PauseAfter, _) => match &run.next_checkpoint {
                Some((step_index, _)) => Ok(Operator::PauseAfter { step_index: *step_index }),
                None => refuse("no checkpoint is ahead"),
            },
            (Self::Resume, PauseView::None) => refuse("the run is not paused"),
            (Self::Resume, PauseView::Paused { no_resume: Some(why) }) => refuse(why),
            (Self::Resume, _) => Ok(Operator::Resume),
            (Self::Finish, _) if is_paused => Ok(Operator::Finish),
            (Self::Finish, _) => refuse("pause first"),
            (Self::Abort, _) => Ok(Operator::Abort),
            (Self::Confirm | Self::Decline, _) if run.prompt.is_none() => {
                refuse("there is no prompt")
            }
            (Self::Confirm, _) => Ok(Operator::Confirm),
            (Self::Decline, _) => Ok(Operator::Decline),
            (Self::Redo, _) => run.can_redo.clone().map(|()| Operator::Redo),
        }
    }
}

/// Whether the run can be controlled: not stopping, stopped or ended.
#[must_use]
pub fn is_controllable(run: &RunView) -> bool {
    run.outcome.is_none() && run.holding.is_none() && run.phase != Phase::Stopped
}

/// Draws the buttons, the state of the pause in words, and the prompt if there is one.
pub fn run_strip_ui(ui: &mut Ui, run: &RunView, note: &mut String, commands: &mut Commands) {
    let is_wide = ui.available_width() >= ONE_ROW;
    ui.horizontal_wrapped(|ui| {
        let after = match &run.next_checkpoint {
            Some((_, name)) if name.starts_with("after ") => format!("Pause {name}  F4"),
            Some((_, name)) => format!("Pause at {name}  F4"),
            None => "Pause at a checkpoint  F4".into(),
        };
        for (control, text) in [
            (RunControl::Pause, "Pause  F7"),
            (RunControl::PauseAfter, after.as_str()),
            (RunControl::Resume, "Resume  F9"),
            (RunControl::Finish, "Finish early  F10"),
            (RunControl::Abort, "Abort"),
        ] {
            control_ui(ui, run, control, text, commands);
        }
        if is_wide {
            remark_ui(ui, run, note, commands);
        }
    });
    if !is_wide {
        ui.horizontal(|ui| remark_ui(ui, run, note, commands));
    }
    if let Some(prompt) = &run.prompt {
        prompt_ui(ui, run, prompt, commands);
    }
}

/// The note at the right, and in front of it the state of the pause in words, cut off where there is too little room.
fn remark_ui(ui: &mut Ui, run: &RunView, note: &mut String, commands: &mut Commands) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        note_ui(ui, note, commands);
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            let words = RichText::new(pause_words(run)).color(tokens_of(ui).text_quiet);
            ui.add(Label::new(words).truncate());
        });
    });
}

/// Points from which the buttons and the note have room in one row.
const ONE_ROW: f32 = 980.0;

/// Most characters of a note.
const NOTE_MAX: usize = 300;

/// A note of the operator with the time at which it is written.
fn note_ui(ui: &mut Ui, note: &mut String, commands: &mut Commands) {
    let name = if note.trim().is_empty() { "Mark  F3" } else { "Note  F3" };
    if ui.add(Button::new(name).min_size(vec2(74.0, 28.0))).clicked() {
        commands.push(UiCommand::NoteTyped);
    }
    let input = TextEdit::singleline(note).desired_width(180.0).char_limit(NOTE_MAX);
    // Drawn from the right, so the label comes after its field.
    let input = ui.add(input).named("note");
    let label = ui.label("note");
    let is_taken = input.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    input.labelled_by(label.id);
    if is_taken {
        commands.push(UiCommand::NoteTyped);
    }
}

fn control_ui(
    ui: &mut Ui,
    run: &RunView,
    control: RunControl,
    text: &str,
    commands: &mut Commands,
) {
    let verdict = control.operator(run);
    let button = Button::new(text).min_size(vec2(0.0, 28.0));
    let response = ui.add_enabled(verdict.is_ok(), button);
    let response = match verdict {
        Err(reason) => response.on_disabled_hover_text(reason),
        Ok(_) => response,
    };
    if response.clicked() {
        commands.push(UiCommand::RunControl(control));
    }
}

/// State of the run, and why a button is closed.
fn pause_words(run: &RunView) -> String {
    match run.pause {
        PauseView::Paused { no_resume: None } => {
            "Paused. Resume continues; Finish early skips the rest and retracts.".into()
        }
        PauseView::Paused { no_resume: Some(why) } => {
            format!(
                "Paused. The run cannot be resumed: {why}. Finish early keeps the data and retracts."
            )
        }
        PauseView::Pending { step_index } => match &run.next_checkpoint {
            Some((index, name)) if *index == step_index => {
                format!("The run pauses at checkpoint '{name}'; Resume cancels the pause.")
            }
            _ => format!("The run pauses after step {}; Resume cancels the pause.", step_index + 1),
        },
        PauseView::None if run.next_checkpoint.is_none() => {
            "Running. No checkpoints remain. Pause the run to enable Resume and Finish early."
                .into()
        }
        PauseView::None => "Running. Pause the run to enable Resume and Finish early.".into(),
    }
}

/// The prompt. It blocks nothing: motion can be stopped and panels used.
fn prompt_ui(ui: &mut Ui, run: &RunView, prompt: &PromptView, commands: &mut Commands) {
    let tokens = tokens_of(ui);
    Frame::new()
        .fill(tokens.canvas)
        .stroke(Stroke::new(2.0, tokens.notice_fill))
        .inner_margin(Margin::symmetric(10, 8))
        .show(ui, |ui| {
            ui.horizontal(|ui| {
                control_ui(ui, run, RunControl::Confirm, "Done  F2", commands);
                control_ui(ui, run, RunControl::Decline, "Not done", commands);
                if run.can_redo.is_ok() {
                    control_ui(ui, run, RunControl::Redo, "Last weight again", commands);
                }
                let left = match run.pause {
                    PauseView::Paused { .. } => "the countdown for the answer is paused too".into(),
                    _ => format!("{} left to answer", clock(prompt.time_left.0)),
                };
                ui.label(RichText::new(left).color(tokens.text_quiet));
                ui.add(Label::new(RichText::new(&prompt.message).size(17.0).strong()).wrap());
            });
        });
}
