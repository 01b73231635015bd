//! `palpate withdraw`: an analysis that shall not count any more.

use super::Failure;
use super::output::Output;
use super::recalibrate::{Who, deed_failure};
use clap::Args;
use palpate_analysis::analyses;
use std::path::PathBuf;

/// Let an analysis count no more; its record stays
#[derive(Debug, Args)]
pub struct WithdrawArgs {
    /// Session folder
    session: PathBuf,
    /// Name of the analysis that shall not count any more; its record stays
    name: String,
    #[command(flatten)]
    who: Who,
}

pub(super) fn run(args: &WithdrawArgs, output: &Output) -> Result<(), Failure> {
    let gone = analyses::withdraw(&args.session, &args.name, &args.who.who());
    let gone = gone.map_err(deed_failure)?;
    let object = serde_json::json!({
        "session": args.session, "analysis": gone.name, "by": gone.by, "reason": gone.reason,
    });
    output.answer("withdraw", &object, || {
        format!(
            "{}: analysis '{}' does not count any more: {}",
            args.session.display(),
            gone.name,
            gone.reason
        )
    });
    Ok(())
}
