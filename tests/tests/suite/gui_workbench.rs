//! What stands on every screen, the rig's screen, weighing and the search for the surface, by accessible name.

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, pos2, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::Phase;
use palpate_protocols::engine::EndingKind;
use palpate_runner::programme::calibration_from_session;
use palpate_runner::replay::replay;
use palpate_runner::{RunView, TimeScale};
use palpate_sessions::log::Session;
use palpate_tests::flow::WindowFlow;
use palpate_window::screens::table::screens;
use palpate_window::screens::{rig, run};
use palpate_window::widgets::places::places;
use palpate_window::window::WindowOptions;

#[test]
fn everything_has_a_name_in_the_palette_and_what_is_closed_says_why() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.window.key_press(Key::F1);
    flow.window.run_steps(3);
    flow.window.check_accessibility();
    for words in ["Stop motion", "Retract after a stop", "Protocol sine", "no run is in progress"] {
        assert!(flow.says(words), "{words}");
    }
    for screen in screens() {
        assert!(flow.says(&format!("Screen {}", screen.name)));
    }
    flow.type_into("command", "nothing is called like this");
    assert!(flow.says("no command has this name"));
    // Its keys choose, and Enter takes.
    flow.type_into("command", "screen");
    for _ in 0..3 {
        flow.window.key_press(Key::ArrowDown);
        flow.window.run_steps(2);
    }
    flow.window.key_press(Key::Enter);
    flow.window.run_steps(3);
    assert!(
        !flow.says("a few letters of the command's name")
            && flow.window.query_by_label("command").is_none()
    );
    let button = flow.window.get_by_label(run::SCREEN.name);
    assert!(button.accesskit_node().toggled().is_some());
    // What cannot be asked for now stays where it is.
    flow.act_by_name("retract after");
    assert!(flow.window.query_by_label("command").is_some());
    // Escape stops and closes it.
    flow.window.key_press(Key::Escape);
    flow.window.run_steps(3);
    assert!(flow.window.query_by_label("command").is_none());
}

#[test]
fn a_run_starts_and_stops_by_name_and_keeps_what_was_noted() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    flow.act_by_name("start the protocol");
    flow.wait_for_phase(Phase::Contact);
    flow.type_into("note", "a visitor leaned on the table");
    flow.click("Note  F3");
    flow.window.key_press(Key::F3);
    flow.window.run_steps(3);
    // Letters and the key of one frame: the key does not overtake them.
    flow.window.get_by_label("note").focus();
    flow.window.step();
    let key = Event::Key {
        key: Key::F3,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    flow.window.input_mut().events.extend([Event::Text("door slam".into()), key]);
    flow.window.run_steps(3);
    flow.wait("all notes", |window| window.query_all_by_label_contains("note: ").count() == 3);
    flow.act_by_name("stop motion");
    flow.wait("the stop", |window| {
        let run = window.state().snapshot().run.as_ref();
        run.is_some_and(|run| run.holding.is_some())
    });
    flow.act_by_name("close the session");
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Stop);
    let session = Session::open(&flow.sessions()[0]).unwrap();
    let bodies: Vec<String> = session.entries.iter().map(|one| one.body.to_string()).collect();
    let noted =
        |words: &str| bodies.iter().any(|body| body.contains("noted") && body.contains(words));
    for words in ["a visitor leaned on the table", "mark", "door slam"] {
        assert!(noted(words), "{words} of {bodies:?}");
    }
}

#[test]
fn the_rig_is_moved_by_hand_and_every_move_is_a_session() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, rig::SCREEN.key.unwrap());
    flow.window.run_steps(3);
    flow.window.check_accessibility();
    assert!(flow.says("counter, home not known") && flow.says("to 9.0 N"));
    flow.click("Find home");
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
    flow.window.run_steps(3);
    assert!(flow.says("position from home"));
    let before = flow.window.state().snapshot().rig.reading.unwrap().pulses;
    flow.click("+5 mm");
    flow.wait("the jog", |window| {
        let run = window.state().snapshot().run.as_ref();
        run.is_some_and(|run| run.plan_name == "free-jog" && run.outcome.is_some())
    });
    let snapshot = flow.window.state().snapshot().clone();
    let moved = (snapshot.rig.reading.unwrap().pulses - before) as f64;
    // Whole pulses.
    let mm = moved * snapshot.rig.description.mm_per_pulse;
    assert!((mm - 5.0).abs() <= snapshot.rig.description.mm_per_pulse, "{mm}");
    assert_eq!(flow.sessions().len(), 2);
    // What makes no sense is reported, and nothing moves.
    flow.type_into("distance", "far");
    assert!(flow.says("not a finite number") && !flow.is_enabled("Jog"));
    flow.type_into("distance", "500");
    assert!(flow.says("at most 150 mm in either direction"));
    // A move by hand leaves the facts beside the curves as it leaves the curves: there was no other run.
    flow.show(&run::SCREEN);
    assert!(flow.says("no run yet") && !flow.says("Step "));
}

#[test]
fn no_move_by_hand_goes_past_a_daily_check_that_failed() {
    let mut options = WindowOptions::open("sim", &SimSettings::default(), TimeScale::Max).unwrap();
    options.request.to_acknowledge = vec!["the daily check failed: zero".into()];
    let mut flow = WindowFlow::open_on(options, tempfile::tempdir().unwrap());
    flow.window.key_press_modifiers(Modifiers::COMMAND, rig::SCREEN.key.unwrap());
    flow.window.run_steps(3);
    flow.click("+5 mm");
    flow.window.run_steps(10);
    assert!(flow.says("the daily check failed: zero; run the daily check, or acknowledge"));
    assert!(flow.run().is_none() && flow.sessions().is_empty());
    // Away from everything it may go, to find home.
    flow.click("Find home");
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
}

#[test]
fn the_palette_leads_to_whatever_is_chosen_ticked_or_typed() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let mut seen = 0;
    for screen in screens() {
        flow.act_by_name(&format!("screen {}", screen.name));
        let known: Vec<String> =
            places(&flow.window.ctx).into_iter().map(|(name, _)| name).collect();
        for role in [Role::CheckBox, Role::RadioButton, Role::ComboBox, Role::TextInput] {
            for node in flow.window.query_all_by_role(role) {
                let node = node.accesskit_node();
                let name = node.label().unwrap_or_default();
                assert!(
                    node.is_disabled()
                        || (!name.is_empty() && known.iter().any(|one| one.contains(&name))),
                    "{}: {role:?} '{name}' of {known:?}",
                    screen.name
                );
                seen += 1;
            }
        }
    }
    assert!(seen > 40, "{seen}");
}

#[test]
fn a_weight_that_was_read_wrongly_is_read_again_and_the_last_reading_counts() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    flow.act_by_name("protocol load-cell-calibration");
    flow.type_into("operator", "Ada");
    flow.type_into("masses", "140 g, 540 g");
    flow.type_into("repeats", "1");
    flow.window.key_press(Key::F5);
    let weighed = |flow: &WindowFlow| flow.run().map_or(0, |run| run.weight_readings.len());
    let mut redone = false;
    for _ in 0..20 {
        flow.wait("a prompt or the end", |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| run.prompt.is_some() || run.outcome.is_some())
        });
        if flow.run().unwrap().outcome.is_some() {
            break;
        }
        // What is to be done is what the prompt says, be it to put a weight on or to take it off.
        let prompt = flow.run().unwrap().prompt.unwrap();
        let deed = format!("{}, then press Done F2", prompt.message);
        assert!(flow.says(&deed) && !flow.says("Live parameters"), "{deed}");
        if weighed(&flow) == 2 && !redone {
            assert!(flow.says("Reading 3 of 7: 540 g in all"), "no place");
            flow.window.check_accessibility();
            flow.click("Last weight again");
            flow.wait("the prompt before", |window| {
                let run = window.state().snapshot().run.as_ref();
                run.is_some_and(|run| {
                    run.prompt.as_ref().is_some_and(|one| one.message.contains("140 g"))
                })
            });
            assert_eq!(weighed(&flow), 1);
            redone = true;
        }
        let question = |run: &RunView| run.prompt.as_ref().map(|prompt| prompt.message.clone());
        let asked = flow.run().as_ref().and_then(question);
        flow.window.key_press(Key::F2);
        flow.window.run_steps(2);
        // On a busy machine the next question may be there before a frame shows none.
        flow.wait("the answer", |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| question(run) != asked || run.outcome.is_some())
        });
    }
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
    assert_eq!((weighed(&flow), redone), (7, true));
    let folder = &flow.sessions()[0];
    let session = Session::open(folder).unwrap();
    let readings =
        session.entries.iter().filter(|one| one.body.to_string().contains("\"weighed\""));
    assert_eq!(readings.count(), 8, "what was read first stays in the session");
    let calibration = calibration_from_session(&session, "again").unwrap();
    assert_eq!(calibration.series_steps().count(), 7);
    // The same decisions from the record alone.
    let replayed = replay(&session, &[]).unwrap();
    assert!(replayed.first_difference.is_none(), "{replayed:?}");
}

#[test]
fn zeroing_shows_what_the_probe_feels() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    flow.act_by_name("protocol zeroing");
    flow.window.key_press(Key::F5);
    flow.wait_for_end();
    flow.window.run_steps(3);
    let run = flow.run().unwrap();
    assert_eq!(run.contact_triggers.iter().map(|one| one.pass).collect::<Vec<_>>(), [1, 2]);
    let contact = run.contact.unwrap();
    assert!(flow.says(&format!("the contact point is at {:.3}", contact.position.0)));
    // The search felt the tissue where it says that it did.
    let points = run.approach.points();
    let deepest = points.iter().map(|point| point.depth).fold(0.0, f64::max);
    assert!(run.contact_triggers.iter().all(|one| one.position.0 <= deepest + 0.1), "{deepest}");
    flow.window.check_accessibility();
}

#[test]
fn the_window_looks_as_it_was_left_and_the_tour_is_taken_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("window.json");
    let open = || {
        let mut options =
            WindowOptions::open("sim", &SimSettings::default(), TimeScale::Max).unwrap();
        options.settings = Some(file.clone());
        WindowFlow::open_on(options, tempfile::tempdir().unwrap())
    };
    let mut flow = open();
    flow.click("Simulated rig");
    assert!(flow.says("Tour 1 of 7"));
    let mut stops = 0;
    while flow.window.query_by_label("Next").is_some() {
        flow.window.check_accessibility();
        flow.click("Next");
        stops += 1;
    }
    assert_eq!(stops, 6);
    flow.click("Done with the tour");
    flow.type_into("operator", "Grace");
    flow.act_by_name("light and dark");
    flow.act_by_name("larger text");
    // The view's tabs stand right of the left panel: they move with its edge, by name and by the pointer.
    let edge = |flow: &WindowFlow| flow.window.get_by_label("Protocols").rect().left();
    let usual = edge(&flow);
    flow.act_by_name("larger left panel");
    let larger = edge(&flow);
    assert!((larger - usual - 40.0).abs() < 0.6, "{usual} {larger}");
    let grip = flow.window.get_by_label("operator").rect().center();
    let grip = pos2(larger - 8.0, grip.y);
    flow.window.drag_at(grip);
    flow.window.step();
    flow.window.hover_at(grip + vec2(25.0, 0.0));
    flow.window.step();
    flow.window.drop_at(grip + vec2(25.0, 0.0));
    flow.window.run_steps(2);
    let dragged = edge(&flow);
    assert!((dragged - larger - 25.0).abs() < 0.6, "{larger} {dragged}");
    flow.act_by_name("screen library");
    eframe::App::on_exit(flow.window.state_mut());
    let mut flow = open();
    flow.window.run_steps(3);
    assert!(!flow.says("Tour 1 of 7"));
    let ctx = flow.window.ctx.clone();
    assert!((ctx.zoom_factor() - 1.1).abs() < 1e-6);
    assert!(ctx.global_style().visuals.dark_mode);
    flow.act_by_name("screen run");
    assert!((edge(&flow) - dragged).abs() < 0.6, "{}", edge(&flow));
    assert!(
        flow.window
            .get_by_label("operator")
            .accesskit_node()
            .value()
            .is_some_and(|text| text == "Grace")
    );
}
