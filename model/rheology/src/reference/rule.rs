//! The textbook step of an approximate integrator, with all its stages, in many digits.

use super::REFERENCE_DIGITS;
use super::digits::{Big, Digits, nearest};
use super::psi::Weights;
use crate::families::StepError;
use crate::integrators::{Scheme, SeriesBody};
use palpate_model::units::{Depth, Newtons, Seconds};

/// A body stepped by a rule, in many digits. The exact scheme is [`Reference`](super::Reference)'s.
#[derive(Clone, Debug)]
pub struct RuleReference {
    digits: Digits,
    scheme: Scheme,
    tau: Big,
    /// `mu1 ..`, in N/mm^k.
    mu: Vec<Big>,
    tau_sig: Big,
    depth: Big,
    force: Big,
}

impl RuleReference {
    /// The body relaxed at `depth`, in at least so many decimal digits, no fewer than
    /// [`REFERENCE_DIGITS`]; `None` for the exact scheme, a body that is none or a depth that is no number.
    #[must_use]
    pub fn new<const N: usize>(
        scheme: Scheme,
        body: &SeriesBody<N>,
        depth: Depth,
        digits: usize,
    ) -> Option<Self> {
        scheme.order()?;
        let body = body.checked().ok().filter(|_| depth.is_finite())?;
        let digits = Digits::decimal(digits.max(REFERENCE_DIGITS));
        let mut reference = Self {
            digits,
            scheme,
            tau: digits.exact(body.tau_eps),
            mu: body.mu.map(|mu| digits.exact(mu)).to_vec(),
            tau_sig: digits.exact(body.tau_sig),
            depth: digits.exact(depth.0.max(0.0)),
            force: digits.zero(),
        };
        reference.force = reference.elastic(&reference.depth);
        Some(reference)
    }

    /// Takes the rule's step to `depth` within `dt` and returns the double nearest its force. On an
    /// error it has not moved.
    pub fn step(&mut self, depth: Depth, dt: Seconds) -> Result<Newtons, StepError> {
        if !depth.is_finite() {
            return Err(StepError::Depth(depth.0));
        }
        if !(dt.0 > 0.0 && dt.is_finite()) {
            return Err(StepError::Time(dt.0));
        }
        let (span, to) = (self.digits.exact(dt.0), self.digits.exact(depth.0.max(0.0)));
        let speed = (&to - &self.depth) / &span;
        let middle = (&self.depth + &to) / self.digits.whole(2);
        let [left, middle, right] =
            [&self.depth, &middle, &to].map(|x| self.elastic(x) + &self.tau_sig * x * &speed);
        let [one, two] = [1, 2].map(|value| self.digits.whole(value));
        let h = &span / &self.tau;
        let force = &self.force;
        self.force = match self.scheme {
            Scheme::ExplicitEuler => force + &h * (&left - force),
            Scheme::ImplicitEuler => (force + &h * &right) / (&one + &h),
            Scheme::Trapezoid => ((&two - &h) * force + &h * (&left + &right)) / (&two + &h),
            Scheme::ExponentialLeft | Scheme::ExponentialFirstOrder => {
                let Weights { decay, psi, .. } = Weights::new(self.digits, &span, &self.tau, 2);
                let held = decay * force + &psi[0] * &left;
                match self.scheme {
                    Scheme::ExponentialLeft => held,
                    _ => held + &psi[1] * (&right - &left),
                }
            }
            Scheme::RungeKutta => {
                let slope = |forcing: &Big, force: Big| &h * (forcing - force);
                let k1 = slope(&left, force.clone());
                let k2 = slope(&middle, force + &k1 / &two);
                let k3 = slope(&middle, force + &k2 / &two);
                let k4 = slope(&right, force + &k3);
                force + (k1 + &two * (k2 + k3) + k4) / self.digits.whole(6)
            }
            // Refused when it was made.
            Scheme::Exact => self.force.clone(),
        };
        self.depth = to;
        let force = self.force();
        let overflow = StepError::Overflow { from: nearest(&self.depth), to: depth.0, dt: dt.0 };
        force.is_finite().then_some(force).ok_or(overflow)
    }

    /// The double nearest the force.
    pub fn force(&self) -> Newtons {
        Newtons(nearest(&self.force))
    }

    /// By how much a force in N is more than the rule's, in N, to the last digit of a double.
    pub fn error_of(&self, force: Newtons) -> f64 {
        nearest(&(self.digits.exact(force.0) - &self.force))
    }

    fn elastic(&self, x: &Big) -> Big {
        self.mu.iter().rev().fold(Big::ZERO, |sum, mu| (sum + mu) * x)
    }
}
