//! `palpate fit --save NAME`: the fit as a named record beside its session.

use super::super::{Failure, analysis, verdict::author};
use super::FitArgs;
use palpate_analysis::analysed::{self, record};
use palpate_sessions::analyses::Analysed;
use serde::Serialize;
use serde_json::json;
use std::path::Path;

/// Refuses before anything is fitted what could not be kept.
pub(super) fn check(args: &FitArgs, source: &Path) -> Result<(), Failure> {
    match (&args.save, source.is_dir()) {
        (Some(name), false) => Err(Failure::usage(format!(
            "'{name}' cannot be saved: {} is not a session folder, and only those keep analyses",
            source.display()
        ))),
        _ => Ok(()),
    }
}

/// Keeps a fit, if that was asked for.
pub(super) fn keep(args: &FitArgs, source: &Path, results: &impl Serialize) -> Result<(), Failure> {
    let Some(name) = &args.save else {
        return Ok(());
    };
    let based_on = args.analysis.as_deref();
    let opened = analysed::open(source, based_on).map_err(super::super::source_failure)?;
    let inputs = opened.inputs(source, based_on).map_err(analysis::failure)?;
    let what = Analysed::Fit {
        based_on: args.analysis.clone(),
        settings: json!({
            "family": args.family,
            "unload": args.unload,
            "fixed": args.fixed,
            "free": args.free,
            "systematic": !args.no_systematic,
            "profile": args.profile,
            "bootstrap": args.bootstrap,
            "seed": args.seed,
            "compliance": args.compliance,
            "include_rejected": args.include_rejected,
        }),
        results: serde_json::to_value(results).map_err(Failure::failed)?,
    };
    let by = author(args.who.by.as_deref());
    let one = record(name, &by, &args.who.reason, inputs, what);
    analysis::keep(source, &opened.edited.session.manifest.session_id, &one)
}
