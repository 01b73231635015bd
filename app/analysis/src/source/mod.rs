//! Reads sessions and foreign tables for a fit.

mod error;
mod signal;
mod touches;

pub use error::SourceError;
pub(crate) use signal::unloaded_off_surface;
pub use touches::TouchPoint;

use palpate_model::calibration::{Calibration, CalibrationCurve};
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons, Seconds, Volts};
use palpate_rheology::fit::{FitSample, Signal};
use palpate_sessions::{EntryKind, LogEntry, SampleRow, Session};
use palpate_tables::import::{ColumnNames, MeasurementTable, read_table};
use std::path::Path;

use crate::analysed_session::{self, AnalysedSession};
use crate::compliance::RawDepths;
use crate::recordings::is_session;
use palpate_protocols::engine::{Effect, Record};

/// Samples for a fit, with remarks on them.
#[derive(Clone, Debug, Default)]
pub struct FitSource {
    /// Time from the first sample, depth, force and its own uncertainty.
    pub samples: Vec<FitSample>,
    /// Session time of the first sample; 0 for a table, whose times are kept as they are.
    pub start: Seconds,
    /// Time from the first sample of the session to that one, by the controller's clock; 0 for a table.
    pub offset: Seconds,
    /// Remarks, such as an interrupted recording.
    pub notes: Vec<String>,
    /// The specimen pressed, where the source says so.
    pub specimen: Option<String>,
    /// Name of the rig it was recorded on; `None` for a table.
    pub rig: Option<String>,
    /// The calibration its forces were read with; `None` for a table.
    pub calibration: Option<Calibration>,
    /// What the load cell reported; `None` where it was not recorded or the zero was not seen.
    pub signal: Option<Signal>,
    /// Depths before they were corrected for machine compliance; `None` where they were not.
    pub raw: Option<RawDepths>,
    /// The touches that found the contact position; empty where they are not known.
    pub touches: Vec<TouchPoint>,
    /// Thickness of the specimen in mm, where the session found its base, with its standard error.
    pub thickness_mm: Option<[f64; 2]>,
}

impl FitSource {
    /// Root mean square in N of the standard deviations of these forces, which grow with the force; `None` of a table, whose
    /// noise is not known.
    #[must_use]
    pub(crate) fn noise_of<'s>(
        &self,
        samples: impl IntoIterator<Item = &'s FitSample>,
    ) -> Option<f64> {
        let known = samples.into_iter().filter(|one| one.is_measured());
        let (squares, count) = known.fold((0.0, 0usize), |(squares, count), one| {
            (squares + one.sigma.0 * one.sigma.0, count + 1)
        });
        self.signal.as_ref().map(|_| (squares / count.max(1) as f64).sqrt())
    }
}

/// Part of an indentation that is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RecordStretch {
    /// Ramp and hold: what the fit of the modified Kelvin body takes, which knows no unloading.
    #[default]
    RampHold,
    /// Unloading as well, where it was recorded.
    WithUnload,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceSelection {
    pub stretch: RecordStretch,
    pub is_rejected_included: bool,
}

impl RecordStretch {
    #[must_use]
    pub fn with_unload(is_wanted: bool) -> Self {
        if is_wanted { Self::WithUnload } else { Self::RampHold }
    }
}

impl From<RecordStretch> for SourceSelection {
    fn from(stretch: RecordStretch) -> Self {
        Self { stretch, is_rejected_included: false }
    }
}

/// The probe has left the tissue once forces on the way back are below so many standard deviations: from
/// there on the cell feels nothing, however the tissue goes on recovering.
const LIFT_OFF: f64 = 3.0;
/// So many of them in a row: about a force twice as large as that, one sample in 700 is that low by its
/// noise alone, and ten in a row never are.
const LIFT_OFF_RUN: usize = 10;

/// The first sample, if any, at which the probe has left the tissue on the way back.
fn lift_off(phases: &[Phase], samples: &[FitSample]) -> Option<usize> {
    let mut lows = 0;
    let last = phases.iter().zip(samples).position(|(phase, one)| {
        let is_low = one.is_measured() && one.force.0 < LIFT_OFF * one.sigma.0;
        lows = if is_low && *phase == Phase::Unload { lows + 1 } else { 0 };
        lows == LIFT_OFF_RUN
    })?;
    Some(last + 1 - LIFT_OFF_RUN)
}

/// A slave that follows is on its way back once it is so much nearer to the surface than it has been: ten pulses of the
/// source's slider, more than a hand trembles by after its slave.
const TURN_MM: f64 = 0.15;

/// The first sample, if any, at which a slave that follows is on its way back: the body that is fitted knows none.
fn turn(phases: &[Phase], samples: &[FitSample]) -> Option<usize> {
    let mut deepest = f64::NEG_INFINITY;
    phases.iter().zip(samples).position(|(phase, one)| {
        deepest = deepest.max(one.depth.0);
        *phase == Phase::Follow && one.depth.0 < deepest - TURN_MM
    })
}

/// Ramp and hold of a session folder, a session file or a table.
pub fn read(path: &Path) -> Result<FitSource, SourceError> {
    read_stretch(path, None, RecordStretch::RampHold)
}

/// The chosen part of a session or a table; `columns` names the columns of a table that has no header. A table without
/// phases is taken whole. The edits of a session are applied, and a rejected one is refused.
pub fn read_stretch(
    path: &Path,
    columns: Option<&ColumnNames>,
    wanted: impl Into<SourceSelection>,
) -> Result<FitSource, SourceError> {
    read_analysed(path, columns, wanted, None)
}

/// As [`read_stretch`], a session as one of its analyses reads it. A table has none.
pub fn read_analysed(
    path: &Path,
    columns: Option<&ColumnNames>,
    wanted: impl Into<SourceSelection>,
    analysis: Option<&str>,
) -> Result<FitSource, SourceError> {
    let SourceSelection { stretch, is_rejected_included } = wanted.into();
    if !is_session(path) {
        if let Some(name) = analysis {
            return Err(SourceError::TableAnalysis { name: name.to_owned() });
        }
        let table = read_table(path, columns)?;
        let samples = samples_of_table(&table, stretch);
        return Ok(FitSource { samples, notes: table.notes, ..FitSource::default() });
    }
    let AnalysedSession { edited, left_out_s, .. } = analysed_session::open(path, analysis)?;
    if let (Some(reason), false) = (edited.rejection(), is_rejected_included) {
        return Err(SourceError::Rejected { reason: reason.to_owned() });
    }
    of_session(edited.session, stretch, &left_out_s)
}

/// Samples of an open session for a fit, without the forces in these intervals, in s since the
/// first sample.
pub fn of_session(
    session: Session,
    stretch: RecordStretch,
    left_out_s: &[[f64; 2]],
) -> Result<FitSource, SourceError> {
    let specimen = session.manifest.specimen.trim();
    let specimen = (!specimen.is_empty()).then(|| specimen.to_owned());
    if session.manifest.imported.is_some() {
        // As of a table, because the noise of its forces is unknown.
        let mut samples = samples_of_table(&table_of_imported(&session), stretch);
        leave_out(left_out_s, Seconds(0.0), &mut samples);
        return Ok(FitSource { samples, specimen, notes: session.notes, ..FitSource::default() });
    }
    let (rows, mut samples) = fitted_rows(&session, stretch)?;
    let (signal, touches) = signal::of_session(&session, &rows, left_out_s)?.unzip();
    let offset = since_first(&session, stretch);
    leave_out(left_out_s, offset, &mut samples);
    let start = start_of(&session);
    let thickness_mm = thickness_of(&session)?;
    let calibration = Some(calibration_of(&session)?);
    let mut notes = session.notes;
    let censored = samples.iter().filter(|one| !one.is_measured()).count();
    if censored > 0 {
        notes.push(format!(
            "the fit uses the depth but not the force of {censored} samples, because the converter was saturated, an interlock had tripped, the probe had left the tissue, or a mask excludes them"
        ));
    }
    let rig = session.manifest.rig.map(|rig| rig.name);
    Ok(FitSource {
        samples,
        start,
        offset,
        notes,
        specimen,
        rig,
        calibration,
        signal,
        raw: None,
        touches: touches.unwrap_or_default(),
        thickness_mm,
    })
}

/// What was found last.
fn thickness_of(session: &Session) -> Result<Option<[f64; 2]>, SourceError> {
    let decisions = decisions(session)?;
    Ok(records(&decisions).rev().find_map(|(_, record)| match record {
        Record::BaseFound { thickness_mm, thickness_std_error_mm, .. } => {
            Some([(*thickness_mm)?, (*thickness_std_error_mm)?])
        }
        _ => None,
    }))
}

/// The samples of an imported session, its time from the first one.
pub(super) fn table_of_imported(session: &Session) -> MeasurementTable {
    let mut table = MeasurementTable::default();
    for row in &session.rows {
        let is_taken =
            matches!(row.phase, Phase::Imported | Phase::Ramp | Phase::Hold | Phase::Unload);
        let (Some(force), Some(depth), true) = (row.force, row.depth, is_taken) else { continue };
        table.t.push(session.manifest.time_of(row.tick as i64).0);
        table.depth.push(depth);
        table.force.push(force);
        table.is_unload.push(row.phase == Phase::Unload);
    }
    table
}

/// The calibration in a session's manifest.
pub fn calibration_of(session: &Session) -> Result<Calibration, SourceError> {
    serde_json::from_value(session.manifest.calibration.clone())
        .map_err(|err| SourceError::Calibration { detail: err.to_string() })
}

/// The curve of that calibration.
pub(super) fn curve_of(session: &Session) -> Result<CalibrationCurve, SourceError> {
    let curve = calibration_of(session)?.curve();
    curve.map_err(|err| SourceError::Calibration { detail: err.to_string() })
}

/// Samples of a session for a fit, each force weighted by what the signal's noise and the
/// calibration curve's sensitivity make of it. A force that is not known has infinite uncertainty:
/// one at an end of the converter's range, every one after an interlock, and every one after the probe
/// has left the tissue on the way back.
pub fn fit_samples(
    session: &Session,
    stretch: RecordStretch,
) -> Result<Vec<FitSample>, SourceError> {
    fitted_rows(session, stretch).map(|(_, samples)| samples)
}

/// These samples, and the numbers of the rows that they were made of.
fn fitted_rows(
    session: &Session,
    stretch: RecordStretch,
) -> Result<(Vec<usize>, Vec<FitSample>), SourceError> {
    let curve = curve_of(session)?;
    let decisions = decisions(session)?;
    let noise = noise_of(&decisions).ok_or(SourceError::Empty)?;
    let tick_secs = session.manifest.tick().0;
    let trusted = trusted_samples(&decisions);
    let rows = session.rows.iter().enumerate();
    let (mut first_tick, mut phases, mut taken) = (None, Vec::new(), Vec::new());
    let mut samples: Vec<FitSample> = rows
        .filter(|(_, row)| is_fitted(row, stretch))
        .filter_map(|(index, row)| {
            let (force, depth) = (Newtons(row.force?), Depth(row.depth?));
            let first_tick = *first_tick.get_or_insert(row.tick);
            phases.push(row.phase);
            taken.push(index);
            let is_known = index < trusted && !is_saturated(session, row);
            let unknown = Newtons(f64::INFINITY);
            let sigma = if is_known { curve.force_sigma(force, noise) } else { unknown };
            let t = Seconds((row.tick - first_tick) as f64 * tick_secs);
            Some(FitSample { t, depth, force, sigma })
        })
        .collect();
    if let Some(from) = lift_off(&phases, &samples).or_else(|| turn(&phases, &samples)) {
        for sample in &mut samples[from..] {
            sample.sigma = Newtons(f64::INFINITY);
        }
    }
    if samples.is_empty() { Err(SourceError::Empty) } else { Ok((taken, samples)) }
}

fn is_fitted(row: &SampleRow, stretch: RecordStretch) -> bool {
    let is_wanted = matches!(row.phase, Phase::Ramp | Phase::Hold | Phase::Follow)
        || row.phase == Phase::Unload && stretch == RecordStretch::WithUnload;
    is_wanted && row.force.is_some() && row.depth.is_some()
}

/// At the end of its range a converter says no more than that the signal is there or beyond.
pub(super) fn is_saturated(session: &Session, row: &SampleRow) -> bool {
    let ends = session.manifest.rig.as_ref().and_then(|rig| rig.adc);
    let ends = ends.map(|adc| [adc.counts_min, adc.counts_max]);
    matches!((ends, row.counts), (Some(ends), Some(counts)) if ends.contains(&counts))
}

/// Number of samples before an interlock tripped; all if none did.
pub(super) fn trusted_samples(decisions: &[(u64, Effect)]) -> usize {
    let is_trip = |record: &Record| matches!(record, Record::InterlockTripped { .. });
    let tripped = records(decisions).find(|(_, record)| is_trip(record));
    tripped.map_or(usize::MAX, |(after_sample, _)| after_sample as usize)
}

/// Decisions of the engine, each with the number of samples before it.
pub(super) fn decisions(session: &Session) -> Result<Vec<(u64, Effect)>, SourceError> {
    decisions_among(&session.entries)
}

/// The decisions among a session's entries, each after so many samples.
pub(super) fn decisions_among(entries: &[LogEntry]) -> Result<Vec<(u64, Effect)>, SourceError> {
    entries
        .iter()
        .filter(|entry| entry.kind == EntryKind::Decision)
        .map(|entry| match serde_json::from_value(entry.body.clone()) {
            Ok(effect) => Ok((entry.after_sample, effect)),
            // It might say that forces are not to be trusted.
            Err(err) => Err(SourceError::Decision { detail: err.to_string() }),
        })
        .collect()
}

/// Records among decisions, each with the number of samples before it.
pub(super) fn records(
    decisions: &[(u64, Effect)],
) -> impl DoubleEndedIterator<Item = (u64, &Record)> {
    decisions.iter().filter_map(|(after, effect)| match effect {
        Effect::Record(record) => Some((*after, record)),
        _ => None,
    })
}

/// Forces in stretches of time, in s since the session's first sample, count no more. `offset` is the time
/// from there to the first of `samples`.
fn leave_out(left_out_s: &[[f64; 2]], offset: Seconds, samples: &mut [FitSample]) {
    for sample in samples {
        let at = offset.0 + sample.t.0;
        if left_out_s.iter().any(|[from, to]| (*from..=*to).contains(&at)) {
            sample.sigma = Newtons(f64::INFINITY);
        }
    }
}

/// Time from the session's first sample to the first one that a fit takes.
fn since_first(session: &Session, stretch: RecordStretch) -> Seconds {
    let first = session.rows.iter().find(|row| is_fitted(row, stretch));
    match (session.rows.first(), first) {
        (Some(origin), Some(first)) => {
            analysed_session::time_between(&session.manifest, origin, first)
        }
        _ => Seconds(0.0),
    }
}

/// Session time of the first sample that a fit takes.
fn start_of(session: &Session) -> Seconds {
    let first = session.rows.iter().find(|row| is_fitted(row, RecordStretch::RampHold));
    first.map_or(Seconds(0.0), |row| row.host.seconds())
}

/// The signal's noise as the tare found it.
pub(super) fn noise_of(decisions: &[(u64, Effect)]) -> Option<Volts> {
    records(decisions).find_map(|(_, record)| match record {
        Record::Tared { noise, .. } => Some(*noise),
        _ => None,
    })
}

/// The noise of a table is unknown, so every sample has the same weight.
fn samples_of_table(table: &MeasurementTable, stretch: RecordStretch) -> Vec<FitSample> {
    (0..table.t.len())
        .filter(|&i| stretch == RecordStretch::WithUnload || !table.is_unload[i])
        .map(|i| FitSample {
            t: Seconds(table.t[i]),
            depth: Depth(table.depth[i]),
            force: Newtons(table.force[i]),
            sigma: Newtons(1.0),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_rheology::fit::{FitOptions, fit};

    fn recorded(name: &str) -> Session {
        let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
        Session::open(&sessions.join(name)).unwrap()
    }

    #[test]
    fn a_saturated_converter_does_not_bend_the_fit() {
        let mut session = recorded("ramp-hold-lab");
        let options = FitOptions::default();
        let whole =
            fit(&fit_samples(&session, RecordStretch::RampHold).unwrap(), &options).unwrap();
        assert_eq!(whole.censored, 0);
        let adc = session.manifest.rig.as_ref().unwrap().adc.unwrap();
        let hold = session.rows.iter_mut().filter(|row| row.phase == Phase::Hold);
        let mut expected = 0;
        for (i, row) in hold.enumerate().filter(|(i, _)| i % 10 == 3) {
            // Both ends of the range, each with the force that its count would be.
            let is_low = i % 20 == 3;
            row.counts = Some(if is_low { adc.counts_min } else { adc.counts_max });
            row.force = Some(if is_low { -9.0 } else { 90.0 });
            expected += 1;
        }
        let samples = fit_samples(&session, RecordStretch::RampHold).unwrap();
        let report = fit(&samples, &options).unwrap();
        assert!(expected > 0 && report.censored == expected);
        for (one, other) in whole.parameters.iter().zip(&report.parameters) {
            let error = one.std_error.unwrap_or(0.0);
            // A tenth of the hold is lost: the values move by a part of their errors.
            let moved = (one.value - other.value).abs();
            assert!(moved <= error, "{}: {moved} of {error}", one.name);
        }
    }

    #[test]
    fn one_low_force_is_no_lift_off_and_ten_in_a_row_are() {
        let samples = |forces: &[f64]| -> Vec<FitSample> {
            let sample = |&force: &f64| FitSample {
                t: Seconds(0.0),
                depth: Depth(1.0),
                force: Newtons(force),
                sigma: Newtons(0.01),
            };
            forces.iter().map(sample).collect()
        };
        // Nine low ones in a row again and again, then ten.
        let mut forces: Vec<f64> =
            (0..100).map(|i| if i % 10 == 0 { 0.08 } else { 0.02 }).collect();
        let found = |forces: &[f64], phase| lift_off(&vec![phase; forces.len()], &samples(forces));
        assert_eq!(found(&forces, Phase::Unload), None);
        forces.push(0.01);
        assert_eq!(found(&forces, Phase::Unload), Some(91));
        // On the way in they come before contact.
        assert_eq!(found(&forces, Phase::Ramp), None);
    }

    #[test]
    fn forces_after_an_interlock_do_not_count() {
        let mut session = recorded("ramp-hold-lab");
        let samples = fit_samples(&session, RecordStretch::RampHold).unwrap();
        let first =
            session.rows.iter().position(|row| is_fitted(row, RecordStretch::RampHold)).unwrap();
        let tripped = Effect::Record(Record::InterlockTripped {
            interlock: palpate_protocols::engine::Interlock::Signal,
            reason: "on purpose".into(),
        });
        session.entries.push(LogEntry {
            kind: EntryKind::Decision,
            order: u64::MAX,
            after_sample: (first + 100) as u64,
            now: palpate_model::Nanos::ZERO,
            body: serde_json::to_value(&tripped).unwrap(),
        });
        let censored = fit_samples(&session, RecordStretch::RampHold).unwrap();
        assert_eq!(censored.len(), samples.len());
        let measured = censored.iter().take_while(|one| one.is_measured()).count();
        assert_eq!(measured, 100);
        assert!(censored[100..].iter().all(|one| !one.is_measured()));
    }
}
