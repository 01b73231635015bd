//! The virtual scene in a loop: a device, frames for graphics, and a recording of its ticks.

use super::loop_scene::{Laps, LoopScene};
use super::timing::LoopTiming;
use super::{LoopTask, RealTimeLoop};
use palpate_drivers::priority::GrantedPriority;
use palpate_haptics::device::HapticDevice;
use palpate_haptics::scene::{HandPose, Pose, Scene, ScenePath, SceneTick};
use palpate_haptics::surface::{GridRect, HeightField};
use palpate_sessions::ticks::{TickCounts, TickRecorder, TickRow};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use triple_buffer::Input;

/// Frames a second: what a usual display shows.
const FRAMES_HZ: f64 = 60.0;

/// Most nodes along a side of a frame. Finer meshes are thinned: no display shows more of them, and copying a million heights
/// would take most of a tick.
pub const FRAME_NODES_MAX: usize = 401;

/// Columns of a recorded scene: whole numbers, then others.
pub type Columns = ([&'static str; 3], [&'static str; 10]);

const fn columns(place: [&'static str; 3]) -> Columns {
    let [x, y, z] = place;
    let forces = ["force_x_n", "force_y_n", "force_z_n"];
    (
        ["tick", "elapsed", "row_hash"],
        [x, y, z, "yaw_rad", "pitch_rad", "roll_rad", forces[0], forces[1], forces[2], "depth_mm"],
    )
}

/// Columns of a scene on the simulated device: the hand that led it.
pub const COLUMNS: Columns = columns(["hand_x_mm", "hand_y_mm", "hand_z_mm"]);

/// Columns of a scene on another device: where its stylus was sensed.
pub const SENSED_COLUMNS: Columns = columns(["stylus_x_mm", "stylus_y_mm", "stylus_z_mm"]);

/// A recorded tick of a scene.
pub type SceneRow = TickRow<3, 10>;

/// Writes the ticks of a scene.
pub type SceneRecorder = TickRecorder<3, 10>;

/// What is recorded of a tick: its inputs, then what they gave.
#[must_use]
pub fn scene_row(hand: HandPose, elapsed: u64, outcome: &SceneTick) -> SceneRow {
    let ([x, y, z], [yaw, pitch, roll]) = (hand.at, hand.turn);
    let [fx, fy, fz] = outcome.force;
    TickRow {
        whole: [outcome.tick, elapsed, outcome.row_hash],
        real: [x, y, z, yaw, pitch, roll, fx, fy, fz, outcome.depth],
    }
}

/// The inputs of a recorded tick: the hand, and ticks since the one before.
#[must_use]
pub fn scene_input(row: &SceneRow) -> (HandPose, u64) {
    let [x, y, z, yaw, pitch, roll, ..] = row.real;
    let hand = HandPose { at: [x, y, z], turn: [yaw, pitch, roll] };
    (hand, row.whole[1])
}

/// What graphics see of a scene, about sixty times a second.
#[derive(Clone, Debug)]
pub struct SceneFrame {
    /// The newest tick.
    pub tick: SceneTick,
    /// Nodes along a side of `heights`.
    pub nodes: usize,
    /// Length of a side of `heights` in mm.
    pub side_mm: f64,
    /// Heights in mm, row by row.
    pub heights: Vec<f32>,
    /// Nodes of the mesh from one of these to the next.
    stride: usize,
    /// Where heights are not at rest, in nodes of the mesh.
    displaced: GridRect,
}

impl SceneFrame {
    pub(super) fn new(scene: &Scene) -> Self {
        let nodes = scene.field().grid().columns();
        let stride = stride(nodes);
        let shown = 1 + (nodes - 1) / stride;
        let mut frame = Self {
            tick: scene.last(),
            nodes: shown,
            side_mm: ((shown - 1) * stride) as f64 * scene.field().grid().spacing(),
            heights: vec![0.0; shown * shown],
            stride,
            displaced: scene.dirty(),
        };
        frame.copy(scene.field(), scene.field().grid().whole());
        frame
    }

    /// Copies what has moved since the last frame.
    pub(super) fn update(&mut self, scene: &Scene) {
        self.tick = scene.last();
        self.copy(scene.field(), self.displaced.union(scene.dirty()));
        self.displaced = scene.dirty();
    }

    fn copy(&mut self, field: &HeightField, part: GridRect) {
        let columns = field.grid().columns();
        let stride = self.stride;
        // The first and the last of them within the part.
        let within =
            |[from, to]: [u32; 2]| (from as usize).div_ceil(stride)..(to as usize).div_ceil(stride);
        let (across, down) = (within(part.columns), within(part.rows));
        for row in down.start..down.end.min(self.nodes) {
            let line = &field.heights()[row * stride * columns..][..columns];
            let to = &mut self.heights[row * self.nodes..][..self.nodes];
            for column in across.start..across.end.min(self.nodes) {
                to[column] = line[column * stride] as f32;
            }
        }
    }
}

/// The smallest step between shown nodes that fits a frame, and that reaches all sides of the mesh if possible.
fn stride(nodes: usize) -> usize {
    let cells = nodes - 1;
    let least = cells.div_ceil(FRAME_NODES_MAX - 1).max(1);
    let whole = (least..2 * least).find(|stride| cells.is_multiple_of(*stride));
    whole.unwrap_or(least)
}

/// A scene as a loop ticks it.
#[derive(Debug)]
pub struct SceneTask<S = Scene> {
    scene: S,
    device: Box<dyn HapticDevice>,
    recorder: Option<SceneRecorder>,
    apart: u64,
    since: u64,
}

impl<S: LoopScene> SceneTask<S> {
    #[must_use]
    pub fn new(scene: S, device: Box<dyn HapticDevice>, recorder: Option<SceneRecorder>) -> Self {
        let apart = (scene.period().hz() / FRAMES_HZ).round().max(1.0) as u64;
        Self { scene, device, recorder, apart, since: apart }
    }

    /// What is seen before the first tick.
    pub fn first(&self) -> S::Frame {
        self.scene.frame()
    }

    pub fn scene(&self) -> &S {
        &self.scene
    }
}

impl<S: LoopScene> LoopTask for SceneTask<S> {
    type View = S::Frame;

    fn tick(&mut self, elapsed: u64) {
        let Pose { at, turn } = self.device.sense(elapsed);
        let outcome = self.scene.render(Pose { at, turn }, elapsed);
        self.device.give(outcome.force);
        if let Some(recorder) = &self.recorder {
            let input = self.device.hand().unwrap_or(HandPose { at, turn });
            recorder.push(scene_row(input, elapsed, &outcome));
        }
        self.since = if self.is_shown() { 1 } else { self.since + 1 };
    }

    fn is_shown(&self) -> bool {
        self.since >= self.apart
    }

    fn show(&self, view: &mut S::Frame) {
        self.scene.update(view);
    }
}

#[derive(Debug)]
pub struct SceneEnd<S = Scene> {
    pub scene: S,
    pub timing: LoopTiming,
    pub recorded: Option<Result<TickCounts, String>>,
}

/// A scene in real time. Dropping it ends the loop.
#[derive(Debug)]
pub struct SceneLoop<S: LoopScene = Scene> {
    beat: RealTimeLoop<SceneTask<S>>,
    /// The hand on the simulated device, and whether its path has come to its end.
    hand: Option<(Mutex<Input<HandPose>>, Arc<AtomicBool>)>,
}

impl<S: LoopScene> SceneLoop<S> {
    /// Begins to tick on the simulated device. After `path`, or without one, the hand goes where it is [pointed](Self::point).
    pub fn start(
        scene: S,
        path: Option<ScenePath>,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        Self::start_laps(scene, (path, 1), recorder)
    }

    pub fn start_laps(
        scene: S,
        path: Laps,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        let (device, pointing) = scene.stylus(path).map_err(|err| err.to_string())?;
        let hand = (Mutex::new(pointing), device.end_flag());
        let mut live = Self::start_on_device(Box::new(device), scene, recorder)?;
        live.hand = Some(hand);
        Ok(live)
    }

    /// Begins to tick on a device with the settings of the scene. Its recording has [`SENSED_COLUMNS`].
    pub fn start_on_device(
        device: Box<dyn HapticDevice>,
        scene: S,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        let period = scene.period();
        if *device.settings() != scene.settings().device {
            return Err(
                "the scene has the settings of a different device; give the scene the settings of the connected device".into(),
            );
        }
        let task = SceneTask::new(scene, device, recorder);
        let first = task.first();
        let beat = RealTimeLoop::start(task, period, first).map_err(|err| {
            format!(
                "the thread that computes the scene cannot be started ({err}); close other programs"
            )
        })?;
        Ok(Self { beat, hand: None })
    }

    /// The hand on the simulated device goes there from the next tick on. Callers may wait for each other; the loop
    /// never waits.
    pub fn point(&self, hand: HandPose) {
        if let Some((pointing, _)) = &self.hand {
            let mut pointing = pointing.lock().unwrap_or_else(PoisonError::into_inner);
            pointing.write(hand);
        }
    }

    /// The newest frame.
    pub fn view(&mut self) -> &S::Frame {
        self.beat.view()
    }

    pub fn timing(&self) -> LoopTiming {
        self.beat.timing()
    }

    pub fn granted_priority(&self) -> &GrantedPriority {
        self.beat.granted_priority()
    }

    /// Whether the path has come to its end; without one it is over from the start.
    pub fn is_over(&self) -> bool {
        let path = self.hand.as_ref();
        path.is_none_or(|(_, is_over)| is_over.load(Ordering::Relaxed))
    }

    /// Whether it still ticks; it does until it is stopped, unless its work failed.
    pub fn is_alive(&self) -> bool {
        self.beat.is_alive()
    }

    /// Ends it, and its recording after everything is written; `None` if its work failed.
    pub fn stop(self) -> Option<SceneEnd<S>> {
        let kept = self.beat.timing();
        let task = self.beat.end()?;
        let recorded = task.recorder.map(|recorder| recorder.finish(task.scene.hash()));
        Some(SceneEnd { scene: task.scene, timing: kept, recorded })
    }
}
