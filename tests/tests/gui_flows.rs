//! Flows through the window by accessible name: no display, no graphics card, no pixels.
//!
//! Every wait is bounded by a count of frames, so a flow that hangs fails instead.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]

use eframe::egui::{Key, ViewportCommand, ViewportEvent, ViewportId};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_app::app::WorkbenchApp;
use palpate_app::report::text::{self, ParameterText};
use palpate_app::screens::exact_fit::exact_ui;
use palpate_app::shell::activity::{is_motion_possible, run_in_progress};
use palpate_app::shell::frame_meter::thread_cpu_s;
use palpate_app::window::WindowOptions;
use palpate_app::workers::fit::{Refit, fit_source};
use palpate_drivers::sim::SimSettings;
use palpate_model::fit::{FitOptions, FitReport, Parameter};
use palpate_model::rig::Phase;
use palpate_protocols::engine::EndingKind;
use palpate_protocols::runner::{LogLine, RunView, TimeScale};
use palpate_sessions::log::Session;
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;

type Window = Harness<'static, WorkbenchApp>;

/// Sleep between two frames of a wait.
const FRAME: Duration = Duration::from_millis(5);

/// Most frames of a wait: over a minute, ten times what the slowest flow took on two slow cores.
const FRAMES_MAX: usize = 12_000;

struct Flow {
    window: Window,
    folder: TempDir,
}

impl Flow {
    fn open(scale: TimeScale) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let settings = SimSettings {
            seed: 7,
            ..SimSettings::default()
        };
        let mut options = WindowOptions::open("sim", &settings, scale).unwrap();
        options.sessions = Some(folder.path().to_path_buf());
        let window = Harness::builder()
            .with_size((1280.0, 800.0))
            .build_eframe(|cc| WorkbenchApp::new(options, &cc.egui_ctx).unwrap());
        let mut flow = Self { window, folder };
        flow.wait("the first sample", |window| {
            window.state().snapshot().rig.reading.is_some()
        });
        flow
    }

    /// Draws frames until `is_done`.
    fn wait(&mut self, what: &str, is_done: impl Fn(&Window) -> bool) {
        for _ in 0..FRAMES_MAX {
            self.window.step();
            if is_done(&self.window) {
                return;
            }
            std::thread::sleep(FRAME);
        }
        panic!("{what} did not come; {}", self.story());
    }

    /// What happened so far, for a failure's message.
    fn story(&self) -> String {
        let lines = self.run().map_or(Vec::new(), |run| {
            let text = |line: &LogLine| format!("{} {}", line.at, line.text);
            run.events.iter().map(text).collect()
        });
        format!("the events were:\n{}", lines.join("\n"))
    }

    fn wait_for_phase(&mut self, phase: Phase) {
        let is_there = |run: &RunView| run.phase == phase;
        let is_stopped = |run: &RunView| run.holding.is_some() || run.outcome.is_some();
        self.wait(phase.name(), |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| is_there(run) || is_stopped(run))
        });
        assert!(
            self.run().is_some_and(|run| is_there(&run)),
            "{}",
            self.story()
        );
    }

    fn run(&self) -> Option<RunView> {
        self.window.state().snapshot().run.clone()
    }

    fn type_into(&mut self, name: &str, text: &str) {
        self.window.get_by_label(name).focus();
        self.window.step();
        self.window
            .get_by_label(name)
            .set_text_value_accesskit(text);
        self.window.run_steps(2);
    }

    fn click(&mut self, name: &str) {
        // By name and not by place: a control may be scrolled out of sight.
        self.window.get_by_label(name).click_accesskit();
        self.window.run_steps(2);
    }

    fn is_enabled(&self, name: &str) -> bool {
        !self
            .window
            .get_by_label(name)
            .accesskit_node()
            .is_disabled()
    }

    fn says(&self, words: &str) -> bool {
        self.window
            .query_all_by_label_contains(words)
            .next()
            .is_some()
    }

    fn sessions(&self) -> Vec<PathBuf> {
        std::fs::read_dir(self.folder.path())
            .unwrap()
            .map(|item| item.unwrap().path())
            .collect()
    }

    /// Waits for the exact fit of the last session; the window must then say of it what
    /// `palpate fit` prints, be it a report or a refusal. Returns the report.
    fn same_words_as_the_command_line(&mut self) -> Option<FitReport> {
        self.wait("the exact fit", |window| {
            matches!(window.state().refit(), Refit::Done(_) | Refit::Refused(_))
        });
        self.window.run_steps(2);
        let session = self.sessions().pop().unwrap();
        let fitted = fit_source(&session, None, &FitOptions::default());
        let result = match fitted {
            Ok(fitted) => fitted.result.map_err(|err| err.to_string()),
            Err(err) => Err(err.to_string()),
        };
        match result {
            Ok(report) => {
                self.says_all_of(&report);
                Some(report)
            }
            Err(reason) => {
                assert!(self.says(&format!("No exact fit: {reason}")), "{reason}");
                None
            }
        }
    }

    fn says_all_of(&self, report: &FitReport) {
        let printed = text::whole(report);
        let mut words: Vec<String> = report.sentences().map(String::from).collect();
        words.push(text::quality(report));
        for parameter in &report.parameters {
            let text = ParameterText::of(parameter);
            words.extend([text.name, text.value, text.unit, text.interval]);
        }
        for word in words {
            assert!(self.says(&word), "the window does not say '{word}'");
            assert!(printed.contains(&word), "'{word}' is not in:\n{printed}");
        }
    }

    fn wait_for_end(&mut self) -> RunView {
        self.wait("the end of the run", |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| run.outcome.is_some())
        });
        self.run().unwrap()
    }
}

#[test]
fn an_idle_window_settles_and_every_control_has_a_name() {
    let mut flow = Flow::open(TimeScale::Max);
    flow.wait("the serial ports", |window| {
        window.query_by_label("looking for them").is_none()
    });
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
    let mut flow = Flow::open(TimeScale::Max);
    flow.type_into("operator", "A. Tester");
    flow.type_into("specimen", "S-014");
    flow.type_into("hold", "5");
    flow.click("Start  F5");
    let run = flow.wait_for_end();
    let outcome = run.outcome.unwrap();
    assert_eq!(outcome.ending, EndingKind::Finish, "{}", outcome.reason);
    assert_eq!(run.log_error, None);
    assert!(flow.says("Session in"));
    assert!(flow.says("Step hold: done"));
    assert!(flow.says("State: IDLE"));
    assert_eq!(flow.sessions(), [flow.folder.path().join("session-0001")]);
    let session = Session::open(&flow.sessions()[0]).unwrap();
    assert_eq!(session.manifest.specimen, "S-014");
    assert_eq!(session.manifest.operator, "A. Tester");
    assert_eq!(session.rows.len() as u64, run.samples);
    flow.window.step();
    assert!(
        flow.is_enabled("Start  F5"),
        "a second run must be possible"
    );
}

#[test]
fn after_a_run_the_window_shows_the_fit_of_the_command_line() {
    let mut flow = Flow::open(TimeScale::Max);
    flow.type_into("hold", "10");
    flow.click("Start  F5");
    flow.wait_for_end();
    let report = flow.same_words_as_the_command_line().unwrap();
    assert!(flow.says("Exact fit") && !flow.says("Live parameters"));
    let Refit::Done(exact) = flow.window.state().refit() else {
        panic!("the fit is gone");
    };
    // The curve stands where the force stands: as late as the ramp, as high as the peak.
    let run = flow.run().unwrap();
    let ramp = run.phases.iter().find(|(_, phase)| *phase == Phase::Ramp);
    let (first, peak) = (exact.curve[0], run.force_peak.unwrap().0);
    // A sample and a tick of the runner lie between them.
    assert!((first.x - ramp.unwrap().0).abs() < 0.05, "{first:?}");
    let highest = exact.curve.iter().map(|point| point.y).fold(0.0, f64::max);
    // Noise makes the highest of ten thousand forces higher than the model: five times the rmse.
    assert!(
        (highest - peak).abs() < 6.0 * report.rmse_n,
        "{highest} {peak}"
    );
    assert!(exact.residual.len() > 1000 && exact.residual.len() <= 4000);
    // A second run begins with live numbers again.
    flow.click("Start  F5");
    flow.wait("live numbers", |window| {
        window.query_by_label("Live parameters").is_some()
    });
    assert!(!flow.says("Exact fit"));
}

#[test]
fn every_sentence_of_a_report_is_on_the_screen() {
    let parameter = |name: &str, std_error: Option<f64>| Parameter {
        name: name.into(),
        value: 1.5,
        unit: "N*s/mm^2".into(),
        std_error,
        ci95: std_error.map(|error| [1.5 - 2.0 * error, 1.5 + 2.0 * error]),
        is_fixed: false,
    };
    let report = FitReport {
        model: "a model".into(),
        parameters: vec![parameter("mu1", Some(0.1)), parameter("mu2", None)],
        r2: 0.99,
        rmse_n: 0.01,
        samples: 10,
        censored: 0,
        noise: None,
        warnings: vec!["the errors are too small".into()],
        findings: vec!["unstable from 5 to 8 mm".into()],
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
}

#[test]
fn a_wrong_speed_gives_a_sentence_and_no_start() {
    let mut flow = Flow::open(TimeScale::Max);
    for (text, sentence) in [
        ("fast", "'fast' is not a finite number"),
        ("0,75", "write it with a point"),
        ("0.7501", "cannot make 0.7501 mm/s"),
        ("900", "outside what rig sim makes"),
        ("", "a number is missing"),
    ] {
        flow.type_into("speed", text);
        assert!(flow.says(sentence), "'{text}' must say '{sentence}'");
        assert!(flow.says("correct the speed first"));
        assert!(!flow.is_enabled("Start  F5"));
        flow.window.key_press(Key::F5);
        flow.window.run_steps(5);
        assert!(
            flow.run().is_none(),
            "F5 must not start what the button refuses"
        );
    }
    flow.type_into("speed", "1.5");
    assert!(flow.is_enabled("Start  F5"));
}

#[test]
fn f12_and_escape_stop_with_a_text_field_focused() {
    for key in [Key::F12, Key::Escape] {
        let mut flow = Flow::open(TimeScale::Factor(20.0));
        flow.window.key_press(Key::F5);
        flow.wait_for_phase(Phase::Contact);
        assert!(flow.says("State: CONTACT"));
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
        // No contact was found yet: the probe stands free and there is nothing to leave.
        assert!(!flow.is_enabled("Retract  F8"));
        assert!(flow.says("nothing to retract from"));
        assert!(flow.says("retract or close it first"));
        flow.click("Close session");
        let run = flow.wait_for_end();
        assert_eq!(run.outcome.unwrap().ending, EndingKind::Stop);
        assert_eq!(run.log_error, None);
    }
}

#[test]
fn the_probe_is_retracted_after_a_stop_in_the_tissue() {
    let mut flow = Flow::open(TimeScale::Factor(40.0));
    flow.click("Start  F5");
    flow.wait_for_phase(Phase::Ramp);
    flow.click("Stop motion  F12");
    flow.wait("the offer to retract", |window| {
        window.query_by_label("Retract  F8").is_some()
    });
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
    let mut flow = Flow::open(TimeScale::Factor(20.0));
    flow.click("Start  F5");
    flow.wait_for_phase(Phase::Contact);
    assert!(is_motion_possible(flow.window.state().snapshot()));
    let root = flow.window.input_mut().viewports.get_mut(&ViewportId::ROOT);
    root.unwrap().events.push(ViewportEvent::Close);
    flow.window.step();
    assert!(commands(&flow.window).contains(&ViewportCommand::CancelClose));
    assert!(!commands(&flow.window).contains(&ViewportCommand::Close));
    flow.wait("the window closing", |window| {
        commands(window).contains(&ViewportCommand::Close)
    });
    assert!(!is_motion_possible(flow.window.state().snapshot()));
    let session = flow.sessions().remove(0);
    let Flow {
        window,
        folder: _folder,
    } = flow;
    // eframe drops the app when the window closes; the runner then closes the session.
    drop(window);
    let session = Session::open(&session).unwrap();
    assert_eq!(session.end.unwrap().outcome, "stop");
}

#[test]
fn closing_at_rest_is_not_held_up() {
    let mut flow = Flow::open(TimeScale::Max);
    let root = flow.window.input_mut().viewports.get_mut(&ViewportId::ROOT);
    root.unwrap().events.push(ViewportEvent::Close);
    flow.window.step();
    assert!(!commands(&flow.window).contains(&ViewportCommand::CancelClose));
}

fn commands(window: &Window) -> &[ViewportCommand] {
    &window.output().viewport_output[&ViewportId::ROOT].commands
}

#[test]
fn forces_beyond_the_calibration_ask_for_an_acknowledgement() {
    let mut flow = Flow::open(TimeScale::Max);
    let tick = "I accept this; it is recorded";
    assert!(flow.window.query_by_label(tick).is_none());
    flow.type_into("depth", "45");
    assert!(flow.says("calibrated only up to"));
    assert!(!flow.is_enabled("Start  F5"));
    assert!(flow.says("tick the box"));
    flow.click(tick);
    assert!(flow.is_enabled("Start  F5"));
    // Other forces, other words: they ask anew.
    flow.type_into("depth", "47");
    assert!(!flow.is_enabled("Start  F5"));
    flow.type_into("depth", "30");
    assert!(flow.window.query_by_label(tick).is_none());
    assert!(flow.is_enabled("Start  F5"));
}

#[test]
fn an_unusable_folder_is_refused_in_words_and_nothing_moves() {
    let mut flow = Flow::open(TimeScale::Max);
    let file = flow.folder.path().join("a-file");
    std::fs::write(&file, "not a folder").unwrap();
    flow.type_into("sessions in", &file.display().to_string());
    flow.click("Start  F5");
    flow.wait("the refusal", |window| {
        window
            .query_all_by_label_contains("Not started:")
            .next()
            .is_some()
    });
    assert!(flow.run().is_none());
    assert!(!is_motion_possible(flow.window.state().snapshot()));
}

#[test]
fn frames_of_a_run_stay_within_their_budget() {
    let mut flow = Flow::open(TimeScale::Factor(40.0));
    flow.click("Start  F5");
    flow.wait_for_phase(Phase::Ramp);
    let mut frame_ms: Vec<f64> = Vec::new();
    while frame_ms.len() < 200 {
        let start = thread_cpu_s().unwrap();
        flow.window.step();
        let output = flow.window.output();
        let meshes = flow.window.ctx.tessellate(output.shapes.clone(), 1.0);
        frame_ms.push((thread_cpu_s().unwrap() - start) * 1e3);
        assert!(!meshes.is_empty());
        std::thread::sleep(FRAME);
    }
    frame_ms.sort_by(f64::total_cmp);
    let (median, max) = (frame_ms[100], frame_ms[199]);
    println!(
        "CPU of layout and tessellation: median {median:.2} ms, maximum {max:.2} ms of 200 frames"
    );
    // CPU time, so that other programs do not count. It includes the harness's accessibility
    // tree, which a window without a screen reader does not build; the maximum is only printed
    // because a cold cache after a switch to another program counts, too.
    assert!(median < 8.0, "the median frame took {median:.2} ms");
}
