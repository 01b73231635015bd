//! The fractional Zener body: a spring beside a spring in series with a spring-pot.

use super::family::OuterRange;
use super::spectrum::Spectrum;
use super::table::FamilyKind;
use palpate_model::viscoelastic::rate_shares;
use std::f64::consts::LN_10;

/// Relaxation modulus `k0 + k1 E_alpha(-(t / tau)^alpha)`, with the Mittag-Leffler function; as an
/// equation `F + tau^alpha D^alpha F = k0 x + (k0 + k1) tau^alpha D^alpha x`.
///
/// Mainardi, "Fractional Calculus and Waves in Linear Viscoelasticity", section 3.2. The function is a mixture of exponentials,
/// so the body is a fixed pattern of Maxwell bodies ([`rate_shares`]).
static FRACTIONAL: Spectrum = Spectrum {
    word: "fractional",
    name: "fractional Kelvin-Zener",
    equation: "F + tau^alpha D^alpha F = k0 x + (k0 + k1) tau^alpha D^alpha x",
    cannot_represent: "stiffness that grows with depth; unloading that differs from loading; an exponent alpha above 0.95, which is practically the standard linear solid",
    adds: "a continuous spectrum of relaxation times",
    exponent: ("alpha", OuterRange::Share(0.1, 0.95)),
    digits_max: 14,
    shares,
};

pub(super) const KIND: FamilyKind =
    FamilyKind { word: "fractional", of: |number| FRACTIONAL.family(number), compared: None };

/// Relaxation times that no recording resolves, relative to `tau`: twelve
/// decades either way; what lies beyond is lumped into a dashpot and a spring.
const DECADES: f64 = 12.0;

fn shares(digits: u32, alpha: f64) -> Vec<(f64, f64)> {
    let reach = DECADES * LN_10;
    let shares = rate_shares(alpha, f64::from(digits) * LN_10, [-reach, reach]);
    shares.into_iter().map(|one| (one.ln_rate, one.share)).collect()
}
