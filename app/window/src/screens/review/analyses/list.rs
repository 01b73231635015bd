//! The analyses there are, and what the one chosen found.

use super::super::Looked;
use super::OwnFit;
use crate::theme::Tokens;
use crate::widgets::fact_row::fact_ui;
use crate::widgets::places::NamedControl;
use crate::widgets::reason_button::reason_button;
use crate::widgets::remark::quiet_ui;
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_analysis::analyses::{Deed, Known};
use palpate_analysis::report::said;
use palpate_analysis::report::{kept, text};
use palpate_sessions::analyses::{Analysed, Analysis};

/// How the session is read without any analysis.
const AS_MEASURED: &str = "as measured";

/// Draws the list and the analysis chosen; true when the session's own fit is asked for.
pub(super) fn list_ui(
    ui: &mut Ui,
    known: &Known,
    looked: &mut Looked,
    own: Option<&OwnFit>,
) -> bool {
    ui.radio_value(&mut looked.analysis, None, AS_MEASURED).named(AS_MEASURED);
    for one in &known.analyses.all {
        if one.what != Analysed::Withdrawal {
            line_ui(ui, known, one, looked);
        }
    }
    let chosen = looked.analysis.as_deref();
    let chosen = chosen.and_then(|name| known.analyses.get(name).ok());
    chosen.is_some_and(|one| found_ui(ui, one, own))
}

fn line_ui(ui: &mut Ui, known: &Known, one: &Analysis, looked: &mut Looked) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    match kept::withdrawn(&known.analyses, &one.name) {
        None => {
            let choice = Some(one.name.clone());
            ui.radio_value(&mut looked.analysis, choice, &one.name).named(&one.name);
        }
        Some(words) => {
            let name = RichText::new(&one.name).strikethrough();
            ui.add(Label::new(name.color(tokens.text_quiet)).wrap());
            quiet_ui(ui, &words);
        }
    }
    let why = match one.reason.as_str() {
        "" => String::new(),
        reason => format!(": {reason}"),
    };
    let (what, at) = (one.what.word(), said::at(&one.at));
    quiet_ui(ui, &format!("{what}, {at} by {}{why}", one.by));
}

/// What an analysis found, beside the session's own fit; true when that is asked for.
fn found_ui(ui: &mut Ui, one: &Analysis, own: Option<&OwnFit>) -> bool {
    ui.add_space(4.0);
    ui.label(RichText::new(format!("Found by '{}'", one.name)).strong());
    quiet_ui(ui, &kept::deed(&one.what));
    let Analysed::Fit { results, .. } = &one.what else {
        return false;
    };
    for parameter in kept::parameters(results) {
        let unit = text::typeset(&parameter.unit);
        fact_ui(ui, &parameter.name, format!("{} {unit}", text::cell(&parameter)));
        let own = own.and_then(|own| {
            let same = own.parameters.iter().find(|own| own.name == parameter.name)?;
            Some(text::cell(same))
        });
        if let Some(own) = own {
            fact_ui(ui, "", format!("session: {own}"));
        }
    }
    if let Some(profile) = results["profile"].as_array() {
        quiet_ui(ui, "95 % from the profile likelihood");
        let number = |value: &serde_json::Value| match value.as_f64() {
            Some(value) => palpate_figures::uncertain::plain(value),
            None => "open".to_owned(),
        };
        for one in profile {
            let name = one["name"].as_str().unwrap_or_default();
            let ends = format!("[{}, {}]", number(&one["low"]), number(&one["high"]));
            fact_ui(ui, name, ends);
        }
    }
    for sentence in kept::sentences(results) {
        ui.add(Label::new(RichText::new(sentence).small()).wrap());
    }
    match own {
        None => ui.button("Compare with the session's own fit").clicked(),
        Some(own) => {
            if !own.sentences.is_empty() {
                quiet_ui(ui, "of the session's own fit:");
            }
            for sentence in &own.sentences {
                quiet_ui(ui, sentence);
            }
            false
        }
    }
}

/// Draws what takes an analysis back.
pub(super) fn withdraw_ui(
    ui: &mut Ui,
    known: &Known,
    looked: &Looked,
    verdict: &Result<(), String>,
) -> Option<Deed> {
    ui.add_space(4.0);
    let chosen = looked.analysis.clone();
    let own = match &chosen {
        Some(_) => verdict.clone(),
        None => Err("choose the analysis to withdraw in the list".to_owned()),
    };
    let size = vec2(170.0, 26.0);
    if reason_button(ui, "Withdraw the chosen", size, &own) {
        return chosen.map(|name| Deed::Withdraw { name });
    }
    let last = known.analyses.counting().last();
    let own = match last {
        Some(_) => verdict.clone(),
        None => Err("there is nothing to undo".to_owned()),
    };
    let is_pressed = reason_button(ui, "Undo the last", size, &own);
    let last = last?;
    quiet_ui(ui, &format!("the last is '{}', by {}", last.name, last.by));
    is_pressed.then(|| Deed::Withdraw { name: last.name.clone() })
}
