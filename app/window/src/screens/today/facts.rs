//! State of the rig, its daily check, the calibration in use, the disk, and the sessions of the day.

use super::TodayFacts;
use crate::command::{Commands, UiCommand};
use crate::screens::{calibration, checks, rig};
use crate::widgets::{
    NamedControl, alarm_ui, answer_ui, fact_ui, placeholder_ui, quiet_ui, section_ui,
};
use crate::workbench::Workbench;
use crate::workers::BackgroundTask;
use chrono::{DateTime, Local};
use eframe::egui::{Button, Ui, vec2};
use palpate_sessions::DataQuality;
use palpate_sessions::catalog::CatalogEntry;

/// Below this the disk is an alarm: an hour of a fast rig.
const FREE_BYTES_MIN: u64 = 2_000_000_000;

pub(super) fn facts_ui(
    ui: &mut Ui,
    workbench: &Workbench,
    facts: &BackgroundTask<TodayFacts>,
    commands: &mut Commands,
) {
    let snapshot = &workbench.snapshot;
    section_ui(ui, "Rig");
    fact_ui(ui, "rig", &snapshot.rig.description.name);
    match &snapshot.rig.link_error {
        Some(reason) => alarm_ui(ui, format!("Link lost: {reason}")),
        None => fact_ui(ui, "link", snapshot.rig.link.as_deref().unwrap_or("connected")),
    }
    let home = if snapshot.rig.is_homed { "known" } else { "not known; a run finds it first" };
    fact_ui(ui, "home", home);
    link_ui(ui, "Show the rig", rig::SCREEN.name, commands);
    section_ui(ui, "Calibration");
    let calibration = &workbench.bench.calibration;
    fact_ui(ui, "in use", &calibration.name);
    let (lightest, heaviest) = workbench.bench.curve.force_range();
    fact_ui(ui, "range", format!("{lightest:.2} to {heaviest:.2}"));
    link_ui(ui, "Show the calibrations", calibration::SCREEN.name, commands);
    let Some(facts) = answer_ui(ui, facts, "reading the library") else { return };
    section_ui(ui, "Daily check");
    match &facts.check {
        Some((check, true)) if check.is_passed => {
            fact_ui(ui, "result", format!("passed at {}", clock(check.at.into())));
        }
        Some((check, true)) => alarm_ui(ui, format!("failed today: {}", check.failures())),
        Some((check, false)) => {
            let day = check.at.with_timezone(&Local).format("%Y-%m-%d");
            placeholder_ui(ui, format!("not yet today; the last one was on {day}"));
        }
        None => placeholder_ui(ui, "this rig had none yet"),
    }
    facts.warnings.iter().for_each(|words| alarm_ui(ui, words));
    let words = "Run the daily check";
    let button = Button::new(words).min_size(vec2(150.0, 48.0));
    if ui.add_enabled(!workbench.is_busy(), button).named(words).clicked() {
        commands.push(UiCommand::CheckRig);
    }
    link_ui(ui, "Show the checks", checks::SCREEN.name, commands);
    section_ui(ui, "Disk");
    let free = format!("{:.1} GB free", facts.free_bytes as f64 * 1e-9);
    match facts.free_bytes < FREE_BYTES_MIN {
        true => alarm_ui(ui, format!("{free}; free some before a long run")),
        false => fact_ui(ui, "library", free),
    }
    section_ui(ui, "Measured today");
    if facts.sessions.is_empty() {
        placeholder_ui(ui, "nothing yet");
    }
    for session in &facts.sessions {
        session_ui(ui, session, workbench, commands);
    }
}

fn link_ui(ui: &mut Ui, words: &str, screen: &'static str, commands: &mut Commands) {
    if ui.add(Button::new(words).min_size(vec2(150.0, 30.0))).named(words).clicked() {
        commands.push(UiCommand::Show(screen));
    }
}

/// Time of the day by this computer's clock.
fn clock(at: DateTime<Local>) -> String {
    at.format("%H:%M").to_string()
}

fn session_ui(ui: &mut Ui, entry: &CatalogEntry, workbench: &Workbench, commands: &mut Commands) {
    let at = DateTime::parse_from_rfc3339(&entry.started_at);
    let at = at.map_or_else(|_| String::new(), |at| clock(at.into()));
    let specimen = if entry.specimen.is_empty() { "no specimen" } else { &entry.specimen };
    let name = format!("{at}  {specimen}, {}", entry.protocol);
    let button = Button::new(&name).min_size(vec2(ui.available_width(), 36.0)).truncate();
    if ui.add(button).named(&name).clicked()
        && let Ok(library) = &workbench.library
    {
        commands.push(UiCommand::Review(vec![library.join(&entry.folder)]));
    }
    match (entry.verdict, &entry.ending) {
        (Some(verdict @ (DataQuality::Rejected | DataQuality::Suspect)), _) => {
            quiet_ui(ui, format!("{verdict}: {}", entry.verdict_reason));
        }
        (_, None) => quiet_ui(ui, "not finished"),
        (verdict, Some(_)) => {
            quiet_ui(ui, verdict.map_or("no verdict", DataQuality::name));
        }
    }
}
