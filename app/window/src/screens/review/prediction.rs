//! The fit of the session in front, applied to the depths of the next one and compared with its measured force.

use super::ReviewScreen;
use super::middle::head_ui;
use super::session_list::color_of;
use super::side_by_side::fitted_ink;
use crate::plots::navigate::AxisRange;
use crate::plots::over_time::{TimeBackdrop, TimeLayer, TimePanel, over_time_ui};
use crate::plots::stretches::LineWindow;
use crate::plots::stretches::{FIT_WIDTH, WIDTH};
use crate::widgets::{alarm_ui, quiet_ui, require, task_ui, tokens_of};
use crate::workers::review::Quantity;
use crate::workers::review::fit::{MODELLED, RESIDUAL, SessionPrediction, predict};
use eframe::egui::{Ui, vec2};

impl ReviewScreen {
    fn prediction_verdict(&self) -> Result<(), String> {
        let words = "show two sessions: the first is fitted, the second is predicted";
        require(self.subjects.len() > 1, words)?;
        self.fit_verdict()
    }

    pub(super) fn prediction_ui(&mut self, ui: &mut Ui) {
        let words = match self.subjects.as_slice() {
            [known, other, ..] => {
                format!("the fit of {} predicts the force of {}", known.name, other.name)
            }
            _ => String::new(),
        };
        head_ui(ui, "Prediction against validation", &words);
        let verdict = self.prediction_verdict();
        if task_ui(ui, "Predict second session", &self.prediction, &verdict)
            && let [known, other, ..] = self.subjects.as_slice()
        {
            let pair = [known, other].map(|one| one.for_fit(&self.model));
            self.prediction_of = Some([known.name.clone(), other.name.clone()]);
            self.prediction
                .start("review-predict", ui.ctx(), move |progress| predict(&pair, progress));
        }
        let (found, [known, other]) = match (self.prediction.answer(), &self.prediction_of) {
            (Some(Ok(found)), Some(names)) => (found.clone(), names.clone()),
            (Some(Err(reason)), _) => return alarm_ui(ui, reason),
            _ => return,
        };
        ui.label(sentence(&found, &known, &other));
        quiet_ui(ui, "colour: measured; thin line: predicted");
        let Some(index) = self.subjects.iter().position(|one| one.name == other) else {
            return quiet_ui(
                ui,
                format!("{other} is no longer shown, so its plots are missing here"),
            );
        };
        self.prediction_plots(ui, &found, index);
    }

    fn prediction_plots(&mut self, ui: &mut Ui, found: &SessionPrediction, index: usize) {
        let tokens = tokens_of(ui);
        let Some(whole) = found.track.span() else { return };
        let mut span = AxisRange::default();
        span.set_whole(whole);
        let window = LineWindow {
            window: whole,
            pixels: f64::from(ui.available_width() * ui.ctx().pixels_per_point()).round(),
            shift: 0.0,
            // Differs between two predictions.
            version: found.rms_n.to_bits() ^ found.samples as u64,
        };
        let [modelled, residual] = &mut self.prediction_lines;
        modelled.update(&found.track, MODELLED, window);
        residual.update(&found.track, RESIDUAL, window);
        let subject = &mut self.subjects[index];
        subject
            .update(Quantity::Force, LineWindow { version: subject.recording.version, ..window });
        let (width, height) = (ui.available_width(), ui.available_height());
        let color = color_of(tokens, subject);
        let layer = |name, color, stretches| TimeLayer { name, color, width: WIDTH, stretches };
        let measured = layer("measured", color, &subject.lines[Quantity::Force as usize]);
        let force = TimePanel {
            id: "Predicted force",
            axis: Quantity::Force.axis(),
            layers: vec![
                measured,
                TimeLayer {
                    width: FIT_WIDTH,
                    ..layer("predicted", fitted_ink(tokens, color), modelled)
                },
            ],
            has_zero: false,
        };
        let residual = TimePanel {
            id: "Prediction residual",
            axis: "measured - predicted (mN)",
            layers: vec![layer("residual", color, residual)],
            has_zero: true,
        };
        let time = Some("time from session start (s)");
        for (panel, share, axis) in [(force, 0.62, None), (residual, 0.36, time)] {
            ui.allocate_ui(vec2(width, share * height), |ui| {
                let _ = over_time_ui(ui, &panel, &span, &TimeBackdrop::default(), axis);
            });
        }
    }
}

fn sentence(found: &SessionPrediction, known: &str, other: &str) -> String {
    let share = |part: f64| 100.0 * part / found.peak_n;
    format!(
        "The fit of {known} predicts the force of {other} with an RMSE of {:.1} mN ({:.2} % of the peak force of {:.3} N) over {} samples; the predicted peak is {:.3} N ({:+.2} %).",
        found.rms_n * 1e3,
        share(found.rms_n),
        found.peak_n,
        found.samples,
        found.predicted_peak_n,
        share(found.predicted_peak_n - found.peak_n),
    )
}
