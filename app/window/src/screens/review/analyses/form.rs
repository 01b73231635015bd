//! The analysis to be made, as typed.

use crate::widgets::{
    ModelChoice, NamedControl, QuantityField, choice_ui, quantity_ui, reason_button, require,
    text_row, tick_box,
};
use eframe::egui::{Ui, vec2};
use palpate_analysis::report::dossier::SessionReading;
use palpate_analysis::session_actions::{SessionAction, SessionActionContext, SessionFitRequest};
use std::path::PathBuf;

/// The kind of analysis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Kind {
    #[default]
    Fit,
    Recalibration,
    Mask,
}

impl Kind {
    const ALL: [(Self, &'static str); 3] =
        [(Self::Fit, "Fit"), (Self::Recalibration, "Other calibration"), (Self::Mask, "Leave out")];
}

#[derive(Default)]
pub(super) struct AnalysisForm {
    kind: Kind,
    name: String,
    model: ModelChoice,
    with_unload: bool,
    with_profile: bool,
    is_together: bool,
    /// Identifier of a calibration of the library.
    calibration: Option<String>,
    file: String,
    /// Where the cursors stand in s, once both are set.
    pub cursors: Option<[f64; 2]>,
    span: [QuantityField; 2],
}

impl AnalysisForm {
    pub fn is_rejected_included(&self) -> bool {
        self.model.is_rejected_included
    }

    /// A name is used once.
    pub fn forget(&mut self) {
        self.name.clear();
    }

    pub fn propose_span(&mut self, from: f64, until: f64) {
        self.kind = Kind::Mask;
        // A millisecond is what rigs sample.
        let field = |at: f64| QuantityField::new((at * 1e3).round() / 1e3);
        self.span = [from.min(until), from.max(until)].map(field);
    }

    /// Draws the form. Returns the analysis to make, or why there is none. `others` are the other sessions shown.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        known: &SessionActionContext,
        read_by: Option<&str>,
        others: &[SessionReading],
    ) -> Result<SessionAction, String> {
        ui.horizontal(|ui| {
            for (kind, words) in Kind::ALL {
                ui.selectable_value(&mut self.kind, kind, words).named(words);
            }
        });
        text_row(ui, "name", "of the new analysis", &mut self.name);
        match self.kind {
            Kind::Fit => self.fit_ui(ui, others.len()),
            Kind::Recalibration => self.calibration_ui(ui, known),
            Kind::Mask => {
                let verdict =
                    require(self.cursors.is_some(), "set the cursors A and B on the plot");
                if reason_button(ui, "Between the cursors", vec2(170.0, 26.0), &verdict)
                    && let Some([a, b]) = self.cursors
                {
                    self.propose_span(a, b);
                }
                for (name, field) in ["from", "to"].into_iter().zip(&mut self.span) {
                    if quantity_ui(ui, name, "s since the first sample", field) {
                        field.check(|_| Ok(()));
                    }
                }
            }
        }
        self.action(known, read_by, others)
    }

    fn fit_ui(&mut self, ui: &mut Ui, others: usize) {
        self.model.ui(ui, "model", "fit a rejected session too");
        if self.model.family.is_some() {
            tick_box(ui, &mut self.with_unload, "unloading too, where recorded");
        }
        tick_box(ui, &mut self.with_profile, "profile intervals too");
        if others > 0 {
            let words = match others {
                1 => "fit this session and the other session shown as one material".to_owned(),
                _ => format!(
                    "fit this session and the {others} other sessions shown as one material"
                ),
            };
            tick_box(ui, &mut self.is_together, &words);
        }
    }

    fn calibration_ui(&mut self, ui: &mut Ui, known: &SessionActionContext) {
        let none = if known.calibrations.is_empty() { "no calibration there" } else { "none" };
        let all = known.calibrations.iter().map(|(id, _)| (Some(id.clone()), id.as_str()));
        let all: Vec<_> = std::iter::once((None, none)).chain(all).collect();
        choice_ui(ui, "from library", &mut self.calibration, &all);
        text_row(ui, "or file", "a calibration's document", &mut self.file);
    }

    fn action(
        &self,
        known: &SessionActionContext,
        read_by: Option<&str>,
        others: &[SessionReading],
    ) -> Result<SessionAction, String> {
        let name = self.name.trim().to_owned();
        require(!name.is_empty(), "give the new analysis a name")?;
        let is_used = known.analyses.all.iter().any(|one| one.name == name);
        let taken = format!(
            "the session already has an analysis '{name}', and a name is never used twice; type another"
        );
        require(!is_used, taken)?;
        match self.kind {
            Kind::Fit => Ok(SessionAction::Fit {
                name,
                how: SessionFitRequest {
                    family: self.model.family.clone(),
                    with_unload: self.with_unload && self.model.family.is_some(),
                    is_rejected_included: self.model.is_rejected_included,
                    with_profile: self.with_profile,
                    based_on: read_by.map(str::to_owned),
                    together_with: if self.is_together { others.to_vec() } else { Vec::new() },
                },
            }),
            Kind::Recalibration => self.recalibration(known, name),
            Kind::Mask => {
                let [from, until] = self.span.each_ref().map(|field| field.value.clone());
                let (from, until) = (from?, until?);
                require(from < until, "type a start time and a later end time")?;
                Ok(SessionAction::Mask { name, left_out_s: vec![[from, until]] })
            }
        }
    }

    fn recalibration(
        &self,
        known: &SessionActionContext,
        name: String,
    ) -> Result<SessionAction, String> {
        let file = self.file.trim();
        let chosen = self.calibration.as_ref().and_then(|id| {
            let found = known.calibrations.iter().find(|(own, _)| own == id);
            found.map(|(_, calibration)| calibration.clone())
        });
        match (chosen, file) {
            (Some(calibration), "") => {
                Ok(SessionAction::Recalibrate { name, calibration: Box::new(calibration) })
            }
            (Some(_), _) => Err("choose a calibration or type a file, not both".to_owned()),
            (None, "") => Err("choose a calibration, or type its file".to_owned()),
            (None, file) => Ok(SessionAction::RecalibrateFrom { name, file: PathBuf::from(file) }),
        }
    }
}
