//! A modulus, drawn: the plots in the middle, the number and all it rests on at the right.

use crate::plots::figure::{PlacedPlot, PlotLook, legend_ui};
use crate::widgets::{
    alarm_ui, fact_ui, heading_ui, placeholder_ui, quiet_ui, section_ui, sentence_ui,
};
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_analysis::material::{MaterialReport, MaterialRequest};
use palpate_analysis::report::material::{
    RELAXES, assumptions, budget_kpa, interval_words, lack_words, modulus_words,
};
use palpate_analysis::report::material_plot::material_plots;
use palpate_analysis::session_actions::MaterialToStore;
use palpate_figures::uncertain::significant;

/// Share of the height that the plot of the loading gets.
const LOADING_SHARE: f32 = 0.64;

/// A modulus with its plots, whose points are placed once.
pub struct FittedMaterial {
    pub report: MaterialReport,
    plots: [PlacedPlot; 2],
    pub(super) to_store: MaterialToStore,
}

impl FittedMaterial {
    pub(super) fn of(request: &MaterialRequest, report: MaterialReport) -> Self {
        Self {
            plots: material_plots(&report).map(PlacedPlot::from),
            to_store: MaterialToStore::of(request, &report),
            report,
        }
    }
}

/// Draws the loading with its law, and the residuals beneath on the same depths.
pub(super) fn plots_ui(ui: &mut Ui, fitted: &FittedMaterial) {
    let [loading, residuals] = &fitted.plots;
    heading_ui(ui, "Loading and law");
    legend_ui(ui, &[&loading.plot]);
    let look = PlotLook { link: Some("material_depth"), ..PlotLook::default() };
    let height = LOADING_SHARE * ui.available_height();
    ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
        loading.ui(ui, "material_loading", look);
    });
    if fitted.report.noise_n.is_some() {
        quiet_ui(ui, "residuals, with lines at the noise of the force");
    } else {
        quiet_ui(ui, "residuals");
    }
    residuals.ui(ui, "material_residuals", look);
}

/// Draws the number, beside it what it assumes, how far the law holds, and the budget.
pub(super) fn number_ui(ui: &mut Ui, report: &MaterialReport) {
    section_ui(ui, "Young's modulus");
    ui.add(Label::new(RichText::new(modulus_words(report)).heading().strong()).wrap());
    sentence_ui(ui, interval_words(report));
    if let Some(lack) = report.lack_of_fit {
        alarm_ui(ui, format!("lack of fit: {}", lack_words(lack)));
    }
    section_ui(ui, "Assumptions");
    for (name, words) in assumptions(report) {
        fact_ui(ui, name, words);
    }
    sentence_ui(ui, RELAXES);
    section_ui(ui, "How far the law holds");
    for row in &report.validity {
        let value = significant(row.value, 3);
        let share = significant(100.0 * row.value / row.max, 2);
        sentence_ui(ui, format!("{} {value}, {share} % of the limit {}", row.ratio, row.max));
    }
    section_ui(ui, "Uncertainty budget");
    quiet_ui(ui, "source, standard uncertainty, share of the variance");
    for row in &report.budget {
        sentence_ui(ui, format!("{}: {} kPa, {:.0} %", row.source, budget_kpa(row), row.percent));
    }
    if report.not_included.is_empty() {
        placeholder_ui(ui, "all known sources are included");
    } else {
        sentence_ui(ui, format!("not included: {}", report.not_included.join(", ")));
    }
    report.notes.iter().for_each(|note| quiet_ui(ui, note));
}
