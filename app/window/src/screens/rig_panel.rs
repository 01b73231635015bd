//! Identity and status of the rig, and the serial ports of this computer.

use crate::command::{Commands, UiCommand};
use crate::widgets::{alarm_ui, answer_ui, fact_ui, section_ui, tokens_of};
use crate::workers::BackgroundTask;
use eframe::egui::{Button, RichText, Ui};
use palpate_drivers::serial::PortInfo;
use palpate_model::rig::command::position_from_pulses;
use palpate_model::rig::{AxisStatus, Reading};
use palpate_runner::{RigView, RunnerSnapshot};

pub fn rig_ui(
    ui: &mut Ui,
    snapshot: &RunnerSnapshot,
    ports: &BackgroundTask<Vec<PortInfo>>,
    commands: &mut Commands,
) {
    let rig = &snapshot.rig;
    section_ui(ui, &format!("Rig {}", rig.description.name));
    fact_ui(ui, "identity", &rig.description.identity);
    let settings: Vec<String> =
        rig.description.settings.iter().map(|(name, value)| format!("{name} {value}")).collect();
    if !settings.is_empty() {
        fact_ui(ui, "settings", settings.join(", "));
    }
    match &rig.link_error {
        Some(reason) => alarm_ui(ui, format!("Link lost: {reason}")),
        None => fact_ui(ui, "link", rig.link.as_deref().unwrap_or("connected")),
    }
    match rig.reading {
        Some(reading) => reading_ui(ui, rig, &reading),
        None => fact_ui(ui, "signal", "no sample yet"),
    }
    sensors_ui(ui, rig);
    ports_ui(ui, ports, commands);
}

/// Draws the newest value of every sensor beside load cell and axis; nothing where there is none.
pub fn sensors_ui(ui: &mut Ui, rig: &RigView) {
    let facts = rig.sensor_facts();
    if !facts.is_empty() {
        section_ui(ui, "Sensors");
    }
    for fact in facts {
        fact_ui(ui, &fact.name, fact.words());
    }
}

fn reading_ui(ui: &mut Ui, rig: &RigView, reading: &Reading) {
    let counts = reading.counts.map_or(String::new(), |counts| format!("  ({counts} counts)"));
    fact_ui(ui, "signal", format!("{:.4}{counts}", reading.volts));
    let position = position_from_pulses(reading.pulses, rig.description.mm_per_pulse);
    let place = if rig.is_homed { format!("{position:.3} from home") } else { "not homed".into() };
    fact_ui(ui, "position", place);
    fact_ui(ui, "counter", format!("{} pulses", reading.pulses));
    fact_ui(ui, "axis", axis_words(reading.status));
}

/// The axis in words.
fn axis_words(status: AxisStatus) -> String {
    let motor = if status.has(AxisStatus::MOTOR_ON) { "motor on" } else { "motor off" };
    let motion = match (status.has(AxisStatus::MOVING), status.has(AxisStatus::STOPPING)) {
        (true, true) => "braking",
        (true, false) => "moving",
        _ => "at rest",
    };
    let mut words = vec![motor, motion];
    for (bit, word) in [
        (AxisStatus::HOME, "on the home switch"),
        (AxisStatus::FORWARD_LIMIT, "at the far limit switch"),
        (AxisStatus::REVERSE_LIMIT, "at the limit switch behind home"),
    ] {
        if status.has(bit) {
            words.push(word);
        }
    }
    words.join(", ")
}

fn ports_ui(ui: &mut Ui, ports: &BackgroundTask<Vec<PortInfo>>, commands: &mut Commands) {
    let tokens = tokens_of(ui);
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Serial ports found").color(tokens.text_quiet));
        let button = Button::new("Refresh").small();
        if ui.add_enabled(!ports.is_busy(), button).clicked() {
            commands.push(UiCommand::ListPorts);
        }
    });
    let Some(found) = answer_ui(ui, ports, "listing them") else { return };
    if found.is_empty() {
        ui.label("none on this computer");
    }
    for port in found {
        ui.label(format!("{}  {}", port.name, port.description));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_status_has_words() {
        assert_eq!(axis_words(AxisStatus::default()), "motor off, at rest");
        assert_eq!(
            axis_words(AxisStatus::MOTOR_ON | AxisStatus::MOVING | AxisStatus::STOPPING),
            "motor on, braking"
        );
        assert_eq!(
            axis_words(AxisStatus::MOTOR_ON | AxisStatus::HOME),
            "motor on, at rest, on the home switch"
        );
    }
}
