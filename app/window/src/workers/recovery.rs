//! What a crash left unfinished in the library, recovered beside the originals when the window opens.

use super::Job;
use eframe::egui::Context;
use palpate_runner::wall_now;
use palpate_sessions::recover::recover_library;
use std::path::PathBuf;

/// The work and what came of it.
#[derive(Debug, Default)]
pub struct Recovery {
    job: Job<Vec<String>>,
    told: Vec<String>,
}

impl Recovery {
    /// Looks through a library.
    pub fn start(&mut self, library: PathBuf, ctx: &Context) {
        let wake = ctx.clone();
        let work = move || recover_library(&library, env!("CARGO_PKG_VERSION"), wall_now().into());
        let started = self.job.start("recovery", work, move || wake.request_repaint());
        if let Err(err) = started {
            self.told = vec![format!(
                "interrupted sessions cannot be looked for ({err}); 'palpate doctor' does"
            )];
        }
    }

    /// Fetches the answer.
    pub fn poll(&mut self) {
        if let Some(told) = self.job.poll() {
            self.told = told;
        }
    }

    /// What was recovered and what is missing of it, a line each; empty if nothing was left unfinished.
    pub fn told(&self) -> &[String] {
        &self.told
    }
}
