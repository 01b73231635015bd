//! Depth, speed and force over time as a plan is expected to go, before anything moves.

use super::figure::{PlotLook, plot_ui};
use crate::widgets::{heading_ui, quiet_ui};
use eframe::egui::{Ui, vec2};
pub use palpate_analysis::report::plan_picture::CourseLimits;
use palpate_analysis::report::plan_picture::{PLAN_CAPTION, course};
use palpate_protocols::preview::OutlinePoint;

/// Draws the curves in the space there is.
pub fn course_ui(ui: &mut Ui, outline: &[OutlinePoint], limits: CourseLimits) {
    let look = PlotLook { link: Some("course"), ..PlotLook::default() };
    let height = (ui.available_height() - 112.0) / 3.0;
    for plot in course(outline, Some(limits)) {
        heading_ui(ui, &plot.title);
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
            plot_ui(ui, &plot.title, &plot, look);
        });
    }
    let words = format!(
        "{PLAN_CAPTION}. The run ends if the force exceeds {}; the fastest speed of the rig is {}.",
        limits.force, limits.speed
    );
    quiet_ui(ui, words);
}
