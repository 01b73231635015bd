//! What can be made of a session: fits, other calibrations, stretches left out, each a named analysis beside the others.

use super::Looked;
use crate::command::Commands;
use eframe::egui::{Context, Ui};
use std::path::PathBuf;

/// The panel of analyses.
#[derive(Debug)]
pub struct AnalysesPanel {
    library: Result<PathBuf, String>,
}

impl AnalysesPanel {
    /// A panel for sessions and calibrations of the library in this folder.
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self { library }
    }

    /// Fetches what threads have answered.
    pub fn poll(&mut self, _ctx: &Context) {}

    /// Draws the analyses of a session; which of them it is read by can be chosen.
    pub fn ui(&mut self, ui: &mut Ui, looked: &mut Looked, _commands: &mut Commands) {
        ui.label(format!("{} {:?}", looked.session.display(), self.library));
    }
}
