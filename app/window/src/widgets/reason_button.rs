//! A button that, when it cannot be pressed, says why in words beside it.

use super::places::NamedControl;
use super::steady::steady;
use crate::theme::Tokens;
use eframe::egui::{Button, Label, RichText, Ui, Vec2};

/// Draws the button; `verdict` both enables it and gives the reason. True when pressed.
pub fn reason_button(
    ui: &mut Ui,
    text: &str,
    min_size: Vec2,
    verdict: &Result<(), String>,
) -> bool {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let is_pressed = steady(ui, text, |ui| {
        ui.add_enabled(verdict.is_ok(), Button::new(text).min_size(min_size)).named(text).clicked()
    });
    if let Err(reason) = verdict {
        let reason = RichText::new(reason).color(tokens.text_quiet).small();
        ui.add(Label::new(reason).wrap());
    }
    is_pressed
}
