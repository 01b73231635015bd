//! Sessions of a study, and what is asked of their population.

use crate::widgets::{choice_ui, quiet_ui, require, section_ui, text_row, tick_box};
use eframe::egui::{Button, Ui};
use palpate_analysis::compliance::{ComplianceCorrections, LATEST_COMPLIANCE};
use palpate_analysis::fit::FitRecipe;
use palpate_analysis::population::{PopulationMethod, study_recipe};
use palpate_rheology::families::all_families;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The form as typed.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(default)]
pub(super) struct GroupsForm {
    source: String,
    family: String,
    parameters: String,
    levels: String,
    effects: String,
    is_two_stage: bool,
    is_influence_wanted: bool,
    is_compliance_corrected: bool,
}

impl Default for GroupsForm {
    fn default() -> Self {
        Self {
            source: String::new(),
            family: "series-1".into(),
            parameters: String::new(),
            levels: String::new(),
            effects: String::new(),
            is_two_stage: false,
            is_influence_wanted: true,
            is_compliance_corrected: false,
        }
    }
}

/// What is to be found, without a borrow.
pub(super) struct GroupsRequest {
    pub paths: Vec<PathBuf>,
    pub recipe: FitRecipe,
    pub parameters: Vec<String>,
    pub levels: Vec<String>,
    pub effects: Vec<String>,
    pub method: PopulationMethod,
    pub is_influence_wanted: bool,
}

/// Names between commas.
fn names(text: &str) -> Vec<String> {
    text.split(',').map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

impl GroupsForm {
    pub fn take(&mut self, folder: &Path) {
        self.source = folder.display().to_string();
    }

    /// What is to be found, or what is missing. Reads the library for the compliance only where depths are corrected.
    pub fn request(&self, library: Option<&Path>) -> Result<GroupsRequest, String> {
        require(!self.source.trim().is_empty(), "choose a folder of sessions first")?;
        let corrections = match self.is_compliance_corrected {
            true => ComplianceCorrections::named(LATEST_COMPLIANCE, library)
                .map_err(|err| err.to_string())?,
            false => ComplianceCorrections::none(library),
        };
        let recipe = study_recipe(Some(self.family.clone()), corrections);
        let recipe = recipe.map_err(|err| err.to_string())?;
        Ok(GroupsRequest {
            paths: vec![PathBuf::from(self.source.trim())],
            recipe,
            parameters: names(&self.parameters),
            levels: names(&self.levels),
            effects: names(&self.effects),
            method: match self.is_two_stage {
                true => PopulationMethod::TwoStage,
                false => PopulationMethod::Curves,
            },
            is_influence_wanted: self.is_influence_wanted,
        })
    }

    /// Whether the form is filled in.
    pub fn verdict(&self) -> Result<(), String> {
        require(!self.source.trim().is_empty(), "choose a folder of sessions first")
    }

    /// Draws the fields; true when the button of the folder dialog is pressed.
    pub fn ui(&mut self, ui: &mut Ui, sessions: Option<&Path>) -> bool {
        section_ui(ui, "Study");
        text_row(ui, "sessions", "a folder of sessions, or a lake", &mut self.source);
        let mut is_dialog_pressed = false;
        ui.horizontal_wrapped(|ui| {
            let button = ui.add_enabled(sessions.is_some(), Button::new("All in the library"));
            if let (true, Some(sessions)) = (button.clicked(), sessions) {
                self.take(sessions);
            }
            is_dialog_pressed = ui.button("Choose a folder...").clicked();
        });
        section_ui(ui, "Model");
        let keys: Vec<String> = all_families().iter().map(|family| family.key()).collect();
        let families: Vec<(String, &str)> =
            keys.iter().map(|key| (key.clone(), key.as_str())).collect();
        choice_ui(ui, "family", &mut self.family, &families);
        text_row(ui, "parameters", "all, or as in mu1, tau_eps", &mut self.parameters);
        section_ui(ui, "Population");
        text_row(ui, "effects", "as in animal.treatment", &mut self.effects);
        text_row(ui, "levels", "all that can be separated", &mut self.levels);
        quiet_ui(ui, "an effect may move the median; levels are animal, specimen and site");
        tick_box(ui, &mut self.is_two_stage, "best values of the sessions instead of their curves");
        tick_box(ui, &mut self.is_influence_wanted, "leave each group out in turn");
        tick_box(ui, &mut self.is_compliance_corrected, "correct depths for machine compliance");
        is_dialog_pressed
    }
}
