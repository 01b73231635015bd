//! After a stop: why, and the two ways on. At the end: how it ended and where the data is.

use super::calibration::calibration_session;
use super::result;
use crate::command::{Commands, UiCommand};
use crate::shell::activity::is_planned;
use crate::widgets::{alarm_ui, placeholder_ui, quiet_ui, reason_button, section_ui, tokens_of};
use eframe::egui::{Button, Label, RichText, Ui, vec2};
use palpate_model::assessment::Assessment;
use palpate_protocols::engine::RunOutcome;
use palpate_runner::RunView;

/// Draws nothing while the run goes on as planned.
pub fn after_stop_ui(ui: &mut Ui, run: &RunView, commands: &mut Commands) {
    if let Some(outcome) = &run.outcome {
        section_ui(ui, "Run ended");
        outcome_ui(ui, outcome);
        log_ui(ui, run);
        if ui.button("Show the result").clicked() {
            commands.push(UiCommand::Show(result::SCREEN.name));
        }
    } else if let Some(ending) = &run.holding {
        section_ui(ui, "Run stopped, axis holds");
        outcome_ui(ui, ending);
        choices_ui(ui, run, commands);
    }
}

/// How a run ended, where its data is, and whether a calibration that it measured is to be kept.
pub fn ended_ui(ui: &mut Ui, run: &RunView, quality: Option<&Assessment>, commands: &mut Commands) {
    let Some(outcome) = &run.outcome else { return };
    section_ui(ui, "Run ended");
    outcome_ui(ui, outcome);
    log_ui(ui, run);
    if calibration_session(Some(run)).is_ok()
        && reason_button(ui, "Save this calibration", vec2(190.0, 48.0), &checked(quality))
    {
        commands.push(UiCommand::KeepCalibration);
    }
}

/// A calibration is judged before it can be kept; saving refuses a bad one and says why.
fn checked(quality: Option<&Assessment>) -> Result<(), String> {
    quality.map(|_| ()).ok_or_else(|| "the calibration is being checked".into())
}

/// The two ways on, with the reason if one of them is closed.
fn choices_ui(ui: &mut Ui, run: &RunView, commands: &mut Commands) {
    let button = |text: &'static str| Button::new(text).min_size(vec2(112.0, 28.0));
    ui.horizontal(|ui| {
        if ui.add_enabled(run.can_retract.is_ok(), button("Retract  F8")).clicked() {
            commands.push(UiCommand::Retract);
        }
        if ui.add(button("Close session")).clicked() {
            commands.push(UiCommand::CloseSession);
        }
    });
    if let Err(reason) = &run.can_retract {
        quiet_ui(ui, format!("No retract: {reason}"));
    }
}

fn outcome_ui(ui: &mut Ui, outcome: &RunOutcome) {
    let tokens = tokens_of(ui);
    let ink = if is_planned(outcome.ending) { tokens.text } else { tokens.alarm_text };
    let text = format!("{}: {}", outcome.ending, outcome.reason);
    ui.add(Label::new(RichText::new(text).color(ink)).wrap());
}

fn log_ui(ui: &mut Ui, run: &RunView) {
    let alarm = match (&run.log_error, &run.data_quality_error) {
        (Some(reason), _) => Some(format!(
            "The session on disk differs from what was recorded: {reason}; run 'palpate doctor {}' to see what is missing",
            run.folder.display()
        )),
        (None, Some(reason)) => {
            Some(format!("The recording is complete, but its verdict cannot be written: {reason}"))
        }
        (None, None) => None,
    };
    match alarm {
        Some(text) => alarm_ui(ui, text),
        None => placeholder_ui(ui, format!("Session in {}", run.folder.display())),
    }
}
