//! Force over depth, from the moment contact is known; in a series every cycle is a loop, older ones faded.

use super::points::PlotCache;
use super::style::{band_of, quiet};
use crate::theme::Tokens;
use eframe::egui::Ui;
use egui_plot::{Plot, PlotPoint, PlotPoints, Points};

/// Opacity of a loop so many cycles old: half of the newest, and never so faint that it is lost.
fn faded(age: usize) -> f32 {
    (0.55 * 0.85f32.powi(age.min(20) as i32)).max(0.14)
}

/// Draws the plot in the space there is. `depth_mm` is the depth the form or the run asks for,
/// so the axis does not creep while the probe goes in.
pub fn force_depth_ui(ui: &mut Ui, cache: &PlotCache, depth_mm: f64) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let plot = quiet(ui, Plot::new("force_depth"), tokens)
        .x_axis_label("depth from contact (mm)")
        .y_axis_label("force above tare (N)")
        .include_x(0.0)
        .include_x(depth_mm)
        .include_y(0.0)
        .include_y(0.5);
    plot.show(ui, |plot_ui| {
        // Bands of several loops over each other would hide the loops.
        if cache.drawn_loops().is_empty() {
            for band in cache.force_depth.bands("calibration") {
                plot_ui.add(band.fill_color(band_of(tokens)));
            }
        }
        let loops = cache.drawn_loops();
        if loops.is_empty() {
            for line in cache.force_depth.lines("force") {
                plot_ui.line(line.color(tokens.series));
            }
        }
        for (i, one) in loops.iter().enumerate() {
            let is_newest = i + 1 == loops.len();
            let ink = if is_newest {
                tokens.series
            } else {
                tokens.text.gamma_multiply(faded(loops.len() - 1 - i))
            };
            for line in one.series.lines("force") {
                plot_ui.line(line.id(("loop", one.cycle)).color(ink));
            }
            if let Some(peak) = one.peak {
                let place = PlotPoint::new(peak.depth, peak.force);
                let point = Points::new("peak", PlotPoints::Owned(vec![place]));
                plot_ui.points(point.id(("peak", one.cycle)).radius(2.5).color(ink));
            }
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
