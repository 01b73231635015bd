//! One of many names, or any: a list with a field that narrows it; only names in sight are laid out.

use super::fields::form_label;
use super::places::NamedControl;
use eframe::egui::{ComboBox, PopupCloseBehavior, ScrollArea, TextEdit, Ui};

/// More names than this have a field that narrows them.
const MANY: usize = 12;
/// Height of the list in points.
const LIST: f32 = 220.0;

/// What stands where nothing is chosen.
const ANY: &str = "any";

/// Draws the choice behind its label; true when it changed. `narrow` is what is typed to find a name.
pub fn choice_box_ui(
    ui: &mut Ui,
    name: &str,
    chosen: &mut Option<String>,
    choices: &[String],
    narrow: &mut String,
) -> bool {
    let before = chosen.clone();
    ui.horizontal(|ui| {
        let label = form_label(ui, name);
        ComboBox::from_id_salt(("choice", name))
            .selected_text(chosen.as_deref().unwrap_or(ANY))
            .width(ui.available_width() - 16.0)
            .height(LIST + 60.0)
            .truncate()
            .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
            .show_ui(ui, |ui| {
                if ui.selectable_label(chosen.is_none(), ANY).clicked() {
                    *chosen = None;
                    narrow.clear();
                    ui.close();
                }
                if choices.len() > MANY {
                    let field =
                        TextEdit::singleline(narrow).char_limit(80).hint_text("narrow the list");
                    ui.add(field).accessible_name(format!("narrow {name}"));
                }
                let wanted = narrow.to_lowercase();
                let shown: Vec<&String> = choices
                    .iter()
                    .filter(|one| choices.len() <= MANY || one.to_lowercase().contains(&wanted))
                    .collect();
                let height = ui.spacing().interact_size.y;
                ScrollArea::vertical().id_salt(("choices", name)).max_height(LIST).show_rows(
                    ui,
                    height,
                    shown.len(),
                    |ui, rows| {
                        for one in &shown[rows] {
                            let is_chosen = chosen.as_ref() == Some(*one);
                            if ui.selectable_label(is_chosen, one.as_str()).clicked() {
                                *chosen = Some((*one).clone());
                                narrow.clear();
                                ui.close();
                            }
                        }
                    },
                );
            })
            .response
            .labelled_by(label.id)
            .named(name);
    });
    *chosen != before
}
