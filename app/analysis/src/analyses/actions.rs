//! Actions that add a record beside a session. Records are never overwritten.

use super::super::edits::{SayFailure, Subject};
use super::{Done, FitWanted};
use crate::analysed::{self, ForceChange, record};
use crate::edited;
use crate::progress::Progress;
use crate::report::dossier::Wanted;
use crate::report::kept;
use crate::source::SourceError;
use palpate_model::calibration::Calibration;
use palpate_model::units::Position;
use palpate_sessions::analyses::{
    Analysed, Analyses, Analysis, AnalysisError, Input, add_analysis, inputs_of,
};
use palpate_sessions::{Change, Edit, LibraryError, ReadError, Summary, Verdict, read_calibration};
use serde_json::Value;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum DeedFailure {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Say(#[from] SayFailure),
    #[error(transparent)]
    Calibration(#[from] LibraryError),
    #[error("the session has no force in these intervals, so the mask would leave out nothing")]
    NothingLeftOut,
    #[error(
        "the session found no contact, so no depth counts from one; there is nothing to correct"
    )]
    NoContact,
    #[error("the session found contact {0} times; give the number of one")]
    WhichContact(usize),
    #[error("the session has no contact {number}; it found contact {found} times")]
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

impl From<AnalysisError> for DeedFailure {
    fn from(err: AnalysisError) -> Self {
        Self::Source(err.into())
    }
}

impl From<ReadError> for DeedFailure {
    fn from(err: ReadError) -> Self {
        Self::Source(err.into())
    }
}

/// Author of a record, and the reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Who {
    pub by: String,
    /// In a few words; some actions require it.
    pub reason: String,
}

/// An action on a session that adds a record beside it.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    Fit {
        name: String,
        how: FitWanted,
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
    Judge(Verdict),
    Correct {
        /// Number of the contact, from 1.
        number: u32,
        position: Position,
    },
}

impl Deed {
    /// Adds the record of this action to a session.
    pub fn run(
        self,
        session: &Path,
        who: &Who,
        progress: &dyn Progress,
    ) -> Result<Done, DeedFailure> {
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
                (kept::change(&found.change), Some(name), false)
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
            Self::Judge(verdict) => {
                judge(session, verdict, who)?;
                (format!("the session is {verdict}"), None, true)
            }
            Self::Correct { number, position } => {
                (correct(session, Some(number), position, who)?.sentence(), None, true)
            }
        };
        let made = name.map(|name| name.trim().to_owned());
        let sentence = match &made {
            Some(name) => format!("kept as '{name}': {sentence}"),
            None => sentence,
        };
        Ok(Done { sentence, changed: Some(session.to_path_buf()), is_edit, made })
    }
}

fn id_of(session: &Path) -> Result<String, ReadError> {
    Ok(Summary::read(session)?.manifest.session_id)
}

/// Refuses a taken name before hours of work.
fn check_name(session: &Path, name: &str) -> Result<String, DeedFailure> {
    let (id, name) = (id_of(session)?, name.trim());
    if Analyses::read(session, &id)?.all.iter().any(|one| one.name == name) {
        let name = name.to_owned();
        return Err(AnalysisError::Taken { name }.into());
    }
    Ok(id)
}

fn keep(
    session: &Path,
    id: &str,
    name: &str,
    inputs: Vec<Input>,
    what: Analysed,
    who: &Who,
) -> Result<Analysis, DeedFailure> {
    let analysis = record(name, &who.by, &who.reason, inputs, what);
    add_analysis(session, id, &analysis)?;
    Ok(analysis)
}

fn step(progress: &dyn Progress, done: usize, of: usize, what: &str) -> Result<(), DeedFailure> {
    super::step(progress, done, of, what).map_err(|_| DeedFailure::Cancelled)
}

fn fit(
    session: &Path,
    name: &str,
    how: &FitWanted,
    who: &Who,
    progress: &dyn Progress,
) -> Result<String, DeedFailure> {
    check_name(session, name)?;
    let results = how.results(session, progress).map_err(DeedFailure::Fit)?;
    let fit = KeptFit {
        based_on: how.based_on.as_deref(),
        together_with: &how.together_with,
        settings: how.settings(),
        results,
    };
    Ok(kept::deed(&keep_fit(session, name, fit, who)?.what))
}

#[derive(Clone, Debug)]
pub struct KeptFit<'a> {
    /// Analysis through which the session was read.
    pub based_on: Option<&'a str>,
    pub together_with: &'a [Wanted],
    pub settings: Value,
    pub results: Value,
}

/// Stores a fit of a session as an analysis beside it.
pub fn keep_fit(
    session: &Path,
    name: &str,
    fit: KeptFit<'_>,
    who: &Who,
) -> Result<Analysis, DeedFailure> {
    let opened = analysed::open(session, fit.based_on)?;
    let mut inputs = opened.inputs(session, fit.based_on)?;
    for one in fit.together_with {
        let id = id_of(&one.session)?;
        let theirs = inputs_of(&one.session)?.into_iter();
        inputs.extend(theirs.map(|file| Input { what: format!("{id}/{}", file.what), ..file }));
    }
    let what = Analysed::Fit {
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
    who: &Who,
) -> Result<RecalibrationResult, DeedFailure> {
    let id = check_name(session, name)?;
    let (opened, inputs, what, change) = analysed::recalibration(session, calibration)?;
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
    who: &Who,
    progress: &dyn Progress,
) -> Result<MaskResult, DeedFailure> {
    let id = check_name(session, name)?;
    step(progress, 0, 1, "applying the mask")?;
    let mut opened = analysed::open(session, None)?;
    let inputs = opened.inputs(session, None)?;
    let forces = |opened: &analysed::Opened| {
        opened.edited.session.rows.iter().filter(|row| row.force.is_some()).count()
    };
    let of = forces(&opened);
    opened.left_out_s.clone_from(&left_out_s);
    opened.blank();
    let left_out = of - forces(&opened);
    if left_out == 0 {
        return Err(DeedFailure::NothingLeftOut);
    }
    step(progress, 1, 1, "storing the analysis")?;
    let what = Analysed::Mask { left_out_s };
    Ok(MaskResult { analysis: keep(session, &id, name, inputs, what, who)?, left_out, of })
}

/// Withdraws an analysis: its record stays and does not count.
pub fn withdraw(session: &Path, name: &str, who: &Who) -> Result<Analysis, DeedFailure> {
    let id = id_of(session)?;
    keep(session, &id, name, Vec::new(), Analysed::Withdrawal, who)
}

/// Says what a session is worth; the verdict before, and the edit.
pub fn judge(
    session: &Path,
    verdict: Verdict,
    who: &Who,
) -> Result<(Option<Verdict>, Edit), DeedFailure> {
    let subject = Subject::read(session)?;
    let was = subject.edits.verdict().map(|(verdict, _)| verdict);
    let edit = subject.say(&who.by, &who.reason, Change::Verdict { verdict })?;
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
pub fn correct(
    session: &Path,
    number: Option<u32>,
    position: Position,
    who: &Who,
) -> Result<ContactCorrection, DeedFailure> {
    let passing = edited::outline(session)?;
    let outline = &passing.outline;
    let found = edited::contacts(&outline.entries);
    let number = match (number, found.len()) {
        (_, 0) => return Err(DeedFailure::NoContact),
        (Some(number), _) => number,
        (None, 1) => 1,
        (None, several) => return Err(DeedFailure::WhichContact(several)),
    };
    let index = (number as usize).checked_sub(1);
    let Some(was) = index.and_then(|index| found.get(index)) else {
        let found = found.len();
        return Err(DeedFailure::NoSuchContact { number, found });
    };
    // A session that found a contact has a rig.
    let travel = outline.manifest.rig.as_ref().map(|rig| rig.travel).unwrap_or(Position(0.0));
    if !(0.0..=travel.0).contains(&position.0) {
        return Err(DeedFailure::OutsideTravel { position, travel });
    }
    let was = was.position;
    let change = Change::Contact { number, position_mm: position, was_mm: was };
    let edit = Subject::read(session)?.say(&who.by, &who.reason, change)?;
    Ok(ContactCorrection { number, position, was, edit })
}
