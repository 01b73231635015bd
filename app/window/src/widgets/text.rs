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

/// Numbers with their powers of ten as in print: `5.18e-2` becomes 5.18·10⁻².
#[must_use]
pub fn in_print(text: &str) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |one: char| match one {
        '-' => Some('⁻'),
        _ => one.to_digit(10).map(|digit| RAISED[digit as usize]),
    };
    let mut print = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('e') {
        let (before, behind) = (&rest[..at], &rest[at + 1..]);
        print += before;
        let exponent: String = behind.chars().map_while(raised).collect();
        let is_number = before.ends_with(|one: char| one.is_ascii_digit() || ")]".contains(one));
        if is_number && !exponent.is_empty() {
            print += "·10";
            // A digit or a minus is one byte where it is typed.
            rest = &behind[exponent.chars().count()..];
            print += &exponent;
        } else {
            print.push('e');
            rest = behind;
        }
    }
    print + rest
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

#[cfg(test)]
mod tests {
    use super::in_print;

    #[test]
    fn powers_of_ten_are_raised_and_words_are_left_alone() {
        for (text, print) in [
            ("(5.1801 ± 0.0031)e-2", "(5.1801 ± 0.0031)·10⁻²"),
            ("-8.7320e-3 [-9.0000, 0.0000]e-3", "-8.7320·10⁻³ [-9.0000, 0.0000]·10⁻³"),
            ("1.5e12", "1.5·10¹²"),
            ("not yet", "not yet"),
            ("0.750", "0.750"),
            ("held at 1 e", "held at 1 e"),
        ] {
            assert_eq!(in_print(text), print);
        }
    }
}
