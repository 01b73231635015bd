//! The scene of the window: computed along a path, or in a loop of its own, and its past for the plots.

use super::scene_tissue::{SceneInstant, ShownFrame, TissueScene};
use super::trail::{TIMING_S, forget_old};
use palpate_analysis::scene::finish_scene_recording;
use palpate_analysis::scene_device::{DeviceReport, DeviceUse, OpenDevice};
use palpate_analysis::tick_replay::FinishedRecording;
use palpate_haptic_devices::DeviceMonitor;
use palpate_haptics::margin::{LoopDevice, Margin, MarginSettings};
use palpate_haptics::scene::{HandPose, ScenePath, SceneSettings, SceneTick};
use palpate_haptics::{LawSettings, Period};
use palpate_model::units::{Depth, MmPerS, Newtons};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_runner::haptics::scene::SceneRecorder;
use palpate_runner::haptics::timing::LoopTiming;
use palpate_runner::haptics::{LoopScene, SceneLoop};
use std::collections::VecDeque;
use std::fmt::Debug;

/// Ticks between two points of a computed path.
const TICKS_PER_POINT: u64 = 10;

/// Force and depth at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForcePoint {
    /// In s since the start.
    pub t: f64,
    /// Length of the force on the hand in N.
    pub force: f64,
    /// Depth of the stylus in mm.
    pub depth: f64,
}

impl ForcePoint {
    fn of(tick: &SceneTick, period: Period) -> Self {
        Self { t: period.time_of(tick.tick).seconds().0, force: force_of(tick), depth: tick.depth }
    }
}

/// Length of the force on the hand in N.
#[must_use]
pub fn force_of(tick: &SceneTick) -> f64 {
    let [x, y, z] = tick.force;
    x.hypot(y).hypot(z)
}

/// The margin of a scene's loop through `device` where it is now: that of the material that needs the most damping.
#[must_use]
pub fn margin_of(
    settings: &SceneSettings,
    bodies: &[ModifiedKelvin],
    device: LoopDevice,
    tick: &SceneTick,
) -> Margin {
    let of = |body: ModifiedKelvin| {
        let watch = MarginSettings {
            body: LawSettings::of(body, settings.period).body,
            scheme: settings.scheme,
            period: settings.period,
            device,
        };
        watch.at(Depth(tick.depth), MmPerS(tick.speed))
    };
    let needs = |one: &Margin, other: &Margin| one.needed.total_cmp(&other.needed);
    let worst = bodies.iter().copied().map(of).max_by(needs);
    worst.unwrap_or_else(|| of(settings.body))
}

/// The simulated device of a scene in its loop: nothing delays it.
#[must_use]
pub fn simulated_loop(settings: &SceneSettings) -> LoopDevice {
    let device = &settings.device;
    LoopDevice {
        damping: device.damping_n_s_per_mm,
        friction: Newtons(device.friction_n),
        count_mm: device.step_mm,
        delay_ticks: 0.0,
    }
}

/// What moves the stylus of a scene.
pub enum SceneLead {
    /// The simulated hand, along a path and then where it is pointed.
    Path(ScenePath),
    /// The simulated hand, where it is pointed.
    Pointer,
    /// A person's hand on a device that was opened for the scene.
    Device(OpenDevice, Box<DeviceReport>),
}

/// The device of a scene that runs or ran.
#[derive(Debug)]
pub struct PlayedDevice {
    /// What was known before the first touch.
    pub report: Box<DeviceReport>,
    looped: LoopDevice,
    monitor: DeviceMonitor,
}

impl PlayedDevice {
    /// How the connection is.
    pub fn used(&self) -> DeviceUse {
        DeviceUse::of(self.monitor.report())
    }
}

/// A scene computed along a path, not in real time.
#[derive(Clone, Debug)]
pub struct ComputedPath {
    pub settings: SceneSettings,
    pub path: ScenePath,
    /// Of the greatest depth.
    pub deepest: SceneInstant,
    pub trail: Vec<ForcePoint>,
}

/// Computes a scene along a path. `is_going` receives the share done, and cancels by returning false.
pub fn compute_path(
    scene: TissueScene,
    path: ScenePath,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<ComputedPath, String> {
    match scene {
        TissueScene::Square(scene) => compute(*scene, path, is_going),
        TissueScene::Mesh(scene) => compute(*scene, path, is_going),
    }
}

fn compute<S: LoopScene<Frame: ShownFrame>>(
    mut scene: S,
    path: ScenePath,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<ComputedPath, String> {
    let (settings, start) = (*scene.settings(), scene.start());
    let period = settings.period;
    let mut device = scene.simulated_device().map_err(|err| err.to_string())?;
    let mut frame = scene.frame();
    let mut trail = Vec::new();
    let mut deepest = *frame.tick();
    let mut force = [0.0; 3];
    let ticks = (path.seconds() / period.seconds().0).ceil() as u64;
    for tick in 1..=ticks {
        let t = period.time_of(tick).seconds().0;
        device.follow(start.moved(path.at(t, &settings), &settings), force, 1);
        let tick_now = scene.render(device.pose(), 1);
        force = tick_now.force;
        if !tick.is_multiple_of(TICKS_PER_POINT) {
            continue;
        }
        trail.push(ForcePoint::of(&tick_now, period));
        if tick_now.depth > deepest.depth {
            deepest = tick_now;
            // All of it: since the last frame other parts have moved and come back.
            frame = scene.frame();
        }
        if !is_going(tick as f64 / ticks as f64) {
            return Err("the computation was cancelled".into());
        }
    }
    Ok(ComputedPath { settings, path, deepest: SceneInstant::of(&frame)?, trail })
}

/// A loop that ticks a scene of any tissue.
trait RunningLoop: Debug + Send {
    fn point(&self, hand: HandPose);
    fn is_over(&self) -> bool;
    fn is_alive(&self) -> bool;
    fn timing(&self) -> LoopTiming;
    fn priority(&self) -> String;
    /// The newest moment, if it is later than a tick.
    fn after(&mut self, tick: u64) -> Option<Result<SceneInstant, String>>;
    /// Ends it, and its recording after everything is written.
    fn finish(self: Box<Self>) -> FinishedRecording;
}

impl<S: LoopScene<Frame: ShownFrame>> RunningLoop for SceneLoop<S> {
    fn point(&self, hand: HandPose) {
        SceneLoop::point(self, hand);
    }

    fn is_over(&self) -> bool {
        SceneLoop::is_over(self)
    }

    fn is_alive(&self) -> bool {
        SceneLoop::is_alive(self)
    }

    fn timing(&self) -> LoopTiming {
        SceneLoop::timing(self)
    }

    fn priority(&self) -> String {
        self.granted_priority().to_string()
    }

    fn after(&mut self, tick: u64) -> Option<Result<SceneInstant, String>> {
        let frame = self.view();
        (frame.tick().tick > tick).then(|| SceneInstant::of(frame))
    }

    fn finish(self: Box<Self>) -> FinishedRecording {
        self.stop().and_then(finish_scene_recording)
    }
}

/// A loop that was taken out to be ended.
#[derive(Debug)]
pub struct EndingLoop(Box<dyn RunningLoop>);

impl EndingLoop {
    /// Waits for the disk.
    pub fn finish(self) -> FinishedRecording {
        self.0.finish()
    }
}

/// A scene that runs or ran last.
#[derive(Debug)]
pub struct LiveScene {
    live: Option<Box<dyn RunningLoop>>,
    settings: SceneSettings,
    moment: SceneInstant,
    trail: VecDeque<ForcePoint>,
    timing: LoopTiming,
    timing_read_at: f64,
    is_led: bool,
    priority: String,
    device: Option<PlayedDevice>,
}

impl LiveScene {
    /// Starts the loop; the settings of the scene are those of the device that leads it.
    pub fn start(
        scene: TissueScene,
        lead: SceneLead,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        match scene {
            TissueScene::Square(scene) => Self::begin(*scene, lead, recorder),
            TissueScene::Mesh(scene) => Self::begin(*scene, lead, recorder),
        }
    }

    fn begin<S: LoopScene<Frame: ShownFrame>>(
        scene: S,
        lead: SceneLead,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        let settings = *scene.settings();
        let moment = SceneInstant::of(&scene.frame())?;
        let is_led = matches!(lead, SceneLead::Path(_));
        let (live, device) = match lead {
            SceneLead::Path(path) => (SceneLoop::start(scene, Some(path), recorder)?, None),
            SceneLead::Pointer => (SceneLoop::start(scene, None, recorder)?, None),
            SceneLead::Device(OpenDevice { device, looped, monitor }, report) => {
                let live = SceneLoop::start_on_device(device, scene, recorder)?;
                (live, Some(PlayedDevice { report, looped, monitor }))
            }
        };
        Ok(Self {
            settings,
            moment,
            trail: VecDeque::new(),
            timing: live.timing(),
            timing_read_at: 0.0,
            is_led,
            priority: RunningLoop::priority(&live),
            device,
            live: Some(Box::new(live)),
        })
    }

    /// Moves the hand and reads the newest tick. An error: the loop has ended by itself.
    pub fn poll(&mut self, hand: HandPose) -> Result<(), String> {
        let Some(live) = &mut self.live else {
            return Ok(());
        };
        live.point(hand);
        self.is_led = self.is_led && !live.is_over();
        let period = self.settings.period;
        if let Some(moment) = live.after(self.moment.tick.tick) {
            self.moment = moment?;
            self.trail.push_back(ForcePoint::of(&self.moment.tick, period));
        }
        let now = period.time_of(self.moment.tick.tick).seconds().0;
        forget_old(&mut self.trail, now, |point| point.t);
        if now - self.timing_read_at >= TIMING_S {
            self.timing = live.timing();
            self.timing_read_at = now;
        }
        if live.is_alive() {
            return Ok(());
        }
        self.live = None;
        Err("the scene ended unexpectedly; start it again, and report it if it happens twice"
            .into())
    }

    pub fn is_running(&self) -> bool {
        self.live.is_some()
    }

    /// Whether a path leads the hand, and not pointer and keys.
    pub fn is_led(&self) -> bool {
        self.is_running() && self.is_led
    }

    /// Takes the loop out to be ended, as its recording waits for the disk.
    pub fn stop(&mut self) -> Option<EndingLoop> {
        let live = self.live.take()?;
        self.timing = live.timing();
        Some(EndingLoop(live))
    }

    pub fn settings(&self) -> &SceneSettings {
        &self.settings
    }

    /// The real device, if one leads it.
    pub fn device(&self) -> Option<&PlayedDevice> {
        self.device.as_ref()
    }

    /// What its loop goes through.
    pub fn loop_device(&self) -> LoopDevice {
        self.device.as_ref().map_or_else(|| simulated_loop(&self.settings), |device| device.looped)
    }

    pub fn moment(&self) -> &SceneInstant {
        &self.moment
    }

    /// In s since the start.
    pub fn now(&self) -> f64 {
        let period = self.settings.period;
        period.time_of(self.moment.tick.tick).seconds().0
    }

    pub fn trail(&self) -> impl Iterator<Item = &ForcePoint> + Clone {
        self.trail.iter()
    }

    pub fn kept(&self) -> &LoopTiming {
        &self.timing
    }

    /// As granted by the system.
    pub fn priority(&self) -> &str {
        &self.priority
    }
}

#[cfg(test)]
mod tests {
    use super::super::scene_tissue::{MeshTissue, ShownTissue, elastic_model};
    use super::*;
    use palpate_runner::haptics::scene_file::SceneFile;

    fn lowest(instant: &SceneInstant) -> f64 {
        match &instant.tissue {
            ShownTissue::Square { heights, .. } => heights.iter().copied().fold(0.0, f64::min),
            ShownTissue::Mesh(sunk) => sunk.iter().map(|one| -one.depth).fold(0.0, f64::min),
        }
    }

    /// `apart_mm`: how far the stylus may be from the nearest node.
    fn assert_is_a_poke(apart_mm: f64, scene: impl Fn() -> TissueScene) {
        let poke = || compute_path(scene(), ScenePath::Poke, &mut |_| true).unwrap();
        let one = poke();
        let deepest = &one.deepest.tick;
        // The hand goes 8 mm deep; the force holds the stylus back.
        assert!(deepest.depth > 4.0 && deepest.depth <= 8.2, "{}", deepest.depth);
        // A dent of slope 1 is as much less deep at a node as that is away.
        let low = lowest(&one.deepest);
        assert!((low + deepest.depth).abs() <= apart_mm, "{low} {}", deepest.depth);
        assert!(force_of(deepest) > 0.1);
        let last = one.trail.last().unwrap();
        assert!(last.depth == 0.0 && (last.t - ScenePath::Poke.seconds()).abs() < 0.02);
        // The same bits every time, so that pictures of it are equal.
        let again = poke();
        assert_eq!(one.trail, again.trail);
        assert_eq!(one.deepest.tissue, again.deepest.tissue);
        let cut = compute_path(scene(), ScenePath::Poke, &mut |share| share < 0.5);
        assert!(cut.unwrap_err().contains("was cancelled"));
    }

    #[test]
    fn a_computed_poke_is_as_deep_as_the_hand_and_ends_above() {
        let file = SceneFile { nodes: Some(41), slope: 1.0, ..SceneFile::default() };
        assert_is_a_poke(1.5, || TissueScene::of(&file, None).unwrap());
    }

    #[test]
    fn the_margin_is_that_of_the_material_that_needs_the_most() {
        let settings = SceneSettings::default();
        let soft = settings.body;
        let hard = ModifiedKelvin { mu: soft.mu.map(|mu| 5.0 * mu), ..soft };
        let tick = SceneTick { depth: 1.0, ..SceneTick::default() };
        let of = |bodies: &[ModifiedKelvin]| {
            margin_of(&settings, bodies, simulated_loop(&settings), &tick).needed
        };
        assert!(of(&[hard]) > of(&[soft]));
        for bodies in [[soft, hard], [hard, soft]] {
            assert_eq!(of(&bodies), of(&[hard]));
        }
    }

    #[test]
    fn a_mesh_of_a_scene_file_is_poked_and_its_vertices_have_the_model_of_their_material() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pad.obj");
        // A square pad of 60 mm in 4 mm steps.
        let steps = 0..=15;
        let mut text = String::new();
        for row in steps.clone() {
            for column in steps.clone() {
                text += &format!("v {} {} 0\n", 4 * column, 4 * row);
            }
        }
        for row in 0..15 {
            for column in 1..=15 {
                let (here, above) = (16 * row + column, 16 * (row + 1) + column);
                text += &format!("f {here} {} {} {above}\n", here + 1, above + 1);
            }
        }
        std::fs::write(&path, text).unwrap();
        let scene = folder.path().join("pad.toml");
        std::fs::write(&scene, "name = \"pad\"\n[mesh]\nfile = \"pad.obj\"\n").unwrap();
        let (file, _) = palpate_analysis::scene::read_scene(Some(&scene)).unwrap();
        let mesh = MeshTissue::of(&file).unwrap().unwrap();
        assert_eq!(mesh.models, vec![elastic_model(&file.body); 256]);
        // Half of a diagonal of 4 mm steps.
        let scene = || TissueScene::of(&file, Some(&mesh)).unwrap();
        assert_is_a_poke(2.83, scene);
        let poke = compute_path(scene(), ScenePath::Poke, &mut |_| true).unwrap();
        let ShownTissue::Mesh(sunk) = poke.deepest.tissue else { panic!("it is a mesh") };
        // The pad is level, so a vertex is as far below zero as it has sunk, over its own place.
        assert!(!sunk.is_empty());
        for one in sunk {
            let [x, y, z] = one.place;
            let (column, row) = (one.vertex % 16, one.vertex / 16);
            assert_eq!([x, y], [4.0 * f64::from(column), 4.0 * f64::from(row)]);
            assert!((z + one.depth).abs() < 1e-9, "{one:?}");
        }
    }
}
