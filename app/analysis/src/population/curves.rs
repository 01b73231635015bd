//! The records of a study, read and worked on by several threads.

use super::PopulationError;
use crate::fit::{FitRecipe, settled};
use crate::pool::{WorkEvent, WorkFailure, in_order};
use crate::progress::Progress;
use crate::source::{self, SourceError};
use crate::study_table::{StudyRow, StudyTable};
use palpate_population::CurveEvidence;
use palpate_rheology::fit::{
    CurveLikelihood, FitError, FitOptions, FitSample, FitSolution, LikelihoodExpansion, Signal,
    SignalRecord,
};
use palpate_tables::lake::{LakeSession, is_lake, list_sessions, read_session};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// The record of one session.
pub(super) struct Curve {
    pub samples: Vec<FitSample>,
    signal: Option<Signal>,
}

impl Curve {
    /// Greatest depth in mm.
    pub fn depth_max_mm(&self) -> f64 {
        self.samples.iter().map(|sample| sample.depth.0).fold(0.0, f64::max)
    }

    pub fn record(&self) -> SignalRecord<'_> {
        SignalRecord { name: "the record", samples: &self.samples, signal: self.signal.as_ref() }
    }
}

/// Threads that work on one session each, and who hears of it.
pub(super) struct Workers<'a> {
    pub jobs: usize,
    pub progress: &'a dyn Progress,
}

impl Workers<'_> {
    /// Does `work` on all pieces, the answers in their order.
    pub fn all<T: Sync, R: Send>(
        &self,
        what: &str,
        pieces: &[T],
        work: impl Fn(&T) -> R + Sync,
    ) -> Result<Vec<R>, PopulationError> {
        let is_ending = AtomicBool::new(false);
        let mut answers = Vec::with_capacity(pieces.len());
        in_order(self.jobs, pieces, &is_ending, work, |event| match event {
            WorkEvent::Done(count) => {
                if self.progress.report(count, pieces.len(), what).is_break() {
                    is_ending.store(true, Ordering::Relaxed);
                }
            }
            WorkEvent::Next(answer) => answers.push(answer),
        })
        .map_err(PopulationError::Threads)?;
        let answers = answers.into_iter().map(|answer| {
            answer.map_err(|failure| match failure {
                WorkFailure::NotBegun => PopulationError::Ended,
                WorkFailure::Died => PopulationError::Died,
            })
        });
        answers.collect()
    }
}

pub(super) fn curve_evidence(found: LikelihoodExpansion) -> CurveEvidence {
    CurveEvidence::of_rows(found.centre, &found.covariance)
}

/// The record of every row of the table, or why it has none.
pub(super) fn read_curves(
    paths: &[PathBuf],
    recipe: &FitRecipe,
    table: &StudyTable,
    workers: &Workers<'_>,
) -> Result<Vec<Result<Curve, String>>, PopulationError> {
    let lake = match paths {
        [lake] if is_lake(lake) => {
            let sessions = list_sessions(lake)?.into_iter().map(|one| (one.id.clone(), one));
            Some((lake.as_path(), sessions.collect::<BTreeMap<_, _>>()))
        }
        _ => None,
    };
    workers.all("sessions", &table.rows, |row| read_curve(recipe, lake.as_ref(), row))
}

fn read_curve(
    recipe: &FitRecipe,
    lake: Option<&(&Path, BTreeMap<String, LakeSession>)>,
    row: &StudyRow,
) -> Result<Curve, String> {
    let words = |err: SourceError| err.to_string();
    let mut read = match lake {
        None => source::read_analysed(Path::new(&row.session), None, recipe.selection, None)
            .map_err(words)?,
        Some((lake, sessions)) => {
            let found = sessions.get(&row.session).ok_or("it is no longer in the lake")?;
            let (session, _) = read_session(lake, found).map_err(|err| err.to_string())?;
            source::of_session(session, recipe.selection.stretch, &[]).map_err(words)?
        }
    };
    recipe.corrections.apply(&mut read).map_err(|err| err.to_string())?;
    let read = settled(read, &recipe.options);
    Ok(Curve { samples: read.samples, signal: read.signal })
}

/// Logarithms of some parameters where each record fits best, or why there are none.
pub(super) fn best_values(
    names: &[String],
    options: &FitOptions,
    curves: &[Curve],
    workers: &Workers<'_>,
) -> Result<Vec<Result<Vec<f64>, String>>, PopulationError> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    workers.all("fits", curves, |curve| {
        let words = |err: FitError| err.to_string();
        let fit = FitSolution::fit_signals(&[curve.record()], options, &[]).map_err(words)?;
        let likelihood = CurveLikelihood::of(&fit, 0, &names).map_err(words)?;
        Ok(likelihood.best().to_vec())
    })
}
