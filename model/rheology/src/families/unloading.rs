//! Unloading: the modified Kelvin body that is softer where it has been deeper.

use super::family::{Family, OuterParameter};
use super::power_series::PowerSeries;
use super::relaxation::{DepthDrive, RelaxationTerm, SOFTENING_MAX};
use super::table::FamilyKind;
use std::sync::Arc;

/// `F + tau_eps F' = mu1 x + .. + mun x^n + tau_sig x x' + (s1 x + s2 x^2 + s3 x^3) (1 - x / x_max)`,
/// with `x_max` the greatest depth so far.
///
/// Loading deeper than ever before, the last term is zero and the body is [`PowerSeries`]. Coming back,
/// and loading again up to `x_max`, it is what was lost (a negative force) in the manner of Mullins,
/// "Softening of rubber by deformation", Rubber Chem. Technol. 42 (1969) 339: the elastic force depends
/// on the depth and on the greatest depth so far. Ogden & Roxburgh, "A pseudo-elastic model for the
/// Mullins effect in filled rubber", Proc. R. Soc. Lond. A 455 (1999) 2861, multiply by a function
/// of the energy; here a cubic stands for whatever function it is, because it is linear in its
/// coefficients and has an exact step. Three powers, for a loop may be thick near the surface, in the middle
/// or near the turning point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Unloading {
    loading: PowerSeries,
    order: usize,
}

/// Units of `s1 ..= s3`.
const UNITS: [&str; SOFTENING_MAX] = ["N/mm", "N/mm^2", "N/mm^3"];

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "unloading",
    of: |number| {
        let order = number?;
        PowerSeries::of_order(order).map(|loading| Arc::new(Unloading { loading, order }) as _)
    },
    compared: Some(3..=3),
};

impl Family for Unloading {
    fn key(&self) -> String {
        format!("unloading-{}", self.order)
    }

    fn name(&self) -> String {
        format!("{}, softer after greater depth", self.loading.name())
    }

    fn equation(&self) -> &'static str {
        "F + tau_eps F' = mu1 x + .. + mun x^n + tau_sig x x' + (s1 x + s2 x^2 + s3 x^3) (1 - x/x_max)"
    }

    fn cannot_represent(&self) -> &'static str {
        "more than one relaxation time; recovery of lost stiffness; a second loading that differs from the unloading before it; depths beyond the data"
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        vec![(self.loading.key(), "softness after greater depth")]
    }

    fn outer(&self) -> Vec<OuterParameter> {
        self.loading.outer()
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        let softening = (1..).zip(UNITS).map(|(k, unit)| (format!("s{k}"), unit));
        self.loading.linear().into_iter().chain(softening).collect()
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        let softening = (1..=SOFTENING_MAX)
            .map(|k| vec![RelaxationTerm::settling(DepthDrive::softening(k, 1.0), outer[0])]);
        let loading = self.loading.columns(outer);
        loading.into_iter().chain(softening).collect()
    }

    fn fading(&self, outer: &[f64]) -> Option<f64> {
        self.loading.fading(outer)
    }
}
