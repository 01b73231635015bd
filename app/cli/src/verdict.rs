//! `palpate verdict` and `palpate correct-contact`: what is said of a session afterwards, beside its log.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::edited::{self, Edited};
pub(super) use palpate_analysis::edits::author;
use palpate_analysis::report::catalog::one_line;
use palpate_model::units::Position;
use palpate_runner::wall_now;
use palpate_sessions::edits::{Change, Edit, Verdict, add_edit};
use std::path::{Path, PathBuf};

/// Arguments of `palpate verdict`.
#[derive(Debug, Args)]
pub struct VerdictArgs {
    /// Session folder
    session: PathBuf,
    /// valid, suspect or rejected
    verdict: Verdict,
    #[command(flatten)]
    why: Why,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `palpate correct-contact`.
#[derive(Debug, Args)]
pub struct CorrectArgs {
    /// Session folder
    session: PathBuf,
    /// Where contact really was: position from home in mm
    #[arg(long, value_name = "MM", value_parser = super::run::number, allow_negative_numbers = true)]
    position: f64,
    /// Which of the contacts that the session found, from 1; needed where there are several
    #[arg(long, value_name = "N")]
    contact: Option<u32>,
    #[command(flatten)]
    why: Why,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
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
    /// Who, and why.
    pub(super) fn words(&self) -> (String, &str) {
        (author(self.by.as_deref()), &self.reason)
    }

    pub(super) fn edit(&self, change: Change) -> Edit {
        Edit {
            at: wall_now().into(),
            by: author(self.by.as_deref()),
            reason: self.reason.trim().to_owned(),
            change,
        }
    }
}

fn add(folder: &Path, edited: &Edited, edit: &Edit) -> Result<(), Failure> {
    let id = &edited.session.manifest.session_id;
    add_edit(folder, id, edit).map_err(super::review::edit_failure)
}

/// Says what a session is worth.
pub(super) fn verdict(args: &VerdictArgs, output: &Output) -> Result<(), Failure> {
    let edited = edited::open(&args.session).map_err(super::source_failure)?;
    let before = edited.edits.verdict().map(|(verdict, _)| verdict);
    let edit = args.why.edit(Change::Verdict {
        verdict: args.verdict,
    });
    add(&args.session, &edited, &edit)?;
    let object = serde_json::json!({
        "command": "verdict", "session": args.session, "verdict": args.verdict,
        "was": before, "by": edit.by, "reason": edit.reason,
    });
    output.result(&object, || {
        let was = before.map_or("had no verdict".into(), |was| format!("was {was}"));
        format!(
            "{}: {} ({was}); {}",
            args.session.display(),
            args.verdict,
            one_line(&edit.reason)
        )
    });
    Ok(())
}

/// Says where contact really was.
pub(super) fn correct(args: &CorrectArgs, output: &Output) -> Result<(), Failure> {
    let edited = edited::open(&args.session).map_err(super::source_failure)?;
    let found = edited::contacts(&edited.session.entries);
    let number = match (args.contact, found.len()) {
        (_, 0) => {
            return Err(Failure::usage(
                "the session found no contact, so no depth counts from one; there is nothing to correct",
            ));
        }
        (None, 1) => 1,
        (None, several) => {
            return Err(Failure::usage(format!(
                "the session found contact {several} times; say which with --contact 1 to {several}"
            )));
        }
        (Some(number), several) if number == 0 || number as usize > several => {
            return Err(Failure::usage(format!(
                "there is no contact {number}; the session found {several}"
            )));
        }
        (Some(number), _) => number,
    };
    // A session that found a contact has a rig.
    let rig = edited.session.manifest.rig.as_ref();
    let travel = rig.map_or(Position(0.0), |rig| rig.travel);
    let position = Position(args.position);
    if !(0.0..=travel.0).contains(&position.0) {
        return Err(Failure::usage(format!(
            "contact at {position} is outside the rig's travel of {travel}; give the position from home"
        )));
    }
    let was = found[number as usize - 1].position;
    let edit = args.why.edit(Change::Contact {
        number,
        position_mm: position,
        was_mm: was,
    });
    add(&args.session, &edited, &edit)?;
    let deeper = was.depth_from(position).0;
    let object = serde_json::json!({
        "command": "correct-contact", "session": args.session, "contact": number,
        "position_mm": position.0, "was_mm": was.0, "depth_change_mm": deeper,
        "by": edit.by, "reason": edit.reason,
    });
    output.result(&object, || {
        format!(
            "{}: contact {number} at {:.3} mm instead of {:.3} mm; its depths change by {deeper:+.3} mm",
            args.session.display(), position.0, was.0
        )
    });
    Ok(())
}
