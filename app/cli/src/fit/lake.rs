//! Fits the sessions of a lake, or of one shard, and stores the fits in the lake.

use super::super::{Failure, export, library, material, output::Output, source_failure};
use super::{FitArgs, batch, jobs};
use palpate_analysis::fit::{
    FitRecipe, LakeFitError, LakeFitEvent, LakeFitOutcome, LakeFitRequest, LakeTally,
    SourceFitError, fit_lake,
};
use palpate_analysis::progress::Progress;
use palpate_analysis::shared_results::{LakeResults, add_lake_results, results_words};
use palpate_sessions::text::sha256_of_file;
use palpate_tables::lake::{LakeError, LakeResult, Shard};
use serde_json::json;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub(super) fn run(
    lake: &Path,
    args: &FitArgs,
    recipe: &FitRecipe,
    output: &Output,
) -> Result<(), Failure> {
    check(args)?;
    let request = LakeFitRequest {
        lake,
        shard: args.shard.unwrap_or(Shard::WHOLE),
        recipe,
        fixed: &args.fixed,
        free: &args.free,
        compliance_sha256: args.compliance.as_deref().map(hash_file).transpose()?,
        jobs: jobs(args.jobs),
    };
    let place = ResultPlace { lake, result: LakeResult::Fit, store: args.store.as_deref() };
    fit_each("fit", &place, output, |is_ending, hear| fit_lake(&request, is_ending, hear))
}

/// Where results are stored.
pub(crate) struct ResultPlace<'a> {
    pub lake: &'a Path,
    pub result: LakeResult,
    /// The address of a store whose tables have them too.
    pub store: Option<&'a str>,
}

/// Fits a lake as `command`, with notes, progress and the tally.
pub(crate) fn fit_each(
    command: &str,
    place: &ResultPlace<'_>,
    output: &Output,
    fit: impl FnOnce(&AtomicBool, &mut dyn FnMut(LakeFitEvent<'_>)) -> Result<LakeTally, LakeFitError>,
) -> Result<(), Failure> {
    let is_ending = Arc::new(AtomicBool::new(false));
    batch::end_on_signals(&is_ending)?;
    let bar = output.count_bar(0);
    let (mut fitted, mut failed) = (BTreeSet::new(), Vec::new());
    let tally = fit(&is_ending, &mut |event| match event {
        LakeFitEvent::Note(note) => output.note(&note),
        LakeFitEvent::Done(count, of) => {
            // The sessions under way are waited for in any case.
            let _ = bar.report(count, of, "");
        }
        LakeFitEvent::Next(id, Ok(LakeFitOutcome::Fitted | LakeFitOutcome::AlreadyFitted)) => {
            fitted.insert(id.to_owned());
        }
        LakeFitEvent::Next(_, Ok(LakeFitOutcome::Rejected)) => {}
        LakeFitEvent::Next(id, Err(err)) => {
            let reason = failure(err).sentence().to_owned();
            bar.suspend(|| output.note(&format!("{id}: {reason}")));
            failed.push(json!({ "session_id": id, "error": reason }));
        }
    });
    let tally = tally.map_err(failure)?;
    let ResultPlace { lake, result, store } = *place;
    let results = LakeResults { lake, result, model: &tally.model, fitted: &fitted };
    // What an interrupted command made is added by the next.
    let store = store.filter(|_| !is_ending.load(Ordering::Relaxed));
    let added =
        store.map(|address| add_lake_results(address, &results, &is_ending, &bar)).transpose();
    drop(bar);
    let mut object = json!(tally);
    object["lake"] = json!(lake);
    object["failed"] = json!(failed);
    let outcome = added.as_ref().ok().and_then(Option::as_ref);
    if let Some(outcome) = outcome {
        object["store"] = json!(outcome);
    }
    output.answer(command, &object, || {
        let made = if command == "fit" { "fits" } else { "moduli" };
        let made = format!(
            "{} {made} made, {} already present, {} sessions rejected, {} not fitted",
            tally.made,
            tally.were_there,
            tally.rejected,
            failed.len()
        );
        [made].into_iter().chain(outcome.map(results_words)).collect::<Vec<_>>().join("\n")
    });
    added.map_err(library::failure)?;
    if failed.is_empty() {
        return Ok(());
    }
    let unfitted = format!("{} of {} sessions", failed.len(), tally.sessions);
    Err(Failure::failed(match is_ending.load(Ordering::Relaxed) {
        true => {
            format!(
                "{unfitted} were not fitted, because the command was interrupted; run the command again to continue"
            )
        }
        false => format!("{unfitted} were not fitted; the notes above state the reasons"),
    }))
}

/// Refuses options that a lake does not have.
fn check(args: &FitArgs) -> Result<(), Failure> {
    refuse_options(&[
        ("--picture", args.picture.is_some()),
        ("--share", args.share.is_some()),
        ("--columns", args.columns.is_some()),
        ("--profile", args.profile),
        ("--bootstrap", args.bootstrap.is_some()),
        ("--save", args.save.is_some()),
        ("--analysis", args.analysis.is_some()),
    ])
}

/// Refuses the first of these options, which only a lake has, that is given.
pub(crate) fn check_given(options: &[(&str, bool)]) -> Result<(), Failure> {
    match options.iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) => {
            Err(Failure::usage(format!("{name} needs a lake; give one lake, or leave out {name}")))
        }
        None => Ok(()),
    }
}

/// Refuses the first of these options that is given.
pub(crate) fn refuse_options(others: &[(&str, bool)]) -> Result<(), Failure> {
    match others.iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) => Err(Failure::usage(format!(
            "{name} does not apply to a lake; give a single session, or leave out {name}"
        ))),
        None => Ok(()),
    }
}

/// The compliance in force differs between machines, so that of a lake is a file.
pub(crate) fn hash_file(file: &str) -> Result<String, Failure> {
    sha256_of_file(Path::new(file)).map_err(|err| {
        Failure::usage(format!(
            "--compliance {file} is not a readable file ({err}); give a file, so that every computer fits the lake with the same compliance"
        ))
    })
}

fn failure(err: LakeFitError) -> Failure {
    match err {
        LakeFitError::Lake(LakeError::NoLake { .. } | LakeError::Newer { .. }) => {
            Failure::usage(err)
        }
        LakeFitError::Keep(err) => export::failure(err),
        LakeFitError::NotFitted(SourceFitError::Source(err)) => source_failure(err),
        LakeFitError::NoModulus(err) => material::failure::of_press(err),
        _ => Failure::failed(err),
    }
}
