//! One relaxation time: its drive and its exact step.
//!
//! Every family is a sum of terms `y + tau y' = p(x) + d/dt q(x)`, where `p` (elastic) and `q` (rate)
//! are made of powers and exponentials of depth:
//!
//! * a modified Kelvin body is one term, `p` its elastic polynomial and `q = tau_sig x^2 / 2`;
//! * a spring `s(x)` in series with a dashpot of relaxation time `tau` is `p = 0`, `q = tau s(x)`;
//! * `tau = 0` is a term without memory: a spring `p`, a dashpot `q`.

use super::exponential_step::chi_omega;
use palpate_model::viscoelastic::{CompensatedSum, psi, psi_first};

/// Highest power of depth a drive may have.
pub const POWER_MAX: usize = 5;

/// Highest power of depth in a drive's softening.
pub const SOFTENING_MAX: usize = 3;
/// A force in N that is refused: below it no sum of terms exceeds the largest number, 1.8e308.
const FORCE_MAX: f64 = 1e300;
/// Steps below this share of the relaxation time are jumps: what relaxes within one is beyond all
/// digits, and their psi functions are near the subnormal numbers, below 2.2e-308, which lack digits.
const SUDDEN: f64 = 1e-290;

/// A function of depth that is zero at zero depth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthDrive {
    /// Coefficients of `x, x^2 .. x^5`, in N/mm^k (times s for a rate).
    pub powers: [f64; POWER_MAX],
    /// Amplitude `A` of `A (e^(B x) - 1)`, in N, and `B` in 1/mm.
    pub exponential: Option<(f64, f64)>,
    /// Coefficients of `x^j (1 - x / x_max)`, `j = 1, 2, 3`, with `x_max` the greatest depth so far:
    /// what having been deeper adds, in N/mm^j (times s for a rate). Zero on first loading.
    pub softening: [f64; SOFTENING_MAX],
}

impl DepthDrive {
    /// `coefficient * x^power`, `power` 1 to 5.
    #[must_use]
    pub fn power(power: usize, coefficient: f64) -> Self {
        let mut powers = [0.0; POWER_MAX];
        powers[power - 1] = coefficient;
        Self { powers, ..Self::default() }
    }

    /// `amplitude * (e^(per_mm x) - 1)`.
    #[must_use]
    pub fn exponential(amplitude: f64, per_mm: f64) -> Self {
        Self { exponential: Some((amplitude, per_mm)), ..Self::default() }
    }

    /// `coefficient * x^power (1 - x / x_max)`, `power` 1 to 3.
    #[must_use]
    pub fn softening(power: usize, coefficient: f64) -> Self {
        let mut softening = [0.0; SOFTENING_MAX];
        softening[power - 1] = coefficient;
        Self { softening, ..Self::default() }
    }

    /// The drive times a number.
    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        Self {
            powers: self.powers.map(|value| value * by),
            exponential: self.exponential.map(|(amplitude, b)| (amplitude * by, b)),
            softening: self.softening.map(|value| value * by),
        }
    }

    /// The sum of two drives, if their exponentials have the same `B`.
    fn plus(&self, other: &Self) -> Option<Self> {
        let exponential = match (self.exponential, other.exponential) {
            (Some((one, b)), Some((two, c))) if b == c => Some((one + two, b)),
            (Some(_), Some(_)) => return None,
            (one, two) => one.or(two),
        };
        Some(Self {
            powers: std::array::from_fn(|k| self.powers[k] + other.powers[k]),
            exponential,
            softening: std::array::from_fn(|k| self.softening[k] + other.softening[k]),
        })
    }

    /// Its polynomial part by power, the constant first, after `x_max`; without a greatest depth
    /// nothing has softened.
    fn polynomial(&self, x_max: Option<f64>) -> [f64; POWER_MAX + 1] {
        let mut all = [0.0; POWER_MAX + 1];
        all[1..].copy_from_slice(&self.powers);
        if let Some(x_max) = x_max {
            for (j, (first, second)) in self.softened(x_max) {
                all[j] += first;
                all[j + 1] += second;
            }
        }
        all
    }

    /// Contribution of softening after `x_max`, as `(j, (a, b))` for `a x^j + b x^(j+1)`. A depth too small to
    /// divide by has softened nothing.
    #[inline]
    fn softened(&self, x_max: f64) -> impl Iterator<Item = (usize, (f64, f64))> {
        let pairs = self.softening.into_iter().map(move |s| (s, -s / x_max));
        (1..).zip(pairs).filter(|(_, (_, per_mm))| per_mm.is_finite())
    }

    /// Value at depth `x` after `x_max`.
    pub fn at(&self, x: f64, x_max: f64) -> f64 {
        let polynomial = self.polynomial(Some(x_max));
        let sum = polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c);
        match self.exponential {
            Some((amplitude, b)) => sum + amplitude * (b * x).exp_m1(),
            None => sum,
        }
    }

    /// How much more it is at `x1` than at `x0`, both in contact, after `x_max`: without the difference
    /// of the two, which for a small move deep down would leave no digit.
    fn rise(&self, x0: f64, x1: f64, x_max: Option<f64>) -> f64 {
        let polynomial = self.polynomial(x_max);
        // x1^k - x0^k is the move times the complete homogeneous polynomial of the ends.
        let (mut homogeneous, mut power, mut sum) = (0.0, 1.0, 0.0);
        for coefficient in &polynomial[1..] {
            homogeneous = power + x1 * homogeneous;
            power *= x0;
            if *coefficient != 0.0 {
                sum += coefficient * homogeneous;
            }
        }
        sum *= x1 - x0;
        if let Some((amplitude, b)) = self.exponential {
            sum += amplitude * (b * x0).exp() * (b * (x1 - x0)).exp_m1();
        }
        sum
    }

    /// The rise over a straight move, the greatest depth so far being `m0`.
    fn rise_past(&self, x0: f64, x1: f64, m0: f64) -> f64 {
        if x1 > m0 {
            self.rise(x0, m0, Some(m0)) + self.rise(m0, x1, None)
        } else {
            self.rise(x0, x1, Some(m0))
        }
    }

    /// Mean over a straight move from `x0` to `x1`, both in contact, after `x_max`.
    fn mean(&self, x0: f64, x1: f64, x_max: Option<f64>) -> f64 {
        let polynomial = self.polynomial(x_max);
        // The mean of x^k is the complete homogeneous polynomial of the ends over k + 1.
        let (mut homogeneous, mut power, mut sum) = (1.0, 1.0, 0.0);
        for (k, coefficient) in polynomial.iter().enumerate().skip(1) {
            power *= x0;
            homogeneous = power + x1 * homogeneous;
            if *coefficient != 0.0 {
                sum += coefficient * homogeneous / (k + 1) as f64;
            }
        }
        if let Some((amplitude, b)) = self.exponential {
            let turn = b * (x1 - x0);
            let growth = if turn == 0.0 { 1.0 } else { turn.exp_m1() / turn };
            sum += amplitude * ((b * x0).exp() * growth - 1.0);
        }
        sum
    }

    /// Highest power of depth, 0 for none.
    fn degree(&self) -> usize {
        let powers = self.powers.iter().rposition(|value| *value != 0.0);
        // x^j (1 - x / x_max) has one power more.
        let softening = self.softening.iter().rposition(|value| *value != 0.0);
        powers.map_or(0, |k| k + 1).max(softening.map_or(0, |j| j + 2))
    }

    /// Whether it depends on the greatest depth so far.
    pub fn softens(&self) -> bool {
        self.softening.iter().any(|one| *one != 0.0)
    }
}

/// One term `y + tau y' = elastic(x) + d/dt rate(x)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxationTerm {
    /// Relaxation time in s; 0 for a term without memory.
    pub tau: f64,
    /// The limit when depth is held.
    pub elastic: DepthDrive,
    /// The drive by movement, in units of elastic times s.
    pub rate: DepthDrive,
}

impl RelaxationTerm {
    /// A term that tends to `elastic` in `tau` seconds when depth is held.
    #[must_use]
    pub fn settling(elastic: DepthDrive, tau: f64) -> Self {
        Self { tau, elastic, rate: DepthDrive::default() }
    }

    /// A term that movement drives by `rate` and that fades in `tau` seconds.
    #[must_use]
    pub fn driven(rate: DepthDrive, tau: f64) -> Self {
        Self { tau, elastic: DepthDrive::default(), rate }
    }

    #[must_use]
    pub fn spring(elastic: DepthDrive) -> Self {
        Self::settling(elastic, 0.0)
    }

    /// A spring in series with a dashpot that lets it relax in `tau` seconds.
    #[must_use]
    pub fn maxwell(spring: DepthDrive, tau: f64) -> Self {
        Self::driven(spring.scaled(tau), tau)
    }

    /// Columns of a straight spring, and of one beside it whose modulus relaxes by
    /// `sum weight exp(-e^u t / tau)`.
    pub(super) fn spread(tau: f64, spectrum: Vec<(f64, f64)>) -> Vec<Vec<Self>> {
        let spring = DepthDrive::power(1, 1.0);
        let relaxing = spectrum
            .into_iter()
            .map(|(u, weight)| Self::maxwell(spring, tau * (-u).exp()).scaled(weight));
        vec![vec![Self::spring(spring)], relaxing.collect()]
    }

    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        Self { tau: self.tau, elastic: self.elastic.scaled(by), rate: self.rate.scaled(by) }
    }

    /// The sum of two terms of one relaxation time, `None` if it is not one term.
    pub fn plus(&self, other: &Self) -> Option<Self> {
        if self.tau != other.tau {
            return None;
        }
        Some(Self {
            tau: self.tau,
            elastic: self.elastic.plus(&other.elastic)?,
            rate: self.rate.plus(&other.rate)?,
        })
    }

    /// Highest power of depth in the drive along a straight piece, where a rate's power is one less.
    pub(crate) fn degree(&self) -> usize {
        let rate = self.rate.degree().saturating_sub(1);
        self.elastic.degree().max(rate)
    }
}

/// `psi_0 ..= psi_degree`, zero above.
#[inline]
fn psi_through(degree: usize, r: f64) -> [f64; POWER_MAX + 1] {
    let mut all = [0.0; POWER_MAX + 1];
    match degree {
        0 => all[0] = psi(0, r),
        1 => all[..2].copy_from_slice(&psi_first::<2>(r)),
        _ => all = psi_first(r),
    }
    all
}

/// Of a step shorter than this share of the relaxation time the mean is that of its ends: what relaxes in
/// between is a smaller share still, and the difference of both ends has no digits to divide by.
const SLOW: f64 = 1e-8;

/// A straight piece of depth in contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthPiece {
    pub x0: f64,
    pub d: f64,
    /// Duration in s, above zero.
    pub dt: f64,
    /// Greatest depth so far; constant over the piece, or the depth itself where `primary`.
    pub x_max: f64,
    /// Deeper than ever before: nothing is softened.
    pub primary: bool,
}

/// A term and its present value.
#[derive(Clone, Debug)]
pub(super) struct RelaxationState {
    pub term: RelaxationTerm,
    /// Whether its elastic part or its rate depends on the greatest depth so far.
    pub softens: bool,
    value: CompensatedSum,
    dt: f64,
    psi: [f64; POWER_MAX + 1],
    /// Highest power of depth in the drive along a straight piece.
    degree: usize,
    /// A step so short beside the relaxation time that it is a jump.
    is_sudden: bool,
    /// Change of the value by the next [`RelaxationState::settle`].
    pending: f64,
}

impl RelaxationState {
    /// A term held for ever at a depth in contact.
    pub fn relaxed(term: RelaxationTerm, depth: f64) -> Self {
        Self {
            term,
            softens: term.elastic.softens() || term.rate.softens(),
            value: CompensatedSum::new(term.elastic.at(depth, depth)),
            dt: f64::NAN,
            psi: [0.0; POWER_MAX + 1],
            degree: term.degree(),
            is_sudden: false,
            pending: 0.0,
        }
    }

    pub fn value(&self) -> f64 {
        self.value.value
    }

    /// Prepares a step; `false` if its drive is not a finite number.
    #[inline]
    pub fn prepare(&mut self, piece: &DepthPiece) -> bool {
        if piece.dt != self.dt {
            self.dt = piece.dt;
            let r = piece.dt / self.term.tau;
            self.psi = psi_through(self.degree, r);
            self.is_sudden = r < SUDDEN;
        }
        if self.is_sudden {
            let x_max = (!piece.primary).then_some(piece.x_max);
            let rise = self.term.rate.rise(piece.x0, piece.x0 + piece.d, x_max);
            self.pending = rise / self.term.tau;
            return self.is_bounded();
        }
        let DepthPiece { x0, d, dt, .. } = *piece;
        // Powers that no drive has must not be formed: they may be no numbers where the force is one.
        let (speed, degree) = (d / dt, self.degree);
        let mut sum = if degree == 0 {
            self.term.rate.powers[0] * speed * self.psi[0]
        } else {
            let mut c = self.polynomial(piece, speed);
            // Taylor coefficients of the polynomial at x0 by repeated synthetic division.
            for low in 0..degree {
                for k in (low..degree).rev() {
                    c[k] += x0 * c[k + 1];
                }
            }
            // Nested, for a power of the move alone may be beyond all numbers where the force is not.
            let weighted = c[..=degree].iter().zip(&self.psi).rev();
            weighted.fold(0.0, |sum, (c, psi)| sum * d + c * psi)
        };
        if self.term.elastic.exponential.is_some() || self.term.rate.exponential.is_some() {
            sum += self.exponential(piece, speed);
        }
        self.pending = sum;
        self.is_bounded()
    }

    /// Whether the next value, and any sum of them, is a number.
    #[inline]
    fn is_bounded(&self) -> bool {
        self.pending.abs() < FORCE_MAX && self.value.value.abs() < FORCE_MAX
    }

    /// Coefficients by power of depth of the drive along the piece.
    #[inline]
    fn polynomial(&self, piece: &DepthPiece, speed: f64) -> [f64; POWER_MAX + 1] {
        let RelaxationTerm { elastic, rate, .. } = &self.term;
        let mut c = [0.0; POWER_MAX + 1];
        for k in 1..=POWER_MAX {
            c[k] += elastic.powers[k - 1];
            c[k - 1] += k as f64 * rate.powers[k - 1] * speed;
        }
        if self.softens && !piece.primary {
            for (j, (first, second)) in elastic.softened(piece.x_max) {
                c[j] += first;
                c[j + 1] += second;
            }
            for (j, (first, second)) in rate.softened(piece.x_max) {
                c[j - 1] += j as f64 * first * speed;
                c[j] += (j + 1) as f64 * second * speed;
            }
        }
        c
    }

    /// Contribution of the exponentials over the piece.
    fn exponential(&self, piece: &DepthPiece, speed: f64) -> f64 {
        if piece.d == 0.0 {
            // Held: no rate, and the elastic part stands still.
            return self
                .term
                .elastic
                .exponential
                .map_or(0.0, |(amplitude, b)| amplitude * (b * piece.x0).exp_m1() * self.psi[0]);
        }
        let r = piece.dt / self.term.tau;
        let mut sum = 0.0;
        if let Some((amplitude, b)) = self.term.elastic.exponential {
            let (_, omega) = chi_omega(b * piece.d, r);
            let start = b * piece.x0;
            sum += amplitude * (start.exp_m1() * self.psi[0] + start.exp() * omega);
        }
        if let Some((amplitude, b)) = self.term.rate.exponential {
            let (chi, _) = chi_omega(b * piece.d, r);
            sum += amplitude * b * speed * (b * piece.x0).exp() * chi;
        }
        sum
    }

    /// Mean of the term over a step, its value having been `before`: integrating `y + tau y' = u` needs
    /// no more than both ends.
    pub fn mean(&self, before: f64, piece: &DepthPiece) -> f64 {
        let RelaxationTerm { tau, elastic, rate } = &self.term;
        if piece.dt < SLOW * tau {
            return 0.5 * (before + self.value());
        }
        let x_max = (!piece.primary).then_some(piece.x_max);
        let (x0, x1) = (piece.x0, piece.x0 + piece.d);
        let driven = rate.at(x1, piece.x_max.max(x1)) - rate.at(x0, piece.x_max.max(x0));
        elastic.mean(x0, x1, x_max) + (driven - tau * (self.value() - before)) / piece.dt
    }

    #[inline]
    pub fn settle(&mut self) {
        self.value.relax(self.pending, self.psi[0]);
    }

    /// Whether it can move from `x0` to `x1` in no time: a dashpot alone would need an infinite force.
    pub fn can_jump(&self, [x0, x1]: [f64; 2], [m0, _]: [f64; 2]) -> bool {
        self.term.tau > 0.0 || self.term.rate.rise_past(x0, x1, m0) == 0.0
    }

    /// Prepares a move from `x0` to `x1` in no time, which the elastic memory does not feel; `false`
    /// where the force is too large for a number.
    pub fn prepare_jump(&mut self, [x0, x1]: [f64; 2], [m0, m1]: [f64; 2]) -> bool {
        let RelaxationTerm { tau, elastic, rate } = &self.term;
        self.pending = if *tau == 0.0 {
            // Without memory it is where the elastic part is.
            elastic.at(x1, m1) - self.value.value
        } else {
            rate.rise_past(x0, x1, m0) / tau
        };
        self.is_bounded()
    }

    pub fn settle_jump(&mut self) {
        self.value.add(self.pending);
    }
}
