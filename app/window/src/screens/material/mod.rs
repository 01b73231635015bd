//! From a press to a property of its material: property, indenter, specimen and law on the left, plots in the middle, the
//! numbers and all that they rest on at the right.

mod form;
mod result;

pub use result::FittedMaterial;

use super::screen::{Commands, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::widgets::{
    alarm_ui, answer_ui, placeholder_ui, quiet_ui, require, section_ui, task_ui, text_row, work_ui,
};
use crate::workers::{BackgroundTask, PathPurpose};
use eframe::egui::{Context, Key, Ui};
use form::MaterialForm;
use palpate_analysis::compliance::{ComplianceCorrections, LATEST_COMPLIANCE};
use palpate_analysis::edits::author;
use palpate_analysis::material::{MaterialError, MaterialRequest, measured_thickness};
use palpate_analysis::progress::Progress;
use palpate_analysis::property::{PropertyError, PropertyRequest, find_property};
use palpate_analysis::session_actions::Attribution;
use palpate_indentation::Quantity;
use serde_json::Value;
use std::path::PathBuf;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Material",
    icon: lucide_icons::Icon::Layers,
    purpose: "moduli of a press, with what makes them uncertain",
    key: Some(Key::M),
    open: |workbench| Box::new(MaterialScreen::new(workbench.library.clone().ok())),
};

const BEFORE: &str = "Choose a session, describe the indenter and the specimen, and fit a contact law to the press. A modulus belongs to the tissue; force and depth belong to one probe and one specimen.";

/// A property, or why the press does not show it.
type MaterialAnswer = Result<FittedMaterial, PropertyError>;

pub struct MaterialScreen {
    library: Option<PathBuf>,
    form: MaterialForm,
    task: BackgroundTask<MaterialAnswer>,
    /// The thickness that a session measured, once it is read.
    thickness: BackgroundTask<Option<Quantity>>,
    /// The session whose thickness is read or was read last.
    thickness_of: PathBuf,
    save: SaveForm,
    /// The sentence of what was saved last.
    saving: BackgroundTask<String>,
}

/// Name of the analysis as which a modulus is saved, its author and the reason.
struct SaveForm {
    name: String,
    by: String,
    reason: String,
}

impl MaterialScreen {
    fn new(library: Option<PathBuf>) -> Self {
        Self {
            library,
            form: MaterialForm::default(),
            task: BackgroundTask::default(),
            thickness: BackgroundTask::default(),
            thickness_of: PathBuf::new(),
            save: SaveForm { name: String::new(), by: author(None), reason: String::new() },
            saving: BackgroundTask::default(),
        }
    }

    /// The last modulus, unless there is none or it was refused.
    pub fn fitted(&self) -> Option<&FittedMaterial> {
        self.task.answer()?.as_ref().ok()?.as_ref().ok()
    }

    /// Why the last press has no modulus.
    pub fn refused(&self) -> Option<&PropertyError> {
        self.task.answer()?.as_ref().ok()?.as_ref().err()
    }

    /// Draws what saves the modulus with its session.
    fn save_ui(&mut self, ui: &mut Ui) {
        section_ui(ui, "Save with the session");
        text_row(ui, "name", "of the analysis, such as modulus", &mut self.save.name);
        text_row(ui, "by", "your name", &mut self.save.by);
        text_row(ui, "reason", "why, in a few words", &mut self.save.reason);
        let [name, by] = [&self.save.name, &self.save.by].map(|text| text.trim());
        let verdict = require(!name.is_empty(), "type a name for the analysis")
            .and(require(!by.is_empty(), "type your name into the field 'by'"));
        if task_ui(ui, "Save modulus", &self.saving, &verdict) {
            self.start_saving(ui.ctx());
        }
        match self.saving.answer() {
            Some(Ok(sentence)) => quiet_ui(ui, sentence),
            Some(Err(reason)) => alarm_ui(ui, reason),
            None => {}
        }
    }

    fn start_saving(&mut self, ctx: &Context) {
        let Some(to_store) = self.fitted().map(|fitted| fitted.to_store.clone()) else { return };
        let SaveForm { name, by, reason } = &self.save;
        let [name, by, reason] = [name, by, reason].map(|text| text.trim().to_owned());
        self.saving.start("material-save", ctx, move |_| {
            let stored = to_store.store(&name, &Attribution { by, reason });
            stored.map(|_| format!("saved as analysis '{name}'")).map_err(|err| err.to_string())
        });
    }

    fn refusal_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let Some(refused) = self.refused() else { return };
        alarm_ui(ui, refused.to_string());
        let PropertyError::Modulus(MaterialError::TooDeep { depth_max_mm, .. }) = *refused else {
            return;
        };
        if ui.button(format!("Fit the loading down to {depth_max_mm} mm")).clicked() {
            self.form.limit_depth(depth_max_mm);
            commands.push(UiCommand::Work);
        }
    }
}

impl Screen for MaterialScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        if self.form.ui(ui, &workbench.front) {
            commands.push(UiCommand::Choose(PathPurpose::Press));
        }
        ui.add_space(6.0);
        let verdict = self.form.request().map(|_| ());
        work_ui(ui, "Fit modulus  F6", &self.task, &verdict, commands);
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, commands: &mut Commands) {
        match answer_ui(ui, &self.task, BEFORE) {
            Some(Ok(fitted)) => result::plots_ui(ui, fitted),
            Some(Err(_)) => self.refusal_ui(ui, commands),
            None => {}
        }
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        match self.fitted() {
            Some(fitted) => {
                result::numbers_ui(ui, fitted);
                self.save_ui(ui);
            }
            None => {
                section_ui(ui, "Modulus");
                placeholder_ui(ui, "no modulus yet");
            }
        }
    }

    fn shown(&mut self, ctx: &Context) {
        let source = self.form.source();
        if self.thickness.is_busy() || source == self.thickness_of {
            return;
        }
        self.thickness_of = source.to_owned();
        let source = self.thickness_of.clone();
        self.thickness.start("material-thickness", ctx, move |_| {
            measured_thickness(&source).map_err(|err| err.to_string())
        });
    }

    fn poll(&mut self, _ctx: &Context, workbench: &mut Workbench) {
        self.task.poll();
        self.saving.poll();
        self.form.follow(workbench.front.review.as_ref().or(workbench.front.library.as_ref()));
        if self.thickness.poll() && self.form.source() == self.thickness_of {
            // What cannot be read is said by the fit.
            let measured = self.thickness.answer().and_then(|answer| answer.clone().ok()).flatten();
            self.form.take_thickness(measured);
        }
        self.form.check();
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, _workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Chosen(PathPurpose::Press, path) => self.form.take(path),
            _ => return Reaction::NotMine,
        }
        Reaction::Done
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        self.form.check();
        // What was saved of the modulus before says nothing of this one.
        self.saving = BackgroundTask::default();
        let Ok(request) = self.form.request() else { return };
        let library = self.library.clone();
        let is_corrected = self.form.is_compliance_corrected;
        self.task.start("material", ctx, move |progress| {
            progress.share(0.0, "reading the press and fitting the law");
            let library = library.as_deref();
            let corrections = match is_corrected {
                true => ComplianceCorrections::named(LATEST_COMPLIANCE, library)
                    .map_err(|err| err.to_string())?,
                false => ComplianceCorrections::none(library),
            };
            let press = MaterialRequest { corrections, ..request.press };
            let request = PropertyRequest { press, ..request };
            Ok(find_property(&request).map(|report| FittedMaterial::of(&request, report)))
        });
    }

    fn cancel(&mut self) {
        self.task.cancel();
    }

    fn is_busy(&self) -> bool {
        self.task.is_busy() || self.saving.is_busy()
    }

    fn layout(&self) -> Option<Value> {
        self.form.kept()
    }

    fn take_layout(&mut self, kept: &Value) {
        self.form = serde_json::from_value(kept.clone()).unwrap_or_default();
    }
}
