//! The tissue the probe meets: a surface somewhere, and behind it the thesis's viscoelastic body.
//!
//! Where it has been deeper the tissue may be softer, and loading may move its surface; the laws are
//! [`Softening`]'s and [`SurfaceRecession`]'s, not a fitted family's.
//!
//! Depth is taken as straight between two ticks, for which the body's step is exact, also in the
//! tick of first contact. Tissue pushes and cannot pull: where the body's force would be negative
//! the probe has lifted off and the cell feels nothing, while the body goes on relaxing.

use super::amounts::SimPreconditioning;
use super::preconditioning::SurfaceRecession;
use super::random::Random;
use super::settings::SimSettings;
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Position, Seconds};

/// Where the surface is on average, in mm from home; the specimen box stands there.
const SURFACE_MM: f64 = 41.0;
/// The specimen is clipped by hand: its surface is up to this far from [`SURFACE_MM`].
const SURFACE_SPREAD_MM: f64 = 2.0;
/// Standard deviation of stiffness between specimens, relative.
const STIFFNESS_SPREAD: f64 = 0.05;
/// Standard deviation of the two time constants between specimens, relative.
const TIME_SPREAD: f64 = 0.03;

/// Energy, in N*mm, below which hardly anything softens: what the thesis body stores at 10 mm, so that a
/// search for contact leaves the tissue nearly as it was.
const SOFTENING_ENERGY: f64 = 1.0;

/// Pseudo-elastic softening: the elastic force `p(x)` is multiplied by
/// `eta = 1 - share * tanh((W(x_max) - W(x)) / (m + W(x_max)))`, with `W` the energy stored at a depth and
/// `x_max` the greatest depth so far.
///
/// The law of Ogden & Roxburgh, Proc. R. Soc. Lond. A 455 (1999) 2861, with two changes that finite element
/// codes and later authors make too: the hyperbolic tangent for their error function, which has the
/// same shape, and an energy scale that grows with `W(x_max)`, so that small and large loops lose like
/// shares. It never heals. What is lost relaxes with the body: `y + tau y' = (eta - 1) p(x)`.
#[derive(Clone, Debug)]
struct Softening {
    share: f64,
    depth_max: f64,
    /// `(eta - 1) p(x)` at the newest tick, in N.
    drive: f64,
    /// `y` at the newest tick, in N.
    lost_force: f64,
}

impl Softening {
    /// The probe has moved to a depth; returns what the force loses there. Between two ticks, a thousandth of
    /// a relaxation time, the drive counts with its mean.
    fn advance(&mut self, body: &ModifiedKelvin, depth: f64, dt: f64) -> f64 {
        let depth = depth.max(0.0);
        self.depth_max = self.depth_max.max(depth);
        let stored = energy(body, self.depth_max);
        let returned = (stored - energy(body, depth)) / (SOFTENING_ENERGY + stored);
        let drive = -self.share * returned.tanh() * body.elastic(Depth(depth)).0;
        let decay = (-dt / body.tau_eps).exp();
        self.lost_force = decay * self.lost_force + (1.0 - decay) * 0.5 * (self.drive + drive);
        self.drive = drive;
        self.lost_force
    }
}

/// Energy in N*mm that the elastic part stores at a depth in contact.
fn energy(body: &ModifiedKelvin, x: f64) -> f64 {
    let [mu1, mu2, mu3] = body.mu;
    x * x * (mu1 / 2.0 + x * (mu2 / 3.0 + x * mu3 / 4.0))
}

#[derive(Clone, Debug)]
pub struct Tissue {
    surface: Position,
    body: ModifiedKelvin,
    state: KelvinState,
    softening: Option<Softening>,
    recession: Option<SurfaceRecession>,
    force: Newtons,
}

impl Tissue {
    /// A specimen drawn around the thesis's identified body (its equation 3.5), as stiff as the settings say, or of the body that
    /// they give. Its surface is the same with either.
    pub fn new(random: &mut Random, settings: &SimSettings) -> Self {
        let surface = SURFACE_MM + random.between(-SURFACE_SPREAD_MM, SURFACE_SPREAD_MM);
        let stiffness = random.around_one(STIFFNESS_SPREAD) * settings.stiffness.hundredths();
        let (relaxation, viscosity) =
            (random.around_one(TIME_SPREAD), random.around_one(TIME_SPREAD));
        let thesis = ModifiedKelvin::THESIS;
        let drawn = ModifiedKelvin {
            tau_eps: thesis.tau_eps * relaxation,
            mu: thesis.mu.map(|mu| mu * stiffness),
            // N*s/mm^2: a force coefficient with a time constant in it.
            tau_sig: thesis.tau_sig * stiffness * viscosity,
        };
        Self {
            surface: Position(surface),
            body: settings.body.unwrap_or(drawn),
            // The probe powers up far outside; the first step places it.
            state: KelvinState::at_rest_from(Depth(-SURFACE_MM)),
            softening: (settings.softening.hundredths() > 0.0).then(|| Softening {
                share: settings.softening.hundredths(),
                depth_max: 0.0,
                drive: 0.0,
                lost_force: 0.0,
            }),
            recession: (settings.preconditioning != SimPreconditioning::default())
                .then(|| SurfaceRecession::new(settings.preconditioning)),
            force: Newtons(0.0),
        }
    }

    /// True position of the surface, where loading has moved it to.
    pub fn surface(&self) -> Position {
        self.surface.moved_by(self.recession.map_or(0.0, |recession| recession.get()))
    }

    /// The body's true parameters.
    pub fn body(&self) -> ModifiedKelvin {
        self.body
    }

    /// A fresh specimen is clipped in while the probe stands at a true position; nothing has pressed it.
    pub fn clipped_before(mut self, probe: Position) -> Self {
        let depth = probe.depth_from(self.surface).0.min(0.0);
        self.state = KelvinState::at_rest_from(Depth(depth));
        self
    }

    /// The probe has moved straight to a true position in a time step; returns the force there.
    pub fn advance(&mut self, probe: Position, dt: Seconds) -> Newtons {
        let mut depth = probe.depth_from(self.surface);
        if let Some(recession) = &mut self.recession {
            depth = Depth(depth.0 - recession.advance(depth.0, self.force.0, dt.0));
        }
        let mut force = self.state.step(&self.body, depth, dt).0;
        if let Some(softening) = &mut self.softening {
            force += softening.advance(&self.body, depth.0, dt.0);
        }
        self.force = Newtons(force.max(0.0));
        self.force
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::RandomStream;
    use super::*;

    fn specimen(seed: u64, percent: u8) -> Tissue {
        let settings = SimSettings {
            softening: percent.to_string().parse().unwrap(),
            ..SimSettings::default()
        };
        Tissue::new(&mut Random::new(seed, RandomStream::Tissue), &settings)
    }

    /// Force at every millisecond on the way through depths in mm, at `speed` in mm/s.
    fn forces(tissue: &mut Tissue, depths: &[f64], speed: f64) -> Vec<(f64, f64)> {
        let (surface, mut x) = (tissue.surface(), depths[0]);
        let mut all = Vec::new();
        for pair in depths.windows(2) {
            let step = 1e-3 * speed * (pair[1] - pair[0]).signum();
            let count = ((pair[1] - pair[0]) / step).round() as u32;
            for i in 1..=count {
                x = pair[0] + f64::from(i) * step;
                let force = tissue.advance(surface.moved_by(x), Seconds(1e-3));
                all.push((x, force.0));
            }
        }
        assert!((x - depths[depths.len() - 1]).abs() < 1e-9);
        all
    }

    /// Energy in N*mm put into the tissue along forces over depth.
    fn work(forces: &[(f64, f64)]) -> f64 {
        let pairs = forces.windows(2);
        pairs.map(|pair| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0)).sum()
    }

    #[test]
    fn going_deeper_than_ever_before_nothing_is_lost() {
        // In at 0.2 mm/s, which leaves a force on the way back: the way in does not know of softening.
        let (mut hard, mut soft) = (specimen(3, 0), specimen(3, 60));
        let path = [0.0, 12.0, 25.0, 20.0, 0.0];
        let (one, other) = (forces(&mut hard, &path, 0.2), forces(&mut soft, &path, 0.2));
        let turn = 125_000;
        assert_eq!(one[..turn], other[..turn]);
        // After it the softened tissue is nowhere stiffer.
        assert!(one[turn..].iter().zip(&other[turn..]).all(|(a, b)| b.1 <= a.1));
        assert!(other[turn + 25_000].1 < 0.8 * one[turn + 25_000].1);
    }

    #[test]
    fn no_closed_loop_gives_energy_back() {
        for speed in [0.5, 5.0, 20.0] {
            for path in [[0.0, 20.0, 0.0, 20.0, 0.0], [0.0, 30.0, 10.0, 25.0, 0.0]] {
                let [hard, soft] =
                    [0, 80].map(|percent| work(&forces(&mut specimen(2, percent), &path, speed)));
                assert!(hard > 0.0 && soft > 0.0, "{path:?} {speed}: {hard} {soft}");
            }
        }
        // So slow that viscosity takes little, what is lost is mostly the softening's: of 34 N*mm stored
        // at 30 mm.
        let slow = [0.0, 30.0, 0.0];
        let [hard, soft] =
            [0, 80].map(|percent| work(&forces(&mut specimen(2, percent), &slow, 0.05)));
        assert!(soft > hard + 10.0, "{hard} {soft}");
    }

    #[test]
    fn softening_is_the_share_of_the_law() {
        // Held for a hundred relaxation times on the way back, the force is eta times the elastic one.
        for (turn, at) in [(30.0, 20.0), (20.0, 12.0), (12.0, 11.0)] {
            let mut tissue = specimen(5, 50);
            let body = tissue.body();
            forces(&mut tissue, &[0.0, turn, at], 10.0);
            let held = tissue.surface().moved_by(at);
            for _ in 0..100_000 {
                tissue.advance(held, Seconds(1e-3));
            }
            let stored = |x: f64| {
                // Simpson's rule is exact for the cubic force.
                let force = |x: f64| body.elastic(Depth(x)).0;
                x / 6.0 * (force(0.0) + 4.0 * force(0.5 * x) + force(x))
            };
            let returned = (stored(turn) - stored(at)) / (1.0 + stored(turn));
            let eta = 1.0 - 0.5 * returned.tanh();
            let wanted = eta * body.elastic(Depth(at)).0;
            let miss = (tissue.force.0 - wanted).abs();
            assert!(miss < 1e-9, "{turn} {at}: {miss:e}");
        }
    }

    #[test]
    fn specimens_differ_within_their_spread() {
        let mut surfaces = Vec::new();
        let mut stiffness = Vec::new();
        for seed in 0..400 {
            let tissue = specimen(seed, 0);
            assert!((39.0..=43.0).contains(&tissue.surface().0));
            surfaces.push(tissue.surface().0);
            stiffness.push(tissue.body().mu[0] / ModifiedKelvin::THESIS.mu[0] - 1.0);
        }
        let spread = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
        };
        // Uniform over 4 mm: 4 / sqrt(12). Tolerances are about four standard errors of 400 draws.
        assert!((spread(&surfaces) - 4.0 / 12f64.sqrt()).abs() < 0.11);
        assert!((spread(&stiffness) - 0.05).abs() < 0.008);
    }

    #[test]
    fn a_fast_retreat_lifts_off_and_never_pulls() {
        let mut tissue = specimen(1, 0);
        let surface = tissue.surface();
        let dt = Seconds(0.001);
        let mut deepest: f64 = 0.0;
        for i in 0..10_000 {
            let force = tissue.advance(surface.moved_by(0.001 * f64::from(i)), dt);
            deepest = deepest.max(force.0);
        }
        assert!(deepest > 0.1);
        let mut lifted_off_in_depth = false;
        for i in (0..500).rev() {
            let force = tissue.advance(surface.moved_by(0.02 * f64::from(i)), dt);
            assert!(force.0 >= 0.0);
            lifted_off_in_depth |= i > 0 && force.0 == 0.0;
        }
        assert!(lifted_off_in_depth);
        assert_eq!(tissue.advance(Position(0.0), dt), Newtons(0.0));
    }
}
