//! A picture of every screen in light and dark, drawn without a graphics card and compared with the one that is kept.
//!
//! Where no software renderer (Mesa's lavapipe) is installed they are left out, and say so. After a change that is meant,
//! `UPDATE_SNAPSHOTS=true cargo test -p palpate-tests gui_pictures` keeps the new ones; look at them before.
use eframe::egui::{Key, Modifiers, Theme};
use egui_kittest::kittest::Queryable;
use egui_kittest::{
    Harness, SnapshotOptions, SnapshotResult, SnapshotResults, try_image_snapshot_options,
};
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_figures::tokens::Tokens;
use palpate_model::Nanos;
use palpate_model::rig::{RigCommand, RigDescription};
use palpate_model::units::Volts;
use palpate_runner::TimeScale;
use palpate_sessions::specimen_queue::{QueueChange, QueueVerdict, QueuedSpecimen, SpecimenQueue};
use palpate_test_support::skip::{HAS_RENDERER, lacks_command};
use palpate_tests::flow::screen_of;
use palpate_tests::recorded_study::record_study;
use palpate_tests::workspace;
use palpate_window::app::WorkbenchApp;
use palpate_window::screens::groups::GroupsScreen;
use palpate_window::screens::haptics::HapticsScreen;
use palpate_window::screens::material::MaterialScreen;
use palpate_window::screens::scene::SceneScreen;
use palpate_window::screens::screen::Screen;
use palpate_window::screens::table::screens;
use palpate_window::window::WindowOptions;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

type Window = Harness<'static, WorkbenchApp>;

/// The switch of the scene's best picture.
const FULL_DETAIL: &str = "full detail at any frame time";

/// Most frames of a wait: five minutes.
const FRAMES_MAX: usize = 60_000;

/// Recorded sessions that stand in the library.
const SESSIONS: [&str; 3] = ["ramp-hold-lab", "every-motion", "over-force-galil"];

/// A folder with the same name on every computer, for it stands in pictures; with the recorded sessions in it.
fn library() -> PathBuf {
    let folder = Path::new("/tmp/palpate-pictures").to_owned();
    let _ = std::fs::remove_dir_all(&folder);
    for name in SESSIONS {
        let to = folder.join(name);
        std::fs::create_dir_all(&to).unwrap();
        for item in std::fs::read_dir(workspace().join("tests/sessions").join(name)).unwrap() {
            let item = item.unwrap();
            std::fs::copy(item.path(), to.join(item.file_name())).unwrap();
        }
    }
    std::fs::create_dir_all(folder.join("trade")).unwrap();
    fill_queue(&folder);
    folder
}

/// A day in its middle: one accepted, one rejected, three that wait.
fn fill_queue(library: &Path) {
    let specimen = |name: &str| QueuedSpecimen {
        specimen: name.into(),
        protocol: "ramp-hold".into(),
        labels: Default::default(),
    };
    let names = ["stomach 3", "stomach 1", "stomach 5", "stomach 2", "stomach 4"];
    let begun = |number| QueueChange::Begun { number, session: SESSIONS[0].into() };
    let judged = |number, verdict| QueueChange::Judged { number, verdict };
    for (change, reason) in [
        (QueueChange::Added { specimens: names.map(specimen).to_vec() }, ""),
        (begun(1), ""),
        (judged(1, QueueVerdict::Accept), ""),
        (begun(2), ""),
        (judged(2, QueueVerdict::Reject), "torn at the clamp"),
    ] {
        SpecimenQueue::change(library, UNIX_EPOCH, "Ada", reason, change).unwrap();
    }
}

/// A simulated rig whose signal stands still, so that pictures with it are equal.
struct Still(SimRig);

impl Rig for Still {
    fn description(&self) -> &RigDescription {
        self.0.description()
    }

    fn send(&mut self, command: RigCommand) {
        self.0.send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        let mut event = self.0.next_event(until)?;
        if let RigEventBody::Reading(reading) = &mut event.body {
            reading.volts = Volts(1.28);
            reading.counts = Some(4194);
        }
        Some(event)
    }

    fn is_virtual(&self) -> bool {
        true
    }
}

fn open(library: &Path) -> Window {
    let settings = SimSettings::default();
    let mut options = WindowOptions::open("sim", &settings, TimeScale::Max).unwrap();
    options.request.rig = Box::new(Still(SimRig::new(settings)));
    options.sessions = Some(library.to_owned());
    options.list_ports = || Ok(Vec::new());
    Harness::builder()
        .with_size((1360.0, 820.0))
        .with_theme(Theme::Light)
        .wgpu()
        .build_eframe(|cc| WorkbenchApp::new(options, &cc.egui_ctx).unwrap())
}

/// Lets threads answer until nothing on the screen waits.
fn settle(window: &mut Window) {
    for _ in 0..FRAMES_MAX {
        window.step();
        let waits = [
            "still reading",
            "waiting to be read",
            "listing them",
            "reading the library",
            "searching",
        ];
        let is_waiting =
            waits.iter().any(|words| window.query_all_by_label_contains(words).next().is_some());
        if !is_waiting && window.state().snapshot().rig.reading.is_some() {
            // What came last is drawn, and what it made wide has its width.
            window.run_steps(5);
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("the screen never settled");
}

/// Shows a screen that has no key.
fn show_by_name(window: &mut Window, name: &str) {
    window.key_press(Key::F1);
    window.run_steps(3);
    window.get_by_label("command").set_text_value_accesskit(name);
    window.run_steps(2);
    window.key_press(Key::Enter);
}

/// Shows a session on the review screen, unless it is there.
fn show(window: &mut Window, session: &Path) {
    let mut empty = window.query_all_by_label_contains("no session is shown");
    if empty.next().is_none() {
        return;
    }
    drop(empty);
    let path = session.display().to_string();
    window.get_by_label("session").focus();
    window.step();
    window.get_by_label("session").set_text_value_accesskit(&path);
    window.run_steps(2);
    window.get_by_label("Add to view").click_accesskit();
    window.run_steps(3);
}

/// Checks the device of the guide's example on the haptics screen, unless that is done.
fn check_buzz(window: &mut Window) {
    if screen_of::<HapticsScreen>(window).check_result().is_some() {
        return;
    }
    window.get_by_label("current").click_accesskit();
    window.run_steps(2);
    for (name, text) in [("damping", "0.5"), ("friction", "0"), ("delay", "2")] {
        window.get_by_label(name).focus();
        window.step();
        window.get_by_label(name).set_text_value_accesskit(text);
        window.run_steps(2);
    }
    window.get_by_label("Check  F6").click_accesskit();
    for _ in 0..FRAMES_MAX {
        window.step();
        if screen_of::<HapticsScreen>(window).check_result().is_some() {
            // A caret in a field would come and go.
            window.get_by_label("Check  F6").focus();
            window.run_steps(2);
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("the check never ended");
}

/// Fits the modulus of the session in review on the material screen, unless that is done.
fn fit_modulus(window: &mut Window) {
    if screen_of::<MaterialScreen>(window).fitted().is_some() {
        return;
    }
    window.get_by_label("a part of the loading only").click_accesskit();
    window.run_steps(2);
    type_fields(
        window,
        &[
            ("radius", "6.00"),
            ("uncertainty of radius", "0.02"),
            ("thickness", "60.0"),
            ("uncertainty of thickness", "0.5"),
            ("Poisson", "0.49"),
            ("uncertainty of Poisson", "0.01"),
            ("depth", "0.9"),
        ],
    );
    fit_and_wait(window);
}

/// Finds the population of a recorded study on the groups screen, unless that is done.
fn find_population(window: &mut Window, study: &Path) {
    if screen_of::<GroupsScreen>(window).found().is_some() {
        return;
    }
    record_study(study);
    let folder = study.display().to_string();
    type_fields(window, &[("sessions", &folder), ("effects", "animal.treatment")]);
    window.get_by_label("Find population  F6").click_accesskit();
    window.run_steps(2);
    for _ in 0..FRAMES_MAX {
        window.step();
        if screen_of::<GroupsScreen>(window).found().is_some() {
            // A caret in a field would come and go.
            window.get_by_label("Find population  F6").focus();
            window.run_steps(2);
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("the population was never found");
}

/// Fits the relaxation modulus of a table on the material screen, which knows indenter and specimen.
fn fit_relaxation(window: &mut Window, library: &Path) {
    let table = library.join("hold.csv");
    write_hold(&table);
    window.key_press_modifiers(Modifiers::COMMAND, Key::M);
    window.run_steps(3);
    // A list stays open for a choice by name.
    for name in ["property", "relaxation modulus", "property"] {
        window.get_by_label(name).click_accesskit();
        window.run_steps(3);
    }
    type_fields(window, &[("session", &table.display().to_string())]);
    fit_and_wait(window);
}

/// A press by 0.5 mm within 0.5 s and a hold of 100 s on two Maxwell elements beside a spring, by Lee and Radok in closed form.
fn write_hold(table: &Path) {
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for index in 0..4000 {
        let t = 0.025 * f64::from(index);
        let pressed = t.min(0.5);
        let left = |tau: f64| tau * ((-(t - pressed) / tau).exp() - (-t / tau).exp());
        let force = 0.2 * pressed + 0.3 * left(1.0) + 0.15 * left(15.0);
        let noise = 5e-4 * (12.9898 * f64::from(index * index)).sin();
        writeln!(text, "{t},{pressed},{}", force + noise).unwrap();
    }
    std::fs::write(table, text).unwrap();
}

fn type_fields(window: &mut Window, fields: &[(&str, &str)]) {
    for (name, text) in fields {
        window.get_by_label(name).focus();
        window.step();
        window.get_by_label(name).set_text_value_accesskit(text);
        window.run_steps(2);
    }
}

fn fit_and_wait(window: &mut Window) {
    window.get_by_label("Fit modulus  F6").click_accesskit();
    window.run_steps(2);
    for _ in 0..FRAMES_MAX {
        window.step();
        let screen = screen_of::<MaterialScreen>(window);
        if !screen.is_busy() && screen.fitted().is_some() {
            window.get_by_label("Fit modulus  F6").focus();
            window.run_steps(2);
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("the modulus was never fitted");
}

/// Waits for the poke that the scene screen computes when it is shown first: at its deepest, whatever the computer's pace.
fn compute_poke(window: &mut Window) {
    for _ in 0..FRAMES_MAX {
        window.step();
        if screen_of::<SceneScreen>(window).computed_path().is_some() {
            // What a software renderer leaves out otherwise.
            if window.query_by_label_contains("full resolution").is_none() {
                window.get_by_label(FULL_DETAIL).click_accesskit();
            }
            window.run_steps(2);
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("the poke was never computed");
}

/// Compares what is drawn, on the colour in which the window is cleared.
fn picture(
    window: &mut Window,
    name: String,
    theme: &str,
    options: &SnapshotOptions,
) -> SnapshotResult {
    let mut image = window.render().unwrap();
    let canvas = Tokens::of(theme == "dark").canvas;
    for pixel in image.pixels_mut() {
        let through = 255 - pixel[3];
        for (value, behind) in pixel.0.iter_mut().zip(canvas.to_array()) {
            *value += (u16::from(behind) * u16::from(through) / 255) as u8;
        }
    }
    try_image_snapshot_options(&image, name, options)
}

#[test]
fn every_screen_looks_as_it_did() {
    if lacks_command(HAS_RENDERER) {
        return;
    }
    let library = library();
    let study = library.with_file_name("palpate-pictures-study");
    let _ = std::fs::remove_dir_all(&study);
    let mut window = open(&library);
    let mut results = SnapshotResults::new();
    // Other versions of the renderer place some pixels otherwise: fewer than a letter has.
    let options = SnapshotOptions::new()
        .output_path(workspace().join("docs/pictures/screens"))
        .max_failed_pixels(40);
    settle(&mut window);
    for theme in ["light", "dark"] {
        for screen in screens() {
            match screen.key {
                Some(key) => window.key_press_modifiers(Modifiers::COMMAND, key),
                None => show_by_name(&mut window, screen.name),
            }
            window.run_steps(3);
            if screen.name == "Review" {
                show(&mut window, &library.join("ramp-hold-lab"));
            }
            if screen.name == "Haptics" {
                check_buzz(&mut window);
            }
            if screen.name == "Material" {
                fit_modulus(&mut window);
            }
            if screen.name == "Groups" {
                // Beside the library, in which it would be found.
                find_population(&mut window, &study);
            }
            if screen.name == "Scene" {
                compute_poke(&mut window);
            }
            settle(&mut window);
            if screen.name == "Today" {
                // A caret in a field would come and go.
                window.get_by_label("Add a table...").focus();
                window.run_steps(2);
            }
            let found = format!("{} sessions, found in", SESSIONS.len());
            for _ in 0..FRAMES_MAX {
                // All of them: before they are read there are none.
                let mut found = window.query_all_by_label_contains(&found);
                if screen.name != "Library" || found.next().is_some() {
                    break;
                }
                drop(found);
                window.step();
                std::thread::sleep(Duration::from_millis(5));
            }
            // Who sits at this computer is not in the picture; how long a search took is, in a few digits.
            // On Material the name stands below what is seen.
            if let Some(by) = window.query_by_label("by").filter(|_| screen.name != "Material") {
                by.focus();
                window.step();
                window.get_by_label("by").set_text_value_accesskit("Ada");
                window.run_steps(2);
            }
            let options = match screen.name {
                // Free space is another on every disk.
                "Library" | "Today" => options.clone().max_failed_pixels(300),
                _ => options.clone(),
            };
            let name = format!("{}-{theme}", screen.name.to_lowercase().replace(' ', "-"));
            results.add(picture(&mut window, name, theme, &options));
        }
        // The list stands in front of a screen with plots.
        window.key_press_modifiers(Modifiers::COMMAND, Key::E);
        window.run_steps(3);
        window.key_press(Key::F1);
        settle(&mut window);
        results.add(picture(&mut window, format!("palette-{theme}"), theme, &options));
        window.key_press(Key::F1);
        window.run_steps(2);
        let name = if theme == "light" { "Dark screen" } else { "Light screen" };
        window.get_by_label(name).click_accesskit();
        window.run_steps(3);
    }
    fit_relaxation(&mut window, &library);
    settle(&mut window);
    results.add(picture(&mut window, "material-relaxation-light".into(), "light", &options));
}
