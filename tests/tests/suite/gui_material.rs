//! The modulus of a press in the window, against the closed form that made the press.
use egui_kittest::kittest::Queryable;
use palpate_analysis::report::material::{assumptions, interval_words, modulus_words};
use palpate_runner::TimeScale;
use palpate_tests::flow::{WindowFlow, screen_of};
use palpate_tests::workspace;
use palpate_window::screens::material::{MaterialScreen, SCREEN};
use std::fmt::Write;
use std::path::Path;

const MODULUS_MPA: f64 = 0.0125;
const CONTACT_MM: f64 = 0.02;

/// Hertz's law, `F = 4/3 E / (1 - nu^2) sqrt(R) d^1.5`, of a sphere of 8 mm to 0.3 mm, with an approach and noise that is the same everywhere.
fn hertz_table(path: &Path) {
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for index in 0..=200 {
        let t = 0.005 * f64::from(index);
        let depth = 0.3 * t;
        let plane = MODULUS_MPA / (1.0 - 0.45 * 0.45);
        let force = 4.0 / 3.0 * plane * 8.0f64.sqrt() * (depth - CONTACT_MM).max(0.0).powf(1.5);
        let noise = 1e-5 * (f64::from(index) * 12.9898).sin();
        writeln!(text, "{t},{depth},{}", force + noise).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

/// Chooses in a list, which stays open for a choice by name.
fn choose(flow: &mut WindowFlow, list: &str, choice: &str) {
    if flow.window.query_by_label(choice).is_none() {
        flow.click(list);
    }
    flow.click(choice);
}

fn fit(flow: &mut WindowFlow) {
    flow.click("Fit modulus  F6");
    flow.wait("the modulus or its refusal", |window| {
        let screen = screen_of::<MaterialScreen>(window);
        screen.fitted().is_some() || screen.refused().is_some()
    });
    flow.window.run_steps(3);
}

#[test]
fn the_modulus_of_a_press_stands_beside_what_it_assumes() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.show(&SCREEN);
    assert!(flow.says("choose a session first") && flow.says("no modulus yet"));
    assert!(!flow.is_enabled("Fit modulus  F6"));
    let table = flow.folder.path().join("press.csv");
    hertz_table(&table);
    flow.type_into("session", &table.display().to_string());
    choose(&mut flow, "shape", "sphere");
    flow.type_into("radius", "-1");
    assert!(flow.says("the radius of the indenter is -1"));
    flow.type_into("radius", "1");
    flow.type_into("uncertainty of radius", "0.04");
    flow.type_into("thickness", "500");
    flow.type_into("Poisson", "0.45");
    flow.window.check_accessibility();
    choose(&mut flow, "shape", "cone");
    choose(&mut flow, "law", "half-space, shallow sphere");
    assert!(flow.says("this law describes a sphere only"));
    assert!(!flow.is_enabled("Fit modulus  F6"));
    choose(&mut flow, "shape", "sphere");
    // On a sphere of 1 mm the press is too deep for Hertz's law, and the screen says how deep it may be.
    fit(&mut flow);
    assert!(flow.says("the depth over the tip radius is 0."));
    let down_to = "Fit the loading down to 0.0";
    flow.window.get_by_label_contains(down_to).click_accesskit();
    flow.wait("the modulus", |window| screen_of::<MaterialScreen>(window).fitted().is_some());
    flow.window.run_steps(3);
    assert!(flow.says("a part of the loading only") && !flow.says(down_to));
    // The sphere that it was.
    flow.click("a part of the loading only");
    flow.type_into("radius", "8");
    fit(&mut flow);
    flow.wait("the modulus of the whole loading", |window| {
        let fitted = screen_of::<MaterialScreen>(window).fitted();
        fitted.is_some_and(|fitted| fitted.report.depth_mm > 0.25)
    });
    flow.window.run_steps(3);
    let report = screen_of::<MaterialScreen>(&flow.window).fitted().unwrap().report.clone();
    assert!((report.modulus_mpa / MODULUS_MPA - 1.0).abs() < 0.005, "{report:?}");
    let mut words = vec![modulus_words(&report), interval_words(&report)];
    words.extend(assumptions(&report).into_iter().map(|(_, words)| words));
    let others =
        ["radius: ", "not included: calibration", "% of the limit 0.05", "state the loading"];
    words.extend(others.map(str::to_owned));
    for words in words {
        assert!(flow.says(&words), "{words}");
    }
    flow.window.check_accessibility();
}

#[test]
fn the_session_in_review_is_fitted_and_its_modulus_saved_with_it() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let session = flow.folder.path().join("press");
    std::fs::create_dir(&session).unwrap();
    let recorded = workspace().join("tests/sessions/ramp-hold-lab");
    std::fs::copy(recorded.join("000.mcap"), session.join("000.mcap")).unwrap();
    flow.show(&palpate_window::screens::review::SCREEN);
    flow.type_into("session", &session.display().to_string());
    flow.click("Add to view");
    flow.show(&SCREEN);
    flow.type_into("radius", "6");
    flow.type_into("thickness", "60");
    flow.type_into("Poisson", "0.49");
    flow.click("a part of the loading only");
    flow.type_into("depth", "0.9");
    fit(&mut flow);
    let report = screen_of::<MaterialScreen>(&flow.window).fitted().unwrap().report.clone();
    assert_eq!(report.source, session);
    // A body that relaxes bends the loading otherwise than an elastic one.
    assert!(report.lack_of_fit.is_some() && flow.says("lack of fit: residuals are"));
    // The curve is that of which the residuals are stated.
    let squares: f64 = report.curve.iter().map(|one| (one.force_n - one.law_n).powi(2)).sum();
    let rms = (squares / report.samples as f64).sqrt();
    assert!((rms / report.residual_n - 1.0).abs() < 1e-9, "{rms} {}", report.residual_n);
    assert!(!flow.is_enabled("Save modulus") && flow.says("type a name for the analysis"));
    flow.type_into("name", "stiffness");
    flow.type_into("by", "Ada");
    flow.click("Save modulus");
    flow.wait_for_words("saved as analysis 'stiffness'");
    // Once more it is refused, because nothing is overwritten.
    flow.click("Save modulus");
    flow.wait_for_words("already has an analysis 'stiffness'");
    flow.window.check_accessibility();
}
