//! The scene screen: a path computed ahead, the scene itself along a path and under keys, and its stop.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use palpate_model::scene::WhyNoForce;
use palpate_protocols::runner::TimeScale;
use palpate_tests::flow::{Flow, Window};

fn open() -> Flow {
    let mut flow = Flow::open(TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    flow.window.run_steps(3);
    flow
}

/// The newest depth in mm and force in N.
fn felt(window: &Window) -> Option<(f64, f64)> {
    let tick = window.state().scene().touch()?.moment().tick;
    let [x, y, z] = tick.force;
    Some((tick.depth, x.hypot(y).hypot(z)))
}

#[test]
fn a_poke_is_computed_then_felt_along_its_path_and_stopped_by_escape() {
    let mut flow = open();
    flow.wait("the path", |window| {
        window.state().scene().ahead().is_some()
    });
    flow.window.run_steps(3);
    let ahead = flow.window.state().scene().ahead().unwrap();
    let deepest = ahead.as_ref().unwrap().deepest.tick;
    assert!(flow.says(&format!("at {:.2} mm", deepest.depth)));
    assert!(flow.says("poke, computed: where it is deepest"));
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
    assert!(flow.says("the path leads the hand"));
    assert!(!flow.says(WhyNoForce::NoContact.words()));
    flow.window.check_accessibility();
    // Nothing else that keeps time is started beside it.
    flow.window
        .key_press_modifiers(Modifiers::COMMAND, Key::Num9);
    flow.window.run_steps(3);
    assert!(flow.says("the scene runs and would be disturbed"));
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    flow.wait("the end of the path", |window| {
        let touch = window.state().scene().touch().unwrap();
        touch.is_running() && !touch.is_led()
    });
    flow.wait("the stylus above", |window| {
        felt(window).is_some_and(|(depth, _)| depth == 0.0)
    });
    flow.window.run_steps(2);
    assert!(flow.says(WhyNoForce::NoContact.words()));
    flow.window.key_press(Key::Escape);
    flow.window.run_steps(3);
    assert!(!flow.window.state().scene().is_running());
    assert!(flow.says("stopped; as it was seen last"));
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
    assert!(!flow.says(WhyNoForce::NoContact.words()));
    for _ in 0..12 {
        flow.window.key_press(Key::PageUp);
        flow.window.step();
    }
    flow.wait("no contact", |window| {
        felt(window).is_some_and(|(depth, force)| depth == 0.0 && force == 0.0)
    });
    flow.window.run_steps(2);
    assert!(flow.says(WhyNoForce::NoContact.words()));
    flow.click("Stop the scene");
    assert!(!flow.window.state().scene().is_running());
}

#[test]
fn a_scene_file_fills_the_form_and_a_wrong_one_says_where() {
    let mut flow = open();
    let path = flow.folder.path().join("pad.toml");
    let text = "name = \"soft pad\"\n[tissue]\nside_mm = 40.0\n[mesh]\nnodes = 81\n";
    std::fs::write(&path, text).unwrap();
    flow.type_into("file", &path.display().to_string());
    flow.click("Open");
    flow.wait("the file", |window| {
        window.query_by_label("soft pad").is_some()
    });
    flow.click("Start the scene");
    let touch = flow.window.state().scene().touch().unwrap();
    assert_eq!(
        (touch.settings().side_mm, touch.settings().nodes),
        (40.0, 81)
    );
    flow.click("Stop the scene");
    std::fs::write(&path, text.replace("40.0", "-1.0")).unwrap();
    flow.click("Open");
    flow.wait("the refusal", |window| {
        let mut found = window.query_all_by_label_contains("side_mm");
        found.next().is_some()
    });
    assert_eq!(
        flow.window
            .state()
            .scene()
            .touch()
            .unwrap()
            .settings()
            .side_mm,
        40.0
    );
}
