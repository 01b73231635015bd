//! `palpate replay`: replays recorded sessions through the engine.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_analysis::source::calibration_of;
use palpate_analysis::window_requests::{PlaybackRequest, WindowOpener};
use palpate_model::units::Newtons;
use palpate_runner::TimeScale;
use palpate_runner::replay::{Player, ReplayError, ReplayReport, blessings_of, replay};
use palpate_sessions::log::Session;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Replay recorded sessions through the engine and compare
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// Session folders
    #[arg(required = true)]
    sessions: Vec<PathBuf>,
    /// Fail also where a session is incomplete
    #[arg(long)]
    check: bool,
    /// Show one session in a window, as it was at any moment
    #[arg(long, conflicts_with_all = ["check", "json"])]
    window: bool,
    /// With --window: session seconds per second to begin with, or max
    #[arg(long, requires = "window", default_value = "1")]
    time_scale: TimeScale,
}

#[derive(Serialize)]
struct Replayed {
    session: PathBuf,
    #[serde(flatten)]
    report: ReplayReport,
}

pub(super) fn run(
    args: &ReplayArgs,
    windows: Option<&dyn WindowOpener>,
    output: &Output,
) -> Result<(), Failure> {
    if args.window {
        return show(args, windows, output);
    }
    let bar = output.bar(args.sessions.len() as u64);
    let mut sessions = Vec::new();
    for path in &args.sessions {
        bar.set_message(path.display().to_string());
        let report = replay_one(path, args.check, output)?;
        sessions.push(Replayed { session: path.clone(), report });
        bar.inc(1);
    }
    drop(bar);
    let differing = sessions.iter().filter(|one| one.report.first_difference.is_some()).count();
    let object = serde_json::json!({ "sessions": sessions, "differing": differing });
    output.answer("replay", &object, || sessions.iter().map(text).collect::<Vec<_>>().join("\n"));
    if differing > 0 {
        return Err(Failure::failed(format!(
            "the engine now decides differently in {differing} of {} sessions",
            sessions.len()
        )));
    }
    Ok(())
}

/// One session in a window.
fn show(
    args: &ReplayArgs,
    windows: Option<&dyn WindowOpener>,
    output: &Output,
) -> Result<(), Failure> {
    let windows = windows.ok_or_else(|| Failure::usage(super::NO_WINDOW))?;
    let [path] = args.sessions.as_slice() else {
        return Err(Failure::usage("--window shows one session; give one session"));
    };
    let session = Session::open(path).map_err(super::read_failure)?;
    session.notes.iter().for_each(|note| output.note(note));
    let calibration = calibration_of(&session).map_err(super::source_failure)?;
    let force_max = session.manifest.limits.map(|limits| limits.force_max);
    let player = Player::new(session, path.clone()).map_err(|err| failure(&err, path))?;
    let name = path.file_name().unwrap_or(path.as_os_str());
    windows
        .playback(PlaybackRequest {
            player,
            calibration,
            force_max: force_max.unwrap_or(Newtons(0.0)),
            name: name.to_string_lossy().into_owned(),
            scale: args.time_scale,
        })
        .map_err(Failure::Failed)
}

fn failure(err: &ReplayError, path: &Path) -> Failure {
    let sentence = format!("{err}: {}", path.display());
    match err {
        ReplayError::Imported { .. } => Failure::Usage(sentence),
        _ => Failure::Failed(sentence),
    }
}

fn replay_one(path: &Path, is_strict: bool, output: &Output) -> Result<ReplayReport, Failure> {
    let session = Session::open(path).map_err(super::read_failure)?;
    session.notes.iter().for_each(|note| output.note(note));
    if is_strict && !session.is_whole() {
        let reason = session.notes.join("; ");
        return Err(Failure::failed(format!("{} is not whole: {reason}", path.display())));
    }
    let blessings = blessings_of(path).map_err(Failure::usage)?;
    replay(&session, &blessings).map_err(|err| failure(&err, path))
}

fn text(replayed: &Replayed) -> String {
    let report = &replayed.report;
    let name = replayed.session.display();
    if let Some(difference) = &report.first_difference {
        let (mut recorded, mut now) = (difference.recorded_words(), difference.now_words());
        // Words round numbers; a difference in a later digit is shown unrounded.
        if recorded == now {
            (recorded, now) = (difference.recorded.to_string(), difference.now.to_string());
        }
        return format!(
            "{name}: {} differs first at {:.3} s, in {} (after sample {}{})\n  recorded {recorded}\n  now      {now}",
            difference.what,
            difference.at_s,
            difference.step,
            difference.after_sample,
            difference.decision.map(|index| format!(", decision {index}")).unwrap_or_default(),
        );
    }
    let decisions = match (report.is_same_engine, report.blessed) {
        (false, _) => {
            "decisions not compared, because another engine version made them".to_string()
        }
        (true, 0) => format!("{} decisions identical", report.decisions),
        (true, blessed) => {
            format!(
                "{} decisions, {blessed} of them with a difference that blessed.json allows",
                report.decisions
            )
        }
    };
    format!(
        "{name}: {} samples, {decisions}; force agrees within {:.1e} N, depth within {:.1e} mm",
        report.samples, report.force_difference_n, report.depth_difference_mm
    )
}
