//! The scene screen: a path computed ahead, the scene itself along a path and under keys, and its stop.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use palpate_emulators::ServedDevice;
use palpate_emulators::hapi::{EmulatedHapi, HapiBoardSettings};
use palpate_emulators::inverse::{EmulatedInverse, InverseServiceSettings};
use palpate_haptics::scene::NoForceReason;
use palpate_runner::TimeScale;
use palpate_tests::flow::{TestWindow, WindowFlow, screen_of};
use palpate_window::screens::scene::SceneScreen;
use palpate_window::screens::screen::Screen;
use palpate_window::screens::trade::TradeScreen;
use palpate_window::workers::scene_tissue::ShownTissue;
use std::path::Path;

fn open() -> WindowFlow {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    flow.window.run_steps(3);
    flow
}

/// Writes a scene file and reads it in the window; `name` is the scene's.
fn read(flow: &mut WindowFlow, path: &Path, text: &str, name: &str) {
    std::fs::write(path, text).expect("a scene file");
    flow.type_into("file", &path.display().to_string());
    flow.click("Open");
    flow.wait("the file", |window| window.query_by_label(name).is_some());
}

/// The newest depth in mm and force in N.
fn felt(window: &TestWindow) -> Option<(f64, f64)> {
    let tick = screen_of::<SceneScreen>(window).live_scene()?.moment().tick;
    let [x, y, z] = tick.force;
    Some((tick.depth, x.hypot(y).hypot(z)))
}

#[test]
fn a_poke_is_computed_then_felt_along_its_path_and_stopped_by_escape() {
    let mut flow = open();
    flow.wait("the path", |window| screen_of::<SceneScreen>(window).computed_path().is_some());
    flow.window.run_steps(3);
    let ahead = screen_of::<SceneScreen>(&flow.window).computed_path().unwrap();
    let deepest = ahead.as_ref().unwrap().deepest.tick;
    assert!(flow.says(&format!("at {:.2} mm", deepest.depth)));
    assert!(flow.says("poke, computed: the deepest point"));
    flow.window.check_accessibility();

    flow.type_into("nodes", "2");
    assert!(!flow.is_enabled("Start the scene"));
    assert!(flow.says("must be from 3 to 1601"));
    // A mesh that a slow test machine ticks in time.
    flow.type_into("nodes", "51");
    flow.click("Start the scene");
    flow.wait("a force", |window| {
        felt(window).is_some_and(|(depth, force)| depth > 2.0 && force > 0.05)
    });
    assert!(flow.says("the path moves the hand"));
    assert!(!flow.says(NoForceReason::NoContact.name()));
    flow.window.check_accessibility();
    // Nothing else that keeps time is started beside it.
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Num9);
    flow.window.run_steps(3);
    assert!(flow.says("the scene runs, and this would disturb its timing"));
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    flow.wait("the end of the path", |window| {
        let touch = screen_of::<SceneScreen>(window).live_scene().unwrap();
        touch.is_running() && !touch.is_led()
    });
    flow.wait("the stylus above", |window| felt(window).is_some_and(|(depth, _)| depth == 0.0));
    flow.window.run_steps(2);
    assert!(flow.says(NoForceReason::NoContact.name()));
    flow.window.key_press(Key::Escape);
    flow.window.run_steps(3);
    assert!(!screen_of::<SceneScreen>(&flow.window).is_running());
    assert!(flow.says("stopped; the last picture"));
}

#[test]
fn switches_of_the_picture_are_kept_and_without_an_adapter_a_sentence_stands_in_its_place() {
    let mut flow = open();
    flow.wait("the path", |window| screen_of::<SceneScreen>(window).computed_path().is_some());
    flow.window.run_steps(3);
    assert!(flow.says("This window is drawn without a graphics adapter"));
    assert!(flow.says("drawn with a radius of 1.5 mm"));
    assert_eq!(screen_of::<SceneScreen>(&flow.window).layout(), None);
    for name in ["depth", "finger", "lines of equal depth", "two eyes, side by side"] {
        flow.click(name);
    }
    assert!(flow.says("drawn with a radius of 3.6 mm"));
    let kept = screen_of::<SceneScreen>(&flow.window).layout().unwrap();
    let mut other = SceneScreen::default();
    other.take_layout(&kept);
    assert_eq!(other.layout(), Some(kept));
}

#[test]
fn keys_press_into_the_tissue_and_lift_again() {
    let mut flow = open();
    flow.type_into("nodes", "51");
    flow.click("pointer and keys");
    flow.click("Start the scene");
    flow.window.get_by_label("scene picture").focus();
    flow.window.run_steps(2);
    // From 3 mm above to 3 mm below, half a millimetre a press.
    for _ in 0..12 {
        flow.window.key_press(Key::PageDown);
        flow.window.step();
    }
    flow.wait("a force", |window| {
        felt(window).is_some_and(|(depth, force)| depth > 1.0 && force > 0.02)
    });
    assert!(!flow.says(NoForceReason::NoContact.name()));
    for _ in 0..12 {
        flow.window.key_press(Key::PageUp);
        flow.window.step();
    }
    flow.wait("no contact", |window| {
        felt(window).is_some_and(|(depth, force)| depth == 0.0 && force == 0.0)
    });
    flow.window.run_steps(2);
    assert!(flow.says(NoForceReason::NoContact.name()));
    flow.click("Stop the scene");
    assert!(!screen_of::<SceneScreen>(&flow.window).is_running());
}

#[test]
fn a_real_device_is_opened_judged_with_its_delay_and_leads_the_stylus() {
    let (emulated, _panel) = EmulatedInverse::new(InverseServiceSettings::default()).unwrap();
    let served = ServedDevice::start(emulated, ServedDevice::free_port()).unwrap();
    let mut flow = open();
    flow.wait("the path", |window| screen_of::<SceneScreen>(window).computed_path().is_some());
    flow.type_into("nodes", "51");
    flow.click("haptic device");
    flow.window.run_steps(2);
    flow.window.check_accessibility();
    for (device, words) in [("omni", "inverse:NAME"), ("inverse:left", "left")] {
        flow.type_into("device", device);
        flow.type_into("service", &served.address);
        if flow.is_enabled("Start the scene") {
            flow.click("Start the scene");
        }
        flow.wait_for_words(words);
        assert!(!screen_of::<SceneScreen>(&flow.window).is_running());
    }
    flow.type_into("device", "inverse");
    let folder = flow.folder.path().join("touched");
    flow.type_into("record to", &folder.display().to_string());
    flow.click("Start the scene");
    flow.wait("the device", |window| screen_of::<SceneScreen>(window).is_running());
    flow.wait_for_words("a round trip takes");
    assert!(flow.says("the device moves the stylus"));
    flow.window.check_accessibility();
    // One tick between a position and its force, the round trip, and what the service adds: never none.
    let looped = screen_of::<SceneScreen>(&flow.window).live_scene().unwrap().loop_device();
    assert!(looped.delay_ticks >= 1.0, "{looped:?}");
    flow.wait("reports of the device", |window| {
        let live = screen_of::<SceneScreen>(window).live_scene().unwrap();
        live.device().unwrap().used().reports > 10 && live.now() > 0.2
    });
    flow.window.key_press(Key::Escape);
    flow.window.run_steps(2);
    assert!(!screen_of::<SceneScreen>(&flow.window).is_running());
    flow.wait_for_words("ticks recorded");
    flow.click("Replay recording");
    flow.wait("the replay", |window| replayed(window).is_some());
    assert_eq!(replayed(&flow.window), Some(Ok(true)));
}

#[test]
fn a_device_without_a_button_gives_no_force_until_its_report_was_read() {
    let (board, panel) = EmulatedHapi::new(HapiBoardSettings::default()).unwrap();
    let served = ServedDevice::start(board, ServedDevice::free_port()).unwrap();
    let mut flow = open();
    flow.wait("the path", |window| screen_of::<SceneScreen>(window).computed_path().is_some());
    flow.type_into("nodes", "51");
    flow.click("haptic device");
    flow.type_into("device", &format!("hapi:{}", served.address));
    flow.click("Start the scene");
    flow.wait_for_words("The device is open and gives no force");
    flow.wait_for_words("keep the switch of the motors' power supply within reach");
    flow.window.check_accessibility();
    // Escape closes it again.
    flow.window.key_press(Key::Escape);
    flow.wait_for_words("hold the left button to press");
    flow.click("Start the scene");
    flow.wait_for_words("The device is open and gives no force");
    assert!(!screen_of::<SceneScreen>(&flow.window).is_running());
    assert_eq!(panel.torques(), [0.0; 2]);
    flow.click("Start the scene");
    flow.wait("the scene", |window| screen_of::<SceneScreen>(window).is_running());
    flow.wait("reports of the device", |window| {
        let live = screen_of::<SceneScreen>(window).live_scene().unwrap();
        live.device().unwrap().used().reports > 10
    });
    flow.click("Stop the scene");
    assert!(!screen_of::<SceneScreen>(&flow.window).is_running());
}

/// A square pad of 60 mm in steps of 4 mm, as Wavefront OBJ.
fn pad_obj() -> String {
    let mut text = String::new();
    for node in 0..256 {
        text += &format!("v {} {} 0\n", 4 * (node % 16), 4 * (node / 16));
    }
    for cell in 0..225 {
        let here = 16 * (cell / 15) + cell % 15 + 1;
        text += &format!("f {here} {} {} {}\n", here + 1, here + 17, here + 16);
    }
    text
}

#[test]
fn a_mesh_is_computed_felt_recorded_and_replayed() {
    let mut flow = open();
    let folder = flow.folder.path().to_owned();
    std::fs::write(folder.join("pad.obj"), pad_obj()).unwrap();
    let text = "name = \"pad of triangles\"\n[mesh]\nfile = \"pad.obj\"\n";
    read(&mut flow, &folder.join("pad.toml"), text, "pad of triangles");
    flow.wait("the path", |window| {
        let found = screen_of::<SceneScreen>(window).computed_path();
        let found = found.and_then(|one| one.as_ref().ok());
        found.is_some_and(|one| matches!(one.deepest.tissue, ShownTissue::Mesh(_)))
    });
    flow.window.run_steps(2);
    assert!(flow.says("poke, computed: the deepest point"));
    assert!(flow.says("The triangles of a mesh from a file are not planned"));
    assert!(flow.window.query_by_label("nodes").is_none());
    flow.window.check_accessibility();
    let recording = folder.join("poke");
    flow.type_into("record to", &recording.display().to_string());
    flow.click("Start the scene");
    flow.wait("a force", |window| {
        felt(window).is_some_and(|(depth, force)| depth > 2.0 && force > 0.05)
    });
    flow.wait("the end of the path", |window| {
        let touch = screen_of::<SceneScreen>(window).live_scene().unwrap();
        touch.is_running() && !touch.is_led()
    });
    flow.window.key_press(Key::Escape);
    flow.window.run_steps(2);
    flow.wait_for_words("ticks recorded");
    flow.click("Replay recording");
    flow.wait("the replay", |window| replayed(window).is_some());
    assert_eq!(replayed(&flow.window), Some(Ok(true)));
}

#[test]
fn a_scene_file_fills_the_form_and_a_wrong_one_says_where() {
    let mut flow = open();
    let path = flow.folder.path().join("pad.toml");
    let text = "name = \"soft pad\"\n[tissue]\nside_mm = 40.0\n[mesh]\nnodes = 81\n";
    read(&mut flow, &path, text, "soft pad");
    flow.click("Start the scene");
    let touch = screen_of::<SceneScreen>(&flow.window).live_scene().unwrap();
    assert_eq!((touch.settings().side_mm, touch.settings().nodes), (40.0, 81));
    flow.click("Stop the scene");
    std::fs::write(&path, text.replace("40.0", "-1.0")).unwrap();
    flow.click("Open");
    flow.wait_for_words("side_mm");
    assert_eq!(
        screen_of::<SceneScreen>(&flow.window).live_scene().unwrap().settings().side_mm,
        40.0
    );
}

fn replayed(window: &TestWindow) -> Option<Result<bool, String>> {
    let replayed = screen_of::<SceneScreen>(window).replayed()?;
    Some(replayed.as_ref().map(|one| one.is_identical).map_err(Clone::clone))
}

#[test]
fn a_scene_is_recorded_and_its_recording_replayed_bit_by_bit() {
    let mut flow = open();
    assert!(!flow.is_enabled("Replay recording") && flow.says("type the folder of a recording"));
    let folder = flow.folder.path().join("poke");
    let called = folder.display().to_string();
    flow.type_into("nodes", "51");
    flow.type_into("record to", &called);
    flow.click("Start the scene");
    assert!(!flow.is_enabled("Replay recording"));
    flow.wait("the end of the path", |window| {
        let touch = screen_of::<SceneScreen>(window).live_scene().unwrap();
        touch.is_running() && !touch.is_led()
    });
    flow.window.key_press(Key::Escape);
    flow.window.run_steps(2);
    flow.wait_for_words("ticks recorded, none lost");
    flow.click("Replay recording");
    flow.wait("the replay", |window| replayed(window).is_some());
    flow.window.run_steps(3);
    assert_eq!(replayed(&flow.window), Some(Ok(true)));
    assert!(flow.says("every number bit for bit as recorded"));
    flow.window.check_accessibility();
    // A folder has one recording.
    flow.type_into("record to", &called);
    flow.click("Start the scene");
    assert!(!screen_of::<SceneScreen>(&flow.window).is_running());
    assert!(flow.says("give a new folder in a writable place"));
    flow.type_into("record to", "");
    // Another body gives other forces, and a changed line is reported.
    let settings = folder.join("settings.toml");
    let text = std::fs::read_to_string(&settings).unwrap();
    std::fs::write(&settings, text.replacen("tau_eps = 1", "tau_eps = 2", 1)).unwrap();
    flow.click("Replay recording");
    flow.wait("the difference", |window| replayed(window) == Some(Ok(false)));
    flow.window.run_steps(3);
    assert!(flow.says(" in the recording; "));
    let ticks = folder.join("ticks.csv");
    let lines = std::fs::read_to_string(&ticks).unwrap();
    std::fs::write(&ticks, lines.replacen("\n10,", "\n11,", 1)).unwrap();
    flow.click("Replay recording");
    flow.wait("the damage", |window| replayed(window).is_some_and(|one| one.is_err()));
    flow.window.run_steps(3);
    assert!(flow.says("the recording is damaged"));
}

#[test]
fn a_plan_is_taken_and_stands_in_the_form() {
    let mut flow = open();
    // Any computer holds these.
    let path = flow.folder.path().join("loose.toml");
    let text = "name = \"loose\"\n[tolerances]\nforce_percent = 1000.0\nshape_mm = 5.0\ntick_us = 100000.0\n";
    read(&mut flow, &path, text, "loose");
    assert!(!flow.is_enabled("Use plan"));
    assert!(flow.says("measure the cost of a scene on the Trade screen first"));
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Num7);
    flow.window.run_steps(3);
    flow.click("Scene: mesh");
    flow.click("few rows, rough times");
    flow.click("Measure here  F6");
    flow.wait("the curves", |window| screen_of::<TradeScreen>(window).scene_curves().is_some());
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    flow.window.run_steps(3);
    assert!(flow.says("left out: ") && flow.says("without effect: MinDist"));
    flow.click("Use plan");
    flow.window.run_steps(3);
    flow.click("Start the scene");
    let settings = *screen_of::<SceneScreen>(&flow.window).live_scene().unwrap().settings();
    let curves = screen_of::<TradeScreen>(&flow.window).scene_curves().unwrap();
    let meshes = curves.meshes.iter().map(|mesh| mesh.nodes as usize);
    assert!(meshes.clone().any(|nodes| nodes == settings.nodes));
    assert!(flow.says(&format!("plan: {0} x {0} nodes", settings.nodes)));
    flow.click("Stop the scene");
}

#[test]
fn a_missed_budget_is_reported_before_anything_was_measured_and_a_button_leads_to_the_measurement()
{
    let mut flow = open();
    let path = flow.folder.path().join("strict.toml");
    // No computer makes a tick in a millionth of a microsecond.
    let text = "name = \"strict\"\n[mesh]\nnodes = 51\n[tolerances]\ntick_us = 1e-6\n";
    read(&mut flow, &path, text, "strict");
    flow.click("Start the scene");
    flow.wait("times", |window| {
        let touch = screen_of::<SceneScreen>(window).live_scene();
        touch.is_some_and(|touch| touch.kept().work.count > 0)
    });
    flow.window.run_steps(2);
    assert!(flow.says("but the budget is 0.000001 µs"));
    // It is that of the scene that ran, whatever stands in the form.
    flow.click("Stop the scene");
    flow.click("Built in");
    flow.wait("the usual scene", |window| window.query_by_label("thesis body").is_some());
    flow.window.run_steps(2);
    assert!(flow.says("500 µs") && flow.says("but the budget is 0.000001 µs"));
    flow.click("Measure on Trade...");
    assert!(flow.says("nothing measured on this machine yet") && flow.says("mm of error"));
}
