//! The family to be fitted, chosen from a list, and whether rejected sessions are.

use super::choice::choice_ui;
use super::tick_box::tick_box;
use eframe::egui::Ui;
use palpate_rheology::families;

/// The family that needs no key.
pub const OWN_MODEL: &str = "modified Kelvin";

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
        let keys = families::all().iter().map(|one| one.key()).collect();
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
