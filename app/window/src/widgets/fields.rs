//! Fields of a form: numbers, texts, boxes to tick and lists, each behind its label and known to the palette by its name.

use super::buttons::steady;
use super::places::NamedControl;
use super::text::{quiet_ui, small_alarm_ui, tokens_of};
use eframe::egui::text::CCursor;
use eframe::egui::text::CCursorRange;
use eframe::egui::text_edit::TextEditState;
use eframe::egui::{
    Align, Align2, ComboBox, Key, Label, Layout, Response, RichText, TextEdit, Ui, vec2,
};
use palpate_haptics::Period;
use palpate_model::quantity::{in_base_unit, split, units_like};
use palpate_model::typed_number::plain_text;
use palpate_rheology::families;
use palpate_rheology::tolerance::Tolerance;
use serde::{Deserialize, Serialize};

/// A number as it is typed, and what it means; its text alone is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct QuantityField {
    pub text: String,
    /// Of a number that is typed without one; as it was drawn last.
    unit: String,
    /// The number, or what is wrong in one sentence.
    pub value: Result<f64, String>,
}

impl Default for QuantityField {
    fn default() -> Self {
        Self::new(0.0)
    }
}

impl From<String> for QuantityField {
    fn from(text: String) -> Self {
        Self::typed(text)
    }
}

impl From<QuantityField> for String {
    fn from(field: QuantityField) -> Self {
        field.text
    }
}

impl QuantityField {
    /// A field that holds a number.
    #[must_use]
    pub fn new(value: f64) -> Self {
        Self { text: value.to_string(), unit: String::new(), value: Ok(value) }
    }

    /// A field with a text that is not read yet.
    #[must_use]
    pub fn typed(text: String) -> Self {
        Self { text, unit: String::new(), value: Err("not read yet".into()) }
    }

    /// The number, or its name and what is wrong.
    pub fn named_value(&self, name: &str) -> Result<f64, String> {
        self.value.clone().map_err(|reason| format!("{name}: {reason}"))
    }

    /// Reads the text again and checks the number.
    pub fn check(&mut self, check: impl FnOnce(f64) -> Result<(), String>) {
        let value = parse(&self.text, &self.unit);
        self.value = value.and_then(|value| check(value).map(|()| value));
    }
}

/// Whether a loop can have this rate in Hz, or why not.
pub fn check_rate(rate: f64) -> Result<(), String> {
    Period::of_rate(rate).map(|_| ()).map_err(|err| err.to_string())
}

/// A number as it is typed with its standard uncertainty; zero for one that is taken as exact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UncertainField {
    pub value: QuantityField,
    pub error: QuantityField,
}

impl UncertainField {
    /// A field with texts that are not read yet.
    #[must_use]
    pub fn typed([value, error]: [&str; 2]) -> Self {
        Self {
            value: QuantityField::typed(value.into()),
            error: QuantityField::typed(error.into()),
        }
    }

    pub fn texts(&self) -> [&str; 2] {
        [&self.value.text, &self.error.text]
    }

    /// Reads both texts again and checks the numbers together.
    pub fn check(&mut self, check: impl FnOnce([f64; 2]) -> Result<(), String>) {
        self.value.check(|_| Ok(()));
        self.error.check(|_| Ok(()));
        if let (Ok(value), Ok(error)) = (&self.value.value, &self.error.value)
            && let Err(reason) = check([*value, *error])
        {
            self.value.value = Err(reason);
        }
    }

    /// The number and its standard uncertainty, or the name and what is wrong.
    pub fn named_values(&self, name: &str) -> Result<[f64; 2], String> {
        Ok([self.value.named_value(name)?, self.error.named_value(&uncertainty_name(name))?])
    }
}

fn uncertainty_name(name: &str) -> String {
    format!("uncertainty of {name}")
}

/// A finite number in the unit of its field, or one sentence.
fn parse(text: &str, unit: &str) -> Result<f64, String> {
    let text = text.trim();
    if text.is_empty() {
        return Err("type a number here, such as 0.75".into());
    }
    let plain = plain_text(text).map_err(|err| err.to_string())?;
    let wrong = || format!("'{text}' is not a finite number; type a number such as 0.75");
    let (number, own) = split(plain.trim()).ok_or_else(wrong)?;
    if own.is_empty() || own == unit {
        return Ok(number);
    }
    // What is one of the field's unit in the base unit of its quantity.
    let one = in_base_unit(1.0, unit).filter(|_| units_like(unit).contains(&own));
    let (Some(one), Some(typed)) = (one, in_base_unit(number, own)) else {
        return Err(match unit {
            "" => wrong(),
            unit => format!("'{own}' cannot be converted to {unit}; type the number in {unit}"),
        });
    };
    Ok(typed / one)
}

/// Width in points of the labels in front of the inputs of a form.
const LABEL_WIDTH: f32 = 84.0;

/// Width in points of the input of a number.
const NUMBER_WIDTH: f32 = 76.0;

/// Draws a labelled input with its unit; true when the text changed.
pub fn quantity_ui(ui: &mut Ui, name: &str, unit: &str, field: &mut QuantityField) -> bool {
    let row = |ui: &mut Ui| {
        let label = form_label(ui, name);
        let input = input_ui(ui, unit, NUMBER_WIDTH, field);
        ui.label(RichText::new(unit).color(tokens_of(ui).text_quiet));
        input.labelled_by(label.id).named(name).changed()
    };
    let has_changed = steady(ui, name, |ui| ui.horizontal(row).inner);
    if let Err(reason) = &field.value {
        small_alarm_ui(ui, reason);
    }
    has_changed
}

/// The same for a number and its standard uncertainty; `wanted` stands below until the number is typed.
pub fn uncertain_ui(
    ui: &mut Ui,
    [name, unit, wanted]: [&str; 3],
    field: &mut UncertainField,
) -> bool {
    let row = |ui: &mut Ui| {
        let label = form_label(ui, name);
        let value = input_ui(ui, unit, NUMBER_WIDTH, &mut field.value);
        ui.label("±");
        let error = input_ui(ui, unit, 0.75 * NUMBER_WIDTH, &mut field.error);
        ui.label(RichText::new(unit).color(tokens_of(ui).text_quiet));
        let value = value.labelled_by(label.id).named(name);
        let name = uncertainty_name(name);
        let error = error.accessible_name(name.as_str()).named(&name);
        value.changed() || error.changed()
    };
    let has_changed = steady(ui, name, |ui| ui.horizontal(row).inner);
    match (&field.value.value, &field.error.value) {
        (Err(_), _) if field.value.text.trim().is_empty() => quiet_ui(ui, wanted),
        (Err(reason), _) | (_, Err(reason)) => small_alarm_ui(ui, reason),
        _ => {}
    }
    has_changed
}

/// Draws the input of a number in a unit.
fn input_ui(ui: &mut Ui, unit: &str, width: f32, field: &mut QuantityField) -> Response {
    if field.unit != unit {
        unit.clone_into(&mut field.unit);
    }
    let input = TextEdit::singleline(&mut field.text).desired_width(width).char_limit(24);
    let input = ui.add(input.align(Align2::RIGHT_CENTER));
    select_on_entry(&input, &field.text);
    input
}

/// Selects all of a field that has just been entered, by key or by a click, so that what is typed takes its place.
pub fn select_on_entry(input: &Response, text: &str) {
    let (ctx, id) = (&input.ctx, input.id.with("entered"));
    if input.gained_focus() {
        ctx.data_mut(|data| data.insert_temp(id, true));
    }
    // A press places the caret, and its release ends that.
    let is_entered = ctx.data(|data| data.get_temp::<bool>(id).is_some());
    if !is_entered || ctx.input(|input| input.pointer.any_down()) {
        return;
    }
    ctx.data_mut(|data| data.remove::<bool>(id));
    if let Some(mut state) = TextEditState::load(ctx, input.id) {
        let all = CCursorRange::two(CCursor::new(0), CCursor::new(text.chars().count()));
        state.cursor.set_char_range(Some(all));
        state.store(ctx, input.id);
    }
}

/// A label of fixed width, so that inputs stand in one column.
pub fn form_label(ui: &mut Ui, name: &str) -> Response {
    let size = vec2(LABEL_WIDTH, ui.spacing().interact_size.y);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(LABEL_WIDTH);
        ui.add(Label::new(name))
    })
    .inner
}

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

/// Draws the field of a tolerance and its meaning, which is `without` for an empty field where that is allowed.
pub fn tolerance_ui(ui: &mut Ui, text: &mut String, without: Option<&str>) {
    ui.horizontal(|ui| {
        let label = form_label(ui, "tolerance");
        let input = TextEdit::singleline(text).desired_width(96.0).char_limit(24);
        let hint = without.map_or("", |_| "none");
        ui.add(input.hint_text(hint)).labelled_by(label.id).named("tolerance");
    });
    match (text.trim(), without, text.parse::<Tolerance>()) {
        ("", Some(words), _) => quiet_ui(ui, words),
        (_, _, Ok(tolerance)) => quiet_ui(ui, format!("errors up to {tolerance} are acceptable")),
        (_, _, Err(reason)) => small_alarm_ui(ui, reason.to_string()),
    }
}

/// Draws a box to tick that the palette leads to by its words.
pub fn tick_box(ui: &mut Ui, is_on: &mut bool, words: &str) -> Response {
    ui.checkbox(is_on, words).named(words)
}

/// Draws the list behind its label. `choices`: what there is, with its words.
pub fn choice_ui<T: Clone + PartialEq>(
    ui: &mut Ui,
    name: &str,
    value: &mut T,
    choices: &[(T, &str)],
) {
    ui.horizontal(|ui| {
        let label = form_label(ui, name);
        let chosen = choices.iter().find(|(one, _)| one == value);
        ComboBox::from_id_salt(("list", name))
            .selected_text(chosen.map_or("", |(_, words)| *words))
            .width(ui.available_width() - 16.0)
            .show_ui(ui, |ui| {
                for (one, words) in choices {
                    ui.selectable_value(value, one.clone(), *words);
                }
            })
            .response
            .labelled_by(label.id)
            .named(name);
    });
}

/// The family that is fitted where none is chosen.
const OWN_MODEL: &str = "modified Kelvin";

/// A choice among all families.
pub struct ModelChoice {
    keys: Vec<String>,
    /// Key of the chosen one; none for the modified Kelvin body of third order.
    pub family: Option<String>,
    /// Take sessions though they were rejected.
    pub is_rejected_included: bool,
}

impl Default for ModelChoice {
    fn default() -> Self {
        let keys = families::all_families().iter().map(|one| one.key()).collect();
        Self { keys, family: None, is_rejected_included: false }
    }
}

impl ModelChoice {
    /// Draws the choice and the box for rejected sessions, under names that nothing else on the screen has.
    pub fn ui(&mut self, ui: &mut Ui, name: &'static str, include_rejected: &str) {
        let keys = self.keys.iter();
        let keys = keys.map(|key| (Some(key.clone()), key.as_str()));
        let all: Vec<_> = std::iter::once((None, OWN_MODEL)).chain(keys).collect();
        choice_ui(ui, name, &mut self.family, &all);
        tick_box(ui, &mut self.is_rejected_included, include_rejected);
    }
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
            ("", Err("type a number here")),
            ("0,75", Ok(0.75)),
            ("7,5 mm", Ok(7.5)),
            ("2 cm", Ok(20.0)),
            ("30 \u{3bc}m", Ok(0.03)),
            ("1,234", Err("could be 1.234 or 1234")),
            ("3 N", Err("'N' cannot be converted to mm")),
            ("fast", Err("'fast' is not a finite number")),
            ("nan", Err("not a finite number")),
            ("inf", Err("not a finite number")),
        ] {
            match (parse(text, "mm"), wanted) {
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
