//! Records beside a session: each is added, none is ever written over.

use super::super::edits::Subject;
use super::{Done, FitWanted, step};
use crate::analysed::{self, record};
use crate::edited;
use crate::progress::Progress;
use crate::report::kept;
use palpate_model::calibration::Calibration;
use palpate_model::units::Position;
use palpate_sessions::analyses::{Analysed, Analyses, Input, add_analysis, inputs_of};
use palpate_sessions::calibrations::read_calibration;
use palpate_sessions::edits::{Change, Verdict};
use palpate_sessions::log::Summary;
use std::path::{Path, PathBuf};

/// Who does it, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Who {
    /// By name.
    pub by: String,
    /// In a few words; some deeds need it.
    pub reason: String,
}

/// What is done to a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    /// A fit is made and kept.
    Fit {
        /// What it is called.
        name: String,
        /// How.
        how: FitWanted,
    },
    /// Forces are made anew.
    Recalibrate {
        /// What it is called.
        name: String,
        /// With this calibration.
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
        /// Which.
        name: String,
    },
    /// The session is worth that.
    Judge(Verdict),
    /// Contact was elsewhere.
    Correct {
        /// Which of the contacts, from 1.
        number: u32,
        /// From home.
        position: Position,
    },
}

impl Deed {
    /// Does it to a session and keeps the record, or says why not.
    pub fn run(self, session: &Path, who: &Who, progress: &Progress) -> Result<Done, String> {
        match self {
            Self::Fit { name, how } => fit(session, name, &how, who, progress),
            Self::Recalibrate { name, calibration } => {
                recalibrate(session, name, &calibration, who, progress)
            }
            Self::RecalibrateFrom { name, file } => {
                let calibration = read_calibration(&file).map_err(|err| err.to_string())?;
                recalibrate(session, name, &calibration, who, progress)
            }
            Self::Mask { name, left_out_s } => mask(session, name, left_out_s, who, progress),
            Self::Withdraw { name } => {
                let id = id_of(session)?;
                let what = Analysed::Withdrawal;
                keep(session, &id, &name, Vec::new(), what, who)?;
                Ok(Done {
                    sentence: format!("analysis '{name}' does not count any more"),
                    changed: Some(session.to_path_buf()),
                    is_edit: false,
                    made: None,
                })
            }
            Self::Judge(verdict) => {
                let change = Change::Verdict { verdict };
                let sentence = format!("the session is {verdict}");
                edit(session, change, who, sentence)
            }
            Self::Correct { number, position } => correct(session, number, position, who),
        }
    }
}

fn id_of(session: &Path) -> Result<String, String> {
    let summary = Summary::read(session).map_err(|err| err.to_string())?;
    Ok(summary.manifest.session_id)
}

/// Refuses before hours of work a name that is taken.
fn check_name(session: &Path, name: &str) -> Result<String, String> {
    let id = id_of(session)?;
    let there = Analyses::read(session, &id).map_err(|err| err.to_string())?;
    match there.all.iter().any(|one| one.name == name.trim()) {
        true => Err(format!(
            "the session has an analysis '{}' already, and a name is never used twice; choose another",
            name.trim()
        )),
        false => Ok(id),
    }
}

fn keep(
    session: &Path,
    id: &str,
    name: &str,
    inputs: Vec<Input>,
    what: Analysed,
    who: &Who,
) -> Result<(), String> {
    let analysis = record(name, &who.by, &who.reason, inputs, what);
    add_analysis(session, id, &analysis).map_err(|err| err.to_string())
}

fn made(session: &Path, name: &str, sentence: String) -> Done {
    Done {
        sentence: format!("kept as '{}': {sentence}", name.trim()),
        changed: Some(session.to_path_buf()),
        is_edit: false,
        made: Some(name.trim().to_owned()),
    }
}

fn fit(
    session: &Path,
    name: String,
    how: &FitWanted,
    who: &Who,
    progress: &Progress,
) -> Result<Done, String> {
    let id = check_name(session, &name)?;
    let results = how.results(session, progress)?;
    let based_on = how.based_on.as_deref();
    let opened = analysed::open(session, based_on).map_err(|err| err.to_string())?;
    let inputs = opened.inputs(session, based_on);
    let mut inputs = inputs.map_err(|err| err.to_string())?;
    for one in &how.together_with {
        let id = id_of(&one.session)?;
        let theirs = inputs_of(&one.session).map_err(|err| err.to_string())?;
        inputs.extend(theirs.into_iter().map(|file| Input {
            what: format!("{id}/{}", file.what),
            sha256: file.sha256,
        }));
    }
    let what = Analysed::Fit {
        based_on: how.based_on.clone(),
        settings: how.settings(),
        results,
    };
    let sentence = kept::deed(&what);
    keep(session, &id, &name, inputs, what, who)?;
    Ok(made(session, &name, sentence))
}

fn recalibrate(
    session: &Path,
    name: String,
    calibration: &Calibration,
    who: &Who,
    progress: &Progress,
) -> Result<Done, String> {
    let id = check_name(session, &name)?;
    step(progress, 0, 1, "making the forces anew")?;
    let found = analysed::recalibration(session, calibration).map_err(|err| err.to_string())?;
    let (_, inputs, what, change) = found;
    step(progress, 1, 1, "keeping it")?;
    keep(session, &id, &name, inputs, what, who)?;
    Ok(made(session, &name, kept::change(&change)))
}

fn mask(
    session: &Path,
    name: String,
    left_out_s: Vec<[f64; 2]>,
    who: &Who,
    progress: &Progress,
) -> Result<Done, String> {
    let id = check_name(session, &name)?;
    step(progress, 0, 1, "looking what is left out")?;
    let mut opened = analysed::open(session, None).map_err(|err| err.to_string())?;
    let inputs = opened.inputs(session, None);
    let inputs = inputs.map_err(|err| err.to_string())?;
    let forces = |opened: &analysed::Opened| {
        let rows = opened.edited.session.rows.iter();
        rows.filter(|row| row.force.is_some()).count()
    };
    let before = forces(&opened);
    opened.left_out_s.clone_from(&left_out_s);
    opened.blank();
    let left_out = before - forces(&opened);
    if left_out == 0 {
        return Err(
            "the session has no force in this stretch, so nothing would be left out; choose another".into(),
        );
    }
    step(progress, 1, 1, "keeping it")?;
    let what = Analysed::Mask { left_out_s };
    keep(session, &id, &name, inputs, what, who)?;
    let sentence = format!("{left_out} of {before} forces are left out");
    Ok(made(session, &name, sentence))
}

fn edit(session: &Path, change: Change, who: &Who, sentence: String) -> Result<Done, String> {
    let subject = Subject::read(session).map_err(|err| err.to_string())?;
    let edit = subject.say(&who.by, &who.reason, change);
    edit.map_err(|err| err.to_string())?;
    Ok(Done {
        sentence,
        changed: Some(session.to_path_buf()),
        is_edit: true,
        made: None,
    })
}

fn correct(session: &Path, number: u32, position: Position, who: &Who) -> Result<Done, String> {
    let outline = edited::outline(session).map_err(|err| err.to_string())?;
    let (outline, found) = (&outline.outline, edited::contacts(&outline.outline.entries));
    let index = (number as usize).checked_sub(1);
    let Some(was) = index.and_then(|index| found.get(index)) else {
        return Err(format!(
            "there is no contact {number}; the session found {}",
            found.len()
        ));
    };
    // A session that found a contact has a rig.
    let travel = outline.manifest.rig.as_ref().map(|rig| rig.travel);
    let travel = travel.unwrap_or(Position(0.0));
    if !(0.0..=travel.0).contains(&position.0) {
        return Err(format!(
            "contact at {position} is outside the rig's travel of {travel}; give the position from home"
        ));
    }
    let change = Change::Contact {
        number,
        position_mm: position,
        was_mm: was.position,
    };
    let deeper = was.position.depth_from(position).0;
    let sentence = format!(
        "contact {number} at {:.3} mm instead of {:.3} mm; its depths change by {deeper:+.3} mm",
        position.0, was.position.0
    );
    edit(session, change, who, sentence)
}
