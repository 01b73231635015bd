//! A session as one of its analyses reads it, and the record of a new one.
//!
//! A recalibration recalculates every force from the raw signal and the tares that were found; a mask names
//! stretches whose forces do not count. The log itself stays as it is.

use crate::edited_session::{self, EditedSession};
use crate::source::{SourceError, calibration_of, decisions_among, records};
use palpate_model::calibration::{Calibration, CalibrationCurve};
use palpate_model::units::{Seconds, Volts};
use palpate_protocols::engine::{ENGINE_VERSION, Record};
use palpate_runner::wall_now;
use palpate_sessions::analyses::{
    Analyses, Analysis, AnalysisContent, AnalysisError, AnalysisInput, changed_inputs,
    document_input, read_session_inputs,
};
use palpate_sessions::{LogEntry, Manifest, ReadError, SampleRow, Session, SessionOutline};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A session with its edits applied, as one of its analyses reads it.
#[derive(Clone, Debug)]
pub struct AnalysedSession {
    pub edited: EditedSession,
    pub analyses: Analyses,
    /// Stretches whose forces do not count: from and to in s since the first sample.
    pub left_out_s: Vec<[f64; 2]>,
}

/// Effect of another calibration on the forces of a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ForceChange {
    /// Samples with a force.
    pub samples: u64,
    /// Root mean square of the change in N.
    pub rms_n: f64,
    /// Largest change in N.
    pub max_n: f64,
    /// Highest force before, in N; `None` without any.
    pub peak_before_n: Option<f64>,
    /// Highest force after, in N.
    pub peak_after_n: Option<f64>,
}

/// Opens a session as an analysis of it does; without a name as its edits leave it.
pub fn open(path: &Path, name: Option<&str>) -> Result<AnalysedSession, SourceError> {
    let mut edited = edited_session::open(path)?;
    let analyses = Analyses::read(path, &edited.session.manifest.session_id)?;
    let reading = AnalysisReading::of(path, &analyses, name)?;
    let session = &mut edited.session;
    session.notes.extend(reading.notes);
    if let Some((_, calibration)) = &reading.calibration {
        recalibrate(session, calibration)?;
    }
    Ok(AnalysedSession { edited, analyses, left_out_s: reading.left_out_s })
}

/// Calibration and mask of an analysis and of the analyses it is based on.
#[derive(Default)]
struct AnalysisReading {
    notes: Vec<String>,
    /// The calibration that forces are recalculated with, as it was written and as it is.
    calibration: Option<(serde_json::Value, Calibration)>,
    /// Intervals whose forces do not count, in s since the first sample.
    left_out_s: Vec<[f64; 2]>,
}

impl AnalysisReading {
    fn of(path: &Path, analyses: &Analyses, name: Option<&str>) -> Result<Self, SourceError> {
        let mut reading = Self::default();
        // A fit reads the session as what it is based on did. Each is older than the one that names it.
        let mut next = name.map(str::to_owned);
        while let Some(name) = next.take() {
            let one = analyses.get(&name)?.clone();
            let changed = changed_inputs(&one, &read_session_inputs(path)?);
            if !changed.is_empty() {
                let changed = changed.join(", ");
                reading.notes.push(format!("{changed} changed after analysis '{name}' was made"));
            }
            match one.what {
                AnalysisContent::Fit { based_on, .. }
                | AnalysisContent::Material { based_on, .. } => next = based_on,
                AnalysisContent::Recalibration { calibration, .. } => {
                    let own: Calibration =
                        serde_json::from_value(calibration.clone()).map_err(bad_calibration)?;
                    reading.notes.push(format!(
                        "analysis '{name}' recalculates the forces from the raw signal with calibration {}",
                        own.name
                    ));
                    reading.calibration = Some((calibration, own));
                }
                AnalysisContent::Mask { left_out_s } => {
                    reading.notes.push(format!(
                        "analysis '{name}' excludes the forces of {} time interval(s)",
                        left_out_s.len()
                    ));
                    reading.left_out_s = left_out_s;
                }
                // It never counts, so it is not found.
                AnalysisContent::Withdrawal => {}
            }
        }
        Ok(reading)
    }
}

impl AnalysedSession {
    /// Takes the forces out that do not count, for tables that know no weights.
    pub fn blank(&mut self) {
        let session = &mut self.edited.session;
        let Some(first) = session.rows.first().copied() else {
            return;
        };
        for row in &mut session.rows {
            let at = time_between(&session.manifest, &first, row);
            if is_left_out(&self.left_out_s, at) {
                row.force = None;
            }
        }
    }

    /// Inputs of an analysis made now: the session's files, its calibration, and the analysis it is based on.
    pub fn inputs(
        &self,
        path: &Path,
        based_on: Option<&str>,
    ) -> Result<Vec<AnalysisInput>, AnalysisError> {
        let mut inputs = read_session_inputs(path)?;
        let calibration = &self.edited.session.manifest.calibration;
        if !calibration.is_null() {
            inputs.push(document_input("calibration", calibration));
        }
        if let Some(name) = based_on {
            let record = serde_json::to_value(self.analyses.get(name)?).unwrap_or_default();
            inputs.push(document_input(&format!("analysis {name}"), &record));
        }
        Ok(inputs)
    }
}

fn bad_calibration(err: impl std::fmt::Display) -> SourceError {
    SourceError::Calibration { detail: err.to_string() }
}

/// Controller time from one sample to a later one.
pub(super) fn time_between(manifest: &Manifest, first: &SampleRow, row: &SampleRow) -> Seconds {
    let ticks = row.tick.saturating_sub(first.tick);
    manifest.time_of(i64::try_from(ticks).unwrap_or(i64::MAX))
}

/// Whether a time since the first sample is in one of these stretches.
fn is_left_out(left_out_s: &[[f64; 2]], at: Seconds) -> bool {
    left_out_s.iter().any(|[from, to]| (*from..=*to).contains(&at.0))
}

/// Recalculates forces: a curve, and the tares, each with the number of samples before it.
#[derive(Clone, Debug)]
struct Recalibration {
    curve: CalibrationCurve,
    tares: Vec<(u64, Volts)>,
}

impl Recalibration {
    fn new(calibration: &Calibration, entries: &[LogEntry]) -> Result<Self, SourceError> {
        let curve = calibration.curve().map_err(bad_calibration)?;
        let decisions = decisions_among(entries)?;
        let tares = records(&decisions).filter_map(|(after, record)| match record {
            Record::Tared { volts, .. } => Some((after, *volts)),
            _ => None,
        });
        Ok(Self { curve, tares: tares.collect() })
    }

    /// The recalculated force of a sample in N. One whose force was not known, such as one before the tare, has none.
    fn force(&self, index: u64, row: &SampleRow) -> Option<f64> {
        row.force?;
        let found = self.tares.partition_point(|(after, _)| *after <= index);
        let tare = found.checked_sub(1).map(|latest| self.tares[latest].1);
        Some(self.curve.newtons_above_tare(Volts(row.volts?), tare).0)
    }
}

/// Recalculates every force of a session from its raw signal with a calibration, which takes the place of its
/// own. A sample whose force was not known, such as one before the tare, stays so.
pub fn recalibrate(
    session: &mut Session,
    calibration: &Calibration,
) -> Result<ForceChange, SourceError> {
    let recalibration = Recalibration::new(calibration, &session.entries)?;
    let (mut change, mut squares) = (ForceChange::default(), 0.0);
    let higher = |peak: Option<f64>, force: f64| Some(peak.map_or(force, |peak| peak.max(force)));
    for (index, row) in (0..).zip(&mut session.rows) {
        let (Some(force_n), Some(force)) = (recalibration.force(index, row), &mut row.force) else {
            continue;
        };
        change.samples += 1;
        squares += (force_n - *force).powi(2);
        change.max_n = change.max_n.max((force_n - *force).abs());
        change.peak_before_n = higher(change.peak_before_n, *force);
        change.peak_after_n = higher(change.peak_after_n, force_n);
        *force = force_n;
    }
    if change.samples > 0 {
        change.rms_n = (squares / change.samples as f64).sqrt();
    }
    session.manifest.calibration = serde_json::to_value(calibration).map_err(bad_calibration)?;
    Ok(change)
}

/// A session as an analysis has it, whose samples pass by and are never all in memory.
#[derive(Clone, Debug)]
pub struct StreamedAnalysis {
    /// The session with its edits made; its manifest has the calibration that the forces are made with.
    pub edited: edited_session::StreamedSession,
    pub analyses: Analyses,
    /// Stretches whose forces do not count: from and to in s since the first sample.
    pub left_out_s: Vec<[f64; 2]>,
    recalibration: Option<Recalibration>,
}

/// Reads a session through, so that it is known to be whole, and keeps all but its samples.
pub fn stream_analysed(path: &Path, name: Option<&str>) -> Result<StreamedAnalysis, SourceError> {
    of_outline(path, Session::scan(path, &mut |_block| {})?, name)
}

pub fn of_outline(
    path: &Path,
    outline: SessionOutline,
    name: Option<&str>,
) -> Result<StreamedAnalysis, SourceError> {
    let mut edited = edited_session::of_outline(path, outline)?;
    let analyses = Analyses::read(path, &edited.outline.manifest.session_id)?;
    let reading = AnalysisReading::of(path, &analyses, name)?;
    let outline = &mut edited.outline;
    outline.notes.extend(reading.notes);
    let mut recalibration = None;
    if let Some((document, calibration)) = reading.calibration {
        recalibration = Some(Recalibration::new(&calibration, &outline.entries)?);
        outline.manifest.calibration = document;
    }
    Ok(StreamedAnalysis { edited, analyses, left_out_s: reading.left_out_s, recalibration })
}

impl StreamedAnalysis {
    /// Whether samples are other than those recorded.
    pub fn is_changed(&self) -> bool {
        self.recalibration.is_some() || self.edited.is_changed()
    }

    /// Hands out every sample that was there when the session was first read, as the analysis has it, in order,
    /// some at a time.
    pub fn rows(&self, path: &Path, visit: &mut dyn FnMut(&[SampleRow])) -> Result<(), ReadError> {
        let Some(recalibration) = &self.recalibration else { return self.edited.rows(path, visit) };
        let (mut index, mut own) = (0, Vec::new());
        self.edited.rows(path, &mut |rows| {
            own.clear();
            own.extend_from_slice(rows);
            for row in &mut own {
                row.force = recalibration.force(index, row).or(row.force);
                index += 1;
            }
            visit(&own);
        })
    }

    /// The same without the forces that do not count, for tables, which know no weights.
    pub fn table_rows(
        &self,
        path: &Path,
        visit: &mut dyn FnMut(&[SampleRow]),
    ) -> Result<(), ReadError> {
        if self.left_out_s.is_empty() {
            return self.rows(path, visit);
        }
        let manifest = &self.edited.outline.manifest;
        let (mut first, mut own) = (None, Vec::new());
        self.rows(path, &mut |rows| {
            own.clear();
            own.extend_from_slice(rows);
            for row in &mut own {
                let at = time_between(manifest, first.get_or_insert(*row), row);
                row.force = row.force.filter(|_| !is_left_out(&self.left_out_s, at));
            }
            visit(&own);
        })
    }
}

/// A new recalibration of a session: its record and its effect on the forces.
pub fn recalibration(
    path: &Path,
    calibration: &Calibration,
) -> Result<(AnalysedSession, Vec<AnalysisInput>, AnalysisContent, ForceChange), SourceError> {
    let mut opened = open(path, None)?;
    if let Some(imported) = &opened.edited.session.manifest.imported {
        return Err(SourceError::NoSignal { file: imported.file.clone() });
    }
    // A readable calibration of its own shows that the session's forces came from one.
    calibration_of(&opened.edited.session)?;
    let change = recalibrate(&mut opened.edited.session, calibration)?;
    // The calibration that went in is the new one.
    let inputs = opened.inputs(path, None)?;
    let what = AnalysisContent::Recalibration {
        calibration: opened.edited.session.manifest.calibration.clone(),
        results: serde_json::to_value(change).unwrap_or_default(),
    };
    Ok((opened, inputs, what, change))
}

/// A record of this version of the program, dated now.
#[must_use]
pub fn record(
    name: &str,
    by: &str,
    reason: &str,
    inputs: Vec<AnalysisInput>,
    what: AnalysisContent,
) -> Analysis {
    Analysis {
        name: name.trim().to_owned(),
        at: wall_now().into(),
        by: by.to_owned(),
        reason: reason.trim().to_owned(),
        software_version: env!("CARGO_PKG_VERSION").to_owned(),
        engine_version: ENGINE_VERSION,
        inputs,
        what,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(name: &str) -> Session {
        let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
        Session::open(&sessions.join(name)).unwrap()
    }

    #[test]
    fn its_own_calibration_gives_a_session_its_forces_back() {
        for name in ["ramp-hold-lab", "over-force-galil", "hold-until-lab"] {
            let mut session = recorded(name);
            let before = session.clone();
            let own = calibration_of(&session).unwrap();
            let change = recalibrate(&mut session, &own).unwrap();
            println!("{name}: {change:?}");
            assert!(change.samples > 50_000, "{name}: {change:?}");
            assert!(change.max_n <= 1e-9, "{name}: {change:?}");
            // Without any recalculation this would hold too, so the forces are changed first.
            let rows = &mut session.rows;
            rows.iter_mut().filter_map(|row| row.force.as_mut()).for_each(|force| *force = -1.0);
            recalibrate(&mut session, &own).unwrap();
            for (row, old) in session.rows.iter().zip(&before.rows) {
                assert_eq!(row.force.is_some(), old.force.is_some());
                let apart = row.force.unwrap_or(0.0) - old.force.unwrap_or(0.0);
                assert!(apart.abs() <= 1e-9, "{name}: {apart}");
            }
        }
    }

    #[test]
    fn samples_that_pass_by_are_those_that_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session");
        std::fs::create_dir(&path).unwrap();
        let recorded =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions/ramp-hold-lab");
        for item in std::fs::read_dir(recorded).unwrap() {
            let item = item.unwrap();
            std::fs::copy(item.path(), path.join(item.file_name())).unwrap();
        }
        let mut heavier = calibration_of(&Session::open(&path).unwrap()).unwrap();
        heavier.steps.iter_mut().for_each(|step| step.mass_g *= 1.5);
        let (opened, inputs, what, _) = recalibration(&path, &heavier).unwrap();
        let id = opened.edited.session.manifest.session_id.clone();
        let made = record("heavier", "Ada", "", inputs, what);
        palpate_sessions::analyses::add_analysis(&path, &id, &made).unwrap();
        let what = AnalysisContent::Mask { left_out_s: vec![[85.0, 86.0], [90.0, 90.5]] };
        let made = record("knock", "Ada", "", opened.inputs(&path, None).unwrap(), what);
        palpate_sessions::analyses::add_analysis(&path, &id, &made).unwrap();
        for name in [None, Some("heavier"), Some("knock")] {
            let mut analysed = open(&path, name).unwrap();
            let opened = analysed.edited.session.clone();
            let passing = stream_analysed(&path, name).unwrap();
            assert_eq!(passing.is_changed(), name == Some("heavier"));
            let mut rows = Vec::new();
            passing.rows(&path, &mut |some| rows.extend_from_slice(some)).unwrap();
            assert!(rows == opened.rows);
            analysed.blank();
            rows.clear();
            passing.table_rows(&path, &mut |some| rows.extend_from_slice(some)).unwrap();
            assert!(rows == analysed.edited.session.rows);
            assert_eq!(rows == opened.rows, name != Some("knock"));
            let outline = &passing.edited.outline;
            assert_eq!(outline.notes, opened.notes);
            assert_eq!(outline.manifest, opened.manifest);
        }
    }

    #[test]
    fn a_cell_that_feels_half_as_much_makes_forces_twice_as_large() {
        let mut session = recorded("ramp-hold-lab");
        let before = session.clone();
        let mut heavier = calibration_of(&session).unwrap();
        for step in &mut heavier.steps {
            step.mass_g *= 2.0;
        }
        assert!(!heavier.steps.is_empty());
        recalibrate(&mut session, &heavier).unwrap();
        for (row, old) in session.rows.iter().zip(&before.rows) {
            let (Some(force), Some(old)) = (row.force, old.force) else { continue };
            assert!((force - 2.0 * old).abs() < 1e-9, "{force} against {old}");
        }
        assert_eq!(calibration_of(&session).unwrap(), heavier);
    }
}
