//! The contact point, from a slow pass at constant speed.
//!
//! Past contact at `x_c` the depth grows as `d = x - x_c = v u`, and a Kelvin body answers
//! `F = c + a_1 d psi_1(u / tau) + a_2 d^2 psi_2(u / tau)`: the closed form of the force model's
//! first two terms, the viscous one merged with the first because the speed is constant. `c` and
//! `a_k` are linear, so for each `(x_c, tau)` they are solved exactly (variable projection, Golub &
//! Pereyra 1973); `x_c` and `tau` are scanned over the whole pass, then refined by Gauss-Newton.

use crate::linalg::Triangle;
use crate::units::{Newtons, Position, Seconds};
use crate::viscoelastic::{psi, psi_derivative};
use thiserror::Error;

/// One averaged sample of the pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// Time in the pass.
    pub t: Seconds,
    /// Commanded position from home.
    pub position: Position,
    /// Force above tare.
    pub force: Newtons,
}

/// The contact position with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEstimate {
    /// Position from home.
    pub position: Position,
    /// Standard error in mm, from the residuals.
    pub std_error_mm: f64,
    /// Residual standard deviation in N.
    pub rmse_n: f64,
}

/// No contact position follows from the pass.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ContactFitError {
    /// Too little data.
    #[error(
        "the slow pass has only {points} points; at least {POINTS_MIN} are needed, so approach more slowly"
    )]
    TooShort { points: usize },
    /// Not a pass forward at one speed.
    #[error(
        "the contact point cannot be determined, because the slow pass did not move at constant speed"
    )]
    NotOneSpeed,
    /// The force shows no onset inside the pass.
    #[error("the force of the slow pass shows no clear onset; press further or reduce the noise")]
    NoOnset,
}

/// Fewer points than this do not carry two outer and three linear parameters.
const POINTS_MIN: usize = 30;

/// Relaxation times scanned, in s: soft tissue under a slow probe.
const TAU_RANGE: [f64; 2] = [0.05, 20.0];
const TAU_COUNT: usize = 12;
const CONTACT_COUNT: usize = 60;

/// Columns: three linear, two derivatives, the response.
type Rows = Triangle<6>;

/// Estimates the contact position from a slow pass at constant speed.
pub fn fit_contact(points: &[ContactPoint]) -> Result<ContactEstimate, ContactFitError> {
    if points.len() < POINTS_MIN {
        return Err(ContactFitError::TooShort { points: points.len() });
    }
    let pass = Pass::new(points)?;
    let start = pass.scan().ok_or(ContactFitError::NoOnset)?;
    let line = |at: Trial| {
        let (step, pass) = (pass.step(at)?, &pass);
        Some(move |share| {
            let next = at.moved(step, share);
            Some((next, pass.cost(next)?))
        })
    };
    // It settles in a few steps from a scanned start.
    let (at, _) = descend(start, 30, |cost| 1e-10 * cost, line);
    pass.estimate(at).ok_or(ContactFitError::NoOnset)
}

/// Gauss-Newton with step halving. `line` gives the trials along the step at a trial, by the share of the step that
/// is taken, each with its cost; a step that gains no more than `gain_min` of the cost is the last.
pub(super) fn descend<T: Copy, L: Fn(f64) -> Option<(T, f64)>>(
    (mut at, mut cost): (T, f64),
    steps_max: usize,
    gain_min: impl Fn(f64) -> f64,
    line: impl Fn(T) -> Option<L>,
) -> (T, f64) {
    for _ in 0..steps_max {
        let Some(trial) = line(at) else { break };
        let better = (0..12)
            .find_map(|halving| trial(0.5f64.powi(halving)).filter(|(_, next)| *next < cost));
        let Some((next, next_cost)) = better else { break };
        let is_settled = cost - next_cost <= gain_min(cost);
        (at, cost) = (next, next_cost);
        if is_settled {
            break;
        }
    }
    (at, cost)
}

/// A trial contact position and relaxation time.
#[derive(Clone, Copy, Debug)]
struct Trial {
    contact: f64,
    log_tau: f64,
}

impl Trial {
    fn moved(self, step: [f64; 2], factor: f64) -> Self {
        let [low, high] = TAU_RANGE.map(f64::ln);
        Self {
            contact: self.contact + factor * step[0],
            log_tau: (self.log_tau + (factor * step[1]).clamp(-1.0, 1.0)).clamp(low, high),
        }
    }
}

struct Pass<'a> {
    points: &'a [ContactPoint],
    speed: f64,
    first: f64,
    last: f64,
}

impl<'a> Pass<'a> {
    fn new(points: &'a [ContactPoint]) -> Result<Self, ContactFitError> {
        let (begin, end) = (points[0], points[points.len() - 1]);
        let speed = (end.position.0 - begin.position.0) / (end.t.0 - begin.t.0);
        let is_straight = points.iter().all(|point| {
            let expected = begin.position.0 + speed * (point.t.0 - begin.t.0);
            // A micrometre: averaged whole ticks of an exact profile differ by rounding only.
            (point.position.0 - expected).abs() < 1e-3 && point.force.is_finite()
        });
        if !(is_straight && speed > 0.0) {
            return Err(ContactFitError::NotOneSpeed);
        }
        Ok(Self { points, speed, first: begin.position.0, last: end.position.0 })
    }

    /// The three linear columns and the two derivatives of the fitted force at a point.
    fn columns(&self, trial: Trial, position: f64, linear: Option<[f64; 6]>) -> [f64; 5] {
        let depth = position - trial.contact;
        if depth <= 0.0 {
            return [1.0, 0.0, 0.0, 0.0, 0.0];
        }
        let r = depth / (self.speed * trial.log_tau.exp());
        let (psi1, psi2) = (psi(1, r), psi(2, r));
        let mut columns = [1.0, depth * psi1, depth * depth * psi2, 0.0, 0.0];
        if let Some(a) = linear {
            let (slope1, slope2) = (psi_derivative(1, r), psi_derivative(2, r));
            let by_r = a[1] * depth * slope1 + a[2] * depth * depth * slope2;
            let by_depth = a[1] * psi1 + 2.0 * a[2] * depth * psi2 + by_r * r / depth;
            columns[3] = -by_depth;
            columns[4] = -by_r * r;
        }
        columns
    }

    fn triangle(&self, trial: Trial, linear: Option<[f64; 6]>) -> Rows {
        let mut rows = Rows::default();
        for point in self.points {
            let [c, a1, a2, by_contact, by_tau] = self.columns(trial, point.position.0, linear);
            rows.push([c, a1, a2, by_contact, by_tau, point.force.0]);
        }
        rows
    }

    /// Linear coefficients and residual sum at a trial, `None` where the trial is meaningless.
    fn solve(&self, trial: Trial, stride: usize) -> Option<([f64; 6], f64)> {
        if !(trial.contact > self.first && trial.contact < self.last) {
            return None;
        }
        let mut rows = Triangle::<4>::default();
        for point in self.points.iter().step_by(stride) {
            let [c, a1, a2, ..] = self.columns(trial, point.position.0, None);
            rows.push([c, a1, a2, point.force.0]);
        }
        let [c, a1, a2, _] = rows.solve(3)?;
        // Tissue pushes back: a falling start is an edge of the noise, not a contact.
        (a1 > 0.0).then_some(([c, a1, a2, 0.0, 0.0, 0.0], rows.residual_sum()))
    }

    fn cost(&self, trial: Trial) -> Option<f64> {
        self.solve(trial, 1).map(|(_, cost)| cost)
    }

    fn scan(&self) -> Option<(Trial, f64)> {
        let stride = (self.points.len() / 300).max(1);
        let [low, high] = TAU_RANGE.map(f64::ln);
        let mut best: Option<(Trial, f64)> = None;
        for i in 1..CONTACT_COUNT {
            let share = i as f64 / CONTACT_COUNT as f64;
            let contact = self.first + share * (self.last - self.first);
            for j in 0..TAU_COUNT {
                let log_tau = low + (high - low) * j as f64 / (TAU_COUNT - 1) as f64;
                let trial = Trial { contact, log_tau };
                let Some((_, cost)) = self.solve(trial, stride) else {
                    continue;
                };
                if best.is_none_or(|(_, least)| cost < least) {
                    best = Some((trial, cost));
                }
            }
        }
        let (trial, _) = best?;
        Some((trial, self.cost(trial)?))
    }

    /// Gauss-Newton step in contact and log tau.
    fn step(&self, trial: Trial) -> Option<[f64; 2]> {
        let (linear, _) = self.solve(trial, 1)?;
        let rows = self.triangle(trial, Some(linear));
        let full = rows.solve(5)?;
        // The model is linear in its coefficients, so only the change of the outer two matters.
        Some([full[3], full[4]])
    }

    fn estimate(&self, trial: Trial) -> Option<ContactEstimate> {
        let (linear, cost) = self.solve(trial, 1)?;
        let rows = self.triangle(trial, Some(linear));
        let variance = cost / (self.points.len() - 5) as f64;
        let std_error_mm = (variance * rows.inverse_diagonal(3, 5)?).sqrt();
        // Against no contact at all the fit must gain what noise cannot: the gain in units of the
        // variance is chi-square with four degrees, and 100 has a chance of 1e-20 per trial.
        let gain = (self.cost_without_contact() - cost) / variance;
        (gain > 100.0 && std_error_mm.is_finite()).then_some(ContactEstimate {
            position: Position(trial.contact),
            std_error_mm,
            rmse_n: variance.sqrt(),
        })
    }

    /// Sum of squares about the mean force.
    fn cost_without_contact(&self) -> f64 {
        let count = self.points.len() as f64;
        let mean = self.points.iter().map(|point| point.force.0).sum::<f64>() / count;
        self.points.iter().map(|point| (point.force.0 - mean).powi(2)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTACT: f64 = 41.234_5;

    /// A pass over the thesis body (all of it: cubic and viscous terms too), integrated by
    /// second-order steps of 0.1 ms, sampled like the engine does: means of ten at 1 kHz.
    fn pass(noise_sd: f64, seed: u64) -> Vec<ContactPoint> {
        let (tau, speed) = (1.023, 0.15);
        let elastic = |x: f64| (0.053_33 + (-0.0086 + 0.000_434_5 * x) * x) * x;
        let forcing = |x: f64| {
            if x > 0.0 { elastic(x) + 0.06 * x * speed } else { 0.0 }
        };
        let mut noise = Noise(seed);
        let (mut force, mut points) = (0.0, Vec::new());
        for i in 0..4000 {
            let mut sums = [0.0; 3];
            for j in 0..10 {
                let t0 = f64::from(i * 10 + j) * 1e-3;
                for k in 0..10 {
                    let t = t0 + f64::from(k) * 1e-4;
                    let mid = forcing(CONTACT - 1.8 + speed * (t + 5e-5) - CONTACT);
                    let half = force + 5e-5 * (forcing(speed * t - 1.8) - force) / tau;
                    force += 1e-4 * (mid - half) / tau;
                }
                sums[0] += t0 + 1e-3;
                sums[1] += CONTACT - 1.8 + speed * (t0 + 1e-3);
                sums[2] += force + noise_sd * noise.normal();
            }
            points.push(ContactPoint {
                t: Seconds(sums[0] / 10.0),
                position: Position(sums[1] / 10.0),
                force: Newtons(sums[2] / 10.0),
            });
            if force > 0.1 {
                break;
            }
        }
        points
    }

    /// Box-Muller over SplitMix64: test noise without a dependency.
    struct Noise(u64);

    impl Noise {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            (((z ^ (z >> 31)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        }

        fn normal(&mut self) -> f64 {
            (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
        }
    }

    #[test]
    fn finds_contact_without_noise_but_for_the_cubic_term_it_leaves_out() {
        let estimate = fit_contact(&pass(0.0, 1)).unwrap();
        // At 2.5 mm the cubic term is 7 mN, 5 % of the elastic force: a bias of a few micrometres.
        assert!((estimate.position.0 - CONTACT).abs() < 0.01, "{estimate:?}");
    }

    #[test]
    fn scatter_is_what_the_standard_error_says() {
        let estimates: Vec<_> =
            (0..40).map(|seed| fit_contact(&pass(0.02, seed)).unwrap()).collect();
        let squares: f64 = estimates
            .iter()
            .map(|one| ((one.position.0 - CONTACT) / one.std_error_mm).powi(2))
            .sum();
        // Chi-square with 40 degrees: 16 to 76 holds all but 1e-3; the known bias adds little.
        assert!((16.0..76.0).contains(&squares), "{squares}");
        let mean_error = estimates.iter().map(|one| one.std_error_mm).sum::<f64>() / 40.0;
        // The Cramer-Rao bound of this pass, drift known, is 0.028 mm.
        assert!((0.02..0.04).contains(&mean_error), "{mean_error}");
    }

    #[test]
    fn refuses_a_pass_that_felt_nothing() {
        let mut noise = Noise(3);
        let flat: Vec<ContactPoint> = (0..500)
            .map(|i| ContactPoint {
                t: Seconds(f64::from(i) * 0.01),
                position: Position(40.0 + f64::from(i) * 0.003),
                force: Newtons(0.006 * noise.normal()),
            })
            .collect();
        assert_eq!(fit_contact(&flat), Err(ContactFitError::NoOnset));
        assert!(matches!(fit_contact(&flat[..10]), Err(ContactFitError::TooShort { points: 10 })));
    }
}
