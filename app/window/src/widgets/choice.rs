//! One of a few things, chosen from a list.

use super::places::NamedControl;
use super::quantity_input::form_label;
use eframe::egui::{ComboBox, Ui};

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
