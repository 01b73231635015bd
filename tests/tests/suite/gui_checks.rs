//! The screen of the daily checks, by accessible name: what two sessions measured, and what there is to do before the first.

use eframe::egui::Key;
use palpate_analysis::daily::{PastCheck, assess_daily_check};
use palpate_protocols::engine::EndingKind;
use palpate_runner::{TimeScale, wall_now};
use palpate_sessions::Session;
use palpate_sessions::checks::{DailyCheck, add_check};
use palpate_tests::flow::{TestWindow, WindowFlow, screen_of};
use palpate_window::screens::checks::{ChecksScreen, SCREEN};
use std::path::Path;

fn checks(window: &TestWindow) -> Option<&[PastCheck]> {
    let checks = screen_of::<ChecksScreen>(window).checks()?;
    Some(checks.as_ref().unwrap())
}

/// Runs the daily check in the window, answering what it asks for.
fn check(flow: &mut WindowFlow) {
    flow.window.key_press(Key::F5);
    flow.window.run_steps(2);
    for _ in 0..3 {
        flow.wait("a prompt", |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| run.prompt.is_some())
        });
        flow.window.key_press(Key::F2);
        flow.window.run_steps(2);
        flow.wait("the answer", |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| run.prompt.is_none())
        });
    }
    let run = flow.wait_for_end();
    assert_eq!(run.outcome.unwrap().ending, EndingKind::Finish);
}

/// Keeps the result of a session as `palpate daily-check` does.
fn keep(library: &Path, folder: &Path, rig: &str, session_id: Option<&str>) -> DailyCheck {
    let session = Session::open(folder).unwrap();
    let parts = assess_daily_check(&session).unwrap();
    let check = DailyCheck {
        at: wall_now().into(),
        rig: rig.into(),
        by: "Ada".into(),
        session_id: session_id.unwrap_or(&session.manifest.session_id).into(),
        calibration: "cell".into(),
        is_passed: parts.iter().all(|part| part.is_passed),
        parts,
    };
    add_check(library, &check).unwrap();
    check
}

#[test]
fn checks_stand_over_time_with_what_their_sessions_measured() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    flow.click(SCREEN.name);
    flow.wait("no check", |window| checks(window).is_some());
    flow.window.run_steps(2);
    flow.window.check_accessibility();
    assert!(flow.says("No daily check of this rig yet"));
    assert!(flow.says("Run 'palpate daily-check' once a day"));

    flow.click("Run");
    flow.click("Change protocol...");
    flow.click("Daily check");
    flow.type_into("operator", "Ada");
    check(&mut flow);
    let library = flow.folder.path().to_owned();
    let rig = flow.window.state().snapshot().rig.description.name.clone();
    let session = flow.sessions().into_iter().find(|path| Session::open(path).is_ok());
    let session = session.unwrap();
    let gone = keep(&library, &session, &rig, Some("a session that is gone"));
    let kept = keep(&library, &session, &rig, None);

    flow.click(SCREEN.name);
    flow.click("Read again  F6");
    flow.wait("both checks", |window| checks(window).is_some_and(|checks| checks.len() == 2));
    flow.window.run_steps(2);
    flow.window.check_accessibility();
    let [first, second] = checks(&flow.window).unwrap() else {
        panic!("two checks were kept");
    };
    assert_eq!((&first.check, &second.check), (&gone, &kept));
    // Of what is not in the library nothing is known but what was said then.
    assert_eq!((first.zero, first.weight), (None, None));
    let (zero, weight) = (second.zero.unwrap(), second.weight.unwrap());
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
