//! The exact fit after a run: the words of `palpate fit`, from the same formatter.

use super::parameters::{NAME_WIDTH, cell, number_ui, symbol_job, symbol_ui, tight, value_ui};
use crate::theme::Tokens;
use crate::widgets::{fact_ui, quiet_ui, section_ui, sentence_ui, tokens_of};
use eframe::egui::{CollapsingHeader, Color32, RichText, Ui};
use palpate_analysis::report::budget::{BUDGET_TITLE, UncertaintyBudget};
use palpate_analysis::report::text::{ParameterText, quality, typeset};
use palpate_model::estimate::FittedParameter;
use palpate_rheology::fit::FitReport;

/// Width in points from which intervals stand beside their value.
const WIDE: f32 = 500.0;
/// Of a symbol with its unit, and of an interval, where they stand beside each other.
const SYMBOL_WIDTH: f32 = 110.0;
const WIDE_VALUE_WIDTH: f32 = 212.0;
const INTERVAL_WIDTH: f32 = 196.0;

/// Draws the report: parameters with their intervals and their budget, quality, every sentence.
pub fn exact_ui(ui: &mut Ui, report: &FitReport) {
    section_ui(ui, "Exact fit");
    tight(ui, |ui| {
        if ui.available_width() > WIDE {
            table_ui(ui, &report.parameters);
        } else {
            report.parameters.iter().for_each(|one| row_ui(ui, one));
        }
    });
    if report.parameters.iter().any(|one| one.total95.is_some()) {
        quiet_ui(
            ui,
            "total: with the errors of the calibration, which are found together with the parameters, so that it may lie beside the other interval",
        );
    }
    // A value beside its own interval is explained where it is seen.
    let displaced = report.displaced_sentence();
    if let Some(sentence) = &displaced {
        sentence_ui(ui, sentence);
    }
    budget_ui(ui, BUDGET_TITLE, &report.parameters);
    ui.label(quality(report));
    let others = report.sentences().filter(|one| Some(*one) != displaced.as_deref());
    others.for_each(|sentence| sentence_ui(ui, sentence));
}

/// Draws a line for each parameter, with as many of its intervals as have room; the total one is the one that counts.
fn table_ui(ui: &mut Ui, parameters: &[FittedParameter]) {
    let tokens = tokens_of(ui);
    let texts: Vec<ParameterText> = parameters.iter().map(ParameterText::of).collect();
    let gap = ui.spacing().item_spacing.x;
    let room = ui.available_width() - SYMBOL_WIDTH - WIDE_VALUE_WIDTH - 2.0 * gap;
    let count = ((room + gap) / (INTERVAL_WIDTH + gap)).floor().max(1.0) as usize;
    let names = [TOTAL, "95 %"].into_iter();
    let known = names.filter(|name| texts.iter().any(|text| !interval(text, name).is_empty()));
    let names: Vec<&str> = known.take(count).collect();
    ui.horizontal(|ui| {
        cell(ui, SYMBOL_WIDTH, |_| ());
        cell(ui, WIDE_VALUE_WIDTH, |ui| quiet_ui(ui, "value"));
        for name in &names {
            cell(ui, INTERVAL_WIDTH, |ui| quiet_ui(ui, *name));
        }
    });
    for (parameter, text) in parameters.iter().zip(&texts) {
        ui.horizontal(|ui| {
            cell(ui, SYMBOL_WIDTH, |ui| {
                let symbol = ui.label(symbol_job(ui, &text.name, &text.unit));
                symbol.on_hover_text(format!("{}, 95 %: {}", text.name, text.interval));
            });
            cell(ui, WIDE_VALUE_WIDTH, |ui| number_ui(ui, &text.value, tokens.text));
            for name in &names {
                cell(ui, INTERVAL_WIDTH, |ui| {
                    number_ui(ui, interval(text, name), interval_ink(tokens, parameter, name))
                });
            }
        });
    }
}

const TOTAL: &str = "total 95 %";

/// A total interval that does not hold its own value stands out.
fn interval_ink(tokens: &Tokens, parameter: &FittedParameter, name: &str) -> Color32 {
    let is_odd = name == TOTAL && parameter.is_displaced();
    if is_odd { tokens.alarm_text } else { tokens.text_quiet }
}

fn interval<'a>(text: &'a ParameterText, name: &str) -> &'a str {
    if name == TOTAL { &text.total } else { &text.interval }
}

/// Draws a parameter with its intervals below.
pub fn row_ui(ui: &mut Ui, parameter: &FittedParameter) {
    let tokens = tokens_of(ui);
    let text = ParameterText::of(parameter);
    value_ui(ui, &text.name, &text.value, tokens.text, &text.unit);
    for name in ["95 %", TOTAL] {
        let interval = interval(&text, name);
        if interval.is_empty() {
            continue;
        }
        ui.horizontal(|ui| {
            cell(ui, NAME_WIDTH, |ui| {
                ui.label(RichText::new(name).color(tokens.text_quiet).small())
            });
            number_ui(ui, interval, interval_ink(tokens, parameter, name));
        });
    }
}

/// Draws a parameter's symbol and an interval of it.
pub fn interval_ui(ui: &mut Ui, name: &str, interval: &str) {
    ui.horizontal(|ui| {
        cell(ui, NAME_WIDTH, |ui| symbol_ui(ui, name));
        number_ui(ui, interval, tokens_of(ui).text);
    });
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
