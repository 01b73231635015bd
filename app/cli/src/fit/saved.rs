//! `palpate fit --save NAME`: the fit as a named record beside its session.

use super::super::{Failure, recalibrate};
use super::FitArgs;
use palpate_analysis::analyses::{FitSettings, KeptFit, keep_fit};
use serde::Serialize;
use serde_json::to_value;
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
    let settings = FitSettings {
        family: args.family.clone(),
        unload: args.unload,
        fixed: args.fixed.clone(),
        free: args.free.clone(),
        systematic: !args.no_systematic,
        profile: args.profile,
        bootstrap: args.bootstrap,
        seed: args.seed,
        compliance: args.compliance.clone(),
        include_rejected: args.include_rejected,
    };
    let fit = KeptFit {
        based_on: args.analysis.as_deref(),
        together_with: &[],
        settings: to_value(settings).map_err(Failure::failed)?,
        results: to_value(results).map_err(Failure::failed)?,
    };
    keep_fit(source, name, fit, &args.who.who()).map_err(recalibrate::deed_failure)?;
    Ok(())
}
