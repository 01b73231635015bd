//! How the loop does, and why there is no force.

use super::{HapticsCheck, HapticsScreen};
use crate::theme::Tokens;
use crate::widgets::fact_row::{fact_ui, section_ui};
use crate::widgets::loop_times::loop_times_ui;
use crate::widgets::remark::quiet_ui;
use crate::workers::haptic_loop::HapticLoop;
use eframe::egui::{Label, RichText, Ui};
use palpate_analysis::report::haptics::{margin_text, tried_text, why_less};

impl HapticsScreen {
    /// What is known.
    pub fn draw_right(&self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        if let Some(feel) = &self.feel {
            force_ui(ui, feel);
            loop_ui(ui, feel);
        }
        section_ui(ui, "Before play");
        match self.task.answer() {
            Some(Ok(looked)) => check_ui(ui, looked),
            Some(Err(_)) => {
                ui.label(RichText::new("the check failed").color(tokens.alarm_text));
            }
            None => {
                ui.label(RichText::new("nothing checked yet").color(tokens.text_quiet));
            }
        }
    }
}

fn force_ui(ui: &mut Ui, feel: &HapticLoop) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
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
        ui.label(RichText::new("nothing takes any away").color(tokens.text_quiet));
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
            let words =
                format!("buzzes at {:.0} Hz by {:.3} mm", buzz.frequency_hz, buzz.amplitude_mm);
            ui.label(RichText::new(words).strong().color(tokens.alarm_text));
        }
        None => {
            ui.label("no buzz");
        }
    }
    section_ui(ui, "Loop");
    let kept = feel.kept();
    fact_ui(ui, "wanted", format!("{:.0} ticks a second", feel.rate_hz()));
    fact_ui(ui, "priority", feel.priority());
    loop_times_ui(ui, kept);
}

fn check_ui(ui: &mut Ui, looked: &HapticsCheck) {
    for (index, sentence) in looked.checked.sentences.iter().enumerate() {
        let mut text = RichText::new(sentence);
        if index == 0 {
            text = text.strong();
        }
        ui.add(Label::new(text).wrap());
        ui.add_space(3.0);
    }
    section_ui(ui, "Simulated before play");
    for tried in &looked.checked.tried {
        ui.add(Label::new(tried_text(tried)).wrap());
        ui.add_space(3.0);
    }
    for note in &looked.notes {
        quiet_ui(ui, note);
    }
}
