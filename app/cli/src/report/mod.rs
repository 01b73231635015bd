//! `palpate report`: targets and achieved values of a run; a page on sessions; a figure of one.

mod check;
mod figure;

use super::Failure;
use super::arguments::{Choice, choice, date_of_pages, parse_number};
use super::new_file;
use super::output::{Output, merged};
use clap::Args;
use palpate_analysis::edited_session;
use palpate_analysis::fidelity::of_session;
use palpate_analysis::report::dossier::{self, ReportError, SessionFigure, SessionReading};
use palpate_analysis::report::figures::TimeAlignment;
use palpate_analysis::report::session::fidelity_text;
use palpate_analysis::report::text::counted;
use palpate_runner::base::FoundBase;
use std::path::{Path, PathBuf};

/// Report on a run: targets and achieved values, missing samples, use of time
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Session folder; several with --html
    #[arg(value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// Write a page on the sessions as a new HTML file: one file, without scripts, to be read and printed anywhere
    #[arg(long, value_name = "FILE", conflicts_with_all = ["figure", "check"])]
    html: Option<PathBuf>,
    /// With --html, the event at which several sessions are aligned
    #[arg(long, value_parser = choice(&ALIGNMENTS), default_value = "ramp", requires = "html")]
    align: TimeAlignment,
    /// Draw a figure of the session as a new SVG or PNG file
    #[arg(long, value_name = "FILE", conflicts_with = "check")]
    figure: Option<PathBuf>,
    /// With --figure, which one
    #[arg(long, value_parser = choice(&FIGURES), default_value = "force-time", requires = "figure")]
    of: SessionFigure,
    /// With --figure, start of the time axis, in s since the first sample
    #[arg(long, value_name = "S", value_parser = parse_number, requires = "figure", allow_negative_numbers = true)]
    from: Option<f64>,
    /// With --figure, end of the time axis, in s since the first sample
    #[arg(long, value_name = "S", value_parser = parse_number, requires = "figure")]
    until: Option<f64>,
    /// With --html or --figure, apply this analysis of the sessions
    #[arg(long, value_name = "NAME", conflicts_with = "check")]
    analysis: Option<String>,
    /// Compare the files that a page describes with those of the sessions named, or of those in its folder
    #[arg(long, value_name = "FILE.html")]
    check: Option<PathBuf>,
}

const ALIGNMENTS: [Choice<TimeAlignment>; 2] = [
    ("ramp", TimeAlignment::Ramp, "Start of the ramp"),
    ("contact", TimeAlignment::Contact, "Contact"),
];

const FIGURES: [Choice<SessionFigure>; 4] = [
    ("force-time", SessionFigure::ForceTime, "Force over time"),
    ("force-depth", SessionFigure::ForceDepth, "Force over depth"),
    ("residual", SessionFigure::Residual, "The fit and its residuals"),
    ("calibration", SessionFigure::Calibration, "The calibration with its uncertainty"),
];

pub(super) fn run(args: &ReportArgs, output: &Output) -> Result<(), Failure> {
    if let Some(page) = &args.check {
        return check::run(page, &args.sessions, output);
    }
    if let Some(to) = &args.html {
        return html(args, to, output);
    }
    let [session] = args.sessions.as_slice() else {
        return Err(Failure::usage(match args.sessions.len() {
            0 => "give a session, or a page with --check",
            _ => {
                "a report covers one session; give one session, or compare several on a page with --html FILE"
            }
        }));
    };
    if let Some(to) = &args.figure {
        return figure::run(args, session, to, output);
    }
    if args.analysis.is_some() {
        return Err(Failure::usage(
            "--analysis applies only to --html and --figure; add one of them, or leave out --analysis",
        ));
    }
    fidelity(session, output)
}

fn fidelity(session: &Path, output: &Output) -> Result<(), Failure> {
    let edited = edited_session::open(session).map_err(super::source_failure)?;
    let session = &edited.session;
    session.notes.iter().for_each(|note| output.note(note));
    let fidelity = of_session(session).map_err(super::source_failure)?;
    let verdict = edited.edits.verdict();
    let verdict = verdict.map(|(verdict, edit)| (verdict, edit.reason.as_str()));
    let end = session.end.as_ref();
    let base = FoundBase::of_session(session);
    let object = serde_json::json!({
        "session_id": session.manifest.session_id,
        "ending": end.map(|end| &end.outcome), "reason": end.map(|end| &end.reason),
        "verdict": verdict.map(|(verdict, _)| verdict),
        "verdict_reason": verdict.map(|(_, reason)| reason),
    });
    output.answer("report", &merged(merged(object, &base), &fidelity), || {
        let text = fidelity_text(&fidelity, end, verdict);
        let facts = base.facts();
        let facts = facts.map(|(name, mm, error)| format!("\n{name:<10} {mm:.3} ± {error:.3} mm"));
        text + &facts.collect::<String>()
    });
    Ok(())
}

fn html(args: &ReportArgs, to: &Path, output: &Output) -> Result<(), Failure> {
    if args.sessions.is_empty() {
        return Err(Failure::usage("give the sessions that the page is about"));
    }
    new_file::check("page", Some(to))?;
    let wanted: Vec<SessionReading> = args
        .sessions
        .iter()
        .map(|session| SessionReading { session: session.clone(), analysis: args.analysis.clone() })
        .collect();
    let made_at = dossier::creation_line(date_of_pages());
    let page = dossier::write(&wanted, args.align, &made_at, &output.count_bar(0));
    let page = page.map_err(|err| match err {
        ReportError::Source(path, err) => {
            super::source_failure(*err).prefixed(&path.display().to_string())
        }
        cancelled @ ReportError::Cancelled => Failure::failed(cancelled),
    })?;
    let (claims, _) = dossier::claims(&page).map_err(Failure::failed)?;
    new_file::write("page", Some(to), || page)?;
    let files = claims.iter().map(|one| {
        serde_json::json!({
            "session_id": one.session_id, "folder": one.folder, "file": one.file, "sha256": one.sha256,
        })
    });
    let object = serde_json::json!({ "page": to, "sessions": args.sessions,
        "files": files.collect::<Vec<_>>(),
    });
    output.answer("report", &object, || {
        format!(
            "{} holds the hashes of {} of {}; 'palpate report --check {}' compares the files",
            to.display(),
            counted(claims.len(), "file"),
            counted(args.sessions.len(), "session"),
            to.display()
        )
    });
    Ok(())
}
