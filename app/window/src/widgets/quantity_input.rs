//! A number with a unit, checked on every change, with its error sentence beside it.

use super::places::NamedControl;
use super::steady::steady;
use crate::theme::Tokens;
use eframe::egui::{Align, Align2, RichText, TextEdit, Ui};

/// Text being typed and what it means.
#[derive(Clone, Debug, PartialEq)]
pub struct QuantityField {
    /// As typed.
    pub text: String,
    /// The number, or what is wrong in one sentence.
    pub value: Result<f64, String>,
}

impl QuantityField {
    /// A field that holds a number.
    #[must_use]
    pub fn new(value: f64) -> Self {
        Self { text: value.to_string(), value: Ok(value) }
    }

    /// Reads the text again and checks the number.
    pub fn check(&mut self, check: impl FnOnce(f64) -> Result<(), String>) {
        self.value = parse(&self.text).and_then(|value| check(value).map(|()| value));
    }
}

/// A finite number, or one sentence.
fn parse(text: &str) -> Result<f64, String> {
    let text = text.trim();
    if text.is_empty() {
        return Err("a number is missing here; write it like 0.75".into());
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ if text.contains(',') => {
            Err(format!("'{text}' is not a number; write it with a point, like 0.75"))
        }
        _ => Err(format!("'{text}' is not a finite number; write it like 0.75")),
    }
}

/// Width of the labels in front of the inputs of a form.
pub const LABEL_WIDTH: f32 = 74.0;

/// Draws a labelled input with its unit; true when the text changed.
pub fn quantity_ui(ui: &mut Ui, name: &str, unit: &str, field: &mut QuantityField) -> bool {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let row = |ui: &mut Ui| {
        let label = form_label(ui, name);
        let input = ui.add(
            TextEdit::singleline(&mut field.text)
                .desired_width(76.0)
                .char_limit(24)
                .align(Align2::RIGHT_CENTER),
        );
        ui.label(RichText::new(unit).color(tokens.text_quiet));
        input.labelled_by(label.id).named(name).changed()
    };
    let has_changed = steady(ui, name, |ui| ui.horizontal(row).inner);
    if let Err(reason) = &field.value {
        ui.label(RichText::new(reason).color(tokens.alarm_text).small());
    }
    has_changed
}

/// A label of fixed width, so that inputs stand in one column.
pub fn form_label(ui: &mut Ui, name: &str) -> eframe::egui::Response {
    use eframe::egui::{Label, Layout, vec2};
    let size = vec2(LABEL_WIDTH, ui.spacing().interact_size.y);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(LABEL_WIDTH);
        ui.add(Label::new(name))
    })
    .inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_numbers_pass_and_the_sentence_says_why() {
        for (text, wanted) in [
            ("0.75", Ok(0.75)),
            (" 30 ", Ok(30.0)),
            ("1e1", Ok(10.0)),
            ("", Err("missing")),
            ("0,75", Err("with a point")),
            ("fast", Err("'fast' is not a finite number")),
            ("nan", Err("not a finite number")),
            ("inf", Err("not a finite number")),
        ] {
            match (parse(text), wanted) {
                (Ok(value), Ok(wanted)) => assert!((value - wanted).abs() < 1e-12),
                (Err(reason), Err(words)) => assert!(reason.contains(words), "{reason}"),
                (got, _) => panic!("'{text}' gave {got:?}"),
            }
        }
    }

    #[test]
    fn a_failed_check_replaces_the_value() {
        let mut field = QuantityField::new(0.75);
        field.text = "99".into();
        field.check(|value| if value > 15.0 { Err("too fast".into()) } else { Ok(()) });
        assert_eq!(field.value, Err("too fast".into()));
    }
}
