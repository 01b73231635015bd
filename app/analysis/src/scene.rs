//! A scene in real time, its recording and its replay.

use super::haptics::{LoopMeasurement, fit_haptic_body};
use super::population::is_member;
use super::scene_device::DeviceUse;
use super::tick_replay::{
    FinishedRecording, RecordedTicks, ReplayResult, Replayable, replay_ticks,
};
use palpate_haptic_devices::InverseDevice;
use palpate_haptics::scene::{HandLedScene, HandPose, NoForceReason, Pose, Scene, ScenePath};
use palpate_runner::haptics::scene::{
    COLUMNS, SENSED_COLUMNS, SceneRecorder, SceneRow, scene_input, scene_row,
};
use palpate_runner::haptics::scene_file::SceneFile;
use palpate_runner::haptics::{SceneEnd, SceneLoop};
use palpate_sessions::ticks::{SETTINGS_FILE, TickRecording, has_columns};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Interval between two looks at a running scene: half a frame.
const LOOK: Duration = Duration::from_millis(8);

/// A scene file with its body, and what is to be known of that; without a file the scene that is built in.
pub fn read_scene(file: Option<&Path>) -> Result<(SceneFile, Vec<String>), String> {
    let Some(path) = file else { return Ok((SceneFile::default(), Vec::new())) };
    let called = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|err| format!("cannot read {called} ({err}); give a scene file"))?;
    let mut scene = SceneFile::parse(&called, &text)?;
    let mut notes = Vec::new();
    if let Some(source) = scene.source.take() {
        // A source is named from where its file is.
        let folder = path.parent().unwrap_or(Path::new(""));
        let source = if is_member(&source) { source.into() } else { folder.join(&source) };
        let found = fit_haptic_body(&source)?;
        scene.body = found.body;
        notes = found.notes;
    }
    Ok((scene, notes))
}

/// Result of a scene that ran in real time.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRun {
    pub name: String,
    /// The hand's path; `device` where a person's hand led a real one.
    pub path: &'static str,
    /// Nodes along a side.
    pub nodes: usize,
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

/// Runs a scene, its mesh known, in real time, and records it in a new folder if one is given.
pub fn play_scene(
    file: &SceneFile,
    hand: SceneHand<'_>,
    record: Option<&Path>,
    progress: &mut dyn FnMut(f64),
) -> Result<SceneRun, String> {
    let nodes = file.nodes.ok_or("the scene has no number of nodes; report this bug in palpate")?;
    let scene = file.scene(nodes)?;
    let settings = *scene.settings();
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
    let (mut depth_max_mm, mut force_max_n) = (0.0_f64, 0.0_f64);
    let mut seen: Vec<(NoForceReason, u64)> = Vec::new();
    let mut is_over = false;
    while !is_over && live.is_alive() && !is_ending.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        let tick = live.view().tick;
        depth_max_mm = depth_max_mm.max(tick.depth);
        let [x, y, z] = tick.force;
        force_max_n = force_max_n.max(x.hypot(y).hypot(z));
        match seen.iter_mut().find(|(why, _)| *why == tick.no_force_reason) {
            Some((_, count)) => *count += 1,
            None => seen.push((tick.no_force_reason, 1)),
        }
        let seconds = settings.period.time_of(tick.tick).seconds().0;
        progress(whole.map_or(0.0, |whole| seconds / whole));
        is_over = match monitor {
            None => live.is_over(),
            Some(_) => whole.is_some_and(|whole| seconds >= whole),
        };
    }
    let device = monitor.map(|monitor| DeviceUse::of(monitor.report()));
    let end = live.stop().ok_or("the loop of the scene failed; report this bug in palpate")?;
    let recorded = end.recorded.transpose()?;
    seen.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let frames = seen.iter().map(|(_, count)| *count).sum::<u64>().max(1) as f64;
    let tick_us = file.tolerances.tick_us;
    Ok(SceneRun {
        name: file.name.clone(),
        path,
        nodes: settings.nodes,
        ticks: end.scene.ticks(),
        depth_max_mm,
        force_max_n,
        why: seen.iter().map(|(why, count)| (why.name(), *count as f64 / frames)).collect(),
        surface_hash: format!("{:016x}", end.scene.hash()),
        device,
        tick_us,
        is_within_budget: 1e6 * end.timing.work.p99_9.0 <= tick_us,
        paced: LoopMeasurement {
            rate_hz: settings.period.hz(),
            busy_threads: 0,
            priority,
            statistics: end.timing,
            recorded: recorded.map(RecordedTicks::from),
        },
    })
}

impl Replayable<3, 10> for HandLedScene {
    fn tick(&mut self, row: &SceneRow) -> SceneRow {
        let (hand, elapsed) = scene_input(row);
        let tick = self.tick_after(hand, elapsed);
        scene_row(hand, elapsed, &tick)
    }

    fn state_hash(&self) -> u64 {
        self.scene.hash()
    }
}

/// The finished recording of a scene, if it has one.
#[must_use]
pub fn finish_scene_recording(end: SceneEnd) -> FinishedRecording {
    let hash = end.scene.hash();
    Some(end.recorded?.map(|counts| (counts, hash)))
}

/// On a device that was sensed.
impl Replayable<3, 10> for Scene {
    fn tick(&mut self, row: &SceneRow) -> SceneRow {
        let (sensed, elapsed) = scene_input(row);
        let HandPose { at, turn } = sensed;
        let tick = self.render(Pose { at, turn }, elapsed);
        scene_row(sensed, elapsed, &tick)
    }

    fn state_hash(&self) -> u64 {
        self.hash()
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
    let nodes = file.nodes.ok_or_else(|| {
        format!("{called} does not state the number of nodes; use a complete recording")
    })?;
    let mut scene = file.scene(nodes)?;
    let name = format!("scene '{}'", file.name);
    if is_sensed {
        return replay_ticks(&name, &found, columns, &mut scene, is_going);
    }
    let mut led = HandLedScene::new(*scene.settings()).map_err(|err| format!("{called}: {err}"))?;
    replay_ticks(&name, &found, columns, &mut led, is_going)
}
