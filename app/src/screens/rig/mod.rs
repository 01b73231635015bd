//! The rig's own screen: what it reports, large, and moving it by hand.

use crate::command::Commands;
use eframe::egui::Ui;
use palpate_protocols::runner::Snapshot;

/// What is typed on the screen.
#[derive(Debug, Default)]
pub struct RigScreen {}

impl RigScreen {
    /// Draws the middle.
    pub fn middle_ui(&mut self, ui: &mut Ui, snapshot: &Snapshot, _commands: &mut Commands) {
        ui.label(&snapshot.rig.description.identity);
    }
}
