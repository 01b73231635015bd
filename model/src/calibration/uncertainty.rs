//! What the calibration's own errors do to a force, each by itself (JCGM 100:2008, "Guide to the expression of
//! uncertainty in measurement", sections 4 and 5).
//!
//! Every independent error is moved by one standard uncertainty up and down, the curve is made again and the
//! force is read again, tared on the empty cell as in every run. Half the difference is what that error
//! does at that force; the root of the sum of squares is the standard uncertainty.

use super::CalibrationError;
use super::choice::left_out_volts;
use super::curve::CalibrationCurve;
use super::document::{Calibration, CalibrationPoint, Direction};
use super::quality::{repeatability, rms};
use crate::units::{Newtons, Volts};
use serde::{Deserialize, Serialize};

/// Nodes between two weights at which shifts are computed; between nodes they are straight.
const NODES: usize = 32;
/// Leaving a weight out doubles the gap, and the error of interpolation grows at least with its square.
const GAP_SHARE: f64 = 0.25;
/// An error that no curve survives is halved up to so often and its effect doubled: the effect of a
/// small error is proportional to it.
const HALVINGS: u32 = 20;

crate::named! {
    /// Source of an error.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum UncertaintyTerm {
        /// Tolerance of the weights, a rectangular distribution; each weight is one error in all its steps.
        Weights = "tolerance of the weights",
        /// Scatter of repeats over the root of their number, at each weight by itself.
        Repeatability = "repeatability",
        /// Digits with which readings were written down, rectangular, at each weight by itself.
        Resolution = "digits of the readings",
        /// Loading against unloading: a force may have come from either side, rectangular between them.
        Hysteresis = "hysteresis",
        /// Change of the empty cell's signal while the weights were laid on, rectangular.
        ZeroDrift = "zero drift",
        /// The curve between the weights, from those left out.
        Interpolation = "interpolation",
    }
}

/// One independent error and what one standard uncertainty of it does to a force.
#[derive(Clone, Debug, PartialEq)]
struct Component {
    term: UncertaintyTerm,
    /// Shift of the force in N at each node.
    shifts: Vec<f64>,
}

/// Standard uncertainty of a force that comes from its calibration: the same error in every force read
/// with it, so no averaging takes it away.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceUncertainty {
    /// Forces in N, increasing.
    nodes: Vec<f64>,
    components: Vec<Component>,
    /// Root of the sum of squares at each node, in N.
    sigma: Vec<f64>,
    not_stated: Vec<UncertaintyTerm>,
    range: (Newtons, Newtons),
}

impl ForceUncertainty {
    pub fn of(calibration: &Calibration) -> Result<Self, CalibrationError> {
        let maker = ComponentBuilder::of(calibration)?;
        let mut not_stated = Vec::new();
        let mut components = Vec::new();
        for term in UncertaintyTerm::ALL {
            match maker.components(term) {
                Some(own) => components.extend(own),
                None => not_stated.push(term),
            }
        }
        // An error of exactly nothing is stated, and nothing to compute with.
        components.retain(|component| component.shifts.iter().any(|shift| *shift != 0.0));
        let is_finite = |one: &Component| one.shifts.iter().all(|shift| shift.is_finite());
        if !components.iter().all(is_finite) {
            return Err(CalibrationError::TooFlat);
        }
        let square = |i: usize| components.iter().map(|one| one.shifts[i].powi(2)).sum::<f64>();
        Ok(Self {
            sigma: (0..maker.nodes.len()).map(|i| square(i).sqrt()).collect(),
            range: maker.curve.force_range(),
            nodes: maker.nodes,
            components,
            not_stated,
        })
    }

    /// Standard uncertainty of a force; `None` where the calibration states nothing of its errors.
    pub fn sigma(&self, force: Newtons) -> Option<Newtons> {
        self.is_stated().then(|| Newtons(self.between(&self.sigma, force.0)))
    }

    /// The part of one term.
    pub fn term_sigma(&self, term: UncertaintyTerm, force: Newtons) -> Option<Newtons> {
        if self.not_stated.contains(&term) {
            return None;
        }
        let own = self.components.iter().filter(|one| one.term == term);
        // A term without errors is 0; an empty sum would be -0.
        let square = own.fold(0.0, |sum, one| sum + self.between(&one.shifts, force.0).powi(2));
        Some(Newtons(square.sqrt()))
    }

    /// Whether anything is known of its errors.
    pub fn is_stated(&self) -> bool {
        self.not_stated.len() < UncertaintyTerm::ALL.len()
    }

    /// Terms of which the calibration says nothing.
    pub fn not_stated(&self) -> &[UncertaintyTerm] {
        &self.not_stated
    }

    /// Whether a force lies beyond the weights, where the true uncertainty is larger than [`Self::sigma`].
    pub fn is_extrapolated(&self, force: Newtons) -> bool {
        !(self.range.0.0..=self.range.1.0).contains(&force.0)
    }

    /// The heaviest weight.
    pub fn force_max(&self) -> Newtons {
        self.range.1
    }

    /// The term of each independent error.
    pub fn errors(&self) -> impl Iterator<Item = UncertaintyTerm> {
        self.components.iter().map(|component| component.term)
    }

    /// How far one standard uncertainty of the error with this index, of [`ForceUncertainty::errors`], moves
    /// a force.
    pub fn shift(&self, error: usize, force: Newtons) -> Newtons {
        Newtons(self.between(&self.components[error].shifts, force.0))
    }

    /// A table over the nodes, straight in between and beyond.
    fn between(&self, table: &[f64], force: f64) -> f64 {
        let after = self.nodes.partition_point(|node| *node <= force);
        let i = after.clamp(1, self.nodes.len() - 1);
        let share = (force - self.nodes[i - 1]) / (self.nodes[i] - self.nodes[i - 1]);
        table[i - 1] + share * (table[i] - table[i - 1])
    }
}

struct ComponentBuilder<'a> {
    calibration: &'a Calibration,
    points: Vec<CalibrationPoint>,
    curve: CalibrationCurve,
    nodes: Vec<f64>,
}

impl<'a> ComponentBuilder<'a> {
    fn of(calibration: &'a Calibration) -> Result<Self, CalibrationError> {
        let points = calibration.points()?;
        let curve = calibration.curve.through(&points)?;
        let mut nodes = Vec::with_capacity(NODES * points.len() + 2);
        // One node beyond each end, where everything is straight.
        nodes.push(2.0 * points[0].newtons.0 - points[1].newtons.0);
        for pair in points.windows(2) {
            let (from, to) = (pair[0].newtons.0, pair[1].newtons.0);
            let inner = (0..NODES).map(|k| from + (to - from) * k as f64 / NODES as f64);
            nodes.extend(inner);
        }
        let last = points[points.len() - 1].newtons.0;
        nodes.extend([last, last + (last - points[points.len() - 2].newtons.0)]);
        Ok(Self { calibration, points, curve, nodes })
    }

    /// The errors of a term; `None` where the calibration says nothing of it.
    fn components(&self, term: UncertaintyTerm) -> Option<Vec<Component>> {
        match term {
            UncertaintyTerm::Weights => self.weights(),
            UncertaintyTerm::Repeatability => self.each_point(term, self.reading_sigmas()?),
            UncertaintyTerm::Resolution => {
                // Readings with a known noise of their samples are not limited by digits.
                let is_sampled = || self.sampled().is_some();
                match self.calibration.reading_resolution() {
                    Some(digit) => {
                        let sigma = digit.0 / 12f64.sqrt();
                        self.each_point(term, vec![sigma; self.points.len()])
                    }
                    None => is_sampled().then(Vec::new),
                }
            }
            UncertaintyTerm::Hysteresis => {
                let halves: Vec<Option<f64>> = self
                    .points
                    .iter()
                    .map(|point| point.hysteresis().map(|volts| 0.5 * volts.0 / 3f64.sqrt()))
                    .collect();
                if halves.iter().all(Option::is_none) {
                    return None;
                }
                let moved = |share: f64| {
                    self.moved(|i, point| point.volts.0 += share * halves[i].unwrap_or(0.0))
                };
                Some(vec![self.component(term, moved)])
            }
            UncertaintyTerm::ZeroDrift => {
                let sigma = 0.5 * self.calibration.zero_shift()?.0.abs() / 3f64.sqrt();
                // Taring takes out what moves all signals alike.
                let moved = |share: f64| {
                    self.moved(|_, point| {
                        if point.newtons.0 > 0.0 {
                            point.volts.0 += share * sigma;
                        }
                    })
                };
                Some(vec![self.component(term, moved)])
            }
            UncertaintyTerm::Interpolation => self.interpolation(),
        }
    }

    /// Each weight is wrong by the same amount wherever it lies on the cell.
    fn weights(&self) -> Option<Vec<Component>> {
        let names_known = self
            .calibration
            .series_steps()
            .all(|(_, step)| step.mass_g == 0.0 || !step.weights.is_empty());
        if self.calibration.series.is_empty() || !names_known {
            return None;
        }
        let mut components = Vec::new();
        for weight in &self.calibration.weights {
            let sigma_g = weight.tolerance_g? / 3f64.sqrt();
            let sigma = super::newtons_of(sigma_g).0;
            // How many of the readings under each mass had it on the cell.
            let shares: Vec<f64> =
                self.points.iter().map(|p| self.share(&weight.name, p)).collect();
            let moved =
                |share: f64| self.moved(|i, point| point.newtons.0 += share * sigma * shares[i]);
            components.push(self.component(UncertaintyTerm::Weights, moved));
        }
        (!components.is_empty()).then_some(components)
    }

    fn share(&self, name: &str, point: &CalibrationPoint) -> f64 {
        let steps = self.calibration.series_steps().map(|(_, step)| step);
        let own: Vec<_> = steps.filter(|step| (step.mass_g - point.mass_g).abs() <= 1e-6).collect();
        let with = own.iter().filter(|step| step.weights.iter().any(|one| one == name));
        with.count() as f64 / own.len().max(1) as f64
    }

    /// Standard uncertainty in V of each point's mean: from the scatter of repeats, or where there are none
    /// from the noise of the samples.
    fn reading_sigmas(&self) -> Option<Vec<f64>> {
        if let Some(one) = repeatability(&self.points) {
            let sigma = |point: &CalibrationPoint| mean_sigma(point, |_| Some(one));
            return self.points.iter().map(sigma).collect();
        }
        self.sampled()
    }

    /// The same from the noise of the samples alone.
    fn sampled(&self) -> Option<Vec<f64>> {
        let sigma = |point: &CalibrationPoint| mean_sigma(point, |reading| reading.noise_of_mean);
        self.points.iter().map(sigma).collect()
    }

    /// One independent error in V at each point.
    fn each_point(&self, term: UncertaintyTerm, sigmas: Vec<f64>) -> Option<Vec<Component>> {
        let one = |k: usize| {
            let moved = |share: f64| {
                self.moved(|i, point| {
                    if i == k {
                        point.volts.0 += share * sigmas[k];
                    }
                })
            };
            self.component(term, moved)
        };
        Some((0..self.points.len()).map(one).collect())
    }

    /// The curve through points that were moved.
    fn moved(&self, change: impl Fn(usize, &mut CalibrationPoint)) -> Option<CalibrationCurve> {
        let mut points = self.points.clone();
        points.iter_mut().enumerate().for_each(|(i, point)| change(i, point));
        let is_ordered = points.windows(2).all(|pair| pair[0].newtons.0 < pair[1].newtons.0);
        is_ordered.then(|| self.calibration.curve.through(&points).ok()).flatten()
    }

    /// Half the difference of the forces read with the error up and down.
    fn component(
        &self,
        term: UncertaintyTerm,
        moved: impl Fn(f64) -> Option<CalibrationCurve>,
    ) -> Component {
        let pair = |halvings: u32| {
            let share = 0.5f64.powi(halvings as i32);
            Some((share, moved(share)?, moved(-share)?))
        };
        let shifts = match (0..HALVINGS).find_map(pair) {
            Some((share, up, down)) => {
                let shift = |&force: &f64| {
                    (self.read(&up, force) - self.read(&down, force)) / (2.0 * share)
                };
                self.nodes.iter().map(shift).collect()
            }
            // Refused by the caller.
            None => vec![f64::INFINITY; self.nodes.len()],
        };
        Component { term, shifts }
    }

    /// The force that another curve reads, tared, where this one reads `force`.
    fn read(&self, other: &CalibrationCurve, force: f64) -> f64 {
        let zero = Newtons(0.0);
        let above_zero =
            self.curve.volts_from_newtons(Newtons(force)) - self.curve.volts_from_newtons(zero);
        other.newtons_from_volts(above_zero + other.volts_from_newtons(zero)).0
    }

    /// Between weights, an arch of the size of the neighbours' errors when left out, and two that change their sign once and
    /// twice, orthogonal to it: Gegenbauer polynomials (Abramowitz & Stegun, section 22.2). A curve that meets its
    /// points is held to the interval whose ends it knows; one that misses them may be off at each point.
    fn interpolation(&self) -> Option<Vec<Component>> {
        let left_out = left_out_volts(&self.calibration.curve, &self.points);
        if left_out.iter().all(Option::is_none) {
            return None;
        }
        let last = self.points.len() - 1;
        let newtons = |i: usize| self.points[i].newtons.0;
        let component = |shift: &dyn Fn(f64) -> f64| Component {
            term: UncertaintyTerm::Interpolation,
            shifts: self.nodes.iter().map(|force| shift(*force)).collect(),
        };
        let sensitivity = |force: f64| self.curve.sensitivity_at(Newtons(force));
        if self.calibration.curve.meets_all(&self.points) {
            let arch = |(i, order): (usize, usize)| {
                let near = left_out[i..=i + 1].iter().flatten().copied();
                let sigma = GAP_SHARE * rms(near).unwrap_or(0.0);
                let (from, to) = (newtons(i), newtons(i + 1));
                component(&|force| {
                    let s = (force - from) / (to - from);
                    if !(0.0..=1.0).contains(&s) {
                        return 0.0;
                    }
                    let shape = [1.0, 1.0 - 2.0 * s, 1.0 - 5.0 * s * (1.0 - s)][order];
                    let error = 4.0 * s * (1.0 - s) * shape * sigma / sensitivity(force);
                    let limit = (force - from).min(to - force);
                    error.clamp(-limit, limit)
                })
            };
            let arches = (0..last).flat_map(|i| (0..3).map(move |order| (i, order)));
            return Some(arches.map(arch).collect());
        }
        let sigma = rms(left_out.iter().flatten().copied()).unwrap_or(0.0);
        let hat = |i: usize| {
            component(&|force| {
                let side = if force < newtons(i) { i.checked_sub(1) } else { Some(i + 1) };
                let next = side.filter(|next| *next <= last).map(newtons);
                let height = next.map_or(1.0, |next| {
                    (1.0 - (force - newtons(i)) / (next - newtons(i))).max(0.0)
                });
                height * sigma / sensitivity(force)
            })
        };
        // The tare corrects the point without a weight.
        Some((0..=last).filter(|i| newtons(*i) != 0.0).map(hat).collect())
    }
}

/// Standard deviation in V of the mean of directions' means; `None` if a reading's own is not known.
fn mean_sigma(
    point: &CalibrationPoint,
    sigma: impl Fn(&super::CalibrationReading) -> Option<Volts>,
) -> Option<f64> {
    let mut square = 0.0;
    let mut ways = 0;
    for direction in [Direction::Loading, Direction::Unloading] {
        let own = point.readings.iter().filter(|one| one.direction == direction);
        let sigmas: Vec<f64> = own.map(|one| Some(sigma(one)?.0)).collect::<Option<_>>()?;
        if !sigmas.is_empty() {
            let sum = sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>();
            square += sum / (sigmas.len() as f64).powi(2);
            ways += 1;
        }
    }
    Some(square.sqrt() / f64::from(ways.max(1)))
}
