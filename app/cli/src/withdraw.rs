//! `palpate withdraw`: withdraws an analysis.

use super::Failure;
use super::output::Output;
use super::recalibrate::{AuthorArgs, analysis_edit_failure};
use clap::Args;
use palpate_analysis::session_actions;
use std::path::PathBuf;

/// Withdraw an analysis; its record stays
#[derive(Debug, Args)]
pub struct WithdrawArgs {
    /// Session folder
    session: PathBuf,
    /// Name of the analysis
    name: String,
    #[command(flatten)]
    author: AuthorArgs,
}

pub(super) fn run(args: &WithdrawArgs, output: &Output) -> Result<(), Failure> {
    let gone = session_actions::withdraw(&args.session, &args.name, &args.author.author());
    let gone = gone.map_err(analysis_edit_failure)?;
    let object = serde_json::json!({
        "session": args.session, "analysis": gone.name, "by": gone.by, "reason": gone.reason,
    });
    output.answer("withdraw", &object, || {
        format!(
            "{}: analysis '{}' is withdrawn: {}",
            args.session.display(),
            gone.name,
            gone.reason
        )
    });
    Ok(())
}
