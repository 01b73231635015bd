//! Protocols in the window by accessible name: chosen, filled in, paused, resumed, finished early, answered.

use eframe::egui::Key;
use egui_kittest::kittest::Queryable;
use palpate_analysis::window_requests::WorkbenchRequest;
use palpate_drivers::sim::{SimProfile, SimSettings};
use palpate_model::calibration::Calibration;
use palpate_model::rig::{Limits, Phase};
use palpate_protocols::engine::{EndingKind, PauseView};
use palpate_runner::{RunView, TimeScale};
use palpate_sessions::{CalibrationStore, Session, save_document};
use palpate_tests::flow::WindowFlow;
use palpate_window::window::WindowOptions;

/// Opens the list of protocols and takes one by its title.
fn choose(flow: &mut WindowFlow, title: &str) {
    flow.click("Change protocol...");
    flow.click(title);
    flow.window.run_steps(2);
}

/// Waits until the run on the screen is as wanted.
fn wait_for(flow: &mut WindowFlow, what: &str, is_so: impl Fn(&RunView) -> bool) {
    flow.wait(what, |window| window.state().snapshot().run.as_ref().is_some_and(&is_so));
    flow.window.run_steps(2);
}

fn is_paused(run: &RunView) -> bool {
    matches!(run.pause, PauseView::Paused { .. })
}

/// Fills in a short preconditioning of so many cycles.
fn short_preconditioning(flow: &mut WindowFlow, cycles: &str) {
    for (name, text) in [
        ("operator", "Ada"),
        ("specimen", "S-014"),
        ("specimen.source", "pig stomach"),
        ("cycles", cycles),
        ("rest", "2 s"),
        ("depth", "5"),
        ("speed", "3"),
    ] {
        flow.type_into(name, text);
    }
}

#[test]
fn preconditioning_is_paused_after_a_cycle_and_resumed() {
    let mut flow = WindowFlow::open(TimeScale::Factor(10.0));
    choose(&mut flow, "Preconditioning to a depth");
    assert!(flow.says("Depth as planned"));
    assert!(!flow.is_enabled("Start  F5"));
    assert!(flow.says("fill in operator, specimen, specimen.source first"));
    short_preconditioning(&mut flow, "2");
    assert!(flow.is_enabled("Start  F5"));
    flow.click("Start  F5");
    wait_for(&mut flow, "the first cycle", |run| run.cycle == 1);
    assert!(flow.says("cycle 1 of 2"));
    flow.window.check_accessibility();
    assert!(!flow.is_enabled("Resume  F9") && flow.says("Pause the run to enable Resume"));
    flow.click("Pause after cycle 1  F4");
    flow.window.run_steps(2);
    wait_for(&mut flow, "the pause", is_paused);
    assert!(flow.says("State: PAUSED") && flow.says("Resume continues"));
    assert!(!flow.is_enabled("Pause  F7"));
    assert!(flow.is_enabled("Stop motion  F12") && flow.is_enabled("Halt  F11"));
    flow.click("Resume  F9");
    // What the screen says, not the run, which is ahead of it.
    flow.wait("the second cycle", |window| {
        window.query_all_by_label_contains("cycle 2 of 2").count() > 0
    });
    assert!(!flow.says("State: PAUSED"));
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
    let cycles: Vec<u32> = run.cycle_starts.iter().map(|(_, cycle)| *cycle).collect();
    assert_eq!(cycles, [1, 2]);
    flow.window.run_steps(2);
    assert!(flow.says("change from the first") && flow.says(" %"));
    let session = Session::open(&flow.sessions()[0]).unwrap();
    assert_eq!(session.manifest.plan["name"], "preconditioning");
    assert_eq!(session.manifest.specimen, "S-014");
}

#[test]
fn an_interrupted_ramp_is_not_resumed_but_finished_early() {
    let mut flow = WindowFlow::open(TimeScale::Factor(10.0));
    choose(&mut flow, "Preconditioning to a depth");
    short_preconditioning(&mut flow, "3");
    // A ramp that a busy computer does not miss: a minute of session time.
    flow.type_into("speed", "0.09");
    flow.window.key_press(Key::F5);
    flow.wait_for_phase(Phase::Ramp);
    flow.window.key_press(Key::F7);
    wait_for(&mut flow, "the pause", is_paused);
    assert!(!flow.is_enabled("Resume  F9"));
    assert!(flow.says("the tissue relaxes while an indentation is interrupted"));
    // The key does no more than the button.
    flow.window.key_press(Key::F9);
    flow.window.run_steps(10);
    assert!(flow.run().is_some_and(|run| is_paused(&run)));
    // On another screen the run can still be steered.
    flow.click("Trade");
    flow.window.key_press(Key::F10);
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
    assert!(run.cycle_starts.len() == 1 && run.derived.depth.is_some_and(|depth| depth.0 < 0.0));
}

#[test]
fn abort_and_halt_end_a_paused_run() {
    for (control, ending) in [
        ("Abort", EndingKind::Abort),
        ("Halt  F11", EndingKind::Halt),
        ("Stop motion  F12", EndingKind::Stop),
    ] {
        let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
        flow.click("Start  F5");
        flow.wait_for_phase(Phase::Contact);
        flow.click("Pause  F7");
        wait_for(&mut flow, "the pause", is_paused);
        flow.click(control);
        wait_for(&mut flow, "the axis at rest", |run| {
            run.holding.is_some() || run.outcome.is_some()
        });
        assert!(!flow.says("State: PAUSED"), "{control}");
        if flow.run().is_some_and(|run| run.outcome.is_none()) {
            flow.click("Close session");
        }
        let run = flow.wait_for_end();
        assert_eq!(run.outcome.unwrap().ending, ending, "{control}");
    }
}

#[test]
fn a_file_with_a_mistake_shows_its_line_and_runs_once_corrected() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let file = flow.folder.path().join("own.toml");
    let good = "palpate = 1\nname = \"own\"\nversion = 1\ntitle = \"My own\"\nabout = \"Press and wait.\"\nsource = \"mine\"\n[parameters]\ndeep = { default = \"4 mm\", about = \"how deep\" }\n[procedure]\nsteps = [\n  { do = \"self-test\" },\n  { do = \"home\" },\n  { do = \"tare\" },\n  { do = \"find-contact\" },\n  { do = \"ramp\", speed = \"3 mm/s\", depth = \"$deep\" },\n  { do = \"hold\", for = \"1 s\" },\n  { do = \"retract\" },\n]\n";
    std::fs::write(&file, good.replace("\"ramp\"", "\"rmap\"")).unwrap();
    flow.click("Change protocol...");
    assert!(!flow.is_enabled("Open"));
    flow.type_into("protocol file", &file.display().to_string());
    flow.click("Open");
    flow.wait_for_words("line 15: ");
    assert!(flow.says("did you mean 'ramp'?"));
    assert!(!flow.is_enabled("Start  F5"));
    assert!(flow.says("correct the protocol file or choose another"));
    std::fs::write(&file, good).unwrap();
    flow.click("Open");
    flow.wait("the corrected file", |window| {
        window.query_by_label("deep").is_some() || window.query_all_by_label("deep").count() > 1
    });
    flow.type_into("deep", "1e4");
    assert!(!flow.is_enabled("Start  F5"));
    assert!(flow.says("10000 mm is beyond the travel"));
    flow.type_into("deep", "3");
    flow.click("Start  F5");
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
    assert_eq!(run.plan_name, "own");
}

/// Answers so many questions for weights, to the end of the run.
fn weigh(flow: &mut WindowFlow, rounds: usize) {
    flow.click("Start  F5");
    // The run before stays on the screen until this one has its folder.
    wait_for(flow, "the new run", |run| run.outcome.is_none());
    for round in 0..rounds {
        wait_for(flow, "a question or the end", |run| {
            run.prompt.is_some() || run.outcome.is_some()
        });
        assert!(flow.says("State: YOUR TURN"), "round {round}");
        let question = |run: &RunView| run.prompt.as_ref().map(|prompt| prompt.message.clone());
        let asked = flow.run().as_ref().and_then(question);
        assert!(flow.says("left to answer") && flow.is_enabled("Not done"));
        if round == 0 {
            flow.window.check_accessibility();
            assert!(flow.says("take everything off the load cell"));
            flow.click("Done  F2");
        } else {
            flow.window.key_press(Key::F2);
            flow.window.run_steps(2);
        }
        // On a busy machine the next question may be there before a frame shows the reading.
        wait_for(flow, "the reading", |run| question(run) != asked);
    }
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
}

#[test]
fn a_calibration_is_measured_by_prompts_judged_kept_and_used() {
    let mut flow = WindowFlow::open(TimeScale::Factor(30.0));
    flow.click("Calibration");
    flow.wait_for_words("(built in)");
    flow.window.check_accessibility();
    assert!(!flow.is_enabled("Use calibration  F6") && flow.says("it is in use"));
    assert!(!flow.is_enabled("Save calibration of last run"));
    flow.click("Measure...");
    for (name, text) in [("operator", "Ada"), ("masses", "540 g"), ("repeats", "1")] {
        flow.type_into(name, text);
    }
    // None, one up, the heaviest, one down, none.
    weigh(&mut flow, 5);
    flow.wait_for_words("2 weights are too few");
    flow.click("Save this calibration");
    flow.wait_for_words("Not saved: this calibration is not good enough to be kept");
    flow.click("Run");
    flow.type_into("masses", "140, 240, 340, 440, 540, 640, 740, 840, 940 g");
    weigh(&mut flow, 21);
    flow.wait_for_words("between two weights, at 4.81 N");
    flow.click("Save this calibration");
    flow.wait_for_words("saved as ");
    flow.window.run_steps(2);
    let shelf = CalibrationStore::open(flow.folder.path());
    let kept = shelf.in_force("sim").unwrap();
    assert!(flow.says(&kept.id) && flow.says("in force"));
    assert!(flow.is_enabled("Use calibration  F6"));
    flow.window.key_press(Key::F6);
    flow.window.run_steps(3);
    assert!(flow.says("IN USE, rig sim"));
    // What is in use reads the next session.
    flow.click("Run");
    choose(&mut flow, "Ramp and hold");
    // So long that it is stopped before it is over, however busy the computer is.
    flow.type_into("hold", "600");
    flow.click("Start  F5");
    // The run before stays on the screen until this one has its folder.
    wait_for(&mut flow, "the new run", |run| run.outcome.is_none());
    flow.wait_for_phase(Phase::Hold);
    flow.click("Stop motion  F12");
    wait_for(&mut flow, "the stop", |run| run.holding.is_some());
    flow.click("Close session");
    let run = flow.wait_for_end();
    let session = Session::open(&run.folder).unwrap();
    assert_eq!(session.manifest.calibration["name"], "cell of sim");
}

#[test]
fn a_declined_prompt_stops_and_keeps_nothing() {
    let mut flow = WindowFlow::open(TimeScale::Factor(30.0));
    choose(&mut flow, "Load-cell calibration");
    assert!(flow.says("this protocol does not indent"));
    flow.type_into("operator", "Ada");
    flow.click("Start  F5");
    wait_for(&mut flow, "the question", |run| run.prompt.is_some());
    flow.click("Not done");
    wait_for(&mut flow, "the stop", |run| run.holding.is_some());
    flow.click("Close session");
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Stop);
    assert!(flow.window.query_by_label("Save this calibration").is_none());
}

#[test]
fn a_built_in_calibration_takes_the_place_of_one_of_the_library_and_of_its_doubts() {
    let folder = tempfile::tempdir().unwrap();
    let rig = palpate_drivers::open("sim", &SimSettings::default()).unwrap();
    let limits = Limits::for_travel(rig.description().travel);
    let built_in = palpate_drivers::sim::calibration(SimProfile::Lab);
    let own = Calibration { name: "cell of July".into(), ..built_in.clone() };
    save_document(folder.path(), &own).unwrap();
    let doubt = "the calibration of July is too old";
    let id = format!("{} (built in)", built_in.name);
    let request = WorkbenchRequest {
        built_in: Some(built_in),
        doubts: vec![doubt.into()],
        ..WorkbenchRequest::of(rig, own, limits, TimeScale::Max)
    };
    let options = WindowOptions { settings: None, ..WindowOptions::from_request(request) };
    let mut flow = WindowFlow::open_on(options, folder);
    flow.click("Run");
    assert!(flow.says(doubt) && !flow.is_enabled("Start  F5"));
    flow.click("Calibration");
    flow.wait_for_words(&id);
    flow.click(&id);
    flow.window.key_press(Key::F6);
    flow.window.run_steps(3);
    flow.click("Run");
    assert!(!flow.says(doubt) && flow.is_enabled("Start  F5"));
}
