//! What a session holds for the engine: its configuration and every input with its time.

use super::ReplayError;
use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_model::rig::{AxisStatus, Reading};
use palpate_model::units::Volts;
use palpate_protocols::engine::{EngineConfig, EngineInput};
use palpate_protocols::plans::Plan;
use palpate_sessions::log::Session;
use palpate_sessions::record::{EntryKind, SampleRow};
use std::collections::VecDeque;

/// The engine's configuration at the start of the session.
pub(super) fn read_config(session: &Session) -> Result<EngineConfig, ReplayError> {
    let manifest = &session.manifest;
    let bad = |what, detail: String| ReplayError::Manifest { what, detail };
    if let Some(imported) = &manifest.imported {
        let file = imported.file.clone();
        return Err(ReplayError::Imported { file });
    }
    let nothing = |what| bad(what, "it is missing".into());
    let rig = manifest.rig.clone().ok_or_else(|| nothing("rig"))?;
    let limits = manifest.limits.ok_or_else(|| nothing("limits"))?;
    let plan: Plan = serde_json::from_value(manifest.plan.clone())
        .map_err(|err| bad("plan", err.to_string()))?;
    let calibration: Calibration = serde_json::from_value(manifest.calibration.clone())
        .map_err(|err| bad("calibration", err.to_string()))?;
    let is_homed = manifest.settings["is_homed_at_start"].as_bool();
    let is_homed =
        is_homed.ok_or_else(|| bad("settings", "is_homed_at_start is missing".into()))?;
    Ok(EngineConfig {
        rig,
        limits: plan.limits.tighten(limits),
        curve: calibration.curve().map_err(|err| bad("calibration", err.to_string()))?,
        plan,
        is_homed,
    })
}

#[derive(Clone, Debug)]
pub(super) struct RecordedInput {
    /// Samples before it.
    pub after_sample: u64,
    pub now: Nanos,
    pub input: EngineInput,
}

/// Every input that is no sample, in order.
pub(super) fn read_inputs(session: &Session) -> Result<VecDeque<RecordedInput>, ReplayError> {
    session
        .entries
        .iter()
        .filter(|entry| entry.kind != EntryKind::Decision)
        .map(|entry| {
            let input = serde_json::from_value(entry.body.clone()).map_err(|err| {
                ReplayError::Input { order: entry.order, detail: err.to_string() }
            })?;
            Ok(RecordedInput { after_sample: entry.after_sample, now: entry.now, input })
        })
        .collect()
}

/// The sample as the rig sent it. Every row of a session with a rig has all of it.
pub(super) fn read_sample(row: &SampleRow) -> Option<Reading> {
    Some(Reading {
        tick: row.tick,
        counts: row.counts,
        volts: Volts(row.volts?),
        pulses: row.pulses?,
        status: AxisStatus(row.status),
        age: row.age,
    })
}
