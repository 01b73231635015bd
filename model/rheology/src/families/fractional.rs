//! The fractional Zener body: a spring beside a spring in series with a spring-pot.

use super::family::OuterRange;
use super::spectrum::Spectrum;
use super::table::FamilyKind;
use std::f64::consts::{LN_10, PI};

/// Relaxation modulus `k0 + k1 E_alpha(-(t / tau)^alpha)`, with the Mittag-Leffler function; as an
/// equation `F + tau^alpha D^alpha F = k0 x + (k0 + k1) tau^alpha D^alpha x`.
///
/// Mainardi, "Fractional Calculus and Waves in Linear Viscoelasticity", section 3.2. The function is
/// an integral of exponentials (Gorenflo & Mainardi 1997, section 3),
/// `E_alpha(-s^alpha) = int K(u) exp(-s e^u) du`, `K = sin(alpha pi) / (2 pi (cosh(alpha u) + cos(alpha pi)))`,
/// and `K` is analytic, so the trapezoid rule converges exponentially (Trefethen & Weideman, SIAM Rev.
/// 56 (2014) 385-458): the body is a fixed pattern of Maxwell bodies.
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

/// Shares beyond the ends are given to the ends.
fn shares(digits: u32, alpha: f64) -> Vec<(f64, f64)> {
    let accuracy = f64::from(digits) * LN_10;
    // Nearest poles of K lie at +-i pi (1 - alpha) / alpha, and exp(-s e^u) stays bounded up to
    // +-i pi / 2: the rule errs by exp(-2 pi width / step).
    let width = (PI * (1.0 - alpha) / alpha).min(PI / 2.0);
    let step = 2.0 * PI * width / accuracy;
    // K falls like exp(-alpha |u|).
    let reach = (accuracy / alpha).min(DECADES * LN_10);
    let count = (reach / step).ceil() as i32;
    let kernel =
        |u: f64| (alpha * PI).sin() / (2.0 * PI * ((alpha * u).cosh() + (alpha * PI).cos()));
    // The whole sum is one; what the tails hold goes to the ends.
    let half: f64 = (1..=count).map(|m| kernel(step * f64::from(m))).sum();
    let tail = 0.5 - step * (half + 0.5 * kernel(0.0));
    (-count..=count)
        .map(|m| {
            let u = step * f64::from(m);
            let extra = if m.abs() == count { tail } else { 0.0 };
            (u, step * kernel(u) + extra)
        })
        .collect()
}
