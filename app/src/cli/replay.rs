//! `palpate replay`: recorded sessions through the same engine again.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_protocols::replay::{ReplayError, ReplayReport, blessings_of, replay};
use palpate_sessions::log::Session;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `palpate replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// Session folders
    #[arg(required = true)]
    sessions: Vec<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Replayed {
    session: PathBuf,
    #[serde(flatten)]
    report: ReplayReport,
}

#[derive(Serialize)]
struct Replays {
    command: &'static str,
    sessions: Vec<Replayed>,
    differing: usize,
}

pub(super) fn run(args: &ReplayArgs, output: &Output) -> Result<(), Failure> {
    let bar = output.bar(args.sessions.len() as u64);
    let mut sessions = Vec::new();
    for path in &args.sessions {
        bar.set_message(path.display().to_string());
        let report = replay_one(path, output)?;
        sessions.push(Replayed {
            session: path.clone(),
            report,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let differing = sessions
        .iter()
        .filter(|one| one.report.first_difference.is_some())
        .count();
    let replays = Replays {
        command: "replay",
        sessions,
        differing,
    };
    output.result(&replays, || {
        replays
            .sessions
            .iter()
            .map(text)
            .collect::<Vec<_>>()
            .join("\n")
    });
    if differing > 0 {
        return Err(Failure::failed(format!(
            "{differing} of {} sessions differ from what the engine decides now",
            replays.sessions.len()
        )));
    }
    Ok(())
}

fn replay_one(path: &Path, output: &Output) -> Result<ReplayReport, Failure> {
    let session = Session::open(path).map_err(super::read_failure)?;
    session.notes.iter().for_each(|note| output.note(note));
    let blessings = blessings_of(path).map_err(Failure::usage)?;
    replay(&session, &blessings).map_err(|err| {
        let sentence = format!("{err}: {}", path.display());
        match err {
            ReplayError::Imported { .. } => Failure::Usage(sentence),
            _ => Failure::Failed(sentence),
        }
    })
}

fn text(replayed: &Replayed) -> String {
    let report = &replayed.report;
    let name = replayed.session.display();
    if let Some(difference) = &report.first_difference {
        return format!(
            "{name}: {} differs first at {:.3} s (after sample {}){}\n  recorded {}\n  now      {}",
            difference.what,
            difference.at_s,
            difference.after_sample,
            difference
                .decision
                .map(|index| format!(", decision {index}"))
                .unwrap_or_default(),
            difference.recorded,
            difference.now
        );
    }
    let decisions = match (report.is_same_engine, report.blessed) {
        (false, _) => "decisions not compared, another engine version made them".to_string(),
        (true, 0) => format!("{} decisions identical", report.decisions),
        (true, blessed) => format!(
            "{} decisions, {blessed} of them differ as blessed",
            report.decisions
        ),
    };
    format!(
        "{name}: {} samples, {decisions}; force within {:.1e} N, depth within {:.1e} mm",
        report.samples, report.force_difference_n, report.depth_difference_mm
    )
}
