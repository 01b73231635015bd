//! The sessions of a lake, or one part of them, each fitted and kept in the lake.

use super::super::{Failure, export, output::Output, source_failure};
use super::sources::tell_copied;
use super::{FitArgs, Recipe, batch};
use palpate_analysis::compliance::Correction;
use palpate_analysis::exports::sweep_lake;
use palpate_analysis::pool::{News, NoAnswer, in_order};
use palpate_analysis::source;
use palpate_rheology::fit::{FitReport, Systematic};
use palpate_sessions::recover::recovered_id;
use palpate_sessions::text::sha256_of_file;
use palpate_tables::lake::{
    FitFile, FitState, InLake, LakeError, Shard, keep_fit, read_session, sessions, state_of_fit,
};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The folder of fits of the body of `palpate fit` without `--family`.
const MODEL: &str = "modified-kelvin";

/// What came of one session.
enum Outcome {
    Made,
    There,
    Rejected,
    Failed(Failure),
}

/// What is kept of a fit: nothing that depends on when or where it was made.
#[derive(Serialize)]
struct Kept<'a> {
    #[serde(flatten)]
    report: &'a FitReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    systematic: Option<&'a Systematic>,
    #[serde(skip_serializing_if = "Option::is_none")]
    compliance: Option<&'a Correction>,
    notes: &'a [String],
}

pub(super) fn run(
    lake: &Path,
    args: &FitArgs,
    recipe: &Recipe,
    output: &Output,
) -> Result<(), Failure> {
    check(args)?;
    // Named or not, it is one body, whose fits are kept in one folder.
    let key = recipe.options.family().key();
    let model = match key.as_str() {
        "series-3" => MODEL,
        key => key,
    };
    let settings = settings(args, model)?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let mut found = sessions(lake).map_err(failure)?;
    sweep_lake(lake);
    // Before the shards are made, so that all leave out the same.
    let ids: BTreeSet<String> = found.iter().map(|one| one.id.clone()).collect();
    let is_copied = |one: &InLake| ids.contains(&recovered_id(&one.id));
    let copied = found.iter().filter(|one| is_copied(one));
    tell_copied(copied.map(|one| one.id.clone()).collect(), output);
    found.retain(|one| !is_copied(one) && shard.has(&one.id));
    let jobs = args.jobs.or(std::thread::available_parallelism().ok());
    let jobs = jobs.map_or(1, NonZeroUsize::get);
    let is_ending = Arc::new(AtomicBool::new(false));
    batch::end_on_signals(&is_ending)?;
    let bar = output.count_bar(found.len() as u64);
    let (mut told, mut made, mut there, mut rejected) = (0, 0, 0, 0);
    let mut failed = Vec::new();
    let work = |one: &InLake| fit_one((lake, model), one, recipe, &settings);
    in_order(jobs, &found, &is_ending, work, |news| match news {
        News::Done(count) => bar.set_position(count as u64),
        News::Next(answer) => {
            let id = &found[told].id;
            told += 1;
            let reason = match answer {
                Ok(Outcome::Made) => return made += 1,
                Ok(Outcome::There) => return there += 1,
                Ok(Outcome::Rejected) => return rejected += 1,
                Ok(Outcome::Failed(failure)) => failure.sentence().to_owned(),
                Err(NoAnswer::NotBegun) => "not begun; the fits were asked to end".into(),
                Err(NoAnswer::Died) => {
                    "the fit ended unexpectedly; report this with the session".into()
                }
            };
            bar.suspend(|| output.note(&format!("{id}: {reason}")));
            failed.push(json!({ "session_id": id, "error": reason }));
        }
    })
    .map_err(|err| Failure::failed(format!("no thread can be started ({err}); try again")))?;
    bar.finish_and_clear();
    let object = json!({
        "command": "fit", "lake": lake, "model": model, "sessions": found.len(), "made": made,
        "were_there": there, "rejected": rejected, "failed": failed,
    });
    output.result(&object, || {
        format!(
            "{made} fits made, {there} were there, {rejected} sessions rejected, {} not fitted",
            failed.len()
        )
    });
    if failed.is_empty() {
        return Ok(());
    }
    let those = format!("{} of {} sessions", failed.len(), found.len());
    Err(Failure::failed(match is_ending.load(Ordering::Relaxed) {
        true => {
            format!("{those} not fitted; the fits were asked to end, and go on when asked again")
        }
        false => format!("{those} could not be fitted; each says why"),
    }))
}

fn fit_one(lake: (&Path, &str), one: &InLake, recipe: &Recipe, settings: &Value) -> Outcome {
    fit_kept(lake, one, recipe, settings).unwrap_or_else(Outcome::Failed)
}

fn fit_kept(
    (lake, model): (&Path, &str),
    one: &InLake,
    recipe: &Recipe,
    settings: &Value,
) -> Result<Outcome, Failure> {
    let file = FitFile {
        lake,
        model,
        session_id: &one.id,
        settings,
    };
    if state_of_fit(&file).map_err(export::failure)? == FitState::There {
        return Ok(Outcome::There);
    }
    let (session, rejection) = read_session(lake, one).map_err(failure)?;
    if rejection.is_some() && !recipe.wanted.is_rejected_included {
        return Ok(Outcome::Rejected);
    }
    let source = source::of_session(session, recipe.wanted.stretch, &[]);
    let fitted = source.and_then(|source| recipe.finish(source));
    let fitted = fitted.map_err(source_failure)?;
    let report = fitted.result.map_err(Failure::failed)?;
    let kept = Kept {
        report: &report,
        systematic: fitted.systematic.as_ref(),
        compliance: fitted.compliance.as_ref(),
        notes: &fitted.notes,
    };
    keep_fit(&file, &kept).map_err(export::failure)?;
    Ok(Outcome::Made)
}

/// What a lake is not asked.
fn check(args: &FitArgs) -> Result<(), Failure> {
    let others = [
        ("--picture", args.picture.is_some()),
        ("--share", args.share.is_some()),
        ("--columns", args.columns.is_some()),
        ("--profile", args.profile),
        ("--bootstrap", args.bootstrap.is_some()),
        ("--save", args.save.is_some()),
        ("--analysis", args.analysis.is_some()),
    ];
    match others.iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) => Err(Failure::usage(format!(
            "{name} is not for a lake; name a single session, or leave it out"
        ))),
        None => Ok(()),
    }
}

/// All that decides about a fit beside its session.
fn settings(args: &FitArgs, model: &str) -> Result<Value, Failure> {
    let sorted = |words: &[String]| {
        let mut words: Vec<String> = words.iter().map(|word| word.trim().to_owned()).collect();
        words.sort();
        words
    };
    // What the library of one machine has in force would not be the same on the next.
    let compliance = args.compliance.as_ref().map(|file| {
        sha256_of_file(Path::new(file)).map_err(|err| {
            Failure::usage(format!(
                "--compliance {file} cannot be read as a file ({err}); a lake is fitted the same everywhere, so name the compliance's file"
            ))
        })
    });
    let mut settings = json!({
        "software_version": env!("CARGO_PKG_VERSION"), "model": model,
        "fixed": sorted(&args.fixed), "free": sorted(&args.free),
        "systematic": !args.no_systematic, "compliance_sha256": compliance.transpose()?,
    });
    if args.unload {
        settings["unload"] = json!(true);
    }
    Ok(settings)
}

fn failure(err: LakeError) -> Failure {
    match err {
        LakeError::NoLake { .. } | LakeError::Newer { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    }
}
