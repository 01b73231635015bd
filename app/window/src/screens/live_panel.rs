//! What is known of a run while it goes on: parameters, measured values, its steps.

use super::parameters::parameters_ui;
use crate::widgets::{StepState, fact_ui, placeholder_ui, quiet_ui, section_ui, step_ui};
use eframe::egui::Ui;
use palpate_analysis::report::live::LiveCycle;
use palpate_protocols::engine::EndingKind;
use palpate_runner::RunView;

/// Cycles listed; the session has them all.
const CYCLES_SHOWN: usize = 12;

/// Draws what is known of a run so far.
pub fn findings_ui(ui: &mut Ui, run: Option<&RunView>, cycles: &[LiveCycle]) {
    section_ui(ui, "Live parameters");
    parameters_ui(ui, run);
    section_ui(ui, "Measured");
    match run {
        Some(run) => facts_ui(ui, run),
        None => {
            placeholder_ui(ui, "no run yet");
        }
    }
    cycles_ui(ui, cycles);
    if let Some(run) = run {
        section_ui(ui, "Steps");
        steps_ui(ui, run);
    }
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

fn steps_ui(ui: &mut Ui, run: &RunView) {
    ui.spacing_mut().item_spacing.y = 2.0;
    let is_running = run.outcome.is_none() && run.holding.is_none();
    let is_complete =
        run.outcome.as_ref().is_some_and(|outcome| outcome.ending == EndingKind::Finish);
    for (i, step) in run.steps.iter().enumerate() {
        let state = StepState::of(i, run.step_index, is_running, is_complete);
        step_ui(ui, step.phase.name(), step.expected.0, state);
    }
}
