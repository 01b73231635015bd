//! The Mittag-Leffler function of a relaxation, as a mixture of exponentials.
//!
//! `E_alpha(-t^alpha)`, `0 < alpha <= 1`, falls from one to zero without a turn: it is the mean of `exp(-t r)` over rates `r` of
//! a positive density (Gorenflo & Mainardi, in "Fractals and Fractional Calculus in Continuum Mechanics", 1997, section 3).
//! The density has a closed integral, whose inverse is the rate below which a share `p` of all rates lies (Kozubowski & Rachev,
//! J. Comput. Anal. Appl. 1 (1999) 177; as random times in Fulger, Scalas & Germano, Phys. Rev. E 77 (2008) 021122),
//!
//! ```text
//! E_alpha(-t^alpha) = int_0^1 exp(-t r(p)) dp,   r(p) = (sin(alpha pi p) / sin(alpha pi (1 - p)))^(1 / alpha)
//! ```
//!
//! With `p = 1 / (1 + e^-w)` the integrand is analytic about all `w`, so the trapezoid rule converges exponentially (Trefethen &
//! Weideman, SIAM Rev. 56 (2014) 385-458): with a step of `alpha s` it errs by about `exp(-pi^2 / s)`.

use std::f64::consts::PI;

/// Rates of `E_alpha(-t^alpha)` about one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateShare {
    /// Of all rates; together one.
    pub share: f64,
    /// Logarithm of the rate.
    pub ln_rate: f64,
    /// By how much `ln_rate` rises with the logarithm of `alpha`.
    pub slope: f64,
}

/// A step of the trapezoid rules whose error is below rounding.
const STEP: f64 = 0.25;
/// `exp(-w)` of this is below rounding.
const REACH: f64 = 40.0;

/// `E_alpha(-x)` for `0 < alpha <= 1` and `x >= 0`, relative error below 1e-14; NaN elsewhere.
///
/// From the rates where `alpha` is at least a half. Below it they spread ever further, and their integral by parts takes over,
/// whose branch points are then no nearer than `pi` to the path,
///
/// ```text
/// E_alpha(-x) = 1 / (alpha pi) int exp(v - e^v) arg(1 + e^(i alpha pi + alpha v) / x) dv
/// ```
#[must_use]
pub fn mittag_leffler(alpha: f64, x: f64) -> f64 {
    if !(alpha > 0.0 && alpha <= 1.0 && x >= 0.0) {
        return f64::NAN;
    }
    if alpha == 1.0 {
        return (-x).exp();
    }
    if alpha >= 0.5 { by_rates(alpha, x) } else { by_parts(alpha, x) }
}

fn by_rates(alpha: f64, x: f64) -> f64 {
    let (step, ln_time) = (STEP * alpha, x.ln() / alpha);
    // Down to the least share that a number can be.
    let [first, last] = [f64::MIN_POSITIVE.ln(), REACH].map(|end| (end / step) as i32);
    let mut sum = 0.0;
    for k in (first..=last).rev() {
        let RateShare { share, ln_rate, .. } = rate_share(alpha, step * f64::from(k));
        let ln_age = ln_rate + ln_time;
        let part = share * (-ln_age.exp()).exp();
        sum += part;
        // What is slower has hardly begun to fall, and its shares fall like those of a geometric series.
        if ln_age < 0.0 && part < 1e-18 * sum {
            break;
        }
    }
    step * sum
}

fn by_parts(alpha: f64, x: f64) -> f64 {
    let (sin, cos) = (alpha * PI).sin_cos();
    let [first, last] = [-REACH, REACH.ln()].map(|end| (end / STEP) as i32);
    let part = |k: i32| {
        let v = STEP * f64::from(k);
        (v - v.exp()).exp() * sin.atan2(x * (-alpha * v).exp() + cos)
    };
    STEP * (first..=last).map(part).sum::<f64>() / (alpha * PI)
}

/// All rates, slowest first, for a rule that errs by less than `exp(-accuracy)`; the slowest and the fastest have what lies beyond.
/// Rates beyond the ends of `ln_rates` are lumped there.
#[must_use]
pub fn rate_shares(alpha: f64, accuracy: f64, ln_rates: [f64; 2]) -> Vec<RateShare> {
    let step = alpha * PI * PI / accuracy;
    let count = (accuracy / step).ceil() as i32;
    let mut shares: Vec<RateShare> = Vec::new();
    for k in -count..=count {
        let RateShare { share, ln_rate, slope } = rate_share(alpha, step * f64::from(k));
        let ends = ln_rates.into_iter().zip([f64::max, f64::min]);
        let lumped =
            ends.fold(ln_rate, |rate, (end, inside): (f64, fn(f64, f64) -> f64)| inside(rate, end));
        match shares.last_mut() {
            Some(last) if last.ln_rate == lumped => last.share += step * share,
            _ => {
                let slope = if lumped == ln_rate { slope } else { 0.0 };
                shares.push(RateShare { share: step * share, ln_rate: lumped, slope });
            }
        }
    }
    let missing = 1.0 - shares.iter().map(|one| one.share).sum::<f64>();
    let last = shares.len() - 1;
    for end in [0, last] {
        shares[end].share += 0.5 * missing;
    }
    shares
}

/// The share of the rates for each unit of `w`, and the rate.
fn rate_share(alpha: f64, w: f64) -> RateShare {
    let [below, above] = [w, -w].map(|w| 1.0 / (1.0 + (-w).exp()));
    let [(sin_below, cot_below), (sin_above, cot_above)] =
        [(below, above), (above, below)].map(|shares| sin_and_cot(alpha, shares));
    let ln_rate = (sin_below / sin_above).ln() / alpha;
    let slope = PI * (below * cot_below - above * cot_above) - ln_rate;
    RateShare { share: below * above, ln_rate, slope }
}

/// Sine and cotangent of `alpha pi` times a share, of which what it lacks to one is known: near `pi` the product would be rounded.
fn sin_and_cot(alpha: f64, (share, rest): (f64, f64)) -> (f64, f64) {
    let (angle, sign) = match alpha * share > 0.5 {
        true => (PI * (1.0 - alpha + alpha * rest), -1.0),
        false => (PI * alpha * share, 1.0),
    };
    (angle.sin(), sign / angle.tan())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In 25 digits, made by `scripts/mittag_leffler_reference.py`.
    #[test]
    fn function_has_the_digits_of_its_reference() {
        let mut worst = 0.0f64;
        let mut count = 0;
        for line in include_str!("../../tests/data/mittag_leffler_reference.txt").lines() {
            if line.starts_with('#') {
                continue;
            }
            let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
            let [alpha, x, exact] = numbers[..] else { panic!("{line}") };
            let off = (mittag_leffler(alpha, x) / exact - 1.0).abs();
            assert!(off < 1e-14, "{line}: {off:e}");
            worst = worst.max(off);
            count += 1;
        }
        println!("off by {worst:e} in {count}");
        assert!(count > 700);
    }

    #[test]
    fn ends_have_their_closed_forms() {
        for alpha in [1e-9, 0.3, 0.7, 1.0] {
            assert_eq!(mittag_leffler(alpha, f64::INFINITY), 0.0);
            assert!((mittag_leffler(alpha, 0.0) - 1.0).abs() < 1e-15);
        }
        for x in [1e-3, 1.0, 30.0] {
            // The geometric series.
            assert!((mittag_leffler(1e-12, x) * (1.0 + x) - 1.0).abs() < 1e-11);
            assert_eq!(mittag_leffler(1.0, x), (-x).exp());
        }
        for (alpha, x) in [(0.0, 1.0), (1.1, 1.0), (0.5, -1.0), (f64::NAN, 1.0), (0.5, f64::NAN)] {
            assert!(mittag_leffler(alpha, x).is_nan(), "{alpha} {x}");
        }
    }

    #[test]
    fn rates_are_those_of_the_function_to_the_accuracy_asked_for() {
        for accuracy in [5.0, 9.0, 18.0] {
            for alpha in [0.05, 0.3, 0.7, 0.95, 0.9999, 1.0] {
                let shares = rate_shares(alpha, accuracy, [-1e9, 1e9]);
                for i in -40..=40 {
                    let t = 10f64.powf(0.2 * f64::from(i));
                    let of_rate = |one: &RateShare| one.share * (-t * one.ln_rate.exp()).exp();
                    let off = shares.iter().map(of_rate).sum::<f64>()
                        - mittag_leffler(alpha, t.powf(alpha));
                    assert!(off.abs() < 0.5 * (-accuracy).exp(), "{accuracy} {alpha} {t}: {off:e}");
                }
            }
        }
    }

    #[test]
    fn lumped_rates_keep_their_shares() {
        let [all, few] = [[-1e9, 1e9], [-3.0, 5.0]].map(|ends| rate_shares(0.4, 20.0, ends));
        assert!(few.len() < all.len() / 4);
        let sum = |shares: &[RateShare], inside: fn(f64) -> bool| -> f64 {
            shares.iter().filter(|one| inside(one.ln_rate)).map(|one| one.share).sum()
        };
        for (among_all, among_few) in [
            (sum(&all, |rate| rate <= -3.0), few[0].share),
            (sum(&all, |rate| rate >= 5.0), few[few.len() - 1].share),
            (sum(&all, |_| true), sum(&few, |_| true)),
        ] {
            assert!((among_all - among_few).abs() < 1e-14, "{among_all} {among_few}");
        }
    }

    #[test]
    fn rates_move_with_alpha_as_their_slopes_say() {
        for alpha in [0.1, 0.5, 0.9, 0.999] {
            let step: f64 = 1e-4 * (1.0 - alpha);
            for w in [-12.0, -2.0, 0.0, 0.3, 5.0, 20.0] {
                let [low, high] = [-step, step].map(|by| rate_share(alpha * by.exp(), w).ln_rate);
                let slope = rate_share(alpha, w).slope;
                let miss = slope - (high - low) / (2.0 * step);
                assert!(miss.abs() < 1e-6 * (1.0 + slope.abs()), "{alpha} {w}: {miss:e}");
            }
        }
    }
}
