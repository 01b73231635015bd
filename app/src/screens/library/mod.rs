//! The library's screen: sessions found by what is known of them.

use crate::command::Commands;
use eframe::egui::{Context, Ui};
use std::path::PathBuf;

/// The search and what it found.
#[derive(Debug)]
pub struct LibraryScreen {
    library: Result<PathBuf, String>,
}

impl LibraryScreen {
    /// A screen for the library in this folder.
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self { library }
    }

    /// Called in every frame in which the screen is shown.
    pub fn shown(&mut self, _ctx: &Context) {}

    /// Fetches what threads have answered.
    pub fn poll(&mut self, _ctx: &Context) {}

    /// Draws what is searched for.
    pub fn left_ui(&mut self, ui: &mut Ui, _commands: &mut Commands) {
        ui.label(format!("{:?}", self.library));
    }

    /// Draws what was found.
    pub fn middle_ui(&mut self, _ui: &mut Ui, _commands: &mut Commands) {}

    /// Draws what is known of the session chosen.
    pub fn right_ui(&mut self, _ui: &mut Ui, _commands: &mut Commands) {}
}
