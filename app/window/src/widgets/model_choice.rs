//! The family to be fitted, chosen from a list.

use super::places::Place;
use super::quantity_input::form_label;
use eframe::egui::{ComboBox, Ui};
use palpate_rheology::families;

/// The family that needs no key.
pub const OWN_MODEL: &str = "modified Kelvin";

/// A choice among all families.
pub struct ModelChoice {
    keys: Vec<String>,
    /// Key of the chosen one; none for the modified Kelvin body of third order.
    pub family: Option<String>,
}

impl Default for ModelChoice {
    fn default() -> Self {
        Self {
            keys: families::all().iter().map(|one| one.key()).collect(),
            family: None,
        }
    }
}

impl ModelChoice {
    /// Draws the choice under a name that no other on the screen has.
    pub fn ui(&mut self, ui: &mut Ui, name: &'static str) {
        ui.horizontal(|ui| {
            let label = form_label(ui, name);
            let chosen = self.family.as_deref().unwrap_or(OWN_MODEL);
            ComboBox::from_id_salt(name)
                .selected_text(chosen)
                .width(ui.available_width() - 16.0)
                .show_ui(ui, |ui| {
                    ui.selectable_value(&mut self.family, None, OWN_MODEL);
                    for key in &self.keys {
                        ui.selectable_value(&mut self.family, Some(key.clone()), key);
                    }
                })
                .response
                .labelled_by(label.id)
                .place(name);
        });
    }
}
