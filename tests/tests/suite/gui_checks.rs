//! The screen of the daily checks, by accessible name: what two sessions measured, and what there is to do before the first.

use eframe::egui::Key;
use palpate_analysis::daily::{DailyCheckGate, PastCheck, judge_daily_check, keep_daily_check};
use palpate_analysis::window_requests::WorkbenchRequest;
use palpate_drivers::sim::{SimProfile, SimSettings};
use palpate_model::rig::Limits;
use palpate_protocols::engine::EndingKind;
use palpate_protocols::plans::RampHold;
use palpate_runner::{TimeScale, wall_now};
use palpate_sessions::Session;
use palpate_sessions::checks::{CheckPart, DailyCheck, add_check, read_checks};
use palpate_tests::flow::{TestWindow, WindowFlow, screen_of};
use palpate_window::screens::checks::{ChecksScreen, SCREEN};
use palpate_window::window::WindowOptions;

fn checks(window: &TestWindow) -> Option<&[PastCheck]> {
    let checks = screen_of::<ChecksScreen>(window).checks()?;
    Some(checks.as_ref().unwrap())
}

/// Runs the daily check in the window, answering what it asks for.
fn check(flow: &mut WindowFlow) {
    flow.window.key_press(Key::F5);
    flow.window.run_steps(2);
    let question = |window: &TestWindow| {
        let run = window.state().snapshot().run.as_ref()?;
        Some(run.prompt.as_ref()?.message.clone())
    };
    for _ in 0..3 {
        flow.wait("a prompt", |window| question(window).is_some());
        let asked = question(&flow.window);
        flow.window.key_press(Key::F2);
        flow.window.run_steps(2);
        // On a busy machine the next prompt may be there before a frame shows the reading.
        flow.wait("the answer", |window| question(window) != asked);
    }
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
}

#[test]
fn checks_stand_over_time_with_what_their_sessions_measured() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    flow.click(SCREEN.name);
    flow.wait("no check", |window| checks(window).is_some());
    flow.window.run_steps(2);
    flow.window.check_accessibility();
    assert!(flow.says("No daily check of this rig yet"));
    assert!(flow.says("Run it once a day"));

    flow.click("Run the daily check");
    flow.window.run_steps(3);
    flow.type_into("operator", "Ada");
    check(&mut flow);
    flow.wait_for_words("passed; it holds for today");
    // It is not judged as a calibration, and needs no verdict.
    assert!(!flow.says("too few to tell the curve") && !flow.says("Verdict"));
    assert!(!flow.says("Save this calibration"));
    let library = flow.folder.path().to_owned();
    let rig = flow.window.state().snapshot().rig.description.name.clone();
    let session = flow.sessions().into_iter().find_map(|path| Session::open(&path).ok());
    let kept = read_checks(&library, &rig).unwrap().pop().unwrap();
    let judged = judge_daily_check(&session.unwrap(), wall_now()).unwrap();
    assert_eq!(DailyCheck { at: kept.at, ..judged }, kept);
    let gone = DailyCheck { session_id: "a session that is gone".into(), ..kept.clone() };
    add_check(&library, &gone).unwrap();

    flow.click(SCREEN.name);
    flow.wait("both checks", |window| checks(window).is_some_and(|checks| checks.len() == 2));
    flow.window.run_steps(2);
    flow.window.check_accessibility();
    let [first, second] = checks(&flow.window).unwrap() else {
        panic!("two checks were kept");
    };
    assert_eq!((&first.check, &second.check), (&kept, &gone));
    // Of what is not in the library nothing is known but what was said then.
    assert_eq!((second.zero, second.weight), (None, None));
    let (zero, weight) = (first.zero.unwrap(), first.weight.unwrap());
    let part = |what: &str| kept.parts.iter().find(|part| part.what == what).unwrap();
    // The numbers of the plot are those of the sentences.
    for (what, text) in
        [("zero", format!("{:+.3} N", zero.newtons)), ("zero", format!("{:.3} N", zero.limit))]
    {
        assert!(part(what).sentence.contains(&text), "{text}: {:?}", part(what));
    }
    // 840 g weigh 8.238 N, of which 1 % is allowed.
    assert!((weight.limit - 0.01 * 0.840 * 9.806_65).abs() < 1e-6, "{weight:?}");
    assert_eq!(weight.newtons.abs() <= weight.limit, part("weight").is_passed);
    for words in [format!("{:+.4}", weight.newtons), format!("{:+.4}", zero.newtons)] {
        assert!(flow.says(&words), "{words}");
    }
    assert!(flow.says(&part("weight").sentence));
}

#[test]
fn a_check_that_passes_takes_the_place_of_one_that_failed_in_what_is_to_be_acknowledged() {
    let folder = tempfile::tempdir().unwrap();
    let words = "the way home is blocked";
    let part = CheckPart { what: "home".into(), is_passed: false, sentence: words.into() };
    let failed = DailyCheck {
        at: wall_now().into(),
        rig: "sim".into(),
        by: "Ada".into(),
        session_id: "some session".into(),
        calibration: "cell".into(),
        is_passed: false,
        parts: vec![part],
    };
    add_check(folder.path(), &failed).unwrap();
    let rig = palpate_drivers::open("sim", &SimSettings::default()).unwrap();
    let plan = RampHold::default().plan();
    let gate = DailyCheckGate::of(&plan, Some(folder.path()), "sim", true, wall_now()).unwrap();
    let limits = Limits::for_travel(rig.description().travel);
    let calibration = palpate_drivers::sim::calibration(SimProfile::Lab);
    let request = WorkbenchRequest {
        to_acknowledge: gate.to_acknowledge(),
        ..WorkbenchRequest::of(rig, calibration, limits, TimeScale::Factor(20.0))
    };
    let options = WindowOptions { settings: None, ..WindowOptions::from_request(request) };
    let mut flow = WindowFlow::open_on(options, folder);
    flow.click("Run");
    flow.window.run_steps(3);
    assert!(flow.says(words) && !flow.is_enabled("Start  F5"));
    flow.act_by_name("Run the daily check");
    flow.type_into("operator", "Ada");
    check(&mut flow);
    flow.wait_for_words("passed; it holds for today");
    flow.act_by_name("Protocol ramp-hold");
    assert!(!flow.says(words) && flow.is_enabled("Start  F5"));
}

#[test]
fn a_session_of_another_protocol_is_no_check_with_a_library_or_without() {
    let session = palpate_tests::workspace().join("tests/sessions/ramp-hold-lab");
    let folder = tempfile::tempdir().unwrap();
    for library in [None, Some(folder.path())] {
        assert_eq!(keep_daily_check(library, &session, wall_now()), Ok(None));
    }
}
