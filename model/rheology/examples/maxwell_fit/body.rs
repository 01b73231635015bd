//! The Maxwell body, a spring and a dashpot in series: `sigma + (eta / k) sigma' = eta eps'`.
//!
//! With `tau = eta / k` the stress is `k phi`, where `phi + tau phi' = tau eps'`. Over a step of
//! length `h` in which strain moves straight by `d`, exactly (`r = h / tau`, `psi_0 = 1 - e^-r`)
//!
//! ```text
//! phi(+) = phi + (psi_0(r) / r) d - psi_0(r) phi
//! ```

use palpate_model::units::Seconds;
use palpate_model::viscoelastic::{CompensatedSum, psi};

/// Parameters of a Maxwell body, in the unit of the stress; strain is a ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Maxwell {
    /// Viscosity of the dashpot, in stress times s.
    pub eta: f64,
    /// Stiffness of the spring, in stress.
    pub k: f64,
}

impl Maxwell {
    /// The relaxation time `eta / k`, in s.
    pub fn tau(&self) -> Seconds {
        Seconds(self.eta / self.k)
    }
}

/// How a step of strain becomes stress. There is no default: the choice changes the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Strain moves straight between samples; no time-step error.
    Exact,
    /// All strain of a step comes at its end, `phi(+) = e^-r phi + d`: the relaxation modulus
    /// convolved with backward differences of strain, as RHEOS.jl does it (Kaplan, Bonfanti &
    /// Kabla, JOSS 4 (2019) 1700). Too much stress by `r / (1 - e^-r)` at an even step, so that
    /// fitted `eta` and `k` come out too small by that factor.
    BackwardDifference,
}

/// Coefficients of a step of length `dt`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxwellStep {
    /// `dt / tau`.
    pub r: f64,
    /// Share of the response that decays, `1 - e^-r`.
    pub decayed: f64,
    /// Response to a unit of strain.
    pub gain: f64,
}

impl MaxwellStep {
    /// A step of `dt` seconds at a relaxation time of `tau` seconds.
    #[must_use]
    pub fn new(dt: f64, tau: f64, integrator: Integrator) -> Self {
        let r = dt / tau;
        let decayed = psi(0, r);
        let gain = match integrator {
            Integrator::Exact if r > 0.0 => decayed / r,
            Integrator::Exact | Integrator::BackwardDifference => 1.0,
        };
        Self { r, decayed, gain }
    }
}

/// State of a Maxwell body.
#[derive(Clone, Debug, PartialEq)]
pub struct MaxwellState {
    /// Stress over `k`.
    response: CompensatedSum,
    strain: f64,
}

impl MaxwellState {
    /// A relaxed body at `strain`.
    #[must_use]
    pub fn at_rest_from(strain: f64) -> Self {
        Self { response: CompensatedSum::default(), strain }
    }

    /// Moves to `strain_to` within `dt` and returns the stress at the end.
    ///
    /// A step of no time is a jump, which only the spring feels. A negative or non-finite `dt`, a
    /// non-finite strain or a body without a positive relaxation time leaves the state as it was
    /// and returns NaN.
    pub fn step(
        &mut self,
        body: &Maxwell,
        integrator: Integrator,
        strain_to: f64,
        dt: Seconds,
    ) -> f64 {
        let tau = body.tau().0;
        if !(dt.0 >= 0.0 && dt.is_finite() && strain_to.is_finite() && tau > 0.0) {
            return f64::NAN;
        }
        let step = MaxwellStep::new(dt.0, tau, integrator);
        let forcing = step.gain * (strain_to - self.strain);
        self.response.relax(forcing, step.decayed);
        self.strain = strain_to;
        body.k * self.response.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Maxwell = Maxwell { eta: 4.2, k: 2.0 };

    /// Stress after a ramp of strain 1 per s during 1.7 s and 3.1 s at rest.
    fn ramp_hold(integrator: Integrator, steps: u32) -> f64 {
        let mut state = MaxwellState::at_rest_from(0.0);
        let (ramp, hold) = (1.7 / f64::from(steps), 3.1 / f64::from(steps));
        for i in 1..=steps {
            state.step(&BODY, integrator, ramp * f64::from(i), Seconds(ramp));
        }
        let mut stress = f64::NAN;
        for _ in 0..steps {
            stress = state.step(&BODY, integrator, 1.7, Seconds(hold));
        }
        stress
    }

    #[test]
    fn closed_form_whatever_the_step() {
        // eta rate (1 - e^(-t1/tau)) e^(-t2/tau); the closed form itself rounds to 1e-15.
        let tau = BODY.tau().0;
        let exact = -4.2 * (-1.7 / tau).exp_m1() * (-3.1 / tau).exp();
        for steps in [1, 10, 10_000] {
            let stress = ramp_hold(Integrator::Exact, steps);
            assert!((stress / exact - 1.0).abs() < 1e-14, "{steps}: {stress}");
            // Backward differences: the same with r / (1 - e^-r) on the ramp.
            let r = 1.7 / f64::from(steps) / tau;
            let factor = r / -(-r).exp_m1();
            let biased = ramp_hold(Integrator::BackwardDifference, steps);
            assert!((biased / (exact * factor) - 1.0).abs() < 1e-13, "{steps}");
        }
    }

    #[test]
    fn a_jump_loads_the_spring_and_bad_input_changes_nothing() {
        for integrator in [Integrator::Exact, Integrator::BackwardDifference] {
            let mut state = MaxwellState::at_rest_from(0.5);
            let stress = state.step(&BODY, integrator, 0.8, Seconds(0.0));
            assert!((stress - 0.6).abs() < 1e-15);
            let before = state.clone();
            let bad = [(f64::NAN, 1.0), (1.0, -1.0), (1.0, f64::INFINITY)];
            for (strain, dt) in bad {
                assert!(state.step(&BODY, integrator, strain, Seconds(dt)).is_nan());
            }
            assert_eq!(state, before);
        }
    }
}
