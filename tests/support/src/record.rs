//! Records made for tests: exact responses, seeded noise.
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::FitSample;

/// Noise with a recorded seed: PCG-XSH-RR 64/32 (O'Neill 2014) through Box-Muller.
pub struct Noise {
    state: u64,
}

impl Noise {
    /// Equal seeds give equal noise.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        let mut noise =
            Self { state: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x853C_49E6_748F_EA9B };
        noise.uniform();
        noise
    }

    /// Uniform in 0..1, never 0.
    pub fn uniform(&mut self) -> f64 {
        let old = self.state;
        self.state =
            old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (((old >> 18) ^ old) >> 27) as u32;
        let word = mixed.rotate_right((old >> 59) as u32);
        (f64::from(word) + 0.5) / 4_294_967_296.0
    }

    /// Of mean 0 and standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A ramp of `speed` mm/s to 30 mm and a hold of `hold` s, sampled every `dt` s.
#[must_use]
pub fn ramp_hold(speed: f64, hold: f64, dt: f64) -> Vec<(f64, f64)> {
    let count = ((30.0 / speed + hold) / dt).round() as u32;
    (0..=count)
        .map(|i| {
            let t = f64::from(i) * dt;
            (t, (speed * t).min(30.0))
        })
        .collect()
}

/// The exact force of a body along a path of (s, mm), relaxed at its start.
#[must_use]
pub fn respond(body: &ModifiedKelvin, path: &[(f64, f64)]) -> Vec<FitSample> {
    let mut state = KelvinState::at_rest_from(Depth(path[0].1));
    let mut before = path[0].0;
    path.iter()
        .map(|&(t, depth)| {
            let force = state.step(body, Depth(depth), Seconds(t - before));
            before = t;
            FitSample { t: Seconds(t), depth: Depth(depth), force, sigma: Newtons(0.02) }
        })
        .collect()
}

/// The samples with white noise of each sample's own sigma.
#[must_use]
pub fn with_white_noise(samples: &[FitSample], seed: u64) -> Vec<FitSample> {
    let mut noise = Noise::seeded(seed);
    samples
        .iter()
        .map(|sample| FitSample {
            force: Newtons(sample.force.0 + sample.sigma.0 * noise.normal()),
            ..*sample
        })
        .collect()
}

/// The samples with slow noise (standard deviation `slow`, exponential memory of `memory` s) and
/// white noise (standard deviation `white`), in N.
#[must_use]
pub fn with_correlated_noise(
    samples: &[FitSample],
    seed: u64,
    (slow, memory, white): (f64, f64, f64),
) -> Vec<FitSample> {
    let mut noise = Noise::seeded(seed);
    let mut state = noise.normal();
    let mut before = samples[0].t.0;
    samples
        .iter()
        .map(|sample| {
            let kept = (-(sample.t.0 - before) / memory).exp();
            state = kept * state + (1.0 - kept * kept).sqrt() * noise.normal();
            before = sample.t.0;
            let error = slow * state + white * noise.normal();
            FitSample { force: Newtons(sample.force.0 + error), ..*sample }
        })
        .collect()
}
