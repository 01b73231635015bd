//! From the sessions of a study to the population that their specimens come from.

mod agreement;
mod curves;
mod design;
mod figures;
mod member;
mod questions;
mod report;
mod results;
mod saved;
mod specimens;
mod stored;

pub use agreement::{
    AgreementFailure, AgreementReport, AgreementRequest, ParameterAgreement, PlaceDifference,
    agreements,
};
use design::MEAN_AT;
pub use design::{Design, DesignError};
pub use figures::PopulationFigure;
pub use member::{MemberError, PopulationMember, draw_member, library_member};
pub use palpate_sessions::populations::is_member;
pub use questions::{ComparisonRow, InfluenceReport, PlanReport};
pub use report::{DeviationRow, EffectRow, LevelRow, Outlying, ParameterLines, PopulationReport};
pub use results::{paragraph, write_results};
pub use saved::{PopulationOrigin, SavePopulationError, check_new_name, save_population};
pub use specimens::{CurveKind, PopulationCurves};

use crate::compliance::ComplianceCorrections;
use crate::fit::{FitChoice, FitChoiceError, FitRecipe, StoredFitError};
use crate::progress::Progress;
use crate::source::{RecordStretch, SourceSelection};
use crate::study_table::{StudyReadError, StudyRow, StudyTable, left_out_words, read_study};
use curves::{Curve, Workers, curve_evidence, read_curves};
use palpate_population::{
    CurveRounds, PopulationFit, PopulationOptions, Study, StudyError, StudySession, expand_curves,
    fit_population,
};
use palpate_rheology::fit::{
    CurveLikelihood, FitError, FitOptions, FitSolution, LikelihoodExpansion, SignalRecord,
};
use palpate_tables::lake::LakeError;
use serde::{Serialize, Serializer};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::PathBuf;
use stored::read_stored;
use thiserror::Error;

/// How sessions enter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PopulationMethod {
    /// Each with the likelihood of its curve, around what the population says of it.
    #[default]
    Curves,
    /// Each with the values that fit it best and their covariance.
    TwoStage,
    /// The same, as the fits of a lake stored them: no curve is read.
    Stored,
}

impl PopulationMethod {
    /// As files and machines name it.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Curves => "curves",
            Self::TwoStage => "two-stage",
            Self::Stored => "stored",
        }
    }
}

impl Serialize for PopulationMethod {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.key())
    }
}

/// How the sessions of a study are fitted: their loading and hold, by a family, or without one by the modified Kelvin model.
pub fn study_recipe(
    family: Option<String>,
    corrections: ComplianceCorrections,
) -> Result<FitRecipe, FitChoiceError> {
    let choice = FitChoice { family, fixed: Vec::new(), free: Vec::new() };
    let stretch = RecordStretch::with_unload(false);
    let selection = SourceSelection { stretch, is_rejected_included: false };
    let recipe = FitRecipe::new(choice.options()?, selection);
    Ok(FitRecipe { is_systematic: false, corrections, ..recipe })
}

#[derive(Debug)]
pub struct PopulationRequest<'a> {
    /// Sessions and folders of sessions, or one lake.
    pub paths: &'a [PathBuf],
    pub recipe: &'a FitRecipe,
    /// Names of parameters of the model; without any, all of them.
    pub parameters: &'a [String],
    /// Levels of the nesting, the outermost first; without any, all that the sessions can separate.
    pub levels: &'a [String],
    /// Entries of sessions that may move the mean.
    pub effects: &'a [String],
    pub method: PopulationMethod,
    /// Whether each group is left out in turn.
    pub is_influence_wanted: bool,
    /// Whether curves for figures are kept, where the population has all parameters of the model.
    pub is_drawn: bool,
    /// Percent by which no end of an interval may be off, for which sizes of a study are looked at.
    pub wanted_percent: Option<f64>,
    /// Number of sessions fitted at a time.
    pub jobs: usize,
}

#[derive(Debug, Error)]
pub enum PopulationError {
    #[error(transparent)]
    Read(#[from] StudyReadError),
    #[error(transparent)]
    Design(#[from] DesignError),
    #[error("{reason}; {first}, which was not fitted: {why}")]
    Fitted { reason: DesignError, first: String, why: String },
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error(transparent)]
    Lake(#[from] LakeError),
    #[error("no session could be fitted; the first reason is {reason}")]
    NothingFitted { reason: String },
    #[error(transparent)]
    Parameter(FitError),
    #[error("{name} is given twice as a parameter; give it once")]
    ParameterTwice { name: String },
    #[error("{session}: {reason}")]
    InSession { session: String, reason: String },
    #[error(transparent)]
    Stored(#[from] StoredFitError),
    #[error("no thread can be started ({0}); try again")]
    Threads(io::Error),
    #[error("the population was not found, because the command was interrupted")]
    Ended,
    #[error("the work on a session ended unexpectedly; report this with the sessions")]
    Died,
}

/// A population, and what it was found from.
#[derive(Clone, Debug)]
pub struct Population {
    pub report: PopulationReport,
    /// What each session says at the end.
    pub study: Study,
    pub fit: PopulationFit,
    /// Where they are wanted and all parameters of the model are in the population.
    pub curves: Option<PopulationCurves>,
    /// None of stored fits, which know no depths.
    pub origin: Option<PopulationOrigin>,
}

impl Population {
    #[must_use]
    pub fn figures(&self) -> Vec<PopulationFigure> {
        figures::figures(&self.report, &self.fit, self.curves.as_ref())
    }
}

/// Finds the population. `progress` hears of sessions that were read, fitted and expanded.
pub fn population(
    request: &PopulationRequest<'_>,
    progress: &dyn Progress,
) -> Result<Population, PopulationError> {
    let names = parameter_names(&request.recipe.options, request.parameters)?;
    let mut table = read_study(request.paths)?;
    // What is wrong with it is said before the sessions are fitted.
    Design::of(&table, request.levels, request.effects)?;
    let workers = Workers { jobs: request.jobs, progress };
    let mut not_fitted = BTreeMap::new();
    let options = &request.recipe.options;
    if request.method == PopulationMethod::Stored {
        let stored = read_stored(request, &table, &workers)?;
        let stored = keep(&mut table, stored, &mut not_fitted)?;
        let design = design_of_fitted(request, &table, &not_fitted)?;
        let best = stored.iter().map(|one| one.of_parameters(&names));
        let study = study(&names, &design, &table, best)?;
        let found = StudyFound { design, study, rounds: None, table, not_fitted };
        return found.population(request, &workers, |_, _| (None, None));
    }
    let curves = read_curves(request.paths, request.recipe, &table, &workers)?;
    let curves = keep(&mut table, curves, &mut not_fitted)?;
    let records: Vec<SignalRecord<'_>> = curves.iter().map(Curve::record).collect();
    let fits = workers.all("fits", &records, |record| {
        FitSolution::fit_signals(&[*record], options, &[]).map_err(|err| err.to_string())
    })?;
    let fitted = curves.iter().zip(&fits).filter(|(_, fit)| fit.is_ok());
    let fitted: Vec<&Curve> = fitted.map(|(curve, _)| curve).collect();
    let fits = keep(&mut table, fits, &mut not_fitted)?;
    let likelihoods = likelihoods(&names, &table, &fits)?;
    let design = design_of_fitted(request, &table, &not_fitted)?;
    let best =
        likelihoods.iter().map(|one| one.expand_at_best().ok_or_else(|| inseparable(&names)));
    let mut study = study(&names, &design, &table, best)?;
    let expand = |modes: &[Vec<f64>]| {
        let pieces: Vec<_> = likelihoods.iter().zip(modes).collect();
        workers.all("curves", &pieces, |(likelihood, mode)| {
            likelihood.expand(mode).map(curve_evidence)
        })
    };
    let is_of_curves = request.method == PopulationMethod::Curves;
    let rounds = is_of_curves.then(|| expand_curves(&mut study, expand)).transpose()?;
    let found = StudyFound { design, study, rounds, table, not_fitted };
    // A specimen is drawn whole or not at all.
    let is_drawn = request.is_drawn && names.len() == options.body_names().len();
    found.population(request, &workers, |found, fit| {
        let StudyFound { design, study, table, .. } = found;
        let reports = || fits.iter().map(FitSolution::report).collect::<Vec<_>>();
        let curves = is_drawn
            .then(|| specimens::curves(design, &table.rows, &fitted, &reports(), (study, fit)));
        let known = fits.first().map(FitSolution::report).unwrap_or_default().parameters;
        let specimen = &known[..known.len().min(options.body_names().len())];
        let origin = PopulationOrigin::of(design, table, (specimen, &names), &fitted, &fits);
        (curves.flatten(), Some(origin))
    })
}

/// The design of the sessions that were fitted. Where the others are missed, a refusal says why they were not.
fn design_of_fitted(
    request: &PopulationRequest<'_>,
    table: &StudyTable,
    not_fitted: &BTreeMap<String, String>,
) -> Result<Design, PopulationError> {
    let design = Design::of(table, request.levels, request.effects);
    design.map_err(|reason| match not_fitted.first_key_value() {
        None => reason.into(),
        Some((first, why)) => {
            PopulationError::Fitted { reason, first: format!("without {first}"), why: why.clone() }
        }
    })
}

/// The sessions of a study, and what they say.
struct StudyFound {
    design: Design,
    study: Study,
    rounds: Option<CurveRounds>,
    table: StudyTable,
    not_fitted: BTreeMap<String, String>,
}

impl StudyFound {
    fn population(
        self,
        request: &PopulationRequest<'_>,
        workers: &Workers<'_>,
        of_curves: impl FnOnce(
            &Self,
            &PopulationFit,
        ) -> (Option<PopulationCurves>, Option<PopulationOrigin>),
    ) -> Result<Population, PopulationError> {
        let (study, options) = (&self.study, &request.recipe.options);
        let contrasts = questions::contrasts(&self.design);
        let wanted = PopulationOptions { has_deviation_intervals: true, contrasts };
        let fit = fit_population(study, &wanted)?;
        let influence = request.is_influence_wanted;
        let influence = influence.then(|| questions::influences(study, &fit, workers));
        let plan = request.wanted_percent;
        let plan = plan.map(|wanted| questions::plan(study, &fit, wanted, workers)).transpose()?;
        let unit = |name: &str| options.unit(name).map(str::to_owned);
        let effect = |one| EffectRow::of(one, unit(&one.parameter), &fit);
        let (curves, origin) = of_curves(&self, &fit);
        let report = PopulationReport {
            model: options.family().key(),
            method: request.method,
            rounds: self.rounds.map(|one| one.rounds),
            sessions: study.sessions.len(),
            levels: LevelRow::all(study),
            effects: fit.effects.iter().map(effect).collect(),
            comparisons: questions::comparisons(&self.design, study, &fit),
            standard_deviations: DeviationRow::all(&fit),
            groups: fit.groups.clone(),
            outlying: Outlying::all(study, &fit),
            influence: influence.transpose()?,
            plan,
            not_fitted: self.not_fitted,
            notes: notes(&self.design, &self.table, self.rounds, fit.is_bounded),
        };
        Ok(Population { report, study: self.study, fit, curves, origin })
    }
}

/// The results of sessions that have one; the others leave the table with their reasons.
fn keep<T>(
    table: &mut StudyTable,
    results: Vec<Result<T, String>>,
    not_fitted: &mut BTreeMap<String, String>,
) -> Result<Vec<T>, PopulationError> {
    let rows = std::mem::take(&mut table.rows);
    let mut kept = Vec::new();
    for (row, result) in rows.into_iter().zip(results) {
        match result {
            Ok(result) => {
                kept.push(result);
                table.rows.push(row);
            }
            Err(reason) => drop(not_fitted.insert(row.session, reason)),
        }
    }
    match (kept.is_empty(), not_fitted.first_key_value()) {
        (true, Some((session, reason))) => {
            Err(PopulationError::NothingFitted { reason: format!("{session}: {reason}") })
        }
        _ => Ok(kept),
    }
}

fn notes(
    design: &Design,
    table: &StudyTable,
    rounds: Option<CurveRounds>,
    is_bounded: bool,
) -> Vec<String> {
    let mut notes = design.notes.clone();
    notes.extend(left_out_words(table.left_out.len()));
    if let Some(CurveRounds { rounds, is_converged: false }) = rounds {
        notes.push(format!(
            "the expansions of the curves still moved after {rounds} rounds; compare with the best values of the sessions"
        ));
    }
    if is_bounded {
        notes.push(
            "a standard deviation is zero, and intervals of means and effects take that as exact, which makes them too narrow"
                .to_owned(),
        );
    }
    notes
}

fn parameter_names(
    options: &FitOptions,
    parameters: &[String],
) -> Result<Vec<String>, PopulationError> {
    let known = options.body_names();
    if parameters.is_empty() {
        return Ok(known.into_iter().map(str::to_owned).collect());
    }
    let mut names = BTreeSet::new();
    for name in parameters {
        if !known.contains(&name.as_str()) {
            let (name, known) = (name.clone(), known.join(", "));
            return Err(PopulationError::Parameter(FitError::UnknownParameter { name, known }));
        }
        if !names.insert(name) {
            return Err(PopulationError::ParameterTwice { name: name.clone() });
        }
    }
    Ok(parameters.to_vec())
}

/// The likelihoods of all sessions. A parameter that has none in one of them is refused: without that session the
/// population would be another one.
fn likelihoods<'f, 'a>(
    names: &[String],
    table: &StudyTable,
    fits: &'f [FitSolution<'a>],
) -> Result<Vec<CurveLikelihood<'f, 'a>>, PopulationError> {
    let wanted: Vec<&str> = names.iter().map(String::as_str).collect();
    let each = fits.iter().zip(&table.rows).map(|(fit, row)| {
        CurveLikelihood::of(fit, 0, &wanted).map_err(|reason| in_session(row, reason))
    });
    each.collect()
}

/// The study of sessions with what each says of the parameters.
fn study(
    names: &[String],
    design: &Design,
    table: &StudyTable,
    best: impl Iterator<Item = Result<LikelihoodExpansion, String>>,
) -> Result<Study, PopulationError> {
    let sessions = table.rows.iter().zip(best).map(|(row, best)| {
        let best = curve_evidence(best.map_err(|reason| in_session(row, reason))?);
        let evidence = best.evidence().ok_or_else(|| in_session(row, inseparable(names)))?;
        Ok(StudySession {
            name: row.session.clone(),
            groups: design.groups(row),
            design: design.columns(row),
            values: best.centre,
            evidence,
        })
    });
    Ok(Study {
        parameters: names.to_vec(),
        effects: design.effects(),
        levels: design.levels(),
        sessions: sessions.collect::<Result<_, PopulationError>>()?,
    })
}

fn in_session(row: &StudyRow, reason: impl ToString) -> PopulationError {
    PopulationError::InSession { session: row.session.clone(), reason: reason.to_string() }
}

fn inseparable(names: &[String]) -> String {
    let advice = "leave one of the parameters out".to_owned();
    FitError::Inseparable { names: names.to_vec(), advice }.to_string()
}
