//! What a session is worth, and where its contact really was.

use crate::widgets::choice::choice_ui;
use crate::widgets::fact_row::section_ui;
use crate::widgets::quantity_input::{QuantityField, quantity_ui};
use crate::widgets::reason_button::reason_button;
use crate::widgets::remark::quiet_ui;
use eframe::egui::{Ui, vec2};
use palpate_analysis::analyses::{Deed, Known};
use palpate_model::units::Position;
use palpate_sessions::edits::Verdict;

/// The form.
pub(super) struct QualityForm {
    verdict: Verdict,
    contact: usize,
    position: QuantityField,
}

impl Default for QualityForm {
    fn default() -> Self {
        Self { verdict: Verdict::Valid, contact: 0, position: QuantityField::new(0.0) }
    }
}

impl QualityForm {
    /// Draws the form; `verdict` says whether something can be done that needs a reason.
    pub fn ui(&mut self, ui: &mut Ui, known: &Known, verdict: &Result<(), String>) -> Option<Deed> {
        section_ui(ui, "What it is worth");
        let words = match &known.verdict {
            Some((verdict, by, reason)) => format!("{verdict}, says {by}: {reason}"),
            None => "nobody gave a verdict".to_owned(),
        };
        quiet_ui(ui, &words);
        let verdicts = [Verdict::Valid, Verdict::Suspect, Verdict::Rejected];
        let verdicts = verdicts.map(|one| (one, one.name()));
        choice_ui(ui, "verdict", &mut self.verdict, &verdicts);
        let size = vec2(170.0, 26.0);
        if reason_button(ui, "Give verdict", size, verdict) {
            return Some(Deed::Judge(self.verdict));
        }
        section_ui(ui, "Contact");
        self.contact_ui(ui, known);
        let own = match known.contacts.is_empty() {
            true => Err("the session found no contact".to_owned()),
            false => self.position.value.clone().and(verdict.clone()),
        };
        let is_pressed = reason_button(ui, "Correct contact", size, &own);
        let position = self.position.value.clone().ok();
        position
            .filter(|_| is_pressed)
            .map(|mm| Deed::Correct { number: self.contact as u32 + 1, position: Position(mm) })
    }

    fn contact_ui(&mut self, ui: &mut Ui, known: &Known) {
        if known.contacts.is_empty() {
            return;
        }
        self.contact = self.contact.min(known.contacts.len() - 1);
        if known.contacts.len() > 1 {
            let names = (1..=known.contacts.len()).map(|number| format!("contact {number}"));
            let names: Vec<String> = names.collect();
            let contacts = names.iter().map(String::as_str).enumerate();
            let contacts: Vec<(usize, &str)> = contacts.collect();
            choice_ui(ui, "which", &mut self.contact, &contacts);
        }
        let found = known.contacts[self.contact].0;
        quiet_ui(ui, &format!("it stands at {found:.3} mm from home"));
        if quantity_ui(ui, "really at", "mm from home", &mut self.position) {
            self.position.check(|_| Ok(()));
        }
    }
}
