//! The chosen calibration as four plots over force: signal, residual, slope and uncertainty.

use crate::plots::figure::{PlotLook, legend_ui, patch_ui, plot_ui};
use crate::widgets::heading_ui;
use eframe::egui::{Frame, Panel, Ui, vec2};
use palpate_analysis::report::calibration_plot::FLAT_STRETCH;
use palpate_figures::figure::{Ink, Plot};

/// Draws all four in the space there is, two in a row.
pub fn curves_ui(ui: &mut Ui, plots: &[Plot; 4]) {
    // First what may take two lines.
    Panel::bottom("legend").resizable(false).show_separator_line(false).frame(Frame::NONE).show(
        ui,
        |ui| {
            legend_ui(ui, &plots.each_ref());
            if plots.iter().any(|plot| !plot.stretches.is_empty()) {
                patch_ui(ui, Ink::Line, FLAT_STRETCH);
            }
        },
    );
    let size = vec2((ui.available_width() - 12.0) * 0.5, (ui.available_height() - 60.0) * 0.5);
    // Half as wide as the plots of a run.
    let steps = [Some(4.0), None];
    let look = PlotLook { steps, link: Some("calibration_force"), ..PlotLook::default() };
    for row in plots.chunks(2) {
        ui.horizontal(|ui| {
            for plot in row {
                ui.vertical(|ui| {
                    heading_ui(ui, &plot.title);
                    ui.allocate_ui(size, |ui| {
                        ui.set_min_size(size);
                        plot_ui(ui, &plot.title, plot, look);
                    });
                });
            }
        });
    }
}
