//! Words in panels: headings, facts in two columns, remarks and what is wrong.

use crate::theme::Tokens;
use eframe::egui::accesskit::Live;
use eframe::egui::{Align, Color32, Label, Layout, Response, RichText, Sense, Ui, vec2};

/// Width of the names of facts in points.
pub const NAME_WIDTH: f32 = 80.0;

/// Colours of the theme that is shown.
pub fn tokens_of(ui: &Ui) -> &'static Tokens {
    Tokens::of(ui.visuals().dark_mode)
}

/// A heading.
pub fn heading_ui(ui: &mut Ui, words: impl Into<String>) {
    ui.label(RichText::new(words).heading().strong());
}

/// A section's title with space above it and a line below.
pub fn section_ui(ui: &mut Ui, title: &str) {
    ui.add_space(6.0);
    heading_ui(ui, title);
    ui.separator();
}

/// A fact's name, as wide as all of them.
pub fn fact_name_ui(ui: &mut Ui, name: &str) {
    let tokens = tokens_of(ui);
    let layout = Layout::left_to_right(Align::Min);
    ui.allocate_ui_with_layout(vec2(NAME_WIDTH, 0.0), layout, |ui| {
        ui.set_min_width(NAME_WIDTH);
        ui.label(RichText::new(name).color(tokens.text_quiet));
    });
}

/// One fact; values wrap under themselves.
pub fn fact_ui(ui: &mut Ui, name: &str, value: impl Into<String>) {
    ui.horizontal_top(|ui| {
        fact_name_ui(ui, name);
        ui.add(Label::new(RichText::new(value)).wrap().sense(Sense::empty()));
    });
}

/// A sentence that wraps.
pub fn sentence_ui(ui: &mut Ui, words: impl Into<String>) {
    ui.add(Label::new(words.into()).wrap());
}

/// Sentences below each other, the first one strong.
pub fn sentences_ui(ui: &mut Ui, sentences: &[String]) {
    for (index, sentence) in sentences.iter().enumerate() {
        let text = RichText::new(sentence);
        ui.add(Label::new(if index == 0 { text.strong() } else { text }).wrap());
        ui.add_space(4.0);
    }
}

/// A sentence in small letters.
pub fn small_ui(ui: &mut Ui, words: impl Into<String>) {
    ui.add(Label::new(RichText::new(words).small()).wrap());
}

/// What stands in the place of something that is not there yet.
pub fn placeholder_ui(ui: &mut Ui, words: impl Into<String>) {
    let ink = tokens_of(ui).text_quiet;
    colored_ui(ui, RichText::new(words), ink);
}

/// A remark in small letters.
pub fn quiet_ui(ui: &mut Ui, words: impl Into<String>) {
    let ink = tokens_of(ui).text_quiet;
    colored_ui(ui, RichText::new(words).small(), ink);
}

/// A sentence about what is wrong.
pub fn alarm_ui(ui: &mut Ui, words: impl Into<String>) {
    let ink = tokens_of(ui).alarm_text;
    let shown = ui.add(Label::new(RichText::new(words).color(ink)).wrap());
    announce(&shown, Live::Polite);
}

/// Has a screen reader say what stands there, whenever it changes.
pub fn announce(shown: &Response, live: Live) {
    shown.ctx.accesskit_node_builder(shown.id, |node| node.set_live(live));
}

/// What is wrong with a field, below it in small letters.
pub fn small_alarm_ui(ui: &mut Ui, words: impl Into<String>) {
    let ink = tokens_of(ui).alarm_text;
    colored_ui(ui, RichText::new(words).small(), ink);
}

fn colored_ui(ui: &mut Ui, words: RichText, ink: Color32) {
    ui.add(Label::new(words.color(ink)).wrap());
}
