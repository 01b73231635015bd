//! Whether the records can separate the parameters at all.
//!
//! Judged on the path behind the measured depth, not on the measured depth: one ramp at constant
//! speed cannot separate `mu1` from `tau_sig` (the filtered drive is exactly speed times the
//! filtered depth), but read in 15-micrometre stairs its design looks healthy and the fit is wrong
//! by forty of its own standard deviations. So the depth is first redrawn with as few straight
//! pieces as stay within a tolerance (`thin::redraw`), which removes stairs and noise and keeps
//! ramps and holds.

use super::columns::{ParameterPoint, Slope};
use super::sample::FitError;
use super::system::{System, Unknown};
use super::triangle::Triangle;

/// Whether the derivatives by the outer parameters belong to the design that is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JudgedParameters {
    /// Only the parameters in which the model is linear: no coefficients are known yet.
    Linear,
    /// These and the outer ones.
    WithOuter,
}

/// Refuses if the parameters are not separable on the redrawn path.
pub(super) fn check(
    system: &System<'_>,
    points: &[ParameterPoint],
    judged: JudgedParameters,
) -> Result<(), FitError> {
    let layout = system.layout();
    let unknowns: Vec<Unknown> = system
        .unknowns
        .iter()
        .copied()
        .filter(|unknown| match unknown.parameter {
            k if k == layout.contact() => false,
            k => judged == JudgedParameters::WithOuter || layout.linear().contains(&k),
        })
        .collect();
    let width = unknowns.len();
    let mut triangle = Triangle::new(width + 1);
    for (record, point) in points.iter().enumerate() {
        push_rows(system, record, point, &unknowns, &mut triangle)?;
    }
    let Some(blind) = triangle.finish().inseparable_columns(width) else {
        return Ok(());
    };
    let names = blind.into_iter().map(|place| name(system, &unknowns[place]));
    let names: Vec<String> = names.collect();
    if names.is_empty() {
        return Err(FitError::Overflow);
    }
    let begins = |start: &str| names.iter().any(|name| name.starts_with(start));
    let is_speed = begins("mu1")
        && begins("tau_sig")
        && names.iter().all(|name| name.starts_with("mu1") || name.starts_with("tau_sig"));
    let advice = if is_speed {
        "the depth moves at one speed only; add a hold of about 5 tau or a second speed"
    } else {
        "along this path the parameters change the force in the same way; add a hold of about 5 tau or a \
         second speed, or fix one of the parameters"
    };
    Err(FitError::Inseparable { names, advice: advice.to_owned() })
}

fn name(system: &System<'_>, unknown: &Unknown) -> String {
    let name = &system.known()[unknown.parameter].name;
    match unknown.record {
        Some(record) => format!("{name} of {}", system.records[record].name),
        None => name.clone(),
    }
}

/// Bare columns, so that every one is one parameter.
fn push_rows(
    system: &System<'_>,
    record: usize,
    point: &ParameterPoint,
    unknowns: &[Unknown],
    triangle: &mut Triangle,
) -> Result<(), FitError> {
    let layout = system.layout();
    let is_judged = |k: &usize| unknowns.iter().any(|one| one.parameter == *k);
    let outers: Vec<usize> = (0..layout.outers).filter(is_judged).collect();
    let slopes: Vec<Slope> = outers.iter().map(|&k| Slope::Outer(k)).collect();
    // Where each unknown stands in a row.
    let places: Vec<Option<usize>> = unknowns
        .iter()
        .map(|unknown| {
            let slope = outers.iter().position(|&k| k == unknown.parameter);
            let place = match slope {
                Some(k) => layout.linear_count() + k,
                None => unknown.parameter - layout.outers,
            };
            unknown.is_of(record).then_some(place)
        })
        .collect();
    let mut row = vec![0.0; unknowns.len() + 1];
    let blocks = &system.records[record].thin.blocks;
    let scale = system.scale(&point.outer);
    let walked = system.source.visit_redrawn(blocks, scale, point, &slopes, |block, values| {
        for (slot, place) in row.iter_mut().zip(&places) {
            *slot = place.map_or(0.0, |k| values[k]);
        }
        triangle.push(&row, block.weight);
    });
    walked.ok_or(FitError::Overflow)
}
