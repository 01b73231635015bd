//! What a load cell will report in runs like one that was fitted, and what a fit of it will then know.
//!
//! The rows, the elimination of the zero and the knowledge of the contact position are those of the fit itself, at the
//! parameters of a body and without noise, so that an expected standard error is what such a fit states.

use super::super::columns::{OuterPoint, ParameterPoint};
use super::super::identify::{self, JudgedParameters};
use super::super::options::FitOptions;
use super::super::sample::{FitSample, NamedSamples};
use super::super::solve::FitSolution;
use super::super::system::{Rows, System};
use super::super::uncertainty::drift_share;
use super::{Drift, Signal, SignalTerm, UnloadedMean};
use crate::families::PowerSeries;
use palpate_model::units::{Newtons, Seconds, Volts};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;

/// How many parameters the body has.
const BODY: usize = 5;

/// Noise, drift, knowledge of contact and time out of contact of a run, expected of the next ones as well.
#[derive(Clone, Debug)]
pub struct ExpectedSignal {
    /// Of the run; its volts are left out.
    signal: Signal,
    drift: Drift,
    contact_error_mm: f64,
    /// Last time of the run's record in s, behind which it is out of contact again.
    end: f64,
    sample_rate_hz: f64,
}

impl FitSolution<'_> {
    /// What further runs of the first record's rig are expected to report; `None` where it has no signal.
    #[must_use]
    pub fn expected_signal(&self) -> Option<ExpectedSignal> {
        let term = self.system.signals.first()?.as_ref()?;
        let samples = self.system.records[0].samples;
        let (first, last) = (samples.first()?.t.0, samples.last()?.t.0);
        Some(ExpectedSignal {
            signal: Signal { volts: Vec::new(), hysteresis: None, ..term.signal.clone() },
            drift: term.drift,
            contact_error_mm: term.contact_error_mm?,
            end: last,
            sample_rate_hz: (samples.len() - 1) as f64 / (last - first),
        })
    }
}

impl ExpectedSignal {
    /// White noise of one sample.
    #[must_use]
    pub fn noise(&self) -> Volts {
        Volts(self.drift.noise)
    }

    /// Random walk of the zero in V over one second.
    #[must_use]
    pub fn walk(&self) -> f64 {
        self.drift.walk
    }

    /// Standard uncertainty in mm of the contact position.
    #[must_use]
    pub fn contact_error_mm(&self) -> f64 {
        self.contact_error_mm
    }

    /// Standard errors and degrees of freedom of `tau_eps`, `mu1`, `mu2`, `mu3` and `tau_sig` in a fit of presses into one body, each beginning
    /// at time 0 in tissue at rest. `presses` are their samples without noise at `taken_rate_hz`, where the load cell would be
    /// read at `rate_hz`, each sample as noisy as in the run. `None` where the presses do not separate the parameters.
    pub(crate) fn std_errors(
        &self,
        body: &ModifiedKelvin,
        presses: &[Vec<FitSample>],
        rate_hz: f64,
        taken_rate_hz: f64,
    ) -> Option<[(f64, f64); BODY]> {
        // A sample taken stands for so many of the load cell.
        let thinning = rate_hz / taken_rate_hz;
        let share = taken_rate_hz / self.sample_rate_hz;
        let signals: Vec<Signal> =
            presses.iter().map(|samples| self.signal_of(samples, share)).collect();
        let named: Vec<NamedSamples<'_>> =
            presses.iter().map(|samples| ("a press", samples.as_slice())).collect();
        let options = FitOptions::of(Arc::new(PowerSeries::THESIS));
        let shared: Vec<bool> =
            (0..options.names().len()).map(|k| options.layout.is_body(k)).collect();
        let system = System::new(&named, &options, shared).ok()?;
        let terms = presses.iter().zip(&signals).map(|(samples, signal)| {
            let (start, end) = (signal.unloaded.first()?.t.0, signal.unloaded.last()?.t.0);
            let end = end.max(samples.last()?.t.0);
            let spacing = Drift::spacing_over(end - start);
            let noise = self.drift.noise / thinning.sqrt();
            Some(SignalTerm::given(
                signal,
                Drift { noise, start, spacing, ..self.drift },
                self.contact_error_mm,
            ))
        });
        let terms = terms.collect();
        let system = system.with_terms(terms);
        if !system.signals.iter().all(Option::is_some) {
            return None;
        }
        let [mu1, mu2, mu3] = body.mu;
        let outer = OuterPoint { values: vec![body.tau_eps], contact: 0.0 };
        let at = vec![0.0; system.layout().linear_count()];
        let mut points = vec![ParameterPoint { outer, at }; presses.len()];
        for (k, value) in [mu1, mu2, mu3, body.tau_sig].into_iter().enumerate() {
            system.pin(&mut points, 0, system.layout().outers + k, value);
        }
        // What a fit would refuse is no plan.
        identify::check(&system, &points, JudgedParameters::Linear).ok()?;
        identify::check(&system, &points, JudgedParameters::WithOuter).ok()?;
        let deviations = |system: &System<'_>| -> Option<[f64; BODY]> {
            let joint = system.pass(&points, Rows::All)?.joint;
            let found: [f64; BODY] = std::array::from_fn(|parameter| {
                let combination = system.combination(0, parameter, &points[0]);
                system.sigma_scale * joint.deviation(&combination)
            });
            found.iter().all(|one| one.is_finite() && *one > 0.0).then_some(found)
        };
        let errors = deviations(&system)?;
        // The run knows the size of the drift no better than it says, and a plan knows it from that run alone.
        let more = deviations(&system.with_more_drift())?;
        Some(std::array::from_fn(|k| {
            let share = drift_share(errors[k], more[k]);
            (errors[k], (2.0 / (self.drift.spread * share * share)).max(1.0))
        }))
    }

    /// The signal of one press, its zero seen before and after as in the run, in this share of the samples.
    fn signal_of(&self, samples: &[FitSample], share: f64) -> Signal {
        let volts = samples.iter().map(|one| self.signal.curve.volts_from_newtons(one.force).0);
        let zero = self.signal.curve.volts_from_newtons(Newtons(0.0));
        let end = samples.last().map_or(0.0, |one| one.t.0);
        let mut spare = 0.0;
        let unloaded = self.signal.unloaded.iter().filter_map(|one| {
            // What that leaves of a mean waits for the next one.
            let count = one.count as f64 * share + spare;
            spare = count.fract();
            let t = if one.t.0 > self.end { one.t.0 - self.end + end } else { one.t.0 };
            let mean = UnloadedMean { t: Seconds(t), volts: zero, count: count as usize };
            (mean.count > 0 && !(0.0..=end).contains(&t)).then_some(mean)
        });
        let unloaded = unloaded.collect();
        Signal { volts: volts.collect(), unloaded, ..self.signal.clone() }
    }
}
