//! The same for fits of signals: each error is one more unknown of known uncertainty, found with the parameters, so that
//! what the record itself says of the calibration counts. Zero and contact position are free as in the fit.

use super::super::passes::product;
use super::super::sample::FitError;
use super::super::signal::ErrorPlace;
use super::super::solve::FitSolution;
use super::super::system::{Rows, System};
use super::super::uncertainty::UncertaintyEstimate;
use super::sentence::total_half;
use super::{
    JointChange, SystematicError, SystematicUncertainty, TermError, TracedRecord, add_compliance,
    estimate_systematic_jointly,
};
use crate::distinct;
use palpate_model::calibration::{ForceUncertainty, UncertaintyTerm};
use palpate_model::estimate::student_t975;
use palpate_model::units::Newtons;

/// Standard uncertainty of the width of a loop, relative to its width in the calibration: over a part of the range a loop
/// is narrower, by an unknown amount. That of a rectangular distribution from nothing to the whole: 1 / sqrt(12).
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

/// Times that errors and drift are found in turn: each starts from the other of the time before.
const ERROR_PASSES: usize = 2;
/// Errors that come out larger than so many standard uncertainties contradict their statement: of forty, one does so once
/// in ten records by chance if nothing else were known of it, and what is known of it makes that rarer.
const CONTRADICTION: f64 = 3.0;

/// Nor do errors explain a record whose residuals then still have a long-run variance so many times their own: the model does
/// not describe it, and would bend the curve instead.
const MEMORY_MAX: f64 = 2.0;

/// The standard uncertainty that is left of one without an independent part of it.
fn difference(all: f64, part: f64) -> f64 {
    (all.powi(2) - part.powi(2)).max(0.0).sqrt()
}

/// The root of the sum of the squares of parts, one for each error, and the same of those of each term.
fn sum_of_parts(errors: &[SharedError<'_>], parts: impl Iterator<Item = f64>) -> SystematicError {
    let mut found = SystematicError::default();
    for (error, part) in errors.iter().zip(parts) {
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
    found
}

impl<'a> FitSolution<'a> {
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
        let system = self.with_shared_errors(records, &errors)?;
        let names = self.value_names();
        let Some(whole) = self.with_errors_found(&system) else {
            let changes = self.changes_by_each(&system)?;
            let of_record = |record: usize| {
                let each = names.iter().zip(self.combinations(record));
                let parameters = each.map(|(name, combination)| {
                    let parts = combination.iter().flat_map(|one| {
                        let part = |change: &Vec<f64>| product(one, change).abs();
                        changes.iter().map(part)
                    });
                    SystematicError { name: name.clone(), ..sum_of_parts(&errors, parts) }
                });
                let parameters = parameters.collect();
                SystematicUncertainty { parameters, is_contradicted: true, ..stated.clone() }
            };
            return Ok((0..records.len()).map(of_record).collect());
        };
        let changes = whole.values().into_iter().zip(self.values());
        let changes: Vec<f64> = changes.map(|(after, before)| after - before).collect();
        let of_record = |record: usize| {
            let changes = &changes[record * names.len()..];
            let found = whole.combinations(record).into_iter().zip(whole.estimates(record));
            let each = names.iter().zip(found.zip(self.estimates(record))).zip(changes);
            let parameters = each.map(|((name, ((combination, estimate), exact)), change)| {
                let known = combination.zip(estimate.zip(exact));
                let error = known.map(|(combination, (estimate, exact))| {
                    let exact = exact.std_error;
                    whole.systematic_error(&errors, &combination, exact, estimate, *change)
                });
                SystematicError { name: name.clone(), ..error.unwrap_or_default() }
            });
            SystematicUncertainty { parameters: parameters.collect(), ..stated.clone() }
        };
        Ok((0..records.len()).map(of_record).collect())
    }

    /// This fit with the errors of its calibrations and compliances found with it, whose predictions allow for them; the fit
    /// itself where it has no signals, or where its records contradict what is stated of these errors.
    pub fn with_traced_errors(self, records: &[TracedRecord<'_>]) -> Result<Self, FitError> {
        let errors = shared_errors(records);
        if errors.is_empty() || !self.system.signals.iter().all(Option::is_some) {
            return Ok(self);
        }
        let system = self.with_shared_errors(records, &errors)?;
        Ok(self.with_errors_found(&system).unwrap_or(self))
    }

    /// The same records with these errors as further unknowns.
    fn with_shared_errors(
        &self,
        records: &[TracedRecord<'_>],
        errors: &[SharedError<'_>],
    ) -> Result<System<'a>, FitError> {
        let mut bends = Vec::with_capacity(records.len());
        for (k, record) in records.iter().enumerate() {
            bends.push(match record.compliance {
                Some(own) => self.bend(k, own.1)?,
                None => Vec::new(),
            });
        }
        let is_of = |record: &TracedRecord<'_>, error: &SharedError<'_>| match *error {
            SharedError::Calibration { of, .. } => record.calibration == Some(of),
            SharedError::Compliance(of) => record.compliance == Some(of),
        };
        // Documents are compared once: they are long.
        let own = records.iter().map(|record| errors.iter().map(|error| is_of(record, error)));
        let own: Vec<Vec<bool>> = own.map(Iterator::collect).collect();
        let change = |place: &ErrorPlace, error: &SharedError<'_>| match *error {
            SharedError::Calibration { of, index, term } => {
                let signal = self.system.signals[place.record].as_ref();
                let own = signal.and_then(|term| term.signal.hysteresis.as_ref());
                match own.filter(|_| term == UncertaintyTerm::Hysteresis) {
                    Some(own) => -place.lag * own.std_error.0.hypot(LOOP_SHARE * own.half.0),
                    None => of.1.shift(index, Newtons(place.force)).0,
                }
            }
            SharedError::Compliance(_) => {
                let bent = &bends[place.record][place.samples.clone()];
                bent.iter().sum::<f64>() / bent.len() as f64
            }
        };
        let points = &self.refined.points;
        let system = self.system.with_errors(points, errors.len(), |place| {
            let pairs = errors.iter().zip(&own[place.record]);
            pairs.map(|(error, is_own)| if *is_own { change(place, error) } else { 0.0 }).collect()
        });
        system.ok_or(FitError::Overflow)
    }

    /// The fit with the errors of a system found; `None` where they come out larger than is stated of them, or do not explain the
    /// record.
    fn with_errors_found(&self, system: &System<'a>) -> Option<Self> {
        let mut system = system.clone();
        let mut points = self.refined.points.clone();
        let mut pass = system.pass(&points, Rows::All)?;
        // Each time around the errors found before; what a wrong curve leaves is no drift.
        for _ in 0..ERROR_PASSES {
            system = system.with_errors_found(&pass)?.with_drift_of_records(&points);
            let fitted = Self::refined(system, &points).ok()?;
            (system, points, pass) = (fitted.system, fitted.refined.points, fitted.refined.pass);
        }
        system = system.with_errors_found(&pass)?;
        let is_stated = system.errors.found.iter().all(|error| error.abs() < CONTRADICTION);
        let fitted = is_stated.then(|| Self::refined(system, &points).ok()).flatten()?;
        let uncertainty = fitted.uncertainty();
        let is_white = |record: usize| {
            let memory = uncertainty.memory(record);
            let limit = MEMORY_MAX * uncertainty.variance(record);
            memory.is_none_or(|memory| memory.long_run() < limit)
        };
        (0..points.len()).all(is_white).then_some(fitted)
    }

    /// Changes of the unknowns by one standard uncertainty of each error, to first order.
    fn changes_by_each(&self, system: &System<'a>) -> Result<Vec<Vec<f64>>, FitError> {
        let pass = system.pass(&self.refined.points, Rows::All);
        let factor = pass.and_then(|pass| pass.with_errors).ok_or(FitError::Overflow)?;
        let errors = system.errors.count;
        let unknowns: Vec<usize> = (errors..errors + system.unknowns.len()).collect();
        let change = |k| {
            let columns: Vec<usize> = unknowns.iter().copied().chain([k]).collect();
            factor.select_leading(&columns).solve(unknowns.len())
        };
        Ok((0..errors).map(change).collect())
    }

    /// What the errors contribute to the uncertainty of a combination of unknowns, which they moved by `change` and whose
    /// standard uncertainty with an exact calibration is `exact`.
    fn systematic_error(
        &self,
        errors: &[SharedError<'_>],
        combination: &[f64],
        exact: f64,
        estimate: UncertaintyEstimate,
        change: f64,
    ) -> SystematicError {
        let Some(factor) = &self.refined.pass.with_errors else {
            return SystematicError::default();
        };
        let mut whole = vec![0.0; errors.len()];
        whole.extend_from_slice(combination);
        let influence = factor.influence(&whole);
        // Rows and errors weigh by the noise of one sample.
        let unit = self.system.sigma_scale.powi(2);
        let parts = influence.iter().map(|influence| unit * influence.abs());
        let mut found = sum_of_parts(errors, parts);
        let all = estimate.std_error;
        let left = student_t975(estimate.freedom) * difference(all, found.error);
        let half = total_half(left, found.error);
        // What an exact calibration would take away is its errors and the noise that finding them lets in.
        let added = difference(all, exact);
        if found.error > 0.0 {
            let scale = added / found.error;
            found.terms.iter_mut().for_each(|one| one.error *= scale);
            found.compliance = found.compliance.map(|error| scale * error);
            found.error = added;
        }
        // A fit that takes a wrong curve for exact may state more, for it takes the error for drift.
        found.joint = Some(JointChange { change, statistical: exact.min(all), half });
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
