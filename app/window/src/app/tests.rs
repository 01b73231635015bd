use super::*;
use eframe::App;
use eframe::egui::{Event, Key, Modifiers};
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_drivers::{Rig, RigEvent};
use palpate_model::Nanos;
use palpate_model::rig::{RigCommand, RigDescription};
use palpate_runner::TimeScale;
use palpate_test_support::wait::{Deadline, until};
use std::sync::Mutex;

/// Commands that a rig received, in order.
type CommandLog = Arc<Mutex<Vec<RigCommand>>>;

/// A simulated rig that obeys no command and records all.
struct Recorder(SimRig, CommandLog);

impl Rig for Recorder {
    fn description(&self) -> &RigDescription {
        self.0.description()
    }

    fn send(&mut self, command: RigCommand) {
        self.1.lock().unwrap().push(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        self.0.next_event(until)
    }

    fn is_virtual(&self) -> bool {
        true
    }
}

fn open(ctx: &Context) -> (WorkbenchApp, CommandLog) {
    let settings = SimSettings::default();
    let mut options = WindowOptions::open("sim", &settings, TimeScale::Max).unwrap();
    let commanded = CommandLog::default();
    options.request.rig = Box::new(Recorder(SimRig::new(settings), Arc::clone(&commanded)));
    options.list_ports = || Ok(Vec::new());
    // A library that is not there: nothing of this computer is read.
    let folder = tempfile::tempdir().unwrap();
    options.sessions = Some(folder.path().join("none"));
    (WorkbenchApp::new(options, ctx).unwrap(), commanded)
}

fn pressed(key: Key) -> RawInput {
    RawInput {
        events: vec![Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        }],
        ..RawInput::default()
    }
}

/// Waits until the last command of the rig is this one, and returns all.
fn all_up_to(commanded: &CommandLog, last: RigCommand) -> Vec<RigCommand> {
    until(
        || {
            let all = commanded.lock().unwrap().clone();
            (all.last() == Some(&last)).then_some(all)
        },
        || format!("{:?}", commanded.lock().unwrap()),
    )
}

#[test]
fn a_stop_key_is_sent_before_its_frame_begins_and_once() {
    let ctx = Context::default();
    let (mut app, commanded) = open(&ctx);
    let mut input = pressed(Key::F12);
    app.raw_input_hook(&ctx, &mut input);
    assert_eq!(all_up_to(&commanded, RigCommand::Stop), [RigCommand::Stop]);
    // While the window is hidden the events come again, before new ones.
    input.events.extend(pressed(Key::F11).events);
    app.raw_input_hook(&ctx, &mut input);
    all_up_to(&commanded, RigCommand::Halt);
    let mut frame = eframe::Frame::_new_kittest();
    let mut drawn = ctx.run_ui(input, |ui| app.logic(ui.ctx(), &mut frame));
    drawn.textures_delta.clear();
    // A key that is held comes again and again.
    app.raw_input_hook(&ctx, &mut pressed(Key::F12));
    let mut drawn = ctx.run_ui(pressed(Key::F12), |ui| app.logic(ui.ctx(), &mut frame));
    drawn.textures_delta.clear();
    // Whoever shows the window may have no such hook: then the frame itself does it, in one of its passes.
    let mut drawn = ctx.run_ui(pressed(Key::Escape), |ui| {
        app.logic(ui.ctx(), &mut frame);
        app.logic(ui.ctx(), &mut frame);
    });
    drawn.textures_delta.clear();
    app.workbench.operator(Operator::Halt);
    let all = until(
        || {
            let all = commanded.lock().unwrap().clone();
            (all.len() >= 4).then_some(all)
        },
        || format!("{:?}", commanded.lock().unwrap()),
    );
    use RigCommand::{Halt, Stop};
    assert_eq!(all, [Stop, Halt, Stop, Halt]);
}

/// A screen that records, for every call, whether the rig had received a stop by then.
struct Witness(CommandLog, Arc<Mutex<Vec<(&'static str, bool)>>>);

impl Witness {
    /// The stop is on its way to the runner's thread: one that was sent comes, one that was not never does.
    fn note(&self, what: &'static str) {
        let end = Deadline::new();
        let has_come = || self.0.lock().unwrap().contains(&RigCommand::Stop);
        while !has_come() && !end.is_over() {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        self.1.lock().unwrap().push((what, has_come()));
    }
}

impl Screen for Witness {
    fn left_ui(&mut self, _: &mut Ui, _: &mut Workbench, _: &mut Commands) {}

    fn middle_ui(&mut self, _: &mut Ui, _: &mut Workbench, _: &mut Commands) {}

    fn stop(&mut self) {
        self.note("stop");
    }

    fn poll(&mut self, _: &Context, _: &mut Workbench) {
        self.note("poll");
    }
}

#[test]
fn a_stop_reaches_the_rig_before_the_loops_are_stopped_and_workers_are_asked() {
    let ctx = Context::default();
    let (mut app, commanded) = open(&ctx);
    let noted = Arc::default();
    let witness = Witness(commanded, Arc::clone(&noted));
    app.screens.all.insert(0, ("Witness", Box::new(witness)));
    let mut frame = eframe::Frame::_new_kittest();
    let mut drawn = ctx.run_ui(pressed(Key::Escape), |ui| app.logic(ui.ctx(), &mut frame));
    drawn.textures_delta.clear();
    assert_eq!(*noted.lock().unwrap(), [("stop", true), ("poll", true)]);
}

#[test]
fn a_log_that_the_window_opens_with_shows_its_session_for_review() {
    let ctx = Context::default();
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("000.mcap");
    std::fs::write(&log, "").unwrap();
    let mut options = WindowOptions::open("sim", &SimSettings::default(), TimeScale::Max).unwrap();
    options.list_ports = || Ok(Vec::new());
    options.sessions = Some(folder.path().join("none"));
    options.request.to_open = vec![log];
    let mut app = WorkbenchApp::new(options, &ctx).unwrap();
    assert_eq!(app.screens.shown(), "Review");
    app.screens.poll(&ctx, &mut app.workbench);
    assert_eq!(app.workbench.front.review.as_deref(), Some(folder.path()));
}

#[test]
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
fn a_dialog_that_the_desktop_does_not_show_is_missed_on_the_screen_that_asked_for_it() {
    let ctx = Context::default();
    let (mut app, _) = open(&ctx);
    app.workbench.open_dialog(&ctx, "Today", |_| None);
    let reason = until(
        || {
            assert_eq!(app.workbench.poll_dialog(), None);
            app.workbench.dialog_refusal("Today").map(str::to_owned)
        },
        || "no refusal".to_owned(),
    );
    assert!(reason.contains("type the path"), "{reason}");
    assert_eq!(app.workbench.dialog_refusal("Run"), None);
    // The next one is another attempt.
    app.workbench.open_dialog(&ctx, "Today", |_| Some((PathPurpose::Rig, "rig.toml".into())));
    assert_eq!(app.workbench.dialog_refusal("Today"), None);
}
