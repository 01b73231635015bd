//! The two paths on which errors are measured, and the exact forces there.
//!
//! Time is counted in ticks of 0.1 ms, the shortest step, so that every step and every checkpoint is
//! a whole number of them.

use palpate_model::units::{Depth, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::integrators::SeriesBody;
use palpate_rheology::reference::Reference;
use palpate_rheology::trade::ForceError;

/// Ticks per second.
pub(super) const TICKS: u64 = 10_000;

/// Depth that moves straight between corners.
pub(super) struct DepthPath {
    /// Tick and depth in mm.
    corners: &'static [(u64, f64)],
    /// Ticks between the moments at which forces are compared; corners are such moments.
    every: u64,
    /// Forces of the thesis body in N at those moments, in many digits.
    exact: Vec<f64>,
}

/// The protocol of the thesis: 0.75 mm/s to 30 mm, a hold of 50 s.
const RAMP_HOLD: &[(u64, f64)] = &[(0, 0.0), (40 * TICKS, 30.0), (90 * TICKS, 30.0)];
/// A poke: 100 mm/s to 10 mm, up again after a second, and the time it takes to fade.
const POKE: &[(u64, f64)] =
    &[(0, 0.0), (TICKS / 10, 10.0), (TICKS, 10.0), (TICKS + TICKS / 10, 0.0), (10 * TICKS, 0.0)];

pub(super) struct ReferencePaths {
    pub ramp_hold: DepthPath,
    pub poke: DepthPath,
}

/// The body whose errors are measured.
pub(super) fn body() -> SeriesBody<3> {
    ModifiedKelvin::THESIS.into()
}

impl ReferencePaths {
    pub fn new() -> Result<Self, String> {
        // A tenth and a hundredth of the relaxation time of a second: errors live that long.
        Ok(Self {
            ramp_hold: DepthPath::new(RAMP_HOLD, TICKS / 10)?,
            poke: DepthPath::new(POKE, TICKS / 100)?,
        })
    }

    pub fn peak(&self) -> ForceError {
        ForceError { ramp_hold_n: peak(&self.ramp_hold.exact), poke_n: peak(&self.poke.exact) }
    }
}

/// Largest magnitude.
pub(super) fn peak(forces: &[f64]) -> f64 {
    forces.iter().fold(0.0, |peak, force| peak.max(force.abs()))
}

impl DepthPath {
    fn new(corners: &'static [(u64, f64)], every: u64) -> Result<Self, String> {
        let mut path = Self { corners, every, exact: Vec::new() };
        let mut reference =
            Reference::new(&[body().term()], Depth(0.0)).map_err(|err| err.to_string())?;
        let dt = Seconds(every as f64 / TICKS as f64);
        let forces = path
            .checkpoints()
            .skip(1)
            .map(|(_, depth)| Ok(reference.step(depth, dt).map_err(|err| err.to_string())?.0));
        let forces: Result<Vec<f64>, String> = std::iter::once(Ok(0.0)).chain(forces).collect();
        path.exact = forces?;
        Ok(path)
    }

    /// Depth in mm at a tick; before the first corner the probe rests there.
    pub fn depth(&self, tick: i64) -> f64 {
        let tick = tick.max(0) as u64;
        let after = self.corners.iter().position(|corner| corner.0 >= tick);
        let after = after.unwrap_or(self.corners.len() - 1).max(1);
        let ((t0, x0), (t1, x1)) = (self.corners[after - 1], self.corners[after]);
        x0 + (x1 - x0) * (tick - t0) as f64 / (t1 - t0) as f64
    }

    fn end(&self) -> u64 {
        self.corners[self.corners.len() - 1].0
    }

    /// Ticks `step` apart, one of them at the end of the first ramp, where the force is largest: a step
    /// too long for the path must not miss it.
    fn ticks(&self, step: u64) -> impl Iterator<Item = i64> {
        let peak = self.corners[1].0;
        let first = peak as i64 - (peak.div_ceil(step) * step) as i64;
        (0..).map(move |i| first + i * step as i64)
    }

    /// Depths in mm, `step` ticks apart.
    pub fn depths(&self, step: u64) -> impl Iterator<Item = f64> {
        let end = self.end() as i64;
        self.ticks(step).take_while(move |tick| *tick <= end).map(|tick| self.depth(tick))
    }

    /// Time and depth at the moments of comparison.
    pub fn checkpoints(&self) -> impl Iterator<Item = (Seconds, Depth)> {
        (0..=self.end() / self.every).map(|i| {
            let tick = i * self.every;
            (Seconds(tick as f64 / TICKS as f64), Depth(self.depth(tick as i64)))
        })
    }

    /// Exact forces in N of the thesis body at the moments of comparison.
    pub fn exact(&self) -> &[f64] {
        &self.exact
    }

    /// Largest error in N of forces along [`DepthPath::depths`], where they meet moments of comparison.
    pub fn error_of(&self, step: u64, forces: impl Iterator<Item = f64>) -> f64 {
        let every = self.every as i64;
        let met = self.ticks(step).zip(forces).filter(|(tick, _)| *tick >= 0 && tick % every == 0);
        met.fold(0.0, |worst: f64, (tick, force)| {
            worst.max((force - self.exact[(tick / every) as usize]).abs())
        })
    }
}

/// The largest difference of two lists of forces.
pub(super) fn difference(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peaks_are_those_of_the_closed_form() {
        let paths = ReferencePaths::new().unwrap();
        // End of the ramp, in 50 digits.
        let peak = paths.peak();
        assert!((peak.ramp_hold_n - 6.396_495_407_963_657).abs() < 1e-13);
        assert!(peak.poke_n > 2.0 && peak.poke_n < 3.5, "{peak:?}");
        assert_eq!(paths.ramp_hold.depth(20 * TICKS as i64), 15.0);
        assert_eq!(paths.poke.depth((TICKS + TICKS / 20) as i64), 5.0);
        // At -4.9, 0.1 and 5.1 s.
        let coarse: Vec<f64> = paths.poke.depths(5 * TICKS).collect();
        assert_eq!(coarse, [0.0, 10.0, 0.0]);
        let exact = paths.poke.exact().to_vec();
        assert_eq!(paths.poke.error_of(TICKS / 100, exact.into_iter()), 0.0);
    }
}
