//! `palpate scene`: a visual and haptic piece of tissue, without a window.

use super::Failure;
use super::arguments::{above_zero, parse_number};
use super::new_file;
use super::output::Output;
use super::terminal::ctrl_c_flag;
use super::trade::with_bar;
use clap::{Args, Subcommand};
use palpate_analysis::population::library_member;
use palpate_analysis::progress::Progress;
use palpate_analysis::report::scene::{bench_text, device_lines, plan_text, played_text};
use palpate_analysis::scene::{SceneHand, SceneRun, check_scene, play_scene, read_scene, replay};
use palpate_analysis::scene_bench::{bench, plan_scene, replan_scene, scene_from_plan};
use palpate_analysis::scene_device::{DeviceName, OpenDevice, SceneToTouch, open_device};
use palpate_analysis::tick_replay::ReplayResult;
use palpate_analysis::trade::{TradeExtent, measure_scene};
use palpate_haptics::scene::ScenePath;
use palpate_haptics::surface::ScenePlan;
use palpate_runner::haptics::scene_file::SceneFile;
use serde::Serialize;
use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// See and feel a piece of tissue: run a scene, record it, replay a recording
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Run a scene in real time with a hand on a path, and report the timing of its loop
    Run(SceneRunArgs),
    /// Run a scene and record every tick in a new folder
    Record(SceneRecordArgs),
    /// Measure what exactness costs on this computer, and plan a scene from its tolerances
    Bench(SceneBenchArgs),
    /// Compute every tick of a recording again and compare bit for bit
    Replay(RecordingReplayArgs),
    /// Print a scene file with all defaults filled in; without a file, the built-in scene
    Show(SceneShowArgs),
}

/// Arguments of `palpate scene run`.
#[derive(Debug, Args)]
pub struct SceneRunArgs {
    /// A scene file; without one the built-in scene with the model of the source thesis
    #[arg(value_name = "SCENE.toml")]
    file: Option<PathBuf>,
    /// What the hand does: poke, press, drag or taps
    #[arg(long, default_value = "poke", value_parser = path, value_name = "PATH")]
    path: ScenePath,
    /// Tissue of a specimen of a population, population:NAME#NUMBER, instead of that of the scene file
    #[arg(long, value_name = "SPECIMEN")]
    specimen: Option<String>,
    /// A haptic device instead of the simulated hand: inverse, inverse:NAME where several are connected, or hapi:PORT for a 2DIY in its home position
    #[arg(long, value_name = "DEVICE", value_parser = device_name, conflicts_with = "path")]
    device: Option<DeviceName>,
    /// Where the service of an inverse listens, ADDRESS:PORT
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        default_value = "127.0.0.1:10001",
        requires = "device"
    )]
    service: SocketAddr,
    /// Duration in s, during which the path repeats; without it the path runs once, and a device is used until Ctrl-C
    #[arg(long, value_parser = parse_number, allow_negative_numbers = true, value_name = "S")]
    seconds: Option<f64>,
}

fn device_name(text: &str) -> Result<DeviceName, String> {
    text.parse().map_err(str::to_owned)
}

fn path(name: &str) -> Result<ScenePath, String> {
    name.parse()
}

/// Arguments of `palpate scene record`.
#[derive(Debug, Args)]
pub struct SceneRecordArgs {
    #[command(flatten)]
    run: SceneRunArgs,
    /// The folder to make
    #[arg(long, value_name = "DIR")]
    to: PathBuf,
}

/// Arguments of `palpate scene bench`.
#[derive(Debug, Args)]
pub struct SceneBenchArgs {
    /// A scene file, whose tolerances are planned for; without one those of the built-in scene
    #[arg(value_name = "SCENE.toml")]
    file: Option<PathBuf>,
    /// Compare meshes up to 801 nodes a side with one of 1601, for every family; without it up to 201 with one of 401
    #[arg(long)]
    full: bool,
}

/// Arguments of `palpate scene replay` and `palpate haptics replay`.
#[derive(Debug, Args)]
pub struct RecordingReplayArgs {
    /// The folder of a recording
    #[arg(value_name = "DIR")]
    pub(super) folder: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// Arguments of `palpate scene show`.
#[derive(Debug, Args)]
pub struct SceneShowArgs {
    /// A scene file
    #[arg(value_name = "SCENE.toml")]
    file: Option<PathBuf>,
}

#[derive(Serialize)]
struct PlayedOutput<'a> {
    #[serde(flatten)]
    played: &'a SceneRun,
    plan: Option<&'a ScenePlan>,
    planned_again: Option<&'a ScenePlan>,
}

/// A day, in s.
const SECONDS_MAX: f64 = 86_400.0;

pub(super) fn run(command: &SceneCommand, output: &Output) -> Result<(), Failure> {
    match command {
        SceneCommand::Run(args) => run_scene("scene-run", args, None, output),
        SceneCommand::Record(args) => {
            new_file::check("recording", Some(&args.to))?;
            run_scene("scene-record", &args.run, Some(&args.to), output)
        }
        SceneCommand::Bench(args) => run_bench(args, output),
        SceneCommand::Replay(args) => report_replay("scene-replay", args, replay, output),
        SceneCommand::Show(args) => {
            let file = read(args.file.as_deref(), output)?.text();
            let found = serde_json::json!({ "file": file });
            output.answer("scene-show", &found, || file.trim_end().to_owned());
            Ok(())
        }
    }
}

fn read(file: Option<&Path>, output: &Output) -> Result<SceneFile, Failure> {
    let (scene, notes) = read_scene(file).map_err(Failure::usage)?;
    notes.iter().for_each(|note| output.note(note));
    Ok(scene)
}

fn run_scene(
    command: &'static str,
    args: &SceneRunArgs,
    record: Option<&Path>,
    output: &Output,
) -> Result<(), Failure> {
    let seconds = args.seconds.map(|one| above_zero("seconds", one, SECONDS_MAX, "s"));
    let seconds = seconds.transpose()?;
    let mut file = read(args.file.as_deref(), output)?;
    refuse_on_mesh(args, &file)?;
    if let Some(specimen) = &args.specimen {
        file.body = library_member(specimen).map_err(Failure::usage)?.body;
        file.name.clone_from(specimen);
    }
    // An impossible scene is refused before anything is measured or written.
    let scene = check_scene(&file).map_err(Failure::usage)?;
    let opened = args.device.as_ref().map(|name| device(args, name, &scene, output));
    let opened = opened.transpose()?;
    if let Some(device) = &opened {
        file.device = *device.device.settings();
    }
    let is_ending = ctrl_c_flag()?;
    let mut after = None;
    if file.nodes.is_none() {
        let curves = with_bar(output, |progress| measure_scene(TradeExtent::Quick, progress))?;
        let plan = plan_scene(&file, &curves, 1.0).map_err(|none| Failure::failed(none.reason))?;
        file = scene_from_plan(&file, &plan);
        after = Some((curves, plan));
    }
    let hand = match opened {
        Some(device) => SceneHand::OnDevice { device, seconds, is_ending: &is_ending },
        None => {
            let laps = seconds.map_or(1, |seconds| (seconds / args.path.seconds()).ceil() as u32);
            SceneHand::Simulated(args.path, laps)
        }
    };
    let played = output
        .with_share_bar(|bar| {
            play_scene(&file, hand, record, &mut |share| {
                bar.share(share, "");
            })
        })
        .map_err(Failure::failed)?;
    let plan = after.as_ref().map(|(_, plan)| plan);
    let again = after.as_ref().filter(|_| !played.is_within_budget);
    let again = again.map(|(curves, plan)| {
        let took = 1e6 * played.paced.statistics.work.p99_9.0;
        replan_scene(&file, curves, plan, took)
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
            Some(Err(none)) => lines.push(format!("planned again: {}", none.reason)),
        }
        lines.join("\n")
    });
    Ok(())
}

/// What a scene on a mesh has no part of.
fn refuse_on_mesh(args: &SceneRunArgs, file: &SceneFile) -> Result<(), Failure> {
    let Some(mesh) = &file.mesh else { return Ok(()) };
    if args.specimen.is_some() && !mesh.bodies.is_empty() {
        return Err(Failure::usage(
            "the mesh of the scene has its own force models; leave out --specimen, or name the specimen in mesh.bodies",
        ));
    }
    Ok(())
}

/// Opens the device, and says what is to be known before the first touch.
fn device(
    args: &SceneRunArgs,
    name: &DeviceName,
    scene: &SceneToTouch,
    output: &Output,
) -> Result<OpenDevice, Failure> {
    let choice = name.clone().at(args.service);
    let (opened, report) = open_device(&choice, scene).map_err(Failure::failed)?;
    device_lines(&report).iter().for_each(|line| output.note(line));
    // Until the scene ticks there is no force.
    if !report.has_button && std::io::stdin().is_terminal() {
        output.note("press Enter to start; there is no force before");
        let pressed = std::io::stdin().read_line(&mut String::new());
        if !pressed.is_ok_and(|bytes| bytes > 0) {
            let why = "the terminal was closed before Enter was pressed; the scene was not started";
            return Err(Failure::failed(why));
        }
    }
    Ok(opened)
}

fn run_bench(args: &SceneBenchArgs, output: &Output) -> Result<(), Failure> {
    let file = read(args.file.as_deref(), output)?;
    if file.mesh.is_some() {
        return Err(Failure::usage(
            "the triangles of a mesh from a file are not planned; give a scene without mesh.file",
        ));
    }
    let extent = match args.full {
        true => TradeExtent::Full,
        false => TradeExtent::Quick,
    };
    let bench = with_bar(output, |progress| bench(&file, extent, progress))?;
    output.answer("scene-bench", &bench, || bench_text(&bench));
    Ok(())
}

/// Replays a recording and prints the result; a difference is a failure.
pub(super) fn report_replay(
    command: &str,
    args: &RecordingReplayArgs,
    replay: impl FnOnce(&Path, &mut dyn FnMut(f64) -> bool) -> Result<ReplayResult, String>,
    output: &Output,
) -> Result<(), Failure> {
    let replayed = output
        .with_share_bar(|bar| replay(&args.folder, &mut |share| bar.share(share, "")))
        .map_err(Failure::usage)?;
    output.answer(command, &replayed, || replayed.words());
    replayed.failure().map_or(Ok(()), |reason| Err(Failure::failed(reason)))
}
