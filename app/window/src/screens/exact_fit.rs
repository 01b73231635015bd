//! The exact fit after a run: the words of `palpate fit`, from the same formatter.

use super::parameters::{NAME_WIDTH, cell, number_ui, symbol_ui, tight, value_ui};
use crate::widgets::{fact_ui, quiet_ui, section_ui, sentence_ui, tokens_of};
use eframe::egui::{CollapsingHeader, RichText, Ui};
use palpate_analysis::report::budget::{BUDGET_TITLE, UncertaintyBudget};
use palpate_analysis::report::text::{ParameterText, quality, typeset};
use palpate_model::estimate::FittedParameter;
use palpate_rheology::fit::FitReport;

/// Draws the report: parameters with their intervals and their budget, quality, every sentence.
pub fn exact_ui(ui: &mut Ui, report: &FitReport) {
    section_ui(ui, "Exact fit");
    tight(ui, |ui| {
        for parameter in &report.parameters {
            row_ui(ui, &ParameterText::of(parameter));
        }
    });
    budget_ui(ui, BUDGET_TITLE, &report.parameters);
    ui.label(quality(report));
    report.sentences().for_each(|sentence| sentence_ui(ui, sentence));
}

fn row_ui(ui: &mut Ui, text: &ParameterText) {
    let tokens = tokens_of(ui);
    value_ui(ui, &text.name, &text.value, tokens.text, &text.unit);
    let intervals = [("95 %", &text.interval), ("total 95 %", &text.total)];
    for (name, interval) in intervals.into_iter().filter(|(_, interval)| !interval.is_empty()) {
        ui.horizontal(|ui| {
            cell(ui, NAME_WIDTH, |ui| {
                ui.label(RichText::new(name).color(tokens.text_quiet).small())
            });
            number_ui(ui, interval, tokens.text_quiet);
        });
    }
}

/// Draws the uncertainty budget, folded away; nothing where the sources are not told apart.
pub fn budget_ui(ui: &mut Ui, title: &str, parameters: &[FittedParameter]) {
    if parameters.iter().all(|one| one.budget.is_empty()) {
        return;
    }
    CollapsingHeader::new(title).show(ui, |ui| {
        let budget = UncertaintyBudget::of(parameters);
        quiet_ui(ui, "share of the variance, source, standard uncertainty");
        for one in &budget.parameters {
            ui.horizontal(|ui| {
                symbol_ui(ui, &one.parameter.name);
                quiet_ui(ui, typeset(&one.parameter.unit));
            });
            for row in one.main_rows() {
                fact_ui(ui, &row.share(), format!("{}, {}", row.source, row.uncertainty()));
            }
        }
        budget.remedies.iter().for_each(|remedy| quiet_ui(ui, remedy));
    });
}
