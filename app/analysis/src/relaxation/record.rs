//! The part of a record that a relaxation modulus is fitted to, and what errors of what was measured do to its forces.

use super::{NoiseError, RelaxationError};
use crate::compliance::ComplianceCorrection;
use crate::material::zero_scatter;
use crate::source::FitSource;
use palpate_indentation::{
    ContactLaw, Indenter, LoadHistoryError, RELATIVE_ERROR_MAX, RelaxationFamily, RelaxationFit,
    RelaxationFitError, Specimen, fit_relaxation, lee_radok_force, load_history,
    vary_uncertain_numbers,
};
use palpate_model::calibration::ForceUncertainty;
use palpate_model::units::Newtons;
use palpate_rheology::fit::{FitSample, ResidualAutocorrelation};

pub(super) type Press<'a> = (ContactLaw, &'a Indenter, &'a Specimen);

/// Samples from the contact to the end of the hold.
pub(super) struct Record {
    /// From the first sample, in s.
    pub times: Vec<f64>,
    /// From the contact, in mm.
    pub depths: Vec<f64>,
    /// In N.
    pub forces: Vec<f64>,
    /// Standard deviation of a force in N, where it is known.
    pub noise: Option<f64>,
}

/// A fit with the autocorrelation of its residuals.
pub(super) struct JudgedFit {
    pub fit: RelaxationFit,
    pub memory: ResidualAutocorrelation,
}

impl JudgedFit {
    /// Refuses a term that is not known once the autocorrelation counts.
    fn of(fit: RelaxationFit) -> Result<Self, RelaxationError> {
        let samples = fit.residuals_newtons.len();
        let memory = ResidualAutocorrelation::of(&fit.residuals_newtons, &fit.tangents)
            .ok_or(RelaxationError::NoResiduals { samples })?;
        let judged = Self { fit, memory };
        let (count, unknowns) = (judged.fit.modulus.terms.len(), judged.fit.tangents.len());
        let error = |unknown: usize| {
            let along = |one: usize| if one == unknown { 1.0 } else { 0.0 };
            let along: Vec<f64> = (0..unknowns).map(along).collect();
            judged.error_along(&along).standard_error
        };
        // Of an exponent, which is that of all terms.
        let of_exponent = (2 * count + 1..unknowns).map(error).fold(0.0, f64::max);
        for (index, term) in judged.fit.modulus.terms.iter().enumerate() {
            let of_modulus = error(index) / term.modulus_mpa;
            let share = of_modulus.max(error(count + 1 + index)).max(of_exponent);
            if share > RELATIVE_ERROR_MAX {
                let (time_secs, percent) = (term.time_secs, 100.0 * share);
                return Err(RelaxationError::Autocorrelated { time_secs, percent });
            }
        }
        Ok(judged)
    }

    /// As that of the fit, with the autocorrelation of the residuals.
    pub fn error_along(&self, gradient: &[f64]) -> NoiseError {
        let (inflation, freedom) = self.memory.inflation(gradient);
        let standard_error = self.fit.standard_error_along(gradient) * inflation.sqrt();
        NoiseError { standard_error, freedom }
    }
}

/// What may be wrong with the forces by one standard uncertainty each; nothing where it is not known.
pub(super) struct Source {
    pub name: &'static str,
    /// Errors in N of all samples, of each independent part.
    pub errors: Vec<Vec<f64>>,
}

/// The press begins at the contact before this share of its greatest depth, and ends where it is less deep than before by as
/// much: a contact that shrinks is beyond Lee and Radok. A slider at rest trembles by less.
const DEPTH_SHARE: f64 = 0.02;
/// Fifteen in each of four decades: a term bends over one.
const PLOT_TIMES: u32 = 61;
/// A session that pauses for so many of its intervals moved in between, as in a sine.
const PAUSE_INTERVALS: f64 = 50.0;

impl Record {
    pub fn of(read: &FitSource) -> Result<Self, RelaxationError> {
        let shift = read.signal.as_ref().map_or(0.0, |signal| signal.contact_shift_mm);
        let depth = |one: &FitSample| one.depth.0 - shift;
        let all = without_pause(&read.samples, read.signal.is_some());
        let deepest = all.iter().map(depth).fold(0.0, f64::max);
        let pressed = all.iter().position(|one| depth(one) > DEPTH_SHARE * deepest);
        let pressed = pressed.ok_or(RelaxationError::NoPress)?;
        let first = all[..pressed].iter().rposition(|one| depth(one) <= 0.0).unwrap_or(0);
        let mut reached = 0.0f64;
        let is_held = |one: &&FitSample| {
            reached = reached.max(depth(one));
            depth(one) >= reached - DEPTH_SHARE * deepest
        };
        let taken: Vec<&FitSample> =
            all[first..].iter().take_while(is_held).filter(|one| one.is_measured()).collect();
        let start = taken.first().ok_or(RelaxationError::NoPress)?.t.0;
        Ok(Self {
            times: taken.iter().map(|one| one.t.0 - start).collect(),
            // The slider trembles about the contact too.
            depths: taken.iter().map(|one| depth(one).max(0.0)).collect(),
            forces: taken.iter().map(|one| one.force.0).collect(),
            noise: read.noise_of(taken),
        })
    }

    pub fn fit(
        &self,
        press: Press,
        family: RelaxationFamily,
    ) -> Result<JudgedFit, RelaxationError> {
        let (law, indenter, specimen) = press;
        let (power, history) = load_history(law, indenter, specimen, &self.times, &self.depths)?;
        JudgedFit::of(fit_relaxation(power, &history, &self.forces, family)?)
    }

    pub fn deepest(&self) -> f64 {
        self.depths.iter().copied().fold(0.0, f64::max)
    }

    /// From the contact to 99 % of the greatest depth.
    pub fn ramp_secs(&self) -> f64 {
        let end = 0.99 * self.deepest();
        let index = self.depths.iter().position(|depth| *depth >= end);
        index.map_or(0.0, |index| self.times[index])
    }

    pub fn secs(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// From when on in s after a step a fit is the modulus: behind the mean interval of the samples and a tenth of the ramp, within
    /// which no fit finds a time, and behind all of the ramp where one more term of a Prony series is hidden there.
    pub fn seen_from_secs(&self, press: Press, fit: &RelaxationFit) -> f64 {
        let more = RelaxationFamily::Prony { terms: fit.modulus.terms.len() + 1 };
        let is_hidden = fit.family != RelaxationFamily::Fractional
            && matches!(
                self.fit(press, more),
                Err(RelaxationError::Fit(RelaxationFitError::RampTooLong { .. }))
            );
        let share = if is_hidden { 1.0 } else { 0.1 };
        (self.secs() / self.times.len() as f64).max(share * self.ramp_secs())
    }

    /// The powers of ten in s from a time to the whole record.
    pub fn decades(&self, from_secs: f64) -> Vec<f64> {
        let first = from_secs.log10().ceil() as i32;
        let last = self.secs().log10().floor() as i32;
        (first..=last).map(|power| 10f64.powi(power)).collect()
    }

    /// As many times in s from one to the end of the record as a curve over their logarithm needs.
    pub fn plot_times(&self, from_secs: f64) -> Vec<f64> {
        let ratio = self.secs() / from_secs;
        let share = |index: u32| f64::from(index) / f64::from(PLOT_TIMES - 1);
        (0..PLOT_TIMES).map(|index| from_secs * ratio.powf(share(index))).collect()
    }

    /// Everything but the noise.
    pub fn sources(
        &self,
        press: Press,
        fit: &RelaxationFit,
        read: &FitSource,
        contact_error_mm: Option<f64>,
        compliance: Option<&ComplianceCorrection>,
    ) -> Result<Vec<Source>, RelaxationError> {
        let (law, indenter, specimen) = press;
        let as_is = self.fitted(press, fit, &self.depths)?;
        let moved = |by: &dyn Fn(usize) -> f64| -> Result<Vec<f64>, RelaxationError> {
            let depth = |index: usize| (self.depths[index] + by(index)).max(0.0);
            let depths: Vec<f64> = (0..self.depths.len()).map(depth).collect();
            Ok(difference(&self.fitted(press, fit, &depths)?, &as_is, 1.0))
        };
        let mut sources = vec![Source {
            name: "contact",
            // Less deep, because deeper the law may not hold.
            errors: contact_error_mm
                .map(|error| moved(&|_| -error))
                .transpose()?
                .into_iter()
                .collect(),
        }];
        for (term, [low, high]) in vary_uncertain_numbers(indenter, specimen) {
            let fitted = |(indenter, specimen): &(Indenter, Specimen)| {
                self.fitted((law, indenter, specimen), fit, &self.depths)
            };
            let errors = match (fitted(&low), fitted(&high)) {
                (Ok(low), Ok(high)) => difference(&high, &low, 0.5),
                // Beyond its range a law says nothing; the other side has the same size.
                (Ok(one), Err(_)) | (Err(_), Ok(one)) => difference(&one, &as_is, 1.0),
                (Err(err), Err(_)) => return Err(err),
            };
            sources.push(Source { name: term.name(), errors: vec![errors] });
        }
        let zero = zero_scatter(read).map(|error| vec![error; self.forces.len()]);
        sources.push(Source { name: "force zero", errors: zero.into_iter().collect() });
        sources.push(Source { name: "calibration", errors: self.calibration_errors(read) });
        let bent =
            compliance.map(|one| moved(&|index| -one.std_error_mm_per_n * self.forces[index]));
        let errors = bent.transpose()?.into_iter().collect();
        sources.push(Source { name: "machine compliance", errors });
        Ok(sources)
    }

    fn calibration_errors(&self, read: &FitSource) -> Vec<Vec<f64>> {
        let known = read.calibration.as_ref().and_then(|one| ForceUncertainty::of(one).ok());
        let Some(known) = known.filter(ForceUncertainty::is_stated) else { return Vec::new() };
        let errors = |error: usize| {
            self.forces.iter().map(|force| known.shift(error, Newtons(*force)).0).collect()
        };
        (0..known.errors().count()).map(errors).collect()
    }

    /// The forces that the fitted modulus gives for these depths.
    fn fitted(
        &self,
        (law, indenter, specimen): Press,
        fit: &RelaxationFit,
        depths: &[f64],
    ) -> Result<Vec<f64>, RelaxationError> {
        let (power, history) = load_history(law, indenter, specimen, &self.times, depths)?;
        Ok(lee_radok_force(power, &fit.modulus, &history).map_err(LoadHistoryError::from)?)
    }
}

fn difference(one: &[f64], other: &[f64], share: f64) -> Vec<f64> {
    one.iter().zip(other).map(|(one, other)| share * (one - other)).collect()
}

/// The samples before the first pause of a session; a table may be as sparse as it likes.
fn without_pause(samples: &[FitSample], is_session: bool) -> &[FitSample] {
    let (Some(first), Some(last), true) = (samples.first(), samples.last(), is_session) else {
        return samples;
    };
    let interval = (last.t.0 - first.t.0) / samples.len() as f64;
    let pause =
        samples.windows(2).position(|two| two[1].t.0 - two[0].t.0 > PAUSE_INTERVALS * interval);
    pause.map_or(samples, |index| &samples[..=index])
}
