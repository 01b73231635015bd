//! Depth and force over time as a plan is expected to go, before anything moves.

use super::style::quiet;
use crate::theme::Tokens;
use eframe::egui::{Id, RichText, Ui, vec2};
use egui_plot::{HoverPosition, Line, Plot, PlotPoints};
use palpate_protocols::preview::OutlinePoint;

/// Longest time shown in seconds; more is shown in minutes.
const SECONDS_MAX: f64 = 600.0;

/// Draws both curves in the space there is. Steps of unknown length are drawn as long as expected.
pub fn course_ui(ui: &mut Ui, outline: &[OutlinePoint]) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let end = outline.last().map_or(1.0, |point| point.t.0);
    let (unit, axis) = if end > SECONDS_MAX {
        (60.0, "expected time (min)")
    } else {
        (1.0, "expected time (s)")
    };
    let height = (ui.available_height() - 76.0) * 0.5;
    for (title, y_axis, ink, value) in [
        (
            "Depth as planned",
            "depth from contact (mm)",
            tokens.series,
            (|point| point.depth.0) as fn(&OutlinePoint) -> f64,
        ),
        (
            "Force as expected",
            "force above tare (N)",
            tokens.limit,
            |point| point.force.0,
        ),
    ] {
        ui.label(RichText::new(title).heading().strong());
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
            let points = outline
                .iter()
                .map(|point| [point.t.0 / unit, value(point)])
                .collect::<PlotPoints<'_>>();
            quiet(Plot::new(title), tokens)
                .x_axis_label(axis)
                .y_axis_label(y_axis)
                .include_y(0.0)
                .link_axis(Id::unique("course"), [true, false])
                .label_formatter(|hover| match hover {
                    HoverPosition::NearDataPoint { position, .. } => {
                        Some(format!("{:.2}\n{:.3}", position.x, position.y))
                    }
                    HoverPosition::Elsewhere { .. } => None,
                })
                .show(ui, |plot_ui| {
                    // A plan has few points, and bands of those that share a column would be drawn as wedges.
                    plot_ui.line(
                        Line::new(title, points)
                            .allow_band(false)
                            .color(ink)
                            .width(1.6),
                    );
                });
        });
    }
    let words = "expected for the pig stomach of the source thesis, others differ by tens of percent; on a base for a rig that gives 30 µm/N";
    ui.label(RichText::new(words).color(tokens.text_quiet).small());
}
