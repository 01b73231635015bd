//! Force, stability margin and timing of the loop.

use super::{HapticsCheck, HapticsScreen};
use crate::widgets::{
    alarm_ui, fact_ui, loop_times_ui, placeholder_ui, quiet_ui, section_ui, sentences_ui, tokens_of,
};
use crate::workers::haptic_loop::HapticLoop;
use eframe::egui::{Label, RichText, Ui};
use palpate_analysis::report::haptics::{force_loss_reasons, margin_text, tried_text};

impl HapticsScreen {
    pub fn draw_right(&self, ui: &mut Ui) {
        if let Some(live_loop) = &self.live_loop {
            force_ui(ui, live_loop);
            loop_ui(ui, live_loop);
        }
        section_ui(ui, "Before play");
        match self.task.answer() {
            Some(Ok(check)) => check_ui(ui, check),
            Some(Err(_)) => alarm_ui(ui, "the check failed"),
            None => placeholder_ui(ui, "nothing checked yet"),
        }
    }
}

fn force_ui(ui: &mut Ui, live_loop: &HapticLoop) {
    let seen = &live_loop.last().snapshot;
    section_ui(ui, "Force");
    let now = format!("{:.2} N at {:.2} mm", seen.force.0, seen.depth.0);
    ui.label(RichText::new(now).heading().monospace());
    fact_ui(ui, "model", format!("{:.2} N", seen.model.0));
    fact_ui(ui, "torque", format!("{:.1} N mm", seen.torque));
    fact_ui(ui, "winding", format!("{:.0} °C", seen.winding_c));
    section_ui(ui, "Why no force?");
    if !live_loop.is_running() {
        ui.label("the loop is not running");
        return;
    }
    let causes = force_loss_reasons(live_loop.flags(), live_loop.missed());
    if causes.is_empty() {
        placeholder_ui(ui, "nothing reduces it");
    }
    for cause in causes {
        ui.add(Label::new(cause).wrap());
    }
}

fn loop_ui(ui: &mut Ui, live_loop: &HapticLoop) {
    let tokens = tokens_of(ui);
    let seen = &live_loop.last().snapshot;
    section_ui(ui, "Margin and guard");
    ui.add(Label::new(margin_text(&seen.margin)).wrap());
    fact_ui(ui, "added", format!("{:.2} N s/m of damping", 1e3 * seen.damping));
    fact_ui(ui, "energy", format!("{:.2} mJ absorbed", seen.energy));
    match &seen.buzz {
        Some(buzz) => {
            let words = format!(
                "limit cycle at {:.0} Hz, amplitude {:.3} mm",
                buzz.frequency_hz, buzz.amplitude_mm
            );
            ui.label(RichText::new(words).strong().color(tokens.alarm_text));
        }
        None => {
            ui.label("no limit cycle");
        }
    }
    section_ui(ui, "Loop");
    fact_ui(ui, "target", format!("{:.0} ticks a second", live_loop.rate_hz()));
    fact_ui(ui, "priority", live_loop.priority());
    loop_times_ui(ui, live_loop.kept());
}

fn check_ui(ui: &mut Ui, check: &HapticsCheck) {
    sentences_ui(ui, &check.checked.sentences);
    section_ui(ui, "Simulated before play");
    for tried in &check.checked.trials {
        ui.add(Label::new(tried_text(tried)).wrap());
        ui.add_space(3.0);
    }
    for note in &check.notes {
        quiet_ui(ui, note);
    }
}
