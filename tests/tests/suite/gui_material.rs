//! The modulus of a press in the window, against the closed form that made the press.
use egui_kittest::kittest::Queryable;
use palpate_analysis::material::MaterialReport;
use palpate_analysis::property::PropertyReport;
use palpate_runner::TimeScale;
use palpate_tests::flow::{WindowFlow, screen_of};
use palpate_tests::workspace;
use palpate_window::screens::material::{MaterialScreen, SCREEN};
use palpate_window::screens::screen::Screen;
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

/// Of a punch of 3 mm the force is `4 R / (1 - nu) G d`.
const PUNCH_N_PER_MM_MPA: f64 = 4.0 * 3.0 / 0.55;
const EQUILIBRIUM_MPA: f64 = 0.004;
const RELAXING_MPA: f64 = 0.008;
const TIME_S: f64 = 2.0;

fn write_table(path: &Path, rows: impl Iterator<Item = [f64; 3]>) {
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for (index, [t, depth, force]) in rows.enumerate() {
        // A square has no period that a term could describe.
        let noise = 1e-6 * (12.9898 * (index * index) as f64).sin();
        writeln!(text, "{t},{depth},{}", force + noise).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

/// A press by 0.3 mm within 0.5 s and a hold of 40 s, by Lee and Radok in closed form.
fn hold_table(path: &Path) {
    let row = |index: i32| {
        let t = 0.01 * f64::from(index);
        let pressed = t.min(0.5);
        let left = TIME_S * ((-(t - pressed) / TIME_S).exp() - (-t / TIME_S).exp());
        let speed = 0.6;
        let force = speed * (EQUILIBRIUM_MPA * pressed + RELAXING_MPA * left);
        [t, speed * pressed, PUNCH_N_PER_MM_MPA * force]
    };
    write_table(path, (0..=4000).map(row));
}

/// Ten cycles at 0.5 Hz about 0.3 mm.
fn sine_table(path: &Path, [storage, loss]: [f64; 2]) {
    let row = |index: i32| {
        let t = 0.01 * f64::from(index);
        let (sin, cos) = (std::f64::consts::PI * t).sin_cos();
        let force = EQUILIBRIUM_MPA * 0.3 + 0.01 * (storage * sin + loss * cos);
        [t, 0.3 + 0.01 * sin, PUNCH_N_PER_MM_MPA * force]
    };
    write_table(path, (0..=2000).map(row));
}

/// A cone of 75 degrees pressed into a half-space and drawn back.
fn cone_table(path: &Path) {
    let row = |index: i32| {
        let depth = 0.001 * f64::from(200 - (index - 200).abs());
        let plane = MODULUS_MPA / (1.0 - 0.45 * 0.45);
        let force = std::f64::consts::FRAC_2_PI * plane * 75f64.to_radians().tan() * depth * depth;
        [0.01 * f64::from(index), depth, force]
    };
    write_table(path, (0..=400).map(row));
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
        !screen_of::<MaterialScreen>(window).is_busy()
    });
    flow.window.run_steps(3);
}

fn shown(flow: &WindowFlow) -> PropertyReport {
    screen_of::<MaterialScreen>(&flow.window).fitted().unwrap().report.clone()
}

fn shown_modulus(flow: &WindowFlow) -> MaterialReport {
    match shown(flow) {
        PropertyReport::Modulus(report) => report,
        other => panic!("{other:?}"),
    }
}

/// That every number, assumption, warning and remark of what is shown stands on the page.
fn assert_all_is_said(flow: &WindowFlow) {
    let sections = screen_of::<MaterialScreen>(&flow.window).fitted().unwrap().sections.clone();
    let mut words: Vec<String> = sections.remarks.iter().map(|one| (*one).to_owned()).collect();
    words.extend(sections.warnings.into_iter().chain(sections.assumptions).map(|(_, words)| words));
    for line in sections.numbers {
        match line.numbers.as_slice() {
            [one] => words.extend([one.words(), one.interval_words()]),
            several => words.extend(several.iter().map(|one| one.cell()).chain([line.name])),
        }
    }
    words.extend(sections.budget.iter().map(|row| format!("{}: {}", row[0], row[1..].join(", "))));
    for words in words {
        assert!(flow.says(&words), "{words}");
    }
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
    let report = shown_modulus(&flow);
    assert!(report.press.depth_mm > 0.25, "{report:?}");
    assert!((report.press.modulus_mpa / MODULUS_MPA - 1.0).abs() < 0.005, "{report:?}");
    assert_all_is_said(&flow);
    for words in ["radius: ", "not included: calibration", "% of the limit 0.05"] {
        assert!(flow.says(words), "{words}");
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
    let report = shown_modulus(&flow);
    assert_eq!(report.press.source, session);
    // A body that relaxes bends the loading otherwise than an elastic one.
    assert!(report.lack_of_fit.is_some() && flow.says("lack of fit: residuals are"));
    // The curve is that of which the residuals are stated.
    let squares: f64 = report.press.curve.iter().map(|one| (one.force_n - one.law_n).powi(2)).sum();
    let rms = (squares / report.press.samples as f64).sqrt();
    assert!(
        (rms / report.press.residual_n - 1.0).abs() < 1e-9,
        "{rms} {}",
        report.press.residual_n
    );
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

#[test]
fn every_property_has_its_entries_its_numbers_and_what_they_assume() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.show(&SCREEN);
    let table = flow.folder.path().join("hold.csv");
    hold_table(&table);
    for (name, text) in [
        ("session", table.display().to_string().as_str()),
        ("radius", "3"),
        ("thickness", "800"),
        ("Poisson", "0.45"),
    ] {
        flow.type_into(name, text);
    }
    choose(&mut flow, "contact", "from the loading alone");
    choose(&mut flow, "property", "relaxation modulus");
    choose(&mut flow, "law", "half-space, any shape");
    assert!(flow.says("only the modulus of a loading finds the contact"));
    assert!(!flow.is_enabled("Fit modulus  F6"));
    for name in ["a part of the loading only", "force zero", "frequency", "moving mass"] {
        assert!(flow.window.query_by_label(name).is_none(), "{name}");
    }
    choose(&mut flow, "contact", "with a stated uncertainty");
    flow.type_into("uncertainty", "0.002");
    choose(&mut flow, "terms", "1");
    flow.window.check_accessibility();
    fit(&mut flow);
    let PropertyReport::Relaxation(report) = shown(&flow) else { panic!() };
    let term = report.terms[0];
    for (found, exact) in [
        (report.equilibrium_mpa.value, EQUILIBRIUM_MPA),
        (term.modulus_mpa.value, RELAXING_MPA),
        (term.time_s.value, TIME_S),
    ] {
        assert!((found / exact - 1.0).abs() < 1e-3, "{report:?}");
    }
    assert!(report.term_choice.is_none());
    assert_all_is_said(&flow);
    flow.window.check_accessibility();

    sine_table(&table, [0.009, 0.003]);
    choose(&mut flow, "property", "dynamic moduli");
    assert!(flow.window.query_by_label("terms").is_none());
    fit(&mut flow);
    assert!(flow.says("the table does not state the frequency of its sine"));
    flow.click("the whole record is one sine");
    flow.type_into("frequency", "0.5");
    flow.click("a mass moves below the load cell");
    assert!(!flow.is_enabled("Fit modulus  F6"));
    flow.type_into("moving mass", "0");
    flow.type_into("uncertainty of moving mass", "1");
    fit(&mut flow);
    let PropertyReport::Dynamic(report) = shown(&flow) else { panic!() };
    let sine = &report.sines[0];
    assert!((sine.shear_storage_mpa.value / 0.009 - 1.0).abs() < 1e-3, "{report:?}");
    assert!((sine.shear_loss_mpa.value / 0.003 - 1.0).abs() < 1e-3, "{report:?}");
    assert!(sine.budget.iter().any(|row| row.source == "moving mass"));
    assert_all_is_said(&flow);
    flow.window.check_accessibility();

    cone_table(&table);
    choose(&mut flow, "property", "modulus of the unloading");
    choose(&mut flow, "shape", "cone");
    flow.type_into("half angle", "75");
    fit(&mut flow);
    // Neither a list nor an assumption.
    assert!(flow.window.query_by_label("law").is_none());
    let PropertyReport::Unloading(report) = shown(&flow) else { panic!() };
    assert!((report.press.modulus_mpa / MODULUS_MPA - 1.0).abs() < 1e-3, "{report:?}");
    assert_all_is_said(&flow);
    flow.window.check_accessibility();
}
