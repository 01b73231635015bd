//! Where to start: the sum of squares as a function of the relaxation time, searched whole.
//!
//! Nobody is asked for a starting guess. Given tau the problem is linear, so the search is
//! one-dimensional: 48 values evenly spaced in log tau over every time the record can show, then
//! Brent's minimiser inside each of the deepest brackets.

use super::problem::{Outer, Problem, Scaled};
use super::sample::FitSample;
use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::brent::BrentOpt;

/// Relaxation times tried.
const NODES: usize = 48;
/// Means of samples the search works on, about.
const SCAN_ROWS: usize = 2000;
/// Brackets refined when the sum of squares has several valleys.
const VALLEYS: usize = 3;
/// Longest relaxation time searched, in lengths of the record.
const LENGTHS: f64 = 10.0;
/// The grid for an unknown contact: relaxation times, contact positions, samples.
const CONTACT_GRID: (usize, usize, usize) = (20, 28, 700);
/// Deepest contact position tried, as a share of the travel.
const CONTACT_SHARE_MAX: f64 = 0.85;

/// A place to start from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub outer: Outer,
    pub scaled: Scaled,
    pub sum: f64,
}

/// The searched range of `ln tau`: one sample interval to ten lengths of the record.
pub(super) fn log_tau_range(samples: &[FitSample]) -> (f64, f64) {
    let length = samples[samples.len() - 1].t.0 - samples[0].t.0;
    let interval = length / (samples.len() - 1) as f64;
    (interval.ln(), (LENGTHS * length).ln())
}

/// The best start, the contact being known.
pub(super) fn best_start(problem: &Problem<'_>, contact: f64) -> Start {
    let block = problem.samples.len().div_ceil(SCAN_ROWS);
    let at = |log_tau: f64| Outer { log_tau, contact };
    if let Some(tau) = problem.fixed_tau {
        return start(problem, at(tau.ln()), block);
    }
    let nodes = nodes(log_tau_range(problem.samples), NODES);
    let sums: Vec<f64> = nodes
        .iter()
        .map(|&log_tau| sum(problem, at(log_tau), block))
        .collect();
    let mut valleys = valleys(NODES, |i| sums[i]);
    valleys.sort_by(|&a, &b| sums[a].total_cmp(&sums[b]));
    valleys.truncate(VALLEYS);
    let refined = valleys.into_iter().map(|i| {
        let bracket = (nodes[i.saturating_sub(1)], nodes[(i + 1).min(NODES - 1)]);
        let log_tau = minimum(bracket, |log_tau| sum(problem, at(log_tau), block));
        start(problem, at(log_tau.unwrap_or(nodes[i])), block)
    });
    lowest(refined).unwrap_or_else(|| start(problem, at(nodes[NODES / 2]), block))
}

/// Starts worth following when the contact is not known, best first: the best relaxation time at
/// each contact position of a grid, on a thinned record.
pub(super) fn contact_starts(problem: &Problem<'_>) -> Vec<Start> {
    let (taus, contacts, samples) = CONTACT_GRID;
    let step = problem.samples.len().div_ceil(samples);
    let thin: Vec<FitSample> = problem.samples.iter().copied().step_by(step).collect();
    let coarse = problem.on(&thin);
    let log_taus = match problem.fixed_tau {
        Some(tau) => vec![tau.ln()],
        None => nodes(log_tau_range(problem.samples), taus),
    };
    let (low, high) = contact_range(problem);
    let profile: Vec<Start> = (0..contacts)
        .filter_map(|i| {
            // Denser near the shallow end, where contacts are.
            let share = (i as f64 / (contacts - 1) as f64).powi(2);
            let contact = low + (high - low) * share;
            lowest(
                log_taus
                    .iter()
                    .map(|&log_tau| start(&coarse, Outer { log_tau, contact }, 1)),
            )
        })
        .collect();
    let mut starts: Vec<Start> = valleys(profile.len(), |i| profile[i].sum)
        .into_iter()
        .map(|i| profile[i])
        .collect();
    starts.sort_by(|a, b| a.sum.total_cmp(&b.sum));
    starts
}

/// Scaled contact positions searched: within the record. Before its first depth a contact cannot be
/// told from other elastic coefficients and an offset, since a shifted cubic is a cubic.
pub(super) fn contact_range(problem: &Problem<'_>) -> (f64, f64) {
    let shallowest = problem
        .samples
        .iter()
        .map(|sample| sample.depth.0 / problem.depth_scale)
        .fold(f64::INFINITY, f64::min);
    (shallowest, shallowest + CONTACT_SHARE_MAX)
}

/// Indices that are not above their neighbours.
fn valleys(count: usize, value: impl Fn(usize) -> f64) -> Vec<usize> {
    (0..count)
        .filter(|&i| {
            (i == 0 || value(i) <= value(i - 1)) && (i + 1 == count || value(i) <= value(i + 1))
        })
        .collect()
}

fn lowest(starts: impl Iterator<Item = Start>) -> Option<Start> {
    starts
        .filter(|start| start.sum.is_finite())
        .min_by(|a, b| a.sum.total_cmp(&b.sum))
}

fn nodes((low, high): (f64, f64), count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| low + (high - low) * i as f64 / (count - 1) as f64)
        .collect()
}

fn sum(problem: &Problem<'_>, outer: Outer, block: usize) -> f64 {
    problem
        .scan_factor(outer, block)
        .residual_sum(problem.basis.len())
}

fn start(problem: &Problem<'_>, outer: Outer, block: usize) -> Start {
    let factor = problem.scan_factor(outer, block);
    let free = problem.basis.len();
    Start {
        outer,
        scaled: problem.scaled(&factor.solve(free)),
        sum: factor.residual_sum(free),
    }
}

struct Cost<F>(F);

impl<F: Fn(f64) -> f64> CostFunction for Cost<F> {
    type Param = f64;
    type Output = f64;
    fn cost(&self, at: &f64) -> Result<f64, Error> {
        Ok((self.0)(*at))
    }
}

/// Brent's minimum inside a bracket, to a thousandth: Gauss-Newton does the rest.
fn minimum((low, high): (f64, f64), cost: impl Fn(f64) -> f64) -> Option<f64> {
    let solver = BrentOpt::new(low, high).set_tolerance(1e-8, 1e-3);
    let result = Executor::new(Cost(cost), solver)
        .configure(|state| state.max_iters(30))
        .run()
        .ok()?;
    result.state().get_best_param().copied()
}
