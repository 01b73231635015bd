//! The scene of the window: computed along a path, or in a loop of its own, and its past for the plots.

use super::trail::{TIMING_S, forget_old};
use palpate_analysis::scene_device::{DeviceReport, DeviceUse, OpenDevice};
use palpate_haptic_devices::DeviceMonitor;
use palpate_haptics::LawSettings;
use palpate_haptics::margin::{LoopDevice, Margin, MarginSettings};
use palpate_haptics::scene::{HandLedScene, HandPose, Scene, ScenePath, SceneSettings, SceneTick};
use palpate_haptics::surface::{Grid, Heights, MeshError};
use palpate_model::units::{Depth, MmPerS, Newtons};
use palpate_runner::haptics::SceneLoop;
use palpate_runner::haptics::scene::SceneRecorder;
use palpate_runner::haptics::timing::LoopTiming;
use std::collections::VecDeque;

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
    fn of(tick: &SceneTick, settings: &SceneSettings) -> Self {
        Self {
            t: settings.period.time_of(tick.tick).seconds().0,
            force: force_of(tick),
            depth: tick.depth,
        }
    }
}

/// Length of the force on the hand in N.
#[must_use]
pub fn force_of(tick: &SceneTick) -> f64 {
    let [x, y, z] = tick.force;
    x.hypot(y).hypot(z)
}

/// A tick of a scene, and its surface then.
#[derive(Clone, Debug)]
pub struct SceneInstant {
    pub tick: SceneTick,
    grid: Grid,
    heights: Vec<f64>,
    rest: Vec<f64>,
}

impl SceneInstant {
    fn of(scene: &Scene) -> Self {
        let field = scene.field();
        Self {
            tick: scene.last(),
            grid: *field.grid(),
            heights: field.heights().to_vec(),
            // A scene's tissue is flat at rest.
            rest: vec![0.0; field.heights().len()],
        }
    }

    pub fn now(&self) -> Result<Heights<'_>, MeshError> {
        Heights::new(self.grid, &self.heights)
    }

    /// Its heights at rest in mm.
    pub fn rest(&self) -> &[f64] {
        &self.rest
    }
}

/// The margin of a scene's loop through `device` where it is now.
#[must_use]
pub fn margin_of(settings: &SceneSettings, device: LoopDevice, tick: &SceneTick) -> Margin {
    let watch = MarginSettings {
        body: LawSettings::of(settings.body, settings.period).body,
        scheme: settings.scheme,
        period: settings.period,
        device,
    };
    watch.at(Depth(tick.depth), MmPerS(tick.speed))
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
    Device(OpenDevice, DeviceReport),
}

/// The device of a scene that runs or ran.
#[derive(Debug)]
pub struct PlayedDevice {
    /// What was known before the first touch.
    pub report: DeviceReport,
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
    settings: SceneSettings,
    path: ScenePath,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<ComputedPath, String> {
    let mut led = HandLedScene::new(settings).map_err(|err| err.to_string())?;
    let mut deepest = SceneInstant::of(&led.scene);
    let mut trail = Vec::new();
    let ticks = (path.seconds() / settings.period.seconds().0).ceil() as u64;
    for tick in 1..=ticks {
        let t = settings.period.time_of(tick).seconds().0;
        let tick_now = led.tick(path.at(t, &settings));
        if !tick.is_multiple_of(TICKS_PER_POINT) {
            continue;
        }
        trail.push(ForcePoint::of(&tick_now, &settings));
        if tick_now.depth > deepest.tick.depth {
            deepest.tick = tick_now;
            let now = led.scene.field().heights();
            deepest.heights.copy_from_slice(now);
        }
        if !is_going(tick as f64 / ticks as f64) {
            return Err("the computation was cancelled".into());
        }
    }
    Ok(ComputedPath { settings, path, deepest, trail })
}

/// A scene that runs or ran last.
#[derive(Debug)]
pub struct LiveScene {
    live: Option<SceneLoop>,
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
    /// Starts the loop; `settings` are those of the device that leads it.
    pub fn start(
        settings: SceneSettings,
        lead: SceneLead,
        recorder: Option<SceneRecorder>,
    ) -> Result<Self, String> {
        let scene = Scene::new(settings).map_err(|err| err.to_string())?;
        let moment = SceneInstant::of(&scene);
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
            priority: live.granted_priority().to_string(),
            device,
            live: Some(live),
        })
    }

    /// Moves the hand and reads the newest tick. An error: the loop has ended by itself.
    pub fn poll(&mut self, hand: HandPose) -> Result<(), String> {
        let Some(live) = &mut self.live else {
            return Ok(());
        };
        live.point(hand);
        self.is_led = !live.is_over();
        let frame = live.view();
        if frame.tick.tick > self.moment.tick.tick {
            let spacing = frame.side_mm / (frame.nodes - 1) as f64;
            let grid = Grid::new(frame.nodes, frame.nodes, spacing);
            self.moment.grid = grid.map_err(|err| err.to_string())?;
            self.moment.tick = frame.tick;
            self.moment.heights.clear();
            let heights = frame.heights.iter().copied().map(f64::from);
            self.moment.heights.extend(heights);
            self.moment.rest.resize(frame.heights.len(), 0.0);
            self.trail.push_back(ForcePoint::of(&frame.tick, &self.settings));
        }
        let period = self.settings.period;
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
    pub fn stop(&mut self) -> Option<SceneLoop> {
        let live = self.live.take()?;
        self.timing = live.timing();
        Some(live)
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
    use super::*;

    #[test]
    fn a_computed_poke_is_as_deep_as_the_hand_and_ends_above() {
        let settings = SceneSettings { nodes: 41, max_shear_mm: 1.5, ..SceneSettings::default() };
        let poke = || compute_path(settings, ScenePath::Poke, &mut |_| true).unwrap();
        let one = poke();
        let deepest = &one.deepest.tick;
        // The hand goes 8 mm deep; the force holds the stylus back.
        assert!(deepest.depth > 4.0 && deepest.depth <= 8.2, "{}", deepest.depth);
        let low = one.deepest.heights.iter().copied().fold(0.0, f64::min);
        assert!((low + deepest.depth).abs() < 0.5, "{low}");
        assert!(force_of(deepest) > 0.1);
        let last = one.trail.last().unwrap();
        assert!(last.depth == 0.0 && (last.t - ScenePath::Poke.seconds()).abs() < 0.02);
        // The same bits every time, so that pictures of it are equal.
        let again = poke();
        assert_eq!(one.trail, again.trail);
        assert_eq!(one.deepest.heights, again.deepest.heights);
        let cut = compute_path(settings, ScenePath::Poke, &mut |share| share < 0.5);
        assert!(cut.unwrap_err().contains("was cancelled"));
    }
}
