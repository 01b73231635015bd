//! Ten sessions on the review screen: the list, plots side by side, sorted parameters, and undo.
use eframe::egui::{Key, Modifiers, Rect};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_analysis::report::session::session_name;
use palpate_drivers::sim::{SimRig, SimSettings, SimStiffness};
use palpate_model::units::Seconds;
use palpate_protocols::plans::RampHold;
use palpate_runner::TimeScale;
use palpate_sessions::Session;
use palpate_tests::flow::WindowFlow;
use palpate_tests::recorded_runs::record_specimen;
use palpate_window::shell::rail;
use palpate_window::shell::sizes::{PanelEdge, Sizes};
use std::path::PathBuf;

/// Two specimens; the stiffness of each run in percent. The fifth run of the first is far from the others.
const STIFFNESS: [&str; 10] = ["100", "103", "97", "101", "131", "72", "70", "74", "71", "69"];

/// A window that shows ten sessions, read to their ends, and their folders in the order in which they were recorded.
fn ten_sessions() -> (WindowFlow, Vec<PathBuf>) {
    let folder = tempfile::tempdir().unwrap();
    let mut paths = Vec::new();
    for (index, stiffness) in STIFFNESS.into_iter().enumerate() {
        let path = folder.path().join(format!("run {index}"));
        let stiffness: SimStiffness = stiffness.parse().unwrap();
        let settings = SimSettings { seed: index as u64 + 1, stiffness, ..SimSettings::default() };
        let rig = SimRig::new(settings);
        let (calibration, specimen) = (rig.calibration(), format!("liver {}", index / 5 + 1));
        let params = RampHold { hold: Seconds(12.0), ..RampHold::default() };
        record_specimen(Box::new(rig), calibration, params, &specimen, &path);
        paths.push(path);
    }
    let mut flow = WindowFlow::open_in(folder, TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Num5);
    flow.window.run_steps(3);
    for path in &paths {
        flow.type_into("session", &path.display().to_string());
        flow.click("Add to view");
    }
    wait_until_read(&mut flow, paths.len());
    (flow, paths)
}

fn wait_until_read(flow: &mut WindowFlow, count: usize) {
    flow.wait("the sessions", |window| {
        let has = |words: &str| window.query_all_by_label_contains(words).next().is_some();
        let is_read = !has("still reading") && !has("waiting to be read");
        is_read && window.query_all_by_label_contains("remove: ").count() == count
    });
    flow.window.run_steps(3);
}

/// What follows a word in the names of controls, with their places, from above.
fn named(flow: &WindowFlow, word: &str) -> Vec<(String, Rect)> {
    let nodes = flow.window.query_all_by_label_contains(word);
    let mut found: Vec<(String, Rect)> = nodes
        .filter_map(|node| {
            let label = node.accesskit_node().label()?;
            Some((label.strip_prefix(word)?.to_owned(), node.rect()))
        })
        .collect();
    found.sort_by(|a, b| a.1.top().total_cmp(&b.1.top()));
    found
}

#[test]
fn ten_sessions_take_ten_lines_and_what_was_done_with_them_is_undone() {
    let (mut flow, paths) = ten_sessions();
    let rows = named(&flow, "remove: ");
    assert_eq!(rows.len(), 10);
    // One line below the other, all within the panel, each with its name before its button.
    let left = rail::WIDTH..=rail::WIDTH + Sizes::default().get(PanelEdge::Left);
    for pair in rows.windows(2) {
        let step = pair[1].1.top() - pair[0].1.top();
        assert!((20.0..=32.0).contains(&step), "{pair:?}");
    }
    let fronts = named(&flow, "front: ");
    assert_eq!(fronts.len(), 9);
    for (name, place) in rows.iter().chain(&fronts) {
        assert!(left.contains(&place.left()) && left.contains(&place.right()), "{name} {place:?}");
    }
    // What is common is said once; the whole name is the name of the control.
    let manifest = Session::open(&paths[0]).unwrap().manifest;
    let day = manifest.started_at.format("%Y-%m-%d");
    assert!(flow.says(&format!("all 10: ramp-hold, {day}")));
    assert!(flow.says(&format!("in front: {}", session_name(&manifest))));
    flow.window.check_accessibility();
    // One comes to the front, another is removed; both are undone, by key and by button.
    let order = |flow: &WindowFlow| -> Vec<String> {
        named(flow, "remove: ").into_iter().map(|(name, _)| name).collect()
    };
    let before = order(&flow);
    let [third, fifth] = [&before[2], &before[4]];
    flow.click(&format!("front: {third}"));
    assert_eq!(order(&flow)[..3], [third.clone(), before[0].clone(), before[1].clone()]);
    let moved = order(&flow);
    flow.click(&format!("remove: {fifth}"));
    assert_eq!(order(&flow).len(), 9);
    flow.click(&format!("Undo: remove {fifth}"));
    wait_until_read(&mut flow, 10);
    assert_eq!(order(&flow), moved);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    flow.window.run_steps(3);
    assert_eq!(order(&flow), before);
    assert!(!flow.says("Undo: "));
    // All of them go and come back; what was added since stays.
    flow.click("Clear list");
    assert!(flow.says("no session is shown yet"));
    flow.type_into("session", &paths[7].display().to_string());
    flow.click("Add to view");
    flow.click("Undo: clear 10 sessions");
    wait_until_read(&mut flow, 10);
    assert_eq!(order(&flow), before);
}
