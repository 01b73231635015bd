//! The protocol: who, what, how fast, how deep, how long, where to; and the start.

use super::form::ProtocolForm;
use super::preview_view::{acknowledgement_ui, preview_ui};
use crate::command::{Command, Commands};
use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::quantity_input::{form_label, quantity_ui, text_ui};
use crate::widgets::reason_button::reason_button;
use crate::workers::path_dialog::Ask;
use eframe::egui::{Button, RichText, TextEdit, Ui, vec2};

/// What the panel must know beside the form.
pub struct ProtocolFacts<'a> {
    /// Whether a run is in progress or about to start: the form then shows what runs.
    pub is_busy: bool,
    /// Where sessions go if no folder is chosen, or why nowhere.
    pub library: &'a Result<String, String>,
    /// Whether the folder dialog is open.
    pub is_dialog_open: bool,
}

/// Opacity of locked fields; enough contrast is left to read their values.
const LOCKED_ALPHA: f32 = 0.8;

/// Draws the form and the preview.
pub fn protocol_ui(
    ui: &mut Ui,
    form: &mut ProtocolForm,
    facts: &ProtocolFacts<'_>,
    commands: &mut Commands,
) {
    section_ui(ui, "Ramp and hold");
    ui.scope(|ui| {
        // Locked while a run goes on, but still to be read: it says what is running.
        ui.visuals_mut().disabled_alpha = LOCKED_ALPHA;
        ui.add_enabled_ui(!facts.is_busy, |ui| fields_ui(ui, form, facts, commands));
    });
    section_ui(ui, "Preview");
    preview_ui(ui, form);
}

fn fields_ui(
    ui: &mut Ui,
    form: &mut ProtocolForm,
    facts: &ProtocolFacts<'_>,
    commands: &mut Commands,
) {
    text_ui(ui, "operator", &mut form.labels.operator);
    text_ui(ui, "specimen", &mut form.labels.specimen);
    text_ui(ui, "indenter", &mut form.labels.indenter);
    quantity_ui(ui, "speed", "mm/s", &mut form.speed);
    quantity_ui(ui, "depth", "mm from contact", &mut form.depth);
    quantity_ui(ui, "hold", "s", &mut form.hold);
    quantity_ui(ui, "end at", "% of tau known", &mut form.until);
    quantity_ui(ui, "unload", "mm/s, recorded", &mut form.unload);
    folder_ui(ui, form, facts, commands);
}

fn folder_ui(
    ui: &mut Ui,
    form: &mut ProtocolForm,
    facts: &ProtocolFacts<'_>,
    commands: &mut Commands,
) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.horizontal(|ui| {
        let label = form_label(ui, "sessions in");
        let hint = match facts.library {
            Ok(library) => library.as_str(),
            Err(_) => "choose a folder",
        };
        let width = ui.available_width() - 84.0;
        let input = TextEdit::singleline(&mut form.folder)
            .desired_width(width)
            .char_limit(4096)
            .hint_text(hint.to_owned());
        ui.add(input).labelled_by(label.id);
        let button = Button::new("Choose...");
        if ui.add_enabled(!facts.is_dialog_open, button).clicked() {
            commands.push(Command::Choose(Ask::NewSessions));
        }
    });
    if let (Err(reason), true) = (facts.library, form.folder.trim().is_empty()) {
        ui.label(RichText::new(reason).color(tokens.alarm_text).small());
    }
}

/// What the start strip says.
pub struct StartFacts<'a> {
    /// Whether a run is in progress or about to start.
    pub is_busy: bool,
    /// Whether the form may start a run, or why not.
    pub verdict: &'a Result<(), String>,
    /// Why the last start was refused.
    pub refusal: Option<&'a str>,
}

/// Draws the start strip, which never scrolls away: what to acknowledge, the button, why it cannot
/// be pressed, and the last refusal.
pub fn start_ui(
    ui: &mut Ui,
    form: &mut ProtocolForm,
    facts: &StartFacts<'_>,
    commands: &mut Commands,
) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    if !facts.is_busy {
        acknowledgement_ui(ui, form);
    }
    ui.horizontal(|ui| {
        if reason_button(ui, "Start  F5", vec2(104.0, 34.0), facts.verdict) {
            commands.push(Command::Start);
        }
    });
    if let Some(refusal) = facts.refusal {
        ui.label(RichText::new(format!("Not started: {refusal}")).color(tokens.alarm_text));
    }
}
