//! Where the tissue begins, from all forces while it was touched twice: a fast press, the
//! relaxation after it, and a slow pass.
//!
//! One pass at one speed cannot tell a late onset from a slow one: at speed `v` a body with relaxation
//! time `tau` feels as if it began `v tau` deeper, and if `tau` is unknown so is the contact. Two speeds and a
//! relaxation tell `tau` apart. The force model's whole body is followed along the commanded path by its exact
//! step; for each contact position and relaxation time its four coefficients, the offset and a steady drift are
//! linear and solved exactly (variable projection, Golub & Pereyra 1973), and the two others are scanned
//! coarsely, then refined by Gauss-Newton.
//!
//! The viscous force of that body grows with depth times speed, and tissue whose viscous force grows with the
//! speed alone, such as a standard linear solid, resists at once. Taken for the other kind, it seems to have begun
//! a millimetre earlier. So where the residuals are autocorrelated, a body with both viscous forces is tried as well, and
//! preferred if it leaves less than chance would explain.

use super::contact::{ContactEstimate, ContactFitError, descend};
use crate::linalg::Triangle;
use crate::units::{Depth, Newtons, Position, Seconds};
use crate::viscoelastic::{KelvinState, ModifiedKelvin};

/// One averaged sample of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSearchPoint {
    /// Time in the search.
    pub t: Seconds,
    /// Commanded position from home.
    pub position: Position,
    /// Force above tare; `None` where the tissue moved but the force does not count, such as on a retreat
    /// that may have lifted off.
    pub force: Option<Newtons>,
}

/// Fewer forces than this do not carry two outer and six linear parameters.
const FORCES_MIN: usize = 100;

/// Relaxation times considered, in s: faster than any load cell of this kind follows, slower than any search.
const TAU_RANGE: [f64; 2] = [0.02, 60.0];
/// Relaxation times scanned: three a decade, close enough for Gauss-Newton to find the nearest minimum.
const TAU_COUNT: u32 = 10;
/// Contact positions scanned, evenly over the search.
const CONTACT_COUNT: u32 = 60;
/// The scan looks at about so many points, each a mean of several.
const SCAN_POINTS: usize = 300;
/// Refinements settle within a handful of steps.
const STEPS_MAX: usize = 40;
/// Points in a block whose mean shows whether residuals are autocorrelated: 0.2 s of the engine's points.
const BLOCK: usize = 10;

/// Filtered powers of depth, filtered depth times speed, and filtered speed.
const BODY: usize = 5;
/// Offset, drift, coefficients of the body, derivatives by contact, ln tau and distance; zeros; the force.
const SPACE: usize = 2 + BODY + 3 + 1;
type Row = [f64; SPACE];

/// Variances of one force by which a further coefficient must lower the sum of squares, were residuals white: chance
/// does so once in 16 000.
const GAIN_MIN: f64 = 16.0;

/// Standard errors by which the positions of two touches must differ to be two: rarer by chance than one in three hundred.
const SEPARATION_SIGMAS: f64 = 3.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchEstimate {
    /// The contact position. Half of the distance between the touches is part of its standard error if it is
    /// more than noise, and
    /// half of what another body says otherwise, as far as it describes the tissue as well.
    pub contact: ContactEstimate,
    /// How much deeper the second touch met the tissue than the first, in mm, if there were two and this is
    /// more than noise.
    pub separation_mm: Option<f64>,
}

/// Estimates the contact position from a whole search. The path must begin out of contact and go on without
/// gaps; times rise. What follows the last point without force is the second touch.
pub fn fit_touch(points: &[ContactSearchPoint]) -> Result<TouchEstimate, ContactFitError> {
    let mut search = Search::new(points.to_vec())?;
    let mut starts = search.coarse().scan();
    let mut found = search.best(&starts).ok_or(ContactFitError::NoOnset)?;
    if found.variance_inflation > 1.0 {
        search.has_speed_term = true;
        let others = search.coarse().scan();
        match search.best(&others) {
            Some(mut other)
                if found.cost - other.cost
                    > GAIN_MIN * other.variance * other.variance_inflation =>
            {
                // Half of what the bodies disagree by, if one describes the tissue hardly better than the other;
                // nothing if it does far better.
                let way = other.trial.contact - found.trial.contact;
                other.model_error_mm = 0.5 * way.abs() * (other.cost / found.cost);
                (starts, found) = (others, other);
            }
            _ => search.has_speed_term = false,
        }
    }
    search.estimate(&found, &starts).ok_or(ContactFitError::NoOnset)
}

/// A trial contact position in mm, the logarithm of a relaxation time in s, and how much deeper in mm the second
/// touch meets the tissue.
#[derive(Clone, Copy, Debug)]
struct Trial {
    contact: f64,
    log_tau: f64,
    separation: f64,
}

/// The bottom of the deepest valley.
struct ValleyBottom {
    trial: Trial,
    /// Sum of squares of the residuals, its share of one force, and what [`Search::variance_inflation`].
    cost: f64,
    variance: f64,
    variance_inflation: f64,
    model_error_mm: f64,
}

struct Search {
    /// The body's viscous force grows with the speed alone, too.
    has_speed_term: bool,
    /// The second touch may meet the tissue elsewhere than the first.
    has_separation: bool,
    /// The last point before the second touch, if there is one.
    between: Option<usize>,
    points: Vec<ContactSearchPoint>,
    shallow: f64,
    deep: f64,
    span: f64,
}

impl Search {
    fn new(points: Vec<ContactSearchPoint>) -> Result<Self, ContactFitError> {
        let forces = points.iter().filter(|point| point.force.is_some()).count();
        if forces < FORCES_MIN {
            return Err(ContactFitError::TooShort { points: forces });
        }
        let is_forward = points.windows(2).all(|pair| pair[1].t.0 > pair[0].t.0);
        let is_finite = points.iter().all(|point| {
            let force = point.force.unwrap_or(Newtons(0.0));
            point.t.is_finite() && point.position.is_finite() && force.is_finite()
        });
        let mut deep = f64::NEG_INFINITY;
        points.iter().for_each(|point| deep = deep.max(point.position.0));
        let (begin, end) = (points[0], points[points.len() - 1]);
        if !(is_forward && is_finite && deep > begin.position.0) {
            return Err(ContactFitError::NotOneSpeed);
        }
        Ok(Self {
            has_speed_term: false,
            has_separation: false,
            between: points.iter().rposition(|point| point.force.is_none()),
            shallow: begin.position.0,
            deep,
            span: end.t.0 - begin.t.0,
            points,
        })
    }

    /// Coefficients that are linear: offset, drift, and those of the body.
    fn linear(&self) -> usize {
        if self.has_speed_term { 2 + BODY } else { 1 + BODY }
    }

    /// Parameters that are not: contact, ln tau and perhaps the distance.
    fn outer(&self) -> usize {
        if self.has_separation { 3 } else { 2 }
    }

    fn best(&self, starts: &[Trial]) -> Option<ValleyBottom> {
        let coarse = self.coarse();
        // A first touch alone hardly tells an early onset of a slow body from a late one of a fast body: every
        // relaxation time has its own valley, and the deepest shows only at its bottom.
        let bottoms = starts.iter().filter_map(|start| {
            let trial = coarse.refined(*start);
            Some((trial, coarse.solve(trial)?.1))
        });
        let (near, _) = bottoms.min_by(|one, other| one.1.total_cmp(&other.1))?;
        let trial = self.refined(near);
        let (linear, cost) = self.solve(trial)?;
        let forces = self.points.iter().filter(|point| point.force.is_some());
        let variance = cost / (forces.count() - self.linear() - self.outer()) as f64;
        Some(ValleyBottom {
            trial,
            cost,
            variance,
            variance_inflation: self.variance_inflation(trial, &linear, variance),
            model_error_mm: 0.0,
        })
    }

    fn coarse(&self) -> Self {
        self.thinned(self.points.len().div_ceil(SCAN_POINTS))
    }

    /// The same search with means of so many points in the place of one.
    fn thinned(&self, group: usize) -> Self {
        let mean_of = |points: &[ContactSearchPoint]| {
            let mean = |of: &dyn Fn(&ContactSearchPoint) -> f64| {
                points.iter().map(of).sum::<f64>() / points.len() as f64
            };
            let forces: Option<Vec<f64>> =
                points.iter().map(|point| point.force.map(|force| force.0)).collect();
            ContactSearchPoint {
                t: Seconds(mean(&|point| point.t.0)),
                position: Position(mean(&|point| point.position.0)),
                force: forces.map(|f| Newtons(f.iter().sum::<f64>() / f.len() as f64)),
            }
        };
        let points: Vec<_> = self.points.chunks(group).map(mean_of).collect();
        Self { between: points.iter().rposition(|point| point.force.is_none()), points, ..*self }
    }

    /// Follows the path; hands out the body's columns at every force, zero where nothing is touched.
    fn follow(
        &self,
        trial: Trial,
        mut at: impl FnMut(usize, &ContactSearchPoint, f64, [f64; BODY]),
    ) {
        let body = ModifiedKelvin { tau_eps: trial.log_tau.exp(), mu: [0.0; 3], tau_sig: 0.0 };
        let depth = |index: usize, point: &ContactSearchPoint| {
            let is_second = self.between.is_some_and(|between| index > between);
            let separation = if is_second { trial.separation } else { 0.0 };
            Depth(point.position.0 - trial.contact - separation)
        };
        let reach = self.deep - trial.contact;
        // Columns of like size: powers of the share of the deepest depth.
        let scales = scales(reach).map(f64::recip);
        let mut state = KelvinState::at_rest_from(depth(0, &self.points[0]));
        let mut before = self.points[0].t.0;
        for (index, point) in self.points.iter().enumerate() {
            let depth = depth(index, point);
            if point.t.0 > before {
                state.step(&body, depth, Seconds(point.t.0 - before));
                before = point.t.0;
            }
            if let Some(force) = point.force {
                let mut columns = [0.0; BODY];
                if depth.0 > 0.0 {
                    let [f1, f2, f3, g] = state.columns();
                    // tau times the filtered speed, by parts.
                    let speed = if self.has_speed_term { depth.0 - f1 } else { 0.0 };
                    columns = [f1, f2, f3, g, speed];
                    columns.iter_mut().zip(scales).for_each(|(c, s)| *c *= s);
                }
                at(index, point, force.0, columns);
            }
        }
    }

    /// The linear columns, and the force.
    fn row(&self, point: &ContactSearchPoint, force: f64, columns: [f64; BODY]) -> Row {
        let mut row = [0.0; SPACE];
        row[..2].copy_from_slice(&[1.0, point.t.0 / self.span]);
        row[2..2 + BODY].copy_from_slice(&columns);
        row[SPACE - 1] = force;
        row
    }

    /// Linear coefficients and residual sum at a trial; `None` where the trial is meaningless.
    fn solve(&self, trial: Trial) -> Option<(Row, f64)> {
        if !(trial.contact > self.shallow && trial.contact < self.deep) {
            return None;
        }
        let mut rows = Triangle::<SPACE>::default();
        self.follow(trial, |_, point, force, columns| {
            rows.push(self.row(point, force, columns));
        });
        Some((rows.solve(self.linear())?, rows.residual_sum()))
    }

    /// The best contact position of each relaxation time scanned.
    fn scan(&self) -> Vec<Trial> {
        let [low, high] = TAU_RANGE.map(f64::ln);
        let best_at = |log_tau: f64| {
            let trials = (1..CONTACT_COUNT).filter_map(|i| {
                let share = f64::from(i) / f64::from(CONTACT_COUNT);
                let contact = self.shallow + share * (self.deep - self.shallow);
                let trial = Trial { contact, log_tau, separation: 0.0 };
                Some((trial, self.solve(trial)?.1))
            });
            let best = trials.min_by(|one, other| one.1.total_cmp(&other.1))?;
            Some(best.0)
        };
        (0..TAU_COUNT)
            .filter_map(|j| best_at(low + (high - low) * f64::from(j) / f64::from(TAU_COUNT - 1)))
            .collect()
    }

    /// Gauss-Newton with step halving from a trial to the bottom of its valley.
    fn refined(&self, trial: Trial) -> Trial {
        let Some((_, cost)) = self.solve(trial) else {
            return trial;
        };
        let [low, high] = TAU_RANGE.map(f64::ln);
        let line = |trial: Trial| {
            let mut triangle = Triangle::default();
            self.linearised(trial)?.into_iter().for_each(|(_, row)| triangle.push(row));
            let step = triangle.solve(self.linear() + self.outer())?;
            Some(move |share: f64| {
                let next = Trial {
                    contact: trial.contact + share * step[self.linear()],
                    // A factor of e at a time keeps the step where the linearisation holds.
                    log_tau: (trial.log_tau + share * step[self.linear() + 1].clamp(-1.0, 1.0))
                        .clamp(low, high),
                    separation: trial.separation + share * step[self.linear() + 2],
                };
                Some((next, self.solve(next)?.1))
            })
        };
        // A step that gains less than a hundredth of one degree of freedom moves the answer by less
        // than a tenth of its standard error.
        let gain_min = |cost: f64| 1e-2 * cost / self.points.len() as f64;
        descend((trial, cost), STEPS_MAX, gain_min, line).0
    }

    /// All columns at a trial, with the derivatives of the fitted force by contact and ln tau, and the index of
    /// their point.
    fn linearised(&self, trial: Trial) -> Option<Vec<(usize, Row)>> {
        let (linear, _) = self.solve(trial)?;
        let reach = self.deep - trial.contact;
        // Central differences of an exact response: 1e-4 of the depth and of tau leaves eight digits.
        let (dx, dl) = (1e-4 * reach, 1e-4);
        let response = |by: Trial| {
            // The coefficients belong to the scales of the trial itself.
            let ratios = scales((self.deep - by.contact) / reach);
            let mut forces = Vec::with_capacity(self.points.len());
            self.follow(by, |_, _, _, columns| {
                let terms = (0..BODY).map(|k| linear[k + 2] * columns[k] * ratios[k]);
                forces.push(terms.sum::<f64>());
            });
            forces
        };
        let by = |contact: f64, log_tau: f64, separation: f64| {
            let shifted = |sign: f64| {
                response(Trial {
                    contact: trial.contact + sign * contact,
                    log_tau: trial.log_tau + sign * log_tau,
                    separation: trial.separation + sign * separation,
                })
            };
            let step = 2.0 * (contact + log_tau + separation);
            let pairs = shifted(1.0).into_iter().zip(shifted(-1.0));
            pairs.map(move |(up, down)| (up - down) / step)
        };
        let mut by_all = [
            Some(by(dx, 0.0, 0.0)),
            Some(by(0.0, dl, 0.0)),
            self.has_separation.then(|| by(0.0, 0.0, dx)),
        ];
        let mut rows = Vec::with_capacity(self.points.len());
        self.follow(trial, |index, point, force, columns| {
            let mut row = self.row(point, force, columns);
            for (k, by) in by_all.iter_mut().flatten().enumerate() {
                row[self.linear() + k] = by.next().unwrap_or(0.0);
            }
            rows.push((index, row));
        });
        Some(rows)
    }

    fn estimate(&self, bottom: &ValleyBottom, starts: &[Trial]) -> Option<TouchEstimate> {
        let by_noise = self.std_error(bottom, 0)?;
        let apart_mm = self.separation(starts);
        let std_error_mm =
            by_noise.hypot(apart_mm.unwrap_or(0.0) / 2.0).hypot(bottom.model_error_mm);
        // Against offset and drift alone the fit must gain what noise cannot: chi-square with six degrees,
        // for which 100 has a chance of 1e-18 a trial.
        let gain = (self.cost_without_contact()? - bottom.cost) / bottom.variance;
        let contact = ContactEstimate {
            position: Position(bottom.trial.contact),
            std_error_mm,
            rmse_n: bottom.variance.sqrt(),
        };
        (gain > 100.0 && std_error_mm.is_finite())
            .then_some(TouchEstimate { contact, separation_mm: apart_mm })
    }

    /// How much deeper the second touch met the tissue, if that is more than noise: everything is
    /// fitted again with the distance free.
    fn separation(&self, starts: &[Trial]) -> Option<f64> {
        self.between?;
        let free = Self { has_separation: true, points: self.points.clone(), ..*self };
        let moved = free.best(starts)?;
        let error = free.std_error(&moved, 2)?;
        (moved.trial.separation.abs() > SEPARATION_SIGMAS * error).then_some(moved.trial.separation)
    }

    /// Of the contact (0), ln tau (1) or the distance (2).
    fn std_error(&self, bottom: &ValleyBottom, which: usize) -> Option<f64> {
        let mut triangle = Triangle::default();
        let rows = self.linearised(bottom.trial)?;
        rows.iter().for_each(|(_, row)| triangle.push(*row));
        let (linear, all) = (self.linear(), self.linear() + self.outer());
        let unit = triangle.inverse_diagonal(linear + which, all)?;
        Some((bottom.variance * bottom.variance_inflation * unit).sqrt())
    }

    /// How much more the means of blocks of residuals scatter than those of white noise could, else 1: by so
    /// much the variance of a slow parameter is larger than white noise would make it.
    fn variance_inflation(&self, trial: Trial, linear: &Row, variance: f64) -> f64 {
        let (mut blocks, mut squares) = (0.0, 0.0);
        let (mut sum, mut length, mut last) = (0.0, 0, None);
        self.follow(trial, |index, point, force, columns| {
            if last.is_some_and(|last| index != last + 1) {
                (sum, length) = (0.0, 0);
            }
            last = Some(index);
            let row = self.row(point, force, columns);
            let of_line = row.iter().zip(linear).take(self.linear());
            let fitted: f64 = of_line.map(|(x, a)| x * a).sum();
            sum += force - fitted;
            length += 1;
            if length == BLOCK {
                squares += sum * sum / BLOCK as f64;
                blocks += 1.0;
                (sum, length) = (0.0, 0);
            }
        });
        let ratio = squares / blocks / variance;
        // A variance from so many blocks scatters by the root of two over their number; three times that is
        // no accident. A ratio that is no number comes of too few blocks or of no noise at all.
        if ratio > 1.0 + 3.0 * (2.0f64 / blocks).sqrt() { ratio } else { 1.0 }
    }

    /// Sum of squares about offset and drift.
    fn cost_without_contact(&self) -> Option<f64> {
        let mut rows = Triangle::<3>::default();
        for point in &self.points {
            if let Some(force) = point.force {
                rows.push([1.0, point.t.0 / self.span, force.0]);
            }
        }
        rows.solve(2)?;
        Some(rows.residual_sum())
    }
}

/// Sizes of the columns of a body pressed so deep.
fn scales(depth: f64) -> [f64; BODY] {
    [depth, depth.powi(2), depth.powi(3), depth.powi(2), depth]
}
