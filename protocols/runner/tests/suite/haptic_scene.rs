//! The scene as a loop: a tick allocates nothing, frames are the surface, and a recording is computed again bit by bit.

use palpate_haptics::Period;
use palpate_haptics::device::HapticDevice;
use palpate_haptics::scene::{
    DeviceSettings, HandLedScene, HandPose, Pose, Scene, ScenePath, SceneSettings,
};
use palpate_runner::haptics::scene::{
    COLUMNS, FRAME_NODES_MAX, SENSED_COLUMNS, SceneFrame, SceneRecorder, SceneRow, SceneTask,
    scene_input, scene_row,
};
use palpate_runner::haptics::scene_file::SceneFile;
use palpate_runner::haptics::{LoopTask, SceneLoop, Stylus};
use palpate_sessions::ticks::{TickEnd, TickRecording};
use palpate_test_support::wait::until;

fn scene(settings: SceneSettings) -> Scene {
    Scene::new(settings).expect("a scene")
}

/// On the simulated device.
fn task(
    settings: SceneSettings,
    path: Option<ScenePath>,
    recorder: Option<SceneRecorder>,
) -> (SceneTask, triple_buffer::Input<HandPose>) {
    let (stylus, pointing) = Stylus::new(settings, (path, 1)).expect("a device");
    let task = SceneTask::new(scene(settings), Box::new(stylus), recorder);
    (task, pointing)
}

#[test]
fn a_tick_of_a_scene_allocates_nothing_while_it_is_recorded() {
    let at = tempfile::tempdir().unwrap();
    let recorder = SceneRecorder::start(&at.path().join("ticks"), "", COLUMNS).unwrap();
    let settings = SceneSettings::default();
    let (mut task, mut pointing) = task(settings, Some(ScenePath::Drag), Some(recorder));
    let mut frame = task.first();
    let counted = allocation_counter::measure(|| {
        for tick in 0..6000_u64 {
            pointing.write(HandPose::default());
            // Stalls too.
            task.tick(1 + u64::from(tick % 997 == 0) * 20);
            if task.is_shown() {
                task.show(&mut frame);
            }
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(frame.tick.tick > 6000);
}

fn is_the_surface(frame: &SceneFrame, task: &SceneTask) {
    let field = task.scene().field();
    let spacing = frame.side_mm / (frame.nodes - 1) as f64;
    assert_eq!(frame.heights.len(), frame.nodes * frame.nodes);
    for (index, height) in frame.heights.iter().enumerate() {
        let [x, y] = [index % frame.nodes, index / frame.nodes].map(|steps| steps as f64 * spacing);
        let node = field.grid().nearest(x, y).expect("a node");
        let right = field.heights()[field.grid().index(node)] as f32;
        assert_eq!(height.to_bits(), right.to_bits(), "{index}");
    }
}

#[test]
fn every_frame_is_the_surface_however_seldom_one_is_taken() {
    for nodes in [51, 201, 801, 950] {
        let settings = SceneSettings {
            nodes,
            max_shear_mm: 60.0 / (nodes - 1) as f64,
            recovery_s: 0.05,
            ..SceneSettings::default()
        };
        let (mut task, _) = task(settings, Some(ScenePath::Drag), None);
        // Three places as a triple buffer has them, taken in no order.
        let mut frames = [task.first(), task.first(), task.first()];
        assert!(frames[0].nodes <= FRAME_NODES_MAX);
        // All of the side, unless its cells cannot be parted evenly.
        assert_eq!(frames[0].side_mm > 59.999, nodes != 950);
        for tick in 0..4000_usize {
            task.tick(1);
            if tick % 37 == 0 {
                let frame = &mut frames[(tick / 37) * 7 % 5 % 3];
                task.show(frame);
                if tick % (37 * 3) == 0 {
                    is_the_surface(frame, &task);
                }
            }
        }
    }
}

#[test]
fn recorded_loop_is_reproduced_bit_by_bit() {
    let at = tempfile::tempdir().unwrap();
    let folder = at.path().join("poke");
    let recorder = SceneRecorder::start(&folder, "", COLUMNS).unwrap();
    let settings = SceneSettings::default();
    let mut live =
        SceneLoop::start(scene(settings), Some(ScenePath::Poke), Some(recorder)).unwrap();
    let mut deepest = 0.0_f64;
    while !live.is_over() {
        let frame = live.view();
        let lowest = frame.heights.iter().copied().fold(0.0, f32::min);
        deepest = deepest.min(f64::from(lowest));
        assert!(live.is_alive());
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(deepest < -5.0, "{deepest}");
    // Then it follows who points.
    live.point(HandPose { at: [20.0, 30.0, 5.0], turn: [0.0; 3] });
    until(
        || ((live.view().tick.device[0] - 20.0).abs() < 1.0).then_some(()),
        || "the device where the pointer is".into(),
    );
    let end = live.stop().unwrap();
    assert!(end.timing.work.count > 100);
    let recorded = end.recorded.unwrap().unwrap();
    assert_eq!(recorded.lost_ticks, 0);
    let found = TickRecording::read(&folder, COLUMNS).unwrap();
    assert_eq!(found.rows.len() as u64, recorded.ticks);
    assert_eq!(found.end, TickEnd::Whole { lost_ticks: 0, state_hash: end.scene.hash() });
    let differs = |change: fn(usize, &mut SceneRow)| {
        let mut again = HandLedScene::new(settings).unwrap();
        let mut first = None;
        for (index, row) in found.rows.iter().enumerate() {
            let mut row = *row;
            change(index, &mut row);
            let (hand, elapsed) = scene_input(&row);
            let tick = again.tick_after(hand, elapsed);
            let made = scene_row(hand, elapsed, &tick);
            first = first.or(made.first_difference(&row).map(|column| (index, column)));
        }
        (first, again.scene.hash())
    };
    assert_eq!(differs(|_, _| ()), (None, end.scene.hash()));
    // One bit of one force.
    let flipped = differs(|index, row| {
        if index == 1234 {
            row.real[8] = f64::from_bits(row.real[8].to_bits() ^ 1);
        }
    });
    assert_eq!(flipped.0, Some((1234, 3 + 8)));
}

#[test]
fn a_frame_is_due_sixty_times_a_second_whatever_the_rate() {
    for hz in [250.0, 1000.0, 5000.0] {
        let settings =
            SceneSettings { period: Period::of_rate(hz).unwrap(), ..SceneSettings::default() };
        let (mut task, _) = task(settings, None, None);
        let shown = (0..hz as usize).filter(|_| {
            task.tick(1);
            task.is_shown()
        });
        let shown = shown.count();
        assert!((58..=64).contains(&shown), "{hz} {shown}");
    }
}

#[test]
fn stored_recording_is_reproduced_bit_by_bit() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/recordings/scene-poke");
    let found = TickRecording::read(std::path::Path::new(folder), COLUMNS).unwrap();
    let file = SceneFile::parse("settings.toml", &found.settings).unwrap();
    let mut again = HandLedScene::new(file.settings(0).unwrap()).unwrap();
    assert!(found.rows.len() > 700);
    for row in &found.rows {
        let (hand, elapsed) = scene_input(row);
        let tick = again.tick_after(hand, elapsed);
        let made = scene_row(hand, elapsed, &tick);
        assert_eq!(row.first_difference(&made), None, "{row:?} {made:?}");
    }
    let left = again.scene.hash();
    assert_eq!(found.end, TickEnd::Whole { lost_ticks: 0, state_hash: left });
}

/// A device that is not simulated: its stylus goes where a script says, and it keeps what it was given.
#[derive(Debug)]
struct ScriptedDevice {
    settings: DeviceSettings,
    script: fn(u64) -> [f64; 3],
    ticks: u64,
    given: std::sync::mpsc::SyncSender<[f64; 3]>,
}

impl ScriptedDevice {
    fn new(script: fn(u64) -> [f64; 3]) -> (Box<Self>, std::sync::mpsc::Receiver<[f64; 3]>) {
        let (given, receiver) = std::sync::mpsc::sync_channel(4096);
        let settings = DeviceSettings::default();
        let device = Self { settings, script, ticks: 0, given };
        (Box::new(device), receiver)
    }
}

impl HapticDevice for ScriptedDevice {
    fn settings(&self) -> &DeviceSettings {
        &self.settings
    }

    fn sense(&mut self, elapsed: u64) -> Pose {
        self.ticks += elapsed;
        Pose { at: (self.script)(self.ticks), turn: [0.0, -0.5, 0.0] }
    }

    fn give(&mut self, force: [f64; 3]) {
        let _ = self.given.try_send(force);
    }
}

/// Pressed in at 50 mm/s to 15 mm, held, and gone after 2 s.
fn pressed(tick: u64) -> [f64; 3] {
    let depth = (0.05 * tick as f64 - 5.0).min(15.0);
    let z = if tick < 2000 { -depth } else { f64::NAN };
    [30.0, 31.0, z]
}

#[test]
fn another_device_takes_the_place_of_the_simulated_one() {
    let (device, given) = ScriptedDevice::new(pressed);
    let settings = SceneSettings::default();
    let mut task = SceneTask::new(scene(settings), device, None);
    let mut alone = scene(settings);
    let mut most = 0.0_f64;
    for tick in 1..=3000 {
        task.tick(1);
        let (at, turn) = (pressed(tick), [0.0, -0.5, 0.0]);
        let outcome = alone.render(Pose { at, turn }, 1);
        let force = given.try_recv().expect("a force in every tick");
        assert_eq!(force, outcome.force, "{tick}");
        assert!(force.iter().all(|part| part.is_finite()));
        most = most.max(force[2]);
    }
    assert!(most > 0.5, "{most}");
    // A device that is nowhere is let go.
    assert_eq!(task.scene().last().force, [0.0; 3]);
    // Its numbers are those that the scene is guarded by, or there is no scene.
    let stronger = DeviceSettings { force_max_n: 8.0, ..DeviceSettings::default() };
    let (device, _given) = ScriptedDevice::new(pressed);
    let refused = SceneLoop::start_on_device(device, scene(settings.with_device(stronger)), None);
    assert!(refused.unwrap_err().contains("different device"));
}

#[test]
fn recording_of_another_device_is_reproduced_from_its_poses() {
    let at = tempfile::tempdir().unwrap();
    let folder = at.path().join("sensed");
    let recorder = SceneRecorder::start(&folder, "", SENSED_COLUMNS).unwrap();
    let settings = SceneSettings::default();
    let (device, _given) = ScriptedDevice::new(pressed);
    let mut live = SceneLoop::start_on_device(device, scene(settings), Some(recorder)).unwrap();
    assert!(live.is_over());
    until(|| (live.view().tick.tick >= 1200).then_some(()), || "1200 ticks".into());
    let end = live.stop().unwrap();
    let found = TickRecording::read(&folder, SENSED_COLUMNS).unwrap();
    let mut again = scene(settings);
    for row in &found.rows {
        let (HandPose { at, turn }, elapsed) = scene_input(row);
        let tick = again.render(Pose { at, turn }, elapsed);
        let made = scene_row(HandPose { at, turn }, elapsed, &tick);
        assert_eq!(row.first_difference(&made), None);
    }
    assert!(again.last().depth > 10.0 && again.hash() == end.scene.hash());
}
