//! The exact fit after a run: the words of `palpate fit`, from the same formatter.

use super::parameters::{cell, tight, value_ui};
use crate::widgets::{section_ui, sentence_ui, tokens_of};
use eframe::egui::{Label, RichText, Ui};
use palpate_analysis::report::text::{ParameterText, quality};
use palpate_rheology::fit::FitReport;

/// Draws the report: parameters with their intervals, quality, every sentence.
pub fn exact_ui(ui: &mut Ui, report: &FitReport) {
    section_ui(ui, "Exact fit");
    tight(ui, |ui| {
        for parameter in &report.parameters {
            row_ui(ui, &ParameterText::of(parameter));
        }
    });
    ui.label(quality(report));
    report.sentences().for_each(|sentence| sentence_ui(ui, sentence));
}

fn row_ui(ui: &mut Ui, text: &ParameterText) {
    value_ui(ui, &text.name, RichText::new(&text.value), &text.unit);
    if !text.interval.is_empty() {
        let quiet = tokens_of(ui).text_quiet;
        ui.horizontal(|ui| {
            cell(ui, 60.0, |ui| ui.label(RichText::new("95 %").color(quiet).small()));
            let interval = RichText::new(&text.interval).monospace().small();
            ui.add(Label::new(interval.color(quiet)).wrap());
        });
    }
}
