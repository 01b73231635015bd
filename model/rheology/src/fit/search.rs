//! Where to start: the sum of squares over the outer parameters, searched whole on thinned records.
//!
//! No starting guess is needed. Given the outer parameters the problem is linear. One relaxation time is
//! scanned: 48 values evenly spaced in log tau over every time the record can show, then Brent's minimiser inside each
//! of the deepest brackets. Several outer parameters have a grid, with a coarse member of the family where it has one,
//! and Gauss-Newton steps from its deepest cells; several relaxation times grow from one dense series.

use super::columns::{OuterPoint, ParameterPoint};
use super::nonnegative::non_negative;
use super::options::FitOptions;
use super::refine::{GAIN_VALLEY, RefinedFit, StopRule, refine};
use super::system::{Rows, System};
use crate::families::{OuterRange, Prony};
use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::brent::BrentOpt;
use std::sync::Arc;

/// Relaxation times tried where there is one.
const NODES: usize = 48;
/// Brackets refined when the sum of squares has several valleys.
const VALLEYS: usize = 3;
/// Grid values of a relaxation time beside other outer parameters: one in a factor of ten over a long record.
const TIMES: usize = 14;
/// Grid values of a curvature, of a ratio and of a share.
const OTHERS: [usize; 3] = [7, 4, 6];
/// Cells of a grid followed.
const CELLS: usize = 4;
/// The grid for an unknown contact: relaxation times, contact positions.
const CONTACT_GRID: (usize, usize) = (20, 28);
/// Relaxation times of the grid from which a Prony series is grown: at least so many, and so many for
/// each factor of ten, since non-negative sums of neighbours closer than that are not separable.
const GROWN: (usize, f64) = (40, 6.0);

/// The best outer parameters of every record on the thinned records; what all records have in common is searched for all
/// records together. `None` where the family has no finite force at all.
pub(super) fn best_outers(system: &System<'_>) -> Option<Vec<OuterPoint>> {
    let count = system.records.len();
    let is_common = |k: usize| system.shared[k] || system.fixed(0, k).is_some();
    if count > 1 && (0..system.layout().outers).all(is_common) {
        let contacts = (0..count).map(|record| search_contact(&system.single_record(record)));
        return search_outers(&system.for_search(), &contacts.collect::<Option<Vec<f64>>>()?);
    }
    let each = (0..count).map(|record| {
        let alone = system.single_record(record);
        let contact = search_contact(&alone)?;
        search_outers(&alone.for_search(), &[contact])?.pop()
    });
    let mut each: Vec<OuterPoint> = each.collect::<Option<_>>()?;
    // A parameter that only some of them share starts where the first record has it.
    let first = each[0].values.clone();
    for one in &mut each {
        let shared = one.values.iter_mut().zip(&first).enumerate();
        shared
            .filter(|(k, _)| count > 1 && system.shared[*k])
            .for_each(|(_, (value, first))| *value = *first);
    }
    Some(each)
}

/// The best outer parameters, the same in all records, at given contact positions.
fn search_outers(system: &System<'_>, contacts: &[f64]) -> Option<Vec<OuterPoint>> {
    let free: Vec<usize> =
        (0..system.layout().outers).filter(|&k| system.fixed(0, k).is_none()).collect();
    let is_time = |k: &&usize| system.source.range_kind(**k) == OuterRange::Time;
    let times = free.iter().filter(is_time).count();
    let at = |z: &[f64]| outers_at(system, contacts, &free, z);
    match (free.as_slice(), times) {
        ([], _) => Some(at(&[])),
        (&[time], 1) => {
            let range = system.ranges[0].outers[time];
            let log_tau = best_log_tau(system, range, |log_tau| at(&[log_tau]))?;
            Some(at(&[log_tau]))
        }
        _ => {
            let found = match system.source.family.coarse() {
                Some(coarse) => search_valley(&system.with_member(coarse), contacts, &free, times)?,
                None => search_valley(system, contacts, &free, times)?,
            };
            Some(found.points.into_iter().map(|point| point.outer).collect())
        }
    }
}

/// The outer parameters of every record with the free ones at these search coordinates.
fn outers_at(system: &System<'_>, contacts: &[f64], free: &[usize], z: &[f64]) -> Vec<OuterPoint> {
    let value = |k: usize| match free.iter().position(|&one| one == k) {
        Some(place) => system.outer_value(k, z[place]),
        None => system.fixed(0, k).unwrap_or(f64::NAN),
    };
    let values: Vec<f64> = (0..system.layout().outers).map(value).collect();
    let each = contacts.iter().map(|&contact| OuterPoint { values: values.clone(), contact });
    each.collect()
}

/// The relaxation time with the smallest sum of squares on the thinned records.
fn best_log_tau(
    system: &System<'_>,
    range: (f64, f64),
    at: impl Fn(f64) -> Vec<OuterPoint>,
) -> Option<f64> {
    let sum = |log_tau: f64| system.sum(&at(log_tau), Rows::Thin);
    let nodes = even_nodes(range, NODES);
    let sums: Vec<f64> = nodes.iter().map(|&log_tau| sum(log_tau)).collect();
    let mut valleys = find_valleys(NODES, |i| sums[i]);
    valleys.sort_by(|&a, &b| sums[a].total_cmp(&sums[b]));
    valleys.truncate(VALLEYS);
    let refined = valleys.into_iter().map(|i| {
        let bracket = (nodes[i.saturating_sub(1)], nodes[(i + 1).min(NODES - 1)]);
        let log_tau = minimise(bracket, sum).unwrap_or(nodes[i]);
        (log_tau, sum(log_tau))
    });
    refined
        .filter(|(_, sum)| sum.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(log_tau, _)| log_tau)
}

/// The deepest valley over several outer parameters, not followed to its very floor.
fn search_valley(
    system: &System<'_>,
    contacts: &[f64],
    free: &[usize],
    times: usize,
) -> Option<RefinedFit> {
    let place = |z: &[f64]| system.solved(&outers_at(system, contacts, free, z), Rows::Thin);
    // Several relaxation times would need a grid of their own each; they start from one dense series,
    // and evenly spread.
    if times > 1 && times == free.len() {
        let (low, high) = system.ranges[0].outers[free[0]];
        let share = |i: usize| (i as f64 + 0.5) / times as f64;
        let even = (0..times).map(|i| low + (high - low) * share(i)).collect();
        let starts = grow_series(system, contacts, (low, high), times).into_iter().chain([even]);
        let starts: Vec<Vec<f64>> = starts.collect();
        return refine_deepest(system, starts.iter().filter_map(|z| Some(place(z)?.0)));
    }
    let axes: Vec<Vec<f64>> = free
        .iter()
        .map(|&k| {
            let count = match system.source.range_kind(k) {
                OuterRange::Time => TIMES,
                OuterRange::PerDepth(..) => OTHERS[0],
                OuterRange::Ratio(..) => OTHERS[1],
                OuterRange::Share(..) => OTHERS[2],
            };
            even_nodes(system.ranges[0].outers[k], count)
        })
        .collect();
    let cells: usize = axes.iter().map(Vec::len).product();
    let at = |cell: usize| -> Vec<usize> {
        let mut rest = cell;
        axes.iter()
            .map(|axis| {
                let index = rest % axis.len();
                rest /= axis.len();
                index
            })
            .collect()
    };
    let places: Vec<Option<(Vec<ParameterPoint>, f64)>> = (0..cells)
        .map(|cell| {
            let z = at(cell).into_iter().zip(&axes);
            place(&z.map(|(index, axis)| axis[index]).collect::<Vec<_>>())
        })
        .collect();
    let sum = |cell: usize| places[cell].as_ref().map_or(f64::INFINITY, |one| one.1);
    // Cells that no neighbour along any axis undercuts.
    let mut valleys: Vec<usize> = (0..cells)
        .filter(|&cell| {
            let mut stride = 1;
            let index = at(cell);
            sum(cell).is_finite()
                && axes.iter().zip(index).all(|(axis, index)| {
                    let below = index == 0 || sum(cell) <= sum(cell - stride);
                    let above = index + 1 == axis.len() || sum(cell) <= sum(cell + stride);
                    stride *= axis.len();
                    below && above
                })
        })
        .collect();
    valleys.sort_by(|&a, &b| sum(a).total_cmp(&sum(b)));
    let starts = valleys.into_iter().take(CELLS);
    refine_deepest(system, starts.filter_map(|cell| Some(places[cell].as_ref()?.0.clone())))
}

/// The deepest floor below these starts; one whose coefficients the family allows, if there is any.
fn refine_deepest(
    system: &System<'_>,
    starts: impl Iterator<Item = Vec<ParameterPoint>>,
) -> Option<RefinedFit> {
    let is_refused = |end: &RefinedFit| system.first_zero(&end.points).is_some();
    starts
        .filter_map(|start| refine(system, &start, Rows::Thin, StopRule::Gain(GAIN_VALLEY)))
        .min_by(|a, b| {
            let refused = is_refused(a).cmp(&is_refused(b));
            refused.then(a.sum.total_cmp(&b.sum))
        })
}

/// Where a series of `terms` relaxation times may start, in search coordinates: a non-negative fit over a
/// dense grid of times, neighbours merged until so many are left.
fn grow_series(
    system: &System<'_>,
    contacts: &[f64],
    (low, high): (f64, f64),
    terms: usize,
) -> Option<Vec<f64>> {
    let decades = (high - low) / std::f64::consts::LN_10;
    let grid = GROWN.0.max((GROWN.1 * decades).ceil() as usize);
    let log_taus = even_nodes((low, high), grid);
    let dense = system.with_family(&FitOptions::of(Arc::new(Prony::dense(grid))).at_rest());
    let taus: Vec<f64> = log_taus.iter().map(|log_tau| log_tau.exp()).collect();
    let outers = contacts.iter().map(|&contact| OuterPoint { values: taus.clone(), contact });
    let factor = dense.values_pass(&outers.collect::<Vec<_>>(), Rows::Thin)?;
    // Neither spring nor weight may be negative, whatever the family says.
    let bounds: Vec<bool> = (0..dense.linear).map(|k| k <= grid).collect();
    let solution = non_negative(&factor, &bounds);
    // Weight and centre of each run of neighbours.
    let mut groups: Vec<(f64, f64)> = Vec::new();
    let mut is_running = false;
    for (log_tau, &weight) in log_taus.iter().zip(&solution[1..=grid]) {
        match groups.last_mut().filter(|_| is_running && weight > 0.0) {
            Some(group) => *group = merge_groups(*group, (weight, *log_tau)),
            None if weight > 0.0 => groups.push((weight, *log_tau)),
            None => {}
        }
        is_running = weight > 0.0;
    }
    while groups.len() > terms {
        let cost = |i: usize| {
            let ((a, x), (b, y)) = (groups[i], groups[i + 1]);
            a * b / (a + b) * (y - x).powi(2)
        };
        let cheapest = (0..groups.len() - 1).min_by(|&i, &j| cost(i).total_cmp(&cost(j)))?;
        groups[cheapest] = merge_groups(groups[cheapest], groups[cheapest + 1]);
        groups.remove(cheapest + 1);
    }
    let mut log_taus: Vec<f64> = groups.iter().map(|group| group.1).collect();
    if log_taus.is_empty() {
        log_taus.push(0.5 * (low + high));
    }
    // Too few: new ones go into the widest gaps between those found, where something relaxes; the ends of
    // the range count only beside a single one.
    while log_taus.len() < terms {
        let mut ends = log_taus.clone();
        if ends.len() == 1 {
            ends.insert(0, low);
            ends.push(high);
        }
        let widest = (0..ends.len() - 1)
            .max_by(|&i, &j| (ends[i + 1] - ends[i]).total_cmp(&(ends[j + 1] - ends[j])))?;
        log_taus.push(0.5 * (ends[widest] + ends[widest + 1]));
        log_taus.sort_by(f64::total_cmp);
    }
    Some(log_taus)
}

fn merge_groups((a, x): (f64, f64), (b, y): (f64, f64)) -> (f64, f64) {
    (a + b, (a * x + b * y) / (a + b))
}

/// The contact position of a single record: fixed, or the best of a grid, refined between its neighbours. One relaxation
/// time is searched at each position; several outer parameters are those of the shallowest.
fn search_contact(system: &System<'_>) -> Option<f64> {
    if let Some(contact) = system.fixed_contact(0) {
        return Some(contact);
    }
    let searched = system.for_search();
    let (low, high) = system.ranges[0].contact;
    let free: Vec<usize> =
        (0..system.layout().outers).filter(|&k| system.fixed(0, k).is_none()).collect();
    let (taus, contacts) = CONTACT_GRID;
    let starts: Vec<Vec<f64>> = match free.as_slice() {
        [] => vec![Vec::new()],
        &[time] if system.source.has_one_time() => {
            let log_taus = even_nodes(system.ranges[0].outers[time], taus);
            log_taus.into_iter().map(|log_tau| vec![log_tau]).collect()
        }
        _ => {
            let outer = search_outers(&searched, &[low])?.pop()?;
            let z = free.iter().map(|&k| system.coordinate(k, outer.values[k]));
            vec![z.collect()]
        }
    };
    // Denser near the shallow end, where contacts are.
    let place = |i: usize| low + (high - low) * (i as f64 / (contacts - 1) as f64).powi(2);
    let sum = |z: &[f64], contact: f64| {
        searched.sum(&outers_at(&searched, &[contact], &free, z), Rows::Thin)
    };
    let profile: Vec<(f64, &Vec<f64>)> = (0..contacts)
        .map(|i| {
            let sums = starts.iter().map(|z| (sum(z, place(i)), z));
            sums.filter(|(sum, _)| sum.is_finite())
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((f64::INFINITY, &starts[0]))
        })
        .collect();
    let around = |i: usize| {
        let mut z = profile[i].1.clone();
        let bracket = (place(i.saturating_sub(1)), place((i + 1).min(contacts - 1)));
        let mut contact = place(i);
        // In turn: each search is one-dimensional, and Gauss-Newton does the rest.
        for _ in 0..3 {
            if let [first, second, ..] = starts.as_slice() {
                let spacing = second[0] - first[0];
                let near = (z[0] - spacing, z[0] + spacing);
                z[0] = minimise(near, |log_tau| sum(&[log_tau], contact)).unwrap_or(z[0]);
            }
            contact = minimise(bracket, |contact| sum(&z, contact)).unwrap_or(contact);
        }
        (sum(&z, contact), contact)
    };
    let mut valleys = find_valleys(contacts, |i| profile[i].0);
    valleys.sort_by(|&a, &b| profile[a].0.total_cmp(&profile[b].0));
    let found = valleys.into_iter().take(VALLEYS).map(around);
    found.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, contact)| contact)
}

/// Indices that are not above their neighbours.
fn find_valleys(count: usize, value: impl Fn(usize) -> f64) -> Vec<usize> {
    (0..count)
        .filter(|&i| {
            (i == 0 || value(i) <= value(i - 1)) && (i + 1 == count || value(i) <= value(i + 1))
        })
        .collect()
}

fn even_nodes((low, high): (f64, f64), count: usize) -> Vec<f64> {
    (0..count).map(|i| low + (high - low) * i as f64 / (count - 1) as f64).collect()
}

struct SearchCost<F>(F);

impl<F: Fn(f64) -> f64> CostFunction for SearchCost<F> {
    type Param = f64;
    type Output = f64;
    fn cost(&self, at: &f64) -> Result<f64, Error> {
        Ok((self.0)(*at))
    }
}

/// Brent's minimum inside a bracket, as close as comparing values allows.
fn minimise((low, high): (f64, f64), cost: impl Fn(f64) -> f64) -> Option<f64> {
    let solver = BrentOpt::new(low, high).set_tolerance(1e-8, 1e-6);
    let result = Executor::new(SearchCost(cost), solver)
        .configure(|state| state.max_iters(40))
        .run()
        .ok()?;
    result.state().get_best_param().copied()
}
