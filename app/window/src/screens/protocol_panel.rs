//! The protocol that is chosen: its parameters, labels of the session, the folder of sessions; and the start.

use super::form::{LabelField, ParamField, ProtocolForm};
use super::preview_view::{acknowledgement_ui, preview_ui};
use super::run_panes::RunPane;
use crate::command::{Commands, UiCommand};
use crate::widgets::{
    NamedControl, alarm_ui, form_label, quiet_ui, reason_button, section_ui, select_on_entry,
    small_alarm_ui, small_ui, tick_box, tokens_of,
};
use crate::workbench::Workbench;
use crate::workers::PathPurpose;
use eframe::egui::{Align2, Button, CollapsingHeader, Label, RichText, TextEdit, Ui, vec2};
use palpate_protocols::file::{QuantityKind, ValueContent};

/// What the panel needs from the run screen.
pub struct ProtocolFacts<'a> {
    /// Where sessions go if no folder is chosen, or why there is none.
    pub library: &'a Result<String, String>,
    /// Sessions that were recovered after a crash, a line each.
    pub recovered: &'a [String],
}

/// Opacity of locked fields; enough contrast is left to read their values.
const LOCKED_ALPHA: f32 = 0.8;

/// Labels that every session has a field for; the others are folded away until a protocol requires them.
const ALWAYS: [&str; 3] = ["operator", "specimen", "indenter"];

/// Draws the form and the preview.
pub fn protocol_ui(
    ui: &mut Ui,
    workbench: &mut Workbench,
    facts: &ProtocolFacts<'_>,
    commands: &mut Commands,
) {
    let is_busy = workbench.is_busy();
    let is_dialog_open = workbench.dialog.is_open();
    let form = &mut workbench.form;
    head_ui(ui, form);
    if ui.add_enabled(!is_busy, Button::new("Change protocol...")).clicked() {
        commands.push(UiCommand::View(RunPane::Choose));
    }
    ui.scope(|ui| {
        // Locked during a run, but still readable: it says what is running.
        ui.visuals_mut().disabled_alpha = LOCKED_ALPHA;
        ui.add_enabled_ui(!is_busy, |ui| {
            let is_blinded = form.is_blinded;
            let shown = form.label_fields.iter_mut();
            for field in shown.filter(|one| is_shown(one) && !is_hidden(one, is_blinded)) {
                label_ui(ui, field);
            }
            if form.is_locked {
                quiet_ui(ui, "This protocol is locked: its values cannot be changed.");
            }
            ui.add_enabled_ui(!form.is_locked, |ui| {
                for field in &mut form.fields {
                    parameter_ui(ui, field);
                }
            });
            if is_blinded {
                quiet_ui(
                    ui,
                    "The queue is blinded: labels of this specimen are hidden, and recorded.",
                );
            } else {
                more_labels_ui(ui, &mut form.label_fields);
            }
            folder_ui(ui, &mut form.folder, facts, is_dialog_open, commands);
        });
    });
    section_ui(ui, "Preview");
    preview_ui(ui, form);
}

fn head_ui(ui: &mut Ui, form: &ProtocolForm) {
    match (&form.protocol, &form.file) {
        (Ok(protocol), _) => {
            section_ui(ui, &protocol.title);
            let ink = tokens_of(ui).text_quiet;
            let about = RichText::new(&protocol.about).color(ink).small();
            ui.add(Label::new(about).wrap()).on_hover_text(&protocol.source);
        }
        (Err(_), Some(file)) => section_ui(ui, &file.display().to_string()),
        (Err(_), None) => section_ui(ui, "No protocol"),
    }
}

fn parameter_ui(ui: &mut Ui, field: &mut ParamField) {
    let tokens = tokens_of(ui);
    let hint = field.hint();
    if field.parameter.kind == QuantityKind::Flag {
        let mut is_on = field.text == "true";
        let tick = tick_box(ui, &mut is_on, field.parameter.name.as_str());
        if tick.on_hover_text(hint).changed() {
            field.text = is_on.to_string();
        }
        if let Some(reason) = &field.objection {
            small_alarm_ui(ui, reason);
        }
        return;
    }
    let is_wide = field.parameter.is_list || field.parameter.kind == QuantityKind::Text;
    let is_focused = ui
        .horizontal(|ui| {
            let label = form_label(ui, &field.parameter.name).on_hover_text(&hint);
            let input = TextEdit::singleline(&mut field.text).char_limit(400);
            let input = if is_wide {
                input.desired_width(ui.available_width() - 10.0)
            } else {
                input.desired_width(76.0).align(Align2::RIGHT_CENTER)
            };
            let is_optional = field.parameter.default.content == ValueContent::None;
            let input = ui.add(input.hint_text(if is_optional { "none" } else { "" }));
            select_on_entry(&input, &field.text);
            let input = input.labelled_by(label.id).named(&field.parameter.name);
            let input = input.on_hover_text(&hint);
            if !is_wide {
                ui.label(RichText::new(field.shown_unit()).color(tokens.text_quiet));
            }
            input.has_focus()
        })
        .inner;
    if is_focused {
        quiet_ui(ui, &hint);
    }
    if let Some(reason) = field.value.as_ref().err().or(field.objection.as_ref()) {
        small_alarm_ui(ui, reason);
    }
}

fn is_shown(field: &LabelField) -> bool {
    field.is_required || ALWAYS.contains(&field.key.name)
}

/// Whether a label would tell a blinded operator which group a specimen is of.
fn is_hidden(field: &LabelField, is_blinded: bool) -> bool {
    is_blinded && field.key.describes_specimen()
}

/// The other labels, folded away.
fn more_labels_ui(ui: &mut Ui, fields: &mut [LabelField]) {
    let is_filled = |one: &&LabelField| !is_shown(one) && !one.text.is_empty();
    let title = match fields.iter().filter(is_filled).count() {
        0 => "More about specimen, probe and series".into(),
        count => format!("More about specimen, probe and series ({count} filled in)"),
    };
    CollapsingHeader::new(title).id_salt("more_labels").show(ui, |ui| {
        for field in fields.iter_mut().filter(|one| !is_shown(one)) {
            label_ui(ui, field);
        }
    });
}

fn label_ui(ui: &mut Ui, field: &mut LabelField) {
    ui.horizontal(|ui| {
        let label = if ALWAYS.contains(&field.key.name) {
            form_label(ui, field.key.name)
        } else {
            ui.label(field.key.name)
        };
        let width = ui.available_width() - 10.0;
        let hint = if field.is_required { "required" } else { "" };
        let input = TextEdit::singleline(&mut field.text).desired_width(width).char_limit(200);
        let input = ui.add(input.hint_text(hint)).labelled_by(label.id).named(field.key.name);
        input.on_hover_text(field.key.meaning);
    });
    if let Some(reason) = &field.error {
        small_alarm_ui(ui, reason);
    }
}

fn folder_ui(
    ui: &mut Ui,
    folder: &mut String,
    facts: &ProtocolFacts<'_>,
    is_dialog_open: bool,
    commands: &mut Commands,
) {
    ui.horizontal(|ui| {
        let label = form_label(ui, "sessions in");
        let hint = facts.library.as_deref().unwrap_or("choose a folder");
        let width = ui.available_width() - 84.0;
        let input = TextEdit::singleline(folder).desired_width(width).char_limit(4096);
        ui.add(input.hint_text(hint)).labelled_by(label.id).named("sessions in");
        if ui.add_enabled(!is_dialog_open, Button::new("Choose...")).clicked() {
            commands.push(UiCommand::Choose(PathPurpose::NewSessions));
        }
    });
    if let (Err(reason), true) = (facts.library, folder.trim().is_empty()) {
        small_alarm_ui(ui, reason);
    }
    if !facts.recovered.is_empty() {
        ui.label("Recovered after a crash");
        facts.recovered.iter().for_each(|line| small_ui(ui, line));
    }
}

/// Draws the start strip, which never scrolls away: what to acknowledge, the button and why it is closed, and the last
/// refusal.
pub fn start_ui(ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
    let (is_busy, verdict) = (workbench.is_busy(), workbench.start_verdict());
    if !is_busy {
        acknowledgement_ui(ui, &mut workbench.form);
    }
    ui.horizontal(|ui| {
        if reason_button(ui, "Start  F5", vec2(104.0, 34.0), &verdict) {
            commands.push(UiCommand::Start);
        }
    });
    if workbench.snapshot.rig.link_error.is_some() {
        let hint = "reconnects the devices and stops the axis if it moves; it starts no motion, and the axis must be homed again afterwards";
        let button = ui.add_enabled(!is_busy, Button::new("Connect again"));
        if button.on_hover_text(hint).clicked() {
            commands.push(UiCommand::Reconnect);
        }
    }
    if let Some(notice) = &workbench.notice {
        alarm_ui(ui, notice);
    }
    if let Some(refusal) = &workbench.refusal {
        alarm_ui(ui, format!("Not started: {refusal}"));
    }
}
