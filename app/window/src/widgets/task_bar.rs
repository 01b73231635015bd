//! Start of a longer piece of work, how far it is, and its end.

use super::reason_button::reason_button;
use crate::command::{Command, Commands};
use crate::theme::Tokens;
use crate::workers::task::{Standing, Task};
use eframe::egui::{Button, Label, ProgressBar, RichText, Ui, vec2};
use palpate_figures::uncertain::clock;

/// Draws the button, or the progress and its cancel; true when the work is to begin. `verdict` says whether it may, or
/// why not.
pub fn task_ui<T: Send + 'static>(
    ui: &mut Ui,
    start: &str,
    task: &Task<T>,
    verdict: &Result<(), String>,
) -> bool {
    let Some(standing) = task.standing() else {
        return reason_button(ui, start, vec2(170.0, 34.0), verdict);
    };
    bar_ui(ui, &standing);
    if task.is_ending() {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        ui.label(RichText::new("ending").color(tokens.text_quiet));
    } else if cancel_ui(ui, "Cancel") {
        task.cancel();
    }
    false
}

/// The same for the work of the screen shown.
pub fn work_ui<T: Send + 'static>(
    ui: &mut Ui,
    start: &str,
    task: &Task<T>,
    verdict: &Result<(), String>,
    commands: &mut Commands,
) {
    if task_ui(ui, start, task, verdict) {
        commands.push(Command::Work);
    }
}

/// Draws the progress of work that began by itself, and a button that ends it; true when that is pressed.
pub fn standing_ui(ui: &mut Ui, standing: &Standing, cancel: &str) -> bool {
    bar_ui(ui, standing);
    cancel_ui(ui, cancel)
}

fn cancel_ui(ui: &mut Ui, text: &str) -> bool {
    ui.add(Button::new(text).min_size(vec2(84.0, 26.0))).clicked()
}

fn bar_ui(ui: &mut Ui, standing: &Standing) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.add(
        ProgressBar::new(standing.fraction as f32)
            .desired_height(10.0)
            .corner_radius(2)
            .fill(tokens.text_quiet),
    );
    let left = standing.seconds_left.map_or_else(
        || format!("{} so far", clock(standing.seconds)),
        |left| format!("{} left", clock(left)),
    );
    ui.add(Label::new(RichText::new(format!("{left}: {}", standing.what)).small()).truncate());
}
