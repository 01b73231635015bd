//! How far the parameters depend on the choice of the family, where the fitted one does not describe the record.

use super::columns::OuterPoint;
use super::options::FitOptions;
use super::report::FitReport;
use super::sentences::lacks_fit;
use super::solve::{FitSolution, joint_system, search_start};
use super::system::{Rows, System};
use crate::families::{Family, all_families};
use std::sync::Arc;

/// A fit of the thinned record: a small share of a standard error from one of all samples, and many times cheaper.
struct ThinFit {
    key: String,
    /// Body parameters by name.
    values: Vec<(String, f64)>,
    /// Weighted sum of squares.
    sum: f64,
    free: usize,
}

impl ThinFit {
    /// Bayesian information criterion (Schwarz 1978) for so many independent samples.
    fn criterion(&self, samples: f64) -> f64 {
        samples * self.sum.ln() + self.free as f64 * samples.ln()
    }
}

impl FitSolution<'_> {
    /// What the best of the families that add something to the fitted one makes of a record's parameters, in a sentence;
    /// `None` without lack of fit, and where no such family has parameters of the same names. `report` is that of the record.
    #[must_use]
    pub fn richer_words(&self, record: usize, report: &FitReport) -> Option<String> {
        let noise = report.noise.as_ref().filter(|noise| lacks_fit(self, report, noise))?;
        let samples = noise.effective_samples;
        let own = self.system.source.family.key();
        let own_fit = self.thin_fit(record, &own)?;
        let richer = richer_than(&own);
        let fits = richer.iter().filter_map(|key| self.thin_fit(record, key));
        let best =
            fits.min_by(|one, other| one.criterion(samples).total_cmp(&other.criterion(samples)))?;
        if best.criterion(samples) >= own_fit.criterion(samples) {
            return Some(format!(
                "none of the richer families {} describes the record better",
                richer.join(", ")
            ));
        }
        let shifts = own_fit.values.iter().filter_map(|(name, value)| {
            let other = best.values.iter().find(|(other, _)| other == name)?.1;
            Some(format!("{name} by {:+.2} %", 100.0 * (other - value) / value.abs()))
        });
        let shifts: Vec<String> = shifts.collect();
        (!shifts.is_empty()).then(|| {
            format!(
                "the richer family {} leaves {:.0} % of the residual variance and changes {}; the intervals do not cover the choice of the family",
                best.key,
                100.0 * best.sum / own_fit.sum,
                shifts.join(", ")
            )
        })
    }

    fn thin_fit(&self, record: usize, key: &str) -> Option<ThinFit> {
        let mut options = FitOptions::by_key(key).ok()?;
        let (own, fixed) = (&self.system.options, &self.system.options.fixed);
        for (known, value) in own.known.iter().zip(fixed) {
            match value {
                Some(value) => options.fix(&known.name, *value).ok()?,
                None => options.free(&known.name).ok()?,
            }
        }
        if own.is_at_rest {
            options = options.at_rest();
        }
        let samples = self.system.records[record].samples;
        let system = joint_system(&[("the record", samples)], &options, &[]).ok()?;
        let points = search_start(&system).ok()?;
        let outers: Vec<OuterPoint> = points.iter().map(|point| point.outer.clone()).collect();
        let names = options.body_names().into_iter().map(str::to_owned);
        Some(ThinFit {
            key: key.to_owned(),
            values: names.zip(system.physical_values(0, &points[0])).collect(),
            sum: thin_sum(&system, &outers)?,
            free: options.free_count(),
        })
    }
}

fn thin_sum(system: &System<'_>, outers: &[OuterPoint]) -> Option<f64> {
    let sum = system.sum(outers, Rows::Thin);
    (sum > 0.0 && sum.is_finite()).then_some(sum)
}

/// Keys of the families that are the one of this key with something more, however much.
fn richer_than(key: &str) -> Vec<String> {
    let mut found = vec![key.to_owned()];
    let all: Vec<Arc<dyn Family>> = all_families();
    // The simplest come first, and each adds to simpler ones only.
    for family in all {
        let adds_to = family.adds_to();
        if adds_to.iter().any(|(simpler, _)| found.contains(simpler)) {
            found.push(family.key());
        }
    }
    found.split_off(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn richer_families_are_found_through_all_that_add_to_each_other() {
        let found = richer_than("series-3");
        assert!(
            ["series-4", "series-5", "unloading-3"]
                .iter()
                .all(|key| found.iter().any(|one| one == key)),
            "{found:?}"
        );
        assert!(!found.iter().any(|one| one == "series-2"), "{found:?}");
        assert!(richer_than("series-5").is_empty());
    }
}
