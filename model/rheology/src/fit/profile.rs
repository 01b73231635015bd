//! Profile-likelihood intervals: how far one parameter can go while all others make up for it.
//!
//! Given the relaxation time the sum of squares is an exact parabola in every linear parameter, so
//! a handful of relaxation times tells all profiles at once: with `S(tau)` the smallest sum,
//! `b(tau)` the value of a parameter there and `d(tau)` its standard deviation for unit noise, the
//! values within a rise `T` of the smallest sum reach up to
//! `max over tau of b + d sqrt(T - (S - S_min))`. Between the relaxation times (Chebyshev points) the
//! three functions are polynomials.
//!
//! Over several outer parameters the sum has no such shape: there a parameter is fixed at one value after another, and
//! all others are fitted again, until the sum has risen by `T`.

use super::columns::{OuterPoint, ParameterPoint};
use super::refine::{GAIN_THIN, StopRule, refine};
use super::sample::FitError;
use super::solve::FitSolution;
use super::system::Rows;
use super::uncertainty::UncertaintyEstimate;
use crate::families::OuterRange;
use palpate_model::estimate::student_t975;
use serde::{Deserialize, Serialize};

/// Relaxation times evaluated over a range of `ln tau` up to `NARROW`: polynomials of degree six, which
/// leave less than a thousandth of an interval.
const NODES: usize = 7;
const NODES_WIDE: usize = 15;
const NARROW: f64 = 0.5;
/// The first range, in half-widths of the symmetric interval.
const REACH: f64 = 1.3;
/// Times the range is widened before an end counts as open.
const WIDENINGS: usize = 6;
/// Relaxation times at which the maximum is looked for before it is refined.
const LOOKS: usize = 400;

/// Values tried for one end where a parameter is kept at one after another.
const PINS: usize = 14;
/// The root of the rise is wanted to this share: a hundredth of the interval's half-width.
const PIN_TOLERANCE: f64 = 0.01;
/// An end farther than so many half-widths of the symmetric interval is open.
const REACH_MAX: f64 = 50.0;

/// A 95 % interval from the profile likelihood; an end is missing where it is open.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProfileInterval {
    pub name: String,
    /// Lower end, in the parameter's unit.
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// The smallest sum and the linear parameters of one record over the relaxation time.
struct Profile {
    /// `ln tau` from that of the fit.
    offsets: Vec<f64>,
    sums: Vec<f64>,
    /// Per parameter asked for, value and unit standard deviation at every node.
    values: Vec<Vec<f64>>,
    deviations: Vec<Vec<f64>>,
    /// Whether the ends are those of the searched range.
    is_limit: [bool; 2],
}

impl FitSolution<'_> {
    /// Profile-likelihood 95 % intervals of the free parameters of one record, widened for
    /// autocorrelated residuals as the standard errors are.
    pub fn profile(&self, record: usize) -> Result<Vec<ProfileInterval>, FitError> {
        if record >= self.system.records.len() {
            return Ok(Vec::new());
        }
        let system = &self.system;
        let uncertainty = self.uncertainty();
        let errors = self.estimates(record);
        let parameters: Vec<usize> =
            (0..system.layout().count()).filter(|&k| system.fixed(record, k).is_none()).collect();
        let scatter = uncertainty.scatter.unwrap_or(0.0);
        // Without an error of its own (at an edge) a parameter is judged as under white noise.
        let rise = |parameter: usize| {
            let (freedom, inflation) = errors[parameter]
                .map_or((1e9, 1.0), |error: UncertaintyEstimate| (error.freedom, error.inflation));
            (student_t975(freedom) * scatter).powi(2) * inflation
        };
        let named = |parameter: usize, [low, high]: [Option<f64>; 2]| ProfileInterval {
            name: system.known()[parameter].name.clone(),
            low,
            high,
        };
        let outer = &system.unknowns[system.linear..];
        let is_time = |k: usize| {
            k < system.layout().outers && system.source.range_kind(k) == OuterRange::Time
        };
        let has_bounds = system.bounds().contains(&true);
        if outer.len() > 1 || has_bounds || outer.iter().any(|one| !is_time(one.parameter)) {
            let each = parameters.iter().map(|&parameter| {
                let error = errors[parameter].map(|error| error.std_error);
                let ends = [-1.0, 1.0]
                    .map(|side| self.pinned_end(record, parameter, side, error, rise(parameter)));
                named(parameter, ends)
            });
            return Ok(each.collect());
        }
        let highest = parameters.iter().map(|&k| rise(k)).fold(0.0, f64::max);
        let time = outer.first().map(|one| one.parameter);
        let profile = self.walk_profile(record, &parameters, highest, time)?;
        let each = parameters.iter().enumerate().map(|(index, &parameter)| {
            let ends = if Some(parameter) == time {
                let tau = self.refined.points[record].outer.values[parameter];
                profile.reach(rise(parameter)).map(|end| end.map(|offset| tau * offset.exp()))
            } else {
                [-1.0, 1.0].map(|side| profile.end(index, rise(parameter), side))
            };
            named(parameter, ends)
        });
        Ok(each.collect())
    }

    /// How far a parameter can go to one side before the sum of squares has risen so far, all others making up for it;
    /// open where it does not rise within the searched range or [`REACH_MAX`] standard errors.
    fn pinned_end(
        &self,
        record: usize,
        parameter: usize,
        side: f64,
        error: Option<f64>,
        rise: f64,
    ) -> Option<f64> {
        let system = &self.system;
        let rows = system.search_rows();
        let stop = StopRule::Gain(GAIN_THIN);
        let centre = refine(system, &self.refined.points, rows, stop)?;
        let (lowest, mut points) = (centre.sum, centre.points);
        let value = system.physical_values(record, &points[record])[parameter];
        let first = student_t975(1e9) * error?;
        let (floor, ceiling) = system.limits(record, parameter);
        // The rise at a value, from where the search before it ended.
        let risen = |value: f64, points: &mut Vec<ParameterPoint>| -> Option<f64> {
            let pinned = system.pinned(record, parameter, value);
            pinned.pin(points, record, parameter, value);
            let found = refine(&pinned, points, rows, stop)?;
            *points = found.points;
            Some((found.sum - lowest).max(0.0))
        };
        // In standard errors from the value; the root of the rise is close to a straight line over them.
        let (mut near, mut far) = ((0.0, 0.0), None);
        let mut at = 1.0;
        for _ in 0..PINS {
            let wanted = value + side * at * first;
            let target = wanted.clamp(floor, ceiling);
            let root = (risen(target, &mut points)? / rise).sqrt();
            if (root - 1.0).abs() < PIN_TOLERANCE {
                return Some(target);
            }
            if root > 1.0 {
                far = Some((at, root));
            } else if target != wanted {
                return None;
            } else {
                near = (at, root);
            }
            at = match far {
                Some((end, high)) => {
                    let share = (1.0 - near.1) / (high - near.1);
                    near.0 + share.clamp(0.1, 0.9) * (end - near.0)
                }
                None => at * (1.2 / root.max(0.1)).clamp(1.3, 3.0),
            };
            if at > REACH_MAX {
                return None;
            }
        }
        Some((value + side * at * first).clamp(floor, ceiling))
    }

    /// The profile over relaxation times wide enough for a rise of the sum.
    fn walk_profile(
        &self,
        record: usize,
        parameters: &[usize],
        rise: f64,
        time: Option<usize>,
    ) -> Result<Profile, FitError> {
        let (all, linear) = (self.system.unknowns.len(), self.system.linear);
        let Some(time) = time else {
            return self.nodes(record, parameters, &[0.0], ([true; 2], 0));
        };
        let centre = self.refined.points[record].outer.values[time];
        let mut outer = vec![0.0; all];
        outer[linear] = 1.0;
        let unit = self.refined.pass.joint.deviation(&outer);
        let (low, high) = self.system.ranges[record].outers[time];
        let limits = (low - centre.ln(), high - centre.ln());
        let first = REACH * rise.sqrt() * unit;
        let mut reach = [-first, first];
        for _ in 0..WIDENINGS {
            let ends = [reach[0].max(limits.0), reach[1].min(limits.1)];
            let is_limit = [reach[0] <= limits.0, reach[1] >= limits.1];
            let profile = self.nodes(record, parameters, &chebyshev(ends), (is_limit, time))?;
            let allowed = profile.lowest() + rise;
            let is_high =
                [profile.sums[0], profile.sums[profile.sums.len() - 1]].map(|sum| sum > allowed);
            if (0..2).all(|side| is_high[side] || is_limit[side]) {
                return Ok(profile);
            }
            for side in 0..2 {
                if !is_high[side] {
                    reach[side] *= 2.5;
                }
            }
        }
        let ends = [reach[0].max(limits.0), reach[1].min(limits.1)];
        self.nodes(record, parameters, &chebyshev(ends), ([true; 2], time))
    }

    fn nodes(
        &self,
        record: usize,
        parameters: &[usize],
        offsets: &[f64],
        (is_limit, time): ([bool; 2], usize),
    ) -> Result<Profile, FitError> {
        let linear = self.system.linear;
        let mut profile = Profile {
            offsets: offsets.to_vec(),
            sums: Vec::new(),
            values: vec![Vec::new(); parameters.len()],
            deviations: vec![Vec::new(); parameters.len()],
            is_limit,
        };
        for offset in offsets {
            let points = self.refined.points.iter();
            let outers: Vec<OuterPoint> = points
                .map(|point| {
                    let mut outer = point.outer.clone();
                    if let Some(tau) = outer.values.get_mut(time).filter(|_| *offset != 0.0) {
                        *tau *= offset.exp();
                    }
                    outer
                })
                .collect();
            let factor = self.system.values_pass(&outers, Rows::All);
            let factor = factor.ok_or(FitError::Overflow)?;
            let solution = factor.solve(linear);
            let point = &self.system.points(&outers, &solution)[record];
            let values = self.system.physical_values(record, point);
            profile.sums.push(factor.residual_sum(linear));
            for (index, &parameter) in parameters.iter().enumerate() {
                let combination = self.system.combination(record, parameter, point);
                profile.values[index].push(values[parameter]);
                profile.deviations[index].push(factor.deviation(&combination[..linear]));
            }
        }
        Ok(profile)
    }
}

impl Profile {
    fn lowest(&self) -> f64 {
        self.sums.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The polynomial through the nodes (barycentric; Berrut & Trefethen, SIAM Rev. 46 (2004)
    /// 501-517).
    fn at(&self, values: &[f64], offset: f64) -> f64 {
        if values.len() == 1 {
            return values[0];
        }
        let last = values.len() - 1;
        let (mut top, mut bottom) = (0.0, 0.0);
        for (i, (value, node)) in values.iter().zip(&self.offsets).enumerate() {
            if offset == *node {
                return *value;
            }
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let half = if i == 0 || i == last { 0.5 } else { 1.0 };
            let weight = sign * half / (offset - node);
            top += weight * value;
            bottom += weight;
        }
        top / bottom
    }

    fn smallest_sum(&self) -> f64 {
        // The fit's own relaxation time is offset zero and the minimum.
        self.at(&self.sums, 0.0).min(self.lowest())
    }

    /// How far `ln tau` goes within a rise of the sum; open where that is the searched range.
    fn reach(&self, rise: f64) -> [Option<f64>; 2] {
        let allowed = self.smallest_sum() + rise;
        let last = self.offsets.len() - 1;
        [self.offsets[0], self.offsets[last]].map(|end| {
            if self.at(&self.sums, end) <= allowed {
                // Within the range nothing stops it.
                return None;
            }
            let (mut inside, mut outside) = (0.0, end);
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                if self.at(&self.sums, middle) <= allowed {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            Some(inside)
        })
    }

    /// The highest (`side` 1) or lowest (-1) value of a linear parameter within a rise; open where
    /// the relaxation time that goes with it is the end of the searched range.
    fn end(&self, index: usize, rise: f64, side: f64) -> Option<f64> {
        let smallest = self.smallest_sum();
        let value = |offset: f64| {
            let spare = rise - (self.at(&self.sums, offset) - smallest);
            let spread = self.at(&self.deviations[index], offset) * spare.max(0.0).sqrt();
            let value = side * self.at(&self.values[index], offset) + spread;
            if spare < 0.0 { f64::NEG_INFINITY } else { value }
        };
        let last = self.offsets.len() - 1;
        let (from, to) = (self.offsets[0], self.offsets[last]);
        if last == 0 {
            return Some(side * value(from));
        }
        let step = (to - from) / LOOKS as f64;
        let look = |i: usize| from + step * i as f64;
        let best = (0..=LOOKS).max_by(|&a, &b| value(look(a)).total_cmp(&value(look(b))))?;
        let is_open = (best == 0 && self.is_limit[0]) || (best == LOOKS && self.is_limit[1]);
        if is_open {
            return None;
        }
        // Ternary search between the neighbours, where the function has one hump.
        let (mut low, mut high) = (look(best.saturating_sub(1)), look((best + 1).min(LOOKS)));
        for _ in 0..60 {
            let (left, right) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if value(left) < value(right) {
                low = left;
            } else {
                high = right;
            }
        }
        Some(side * value(0.5 * (low + high)))
    }
}

/// Chebyshev points of the second kind from one end to the other.
fn chebyshev([from, to]: [f64; 2]) -> Vec<f64> {
    let count = if to - from < NARROW { NODES } else { NODES_WIDE };
    (0..count)
        .map(|i| {
            let angle = std::f64::consts::PI * i as f64 / (count - 1) as f64;
            0.5 * (from + to) - 0.5 * (to - from) * angle.cos()
        })
        .collect()
}
