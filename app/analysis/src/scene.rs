//! A scene in real time, its recording and its replay.

use super::haptics::{LoopMeasurement, fit_haptic_body};
use super::population::is_member;
use super::tick_replay::{
    FinishedRecording, RecordedTicks, ReplayResult, Replayable, replay_ticks,
};
use palpate_haptics::scene::{HandLedScene, HandPose, NoForceReason, Pose, Scene, ScenePath};
use palpate_runner::haptics::scene::{
    COLUMNS, SENSED_COLUMNS, SceneRecorder, SceneRow, scene_input, scene_row,
};
use palpate_runner::haptics::scene_file::SceneFile;
use palpate_runner::haptics::{SceneEnd, SceneLoop};
use palpate_sessions::ticks::{SETTINGS_FILE, TickRecording, has_columns};
use serde::Serialize;
use std::path::Path;
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
    /// The hand's path.
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
    #[serde(flatten)]
    pub paced: LoopMeasurement,
}

/// Runs a scene, its mesh known, in real time along a path, `laps` times, and records it in a new folder if one is given.
pub fn play_scene(
    file: &SceneFile,
    (path, laps): (ScenePath, u32),
    record: Option<&Path>,
    progress: &mut dyn FnMut(f64),
) -> Result<SceneRun, String> {
    let nodes = file.nodes.ok_or("the scene has no number of nodes; report this bug in palpate")?;
    let scene = file.scene(nodes)?;
    let settings = *scene.settings();
    let recorder = record.map(|folder| SceneRecorder::start(folder, &file.text(), COLUMNS));
    let mut live = SceneLoop::start_laps(scene, (Some(path), laps), recorder.transpose()?)?;
    let priority = live.granted_priority().to_string();
    let whole = path.seconds() * f64::from(laps);
    let (mut depth_max_mm, mut force_max_n) = (0.0_f64, 0.0_f64);
    let mut seen: Vec<(NoForceReason, u64)> = Vec::new();
    while !live.is_over() && live.is_alive() {
        std::thread::sleep(LOOK);
        let tick = live.view().tick;
        depth_max_mm = depth_max_mm.max(tick.depth);
        let [x, y, z] = tick.force;
        force_max_n = force_max_n.max(x.hypot(y).hypot(z));
        match seen.iter_mut().find(|(why, _)| *why == tick.no_force_reason) {
            Some((_, count)) => *count += 1,
            None => seen.push((tick.no_force_reason, 1)),
        }
        progress(settings.period.time_of(tick.tick).seconds().0 / whole);
    }
    let end = live.stop().ok_or("the loop of the scene failed; report this bug in palpate")?;
    let recorded = end.recorded.transpose()?;
    seen.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let frames = seen.iter().map(|(_, count)| *count).sum::<u64>().max(1) as f64;
    let tick_us = file.tolerances.tick_us;
    Ok(SceneRun {
        name: file.name.clone(),
        path: path.name(),
        nodes: settings.nodes,
        ticks: end.scene.ticks(),
        depth_max_mm,
        force_max_n,
        why: seen.iter().map(|(why, count)| (why.name(), *count as f64 / frames)).collect(),
        surface_hash: format!("{:016x}", end.scene.hash()),
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
