//! Reads sessions and foreign tables for a cycle analysis.

use crate::edited_session;
use crate::recordings::is_session;
use crate::source::{
    SourceError, calibration_of, decisions, is_saturated, records, table_of_imported,
    trusted_samples,
};
use palpate_model::calibration::Calibration;
use palpate_model::rig::{AxisStatus, Oscillation, Phase, RigCommand};
use palpate_model::units::{Depth, Newtons, Position, Seconds};
use palpate_protocols::engine::{Effect, Record};
use palpate_rheology::cycles::{CycleSample, split_by_depth};
use palpate_sessions::{SampleRow, Session};
use palpate_tables::import::{ColumnNames, MeasurementTable, read_table};
use serde_json::Value;
use std::path::Path;

/// Samples of a record in cycles, with remarks on them.
#[derive(Clone, Debug, Default)]
pub struct CycleSource {
    /// Every sample with known force and depth, in order of time. Depths count from the first contact found.
    pub samples: Vec<CycleSample>,
    /// For each sample, the distance of its cycle's contact point from the first one; empty for a table.
    pub contact_offsets: Vec<Depth>,
    /// The least step of the depth; `None` where the source does not name it.
    pub pulse: Option<Depth>,
    /// The sines that were run: frequency in Hz, and which of the samples.
    pub sines: Vec<(f64, std::ops::Range<usize>)>,
    /// Remarks, such as an interrupted recording.
    pub notes: Vec<String>,
    /// The calibration its forces were read with; `None` for a table.
    pub calibration: Option<Calibration>,
    /// Of the specimen, in degrees Celsius; `None` where it was not stated.
    pub temperature_c: Option<f64>,
}

impl CycleSource {
    /// The depth of a sample from the contact its own cycle began from.
    pub fn own_depth(&self, index: usize) -> Depth {
        let offset = self.contact_offsets.get(index);
        self.samples[index].depth - offset.copied().unwrap_or_default()
    }
}

/// Reads a session folder, a session file or a table; `columns` names the columns of a table without a header.
pub fn read(path: &Path, columns: Option<&ColumnNames>) -> Result<CycleSource, SourceError> {
    if is_session(path) {
        return of_session(&edited_session::open(path)?.session);
    }
    let mut table = read_table(path, columns)?;
    let notes = std::mem::take(&mut table.notes);
    Ok(of_table(&table, notes))
}

fn of_table(table: &MeasurementTable, mut notes: Vec<String>) -> CycleSource {
    notes.push(
        "the source is a table, so its cycles, holds and unloading are found from the depth".into(),
    );
    CycleSource {
        samples: split_by_depth(&table.t, &table.depth, &table.force),
        notes,
        ..CycleSource::default()
    }
}

/// Samples of a session for a cycle analysis. Forces at an end of the converter's range, and all after an interlock, are left out.
pub fn of_session(session: &Session) -> Result<CycleSource, SourceError> {
    if session.manifest.imported.is_some() {
        let table = table_of_imported(session);
        return Ok(of_table(&table, session.notes.clone()));
    }
    let decisions = decisions(session)?;
    let trusted = trusted_samples(&decisions);
    let contacts = contacts(&decisions);
    let steps = steps(&decisions);
    let tick_secs = session.manifest.tick().0;
    let first_tick = session.rows.first().map_or(0, |row| row.tick);
    let mut source = CycleSource {
        notes: session.notes.clone(),
        pulse: session.manifest.rig.as_ref().map(|rig| Depth(rig.mm_per_pulse)),
        calibration: calibration_of(session).ok(),
        temperature_c: session.manifest.about.get("specimen.temperature_c").and_then(Value::as_f64),
        ..CycleSource::default()
    };
    let mut left_out = 0usize;
    // The sample index of each row, to find the rows of a sine.
    let mut places = Vec::with_capacity(session.rows.len());
    for (index, row) in session.rows.iter().enumerate() {
        places.push(source.samples.len());
        let (Some(force), Some(depth)) = (row.force, row.depth) else { continue };
        if index >= trusted || is_saturated(session, row) {
            left_out += 1;
            continue;
        }
        let offset = offset_at(&contacts, index);
        source.contact_offsets.push(offset);
        source.samples.push(CycleSample {
            t: Seconds(row.tick.wrapping_sub(first_tick) as i64 as f64 * tick_secs),
            depth: Depth(depth) + offset,
            force: Newtons(force),
            phase: row.phase,
            cycle: row.cycle,
            step: step_at(&steps, index),
        });
    }
    source.sines = oscillations(&decisions)
        .filter_map(|(after, command)| {
            let rows = motion_after(&session.rows, after)?;
            let frequency = 1.0 / (f64::from(command.period_ticks) * tick_secs);
            Some((frequency, places[rows.start]..places[rows.end - 1] + 1))
        })
        .filter(|(_, range)| range.end <= source.samples.len())
        .collect();
    if left_out > 0 {
        source.notes.push(format!(
            "{left_out} samples are excluded, because the converter was saturated or an interlock had tripped"
        ));
    }
    if contacts.len() > 1 {
        source.notes.push(format!(
            "the session has {} contact points; depths are measured from the first",
            contacts.len()
        ));
    }
    if source.samples.iter().any(|one| one.phase == Phase::Ramp) || !source.sines.is_empty() {
        Ok(source)
    } else {
        Err(SourceError::NoCycles)
    }
}

/// Contacts found, each after so many samples.
fn contacts(decisions: &[(u64, Effect)]) -> Vec<(u64, Position)> {
    let found = records(decisions).filter_map(|(after, record)| match record {
        Record::ContactFound { position, .. } => Some((after, *position)),
        _ => None,
    });
    found.collect()
}

/// Distance of the contact point in force at a sample from the first one.
fn offset_at(contacts: &[(u64, Position)], index: usize) -> Depth {
    let before = contacts.partition_point(|(after, _)| *after <= index as u64);
    match (contacts.first(), before.checked_sub(1)) {
        (Some((_, first)), Some(latest)) => contacts[latest].1.depth_from(*first),
        _ => Depth(0.0),
    }
}

/// Steps of the plan, each from the sample that it began with: the one that led to it.
fn steps(decisions: &[(u64, Effect)]) -> Vec<(u64, u32)> {
    let begun = records(decisions).filter_map(|(after, record)| match record {
        Record::PhaseStarted { step_index, .. } => {
            Some((after.saturating_sub(1), u32::try_from(*step_index).ok()?))
        }
        _ => None,
    });
    begun.collect()
}

/// Step of a sample; the first one before any step began.
fn step_at(steps: &[(u64, u32)], index: usize) -> u32 {
    let begun = steps.partition_point(|(from, _)| *from <= index as u64);
    begun.checked_sub(1).map_or(0, |latest| steps[latest].1)
}

fn oscillations(decisions: &[(u64, Effect)]) -> impl Iterator<Item = (usize, Oscillation)> {
    decisions.iter().filter_map(|(after, effect)| match effect {
        Effect::Command(RigCommand::Oscillate(command)) => Some((*after as usize, *command)),
        _ => None,
    })
}

/// Rows of the first motion after so many samples; `None` if there is none.
fn motion_after(rows: &[SampleRow], after: usize) -> Option<std::ops::Range<usize>> {
    let is_moving = |row: &SampleRow| AxisStatus(row.status).has(AxisStatus::MOVING);
    let later = rows.get(after..)?;
    let start = after + later.iter().position(is_moving)?;
    let count = rows[start..].iter().take_while(|row| is_moving(row)).count();
    Some(start..start + count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::Nanos;
    use palpate_sessions::record::{EntryKind, LogEntry};

    fn recorded() -> Session {
        let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
        Session::open(&sessions.join("ramp-hold-lab")).unwrap()
    }

    fn decided(effect: &Effect, after_sample: usize) -> LogEntry {
        LogEntry {
            kind: EntryKind::Decision,
            order: u64::MAX,
            after_sample: after_sample as u64,
            now: Nanos::ZERO,
            body: serde_json::to_value(effect).unwrap(),
        }
    }

    #[test]
    fn a_session_is_read_with_its_phases() {
        let session = recorded();
        let source = of_session(&session).unwrap();
        let known = |phase: Phase| {
            let rows = session.rows.iter().filter(|row| row.phase == phase);
            rows.filter(|row| row.depth.is_some() && row.force.is_some()).count()
        };
        let read = |phase: Phase| source.samples.iter().filter(|one| one.phase == phase).count();
        for phase in [Phase::Ramp, Phase::Hold] {
            assert!(read(phase) > 1000 && read(phase) == known(phase), "{phase}");
        }
        assert!(source.sines.is_empty() && source.contact_offsets.iter().all(|one| one.0 == 0.0));
        assert!(source.samples.windows(2).all(|pair| pair[0].t < pair[1].t));
    }

    #[test]
    fn samples_know_their_step_and_the_pulse() {
        let session = recorded();
        let source = of_session(&session).unwrap();
        let rig = session.manifest.rig.as_ref().unwrap();
        assert_eq!(source.pulse, Some(Depth(rig.mm_per_pulse)));
        let plan: palpate_protocols::plans::Plan =
            serde_json::from_value(session.manifest.plan.clone()).unwrap();
        // The sample that led to a step is the first of it.
        assert!(source.samples.len() > 10_000);
        for (index, one) in source.samples.iter().enumerate() {
            let planned = plan.steps[one.step as usize].step.phase();
            // Contact finding ends with a rest.
            let is_contact = planned == Phase::Contact && one.phase == Phase::Rest;
            let is_so = planned == one.phase || is_contact || one.phase == Phase::Ended;
            assert!(is_so, "{index}: {one:?}, {planned}");
        }
    }

    #[test]
    fn a_second_contact_keeps_depths_comparable() {
        let mut session = recorded();
        let first = contacts(&decisions(&session).unwrap())[0].1;
        let hold = session.rows.iter().position(|row| row.phase == Phase::Hold).unwrap();
        let again = Effect::Record(Record::ContactFound {
            position: first.moved_by(0.25),
            std_error_mm: 0.01,
        });
        session.entries.push(decided(&again, hold));
        let source = of_session(&session).unwrap();
        let held = source.samples.iter().position(|one| one.phase == Phase::Hold).unwrap();
        let depth = session.rows[hold].depth.unwrap();
        assert!((source.samples[held].depth.0 - depth - 0.25).abs() < 1e-12);
        assert!((source.own_depth(held).0 - depth).abs() < 1e-12);
        assert!(source.contact_offsets[held - 1].0 == 0.0);
        assert!(source.notes.iter().any(|note| note.contains("2 contact points")));
    }

    #[test]
    fn a_sine_is_the_motion_after_its_command() {
        let mut session = recorded();
        // The ramp stands for a sine: it is the motion that begins after the hold of the step before.
        let ramp = session.rows.iter().position(|row| row.phase == Phase::Ramp).unwrap();
        let command = Effect::Command(RigCommand::Oscillate(Oscillation {
            amplitude_pulses: 10,
            period_ticks: 500,
            cycles: 3,
            acceleration: palpate_model::MmPerS2(61.44),
        }));
        session.entries.push(decided(&command, ramp));
        let source = of_session(&session).unwrap();
        let [(frequency, range)] = &source.sines[..] else {
            panic!("{:?}", source.sines);
        };
        let tick = session.manifest.tick().0;
        assert!((frequency * 500.0 * tick - 1.0).abs() < 1e-12);
        let moving = session.rows[ramp..]
            .iter()
            .skip_while(|row| row.status & 1 == 0)
            .take_while(|row| row.status & 1 == 1)
            .count();
        assert!(moving > 1000 && range.len() == moving);
        let last = &source.samples[range.end - 1];
        assert!(last.phase == Phase::Ramp && source.samples[range.end + 1].phase == Phase::Hold);
    }
}
