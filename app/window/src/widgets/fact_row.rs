//! A name and its value in two columns, for panels that state facts.

use crate::theme::Tokens;
use eframe::egui::{Align, Label, Layout, RichText, Sense, Ui, vec2};

/// Width of the names.
pub const NAME_WIDTH: f32 = 72.0;

/// Draws one fact; values wrap under themselves.
pub fn fact_ui(ui: &mut Ui, name: &str, value: impl Into<String>) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.horizontal_top(|ui| {
        let size = vec2(NAME_WIDTH, 0.0);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Min), |ui| {
            ui.set_min_width(NAME_WIDTH);
            ui.label(RichText::new(name).color(tokens.text_quiet));
        });
        ui.add(Label::new(RichText::new(value)).wrap().sense(Sense::empty()));
    });
}

/// A section's title with space above it.
pub fn section_ui(ui: &mut Ui, title: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(title).heading().strong());
    ui.separator();
}
