//! The review screen, driven by accessible name: sessions closely and beside each other.
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use palpate_analysis::report::budget::{BUDGET_TITLE, UncertaintyBudget};
use palpate_analysis::report::session::session_name;
use palpate_analysis::report::text::ParameterText;
use palpate_runner::TimeScale;
use palpate_sessions::Session;
use palpate_tests::flow::WindowFlow;
use palpate_tests::workspace;
use std::path::PathBuf;

/// A window on the review screen.
fn review() -> WindowFlow {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Num5);
    flow.window.run_steps(3);
    flow
}

/// Shows a copy of a recorded session.
fn show(flow: &mut WindowFlow, name: &str) -> PathBuf {
    let path = flow.folder.path().join(name);
    std::fs::create_dir(&path).unwrap();
    for item in std::fs::read_dir(workspace().join("tests/sessions").join(name)).unwrap() {
        let item = item.unwrap();
        std::fs::copy(item.path(), path.join(item.file_name())).unwrap();
    }
    flow.type_into("session", &path.display().to_string());
    flow.click("Add to view");
    let words = format!("remove: {}", session_name(&Session::open(&path).unwrap().manifest));
    flow.wait("the session", |window| {
        let says = |words: &str| window.query_all_by_label_contains(words).next().is_some();
        says(&words) && !says("still reading") && !says("waiting to be read")
    });
    flow.window.run_steps(3);
    path
}

#[test]
fn one_session_is_looked_at_closely() {
    let mut flow = review();
    assert!(flow.says("no session is shown") && !flow.is_enabled("Add to view"));
    assert!(flow.says("type the path of a session's folder"));
    let path = show(&mut flow, "ramp-hold-lab");
    let session = Session::open(&path).unwrap();
    // What is known of it.
    for words in [
        session.manifest.session_id.as_str(),
        session.manifest.specimen.as_str(),
        "ending",
        "SHA-256 of its files",
        "health",
        "contact",
        "line: mean of ",
    ] {
        assert!(flow.says(words), "{words}");
    }
    flow.click("SHA-256 of its files");
    flow.window.run_steps(3);
    assert!(flow.says("000.mcap"));
    flow.window.check_accessibility();
    // Cursors and what stands between them, by button and by key.
    assert!(flow.says("set cursors A and B"));
    flow.click("Cursor A");
    assert!(flow.says("F at A") && !flow.says("dF"));
    flow.window.key_press(Key::B);
    flow.window.run_steps(2);
    for words in ["t at A", "t at B", "dt +", "dF", "d signal", "signal at B"] {
        assert!(flow.says(words), "{words}");
    }
    // From a third of the picture to behind contact, at 88.7 of 105 s.
    for _ in 0..220 {
        flow.window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
        flow.window.step();
    }
    flow.window.run_steps(2);
    assert!(flow.says("depth at A"));
    flow.click("Copy readout");
    flow.click("Clear cursors");
    assert!(!flow.says("F at A"));
    // From far away to every sample and back.
    for _ in 0..14 {
        flow.click("Zoom in");
    }
    assert!(flow.says("every sample is drawn"));
    flow.window.key_press(Key::ArrowRight);
    flow.window.key_press(Key::Minus);
    flow.window.key_press(Key::Home);
    flow.window.run_steps(2);
    assert!(flow.says("line: mean of "));
    // Which quantities, and where time begins.
    for name in ["Raw signal", "Depth", "Force"] {
        flow.click(name);
    }
    assert!(flow.says("choose quantities on the left"));
    flow.click("Position");
    flow.click("Force");
    flow.click("contact");
    flow.click("ramp start");
    flow.window.check_accessibility();
    // The loop, found beside the window.
    flow.click("Over depth");
    flow.wait("the loop", |window| {
        let mut found = window.query_all_by_label_contains("every sample is within half a pixel");
        found.next().is_some()
    });
    flow.click("Zoom in");
    flow.click("Cycles");
    assert!(flow.says("peak force (N)"));
    assert!(flow.says("cycle 1"));
    flow.click("First and last cycle only");
    flow.window.check_accessibility();
}

#[test]
fn sessions_are_fitted_compared_and_predicted() {
    let mut flow = review();
    let path = show(&mut flow, "ramp-hold-lab");
    flow.click("Parameters");
    assert!(flow.says("none of the sessions shown is fitted yet"));
    flow.click("Prediction");
    assert!(!flow.is_enabled("Predict second session"));
    assert!(flow.says("show two sessions"));
    let other = show(&mut flow, "hold-until-lab");
    flow.window.key_press(Key::F6);
    flow.wait("the fits", |window| {
        let mut found = window.query_all_by_label_contains("from the profile likelihood");
        found.next().is_some()
    });
    flow.window.run_steps(2);
    // The same words as the command line has.
    let options = palpate_rheology::fit::FitOptions::default();
    let recipe = palpate_analysis::fit::FitRecipe::new(options, Default::default());
    let report = recipe.fit(&path).unwrap().result.unwrap();
    assert!(flow.says(&palpate_analysis::report::text::quality(&report)));
    for sentence in report.sentences() {
        assert!(flow.says(sentence), "{sentence}");
    }
    // The budget unfolds without a pointer.
    assert!(flow.says("total 95 %") && !flow.says("to reduce the part of"));
    flow.window.get_by_label(BUDGET_TITLE).focus();
    flow.window.key_press(Key::Enter);
    flow.window.run_steps(20);
    let budget = UncertaintyBudget::of(&report.parameters);
    assert!(!budget.remedies.is_empty() && budget.parameters.len() > 5);
    for one in &budget.parameters {
        let total = ParameterText::of(one.parameter).total;
        assert!(!total.is_empty() && flow.says(&total), "{total}");
        for row in one.main_rows() {
            let words = format!("{}, {}", row.source, row.uncertainty());
            assert!(flow.says(&words) && flow.says(&row.share()), "{words}");
        }
    }
    for words in &budget.remedies {
        assert!(flow.says(words), "{words}");
    }
    flow.window.check_accessibility();
    flow.click("Over time");
    flow.click("Residuals of the fit");
    flow.click("Parameters");
    let tau = palpate_analysis::report::text::cell(report.parameter("tau_eps").unwrap());
    assert!(flow.says("tau_eps (s)") && flow.says(&tau), "{tau}");
    flow.window.check_accessibility();
    flow.click("Prediction");
    flow.click("Predict second session");
    flow.wait("the prediction", |window| {
        window.query_all_by_label_contains("with an RMSE of").next().is_some()
    });
    flow.window.run_steps(3);
    flow.window.check_accessibility();
    // The other one comes to the front, and the first is removed.
    let name = |path: &PathBuf| session_name(&Session::open(path).unwrap().manifest);
    let (first, second) = (name(&path), name(&other));
    flow.click(&format!("front: {second}"));
    assert!(flow.says(&format!("front: {first}")));
    flow.click(&format!("remove: {first}"));
    assert!(!flow.says(&format!("remove: {first}")) && flow.says(&format!("remove: {second}")));
    // A folder that is none says so and leaves the rest as it is.
    flow.type_into("session", "/nowhere/at-all");
    flow.click("Add to view");
    flow.window.run_steps(2);
    assert!(flow.says("there is no such folder"));
    assert!(!flow.says("remove: at-all"));
}
