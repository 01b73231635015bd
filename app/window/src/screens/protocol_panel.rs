//! The protocol that was chosen: its parameters, what it asks for, where sessions go; and the start.

use super::form::{LabelField, ParamField, ProtocolForm};
use super::preview_view::{acknowledgement_ui, preview_ui};
use super::run_panes::RunPane;
use crate::command::{CommandQueue, UserCommand};
use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::places::NamedControl;
use crate::widgets::quantity_input::form_label;
use crate::widgets::reason_button::reason_button;
use crate::widgets::remark::quiet_ui;
use crate::widgets::tick_box::tick_box;
use crate::workers::path_dialog::PathPurpose;
use eframe::egui::{Align2, Button, CollapsingHeader, Label, RichText, TextEdit, Ui, vec2};
use palpate_protocols::file::{Kind, What};

/// What the panel must know beside the form.
pub struct ProtocolFacts<'a> {
    /// Whether a run is in progress or about to start: the form then shows what runs.
    pub is_busy: bool,
    /// Where sessions go if no folder is chosen, or why nowhere.
    pub library: &'a Result<String, String>,
    /// What was recovered of sessions that a crash left unfinished, a line each.
    pub recovered: &'a [String],
    /// Whether the folder dialog is open.
    pub is_dialog_open: bool,
}

/// Opacity of locked fields; enough contrast is left to read their values.
const LOCKED_ALPHA: f32 = 0.8;

/// Things to tell that every session has a field for; the others are folded away until asked for.
const ALWAYS: [&str; 3] = ["operator", "specimen", "indenter"];

/// Draws the form and the preview.
pub fn protocol_ui(
    ui: &mut Ui,
    form: &mut ProtocolForm,
    facts: &ProtocolFacts<'_>,
    commands: &mut CommandQueue,
) {
    head_ui(ui, form, facts, commands);
    ui.scope(|ui| {
        // Locked while a run goes on, but still to be read: it says what is running.
        ui.visuals_mut().disabled_alpha = LOCKED_ALPHA;
        ui.add_enabled_ui(!facts.is_busy, |ui| {
            for field in form.told.iter_mut().filter(|one| is_shown(one)) {
                one_told_ui(ui, field);
            }
            for field in &mut form.fields {
                parameter_ui(ui, field);
            }
            more_told_ui(ui, &mut form.told);
            folder_ui(ui, form, facts, commands);
        });
    });
    section_ui(ui, "Preview");
    preview_ui(ui, form);
}

fn head_ui(
    ui: &mut Ui,
    form: &ProtocolForm,
    facts: &ProtocolFacts<'_>,
    commands: &mut CommandQueue,
) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let title = match (&form.protocol, &form.file) {
        (Ok(protocol), _) => protocol.title.clone(),
        (Err(_), Some(file)) => file.display().to_string(),
        (Err(_), None) => "No protocol".into(),
    };
    section_ui(ui, &title);
    if let Ok(protocol) = &form.protocol {
        let about = RichText::new(&protocol.about).color(tokens.text_quiet).small();
        ui.add(Label::new(about).wrap()).on_hover_text(&protocol.source);
    }
    let button = Button::new("Change protocol...");
    if ui.add_enabled(!facts.is_busy, button).clicked() {
        commands.push(UserCommand::View(RunPane::Choose));
    }
}

fn parameter_ui(ui: &mut Ui, field: &mut ParamField) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let hint = field.hint();
    if field.parameter.kind == Kind::Flag {
        let mut is_on = field.text == "true";
        let tick = tick_box(ui, &mut is_on, field.parameter.name.as_str());
        if tick.on_hover_text(hint).changed() {
            field.text = is_on.to_string();
        }
        return;
    }
    let is_wide = field.parameter.is_list || field.parameter.kind == Kind::Text;
    let is_focused = ui
        .horizontal(|ui| {
            let label = form_label(ui, &field.parameter.name).on_hover_text(&hint);
            let input = TextEdit::singleline(&mut field.text).char_limit(400);
            let input = if is_wide {
                input.desired_width(ui.available_width() - 10.0)
            } else {
                input.desired_width(76.0).align(Align2::RIGHT_CENTER)
            };
            let is_left_out = field.parameter.default.what == What::None;
            let input = if is_left_out { input.hint_text("none") } else { input };
            let input = ui
                .add(input)
                .labelled_by(label.id)
                .named(&field.parameter.name)
                .on_hover_text(&hint);
            if !is_wide {
                ui.label(RichText::new(field.unit_beside()).color(tokens.text_quiet));
            }
            input.has_focus()
        })
        .inner;
    if is_focused {
        quiet_ui(ui, &hint);
    }
    if let Err(reason) = &field.value {
        ui.label(RichText::new(reason).color(tokens.alarm_text).small());
    }
}

/// Whether it stands in the form: it always does, or the protocol asks for it.
fn is_shown(field: &LabelField) -> bool {
    field.is_asked || ALWAYS.contains(&field.key.name)
}

/// What else can be told, folded away.
fn more_told_ui(ui: &mut Ui, told: &mut [LabelField]) {
    let is_told = |one: &LabelField| !is_shown(one) && !one.text.is_empty();
    let count = told.iter().filter(|one| is_told(one)).count();
    let title = match count {
        0 => "More about specimen, probe and series".into(),
        count => format!("More about specimen, probe and series ({count} told)"),
    };
    CollapsingHeader::new(title).id_salt("more_told").show(ui, |ui| {
        for field in told.iter_mut().filter(|one| !is_shown(one)) {
            one_told_ui(ui, field);
        }
    });
}

fn one_told_ui(ui: &mut Ui, field: &mut LabelField) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    ui.horizontal(|ui| {
        let label = if ALWAYS.contains(&field.key.name) {
            form_label(ui, field.key.name)
        } else {
            ui.label(field.key.name)
        };
        let width = ui.available_width() - 10.0;
        let input = TextEdit::singleline(&mut field.text).desired_width(width).char_limit(200);
        let input = match field.is_asked {
            true => input.hint_text("asked for"),
            false => input,
        };
        ui.add(input).labelled_by(label.id).named(field.key.name).on_hover_text(field.key.meaning);
    });
    if let Some(reason) = &field.error {
        ui.label(RichText::new(reason).color(tokens.alarm_text).small());
    }
}
fn folder_ui(
    ui: &mut Ui,
    form: &mut ProtocolForm,
    facts: &ProtocolFacts<'_>,
    commands: &mut CommandQueue,
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
        ui.add(input).labelled_by(label.id).named("sessions in");
        let button = Button::new("Choose...");
        if ui.add_enabled(!facts.is_dialog_open, button).clicked() {
            commands.push(UserCommand::Choose(PathPurpose::NewSessions));
        }
    });
    if let (Err(reason), true) = (facts.library, form.folder.trim().is_empty()) {
        ui.label(RichText::new(reason).color(tokens.alarm_text).small());
    }
    if !facts.recovered.is_empty() {
        ui.label("Recovered after a crash");
        for line in facts.recovered {
            ui.add(Label::new(RichText::new(line).small()).wrap());
        }
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
    /// Whether the link to the rig is lost.
    pub is_link_lost: bool,
}

/// Draws the start strip, which never scrolls away: what to acknowledge, the button, why it cannot
/// be pressed, and the last refusal.
pub fn start_ui(
    ui: &mut Ui,
    form: &mut ProtocolForm,
    facts: &StartFacts<'_>,
    commands: &mut CommandQueue,
) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    if !facts.is_busy {
        acknowledgement_ui(ui, form);
    }
    ui.horizontal(|ui| {
        if reason_button(ui, "Start  F5", vec2(104.0, 34.0), facts.verdict) {
            commands.push(UserCommand::Start);
        }
    });
    if facts.is_link_lost {
        let hint = "opens the devices again and stops the axis; nothing moves, and position zero has to be found again";
        let button = ui.add_enabled(!facts.is_busy, Button::new("Connect again"));
        if button.on_hover_text(hint).clicked() {
            commands.push(UserCommand::Reconnect);
        }
    }
    if let Some(refusal) = facts.refusal {
        ui.label(RichText::new(format!("Not started: {refusal}")).color(tokens.alarm_text));
    }
}
