//! Contact detection: force over position, and the result of each pass.

use crate::plots::figure::{PlacedPlot, PlotLook};
use crate::widgets::heading_ui;
use eframe::egui::Ui;
use palpate_analysis::report::live::{approach_plot, contact_search_plot};
use palpate_model::signal::LiveTrace;
use palpate_runner::RunView;
use std::sync::Arc;

/// The points of the newest search, converted when they change.
#[derive(Debug, Default)]
pub struct Approach {
    trace: Option<Arc<LiveTrace>>,
    plot: PlacedPlot,
}

impl Approach {
    /// Draws the search in the space there is.
    pub fn ui(&mut self, ui: &mut Ui, run: &RunView) {
        if !self.trace.as_ref().is_some_and(|old| Arc::ptr_eq(old, &run.approach)) {
            self.plot = approach_plot(&run.approach).into();
            self.trace = Some(Arc::clone(&run.approach));
        }
        heading_ui(ui, &self.plot.plot.title);
        for line in words(run) {
            ui.label(line);
        }
        let touches = PlacedPlot::from(contact_search_plot(run, &self.plot.plot));
        let shown = touches.plot.x.range;
        let look = PlotLook { shown, over: Some(&touches), ..PlotLook::default() };
        self.plot.ui(ui, "approach", look);
    }
}

/// The results in words, for a screen reader.
fn words(run: &RunView) -> Vec<String> {
    let mut words: Vec<String> = run
        .contact_triggers
        .iter()
        .map(|touch| format!("pass {}: {:.3} at {:.3}", touch.pass, touch.force, touch.position))
        .collect();
    words.push(match run.contact {
        Some(contact) => format!(
            "the contact point is at {:.3} ± {:.3} mm from home",
            contact.position.0, contact.std_error_mm
        ),
        None if run.contact_triggers.is_empty() => "no contact yet".into(),
        None => "the contact point is not known yet".into(),
    });
    words
}
