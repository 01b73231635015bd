//! `palpate population`: means, effects and standard deviations of the parameters of a study.

use super::arguments::positive;
use super::fit::jobs;
use super::new_file;
use super::output::Output;
use super::{Failure, compliance, library, study};
use clap::Args;
use palpate_analysis::fit::{FitRecipe, StoredFitError};
use palpate_analysis::population::{
    PopulationError, PopulationMethod, PopulationReport, PopulationRequest, SavePopulationError,
    check_new_name, population, save_population, study_recipe, write_results,
};
use palpate_analysis::shared_library::store_address;
use palpate_analysis::shared_results::{ResultsOutcome, add_population, results_words};
use palpate_sessions::{LibraryError, library_folder};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Estimate the population that the specimens of a study come from: medians, effects and standard deviations by level
#[derive(Debug, Args)]
pub struct PopulationArgs {
    /// Session folders and folders of sessions, or one lake
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Model family; without it the modified Kelvin model
    #[arg(long, value_name = "KEY")]
    family: Option<String>,
    /// Parameters of the population, as in tau_eps,mu1; without it all of the model
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    parameters: Vec<String>,
    /// Levels of groups from the outermost, as in animal,specimen,site; without it all that the sessions can separate
    #[arg(long, value_name = "LEVELS", value_delimiter = ',')]
    by: Vec<String>,
    /// An entry of the sessions that may move the mean, such as animal.treatment; may be repeated
    #[arg(long, value_name = "ENTRY")]
    effect: Vec<String>,
    /// Take each session's best values and their covariance instead of its curve
    #[arg(long)]
    two_stage: bool,
    /// Take these values and covariances from the fits that the lake stores, and read no curve
    #[arg(long, requires = "two_stage")]
    stored: bool,
    /// Leave each group and session out in turn, and print on which of them the population rests
    #[arg(long)]
    influence: bool,
    /// Draw studies of other sizes from the population, and print in which no end of an interval is off by more than PERCENT
    #[arg(long, value_name = "PERCENT", value_parser = positive, allow_negative_numbers = true)]
    wanted: Option<f64>,
    /// Write tables (CSV, LaTeX), figures, a paragraph and a page for a paper into this new folder
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Correct depths for machine compliance: last for the compliance in force for each
    /// session's rig, a file, or an id of the library
    #[arg(long, value_name = "FILE|last")]
    compliance: Option<String>,
    /// Save the population in the library under this name, for simulated specimens population:NAME#NUMBER
    #[arg(long, value_name = "NAME", conflicts_with = "stored")]
    save: Option<String>,
    /// Also add the population to the tables of this store, as in s3://bucket/folder or file:///folder; one that is there
    /// is passed over
    #[arg(long, value_name = "STORE", value_parser = store_address)]
    store: Option<String>,
    /// Number of sessions fitted at a time; without it the number of processors
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

pub(super) fn run(args: &PopulationArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("folder", args.out.as_deref())?;
    let recipe = recipe(args.family.clone(), args.compliance.as_deref())?;
    if args.store.is_some() {
        // Before a population is found that could not be added.
        recipe.corrections.file().map_err(Failure::usage)?;
    }
    let request = PopulationRequest {
        paths: &args.sources,
        recipe: &recipe,
        parameters: &args.parameters,
        levels: &args.by,
        effects: &args.effect,
        method: match (args.two_stage, args.stored) {
            (false, _) => PopulationMethod::Curves,
            (true, false) => PopulationMethod::TwoStage,
            (true, true) => PopulationMethod::Stored,
        },
        is_drawn: args.out.is_some(),
        is_influence_wanted: args.influence,
        wanted_percent: args.wanted,
        jobs: jobs(args.jobs),
    };
    let library = args.save.is_some().then(library_folder).transpose().map_err(Failure::usage)?;
    let place = library.as_deref().zip(args.save.as_deref());
    if let Some((library, name)) = place {
        check_new_name(library, name).map_err(save_failure)?;
    }
    let bar = output.count_bar(0);
    let found = population(&request, &bar).map_err(failure);
    drop(bar);
    let found = found?;
    let saved = place.map(|(library, name)| save_population(library, name, &found)).transpose();
    let added = args.store.as_deref();
    let added = added.map(|address| add_population(address, &request, &found)).transpose();
    // What took long to find is printed even if it cannot be saved or added.
    let place = saved.as_ref().ok().and_then(Option::as_ref);
    let store = added.as_ref().ok().and_then(Option::as_ref);
    let answer = PopulationAnswer {
        found: &found.report,
        id: place.map(|one| one.id.as_str()),
        file: place.map(|one| one.path.as_path()),
        store,
    };
    output.answer("population", &answer, || {
        let saved = place.map(|one| format!("saved as {}, {}", one.id, one.path.display()));
        let added = store.map(results_words);
        [found.report.text()].into_iter().chain(saved).chain(added).collect::<Vec<_>>().join("\n")
    });
    if let Some(folder) = &args.out {
        write_results(&found, folder).map_err(|err| {
            Failure::failed(format!(
                "the results cannot be written into {} ({err}); choose a folder that you may write to",
                folder.display()
            ))
        })?;
        output.note(&format!("wrote {}", folder.display()));
    }
    saved.map_err(save_failure)?;
    added.map(|_| ()).map_err(library::failure)
}

#[derive(Serialize)]
struct PopulationAnswer<'a> {
    #[serde(flatten)]
    found: &'a PopulationReport,
    /// Of the saved population.
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a Path>,
    #[serde(skip_serializing_if = "Option::is_none")]
    store: Option<&'a ResultsOutcome>,
}

fn save_failure(err: SavePopulationError) -> Failure {
    match err {
        SavePopulationError::Library(LibraryError::Io { .. }) => Failure::failed(err),
        err => Failure::usage(err),
    }
}

/// How sessions of a study are fitted.
pub(super) fn recipe(
    family: Option<String>,
    compliance: Option<&str>,
) -> Result<FitRecipe, Failure> {
    let corrections = compliance::corrections(compliance)?;
    study_recipe(family, corrections).map_err(Failure::usage)
}

pub(super) fn failure(err: PopulationError) -> Failure {
    match err {
        PopulationError::Read(err) => study::failure(err),
        PopulationError::Stored(StoredFitError::Lake(_)) => Failure::failed(err),
        PopulationError::Design(_)
        | PopulationError::Parameter(_)
        | PopulationError::ParameterTwice { .. }
        | PopulationError::InSession { .. }
        | PopulationError::Stored(_) => Failure::usage(err),
        err => Failure::failed(err),
    }
}
