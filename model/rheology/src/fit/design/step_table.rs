//! The weights of a step by its length, remembered.

use palpate_model::viscoelastic::{StepWeights, psi_derivatives};

/// Step lengths this close (relative) share their psi, corrected to first order; the remaining
/// relative error is the square of this.
pub(super) const SAME_STEP: f64 = 1e-8;
/// Distinct step lengths remembered at a time: every block length of a thinned record.
const STEPS_MAX: usize = 16;

#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub step: StepWeights,
    /// Derivatives of `psi_0 ..= psi_3` by `r`.
    pub slope: [f64; 4],
}

/// psi by step length at one tau, so that a regular record computes it once.
#[derive(Clone, Debug)]
pub(super) struct StepTable {
    pub tau: f64,
    steps: Vec<Weights>,
    newest: usize,
    replaced: usize,
}

impl StepTable {
    pub fn new(tau: f64) -> Self {
        Self { tau, steps: Vec::with_capacity(STEPS_MAX), newest: 0, replaced: 0 }
    }

    /// The weights last asked for.
    pub fn newest(&self) -> &Weights {
        &self.steps[self.newest]
    }

    pub fn fresh(&self, dt: f64) -> Weights {
        let step = StepWeights::new(dt, self.tau);
        let slope = psi_derivatives(step.r, &step.psi);
        Weights { step, slope }
    }

    /// The remembered weights of a step of about `dt`.
    #[inline]
    pub fn near(&mut self, dt: f64) -> &Weights {
        let is_same = |known: &Weights| (dt - known.step.dt).abs() <= SAME_STEP * known.step.dt;
        if !self.steps.get(self.newest).is_some_and(is_same) {
            self.newest = match self.steps.iter().position(is_same) {
                Some(index) => index,
                None => self.store(dt),
            };
        }
        self.newest()
    }

    #[cold]
    fn store(&mut self, dt: f64) -> usize {
        let weights = self.fresh(dt);
        if self.steps.len() < STEPS_MAX {
            self.steps.push(weights);
            return self.steps.len() - 1;
        }
        self.replaced = (self.replaced + 1) % STEPS_MAX;
        self.steps[self.replaced] = weights;
        self.replaced
    }

    #[inline]
    pub fn get(&mut self, dt: f64) -> Weights {
        let tau = self.tau;
        let mut weights = *self.near(dt);
        if dt != weights.step.dt {
            let delta = (dt - weights.step.dt) / tau;
            for (psi, slope) in weights.step.psi.iter_mut().zip(weights.slope) {
                *psi += delta * slope;
            }
            weights.step.dt = dt;
        }
        weights
    }
}
