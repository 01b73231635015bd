//! The window as a station: what it serves, and how a person at it arms a queue and takes that back.

use eframe::egui::Key;
use egui_kittest::kittest::Queryable;
use palpate_analysis::station_settings::StationSettings;
use palpate_drivers::sim::SimSettings;
use palpate_runner::TimeScale;
use palpate_tests::flow::WindowFlow;
use palpate_window::screens::rig;
use palpate_window::window::WindowOptions;

const QUEUE: &str = "format = \"palpate-remote-queue 1\"\nname = \"speeds of gel 7\"\nprotocol = \"ramp-hold\"\nruns = 3\n\
    [set]\ndepth = \"6 mm\"\n[choose.speed]\nfrom = \"0.6 mm/s\"\nto = \"7.8 mm/s\"\n";

const ARMED: &str = "Runs may start over the network: queue 'speeds of gel 7'";

#[test]
fn a_queue_is_armed_in_sight_and_taken_back() {
    let folder = tempfile::tempdir().unwrap();
    let scale = TimeScale::Factor(1.0);
    let mut options = WindowOptions::open("sim", &SimSettings::default(), scale).unwrap();
    options.request.station = Some(StationSettings {
        address: "127.0.0.1:0".parse().unwrap(),
        tls: None,
        is_plain_allowed: false,
        names: Vec::new(),
        library: folder.path().to_owned(),
    });
    let file = folder.path().join("speeds.toml");
    std::fs::write(&file, QUEUE).unwrap();
    let mut flow = WindowFlow::open_on(options, folder);
    flow.show(&rig::SCREEN);
    assert!(flow.says("http://127.0.0.1:"));
    assert!(!flow.is_enabled("Arm the remote queue"));
    flow.type_into("remote queue", "/there/is/no/such/file.toml");
    flow.click("Arm the remote queue");
    flow.wait_for_words("cannot be read");
    // The motor has no step rate for 1 mm/s: that is said where it can be mended.
    let between = file.with_file_name("between.toml");
    std::fs::write(&between, QUEUE.replace("0.6 mm/s", "1 mm/s")).unwrap();
    flow.type_into("remote queue", &between.display().to_string());
    flow.click("Arm the remote queue");
    flow.wait_for_words("speed = 1 mm/s cannot be run");
    flow.type_into("remote queue", &file.display().to_string());
    flow.click("Arm the remote queue");
    flow.wait_for_words(ARMED);
    // The line stands on every screen.
    flow.show(&palpate_window::screens::run::SCREEN);
    assert!(flow.says(ARMED));
    flow.click("Disarm");
    flow.wait("the end of the arming", |window| window.query_by_label("Disarm").is_none());
    flow.show(&rig::SCREEN);
    assert!(flow.says("taken back: a person at the rig took it back"));
    // A stop takes it back too.
    flow.click("Arm the remote queue");
    flow.wait_for_words(ARMED);
    flow.window.key_press(Key::F12);
    flow.wait_for_words("taken back: a person at the rig stopped it");
    flow.click("Stop serving");
    assert!(flow.is_enabled("Serve this rig"));
}
