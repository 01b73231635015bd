//! A day of specimens in the window: queue, verdicts, repeats, and what is left after a crash.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_model::rig::Phase;
use palpate_runner::TimeScale;
use palpate_sessions::specimen_queue::{
    QueueChange, QueueCounts, QueuedSpecimen, SpecimenQueue, SpecimenState,
};
use palpate_sessions::{DataQuality, Edits, SessionSummary};
use palpate_tests::flow::WindowFlow;
use palpate_window::screens::{result, run, today};
use std::path::Path;
use std::time::UNIX_EPOCH;

fn queue(flow: &WindowFlow) -> SpecimenQueue {
    SpecimenQueue::read(flow.folder.path()).unwrap()
}

fn show_today(flow: &mut WindowFlow) {
    flow.window.key_press_modifiers(Modifiers::COMMAND, today::SCREEN.key.unwrap());
    flow.window.run_steps(3);
}

/// Types as a barcode scanner does: into whatever has the keys, then Enter.
fn scan(flow: &mut WindowFlow, name: &str) {
    flow.window.get_by_label("scan here").type_text(name);
    flow.window.run_steps(2);
    flow.window.key_press(Key::Enter);
    flow.window.run_steps(3);
}

/// Puts two specimens into the queue and the first of them into the form of Run.
fn take_first_of_two(flow: &mut WindowFlow) {
    show_today(flow);
    flow.type_into("names", "pig 1, pig 2");
    flow.click("Add");
    flow.wait_for_words("2 waiting");
    flow.click("Measure the next specimen");
    flow.window.run_steps(3);
}

/// A ramp and hold that is soon over.
fn shorten(flow: &mut WindowFlow) {
    for (name, text) in [("speed", "3"), ("depth", "6"), ("hold", "1")] {
        flow.type_into(name, text);
    }
}

fn start(flow: &mut WindowFlow) {
    let before = flow.window.state().snapshot().run.as_ref().map(|run| run.folder.clone());
    flow.window.key_press(Key::F5);
    flow.wait("the end of the run and its checks", |window| {
        let run = window.state().snapshot().run.as_ref();
        run.is_some_and(|run| run.outcome.is_some() && Some(&run.folder) != before.as_ref())
            && window.query_by_label("Accept").is_some()
    });
}

fn quality(session: &Path) -> Option<DataQuality> {
    let id = SessionSummary::read(session).unwrap().manifest.session_id;
    Edits::read(session, &id).unwrap().verdict().map(|(verdict, _)| verdict)
}

#[test]
fn a_day_of_specimens_is_measured_repeated_rejected_and_counted() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_today(&mut flow);
    flow.window.check_accessibility();
    flow.type_into("names", "pig 1, pig 2; pig 3");
    flow.click("Add");
    flow.wait_for_words("3 waiting");
    flow.window.get_by_label("scan here").focus();
    scan(&mut flow, "pig 9");
    assert!(flow.says("'pig 9' is not in the queue"));
    // Scanned: its protocol and labels are in the form of the run.
    scan(&mut flow, "pig 1");
    assert_eq!(flow.window.get_by_label("specimen").value().as_deref(), Some("pig 1"));
    shorten(&mut flow);
    start(&mut flow);
    assert_eq!(queue(&flow).open_run().unwrap().wanted.specimen, "pig 1");
    // The next one cannot begin before the verdict.
    flow.window.key_press(Key::F5);
    flow.window.run_steps(3);
    assert!(flow.says("has no verdict yet"));
    // Accepted: the day goes on with the next one, with the values that were typed.
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    flow.wait_for_words("2 waiting, 1 accepted");
    // A start by a slip is refused, for this specimen is done.
    flow.window.key_press(Key::F5);
    flow.window.run_steps(3);
    assert!(flow.says("pig 1 is accepted in the queue"));
    show_today(&mut flow);
    // The scanner's field has the keys, without a click.
    scan(&mut flow, "pig 2");
    assert_eq!(flow.window.get_by_label("specimen").value().as_deref(), Some("pig 2"));
    assert_eq!(flow.window.get_by_label("hold").value().as_deref(), Some("1"));
    start(&mut flow);
    assert!(!flow.is_enabled("Repeat"));
    flow.type_into("reason", "the specimen slipped");
    let sessions = flow.sessions().len();
    flow.click("Repeat");
    let folder = flow.folder.path().to_owned();
    flow.wait("the verdict", |_| SpecimenQueue::read(&folder).unwrap().open_run().is_none());
    flow.window.run_steps(5);
    // Nothing has moved: the specimen is laid right first.
    assert_eq!(flow.sessions().len(), sessions);
    assert_eq!(flow.window.get_by_label("specimen").value().as_deref(), Some("pig 2"));
    start(&mut flow);
    flow.type_into("reason", "torn");
    flow.click("Reject");
    flow.wait_for_words("Rejected.");
    assert!(flow.window.query_by_label("Next: pig 3").is_some());
    show_today(&mut flow);
    flow.wait_for_words("1 waiting, 1 accepted, 1 rejected");
    // What has been measured is not measured again by a slip.
    scan(&mut flow, "pig 1");
    assert!(flow.says("pig 1 is accepted"));
    let found = queue(&flow);
    let counts = QueueCounts {
        waiting: 1,
        accepted: 1,
        rejected: 1,
        runs: 3,
        rejected_runs: 2,
        ..QueueCounts::default()
    };
    assert_eq!(found.counts(), counts);
    let second = found.find("pig 2").unwrap();
    assert_eq!((second.sessions.len(), second.reason.as_str()), (2, "torn"));
    let library = flow.folder.path();
    let said: Vec<_> = found.items.iter().flat_map(|item| &item.sessions).collect();
    let said: Vec<_> = said.into_iter().map(|session| quality(&library.join(session))).collect();
    let (valid, rejected) = (Some(DataQuality::Valid), Some(DataQuality::Rejected));
    assert_eq!(said, [valid, rejected, rejected]);
}

#[test]
fn specimens_added_elsewhere_are_there_when_the_page_is_shown() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_today(&mut flow);
    flow.wait_for_words("No specimen waits");
    let specimen = QueuedSpecimen {
        specimen: "pig 5".into(),
        protocol: "ramp-hold".into(),
        labels: Default::default(),
    };
    let added = QueueChange::Added { specimens: vec![specimen] };
    SpecimenQueue::change(flow.folder.path(), UNIX_EPOCH, "Ada", "", added).unwrap();
    flow.window.key_press_modifiers(Modifiers::COMMAND, run::SCREEN.key.unwrap());
    flow.window.run_steps(3);
    show_today(&mut flow);
    flow.wait_for_words("1 waiting");
}

#[test]
fn a_window_that_ends_in_mid_run_leaves_the_specimen_to_be_judged() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    take_first_of_two(&mut flow);
    // So long that the window ends before it is over, however busy the computer is.
    flow.type_into("hold", "600");
    flow.window.key_press(Key::F5);
    flow.wait_for_phase(Phase::Hold);
    let library = flow.folder.path().to_owned();
    let end = palpate_test_support::wait::Deadline::new();
    while SpecimenQueue::read(&library).unwrap().open_run().is_none() {
        assert!(!end.is_over(), "the queue does not know of the run");
        flow.window.step();
    }
    let WindowFlow { window, folder } = flow;
    drop(window);
    let mut flow = WindowFlow::open_in(folder, TimeScale::Max);
    show_today(&mut flow);
    flow.wait_for_words("Measured, without a verdict");
    assert!(flow.window.query_by_label("Measure the next specimen").is_none());
    flow.type_into("reason", "the computer was switched off");
    flow.click("Repeat");
    flow.wait_for_words("2 waiting");
    let found = queue(&flow);
    let next = found.next().unwrap();
    assert_eq!((next.wanted.specimen.as_str(), next.rejected), ("pig 1", 1));
    // The list says why a specimen is left out.
    flow.window.get_by_label("pig 2, waiting").click_accesskit();
    flow.window.run_steps(2);
    flow.type_into("why", "no tissue left");
    flow.click("Skip");
    flow.wait_for_words("1 skipped");
    assert_eq!(queue(&flow).find("pig 2").unwrap().state, SpecimenState::Skipped);
}

#[test]
fn a_refused_change_does_not_hold_up_the_day_and_a_blinded_label_is_not_shown() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let library = flow.folder.path().to_owned();
    let labels = [("series.id".to_owned(), "treated".to_owned())];
    let specimen = QueuedSpecimen {
        specimen: "pig 1".into(),
        protocol: "ramp-hold".into(),
        labels: labels.into(),
    };
    let started = palpate_sessions::specimen_queue::start("pilot", true);
    for change in [started, QueueChange::Added { specimens: vec![specimen] }] {
        SpecimenQueue::change(&library, UNIX_EPOCH, "Ada", "", change).unwrap();
    }
    show_today(&mut flow);
    flow.wait_for_words("1 waiting");
    flow.type_into("names", "pig 1");
    flow.click("Add");
    flow.wait_for_words("already has a specimen 'pig 1'");
    flow.click("Measure the next specimen");
    flow.window.run_steps(3);
    assert_eq!(flow.window.get_by_label("specimen").value().as_deref(), Some("pig 1"));
    assert!(flow.says("labels of this specimen are hidden"));
    assert!(!flow.says("More about specimen"));
    shorten(&mut flow);
    start(&mut flow);
    let session = flow.run().unwrap().folder;
    let manifest = SessionSummary::read(&session).unwrap().manifest;
    assert_eq!(manifest.about.get("series.id").unwrap(), "treated");
    // Another screen's Ctrl+Enter shows the run before it can be judged.
    show_today(&mut flow);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    flow.window.run_steps(3);
    assert_eq!(queue(&flow).open_run().unwrap().wanted.specimen, "pig 1");
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    flow.wait_for_words("Accepted.");
}

#[test]
fn a_start_that_waits_for_a_verdict_leads_to_the_run_that_it_is_about() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    take_first_of_two(&mut flow);
    shorten(&mut flow);
    start(&mut flow);
    // The form asks for something else now, and Repeat would start that.
    flow.show(&run::SCREEN);
    flow.type_into("specimen", "guest");
    flow.show(&result::SCREEN);
    flow.type_into("reason", "the specimen slipped");
    assert!(flow.is_enabled("Reject") && !flow.is_enabled("Repeat"));
    assert!(flow.says("another specimen or protocol"));
    start(&mut flow);
    // The page of the guest cannot judge the pig.
    flow.show(&run::SCREEN);
    flow.type_into("specimen", "pig 1");
    flow.window.key_press(Key::F5);
    flow.window.run_steps(3);
    assert!(flow.says("the run of pig 1 has no verdict yet"));
    assert!(flow.says("Measured, without a verdict"));
    // The queue is read again when the page comes.
    flow.wait("the buttons of the verdict", |window| {
        let found = window.query_by_label("Accept");
        found.is_some_and(|node| !node.accesskit_node().is_disabled())
    });
    flow.click("Accept");
    flow.wait_for_words("1 waiting, 1 accepted");
    assert_eq!(queue(&flow).find("pig 1").unwrap().state, SpecimenState::Accepted);
}

#[test]
fn a_move_by_hand_leaves_the_result_of_the_run_before_it() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.click("Run");
    shorten(&mut flow);
    start(&mut flow);
    flow.wait_for_words("Exact fit");
    flow.act_by_name("Find home");
    flow.wait("the end of the move", |window| {
        let run = window.state().snapshot().run.as_ref();
        run.is_some_and(|run| run.plan_name == "check-home" && run.outcome.is_some())
    });
    flow.act_by_name("Show the screen Result");
    flow.window.run_steps(3);
    assert!(flow.says("Exact fit") && flow.says("Verdict") && flow.is_enabled("Accept"));
}

#[test]
fn a_specimen_in_the_form_does_not_keep_the_rig_from_being_checked() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    take_first_of_two(&mut flow);
    assert_eq!(flow.window.get_by_label("specimen").value().as_deref(), Some("pig 1"));
    flow.act_by_name("Run the daily check");
    flow.type_into("operator", "Ada");
    flow.window.key_press(Key::F5);
    flow.wait("the first question", |window| {
        let run = window.state().snapshot().run.as_ref();
        run.is_some_and(|run| run.prompt.is_some())
    });
    let run = flow.run().unwrap();
    let manifest = SessionSummary::read(&run.folder).unwrap().manifest;
    assert_eq!((run.plan_name.as_str(), manifest.specimen.as_str()), ("daily-check", ""));
    assert!(queue(&flow).open_run().is_none());
}
