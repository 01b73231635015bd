//! One record of a fit and what is known of it before any fitting.

use super::sample::FitSample;
use super::thin::Thin;

/// A record and its thinned form.
#[derive(Clone, Debug)]
pub(super) struct Record<'a> {
    pub name: &'a str,
    pub samples: &'a [FitSample],
    pub thin: Thin,
    /// Samples whose force counts.
    pub measured: usize,
    /// Depths reached, in mm.
    pub depths: (f64, f64),
    /// Weighted sum of squared forces.
    pub force_square: f64,
}

impl Record<'_> {
    /// Smallest and largest force that counts, in N.
    pub fn forces(&self) -> (f64, f64) {
        let outside = (f64::INFINITY, f64::NEG_INFINITY);
        let measured = self.samples.iter().filter(|sample| sample.is_measured());
        measured.fold(outside, |(low, high), sample| {
            (low.min(sample.force.0), high.max(sample.force.0))
        })
    }
}

pub(super) fn measured(samples: &[FitSample]) -> usize {
    samples.iter().filter(|sample| sample.is_measured()).count()
}

/// Shallowest and deepest sample in mm.
pub(super) fn depths(samples: &[FitSample]) -> (f64, f64) {
    let outside = (f64::INFINITY, f64::NEG_INFINITY);
    samples.iter().fold(outside, |(low, high), sample| {
        (low.min(sample.depth.0), high.max(sample.depth.0))
    })
}

/// The force if it never changes beyond rounding.
pub(super) fn constant_force(samples: &[FitSample]) -> Option<f64> {
    let mut forces = samples
        .iter()
        .filter(|sample| sample.is_measured())
        .map(|sample| sample.force.0);
    let first = forces.next()?;
    forces
        .all(|force| (force - first).abs() <= 1e-12 * first.abs())
        .then_some(first)
}

pub(super) fn force_square(samples: &[FitSample], sigma_scale: f64) -> f64 {
    samples
        .iter()
        .filter(|sample| sample.is_measured())
        .map(|sample| (sample.force.0 * sigma_scale / sample.sigma.0).powi(2))
        .sum()
}
