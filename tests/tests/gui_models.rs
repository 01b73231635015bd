//! The screens beside the run screen: which model, what accuracy costs, what happens at the extremes.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]

use eframe::egui::{Key, Modifiers};
use palpate_model::families::by_key;
use palpate_model::{Depth, Seconds};
use palpate_protocols::runner::TimeScale;
use palpate_tests::flow::{Flow, Window};
use std::fmt::Write;
use std::path::Path;

/// A ramp and hold of a Kelvin body with 1 % of repeatable roughness, as a table.
fn table(path: &Path, speed: f64) {
    let body = by_key("kelvin")
        .unwrap()
        .model(&[1.5], &[0.15, 0.6])
        .unwrap();
    let times = || (0..500).map(|i| 0.05 * f64::from(i));
    let forces = body
        .along(times().map(|t| (Seconds(t), Depth((speed * t).min(10.0)))))
        .unwrap();
    let mut text = String::from("t_s,F_N,x_mm\n");
    for (i, (t, force)) in times().zip(forces).enumerate() {
        // A linear congruence: like noise, and the same everywhere.
        let noise = 0.02 * (((i * 7919 + 104_729) % 1009) as f64 / 1009.0 - 0.5);
        let depth = (speed * t).min(10.0);
        writeln!(text, "{t},{},{depth}", force + noise).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

fn screen(flow: &mut Flow, key: Key) {
    flow.window.key_press_modifiers(Modifiers::COMMAND, key);
    flow.window.run_steps(3);
}

#[test]
fn models_are_compared_in_the_window() {
    let mut flow = Flow::open(TimeScale::Max);
    screen(&mut flow, Key::Num6);
    assert!(!flow.is_enabled("Compare models  F6"));
    assert!(flow.says("add a recording first"));
    for (name, speed) in [("slow.csv", 0.8), ("fast.csv", 4.0)] {
        let path = flow.folder.path().join(name);
        table(&path, speed);
        flow.type_into("path", &path.display().to_string());
        flow.click("Add");
    }
    flow.type_into("tolerance", "much");
    assert!(flow.says("'much' is not a tolerance"));
    assert!(!flow.is_enabled("Compare models  F6"));
    flow.type_into("tolerance", "1%");
    flow.window.check_accessibility();
    flow.click("Compare models  F6");
    let has_answer = |window: &Window| window.state().comparison().is_some();
    flow.wait("the comparison", has_answer);
    flow.window.run_steps(3);
    let answer = flow.window.state().comparison().unwrap();
    let selection = &answer.as_ref().unwrap().selection;
    assert_eq!(selection.verdict.family.as_deref(), Some("kelvin"));
    for sentence in &selection.verdict.sentences {
        assert!(flow.says(sentence), "{sentence}");
    }
    for words in [
        "series-3",
        "fast: 10.0000 mm deep",
        "tau_eps",
        "kelvin > prony-2",
    ] {
        assert!(flow.says(words), "{words}");
    }
    flow.window.check_accessibility();
    // A source that is gone is named, and the window stays usable.
    flow.type_into("path", "/nowhere/at-all");
    flow.click("Add");
    flow.click("Compare models  F6");
    flow.wait("the refusal", |window| {
        window.state().comparison().is_some_and(Result::is_err)
    });
    flow.window.run_steps(2);
    assert!(flow.says("/nowhere/at-all"));
    flow.click("leave out nowhere/at-all");
    assert!(!flow.says("leave out nowhere"));
}

#[test]
fn a_run_goes_on_behind_another_screen_and_can_be_stopped_there() {
    let mut flow = Flow::open(TimeScale::Factor(20.0));
    flow.click("Start  F5");
    flow.wait_for_phase(palpate_model::rig::Phase::Contact);
    screen(&mut flow, Key::Num8);
    assert!(flow.says("nothing tested yet"));
    flow.window.key_press(Key::F12);
    flow.wait("the axis at rest", |window| {
        let run = window.state().snapshot().run.as_ref();
        run.is_some_and(|run| run.holding.is_some())
    });
    assert!(flow.says("State: STOPPED"));
}

#[test]
fn the_trade_is_measured_in_the_window() {
    let mut flow = Flow::open(TimeScale::Max);
    screen(&mut flow, Key::Num7);
    flow.click("few rows, rough times");
    flow.click("Measure here  F6");
    flow.wait("the curves", |window| {
        window.state().trade_curves().is_some()
    });
    flow.window.run_steps(3);
    assert!(flow.says("What to use") && flow.says("of the peak force"));
    for view in ["Families", "Fit", "Integrators"] {
        flow.click(view);
        flow.window.check_accessibility();
    }
    flow.type_into("tolerance", "0.0000001%");
    assert!(flow.says("none: "));
    flow.type_into("rate", "0");
    assert!(flow.says("must be above 0"));
}

#[test]
fn the_extremes_are_tested_in_the_window() {
    let mut flow = Flow::open(TimeScale::Max);
    screen(&mut flow, Key::Num8);
    flow.click("Test the extremes  F6");
    flow.wait("progress", |window| {
        window.state().extremes_rows().is_none()
    });
    flow.wait("the rows", |window| {
        window.state().extremes_rows().is_some()
    });
    flow.window.run_steps(3);
    assert!(flow.says("every case is right or refused with its reason"));
    assert!(flow.window.state().extremes_rows().unwrap().len() > 100);
    flow.window.check_accessibility();
}
