//! `palpate recalibrate`, `mask` and `withdraw`: analyses as named records beside a session.

use super::Failure;
use super::calibration::source::Source;
use super::output::Output;
use super::verdict::author;
use clap::Args;
use palpate_analysis::analysed::{self, ForceChange, record};
use palpate_analysis::report::kept;
use palpate_analysis::source::SourceError;
use palpate_sessions::analyses::{Analysed, Analysis, AnalysisError, add_analysis};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Arguments of `palpate recalibrate`.
#[derive(Debug, Args)]
pub struct RecalibrateArgs {
    /// Session folders
    #[arg(required = true, value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// A name or id of the library, a file, or thesis
    #[arg(long, value_name = "NAME|FILE")]
    calibration: String,
    /// Name of the analysis; without it "recalibrated" and the calibration's id or name
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    #[command(flatten)]
    who: Who,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `palpate mask`.
#[derive(Debug, Args)]
pub struct MaskArgs {
    /// Session folder
    session: PathBuf,
    /// Name of the analysis
    #[arg(long, value_name = "NAME")]
    name: String,
    /// A stretch whose forces do not count, in s as in the column t_s of an export; may be repeated
    #[arg(long, required = true, value_name = "FROM..TO")]
    leave_out: Vec<Span>,
    #[command(flatten)]
    who: Who,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `palpate withdraw`.
#[derive(Debug, Args)]
pub struct WithdrawArgs {
    /// Session folder
    session: PathBuf,
    /// Name of the analysis that shall not count any more; its record stays
    name: String,
    #[command(flatten)]
    who: Who,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Who makes an analysis, and why.
#[derive(Debug, Args)]
pub(super) struct Who {
    /// Why, in a few words
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub reason: String,
    /// Who says so; without it the login name
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
}

/// A stretch of time in s.
#[derive(Clone, Copy, Debug)]
struct Span([f64; 2]);

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let ends = text.split_once("..");
        match ends.map(|(from, to)| (number(from), number(to))) {
            Some((Some(from), Some(to))) if from.is_finite() && to.is_finite() && from <= to => {
                Ok(Self([from, to]))
            }
            _ => Err("write two times in s, the earlier first, as in 12.5..14".to_owned()),
        }
    }
}

/// Keeps a record, or says why not.
pub(super) fn keep(folder: &Path, session_id: &str, analysis: &Analysis) -> Result<(), Failure> {
    add_analysis(folder, session_id, analysis)
        .map_err(|err| super::source_failure(SourceError::from(err)))
}

#[derive(Serialize)]
struct Recalibrated {
    session: PathBuf,
    #[serde(flatten)]
    change: ForceChange,
}

pub(super) fn recalibrate(args: &RecalibrateArgs, output: &Output) -> Result<(), Failure> {
    let source = Source::find(&args.calibration)?;
    let own = source.id.as_ref().unwrap_or(&source.calibration.name);
    let name = args
        .name
        .clone()
        .unwrap_or_else(|| format!("recalibrated {own}"));
    let by = author(args.who.by.as_deref());
    let bar = output.count_bar(args.sessions.len() as u64);
    let mut done = Vec::new();
    for session in &args.sessions {
        bar.set_message(session.display().to_string());
        let made = analysed::recalibration(session, &source.calibration);
        let (opened, inputs, what, change) = made.map_err(super::source_failure)?;
        let analysis = record(&name, &by, &args.who.reason, inputs, what);
        keep(
            session,
            &opened.edited.session.manifest.session_id,
            &analysis,
        )?;
        let rig = opened.edited.session.manifest.rig.as_ref();
        for doubt in source.doubts(rig.map_or("", |rig| rig.name.as_str())) {
            bar.suspend(|| output.note(&format!("{}: {doubt}", session.display())));
        }
        done.push(Recalibrated {
            session: session.clone(),
            change,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let object = serde_json::json!({
        "command": "recalibrate", "analysis": name, "calibration": source.calibration.name,
        "calibration_id": source.id, "by": by, "sessions": done,
    });
    output.result(&object, || {
        let line = |one: &Recalibrated| {
            format!("{}: {}", one.session.display(), kept::change(&one.change))
        };
        let mut lines: Vec<String> = done.iter().map(line).collect();
        lines.push(format!(
            "kept as analysis '{name}'; read with --analysis '{name}' of fit and export"
        ));
        lines.join("\n")
    });
    Ok(())
}

pub(super) fn mask(args: &MaskArgs, output: &Output) -> Result<(), Failure> {
    let opened = analysed::open(&args.session, None).map_err(super::source_failure)?;
    let spans: Vec<[f64; 2]> = args.leave_out.iter().map(|span| span.0).collect();
    let blanked = |opened: &analysed::Opened| {
        let rows = opened.edited.session.rows.iter();
        rows.filter(|row| row.force.is_some()).count()
    };
    let inputs = opened
        .inputs(&args.session, None)
        .map_err(|err| super::source_failure(err.into()))?;
    let before = blanked(&opened);
    let mut masked = opened;
    masked.left_out_s.clone_from(&spans);
    masked.blank();
    let left_out = before - blanked(&masked);
    if left_out == 0 {
        return Err(Failure::usage(
            "the session has no force in these stretches, so nothing would be left out; see t_s of 'palpate export'",
        ));
    }
    let by = author(args.who.by.as_deref());
    let what = Analysed::Mask { left_out_s: spans };
    let analysis = record(&args.name, &by, &args.who.reason, inputs, what);
    let id = &masked.edited.session.manifest.session_id;
    keep(&args.session, id, &analysis)?;
    let object = serde_json::json!({
        "command": "mask", "session": args.session, "analysis": analysis.name, "by": by,
        "left_out": left_out, "of": before,
    });
    output.result(&object, || {
        format!(
            "{}: {left_out} of {before} forces are left out by analysis '{}'",
            args.session.display(),
            analysis.name
        )
    });
    Ok(())
}

pub(super) fn withdraw(args: &WithdrawArgs, output: &Output) -> Result<(), Failure> {
    let opened = analysed::open(&args.session, None).map_err(super::source_failure)?;
    let by = author(args.who.by.as_deref());
    let withdrawal = Analysed::Withdrawal;
    let analysis = record(&args.name, &by, &args.who.reason, Vec::new(), withdrawal);
    let id = &opened.edited.session.manifest.session_id;
    keep(&args.session, id, &analysis)?;
    let object = serde_json::json!({
        "command": "withdraw", "session": args.session, "analysis": analysis.name, "by": by,
        "reason": analysis.reason,
    });
    output.result(&object, || {
        format!(
            "{}: analysis '{}' does not count any more: {}",
            args.session.display(),
            analysis.name,
            analysis.reason
        )
    });
    Ok(())
}

/// An analysis that cannot be had: names are the user's, files are not.
pub(super) fn failure(err: AnalysisError) -> Failure {
    match err {
        AnalysisError::Chain(_) | AnalysisError::Input { .. } | AnalysisError::Lock(_) => {
            Failure::failed(err)
        }
        AnalysisError::Session(err) => super::read_failure(err),
        _ => Failure::usage(err),
    }
}
