//! Stability margin and limit cycle before play, or the loop while it runs.

use super::{HapticsCheck, HapticsScreen};
use crate::plots::figure::{PlotLook, legend_ui, plot_ui, strip_ui};
use crate::plots::margin::{MarginPicture, margin_ui};
use crate::widgets::{NamedControl, answer_ui, heading_ui, placeholder_ui};
use crate::workers::haptic_loop::HapticLoop;
use crate::workers::trail::PAST_S;
use eframe::egui::{Ui, vec2};
use palpate_analysis::haptics::SimulatedTrial;
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotSeries};
use palpate_runner::haptics::TrailPoint;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum View {
    #[default]
    Margin,
    Live,
}

/// Room for a heading, its legend and the spaces between.
const HEAD: f32 = 52.0;

impl HapticsScreen {
    pub fn draw_middle(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            for (view, name) in [(View::Margin, "Before play"), (View::Live, "Live")] {
                ui.selectable_value(&mut self.view, view, name).named(name);
            }
        });
        match (self.view, &self.live_loop) {
            (View::Live, Some(live_loop)) => live_ui(ui, live_loop),
            (View::Live, None) => placeholder_ui(ui, "the loop has not run yet"),
            (View::Margin, live_loop) => {
                if let Some(check) = answer_ui(ui, &self.task, "nothing checked yet") {
                    before_ui(
                        ui,
                        check,
                        live_loop.as_ref().filter(|live_loop| live_loop.is_running()),
                    );
                }
            }
        }
    }
}

fn before_ui(ui: &mut Ui, check: &HapticsCheck, running: Option<&HapticLoop>) {
    let checked = &check.checked;
    let height = (ui.available_height() - 2.0 * HEAD) / 2.0;
    heading_ui(ui, "Damping needed over depth");
    ui.allocate_ui(vec2(ui.available_width(), height + HEAD * 0.5), |ui| {
        let picture = MarginPicture {
            curve: &checked.curve,
            has: 1e3 * checked.margin.worst.has,
            cycles: &checked.margin.cycles,
            now: running.map(|live_loop| live_loop.last().snapshot.depth.0),
        };
        margin_ui(ui, &picture);
    });
    heading_ui(ui, "Limit cycle of the simulated device");
    // The same heights in both, so that they compare.
    let places = checked.trials.iter().flat_map(|tried| &tried.trace);
    let ends = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
        [low.min(point[1]), high.max(point[1])]
    });
    ui.columns_const(|columns: &mut [Ui; 2]| {
        for (ui, tried) in columns.iter_mut().zip(&checked.trials) {
            tried_ui(ui, tried, ends);
        }
    });
}

fn tried_ui(ui: &mut Ui, tried: &SimulatedTrial, ends: [f64; 2]) {
    let (id, words, ink) = match tried.is_guarded {
        false => ("unguarded", "without guards", Ink::Limit),
        true => ("guarded", "with guards", Ink::Series),
    };
    let buzz = match tried.buzz_until_s {
        Some(until) => format!("{words}: limit cycle until {until:.2} s"),
        None => format!("{words}: no limit cycle"),
    };
    let from = tried.trace.first().map_or(0.0, |point| point[0]);
    let to = tried.trace.last().map_or(1.0, |point| point[0]);
    let time = PlotAxis::linear("time since the hand made contact (s)");
    let plot = Plot::new("", time, PlotAxis::linear("position (mm)").with_visible_values(&ends))
        .with([PlotSeries::line(&buzz, ink, 1.4, tried.trace.clone())]);
    legend_ui(ui, &[&plot]);
    plot_ui(ui, id, &plot, PlotLook { shown: Some([from, to]), ..PlotLook::default() });
}

fn live_ui(ui: &mut Ui, live_loop: &HapticLoop) {
    let end = live_loop.last().t.0.max(PAST_S);
    let curve = |name, ink: Ink, of: fn(&TrailPoint) -> f64| {
        PlotSeries::line(
            name,
            ink,
            1.4,
            live_loop.trail().map(|point| [point.t, of(point)]).collect(),
        )
    };
    let model = curve("force of the model", Ink::Quiet, |point| point.model);
    let force = curve("force commanded", Ink::Series, |point| point.force);
    let torque = curve("torque commanded", Ink::Limit, |point| point.torque);
    let depth = curve("depth of the slave", Ink::Series, |point| point.depth);
    let height = (ui.available_height() - 3.0 * 0.7 * HEAD) / 3.0;
    let strips = [
        ("", "force (N)", vec![model, force]),
        ("", "torque (N mm)", vec![torque]),
        ("time (s)", "depth (mm)", vec![depth]),
    ];
    for (x, y, curves) in strips {
        strip_ui(ui, [x, y], curves, [end - PAST_S, end], height);
    }
}
