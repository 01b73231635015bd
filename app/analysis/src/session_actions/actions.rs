//! Actions that add a record beside a session. Records are never overwritten.

use super::super::edits::{EditFailure, EditTarget};
use super::{ActionReport, SessionFitRequest};
use crate::analysed_session::{self, ForceChange, record};
use crate::edited_session;
use crate::progress::Progress;
use crate::report::dossier::SessionReading;
use crate::report::stored_analysis;
use crate::source::SourceError;
use palpate_model::calibration::Calibration;
use palpate_model::units::Position;
use palpate_sessions::analyses::{
    Analyses, Analysis, AnalysisContent, AnalysisError, AnalysisInput, add_analysis,
    read_session_inputs,
};
use palpate_sessions::{
    DataQuality, Edit, EditChange, LibraryError, ReadError, SessionSummary, read_calibration,
};
use serde_json::Value;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum SessionActionError {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Say(#[from] EditFailure),
    #[error(transparent)]
    Calibration(#[from] LibraryError),
    #[error(
        "the session has no force in these intervals, so the mask would exclude nothing; choose other intervals"
    )]
    NothingLeftOut,
    #[error("the session found no contact, so it has no contact to correct")]
    NoContact,
    #[error("the session found contact {0} times; give the number of one contact")]
    WhichContact(usize),
    #[error("the session has no contact {number}; its contacts are numbered from 1 to {found}")]
    NoSuchContact { number: u32, found: usize },
    #[error(
        "contact at {position} is outside the rig's travel of {travel}; give the position from home"
    )]
    OutsideTravel { position: Position, travel: Position },
    #[error("{0}")]
    Fit(String),
    #[error("cancelled; nothing was kept")]
    Cancelled,
}

impl From<AnalysisError> for SessionActionError {
    fn from(err: AnalysisError) -> Self {
        Self::Source(err.into())
    }
}

impl From<ReadError> for SessionActionError {
    fn from(err: ReadError) -> Self {
        Self::Source(err.into())
    }
}

/// Author of a record, and the reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attribution {
    pub by: String,
    /// In a few words; some actions require it.
    pub reason: String,
}

/// An action on a session that adds a record beside it.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionAction {
    Fit {
        name: String,
        how: SessionFitRequest,
    },
    Recalibrate {
        name: String,
        calibration: Box<Calibration>,
    },
    RecalibrateFrom {
        name: String,
        file: PathBuf,
    },
    Mask {
        name: String,
        /// From and to in s since the first sample.
        left_out_s: Vec<[f64; 2]>,
    },
    Withdraw {
        name: String,
    },
    SetDataQuality(DataQuality),
    CorrectContact {
        /// Number of the contact, from 1.
        number: u32,
        position: Position,
    },
}

impl SessionAction {
    /// Adds the record of this action to a session.
    pub fn run(
        self,
        session: &Path,
        who: &Attribution,
        progress: &dyn Progress,
    ) -> Result<ActionReport, SessionActionError> {
        let (sentence, name, is_edit) = match self {
            Self::Fit { name, how } => {
                (fit(session, &name, &how, who, progress)?, Some(name), false)
            }
            Self::RecalibrateFrom { name, file } => {
                let calibration = Box::new(read_calibration(&file)?);
                return Self::Recalibrate { name, calibration }.run(session, who, progress);
            }
            Self::Recalibrate { name, calibration } => {
                step(progress, 0, 1, "recalculating the forces")?;
                let found = recalibrate(session, &name, &calibration, who)?;
                (stored_analysis::describe_force_change(&found.change), Some(name), false)
            }
            Self::Mask { name, left_out_s } => {
                let masked = mask(session, &name, left_out_s, who, progress)?;
                let sentence = format!("{} of {} forces are left out", masked.left_out, masked.of);
                (sentence, Some(name), false)
            }
            Self::Withdraw { name } => {
                withdraw(session, &name, who)?;
                (format!("analysis '{name}' is withdrawn"), None, false)
            }
            Self::SetDataQuality(verdict) => {
                set_data_quality(session, verdict, who)?;
                (format!("the session is {verdict}"), None, true)
            }
            Self::CorrectContact { number, position } => {
                (correct_contact(session, Some(number), position, who)?.sentence(), None, true)
            }
        };
        let made = name.map(|name| name.trim().to_owned());
        let sentence = match &made {
            Some(name) => format!("saved as '{name}': {sentence}"),
            None => sentence,
        };
        Ok(ActionReport {
            sentence,
            changed: Some(session.to_path_buf()),
            is_edit,
            created_analysis: made,
        })
    }
}

fn id_of(session: &Path) -> Result<String, ReadError> {
    Ok(SessionSummary::read(session)?.manifest.session_id)
}

/// Refuses a taken name before hours of work.
fn check_name(session: &Path, name: &str) -> Result<String, SessionActionError> {
    let (id, name) = (id_of(session)?, name.trim());
    if Analyses::read(session, &id)?.all.iter().any(|one| one.name == name) {
        let name = name.to_owned();
        return Err(AnalysisError::Taken { name }.into());
    }
    Ok(id)
}

pub(super) fn keep(
    session: &Path,
    id: &str,
    name: &str,
    inputs: Vec<AnalysisInput>,
    what: AnalysisContent,
    who: &Attribution,
) -> Result<Analysis, SessionActionError> {
    let analysis = record(name, &who.by, &who.reason, inputs, what);
    add_analysis(session, id, &analysis)?;
    Ok(analysis)
}

fn step(
    progress: &dyn Progress,
    done: usize,
    of: usize,
    what: &str,
) -> Result<(), SessionActionError> {
    super::step(progress, done, of, what).map_err(|_| SessionActionError::Cancelled)
}

fn fit(
    session: &Path,
    name: &str,
    how: &SessionFitRequest,
    who: &Attribution,
    progress: &dyn Progress,
) -> Result<String, SessionActionError> {
    check_name(session, name)?;
    let results = how.results(session, progress).map_err(SessionActionError::Fit)?;
    let fit = FitToStore {
        based_on: how.based_on.as_deref(),
        together_with: &how.together_with,
        settings: how.settings(),
        results,
    };
    Ok(stored_analysis::describe_analysis(&store_fit(session, name, fit, who)?.what))
}

#[derive(Clone, Debug)]
pub struct FitToStore<'a> {
    /// Analysis through which the session was read.
    pub based_on: Option<&'a str>,
    pub together_with: &'a [SessionReading],
    pub settings: Value,
    pub results: Value,
}

/// Stores a fit of a session as an analysis beside it.
pub fn store_fit(
    session: &Path,
    name: &str,
    fit: FitToStore<'_>,
    who: &Attribution,
) -> Result<Analysis, SessionActionError> {
    let opened = analysed_session::open(session, fit.based_on)?;
    let mut inputs = opened.inputs(session, fit.based_on)?;
    for one in fit.together_with {
        let id = id_of(&one.session)?;
        let theirs = read_session_inputs(&one.session)?.into_iter();
        inputs.extend(
            theirs.map(|file| AnalysisInput { what: format!("{id}/{}", file.what), ..file }),
        );
    }
    let what = AnalysisContent::Fit {
        based_on: fit.based_on.map(str::to_owned),
        settings: fit.settings,
        results: fit.results,
    };
    let id = &opened.edited.session.manifest.session_id;
    keep(session, id, name, inputs, what, who)
}

#[derive(Clone, Debug)]
pub struct RecalibrationResult {
    pub change: ForceChange,
    /// The session's rig; empty where there is none.
    pub rig: String,
}

/// Recalculates the forces of a session with another calibration, as an analysis beside it.
pub fn recalibrate(
    session: &Path,
    name: &str,
    calibration: &Calibration,
    who: &Attribution,
) -> Result<RecalibrationResult, SessionActionError> {
    let id = check_name(session, name)?;
    let (opened, inputs, what, change) = analysed_session::recalibration(session, calibration)?;
    keep(session, &id, name, inputs, what, who)?;
    let rig = opened.edited.session.manifest.rig;
    Ok(RecalibrationResult { change, rig: rig.map_or_else(String::new, |rig| rig.name) })
}

#[derive(Clone, Debug)]
pub struct MaskResult {
    pub analysis: Analysis,
    pub left_out: usize,
    /// Number of forces before the mask.
    pub of: usize,
}

/// Leaves stretches of a session out, from and to in s since its first sample, as an analysis beside it.
pub fn mask(
    session: &Path,
    name: &str,
    left_out_s: Vec<[f64; 2]>,
    who: &Attribution,
    progress: &dyn Progress,
) -> Result<MaskResult, SessionActionError> {
    let id = check_name(session, name)?;
    step(progress, 0, 1, "applying the mask")?;
    let mut opened = analysed_session::open(session, None)?;
    let inputs = opened.inputs(session, None)?;
    let forces = |opened: &analysed_session::AnalysedSession| {
        opened.edited.session.rows.iter().filter(|row| row.force.is_some()).count()
    };
    let of = forces(&opened);
    opened.left_out_s.clone_from(&left_out_s);
    opened.blank();
    let left_out = of - forces(&opened);
    if left_out == 0 {
        return Err(SessionActionError::NothingLeftOut);
    }
    step(progress, 1, 1, "storing the analysis")?;
    let what = AnalysisContent::Mask { left_out_s };
    Ok(MaskResult { analysis: keep(session, &id, name, inputs, what, who)?, left_out, of })
}

/// Withdraws an analysis: its record stays and does not count.
pub fn withdraw(
    session: &Path,
    name: &str,
    who: &Attribution,
) -> Result<Analysis, SessionActionError> {
    let id = id_of(session)?;
    keep(session, &id, name, Vec::new(), AnalysisContent::Withdrawal, who)
}

/// Says what a session is worth; the verdict before, and the edit.
pub fn set_data_quality(
    session: &Path,
    verdict: DataQuality,
    who: &Attribution,
) -> Result<(Option<DataQuality>, Edit), SessionActionError> {
    let subject = EditTarget::read(session)?;
    let was = subject.edits.verdict().map(|(verdict, _)| verdict);
    let edit = subject.add_edit(&who.by, &who.reason, EditChange::Verdict { verdict })?;
    Ok((was, edit))
}

/// A corrected contact point.
#[derive(Clone, Debug)]
pub struct ContactCorrection {
    /// Number of the contact, from 1.
    pub number: u32,
    /// Corrected position from home.
    pub position: Position,
    /// Position that the session found, from home.
    pub was: Position,
    pub edit: Edit,
}

impl ContactCorrection {
    /// Increase of all depths from this contact in mm.
    pub fn deeper_mm(&self) -> f64 {
        self.was.depth_from(self.position).0
    }

    pub fn sentence(&self) -> String {
        format!(
            "contact {} at {:.3} mm instead of {:.3} mm; its depths change by {:+.3} mm",
            self.number,
            self.position.0,
            self.was.0,
            self.deeper_mm()
        )
    }
}

/// Says where contact really was; a session that found one only needs no number.
pub fn correct_contact(
    session: &Path,
    number: Option<u32>,
    position: Position,
    who: &Attribution,
) -> Result<ContactCorrection, SessionActionError> {
    let passing = edited_session::stream_edited(session)?;
    let outline = &passing.outline;
    let found = edited_session::contacts(&outline.entries);
    let number = match (number, found.len()) {
        (_, 0) => return Err(SessionActionError::NoContact),
        (Some(number), _) => number,
        (None, 1) => 1,
        (None, several) => return Err(SessionActionError::WhichContact(several)),
    };
    let index = (number as usize).checked_sub(1);
    let Some(was) = index.and_then(|index| found.get(index)) else {
        let found = found.len();
        return Err(SessionActionError::NoSuchContact { number, found });
    };
    // A session that found a contact has a rig.
    let travel = outline.manifest.rig.as_ref().map(|rig| rig.travel).unwrap_or(Position(0.0));
    if !(0.0..=travel.0).contains(&position.0) {
        return Err(SessionActionError::OutsideTravel { position, travel });
    }
    let was = was.position;
    let change = EditChange::Contact { number, position_mm: position, was_mm: was };
    let edit = EditTarget::read(session)?.add_edit(&who.by, &who.reason, change)?;
    Ok(ContactCorrection { number, position, was, edit })
}
