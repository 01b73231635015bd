//! Where to start: the sum of squares as a function of the relaxation time, searched whole.
//!
//! Nobody is asked for a starting guess. Given tau the problem is linear, so the search is
//! one-dimensional: 48 values evenly spaced in log tau over every time the record can show, then
//! Brent's minimiser inside each of the deepest brackets, on the thinned record.

use super::options::TAU;
use super::record::Record;
use super::sample::FitSample;
use super::system::{Outer, Point, System};
use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::brent::BrentOpt;

/// Relaxation times tried.
const NODES: usize = 48;
/// Brackets refined when the sum of squares has several valleys.
const VALLEYS: usize = 3;
/// Longest relaxation time searched, in lengths of the record.
const LENGTHS: f64 = 10.0;
/// The grid for an unknown contact: relaxation times, contact positions.
const CONTACT_GRID: (usize, usize) = (20, 28);
/// Deepest contact position tried, as a share of the travel.
const CONTACT_SHARE_MAX: f64 = 0.85;

/// Shortest relaxation time searched, as a share of the shortest sample interval: what relaxes within
/// an interval still shows in the samples after a corner.
const INTERVALS: f64 = 0.125;

/// The searched range of `ln tau`: a share of a sample interval to ten lengths of the record.
pub(super) fn log_tau_range(samples: &[FitSample]) -> (f64, f64) {
    let length = samples[samples.len() - 1].t.0 - samples[0].t.0;
    let interval = length / (samples.len() - 1) as f64;
    let shortest = samples
        .windows(2)
        .map(|pair| pair[1].t.0 - pair[0].t.0)
        .fold(interval, f64::min);
    ((INTERVALS * shortest).ln(), (LENGTHS * length).ln())
}

/// The range that holds all of them.
pub(super) fn union(ranges: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    ranges
        .reduce(|all, one| (all.0.min(one.0), all.1.max(one.1)))
        .unwrap_or_default()
}

/// Scaled contact positions searched: within the record. Before its first depth a contact cannot be
/// told from other elastic coefficients and an offset, since a shifted cubic is a cubic.
pub(super) fn contact_range(record: &Record<'_>, depth_mm: f64) -> (f64, f64) {
    let shallowest = record.depths.0 / depth_mm;
    (shallowest, shallowest + CONTACT_SHARE_MAX)
}

/// The best start of every record; a shared relaxation time is searched for all records together.
pub(super) fn best_start(system: &System<'_>) -> Vec<Point> {
    let count = system.records.len();
    let outers: Vec<Outer> = if count > 1 && (system.is_shared(TAU) || system.fixed(TAU).is_some())
    {
        let contacts: Vec<f64> = (0..count)
            .map(|record| contact(&system.alone(record)))
            .collect();
        let range = union(
            system
                .records
                .iter()
                .map(|record| log_tau_range(record.samples)),
        );
        let at = |tau: f64| outers(&contacts, tau);
        at(best_tau(system, range, at))
    } else {
        (0..count)
            .map(|record| {
                let alone = system.alone(record);
                let contact = contact(&alone);
                let range = log_tau_range(alone.records[0].samples);
                let at = |tau: f64| vec![Outer { tau, contact }];
                at(best_tau(&alone, range, at))[0]
            })
            .collect()
    };
    points(system, &outers)
}

/// The linear solution on the thinned records.
pub(super) fn points(system: &System<'_>, outers: &[Outer]) -> Vec<Point> {
    let solution = system.thin_pass(outers).solve(system.linear);
    outers
        .iter()
        .enumerate()
        .map(|(record, &outer)| Point {
            outer,
            at: system.coefficients(record, &solution),
        })
        .collect()
}

fn outers(contacts: &[f64], tau: f64) -> Vec<Outer> {
    contacts
        .iter()
        .map(|&contact| Outer { tau, contact })
        .collect()
}

/// The relaxation time with the smallest sum of squares on the thinned records.
fn best_tau(system: &System<'_>, range: (f64, f64), at: impl Fn(f64) -> Vec<Outer>) -> f64 {
    if let Some(tau) = system.fixed(TAU) {
        return tau;
    }
    let sum = |log_tau: f64| {
        let factor = system.thin_pass(&at(log_tau.exp()));
        factor.residual_sum(system.linear)
    };
    let nodes = nodes(range, NODES);
    let sums: Vec<f64> = nodes.iter().map(|&log_tau| sum(log_tau)).collect();
    let mut valleys = valleys(NODES, |i| sums[i]);
    valleys.sort_by(|&a, &b| sums[a].total_cmp(&sums[b]));
    valleys.truncate(VALLEYS);
    let refined = valleys.into_iter().map(|i| {
        let bracket = (nodes[i.saturating_sub(1)], nodes[(i + 1).min(NODES - 1)]);
        let log_tau = minimum(bracket, sum).unwrap_or(nodes[i]);
        (log_tau, sum(log_tau))
    });
    refined
        .filter(|(_, sum)| sum.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(nodes[NODES / 2], |(log_tau, _)| log_tau)
        .exp()
}

/// The contact position of a single record: fixed, or the best of a grid with the best relaxation
/// time at each, refined between its neighbours.
fn contact(system: &System<'_>) -> f64 {
    if let Some(contact) = system.fixed_contact() {
        return contact;
    }
    let record = &system.records[0];
    let (taus, contacts) = CONTACT_GRID;
    let log_taus = match system.fixed(TAU) {
        Some(tau) => vec![tau.ln()],
        None => nodes(log_tau_range(record.samples), taus),
    };
    let (low, high) = contact_range(record, system.depth_mm);
    // Denser near the shallow end, where contacts are.
    let place = |i: usize| low + (high - low) * (i as f64 / (contacts - 1) as f64).powi(2);
    let sum = |log_tau: f64, contact: f64| {
        let factor = system.thin_pass(&[Outer {
            tau: log_tau.exp(),
            contact,
        }]);
        factor.residual_sum(system.linear)
    };
    let profile: Vec<(f64, f64)> = (0..contacts)
        .map(|i| {
            let sums = log_taus
                .iter()
                .map(|&log_tau| (sum(log_tau, place(i)), log_tau));
            sums.filter(|(sum, _)| sum.is_finite())
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((f64::INFINITY, log_taus[0]))
        })
        .collect();
    let around = |i: usize| {
        let spacing = if log_taus.len() > 1 {
            log_taus[1] - log_taus[0]
        } else {
            0.0
        };
        let (_, mut log_tau) = profile[i];
        let bracket = (place(i.saturating_sub(1)), place((i + 1).min(contacts - 1)));
        let mut contact = place(i);
        // In turn: each search is one-dimensional, and Gauss-Newton does the rest.
        for _ in 0..3 {
            if spacing > 0.0 {
                let near = (log_tau - spacing, log_tau + spacing);
                log_tau = minimum(near, |log_tau| sum(log_tau, contact)).unwrap_or(log_tau);
            }
            contact = minimum(bracket, |contact| sum(log_tau, contact)).unwrap_or(contact);
        }
        (sum(log_tau, contact), contact)
    };
    let mut valleys = valleys(contacts, |i| profile[i].0);
    valleys.sort_by(|&a, &b| profile[a].0.total_cmp(&profile[b].0));
    valleys
        .into_iter()
        .take(VALLEYS)
        .map(around)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(low, |(_, contact)| contact)
}

/// Indices that are not above their neighbours.
fn valleys(count: usize, value: impl Fn(usize) -> f64) -> Vec<usize> {
    (0..count)
        .filter(|&i| {
            (i == 0 || value(i) <= value(i - 1)) && (i + 1 == count || value(i) <= value(i + 1))
        })
        .collect()
}

fn nodes((low, high): (f64, f64), count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| low + (high - low) * i as f64 / (count - 1) as f64)
        .collect()
}

struct Cost<F>(F);

impl<F: Fn(f64) -> f64> CostFunction for Cost<F> {
    type Param = f64;
    type Output = f64;
    fn cost(&self, at: &f64) -> Result<f64, Error> {
        Ok((self.0)(*at))
    }
}

/// Brent's minimum inside a bracket, as close as comparing values allows.
fn minimum((low, high): (f64, f64), cost: impl Fn(f64) -> f64) -> Option<f64> {
    let solver = BrentOpt::new(low, high).set_tolerance(1e-8, 1e-6);
    let result = Executor::new(Cost(cost), solver)
        .configure(|state| state.max_iters(40))
        .run()
        .ok()?;
    result.state().get_best_param().copied()
}
