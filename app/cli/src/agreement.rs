//! `palpate agreement`: how far the sessions of two operators, rigs, sites or storages agree.

use super::fit::jobs;
use super::output::Output;
use super::population::{self, recipe};
use super::{Failure, new_file};
use clap::Args;
use palpate_analysis::population::{AgreementFailure, AgreementRequest, agreements};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Compare two operators, rigs, sites or storages that pressed the same places: bias and limits of agreement (Bland & Altman)
#[derive(Debug, Args)]
pub struct AgreementArgs {
    /// Session folders and folders of sessions, or one lake
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// The entry that has two values: operator, rig, specimen.site or specimen.storage
    #[arg(long, value_name = "ENTRY")]
    between: String,
    /// Model family; without it the modified Kelvin model
    #[arg(long, value_name = "KEY")]
    family: Option<String>,
    /// Parameters that are compared, as in tau_eps,mu1; without it all of the model
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    parameters: Vec<String>,
    /// Correct depths for machine compliance: last for the compliance in force for each
    /// session's rig, a file, or an id of the library
    #[arg(long, value_name = "FILE|last")]
    compliance: Option<String>,
    /// Draw the factors over their means as a new SVG file
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Number of sessions fitted at a time; without it the number of processors
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

pub(super) fn run(args: &AgreementArgs, output: &Output) -> Result<(), Failure> {
    new_file::check("plot", args.plot.as_deref())?;
    let recipe = recipe(args.family.clone(), args.compliance.as_deref())?;
    let request = AgreementRequest {
        paths: &args.sources,
        recipe: &recipe,
        parameters: &args.parameters,
        between: &args.between,
        jobs: jobs(args.jobs),
    };
    let bar = output.count_bar(0);
    let found = agreements(&request, &bar).map_err(failure);
    drop(bar);
    let found = found?;
    output.answer("agreement", &found, || found.text());
    new_file::write("plot", args.plot.as_deref(), || found.figure().drawing().svg())
}

fn failure(err: AgreementFailure) -> Failure {
    match err {
        AgreementFailure::Population(err) => population::failure(err),
        AgreementFailure::Places { .. } => Failure::failed(err),
        AgreementFailure::UnknownEntry { .. } | AgreementFailure::Values { .. } => {
            Failure::usage(err)
        }
    }
}
