//! Bands of depth in which something is so, for bodies of any number of terms.

use super::linear::LinearisedBody;
use palpate_model::units::Depth;
use palpate_rheology::families::POWER_MAX;
use palpate_rheology::integrators::SeriesBody;
use serde::{Deserialize, Serialize};

/// From a depth to a deeper one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthBand {
    pub from: Depth,
    /// Where it ends, or the end of the stroke.
    pub to: Depth,
}

/// Depths looked at: bands narrower than a 4000th of the stroke are missed.
const DEPTHS: u32 = 4000;

/// Depths around which small slow cycles return energy: `tau_sig x < tau_eps g'(x)`. Of three terms the same as
/// [`palpate_model::viscoelastic::admissibility::active_cycles`], within the stroke.
#[must_use]
pub fn active_cycles(body: &SeriesBody<POWER_MAX>, deepest: Depth) -> Vec<DepthBand> {
    where_above(deepest, DEPTHS, |depth| LinearisedBody::of(body, depth).lag())
}

/// Depths to which a slow poke returns energy: `tau_sig X^2 / 2 < tau_eps g(X)`.
#[must_use]
pub fn active_pokes(body: &SeriesBody<POWER_MAX>, deepest: Depth) -> Vec<DepthBand> {
    where_above(deepest, DEPTHS, |Depth(x)| {
        // Both sides have a factor x, without which the surface itself is no special place.
        let inner = body.mu.iter().rev().fold(0.0, |sum, mu| sum * x + mu);
        body.tau_eps * inner - 0.5 * body.tau_sig * x
    })
}

/// Where a continuous function of depth is above zero; ends to the last digit by bisection.
pub(super) fn where_above(
    deepest: Depth,
    depths: u32,
    value: impl Fn(Depth) -> f64,
) -> Vec<DepthBand> {
    let at = |i: u32| deepest.0 * f64::from(i) / f64::from(depths);
    let is_above = |x: f64| value(Depth(x)) > 0.0;
    let crossing = |mut low: f64, mut high: f64| {
        let begins = is_above(low);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if is_above(middle) == begins { low = middle } else { high = middle }
        }
        Depth(high)
    };
    let mut bands = Vec::new();
    let mut from = is_above(0.0).then_some(Depth(0.0));
    for i in 1..=depths {
        let (before, here) = (at(i - 1), at(i));
        match (from, is_above(here)) {
            (None, true) => from = Some(crossing(before, here)),
            (Some(begun), false) => {
                bands.push(DepthBand { from: begun, to: crossing(before, here) });
                from = None;
            }
            _ => {}
        }
    }
    bands.extend(from.map(|from| DepthBand { from, to: deepest }));
    bands
}

/// The bands in words, to follow "depths".
pub(super) fn words(bands: &[DepthBand], deepest: Depth) -> String {
    let one = |band: &DepthBand| match (band.from.0 > 0.0, band.to < deepest) {
        (true, true) => format!("between {:.3} and {:.3}", band.from, band.to),
        (true, false) => format!("beyond {:.3}", band.from),
        (false, true) => format!("below {:.3}", band.to),
        (false, false) => format!("down to {:.3}", band.to),
    };
    bands.iter().map(one).collect::<Vec<_>>().join(" and ")
}
