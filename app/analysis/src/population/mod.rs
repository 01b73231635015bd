//! From the sessions of a study to the population that their specimens come from.

mod design;
mod report;

pub use design::{Design, DesignError};
pub use report::{EffectRow, LevelRow, PopulationReport, SpreadRow};

use crate::fit::{FitRecipe, SourceFit};
use crate::pool::{WorkEvent, WorkFailure, in_order};
use crate::progress::Progress;
use crate::source::{self, SourceError};
use crate::study_table::{StudyReadError, StudyRow, StudyTable, read_study};
use palpate_population::{
    CurveEvidence, Evidence, PopulationOptions, Study, StudyError, StudySession, SymmetricMatrix,
    fit_curves, fit_population,
};
use palpate_rheology::fit::{
    CurveLikelihood, FitError, FitSample, FitSolution, LikelihoodExpansion, Signal, SignalRecord,
};
use palpate_tables::lake::{LakeError, LakeSession, is_lake, list_sessions, read_session};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use thiserror::Error;

/// How sessions enter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PopulationMethod {
    /// Each with the likelihood of its curve, around what the population says of it.
    #[default]
    Curves,
    /// Each with the values that fit it best and their covariance.
    TwoStage,
}

#[derive(Debug)]
pub struct PopulationRequest<'a> {
    /// Sessions and folders of sessions, or one lake.
    pub paths: &'a [PathBuf],
    pub recipe: &'a FitRecipe,
    /// Names of parameters of the body; without any, all of them.
    pub parameters: &'a [String],
    /// Levels of the nesting, the outermost first; without any, all that the sessions can tell apart.
    pub levels: &'a [String],
    /// Entries of sessions that may move the mean.
    pub effects: &'a [String],
    pub is_correlated: bool,
    pub method: PopulationMethod,
    /// Number of sessions fitted at a time.
    pub jobs: usize,
}

#[derive(Debug, Error)]
pub enum PopulationError {
    #[error(transparent)]
    Read(#[from] StudyReadError),
    #[error(transparent)]
    Design(#[from] DesignError),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error(transparent)]
    Lake(#[from] LakeError),
    #[error("no session could be fitted; the first reason is {reason}")]
    NothingFitted { reason: String },
    #[error(transparent)]
    Parameter(FitError),
    #[error("{session}: {reason}")]
    InSession { session: String, reason: FitError },
    #[error("no thread can be started ({0}); try again")]
    Threads(io::Error),
    #[error("the population was not found, because the command was interrupted")]
    Ended,
}

/// The record of one session of the table.
struct Curve {
    row: usize,
    samples: Vec<FitSample>,
    signal: Option<Signal>,
}

/// The sessions that could be fitted, and the reasons of the others.
struct StudyCurves {
    curves: Vec<Curve>,
    not_fitted: BTreeMap<String, String>,
}

/// Finds the population. `progress` hears of fitted sessions.
pub fn population(
    request: &PopulationRequest<'_>,
    progress: &dyn Progress,
) -> Result<PopulationReport, PopulationError> {
    let names = parameter_names(request)?;
    let table = read_study(request.paths)?;
    let design = Design::of(&table, request.levels, request.effects)?;
    let StudyCurves { curves, not_fitted } = read_curves(request, &table, progress)?;
    let kept: Vec<usize> = curves.iter().map(|curve| curve.row).collect();
    let records = curves.iter().map(|curve| SignalRecord {
        name: "the record",
        samples: &curve.samples,
        signal: curve.signal.as_ref(),
    });
    let records: Vec<SignalRecord<'_>> = records.collect();
    let solutions = records
        .iter()
        .map(|record| FitSolution::fit_signals(&[*record], &request.recipe.options, &[]));
    let in_session = |place: usize| {
        let session = table.rows[kept[place]].session.clone();
        |reason: FitError| PopulationError::InSession { session, reason }
    };
    let solutions = solutions.enumerate().map(|(place, one)| one.map_err(in_session(place)));
    let solutions = solutions.collect::<Result<Vec<_>, _>>()?;
    let wanted: Vec<&str> = names.iter().map(String::as_str).collect();
    let likelihoods = solutions
        .iter()
        .enumerate()
        .map(|(place, one)| CurveLikelihood::of(one, 0, &wanted).map_err(in_session(place)));
    let mut likelihoods = likelihoods.collect::<Result<Vec<_>, _>>()?;
    let study = study(&names, &design, &table.rows, &kept, &mut likelihoods);
    let options =
        PopulationOptions { is_correlated: request.is_correlated, has_spread_intervals: true };
    let (fit, rounds) = match request.method {
        PopulationMethod::TwoStage => (fit_population(&study, options)?, None),
        PopulationMethod::Curves => {
            let found = fit_curves(
                study,
                options,
                |index, at| likelihoods[index].expand(at).map(|told| evidence(&told)),
                |_| (),
            )?;
            (found.fit, Some((found.rounds, found.is_converged)))
        }
    };
    Ok(PopulationReport {
        model: request.recipe.options.family().key(),
        method: request.method,
        rounds: rounds.map(|(rounds, _)| rounds),
        sessions: kept.len(),
        levels: LevelRow::all(&design, &table.rows, &kept),
        effects: fit.effects.iter().map(EffectRow::of).collect(),
        spreads: fit.spreads.iter().map(SpreadRow::of).collect(),
        groups: fit.groups,
        not_fitted,
        notes: notes(&design, &table, rounds),
    })
}

fn notes(design: &Design, table: &StudyTable, rounds: Option<(usize, bool)>) -> Vec<String> {
    let mut notes = design.notes.clone();
    if !table.left_out.is_empty() {
        let count = table.left_out.len();
        notes.push(format!("{count} sessions are rejected or press no specimen, and are left out"));
    }
    if let Some((rounds, false)) = rounds {
        notes.push(format!(
            "the curves still moved the population after {rounds} rounds; compare with --two-stage"
        ));
    }
    notes
}

fn parameter_names(request: &PopulationRequest<'_>) -> Result<Vec<String>, PopulationError> {
    let known = request.recipe.options.body_names();
    if request.parameters.is_empty() {
        return Ok(known.into_iter().map(str::to_owned).collect());
    }
    for name in request.parameters {
        if !known.contains(&name.as_str()) {
            let (name, known) = (name.clone(), known.join(", "));
            return Err(PopulationError::Parameter(FitError::UnknownParameter { name, known }));
        }
    }
    Ok(request.parameters.to_vec())
}

fn evidence(told: &LikelihoodExpansion) -> CurveEvidence {
    let count = told.centre.len();
    let covariance = SymmetricMatrix::from_fn(count, count, |row, column| {
        0.5 * (told.covariance[row][column] + told.covariance[column][row])
    });
    CurveEvidence { centre: told.centre.clone(), covariance }
}

fn study(
    names: &[String],
    design: &Design,
    rows: &[StudyRow],
    kept: &[usize],
    likelihoods: &mut [CurveLikelihood<'_, '_>],
) -> Study {
    let sessions = kept.iter().zip(likelihoods).map(|(&row, likelihood)| {
        let best = likelihood.best().to_vec();
        let told = likelihood.expand(&best).map(|told| evidence(&told));
        // A curve that tells nothing of the parameters at its best fit stays in the study without a say.
        let told = told.and_then(|told| Some((told.centre, told.covariance.try_inverse()?)));
        let (values, information) =
            told.unwrap_or_else(|| (best, SymmetricMatrix::zeros(names.len(), names.len())));
        StudySession {
            groups: design.groups(&rows[row]),
            design: design.columns(&rows[row]),
            values,
            evidence: Evidence::Information(information),
        }
    });
    Study {
        parameters: names.to_vec(),
        effects: design.effects(),
        levels: design.levels(),
        sessions: sessions.collect(),
    }
}

/// Reads and fits all sessions; those that cannot be fitted are named with the reason.
fn read_curves(
    request: &PopulationRequest<'_>,
    table: &StudyTable,
    progress: &dyn Progress,
) -> Result<StudyCurves, PopulationError> {
    let lake = match request.paths {
        [lake] if is_lake(lake) => Some((lake.as_path(), list_sessions(lake)?)),
        _ => None,
    };
    let is_ending = AtomicBool::new(false);
    let (mut curves, mut not_fitted) = (Vec::new(), BTreeMap::new());
    let rows: Vec<usize> = (0..table.rows.len()).collect();
    let mut names = table.rows.iter().map(|row| row.session.clone());
    let one = |row: &usize| {
        let (samples, signal) = read_curve(request.recipe, lake.as_ref(), &table.rows[*row])?;
        Ok::<_, String>(Curve { row: *row, samples, signal })
    };
    in_order(request.jobs, &rows, &is_ending, one, |event| match event {
        WorkEvent::Done(count) => {
            if progress.report(count, table.rows.len(), "").is_break() {
                is_ending.store(true, Ordering::Relaxed);
            }
        }
        WorkEvent::Next(answer) => {
            let session = names.next().unwrap_or_default();
            match answer {
                Ok(Ok(curve)) => curves.push(curve),
                Ok(Err(reason)) => drop(not_fitted.insert(session, reason)),
                Err(WorkFailure::NotBegun) => {}
                Err(WorkFailure::Died) => {
                    let reason = "the fit ended unexpectedly; report this with the session";
                    not_fitted.insert(session, reason.to_owned());
                }
            }
        }
    })
    .map_err(PopulationError::Threads)?;
    if is_ending.load(Ordering::Relaxed) {
        return Err(PopulationError::Ended);
    }
    if let (true, Some((session, reason))) = (curves.is_empty(), not_fitted.first_key_value()) {
        return Err(PopulationError::NothingFitted { reason: format!("{session}: {reason}") });
    }
    Ok(StudyCurves { curves, not_fitted })
}

fn read_curve(
    recipe: &FitRecipe,
    lake: Option<&(&Path, Vec<LakeSession>)>,
    row: &StudyRow,
) -> Result<(Vec<FitSample>, Option<Signal>), String> {
    let words = |err: SourceError| err.to_string();
    let fitted: SourceFit = match lake {
        None => recipe.fit(Path::new(&row.session)).map_err(words)?,
        Some((lake, sessions)) => {
            let found = sessions.iter().find(|one| one.id == row.session);
            let found = found.ok_or("it is no longer in the lake")?;
            let (session, _) = read_session(lake, found).map_err(|err| err.to_string())?;
            let read = source::of_session(session, recipe.selection.stretch, &[]).map_err(words)?;
            recipe.fit_read(read).map_err(words)?
        }
    };
    fitted.result.map_err(|err| err.to_string())?;
    Ok((fitted.samples, fitted.signal))
}
