//! Whether the records can tell the parameters apart at all.
//!
//! Judged on the path behind the measured depth, not on the measured depth: one ramp at constant
//! speed cannot separate `mu1` from `tau_sig` (the filtered drive is exactly speed times the
//! filtered depth), but read in 15-micrometre stairs its design looks healthy and the fit is wrong
//! by forty of its own standard deviations. So the depth is first redrawn with as few straight
//! pieces as stay within a tolerance (`thin::redraw`), which removes stairs and noise and keeps
//! ramps and holds.

use super::design::Columns;
use super::options::{CONTACT, LINEAR, LINEAR_COUNT, PARAMETER_NAMES, TAU};
use super::sample::FitError;
use super::system::{Point, System, Unknown};
use super::triangle::Triangle;

/// A scaled design worse than this does not separate its parameters. Real protocols lie between
/// 20 and 1e4, a single ramp redrawn as one straight piece above 1e10.
const CONDITION_MAX: f64 = 1e6;
/// Parameters with at least this share of the largest entry belong to the blind combination.
const NAMED_SHARE: f64 = 0.2;

/// Whether the derivative by the relaxation time belongs to the design that is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judged {
    /// Only the parameters in which the model is linear: no coefficients are known yet.
    Linear,
    /// These and `tau_eps`.
    WithTau,
}

/// Refuses if the parameters cannot be told apart on the redrawn path.
pub(super) fn check(system: &System<'_>, points: &[Point], judged: Judged) -> Result<(), FitError> {
    let unknowns: Vec<Unknown> = system
        .unknowns
        .iter()
        .copied()
        .filter(|unknown| match unknown.parameter {
            CONTACT => false,
            TAU => judged == Judged::WithTau,
            _ => true,
        })
        .collect();
    let width = unknowns.len();
    let mut triangle = Triangle::new(width + 1);
    for (record, point) in points.iter().enumerate() {
        push_rows(system, record, point, &unknowns, &mut triangle);
    }
    let (condition, blind) = triangle.finish().condition(width);
    if condition < CONDITION_MAX {
        return Ok(());
    }
    let largest = blind
        .iter()
        .fold(0.0, |max: f64, value| max.max(value.abs()));
    let names: Vec<String> = unknowns
        .iter()
        .zip(&blind)
        .filter(|(_, value)| value.abs() >= NAMED_SHARE * largest)
        .map(|(unknown, _)| name(system, unknown))
        .collect();
    if names.is_empty() {
        return Err(FitError::Overflow);
    }
    let begins = |start: &str| names.iter().any(|name| name.starts_with(start));
    let is_speed = begins("mu1")
        && begins("tau_sig")
        && names
            .iter()
            .all(|name| name.starts_with("mu1") || name.starts_with("tau_sig"));
    let advice = if is_speed {
        "the depth moves at one speed only; add a hold of about 5 tau or a second speed"
    } else {
        "along this path they change the force in the same way; add a hold of about 5 tau or a \
         second speed, or fix one of them"
    };
    Err(FitError::Inseparable {
        names,
        advice: advice.to_owned(),
    })
}

fn name(system: &System<'_>, unknown: &Unknown) -> String {
    let name = PARAMETER_NAMES[unknown.parameter];
    match unknown.record {
        Some(record) => format!("{name} of {}", system.records[record].name),
        None => name.to_owned(),
    }
}

/// Bare powers of scaled depth, so that every column is one parameter.
fn push_rows(
    system: &System<'_>,
    record: usize,
    point: &Point,
    unknowns: &[Unknown],
    triangle: &mut Triangle,
) {
    let blocks = &system.records[record].thin.blocks;
    let Some(first) = blocks.first() else { return };
    let scaled = |depth: f64| depth / system.depth_mm - point.outer.contact;
    let mut columns = Columns::<true>::new(point.outer.tau, scaled(first.redrawn));
    let mut row = vec![0.0; unknowns.len() + 1];
    for block in blocks {
        if block.dt > 0.0 {
            columns.advance(scaled(block.redrawn), block.dt);
        }
        let values = columns.row();
        for (slot, unknown) in row.iter_mut().zip(unknowns) {
            *slot = match unknown.parameter {
                _ if unknown.record.is_some_and(|own| own != record) => 0.0,
                TAU => columns.tau_slope(&point.at),
                parameter => {
                    debug_assert!((LINEAR..LINEAR + LINEAR_COUNT).contains(&parameter));
                    values[parameter - LINEAR]
                }
            };
        }
        triangle.push(&row, block.weight);
    }
}
