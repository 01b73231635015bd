//! What the plan will do, before anything moves.

use super::form::ProtocolForm;
use crate::theme::Tokens;
use crate::widgets::fact_row::fact_ui;
use crate::widgets::tick_box::tick_box;
use eframe::egui::{RichText, Ui};
use palpate_figures::uncertain::clock;
use palpate_protocols::preview::Preview;

/// Draws durations, forces and storage, then refusals and notes.
pub fn preview_ui(ui: &mut Ui, form: &ProtocolForm) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let Some(checked) = form.checked() else {
        ui.label(
            RichText::new("No preview until the protocol and its values are right")
                .color(tokens.text_quiet),
        );
        for problem in form.problems() {
            ui.label(RichText::new(problem.to_string()).color(tokens.alarm_text));
        }
        return;
    };
    let preview = &checked.preview;
    numbers_ui(ui, preview);
    for refusal in &preview.refusals {
        ui.label(RichText::new(format!("Refused: {refusal}")).color(tokens.alarm_text));
    }
    let warnings = checked.warnings.iter().map(ToString::to_string);
    for note in warnings.chain(preview.notes.iter().cloned()) {
        ui.label(RichText::new(format!("Note: {note}")).color(tokens.text_quiet).small());
    }
}

/// Draws what the preview asks to acknowledge, with the box to tick; nothing if it asks nothing.
pub fn acknowledgement_ui(ui: &mut Ui, form: &mut ProtocolForm) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let warnings =
        form.checked().map_or(Vec::new(), |checked| checked.preview.acknowledgements.clone());
    if warnings.is_empty() {
        return;
    }
    for warning in &warnings {
        ui.label(RichText::new(format!("Mind: {warning}")).color(tokens.alarm_text));
    }
    let mut is_acknowledged = form.is_acknowledged();
    if tick_box(ui, &mut is_acknowledged, "I accept this; it is recorded").changed() {
        form.acknowledge(is_acknowledged);
    }
}

fn numbers_ui(ui: &mut Ui, preview: &Preview) {
    fact_ui(
        ui,
        "duration",
        format!("{} expected, {} at most", clock(preview.expected.0), clock(preview.longest.0)),
    );
    fact_ui(
        ui,
        "peak force",
        format!("{:.1} to {:.1} expected", preview.force_band[0], preview.force_band[1]),
    );
    fact_ui(ui, "storage", format!("up to {:.1} MB", preview.storage_bytes as f64 * 1e-6));
}
