//! A box to tick that the palette leads to by its words.

use super::places::NamedControl;
use eframe::egui::{Response, Ui};

/// Draws it.
pub fn tick_box(ui: &mut Ui, is_on: &mut bool, words: &str) -> Response {
    ui.checkbox(is_on, words).named(words)
}
