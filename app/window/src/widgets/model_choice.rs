//! The family to be fitted, chosen from a list.

use super::choice::choice_ui;
use eframe::egui::Ui;
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
        Self { keys: families::all().iter().map(|one| one.key()).collect(), family: None }
    }
}

impl ModelChoice {
    /// Draws the choice under a name that no other on the screen has.
    pub fn ui(&mut self, ui: &mut Ui, name: &'static str) {
        let keys = self.keys.iter();
        let keys = keys.map(|key| (Some(key.clone()), key.as_str()));
        let all: Vec<_> = std::iter::once((None, OWN_MODEL)).chain(keys).collect();
        choice_ui(ui, name, &mut self.family, &all);
    }
}
