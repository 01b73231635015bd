//! The same for fits of signals: each error is one more unknown of known uncertainty, found with the parameters, so that
//! what the record itself says of the calibration counts. Zero and contact position are free as in the fit.

use super::super::report::student_t975;
use super::super::sample::FitError;
use super::super::signal::ErrorPlace;
use super::super::solve::FitSolution;
use super::super::uncertainty::UncertaintyEstimate;
use super::{
    JointChange, SystematicError, SystematicUncertainty, TermError, TracedRecord, add_compliance,
    estimate_systematic_jointly,
};
use crate::distinct;
use palpate_model::calibration::{ForceUncertainty, UncertaintyTerm};
use palpate_model::units::Newtons;

/// Standard uncertainty of the width of a loop, relative to that of the calibration: a smaller change of the force may
/// make a loop narrower by any share up to this much times the root of twelve, which is all.
const LOOP_SHARE: f64 = 0.29;

/// One independent error that records share.
#[derive(Clone, Copy)]
enum SharedError<'a> {
    Calibration { of: (&'a str, &'a ForceUncertainty), index: usize, term: UncertaintyTerm },
    Compliance((&'a str, f64)),
}

/// Every error of every calibration, then every compliance.
fn shared_errors<'a>(records: &[TracedRecord<'a>]) -> Vec<SharedError<'a>> {
    let calibrations = distinct(records.iter().filter_map(|one| one.calibration));
    let compliances = distinct(records.iter().filter_map(|one| one.compliance));
    let terms = calibrations.into_iter().flat_map(|of| {
        let terms = of.1.errors().enumerate();
        terms.map(move |(index, term)| SharedError::Calibration { of, index, term })
    });
    terms.chain(compliances.into_iter().map(SharedError::Compliance)).collect()
}

impl FitSolution<'_> {
    /// The systematic uncertainty of this fit, for each of its records, which are given with what their forces and
    /// depths were read with.
    pub fn systematic(
        &self,
        records: &[TracedRecord<'_>],
    ) -> Result<Vec<SystematicUncertainty>, FitError> {
        let system = &self.system;
        if !system.signals.iter().all(Option::is_some) {
            let shared = system.known().iter().zip(&system.shared);
            let shared: Vec<&str> =
                shared.filter(|(_, shared)| **shared).map(|(one, _)| one.name.as_str()).collect();
            return estimate_systematic_jointly(records, &system.options, &shared);
        }
        let stated = SystematicUncertainty::stated(records);
        let errors = shared_errors(records);
        if errors.is_empty() {
            return Ok(vec![stated; records.len()]);
        }
        let whole = self.with_shared_errors(records, &errors)?;
        let names = self.value_names();
        let changes = whole.values().into_iter().zip(self.values());
        let changes: Vec<f64> = changes.map(|(after, before)| after - before).collect();
        let of_record = |record: usize| {
            let changes = &changes[record * names.len()..];
            let found = whole.combinations(record).into_iter().zip(whole.estimates(record));
            let each = names.iter().zip(found).zip(changes);
            let parameters = each.map(|((name, (combination, estimate)), change)| {
                let known = combination.zip(estimate);
                let error = known.map(|(combination, estimate)| {
                    whole.systematic_error(&errors, &combination, estimate, *change)
                });
                SystematicError { name: name.clone(), ..error.unwrap_or_default() }
            });
            SystematicUncertainty { parameters: parameters.collect(), ..stated.clone() }
        };
        Ok((0..records.len()).map(of_record).collect())
    }

    /// The same fit with these errors as further unknowns.
    fn with_shared_errors(
        &self,
        records: &[TracedRecord<'_>],
        errors: &[SharedError<'_>],
    ) -> Result<Self, FitError> {
        let mut bends = Vec::with_capacity(records.len());
        for (k, record) in records.iter().enumerate() {
            bends.push(match record.compliance {
                Some(own) => self.bend(k, own.1)?,
                None => Vec::new(),
            });
        }
        let change = |place: &ErrorPlace, error: &SharedError<'_>| {
            let record = &records[place.record];
            match *error {
                SharedError::Calibration { of, .. } if record.calibration != Some(of) => 0.0,
                SharedError::Calibration { of, index, term } => {
                    let signal = self.system.signals[place.record].as_ref();
                    let own = signal.and_then(|term| term.signal.hysteresis.as_ref());
                    match own.filter(|_| term == UncertaintyTerm::Hysteresis) {
                        Some(own) => -place.lag * own.std_error.0.hypot(LOOP_SHARE * own.half.0),
                        None => of.1.shift(index, Newtons(place.force)).0,
                    }
                }
                SharedError::Compliance(of) if record.compliance != Some(of) => 0.0,
                SharedError::Compliance(_) => {
                    let bent = &bends[place.record][place.samples.clone()];
                    bent.iter().sum::<f64>() / bent.len() as f64
                }
            }
        };
        let points = &self.refined.points;
        let system = self.system.with_errors(points, errors.len(), |place| {
            errors.iter().map(|error| change(place, error)).collect()
        });
        let mut system = system.ok_or(FitError::Overflow)?;
        let mut points = points.clone();
        // The second time around the errors found.
        for _ in 0..2 {
            system = system.with_errors_found(&points).ok_or(FitError::Overflow)?;
            // What a wrong curve leaves is no drift.
            system = system.with_drift_of_records(&points);
            let fitted = Self::refined(system, &points)?;
            (system, points) = (fitted.system, fitted.refined.points);
        }
        system = system.with_errors_found(&points).ok_or(FitError::Overflow)?;
        Self::refined(system, &points)
    }

    /// What the errors contribute to the uncertainty of a combination of unknowns, which they moved by `change`.
    fn systematic_error(
        &self,
        errors: &[SharedError<'_>],
        combination: &[f64],
        estimate: UncertaintyEstimate,
        change: f64,
    ) -> SystematicError {
        let mut found = SystematicError::default();
        let Some(factor) = &self.refined.pass.with_errors else { return found };
        let mut whole = vec![0.0; errors.len()];
        whole.extend_from_slice(combination);
        let influence = factor.influence(&whole);
        // Rows and errors weigh by the noise of one sample.
        let unit = self.system.sigma_scale.powi(2);
        for (error, influence) in errors.iter().zip(influence) {
            let part = unit * influence.abs();
            found.error = found.error.hypot(part);
            let SharedError::Calibration { term, .. } = error else {
                found.compliance = Some(found.compliance.map_or(part, |sum| sum.hypot(part)));
                continue;
            };
            match found.terms.iter_mut().find(|one| one.term == *term) {
                Some(one) => one.error = one.error.hypot(part),
                None => found.terms.push(TermError { term: *term, error: part }),
            }
        }
        let statistical = (estimate.std_error.powi(2) - found.error.powi(2)).max(0.0).sqrt();
        let half = student_t975(estimate.freedom) * statistical;
        found.joint = Some(JointChange { change, statistical, half });
        found
    }

    /// Change of the modelled force of a record at each sample where so much more of the force, in mm/N, is taken from
    /// its depths.
    fn bend(&self, record: usize, mm_per_newton: f64) -> Result<Vec<f64>, FitError> {
        let (system, point) = (&self.system, &self.refined.points[record]);
        let (samples, scale) = (system.records[record].samples, system.scale(&point.outer));
        let forces =
            |samples: &[_]| system.source.forces(samples, scale, point).ok_or(FitError::Overflow);
        let moved = forces(&add_compliance(samples, mm_per_newton))?;
        Ok(moved.iter().zip(forces(samples)?).map(|(moved, force)| moved - force).collect())
    }
}
