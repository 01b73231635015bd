//! Damped Gauss-Newton steps (Levenberg 1944, Marquardt 1963) on the projected problem (Kaufman, BIT 15 (1975) 49-57).

use super::columns::{OuterPoint, ParameterPoint, coordinate, step_value};
use super::passes::Pass;
use super::system::{Rows, System};
use super::triangle::{Factor, Triangle};

/// A step of the outer parameters below this leaves its square: rounding, once it is taken.
const STEP_MIN: f64 = 1e-9;
/// Shortening steps ends here.
const STEP_ZERO: f64 = 1e-13;
/// A step below this share of its standard error is the last. It is taken whole, and what it leaves
/// is its own square plus what Kaufman's simplification leaves under noise: with a contraction of
/// 1e-4 on the thesis protocol (and 1e-2 allowed for) less than a thousandth of a standard error.
const STEP_SHARE: f64 = 0.1;
/// The same with a free contact: the sum bends more sharply over it than over a relaxation time.
const STEP_SHARE_CONTACT: f64 = 0.001;
/// The same where errors of the calibration are found too: they are taken as straight around what was found before, which
/// leaves steps of a few thousandths.
const STEP_SHARE_ERRORS: f64 = 0.01;
/// But only where it is short enough for its square to be small.
const STEP_LONG: f64 = 1e-2;
/// Steps at most, those that were refused included.
const PASSES_MAX: usize = 60;
/// Longest single step of a search coordinate and of the scaled contact.
const STEP_MAX: [f64; 2] = [1.0, 0.08];
/// Rounding level of a sum of squares, relative to that of the forces.
const ROUNDING: f64 = 1e-26;
/// Damping, relative to the size of a column, after a step that did not help, and below which there is none.
const DAMPING: (f64, f64) = (1e-3, 1e-6);
/// Damping beyond which no step helps.
const DAMPING_MAX: f64 = 1e8;
/// A step that gains less than this share of the sum of squares is the last where the parameters shall be right to a
/// tenth of a standard error.
pub(super) const GAIN_THIN: f64 = 1e-6;
/// The same where valleys are compared.
pub(super) const GAIN_VALLEY: f64 = 1e-4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum StopRule {
    /// When what is left of them is lost in the noise of the parameters.
    Noise,
    /// When one gains less than this share of the sum of squares.
    Gain(f64),
}

/// The end of the iteration.
#[derive(Clone, Debug)]
pub(super) struct RefinedFit {
    pub points: Vec<ParameterPoint>,
    /// The triangles within one last small step of the end.
    pub pass: Pass,
    /// That step, of all unknowns.
    pub change: Vec<f64>,
    /// Weighted sum of squares left.
    pub sum: f64,
    pub is_converged: bool,
}

/// A point with its triangles, and how far the solution of all of them is from it.
struct Iterate {
    points: Vec<ParameterPoint>,
    pass: Pass,
    sum: f64,
    /// Linear unknowns that may move: all but those at their bound.
    passive: Vec<usize>,
    /// Change of the linear unknowns that is best at these outer parameters.
    change: Vec<f64>,
}

/// A step and what it leads to.
struct Step {
    points: Vec<ParameterPoint>,
    /// Change of the linear unknowns that goes with it to first order.
    change: Vec<f64>,
    /// Change of the outer unknowns, as far as their ranges allow.
    taken: Vec<f64>,
    is_whole: bool,
}

/// Follows a start to the minimum of the weighted sum of squares; `None` where there is no finite one.
pub(super) fn refine(
    system: &System<'_>,
    start: &[ParameterPoint],
    rows: Rows,
    stop: StopRule,
) -> Option<RefinedFit> {
    let mut here = Iterate::at(system, start.to_vec(), rows, f64::INFINITY)?;
    let force_square = system.force_square();
    let mut damping = 0.0;
    let mut is_converged = false;
    for _ in 1..PASSES_MAX {
        let step = here.step(system, damping);
        let length = largest_component(&step.taken);
        if damping == 0.0
            && step.is_whole
            && stop == StopRule::Noise
            && (length < STEP_MIN || here.is_lost_in_noise(system, &step.taken))
        {
            return Some(here.finish(system, step));
        }
        if length < STEP_ZERO {
            is_converged = true;
            break;
        }
        let allowed = here.sum * (1.0 + 1e-10) + ROUNDING * force_square;
        match Iterate::at(system, step.points, rows, allowed) {
            Some(there) => {
                let gain = 1.0 - there.sum / here.sum;
                here = there;
                // A damped step may be short for being damped only.
                let is_small = matches!(stop, StopRule::Gain(least) if gain < least);
                let is_last = is_small || (stop != StopRule::Noise && length < STEP_MIN);
                if (is_last && damping < 1e-2) || here.sum == 0.0 {
                    is_converged = true;
                    break;
                }
                damping *= 0.1;
                if damping < DAMPING.1 {
                    damping = 0.0;
                }
            }
            None if damping > DAMPING_MAX => {
                is_converged = true;
                break;
            }
            None => damping = (10.0 * damping).max(DAMPING.0),
        }
    }
    let points = here.points.iter().enumerate();
    let mut change = here.change.clone();
    change.resize(system.unknowns.len(), 0.0);
    Some(RefinedFit {
        change,
        points: points
            .map(|(record, point)| ParameterPoint {
                at: system.apply_change(record, &point.at, &here.change),
                ..point.clone()
            })
            .collect(),
        sum: here.sum,
        pass: here.pass,
        is_converged: is_converged || system.unknowns.len() == system.linear,
    })
}

impl Iterate {
    /// The triangles at points whose sum of squares is at most `allowed`. A family without a kernel has its coefficients
    /// solved first, for its slopes cost several times as much as its columns.
    fn at(
        system: &System<'_>,
        mut points: Vec<ParameterPoint>,
        rows: Rows,
        allowed: f64,
    ) -> Option<Self> {
        if !system.source.is_fast() && !system.has_signal() {
            let outers: Vec<OuterPoint> = points.iter().map(|point| point.outer.clone()).collect();
            let (solved, sum) = system.solved(&outers, rows)?;
            if sum > allowed {
                return None;
            }
            points = solved;
        }
        let pass = system.pass(&points, rows)?;
        let linear = system.linear;
        let passive: Vec<usize> = match system.first_zero(&points).is_some() {
            true => system.passive(&points),
            false => (0..linear).collect(),
        };
        let (change, sum) = if passive.len() == linear {
            (pass.joint.solve(linear), pass.joint.residual_sum(linear))
        } else {
            let factor = pass.joint.select_columns(&passive);
            let mut change = vec![0.0; linear];
            for (&k, value) in passive.iter().zip(factor.solve(passive.len())) {
                change[k] = value;
            }
            (change, factor.residual_sum(passive.len()))
        };
        let is_finite = pass.joint.is_finite() && change.iter().all(|value| value.is_finite());
        (is_finite && sum <= allowed).then_some(Self { points, pass, sum, passive, change })
    }

    /// The step to the solution of the triangles, shorter the more it is damped. Parameters are held that it would push
    /// over the end of their range.
    fn step(&self, system: &System<'_>, damping: f64) -> Step {
        let (linear, all) = (system.linear, system.unknowns.len());
        let mut held = vec![false; all - linear];
        loop {
            let wanted = self.solution(linear, &held, damping);
            let over = (0..held.len()).find(|&k| {
                let unknown = system.unknowns[linear + k];
                let record = unknown.record.unwrap_or(0);
                let at = coordinate_of(system, &self.points[record], unknown.parameter);
                let (low, high) = range_of(system, record, unknown.parameter);
                let step = wanted[linear + k];
                !held[k] && ((at <= low && step < 0.0) || (at >= high && step > 0.0))
            });
            match over {
                Some(k) => held[k] = true,
                None => return self.take_step(system, &wanted),
            }
        }
    }

    /// Changes of all unknowns; none of those held or bound.
    fn solution(&self, linear: usize, held: &[bool], damping: f64) -> Vec<f64> {
        let joint = &self.pass.joint;
        let all = linear + held.len();
        let free = (0..held.len()).filter(|&k| !held[k]).map(|k| linear + k);
        let columns: Vec<usize> = self.passive.iter().copied().chain(free).collect();
        if columns.len() == all && damping == 0.0 {
            let solution = joint.solve(all);
            if solution.iter().all(|value| value.is_finite()) {
                return solution;
            }
        }
        let factor = joint.select_columns(&columns);
        let linear = self.passive.len();
        let mut found = factor.solve(columns.len());
        if damping > 0.0 || found.iter().any(|value| !value.is_finite()) {
            found = add_damping(&factor, linear, damping.max(DAMPING.0)).solve(columns.len());
        }
        let mut solution = vec![0.0; all];
        if found.iter().all(|value| value.is_finite()) {
            for (&k, value) in columns.iter().zip(found) {
                solution[k] = value;
            }
        }
        solution
    }

    /// The points after a step, which is no longer than allowed and ends within the ranges.
    fn take_step(&self, system: &System<'_>, wanted: &[f64]) -> Step {
        let layout = system.layout();
        let linear = system.linear;
        let mut taken: Vec<f64> = wanted[linear..].to_vec();
        let mut points = self.points.clone();
        for (k, unknown) in system.unknowns[linear..].iter().enumerate() {
            let is_contact = unknown.parameter == layout.contact();
            let longest = STEP_MAX[usize::from(is_contact)];
            taken[k] = taken[k].clamp(-longest, longest);
            // A fixed value may lie outside the searched range, and one that does not move stays.
            if taken[k] == 0.0 {
                continue;
            }
            let is_of = |record: &usize| unknown.is_of(*record);
            for record in (0..points.len()).filter(is_of) {
                let at = coordinate_of(system, &points[record], unknown.parameter);
                let (low, high) = range_of(system, record, unknown.parameter);
                let end = (at + taken[k]).clamp(low, high);
                if end != at + taken[k] {
                    taken[k] = end - at;
                }
                let outer = &mut points[record].outer;
                if is_contact {
                    outer.contact = end;
                } else {
                    let value = &mut outer.values[unknown.parameter];
                    *value =
                        step_value(system.source.range_kind(unknown.parameter), *value, taken[k]);
                }
            }
        }
        let is_whole = taken == wanted[linear..];
        let change = if is_whole {
            wanted[..linear].to_vec()
        } else if self.passive.len() == linear {
            self.pass.joint.solve_given(linear, &taken)
        } else {
            self.change.clone()
        };
        for (record, point) in points.iter_mut().enumerate() {
            point.at = system.apply_change(record, &point.at, &change);
        }
        Step { points, change, taken, is_whole }
    }

    /// Whether a step is a small share of the standard error of each parameter, judged by what it leaves: without noise
    /// that is rounding, and the iteration goes on.
    fn is_lost_in_noise(&self, system: &System<'_>, step: &[f64]) -> bool {
        let (joint, all) = (&self.pass.joint, system.unknowns.len());
        let spare = (system.measured() - all).max(1);
        let scatter = (joint.residual_sum(all) / spare as f64).sqrt();
        let contact = system.layout().contact();
        let has_contact = system.unknowns.iter().any(|one| one.parameter == contact);
        let share = match has_contact {
            _ if system.errors.count > 0 => STEP_SHARE_ERRORS,
            true => STEP_SHARE_CONTACT,
            false => STEP_SHARE,
        };
        step.iter().enumerate().all(|(k, step)| {
            let mut outer = vec![0.0; all];
            outer[system.linear + k] = 1.0;
            let error = joint.deviation(&outer) * scatter;
            // A step of nothing is of a parameter held at the end of its range.
            *step == 0.0 || step.abs() < (share * error).min(STEP_LONG)
        })
    }

    /// The end, where a step that is the last has been taken whole.
    fn finish(self, system: &System<'_>, step: Step) -> RefinedFit {
        let is_held = step.taken.contains(&0.0);
        let is_all = !is_held && self.passive.len() == system.linear;
        RefinedFit {
            points: step.points,
            change: step.change.into_iter().chain(step.taken).collect(),
            sum: if is_all {
                self.pass.joint.residual_sum(system.unknowns.len())
            } else {
                self.sum
            },
            pass: self.pass,
            is_converged: true,
        }
    }
}

/// The triangle with the squared steps of the outer unknowns, behind the first `linear` columns, added to the sum. Along a
/// direction that the linear unknowns make up for nothing is left; the largest of the others still bounds the step.
fn add_damping(factor: &Factor, linear: usize, damping: f64) -> Factor {
    let last = factor.width() - 1;
    let size = |k: usize| -> f64 { (linear..=last).map(|i| factor.row(i)[k].powi(2)).sum() };
    let sizes: Vec<f64> = (linear..last).map(size).collect();
    let largest = sizes.iter().fold(0.0f64, |all, size| all.max(*size));
    let mut triangle = Triangle::new(last + 1);
    for i in 0..=last {
        triangle.push(factor.row(i), 1.0);
    }
    for (k, size) in (linear..last).zip(sizes) {
        let mut row = vec![0.0; last + 1];
        row[k] = (damping * size.max(1e-12 * largest)).sqrt();
        triangle.push(&row, 1.0);
    }
    triangle.finish()
}

fn largest_component(step: &[f64]) -> f64 {
    step.iter().fold(0.0, |longest, step| longest.max(step.abs()))
}

/// Search coordinate of an outer parameter or the scaled contact.
fn coordinate_of(system: &System<'_>, point: &ParameterPoint, parameter: usize) -> f64 {
    match point.outer.values.get(parameter) {
        Some(value) => coordinate(system.source.range_kind(parameter), *value),
        None => point.outer.contact,
    }
}

fn range_of(system: &System<'_>, record: usize, parameter: usize) -> (f64, f64) {
    let ranges = &system.ranges[record];
    ranges.outers.get(parameter).copied().unwrap_or(ranges.contact)
}
