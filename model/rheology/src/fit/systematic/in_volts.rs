//! The same for fits of signals: each error is a change of the force that the model predicts, and what it does to the
//! parameters is its least-squares fit, with the zero and the contact position free as in the fit.

use super::super::sample::FitError;
use super::super::solve::FitSolution;
use super::{
    Spread, SystematicUncertainty, TracedRecord, add_compliance, estimate_systematic_jointly,
};
use crate::distinct;
use palpate_model::units::Newtons;

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
        let names = self.value_names();
        let spread = self.spread_in_volts(records)?;
        let each = 0..records.len();
        Ok(each.map(|record| spread.summarise(records, &names, record * names.len())).collect())
    }

    fn spread_in_volts(&self, records: &[TracedRecord<'_>]) -> Result<Spread, FitError> {
        let calibrations = distinct(records.iter().filter_map(|one| one.calibration));
        let compliances = distinct(records.iter().filter_map(|one| one.compliance));
        // Every error of every calibration, then every compliance.
        let terms = calibrations
            .iter()
            .flat_map(|own| own.1.errors().enumerate().map(|(index, term)| (*own, index, term)));
        let terms: Vec<_> = terms.collect();
        let count = terms.len() + compliances.len();
        let mut bends = Vec::with_capacity(records.len());
        for (k, record) in records.iter().enumerate() {
            bends.push(match record.compliance {
                Some(own) => self.bend(k, own.1)?,
                None => Vec::new(),
            });
        }
        let changes = self.system.changes_by(&self.refined.points, count, |k, force, samples| {
            let of_terms = terms.iter().map(|(own, index, _)| {
                let is_own = records[k].calibration == Some(*own);
                if is_own { own.1.shift(*index, Newtons(force)).0 } else { 0.0 }
            });
            let of_compliances = compliances.iter().map(|own| {
                if records[k].compliance != Some(*own) {
                    return 0.0;
                }
                let bent = &bends[k][samples.clone()];
                bent.iter().sum::<f64>() / bent.len() as f64
            });
            of_terms.chain(of_compliances).collect()
        });
        let changes = changes.ok_or(FitError::Overflow)?;
        let combinations: Vec<Option<Vec<f64>>> =
            (0..records.len()).flat_map(|record| self.combinations(record)).collect();
        let mut spread = Spread::default();
        for (k, change) in changes.iter().enumerate() {
            let sums = match terms.get(k) {
                Some((_, _, term)) => spread.terms.entry(*term).or_default(),
                None => spread.compliance.get_or_insert_default(),
            };
            sums.resize(combinations.len(), 0.0);
            for (sum, combination) in sums.iter_mut().zip(&combinations) {
                let pairs = combination.iter().flatten().zip(change);
                *sum += pairs.map(|(share, value)| share * value).sum::<f64>().powi(2);
            }
        }
        Ok(spread)
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
