//! `palpate report`: what happened in a run, against what its plan said; a page on one session or several; a figure of one.

mod check;
mod figure;

use super::Failure;
use super::new_file;
use super::output::Output;
use clap::{Args, ValueEnum};
use palpate_analysis::edited;
use palpate_analysis::fidelity::of_session;
use palpate_analysis::report::dossier::{self, Figure, ReportError, Wanted};
use palpate_analysis::report::figures::Align;
use palpate_analysis::report::session::fidelity_text;
use palpate_runner::base::FoundBase;
use palpate_runner::fidelity::Fidelity;
use palpate_runner::wall_now;
use palpate_sessions::Verdict;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Tell what happened in a run: targets and what was done, missing samples, use of time
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Session folder; several with --html
    #[arg(value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// Write a page on the sessions as a new HTML file: one file, without scripts, to be read and printed anywhere
    #[arg(long, value_name = "FILE", conflicts_with_all = ["figure", "check"])]
    html: Option<PathBuf>,
    /// With --html, where several sessions are laid over each other
    #[arg(long, value_enum, default_value = "ramp", requires = "html")]
    align: AlignArg,
    /// Draw a figure of the session as a new SVG or PNG file
    #[arg(long, value_name = "FILE", conflicts_with = "check")]
    figure: Option<PathBuf>,
    /// With --figure, which one
    #[arg(long, value_enum, default_value = "force-time", requires = "figure")]
    of: FigureArg,
    /// With --figure, draw from here on: s since the first sample
    #[arg(long, value_name = "S", value_parser = super::run::number, requires = "figure", allow_negative_numbers = true)]
    from: Option<f64>,
    /// With --figure, draw to here: s since the first sample
    #[arg(long, value_name = "S", value_parser = super::run::number, requires = "figure")]
    until: Option<f64>,
    /// With --html or --figure, read the sessions as this analysis of theirs does
    #[arg(long, value_name = "NAME", conflicts_with = "check")]
    analysis: Option<String>,
    /// Compare the files that a page describes with those of the sessions named, or of those beside the page
    #[arg(long, value_name = "FILE.html")]
    check: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum AlignArg {
    /// Where the ramp begins
    Ramp,
    /// Where contact was found
    Contact,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FigureArg {
    /// Force over time
    ForceTime,
    /// Force over depth
    ForceDepth,
    /// The fit and what it leaves over
    Residual,
    /// The calibration with its uncertainty
    Calibration,
}

impl From<AlignArg> for Align {
    fn from(align: AlignArg) -> Self {
        match align {
            AlignArg::Ramp => Self::Ramp,
            AlignArg::Contact => Self::Contact,
        }
    }
}

impl From<FigureArg> for Figure {
    fn from(figure: FigureArg) -> Self {
        match figure {
            FigureArg::ForceTime => Self::ForceTime,
            FigureArg::ForceDepth => Self::ForceDepth,
            FigureArg::Residual => Self::Residual,
            FigureArg::Calibration => Self::Calibration,
        }
    }
}

#[derive(Serialize)]
struct Report<'a> {
    session_id: &'a str,
    ending: Option<&'a str>,
    reason: Option<&'a str>,
    verdict: Option<Verdict>,
    verdict_reason: Option<&'a str>,
    #[serde(flatten)]
    base: FoundBase,
    #[serde(flatten)]
    fidelity: &'a Fidelity,
}

pub(super) fn run(args: &ReportArgs, output: &Output) -> Result<(), Failure> {
    if let Some(page) = &args.check {
        return check::run(page, &args.sessions, output);
    }
    if let Some(to) = &args.html {
        return html(args, to, output);
    }
    let [session] = args.sessions.as_slice() else {
        return Err(Failure::usage(match args.sessions.len() {
            0 => "name a session, or a page with --check",
            _ => "this is for one session; name one, or compare several on a page with --html FILE",
        }));
    };
    if let Some(to) = &args.figure {
        return figure::run(args, session, to, output);
    }
    if args.analysis.is_some() {
        return Err(Failure::usage(
            "--analysis is for --html and --figure: what happened in a run is the same in every analysis",
        ));
    }
    fidelity(session, output)
}

fn fidelity(session: &Path, output: &Output) -> Result<(), Failure> {
    let edited = edited::open(session).map_err(super::source_failure)?;
    let session = &edited.session;
    session.notes.iter().for_each(|note| output.note(note));
    let fidelity = of_session(session).map_err(super::source_failure)?;
    let verdict = edited.edits.verdict();
    let verdict = verdict.map(|(verdict, edit)| (verdict, edit.reason.as_str()));
    let end = session.end.as_ref();
    let report = Report {
        session_id: &session.manifest.session_id,
        ending: end.map(|end| end.outcome.as_str()),
        reason: end.map(|end| end.reason.as_str()),
        verdict: verdict.map(|(verdict, _)| verdict),
        verdict_reason: verdict.map(|(_, reason)| reason),
        base: FoundBase::of_session(session),
        fidelity: &fidelity,
    };
    output.answer("report", &report, || {
        let told = fidelity_text(&fidelity, end, verdict);
        let facts = report.base.facts();
        let base = facts.map(|(name, mm, error)| format!("\n{name:<10} {mm:.3} ± {error:.3} mm"));
        told + &base.collect::<String>()
    });
    Ok(())
}

fn html(args: &ReportArgs, to: &Path, output: &Output) -> Result<(), Failure> {
    if args.sessions.is_empty() {
        return Err(Failure::usage("name the sessions that the page is about"));
    }
    new_file::check("page", Some(to))?;
    let wanted: Vec<Wanted> = args
        .sessions
        .iter()
        .map(|session| Wanted { session: session.clone(), analysis: args.analysis.clone() })
        .collect();
    let made = dossier::made(wall_now().into());
    let page = dossier::write(&wanted, args.align.into(), &made, &output.count_bar(0));
    let page = page.map_err(|err| match err {
        ReportError::Source(path, err) => {
            super::source_failure(*err).of(&path.display().to_string())
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
            "{}: {} of {} described by their hashes; 'palpate report --check {}' compares them",
            to.display(),
            counted(claims.len(), "file"),
            counted(args.sessions.len(), "session"),
            to.display()
        )
    });
    Ok(())
}

/// A count and its noun.
fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {noun}s"),
    }
}
