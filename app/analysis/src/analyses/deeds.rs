//! Records beside a session: each is added, none is ever written over.

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
use palpate_sessions::calibrations::read_calibration;
use palpate_sessions::edits::{Change, Edit, Verdict};
use palpate_sessions::log::{ReadError, Summary};
use palpate_sessions::shelf::LibraryError;
use serde_json::Value;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Nothing was written beside a session.
#[derive(Debug, Error)]
pub enum DeedFailure {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Say(#[from] SayFailure),
    #[error(transparent)]
    Calibration(#[from] LibraryError),
    #[error("the session has no force in these stretches, so nothing would be left out")]
    NothingLeftOut,
    #[error(
        "the session found no contact, so no depth counts from one; there is nothing to correct"
    )]
    NoContact,
    #[error("the session found contact {0} times; say which")]
    WhichContact(usize),
    #[error("there is no contact {number}; the session found {found}")]
    NoSuchContact {
        number: u32,
        found: usize,
    },
    #[error(
        "contact at {position} is outside the rig's travel of {travel}; give the position from home"
    )]
    OutsideTravel {
        position: Position,
        travel: Position,
    },
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

/// Who does it, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Who {
    pub by: String,
    /// In a few words; some deeds need it.
    pub reason: String,
}

/// What is done to a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    Fit {
        /// What it is called.
        name: String,
        how: FitWanted,
    },
    /// Forces are made anew.
    Recalibrate {
        /// What it is called.
        name: String,
        calibration: Box<Calibration>,
    },
    /// The same with the calibration of a file.
    RecalibrateFrom {
        /// What it is called.
        name: String,
        /// A calibration's document.
        file: PathBuf,
    },
    /// Forces in stretches of time do not count.
    Mask {
        /// What it is called.
        name: String,
        /// From and to in s since the first sample.
        left_out_s: Vec<[f64; 2]>,
    },
    /// An analysis does not count any more.
    Withdraw {
        name: String,
    },
    /// The session is worth that.
    Judge(Verdict),
    /// Contact was elsewhere.
    Correct {
        /// Which of the contacts, from 1.
        number: u32,
        position: Position,
    },
}

impl Deed {
    /// Does it to a session and keeps the record, or says why not.
    pub fn run(
        self,
        session: &Path,
        who: &Who,
        progress: &dyn Progress,
    ) -> Result<Done, DeedFailure> {
        match self {
            Self::Fit { name, how } => fit(session, &name, &how, who, progress),
            Self::Recalibrate { name, calibration } => {
                recalibrated(session, &name, &calibration, who, progress)
            }
            Self::RecalibrateFrom { name, file } => {
                let calibration = read_calibration(&file)?;
                recalibrated(session, &name, &calibration, who, progress)
            }
            Self::Mask { name, left_out_s } => {
                let masked = mask(session, &name, left_out_s, who, progress)?;
                let (left_out, before) = (masked.left_out, masked.of);
                let sentence = format!("{left_out} of {before} forces are left out");
                Ok(made(session, &name, sentence))
            }
            Self::Withdraw { name } => {
                withdraw(session, &name, who)?;
                let sentence = format!("analysis '{name}' does not count any more");
                Ok(done(session, sentence, Kind::Analysis))
            }
            Self::Judge(verdict) => {
                judge(session, verdict, who)?;
                let sentence = format!("the session is {verdict}");
                Ok(done(session, sentence, Kind::Edit))
            }
            Self::Correct { number, position } => {
                let corrected = correct(session, Some(number), position, who)?;
                Ok(done(session, corrected.sentence(), Kind::Edit))
            }
        }
    }
}

/// What was written beside a session.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Analysis,
    Edit,
}

fn done(session: &Path, sentence: String, kind: Kind) -> Done {
    Done { sentence, changed: Some(session.to_path_buf()), is_edit: kind == Kind::Edit, made: None }
}

fn made(session: &Path, name: &str, sentence: String) -> Done {
    let name = name.trim();
    Done {
        made: Some(name.to_owned()),
        ..done(session, format!("kept as '{name}': {sentence}"), Kind::Analysis)
    }
}

fn id_of(session: &Path) -> Result<String, ReadError> {
    Ok(Summary::read(session)?.manifest.session_id)
}

/// Refuses before hours of work a name that is taken.
fn check_name(session: &Path, name: &str) -> Result<String, DeedFailure> {
    let (id, name) = (id_of(session)?, name.trim());
    let there = Analyses::read(session, &id)?;
    if there.all.iter().any(|one| one.name == name) {
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
) -> Result<Done, DeedFailure> {
    check_name(session, name)?;
    let results = how.results(session, progress).map_err(DeedFailure::Fit)?;
    let fit = KeptFit {
        based_on: how.based_on.as_deref(),
        together_with: &how.together_with,
        settings: how.settings(),
        results,
    };
    let analysis = keep_fit(session, name, fit, who)?;
    Ok(made(session, name, kept::deed(&analysis.what)))
}

#[derive(Clone, Debug)]
pub struct KeptFit<'a> {
    /// The analysis that the session was read by.
    pub based_on: Option<&'a str>,
    /// Sessions fitted together with it.
    pub together_with: &'a [Wanted],
    /// How it was asked for.
    pub settings: Value,
    pub results: Value,
}

/// Keeps a fit of a session as an analysis beside it.
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
        let theirs = inputs_of(&one.session)?;
        inputs.extend(
            theirs
                .into_iter()
                .map(|file| Input { what: format!("{id}/{}", file.what), sha256: file.sha256 }),
        );
    }
    let what = Analysed::Fit {
        based_on: fit.based_on.map(str::to_owned),
        settings: fit.settings,
        results: fit.results,
    };
    let id = &opened.edited.session.manifest.session_id;
    keep(session, id, name, inputs, what, who)
}

/// What another calibration made of a session.
#[derive(Clone, Debug)]
pub struct Recalibrated {
    /// What it did to the forces.
    pub change: ForceChange,
    /// The session's rig; empty where there is none.
    pub rig: String,
}

/// Makes the forces of a session anew with another calibration, as an analysis beside it.
pub fn recalibrate(
    session: &Path,
    name: &str,
    calibration: &Calibration,
    who: &Who,
) -> Result<Recalibrated, DeedFailure> {
    let id = check_name(session, name)?;
    let (opened, inputs, what, change) = analysed::recalibration(session, calibration)?;
    keep(session, &id, name, inputs, what, who)?;
    let rig = opened.edited.session.manifest.rig;
    Ok(Recalibrated { change, rig: rig.map_or_else(String::new, |rig| rig.name) })
}

fn recalibrated(
    session: &Path,
    name: &str,
    calibration: &Calibration,
    who: &Who,
    progress: &dyn Progress,
) -> Result<Done, DeedFailure> {
    step(progress, 0, 1, "making the forces anew")?;
    let found = recalibrate(session, name, calibration, who)?;
    Ok(made(session, name, kept::change(&found.change)))
}

/// Forces that do not count any more.
#[derive(Clone, Debug)]
pub struct Masked {
    pub analysis: Analysis,
    /// Forces left out.
    pub left_out: usize,
    /// Forces there were.
    pub of: usize,
}

/// Leaves stretches of a session out, from and to in s since its first sample, as an analysis beside it.
pub fn mask(
    session: &Path,
    name: &str,
    left_out_s: Vec<[f64; 2]>,
    who: &Who,
    progress: &dyn Progress,
) -> Result<Masked, DeedFailure> {
    let id = check_name(session, name)?;
    step(progress, 0, 1, "looking what is left out")?;
    let mut opened = analysed::open(session, None)?;
    let inputs = opened.inputs(session, None)?;
    let forces = |opened: &analysed::Opened| {
        let rows = opened.edited.session.rows.iter();
        rows.filter(|row| row.force.is_some()).count()
    };
    let of = forces(&opened);
    opened.left_out_s.clone_from(&left_out_s);
    opened.blank();
    let left_out = of - forces(&opened);
    if left_out == 0 {
        return Err(DeedFailure::NothingLeftOut);
    }
    step(progress, 1, 1, "keeping it")?;
    let what = Analysed::Mask { left_out_s };
    Ok(Masked { analysis: keep(session, &id, name, inputs, what, who)?, left_out, of })
}

/// Lets an analysis count no more.
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

/// A contact that was found elsewhere.
#[derive(Clone, Debug)]
pub struct Corrected {
    /// Which of the contacts, from 1.
    pub number: u32,
    /// Where it really was, from home.
    pub position: Position,
    /// Where the session found it.
    pub was: Position,
    pub edit: Edit,
}

impl Corrected {
    /// By how much its depths are more, in mm.
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
) -> Result<Corrected, DeedFailure> {
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
    let travel = outline.manifest.rig.as_ref().map(|rig| rig.travel);
    let travel = travel.unwrap_or(Position(0.0));
    if !(0.0..=travel.0).contains(&position.0) {
        return Err(DeedFailure::OutsideTravel { position, travel });
    }
    let was = was.position;
    let change = Change::Contact { number, position_mm: position, was_mm: was };
    let edit = Subject::read(session)?.say(&who.by, &who.reason, change)?;
    Ok(Corrected { number, position, was, edit })
}
