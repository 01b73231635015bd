//! The start page: shown once, to whom has nothing yet; its choices by accessible name and by key.

use eframe::egui::Key;
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_analysis::window_requests::{SETTINGS_VERSION, WorkbenchRequest};
use palpate_drivers::serial::PortInfo;
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::Limits;
use palpate_runner::TimeScale;
use palpate_tests::flow::{WindowFlow, screen_of};
use palpate_window::screens::start_page::StartPage;
use palpate_window::window::WindowOptions;
use std::path::Path;
use std::sync::Arc;
use tempfile::TempDir;

const TITLE: &str = "Three ways to begin";
const FILL: &str = "Fill the library with twelve simulated sessions";

fn options(settings: &Path) -> WindowOptions {
    let mut options = WindowOptions::open("sim", &SimSettings::default(), TimeScale::Max).unwrap();
    options.settings = Some(settings.to_owned());
    options.list_ports = || Ok(Vec::new());
    options
}

#[test]
fn start_page_is_shown_once_and_leads_to_the_tour_by_keys_alone() {
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("window.json");
    let mut flow = WindowFlow::open_on(options(&settings), tempfile::tempdir().unwrap());
    assert!(flow.says(TITLE) && !flow.says("Tour 1 of 7"));
    flow.wait("the library", |window| window.query_by_label(FILL).is_some());
    flow.window.check_accessibility();
    for name in ["Simulated rig", "Find my rig", "Open a session"] {
        assert!(flow.is_enabled(name), "{name}");
    }
    // Tab comes past the rail to the first choice; Enter takes it.
    let is_there = |flow: &WindowFlow| flow.window.get_by_label("Simulated rig").is_focused();
    for _ in 0..40 {
        if is_there(&flow) {
            break;
        }
        flow.window.key_press(Key::Tab);
        flow.window.run_steps(2);
    }
    assert!(is_there(&flow), "Tab does not reach the first choice");
    flow.window.key_press(Key::Enter);
    flow.window.run_steps(3);
    assert!(!flow.says(TITLE) && flow.says("Tour 1 of 7"));
    flow.click("End the tour");
    eframe::App::on_exit(flow.window.state_mut());
    drop(flow);
    // The settings alone are enough, whatever the library has.
    let mut flow = WindowFlow::open_on(options(&settings), tempfile::tempdir().unwrap());
    assert!(!flow.says(TITLE) && !flow.says("Tour 1 of 7"));
    flow.act_by_name("start page");
    assert!(flow.says(TITLE));
    // It is no screen to come back to.
    eframe::App::on_exit(flow.window.state_mut());
    drop(flow);
    let flow = WindowFlow::open_on(options(&settings), tempfile::tempdir().unwrap());
    assert!(!flow.says(TITLE));
}

#[test]
fn start_page_is_not_shown_where_sessions_are_or_where_nothing_is_remembered() {
    let library = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(library.path().join("sessions/one")).unwrap();
    let settings = library.path().join("window.json");
    let mut flow = WindowFlow::open_on(options(&settings), library);
    assert!(!flow.says(TITLE) && flow.says("Tour 1 of 7"));
    flow.act_by_name("start page");
    flow.wait_for_words("the library has sessions already");
    assert!(!flow.is_enabled(FILL));
    // Windows without settings, as those of tests, have neither page nor tour.
    let flow = WindowFlow::open(TimeScale::Max);
    assert!(!flow.says(TITLE) && !flow.says("Tour 1 of 7"));
}

#[test]
fn library_is_filled_from_the_start_page() {
    let library = tempfile::tempdir().unwrap();
    let settings = library.path().join("window.json");
    let mut flow = WindowFlow::open_on(options(&settings), library);
    flow.wait("an empty library", |window| {
        let node = window.query_by_label(FILL);
        node.is_some_and(|node| !node.accesskit_node().is_disabled())
    });
    flow.click(FILL);
    flow.wait_for_words("Twelve sessions were recorded");
    let sessions = std::fs::read_dir(flow.folder.path().join("sessions")).unwrap();
    assert_eq!(sessions.count(), 12);
    flow.wait_for_words("the library has sessions already");
    flow.click("Show the library");
    flow.wait_for_words("12 sessions, found in");
}

/// A library with a rig file that names a port.
fn library_with_rig() -> TempDir {
    let library = tempfile::tempdir().unwrap();
    let rigs = library.path().join("rigs");
    std::fs::create_dir_all(&rigs).unwrap();
    let text = "device = \"galil\"\nport = \"/dev/there-is-no-such-port\"\nmm_per_pulse = 0.015\n\
        travel_mm = 150\nspeed_max_mm_s = 20\nacceleration_mm_s2 = 61.44\nconverter = \"16 bit\"\n";
    std::fs::write(rigs.join("bench.toml"), text).unwrap();
    std::fs::write(rigs.join("wrong.toml"), "device = \"marlin\"\n").unwrap();
    library
}

/// Opens a simulated rig in the name of the file, or refuses the second file.
fn open_rig(name: &str) -> Result<WorkbenchRequest, String> {
    let settings = SimSettings::default();
    let Some("bench.toml" | "sim") = Path::new(name).file_name().and_then(|name| name.to_str())
    else {
        return Err(format!("{name} was refused on purpose"));
    };
    let known = if name == "sim" { "sim" } else { "sim:bench" };
    let rig = palpate_drivers::open(known, &settings).unwrap();
    let limits = Limits::for_travel(rig.description().travel);
    let calibration = palpate_drivers::sim::calibration(settings.profile);
    Ok(WorkbenchRequest {
        doubts: vec!["the calibration is old".into()],
        ..WorkbenchRequest::of(rig, calibration, limits, TimeScale::Max)
    })
}

#[test]
fn rig_is_found_and_connected_in_place_of_the_simulated_one() {
    let library = library_with_rig();
    let mut options = options(&library.path().join("window.json"));
    options.list_ports = || {
        let name = "/dev/there-is-no-such-port".into();
        Ok(vec![PortInfo { name, description: "USB 0403:6001".into() }])
    };
    options.request.open_rig = Some(Arc::new(open_rig));
    let mut flow = WindowFlow::open_on(options, library);
    flow.click("Find my rig");
    flow.wait_for_words("does not exist");
    let found = screen_of::<StartPage>(&flow.window).found().unwrap();
    let names: Vec<_> = found.files.iter().map(|one| one.path.file_name().unwrap()).collect();
    assert_eq!(names, ["bench.toml", "wrong.toml"]);
    assert!(flow.says("USB 0403:6001") && flow.says("line 1: device"));
    flow.window.check_accessibility();
    flow.click("Connect bench.toml");
    flow.wait_for_words("Rig sim:bench");
    let snapshot = flow.window.state().snapshot();
    assert!(snapshot.run.is_none(), "connecting moved the rig");
    // What nobody reads on a terminal must be acknowledged.
    flow.act_by_name("screen run");
    assert!(flow.says("the calibration is old"));
    // The operator is known there, too, and the folder of the library is the same.
    flow.act_by_name("start page");
    assert!(flow.says(TITLE));
}

#[test]
fn search_that_finds_nothing_says_what_to_do() {
    let library = tempfile::tempdir().unwrap();
    let settings = library.path().join("window.json");
    let rigs = library.path().join("rigs").display().to_string();
    let mut flow = WindowFlow::open_on(options(&settings), library);
    flow.act_by_name("find my rig");
    flow.wait_for_words("No rig file and no serial port was found");
    assert!(flow.says(&rigs) && flow.says("this window cannot open another rig"));
}

#[test]
fn settings_of_a_newer_version_are_reported_and_stay_when_the_window_closes() {
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("window.json");
    let newer = format!("{{\"settings_version\": {}, \"zoom\": []}}", SETTINGS_VERSION + 1);
    std::fs::write(&settings, &newer).unwrap();
    let mut flow = WindowFlow::open_on(options(&settings), tempfile::tempdir().unwrap());
    flow.window.run_steps(3);
    assert!(!flow.says(TITLE), "settings are no first start");
    assert!(flow.says("a newer version of palpate wrote the window's settings"));
    flow.act_by_name("light and dark");
    eframe::App::on_exit(flow.window.state_mut());
    assert_eq!(std::fs::read_to_string(&settings).unwrap(), newer);
}
