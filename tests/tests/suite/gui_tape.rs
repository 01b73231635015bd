//! Recordings of what is felt in the window: which tick differs, of what kind they are, and how they end.
use eframe::App;
use eframe::egui::{DroppedFile, Key, Modifiers};
use palpate_runner::TimeScale;
use palpate_tests::flow::{TestWindow, WindowFlow, screen_of};
use palpate_window::screens::haptics::HapticsScreen;
use palpate_window::screens::scene::SceneScreen;
use palpate_window::screens::screen::Screen;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn open(key: Key) -> WindowFlow {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, key);
    flow.window.run_steps(3);
    flow
}

/// Asks for a recording in a new folder.
fn record(flow: &mut WindowFlow, name: &str) -> PathBuf {
    let folder = flow.folder.path().join(name);
    flow.type_into("record to", &folder.display().to_string());
    folder
}

fn is_deep(window: &TestWindow) -> bool {
    let touch = screen_of::<SceneScreen>(window).live_scene();
    touch.is_some_and(|touch| touch.moment().tick.depth > 1.0)
}

fn lines(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("ticks.csv")).unwrap();
    text.lines().map(String::from).collect()
}

fn write(folder: &Path, lines: &[String]) {
    std::fs::write(folder.join("ticks.csv"), lines.join("\n") + "\n").unwrap();
}

/// The recording is described as it stands on disk. A changed digit of a column is refused, and named where no end tells of it.
fn check_description(flow: &mut WindowFlow, folder: &Path, column: &str) {
    flow.wait_for_words("ticks recorded, none lost");
    let whole = lines(folder);
    let end: Vec<&str> = whole.last().unwrap().split(',').collect();
    assert_eq!(end[0], "end");
    let expected = format!("{} ticks recorded, none lost; hash at the end {}", end[1], end[3]);
    assert!(flow.says(&expected), "{expected}");
    flow.click("Replay recording");
    flow.wait_for_words("every number bit for bit as recorded");

    let middle = whole.len() / 2;
    let at = whole[0].split(',').position(|name| name == column).unwrap();
    let mut cells: Vec<String> = whole[middle].split(',').map(String::from).collect();
    // Of seventeen digits the last may be one that no number needs.
    let value: f64 = cells[at].parse().unwrap();
    cells[at] = (value * (1.0 + 1e-14) + f64::MIN_POSITIVE).to_string();
    let tick = cells[0].clone();
    let mut changed = whole.clone();
    changed[middle] = cells.join(",");
    write(folder, &changed);
    flow.click("Replay recording");
    flow.wait_for_words("the recording is damaged");
    write(folder, &changed[..=middle]);
    flow.click("Replay recording");
    flow.wait_for_words(&format!("tick {tick}: {column} is "));
    assert!(!flow.says("bit for bit"));
    write(folder, &whole);
}

#[test]
fn the_end_of_a_recording_is_described_as_it_is_on_disk_and_a_changed_digit_is_found() {
    let mut flow = open(Key::E);
    // A mesh that a slow test machine ticks in time.
    flow.type_into("nodes", "51");
    let folder = record(&mut flow, "poke");
    flow.click("Start the scene");
    assert!(flow.says("every tick is recorded"));
    flow.wait("a depth", is_deep);
    flow.click("Stop the scene");
    check_description(&mut flow, &folder, "depth_mm");
    // What is not asked for is not recorded, and nothing is said of the one before.
    flow.click("Start the scene");
    assert!(screen_of::<SceneScreen>(&flow.window).is_running());
    assert!(!flow.says("every tick is recorded") && !flow.says("ticks recorded"));
    flow.click("Stop the scene");
}

#[test]
fn a_window_that_closes_writes_its_recording_to_its_end() {
    let mut flow = open(Key::E);
    flow.type_into("nodes", "51");
    let folder = record(&mut flow, "poke");
    flow.click("Start the scene");
    flow.wait("a depth", is_deep);
    flow.window.state_mut().on_exit();
    let end = lines(&folder).pop().unwrap();
    assert!(end.starts_with("end,"), "{end}");
}

#[test]
fn where_a_hand_was_led_is_replayed_and_every_kind_of_recording_has_its_screen() {
    let mut flow = open(Key::Num9);
    flow.click("Check  F6");
    flow.wait("the check", |window| {
        let haptics = screen_of::<HapticsScreen>(window);
        haptics.check_result().is_some() && !haptics.is_busy()
    });
    // What is recorded is what runs: without guards too.
    flow.click("without guards and controller");
    let folder = record(&mut flow, "felt");
    flow.click("Start the loop");
    flow.click("Ramp and hold");
    flow.wait("a force", |window| {
        let feel = screen_of::<HapticsScreen>(window).live_loop();
        feel.is_some_and(|feel| feel.last().snapshot.force.0 > 1.0)
    });
    flow.click("Stop the loop");
    check_description(&mut flow, &folder, "force_n");
    // Led away instead, the hand would not press.
    let whole = lines(&folder);
    let elsewhere = whole.iter().filter(|line| !line.starts_with("end"));
    let elsewhere = elsewhere.map(|line| line.replace(",30.0,", ",-2.0,"));
    write(&folder, &elsewhere.collect::<Vec<_>>());
    flow.click("Replay recording");
    flow.wait_for_words(" in the recording; ");
    write(&folder, &whole);

    // Another kind is refused and not misread, and goes to its own screen when it is dropped.
    let scene = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = scene.join("../protocols/tests/recordings/scene-poke");
    flow.type_into("replay", &scene.display().to_string());
    flow.click("Replay recording");
    flow.wait_for_words("lacks the columns of a master-slave recording");
    drop_on(&mut flow, &scene);
    assert!(flow.says("Start the scene"));
    flow.click("Replay recording");
    flow.wait_for_words("every number bit for bit as recorded");
    flow.type_into("replay", &folder.display().to_string());
    flow.click("Replay recording");
    flow.wait_for_words("lacks the columns of a scene recording");
    drop_on(&mut flow, &folder);
    assert!(flow.says("Start the loop"));
    flow.click("Replay recording");
    flow.wait_for_words("master and slave, led by hand: ");
}

/// A folder dropped on the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("a folder".into())
    }
}

fn drop_on(flow: &mut WindowFlow, folder: &Path) {
    let dropped = Dropped(folder.to_owned());
    let input = flow.window.input_mut();
    input.dropped_files.push(Arc::new(dropped));
    flow.window.run_steps(3);
}
