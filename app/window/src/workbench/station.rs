//! The station of the window's rig: with what it may start runs, and when.

use super::Workbench;
use crate::shell::activity::Intent;
use crate::widgets::require;
use crate::workers::station::{StationCommand, remote_bench};
use eframe::egui::Context;
use palpate_station::remote::RemoteBench;

impl Workbench {
    pub(super) fn act_on_station(&mut self, ctx: &Context, command: &StationCommand) {
        match self.remote_bench() {
            Some(bench) => self.station.act(ctx, command, (&self.runner, bench)),
            None => {
                self.station.refusal =
                    Some("there is no library, so there are no tokens; set PALPATE_HOME".into());
            }
        }
    }

    /// Whether a run over the network may begin now, or why not.
    pub(super) fn station_verdict(&self) -> Result<(), String> {
        require(self.intent() == Intent::None && !self.has_next_run(), "the window starts a run")?;
        match self.occupation.running.first() {
            Some((_, words)) => Err((*words).to_owned()),
            None => require(!self.latest_run.is_judging(), "the daily check is being judged"),
        }
    }

    /// What runs over the network are made with; none without a library.
    fn remote_bench(&self) -> Option<RemoteBench> {
        let library = self.library.as_ref().ok()?.clone();
        Some(remote_bench(&self.bench, self.is_simulated, library))
    }
}
