//! The model family, as distinct from a fitted model.

use super::model::ModelParameter;
use super::relaxation::RelaxationTerm;
use std::fmt::Debug;
use std::sync::Arc;

/// A family of force models: an equation whose parameters are not known yet.
///
/// For given outer parameters the force is a linear combination of columns, each the exact response
/// of a few relaxation terms to the depth history; so the fit of any family is a search over its
/// outer parameters with a linear problem inside.
pub trait Family: Debug + Send + Sync {
    /// Short name for files and the command line, such as `series-3`.
    fn key(&self) -> String;

    fn name(&self) -> String;

    /// The equation, with its source.
    fn equation(&self) -> &'static str;

    /// What no choice of parameters can represent, in one sentence.
    fn cannot_represent(&self) -> &'static str;

    /// Families that it is with something more, and that in words.
    fn adds_to(&self) -> Vec<(String, &'static str)> {
        Vec::new()
    }

    /// Parameters in which it is not linear.
    fn outer(&self) -> Vec<OuterParameter>;

    /// Its coefficients: name and unit.
    fn linear(&self) -> Vec<(String, &'static str)>;

    /// The columns for outer parameters in their units, one for each coefficient.
    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>>;

    /// The same parameters with a coarser and cheaper response, to search with; `None` where the
    /// response is cheap already.
    fn coarse(&self) -> Option<Arc<dyn Family>> {
        None
    }

    /// Whether a coefficient must not be negative.
    fn is_non_negative(&self, _coefficient: usize) -> bool {
        false
    }

    /// The relaxation time, in s, by which a force present at the start fades; `None` where the
    /// family has none or many.
    fn fading(&self, _outer: &[f64]) -> Option<f64> {
        None
    }

    /// Where a fit takes its columns from.
    fn kernel(&self) -> Kernel {
        Kernel::Terms
    }

    /// The parameters as its literature writes them, where these are not the coefficients themselves.
    fn derived(&self, _outer: &[f64], _linear: &[f64]) -> Vec<ModelParameter> {
        Vec::new()
    }
}

/// Where a fit takes the columns of a family from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// From the exact responses of its relaxation terms.
    Terms,
    /// From recursions over 64 samples at a time that are made for the modified Kelvin body of third order.
    ThirdOrder,
}

/// A parameter in which a family is not linear.
#[derive(Clone, Debug, PartialEq)]
pub struct OuterParameter {
    pub name: String,
    pub unit: &'static str,
    pub range: OuterRange,
}

impl OuterParameter {
    pub(super) fn new(name: impl Into<String>, unit: &'static str, range: OuterRange) -> Self {
        Self { name: name.into(), unit, range }
    }
}

/// Where an outer parameter is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OuterRange {
    /// A relaxation time: what the records can show, searched by its logarithm.
    Time,
    /// Per mm of depth: between two numbers over the greatest depth, by its logarithm.
    PerDepth(f64, f64),
    /// A positive number between two, by its logarithm.
    Ratio(f64, f64),
    /// A number between two, evenly.
    Share(f64, f64),
}

impl OuterRange {
    /// Whether a model may have this value, or what it must be. The range searched may be narrower.
    pub fn allows(self, value: f64) -> Result<(), &'static str> {
        match self {
            Self::Share(low, high) if !(low..=high).contains(&value) => {
                Err("within the range of its family")
            }
            Self::Time | Self::PerDepth(..) | Self::Ratio(..)
                if !(value > 0.0 && value.is_normal()) =>
            {
                // Subnormal numbers lack digits.
                Err("a finite number of at least 2.3e-308")
            }
            Self::Ratio(..) if value < 1.0 => Err("at least 1"),
            _ => Ok(()),
        }
    }
}
