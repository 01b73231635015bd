//! Data quality of a session, and a correction of its contact point.

use crate::widgets::{
    QuantityField, choice_ui, quantity_ui, quiet_ui, reason_button, require, section_ui,
};
use eframe::egui::{Ui, vec2};
use palpate_analysis::session_actions::{SessionAction, SessionActionContext};
use palpate_model::units::Position;
use palpate_sessions::edits::DataQuality;

pub(super) struct QualityForm {
    verdict: DataQuality,
    contact: usize,
    position: QuantityField,
}

impl Default for QualityForm {
    fn default() -> Self {
        Self { verdict: DataQuality::Valid, contact: 0, position: QuantityField::new(0.0) }
    }
}

impl QualityForm {
    /// Draws the form; `verdict` says whether something can be done that needs a reason.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        known: &SessionActionContext,
        verdict: &Result<(), String>,
    ) -> Option<SessionAction> {
        section_ui(ui, "Data quality");
        let words = match &known.verdict {
            Some((verdict, by, reason)) => format!("{verdict}, by {by}: {reason}"),
            None => "no verdict yet".to_owned(),
        };
        quiet_ui(ui, words);
        let verdicts = [DataQuality::Valid, DataQuality::Suspect, DataQuality::Rejected];
        let verdicts = verdicts.map(|one| (one, one.name()));
        choice_ui(ui, "verdict", &mut self.verdict, &verdicts);
        let size = vec2(170.0, 26.0);
        if reason_button(ui, "Set verdict", size, verdict) {
            return Some(SessionAction::SetDataQuality(self.verdict));
        }
        section_ui(ui, "Contact");
        self.contact_ui(ui, known);
        let position = require(!known.contacts.is_empty(), "the session has no contact point")
            .and_then(|()| self.position.value.clone())
            .and_then(|mm| verdict.clone().map(|()| Position(mm)));
        let is_possible = position.clone().map(|_| ());
        let is_pressed = reason_button(ui, "Correct contact", size, &is_possible);
        let number = self.contact as u32 + 1;
        position
            .ok()
            .filter(|_| is_pressed)
            .map(|position| SessionAction::CorrectContact { number, position })
    }

    fn contact_ui(&mut self, ui: &mut Ui, known: &SessionActionContext) {
        if known.contacts.is_empty() {
            return;
        }
        self.contact = self.contact.min(known.contacts.len() - 1);
        if known.contacts.len() > 1 {
            let numbers = 1..=known.contacts.len();
            let names: Vec<String> = numbers.map(|number| format!("contact {number}")).collect();
            let contacts: Vec<_> = names.iter().map(String::as_str).enumerate().collect();
            choice_ui(ui, "which", &mut self.contact, &contacts);
        }
        let found = known.contacts[self.contact].0;
        quiet_ui(ui, format!("the contact point is at {found:.3} mm from home"));
        if quantity_ui(ui, "correct to", "mm from home", &mut self.position) {
            self.position.check(|_| Ok(()));
        }
    }
}
