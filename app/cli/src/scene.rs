//! `palpate scene`: a piece of tissue that is seen and felt, without a window.

use super::Failure;
use super::new_file;
use super::output::Output;
use super::run::number;
use super::trade::with_bar;
use clap::{Args, Subcommand};
use palpate_analysis::progress::Progress;
use palpate_analysis::recorded::Replayed;
use palpate_analysis::report::scene::{bench_text, plan_text, played_text};
use palpate_analysis::scene::{Played, play, replay, scene_of};
use palpate_analysis::scene_bench::{bench, made_after, planned, planned_again};
use palpate_analysis::trade::{Extent, measure_scene};
use palpate_haptics::scene::ScenePath;
use palpate_haptics::surface::ScenePlan;
use palpate_runner::haptics::scene_file::SceneFile;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// See and feel a piece of tissue: run a scene, record it, compute a recording again
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Run a scene in real time with a hand on a path, and tell how its loop kept its time
    Run(RunArgs),
    /// Run a scene and record every tick in a new folder
    Record(RecordArgs),
    /// Measure what exactness costs on this computer, and plan a scene from its tolerances
    Bench(BenchArgs),
    /// Compute every tick of a recording again and compare bit for bit
    Replay(ReplayArgs),
    /// Print a scene file whole, with everything that it leaves to its usual value; without a file, the built-in scene
    Show(ShowArgs),
}

/// Arguments of `palpate scene run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// A scene file; without one the built-in scene of the source thesis's body
    #[arg(value_name = "SCENE.toml")]
    file: Option<PathBuf>,
    /// What the hand does: poke, press, drag or taps
    #[arg(long, default_value = "poke", value_parser = path, value_name = "PATH")]
    path: ScenePath,
    /// For how long, in s, the path gone again and again; without it once
    #[arg(long, value_parser = number, allow_negative_numbers = true, value_name = "S")]
    seconds: Option<f64>,
}

fn path(name: &str) -> Result<ScenePath, String> {
    name.parse()
}

/// Arguments of `palpate scene record`.
#[derive(Debug, Args)]
pub struct RecordArgs {
    #[command(flatten)]
    run: RunArgs,
    /// The folder to make
    #[arg(long, value_name = "DIR")]
    to: PathBuf,
}

/// Arguments of `palpate scene bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// A scene file, whose tolerances are planned for; without one those of the built-in scene
    #[arg(value_name = "SCENE.toml")]
    file: Option<PathBuf>,
    /// Meshes up to 801 nodes a side against 1601, and every family; without it up to 201 against 401
    #[arg(long)]
    full: bool,
}

/// Arguments of `palpate scene replay` and `palpate haptics replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The folder of a recording
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// Arguments of `palpate scene show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// A scene file
    #[arg(value_name = "SCENE.toml")]
    file: Option<PathBuf>,
}

#[derive(Serialize)]
struct PlayedOutput<'a> {
    #[serde(flatten)]
    played: &'a Played,
    plan: Option<&'a ScenePlan>,
    planned_again: Option<&'a ScenePlan>,
}

/// Nodes along a side with which a scene is tried whose mesh is to be planned: all else is the same on any mesh.
const COARSEST: usize = 3;

/// Longest run asked for, in s: a day.
const SECONDS_MAX: f64 = 86_400.0;

pub(super) fn run(command: &SceneCommand, output: &Output) -> Result<(), Failure> {
    match command {
        SceneCommand::Run(args) => run_scene("scene-run", args, None, output),
        SceneCommand::Record(args) => {
            new_file::check("recording", Some(&args.to))?;
            run_scene("scene-record", &args.run, Some(&args.to), output)
        }
        SceneCommand::Bench(args) => run_bench(args, output),
        SceneCommand::Replay(args) => run_replay(args, output),
        SceneCommand::Show(args) => {
            let file = read(args.file.as_deref(), output)?.text();
            let found = serde_json::json!({ "file": file });
            output.answer("scene-show", &found, || file.trim_end().to_owned());
            Ok(())
        }
    }
}

fn read(file: Option<&Path>, output: &Output) -> Result<SceneFile, Failure> {
    let (scene, notes) = scene_of(file).map_err(Failure::usage)?;
    notes.iter().for_each(|note| output.note(note));
    Ok(scene)
}

fn run_scene(
    command: &'static str,
    args: &RunArgs,
    record: Option<&Path>,
    output: &Output,
) -> Result<(), Failure> {
    let laps = match args.seconds {
        None => 1,
        Some(seconds) if seconds > 0.0 && seconds <= SECONDS_MAX => {
            (seconds / args.path.seconds()).ceil() as u32
        }
        Some(seconds) => {
            return Err(Failure::usage(format!(
                "--seconds {seconds} is not possible; give a number above 0 and up to {SECONDS_MAX}"
            )));
        }
    };
    let mut file = read(args.file.as_deref(), output)?;
    // What cannot be is told before anything is measured, or made on disk.
    file.scene(COARSEST).map_err(Failure::usage)?;
    let mut after = None;
    if file.nodes.is_none() {
        let curves = with_bar(output, |progress| measure_scene(Extent::Quick, progress))?;
        let plan = planned(&file, &curves, 1.0).map_err(|none| Failure::failed(none.why))?;
        file = made_after(&file, &plan);
        after = Some((curves, plan));
    }
    let bar = output.share_bar();
    let played = play(&file, (args.path, laps), record, &mut |share| {
        bar.share(share, "");
    });
    drop(bar);
    let played = played.map_err(Failure::failed)?;
    let plan = after.as_ref().map(|(_, plan)| plan);
    let again = after.as_ref().filter(|_| !played.is_within_budget);
    let again = again.map(|(curves, plan)| {
        let took = 1e6 * played.paced.kept.work.p99_9.0;
        planned_again(&file, curves, plan, took)
    });
    let found = PlayedOutput {
        played: &played,
        plan,
        planned_again: again.as_ref().and_then(|one| one.as_ref().ok()),
    };
    output.answer(command, &found, || {
        let mut lines = Vec::new();
        lines.extend(plan.map(plan_text));
        lines.push(played_text(&played));
        match &again {
            None => {}
            Some(Ok(plan)) => lines.push(format!("planned again: {}", plan_text(plan))),
            Some(Err(none)) => lines.push(format!("planned again: {}", none.why)),
        }
        lines.join("\n")
    });
    Ok(())
}

fn run_bench(args: &BenchArgs, output: &Output) -> Result<(), Failure> {
    let file = read(args.file.as_deref(), output)?;
    let extent = match args.full {
        true => Extent::Full,
        false => Extent::Quick,
    };
    let bench = with_bar(output, |progress| bench(&file, extent, progress))?;
    output.answer("scene-bench", &bench, || bench_text(&bench));
    Ok(())
}

fn run_replay(args: &ReplayArgs, output: &Output) -> Result<(), Failure> {
    let bar = output.share_bar();
    let replayed = replay(&args.folder, &mut |share| bar.share(share, ""));
    drop(bar);
    told("scene-replay", replayed, output)
}

/// Tells what a recording gave; one that is not as recorded is a failure.
pub(super) fn told(
    command: &str,
    replayed: Result<Replayed, String>,
    output: &Output,
) -> Result<(), Failure> {
    let replayed = replayed.map_err(Failure::usage)?;
    output.answer(command, &replayed, || replayed.words());
    replayed.failure().map_or(Ok(()), |why| Err(Failure::failed(why)))
}
