//! The analyses there are, and what the one chosen found.

use super::super::ReviewSource;
use super::OwnFit;
use crate::screens::exact_fit::{budget_ui, interval_ui, row_ui};
use crate::widgets::{
    NamedControl, fact_ui, quiet_ui, reason_button, require, small_ui, tokens_of,
};
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_analysis::report::budget::BUDGET_TITLE;
use palpate_analysis::report::session_text;
use palpate_analysis::report::stored_analysis;
use palpate_analysis::report::text::ParameterText;
use palpate_analysis::session_actions::{SessionAction, SessionActionContext};
use palpate_sessions::analyses::{Analysis, AnalysisContent};

const AS_MEASURED: &str = "as measured";

/// Draws the list and the analysis chosen; true when "Compare" is pressed.
pub(super) fn list_ui(
    ui: &mut Ui,
    known: &SessionActionContext,
    source: &mut ReviewSource,
    own: Option<&OwnFit>,
) -> bool {
    ui.radio_value(&mut source.analysis, None, AS_MEASURED).named(AS_MEASURED);
    for one in &known.analyses.all {
        if one.what != AnalysisContent::Withdrawal {
            line_ui(ui, known, one, source);
        }
    }
    let chosen = source.analysis.as_deref();
    let chosen = chosen.and_then(|name| known.analyses.get(name).ok());
    chosen.is_some_and(|one| found_ui(ui, one, own))
}

fn line_ui(ui: &mut Ui, known: &SessionActionContext, one: &Analysis, source: &mut ReviewSource) {
    let tokens = tokens_of(ui);
    match stored_analysis::describe_withdrawal(&known.analyses, &one.name) {
        None => {
            let choice = Some(one.name.clone());
            ui.radio_value(&mut source.analysis, choice, &one.name).named(&one.name);
        }
        Some(words) => {
            let name = RichText::new(&one.name).strikethrough();
            ui.add(Label::new(name.color(tokens.text_quiet)).wrap());
            quiet_ui(ui, words);
        }
    }
    let colon = if one.reason.is_empty() { "" } else { ": " };
    let (what, at) = (one.what.word(), session_text::format_utc(&one.at));
    quiet_ui(ui, format!("{what}, {at} by {}{colon}{}", one.by, one.reason));
}

/// The result of an analysis next to the session's own fit; true when "Compare" is pressed.
fn found_ui(ui: &mut Ui, one: &Analysis, own: Option<&OwnFit>) -> bool {
    ui.add_space(4.0);
    ui.label(RichText::new(format!("Found by '{}'", one.name)).strong());
    quiet_ui(ui, stored_analysis::describe_analysis(&one.what));
    if let AnalysisContent::Material { words, .. } = &one.what {
        // The first one stands above; columns of spaces stand in no line here.
        let lines = words.lines().skip(1).map(|line| line.split_whitespace().collect::<Vec<_>>());
        lines.for_each(|line| small_ui(ui, line.join(" ")));
    }
    let AnalysisContent::Fit { results, .. } = &one.what else { return false };
    let parameters = stored_analysis::parameters(results);
    for parameter in &parameters {
        row_ui(ui, parameter);
        let mut own = own.iter().flat_map(|own| &own.parameters);
        if let Some(same) = own.find(|own| own.name == parameter.name) {
            fact_ui(ui, "", format!("session: {}", ParameterText::of(same).value));
        }
    }
    budget_ui(ui, &format!("{BUDGET_TITLE} of '{}'", one.name), &parameters);
    if let Some(profile) = results["profile"].as_array() {
        quiet_ui(ui, "95 % from the profile likelihood");
        let number = |value: &serde_json::Value| match value.as_f64() {
            Some(value) => palpate_figures::uncertain::plain(value),
            None => "open".to_owned(),
        };
        for one in profile {
            let name = one["name"].as_str().unwrap_or_default();
            let ends = format!("[{}, {}]", number(&one["low"]), number(&one["high"]));
            interval_ui(ui, name, &ends);
        }
    }
    for sentence in stored_analysis::sentences(results) {
        small_ui(ui, sentence);
    }
    match own {
        None => ui.button("Compare with the session's own fit").clicked(),
        Some(own) => {
            if !own.sentences.is_empty() {
                quiet_ui(ui, "the session's own fit:");
            }
            for sentence in &own.sentences {
                quiet_ui(ui, sentence);
            }
            false
        }
    }
}

/// Draws the buttons that withdraw an analysis.
pub(super) fn withdraw_ui(
    ui: &mut Ui,
    known: &SessionActionContext,
    source: &ReviewSource,
    verdict: &Result<(), String>,
) -> Option<SessionAction> {
    ui.add_space(4.0);
    let chosen = source.analysis.clone();
    let own = require(chosen.is_some(), "choose an analysis in the list first");
    let own = own.and(verdict.clone());
    let size = vec2(170.0, 26.0);
    if reason_button(ui, "Withdraw analysis", size, &own) {
        return chosen.map(|name| SessionAction::Withdraw { name });
    }
    let last = known.analyses.active().last();
    let own =
        require(last.is_some(), "the session has no analysis to withdraw").and(verdict.clone());
    let is_pressed = reason_button(ui, "Withdraw last analysis", size, &own);
    let last = last?;
    quiet_ui(ui, format!("the last is '{}', by {}", last.name, last.by));
    is_pressed.then(|| SessionAction::Withdraw { name: last.name.clone() })
}
