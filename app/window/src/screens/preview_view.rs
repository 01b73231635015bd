//! What the plan will do, before anything moves.

use super::form::ProtocolForm;
use crate::widgets::{alarm_ui, fact_ui, placeholder_ui, sentence_ui, tick_box};
use eframe::egui::Ui;
use palpate_figures::uncertain::clock;
use palpate_protocols::preview::Preview;

/// Draws durations, forces and storage, then refusals and notes.
pub fn preview_ui(ui: &mut Ui, form: &ProtocolForm) {
    let Some(checked) = form.checked() else {
        placeholder_ui(ui, "The preview appears when the protocol and its values are correct");
        // What is about one field stands there.
        let is_elsewhere = |words: &str| form.fields.iter().any(|field| field.is_named_in(words));
        for problem in form.problems().iter().filter(|one| !is_elsewhere(&one.message)) {
            alarm_ui(ui, problem.to_string());
        }
        return;
    };
    let preview = &checked.preview;
    let does_indent = checked.outline.iter().any(|point| point.depth.0 > 0.0);
    numbers_ui(ui, preview, does_indent);
    for refusal in &preview.refusals {
        alarm_ui(ui, format!("Refused: {refusal}"));
    }
    let warnings = checked.warnings.iter().map(ToString::to_string);
    for note in warnings.chain(preview.notes.iter().cloned()) {
        sentence_ui(ui, format!("Note: {note}"));
    }
}

/// Draws what the preview asks to acknowledge, with the box to tick; nothing if it asks nothing.
pub fn acknowledgement_ui(ui: &mut Ui, form: &mut ProtocolForm) {
    let warnings =
        form.checked().map_or(Vec::new(), |checked| checked.preview.acknowledgements.clone());
    if warnings.is_empty() {
        return;
    }
    for warning in &warnings {
        alarm_ui(ui, format!("Warning: {warning}"));
    }
    let mut is_acknowledged = form.is_acknowledged();
    if tick_box(ui, &mut is_acknowledged, "I accept this, and the session records it").changed() {
        form.acknowledge(is_acknowledged);
    }
}

fn numbers_ui(ui: &mut Ui, preview: &Preview, does_indent: bool) {
    fact_ui(
        ui,
        "duration",
        format!("{} expected, {} at most", clock(preview.expected.0), clock(preview.longest.0)),
    );
    let [low, high] = preview.force_band;
    let force = match does_indent {
        true => format!("{low:.1} to {high:.1} expected"),
        false => "no indentation".to_owned(),
    };
    fact_ui(ui, "peak force", force);
    fact_ui(ui, "storage", format!("up to {:.1} MB", preview.storage_bytes as f64 * 1e-6));
}
