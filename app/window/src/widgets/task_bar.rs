//! Start, progress and end of a longer piece of work.

use super::buttons::reason_button;
use super::text::{alarm_ui, placeholder_ui, tokens_of};
use crate::command::{Commands, UiCommand};
use crate::workers::{BackgroundTask, TaskState};
use eframe::egui::{Button, Label, ProgressBar, RichText, Ui, vec2};
use palpate_figures::uncertain::clock;

/// Draws the button, or the progress and its cancel; true when the work is to begin. `verdict` says whether it may, or
/// why not.
pub fn task_ui<T: Send + 'static>(
    ui: &mut Ui,
    start: &str,
    task: &BackgroundTask<T>,
    verdict: &Result<(), String>,
) -> bool {
    let Some(state) = task.state() else {
        return reason_button(ui, start, vec2(170.0, 34.0), verdict);
    };
    bar_ui(ui, &state);
    if task.is_ending() {
        placeholder_ui(ui, "ending");
    } else if cancel_ui(ui, "Cancel") {
        task.cancel();
    }
    false
}

/// The same for the work of the screen shown.
pub fn work_ui<T: Send + 'static>(
    ui: &mut Ui,
    start: &str,
    task: &BackgroundTask<T>,
    verdict: &Result<(), String>,
    commands: &mut Commands,
) {
    if task_ui(ui, start, task, verdict) {
        commands.push(UiCommand::Work);
    }
}

/// The answer of a task; without one it draws what is wrong, or words that stand there before the first.
pub fn answer_ui<'a, T: Send + 'static>(
    ui: &mut Ui,
    task: &'a BackgroundTask<T>,
    before: &str,
) -> Option<&'a T> {
    match task.answer() {
        Some(Ok(answer)) => return Some(answer),
        Some(Err(reason)) => alarm_ui(ui, reason),
        None => placeholder_ui(ui, before),
    }
    None
}

/// Draws a bar for a share from 0 to 1.
pub fn share_ui(ui: &mut Ui, share: f64) {
    let bar = ProgressBar::new(share as f32).desired_height(10.0).corner_radius(2);
    ui.add(bar.fill(tokens_of(ui).text_quiet));
}

/// Draws the progress of work that began without a button, and a button that cancels it; true when that is pressed.
pub fn progress_ui(ui: &mut Ui, state: &TaskState, cancel: &str) -> bool {
    bar_ui(ui, state);
    cancel_ui(ui, cancel)
}

fn cancel_ui(ui: &mut Ui, text: &str) -> bool {
    ui.add(Button::new(text).min_size(vec2(84.0, 26.0))).clicked()
}

fn bar_ui(ui: &mut Ui, state: &TaskState) {
    share_ui(ui, state.fraction);
    let left = state.seconds_left.map_or_else(
        || format!("{} so far", clock(state.seconds)),
        |left| format!("{} left", clock(left)),
    );
    ui.add(Label::new(RichText::new(format!("{left}: {}", state.what)).small()).truncate());
}
