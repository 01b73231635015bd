//! Force of a depth history: Lee and Radok (J. Appl. Mech. 27 (1960) 438-444) while the contact grows, Ting (J. Appl. Mech. 33
//! (1966) 845-854; 35 (1968) 248-254) also when it shrinks.
//!
//! ```text
//! growing    F(t) = c * integral from 0 to t  of G(t - s) d(h^n)
//! shrinking  F(t) = c * integral from 0 to t1 of G(t - s) d(h^n),   0 = integral from t1 to t of G(t - s) dh
//! ```
//!
//! `t1` is when the contact was last as wide on its way out as it is at `t` on its way back.

use super::history::{DepthHistory, HistoryError, Knot, Memory, Mode};
use super::relaxation_modulus::{RelaxationMode, RelaxationModulus};
use crate::invalid_value::{InvalidValue, check_poisson, positive};
use crate::shape::IndenterShape;

/// A contact on a half-space whose force is a power of the depth: `force = coefficient * G * depth^exponent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// In mm to the power of two less the exponent.
    coefficient: f64,
    exponent: f64,
}

impl PowerLaw {
    /// The law of a shape: exponent 1 of a flat punch, 3/2 of a sphere, taken as a parabola, and 2 of a cone.
    pub fn new(shape: IndenterShape, poisson: f64) -> Result<Self, InvalidValue> {
        check_poisson(poisson)?;
        let (exponent, shape, size) = match shape {
            IndenterShape::FlatPunch { radius_mm } => (1.0, shape, radius_mm),
            IndenterShape::Parabola { radius_mm } | IndenterShape::Sphere { radius_mm } => {
                (1.5, IndenterShape::Parabola { radius_mm }, radius_mm)
            }
            IndenterShape::Cone { half_angle_rad } => (2.0, shape, half_angle_rad.tan()),
            IndenterShape::RoundedCone { tip_radius_mm: value, .. } => {
                let wanted = "0 mm: with a rounded tip the force is no power of the depth";
                return Err(InvalidValue { name: "the tip radius", value, wanted });
            }
            IndenterShape::ChamferedPunch { flat_radius_mm, radius_mm } => {
                let wanted = "0 mm: with a chamfer the force is no power of the depth";
                let value = radius_mm - flat_radius_mm;
                return Err(InvalidValue { name: "the chamfer", value, wanted });
            }
        };
        positive("the radius or the tangent of the half angle", size, "a number above 0")?;
        let contact = shape.on_half_space(1.0, poisson);
        let force_over_modulus = contact.map_or(f64::NAN, |contact| contact.force_over_modulus);
        // Young's modulus is 2 (1 + nu) G.
        Ok(Self { coefficient: 2.0 * (1.0 + poisson) * force_over_modulus, exponent })
    }

    pub(super) fn of_curve(coefficient: f64, exponent: f64) -> Self {
        Self { coefficient, exponent }
    }

    /// Force over shear modulus at a depth of 1 mm, in mm².
    #[must_use]
    pub fn coefficient(&self) -> f64 {
        self.coefficient
    }

    #[must_use]
    pub fn exponent(&self) -> f64 {
        self.exponent
    }
}

/// Forces in N at the samples of the history, by Lee and Radok: exact for depths that are straight between samples and a contact
/// that does not shrink. Where it does the force is too low, and negative in the end.
pub fn lee_radok_force(
    law: PowerLaw,
    modulus: &RelaxationModulus,
    history: &DepthHistory,
) -> Result<Vec<f64>, HistoryError> {
    let modes = modulus.modes(history.knots())?;
    let mut forces = vec![0.0; history.knots().len() - 1];
    for mode in &modes {
        let memories = Mode::new(mode.time_secs, law.exponent).memories(history.knots());
        for (force, memory) in forces.iter_mut().zip(&memories[1..]) {
            *force += law.coefficient * mode.modulus_mpa * memory.value;
        }
    }
    Ok(forces)
}

/// As `lee_radok_force`, of any relaxation modulus in MPa over the time in s that is finite at zero and smooth over the time
/// between two samples. It takes the square of the number of samples.
pub fn lee_radok_force_of(
    law: PowerLaw,
    modulus: impl Fn(f64) -> f64,
    history: &DepthHistory,
) -> Vec<f64> {
    let (mode, knots) = (Mode::new(f64::INFINITY, law.exponent), history.knots());
    let force_at = |index: usize| {
        let of_interval = |pair: &[Knot]| -> f64 {
            let (from, to) = (pair[0], pair[1]);
            let relaxed = |(passed, part): (f64, f64)| {
                let time = to.time - passed * (to.time - from.time);
                part * modulus(knots[index].time - time)
            };
            mode.parts(to.depth, from.depth).map(relaxed).sum()
        };
        law.coefficient * knots[..=index].windows(2).map(of_interval).sum::<f64>()
    };
    (1..knots.len()).map(force_at).collect()
}

/// Forces in N at the samples of the history, by Ting: one growth of the contact and one shrinking, until it is lost and the
/// force is zero. A flat punch, whose contact does not change, may move as it likes while it touches. Exact for depths that are
/// straight between samples; a contact that grows again is refused,
/// and is what `repeated_contact_force` is for.
pub fn ting_force(
    law: PowerLaw,
    modulus: &RelaxationModulus,
    history: &DepthHistory,
) -> Result<Vec<f64>, HistoryError> {
    let mut forces = lee_radok_force(law, modulus, history)?;
    let (knots, count) = (history.knots(), forces.len());
    let is_punch = law.exponent == 1.0;
    let last_grown = if is_punch {
        forces.iter().position(|force| *force < 0.0).unwrap_or(count)
    } else {
        knots.windows(2).position(|pair| pair[1].depth < pair[0].depth).unwrap_or(count)
    };
    if last_grown < count {
        let mut shrinking = Shrinking::new(law, modulus.modes(knots)?, knots, last_grown);
        if is_punch {
            shrinking.start = shrinking.start_in(0, 0.0);
        }
        for index in last_grown + 1..=count {
            forces[index - 1] = law.coefficient * shrinking.force_at(index)?;
        }
    }
    Ok(forces)
}

/// A contact after its widest.
struct Shrinking<'a> {
    knots: &'a [Knot],
    modes: Vec<ShrinkingMode>,
    /// A `held` above this is more than rounding.
    tolerance: f64,
    start: Start,
}

/// One mode's memories of the depth and of its power.
struct ShrinkingMode {
    term: RelaxationMode,
    depth: Mode,
    power: Mode,
    depths: Vec<Memory>,
    powers: Vec<Memory>,
}

/// The time `t1`, in the interval behind a knot, and what the modes remember there of the depth.
struct Start {
    interval: usize,
    knot: Knot,
    depths: Vec<f64>,
}

impl<'a> Shrinking<'a> {
    fn new(
        law: PowerLaw,
        terms: Vec<RelaxationMode>,
        knots: &'a [Knot],
        last_grown: usize,
    ) -> Self {
        let modes: Vec<ShrinkingMode> = terms
            .into_iter()
            .map(|term| {
                let depth = Mode::new(term.time_secs, 1.0);
                let power = Mode::new(term.time_secs, law.exponent);
                let depths = depth.memories(knots);
                let powers = power.memories(&knots[..=last_grown]);
                ShrinkingMode { term, depth, power, depths, powers }
            })
            .collect();
        let deepest = knots.iter().map(|knot| knot.depth).fold(0.0, f64::max);
        let sum: f64 = modes.iter().map(|mode| mode.term.modulus_mpa).sum();
        let start = Start { interval: 0, knot: knots[0], depths: Vec::new() };
        let mut all = Self { knots, modes, tolerance: 1e-9 * sum * deepest, start };
        all.start = all.start_in(last_grown - 1, 1.0);
        all
    }

    fn start_in(&self, interval: usize, share: f64) -> Start {
        let (from, to) = (self.knots[interval], self.knots[interval + 1]);
        let between = |from: f64, to: f64| from + share * (to - from);
        let knot = Knot { time: between(from.time, to.time), depth: between(from.depth, to.depth) };
        let remembered =
            |mode: &ShrinkingMode| mode.depth.advance(mode.depths[interval], from, knot).value;
        Start { interval, knot, depths: self.modes.iter().map(remembered).collect() }
    }

    /// The integral of `G(t - s) dh` from a start to the knot of this index: above zero where the contact is held there.
    fn held(&self, start: &Start, index: usize) -> f64 {
        let pairs = self.modes.iter().zip(&start.depths);
        let held = |(mode, before): (&ShrinkingMode, &f64)| {
            mode.term.modulus_mpa
                * (mode.depths[index].value - self.decay(mode, start, index) * before)
        };
        pairs.map(held).sum()
    }

    fn decay(&self, mode: &ShrinkingMode, start: &Start, index: usize) -> f64 {
        (-(self.knots[index].time - start.knot.time) / mode.term.time_secs).exp()
    }

    /// The force over the coefficient of the law at the knot of this index, after those before it.
    fn force_at(&mut self, index: usize) -> Result<f64, HistoryError> {
        if self.held(&self.start, index) > self.tolerance {
            return Err(HistoryError::GrowsAgain { time_secs: self.knots[index].time });
        }
        let mut interval = self.start.interval;
        while self.held(&self.start_in(interval, 0.0), index) < 0.0 {
            if interval == 0 {
                self.start = self.start_in(0, 0.0);
                return Ok(0.0);
            }
            interval -= 1;
        }
        // The later the start the less is held.
        let (mut early, mut late) = (0.0, 1.0);
        for _ in 0..52 {
            let middle = 0.5 * (early + late);
            let is_held = self.held(&self.start_in(interval, middle), index) >= 0.0;
            if is_held { early = middle } else { late = middle }
        }
        self.start = self.start_in(interval, early);
        let force = |mode: &ShrinkingMode| {
            let (memory, from) = (mode.powers[interval], self.knots[interval]);
            let memory = mode.power.advance(memory, from, self.start.knot);
            mode.term.modulus_mpa * self.decay(mode, &self.start, index) * memory.value
        };
        Ok(self.modes.iter().map(force).sum())
    }
}
