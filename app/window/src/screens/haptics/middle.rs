//! The margin and the buzz, or the loop as it runs.

use super::{HapticsCheck, HapticsScreen};
use crate::plots::figure::{PlotLook, legend_ui, plot_ui, strip_ui};
use crate::plots::margin::{MarginPicture, margin_ui};
use crate::theme::Tokens;
use crate::widgets::places::NamedControl;
use crate::widgets::remark::alarm_ui;
use crate::workers::haptic_loop::HapticLoop;
use crate::workers::trail::PAST_S;
use eframe::egui::{RichText, Ui, vec2};
use palpate_analysis::haptics::Tried;
use palpate_figures::figure::{Axis, Ink, Plot, Series};
use palpate_runner::haptics::TrailPoint;

/// What the middle shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum View {
    /// What was found before play.
    #[default]
    Margin,
    /// The loop.
    Live,
}

/// Room for a heading, its legend and the spaces between.
const HEAD: f32 = 52.0;

impl HapticsScreen {
    /// The plots.
    pub fn draw_middle(&mut self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        ui.horizontal(|ui| {
            for (view, name) in [(View::Margin, "Before play"), (View::Live, "Live")] {
                ui.selectable_value(&mut self.view, view, name).named(name);
            }
        });
        let quiet = |ui: &mut Ui, words: &str| {
            ui.label(RichText::new(words).color(tokens.text_quiet));
        };
        match (self.view, self.task.answer(), &self.feel) {
            (View::Live, _, Some(feel)) => live_ui(ui, feel),
            (View::Live, _, None) => quiet(ui, "the loop has not run yet"),
            (View::Margin, Some(Ok(looked)), feel) => {
                let running = feel.as_ref().filter(|feel| feel.is_running());
                before_ui(ui, looked, running);
            }
            (View::Margin, Some(Err(reason)), _) => {
                alarm_ui(ui, reason);
            }
            (View::Margin, None, _) => quiet(ui, "nothing checked yet"),
        }
    }
}

fn before_ui(ui: &mut Ui, looked: &HapticsCheck, running: Option<&HapticLoop>) {
    let checked = &looked.checked;
    let height = (ui.available_height() - 2.0 * HEAD) / 2.0;
    ui.label(RichText::new("Damping needed over depth").heading().strong());
    ui.allocate_ui(vec2(ui.available_width(), height + HEAD * 0.5), |ui| {
        let picture = MarginPicture {
            curve: &checked.curve,
            has: 1e3 * checked.margin.worst.has,
            cycles: &checked.margin.cycles,
            now: running.map(|feel| feel.last().snapshot.depth.0),
        };
        margin_ui(ui, &picture);
    });
    ui.label(RichText::new("Show the buzz: the device simulated").heading().strong());
    // The same heights in both, so that they compare.
    let places = checked.tried.iter().flat_map(|tried| &tried.trace);
    let ends = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
        [low.min(point[1]), high.max(point[1])]
    });
    ui.columns_const(|columns: &mut [Ui; 2]| {
        for (ui, tried) in columns.iter_mut().zip(&checked.tried) {
            tried_ui(ui, tried, ends);
        }
    });
}

fn tried_ui(ui: &mut Ui, tried: &Tried, ends: [f64; 2]) {
    let (id, words, ink) = match tried.is_guarded {
        false => ("unguarded", "without guards", Ink::Limit),
        true => ("guarded", "with guards", Ink::Series),
    };
    let buzz = match tried.buzz_until_s {
        Some(until) => format!("{words}: buzzes, last at {until:.2} s"),
        None => format!("{words}: no buzz"),
    };
    let from = tried.trace.first().map_or(0.0, |point| point[0]);
    let to = tried.trace.last().map_or(1.0, |point| point[0]);
    let time = Axis::linear("time from when the hand arrives (s)");
    let plot = Plot::new("", time, Axis::linear("place (mm)").seeing(&ends)).with([Series::line(
        &buzz,
        ink,
        1.4,
        tried.trace.clone(),
    )]);
    legend_ui(ui, &[&plot]);
    plot_ui(ui, id, &plot, PlotLook { shown: Some([from, to]), ..PlotLook::default() });
}

fn live_ui(ui: &mut Ui, feel: &HapticLoop) {
    let end = feel.last().t.0.max(PAST_S);
    let curve = |name, ink: Ink, of: fn(&TrailPoint) -> f64| {
        Series::line(name, ink, 1.4, feel.trail().map(|point| [point.t, of(point)]).collect())
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
