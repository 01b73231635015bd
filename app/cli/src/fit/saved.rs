//! `palpate fit --save NAME`: saves the fit as a named analysis of its session.

use super::super::{Failure, recalibrate};
use super::FitArgs;
use palpate_analysis::session_actions::{FitSettings, FitToStore, store_fit};
use serde::Serialize;
use serde_json::to_value;
use std::path::Path;

/// Refuses before a fit or a modulus what could not be saved after it.
pub(crate) fn check(save: Option<&String>, source: &Path) -> Result<(), Failure> {
    match (save, source.is_dir()) {
        (Some(name), false) => Err(Failure::usage(format!(
            "analysis '{name}' cannot be saved, because {} is not a session folder; give a session folder",
            source.display()
        ))),
        _ => Ok(()),
    }
}

pub(super) fn save(args: &FitArgs, source: &Path, results: &impl Serialize) -> Result<(), Failure> {
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
    let fit = FitToStore {
        based_on: args.analysis.as_deref(),
        together_with: &[],
        settings: to_value(settings).map_err(Failure::failed)?,
        results: to_value(results).map_err(Failure::failed)?,
    };
    store_fit(source, name, fit, &args.author.author())
        .map_err(recalibrate::analysis_edit_failure)?;
    Ok(())
}
