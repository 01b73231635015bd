//! Force over time and over depth of the run that is shown, with what its exact fit found and left over.

use super::figure::{PlacedPlot, PlotLook};
use crate::widgets::{NamedControl, heading_ui, tokens_of};
use crate::workers::fit::ExactFit;
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_analysis::report::live::{LiveCycle, RunPlots, set_course};
use palpate_figures::figure::{Ink, PlotLevel};
use palpate_model::assessment::{Assessment, QualityCheck};
use palpate_model::calibration::{Calibration, ForceUncertainty};
use palpate_model::signal::LiveTrace;
use palpate_model::units::Newtons;
use palpate_runner::RunView;
use std::sync::Arc;

/// Height of what the exact fit leaves over, in points.
const RESIDUAL_HEIGHT: f32 = 96.0;

/// The plots of a run, converted when its trace changed, never per frame.
#[derive(Debug, Default)]
pub struct PlotCache {
    trace: Option<Arc<LiveTrace>>,
    force_time: PlacedPlot,
    force_depth: PlacedPlot,
    /// One for each repeat; empty where nothing is repeated.
    cycles: Vec<LiveCycle>,
    remark: Option<String>,
    /// Of the forces drawn; `None` where their calibration cannot tell.
    uncertainty: Option<ForceUncertainty>,
    /// Whether the run is shown from just before its ramp.
    is_from_ramp: bool,
}

impl PlotCache {
    /// A cache for forces read with this calibration.
    #[must_use]
    pub fn for_calibration(calibration: &Calibration) -> Self {
        let uncertainty = ForceUncertainty::of(calibration).ok();
        let mut cache = Self { uncertainty, ..Self::default() };
        cache.convert(&LiveTrace::new(1), &[]);
        cache
    }

    /// Takes over a run's history, if it changed. `depth_mm` is the depth the form or the run asks for, so the axis does
    /// not creep while the probe goes in.
    pub fn update(&mut self, run: Option<&RunView>, force_max: Newtons, depth_mm: f64) {
        if let Some(run) = run {
            self.follow(&run.trace, if run.cycles > 1 { &run.cycle_starts } else { &[] });
        }
        set_course(&mut self.force_time.plot, run, force_max, self.is_from_ramp);
        self.force_depth.plot.x.visible_values = vec![0.0, depth_mm];
        self.force_depth.plot.y.visible_values = vec![0.0, 0.5];
    }

    /// Marks where somebody should look.
    pub fn mark(&mut self, quality: Option<&Assessment>) {
        let doubts = quality.map(Assessment::doubts).unwrap_or_default();
        let place = |check: &QualityCheck| {
            let [at, _] = check.at_s?;
            Some(PlotLevel { name: check.name.to_owned(), at, ink: Ink::Limit, is_dashed: true })
        };
        self.force_time.plot.x_levels = doubts.into_iter().filter_map(place).collect();
    }

    fn follow(&mut self, trace: &Arc<LiveTrace>, starts: &[(f64, u32)]) {
        if !self.trace.as_ref().is_some_and(|old| Arc::ptr_eq(old, trace)) {
            self.convert(trace, starts);
            self.trace = Some(Arc::clone(trace));
        }
    }

    fn convert(&mut self, trace: &LiveTrace, starts: &[(f64, u32)]) {
        let plots = RunPlots::of(trace, starts, self.uncertainty.as_ref());
        (self.force_time, self.force_depth) = (plots.force_time.into(), plots.force_depth.into());
        (self.cycles, self.remark) = (plots.cycles, plots.remark);
    }

    /// The repeats so far, oldest first; empty where nothing is repeated.
    #[must_use]
    pub fn cycles(&self) -> &[LiveCycle] {
        &self.cycles
    }

    /// Draws both in the space there is, the exact fit over the measured force once there is one.
    pub fn ui(&mut self, ui: &mut Ui, exact: Option<&ExactFit>) {
        let tokens = tokens_of(ui);
        ui.horizontal(|ui| {
            ui.label(RichText::new(&self.force_time.plot.title).heading().strong());
            for (view, name) in [(false, "Whole run"), (true, "From ramp")] {
                ui.selectable_value(&mut self.is_from_ramp, view, name).named(name);
            }
            if let Some(remark) = &self.remark {
                let words = RichText::new(remark).color(tokens.text_quiet).small();
                ui.add(Label::new(words).truncate());
            }
        });
        // The chart over time carries the limits and phases, so it gets the larger half.
        let height = (ui.available_height() - 30.0) * 0.56;
        // A low window keeps the force; Review shows residuals too.
        let exact_below = exact.filter(|_| height > 2.0 * RESIDUAL_HEIGHT);
        let below = if exact_below.is_some() { RESIDUAL_HEIGHT } else { 0.0 };
        let shown = ui.allocate_ui(vec2(ui.available_width(), height - below), |ui| {
            let (shown, over) = (self.force_time.plot.x.range, exact.map(|exact| &exact.fitted));
            let look = PlotLook { shown, over, ..PlotLook::default() };
            self.force_time.ui(ui, "force_time", look)
        });
        if let Some(exact) = exact_below {
            ui.allocate_ui(vec2(ui.available_width(), below), |ui| {
                // Low as it is, it has room for three numbers.
                let steps = [None, Some(4.0)];
                let shown = Some(shown.inner);
                let look = PlotLook { steps, shown, ..PlotLook::default() };
                exact.residual.ui(ui, "residual", look);
            });
        }
        heading_ui(ui, &self.force_depth.plot.title);
        self.force_depth.ui(ui, "force_depth", PlotLook::default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Seconds};

    fn trace(count: u32) -> Arc<LiveTrace> {
        let mut trace = LiveTrace::new(100);
        for i in 0..count {
            let value = f64::from(i);
            trace.push(Seconds(value), Depth(value), Newtons(value));
        }
        Arc::new(trace)
    }

    #[test]
    fn trace_is_converted_once_and_again_when_another_one_comes() {
        let mut cache = PlotCache::default();
        let first = trace(10);
        cache.follow(&first, &[]);
        // The conversion of a trace that is seen again would bring its points back.
        cache.force_time = PlacedPlot::default();
        cache.follow(&first, &[]);
        assert!(cache.force_time.plot.series.is_empty());
        cache.follow(&trace(20), &[]);
        assert_eq!(cache.force_time.plot.series[0].points.len(), 20);
    }
}
