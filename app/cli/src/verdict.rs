//! `palpate verdict`: what a session is worth, said beside its log.

use super::Failure;
use super::output::Output;
use super::recalibrate::deed_failure;
use clap::Args;
use palpate_analysis::analyses::{self, Who};
use palpate_analysis::edits::author;
use palpate_analysis::report::catalog::one_line;
use palpate_sessions::edits::Verdict;
use std::path::PathBuf;

/// Say what a session is worth: valid, suspect or rejected
#[derive(Debug, Args)]
pub struct VerdictArgs {
    /// Session folder
    session: PathBuf,
    /// valid, suspect or rejected
    verdict: Verdict,
    #[command(flatten)]
    why: Why,
}

/// Who says so, and why.
#[derive(Debug, Args)]
pub(super) struct Why {
    /// Why, in a few words
    #[arg(long, value_name = "TEXT")]
    reason: String,
    /// Who says so; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

impl Why {
    /// As an analysis names them.
    pub(super) fn who(&self) -> Who {
        Who { by: author(self.by.as_deref()), reason: self.reason.clone() }
    }
}

pub(super) fn run(args: &VerdictArgs, output: &Output) -> Result<(), Failure> {
    let judged = analyses::judge(&args.session, args.verdict, &args.why.who());
    let (before, edit) = judged.map_err(deed_failure)?;
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
