//! Comparison of a board's settings with the rig file.

use super::console::GrblConsole;
use super::error::GrblOpenError;
use super::protocol::GrblLine;
use super::settings::{GrblSettings, HomeSwitch};
use std::collections::BTreeMap;

/// Status reports have three decimals of a mm (report.c): shorter steps cannot be distinguished.
pub const MM_PER_STEP_MIN: f64 = 1e-3;

pub(super) fn read_settings(
    console: &mut GrblConsole<'_>,
) -> Result<BTreeMap<u16, f64>, GrblOpenError> {
    let listing = console.ask("$$")?;
    Ok(listing
        .into_iter()
        .filter_map(|incoming| match incoming {
            GrblLine::Setting(number, value) => Some((number, value)),
            _ => None,
        })
        .collect())
}

/// A setting; what a board does not have is NaN, which no check lets pass.
pub(super) fn setting(values: &BTreeMap<u16, f64>, number: u16) -> f64 {
    values.get(&number).copied().unwrap_or(f64::NAN)
}

/// Compares with the rig file. Returns the steps per mm.
pub(super) fn check_settings(
    settings: &GrblSettings,
    values: &BTreeMap<u16, f64>,
) -> Result<f64, GrblOpenError> {
    let axis = settings.index() as u16;
    // Three decimals are stored and shown; 2e-4 of the way is far below what any other part of a rig is known to.
    let steps_per_mm = setting(values, 100 + axis);
    if steps_per_mm > 1.0 / MM_PER_STEP_MIN {
        return Err(GrblOpenError::TooFine { number: 100 + axis, found: steps_per_mm });
    }
    let scale = 1.0 / settings.mm_per_pulse;
    let fastest = settings.speed_max.0 * 60.0;
    let acceleration = settings.acceleration.0;
    let has_limits = settings.home == HomeSwitch::Probe;
    let hard_limits = f64::from(u8::from(has_limits));
    let travel = settings.travel.0;
    // The travel matters to Grbl's own limits alone.
    let has_soft_limits = setting(values, 20) != 0.0;
    let is_near = |found: f64, wanted: f64, share: f64| (found - wanted).abs() <= share * wanted;
    let has = |number: u16| setting(values, number);
    let checks = [
        (
            100 + axis,
            "steps per mm, which is 1 / mm_per_pulse",
            format!("{scale:.3}"),
            is_near(steps_per_mm, scale, 2e-4),
        ),
        (
            110 + axis,
            "fastest rate in mm/min, at least 60 times speed_max_mm_s",
            format!("{fastest:.3}"),
            has(110 + axis) >= fastest * (1.0 - 1e-4),
        ),
        (
            120 + axis,
            "acceleration in mm/s2",
            format!("{acceleration:.3}"),
            is_near(has(120 + axis), acceleration, 1e-4),
        ),
        (
            1,
            "time in ms until a motor at rest is switched off; 255 keeps the motor on",
            "255".into(),
            has(1) == 255.0,
        ),
        (13, "reports in inches", "0".into(), has(13) == 0.0),
        (
            21,
            "hard limits; on for a home switch on the probe pin, off for a home switch on the limit pin",
            hard_limits.to_string(),
            has(21) == hard_limits,
        ),
        // Bit 0 of `$10`: machine position rather than work position.
        (
            10,
            "content of the status reports: they must contain the machine position",
            "1".into(),
            has(10) as i64 & 1 == 1,
        ),
        (
            130 + axis,
            "travel in mm, at least travel_mm",
            format!("{travel:.3}"),
            !has_soft_limits || has(130 + axis) >= travel,
        ),
    ];
    match checks.into_iter().find(|(_, _, _, is_right)| !is_right) {
        None => Ok(steps_per_mm),
        Some((number, meaning, wanted, _)) => {
            Err(GrblOpenError::SetOtherwise { number, meaning, found: has(number), wanted })
        }
    }
}
