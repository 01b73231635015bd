//! A labelled field of one line, as wide as there is room.

use super::places::NamedControl;
use super::quantity_input::form_label;
use super::steady::steady;
use eframe::egui::{Key, TextEdit, Ui};

/// Longest text taken: a path.
const TEXT_MAX: usize = 4096;

/// Draws the field behind its label; true when it was left with Enter.
pub fn text_row(ui: &mut Ui, name: &str, hint: &str, text: &mut String) -> bool {
    let row = |ui: &mut Ui| {
        let label = form_label(ui, name);
        let input = TextEdit::singleline(text)
            .desired_width(ui.available_width() - 8.0)
            .char_limit(TEXT_MAX)
            .hint_text(hint);
        let typed = ui.add(input).labelled_by(label.id).named(name);
        typed.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
    };
    steady(ui, name, |ui| ui.horizontal(row).inner)
}
