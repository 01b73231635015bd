//! An analysis of cycles as people and machines read it: a table, one JSON object, a picture.

mod json;
mod plot;
mod text;

pub use json::object;
pub use plot::picture;
pub use text::cycles_text;

use crate::cycles::CycleSource;
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::cycles::{
    CycleAnalysis, CyclePrediction, CycleSample, PredictionError, Sinusoid, SinusoidError,
    Steadiness, SteadyRule, analyse_cycles, fit_sinusoid, predict_cycles,
};
use palpate_rheology::fit::FitSample;

/// Settings of a cycle analysis.
#[derive(Clone, Debug, Default)]
pub struct CycleSettings {
    /// Depth of the stiffness; 80 % of the first cycle's depth without it.
    pub at: Option<Depth>,
    pub rule: SteadyRule,
    /// Frequency in Hz of a record that is one sine.
    pub frequency: Option<f64>,
    /// A body fitted elsewhere whose prediction is compared.
    pub body: Option<ModifiedKelvin>,
}

#[derive(Clone, Debug)]
pub struct CycleReport {
    pub name: String,
    pub source: CycleSource,
    /// One for each loading.
    pub cycles: Vec<CycleAnalysis>,
    pub steadiness: Steadiness,
    pub rule: SteadyRule,
    /// The sines, or why one could not be evaluated.
    pub sines: Vec<Result<Sinusoid, SinusoidError>>,
    /// For each cycle, where a body was given, what it predicts.
    pub predictions: Vec<Result<CyclePrediction, PredictionError>>,
}

impl CycleReport {
    #[must_use]
    pub fn of(name: String, source: CycleSource, question: &CycleSettings) -> Self {
        let (sines, cycles) = match question.frequency {
            // A table that is one sine has no loading.
            Some(frequency) => (vec![fit_sinusoid(&source.samples, frequency)], Vec::new()),
            None => {
                let sine = |(frequency, range): &(f64, std::ops::Range<usize>)| {
                    fit_sinusoid(&source.samples[range.clone()], *frequency)
                };
                let cycles = analyse_cycles(&source.samples, question.at, source.pulse);
                (source.sines.iter().map(sine).collect(), cycles)
            }
        };
        let predictions = match &question.body {
            Some(body) => cycles.iter().map(|one| prediction(body, &source, one)).collect(),
            None => Vec::new(),
        };
        Self {
            steadiness: question.rule.judge(&cycles),
            rule: question.rule,
            name,
            source,
            cycles,
            sines,
            predictions,
        }
    }

    /// Samples of the n-th cycle analysed.
    fn samples(&self, index: usize) -> impl Iterator<Item = &CycleSample> + Clone {
        let cycle = &self.cycles[index];
        let end = cycle.start.0 + cycle.duration.0;
        self.source.samples.iter().filter(move |one| one.t.0 >= cycle.start.0 && one.t.0 <= end)
    }
}

/// The way in and the hold of one cycle, predicted: what the body knows, which knows no way back.
fn prediction(
    body: &ModifiedKelvin,
    source: &CycleSource,
    cycle: &CycleAnalysis,
) -> Result<CyclePrediction, PredictionError> {
    let end = cycle.start.0 + cycle.duration.0;
    let samples: Vec<FitSample> = source
        .samples
        .iter()
        .enumerate()
        .filter(|(_, one)| one.t.0 >= cycle.start.0 && one.t.0 <= end)
        .filter(|(_, one)| matches!(one.phase, Phase::Ramp | Phase::Hold))
        .map(|(index, one)| FitSample {
            t: one.t,
            depth: source.own_depth(index),
            force: one.force,
            // Every sample counts alike.
            sigma: Newtons(1.0),
        })
        .collect();
    predict_cycles(body, &samples)
}
