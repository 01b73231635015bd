//! Families of a spring beside one whose modulus relaxes by a continuous spectrum of times.

use super::family::{Family, OuterParameter, OuterRange};
use super::model::ModelParameter;
use super::relaxation::RelaxationTerm;
use std::sync::Arc;

/// One such family.
#[derive(Debug)]
pub(super) struct Spectrum {
    pub word: &'static str,
    pub name: &'static str,
    pub equation: &'static str,
    pub cannot_represent: &'static str,
    /// Its addition to the Kelvin body, in words.
    pub adds: &'static str,
    /// The exponent by its name, and where it is searched.
    pub exponent: (&'static str, OuterRange),
    pub digits_max: u32,
    /// `(u, weight)` for digits of the modulus and the exponent: shares of the modulus that relax by
    /// `exp(-t e^u / tau)`, together one.
    pub shares: fn(u32, f64) -> Vec<(f64, f64)>,
}

/// Digits of the modulus unless asked otherwise: a tenth of what a good load cell resolves, for half the
/// relaxation times that six digits take.
const DIGITS: u32 = 4;
/// Digits that suffice to find the valley: a percent of the modulus.
const COARSE_DIGITS: u32 = 2;

impl Spectrum {
    /// The family of the word alone, or to another number of digits.
    pub fn family(&'static self, number: Option<usize>) -> Option<Arc<dyn Family>> {
        let digits = number.map_or(Some(DIGITS), |one| u32::try_from(one).ok());
        let digits = digits.filter(|one| (1..=self.digits_max).contains(one))?;
        Some(Arc::new(SpectrumFamily { spectrum: self, digits }))
    }
}

/// `F = k_0 x + k_1 int G(t - s) x' ds`, `G` of the spectrum.
#[derive(Debug)]
struct SpectrumFamily {
    spectrum: &'static Spectrum,
    digits: u32,
}

impl Family for SpectrumFamily {
    fn key(&self) -> String {
        match self.digits {
            DIGITS => self.spectrum.word.into(),
            digits => format!("{}-{digits}", self.spectrum.word),
        }
    }

    fn name(&self) -> String {
        self.spectrum.name.into()
    }

    fn equation(&self) -> &'static str {
        self.spectrum.equation
    }

    fn cannot_represent(&self) -> &'static str {
        self.spectrum.cannot_represent
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        vec![("kelvin".into(), self.spectrum.adds)]
    }

    fn outer(&self) -> Vec<OuterParameter> {
        let (name, range) = self.spectrum.exponent;
        vec![
            OuterParameter::new("tau", "s", OuterRange::Time),
            OuterParameter::new(name, "", range),
        ]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("k_0".into(), "N/mm"), ("k_1".into(), "N/mm")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        RelaxationTerm::spread(outer[0], (self.spectrum.shares)(self.digits, outer[1]))
    }

    fn coarse(&self) -> Option<Arc<dyn Family>> {
        let Self { spectrum, .. } = *self;
        let digits = COARSE_DIGITS;
        (self.digits > digits).then(|| Arc::new(Self { spectrum, digits }) as _)
    }

    fn is_non_negative(&self, coefficient: usize) -> bool {
        coefficient > 0
    }

    fn derived(&self, _outer: &[f64], linear: &[f64]) -> Vec<ModelParameter> {
        vec![ModelParameter::new("k_instant", linear[0] + linear[1], "N/mm")]
    }
}
