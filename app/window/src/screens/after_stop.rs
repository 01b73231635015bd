//! After a stop: why, and the two ways on. At the end: how it ended and where the data is.

use super::calibration::can_keep;
use crate::command::{CommandQueue, UserCommand};
use crate::shell::activity::is_planned;
use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::remark::{alarm_ui, quiet_ui};
use eframe::egui::{Button, Label, RichText, Ui, vec2};
use palpate_protocols::engine::Outcome;
use palpate_runner::RunView;

/// Draws nothing while the run goes on as planned.
pub fn after_stop_ui(ui: &mut Ui, run: &RunView, commands: &mut CommandQueue) {
    if let Some(outcome) = &run.outcome {
        section_ui(ui, "Run ended");
        outcome_ui(ui, outcome);
        log_ui(ui, run);
        if can_keep(Some(run)).is_ok() && ui.button("Keep this calibration").clicked() {
            commands.push(UserCommand::KeepCalibration);
        }
    } else if let Some(ending) = &run.holding {
        section_ui(ui, "Run stopped, axis holds");
        outcome_ui(ui, ending);
        choices_ui(ui, run, commands);
    }
}

/// The two ways on, with the reason if one of them is closed.
fn choices_ui(ui: &mut Ui, run: &RunView, commands: &mut CommandQueue) {
    let button = |text: &'static str| Button::new(text).min_size(vec2(112.0, 28.0));
    ui.horizontal(|ui| {
        if ui.add_enabled(run.can_retract.is_ok(), button("Retract  F8")).clicked() {
            commands.push(UserCommand::Retract);
        }
        if ui.add(button("Close session")).clicked() {
            commands.push(UserCommand::CloseSession);
        }
    });
    if let Err(reason) = &run.can_retract {
        let text = format!("No retract: {reason}");
        quiet_ui(ui, &text);
    }
}

fn outcome_ui(ui: &mut Ui, outcome: &Outcome) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let ink = if is_planned(outcome.ending) { tokens.text } else { tokens.alarm_text };
    let text = format!("{}: {}", outcome.ending, outcome.reason);
    ui.add(Label::new(RichText::new(text).color(ink)).wrap());
}

fn log_ui(ui: &mut Ui, run: &RunView) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let alarm = match (&run.log_error, &run.verdict_error) {
        (Some(reason), _) => Some(format!(
            "The session was not kept as it was recorded: {reason}; 'palpate doctor {}' tells what is missing",
            run.folder.display()
        )),
        (None, Some(reason)) => Some(format!(
            "The recording is whole, but the verdict could not be written beside it: {reason}"
        )),
        (None, None) => None,
    };
    match alarm {
        Some(text) => {
            alarm_ui(ui, &text);
        }
        None => {
            let text = format!("Session in {}", run.folder.display());
            ui.add(Label::new(RichText::new(text).color(tokens.text_quiet)).wrap());
        }
    }
}
