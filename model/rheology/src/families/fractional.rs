//! The fractional Zener body: a spring beside a spring in series with a spring-pot.

use super::family::{Family, OuterParameter, OuterRange};
use super::model::ModelParameter;
use super::relaxation::RelaxationTerm;
use super::table::FamilyKind;
use std::f64::consts::PI;
use std::sync::Arc;

/// Relaxation modulus `k0 + k1 E_alpha(-(t / tau)^alpha)`, with the Mittag-Leffler function; as an
/// equation `F + tau^alpha D^alpha F = k0 x + (k0 + k1) tau^alpha D^alpha x`.
///
/// Mainardi, "Fractional Calculus and Waves in Linear Viscoelasticity", section 3.2. The function is
/// an integral of exponentials (Gorenflo & Mainardi 1997, section 3),
/// `E_alpha(-s^alpha) = int K(u) exp(-s e^u) du`, `K = sin(alpha pi) / (2 pi (cosh(alpha u) + cos(alpha pi)))`,
/// and `K` is analytic, so the trapezoid rule converges exponentially (Trefethen & Weideman, SIAM Rev.
/// 56 (2014) 385-458): the body is a fixed pattern of Maxwell bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FractionalZener {
    digits: u32,
}

/// Digits of the modulus unless asked otherwise: a tenth of what a good load cell resolves, for half the
/// relaxation times that six digits take.
pub const FRACTIONAL_DIGITS: u32 = 4;
/// Digits that suffice to find the valley: a percent of the modulus.
const COARSE_DIGITS: u32 = 2;
/// Relaxation times that no recording can tell from none, or from for ever, relative to `tau`: twelve
/// decades either way; what lies beyond is lumped into a dashpot and a spring.
const DECADES: f64 = 12.0;

impl Default for FractionalZener {
    fn default() -> Self {
        Self { digits: FRACTIONAL_DIGITS }
    }
}

impl FractionalZener {
    /// The family with its modulus to about so many digits, 1 to 14; `None` for other numbers.
    #[must_use]
    pub fn of_digits(digits: u32) -> Option<Self> {
        (1..=14).contains(&digits).then_some(Self { digits })
    }

    /// `(u, weight)`: shares of the modulus that relax by `exp(-s e^u)`. Shares beyond the ends are
    /// given to the ends.
    fn spectrum(&self, alpha: f64) -> Vec<(f64, f64)> {
        let accuracy = f64::from(self.digits) * std::f64::consts::LN_10;
        // Nearest poles of K lie at +-i pi (1 - alpha) / alpha, and exp(-s e^u) stays bounded up to
        // +-i pi / 2: the rule errs by exp(-2 pi width / step).
        let width = (PI * (1.0 - alpha) / alpha).min(PI / 2.0);
        let step = 2.0 * PI * width / accuracy;
        // K falls like exp(-alpha |u|).
        let reach = (accuracy / alpha).min(DECADES * std::f64::consts::LN_10);
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
}

pub(super) const KIND: FamilyKind = FamilyKind {
    word: "fractional",
    of: |number| match number {
        None => Some(Arc::new(FractionalZener::default())),
        Some(digits) => {
            let digits = u32::try_from(digits).ok()?;
            Some(Arc::new(FractionalZener::of_digits(digits)?))
        }
    },
    compared: None,
};

impl Family for FractionalZener {
    fn key(&self) -> String {
        if self.digits == FRACTIONAL_DIGITS {
            "fractional".into()
        } else {
            format!("fractional-{}", self.digits)
        }
    }

    fn name(&self) -> String {
        "fractional Kelvin-Zener".into()
    }

    fn equation(&self) -> &'static str {
        "F + tau^alpha D^alpha F = k0 x + (k0 + k1) tau^alpha D^alpha x"
    }

    fn cannot_represent(&self) -> &'static str {
        "stiffness that grows with depth; unloading that differs from loading; alpha above 0.95, which is a Kelvin body"
    }

    fn adds_to(&self) -> Vec<(String, &'static str)> {
        vec![("kelvin".into(), "a continuous spread of relaxation times")]
    }

    fn outer(&self) -> Vec<OuterParameter> {
        vec![
            OuterParameter::new("tau", "s", OuterRange::Time),
            OuterParameter::new("alpha", "", OuterRange::Share(0.1, 0.95)),
        ]
    }

    fn linear(&self) -> Vec<(String, &'static str)> {
        vec![("k_0".into(), "N/mm"), ("k_1".into(), "N/mm")]
    }

    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        RelaxationTerm::spread(outer[0], self.spectrum(outer[1]))
    }

    fn coarse(&self) -> Option<Arc<dyn Family>> {
        (self.digits > COARSE_DIGITS)
            .then(|| Arc::new(Self { digits: COARSE_DIGITS }) as Arc<dyn Family>)
    }

    fn is_non_negative(&self, coefficient: usize) -> bool {
        coefficient > 0
    }

    fn derived(&self, _outer: &[f64], linear: &[f64]) -> Vec<ModelParameter> {
        vec![ModelParameter::new("k_instant", linear[0] + linear[1], "N/mm")]
    }
}
