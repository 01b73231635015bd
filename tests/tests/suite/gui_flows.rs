//! Flows through the window by accessible name: no display, no graphics card, no pixels.

use eframe::egui::accesskit::Live;
use eframe::egui::epaint::Primitive;
use eframe::egui::{Key, ViewportCommand, ViewportEvent, ViewportId};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_analysis::report::budget::BUDGET_TITLE;
use palpate_analysis::report::text;
use palpate_model::rig::Phase;
use palpate_protocols::engine::EndingKind;
use palpate_rheology::fit::{FitReport, FittedParameter};
use palpate_runner::TimeScale;
use palpate_sessions::edits::{DataQuality, Edits};
use palpate_sessions::log::Session;
use palpate_tests::flow::{TestWindow, WindowFlow, refit};
use palpate_tests::workspace;
use palpate_window::screens::exact_fit::exact_ui;
use palpate_window::screens::run;
use palpate_window::shell::activity::{is_motion_possible, run_in_progress};
use palpate_window::workers::fit::Refit;

#[test]
fn an_idle_window_settles_and_every_control_has_a_name() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.wait("the serial ports", |window| window.query_by_label("listing them").is_none());
    flow.window.run();
    flow.window.check_accessibility();
    for name in ["Stop motion  F12", "Start  F5"] {
        assert!(flow.is_enabled(name), "{name}");
    }
    assert!(flow.says("State: IDLE"));
    assert!(flow.says("expected"));
    assert!(flow.sessions().is_empty());
}

#[test]
fn a_run_started_by_its_button_ends_with_a_session_on_disk() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.type_into("operator", "A. Tester");
    flow.type_into("specimen", "S-014");
    flow.type_into("hold", "5");
    flow.click("Start  F5");
    let run = flow.wait_for_end();
    let outcome = run.outcome.unwrap();
    assert_eq!(outcome.ending, EndingKind::Finish, "{}", outcome.reason);
    assert_eq!(run.log_error, None);
    assert!(flow.says("Session in"));
    assert!(flow.says("State: IDLE"));
    flow.show(&run::SCREEN);
    assert!(flow.says("Step hold: done"));
    assert_eq!(flow.sessions(), [flow.folder.path().join("session-0001")]);
    let session = Session::open(&flow.sessions()[0]).unwrap();
    assert_eq!(session.manifest.specimen, "S-014");
    assert_eq!(session.manifest.operator, "A. Tester");
    assert_eq!(session.rows.len() as u64, run.samples);
    flow.window.step();
    assert!(flow.is_enabled("Start  F5"), "a second run must be possible");
}

#[test]
fn after_a_run_the_window_shows_the_fit_of_the_command_line() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.type_into("hold", "10");
    flow.click("Start  F5");
    flow.wait_for_end();
    let report = flow.same_words_as_the_command_line().unwrap();
    assert!(flow.says("Exact fit") && !flow.says("Live parameters"));
    let Refit::Done(exact) = refit(&flow.window) else {
        panic!("the fit is gone");
    };
    // The curve stands where the force stands: as late as the ramp, as high as the peak.
    let run = flow.run().unwrap();
    let ramp = run.phases.iter().find(|(_, phase)| *phase == Phase::Ramp);
    let curve = &exact.fitted.plot.series[0].points;
    let (first, peak) = (curve[0], run.force_peak.unwrap().0);
    // A sample and a tick of the runner lie between them.
    assert!((first[0] - ramp.unwrap().0).abs() < 0.05, "{first:?}");
    let highest = curve.iter().map(|point| point[1]).fold(0.0, f64::max);
    // Noise makes the highest of ten thousand forces higher than the model: five times the rmse.
    assert!((highest - peak).abs() < 6.0 * report.rmse_n, "{highest} {peak}");
    let residual = &exact.residual.plot.series[0].points;
    assert!(residual.len() > 1000 && residual.len() <= 4000);
    // A second run begins with live numbers again.
    flow.window.key_press(Key::F5);
    flow.window.run_steps(2);
    flow.wait("live numbers", |window| window.query_by_label("Live parameters").is_some());
    assert!(!flow.says("Exact fit"));
}

#[test]
fn a_run_is_judged_by_its_checks_and_by_its_operator() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.type_into("operator", "A. Tester");
    flow.type_into("hold", "10");
    flow.click("Start  F5");
    flow.wait_for_end();
    flow.wait("the checks", |window| window.query_by_label("Quality").is_some());
    assert!(flow.says("8 checks good, 1 not judged"));
    assert!(flow.says("noise not judged"));
    let session = flow.sessions()[0].clone();
    let verdict = || {
        let id = Session::open(&session).unwrap().manifest.session_id;
        let edits = Edits::read(&session, &id).unwrap();
        edits.verdict().map(|(verdict, edit)| (verdict, edit.by.clone(), edit.reason.clone()))
    };
    assert!(!flow.is_enabled("Reject") && !flow.is_enabled("Repeat"), "without a reason");
    flow.click("Accept");
    flow.wait_for_words("Accepted.");
    assert_eq!(verdict().unwrap().1, "A. Tester");
    flow.type_into("reason", "hair under the probe");
    flow.click("Repeat");
    flow.wait("the verdict", |_| verdict().is_some_and(|one| one.0 == DataQuality::Rejected));
    flow.window.run_steps(5);
    // Nothing moves before the operator starts.
    assert!(!session.with_file_name("session-0002").exists() && flow.is_enabled("Start  F5"));
    let (rejected, by, reason) = verdict().unwrap();
    assert_eq!((rejected, by.as_str()), (DataQuality::Rejected, "A. Tester"));
    assert_eq!(reason, "hair under the probe");
}

#[test]
fn every_sentence_of_a_report_is_on_the_screen() {
    let parameter = |name: &str, std_error: Option<f64>| FittedParameter {
        name: name.into(),
        value: 1.5,
        unit: "N*s/mm^2".into(),
        std_error,
        ci95: std_error.map(|error| [1.5 - 2.0 * error, 1.5 + 2.0 * error]),
        is_fixed: false,
        systematic_error: None,
        total95: None,
        budget: Vec::new(),
    };
    let report = FitReport {
        model: "a model".into(),
        parameters: vec![parameter("mu1", Some(0.1)), parameter("mu2", None)],
        r2: 0.99,
        rmse_n: 0.01,
        samples: 10,
        warnings: vec!["the errors are too small".into()],
        findings: vec!["unstable from 5 to 8 mm".into()],
        ..FitReport::default()
    };
    let shown = report.clone();
    let mut window = Harness::new_ui(move |ui| exact_ui(ui, &shown));
    window.run();
    for words in [
        "the errors are too small",
        "unstable from 5 to 8 mm",
        "1.50 ± 0.10",
        "[1.30, 1.70]",
        "1.500 not identified",
        "N·s/mm²",
        &text::quality(&report),
    ] {
        let mut found = window.query_all_by_label_contains(words);
        assert!(found.next().is_some(), "{words}");
    }
    // What is not known takes no space.
    for words in ["total 95 %", BUDGET_TITLE] {
        assert!(window.query_by_label(words).is_none(), "{words}");
    }
}

#[test]
fn a_wrong_speed_gives_a_sentence_and_no_start() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    for (text, sentence) in [
        ("fast", "\"fast\" is not a speed"),
        ("1,234", "could be 1.234 or 1234"),
        ("3 mm", "\"3 mm\" is a length"),
        ("0.7501", "cannot move at 0.7501 mm/s"),
        ("900", "outside the range of rig sim"),
        ("", "type a number here"),
    ] {
        flow.type_into("speed", text);
        assert!(flow.says(sentence), "'{text}' must say '{sentence}'");
        assert!(flow.says("correct the speed first"));
        assert!(!flow.is_enabled("Start  F5"));
        flow.window.key_press(Key::F5);
        flow.window.run_steps(5);
        assert!(flow.run().is_none(), "F5 must not start what the button refuses");
    }
    flow.type_into("speed", "1.5");
    assert!(flow.is_enabled("Start  F5"));
}

#[test]
fn f12_and_escape_stop_with_a_text_field_focused() {
    for key in [Key::F12, Key::Escape] {
        let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
        flow.window.key_press(Key::F5);
        flow.wait_for_phase(Phase::Contact);
        assert!(flow.says("State: CONTACT"));
        flow.click("All events");
        flow.window.get_by_label("filter").focus();
        flow.window.step();
        assert!(flow.window.get_by_label("filter").is_focused());
        flow.window.key_press(key);
        flow.wait("the axis at rest", |window| {
            let snapshot = window.state().snapshot();
            run_in_progress(snapshot).is_some_and(|run| run.holding.is_some())
        });
        assert!(!is_motion_possible(flow.window.state().snapshot()));
        assert!(flow.says("State: STOPPED"));
        // No contact was found yet, but a search may have stopped within the tissue.
        assert!(flow.is_enabled("Retract  F8"));
        assert!(flow.says("retract the probe or close the session first"));
        flow.click("Close session");
        let run = flow.wait_for_end();
        assert_eq!(run.outcome.unwrap().ending, EndingKind::Stop);
        assert_eq!(run.log_error, None);
    }
}

#[test]
fn the_probe_is_retracted_after_a_stop_in_the_tissue() {
    let mut flow = WindowFlow::open(TimeScale::Factor(40.0));
    flow.click("Start  F5");
    flow.wait_for_phase(Phase::Ramp);
    flow.click("Stop motion  F12");
    flow.wait("the offer to retract", |window| window.query_by_label("Retract  F8").is_some());
    assert!(flow.is_enabled("Retract  F8"));
    let stopped_at = flow.run().unwrap().derived.position;
    flow.window.key_press(Key::F8);
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Stop);
    let contact = run.contact.unwrap().position;
    let left_at = run.derived.position;
    assert!(left_at < stopped_at);
    assert!(left_at < contact, "the probe must be out of the tissue");
    flow.same_words_as_the_command_line();
}

#[test]
fn closing_while_moving_stops_first() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    flow.click("Start  F5");
    flow.wait_for_phase(Phase::Contact);
    assert!(is_motion_possible(flow.window.state().snapshot()));
    let root = flow.window.input_mut().viewports.get_mut(&ViewportId::ROOT);
    root.unwrap().events.push(ViewportEvent::Close);
    flow.window.step();
    assert!(commands(&flow.window).contains(&ViewportCommand::CancelClose));
    assert!(!commands(&flow.window).contains(&ViewportCommand::Close));
    flow.wait("the window closing", |window| commands(window).contains(&ViewportCommand::Close));
    assert!(!is_motion_possible(flow.window.state().snapshot()));
    let session = flow.sessions().remove(0);
    let WindowFlow { window, folder: _folder } = flow;
    // eframe drops the app when the window closes; the runner then closes the session.
    drop(window);
    let session = Session::open(&session).unwrap();
    assert_eq!(session.end.unwrap().outcome, "stop");
}

#[test]
fn closing_at_rest_is_not_held_up() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let root = flow.window.input_mut().viewports.get_mut(&ViewportId::ROOT);
    root.unwrap().events.push(ViewportEvent::Close);
    flow.window.step();
    assert!(!commands(&flow.window).contains(&ViewportCommand::CancelClose));
}

fn commands(window: &TestWindow) -> &[ViewportCommand] {
    &window.output().viewport_output[&ViewportId::ROOT].commands
}

#[test]
fn forces_beyond_the_calibration_ask_for_an_acknowledgement() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let tick = "I accept this, and the session records it";
    assert!(flow.window.query_by_label(tick).is_none());
    flow.type_into("depth", "45");
    assert!(flow.says("calibrated only up to"));
    assert!(!flow.is_enabled("Start  F5"));
    assert!(flow.says("tick the box"));
    flow.click(tick);
    assert!(flow.is_enabled("Start  F5"));
    // Other forces, other words: they ask again.
    flow.type_into("depth", "47");
    assert!(!flow.is_enabled("Start  F5"));
    flow.type_into("depth", "30");
    assert!(flow.window.query_by_label(tick).is_none());
    assert!(flow.is_enabled("Start  F5"));
}

#[test]
fn an_unusable_folder_is_refused_in_words_and_nothing_moves() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let file = flow.folder.path().join("a-file");
    std::fs::write(&file, "not a folder").unwrap();
    flow.type_into("sessions in", &file.display().to_string());
    flow.click("Start  F5");
    flow.wait_for_words("Not started:");
    assert!(flow.run().is_none());
    assert!(!is_motion_possible(flow.window.state().snapshot()));
}

/// Corners of all triangles of a frame.
fn vertices(window: &TestWindow) -> usize {
    let shapes = window.output().shapes.clone();
    let meshes = window.ctx.tessellate(shapes, 1.0);
    meshes
        .iter()
        .map(|one| match &one.primitive {
            Primitive::Mesh(mesh) => mesh.vertices.len(),
            Primitive::Callback(_) => 0,
        })
        .sum()
}

/// What a frame takes is what it draws; `scripts/measure window` measures the time.
#[test]
fn frames_draw_as_much_of_a_long_run_as_of_a_short_one() {
    let mut flow = WindowFlow::open(TimeScale::Factor(40.0));
    flow.click("Start  F5");
    flow.wait_for_phase(Phase::Hold);
    let samples = |flow: &WindowFlow| flow.run().map_or(0, |run| run.samples);
    let (before, early) = (samples(&flow), vertices(&flow.window));
    flow.wait_for_end();
    let (after, late) = (samples(&flow), vertices(&flow.window));
    println!("{early} vertices after {before} samples, {late} after {after}");
    assert!(after > before + 20_000, "{before} {after}");
    // Two points a pixel of five curves as wide as the window, four corners a point, and the words; each sample drawn
    // would be over 400 000.
    assert!(early.max(late) < 5 * 2 * 1280 * 4 + 20_000, "{early} {late}");
}

#[test]
fn what_a_crash_left_is_recovered_and_reported_when_the_window_opens() {
    let folder = tempfile::tempdir().unwrap();
    let crashed = folder.path().join("sessions/crashed");
    std::fs::create_dir_all(&crashed).unwrap();
    let whole = workspace().join("tests/sessions/ramp-hold-lab/000.mcap");
    let bytes = std::fs::read(whole).unwrap();
    std::fs::write(crashed.join("000.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let mut flow = WindowFlow::open_in(folder, TimeScale::Max);
    flow.wait("the recovery", |window| window.query_by_label("Recovered after a crash").is_some());
    let kept = flow.folder.path().join("sessions/crashed.recovered");
    let session = palpate_sessions::Session::open(&kept).unwrap();
    assert!(session.rows.len() > 10_000, "{}", session.rows.len());
    let expected = format!("{} samples recovered into", session.rows.len());
    assert!(flow.window.query_by_label_contains(&expected).is_some(), "{expected}");
    // The original is as it was.
    assert_eq!(std::fs::read(crashed.join("000.mcap")).unwrap(), bytes[..bytes.len() / 2]);
}

#[test]
fn a_screen_reader_is_told_state_and_numbers_as_they_change() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    flow.click("Start  F5");
    flow.wait_for_phase(Phase::Hold);
    flow.window.step();
    let live = |words: &str| {
        let node = flow.window.get_by_label_contains(words);
        node.accesskit_node().live()
    };
    assert_eq!(live("State: HOLD"), Live::Assertive);
    assert_eq!(live(" N, depth "), Live::Polite);
    // What merely stands there is read when somebody comes to it.
    assert_eq!(live("depth (mm)"), Live::Off);
}

#[test]
fn what_is_typed_into_a_number_that_was_clicked_takes_its_place() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    for (name, text) in [("hold", "30"), ("speed", "1.5")] {
        flow.window.get_by_label(name).click();
        flow.window.run_steps(3);
        flow.window.get_by_label(name).type_text(text);
        flow.window.run_steps(2);
        assert_eq!(flow.window.get_by_label(name).value().as_deref(), Some(text));
    }
    // A second click places the caret as usual.
    flow.window.get_by_label("speed").click();
    flow.window.run_steps(3);
    flow.window.get_by_label("speed").type_text("0");
    flow.window.run_steps(2);
    let value = flow.window.get_by_label("speed").value().unwrap();
    assert!(value.len() == 4 && value.contains('0'), "{value}");
}
