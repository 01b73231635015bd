//! One record of a fit and what is known of it before any fitting.

use super::sample::{FitError, FitSample, check_samples, check_scale};
use super::thin::Thin;
use std::sync::Arc;

/// A record and its thinned form.
#[derive(Clone, Debug)]
pub(super) struct Record<'a> {
    pub name: &'a str,
    pub samples: &'a [FitSample],
    pub thin: Arc<Thin>,
    /// Samples whose force counts.
    pub measured: usize,
    /// Depths reached, in mm.
    pub depths: (f64, f64),
    /// Weighted sum of squared forces.
    pub force_square: f64,
}

impl<'a> Record<'a> {
    pub fn new(name: &'a str, samples: &'a [FitSample], depth_mm: f64, sigma_scale: f64) -> Self {
        Self {
            name,
            samples,
            thin: Arc::new(Thin::new(samples, depth_mm, sigma_scale)),
            measured: measured(samples),
            depths: depths(samples),
            force_square: force_square(samples, sigma_scale),
        }
    }

    /// Smallest and largest force that counts, in N.
    pub fn forces(&self) -> (f64, f64) {
        let outside = (f64::INFINITY, f64::NEG_INFINITY);
        let measured = self.samples.iter().filter(|sample| sample.is_measured());
        measured.fold(outside, |(low, high), sample| {
            (low.min(sample.force.0), high.max(sample.force.0))
        })
    }

    /// Share of the greatest depth before by which the probe comes back while its force counts, at most.
    pub fn return_share(&self) -> f64 {
        let (mut deepest, mut share) = (0.0f64, 0.0f64);
        for sample in self.samples {
            deepest = deepest.max(sample.depth.0);
            if sample.is_measured() && deepest > 0.0 {
                share = share.max(1.0 - sample.depth.0.max(0.0) / deepest);
            }
        }
        share
    }
}

/// Refuses what no fit of so many parameters of its own can take; gives the greatest depth past contact in mm, a contact
/// that is not known being at the shallowest depth.
pub(super) fn check(
    samples: &[FitSample],
    own: usize,
    contact: Option<f64>,
) -> Result<f64, FitError> {
    let measured = measured(samples);
    if measured < own.max(2) {
        return Err(FitError::TooFewSamples { samples: measured, parameters: own.max(2) });
    }
    check_samples(samples)?;
    let (shallowest, deepest) = depths(samples);
    if shallowest == deepest {
        return Err(FitError::ConstantDepth { depth: deepest });
    }
    if let Some(force) = constant_force(samples) {
        return Err(FitError::ConstantForce { force });
    }
    let contact = contact.unwrap_or(shallowest);
    if deepest <= contact {
        return Err(FitError::NeverInTissue { deepest, contact });
    }
    check_scale(samples)?;
    Ok(deepest - contact)
}

fn measured(samples: &[FitSample]) -> usize {
    samples.iter().filter(|sample| sample.is_measured()).count()
}

/// Shallowest and deepest sample in mm.
fn depths(samples: &[FitSample]) -> (f64, f64) {
    let outside = (f64::INFINITY, f64::NEG_INFINITY);
    samples
        .iter()
        .fold(outside, |(low, high), sample| (low.min(sample.depth.0), high.max(sample.depth.0)))
}

/// The force if it never changes beyond rounding.
fn constant_force(samples: &[FitSample]) -> Option<f64> {
    let mut forces =
        samples.iter().filter(|sample| sample.is_measured()).map(|sample| sample.force.0);
    let first = forces.next()?;
    forces.all(|force| (force - first).abs() <= 1e-12 * first.abs()).then_some(first)
}

fn force_square(samples: &[FitSample], sigma_scale: f64) -> f64 {
    samples
        .iter()
        .filter(|sample| sample.is_measured())
        .map(|sample| (sample.force.0 * sigma_scale / sample.sigma.0).powi(2))
        .sum()
}
