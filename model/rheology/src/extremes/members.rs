//! One member of every family, of any relaxation time, stiffness and depth.

use crate::families::{Family, Model, OuterRange};

/// A member of `family` whose relaxation times begin at `tau` s and which answers `depth` mm held or
/// passed in about `tau` with about `force` N for each coefficient.
///
/// Made from the units of the parameters alone, so that no family can be forgotten. The second
/// coefficient of a power series is negative, as in tissue.
#[must_use]
pub fn make_member(family: &dyn Family, tau: f64, depth: f64, force: f64) -> Model {
    let mut times = 0;
    let outer = family.outer().into_iter().map(|one| match one.range {
        // A decade from time to time.
        OuterRange::Time => {
            times += 1;
            tau * 10f64.powi(times - 1)
        }
        // Force grows e^3 = 20 fold over the depth.
        OuterRange::PerDepth(..) => 3.0 / depth,
        OuterRange::Ratio(low, high) => (low * high).sqrt().min(300.0),
        OuterRange::Share(low, high) => 0.5 * (low + high),
    });
    let outer: Vec<f64> = outer.collect();
    let linear = family.linear().into_iter().enumerate().map(|(index, (name, unit))| {
        let (_, below) = unit.split_once("/mm").unwrap_or((unit, "^0"));
        let power: i32 = match below.strip_prefix('^') {
            Some(power) => power.parse().unwrap_or(1),
            None => 1,
        };
        // Members of a family differ, or columns alike would hide behind each other.
        let size = force / depth.powi(power) / (index + 1) as f64;
        let sign = if name == "mu2" { -1.0 } else { 1.0 };
        sign * size * if unit.contains("*s") { tau } else { 1.0 }
    });
    Model { family: family.key(), outer, linear: linear.collect() }
}
