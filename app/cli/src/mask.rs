//! `palpate mask`: excludes stretches of a session, as a named analysis.

use super::Failure;
use super::arguments::parse_number;
use super::output::Output;
use super::recalibrate::{AuthorArgs, analysis_edit_failure};
use clap::Args;
use palpate_analysis::progress::NoProgress;
use palpate_analysis::session_actions;
use std::path::PathBuf;
use std::str::FromStr;

/// Exclude stretches of a session from evaluation, as a named analysis
#[derive(Debug, Args)]
pub struct MaskArgs {
    /// Session folder
    session: PathBuf,
    /// Name of the analysis
    #[arg(long, value_name = "NAME")]
    name: String,
    /// A stretch to exclude, in s as in the column t_s of an export; may be repeated
    #[arg(long, required = true, value_name = "FROM..TO")]
    leave_out: Vec<Span>,
    #[command(flatten)]
    author: AuthorArgs,
}

/// A stretch of time in s.
#[derive(Clone, Copy, Debug)]
struct Span([f64; 2]);

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| parse_number(text.trim()).ok();
        let ends = text.split_once("..");
        match ends.map(|(from, to)| (number(from), number(to))) {
            Some((Some(from), Some(to))) if from.is_finite() && to.is_finite() && from <= to => {
                Ok(Self([from, to]))
            }
            _ => Err("give two times in s, the earlier first, as in 12.5..14".to_owned()),
        }
    }
}

pub(super) fn run(args: &MaskArgs, output: &Output) -> Result<(), Failure> {
    let spans = args.leave_out.iter().map(|span| span.0).collect();
    let (session, author) = (&args.session, args.author.author());
    let masked = session_actions::mask(session, &args.name, spans, &author, &NoProgress);
    let masked = masked.map_err(analysis_edit_failure)?;
    let (left_out, of, name) = (masked.left_out, masked.of, &masked.analysis.name);
    let object = serde_json::json!({
        "session": session, "analysis": name, "by": author.by, "left_out": left_out, "of": of,
    });
    output.answer("mask", &object, || {
        format!(
            "{}: analysis '{name}' excludes {left_out} of {of} force samples",
            session.display()
        )
    });
    Ok(())
}
