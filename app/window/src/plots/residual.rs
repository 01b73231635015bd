//! What the exact fit leaves over, under the force and over the same time.

use super::style::{quiet, round_marks};
use crate::theme::Tokens;
use crate::workers::fit::ExactFit;
use eframe::egui::{Ui, Vec2b};
use egui_plot::{HLine, Line, Plot, PlotPoints};
use std::ops::RangeInclusive;

/// Draws the plot in the space there is, for the session times that the plot above shows.
pub fn residual_ui(ui: &mut Ui, exact: &ExactFit, shown: RangeInclusive<f64>) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let plot = quiet(ui, Plot::new("residual"), tokens)
        .y_axis_label("residual (mN)")
        // Low as it is, it has room for three numbers.
        .y_grid_spacer(|input| round_marks(input, 4.0))
        .show_x(false)
        .allow_drag(false)
        .auto_bounds(Vec2b::new(false, true));
    plot.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(shown);
        plot_ui
            .hline(HLine::new("zero", 0.0).color(tokens.text_quiet).width(1.0).allow_hover(false));
        plot_ui.line(
            Line::new("residual", PlotPoints::Borrowed(&exact.residual))
                .color(tokens.series)
                .width(1.0)
                .allow_hover(false),
        );
    });
}
