//! Force, stability margin and timing of the loop.

use super::{HapticsCheck, HapticsScreen};
use crate::theme::Tokens;
use crate::widgets::{
    alarm_ui, fact_ui, loop_times_ui, placeholder_ui, quiet_ui, section_ui, sentences_ui,
};
use crate::workers::haptic_loop::HapticLoop;
use eframe::egui::{Label, RichText, Ui};
use palpate_analysis::report::haptics::{margin_text, tried_text, why_less};

impl HapticsScreen {
    pub fn draw_right(&self, ui: &mut Ui) {
        if let Some(feel) = &self.feel {
            force_ui(ui, feel);
            loop_ui(ui, feel);
        }
        section_ui(ui, "Before play");
        match self.task.answer() {
            Some(Ok(check)) => check_ui(ui, check),
            Some(Err(_)) => alarm_ui(ui, "the check failed"),
            None => placeholder_ui(ui, "nothing checked yet"),
        }
    }
}

fn force_ui(ui: &mut Ui, feel: &HapticLoop) {
    let seen = &feel.last().snapshot;
    section_ui(ui, "Force");
    let now = format!("{:.2} N at {:.2} mm", seen.force.0, seen.depth.0);
    ui.label(RichText::new(now).heading().monospace());
    fact_ui(ui, "model", format!("{:.2} N", seen.model.0));
    fact_ui(ui, "torque", format!("{:.1} N mm", seen.torque));
    fact_ui(ui, "winding", format!("{:.0} °C", seen.winding_c));
    section_ui(ui, "Why no force?");
    if !feel.is_running() {
        ui.label("the loop does not run");
        return;
    }
    let causes = why_less(feel.flags(), feel.missed());
    if causes.is_empty() {
        placeholder_ui(ui, "nothing reduces it");
    }
    for cause in causes {
        ui.add(Label::new(cause).wrap());
    }
}

fn loop_ui(ui: &mut Ui, feel: &HapticLoop) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let seen = &feel.last().snapshot;
    section_ui(ui, "Margin and guard");
    ui.add(Label::new(margin_text(&seen.margin)).wrap());
    fact_ui(ui, "added", format!("{:.2} N s/m of damping", 1e3 * seen.damping));
    fact_ui(ui, "energy", format!("{:.2} mJ absorbed", seen.energy));
    match &seen.buzz {
        Some(buzz) => {
            let words = format!(
                "limit cycle at {:.0} Hz with {:.3} mm",
                buzz.frequency_hz, buzz.amplitude_mm
            );
            ui.label(RichText::new(words).strong().color(tokens.alarm_text));
        }
        None => {
            ui.label("no limit cycle");
        }
    }
    section_ui(ui, "Loop");
    fact_ui(ui, "target", format!("{:.0} ticks a second", feel.rate_hz()));
    fact_ui(ui, "priority", feel.priority());
    loop_times_ui(ui, feel.kept());
}

fn check_ui(ui: &mut Ui, check: &HapticsCheck) {
    sentences_ui(ui, &check.checked.sentences);
    section_ui(ui, "Simulated before play");
    for tried in &check.checked.tried {
        ui.add(Label::new(tried_text(tried)).wrap());
        ui.add_space(3.0);
    }
    for note in &check.notes {
        quiet_ui(ui, note);
    }
}
