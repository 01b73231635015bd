//! `palpate correct-contact`: where a session really found contact, beside its log.

use super::Failure;
use super::output::Output;
use super::recalibrate::deed_failure;
use super::verdict::Why;
use clap::Args;
use palpate_analysis::analyses;
use palpate_model::units::Position;
use std::path::PathBuf;

/// Correct where a session found contact; its log stays as it is
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
}

pub(super) fn run(args: &CorrectArgs, output: &Output) -> Result<(), Failure> {
    let (session, position) = (&args.session, Position(args.position));
    let done = analyses::correct(session, args.contact, position, &args.why.who());
    let done = done.map_err(deed_failure)?;
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
