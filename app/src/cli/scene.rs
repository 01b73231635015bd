//! `palpate scene`: a piece of tissue that is seen and felt, without a window.

use super::Failure;
use super::new_file;
use super::output::Output;
use super::run::number;
use crate::report::scene::{played_text, replayed_text};
use crate::workers::scene::{Played, Replayed, play, replay, scene_of};
use clap::{Args, Subcommand};
use palpate_model::scene::ScenePath;
use palpate_protocols::haptics::scene_file::SceneFile;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What to do with a scene.
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Run a scene in real time with a hand on a path, and tell how its loop kept its time
    Run(RunArgs),
    /// Run a scene and record every tick in a new folder
    Record(RecordArgs),
    /// Compute every tick of a recording again and compare bit for bit
    Replay(ReplayArgs),
    /// Print a scene file whole, with everything that it leaves to its usual value; without a file, the built-in scene
    Show(ShowArgs),
}

impl SceneCommand {
    /// Whether one JSON object is wanted.
    #[must_use]
    pub fn is_json(&self) -> bool {
        match self {
            Self::Run(args) => args.json,
            Self::Record(args) => args.run.json,
            Self::Replay(args) => args.json,
            Self::Show(args) => args.json,
        }
    }
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
    /// Print one JSON object
    #[arg(long)]
    json: bool,
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

/// Arguments of `palpate scene replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The folder of a recording
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Arguments of `palpate scene show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// A scene file
    #[arg(value_name = "SCENE.toml")]
    file: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct PlayedOutput<'a> {
    command: &'static str,
    #[serde(flatten)]
    played: &'a Played,
}

#[derive(Serialize)]
struct ReplayOutput<'a> {
    command: &'static str,
    #[serde(flatten)]
    replayed: &'a Replayed,
}

#[derive(Serialize)]
struct ShowOutput {
    command: &'static str,
    file: String,
}

/// Longest run asked for, in s: a day.
const SECONDS_MAX: f64 = 86_400.0;

pub(super) fn run(command: &SceneCommand, output: &Output) -> Result<(), Failure> {
    match command {
        SceneCommand::Run(args) => run_scene("scene-run", args, None, output),
        SceneCommand::Record(args) => {
            new_file::check("recording", Some(&args.to))?;
            run_scene("scene-record", &args.run, Some(&args.to), output)
        }
        SceneCommand::Replay(args) => run_replay(args, output),
        SceneCommand::Show(args) => {
            let file = read(args.file.as_deref(), output)?.text();
            let found = ShowOutput {
                command: "scene-show",
                file: file.clone(),
            };
            output.result(&found, || file.trim_end().to_owned());
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
    let file = read(args.file.as_deref(), output)?;
    // What cannot be is told before anything is made on disk.
    file.scene(NODES).map_err(Failure::usage)?;
    let bar = output.share_bar(1000);
    let played = play(&file, NODES, (args.path, laps), record, &mut |share| {
        bar.set_position((1000.0 * share) as u64);
    });
    bar.finish_and_clear();
    let played = played.map_err(Failure::failed)?;
    let found = PlayedOutput {
        command,
        played: &played,
    };
    output.result(&found, || played_text(&played));
    Ok(())
}

fn run_replay(args: &ReplayArgs, output: &Output) -> Result<(), Failure> {
    let bar = output.share_bar(1000);
    let replayed = replay(&args.folder, &mut |share| {
        bar.set_position((1000.0 * share) as u64);
    });
    bar.finish_and_clear();
    let replayed = replayed.map_err(Failure::usage)?;
    let found = ReplayOutput {
        command: "scene-replay",
        replayed: &replayed,
    };
    output.result(&found, || replayed_text(&replayed));
    match &replayed.first {
        None => Ok(()),
        Some(first) => Err(Failure::failed(format!(
            "tick {}: {} is {} and was recorded as {}; the program, its settings or the recording changed",
            first.tick, first.column, first.computed, first.recorded
        ))),
    }
}
