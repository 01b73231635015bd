//! Power series in the modified Kelvin body: the elastic part cut off after one to five terms.

use super::family::{Family, Kernel, OuterParameter, OuterRange};
use super::relaxation::{DepthDrive, POWER_MAX, RelaxationTerm};
use super::table::FamilyKind;
use std::sync::Arc;

/// `F + tau_eps F' = mu1 x + .. + mun x^n + tau_sig x x'`.
///
/// Equations 3.1 and 3.3 of the thesis this project implements; its own order is three.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PowerSeries {
    order: usize,
}

/// Units of `mu1 ..= mu5`.
const UNITS: [&str; POWER_MAX] = ["N/mm", "N/mm^2", "N/mm^3", "N/mm^4", "N/mm^5"];

const ORDINALS: [&str; POWER_MAX] = ["first", "second", "third", "fourth", "fifth"];

/// Words for the second and each later term.
const ADDED: [&str; POWER_MAX - 1] =
    ["a square of depth", "a cube of depth", "a fourth power of depth", "a fifth power of depth"];

impl PowerSeries {
    pub const THESIS: Self = Self { order: 3 };

    /// The series cut off after `order` terms; `None` unless that is one to five.
    #[must_use]
    pub fn of_order(order: usize) -> Option<Self> {
        (1..=POWER_MAX).contains(&order).then_some(Self { order })
    }
}

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "series",
    of: |number| Some(Arc::new(PowerSeries::of_order(number?)?)),
    compared: Some(1..=POWER_MAX),
};

impl Family for PowerSeries {
    fn key(&self) -> String {
        format!("series-{}", self.order)
    }

    fn name(&self) -> String {
        format!("modified Kelvin, {} order", ORDINALS[self.order - 1])
    }

    fn equation(&self) -> &'static str {
        match self.order {
            1 => "F + tau_eps F' = mu1 x + tau_sig x x'",
            2 => "F + tau_eps F' = mu1 x + mu2 x^2 + tau_sig x x'",
            3 => "F + tau_eps F' = mu1 x + mu2 x^2 + mu3 x^3 + tau_sig x x' (equation 3.3)",
            4 => "F + tau_eps F' = mu1 x + mu2 x^2 + mu3 x^3 + mu4 x^4 + tau_sig x x'",
            _ => "F + tau_eps F' = mu1 x + mu2 x^2 + mu3 x^3 + mu4 x^4 + mu5 x^5 + tau_sig x x'",
        }
    }

    fn cannot_represent(&self) -> &'static str {
        "more than one relaxation time; unloading that differs from loading; depths beyond the data, where a power series diverges"
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        match self.order {
            0 | 1 => Vec::new(),
            order => vec![(format!("series-{}", order - 1), ADDED[order - 2])],
        }
    }

    fn outer(&self) -> Vec<OuterParameter> {
        vec![OuterParameter::new("tau_eps", "s", OuterRange::Time)]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        let mu = (1..=self.order).map(|k| (format!("mu{k}"), UNITS[k - 1]));
        mu.chain([("tau_sig".to_owned(), "N*s/mm^2")]).collect()
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        let tau = outer[0];
        let elastic =
            (1..=self.order).map(|k| RelaxationTerm::settling(DepthDrive::power(k, 1.0), tau));
        // x x' is the rate of x^2 / 2.
        let viscous = RelaxationTerm::driven(DepthDrive::power(2, 0.5), tau);
        elastic.chain([viscous]).map(|term| vec![term]).collect()
    }

    fn kernel(&self) -> Kernel {
        match *self == Self::THESIS {
            true => Kernel::ThirdOrder,
            false => Kernel::Terms,
        }
    }

    fn fading(&self, outer: &[f64]) -> Option<f64> {
        Some(outer[0])
    }
}
