//! From a session of weight steps to the calibration it measured.

use palpate_model::calibration::{
    CALIBRATION_FORMAT, Calibration, CalibrationError, CalibrationSeries,
};
use palpate_model::units::Volts;
use palpate_protocols::engine::{Effect, PLAN_COMPLETE, Record};
use palpate_protocols::weight_readings::WeightReadings;
use palpate_sessions::{EntryKind, Session};
use thiserror::Error;

/// Half-width in g within which a laboratory weight of 100 g lies if no better value is known: class M3 of
/// OIML R 111-1 allows 50 mg.
const TOLERANCE_G: f64 = 0.05;

#[derive(Debug, Error)]
pub enum CalibrationSessionError {
    #[error(
        "session {0} contains no reading of the load cell under a known mass; run the protocol load-cell-calibration"
    )]
    NoReadings(String),
    #[error(
        "session {session} ended ({ending}) before its plan was complete; run the protocol load-cell-calibration again to its end"
    )]
    Incomplete { session: String, ending: String },
    /// The readings make none.
    #[error(transparent)]
    Readings(#[from] CalibrationError),
}

/// The calibration that a session measured, with the curve that predicts left-out weights best.
pub fn calibration_from_session(
    session: &Session,
    name: &str,
) -> Result<Calibration, CalibrationSessionError> {
    let manifest = &session.manifest;
    let id = manifest.session_id.clone();
    let end = session.end.as_ref();
    let ending = end.map_or("breaking off", |end| end.outcome.as_str());
    let is_complete = end.is_some_and(|end| end.reason == PLAN_COMPLETE);
    if ending != "finish" || !is_complete {
        return Err(CalibrationSessionError::Incomplete { session: id, ending: ending.into() });
    }
    // Decisions of other kinds do not deserialise as records.
    let decisions = session.entries.iter().filter(|one| one.kind == EntryKind::Decision);
    let records: Vec<Record> = decisions
        .filter_map(|one| match serde_json::from_value(one.body.clone()) {
            Ok(Effect::Record(record)) => Some(record),
            _ => None,
        })
        .collect();
    let readings = WeightReadings::of(&records);
    let mut series: Vec<CalibrationSeries> = Vec::new();
    let mut empty: Vec<Volts> = Vec::new();
    for one in readings.all() {
        let (direction, repeat) = (one.direction, one.repeat);
        let is_same = |one: &CalibrationSeries| (one.direction, one.repeat) == (direction, repeat);
        if !series.last().is_some_and(is_same) {
            series.push(CalibrationSeries { direction, repeat, steps: Vec::new() });
        }
        if one.mass_g() == 0.0 {
            empty.push(one.volts());
        }
        if let Some(last) = series.last_mut() {
            last.steps.push(one.step.clone());
        }
    }
    if series.is_empty() {
        return Err(CalibrationSessionError::NoReadings(id));
    }
    let calibration = Calibration {
        name: name.into(),
        format: CALIBRATION_FORMAT,
        taken_at: Some(manifest.started_at_text()),
        source: format!("session {id}"),
        rig: manifest.rig.as_ref().map_or_else(String::new, |rig| rig.name.clone()),
        operator: manifest.operator.clone(),
        zero_before: empty.first().copied(),
        zero_after: empty.last().copied(),
        series,
        ..Calibration::default()
    }
    .with_stacked_weights(TOLERANCE_G)?;
    calibration.check_rise()?;
    let curve = calibration.best_curve()?;
    Ok(Calibration { curve, ..calibration })
}
