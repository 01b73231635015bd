//! Sentences beside the controls: remarks, and what is wrong.

use crate::theme::Tokens;
use eframe::egui::{Label, RichText, Ui};

/// A remark.
pub fn quiet_ui(ui: &mut Ui, words: &str) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let words = RichText::new(words).color(tokens.text_quiet).small();
    ui.add(Label::new(words).wrap());
}

/// A sentence about what is wrong.
pub fn alarm_ui(ui: &mut Ui, words: &str) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.add(Label::new(RichText::new(words).color(tokens.alarm_text)).wrap());
}
