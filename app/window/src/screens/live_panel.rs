//! What is known of a run while it goes on: parameters, measured values, its steps.

use super::parameters::parameters_ui;
use super::rig_panel::sensors_ui;
use crate::widgets::{
    STEP_HEIGHT, StepState, fact_ui, placeholder_ui, quiet_ui, section_ui, step_ui,
};
use eframe::egui::{ScrollArea, Ui};
use palpate_analysis::report::live::LiveCycle;
use palpate_model::rig::Phase;
use palpate_protocols::engine::EndingKind;
use palpate_runner::{RigView, RunView};
use std::path::PathBuf;

/// Cycles listed; the session has them all.
const CYCLES_SHOWN: usize = 12;
/// Steps in sight at once, and those above the one that is under way.
const STEPS_SHOWN: usize = 14;
const STEPS_BEFORE: usize = 4;
/// Points between two of them.
const STEP_GAP: f32 = 2.0;

/// Draws what is known of a run so far.
pub fn findings_ui(ui: &mut Ui, rig: &RigView, run: Option<&RunView>, cycles: &[LiveCycle]) {
    if run.is_none_or(may_indent) {
        section_ui(ui, "Live parameters");
        parameters_ui(ui, run);
    }
    section_ui(ui, "Measured");
    match run {
        Some(run) => facts_ui(ui, run),
        None => {
            placeholder_ui(ui, "no run yet");
        }
    }
    sensors_ui(ui, rig);
    cycles_ui(ui, cycles);
    if let Some(run) = run {
        section_ui(ui, "Steps");
        steps_ui(ui, run);
    }
}

/// Whether a run presses into the specimen: others, such as a calibration or a search for the surface, have no
/// parameters to know.
pub(super) fn may_indent(run: &RunView) -> bool {
    use Phase::{Creep, Follow, Hold, Ramp, Sine};
    let presses = |phase: Phase| matches!(phase, Ramp | Hold | Creep | Sine | Follow);
    run.live.is_some() || run.steps.iter().any(|step| presses(step.phase))
}

/// Draws what a run measured.
pub(super) fn facts_ui(ui: &mut Ui, run: &RunView) {
    let not_yet = || "not yet".to_string();
    let peak = run.force_peak.map_or_else(not_yet, |peak| format!("{peak:.3}"));
    fact_ui(ui, "peak force", peak);
    let contact = run.contact.map_or_else(not_yet, |contact| {
        format!("{:.3} ± {:.3} mm", contact.position.0, contact.std_error_mm)
    });
    fact_ui(ui, "contact", contact);
    for (name, mm, error) in run.base.facts() {
        fact_ui(ui, name, format!("{mm:.3} ± {error:.3} mm"));
    }
    let tare = run.tare.map_or_else(not_yet, |tare| {
        format!("{:.4}, noise {:.2} mV", tare.volts, tare.noise.0 * 1e3)
    });
    fact_ui(ui, "tare", tare);
    fact_ui(ui, "samples", run.samples.to_string());
    fact_ui(ui, "saved", format!("through {:.1} s", run.saved_through.seconds().0));
}

/// The peak of every cycle and how far it is from the first; nothing where nothing is repeated.
pub(super) fn cycles_ui(ui: &mut Ui, cycles: &[LiveCycle]) {
    let Some(first) = cycles.first().and_then(|one| one.peak) else { return };
    section_ui(ui, "Peak force of each cycle and change from the first cycle");
    let left_out = cycles.len().saturating_sub(CYCLES_SHOWN);
    if left_out > 0 {
        let words =
            format!("the first {left_out} cycles are not listed here, but the session has them");
        quiet_ui(ui, words);
    }
    for one in cycles.iter().skip(left_out) {
        if let Some(peak) = one.peak {
            let change = match one.cycle {
                1 => String::new(),
                _ => format!(", {:+.1} %", 100.0 * (peak.force / first.force - 1.0)),
            };
            let words = format!("{:.3} N at {:.2} mm{change}", peak.force, peak.depth);
            fact_ui(ui, &format!("cycle {}", one.cycle), words);
        }
    }
}

/// Draws the steps; a list that is too long follows the step that is under way.
fn steps_ui(ui: &mut Ui, run: &RunView) {
    ui.spacing_mut().item_spacing.y = STEP_GAP;
    let is_running = run.outcome.is_none() && run.holding.is_none();
    let is_complete =
        run.outcome.as_ref().is_some_and(|outcome| outcome.ending == EndingKind::Finish);
    let rows = |ui: &mut Ui| {
        for (i, step) in run.steps.iter().enumerate() {
            let state = StepState::of(i, run.step_index, is_running, is_complete);
            step_ui(ui, step.phase.name(), step.expected.0, state);
        }
    };
    if run.steps.len() <= STEPS_SHOWN {
        return rows(ui);
    }
    let pitch = STEP_HEIGHT + STEP_GAP;
    let height = STEPS_SHOWN as f32 * pitch;
    let area = ScrollArea::vertical().id_salt("steps").max_height(height);
    let mut area = area.min_scrolled_height(height);
    // Only once for each step, so that whoever scrolls in it is left there.
    let id = ui.scope_id().with("step shown");
    let shown = (run.folder.clone(), run.step_index);
    if ui.data(|data| data.get_temp::<(PathBuf, usize)>(id)).as_ref() != Some(&shown) {
        let first = run.step_index.saturating_sub(STEPS_BEFORE);
        area = area.vertical_scroll_offset(first as f32 * pitch);
        ui.data_mut(|data| data.insert_temp(id, shown));
    }
    area.show(ui, rows);
}
