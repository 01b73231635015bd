//! How a loop keeps its time, as a table.

use super::text::{fact_ui, tokens_of};
use eframe::egui::{Grid, RichText, Ui};
use palpate_model::units::Seconds;
use palpate_runner::haptics::timing::LoopTiming;

/// Draws overruns, and the percentiles of period, lateness and work.
pub fn loop_times_ui(ui: &mut Ui, timing: &LoopTiming) {
    let tokens = tokens_of(ui);
    fact_ui(ui, "overruns", format!("{}; {} ticks missed", timing.overruns, timing.missed));
    let micros = |time: Seconds| format!("{:.0}", 1e6 * time.0);
    Grid::new("loop_times").striped(true).show(ui, |ui| {
        for head in ["in µs", "p50", "p99", "p99.9", "max"] {
            ui.label(RichText::new(head).color(tokens.text_quiet).small());
        }
        ui.end_row();
        for (name, spread) in
            [("period", &timing.period), ("late", &timing.late), ("compute", &timing.work)]
        {
            ui.label(name);
            for time in [spread.p50, spread.p99, spread.p99_9, spread.max] {
                ui.label(micros(time));
            }
            ui.end_row();
        }
    });
}
