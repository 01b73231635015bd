//! Start of a longer piece of work, how far it is, and its end.

use super::reason_button::reason_button;
use crate::theme::Tokens;
use crate::workers::task::{Standing, Task};
use eframe::egui::{Button, Label, ProgressBar, RichText, Ui, vec2};
use palpate_figures::uncertain::clock;

/// What was pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pressed {
    /// Begin.
    Start,
    /// End before it is done.
    Cancel,
}

/// Draws the button, or the progress and its cancel. `verdict` says whether it may begin, or why not.
pub fn task_ui<T: Send + 'static>(
    ui: &mut Ui,
    start: &str,
    task: &Task<T>,
    verdict: &Result<(), String>,
) -> Option<Pressed> {
    let Some(standing) = task.standing() else {
        let is_pressed = reason_button(ui, start, vec2(170.0, 34.0), verdict);
        return is_pressed.then_some(Pressed::Start);
    };
    bar_ui(ui, &standing);
    let mut pressed = None;
    if task.is_ending() {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        ui.label(RichText::new("ending").color(tokens.text_quiet));
    } else if cancel_ui(ui, "Cancel") {
        pressed = Some(Pressed::Cancel);
    }
    pressed
}

/// Draws the progress of work that began by itself, and a button that ends it; true when that is pressed.
pub fn standing_ui(ui: &mut Ui, standing: &Standing, cancel: &str) -> bool {
    bar_ui(ui, standing);
    cancel_ui(ui, cancel)
}

fn cancel_ui(ui: &mut Ui, text: &str) -> bool {
    ui.add(Button::new(text).min_size(vec2(84.0, 26.0)))
        .clicked()
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
