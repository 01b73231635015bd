//! `palpate verdict`: sets the data quality of a session.

use super::Failure;
use super::output::Output;
use super::recalibrate::analysis_edit_failure;
use clap::Args;
use palpate_analysis::edits;
use palpate_analysis::report::catalog::one_line;
use palpate_analysis::session_actions::{self, Attribution};
use palpate_sessions::edits::DataQuality;
use std::path::PathBuf;

/// Set the data quality of a session: valid, suspect or rejected
#[derive(Debug, Args)]
pub struct VerdictArgs {
    /// Session folder
    session: PathBuf,
    /// valid, suspect or rejected
    verdict: DataQuality,
    #[command(flatten)]
    reason: ReasonArgs,
}

/// The author of an edit, with a reason that is required.
#[derive(Debug, Args)]
pub(super) struct ReasonArgs {
    /// Reason, in a few words
    #[arg(long, value_name = "TEXT")]
    reason: String,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

impl ReasonArgs {
    pub(super) fn author(&self) -> Attribution {
        Attribution { by: edits::author(self.by.as_deref()), reason: self.reason.clone() }
    }
}

pub(super) fn run(args: &VerdictArgs, output: &Output) -> Result<(), Failure> {
    let judged =
        session_actions::set_data_quality(&args.session, args.verdict, &args.reason.author());
    let (before, edit) = judged.map_err(analysis_edit_failure)?;
    let object = serde_json::json!({
        "session": args.session, "verdict": args.verdict, "was": before, "by": edit.by,
        "reason": edit.reason,
    });
    output.answer("verdict", &object, || {
        let was = before.map_or("had no verdict".into(), |was| format!("was {was}"));
        format!("{}: {} ({was}); {}", args.session.display(), args.verdict, one_line(&edit.reason))
    });
    Ok(())
}
