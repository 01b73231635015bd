//! The chosen calibration as four plots over force: signal, residual, slope and uncertainty.

use crate::plots::figure::{PlotLook, legend_ui, plot_ui};
use crate::widgets::heading_ui;
use eframe::egui::{Ui, vec2};
use palpate_figures::figure::Plot;

/// How each looks: it is half as wide as the plots of a run.
const LOOK: PlotLook<'_> = PlotLook {
    steps: [Some(4.0), None],
    link: Some("calibration_force"),
    shown: None,
    x_text: None,
    over: None,
};

/// Draws all four in the space there is, two beside each other.
pub fn curves_ui(ui: &mut Ui, plots: &[Plot; 4]) {
    let size = vec2((ui.available_width() - 12.0) * 0.5, (ui.available_height() - 62.0) * 0.5);
    for row in plots.chunks(2) {
        ui.horizontal(|ui| {
            for plot in row {
                ui.vertical(|ui| {
                    heading_ui(ui, &plot.title);
                    ui.allocate_ui(size, |ui| {
                        ui.set_min_size(size);
                        plot_ui(ui, &plot.title, plot, LOOK);
                    });
                });
            }
        });
    }
    legend_ui(ui, &plots.each_ref());
}
