//! `palpate fit`: fits a force model to sessions and tables.

mod batch;
mod intervals;
mod joint;
pub(super) mod lake;
pub(super) mod saved;

use super::Failure;
use super::arguments::{parse_columns, parse_number};
use super::output::Output;
use super::recalibrate::AuthorArgs;
use super::{compliance, new_file, source_failure, sources_failure};
use clap::Args;
use palpate_analysis::compliance::ComplianceCorrections;
use palpate_analysis::fit::{FitChoice, FitRecipe, remember};
use palpate_analysis::recordings::{self, is_collection};
use palpate_analysis::report::fit_json::{FitObject, FitOverlay};
use palpate_analysis::report::{picture, text};
use palpate_analysis::shared_library::store_address;
use palpate_analysis::source::{RecordStretch, SourceSelection};
use palpate_model::calibration::ForceUncertainty;
use palpate_rheology::fit::FitOptions;
use palpate_tables::lake::{Shard, is_lake};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Fit the force model to a session or a table
#[derive(Debug, Args)]
pub struct FitArgs {
    /// Session folders, delimited tables with columns for time, depth and force, or folders in
    /// which every session and table (.csv, .tsv, .mcap) is fitted; or one lake, which keeps its fits
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Fix a parameter, as NAME=VALUE; may be repeated
    #[arg(long = "fixed", value_name = "NAME=VALUE")]
    fixed: Vec<String>,
    /// Free a parameter that is fixed by default, such as x_contact; may be repeated
    #[arg(long = "free", value_name = "NAME")]
    free: Vec<String>,
    /// Names of the columns of tables that have no header, as in t_s,x_mm,F_N
    #[arg(long, value_name = "NAMES")]
    columns: Option<String>,
    /// Draw the fit, or the reason of its failure, as a new SVG file
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Fit all sources together with these parameters in common, as in tau_eps,mu1;
    /// 'body' stands for the five parameters of the tissue
    #[arg(long, value_name = "NAMES", conflicts_with = "picture")]
    share: Option<String>,
    /// Fit another model family, such as maxwell, prony-2 or unloading-3: one model for all sources unless --share
    /// or --each is given
    #[arg(long, value_name = "KEY")]
    family: Option<String>,
    /// With --family: fit every source by itself
    #[arg(long, requires = "family", conflicts_with = "share")]
    each: bool,
    /// With --family: fit the recorded unloading of sessions too
    #[arg(long)]
    unload: bool,
    /// Add 95 % intervals from the profile likelihood
    #[arg(long)]
    profile: bool,
    /// Add 95 % intervals from a block bootstrap of this many repeats
    #[arg(long, value_name = "N")]
    bootstrap: Option<usize>,
    /// Seed of the bootstrap; without it 1
    #[arg(long, value_name = "SEED")]
    seed: Option<u64>,
    /// Leave out the systematic component of the calibration from the intervals of a session
    #[arg(long)]
    no_systematic: bool,
    /// Include rejected sessions
    #[arg(long)]
    include_rejected: bool,
    /// Apply this analysis of the session: its calibration and its excluded stretches
    #[arg(long, value_name = "NAME", conflicts_with = "share")]
    analysis: Option<String>,
    /// Save the fit as an analysis of this name with its session
    #[arg(long, value_name = "NAME", conflicts_with = "share")]
    save: Option<String>,
    #[command(flatten)]
    author: AuthorArgs,
    /// Correct depths for machine compliance: last for the compliance in force for each
    /// session's rig, a file, or an id of the library
    #[arg(long, value_name = "FILE|last")]
    compliance: Option<String>,
    /// Fit only the i-th of n parts of a lake, as in 2/8; which part a session is in depends on its name alone
    #[arg(long, value_name = "I/N", conflicts_with = "share")]
    shard: Option<Shard>,
    /// Also add the fits of a lake to the tables of this store, as in s3://bucket/folder or file:///folder; a fit that is there
    /// is passed over
    #[arg(long, value_name = "STORE", value_parser = store_address)]
    store: Option<String>,
    /// Number of sources fitted at a time; without it the number of processors
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

impl FitArgs {
    fn wanted(&self) -> SourceSelection {
        SourceSelection {
            stretch: RecordStretch::with_unload(self.unload),
            is_rejected_included: self.include_rejected,
        }
    }

    fn corrections(&self) -> Result<ComplianceCorrections, Failure> {
        compliance::corrections(self.compliance.as_deref())
    }
}

/// Sources fitted at a time.
pub(super) fn jobs(given: Option<NonZeroUsize>) -> usize {
    let jobs = given.or(std::thread::available_parallelism().ok());
    jobs.map_or(1, NonZeroUsize::get)
}

pub(super) fn run(args: &FitArgs, output: &Output) -> Result<(), Failure> {
    intervals::check(args)?;
    if args.unload && args.family.is_none() {
        return Err(Failure::usage(
            "--unload needs --family, because the default model does not describe unloading; add --family unloading-3",
        ));
    }
    let recipe = FitRecipe {
        options: options(args)?,
        columns: parse_columns(args.columns.as_deref())?,
        is_systematic: !args.no_systematic,
        selection: args.wanted(),
        analysis: args.analysis.clone(),
        corrections: args.corrections()?,
    };
    if let [lake] = args.sources.as_slice()
        && (is_lake(lake) || args.shard.is_some())
    {
        return lake::run(lake, args, &recipe, output);
    }
    lake::check_given(&[("--shard", args.shard.is_some()), ("--store", args.store.is_some())])?;
    if let Some(shared) = &args.share {
        return joint::run(args, Some(shared), &recipe, output);
    }
    if let [source] = args.sources.as_slice()
        && !is_collection(source)
    {
        return one(source, &recipe, args, output);
    }
    if args.picture.is_some() || args.save.is_some() || args.analysis.is_some() {
        return Err(Failure::usage(
            "--picture, --save and --analysis apply to one record; give a single session or table",
        ));
    }
    if args.family.is_some() && !args.each {
        return joint::run(args, None, &recipe, output);
    }
    if args.profile || args.bootstrap.is_some() {
        return Err(Failure::usage(
            "--profile and --bootstrap apply to one fit; give a single session or table, or fit several together with --share",
        ));
    }
    let found = recordings::find(&args.sources).map_err(sources_failure)?;
    found.note().iter().for_each(|note| output.note(note));
    batch::run(&found.paths, jobs(args.jobs), &recipe, output)
}

fn one(source: &Path, recipe: &FitRecipe, args: &FitArgs, output: &Output) -> Result<(), Failure> {
    let to = args.picture.as_deref();
    new_file::check("picture", to)?;
    saved::check(args.save.as_ref(), source)?;
    let fitted = recipe.fit(source).map_err(source_failure)?;
    fitted.notes.iter().for_each(|note| output.note(note));
    let name = source.display().to_string();
    // Only the file name: a picture is passed on, and its folders are private.
    let short = source.file_name().map_or(name.clone(), |name| name.to_string_lossy().into());
    let report = match &fitted.result {
        Ok(report) => report,
        Err(refusal) => {
            let sentence = refusal.to_string();
            let picture = || picture::of_refusal(&short, &fitted.samples, &sentence);
            new_file::write("picture", to, picture)?;
            return Err(Failure::failed(format!("{refusal}, in {name}")));
        }
    };
    let overlay = FitOverlay::of(report, &fitted.samples);
    new_file::write("picture", to, || {
        let uncertainty = fitted.calibration.as_ref().map(ForceUncertainty::of);
        let band = uncertainty.and_then(Result::ok);
        picture::of_report(&short, (&fitted.samples, &overlay), report, band.as_ref())
    })?;
    if let Err((file, err)) = remember(report, source) {
        output.note(&format!(
            "'palpate plan' cannot use this fit later, because {} cannot be written ({err})",
            file.display()
        ));
    }
    let bar = intervals::bar(args, output);
    let wanted = intervals::wanted(args);
    let intervals = fitted.intervals(&recipe.options, wanted, |done| intervals::show(&bar, done));
    drop(bar);
    let intervals = intervals.map_err(Failure::failed)?;
    let extras = fitted.details(&overlay, &intervals);
    let object = FitObject::of(recipe.options.family(), report, extras, fitted.seconds);
    saved::save(args, source, &object)?;
    output.result(&object, || {
        let mut lines = vec![text::fit_text(report, extras)];
        lines.extend(fitted.compliance.as_ref().map(compliance::correction_sentence));
        let saved = args.save.iter();
        lines.extend(saved.map(|name| format!("saved as analysis '{name}'")));
        lines.join("\n")
    });
    Ok(())
}

/// The family, and which of its parameters are free.
fn options(args: &FitArgs) -> Result<FitOptions, Failure> {
    let fixed = args.fixed.iter().map(|pair| {
        let (name, value) = pair.split_once('=')?;
        let value = parse_number(value.trim()).ok()?;
        Some((name.trim().to_owned(), value))
    });
    let fixed = fixed.zip(&args.fixed).map(|(read, pair)| {
        read.ok_or_else(|| {
            Failure::usage(format!(
                "--fixed {pair} is not NAME=VALUE; give for example --fixed f_offset=0"
            ))
        })
    });
    let choice = FitChoice {
        family: args.family.clone(),
        fixed: fixed.collect::<Result<_, _>>()?,
        free: args.free.clone(),
    };
    choice.options().map_err(Failure::usage)
}
