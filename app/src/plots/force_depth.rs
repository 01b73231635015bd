//! Force over depth, from the moment contact is known.

use super::points::PlotCache;
use super::style::{band_of, quiet};
use crate::theme::Tokens;
use eframe::egui::Ui;
use egui_plot::{Plot, PlotPoints, Points};

/// Draws the plot in the space there is. `depth_mm` is the depth the form or the run asks for,
/// so the axis does not creep while the probe goes in.
pub fn force_depth_ui(ui: &mut Ui, cache: &PlotCache, depth_mm: f64) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let plot = quiet(Plot::new("force_depth"), tokens)
        .x_axis_label("depth from contact (mm)")
        .y_axis_label("force above tare (N)")
        .include_x(0.0)
        .include_x(depth_mm)
        .include_y(0.0)
        .include_y(0.5);
    plot.show(ui, |plot_ui| {
        for band in cache.force_depth.bands("calibration") {
            plot_ui.add(band.fill_color(band_of(tokens)));
        }
        for line in cache.force_depth.lines("force") {
            plot_ui.line(line.color(tokens.series));
        }
        if let Some(last) = cache.force_depth.last() {
            plot_ui.points(
                Points::new("now", PlotPoints::Owned(vec![last]))
                    .radius(4.0)
                    .color(tokens.text)
                    .allow_hover(false),
            );
        }
    });
}
