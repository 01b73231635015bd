//! Machine compliance: measured from a session against a stiff surface, and subtracted from the depths of other
//! sessions. The axis travels as far as the probe sinks in and the rig yields, so the probe's own depth is
//! `depth - compliance * force`. Raw depths stay as they are; corrected ones stand beside them.

use crate::analysed_session::time_between;
use crate::source::{
    FitSource, SourceError, TouchPoint, curve_of, decisions, is_saturated, noise_of, records,
    trusted_samples, unloaded_off_surface,
};
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::{
    Compliance, ComplianceError, CorrectedDepth, Phase, RigCompliance, StiffSample,
};
use palpate_model::signal::{ContactSearchPoint, fit_touch};
use palpate_model::units::{Depth, Newtons, Position, Seconds, Volts};
use palpate_protocols::engine::Record;
use palpate_protocols::plans::FindBase;
use palpate_rheology::fit::{
    FitSample, PressedSignal, Signal, UnloadedMean, estimate_zero, fit_compliance_to_signal,
};
use palpate_sessions::compliances::{ComplianceStore, StoredCompliance};
use palpate_sessions::{LibraryError, SampleRow, Session};
use palpate_tables::export::ExtraColumns;
use serde::Serialize;
use std::path::Path;
use thiserror::Error;

/// Name that stands for the compliance in force for a session's rig.
pub const LATEST_COMPLIANCE: &str = "last";

#[derive(Debug, Error)]
pub enum ComplianceMeasurementError {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(
        "an imported session has no rig and no calibration, so no machine compliance can be computed from it; run the protocol 'stiff-surface' and give its session"
    )]
    Imported,
    #[error(
        "in this session the probe found no stiff surface and may have pressed tissue; run the protocol 'stiff-surface' and give its session"
    )]
    NoSurface,
    #[error(
        "in this session the probe touched a stiff surface but never pressed it with a known force; run the protocol 'stiff-surface' to its end"
    )]
    NoPress,
    #[error(transparent)]
    Line(#[from] ComplianceError),
}

/// The compliance that a session of the protocol `stiff-surface` tells, from the ways in of all presses at or
/// above `seating`; without it from 0.3 of the highest force, as the search for the surface takes it.
pub fn compliance_from_session(
    session: &Session,
    seating: Option<Newtons>,
) -> Result<RigCompliance, ComplianceMeasurementError> {
    if session.manifest.imported.is_some() {
        return Err(ComplianceMeasurementError::Imported);
    }
    let StiffPresses { presses, signal, unloaded } = StiffPresses::of(session)?;
    let forces = presses.iter().flat_map(|(_, samples)| samples);
    let highest = forces.map(|sample| sample.force.0).fold(0.0, f64::max);
    if presses.is_empty() {
        return Err(ComplianceMeasurementError::NoPress);
    }
    let seating = seating.unwrap_or(Newtons(FindBase::SEATED_SHARE * highest));
    let by_force = RigCompliance::of_presses(&presses, seating)?;
    let line = by_force.compliance();
    let seated_from = line.surface.0 + line.mm_per_newton * seating.0;
    let seated = signal.into_iter().filter(|one| one.position.0 >= seated_from);
    let seated: Vec<PressedSignal> = seated.collect();
    let curve = curve_of(session)?;
    let found = match fit_compliance_to_signal(&line, &seated, &unloaded, &curve) {
        Some(line) => by_force.improved(&line),
        None => by_force,
    };
    let manifest = &session.manifest;
    Ok(RigCompliance {
        rig: manifest.rig.as_ref().map_or_else(String::new, |rig| rig.name.clone()),
        taken_at: manifest.started_at_text(),
        operator: manifest.operator.clone(),
        session_id: manifest.session_id.clone(),
        session_checksum: format!("{:08x}", session.checksum()),
        software_version: env!("CARGO_PKG_VERSION").into(),
        ..found
    })
}

/// Loading samples after a stiff surface was found.
struct StiffPresses {
    /// Forces above the zero of their time, press by press.
    presses: Vec<(u32, Vec<StiffSample>)>,
    /// The signal of all presses; times count from the session's first sample.
    signal: Vec<PressedSignal>,
    /// The signal out of contact, on the same clock.
    unloaded: Vec<UnloadedMean>,
}

impl StiffPresses {
    fn of(session: &Session) -> Result<Self, ComplianceMeasurementError> {
        let curve = curve_of(session)?;
        let decisions = decisions(session)?;
        let noise = noise_of(&decisions).ok_or(ComplianceMeasurementError::NoPress)?;
        let found = records(&decisions).rev().find_map(|(after, record)| match record {
            Record::BaseFound { position, .. } => Some((after as usize, *position)),
            _ => None,
        });
        let (after, surface) = found.ok_or(ComplianceMeasurementError::NoSurface)?;
        let rows = session.rows.iter().take(trusted_samples(&decisions)).skip(after);
        let rows = rows.filter(|row| row.phase == Phase::Ramp && !is_saturated(session, row));
        let pressed = rows.filter_map(|row| {
            let t = time_between(&session.manifest, &session.rows[0], row);
            let position = Position(surface.0 + row.depth?);
            let signal = PressedSignal { t, position, volts: Volts(row.volts?) };
            Some((row.cycle, Newtons(row.force?), signal))
        });
        let pressed: Vec<(u32, Newtons, PressedSignal)> = pressed.collect();
        let unloaded = unloaded_off_surface(session, after, surface)?;
        let times: Vec<Seconds> = pressed.iter().map(|(.., signal)| signal.t).collect();
        let zero = estimate_zero(&unloaded, &times);
        let mut presses: Vec<(u32, Vec<StiffSample>)> = Vec::new();
        for (k, (press, above_tare, signal)) in pressed.iter().enumerate() {
            let zero = zero.as_ref().map(|zero| zero[k]);
            let force = zero.map(|zero| curve.newtons_above_tare(signal.volts, Some(zero)));
            let force = force.unwrap_or(*above_tare);
            let sigma = curve.force_sigma(force, noise);
            let sample = StiffSample { position: signal.position, force, sigma };
            match presses.last_mut() {
                Some((last, samples)) if last == press => samples.push(sample),
                _ => presses.push((*press, vec![sample])),
            }
        }
        let signal = pressed.into_iter().map(|(.., signal)| signal).collect();
        Ok(Self { presses, signal, unloaded })
    }
}

#[derive(Debug, Error)]
pub enum ComplianceCorrectionError {
    #[error(transparent)]
    Library(#[from] LibraryError),
    #[error(
        "the library has no compliance of rig {rig}; run the protocol 'stiff-surface' on that rig and store the compliance of its session"
    )]
    NoneInForce { rig: String },
    #[error(
        "a table does not state its rig, so its machine compliance cannot be looked up; give a compliance file"
    )]
    NoRig,
    #[error(
        "the compliance in force differs between rigs and computers, and a stored fit has that of one file; give a compliance file"
    )]
    NoOneFile,
    #[error(
        "{id} is the compliance of rig {of}, but the record is from rig {rig}; give a compliance of rig {rig}"
    )]
    OtherRig { id: String, of: String, rig: String },
}

/// Which compliance corrects depths.
#[derive(Debug)]
enum CorrectionChoice {
    Raw,
    /// The one in force for the rig of each record.
    InForce,
    This(Box<StoredCompliance>),
}

/// Compliance for each record.
#[derive(Debug)]
pub struct ComplianceCorrections {
    choice: CorrectionChoice,
    shelf: ComplianceStore,
}

impl ComplianceCorrections {
    /// Depths stay raw; with a library, [`Self::apply`] computes what the compliance in force would change.
    #[must_use]
    pub fn none(library: Option<&Path>) -> Self {
        Self {
            choice: CorrectionChoice::Raw,
            shelf: library.map(ComplianceStore::open).unwrap_or_default(),
        }
    }

    /// By name: [`LATEST_COMPLIANCE`] for the one in force for each record's rig, a file, or an identifier of the library.
    pub fn named(name: &str, library: Option<&Path>) -> Result<Self, ComplianceCorrectionError> {
        let shelf = library.map(ComplianceStore::open).unwrap_or_default();
        let path = Path::new(name);
        let choice = if name == LATEST_COMPLIANCE {
            CorrectionChoice::InForce
        } else if path.is_file() {
            let stem = path.file_stem().unwrap_or_default();
            CorrectionChoice::This(Box::new(StoredCompliance {
                id: stem.to_string_lossy().into_owned(),
                path: path.into(),
                document: palpate_sessions::document_store::read_document(path)?,
            }))
        } else {
            CorrectionChoice::This(Box::new(shelf.find(name)?.clone()))
        };
        Ok(Self { choice, shelf })
    }

    /// The file of the compliance that corrects depths; `None` where they stay raw.
    pub fn file(&self) -> Result<Option<&Path>, ComplianceCorrectionError> {
        match &self.choice {
            CorrectionChoice::Raw => Ok(None),
            CorrectionChoice::InForce => Err(ComplianceCorrectionError::NoOneFile),
            CorrectionChoice::This(stored) => Ok(Some(&stored.path)),
        }
    }

    /// The document for a record of a rig, and whether depths are corrected with it; a table has no rig.
    pub fn of_rig(
        &self,
        rig: Option<&str>,
    ) -> Result<Option<(&StoredCompliance, bool)>, ComplianceCorrectionError> {
        let in_force = |rig: &str| self.shelf.in_force(rig);
        match (&self.choice, rig) {
            (CorrectionChoice::Raw, rig) => {
                Ok(rig.and_then(in_force).map(|stored| (stored, false)))
            }
            (CorrectionChoice::InForce, None) => Err(ComplianceCorrectionError::NoRig),
            (CorrectionChoice::InForce, Some(rig)) => match in_force(rig) {
                Some(stored) => Ok(Some((stored, true))),
                None => Err(ComplianceCorrectionError::NoneInForce { rig: rig.into() }),
            },
            (CorrectionChoice::This(stored), Some(rig)) if stored.document.rig != rig => {
                Err(ComplianceCorrectionError::OtherRig {
                    id: stored.id.clone(),
                    of: stored.document.rig.clone(),
                    rig: rig.into(),
                })
            }
            (CorrectionChoice::This(stored), _) => Ok(Some((stored, true))),
        }
    }

    /// Corrects what is to be fitted, where that is choice, and tells what the compliance does to it; `None`
    /// where none is choice and none is kept.
    pub fn apply(
        &self,
        source: &mut FitSource,
    ) -> Result<Option<ComplianceCorrection>, ComplianceCorrectionError> {
        let Some((stored, is_applied)) = self.of_rig(source.rig.as_deref())? else {
            return Ok(None);
        };
        let correction = ComplianceCorrection::of(stored, is_applied, &source.samples);
        if is_applied {
            let curve = source.calibration.as_ref().and_then(|one| one.curve().ok());
            let compliance = stored.document.compliance();
            let depths = source.samples.iter().map(|sample| sample.depth).collect();
            correct_samples(&mut source.samples, &compliance, curve.as_ref());
            source.raw = Some(RawDepths { depths, compliance });
            if let Some(signal) = &mut source.signal {
                correct_contact(signal, &source.touches, &compliance);
            }
            source.notes.extend(correction.doubt.clone());
            // One that cannot be read might be the one in force.
            if let CorrectionChoice::InForce = self.choice {
                let unreadable = self.shelf.unreadable.iter();
                source.notes.extend(unreadable.map(ToString::to_string));
            }
        }
        Ok(Some(correction))
    }
}

/// Effect of a compliance on the depths of a record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComplianceCorrection {
    pub id: String,
    /// Machine compliance in mm/N.
    pub mm_per_n: f64,
    pub std_error_mm_per_n: f64,
    /// Whether depths were corrected; if not, this is what would be.
    pub is_applied: bool,
    /// Highest force of the record, in N.
    pub force_peak_n: f64,
    /// Decrease of the depth at that force, in um.
    pub at_peak_um: f64,
    /// The standard uncertainty of that in um, from that of the compliance.
    pub at_peak_std_error_um: f64,
    /// Reason to doubt the correction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doubt: Option<String>,
}

impl ComplianceCorrection {
    fn of(stored: &StoredCompliance, is_applied: bool, samples: &[FitSample]) -> Self {
        let known = samples.iter().filter(|sample| sample.is_measured());
        let peak = known.map(|sample| sample.force.0).fold(0.0, f64::max);
        let document = &stored.document;
        let doubt = (peak > document.force_max_n).then(|| {
            format!(
                "the compliance was measured up to {:.1} N, but the record reaches {peak:.1} N; above the measured force the compliance is extrapolated as a straight line",
                document.force_max_n
            )
        });
        Self {
            id: stored.id.clone(),
            mm_per_n: document.mm_per_n,
            std_error_mm_per_n: document.std_error_mm_per_n,
            is_applied,
            force_peak_n: peak,
            at_peak_um: 1e3 * document.mm_per_n * peak,
            at_peak_std_error_um: 1e3 * document.std_error_mm_per_n * peak,
            doubt,
        }
    }

    pub fn sentence(&self) -> String {
        let (id, um, peak) = (&self.id, self.at_peak_um, self.force_peak_n);
        if self.is_applied {
            format!(
                "depths are corrected for machine compliance {id}, by {um:.0} ± {:.1} µm at {peak:.2} N",
                self.at_peak_std_error_um
            )
        } else {
            format!(
                "depths are not corrected; machine compliance {id} would reduce them by {um:.0} µm at {peak:.2} N"
            )
        }
    }
}

/// Forces are averaged over so long, in s, before they bend the rig in a fit: noise is in the reading and bends
/// nothing, and a depth that moved with the noise of its own force would pull the fitted stiffness down. At the
/// corner of a ramp, where the force turns from 2 N/s to rest, the mean is off by 2 * 0.05 / 8 = 0.0125 N, a
/// micrometre on a soft rig. Signals are averaged where the curve is known: the mean force of a noisy signal is not the force
/// of the mean signal.
const AVERAGED_SECS: f64 = 0.05;

/// Takes from every depth what the rig gives way. Where no force near is known, the last one known bends the rig.
fn correct_samples(
    samples: &mut [FitSample],
    compliance: &Compliance,
    curve: Option<&CalibrationCurve>,
) {
    let signal = |force: Newtons| curve.map_or(force.0, |curve| curve.volts_from_newtons(force).0);
    let read = |signal: f64| {
        curve.map_or(Newtons(signal), |curve| curve.newtons_from_volts(Volts(signal)))
    };
    let half = 0.5 * AVERAGED_SECS;
    let (mut first, mut end, mut force) = (0, 0, Newtons(0.0));
    let bends: Vec<Newtons> = samples
        .iter()
        .map(|sample| {
            while samples[first].t.0 < sample.t.0 - half {
                first += 1;
            }
            while end < samples.len() && samples[end].t.0 <= sample.t.0 + half {
                end += 1;
            }
            let near = samples[first..end].iter().filter(|one| one.is_measured());
            let (sum, count) =
                near.fold((0.0, 0.0), |(sum, count), one| (sum + signal(one.force), count + 1.0));
            if count > 0.0 {
                force = read(sum / count);
            }
            force
        })
        .collect();
    for (sample, force) in samples.iter_mut().zip(bends) {
        sample.depth = compliance.correct(sample.depth, force, Newtons(0.0)).depth;
    }
}

/// Moves the contact position to where the touches find it once the rig no longer gives way: the search took every depth for
/// the probe's own. Both are fits of the same points, so their difference has neither noise nor drift. Touches that are not
/// known leave it.
fn correct_contact(signal: &mut Signal, touches: &[TouchPoint], compliance: &Compliance) {
    let raw: Vec<ContactSearchPoint> = touches.iter().map(|one| one.fitted).collect();
    let corrected = touches.iter().map(|one| {
        let depth = Depth(one.fitted.position.0);
        let depth = compliance.correct(depth, one.force, Newtons(0.0)).depth;
        ContactSearchPoint { position: Position(depth.0), ..one.fitted }
    });
    let corrected: Vec<ContactSearchPoint> = corrected.collect();
    if let (Ok(raw), Ok(corrected)) = (fit_touch(&raw), fit_touch(&corrected)) {
        let (raw, corrected) = (raw.contact, corrected.contact);
        signal.contact_shift_mm = corrected.position.distance_from(raw.position);
        signal.contact_error_mm = corrected.std_error_mm;
    }
}

/// The depths of a record before they were corrected, and what corrects them.
#[derive(Clone, Debug, PartialEq)]
pub struct RawDepths {
    depths: Vec<Depth>,
    compliance: Compliance,
}

impl RawDepths {
    /// Corrects the depths by these forces, one for each sample, and tells by how much the most changed depth changes, in mm.
    #[must_use]
    pub fn correct_by(&self, forces: &[Newtons], samples: &mut [FitSample]) -> f64 {
        let mut largest = 0.0f64;
        for ((sample, raw), force) in samples.iter_mut().zip(&self.depths).zip(forces) {
            let depth = self.compliance.correct(*raw, *force, Newtons(0.0)).depth;
            largest = largest.max((depth.0 - sample.depth.0).abs());
            sample.depth = depth;
        }
        largest
    }
}

/// The corrected depths of a session as columns beside its own: empty before contact, and where the converter
/// was at an end of its range or an interlock had tripped, for there the force is not known.
pub fn corrected_depth_columns(
    session: &Session,
    stored: &StoredCompliance,
) -> Result<ExtraColumns, SourceError> {
    let curve = curve_of(session)?;
    let decisions = decisions(session)?;
    let trusted = trusted_samples(&decisions);
    let noise = noise_of(&decisions);
    let compliance = stored.document.compliance();
    let one = |(index, row): (usize, &SampleRow)| -> Option<CorrectedDepth> {
        let (force, depth) = (Newtons(row.force?), Depth(row.depth?));
        if index >= trusted || is_saturated(session, row) {
            return None;
        }
        Some(compliance.correct(depth, force, curve.force_sigma(force, noise?)))
    };
    let corrected: Vec<Option<CorrectedDepth>> = session.rows.iter().enumerate().map(one).collect();
    let column = |of: fn(CorrectedDepth) -> f64| corrected.iter().map(|one| one.map(of)).collect();
    let document = serde_json::json!({
        "id": stored.id,
        "rig": stored.document.rig,
        "taken_at": stored.document.taken_at,
        "session_id": stored.document.session_id,
        "session_checksum": stored.document.session_checksum,
        "checksum": stored.checksum(),
        "mm_per_n": stored.document.mm_per_n,
        "std_error_mm_per_n": stored.document.std_error_mm_per_n,
    });
    Ok(ExtraColumns {
        columns: vec![
            ("depth_corrected_mm", "mm", column(|one| one.depth.0)),
            ("depth_corrected_sigma_mm", "mm", column(|one| one.sigma_mm)),
        ],
        metadata: vec![("palpate.compliance".into(), document.to_string())],
        ..ExtraColumns::of_sensors(&session.manifest, &session.entries)
    })
}
