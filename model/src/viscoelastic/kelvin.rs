//! The modified Kelvin body and its state:
//! `F + tau_eps F' = mu1 x + mu2 x^2 + mu3 x^3 + tau_sig x x'`.
//!
//! Equation 3.3 of the thesis this project implements (Nanyang Technological University, force
//! feedback for endoscopic surgery); with `mu2 = mu3 = 0` and a viscous term `mu1 tau_sig x'` it
//! would be the standard linear solid.

use super::exact_step::{CompensatedSum, ContactPieces, StepWeights, forcing};
use crate::units::{Depth, Newtons, Seconds};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Parameters of the modified Kelvin body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModifiedKelvin {
    /// Relaxation time of the force at constant depth, in s.
    pub tau_eps: f64,
    /// Elastic coefficients `mu1, mu2, mu3` in N/mm, N/mm^2, N/mm^3.
    pub mu: [f64; 3],
    /// Coefficient of depth times speed, in N*s/mm^2.
    pub tau_sig: f64,
}

/// Numbers that do not describe a body.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "the tissue model has {name} = {value}; the relaxation time must be positive and every coefficient finite"
)]
pub struct BodyError {
    pub name: &'static str,
    pub value: f64,
}

impl ModifiedKelvin {
    /// Pig stomach, equation 3.5 of the thesis.
    pub const THESIS: Self =
        Self { tau_eps: 1.023, mu: [0.05333, -0.0086, 0.0004345], tau_sig: 0.06 };

    /// Its parameters with the names that files and fits have for them.
    pub const fn named(&self) -> [(&'static str, f64); 5] {
        let [mu1, mu2, mu3] = self.mu;
        [
            ("tau_eps", self.tau_eps),
            ("mu1", mu1),
            ("mu2", mu2),
            ("mu3", mu3),
            ("tau_sig", self.tau_sig),
        ]
    }

    /// The body itself if its numbers describe one.
    pub fn checked(self) -> Result<Self, BodyError> {
        if !(self.tau_eps > 0.0 && self.tau_eps.is_finite()) {
            return Err(BodyError { name: "tau_eps", value: self.tau_eps });
        }
        match self.named().into_iter().find(|(_, value)| !value.is_finite()) {
            Some((name, value)) => Err(BodyError { name, value }),
            None => Ok(self),
        }
    }

    /// The force in N at which a depth held for ever settles; zero out of contact.
    pub fn elastic(&self, depth: Depth) -> Newtons {
        let x = depth.0.max(0.0);
        let [mu1, mu2, mu3] = self.mu;
        Newtons(x * (mu1 + x * (mu2 + x * mu3)))
    }
}

/// State of the body: its filtered powers of depth and the position of the probe.
///
/// Depth moves straight between steps and the response to that path is exact, whatever the step
/// length. Depth below zero is out of contact and counts as zero; a step that crosses the surface
/// is cut exactly where the straight path crosses it, so splitting steps never changes the force.
#[derive(Clone, Debug, PartialEq)]
pub struct KelvinState {
    powers: [CompensatedSum; 3],
    viscous: CompensatedSum,
    depth: f64,
    weights: StepWeights,
    tau: f64,
}

impl Default for KelvinState {
    fn default() -> Self {
        Self::at_rest()
    }
}

impl KelvinState {
    /// A relaxed body with the probe just touching it: depth 0, force 0.
    #[must_use]
    pub fn at_rest() -> Self {
        Self::at_rest_from(Depth(0.0))
    }

    /// A relaxed body with the probe at `depth` at or outside the surface (a positive depth counts
    /// as zero: a body under load is not relaxed).
    #[must_use]
    pub fn at_rest_from(depth: Depth) -> Self {
        Self {
            powers: [CompensatedSum::default(); 3],
            viscous: CompensatedSum::default(),
            depth: depth.0.min(0.0),
            weights: StepWeights::new(0.0, 1.0),
            tau: 1.0,
        }
    }

    /// The depth at the end of the last step.
    pub fn depth(&self) -> Depth {
        Depth(self.depth)
    }

    /// The force in N that `body` exerts now.
    pub fn force(&self, body: &ModifiedKelvin) -> Newtons {
        let [f1, f2, f3] = &self.powers;
        let [mu1, mu2, mu3] = body.mu;
        Newtons(
            mu1 * f1.value + mu2 * f2.value + mu3 * f3.value + body.tau_sig * self.viscous.value,
        )
    }

    /// The filtered powers of depth and the filtered viscous drive, in mm, mm^2, mm^3 and mm^2/s: what `mu1`,
    /// `mu2`, `mu3` and `tau_sig` multiply.
    pub fn columns(&self) -> [f64; 4] {
        let [f1, f2, f3] = &self.powers;
        [f1.value, f2.value, f3.value, self.viscous.value]
    }

    /// Moves straight to `depth_to` within `dt` and returns the force in N at the end.
    ///
    /// A step of no time is a jump: the elastic memory does not change, the viscous drive does.
    /// A negative or non-finite `dt`, a non-finite depth or a body without a positive relaxation
    /// time leaves the state as it was and returns NaN.
    pub fn step(&mut self, body: &ModifiedKelvin, depth_to: Depth, dt: Seconds) -> Newtons {
        let (from, to, dt, tau) = (self.depth, depth_to.0, dt.0, body.tau_eps);
        if !(dt >= 0.0 && dt.is_finite() && to.is_finite() && tau > 0.0) {
            return Newtons(f64::NAN);
        }
        self.depth = to;
        if dt == 0.0 {
            let (x0, x1) = (from.max(0.0), to.max(0.0));
            self.viscous.add((x1 - x0) * (x1 + x0) / (2.0 * tau));
            return self.force(body);
        }
        if dt != self.weights.dt || tau != self.tau {
            self.weights = StepWeights::new(dt, tau);
            self.tau = tau;
        }
        match ContactPieces::of(from, to) {
            ContactPieces::Inside => self.advance(from, to - from, &self.weights.clone()),
            ContactPieces::Outside => self.advance(0.0, 0.0, &self.weights.clone()),
            ContactPieces::Entering([outside, inside]) => {
                self.advance(0.0, 0.0, &StepWeights::new(dt * outside, tau));
                self.advance(0.0, to, &StepWeights::new(dt * inside, tau));
            }
            ContactPieces::Leaving([inside, outside]) => {
                self.advance(from, -from, &StepWeights::new(dt * inside, tau));
                self.advance(0.0, 0.0, &StepWeights::new(dt * outside, tau));
            }
        }
        self.force(body)
    }

    #[inline]
    fn advance(&mut self, x0: f64, d: f64, weights: &StepWeights) {
        // A cut that leaves no time leaves nothing to do.
        if weights.dt <= 0.0 {
            return;
        }
        let psi_0 = weights.psi[0];
        let weighted = forcing(x0, d, &weights.psi);
        for (power, weighted) in self.powers.iter_mut().zip(weighted) {
            power.relax(weighted, psi_0);
        }
        self.viscous.relax(d / weights.dt * weighted[0], psi_0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Force at the end of a ramp at `speed` to 30 mm and after a hold of 50 s, in `steps` equal
    /// steps each.
    fn ramp_hold(body: &ModifiedKelvin, speed: f64, steps: u32) -> (f64, f64) {
        let mut state = KelvinState::at_rest();
        let dt = Seconds(30.0 / speed / f64::from(steps));
        let mut peak = Newtons(0.0);
        for i in 1..=steps {
            let depth = Depth(30.0 * f64::from(i) / f64::from(steps));
            peak = state.step(body, depth, dt);
        }
        let dt = Seconds(50.0 / f64::from(steps));
        let mut end = peak;
        for _ in 0..steps {
            end = state.step(body, Depth(30.0), dt);
        }
        (peak.0, end.0)
    }

    fn check(value: f64, exact: f64, relative: f64) {
        assert!((value - exact).abs() <= relative * exact.abs(), "{value:.17} is not {exact:.17}");
    }

    #[test]
    fn thesis_numbers() {
        // Closed form of the ramp and the hold, evaluated in 50 digits.
        let body = ModifiedKelvin::THESIS;
        for steps in [1, 7, 40_000] {
            let (peak, end) = ramp_hold(&body, 0.75, steps);
            check(peak, 6.396_495_407_963_656_8, 2e-14);
            check(end, 5.591_4, 2e-14);
            let (peak, end) = ramp_hold(&body, 1.5, steps);
            check(peak, 7.197_303_292_428_788_6, 2e-14);
            check(end, 5.591_4, 2e-14);
        }
        check(body.elastic(Depth(30.0)).0, 5.591_4, 1e-14);
    }

    #[test]
    fn stable_and_exact_for_any_relaxation_time() {
        // tau, peak and end at 0.75 mm/s, then at 1.5 mm/s; 50 digits.
        let cases = [
            (1e-6, 6.941_399_433_390_035, 5.591_4),
            (1e-3, 6.940_833_424_317_025_2, 5.591_4),
            (1e3, 0.072_425_663_837_838_72, 0.341_589_218_378_257_2),
            (1e6, 7.311_230_684_586_716e-5, 3.526_716_621_883_997_7e-4),
        ];
        for (tau_eps, peak_exact, end_exact) in cases {
            let body = ModifiedKelvin { tau_eps, ..ModifiedKelvin::THESIS };
            for steps in [1, 1000] {
                let (peak, end) = ramp_hold(&body, 0.75, steps);
                check(peak, peak_exact, 2e-13);
                check(end, end_exact, 2e-13);
            }
        }
    }

    #[test]
    fn a_jump_then_relaxes_exponentially() {
        // F(0+) = tau_sig X^2 / (2 tau), F(t) = g + (F(0+) - g) exp(-t / tau).
        let body = ModifiedKelvin::THESIS;
        let mut state = KelvinState::at_rest();
        let jump = state.step(&body, Depth(10.0), Seconds(0.0)).0;
        check(jump, 0.06 * 100.0 / 2.046, 1e-15);
        let force = state.step(&body, Depth(10.0), Seconds(2.0)).0;
        let settled = body.elastic(Depth(10.0)).0;
        check(force, settled + (jump - settled) * (-2.0f64 / 1.023).exp(), 1e-14);
    }

    #[test]
    fn splitting_steps_changes_nothing_even_across_the_surface() {
        let body = ModifiedKelvin::THESIS;
        let path = [(-1.3, 0.0), (4.0, 2.0), (4.0, 1.0), (-2.0, 0.7), (3.0, 5.0), (9.0, 0.1)];
        let mut whole = KelvinState::at_rest_from(Depth(path[0].0));
        let mut split = whole.clone();
        for pair in path.windows(2) {
            let ((from, _), (to, span)) = (pair[0], pair[1]);
            let at_once = whole.step(&body, Depth(to), Seconds(span)).0;
            let mut at_last = f64::NAN;
            for share in [0.0, 0.3, 0.31, 0.7, 1.0].windows(2) {
                let depth = Depth(from + (to - from) * share[1]);
                at_last = split.step(&body, depth, Seconds(span * (share[1] - share[0]))).0;
            }
            check(at_last, at_once, 1e-13);
        }
    }

    #[test]
    fn force_decays_out_of_contact_and_bad_input_changes_nothing() {
        let body = ModifiedKelvin::THESIS;
        let mut state = KelvinState::at_rest();
        state.step(&body, Depth(20.0), Seconds(10.0));
        state.step(&body, Depth(-1.0), Seconds(0.5));
        let left = state.force(&body).0;
        let later = state.step(&body, Depth(-5.0), Seconds(1.023)).0;
        check(later, left * (-1.0f64).exp(), 1e-14);
        let kept = state.clone();
        assert!(state.step(&body, Depth(f64::NAN), Seconds(1.0)).0.is_nan());
        assert!(state.step(&body, Depth(1.0), Seconds(-1.0)).0.is_nan());
        assert_eq!(state, kept);
    }

    #[test]
    fn bodies_are_checked_in_words() {
        assert_eq!(ModifiedKelvin::THESIS.checked(), Ok(ModifiedKelvin::THESIS));
        let body = ModifiedKelvin { tau_eps: 0.0, ..ModifiedKelvin::THESIS };
        let text = body.checked().unwrap_err().to_string();
        assert!(text.contains("tau_eps = 0"), "{text}");
        let body = ModifiedKelvin { mu: [0.1, f64::NAN, 0.0], ..ModifiedKelvin::THESIS };
        assert_eq!(body.checked().unwrap_err().name, "mu2");
    }
}
