//! The review screen: one session closely, several beside each other.

pub mod analyses;

use crate::command::Commands;
use analyses::AnalysesPanel;
use eframe::egui::{Context, Ui};
use std::path::PathBuf;

/// A session as it is looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Looked {
    /// Its folder.
    pub session: PathBuf,
    /// The analysis that it is read by; none for the session as it was measured.
    pub analysis: Option<String>,
}

/// The sessions and how they are looked at.
#[derive(Debug)]
pub struct ReviewScreen {
    sessions: Vec<Looked>,
    analyses: AnalysesPanel,
}

impl ReviewScreen {
    /// A screen without a session.
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            sessions: Vec::new(),
            analyses: AnalysesPanel::new(library),
        }
    }

    /// Shows these sessions instead of those there.
    pub fn open(&mut self, sessions: Vec<PathBuf>, _ctx: &Context) {
        let looked = |session| Looked {
            session,
            analysis: None,
        };
        self.sessions = sessions.into_iter().map(looked).collect();
    }

    /// Fetches what threads have answered.
    pub fn poll(&mut self, ctx: &Context) {
        self.analyses.poll(ctx);
    }

    /// Draws the sessions and how they are laid over each other.
    pub fn left_ui(&mut self, _ui: &mut Ui, _commands: &mut Commands) {}

    /// Draws the plots.
    pub fn middle_ui(&mut self, _ui: &mut Ui, _commands: &mut Commands) {}

    /// Draws what is known of the session in front, and what can be made of it.
    pub fn right_ui(&mut self, ui: &mut Ui, commands: &mut Commands) {
        self.analyses.set_shown(&self.sessions);
        if let Some(front) = self.sessions.first_mut() {
            self.analyses.ui(ui, front, commands);
        }
    }
}
