//! Stretched exponential relaxation: a spring beside one that relaxes after Kohlrausch, Williams and Watts.

use super::family::OuterRange;
use super::spectrum::Spectrum;
use super::table::FamilyKind;
use std::f64::consts::{LN_10, PI};

/// Relaxation modulus `k0 + k1 exp(-(t / tau)^beta)`; the force is `k0 x + k1 int exp(-((t - s) / tau)^beta) x' ds`.
///
/// Kohlrausch 1854; Williams & Watts, Trans. Faraday Soc. 66 (1970) 80-85; of cartilage June, Ly & Fyhrie, Arch.
/// Biochem. Biophys. 483 (2009) 75-80. The modulus is the mean of `exp(-s S)` over a positive stable random number
/// `S`, and Kanter (Ann. Probab. 3 (1975) 697-707, corollary 4.1) has `S = (a(phi) / W)^((1 - beta) / beta)` with `phi` even over `0..pi`,
/// `W` exponential, and `a` as below. So with `p = beta / (1 - beta)`
///
/// ```text
/// exp(-s^beta) = int K(u) exp(-s e^u) du,   K(u) = p / pi int_0^pi w e^-w dphi,   w = a(phi) e^(-p u)
/// a(phi)       = sin((1 - beta) phi) sin(beta phi)^p / sin(phi)^(1 / (1 - beta))
/// ```
///
/// Both integrands are positive and analytic, so the trapezoid rule converges exponentially (Trefethen & Weideman,
/// SIAM Rev. 56 (2014) 385-458), and the body is a fixed pattern of Maxwell bodies.
static STRETCHED: Spectrum = Spectrum {
    word: "stretched",
    name: "stretched exponential (Kohlrausch-Williams-Watts)",
    equation: "F = k0 x + k1 int exp(-((t - s)/tau)^beta) x' ds",
    cannot_represent: "stiffness that grows with depth; unloading that differs from loading; an exponent beta above 0.9, which is practically the standard linear solid",
    adds: "relaxation that slows down with time",
    exponent: ("beta", OuterRange::Share(0.1, 0.9)),
    digits_max: 10,
    shares,
};

pub(super) const KIND: FamilyKind =
    FamilyKind { word: "stretched", of: |number| STRETCHED.family(number), compared: None };

/// Digits beyond those asked for: the bound of the rule grows where a strip of analyticity ends.
const GUARD_DIGITS: f64 = 0.75;
/// Logarithm of relaxation times shorter than `tau` that no recording resolves: twelve decades. What lies
/// beyond is lumped there.
const REACH: f64 = 12.0 * LN_10;

fn shares(digits: u32, beta: f64) -> Vec<(f64, f64)> {
    let accuracy = (f64::from(digits) + GUARD_DIGITS) * LN_10;
    let p = beta / (1.0 - beta);
    // The real part of w stays positive up to +-i pi / (2 p), that of e^u up to +-i pi / 2, and near phi = pi w
    // grows like a power 1 / (1 - beta) of the distance. A rule errs by exp(-2 pi width / step).
    let step = 2.0 * PI * (0.5 * PI / p).min(0.5 * PI) / accuracy;
    let angles = angles(beta, 2.0 * PI * (0.5 * PI * (1.0 - beta)) / accuracy, accuracy);
    // K ends where the smallest w, at phi = 0, is large, and falls like exp(-beta u).
    let least = (1.0 - beta).ln() + p * beta.ln();
    let first = ((least - (accuracy + 4.0).ln()) / (p * step)).floor() as i32;
    let (last, share_of_last) = end((accuracy / beta).min(REACH) / step);
    let mut shares: Vec<(f64, f64)> = (first..=last)
        .map(|m| {
            let u = step * f64::from(m);
            let sum = angles.iter().map(|(weight, ln_a)| {
                let w = (ln_a - p * u).exp();
                weight * w * (-w).exp()
            });
            let sum: f64 = sum.filter(|one| one.is_finite()).sum();
            let share = if m == last { share_of_last } else { 1.0 };
            (u, share * step * p * sum)
        })
        .collect();
    // Faster ones are lumped into the fastest two, so that the instantaneous modulus is exact.
    let missing = 1.0 - shares.iter().map(|one| one.1).sum::<f64>();
    if let [.., before, fastest] = shares.as_mut_slice() {
        before.1 += missing * (1.0 - share_of_last);
        fastest.1 += missing * share_of_last;
    }
    shares
}

/// The last of the nodes 1, 2, 3 .. that reach so far, and how much of it counts: a node comes in with nothing, so that
/// a force does not jump where `beta` takes one more.
fn end(reach: f64) -> (i32, f64) {
    let last = reach.ceil();
    (last as i32, reach - (last - 1.0))
}

/// Weights of the mean over `phi`, and `ln a(phi)`: the trapezoid rule over `y`, `phi = pi / (1 + e^-y)`, whose ends
/// lie within `e^-accuracy` of 0 and pi.
fn angles(beta: f64, step: f64, accuracy: f64) -> Vec<(f64, f64)> {
    let (count, share_of_last) = end(accuracy / step);
    let p = beta / (1.0 - beta);
    (-count..=count)
        .map(|m| {
            let y = step * f64::from(m);
            let [phi, rest] = [-y, y].map(|y| PI / (1.0 + y.exp()));
            let sines = ((1.0 - beta) * phi).sin().ln() + p * (beta * phi).sin().ln();
            let ln_a = sines - phi.min(rest).sin().ln() / (1.0 - beta);
            let share = if m.abs() == count { share_of_last } else { 1.0 };
            (share * step * phi * rest / (PI * PI), ln_a)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relaxation_is_the_stretched_exponential_to_as_many_digits_as_asked() {
        for digits in [2, 4, 6, 8] {
            for beta in [0.1, 0.25, 0.5, 0.7, 0.9] {
                let spectrum = shares(digits, beta);
                assert!((spectrum.iter().map(|one| one.1).sum::<f64>() - 1.0).abs() < 1e-14);
                // Twelve decades of time, but those that are lumped at the ends.
                for i in -60..=60 {
                    let s = 10f64.powf(0.1 * f64::from(i));
                    let found = spectrum.iter().map(|(u, share)| share * (-s * u.exp()).exp());
                    let miss = found.sum::<f64>() - (-s.powf(beta)).exp();
                    let allowed = 10f64.powi(-(digits as i32));
                    assert!(miss.abs() < allowed, "{digits} {beta} {s:e}: {miss:e}");
                }
            }
        }
    }

    #[test]
    fn relaxation_changes_evenly_with_beta() {
        // The error changes by 2.5e-5 at most; where a node comes in whole, by 6.5e-5.
        for s in [1e-3f64, 0.1, 1.0, 20.0] {
            let mut before = None;
            for i in 0..=800 {
                let beta = 0.1 + 0.001 * f64::from(i);
                let spectrum = shares(3, beta);
                let shares = spectrum.iter().map(|(u, share)| share * (-s * u.exp()).exp());
                let off = shares.sum::<f64>() - (-s.powf(beta)).exp();
                let moved = (off - before.unwrap_or(off)).abs();
                assert!(moved < 4e-5, "{beta} {s}: {moved:e}");
                before = Some(off);
            }
        }
    }

    #[test]
    fn a_held_step_relaxes_like_the_closed_form() {
        use palpate_model::units::{Depth, Seconds};
        let family = (KIND.of)(Some(8)).unwrap();
        let model = family.model(&[2.0, 0.4], &[0.1, 0.3]).unwrap();
        let mut body = model.at_rest_from(Depth(0.0)).unwrap();
        assert!((body.step(Depth(5.0), Seconds(0.0)).unwrap().0 - 2.0).abs() < 1e-14);
        let mut t: f64 = 0.0;
        for dt in [1e-3, 0.1, 1.9, 8.0, 90.0, 1000.0] {
            t += dt;
            let force = body.step(Depth(5.0), Seconds(dt)).unwrap().0;
            let exact = 5.0 * (0.1 + 0.3 * (-(t / 2.0).powf(0.4)).exp());
            assert!((force - exact).abs() < 1.5e-8, "{t}: {force} {exact}");
        }
    }
}
