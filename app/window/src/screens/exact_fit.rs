//! The exact fit after a run: the words of `palpate fit`, from the same formatter.

use super::parameters::{cell, tight};
use crate::theme::Tokens;
use crate::widgets::section_ui;
use eframe::egui::{Label, RichText, Ui};
use palpate_analysis::report::text::{ParameterText, quality};
use palpate_rheology::fit::FitReport;

/// Draws the report: parameters with their intervals, quality, every sentence.
pub fn exact_ui(ui: &mut Ui, report: &FitReport) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    section_ui(ui, "Exact fit");
    tight(ui, |ui| {
        for parameter in &report.parameters {
            row_ui(ui, &ParameterText::of(parameter));
        }
    });
    ui.label(quality(report));
    for sentence in report.sentences() {
        ui.add(Label::new(RichText::new(sentence).color(tokens.text)).wrap());
    }
}

fn row_ui(ui: &mut Ui, text: &ParameterText) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.horizontal(|ui| {
        cell(ui, 60.0, |ui| {
            ui.label(RichText::new(&text.name).color(tokens.text_quiet));
        });
        cell(ui, 166.0, |ui| {
            ui.label(RichText::new(&text.value).monospace());
        });
        ui.label(RichText::new(&text.unit).color(tokens.text_quiet).small());
    });
    if !text.interval.is_empty() {
        ui.horizontal(|ui| {
            cell(ui, 60.0, |ui| {
                ui.label(RichText::new("95 %").color(tokens.text_quiet).small());
            });
            let interval = RichText::new(&text.interval).monospace().small();
            ui.add(Label::new(interval.color(tokens.text_quiet)).wrap());
        });
    }
}
