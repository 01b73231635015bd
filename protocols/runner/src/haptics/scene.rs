//! The virtual scene in a loop: a device, frames for graphics, and a recording of its ticks.

use super::timing::Kept;
use super::{Beat, Stylus, Ticking};
use palpate_drivers::priority::Granted;
use palpate_haptics::Period;
use palpate_haptics::device::HapticDevice;
use palpate_haptics::scene::{Hand6, Pose, Scene, ScenePath, SceneTick};
use palpate_haptics::surface::{HeightField, Rect};
use palpate_sessions::ticks::{Recorded, Recorder, Row};
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
pub type SceneRow = Row<3, 10>;

/// Writes the ticks of a scene.
pub type SceneRecorder = Recorder<3, 10>;

/// What is recorded of a tick: its inputs, then what they gave.
#[must_use]
pub fn scene_row(hand: Hand6, elapsed: u64, told: &SceneTick) -> SceneRow {
    let ([x, y, z], [yaw, pitch, roll]) = (hand.at, hand.turn);
    let [fx, fy, fz] = told.force;
    Row {
        whole: [told.tick, elapsed, told.row_hash],
        real: [x, y, z, yaw, pitch, roll, fx, fy, fz, told.depth],
    }
}

/// The inputs of a recorded tick: the hand, and ticks since the one before.
#[must_use]
pub fn scene_input(row: &SceneRow) -> (Hand6, u64) {
    let [x, y, z, yaw, pitch, roll, ..] = row.real;
    let hand = Hand6 { at: [x, y, z], turn: [yaw, pitch, roll] };
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
    displaced: Rect,
}

impl SceneFrame {
    /// Of a scene, whole.
    fn new(scene: &Scene) -> Self {
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

    /// The scene as it is now. What was at rest in this frame and is at rest now is left as it is.
    fn take(&mut self, scene: &Scene) {
        self.tick = scene.last();
        self.copy(scene.field(), self.displaced.union(scene.dirty()));
        self.displaced = scene.dirty();
    }

    fn copy(&mut self, field: &HeightField, part: Rect) {
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

/// Every how many nodes one is shown: the fewest that leave no more than a frame has, all sides of the mesh among them if that
/// can be.
fn stride(nodes: usize) -> usize {
    let cells = nodes - 1;
    let least = cells.div_ceil(FRAME_NODES_MAX - 1).max(1);
    let whole = (least..2 * least).find(|stride| cells.is_multiple_of(*stride));
    whole.unwrap_or(least)
}

/// A scene as a loop ticks it.
#[derive(Debug)]
pub struct SceneTask {
    scene: Scene,
    device: Box<dyn HapticDevice>,
    recorder: Option<SceneRecorder>,
    /// Ticks from frame to frame, and since the last.
    apart: u64,
    since: u64,
}

impl SceneTask {
    /// The task.
    #[must_use]
    pub fn new(
        scene: Scene,
        device: Box<dyn HapticDevice>,
        recorder: Option<SceneRecorder>,
    ) -> Self {
        let period: Period = scene.settings().period;
        let apart = (period.hz() / FRAMES_HZ).round().max(1.0) as u64;
        Self { scene, device, recorder, apart, since: apart }
    }

    /// What is seen before the first tick.
    pub fn first(&self) -> SceneFrame {
        SceneFrame::new(&self.scene)
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

impl Ticking for SceneTask {
    type View = SceneFrame;

    fn tick(&mut self, elapsed: u64) {
        let Pose { at, turn } = self.device.sense(elapsed);
        let told = self.scene.feel(Pose { at, turn }, elapsed);
        self.device.give(told.force);
        if let Some(recorder) = &self.recorder {
            let input = self.device.hand().unwrap_or(Hand6 { at, turn });
            recorder.push(scene_row(input, elapsed, &told));
        }
        self.since = if self.is_shown() { 1 } else { self.since + 1 };
    }

    fn is_shown(&self) -> bool {
        self.since >= self.apart
    }

    fn show(&self, view: &mut SceneFrame) {
        view.take(&self.scene);
    }
}

/// What a scene's loop left.
#[derive(Debug)]
pub struct SceneEnd {
    /// The scene.
    pub scene: Scene,
    /// How the loop kept its time.
    pub kept: Kept,
    /// What was recorded, if it was.
    pub recorded: Option<Result<Recorded, String>>,
}

/// A scene on its way in real time. Dropping it ends it.
#[derive(Debug)]
pub struct SceneLoop {
    beat: Beat<SceneTask>,
    /// The hand on the simulated device, and whether its path has come to its end.
    hand: Option<(Mutex<Input<Hand6>>, Arc<AtomicBool>)>,
}

impl SceneLoop {
    /// Begins to tick on the simulated device. After `path`, or without one, the hand goes where it is [pointed](Self::point).
    pub fn start(
        scene: Scene,
        path: Option<ScenePath>,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        Self::start_laps(scene, (path, 1), recorder)
    }

    /// The same with the path gone so many times.
    pub fn start_laps(
        scene: Scene,
        path: (Option<ScenePath>, u32),
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        let made = Stylus::new(*scene.settings(), path);
        let (device, pointing) = made.map_err(|err| err.to_string())?;
        let hand = (Mutex::new(pointing), device.over());
        let mut live = Self::on(Box::new(device), scene, recorder)?;
        live.hand = Some(hand);
        Ok(live)
    }

    /// Begins to tick on a device of its own, which the scene has to be made for. Its recording has [`SENSED_COLUMNS`].
    pub fn on(
        device: Box<dyn HapticDevice>,
        scene: Scene,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        let period = scene.settings().period;
        if *device.settings() != scene.settings().device {
            return Err(
                "the scene is made for another device than the one that is there; give it the numbers of that".into(),
            );
        }
        let task = SceneTask::new(scene, device, recorder);
        let first = task.first();
        let beat = Beat::start(task, period, first).map_err(|err| {
            format!("the thread of the scene cannot be started ({err}); end other programs")
        })?;
        Ok(Self { beat, hand: None })
    }

    /// The hand on the simulated device goes there from the next tick on. Only those who point wait for each other, the loop for
    /// nobody.
    pub fn point(&self, hand: Hand6) {
        if let Some((pointing, _)) = &self.hand {
            let mut pointing = pointing.lock().unwrap_or_else(PoisonError::into_inner);
            pointing.write(hand);
        }
    }

    /// The newest frame.
    pub fn view(&mut self) -> &SceneFrame {
        self.beat.seen()
    }

    /// How the loop keeps its time.
    pub fn timing(&self) -> Kept {
        self.beat.kept()
    }

    /// The priority that the system gave.
    pub fn granted(&self) -> &Granted {
        self.beat.granted()
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
    pub fn stop(self) -> Option<SceneEnd> {
        let kept = self.beat.kept();
        let task = self.beat.end()?;
        let recorded = task.recorder.map(|recorder| recorder.finish(task.scene.hash()));
        Some(SceneEnd { scene: task.scene, kept, recorded })
    }
}
