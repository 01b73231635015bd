//! `palpate correct-contact`: corrects the contact point of a session.

use super::Failure;
use super::arguments::parse_number;
use super::output::Output;
use super::recalibrate::analysis_edit_failure;
use super::verdict::ReasonArgs;
use clap::Args;
use palpate_analysis::session_actions;
use palpate_model::units::Position;
use std::path::PathBuf;

/// Correct the contact point of a session; its log stays unchanged
#[derive(Debug, Args)]
pub struct CorrectArgs {
    /// Session folder
    session: PathBuf,
    /// The correct contact point: position from home in mm
    #[arg(long, value_name = "MM", value_parser = parse_number, allow_negative_numbers = true)]
    position: f64,
    /// Number of the contact in the session, from 1; required where there are several
    #[arg(long, value_name = "N")]
    contact: Option<u32>,
    #[command(flatten)]
    reason: ReasonArgs,
}

pub(super) fn run(args: &CorrectArgs, output: &Output) -> Result<(), Failure> {
    let (session, position) = (&args.session, Position(args.position));
    let done =
        session_actions::correct_contact(session, args.contact, position, &args.reason.author());
    let done = done.map_err(analysis_edit_failure)?;
    let object = serde_json::json!({
        "session": session, "contact": done.number, "position_mm": position.0,
        "was_mm": done.was.0, "depth_change_mm": done.deeper_mm(), "by": done.edit.by,
        "reason": done.edit.reason,
    });
    output.answer("correct-contact", &object, || {
        format!("{}: {}", session.display(), done.sentence())
    });
    Ok(())
}
