//! What the fit of the session in front says of the next one, beside what was measured there.

use super::ReviewScreen;
use super::left::color_of;
use super::middle::head_ui;
use crate::plots::navigate::AxisRange;
use crate::plots::over_time::{TimeBackdrop, TimeLayer, TimePanel, over_time_ui};
use crate::theme::Tokens;
use crate::widgets::remark::{alarm_ui, quiet_ui};
use crate::widgets::task_bar::task_ui;
use crate::workers::review::Quantity;
use crate::workers::review::fit::{MODELLED, RESIDUAL, SessionPrediction, predict};
use eframe::egui::{Ui, vec2};

impl ReviewScreen {
    fn prediction_verdict(&self) -> Result<(), String> {
        match self.subjects.len() {
            0 | 1 => Err("show two sessions: the first is fitted, the second is foretold".into()),
            _ => self.fit_verdict(),
        }
    }

    pub(super) fn prediction_ui(&mut self, ui: &mut Ui) {
        let words = match self.subjects.as_slice() {
            [known, other, ..] => {
                format!("{} is fitted, and its body is pressed as {} was", known.name, other.name)
            }
            _ => String::new(),
        };
        head_ui(ui, "Prediction against validation", &words);
        let verdict = self.prediction_verdict();
        const NAME: &str = "Foretell the second session";
        if task_ui(ui, NAME, &self.prediction, &verdict)
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
        let Some(index) = self.subjects.iter().position(|one| one.name == other) else {
            return quiet_ui(ui, &format!("{other} is not shown any more"));
        };
        self.prediction_plots(ui, &found, index);
    }

    fn prediction_plots(&mut self, ui: &mut Ui, found: &SessionPrediction, index: usize) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        let mut span = AxisRange::default();
        let Some(whole) = found.track.span() else {
            return;
        };
        span.set_whole(whole);
        let pixels = f64::from(ui.available_width() * ui.ctx().pixels_per_point()).round();
        let wanted = crate::plots::stretches::LineWindow {
            window: whole,
            pixels,
            shift: 0.0,
            // Samples compared and what is left tell one prediction from another.
            version: found.rms_n.to_bits() ^ found.samples as u64,
        };
        let [modelled, residual] = &mut self.prediction_lines;
        modelled.update(&found.track, MODELLED, wanted);
        residual.update(&found.track, RESIDUAL, wanted);
        let subject = &mut self.subjects[index];
        let mut own = wanted;
        own.version = subject.recording.version;
        subject.update(Quantity::Force, own);
        let measured = TimeLayer {
            name: "measured",
            color: color_of(tokens, subject.id),
            stretches: &subject.lines[Quantity::Force as usize],
        };
        let foretold = TimeLayer { name: "foretold", color: tokens.limit, stretches: &*modelled };
        let left =
            TimeLayer { name: "left", color: color_of(tokens, subject.id), stretches: &*residual };
        let (width, height) = (ui.available_width(), ui.available_height());
        for (panel, share, axis) in [
            (
                TimePanel {
                    id: "Foretold force",
                    axis: Quantity::Force.axis(),
                    layers: vec![measured, foretold],
                    has_zero: false,
                },
                0.62,
                None,
            ),
            (
                TimePanel {
                    id: "Left of it",
                    axis: "measured less foretold (mN)",
                    layers: vec![left],
                    has_zero: true,
                },
                0.36,
                Some("time from session start (s)"),
            ),
        ] {
            ui.allocate_ui(vec2(width, share * height), |ui| {
                let _ = over_time_ui(ui, &panel, &span, &TimeBackdrop::default(), axis);
            });
        }
    }
}

/// What came of it, in one sentence.
fn sentence(found: &SessionPrediction, known: &str, other: &str) -> String {
    let share = |part: f64| 100.0 * part / found.peak_n;
    format!(
        "the fit of {known} foretells {other} within {:.1} mN rms, {:.2} % of its peak force of {:.3} N, over {} samples; the peak is foretold as {:.3} N, {:+.2} %",
        found.rms_n * 1e3,
        share(found.rms_n),
        found.peak_n,
        found.samples,
        found.predicted_peak_n,
        share(found.predicted_peak_n - found.peak_n),
    )
}
