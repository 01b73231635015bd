//! Whether a board's settings are those of the rig file.

use super::console::Console;
use super::error::GrblOpenError;
use super::protocol::Incoming;
use super::settings::{GrblSettings, HomeSwitch};
use std::collections::BTreeMap;

/// Status reports have three decimals of a mm (report.c): shorter steps cannot be told apart.
pub const MM_PER_STEP_MIN: f64 = 1e-3;

pub(super) fn read_settings(
    console: &mut Console<'_>,
) -> Result<BTreeMap<u16, f64>, GrblOpenError> {
    let listing = console.ask("$$")?;
    Ok(listing
        .into_iter()
        .filter_map(|incoming| match incoming {
            Incoming::Setting(number, value) => Some((number, value)),
            _ => None,
        })
        .collect())
}

/// A setting; what a board does not have is NaN, which no check lets pass.
pub(super) fn value(values: &BTreeMap<u16, f64>, number: u16) -> f64 {
    values.get(&number).copied().unwrap_or(f64::NAN)
}

/// Compares with the rig file. Gives the steps a mm.
pub(super) fn check(
    settings: &GrblSettings,
    values: &BTreeMap<u16, f64>,
) -> Result<f64, GrblOpenError> {
    let axis = settings.index() as u16;
    // Three decimals are stored and shown; 2e-4 of the way is far below what any other part of a rig is known to.
    let steps_per_mm = value(values, 100 + axis);
    if steps_per_mm > 1.0 / MM_PER_STEP_MIN {
        return Err(GrblOpenError::TooFine { number: 100 + axis, found: steps_per_mm });
    }
    let wanted = 1.0 / settings.mm_per_pulse;
    let fastest = settings.speed_max.0 * 60.0;
    let acceleration = settings.acceleration.0;
    let has_limits = settings.home == HomeSwitch::Probe;
    let hard_limits = f64::from(u8::from(has_limits));
    let travel = settings.travel.0;
    // The travel matters to Grbl's own limits alone.
    let has_soft_limits = value(values, 20) != 0.0;
    let is_near = |found: f64, wanted: f64, share: f64| (found - wanted).abs() <= share * wanted;
    type Check<'a> = (u16, &'static str, String, Box<dyn Fn(f64) -> bool + 'a>);
    let checks: [Check<'_>; 8] = [
        (
            100 + axis,
            "steps a mm, 1 / mm_per_pulse",
            format!("{wanted:.3}"),
            Box::new(|found| is_near(found, wanted, 2e-4)),
        ),
        (
            110 + axis,
            "fastest rate in mm/min, speed_max_mm_s times 60 or more",
            format!("{fastest:.3}"),
            Box::new(|found| found >= fastest * (1.0 - 1e-4)),
        ),
        (
            120 + axis,
            "acceleration in mm/s2",
            format!("{acceleration:.3}"),
            Box::new(|found| is_near(found, acceleration, 1e-4)),
        ),
        (
            1,
            "ms until the motor is switched off at rest; 255 leaves it on",
            "255".into(),
            Box::new(|found| found == 255.0),
        ),
        (13, "reports in inches", "0".into(), Box::new(|found| found == 0.0)),
        (
            21,
            "hard limits; on with a home switch on the probe pin, off with one on the limit pin",
            format!("{hard_limits}"),
            Box::new(|found| found == hard_limits),
        ),
        // Bit 0 of `$10`: machine position rather than work position.
        (
            10,
            "status reports; the machine position must be in them",
            "1".into(),
            Box::new(|found| found as i64 & 1 == 1),
        ),
        (
            130 + axis,
            "travel in mm, travel_mm or more",
            format!("{travel:.3}"),
            Box::new(|found| !has_soft_limits || found >= travel),
        ),
    ];
    for (number, meaning, wanted, is_right) in checks {
        let found = value(values, number);
        if !is_right(found) {
            return Err(GrblOpenError::SetOtherwise { number, meaning, found, wanted });
        }
    }
    Ok(steps_per_mm)
}
