//! The run in progress or the last one, as the screens Run and Result show it.

use crate::plots::PlotCache;
use crate::screens::form::RunSetup;
use crate::workers::fit::{Refit, Refitter, has_result};
use eframe::egui::{Context, Ui};
use palpate_model::assessment::Assessment;
use palpate_model::calibration::Calibration;
use palpate_runner::RunView;
use palpate_sessions::checks::DailyCheck;
use std::path::{Path, PathBuf};

/// Its plots, and what is found once it has ended.
pub struct LatestRun {
    plots: PlotCache,
    /// The session that the plots are of.
    plotted: Option<PathBuf>,
    refitter: Refitter,
    /// The session whose end was reported.
    reported_end: Option<PathBuf>,
    /// Specimen and protocol of the last start.
    last_start: Option<[String; 2]>,
}

impl LatestRun {
    pub fn new(calibration: &Calibration) -> Self {
        Self {
            plots: PlotCache::for_calibration(calibration),
            plotted: None,
            refitter: Refitter::default(),
            reported_end: None,
            last_start: None,
        }
    }

    /// Follows a run. `depth_mm` is the depth that the form asks for.
    pub fn update(
        &mut self,
        ctx: &Context,
        run: Option<&RunView>,
        setup: &RunSetup,
        depth_mm: f64,
        library: Option<&PathBuf>,
    ) {
        let session = run.map(|run| &run.folder);
        if self.plotted.as_ref() != session {
            self.plotted = session.cloned();
            self.plots = PlotCache::for_calibration(&setup.calibration);
        }
        self.plots.update(run, setup.limits.force_max, depth_mm);
        self.refitter.update(ctx, run, library);
        self.plots.mark(self.refitter.quality(run));
    }

    /// Whether a run that has a result has just ended: true once for each.
    pub fn take_ended(&mut self, run: Option<&RunView>) -> bool {
        let ended = run.filter(|run| run.outcome.is_some() && has_result(run));
        let Some(ended) = ended.filter(|run| self.reported_end.as_ref() != Some(&run.folder))
        else {
            return false;
        };
        self.reported_end = Some(ended.folder.clone());
        true
    }

    pub fn set_last_start(&mut self, start: [String; 2]) {
        self.last_start = Some(start);
    }

    /// Specimen and protocol of the last start.
    pub fn last_start(&self) -> Option<&[String; 2]> {
        self.last_start.as_ref()
    }

    /// What must be acknowledged after a daily check that has just been judged, once.
    pub fn take_gate(&mut self) -> Option<Vec<String>> {
        self.refitter.take_gate()
    }

    /// Whether a daily check is being judged.
    pub fn is_judging(&self) -> bool {
        self.refitter.is_judging()
    }

    /// The daily check that this run was, judged; or why it could not be kept.
    pub fn daily_check(&self, run: Option<&RunView>) -> Option<&Result<DailyCheck, String>> {
        self.refitter.daily_check(run)
    }

    /// Why the checks of this run could not be made.
    pub fn failure(&self, run: Option<&RunView>) -> Option<&str> {
        self.refitter.failure(run)
    }

    pub fn plots(&self) -> &PlotCache {
        &self.plots
    }

    pub fn plots_ui(&mut self, ui: &mut Ui, run: Option<&RunView>) {
        let exact = match self.refitter.of(run) {
            Refit::Done(exact) => Some(exact),
            _ => None,
        };
        self.plots.ui(ui, exact);
    }

    /// How far the exact fit of this run is.
    pub fn refit(&self, run: Option<&RunView>) -> Refit<'_> {
        self.refitter.of(run)
    }

    /// The checks of this run, once they are made.
    pub fn quality(&self, run: Option<&RunView>) -> Option<&Assessment> {
        self.refitter.quality(run)
    }

    /// Session of this run, once its checks are made.
    pub fn assessed(&self, run: Option<&RunView>) -> Option<&Path> {
        self.refitter.assessed(run)
    }
}
