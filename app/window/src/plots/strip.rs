//! A few curves over one axis, with their names in words above: what a loop did over time, live or simulated.

use super::style::quiet;
use crate::theme::Tokens;
use eframe::egui::{Color32, RichText, Sense, Ui, vec2};
use egui_plot::{Line, Plot, PlotPoints};
use std::ops::RangeInclusive;

/// A curve.
pub struct Curve {
    /// What it is.
    pub name: &'static str,
    /// Its colour.
    pub ink: Color32,
    /// Its points, in order along x.
    pub points: Vec<[f64; 2]>,
}

/// One plot.
pub struct Strip {
    /// Its name.
    pub id: &'static str,
    /// Names of both axes with their units; no name along x where another strip stands below.
    pub axes: [&'static str; 2],
    /// What is seen along x.
    pub shown: RangeInclusive<f64>,
    /// What is seen along y in any case.
    pub least: RangeInclusive<f64>,
    /// Its curves, the one in front last.
    pub curves: Vec<Curve>,
}

/// A patch of colour and the words that it stands for.
pub fn legend_ui(ui: &mut Ui, ink: Color32, words: &str) {
    let (rect, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::empty());
    ui.painter().rect_filled(rect, 2.0, ink);
    ui.label(RichText::new(words).small());
}

/// Draws it in the space there is.
pub fn strip_ui(ui: &mut Ui, strip: Strip) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let has_time = !strip.axes[0].is_empty();
    let plot = quiet(ui, Plot::new(strip.id), tokens)
        .x_axis_label(strip.axes[0])
        .y_axis_label(strip.axes[1])
        .show_axes([has_time, true])
        .include_y(*strip.least.start())
        .include_y(*strip.least.end())
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false);
    plot.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(strip.shown);
        for curve in strip.curves {
            // Bands of points that share a column would be drawn as wedges where a curve is quick.
            let points: PlotPoints<'_> = curve.points.into_iter().collect();
            let line = Line::new(curve.name, points).allow_band(false);
            plot_ui.line(line.color(curve.ink).width(1.4));
        }
    });
}
