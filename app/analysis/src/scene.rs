//! A scene in real time, its recording and its replay.

use super::haptics::{LoopMeasurement, fit_haptic_body};
use super::scene_device::{DeviceUse, SceneToTouch};
use super::scene_mesh::{MeshReport, read_mesh_scene, resolve_mesh, source_path};
use super::tick_replay::{
    FinishedRecording, RecordedTicks, ReplayResult, Replayable, replay_ticks,
};
use palpate_haptic_devices::InverseDevice;
use palpate_haptics::scene::{
    MeshScene, NoForceReason, Pose, Scene, ScenePath, SceneStart, SceneTick, SimulatedDevice,
};
use palpate_runner::haptics::scene::{
    COLUMNS, Columns, SENSED_COLUMNS, SceneRecorder, SceneRow, scene_input, scene_row,
};
use palpate_runner::haptics::scene_file::SceneFile;
use palpate_runner::haptics::{LoopScene, SceneEnd, SceneFrame, SceneLoop};
use palpate_sessions::ticks::{SETTINGS_FILE, TickRecording, has_columns};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Interval between two looks at a running scene: half a frame.
const LOOK: Duration = Duration::from_millis(8);

/// A scene file with its body, and what is to be known of that; without a file the scene that is built in. Its tissue is a square.
pub fn read_scene(file: Option<&Path>) -> Result<(SceneFile, Vec<String>), String> {
    let read = read_any_scene(file)?;
    match (&read.0.mesh, file) {
        (Some(_), Some(path)) => Err(format!(
            "the tissue of {} is a mesh, which only the command line runs so far; open a scene without mesh.file here",
            path.display()
        )),
        _ => Ok(read),
    }
}

/// The same, its tissue a square or a mesh. Paths of a mesh become absolute, with the SHA-256 of what is there.
pub fn read_any_scene(file: Option<&Path>) -> Result<(SceneFile, Vec<String>), String> {
    let Some(path) = file else { return Ok((SceneFile::default(), Vec::new())) };
    let called = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|err| format!("cannot read {called} ({err}); give a scene file"))?;
    let mut scene = SceneFile::parse(&called, &text)?;
    let mut notes = Vec::new();
    // A source is named from where its file is.
    let folder = path.parent().unwrap_or(Path::new(""));
    if let Some(source) = scene.source.take() {
        let found = fit_haptic_body(&source_path(folder, &source))?;
        scene.body = found.body;
        notes = found.notes;
    }
    if let Some(mesh) = &mut scene.mesh {
        let found = resolve_mesh(mesh, folder).map_err(|err| format!("{called}: {err}"))?;
        notes.extend(found);
    }
    Ok((scene, notes))
}

/// Refuses a scene that cannot be, before anything is measured or written. The check of a square is the same on any number of nodes.
pub fn check_scene(file: &SceneFile) -> Result<SceneToTouch, String> {
    const COARSEST: usize = 3;
    let Some(mesh) = &file.mesh else {
        let settings = *file.scene(COARSEST)?.settings();
        let start = SceneStart::of_square(&settings);
        return Ok(SceneToTouch { settings, bodies: Vec::new(), start });
    };
    let (scene, _) = read_mesh_scene(file, mesh, None)?;
    Ok(SceneToTouch {
        settings: *scene.settings(),
        bodies: mesh.bodies.iter().filter_map(|one| one.body).collect(),
        start: scene.start(),
    })
}

/// Result of a scene that ran in real time.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRun {
    pub name: String,
    /// The hand's path; `device` where a person's hand led a real one.
    pub path: &'static str,
    /// Nodes along a side of a square.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshReport>,
    pub ticks: u64,
    /// Greatest depth of a frame in mm.
    pub depth_max_mm: f64,
    /// Largest force of a frame in N.
    pub force_max_n: f64,
    /// Reasons for reduced force, with their share of the frames.
    pub why: Vec<(&'static str, f64)>,
    /// Hash of the surface at the end.
    pub surface_hash: String,
    /// The budget of a tick in microseconds, and whether 999 ticks in a thousand kept to it.
    pub tick_us: f64,
    pub is_within_budget: bool,
    /// How the connection to a real device was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<DeviceUse>,
    #[serde(flatten)]
    pub paced: LoopMeasurement,
}

/// Who leads the stylus.
pub enum SceneHand<'a> {
    /// The simulated hand, along a path so many times.
    Simulated(ScenePath, u32),
    /// A person's hand on a device that was opened for this scene, for so many seconds or until the flag is set.
    OnDevice { device: Box<InverseDevice>, seconds: Option<f64>, is_ending: &'a AtomicBool },
}

/// What a scene that plays shows of its newest tick.
trait Shown: LoopScene {
    fn shown(frame: &Self::Frame) -> &SceneTick;
    /// Ticks since the start.
    fn ticks(&self) -> u64;
}

impl Shown for Scene {
    fn shown(frame: &SceneFrame) -> &SceneTick {
        &frame.tick
    }

    fn ticks(&self) -> u64 {
        Scene::ticks(self)
    }
}

impl Shown for MeshScene {
    fn shown(frame: &SceneTick) -> &SceneTick {
        frame
    }

    fn ticks(&self) -> u64 {
        self.last().tick
    }
}

/// Runs a scene, its mesh known, in real time, and records it in a new folder if one is given.
pub fn play_scene(
    file: &SceneFile,
    hand: SceneHand<'_>,
    record: Option<&Path>,
    progress: &mut dyn FnMut(f64),
) -> Result<SceneRun, String> {
    if let Some(mesh) = &file.mesh {
        let (scene, report) = read_mesh_scene(file, mesh, None)?;
        let played = play(file, scene, hand, record, progress)?;
        return Ok(SceneRun { mesh: Some(report), ..played });
    }
    let nodes = file.nodes.ok_or("the scene has no number of nodes; report this bug in palpate")?;
    let scene = file.scene(nodes)?;
    let played = play(file, scene, hand, record, progress)?;
    Ok(SceneRun { nodes: Some(nodes), ..played })
}

fn play<S: Shown>(
    file: &SceneFile,
    scene: S,
    hand: SceneHand<'_>,
    record: Option<&Path>,
    progress: &mut dyn FnMut(f64),
) -> Result<SceneRun, String> {
    let period = scene.period();
    let start = |columns| {
        record.map(|folder| SceneRecorder::start(folder, &file.text(), columns)).transpose()
    };
    let no_flag = AtomicBool::new(false);
    let (mut live, whole, path, monitor, is_ending) = match hand {
        SceneHand::Simulated(path, laps) => {
            let live = SceneLoop::start_laps(scene, (Some(path), laps), start(COLUMNS)?)?;
            let whole = path.seconds() * f64::from(laps);
            (live, Some(whole), path.name(), None, &no_flag)
        }
        SceneHand::OnDevice { device, seconds, is_ending } => {
            let monitor = device.monitor();
            let live = SceneLoop::start_on_device(device, scene, start(SENSED_COLUMNS)?)?;
            (live, seconds, "device", Some(monitor), is_ending)
        }
    };
    let priority = live.granted_priority().to_string();
    let mut seen = SeenTicks::default();
    let mut is_over = false;
    while !is_over && live.is_alive() && !is_ending.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        let tick = *S::shown(live.view());
        seen.add(&tick);
        let seconds = period.time_of(tick.tick).seconds().0;
        progress(whole.map_or(0.0, |whole| seconds / whole));
        is_over = match monitor {
            None => live.is_over(),
            Some(_) => whole.is_some_and(|whole| seconds >= whole),
        };
    }
    let device = monitor.map(|monitor| DeviceUse::of(monitor.report()));
    let end = live.stop().ok_or("the loop of the scene failed; report this bug in palpate")?;
    let recorded = end.recorded.transpose()?;
    let tick_us = file.tolerances.tick_us;
    Ok(SceneRun {
        name: file.name.clone(),
        path,
        nodes: None,
        mesh: None,
        ticks: end.scene.ticks(),
        depth_max_mm: seen.depth_max_mm,
        force_max_n: seen.force_max_n,
        why: seen.shares(),
        surface_hash: format!("{:016x}", end.scene.hash()),
        device,
        tick_us,
        is_within_budget: 1e6 * end.timing.work.p99_9.0 <= tick_us,
        paced: LoopMeasurement {
            rate_hz: period.hz(),
            busy_threads: 0,
            priority,
            statistics: end.timing,
            recorded: recorded.map(RecordedTicks::from),
        },
    })
}

/// What the frames of a scene had.
#[derive(Default)]
struct SeenTicks {
    depth_max_mm: f64,
    force_max_n: f64,
    why: Vec<(NoForceReason, u64)>,
}

impl SeenTicks {
    fn add(&mut self, tick: &SceneTick) {
        self.depth_max_mm = self.depth_max_mm.max(tick.depth);
        let [x, y, z] = tick.force;
        self.force_max_n = self.force_max_n.max(x.hypot(y).hypot(z));
        match self.why.iter_mut().find(|(why, _)| *why == tick.no_force_reason) {
            Some((_, count)) => *count += 1,
            None => self.why.push((tick.no_force_reason, 1)),
        }
    }

    /// Reasons with their shares, the most frequent first.
    fn shares(mut self) -> Vec<(&'static str, f64)> {
        self.why.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        let frames = self.why.iter().map(|(_, count)| *count).sum::<u64>().max(1) as f64;
        self.why.iter().map(|(why, count)| (why.name(), *count as f64 / frames)).collect()
    }
}

/// The finished recording of a scene, if it has one.
#[must_use]
pub fn finish_scene_recording(end: SceneEnd) -> FinishedRecording {
    let hash = end.scene.hash();
    Some(end.recorded?.map(|counts| (counts, hash)))
}

/// A scene whose ticks are computed again.
struct ReplayedScene<S> {
    scene: S,
    /// The simulated device that the recorded hand leads; `None` where the recording has the sensed places of another device.
    device: Option<SimulatedDevice>,
    /// The force that the device was given last.
    force: [f64; 3],
}

impl<S: LoopScene> Replayable<3, 10> for ReplayedScene<S> {
    fn tick(&mut self, row: &SceneRow) -> SceneRow {
        let (input, elapsed) = scene_input(row);
        let pose = match &mut self.device {
            Some(device) => {
                device.follow(input, self.force, elapsed.max(1));
                device.pose()
            }
            None => Pose { at: input.at, turn: input.turn },
        };
        let tick = self.scene.render(pose, elapsed);
        self.force = tick.force;
        scene_row(input, elapsed, &tick)
    }

    fn state_hash(&self) -> u64 {
        self.scene.hash()
    }
}

/// Replays every tick of a recording from its inputs.
pub fn replay(
    folder: &Path,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<ReplayResult, String> {
    let (whole, sensed) = SENSED_COLUMNS;
    let is_sensed = has_columns(folder, &whole, &sensed)?;
    let columns = if is_sensed { SENSED_COLUMNS } else { COLUMNS };
    if !has_columns(folder, &columns.0, &columns.1)? {
        return Err(format!(
            "{} lacks the columns of a scene recording; give the folder of a recorded scene",
            folder.display()
        ));
    }
    let found = TickRecording::read(folder, columns)?;
    let called = folder.join(SETTINGS_FILE).display().to_string();
    let file = SceneFile::parse(&called, &found.settings)?;
    let ticks = (&found, columns);
    if let Some(mesh) = &file.mesh {
        // Its files are where they were, or in the folder of the recording, and have the bytes that they had.
        let (scene, _) = read_mesh_scene(&file, mesh, Some(folder))?;
        let name = format!("scene '{}' on {}", file.name, mesh.file);
        return replay_scene(&name, scene, ticks, is_going);
    }
    let nodes = file.nodes.ok_or_else(|| {
        format!("{called} does not state the number of nodes; use a complete recording")
    })?;
    replay_scene(&format!("scene '{}'", file.name), file.scene(nodes)?, ticks, is_going)
}

fn replay_scene<S: LoopScene>(
    name: &str,
    scene: S,
    (found, columns): (&TickRecording<3, 10>, Columns),
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<ReplayResult, String> {
    let device = match columns == SENSED_COLUMNS {
        true => None,
        false => Some(scene.simulated_device().map_err(|err| format!("{name}: {err}"))?),
    };
    let mut replayed = ReplayedScene { scene, device, force: [0.0; 3] };
    replay_ticks(name, found, columns, &mut replayed, is_going)
}
