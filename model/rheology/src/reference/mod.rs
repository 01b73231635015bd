//! Forces in many digits: what every integrator and every family is measured against.
//!
//! Depth moves straight between the points given and each term's response to that is written down in
//! closed form, like the exact step of [`crate::families`], but in as many digits as asked for and
//! without its rearrangements: `y(+) = e^-r y + w` with the weights of [`psi`](palpate_model::viscoelastic::psi).
//! Inputs are doubles and count as exact; what differs from the doubles' answer is theirs.

mod digits;
mod psi;
mod rule;

use crate::families::{DepthDrive, POWER_MAX, RelaxationTerm, StepError};
use digits::{Big, Digits, is_negative, is_zero, nearest};
use palpate_model::units::{Depth, Newtons, Seconds};
use psi::Weights;
pub use rule::RuleReference;
use thiserror::Error;

/// Decimals digits carried unless asked otherwise: fifty that count, and a guard for the cancellation of
/// the closed forms, which costs the digits of the ratio of times and depths (twelve decades each).
pub const REFERENCE_DIGITS: usize = 75;

/// Exponents of e beyond this are refused: doubles end at 710.
const EXPONENT_MAX: f64 = 1e5;

/// A force that the reference does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ReferenceError {
    #[error("a reference cannot have {0} digits; choose from 20 to 1000")]
    Digits(usize),
    #[error("the force at rest at this depth is too large to compute")]
    Overflow,
    #[error(
        "a term with a negative relaxation time or a coefficient that is not finite gives no force"
    )]
    Term,
}

/// A sum of relaxation terms moved along a path, in many digits.
#[derive(Clone, Debug)]
pub struct Reference {
    digits: Digits,
    terms: Vec<Term>,
    depth: Big,
    /// Greatest depth so far, where a drive depends on it.
    softened_to: Option<Big>,
}

/// A term with its coefficients and its value.
#[derive(Clone, Debug)]
struct Term {
    tau: Big,
    elastic: Function,
    rate: Function,
    /// Highest power of depth along a straight piece.
    degree: usize,
    value: Big,
    /// Duration of the last step and its weights.
    weights: Option<(Big, Weights)>,
}

/// A drive: powers of depth from the first on, and `A (e^(B x) - 1)`.
#[derive(Clone, Debug)]
struct Function {
    powers: Vec<Big>,
    /// Coefficients of `x^j (1 - x / x_max)`, `j` from 1 on.
    softening: Vec<Big>,
    exponential: Option<(Big, Big)>,
}

impl Reference {
    /// Terms relaxed with the probe at `depth`, in [`REFERENCE_DIGITS`].
    pub fn new(terms: &[RelaxationTerm], depth: Depth) -> Result<Self, ReferenceError> {
        Self::with_digits(terms, depth, REFERENCE_DIGITS)
    }

    /// Terms relaxed with the probe at `depth`, in at least so many decimal digits, 20 to 1000.
    pub fn with_digits(
        terms: &[RelaxationTerm],
        depth: Depth,
        digits: usize,
    ) -> Result<Self, ReferenceError> {
        if !(20..=1000).contains(&digits) {
            return Err(ReferenceError::Digits(digits));
        }
        if !depth.is_finite() {
            return Err(ReferenceError::Term);
        }
        let digits = Digits::decimal(digits);
        let softens = terms.iter().any(|term| term.elastic.softens() || term.rate.softens());
        let terms: Result<Vec<Term>, ReferenceError> =
            terms.iter().map(|term| Term::new(digits, term, depth)).collect();
        Ok(Self {
            digits,
            terms: terms?,
            depth: digits.exact(depth.0),
            softened_to: softens.then(|| digits.exact(depth.0.max(0.0))),
        })
    }

    /// Moves straight to `depth` within `dt` and returns the double nearest the force there. After an
    /// overflow it has moved, after any other error it has not.
    pub fn step(&mut self, depth: Depth, dt: Seconds) -> Result<Newtons, StepError> {
        if !depth.is_finite() {
            return Err(StepError::Depth(depth.0));
        }
        if !(dt.0 >= 0.0 && dt.is_finite()) {
            return Err(StepError::Time(dt.0));
        }
        if self.terms.iter().any(|term| term.is_beyond(depth)) {
            return Err(StepError::Overflow { from: nearest(&self.depth), to: depth.0, dt: dt.0 });
        }
        let to = self.digits.exact(depth.0);
        let from = std::mem::replace(&mut self.depth, to.clone());
        let span = self.digits.exact(dt.0);
        let zero = self.digits.zero();
        if is_zero(&span) {
            let ends = [from.clone().max(zero.clone()), to.max(zero)];
            let before = self.softened_to.clone();
            let after = before.clone().map(|deepest| deepest.max(ends[1].clone()));
            let deepest = [before.as_ref(), after.as_ref()];
            let driven =
                |term: &Term| is_zero(&term.tau) && !is_zero(&term.impulse(&ends, deepest));
            if self.terms.iter().any(driven) {
                let from_depth = nearest(&from);
                self.depth = from;
                return Err(StepError::Jump { from: from_depth, to: depth.0 });
            }
            self.terms.iter_mut().for_each(|term| term.jump(&ends, deepest));
            self.softened_to = after;
            return self.finite_force(nearest(&from), dt);
        }
        let from_depth = nearest(&from);
        // The path is cut where it crosses the surface; outside depth counts as zero.
        if is_negative(&from) == is_negative(&to) {
            self.in_contact(&from.max(zero.clone()), &to.max(zero), &span);
        } else {
            let before = &span * (&from / (&from - &to));
            let after = &span - &before;
            for (a, b, part) in [(&from, &zero, before), (&zero, &to, after)] {
                if !is_zero(&part) {
                    self.in_contact(
                        &a.clone().max(zero.clone()),
                        &b.clone().max(zero.clone()),
                        &part,
                    );
                }
            }
        }
        self.finite_force(from_depth, dt)
    }

    fn finite_force(&self, from: f64, dt: Seconds) -> Result<Newtons, StepError> {
        let force = self.force();
        let overflow = StepError::Overflow { from, to: nearest(&self.depth), dt: dt.0 };
        force.is_finite().then_some(force).ok_or(overflow)
    }

    /// The double nearest the force.
    pub fn force(&self) -> Newtons {
        Newtons(nearest(&self.sum()))
    }

    /// By how much a force in N is more than the exact one, in N, to the last digit of a double.
    pub fn error_of(&self, force: Newtons) -> f64 {
        nearest(&(self.digits.exact(force.0) - self.sum()))
    }

    fn sum(&self) -> Big {
        let zero = self.digits.zero();
        self.terms.iter().fold(zero, |sum, term| sum + &term.value)
    }

    /// A straight move in contact, cut where it becomes deeper than ever before if that matters.
    fn in_contact(&mut self, x0: &Big, x1: &Big, dt: &Big) {
        match self.softened_to.clone() {
            None => self.piece([x0, x1], dt, None),
            Some(deepest) if *x0 < deepest && deepest < *x1 => {
                let known = dt * (&deepest - x0) / (x1 - x0);
                let new = dt * (x1 - &deepest) / (x1 - x0);
                self.piece([x0, &deepest], &known, Some(&deepest));
                self.piece([&deepest, x1], &new, None);
                self.softened_to = Some(x1.clone());
            }
            // Deeper than ever: the depth is the greatest depth, nothing has softened.
            Some(deepest) if x1 > x0 && *x0 >= deepest => {
                self.piece([x0, x1], dt, None);
                self.softened_to = Some(x1.clone());
            }
            Some(deepest) => self.piece([x0, x1], dt, Some(&deepest)),
        }
    }

    fn piece(&mut self, [x0, x1]: [&Big; 2], dt: &Big, deepest: Option<&Big>) {
        for term in &mut self.terms {
            term.advance(self.digits, [x0, &(x1 - x0)], dt, deepest);
        }
    }
}

impl Term {
    fn new(digits: Digits, term: &RelaxationTerm, depth: Depth) -> Result<Self, ReferenceError> {
        let RelaxationTerm { tau, elastic, rate } = term;
        let numbers = [elastic, rate].into_iter().flat_map(|drive| {
            let (amplitude, b) = drive.exponential.unwrap_or_default();
            let powers = drive.powers.into_iter().chain(drive.softening);
            powers.chain([amplitude, b])
        });
        if !(*tau >= 0.0 && tau.is_finite()) || numbers.into_iter().any(|one| !one.is_finite()) {
            return Err(ReferenceError::Term);
        }
        let elastic = Function::new(digits, elastic);
        let rate = Function::new(digits, rate);
        let start = digits.exact(depth.0.max(0.0));
        if elastic.is_beyond(depth) || rate.is_beyond(depth) {
            return Err(ReferenceError::Overflow);
        }
        // A rate counts by its slope.
        let degree = elastic.degree().max(rate.degree().saturating_sub(1));
        Ok(Self {
            degree,
            tau: digits.exact(*tau),
            value: elastic.at(&start, None),
            elastic,
            rate,
            weights: None,
        })
    }

    fn is_beyond(&self, depth: Depth) -> bool {
        self.elastic.is_beyond(depth) || self.rate.is_beyond(depth)
    }

    /// Change of `tau` times the value by a move in no time.
    fn impulse(&self, [x0, x1]: &[Big; 2], [m0, m1]: [Option<&Big>; 2]) -> Big {
        self.rate.at(x1, m1) - self.rate.at(x0, m0)
    }

    fn jump(&mut self, ends: &[Big; 2], deepest: [Option<&Big>; 2]) {
        if is_zero(&self.tau) {
            self.value = self.elastic.at(&ends[1], deepest[1]);
        } else {
            self.value = &self.value + self.impulse(ends, deepest) / &self.tau;
        }
    }

    fn advance(&mut self, digits: Digits, [x0, d]: [&Big; 2], dt: &Big, deepest: Option<&Big>) {
        let weights = match self.weights.take() {
            Some((last, weights)) if last == *dt => weights,
            _ => Weights::new(digits, dt, &self.tau, self.degree + 1),
        };
        let speed = d / dt;
        let mut sum = &self.value * &weights.decay;
        // The drive by power of depth, then about x0 by binomials, then by powers of d.
        let zero = digits.zero();
        let mut c = vec![zero; self.degree + 1];
        let elastic = self.elastic.powers_after(deepest);
        let rate = self.rate.powers_after(deepest);
        for (k, c) in c.iter_mut().enumerate() {
            if k > 0 {
                *c += &elastic[k - 1];
            }
            if k < POWER_MAX {
                *c += digits.whole(k + 1) * &rate[k] * &speed;
            }
        }
        let mut d_power = digits.whole(1);
        for (j, psi) in weights.psi.iter().enumerate() {
            let (mut taylor, mut x_power, mut binomial) =
                (digits.zero(), digits.whole(1), digits.whole(1));
            for (k, c) in c.iter().enumerate().skip(j) {
                taylor += &binomial * c * &x_power;
                x_power *= x0;
                binomial = binomial * digits.whole(k + 1) / digits.whole(k + 1 - j);
            }
            sum += taylor * &d_power * psi;
            d_power *= d;
        }
        if let Some((amplitude, b)) = &self.elastic.exponential {
            let chi = chi(&(b * d), &weights);
            // The part at rest and the part of the move, each without the difference of large numbers.
            let rest = (b * x0).exp_m1() * &weights.psi[0];
            sum += amplitude * (rest + (b * x0).exp() * (chi - &weights.psi[0]));
        }
        if let Some((amplitude, b)) = &self.rate.exponential {
            let chi = chi(&(b * d), &weights);
            sum += amplitude * b * &speed * (b * x0).exp() * chi;
        }
        self.value = sum;
        self.weights = Some((dt.clone(), weights));
    }
}

/// `r int_0^1 e^(b s) e^(-r (1-s)) ds = r (e^b - e^-r) / (b + r)`.
fn chi(b: &Big, weights: &Weights) -> Big {
    let Some(r) = &weights.r else {
        return b.exp();
    };
    if is_zero(b) {
        return weights.psi[0].clone();
    }
    let sum = b + r;
    if is_zero(&sum) {
        return r * &weights.decay;
    }
    r * (b.exp() - &weights.decay) / sum
}

impl Function {
    fn new(digits: Digits, drive: &DepthDrive) -> Self {
        let powers = drive.powers.iter().map(|&value| digits.exact(value));
        let exponential = drive.exponential;
        Self {
            powers: powers.collect(),
            softening: drive.softening.map(|value| digits.exact(value)).to_vec(),
            exponential: exponential
                .map(|(amplitude, b)| (digits.exact(amplitude), digits.exact(b))),
        }
    }

    fn degree(&self) -> usize {
        let last = |all: &[Big]| all.iter().rposition(|c| !is_zero(c));
        let powers = last(&self.powers).map_or(0, |k| k + 1);
        powers.max(last(&self.softening).map_or(0, |j| j + 2))
    }

    /// Coefficients by power of depth after a greatest depth, `None` on first loading.
    fn powers_after(&self, deepest: Option<&Big>) -> Vec<Big> {
        let mut powers = self.powers.clone();
        if let Some(deepest) = deepest.filter(|deepest| !is_zero(deepest)) {
            for (j, softening) in self.softening.iter().enumerate() {
                powers[j] += softening;
                powers[j + 1] -= softening / deepest;
            }
        }
        powers
    }

    /// Whether its exponential is beyond any double by so much that even many digits end.
    fn is_beyond(&self, depth: Depth) -> bool {
        let exponent = |b: &Big| nearest(b) * depth.0;
        let exponential = self.exponential.as_ref();
        exponential.is_some_and(|(_, b)| exponent(b) > EXPONENT_MAX)
    }

    fn at(&self, x: &Big, deepest: Option<&Big>) -> Big {
        let powers = self.powers_after(deepest);
        let sum = powers.iter().rev().fold(Big::ZERO, |sum, c| (sum + c) * x);
        match &self.exponential {
            Some((amplitude, b)) => sum + amplitude * (b * x).exp_m1(),
            None => sum,
        }
    }
}

#[cfg(test)]
mod tests;
