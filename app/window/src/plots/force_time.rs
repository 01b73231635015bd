//! Force over session time: phases shaded, the interlock's limit drawn.

use super::points::{PlotCache, phase_spans};
use super::style::{band_of, quiet};
use crate::theme::Tokens;
use crate::widgets::places::Place;
use crate::workers::fit::ExactFit;
use eframe::egui::{Align2, Color32, RichText, Ui, Vec2b};
use egui_plot::{HLine, Line, LineStyle, Plot, PlotPoint, PlotPoints, Span, Text};
use palpate_model::rig::Phase;
use palpate_model::units::Newtons;
use palpate_runner::RunView;
use std::ops::RangeInclusive;

/// How much of the run is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimeView {
    /// From the start.
    #[default]
    Whole,
    /// From two seconds before the ramp, once it began.
    FromRamp,
}

/// Draws the head of the plot: its name, how much of the run is shown, what a reader must know.
pub fn head_ui(ui: &mut Ui, view: &mut TimeView, cache: &PlotCache) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Force over time").heading().strong());
        ui.selectable_value(view, TimeView::Whole, "Whole run").place("Whole run");
        ui.selectable_value(view, TimeView::FromRamp, "From ramp").place("From ramp");
        if let Some(remark) = cache.remark() {
            ui.label(RichText::new(remark).color(tokens.text_quiet).small());
        }
    });
}

/// Seconds shown before the ramp.
const LEAD_S: f64 = 2.0;

/// Draws the plot in the space there is, the exact fit over the measured force once there is one.
/// Returns the session times shown.
pub fn force_time_ui(
    ui: &mut Ui,
    run: Option<&RunView>,
    cache: &PlotCache,
    exact: Option<&ExactFit>,
    view: TimeView,
    force_max: Newtons,
) -> RangeInclusive<f64> {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let from = run.filter(|_| view == TimeView::FromRamp).and_then(ramp_start);
    let now = run.map_or(60.0, |run| run.now.seconds().0.max(1.0));
    let plot = quiet(ui, Plot::new("force_time"), tokens)
        .x_axis_label("session time (s)")
        .y_axis_label("force above tare (N)")
        .include_y(-0.5)
        // Room above the limit for the names of the phases.
        .include_y(1.12 * force_max.0)
        .include_x(now)
        .auto_bounds(Vec2b::new(from.is_none(), true));
    let response = plot.show(ui, |plot_ui| {
        if let Some(start) = from {
            plot_ui.set_plot_bounds_x(start - LEAD_S..=now.max(start + 1.0));
        }
        if let Some(run) = run {
            for (i, span) in phase_spans(run).enumerate() {
                let fill = if i % 2 == 0 { Color32::TRANSPARENT } else { tokens.phase_band };
                plot_ui.span(
                    Span::new(span.phase.name(), span.start..=span.end)
                        .fill(fill)
                        .border_color(tokens.line),
                );
            }
        }
        // At the left edge as it will be: the text's own place counts in the automatic bounds.
        let left = from.map_or(0.0, |start| start - LEAD_S);
        plot_ui.text(
            Text::new(
                "limit",
                PlotPoint::new(left, force_max.0),
                format!(" interlock at {force_max:.1}"),
            )
            .anchor(Align2::LEFT_TOP)
            .color(tokens.text_quiet)
            .allow_hover(false),
        );
        plot_ui.hline(
            HLine::new("interlock", force_max.0)
                .color(tokens.limit)
                .width(1.5)
                .style(LineStyle::dashed_dense())
                .allow_hover(false),
        );
        for band in cache.force_time.bands("calibration") {
            plot_ui.add(band.fill_color(band_of(tokens)));
        }
        for line in cache.force_time.lines("force") {
            plot_ui.line(line.color(tokens.series));
        }
        if let Some(exact) = exact {
            // Dashed, so that the measured force shows through where both agree.
            plot_ui.line(
                Line::new("fitted", PlotPoints::Borrowed(&exact.curve))
                    .color(tokens.limit)
                    .width(2.0)
                    .style(LineStyle::dashed_loose()),
            );
        }
    });
    let bounds = response.transform.bounds();
    bounds.min()[0]..=bounds.max()[0]
}

/// Session time at which the ramp began.
fn ramp_start(run: &RunView) -> Option<f64> {
    run.phases.iter().find(|(_, phase)| *phase == Phase::Ramp).map(|(start, _)| *start)
}
